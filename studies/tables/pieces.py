"""The table of the pieces of a building: how likely each falls, what anchoring it costs and saves, and what to do."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import xarray as xr

from ...core.wording import (
    about_percent,
    chances_between,
    confidence_text,
    currency_of,
    given_number,
    given_percent,
    three_digits,
    two_digits,
)
from ...fragility.hazard.rates import probability_in
from ...fragility.risk.modelling import LOWER, UPPER
from ..buildings.pieces import SHARES, pieces_of
from ..buildings.recommendations import UNKNOWN, UNRESOLVED, YEARS, Piece, Range
from ..buildings.sliding import GATED_RATE, ITEM_TRIP_RATE, OFF, OFF_RATE, OVERTURNING, OVERTURNING_RATE
from ..buildings.variables import RUPTURE
from ..plan.slides import GATED, INSTEAD, TRIP, TRIP_DISTANCE
from ..text.rows import Rows
from ..text.spread import MODEL_RANGE, NOT_GIVEN, OUTER, model_range, of_what
from ..text.words import consequence_name, display_unit, floor_cell, level_name, level_text, roof_of
from .assessment import drawn_heading, span
from .unseen import at_most, most_rate
from .values import ValueTable, known, of_kind, with_ends, with_units

OVER_BRANCHES = (
    "chances: means and 90 % ranges over all stated uncertainties; all else: one law, one set of motions and one "
    "hazard curve"
)
UNCHECKED = "code requirements not checked"
CODE = "Code requirements"
"""Beginning of the title of what a building code says of each piece."""
MOST_ROWS = 60
"""Most pieces that a table in a terminal or a report shows."""
COLUMNS = {
    **of_kind("", "item", "room", "floor", "pieces", "anchored_with", "damping_law"),
    **with_ends("1", "chance_in_a_year", "chance_in_50_years"),
    **of_kind("1", *(f"chance_in_50_years{end}" for end in (LOWER, UPPER))),
    **of_kind("1", *(f"chance_in_50_years_over_branches{end}" for end in ("", "_5_percent", "_95_percent"))),
    "level": "level",
    **with_ends("1", "probability_at_level"),
    **of_kind("1", *(f"probability_at_level{end}" for end in (LOWER, UPPER))),
    "contact": "",
    **of_kind("1", "friction", "slides_instead"),
    **with_ends("1", "sliding_off_in_50_years", "sliding_off_at_level"),
    "trip_distance": "metre",
    **with_ends("1", "tripping_in_50_years", "tripping_at_level"),
    **with_ends("1", "overturning_alone_in_50_years", "overturning_alone_at_level"),
    **with_ends("1", "overturning_where_it_rocks_in_50_years", "overturning_where_it_rocks_at_level"),
    **of_kind("level", "level_at_10_percent", "level_at_50_percent"),
    "consequences": "",
    **of_kind("money", "value", "anchoring_cost", "anchoring_cost_of_all"),
    **with_ends("money a year", "saving_a_year"),
    "payback": "year",
    **with_ends("days a year", "downtime_of_one_a_year"),
    **with_ends("persons a year", "injured_a_year"),
    **of_kind("", "recommendation", "kit", "within_budget", "code", "code_clause", "code_factors"),
    **of_kind("newton", "code_force", "code_anchor_force"),
    "code_demand_over_strength": "1",
}
"""Columns of the table in a file, and the kind of their units."""
SLIDING = {
    "sliding_off": (OFF, OFF_RATE),
    "tripping": (TRIP, ITEM_TRIP_RATE),
    "overturning_alone": (OVERTURNING, OVERTURNING_RATE),
    "overturning_where_it_rocks": (GATED, GATED_RATE),
}
"""Chances of what sliding changes, by the beginning of their columns: at a level, and annual rates."""


def piece_rows(results: xr.Dataset, model: int = 0, branches: bool = False) -> Rows:
    """Return the table of the pieces under one law; with `branches` chances are means and ranges over them."""
    pieces = pieces_of(results, model)
    spread = over_branches(results) if branches else {}
    yearly = "item_rate" in results
    rooms = any(one.room for one in pieces)
    meant = any(one.consequences for one in pieces)
    valued = any(one.value > 0.0 for one in pieces)
    priced = any(math.isfinite(one.cost) for one in pieces)
    pays = any(not math.isnan(one.payback) for one in pieces)
    tried = any(one.tried for one in pieces)
    most = at_most(results)
    bounds = [at_most(results, 1.0), most] if yearly else [most]
    coded = any(one.code is not None for one in pieces)
    spent = any(one.chosen is not None for one in pieces)
    kits = any(one.kit for one in pieces)
    budget = float(results.attrs.get("budget", math.nan))
    money = currency_of(results)
    scale, unit = display_unit(results["level"])
    label, several = level_name(results), results.sizes["level"] > 1
    headings = ["piece", *(["room"] if rooms else []), "floor", "number", *(["held by"] if kits else [])]
    # (a chance is that of each of the pieces of a line)
    headings += ["chance of falling in a year, each", f"in {YEARS:g} years"] if yearly else ["chance of falling, each"]
    ranges = model_ranges(results, model)
    headings += [f"{MODEL_RANGE} of this chance"] if ranges else []
    breaking = _breaks(results, model) if kits else {}
    headings += [f"its kit breaks in {YEARS:g} years" if yearly else "its kit breaks"] if breaking else []
    headings.append("recommendation")
    headings += ["with kit"] if tried else []
    headings += ["code"] if coded else []
    headings += [f"with a budget of {given_number(budget)} {money}".rstrip()] if spent else []
    shares = " / ".join(f"{100.0 * share:g}" for share in SHARES)
    headings += [f"{label} at which {shares} % fall{f', {unit}' if unit else ''}"] if several else []
    headings += ["consequence"] if meant else []
    headings += ["mean cost, each" if "cost_median" in results.coords else "value, each"] if valued else []
    headings += ["anchoring, each"] if priced else []
    headings += [f"payback, years{at_rate(pieces)}"] if pays else []
    amounts = _annual_amounts(results)
    headings += [heading for heading, _ in amounts.values()]
    rows, roof = [], roof_of(results)
    for one in pieces[:MOST_ROWS]:
        held = one.held
        cells = [one.item, *([one.room] if rooms else []), floor_cell(one.floor, roof)]
        cells.append(f"{one.number:,}")
        cells += [one.kit or "–"] if kits else []
        chances: list[Range | float] = [one.chance]
        if yearly:
            rate = spread.get(one.item, one.chance)
            chances = [in_years(rate, 1.0).value, in_years(rate, YEARS)]
        cells += ["–" if held else chance_cell(chance, text) for chance, text in zip(chances, bounds, strict=True)]
        cells += ["–" if held else ranges.get(one.item, NOT_GIVEN)] if ranges else []
        cells += [chance_cell(breaking[one.item], most) if one.item in breaking else "–"] if breaking else []
        cells.append(one.recommendation)
        cells += ["–" if one.meant is None or one.held else one.meant.kit] if tried else []
        cells += ["–" if one.code is None else one.code.status] if coded else []
        cells += ["anchor" if one.chosen else "–"] if spent else []
        if several:
            at = [_level(level, results["level"], scale) for level in one.levels]
            cells.append("–" if held else at[0] if at[0] == at[1] else " / ".join(at))
        cells += [", ".join(map(consequence_name, one.consequences)) or "–"] if meant else []
        mean = "cost_median" in results.coords and bool(results["cost_median"].sel(item=one.item).notnull())
        write = two_digits if mean else given_number  # (a mean is computed, a value is as it was given)
        cells += [write(one.value) if one.value > 0.0 else "–"] if valued else []
        cells += [given_number(one.cost) if math.isfinite(one.cost) else "–"] if priced else []
        best = one.payback_best if one.recommendation == UNRESOLVED else math.nan
        cells += [payback_text(one.payback, best)] if pays else []
        cells += ["–" if held else _amount(years * getattr(one, name).value) for name, (_, years) in amounts.items()]
        rows.append(tuple(cells))
    when = (
        ""
        if yearly or not several
        else f" at {label} = {level_text(float(results.attrs['at_level']), results['level'])}"
    )
    said = [
        OVER_BRANCHES if spread else f"{confidence_text(results)} intervals",
        *([f"values in {money}"] if money and (valued or priced) else []),
    ]
    said += [of_what(results)] if ranges else []
    said += _first(len(pieces))
    return Rows(f"Each piece{when} ({', '.join([*said, code_text(results)])})", tuple(headings), rows)


def code_text(results: xr.Dataset) -> str:
    """Return which building code was checked, or that none was."""
    return f"code: {results.attrs['code']}" if "code" in results.attrs else UNCHECKED


def code_rows(results: xr.Dataset) -> Rows | None:
    """Return what the building code says of each piece, with the design forces; None where the study names no code."""
    if "code" not in results.attrs:
        return None
    forces = ("force / weight", "force, N", "anchor force, N", "demand / strength")
    headings = ("piece", "floor", "code says", "by clause", *forces)
    rows = []
    pieces = pieces_of(results)
    for one in pieces[:MOST_ROWS]:
        found = one.code
        assert found is not None  # (the study names a code)
        numbers = (found.coefficient, found.force, found.demand)
        texts = [three_digits(value) if math.isfinite(value) else "–" for value in numbers]
        ratio = two_digits(found.ratio) if math.isfinite(found.ratio) else "–"
        missing = found.factors if math.isnan(found.coefficient) else ""
        clause = "; ".join(filter(None, (found.clause, missing)))
        rows.append((one.item, floor_cell(one.floor), found.status, clause, *texts, ratio))
    about = "; ".join([str(results.attrs["code"]), str(results.attrs["code_site"]), *_first(len(pieces))])
    title = (
        f"{CODE} ({about}; forces on one piece; the horizontal force on its anchors follows from moments about the "
        "base where their height is given, and is else the whole force; neither the share of the base nor the fixing "
        "of the anchors to the building is checked)"
    )
    return Rows(title, headings, rows)


def piece_table(results: xr.Dataset, model: int = 0, readable: bool = False) -> ValueTable:
    """Return the pieces under one law as values in SI, or for people (`readable`) in the tables' units and per cent."""
    scale, level = display_unit(results["level"]) if readable else (1.0, str(results["level"].attrs.get("units", "1")))
    money = currency_of(results)
    units = {
        "": "",
        "1": "" if readable else "1",
        "level": level,
        "money": money,
        "money a year": f"{money}/year" if money else "",
        "year": "years",
        "days a year": "days/year",
        "persons a year": "1/year",
        "newton": "N",
        "metre": "m",
    }
    yearly = "item_rate" in results
    left = [name for name in COLUMNS if name.startswith("probability_at" if yearly else "chance_in")]
    left += ["level"] if yearly else []
    left += [] if "branch" in results.dims else [name for name in COLUMNS if "over_branches" in name]
    ranged = f"{'item_rate' if yearly else 'probability'}{LOWER}" in results
    left += [] if ranged else [name for name in COLUMNS if "_modelling_" in name]
    left += [] if "code" in results.attrs else [name for name in COLUMNS if name.startswith("code")]
    for name, quantity in (("downtime", "downtime"), ("injured", "injuries")):
        if f"item_annual_{quantity}" not in results:
            left += [column for column in COLUMNS if column.startswith(name)]
    left += [] if "budget_chosen" in results else ["within_budget"]
    left += [] if "kit_falls" in results else ["kit"]
    left += [] if "anchored_with" in results.coords else ["anchored_with"]
    left += [name for name in ("contact", "friction", TRIP_DISTANCE) if name not in results.coords]
    left += [] if INSTEAD in results else [INSTEAD]
    for name, variables in SLIDING.items():
        last = "_at_level" if yearly else "_in_50_years"
        left += [one for one in COLUMNS if one.startswith(name) and (last in one or variables[0] not in results)]
    kept = [name for name in COLUMNS if name not in left]
    headings = [with_units(name, units[COLUMNS[name]]) for name in kept]
    of_all: dict[str, str | float | int] = {
        "damping_law": str(results["model"].values[model]),
        "level": math.nan if yearly else float(results.attrs["at_level"]),
    }
    spread = over_branches(results)
    bound = most_rate(results) if yearly else math.nan
    every = [of_all | _values(one, yearly, spread.get(one.item), bound) for one in pieces_of(results, model)]
    beside = _beside(results, model)
    every = [one | beside[str(one["item"])] for one in every]
    rows = [[known(_divided(one[name], scale if COLUMNS[name] == "level" else 1.0)) for name in kept] for one in every]
    return ValueTable(headings, rows)


