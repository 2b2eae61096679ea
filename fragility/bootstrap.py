"""Bootstrap over motions: what is drawn, and intervals from what came of it.

Scaled copies of one motion are not independent, so a motion is drawn with all its runs, and floors above one ground
motion are drawn together.  One array of weights serves every block, law and floor: what two curves have in common
stays in the difference between their replicates.

References
----------
Efron, B. and Tibshirani, R. J. (1993). An introduction to the bootstrap. Chapman and Hall, chapters 12-14.

Field, C. A. and Welsh, A. H. (2007). Bootstrapping clustered data. Journal of the Royal Statistical Society B 69,
369-390.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .trials import STATES, Index

Array = NDArray[np.float64]


def draw_motions(strata: tuple[Index, ...], replicates: int, seed: int) -> Array:
    """How often each ground motion is drawn, (replicate, cluster); as many of each stratum as it has.

    Replicate r draws from SeedSequence(seed, spawn_key=(r,)), stratum by stratum: it depends on neither the number of
    replicates nor anything else.
    """
    weights = np.zeros((replicates, sum(stratum.size for stratum in strata)))
    for replicate in range(replicates):
        rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(replicate,)))
        for stratum in strata:
            drawn = rng.integers(0, stratum.size, stratum.size)
            weights[replicate, stratum] = np.bincount(drawn, minlength=stratum.size)
    return weights


def draw_counts(cells: Array, replicates: int, seed: int, curve: int) -> Array:
    """Counts (cell,) drawn anew, level by level, (replicate, cell): all that can be done where motions are not known.

    Replicate r of curve c draws from SeedSequence(seed, spawn_key=(r, c)): nothing says what curves have in common.
    """
    states = cells.reshape(-1, STATES)
    runs = states.sum(axis=1)
    shares = states / np.maximum(runs, 1.0)[:, None]
    drawn = np.empty((replicates, *states.shape))
    for replicate in range(replicates):
        rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(replicate, curve)))
        drawn[replicate] = rng.multinomial(runs.astype(np.int64), shares)
    return drawn.reshape(replicates, -1)


def percentile_interval(samples: Array, confidence: float) -> tuple[float, float]:
    """Where the middle share of the replicates (replicate,) lies; one without a value counts against both ends."""
    tail = 0.5 * (1.0 - confidence)
    lower = np.quantile(np.where(np.isnan(samples), -np.inf, samples), tail, method="lower")
    upper = np.quantile(np.where(np.isnan(samples), np.inf, samples), 1.0 - tail, method="higher")
    return float(lower), float(upper)


def studentised_interval(
    estimate: float, error: float, samples: Array, errors: Array, confidence: float
) -> tuple[float, float]:
    """The bootstrap-t interval: quantiles of (sample - estimate)/(its error), times the estimate's own error."""
    with np.errstate(divide="ignore", invalid="ignore"):
        ratios = (samples - estimate) / errors
    low, high = percentile_interval(ratios, confidence)
    return estimate - high * error, estimate - low * error
