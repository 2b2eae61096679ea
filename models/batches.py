"""Batches of runs as the engine reads them: the records of several motions laid out one after the other."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..core.aliases import Array, Index
from ..core.units import STANDARD_GRAVITY
from .engine import tables
from .oscillator import Stack

NO_TURNS = np.empty((2, 0))
NO_HISTORY = np.empty((tables.HISTORY_ROWS, 0))
_NOTHING_LEFT = np.empty(0)


class Records(NamedTuple):
    """Records of one step dt, s, one after the other.

    record (n,): accelerations, m/s²; lifting (n or 0): the vertical ones over g; start, last (k,): of each record, the
    place of its first sample and the number of its last one.
    """

    dt: float
    record: Array
    lifting: Array
    start: Index
    last: Index


def flushed(values: Array) -> Array:
    """Return the values with 0 in place of those that are too small for the engine."""
    tiny = np.abs(values) < tables.NOTHING
    return np.where(tiny, 0.0, values) if tiny.any() else values


def lay_out(accelerations: Sequence[Array], dt: float, verticals: Sequence[Array] = ()) -> Records:
    """Lay out records (n,), m/s², and the vertical components of all or none of them, m/s² upward, for the engine.

    Each begins at a whole span, with room behind it for what the lanes read ahead.  The way from one to the next is an
    odd number of spans: records of equal length would else share the same sets of the processor's cache.
    """
    sizes = np.array([one.size for one in accelerations], np.int64)
    spans = (sizes + tables.TILE) // tables.SPAN + 1
    spans += 1 - spans % 2
    start = np.zeros(sizes.size, np.int64)
    np.cumsum(spans[:-1] * tables.SPAN, out=start[1:])
    total = int(spans.sum()) * tables.SPAN
    record = _one_after_another(accelerations, start, total, 1.0)
    lifting = _one_after_another(verticals, start, total, STANDARD_GRAVITY) if len(verticals) > 0 else np.empty(0)
    return Records(dt, record, lifting, start, sizes - 1)


def _one_after_another(values: Sequence[Array], start: Index, total: int, unit: float) -> Array:
    """Return records in units of `unit`, with zeros between them."""
    found = np.empty(total)
    for first, stop, one in zip(start.tolist(), [*start[1:].tolist(), total], values, strict=True):
        found[first : first + one.size] = one if unit == 1.0 else one / unit
        found[first + one.size : stop] = 0.0
    return found


def batch_of(
    records: Records,
    stacked: Stack,
    which: Index,
    motion: Index,
    factors: Array,
    tally: Index,
    turns: Array = NO_TURNS,
    history: Array = NO_HISTORY,
) -> tables.Batch:
    """Return runs of oscillators which[j] under factors[j] times record motion[j], with room for their results.

    Vertical shaking of an oscillator in linear geometry is a ValueError.
    """
    oscillators, regions, _ = stacked.tables.shape
    if records.lifting.size > 0 and not stacked.parameters[:, tables.PAR_EXACT].all():
        raise ValueError("vertical shaking needs exact geometry, got an oscillator in linear geometry")
    return tables.Batch(
        shaking=tables.Shaking(
            record=records.record,
            dt=records.dt,
            highs=np.zeros(records.record.size // tables.SPAN),
            start=records.start[motion],
            last=records.last[motion],
            strongest=np.empty(which.size),
        ),
        model=tables.Model(*stacked),
        steps=np.zeros((oscillators, regions, tables.STEP_COLUMNS)),
        which=which,
        # (numba compiles once more for arrays that are read-only or not contiguous)
        factors=np.require(factors, requirements=["C", "W"]),
        first=np.zeros(which.size, np.int64),
        begin=np.zeros((which.size, 4)),
        lifting=records.lifting,
        lifting_highs=np.zeros(records.lifting.size // tables.SPAN),
        shaking_left=_NOTHING_LEFT,
        lifting_left=_NOTHING_LEFT,
        barriers=np.zeros((oscillators, 7)),
        out=np.empty((which.size, tables.OUT_COLUMNS)),
        turns=turns,
        history=history,
        tally=tally,
    )
