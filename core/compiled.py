"""Compiled functions: the decorator of kernels; numba is loaded when the first kernel of a folder is called.

A folder of kernels contains functions that call each other across its files, and take and return plain numbers and
arrays. They import nothing of the package except this module and themselves. Nothing of numba is loaded before the
first call. Commands without an analysis therefore need not wait for it, and need no place for its files.
"""

import functools
import importlib
import os
import pkgutil
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from typing import Any

_lock = threading.RLock()
_waiting: "dict[str, list[Kernel]]" = {}
_loaded: set[str] = set()
_beside: list[subprocess.Popen[bytes]] = []  # processes that compile more


class Kernel:
    """A function that is compiled when it is called; `dispatcher` is numba's compiled function."""

    def __init__(self, function: Callable[..., Any], keep: bool, options: dict[str, Any]) -> None:
        functools.update_wrapper(self, function)
        self.py_func = function
        self._keep = keep
        self._options = options
        self._made: Any = None
        self._aside: subprocess.Popen[bytes] | None = None

    def __call__(self, *arguments: Any) -> Any:
        """Call it, compiled."""
        if self._aside is not None:
            from .machine_code import announced  # noqa: PLC0415 - numba, which takes a second

            with announced(self.py_func.__name__):
                while self._aside.poll() is None and not self.on_disk:
                    time.sleep(0.05)
            _beside.append(self._aside)
            self._aside = None
        return self.dispatcher(*arguments)

    def compile_for(self, *arguments: Any) -> None:
        """Compile it for such arguments, without a call."""
        self.dispatcher.compile(tuple(map(self.dispatcher.typeof_pyval, arguments)))

    def compile_aside(self, statement: str) -> bool:
        """Let another process compile it by a Python statement; the first call here waits for that.

        False, and nothing is done, if it is stored, or can't be. The statement ends when its input does, with this
        process.
        """
        if not getattr(getattr(self.dispatcher, "_cache", None), "keeps", False) or self.on_disk:
            return False
        # (where no further process may be started, the first call compiles)
        with suppress(OSError):
            self._aside = subprocess.Popen(
                [sys.executable, "-c", statement],
                env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)},
                stdin=subprocess.PIPE,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
            )
        return self._aside is not None

    @property
    def dispatcher(self) -> Any:
        """The compiled function; the first use makes all kernels of the folder known to each other."""
        if self._made is None:
            folder = folder_of(self.py_func)
            # (outside of the lock, which the decorator takes while a module is imported)
            for module in pkgutil.iter_modules(getattr(sys.modules[folder], "__path__", [])):
                importlib.import_module(f"{folder}.{module.name}")
            with _lock:
                make_folder(folder)
        return self._made

    @property
    def on_disk(self) -> bool:
        """True if machine code of the kernel's folder as it is now is stored, so that nothing need be compiled."""
        # (there is none where there is no place for files)
        return bool(getattr(getattr(self.dispatcher, "_cache", None), "holds_code", False))

    def __reduce__(self) -> Any:
        """Pickle it by its name, as functions are."""
        return _named, (self.py_func.__module__, self.py_func.__qualname__)

    def make(self) -> Any:
        """Return a dispatcher, which is not yet this kernel's."""
        from .machine_code import dispatcher  # noqa: PLC0415 - numba, which takes a second

        return dispatcher(self.py_func, self._keep, self._options)


def folder_of(function: Callable[..., Any]) -> str:
    """Return the package of a kernel's module."""
    return function.__module__.rpartition(".")[0]


def make_folder(folder: str) -> None:
    """Make the dispatchers of a folder, and put them where its modules name the kernels: numba finds only these.

    A kernel gets its dispatcher last, because another thread may call it as soon as it has one; if this is interrupted,
    nothing is changed.
    """
    made = {uncompiled: uncompiled.make() for uncompiled in _waiting.get(folder, [])}
    for name, module in list(sys.modules.items()):
        if name.rpartition(".")[0] == folder:
            named = {key: value for key, value in list(vars(module).items()) if isinstance(value, Kernel)}
            vars(module).update({key: made[value] for key, value in named.items() if value in made})
    for waiting, dispatcher in made.items():
        waiting._made = dispatcher
    _loaded.add(folder)
    _waiting.pop(folder, None)


def _named(module: str, name: str) -> Any:
    """Return the kernel of a name, for unpickling."""
    return getattr(importlib.import_module(module), name)


def kernel(*, keep: bool = False, **options: Any) -> Callable[[Callable[..., Any]], Any]:
    """`numba.njit` without the global interpreter lock and with numpy's rules of division, when it is first called.

    `keep` is for kernels that Python calls, and stores them on disk. Kernels that only other kernels call are compiled
    into those. The other options are numba's.
    """

    def compiled(function: Callable[..., Any]) -> Any:
        if os.environ.get("NUMBA_DISABLE_JIT", "0") not in ("", "0"):
            return function
        uncompiled = Kernel(function, keep, options)
        with _lock:
            if folder_of(function) in _loaded:
                return uncompiled.make()
            _waiting.setdefault(folder_of(function), []).append(uncompiled)
        return uncompiled

    return compiled