def _beside(results: xr.Dataset, model: int) -> dict[str, dict[str, str | float | int]]:
    """Return what is known of the sliding of each item, and its chance if all capacities are off, by column."""
    here = results.isel(model=model)
    yearly = "item_rate" in results
    items = [str(item) for item in results["item"].values]
    found: dict[str, dict[str, str | float | int]] = {item: {} for item in items}
    for name in ("contact", "friction", INSTEAD, TRIP_DISTANCE):
        for item, value in zip(items, here[name].values.tolist() if name in here else [], strict=False):
            found[item][name] = value
    chances = [(name, *pair, end) for name, pair in SLIDING.items() for end in ("", "_lower", "_upper")]
    chances += [("chance" if yearly else "probability", "probability", "item_rate", end) for end in (LOWER, UPPER)]
    for name, chance, rate, end in chances:
        if f"{rate if yearly else chance}{end}" not in here:
            continue
        if yearly:
            values, column = probability_in(here[f"{rate}{end}"].clip(0.0), YEARS).values, f"{name}_in_50_years{end}"
        else:
            level = float(results.attrs["at_level"])
            values, column = here[f"{chance}{end}"].sel(level=level).values, f"{name}_at_level{end}"
        for item, value in zip(items, values.tolist(), strict=True):
            found[item][column] = value
    for columns in found.values():  # (no range is known of what never fell)
        if columns.get(f"{'chance_in_50_years' if yearly else 'probability_at_level'}{UPPER}") == 0.0:
            columns |= {column: math.nan for column in columns if column.endswith((LOWER, UPPER))}
    return found


