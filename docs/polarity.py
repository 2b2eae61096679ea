"""Shares of runs under both polarities of every motion, whose intervals know that the two belong together.

A piece before a wall, or held on one side, answers a motion and its reversal differently, and an earthquake has no
preferred sign.  Both runs are of one motion: they form a cluster, and the number of motions is what intervals rest on.
"""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import numpy as np
from scipy.stats import binom

from toppling.core.streams import stream
from toppling.fragility import binomial_interval

REPLICATES = 4000


class Share(NamedTuple):
    """A share of runs and its interval."""

    value: float
    lower: float
    upper: float

    def __str__(self) -> str:
        """In per cent, as ``42 (35–49)``."""
        return f"{100.0 * self.value:.0f} ({100.0 * self.lower:.0f}–{100.0 * self.upper:.0f})"


def clustered(flags: np.ndarray) -> np.ndarray:
    """Mean of both runs of every motion (..., motion), from flags of runs (..., 2 motion): each and its reverse."""
    runs = np.asarray(flags, dtype=float)
    return 0.5 * (runs[..., ::2] + runs[..., 1::2])


def share(clusters: np.ndarray, confidence: float = 0.95) -> Share:
    """The mean of clusters (motion,), each between 0 and 1, with Wilson's interval that takes a motion as one trial.

    It is the interval of `toppling.overturning_probability` for motions that are run both ways: at least as wide as
    that of twice as many independent runs.
    """
    lower, upper = binomial_interval(clusters.sum(), clusters.size, confidence)
    return Share(float(clusters.mean()), float(lower), float(upper))


def share_of_free(front: np.ndarray, confidence: float = 0.95) -> Share:
    """Falls of a free symmetric piece into the room (motion,): half of its falls either way, and so is the interval.

    Under a motion and its reversal it falls once into the room and once to the back, or stands twice: clusters are 0 or
    1/2.  Raises ValueError on others.
    """
    if not np.isin(front, (0.0, 0.5)).all():
        raise ValueError("a free symmetric piece falls into the room under a motion or its reversal, or neither")
    return Share(*(0.5 * one for one in share(2.0 * front, confidence)))


LEAST_DIFFERING = 8
"""Motions that must differ before the test below can decide at 1 %: 2/2^8 < 0.01 < 2/2^7."""


def decided(clusters: np.ndarray, level: float = 0.01) -> np.ndarray:
    """The sign of mean differences over clusters (..., motion) that are decided, 0 for the others.

    An exact two-sided permutation test: if two set-ups did not differ, the difference of every motion could as well
    have the other sign.  Differences are whole multiples of 1/2 up to 1, so that the null distribution of their sum is
    that of two binomial counts.
    """
    halves = np.rint(2.0 * clusters).astype(int)
    if np.abs(halves - 2.0 * clusters).max() > 1e-9 or np.abs(halves).max() > 2:
        raise ValueError("differences of clusters of two runs are multiples of 1/2 between -1 and 1")
    sums = halves.sum(-1)
    ones, twos = (np.abs(halves) == 1).sum(-1), (np.abs(halves) == 2).sum(-1)
    found = np.zeros(sums.shape, dtype=int)
    for here in np.ndindex(sums.shape):
        if _two_sided(int(ones[here]), int(twos[here]), int(abs(sums[here]))) <= level:
            found[here] = np.sign(sums[here])
    return found


def _two_sided(ones: int, twos: int, observed: int) -> float:
    """Probability that a sum of so many ±1 and ±2 of either sign with equal chance is at least so far from zero."""
    first, second = np.arange(ones + 1), np.arange(twos + 1)
    sums = (2 * first - ones)[:, None] + 2 * (2 * second - twos)
    chances = binom.pmf(first, ones, 0.5)[:, None] * binom.pmf(second, twos, 0.5)
    return float(chances[np.abs(sums) >= observed].sum())


def decidable(clusters: np.ndarray) -> np.ndarray:
    """Whether enough motions differ for a decision at 1 % (..., motion)."""
    return np.asarray((clusters != 0.0).sum(-1) >= LEAST_DIFFERING)


@cache
def weights(number: int) -> np.ndarray:
    """Shares of motions in bootstrap draws (replicate, motion): the same draws for all values of as many motions."""
    found = stream(1, 0).multinomial(number, np.full(number, 1.0 / number), REPLICATES) / number
    found.setflags(write=False)
    return found


def difference(clusters: np.ndarray, confidence: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Mean difference over clusters (..., motion) and its percentile bootstrap interval, which draws whole motions.

    Too narrow where few motions differ: a decision takes `decided`.
    """
    tail = 0.5 * (1.0 - confidence)
    low, high = np.quantile(clusters @ weights(clusters.shape[-1]).T, [tail, 1.0 - tail], axis=-1)
    return clusters.mean(-1), low, high


def crossing(excess: np.ndarray, levels: np.ndarray, confidence: float = 0.95) -> tuple[float, float, float]:
    """The level above which a mean excess stays positive, with its percentile bootstrap interval over motions.

    It is the last change of sign: below it the excess may change its sign more than once, and an excess of zero (no
    falls with or without) counts as a reduction.
    `excess` (level, motion); between two levels the mean is taken as linear in the logarithm of the level.  A replicate
    that is positive, or not, at all levels counts as the lowest, or the highest level.
    """
    means = np.vstack([excess.mean(-1), (excess @ weights(excess.shape[-1]).T).T])
    below = means <= 0.0
    last = levels.size - 1 - np.argmax(below[:, ::-1], axis=1)
    inside = below.any(1) & (last < levels.size - 1)
    k = np.where(inside, last, 0)
    rows = np.arange(means.shape[0])
    part = -means[rows, k] / np.where(inside, means[rows, k + 1] - means[rows, k], 1.0)
    log = np.log(levels)
    found = np.exp(log[k] + part * (log[k + 1] - log[k]))
    found = np.where(inside, found, np.where(below.any(1), levels[-1], levels[0]))
    tail = 0.5 * (1.0 - confidence)
    low, high = np.quantile(found[1:], [tail, 1.0 - tail])
    return float(found[0]), float(low), float(high)
