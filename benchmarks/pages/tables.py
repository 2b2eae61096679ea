"""Numbers, intervals and tables of pages, as Markdown."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike


class Interval(NamedTuple):
    """A value and the ends of its interval; formatted by the specification of the value, as ``0.46 (0.44–0.49)``."""

    value: float
    lower: float
    upper: float

    def __format__(self, specification: str) -> str:
        """Return the value with its interval, each by the same specification."""
        value, lower, upper = (format(end, specification) for end in self)
        return f"{value} ({lower}–{upper})"

    def times(self, factor: float) -> Interval:
        """Return the interval in another unit."""
        return Interval(*(factor * end for end in self))


def points(change: Interval, digits: int = 1) -> str:
    """Return a change of a share in percentage points."""
    value, lower, upper = (f"{100.0 * end:+.{digits}f}" for end in change)
    return minus(f"{value} ({lower} to {upper})")


def percent(value: float, digits: int = 0) -> str:
    """Return a share in per cent."""
    return minus(f"{100.0 * value:.{digits}f} %")


def span(values: ArrayLike, specification: str = ".2f", between: str = "–") -> str:
    """Return the least and the greatest of some values."""
    low, high = (format(end, specification) for end in (np.nanmin(values), np.nanmax(values)))
    return minus(low) + between + minus(high)


def per_cent(shares: ArrayLike) -> str:
    """Return a range in per cent, or its one value."""
    ends = span(100 * np.asarray(shares), ".0f").split("–")
    return "–".join(dict.fromkeys(ends)) + " %"


def minus(text: str) -> str:
    """Return a text with the sign of minus in place of hyphens."""
    return text.replace("-", "−")


def table(headings: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """Return a table."""
    head = f"| {' | '.join(headings)} |".replace("|  |", "| |")
    return "\n".join([head, "|" + "---|" * len(headings), body(rows)])


def body(rows: Iterable[Sequence[object]]) -> str:
    """Return rows of a table whose head stands in the template."""
    return "\n".join("| " + " | ".join(str(cell).replace("|", "\\|") for cell in row) + " |" for row in rows)
