"""Agreement of the selected motions of stripes with the hazard, as variables of a study's results and in words."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import xarray as xr

from ...core.facts import Fact
from ...core.units import DIMENSIONLESS, described
from ...motions.intensity.naming import measure_named
from ...motions.selection.select import ALWAYS

PREFIX = "selection_"
SI = "SI"
"""Unit of medians: the SI unit of each measure, which the coordinate `selected_unit` names."""
STRIPE, MEASURE = "selected_level", "selected_measure"
"""Dimensions of these variables: the levels of the stripes, and the measures of target and report."""
_BY_MEASURE = ("target_median", "median", "target_sigma", "sigma", "bias", "sigma_ratio", "ks", "passes")
_BY_STRIPE = {
    "consistent": "whether the motions agree with the hazard",
    "epsilon": "standard deviations by which the level lies above the median",
    "ks_critical": "Kolmogorov-Smirnov distance that one of twenty such sets exceeds",
    "correlation_change": "greatest repair of a correlation",
    "candidates": "candidates",
    "allowed": "candidates within the factors",
    "events": "earthquakes in the set",
    "greatest_share_of_an_event": "greatest share of an earthquake in the set",
    "factor_median": "median factor",
    "factor_least": "least factor",
    "factor_greatest": "greatest factor",
    "factors_at_a_bound": "factors at a bound",
}


def selection_variables(reports: Sequence[xr.Dataset], motions: Sequence[Sequence[xr.DataArray]]) -> xr.Dataset:
    """Return the reports of all stripes as variables on the stripes and measures; `motions`: of each stripe."""
    levels = [report.attrs["level"] for report in reports]
    joined = xr.concat(
        [report.drop_vars("unit") for report in reports], "stripe", join="outer", combine_attrs="override"
    )
    names = [str(value) for value in joined["measure"].values]
    variables: dict[str, xr.Variable] = {}
    for name in _BY_MEASURE:
        given = joined[name]
        values = given.values if given.dtype == bool else given.values.astype(float)
        units = SI if name in ("target_median", "median") else DIMENSIONLESS
        variables[PREFIX + name] = xr.Variable((STRIPE, MEASURE), values, {**given.attrs, "units": units})
    for name, text in _BY_STRIPE.items():
        values = np.array([float(report.attrs[name]) for report in reports])
        variables[PREFIX + name] = xr.Variable(STRIPE, values, described(text))
    consistent = variables[PREFIX + "consistent"]
    variables[PREFIX + "consistent"] = consistent.copy(data=consistent.values > 0.0)
    shared = described("share of the set that is in the set of the level below")
    sets = [{str(name) for array in stripe for name in array["motion"].values} for stripe in motions]
    of_sets = [float("nan"), *(len(low & high) / len(high) for low, high in pairwise(sets))]
    variables[PREFIX + "shared"] = xr.Variable(STRIPE, of_sets, shared)
    about = described(reports[0].attrs["given"], SI)
    return xr.Dataset(
        variables,
        coords={
            STRIPE: (STRIPE, levels, about),
            MEASURE: (MEASURE, names, described("measure of the motions")),
            "selected_unit": (
                MEASURE,
                [measure_named(name).units for name in names],
                described("SI unit of the measure"),
            ),
        },
    )


def selection_notes(selections: xr.Dataset) -> list[Fact]:
    """Return notes on a study's selections: their agreement, and properties that were not required."""
    given = str(selections[STRIPE].attrs["long_name"])
    n = selections.sizes[STRIPE]
    facts = [
        Fact("selection.agreement", int(selections[PREFIX + "consistent"].sum()), names=(given,), more={"stripes": n})
    ]
    bias = selections[PREFIX + "bias"]
    free = [name for name in ALWAYS if bool(np.isnan(bias.sel({MEASURE: name})).all()) and name != given]
    if free:
        facts.append(Fact("selection.target_silent", names=tuple(free)))
    share = float(selections[PREFIX + "shared"].max()) if n > 1 else 0.0
    if share > 0.0:
        facts.append(Fact("selection.shared_motions", share))
    bounded = int(selections[PREFIX + "factors_at_a_bound"].sum())
    if bounded:
        facts.append(Fact("selection.factors_bounded", bounded))
    return facts
