"""Machine code of kernels: numba's compiler, with a disk cache that watches a whole folder, and closed libraries.

A cached function has a stamp of numba of its own file only, so a change in a callee of another file would go unnoticed
(numba issue 1833). Here the stamp covers all sources of the folder, and this module.

The fusing of multiplications and additions depends on the function into which code is inlined. The last bits of a
result therefore depend on the copy of a callee. All callees are exported under one name, and the linker takes the copy
that was loaded first. The process that compiles would have other bits than processes that load from disk. Each function
that Python calls therefore contains its callees. Functions that only other kernels call never become machine code by
themselves.

Machine code is made for a family of processors, not for the host, so that a wheel can contain it. Other functions that
a process compiles are as numba makes them.
"""

import hashlib
import os
import sys
import threading
import time
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import cache, cached_property
from pathlib import Path
from typing import Any

import llvmlite.binding as llvm
from numba import config, jit, njit
from numba.core import caching
from numba.core.codegen import JITCodeLibrary, JITCPUCodegen
from numba.core.compiler import CompilerBase, DefaultPassBuilder
from numba.core.compiler_machinery import AnalysisPass, PassManager, register_pass
from numba.core.errors import TypingError
from numba.core.registry import CPUDispatcher, cpu_target
from numba.core.typed_passes import NativeLowering, NopythonRewrites
from numba.core.types.functions import Function
from numba.core.typing.context import Context
from numba.core.untyped_passes import InlineClosureLikes

OPTIONS: dict[str, Any] = {"nogil": True, "error_model": "numpy", "fastmath": False, "_nrt": True}
"""Default options of a kernel for numba. A callee takes an option that is not set from the caller for which it is
compiled first. The bits of a process that compiles everything would then differ from a process that loads a part.
"""

FAMILIES = {
    "x86-64-v4": ("avx512f", "avx512bw", "avx512cd", "avx512dq", "avx512vl"),
    "x86-64-v3": ("avx2", "bmi", "bmi2", "f16c", "fma", "lzcnt", "movbe"),
}
"""Required processor features of a family of kernels, the widest first (x86-64 psABI 1.0, section 3.1.1)."""
STORED = "stored"
"""Folder inside a kernel's folder, in which a wheel contains machine code."""
FUSED = ("haswell", "skylake-avx512", "x86-64-v3", "x86-64-v4", "znver2")
"""Targets whose own features fuse multiplications and additions, and whose kernels were bit-identical in tests."""


@cache
def folder_stamp(folder: Path) -> str:
    """Return a digest of all sources of a folder, by name and contents, and of this module, which sets the options."""
    digest = hashlib.sha256(Path(__file__).read_bytes())
    for file in sorted(folder.glob("*.py")):
        source = file.read_bytes()
        digest.update(f"{file.name} {len(source)}\n".encode() + source)
    return digest.hexdigest()


@cache
def target() -> tuple[str, str]:
    """Return the processor and features for which kernels are compiled: a family's, or numba's setting or host."""
    if config.CPU_NAME is None and llvm.get_process_triple().startswith("x86_64"):  # type: ignore[attr-defined]
        has = llvm.get_host_cpu_features()
        families = [family for family, needed in FAMILIES.items() if all(has.get(feature) for feature in needed)]
        if "x86-64-v3" in families:
            return families[0], ""
    _, name, features = cpu_target.target_context.codegen().magic_tuple()
    return name, features


class Generator(JITCPUCodegen):
    """numba's generator of machine code, for the kernels' target."""

    def _get_host_cpu_name(self) -> str:
        return target()[0]

    def _get_host_cpu_features(self) -> str:
        return target()[1]


@cache
def generator() -> Generator:
    """Return the generator of all kernels of this process."""
    return Generator("toppling")  # type: ignore[no-untyped-call]


@cache
def remembering(function: Any) -> Function:
    """Return a function of numba's that resolves each call once: of the 12,000 in a kernel with its callees 600 differ.

    numba keeps the last compiled form of an overloaded function by its arguments alone: those are resolved each time.
    """
    known: dict[Any, Any] = {}

    def call_type(context: Any, args: Any, kws: Any) -> Any:
        call = tuple(args), tuple(dict(kws).items())
        signature = known.get(call)
        if signature is None:
            signature = function.get_call_type(context, args, kws)
            if function.get_impl_key(signature) == function.typing_key:
                known[call] = signature
        else:
            function._impl_keys[signature.args] = function.typing_key
        return signature

    made = object.__new__(Function)
    made.__dict__ = {**vars(function), "get_call_type": call_type}
    return made


class Typing(Context):
    """numba's types of calls, remembered."""

    def __init__(self) -> None:
        self.__dict__ = cpu_target.typing_context.__dict__  # (what is registered later is known here, too)

    def _lookup_global(self, gv: Any) -> Any:
        value = super()._lookup_global(gv)  # type: ignore[no-untyped-call]
        return remembering(value) if type(value) is Function else value

    def resolve_function_type(self, func: Any, args: Any, kws: Any) -> Any:
        """Return the signature of a call."""
        function = func if isinstance(func, Function) else self._lookup_global(func)
        if type(function) is Function:
            try:
                return function.get_call_type(self, args, kws)
            except TypingError:  # (it may be typed otherwise)
                pass
        return super().resolve_function_type(func, args, kws)  # type: ignore[no-untyped-call]


