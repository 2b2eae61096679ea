"""Pairs of numbers, of A and of B, with their ratio, the verdict on it, and their tables."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ...core.wording import about_percent, chances_between, interval_text, ratio_text, three_digits
from ..buildings.recommendations import Range
from ..tables.values import ValueTable, known
from ..text.rows import Rows
from .sides import Matched

MOST_ROWS = 60
"""Most rows of a table on a terminal: those whose ratios are furthest from 1."""


MOST_RATIO = 1e4
"""Ratio beyond which an end of its interval is open: no study has runs over such a range."""
SIDES = ("A", "B", "B/A", "B against A")


def rows_of(lines: Sequence[Line], quantity: Quantity, confidence: str) -> Rows:
    """Return the table of one quantity."""
    own = [line for line in lines if line.quantity == quantity.name]
    kept = furthest(own, MOST_ROWS)
    laws = len({line.laws for line in own}) > 1
    headings = ("", *(["law"] if laws else []), *SIDES)
    rows = []
    for line in kept:
        name = f"{line.name} ({line.place})" if line.place else line.name
        rows.append((name, *([law_text(line.laws)] if laws else []), *_cells(line, quantity)))
    first = f"; the {MOST_ROWS} of {len(own):,} with the largest changes" if len(kept) < len(own) else ""
    unit = f" ({quantity.unit})" if quantity.unit else ""
    reading = f"; {quantity.reading}" if quantity.reading else ""
    return Rows(f"{quantity.title}{unit} with {confidence} intervals{reading}{first}", headings, rows)


def whole_rows(lines: Sequence[Line], quantities: Sequence[Quantity], confidence: str) -> Rows:
    """Return the table of quantities of the whole building, a row each."""
    laws = len({line.laws for line in lines}) > 1
    rows = []
    for quantity in quantities:
        name = f"{quantity.title} ({quantity.unit})" if quantity.unit else quantity.title
        for line in lines:
            if line.quantity == quantity.name:
                rows.append((name, *([law_text(line.laws)] if laws else []), *_cells(line, quantity)))
    headings = ("", *(["law"] if laws else []), *SIDES)
    return Rows(f"The whole building with {confidence} intervals", headings, rows)


def furthest(lines: Sequence[Line], most: int) -> list[Line]:
    """Return at most so many lines, those whose ratios are furthest from 1, in the order of the lines."""
    if len(lines) <= most:
        return list(lines)
    far = [abs(math.log(line.ratio.value)) if line.ratio.value > 0.0 else math.inf for line in lines]
    chosen = np.argsort([-x if not math.isnan(x) else 0.0 for x in far], kind="stable")[:most]
    return [lines[i] for i in sorted(chosen)]


def value_table(lines: Sequence[Line], quantities: Sequence[Quantity]) -> ValueTable:
    """Return all lines as values in SI units, for a spreadsheet: a row for each quantity of each block or piece."""
    units = {one.name: one.stored for one in quantities}
    titles = {one.name: one.title for one in quantities}
    ends = ("", "_lower", "_upper")
    headings = ["quantity", "units", "name", "place", "law_a", "law_b"]
    headings += [f"{side}{end}" for side in ("a", "b", "ratio") for end in ends]
    headings += ["verdict", "a_is", "b_is"]
    rows = []
    for line in lines:
        numbers = [known(float(x)) for value in (line.a, line.b, line.ratio) for x in value]
        head = [titles[line.quantity], units[line.quantity], line.name, line.place, *line.laws]
        rows.append([*head, *numbers, line.verdict, line.said_a, line.said_b])
    return ValueTable(headings, rows)


def _cells(line: Line, quantity: Quantity) -> tuple[str, str, str, str]:
    a, b = _cell(line.a, line.said_a, quantity), _cell(line.b, line.said_b, quantity)
    value, low, high = line.ratio
    low, high = 0.0 if low < 1.0 / MOST_RATIO else low, math.inf if high > MOST_RATIO else high
    ratio = "–" if math.isnan(value) else ratio_text(value, low or -math.inf, high, digits=3)
    return a, b, ratio, line.verdict or "–"


def _cell(value: Range, said: str, quantity: Quantity) -> str:
    if said or math.isnan(value.value):
        return said or "–"
    if quantity.chance:
        ends = "" if math.isnan(value.lower) else f" ({chances_between(value.lower, value.upper, about_percent)})"
        return f"{about_percent(value.value)}{ends}".replace("\u00a0%)", ")")
    shown = [one / quantity.scale for one in value]
    ends = "" if math.isnan(shown[1]) else f" ({interval_text(shown[1], shown[2])})"
    return f"{three_digits(shown[0])}{ends}"


ANCHORED_IN = {where: f"anchored in {where}" for where in ("A", "B", "both")}
"""Verdicts on pieces that are anchored on a side, and fall there under no motion."""
NONE = Range(math.nan, math.nan, math.nan)


class Line(NamedTuple):
    """A number of both sides: what it is of (block or piece, its place, the laws of A and B), values and verdict."""

    quantity: str
    name: str
    place: str
    laws: tuple[str, str]
    a: Range
    b: Range
    ratio: Range
    verdict: str
    said_a: str = ""
    said_b: str = ""


class Quantity(NamedTuple):
    """A quantity that is compared: its key, its title, unit and divisor on a screen, and the unit of its values.

    `chance`: it is a probability, in per cent on a screen; `shown`: it is shown there; `reading`: what a higher value
    means, in words; `whole`: it is of the whole building, and has a row in the table of the building.
    """

    name: str
    title: str
    unit: str
    scale: float
    stored: str
    chance: bool = False
    shown: bool = True
    reading: str = ""
    whole: bool = False


class Found(NamedTuple):
    """All that was compared: the blocks or pieces and the laws that were matched, the lines, and what they are of."""

    names: Matched
    laws: Matched
    lines: list[Line]
    quantities: list[Quantity]
    notes: list[str]


def law_text(laws: tuple[str, str]) -> str:
    """Return the law of both sides, or the law of A and that of B."""
    return laws[0] if laws[0] == laws[1] else f"{laws[0]} → {laws[1]}"
