"""Runs of blocks about both horizontal axes: a planar run about each, under one factor, and the outputs of the two."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ...models import Block, Model
from ...models.outputs import AXIS, DECIDING, EARLIER, EITHER, FALLEN, OF_AXES, OUTPUTS, SLIDES
from ...models.sliding.law import SlidingLaw
from ...motions.arrays import BOTH_AXES, WEAK_AXIS, Record

WEAK_RATIO = 1.6
"""Ratio of depth to width from which the axis along the width decides alone (docs/theory/axes.md)."""
_DECIDING = ("overturned", "overturning_time")


def axes_of(motions: Sequence[Record]) -> str:
    """Return the axes of motions: `BOTH_AXES`, `WEAK_AXIS`, or '' for one component; ValueError if they differ."""
    axes = {record.axes for record in motions}
    if len(axes) > 1:
        raise ValueError("motions must all shake one way: both axes, the weak axis, or one component, got several")
    return axes.pop() if axes else ""


def check_axes(axes: str, blocks: Sequence[Block], models: Sequence[Model]) -> None:
    """Raise a ValueError if blocks cannot be run about these axes.

    About both axes: a block without a depth, one on a soft bed, one too squat along its depth for a law without an
    explicit restitution. About the weak axis alone: a block without a depth, or with a depth below 1.6 times its width,
    or a round one.
    """
    if axes == WEAK_AXIS:
        for block in blocks:
            if block.depth is None:
                raise ValueError(f"{block.label!r} needs its depth (m), to tell whether its weak axis alone is enough")
            if block.depth < WEAK_RATIO * block.width:
                raise ValueError(
                    f"{block.label!r} must have a depth of at least {WEAK_RATIO:g} times its width where its weak axis "
                    f"alone is run, got {block.depth:g} m and {block.width:g} m: run both axes"
                )
    if axes == BOTH_AXES and not _sliding(models):
        for block in blocks:
            across = block.across
            for model in models:
                try:
                    model.restitution(across)
                except ValueError as error:
                    raise ValueError(f"{block.label!r} in the direction of its depth: {error}") from None


def check_outputs(axes: str, outputs: Sequence[str], models: Sequence[Model]) -> None:
    """Raise a ValueError for outputs that runs about these axes do not have."""
    if axes != BOTH_AXES:
        if AXIS in outputs:
            raise ValueError("outputs: axis is of runs about both axes (motions.both_axes), got one component")
        return
    allowed = SLIDES if _sliding(models) else OF_AXES
    for name in outputs:
        if name not in allowed:
            raise ValueError(f"outputs of runs about both axes must be among {', '.join(allowed)}, got {name!r}")


def _sliding(models: Sequence[Model]) -> bool:
    """Return True of blocks that slide, which need no depth for it."""
    return any(isinstance(model, SlidingLaw) for model in models)


def along_depth(record: Record) -> Record:
    """Return a pair of components with that along the depth first, as the motion of a block's other axis."""
    assert record.companion is not None
    return record._replace(acceleration=record.companion, companion=record.acceleration, axes="")


def along_width(record: Record) -> Record:
    """Return a pair of components as the motion of a block's width alone."""
    return record._replace(axes="")


def _decided(name: str) -> bool:
    """Return True for outputs that depend on the axis about which the block fell."""
    return name == AXIS or OUTPUTS[name].both in (DECIDING, FALLEN)


def needed(outputs: Sequence[str]) -> tuple[str, ...]:
    """Return the outputs that the run about each axis needs for these outputs of both."""
    every = [name for name in outputs if name != AXIS]
    if any(map(_decided, outputs)):
        every += _DECIDING
    return tuple(dict.fromkeys(every))


def of_both(outputs: Sequence[str], x: Mapping[str, Any], y: Mapping[str, Any]) -> dict[str, Any]:
    """Return outputs of runs about both axes from those about each (`x` along the width, `y` along the depth).

    - overturned and uplifted: about either axis;
    - ruptured: of the restraint, which acts along the width;
    - axis: the axis about which the block fell first, the width at equal times and in runs that leave the floor;
    - overturning_time: the earlier;
    - peak_rotation: the larger, pi/2 if the block fell, so that the other axis does not count after the fall;
    - impacts, impact_velocity and direction: of the axis about which it fell, else the larger.
    """
    outputs_of_both: dict[str, Any] = {}
    axis: Any = None
    if any(map(_decided, outputs)):
        fell_x, fell_y = x["overturned"], y["overturned"]
        # (runs that leave the floor have no times, about either axis, and count along the width)
        at_x, at_y = x["overturning_time"], y["overturning_time"]
        first_x = fell_x & ~(fell_y & ((at_y < at_x) | (np.isnan(at_x) & ~np.isnan(at_y))))
        axis = np.where(first_x, np.int8(1), np.where(fell_y, np.int8(2), np.int8(0))).astype(np.int8)
    for name in outputs:
        if name == AXIS:
            outputs_of_both[name] = axis
        elif OUTPUTS[name].both == EITHER:
            outputs_of_both[name] = x[name] | y[name]
        elif OUTPUTS[name].both == EARLIER:
            outputs_of_both[name] = np.fmin(x[name], y[name])
        elif _decided(name):
            larger = np.maximum(x[name], y[name])
            outputs_of_both[name] = np.where(axis == 1, x[name], np.where(axis == 2, y[name], larger))
        else:
            outputs_of_both[name] = np.maximum(x[name], y[name])
    return outputs_of_both
