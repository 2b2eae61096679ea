"""Tables of results: typed columns and rows, a short title, and a note on the numbers."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import xarray as xr

from ...core.doubts import first_of
from ...core.units import ENDS
from ...core.wording import (
    about_percent,
    about_years,
    chance_text,
    chances_between,
    confidence_text,
    estimate_text,
    given_number,
    in_years,
    interval_text,
    ratio_text,
    short_digits,
    three_digits,
    two_digits,
)
from ...fragility.fitting.states import DIRECTIONS, OVERTURNED, state_name, state_named
from ...fragility.hazard.poisson import probability_in
from ...fragility.runs.provenance import tilt_limits
from ..buildings.recommendations import Range
from ..facts.say import value_of
from ..text.block_order import chosen_of
from ..text.names import clean
from ..text.reached import BELOW, FLAT
from ..text.words import NOT_REACHED, block_title

DASH = "–"
"""Cell of a value that is not known or does not apply."""
FEWEST_ALIKE = 3
"""Fewest rows of a table in whose note the columns of one value are."""
UNBOUNDED = "(no interval)"
SHARP = 1e-3
"""Dispersion below which an end of an interval is open: the curve is a step."""


class Marked(NamedTuple):
    """A value with marks that the table's note explains."""

    value: Value
    mark: str


Value = str | float | int | Range | Marked | None
Row = dict[str, Value]


class Column(NamedTuple):
    """A column: key, title, format and unit of its values.

    `ends`: suffixes of the keys of a range's value and ends in files. `priority`: columns with higher numbers follow
    the others on narrow screens. `note`: a sentence of the table's note, if the table has the column.
    """

    key: str
    title: str = ""
    format: str = "text"
    unit: str = ""
    ends: tuple[str, ...] = ()
    priority: int = 1
    note: str = ""

    @property
    def heading(self) -> str:
        """The title with the unit."""
        return f"{self.title}, {self.unit}" if self.unit else self.title

    @property
    def numeric(self) -> bool:
        """True if the values are numbers, which are aligned to the right."""
        return self.format != "text"

    def text(self, value: Value) -> str:
        """Return a value as the text of a cell."""
        if isinstance(value, Marked):
            return f"{self.text(value.value)}\u00a0{value.mark}"
        if value is None or isinstance(value, str):
            return DASH if value is None else clean(value)
        if not isinstance(value, Range):
            return FORMATS[self.format](value, np.nan, np.nan)
        text = FORMATS[self.format](*value)
        bare = (
            self.format in ESTIMATES and 0.0 < value.value < np.inf and np.isnan(value.lower) and np.isnan(value.upper)
        )
        return f"{text} {UNBOUNDED}" if bare else text


Cells = dict[Column, Value]


