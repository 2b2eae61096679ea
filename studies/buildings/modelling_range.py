"""The range of an inventory's chances and annual values if all capacities are off by one factor.

With all capacities off by a factor, what happens at a level x is what was computed at x / factor: no run is added.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ...aliases import Array
from ...fragility import HazardCurve
from ...fragility.hazard.levels import level_weights
from ...fragility.risk.modelling import capacity_factors, seen_by, values_between, with_ends
from .modelling import covering
from .variables import Variables, per_year

OF_A_YEAR = {
    "item_rate": "probability",
    "any_rate": "any_probability",
    "consequence_rate": "consequence_probability",
    "annual_number": "number_mean",
    "annual_loss": "loss_mean",
    "annual_downtime": "downtime_mean",
    "annual_injuries": "injuries_mean",
}
"""Annual values, each with the value at a level of which it is the integral over the hazard."""


def range_of_a_year(means: Mapping[Any, Any], levels: Array, hazard: HazardCurve, dispersion: float) -> Variables:
    """Return both ends of the annual values (`with_ends`), from the `means` at levels without modelling uncertainty."""
    weights = [
        level_weights(levels, covering(seen_by(hazard, factor), levels)).weights
        for factor in capacity_factors(dispersion)
    ]
    found: Variables = {}
    for name, given in OF_A_YEAR.items():
        if given in means:
            mean = means[given].transpose(..., "level")
            units = per_year(mean.attrs["units"])
            ends = [mean.values @ each for each in weights]
            found |= with_ends(name, mean.dims[:-1], ends, units, dispersion)
    return found


def range_at_levels(means: Mapping[Any, Any], run: Array, levels: Array, dispersion: float) -> Variables:
    """Return both ends of the values at levels (`with_ends`), between the levels that were `run`; NaN outside."""
    found: Variables = {}
    for name in OF_A_YEAR.values():
        if name in means:
            mean = means[name].transpose(..., "level")
            ends = [values_between(run, mean.values, levels / each) for each in capacity_factors(dispersion)]
            found |= with_ends(name, mean.dims, ends, mean.attrs["units"], dispersion)
    return found
