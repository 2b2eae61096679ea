"""Frozen studies from the file to the report: CPU time, what compiling takes of it, and what cannot be divided."""

from __future__ import annotations

import statistics
import sys
import tempfile
from pathlib import Path

from ..measure import Row
from .processes import Spent, spent

FOLDER = Path(__file__).parent.parent / "studies"
CORES = 16
LARGE = 10
"""How many times as many motions the large study has as the frozen one."""
LIBRARIES = {
    "study": "import dask, matplotlib.figure, netCDF4, numba, pydantic, xarray",
    "report": "import jinja2, matplotlib.figure, netCDF4, pydantic, xarray",
}
"""Loading the libraries that a study, and a report, cannot do without."""


def frozen_studies(repeats: int = 3, against: str | None = None) -> Row:
    """Measure the frozen office study from an empty cache, again, and with its report; and the large one by threads.

    against: the Python of another installation, whose runs of both studies are taken in turns with those of this one.
    """
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        text = (FOLDER / "office.toml").read_text(encoding="utf-8")
        (folder / "office.toml").write_text(text, encoding="utf-8")
        large = (FOLDER / "office_linear.toml").read_text(encoding="utf-8")
        (folder / "large.toml").write_text(large.replace("number = 200", f"number = {200 * LARGE}"), encoding="utf-8")
        first = spent(_run("office"), folder, {"NUMBA_CACHE_DIR": str(folder / "cache")})
        _again(folder, "office")  # (what this process's cache may lack)
        runs = [_again(folder, "office") for _ in range(repeats)]
        reports = [spent(["-m", "toppling", "report", "office/results.nc"], folder) for _ in range(repeats)]
        libraries = {
            name: statistics.median(spent(["-c", code], folder).cpu for _ in range(repeats))
            for name, code in LIBRARIES.items()
        }
        by_threads = {n: [_again(folder, "large", threads=n) for _ in range(repeats)] for n in (1, 2)}
        compared = {} if against is None else _compared(folder, against, repeats)
    again = statistics.median(one.cpu for one in runs)
    walls = {n: statistics.median(one.wall for one in some) for n, some in by_threads.items()}
    return {
        "first": first.cpu,
        "again": again,
        "compiling": first.cpu - again,
        "report": statistics.median(one.cpu for one in reports),
        "libraries": libraries["study"],
        "report_libraries": libraries["report"],
        "large_cpu": statistics.median(one.cpu for one in by_threads[2]),
        "large_runs": 3 * 6 * 20 * 200 * LARGE,
        **speed_up(walls[1], walls[2]),
        **compared,
    }


def _compared(folder: Path, other: str, repeats: int) -> Row:
    """CPU time of both studies over that of another installation: medians of repeats in turns, all compiled before."""
    ratios = {}
    for study in ("office", "large"):
        own, theirs = [], []
        for _ in range(1 + repeats):
            own.append(_with_report(folder, study, sys.executable))
            theirs.append(_with_report(folder, f"{study}_before", other))
        ratios[f"{study}_ratio"] = statistics.median(own[1:]) / statistics.median(theirs[1:])
    return ratios


def _with_report(folder: Path, study: str, python: str) -> float:
    """CPU time of a study, the small one with its report; another installation writes to a folder of its own.

    It has packages of its own, too: where this one is found by PYTHONPATH, that one must not be.
    """
    name = study.removesuffix("_before")
    commands = [["-m", "toppling", "run", f"{name}.toml", "--out", study, "--fresh"]]
    if name == "office":
        commands.append(["-m", "toppling", "report", f"{study}/results.nc"])
    settings = {"DASK_NUM_WORKERS": "2"} | ({} if name == study else {"PYTHONPATH": ""})
    return sum(spent(one, folder, settings, python).cpu for one in commands)


def speed_up(one: float, two: float) -> Row:
    """Return what Amdahl's law makes of the wall times (s) on one and two threads.

    With the serial part s and the divisible part p, one thread takes s + p and n take s + p/n, so that s = 2 T₂ - T₁;
    noise can bring that outside 0 to T₁, and then it counts as the nearer end.
    """
    serial = min(max(0.0, 2.0 * two - one), one)
    return {
        "wall_one": one,
        "wall_two": two,
        "serial": serial,
        "speed_up": one / two,
        "bound": bound(serial, one),
    }


def bound(serial: float, whole: float, cores: int = CORES) -> float:
    """Return how many times as fast as on one core a task can be on many, of which a part is serial (Amdahl)."""
    return whole / (serial + (whole - serial) / cores)


def _run(study: str) -> list[str]:
    return ["-m", "toppling", "run", f"{study}.toml", "--out", study, "--fresh"]


def _again(folder: Path, study: str, threads: int = 2) -> Spent:
    return spent(_run(study), folder, {"DASK_NUM_WORKERS": str(threads)})
