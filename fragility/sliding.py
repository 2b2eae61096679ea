"""Sliding: the friction that runs need so that their blocks stay in place, beside what there is."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ..models.friction import FixedFriction, Friction, friction_at_impact, friction_at_uplift, friction_of
from ..motions.arrays import Record
from ..motions.peaks import half_cycle_peaks
from ..units import STANDARD_GRAVITY
from .provenance import factors_of
from .reasons import SLIDES_AT_IMPACT, SLIDES_AT_UPLIFT, SLIDES_WHILE_ROCKING, Reason, labelled

ANY_FLOOR = FixedFriction(1.0)
"""What is asked where no friction is given: no more than hardly any floor has."""
NEEDS: dict[Reason, tuple[str, str]] = {
    SLIDES_AT_UPLIFT: (
        "friction_uplift_demand",
        "coefficient of friction needed up to the peak of the half-cycle in which the block uplifts",
    ),
    SLIDES_WHILE_ROCKING: (
        "friction_rocking_demand",
        "coefficient of friction needed by the peak of the motion while the block is nearly upright",
    ),
    SLIDES_AT_IMPACT: ("friction_impact", "coefficient of friction needed at impact"),
}
"""What each reason to slide asks for: variable and its long name."""


def needs_of(
    runs: xr.Dataset,
    slenderness: xr.Variable,
    inertia: xr.Variable,
    peak: xr.Variable,
    rising: list[NDArray[np.float64]] | None,
) -> dict[Reason, xr.Variable]:
    """The coefficient of friction that each way to stay in place needs; that at uplift asks for `rising_peaks`."""
    e = runs["e"].variable
    needs = {
        SLIDES_WHILE_ROCKING: xr.apply_ufunc(friction_at_uplift, slenderness, peak, inertia),
        SLIDES_AT_IMPACT: e.copy(data=friction_at_impact(slenderness.values[:, None], e.values)),
    }
    if rising is not None:
        peaks = _lifting_peaks(factors_of(runs), rising, slenderness.values)
        lifting = (
            xr.Variable(("block", "level", "motion"), peaks)
            if "level" in runs.dims
            else xr.Variable(("block", "motion"), peaks[:, 0])
        )
        needs[SLIDES_AT_UPLIFT] = xr.apply_ufunc(friction_at_uplift, slenderness, lifting, inertia)
    return needs


def rising_peaks(plain: list[Record]) -> list[NDArray[np.float64]]:
    """Of each motion the peaks of half-cycles that exceed all before them, m/s²."""
    return [np.unique(np.maximum.accumulate(half_cycle_peaks(record.acceleration))) for record in plain]


def _lifting_peaks(
    factors: NDArray[np.float64], rising: list[NDArray[np.float64]], slenderness: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Peak of the first half-cycle that exceeds g b/h, of the motion where none does; (block, level, motion), m/s²."""
    found = np.empty((slenderness.size, *factors.shape[1:]))
    for i, reached in enumerate(rising):
        if reached.size == 0:
            found[:, :, i] = 0.0
            continue
        thresholds = STANDARD_GRAVITY / slenderness[:, None] / factors[:, :, i]
        first = np.minimum(np.searchsorted(reached, thresholds, side="right"), reached.size - 1)
        found[:, :, i] = factors[:, :, i] * reached[first]
    return found


def friction_by_block(friction: Any, labels: list[str]) -> list[Friction]:
    """The friction of each block, from one for all, a mapping by label, or none; ValueError where one is missing."""
    if friction is None:
        return [ANY_FLOOR] * len(labels)
    if not isinstance(friction, Mapping):
        return [friction_of(friction)] * len(labels)
    missing = [label for label in labels if label not in friction]
    if missing:
        raise ValueError(f"friction must hold every block, got none for {missing[0]!r}")
    return [friction_of(friction[label]) for label in labels]


def chances_of(
    needs: Mapping[Reason, xr.Variable], available: list[Friction], lifts: xr.Variable
) -> dict[Reason, xr.Variable]:
    """Probability that each block has less friction than it needs; 0 where it needs none or nothing is known."""
    found = {}
    for reason, need in needs.items():
        by_block = need.transpose("block", ...)
        below = np.stack([one.below(by_block.values[i]) for i, one in enumerate(available)])
        chance = by_block.copy(data=np.nan_to_num(below, nan=0.0))
        # a block that never uplifts neither rocks nor comes down
        found[reason] = chance if reason is SLIDES_AT_UPLIFT else xr.apply_ufunc(np.where, lifts, chance, 0.0)
    return found


def slides_of(chances: Mapping[Reason, xr.Variable], known: bool) -> xr.Variable:
    """The probability that a block slides at all: one coefficient for all needs, so the greatest decides."""
    slides = chances[SLIDES_WHILE_ROCKING]
    for chance in chances.values():
        slides = xr.apply_ufunc(np.maximum, slides, chance)
    if known:
        return labelled(slides > 0.5, "whether the block slides")
    return labelled(slides.astype(np.float32), "probability that the block slides")


def compact(values: xr.Variable) -> xr.Variable:
    """Single precision where there is a value for every run: more than the numbers are good for, in half the file."""
    return values.astype(np.float32) if "motion" in values.dims else values
