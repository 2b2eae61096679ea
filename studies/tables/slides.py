"""Sliding and falls over edges."""

from __future__ import annotations

import json
import math

import numpy as np
import xarray as xr

from ...core.wording import years_text
from ...fragility.adaptive.until import PROBABILITY
from ...fragility.hazard.rates import probability_in
from ..buildings.recommendations import Range
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
from ..text.words import axis_of, by_place, display_unit, level_text, quantity_name, reference_law
from .table import Column, Row, Table, intervals, range_of

MOST = 100
"""Most blocks in a table."""
TRIPS = "Trips over obstacles: a criterion, not a simulation."


def slides(results: xr.Dataset) -> Table:
    """Return the table of sliding: in the years of a study with a hazard, else at the level where half fall."""
    here = results.isel(model=reference_law(results)[0])
    adaptive, rated = SLIP_HALF in results, SLIP_RATE in results
    halves = adaptive and not rated and SLIP not in here
    scale, unit = display_unit(axis_of(results))
    slips = results["slip"].values.tolist()
    rows: list[Row] = []
    for name, where in by_place(results, here[SLIP_HALF if halves else SLIP_RATE if rated else SLIP].dims):
        block = here.isel(where)
        row: Row = {"name": name, INSTEAD: float(block[INSTEAD])}
        if not halves and (rated or not adaptive):
            row |= {"falls": _chance(block, "rate", "probability").value}
            row |= {"rests": _chance(block, GATED_RATE, GATED).value}
        for k, slip in enumerate(slips):
            at = block.isel(slip=k)
            row[f"{slip:g}"] = range_of(at, SLIP_HALF, scale) if halves else _chance(at, SLIP_RATE, SLIP, adaptive)
        if not adaptive and (TRIP_RATE if rated else TRIP) in here:
            row |= {"obstacle": 1000.0 * float(block[TRIP_DISTANCE]), "trips": _chance(block, TRIP_RATE, TRIP)}
        rows.append(row)
    columns = (
        *(Column("name", "block"), Column(INSTEAD, "slides, never rocks", "chance")),
        *(Column("falls", "falls, if it could not slide", "chance"), Column("rests", "falls, if it rocks", "chance")),
        *(
            Column(f"{slip:g}", f"slips over {100.0 * slip:g} cm", *(("plain", unit) if halves else ("chance",)))
            for slip in slips
        ),
        *(Column("obstacle", "obstacle at", "short", "mm"), Column("trips", "trips over it", "chance", note=TRIPS)),
    )
    half = f"Levels are {quantity_name(axis_of(results))} at which half of the blocks that slide slip further."
    level = float(json.loads(str(results.attrs["until"]))[PROBABILITY]["level"]) if adaptive and SLIP in here else None
    at_level = f"at {level_text(level, axis_of(results))}" if level is not None else ""
    return Table.of(
        "Sliding" if halves else f"Sliding {at_level or _when(results)}",
        columns,
        rows,
        intervals(results),
        half if halves else "",
        SLIDES,
        # (slips that a study gives have their own meaning)
        TEARS if tuple(slips) == DISTANCES else "",
        most=MOST,
    )


SLIDES = "A block whose friction is below b/h slides and does not rock."
TEARS = f"Assumed damage by slip: {', '.join(f'over {100.0 * slip:g} cm it {does}' for slip, does in DAMAGE.items())}."


def _when(results: xr.Dataset) -> str:
    """Return the years of the chances of a study with a hazard, else the level at which half of all fall."""
    if ("years" in results.attrs and f"{FALL_OFF}_risk_probability" in results) or SLIP_RATE in results:
        return f"in {years_text(float(results.attrs['years']))}"
    level = results["level"]
    return f"at {level_text(float(level[middle_level(results['probability'])]), level)}"


def _chance(block: xr.Dataset, rate: str, chance: str, adaptive: bool = False) -> Range:
    """Return a chance `_when`; of what no run showed 0 with the upper end of its interval."""
    if SLIP_RATE in block:
        ends = range_of(block, rate)
        found = Range(*(float(probability_in(np.float64(max(end, 0.0)), float(block.attrs["years"]))) for end in ends))
    else:
        found = range_of(block if adaptive else block.isel(level=middle_level(block["probability"])), chance)
    if adaptive and found.value == 0.0:  # (a block whose friction is never low enough)
        return Range(0.0, math.nan, math.nan)
    return found if adaptive or chance not in block else _seen(found, block[chance])


def _seen(chance: Range, probability: xr.DataArray) -> Range:
    """Return a chance; of what no run showed, whose rate lies above the highest level alone, as a bound."""
    unseen = not bool((probability > 0.0).any()) and chance.value > 0.0
    return Range(0.0, math.nan, chance.value) if unseen else chance


def edges(results: xr.Dataset) -> Table:
    """Return the table of falls over edges, in the years or at the level of the table of sliding."""
    rows: list[Row] = [{"name": name} | dict(zip(EDGES, chances, strict=True)) for name, chances in _edges(results)]
    columns = Column("name", "block"), *(Column(key, title, "chance") for key, title in EDGES.items())
    return Table.of(f"Falls over edges {_when(results)}", columns, rows, intervals(results), most=MOST)


EDGES = {"off": "slides off", "over": "overturns, if it could not slide", "either": "overturns or slides off"}
"""Columns of the table of edges."""


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
    here = results.isel(model=reference_law(results)[0])
    names = (f"{FALL_OFF}_risk_probability", "risk_probability", f"{FALLS}_risk_probability")
    yearly = names[0] in results
    names, at = (names, here) if yearly else (SEEN, here.isel(level=middle_level(results["probability"])))
    found = []
    for name, where in by_place(results, at[names[0]].dims):
        block = at.isel(where)
        chances = [_seen(range_of(block, chance), here[of].isel(where)) for chance, of in zip(names, SEEN, strict=True)]
        if not math.isnan(chances[0].value):
            found.append((name, chances))
    return found
