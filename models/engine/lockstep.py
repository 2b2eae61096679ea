"""Lockstep: plain steps of many lanes at once, in vectors, and the samples that need more than a plain step."""

import math
from typing import Any, NamedTuple

import numpy as np

from ...core.compiled import kernel
from .lanes import freeze_lane, set_lane_amplitude
from .propagators import fill_step
from .regions import captures
from .rest import until_uplift
from .tables import (
    BACK,
    BARE,
    CALM_MARGIN,
    CROSSES,
    DAMPING,
    FRONT,
    GRADE,
    HARD,
    HELD,
    LANES,
    LINK_HELD,
    LISTED,
    MANY_STEPS,
    NEED,
    NOW,
    OMEGA,
    ONE_PIECE,
    PIECE_A,
    PIECE_DAMPING,
    PIECE_GAP,
    PIECE_OMEGA,
    PIECE_SLOPE,
    PIECE_SPAN,
    PIECE_STIFFNESS,
    PIECE_TIME,
    REGION_GAIN,
    REGION_LOWER,
    REGION_OFFSET,
    REGION_STIFFNESS,
    REGION_UPPER,
    REST_DOWN,
    REST_THETA,
    REST_UP,
    RETURNS,
    ROW_AMPLITUDE,
    ROW_CALM_LOWER,
    ROW_CALM_UPPER,
    ROW_EVEN,
    ROW_G0,
    ROW_G1,
    ROW_G2,
    ROW_G2_RISE,
    ROW_G3,
    ROW_LOWER,
    ROW_ODD,
    ROW_OFFSET,
    ROW_SQUARE,
    ROW_STIFFNESS,
    ROW_UPPER,
    SIDED,
    STEP_DAMPING,
    STEP_G0,
    STEP_G1,
    STEP_G2,
    STEP_G2_RISE,
    STEP_G3,
    STEP_GRADE,
    STEP_PULL,
    THETA,
    TILE,
    TURN_COLUMNS,
    TURNS_BACK,
    UPWARD,
    WAITS,
)

# Lanes that take the steps of a tile in lockstep: a block of them stays in the fastest cache.
BLOCK = 176

# Position of a marked byte in a word of eight, from its lowest bit modulo 19.
BYTE_OF = np.array([0, 0, 0, 0, 7, 2, 4, 3, 0, 1, 0, 6, 0, 0, 0, 0, 5, 0, 0])


class Propagator(NamedTuple):
    """The coefficients of one step without an event (see `propagators`)."""

    g0: Any
    g1: Any
    g2: Any
    g3: Any
    g2_rise: Any


class Edges(NamedTuple):
    """The edges of a lane's region, and the edges of the interval in which turns do not matter."""

    upper: Any
    lower: Any
    calm_upper: Any
    calm_lower: Any


class Step(NamedTuple):
    """One sample of a linear region: the state at both ends, the push at its start and its growth, and the region."""

    theta: Any
    omega: Any
    theta_end: Any
    omega_end: Any
    push: Any
    up: Any
    stiffness: Any
    c: Any
    dt: Any


@kernel(inline="always")
def _dip(rise, dt):
    """Largest product of the velocities at the ends of a sample within which the velocity passes zero twice.

    For an amplitude of 1; it grows with the square of the amplitude. Such a velocity has its extremum at some t, where
    a(t) = 0. With J = max|a'| it is at most J t²/2 at the start and J (dt - t)²/2 at the end. Their product is (J
    dt²/8)² at most. As a' = s - c a - K v, |a| <= J dt and |v| <= J dt²/2, J (1 - c dt - |K| dt²/2) <= |s|. The bracket
    is at least 1/2 for a rate of 1/(2 dt) at most. So (s dt²/4)² is the bound; a third is on the safe side.
    """
    third = rise * dt * (1.0 / 3.0)
    return third * third


