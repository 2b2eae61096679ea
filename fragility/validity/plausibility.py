"""Plausibility of blocks and levels: sizes and levels outside of what exists, with the likely slip of units."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence

import numpy as np

from ...aliases import Array, Flags
from ...doubts import Doubt, first_names, first_of
from ...models import Block, Model, Sliding
from ...models.columns import BlockArray
from ...units import ACCELERATION, STANDARD_GRAVITY, VELOCITY

LARGEST, SMALLEST = 20.0, 0.01  # m: sides of contents of buildings
SLIDES_ON = 0.05
"""Share of a slip that comes after the end of the motion."""
LEAST_SLIP = 1e-4  # m
IMPOSSIBLY_LARGE, IMPOSSIBLY_SMALL = 100.0, 0.001  # m
HIGHEST: dict[str, tuple[float, float, str]] = {
    ACCELERATION: (5.0 * STANDARD_GRAVITY, 50.0 * STANDARD_GRAVITY, "g written where m/s² is meant?"),
    VELOCITY: (10.0, 100.0, "cm/s meant?"),
}
"""By the unit of levels: the highest that exists, the highest that can be meant, and the likely slip."""


def block_doubts(blocks: Iterable[Block] | BlockArray) -> list[Doubt]:
    """Return the doubt in the sizes of blocks: sides above 20 m or below 0.01 m."""
    if isinstance(blocks, BlockArray):
        return _size_doubts(np.stack([blocks.width, blocks.height], axis=1), lambda i: str(blocks.names[i]))
    every = list(blocks)
    sides = np.array([(block.width, block.height) for block in every]).reshape(-1, 2)
    # (a block without a name is called by its sizes)
    return _size_doubts(sides, lambda i: every[i].name)


def _size_doubts(sides: Array, name: Callable[[int], str | None]) -> list[Doubt]:
    found = []
    for odd, beyond, text, slip in (
        (
            sides.max(axis=1) > LARGEST,
            sides > IMPOSSIBLY_LARGE,
            f"above {LARGEST:g} m",
            "centimetres or millimetres written as metres?",
        ),
        (
            sides.min(axis=1) < SMALLEST,
            sides < IMPOSSIBLY_SMALL,
            f"below {SMALLEST:g} m",
            "another unit than metres?",
        ),
    ):
        named = np.flatnonzero(odd).tolist()
        if named:
            own = [f"{name(i)}: " if name(i) else "" for i in named]
            sizes = first_of([f"{one}{sides[i, 0]:g} m × {sides[i, 1]:g} m" for one, i in zip(own, named, strict=True)])
            have = "has" if len(named) == 1 else "have"
            of = f"{len(named):,} of {len(sides):,} blocks {have} sides" if len(sides) > 1 else "the block has sides"
            found.append(Doubt("block size", f"{of} {text} ({sizes}): {slip}", bool(beyond.any())))
    return found


def rocking_doubts(blocks: Sequence[Block], models: Iterable[Model], outputs: Sequence[str]) -> list[Doubt]:
    """Return the doubt in blocks that slide under a static friction of b/h or more, where no `mode` tells of it."""
    if "mode" in outputs:
        return []
    found = []
    for law in models:
        if not isinstance(law, Sliding):
            continue
        early = [block.label for block in blocks if law.static >= math.tan(block.alpha)]
        if early:
            found.append(
                Doubt(
                    "rocks first",
                    f"{law.label}: {len(early):,} of {len(blocks):,} blocks uplift before they slide, since their "
                    f"friction is not below b/h ({first_names(early)}): their slips are those of blocks that cannot "
                    "rock",
                )
            )
    return found


def cut_slides(peaks: Array, after: Array) -> Flags:
    """Return True for motions at whose end blocks slide: slips (…, motion) in all and after the end, m."""
    on = (after > np.maximum(SLIDES_ON * peaks, LEAST_SLIP)).any(axis=tuple(range(after.ndim - 1)))
    return np.atleast_1d(np.asarray(on))


def end_doubts(on: Iterable[bool], motions: Sequence[str]) -> list[Doubt]:
    """Return the doubt in motions at whose end blocks slide (`cut_slides`)."""
    named = [name for name, one in zip(motions, on, strict=True) if one]
    if not named:
        return []
    return [
        Doubt(
            "slides on",
            f"{len(named):,} of {len(motions):,} motions end while a block slides, which takes it further by more than "
            f"{100.0 * SLIDES_ON:g} % of its slip ({first_names(named)}): zeros after the motions, or their missing "
            "end, change what it does",
        )
    ]


def level_doubts(levels: Array, units: str) -> list[Doubt]:
    """Return the doubt in the highest level of a measure: above 5 g or 10 m/s."""
    if units not in HIGHEST or not levels.size:
        return []
    highest, beyond, slip = HIGHEST[units]
    top = float(np.max(levels))
    if top <= highest:
        return []
    shown = f"{top / STANDARD_GRAVITY:g} g" if units == ACCELERATION else f"{top:g} m/s"
    return [Doubt("level", f"the highest level, {shown}, is beyond any shaking: {slip}", top > beyond)]
