"""What slides in an inventory, how far, and what falls off an edge: a table, and sentences for a client."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator

import numpy as np
import xarray as xr

from ...core.wording import about_percent, about_years, chances_between, confidence_text
from ...fragility.hazard.rates import probability_in
from ...fragility.runs.provenance import EDGE
from ...models import Edge
from ...models.friction import LOCKED, ROLLING
from ...models.scenes.edge import FOOT
from ..buildings.recommendations import YEARS
from ..buildings.sliding import GATED_RATE, ITEM_TRIP_RATE, OFF, OFF_RATE, OVERTURNING, OVERTURNING_RATE, SLIP_RATE
from ..plan.slides import ENDS, GATED, INSTEAD, SLIP, TRIP, TRIP_DISTANCE
from ..text.rows import Rows
from ..text.words import floor_cell, floor_name, level_text
from .slides import NO_SIMULATION
from .unseen import at_most, at_most_once, most_probability

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


def falling_off_sentences(results: xr.Dataset) -> Iterator[str]:
    """Yield a sentence for each line whose pieces fall off an edge: how often, with its interval."""
    if OFF not in results:
        return
    for i, edge in enumerate(edges_of(results)):
        one = results.isel(item=i)
        name = f"“{results['item'].values[i]}” ({floor_name(str(results['floor'].values[i]))})"
        if edge is None or bool(one["anchored"]):
            continue
        yield f"{_how_often(results, one, name, _over(edge), OFF, OFF_RATE)}."


def item_trip_sentences(results: xr.Dataset) -> Iterator[str]:
    """Yield a sentence for each line whose pieces may trip over an obstacle: how often, with its interval."""
    if TRIP not in results:
        return
    for i, distance in enumerate(results[TRIP_DISTANCE].values.tolist()):
        one = results.isel(item=i)
        if bool(one[TRIP].isnull().all()):
            continue
        name = f"“{results['item'].values[i]}” ({floor_name(str(results['floor'].values[i]))})"
        what = f"slides into an obstacle {_distance(distance)} away fast enough to trip over it"
        yield f"{_how_often(results, one, name, what, TRIP, ITEM_TRIP_RATE)} ({NO_SIMULATION})."


def _distance(metres: float) -> str:
    return "–" if math.isnan(metres) else f"{1000.0 * metres:.4g}\u00a0mm"


def _how_often(results: xr.Dataset, one: xr.Dataset, name: str, what: str, chance: str, rate: str) -> str:
    """Return how often something happens to each piece of a line, with its interval, without the full stop."""
    if rate in one:
        often, low, high = (float(one[f"{rate}{end}"]) for end in ENDS)
        if not often > 0.0:
            return f"No {name} {what} in any of the runs: each does so {at_most_once(results)}"
        ends = f" ({years_of(high, low)})" if math.isfinite(low) and math.isfinite(high) else ""
        return f"Each {name} {what} about once in {about_years(often)} years{ends}"
    here = one.sel(level=float(one.attrs["at_level"]))
    value, low, high = (100.0 * float(here[f"{chance}{end}"]) for end in ENDS)
    if value == 0.0:
        most = f"at most {100.0 * most_probability(results):.0f} of 100 such earthquakes"
        return f"No {name} {what} in any of the runs: each does so in {most}"
    return f"Each {name} {what} in about {value:.0f} ({low:.0f} to {high:.0f}) of 100 such earthquakes"


def _over(edge: Edge) -> str:
    """Return what counts as falling off, in words: the foot at the edge or the glass, or the centre of mass over it."""
    if edge.falls_when == FOOT:
        least = min(one for one in (edge.front, edge.back) if one is not None)
        free = f"the {1000.0 * least:.4g} mm that are free between its foot and the nearest edge or glass"
        return f"slides beyond its clearance ({free}), which counts as a fall,"
    return "slides off the edge of its support"


def years_of(often: float, seldom: float) -> str:
    """Return the ends of a rate's interval as years between two events."""
    if not math.isfinite(often) or not math.isfinite(seldom):
        return "no interval"
    return f"above {about_years(often)}" if seldom == 0.0 else f"{about_years(often)} to {about_years(seldom)}"


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
