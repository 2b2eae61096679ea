"""How well the selected motions of stripes agree with the hazard, as a table."""

from __future__ import annotations

import math

import numpy as np
import xarray as xr

from ...motions.intensity.naming import GROUND
from ..plan.selections import MEASURE, PREFIX, STRIPE
from ..text.words import display_of, measure_at, measure_name
from .table import Column, Table, ends_of


def selections(results: xr.Dataset) -> Table:
    """Return the agreement of each stripe's motions with the hazard, a row per stripe."""
    given = str(results[STRIPE].attrs["long_name"])
    scale, unit = display_of(_unit_of(results, given))
    rows = []
    for i, level in enumerate(results[STRIPE].values):
        stripe = results.isel({STRIPE: i})
        bias, ratio = stripe[f"{PREFIX}bias"], stripe[f"{PREFIX}sigma_ratio"]
        velocity = float(bias.sel({MEASURE: "pgv"}))
        rows.append({
            "level": level / scale,
            "epsilon": float(stripe[f"{PREFIX}epsilon"]),
            "median": _furthest(bias, abs(bias), Column("", format="signed")),
            "scatter": _furthest(ratio, abs(ratio - 1.0), Column("", format="hundredths")),
            "pgv": "not asked" if math.isnan(velocity) else velocity,
            "factors": ends_of(*(float(stripe[f"{PREFIX}factor_{end}"]) for end in ("least", "greatest"))),
            "agrees": "yes" if bool(stripe[f"{PREFIX}consistent"]) else "no",
        })  # fmt: skip
    columns = (
        *(Column("level", measure_at(given, GROUND), "plain", unit), Column("epsilon", "ε", "tenths")),
        *(Column("median", "largest error of a median"), Column("scatter", "largest ratio of scatters")),
        Column("pgv", "error of the median PGV", "signed"),
        *(Column("factors", "scale factors", "two"), Column("agrees", "agrees")),
    )
    note = "ε: standard deviations of the level above the predicted median."
    return Table.of("Agreement of the selected motions with the hazard", columns, rows, note)


def _unit_of(results: xr.Dataset, given: str) -> str:
    known = results["selected_unit"].sel({MEASURE: given}) if given in results[MEASURE] else None
    return "1" if known is None else str(known.item())


def _furthest(values: xr.DataArray, distance: xr.DataArray, column: Column) -> str | None:
    """Return the value furthest off, and of which measure it is; None if nothing is known."""
    if not bool(distance.notnull().any()):
        return None
    at = int(np.nanargmax(distance.values))
    return f"{column.text(float(values[at]))} {measure_name(str(values[MEASURE].values[at]))}"
