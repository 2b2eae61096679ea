"""Gamma modulating function of site-based motions, from the times by which given fractions of its energy arrive.

q(t)² = I f(t; k, rate) with a gamma density f of shape k = 2 alpha_2 - 1 and rate 2 alpha_3.  The time of any energy
fraction is therefore a gamma quantile over the rate, and the ratio of two such times depends on the shape alone.
"""

import functools
import math
from typing import NamedTuple

import numpy as np
import scipy

from ...core.elementary import Array, exp, log

# Range of shapes: from an exponential decay (q finite at 0) to a burst whose length is 0.1 of its delay.
LEAST_SHAPE, MOST_SHAPE = 1.0, 1000.0
TABLE_POINTS = 400


class Modulation(NamedTuple):
    """Shape and rate (1/s) of gamma densities, as arrays of one shape; NaN if no modulating function fits."""

    shape: Array
    rate: Array

    def time_of(self, energy: float) -> Array:
        """Return the time (s) by which a fraction of the energy has arrived."""
        time: Array = scipy.special.gammaincinv(self.shape, energy) / self.rate
        return time

    def density(self, time: Array) -> Array:
        """Return the energy per second over the total energy, shape (motion, time)."""
        k, rate = self.shape[:, None], self.rate[:, None]
        # with xlogy the density at t = 0 is zero for shapes above 1, and the rate for a shape of 1
        power = scipy.special.xlogy(k - 1.0, rate * time)
        values: Array = rate * exp(power - rate * time - scipy.special.gammaln(k))
        return values


def ratio_limits(middle: float) -> tuple[float, float]:
    """Return the smallest and largest D5-95/t_middle of a modulating function."""
    _, ratios = _table(middle)
    return math.exp(ratios[0]), math.exp(ratios[-1])


def modulation(d5_95: Array, t_middle: Array, middle: float = 0.45) -> Modulation:
    """Return the modulation that takes `d5_95` (s) from 5 to 95 % of its energy, and reaches `middle` at `t_middle`
    (s).

    `middle` is 0.45 (Rezaeian and Der Kiureghian) or 0.30 (Dabaghi and Der Kiureghian); NaN if D5-95/t_middle is
    outside `ratio_limits`.
    """
    logs, ratios = _table(middle)
    target = log(d5_95 / t_middle)
    log_shape = np.interp(target, ratios, logs)
    # Newton's method on a smooth monotone curve from a close start. The number of steps is fixed, so that an element's
    # bits do not depend on its neighbours.
    for _ in range(4):
        slope = (_log_ratio(log_shape + 1e-4, middle) - _log_ratio(log_shape - 1e-4, middle)) / 2e-4
        log_shape = log_shape - (_log_ratio(log_shape, middle) - target) / slope
    fits = (target >= ratios[0]) & (target <= ratios[-1])
    shape = np.where(fits, exp(log_shape), np.nan)
    return Modulation(shape, scipy.special.gammaincinv(shape, middle) / t_middle)


def _log_ratio(log_shape: Array, middle: float) -> Array:
    k = exp(log_shape)
    ratio: Array = log(
        (scipy.special.gammaincinv(k, 0.95) - scipy.special.gammaincinv(k, 0.05)) / scipy.special.gammaincinv(k, middle)
    )
    return ratio


@functools.lru_cache(maxsize=8)
def _table(middle: float) -> tuple[Array, Array]:
    """Return logarithms of shapes and of their D5-95/t_middle; the latter increase."""
    logs = np.linspace(math.log(MOST_SHAPE), math.log(LEAST_SHAPE), TABLE_POINTS)
    return logs, _log_ratio(logs, middle)
