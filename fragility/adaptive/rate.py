"""Rates without a form of curve: levels drawn by the hazard, and the sum of the weights of the runs that overturned.

The annual rate is the integral of the probability of overturning over the rates of the levels. Levels drawn with a
known density give it without bias, for any number of levels per motion (Horvitz and Thompson 1952). A grid of levels
that all motions share is biased: ten levels are wrong by a tenth.
"""

import math
from typing import NamedTuple

import numpy as np
import scipy

from ...core import checks
from ...core.elementary import Array, Flags, Index, exp, log, log1p, times
from ..fitting.links import LINKS
from ..hazard.curve import HazardCurve
from .probit import FEWEST, Estimate, Observations, fit_line

CELLS = 400
DEFENCE = 0.05
"""Share of the runs that is spread evenly over ln levels, whatever the curve is thought to be."""
GAUSS = (0.5 - math.sqrt(1.0 / 12.0), 0.5 + math.sqrt(1.0 / 12.0))
"""Gauss' two points of an interval of length 1."""
TAIL, WIDER = 0.15, 2.0
"""Share of the runs drawn by a wider curve, and its width factor. Capacities may reach further down than a lognormal
curve predicts, and a single run there has a large weight.
"""
LOWEST, NEAR = 40, 200
"""Numbers of lowest runs that overturned: above these, the tail of a curve is seen; and from these, it is continued."""
LEAST_BELOW, LEAST_ABOVE = math.log(30.0), math.log(8.0)
DEVIATIONS = 4.0
LEAST = 1e-300
"""Annual rate, far below any that matters, instead of rates too small to represent."""
STEEPEST = 20.0
"""Maximum power with which the rates may fall at the lowest levels of a hazard curve; sites have up to 3."""


def check_hazard(hazard: HazardCurve, im: str) -> None:
    """Raise TypeError or ValueError for a hazard of another measure than the levels, or with no rates beyond its own.

    Weighted runs need rates beyond its levels, which continue with the slopes of its first and last pieces. A last
    piece without a slope never ends, and below a very steep first piece the rates overflow.
    """
    if not isinstance(hazard, HazardCurve):
        raise TypeError(f"hazard must be a HazardCurve, got {checks.kind(hazard)}")
    if hazard.im != im:
        raise ValueError(f"hazard must be of the measure of the levels, {im!r}, got {hazard.im!r}")
    for rates in (hazard.rates, *(hazard.realisations or ())):
        widths = np.diff(log(hazard.levels))
        slopes = -np.diff(log(rates)) / widths
        # (between levels a curve may bend)
        first, last = slopes[0] - hazard.curvature * widths[0], slopes[-1] + hazard.curvature * widths[-1]
        if not last > 0.0:
            raise ValueError(
                f"the last two rates of hazard are equal ({rates[-1]:g} per year), so that it cannot be continued "
                "above its highest level: leave that level out"
            )
        if first > STEEPEST:
            raise ValueError(
                f"hazard falls with the power {float(first):.3g} of the level at its lowest levels, {STEEPEST:g} at "
                "most: give lower levels, and further apart"
            )


class HazardCells(NamedTuple):
    """Levels in cells between which the rates are known.

    edges (cell + 1,): ln levels, increasing; rates (cell + 1,): of exceedance, 1/year.  Events above the last edge
    count with the outcome there: for a probability that rises they are counted too little, by no more than their rate.
    """

    edges: Array
    rates: Array

    @property
    def masses(self) -> Array:
        """Rates of the levels of each cell, 1/year; the last cell is all that lies above the last edge."""
        return np.append(self.rates[:-1] - self.rates[1:], self.rates[-1])

    @property
    def middles(self) -> Array:
        """Ln levels in the middle of the rates of each cell, and the last edge."""
        return self.at(np.arange(self.rates.size), np.full(self.rates.size, 0.5))

    def at(self, cell: Index, share: Array) -> Array:
        """Return the ln level below which a share of the rate of a cell lies; ln rates are linear within a cell."""
        inside = np.minimum(cell, self.edges.size - 2)
        left, right = self.edges[inside], self.edges[inside + 1]
        high, low = self.rates[inside], self.rates[inside + 1]
        steep = log(high / low)
        with np.errstate(divide="ignore", invalid="ignore"):
            part = -log1p(share * (low / high - 1.0)) / steep
        part = np.where(steep > 1e-12, part, share)
        return np.asarray(np.where(cell > inside, self.edges[-1], left + part * (right - left)))

    @property
    def points(self) -> tuple[Array, Array]:
        """Ln levels and rates (point,) whose products with a probability sum to its rate: two of Gauss a cell."""
        cell = np.arange(self.rates.size)
        ends = [self.at(cell, np.full(cell.size, share)) for share in GAUSS]
        return np.concatenate(ends), np.tile(0.5 * self.masses, 2)


