"""Rates without a form of curve at the blocks of a check, and the correction of rates of lognormal curves.

A lognormal curve that fits near its median may have another tail, and rates depend on the tail. Weighted runs give
rates without a form. Their ratio to the curve's rate changes slowly over a region. A plane in the blocks' variables
therefore corrects the rates of all blocks.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import scipy

from ...core.elementary import Array, Flags, Index, crossed, log, solve, squares, times
from ..adaptive.rate import draw_levels, hazard_cells
from ..hazard.curve import HazardCurve
from .surface import basis

STRATA, STRATA_OF_MANY = 6, 2
"""Runs of each block under each motion of a set, and of a generator. Blocks and levels of one motion often fall
together, so that a third of its runs determine rates nearly as well.
"""
DEGREE = 1
LIKELY = 0.01
"""Probability below which a ratio is not on the plane by chance."""


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
