"""Driver of runs in exact geometry: lanes with a clock each, whose pieces are taken together in vectors."""

import math
from typing import Any, NamedTuple

import numpy as np

from ...core.compiled import kernel
from .free import follow_free, is_safe
from .lanes import begin_run, store_fallen, store_sample, write_result
from .pieces import at_edge, solve_piece, solve_sample
from .regions import Lifting, captures, later, rate, value, weight_over
from .rest import has_bounced_out, rest_at, set_at_rest, until_uplift
from .series import FAR_ANGLE, first_terms, sine_and_cosine, terms_end
from .tables import (
    BACK,
    BARE,
    DEGREE,
    FRONT,
    FUSED,
    IMPACTS,
    INVERSE,
    NOW,
    OMEGA,
    OVERTURNED,
    PAR_EXACT,
    PAR_GAIN,
    REGION_CENTRE,
    REGION_GAIN,
    REGION_LOWER,
    REGION_STIFFNESS,
    REGION_UPPER,
    REST_DOWN,
    REST_UP,
    SAFE,
    SAFETY_INTERVAL,
    SPAN,
    STATE_FLOATS,
    STATE_INTEGERS,
    TALLY_EVENTS,
    TALLY_OVERTURNED,
    TALLY_SAFE,
    THETA,
    TURNS,
    WALL_IMPACTS,
    Work,
)
from .together import whole

# Runs whose pieces are taken together (not a power of two: a lane's rows would share a set of the cache).
GLIDERS = 136

# Impacts within a sample from which on what is left of it is solved piece by piece, with its low bounces (a piece of
# its own costs some ten times as much as one in vectors).
FEW_HOPS = 12

# Rows of the lanes: the state, its region (edges, p² of the resting weight, tilt, lever), and the rotations that are no
# new peaks. Then force with its slope and weight with its rate at the start of the piece, and the span of the piece.
# Last the state at its end and the terms of the velocity.
(
    ROW_THETA,
    ROW_OMEGA,
    ROW_LOWER,
    ROW_UPPER,
    ROW_SQUARE,
    ROW_CENTRE,
    ROW_LEVER,
    ROW_FRONT,
    ROW_BACK,
    ROW_FORCE,
    ROW_SLOPE,
    ROW_WEIGHT,
    ROW_WEIGHT_RATE,
    ROW_SPAN,
    ROW_THETA_END,
    ROW_OMEGA_END,
    ROW_TERMS,
) = range(17)
TERMS = 11
GLIDER_ROWS = ROW_TERMS + TERMS

# Rows of the crossings that are solved together: the way to the edge, the terms of the displacement, the span, and a
# flag for a turn of the velocity before. Then the time of the crossing, its velocity, and a flag for a sure result.
CROSS_GAP, CROSS_TERMS, CROSS_SPAN, CROSS_TURNS, CROSS_TIME, CROSS_SPEED, CROSS_SURE = 0, 1, 13, 14, 15, 16, 17
CROSS_ROWS = 18

# Content of a piece. It has no event that matters; it turns and may have a new peak; it goes straight to an edge. Or it
# turns and meets the edge behind it (a new peak or not), or it is solved in the general way.
GLIDES, TOPS, CROSSES, RETURNS, RETURNS_FROM_TOP, HARD = range(6)

ENDED = -1  # instead of a sample


class Gliders(NamedTuple):
    """The arrays of the lanes.

    `rows`, `marks`: the vectors' input and output (flat), and the content of each piece. `x`, `k`: the state of each
    run, of which rotation and velocity are in the rows. `run`, `oscillator`, `amplitude`, `sample`: of each lane.
    `impacts`: impacts before its sample. `crossings`: columns that are solved together, and `crossing` their lanes.
    `unusual`, `between`: lanes whose piece has another event, and lanes between two samples.
    """

    rows: Any
    marks: Any
    x: Any
    k: Any
    run: Any
    oscillator: Any
    amplitude: Any
    sample: Any
    impacts: Any
    crossings: Any
    crossing: Any
    unusual: Any
    between: Any


class Room(NamedTuple):
    """Room for one run at a time: a series, the turning points (and none), sines and cosines, a copy of its state."""

    work: Any
    no_turns: Any
    trig: Any
    x: Any
    k: Any


