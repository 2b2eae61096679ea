"""Known truths for sequential analysis: probabilities of overturning, and verdicts that depend within a motion."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy

from ...core.aliases import Array, Flags

MEDIAN, DISPERSION = 2.0, 0.4


@dataclass(frozen=True)
class Truth:
    """A curve and how its verdicts depend on each other.

    probability: of overturning at ln levels, shares of motions; correlation: of the normal scores of two runs of one
    motion, however near their levels: 1 where a motion has one capacity.
    """

    name: str
    probability: Callable[[Array], Array]
    correlation: float = 0.5

    def verdicts(self, levels: Array, random: np.random.Generator) -> Flags:
        """Return whether blocks overturn at levels (run, motion), each motion a new one."""
        of_motion = random.standard_normal(levels.shape[1])
        noise = random.standard_normal(levels.shape)
        score = math.sqrt(self.correlation) * of_motion + math.sqrt(1.0 - self.correlation) * noise
        return np.asarray(scipy.special.ndtr(score) < self.probability(np.log(levels)))

    @property
    def log_median(self) -> float:
        """Ln of the level at which the probability passes one half."""
        low, high = math.log(MEDIAN) - 3.0, math.log(MEDIAN) + 3.0
        for _ in range(80):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if float(self.probability(np.array(middle))) < 0.5 else (low, middle)
        return 0.5 * (low + high)

    def rate(self, slope: float) -> float:
        """Return the annual rate under the hazard x^-slope, 1/year."""
        x = np.linspace(math.log(MEDIAN) - 8.0, math.log(MEDIAN) + 6.0, 200_001)
        return float(np.trapezoid(slope * np.exp(-slope * x) * self.probability(x), x) + math.exp(-slope * x[-1]))


def _score(x: Array, median: float, dispersion: float) -> Array:
    return np.asarray(scipy.special.ndtr((x - math.log(median)) / dispersion))


def _lognormal(x: Array) -> Array:
    return _score(x, MEDIAN, DISPERSION)


def _mixture(x: Array) -> Array:
    return 0.6 * _score(x, 1.5, 0.3) + 0.4 * _score(x, 3.5, 0.35)


def _atom(x: Array) -> Array:
    """Nothing overturns below the level of uplift, at which a quarter does at once."""
    return np.where(x < math.log(MEDIAN) - 0.6745 * DISPERSION, 0.0, _lognormal(x))


def _weibull(x: Array) -> Array:
    return np.asarray(-np.expm1(-math.log(2.0) * np.exp(4.0 * (x - math.log(MEDIAN)))))


TRUTHS = (
    Truth("lognormal, one capacity a motion", _lognormal, 1.0),
    Truth("lognormal, correlation 0.5", _lognormal),
    Truth("mixture of two", _mixture),
    Truth("a quarter falls at uplift", _atom),
    Truth("Weibull", _weibull),
)
"""Truths of the promise table."""
