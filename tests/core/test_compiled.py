"""The disk cache of compiled functions: what a folder's sources decide, in processes of their own, writable or not."""

import io
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import pytest
from llvmlite import binding as llvm
from numba.core.caching import _CacheLocator
from numba.core.registry import cpu_target

import toppling
from toppling.core import machine_code
from toppling.core.compiled import Kernel
from toppling.core.machine_code import FAMILIES, STORED, Callee, FolderCache, folder_stamp, generator, target
from toppling.models.engine.exact_runs import run_exact
from toppling.models.engine.linear_runs import run_lanes
from toppling.models.engine.pieces import solve_sample
from toppling.models.engine.propagators import step_grade
from toppling.models.engine.regions import energy_consistent_zeta
from toppling.models.engine.starts import begin_runs

CALLER = """
from toppling.core.compiled import kernel
from .callee import increment

@kernel(keep=True)
def twice(x):
    return increment(increment(x))
"""
CALLEE = """
from toppling.core.compiled import kernel

@kernel()
def increment(x):
    return x + {step}
"""
USE = """
import json
from folder.caller import twice
value = twice(1.0)
stats = twice.dispatcher.stats
print(json.dumps([value, sum(stats.cache_hits.values()), sum(stats.cache_misses.values())]))
"""
ASIDE = """
import json
from folder.caller import twice
twice.compile_aside("from aside import {function}; {function}()")
value = twice(1.0)
stats = twice.dispatcher.stats
print(json.dumps([value, sum(stats.cache_hits.values()), sum(stats.cache_misses.values())]))
"""
CHILD = """
from toppling.studies.command.ahead import end_with_parent
from folder.caller import twice

def compiles():
    end_with_parent()
    twice(1.0)

def fails():
    raise SystemExit(1)
"""
PREPARE = """
import json
import toppling as tp
from toppling.models.engine.exact_runs import run_exact
from toppling.models.engine.linear_runs import run_lanes
from toppling.models.runs import prepare
block = tp.Block(0.4, 1.8)
compiled = []
for law in (tp.DiscreteDamping(), tp.HousnerImpact()):
    prepare([law.oscillator(block)])
    compiled.append([len(run_lanes.dispatcher.signatures), len(run_exact.dispatcher.signatures)])
print(json.dumps(compiled))
"""
BITS = """
import hashlib
import numpy as np
from llvmlite.binding import ObjectFileRef
import toppling as tp
from toppling.core.machine_code import generator
from toppling.models.engine.exact_runs import run_exact
from toppling.models.engine.linear_runs import run_lanes
from toppling.models.engine.starts import begin_runs
from toppling.models.runs import run_many, trace
rng = np.random.default_rng(7)
t = np.arange(2000) * 0.02
record = 3.0 * np.exp(-(((t - 12.0) / 8.0) ** 2)) * (rng.normal(size=t.size) + np.sin(8.0 * t))
laws = [tp.DiscreteDamping(lever="R", delta=0.01), tp.EnergyConsistent(), tp.HousnerImpact(), tp.GianniniMasiani()]
blocks = [tp.Block(0.4, 1.8), tp.Block(0.7, 1.2), tp.Block(0.25, 0.9)]
oscillators = [law.oscillator(block) for law in laws for block in blocks]
results = [run_many(oscillators, np.tile(np.geomspace(0.1, 8.0, 20), (len(oscillators), 1)), record, 0.02)]
for oscillator in oscillators:
    results += trace(oscillator, record, 0.02)
print(hashlib.sha256(b"".join(one.tobytes() for one in results)).hexdigest())
for entry in (begin_runs, run_lanes, run_exact):
    cache, compiled = entry.dispatcher._cache, sum(entry.dispatcher.stats.cache_misses.values())
    for signature in entry.dispatcher.signatures:
        stored = cache._cache_file.load(cache._index_key(signature, generator()))
        _, _, (file, _) = stored[0]
        # (instructions alone: names hold numbers that count what was compiled before)
        code = b"".join(section.data() for section in ObjectFileRef.from_data(file).sections() if section.is_text())
        print(entry.py_func.__name__, compiled, len(code), hashlib.sha256(code).hexdigest())
"""
WARNED = """
import json
import warnings
from folder.caller import twice
with warnings.catch_warnings(record=True) as given:
    warnings.simplefilter("always")
    value = [twice(number) for number in {numbers}][0]
stats = twice.dispatcher.stats
counts = sum(stats.cache_hits.values()), sum(stats.cache_misses.values())
print(json.dumps([value, *counts, [warning.category.__name__ for warning in given]]))
"""
THREADS = """
import threading
import time
import toppling.core.machine_code
from folder.caller import twice
from toppling.core.compiled import Kernel

def slow(kernel, make=Kernel.make):
    made = make(kernel)
    time.sleep(2.5)  # (the second thread comes while the first makes the folder's kernels)
    return made

Kernel.make = slow
found = []
threads = [threading.Thread(target=lambda: found.append(twice(1.0))) for _ in range(8)]
for thread in threads:
    thread.start()
    time.sleep(0.6)
for thread in threads:
    thread.join()
assert found == [3.0] * len(threads), found
"""
NOBODY = 65534


