"""Marginal distributions of sampled motion parameters, as maps from a standard normal score v to F⁻¹(Phi(v)).

Each is a function of its parameters and of scores, which it maps in their shape; equations bind the parameters.
"""

from collections.abc import Callable

import numpy as np
import scipy

from ...core.elementary import Array, exp, expm1, log, log1p

Marginal = Callable[[Array], Array]
"""Map from scores to values in the same shape."""


def lognormal(mean: float, sd: float, score: Array) -> Array:
    """Lognormal distribution, ln x ~ N(mean, sd)."""
    return exp(mean + sd * score)


def bounded_beta(a: float, b: float, lower: float, upper: float, score: Array) -> Array:
    """Beta distribution Beta(a, b), stretched to [lower, upper]."""
    share = scipy.special.betaincinv(a, b, scipy.special.ndtr(score))
    return np.asarray(lower + (upper - lower) * share)


def exponential_of_beta(a: float, b: float, lower: float, upper: float, score: Array) -> Array:
    """Distribution with ln x ~ Beta(a, b), stretched to [lower, upper]."""
    return exp(bounded_beta(a, b, lower, upper, score))


def gamma(shape: float, scale: float, score: Array) -> Array:
    """Gamma distribution of given shape and scale."""
    return np.asarray(scale * scipy.special.gammaincinv(shape, scipy.special.ndtr(score)))


def two_sided_exponential(rise: float, fall: float, lower: float, upper: float, score: Array) -> Array:
    """Distribution with density c exp(rise x) on [lower, 0] and c exp(-fall x) on [0, upper]; c makes the total 1."""
    p = scipy.special.ndtr(score)
    left = -expm1(rise * lower) / rise
    right = -expm1(-fall * upper) / fall
    c = 1.0 / (left + right)
    below = log(exp(rise * lower) + np.minimum(p, c * left) * rise / c) / rise
    above = -log1p(-np.maximum(p - c * left, 0.0) * fall / c) / fall
    return np.asarray(np.where(p <= c * left, below, np.minimum(above, upper)))
