"""The table of the precision at adaptive levels."""

from __future__ import annotations

import math

import xarray as xr

from ...fragility.adaptive.until import MEDIAN, PROBABILITY, RATE
from ..buildings.recommendations import Range
from ..text.block_order import shown
from ..text.precision import FITTED_RATE, asked_of, curves_of, reached_by
from ..text.words import axis_of, display_unit
from .table import Column, Row, Table, range_of


def precision(results: xr.Dataset) -> Table:
    """Return what was requested of each curve and what was reached."""
    here = shown(results)
    target, allowed = asked_of(here)
    chance = target == PROBABILITY
    scale, unit = display_unit(axis_of(here)) if target == MEDIAN else (1.0, "1/year" if target == RATE else "")
    fitted = [curve for _, curve in curves_of(here)] if target == RATE and FITTED_RATE in here else []
    rows: list[Row] = []
    for k, curve in enumerate(reached_by(here)):
        value = Range(*(end / scale for end in curve.target))
        known = math.isfinite(curve.half_width) and math.isfinite(value.value)
        row: Row = {"curve": curve.name, "value": value if known else None}
        row |= {"reached": curve.half_width if known else None, "motions": curve.motions, "runs": curve.runs}
        row |= {"stopped": curve.stopped}
        if k < len(fitted):
            apart = float(fitted[k]["rate_misfit"])
            row |= {"fitted": range_of(fitted[k], FITTED_RATE), "apart": apart or "within error"}
        rows.append(row)
    name = "half level" if target == MEDIAN else target
    columns = (
        *(Column("curve", "curve"), Column("value", name, "plain", unit)),
        Column("reached", "reached", "error" if chance else "precision"),
        *(Column("motions", "motions", "count"), Column("runs", "runs", "count"), Column("stopped", "stopped because")),
        *(Column("fitted", "of the fitted curve", "three", unit), Column("apart", "which differs by", "signed")),
    )
    request = f"The requested half width is {f'{allowed:g}' if chance else f'{100.0 * allowed:g} %'} of the {name}."
    free = "Rates do not assume a form of curve." if target == RATE else ""
    return Table.of(
        "Precision at adaptive levels", columns, rows, request, "Ranges in brackets are 95 % intervals.", free
    )
