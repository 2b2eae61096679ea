"""Whole analyses by `ida`: share of the engine, cost before the first run, time and memory up to 10^7 runs, threads."""

from __future__ import annotations

import json
import resource
import statistics
import sys
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from threading import Lock
from time import perf_counter, process_time, thread_time
from typing import Any

import dask
import numpy as np
import xarray as xr

from ..core.units import STANDARD_GRAVITY
from ..fragility import ida
from ..models import DiscreteDamping, EnergyConsistent, GianniniMasiani, HousnerImpact, runs
from ..models.runs import run_many
from ..motions import CloughPenzien, RiseStrongDecay
from .measure import Row, in_a_process, oscillators
from .problems import DT, DURATION, record, typical
from .whole.studies import bound

THREADS = 2
LONG = 2000
"""Factors of the task that tells how many cores there are: a quarter of a second."""
MODELS = (
    DiscreteDamping(e=0.9),
    GianniniMasiani(e=0.9),
    EnergyConsistent(e=0.9),
    HousnerImpact(e=0.9, geometry="linear"),
)
LEVELS = STANDARD_GRAVITY * np.linspace(0.1, 1.0, 10)
RUNS_A_MOTION = 25 * len(MODELS) * LEVELS.size
SIZES = (1_000, 10_000, 100_000, 1_000_000, 10_000_000)
SHARE_RUNS = 100_000
_AT_ONCE = 100
_MODULE = __name__
_CHILD = f"""
import json, sys
from importlib import import_module
print(json.dumps(getattr(import_module({_MODULE!r}), json.loads(sys.argv[1])[0])(*json.loads(sys.argv[1])[1:])))
"""
_FIRST_CALL = f"""
import json, sys
from time import perf_counter
start = perf_counter()
import toppling
toppling.ida, toppling.EnergyConsistent, toppling.motions  # what is asked for loads
imported = perf_counter()
from importlib import import_module
answer = import_module({_MODULE!r}).first_and_second()
print(json.dumps(dict(answer, loading=imported - start)))
"""


def scale(sizes: Sequence[int] = SIZES, share_runs: int = SHARE_RUNS, repeats: int = 3) -> Row:
    """Make the measurements, each in separate processes: three with THREADS threads, the last by threads."""
    share = in_a_process(_CHILD, "kernel_share", share_runs, repeats)
    starts = [in_a_process(_FIRST_CALL) for _ in range(repeats)]
    points = [_point_or_failure(size) for size in sizes]
    first = {name: statistics.median(start[name] for start in starts) for name in starts[0]}
    return {"share": share, "first": first, "points": points, "threads": in_a_process(_CHILD, "by_threads", sizes[-1])}


def _point_or_failure(size: int) -> Row:
    """Measure one point of the cost curve; a process that the system ended (for memory) is a result as well."""
    try:
        return in_a_process(_CHILD, "point", size)
    except RuntimeError as error:
        return {"runs": size, "failed": str(error)}


def ensemble(number: int) -> list[xr.DataArray]:
    """Return motions in arrays of a hundred, so that no more memory than their own is needed."""
    shaking = CloughPenzien(omega_g=15.0, xi_g=0.6, duration=DURATION, dt=DT, envelope=RiseStrongDecay(2.0, 10.0, 0.2))
    return [shaking.sample(min(_AT_ONCE, number - first), seed=3, first=first) for first in range(0, number, _AT_ONCE)]


def analyse(motions: list[xr.DataArray], outputs: Sequence[str], threads: int = THREADS) -> xr.Dataset:
    """Return the results of the IDA that is measured."""
    with dask.config.set(num_workers=threads):
        return ida(typical(), MODELS, motions, LEVELS, outputs=outputs)


class KernelClock:
    """Sum of the CPU time of all threads in the engine; it replaces `run_batch`, in the benchmark only."""

    def __init__(self) -> None:
        self.total = 0.0
        self._lock = Lock()
        self._kernel = runs.run_batch

    def __call__(self, *arguments: Any) -> Any:
        start = thread_time()
        answer = self._kernel(*arguments)
        spent = thread_time() - start
        with self._lock:
            self.total += spent
        return answer

    def __enter__(self) -> KernelClock:
        runs.run_batch = self  # type: ignore[assignment]
        return self

    def __exit__(self, *_: object) -> None:
        runs.run_batch = self._kernel


