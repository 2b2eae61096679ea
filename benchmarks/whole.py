"""Whole processes: what starting up costs, frozen studies from the file to the report, and the making of motions."""

from __future__ import annotations

import os
import resource
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from time import perf_counter
from typing import NamedTuple

from ..motions import CloughPenzien, NearFault, SiteBasedScenario, measures
from .measure import Row, seconds

COMMANDS = ("--help", "--version", "schema", "catalogue", "status")
COMMAND_TARGET = 0.3
"""CPU time of a command that computes nothing, s."""
CALL_TARGET = 0.15
"""CPU time of the import and a simulation beyond that of importing numba and xarray, s."""
_PACKAGES = "import numba, xarray"
_CALL = """
import toppling as tp
motion = tp.motions.CloughPenzien(duration=20.0).sample(1, seed=1).isel(motion=0)
tp.simulate(tp.Block(0.4, 1.8), tp.EnergyConsistent(), motion)
"""
_STUDY = """
title = "One block"
[[blocks]]
width_m = 0.4
height_m = 1.8
[[models]]
law = "energy-consistent"
[motions]
generator = "clough-penzien"
number = 4
[ida]
im = "pga"
levels = { values = [0.2, 0.4, 0.8], unit = "g" }
"""
STUDIES = Path(__file__).parent / "studies"
CORES = 16
LARGE = 10
"""How many times as many motions the large study has as the frozen one."""
LIBRARIES = {
    "study": "import dask, matplotlib.figure, netCDF4, numba, pydantic, xarray",
    "report": "import jinja2, matplotlib.figure, netCDF4, pydantic, xarray",
}
"""Loading the libraries that a study, and a report, cannot do without."""
CLOUGH_PENZIEN = CloughPenzien(duration=20.0)
GENERATORS = {
    "site-based motion, M 6.8 at 15 km": SiteBasedScenario(magnitude=6.8, distance=15_000.0, vs30=620.0),
    "near-fault motion, M 6.8 at 8 km": NearFault(magnitude=6.8, distance=8_000.0, vs30=620.0),
    "Clough–Penzien motion of 20 s": CLOUGH_PENZIEN,
}
NUMBER = 32
"""Motions made at a time: motions of a study share vectors."""
MOTION_TARGET, MEASURE_TARGET = 2.0, 1.0
"""CPU time of a simulated motion and of the measures of a motion, ms."""


class Spent(NamedTuple):
    """What a process took: CPU time of all its threads and its children, s; wall time, s."""

    cpu: float
    wall: float


def spent(arguments: Sequence[str], folder: Path, settings: Mapping[str, str] | None = None) -> Spent:
    """Run Python with `arguments` in a folder, with further environment variables; return what it took.

    It may store bytecode, as it does for every user: else each process would compile all modules once more.
    RuntimeError with its last line where it fails.
    """
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    start = perf_counter()
    done = subprocess.run(
        [sys.executable, *arguments],
        cwd=folder,
        env={**environment, **(settings or {})},
        capture_output=True,
        text=True,
        check=False,
    )
    wall = perf_counter() - start
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    if done.returncode:
        reason = (done.stderr.strip().splitlines() or ["no message"])[-1]
        raise RuntimeError(f"{' '.join(arguments)}: ended with {done.returncode}: {reason}")
    return Spent(after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime, wall)


def making(repeats: int = 5) -> list[Row]:
    """Measure the CPU time of a motion by generator and of its measures, ms."""
    shakes = CLOUGH_PENZIEN.sample(NUMBER, seed=1)
    tasks = [partial(generator.sample, NUMBER, seed=2) for generator in GENERATORS.values()]
    *made, measured = (1e3 * taken / NUMBER for taken in seconds([*tasks, partial(measures, shakes)], repeats))
    rows = [{"what": name, "cpu": taken, "target": MOTION_TARGET} for name, taken in zip(GENERATORS, made, strict=True)]
    return [*rows, {"what": "usual measures of a motion", "cpu": measured, "target": MEASURE_TARGET}]