@dataclass(frozen=True)
class Table:
    """A table: a noun phrase as its title, columns, rows of values by key, and a note.

    A row that is a string is the heading of the rows below it.  The note's sentence on dashes is `dash`, if there is
    any dash.
    """

    title: str
    columns: Sequence[Column]
    rows: Sequence[Row | str]
    notes: Sequence[str] = ()
    dash: str = ""

    @classmethod
    def of(cls, title: str, rows: Iterable[Cells | str], *notes: str, most: int = 0, dash: str = "") -> Table:
        """Return a table of rows by column, with the columns of which a row has a value.

        The table has at most `most` rows if that is not 0.  Headings of one row each become the first cells of their
        rows, if the rows are alike (of one law).
        """
        rows = [*rows]
        cells = [row if isinstance(row, str) else {column.key: value for column, value in row.items()} for row in rows]
        columns = list(dict.fromkeys(column for row in rows if not isinstance(row, str) for column in row))
        heads, lines = (
            [row for row in cells[::2] if isinstance(row, str)],
            [row for row in cells[1::2] if not isinstance(row, str)],
        )
        if cells and len(heads) == len(lines) == len(cells) / 2:
            first = columns[0]
            alike = {row[first.key] for row in lines}
            if len(alike) == 1:
                cells = [{**row, first.key: head} for head, row in zip(heads, lines, strict=True)]
                columns[0] = first._replace(title="")
                notes = *notes, f"{first.title.capitalize()}: {alike.pop()}."
        known = {key for row in cells if not isinstance(row, str) for key, value in row.items() if not _blank(value)}
        table = cls(title, [column for column in columns if column.key in known], cells, [*filter(None, notes)], dash)
        return table.first(most) if most else table

    @property
    def lines(self) -> list[Row]:
        """The rows without headings."""
        return [row for row in self.rows if not isinstance(row, str)]

    @property
    def groups(self) -> Iterator[tuple[str, list[list[str]]]]:
        """The heading and the cells of each group of rows; the heading of rows above all headings is ''."""
        heading, cells = "", list[list[str]]()
        for row in self.rows:
            if not isinstance(row, str):
                cells.append(self.cells(row))
                continue
            if heading or cells:
                yield heading, cells
            heading, cells = row, []
        yield clean(heading), cells

    @property
    def note(self) -> str:
        """The sentences below the table."""
        dashed = self.dash and any(DASH in cells for _, group in self.groups for cells in group)
        of_columns = dict.fromkeys(column.note for column in self.columns if column.note)
        return " ".join([*self.notes, *of_columns, *([f"{DASH}: {self.dash}."] if dashed else [])])

    def cells(self, row: Row) -> list[str]:
        """Return the texts of a row."""
        return [column.text(row.get(column.key)) for column in self.columns]

    def column(self, key: str) -> list[Value]:
        """Return the values of a column."""
        return [row.get(key) for row in self.lines]

    def texts(self, key: str) -> list[str]:
        """Return the texts of a column."""
        (column,) = (column for column in self.columns if column.key == key)
        return [column.text(value) for value in self.column(key)]

    def only(self, *keys: str) -> Table:
        """Return the table with some columns, in the order of the keys."""
        columns = {column.key: column for column in self.columns}
        return replace(self, columns=[columns[key] for key in keys if key in columns])

    def but(self, keys: Iterable[str]) -> Table:
        """Return the table without some columns."""
        left = {*keys}
        return replace(self, columns=[column for column in self.columns if column.key not in left])

    def apart(self, title: str, names: Iterable[str], keys: Iterable[str]) -> Table:
        """Return some columns after the names of the rows, as a table of their own; without columns it has no rows."""
        table = replace(self.only(*names, *keys), title=title, notes=[])
        return table if any(column.key in {*keys} for column in table.columns) else replace(table, rows=[])

    def noted(self, *sentences: str) -> Table:
        """Return the table with further sentences in its note."""
        return replace(self, notes=[*self.notes, *sentences])

    def without(self, *sentences: str) -> Table:
        """Return the table without some sentences of its note."""
        columns = [column._replace(note="" if column.note in sentences else column.note) for column in self.columns]
        return replace(self, columns=columns, notes=[note for note in self.notes if note not in sentences])

    def common(self) -> Table:
        """Return the table with columns of one value in all of its rows, three or more, as a sentence of its note."""
        if len(self.lines) < FEWEST_ALIKE:
            return self
        texts = {column: {*self.texts(column.key)} for column in self.columns[1:]}
        alike = {column: cells.pop() for column, cells in texts.items() if len(cells) == 1 and DASH not in cells}
        alike = {column: text for column, text in alike.items() if not (column.numeric and "(" in text)}
        # (words such as "not reached" have no unit)
        units = {column: column.unit if any(map(str.isdigit, text)) else "" for column, text in alike.items()}
        of = self.columns[0].title
        same = "; ".join(
            f"{text} for {of} {column.title}"  # (columns are values of e, for example)
            if of.endswith("=") and column.title[:1].isdigit()
            else f"{column.title}{':' if text in ('yes', 'no') else ''} {text} {units[column]}".rstrip()
            for column, text in alike.items()
        )
        table = self.but(column.key for column in alike)
        return replace(table, notes=[f"In all rows: {same}.", *self.notes]) if alike else self

    def grouped(self, *keys: str) -> Table:
        """Return the table with a heading for each group of rows of the same texts in columns, without the columns."""
        if not {*keys} <= {column.key for column in self.columns}:
            return self
        groups: dict[str, list[Row]] = {}
        for row in self.lines:
            groups.setdefault(", ".join(str(row.get(key)) for key in keys), []).append(row)
        rows: list[Row | str] = []
        for text, group in groups.items():
            rows += [text, *group]
        return replace(self.but(keys), rows=rows)

    def first(self, most: int) -> Table:
        """Return the table with its first lines, at most `most`."""
        number = len(self.lines)
        if number <= most:
            return self
        (last,) = (i for i, row in enumerate(self.rows) if row is self.lines[most])
        rows = self.rows[:last]
        rows = rows[:-1] if isinstance(rows[-1], str) else rows
        return replace(self, rows=rows, notes=[*self.notes, footnote("rows", most, number)])


