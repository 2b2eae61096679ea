"""The table of what slides in an inventory, how far, and what falls off an edge."""

from __future__ import annotations

import json
import math

import numpy as np
import xarray as xr

from ...core.wording import about_percent, chances_between, confidence_text
from ...fragility.hazard.rates import probability_in
from ...fragility.runs.provenance import EDGE
from ...models import Edge
from ...models.friction import LOCKED, ROLLING
from ..buildings.recommendations import YEARS
from ..buildings.sliding import GATED_RATE, ITEM_TRIP_RATE, OFF, OFF_RATE, OVERTURNING, OVERTURNING_RATE, SLIP_RATE
from ..plan.slides import ENDS, GATED, INSTEAD, SLIP, TRIP, TRIP_DISTANCE
from ..text.rows import Rows
from ..text.words import floor_cell, level_text
from .slides import NO_SIMULATION
from .unseen import at_most

MOST = 60
"""Most lines in the table."""
NOT_MODELLED = "rolls: not modelled"


def item_slide_rows(results: xr.Dataset, model: int = 0) -> Rows | None:
    """Return the table of sliding of an inventory under one law, in 50 years or at the level; None without any."""
    contacts = contacts_of(results)
    if INSTEAD not in results and not any(contacts):
        return None
    edges = edges_of(results)
    known = results[INSTEAD].values if INSTEAD in results else np.full(len(contacts), math.nan)
    at = [i for i, _ in enumerate(contacts) if contacts[i] or edges[i] or not math.isnan(known[i])]
    slips = results["slip"].values.tolist() if "slip" in results.coords else []
    yearly, trips = "item_rate" in results, TRIP in results
    others = len(slips) + (6 if trips else 4)
    rows, most = [], at_most(results)
    for i in at[:MOST]:
        one = results.isel(item=i, model=model)
        head = (str(results["item"].values[i]), floor_cell(str(results["floor"].values[i])))
        where = contacts[i] or ("" if math.isnan(known[i]) else f"coefficient of friction {float(one['friction']):.2g}")
        if bool(one["anchored"]):
            cells = ["anchored", *["–"] * others]
        elif contacts[i] == ROLLING:
            cells = [NOT_MODELLED, *["–"] * others]
        else:
            cells = ["–" if math.isnan(known[i]) else about_percent(float(known[i]))]
            cells += [_chance(one.isel(slip=k), SLIP, SLIP_RATE, yearly, most) for k in range(len(slips))]
            edge = edges[i]
            cells.append("–" if edge is None else edge.label.removeprefix("edge "))
            cells.append(_chance(one, OFF, OFF_RATE, yearly, most))
            if trips:
                cells += [_distance(float(one[TRIP_DISTANCE])), _chance(one, TRIP, ITEM_TRIP_RATE, yearly, most)]
            alone = (OVERTURNING, OVERTURNING_RATE) if OVERTURNING in results else ("probability", "item_rate")
            cells += [_chance(one, *alone, yearly, most), _chance(one, GATED, GATED_RATE, yearly, most)]
        rows.append((*head, where or "–", *cells))
    headings = ["piece", "floor", "contact with what it stands on", "slides, never rocks"]
    headings += [*(f"slips over {100.0 * one:g} cm" for one in slips), "edge", "slides off it"]
    headings += ["obstacle at", "trips over it"] if trips else []
    headings += ["overturns, if it could not slide", "overturns, where it rocks"]
    when = f"in {YEARS:g} years"
    if not yearly:
        when = f"at {level_text(float(results.attrs['at_level']), results['level'])}"
    first = f", the first {MOST} of {len(at):,}" if len(at) > MOST else ""
    title = f"Sliding of each piece {when} ({confidence_text(results)} intervals{first})"
    locked = f"; {LOCKED}: as on feet, as long as the brakes hold" if LOCKED in contacts else ""
    decided = f"; trips over obstacles: {NO_SIMULATION}" if trips else ""
    return Rows(f"{title}: with a friction below b/h it slides and never rocks{locked}{decided}", tuple(headings), rows)


def _distance(metres: float) -> str:
    return "–" if math.isnan(metres) else f"{1000.0 * metres:.4g}\u00a0mm"


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


def _chance(one: xr.Dataset, name: str, rate: str, yearly: bool, most: str) -> str:
    """Return the chance of something in 50 years, or at the level, with its interval; a dash where it is not known."""
    if name not in one:
        return "–"
    if yearly:
        values = [float(probability_in(one[f"{rate}{end}"].clip(0.0), YEARS)) for end in ENDS]
    else:
        here = one.sel(level=float(one.attrs["at_level"]))
        values = [float(here[f"{name}{end}"]) for end in ENDS]
    chance, low, high = values
    if math.isnan(chance):
        return "–"
    if chance == 0.0:
        return most
    if math.isnan(low) or math.isnan(high):
        return about_percent(chance)
    return f"{about_percent(chance)} ({chances_between(low, high, about_percent)})"
