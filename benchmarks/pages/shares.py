"""Shares of runs, their changes and their medians, with intervals over motions.

Two set-ups are run under the same motions, so that a motion, with everything that it does to both, is one draw.  A
piece before a wall, or held on one side, answers a motion and its reversal differently, and an earthquake has no
preferred sign: both runs are of one motion, a cluster, and intervals rest on the number of motions.
"""

from __future__ import annotations

from functools import cache

import numpy as np
from scipy.stats import binom

from ...core.streams import stream
from ...fragility import binomial_interval
from .tables import Interval, points

REPLICATES = 4000


class Share(Interval):
    """A share of runs and its interval."""

    def __str__(self) -> str:
        """In per cent, as ``42 (35–49)``."""
        return f"{self.times(100.0):.0f}"

    def __format__(self, specification: str) -> str:
        """Return the share as an interval, or in per cent without a specification."""
        return super().__format__(specification) if specification else str(self)


def clustered(flags: np.ndarray) -> np.ndarray:
    """Return the mean of both runs of every motion (..., motion), from runs (..., 2 motion): each and its reverse."""
    runs = np.asarray(flags, dtype=float)
    return np.asarray(0.5 * (runs[..., ::2] + runs[..., 1::2]))


def share(clusters: np.ndarray, confidence: float = 0.95) -> Share:
    """Return the mean of clusters (motion,), each between 0 and 1, with Wilson's interval for a motion as one trial.

    It is the interval of `toppling.overturning_probability` for motions that are run both ways: at least as wide as
    that of twice as many independent runs.
    """
    lower, upper = binomial_interval(clusters.sum(), clusters.size, confidence)
    return Share(float(clusters.mean()), float(lower), float(upper))


def share_of_free(front: np.ndarray) -> Share:
    """Return the falls of a free symmetric piece into the room (motion,): half of its falls either way.

    Under a motion and its reversal it falls once into the room and once to the back, or stands twice: clusters are 0 or
    1/2.  Raises ValueError on others.
    """
    if not np.isin(front, (0.0, 0.5)).all():
        raise ValueError("a free symmetric piece falls into the room under a motion or its reversal, or neither")
    return Share(*(0.5 * end for end in share(2.0 * front)))


LEAST_DIFFERING = 8
"""Motions that must differ before the test below can decide at 1 %: 2/2^8 < 0.01 < 2/2^7."""


def decided(clusters: np.ndarray, level: float = 0.01) -> np.ndarray:
    """Return the sign of mean differences over clusters (..., motion) that are decided, 0 for the others.

    An exact two-sided permutation test: if two set-ups did not differ, the difference of every motion could as well
    have the other sign.  Differences are whole multiples of 1/2 up to 1, so that the null distribution of their sum is
    that of two binomial counts.
    """
    halves = np.rint(2.0 * clusters).astype(int)
    if np.abs(halves - 2.0 * clusters).max() > 1e-9 or np.abs(halves).max() > 2:
        raise ValueError("differences of clusters of two runs are multiples of 1/2 between -1 and 1")
    sums = halves.sum(-1)
    ones, twos = (np.abs(halves) == 1).sum(-1), (np.abs(halves) == 2).sum(-1)
    signs = np.zeros(sums.shape, dtype=int)
    for place in np.ndindex(sums.shape):
        if two_sided(int(ones[place]), int(twos[place]), int(abs(sums[place]))) <= level:
            signs[place] = np.sign(sums[place])
    return signs


def two_sided(ones: int, twos: int, observed: int) -> float:
    """Return the probability that a sum of ±1 and ±2 of either sign with equal chance is at least so far from zero."""
    first, second = np.arange(ones + 1), np.arange(twos + 1)
    sums = (2 * first - ones)[:, None] + 2 * (2 * second - twos)
    chances = binom.pmf(first, ones, 0.5)[:, None] * binom.pmf(second, twos, 0.5)
    return float(chances[np.abs(sums) >= observed].sum())


def decidable(clusters: np.ndarray) -> np.ndarray:
    """Return whether enough motions differ for a decision at 1 % (..., motion)."""
    return np.asarray((clusters != 0.0).sum(-1) >= LEAST_DIFFERING)


