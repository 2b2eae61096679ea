"""The axes about which pieces fall, as a table, where both horizontal components shake."""

from __future__ import annotations

import math

import xarray as xr

from ...core.wording import about_percent, counted, whole_percent
from ...fragility.runs.axes import AXIS
from ..buildings.variables import SIDEWAYS
from ..text.rows import Rows
from ..text.words import reference_law

MOST = 100
"""Most pieces in the table."""
DEPTH = 2
"""Value of `AXIS` of a fall along the depth."""


def axis_rows(results: xr.Dataset) -> Rows | None:
    """Return the shares of the falls along width and depth under the reference law; None of runs about one axis."""
    at, _ = reference_law(results)
    law = str(results["model"].values[at])
    if AXIS in results:
        title, rows = f"Axis of the falls, at all levels together: {law}", _of_blocks(results.isel(model=at))
    elif f"{SIDEWAYS.name}_share" in results:
        title, rows = f"Axis of the falls of each piece: {law}", _of_items(results.isel(model=at))
    else:
        return None
    return Rows(title, ("", "falls", "along the width", "along the depth"), rows[:MOST])


def _of_blocks(here: xr.Dataset) -> list[tuple[str, ...]]:
    axis = here[AXIS].transpose("block", ...)
    runs = axis[0].size
    rows: list[tuple[str, ...]] = []
    for block, own in zip(here["block"].values[:MOST], axis.values[:MOST], strict=True):
        fell, deep = int((own > 0).sum()), int((own == DEPTH).sum())
        rows.append((str(block), f"{fell:,} of {counted(runs, 'run')}", *_shares(deep / fell if fell else math.nan)))
    return rows


def _of_items(here: xr.Dataset) -> list[tuple[str, ...]]:
    yearly = "item_rate" in here
    rows: list[tuple[str, ...]] = []
    for i, item in enumerate(here["item"].values[:MOST]):
        one = here.isel(item=i)
        fell = f"{float(one['item_rate']):.2g} in a year" if yearly else about_percent(float(one["probability"].mean()))
        share = float(one[f"{SIDEWAYS.name}_share"])
        shares = _shares(share) if bool(one["both_axes"]) else ("width alone", "–")
        rows.append((str(item), "–" if bool(one["anchored"]) else fell, *shares))
    return rows


def _shares(deep: float) -> tuple[str, str]:
    """Return the shares along the width and the depth, in words."""
    if math.isnan(deep):
        return "–", "–"
    return whole_percent(1.0 - deep), whole_percent(deep)
