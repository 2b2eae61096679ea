"""Lanes: the states of the runs that go in lockstep, and of the runs that wait or bounce apart from them."""

import math
from typing import Any, NamedTuple

import numpy as np

from ...core.compiled import kernel
from .tables import (
    BACK,
    BARE,
    BREAK_TIME,
    BROKEN,
    FLAT,
    FRONT,
    FUSED,
    HELD,
    HISTORY_DAMPING,
    HISTORY_OMEGA,
    HISTORY_PEAK,
    HISTORY_REGION,
    HISTORY_THETA,
    IMPACTS,
    LANE_ROWS,
    LANES,
    LINK_HELD,
    NEED,
    NOW,
    OMEGA,
    OUT_AIRBORNE,
    OUT_BACK,
    OUT_BREAK_TIME,
    OUT_BROKEN,
    OUT_DIRECTION,
    OUT_FRONT,
    OUT_IMPACTS,
    OUT_OVERTURN_TIME,
    OUT_OVERTURNED,
    OUT_PEAK,
    OUT_STRIKE,
    OUT_UPLIFTED,
    OUT_WALL_IMPACTS,
    OUT_WALL_STRIKE,
    OUT_WELL,
    OVERTURN_TIME,
    OVERTURNED,
    PAR_SIDED,
    PAR_START,
    REGION_DAMPING,
    REST,
    ROW_AMPLITUDE,
    ROW_CALM_LOWER,
    ROW_CALM_UPPER,
    ROW_EVEN,
    ROW_LOWER,
    ROW_ODD,
    ROW_SQUARE,
    ROW_UPPER,
    SAFE,
    SIDED,
    STATE_FLOATS,
    STATE_INTEGERS,
    STEP_DAMPING,
    STRIKE,
    THETA,
    UPLIFTED,
    WAITS,
    WALL_IMPACTS,
    WALL_STRIKE,
    WELL,
)


class Lanes(NamedTuple):
    """The arrays of the lanes.

    `rows`: the lockstep state, flat. `marks`, `words`: lanes that a step has marked, one and eight at a time. `x`, `k`:
    the state of each run. `held`: the propagator of a zone whose damping is held. `steps`: the propagators of all
    regions (o, r, 8). `oscillator`, `run`, `amplitude`: of each lane. `start`: place of its record (see `Shaking`).
    `pieces`, `zones`, `zone_lane`, `turns`, `turn_lane`: columns that wait to be solved together, and their lanes.
    `parked`, `parked_at`, `parked_time`: lanes with an event, its sample and the time in it. `leaving`: lanes that rest
    or bounce low (its last entry counts them). `until`: the sample at which such a lane continues.
    """

    rows: Any
    marks: Any
    words: Any
    x: Any
    k: Any
    held: Any
    steps: Any
    oscillator: Any
    run: Any
    amplitude: Any
    start: Any
    pieces: Any
    zones: Any
    zone_lane: Any
    turns: Any
    turn_lane: Any
    parked: Any
    parked_at: Any
    parked_time: Any
    leaving: Any
    until: Any


class Sleepers(NamedTuple):
    """Runs without a lane: state, oscillator, run, amplitude, place of the record, and a sample.

    It is the end of a block's rest, or the progress of a bouncing block.
    """

    x: Any
    k: Any
    oscillator: Any
    run: Any
    amplitude: Any
    start: Any
    until: Any


@kernel(**FUSED)
def store_sample(history, i, x, k, model, o):
    """Write the state at sample i into a history."""
    region = k[NOW]
    history[HISTORY_THETA, i] = x[THETA]
    history[HISTORY_OMEGA, i] = x[OMEGA]
    history[HISTORY_REGION, i] = region
    history[HISTORY_DAMPING, i] = 0.0
    history[HISTORY_PEAK, i] = max(x[FRONT], x[BACK], abs(x[THETA]))
    if region >= 0:
        history[HISTORY_DAMPING, i] = (
            x[HELD] if model.links[o, region, LINK_HELD] else model.tables[o, region, REGION_DAMPING]
        )


