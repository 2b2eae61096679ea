"""Notes on the horizontal components that act on blocks: axis of the falls, and components of the levels."""

from collections.abc import Sequence

import numpy as np
import xarray as xr

from ...core.aliases import Array
from ...core.facts import Fact
from ...core.wording import listed_name
from ...models.outputs import AXIS
from ...motions.arrays import HORIZONTAL
from ...motions.intensity.directions import PAIR_MEASURES
from .words import measure_name

MOST_NAMED = 8


def axis_notes(results: xr.Dataset) -> list[Fact]:
    """Return the note on the share of each block's falls that are along its depth; none of other runs."""
    if AXIS not in results:
        return []
    over = [dim for dim in results[AXIS].dims if dim != "block"]
    fell, deep = ((results[AXIS] >= least).sum(over).values.astype(float) for least in (1, 2))
    with np.errstate(invalid="ignore"):
        return depth_notes(results["block"].values, deep / fell)


def depth_notes(labels: Array, shares: Array) -> list[Fact]:
    """Return the note on shares of falls along the depth, NaN without falls; none without any."""
    fell = np.isfinite(shares)
    more = {"shares": shares[fell][:MOST_NAMED].tolist(), "others": max(0, int(fell.sum()) - MOST_NAMED)}
    named = tuple(listed_name(str(label)) for label in labels[fell][:MOST_NAMED])
    return [Fact("axis.share_along_depth", names=named, more=more)] if named else []


def held_notes(labels: Sequence[str]) -> list[Fact]:
    """Return the note on walls, restraints, offsets and leans along the depth of pieces; none of no piece."""
    return [Fact("axis.held_free", names=tuple(labels))] if labels else []


def component_notes(component: str | None, im: str) -> list[Fact]:
    """Return the note on recordings that are scaled by one of their components, from which rates are computed."""
    if component not in HORIZONTAL or im.partition("(")[0] in PAIR_MEASURES:
        return []
    return [Fact("motion.one_component", names=(measure_name(im),))]
