"""Scale factors of runs, computed part by part if they differ from block to block."""

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from ...core.aliases import Array
from ...motions.intensity.measure import Measure
from ..numerics.slabs import RUNS, Where


class BlockFactors(NamedTuple):
    """Factors (block, level, motion) of a measure that depends on the block.

    levels (level,); measured (block, motion): the measure of the unscaled motions; measure: turns ratios of the two
    into factors; times (level,): multipliers of the factors of each level.
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
        """Return the factors of some blocks and motions."""
        with np.errstate(over="ignore", under="ignore"):
            ratios = self.levels[:, None] / self.measured[blocks, None, :][..., motions]
            return self.measure.factors(ratios) * self.times[:, None]

    def parts(self) -> Iterator[Array]:
        """Yield all factors, some blocks at a time."""
        blocks, levels, motions = self.shape
        step = max(1, RUNS // max(1, levels * motions))
        for first in range(0, blocks, step):
            yield self.part(slice(first, first + step))


Factors = Array | BlockFactors
"""Factors (block, level, motion): an array of one block if the factors are the same for all blocks."""


def dense(factors: Factors) -> Array:
    """Return all factors as one array."""
    return factors.part() if isinstance(factors, BlockFactors) else factors


def either_side(factors: Factors, share: float) -> Factors:
    """Return the factors a share higher, followed along the levels by the factors the same share lower."""
    if not isinstance(factors, BlockFactors):
        return np.concatenate([factors * (1.0 + share), factors * (1.0 - share)], axis=1)
    times = np.concatenate([factors.times * (1.0 + share), factors.times * (1.0 - share)])
    return factors._replace(levels=np.tile(factors.levels, 2), times=times)


class ScaleFactors(NamedTuple):
    """Scale factors on the dimensions that they depend on, computed when they are read: for a slab of runs at a time.

    `levels`: on level, or on motion if each motion is run at one level. `measured`: the measure of the unscaled
    motions, on motion, or on (block, motion). `measure`: turns ratios of the two into factors, None if ratios are
    factors.
    """

    levels: xr.Variable
    measured: xr.Variable
    measure: Measure | None

    def part(self, where: Where) -> "ScaleFactors":
        """Return the factors of the blocks and motions of a slab."""
        levels, measured = (variable.isel(where, missing_dims="ignore") for variable in (self.levels, self.measured))
        return self._replace(levels=levels, measured=measured)

    @property
    def values(self) -> xr.Variable:
        """The factors on motion, and on block and level if they depend on them, in the order of runs."""
        ratios: xr.Variable = self.levels / self.measured
        factors = ratios if self.measure is None else ratios.copy(data=self.measure.factors(ratios.values))
        return factors.transpose("block", "level", "motion", ..., missing_dims="ignore")


def unscaled(motions: int) -> ScaleFactors:
    """Return the factors of motions that are run as they are: 1 on motion."""
    ones = xr.Variable("motion", np.ones(motions))
    return ScaleFactors(ones, ones, None)