def _divided(value: str | float | int, scale: float) -> str | float | int:
    return value / scale if isinstance(value, float) and scale != 1.0 else value


def _breaks(results: xr.Dataset, model: int) -> dict[str, Range]:
    """Return how likely the kits of pieces break in `YEARS`, or at the level, by item; empty where nothing says so."""
    yearly = "item_rate" in results
    name = f"item_{RUPTURE.name}_rate" if yearly else f"{RUPTURE.name}_probability"
    if name not in results:
        return {}
    here = results[[f"{name}{end}" for end in ("", "_lower", "_upper")]].isel(model=model)
    here = here if yearly else here.sel(level=float(results.attrs["at_level"]))
    values = {
        str(item): Range(*map(float, each))
        for item, *each in zip(here["item"].values, *(one.values for one in here.data_vars.values()), strict=True)
    }
    known = {item: one for item, one in values.items() if not math.isnan(one.value)}
    return {item: in_years(one, YEARS) for item, one in known.items()} if yearly else known


def model_ranges(results: xr.Dataset, model: int) -> dict[str, str]:
    """Return the model ranges of the chances that pieces fall, in `YEARS` or at the level, by item."""
    yearly = "item_rate" in results
    name = "epistemic_item_rate" if "epistemic_item_rate" in results else "item_rate" if yearly else "probability"
    here = results[[f"{name}{end}" for end in (LOWER, UPPER) if f"{name}{end}" in results]]
    if not here:
        return {}
    here = here.isel(model=model) if "model" in here.dims else here
    here = here.clip(0.0).map(probability_in, args=(YEARS,)) if yearly else here.sel(level=results.attrs["at_level"])
    texts = {str(item): model_range(here.sel(item=item), name) for item in results["item"].values}
    return {item: text for item, text in texts.items() if text}


