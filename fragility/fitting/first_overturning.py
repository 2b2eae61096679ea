"""First overturnings: the interval of levels in which each motion first overturns a block, and the levels' effect.

A motion overturns a block in ever more intervals of its scale as levels get closer (docs/adaptive.md). The first
overturning therefore comes earlier with closer levels, and does not converge. The effect of the given levels is
measured on the runs themselves, without half of the levels.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from ...core.elementary import Array, Flags, log
from ...core.units import described

FEWEST = 4
"""Fewest levels of which every other one still has an interval."""


class Brackets(NamedTuple):
    """Intervals of the capacities: lower and upper ends (…, motion); infinite if only the other end is known."""

    lower: Array
    upper: Array
    stood_above: Flags


def brackets(overturned: Flags, values: Array) -> Brackets:
    """Return the interval of the first overturning, from flags and values (…, motion, level) in order of the levels.

    `values` may be of any shape that broadcasts. The lower end is -inf if the lowest level overturns, the upper end inf
    if no level does. `stood_above` is True if some level above the first overturning does not overturn.
    """
    along = np.broadcast_to(values, overturned.shape)
    n = overturned.shape[-1]
    fell = overturned.any(axis=-1)
    first = np.where(fell, overturned.argmax(axis=-1), n)
    lower = np.take_along_axis(along, np.maximum(first - 1, 0)[..., None], axis=-1)[..., 0]
    upper = np.take_along_axis(along, np.minimum(first, n - 1)[..., None], axis=-1)[..., 0]
    above = np.arange(n) > first[..., None]
    return Brackets(
        np.where(first > 0, lower, -np.inf),
        np.where(fell, upper, np.inf),
        np.asarray((~overturned & above).any(axis=-1)),
    )


def spacing_attributes(levels: Array) -> dict[str, Any]:
    """Return the spacing of levels (level,), > 0, in any order, and a note on its effect on first overturnings.

    ``level_spacing``: largest ratio of neighbouring levels, less 1, NaN of a single level; ``note``: a sentence.
    """
    x = np.sort(log(levels))
    spacing = math.expm1(float(np.diff(x).max())) if x.size > 1 else math.nan
    apart = f"up to {100.0 * spacing:.3g} % apart" if x.size > 1 else "of which there is one"
    text = (
        f"first overturnings are between levels {apart}; closer levels find earlier ones, without an end (level_shift)"
    )
    return {"level_spacing": spacing, "note": text}


SHIFT = described("mean of ln(capacity) with every other level, less that with all")
"""Attributes of shifts."""


def level_shift(overturned: Flags, levels: Array) -> float:
    """Return the delay of first overturnings (…, motion, level) with every other level compared with all.

    The shift is the mean of ln(capacity) with the odd and with the even levels less the mean with all. It covers the
    motions whose capacity is known with both, and is NaN without any. A capacity is the geometric mean of its ends. The
    shift is positive if closer levels find earlier overturnings; with a single overturning per motion it would be 0 in
    the mean.
    """
    order = np.argsort(levels, kind="stable")
    x = log(levels[order])
    rows = overturned.reshape(-1, x.size)[:, order]
    if x.size < FEWEST:
        return math.nan
    whole = _capacity(rows, x)
    gaps = np.concatenate([_capacity(rows[:, k::2], x[k::2]) - whole for k in (0, 1)])
    known = np.isfinite(gaps)
    return float(gaps[known].mean()) if known.any() else math.nan


def _capacity(rows: Flags, x: Array) -> Array:
    """Return the middle of the interval of each first overturning, NaN if an end is not known."""
    ends = brackets(rows, x)
    known = np.isfinite(ends.lower) & np.isfinite(ends.upper)
    return np.where(known, 0.5 * (np.where(known, ends.lower, 0.0) + np.where(known, ends.upper, 0.0)), np.nan)
