"""Common parts of the readers of hazard files: their error, other programs' names of measures and units, and rates."""

from __future__ import annotations

import csv
import math
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ...core.aliases import Array
from ...motions.intensity.measure import Measure
from ...motions.intensity.naming import our_name, program_unit
from ...motions.readers.lines import Lines, plain
from .curve import HazardCurve, check_points, hazard_measure, unit_to_si

MOST_LEVELS = 10_000
UNNAMED = "the file names no measure"
"""Part of the source of a curve whose measure is assumed from the levels."""

INVENTED = "a comment calls the curve invented"
LARGER = "a comment names the larger of both components"
NOT_USED = "not used of a comment:"
OFF_CURVE = "off the curve:"
LOW_PERCENT = "all per cent are below 1"
RARE = "the first probability is as small as an annual rate"
"""Parts of the source of such a curve."""


QUANTITIES = {
    "rate": ("annual rates", "rates per {years:g} years"),
    "return period": ("return periods in years", "return periods in {years:g} years"),
    "probability": ("annual probabilities", "probabilities in {years:g} years"),
}
"""Kinds of quantities in the source of a curve: of one year, and of several."""


class HazardError(ValueError):
    """A hazard file that cannot be read in its format; the message names the file, the line and the value."""


class Quantity(NamedTuple):
    """Quantity of a file's numbers: a "rate" per `years`, a "return period" in units of `years`, or a "probability".

    Probabilities are in `years`, and multiples of `unit`, 0.01 for per cent.
    """

    kind: str
    years: float = 1.0
    unit: float = 1.0

    @property
    def text(self) -> str:
        """The quantity for the source of a curve."""
        per_cent = " (%)" if self.unit != 1.0 else ""
        return QUANTITIES[self.kind][self.years != 1.0].format(years=self.years) + per_cent


def row_words(lines: Lines, line: str, separator: str) -> list[str]:
    """Return the words of a row of a table."""
    try:
        words = [word.strip() for word in next(csv.reader([line], delimiter=separator, skipinitialspace=True), [])]
    except csv.Error as error:
        raise HazardError(f"{lines.file}: line {lines.number} is no row of a table ({error})") from None
    while len(words) > 1 and not words[-1]:  # (separators may end a row, too)
        words.pop()
    return words


def rate_of_word(lines: Lines, word: str, name: str, quantity: Quantity, at: int | None = None) -> float:
    """Return a number of the line read last (or of line `at`) as an annual rate; infinite for a probability of 1."""
    what = repr(name[:40])
    if quantity.kind == "return period":
        return 1.0 / (lines.value(word, what, above=0.0, at=at) * quantity.years)
    value = lines.value(word, what, at=at)
    possible = quantity.kind == "probability"
    most = 1.0 / quantity.unit if possible else math.inf
    if not 0.0 <= value <= most:
        allowed = f"between 0 and {most:g}" if possible else ">= 0"
        raise HazardError(f"{lines.file}: line {at or lines.number} gives {what} as {word[:30]!r}, must be {allowed}")
    if not possible:
        return value / quantity.years
    return math.inf if value == most else -math.log1p(-value * quantity.unit) / quantity.years


def curve_of(
    file: Path,
    im: str,
    units: str | None,
    levels: Sequence[float] | Array,
    rates: Sequence[Sequence[float] | Array] | Array,
    weights: Sequence[float] | None,
    read: Sequence[str],
    fractile: float | None = None,
) -> HazardCurve:
    """Return a curve of the points that fit on a log-log plot; its source states what was `read` and left out."""
    x, rows = np.asarray(levels, dtype=np.float64), np.asarray(rates, dtype=np.float64)
    notes = [file.name, *read, *([f"levels in {units}"] if units else [])]
    if rows.size:
        full = np.isinf(rows).any(axis=0)
        first = int(np.argmin(full)) if not full.all() else full.size
        empty = (rows == 0.0).any(axis=0)
        last = full.size - (int(np.argmin(empty[::-1])) if not empty.all() else empty.size)
        for count, what in ((first, "probability 1"), (full.size - last, "rate 0")):
            if count:
                notes.append(f"{count} level{'s' * (count > 1)} of {what} left out")
        x, rows = x[first:last], rows[:, first:last]
    if x.size < 2:
        raise HazardError(f"{file}: holds {x.size} levels with a rate between 0 and infinity, at least 2 are needed")
    try:
        # (the curve refuses levels that overflow)
        with np.errstate(over="ignore"):
            factor = unit_to_si(units, im)
            if units is not None:
                check_points(x, [*rows], units)
            x = x * factor
        source = ", ".join(plain(note, 200) for note in notes)
        if weights is None:
            return HazardCurve(x.tolist(), rows[0].tolist(), im, source, fractile=fractile)
        return HazardCurve(x.tolist(), (), im, source, rows.tolist(), weights)
    except ValueError as error:
        raise HazardError(f"{file}: {error}") from None


def measure_label(im: str | Measure) -> str:
    """Return our label of a measure from the name that we or another program use; ValueError if unknown."""
    return hazard_measure(our_name(im) if isinstance(im, str) else im).label


def program_measure(lines: Lines, text: str) -> str:
    """Return our label of a measure that a file names; HazardError if unknown."""
    try:
        return measure_label(text)
    except ValueError as error:
        raise HazardError(f"{lines.file}: {error}") from None


def unit_of_program(label: str) -> str:
    """Return the unit in which OpenQuake and USGS give the levels of a measure."""
    return program_unit(hazard_measure(label))


def agreed_measure(lines: Lines, stated: str | None, im: str | None) -> str:
    """Return the measure that the file states or the caller gives; HazardError if neither does, or they differ."""
    if stated is None and im is None:
        raise HazardError(f"{lines.file}: does not say of which measure it is: give im")
    if stated is not None and im is not None and stated != im:
        raise HazardError(f"{lines.file}: gives {stated}, but {im} is needed, the measure of the levels")
    return str(stated or im)
