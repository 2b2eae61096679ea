"""Studies drawn from known truths, many at once, and how often the intervals made of them hold the truth."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import scipy
import xarray as xr

from ...core.aliases import Array
from ...core.streams import stream
from ..sequential.truths import MEDIAN, TRUTHS, Truth

ONE_CAPACITY, _, TWO_POPULATIONS, _, SKEWED_LEFT = TRUTHS
SKEWED_RIGHT = Truth("Frechet", lambda x: np.exp(-math.log(2.0) * np.exp(-3.0 * (x - math.log(MEDIAN)))))
LOGNORMAL = replace(ONE_CAPACITY, name="lognormal")
SHAPES = (LOGNORMAL, SKEWED_LEFT, SKEWED_RIGHT, TWO_POPULATIONS)
"""Shapes of curves, each to be taken with several correlations (`dataclasses.replace`)."""
LEVELS = MEDIAN * np.exp(np.linspace(-1.8, 1.8, 20))
"""Common levels of a study: 0.19 apart in ln."""
ATTRIBUTES = {"units": "m s-2", "im": "pga", "long_name": "peak ground acceleration"}


class Row(NamedTuple):
    """One kind of interval under one truth.

    low, high: shares of the studies whose interval lies below and above the truth.  length: mean length over the length
    of a normal interval with the true deviation; NaN if unknown.
    """

    interval: str
    truth: str
    motions: int
    studies: int
    low: float
    high: float
    length: float = math.nan

    @property
    def coverage(self) -> float:
        """Share of the studies whose interval holds the truth."""
        return 1.0 - self.low - self.high


def row_of(
    interval: str, truth: str, motions: int, ends: tuple[Array, Array], true: float, length: float = math.nan
) -> Row:
    """Return the row of intervals (study,); an end that is NaN misses on its side."""
    lower, upper = ends
    low, high = ~(upper >= true), ~(lower <= true)
    return Row(interval, truth, motions, lower.size, float(low.mean()), float((high & ~low).mean()), length)


def ida(truth: Truth, studies: int, motions: int, seed: int, levels: Array = LEVELS) -> xr.Dataset:
    """Draw incremental analyses: `overturned` on (study, level, motion)."""
    random = stream(seed)
    at = np.repeat(levels[:, None], studies * motions, axis=1)
    fell = truth.verdicts(at, random).reshape(levels.size, studies, motions).transpose(1, 0, 2)
    return xr.Dataset(
        {"overturned": (("study", "level", "motion"), fell)},
        coords={"level": ("level", levels, ATTRIBUTES), "motion": [f"motion {i}" for i in range(motions)]},
    )


def stripes(truth: Truth, studies: int, motions: int, seed: int, levels: Array = LEVELS[::4]) -> xr.Dataset:
    """Draw stripes of other motions at each level, `motions` a stripe: `overturned` on (study, motion)."""
    intensity = np.repeat(levels, motions)
    runs = _once(truth, np.repeat(intensity[None], studies, axis=0), seed)
    stripe = np.repeat(np.arange(1, levels.size + 1), motions)
    drawn = runs.assign_coords(intensity=("motion", intensity, ATTRIBUTES), stripe=("motion", stripe))
    return drawn.assign_coords(record=("motion", runs["motion"].values)).assign_attrs(design="stripes")


def cloud(truth: Truth, studies: int, motions: int, seed: int, spread: float = 0.6) -> xr.Dataset:
    """Draw clouds about the median: `overturned` and `intensity` on (study, motion)."""
    intensity = MEDIAN * np.exp(spread * stream(seed, 1).standard_normal((studies, motions)))
    return _once(truth, intensity, seed)


def _once(truth: Truth, intensity: Array, seed: int) -> xr.Dataset:
    fell = truth.verdicts(intensity.reshape(1, -1), stream(seed)).reshape(intensity.shape)
    return xr.Dataset(
        {"overturned": (("study", "motion"), fell)},
        coords={
            "intensity": (("study", "motion"), intensity, ATTRIBUTES),
            "motion": [f"motion {i}" for i in range(intensity.shape[1])],
        },
        attrs={"design": "cloud"},
    )


def level_of(truth: Truth, share: float) -> float:
    """Return the level at which the probability is `share`."""
    return math.exp(scipy.optimize.brentq(lambda x: float(truth.probability(np.array(x))) - share, -4.0, 5.0))
