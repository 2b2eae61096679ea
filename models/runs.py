"""Runs as plain arrays: oscillators and scale factors in, results out.  No labels; calls the compiled engine."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from functools import lru_cache
from importlib import metadata
from pathlib import Path
from typing import NamedTuple, cast

import numpy as np

from ..aliases import Array, Index
from .engine import tables
from .engine.exact_runs import run_exact
from .engine.linear_runs import run_lanes
from .engine.starts import begin_runs
from .oscillator import Oscillator, Stack, stack

OUTPUTS: dict[str, int] = {
    "overturned": tables.OUT_OVERTURNED,
    "peak_rotation": tables.OUT_PEAK,
    "uplifted": tables.OUT_UPLIFTED,
    "impacts": tables.OUT_IMPACTS,
    "overturning_time": tables.OUT_OVERTURN_TIME,
    "impact_velocity": tables.OUT_STRIKE,
    "direction": tables.OUT_DIRECTION,
    "peak_front": tables.OUT_FRONT,
    "peak_back": tables.OUT_BACK,
    "wall_impacts": tables.OUT_WALL_IMPACTS,
    "wall_impact_velocity": tables.OUT_WALL_STRIKE,
    "ruptured": tables.OUT_BROKEN,
    "rupture_time": tables.OUT_BREAK_TIME,
    "final_state": tables.OUT_WELL,
}
"""Results of a run by name, and their column."""

TALLY: tuple[str, ...] = tables.TALLY
"""The engine's counts: samples of all runs, samples left out by reason, and events solved."""

_NO_START = np.empty(0)
_NO_TURNS = np.empty((2, 0))
_NO_HISTORY = np.empty((tables.HISTORY_ROWS, 0))

# Accelerations and states below this are zero: products of denormal numbers have no sign left to decide an event.
_NOTHING = 1e-200


def _writable(values: Array) -> Array:
    """Return the values as an array of one type, whoever gave them: numba compiles once more for read-only ones."""
    return np.require(values, requirements=["C", "W"])


def _flushed(values: Array) -> Array:
    tiny = np.abs(values) < _NOTHING
    return np.where(tiny, 0.0, values) if tiny.any() else values


def run_many(
    oscillators: Sequence[Oscillator],
    factors: Array,
    acceleration: Array,
    dt: float,
    skip: bool = True,
    flags_only: bool = False,
    tally: Index | None = None,
) -> Array:
    """Results (o, m, 7) of every oscillator under factors (o, m) times one record (n,), m/s², all starting at rest.

    `skip` leaves out what is known before the first uplift; flags do not change, peaks only by rounding.  With
    `flags_only` it also ends a run once the rest of the record cannot overturn the block: then only the overturned flag
    is right.  `tally` (see `TALLY`) is added to.
    """
    return run_stacked(stack(oscillators), factors, acceleration, dt, skip, flags_only, tally)


def run_stacked(
    stacked: Stack,
    factors: Array,
    acceleration: Array,
    dt: float,
    skip: bool = True,
    flags_only: bool = False,
    tally: Index | None = None,
) -> Array:
    """Run oscillators that are stacked already, as `run_many` does.

    Stacking costs as much as several runs, so a caller stacks once for all motions.  The stacked tables belong to one
    caller at a time: the engine changes them for a while.
    """
    counts = np.zeros(len(TALLY), np.int64) if tally is None else tally
    which = np.repeat(np.arange(factors.shape[0]), factors.shape[1])
    batch = _batch(_flushed(acceleration), dt, stacked, which, factors.ravel(), counts)
    run_batch(batch, _NO_START, skip, flags_only)
    if flags_only:
        batch.out[:, 1:] = np.nan
    return cast("Array", batch.out).reshape(*factors.shape, tables.OUT_COLUMNS)


