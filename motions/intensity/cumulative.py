"""Cumulative measures of a motion: Arias intensity, cumulative absolute velocity and significant durations.

All integrals are exact for acceleration that is linear between samples.
"""

import math

import numpy as np

from ...core.aliases import Array
from ...core.units import STANDARD_GRAVITY


def arias_intensity(acceleration: Array, dt: float) -> float:
    """Return the Arias intensity pi/(2 g) integral a² dt, m/s.

    Arias, A. (1970). A measure of earthquake intensity. In: Seismic Design for Nuclear Power Plants, MIT Press.
    """
    return 0.5 * math.pi / STANDARD_GRAVITY * float(_squares(acceleration, dt).sum())


def cumulative_absolute_velocity(acceleration: Array, dt: float) -> float:
    """Return the CAV, integral |a| dt, m/s (EPRI (1988), report NP-5930)."""
    a, b = np.abs(acceleration[:-1]), np.abs(acceleration[1:])
    both = a + b
    crosses = acceleration[:-1] * acceleration[1:] < 0.0
    # a segment with a change of sign is two triangles: (a² + b²)/(a + b) dt/2
    with np.errstate(divide="ignore", invalid="ignore"):
        heights = np.where(crosses, a * (a / both) + b * (b / both), both)
    return 0.5 * dt * float(heights.sum())


def significant_duration_5_75(acceleration: Array, dt: float) -> float:
    """Return D5-75: the time from 5 to 75 % of the Arias intensity, s; NaN for a motion of zeros."""
    return significant_duration(acceleration, dt, 0.05, 0.75)


def significant_duration_5_95(acceleration: Array, dt: float) -> float:
    """Return D5-95: the time from 5 to 95 % of the Arias intensity, s; NaN for a motion of zeros."""
    return significant_duration(acceleration, dt, 0.05, 0.95)


def significant_duration(acceleration: Array, dt: float, start: float, end: float) -> float:
    """Return the time between two fractions (0 <= start < end <= 1) of the Arias intensity, s, also between samples.

    Trifunac, M. D. and Brady, A. G. (1975). Bulletin of the Seismological Society of America 65(3), 581-626.
    """
    largest = float(np.abs(acceleration).max())
    if largest == 0.0:
        return math.nan
    # fractions do not depend on the amplitude; without this scaling the squares of a tiny motion would vanish
    a = acceleration / largest
    energy = energy_at_samples(a, dt)
    return _time_at(a, dt, energy, end * energy[-1]) - _time_at(a, dt, energy, start * energy[-1])


def husid(acceleration: Array, dt: float) -> Array:
    """Return the share of the Arias intensity at every sample (time,), 0 to 1; NaN for a motion of zeros.

    Husid, R. (1969). Características de terremotos: análisis general. Revista del IDIEM 8(1), 21-42.
    """
    largest = float(np.abs(acceleration).max())
    if largest == 0.0:
        return np.full(acceleration.shape, math.nan)
    energy = energy_at_samples(acceleration / largest, dt)
    return np.asarray(energy / energy[-1])


def energy_at_samples(acceleration: Array, dt: float) -> Array:
    """Return the integral of a² from the first sample to every sample (time,), m²/s³."""
    return np.concatenate([[0.0], np.cumsum(_squares(acceleration, dt))])


def _squares(acceleration: Array, dt: float) -> Array:
    """Return the integral of a² over each segment: (a² + a b + b²) dt/3."""
    a, b = acceleration[..., :-1], acceleration[..., 1:]
    return np.asarray((a * a + a * b + b * b) * (dt / 3.0))


def _time_at(a: Array, dt: float, energy: Array, target: float) -> float:
    """Return the time at which the integral of a² (`energy` at the samples) reaches `target`."""
    i = min(max(int(np.searchsorted(energy, target)) - 1, 0), a.size - 2)
    missing = target - energy[i]
    slope = (a[i + 1] - a[i]) / dt
    # (a + slope t)³ - a³ = 3 slope missing, solved for t in the form that does not cancel
    end = math.cbrt(a[i] ** 3 + 3.0 * slope * missing)
    below = end * end + end * a[i] + a[i] * a[i]
    return i * dt + (float(np.clip(3.0 * missing / below, 0.0, dt)) if below > 0.0 else 0.0)
