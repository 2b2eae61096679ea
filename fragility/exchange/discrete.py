"""Curves that are not lognormal as probabilities at levels, for formats that interpolate linearly between these."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import scipy

from ...aliases import Array
from .rows import CurveParameters, CurveRow

ERROR = 1e-4
"""Error of linear interpolation between the levels of a grid."""


def probability_at(parameters: CurveParameters, levels: Array) -> Array:
    """Return the probability of a curve at levels (level,), uplift included."""
    p = scipy.special.ndtr(np.log(levels / parameters.median) / parameters.dispersion)
    if not parameters.uplifting:
        return np.asarray(p)
    if parameters.uplift_dispersion == 0.0:
        return np.where(levels >= parameters.uplift_median, p, 0.0)
    return np.asarray(p * scipy.special.ndtr(np.log(levels / parameters.uplift_median) / parameters.uplift_dispersion))


def grid(rows: Sequence[CurveRow], tail: float, step: float) -> Array:
    """Return levels (SI) between which linear interpolation errs by less than 1e-4, steps included.

    tail: probability at which the tails are cut.  step: width of a step in probability, relative to its level; other
    levels are at least ten times as far apart.

    A factor of dispersion beta has a curvature of at most 0.25/beta² + 0.4/beta over ln x, and a line over h errs by an
    eighth of that curvature times h²; each factor is allowed half of the error.
    """
    z = -float(scipy.special.ndtri(tail))
    grids, lows, highs, steps = [], [], [], []
    for one in (row.parameters for row in rows):
        factors = [(one.median, one.dispersion)]
        if one.uplifting:
            factors.append((one.uplift_median, one.uplift_dispersion))
            if one.uplift_dispersion == 0.0:
                steps += [one.uplift_median * (1.0 - step), one.uplift_median]
        for median, dispersion in factors:
            if dispersion > 0.0:
                h = math.sqrt(4.0 * ERROR / (0.25 / dispersion**2 + 0.4 / dispersion))
                ends = z * dispersion
                grids.append(median * np.exp(np.linspace(-ends, ends, math.ceil(2.0 * ends / h) + 1)))
        # the curve is 0 below the lower end of either factor, and 1 beyond the upper ends of both
        lows.append(max(median * math.exp(-z * dispersion) for median, dispersion in factors))
        highs.append(max(median * math.exp(z * dispersion) for median, dispersion in factors))
    levels = np.unique(np.concatenate([*grids, [min(lows)]]))
    levels = levels[(levels >= min(lows)) & (levels <= max(highs))]
    # drop levels too close to be told apart in a file, and levels that would blur a step
    levels = levels[np.append(True, np.diff(levels) > 10.0 * step * levels[:-1])]
    for one_step in steps:
        levels = levels[np.abs(levels - one_step) > 10.0 * step * one_step]
    return np.unique(np.concatenate([levels, steps]))
