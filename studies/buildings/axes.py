"""Both horizontal directions in inventories: each piece runs about its width and its depth, and falls about either."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import xarray as xr

from ...core.doubts import first_names
from ...core.wording import listed_name, two_digit_percent
from ...fragility.runs.axes import WEAK_RATIO, check_axes
from ...fragility.uncertainty.joint import with_restitution
from ...models import Law
from ...models.block import describe_scene
from ...motions.arrays import BOTH_AXES, WEAK_AXIS
from ..inventory.contents import Contents, Inventory
from ..text.axes import held_notes
from .shaking import Shaking
from .slide_runs import slides
from .variables import SIDEWAYS

MOST_NAMED = 8


def placed_on_axes(inventory: Inventory, shaking: Shaking, laws: Sequence[Law]) -> Inventory:
    """Return an inventory as `Shaking.placed` does, with the free-standing lines that also run about their depth.

    Those are all that can fall, but on soft beds, or at least 1.6 times as long as wide under a law without a
    restitution along the depth; walls, restraints, offsets and leans act along the width.
    """
    placed = shaking.placed(inventory)
    if not shaking.axes:
        return placed
    near = [row.label for row in placed.rows if row.obstacle is not None and slides(row)]
    if near:
        raise ValueError(
            f"trip_mm cannot be given where both components shake, got one for {first_names(near)}: trips are of one "
            "component"
        )
    weak = shaking.axes == WEAK_AXIS
    able = [
        row
        for row in placed.rows
        if not row.anchored and row.block.bed is None and not (weak and describe_scene(row.block))
    ]
    lacking = [row.label for row in able if row.block.depth is None]
    if lacking:
        raise ValueError(
            f"depth_m is missing of {first_names(lacking)}: where both components shake, the size of a piece in the "
            "other horizontal direction must be known"
        )
    if weak:
        check_axes(WEAK_AXIS, [replace(row.block, name=row.label) for row in able], laws)
        return placed
    return replace(
        placed, rows=tuple(replace(row, along_depth=row in able and not _decided(row, laws)) for row in placed.rows)
    )


def _decided(row: Contents, laws: Sequence[Law]) -> bool:
    """Return True for a line whose weak axis alone decides, and that has no restitution along its depth."""
    block = replace(row.block, name=row.label)
    try:
        check_axes(BOTH_AXES, [block], [with_restitution(law, row.e) for law in laws])
    except ValueError:
        if block.depth is not None and block.depth >= WEAK_RATIO * block.width:
            return True
        raise
    return False


def axes_notes(inventory: Inventory, as_read: Inventory, axes: str) -> list[str]:
    """Return notes on the axes about which the lines of an inventory are run, a sentence each."""
    if not axes:
        return []
    free = [row for row in inventory.rows if not row.anchored]
    if axes == WEAK_AXIS:
        found = [
            "every piece is run about its width alone, under the component in whose direction its width lies: each is "
            f"at least {WEAK_RATIO:g} times as long as it is wide, or something holds it"
        ]
    else:
        found = [
            "both horizontal components shake: each piece is run about its width under the component in whose "
            "direction its width lies and about its depth under the other, under one scale factor, and has fallen "
            "where it fell about either; squatness and sliding are checked in the direction of the width"
        ]
        found += held_notes([row.label for row in free if row.both_axes and describe_scene(row.block)])
        soft = [row.label for row in free if row.block.bed is not None]
        if soft:
            found.append(
                f"{first_names(soft)}: run about the width alone, because a soft bed is modelled in that direction; "
                "falls along the depth are not included"
            )
        squat = [row.label for row in free if not row.both_axes and row.block.bed is None]
        if squat:
            found.append(
                f"{first_names(squat)}: run about the width alone, because the depth is at least {WEAK_RATIO:g} times "
                "the width and too large for the law's restitution (give e to run it)"
            )
    undirected = [
        row.label
        for row, given in zip(inventory.rows, as_read.rows, strict=True)
        if not given.direction and not row.anchored
    ]
    if undirected:
        found.append(
            f"direction is not given of {first_names(undirected)}: their widths are taken to lie in x, which decides "
            "what falls together"
        )
    return found


def sideways_notes(assessment: xr.Dataset) -> list[str]:
    """Return a sentence on the share of each line's falls that are along its depth, in a year or over all levels."""
    if f"{SIDEWAYS.name}_share" not in assessment:
        return []
    every = assessment[f"{SIDEWAYS.name}_share"].isel(model=0).values
    named = [
        f"{listed_name(str(item))} {two_digit_percent(share)}"
        for item, share in zip(assessment["item"].values, every.tolist(), strict=True)
        if np.isfinite(share)
    ]
    if not named:
        return []
    more = f" and {len(named) - MOST_NAMED:,} more" if len(named) > MOST_NAMED else ""
    return [f"share of the falls that are along the depth: {', '.join(named[:MOST_NAMED])}{more}"]
