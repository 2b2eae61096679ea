"""Measurements as plain data: medians of repeated CPU times, errors against the truth, the machine."""

from __future__ import annotations

import json
import platform
import statistics
import subprocess
import sys
from collections.abc import Callable, Sequence
from functools import cache
from importlib import metadata
from pathlib import Path
from time import thread_time
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from llvmlite.binding import get_host_cpu_features

from ..core.aliases import Array, Flags
from ..models import Block, Law
from ..models.oscillator import Oscillator
from ..models.outputs import OF_ENGINE
from ..models.runs import run_many, trace
from .problems import DT, TRUTH_BLOCKS, TRUTH_FACTORS, TRUTH_FILE, problem
from .rivals.fixed_steps import Answer, Rival

Row = dict[str, Any]
"""One line of a table: names and plain values."""

SHORTEST = 0.01
"""Duration, s, below which tasks are repeated within one measurement."""
ENGINE = "toppling"
LEAST_ROCKING = 1e-12
"""Peak over alpha below which a run does not count as rocking (one run is at its threshold, see `truth`)."""
TRUTH_RUNS = len(TRUTH_BLOCKS) * len(TRUTH_FACTORS)


def seconds(tasks: Sequence[Callable[[], Any]], repeats: int) -> list[float]:
    """Return the median CPU time of each task, s.

    The tasks are run in turns, so that a temporary slowdown of the machine affects all of them.  The CPU time is that
    of the calling thread; other programs on the machine do not count.
    """
    number = []
    for task in tasks:
        task()  # compiles, fills caches
        start = thread_time()
        if repeats > 1:
            task()
        number.append(max(1, round(SHORTEST / max(thread_time() - start, 1e-6))) if repeats > 1 else 1)
    taken: list[list[float]] = [[] for _ in tasks]
    for _ in range(repeats):
        for times, task, n in zip(taken, tasks, number, strict=True):
            start = thread_time()
            for _ in range(n):
                task()
            times.append((thread_time() - start) / n)
    return [statistics.median(times) for times in taken]


def oscillators(law: Law, blocks: Sequence[Block]) -> list[Oscillator]:
    """Return the oscillators of `law` for all blocks, as the engine takes them."""
    return [law.oscillator(block) for block in blocks]


class Truth(NamedTuple):
    """True runs (block, factor) of one law: flags; peaks, rad; rotations (…, sample), rad; and the changes of peaks and
    rotations, rad, when the record is multiplied by 1 + 1e-13."""

    overturned: Flags
    peak: Array
    rotation: Array
    twin: Array
    rotation_twin: Array


@cache
def truth_data() -> xr.Dataset:
    """Return the file of the truth, loaded into memory."""
    with xr.open_dataset(TRUTH_FILE) as data:
        return data.load()


def true_record() -> Array:
    """Return the record of the truth, m/s²: that of `problems.record`, which other processors round in another way."""
    return np.ascontiguousarray(truth_data()["record"].values)


def truth_of(law: Law) -> Truth:
    """Return the true runs of one law."""
    runs = truth_data().sel(law=law.label)
    names = ("overturned", "peak_rotation", "rotation", "twin", "rotation_twin")
    return Truth(*(runs[name].values.astype(bool if name == "overturned" else float) for name in names))


def engine_answer(law: Law, block: Block, shaking: Array, factors: Array, every: int) -> Answer:
    """Return the engine's runs as the rivals' answers; histories are solved run by run, as in `simulate`."""
    oscillator = law.oscillator(block)
    runs = run_many([oscillator], factors[None, :], shaking, DT, skip=False)[0]
    histories = [trace(oscillator, factor * shaking, DT).history[0, ::every] for factor in factors]
    return Answer(runs[:, OF_ENGINE["peak_rotation"]], runs[:, OF_ENGINE["overturned"]] > 0.0, np.array(histories))


def answers(law: Law, rival: Rival | None, shaking: Array) -> list[Answer]:
    """Return the runs of the truth by one rival, or by the engine (None), with an answer for each block."""
    # (samples between two stored rotations of the truth)
    factors, every = np.array(TRUTH_FACTORS), int(np.diff(truth_data()["sample"].values[:2])[0])
    if rival is None:
        return [engine_answer(law, block, shaking, factors, every) for block in TRUTH_BLOCKS.values()]
    return [rival.run(problem(block, law), shaking, DT, factors, every) for block in TRUTH_BLOCKS.values()]


def errors(law: Law, compared: Sequence[Answer]) -> Row:
    """Return errors of `compared`, an answer for each block, as fractions of alpha (a peak may be zero, alpha is not).

    They are the largest error over the runs that truly stand, the median over those of them that rock (a rigid block
    may stay at rest), and the number of wrong flags of all runs.  None stands for values that are not finite.
    """
    truth = truth_of(law)
    alphas = np.array([block.alpha for block in TRUTH_BLOCKS.values()])[:, None]
    overturned = np.stack([answer.overturned for answer in compared])
    rotation = np.stack([answer.rotation for answer in compared])
    peak = np.stack([answer.peak for answer in compared])
    stands = ~truth.overturned
    rocks = stands & (truth.peak > LEAST_ROCKING * alphas)
    along = np.abs(rotation - truth.rotation).max(axis=-1) / alphas
    high = np.abs(peak - truth.peak) / alphas
    figures = {
        "trajectory_max": along[stands].max(),
        "trajectory_median": np.median(along[rocks]),
        "peak_max": high[stands].max(),
        "peak_median": np.median(high[rocks]),
    }
    return {
        **{name: float(value) if np.isfinite(value) else None for name, value in figures.items()},
        "wrong_flags": int((overturned != truth.overturned).sum()),
        "flags": int(overturned.size),
    }


def multiplication(law: Law) -> float:
    """Return the change of the true standing trajectories, over alpha, if the record is multiplied by 1 + 1e-13."""
    truth = truth_of(law)
    alphas = np.array([block.alpha for block in TRUTH_BLOCKS.values()])[:, None]
    return float((truth.rotation_twin / alphas)[~truth.overturned].max())


def in_a_process(code: str, *arguments: Any) -> Row:
    """Run `code` in a separate Python process with `arguments` as JSON; return the JSON of its last output line."""
    command = [sys.executable, "-c", code, json.dumps(arguments)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        reason = (done.stderr.strip().splitlines() or ["no message"])[-1]
        raise RuntimeError(f"a measuring process ended with {done.returncode}: {reason}")
    answer: Row = json.loads(done.stdout.strip().splitlines()[-1])
    return answer


def machine() -> Row:
    """Return the processor's model, its vectors (bits) and the versions that affect the figures, not its name."""
    model = platform.processor() or platform.machine()
    try:
        for line in Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                model = line.partition(":")[2].strip()
                break
    except OSError:
        pass
    has = get_host_cpu_features()  # (what numba compiles for: the engine works in vectors)
    vectors = 512 if has.get("avx512f") else 256 if has.get("avx2") else 128
    packages = {name: metadata.version(name) for name in ("toppling", "numpy", "numba", "dask")}
    return {
        "processor": model,
        "vectors": vectors,
        "system": platform.system(),
        "python": platform.python_version(),
        **packages,
    }
