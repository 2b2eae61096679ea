"""Two regressions behind a comparison of measures: of capacities on covariates, of demands on the measure itself."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import scipy
import xarray as xr
from numpy.typing import NDArray

from .candidates import Candidate
from .capacity import Steps, bare
from .censored import Ends, fit_trend

Values = NDArray[np.float64]


class Trends(NamedTuple):
    """Slopes of ln capacity, their standard errors and p-values (…, covariate), and the motions of each covariate."""

    slope: Values
    error: Values
    p: Values
    motions: NDArray[np.int64]


def capacity_trends(ends: Sequence[Ends], covariates: Sequence[xr.DataArray]) -> Trends:
    """Slope of ln capacity on each covariate (motion,), between ends (…, motion) of each measure: (…, measure, c).

    Fitted with the dispersion to the intervals; a covariate is taken where it is known, NaN where it does not vary.
    """
    shape = (*ends[0][0].shape[:-1], len(ends), len(covariates))
    slope, error, p = np.full(shape, np.nan), np.full(shape, np.nan), np.full(shape, np.nan)
    counts = np.zeros(len(covariates), np.int64)
    for c, covariate in enumerate(covariates):
        here = np.isfinite(covariate.values)
        x = covariate.values[here]
        counts[c] = x.size
        for j, (lower, upper) in enumerate(ends):
            slope[..., j, c], error[..., j, c] = fit_trend((lower[..., here], upper[..., here]), x)
        p[..., c] = 2.0 * scipy.special.stdtr(max(x.size - 2, 1), -np.abs(slope[..., c] / error[..., c]))
    return Trends(slope, error, p, counts)


class DemandTrends(NamedTuple):
    """Slope of ln demand on ln im and scatter about it, (block, model, measure, sample of motions)."""

    slope: Values
    scatter: Values


def demand_trends(
    runs: xr.Dataset, steps: Steps, candidates: Sequence[Candidate], weights: Values, least: float, pool: bool
) -> DemandTrends:
    """Least squares of ln(|theta|/alpha) on ln im over the runs that rock (above `least`) and stand.

    weights (sample, motion): how often each motion counts.  Every measure's sums follow from the same sums over the
    levels of each motion.
    """
    order = ("block", "model", "motion", "level")
    demand = steps.in_order(runs["peak_rotation"]) / bare(runs["alpha"])
    used = ((demand > np.maximum(least, _zone(runs))) & ~bare(steps.overturned)).transpose(*order)
    kept = used.values
    y = np.log(demand.transpose(*order).where(used, 1.0).values)
    t = np.where(kept, np.broadcast_to(steps.factors_by_block[:, None], kept.shape), 0.0)
    ones = kept.astype(float)
    count, s_t, s_tt, s_y, s_ty, s_yy = (one.sum(axis=-1) for one in (ones, t, t * t, y, t * y, y * y))
    blocks, models, motions = count.shape
    shape = (1 if pool else blocks, models, len(candidates), weights.shape[0])
    slope, scatter = np.full(shape, np.nan), np.full(shape, np.nan)
    for j, one in enumerate(candidates):
        a = np.broadcast_to(np.atleast_2d(one.log_values), (blocks, motions))[:, None, :]
        # about the middle, or the squares cancel; each block's own, so that others change no digit of it
        a = a - (a.mean() if pool else a.mean(axis=-1, keepdims=True))
        k = one.power
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
        if pool:
            sums = sums.sum(axis=1, keepdims=True)
        n, x, xx, sy, xy, yy = sums @ weights.T
        with np.errstate(invalid="ignore", divide="ignore"):
            spread, joint = xx - x * x / n, xy - x * sy / n
            b = np.where(spread > 1e-12 * n, joint / spread, np.nan)
            rest = np.maximum(yy - sy * sy / n - b * joint, 0.0)
            slope[:, :, j] = b
            scatter[:, :, j] = np.sqrt(np.where(n > 2.0, rest / (n - 2.0), np.nan))
    return DemandTrends(slope, scatter)


def _zone(runs: xr.Dataset) -> xr.DataArray:
    """Demand at the edge of the elastic zone, below which a block does not rock: 0 where it rests rigidly."""
    delta = bare(runs["delta"]).fillna(0.0)
    return delta.where(bare(runs["rest"]) != "rigid", 0.0)