@cache
def typing() -> Typing:
    """Return the types of calls in all kernels of this process."""
    return Typing()


def for_kernels(context: Any) -> Any:
    """Return numba's context of a compilation, with the kernels' generator and types instead of its own."""
    return context.subtarget(typing_context=typing(), _internal_codegen=generator())


class CarriedLocator(caching._SourceFileBackedLocatorMixin, caching._CacheLocator):
    """Locator of the machine code that a wheel carries, if there is any."""

    def __init__(self, function: Callable[..., Any], file: str) -> None:
        self._py_file, self._lineno = file, function.__code__.co_firstlineno

    def get_cache_path(self) -> str:
        return str(Path(self._py_file).parent / STORED)

    def ensure_cache_path(self) -> None:
        """Write nothing, not even to try."""


class Files(caching.CompileResultCacheImpl):
    """Place of a function's files: the first folder of numba's choice that the user can write to, else the wheel's."""

    def __init__(self, function: Callable[..., Any]) -> None:
        folder = Path(function.__code__.co_filename).parent
        # (numba would make a folder named ~ in the working directory, for a user who has no home)
        homeless = os.path.expanduser("~").startswith("~")
        nowhere = homeless and not (config.CACHE_DIR or os.access(folder, os.W_OK))  # type: ignore[attr-defined]
        self._locator_classes = [*([] if nowhere else self._locator_classes), CarriedLocator]
        super().__init__(function)  # type: ignore[no-untyped-call]


class FolderCache(caching.FunctionCache):
    """numba's disk cache of a function, stamped by its folder; numba chooses the place of the files.

    A missing file may be in the wheel, which is never written to.
    """

    _impl_class = Files

    def __init__(self, function: Callable[..., Any]) -> None:
        super().__init__(function)  # type: ignore[no-untyped-call]
        self.keeps = self._enabled = not isinstance(self._impl.locator, CarriedLocator)
        folder = Path(function.__code__.co_filename).parent
        self._cache_file, self._carried = (
            caching.IndexDataCacheFile(place, self._impl.filename_base, folder_stamp(folder))  # type: ignore[no-untyped-call]
            for place in (self.cache_path, str(folder / STORED))
        )

    @property
    def holds_code(self) -> bool:
        """True if code of the folder as it is now is stored for this numba and this target."""
        made_for = generator().magic_tuple()  # type: ignore[no-untyped-call]
        # (numba writes the index before the code that it names)
        return any(
            key[1] == made_for and os.path.exists(file._data_path(name))  # type: ignore[no-untyped-call]
            for file in (self._cache_file, self._carried)
            for key, name in file._load_index().items()  # type: ignore[no-untyped-call]
        )

    def _load_overload(self, sig: Any, target_context: Any) -> Any:
        context = for_kernels(target_context)
        for file in (self._cache_file, self._carried):
            data = file.load(self._index_key(sig, context.codegen()))  # type: ignore[no-untyped-call]
            if data is not None:
                return self._impl.rebuild(context, data)
        if not self.keeps:
            warn_of_no_cache()
        return None


class ClosedLibrary(JITCodeLibrary):
    """Machine code of a kernel with its callees, none of which other code can use, or be used for."""

    def _finalize_final_module(self) -> None:
        for function in self._final_module.functions:
            if not function.is_declaration and function.linkage.name.startswith("linkonce"):
                function.linkage = "internal"
        super()._finalize_final_module()  # type: ignore[no-untyped-call]


class LinkedLibrary(JITCodeLibrary):
    """Intermediate code of a kernel, to be linked into its callers; no machine code is made of it alone."""

    def _optimize_final_module(self) -> None:
        """Leave that to the callers, of which it becomes a part."""

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()  # type: ignore[no-untyped-call]
        self._verify_declare_only_symbols()  # type: ignore[no-untyped-call]
        self._finalized = True


def passes_of(state: Any) -> Any:
    """Return numba's passes except those for closures and expressions of arrays, which kernels do not have."""
    passes = DefaultPassBuilder.define_nopython_pipeline(state)  # type: ignore[no-untyped-call]
    passes.passes = [step for step in passes.passes if step[0] not in (InlineClosureLikes, NopythonRewrites)]
    return passes


_telling = threading.Lock()