@kernel(inline="always")
def _end(theta, w0, lower, upper, p2, centre, front, back, force, heavy, heavier, h, of_w):
    """Return the content of a piece, and the state at its end, from the terms of the velocity to degree 11.

    The velocity keeps its sign if the acceleration does and it has the same at both ends, or if it is larger than the
    acceleration can change it. It changes once if the acceleration keeps its sign. Otherwise, the range of the block in
    the piece decides. Peaks do not affect the end of a piece, only the search in it. `force`: the largest.
    """
    w1, w2, w3, w4, w5, w6, w7, w8, w9, w10, w11 = of_w
    # (in pairs: the last terms are the last to be known)
    square = h * h
    sixth = square * square * square
    speed = (w6 + h * w7) + square * ((w8 + h * w9) + square * (w10 + h * w11))
    speed = w0 + (h * (w1 + h * (w2 + h * (w3 + h * (w4 + h * w5)))) + sixth * speed)
    late = (w6 * (1.0 / 7.0) + h * w7 * (1.0 / 8.0)) + square * (w8 * (1.0 / 9.0) + h * w9 * (1.0 / 10.0))
    late += square * square * (w10 * (1.0 / 11.0) + h * w11 * (1.0 / 12.0))
    moved = w3 * (1.0 / 4.0) + h * (w4 * (1.0 / 5.0) + h * w5 * (1.0 / 6.0))
    moved = h * (w0 + h * (0.5 * w1 + h * (w2 * (1.0 / 3.0) + h * moved)))
    end = theta + (moved + sixth * h * late)
    change = (6.0 * abs(w6) + 7.0 * h * abs(w7)) + square * (8.0 * abs(w8) + 9.0 * h * abs(w9))
    change += square * square * (10.0 * abs(w10) + 11.0 * h * abs(w11))
    change = (4.0 * abs(w4) + 5.0 * h * abs(w5)) + square * change
    change = h * ((2.0 * abs(w2) + 3.0 * h * abs(w3)) + square * change)
    p2_most = p2 * max(heavy, heavy + heavier * h)
    known = (
        (w0 != 0.0)
        & (abs(centre - theta) <= FAR_ANGLE)
        & (4.0 * p2_most * square <= 1.0)
        & terms_end(w0, w1, 2.0 * w2, 10.0 * w10, 11.0 * w11, p2_most, force, h)
    )
    swing = h * (abs(w1) + change)
    reach = h * (abs(w0) + swing)
    steady = abs(w1) > change
    keeps = w0 * speed > 0.0
    onward = (abs(w0) > swing) | (steady & keeps)
    inside = (end > lower) & (end < upper)
    below = theta + reach < upper
    above = theta - reach > lower
    # (with one turn, out and back: only ahead of it can it get further than it ends)
    ahead = steady & (((w0 > 0.0) & below) | ((w0 < 0.0) & above))
    contained = (below & above) | ahead
    flat = (theta + reach <= front) & (reach - theta <= back)
    behind = ((w0 > 0.0) & (end <= lower)) | ((w0 < 0.0) & (end >= upper))
    returns = steady & (not keeps) & ahead & behind
    inner = GLIDES if onward | (contained & flat) else (TOPS if contained else HARD)
    outer = CROSSES if onward else ((RETURNS if flat else RETURNS_FROM_TOP) if returns else HARD)
    does = (inner if inside else outer) if known else HARD
    return does, end, speed


