"""Runs of one record in lockstep."""

import numpy as np

from ...core.compiled import kernel
from .sample import follow_sample, slide_out
from .tables import (
    BACKWARD,
    BARE,
    COEFFICIENTS,
    DRAG,
    FACTOR,
    FASTEST,
    FIRST,
    FORWARD,
    GRAVITY,
    GRIP,
    HISTORY_SLIP,
    HISTORY_SPEED,
    HOLD,
    LANES,
    LEVEL,
    NEARLY,
    OUT_AFTER,
    OUT_BACKWARD,
    OUT_FIRST,
    OUT_FORWARD,
    OUT_PATH,
    OUT_PEAK,
    OUT_RESIDUAL,
    OUT_SLIPS,
    OUT_SPEED,
    PATH,
    PUSH,
    ROWS,
    SIGN,
    SLIP,
    SLIPS,
    SPEED,
    STATIC_FRONT,
    STILL,
    WAY,
)

# After the last breakaway a group of lanes is checked at this interval of samples: it ends when all of it has stopped.
LOOK = 32


@kernel(**BARE)
def advance(x, marks, n, a0, a1, dt):
    """Move n lanes through a sample, and return the number that may have an event; these are marked and not moved.

    The speed is a quadratic, which differs from its chord by at most |c2| dt²/8 (`room`): above that no stop is
    possible. Its maximum lies where an acceleration ends. At rest all is zero, and nothing moves. Three conditions make
    the loop vectorise. Rows lie at constant offsets in one flat array. The trip count is known at run time only. Every
    lane is stored, because a conditional store would become a masked store, at which some processors are slow.
    """
    count = np.int64(0)
    mean, early, bend, size = 0.5 * (a0 + a1), a0 / 3.0 + a1 / 6.0, 0.125 * abs(a1 - a0), abs(a1)
    for j in range(n):
        push, drag, speed = x[PUSH + j], x[DRAG + j], x[SPEED + j]
        change = push * mean - drag
        later = speed + change
        room = abs(push) * bend
        stops = min(speed, later) < room
        peaks = (push * a0 > drag) & (push * a1 <= drag) & (max(speed, later) + room > x[FASTEST + j])
        look = (size > x[LEVEL + j]) | stops | peaks
        x[WAY + j] += 0.0 if look else dt * (speed + push * early - 0.5 * drag)
        x[SPEED + j] = speed + (0.0 if look else change)
        mark = np.int64(1) if look else np.int64(0)
        marks[j] = mark
        count += mark
    return count


@kernel(**BARE)
def advance_lifted(x, marks, n, a0, a1, b0, b1, dt):
    """As `advance`, with the vertical accelerations b0 and b1, under which friction changes within the sample."""
    count = np.int64(0)
    size = abs(a1)
    for j in range(n):
        push, grip, speed, f = x[PUSH + j], x[GRIP + j], x[SPEED + j], x[FACTOR + j]
        before = push * a0 - grip * (GRAVITY + f * b0)
        after = push * a1 - grip * (GRAVITY + f * b1)
        change = 0.5 * (before + after)
        later = speed + change
        room = 0.125 * abs(after - before)
        stops = min(speed, later) < room
        peaks = (before > 0.0) & (after <= 0.0) & (max(speed, later) + room > x[FASTEST + j])
        look = (size - x[HOLD + j] * b1 > x[LEVEL + j]) | stops | peaks
        x[WAY + j] += 0.0 if look else dt * (speed + (before / 3.0 + after / 6.0))
        x[SPEED + j] = speed + (0.0 if look else change)
        mark = np.int64(1) if look else np.int64(0)
        marks[j] = mark
        count += mark
    return count


@kernel(keep=True)
def slide(shaking, friction, factors, first, last, out, history):
    """Run every row of `friction` (n, 4) under its factor times a record; results (n, 9).

    `first`: the sample before which a run cannot slide. `last`: the sample after which it cannot begin to. Runs are
    ordered by `first`. `history` (2, samples) is the last run's, if it has any room. Weights per mass must be > 0.
    """
    record, vertical, dt = shaking
    samples = record.size
    x = np.empty(ROWS * LANES)
    marks = np.zeros(LANES, np.int64)
    for group in range(0, factors.size, LANES):
        count = min(LANES, factors.size - group)
        begin, quiet = samples, np.int64(0)
        x[:] = 0.0
        x[LEVEL : LEVEL + LANES] = np.inf
        for j in range(count):
            run = group + j
            x[FIRST + j] = np.nan
            for k in range(COEFFICIENTS):
                x[STATIC_FRONT + k * LANES + j] = friction[run, k]
            x[FACTOR + j] = factors[run]
            x[HOLD + j] = min(friction[run, 0], friction[run, 1])
            x[STILL + j] = NEARLY * (x[HOLD + j] * GRAVITY / factors[run])
            x[LEVEL + j] = x[STILL + j]
            begin, quiet = min(begin, first[run]), max(quiet, last[run])
        if history.size > 0:
            history[:, :] = 0.0
        padded = (count + 7) // 8 * 8
        b0, b1 = 0.0, 0.0
        for i in range(begin, samples - 1):
            a0, a1 = record[i], record[i + 1]
            if vertical.size > 0:
                b0, b1 = vertical[i], vertical[i + 1]
                marked = advance_lifted(x, marks, padded, a0, a1, b0, b1, dt)
            else:
                marked = advance(x, marks, padded, a0, a1, dt)
            if marked > 0 or i == begin:
                for j in range(count):
                    # (the first sample of all may begin above what friction transmits)
                    if marks[j] != 0 or i == begin:
                        f = x[FACTOR + j]
                        follow_sample(x, j, i * dt, f * a0, f * a1, GRAVITY + f * b0, GRAVITY + f * b1, dt, None)
            if history.size > 0:
                j = count - 1
                history[HISTORY_SPEED, i + 1] = x[SIGN + j] * x[SPEED + j]
                history[HISTORY_SLIP, i + 1] = x[SLIP + j] + x[SIGN + j] * x[WAY + j]
            elif i >= quiet and i % LOOK == 0 and at_rest(x, count):
                break
        for j in range(count):
            write(out[group + j], x, j)


@kernel(**BARE)
def at_rest(x, n):
    """Return True if none of n lanes slides."""
    for j in range(n):  # noqa: SIM110 - compiled
        if x[SIGN + j] != 0.0:
            return False
    return True


@kernel(**BARE)
def write(row, x, j):
    """Write the results of a lane after its record."""
    row[OUT_AFTER] = slide_out(x, j)
    row[OUT_FORWARD] = x[FORWARD + j]
    row[OUT_BACKWARD] = x[BACKWARD + j]
    row[OUT_PEAK] = max(x[FORWARD + j], x[BACKWARD + j])
    row[OUT_RESIDUAL] = x[SLIP + j]
    row[OUT_PATH] = x[PATH + j]
    row[OUT_SPEED] = x[FASTEST + j]
    row[OUT_SLIPS] = x[SLIPS + j]
    row[OUT_FIRST] = x[FIRST + j]