@kernel(inline="always")
def _step(theta, omega, push, up, stiffness, g, dip, edges):
    """Step one lane over one sample; return the new state, and True if the sample may have an event that matters.

    Such events are beyond an edge. Outside the calm interval (see `follow`), they are also a velocity that turns, or
    may dip through zero and recover. For the latter `dip` (see `_dip`) must exceed the product of the velocities at
    both ends.
    """
    a = push - stiffness * theta
    theta_end = theta + (omega * g.g1 + a * g.g2 + up * g.g3)
    omega_end = omega + (omega * g.g0 + a * g.g1 + up * g.g2_rise)
    turns = omega * omega_end <= dip
    calm = (theta_end < edges.calm_upper) & (theta_end > edges.calm_lower)
    look = (theta_end >= edges.upper) | (theta_end <= edges.lower) | (turns & (not calm))
    return theta_end, omega_end, look


@kernel(inline="always")
def _step_lane(s, marks, lane, force, rise, dip, now, after):
    """Step a lane over one sample, from the state rows `now` to the rows `after`; return True if it is marked."""
    amplitude = s[ROW_AMPLITUDE * LANES + lane]
    theta_end, omega_end, look = _step(
        s[now * LANES + lane],
        s[(now + 1) * LANES + lane],
        s[ROW_OFFSET * LANES + lane] + amplitude * force,
        amplitude * rise,
        s[ROW_STIFFNESS * LANES + lane],
        Propagator(
            s[ROW_G0 * LANES + lane],
            s[ROW_G1 * LANES + lane],
            s[ROW_G2 * LANES + lane],
            s[ROW_G3 * LANES + lane],
            s[ROW_G2_RISE * LANES + lane],
        ),
        s[ROW_SQUARE * LANES + lane] * dip,
        Edges(
            s[ROW_UPPER * LANES + lane],
            s[ROW_LOWER * LANES + lane],
            s[ROW_CALM_UPPER * LANES + lane],
            s[ROW_CALM_LOWER * LANES + lane],
        ),
    )
    s[after * LANES + lane] = theta_end
    s[(after + 1) * LANES + lane] = omega_end
    marks[lane] = look
    return look


@kernel(inline="always")
def _step_lanes(s, marks, n, force, rise, dip, now, after):
    """Step all lanes over one sample; return the number of marked lanes.

    Rows lie at constant offsets in one flat array, and the trip count is known at run time only: so it vectorises.
    """
    count = 0
    for lane in range(n):
        if _step_lane(s, marks, lane, force, rise, dip, now, after):
            count += 1
    return count


@kernel(**BARE)
def _step_even(s, marks, n, force, rise, dip):
    """Step from the even rows to the odd rows; compiled apart, since a larger function would not be vectorised."""
    return _step_lanes(s, marks, n, force, rise, dip, ROW_EVEN, ROW_ODD)


@kernel(**BARE)
def _step_odd(s, marks, n, force, rise, dip):
    return _step_lanes(s, marks, n, force, rise, dip, ROW_ODD, ROW_EVEN)


@kernel(inline="always")
def _step_mixed(s, forces, marks, n, dt, now, after):
    """Step all lanes over one sample as `_step_lanes` does, each under its own record: two rows of `forces`."""
    count = 0
    for lane in range(n):
        force = forces[lane]
        rise = forces[BLOCK + lane] - force
        if _step_lane(s, marks, lane, force, rise, _dip(rise, dt), now, after):
            count += 1
    return count


@kernel(**BARE)
def _step_mixed_even(s, forces, marks, n, dt):
    return _step_mixed(s, forces, marks, n, dt, ROW_EVEN, ROW_ODD)


@kernel(**BARE)
def _step_mixed_odd(s, forces, marks, n, dt):
    return _step_mixed(s, forces, marks, n, dt, ROW_ODD, ROW_EVEN)


@kernel(**BARE)
def _gather(w, forces, first, n, shaking, i):
    """Write the samples i … i + TILE of the records of n lanes into rows, time by time, with lanes adjacent."""
    record = shaking.record
    for j in range(n):
        at = w.start[first + j] + i
        for t in range(TILE + 1):
            forces[t * BLOCK + j] = record[at + t]


