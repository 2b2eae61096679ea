"""Runs of sliding blocks as plain arrays: friction and scale factors in, results out.  Calls the compiled engine."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...core.aliases import Array, Index
from ...core.units import DIMENSIONLESS, METRE, SECOND, STANDARD_GRAVITY, VELOCITY
from ..slip import tables
from ..slip.lanes import slide
from ..slip.obstacle import run_into
from .law import Slider

SLIDES: dict[str, int] = {
    "slide_peak": tables.OUT_PEAK,
    "slide_forward": tables.OUT_FORWARD,
    "slide_backward": tables.OUT_BACKWARD,
    "slide_residual": tables.OUT_RESIDUAL,
    "slide_path": tables.OUT_PATH,
    "slide_velocity": tables.OUT_SPEED,
    "slips": tables.OUT_SLIPS,
    "first_slip_time": tables.OUT_FIRST,
    "slide_after": tables.OUT_AFTER,
}
"""Results of a sliding run by name, and their column."""
TRIP_VELOCITY = "trip_velocity"
OF_OBSTACLES: dict[str, int] = {TRIP_VELOCITY: tables.OUT_MET}
"""Results of a run towards an obstacle."""
LABELS: dict[str, tuple[str, str]] = {
    "slide_peak": (METRE, "greatest slip to either side"),
    "slide_forward": (METRE, "greatest slip to the front"),
    "slide_backward": (METRE, "greatest slip to the back"),
    "slide_residual": (METRE, "slip in which the block comes to rest"),
    "slide_path": (METRE, "way that the block slides in all"),
    "slide_velocity": (VELOCITY, "greatest velocity relative to the floor"),
    "slips": (DIMENSIONLESS, "number of times that the block begins to slide or turns round"),
    "first_slip_time": (SECOND, "time at which the block first slides, NaN if it stays"),
    "slide_after": (METRE, "way that the block slides after the end of the motion, on a floor at rest"),
    TRIP_VELOCITY: (VELOCITY, "velocity with which the block first meets the obstacle, NaN if it does not get there"),
}
"""Units and long name of each result."""

ONE_WAY = 1e300
"""Static friction that nothing exceeds: infinity times a vertical acceleration of zero has no value."""
NO_HISTORY = np.empty((tables.HISTORY_ROWS, 0))
NO_VERTICAL = np.empty(0)


def friction_table(sliders: Sequence[Slider]) -> Array:
    """Return the coefficients of sliders (slider, 4) as the engine reads them.

    Where any is near an obstacle, a fifth column is the distance.
    """
    found = np.array(sliders, dtype=np.float64).reshape(-1, tables.COEFFICIENTS + 1)
    near = bool(np.isfinite(found[:, tables.COEFFICIENTS]).any())
    return np.asarray(np.minimum(found if near else found[:, : tables.COEFFICIENTS], ONE_WAY))


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

    `vertical` (n,) is the vertical acceleration, scaled likewise.  Runs in which it takes the whole weight at some
    instant are NaN.  `skip` leaves out what lies before the first and after the last slip, which changes nothing.
    `tally` (samples of all runs, those left out, …: see `models.runs.TALLY`) is added to.  With a fifth column of
    `friction`, the slip to either side at which there is an obstacle, m, runs that slide so far are followed once more,
    for a tenth column: the speed with which they first meet it.  All other results are those without an obstacle.
    """
    which = np.repeat(np.arange(factors.shape[0]), factors.shape[1])
    scale = factors.ravel()
    upward = NO_VERTICAL if vertical is None else np.ascontiguousarray(vertical)
    record = np.ascontiguousarray(acceleration)
    held = np.minimum(friction[:, 0], friction[:, 1])[which]
    first, last = _moving(record, upward, held, scale) if skip else (0 * which, np.full(which.size, record.size))
    # Runs that slide alike are side by side; the later a block slides first, the higher its threshold is.
    order = np.argsort(held / scale, kind="stable")
    out = np.empty((which.size, tables.OUT_COLUMNS))
    shaking = tables.Shaking(record, upward, dt)
    coefficients = np.ascontiguousarray(friction[which[order], : tables.COEFFICIENTS])
    slide(shaking, coefficients, scale[order], first[order], last[order], out, history)
    if friction.shape[1] > tables.COEFFICIENTS:
        obstacles = friction[which[order], tables.COEFFICIENTS]
        far = np.flatnonzero(out[:, tables.OUT_PEAK] > obstacles)
        own, met, velocity = order[far], np.empty(far.size), np.full(order.size, np.nan)
        run_into(shaking, coefficients[far], scale[own], first[own], obstacles[far], met)
        velocity[far] = met
        out = np.column_stack([out, velocity])
    found = np.empty_like(out)
    found[order] = out
    if upward.size > 0:
        found[airborne(upward, scale)] = np.nan
    if tally is not None:
        tally[0] += which.size * record.size
        tally[1] += int(first.sum())
    return np.asarray(found.reshape(*factors.shape, out.shape[1]))


def airborne(vertical: Array, factors: Array) -> Array:
    """Return True for each factor under which the vertical acceleration (n,) takes the whole weight at some instant."""
    return np.asarray(STANDARD_GRAVITY + factors * vertical.min() <= 0.0)


def _moving(record: Array, vertical: Array, held: Array, scale: Array) -> tuple[Index, Index]:
    """Samples before which runs cannot slide, and after which they cannot begin to.

    A block stays while abs(u'') <= static (g + w''): certainly while abs(u'') + static max(0, -w'') is not above
    static g, with the largest static friction of the runs that can slide both ways for the product; and a little below
    that, since the products of the engine are rounded in another way.
    """
    demand = np.abs(record)
    if vertical.size > 0:
        most = float(held[held < ONE_WAY].max(initial=0.0))
        demand = demand + most * np.maximum(0.0, -vertical)
    return beyond(demand, held, scale)


def beyond(demand: Array, static: Array, scale: Array) -> tuple[Index, Index]:
    """Return, of runs, the sample before the first and the one after the last at which a demand exceeds friction."""
    threshold = (1.0 - 1e-12) * static * STANDARD_GRAVITY / scale
    first = np.searchsorted(np.maximum.accumulate(demand), threshold, side="right")
    last = demand.size - np.searchsorted(np.maximum.accumulate(demand[::-1]), threshold, side="right")
    return np.maximum(first - 1, 0), last
