"""Marginal distributions of sampled motion parameters, as maps from a standard normal score to the parameter."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np
import scipy

from ...core.elementary import Array, exp, expm1, log, log1p


class Marginal(ABC):
    """Marginal distribution F; call it with scores v to get the values F⁻¹(Phi(v)), in the same shape."""

    @abstractmethod
    def __call__(self, score: Array) -> Array:
        """Return the values at standard normal scores."""


@dataclass(frozen=True)
class LognormalMarginal(Marginal):
    """Lognormal distribution, ln x ~ N(mean, sd)."""

    mean: float = 0.0
    sd: float = 1.0

    def __call__(self, score: Array) -> Array:
        return exp(self.mean + self.sd * score)


@dataclass(frozen=True)
class BoundedBeta(Marginal):
    """Beta distribution Beta(a, b), stretched to [lower, upper]."""

    a: float
    b: float
    lower: float
    upper: float

    def __call__(self, score: Array) -> Array:
        share = scipy.special.betaincinv(self.a, self.b, scipy.special.ndtr(score))
        return np.asarray(self.lower + (self.upper - self.lower) * share)


@dataclass(frozen=True)
class ExponentialOfBeta(Marginal):
    """Distribution with ln x ~ Beta(a, b), stretched to [lower, upper]."""

    a: float
    b: float
    lower: float
    upper: float

    def __call__(self, score: Array) -> Array:
        return exp(BoundedBeta(self.a, self.b, self.lower, self.upper)(score))


@dataclass(frozen=True)
class GammaLaw(Marginal):
    """Gamma distribution of given shape and scale."""

    shape: float
    scale: float

    def __call__(self, score: Array) -> Array:
        return np.asarray(self.scale * scipy.special.gammaincinv(self.shape, scipy.special.ndtr(score)))


@dataclass(frozen=True)
class TwoSidedExponential(Marginal):
    """Distribution with density c exp(rise x) on [lower, 0] and c exp(-fall x) on [0, upper]; c makes the total 1."""

    rise: float
    fall: float
    lower: float
    upper: float

    def __call__(self, score: Array) -> Array:
        p = scipy.special.ndtr(score)
        left = -expm1(self.rise * self.lower) / self.rise
        right = -expm1(-self.fall * self.upper) / self.fall
        c = 1.0 / (left + right)
        below = log(exp(self.rise * self.lower) + np.minimum(p, c * left) * self.rise / c) / self.rise
        above = -log1p(-np.maximum(p - c * left, 0.0) * self.fall / c) / self.fall
        return np.asarray(np.where(p <= c * left, below, np.minimum(above, self.upper)))
