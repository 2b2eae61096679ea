"""docs/scaling_measured.md: what large studies take, measured on this machine, and what that means for larger ones.

`make scaling` runs it (some minutes; nothing else should run).  Every number on the page is put there by this file.
"""

from __future__ import annotations

import os
import platform
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from importlib import metadata
from pathlib import Path
from typing import Any

import dask
import numpy as np
from distributed import Client, LocalCluster

import toppling as tp
from toppling.fragility import Work
from toppling.fragility.cluster import Cluster
from toppling.fragility.plan import CHUNK_SECONDS, MOST_CHUNKS, Chunk, Done
from toppling.fragility.runners import Runner
from toppling.models.runs import TALLY
from toppling.motions import records
from toppling.studies import shards as store
from toppling.studies.progress import time_text
from toppling.studies.watch import Stop, Watch, run_log

HERE = Path(__file__).parent
REPEATS = 3
SCHEDULED = 100_000
STORED = 10_000

# {number} motions: 5 x 2 x 10 runs each; the screen's reruns left out, so that runs are counted plainly
STUDY = """
title = "{number} motions"
outputs = ["overturned"]
[[blocks]]
catalogue = "bookcase-5-shelf"
[[blocks]]
catalogue = "file-vertical-4-drawer"
[[blocks]]
catalogue = "server-rack-42u"
[[blocks]]
width_m = 0.5
height_m = 1.2
name = "crate"
[[blocks]]
width_m = 0.6
height_m = 3.0
name = "pedestal"
[[models]]
law = "discrete"
[[models]]
law = "energy-consistent"
[motions]
generator = "clough-penzien"
number = {number}
duration_s = 10
dt_s = 0.01
envelope = {{ kind = "rise-strong-decay", rise_s = 2, strong_end_s = 6, decay_per_s = 0.5 }}
[ida]
im = "pga"
levels = {{ from = 0.1, to = 1.0, number = 10, unit = "g" }}
[fit]
replicates = 100
[screen]
undecided = 0.0
"""
RUNS_A_MOTION = 5 * 2 * 10


def main(out: Path = HERE) -> None:
    """Write the page."""
    with tempfile.TemporaryDirectory() as folder:
        work = Path(folder)
        values: dict[str, str] = {"machine": _machine()}
        values |= _workers(work)
        values |= _large(work)
        values |= _figures(work)
        values |= _scheduler()
        values |= _shards(work)
    values |= _larger(values)
    text = (HERE / "scaling_measured.md.in").read_text()
    for name, value in values.items():
        text = text.replace(f"{{{name}}}", value)
    (out / "scaling_measured.md").write_text(text)
    print(text)


