"""Velocity and displacement of a motion and the peaks of all three, exact for acceleration linear between samples.

Velocity and displacement start from zero and are not corrected: baseline correction is a step of its own.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

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
