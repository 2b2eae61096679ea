"""Checks of pooled surfaces against medians and rates of blocks that they have not used, from runs of their own.

A lognormal curve that fits near its median may have another tail, and rates depend on the tail. Weighted runs give
rates without a form. Their ratio to the curve's rate changes slowly over a region. A plane in the blocks' variables
therefore corrects the rates of all blocks.
"""

from typing import NamedTuple

import numpy as np
import scipy

from ...core.elementary import Array, Flags, Index, crossed, eigh, log, solve, squares, times
from ..adaptive.probit import Observations, fit_probit
from ..adaptive.rate import draw_levels, hazard_cells
from ..hazard.curve import HazardCurve
from .surface import Surface, basis

BLOCKS = 24
RUNS, RUNS_OF_MANY = 3, 1
"""Runs of each block under each motion of a set, and of a generator. A set has no other motions; further motions of a
generator give more information than further runs.
"""
MOTIONS = 300
SAME = 1e-9
LIKELY = 0.01
"""Probability below which differences, and ratios off a plane, are not there by chance."""


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


STRATA, STRATA_OF_MANY = 6, 2
"""Runs of each block under each motion of a set, and of a generator. Blocks and levels of one motion often fall
together, so that a third of its runs determine rates nearly as well.
"""
DEGREE = 1


class RatePlane(NamedTuple):
    """Plane of ln ratios of rates without a form to rates of curves: coefficients, their covariance (term, term).

    apart: ln ratio by which single blocks differ from the plane beyond chance, 0 if none does.
    """

    coefficients: Array
    covariance: Array
    apart: float

    def at(self, points: Array) -> tuple[Array, Array]:
        """Return ln ratios at points (point, axis), and their standard errors."""
        rows = basis(points, DEGREE)
        return times(rows, self.coefficients), np.sqrt(squares(rows, self.covariance))


def rate_levels(hazard: HazardCurve, log_medians: Array, dispersions: Array, uniform: Array) -> tuple[Array, Array]:
    """Return ln levels and weights, 1/year, (block, stratum, motion) of the runs of blocks (block,).

    uniform (2, stratum, motion): numbers in [0, 1), the same for all blocks.
    """
    pairs = [
        draw_levels(hazard_cells(hazard, middle, spread), middle, spread, uniform)
        for middle, spread in zip(log_medians.tolist(), dispersions.tolist(), strict=True)
    ]
    return np.stack([x for x, _ in pairs]), np.stack([weights for _, weights in pairs])


def check_rates(points: Array, curve_rates: Array, weights: Array, fell: Flags, motions: Index) -> RatePlane | None:
    """Compare rates of curves (block,) with weighted runs (block, stratum, motion), motions (motion,) as clusters.

    None if fewer blocks fell than a plane has terms.
    """
    _, cluster = np.unique(motions, return_inverse=True)
    k = int(cluster.max()) + 1
    rates = (weights * fell).sum(axis=1)
    sums = np.stack([np.bincount(cluster, row, k) for row in rates]) / (motions.size / k)
    direct = sums.mean(axis=1)
    used = direct > 0.0
    rows = basis(points, DEGREE)
    if used.sum() <= rows.shape[1]:
        return None
    influence = (sums[used] / direct[used, None] - 1.0) / k * np.sqrt(k / (k - 1.0))
    ratio = log(direct[used] / curve_rates[used])
    rows_used = rows[used]
    solved = solve(crossed(rows_used, rows_used), rows_used.T)
    coefficients = times(solved, ratio)
    share = times(solved, influence)
    plane_influence = times(rows_used, share)
    left = ratio - times(rows_used, coefficients)
    error = np.linalg.norm(influence - plane_influence, axis=1)
    chance = 2.0 * scipy.special.stdtr(max(k - 2, 1), -np.abs(left / np.where(error > 0.0, error, np.inf)))
    beyond = chance < LIKELY / used.sum()
    apart = float(np.abs(left[beyond]).max()) if beyond.any() else 0.0
    return RatePlane(coefficients, times(share, np.ascontiguousarray(share.T)), apart)
