"""Scale factors that differ from block to block, made part by part: a region's are as many as its runs."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..motions.intensity import Measure
from .slabs import RUNS

Array = NDArray[np.float64]


class BlockFactors(NamedTuple):
    """Factors (block, level, motion) of a measure that depends on the block.

    levels (level,); measured (block, motion): the measure of the motions as they are; measure: what turns ratios of the
    two into factors; times (level,): what the factors of each level are multiplied by.
    """

    levels: Array
    measured: Array
    measure: Measure
    times: Array

    @property
    def shape(self) -> tuple[int, int, int]:
        """Numbers of blocks, levels and motions."""
        return self.measured.shape[0], self.levels.size, self.measured.shape[1]

    def part(self, blocks: slice = slice(None), motions: Any = slice(None)) -> Array:
        """The factors of some blocks and motions."""
        with np.errstate(over="ignore", under="ignore"):
            ratios = self.levels[:, None] / self.measured[blocks, None, :][..., motions]
            return self.measure.factors(ratios) * self.times[:, None]

    def parts(self) -> Iterator[Array]:
        """All of them, some blocks at a time."""
        blocks, levels, motions = self.shape
        step = max(1, RUNS // max(1, levels * motions))
        for first in range(0, blocks, step):
            yield self.part(slice(first, first + step))


Factors = Array | BlockFactors
"""Factors (block, level, motion), an array of one block where they are the same for all."""


def dense(factors: Factors) -> Array:
    """All of them as an array."""
    return factors.part() if isinstance(factors, BlockFactors) else factors


def either_side(factors: Factors, share: float) -> Factors:
    """The factors a share higher, and behind them along the levels the same share lower."""
    if not isinstance(factors, BlockFactors):
        return np.concatenate([factors * (1.0 + share), factors * (1.0 - share)], axis=1)
    times = np.concatenate([factors.times * (1.0 + share), factors.times * (1.0 - share)])
    return factors._replace(levels=np.tile(factors.levels, 2), times=times)