def run_batch(batch: tables.Batch, start: Array, skip: bool, flags_only: bool) -> int:
    """Run a batch from `start` (theta, omega, region), or all from rest where it is empty.

    `skip`: leave out what is known before the first uplift; with `flags_only` also what cannot overturn the block any
    more, and then only OUT_OVERTURNED is right.  Returns the number of turning points of the last run.
    """
    if skip and flags_only:
        batch = batch._replace(shaking_left=np.zeros(batch.record.size))
    # Each driver is compiled when it is first called: an analysis without exact geometry never compiles the other one.
    linear, exact = begin_runs(batch, start, skip, flags_only)
    turns = 0
    if exact.size > 0:
        turns = run_exact(batch, exact)
    linear = linear[np.argsort(batch.first[linear], kind="stable")]
    for j in range(0, linear.size, tables.LANES):
        turns = run_lanes(batch, linear[j : j + tables.LANES])
    return turns


def _batch(
    record: Array,
    dt: float,
    stacked: Stack,
    which: Index,
    factors: Array,
    tally: Index,
    turns: Array = _NO_TURNS,
    history: Array = _NO_HISTORY,
) -> tables.Batch:
    """Runs of oscillators which[j] under factors[j] * record, with room for their results (see `tables.Batch`)."""
    oscillators, regions, _ = stacked.tables.shape
    return tables.Batch(
        record=_writable(record),
        dt=dt,
        model=tables.Model(*stacked),
        steps=np.zeros((oscillators, regions, tables.STEP_COLUMNS)),
        which=which,
        factors=_writable(factors),
        first=np.zeros(which.size, np.int64),
        begin=np.zeros((which.size, 4)),
        shaking_left=np.empty(0),
        barriers=np.zeros((oscillators, 6)),
        out=np.empty((which.size, tables.OUT_COLUMNS)),
        turns=turns,
        history=history,
        tally=tally,
    )


@lru_cache(maxsize=1)
def engine_identity() -> dict[str, str]:
    """Return the versions, the source hash and the processor that, with the inputs, determine a run to the last bit."""
    from ..machine_code import processor  # noqa: PLC0415 - numba, which takes a second

    source = hashlib.sha256()
    here = Path(__file__).parent
    for file in (here.parent / "compiled.py", here.parent / "machine_code.py", *sorted(here.rglob("*.py"))):
        source.update(file.read_bytes())
    versions = {name: metadata.version(name) for name in ("toppling", "numpy", "numba")}
    return {**versions, "engine": source.hexdigest()[:12], "processor": processor()}


def prepare(oscillators: Sequence[Oscillator]) -> None:
    """Load or compile the engine's drivers that these oscillators need (once after installation: half a minute)."""
    kinds = {oscillator.exact: oscillator for oscillator in oscillators}
    run_many(list(kinds.values()), np.ones((len(kinds), 1)), np.zeros(2), 0.01, skip=False)


class Trace(NamedTuple):
    """One run in full: results (7,), history (4, n) at the samples, turning points (2, t): time and rotation."""

    results: Array
    history: Array
    turning_points: Array


def trace(
    oscillator: Oscillator,
    acceleration: Array,
    dt: float,
    theta0: float = 0.0,
    omega0: float = 0.0,
    max_turning_points: int = 0,
) -> Trace:
    """One run with its history, from (theta0, omega0)."""
    stacked = stack([oscillator])
    theta, omega = _flushed(np.array([theta0, omega0]))
    if theta == 0.0 and omega == 0.0:
        theta = oscillator.balance
    start = np.array([theta, omega, float(oscillator.region_at(theta, omega))])
    batch = _batch(
        _flushed(acceleration),
        dt,
        stacked,
        np.zeros(1, np.int64),
        np.ones(1),
        np.zeros(len(TALLY), np.int64),
        np.empty((2, max_turning_points)),
        np.empty((tables.HISTORY_ROWS, acceleration.size)),
    )
    found = run_batch(batch, start, False, False)
    return Trace(batch.out[0], batch.history, batch.turns[:, : min(found, max_turning_points)])