@kernel(**FUSED)
def _glide_lanes(s, marks, n, weight):
    """Take a piece of each of n lanes, which fill whole vectors: a lane's bits must not depend on adjacent lanes.

    Three loops, because each has a long chain of operations: the processor works on several turns of a short loop at
    a time. The rows of the end have sine and cosine before.
    """
    for lane in range(n):
        sine, cosine = sine_and_cosine(s[ROW_CENTRE * GLIDERS + lane] - s[ROW_THETA * GLIDERS + lane])
        s[ROW_THETA_END * GLIDERS + lane] = sine
        s[ROW_OMEGA_END * GLIDERS + lane] = cosine
    for lane in range(n):
        heavy = 1.0
        heavier = 0.0
        if weight is not None:
            heavy = s[ROW_WEIGHT * GLIDERS + lane]
            heavier = s[ROW_WEIGHT_RATE * GLIDERS + lane]
        sine = s[ROW_THETA_END * GLIDERS + lane]
        cosine = s[ROW_OMEGA_END * GLIDERS + lane]
        omega = s[ROW_OMEGA * GLIDERS + lane]
        p2 = s[ROW_SQUARE * GLIDERS + lane]
        lever = s[ROW_LEVER * GLIDERS + lane]
        force = s[ROW_FORCE * GLIDERS + lane] * lever
        slope = s[ROW_SLOPE * GLIDERS + lane] * lever
        heavier *= p2
        p2 *= heavy
        w1 = force * cosine - p2 * sine
        _, _, _, of_w, _ = first_terms(weight, sine, cosine, omega, w1, p2, heavier, force, slope)
        w2, w3, w4, w5, w6, w7, w8, w9, w10, w11 = of_w
        s[(ROW_TERMS + 0) * GLIDERS + lane] = w1
        s[(ROW_TERMS + 1) * GLIDERS + lane] = w2
        s[(ROW_TERMS + 2) * GLIDERS + lane] = w3
        s[(ROW_TERMS + 3) * GLIDERS + lane] = w4
        s[(ROW_TERMS + 4) * GLIDERS + lane] = w5
        s[(ROW_TERMS + 5) * GLIDERS + lane] = w6
        s[(ROW_TERMS + 6) * GLIDERS + lane] = w7
        s[(ROW_TERMS + 7) * GLIDERS + lane] = w8
        s[(ROW_TERMS + 8) * GLIDERS + lane] = w9
        s[(ROW_TERMS + 9) * GLIDERS + lane] = w10
        s[(ROW_TERMS + 10) * GLIDERS + lane] = w11
    for lane in range(n):
        heavy = 1.0
        heavier = 0.0
        if weight is not None:
            heavy = s[ROW_WEIGHT * GLIDERS + lane]
            heavier = s[ROW_WEIGHT_RATE * GLIDERS + lane]
        h = s[ROW_SPAN * GLIDERS + lane]
        most = abs(s[ROW_FORCE * GLIDERS + lane]) + abs(s[ROW_SLOPE * GLIDERS + lane]) * h
        does, end, speed = _end(
            s[ROW_THETA * GLIDERS + lane],
            s[ROW_OMEGA * GLIDERS + lane],
            s[ROW_LOWER * GLIDERS + lane],
            s[ROW_UPPER * GLIDERS + lane],
            s[ROW_SQUARE * GLIDERS + lane],
            s[ROW_CENTRE * GLIDERS + lane],
            s[ROW_FRONT * GLIDERS + lane],
            s[ROW_BACK * GLIDERS + lane],
            most * s[ROW_LEVER * GLIDERS + lane],
            heavy,
            heavier,
            h,
            (
                s[(ROW_TERMS + 0) * GLIDERS + lane],
                s[(ROW_TERMS + 1) * GLIDERS + lane],
                s[(ROW_TERMS + 2) * GLIDERS + lane],
                s[(ROW_TERMS + 3) * GLIDERS + lane],
                s[(ROW_TERMS + 4) * GLIDERS + lane],
                s[(ROW_TERMS + 5) * GLIDERS + lane],
                s[(ROW_TERMS + 6) * GLIDERS + lane],
                s[(ROW_TERMS + 7) * GLIDERS + lane],
                s[(ROW_TERMS + 8) * GLIDERS + lane],
                s[(ROW_TERMS + 9) * GLIDERS + lane],
                s[(ROW_TERMS + 10) * GLIDERS + lane],
            ),
        )
        marks[lane] = does
        s[ROW_THETA_END * GLIDERS + lane] = end
        s[ROW_OMEGA_END * GLIDERS + lane] = speed


@kernel(inline="always")
def _way_and_speed(m, t):
    """Return displacement and velocity at t from the terms 1 … 12 of the displacement."""
    m1, m2, m3, m4, m5, m6, m7, m8, m9, m10, m11, m12 = m
    way = m12 * t + m11
    speed = m12
    speed = speed * t + way
    way = way * t + m10
    speed = speed * t + way
    way = way * t + m9
    speed = speed * t + way
    way = way * t + m8
    speed = speed * t + way
    way = way * t + m7
    speed = speed * t + way
    way = way * t + m6
    speed = speed * t + way
    way = way * t + m5
    speed = speed * t + way
    way = way * t + m4
    speed = speed * t + way
    way = way * t + m3
    speed = speed * t + way
    way = way * t + m2
    speed = speed * t + way
    way = way * t + m1
    return way * t, speed * t + way


