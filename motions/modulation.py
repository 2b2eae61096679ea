"""The gamma modulating function of site-based motions, from the times at which its energy has arrived.

q(t)² = I f(t; k, rate): a gamma density of shape k = 2 alpha_2 - 1 and rate 2 alpha_3, so that any energy fraction is a
gamma quantile over the rate, and the ratio of two times depends on the shape alone.
"""

from __future__ import annotations

import functools
from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

Values = NDArray[np.float64]

# Shapes between an exponential decay (q finite at 0) and a burst 0.1 of its own delay long.
LEAST_SHAPE, MOST_SHAPE = 1.0, 1000.0
TABLE_POINTS = 400


class Modulation(NamedTuple):
    """Shape and rate (1/s) of gamma densities, arrays of one shape; NaN where no modulation fits."""

    shape: Values
    rate: Values

    def time_of(self, energy: float) -> Values:
        """Time (s) by which a fraction of the energy has arrived."""
        time: Values = scipy.special.gammaincinv(self.shape, energy) / self.rate
        return time

    def density(self, time: Values) -> Values:
        """Energy per second over the total, shape (motion, time)."""
        k, rate = self.shape[:, None], self.rate[:, None]
        # xlogy: zero at t = 0 where the shape is above 1, and the rate where it is 1
        power = scipy.special.xlogy(k - 1.0, rate * time)
        values: Values = rate * np.exp(power - rate * time - scipy.special.gammaln(k))
        return values


def ratio_limits(middle: float) -> tuple[float, float]:
    """Smallest and largest D5-95/t_middle that a modulation can have."""
    _, ratios = _table(middle)
    return float(np.exp(ratios[0])), float(np.exp(ratios[-1]))


def modulation(d5_95: Values, t_middle: Values, middle: float = 0.45) -> Modulation:
    """The modulation whose energy takes `d5_95` from 5 to 95 % and reaches the fraction `middle` at `t_middle`.

    Parameters
    ----------
    d5_95, t_middle : ndarray
        Times, s, > 0, one shape.
    middle : float
        Energy fraction at `t_middle`: 0.45 (Rezaeian and Der Kiureghian), 0.30 (Dabaghi and Der Kiureghian).

    Returns
    -------
    Modulation
        NaN where D5-95/t_middle is outside `ratio_limits`.
    """
    logs, ratios = _table(middle)
    target = np.log(d5_95 / t_middle)
    log_shape = np.interp(target, ratios, logs)
    # Newton on a smooth monotone curve from a close start: a fixed number of steps, so that an element's bits do not
    # depend on its neighbours.
    for _ in range(4):
        slope = (_log_ratio(log_shape + 1e-4, middle) - _log_ratio(log_shape - 1e-4, middle)) / 2e-4
        log_shape = log_shape - (_log_ratio(log_shape, middle) - target) / slope
    fits = (target >= ratios[0]) & (target <= ratios[-1])
    shape = np.where(fits, np.exp(log_shape), np.nan)
    return Modulation(shape, scipy.special.gammaincinv(shape, middle) / t_middle)


def _log_ratio(log_shape: Values, middle: float) -> Values:
    k = np.exp(log_shape)
    ratio: Values = np.log(
        (scipy.special.gammaincinv(k, 0.95) - scipy.special.gammaincinv(k, 0.05)) / scipy.special.gammaincinv(k, middle)
    )
    return ratio


@functools.lru_cache(maxsize=8)
def _table(middle: float) -> tuple[Values, Values]:
    """Logarithms of shapes and of their D5-95/t_middle, the latter increasing."""
    logs = np.linspace(np.log(MOST_SHAPE), np.log(LEAST_SHAPE), TABLE_POINTS)
    return logs, _log_ratio(logs, middle)
