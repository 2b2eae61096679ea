"""Ensembles of simulated motions that stand for the shaking of a test whose motion is not in the package."""

from __future__ import annotations

from functools import cache

import numpy as np
import xarray as xr

from ...core.aliases import Array
from ...motions import NearFault, SiteBasedScenario
from ...motions.arrays import records
from .jma import jma_intensity
from .table import BROADBAND, NEAR_FAULT, UNSPECIFIED, Experiment

NUMBER, SEED = 100, 1
"""Motions of each kind, and the seed of all of them."""
GENERATORS = {
    BROADBAND: SiteBasedScenario(magnitude=7.0, distance=20e3, vs30=400.0),
    NEAR_FAULT: NearFault(magnitude=7.0, distance=5e3, vs30=400.0, with_pulse="probability"),
}
"""The generator of each kind of motions."""


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
    return np.array([jma_intensity(one.acceleration, one.dt) for one in records(motions_of(kind))])


def scaled_to_class(kind: str, low: float, high: float) -> xr.DataArray:
    """Return the ensemble of a kind scaled to JMA intensities spread evenly between two ends, motion by motion.

    The levels follow the order of the motions, which are drawn independently of one another.
    """
    motions = motions_of(kind)
    levels = low + (high - low) * (np.arange(NUMBER) + 0.5) / NUMBER
    factors = xr.DataArray(10.0 ** (0.5 * (levels - _intensities(kind))), dims="motion")
    return (motions * factors).transpose(*motions.dims).assign_attrs(motions.attrs).rename(motions.name)