@kernel(**FUSED)
def _solve_crossings(c, n):
    """Find when n displacements reach their gaps: Newton's method from the root of the cubic's beginning."""
    for j in range(n):
        gap = c[CROSS_GAP * GLIDERS + j]
        m = (
            c[(CROSS_TERMS + 0) * GLIDERS + j],
            c[(CROSS_TERMS + 1) * GLIDERS + j],
            c[(CROSS_TERMS + 2) * GLIDERS + j],
            c[(CROSS_TERMS + 3) * GLIDERS + j],
            c[(CROSS_TERMS + 4) * GLIDERS + j],
            c[(CROSS_TERMS + 5) * GLIDERS + j],
            c[(CROSS_TERMS + 6) * GLIDERS + j],
            c[(CROSS_TERMS + 7) * GLIDERS + j],
            c[(CROSS_TERMS + 8) * GLIDERS + j],
            c[(CROSS_TERMS + 9) * GLIDERS + j],
            c[(CROSS_TERMS + 10) * GLIDERS + j],
            c[(CROSS_TERMS + 11) * GLIDERS + j],
        )
        omega = m[0]
        a = 2.0 * m[1]
        span = c[CROSS_SPAN * GLIDERS + j]
        turns = c[CROSS_TURNS * GLIDERS + j]
        root = math.copysign(math.sqrt(max(omega * omega + 2.0 * a * gap, 0.0)), omega)
        both = omega + root
        t = -both / a if turns > 0.0 else 2.0 * gap / both
        speed = omega + a * t
        t -= m[2] * t * t * t / speed
        t = t if (t > 0.0) & (t <= span) else (span if turns > 0.0 else 0.5 * span)
        way, speed = _way_and_speed(m, t)
        t -= (way - gap) / speed
        way, speed = _way_and_speed(m, t)
        t -= (way - gap) / speed
        way, speed = _way_and_speed(m, t)
        t -= (way - gap) / speed
        way, speed = _way_and_speed(m, t)
        step = (way - gap) / speed
        t -= step
        _, speed = _way_and_speed(m, t)
        crosses = speed * omega * (1.0 - 2.0 * turns) > 0.0
        sure = (abs(step) <= 1e-9 * t) & (t > 0.0) & (t <= span * (1.0 + 1e-12)) & crosses
        c[CROSS_TIME * GLIDERS + j] = min(t, span)
        c[CROSS_SPEED * GLIDERS + j] = speed
        c[CROSS_SURE * GLIDERS + j] = 1.0 if sure else 0.0


@kernel(inline="always")
def _load(w, lane, model, listed):
    """Write the region and the peaks of a moving block into the rows of its lane; listed: all turns are looked at."""
    s = w.rows
    o = w.oscillator[lane]
    region = w.k[lane, NOW]
    square = math.inf if captures(model, o, region) else -model.tables[o, region, REGION_STIFFNESS]
    s[ROW_LOWER * GLIDERS + lane] = model.tables[o, region, REGION_LOWER]
    s[ROW_UPPER * GLIDERS + lane] = model.tables[o, region, REGION_UPPER]
    s[ROW_SQUARE * GLIDERS + lane] = square  # (where a turn changes the region, all is solved in the general way)
    s[ROW_CENTRE * GLIDERS + lane] = model.tables[o, region, REGION_CENTRE]
    s[ROW_LEVER * GLIDERS + lane] = model.tables[o, region, REGION_GAIN] * model.parameters[o, PAR_EXACT]
    s[ROW_FRONT * GLIDERS + lane] = -math.inf if listed else w.x[lane, FRONT]
    s[ROW_BACK * GLIDERS + lane] = -math.inf if listed else w.x[lane, BACK]
    s[ROW_THETA * GLIDERS + lane] = w.x[lane, THETA]
    s[ROW_OMEGA * GLIDERS + lane] = w.x[lane, OMEGA]


@kernel(inline="always")
def _fetch(w, lane):
    """Copy the rotation and the velocity of a moving block from the rows of its lane to its state."""
    w.x[lane, THETA] = w.rows[ROW_THETA * GLIDERS + lane]
    w.x[lane, OMEGA] = w.rows[ROW_OMEGA * GLIDERS + lane]


