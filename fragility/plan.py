"""How the runs of a study are cut into chunks, and how one chunk is run: shared by `ida` and study stores.

A chunk is a slice of motions x all oscillators x their factors.  Its bounds depend on the sizes of the study alone,
never on the machine, so that a resumed study writes the same bytes; its results depend on neither.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..models.oscillator import Oscillator
from ..models.runs import OUTPUTS, run_many
from ..motions.arrays import Record

# Planning figures, on the generous side of benchmarks/engine.py: one sample of one run on a present core, closed form
# and exact geometry.
SECONDS_PER_SAMPLE = 9e-9
SECONDS_PER_EXACT_SAMPLE = 4.5e-8
CHUNK_SECONDS = 1.0


class Chunk(NamedTuple):
    """One task: the motions first … stop - 1 under all oscillators; factors (level, motion)."""

    first: int
    stop: int
    oscillators: tuple[Oscillator, ...]
    motions: tuple[Record, ...]
    factors: NDArray[np.float64]
    skip: bool

    @property
    def runs(self) -> int:
        """Number of runs in the chunk."""
        return len(self.oscillators) * self.factors.size


def plan_chunks(
    oscillators: Sequence[Oscillator],
    motions: Sequence[Record],
    factors: NDArray[np.float64],
    skip: bool = True,
    seconds: float = CHUNK_SECONDS,
) -> list[Chunk]:
    """Chunks of about `seconds` each, in the order of the motions; factors (level, motion)."""
    per_level = sum(SECONDS_PER_EXACT_SAMPLE if one.exact else SECONDS_PER_SAMPLE for one in oscillators)
    per_sample = per_level * factors.shape[0]
    bounds = [0]
    cost = 0.0
    for i, motion in enumerate(motions):
        cost += per_sample * motion.acceleration.size
        if cost >= seconds:
            bounds.append(i + 1)
            cost = 0.0
    if bounds[-1] != len(motions):
        bounds.append(len(motions))
    return [Chunk(a, b, tuple(oscillators), tuple(motions[a:b]), factors[:, a:b], skip) for a, b in pairwise(bounds)]


def run_chunk(chunk: Chunk) -> NDArray[np.float64]:
    """Results (oscillator, level, motion, output) of one chunk; outputs in the order of `models.runs.OUTPUTS`."""
    n = len(chunk.oscillators)
    results = np.empty((n, chunk.factors.shape[0], len(chunk.motions), len(OUTPUTS)))
    for i, motion in enumerate(chunk.motions):
        factors = np.broadcast_to(chunk.factors[:, i], (n, chunk.factors.shape[0]))
        results[:, :, i] = run_many(chunk.oscillators, factors, motion.acceleration, motion.dt, chunk.skip)
    return results
