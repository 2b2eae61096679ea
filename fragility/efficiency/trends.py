"""Regressions for the ranking of measures: capacities on covariates, and demands on the measure itself.

Capacities are interval-censored; compiled kernels fit their lognormal distributions and trends, many at once.
"""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import scipy
import xarray as xr
from numpy.typing import NDArray

from ...core.elementary import Array, Index, log, times
from ..fitting.states import ALL, DECREASING, FAILED, NONE, OK, SEPARATED
from ..kernels import censored as engine
from ..runs.provenance import BED
from ..runs.runners import shared, thread_count
from .candidates import Candidate
from .capacity import OrderedRuns, without_coordinates

LogCapacityEnds = tuple[Array, Array]
"""Lower and upper ends of ln capacity, (…, motion); infinite if only the other end is known."""

STATUSES = (OK, NONE, ALL, SEPARATED, DECREASING, FAILED)
"""Statuses of a fit in the order of the codes in `kernels.censored`."""
RESAMPLE_TOLERANCE = 0.03
"""Tolerance of a bootstrap fit before its last step, in standard errors; replicates scatter by about 1."""

ROUNDING = 1e-13
"""Share of a sum of squares up to which the remainder of a line is rounding."""


def fit_dispersions(ends: Sequence[LogCapacityEnds], weights: Array) -> tuple[Array, NDArray[np.int8]]:
    """Fit the standard deviation of ln capacity in each measure, under weights (sample, motion), the first row alike.

    Return dispersions (…, measure, sample) and the status of the first sample; NaN if there is none.

    Rows are shared between threads; the result of a row depends on that row alone.
    """
    shape = (*ends[0][0].shape[:-1], len(ends))
    lower, upper = (np.stack(side, axis=-2).reshape(-1, weights.shape[1]) for side in zip(*ends, strict=True))
    sizes = (lower.shape[0], weights.shape[0])
    location, dispersion, status = np.empty(sizes), np.empty(sizes), np.empty(sizes, np.int8)
    workers = min(thread_count(), sizes[0])
    bounds = np.linspace(0, sizes[0], workers + 1).astype(int).tolist()

    def part(ends: tuple[int, int]) -> None:
        rows = slice(*ends)
        results = location[rows], dispersion[rows], status[rows]
        engine.fit_rows(lower[rows], upper[rows], weights, RESAMPLE_TOLERANCE, *results)

    list(shared(part, list(pairwise(bounds))))
    return dispersion.reshape(*shape, -1), status[:, 0].copy().reshape(shape)


def fit_trend(ends: LogCapacityEnds, covariate: Array) -> tuple[Array, Array]:
    """Return the slope (…) of ln capacity on a covariate (motion,) and its standard error; NaN without a fit."""
    shape = ends[0].shape[:-1]
    lower, upper = (np.ascontiguousarray(end.reshape(-1, covariate.size)) for end in ends)
    fits = np.empty(lower.shape[0]), np.empty(lower.shape[0]), np.empty(lower.shape[0], np.int8)
    engine.fit_trends(lower, upper, covariate, *fits)
    return fits[0].reshape(shape), fits[1].reshape(shape)


def capacity_trends(
    ends: Sequence[LogCapacityEnds], covariates: Sequence[xr.DataArray]
) -> tuple[Array, Array, Array, Index]:
    """Fit the slope of ln capacity on each covariate (motion,), given ends (…, motion) in each measure.

    Return slopes, their standard errors and p-values (…, measure, covariate), and the motions of each covariate
    (covariate,). Slope and dispersion are fitted together to the intervals, over the motions whose covariate is known;
    the slope is NaN if the covariate does not vary.
    """
    shape = (*ends[0][0].shape[:-1], len(ends), len(covariates))
    slope, error, p = np.full(shape, np.nan), np.full(shape, np.nan), np.full(shape, np.nan)
    counts = np.zeros(len(covariates), np.int64)
    for c, covariate in enumerate(covariates):
        known = np.isfinite(covariate.values)
        x = covariate.values[known]
        counts[c] = x.size
        for j, (lower, upper) in enumerate(ends):
            slope[..., j, c], error[..., j, c] = fit_trend((lower[..., known], upper[..., known]), x)
        p[..., c] = 2.0 * scipy.special.stdtr(max(x.size - 2, 1), -np.abs(slope[..., c] / error[..., c]))
    return slope, error, p, counts


def demand_trends(
    runs: xr.Dataset, ordered: OrderedRuns, candidates: Sequence[Candidate], weights: Array, least: float
) -> tuple[Array, Array]:
    """Regress ln(|theta|/alpha) on ln im by least squares, over runs that rock (above `least`) without overturning.

    Returns the slope and the scatter about it, (block, model, measure, sample of motions). `weights` (sample, motion):
    number of counts of each motion. The sums for every measure follow from the same sums over the levels of each
    motion.
    """
    order = ("block", "model", "motion", "level")
    demand = ordered.in_order(runs["peak_rotation"]) / without_coordinates(runs["alpha"])
    used = (
        (demand > np.maximum(least, _elastic_zone_edge(runs))) & ~without_coordinates(ordered.overturned)
    ).transpose(*order)
    kept = used.values
    y = log(demand.transpose(*order).where(used, 1.0).values)
    t = np.where(kept, np.broadcast_to(ordered.factors_by_block[:, None], kept.shape), 0.0)
    ones = kept.astype(float)
    count, s_t, s_tt, s_y, s_ty, s_yy = (product.sum(axis=-1) for product in (ones, t, t * t, y, t * y, y * y))
    blocks, models, motions = count.shape
    shape = (blocks, models, len(candidates), weights.shape[0])
    slope, scatter = np.full(shape, np.nan), np.full(shape, np.nan)
    for j, candidate in enumerate(candidates):
        a = np.broadcast_to(np.atleast_2d(candidate.log_values), (blocks, motions))[:, None, :]
        # relative to the mean, since the squares would cancel; each block's own mean, so that other blocks do not
        # change its digits
        a = a - a.mean(axis=-1, keepdims=True)
        k = candidate.power
        sums = np.stack(
            [
                count,
                count * a + k * s_t,
                count * a * a + 2.0 * k * a * s_t + k * k * s_tt,
                s_y,
                a * s_y + k * s_ty,
                s_yy,
            ]
        )
        n, x, xx, sy, xy, yy = times(sums, weights.T)
        with np.errstate(invalid="ignore", divide="ignore"):
            spread, joint = xx - x * x / n, xy - x * sy / n
            b = np.where(spread > 1e-12 * n, joint / spread, np.nan)
            rest = yy - sy * sy / n - b * joint
            rest = np.where(rest <= ROUNDING * yy, 0.0, rest)
            slope[:, :, j] = b
            scatter[:, :, j] = np.sqrt(np.where(n > 2.0, rest / (n - 2.0), np.nan))
    return slope, scatter


def _elastic_zone_edge(runs: xr.Dataset) -> xr.DataArray:
    """Return the demand at the edge of the elastic zone, below which a block does not rock; 0 for rigid rest."""
    delta = without_coordinates(runs["delta"]).fillna(0.0)
    if BED in runs.coords:
        depth = without_coordinates(runs[BED])
        of_bed = depth / (0.5 * without_coordinates(runs["width"]) * without_coordinates(runs["alpha"]))
        delta = of_bed.fillna(delta)
    return delta.where(without_coordinates(runs["rest"]) != "rigid", 0.0)
