"""Low bounces: blocks that bounce about theta = 0 every few samples are followed together, flight by flight."""

import math
from typing import Any, NamedTuple

import numpy as np

from ...core.compiled import kernel
from .hops import flight_terms, landing
from .pieces import solve_sample
from .regions import lesser_peak
from .rest import comes_to_rest, rest_at
from .tables import (
    CROSSES,
    FUSED,
    IMPACTS,
    LANES,
    LINK_HOPS,
    MANY_HOPS,
    NEED,
    NO_REGION,
    NOW,
    OMEGA,
    OVERTURNED,
    PAR_RESTITUTION,
    REGION_GAIN,
    REGION_LOWER,
    REGION_OFFSET,
    REGION_STIFFNESS,
    REGION_UPPER,
    REST_DOWN,
    REST_UP,
    STRIKE,
    THETA,
    TURNS,
    WAITS,
)
from .together import whole

# Rows of the flights between impacts that are solved together, a column each, and what became of one in its sample.
(
    FLIGHT_THETA,
    FLIGHT_OMEGA,
    FLIGHT_TIME,
    FLIGHT_FORCE,
    FLIGHT_SLOPE,
    FLIGHT_OFFSET,
    FLIGHT_STIFFNESS,
    FLIGHT_RESTITUTION,
    FLIGHT_GAIN,
    FLIGHT_OTHER_FORCE,
    FLIGHT_OTHER_SLOPE,
    FLIGHT_OTHER_OFFSET,
    FLIGHT_OTHER_STIFFNESS,
    FLIGHT_OTHER_RESTITUTION,
    FLIGHT_OTHER_GAIN,
    FLIGHT_ACROSS,
    FLIGHT_HIGHEST,
    FLIGHT_SETTLING,
    FLIGHT_LEAST,
    FLIGHT_STRIKE,
    FLIGHT_IMPACTS,
    FLIGHT_END,
) = range(22)
FLIGHT_ROWS = 22
UNSURE, LANDS, LANDS_LOW, FLIES_ON = 0.0, 1.0, 2.0, 3.0
# A block whose flight ends within this number of samples bounces apart from the lanes, if its restitution leaves many
# bounces.
BOUNCE_FLIGHT = 3.5
BOUNCE_RESTITUTION = 0.6


class Flights(NamedTuple):
    """Bouncing blocks and their flights.

    `runs`: the bouncing runs. `time`: for each, the time in its sample at which its flight begins. `stop`: the sample
    to which it is followed. `columns`: a column for each flight. `owner`: the run to which each column belongs.
    """

    runs: Any
    time: Any
    stop: Any
    columns: Any
    owner: Any


@kernel(inline="always")
def _flight(theta, omega, a, slope, stiffness, h):
    """Return rotation and velocity at time h of a flight (see `solve_hops`)."""
    m, c1, c2, c3 = flight_terms(stiffness, h)
    y = theta + h * (omega * c1 + h * (a * c2 + h * slope * c3))
    return y, omega + (omega * m * c2 + h * (a * c1 + h * slope * c2))


@kernel(inline="always")
def _after(theta, omega, a, t):
    """Return the rotation after a time t under constant acceleration."""
    return theta + t * (omega + 0.5 * t * a)


@kernel(**FUSED)
def lands_soon(x, k, model, o, force, dt):
    """Return True if a block bounces so low, by the parabola of its flight, that it is followed apart from lanes."""
    region = k[NOW]
    if region < 0 or k[OVERTURNED] != 0 or model.parameters[o, PAR_RESTITUTION] < BOUNCE_RESTITUTION:
        return False
    if x[THETA] == 0.0 and x[OMEGA] == 0.0:
        return False  # it has just been lifted
    if model.links[o, region, LINK_HOPS] == NO_REGION:
        return False
    offset = model.tables[o, region, REGION_OFFSET]
    side = 1.0 if offset < 0.0 else -1.0
    a = model.tables[o, region, REGION_GAIN] * force + offset
    return side * _after(x[THETA], x[OMEGA], a, BOUNCE_FLIGHT * dt) < 0.0


@kernel(inline="always")
def _of_side(v, j, row, row_across):
    """Return the entry of the side on which a column's block is, of two rows."""
    near = v[row * LANES + j]
    far = v[row_across * LANES + j]
    return far if v[FLIGHT_ACROSS * LANES + j] != 0.0 else near