@kernel(**BARE)
def step_reach(omega, a_start, a_end, dt):
    """Bound the way of one step: |a| <= 1.2 max(|a_start|, |a_end|), since a solves a'' + c a' + K a = 0."""
    return (abs(omega) + 1.2 * dt * max(abs(a_start), abs(a_end))) * dt


@kernel(**BARE)
def _need(step, upper, lower, grade, front, back):
    """Return the need of a marked sample of a moving lane: nothing (WAITS), one root, or the general way (HARD).

    CROSSES: it goes straight to an edge.  RETURNS: it turns, and meets the edge behind it.  TURNS_BACK: it turns.

    The bounds are valid for sqrt|K| dt, c dt <= 1/2; towards its zero |a| falls, which bounds the dip of the velocity.
    Turns between -back and front do not matter (front -1: all do, and need a region of their own or a place in a list).
    """
    theta, omega, theta_end, omega_end, push, up, stiffness, c, dt = step
    a_start = push - stiffness * theta - c * omega
    a_end = push + up - stiffness * theta_end - c * omega_end
    if theta_end >= upper or theta_end <= lower:
        if grade != ONE_PIECE or (a_start * omega < 0.0 and a_end * omega > 0.0):
            return HARD
        ahead = upper - theta if omega > 0.0 else lower - theta
        if omega * omega_end > 0.0:
            return CROSSES if ahead * omega > 0.0 else HARD
        # it turns first and then meets the edge behind it
        reach = step_reach(omega, a_start, a_end, dt)
        behind = lower - theta if omega > 0.0 else upper - theta
        one_way = omega * omega_end < 0.0 and behind * omega < 0.0 and reach < abs(ahead)
        return RETURNS if one_way and front >= 0.0 else HARD
    if omega * omega_end > 0.0 and (
        a_start * omega >= 0.0
        or a_end * omega <= 0.0
        or abs(omega) > 1.2 * dt * abs(a_start)
        or abs(omega_end) > 1.2 * dt * abs(a_end)
    ):
        return WAITS
    if front < 0.0:
        return HARD
    reach = step_reach(omega, a_start, a_end, dt)
    # a single turn can pass the edge ahead only; a dip may hide two
    dips = omega * omega_end >= 0.0
    if (theta + reach >= upper and (dips or omega > 0.0)) or (theta - reach <= lower and (dips or omega < 0.0)):
        return HARD
    return WAITS if (theta + reach <= front) & (reach - theta <= back) else TURNS_BACK


@kernel(**BARE)
def _add_turn(w, column, lane, step, last):
    """Note a turn inside a region, to be solved with others, in a sample that the lane leaves at rotation `last`."""
    v = w.turns
    theta, omega, _, _, push, up, stiffness, c, dt = step
    w.turn_lane[column] = lane
    v[PIECE_OMEGA * TURN_COLUMNS + column] = omega
    v[PIECE_A * TURN_COLUMNS + column] = push - stiffness * theta - c * omega
    v[PIECE_SLOPE * TURN_COLUMNS + column] = up / dt
    v[PIECE_STIFFNESS * TURN_COLUMNS + column] = stiffness
    v[PIECE_DAMPING * TURN_COLUMNS + column] = c
    v[PIECE_SPAN * TURN_COLUMNS + column] = dt
    v[PIECE_GAP * TURN_COLUMNS + column] = theta
    v[PIECE_TIME * TURN_COLUMNS + column] = last


