"""Gain of another intensity measure: ratio of the numbers of motions with levels in the first and in the other."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import scipy

from ...core.elementary import Array, times
from ..adaptive.probit import Observations
from .surface import Pool, fit_surface

CONFIDENCE = 0.99
"""Of the interval of a gain: several measures are tried, and the best of them is offered."""
WORTH = 1.5
"""Gain that the lower end of its interval must exceed to be offered: a third of the motions fewer."""
FEWEST = 32
"""Fewest motions from which a gain is measured."""
NAMED = 2
"""Measures that are offered at most."""
ALIKE = 1e-9
"""Standard deviation of ln ratios of two measures below which they are one."""


class Gain(NamedTuple):
    """Ratio of numbers of motions, and its interval; NaN if the runs do not determine it."""

    value: float
    lower: float
    upper: float


UNKNOWN = Gain(math.nan, math.nan, math.nan)


def measure_gain(runs: Observations, ratios: Array) -> Gain:
    """Return the variance of ln capacity in the measure of the runs' levels over that in another one.

    `ratios` (motion,) r: ln of the other measure less ln of the first one, of the unscaled motions by their number.
    Each measure has the power with which it grows as the first one does. The ln capacity of a motion in the first
    measure is fitted as m - b r + s Z, Z standard normal, by maximum likelihood. It has the variance s² + b² v, v the
    variance of r, and in the other measure s² + (1 - b)² v. Errors are from the sums of each motion, by the delta
    method (*derived*). The number of motions for a median grows with this variance, and with the correlation of the
    runs of one motion. The correlation is smaller in the better measure: the gain is rather a lower bound. The values b
    = 0 and b = 1 are the sufficiency of the first and of the other measure.

    Efficiency: Luco, N. and Cornell, C. A. (2007). Earthquake Spectra 23(2), 357-392.
    """
    used = np.unique(runs.motion)
    logs = ratios[used] if used.size and used[-1] < ratios.size else np.empty(0)
    if logs.size < FEWEST or not np.isfinite(logs).all():
        return UNKNOWN
    centre, width = float(logs.mean()), float(logs.std(ddof=1))
    if width < ALIKE:
        return Gain(1.0, 1.0, 1.0)
    places = (ratios[runs.motion] - centre) / width
    surface = fit_surface(Pool(places[:, None], runs.x, runs.fell, runs.motion), (1, 0))
    if surface is None:
        return UNKNOWN
    _, slope, log_spread = surface.coefficients.tolist()
    # (in standard deviations of the ratios the slope is -b width)
    explained, left = -slope, math.exp(2.0 * log_spread)
    first, second = left + explained**2, left + (width - explained) ** 2
    value = math.log(first / second)
    by_slope = -2.0 * explained / first - 2.0 * (width - explained) / second
    by_spread = 2.0 * left * (1.0 / first - 1.0 / second)
    # (a ratio of the width with b given: explained = b width)
    by_width = 2.0 * explained**2 / first - 2.0 * (width - explained) ** 2 / second
    influence = surface.influence[:, 1] * by_slope + surface.influence[:, 2] * by_spread
    influence[used] += by_width * 0.5 * (((logs - centre) / width) ** 2 - 1.0) / logs.size
    reach = float(scipy.special.stdtrit(logs.size - 3, 0.5 + 0.5 * CONFIDENCE)) * math.sqrt(times(influence, influence))
    return Gain(math.exp(value), math.exp(value - min(reach, 700.0)), math.exp(min(value + reach, 700.0)))


def gain_words(labels: Sequence[str], gains: Sequence[Gain]) -> str:
    """Return a clause that offers the measures that surely save most; empty if none saves a third of the motions.

    >>> gain_words(["pgv", "cav"], [Gain(4.0, 3.0, 5.3), Gain(1.1, 0.9, 1.4)])
    'levels in pgv would take 25 % of the motions or fewer (factor 4.0, 99 % interval 3.0–5.3)'
    """
    worth = sorted((i for i, gain in enumerate(gains) if gain.lower > WORTH), key=lambda i: -gains[i].lower)[:NAMED]
    shares = [
        f"in {labels[i]} would take {100.0 / gains[i].value:.0f} % of the motions or fewer (factor "
        f"{gains[i].value:.1f}, {100.0 * CONFIDENCE:g} % interval {gains[i].lower:.1f}–{gains[i].upper:.1f})"
        for i in worth
    ]
    return f"levels {', those '.join(shares)}" if shares else ""
