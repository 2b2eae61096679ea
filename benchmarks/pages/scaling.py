"""The page docs/scaling_measured.md: large studies, measured on this machine, and what that means for larger ones.

Nothing else should run.  The figures are kept in scaling_measured.json; TOPPLING_PARTS names those that are measured
anew, such as ``scheduler,shards``, or is empty to write the page from what is kept.
"""

from __future__ import annotations

import json
import os
import platform
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from importlib import metadata
from pathlib import Path
from typing import Any

import dask
import jinja2
import numpy as np
from distributed import Client, LocalCluster

import toppling as tp

from ...core.wording import time_text
from ...fragility import Work
from ...fragility.runs.cluster import Cluster
from ...fragility.runs.plan import MOST_CHUNKS, Chunk, ChunkResult, seconds_of_a_chunk
from ...fragility.runs.runners import Runner
from ...models.runs import TALLY
from ...motions import records
from ...studies.store import shards as store
from ...studies.store.watch import Stop, Watch, run_log
from .page import FEW, HERE, OUT, some, template, write

FIGURES = (OUT if FEW else HERE) / "scaling_measured.json"
REPEATS = some(5, 1)
SCHEDULED = some(100_000, 1000)
STORED = some(10_000)
SMALL, MILLION, LARGE = some(100_000), some(1_000_000), some(10_000_000)
"""Runs of the studies by workers, of the one that is drawn, and of the one by the command."""
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
    """Measure everything, or some parts anew, and write the page."""
    parts: dict[str, Callable[[Path], dict[str, Any]]] = {
        "workers": _workers, "figures": _figures, "large": _large, "shards": _shards, "scheduler": _scheduler
    }  # fmt: skip
    only = os.environ.get("TOPPLING_PARTS")
    names = [*parts] if only is None else [name for name in only.split(",") if name]
    found: dict[str, Any] = {"machine": _machine()} if only is None else json.loads(FIGURES.read_text())
    with tempfile.TemporaryDirectory() as folder:
        for name in names:
            print(f"measuring: {(parts[name].__doc__ or '').splitlines()[0]}", file=sys.stderr, flush=True)
            found |= parts[name](Path(folder))
    FIGURES.write_text(json.dumps(found, indent=1) + "\n")
    page = jinja2.Environment(trim_blocks=True, lstrip_blocks=True, undefined=jinja2.StrictUndefined, autoescape=False)
    text = page.from_string(template("scaling_measured")).render(
        found,
        study={"blocks": len(SIZES), "laws": len(LAWS), "levels": LEVELS, "repeats": REPEATS},
        scheduled=SCHEDULED,
        most=MOST_CHUNKS,
        larger=[_larger(1e9, "10⁹", found), _larger(1e12, "10¹²", found)],
    )
    write("scaling_measured", text)


