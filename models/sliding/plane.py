"""Runs of blocks that slide in the plane of the floor, under both horizontal components, as plain arrays."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ...core.aliases import Array, Flags, Index
from ..slip import columns
from ..slip.plane import slide_in_plane
from ..slip.tables import OUT_PEAK
from .law import PlaneSlider
from .runs import NO_VERTICAL, airborne, beyond

IN_PLANE: dict[str, int] = {
    "slide_residual_along": columns.OUT_RESIDUAL_X,
    "slide_residual_across": columns.OUT_RESIDUAL_Y,
}
"""Results of a run in the plane beside those of `SLIDES`, which have the columns of runs in one direction."""
NO_HISTORY = np.empty((columns.HISTORY_ROWS, 0))


class PlaneTable(NamedTuple):
    """The coefficients of blocks (block, 2), static and kinetic, as the engine reads them."""

    friction: Array


def plane_table(sliders: Sequence[PlaneSlider]) -> PlaneTable:
    """Return the coefficients of blocks."""
    return PlaneTable(np.array(sliders, dtype=np.float64).reshape(-1, columns.FRICTION_COLUMNS))


def run_in_plane(
    friction: Array,
    factors: Array,
    along: Array,
    across: Array,
    vertical: Array | None,
    dt: float,
    skip: bool = True,
    tally: Index | None = None,
    history: Array = NO_HISTORY,
) -> Array:
    """Results (o, m, 11) of friction (o, 2) under factors (o, m) > 0 times one record; all start at rest.

    `along` and `across` (n,) are the accelerations along the width and the depth of the block, m/s², and `vertical`
    (n,) the vertical one, scaled likewise.  Runs in which it takes the whole weight at some instant are NaN.  Other
    arguments as of `run_sliders`.  The slip is solved piece by piece as a Taylor series of order 14 whose last terms
    are below 1e-12 m/s; where the push does not turn, as a cubic, exactly.  ArithmeticError for a run that takes
    too many pieces, as none with the accelerations of earthquakes does.
    """
    which = np.repeat(np.arange(factors.shape[0]), factors.shape[1])
    scale = np.ascontiguousarray(factors.ravel())
    upward = NO_VERTICAL if vertical is None else np.ascontiguousarray(vertical)
    x, y = np.ascontiguousarray(along), np.ascontiguousarray(across)
    coefficients = np.ascontiguousarray(friction[which])
    out = np.empty((which.size, columns.OUT_COLUMNS))
    lifted: Flags = np.zeros(scale.size, np.bool_)
    if upward.size > 0:
        lifted[:] = airborne(upward, scale)
    first, last = _moving(x, y, upward, coefficients[:, 0], scale)
    if not skip:
        first, last = 0 * which, np.full(which.size, x.size)
    shaking = columns.PlaneShaking(x, y, upward, dt)
    stays = np.flatnonzero(np.logical_not(lifted))
    if stays.size:
        found = np.empty((stays.size, columns.OUT_COLUMNS))
        slide_in_plane(shaking, coefficients[stays], scale[stays], first[stays], last[stays], found, history)
        if np.isnan(found[:, OUT_PEAK]).any():
            raise ArithmeticError(
                f"sliding in the plane takes more than {columns.MOST_PIECES:,} pieces in a sample: the motion is too "
                "strong for its time step"
            )
        out[stays] = found
    out[lifted] = np.nan
    if tally is not None:
        tally[0] += which.size * x.size
        tally[1] += int(first.sum())
    return out.reshape(*factors.shape, columns.OUT_COLUMNS)


def _moving(x: Array, y: Array, vertical: Array, static: Array, scale: Array) -> tuple[Index, Index]:
    """Samples before which runs cannot slide, and after which they cannot begin to.

    As of runs in one direction: the size of the acceleration is convex within a sample, so that its samples tell.
    """
    demand = np.hypot(x, y)
    if vertical.size > 0:
        demand = demand + float(static.max(initial=0.0)) * np.maximum(0.0, -vertical)
    return beyond(demand, static, scale)
