"""What is compared: a number of A, the same of B, and their ratio with its interval over motions."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ...aliases import Array
from ..buildings.pieces import Range
from ..sensitivity.comparisons import exponentials
from .sides import Matched

HIGHER, LOWER, SAME, OPEN, UNKNOWN = "higher", "lower", "the same", "not resolved", ""
"""B against A: the interval of the ratio lies above 1, or below; both are equal; it holds 1; there is no interval."""
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


def ratio_of(a: float, b: float, of_a: Array | None, of_b: Array | None, confidence: float) -> Range:
    """Return B/A with the percentile interval of the ratio of replicates, replicate by replicate.

    Parameters
    ----------
    a, b : float
        The numbers of both sides, 0 or more; NaN where there is none.
    of_a, of_b : ndarray (replicate,) or None
        Their bootstrap replicates, of the same motions where replicates are paired; None: no interval.
    confidence : float
        Confidence of the interval, between 0 and 1.
    """
    if not (a > 0.0 and math.isfinite(a) and math.isfinite(b)):
        return NONE
    # (nothing that was never seen to fall has a range of chances in its replicates)
    if of_a is None or of_b is None or b == 0.0:
        return Range(b / a, math.nan, math.nan)
    # (a few motions decide: in many resamples nothing falls, and the rest would look more alike than they are)
    empty = float(np.mean(~((np.asarray(of_a) > 0.0) & (np.asarray(of_b) > 0.0))))
    if empty > 0.5 * (1.0 - confidence):
        return Range(b / a, math.nan, math.nan)
    with np.errstate(divide="ignore", invalid="ignore"):
        samples = np.log(of_b) - np.log(of_a)
    found = exponentials(np.array([math.log(b) - math.log(a)]), samples[None], confidence)
    return Range(b / a, float(found[1][0]), float(found[2][0]))


def verdict_of(ratio: Range) -> str:
    """Return in words what a ratio with its interval says of B against A.

    Examples
    --------
    >>> verdict_of(Range(1.2, 1.1, 1.3)), verdict_of(Range(1.2, 0.9, 1.4)), verdict_of(Range(1.0, 1.0, 1.0))
    ('higher', 'not resolved', 'the same')
    """
    if math.isnan(ratio.lower) or math.isnan(ratio.upper):
        return UNKNOWN
    if ratio.lower == ratio.upper == ratio.value == 1.0:
        return SAME
    return HIGHER if ratio.lower > 1.0 else LOWER if ratio.upper < 1.0 else OPEN


def law_text(laws: tuple[str, str]) -> str:
    """Return the law of both sides, or the law of A and that of B."""
    return laws[0] if laws[0] == laws[1] else f"{laws[0]} → {laws[1]}"


def counted_verdicts(lines: Sequence[Line]) -> dict[str, int]:
    """Return how many lines have each verdict, in the order of the verdicts."""
    return {word: sum(line.verdict == word for line in lines) for word in (HIGHER, LOWER, OPEN, SAME)}
