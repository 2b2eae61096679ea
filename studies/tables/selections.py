"""How well the selected motions of stripes agree with the hazard, as a table."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import xarray as xr

from ...motions.intensity.naming import GROUND
from ..plan.selections import MEASURE, PREFIX, STRIPE
from ..text.rows import Rows
from ..text.words import display_unit, measure_at, measure_name


def selection_rows(results: xr.Dataset) -> Rows | None:
    """Return the agreement of each stripe's motions with the hazard, a row a stripe; None where none were selected."""
    if f"{PREFIX}bias" not in results:
        return None
    given = str(results[STRIPE].attrs["long_name"])
    scale, unit = display_unit(
        results[STRIPE].copy(data=results[STRIPE].values).assign_attrs(units=_unit_of(results, given))
    )
    headings = (
        f"{measure_at(given, GROUND)}{f', {unit}' if unit else ''}",
        "ε",
        "median most off",
        "scatter most off",
        "PGV",
        "factors",
        "agrees",
    )
    rows = []
    for i, level in enumerate(results[STRIPE].values):
        one = results.isel({STRIPE: i})
        bias, ratio = one[f"{PREFIX}bias"], one[f"{PREFIX}sigma_ratio"]
        epsilon = float(one[f"{PREFIX}epsilon"])
        found = one[f"{PREFIX}bias"].sel({MEASURE: "pgv"})
        rows.append(
            (
                f"{level / scale:.3g}",
                "–" if math.isnan(epsilon) else f"{epsilon:.1f}".replace("-", "−"),
                _furthest(bias, abs(bias), _percent),
                _furthest(ratio, abs(ratio - 1.0), "× {:.2f}".format),
                ("not asked" if math.isnan(float(found)) else _percent(float(found))),
                f"{float(one[f'{PREFIX}factor_least']):.2g}–{float(one[f'{PREFIX}factor_greatest']):.2g}",
                "yes" if bool(one[f"{PREFIX}consistent"]) else "no",
            )
        )
    return Rows("Do the selected motions agree with the hazard? Set over target, of each stripe", headings, rows)


def _unit_of(results: xr.Dataset, given: str) -> str:
    known = results["selected_unit"].sel({MEASURE: given}) if given in results[MEASURE] else None
    return "1" if known is None else str(known.item())


def _percent(value: float) -> str:
    """Return a difference with its sign, in whole per cent."""
    return f"{round(100.0 * value) or 0:+d} %".replace("-", "−").replace("+0", "0")


def _furthest(values: xr.DataArray, distance: xr.DataArray, form: Callable[[float], str]) -> str:
    """Return the value furthest off, and of which measure it is; a dash where nothing is known."""
    if not bool(distance.notnull().any()):
        return "–"
    at = int(np.nanargmax(distance.values))
    return f"{form(float(values[at]))} {measure_name(str(values[MEASURE].values[at]))}"
