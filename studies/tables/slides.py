"""Sliding of blocks and of the pieces of an inventory: slips, and falls over edges and obstacles."""

import json
import math

import numpy as np
import xarray as xr

from ...core.wording import years_text
from ...fragility.adaptive.until import PROBABILITY
from ...fragility.runs.provenance import EDGE
from ...models import Edge
from ...models.friction import LOCKED, ROLLING
from ..buildings.recommendations import YEARS, Range
from ..buildings.sliding import (
    OFF,
    OFF_RATE,
    OVERTURNING,
    OVERTURNING_RATE,
)
from ..plan.adaptive_slides import SLIP_HALF
from ..plan.estimates import middle_level
from ..plan.slides import (
    DAMAGE,
    DISTANCES,
    FALL_OFF,
    FALLS,
    GATED,
    GATED_RATE,
    INSTEAD,
    SLIP,
    SLIP_RATE,
    TRIP,
    TRIP_DISTANCE,
    TRIP_RATE,
)
from ..text.words import axis_of, by_place, display_unit, floor_cell, quantity_name, reference_law
from .assessment import at_the_level, bound_of
from .pieces import MOST_ROWS, chance_of
from .table import Cells, Column, Table, chance_in, footnote, intervals, range_of

MOST = 100
"""Most blocks in a table."""


def slides(results: xr.Dataset) -> Table:
    """Return the table of sliding: in the years of a study with a hazard, else at the level at which half fall."""
    of_law = results.isel(model=reference_law(results)[0])
    adaptive, rated = SLIP_HALF in results, SLIP_RATE in results
    halves = adaptive and not rated and SLIP not in of_law
    scale, unit = display_unit(axis_of(results))
    slips = results["slip"].values.tolist()
    trips = footnote("trips")
    rows: list[Cells] = []
    for name, where in by_place(results, of_law[SLIP_HALF if halves else SLIP_RATE if rated else SLIP].dims):
        block = of_law.isel(where)
        row: Cells = {
            Column("name", "block"): name,
            Column(INSTEAD, "slides, never rocks", "chance"): float(block[INSTEAD]),
        }
        if not halves and (rated or not adaptive):
            falls, rests = _chance(block, "rate", "probability").value, _chance(block, GATED_RATE, GATED).value
            row |= {Column("falls", "falls, if sliding is prevented", "chance"): falls}
            row |= {Column("rests", "falls, with its friction", "chance"): rests}
        for k, slip in enumerate(slips):
            at = block.isel(slip=k)
            column = Column(
                f"{slip:g}", f"slips over {100.0 * slip:g} cm", *(("plain", unit) if halves else ("chance",))
            )
            row[column] = range_of(at, SLIP_HALF, scale) if halves else _chance(at, SLIP_RATE, SLIP, adaptive)
        if not adaptive and (TRIP_RATE if rated else TRIP) in of_law:
            row[Column("obstacle", "obstacle at", "short", "mm")] = 1000.0 * float(block[TRIP_DISTANCE])
            row[Column("trips", "trips over it", "chance", note=trips)] = _chance(block, TRIP_RATE, TRIP)
        rows.append(row)
    half = footnote("half_slip", quantity_name(axis_of(results)))
    damage = ", ".join(f"over {100.0 * slip:g} cm it {does}" for slip, does in DAMAGE.items())
    level = (
        float(json.loads(str(results.attrs["until"]))[PROBABILITY]["level"]) if adaptive and SLIP in of_law else None
    )
    at_level = at_the_level(results, level) if level is not None else ""
    return Table.of(
        "Sliding" if halves else f"Sliding {at_level or _when(results)}",
        rows,
        intervals(results),
        half if halves else "",
        footnote("never_rocks"),
        # (slips that a study gives have their own meaning)
        footnote("damage", damage) if tuple(slips) == DISTANCES else "",
        most=MOST,
    )


def _when(results: xr.Dataset) -> str:
    """Return the years of the chances of a study with a hazard, else the level at which half of all fall."""
    if ("years" in results.attrs and f"{FALL_OFF}_risk_probability" in results) or SLIP_RATE in results:
        return f"in {years_text(float(results.attrs['years']))}"
    level = results["level"]
    return at_the_level(results, float(level[middle_level(results["probability"])]))


def _chance(block: xr.Dataset, rate: str, chance: str, adaptive: bool = False) -> Range:
    """Return a probability `_when`; for an event in no run 0 with the upper end of its interval."""
    if SLIP_RATE in block:
        chance_of_event = chance_in(range_of(block, rate), float(block.attrs["years"]), 0.0)
    else:
        chance_of_event = range_of(block if adaptive else block.isel(level=middle_level(block["probability"])), chance)
    if adaptive and chance_of_event.value == 0.0:  # (a block whose friction is never low enough)
        return Range(0.0, math.nan, math.nan)
    return chance_of_event if adaptive or chance not in block else _seen(chance_of_event, block[chance])


def _seen(chance: Range, probability: xr.DataArray) -> Range:
    """Return a probability; of an event in no run, whose rate lies above the highest level alone, the upper end."""
    unseen = not bool((probability > 0.0).any()) and chance.value > 0.0
    return Range(0.0, math.nan, float(np.fmax(chance.value, chance.upper))) if unseen else chance


def edges(results: xr.Dataset) -> Table:
    """Return the table of falls over edges, in the years or at the level of the table of sliding."""
    rows: list[Cells] = [
        {
            Column("name", "block"): name,
            Column("off", "slides off", "chance"): off,
            Column("over", "overturns, if sliding is prevented", "chance"): over,
            Column("either", "overturns or slides off", "chance"): either,
        }
        for name, (off, over, either) in _edges(results)
    ]
    return Table.of(f"Falls over edges {_when(results)}", rows, intervals(results), most=MOST)


