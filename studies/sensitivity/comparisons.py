"""Comparisons of laws under the same motions: ratios of medians, probabilities and flags, with paired intervals."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import xarray as xr

from ...core.aliases import Array, Flags, Index
from ...fragility import binomial_interval, fit_fragility
from ...fragility.fitting.bootstrap import draw_clusters, percentile_interval
from ...fragility.numerics.slabs import gathered
from ..plan.risk import without_replicates

NOTHING_FELL, ALL_FELL = "no overturning", "all overturned"


class Curves(NamedTuple):
    """Curves of runs (block, law) and ln medians of replicates: inf where nothing fell, -inf where everything."""

    fit: xr.Dataset
    log_median: Array
    log_samples: Array

    @classmethod
    def of(cls, runs: xr.Dataset, replicates: int, seed: int, confidence: float) -> Curves:
        """Fit lognormal curves of runs (block, model, level, motion) with bootstrap over motions."""
        fit = gathered(
            lambda part: fit_fragility(part, confidence, replicates=replicates, seed=seed, keep_replicates=True), runs
        )
        status = fit["status"].values
        beyond = np.select([status == NOTHING_FELL, status == ALL_FELL], [np.inf, -np.inf], np.nan)
        with np.errstate(divide="ignore", invalid="ignore"):
            middle = np.log(fit["median"].values)
            samples = np.log(fit["median_sample"].transpose("block", "model", "replicate").values)
        middle = np.where(np.isnan(middle), beyond, middle)
        lost = np.broadcast_to(beyond[..., None], samples.shape)
        samples = np.where(np.isnan(samples), lost, samples)
        return cls(without_replicates(fit), middle, samples)

    def ratio(self, one: Index, other: Index, confidence: float) -> tuple[Array, Array, Array]:
        """Return medians of laws `one` over those of `other` (any shape, -1: none), (block, …), with intervals."""
        missing = (one < 0) | (other < 0)
        with np.errstate(invalid="ignore"):
            middle = self.log_median[:, one] - self.log_median[:, other]
            samples = self.log_samples[:, one] - self.log_samples[:, other]
        middle[:, missing] = np.nan
        samples[:, missing] = np.nan
        return exponentials(middle, samples, confidence)


def exponentials(middle: Array, samples: Array, confidence: float) -> tuple[Array, Array, Array]:
    """Return exp of estimates (…) and of percentile intervals of replicates (…, replicate); NaN without an estimate."""
    lower, upper, _ = percentile_interval(samples, confidence)
    known = ~np.isnan(middle)
    with np.errstate(over="ignore"):
        return np.exp(middle), np.exp(np.where(known, lower, np.nan)), np.exp(np.where(known, upper, np.nan))


def flipped(flags: Flags, one: Index, other: Index, confidence: float, ways: int = 1) -> tuple[Array, Array, Array]:
    """Return shares (block, …, level) of motions whose flags (block, law, level, motion) differ, with Wilson's ends."""
    missing = (one < 0) | (other < 0)
    counts = np.empty((flags.shape[0], *one.shape, flags.shape[2]), np.int64)
    for block, *where in np.ndindex(*counts.shape[:-1]):
        here = tuple(where)
        counts[(block, *here)] = (flags[block, one[here]] != flags[block, other[here]]).sum(axis=-1)
    share = counts / flags.shape[-1]
    lower, upper = binomial_interval(counts / ways, flags.shape[-1] / ways, confidence)
    for array in (share, lower, upper):
        array[:, missing] = np.nan
    return share, lower, upper


def excess(
    flags: Flags, one: Index, other: Index, pairs: Index, replicates: int, seed: int, confidence: float
) -> tuple[Array, Array, Array]:
    """Return probabilities of laws `one` less those of `other`, with paired bootstrap intervals, (block, …, level)."""
    weights = draw_clusters(pairs, replicates, seed) / flags.shape[-1]
    missing = (one < 0) | (other < 0)
    shape = (flags.shape[0], *one.shape, flags.shape[2])
    found = np.full((3, *shape), np.nan)
    tail = 0.5 * (1.0 - confidence)
    for block in range(flags.shape[0]):
        for where in np.ndindex(*one.shape):
            if missing[where]:
                continue
            differs = flags[block, one[where]].astype(np.int8) - flags[block, other[where]]
            found[(0, block, *where)] = differs.mean(axis=-1)
            samples = differs @ weights.T
            # as in percentile_interval, the ends are values of replicates
            found[(1, block, *where)] = np.quantile(samples, tail, axis=-1, method="lower")
            found[(2, block, *where)] = np.quantile(samples, 1.0 - tail, axis=-1, method="higher")
    return found[0], found[1], found[2]


def swing(curves: Curves, block: int, laws: Index, confidence: float) -> Array:
    """Return largest over smallest median of some laws of a block, with its interval, (3,); NaN with an unknown median.

    The largest of noisy values is biased upwards, and the largest of their replicates is biased once more.  The basic
    interval (of ln: twice the estimate less the percentiles) removes the second bias; its ends are at least 1, the
    value without any swing.
    """
    middle = float(np.ptp(curves.log_median[block, laws]))
    with np.errstate(invalid="ignore"):
        samples = np.ptp(curves.log_samples[block, laws], axis=0)
    if not np.isfinite(middle):
        return np.full(3, np.exp(middle))
    ends = percentile_interval(samples, confidence)
    turned = 2.0 * middle - np.array([ends.upper, ends.lower])
    return np.exp([middle, *np.maximum(turned, 0.0).tolist()])


def trend(curves: Curves, block: int, laws: Index, x: Array) -> Array:
    """Return the slope of ln median of some laws of a block over x (law,), by least squares: (1 + replicate,)."""
    weights = (x - x.mean()) / np.sum((x - x.mean()) ** 2)
    logs = np.concatenate([curves.log_median[block, laws][:, None], curves.log_samples[block, laws]], axis=1)
    with np.errstate(invalid="ignore"):
        return np.asarray(weights @ logs)
