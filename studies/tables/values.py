"""Tables of values with units in their headings, for spreadsheets."""

from __future__ import annotations

import csv
import io
import math
from typing import NamedTuple

from ...fragility.exchange.curve_csv import guarded

Cell = str | float | int | None


class ValueTable(NamedTuple):
    """Headings with units, and rows of values (None: not known)."""

    headings: list[str]
    rows: list[list[Cell]]


def known(value: str | float | int) -> Cell:
    """Return a value, None in place of a number that is not finite."""
    return None if isinstance(value, float) and not math.isfinite(value) else value


def of_kind(units: str, *names: str) -> dict[str, str]:
    """Return names of columns with the kind of their units."""
    return dict.fromkeys(names, units)


def with_ends(units: str, *names: str) -> dict[str, str]:
    """Return names of columns, each followed by those of the ends of its interval, with the kind of their units."""
    return {f"{name}{end}": units for name in names for end in ("", "_lower", "_upper")}


def with_units(name: str, units: str) -> str:
    """Return a name with its units, if it has any."""
    return f"{name} ({units})" if units else name


def csv_bytes(found: ValueTable) -> bytes:
    """Return a table as a CSV file; texts that a spreadsheet would take for formulas begin with an apostrophe."""
    lines = io.StringIO()
    table = csv.writer(lines, lineterminator="\n")
    table.writerow(map(guarded, found.headings))
    for row in found.rows:
        table.writerow([guarded(one) if isinstance(one, str) else one for one in row])
    return lines.getvalue().encode()
