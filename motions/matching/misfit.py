"""Misfit of motions to a target spectrum, and the change of their velocity and displacement."""

import math
from collections.abc import Iterable

import numpy as np
import xarray as xr

from ...core import checks
from ...core.aliases import Array
from ...core.units import ACCELERATION, DIMENSIONLESS, METRE, SECOND, VELOCITY, described, provenance, variables
from ..arrays import listed, motion_coordinates, records
from ..intensity.peaks import displacement, peak_displacement, peak_velocity, velocity
from ..intensity.spectra import peak_displacements
from .target_spectra import TargetSpectrum


def matching_report(motions: xr.DataArray | Iterable[xr.DataArray], target: TargetSpectrum) -> xr.Dataset:
    """Return the misfit of motions to a target at each period, and the change of their velocity and displacement.

    Parameters
    ----------
    motions : xarray.DataArray or a sequence of them
        Labelled motions of any origin, m s-2.
    target : TargetSpectrum

    Returns
    -------
    xarray.Dataset
        On (motion, period): ``misfit``, Sa over the target less 1, at eight periods per octave, exact between samples.
        On motion: ``misfit_mean`` and ``misfit_max`` of its absolute value; ``pgv`` (m s-1), ``pgd`` (m),
        ``end_velocity``, ``end_displacement``. ``pgv_ratio`` and ``pgd_ratio`` are PGV and PGD over the references of
        motions from `match` and `SpectrumCompatible`, NaN for motions without references.

    Examples
    --------
    >>> from toppling import motions
    >>> target = motions.TargetSpectrum((0.1, 1.0), (1.0, 1.0))
    >>> list(matching_report(motions.HalfSine(2.0, 10.0).sample(1), target).misfit.dims)
    ['motion', 'period']
    """
    if not isinstance(target, TargetSpectrum):
        raise TypeError(f"target must be a TargetSpectrum, got {checks.kind(target)}")
    arrays = listed(motions)
    plain = records(arrays)
    axis = target.grid()
    omega = 2.0 * math.pi / axis
    spectra = [omega**2 * peak_displacements(record.acceleration, record.dt, axis, target.damping) for record in plain]
    misfit = np.array(spectra) / target.at(axis) - 1.0
    pgv = np.array([peak_velocity(record.acceleration, record.dt) for record in plain])
    pgd = np.array([peak_displacement(record.acceleration, record.dt) for record in plain])
    # the records of an array are its motions, each with all its floors
    references = {name: np.concatenate([_reference(array, name) for array in arrays]) for name in ("pgv", "pgd")}
    ends = np.array([[of(record.acceleration, record.dt)[-1] for of in (velocity, displacement)] for record in plain])
    on_motion: dict[str, tuple[Array, str, str]] = {
        "misfit_mean": (np.abs(misfit).mean(axis=1), DIMENSIONLESS, "mean misfit over periods"),
        "misfit_max": (np.abs(misfit).max(axis=1), DIMENSIONLESS, "greatest misfit over periods"),
        "pgv": (pgv, VELOCITY, "peak velocity"),
        "pgd": (pgd, METRE, "peak displacement"),
        "pgv_ratio": (pgv / references["pgv"], DIMENSIONLESS, "peak velocity over its reference"),
        "pgd_ratio": (pgd / references["pgd"], DIMENSIONLESS, "peak displacement over its reference"),
        "end_velocity": (ends[:, 0], VELOCITY, "velocity at the end"),
        "end_displacement": (ends[:, 1], METRE, "displacement at the end"),
    }
    text = described("pseudo-acceleration over the target, less 1")
    period = xr.Variable("period", axis, described("period of the oscillator", SECOND))
    aim = xr.Variable("period", target.at(axis), described("target pseudo-acceleration", ACCELERATION))
    return xr.Dataset(
        {**variables("motion", on_motion), "misfit": (("motion", "period"), misfit, text)},
        coords={**motion_coordinates(plain), "period": period, "target": aim},
        attrs={
            "title": "Misfit of a target spectrum",
            **provenance({"target": repr(target)}),
            "target": target.name,
            "damping": target.damping,
        },
    )


def _reference(array: xr.DataArray, name: str) -> Array:
    count = array.sizes.get("motion", 1)
    key = f"{name}_reference"
    values = np.ravel(array[key].values) if key in array.coords else np.full(count, math.nan)
    return np.repeat(values, array.sizes.get("floor", 1))
