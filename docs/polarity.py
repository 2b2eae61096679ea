"""Shares of runs under both polarities of every motion, whose intervals know that the two belong together.

A piece before a wall, or held on one side, answers a motion and its reversal differently, and an earthquake has no
preferred sign.  Both runs are of one motion: they form a cluster, and the number of motions is what intervals rest on.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.stats import beta

from toppling.streams import stream

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


def share(clusters: np.ndarray, confidence: float = 0.95, runs: int = 2) -> Share:
    """The mean of clusters (motion,) of so many runs each, with its interval.

    Clopper and Pearson's interval with the effective number of runs p (1 - p)/variance, at most that of all runs; where
    all clusters are alike, one run per motion (Korn, E. L. and Graubard, B. I. 1998, Confidence intervals for
    proportions with small expected number of positive counts estimated from survey data, Survey Methodology 24).
    """
    number, value = clusters.size, float(clusters.mean())
    effective = float(number)
    if 0.0 < value < 1.0:
        variance = float(clusters.var(ddof=1)) / number
        effective = (
            min(float(runs * number), value * (1.0 - value) / variance) if variance > 0.0 else float(runs * number)
        )
    hits, tail = value * effective, 0.5 * (1.0 - confidence)
    lower = 0.0 if hits == 0.0 else float(beta.ppf(tail, hits, effective - hits + 1.0))
    upper = 1.0 if hits == effective else float(beta.ppf(1.0 - tail, hits + 1.0, effective - hits))
    return Share(value, lower, upper)


def difference(clusters: np.ndarray, confidence: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Mean difference over clusters (..., motion) and its percentile bootstrap interval, which draws whole motions."""
    number = clusters.shape[-1]
    weights = stream(1, 0).multinomial(number, np.full(number, 1.0 / number), REPLICATES) / number
    tail = 0.5 * (1.0 - confidence)
    low, high = np.quantile(clusters @ weights.T, [tail, 1.0 - tail], axis=-1)
    return clusters.mean(-1), low, high


def crossing(excess: np.ndarray, levels: np.ndarray, confidence: float = 0.95) -> tuple[float, float, float]:
    """The level above which a mean excess stays positive, with its percentile bootstrap interval over motions.

    `excess` (level, motion); between two levels the mean is taken as linear in the logarithm of the level.  A replicate
    that is positive, or not, at all levels counts as the lowest, or the highest level.
    """
    number = excess.shape[-1]
    weights = stream(1, 0).multinomial(number, np.full(number, 1.0 / number), REPLICATES) / number
    means = np.vstack([excess.mean(-1), (excess @ weights.T).T])
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