@kernel(inline="always")
def follow(w, lane, model, shaking, i, end, now, waiting, recording):
    """Step one lane alone from sample i to sample `end`, or to its next event; return the sample and the turns waiting.

    `end` is no later than the end of the lane's record.  One that is at rest for longer than that is noted in
    w.leaving (its last entry counts them).
    """
    s = w.rows
    x = w.x[lane]
    k = w.k[lane]
    o = w.oscillator[lane]
    amplitude = w.amplitude[lane]
    record = shaking.record
    dt = shaking.dt
    start = w.start[lane]
    region = k[NOW]
    if region < 0:
        k[NEED] = HARD
        rest = model.rests[o, -1 - region]
        x[THETA] = rest[REST_THETA]
        x[OMEGA] = 0.0
        upper = rest[REST_UP]
        lower = -rest[REST_DOWN]
        last = start + shaking.last[w.run[lane]]
        i = until_uplift(record, shaking.highs, amplitude, upper, lower, start + i, last, None, None) - start
        if i >= end:
            w.until[lane] = i
            w.leaving[w.leaving[LANES]] = lane
            w.leaving[LANES] += 1
            i = end
        return i, waiting
    row = model.tables[o, region]
    step = w.steps[o, region]
    if model.links[o, region, LINK_HELD]:
        step = w.held[lane]
        if x[HELD] != step[STEP_DAMPING]:
            fill_step(step, row, x[HELD], dt)
    grade = int(step[STEP_GRADE])
    k[GRADE] = grade
    if grade == MANY_STEPS:
        k[NEED] = HARD
        s[ROW_UPPER * LANES + lane] = -math.inf  # every sample needs a look
        s[now * LANES + lane] = x[THETA]
        s[(now + 1) * LANES + lane] = x[OMEGA]
        return i, waiting
    if k[SIDED] != 0:
        amplitude *= row[REGION_GAIN]
        set_lane_amplitude(s, lane, amplitude)
    offset = row[REGION_OFFSET]
    stiffness = row[REGION_STIFFNESS]
    upper = row[REGION_UPPER]
    lower = row[REGION_LOWER]
    c = step[STEP_DAMPING]
    g = Propagator(step[STEP_G0], step[STEP_G1], step[STEP_G2], step[STEP_G3], step[STEP_G2_RISE])
    x[DAMPING] = c
    # The calm interval: a turn there is below the peak and far from the edges, so it has no effect. In a sample in
    # which the velocity vanishes the acceleration is at most twice A = forcing + max|f(theta)|, as c dt <= 1/2. The
    # rotation stays within 2 A dt² of its end; half as much again is kept for the growth of f beyond the edges.
    listed = recording or captures(model, o, region)
    k[LISTED] = 1 if listed else 0
    x[CALM_MARGIN] = 3.0 * dt * dt * (abs(amplitude) * shaking.strongest[w.run[lane]] + step[STEP_PULL])
    calm_upper = -math.inf if listed else min(x[FRONT], upper) - x[CALM_MARGIN]
    calm_lower = math.inf if listed else max(-x[BACK], lower) + x[CALM_MARGIN]
    edges = Edges(upper, lower, calm_upper, calm_lower)
    theta = x[THETA]
    omega = x[OMEGA]
    square = amplitude * amplitude
    while i < end:
        force = record[start + i]
        rise = record[start + i + 1] - force
        push = offset + amplitude * force
        up = amplitude * rise
        dip = square * _dip(rise, dt)
        theta_end, omega_end, look = _step(theta, omega, push, up, stiffness, g, dip, edges)
        if look:
            front = -1.0 if listed else x[FRONT]
            sample = Step(theta, omega, theta_end, omega_end, push, up, stiffness, c, dt)
            need = _need(sample, upper, lower, grade, front, x[BACK])
            if need in (TURNS_BACK, RETURNS):
                if waiting == LANES * TILE:
                    # no room for another turn (a block that has bounced may have far to go): on when they are solved
                    x[THETA] = theta
                    x[OMEGA] = omega
                    k[NEED] = WAITS
                    return i - 1, waiting
                last = theta_end if need == TURNS_BACK else theta
                _add_turn(w, waiting, lane, sample, last)
                waiting += 1
            if need in (RETURNS, CROSSES, HARD):
                x[THETA] = theta
                x[OMEGA] = omega
                k[NEED] = need
                k[UPWARD] = 1 if theta_end >= upper else 0
                return i, waiting
        theta = theta_end
        omega = omega_end
        i += 1
    s[now * LANES + lane] = theta
    s[(now + 1) * LANES + lane] = omega
    s[ROW_STIFFNESS * LANES + lane] = stiffness
    s[ROW_OFFSET * LANES + lane] = offset
    s[ROW_G0 * LANES + lane] = g.g0
    s[ROW_G1 * LANES + lane] = g.g1
    s[ROW_G2 * LANES + lane] = g.g2
    s[ROW_G3 * LANES + lane] = g.g3
    s[ROW_G2_RISE * LANES + lane] = g.g2_rise
    s[ROW_UPPER * LANES + lane] = upper
    s[ROW_LOWER * LANES + lane] = lower
    s[ROW_CALM_UPPER * LANES + lane] = calm_upper
    s[ROW_CALM_LOWER * LANES + lane] = calm_lower
    return end, waiting


