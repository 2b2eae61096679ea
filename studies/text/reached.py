"""Levels from runs: infinite above the highest run level, 0 below the lowest, with medians, ratios and advice."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr

from ...core.units import UNITS
from ...fragility.fitting.states import OK
from .words import axis_of

EVERY = 0.0, math.inf


def other_levels(study: Mapping[str, Any], higher: bool, run: tuple[float, float] = EVERY) -> str:
    """Return the change of a study file (plain values) for higher levels, or for lower levels.

    `run` is the lowest and the highest level of the runs (SI): selected stripes beyond them were left out.
    """
    name = next((name for name in ("ida", "performance") if "levels" in study.get(name, {})), "")
    if name:
        levels = study[name]["levels"]
        if isinstance(levels, str):  # (adaptive levels look as far as they must)
            return "allow more motions (until.motions.most)"
        if levels.get("values") is not None:
            return f"add {'higher' if higher else 'lower'} levels to {name}.levels.values"
        return f"raise {name}.levels.to" if higher else f"lower {name}.levels.from"
    if "stripes" in study:
        stripes = study["stripes"]
        if "select" in stripes:
            lowest, highest = (stripes["at"][end]["level"] * UNITS[stripes["unit"]][0] for end in (0, -1))
            if highest > run[1] * EDGE if higher else lowest < run[0] / EDGE:
                return "select the stripes that were left out from more motions, or with a wider stripes.select.factor"
        return f"add a stripe {'above the highest' if higher else 'below the lowest'}"
    return f"take {'stronger' if higher else 'weaker'} motions"


BELOW = "below all levels"
"""Instead of a level below the lowest level of the runs."""
NO_LEVEL = {OK: "too few runs fell or stood near it"}  # why no level of half has been found, by status
FLAT = 10.0
"""Dispersion beyond which a curve is flat: one standard deviation is a factor of 22,000 in the level."""
EDGE = 1.0 + 1e-9
"""A median this many times the highest level still counts as reached: it differs from it by rounding alone."""


def levels_run(results: xr.Dataset) -> tuple[float, float]:
    """Return the lowest and the highest level of the runs (SI); 0 and infinite if there are no levels (published)."""
    if "level" not in results.coords and "intensity" not in results.coords:
        return 0.0, np.inf
    return float(axis_of(results).min()), float(axis_of(results).max())


def highest_level(results: xr.Dataset) -> float:
    """Return the highest level of the runs (SI), as `levels_run`."""
    return levels_run(results)[1]


def open_ends(low: float, high: float, results: xr.Dataset) -> tuple[float, float]:
    """Return the ends of an interval of a fitted level, infinite if they lie beyond all levels of the runs."""
    least, most = levels_run(results)
    return -np.inf if low < least / EDGE else low, np.inf if high > EDGE * most else high


def within_levels(results: xr.Dataset) -> xr.Dataset:
    """Return results with medians above the highest run level infinite; ratios of them are infinite or NaN."""
    most = highest_level(results)
    if not np.isfinite(most):
        return results
    reached = {}
    if "sample_median" in results:
        medians = results["sample_median"]
        reached["sample_median"] = medians.where(~(medians > EDGE * most), np.inf)
    if "median_ratio" in results:
        reached |= _ratios(results, results["median"] > EDGE * most, most)
    # (dimensions may change their order where two arrays meet)
    return results.assign(
        {
            name: values.transpose(*results[name].dims).assign_attrs(results[name].attrs)
            for name, values in reached.items()
        }
    )


def _ratios(results: xr.Dataset, far: xr.DataArray, most: float) -> dict[str, xr.DataArray]:
    """Return the ratios of medians of a sensitivity study: infinite if not reached, NaN if not known."""
    ratio = results["median_ratio"]
    with np.errstate(divide="ignore", invalid="ignore"):
        unknown = results["median"] / ratio > EDGE * most
    ratios = ratio.where(~far | ratio.isnull(), np.inf).where(~unknown)
    ends = {
        f"median_ratio_{end}": results[f"median_ratio_{end}"].where(~far & ~unknown)
        for end in ("lower", "upper")
        if f"median_ratio_{end}" in results
    }
    return {"median_ratio": ratios, **ends}
