"""Parabolic baseline correction, and scaling of motions to an intensity measure."""

import numpy as np
import xarray as xr

from ..core import checks
from ..core.aliases import Array
from ..core.doubts import warn
from ..core.parameters import STEP, USUAL_MEASURE
from .arrays import records
from .intensity.evaluation import positive_measure
from .intensity.measure import Measure
from .intensity.naming import measure_named
from .intensity.peaks import velocity
from .intensity.spectra import measure_doubts


def parabolic_baseline(acceleration: Array, dt: float) -> Array:
    """Subtract the parabola c0 + c1 t + c2 t² that minimises the mean square velocity.

    Berg, G. V. and Housner, G. W. (1961). Integrated velocity and displacement of strong earthquake ground motion.
    Bulletin of the Seismological Society of America 51(2), 175-189.
    """
    values = checks.finite_array("acceleration", acceleration, ndim=(1, 2), unit="m/s²")
    step = STEP.number("dt", dt)
    if values.shape[-1] < 5:
        raise ValueError(f"acceleration must have at least 5 samples for a parabola, got {values.shape[-1]}")
    x = np.linspace(0.0, 1.0, values.shape[-1])
    shapes: list[Array] = []
    # The parabola's velocities are made orthonormal by Gram and Schmidt. Plain sums along time give bit-identical
    # results for one motion and for a thousand, whereas a least-squares call does not.
    for k in range(3):
        shape = x**k
        for earlier in shapes:
            shape = shape - np.sum(velocity(shape, step) * velocity(earlier, step)) * earlier
        shapes.append(shape / np.sqrt(np.sum(velocity(shape, step) ** 2)))
    drift = velocity(values, step)
    for shape in shapes:
        values -= np.sum(drift * velocity(shape, step), axis=-1, keepdims=True) * shape
    return values


def scale_to(motions: xr.DataArray, target: float, im: str | Measure = USUAL_MEASURE) -> xr.DataArray:
    """Scale every motion by its own factor, so that its intensity measure is `target` (SI, > 0).

    `im` is a measure or its name (`measure_named`); ValueError if it is 0 or does not grow with the motion.

    Examples
    --------
    >>> from toppling import motions
    >>> record = motions.from_array([0.0, 1.0, -0.5, 0.0], dt=0.01)
    >>> float(abs(scale_to(record, 3.0)).max())
    3.0
    """
    ratios = checks.number("target", target, above=0.0) / _values(motions, im)
    factors = xr.DataArray(measure_named(im).factors(ratios), dims="motion")
    return (motions * factors).transpose(*motions.dims).assign_attrs(motions.attrs).rename(motions.name)


def scale_to_mean(motions: xr.DataArray, target: float, im: str | Measure = USUAL_MEASURE) -> xr.DataArray:
    """Scale all motions by one common factor, so that the mean of their intensity measure is `target` (SI, > 0)."""
    ratio = checks.number("target", target, above=0.0) / float(_values(motions, im).mean())
    factor = float(measure_named(im).factors(np.array(ratio)))
    return (motions * factor).assign_attrs(motions.attrs).rename(motions.name)


def _values(motions: xr.DataArray, im: str | Measure) -> Array:
    plain = records(motions)
    if set(motions.dims) - {"component"} != {"motion", "time"}:
        raise ValueError(f"motions to be scaled must have dims (motion, time), got {motions.dims}")
    fixed = next((record.label for record in plain if record.own_level), None)
    if fixed is not None:
        raise ValueError(f"motion {fixed!r} belongs to the level of its ground motion: scale that one")
    measure = measure_named(im)
    warn(measure_doubts(measure.label, measure))
    return positive_measure(measure, plain)
