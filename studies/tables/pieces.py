"""The table of the pieces of a building: how likely each falls, what anchoring it costs and saves, and what to do."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import xarray as xr

from ...fragility.hazard.rates import probability_in
from ...wording import about_percent, chances_between, confidence_text, currency_of, short_digits, two_digits
from ..buildings.pieces import ANCHORED, SHARES, YEARS, Piece, Range, pieces_of
from ..text.rows import Rows
from ..text.words import display_unit, floor_name, level_text

EACH_PIECE = "Each piece"
"""Beginning of the title."""
UNCHECKED = "code requirements not checked"
COLUMNS = {
    "item": "",
    "room": "",
    "floor": "",
    "pieces": "",
    "chance_in_a_year": "1",
    "chance_in_a_year_lower": "1",
    "chance_in_a_year_upper": "1",
    "chance_in_50_years": "1",
    "chance_in_50_years_lower": "1",
    "chance_in_50_years_upper": "1",
    "probability_at_level": "1",
    "probability_at_level_lower": "1",
    "probability_at_level_upper": "1",
    "level_at_10_percent": "level",
    "level_at_50_percent": "level",
    "consequences": "",
    "value": "money",
    "anchoring_cost": "money",
    "saving_a_year": "money a year",
    "saving_a_year_lower": "money a year",
    "saving_a_year_upper": "money a year",
    "payback": "year",
    "recommendation": "",
}
"""Columns of the table in a file, and the kind of their units."""


def piece_rows(results: xr.Dataset, model: int = 0) -> Rows:
    """Return the table of the pieces under one law, for a terminal or a report."""
    pieces = pieces_of(results, model)
    yearly = "item_rate" in results
    rooms = any(one.room for one in pieces)
    meant = any(one.consequences for one in pieces)
    valued = any(one.value > 0.0 for one in pieces)
    priced = any(math.isfinite(one.cost) for one in pieces)
    pays = any(math.isfinite(one.payback) for one in pieces)
    scale, unit = display_unit(results["level"])
    name, several = str(results.attrs["im"]), results.sizes["level"] > 1
    measure = f"{name.upper() if name.startswith('pg') else name}{f', {unit}' if unit else ''}"
    headings = ["piece", *(["room"] if rooms else []), "floor", "number"]
    headings += ["falls in a year", f"in {YEARS:g} years"] if yearly else ["falls"]
    headings.append("recommendation")
    headings += [f"{' / '.join(f'{100.0 * share:g}' for share in SHARES)} % fall at {measure}"] if several else []
    headings += ["if it falls"] if meant else []
    headings += ["value of one"] if valued else []
    headings += ["anchoring one costs"] if priced else []
    headings += ["pays back, years"] if pays else []
    rows = []
    for one in pieces:
        held = one.recommendation == ANCHORED
        cells = [one.item, *([one.room] if rooms else []), floor_name(one.floor).removeprefix("floor ")]
        cells.append(f"{one.number:,}")
        chances: list[Range | float] = [one.chance]
        if yearly:
            chances = [in_years(one.chance, 1.0).value, in_years(one.chance, YEARS)]
        cells += ["–" if held else _chance(chance) for chance in chances]
        cells.append(one.recommendation)
        if several:
            at = [_level(level, results["level"], scale) for level in one.levels]
            cells.append("–" if held else at[0] if at[0] == at[1] else " / ".join(at))
        cells += [", ".join(one.consequences) or "–"] if meant else []
        cells += [short_digits(one.value) if one.value > 0.0 else "–"] if valued else []
        cells += [short_digits(one.cost) if math.isfinite(one.cost) else "–"] if priced else []
        cells += [two_digits(one.payback) if math.isfinite(one.payback) else "–"] if pays else []
        rows.append(tuple(cells))
    when = (
        ""
        if yearly or not several
        else f" at {name} = {level_text(float(results.attrs['at_level']), results['level'])}"
    )
    money = currency_of(results)
    said = [
        f"{confidence_text(results)} over motions",
        *([f"values in {money}"] if money and (valued or priced) else []),
    ]
    return Rows(f"{EACH_PIECE}{when} ({', '.join([*said, UNCHECKED])})", tuple(headings), rows)


Cell = str | float | int | None


class PieceTable(NamedTuple):
    """Headings with units, and rows of values (None: not known)."""

    headings: list[str]
    rows: list[list[Cell]]


def piece_table(results: xr.Dataset, model: int = 0) -> PieceTable:
    """Return the pieces under one law as values, for a spreadsheet.

    Levels and money are in the units of the results (SI; the inventory's currency); levels beyond those that were run
    are None.
    """
    level = str(results["level"].attrs.get("units", "1"))
    money = currency_of(results)
    units = {
        "": "",
        "1": "1",
        "level": level,
        "money": money,
        "money a year": f"{money}/year" if money else "",
        "year": "years",
    }
    yearly = "item_rate" in results
    kept = [name for name in COLUMNS if not name.startswith("probability_at" if yearly else "chance_in")]
    headings = [f"{name} ({units[COLUMNS[name]]})" if units[COLUMNS[name]] else name for name in kept]
    every = [_values(one, yearly) for one in pieces_of(results, model)]
    return PieceTable(headings, [[_known(one[name]) for name in kept] for one in every])


def in_years(rate: Range, years: float) -> Range:
    """Return the probabilities of at least one fall in so many years."""
    return Range(*(float(probability_in(np.float64(one), years)) for one in rate))


def _values(one: Piece, yearly: bool) -> dict[str, str | float | int]:
    found: dict[str, str | float | int] = {
        "item": one.item,
        "room": one.room,
        "floor": one.floor,
        "pieces": one.number,
        "level_at_10_percent": one.levels[0] or math.nan,
        "level_at_50_percent": one.levels[1] or math.nan,
        "consequences": ", ".join(one.consequences),
        "value": one.value,
        "anchoring_cost": one.cost,
        "payback": one.payback,
        "recommendation": one.recommendation,
    }
    ranges = {"saving_a_year": one.saving}
    if one.recommendation == ANCHORED or (one.chance.value == 0.0 and math.isnan(one.chance.upper)):
        one = one._replace(chance=Range(math.nan, math.nan, math.nan))  # (held, or never seen to fall)
    if yearly:
        ranges |= {"chance_in_a_year": in_years(one.chance, 1.0), "chance_in_50_years": in_years(one.chance, YEARS)}
    else:
        ranges["probability_at_level"] = one.chance
    for name, each in ranges.items():
        found |= {f"{name}{end}": value for end, value in zip(("", "_lower", "_upper"), each, strict=True)}
    return found


def _known(value: str | float | int) -> Cell:
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _chance(chance: Range | float) -> str:
    if isinstance(chance, float):
        return about_percent(chance) if chance > 0.0 else "never seen"
    if chance.value == 0.0:
        return "never seen"
    ends = "" if math.isnan(chance.lower) else f" ({chances_between(chance.lower, chance.upper, about_percent)})"
    return f"{about_percent(chance.value)}{ends}".replace("\u00a0%)", ")")


def _level(level: float, axis: xr.DataArray, scale: float) -> str:
    if level == 0.0:
        return f"below {two_digits(float(axis.min()) / scale)}"
    if math.isinf(level):
        return f"above {two_digits(float(axis.max()) / scale)}"
    return two_digits(level / scale)
