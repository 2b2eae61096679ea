"""Units and quantities: what a word, a heading or a sentence in a text file says of the samples that follow it."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

from ... import checks
from ...units import STANDARD_GRAVITY
from .lines import RecordError

GAL = 0.01  # m/s²
# m/s² per unit of acceleration, by the normalised spelling of the unit.
_ACCELERATION = {"g": STANDARD_GRAVITY, "gal": GAL, "cm/s2": GAL, "mm/s2": 0.001, "m/s2": 1.0}
_OTHERS = {
    "velocity": ("m/s", "cm/s", "mm/s", "kine", "in/s", "ft/s"),
    "displacement": ("m", "cm", "mm", "ft"),
    "time": ("s", "ms", "hz"),
}
_QUANTITY = {
    "acceleration": re.compile(r"(?<![a-z-])acc(?:el(?:eration|erations|erogram)?)?(?![a-z-])", re.IGNORECASE),
    "velocity": re.compile(r"(?<![a-z-])vel(?:ocity|ocities)?(?![a-z-])", re.IGNORECASE),
    "displacement": re.compile(r"(?<![a-z-])disp(?:l|lacements?)?(?![a-z-])", re.IGNORECASE),
}
# "UNITS OF G", "units: cm/s2", "The units are (g)", "UNIT = gal(cm/s/s)", "acceleration units in m/s²"
_TOLD = re.compile(
    r"units?(?P<link>\s*(?:of\s+accelerations?\s*(?:is|are|in|[:=])?|of|is|are|[:=])|\s)\s*(?P<unit>[^\s,;]+)",
    re.IGNORECASE,
)
_IN = re.compile(r"(?<!\d)(?<!\d\s)\bin\s+(?P<unit>[^\s,;]+)", re.IGNORECASE)  # ("0.2 in g" is of another number)
_BRACKETS = re.compile(r"[\[(](?P<unit>[^\])]*)[\])]")
_SUFFIX = re.compile(r"[a-z]_(?P<unit>[cm]?m_?s-?2|gals?|[a-z]{0,9}g|ms)(?![a-z0-9])", re.IGNORECASE)
_NO_UNITS = {"the", "this", "these", "that", "each", "all", "a", "an", "time", "raw", "measure", "measurement"}


class Unit(NamedTuple):
    """A unit as it is written in a line: its quantity ('' if it is unknown), and m/s² per unit (NaN if it is none)."""

    text: str
    quantity: str
    factor: float
    line: int


def quantities(text: str) -> list[str]:
    """Return the quantities that a text names: acceleration, velocity, displacement."""
    return [quantity for quantity, word in _QUANTITY.items() if word.search(text)]


def unit_of(word: str, line: int = 0) -> Unit:
    """Return a unit in a common spelling (g, gal, cm/s², m/s^2, cm/sec/sec, m s-2, cm/s, kine, mm)."""
    text = word.strip().strip(".,;:[]").lower().replace("²", "2").replace("⁻", "-")
    text = text.strip("()") if text.startswith("(") or text.count("(") != text.count(")") else text
    text = re.sub(r"\^|\*\*|[\s_·]|\.(?=[a-z])", "", re.sub(r"sec(?:onds?)?\b|sec(?=[\d^*²])", "s", text))
    text = re.sub(r"^([cm]?m)/?\(?(?:s-?2|s\*s)\)?$|^([cm]?m)/s/s$", r"\1\2/s2", text)
    text = {"gals": "gal", "gs": "g"}.get(text, text)
    if len(word) <= 40 and text in _ACCELERATION:
        return Unit(word, "acceleration", _ACCELERATION[text], line)
    return Unit(word, next((name for name, units in _OTHERS.items() if text in units), ""), math.nan, line)


def unit_factor(word: str) -> float | None:
    """Return m/s² per unit of acceleration, or None where a word is none."""
    factor = unit_of(word).factor
    return None if math.isnan(factor) else factor


def given_factor(unit: str | float) -> float:
    """Return m/s² per unit or count that a caller gives; ValueError if it is no unit of acceleration."""
    if isinstance(unit, str):
        factor = unit_factor(unit)
        if factor is None:
            known = ", ".join(map(repr, _ACCELERATION))
            raise ValueError(f"unit must be one of {known}, or m/s² per count, got {unit!r:.60}")
        return factor
    factor = checks.number("unit", unit, unit="m/s² per count")
    if factor == 0.0:
        raise ValueError("unit must not be 0 m/s² per count")
    return factor


def in_name(name: str, line: int) -> list[Unit]:
    """Return the units in the name of a column, acceleration (g), acc_g or acceleration in g; unknown ones, too."""
    words = [word for pattern in (_BRACKETS, _SUFFIX, _IN) for word in pattern.findall(name)]
    return [*(unit_of(word, line) for word in words if re.search(r"[a-z]", word, re.IGNORECASE)), *_told(name, line)]


def told(text: str, line: int, brackets: bool = True) -> list[Unit]:
    """Return the units that a line of words says the samples have; brackets count where they hold a known unit."""
    named = quantities(text)
    patterns = (_BRACKETS, _IN) if brackets else (_IN,)
    units = [unit_of(word, line) for pattern in patterns for word in pattern.findall(text)]
    return [*_told(text, line), *(unit for unit in units if unit.quantity in ("acceleration", *named))]


def _told(text: str, line: int) -> list[Unit]:
    found = []
    for match in _TOLD.finditer(text):
        link, word = match["link"].strip().lower(), match["unit"]
        readings = unit_of(word, line), unit_of(word.partition("(")[0], line)
        unit = next((unit for unit in readings if unit.quantity), None)
        if unit is not None:
            found += [unit] if unit.quantity != "time" else []
        elif link and (link != "of" or quantities(text)) and re.match(r"[(\[]?[a-z]", word, re.IGNORECASE):
            found += [unit_of(word, line)] if word.lower().strip("():") not in _NO_UNITS else []
    return found


def agreed(file: Path, units: Iterable[Unit]) -> Unit | None:
    """Return the one unit of acceleration that all say, None where there is none.

    Raises
    ------
    RecordError
        Two units that differ (the message has both lines), an unknown unit, a unit of velocity or displacement.
    """
    first: Unit | None = None
    for unit in units:
        if not unit.quantity:
            raise RecordError(
                f"{file}: line {unit.line} has the unknown unit {unit.text.strip()[:40]!r}, "
                "known are g, gal, cm/s², mm/s² and m/s²"
            )
        if unit.quantity != "acceleration":
            raise RecordError(
                f"{file}: line {unit.line} gives a {unit.quantity} ({unit.text.strip()[:40]}), not acceleration"
            )
        first = first or unit
        if unit.factor != first.factor:
            raise RecordError(
                f"{file}: line {first.line} says {first.text.strip()[:40]!r}, line {unit.line} "
                f"{unit.text.strip()[:40]!r}: which of them is the unit of its accelerations?"
            )
    return first
