"""Sentences on the reason why a sequential analysis stopped, and on the gain of further motions."""

from __future__ import annotations

import math
from collections.abc import Sequence

from ...core.wording import counted
from .sequential import SequentialCurve
from .stopping import ALL_FELL, MISFIT, MOST_MOTIONS, NONE_FELL, REACHED, motions_needed, reason_text
from .until import PROBABILITY, RATE

LEAST_GAP = 0.05
"""Per cent of a median below which a misfit, though beyond its error, is nothing to speak of."""


def width_text(curve: SequentialCurve, ratio: float) -> str:
    """Return a half width as text, such as ``±4.8 %`` of the median; `ratio`: half width over its allowed value."""
    until = curve.until
    if not math.isfinite(ratio):
        return "no interval yet"
    if until.target == PROBABILITY:
        return f"±{ratio * until.room:.3f}"
    return f"±{100.0 * half_width(curve, ratio):.1f} %"


def half_width(curve: SequentialCurve, ratio: float) -> float:
    """Return the half width in the terms of the tolerance."""
    until = curve.until
    if until.room != until.tolerance and math.isfinite(ratio):
        return math.expm1(min(ratio * until.room, 700.0))
    return ratio * until.room


def reached_so_far(curves: Sequence[SequentialCurve], motions: int) -> str:
    """Return the progress of an analysis: the widest interval among the curves that have not stopped."""
    going = [curve for curve in curves if not curve.stopped]
    if not going:
        every = f"all {len(curves):,} curves have" if len(curves) > 1 else "the curve has"
        return f"{motions:,} motions, {every} stopped"
    widest = max(going, key=lambda curve: curve.looks[-1].ratio)
    until = widest.until
    asked = f"±{until.tolerance:g}" if until.target == PROBABILITY else f"±{100.0 * until.tolerance:g} %"
    stopped = f"{len(curves) - len(going):,} of {counted(len(curves), 'curve')} stopped"
    width = width_text(widest, widest.looks[-1].ratio)
    return f"{motions:,} motions, {stopped}; widest interval of a {until.target}: {width}, {asked} asked"


def account(curve: SequentialCurve, state: str | None = None) -> str:
    """Return the reason why a curve has stopped, the reached precision, and the gain of more motions.

    state: the name of a damage state other than overturning.
    """
    look, until = curve.looks[-1], curve.until
    asked = f"±{until.tolerance:g}" if until.target == PROBABILITY else f"±{100.0 * until.tolerance:g} %"
    n = f"{look.motions:,} motions"
    low, high = curve.explored
    if curve.stopped in (NONE_FELL, ALL_FELL):
        return f"{reason_text(curve.stopped, state)} under {n} at levels from {low:.3g} to {high:.3g} (SI)"
    if curve.stopped == MISFIT:
        return (
            f"a dispersion within {asked} is not to be had: near the median, levels give a median "
            f"{100.0 * math.expm1(look.misfit):+.1f} % from that of the lognormal curve through all runs"
        )
    text = f"{width_text(curve, look.ratio)} for the {until.target} after {n}, {asked} asked"
    if curve.stopped != REACHED:
        needed = motions_needed(look.motions, look.ratio)
        why = "the most allowed" if curve.stopped == MOST_MOTIONS else "all there are"
        # (the rule wants an interval narrower than asked, and to see it again)
        what = "the precision" if look.ratio > 1.0 else "confirming it"
        text += f"; {n} are {why}" + (f", {what} takes about {needed:,}" if needed > look.motions else "")
    gap = 100.0 * math.expm1(-look.misfit)
    if abs(gap) >= LEAST_GAP:
        text += f"; no lognormal curve fits: its median is {gap:+.1f} % from that of levels near it"
    differs = curve.rate_misfit() if until.target == RATE else 0.0
    if differs:
        text += f"; the rate of the lognormal curve through all runs is {100.0 * differs:+.1f} % from this one"
    return text
