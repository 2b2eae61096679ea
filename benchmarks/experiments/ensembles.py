"""Ensembles of simulated motions that stand for the shaking of a test whose motion is not in the package."""

from __future__ import annotations

import math
from functools import cache

import numpy as np
import xarray as xr

from ...core.aliases import Array
from ...motions import NearFault, SiteBasedScenario
from ...motions.arrays import records
from .table import BROADBAND, NEAR_FAULT, UNSPECIFIED, Experiment

NUMBER, SEED = 100, 1
"""Motions of each kind, and the seed of all of them."""
GENERATORS = {
    BROADBAND: SiteBasedScenario(magnitude=7.0, distance=20e3, vs30=400.0),
    NEAR_FAULT: NearFault(magnitude=7.0, distance=5e3, vs30=400.0, with_pulse="probability"),
}
"""The generator of each kind of motions."""
CLASSES = {"5-lower": (4.5, 5.0), "5-upper": (5.0, 5.5), "6-lower": (5.5, 6.0), "6-upper": (6.0, 6.5), "7": (6.5, 7.0)}
"""Classes of JMA's scale with the instrumental intensities between which they lie; 7 has no upper end on the
scale and ends here at 7.0, which few records reach (judgement)."""


def jma_intensity(acceleration: Array, dt: float) -> float:
    """Return JMA's instrumental intensity of one component (time,), m/s²: I = 2 log10(a0) + 0.94.

    a0 is the acceleration in gal that the filtered motion exceeds for a total of 0.3 s. The filter combines the
    period's effect, a high cut and a low cut. The agency takes the vector sum of three components; the intensity of one
    component is lower. Japan Meteorological Agency (1996). Notice on the instrumental seismic intensity (read in
    translation).
    """
    size = 2 * acceleration.size
    frequency = np.fft.rfftfreq(size, dt)
    f = np.maximum(frequency, 1e-9)
    y2 = (f / 10.0) ** 2
    high = 1.0 + y2 * (0.694 + y2 * (0.241 + y2 * (0.0557 + y2 * (0.009664 + y2 * (0.00134 + y2 * 0.000155)))))
    weight = np.sqrt(1.0 / f) / np.sqrt(high) * np.sqrt(-np.expm1(-((f / 0.5) ** 3)))
    weight[0] = 0.0
    filtered = np.sort(np.abs(np.fft.irfft(np.fft.rfft(100.0 * acceleration, size) * weight, size)))[::-1]
    return float(2.0 * np.log10(filtered[math.ceil(0.3 / dt) - 1]) + 0.94)


def kinds_of(experiment: Experiment) -> tuple[str, ...]:
    """Return the kinds of motions that stand for a test's: both, in equal shares, where it does not say."""
    return (BROADBAND, NEAR_FAULT) if experiment.motion == UNSPECIFIED else (experiment.motion,)


@cache
def motions_of(kind: str) -> xr.DataArray:
    """Return the ensemble of a kind, m/s²."""
    return GENERATORS[kind].sample(NUMBER, seed=SEED)


@cache
def _intensities(kind: str) -> Array:
    """Return JMA's intensity of every motion of a kind."""
    return np.array([jma_intensity(record.acceleration, record.dt) for record in records(motions_of(kind))])


def scaled_to_class(kind: str, low: float, high: float) -> xr.DataArray:
    """Return the ensemble of a kind scaled to JMA intensities spread evenly between two ends, motion by motion.

    The levels follow the order of the motions, which are drawn independently of one another.
    """
    motions = motions_of(kind)
    levels = low + (high - low) * (np.arange(NUMBER) + 0.5) / NUMBER
    factors = xr.DataArray(10.0 ** (0.5 * (levels - _intensities(kind))), dims="motion")
    return (motions * factors).transpose(*motions.dims).assign_attrs(motions.attrs).rename(motions.name)
