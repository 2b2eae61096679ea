"""Curves that are not lognormal as probabilities at levels, for formats that interpolate linearly between these."""

import math
from collections.abc import Sequence

import numpy as np
import scipy

from ...core.elementary import Array, exp, log
from ..fitting.links import LINKS, LOGNORMAL
from .rows import CurveParameters, CurveRow

ERROR = 1e-4
"""Error of linear interpolation between the levels of a grid."""
STEEPEST = {LOGNORMAL: (0.25, 0.4), "log-logistic": (0.32, 0.46), "weibull": (0.51, 0.48)}
"""Bounds of the second and of the first derivative of a curve of dispersion 1 over ln x, by its link. With the scale s
of the link they are s²/(6 sqrt 3) and s/4 for the logistic, 0.309 s² and s/e for 1 - exp(-exp(z)).
"""


def probability_at(parameters: CurveParameters, levels: Array) -> Array:
    """Return the probability of a curve at levels (level,), uplift included."""
    link = LINKS[parameters.link]
    z = log(levels / parameters.median) / parameters.dispersion
    p = link.cumulative(link.quantile(0.5) + link.scale * z)
    if not parameters.uplifting:
        return np.asarray(p)
    if parameters.uplift_dispersion == 0.0:
        return np.where(levels >= parameters.uplift_median, p, 0.0)
    return np.asarray(p * scipy.special.ndtr(log(levels / parameters.uplift_median) / parameters.uplift_dispersion))


def _ends(name: str, tail: float) -> tuple[float, float]:
    """Return ln(x/median)/dispersion where the curve of a link is `tail` from 0, and from 1."""
    link = LINKS[name]
    low, middle, high = (float(link.quantile(p)) for p in (tail, 0.5, 1.0 - tail))
    return (low - middle) / link.scale, (high - middle) / link.scale


def grid(rows: Sequence[CurveRow], tail: float, step: float) -> Array:
    """Return levels (SI) between which linear interpolation errs by less than 1e-4, steps included.

    `tail`: probability at which the tails are cut. `step`: width of a step in probability, relative to its level; other
    levels differ by at least ten times as much.

    A factor of dispersion beta has a curvature of at most 0.25/beta² + 0.4/beta over ln x (`STEEPEST` for other links).
    A line over h errs by an eighth of that curvature times h². Each factor is allowed half of the error.
    """
    grids, lows, highs, steps = [], [], [], []
    for parameters in (row.parameters for row in rows):
        factors = [(parameters.median, parameters.dispersion, *_ends(parameters.link, tail))]
        if parameters.uplifting:
            factors.append((parameters.uplift_median, parameters.uplift_dispersion, *_ends(LOGNORMAL, tail)))
            if parameters.uplift_dispersion == 0.0:
                steps += [parameters.uplift_median * (1.0 - step), parameters.uplift_median]
        curvature, slope = STEEPEST[parameters.link]
        for median, dispersion, low, high in factors:
            if dispersion > 0.0:
                h = math.sqrt(4.0 * ERROR / (curvature / dispersion**2 + slope / dispersion))
                number = math.ceil((high - low) * dispersion / h) + 1
                grids.append(median * exp(np.linspace(low * dispersion, high * dispersion, number)))
        # the curve is 0 below the lower end of either factor, and 1 beyond the upper ends of both
        lows.append(max(median * math.exp(low * dispersion) for median, dispersion, low, _ in factors))
        highs.append(max(median * math.exp(high * dispersion) for median, dispersion, _, high in factors))
    levels = np.unique(np.concatenate([*grids, [min(lows)]]))
    levels = levels[(levels >= min(lows)) & (levels <= max(highs))]
    # drop levels too close to be distinguished in a file, and levels that would blur a step
    levels = levels[np.append(True, np.diff(levels) > 10.0 * step * levels[:-1])]
    for one_step in steps:
        levels = levels[np.abs(levels - one_step) > 10.0 * step * one_step]
    return np.unique(np.concatenate([levels, steps]))