@kernel(**BARE)
def advance(w, forces, first, n, shaking, i, end, now, waiting, parked):
    """Step a block of n lanes from sample i to `end` in lockstep; return the numbers of turns waiting and lanes parked.

    forces: room for the samples of their records; None if all lanes go over one record, which is then compiled for
    itself. Turns are noted down and lanes with other events taken out, for `resolve`.
    """
    s = w.rows
    record = shaking.record
    dt = shaking.dt
    block = s[first:]
    marks = w.marks[first:]
    padded = (n + 7) // 8 * 8
    start = w.start[first]
    begin = i
    if forces is not None:
        _gather(w, forces, first, n, shaking, i)
    while i < end:
        after = ROW_ODD if now == ROW_EVEN else ROW_EVEN
        force = record[start + i]
        rise = record[start + i + 1] - force
        if forces is None:
            dip = _dip(rise, dt)
            if now == ROW_EVEN:
                marked = _step_even(block, marks, padded, force, rise, dip)
            else:
                marked = _step_odd(block, marks, padded, force, rise, dip)
        else:
            rows = forces[(i - begin) * BLOCK :]
            if now == ROW_EVEN:
                marked = _step_mixed_even(block, rows, marks, padded, dt)
            else:
                marked = _step_mixed_odd(block, rows, marks, padded, dt)
        word = first // 8
        while marked > 0:
            bits = w.words[word]
            word += 1
            while bits != 0:
                lowest = bits & -bits
                bits ^= lowest
                lane = 8 * word - 8 + BYTE_OF[lowest % 19]  # the eight powers of 256 differ modulo 19
                marked -= 1
                k = w.k[lane]
                x = w.x[lane]
                if forces is not None:
                    force = forces[(i - begin) * BLOCK + lane - first]
                    rise = forces[(i - begin + 1) * BLOCK + lane - first] - force
                theta = s[now * LANES + lane]
                omega = s[(now + 1) * LANES + lane]
                if k[GRADE] == MANY_STEPS:
                    k[NEED] = HARD
                else:
                    amplitude = s[ROW_AMPLITUDE * LANES + lane]
                    push = s[ROW_OFFSET * LANES + lane] + amplitude * force
                    up = amplitude * rise
                    stiffness = s[ROW_STIFFNESS * LANES + lane]
                    c = x[DAMPING]
                    theta_end = s[after * LANES + lane]
                    omega_end = s[(after + 1) * LANES + lane]
                    upper = s[ROW_UPPER * LANES + lane]
                    lower = s[ROW_LOWER * LANES + lane]
                    front = -1.0 if k[LISTED] != 0 else x[FRONT]
                    sample = Step(theta, omega, theta_end, omega_end, push, up, stiffness, c, dt)
                    need = _need(sample, upper, lower, k[GRADE], front, x[BACK])
                    if need in (TURNS_BACK, RETURNS):
                        last = theta_end if need == TURNS_BACK else theta
                        _add_turn(w, waiting, lane, sample, last)
                        waiting += 1
                    if need in (WAITS, TURNS_BACK):
                        continue
                    k[NEED] = need
                    k[UPWARD] = 1 if theta_end >= upper else 0
                x[THETA] = theta
                x[OMEGA] = omega
                w.parked[parked] = lane
                w.parked_at[parked] = i
                parked += 1
                freeze_lane(s, lane)
        now = after
        i += 1
    return waiting, parked
