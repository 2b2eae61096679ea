"""How far the capacities of a class of pieces are from those predicted: a common factor, and a spread beyond it.

With true capacities c exp(bias + beta Z) of those predicted, c, the outcomes of tests are more or less likely; bias and
beta are those under which they are likeliest.  A class with few tests has no such estimate.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.special import log_ndtr

from ...core.aliases import Array
from ...core.streams import stream
from .scores import SURE

LEAST_CLUSTERS = 20
"""Fewest records or sources that an estimate of a class needs (judgement: with fewer, intervals are arbitrary)."""
BIASES = np.round(np.arange(-1.6, 1.601, 0.02), 2)
BETAS = np.round(np.geomspace(0.05, 2.0, 38), 4)
"""Values of bias and beta among which the likeliest is looked for."""
RESAMPLES, SEED = 1000, 2
FACTORS = np.geomspace(0.2, 5.0, 65)
"""Factors of a test's own shaking at which the predicted capacity is looked for: 5.2 % apart."""


class Evidence(NamedTuple):
    """A test with a count: the logarithms of the factors of its shaking that overturn the block, as predicted.

    logs: one for each case of equal share (specimens, motions, half-widths), infinity where none of `FACTORS` does.
    cluster: the record, or the source where records are not known; tests with the same one depend on each other.
    slides: the probability that the block slides instead, whatever the factor.
    """

    cluster: str
    trials: int
    overturned: int
    logs: Array
    slides: float = 0.0


class ClassFit(NamedTuple):
    """What the tests of a class say of its capacities; NaN where they are too few.

    ratio: true over predicted capacity, the median, with its 95 % interval; beta: the spread of its logarithm beyond
    that of the prediction; beta_m: the root mean square of ln(true/predicted), which holds the bias, too.
    """

    tests: int
    clusters: int
    sources: int
    ratio: float
    ratio_lower: float
    ratio_upper: float
    beta: float
    beta_lower: float
    beta_upper: float

    @property
    def enough(self) -> bool:
        """Whether there is an estimate."""
        return not math.isnan(self.ratio)

    @property
    def beta_m(self) -> float:
        """The root mean square of ln(true/predicted): a modelling uncertainty about the medians as predicted."""
        return math.hypot(self.beta, math.log(self.ratio)) if self.enough else math.nan


def too_few(tests: int, clusters: int, sources: int) -> ClassFit:
    """Return what a class with too few tests says: how many there are."""
    return ClassFit(tests, clusters, sources, *(math.nan,) * 6)


def class_fit(evidence: Sequence[Evidence], sources: int) -> ClassFit:
    """Fit bias and beta of a class to its tests, of so many publications, by maximum likelihood.

    A case overturns with the probability Phi(-(ln c + bias)/beta), where c is the factor of its shaking that is
    predicted to overturn it, and a test with the mean over its cases.  Intervals are those of quantiles over resamples
    of clusters, each with all of its tests.
    """
    tests = sum(test.trials for test in evidence)
    names = list(dict.fromkeys(test.cluster for test in evidence))
    if len(names) < LEAST_CLUSTERS:
        return too_few(tests, len(names), sources)
    likelihood = np.zeros((len(names), BIASES.size, BETAS.size))
    for counted in evidence:
        likelihood[names.index(counted.cluster)] += _log_likelihood(counted)
    weights = stream(SEED, 0).multinomial(len(names), np.full(len(names), 1.0 / len(names)), RESAMPLES)
    bias, beta = _likeliest(likelihood.sum(0)[None])
    biases, betas = _likeliest(np.tensordot(weights.astype(float), likelihood, axes=(1, 0)))
    ends = [0.5 - SURE / 2, 0.5 + SURE / 2]
    low, high = np.exp(np.quantile(biases, ends))
    return ClassFit(
        tests, len(names), sources, float(np.exp(bias[0])), float(low), float(high), float(beta[0]),
        *(float(beta_end) for beta_end in np.quantile(betas, ends)),
    )  # fmt: skip


def _log_likelihood(test: Evidence) -> Array:
    """Return the logarithm of the probability of a test's count, but for the number of its orders (bias, beta)."""
    z = (test.logs[:, None, None] + BIASES[:, None]) / BETAS
    least = -745.0  # (exp of it is the least positive number: no outcome is impossible)
    falls = np.logaddexp.reduce(log_ndtr(-z), axis=0) - math.log(test.logs.size)
    stays = np.logaddexp.reduce(log_ndtr(z), axis=0) - math.log(test.logs.size)
    if test.slides > 0.0:
        rocks = math.log1p(-test.slides) if test.slides < 1.0 else least
        falls, stays = falls + rocks, np.logaddexp(math.log(test.slides), stays + rocks)
    return np.asarray(
        test.overturned * np.maximum(falls, least) + (test.trials - test.overturned) * np.maximum(stays, least)
    )


def _likeliest(likelihood: Array) -> tuple[Array, Array]:
    """Return the likeliest bias and beta of every likelihood (case, bias, beta)."""
    best = np.argmax(likelihood.reshape(likelihood.shape[0], -1), axis=1)
    row, column = np.unravel_index(best, likelihood.shape[1:])
    return BIASES[row], BETAS[column]
