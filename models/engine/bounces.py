"""Low bounces: blocks that bounce about theta = 0 every few samples are followed together, flight by flight."""

import math
from typing import Any, NamedTuple

import numpy as np

from ...compiled import kernel
from .hops import flight_terms
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

# Rows of the flights between impacts that are solved together, a column each, and what became of one in its sample.
(
    FLIGHT_THETA,
    FLIGHT_OMEGA,
    FLIGHT_TIME,
    FLIGHT_FORCE,
    FLIGHT_SLOPE,
    FLIGHT_OFFSET,
    FLIGHT_OTHER_OFFSET,
    FLIGHT_STIFFNESS,
    FLIGHT_HIGHEST,
    FLIGHT_RESTITUTION,
    FLIGHT_SETTLING,
    FLIGHT_LEAST,
    FLIGHT_STRIKE,
    FLIGHT_IMPACTS,
    FLIGHT_END,
) = range(15)
FLIGHT_ROWS = 15
UNSURE, LANDS, LANDS_LOW, FLIES_ON = 0.0, 1.0, 2.0, 3.0
# A block whose flight ends within so many samples bounces apart from the lanes, if its restitution leaves many bounces.
BOUNCE_FLIGHT = 3.5
BOUNCE_RESTITUTION = 0.6


class Flights(NamedTuple):
    """Bouncing blocks and their flights.

    runs: the bouncing runs; time: for each, the time in its sample at which its flight begins; columns: a column for
    each flight; owner: the run to which each column belongs.
    """

    runs: Any
    time: Any
    columns: Any
    owner: Any


@kernel(inline="always")
def _flight(theta, omega, a, slope, stiffness, h):
    """Return rotation and velocity at time h of a flight (see `solve_hops`)."""
    m, one, two, three = flight_terms(stiffness, h)
    y = theta + h * (omega * one + h * (a * two + h * slope * three))
    return y, omega + (omega * m * two + h * (a * one + h * slope * two))


@kernel(inline="always")
def _after(theta, omega, a, t):
    """Return the rotation after a time t under constant acceleration."""
    return theta + t * (omega + 0.5 * t * a)


@kernel(**FUSED)
def lands_soon(x, k, model, o, force, dt):
    """Return True if a block bounces so low, by the parabola of its flight, that it is followed apart from lanes."""
    here = k[NOW]
    if here < 0 or k[OVERTURNED] != 0 or model.parameters[o, PAR_RESTITUTION] < BOUNCE_RESTITUTION:
        return False
    if x[THETA] == 0.0 and x[OMEGA] == 0.0:
        return False  # it has just been lifted
    if model.links[o, here, LINK_HOPS] == NO_REGION:
        return False
    offset = model.tables[o, here, REGION_OFFSET]
    side = 1.0 if offset < 0.0 else -1.0
    return side * _after(x[THETA], x[OMEGA], force + offset, BOUNCE_FLIGHT * dt) < 0.0


@kernel(**FUSED)
def _solve_flights(v, n, dt):
    """Follow each of n flights (columns of v) to its landing at theta = 0 and the rebound, or to the end of its sample.

    The displacement is that of `solve_hops`; the parabola's landing, corrected by the next two terms, then a step of
    Chebyshev's and one of Newton's.  LANDS_LOW where the block may settle, or its flights become too many; UNSURE, and
    left as it is, where the landing is not exact to rounding, or the flight may not be a single arc (see `solve_hops`),
    or rise above FLIGHT_HIGHEST.
    """
    for j in range(n):
        theta = v[FLIGHT_THETA * LANES + j]
        omega = v[FLIGHT_OMEGA * LANES + j]
        time = v[FLIGHT_TIME * LANES + j]
        slope = v[FLIGHT_SLOPE * LANES + j]
        offset = v[FLIGHT_OFFSET * LANES + j]
        stiffness = v[FLIGHT_STIFFNESS * LANES + j]
        at_zero = v[FLIGHT_FORCE * LANES + j] + slope * time + offset
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
        landing = speed + step * (at_zero + slope * h)
        strike = v[FLIGHT_STRIKE * LANES + j]
        off = v[FLIGHT_RESTITUTION * LANES + j] * landing
        impacts = v[FLIGHT_IMPACTS * LANES + j]
        low = (abs(off) < v[FLIGHT_SETTLING * LANES + j] * (dt - end)) | (abs(off) < v[FLIGHT_LEAST * LANES + j])
        other = v[FLIGHT_OTHER_OFFSET * LANES + j]
        lands = sure & (not flies)
        v[FLIGHT_THETA * LANES + j] = (y if flies else 0.0) if sure else theta
        v[FLIGHT_OMEGA * LANES + j] = (speed if flies else off) if sure else omega
        v[FLIGHT_TIME * LANES + j] = (dt if flies else end) if sure else time
        v[FLIGHT_OFFSET * LANES + j] = other if lands else offset
        v[FLIGHT_OTHER_OFFSET * LANES + j] = offset if lands else other
        v[FLIGHT_STRIKE * LANES + j] = abs(landing) if lands & (abs(landing) > strike) else strike
        v[FLIGHT_IMPACTS * LANES + j] = impacts + 1.0 if lands else impacts
        v[FLIGHT_END * LANES + j] = (FLIES_ON if flies else (LANDS_LOW if low else LANDS)) if sure else UNSURE


