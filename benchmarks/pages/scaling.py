"""The page docs/scaling_measured.md: large studies, measured on this machine.  Nothing else should run."""

from __future__ import annotations

import os
import statistics
import subprocess
import sys
import tempfile
import time
from importlib import metadata
from pathlib import Path
from typing import Any

import dask
from distributed import Client, LocalCluster

import toppling as tp

from ...studies.store.watch import Watch
from .. import measure
from .page import some, template, write
from .tables import body

REPEATS = some(5, 1)
SMALL, LARGE = some(100_000), some(10_000_000)
"""Runs of the study by workers, and of the one by the command."""
WORKERS = (1, 2, 4, 8, 16, 32)
"""Of these, as many as there are cores."""

SIZES = [(width, height) for height in (0.9, 1.2, 1.5, 1.8, 2.4) for width in (0.3, 0.4, 0.5, 0.6, 0.8)]
LAWS = ("discrete", "giannini-masiani", "energy-consistent", "housner")
LEVELS = 20
RUNS_A_MOTION = len(SIZES) * len(LAWS) * LEVELS
# (the screen's reruns left out, so that runs are counted plainly)
STUDY = """
title = "{number} motions"
outputs = ["overturned"]
{blocks}
{laws}
[motions]
generator = "clough-penzien"
number = {number}
duration_s = 30
dt_s = 0.005
envelope = {{ kind = "rise-strong-decay", rise_s = 3, strong_end_s = 15, decay_per_s = 0.3 }}
[ida]
im = "pga"
levels = {{ from = 0.05, to = 1.0, number = {levels}, unit = "g" }}
[fit]
replicates = 100
[screen]
undecided = 0.0
"""


def main() -> None:
    """Measure, and write the page."""
    with tempfile.TemporaryDirectory() as folder:
        threads, processes, overhead, storing = by_workers(Path(folder))
        seconds, gigabytes = by_command(Path(folder))
    rows = (
        (n, f"{threads[n]:.2f} s", f"{threads[1] / threads[n]:.2f}", f"{processes[n]:.2f} s",
         f"{processes[1] / processes[n]:.2f}")
        for n in threads
    )  # fmt: skip
    cost = seconds * (os.cpu_count() or 1) / LARGE
    text = template("scaling_measured").format(
        blocks=len(SIZES),
        laws=len(LAWS),
        levels=LEVELS,
        machine=machine(),
        repeats=REPEATS,
        worker_table=body(rows),
        overhead=100.0 * overhead,
        storing=100.0 * storing,
        seconds=seconds,
        rate=LARGE / seconds,
        gigabytes=gigabytes,
        cost=1e6 * cost,
        minutes=1e9 * cost / 32.0 / 60.0,
        days=1e12 * cost / 32.0 / 86_400.0,
    )
    write("scaling_measured", text)


def study_file(folder: Path, runs: int) -> Path:
    """Write a study file of so many runs."""
    blocks = "\n".join(
        f'[[blocks]]\nwidth_m = {width}\nheight_m = {height}\nname = "{width} by {height}"' for width, height in SIZES
    )
    laws = "\n".join(
        f'[[models]]\nlaw = "{law}"' + ('\ngeometry = "linear"' if law == "housner" else "") for law in LAWS
    )
    path = folder / f"study-{runs}.toml"
    path.write_text(STUDY.format(number=runs // RUNS_A_MOTION, blocks=blocks, laws=laws, levels=LEVELS))
    return path


def by_workers(folder: Path) -> tuple[dict[int, float], dict[int, float], float, float]:
    """Return the time of 100,000 runs by more and more threads, and by worker processes of a cluster.

    And of two threads' time the shares that schedule, and that store.
    """
    plan = tp.Study.from_toml(study_file(folder, SMALL))
    plan.run()
    counts = [n for n in WORKERS if n <= (os.cpu_count() or 1)]
    threads: dict[int, list[float]] = {n: [] for n in counts}
    processes: dict[int, list[float]] = {}
    overhead, storing = [], []
    # (all of them in turn, since a machine's speed drifts)
    for repeat in range(REPEATS):
        for n in counts:
            with dask.config.set(num_workers=n):
                seconds, watch = timed(plan, folder / f"threads-{n}-{repeat}", None)
            threads[n].append(seconds)
            if n == 2:
                overhead.append(1.0 - watch.busy / (n * seconds))
                storing.append(watch.storing / seconds)
    for n in counts:
        with (
            LocalCluster(
                n_workers=n, threads_per_worker=1, dashboard_address="127.0.0.1:0", host="127.0.0.1"
            ) as cluster,
            Client(cluster, set_as_default=False) as client,
        ):
            # (the first warms the workers up)
            every = [timed(plan, folder / f"workers-{n}-{i}", client)[0] for i in range(1 + REPEATS)]
            processes[n] = every[1:]
    by_threads, by_processes = (
        {n: statistics.median(values) for n, values in times.items()} for times in (threads, processes)
    )
    return by_threads, by_processes, statistics.median(overhead), statistics.median(storing)


def timed(plan: tp.Study, out: Path, client: Any) -> tuple[float, Watch]:
    """Return seconds from the first chunk's begin to the last one's end, and the counts."""
    ends = [0.0]
    begun: list[Watch] = []

    def progress(done: int, total: int) -> None:
        ends[0] = time.monotonic()

    plan.run(out, client, progress=progress, watching=begun.append)
    return ends[0] - begun[0].started, begun[0]


def by_command(folder: Path) -> tuple[float, float]:
    """Return the seconds of 10,000,000 runs by the command, flags only, and its peak memory in GB."""
    path = study_file(folder, LARGE)
    started = time.monotonic()
    command = [sys.executable, "-m", "toppling", "run", str(path), "--out", str(folder / "large")]
    child = subprocess.Popen(command, stdout=subprocess.DEVNULL)
    _, status, used = os.wait4(child.pid, 0)
    assert status == 0, f"the large study ended with status {status}"
    return time.monotonic() - started, used.ru_maxrss * 1024 / 1e9


def machine() -> str:
    """Return processor and versions."""
    found = measure.machine()
    versions = f"numpy {found['numpy']}, numba {found['numba']}, distributed {metadata.version('distributed')}"
    return f"{os.cpu_count()} cores ({found['processor']}), Python {found['python']}, {versions}"
