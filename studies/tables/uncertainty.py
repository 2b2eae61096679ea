"""Tables of uncertainty studies: sources of the variance."""

from __future__ import annotations

import numpy as np
import xarray as xr

from ..buildings.recommendations import Range
from ..plan.estimates import middle_level
from ..text.block_order import shown
from ..text.words import block_title, input_name
from .table import Column, Row, Table, chosen


def shares(results: xr.Dataset) -> Table:
    """Return shares of the variance of ln capacity by component, or of the flags if capacities are not known."""
    here = shown(results)
    capacities = "capacity_share" in here
    rows: list[Row] = []
    for name in map(str, here["component"].values):
        row: Row = {"name": " × ".join(input_name(part) for part in name.split(" × "))}
        for label in map(str, here["block"].values):
            block = here.sel(block=label)
            share = block["capacity_share"] if capacities else block["flag_share"]
            share = share if capacities else share.isel(level=middle_level(block["probability"]))
            row[f"of {label}"] = float(share.sel(component=name))
        rows.append(row)
    labels = map(str, here["block"].values)
    columns = Column("name"), *(Column(f"of {label}", block_title(label), "share") for label in labels)
    capacity = "the logarithm of the level that overturns a block"
    what = capacity if capacities else "the outcome at the level where it is least certain"
    return Table(
        "Sources of the variance", columns, rows, [f"Numbers are shares of the variance of {what}.", chosen(here)]
    )


def indices(results: xr.Dataset) -> Table:
    """Return Sobol' indices of the probability of overturning at the level where it is nearest to one half."""
    here = shown(results)
    rows: list[Row | str] = []
    for block in here["block"].values:
        for model in here["model"].values:
            curve = here.sel(block=block, model=model)
            at = curve.isel(output=middle_level(curve["probability"]))
            rows.append(f"{block_title(str(block))}, {model}")
            for i, name in enumerate(curve["input"].values):
                row: Row = {"name": input_name(str(name))}
                for key in ("sobol_first", "sobol_total"):
                    value, upper = float(at[key][i]), float(at[f"{key}_upper"][i])
                    row[key] = Range(value, upper - value, np.nan)
                rows.append(row)
    columns = (
        Column("name"),
        Column("sobol_first", "alone", "plus_minus"),
        Column("sobol_total", "with others", "plus_minus"),
    )
    of = "the probability of overturning at the level where it is nearest to 50 %"
    note = f"Numbers are shares of the variance of {of}."
    return Table.of("Sobol’ indices", columns, rows, note, chosen(here))