@kernel(**FUSED)
def store_fallen(history, i, x):
    """Write the history of an overturned block, which lies still from sample i on."""
    for j in range(i, history.shape[1]):
        history[HISTORY_THETA, j] = math.copysign(FLAT, x[THETA])
        history[HISTORY_OMEGA, j] = 0.0
        history[HISTORY_REGION, j] = REST
        history[HISTORY_DAMPING, j] = 0.0
        history[HISTORY_PEAK, j] = FLAT


@kernel(**BARE)
def freeze_lane(s, lane):
    """Mark no sample of a lane until it is loaded again; meanwhile its state drifts on, for less than a tile."""
    s[ROW_UPPER * LANES + lane] = math.inf
    s[ROW_LOWER * LANES + lane] = -math.inf
    s[ROW_CALM_UPPER * LANES + lane] = math.inf
    s[ROW_CALM_LOWER * LANES + lane] = -math.inf


@kernel(**FUSED)
def reset(x, k, theta, omega, peak, region, start):
    """Set the state of a run at its first sample."""
    x[THETA] = theta
    x[OMEGA] = omega
    x[HELD] = 0.0
    x[FRONT] = peak
    x[BACK] = peak
    x[OVERTURN_TIME] = math.nan
    x[STRIKE] = 0.0
    x[WALL_STRIKE] = 0.0
    x[BREAK_TIME] = math.nan
    for j in range(STATE_INTEGERS):
        k[j] = 0
    k[NOW] = region
    k[UPLIFTED] = 1 if region != start else 0


@kernel(**FUSED)
def begin_run(x, k, model, o, begin):
    """Set the state of a run of oscillator o at its first sample: rotation, velocity, peak and region in `begin`."""
    reset(x, k, begin[0], begin[1], begin[2], int(begin[3]), int(model.parameters[o, PAR_START]))
    if model.parameters[o, PAR_SIDED] != 0.0:
        k[SIDED] = 1
        x[FRONT] = max(x[THETA], 0.0)
        x[BACK] = max(0.0, -x[THETA])  # (never -0)


@kernel(**FUSED)
def clear_lane(s, lane):
    """Fill a lane with rows that are never marked: padding, and lanes whose run has ended."""
    for row in range(LANE_ROWS):
        s[row * LANES + lane] = 0.0
    s[(ROW_EVEN + 1) * LANES + lane] = 1.0
    s[(ROW_ODD + 1) * LANES + lane] = 1.0
    s[ROW_UPPER * LANES + lane] = math.inf
    s[ROW_LOWER * LANES + lane] = -math.inf
    s[ROW_CALM_UPPER * LANES + lane] = math.inf
    s[ROW_CALM_LOWER * LANES + lane] = -math.inf


@kernel(**FUSED)
def write_result(out, j, x, k):
    """Write the results of a run, from its state, into row j of `out`."""
    out[j, OUT_OVERTURNED] = k[OVERTURNED]
    out[j, OUT_PEAK] = math.nan if k[SAFE] != 0 else max(x[FRONT], x[BACK])
    out[j, OUT_UPLIFTED] = k[UPLIFTED]
    out[j, OUT_IMPACTS] = k[IMPACTS]
    out[j, OUT_OVERTURN_TIME] = x[OVERTURN_TIME]
    out[j, OUT_STRIKE] = x[STRIKE]
    out[j, OUT_DIRECTION] = 0.0 if k[OVERTURNED] == 0 else math.copysign(1.0, x[THETA])
    out[j, OUT_FRONT] = x[FRONT] if k[SIDED] != 0 and k[SAFE] == 0 else math.nan
    out[j, OUT_BACK] = x[BACK] if k[SIDED] != 0 and k[SAFE] == 0 else math.nan
    out[j, OUT_WALL_IMPACTS] = k[WALL_IMPACTS]
    out[j, OUT_WALL_STRIKE] = x[WALL_STRIKE]
    out[j, OUT_BROKEN] = k[BROKEN]
    out[j, OUT_BREAK_TIME] = x[BREAK_TIME]
    out[j, OUT_WELL] = k[WELL] if k[OVERTURNED] == 0 else math.copysign(2.0, x[THETA])
    out[j, OUT_AIRBORNE] = 0.0


