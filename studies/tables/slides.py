"""What sliding changes, and what falls over edges, as tables and in sentences."""

from __future__ import annotations

import json
from collections.abc import Sequence

import numpy as np
import xarray as xr

from ...core.wording import about_percent, confidence_text, interval_text, two_digits, years_text
from ...fragility.adaptive.until import PROBABILITY
from ...fragility.hazard.rates import probability_in
from ..plan.adaptive_slides import SLIP_HALF
from ..plan.estimates import middle_level
from ..plan.slides import (
    DAMAGE,
    DISTANCES,
    ENDS,
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
from ..text.rows import Rows
from ..text.words import axis_of, by_place, display_unit, level_text, quantity_name, reference_law

MOST = 100
"""Most blocks in a table."""
NO_SIMULATION = "a criterion, not a simulation"
"""How trips are decided."""


def slide_rows(results: xr.Dataset) -> Rows | None:
    """Return the table of sliding: in the years of a study with a hazard, else at the level where half fall."""
    if SLIP_HALF in results:
        return _adaptive_rows(results)
    if INSTEAD not in results or SLIP not in results:
        return None
    at, _ = reference_law(results)
    here = results.isel(model=at)
    of_runs = "probability", GATED, SLIP, TRIP
    names = ("rate", GATED_RATE, SLIP_RATE, TRIP_RATE) if SLIP_RATE in results else of_runs
    (falls,), (gated,), beyond, tripped = (
        _chances(here, name, ENDS if name in (SLIP, SLIP_RATE, TRIP, TRIP_RATE) else ENDS[:1]) for name in names
    )
    distances = results[TRIP_DISTANCE].values if tripped else np.full(results.sizes["block"], np.nan)
    rows = []
    for name, where in by_place(results.isel(block=slice(MOST)), beyond[0].dims):
        i = where["block"]
        own = [
            _text([float(one.isel(there)) for one in beyond], _ever(results[SLIP].isel(there)))
            for there in ({**where, "slip": j} for j in range(results.sizes["slip"]))
        ]
        chances = results[INSTEAD][i], falls.isel(where), gated.isel(where)
        if tripped:
            own.append("–" if np.isnan(distances[i]) else f"{1000.0 * distances[i]:.4g}\u00a0mm")
            own.append(_text([float(one.isel(where)) for one in tripped], _ever(results[TRIP].isel(where))))
        rows.append((name, *(_text([float(one)]) for one in chances), *own))
    return _sliding(results, f" {_when(results)}", "the motions", rows, falls=True, trips=bool(tripped))


def _sliding(
    results: xr.Dataset, of: str, over: str, rows: list[tuple[str, ...]], *, falls: bool, trips: bool = False
) -> Rows:
    """Return a table of sliding with its title and headings."""
    slips = results["slip"].values.tolist()
    headings = ["", "slides, never rocks"]
    headings += ["falls, if it could not slide", "falls, where it rocks"] if falls else []
    headings += [f"slips over {100.0 * one:g} cm" for one in slips]
    headings += ["obstacle at", "trips over it"] if trips else []
    # (slips of the study's own have a meaning of their own)
    words = ", ".join(f"over {100.0 * one:g} cm it {does}" for one, does in DAMAGE.items())
    title = (
        f"Sliding{of} ({confidence_text(results)} intervals over {over}): a block whose friction is below b/h slides "
        f"and never rocks{f'; {words} (judgement)' if tuple(slips) == DISTANCES else ''}"
        f"{f'; trips over obstacles: {NO_SIMULATION}' if trips else ''}{_cut(results.sizes['block'])}"
    )
    return Rows(title, tuple(headings), rows)


def _adaptive_rows(results: xr.Dataset) -> Rows:
    """Return the table of sliding of a study at adaptive levels: chances in some years, else the shaking of slips."""
    at, _ = reference_law(results)
    here = results.isel(model=at)
    rated = SLIP_RATE in results
    scale, unit = display_unit(axis_of(results))
    rows = []
    for i, block in enumerate(results["block"].values[:MOST].tolist()):
        cells = [_text([float(here[INSTEAD][i])])]
        if rated:
            (falls,), (rests,) = (_chances(here, name, ENDS[:1]) for name in ("rate", GATED_RATE))
            cells += [_text([float(one[i])]) for one in (falls, rests)]
        for k in range(results.sizes["slip"]):
            if rated or SLIP in here:
                every = _chances(here, SLIP_RATE, ENDS) if rated else [here[f"{SLIP}{end}"] for end in ENDS]
                own = [float(one[i, k]) for one in every]
                cells.append(_text(own if own[0] > 0.0 else own[:1]))
                continue
            median, low, high = (float(here[f"{SLIP_HALF}{end}"][i, k]) / scale for end in ENDS)
            cells.append("–" if np.isnan(median) else f"{median:.3g} ({low:.3g}–{high:.3g})")
        rows.append((str(block), *cells))
    name = f"{quantity_name(axis_of(results))}{f' ({unit})' if unit else ''}"
    of = f": the {name} at which half of the blocks that slide slip further"
    if rated:
        of = f" {_when(results)}"
    elif SLIP in here:
        asked = json.loads(str(results.attrs["until"]))[PROBABILITY]
        of = f" at {level_text(float(asked['level']), axis_of(results))}"
    return _sliding(results, of, "the motions and the friction", rows, falls=rated)


def _cut(of: int, what: str = "blocks") -> str:
    """Return what a title says where a table holds only the first of its lines."""
    return f"; the first {MOST} of {of:,} {what}" if of > MOST else ""


def _when(results: xr.Dataset) -> str:
    """Return what chances are of: the years of a study with a hazard, else the level at which half of all fall."""
    if SLIP_RATE in results:
        return f"in {years_text(float(results.attrs['years']))}"
    level = results["level"]
    return f"at {level_text(float(level[middle_level(results['probability'])]), level)}"


def _chances(results: xr.Dataset, name: str, ends: Sequence[str]) -> list[xr.DataArray]:
    """Return chances `_when`, each with the ends of its interval that there are, from rates or chances at levels."""
    known = [results[f"{name}{end}"] for end in ends if f"{name}{end}" in results]
    if SLIP_RATE in results:
        return [probability_in(one.clip(0.0), float(results.attrs["years"])) for one in known]
    middle = middle_level(results["probability"])
    return [one.isel(level=middle) for one in known]


def edge_rows(results: xr.Dataset) -> Rows | None:
    """Return the table of falls over edges, in the years or at the level of the table of sliding; None without any."""
    if f"{FALL_OFF}_probability" not in results:
        return None
    when, cases = _edges(results)
    rows = [(name, *chances) for name, chances in cases[:MOST]]
    headings = ("", "slides off", "overturns, if it could not slide", "overturns or slides off")
    sure = f"{confidence_text(results)} intervals over the motions"
    return Rows(f"Falls over edges {when} ({sure}){_cut(len(cases), 'cases')}", headings, rows)


def edges_of(results: xr.Dataset) -> list[tuple[str, str, str, str]]:
    """Return the chances of blocks near edges: name, of sliding off, of overturning or sliding off, and when."""
    if f"{FALL_OFF}_probability" not in results:
        return []
    when, cases = _edges(results)
    return [(name, off, either, when) for name, (off, _, either) in cases]


SEEN = (f"{FALL_OFF}_probability", "probability", f"{FALLS}_probability")
"""Variables that say whether they were seen."""
Chances = tuple[str, str, str]
"""Chances of a block to slide off, to overturn if it could not slide, and of either, each with its interval."""


def _edges(results: xr.Dataset) -> tuple[str, list[tuple[str, Chances]]]:
    """Return when, in words, and the chances of each block (on each floor) near an edge, under the reference law."""
    at, _ = reference_law(results)
    here = levels = results.isel(model=at)
    names = (f"{FALL_OFF}_risk_probability", "risk_probability", f"{FALLS}_risk_probability")
    if names[0] in results:
        when = f"in {years_text(float(results.attrs['years']))}"
    else:
        middle, names = middle_level(results["probability"]), SEEN
        when, here = f"at {level_text(float(results['level'][middle]), results['level'])}", here.isel(level=middle)
    found = []
    for name, where in by_place(results, here[names[0]].dims):
        values = [[float(here[f"{one}{end}"].isel(where)) for end in ENDS if f"{one}{end}" in here] for one in names]
        if not np.isnan(values[0][0]):
            off, over, either = (
                _text(one, _ever(levels[of].isel(where))) for one, of in zip(values, SEEN, strict=True)
            )
            found.append((name, (off, over, either)))
    return when, found


def _ever(probability: xr.DataArray) -> bool:
    """Return whether anything was seen in any run; a rate otherwise holds what lies above the highest level alone."""
    return bool((probability > 0.0).any())


def _text(values: list[float], seen: bool = True) -> str:
    """Return a chance, with its interval where there is one; seen: False where it is nothing but a bound."""
    if np.isnan(values[0]):
        return "–"
    chance, *ends = values
    if not seen and chance > 0.0:
        return f"at most {about_percent(chance)}"
    if len(ends) < 2 or np.isnan(ends).any():
        return about_percent(chance)
    return f"{about_percent(chance)} ({interval_text(100.0 * ends[0], 100.0 * ends[1], two_digits)})"