@kernel(**FUSED)
def _load_flight(f, column, j, model, shaking):
    """Write the flight of bouncing block j, from its present state on, into a column."""
    v = f.columns
    b = f.runs
    record = shaking.record
    dt = shaking.dt
    o = b.oscillator[j]
    x = b.x[j]
    i = b.until[j]
    here = b.k[j, NOW]
    there = model.links[o, here, LINK_HOPS]
    rest = rest_at(model, o, here, 0.0)
    v[FLIGHT_THETA * LANES + column] = x[THETA]
    v[FLIGHT_OMEGA * LANES + column] = x[OMEGA]
    v[FLIGHT_TIME * LANES + column] = f.time[j]
    v[FLIGHT_FORCE * LANES + column] = b.amplitude[j] * record[i]
    v[FLIGHT_SLOPE * LANES + column] = b.amplitude[j] * (record[i + 1] - record[i]) * (1.0 / dt)
    v[FLIGHT_OFFSET * LANES + column] = model.tables[o, here, REGION_OFFSET]
    v[FLIGHT_OTHER_OFFSET * LANES + column] = model.tables[o, there, REGION_OFFSET]
    v[FLIGHT_STIFFNESS * LANES + column] = model.tables[o, here, REGION_STIFFNESS]
    v[FLIGHT_HIGHEST * LANES + column] = min(
        lesser_peak(x),
        model.tables[o, here, REGION_UPPER] - model.tables[o, here, REGION_LOWER],
        model.tables[o, there, REGION_UPPER] - model.tables[o, there, REGION_LOWER],
    )
    e = model.parameters[o, PAR_RESTITUTION]
    thresholds = model.rests[o, rest, REST_UP] + model.rests[o, rest, REST_DOWN]
    v[FLIGHT_RESTITUTION * LANES + column] = e
    v[FLIGHT_SETTLING * LANES + column] = 0.25 * (1.0 - e) * thresholds  # (see `comes_to_rest`: more is never enough)
    v[FLIGHT_LEAST * LANES + column] = 0.25 / MANY_HOPS * thresholds * dt  # (or so many flights fill a sample)
    v[FLIGHT_STRIKE * LANES + column] = x[STRIKE]
    v[FLIGHT_IMPACTS * LANES + column] = 0.0
    f.owner[column] = j


@kernel(**FUSED)
def bounce(f, n, model, shaking, end, work):
    """Follow n bouncing blocks together to sample `end`, or until each rests or rises; return the events solved.

    What is out of the ordinary is left to `solve_sample`, one by one.  NEED says who takes a lane again: it WAITS.
    """
    v = f.columns
    b = f.runs
    record = shaking.record
    dt = shaking.dt
    per_dt = 1.0 / dt
    solved = np.int64(0)
    live = np.int64(0)
    for j in range(n):
        if b.until[j] < end:
            _load_flight(f, live, j, model, shaking)
            live += 1
    while live > 0:
        padded = (live + 7) // 8 * 8  # (see `pad`)
        for column in range(live, padded):
            for row in range(FLIGHT_ROWS):
                v[row * LANES + column] = 0.0
            v[FLIGHT_OMEGA * LANES + column] = 1.0
            v[FLIGHT_OFFSET * LANES + column] = -1.0
        _solve_flights(v, padded, dt)
        column = np.int64(0)
        while column < live:
            what = v[FLIGHT_END * LANES + column]
            if what == LANDS:
                column += 1
                continue
            j = f.owner[column]
            i = b.until[j]
            omega = v[FLIGHT_OMEGA * LANES + column]
            if what == FLIES_ON and i + 1 < end:
                force = b.amplitude[j] * record[i + 1]
                offset = v[FLIGHT_OFFSET * LANES + column]
                theta = v[FLIGHT_THETA * LANES + column]
                if theta * _after(theta, omega, force + offset, BOUNCE_FLIGHT * dt) < 0.0:
                    v[FLIGHT_TIME * LANES + column] = 0.0
                    v[FLIGHT_FORCE * LANES + column] = force
                    v[FLIGHT_SLOPE * LANES + column] = b.amplitude[j] * (record[i + 2] - record[i + 1]) * per_dt
                    b.until[j] = i + 1
                    column += 1
                    continue
            x = b.x[j]
            k = b.k[j]
            o = b.oscillator[j]
            t = v[FLIGHT_TIME * LANES + column]
            force = v[FLIGHT_FORCE * LANES + column]
            slope = v[FLIGHT_SLOPE * LANES + column]
            impacts = int(v[FLIGHT_IMPACTS * LANES + column])
            settles = False
            rest = rest_at(model, o, k[NOW], 0.0)
            if what == LANDS_LOW:
                stiffness = v[FLIGHT_STIFFNESS * LANES + column]
                highest = v[FLIGHT_HIGHEST * LANES + column]
                loss = 1.0 - model.parameters[o, PAR_RESTITUTION]
                settles = comes_to_rest(
                    model, o, rest, loss, omega, omega, stiffness, force + slope * t, slope, dt - t, highest
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
                solve_sample(x, k, model, o, force, slope, t, dt, i * dt, work, None)
                solved += 1
            i += 1
            b.until[j] = i
            f.time[j] = 0.0
            low = lands_soon(x, k, model, o, b.amplitude[j] * record[i], dt)
            k[NEED] = CROSSES if low else WAITS
            if low and i < end:
                _load_flight(f, column, j, model, shaking)
                column += 1
                continue
            live -= 1
            for row in range(FLIGHT_ROWS):
                v[row * LANES + column] = v[row * LANES + live]
            f.owner[column] = f.owner[live]
    return solved
