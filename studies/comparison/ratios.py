"""Pairs of numbers, of A and of B, with their ratio, its outcome, their tables, and the conclusions."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from ...core.aliases import Array
from ...core.facts import Fact
from ...core.units import ENDS
from ...fragility.risk.ratios import ratio_of
from ..buildings.recommendations import Range
from ..facts.say import say
from ..plan.ratios import HIGHER, LOWER, OPEN, SAME, UNKNOWN, verdict_of
from ..tables.table import Cells, Column, Row, Table, Value, footnote
from .sides import Matched

REGISTER = "comparison"
HALF, CHANCE = "half_level", "chance"
MOST_ROWS = 60
"""Most rows of a table on a terminal: those whose ratios are furthest from 1."""


MOST_RATIO = 1e4
"""Ratio beyond which an end of its interval is open: no study has runs over such a range."""


def table_of(lines: Sequence[Line], quantities: Sequence[Quantity], confidence: str) -> Table:
    """Return the table of one quantity by block or piece, or of quantities of the whole building."""
    first = quantities[0]
    names = {quantity.name for quantity in quantities}
    of_names = [line for line in lines if line.quantity in names]
    kept = of_names if first.whole else furthest(of_names, MOST_ROWS)
    several = len({line.laws for line in (lines if first.whole else of_names)}) > 1
    form = "text" if first.whole else "chance" if first.chance else "three"
    rows: list[Cells] = [
        {
            Column("name"): (
                _title(quantity) if first.whole else f"{line.name} ({line.place})" if line.place else line.name
            ),
            Column("law", "law"): pair_text(*line.laws) if several else None,
            Column("a", "A", form): _value(line.a, line.said_a, quantity),
            Column("b", "B", form): _value(line.b, line.said_b, quantity),
            Column("ratio", "B/A", "ratio3"): _open(line.ratio),
            Column("verdict", "B against A"): line.verdict or None,
        }
        for quantity in quantities
        for line in kept
        if line.quantity == quantity.name
    ]
    notes = [Fact("comparison.largest", MOST_ROWS, more={"of": len(of_names)})] if len(kept) < len(of_names) else []
    notes += [Fact("comparison.higher_level")] if first.name == HALF else []
    title = "The whole building" if first.whole else _title(first)
    return Table.of(title, rows, footnote("intervals", confidence), *(say(fact, REGISTER) for fact in notes))


def _title(quantity: Quantity) -> str:
    return f"{quantity.title} ({quantity.unit})" if quantity.unit else quantity.title


def _value(value: Range, words: str, quantity: Quantity) -> Value:
    """Return a number in the unit of the screen, or the words instead of it; text if a column holds several units."""
    if words or math.isnan(value.value):
        return words or None
    shown = Range(*(end / quantity.scale for end in value))
    form = "observed" if quantity.chance else "three"
    return Column("", format=form).text(shown) if quantity.whole else shown


def _open(ratio: Range) -> Range:
    """Return a ratio with open ends beyond the range of a study's runs."""
    low = -math.inf if ratio.lower < 1.0 / MOST_RATIO else ratio.lower
    return Range(ratio.value, low, math.inf if ratio.upper > MOST_RATIO else ratio.upper)


def furthest(lines: Sequence[Line], most: int) -> list[Line]:
    """Return at most `most` lines, with the ratios furthest from 1, in the order of the lines."""
    if len(lines) <= most:
        return list(lines)
    far = [abs(math.log(line.ratio.value)) if line.ratio.value > 0.0 else math.inf for line in lines]
    chosen = np.argsort([-x if not math.isnan(x) else 0.0 for x in far], kind="stable")[:most]
    return [lines[i] for i in sorted(chosen)]


def exported_lines(lines: Sequence[Line], quantities: Sequence[Quantity]) -> Table:
    """Return all lines as values in SI units, for a spreadsheet: a row for each quantity of each block or piece."""
    of = {quantity.name: quantity for quantity in quantities}
    columns = (
        *map(Column, ("quantity", "units", "name", "place", "law_a", "law_b")),
        *(Column(key, ends=ENDS) for key in ("a", "b", "ratio")),
        *map(Column, ("verdict", "a_is", "b_is")),
    )
    rows: list[Row] = [
        {
            **{"quantity": of[line.quantity].title, "units": of[line.quantity].stored},
            **{"name": line.name, "place": line.place, "law_a": line.laws[0], "law_b": line.laws[1]},
            **{"a": line.a, "b": line.b, "ratio": line.ratio},
            **{"verdict": line.verdict, "a_is": line.said_a, "b_is": line.said_b},
        }
        for line in lines
    ]
    return Table("Comparison", columns, rows)