@kernel(inline="always")
def _end_flight(v, j, dt, sure, flies, y, speed, landed, end):
    """Write the end of a flight into its column: it flies on at dt, or lands at time `end` and rebounds."""
    time = v[FLIGHT_TIME * LANES + j]
    strike = v[FLIGHT_STRIKE * LANES + j]
    off = _of_side(v, j, FLIGHT_RESTITUTION, FLIGHT_OTHER_RESTITUTION) * landed
    impacts = v[FLIGHT_IMPACTS * LANES + j]
    low = (abs(off) < v[FLIGHT_SETTLING * LANES + j] * (dt - end)) | (abs(off) < v[FLIGHT_LEAST * LANES + j])
    lands = sure & (not flies)
    v[FLIGHT_THETA * LANES + j] = (y if flies else 0.0) if sure else v[FLIGHT_THETA * LANES + j]
    v[FLIGHT_OMEGA * LANES + j] = (speed if flies else off) if sure else v[FLIGHT_OMEGA * LANES + j]
    v[FLIGHT_TIME * LANES + j] = (dt if flies else end) if sure else time
    across = v[FLIGHT_ACROSS * LANES + j]
    v[FLIGHT_ACROSS * LANES + j] = 1.0 - across if lands else across
    v[FLIGHT_STRIKE * LANES + j] = abs(landed) if lands & (abs(landed) > strike) else strike
    v[FLIGHT_IMPACTS * LANES + j] = impacts + 1.0 if lands else impacts
    v[FLIGHT_END * LANES + j] = (FLIES_ON if flies else (LANDS_LOW if low else LANDS)) if sure else UNSURE


@kernel(**FUSED)
def _solve_stiff_flight(v, j, dt):
    """Follow a flight under a spring (stiffness above 0), which `_solve_flights` is not sure of; return FLIGHT_END.

    While the forcing alone pulls back all through the sample, the rotation is concave seen from its side. It is a
    single arc, on which Newton's steps from beyond the landing descend to it. The series of the displacement are as in
    `flight_terms` with more terms, exact to rounding for K h² <= 1/4.
    """
    theta = v[FLIGHT_THETA * LANES + j]
    omega = v[FLIGHT_OMEGA * LANES + j]
    time = v[FLIGHT_TIME * LANES + j]
    slope = _of_side(v, j, FLIGHT_SLOPE, FLIGHT_OTHER_SLOPE)
    offset = _of_side(v, j, FLIGHT_OFFSET, FLIGHT_OTHER_OFFSET)
    stiffness = _of_side(v, j, FLIGHT_STIFFNESS, FLIGHT_OTHER_STIFFNESS)
    at_zero = _of_side(v, j, FLIGHT_FORCE, FLIGHT_OTHER_FORCE) + slope * time + offset
    a = at_zero - stiffness * theta
    left = dt - time
    side = 1.0 if offset < 0.0 else -1.0
    pull = -side * at_zero
    least = min(pull, pull - side * slope * left)
    height = side * theta
    rises = max(side * omega, 0.0)
    room = v[FLIGHT_HIGHEST * LANES + j] - height
    if least <= 0.0 or height < 0.0 or stiffness * left * left > 0.25 or rises * rises > 2.0 * least * room:
        return UNSURE
    # beyond the landing: the forcing's smallest pull alone, without the spring, brings it down later
    away = side * omega
    h = min(left, (away + math.sqrt(away * away + 2.0 * least * height)) / least)
    y = 0.0
    speed = 0.0
    step = math.inf
    for count in range(30):
        m = -stiffness * h * h
        c1 = 1.0 / 6227020800.0 + m * (1.0 / 1307674368000.0)
        c2 = 1.0 / 87178291200.0 + m * (1.0 / 20922789888000.0)
        c3 = 1.0 / 1307674368000.0 + m * (1.0 / 355687428096000.0)
        c1 = 1.0 / 5040.0 + m * (1.0 / 362880.0 + m * (1.0 / 39916800.0 + m * c1))
        c2 = 1.0 / 40320.0 + m * (1.0 / 3628800.0 + m * (1.0 / 479001600.0 + m * c2))
        c3 = 1.0 / 362880.0 + m * (1.0 / 39916800.0 + m * (1.0 / 6227020800.0 + m * c3))
        c1 = 1.0 + m * (1.0 / 6.0 + m * (1.0 / 120.0 + m * c1))
        c2 = 0.5 + m * (1.0 / 24.0 + m * (1.0 / 720.0 + m * c2))
        c3 = 1.0 / 6.0 + m * (1.0 / 120.0 + m * (1.0 / 5040.0 + m * c3))
        y = theta + h * (omega * c1 + h * (a * c2 + h * slope * c3))
        speed = omega + (omega * m * c2 + h * (a * c1 + h * slope * c2))
        if count == 0 and h == left and side * y > 0.0:
            _end_flight(v, j, dt, True, True, y, speed, 0.0, dt)
            return v[FLIGHT_END * LANES + j]
        if side * speed >= 0.0:
            return UNSURE
        step = -y / speed
        if abs(step) <= 1e-8 * h:
            break
        h += step
    if abs(step) > 1e-8 * h:
        return UNSURE
    end = time + (h + step)
    if end > dt:
        return UNSURE
    _end_flight(v, j, dt, True, False, 0.0, speed, speed + step * (at_zero + slope * h), end)
    return v[FLIGHT_END * LANES + j]


