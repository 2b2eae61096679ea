"""Tables of values with units in their headings, for spreadsheets."""

from __future__ import annotations

import math
from typing import NamedTuple

Cell = str | float | int | None


class ValueTable(NamedTuple):
    """Headings with units, and rows of values (None: not known)."""

    headings: list[str]
    rows: list[list[Cell]]


def known(value: str | float | int) -> Cell:
    """Return a value, None in place of a number that is not finite."""
    return None if isinstance(value, float) and not math.isfinite(value) else value


def with_units(name: str, units: str) -> str:
    """Return a name with its units, if it has any."""
    return f"{name} ({units})" if units else name