def _study(folder: Path, runs: int) -> Path:
    path = folder / f"study-{runs}.toml"
    path.write_text(STUDY.format(number=runs // RUNS_A_MOTION))
    return path


def _workers(folder: Path) -> dict[str, str]:
    """100,000 runs with one and with two threads, and with one and two worker processes of a cluster."""
    plan = tp.Study.from_toml(_study(folder, 100_000))
    plan.run()
    rates: dict[str, list[float]] = {}
    shares: list[float] = []
    storing: list[float] = []
    for repeat in range(REPEATS):
        for threads in (1, 2):
            with dask.config.set(num_workers=threads):
                seconds, watch = _timed(plan, folder / f"threads-{threads}-{repeat}", None)
            rates.setdefault(f"threads_{threads}", []).append(seconds)
            if threads == 2:
                shares.append(1.0 - watch.busy / (threads * seconds))
                storing.append(watch.storing / seconds)
        for workers in (1, 2):
            with (
                LocalCluster(
                    n_workers=workers, threads_per_worker=1, dashboard_address=None, host="127.0.0.1"
                ) as cluster,
                Client(cluster, set_as_default=False) as client,
            ):
                _timed(plan, folder / f"warm-{workers}-{repeat}", client)
                seconds, _ = _timed(plan, folder / f"workers-{workers}-{repeat}", client)
            rates.setdefault(f"workers_{workers}", []).append(seconds)
    middle = {name: statistics.median(values) for name, values in rates.items()}
    return {
        **{name: f"{value:.2f}" for name, value in middle.items()},
        "threads_ratio": f"{middle['threads_1'] / middle['threads_2']:.2f}",
        "workers_ratio": f"{middle['workers_1'] / middle['workers_2']:.2f}",
        "overhead": f"{100.0 * statistics.median(shares):.1f}",
        "storing": f"{100.0 * statistics.median(storing):.1f}",
    }


def _timed(plan: tp.Study, out: Path, client: Any) -> tuple[float, Watch]:
    """Seconds from the first chunk's begin to the last one's end, and the counts."""
    ends = [0.0]
    begun: list[Watch] = []

    def progress(done: int, total: int) -> None:
        ends[0] = time.monotonic()

    plan.run(out, client, progress=progress, watching=begun.append)
    return ends[0] - begun[0].started, begun[0]


def _large(folder: Path) -> dict[str, str]:
    """10⁷ runs by the command, flags only: wall time and the process's peak memory."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss
    started = time.monotonic()
    command = [sys.executable, "-m", "toppling.studies.cli", "run", str(_study(folder, 10_000_000))]
    subprocess.run([*command, "--out", str(folder / "large")], check=True, stdout=subprocess.DEVNULL)
    seconds = time.monotonic() - started
    peak = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss
    assert peak > before  # of this child, not of an earlier one
    return {
        "large_seconds": f"{seconds:.0f}",
        "large_peak": f"{peak / 1e6:.2f}",
        "run_seconds": f"{2.0 * seconds / 10_000_000:.3g}",
    }


FIGURES = """
import sys, time
started = time.perf_counter()
from pathlib import Path
import xarray as xr
from toppling.studies import show
path = Path(sys.argv[1])
with xr.open_dataset(path) as results:
    opened = time.perf_counter() - started
    show.draw(results, path.parent)
print(opened, time.perf_counter() - started)
"""


def _figures(folder: Path) -> dict[str, str]:
    """Results of 10⁶ runs with peaks, opened lazily and drawn by a new process."""
    path = _study(folder, 1_000_000)
    path.write_text(path.read_text().replace('outputs = ["overturned"]\n', ""))
    tp.Study.from_toml(path).run(folder / "million")
    found = []
    for _ in range(REPEATS):
        done = subprocess.run(
            [sys.executable, "-c", FIGURES, str(folder / "million" / "results.nc")],
            check=True, capture_output=True, text=True,
        )  # fmt: skip
        found.append([float(value) for value in done.stdout.split()])
    opened, drawn = np.median(found, axis=0)
    size = (folder / "million" / "results.nc").stat().st_size
    return {"million_opened": f"{opened:.1f}", "million_drawn": f"{drawn:.1f}", "million_size": f"{size / 1e6:.0f}"}


def _scheduler() -> dict[str, str]:
    """10⁵ chunks that hold next to nothing, through a real scheduler and two worker processes."""
    work = _empty(SCHEDULED)
    chunks = [Chunk(0, 1, i, i + 1) for i in range(SCHEDULED)]
    with (
        LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None, host="127.0.0.1") as cluster,
        Client(cluster, set_as_default=False) as client,
    ):
        runner = Cluster(client)
        list(runner.run(work, chunks[:200]))
        before = _resident()
        started = time.monotonic()
        done = sum(1 for _ in runner.run(work, chunks))
        seconds = time.monotonic() - started
    assert done == SCHEDULED
    return {
        "scheduled": f"{SCHEDULED:,}",
        "scheduled_seconds": f"{seconds:.0f}",
        "scheduled_rate": f"{SCHEDULED / seconds:,.0f}",
        "scheduled_memory": f"{max(_resident() - before, 0.0):.0f}",
    }


class _Nothing(Runner):
    """Chunks that are done at once."""

    def run(self, work: Work, chunks: Any) -> Any:
        """Every chunk with an empty result."""
        for chunk in chunks:
            yield chunk, Done((np.zeros((1, 1, 1), bool),), np.zeros(len(TALLY), np.int64))


def _shards(folder: Path) -> dict[str, str]:
    """Writing and reading back the files of 10⁴ chunks that hold next to nothing."""
    work = _empty(STORED)._replace(outputs=("overturned",))
    chunks = [Chunk(0, 1, i, i + 1) for i in range(STORED)]
    (folder / "store").mkdir()
    place, _ = store.open_shards(folder / "store", {"identity": "x", "title": "x", "study": {}, "work": STORED}, False)
    seconds = []
    with run_log(folder / "store") as log:
        for _ in range(2):
            started = time.monotonic()
            runner = store.Shards(place, _Nothing(), Watch(STORED, log), Stop())
            assert sum(1 for _ in runner.run(work, chunks)) == STORED
            seconds.append(time.monotonic() - started)
    return {
        "stored_rate": f"{STORED / seconds[0]:,.0f}",
        "stored_ms": f"{1e3 * seconds[0] / STORED:.1f}",
        "read_ms": f"{1e3 * seconds[1] / STORED:.1f}",
    }


def _empty(n: int) -> Work:
    block = tp.Block(0.4, 1.8)
    one = tp.HousnerImpact(geometry="linear").oscillator(block)
    motion = records(tp.motions.from_array(np.array([0.0, 1.0, 0.0]), 0.01))[0]
    return Work((one,), (motion,) * n, np.ones((1, 1, n)))


def _larger(values: dict[str, str]) -> dict[str, str]:
    """What 10⁹ and 10¹² runs take on 32 and 1,000 cores: the engine's time, or the files' where that is longer."""
    a_run = float(values["run_seconds"])
    a_file = float(values["stored_ms"]) / 1e3
    found = {}
    for name, runs in (("giga", 1e9), ("tera", 1e12)):
        seconds = runs * a_run
        files = min(seconds / CHUNK_SECONDS, MOST_CHUNKS)
        found[f"{name}_chunks"] = f"{files:,.0f}"
        found[f"{name}_chunk"] = f"{seconds / files:,.1f}"
        for cores in (32, 1000):
            found[f"{name}_{cores}"] = time_text(max(seconds / cores, files * a_file))
        found[f"{name}_size"] = f"{runs / 1e9:,.0f} GB"
    return found


def _resident() -> float:
    """Peak memory of this process so far, MB."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3


def _machine() -> str:
    versions = ", ".join(f"{name} {metadata.version(name)}" for name in ("numpy", "numba", "distributed"))
    return f"{os.cpu_count()} cores ({platform.machine()}), Python {platform.python_version()}, {versions}"


if __name__ == "__main__":
    main()