def hazard_cells(hazard: HazardCurve, log_median: float, dispersion: float) -> HazardCells:
    """Return cells over all levels that matter to the rate of a curve that is known roughly.

    With a hazard of slope k, the levels that cause the rate lie about k dispersion² below the median. The cells reach
    four dispersions further to both sides, and at least to a thirtieth and to eight times the median.
    """
    near = exp(log_median + np.array([-0.05, 0.05]))
    slope = max(0.0, float(-np.diff(log(np.maximum(hazard.rate_at(near), LEAST)))[0] / 0.1))
    low = log_median - max(LEAST_BELOW, DEVIATIONS * dispersion + slope * dispersion**2)
    high = log_median + max(LEAST_ABOVE, DEVIATIONS * dispersion)
    points = log(np.asarray(hazard.levels))
    within = points[(points > low) & (points < high)]
    edges = np.unique(np.concatenate([np.linspace(low, high, CELLS + 1), within]))
    rates = hazard.rate_at(exp(edges))
    if not np.isfinite(rates).all():
        raise ValueError(
            f"hazard is too steep for a rate at a dispersion of {dispersion:.2g}: it falls with the power {slope:.3g}"
        )
    known = rates >= LEAST
    return HazardCells(edges[known], rates[known])


def draw_levels(cells: HazardCells, log_median: float, dispersion: float, uniform: Array) -> tuple[Array, Array]:
    """Return ln levels of motions, and weights of runs that overturn there, 1/year, both (stratum, motion).

    The levels are drawn from strata of equal share, where the hazard and the curve give them weight. `uniform` (2,
    stratum, motion) in [0, 1) chooses the cell of a stratum and the place in the cell. The mean over motions of weights
    times outcomes is the rate, for any median and dispersion of the curve; good values make it precise. Shares
    proportional to the rates of the levels times the square root of the probability have the minimum variance.
    """
    masses = cells.masses
    score = (cells.middles - log_median) / dispersion
    shares = masses * np.sqrt(scipy.special.ndtr(score))
    tail = masses * scipy.special.ndtr(score / WIDER)
    widths = np.append(np.diff(cells.edges), 0.0)
    widths[-1] = widths.sum() * 0.01  # (what lies above the cells is asked, too)
    density = (
        (1.0 - TAIL - DEFENCE) * shares / shares.sum() + TAIL * tail / tail.sum() + DEFENCE * widths / widths.sum()
    )
    strata = uniform.shape[1]
    summed = np.append(0.0, np.cumsum(density))
    summed /= summed[-1]
    at = (np.arange(strata)[:, None] + uniform[0]) / strata
    cell = np.clip(np.searchsorted(summed, at, side="right") - 1, 0, density.size - 1)
    chances = np.diff(summed)
    return cells.at(cell, uniform[1]), masses[cell] / (strata * chances[cell])


def weighted_rate(weights: Array, fell: Flags, motion: Index) -> Estimate:
    """Return the annual rate from weighted runs (run,), with an error from the scatter between motions.

    Runs without a weight (NaN) were not drawn by the hazard, and are left out. Horvitz, D. G. and Thompson, D.
    J. (1952). Journal of the American Statistical Association 47, 663-685.
    """
    known = np.isfinite(weights)
    used = np.unique(motion[known])
    k = used.size
    if k < FEWEST:
        return Estimate(math.nan, math.inf, np.zeros(0), k)
    sums = np.bincount(motion[known], np.where(fell[known], weights[known], 0.0), int(used[-1]) + 1)
    value = float(sums[used].mean())
    influence = np.zeros(sums.size)
    influence[used] = (sums[used] - value) / math.sqrt(k * (k - 1.0))
    return Estimate(value, math.sqrt(float(times(influence, influence))), influence, k)


def weighted_samples(weights: Array, fell: Flags, motion: Index, drawn: Array) -> Array:
    """Return the annual rates (replicate,) of weighted runs (run,) of which motions are drawn several times or not.

    `drawn` (replicate, motion): number of draws of each motion. Runs without a weight are left out, as by
    `weighted_rate`, which is the result if every motion is drawn once. NaN if no motion with weighted runs is drawn.
    """
    known = np.isfinite(weights)
    sums = np.bincount(motion[known], np.where(fell[known], weights[known], 0.0), drawn.shape[1])
    used = np.zeros(drawn.shape[1])
    used[motion[known]] = 1.0
    with np.errstate(divide="ignore", invalid="ignore"):
        return times(drawn, sums) / times(drawn, used)


def unseen_tail(cells: HazardCells, weights: Array, runs: Observations) -> float:
    """Return the annual rate that low levels may contribute in addition to the weighted runs there, 1/year.

    With steep hazards, much of a rate may come from levels at which hardly any run overturns, each with a large weight.
    Until one does, estimate and error are both too low. The tail is therefore continued as a power of the level, which
    falls off more slowly than the tail of a lognormal curve. It is fitted to the runs below the two hundredth fall, and
    its rate below the fortieth is compared with the rate of the weighted runs. The result is 0 if they give more, and
    infinite with fewer than two hundred falls. Weights (run,) are NaN for runs that were not drawn by the hazard.
    """
    falls = np.sort(runs.x[runs.fell])
    if falls.size < NEAR:
        return math.inf
    seen, near = falls[LOWEST - 1], runs.x <= falls[NEAR - 1]
    link = LINKS["weibull"]  # (1 - exp(-y), y a power of the level: a power where it is small)
    line = fit_line(Observations(runs.x[near], runs.fell[near], runs.motion[near]), link)
    if not np.isfinite(line.a[0]):
        return math.inf
    x, rates = cells.points
    below = x < seen
    chances = link.cumulative(line.a[0] + line.b[0] * (x[below] - line.centre) / line.width)
    known = np.isfinite(weights)
    low = known & runs.fell & (runs.x <= seen)
    seen_rate = float(weights[low].sum()) / np.unique(runs.motion[known]).size
    return max(0.0, float(times(rates[below], chances)) - seen_rate)