ANCHORED_IN = {where: f"anchored in {where}" for where in ("A", "B", "both")}
"""Outcomes for pieces that are anchored on a side, and fall there under no motion."""


class Line(NamedTuple):
    """A number of both sides: its quantity, its block or piece, its place, the laws of A and B, values and outcome."""

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


def line_of(
    of: tuple[str, str, str, tuple[str, str]],
    values: Sequence[Range],
    samples: Sequence[Array | None],
    words: Sequence[str],
    confidence: float,
    of_runs: Sequence[float] | Array = (math.nan, math.nan),
) -> Line:
    """Return the line of two values with their ratio and its outcome; `of`: quantity, name, place and laws."""
    (a, b), (of_a, of_b) = values, samples
    ratio = Range(*ratio_of(a.value, b.value, of_a, of_b, confidence, of_runs))
    return Line(*of, a, b, ratio, verdict_of(ratio), *words)


class Quantity(NamedTuple):
    """A quantity that is compared: its key, its unit and divisor on a screen, and the unit of its values.

    `of`: values in its title, such as the years. `chance`: True for a probability, in per cent on a screen. `shown`:
    True if it is shown there. `whole`: True if it is of the whole building, and has a row in the table of the building.
    """

    name: str
    unit: str
    scale: float
    stored: str
    of: Mapping[str, Any]
    chance: bool = False
    shown: bool = True
    whole: bool = False

    @property
    def title(self) -> str:
        """The title on a screen and in a file."""
        return say(Fact("comparison.quantity", names=(self.name,), more=self.of), REGISTER)


class Found(NamedTuple):
    """All results of a comparison: labels matched by dimension, lines, and their quantities."""

    matched: dict[str, Matched]
    lines: list[Line]
    quantities: list[Quantity]
    notes: list[Fact]


KINDS = (HIGHER, LOWER), (OPEN,), (SAME,), (UNKNOWN,)
"""Outcomes that a legend explains together; outcomes for anchored pieces come before them."""


def answer(lines: Sequence[Line], quantities: Sequence[Quantity], dim: str) -> Iterator[Fact]:
    """Yield the number of lines with each outcome; equal numbers of laws, and quantities of all lines, are one fact."""
    laws = len({line.laws for line in lines})
    groups: dict[tuple[str, int, int, tuple[str, ...], str], list[Quantity]] = {}
    for quantity in quantities:
        verdicts: dict[str, list[str]] = {}
        for line in lines:
            if line.quantity == quantity.name:
                verdicts.setdefault(pair_text(*line.laws), []).append(line.verdict)
        for verdict in (*ANCHORED_IN.values(), *(word for kind in KINDS for word in kind)):
            numbers = {law: (words.count(verdict), len(words)) for law, words in verdicts.items() if verdict in words}
            for number, of in dict.fromkeys(numbers.values()):
                under = tuple(law for law in numbers if numbers[law] == (number, of))
                # (quantities share a sentence only if they agree on every line)
                key = verdict, number, of, under, "" if number == of else quantity.name
                groups.setdefault(key, []).append(quantity)
    for (verdict, number, of, under, _), alike in groups.items():
        more = {**alike[0].of, "dim": dim, "of": of, "under": under, "laws": laws}
        names = tuple(quantity.name for quantity in alike)
        yield Fact("comparison.answer", number, names=names, word=verdict, more=more)


def legend(lines: Sequence[Line]) -> Iterator[Fact]:
    """Yield the meaning of each outcome that occurs."""
    for kind in (tuple(ANCHORED_IN.values()), *KINDS):
        words = tuple(word for word in kind if any(line.verdict == word for line in lines))
        if words:
            yield Fact("comparison.legend", names=words)


def pair_text(of_a: str, of_b: str) -> str:
    """Return the name that both sides have, or the names in A and in B."""
    return of_a if of_a == of_b else f"{of_a} → {of_b}"