def payback_text(years: float, best: float = math.nan) -> str:
    """Return a payback in a cell: never where the saving does not pay the cost, a dash where it is not known.

    `best`: the payback of the upper end of the saving's interval, where that decides; it stands beside a payback that
    the saving itself never reaches.
    """
    if math.isinf(years) and math.isfinite(best):
        return f"never; {two_digits(best)} at best"
    return "–" if math.isnan(years) else "never" if math.isinf(years) else two_digits(years)


def at_rate(pieces: Sequence[Piece]) -> str:
    """Return the clause on the discount rate of paybacks, in a heading."""
    rates = {one.discount for one in pieces}
    return "".join(f" (at {given_percent(rate)} a year)" for rate in rates)


def over_branches(results: xr.Dataset) -> dict[str, Range]:
    """Return the mean rate of each piece over all branches with its 5 and 95 % fractiles; empty without branches."""
    if "epistemic_item_rate" not in results:
        return {}
    ends = results["epistemic_item_rate_fractile"].sel(epistemic_fractile=list(OUTER)).values
    rates = zip(results["epistemic_item_rate"].values.tolist(), ends.tolist(), strict=True)
    return {str(item): Range(mean, *pair) for item, (mean, pair) in zip(results["item"].values, rates, strict=True)}


def in_years(rate: Range, years: float) -> Range:
    """Return the probabilities of at least one fall in so many years."""
    return Range(*(float(probability_in(np.float64(one), years)) for one in rate))


