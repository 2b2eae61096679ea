"""Both horizontal directions in inventories: each piece runs about its width and its depth, and falls about either."""

from collections.abc import Sequence
from dataclasses import replace

import xarray as xr

from ...core.doubts import first_names
from ...core.facts import Fact
from ...fragility.runs.axes import WEAK_RATIO, check_axes
from ...fragility.uncertainty.joint import with_restitution
from ...models import Law
from ...motions.arrays import BOTH_AXES, WEAK_AXIS
from ..inventory.contents import Contents, Inventory
from ..text.axes import depth_notes, held_notes
from .shaking import Shaking
from .slide_runs import slides
from .variables import SIDEWAYS


def placed_on_axes(inventory: Inventory, shaking: Shaking, laws: Sequence[Law]) -> Inventory:
    """Return an inventory as `Shaking.placed` does, with the free-standing lines that also run about their depth.

    These lines can fall and are not on soft beds. Under a law without a restitution along the depth, they are also less
    than 1.6 times as long as wide. Walls, restraints, offsets and leans act along the width.
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
        row for row in placed.rows if not row.anchored and row.block.bed is None and not (weak and row.block.surrounded)
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


def axes_notes(inventory: Inventory, as_read: Inventory, axes: str) -> list[Fact]:
    """Return notes on the axes about which the lines of an inventory are run."""
    if not axes:
        return []
    free = [row for row in inventory.rows if not row.anchored]
    if axes == WEAK_AXIS:
        facts = [Fact("axis.weak_axis", WEAK_RATIO)]
    else:
        held = [row.label for row in free if row.both_axes and row.block.surrounded]
        facts = [Fact("axis.both_axes"), *held_notes(held)]
        soft = tuple(row.label for row in free if row.block.bed is not None)
        if soft:
            facts.append(Fact("axis.bed_along_width", names=soft))
        deep = tuple(row.label for row in free if not row.both_axes and row.block.bed is None)
        if deep:
            facts.append(Fact("axis.too_deep", WEAK_RATIO, names=deep))
    rows = zip(inventory.rows, as_read.rows, strict=True)
    undirected = tuple(row.label for row, given in rows if not given.direction and not row.anchored)
    return [*facts, Fact("axis.direction_not_given", names=undirected)] if undirected else facts


def sideways_notes(assessment: xr.Dataset) -> list[Fact]:
    """Return the note on the share of each line's falls along its depth, per year or over all levels."""
    name = f"{SIDEWAYS}_share"
    return depth_notes(assessment["block"].values, assessment[name].isel(model=0).values) if name in assessment else []