def edges_of(results: xr.Dataset) -> list[tuple[str, str, str, str]]:
    """Return the chances of blocks near edges: name, of sliding off, of overturning or sliding off, and when."""
    if f"{FALL_OFF}_probability" not in results:
        return []
    write = Column("", format="chance").text
    return [(name, write(off), write(either), _when(results)) for name, (off, _, either) in _edges(results)]


SEEN = (f"{FALL_OFF}_probability", "probability", f"{FALLS}_probability")
"""Variables that show them at each level."""


def _edges(results: xr.Dataset) -> list[tuple[str, list[Range]]]:
    """Return the chances of each block (on each floor) near an edge, under the reference law."""
    of_law = results.isel(model=reference_law(results)[0])
    names = (f"{FALL_OFF}_risk_probability", "risk_probability", f"{FALLS}_risk_probability")
    yearly = names[0] in results
    names, at = (names, of_law) if yearly else (SEEN, of_law.isel(level=middle_level(results["probability"])))
    chances_of = []
    for name, where in by_place(results, at[names[0]].dims):
        block = at.isel(where)
        chances = [
            _seen(range_of(block, chance), of_law[of].isel(where)) for chance, of in zip(names, SEEN, strict=True)
        ]
        if not math.isnan(chances[0].value):
            chances_of.append((name, chances))
    return chances_of


NOT_MODELLED = "rolls: not modelled"


def item_slides(results: xr.Dataset, model: int = 0) -> Table:
    """Return the table of sliding of an inventory under one law, in 50 years or at the level."""
    contacts, edges = contacts_of(results), _item_edges(results)
    known = results[INSTEAD].values if INSTEAD in results else np.full(len(contacts), math.nan)
    slips = results["slip"].values.tolist() if "slip" in results.coords else []
    alone = (OVERTURNING, OVERTURNING_RATE) if OVERTURNING in results else ("probability", "rate")
    trips = footnote("trips")
    rows: list[Cells] = []
    for i, item in enumerate(results["block"].values):
        if not (contacts[i] or edges[i] or not math.isnan(known[i])):
            continue
        piece, edge = results.isel(block=i, model=model), edges[i]
        friction = None if math.isnan(known[i]) else f"coefficient of friction {float(piece['friction']):.2g}"
        why = "anchored" if bool(piece["anchored"]) else NOT_MODELLED if contacts[i] == ROLLING else ""
        row: Cells = {
            Column("item", "piece"): str(item),
            Column("floor", "floor"): floor_cell(str(piece["floor"].item())),
            Column("contact", "contact"): contacts[i] or friction,
            Column(INSTEAD, "slides, never rocks", "chance"): why or float(known[i]),
        }
        for k, slip in enumerate(slips):
            column = Column(f"{slip:g}", f"slips over {100.0 * slip:g} cm", "chance")
            row[column] = None if why else _item_chance(piece.isel(slip=k), SLIP, SLIP_RATE)
        obstacle = 1000.0 * float(piece[TRIP_DISTANCE]) if TRIP in results else None
        falls: Cells = {
            Column("edge", "edge"): None if edge is None else edge.label.removeprefix("edge "),
            Column("off", "slides off it", "chance"): _item_chance(piece, OFF, OFF_RATE),
            Column("obstacle", "obstacle at", "short", "mm"): obstacle,
            Column("trips", "trips over it", "chance", note=trips): _item_chance(piece, TRIP, TRIP_RATE),
            Column("alone", "overturns, if sliding is prevented", "chance"): _item_chance(piece, *alone),
            Column("rocking", "overturns, with its friction", "chance"): _item_chance(piece, GATED, GATED_RATE),
        }
        rows.append(row | (dict.fromkeys(falls) if why else falls))
    when = f"in {YEARS:g} years"
    if "rate" not in results:
        when = at_the_level(results, float(results.attrs["at_level"]))
    locked = footnote("brakes", LOCKED.capitalize()) if LOCKED in contacts else ""
    title = f"Sliding of the pieces {when}"
    return Table.of(title, rows, intervals(results), footnote("never_rocks"), locked)


def slips(results: xr.Dataset, model: int = 0) -> Table:
    """Return the slips of pieces."""
    return item_slides(results, model).but(OF_FALLS).first(MOST_ROWS)


def falls(results: xr.Dataset, model: int = 0) -> Table:
    """Return the falls of pieces that can slide: over an edge, over an obstacle or by overturning."""
    table = item_slides(results, model)
    return table.apart(table.title.replace("Sliding", "Falls"), ("item", "floor"), OF_FALLS).first(MOST_ROWS)


OF_FALLS = "edge", "off", "obstacle", "trips", "alone", "rocking"
"""Columns of the second table."""


def contacts_of(results: xr.Dataset) -> list[str]:
    """Return the contacts of the pieces of each line with their floor, '' if not stated."""
    if "contact" in results.coords:
        return [str(contact) for contact in results["contact"].values]
    return [""] * results.sizes["block"]


def _item_edges(results: xr.Dataset) -> list[Edge | None]:
    """Return the edges of each line."""
    if EDGE not in results.coords:
        return [None] * results.sizes["block"]
    every = [json.loads(str(edge)) for edge in results[EDGE].values]
    return [None if edge is None else Edge(**edge) for edge in every]


def _item_chance(piece: xr.Dataset, name: str, rate: str) -> Range:
    """Return a probability in 50 years, or at the level; for an event in no motion 0 with the upper end."""
    chance = chance_of(piece, name, rate)
    return Range(0.0, math.nan, bound_of(piece)) if chance.value == 0.0 else chance