def _values(one: Piece, yearly: bool, spread: Range | None, bound: float) -> dict[str, str | float | int]:
    """Return the values of a piece by column; bound: the largest rate of what no motion showed, 1/year."""
    found: dict[str, str | float | int] = {
        "item": one.item,
        "room": one.room,
        "floor": int(one.floor) if one.floor.isdecimal() else one.floor,
        "pieces": one.number,
        "anchored_with": one.kit,
        "level_at_10_percent": one.levels[0] or math.nan,
        "level_at_50_percent": one.levels[1] or math.nan,
        "consequences": ", ".join(one.consequences),
        "value": one.value,
        "anchoring_cost": one.cost,
        "anchoring_cost_of_all": one.number * one.cost,
        "payback": one.payback,
        "recommendation": one.recommendation,
        "kit": "" if one.meant is None or one.held else one.meant.kit,
        "within_budget": "" if one.held else "yes" if one.chosen else "no",
    }
    if spread is not None:
        known_rate = spread if not one.held and spread.value > 0.0 else Range(*[math.nan] * 3)
        name = "chance_in_50_years_over_branches"
        ends = ("", "_5_percent", "_95_percent")
        found |= {f"{name}{end}": value for end, value in zip(ends, in_years(known_rate, YEARS), strict=True)}
    if one.code is not None:
        found |= {
            "code": one.code.status,
            "code_clause": one.code.clause,
            "code_factors": one.code.factors,
            "code_force": one.code.force,
            "code_anchor_force": one.code.demand,
            "code_demand_over_strength": one.code.ratio,
        }
    ranges = {"saving_a_year": one.saving, "downtime_of_one_a_year": one.downtime, "injured_a_year": one.injuries}
    if one.held:
        one = one._replace(chance=UNKNOWN)
    elif one.chance.value == 0.0 and math.isnan(one.chance.upper):
        one = one._replace(chance=Range(math.nan, math.nan, bound))  # (no motion made it fall)
        ranges |= dict.fromkeys(("downtime_of_one_a_year", "injured_a_year"), UNKNOWN)
    if yearly:
        ranges |= {"chance_in_a_year": in_years(one.chance, 1.0), "chance_in_50_years": in_years(one.chance, YEARS)}
    else:
        ranges["probability_at_level"] = one.chance
    for name, each in ranges.items():
        found |= {f"{name}{end}": value for end, value in zip(("", "_lower", "_upper"), each, strict=True)}
    return found


def _annual_amounts(results: xr.Dataset) -> dict[str, tuple[str, float]]:
    """Return the headings of what a line costs, is out of use and injures, where it is drawn, and of how many years."""
    found = {}
    if "cost_median" in results.coords and "item_annual_loss" in results:
        found["saving"] = ("lost a year, all", 1.0)
    for name, which in (("downtime", "each"), ("injuries", "all")):
        if f"item_annual_{name}" in results:
            years, words = span(results[f"item_annual_{name}"])
            found[name] = (f"{drawn_heading(name, words)}, {which}", years)
    return found


def _amount(value: float) -> str:
    return two_digits(value) if value > 0.0 else "–"


def _first(number: int) -> list[str]:
    """Return what a title says of a table that does not hold all pieces."""
    if number <= MOST_ROWS:
        return []
    return [f"the first {MOST_ROWS} of {number:,}; the exported table holds all of them"]


def chance_cell(chance: Range | float, most: str) -> str:
    """Return a chance, with its interval; `most` is the bound of what no motion showed."""
    if isinstance(chance, float):
        return about_percent(chance) if chance > 0.0 else most
    if not chance.value > 0.0:
        return most
    ends = "" if math.isnan(chance.lower) else f" ({chances_between(chance.lower, chance.upper, about_percent)})"
    return f"{about_percent(chance.value)}{ends}".replace("\u00a0%)", ")")


def _level(level: float, axis: xr.DataArray, scale: float) -> str:
    if level == 0.0:
        return f"below {two_digits(float(axis.min()) / scale)}"
    if math.isinf(level):
        return f"above {two_digits(float(axis.max()) / scale)}"
    return two_digits(level / scale)
