"""Samples of annual rates for their intervals over motions, and the rates of the runs themselves.

A curve of the wrong form has a rate that more motions do not bring nearer to the true one.  The rate of the runs is
that of the curve, and what the observed shares of overturning add to it, linear in ln x between the levels.
"""

from __future__ import annotations

import numpy as np
import xarray as xr

from ...core.aliases import Array
from ..curves.curve import LEAST, CurveArrays, LognormalCurves, TabulatedCurves, curve_arrays
from ..fitting.labels import OBSERVED
from ..hazard.pieces import Pieces
from .convolution import rates_of
from .modelling import MODELLING

POWER = 2.0
"""Power of the ratio of dispersions that studentises a step of ln(rate).

The variance of ln(rate) of n motions with one capacity each is k² beta² (1 + k² beta²/2)/n, so that errors are as a
power of beta between 1 and 2.  Of 1, 1.5 and 2, whose upper tails were 4-8, 3-5 and 2-4 % in 1,000 studies of 20
motions (nominal 2.5 %), it is the one that holds.
"""
MOST_RATIO = 2.0
"""Greatest ratio of dispersions that counts: data of few motions are drawn separated, and hold no dispersion.

Coverage was the same to 0.3 % as without a bound, and the longest of 960 intervals 5 to 7 in place of 5 to 100 times as
long as the normal one.
"""


def studentised(curves: xr.Dataset, rates: Array, samples: Array) -> Array:
    """Return samples (curve, replicate, hazard) whose percentiles are the ends of bootstrap-t intervals of the rates.

    The step of a replicate in ln(rate) is taken the other way, times (beta/beta of the replicate)², with a ratio of at
    most `MOST_RATIO`: replicates of few severe motions have low rates and small errors, so that plain percentiles are
    too short on the unsafe side. Efron, B. and Tibshirani, R. J. (1993). An introduction to the bootstrap. Chapman and
    Hall, chapters 12 and 22.
    """
    own = _of_motions(curves, False).dispersion.reshape(-1, 1)
    sampled = _of_motions(curves, True).dispersion.reshape(own.size, samples.shape[1])
    # (a step has no error to be scaled by)
    ratio = np.divide(own, sampled, out=np.ones_like(sampled), where=(own > 0.0) & (sampled > 0.0))
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        scale = np.minimum(ratio, MOST_RATIO)[..., None] ** POWER
        step = (np.log(samples) - np.log(rates)[:, None]) * scale
        return np.asarray(np.where(np.isnan(sampled)[..., None], np.nan, rates[:, None] * np.exp(-step)))


def of_runs(curves: xr.Dataset, arrays: CurveArrays, hazards: list[Pieces]) -> Array | None:
    """Return the rates of the runs over those of their curves, (curve, hazard), without modelling uncertainty.

    None where the shares of the runs at common levels are not known.  arrays: the curves in the hazard's measure.
    """
    if OBSERVED not in curves or not isinstance(arrays, LognormalCurves) or curves.sizes["level"] < 2:
        return None
    motions = _of_motions(curves, False)
    dims = [dim for dim in curves["median"].dims if dim in curves[OBSERVED].dims]
    levels = np.log(curves["level"].values.astype(np.float64))
    plain = motions.flat()
    seen = curves[OBSERVED].transpose(*dims, "level").values.reshape(-1, levels.size)
    shift = np.nan_to_num(arrays.log_median.ravel() - plain.log_median)
    ends = 2.0 * levels[[0, -1]] - levels[[1, -2]]
    at = np.concatenate([ends[:1], levels, ends[1:]])
    found = []
    for hazard in hazards:
        rate = rates_of(plain.shifted(shift), hazard).rate
        by_shares, by_curve = (
            rates_of(TabulatedCurves(at, np.pad(values, ((0, 0), (1, 1))), shift), hazard, LEAST).rate
            for values in (seen, plain.probability(levels))
        )
        with np.errstate(divide="ignore", invalid="ignore"):
            found.append(np.maximum(1.0 + (by_shares - by_curve) / rate, 0.0))
    return np.stack(found, axis=-1)


def _of_motions(curves: xr.Dataset, replicates: bool) -> LognormalCurves:
    """Return curves, or their replicates, whose dispersion is of the motions alone."""
    arrays = curve_arrays(curves, replicates)[0]
    assert isinstance(arrays, LognormalCurves)
    spread = float(curves.attrs.get(MODELLING, 0.0))
    return arrays._replace(dispersion=np.sqrt(np.maximum(arrays.dispersion**2 - spread**2, 0.0)))
