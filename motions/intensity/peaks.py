"""Velocity and displacement of a motion, and peaks of acceleration, velocity and displacement.

All are exact for acceleration that is linear between samples.  Velocity and displacement start from zero and are not
corrected: baseline correction is a separate step.
"""

import numpy as np

from ...core.aliases import Array
from ..kernels import peaks as _peaks


def velocity(acceleration: Array, dt: float) -> Array:
    """Return the velocity at the samples (last axis), m/s: the trapezoidal rule is exact for linear segments."""
    out = np.zeros_like(acceleration)
    np.cumsum(0.5 * dt * (acceleration[..., 1:] + acceleration[..., :-1]), axis=-1, out=out[..., 1:])
    return out


def displacement(acceleration: Array, dt: float) -> Array:
    """Return the displacement at the samples (last axis), m: u_(i+1) = u_i + v_i dt + (2 a_i + a_(i+1)) dt²/6."""
    v = velocity(acceleration, dt)
    out = np.zeros_like(acceleration)
    steps = dt * v[..., :-1] + dt * dt / 6.0 * (2.0 * acceleration[..., :-1] + acceleration[..., 1:])
    np.cumsum(steps, axis=-1, out=out[..., 1:])
    return out


def peak_acceleration(acceleration: Array, dt: float) -> float:
    """Return the PGA: max |a|, m/s²."""
    return float(np.abs(acceleration).max())


def peak_velocity(acceleration: Array, dt: float) -> float:
    """Return the PGV: max |v|, m/s, also between samples (where the acceleration passes through zero)."""
    return float(_peaks.peak_velocity(acceleration, dt))


def peak_displacement(acceleration: Array, dt: float) -> float:
    """Return the PGD: max |u|, m, also between samples (where the velocity passes through zero)."""
    return float(_peaks.peak_displacement(acceleration, dt))


def half_cycle_peaks(acceleration: Array) -> Array:
    """Return the maximum |a| of each half-cycle (between changes of sign), in order, m/s²; zeros end no half-cycle."""
    moving = acceleration[acceleration != 0.0]
    if moving.size == 0:
        return np.zeros(0)
    starts = np.flatnonzero(np.diff(np.signbit(moving))) + 1
    return np.maximum.reduceat(np.abs(moving), np.concatenate([[0], starts]))
