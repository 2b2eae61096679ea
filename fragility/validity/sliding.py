"""Sliding: the coefficient of friction that blocks need to stay in place, compared with the available friction."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr

from ...core.aliases import Array
from ...core.units import STANDARD_GRAVITY
from ...models.friction import FixedFriction, Friction, friction_at_impact, friction_at_uplift, friction_of
from .reasons import SLIDES_AT_IMPACT, SLIDES_AT_UPLIFT, SLIDES_WHILE_ROCKING, Reason, labelled

ANY_FLOOR = FixedFriction(1.0)
"""Friction assumed where none is given: hardly any floor has more."""
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
"""Variable with the friction needed, and its long name, for each reason to slide."""


def friction_demands(
    slenderness: xr.Variable,
    inertia: xr.Variable,
    e: xr.Variable,
    peak: xr.Variable,
    factor: xr.Variable,
    rising: list[Array] | None,
) -> dict[Reason, xr.Variable]:
    """Return the coefficient of friction below which blocks slide, for each reason to slide.

    slenderness, inertia (block,); e (block, model); peak: peak acceleration of the scaled motions, m/s²; factor: their
    scale factors; rising: `rising_peaks` of the motions, without which the demand at uplift is left out.
    """
    needs = {
        SLIDES_WHILE_ROCKING: xr.apply_ufunc(friction_at_uplift, slenderness, peak, inertia),
        SLIDES_AT_IMPACT: e.copy(data=friction_at_impact(slenderness.values[:, None], e.values)),
    }
    if rising is not None:
        dims = ("block", "level", "motion") if "level" in factor.dims else ("block", "motion")
        missing = tuple(i for i, dim in enumerate(("block", "level", "motion")) if dim not in factor.dims)
        factors = np.ascontiguousarray(np.expand_dims(factor.values, missing))
        peaks = _lifting_peaks(factors, rising, slenderness.values)
        lifting = xr.Variable(dims, peaks if "level" in dims else peaks[:, 0])
        needs[SLIDES_AT_UPLIFT] = xr.apply_ufunc(friction_at_uplift, slenderness, lifting, inertia)
    return needs


def _lifting_peaks(factors: Array, rising: list[Array], slenderness: Array) -> Array:
    """Peak of the first half-cycle that exceeds g b/h, else that of the motion; (block, level, motion), m/s²."""
    found = np.zeros((slenderness.size, *factors.shape[1:]))
    # (runs at levels of their own have the motions of several runs more than once)
    runs: dict[int, list[int]] = {}
    for i, reached in enumerate(rising):
        if reached.size:
            runs.setdefault(id(reached), []).append(i)
    for alike in runs.values():
        reached, at = rising[alike[0]], alike if len(alike) > 1 else slice(alike[0], alike[0] + 1)
        scale = factors[:, :, at]
        first = np.searchsorted(reached, STANDARD_GRAVITY / slenderness[:, None, None] / scale, side="right")
        found[:, :, at] = scale * reached[np.minimum(first, reached.size - 1)]
    return found


def friction_by_block(friction: Any, labels: list[str]) -> list[Friction]:
    """Return the friction of each block from one for all, a mapping by label, or None; ValueError if one is missing."""
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
    """Return the probability that blocks have less friction than they need; 0 where they need none or it is unknown."""
    found = {}
    for reason, need in needs.items():
        by_block = need.transpose("block", ...)
        below = np.stack([one.below(by_block.values[i]) for i, one in enumerate(available)])
        chance = by_block.copy(data=np.nan_to_num(below, nan=0.0))
        # a block that never uplifts neither rocks nor comes down
        found[reason] = chance if reason is SLIDES_AT_UPLIFT else xr.apply_ufunc(np.where, lifts, chance, 0.0)
    return found


def slides_of(chances: Mapping[Reason, xr.Variable], known: bool) -> xr.Variable:
    """Return the probability that a block slides at all: that of the greatest demand, as there is one coefficient."""
    slides = chances[SLIDES_WHILE_ROCKING]
    for chance in chances.values():
        slides = xr.apply_ufunc(np.maximum, slides, chance)
    if known:
        return labelled(slides > 0.5, "whether the block slides")
    return as_probability(slides)


def as_probability(slides: xr.Variable) -> xr.Variable:
    """Return whether blocks slide, or with which probability, as a probability."""
    return labelled(slides.astype(np.float32), "probability that the block slides")


def compact(values: xr.Variable) -> xr.Variable:
    """Return values in single precision where they depend on the motion: sufficient accuracy at half the file size."""
    return values.astype(np.float32) if "motion" in values.dims else values