def _study(folder: Path, runs: int) -> Path:
    blocks = "\n".join(
        f'[[blocks]]\nwidth_m = {width}\nheight_m = {height}\nname = "{width} by {height}"' for width, height in SIZES
    )
    laws = "\n".join(
        f'[[models]]\nlaw = "{law}"' + ('\ngeometry = "linear"' if law == "housner" else "") for law in LAWS
    )
    path = folder / f"study-{runs}.toml"
    path.write_text(STUDY.format(number=runs // RUNS_A_MOTION, blocks=blocks, laws=laws, levels=LEVELS))
    return path


def _workers(folder: Path) -> dict[str, Any]:
    """100,000 runs by more and more threads, and by worker processes of a cluster.

    The cheapest study there is (flags alone, Housner's block linear), and one with all that is so by default.
    """
    path = _study(folder, SMALL)
    plans = {"": tp.Study.from_toml(path), "_whole": tp.Study.from_toml(_by_default(path))}
    plans[""].run()
    counts = [n for n in WORKERS if n <= (os.cpu_count() or 1)]
    # (all of them in turn, since a machine's speed drifts)
    runs = [(repeat, n, kind) for repeat in range(REPEATS) for n in counts for kind in plans]
    threads: dict[str, dict[int, list[float]]] = {kind: {n: [] for n in counts} for kind in plans}
    shares, storing = [], []
    for repeat, n, kind in runs:
        with dask.config.set(num_workers=n):
            seconds, watch = _timed(plans[kind], folder / f"threads{kind}-{n}-{repeat}", None)
        threads[kind][n].append(seconds)
        if n == 2 and not kind:
            shares.append(1.0 - watch.busy / (n * seconds))
            storing.append(watch.storing / seconds)
    processes: dict[str, dict[int, list[float]]] = {kind: {} for kind in plans}
    for n in counts:
        with _cluster(n) as cluster, Client(cluster, set_as_default=False) as client:
            for kind, plan in plans.items():
                # (the first warms the workers up)
                every = [_timed(plan, folder / f"workers{kind}-{n}-{i}", client)[0] for i in range(1 + REPEATS)]
                processes[kind][n] = every[1:]
    found: dict[str, Any] = {"overhead": statistics.median(shares), "storing": statistics.median(storing)}
    for name, of_kinds in (("threads", threads), ("processes", processes)):
        for kind, times in of_kinds.items():
            found[f"{name}{kind}"] = {str(n): statistics.median(values) for n, values in times.items()}
    return found


def _with_peaks(path: Path) -> Path:
    """A study file like this one that keeps peaks beside the flags, so that no run ends before its motion does."""
    other = path.with_stem(f"{path.stem}-peaks")
    other.write_text(path.read_text().replace('outputs = ["overturned"]\n', ""))
    return other


def _by_default(path: Path) -> Path:
    """A study file like this one with peaks, and with Housner's block in exact geometry."""
    other = _with_peaks(path).rename(path.with_stem(f"{path.stem}-whole"))
    other.write_text(other.read_text().replace('geometry = "linear"\n', ""))
    return other


def _cluster(workers: int, threads: int = 1) -> LocalCluster:
    return LocalCluster(
        n_workers=workers, threads_per_worker=threads, dashboard_address="127.0.0.1:0", host="127.0.0.1"
    )


def _timed(plan: tp.Study, out: Path, client: Any) -> tuple[float, Watch]:
    """Seconds from the first chunk's begin to the last one's end, and the counts."""
    ends = [0.0]
    begun: list[Watch] = []

    def progress(done: int, total: int) -> None:
        ends[0] = time.monotonic()

    plan.run(out, client, progress=progress, watching=begun.append)
    return ends[0] - begun[0].started, begun[0]


def _large(folder: Path) -> dict[str, Any]:
    """10,000,000 runs by the command, flags only."""
    path = _study(folder, LARGE)
    started = time.monotonic()
    command = [sys.executable, "-m", "toppling", "run", str(path), "--out", str(folder / "large")]
    child = subprocess.Popen(command, stdout=subprocess.DEVNULL)
    _, status, used = os.wait4(child.pid, 0)
    assert status == 0, f"the large study ended with status {status}"
    seconds = time.monotonic() - started
    return {
        "large_seconds": seconds,
        "large_gb": used.ru_maxrss * 1024 / 1e9,
        "core_seconds_a_run": seconds * (os.cpu_count() or 1) / LARGE,
    }


DRAWING = """
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


def _figures(folder: Path) -> dict[str, Any]:
    """Results of 1,000,000 runs with peaks, opened lazily and drawn by a new process."""
    path = _with_peaks(_study(folder, MILLION))
    tp.Study.from_toml(path).run(folder / "million")
    found = []
    for _ in range(REPEATS):
        done = subprocess.run(
            [sys.executable, "-c", DRAWING, str(folder / "million" / "results.nc")],
            check=True, capture_output=True, text=True,
        )  # fmt: skip
        found.append([float(value) for value in done.stdout.split()])
    opened, drawn = np.median(found, axis=0).tolist()
    size = (folder / "million" / "results.nc").stat().st_size
    return {"million_opened": opened, "million_drawn": drawn, "million_mb": size / 1e6}


def _scheduler(folder: Path) -> dict[str, Any]:
    """100,000 chunks that hold next to nothing, through a real scheduler and two workers of 16 threads.

    So that as many are in flight as 32 cores would have.
    """
    work = _empty(SCHEDULED)
    chunks = [Chunk(0, 1, i, i + 1) for i in range(SCHEDULED)]
    with _cluster(2, threads=16) as cluster, Client(cluster, set_as_default=False) as client:
        runner = Cluster(client)
        assert sum(1 for _ in runner.run(work, chunks[:200])) == 200
        before = _memory(anew=True)
        started = time.monotonic()
        done = sum(1 for _ in runner.run(work, chunks))
        seconds = time.monotonic() - started
    assert done == SCHEDULED
    return {"scheduled_seconds": seconds, "scheduled_mb": _memory() - before}


class _Nothing(Runner):
    """Chunks that are done at once."""

    def run(self, work: Work, chunks: Any) -> Iterator[tuple[Chunk, ChunkResult]]:
        """Every chunk with an empty result."""
        for chunk in chunks:
            yield chunk, ChunkResult((np.zeros((1, 1, 1), bool),), np.zeros(len(TALLY), np.int64))


def _shards(folder: Path) -> dict[str, Any]:
    """Writing and reading back the files of 10,000 chunks that hold next to nothing."""
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
    return {"write_ms": 1e3 * seconds[0] / STORED, "read_ms": 1e3 * seconds[1] / STORED}


def _empty(n: int) -> Work:
    block = tp.Block(0.4, 1.8)
    one = tp.HousnerImpact(geometry="linear").oscillator(block)
    # (as long as motions are, for parcels hold so many bytes; over after two samples)
    motion = records(tp.motions.from_array(np.eye(1, 5000, 1)[0], 0.005))[0]
    return Work((one,), (motion,) * n, np.ones((1, 1, n)))


def _larger(runs: float, name: str, one: dict[str, Any]) -> dict[str, str]:
    """Return the time of so many runs on 32 and 1,000 cores: the slowest of engine, scheduler and files."""
    work = runs * one["core_seconds_a_run"]
    chunk = seconds_of_a_chunk(work)
    chunks = work / chunk
    parts = {
        "the scheduler": chunks * one["scheduled_seconds"] / SCHEDULED,
        "the files": chunks * one["write_ms"] / 1e3,
    }
    found = {
        "runs": name,
        "chunks": f"{chunks:,.0f}",
        "chunk": time_text(chunk),
        "flags": f"{runs / 1e9:,.0f} GB",
    }
    for cores in (32, 1000):
        limits = {"the engine": work / cores} | parts
        slowest = max(limits, key=lambda part: limits[part])
        found[f"on_{cores}"] = f"{time_text(limits[slowest])} ({slowest})"
    return found


def _memory(anew: bool = False) -> float:
    """Peak memory of this process, MB: since the last call with `anew`."""
    if anew:
        Path("/proc/self/clear_refs").write_text("5")
    lines = Path("/proc/self/status").read_text().splitlines()
    return 1024 * next(int(line.split()[1]) for line in lines if line.startswith("VmHWM")) / 1e6


def _machine() -> str:
    name = platform.machine()
    for line in Path("/proc/cpuinfo").read_text().splitlines() if Path("/proc/cpuinfo").exists() else []:
        if line.startswith("model name"):
            name = line.split(":", 1)[1].strip()
            break
    versions = ", ".join(f"{one} {metadata.version(one)}" for one in ("numpy", "numba", "distributed"))
    return f"{os.cpu_count()} cores ({name}), Python {platform.python_version()}, {versions}"
