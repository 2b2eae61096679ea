"""Slenderness that meets a target, from one curve in a normalised measure."""

from __future__ import annotations

import math

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ...core import checks
from ...core.aliases import Array
from ...core.units import DIMENSIONLESS, RADIAN, provenance
from ...core.wording import given_percent
from ..curves.curve import REFUSE, CurveArrays, LognormalCurves, coordinates_on, has_replicates, im_of
from ..fitting.bootstrap import percentile_interval
from ..fitting.states import NO_RATE, OK, TOO_HIGH, TOO_LOW
from ..hazard.curve import HazardCurve
from ..hazard.pieces import EXTEND, Pieces
from ..runs.provenance import configuration_of
from ..runs.scaling import BLOCK_MEASURES
from .common_measure import in_hazard_measure, per_block
from .convolution import rates_of
from .inversion import target_rate

# Distance in ln x by which a curve may be shifted beyond the levels of a hazard curve to meet a target.
FAR = 30.0
# From a bracket of some 70 in ln x down to rounding.
BISECTIONS = 60


def slenderness_for_rate(
    curves: xr.Dataset,
    hazard: HazardCurve,
    *,
    rate: float | None = None,
    probability: float | None = None,
    years: float = 50.0,
    p: float | None = None,
    below: str = EXTEND,
    above: str = EXTEND,
    outside: str = REFUSE,
    confidence: float = 0.95,
) -> xr.Dataset:
    """Find the slenderness at which a curve in a normalised measure meets a target: one curve for any tan alpha.

    Parameters
    ----------
    curves : xarray.Dataset
        Curves in ``pga_normalised`` or ``pgv_normalised``; each is taken to hold for every slenderness.
    hazard : HazardCurve
        Hazard curve of ``pga`` or ``pgv``.
    rate, probability, years
        The target, as `size_for_rate`.
    p : float, optional
        Frequency parameter of the block sought (rad/s, > 0), for ``pgv_normalised``; the coordinate p where not given.
    below, above, outside
        Rules for tails, as `annual_rate`.
    confidence : float
        Of the interval, between 0 and 1.

    Returns
    -------
    xarray.Dataset
        On the dimensions of the curves: alpha (rad), tan_alpha (width over height of a uniform block), status (``ok``,
        ``all above the target``, ``all below the target``, ``no rate``), and with replicates or realisations
        alpha_lower and alpha_upper (0 or pi/2 where samples meet the target at no slenderness).

    Raises
    ------
    TypeError, ValueError
        Curves of another measure; as `annual_rate`; no target or two.

    Notes
    -----
    Levels of the ground measure are y g tan(alpha), or y g tan(alpha)/p of velocity, for a level y of the curve: the
    rate is monotone in tan(alpha), which is found by bisection to rounding.  That one curve holds for every slenderness
    is exact for a rigid block of small alpha at one p and one e; check with `ida` of the block found.

    Examples
    --------
    >>> import xarray as xr
    >>> curves = xr.Dataset({"median": ((), 3.0, {"units": "1"}), "dispersion": 0.4}, attrs={"im": "pga_normalised"})
    >>> hazard = HazardCurve.power_law(1e-4, 2.5, "pga", units="g")
    >>> float(slenderness_for_rate(curves, hazard, probability=0.01, years=50)["tan_alpha"].round(4))
    0.3079
    """
    goal = target_rate(rate, probability, years)
    level = checks.number("confidence", confidence, above=0.0, below=1.0)
    name = im_of(curves) if isinstance(curves, xr.Dataset) else ""
    if name not in BLOCK_MEASURES:
        raise ValueError(f"curves must be of {' or '.join(BLOCK_MEASURES)}, got {name!r}")
    # levels of a block with tan alpha = 1: the slenderness sought multiplies them
    blocks = curves.drop_vars([one for one in ("alpha", "p") if one in curves.coords])
    speed = curves.coords.get("p", xr.DataArray(math.nan)) if p is None else checks.number("p", p, above=0.0)
    unit = blocks.assign_coords(alpha=math.pi / 4.0, p=speed if name == "pgv_normalised" else 1.0)
    per_block(unit, name)
    pieces = hazard.pieces(below, above)
    arrays, dims = in_hazard_measure(unit, hazard)
    shape = [curves.sizes[dim] for dim in dims]
    found, status = _solve(arrays, pieces[0], goal, outside)
    alpha, text = np.arctan(found), f"for a rate of overturning of {goal:.4g} per year"
    variables = {
        "alpha": (alpha, RADIAN, f"slenderness angle {text}"),
        "tan_alpha": (found, DIMENSIONLESS, f"tangent of the slenderness angle {text}"),
        "status": (status, DIMENSIONLESS, "ok, or why there is no slenderness"),
    }
    replicates = has_replicates(curves)
    if replicates or hazard.weights is not None:
        arrays, _ = in_hazard_measure(unit, hazard, replicates)
        count = curves.sizes["replicate"] if replicates else 1
        every = [_solve(arrays, one, goal, outside) for one in (pieces[1:] or pieces)]
        tangents = np.stack(
            [np.where(s == TOO_HIGH, np.inf, np.where(s == TOO_LOW, 0.0, t)) for t, s in every], axis=-1
        )
        weights = None if hazard.weights is None else np.tile(hazard.weights, count)
        ends = percentile_interval(np.arctan(tangents).reshape(*shape, -1), level, weights)
        for side, end in zip(("lower", "upper"), ends[:2], strict=True):
            long_name = f"{side} end of the {given_percent(level)} interval of the slenderness angle {text}"
            variables[f"alpha_{side}"] = (end, RADIAN, long_name)
    configuration = {
        "target_rate": goal,
        "hazard": hazard.describe(),
        "below": below,
        "above": above,
        "outside": outside,
        "curves": configuration_of(curves),
    }
    return xr.Dataset(
        {
            key: (dims, np.reshape(values, shape), {"units": units, "long_name": long_name})
            for key, (values, units, long_name) in variables.items()
        },
        # the numbers of the blocks that the curves are from are not those of the block sought
        coords={
            key: one for key, one in coordinates_on(curves, dims).items() if key == "block" or one.dims != ("block",)
        },
        attrs={"title": "Slenderness that meets a rate of overturning", **provenance(configuration)},
    )


def _solve(curves: CurveArrays, hazard: Pieces, goal: float, outside: str) -> tuple[Array, NDArray[np.object_]]:
    """Return the factor on all levels at which each curve has the target rate, and its status, (curve,) each."""
    curves = curves.flat()
    if isinstance(curves, LognormalCurves):
        low, high = curves.log_median, np.maximum(curves.log_median, curves.log_uplift)
    else:
        low, high = curves.log_levels[0] + curves.shift, curves.log_levels[-1] + curves.shift
    known = ~(np.isnan(low) | np.isnan(curves.probability(np.zeros((1, 1)), "least")[:, 0]))
    bottom, top = hazard.first - FAR - high, hazard.last + FAR - low

    def rates(log_factor: Array) -> Array:
        return rates_of(curves.shifted(np.where(known, log_factor, 0.0)), hazard, outside).rate

    reach = rates(bottom), rates(top)
    status = np.select([~known, reach[0] < goal, reach[1] > goal], [NO_RATE, TOO_LOW, TOO_HIGH], OK).astype(object)
    for _ in range(BISECTIONS):
        middle = 0.5 * (bottom + top)
        above = rates(middle) > goal
        bottom, top = np.where(above, middle, bottom), np.where(above, top, middle)
    return np.where(status == OK, np.exp(0.5 * (bottom + top)), np.nan), status
