"""Fit of a site-based motion to one record, from its energy over time, zero crossings and small extremes."""

from __future__ import annotations

import math

import numpy as np
import scipy
import xarray as xr

from ...core.aliases import Array, Flags
from ...core.units import STANDARD_GRAVITY
from ..arrays import records
from ..intensity.cumulative import energy_at_samples
from .modulation import ratio_limits
from .scenario import Parameters

LEAST_ZETA, MOST_ZETA = 0.005, 0.99
COUNTED = (0.01, 0.99)  # fractions of the energy between which crossings and extremes are counted
LEAST_CROSSINGS = 10
PASSES = 6  # alternating passes of frequency and damping ratio, which changes the frequency by a few per cent at most


def fit_site_based(motion: xr.DataArray) -> tuple[dict[str, float], float]:
    """Return the parameters of one record by name (SI), and its time step (s); see `SiteBased.fit`."""
    plain = records(motion)
    if len(plain) != 1:
        raise ValueError(f"motion must hold exactly one motion to be fitted, got {len(plain)}")
    record = plain[0]
    a, dt = record.acceleration, record.dt
    energy = energy_at_samples(a, dt)
    if not energy[-1] > 0.0:
        raise ValueError(f"motion {record.label!r} must shake to be fitted, got zeros only")
    arias = math.pi / (2.0 * STANDARD_GRAVITY) * energy[-1]
    time = np.arange(a.size, dtype=np.float64) * dt
    first, t05, t45, t95, last = np.interp([COUNTED[0], 0.05, 0.45, 0.95, COUNTED[1]], energy / energy[-1], time)
    low, high = ratio_limits(0.45)
    if not low <= (t95 - t05) / t45 <= high:
        raise ValueError(
            f"motion {record.label!r} must have D5-95/t_mid of {low:.3g} to {high:.3g} for a gamma "
            f"modulating function, got {t95 - t05:.3g}/{t45:.3g} s: "
            + ("cut off some of its quiet start" if (t95 - t05) / t45 < low else "put quiet before it")
        )
    omega, slope, zeta = _spectral(a, dt, time, t45, (time >= first) & (time <= last))
    found = (arias, t95 - t05, t45, omega, slope, zeta)
    return dict(zip(Parameters._fields, map(float, found), strict=True)), dt


def _spectral(a: Array, dt: float, time: Array, t_mid: float, counted: Flags) -> tuple[float, float, float]:
    """Return the frequency at `t_mid` (rad/s), its slope (rad/s²) and the damping ratio."""
    ups = np.zeros(a.size)
    ups[1:] = (a[:-1] < 0.0) & (a[1:] >= 0.0)
    crossings = np.cumsum(ups)
    x = time[counted] - t_mid
    if ups[counted].sum() < LEAST_CROSSINGS:
        raise ValueError(f"motion must cross zero upwards {LEAST_CROSSINGS} times to be fitted, got fewer")
    # N(t) = N_0 + [omega_mid x + slope x²/2]/(2 pi)
    basis = np.stack([np.ones_like(x), x, 0.5 * x * x], axis=1)
    _, apparent, apparent_slope = 2.0 * math.pi * np.linalg.lstsq(basis, crossings[counted], rcond=None)[0]
    rises, falls = a[1:-1] - a[:-2], a[1:-1] - a[2:]
    extremes = ((rises < 0.0) & (falls < 0.0) & (a[1:-1] > 0.0)) | ((rises > 0.0) & (falls > 0.0) & (a[1:-1] < 0.0))
    observed = int(extremes[counted[1:-1]].sum())
    seen = np.maximum(apparent + apparent_slope * x, 1e-3 * abs(apparent))
    zeta, ratio = 0.3, 1.0
    for _ in range(PASSES):
        omega = np.minimum(seen / ratio, 0.5 * math.pi / dt)

        def excess(value: float, omega: Array = omega) -> float:
            return float(small_extremes(omega, value, dt).sum()) - observed

        if excess(LEAST_ZETA) >= 0.0:
            zeta = LEAST_ZETA
        elif excess(MOST_ZETA) <= 0.0:
            zeta = MOST_ZETA
        else:
            zeta = float(scipy.optimize.brentq(excess, LEAST_ZETA, MOST_ZETA, xtol=1e-6))
        middle = np.array([min(apparent / ratio, 0.5 * math.pi / dt)])
        ratio = float(crossing_frequency(middle, zeta, dt)[0] / middle[0])
    return apparent / ratio, apparent_slope / ratio, zeta


def _correlations(omega: Array, zeta: float, dt: float) -> tuple[Array, Array]:
    """Return the exact autocorrelations, at one and two steps, of noise pulses on samples through the oscillator.

    h_j = Im z^j with z = exp[(-zeta + i sqrt(1 - zeta²)) omega dt]: sum_j h_j h_(j+m) is a sum of two geometric series.
    """
    z = np.exp((-zeta + 1j * math.sqrt(1.0 - zeta * zeta)) * omega * dt)
    c = [(z**m / (1.0 - np.abs(z) ** 2) - z**m / (1.0 - z * z)).real for m in range(3)]
    return np.asarray(c[1] / c[0]), np.asarray(c[2] / c[0])


def crossing_frequency(omega: Array, zeta: float, dt: float) -> Array:
    """Return 2 pi times the rate of up-crossings of the sampled noise, arccos(rho_1)/dt, rad/s (omega as dt -> 0)."""
    return np.asarray(np.arccos(_correlations(omega, zeta, dt)[0]) / dt)


def small_extremes(omega: Array, zeta: float, dt: float) -> Array:
    """Return the probability that a sample is a positive minimum or a negative maximum.

    It follows from the orthant probability of (x_(k-1) - x_k, x_(k+1) - x_k, x_k): 1/8 + sum of arcsines of the
    correlations/(4 pi).
    """
    one, two = _correlations(omega, zeta, dt)
    with_level = -np.sqrt(0.5 * (1.0 - one))
    between = (1.0 - 2.0 * one + two) / (2.0 * (1.0 - one))
    p = 0.125 + (np.arcsin(np.clip(between, -1.0, 1.0)) + 2.0 * np.arcsin(with_level)) / (4.0 * math.pi)
    return np.asarray(2.0 * np.maximum(p, 0.0))
