"""How the runs of a study are cut into chunks, and how one chunk is run: shared by `ida` and study stores.

A chunk is a slice of motions x all oscillators x their factors.  Its bounds depend on the sizes of the study alone,
never on the machine, so that a resumed study writes the same bytes; its results depend on neither.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..models.oscillator import Oscillator
from ..models.runs import OUTPUTS, TALLY, run_many
from ..motions.arrays import Record

# Planning figures, on the generous side of benchmarks/speed.py: one sample of one run on a present core, closed form
# and exact geometry.
SECONDS_PER_SAMPLE = 5e-9
SECONDS_PER_EXACT_SAMPLE = 4.5e-8
CHUNK_SECONDS = 1.0

OUTPUT_TYPES: dict[str, type[np.generic]] = {
    "overturned": np.bool_,
    "peak_rotation": np.float64,
    "uplifted": np.bool_,
    "impacts": np.int32,
    "overturning_time": np.float64,
    "impact_velocity": np.float64,
    "direction": np.int8,
}
"""The type in which each output (`models.runs.OUTPUTS`) is kept."""


class Chunk(NamedTuple):
    """One task: the motions first … stop - 1 under all oscillators.

    factors (block, level, motion): one block where they are the same for all; else the oscillators stand block by
    block, equally many for each.  outputs: what is wanted of a run.
    """

    first: int
    stop: int
    oscillators: tuple[Oscillator, ...]
    motions: tuple[Record, ...]
    factors: NDArray[np.float64]
    skip: bool
    outputs: tuple[str, ...]

    @property
    def runs(self) -> int:
        """Number of runs in the chunk."""
        return len(self.oscillators) * int(self.factors[0].size)


def plan_chunks(
    oscillators: Sequence[Oscillator],
    motions: Sequence[Record],
    factors: NDArray[np.float64],
    skip: bool = True,
    outputs: Sequence[str] = tuple(OUTPUTS),
    seconds: float = CHUNK_SECONDS,
) -> list[Chunk]:
    """Chunks of about `seconds` each, in the order of the motions; factors (block, level, motion) as in `Chunk`."""
    per_level = sum(SECONDS_PER_EXACT_SAMPLE if one.exact else SECONDS_PER_SAMPLE for one in oscillators)
    per_sample = per_level * factors.shape[1]
    bounds = [0]
    cost = 0.0
    for i, motion in enumerate(motions):
        cost += per_sample * motion.acceleration.size
        if cost >= seconds:
            bounds.append(i + 1)
            cost = 0.0
    if bounds[-1] != len(motions):
        bounds.append(len(motions))
    return [
        Chunk(a, b, tuple(oscillators), tuple(motions[a:b]), factors[:, :, a:b], skip, tuple(outputs))
        for a, b in pairwise(bounds)
    ]


class Done(NamedTuple):
    """What a chunk gives back: an array (oscillator, level, motion) per output, and the counts (`runs.TALLY`)."""

    results: tuple[NDArray[Any], ...]
    tally: NDArray[np.int64]

    @property
    def runs(self) -> int:
        """Number of runs in the chunk."""
        return int(self.results[0].size)


def run_chunk(chunk: Chunk) -> Done:
    """All runs of one chunk, each output in its own type: flags take a byte."""
    n = len(chunk.oscillators)
    blocks, levels = chunk.factors.shape[:2]
    shape = (n, levels, len(chunk.motions))
    results = tuple(np.empty(shape, OUTPUT_TYPES[name]) for name in chunk.outputs)
    flags_only = chunk.outputs == ("overturned",)
    tally = np.zeros(len(TALLY), np.int64)
    for i, motion in enumerate(chunk.motions):
        # one row of factors a block, the same for its oscillators, which stand side by side
        factors = np.broadcast_to(chunk.factors[:, None, :, i], (blocks, n // blocks, levels)).reshape(n, levels)
        runs = run_many(chunk.oscillators, factors, motion.acceleration, motion.dt, chunk.skip, flags_only, tally)
        for array, name in zip(results, chunk.outputs, strict=True):
            array[:, :, i] = runs[..., OUTPUTS[name]]
    return Done(results, tally)