@kernel(inline="always")
def _set_piece(s, lane, force, slope, t, dt, weight):
    """Write the actions on a block from time t of its sample on into the rows of its lane."""
    s[ROW_FORCE * GLIDERS + lane] = force + slope * t
    s[ROW_SLOPE * GLIDERS + lane] = slope
    s[ROW_SPAN * GLIDERS + lane] = dt - t
    now = later(weight, t)
    s[ROW_WEIGHT * GLIDERS + lane] = value(now)
    s[ROW_WEIGHT_RATE * GLIDERS + lane] = rate(now)


@kernel(**BARE)
def _forcing(amplitude, record, i, dt):
    """Return the forcing at both ends of a sample and its slope, bit-identical for every caller."""
    force = amplitude * record[i]
    end = amplitude * record[i + 1]
    return force, end, (end - force) / dt


@kernel(inline="always")
def _pushes(w, lane, batch, at_rest):
    """Return the forcing of a lane's block at the beginning of its sample, its slope, and the weight."""
    run = w.run[lane]
    at = batch.shaking.start[run] + w.sample[lane]
    dt = batch.shaking.dt
    lifting = Lifting(batch.lifting, batch.lifting_highs, batch.factors[run])
    force, _, slope = _forcing(w.amplitude[lane], batch.shaking.record, at, dt)
    return force, slope, weight_over(at_rest, lifting, at, dt)


@kernel(inline="always")
def _add_crossing(w, lane, j, turns):
    """Add the piece of a lane to the crossings that are solved together, as column j."""
    s = w.rows
    c = w.crossings
    omega = s[ROW_OMEGA * GLIDERS + lane]
    edge = ROW_UPPER if (omega > 0.0) != turns else ROW_LOWER
    c[CROSS_GAP * GLIDERS + j] = s[edge * GLIDERS + lane] - s[ROW_THETA * GLIDERS + lane]
    c[CROSS_TERMS * GLIDERS + j] = omega
    for term in range(TERMS):
        c[(CROSS_TERMS + 1 + term) * GLIDERS + j] = s[(ROW_TERMS + term) * GLIDERS + lane] * INVERSE[term + 2]
    c[CROSS_SPAN * GLIDERS + j] = s[ROW_SPAN * GLIDERS + lane]
    c[CROSS_TURNS * GLIDERS + j] = 1.0 if turns else 0.0
    w.crossing[j] = lane


@kernel(**FUSED)
def _join(w, batch, run, lane, listed):
    """Give a run a lane, between two samples."""
    o = batch.which[run]
    w.run[lane] = run
    w.oscillator[lane] = o
    w.amplitude[lane] = -batch.model.parameters[o, PAR_GAIN] * batch.factors[run]
    w.sample[lane] = batch.first[run]
    begin_run(w.x[lane], w.k[lane], batch.model, o, batch.begin[run])
    if w.k[lane, NOW] >= 0:
        _load(w, lane, batch.model, listed)


