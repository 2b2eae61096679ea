"""Sliding: the coefficient of friction that blocks need to stay in place, compared with the available friction."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr

from ...core.aliases import Array, Index
from ...core.units import STANDARD_GRAVITY
from ...models.friction import Contact, FixedFriction, Friction, contact_of, friction_at_uplift
from ..numerics.slabs import spread
from ..runs.provenance import RUN
from .reasons import SLIDES_AT_IMPACT, SLIDES_AT_UPLIFT, SLIDES_WHILE_ROCKING, Reason, labelled

ANY_FLOOR = FixedFriction(1.0)
"""Friction assumed if none is given: hardly any floor has more."""
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
    peak: xr.Variable,
    factor: xr.Variable,
    rising: list[Array] | None,
    motion: Index | None = None,
) -> dict[Reason, xr.Variable]:
    """Return the coefficient of friction below which blocks slide, at uplift and while they rock.

    `slenderness`, `inertia`: on block, or on run. `peak`: peak acceleration of the scaled motions, m/s². `factor`:
    their scale factors. `rising`: of the motions (`Characteristics`), without which the demand at uplift is left out.
    `motion` (run,): the places of the motions of runs.
    """
    needs = {SLIDES_WHILE_ROCKING: xr.apply_ufunc(friction_at_uplift, slenderness, peak, inertia)}
    if rising is not None:
        lifting = _lifting_peaks(slenderness, factor, rising, motion)
        needs[SLIDES_AT_UPLIFT] = xr.apply_ufunc(friction_at_uplift, slenderness, lifting, inertia)
    return needs


def _lifting_peaks(
    slenderness: xr.Variable, factor: xr.Variable, rising: list[Array], motion: Index | None
) -> xr.Variable:
    """Peak of the first half-cycle that exceeds g b/h, otherwise of the whole motion, m/s²; the motions are last."""
    thresholds: xr.Variable = STANDARD_GRAVITY / slenderness / factor
    scale = spread(factor, thresholds.sizes)
    peaks = np.zeros(thresholds.shape)
    ends, order = np.arange(len(rising) + 1), None
    if motion is not None:
        order = np.argsort(motion, kind="stable")
        ends = np.searchsorted(motion[order], ends)
    for reached, first, stop in zip(rising, ends[:-1].tolist(), ends[1:].tolist(), strict=True):
        if reached.size and stop > first:
            at = slice(first, stop) if order is None else order[first:stop]
            place = np.searchsorted(reached, thresholds.values[..., at], side="right")
            peaks[..., at] = scale[..., at] * reached[np.minimum(place, reached.size - 1)]
    return xr.Variable(thresholds.dims, peaks)


def friction_by_block(friction: Any, labels: list[str]) -> list[Friction]:
    """Return the friction of each block from one for all, a mapping by label, or None; ValueError if one is missing."""
    if friction is None:
        return [ANY_FLOOR] * len(labels)
    return [contact.friction for contact in contact_by_block(friction, labels)]


def contact_by_block(friction: Any, labels: list[str]) -> list[Contact]:
    """Return the contact of each block from one for all or a mapping by label; ValueError if one is missing."""
    if not isinstance(friction, Mapping):
        return [contact_of(friction)] * len(labels)
    missing = [label for label in labels if label not in friction]
    if missing:
        raise ValueError(f"friction must hold every block, got none for {missing[0]!r}")
    return [contact_of(friction[label]) for label in labels]


def chance_below(need: xr.Variable, available: list[Friction], block: Index | None = None) -> xr.Variable:
    """Return the probability that blocks have less friction than they need; 0 if that is not known.

    block (run,): the places of the blocks of runs, if the need is on run.
    """
    of_runs = block is not None and "block" not in need.dims
    values = need if of_runs else need.transpose("block", ...)
    numbers = {key: k for k, key in enumerate(dict.fromkeys(map(id, available)))}
    number = np.array([numbers[id(friction)] for friction in available])
    number = number[block] if of_runs else number
    chance = np.empty(values.shape)
    for friction in {id(friction): friction for friction in available}.values():
        at = slice(None) if len(numbers) == 1 else np.flatnonzero(number == numbers[id(friction)])
        chance[at] = np.nan_to_num(friction.below(values.values[at]), nan=0.0)
    return values.copy(data=chance)


def slides_of(chances: Mapping[Reason, xr.Variable], known: bool) -> xr.Variable:
    """Return the probability of sliding, which is the largest of all demands because there is one coefficient."""
    slides = chances[SLIDES_WHILE_ROCKING]
    for chance in chances.values():
        slides = xr.apply_ufunc(np.maximum, slides, chance)
    if known:
        return labelled(slides > 0.5, "whether the block slides")
    return labelled(slides.astype(np.float32), "probability that the block slides")


def compact(values: xr.Variable) -> xr.Variable:
    """Return values in single precision if they depend on the motion: sufficient accuracy at half the file size."""
    return values.astype(np.float32) if {"motion", RUN} & {*values.dims} else values
