"""Conversion of curves to the measure of a hazard curve, with checks of names, units, block measures and floors."""

from types import SimpleNamespace

import numpy as np
import xarray as xr

from ...core import checks
from ...core.elementary import log
from ...motions.intensity.naming import FLOOR, measure_named
from ..curves.curve import CurveArrays, LinkedCurves, TabulatedCurves, curve_arrays, im_of
from ..hazard.curve import HazardCurve
from ..numerics.slabs import spread
from ..runs.provenance import levels_of_the_ground, upper_floors
from ..runs.scaling import BLOCK_MEASURES


def in_hazard_measure(
    curves: xr.Dataset, hazard: HazardCurve, replicates: bool = False
) -> tuple[CurveArrays, tuple[str, ...]]:
    """Return the curves (or their replicates) with levels in the hazard curve's measure, and their dimensions."""
    if not isinstance(hazard, HazardCurve):
        raise TypeError(f"hazard must be a HazardCurve, got {checks.kind(hazard)}")
    arrays, dims = curve_arrays(curves, replicates)
    if isinstance(arrays, LinkedCurves):
        raise ValueError(
            f"rates are exact for lognormal, uplift-lognormal and tabulated curves only, got {arrays.link!r}: give "
            "curve_probability's values as probability on level"
        )
    check_floor(curves, hazard)
    name = im_of(curves)
    if not name:
        raise ValueError("curves must say which measure their levels are of, in the attribute im; got none")
    held = "level" if isinstance(arrays, TabulatedCurves) else "median"
    units = str(curves[held].attrs.get("units", "not stated"))
    if name not in BLOCK_MEASURES:
        if measure_named(name, "im of the curves", (*BLOCK_MEASURES,)).label != hazard.im:
            raise ValueError(
                f"curves are of {name!r} and the hazard curve is of {hazard.im!r}: they must be of one measure"
            )
        if units != hazard.units:
            raise ValueError(f"levels of the curves are in {units!r} and of the hazard curve in {hazard.units!r}")
        return arrays, dims
    block_measure = BLOCK_MEASURES[name]
    if block_measure.measure.label != hazard.im:
        raise ValueError(
            f"curves are of {name!r}, which needs a hazard curve of {block_measure.measure.label!r}, got {hazard.im!r}"
        )
    factors = spread(per_block(curves, name), dict(zip(dims, arrays.shape, strict=True)))
    return arrays.shifted(-log(factors)), dims


def per_block(curves: xr.Dataset, im: str) -> xr.DataArray:
    """Return the factor from a measure of the motion to a block measure, from the coordinates alpha and p."""
    shape = {}
    for name in ("alpha", "p"):
        array = curves.coords.get(name, xr.DataArray(np.nan))
        if not set(array.dims) <= {"block"}:
            raise ValueError(f"{name} of the blocks must lie on block, got dims {array.dims}")
        shape[name] = array
    alpha, p = xr.broadcast(shape["alpha"], shape["p"])
    values = [
        BLOCK_MEASURES[im].per_block(SimpleNamespace(alpha=float(angle), p=float(frequency)))
        for angle, frequency in zip(alpha.values.flat, p.values.flat, strict=True)
    ]
    if not np.all(np.isfinite(values) & (np.array(values) > 0.0)):
        raise ValueError(f"curves of {im!r} must have the coordinates alpha and p of their blocks, finite and > 0")
    return xr.DataArray(np.reshape(values, alpha.shape), dims=alpha.dims)


def check_floor(curves: xr.Dataset, hazard: HazardCurve) -> None:
    """Raise ValueError if the levels of the curves are of another floor's motion than the hazard."""
    floors = [str(floor) for floor in np.atleast_1d(curves["floor"].values)] if "floor" in curves.coords else []
    if hazard.at == FLOOR:
        if levels_of_the_ground(curves):
            raise ValueError("levels of the curves are of the ground's motion, the hazard curve is of a floor's")
        if len(floors) > 1:
            raise ValueError(
                f"a hazard curve of one floor belongs to one floor's curves, got floors {', '.join(floors)}"
            )
    elif upper := upper_floors(curves):
        raise ValueError(
            f"levels of the curves are of the motions of {', '.join(upper)}, the hazard curve is of the ground's: give "
            "the runs their ground motions (ground), or the floor's own hazard (at='floor')"
        )