@kernel(**FUSED)
def fetch_lane(w, lane, now):
    """Copy a lane's rotation and velocity from the lockstep rows to its state."""
    w.x[lane, THETA] = w.rows[now * LANES + lane]
    w.x[lane, OMEGA] = w.rows[(now + 1) * LANES + lane]


@kernel(**FUSED)
def _copy(target, source):
    for j in range(source.shape[0]):
        target[j] = source[j]


@kernel(**FUSED)
def copy_run(target, to, source, j):
    """Copy run j of `source` to a place of `target`: each holds the runs in lanes, or runs without a lane."""
    _copy(target.x[to], source.x[j])
    _copy(target.k[to], source.k[j])
    target.oscillator[to] = source.oscillator[j]
    target.run[to] = source.run[j]
    target.start[to] = source.start[j]
    target.amplitude[to] = source.amplitude[j]
    target.until[to] = source.until[j]


@kernel(**FUSED)
def leave_lane(w, lane, last):
    """Free a lane: the last active lane takes its place."""
    for row in range(LANE_ROWS):
        w.rows[row * LANES + lane] = w.rows[row * LANES + last]
    copy_run(w, lane, w, last)
    _copy(w.held[lane], w.held[last])
    clear_lane(w.rows, last)


@kernel(inline="always")
def set_lane_amplitude(s, lane, amplitude):
    """Set the factor on the record in the lockstep rows of a lane."""
    s[ROW_AMPLITUDE * LANES + lane] = amplitude
    s[ROW_SQUARE * LANES + lane] = amplitude * amplitude


@kernel(**FUSED)
def set_amplitude(w, lane, amplitude):
    """Set the factor on the record for the run in a lane."""
    w.amplitude[lane] = amplitude
    set_lane_amplitude(w.rows, lane, amplitude)


@kernel(**FUSED)
def take_lane(w, lane, z, j):
    """Copy run j of those without a lane into a lane."""
    copy_run(w, lane, z, j)
    w.held[lane, STEP_DAMPING] = -1.0
    set_lane_amplitude(w.rows, lane, z.amplitude[j])


@kernel(**FUSED)
def rejoin(w, f, active, bouncing, parked, last, end):
    """Give lanes to the blocks that no longer bounce low, and to those whose records end by sample `end`.

    Returns the numbers active, bouncing and parked.
    """
    b = f.runs
    j = np.int64(0)
    while j < bouncing:
        if b.k[j, NEED] != WAITS and last[b.run[j]] > end:
            j += 1
            continue
        take_lane(w, active, b, j)
        w.k[active, NEED] = WAITS  # its sample is done
        w.parked[parked] = active
        w.parked_at[parked] = b.until[j] - 1
        parked += 1
        active += 1
        bouncing -= 1
        copy_run(b, j, b, bouncing)
        f.time[j] = f.time[bouncing]
    return active, bouncing, parked


@kernel(**FUSED)
def sort(values, n):
    """Sort the first n values, few or nearly sorted, in ascending order (numpy's sort takes seconds to compile)."""
    for i in range(1, n):
        value = values[i]
        j = i
        while j > 0 and values[j - 1] > value:
            values[j] = values[j - 1]
            j -= 1
        values[j] = value


@kernel()
def no_runs(n):
    """Return arrays for n runs without a lane."""
    return Sleepers(
        np.empty((n, STATE_FLOATS)),
        np.empty((n, STATE_INTEGERS), np.int64),
        np.empty(n, np.int64),
        np.empty(n, np.int64),
        np.empty(n),
        np.empty(n, np.int64),
        np.empty(n, np.int64),
    )