def kernel_share(runs: int, repeats: int) -> Row:
    """Measure the share of the kernels in wall time x threads and in the process's CPU time: medians by output."""
    motions = ensemble(max(1, runs // RUNS_A_MOTION))
    analyse(motions[:1], ("overturned",))
    found: Row = {"runs": len(typical()) * len(MODELS) * LEVELS.size * sum(m.sizes["motion"] for m in motions)}
    found["cores"] = statistics.median(_cores() for _ in range(repeats))
    for name, outputs in (("peaks", ("overturned", "peak_rotation")), ("flags", ("overturned",))):
        shares = []
        for _ in range(repeats):
            with KernelClock() as clock:
                wall, cpu = perf_counter(), process_time()
                analyse(motions, outputs)
                wall, cpu = perf_counter() - wall, process_time() - cpu
            shares.append((clock.total / (wall * THREADS), clock.total / cpu, cpu / wall, wall))
        columns = [statistics.median(column) for column in zip(*shares, strict=True)]
        found[name] = dict(zip(("of_wall", "of_cpu", "cores", "wall"), columns, strict=True))
    return found


def _cores() -> float:
    """Measure the number of cores that THREADS equal, independent tasks of the engine get."""
    task = partial(run_many, oscillators(MODELS[1], typical()), np.ones((25, LONG)), record(), DT, skip=False)
    task()  # (what it allocates for the first time would be allocated by both at once)

    def spent() -> float:
        # (the clock of the process goes in steps of some ms)
        start = thread_time()
        task()
        return thread_time() - start

    with ThreadPoolExecutor(THREADS) as pool:
        wall = perf_counter()
        cpu = sum(one.result() for one in [pool.submit(spent) for _ in range(THREADS)])
        return cpu / (perf_counter() - wall)


def first_and_second() -> Row:
    """Measure the wall time of the first small analysis in this process, and of its repetition."""
    motions = ensemble(1)
    times = []
    for _ in range(2):
        start = perf_counter()
        analyse(motions, ("overturned", "peak_rotation"))
        times.append(perf_counter() - start)
    return {"first": times[0], "second": times[1], "runs": RUNS_A_MOTION}


def point(runs: int) -> Row:
    """Measure wall time and memory of one analysis, flags alone, after the engine is loaded."""
    motions = ensemble(max(1, runs // RUNS_A_MOTION))
    analyse(ensemble(1), ("overturned",))
    before = _peak_memory()
    wall, cpu = perf_counter(), process_time()
    results = analyse(motions, ("overturned",))
    wall, cpu = perf_counter() - wall, process_time() - cpu
    skipped = json.loads(results.attrs["skipped"])
    return {
        "runs": int(results["overturned"].size),
        "wall": wall,
        "cpu": cpu,
        "memory": _peak_memory(),
        "memory_before": before,
        "left_out": sum(value for name, value in skipped.items() if name.startswith("share_")),
    }


def by_threads(runs: int) -> Row:
    """Measure one analysis, flags alone, on one thread and on THREADS, and what cannot be divided of it.

    With the time s that the calling thread works alone and the CPU time T of everything on one thread, n cores are at
    most T / (s + (T - s) / n) times as fast (Amdahl).  The lower bound takes all that is not the engine as serial.
    """
    motions = ensemble(max(1, runs // RUNS_A_MOTION))
    analyse(ensemble(1), ("overturned",))
    rows = []
    for number in (1, THREADS):
        with KernelClock() as clock:
            wall, cpu, alone = perf_counter(), process_time(), thread_time()
            results = analyse(motions, ("overturned",), number)
            wall, cpu, alone = perf_counter() - wall, process_time() - cpu, thread_time() - alone
        rows.append({"threads": number, "wall": wall, "cpu": cpu, "engine": clock.total, "alone": alone})
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
