"""The table that a study ends with on a terminal: what a reader looks for first, in a few lines."""

from __future__ import annotations

import math

import numpy as np
import xarray as xr

from ...core.wording import about_percent, chances_between, confidence_text, in_years, three_digits, years_between
from ..buildings.pieces import pieces_of
from ..buildings.recommendations import YEARS
from ..text.block_order import RATE, chosen_of, shown
from ..text.curve_notes import verb_in
from ..text.one_side import FORCED
from ..text.precision import FITTED_RATE
from ..text.reached import BELOW, NO_LEVEL, dispersion_texts, level_texts
from ..text.rows import Rows
from ..text.spread import (
    MODEL_RANGE,
    NOT_GIVEN,
    amount_range,
    has_model_range,
    model_range,
    of_what,
    range_text,
    years_range,
)
from ..text.words import NOT_REACHED, axis_of, by_place, display_unit, floor_cell, level_name, reference_law
from .pieces import chance_cell, code_text, in_years as chances_in, model_ranges, over_branches
from .sensitivity import median_rows
from .unseen import at_most

MOST = 8
"""Most lines of the table."""


def short_rows(results: xr.Dataset) -> Rows | None:
    """Return the short table of a study's results, under the reference law; None for an uncertainty study."""
    made = {"fragility": _blocks, "performance": _pieces, "sensitivity": _ratios}.get(str(results.attrs["kind"]))
    return None if made is None else made(results)


def _blocks(results: xr.Dataset) -> Rows:
    """Return the levels at which half fall, those of the other laws, and how often, of the blocks that fall first."""
    yearly = "rate" in results
    most = max(1, MOST // (results.sizes["floor"] if "floor" in results["half_level"].dims else 1))
    here = shown(results, RATE, most) if yearly else shown(results, most=most)
    at, known = reference_law(here)
    axis = axis_of(here)
    scale, unit = display_unit(axis)
    ranged = has_model_range(here, "rate" if yearly else "half_level")
    rows: list[tuple[str, ...]] = []
    for label, place in by_place(here, here["half_level"].dims):
        one = here.isel(place)
        own, others = one.isel(model=at), np.delete(one["half_level"].values / scale, at)
        level, interval = level_texts(own, "half_level", scale)
        beta = dispersion_texts(own)[0] if "dispersion" in own else "–"
        text = f"{level} ({interval})" if level not in (NOT_REACHED, BELOW) else level
        found = others[np.isfinite(others)]
        ends = [three_digits(float(end)) for end in (found.min(), found.max())] if found.size else []
        status = str(own["status"].item())
        cells = [NO_LEVEL.get(status, status), "–"] if np.isnan(float(own["half_level"])) else [text, beta]
        cells += [" to ".join(dict.fromkeys(ends)) or "–"] if others.size else []
        if yearly:
            rate, *limits = (float(own[f"rate{end}"]) for end in ("", "_upper", "_lower"))
            cells.append(f"{in_years(rate)} ({years_between(*limits)})" if np.isfinite(rate) else "–")
        if ranged:
            name, write = ("rate", years_range) if yearly else ("half_level", amount_range)
            cells.append(model_range(own, name, write, 1.0 if yearly else 1.0 / scale) or NOT_GIVEN)
        if "epistemic_rate" in one:
            cells.append(range_text(one).removesuffix(" years") if np.isfinite(one["epistemic_rate"]) else "–")
        rows.append((label, *cells))
    law = f"{here['model'].values[at]}{', the reference law' if known else ''}"
    verb = verb_in(here)
    heading = f"half fall at {level_name(here)}{f', {unit}' if unit else ''}"
    headings = ["", heading, "β", *(["other laws"] if here.sizes["model"] > 1 else [])]
    headings += ["once in, years"] if yearly else []
    headings += [MODEL_RANGE] if ranged else []
    headings += ["over branches (90 %)"] if "epistemic_rate" in here else []
    chosen = f"; {chosen_of(here)}" if chosen_of(here) else ""
    forced = f"; not reliable: the {here.attrs['form']} curves rise to 1, see validity" if FORCED in here.attrs else ""
    free = "; rates without a form of curve" if FITTED_RATE in here else ""
    ranges = f"; {of_what(here)}" if ranged else ""
    title = f"What {verb} under {law} ({confidence_text(here)} intervals of the motions{ranges}{chosen}{forced}{free})"
    return Rows(title, tuple(headings), rows)


def _pieces(results: xr.Dataset) -> Rows:
    """Return the first pieces with their chance of falling and the recommendation."""
    at, _ = reference_law(results)
    yearly = "item_rate" in results
    every = pieces_of(results, at)
    spread, most, ranges = over_branches(results), at_most(results), model_ranges(results, at)
    rows: list[tuple[str, ...]] = []
    for one in every[:MOST]:
        chance = chances_in(one.chance, YEARS) if yearly else one.chance
        falls = "–" if one.held else chance_cell(chance, most)
        cells = [one.item, floor_cell(one.floor), f"{one.number:,}", falls]
        cells += ["–" if one.held else ranges.get(one.item, NOT_GIVEN)] if ranges else []
        if spread:
            _, low, high = chances_in(spread[one.item], YEARS)
            cells.append("–" if high == 0.0 else chances_between(low, high, about_percent))
        rows.append((*cells, one.recommendation))
    first = f"; the first {MOST} of {len(every):,}" if len(every) > MOST else ""
    # (pieces are in the order of what to do about them: one below may fall more often than one above)
    least = min((one.chance.value for one in every[:MOST] if not one.held), default=math.inf)
    above = [one.chance for one in every[MOST:] if not one.held and one.chance.value > least]
    if above:
        highest = max(above, key=lambda chance: chance.value)
        highest = chances_in(highest, YEARS) if yearly else highest
        most_often = about_percent(highest.value)
        first += f", of the others {len(above):,} more often than some of these (up to {most_often})"
    falling = f"falls in {YEARS:g} years" if yearly else "falls"
    ranged = [MODEL_RANGE] if ranges else []
    over = ["over branches (90 %)"] if spread else []
    headings = ("piece", "floor", "number", falling, *ranged, *over, "recommendation")
    sure = f"{confidence_text(results)} intervals of the motions{f'; {of_what(results)}' if ranges else ''}"
    return Rows(f"Each piece under {results['model'].values[at]} ({sure}; {code_text(results)}{first})", headings, rows)


def _ratios(results: xr.Dataset) -> Rows | None:
    """Return the medians of the first block over those of the reference, of the first laws."""
    tables = median_rows(results)
    if not tables:
        return None
    first = f"; the first {MOST} of {len(tables[0].rows)}" if len(tables[0].rows) > MOST else ""
    others = f"; {len(tables) - 1} more in the report" if len(tables) > 1 else ""
    return Rows(f"{tables[0].title}{first}{others}", tables[0].headings, tables[0].rows[:MOST])