def footnote(name: str, *values: object) -> str:
    """Return a sentence of the note of a table, filled with values."""
    return str(value_of("footnotes", "footnotes")[name].format(*values))


def _blank(value: Value) -> bool:
    """Return True for a value that a cell shows as a dash or not at all."""
    if isinstance(value, Range):
        return math.isnan(value.value) and math.isnan(value.lower)
    return value is None or value == "" or (isinstance(value, float) and math.isnan(value))


def intervals(results: xr.Dataset, rows: Iterable[Cells | str] = ()) -> str:
    """Return the sentence of a note on the intervals of a study, and the reason if any cell of some rows has none."""
    cells = [column.text(value) for row in rows if not isinstance(row, str) for column, value in row.items()]
    reason = f" {footnote('no_interval')}" if any(UNBOUNDED in cell for cell in cells) else ""
    return footnote("intervals", confidence_text(results)) + reason


def tilted(results: xr.Dataset) -> str:
    """Return the note on tilts that count as overturning; empty without any."""
    state = state_named(str(results.attrs.get("state", state_name(OVERTURNED))))
    tilts = tilt_limits(results).items() if state in (OVERTURNED, *DIRECTIONS) else ()
    limits = [f"{block_title(name)} {degrees:.3g}°" for name, degrees in tilts]
    return footnote("tilts", first_of(limits)) if limits else ""


def chosen(results: xr.Dataset) -> str:
    """Return the sentence of a note on the blocks of a table; '' if the table has all of them."""
    return footnote("blocks", chosen_of(results)) if chosen_of(results) else ""


def range_of(values: xr.Dataset, name: str, scale: float = 1.0, ends: Sequence[str] = ENDS) -> Range:
    """Return a value with the ends of its interval, divided by `scale`; NaN if the results have none."""
    return Range(*(float(values[f"{name}{end}"]) / scale if f"{name}{end}" in values else np.nan for end in ends))


def chance_in(rate: Iterable[float], years: float, least: float = -math.inf) -> Range:
    """Return the probabilities of at least one event in `years` years; rates below `least` count as `least`."""
    return Range(*(float(probability_in(np.maximum(least, end), years)) for end in rate))


def dispersion_of(values: xr.Dataset, name: str = "dispersion") -> Range | None:
    """Return a dispersion with the ends of its interval; None if the results have none."""
    return range_of(values, name) if name in values else None


def ends_of(low: float, high: float) -> Range:
    """Return a range without a value."""
    return Range(math.nan, low, high)


Write = Callable[[float], str]
Format = Callable[[float, float, float], str]


def _number(write: Write) -> Format:
    """Return the format of a number with its interval, both in the same digits."""

    def text(value: float, low: float, high: float) -> str:
        if value == 0.0 and math.isnan(low) and high > 0.0:
            return f"at most {write(high)}"  # (no run has any of it)
        bounded = not (math.isnan(low) or math.isnan(high))
        ends = interval_text(low, high, write) if bounded else ""
        if math.isnan(value):
            return write(low) if ends and write(low) == write(high) else ends or DASH
        return f"{write(value)} ({ends})" if ends else write(value)

    return text


def _chance(write: Write, *, bounded: bool = True) -> Format:
    """Return the format of a probability; if `bounded`, a value of 0 shows the upper end, as a bound."""

    def text(value: float, low: float, high: float) -> str:
        if math.isnan(value) and math.isnan(low):
            return DASH
        if bounded and value == 0.0 and high > 0.0:
            return f"at most {write(high)}"
        if math.isnan(value) and math.isnan(high):
            return f"at least {write(low)}" if low > 0.0 else DASH
        ends = "" if math.isnan(low) or math.isnan(high) or low == high else chances_between(low, high, write)
        if math.isnan(value) or ends == write(value):
            return ends
        return f"{write(value)} ({ends})".replace("\u00a0%)", ")").removesuffix(" ()")

    return text


