"""Curves of blocks from a surface, slab by slab, so that a million of them take little memory."""

import math
from typing import NamedTuple

import numpy as np

from ...core.elementary import Array, Flags, exp, squares
from ..adaptive.probit import student
from ..curves.curve import LognormalCurves
from ..hazard.pieces import Pieces
from ..risk.convolution import rates_and_slopes
from ..runs.runners import shared
from .checks import RatePlane
from .surface import Surface

SLAB = 50_000
"""Blocks at a time."""


class LawSurfaces(NamedTuple):
    """Result of a pooled analysis for one law.

    `near`: the surface of levels near the medians. `curve`: of all runs. `factor`: number of standard errors by which
    all medians are within their intervals at once. `apart`: ln median by which checks differed from the surface, 0
    without a difference. `rates`: transforms rates of curves to rates without a form, None without a hazard.
    """

    near: Surface
    curve: Surface
    factor: float
    apart: float
    rates: RatePlane | None = None


class Curves(NamedTuple):
    """Of blocks (block,): ln of median, of its interval, and of the median by all runs; dispersions; rates, 1/year.

    `share_below`, `share_above`: shares of the rates from beyond the levels of the hazard curve.
    """

    log_median: Array
    log_lower: Array
    log_upper: Array
    log_curve_median: Array
    dispersion: Array
    dispersion_lower: Array
    dispersion_upper: Array
    rate: Array
    rate_lower: Array
    rate_upper: Array
    share_below: Array
    share_above: Array


def curves_at(law: LawSurfaces, points: Array, log_unit: Array, hazard: Pieces | None) -> Curves:
    """Return the curves of blocks at points (block, axis) in the region of the surfaces.

    `log_unit` (block,) is ln of the level that is 1 in the surface, g tan(alpha) to the power of the measure; rates are
    NaN without a hazard. Intervals of medians are valid for all blocks at once with 95 % confidence, intervals of
    dispersions and rates for each block by itself. Intervals of medians and rates include the differences of the
    checks. If the runs do not decide the side of a block at a cut, its intervals include both sides.
    """
    arrays = [np.empty(len(points)) for _ in Curves._fields]
    parts = [slice(first, first + SLAB) for first in range(0, len(points), SLAB)]
    slabs = shared(lambda part: _slab(law, points[part], log_unit[part], hazard), parts)
    for part, slab in zip(parts, slabs, strict=True):
        for array, values in zip(arrays, slab, strict=True):
            array[part] = values
    curves = Curves(*arrays)
    if law.near.cut is not None:
        _widen(curves, law, law.near.cut.open_at(points), points, log_unit, hazard)
    return curves


def _widen(
    curves: Curves, law: LawSurfaces, which: Flags, points: Array, log_unit: Array, hazard: Pieces | None
) -> None:
    """Let the intervals of some blocks (block,) include both sides of the cut."""
    for far in (False, True):
        side = law._replace(near=law.near.on_side(far), curve=law.curve.on_side(far))
        beyond = _slab(side, points[which], log_unit[which], hazard)
        for end, widest in (("lower", np.minimum), ("upper", np.maximum)):
            for name in (f"log_{end}", f"dispersion_{end}", f"rate_{end}"):
                array = getattr(curves, name)
                array[which] = widest(array[which], getattr(beyond, name))


def _slab(law: LawSurfaces, points: Array, log_unit: Array, hazard: Pieces | None) -> Curves:
    middle, error = law.near.log_medians(points), law.near.median_errors(points)
    reach = law.factor * error + law.apart
    curve_middle = law.curve.log_medians(points)
    spread, spread_error = law.curve.log_dispersions(points), law.curve.dispersion_errors(points)
    t = student(law.curve.motions - len(law.curve.coefficients))
    ends = [exp(spread + sign * t * spread_error) for sign in (0.0, -1.0, 1.0)]
    rates = [np.full(len(points), math.nan)] * 5
    if hazard is not None:
        rates = _rates(law, points, curve_middle + log_unit, ends[0], hazard, t)
    medians = [log_unit + middle, log_unit + middle - reach, log_unit + middle + reach, log_unit + curve_middle]
    return Curves(*medians, *ends, *rates)


def _rates(
    law: LawSurfaces, points: Array, log_median: Array, dispersion: Array, hazard: Pieces, t: float
) -> list[Array]:
    """Return annual rates and their intervals, from the curves through all runs and the ratios of the checks.

    They include the shares from below and above the levels of the hazard curve, of the curves. The errors of curves and
    ratios are assumed to be independent. The errors of ln rates of curves are from the delta method.
    """
    curves = LognormalCurves(log_median, dispersion, np.full(len(points), -np.inf), np.zeros(len(points)))
    rates, (by_median, by_spread) = rates_and_slopes(curves, hazard)
    rate = rates.rate
    middle, spread = law.curve.terms(points)
    rows = np.concatenate([by_median[:, None] * middle, by_spread[:, None] * spread], axis=1)
    variance = squares(rows, law.curve.covariance)
    apart = np.zeros(len(points))
    if law.rates is not None:
        ratio, error = law.rates.at(points)
        rate, variance, apart = rate * exp(ratio), variance + error**2, apart + law.rates.apart
    reach = t * np.sqrt(variance) + apart
    ends = [rate * exp(-reach), rate * exp(np.minimum(reach, 700.0))]
    return [rate, *ends, rates.share_below, rates.share_above]
