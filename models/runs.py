"""Runs as plain arrays: oscillators and scale factors in, results out.  No labels; calls the compiled engine."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from functools import lru_cache
from importlib import metadata
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from . import _piecewise as engine
from .oscillator import Oscillator, Stack, stack

OUTPUTS: dict[str, int] = {
    "overturned": engine.OUT_OVERTURNED,
    "peak_rotation": engine.OUT_PEAK,
    "uplifted": engine.OUT_UPLIFTED,
    "impacts": engine.OUT_IMPACTS,
    "overturning_time": engine.OUT_OVERTURN_TIME,
    "impact_velocity": engine.OUT_STRIKE,
    "direction": engine.OUT_DIRECTION,
}
"""Results of a run by name, and their column."""

TALLY: tuple[str, ...] = ("samples", "before_uplift", "after_overturning", "cannot_overturn", "events")
"""What the engine counts: samples of all runs, the samples left out by reason, and the events solved."""

_NO_START = np.empty(0)

# Accelerations and states below this are zero: products of denormal numbers have no sign left to decide an event.
_NOTHING = 1e-200


def _flushed(values: NDArray[np.float64]) -> NDArray[np.float64]:
    tiny = np.abs(values) < _NOTHING
    return np.where(tiny, 0.0, values) if tiny.any() else values


def run_many(
    oscillators: Sequence[Oscillator],
    factors: NDArray[np.float64],
    acceleration: NDArray[np.float64],
    dt: float,
    skip: bool = True,
    flags_only: bool = False,
    tally: NDArray[np.int64] | None = None,
) -> NDArray[np.float64]:
    """Results (o, m, 7) of every oscillator under factors (o, m) times one record (n,), m/s², all starting at rest.

    `skip` leaves out what is known before the first uplift; flags do not change, peaks only by rounding.  With
    `flags_only` it also ends a run once the rest of the record cannot overturn the block: then only the overturned flag
    is right.  `tally` (see `TALLY`) is added to.
    """
    return run_stacked(stack(oscillators), factors, acceleration, dt, skip, flags_only, tally)


def run_stacked(
    tables: Stack,
    factors: NDArray[np.float64],
    acceleration: NDArray[np.float64],
    dt: float,
    skip: bool = True,
    flags_only: bool = False,
    tally: NDArray[np.int64] | None = None,
) -> NDArray[np.float64]:
    """As `run_many`, of oscillators that are stacked already: that takes as long as some runs, so once for all motions.

    The tables belong to one caller at a time.
    """
    counts = np.zeros(engine.TALLY_COLUMNS, np.int64) if tally is None else tally
    which = np.repeat(np.arange(factors.shape[0]), factors.shape[1])
    out = np.empty((which.size, engine.OUT_COLUMNS))
    engine.run_batch(
        _flushed(acceleration),
        dt,
        *tables,
        which,
        np.ascontiguousarray(factors).ravel(),
        _NO_START,
        skip,
        flags_only,
        out,
        np.empty((2, 0)),
        np.empty((engine.HISTORY_ROWS, 0)),
        counts,
    )
    if flags_only:
        out[:, 1:] = np.nan
    return out.reshape(*factors.shape, engine.OUT_COLUMNS)


@lru_cache(maxsize=1)
def engine_identity() -> dict[str, str]:
    """What decides the bits of a run beside its numbers: versions, and a hash of the engine's source."""
    source = hashlib.sha256()
    for file in sorted(Path(__file__).parent.glob("*.py")):
        source.update(file.read_bytes())
    versions = {name: metadata.version(name) for name in ("toppling", "numpy", "numba")}
    return {**versions, "engine": source.hexdigest()[:12]}


def prepare(oscillators: Sequence[Oscillator]) -> None:
    """Load the compiled engine, or compile it (some 20 s, once after installation), so that no run waits for it."""
    run_many(oscillators[:1], np.ones((1, 1)), np.zeros(2), 0.01)


class Trace(NamedTuple):
    """One run in full: results (7,), history (4, n) at the samples, turning points (2, t): time and rotation."""

    results: NDArray[np.float64]
    history: NDArray[np.float64]
    turning_points: NDArray[np.float64]


def trace(
    oscillator: Oscillator,
    acceleration: NDArray[np.float64],
    dt: float,
    theta0: float = 0.0,
    omega0: float = 0.0,
    max_turning_points: int = 0,
) -> Trace:
    """One run with its history, from (theta0, omega0)."""
    theta, omega = _flushed(np.array([theta0, omega0]))
    start = np.array([theta, omega, float(oscillator.region_at(theta, omega))])
    out = np.empty((1, engine.OUT_COLUMNS))
    history = np.empty((engine.HISTORY_ROWS, acceleration.size))
    turning_points = np.empty((2, max_turning_points))
    found = engine.run_batch(
        _flushed(acceleration),
        dt,
        *stack([oscillator]),
        np.zeros(1, np.int64),
        np.ones(1),
        start,
        False,
        False,
        out,
        turning_points,
        history,
        np.zeros(engine.TALLY_COLUMNS, np.int64),
    )
    return Trace(out[0], history, turning_points[:, : min(found, max_turning_points)])
