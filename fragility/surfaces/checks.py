"""Check of pooled surfaces against medians of blocks that they have not used, from runs of their own."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import scipy

from ...core.elementary import Array, Flags, Index, eigh, times
from ..adaptive.probit import Observations, fit_probit
from .surface import Surface

BLOCKS = 24
RUNS, RUNS_OF_MANY = 3, 1
"""Runs of each block under each motion of a set, and of a generator. A set has no other motions; further motions of a
generator give more information than further runs.
"""
MOTIONS = 300
SAME = 1e-9
LIKELY = 0.01
"""Probability below which differences are not there by chance."""


class Check(NamedTuple):
    """Comparison at blocks (block,): ln medians from their own runs less the surface's, and errors of the differences.

    p_value: probability of differences as large as all of these together, by chance; worst: the largest difference
    beyond chance, 0 if there is none.
    """

    points: Array
    difference: Array
    error: Array
    p_value: float
    worst: float

    @property
    def passed(self) -> bool:
        """True if the differences are within chance."""
        return self.worst == 0.0


def check_surface(near: Surface, points: Array, motions: Index, x: Array, fell: Flags) -> Check:
    """Return the comparison of a surface with local curves of blocks of their own, those whose runs determine a median.

    `points` are (block, axis), ln levels `x` and outcomes `fell` (block, run, motion); `motions` (motion,) are the
    numbers of the surface's runs if they are the same. All blocks share motions, with each other and perhaps with the
    surface. The covariance of the differences is therefore the covariance of the motions' sums (Liang and Zeger 1986).
    All differences together are tested by Hotelling's T²; single differences are significant at a level of 1 % for all
    together (Bonferroni).
    """
    numbers = np.broadcast_to(motions, x.shape[1:]).ravel()
    rows, _ = near.terms(points)
    middle = near.log_medians(points)
    differences, influences, used = [], [], []
    for block in range(len(points)):
        fitted, _ = fit_probit(Observations(x[block].ravel(), fell[block].ravel(), numbers))
        median = None if fitted is None else fitted.median()
        if median is None or not np.isfinite(median.error) or not median.error > 0.0:
            continue
        size = max(median.influence.size, len(near.influence))
        influence = np.pad(median.influence, (0, size - median.influence.size))
        influence[: len(near.influence)] -= times(near.influence[:, : rows.shape[1]], rows[block])
        differences.append(median.value - middle[block])
        influences.append(influence)
        used.append(block)
    if not used:
        return Check(points[:0], np.zeros(0), np.zeros(0), 1.0, 0.0)
    difference, table = np.array(differences), np.array(influences)
    covariance = times(table, np.ascontiguousarray(table.T))
    error = np.sqrt(np.diag(covariance))
    k, n = np.unique(motions).size, difference.size
    together = _hotelling(difference, covariance, k)
    single = 2.0 * scipy.special.stdtr(max(k - 2, 1), -np.abs(difference / error))
    beyond = single < LIKELY / n
    if together < LIKELY and not beyond.any():
        # no single difference is beyond chance: the furthest counts for all
        beyond = single == single.min()
    worst = float(np.abs(difference[beyond]).max()) if beyond.any() else 0.0
    return Check(points[used], difference, error, together, worst)


def _hotelling(difference: Array, covariance: Array, motions: int) -> float:
    """Return the probability of differences as large, by Hotelling's T² with `motions` draws."""
    values, vectors = eigh(covariance)
    # (blocks that are nearly one have nearly one difference)
    apart = values > SAME * values[-1]
    n = int(apart.sum())
    if motions <= n + 1:
        return 1.0
    along = times(np.ascontiguousarray(vectors.T[apart]), difference)
    statistic = float((along**2 / values[apart]).sum())
    return float(scipy.special.fdtrc(n, motions - n, statistic * (motions - n) / (n * (motions - 1))))
