"""From intensity levels to scale factors: the one place where blocks, levels and motions meet before the runs."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from .. import checks
from ..models import Block
from ..motions.arrays import Record
from ..motions.intensity import MEASURES, Measure
from ..motions.measures import measure_named, positive_measure
from ..units import DIMENSIONLESS, STANDARD_GRAVITY
from .block_factors import BlockFactors, Factors

SCALE = "scale"
MIN_FACTOR = 1e-100


class Rocking(Protocol):
    """What a factor of the block may depend on: slenderness (rad) and frequency parameter (rad/s)."""

    @property
    def alpha(self) -> float: ...

    @property
    def p(self) -> float: ...


@dataclass(frozen=True)
class BlockMeasure:
    """A measure of the motion times a factor of the block, `per_block`, dimensionless."""

    label: str
    measure: Measure
    per_block: Callable[[Rocking], float]
    long_name: str

    @property
    def units(self) -> str:
        """Unit of its values, written the CF way."""
        return DIMENSIONLESS


BLOCK_MEASURES: dict[str, BlockMeasure] = {
    one.label: one
    for one in (
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
"""Measures that depend on the block: PGA/(g tan alpha), 1 where a rigid block uplifts, and p PGV/(g tan alpha)."""

INTENSITY_MEASURES = (*(name for name, one in MEASURES.items() if one.power != 0.0), *BLOCK_MEASURES, SCALE)
"""Names that levels can be of; measures with parameters come beside them (`intensity_measure`)."""


class Scaling(NamedTuple):
    """Levels of an intensity measure and the factors that bring every motion to them.

    levels (level,); factors (block, level, motion), one block where they are the same for all; name, units and long
    name of the measure; measured: its values for the motions as they are, (motion,) or (block, motion), none for plain
    factors; ground: whether it is measured on the ground below and not on the motions themselves.
    """

    levels: NDArray[np.float64]
    factors: Factors
    name: str
    units: str
    long_name: str
    measured: NDArray[np.float64] | None = None
    ground: bool = False


def intensity_measure(im: str | Measure) -> Measure | BlockMeasure | None:
    """The measure that `im` names, None for plain factors (``scale``); ValueError where there is no such measure."""
    if isinstance(im, str):
        if im == SCALE:
            return None
        if im in BLOCK_MEASURES:
            return BLOCK_MEASURES[im]
    return measure_named(im, "im", (*BLOCK_MEASURES, SCALE))


def scaling(
    levels: Any,
    motions: Sequence[Record],
    im: str | Measure,
    blocks: Sequence[Block] = (),
    ground: Sequence[Record] | None = None,
) -> Scaling:
    """Factors (level/measure)^(1/power) for a measure of the motion; the levels themselves for ``im="scale"``.

    With `ground`, one a motion, the measure is taken of it instead: the floors of an elastic building grow with it.

    Raises
    ------
    ValueError
        Levels that are not finite, > 0 and strictly increasing; an unknown measure, or one that does not grow with the
        motion; a motion whose measure is zero; no blocks for a measure that depends on them.
    """
    one = intensity_measure(im)
    values = increasing(levels)
    if one is None:
        alike = np.broadcast_to(values[None, :, None], (1, values.size, len(motions)))
        _check_factors(alike, motions)
        return Scaling(values, alike, SCALE, DIMENSIONLESS, "scale factor")
    base = one.measure if isinstance(one, BlockMeasure) else one
    measured = intensities(one, motions if ground is None else ground, blocks)
    factors: Factors
    if measured.ndim == 1:
        with np.errstate(over="ignore", under="ignore"):
            factors = base.factors(values[:, None] / measured[None, None, :])
    else:
        factors = BlockFactors(values, measured, base, np.ones(values.size))
    _check_factors(factors, motions)
    text = one.long_name if ground is None else of_the_ground(one.long_name)
    return Scaling(values, factors, one.label, one.units, text, measured, ground is not None)


def increasing(levels: Any) -> NDArray[np.float64]:
    """Levels (level,); ValueError unless they are finite, > 0 and strictly increasing."""
    values = checks.finite_array("levels", np.atleast_1d(np.asarray(levels)))
    if values[0] <= 0.0:
        raise ValueError(f"levels must be > 0, got {values[0]:g}")
    if np.any(np.diff(values) <= 0.0):
        at = int(np.argmax(np.diff(values) <= 0.0))
        raise ValueError(f"levels must be strictly increasing, got {values[at + 1]:g} after {values[at]:g}")
    return values


def intensities(
    one: Measure | BlockMeasure, motions: Sequence[Record], blocks: Sequence[Block] = ()
) -> NDArray[np.float64]:
    """A measure of motions as they are, (motion,), or (block, motion) where it depends on the block; all > 0."""
    if not isinstance(one, BlockMeasure):
        return positive_measure(one, motions)
    if not blocks:
        raise ValueError(f"im {one.label!r} depends on the block: blocks must hold at least one, got none")
    per_block = np.array([[one.per_block(block)] for block in blocks])
    return np.asarray(positive_measure(one.measure, motions) * per_block)


def ground_of(motions: Sequence[Record], ground: Sequence[Record]) -> list[Record]:
    """The ground motion below each floor motion, found by its label; ValueError where there is none."""
    known = {record.label: record for record in ground}
    found = []
    for motion in motions:
        label = motion.label.removesuffix(f" floor {motion.floor}") if motion.floor else motion.label
        if label not in known:
            raise ValueError(f"ground must hold the ground motion {label!r} of motion {motion.label!r}, got none")
        found.append(known[label])
    return found


def of_the_ground(long_name: str) -> str:
    """A measure's name where it is of the ground motion below a floor."""
    return long_name.replace("floor", "ground") if "floor" in long_name else f"{long_name}, ground motion"


def _check_factors(factors: Factors, motions: Sequence[Record]) -> None:
    """ValueError where a motion would be scaled beyond any shaking, or to nothing."""
    peaks = np.array([np.abs(motion.acceleration).max() for motion in motions])
    for part in factors.parts() if isinstance(factors, BlockFactors) else [factors]:
        with np.errstate(over="ignore", invalid="ignore"):
            bad = ~np.isfinite(part) | (part < MIN_FACTOR) | ~(part * peaks <= checks.MAX_ACCELERATION)
        if bad.any():
            block, level, motion = (int(i) for i in np.argwhere(bad)[0])
            raise ValueError(
                f"motion {motions[motion].label!r} must be scaled by {MIN_FACTOR:g} at least and to "
                f"{checks.MAX_ACCELERATION:g} m/s² at most, got a factor of {part[block, level, motion]:.3g}"
            )