def first_use(repeats: int = 5) -> list[Row]:
    """Measure commands that compute nothing, and the first simulation of a process: medians of `repeats`, in turns."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "study.toml").write_text(_STUDY, encoding="utf-8")
        command = ("-m", "toppling")
        spent([*command, "run", "study.toml", "--out", "out"], folder)  # (compiles what the simulation needs, too)
        tasks = {what: [*command, what, *(["out"] if what == "status" else [])] for what in COMMANDS}
        tasks |= {code: ["-c", code] for code in (_PACKAGES, _CALL)}
        for task in tasks.values():
            spent(task, folder)
        taken = [[spent(task, folder).cpu for task in tasks.values()] for _ in range(repeats)]
    cpu = dict(zip(tasks, map(statistics.median, zip(*taken, strict=True)), strict=True))
    return [
        *({"what": f"toppling {what}", "cpu": cpu[what], "target": COMMAND_TARGET} for what in COMMANDS),
        {"what": f'python -c "{_PACKAGES}"', "cpu": cpu[_PACKAGES], "target": None},
        {"what": "import toppling and one simulation", "cpu": cpu[_CALL], "target": cpu[_PACKAGES] + CALL_TARGET},
    ]


def frozen_studies(repeats: int = 3) -> Row:
    """Measure the frozen office study from an empty cache, again, and with its report; and the large one by threads."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        text = (STUDIES / "office.toml").read_text(encoding="utf-8")
        (folder / "office.toml").write_text(text, encoding="utf-8")
        text = (STUDIES / "office_linear.toml").read_text(encoding="utf-8")
        (folder / "large.toml").write_text(text.replace("number = 200", f"number = {200 * LARGE}"), encoding="utf-8")

        def run(study: str, **settings: str) -> Spent:
            return spent(["-m", "toppling", "run", f"{study}.toml", "--out", study, "--fresh"], folder, settings)

        def cpu(*arguments: str) -> float:
            return statistics.median(spent(arguments, folder).cpu for _ in range(repeats))

        first = run("office", NUMBA_CACHE_DIR=str(folder / "cache")).cpu
        run("office", DASK_NUM_WORKERS="2")  # (what this process's cache may lack)
        again = statistics.median(run("office", DASK_NUM_WORKERS="2").cpu for _ in range(repeats))
        report = cpu("-m", "toppling", "report", "office/results.nc")
        libraries = {what: cpu("-c", code) for what, code in LIBRARIES.items()}
        slow, fast = ([run("large", DASK_NUM_WORKERS=threads) for _ in range(repeats)] for threads in ("1", "2"))
    return {
        "first": first,
        "again": again,
        "compiling": first - again,
        "report": report,
        "libraries": libraries["study"],
        "report_libraries": libraries["report"],
        "large_cpu": statistics.median(large.cpu for large in fast),
        "large_runs": 3 * 6 * 20 * 200 * LARGE,
        **speed_up(*(statistics.median(large.wall for large in runs) for runs in (slow, fast))),
    }


def speed_up(slow: float, fast: float) -> Row:
    """Return what Amdahl's law makes of the wall times (s) on one and two threads.

    With the serial part s and the divisible part p, one thread takes s + p and n take s + p/n, so that s = 2 T₂ - T₁;
    noise can bring that outside 0 to T₁, and then it counts as the nearer end.
    """
    serial = min(max(0.0, 2.0 * fast - slow), slow)
    return {"wall_one": slow, "wall_two": fast, "serial": serial, "speed_up": slow / fast, "bound": bound(serial, slow)}


def bound(serial: float, whole: float, cores: int = CORES) -> float:
    """Return how many times as fast as on one core a task can be on many, of which a part is serial (Amdahl)."""
    return whole / (serial + (whole - serial) / cores)
