"""What differs between laws under the same motions: ratios of medians, probabilities and flags, with paired intervals.

Every law is shaken by the same motions, and replicates of the bootstrap draw the same ones for all: what laws have in
common drops out of their differences, and intervals are as narrow as that allows.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ..fragility import binomial_interval, fit_fragility
from ..fragility.bootstrap import draw_motions, percentile_interval
from ..fragility.slabs import gathered

Array = NDArray[np.float64]
Index = NDArray[np.int64]

NOTHING_FELL, ALL_FELL = "no overturning", "all overturned"


class Curves(NamedTuple):
    """Curves of runs on (block, law) and ln medians of their replicates, (block, law, replicate).

    A law under which nothing fell has an infinite ln median, one under which all fell minus infinity: more than the
    levels can show, and a bound on either side is one.
    """

    fit: xr.Dataset
    log_median: Array
    log_samples: Array

    @classmethod
    def of(cls, runs: xr.Dataset, replicates: int, seed: int, confidence: float) -> Curves:
        """Lognormal curves of runs (block, model, level, motion) with bootstrap over motions."""
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
        return cls(fit.drop_vars([name for name in fit.data_vars if "replicate" in fit[name].dims]), middle, samples)

    def ratio(self, one: Index, other: Index, confidence: float) -> tuple[Array, Array, Array]:
        """Medians of laws `one` over those of `other` (any shape, -1: none): (block, …) with lower and upper ends."""
        missing = (one < 0) | (other < 0)
        with np.errstate(invalid="ignore"):
            middle = self.log_median[:, one] - self.log_median[:, other]
            samples = self.log_samples[:, one] - self.log_samples[:, other]
        middle[:, missing] = np.nan
        samples[:, missing] = np.nan
        return exponentials(middle, samples, confidence)


def exponentials(middle: Array, samples: Array, confidence: float) -> tuple[Array, Array, Array]:
    """Exp of estimates (…) and percentile intervals of their replicates (…, replicate); none where no estimate is."""
    lower, upper, _ = percentile_interval(samples, confidence)
    known = ~np.isnan(middle)
    with np.errstate(over="ignore"):
        return np.exp(middle), np.exp(np.where(known, lower, np.nan)), np.exp(np.where(known, upper, np.nan))


def flipped(flags: NDArray[np.bool_], one: Index, other: Index, confidence: float) -> tuple[Array, Array, Array]:
    """Shares of motions whose flags (block, law, level, motion) differ, with Wilson's interval: (block, …, level)."""
    missing = (one < 0) | (other < 0)
    counts = np.empty((flags.shape[0], *one.shape, flags.shape[2]), np.int64)
    for block, *where in np.ndindex(*counts.shape[:-1]):
        here = tuple(where)
        counts[(block, *here)] = (flags[block, one[here]] != flags[block, other[here]]).sum(axis=-1)
    share = counts / flags.shape[-1]
    lower, upper = binomial_interval(counts, flags.shape[-1], confidence)
    for array in (share, lower, upper):
        array[:, missing] = np.nan
    return share, lower, upper


def excess(
    flags: NDArray[np.bool_], one: Index, other: Index, replicates: int, seed: int, confidence: float
) -> tuple[Array, Array, Array]:
    """Differences of probabilities, those of `one` less those of `other`, and bootstrap intervals: (block, …, level).

    Replicates draw the motions that those of the curves draw.
    """
    motions = flags.shape[-1]
    weights = draw_motions((np.arange(motions),), replicates, seed) / motions
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
            # as percentile_interval takes them: no end between two replicates
            found[(1, block, *where)] = np.quantile(samples, tail, axis=-1, method="lower")
            found[(2, block, *where)] = np.quantile(samples, 1.0 - tail, axis=-1, method="higher")
    return found[0], found[1], found[2]


def swing(curves: Curves, block: int, laws: Index, confidence: float) -> Array:
    """Largest over smallest median of some laws of a block, with its interval, (3,); NaN where a median is not known.

    The largest of noisy values lies above the largest value, and that of replicates once more: the interval is the
    basic one (of ln: twice the estimate less the percentiles), which takes the second step out, and not below 1, where
    no swing is.
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
    """Slope of ln median of some laws of a block over x (law,), by least squares, then of the replicates'.

    One number, then (replicate,); not finite where a median is beyond the levels.
    """
    weights = (x - x.mean()) / np.sum((x - x.mean()) ** 2)
    logs = np.concatenate([curves.log_median[block, laws][:, None], curves.log_samples[block, laws]], axis=1)
    with np.errstate(invalid="ignore"):
        return np.asarray(weights @ logs)
