"""The table of what slides in an inventory, how far, and what falls off an edge."""

from __future__ import annotations

import json
import math

import numpy as np
import xarray as xr

from ...fragility.runs.provenance import EDGE
from ...models import Edge
from ...models.friction import LOCKED, ROLLING
from ..buildings.recommendations import YEARS, Range
from ..buildings.sliding import GATED_RATE, ITEM_TRIP_RATE, OFF, OFF_RATE, OVERTURNING, OVERTURNING_RATE, SLIP_RATE
from ..plan.slides import GATED, INSTEAD, SLIP, TRIP, TRIP_DISTANCE
from ..text.words import floor_cell, level_text
from .pieces import chance_of
from .slides import SLIDES, TRIPS
from .table import Column, Row, Table, intervals
from .unseen import bound_of

MOST = 60
"""Most lines in the table."""
NOT_MODELLED = "rolls: not modelled"


def item_slides(results: xr.Dataset, model: int = 0) -> Table:
    """Return the table of sliding of an inventory under one law, in 50 years or at the level."""
    contacts, edges = contacts_of(results), edges_of(results)
    known = results[INSTEAD].values if INSTEAD in results else np.full(len(contacts), math.nan)
    slips = results["slip"].values.tolist() if "slip" in results.coords else []
    alone = (OVERTURNING, OVERTURNING_RATE) if OVERTURNING in results else ("probability", "item_rate")
    rows = []
    for i, item in enumerate(results["item"].values):
        if not (contacts[i] or edges[i] or not math.isnan(known[i])):
            continue
        piece = results.isel(item=i, model=model)
        edge = edges[i]
        row: Row = {"item": str(item), "floor": floor_cell(str(piece["floor"].item()))}
        friction = None if math.isnan(known[i]) else f"coefficient of friction {float(piece['friction']):.2g}"
        row["contact"] = contacts[i] or friction
        if bool(piece["anchored"]) or contacts[i] == ROLLING:
            rows.append(row | {INSTEAD: "anchored" if bool(piece["anchored"]) else NOT_MODELLED})
            continue
        row |= {INSTEAD: float(known[i]), "edge": None if edge is None else edge.label.removeprefix("edge ")}
        row |= {f"{slip:g}": _chance(piece.isel(slip=k), SLIP, SLIP_RATE) for k, slip in enumerate(slips)}
        row["obstacle"] = 1000.0 * float(piece[TRIP_DISTANCE]) if TRIP in results else None
        row |= {"off": _chance(piece, OFF, OFF_RATE), "trips": _chance(piece, TRIP, ITEM_TRIP_RATE)}
        rows.append(row | {"alone": _chance(piece, *alone), "rocking": _chance(piece, GATED, GATED_RATE)})
    columns = (
        *(Column("item", "piece"), Column("floor", "floor"), Column("contact", "contact")),
        Column(INSTEAD, "slides, never rocks", "chance"),
        *(Column(f"{slip:g}", f"slips over {100.0 * slip:g} cm", "chance") for slip in slips),
        *(Column("edge", "edge"), Column("off", "slides off it", "chance")),
        *(Column("obstacle", "obstacle at", "short", "mm"), Column("trips", "trips over it", "chance", note=TRIPS)),
        Column("alone", "overturns, if it could not slide", "chance"),
        Column("rocking", "overturns, if it rocks", "chance"),
    )
    when = f"in {YEARS:g} years"
    if "item_rate" not in results:
        when = f"at {level_text(float(results.attrs['at_level']), results['level'])}"
    locked = f"{LOCKED.capitalize()} are as on feet, as long as the brakes hold." if LOCKED in contacts else ""
    title = f"Sliding of the pieces {when}"
    return Table.of(title, columns, rows, intervals(results), SLIDES, locked)


def slips(results: xr.Dataset, model: int = 0) -> Table:
    """Return how far pieces slide."""
    return item_slides(results, model).but(FALLS).first(MOST)


def falls(results: xr.Dataset, model: int = 0) -> Table:
    """Return how pieces that can slide fall: over an edge, over an obstacle or by overturning."""
    table = item_slides(results, model)
    return table.apart(table.title.replace("Sliding", "Falls"), ("item", "floor"), FALLS).first(MOST)


FALLS = "edge", "off", "obstacle", "trips", "alone", "rocking"
"""Columns of the second table."""


def contacts_of(results: xr.Dataset) -> list[str]:
    """Return what the pieces of each line stand on, '' where nothing is said of it."""
    if "contact" in results.coords:
        return [str(one) for one in results["contact"].values]
    return [""] * results.sizes["item"]


def edges_of(results: xr.Dataset) -> list[Edge | None]:
    """Return the edges of each line."""
    if EDGE not in results.coords:
        return [None] * results.sizes["item"]
    every = [json.loads(str(one)) for one in results[EDGE].values]
    return [None if one is None else Edge(**one) for one in every]


def _chance(piece: xr.Dataset, name: str, rate: str) -> Range:
    """Return a chance in 50 years, or at the level; of what no motion showed 0 with the upper end of its interval."""
    chance = chance_of(piece, name, rate)
    return Range(0.0, math.nan, bound_of(piece)) if chance.value == 0.0 else chance
