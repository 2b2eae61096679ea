"""Whole analyses by `ida`: time and memory up to 10^7 runs, and the share of the engine by threads."""

from __future__ import annotations

import resource
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from time import perf_counter, process_time, thread_time
from typing import Any

import dask
import numpy as np
import xarray as xr

from ..core.units import STANDARD_GRAVITY
from ..fragility import ida
from ..models import DiscreteDamping, EnergyConsistent, GianniniMasiani, HousnerImpact, runs
from .measure import Row, in_a_process
from .problems import SHAKING, typical
from .whole import bound

THREADS = 2
MODELS = (
    DiscreteDamping(e=0.9),
    GianniniMasiani(e=0.9),
    EnergyConsistent(e=0.9),
    HousnerImpact(e=0.9, geometry="linear"),
)
LEVELS = STANDARD_GRAVITY * np.linspace(0.1, 1.0, 10)
RUNS_A_MOTION = 25 * len(MODELS) * LEVELS.size
SIZES = (1_000, 10_000, 100_000, 1_000_000, 10_000_000)
_AT_ONCE = 100
_CHILD = f"""
import json, sys
from {__name__} import by_threads, point
name, runs = json.loads(sys.argv[1])
print(json.dumps(globals()[name](runs)))
"""


def scale(sizes: Sequence[int] = SIZES) -> Row:
    """Measure analyses of all sizes, and the largest by threads, each in a process of its own."""
    points = [in_a_process(_CHILD, "point", size) for size in sizes]
    return {"points": points, "threads": in_a_process(_CHILD, "by_threads", sizes[-1])}


def ensemble(number: int) -> list[xr.DataArray]:
    """Return motions in arrays of a hundred, so that no more memory than their own is needed."""
    return [SHAKING.sample(min(_AT_ONCE, number - first), seed=3, first=first) for first in range(0, number, _AT_ONCE)]


def analyse(motions: list[xr.DataArray], threads: int = THREADS) -> xr.Dataset:
    """Return the results of the IDA that is measured, flags alone."""
    with dask.config.set(num_workers=threads):
        return ida(typical(), MODELS, motions, LEVELS, outputs=("overturned",))


@contextmanager
def kernel_times() -> Iterator[list[float]]:
    """Replace `run_batch` by one that notes the CPU time of its calls, in whatever thread."""
    kernel, taken = runs.run_batch, []

    def timed(*arguments: Any) -> Any:
        start = thread_time()
        answer = kernel(*arguments)
        taken.append(thread_time() - start)
        return answer

    runs.run_batch = timed  # type: ignore[assignment]
    try:
        yield taken
    finally:
        runs.run_batch = kernel


def point(number: int) -> Row:
    """Measure wall time and memory of one analysis after the engine is loaded."""
    motions = ensemble(max(1, number // RUNS_A_MOTION))
    analyse(ensemble(1))
    before = _peak_memory()
    wall, cpu = perf_counter(), process_time()
    results = analyse(motions)
    wall, cpu = perf_counter() - wall, process_time() - cpu
    size = int(results["overturned"].size)
    return {"runs": size, "wall": wall, "cpu": cpu, "memory": _peak_memory(), "memory_before": before}


def by_threads(size: int) -> Row:
    """Measure one analysis on one thread and on THREADS, and what cannot be divided of it.

    With the time s that the calling thread works alone and the CPU time T of everything on one thread, n cores are at
    most T / (s + (T - s) / n) times as fast (Amdahl).  The lower bound takes all that is not the engine as serial.
    """
    motions = ensemble(max(1, size // RUNS_A_MOTION))
    analyse(ensemble(1))
    rows = []
    for number in (1, THREADS):
        with kernel_times() as engine:
            wall, cpu, alone = perf_counter(), process_time(), thread_time()
            results = analyse(motions, number)
            wall, cpu, alone = perf_counter() - wall, process_time() - cpu, thread_time() - alone
        rows.append({"threads": number, "wall": wall, "cpu": cpu, "engine": sum(engine), "alone": alone})
    whole, serial = rows[0]["cpu"], rows[-1]["alone"]
    outside = whole - rows[0]["engine"]
    return {
        "runs": int(results["overturned"].size),
        "rows": rows,
        "speed_up": rows[0]["wall"] / rows[-1]["wall"],
        "serial": serial / whole,
        "bound": bound(serial, whole),
        "bound_outside": bound(outside, whole),
    }


def _peak_memory() -> float:
    """Return the peak memory of this process, bytes."""
    unit = 1 if sys.platform == "darwin" else 1024
    return float(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit)