@kernel(**FUSED)
def _solve_flights(v, n, dt):
    """Follow each of n flights (columns of v) to its landing at theta = 0 and the rebound, or to the end of its sample.

    The displacement is as in `solve_hops`; the parabola's landing, corrected by the next two terms, then a step of
    Chebyshev's and one of Newton's. LANDS_LOW if the block may settle, or its flights become too many. UNSURE, and
    unchanged, if the landing is not exact to rounding, or the flight may not be a single arc (see `solve_hops`), or
    rise above FLIGHT_HIGHEST.
    """
    for j in range(n):
        theta = v[FLIGHT_THETA * LANES + j]
        omega = v[FLIGHT_OMEGA * LANES + j]
        time = v[FLIGHT_TIME * LANES + j]
        slope = _of_side(v, j, FLIGHT_SLOPE, FLIGHT_OTHER_SLOPE)
        offset = _of_side(v, j, FLIGHT_OFFSET, FLIGHT_OTHER_OFFSET)
        stiffness = _of_side(v, j, FLIGHT_STIFFNESS, FLIGHT_OTHER_STIFFNESS)
        at_zero = _of_side(v, j, FLIGHT_FORCE, FLIGHT_OTHER_FORCE) + slope * time + offset
        a = at_zero - stiffness * theta
        jerk = slope - stiffness * omega
        left = dt - time
        # as seen from the side on which it is: what pulls it back, how fast it goes away, how high it is
        side = 1.0 if offset < 0.0 else -1.0
        pull = -side * a
        away = side * omega
        height = side * theta
        square = away * away + 2.0 * pull * height
        root = math.sqrt(square if square > 0.0 else 0.0)
        h = (away + root if away > 0.0 else 2.0 * height) / (pull if away > 0.0 else root - away)
        third = side * jerk * (1.0 / 6.0)
        falls = 1.0 / (root - 3.0 * third * h * h)
        step = h * h * h * (third + stiffness * pull * (1.0 / 24.0) * h) * falls
        h += step * (1.0 + step * (3.0 * third * h - 0.5 * pull) * falls)
        h = h if 0.0 < h < left else left
        rises = away if away > 0.0 else 0.0
        sure = (pull > 0.0) & (abs(jerk) * h <= 0.25 * pull) & (abs(stiffness) * h * h <= 0.0025)
        sure = sure & (rises * rises <= 1.5 * pull * (v[FLIGHT_HIGHEST * LANES + j] - height))  # (pull falls to 3/4)
        y, speed = _flight(theta, omega, a, slope, stiffness, h)
        flies = (h == left) & (side * y > 0.0)
        inverse = 1.0 / speed
        step = y * inverse
        new = h - step * (1.0 + 0.5 * (a + jerk * h) * inverse * step)
        h = h if flies else (new if new < left else left)
        y, speed = _flight(theta, omega, a, slope, stiffness, h)
        step = -y / speed
        end = time + (h + step)
        lands = (abs(step) <= 1e-8 * h) & (side * speed < 0.0) & (end <= dt)
        sure = sure & (flies | lands)
        _end_flight(v, j, dt, sure, flies, y, speed, speed + step * (at_zero + slope * h), end)


