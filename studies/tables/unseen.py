"""Bounds of what no motion showed: how often it may happen all the same, as tables write it."""

from __future__ import annotations

import numpy as np
import xarray as xr

from ...core.wording import about_percent
from ...fragility.hazard.rates import probability_in
from ...fragility.numerics.proportions import wilson_interval
from ...fragility.runs.provenance import number_of_motions
from ..buildings.recommendations import YEARS


def most_probability(results: xr.Dataset) -> float:
    """Return the largest probability of what no motion showed: the upper end of Wilson's interval for 0 of n."""
    trials = np.array([number_of_motions(results)])
    return float(wilson_interval(np.zeros(1, np.int64), trials, float(results.attrs["confidence"]))[1][0])


def most_rate(results: xr.Dataset) -> float:
    """Return the largest unseen annual rate: rates of levels times `most_probability`, and all above the last."""
    probability = most_probability(results)
    above = float(results["level_weight_above"])
    return probability * (float(results["level_weight"].sum()) - above) + above


def bound_of(results: xr.Dataset, years: float = YEARS) -> float:
    """Return the largest chance of what none of the motions showed, in so many years or at the study's level."""
    if "level_weight" in results:
        return float(probability_in(np.float64(most_rate(results)), years))
    return most_probability(results)


def at_most(results: xr.Dataset, years: float = YEARS) -> str:
    """Return the bound of the chance of what none of the motions showed, in words."""
    return f"at most {about_percent(bound_of(results, years))}"
