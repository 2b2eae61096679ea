"""Runs of sliding blocks, along one axis or in the plane of the floor: friction and factors in, results out, as arrays.

They call the compiled engine.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ...core.aliases import Array, Flags, Index
from ...core.units import STANDARD_GRAVITY
from ..sliding_engine import plane_tables, tables
from ..sliding_engine.lanes import slide
from ..sliding_engine.obstacle import run_into
from ..sliding_engine.plane import slide_in_plane
from .law import PlaneSlider, Slider

ONE_WAY = 1e300
"""Static friction that nothing exceeds: infinity times a vertical acceleration of zero has no value."""
NO_HISTORY = np.empty((tables.HISTORY_ROWS, 0))
IN_PLANE: dict[str, int] = {
    "slide_residual_along": plane_tables.OUT_RESIDUAL_X,
    "slide_residual_across": plane_tables.OUT_RESIDUAL_Y,
}
"""Results that only a run in the plane has; the results of `SLIDES` have the columns of runs in one direction."""
NO_PATH = np.empty((plane_tables.HISTORY_ROWS, 0))
NO_VERTICAL = np.empty(0)


def friction_table(sliders: Sequence[Slider]) -> Array:
    """Return the coefficients of sliders (slider, 4) as the engine reads them.

    If any is near an obstacle, a fifth column is the distance.
    """
    table = np.array(sliders, dtype=np.float64).reshape(-1, tables.COEFFICIENTS + 1)
    near = bool(np.isfinite(table[:, tables.COEFFICIENTS]).any())
    return np.asarray(np.minimum(table if near else table[:, : tables.COEFFICIENTS], ONE_WAY))


def run_sliders(
    friction: Array,
    factors: Array,
    acceleration: Array,
    vertical: Array | None,
    dt: float,
    skip: bool = True,
    tally: Index | None = None,
    history: Array = NO_HISTORY,
) -> Array:
    """Results (o, m, 9) of friction (o, 4) under factors (o, m) > 0 times one record (n,), m/s²; all start at rest.

    `vertical` (n,) is the vertical acceleration, scaled likewise. Runs in which it takes the whole weight at some
    instant are NaN. `skip` leaves out samples before the first and after the last slip, which changes nothing. `tally`
    (samples of all runs, omitted samples, …: see `models.runs.TALLY`) is added to. A fifth column of `friction` is the
    slip to either side at which an obstacle is, m. Runs that slide so far are then followed once more, for a tenth
    column: the speed with which they first meet it. All other results are without an obstacle.
    """
    which = np.repeat(np.arange(factors.shape[0]), factors.shape[1])
    scale = factors.ravel()
    upward = NO_VERTICAL if vertical is None else np.ascontiguousarray(vertical)
    record = np.ascontiguousarray(acceleration)
    held = np.minimum(friction[:, 0], friction[:, 1])[which]
    first, last = 0 * which, np.full(which.size, record.size)
    if skip:
        first, last = _moving(np.abs(record), upward, held, scale)
    # Runs that slide alike are side by side; the later a block slides first, the higher its threshold is.
    order = np.argsort(held / scale, kind="stable")
    out = np.empty((which.size, tables.OUT_COLUMNS))
    shaking = tables.Shaking(record, upward, dt)
    coefficients = np.ascontiguousarray(friction[which[order], : tables.COEFFICIENTS])
    slide(shaking, coefficients, scale[order], first[order], last[order], out, history)
    if friction.shape[1] > tables.COEFFICIENTS:
        obstacles = friction[which[order], tables.COEFFICIENTS]
        far = np.flatnonzero(out[:, tables.OUT_PEAK] > obstacles)
        hits, met, velocity = order[far], np.empty(far.size), np.full(order.size, np.nan)
        run_into(shaking, coefficients[far], scale[hits], first[hits], obstacles[far], met)
        velocity[far] = met
        out = np.column_stack([out, velocity])
    results = np.empty_like(out)
    results[order] = out
    if upward.size > 0:
        results[airborne(upward, scale)] = np.nan
    if tally is not None:
        tally[0] += which.size * record.size
        tally[1] += int(first.sum())
    return np.asarray(results.reshape(*factors.shape, out.shape[1]))


def airborne(vertical: Array, factors: Array) -> Array:
    """Return True for each factor under which the vertical acceleration (n,) takes the whole weight at some instant."""
    return np.asarray(STANDARD_GRAVITY + factors * vertical.min() <= 0.0)


def _moving(demand: Array, vertical: Array, static: Array, scale: Array) -> tuple[Index, Index]:
    """Samples before which runs cannot slide, and after which they cannot begin to.

    A block stays while the size of the acceleration, `demand`, is not above static (g + w''). This is certain while
    demand + static max(0, -w'') is not above static g. The product has the largest static friction of the runs that can
    slide both ways. The bound is lowered a little, since the products of the engine are rounded in another way.
    """
    if vertical.size > 0:
        most = float(static[static < ONE_WAY].max(initial=0.0))
        demand = demand + most * np.maximum(0.0, -vertical)
    threshold = (1.0 - 1e-12) * static * STANDARD_GRAVITY / scale
    first = np.searchsorted(np.maximum.accumulate(demand), threshold, side="right")
    last = demand.size - np.searchsorted(np.maximum.accumulate(demand[::-1]), threshold, side="right")
    return np.maximum(first - 1, 0), last


class PlaneTable(NamedTuple):
    """The coefficients of blocks (block, 2), static and kinetic, as the engine reads them."""

    friction: Array


def plane_table(sliders: Sequence[PlaneSlider]) -> PlaneTable:
    """Return the coefficients of blocks."""
    return PlaneTable(np.array(sliders, dtype=np.float64).reshape(-1, plane_tables.FRICTION_COLUMNS))


def run_in_plane(
    friction: Array,
    factors: Array,
    acceleration: tuple[Array, Array],
    vertical: Array | None,
    dt: float,
    skip: bool = True,
    tally: Index | None = None,
    history: Array = NO_PATH,
) -> Array:
    """Results (o, m, 11) of friction (o, 2) under factors (o, m) > 0 times one record; all start at rest.

    `acceleration` is along the width and along the depth of the block, (n,) each, m/s², and `vertical` (n,) the
    vertical one, scaled likewise. Runs in which it takes the whole weight at some instant are NaN. Other arguments as
    of `run_sliders`. The slip is solved piece by piece as a Taylor series of order 14 whose last terms are below 1e-12
    m/s. If the push does not turn, the slip is an exact cubic. ArithmeticError for a run that takes too many pieces,
    which the accelerations of earthquakes never cause.
    """
    which = np.repeat(np.arange(factors.shape[0]), factors.shape[1])
    scale = np.ascontiguousarray(factors.ravel())
    upward = NO_VERTICAL if vertical is None else np.ascontiguousarray(vertical)
    x, y = (np.ascontiguousarray(component) for component in acceleration)
    coefficients = np.ascontiguousarray(friction[which])
    out = np.empty((which.size, plane_tables.OUT_COLUMNS))
    lifted: Flags = np.zeros(scale.size, np.bool_)
    if upward.size > 0:
        lifted[:] = airborne(upward, scale)
    first, last = 0 * which, np.full(which.size, x.size)
    if skip:  # (the size of the acceleration is convex within a sample, so that its samples tell)
        first, last = _moving(np.hypot(x, y), upward, coefficients[:, 0], scale)
    shaking = plane_tables.PlaneShaking(x, y, upward, dt)
    stays = np.flatnonzero(np.logical_not(lifted))
    if stays.size:
        results = np.empty((stays.size, plane_tables.OUT_COLUMNS))
        slide_in_plane(shaking, coefficients[stays], scale[stays], first[stays], last[stays], results, history)
        if np.isnan(results[:, tables.OUT_PEAK]).any():
            raise ArithmeticError(
                f"sliding in the plane takes more than {plane_tables.MOST_PIECES:,} pieces in a sample: the motion is "
                "too strong for its time step"
            )
        out[stays] = results
    out[lifted] = np.nan
    if tally is not None:
        tally[0] += which.size * x.size
        tally[1] += int(first.sum())
    return out.reshape(*factors.shape, plane_tables.OUT_COLUMNS)
