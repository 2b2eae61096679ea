"""Bootstrap over motions: the resampling of motions or counts, and intervals from the replicates.

Scaled copies of one motion are not independent, so a motion is drawn with all its runs, and floors above one ground
motion are drawn together. One array of weights serves every block, law and floor, so that the replicates of two curves
are paired and may be subtracted.

Efron, B. and Tibshirani, R. J. (1993). An introduction to the bootstrap. Chapman and Hall, chapters 12-14. Field, C. A.
and Welsh, A. H. (2007). Bootstrapping clustered data. Journal of the Royal Statistical Society B 69, 369-390.
"""

import math
from typing import NamedTuple

import numpy as np

from ...core.aliases import Array, Index
from ...core.streams import stream
from .trials import STATES

REPLICATES = 1000


def draw_motions(strata: tuple[Index, ...], replicates: int, seed: int) -> Array:
    """Return the number of draws of each ground motion, (replicate, cluster); each stratum keeps its size.

    ``strata = (np.arange(n),)`` means n motions in one stratum.

    Replicate r draws from SeedSequence(seed, spawn_key=(r,)), stratum by stratum: it depends on neither the number of
    replicates nor anything else.
    """
    weights = np.zeros((replicates, sum(stratum.size for stratum in strata)))
    for replicate in range(replicates):
        rng = stream(seed, replicate)
        for stratum in strata:
            drawn = rng.integers(0, stratum.size, stratum.size)
            weights[replicate, stratum] = np.bincount(drawn, minlength=stratum.size)
    return weights


def draw_clusters(clusters: Index, replicates: int, seed: int) -> Array:
    """Return the number of draws of each motion, (replicate, motion); all motions of a cluster are drawn together.

    clusters (motion,): the number of the cluster of each, such as the motion that is run both ways.
    """
    drawn = draw_motions((np.arange(clusters.max() + 1),), replicates, seed)
    return np.ascontiguousarray(drawn[:, clusters])


def draw_counts(cells: Array, replicates: int, seed: int, curve: int) -> Array:
    """Resample counts (cell,) level by level, if motions are not known; (replicate, cell).

    Replicate r of curve c draws from SeedSequence(seed, spawn_key=(r, c)): replicates of different curves are
    independent.
    """
    states = cells.reshape(-1, STATES)
    runs = states.sum(axis=1)
    shares = states / np.maximum(runs, 1.0)[:, None]
    drawn = np.empty((replicates, *states.shape))
    for replicate in range(replicates):
        rng = stream(seed, replicate, curve)
        drawn[replicate] = rng.multinomial(runs.astype(np.int64), shares)
    return drawn.reshape(replicates, -1)


class Percentiles(NamedTuple):
    """Ends of intervals and the number of replicates behind them, (…,) each."""

    lower: Array
    upper: Array
    used: Index


def percentile_interval(
    samples: Array, confidence: float, weights: Array | None = None, *, against: bool = False
) -> Percentiles:
    """Percentile intervals of samples (…, replicate), with weights (replicate,) if replicates do not count alike.

    A replicate without a value (NaN) is left out or, with `against`, counts against both ends. Infinity is a value. The
    lower end is the replicate at which the share from below first reaches half of the omitted share. The upper end is
    the same from above. Both are order statistics: an interpolation would have no meaning between a number and
    infinity.
    """
    rows = np.asarray(samples, dtype=np.float64)
    shape = rows.shape[:-1]
    if rows.shape[-1] == 0:
        return Percentiles(np.full(shape, np.nan), np.full(shape, np.nan), np.zeros(shape, np.int64))
    rows = rows.reshape(math.prod(shape), rows.shape[-1])
    missing = np.isnan(rows)
    mass = np.broadcast_to(1.0 if weights is None else weights, rows.shape)
    if not against:
        mass = np.where(missing, 0.0, mass)
    lower = _reached(np.where(missing, -np.inf, rows), mass, 0.5 - 0.5 * confidence)
    upper = -_reached(np.where(missing, -np.inf, -rows), mass, 0.5 - 0.5 * confidence)
    used = np.sum(~missing, axis=-1)
    return Percentiles(lower.reshape(shape), upper.reshape(shape), used.reshape(shape))


def _reached(rows: Array, weights: Array, share: float) -> Array:
    """Return the value up to which the weights first sum to a share of their total; NaN if all weights are 0."""
    order = np.argsort(rows, axis=-1, kind="stable")
    summed = np.cumsum(np.take_along_axis(weights, order, axis=-1), axis=-1)
    # a share that is met on paper may fall short by rounding
    first = np.argmax(summed >= share * summed[:, -1:] * (1.0 - 1e-9), axis=-1)
    # replicates of weight 0 would come first where the share is nearly 0
    first = np.maximum(first, np.argmax(summed > 0.0, axis=-1))
    values = np.take_along_axis(rows, np.take_along_axis(order, first[:, None], axis=-1), axis=-1)[:, 0]
    return np.where(summed[:, -1] > 0.0, values, np.nan)


def studentised_interval(
    estimate: float, error: float, samples: Array, errors: Array, confidence: float
) -> tuple[float, float]:
    """Return the bootstrap-t interval: quantiles of (sample - estimate)/(sample's error) times the estimate's error."""
    with np.errstate(divide="ignore", invalid="ignore"):
        ratios = (samples - estimate) / errors
    low, high, _ = percentile_interval(ratios, confidence, against=True)
    return float(estimate - high * error), float(estimate - low * error)
