"""What slides in an inventory, how far, and what falls off an edge: a table, and sentences for a client."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator

import numpy as np
import xarray as xr

from ...fragility.hazard.rates import probability_in
from ...fragility.runs.provenance import EDGE
from ...models import Edge
from ...models.friction import LOCKED, ROLLING
from ...models.scenes.edge import FOOT
from ...wording import about_percent, about_years, chances_between, confidence_text
from ..buildings.recommendations import YEARS
from ..buildings.sliding import GATED_RATE, OFF, OFF_RATE, OVERTURNING, OVERTURNING_RATE, SLIP_RATE
from ..plan.slides import ENDS, GATED, INSTEAD, SLIP
from ..text.rows import Rows
from ..text.words import floor_name, level_text
from .unseen import at_most, at_most_once, most_probability

MOST = 60
"""Most lines in the table."""
NOT_MODELLED = "rolls: not modelled"


def item_slide_rows(results: xr.Dataset, model: int = 0) -> Rows | None:
    """Return the table of sliding of the lines of an inventory under one law, in 50 years or at the study's level.

    None where no line has friction, an edge or castors.
    """
    contacts = contacts_of(results)
    if INSTEAD not in results and not any(contacts):
        return None
    edges = edges_of(results)
    known = results[INSTEAD].values if INSTEAD in results else np.full(len(contacts), math.nan)
    at = [i for i, _ in enumerate(contacts) if contacts[i] or edges[i] or not math.isnan(known[i])]
    slips = results["slip"].values.tolist() if "slip" in results.coords else []
    yearly = "item_rate" in results
    rows, most = [], at_most(results)
    for i in at[:MOST]:
        one = results.isel(item=i, model=model)
        head = (str(results["item"].values[i]), floor_name(str(results["floor"].values[i])).removeprefix("floor "))
        where = contacts[i] or ("" if math.isnan(known[i]) else f"coefficient of friction {float(one['friction']):.2g}")
        if bool(one["anchored"]):
            cells = ["anchored", *["–"] * (len(slips) + 4)]
        elif contacts[i] == ROLLING:
            cells = [NOT_MODELLED, *["–"] * (len(slips) + 4)]
        else:
            cells = ["–" if math.isnan(known[i]) else about_percent(float(known[i]))]
            cells += [_chance(one.isel(slip=k), SLIP, SLIP_RATE, yearly, most) for k in range(len(slips))]
            edge = edges[i]
            cells += [
                "–" if edge is None else edge.label.removeprefix("edge "),
                _chance(one, OFF, OFF_RATE, yearly, most),
            ]
            alone = (OVERTURNING, OVERTURNING_RATE) if OVERTURNING in results else ("probability", "item_rate")
            cells += [_chance(one, *alone, yearly, most), _chance(one, GATED, GATED_RATE, yearly, most)]
        rows.append((*head, where or "–", *cells))
    headings = (
        "piece",
        "floor",
        "contact with what it stands on",
        "slides, never rocks",
        *(f"slips over {100.0 * one:g} cm" for one in slips),
        "edge",
        "slides off it",
        "overturns, if it could not slide",
        "overturns, where it rocks",
    )
    when = f"in {YEARS:g} years"
    if not yearly:
        when = f"at {level_text(float(results.attrs['at_level']), results['level'])}"
    first = f", the first {MOST} of {len(at):,}" if len(at) > MOST else ""
    title = f"Sliding of each piece {when} ({confidence_text(results)} intervals{first})"
    locked = f"; {LOCKED}: as on feet, as long as the brakes hold" if LOCKED in contacts else ""
    return Rows(f"{title}: with a friction below b/h it slides and never rocks{locked}", headings, rows)


def falling_off_sentences(results: xr.Dataset) -> Iterator[str]:
    """Yield a sentence for each line whose pieces fall off an edge: how often, with its interval."""
    if OFF not in results:
        return
    for i, edge in enumerate(edges_of(results)):
        one = results.isel(item=i)
        name = f"“{results['item'].values[i]}” ({floor_name(str(results['floor'].values[i]))})"
        if edge is None or bool(one["anchored"]):
            continue
        if OFF_RATE in one:
            rate, low, high = (float(one[f"{OFF_RATE}{end}"]) for end in ENDS)
            if rate > 0.0:
                ends = f" ({_years(high, low)})" if math.isfinite(low) and math.isfinite(high) else ""
                yield f"Each {name} {_over(edge)} about once in {about_years(rate)} years{ends}."
            else:
                yield f"No {name} {_over(edge)} in any of the runs: each does so {at_most_once(results)}."
        else:
            here = one.sel(level=float(results.attrs["at_level"]))
            chance, low, high = (float(here[f"{OFF}{end}"]) for end in ENDS)
            if chance == 0.0:
                most = f"at most {100.0 * most_probability(results):.0f} of 100 such earthquakes"
                yield f"No {name} {_over(edge)} in any of the runs: each does so in {most}."
                continue
            yield (
                f"Each {name} {_over(edge)} in about {100.0 * chance:.0f} "
                f"({100.0 * low:.0f} to {100.0 * high:.0f}) of 100 such earthquakes."
            )


def _over(edge: Edge) -> str:
    """Return what counts as falling off, in words: the foot at the edge or the glass, or the centre of mass over it."""
    if edge.falls_when == FOOT:
        least = min(one for one in (edge.front, edge.back) if one is not None)
        free = f"the {1000.0 * least:.4g} mm that are free between its foot and the nearest edge or glass"
        return f"slides beyond its clearance ({free}), which counts as a fall,"
    return "slides off the edge of its support"


def _years(often: float, seldom: float) -> str:
    """Return the ends of a rate's interval as years between two events."""
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
    """Return the chance of something in 50 years, or at the level, with its interval; a dash where it is not known.

    most: the bound of what no motion showed.
    """
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