@pytest.fixture
def folder(tmp_path):
    """A package of two kernels, a caller and its callee, in a place that every user may look into."""
    place = tmp_path / "installed" / "folder"
    place.mkdir(parents=True)
    (place / "__init__.py").write_text("", encoding="utf-8")
    (place / "caller.py").write_text(CALLER, encoding="utf-8")
    edit(place, 1.0)
    for parent in (place, *place.parents):
        if parent == Path(tempfile.gettempdir()):
            break
        parent.chmod(0o755)
    return place


def edit(place, step):
    (place / "callee.py").write_text(CALLEE.format(step=step), encoding="utf-8")


def use(place, *before, script=USE, **environment):
    """Value, loads from the cache and compilations of `twice` in a new process."""
    paths = os.pathsep.join([str(place.parent), str(Path(toppling.__file__).parents[1]), *sys.path])
    kept = {name: value for name, value in os.environ.items() if not name.startswith("NUMBA_")}
    done = subprocess.run(
        [*before, sys.executable, "-B", "-c", script],
        env={**kept, "PYTHONPATH": paths, **environment},
        cwd=place.parent,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def check(place, *before, **environment):
    """Compiled once, loaded after, compiled again where the callee in the other file was edited; a touch is no edit."""
    assert use(place, *before, **environment) == [3.0, 0, 1]
    assert use(place, *before, **environment) == [3.0, 1, 0]
    edit(place, 10.0)
    assert use(place, *before, **environment) == [21.0, 0, 1]
    assert use(place, *before, **environment) == [21.0, 1, 0]
    (place / "callee.py").touch()
    assert use(place, *before, **environment) == [21.0, 1, 0]
    (place / "unused.py").write_text("", encoding="utf-8")
    assert use(place, *before, **environment) == [21.0, 0, 1]


@pytest.mark.slow
def test_an_edited_callee_compiles_its_caller_again(folder):
    check(folder)
    assert [one.name.split(".")[0] for one in (folder / "__pycache__").glob("*.nbi")] == ["caller"]


@pytest.mark.slow
def test_a_cache_directory(folder, tmp_path):
    check(folder, NUMBA_CACHE_DIR=str(tmp_path / "cache"))
    assert not list(folder.rglob("*.nbi"))


@pytest.mark.slow
def test_a_read_only_installation(folder, tmp_path):
    """Where only home may be written, the cache lies there, and sees edits as well."""
    home = tmp_path / "home"
    home.mkdir()
    check(folder, *who_may_not_write(folder, home), HOME=str(home), XDG_CACHE_HOME=str(home / "cache"))
    assert not list(folder.rglob("*.nbi"))
    assert list(home.rglob("*.nbi"))


@pytest.mark.slow
def test_code_that_came_with_the_wheel(folder, tmp_path):
    """It is loaded where it fits, and never written to: another target and an edited source compile as without it."""
    made, own = tmp_path / "made", {"NUMBA_CACHE_DIR": str(tmp_path / "own")}
    assert use(folder, NUMBA_CACHE_DIR=str(made)) == [3.0, 0, 1]
    shutil.copytree(next(made.iterdir()), folder / STORED)
    carried = {path.name: path.read_bytes() for path in (folder / STORED).iterdir()}
    assert use(folder, **own) == [3.0, 1, 0]
    assert not list((tmp_path / "own").rglob("*.nbi"))
    assert use(folder, **own, NUMBA_CPU_NAME="generic", NUMBA_CPU_FEATURES="") == [3.0, 0, 1]
    edit(folder, 10.0)
    assert use(folder, **own) == [21.0, 0, 1]
    assert use(folder, **own) == [21.0, 1, 0]
    assert {path.name: path.read_bytes() for path in (folder / STORED).iterdir()} == carried


@pytest.mark.parametrize(("lacks", "family"), [(None, "x86-64-v4"), ("avx512vl", "x86-64-v3"), ("fma", None)])
def test_target(lacks, family, monkeypatch):
    """A family that the processor has whole; else the host, and numba's own target stays the host in any case."""
    host = cpu_target.target_context.codegen().magic_tuple()[1:]
    assert host[0] == llvm.get_host_cpu_name()
    assert generator().magic_tuple()[1:] == target()
    has = dict.fromkeys([name for names in FAMILIES.values() for name in names], True) | {lacks: False}
    monkeypatch.setattr(llvm, "get_host_cpu_features", lambda: has)
    monkeypatch.setattr(llvm, "get_process_triple", lambda: "x86_64-unknown-linux-gnu")
    assert target.__wrapped__() == ((family, "") if family else host)


def who_may_not_write(folder, home):
    """The beginning of a command that runs as another user, or where the folder is mounted to be read alone."""
    if os.geteuid() != 0:
        pytest.skip("needs root, to be another user or to mount the installation for reading alone")
    as_nobody = ("setpriv", f"--reuid={NOBODY}", f"--regid={NOBODY}", "--clear-groups")
    mounted = ("unshare", "--mount", "sh", "-c", 'mount --bind "$0" "$0" && mount -o remount,ro,bind "$0" && exec "$@"')
    if works(*as_nobody):
        os.chown(home, NOBODY, NOBODY)
        return as_nobody
    if works(*mounted, str(folder)):
        return (*mounted, str(folder))
    pytest.skip("neither another user (setpriv) nor a read-only mount (unshare) can run this Python")


def works(*before):
    if shutil.which(before[0]) is None:
        return False
    return (
        subprocess.run([*before, sys.executable, "-c", "import numba"], capture_output=True, check=False).returncode
        == 0
    )


@pytest.mark.lowest
def test_no_folder_is_named_as_a_home(tmp_path, monkeypatch):
    """A user without a name and a home, who may not write to the installation: numba would make a folder "~" here."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(machine_code.config, "CACHE_DIR", "")
    monkeypatch.setattr(machine_code.os, "access", lambda *_: False)
    monkeypatch.setattr(machine_code.os.path, "expanduser", lambda path: path)
    machine_code.warn_of_no_cache.cache_clear()
    alone = Kernel(run_exact.py_func, True, {})
    alone._made = alone.make()
    assert alone.dispatcher._cache.cache_path == str(Path(run_exact.py_func.__code__.co_filename).parent / STORED)
    with pytest.warns(machine_code.UncachedCode, match="compiled code cannot be kept"):
        assert alone.dispatcher._cache.load_overload((), cpu_target.target_context) is None
    alone.compile_aside("")
    assert alone._aside is None
    assert not any(tmp_path.iterdir())


@pytest.mark.slow
@pytest.mark.parametrize("home", ["~", os.devnull])
def test_carried_code_without_a_writable_folder(folder, tmp_path, home):
    """A user without a home and a writable installation loads the wheel's code, is warned once of gaps, keeps nothing.

    A home of "~" is one without a name, and here a folder of that name could be made in the working directory.
    """
    made, other = tmp_path / "made", tmp_path / "other"
    assert use(folder, NUMBA_CACHE_DIR=str(made)) == [3.0, 0, 1]
    other.mkdir()
    before, homeless = who_may_not_write(folder, other), {"HOME": home, "XDG_CACHE_HOME": f"{home}/.cache"}
    folder.parent.chmod(0o777)
    paths = sorted(tmp_path.rglob("*"))
    assert use(folder, *before, script=WARNED.format(numbers=[1.0, 1]), **homeless) == [3.0, 0, 2, ["UncachedCode"]]
    assert sorted(tmp_path.rglob("*")) == paths
    shutil.copytree(next(made.iterdir()), folder / STORED)
    carried = {path: path.read_bytes() for path in (folder / STORED).iterdir()}
    assert use(folder, *before, script=WARNED.format(numbers=[1.0]), **homeless) == [3.0, 1, 0, []]
    for _ in range(2):
        assert use(folder, *before, script=WARNED.format(numbers=[1.0, 1]), **homeless) == [3.0, 1, 1, ["UncachedCode"]]
    assert sorted(tmp_path.rglob("*")) == sorted([*paths, folder / STORED, *carried])
    assert {path: path.read_bytes() for path in carried} == carried


def test_what_the_engine_keeps():
    """Its entry points, stamped by the engine's folder; what only kernels call has no file of its own."""
    for entry in (begin_runs, run_lanes, run_exact, energy_consistent_zeta):
        assert isinstance(entry.dispatcher._cache, FolderCache)
        assert entry.dispatcher._cache._cache_file._source_stamp == folder_stamp(
            Path(toppling.__file__).parent / "models/engine"
        )
    assert not isinstance(solve_sample.dispatcher._cache, FolderCache)


@pytest.mark.slow
@pytest.mark.longest
def test_bits_do_not_depend_on_who_compiled(tmp_path):
    """The code that other processes stored, and that of one which loads a part of it and compiles the rest, are one.

    In a fresh checkout, as in `.ci/run`, the stored code is of processes that compiled the whole of what they needed.
    """

    def used(**environment):
        command = [sys.executable, "-c", BITS]
        done = subprocess.run(command, env={**os.environ, **environment}, capture_output=True, text=True, check=True)
        digest, *lines = done.stdout.splitlines()
        names, compiled, sizes, codes = zip(*map(str.split, lines), strict=True)
        assert min(map(int, sizes)) > 1000
        return digest, dict(zip(names, codes, strict=True)), dict(zip(names, map(int, compiled), strict=True))

    used()  # (compiles what is not stored)
    digest, whole, compiled = used()
    assert compiled == {"begin_runs": 0, "run_lanes": 0, "run_exact": 0}
    cache = begin_runs.dispatcher._cache
    place = tmp_path / _CacheLocator.get_suitable_cache_subpath(begin_runs.py_func.__code__.co_filename)
    place.mkdir()
    for file in Path(cache.cache_path).glob(f"{cache._impl.filename_base}.*"):
        shutil.copy(file, place)
    part = used(NUMBA_CACHE_DIR=str(tmp_path))
    assert part == (digest, whole, {"begin_runs": 0, "run_lanes": 1, "run_exact": 1})
    assert used(NUMBA_CACHE_DIR=str(tmp_path)) == (digest, whole, compiled)


@pytest.mark.slow
def test_first_calls_in_several_threads(folder):
    """The kernels of a folder are made known to each other before any thread compiles one of them."""
    paths = os.pathsep.join([str(folder.parent), str(Path(toppling.__file__).parents[1])])
    done = subprocess.run(
        [sys.executable, "-c", THREADS],
        env={**os.environ, "PYTHONPATH": paths},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr


INTERRUPTED = """
import pickle
import toppling.core.machine_code
from folder.caller import twice
from toppling.core.compiled import Kernel
assert pickle.loads(pickle.dumps(twice)) is twice
make, calls = Kernel.make, []

def interrupted(kernel):
    calls.append(kernel)
    if len(calls) == 2:
        raise KeyboardInterrupt
    return make(kernel)

Kernel.make = interrupted
try:
    twice(1.0)
except KeyboardInterrupt:
    assert twice(1.0) == 3.0
    assert pickle.loads(pickle.dumps(twice)) is not None
else:
    raise AssertionError("it was not interrupted")
"""


@pytest.mark.slow
def test_an_interrupted_first_call_can_be_made_again(folder):
    """Nothing is lost where making the kernels of a folder is interrupted; and a kernel is pickled by its name."""
    paths = os.pathsep.join([str(folder.parent), str(Path(toppling.__file__).parents[1])])
    environment = {**os.environ, "PYTHONPATH": paths}
    done = subprocess.run(
        [sys.executable, "-c", INTERRUPTED], env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr


def test_a_callee_runs_by_itself():
    """Called from Python, with machine code of its own; its callers have theirs."""
    assert isinstance(step_grade, Kernel)
    assert isinstance(step_grade.dispatcher, Callee)
    assert step_grade(0.1) == step_grade.py_func(0.1)


@pytest.mark.slow
@pytest.mark.parametrize(("function", "found"), [("compiles", [3.0, 1, 0]), ("fails", [3.0, 0, 1])])
def test_a_kernel_that_another_process_compiles(function, found, folder):
    """The first call waits for the code; it compiles where the other process did not."""
    (folder.parent / "aside.py").write_text(CHILD, encoding="utf-8")
    assert use(folder, script=ASIDE.format(function=function)) == found
    assert use(folder, script=ASIDE.format(function="fails")) == [3.0, 1, 0]


@pytest.mark.slow
def test_code_is_stored_when_its_file_is_there(folder):
    """numba writes the index first: who waits for the code must not take that for it."""
    use(folder)
    script = "from folder.caller import twice; print(int(twice.on_disk))"
    assert use(folder, script=script) == 1
    (code,) = (folder / "__pycache__").glob("*.nbc")
    code.unlink()
    assert use(folder, script=script) == 0
    assert use(folder) == [3.0, 0, 1]


def test_a_process_ends_with_the_one_that_started_it():
    script = (
        "import time; from toppling.studies.command.ahead import end_with_parent; end_with_parent(); time.sleep(100.0)"
    )
    child = subprocess.Popen([sys.executable, "-c", script], stdin=subprocess.PIPE)
    child.stdin.close()
    assert child.wait(60.0) == 0


class Terminal(io.StringIO):
    """A terminal's stream."""

    def isatty(self):
        return True


def test_a_terminal_is_told_what_is_waited_for(monkeypatch):
    stream = Terminal()
    monkeypatch.setattr(sys, "stderr", stream)
    for _ in range(2):
        with machine_code.announced("a"), machine_code.announced("b"):
            time.sleep(1.5)
    told = stream.getvalue()
    assert told.count("compiling a,") == told.count(": 1 s") == 2
    assert "compiling b" not in told
    assert told.endswith(" \r")  # (the line is wiped)
    monkeypatch.setattr(sys, "stderr", io.StringIO())
    with machine_code.announced("a"):
        time.sleep(1.5)
    assert not sys.stderr.getvalue()
    with machine_code.announced("a"):
        time.sleep(4.5)
    assert sys.stderr.getvalue() == "compiling a, once after installation ..\n"


@pytest.mark.slow
def test_only_what_a_study_needs_is_compiled():
    """`prepare` leaves nothing to compile to the first run, and linear laws leave exact geometry alone."""
    done = subprocess.run([sys.executable, "-c", PREPARE], capture_output=True, text=True, check=True)
    assert json.loads(done.stdout) == [[1, 0], [1, 1]]


def test_a_stamp_sees_names_and_contents(tmp_path):
    def stamp(**files):
        place = tmp_path / str(len(list(tmp_path.iterdir())))
        place.mkdir()
        for name, text in files.items():
            (place / f"{name}.py").write_text(text, encoding="utf-8")
        return folder_stamp(place)

    assert stamp(a="x", b="y") == stamp(b="y", a="x")
    stamps = [
        stamp(a="x", b="y"),
        stamp(a="y", b="x"),
        stamp(a="xb.py 1\ny"),
        stamp(a="x"),
        stamp(c="x", b="y"),
        stamp(),
    ]
    assert len(set(stamps)) == len(stamps)