def flips(before: np.ndarray, after: np.ndarray) -> tuple[int, int]:
    """Return the numbers of motions (motion,) that fall only after, and only before."""
    return int((after & ~before).sum()), int((before & ~after).sum())


def sign_test(before: np.ndarray, after: np.ndarray) -> float:
    """Return the two-sided p-value of McNemar's exact test: without a difference, an outcome changes either way."""
    gained, lost = flips(before, after)
    return two_sided(gained + lost, 0, abs(gained - lost))


def holm(values: list[float], level: float = 0.05) -> list[bool]:
    """Return which p-values are decided if the chance of one wrong decision among all is at most `level`.

    Holm, S. (1979). A simple sequentially rejective multiple test procedure. Scandinavian Journal of Statistics 6(2).
    """
    order = np.argsort(values)
    decisions = [False] * len(values)
    for rank, place in enumerate(order):
        if values[place] > level / (len(values) - rank):
            break
        decisions[place] = True
    return decisions


@cache
def weights(number: int) -> np.ndarray:
    """Return shares of motions in bootstrap draws (replicate, motion): equal draws for equally many motions."""
    drawn = stream(1, 0).multinomial(number, np.full(number, 1.0 / number), REPLICATES) / number
    drawn.setflags(write=False)
    return drawn


def draws(flags: np.ndarray) -> np.ndarray:
    """Return means over motions (replicate, ...) of values (..., motion): of all motions, then of bootstrap draws.

    Values of equally many motions are drawn alike: ratios and differences of two such arrays are paired.
    """
    values = np.asarray(flags, dtype=float)
    drawn = np.moveaxis(values @ weights(values.shape[-1]).T, -1, 0)
    return np.concatenate([values.mean(-1)[None], drawn])


def interval(replicates: np.ndarray) -> Interval:
    """Return the value and the 95 % percentile interval of replicates (replicate,), the value first."""
    low, high = np.quantile(replicates[1:], [0.025, 0.975])
    return Interval(float(replicates[0]), float(low), float(high))


def change(differences: np.ndarray, digits: int = 1) -> str:
    """Return a mean of differences (motion,) in percentage points with its bootstrap interval.

    Too narrow where few motions differ: a decision takes `decided`.
    """
    return points(interval(draws(differences)), digits)


def medians(shares: np.ndarray, levels: np.ndarray) -> np.ndarray:
    """Return the level at which half of the runs fall, from shares (..., level); NaN where no level has so many.

    Shares are made to rise by their running maximum, and taken as linear in the logarithm of the level.
    """
    rising = np.maximum.accumulate(shares, axis=-1)
    reached = rising >= 0.5
    at = np.maximum(1, np.argmax(reached, axis=-1))[..., None]
    low, high = (np.take_along_axis(rising, k, axis=-1)[..., 0] for k in (at - 1, at))
    logs = np.log(levels)
    first, last = logs[at[..., 0] - 1], logs[at[..., 0]]
    part = (0.5 - low) / np.where(high > low, high - low, 1.0)
    return np.where(reached.any(-1) & (low < 0.5), np.exp(first + part * (last - first)), np.nan)


def crossing(excess: np.ndarray, levels: np.ndarray) -> Interval:
    """Return the level above which a mean excess (level, motion) stays positive, with its bootstrap interval.

    It is the last change of sign: below it the excess may change its sign more than once, and an excess of zero (no
    falls with or without) counts as a reduction.  Between two levels the mean is taken as linear in the logarithm of
    the level.  A replicate that is positive, or not, at all levels counts as the lowest, or the highest level.
    """
    means = draws(excess)
    below = means <= 0.0
    last = levels.size - 1 - np.argmax(below[:, ::-1], axis=1)
    inside = below.any(1) & (last < levels.size - 1)
    k = np.where(inside, last, 0)
    rows = np.arange(means.shape[0])
    part = -means[rows, k] / np.where(inside, means[rows, k + 1] - means[rows, k], 1.0)
    log = np.log(levels)
    crossings = np.exp(log[k] + part * (log[k + 1] - log[k]))
    return interval(np.where(inside, crossings, np.where(below.any(1), levels[-1], levels[0])))