@kernel()
def no_flights(runs):
    """Return room for the flights of bouncing runs, filled with harmless flights (see `whole`)."""
    columns = np.zeros(FLIGHT_ROWS * LANES)
    columns[FLIGHT_OMEGA * LANES : (FLIGHT_OMEGA + 1) * LANES] = 1.0
    columns[FLIGHT_OFFSET * LANES : (FLIGHT_OFFSET + 1) * LANES] = -1.0
    return Flights(runs, np.empty(LANES), np.empty(LANES, np.int64), columns, np.empty(LANES, np.int64))


@kernel(inline="always")
def _load_forcing(v, column, force, slope):
    """Write the forcing of a sample (of gain 1) into a column, for both sides."""
    gain = v[FLIGHT_GAIN * LANES + column]
    v[FLIGHT_FORCE * LANES + column] = gain * force
    v[FLIGHT_SLOPE * LANES + column] = gain * slope
    gain = v[FLIGHT_OTHER_GAIN * LANES + column]
    v[FLIGHT_OTHER_FORCE * LANES + column] = gain * force
    v[FLIGHT_OTHER_SLOPE * LANES + column] = gain * slope


@kernel(**FUSED)
def _load_flight(f, column, j, model, shaking):
    """Write the flight of bouncing block j, from its present state on, into a column."""
    v = f.columns
    b = f.runs
    record = shaking.record
    dt = shaking.dt
    o = b.oscillator[j]
    x = b.x[j]
    i = b.start[j] + b.until[j]
    region = b.k[j, NOW]
    across = model.links[o, region, LINK_HOPS]
    rest = rest_at(model, o, region, 0.0)
    v[FLIGHT_THETA * LANES + column] = x[THETA]
    v[FLIGHT_OMEGA * LANES + column] = x[OMEGA]
    v[FLIGHT_TIME * LANES + column] = f.time[j]
    slope = b.amplitude[j] * (record[i + 1] - record[i]) * (1.0 / dt)
    v[FLIGHT_GAIN * LANES + column] = model.tables[o, region, REGION_GAIN]
    v[FLIGHT_OTHER_GAIN * LANES + column] = model.tables[o, across, REGION_GAIN]
    _load_forcing(v, column, b.amplitude[j] * record[i], slope)
    v[FLIGHT_OFFSET * LANES + column] = model.tables[o, region, REGION_OFFSET]
    v[FLIGHT_OTHER_OFFSET * LANES + column] = model.tables[o, across, REGION_OFFSET]
    v[FLIGHT_STIFFNESS * LANES + column] = model.tables[o, region, REGION_STIFFNESS]
    v[FLIGHT_OTHER_STIFFNESS * LANES + column] = model.tables[o, across, REGION_STIFFNESS]
    v[FLIGHT_ACROSS * LANES + column] = 0.0
    v[FLIGHT_HIGHEST * LANES + column] = min(
        lesser_peak(x),
        model.tables[o, region, REGION_UPPER] - model.tables[o, region, REGION_LOWER],
        model.tables[o, across, REGION_UPPER] - model.tables[o, across, REGION_LOWER],
    )
    thresholds = model.rests[o, rest, REST_UP] + model.rests[o, rest, REST_DOWN]
    e, loss = landing(model, o, region)
    v[FLIGHT_RESTITUTION * LANES + column] = e
    e, loss_across = landing(model, o, across)
    v[FLIGHT_OTHER_RESTITUTION * LANES + column] = e
    loss = max(loss, loss_across)
    v[FLIGHT_SETTLING * LANES + column] = 0.25 * loss * thresholds  # (see `may_rest`)
    v[FLIGHT_LEAST * LANES + column] = 0.25 / MANY_HOPS * thresholds * dt  # or MANY_HOPS flights fill a sample
    v[FLIGHT_STRIKE * LANES + column] = x[STRIKE]
    v[FLIGHT_IMPACTS * LANES + column] = 0.0
    f.owner[column] = j


