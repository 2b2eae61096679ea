"""Scale factors of motions from intensity levels, for measures of the motions and measures that depend on the block."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

import numpy as np
import xarray as xr

from ...core import checks
from ...core.aliases import Array
from ...core.units import DIMENSIONLESS, STANDARD_GRAVITY
from ...models import Block
from ...motions.arrays import BOTH_AXES, Record
from ...motions.intensity.directions import PairMeasure
from ...motions.intensity.evaluation import SCALABLE, positive_measure
from ...motions.intensity.measure import MEASURES, Measure
from ...motions.intensity.naming import GROUND, long_name_at, measure_named, place_of
from .axes import axes_of
from .factors import BlockFactors, Factors, ScaleFactors, unscaled

SCALE = "scale"
SAME = 1e-9
"""A factor nearer to 1 than this leaves a motion as it is."""
MIN_FACTOR, MAX_FACTOR = 1e-100, 1e100
"""Beyond them the engine takes samples for zero (`tables.NOTHING`)."""


class Rocking(Protocol):
    """The properties that a factor of the block may depend on: slenderness (rad) and frequency parameter (rad/s)."""

    @property
    def alpha(self) -> float: ...

    @property
    def p(self) -> float: ...


@dataclass(frozen=True)
class BlockMeasure:
    """A dimensionless measure: a measure of the motion times a factor of the block, `per_block`."""

    label: str
    measure: Measure
    per_block: Callable[[Rocking], float]
    long_name: str

    @property
    def units(self) -> str:
        """Unit of its values, written the CF way."""
        return DIMENSIONLESS


BLOCK_MEASURES: dict[str, BlockMeasure] = {
    measure_of_block.label: measure_of_block
    for measure_of_block in (
        BlockMeasure(
            "pga_normalised",
            MEASURES["pga"],
            lambda block: 1.0 / (STANDARD_GRAVITY * math.tan(block.alpha)),
            "peak floor acceleration over g tan alpha",
        ),
        BlockMeasure(
            "pgv_normalised",
            MEASURES["pgv"],
            lambda block: block.p / (STANDARD_GRAVITY * math.tan(block.alpha)),
            "p times peak floor velocity over g tan alpha",
        ),
    )
}
"""Measures that depend on the block: PGA/(g tan alpha), which is 1 at the uplift of a rigid block, and p PGV/(g tan
alpha).
"""

INTENSITY_MEASURES = (*SCALABLE, *BLOCK_MEASURES, SCALE)
"""Names of the measures that levels can have; measures with parameters are also allowed (`intensity_measure`)."""


class Scaling(NamedTuple):
    """Levels of an intensity measure and the factors that scale every motion to the levels.

    `levels` (level,). `factors` (block, level, motion), one block if they are the same for all. `name`, `units`,
    `long_name`: of the measure. `measured`: its values for the unscaled motions, (motion,) or (block, motion), None for
    plain factors. `ground`: True if it is measured on the ground below, not on the motions themselves. `measure`: turns
    ratios of levels and measured values into factors, None for plain factors.
    """

    levels: Array
    factors: Factors
    name: str
    units: str
    long_name: str
    measured: Array | None = None
    ground: bool = False
    measure: Measure | None = None

    @property
    def measure_dims(self) -> tuple[str, ...]:
        """Dimensions that the measured values are on: motion, with block if the measure depends on it."""
        return ("motion",) if self.measured is None or self.measured.ndim == 1 else ("block", "motion")

    def factors_at(self, levels: xr.Variable, motions: int) -> ScaleFactors:
        """Return the factors that bring `motions` motions to levels on level, or on motion if each has its own."""
        if self.measured is None:
            return unscaled(motions)._replace(levels=levels)
        return ScaleFactors(levels, xr.Variable(self.measure_dims, self.measured), self.measure)


def intensity_measure(im: str | Measure) -> Measure | BlockMeasure | None:
    """Return the measure of a name, None for plain factors (``scale``); ValueError if there is no such measure."""
    if isinstance(im, str):
        if im == SCALE:
            return None
        if im in BLOCK_MEASURES:
            return BLOCK_MEASURES[im]
    return measure_named(im, "im", (*BLOCK_MEASURES, SCALE), SCALABLE)


def scaling(
    levels: Any,
    motions: Sequence[Record],
    im: str | Measure,
    blocks: Sequence[Block] = (),
    ground: Sequence[Record] | None = None,
) -> Scaling:
    """Return the factors (level/measure)^(1/power) for a measure of the motion; the levels for ``im="scale"``.

    With `ground`, one ground motion for each motion, the measure belongs to the ground motion: the floor motions of an
    elastic building are proportional to it. Levels are > 0 and increase.
    """
    intensity = intensity_measure(im)
    values = increasing(levels, intensity)
    if intensity is None:
        alike = np.broadcast_to(values[None, :, None], (1, values.size, len(motions)))
        check_factors(alike, motions)
        return Scaling(values, alike, SCALE, DIMENSIONLESS, "scale factor")
    base = intensity.measure if isinstance(intensity, BlockMeasure) else intensity
    measured = intensities(intensity, motions if ground is None else ground, blocks)
    factors: Factors
    if measured.ndim == 1:
        with np.errstate(over="ignore", under="ignore"):
            factors = base.factors(values[:, None] / measured[None, None, :])
    else:
        factors = BlockFactors(values, measured, base, np.ones(values.size))
    check_factors(factors, motions)
    text = name_at(intensity.long_name, motions, ground)
    return Scaling(values, factors, intensity.label, intensity.units, text, measured, ground is not None, base)


def increasing(levels: Any, intensity: Measure | BlockMeasure | None) -> Array:
    """Return levels as an array (level,); ValueError unless finite, > 0, increasing and of the unit of the measure."""
    checks.stated_unit("levels", levels, DIMENSIONLESS if intensity is None else intensity.units)
    values = np.atleast_1d(checks.finite_array("levels", levels, ndim=(0, 1)))
    checks.increasing("levels", values)
    return values


def intensities(intensity: Measure | BlockMeasure, motions: Sequence[Record], blocks: Sequence[Block] = ()) -> Array:
    """Return a measure of unscaled motions, (motion,), or (block, motion) if it depends on the block; all > 0."""
    if not isinstance(intensity, PairMeasure) and axes_of(motions) == BOTH_AXES:
        raise ValueError(
            "im must be a measure of both components where both shake, RotD50(…), RotD100(…) or GeometricMean(…), "
            f"got {intensity.label!r}"
        )
    if not isinstance(intensity, BlockMeasure):
        return positive_measure(intensity, motions)
    if not blocks:
        raise ValueError(f"im {intensity.label!r} depends on the block: blocks must hold at least one, got none")
    per_block = np.array([[intensity.per_block(block)] for block in blocks])
    return np.asarray(positive_measure(intensity.measure, motions) * per_block)


def ground_of(motions: Sequence[Record], ground: Sequence[Record]) -> list[Record]:
    """Return the ground motion below each floor motion, found by its label; ValueError if there is none."""
    known = {record.label: record for record in ground}
    below = []
    for motion in motions:
        label = motion.label.removesuffix(f" floor {motion.floor}") if motion.floor else motion.label
        if label not in known:
            raise ValueError(f"ground must hold the ground motion {label!r} of motion {motion.label!r}, got none")
        below.append(known[label])
    return below


def name_at(long_name: str, motions: Sequence[Record], ground: Sequence[Record] | None) -> str:
    """Return the long name of a measure of `ground`, or of the motions themselves, which may be of the ground."""
    return long_name_at(long_name, place_of(motion.floor for motion in motions) if ground is None else GROUND)


def check_factors(factors: Factors, motions: Sequence[Record]) -> None:
    """Raise ValueError if a motion would be scaled beyond any possible motion, or to nothing, or must not be."""
    fixed = np.array([motion.own_level for motion in motions])
    peaks = np.array([np.abs(motion.acceleration).max() for motion in motions])
    for part in factors.parts() if isinstance(factors, BlockFactors) else [factors]:
        with np.errstate(over="ignore", invalid="ignore"):
            bad = ~((part >= MIN_FACTOR) & (part <= MAX_FACTOR) & (part * peaks <= checks.MAX_ACCELERATION))
        if fixed.any() and not bool((np.abs(part[:, :, fixed] - 1.0) <= SAME).all()):
            label = next(motion.label for motion in motions if motion.own_level)
            raise ValueError(
                f"motion {label!r} is of a floor that yields or stands on an isolator, and belongs to the level of its "
                "ground motion: make one set for each level (toppling.stripes with scale=False), no factor is right"
            )
        if bad.any():
            block, level, motion = (int(i) for i in np.argwhere(bad)[0])
            raise ValueError(
                f"motion {motions[motion].label!r} must be scaled by {MIN_FACTOR:g} at least, {MAX_FACTOR:g} at most "
                f"and to {checks.MAX_ACCELERATION:g} m/s² at most, got a factor of {part[block, level, motion]:.3g}"
            )
