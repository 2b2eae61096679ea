"""How well the selected motions of stripes agree with the hazard, as variables of a study's results and in words."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import xarray as xr

from ...core.units import DIMENSIONLESS
from ...core.wording import counted
from ...motions.intensity.dataset import measure_named
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
    """Return the reports of all stripes as variables on the stripes and measures; motions: those of each stripe."""
    levels = [one.attrs["level"] for one in reports]
    joined = xr.concat([one.drop_vars("unit") for one in reports], "stripe", join="outer", combine_attrs="override")
    names = [str(one) for one in joined["measure"].values]
    found: dict[str, xr.Variable] = {}
    for name in _BY_MEASURE:
        given = joined[name]
        values = given.values if given.dtype == bool else given.values.astype(float)
        units = SI if name in ("target_median", "median") else DIMENSIONLESS
        found[PREFIX + name] = xr.Variable((STRIPE, MEASURE), values, {**given.attrs, "units": units})
    for name, text in _BY_STRIPE.items():
        values = np.array([float(one.attrs[name]) for one in reports])
        found[PREFIX + name] = xr.Variable(STRIPE, values, {"units": DIMENSIONLESS, "long_name": text})
    consistent = found[PREFIX + "consistent"]
    found[PREFIX + "consistent"] = consistent.copy(data=consistent.values > 0.0)
    shared = {"units": DIMENSIONLESS, "long_name": "share of the set that is in the set of the level below"}
    found[PREFIX + "shared"] = xr.Variable(STRIPE, _shared(motions), shared)
    about = {"units": SI, "long_name": reports[0].attrs["given"]}
    return xr.Dataset(
        found,
        coords={
            STRIPE: (STRIPE, levels, about),
            MEASURE: (MEASURE, names, {"units": DIMENSIONLESS, "long_name": "measure of the motions"}),
            "selected_unit": (
                MEASURE,
                [measure_named(name).units for name in names],
                {"units": DIMENSIONLESS, "long_name": "SI unit of the measure"},
            ),
        },
    )


def _shared(motions: Sequence[Sequence[xr.DataArray]]) -> list[float]:
    names = [{str(name) for one in own for name in one["motion"].values} for own in motions]
    return [float("nan"), *(len(low & high) / len(high) for low, high in pairwise(names))]


UNSELECTED = (
    "motions of the stripes are as they are given: whether they agree with the hazard at their levels is not checked "
    "([stripes.select] chooses those that do)"
)
"""What is to be said of stripes whose motions are not selected."""


def selection_notes(found: xr.Dataset) -> list[str]:
    """Return what is to be said of a study's selections: how well they agree, and what was not asked to."""
    given = found[STRIPE].attrs["long_name"]
    n = found.sizes[STRIPE]
    good = int(found[PREFIX + "consistent"].sum())
    said = [
        f"motions of {counted(n, 'stripe')} are selected to agree with the hazard given {given}: medians within 10 % "
        f"and scatter within 0.8 to 1.25 of the target's in {good} of {n}"
    ]
    bias = found[PREFIX + "bias"]
    free = [name for name in ALWAYS if bool(np.isnan(bias.sel({MEASURE: name})).all()) and name != given]
    if free:
        names = " and ".join({"pgv": "PGV", "d5_95": "duration"}[name] for name in free)
        said.append(
            f"the target says nothing of {names}: blocks overturn by velocity and duration, which the selected motions "
            "may have more or less of than the hazard does"
        )
    share = float(found[PREFIX + "shared"].max()) if n > 1 else 0.0
    if share > 0.0:
        said.append(
            f"neighbouring stripes share up to {100.0 * share:.0f} % of their motions; intervals count a motion once"
        )
    bounded = int(found[PREFIX + "factors_at_a_bound"].sum())
    if bounded:
        verb = "is" if bounded == 1 else "are"
        said.append(f"{counted(bounded, 'motion')} of the stripes {verb} scaled by a factor at its bound")
    return said
