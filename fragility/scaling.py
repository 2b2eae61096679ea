"""From intensity levels to scale factors: the one place where blocks, levels and motions meet before the runs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .. import checks
from ..motions.arrays import Record
from ..motions.measures import MEASURES, positive_measure

SCALE = "scale"
MIN_FACTOR = 1e-100
INTENSITY_MEASURES = (*MEASURES, SCALE)


class Scaling(NamedTuple):
    """Levels of an intensity measure and the factors that bring every motion to them.

    levels (level,); factors (level, motion); name, units and long name of the measure.
    """

    levels: NDArray[np.float64]
    factors: NDArray[np.float64]
    name: str
    units: str
    long_name: str


def scaling(levels: Any, motions: Sequence[Record], im: str) -> Scaling:
    """Factors level/measure for a measure of the motion; the levels themselves for ``im="scale"``.

    Raises
    ------
    ValueError
        Levels that are not finite, > 0 and strictly increasing; an unknown measure; a motion whose measure is zero.
    """
    name = checks.choice("im", im, INTENSITY_MEASURES)
    values = checks.finite_array("levels", np.atleast_1d(np.asarray(levels)))
    if values[0] <= 0.0:
        raise ValueError(f"levels must be > 0, got {values[0]:g}")
    if np.any(np.diff(values) <= 0.0):
        at = int(np.argmax(np.diff(values) <= 0.0))
        raise ValueError(f"levels must be strictly increasing, got {values[at + 1]:g} after {values[at]:g}")
    if name == SCALE:
        factors = np.repeat(values[:, None], len(motions), axis=1)
        _check_factors(factors, motions)
        return Scaling(values, factors, name, "1", "scale factor")
    measured = positive_measure(name, list(motions))
    _, units, long_name = MEASURES[name]
    with np.errstate(over="ignore", under="ignore"):
        factors = values[:, None] / measured
    _check_factors(factors, motions)
    return Scaling(values, factors, name, units, long_name)


def _check_factors(factors: NDArray[np.float64], motions: Sequence[Record]) -> None:
    """ValueError where a motion would be scaled beyond any shaking, or to nothing."""
    peaks = np.array([np.abs(motion.acceleration).max() for motion in motions])
    with np.errstate(over="ignore", invalid="ignore"):
        bad = ~np.isfinite(factors) | (factors < MIN_FACTOR) | ~(factors * peaks <= checks.MAX_ACCELERATION)
    if bad.any():
        level, motion = (int(i) for i in np.argwhere(bad)[0])
        raise ValueError(
            f"motion {motions[motion].label!r} must be scaled by {MIN_FACTOR:g} at least and to "
            f"{checks.MAX_ACCELERATION:g} m/s² at most, got a factor of {factors[level, motion]:.3g}"
        )