@kernel(**FUSED)
def _leave_samples(w, between, batch, at_rest, room):
    """Bring the lanes between two samples to their next pieces, through rest; return the number of runs that ended."""
    shaking = batch.shaking
    record = shaking.record
    dt = shaking.dt
    model = batch.model
    shaking_left = batch.shaking_left
    history = batch.history
    tally = batch.tally
    store = history.shape[1] > 0
    listed = room.work.turns.shape[1] > 0
    looking = shaking_left.shape[0] > 0
    ended = np.int64(0)
    for place in range(between):
        lane = w.between[place]
        x = w.x[lane]
        k = w.k[lane]
        o = w.oscillator[lane]
        i = w.sample[lane]
        start = shaking.start[w.run[lane]]
        last = shaking.last[w.run[lane]]
        factor = batch.factors[w.run[lane]]
        amplitude = w.amplitude[lane]
        lifting = Lifting(batch.lifting, batch.lifting_highs, factor)
        over = False
        while True:
            if k[OVERTURNED] != 0:
                tally[TALLY_OVERTURNED] += last - i
                if store:
                    store_fallen(history, i, x)
                over = True
                break
            if k[NOW] >= 0:
                _fetch(w, lane)
            if store:
                store_sample(history, i, x, k, model, o)
            if i == last:
                turns = k[TURNS]
                after_record = Work(room.work.poly, room.no_turns)
                follow_free(x, k, model, o, last * dt, after_record, room.trig)
                k[TURNS] = turns  # the list contains the turns of the record
                over = True
                break
            if looking and i % SAFETY_INTERVAL == 0:
                span = (start + i) // SPAN
                push = abs(amplitude) * shaking_left[span]
                if is_safe(x, k, model, o, push, abs(factor) * batch.lifting_left[span], batch.barriers):
                    k[SAFE] = 1
                    tally[TALLY_SAFE] += last - i
                    over = True
                    break
            force, end, slope = _forcing(amplitude, record, start + i, dt)
            weight = weight_over(at_rest, lifting, start + i, dt)
            if k[NOW] >= 0:
                tally[TALLY_EVENTS] += 1
                w.sample[lane] = i
                w.impacts[lane] = k[IMPACTS] + k[WALL_IMPACTS]
                _set_piece(w.rows, lane, force, slope, 0.0, dt, weight)
                break
            right = model.rests[o, -1 - k[NOW], REST_UP]
            left = -model.rests[o, -1 - k[NOW], REST_DOWN]
            heavy = value(weight)
            heavy_end = value(later(weight, dt))
            stays_right = force <= right * heavy and end <= right * heavy_end
            if stays_right and force >= left * heavy and end >= left * heavy_end:
                lifted = i + 1
                if not store:
                    at, to = start + i, start + last
                    lifted = (
                        until_uplift(record, shaking.highs, amplitude, right, left, at, to, weight, lifting) - start
                    )
                stop = (i // SAFETY_INTERVAL + 1) * SAFETY_INTERVAL if looking else last
                i = max(i + 1, min(lifted, stop, last))
                continue
            tally[TALLY_EVENTS] += 1
            solve_sample(x, k, model, o, force, slope, 0.0, dt, i * dt, room.work, room.trig, weight)
            if k[NOW] >= 0:
                _load(w, lane, model, listed)
            i += 1
        if over:
            write_result(batch.out, w.run[lane], x, k)
            w.sample[lane] = ENDED
            ended += 1
    return ended


@kernel(**FUSED)
def _end_pieces(w, active, batch, at_rest):
    """Take the lanes whose pieces have no event on to their next samples; return the number of the others.

    Those between two samples if there is more to do, those that cross edges, and those whose piece is unusual.
    """
    s = w.rows
    store = batch.history.shape[1] > 0
    looking = batch.shaking_left.shape[0] > 0
    between = np.int64(0)
    crossings = np.int64(0)
    unusual = np.int64(0)
    for lane in range(active):
        does = w.marks[lane]
        if does in (CROSSES, RETURNS):
            _add_crossing(w, lane, crossings, does == RETURNS)
            crossings += 1
            continue
        if does != GLIDES:
            w.unusual[unusual] = lane
            unusual += 1
            continue
        s[ROW_THETA * GLIDERS + lane] = s[ROW_THETA_END * GLIDERS + lane]
        s[ROW_OMEGA * GLIDERS + lane] = s[ROW_OMEGA_END * GLIDERS + lane]
        w.sample[lane] += 1
        stops = store or (looking and w.sample[lane] % SAFETY_INTERVAL == 0)
        if stops or w.sample[lane] == batch.shaking.last[w.run[lane]]:
            w.between[between] = lane
            between += 1
            continue
        w.impacts[lane] = w.k[lane, IMPACTS] + w.k[lane, WALL_IMPACTS]
        force, slope, weight = _pushes(w, lane, batch, at_rest)
        _set_piece(s, lane, force, slope, 0.0, batch.shaking.dt, weight)
        batch.tally[TALLY_EVENTS] += 1
    return between, crossings, unusual


@kernel(**FUSED)
def _note_turns(w, lane, model, force, slope, weight, t, dt, room, first):
    """Note the turns of a lane's piece from time t of its sample on, the first or all, in its peaks and the list."""
    x = room.x
    k = room.k
    for j in range(STATE_FLOATS):
        x[j] = w.x[lane, j]
    for j in range(STATE_INTEGERS):
        k[j] = w.k[lane, j]
    x[THETA] = w.rows[ROW_THETA * GLIDERS + lane]
    x[OMEGA] = w.rows[ROW_OMEGA * GLIDERS + lane]
    o = w.oscillator[lane]
    region = k[NOW]
    before = k[TURNS] + k[IMPACTS] + k[WALL_IMPACTS]
    while t < dt and not (first and (k[TURNS] + k[IMPACTS] + k[WALL_IMPACTS] > before or k[NOW] != region)):
        now = later(weight, t)
        time = w.sample[lane] * dt + t
        t += solve_piece(x, k, model, o, force + slope * t, slope, dt - t, time, room.work, room.trig, now)
    w.x[lane, FRONT] = x[FRONT]
    w.x[lane, BACK] = x[BACK]
    w.k[lane, TURNS] = k[TURNS]


@kernel(**FUSED)
def _solve_unusual(w, unusual, between, crossings, batch, at_rest, room):
    """Solve the pieces with a turn that may be a new peak, and unusual pieces up to the end of their samples.

    Returns the number of lanes between two samples, and of lanes that cross an edge.
    """
    s = w.rows
    dt = batch.shaking.dt
    model = batch.model
    listed = room.work.turns.shape[1] > 0
    for place in range(unusual):
        lane = w.unusual[place]
        does = w.marks[lane]
        x = w.x[lane]
        k = w.k[lane]
        force, slope, weight = _pushes(w, lane, batch, at_rest)
        t = dt - s[ROW_SPAN * GLIDERS + lane]
        if does == HARD:
            _fetch(w, lane)
            o = w.oscillator[lane]
            time = w.sample[lane] * dt
            solve_sample(x, k, model, o, force, slope, t, dt, time, room.work, room.trig, weight)
            if k[NOW] >= 0:
                _load(w, lane, model, listed)
        else:
            _note_turns(w, lane, model, force, slope, weight, t, dt, room, does == RETURNS_FROM_TOP)
            s[ROW_FRONT * GLIDERS + lane] = -math.inf if listed else x[FRONT]
            s[ROW_BACK * GLIDERS + lane] = -math.inf if listed else x[BACK]
            if does == RETURNS_FROM_TOP:
                _add_crossing(w, lane, crossings, True)
                crossings += 1
                continue
            s[ROW_THETA * GLIDERS + lane] = s[ROW_THETA_END * GLIDERS + lane]
            s[ROW_OMEGA * GLIDERS + lane] = s[ROW_OMEGA_END * GLIDERS + lane]
        w.sample[lane] += 1
        w.between[between] = lane
        between += 1
    return between, crossings


@kernel(**FUSED)
def _cross(w, crossings, between, batch, at_rest, room):
    """Act if blocks reach the edges of their regions; return the number of lanes between two samples."""
    s = w.rows
    c = w.crossings
    dt = batch.shaking.dt
    model = batch.model
    listed = room.work.turns.shape[1] > 0
    for place in range(crossings):
        lane = w.crossing[place]
        x = w.x[lane]
        k = w.k[lane]
        o = w.oscillator[lane]
        start = w.sample[lane] * dt
        force, slope, weight = _pushes(w, lane, batch, at_rest)
        t = dt - s[ROW_SPAN * GLIDERS + lane]
        on = False
        if c[CROSS_SURE * GLIDERS + place] != 0.0:
            t = min(t + c[CROSS_TIME * GLIDERS + place], dt)
            x[OMEGA] = c[CROSS_SPEED * GLIDERS + place]
            upper = x[OMEGA] > 0.0
            x[THETA] = s[ROW_UPPER * GLIDERS + lane] if upper else s[ROW_LOWER * GLIDERS + lane]
            now = force + slope * t
            heavy = later(weight, t)
            region = k[NOW]
            at_edge(x, k, model, o, region, upper, now, slope, dt - t, start + t, heavy)
            if has_bounced_out(x, k, model, o, now, heavy):
                set_at_rest(x, k, model, o, rest_at(model, o, k[NOW], x[THETA]))
            on = t < dt and k[NOW] >= 0 and k[IMPACTS] + k[WALL_IMPACTS] - w.impacts[lane] < FEW_HOPS
        else:
            _fetch(w, lane)
        if k[OVERTURNED] == 0:
            if not on:
                solve_sample(x, k, model, o, force, slope, t, dt, start, room.work, room.trig, weight)
            if k[NOW] >= 0:
                _load(w, lane, model, listed)
            if on:
                _set_piece(s, lane, force, slope, t, dt, weight)
                continue
        w.sample[lane] += 1
        w.between[between] = lane
        between += 1
    return between


@kernel(**FUSED)
def _move_lane(w, lane, to):
    """Move a run to another lane."""
    for row in range(ROW_THETA_END):
        w.rows[row * GLIDERS + to] = w.rows[row * GLIDERS + lane]
    for j in range(STATE_FLOATS):
        w.x[to, j] = w.x[lane, j]
    for j in range(STATE_INTEGERS):
        w.k[to, j] = w.k[lane, j]
    w.run[to] = w.run[lane]
    w.oscillator[to] = w.oscillator[lane]
    w.amplitude[to] = w.amplitude[lane]
    w.sample[to] = w.sample[lane]
    w.impacts[to] = w.impacts[lane]


@kernel(keep=True)
def run_exact(batch, runs, at_rest):
    """Run the runs (r,) of a batch in exact geometry, GLIDERS at a time, each with a clock of its own.

    `at_rest`: `weight.AT_REST`, or None if the batch has no vertical component (see `weight`). Returns the number of
        turning points of the last run to end.

    Each round brings the lanes that are between two samples to their next piece. It takes the pieces of all lanes in
    vectors, up to the end of a sample each. It solves unusual pieces in the general way, and all crossings together.
    """
    w = Gliders(
        rows=np.zeros(GLIDER_ROWS * GLIDERS),
        marks=np.zeros(GLIDERS, np.uint8),
        x=np.empty((GLIDERS, STATE_FLOATS)),
        k=np.empty((GLIDERS, STATE_INTEGERS), np.int64),
        run=np.empty(GLIDERS, np.int64),
        oscillator=np.empty(GLIDERS, np.int64),
        amplitude=np.empty(GLIDERS),
        sample=np.empty(GLIDERS, np.int64),
        impacts=np.empty(GLIDERS, np.int64),
        crossings=np.zeros(CROSS_ROWS * GLIDERS),
        crossing=np.empty(GLIDERS, np.int64),
        unusual=np.empty(GLIDERS, np.int64),
        between=np.empty(GLIDERS, np.int64),
    )
    for lane in range(GLIDERS):  # (what fills the vectors must be numbers, too)
        w.rows[ROW_SQUARE * GLIDERS + lane] = 1.0
        w.rows[ROW_WEIGHT * GLIDERS + lane] = 1.0
        w.crossings[CROSS_TERMS * GLIDERS + lane] = 1.0
        w.crossings[CROSS_SPAN * GLIDERS + lane] = 1.0
    room = Room(
        work=Work(np.empty((3, DEGREE + 1)), batch.turns),
        no_turns=np.empty((2, 0)),
        trig=np.empty((2, DEGREE + 1)),
        x=np.empty(STATE_FLOATS),
        k=np.empty(STATE_INTEGERS, np.int64),
    )
    listed = batch.turns.shape[1] > 0
    turns = np.int64(0)
    active = np.int64(0)
    joined = np.int64(0)
    between = np.int64(0)
    while True:
        while active < GLIDERS and joined < runs.shape[0]:
            _join(w, batch, runs[joined], active, listed)
            w.between[between] = active
            between += 1
            joined += 1
            active += 1
        ended = _leave_samples(w, between, batch, at_rest, room)
        between = np.int64(0)
        lane = active
        while ended > 0:
            lane -= 1
            if w.sample[lane] == ENDED:
                turns = w.k[lane, TURNS]
                ended -= 1
                active -= 1
                if lane < active:
                    _move_lane(w, active, lane)
        if active < GLIDERS and joined < runs.shape[0]:
            continue
        if active == 0:
            return turns
        _glide_lanes(w.rows, w.marks, whole(active), at_rest)
        between, crossings, unusual = _end_pieces(w, active, batch, at_rest)
        if unusual > 0:
            between, crossings = _solve_unusual(w, unusual, between, crossings, batch, at_rest, room)
        if crossings > 0:
            _solve_crossings(w.crossings, whole(crossings))
            between = _cross(w, crossings, between, batch, at_rest, room)
