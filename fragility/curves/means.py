"""Confidence intervals of means and quantiles over motions, by resampling whole motions.

A motion is one draw: its results at all levels, on all floors and for all items are resampled together.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import scipy

from ... import checks
from ...aliases import Array, Flags, Index
from ..fitting.bootstrap import draw_motions
from ..numerics.proportions import wilson_interval
from ..numerics.slabs import Allocator, in_memory

REPLICATES = 1000
# Statistics resampled at a time, and their values: these bound the memory and have no effect on results.
_BLOCK = 512
_VALUES = 2**20
ERRORS = 1.9
"""Errors of a share at whose ends those of a quantile are looked up: values have gaps, which 1.96 errors then cross."""


class Interval(NamedTuple):
    """Lower and upper ends of intervals, one shape."""

    lower: Array
    upper: Array


def resampled_means(
    values: Array,
    replicates: int = REPLICATES,
    seed: int = 0,
    array: Allocator = in_memory,
    strata: tuple[Index, ...] = (),
) -> Array:
    """Return means (…, replicate) over resampled motions of values (…, motion), in an array that `array` allocates.

    Every call with the same number of motions, replicates and seed resamples the same motions: differences of two
    results are paired.  `strata`: as for `mean_interval`.
    """
    n = values.shape[-1]
    counts = draw_motions(strata or (np.arange(n),), replicates, seed)
    flat = values.reshape(-1, n)
    found = array((flat.shape[0], replicates), np.float64)
    for part in _parts(*flat.shape):
        found[part] = _means(flat[part], counts)
    return found.reshape(*values.shape[:-1], replicates)


def _parts(statistics: int, motions: int) -> Iterator[slice]:
    """Yield slices of the statistics that are resampled at a time."""
    step = max(1, min(_BLOCK, _VALUES // motions))
    return (slice(first, first + step) for first in range(0, statistics, step))


def _means(values: Array, counts: Array) -> Array:
    """Return means (statistic, replicate) of values (statistic, motion) under draw counts (replicate, motion)."""
    return np.asarray(np.einsum("sn,rn->sr", values, counts) / values.shape[1])


def mean_interval(
    values: Array,
    confidence: float = 0.95,
    replicates: int = REPLICATES,
    seed: int = 0,
    most: Array | float | None = None,
    drawn: Array | None = None,
    strata: tuple[Index, ...] = (),
) -> Interval:
    """Return bootstrap intervals of means over motions, bias-corrected and accelerated (BCa).

    Parameters
    ----------
    values : ndarray, shape (…, motion)
        One value a motion.
    confidence : float
        Between 0 and 1.
    replicates, seed : int
        Number of resamples, at least 50, and the seed that decides them.
    most : array_like, optional
        The greatest possible value (the least is 0), broadcast over (…).  Where all motions agree, resampling gives no
        interval: the ends then assume that the share of motions that Wilson's interval allows to differ does so by as
        much as possible.  Without `most` the ends are NaN there.
    drawn : ndarray, shape (replicate, motion), optional
        How often each motion is drawn, as `draw_motions` returns it.
    strata : tuple of ndarray
        Positions of the motions of each stratum, which is resampled by itself, such as the motions of each level where
        levels have motions of their own; one stratum where not given.

    Returns
    -------
    Interval
        (…) each.

    Notes
    -----
    Annual values are skewed: most of the sum comes from the few motions under which items fall at low levels.  The
    coverage of 95 % intervals of the rate of a lognormal threshold of dispersion 0.4 was some 91 % with 100 motions and
    93 % with 200; larger dispersions need more motions (tests/fragility/uncertainty/test_joint.py).

    References
    ----------
    Efron, B. (1987). Better bootstrap confidence intervals. Journal of the American Statistical Association 82(397),
    171-185 (recalled); the acceleration of a mean is its skewness over 6, that of a sum of means of strata of one size
    the same of their deviations from the means of their strata.

    Examples
    --------
    >>> found = mean_interval(np.array([0.0, 0.0, 1.0, 0.0, 3.0, 0.0, 0.0, 2.0]))
    >>> bool(found.lower < 0.75 < found.upper)
    True
    """
    level = checks.number("confidence", confidence, above=0.0, below=1.0)
    checks.count("replicates", replicates, at_least=50)
    checks.count("seed", seed)
    n = values.shape[-1]
    flat = np.ascontiguousarray(values, dtype=np.float64).reshape(-1, n)
    mean = flat.mean(axis=-1)
    own = strata or (np.arange(n),)
    agree = np.all([flat[:, one].min(axis=-1) == flat[:, one].max(axis=-1) for one in own], axis=0)
    ends = np.empty((2, flat.shape[0]))
    counts = draw_motions(own, replicates, seed) if drawn is None else drawn
    for part in _parts(*flat.shape):
        means = np.sort(_means(flat[part], counts), axis=-1)
        ends[:, part] = _accelerated(flat[part], mean[part], means, level, own)
    if most is None:
        ends[:, agree] = np.nan
    else:
        bound = np.broadcast_to(np.asarray(most, dtype=np.float64), values.shape[:-1]).ravel()[agree]
        fewest = min(one.size for one in own)
        differing = float(wilson_interval(np.zeros(1, np.int64), np.array([fewest]), level)[1][0])
        ends[0, agree] = mean[agree] * (1.0 - differing)
        ends[1, agree] = ends[0, agree] + bound * differing
    lower, upper = ends.reshape(2, *values.shape[:-1])
    return Interval(lower, upper)


def sampling_error(values: Array | Flags, ways: int = 1) -> Array:
    """Return the standard error (…) that draws of realisations leave in means of values (…, motion, realisation).

    The realisations of a motion are independent; where it has several `ways`, one after the other, those have the same
    draws.  NaN where there is one realisation.

    Examples
    --------
    >>> sampling_error(np.array([[0.0, 1.0], [1.0, 1.0]])).tolist()  # a variance of 1/2 over 2 draws, among 2 motions
    0.25
    """
    motions, draws = values.shape[-2], values.shape[-1] // ways
    if draws == 1:
        return np.full(values.shape[:-2], np.nan)
    each = values.reshape(*values.shape[:-1], ways, draws).mean(axis=-2)
    return np.asarray(np.sqrt(each.var(axis=-1, ddof=1).sum(axis=-1) / draws) / motions)


def share_error(flags: Array | Flags, ways: int = 1) -> Array:
    """Return the `sampling_error` of shares, of flags of 0 and 1, with one of all draws beside it.

    Where no draw of a motion had, or all had, what one in a thousand has, its variance is 0.  At 20 realisations ± 1.96
    errors held 94-96 % of the shares under 60 motions, and 91-100 % under 20, of which few leave any doubt, each seen
    1,000 times (`benchmarks.coverage.draws`); errors of quantiles were up to a fifth too large.

    Examples
    --------
    >>> share_error(np.array([[0.0, 0.0], [1.0, 1.0]])).tolist()
    0.25
    """
    draws = flags.shape[-2] * flags.shape[-1] // ways
    return np.asarray(np.hypot(sampling_error(flags, ways), 1.0 / draws))


class Quantiles(NamedTuple):
    """Quantiles with the ends of their intervals and the errors that draws leave in them, (…, quantile) each."""

    value: Array
    lower: Array
    upper: Array
    error: Array


def quantiles(
    values: Array,
    probabilities: Array,
    most: Array | float,
    confidence: float = 0.95,
    least: float = 0.0,
    ways: int = 1,
) -> Quantiles:
    """Return quantiles of values (…, motion, realisation), with distribution-free intervals.

    Parameters
    ----------
    values : ndarray, shape (…, motion, realisation)
        Motions are independent draws; the realisations of one motion are not taken as further draws.
    probabilities : ndarray, shape (quantile,)
        Between 0 and 1.
    most, least : array_like
        The greatest and the least possible value, over (…): the ends of intervals beyond the motions' values.
    confidence : float
        Between 0 and 1.
    ways : int
        As for `sampling_error`.

    Returns
    -------
    Quantiles
        The least value that is not exceeded with each probability, and the values of the ranks between which the
        quantile lies with at least the confidence.  Errors are how far the quantiles are from it at the probability
        less `ERRORS` errors of the share of values below it (`share_error`), and plus those of that up to it, over
        `ERRORS`; the greater of both (Woodruff).

    References
    ----------
    Order statistics as bounds of quantiles: David, H. A. and Nagaraja, H. N. (2003). Order statistics, 3rd ed., Wiley,
    section 7.1 (recalled).
    Woodruff, R. S. (1952). Confidence intervals for medians and other position measures. Journal of the American
    Statistical Association 47, 635-646 (recalled).

    Examples
    --------
    >>> found = quantiles(np.arange(20.0)[:, None], np.array([0.5]), most=100.0)
    >>> float(found.value[0]), float(found.lower[0]), float(found.upper[0])
    (9.0, 5.0, 14.0)
    """
    n, realisations = values.shape[-2:]
    pooled = np.sort(values.reshape(*values.shape[:-2], -1), axis=-1)
    bound = np.broadcast_to(np.asarray(most, dtype=np.float64), pooled.shape[:-1])
    found = np.empty((4, *pooled.shape[:-1], probabilities.size))
    for i, q in enumerate(probabilities):
        cumulative = scipy.special.bdtr(np.arange(n + 1), n, q)
        tail = 0.5 - 0.5 * confidence
        # the rank-th of n draws exceeds the quantile where fewer than rank of them lie below it
        low = int(np.searchsorted(cumulative, tail))
        high = int(np.searchsorted(cumulative, 1.0 - tail)) + 1
        rank = max(1, math.ceil(q * n * realisations * (1.0 - 1e-12)))
        found[0, ..., i] = pooled[..., rank - 1]
        found[1, ..., i] = pooled[..., (low - 1) * realisations] if low > 0 else least
        found[2, ..., i] = pooled[..., high * realisations - 1] if high <= n else bound
        at = found[0, ..., i][..., None, None]
        error = np.stack([-share_error(values < at, ways), share_error(values <= at, ways)], axis=-1)
        shares = np.nan_to_num(q + ERRORS * error)
        ranks = np.clip(np.ceil(shares * n * realisations), 1, n * realisations).astype(np.int64)
        away = np.abs(np.take_along_axis(pooled, ranks - 1, axis=-1) - at[..., 0]).max(axis=-1) / ERRORS
        found[3, ..., i] = np.where(np.isnan(error).any(axis=-1), np.nan, away)
    return Quantiles(*found)


def _accelerated(values: Array, mean: Array, means: Array, confidence: float, strata: tuple[Index, ...]) -> Array:
    """Return the ends (2, statistic) of the BCa interval from sorted resampled means (statistic, replicate)."""
    replicates = means.shape[1]
    # means that differ in the last digits alone, from another order of summation, count as equal
    close = 1e-12 * np.abs(mean)[:, None]
    below = np.count_nonzero(means < mean[:, None] - close, axis=1)
    equal = np.count_nonzero(np.abs(means - mean[:, None]) <= close, axis=1)
    share = (below + 0.5 * equal) / replicates
    half = 0.5 / replicates
    bias = scipy.special.ndtri(np.minimum(np.maximum(share, half), 1.0 - half))
    deviation = values - mean[:, None]
    if len(strata) > 1:
        for one in strata:
            deviation[:, one] = values[:, one] - values[:, one].mean(axis=1, keepdims=True)
    spread = np.sum(deviation**2, axis=1)
    acceleration = np.zeros(mean.size)
    np.divide(np.sum(deviation**3, axis=1), 6.0 * spread**1.5, out=acceleration, where=spread > 0.0)
    ends = np.empty((2, mean.size))
    normal = scipy.special.ndtri([0.5 - 0.5 * confidence, 0.5 + 0.5 * confidence])
    for row, z in zip(ends, normal, strict=True):
        shifted = bias + z
        # beyond the pole of the acceleration the end is that of the distribution
        at = scipy.special.ndtr(bias + shifted / np.maximum(1.0 - acceleration * shifted, 1e-6)) * (replicates - 1)
        floor = np.minimum(np.floor(at).astype(np.int64), replicates - 2)
        here = np.arange(mean.size)
        row[:] = means[here, floor] + (at - floor) * (means[here, floor + 1] - means[here, floor])
    return ends
