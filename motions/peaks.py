"""Velocity and displacement of a motion and the peaks of all three, exact for acceleration linear between samples.

Velocity and displacement start from zero and are not corrected: baseline correction is a step of its own.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from . import _peaks

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
    return float(_peaks.peak_velocity(acceleration, dt))


def peak_displacement(acceleration: Series, dt: float) -> float:
    """PGD: max |u|, m, between samples too (where the velocity passes through zero)."""
    return float(_peaks.peak_displacement(acceleration, dt))


def half_cycle_peaks(acceleration: Series) -> Series:
    """The greatest |a| of each half-cycle (between changes of sign), in order, m/s²; zeros end no half-cycle."""
    moving = acceleration[acceleration != 0.0]
    if moving.size == 0:
        return np.zeros(0)
    starts = np.flatnonzero(np.diff(np.signbit(moving))) + 1
    return np.maximum.reduceat(np.abs(moving), np.concatenate([[0], starts]))
