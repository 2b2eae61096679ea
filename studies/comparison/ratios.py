"""Pairs of numbers, of A and of B, with their ratio and the verdict on it."""

from __future__ import annotations

import math
from typing import NamedTuple

from ..buildings.recommendations import Range
from .sides import Matched

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