def _share(value: float, low: float, high: float) -> str:
    """Return a share in whole per cent; a value of 0 shows the upper end, as a bound."""
    if not math.isfinite(value):  # (-inf: the share is of nothing)
        return DASH if math.isnan(value) else "more falls"
    if value == 0.0 and high > 0.0:
        return f"at most {100.0 * high:.0f}\u00a0%"
    if 0.0 < value < 0.005:
        return "below 1\u00a0%"
    number, *ends = (f"{100.0 * part:.0f}".replace("-", "−").replace("inf", "∞") for part in (value, low, high))
    between = " to " if low < 0.0 else "–"
    return f"{number}\u00a0%" if math.isnan(low) else f"{number}\u00a0% ({between.join(dict.fromkeys(ends))})"


def _level(write: Write) -> Format:
    """Return the format of a level: in words above or below all levels of the runs, if it is infinite or 0."""
    number = _number(write)

    def text(value: float, low: float, high: float) -> str:
        if value == 0.0:
            return BELOW
        if value == math.inf:
            return f"{NOT_REACHED} ({interval_text(low, high, write)})" if math.isfinite(low) else NOT_REACHED
        if write is two_digits and not math.isnan(low) and not math.isnan(value):
            return estimate_text(value, low or -math.inf, high)
        return number(value, low or -math.inf, high)

    return text


def _years(write: Write) -> Format:
    """Return the format of an annual rate as years between two events; in words if only a bound of it is known."""

    def text(rate: float, low: float, high: float) -> str:
        if rate > 0.0:
            seldom, often = 1.0 / low if low > 0.0 else math.inf, 1.0 / high if high < math.inf else -math.inf
            ends = "no width" if low == high else interval_text(often, seldom, lambda years: write(1.0 / years))
            return write(rate) if math.isnan(low) else f"{write(rate)} ({ends})"
        if rate == 0.0:
            return f"above {write(high)}" if high > 0.0 else DASH
        if not 0.0 < low < math.inf:
            return DASH
        return f"at most {write(low)}" if math.isnan(high) else f"{write(high)}–{write(low)}"

    return text


def _dispersion(value: float, low: float, high: float) -> str:
    """Return a dispersion; in words if the curve is flat over all levels."""
    if math.isnan(value):
        return DASH
    text = f"above {FLAT:g}" if value > FLAT else three_digits(value)
    ends = low if low > SHARP else -math.inf, math.inf if high > FLAT else high
    return text if math.isnan(low) else f"{text} ({interval_text(*ends)})"


FORMATS: dict[str, Format] = {
    "text": lambda value, *_: str(value),
    "count": lambda value, *_: f"{value:,.0f}",
    "two": _number(two_digits),
    "three": _number(three_digits),
    "amount": _number(three_digits),
    "short": _number(short_digits),
    "drawn": lambda value, error, _: short_digits(value) + ("" if math.isnan(error) else f" ± {short_digits(error)}"),
    "plus_minus": lambda value, error, _: DASH if math.isnan(value) else f"{value:.2f} ± {error:.2f}".replace("-", "−"),
    "whole": _number("{:.0f}".format),
    "given": _number(given_number),
    "plain": _number("{:.3g}".format),
    "times": lambda value, *_: DASH if math.isnan(value) else NOT_REACHED if value == math.inf else f"{value:.2f}",
    "thousandths": _number("{:.3f}".format),
    "tenths": lambda value, *_: f"{value:.1f}".replace("-", "−"),
    "hundredths": _number("{:.2f}".format),
    "ratio": lambda value, low, high: DASH if math.isnan(value) else ratio_text(value, low, high),
    "ratio3": lambda value, low, high: DASH if math.isnan(value) else ratio_text(value, low, high, digits=3),
    "chance": _chance(about_percent),
    "observed": _chance(about_percent, bounded=False),
    "chance3": _chance(chance_text),
    "share": _share,
    "precision": lambda value, *_: DASH if math.isnan(value) else f"±{100.0 * value:.1f}\u00a0%",
    "error": lambda value, *_: DASH if math.isnan(value) else f"±{value:.3f}",
    "signed": lambda value, *_: f"{round(100.0 * value) or 0:+d}\u00a0%".replace("-", "−").replace("+0", "0"),
    "level": _level(three_digits),
    "level2": _level(two_digits),
    "years": _years(about_years),
    "years3": _years(in_years),
    "payback": lambda value, *_: DASH if math.isnan(value) else "never" if math.isinf(value) else two_digits(value),
    "dispersion": _dispersion,
}
"""Text of a value with the ends of its interval (NaN without) by the name of its format."""
ESTIMATES = {"amount", "level", "level2", "years", "years3", "dispersion", "chance", "chance3", "share"}
"""Formats that name a missing interval."""