@contextmanager
def announced(name: str) -> Iterator[None]:
    """Print the name and duration of the compiling kernel: each second on a terminal or in a notebook, else as dots."""
    if sys.stderr is None or not _telling.acquire(blocking=False):  # (a kernel within another is compiled with it)
        yield
        return
    done, printed = threading.Event(), ""
    rewrites = sys.stderr.isatty() or "ipykernel" in sys.modules

    def tell() -> None:
        nonlocal printed
        began, text = time.monotonic(), f"compiling {name}, once after installation"
        while not done.wait(1.0 if rewrites else 2.0):
            new = f"\r{text}: {time.monotonic() - began:.0f} s" if rewrites else "." if printed else f"{text} ."
            with suppress(OSError):  # (the terminal may be gone)
                print(new, end="", file=sys.stderr, flush=True)
            printed = new

    teller = threading.Thread(target=tell, daemon=True)
    teller.start()
    try:
        yield
    finally:
        done.set()
        teller.join()
        _telling.release()
        if printed:
            with suppress(OSError):
                print("\r" + " " * len(printed), end="\r", file=sys.stderr, flush=True) if rewrites else print(
                    file=sys.stderr
                )


class KeptCompiler(CompilerBase):
    """Compiler of the kernels that Python calls."""

    def compile_extra(self, func: Any) -> Any:
        """Compile a function, and report it."""
        with announced(func.__name__):
            return super().compile_extra(func)  # type: ignore[no-untyped-call]

    def define_pipelines(self) -> list[PassManager]:
        state = self.state
        state.typingctx, state.targetctx = typing(), for_kernels(state.targetctx)
        closed = ClosedLibrary(state.targetctx.codegen(), state.func_id.func_qualname)  # type: ignore[no-untyped-call]
        closed.enable_object_caching()  # type: ignore[no-untyped-call]
        state["library"] = closed
        passes = passes_of(state)
        passes.finalize()
        return [passes]


class CalleeCompiler(CompilerBase):
    """Compiler of the kernels that other kernels call: neither machine code nor wrappers for Python."""

    def define_pipelines(self) -> list[PassManager]:
        state = self.state
        state.typingctx, state.targetctx = typing(), state.targetctx.subtarget(typing_context=typing())
        state.flags = state.flags.copy()
        state.flags.no_compile = state.flags.no_cpython_wrapper = state.flags.no_cfunc_wrapper = True
        state["library"] = LinkedLibrary(state.targetctx.codegen(), state.func_id.func_qualname)  # type: ignore[no-untyped-call]
        passes = passes_of(state)
        passes.add_pass_after(CalleeDeclaration, NativeLowering)
        passes.finalize()
        return [passes]


@register_pass(mutates_CFG=False, analysis_only=True)  # type: ignore[no-untyped-call]
class CalleeDeclaration(AnalysisPass):
    """Make a callee known to its callers, which numba does only with functions that have machine code."""

    _name = "callee_declaration"

    def __init__(self) -> None:
        super().__init__()  # type: ignore[no-untyped-call]

    def run_pass(self, state: Any) -> bool:
        """Register the function by an object of its own, which replaces its missing entry point."""
        entry = object()
        state["cr"] = state["cr"]._replace(cfunc=entry)
        state.targetctx.insert_user_function(entry, state["cr"].fndesc, [state["library"]])
        return False


class Callee(CPUDispatcher):
    """A kernel that only other kernels call; called from Python, it is compiled once more for that."""

    def add_overload(self, result: Any) -> None:
        """Keep a specialisation for the callers."""
        self.overloads[tuple(result.signature.args)] = result

    def __call__(self, *arguments: Any) -> Any:
        """Run it by itself, as tests do."""
        return self.alone(*arguments)

    @cached_property
    def alone(self) -> Any:
        """The same function with machine code of its own."""
        return jit(**self.targetoptions)(self.py_func)


def dispatcher(function: Callable[..., Any], keep: bool, options: dict[str, Any]) -> Any:
    """Return the compiled function of a kernel; the function itself if numba's compilation is disabled."""
    if config.DISABLE_JIT:  # type: ignore[attr-defined]
        return function
    used = {**OPTIONS, **options}
    if not keep:
        return Callee(
            function, targetoptions={"nopython": True, "boundscheck": None, **used}, pipeline_class=CalleeCompiler
        )
    kept = njit(pipeline_class=KeptCompiler, **used)(function)
    try:
        kept._cache = FolderCache(function)
    except RuntimeError:  # (the user sets numba's locators, and none finds a folder)
        warn_of_no_cache()
    return kept


@cache
def warn_of_no_cache() -> None:
    """Warn, once, that compiled code cannot be kept."""
    warnings.warn(
        "compiled code cannot be kept, for neither the installation nor a home can be written: every process compiles "
        "it again, which takes half a minute; NUMBA_CACHE_DIR may name a folder for it",
        UncachedCode,
        stacklevel=2,
    )


class UncachedCode(UserWarning):
    """Warning that compiled code has no place on disk."""


def processor() -> str:
    """Return the processor of numba's code: "x86-64 with FMA", on which results are bit-identical, else "generic"."""
    system, name, features = generator().magic_tuple()  # type: ignore[no-untyped-call]
    fused = "+fma" in features.split(",") or (not features and name in FUSED)
    return "x86-64 with FMA" if fused and system.startswith("x86_64") else "generic"