@kernel(**FUSED)
def bounce(f, n, model, shaking, end, meeting, work):
    """Follow n bouncing blocks together to sample `end`, or until each rests or rises; return the events solved.

    Blocks whose records end by then are followed to their ends; the others only if all of them are `meeting`. Unusual
    samples are left to `solve_sample`, one by one. NEED shows which lane continues: it WAITS.
    """
    v = f.columns
    b = f.runs
    record = shaking.record
    dt = shaking.dt
    per_dt = 1.0 / dt
    solved = np.int64(0)
    live = np.int64(0)
    for j in range(n):
        last = shaking.last[b.run[j]]
        f.stop[j] = last if last <= end else (end if meeting else 0)
        if b.until[j] < f.stop[j]:
            _load_flight(f, live, j, model, shaking)
            live += 1
    while live > 0:
        _solve_flights(v, whole(live), dt)
        column = np.int64(0)
        while column < live:
            what = v[FLIGHT_END * LANES + column]
            if what == UNSURE and _of_side(v, column, FLIGHT_STIFFNESS, FLIGHT_OTHER_STIFFNESS) > 0.0:
                what = _solve_stiff_flight(v, column, dt)
            if what == LANDS:
                column += 1
                continue
            j = f.owner[column]
            i = b.until[j]
            at = b.start[j] + i
            omega = v[FLIGHT_OMEGA * LANES + column]
            if what == FLIES_ON and i + 1 < f.stop[j]:
                slope = b.amplitude[j] * (record[at + 2] - record[at + 1]) * per_dt
                _load_forcing(v, column, b.amplitude[j] * record[at + 1], slope)
                offset = _of_side(v, column, FLIGHT_OFFSET, FLIGHT_OTHER_OFFSET)
                a = _of_side(v, column, FLIGHT_FORCE, FLIGHT_OTHER_FORCE) + offset
                theta = v[FLIGHT_THETA * LANES + column]
                if theta * _after(theta, omega, a, BOUNCE_FLIGHT * dt) < 0.0:
                    v[FLIGHT_TIME * LANES + column] = 0.0
                    b.until[j] = i + 1
                    column += 1
                    continue
            x = b.x[j]
            k = b.k[j]
            o = b.oscillator[j]
            impacts = int(v[FLIGHT_IMPACTS * LANES + column])
            t = v[FLIGHT_TIME * LANES + column]
            force = b.amplitude[j] * record[at]
            slope = b.amplitude[j] * (record[at + 1] - record[at]) * per_dt
            settles = False
            rest = rest_at(model, o, k[NOW], 0.0)
            if what == LANDS_LOW:
                landed, next_region = k[NOW], model.links[o, k[NOW], LINK_HOPS]
                if impacts % 2 == 0:
                    landed, next_region = next_region, landed
                _, loss = landing(model, o, landed)
                following, _ = landing(model, o, next_region)
                stiffness = model.tables[o, landed, REGION_STIFFNESS]
                highest = v[FLIGHT_HIGHEST * LANES + column]
                faster = max(1.0, following) * omega
                settles = comes_to_rest(
                    model, o, rest, loss, omega, faster, stiffness, force + slope * t, slope, dt - t, highest, None
                )
                if not settles and abs(omega) >= v[FLIGHT_LEAST * LANES + column]:
                    column += 1
                    continue
            x[THETA] = v[FLIGHT_THETA * LANES + column]
            x[OMEGA] = 0.0 if settles else omega
            x[STRIKE] = v[FLIGHT_STRIKE * LANES + column]
            k[IMPACTS] += impacts
            k[TURNS] += impacts
            solved += impacts
            if settles:
                k[NOW] = -1 - rest
            elif impacts % 2 == 1:
                k[NOW] = model.links[o, k[NOW], LINK_HOPS]
            if what != FLIES_ON:
                solve_sample(x, k, model, o, force, slope, t, dt, i * dt, work, None, None)
                solved += 1
            i += 1
            b.until[j] = i
            f.time[j] = 0.0
            low = lands_soon(x, k, model, o, b.amplitude[j] * record[at + 1], dt)
            k[NEED] = CROSSES if low else WAITS
            if low and i < f.stop[j]:
                _load_flight(f, column, j, model, shaking)
                column += 1
                continue
            live -= 1
            for row in range(FLIGHT_ROWS):
                v[row * LANES + column] = v[row * LANES + live]
            f.owner[column] = f.owner[live]
    return solved
