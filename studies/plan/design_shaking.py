"""The level that is exceeded with a probability of 10 % in 50 years, and values of runs interpolated to it."""

import math
from typing import Any

import numpy as np

from ...core.elementary import Array, exp, log
from ...fragility import HazardCurve

DESIGN_RATE = -math.log(0.9) / 50.0
"""Annual rate of the design level: 10 % in 50 years."""
POINTS = 10_000
"""Points of the hazard curve between which the level is found."""


def design_level(levels: Array, hazard: HazardCurve) -> float:
    """Return the level that is exceeded with 10 % in 50 years, in the unit of the levels; NaN beyond the levels."""
    axis = np.linspace(math.log(levels[0]), math.log(levels[-1]), POINTS)
    rates = hazard.rate_at(exp(axis))
    if not rates[-1] <= DESIGN_RATE <= rates[0]:
        return math.nan
    # (rates fall along the axis, which `interp` wants to rise)
    return math.exp(np.interp(-DESIGN_RATE, -rates, axis))


def at_level(level: float, levels: Array, values: Any) -> Array:
    """Return values (…, level) at a level between the levels, by straight lines over its logarithm; NaN for NaN."""
    given = np.asarray(values, dtype=np.float64)
    if math.isnan(level):
        return np.full(given.shape[:-1], np.nan)
    place = float(np.interp(math.log(level), log(levels), np.arange(levels.size)))
    k = min(int(place), levels.size - 2) if levels.size > 1 else 0
    share = place - k
    below = given[..., k]
    # (a level of the runs needs no neighbour)
    return below if share == 0.0 else (1.0 - share) * below + share * given[..., k + 1]
