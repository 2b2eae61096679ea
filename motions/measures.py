"""Intensity measures of motions, exact for acceleration that is linear between samples.

Velocity and displacement start from zero and are not corrected: baseline correction is a step of its own.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from .. import checks
from ..units import ACCELERATION, METRE, SECOND, VELOCITY
from .arrays import Record, records

Series = NDArray[np.float64]


def velocity(acceleration: Series, dt: float) -> Series:
    """Velocity at the samples (last axis), m/s: the trapezoidal rule is exact for linear segments."""
    out = np.zeros_like(acceleration)
    np.cumsum(0.5 * dt * (acceleration[..., 1:] + acceleration[..., :-1]), axis=-1, out=out[..., 1:])
    return out


def displacement(acceleration: Series, dt: float) -> Series:
    """Displacement at the samples (last axis), m: u_(i+1) = u_i + v_i dt + (2 a_i + a_(i+1)) dt²/6."""
    v = velocity(acceleration, dt)
    out = np.zeros_like(acceleration)
    steps = dt * v[..., :-1] + dt * dt / 6.0 * (2.0 * acceleration[..., :-1] + acceleration[..., 1:])
    np.cumsum(steps, axis=-1, out=out[..., 1:])
    return out


def peak_acceleration(acceleration: Series, dt: float) -> float:
    """PGA: max |a|, m/s²."""
    return float(np.abs(acceleration).max())


def peak_velocity(acceleration: Series, dt: float) -> float:
    """PGV: max |v|, m/s, between samples too (where the acceleration passes through zero)."""
    v = velocity(acceleration, dt)
    a, b = acceleration[:-1], acceleration[1:]
    turns = np.flatnonzero(a * b < 0.0)
    # v + a t/2 at t = dt a/(a - b)
    inner = v[turns] + 0.5 * dt * a[turns] ** 2 / (a[turns] - b[turns])
    return float(max(np.abs(v).max(), np.abs(inner).max(initial=0.0)))


def peak_displacement(acceleration: Series, dt: float) -> float:
    """PGD: max |u|, m, between samples too (where the velocity passes through zero)."""
    v = velocity(acceleration, dt)
    u = displacement(acceleration, dt)
    a = acceleration[:-1]
    slope = np.diff(acceleration) / dt
    # roots in (0, dt) of v + a t + slope t²/2, in the form that does not cancel
    discriminant = a * a - 2.0 * slope * v[:-1]
    best = float(np.abs(u).max())
    i = np.flatnonzero(discriminant >= 0.0)
    root = np.sqrt(discriminant[i])
    q = -(a[i] + np.where(a[i] >= 0.0, root, -root))
    # 0/0 and x/0 mean that there is no such root: they fail the comparison below
    with np.errstate(divide="ignore", invalid="ignore"):
        candidates = (2.0 * v[:-1][i] / q, q / slope[i])
    for t in candidates:
        inside = np.isfinite(t) & (t > 0.0) & (t < dt)
        j, s = i[inside], t[inside]
        inner = u[j] + s * (v[j] + s * (a[j] / 2.0 + s * slope[j] / 6.0))
        best = max(best, float(np.abs(inner).max(initial=0.0)))
    return best


MEASURES: dict[str, tuple[Callable[[Series, float], float], str, str]] = {
    "pga": (peak_acceleration, ACCELERATION, "peak floor acceleration"),
    "pgv": (peak_velocity, VELOCITY, "peak floor velocity"),
    "pgd": (peak_displacement, METRE, "peak floor displacement"),
}
"""Measures by name: function of (acceleration, dt), unit, long name."""


def measure(name: str, motions: list[Record]) -> NDArray[np.float64]:
    """One measure of plain records, shape (motion,); ValueError for a name that is not in `MEASURES`."""
    function = MEASURES[checks.choice("intensity measure", name, tuple(MEASURES))][0]
    return np.array([function(record.acceleration, record.dt) for record in motions])


def positive_measure(name: str, motions: list[Record]) -> NDArray[np.float64]:
    """A measure to scale by, shape (motion,); ValueError where it is zero."""
    values = measure(name, motions)
    if not np.all(values > 0.0):
        label = motions[int(np.argmin(values))].label
        raise ValueError(f"motion {label!r} has {name} = 0 and cannot be scaled")
    return values


def measures(motions: xr.DataArray | Iterable[xr.DataArray]) -> xr.Dataset:
    """Every intensity measure of every motion.

    Returns
    -------
    xarray.Dataset
        pga (m s-2), pgv (m s-1) and pgd (m) on ``motion``, with dt, duration (s) and source as coordinates.  All are
        true maxima of the piecewise linear acceleration and its integrals, between samples too.

    Raises
    ------
    TypeError, ValueError
        As `toppling.motions.records`: what is no labelled acceleration, has no unique labels or is not finite.
    """
    plain = records(motions)
    return xr.Dataset(
        {
            name: ("motion", measure(name, plain), {"units": unit, "long_name": long_name})
            for name, (_, unit, long_name) in MEASURES.items()
        },
        coords=motion_coordinates(plain),
    )


def motion_coordinates(plain: list[Record]) -> dict[str, xr.Variable]:
    """Label, step, duration, source (and floor, where there is one) of plain records, as variables on ``motion``."""
    labels = np.array([record.label for record in plain], dtype=object)
    sources = np.array([record.source for record in plain], dtype=object)
    coordinates = {
        "motion": xr.Variable("motion", labels, {"units": "1", "long_name": "motion"}),
        "dt": xr.Variable("motion", [r.dt for r in plain], {"units": SECOND, "long_name": "time step"}),
        "duration": xr.Variable("motion", [r.duration for r in plain], {"units": SECOND, "long_name": "duration"}),
        "source": xr.Variable("motion", sources, {"units": "1", "long_name": "source of the motion"}),
    }
    if any(record.floor for record in plain):
        floors = np.array([record.floor for record in plain], dtype=object)
        coordinates["floor"] = xr.Variable("motion", floors, {"units": "1", "long_name": "floor"})
    return coordinates
