"""Invented sites whose rate of overturning is known in closed form: ruptures, candidates and blocks.

The measures of a rupture's motions are jointly lognormal (`motions.Target`).  A block falls where a weighted sum of
their logarithms and a normal residual of the motion exceeds its capacity: that sum is normal for each rupture, and the
rate at which it is exceeded is a sum of normal tails.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.special import log_ndtr, ndtr

from ...core.aliases import Array
from ...motions import Target

GIVEN = "Sa(1)"
MEASURES = ("Sa(0.3)", "Sa(0.5)", GIVEN, "Sa(2)", "Sa(3)", "pgv", "d5_95")
AT = MEASURES.index(GIVEN)
SIGMAS = np.array([0.66, 0.67, 0.69, 0.71, 0.72, 0.62, 0.42])
# Medians at M 6.5 and 20 km, SI, and their slopes with magnitude and ln(distance): of the size that ground-motion
# models have, no more.
_MEDIANS = np.log([3.2, 2.4, 1.2, 0.5, 0.28, 0.14, 12.0])
_OF_MAGNITUDE = np.array([0.55, 0.7, 0.95, 1.2, 1.3, 0.9, 0.75])
_OF_DISTANCE = np.array([-1.1, -1.05, -1.0, -0.95, -0.92, -1.0, 0.25])
# What falls: mostly by velocity, a little by long periods and duration; the residual is what no measure says.
WEIGHTS = np.array([0.0, 0.0, 0.0, 0.25, 0.0, 0.75, 0.1])
RESIDUAL = 0.25
CANDIDATES_OF_A_RUPTURE = 150
GRID = tuple((magnitude, distance) for magnitude in (5.5, 6.2, 6.9, 7.5) for distance in (8.0, 25.0))
"""Magnitudes and distances, km, of the candidates: simulated pools are grids of scenarios."""


def target_of(magnitude: float, distance: float) -> Target:
    """Return the measures of a rupture, given `GIVEN`; distance in km."""
    centre = _MEDIANS + _OF_MAGNITUDE * (magnitude - 6.5) + _OF_DISTANCE * np.log(distance / 20.0)
    return Target(MEASURES, np.exp(centre), SIGMAS, given=GIVEN)


class Pool(NamedTuple):
    """Candidates: ln measures (candidate, measure), and what of their falls no measure says (candidate,)."""

    values: Array
    residual: Array

    def falls(self, factors: Array, capacity: float) -> Array:
        """Return whether each candidate times its factor fells a block: the duration does not scale."""
        scaled = self.values + np.log(factors)[:, None] * (np.array(MEASURES) != "d5_95")
        return np.asarray(scaled @ WEIGHTS + self.residual > capacity)


@dataclass(frozen=True)
class Site:
    """A site: ruptures, their annual rates (rupture,), and the capacity of a block there."""

    ruptures: tuple[Target, ...]
    rates: Array
    capacity: float

    def _log_medians(self) -> Array:
        return np.array([np.log(rupture.medians) for rupture in self.ruptures])

    def exceeded(self, levels: Array) -> Array:
        """Return the annual rates at which `GIVEN` exceeds levels."""
        off = (self._log_medians()[:, AT] - np.log(levels)[..., None]) / SIGMAS[AT]
        return np.asarray(ndtr(off) @ self.rates)

    def shares(self, level: float) -> Array:
        """Return each rupture's share of the rate at which `GIVEN` equals a level."""
        off = (np.log(level) - self._log_medians()[:, AT]) / SIGMAS[AT]
        density = np.exp(-0.5 * off**2) * self.rates
        return np.asarray(density / density.sum())

    def motions(self, level: float, number: int, rng: np.random.Generator) -> Pool:
        """Return motions as the site has them where `GIVEN` is at a level."""
        values = np.empty((number, len(MEASURES)))
        for i, which in enumerate(rng.choice(len(self.ruptures), number, p=self.shares(level)).tolist()):
            conditional = self.ruptures[which].at(level)
            values[i] = rng.multivariate_normal(conditional.mean, conditional.covariance, method="eigh")
        return Pool(values, RESIDUAL * rng.standard_normal(number))

    @property
    def rate(self) -> float:
        """The annual rate at which the block falls: sum of nu_r Phi((wᵀmu_r - c)/sqrt(wᵀS w + residual²))."""
        covariance = _covariance(self.ruptures[0])
        spread = np.sqrt(WEIGHTS @ covariance @ WEIGHTS + RESIDUAL**2)
        return float(self.rates @ np.exp(log_ndtr((self._log_medians() @ WEIGHTS - self.capacity) / spread)))


def _covariance(rupture: Target) -> Array:
    """Return the covariance of a rupture's logarithms, given nothing."""
    free = rupture.at(1.0)
    # (that given a level, and what the level explains: S = S' + c cᵀ/v, with c/v the slope of the means)
    slope = rupture.at(math.e).mean - free.mean
    return np.asarray(free.covariance + np.outer(slope, slope) * SIGMAS[AT] ** 2)


def site(rng: np.random.Generator) -> Site:
    """Return an invented site: two to five ruptures, and a block that falls once in 100 to 10,000 years or so."""
    n = int(rng.integers(2, 6))
    magnitudes = rng.uniform(5.6, 7.6, n)
    distances = np.exp(rng.uniform(np.log(8.0), np.log(60.0), n))
    rates = 10.0 ** (4.0 - 0.9 * magnitudes) * rng.uniform(0.3, 3.0, n)
    ruptures = tuple(target_of(m, d) for m, d in zip(magnitudes.tolist(), distances.tolist(), strict=True))
    wanted = 10.0 ** rng.uniform(-3.7, -2.3)
    low, high = -12.0, 6.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if Site(ruptures, rates, middle).rate > wanted else (low, middle)
    return Site(ruptures, rates, 0.5 * (low + high))


def pool(rng: np.random.Generator) -> Pool:
    """Return candidates from a grid of ruptures that are not the site's."""
    values = []
    for magnitude, distance in GRID:
        aim = target_of(magnitude, distance)
        values.append(
            rng.multivariate_normal(np.log(aim.medians), _covariance(aim), CANDIDATES_OF_A_RUPTURE, method="cholesky")
        )
    every = np.concatenate(values)
    return Pool(every, RESIDUAL * rng.standard_normal(len(every)))
