"""docs/scaling/measured.csv: large studies, measured on this machine.  Nothing else should run."""

from __future__ import annotations

import os
import statistics
import subprocess
import sys
import tempfile
import time
from importlib import metadata
from pathlib import Path

import dask
from distributed import Client, LocalCluster

import toppling as tp

from ...studies.store.watch import Watch
from .. import measure
from .page import some, write_csv

REPEATS = some(5, 1)
SMALL, LARGE = some(100_000), some(10_000_000)
"""Runs of the study by workers, and of the study by the command."""
WORKERS = (1, 2, 4, 8, 16, 32)
"""Numbers of workers, as far as there are cores."""

SIZES = [(width, height) for height in (0.9, 1.2, 1.5, 1.8, 2.4) for width in (0.3, 0.4, 0.5, 0.6, 0.8)]
LAWS = ("discrete", "giannini-masiani", "energy-consistent", "housner")
LEVELS = 20
# (the reruns of the screen are left out, so that runs are counted plainly)
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
    """Measure, and write the table."""
    cores = os.cpu_count() or 1
    with tempfile.TemporaryDirectory() as folder:
        rows = by_workers(Path(folder), [number for number in WORKERS if number <= cores])
        seconds, gigabytes = by_command(Path(folder))
    rows += [
        (f"{LARGE:,} runs by the command", f"{seconds:.0f}", "s"),
        ("maximum memory of the command", f"{gigabytes:.2f}", "GB"),
        ("one run", f"{1e6 * seconds * cores / LARGE:.0f}", "µs of a core"),
        ("machine", machine(cores), ""),
    ]
    write_csv("scaling", "measured", ("quantity", "value", "unit"), rows)


def study_file(folder: Path, runs: int) -> Path:
    """Write a study file with a number of runs."""
    blocks = "\n".join(
        f'[[blocks]]\nwidth_m = {width}\nheight_m = {height}\nname = "{width} by {height}"' for width, height in SIZES
    )
    laws = "\n".join(
        f'[[models]]\nlaw = "{law}"' + ('\ngeometry = "linear"' if law == "housner" else "") for law in LAWS
    )
    number = runs // (len(SIZES) * len(LAWS) * LEVELS)
    path = folder / f"study-{runs}.toml"
    path.write_text(STUDY.format(number=number, blocks=blocks, laws=laws, levels=LEVELS))
    return path


def by_workers(folder: Path, counts: list[int]) -> list[tuple[str, str, str]]:
    """Return the time of `SMALL` runs by threads and by processes of a cluster, and the overhead of two threads."""
    plan = tp.Study.from_toml(study_file(folder, SMALL))
    plan.run()  # (compiles the engine)
    times: dict[str, list[float]] = {f"{number} thread{'s' if number > 1 else ''}": [] for number in counts}
    overhead, storing = [], []
    # (all numbers of threads in turn, because the speed of a machine drifts)
    for repeat in range(REPEATS):
        for number, name in zip(counts, list(times), strict=True):
            with dask.config.set(num_workers=number):
                seconds, watch = timed(plan, folder / f"threads-{number}-{repeat}", None)
            times[name].append(seconds)
            if number == 2:
                overhead.append(100.0 * (1.0 - watch.busy / (number * seconds)))
                storing.append(100.0 * watch.storing / seconds)
    for number in counts:
        with (
            LocalCluster(
                n_workers=number, threads_per_worker=1, dashboard_address="127.0.0.1:0", host="127.0.0.1"
            ) as cluster,
            Client(cluster, set_as_default=False) as client,
        ):
            # (the first study warms the workers up)
            every = [timed(plan, folder / f"workers-{number}-{i}", client)[0] for i in range(1 + REPEATS)]
        times[f"{number} process{'es' if number > 1 else ''}"] = every[1:]
    rows = [(f"{SMALL:,} runs, {name}", f"{statistics.median(seconds):.2f}", "s") for name, seconds in times.items()]
    if overhead:
        rows += [
            ("two threads, time outside the engine", f"{statistics.median(overhead):.1f}", "%"),
            ("two threads, time of writing shards", f"{statistics.median(storing):.1f}", "%"),
        ]
    return rows


def timed(plan: tp.Study, out: Path, client: Client | None) -> tuple[float, Watch]:
    """Return the seconds from the begin of the first chunk to the end of the last chunk, and the counts."""
    ends: list[float] = []
    begun: list[Watch] = []
    plan.run(out, client, progress=lambda done, total: ends.append(time.monotonic()), watching=begun.append)
    return ends[-1] - begun[0].started, begun[0]


def by_command(folder: Path) -> tuple[float, float]:
    """Return the seconds of `LARGE` runs by the command, flags only, and its maximum memory in GB."""
    path = study_file(folder, LARGE)
    started = time.monotonic()
    command = [sys.executable, "-m", "toppling", "run", str(path), "--out", str(folder / "large")]
    child = subprocess.Popen(command, stdout=subprocess.DEVNULL)
    _, status, used = os.wait4(child.pid, 0)
    assert status == 0, f"the large study ended with status {status}"
    return time.monotonic() - started, used.ru_maxrss * 1024 / 1e9


def machine(cores: int) -> str:
    """Return processor and versions."""
    host = measure.machine()
    versions = f"numpy {host['numpy']}, numba {host['numba']}, distributed {metadata.version('distributed')}"
    return f"{cores} cores ({host['processor']}), Python {host['python']}, {versions}"
