"""Compiled engine: one rocking run from event to event, without approximation in time.

Floats and arrays in, floats and arrays out; labels, units and validation live above.  An oscillator is a table of
regions (`REGION_*` columns) joined by links (`LINK_*` columns): nothing here assumes three of them, or mirror symmetry.

Between two samples the floor acceleration is linear, so inside one region the motion is known in closed form.  A sample
that provably holds no event costs one multiplication by a precomputed propagator; any other is cut at its events, each
found to rounding on the local Taylor series.  The exact (sin/cos) geometry has no closed form, and uses the same series
method with an error control of its own.

Why a step is event-free: the acceleration a(t) of a linear region under linear forcing solves a'' + c a' + K a = 0,
whose zeros are at least pi/sqrt(K) apart (at most one zero for K <= c²/4).  Steps satisfy sqrt|K| h <= 1/2, so a has at
most one zero, the velocity at most two monotone parts, and the signs of velocity and acceleration at both ends decide.

How a batch runs (`run_batch`): runs go in lockstep over one record, a lane each.  `_advance` takes the plain steps of a
block of lanes at once, in vectors, and sorts the lanes that it marks: a turn is noted down, a lane with another event
is parked.  Every few samples `_resolve` solves what has gathered, the turns together, the crossings together, what
follows them to the end of the sample together (`_solve_turns`, `_solve_crossings`, `_finish_pieces`: written out, so
that they become vector code too), and what is out of the ordinary one by one (`_sample`, piece by piece: series, first
event, what happens there); then each lane catches up with the others.  A block at rest has no lane until the sample
that lifts it.  Nor has one that bounces low about theta = 0, every few samples or more often: such blocks gather, and
`_bounce` follows them together, flight by flight (`_solve_flights`), to where they rest or rise.  A run's bits do not
depend on who is beside it.  After the record, `_free` follows the block until nothing can change.

All functions called by a kernel stand in this file: numba's disk cache looks at one file only.
"""

import math
from typing import Any, NamedTuple

import numpy as np
from numba import njit

# Kernels that allocate nothing run without numba's reference counts (their atomic operations cost more than a piece).
# Fused multiply-add is for the scalar ones, and for turns and flights, whose columns fill whole vectors: a lane's bits
# must not depend on how many lanes go beside it.
_DRIVER: dict[str, Any] = {"cache": True, "nogil": True, "error_model": "numpy"}
_LANES: dict[str, Any] = {**_DRIVER, "_nrt": False}
_EVENT: dict[str, Any] = {**_LANES, "fastmath": {"contract"}}

# Columns of the region table: x'' = -stiffness x - damping x' + offset + forcing for lower <= x <= upper.
REGION_LOWER, REGION_UPPER, REGION_STIFFNESS, REGION_OFFSET, REGION_DAMPING, REGION_POTENTIAL = range(6)
REGION_COLUMNS = 6

# Columns of the link table.  *_OTHER: the region taken instead where the entry rule says so; TURN_*: the region that
# takes over where the velocity vanishes inside this one, left and right of zero.
(
    LINK_LOWER_ACTION,
    LINK_LOWER_TARGET,
    LINK_LOWER_OTHER,
    LINK_UPPER_ACTION,
    LINK_UPPER_TARGET,
    LINK_UPPER_OTHER,
    LINK_HELD,
    LINK_TURN_LEFT,
    LINK_TURN_RIGHT,
) = range(9)
LINK_COLUMNS = 9

CROSS, ENTER, IMPACT, OVERTURN = range(4)
NO_REGION = -1
REST = -1

# Rules of the damping held while a zone is crossed.
RULE_CONSTANT, RULE_ENTRY_SPEED, RULE_ENERGY = range(3)

# Parameters of an oscillator that are not a region's.
(
    PAR_GAIN,
    PAR_RESTITUTION,
    PAR_COEFFICIENT,
    PAR_RULE,
    PAR_START,
    PAR_UPLIFT_RIGHT,
    PAR_UPLIFT_LEFT,
    PAR_REST_RIGHT,
    PAR_REST_LEFT,
    PAR_EXACT,
) = range(10)
PAR_COLUMNS = 10

# State of a run.
THETA, OMEGA, HELD, PEAK, CALM_MARGIN, DAMPING, STRIKE, OVERTURN_TIME = range(8)
NOW, NEED, GRADE, UPWARD, LISTED, OVERTURNED, IMPACTS, UPLIFTED, TURNS, FREE, SAFE = range(11)
STATE_FLOATS, STATE_INTEGERS = 8, 11

# Results of a run.
(
    OUT_OVERTURNED,
    OUT_PEAK,
    OUT_UPLIFTED,
    OUT_IMPACTS,
    OUT_OVERTURN_TIME,
    OUT_STRIKE,
    OUT_DIRECTION,
) = range(7)
OUT_COLUMNS = 7

# What a batch counts: samples of all runs, those left out (before the first uplift, after overturning, once the rest of
# the record cannot overturn the block), events solved.
TALLY_SAMPLES, TALLY_BEFORE_UPLIFT, TALLY_OVERTURNED, TALLY_SAFE, TALLY_EVENTS = range(5)
TALLY_COLUMNS = 5

# Rows of a history.
HISTORY_THETA, HISTORY_OMEGA, HISTORY_REGION, HISTORY_DAMPING, HISTORY_PEAK = range(5)
HISTORY_ROWS = 5

BYTE_OF = np.array([0, 0, 0, 0, 7, 2, 4, 3, 0, 1, 0, 6, 0, 0, 0, 0, 5, 0, 0])
# Rows of the response before the first uplift, at scale factor 1.
UNIT_THETA, UNIT_OMEGA, UNIT_PEAK = range(3)
UNIT_ROWS = 3

# Runs that go over one record together, so that events are solved by the dozen (not a power of two: a lane's rows would
# share a set of the cache); a block of them, which the fastest cache holds, takes the steps of a tile in lockstep.
LANES = 1048
BLOCK = 176
# Samples of a record of which the largest is kept, for those who are at rest.
SPAN = 32
# Rows of the lanes' state: two sets of (theta, omega) written in turn.
(
    ROW_EVEN,
    _,
    ROW_ODD,
    _,
    ROW_AMPLITUDE,
    ROW_OFFSET,
    ROW_STIFFNESS,
    ROW_SQUARE,
    ROW_G0,
    ROW_G1,
    ROW_G2,
    ROW_G3,
    ROW_G2_RISE,
    ROW_UPPER,
    ROW_LOWER,
    ROW_CALM_UPPER,
    ROW_CALM_LOWER,
) = range(17)
LANE_ROWS = 17
# Samples that a lane may lag behind the others, so that events gather and are solved together (one that has just
# bounced may lag for longer: see below).
TILE = 6
# Samples between two looks at whether the rest of a record can still overturn a block.
SAFETY_INTERVAL = 16 * TILE

# Columns of a propagator; the grade says what a sample may be taken for, the pull is the region's largest |f(theta)|.
STEP_G0, STEP_G1, STEP_G2, STEP_G3, STEP_G2_RISE, STEP_DAMPING, STEP_GRADE, STEP_PULL = range(8)
STEP_COLUMNS = 8
MANY_STEPS, ONE_STEP, ONE_PIECE = range(3)
GRADES = (0.5, 0.25)  # largest rate * dt of one step, and of a piece of degree 12

# Rows of the pieces that are solved together, a column each.
(
    PIECE_OMEGA,
    PIECE_A,
    PIECE_SLOPE,
    PIECE_STIFFNESS,
    PIECE_DAMPING,
    PIECE_SPAN,
    PIECE_GAP,
    PIECE_TIME,
    PIECE_MOVED,
    PIECE_SPEED,
    PIECE_SURE,
) = range(11)
PIECE_ROWS = 11

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
# A block whose flight ends within so many samples bounces apart from the lanes, if its restitution leaves many bounces;
# such blocks are followed together, every so many samples (where they meet the lanes must not depend on who bounces).
BOUNCE_FLIGHT = 3.5
BOUNCE_RESTITUTION = 0.6
BOUNCE_INTERVAL = 16 * TILE

# What a marked sample needs.
WAITS, CROSSES, RETURNS, TURNS_BACK, HARD = range(5)
TURN_COLUMNS = LANES * TILE + 8

DEGREE = 30
MOVED, SPEED, ACCELERATION = range(3)
INVERSE = np.array([0.0, *(1.0 / k for k in range(1, DEGREE + 1))])
EPSILON = 2.220446049250313e-16
SPLITTER = 134217729.0  # 2^27 + 1
MARGIN = 32.0 * EPSILON
FLAT = 0.5 * math.pi
MANY_HOPS = 50
# After so many impacts, bounces below this height (rad) end at rest: only where e is within some 1e-6 of 1, and e = 1
# itself would go on by the billion.
MANY_IMPACTS = 4_000_000
NO_HEIGHT = 2e-11
MAX_FREE_PIECES = 100_000
MAX_FREE_TURNS = 4
FREE_STEP = 1e9  # s: longer than any piece


class Model(NamedTuple):
    """All oscillators of a batch: region tables, links, parameters, and a propagator per oscillator and region."""

    tables: Any
    links: Any
    parameters: Any
    steps: Any


class Lanes(NamedTuple):
    """The lanes' arrays: lockstep rows, marks (words: eight at a time), states, held propagators, which oscillator and
    run, amplitude; the pieces, zones and turns that wait to be solved together; the lanes parked, where and when; the
    lanes that are to be left (the last entry counts them): at rest, or bouncing; and until, or from, which sample.
    """

    rows: Any
    marks: Any
    words: Any
    x: Any
    k: Any
    own: Any
    oscillator: Any
    run: Any
    amplitude: Any
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
    """Runs without a lane: state, oscillator, run, amplitude, and a sample: where a block's rest ends, or how far a
    bouncing block has come.
    """

    x: Any
    k: Any
    oscillator: Any
    run: Any
    amplitude: Any
    until: Any


class Flights(NamedTuple):
    """The flights of bouncing blocks: the time in its sample from which each block goes on; a column for each flight,
    and whose it is.
    """

    time: Any
    columns: Any
    owner: Any


@njit(**_EVENT)
def _eval(poly, row, n, t):
    """One row of the local solution's Taylor series at t: displacement, velocity or acceleration."""
    s = poly[row, n]
    for k in range(n - 1, -1, -1):
        s = s * t + poly[row, k]
    return s


@njit(**_EVENT)
def _local(poly, n, t):
    """Displacement since the start, velocity and acceleration: three independent chains of one Horner pass."""
    value = poly[MOVED, n]
    slope = poly[SPEED, n]
    curvature = poly[ACCELERATION, n]
    for k in range(n - 1, -1, -1):
        value = value * t + poly[MOVED, k]
        slope = slope * t + poly[SPEED, k]
        curvature = curvature * t + poly[ACCELERATION, k]
    return value, slope, curvature


@njit(**_EVENT)
def _rate(stiffness, c):
    """Bound of the exponents of a linear piece, 1/s: |s| <= c/2 + sqrt(c²/4 + |K|)."""
    return 0.5 * c + math.sqrt(0.25 * c * c + abs(stiffness))


@njit(**_EVENT)
def _degree(z):
    """Degree at which the Taylor terms of a linear piece, which fall like z^k/k!, are below rounding (z <= 1/2)."""
    if z < 0.01:
        return 6
    if z < 0.03:
        return 8
    if z < 0.08:
        return 9
    if z < 0.2:
        return 11
    return 15


@njit(**_EVENT)
def _linear_series(poly, acceleration, omega, c, stiffness, slope, n):
    """Taylor coefficients 0 … n of displacement, velocity and acceleration about the current state.

    a' = slope - c a - K v, hence a_(k+1) (k+1) = -c a_k - K v_k, v_(k+1) (k+1) = a_k, y_(k+1) (k+1) = v_k.
    """
    poly[MOVED, 0] = 0.0
    poly[MOVED, 1] = omega
    poly[SPEED, 0] = omega
    poly[SPEED, 1] = acceleration
    poly[ACCELERATION, 0] = acceleration
    v = acceleration
    a = slope - c * acceleration - stiffness * omega
    poly[ACCELERATION, 1] = a
    for k in range(1, n):
        poly[MOVED, k + 1] = v * INVERSE[k + 1]
        new = -(c * a + stiffness * v) * INVERSE[k + 1]
        v = a * INVERSE[k + 1]
        a = new
        poly[SPEED, k + 1] = v
        poly[ACCELERATION, k + 1] = a


@njit(**_EVENT)
def _sine_and_cosine(x):
    """Both at once, by their series where the next term is below rounding: sooner than two calls."""
    if abs(x) > 0.5:
        return math.sin(x), math.cos(x)
    y = x * x
    s = -1.0 / 39916800.0 + y * (1.0 / 6227020800.0)
    s = -1.0 / 6.0 + y * (1.0 / 120.0 + y * (-1.0 / 5040.0 + y * (1.0 / 362880.0 + y * s)))
    c = -1.0 / 3628800.0 + y * (1.0 / 479001600.0 + y * (-1.0 / 87178291200.0))
    c = -0.5 + y * (1.0 / 24.0 + y * (-1.0 / 720.0 + y * (1.0 / 40320.0 + y * c)))
    return x + x * y * s, 1.0 + y * c


@njit(**_DRIVER, inline="always")
def _first_terms(sine, cosine, w0, a0, p2, force, slope):
    """The terms of `_exact_series` to degree 12, and what the next ones need.

    w and a: velocity and acceleration.  With sine s and cosine c of the running angle, f = force c - p² s and
    g = force s + p² c take turns as they do, k f_k = sum w_j g_(k-1-j) and k g_k = -sum w_j f_(k-1-j), and
    a = f + slope t c: a velocity is in the next but one after one sum and two products.
    """
    f0 = a0
    g0 = force * sine + p2 * cosine
    unit = 1.0 / (force * force + p2 * p2)
    by_f = slope * force * unit
    by_g = slope * p2 * unit
    w1 = a0
    f1 = w0 * g0
    g1 = -w0 * f0
    a1 = slope * cosine + f1
    w2 = a1 * (1.0 / 2.0)
    f2 = (w0 * g1 + w1 * g0) * (1.0 / 2.0)
    g2 = -(w0 * f1 + w1 * f0) * (1.0 / 2.0)
    a2 = (by_f * f1 + by_g * g1) + f2
    w3 = a2 * (1.0 / 3.0)
    f3 = ((w1 * g1) + (w0 * g2 + w2 * g0)) * (1.0 / 3.0)
    g3 = -((w1 * f1) + (w0 * f2 + w2 * f0)) * (1.0 / 3.0)
    a3 = (by_f * f2 + by_g * g2) + f3
    w4 = a3 * (1.0 / 4.0)
    f4 = ((w1 * g2 + w2 * g1) + (w0 * g3 + w3 * g0)) * (1.0 / 4.0)
    g4 = -((w1 * f2 + w2 * f1) + (w0 * f3 + w3 * f0)) * (1.0 / 4.0)
    a4 = (by_f * f3 + by_g * g3) + f4
    w5 = a4 * (1.0 / 5.0)
    f5 = ((w1 * g3 + w2 * g2 + w3 * g1) + (w0 * g4 + w4 * g0)) * (1.0 / 5.0)
    g5 = -((w1 * f3 + w2 * f2 + w3 * f1) + (w0 * f4 + w4 * f0)) * (1.0 / 5.0)
    a5 = (by_f * f4 + by_g * g4) + f5
    w6 = a5 * (1.0 / 6.0)
    f6 = ((w1 * g4 + w2 * g3 + w3 * g2 + w4 * g1) + (w0 * g5 + w5 * g0)) * (1.0 / 6.0)
    g6 = -((w1 * f4 + w2 * f3 + w3 * f2 + w4 * f1) + (w0 * f5 + w5 * f0)) * (1.0 / 6.0)
    a6 = (by_f * f5 + by_g * g5) + f6
    w7 = a6 * (1.0 / 7.0)
    f7 = ((w1 * g5 + w2 * g4 + w3 * g3 + w4 * g2 + w5 * g1) + (w0 * g6 + w6 * g0)) * (1.0 / 7.0)
    g7 = -((w1 * f5 + w2 * f4 + w3 * f3 + w4 * f2 + w5 * f1) + (w0 * f6 + w6 * f0)) * (1.0 / 7.0)
    a7 = (by_f * f6 + by_g * g6) + f7
    w8 = a7 * (1.0 / 8.0)
    f8 = ((w1 * g6 + w2 * g5 + w3 * g4 + w4 * g3 + w5 * g2 + w6 * g1) + (w0 * g7 + w7 * g0)) * (1.0 / 8.0)
    g8 = -((w1 * f6 + w2 * f5 + w3 * f4 + w4 * f3 + w5 * f2 + w6 * f1) + (w0 * f7 + w7 * f0)) * (1.0 / 8.0)
    a8 = (by_f * f7 + by_g * g7) + f8
    w9 = a8 * (1.0 / 9.0)
    f9 = ((w1 * g7 + w2 * g6 + w3 * g5 + w4 * g4 + w5 * g3 + w6 * g2 + w7 * g1) + (w0 * g8 + w8 * g0)) * (1.0 / 9.0)
    g9 = -((w1 * f7 + w2 * f6 + w3 * f5 + w4 * f4 + w5 * f3 + w6 * f2 + w7 * f1) + (w0 * f8 + w8 * f0)) * (1.0 / 9.0)
    a9 = (by_f * f8 + by_g * g8) + f9
    w10 = a9 * (1.0 / 10.0)
    f10 = ((w1 * g8 + w2 * g7 + w3 * g6 + w4 * g5 + w5 * g4 + w6 * g3 + w7 * g2 + w8 * g1) + (w0 * g9 + w9 * g0)) * (
        1.0 / 10.0
    )
    g10 = -((w1 * f8 + w2 * f7 + w3 * f6 + w4 * f5 + w5 * f4 + w6 * f3 + w7 * f2 + w8 * f1) + (w0 * f9 + w9 * f0)) * (
        1.0 / 10.0
    )
    a10 = (by_f * f9 + by_g * g9) + f10
    w11 = a10 * (1.0 / 11.0)
    of_f = (f1, f2, f3, f4, f5, f6, f7, f8, f9, f10)
    of_g = (g1, g2, g3, g4, g5, g6, g7, g8, g9, g10)
    of_w = (w2, w3, w4, w5, w6, w7, w8, w9, w10, w11)
    return unit, of_f, of_g, of_w, (a1, a2, a3, a4, a5, a6, a7, a8, a9, a10)


@njit(**_DRIVER, inline="always")
def _terms_end(w0, a0, a1, a9, a10, h):
    """Whether the last terms of the displacement at degree 12 are below rounding."""
    least = 1e-17 * max(abs(w0), 0.5 * abs(a0) * h, 0.5 * abs(a1) * h * h)
    fifth = h * h * h * h * h
    return abs(a9) * fifth * fifth <= 10.0 * least and abs(a10) * fifth * fifth * h <= 11.0 * least


@njit(**_EVENT)
def _few_terms(poly, trig, w0, a0, p2, force, slope, h):
    """The terms of `_exact_series` to degree 12, written out: the degree, 0 where they are not enough."""
    unit, of_f, of_g, of_w, of_a = _first_terms(trig[0, 0], trig[1, 0], w0, a0, p2, force, slope)
    f1, f2, f3, f4, f5, f6, f7, f8, f9, f10 = of_f
    g1, g2, g3, g4, g5, g6, g7, g8, g9, g10 = of_g
    w2, w3, w4, w5, w6, w7, w8, w9, w10, w11 = of_w
    a1, a2, a3, a4, a5, a6, a7, a8, a9, a10 = of_a
    poly[MOVED, 0] = 0.0
    poly[SPEED, 0] = w0
    poly[ACCELERATION, 0] = a0
    poly[MOVED, 1] = w0
    poly[SPEED, 1] = a0
    poly[MOVED, 2] = 0.5 * a0
    poly[ACCELERATION, 1] = a1
    poly[SPEED, 2] = w2
    poly[MOVED, 3] = w2 * (1.0 / 3.0)
    poly[ACCELERATION, 2] = a2
    poly[SPEED, 3] = w3
    poly[MOVED, 4] = w3 * (1.0 / 4.0)
    poly[ACCELERATION, 3] = a3
    poly[SPEED, 4] = w4
    poly[MOVED, 5] = w4 * (1.0 / 5.0)
    poly[ACCELERATION, 4] = a4
    poly[SPEED, 5] = w5
    poly[MOVED, 6] = w5 * (1.0 / 6.0)
    poly[ACCELERATION, 5] = a5
    poly[SPEED, 6] = w6
    poly[MOVED, 7] = w6 * (1.0 / 7.0)
    poly[ACCELERATION, 6] = a6
    poly[SPEED, 7] = w7
    poly[MOVED, 8] = w7 * (1.0 / 8.0)
    poly[ACCELERATION, 7] = a7
    poly[SPEED, 8] = w8
    poly[MOVED, 9] = w8 * (1.0 / 9.0)
    poly[ACCELERATION, 8] = a8
    poly[SPEED, 9] = w9
    poly[MOVED, 10] = w9 * (1.0 / 10.0)
    poly[ACCELERATION, 9] = a9
    poly[SPEED, 10] = w10
    poly[MOVED, 11] = w10 * (1.0 / 11.0)
    poly[ACCELERATION, 10] = a10
    poly[SPEED, 11] = w11
    poly[MOVED, 12] = w11 * (1.0 / 12.0)
    if _terms_end(w0, a0, a1, a9, a10, h):
        return 12
    trig[0, 1] = (force * g1 - p2 * f1) * unit
    trig[1, 1] = (force * f1 + p2 * g1) * unit
    trig[0, 2] = (force * g2 - p2 * f2) * unit
    trig[1, 2] = (force * f2 + p2 * g2) * unit
    trig[0, 3] = (force * g3 - p2 * f3) * unit
    trig[1, 3] = (force * f3 + p2 * g3) * unit
    trig[0, 4] = (force * g4 - p2 * f4) * unit
    trig[1, 4] = (force * f4 + p2 * g4) * unit
    trig[0, 5] = (force * g5 - p2 * f5) * unit
    trig[1, 5] = (force * f5 + p2 * g5) * unit
    trig[0, 6] = (force * g6 - p2 * f6) * unit
    trig[1, 6] = (force * f6 + p2 * g6) * unit
    trig[0, 7] = (force * g7 - p2 * f7) * unit
    trig[1, 7] = (force * f7 + p2 * g7) * unit
    trig[0, 8] = (force * g8 - p2 * f8) * unit
    trig[1, 8] = (force * f8 + p2 * g8) * unit
    trig[0, 9] = (force * g9 - p2 * f9) * unit
    trig[1, 9] = (force * f9 + p2 * g9) * unit
    trig[0, 10] = (force * g10 - p2 * f10) * unit
    trig[1, 10] = (force * f10 + p2 * g10) * unit
    return 0


@njit(**_EVENT)
def _many_terms(poly, trig, omega, p2, scale, force, slope, h):
    """The terms of `_exact_series` after the few, as many as are needed: the degree, and the step that they serve."""
    start = abs(poly[ACCELERATION, 0])
    jerk = abs(poly[ACCELERATION, 1])
    largest = max(abs(omega) * h, 0.5 * start * h * h, 0.5 * jerk * h * h * h)
    power = h**12
    before = abs(poly[SPEED, 11]) * power
    n = DEGREE
    for k in range(11, DEGREE - 1):
        s = 0.0
        c = 0.0
        for j in range(k):
            s -= poly[SPEED, j] * trig[1, k - 1 - j]
            c += poly[SPEED, j] * trig[0, k - 1 - j]
        trig[0, k] = s * INVERSE[k]
        trig[1, k] = c * INVERSE[k]
        a = -p2 * trig[0, k] + (force * trig[1, k] + slope * trig[1, k - 1]) * scale
        poly[ACCELERATION, k] = a
        poly[SPEED, k + 1] = a * INVERSE[k + 1]
        poly[MOVED, k + 2] = poly[SPEED, k + 1] * INVERSE[k + 2]
        power *= h
        term = abs(poly[SPEED, k + 1]) * power
        if term <= 1e-17 * largest and before <= 1e-17 * largest:
            n = k + 2
            break
        before = term
    if n == DEGREE:
        while (
            abs(poly[SPEED, n - 1]) * h**n > 1e-17 * largest or abs(poly[SPEED, n - 2]) * h ** (n - 1) > 1e-17 * largest
        ) and h > 1e-12:
            h *= 0.7
            largest = max(abs(omega) * h, 0.5 * start * h * h, 0.5 * jerk * h * h * h)
    return n, h


@njit(**_EVENT)
def _exact_series(poly, trig, theta, omega, p2, tilt, scale, force, slope, h):
    """Taylor coefficients of x'' = -p² sin(tilt - x) + (force + slope t) cos(tilt - x) scale, and a safe step.

    sin and cos of the running angle by their product recurrences.  The step returned (<= h) keeps the neglected terms
    below 1e-17 of the largest kept one and holds at most one zero of the acceleration: proved by a bound on the terms
    of the acceleration, or of the jerk, that follow the first.
    """
    trig[0, 0], trig[1, 0] = _sine_and_cosine(tilt - theta)
    a = -p2 * trig[0, 0] + force * trig[1, 0] * scale
    if omega == 0.0 and abs(a) <= 2.0 * EPSILON * (p2 * abs(trig[0, 0]) + abs(force * trig[1, 0] * scale)):
        a = 0.0
    n = _few_terms(poly, trig, omega, a, p2, force * scale, slope * scale, h)
    if n == 0:
        n, h = _many_terms(poly, trig, omega, p2, scale, force, slope, h)
    start = abs(poly[ACCELERATION, 0])
    jerk = abs(poly[ACCELERATION, 1])
    for _ in range(40):
        of_a = 0.0
        of_jerk = 0.0
        power = 1.0
        for k in range(1, n - 1):
            power *= h
            term = abs(poly[ACCELERATION, k]) * power
            of_a += term
            if k > 1:
                of_jerk += k * term
        if start > of_a or jerk * h > of_jerk or (omega == 0.0 and start == 0.0 and jerk == 0.0):
            break
        h *= 0.5
    poly[SPEED, n] = 0.0
    poly[ACCELERATION, n - 1] = 0.0
    poly[ACCELERATION, n] = 0.0
    return n, h


@njit(**_EVENT)
def _root(poly, row, n, m, right):
    """The zero in (0, right) of a row of the series over t^m (its first m coefficients vanish): it has just one."""
    left = 0.0
    start = poly[row, m]
    end = _eval(poly, row, n, right)
    for _ in range(m):
        end /= right
    t = right * start / (start - end)
    for _ in range(100):
        f = poly[row, n]
        d = 0.0
        for k in range(n - 1, m - 1, -1):
            d = d * t + f
            f = f * t + poly[row, k]
        if (f > 0.0) == (start > 0.0):
            left = t
        else:
            right = t
        step = -f / d if d != 0.0 else -2.0 * t
        new = t + step
        if abs(step) <= 4e-16 * t:
            return t
        if not (left < new < right):
            new = 0.5 * (left + right)
            if new in (left, right):
                return new
        elif abs(step) <= 1e-9 * t:
            return new
        t = new
    return t


@njit(**_EVENT)
def _root_of_curvature(poly, n, right):
    """The zero of the acceleration in (0, right), where it changes sign once."""
    left = 0.0
    start = poly[ACCELERATION, 0]
    for _ in range(60):
        t = 0.5 * (left + right)
        f = _eval(poly, ACCELERATION, n, t)
        if f == 0.0:
            return t
        if (f > 0.0) == (start > 0.0):
            left = t
        else:
            right = t
        if right - left <= 1e-15 * right:
            break
    return 0.5 * (left + right)


@njit(**_EVENT)
def _root_of_value(poly, n, gap, right, guess):
    """The time in (0, right] at which the displacement reaches gap, and the velocity there; it is monotone till then.

    Chebyshev's third-order step inside a bracket; two evaluations from a good guess.
    """
    left = 0.0
    sign = 1.0 if gap > 0.0 else -1.0
    t = guess if 0.0 < guess < right else 0.5 * right
    velocity = 0.0
    for _ in range(100):
        value, velocity, curvature = _local(poly, n, t)
        f = value - gap
        if f * sign > 0.0:
            right = t
        else:
            left = t
        step = -f / velocity if velocity != 0.0 else -2.0 * t
        bend = 0.5 * curvature / velocity * step if velocity != 0.0 else 0.0
        new = t + step * (1.0 - bend)
        if abs(step) <= 4e-16 * t:
            return t, velocity
        if not (left < new < right) or abs(bend) > 0.25:
            new = 0.5 * (left + right)
            if new in (left, right):
                return t, velocity
        elif abs(step) <= 1e-8 * t:
            return new, velocity + curvature * step
        t = new
    return t, velocity


NO_EVENT, TURN, AT_LOWER, AT_UPPER = range(4)


@njit(**_EVENT)
def _first_event(poly, n, h, theta, lower, upper, hop):
    """Kind and time of the first event in (0, h] of a piece, the displacement and the velocity then.

    The acceleration has at most one zero in the piece, so the signs of velocity and acceleration at both ends decide.
    A bounce from an edge and back to it that stays below `hop` is solved in one, without its turn.
    """
    m = 0
    while m < 3 and poly[SPEED, m] == 0.0:
        m += 1
    if m == 3:
        return NO_EVENT, h, 0.0, 0.0  # an equilibrium under constant forcing
    omega = poly[SPEED, 0]
    start = poly[ACCELERATION, 0]
    direction = 1.0 if poly[SPEED, m] > 0.0 else -1.0
    gap = upper - theta if direction > 0.0 else lower - theta
    edge = AT_UPPER if direction > 0.0 else AT_LOWER
    if gap * direction <= 0.0:
        return edge, 0.0, 0.0, omega
    moved, final, acceleration = _local(poly, n, h)
    turn = -1.0
    if final * direction < 0.0:
        behind = lower if direction > 0.0 else upper
        if theta == behind and moved * direction < 0.0 and m == 0:
            reach = (abs(omega) + 1.2 * h * max(abs(start), abs(acceleration))) * h
            if reach <= hop and reach < gap * direction:
                t = _root(poly, MOVED, n, 1, h)
                return (AT_LOWER if direction > 0.0 else AT_UPPER), t, 0.0, _eval(poly, SPEED, n, t)
        turn = _root(poly, SPEED, n, m, h)
    elif m == 0 and start * direction < 0.0 and acceleration * direction > 0.0:
        # The velocity dips towards zero and recovers: look at its extremum.
        lowest = _root_of_curvature(poly, n, h)
        if _eval(poly, SPEED, n, lowest) * direction < 0.0:
            turn = _root(poly, SPEED, n, 0, lowest)
    end = h
    if turn >= 0.0:
        end = turn
        moved = _eval(poly, MOVED, n, turn)
    if moved * direction >= gap * direction:
        # first guess: the root of the parabola through the start (the middle where it has none)
        discriminant = omega * omega + 2.0 * start * gap
        guess = -1.0
        if discriminant > 0.0:
            guess = 2.0 * gap / (omega + direction * math.sqrt(discriminant))
            # and the cubic term by one more step
            speed = omega + start * guess
            if speed * direction > 0.0:
                guess -= poly[MOVED, 3] * guess * guess * guess / speed
        t, velocity = _root_of_value(poly, n, gap, end, guess)
        return edge, t, gap, velocity
    if turn >= 0.0:
        return TURN, turn, moved, 0.0
    return NO_EVENT, h, moved, final


@njit(**_EVENT)
def _crossing_time(zeta, gap, u0, u1, r0, r1):
    """Time that a crossing takes with damping ratio zeta, and its derivative by zeta (see `energy_consistent_zeta`).

    gap = 1 - zeta²; u = v + zeta z and r = u² + gap z² at the start (0) and at the end (1).  Needs u0 > sqrt(-gap)
    where overdamped.
    """
    if abs(gap) < 1e-3 * min(u0, u1) ** 2 and u0 > 0.0:
        # near critical damping: atan(w/u)/w as a series in w² = gap, the same on either side
        time = 0.0
        by_gap = 0.0
        p0 = 1.0 / u0
        p1 = 1.0 / u1
        power = 1.0
        for k in range(6):
            time += power * (p0 + p1) / (2 * k + 1)
            by_gap -= (k + 1) * power * (p0 / (u0 * u0) + p1 / (u1 * u1)) / (2 * k + 3)
            p0 /= u0 * u0
            p1 /= u1 * u1
            power *= -gap
        return time, 1.0 / r0 - 1.0 / r1 - 2.0 * zeta * by_gap
    if gap > 0.0:
        w = math.sqrt(gap)
        # (the two angles lie in (0, pi), their sum in (0, 2 pi))
        angle = math.atan2(w * (u0 + u1), u0 * u1 - gap)
        time = (angle if angle > 0.0 else angle + 2.0 * math.pi) / w
        return time, ((u0 * zeta / w - w) / -r0 - (u1 * zeta / w + w) / r1) / w + time * zeta / gap
    w = math.sqrt(-gap)
    time = 0.5 * (math.log((u0 + w) ** 2 / r0) + math.log((u1 + w) ** 2 / r1)) / w
    return time, ((u0 * zeta / w + w) / r0 + (u1 * zeta / w - w) / r1) / w + time * zeta / gap


@njit(**_EVENT)
def energy_consistent_zeta(speed, exit_speed):
    """Damping ratio with which a crossing from -1 at `speed` leaves +1 at `exit_speed` (unit frequency, unforced).

    With u = v + zeta z and w² = 1 - zeta², r = u² + w² z² falls as exp(-2 zeta t) along the motion, and the phase
    atan2(w z, u) grows as w t (hyperbolic where overdamped).  So the start (-1, speed) and the end (1, exit_speed) give
    the time between them in closed form, and one equation for zeta alone,
    ln(r_start/r_end) = 2 zeta time, which falls strictly: Newton's step in a bracket finds its root to rounding.
    """
    loss = (speed - exit_speed) * (speed + exit_speed)
    if loss <= 0.0:
        return 0.0
    # First guess: the loss over the undamped path, slowed to first order (phase: from the middle to the edge).
    phase = math.atan2(1.0, speed)
    path = speed + (speed * speed + 1.0) * phase
    zeta = 0.5 * loss / (path + math.sqrt(max(0.0, path * (path - 2.0 * phase * loss))))
    low = 0.0
    high = math.inf
    for _ in range(200):
        gap = (1.0 - zeta) * (1.0 + zeta)
        u0 = speed - zeta
        u1 = exit_speed + zeta
        r1 = 1.0 + exit_speed * (exit_speed + 2.0 * zeta)
        excess = loss - 2.0 * zeta * (speed + exit_speed)
        r0 = r1 + excess
        arrives = r0 > 0.0 and (gap > 0.0 or u0 > math.sqrt(-gap))
        newton = -1.0
        if arrives:
            time, by_zeta = _crossing_time(zeta, gap, u0, u1, r0, r1)
            residual = math.log1p(excess / r1) - 2.0 * zeta * time
            slope = -2.0 * (speed / r0 + exit_speed / r1 + time + zeta * by_zeta)
            arrives = residual >= 0.0
            if slope < 0.0:
                newton = zeta - residual / slope
        if arrives:
            low = zeta
        else:
            high = zeta
        new = newton
        if not (low <= new <= high):
            new = 0.5 * (low + high) if high < math.inf else 2.0 * zeta
        if abs(new - zeta) <= 1e-8 * zeta and new == newton:
            return new  # (what is left is of the order of the square of the step)
        if abs(new - zeta) <= 4e-16 * zeta:
            return new
        zeta = new
    return zeta


@njit(**_DRIVER, inline="always")
def _captures(links, o, region):
    """Whether another region takes over where the velocity vanishes inside this one."""
    return links[o, region, LINK_TURN_LEFT] != NO_REGION or links[o, region, LINK_TURN_RIGHT] != NO_REGION


@njit(**_EVENT)
def _potential(tables, o, region, exact, theta):
    """Potential energy per unit inertia at theta, as continued from `region`."""
    stiffness = tables[o, region, REGION_STIFFNESS]
    offset = tables[o, region, REGION_OFFSET]
    if exact:
        tilt = offset / stiffness
        return -stiffness * (math.cos(tilt - theta) - math.cos(tilt)) + tables[o, region, REGION_POTENTIAL]
    return (0.5 * stiffness * theta - offset) * theta + tables[o, region, REGION_POTENTIAL]


@njit(**_EVENT)
def _held_damping(tables, parameters, o, zone, omega):
    """Damping of the zone from this inward crossing to the next, by the oscillator's rule (per unit inertia, 1/s)."""
    rule = int(parameters[o, PAR_RULE])
    speed = abs(omega)
    if rule == RULE_ENTRY_SPEED:
        return parameters[o, PAR_COEFFICIENT] * speed
    if rule == RULE_ENERGY:
        e = parameters[o, PAR_RESTITUTION]
        if e == 1.0:
            return 0.0
        half = 0.5 * (tables[o, zone, REGION_UPPER] - tables[o, zone, REGION_LOWER])
        frequency = math.sqrt(tables[o, zone, REGION_STIFFNESS])
        unit = 1.0 / (half * frequency)
        # PAR_COEFFICIENT: potential at the zone's edge, so that exit² = e² entry² - 2 (1 - e²) U
        squared = e * e * speed * speed - 2.0 * (1.0 - e * e) * parameters[o, PAR_COEFFICIENT]
        if squared > 0.0:
            return 2.0 * frequency * energy_consistent_zeta(speed * unit, math.sqrt(squared) * unit)
        # It just stops at the far edge.  A hair more damping turns it inside: on the edge itself rounding would decide
        # whether another crossing, with another damping, follows.
        zeta = energy_consistent_zeta(speed * unit, 0.0)
        return 2.0 * frequency * (zeta * (1.0 + 1e-13) + 1e-13)
    return tables[o, zone, REGION_DAMPING]


@njit(**_EVENT)
def _settles(parameters, o, omega, stiffness, force, slope, left, highest):
    """Whether all later bounces provably end before the sample does, or before its forcing reaches the threshold.

    On either side the deceleration changes one way over a horizon, from a to b say; a bounce under it comes back faster
    by sqrt(b/a) at most, and over many bounces these factors multiply to no more than sqrt(max/min) of each side.  So,
    with a_min the least deceleration and r the product of both ratios, the bounces that follow take at most
    2|omega| sqrt(r)/((1 - e) a_min) in all and rise to omega² r/(2 a_min), which must not exceed `highest`: the peak so
    far, and the branch on which there are impacts only.  A tenth of a_min is kept for the softening |K| x of the
    branch: x <= (1 - e)² a_min horizon²/8, and a horizon of half its time constant keeps it below 1/32.
    """
    if omega == 0.0:
        return True
    e = parameters[o, PAR_RESTITUTION]
    right = parameters[o, PAR_UPLIFT_RIGHT]
    left_side = parameters[o, PAR_UPLIFT_LEFT]
    # (mostly the answer is no, and this is enough to tell)
    if 2.0 * abs(omega) >= (1.0 - e) * 0.5 * (right + left_side) * left:
        return False
    horizon = min(left, 0.5 / math.sqrt(-stiffness))
    end = force + slope * horizon
    # Where the threshold is exceeded later in this sample, half the time until then is the horizon.
    if end > parameters[o, PAR_UPLIFT_RIGHT] and slope > 0.0:
        horizon = 0.5 * (parameters[o, PAR_UPLIFT_RIGHT] - force) / slope
    elif end < -parameters[o, PAR_UPLIFT_LEFT] and slope < 0.0:
        horizon = 0.5 * (-parameters[o, PAR_UPLIFT_LEFT] - force) / slope
    end = force + slope * horizon
    least_right = right - max(force, end)
    least_left = left_side + min(force, end)
    a_min = 0.9 * min(least_right, least_left)
    if a_min <= 0.0:
        return False
    r = (right - min(force, end)) / least_right * ((left_side + max(force, end)) / least_left)
    time = (1.0 - e) * a_min * horizon
    return 4.0 * omega * omega * r <= time * time and omega * omega * r <= 2.0 * a_min * highest


@njit(**_EVENT)
def _uplift(parameters, o, x, k, force, slope, left):
    """From rest: the time until the forcing exceeds the threshold (left if it does not) and the forcing there.

    Forcing that is at the threshold to rounding lifts the block only if it grows: the margin is wider than the one
    within which a piece takes its acceleration for zero, or a block could be lifted and set down without end.
    """
    right = parameters[o, PAR_UPLIFT_RIGHT]
    leftward = -parameters[o, PAR_UPLIFT_LEFT]
    end = force + slope * left
    t = 0.0
    if force > right * (1.0 + MARGIN) or force < leftward * (1.0 + MARGIN):
        pass
    elif end > right * (1.0 + MARGIN) and slope > 0.0:
        t = max(right - force, 0.0) / slope
        force = right
    elif end < leftward * (1.0 + MARGIN) and slope < 0.0:
        t = min(leftward - force, 0.0) / slope
        force = leftward
    else:
        return left, force
    k[NOW] = int(parameters[o, PAR_REST_RIGHT]) if force > 0.0 else int(parameters[o, PAR_REST_LEFT])
    k[UPLIFTED] = 1
    x[THETA] = 0.0
    x[OMEGA] = 0.0
    return min(t, left), force


@njit(**_EVENT)
def _record_turn(x, k, tables, links, o, exact, region, time, turning_points):
    """A turning point: the peak, the list of peaks, and the region that takes over where one does."""
    theta = x[THETA]
    x[PEAK] = max(x[PEAK], abs(theta))
    if k[TURNS] < turning_points.shape[1]:
        turning_points[0, k[TURNS]] = time
        turning_points[1, k[TURNS]] = theta
    k[TURNS] += 1
    target = links[o, region, LINK_TURN_RIGHT] if theta >= 0.0 else links[o, region, LINK_TURN_LEFT]
    if target != NO_REGION:
        # Same energy on the branch that takes over: U(theta') = U(theta), the root next to zero, on the same side.
        energy = _potential(tables, o, region, exact, theta) - tables[o, target, REGION_POTENTIAL]
        stiffness = tables[o, target, REGION_STIFFNESS]
        offset = tables[o, target, REGION_OFFSET]
        root = math.sqrt(max(0.0, offset * offset + 2.0 * stiffness * energy))
        other_side = offset > 0.0 if offset != 0.0 else theta < 0.0
        denominator = offset + (root if other_side else -root)
        x[THETA] = -2.0 * energy / denominator if denominator != 0.0 else 0.0
        k[NOW] = target


@njit(**_DRIVER, inline="always")
def _at_edge(x, k, tables, links, parameters, o, region, upper, force, slope, left, time):
    """What happens where the rotation reaches an edge of its region."""
    if upper:
        action = links[o, region, LINK_UPPER_ACTION]
        target = links[o, region, LINK_UPPER_TARGET]
        other = links[o, region, LINK_UPPER_OTHER]
    else:
        action = links[o, region, LINK_LOWER_ACTION]
        target = links[o, region, LINK_LOWER_TARGET]
        other = links[o, region, LINK_LOWER_OTHER]
    if action == OVERTURN:
        k[OVERTURNED] = 1
        x[PEAK] = FLAT
        x[OVERTURN_TIME] = time
        return
    k[NOW] = target
    if action == CROSS:
        k[UPLIFTED] = 1
    elif action == ENTER:
        if other != NO_REGION:
            # Too slow for an impact with e to carry it through the zone: it stays on the rigid branch.
            e = parameters[o, PAR_RESTITUTION]
            potential = _potential(tables, o, region, False, x[THETA])
            if e * e * (0.5 * x[OMEGA] * x[OMEGA] + potential) <= potential:
                k[NOW] = other
                return
        k[IMPACTS] += 1
        x[STRIKE] = max(x[STRIKE], abs(x[OMEGA]))
        x[HELD] = _held_damping(tables, parameters, o, target, x[OMEGA])
    else:
        k[IMPACTS] += 1
        x[STRIKE] = max(x[STRIKE], abs(x[OMEGA]))
        x[OMEGA] *= parameters[o, PAR_RESTITUTION]
        stiffness = tables[o, region, REGION_STIFFNESS]
        highest = min(x[PEAK], tables[o, target, REGION_UPPER] - tables[o, target, REGION_LOWER])
        highest = min(highest, tables[o, region, REGION_UPPER] - tables[o, region, REGION_LOWER])
        if k[FREE] == 0 and _settles(parameters, o, x[OMEGA], stiffness, force, slope, left, highest):
            x[OMEGA] = 0.0
            k[NOW] = REST


@njit(**_EVENT)
def _piece(x, k, tables, links, parameters, o, force, slope, left, time, poly, trig, turning_points):
    """One piece: from the state to its first event, or to the end of the step; the time it took."""
    waited = 0.0
    if k[NOW] == REST:
        waited, force = _uplift(parameters, o, x, k, force, slope, left)
        if k[NOW] == REST:
            return left
        left -= waited
    region = k[NOW]
    theta = x[THETA]
    omega = x[OMEGA]
    stiffness = tables[o, region, REGION_STIFFNESS]
    offset = tables[o, region, REGION_OFFSET]
    exact = parameters[o, PAR_EXACT] != 0.0
    if exact:
        h = min(left, 0.5 / math.sqrt(-stiffness))
        n, h = _exact_series(
            poly, trig, theta, omega, -stiffness, offset / stiffness, parameters[o, PAR_EXACT], force, slope, h
        )
    else:
        c = x[HELD] if links[o, region, LINK_HELD] else tables[o, region, REGION_DAMPING]
        rate = _rate(stiffness, c)
        h = left if rate * left <= 0.5 else 0.5 / rate
        a = force + offset - stiffness * theta
        if omega == 0.0 and abs(a) <= 2.0 * EPSILON * (abs(force) + abs(offset) + abs(stiffness * theta)):
            a = 0.0  # the sign of what is left is rounding; the slope of the forcing decides
        n = _degree(rate * h)
        _linear_series(poly, a - c * omega, omega, c, stiffness, slope, n)
    hop = -1.0
    if k[FREE] == 0 and turning_points.shape[1] == 0 and not _captures(links, o, region):
        hop = x[PEAK] - abs(theta)
    kind, t, moved, velocity = _first_event(
        poly, n, h, theta, tables[o, region, REGION_LOWER], tables[o, region, REGION_UPPER], hop
    )
    if kind == NO_EVENT:
        x[THETA] = theta + moved
        x[OMEGA] = velocity
        return waited + (left if h == left else t)
    now = time + waited + t
    if kind == TURN:
        x[THETA] = theta + moved
        x[OMEGA] = 0.0
        _record_turn(x, k, tables, links, o, exact, region, now, turning_points)
        return waited + t
    upper = kind == AT_UPPER
    x[THETA] = tables[o, region, REGION_UPPER] if upper else tables[o, region, REGION_LOWER]
    x[OMEGA] = max(velocity, 0.0) if upper else min(velocity, 0.0)
    _at_edge(x, k, tables, links, parameters, o, region, upper, force + slope * t, slope, left - t, now)
    return waited + t


@njit(**_EVENT)
def _glide(x, k, tables, parameters, o, force, slope, h):
    """A step in exact geometry that proves to hold no event, at degree 12: whether it was one (else all is as it was).

    The velocity keeps its sign where the acceleration does and it has the same at both ends, or where it is larger than
    the acceleration can change it.
    """
    region = k[NOW]
    theta = x[THETA]
    w0 = x[OMEGA]
    p2 = -tables[o, region, REGION_STIFFNESS]
    if w0 == 0.0 or 4.0 * p2 * h * h > 1.0:
        return False
    sine, cosine = _sine_and_cosine(-tables[o, region, REGION_OFFSET] / p2 - theta)
    force *= parameters[o, PAR_EXACT]
    slope *= parameters[o, PAR_EXACT]
    a0 = force * cosine - p2 * sine
    _, _, _, of_w, of_a = _first_terms(sine, cosine, w0, a0, p2, force, slope)
    w2, w3, w4, w5, w6, w7, w8, w9, w10, w11 = of_w
    a1, a2, a3, a4, a5, a6, a7, a8, a9, a10 = of_a
    if not _terms_end(w0, a0, a1, a9, a10, h):
        return False
    # (in pairs: the last terms are the last to be known)
    square = h * h
    sixth = square * square * square
    speed = (w6 + h * w7) + square * ((w8 + h * w9) + square * (w10 + h * w11))
    speed = w0 + (h * (a0 + h * (w2 + h * (w3 + h * (w4 + h * w5)))) + sixth * speed)
    change = abs(a6) + h * (abs(a7) + h * (abs(a8) + h * (abs(a9) + h * abs(a10))))
    change = h * (abs(a1) + h * (abs(a2) + h * (abs(a3) + h * (abs(a4) + h * (abs(a5) + h * change)))))
    steady = abs(a0) > change and w0 * speed > 0.0
    if not steady and abs(w0) <= h * (abs(a0) + change):
        return False
    late = (w6 * (1.0 / 7.0) + h * w7 * (1.0 / 8.0)) + square * (w8 * (1.0 / 9.0) + h * w9 * (1.0 / 10.0))
    late += square * square * (w10 * (1.0 / 11.0) + h * w11 * (1.0 / 12.0))
    moved = w3 * (1.0 / 4.0) + h * (w4 * (1.0 / 5.0) + h * w5 * (1.0 / 6.0))
    moved = h * (w0 + h * (0.5 * a0 + h * (w2 * (1.0 / 3.0) + h * moved)))
    theta += moved + sixth * h * late
    if not tables[o, region, REGION_LOWER] < theta < tables[o, region, REGION_UPPER]:
        return False
    x[THETA] = theta
    x[OMEGA] = speed
    return True


@njit(**_EVENT)
def _bounces_to(tables, links, o, region):
    """The region on the other side of an impact at theta = 0, where nothing is damped; NO_REGION if it is not so."""
    upper = tables[o, region, REGION_UPPER] == 0.0
    action = links[o, region, LINK_UPPER_ACTION] if upper else links[o, region, LINK_LOWER_ACTION]
    if action != IMPACT or links[o, region, LINK_HELD] or tables[o, region, REGION_DAMPING] != 0.0:
        return NO_REGION
    return links[o, region, LINK_UPPER_TARGET] if upper else links[o, region, LINK_LOWER_TARGET]


@njit(**_DRIVER, inline="always")
def _flight_terms(stiffness, h):
    """M = -K h², and A, B and C of `_hops` by their series: exact to rounding for |m| <= 1/400."""
    m = -stiffness * h * h
    one = 1.0 + m * ((1.0 / 6.0) + m * ((1.0 / 120.0) + m * (1.0 / 5040.0)))
    two = 0.5 + m * ((1.0 / 24.0) + m * ((1.0 / 720.0) + m * (1.0 / 40320.0)))
    three = (1.0 / 6.0) + m * ((1.0 / 120.0) + m * ((1.0 / 5040.0) + m * (1.0 / 362880.0)))
    return m, one, two, three


@njit(**_EVENT)
def _hops(x, k, tables, links, parameters, o, force, slope, t, dt):
    """Short flights from an impact at theta = 0 to the next, to the end of the sample where they last so long.

    Over a flight theta/s = v A + a s B + b s² C and theta' = v (1 + m B) + s (a A + b s B), with b the slope of the
    forcing, m = -K s², A = sinh(sqrt m)/sqrt m, B = (cosh(sqrt m) - 1)/m and C = (A - 1)/m by their series.  Taken only
    where these are exact to rounding and the flight stays below the peak and in its region; the time reached within the
    sample.
    """
    here = k[NOW]
    there = _bounces_to(tables, links, o, here)
    if there == NO_REGION or _bounces_to(tables, links, o, there) != here:
        return t
    offset = tables[o, here, REGION_OFFSET]
    offset_there = tables[o, there, REGION_OFFSET]
    stiffness = tables[o, here, REGION_STIFFNESS]
    if stiffness != tables[o, there, REGION_STIFFNESS]:
        return t
    highest = min(
        x[PEAK],
        tables[o, here, REGION_UPPER] - tables[o, here, REGION_LOWER],
        tables[o, there, REGION_UPPER] - tables[o, there, REGION_LOWER],
    )
    e = parameters[o, PAR_RESTITUTION]
    settling = 0.25 * (1.0 - e) * (parameters[o, PAR_UPLIFT_RIGHT] + parameters[o, PAR_UPLIFT_LEFT])
    omega = x[OMEGA]
    strike = x[STRIKE]
    hops = 0
    while hops < MANY_HOPS:
        a = force + slope * t + offset
        if omega * a >= 0.0:
            break
        left = dt - t
        # the parabola's landing, and the next two terms by one step
        jerk = slope - stiffness * omega
        y2 = 0.5 * a
        y3 = jerk * (1.0 / 6.0)
        square = y2 * y2 - 4.0 * y3 * omega
        h = left
        if square > 0.0:
            root = math.copysign(math.sqrt(square), y2)
            guess = -2.0 * omega / (y2 + root)
            guess += guess * guess * guess * stiffness * (y2 * (1.0 / 12.0) + y3 * guess * (1.0 / 20.0)) / root
            if 0.0 < guess < left:
                h = guess
        # With |jerk| h <= |a|/4 the flight is a single arc; its height is a quarter of its first slope times its
        # length, a little more with a jerk.
        rise = abs(omega) * h * (1.0 if h == left else 0.35)
        if abs(jerk) * h > 0.25 * abs(a) or abs(stiffness) * h * h > 0.0025 or rise > highest:
            break
        f = 0.0
        speed = 0.0
        lands = False
        for _ in range(6):
            m, one, two, three = _flight_terms(stiffness, h)
            # rotation over h, whose zero is the landing, and velocity
            f = omega * one + h * (a * two + h * slope * three)
            speed = omega + (omega * m * two + h * (a * one + h * slope * two))
            if h == left and f * omega > 0.0:
                break
            step = -f * h / (speed - f)
            lands = abs(step) <= 1e-8 * h
            h = min(h + step, left)
            if lands:
                speed += step * (a + slope * h)
                break
        if not lands:
            if h == left:
                x[THETA] = left * f
                k[TURNS] += 1 if speed * omega < 0.0 else 0
                omega = speed
                t = dt
            break
        t += h
        hops += 1
        speed = min(speed, 0.0) if omega > 0.0 else max(speed, 0.0)
        strike = max(strike, abs(speed))
        omega = e * speed
        here, there = there, here
        offset, offset_there = offset_there, offset
        if abs(omega) < settling * (dt - t) or omega == 0.0:
            settles = _settles(parameters, o, omega, stiffness, force + slope * t, slope, dt - t, highest)
            if k[FREE] == 0 and settles:
                omega = 0.0
                here = REST
                break
    x[OMEGA] = omega
    x[STRIKE] = strike
    k[NOW] = here
    k[TURNS] += hops
    k[IMPACTS] += hops
    return t


@njit(**_EVENT)
def _at_zero(tables, parameters, o, region):
    """Next to theta = 0 in a region: theta'' = offset + gain forcing - (stiffness - lean forcing) theta."""
    stiffness = tables[o, region, REGION_STIFFNESS]
    offset = tables[o, region, REGION_OFFSET]
    scale = parameters[o, PAR_EXACT]
    if scale == 0.0:
        return offset, stiffness, 1.0, 0.0
    tilt = offset / stiffness
    return stiffness * math.sin(tilt), stiffness * math.cos(tilt), scale * math.cos(tilt), scale * math.sin(tilt)


@njit(**_EVENT)
def _low_hops(x, k, tables, links, parameters, o, force, slope, t, dt):
    """Bounces so low that each is a cubic to rounding: by the hundred thousand in a sample where e is next to 1.

    From an impact on, theta = v s + a s²/2 + j s³/6 - K a s⁴/24, where -K is the slope of the moment at zero (in the
    exact geometry, too: what follows is of the order of theta²).  The flight takes s = -2 v z/a with
    z = 1 - r z² - q z³, r = -2 j v/(3 a²), q = -K v²/(3 a²), lands with -v (2 - z + q z³), and rises to
    v² y (4 - y)/(6 |a|), y = 1 + w y²/2, w = j v/a².  Returns the time reached within the sample.
    """
    here = k[NOW]
    there = _bounces_to(tables, links, o, here)
    if there == NO_REGION or _bounces_to(tables, links, o, there) != here:
        return t
    offset, stiffness, gain, lean = _at_zero(tables, parameters, o, here)
    offset_there, stiffness_there, gain_there, lean_there = _at_zero(tables, parameters, o, there)
    outside = max(tables[o, here, REGION_STIFFNESS], tables[o, there, REGION_STIFFNESS])
    room = min(
        tables[o, here, REGION_UPPER] - tables[o, here, REGION_LOWER],
        tables[o, there, REGION_UPPER] - tables[o, there, REGION_LOWER],
    )
    e = parameters[o, PAR_RESTITUTION]
    settling = 0.25 * (1.0 - e) * (parameters[o, PAR_UPLIFT_RIGHT] + parameters[o, PAR_UPLIFT_LEFT])
    v = x[OMEGA]
    peak = x[PEAK]
    strike = x[STRIKE]
    hops = 0
    most = MANY_IMPACTS - k[IMPACTS]
    while hops < most:
        now = force + slope * t
        a = offset + gain * now
        bend = stiffness - lean * now
        jerk = gain * slope - bend * v
        over = 1.0 / a
        flight = v * over
        w = jerk * flight * over
        q = -bend * flight * flight * (1.0 / 3.0)
        height = -0.5 * abs(v) * flight
        small = abs(w) <= 1e-4 and abs(q) <= 1e-10 and -outside * height * height <= 1e-16 * abs(a)
        if not (small and 0.0 < height <= 0.5 * room):
            break
        r = w * (-2.0 / 3.0)
        z = 1.0 - q * (1.0 - 5.0 * r) - r * (1.0 - r * (2.0 - r * (5.0 - r * 14.0)))
        end = t - 2.0 * flight * z
        if end >= dt:
            break
        if height * 1.001 > peak:
            y = 1.0 + 0.5 * w * (1.0 + w)
            peak = max(peak, height * y * (4.0 - y) * (1.0 / 3.0))
        t = end
        v *= -(2.0 - z + q)
        strike = max(strike, abs(v))
        v *= e
        hops += 1
        here, there = there, here
        offset, offset_there = offset_there, offset
        stiffness, stiffness_there = stiffness_there, stiffness
        gain, gain_there = gain_there, gain
        lean, lean_there = lean_there, lean
        if (
            abs(v) < settling * (dt - t)
            and k[FREE] == 0
            and _settles(parameters, o, v, outside, force + slope * t, slope, dt - t, min(peak, room))
        ):
            v = 0.0
            here = REST
            break
    x[OMEGA] = v
    x[PEAK] = peak
    x[STRIKE] = strike
    k[NOW] = here
    k[TURNS] += hops
    k[IMPACTS] += hops
    return t


@njit(**_EVENT)
def _sample(x, k, tables, links, parameters, o, force, slope, t, dt, time, poly, trig, turning_points):
    """One sample from its time t on, cut at its events."""
    impacts = k[IMPACTS]
    hops = turning_points.shape[1] == 0 and parameters[o, PAR_EXACT] == 0.0
    while t < dt and k[OVERTURNED] == 0:
        if k[NOW] != REST and x[THETA] == 0.0:
            if k[IMPACTS] - impacts > MANY_HOPS and k[TURNS] >= turning_points.shape[1]:
                t = _low_hops(x, k, tables, links, parameters, o, force, slope, t, dt)
            if hops and k[NOW] != REST:
                t = _hops(x, k, tables, links, parameters, o, force, slope, t, dt)
            if t >= dt:
                break
        t += _piece(
            x, k, tables, links, parameters, o, force + slope * t, slope, dt - t, time + t, poly, trig, turning_points
        )
        if k[IMPACTS] > MANY_IMPACTS and x[THETA] == 0.0 and k[NOW] != REST:
            stiffness = tables[o, k[NOW], REGION_STIFFNESS]
            now = force + slope * t
            a_min = min(parameters[o, PAR_UPLIFT_RIGHT] - now, parameters[o, PAR_UPLIFT_LEFT] + now)
            if x[OMEGA] * x[OMEGA] <= 2.0 * a_min * NO_HEIGHT and stiffness < 0.0:
                x[OMEGA] = 0.0
                k[NOW] = REST


@njit(**_DRIVER, inline="always")
def _flight(theta, omega, a, slope, stiffness, h):
    """Rotation and velocity after h of a flight (see `_hops`)."""
    m, one, two, three = _flight_terms(stiffness, h)
    y = theta + h * (omega * one + h * (a * two + h * slope * three))
    return y, omega + (omega * m * two + h * (a * one + h * slope * two))


@njit(**_DRIVER, inline="always")
def _after(theta, omega, a, t):
    """Rotation after t under constant acceleration."""
    return theta + t * (omega + 0.5 * t * a)


@njit(**_EVENT)
def _lands_soon(x, k, tables, links, parameters, o, force, dt):
    """Whether a block bounces so low that it does so apart from the lanes: by the parabola of its flight."""
    here = k[NOW]
    if here == REST or k[OVERTURNED] != 0 or parameters[o, PAR_RESTITUTION] < BOUNCE_RESTITUTION:
        return False
    if x[THETA] == 0.0 and x[OMEGA] == 0.0:
        return False  # it has just been lifted
    there = _bounces_to(tables, links, o, here)
    if there == NO_REGION or _bounces_to(tables, links, o, there) != here:
        return False
    offset = tables[o, here, REGION_OFFSET]
    side = 1.0 if offset < 0.0 else -1.0
    lands = side * _after(x[THETA], x[OMEGA], force + offset, BOUNCE_FLIGHT * dt) < 0.0
    return lands and tables[o, here, REGION_STIFFNESS] == tables[o, there, REGION_STIFFNESS]


@njit(**_EVENT)
def _solve_flights(v, n, dt):
    """Each of n flights (columns of v) to its landing at theta = 0 and off again, or to the end of its sample.

    The displacement is that of `_hops`; the parabola's landing, corrected by the next two terms, then a step of
    Chebyshev's and one of Newton's.  LANDS_LOW where the block may settle, or its flights become too many; UNSURE, and
    left as it is, where the landing is not exact to rounding, or the flight may not be a single arc (see `_hops`), or
    rise above FLIGHT_HIGHEST.
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


@njit(**_EVENT)
def _load_flight(b, f, column, j, tables, links, parameters, record, dt, per_dt):
    """The flight of bouncing block j, from where it is, into a column."""
    v = f.columns
    o = b.oscillator[j]
    x = b.x[j]
    i = b.until[j]
    here = b.k[j, NOW]
    there = _bounces_to(tables, links, o, here)
    v[FLIGHT_THETA * LANES + column] = x[THETA]
    v[FLIGHT_OMEGA * LANES + column] = x[OMEGA]
    v[FLIGHT_TIME * LANES + column] = f.time[j]
    v[FLIGHT_FORCE * LANES + column] = b.amplitude[j] * record[i]
    v[FLIGHT_SLOPE * LANES + column] = b.amplitude[j] * (record[i + 1] - record[i]) * per_dt
    v[FLIGHT_OFFSET * LANES + column] = tables[o, here, REGION_OFFSET]
    v[FLIGHT_OTHER_OFFSET * LANES + column] = tables[o, there, REGION_OFFSET]
    v[FLIGHT_STIFFNESS * LANES + column] = tables[o, here, REGION_STIFFNESS]
    v[FLIGHT_HIGHEST * LANES + column] = min(
        x[PEAK],
        tables[o, here, REGION_UPPER] - tables[o, here, REGION_LOWER],
        tables[o, there, REGION_UPPER] - tables[o, there, REGION_LOWER],
    )
    e = parameters[o, PAR_RESTITUTION]
    thresholds = parameters[o, PAR_UPLIFT_RIGHT] + parameters[o, PAR_UPLIFT_LEFT]
    v[FLIGHT_RESTITUTION * LANES + column] = e
    v[FLIGHT_SETTLING * LANES + column] = 0.25 * (1.0 - e) * thresholds  # (see `_settles`: more is never enough)
    v[FLIGHT_LEAST * LANES + column] = 0.25 / MANY_HOPS * thresholds * dt  # (or so many flights fill a sample)
    v[FLIGHT_STRIKE * LANES + column] = x[STRIKE]
    v[FLIGHT_IMPACTS * LANES + column] = 0.0
    f.owner[column] = j


@njit(**_EVENT)
def _bounce(b, f, n, model, record, dt, end, poly, trig, turning_points):
    """Follow n bouncing blocks, all at once, to sample `end` or until they rest or rise: how many events were solved.

    What is out of the ordinary is left to `_sample`, one by one.  NEED says who takes a lane again: it WAITS.
    """
    v = f.columns
    tables, links, parameters, _ = model
    per_dt = 1.0 / dt
    solved = 0
    live = 0
    for j in range(n):
        if b.until[j] < end:
            _load_flight(b, f, live, j, tables, links, parameters, record, dt, per_dt)
            live += 1
    while live > 0:
        padded = (live + 7) // 8 * 8  # (see `_pad`)
        for column in range(live, padded):
            for row in range(FLIGHT_ROWS):
                v[row * LANES + column] = 0.0
            v[FLIGHT_OMEGA * LANES + column] = 1.0
            v[FLIGHT_OFFSET * LANES + column] = -1.0
        _solve_flights(v, padded, dt)
        column = 0
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
            if what == LANDS_LOW:
                stiffness = v[FLIGHT_STIFFNESS * LANES + column]
                highest = v[FLIGHT_HIGHEST * LANES + column]
                settles = _settles(parameters, o, omega, stiffness, force + slope * t, slope, dt - t, highest)
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
                k[NOW] = REST
            elif impacts % 2 == 1:
                k[NOW] = _bounces_to(tables, links, o, k[NOW])
            if what != FLIES_ON:
                _sample(x, k, tables, links, parameters, o, force, slope, t, dt, i * dt, poly, trig, turning_points)
                solved += 1
            i += 1
            b.until[j] = i
            f.time[j] = 0.0
            low = _lands_soon(x, k, tables, links, parameters, o, b.amplitude[j] * record[i], dt)
            k[NEED] = CROSSES if low else WAITS
            if low and i < end:
                _load_flight(b, f, column, j, tables, links, parameters, record, dt, per_dt)
                column += 1
                continue
            live -= 1
            for row in range(FLIGHT_ROWS):
                v[row * LANES + column] = v[row * LANES + live]
            f.owner[column] = f.owner[live]
    return solved


@njit(**_EVENT)
def _saddle_passed(x, k, tables, links, parameters, o):
    """Whether the unforced block is beyond the saddle of its region, or sure to pass it.

    Along the saddle's stable direction a damped branch decays with c/2 + sqrt(c²/4 + |K|), so
    omega + rate (|x| - saddle) > 0 never comes back; on the exact branch omega + 2 p sin((|x| - alpha)/2) > 0.
    """
    region = k[NOW]
    stiffness = tables[o, region, REGION_STIFFNESS]
    if stiffness >= 0.0:
        return False
    saddle = tables[o, region, REGION_OFFSET] / stiffness
    side = 1.0 if saddle > 0.0 else -1.0
    beyond = side * (x[THETA] - saddle)
    if parameters[o, PAR_EXACT] != 0.0:
        return side * x[OMEGA] + 2.0 * math.sqrt(-stiffness) * math.sin(0.5 * beyond) > 0.0
    half = 0.5 * tables[o, region, REGION_DAMPING]
    if links[o, region, LINK_HELD]:
        half = 0.5 * x[HELD]
    return side * x[OMEGA] + (half + math.sqrt(half * half - stiffness)) * beyond > 0.0


@njit(**_EVENT)
def _find_barrier(tables, parameters, o, barriers):
    """sqrt(2 (U_saddle - U_lowest)) of the lower saddle, U_lowest, and the largest lever of the shaking, into a row.

    U_lowest between the saddles; in exact geometry the lever of the shaking is largest, 1/cos(alpha), at the saddle.
    """
    lowest = math.inf
    saddle_potential = math.inf
    exact = parameters[o, PAR_EXACT] != 0.0
    lever = 1.0
    for r in range(tables.shape[1]):
        lower = tables[o, r, REGION_LOWER]
        upper = tables[o, r, REGION_UPPER]
        stiffness = tables[o, r, REGION_STIFFNESS]
        if not lower < upper:
            continue  # a row that only pads the table
        centre = tables[o, r, REGION_OFFSET] / stiffness
        if stiffness > 0.0:
            lowest = min(lowest, _potential(tables, o, r, exact, min(max(centre, lower), upper)))
            continue
        if lower < centre < upper:
            saddle_potential = min(saddle_potential, _potential(tables, o, r, exact, centre))
            if exact:
                lever = max(lever, 1.0 / math.cos(centre))
        # the end of the branch that looks to the middle
        inner = lower if abs(lower) < abs(upper) else upper
        lowest = min(lowest, _potential(tables, o, r, exact, inner))
    barriers[o, 0] = math.sqrt(2.0 * max(saddle_potential - lowest, 0.0))
    barriers[o, 1] = lowest
    barriers[o, 2] = lever


@njit(**_EVENT)
def _is_safe(x, k, tables, parameters, o, push, barriers):
    """Whether the rest of the record cannot overturn the block: `push` is gain * integral of |u''| over what is left.

    With E the energy above the lowest potential, |omega| <= sqrt(2E), so dE/dt <= |omega| |force| lets sqrt(2E) grow by
    no more than push.  No law adds energy.
    """
    energy = 0.0
    if k[NOW] != REST:
        exact = parameters[o, PAR_EXACT] != 0.0
        energy = 0.5 * x[OMEGA] * x[OMEGA] + _potential(tables, o, k[NOW], exact, x[THETA]) - barriers[o, 1]
        stiffness = tables[o, k[NOW], REGION_STIFFNESS]
        if stiffness < 0.0 and abs(x[THETA]) >= abs(tables[o, k[NOW], REGION_OFFSET] / stiffness):
            return False  # beyond the saddle
    return math.sqrt(2.0 * max(energy, 0.0)) + push * barriers[o, 2] < (1.0 - 1e-9) * barriers[o, 0]


@njit(**_EVENT)
def _is_bound(x, k, tables, links, parameters, o):
    """Whether the unforced block's energy cannot take it past its peak so far on either side.

    No law adds energy, so it cannot pass a rotation whose potential is above the present energy.  At the peak that of
    the outermost region counts: it is the lower one where a rigid branch and a zone overlap.
    """
    if parameters[o, PAR_EXACT] != 0.0:
        return False
    energy = 0.5 * x[OMEGA] * x[OMEGA] + _potential(tables, o, k[NOW], False, x[THETA])
    peak = x[PEAK]
    if abs(x[THETA]) > peak:
        return False
    right = math.inf
    left = math.inf
    for r in range(tables.shape[1]):
        if tables[o, r, REGION_LOWER] <= peak <= tables[o, r, REGION_UPPER]:
            right = min(right, _potential(tables, o, r, False, peak))
        if tables[o, r, REGION_LOWER] <= -peak <= tables[o, r, REGION_UPPER]:
            left = min(left, _potential(tables, o, r, False, -peak))
    return energy * (1.0 + 1e-9) < min(left, right)


@njit(**_EVENT)
def _free(x, k, tables, links, parameters, o, time, poly, trig, turning_points):
    """After the record: on until overturned, at rest, or sure never to exceed the peak again.

    Free motion loses energy, so a turning point on each side bounds all that follow on it; inside a zone with a stable
    centre the energy itself does.  A block that turns on one side only (beside a wall) is bounded by a few turns there.
    """
    turns = k[TURNS]
    impacts = k[IMPACTS]
    strike = x[STRIKE]
    k[FREE] = 1
    passed = False
    sides = 0
    for _ in range(MAX_FREE_PIECES):
        if k[OVERTURNED] != 0 or k[NOW] == REST or sides == 3 or k[TURNS] - turns >= MAX_FREE_TURNS:
            break
        region = k[NOW]
        stiffness = tables[o, region, REGION_STIFFNESS]
        if not passed:
            passed = _saddle_passed(x, k, tables, links, parameters, o)
            if not passed and _is_bound(x, k, tables, links, parameters, o):
                break
        if stiffness > 0.0:
            centre = tables[o, region, REGION_OFFSET] / stiffness
            reach = math.sqrt((x[THETA] - centre) ** 2 + x[OMEGA] ** 2 / stiffness)
            inside = min(tables[o, region, REGION_UPPER] - centre, centre - tables[o, region, REGION_LOWER])
            if reach < inside and reach + abs(centre) <= x[PEAK]:
                break
        if x[OMEGA] == 0.0 and x[THETA] == tables[o, region, REGION_OFFSET] / stiffness:
            break
        before = k[TURNS]
        time += _piece(x, k, tables, links, parameters, o, 0.0, 0.0, FREE_STEP, time, poly, trig, turning_points)
        if passed and k[TURNS] != before:
            break  # rounding on the separatrix itself: the proof stands, the time is not known
        if k[TURNS] != before:
            sides |= 1 if x[THETA] > 0.0 else 2
    k[IMPACTS] = impacts  # those of the record only
    x[STRIKE] = strike
    if passed and k[OVERTURNED] == 0:
        k[OVERTURNED] = 1
        x[PEAK] = FLAT
        x[OVERTURN_TIME] = math.nan


@njit(**_DRIVER, inline="always")
def _propagator(stiffness, c, h):
    """The step's transition: impulse response, its slope, its first and second integrals, as series about the state.

    With y'' + c y' + K y = a + s t, y(h) = omega g1 + a g2 + s g3 and y'(h) = omega (1 + g0) + a g1 + s g2: increments,
    so that the coefficients' rounding does not add up to a drift of energy.  The impulse response is the sum of
    u_k h (t/h)^k; the terms after the sixteenth are below rounding for rate * h <= 1/2.  Returns g0, g1, g2, g3/h and
    g2/h.  Written out, or the loop that calls it would not be vectorised.
    """
    d = -c * h
    s = -stiffness * h * h
    u2 = d * 0.5
    u3 = (d * u2 + s * 0.5) * (1.0 / 3.0)
    u4 = (d * u3 + s * u2 * (1.0 / 3.0)) * (1.0 / 4.0)
    u5 = (d * u4 + s * u3 * (1.0 / 4.0)) * (1.0 / 5.0)
    u6 = (d * u5 + s * u4 * (1.0 / 5.0)) * (1.0 / 6.0)
    u7 = (d * u6 + s * u5 * (1.0 / 6.0)) * (1.0 / 7.0)
    u8 = (d * u7 + s * u6 * (1.0 / 7.0)) * (1.0 / 8.0)
    u9 = (d * u8 + s * u7 * (1.0 / 8.0)) * (1.0 / 9.0)
    u10 = (d * u9 + s * u8 * (1.0 / 9.0)) * (1.0 / 10.0)
    u11 = (d * u10 + s * u9 * (1.0 / 10.0)) * (1.0 / 11.0)
    u12 = (d * u11 + s * u10 * (1.0 / 11.0)) * (1.0 / 12.0)
    u13 = (d * u12 + s * u11 * (1.0 / 12.0)) * (1.0 / 13.0)
    u14 = (d * u13 + s * u12 * (1.0 / 13.0)) * (1.0 / 14.0)
    u15 = (d * u14 + s * u13 * (1.0 / 14.0)) * (1.0 / 15.0)
    u16 = (d * u15 + s * u14 * (1.0 / 15.0)) * (1.0 / 16.0)
    g0 = 16.0 * u16 + 15.0 * u15 + 14.0 * u14 + 13.0 * u13 + 12.0 * u12 + 11.0 * u11 + 10.0 * u10 + 9.0 * u9 + 8.0 * u8
    g0 += 7.0 * u7 + 6.0 * u6 + 5.0 * u5 + 4.0 * u4 + 3.0 * u3 + 2.0 * u2
    g1 = u16 + u15 + u14 + u13 + u12 + u11 + u10 + u9 + u8
    g1 += u7 + u6 + u5 + u4 + u3 + u2
    g2 = (
        u16 * (1.0 / 17.0)
        + u15 * (1.0 / 16.0)
        + u14 * (1.0 / 15.0)
        + u13 * (1.0 / 14.0)
        + u12 * (1.0 / 13.0)
        + u11 * (1.0 / 12.0)
        + u10 * (1.0 / 11.0)
        + u9 * (1.0 / 10.0)
        + u8 * (1.0 / 9.0)
    )
    g2 += (
        u7 * (1.0 / 8.0) + u6 * (1.0 / 7.0) + u5 * (1.0 / 6.0) + u4 * (1.0 / 5.0) + u3 * (1.0 / 4.0) + u2 * (1.0 / 3.0)
    )
    g3 = (
        u16 * (1.0 / 306.0)
        + u15 * (1.0 / 272.0)
        + u14 * (1.0 / 240.0)
        + u13 * (1.0 / 210.0)
        + u12 * (1.0 / 182.0)
        + u11 * (1.0 / 156.0)
        + u10 * (1.0 / 132.0)
        + u9 * (1.0 / 110.0)
        + u8 * (1.0 / 90.0)
    )
    g3 += (
        u7 * (1.0 / 72.0)
        + u6 * (1.0 / 56.0)
        + u5 * (1.0 / 42.0)
        + u4 * (1.0 / 30.0)
        + u3 * (1.0 / 20.0)
        + u2 * (1.0 / 12.0)
    )
    g2 += 0.5
    return g0, h * (1.0 + g1), h * h * g2, h * h * (1.0 / 6.0 + g3), h * g2


@njit(**_EVENT)
def _store(history, i, x, k, tables, links, o):
    """Write the state at sample i, where a history is asked for."""
    region = k[NOW]
    history[HISTORY_THETA, i] = x[THETA]
    history[HISTORY_OMEGA, i] = x[OMEGA]
    history[HISTORY_REGION, i] = region
    history[HISTORY_DAMPING, i] = 0.0
    history[HISTORY_PEAK, i] = max(x[PEAK], abs(x[THETA]))
    if region != REST:
        history[HISTORY_DAMPING, i] = x[HELD] if links[o, region, LINK_HELD] else tables[o, region, REGION_DAMPING]


@njit(**_EVENT)
def _store_fallen(history, i, x):
    """An overturned block lies still from sample i on."""
    for j in range(i, history.shape[1]):
        history[HISTORY_THETA, j] = math.copysign(FLAT, x[THETA])
        history[HISTORY_OMEGA, j] = 0.0
        history[HISTORY_REGION, j] = REST
        history[HISTORY_DAMPING, j] = 0.0
        history[HISTORY_PEAK, j] = FLAT


@njit(**_DRIVER, inline="always")
def _dip(rise, dt):
    """Largest product of the velocities at the ends of a sample within which the velocity passes zero twice.

    For an amplitude of 1; it grows with the square of the amplitude.  Such a velocity has its extremum at some t, where
    a(t) = 0, so with J = max|a'| it is at most J t²/2 at the start and J (dt - t)²/2 at the end: their product is
    (J dt²/8)² at most.  As a' = s - c a - K v, |a| <= J dt and |v| <= J dt²/2, J (1 - c dt - |K| dt²/2) <= |s|; the
    bracket is 1/2 at least for a rate of 1/(2 dt) at most.  So (s dt²/4)² is the bound; a third is on the safe side.
    """
    return (rise * dt * (1.0 / 3.0)) ** 2


@njit(**_DRIVER, inline="always")
def _step(theta, omega, push, up, stiffness, g0, g1, g2, g3, g2_rise, dip, upper, lower, calm_upper, calm_lower):
    """One sample of one lane, and whether it may hold an event that matters.

    Beyond an edge; or, outside the calm interval (see `_follow`), a velocity that turns, or may dip through zero and
    recover, for which `dip` (see `_dip`) must exceed the product of the velocities at both ends.
    """
    a = push - stiffness * theta
    theta_end = theta + (omega * g1 + a * g2 + up * g3)
    omega_end = omega + (omega * g0 + a * g1 + up * g2_rise)
    turns = omega * omega_end <= dip
    calm = (theta_end < calm_upper) & (theta_end > calm_lower)
    look = (theta_end >= upper) | (theta_end <= lower) | (turns & (not calm))
    return theta_end, omega_end, look


@njit(**_DRIVER, inline="always")
def _step_lanes(s, marks, n, force, rise, dip, now, after):
    """One sample of lanes from the state rows `now` to the rows `after`; the number of lanes that need a look.

    Rows lie at constant offsets in one flat array, and the trip count is known at run time only: so it vectorises.
    """
    count = 0
    for lane in range(n):
        amplitude = s[ROW_AMPLITUDE * LANES + lane]
        theta_end, omega_end, look = _step(
            s[now * LANES + lane],
            s[(now + 1) * LANES + lane],
            s[ROW_OFFSET * LANES + lane] + amplitude * force,
            amplitude * rise,
            s[ROW_STIFFNESS * LANES + lane],
            s[ROW_G0 * LANES + lane],
            s[ROW_G1 * LANES + lane],
            s[ROW_G2 * LANES + lane],
            s[ROW_G3 * LANES + lane],
            s[ROW_G2_RISE * LANES + lane],
            s[ROW_SQUARE * LANES + lane] * dip,
            s[ROW_UPPER * LANES + lane],
            s[ROW_LOWER * LANES + lane],
            s[ROW_CALM_UPPER * LANES + lane],
            s[ROW_CALM_LOWER * LANES + lane],
        )
        s[after * LANES + lane] = theta_end
        s[(after + 1) * LANES + lane] = omega_end
        marks[lane] = look
        if look:
            count += 1
    return count


@njit(**_LANES)
def _step_even(s, marks, n, force, rise, dip):
    """Compiled apart: inside a larger function the loop would not be vectorised."""
    return _step_lanes(s, marks, n, force, rise, dip, ROW_EVEN, ROW_ODD)


@njit(**_LANES)
def _step_odd(s, marks, n, force, rise, dip):
    return _step_lanes(s, marks, n, force, rise, dip, ROW_ODD, ROW_EVEN)


@njit(**_DRIVER, inline="always")
def _unit_series(omega, a, slope, stiffness, c, h):
    """Taylor coefficients 1 … 12 of the displacement in t/h: for rate * h <= 1/4 the next are below rounding.

    y_k = -(c h y_(k-1)/k + K h² y_(k-2)/(k (k-1))), with the forcing's slope in y_3.  Written out, or the loops over
    pieces that call it would not be vectorised.
    """
    d = -c * h
    s = -stiffness * h * h
    y1 = omega * h
    y2 = 0.5 * a * h * h
    y3 = (slope * h * h * h + 2.0 * d * y2 + s * y1) * (1.0 / 6.0)
    y4 = d * y3 * (1.0 / 4.0) + s * y2 * (1.0 / 12.0)
    y5 = d * y4 * (1.0 / 5.0) + s * y3 * (1.0 / 20.0)
    y6 = d * y5 * (1.0 / 6.0) + s * y4 * (1.0 / 30.0)
    y7 = d * y6 * (1.0 / 7.0) + s * y5 * (1.0 / 42.0)
    y8 = d * y7 * (1.0 / 8.0) + s * y6 * (1.0 / 56.0)
    y9 = d * y8 * (1.0 / 9.0) + s * y7 * (1.0 / 72.0)
    y10 = d * y9 * (1.0 / 10.0) + s * y8 * (1.0 / 90.0)
    y11 = d * y10 * (1.0 / 11.0) + s * y9 * (1.0 / 110.0)
    y12 = d * y11 * (1.0 / 12.0) + s * y10 * (1.0 / 132.0)
    return y1, y2, y3, y4, y5, y6, y7, y8, y9, y10, y11, y12


@njit(**_DRIVER, inline="always")
def _unit_value(y, t):
    """Displacement at t (in units of the step) of a unit series."""
    s = y[9] + t * (y[10] + t * y[11])
    s = y[4] + t * (y[5] + t * (y[6] + t * (y[7] + t * (y[8] + t * s))))
    return t * (y[0] + t * (y[1] + t * (y[2] + t * (y[3] + t * s))))


@njit(**_DRIVER, inline="always")
def _unit_speed(y, t):
    """Velocity at t of a unit series."""
    s = 10.0 * y[9] + t * (11.0 * y[10] + t * (12.0 * y[11]))
    s = 5.0 * y[4] + t * (6.0 * y[5] + t * (7.0 * y[6] + t * (8.0 * y[7] + t * (9.0 * y[8] + t * s))))
    return y[0] + t * (2.0 * y[1] + t * (3.0 * y[2] + t * (4.0 * y[3] + t * s)))


@njit(**_DRIVER, inline="always")
def _unit_acceleration(y, t):
    """Acceleration at t of a unit series."""
    s = 90.0 * y[9] + t * (110.0 * y[10] + t * (132.0 * y[11]))
    s = 20.0 * y[4] + t * (30.0 * y[5] + t * (42.0 * y[6] + t * (56.0 * y[7] + t * (72.0 * y[8] + t * s))))
    return 2.0 * y[1] + t * (6.0 * y[2] + t * (12.0 * y[3] + t * s))


@njit(**_DRIVER, inline="always")
def _unit_jerk(y, t):
    """Third derivative at t of a unit series, to the accuracy that a correction of second order needs."""
    return 6.0 * y[2] + t * (24.0 * y[3] + t * (60.0 * y[4] + t * (120.0 * y[5] + t * (210.0 * y[6]))))


@njit(**_LANES)
def _solve_crossings(v, n):
    """When each of n pieces (columns of v) covers its gap, straight or after one turn, and its velocity there.

    The parabola's root, a cubic correction, and two of Chebyshev's third-order steps; SURE where they converged.
    """
    for j in range(n):
        omega = v[PIECE_OMEGA * LANES + j]
        a = v[PIECE_A * LANES + j]
        h = v[PIECE_SPAN * LANES + j]
        gap = v[PIECE_GAP * LANES + j]
        y = _unit_series(
            omega,
            a,
            v[PIECE_SLOPE * LANES + j],
            v[PIECE_STIFFNESS * LANES + j],
            v[PIECE_DAMPING * LANES + j],
            h,
        )
        root = math.sqrt(max(y[0] * y[0] + 4.0 * y[1] * gap, 0.0))
        if y[0] * gap > 0.0:
            t = 2.0 * gap / (y[0] + math.copysign(root, gap))
        else:
            t = -0.5 * (y[0] + math.copysign(root, y[0])) / y[1]
        t -= y[2] * t * t * t / (y[0] + 2.0 * y[1] * t)
        step = (gap - _unit_value(y, t)) / _unit_speed(y, t)
        t += step * (1.0 - 0.5 * _unit_acceleration(y, t) / _unit_speed(y, t) * step)
        speed = _unit_speed(y, t)
        acceleration = _unit_acceleration(y, t)
        step = (gap - _unit_value(y, t)) / speed
        bend = 0.5 * acceleration / speed * step
        t += step * (1.0 - bend)
        v[PIECE_TIME * LANES + j] = t * h
        v[PIECE_SPEED * LANES + j] = (speed + acceleration * step) / h
        sure = (abs(step) <= 1e-6 * t) & (abs(bend) <= 1e-6) & (t > 0.0) & (t <= 1.0)
        v[PIECE_SURE * LANES + j] = 1.0 if sure else 0.0


@njit(**_EVENT)
def _solve_turns(v, n):
    """The displacement at the turn of each of n pieces that turn once, or 0 where the velocity only dips."""
    for j in range(n):
        y = _unit_series(
            v[PIECE_OMEGA * TURN_COLUMNS + j],
            v[PIECE_A * TURN_COLUMNS + j],
            v[PIECE_SLOPE * TURN_COLUMNS + j],
            v[PIECE_STIFFNESS * TURN_COLUMNS + j],
            v[PIECE_DAMPING * TURN_COLUMNS + j],
            v[PIECE_SPAN * TURN_COLUMNS + j],
        )
        end = _unit_speed(y, 1.0)
        # first guess: the parabola of the velocity through both ends, which has its zero between them
        curve = end - y[0] - 2.0 * y[1]
        root = math.sqrt(max(y[1] * y[1] - curve * y[0], 0.0))
        t = y[0] / (math.copysign(root, y[0]) - y[1])
        step = 0.0
        bend = 0.0
        for _ in range(2):
            acceleration = _unit_acceleration(y, t)
            step = -_unit_speed(y, t) / acceleration
            bend = 0.5 * _unit_jerk(y, t) / acceleration * step
            t += step * (1.0 - bend)
        turns = (y[0] * end < 0.0) & (abs(step) <= 1e-5) & (abs(bend) <= 1e-4) & (t > 0.0) & (t < 1.0)
        # a dip that does not reach zero: the velocity at its extremum keeps its sign
        dip = y[1] / (y[1] - 0.5 * _unit_acceleration(y, 1.0))
        for _ in range(2):
            dip -= _unit_acceleration(y, dip) / _unit_jerk(y, dip)
        passes = (y[0] * end > 0.0) & (dip > 0.0) & (dip < 1.0) & (abs(_unit_acceleration(y, dip)) <= 1e-6 * abs(y[1]))
        passes = passes & (_unit_speed(y, dip) * y[0] > 1e-6 * y[0] * y[0])
        # from rest: the acceleration has no zero but where it may begin
        starts = (y[0] == 0.0) & ((y[1] == 0.0) | (y[1] * _unit_acceleration(y, 1.0) > 0.0))
        v[PIECE_MOVED * TURN_COLUMNS + j] = _unit_value(y, t) if turns else 0.0
        v[PIECE_SURE * TURN_COLUMNS + j] = 1.0 if turns | passes | starts else 0.0


@njit(**_LANES)
def _finish_pieces(v, n):
    """What each of n pieces has moved at its end, and its velocity; SURE where it proves to hold no event."""
    for j in range(n):
        omega = v[PIECE_OMEGA * LANES + j]
        a = v[PIECE_A * LANES + j]
        slope = v[PIECE_SLOPE * LANES + j]
        h = v[PIECE_SPAN * LANES + j]
        gap = v[PIECE_GAP * LANES + j]
        y = _unit_series(omega, a, slope, v[PIECE_STIFFNESS * LANES + j], v[PIECE_DAMPING * LANES + j], h)
        moved = _unit_value(y, 1.0)
        speed = _unit_speed(y, 1.0)
        dips = (omega * a < 0.0) & (omega * _unit_acceleration(y, 1.0) > 0.0)
        v[PIECE_MOVED * LANES + j] = moved
        v[PIECE_SPEED * LANES + j] = speed / h
        sure = (speed * gap > 0.0) & (abs(moved) < abs(gap)) & (moved * gap > 0.0) & (not dips)
        v[PIECE_SURE * LANES + j] = 1.0 if sure else 0.0


@njit(**_LANES)
def _solve_propagators(v, n, dt):
    """The propagator of each of n columns, from its stiffness and damping."""
    for j in range(n):
        g0, g1, g2, g3, g2_rise = _propagator(v[PIECE_STIFFNESS * LANES + j], v[PIECE_DAMPING * LANES + j], dt)
        v[(PIECE_GAP + STEP_G0) * LANES + j] = g0
        v[(PIECE_GAP + STEP_G1) * LANES + j] = g1
        v[(PIECE_GAP + STEP_G2) * LANES + j] = g2
        v[(PIECE_GAP + STEP_G3) * LANES + j] = g3
        v[(PIECE_GAP + STEP_G2_RISE) * LANES + j] = g2_rise


@njit(**_LANES)
def _two_sum(a, b):
    """Sum of two numbers and its rounding error (Knuth)."""
    s = a + b
    of_b = s - a
    return s, (a - (s - of_b)) + (b - of_b)


@njit(**_LANES)
def _two_product(a, b):
    """Product of two numbers and its rounding error (Dekker)."""
    p = a * b
    high = SPLITTER * a
    high_a = high - (high - a)
    high = SPLITTER * b
    high_b = high - (high - b)
    low_a = a - high_a
    low_b = b - high_b
    return p, ((high_a * high_b - p) + high_a * low_b + low_a * high_b) + low_a * low_b


@njit(**_LANES)
def _without_drift(stiffness, g0, g1, g2):
    """An undamped step's coefficients, or neighbours of theirs, for which it hardly changes areas of the phase plane.

    Its determinant is 1 + r, r = g0 - K g2 + K g1² - K g2 g0.  Rounded once for all samples, three coefficients leave
    an r of a part of an ulp, by which the energy grows or fades in every sample; of each and its two neighbours those
    are taken that leave the least.
    """
    p1, e1 = _two_product(stiffness, g2)
    square, e_square = _two_product(g1, g1)
    p2, e2 = _two_product(stiffness, square)
    p3, e3 = _two_product(p1, g0)
    s1, t1 = _two_sum(g0, -p1)
    s2, t2 = _two_sum(p2, -p3)
    s, t = _two_sum(s1, s2)
    r = s + (t + t1 + t2 - e1 + e2 + stiffness * e_square - e3 - e1 * g0)
    of_g0 = (np.nextafter(g0, math.inf) - g0) * (1.0 - p1)
    of_g1 = (np.nextafter(g1, math.inf) - g1) * 2.0 * stiffness * g1
    of_g2 = (np.nextafter(g2, math.inf) - g2) * -stiffness * (1.0 + g0)
    least = abs(r)
    best_0 = best_1 = best_2 = 0
    for i in range(-1, 2):
        for j in range(-1, 2):
            for k in range(-1, 2):
                left = abs(r + i * of_g0 + j * of_g1 + k * of_g2)
                if left < least:
                    least = left
                    best_0 = i
                    best_1 = j
                    best_2 = k
    return (
        np.nextafter(g0, best_0 * math.inf) if best_0 != 0 else g0,
        np.nextafter(g1, best_1 * math.inf) if best_1 != 0 else g1,
        np.nextafter(g2, best_2 * math.inf) if best_2 != 0 else g2,
    )


@njit(**_EVENT)
def _grade(rate):
    """For what a sample may be taken, by rate * dt."""
    if rate <= GRADES[1]:
        return ONE_PIECE
    return ONE_STEP if rate <= GRADES[0] else MANY_STEPS


@njit(**_LANES)
def _fill_step(step, region, c, dt):
    """A region's propagator with damping c, and what goes with it, into the row `step`."""
    stiffness = region[REGION_STIFFNESS]
    offset = region[REGION_OFFSET]
    grade = _grade(dt * _rate(stiffness, c))
    step[STEP_DAMPING] = c
    step[STEP_GRADE] = grade
    step[STEP_PULL] = max(
        abs(offset - stiffness * region[REGION_UPPER]), abs(offset - stiffness * region[REGION_LOWER])
    )
    if grade != MANY_STEPS:
        g0, g1, g2, g3, g2_rise = _propagator(stiffness, c, dt)
        if c == 0.0:
            g0, g1, g2 = _without_drift(stiffness, g0, g1, g2)
        step[STEP_G0] = g0
        step[STEP_G1] = g1
        step[STEP_G2] = g2
        step[STEP_G3] = g3
        step[STEP_G2_RISE] = g2_rise


@njit(**_LANES)
def _set_calm(s, lane, x):
    """The interval in which turns do not matter, as far as the peak has grown."""
    s[ROW_CALM_UPPER * LANES + lane] = min(x[PEAK], s[ROW_UPPER * LANES + lane]) - x[CALM_MARGIN]
    s[ROW_CALM_LOWER * LANES + lane] = max(-x[PEAK], s[ROW_LOWER * LANES + lane]) + x[CALM_MARGIN]


@njit(**_LANES)
def _reach(omega, a_start, a_end, dt):
    """How far a step can take a block: |a| <= 1.2 max(|a_start|, |a_end|), for it solves a'' + c a' + K a = 0."""
    return (abs(omega) + 1.2 * dt * max(abs(a_start), abs(a_end))) * dt


@njit(**_LANES)
def _need(theta, omega, theta_end, omega_end, push, up, stiffness, c, dt, upper, lower, grade, bound):
    """What a marked sample of a moving lane needs: nothing (WAITS), one root, or all (HARD).

    CROSSES: it goes straight to an edge.  RETURNS: it turns, and meets the edge behind it.  TURNS_BACK: it turns.

    The bounds hold for sqrt|K| dt, c dt <= 1/2; towards its zero |a| falls, which bounds how far the velocity dips.
    `bound`: turns at smaller rotations do not matter (-1: all do, and need a region of their own or a place in a list).
    """
    a_start = push - stiffness * theta - c * omega
    a_end = push + up - stiffness * theta_end - c * omega_end
    if theta_end >= upper or theta_end <= lower:
        if grade != ONE_PIECE or (a_start * omega < 0.0 and a_end * omega > 0.0):
            return HARD
        ahead = upper - theta if omega > 0.0 else lower - theta
        if omega * omega_end > 0.0:
            return CROSSES if ahead * omega > 0.0 else HARD
        # it turns first and then meets the edge behind it
        reach = _reach(omega, a_start, a_end, dt)
        behind = lower - theta if omega > 0.0 else upper - theta
        one_way = omega * omega_end < 0.0 and behind * omega < 0.0 and reach < abs(ahead)
        return RETURNS if one_way and bound >= 0.0 else HARD
    if omega * omega_end > 0.0 and (
        a_start * omega >= 0.0
        or a_end * omega <= 0.0
        or abs(omega) > 1.2 * dt * abs(a_start)
        or abs(omega_end) > 1.2 * dt * abs(a_end)
    ):
        return WAITS
    if bound < 0.0:
        return HARD
    reach = _reach(omega, a_start, a_end, dt)
    # a single turn can pass the edge ahead only; a dip may hide two
    dips = omega * omega_end >= 0.0
    if (theta + reach >= upper and (dips or omega > 0.0)) or (theta - reach <= lower and (dips or omega < 0.0)):
        return HARD
    return WAITS if abs(theta) + reach <= bound else TURNS_BACK


@njit(**_LANES)
def _add_turn(v, turn_lane, column, lane, theta, omega, theta_end, push, up, stiffness, c, dt):
    """A turn inside a region, to be solved with others, in a sample from theta to theta_end."""
    turn_lane[column] = lane
    v[PIECE_OMEGA * TURN_COLUMNS + column] = omega
    v[PIECE_A * TURN_COLUMNS + column] = push - stiffness * theta - c * omega
    v[PIECE_SLOPE * TURN_COLUMNS + column] = up / dt
    v[PIECE_STIFFNESS * TURN_COLUMNS + column] = stiffness
    v[PIECE_DAMPING * TURN_COLUMNS + column] = c
    v[PIECE_SPAN * TURN_COLUMNS + column] = dt
    v[PIECE_GAP * TURN_COLUMNS + column] = theta
    v[PIECE_TIME * TURN_COLUMNS + column] = theta_end


@njit(**_LANES)
def _pad(v, columns, n):
    """Harmless pieces up to a whole number of vectors, so that a piece's bits do not depend on its neighbours."""
    padded = (n + 7) // 8 * 8
    for j in range(n, padded):
        v[PIECE_OMEGA * columns + j] = 1.0
        v[PIECE_A * columns + j] = -2.0
        v[PIECE_SLOPE * columns + j] = 0.0
        v[PIECE_STIFFNESS * columns + j] = 0.0
        v[PIECE_DAMPING * columns + j] = 0.0
        v[PIECE_SPAN * columns + j] = 1.0
        v[PIECE_GAP * columns + j] = 0.1
    return padded


@njit(**_EVENT)
def _flush_turns(w, n, poly):
    """Solve the turns that have gathered: each may raise its lane's peak."""
    v = w.turns
    _solve_turns(v, _pad(v, TURN_COLUMNS, n))
    for j in range(n):
        lane = w.turn_lane[j]
        theta = v[PIECE_GAP * TURN_COLUMNS + j]
        # a turn next to a sample must not come out lower than the sample, by rounding
        w.x[lane, PEAK] = max(w.x[lane, PEAK], abs(theta), abs(v[PIECE_TIME * TURN_COLUMNS + j]))
        if v[PIECE_SURE * TURN_COLUMNS + j] == 1.0:
            w.x[lane, PEAK] = max(w.x[lane, PEAK], abs(theta + v[PIECE_MOVED * TURN_COLUMNS + j]))
            _set_calm(w.rows, lane, w.x[lane])  # (a parked lane's rows are written anew in any case)
            continue
        # a dip of the velocity, or too flat for the batch's steps: each turn by the general way
        stiffness = v[PIECE_STIFFNESS * TURN_COLUMNS + j]
        c = v[PIECE_DAMPING * TURN_COLUMNS + j]
        omega = v[PIECE_OMEGA * TURN_COLUMNS + j]
        a = v[PIECE_A * TURN_COLUMNS + j]
        slope = v[PIECE_SLOPE * TURN_COLUMNS + j]
        left = v[PIECE_SPAN * TURN_COLUMNS + j]
        kind = TURN
        while kind == TURN and left > 0.0:
            degree = _degree(_rate(stiffness, c) * left)
            _linear_series(poly, a, omega, c, stiffness, slope, degree)
            kind, t, moved, _ = _first_event(poly, degree, left, 0.0, -math.inf, math.inf, -1.0)
            theta += moved
            a = _eval(poly, ACCELERATION, degree, t)
            omega = 0.0
            left -= t
            if kind == TURN:
                w.x[lane, PEAK] = max(w.x[lane, PEAK], abs(theta))


@njit(**_DRIVER)
def _highs(record):
    """The largest |record| of each SPAN samples."""
    highs = np.zeros(record.shape[0] // SPAN + 1)
    for j in range(record.shape[0]):
        highs[j // SPAN] = max(highs[j // SPAN], abs(record[j]))
    return highs


@njit(**_EVENT)
def _until_uplift(record, highs, amplitude, upper, lower, i):
    """The sample, from i on, in which forcing leaves the threshold behind: the last one if none does.

    By `highs` (see `_highs`) most samples are passed over.
    """
    force = amplitude * record[i]
    if force >= upper or force <= lower:  # (a record may begin there)
        return i
    enough = min(upper, -lower)
    j = i + 1
    while j < record.shape[0]:
        if j % SPAN == 0 and abs(amplitude) * highs[j // SPAN] < enough:
            j += SPAN
            continue
        force = amplitude * record[j]
        if force >= upper or force <= lower:
            return j - 1
        j += 1
    return record.shape[0] - 1


@njit(**_DRIVER, inline="always")
def _follow(w, lane, model, record, highs, strongest, dt, i, end, now, waiting, recording):
    """Take one lane from sample i to sample `end` alone, or to its next event: the sample reached, turns waiting.

    One that is at rest for longer than that is noted in w.leaving (its last entry counts them).
    """
    s = w.rows
    x = w.x[lane]
    k = w.k[lane]
    o = w.oscillator[lane]
    amplitude = w.amplitude[lane]
    links = model.links
    region = k[NOW]
    if region == REST:
        k[NEED] = HARD
        x[THETA] = 0.0
        x[OMEGA] = 0.0
        upper = model.parameters[o, PAR_UPLIFT_RIGHT]
        lower = -model.parameters[o, PAR_UPLIFT_LEFT]
        i = _until_uplift(record, highs, amplitude, upper, lower, i)
        if i >= end:
            w.until[lane] = i
            w.leaving[w.leaving[LANES]] = lane
            w.leaving[LANES] += 1
            i = end
        return i, waiting
    row = model.tables[o, region]
    step = model.steps[o, region]
    if links[o, region, LINK_HELD]:
        step = w.own[lane]
        if x[HELD] != step[STEP_DAMPING]:
            _fill_step(step, row, x[HELD], dt)
    grade = int(step[STEP_GRADE])
    k[GRADE] = grade
    if grade == MANY_STEPS:
        k[NEED] = HARD
        s[ROW_UPPER * LANES + lane] = -math.inf  # every sample needs a look
        s[now * LANES + lane] = x[THETA]
        s[(now + 1) * LANES + lane] = x[OMEGA]
        return i, waiting
    offset = row[REGION_OFFSET]
    stiffness = row[REGION_STIFFNESS]
    upper = row[REGION_UPPER]
    lower = row[REGION_LOWER]
    c = step[STEP_DAMPING]
    g0 = step[STEP_G0]
    g1 = step[STEP_G1]
    g2 = step[STEP_G2]
    g3 = step[STEP_G3]
    g2_rise = step[STEP_G2_RISE]
    x[DAMPING] = c
    # The calm interval: a turn there is below the peak and far from the edges, so nothing comes of it.  In a sample in
    # which the velocity vanishes the acceleration is at most twice A = shaking + max|f(theta)|, as c dt <= 1/2, and the
    # rotation stays within 2 A dt² of its end; half as much again is kept for what f grows beyond the edges.
    listed = recording or _captures(links, o, region)
    k[LISTED] = 1 if listed else 0
    x[CALM_MARGIN] = 3.0 * dt * dt * (abs(amplitude) * strongest + step[STEP_PULL])
    calm_upper = -math.inf if listed else min(x[PEAK], upper) - x[CALM_MARGIN]
    calm_lower = math.inf if listed else max(-x[PEAK], lower) + x[CALM_MARGIN]
    theta = x[THETA]
    omega = x[OMEGA]
    square = amplitude * amplitude
    while i < end:
        force = record[i]
        rise = record[i + 1] - force
        push = offset + amplitude * force
        up = amplitude * rise
        dip = square * _dip(rise, dt)
        theta_end, omega_end, look = _step(
            theta, omega, push, up, stiffness, g0, g1, g2, g3, g2_rise, dip, upper, lower, calm_upper, calm_lower
        )
        if look:
            bound = -1.0 if listed else x[PEAK]
            need = _need(theta, omega, theta_end, omega_end, push, up, stiffness, c, dt, upper, lower, grade, bound)
            if need in (TURNS_BACK, RETURNS):
                if waiting == LANES * TILE:
                    # no room for another turn (a block that has bounced may have far to go): on when they are solved
                    x[THETA] = theta
                    x[OMEGA] = omega
                    k[NEED] = WAITS
                    return i - 1, waiting
                last = theta_end if need == TURNS_BACK else theta
                _add_turn(w.turns, w.turn_lane, waiting, lane, theta, omega, last, push, up, stiffness, c, dt)
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
    s[ROW_G0 * LANES + lane] = g0
    s[ROW_G1 * LANES + lane] = g1
    s[ROW_G2 * LANES + lane] = g2
    s[ROW_G3 * LANES + lane] = g3
    s[ROW_G2_RISE * LANES + lane] = g2_rise
    s[ROW_UPPER * LANES + lane] = upper
    s[ROW_LOWER * LANES + lane] = lower
    s[ROW_CALM_UPPER * LANES + lane] = calm_upper
    s[ROW_CALM_LOWER * LANES + lane] = calm_lower
    return end, waiting


@njit(**_LANES)
def _freeze_lane(s, lane):
    """No more looks at a lane until it is loaded again; it drifts on meanwhile, for less than a tile."""
    s[ROW_UPPER * LANES + lane] = math.inf
    s[ROW_LOWER * LANES + lane] = -math.inf
    s[ROW_CALM_UPPER * LANES + lane] = math.inf
    s[ROW_CALM_LOWER * LANES + lane] = -math.inf


@njit(**_LANES)
def _advance(w, first, n, record, dt, i, end, now, waiting, parked):
    """A block of n lanes from sample i to `end` in lockstep: turns waiting, lanes parked, with those before.

    Turns are noted down and lanes with other events taken out, for `_resolve`.
    """
    s = w.rows
    block = s[first:]
    marks = w.marks[first:]
    padded = (n + 7) // 8 * 8
    while i < end:
        force = record[i]
        rise = record[i + 1] - force
        dip = _dip(rise, dt)
        if now == ROW_EVEN:
            after = ROW_ODD
            marked = _step_even(block, marks, padded, force, rise, dip)
        else:
            after = ROW_EVEN
            marked = _step_odd(block, marks, padded, force, rise, dip)
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
                theta = s[now * LANES + lane]
                omega = s[(now + 1) * LANES + lane]
                if k[GRADE] == MANY_STEPS:
                    k[NEED] = HARD
                else:
                    push = s[ROW_OFFSET * LANES + lane] + w.amplitude[lane] * force
                    up = w.amplitude[lane] * rise
                    stiffness = s[ROW_STIFFNESS * LANES + lane]
                    c = x[DAMPING]
                    theta_end = s[after * LANES + lane]
                    omega_end = s[(after + 1) * LANES + lane]
                    upper = s[ROW_UPPER * LANES + lane]
                    lower = s[ROW_LOWER * LANES + lane]
                    bound = -1.0 if k[LISTED] != 0 else x[PEAK]
                    need = _need(
                        theta, omega, theta_end, omega_end, push, up, stiffness, c, dt, upper, lower, k[GRADE], bound
                    )
                    if need in (TURNS_BACK, RETURNS):
                        last = theta_end if need == TURNS_BACK else theta
                        _add_turn(w.turns, w.turn_lane, waiting, lane, theta, omega, last, push, up, stiffness, c, dt)
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
                _freeze_lane(s, lane)
        now = after
        i += 1
    return waiting, parked


@njit(**_LANES)
def _resolve(
    w, b, f, bouncing, model, record, highs, strongest, dt, end, now, waiting, parked, poly, trig, turning_points
):
    """Solve the events of the parked lanes, bring each to `end`: whether any overturned, events solved, who bounces.

    In rounds: the turns that wait, then one event a lane (the crossings all at once, then what follows them to the end
    of the sample all at once, and what is out of the ordinary by `_sample`), then on to the next event.
    """
    pieces = w.pieces
    zones = w.zones
    tables, links, parameters, steps = model
    fallen = False
    solved = 0
    per_dt = 1.0 / dt
    recording = turning_points.shape[1] > 0
    while parked > 0 or waiting > 0:
        solved += parked + waiting
        if waiting > 0:
            _flush_turns(w, waiting, poly)
            waiting = 0
        n = 0
        for j in range(parked):
            lane = w.parked[j]
            k = w.k[lane]
            x = w.x[lane]
            if k[NEED] == RETURNS:
                k[NEED] = CROSSES  # (its turn is in the peak by now)
            if k[NOW] == REST or k[NEED] != CROSSES:
                continue
            i = w.parked_at[j]
            amplitude = w.amplitude[lane]
            row = tables[w.oscillator[lane], k[NOW]]
            stiffness = row[REGION_STIFFNESS]
            c = x[DAMPING]
            theta = x[THETA]
            omega = x[OMEGA]
            force = amplitude * record[i]
            pieces[PIECE_OMEGA * LANES + n] = omega
            pieces[PIECE_A * LANES + n] = force + row[REGION_OFFSET] - stiffness * theta - c * omega
            pieces[PIECE_SLOPE * LANES + n] = amplitude * (record[i + 1] - record[i]) * per_dt
            pieces[PIECE_STIFFNESS * LANES + n] = stiffness
            pieces[PIECE_DAMPING * LANES + n] = c
            pieces[PIECE_SPAN * LANES + n] = dt
            pieces[PIECE_GAP * LANES + n] = row[REGION_LOWER + k[UPWARD]] - theta
            n += 1
        if n > 0:
            _solve_crossings(pieces, _pad(pieces, LANES, n))
        read = 0
        n = 0
        entries = 0
        for j in range(parked):
            lane = w.parked[j]
            x = w.x[lane]
            k = w.k[lane]
            o = w.oscillator[lane]
            i = w.parked_at[j]
            amplitude = w.amplitude[lane]
            force = amplitude * record[i]
            slope = amplitude * (record[i + 1] - record[i]) * per_dt
            region = k[NOW]
            need = HARD
            t = 0.0
            if k[NEED] == WAITS:  # (it has bounced to the end of its sample)
                need = WAITS
            elif region == REST:
                t, force = _uplift(parameters, o, x, k, force, slope, dt)
                need = WAITS if k[NOW] == REST else CROSSES
            elif k[NEED] == CROSSES:
                if pieces[PIECE_SURE * LANES + read] == 1.0:
                    t = min(pieces[PIECE_TIME * LANES + read], dt)
                    speed = pieces[PIECE_SPEED * LANES + read]
                    upper = k[UPWARD] != 0
                    x[THETA] = tables[o, region, REGION_LOWER + k[UPWARD]]
                    x[OMEGA] = max(speed, 0.0) if upper else min(speed, 0.0)
                    force += slope * t
                    _at_edge(x, k, tables, links, parameters, o, region, upper, force, slope, dt - t, i * dt + t)
                    need = HARD if k[NOW] == REST else CROSSES
                read += 1
            if k[OVERTURNED] != 0:
                need = WAITS
                fallen = True
            if need == CROSSES:
                # what is left of the sample, in the region entered
                region = k[NOW]
                row = tables[o, region]
                stiffness = row[REGION_STIFFNESS]
                offset = row[REGION_OFFSET]
                c = steps[o, region, STEP_DAMPING]
                grade = steps[o, region, STEP_GRADE]
                if links[o, region, LINK_HELD]:
                    c = x[HELD]
                    grade = w.own[lane, STEP_GRADE]
                    if c != w.own[lane, STEP_DAMPING]:
                        grade = _grade(dt * _rate(stiffness, c))
                        if grade == ONE_PIECE and c > 0.0:  # (see `_without_drift`)
                            zones[PIECE_STIFFNESS * LANES + entries] = stiffness
                            zones[PIECE_DAMPING * LANES + entries] = c
                            w.zone_lane[entries] = lane
                            entries += 1
                theta = x[THETA]
                omega = x[OMEGA]
                a = force + offset - stiffness * theta
                if omega == 0.0 and abs(a) <= 2.0 * EPSILON * (abs(force) + abs(offset) + abs(stiffness * theta)):
                    a = 0.0
                outward = omega > 0.0 or (omega == 0.0 and (a > 0.0 or (a == 0.0 and slope > 0.0)))
                if grade == ONE_PIECE and t < dt:
                    pieces[PIECE_OMEGA * LANES + n] = omega
                    pieces[PIECE_A * LANES + n] = a - c * omega
                    pieces[PIECE_SLOPE * LANES + n] = slope
                    pieces[PIECE_STIFFNESS * LANES + n] = stiffness
                    pieces[PIECE_DAMPING * LANES + n] = c
                    pieces[PIECE_SPAN * LANES + n] = dt - t
                    pieces[PIECE_GAP * LANES + n] = (row[REGION_UPPER] if outward else row[REGION_LOWER]) - theta
                    n += 1
                else:
                    need = HARD
            k[NEED] = need
            w.parked_time[j] = t
        if entries > 0:
            _solve_propagators(zones, _pad(zones, LANES, entries), dt)
        for j in range(entries):
            step = w.own[w.zone_lane[j]]
            step[STEP_DAMPING] = zones[PIECE_DAMPING * LANES + j]
            step[STEP_GRADE] = ONE_PIECE
            step[STEP_PULL] = 0.0
            for column in range(STEP_G2_RISE + 1):
                step[column] = zones[(PIECE_GAP + column) * LANES + j]
        if n > 0:
            _finish_pieces(pieces, _pad(pieces, LANES, n))
        read = 0
        again = 0
        for j in range(parked):
            lane = w.parked[j]
            x = w.x[lane]
            k = w.k[lane]
            o = w.oscillator[lane]
            i = w.parked_at[j]
            amplitude = w.amplitude[lane]
            if k[NEED] == CROSSES:
                read += 1
                if x[THETA] == 0.0 and not recording:
                    force = amplitude * (record[i] + (record[i + 1] - record[i]) * per_dt * w.parked_time[j])
                    if _lands_soon(x, k, tables, links, parameters, o, force, dt):
                        w.until[lane] = i
                        f.time[bouncing] = w.parked_time[j]
                        _set_apart(w, lane, b, bouncing)
                        bouncing += 1
                        w.leaving[w.leaving[LANES]] = lane
                        w.leaving[LANES] += 1
                        continue
                if pieces[PIECE_SURE * LANES + read - 1] == 1.0:
                    x[THETA] += pieces[PIECE_MOVED * LANES + read - 1]
                    x[OMEGA] = pieces[PIECE_SPEED * LANES + read - 1]
                else:
                    k[NEED] = HARD
            if k[NEED] == HARD:
                slope = amplitude * (record[i + 1] - record[i]) * per_dt
                force = amplitude * record[i]
                t = w.parked_time[j]
                _sample(x, k, tables, links, parameters, o, force, slope, t, dt, i * dt, poly, trig, turning_points)
                if k[OVERTURNED] != 0:
                    fallen = True
            if k[OVERTURNED] != 0:
                continue
            reached, waiting = _follow(
                w, lane, model, record, highs, strongest, dt, i + 1, end, now, waiting, recording
            )
            if reached < end:
                w.parked[again] = lane
                w.parked_at[again] = reached
                again += 1
        parked = again
    return fallen, solved, bouncing


@njit(**_EVENT)
def _reset(x, k, theta, omega, peak, region, start):
    x[THETA] = theta
    x[OMEGA] = omega
    x[HELD] = 0.0
    x[PEAK] = peak
    x[OVERTURN_TIME] = math.nan
    x[STRIKE] = 0.0
    for j in range(STATE_INTEGERS):
        k[j] = 0
    k[NOW] = region
    k[UPLIFTED] = 1 if region != start else 0


@njit(**_EVENT)
def _prepare(steps, tables, parameters, dt):
    """A propagator per oscillator and region of constant damping."""
    for o in range(tables.shape[0]):
        for r in range(tables.shape[1]):
            if parameters[o, PAR_EXACT] == 0.0:
                _fill_step(steps[o, r], tables[o, r], tables[o, r, REGION_DAMPING], dt)


@njit(**_EVENT)
def _first_rise(running, level):
    """Index of the first entry of a non-decreasing row that reaches level (its length if none does)."""
    low = 0
    high = running.shape[0]
    while low < high:
        middle = (low + high) // 2
        if running[middle] < level:
            low = middle + 1
        else:
            high = middle
    return low


@njit(**_EVENT)
def _clear_lane(s, lane):
    """Rows that never need a look: padding, and lanes whose run is over."""
    for row in range(LANE_ROWS):
        s[row * LANES + lane] = 0.0
    s[(ROW_EVEN + 1) * LANES + lane] = 1.0
    s[(ROW_ODD + 1) * LANES + lane] = 1.0
    s[ROW_UPPER * LANES + lane] = math.inf
    s[ROW_LOWER * LANES + lane] = -math.inf
    s[ROW_CALM_UPPER * LANES + lane] = math.inf
    s[ROW_CALM_LOWER * LANES + lane] = -math.inf


@njit(**_EVENT)
def _write_result(out, j, x, k):
    out[j, OUT_OVERTURNED] = k[OVERTURNED]
    out[j, OUT_PEAK] = math.nan if k[SAFE] != 0 else x[PEAK]
    out[j, OUT_UPLIFTED] = k[UPLIFTED]
    out[j, OUT_IMPACTS] = k[IMPACTS]
    out[j, OUT_OVERTURN_TIME] = x[OVERTURN_TIME]
    out[j, OUT_STRIKE] = x[STRIKE]
    out[j, OUT_DIRECTION] = 0.0 if k[OVERTURNED] == 0 else math.copysign(1.0, x[THETA])


@njit(**_EVENT)
def _fetch_lane(w, lane, now):
    """A lane's rotation and velocity out of the lockstep."""
    w.x[lane, THETA] = w.rows[now * LANES + lane]
    w.x[lane, OMEGA] = w.rows[(now + 1) * LANES + lane]


@njit(**_EVENT)
def _copy(target, source):
    for j in range(source.shape[0]):
        target[j] = source[j]


@njit(**_EVENT)
def _leave_lane(w, lane, last):
    """The last of the active lanes takes the place of this one."""
    for row in range(LANE_ROWS):
        w.rows[row * LANES + lane] = w.rows[row * LANES + last]
    _copy(w.x[lane], w.x[last])
    _copy(w.k[lane], w.k[last])
    _copy(w.own[lane], w.own[last])
    w.amplitude[lane] = w.amplitude[last]
    w.oscillator[lane] = w.oscillator[last]
    w.run[lane] = w.run[last]
    w.until[lane] = w.until[last]
    _clear_lane(w.rows, last)


@njit(**_EVENT)
def _set_amplitude(w, lane, amplitude):
    w.amplitude[lane] = amplitude
    w.rows[ROW_AMPLITUDE * LANES + lane] = amplitude
    w.rows[ROW_SQUARE * LANES + lane] = amplitude * amplitude


@njit(**_EVENT)
def _set_apart(w, lane, z, j):
    """The run in a lane goes on as number j of those without one."""
    _copy(z.x[j], w.x[lane])
    _copy(z.k[j], w.k[lane])
    z.oscillator[j] = w.oscillator[lane]
    z.run[j] = w.run[lane]
    z.amplitude[j] = w.amplitude[lane]
    z.until[j] = w.until[lane]


@njit(**_EVENT)
def _take_lane(w, lane, z, j):
    """Run j of those without a lane goes on in one."""
    _copy(w.x[lane], z.x[j])
    _copy(w.k[lane], z.k[j])
    w.oscillator[lane] = z.oscillator[j]
    w.run[lane] = z.run[j]
    w.own[lane, STEP_DAMPING] = -1.0
    _set_amplitude(w, lane, z.amplitude[j])


@njit(**_EVENT)
def _rejoin(w, b, active, bouncing, parked, everyone):
    """Lanes for the bouncing blocks that no longer bounce low, or for all: lanes in use, who bounces, lanes parked."""
    j = 0
    while j < bouncing:
        if b.k[j, NEED] != WAITS and not everyone:
            j += 1
            continue
        _take_lane(w, active, b, j)
        w.k[active, NEED] = WAITS  # its sample is done
        w.parked[parked] = active
        w.parked_at[parked] = b.until[j] - 1
        parked += 1
        active += 1
        bouncing -= 1
        _move_apart(b, bouncing, j)
    return active, bouncing, parked


@njit(**_EVENT)
def _sort(values, n):
    """The first n, few or nearly sorted, in ascending order (numpy's sort takes seconds to compile)."""
    for i in range(1, n):
        value = values[i]
        j = i
        while j > 0 and values[j - 1] > value:
            values[j] = values[j - 1]
            j -= 1
        values[j] = value


@njit(**_EVENT)
def _move_apart(z, j, to):
    """Run j of those without a lane takes the place of another."""
    _copy(z.x[to], z.x[j])
    _copy(z.k[to], z.k[j])
    z.oscillator[to] = z.oscillator[j]
    z.run[to] = z.run[j]
    z.amplitude[to] = z.amplitude[j]
    z.until[to] = z.until[j]


@njit(**_DRIVER)
def _nobody(n):
    """Room for n runs without a lane."""
    return Sleepers(
        np.empty((n, STATE_FLOATS)),
        np.empty((n, STATE_INTEGERS), np.int64),
        np.empty(n, np.int64),
        np.empty(n, np.int64),
        np.empty(n),
        np.empty(n, np.int64),
    )


@njit(**_DRIVER)
def _run_lanes(
    record,
    dt,
    model,
    runs,
    which,
    factors,
    first,
    begin,
    shaking_left,
    barriers,
    out,
    turns,
    history,
    tally,
):
    """Up to LANES runs in lockstep over one record; runs (r,) are sorted by their first sample.

    A run joins at its first sample and leaves when it has overturned, or is sure not to (where shaking_left is given);
    between, only marked lanes leave the lockstep, and a block at rest has no lane until the sample that lifts it.
    Returns the number of turning points of the last run to end.
    """
    marks = np.zeros(LANES, np.uint8)
    w = Lanes(
        np.empty(LANE_ROWS * LANES),
        marks,
        marks.view(np.int64),
        np.empty((LANES, STATE_FLOATS)),
        np.empty((LANES, STATE_INTEGERS), np.int64),
        np.zeros((LANES, STEP_COLUMNS)),
        np.empty(LANES, np.int64),
        np.empty(LANES, np.int64),
        np.empty(LANES),
        np.empty(PIECE_ROWS * LANES),
        np.empty(PIECE_ROWS * LANES),
        np.empty(LANES, np.int64),
        np.empty(PIECE_ROWS * TURN_COLUMNS),
        np.empty(TURN_COLUMNS, np.int64),
        np.empty(LANES, np.int64),
        np.empty(LANES, np.int64),
        np.empty(LANES),
        np.zeros(LANES + 1, np.int64),
        np.empty(LANES, np.int64),
    )
    z = _nobody(runs.shape[0])
    b = _nobody(runs.shape[0])
    f = Flights(np.empty(LANES), np.empty(FLIGHT_ROWS * LANES), np.empty(LANES, np.int64))
    tables, links, parameters, _ = model
    poly = np.empty((3, DEGREE + 1))
    trig = np.empty((2, DEGREE + 1))
    no_turns = np.empty((2, 0))
    for lane in range(LANES):
        _clear_lane(w.rows, lane)
    n = record.shape[0]
    store = history.shape[1] == n
    recording = turns.shape[1] > 0
    active = 0
    asleep = 0
    bouncing = 0
    next_awake = n
    joined = 0
    now = ROW_EVEN
    found = 0
    highs = _highs(record)
    strongest = np.max(highs)
    i = first[runs[0]]
    while True:
        # up to the next multiple of TILE: where the lanes meet must not depend on who is among them
        end = min(i + 1 if store else (i // TILE + 1) * TILE, n - 1)
        if store and active > 0:
            _fetch_lane(w, 0, now)
            _store(history, i, w.x[0], w.k[0], tables, links, w.oscillator[0])
        if store and asleep > 0:
            _store(history, i, z.x[0], z.k[0], tables, links, z.oscillator[0])
        if store and bouncing > 0:
            _store(history, i, b.x[0], b.k[0], tables, links, b.oscillator[0])
        waiting = 0
        parked = 0
        for lane in range(0, active, BLOCK):
            n_lanes = min(BLOCK, active - lane)
            waiting, parked = _advance(w, lane, n_lanes, record, dt, i, end, now, waiting, parked)
        if (end - i) % 2 == 1:
            now = ROW_ODD if now == ROW_EVEN else ROW_EVEN
        meeting = store or end % BOUNCE_INTERVAL == 0 or end == n - 1
        if bouncing > 0 and meeting:
            tally[TALLY_EVENTS] += _bounce(b, f, bouncing, model, record, dt, end, poly, trig, turns)
            active, bouncing, parked = _rejoin(w, b, active, bouncing, parked, end == n - 1)
        if next_awake < end:
            next_awake = n
            j = 0
            while j < asleep:
                if z.until[j] >= end:
                    next_awake = min(next_awake, z.until[j])
                    j += 1
                    continue
                _take_lane(w, active, z, j)
                w.parked[parked] = active
                w.parked_at[parked] = z.until[j]
                parked += 1
                active += 1
                asleep -= 1
                _move_apart(z, asleep, j)
        while joined < runs.shape[0] and (first[runs[joined]] < end or end == n - 1):
            # a run joins alone, and catches up
            j = runs[joined]
            o = which[j]
            x = w.x[active]
            k = w.k[active]
            w.oscillator[active] = o
            w.run[active] = j
            w.own[active, STEP_DAMPING] = -1.0
            _reset(x, k, begin[j, 0], begin[j, 1], begin[j, 2], int(begin[j, 3]), int(parameters[o, PAR_START]))
            _set_amplitude(w, active, -parameters[o, PAR_GAIN] * factors[j])
            if store:
                _store(history, i, x, k, tables, links, o)
            reached, waiting = _follow(
                w, active, model, record, highs, strongest, dt, first[j], end, now, waiting, recording
            )
            joined += 1
            if w.leaving[LANES] > 0:
                w.leaving[LANES] = 0
                _set_apart(w, active, z, asleep)
                next_awake = min(next_awake, z.until[asleep])
                asleep += 1
                continue
            if reached < end:
                w.parked[parked] = active
                w.parked_at[parked] = reached
                parked += 1
            active += 1
        leaving = False
        while parked > 0 or waiting > 0:
            fallen, solved, bouncing = _resolve(
                w,
                b,
                f,
                bouncing,
                model,
                record,
                highs,
                strongest,
                dt,
                end,
                now,
                waiting,
                parked,
                poly,
                trig,
                turns,
            )
            tally[TALLY_EVENTS] += solved
            leaving = leaving or fallen
            waiting = 0
            parked = 0
            if w.leaving[LANES] > 0:
                # from the last lane on, so that none of those that are left changes its place
                _sort(w.leaving, w.leaving[LANES])
                for j in range(w.leaving[LANES] - 1, -1, -1):
                    if w.k[w.leaving[j], NOW] == REST:
                        _set_apart(w, w.leaving[j], z, asleep)
                        next_awake = min(next_awake, z.until[asleep])
                        asleep += 1
                    active -= 1
                    _leave_lane(w, w.leaving[j], active)
                w.leaving[LANES] = 0
            if bouncing > 0 and meeting:  # (nobody lags behind it)
                tally[TALLY_EVENTS] += _bounce(b, f, bouncing, model, record, dt, end, poly, trig, turns)
                active, bouncing, parked = _rejoin(w, b, active, bouncing, parked, end == n - 1)
        i = end
        if shaking_left.shape[0] > 0 and (i % SAFETY_INTERVAL == 0 or i == n - 1):
            for lane in range(active):
                if w.k[lane, OVERTURNED] == 0:
                    _fetch_lane(w, lane, now)
                    push = abs(w.amplitude[lane]) * shaking_left[i]
                    if _is_safe(w.x[lane], w.k[lane], tables, parameters, w.oscillator[lane], push, barriers):
                        w.k[lane, SAFE] = 1
                        leaving = True
            j = 0
            while j < asleep:
                push = abs(z.amplitude[j]) * shaking_left[i]
                if not _is_safe(z.x[j], z.k[j], tables, parameters, z.oscillator[j], push, barriers):
                    j += 1
                    continue
                z.k[j, SAFE] = 1
                tally[TALLY_SAFE] += n - 1 - i
                found = z.k[j, TURNS]
                _write_result(out, z.run[j], z.x[j], z.k[j])
                asleep -= 1
                _move_apart(z, asleep, j)
        if leaving:
            lane = 0
            while lane < active:
                if w.k[lane, OVERTURNED] == 0 and w.k[lane, SAFE] == 0:
                    lane += 1
                    continue
                tally[TALLY_SAFE if w.k[lane, SAFE] != 0 else TALLY_OVERTURNED] += n - 1 - i
                _write_result(out, w.run[lane], w.x[lane], w.k[lane])
                found = w.k[lane, TURNS]
                if store:
                    _store_fallen(history, i, w.x[lane])
                active -= 1
                _leave_lane(w, lane, active)
        if i == n - 1 or (active + asleep + bouncing == 0 and joined == runs.shape[0]):
            break
    for j in range(asleep):  # they take their lanes again, and end with the others
        _take_lane(w, active, z, j)
        w.rows[now * LANES + active] = 0.0
        w.rows[(now + 1) * LANES + active] = 0.0
        active += 1
    if store and active > 0:
        _fetch_lane(w, 0, now)
        _store(history, n - 1, w.x[0], w.k[0], tables, links, w.oscillator[0])
    for lane in range(active):
        _fetch_lane(w, lane, now)
        found = w.k[lane, TURNS]
        _free(w.x[lane], w.k[lane], tables, links, parameters, w.oscillator[lane], (n - 1) * dt, poly, trig, no_turns)
        _write_result(out, w.run[lane], w.x[lane], w.k[lane])
    return found


@njit(**_DRIVER)
def _run_exact(
    record,
    dt,
    tables,
    links,
    parameters,
    runs,
    which,
    factors,
    first,
    begin,
    shaking_left,
    barriers,
    out,
    turns,
    history,
    tally,
):
    """Runs in exact geometry, one after the other: every sample of a moving block is solved by its own series."""
    x = np.empty(STATE_FLOATS)
    k = np.empty(STATE_INTEGERS, np.int64)
    poly = np.empty((3, DEGREE + 1))
    trig = np.empty((2, DEGREE + 1))
    no_turns = np.empty((2, 0))
    n = record.shape[0]
    store = history.shape[1] == n
    looking = shaking_left.shape[0] > 0
    highs = _highs(record)
    found = 0
    for r in range(runs.shape[0]):
        j = runs[r]
        o = which[j]
        _reset(x, k, begin[j, 0], begin[j, 1], begin[j, 2], int(begin[j, 3]), int(parameters[o, PAR_START]))
        amplitude = -parameters[o, PAR_GAIN] * factors[j]
        right = parameters[o, PAR_UPLIFT_RIGHT]
        left = -parameters[o, PAR_UPLIFT_LEFT]
        i = first[j] - 1
        while True:
            i += 1
            if store:
                _store(history, i, x, k, tables, links, o)
            if i == n - 1:
                break
            force = amplitude * record[i]
            end = amplitude * record[i + 1]
            looks = looking and i % SAFETY_INTERVAL == 0
            if looks and _is_safe(x, k, tables, parameters, o, abs(amplitude) * shaking_left[i], barriers):
                k[SAFE] = 1
                tally[TALLY_SAFE] += n - 1 - i
                break
            if k[NOW] == REST and max(force, end) <= right and min(force, end) >= left:
                lifted = i + 1 if store else _until_uplift(record, highs, amplitude, right, left, i)
                stop = (i // SAFETY_INTERVAL + 1) * SAFETY_INTERVAL if looking else n - 1
                i = max(i, min(lifted, stop, n - 1) - 1)
                continue
            tally[TALLY_EVENTS] += 1
            slope = (end - force) / dt
            if x[THETA] == 0.0 or not _glide(x, k, tables, parameters, o, force, slope, dt):
                t = 0.0
                _sample(x, k, tables, links, parameters, o, force, slope, t, dt, i * dt, poly, trig, turns)
            if k[OVERTURNED] != 0:
                tally[TALLY_OVERTURNED] += n - 2 - i
                if store:
                    _store_fallen(history, i + 1, x)
                break
        found = k[TURNS]
        if k[OVERTURNED] == 0 and k[SAFE] == 0:
            _free(x, k, tables, links, parameters, o, (n - 1) * dt, poly, trig, no_turns)
        _write_result(out, j, x, k)
    return found


@njit(**_DRIVER)
def _unit_response(record, dt, tables, links, parameters, steps, o, unit):
    """The response of oscillator o to the record as it is until its first uplift, into unit (3, n); its peak for good.

    An elastic block: its zone's linear response, as if the zone had no edges; at scale factor f it is f times this. A
    block that rests rigidly: the running maximum of the record alone, in the row of peaks.
    """
    zone = int(parameters[o, PAR_START])
    if zone == REST:
        high = 0.0
        for i in range(record.shape[0]):
            high = max(high, abs(record[i]))
            unit[UNIT_PEAK, i] = high
        return 0.0
    x = np.empty(STATE_FLOATS)
    k = np.empty(STATE_INTEGERS, np.int64)
    poly = np.empty((3, DEGREE + 1))
    trig = np.empty((2, DEGREE + 1))
    no_turns = np.empty((2, 0))
    lower = tables[o, zone, REGION_LOWER]
    upper = tables[o, zone, REGION_UPPER]
    tables[o, zone, REGION_LOWER] = -math.inf
    tables[o, zone, REGION_UPPER] = math.inf
    _reset(x, k, 0.0, 0.0, 0.0, zone, zone)
    gain = -parameters[o, PAR_GAIN]
    stiffness = tables[o, zone, REGION_STIFFNESS]
    c = tables[o, zone, REGION_DAMPING]
    one_step = steps[o, zone, STEP_GRADE] != MANY_STEPS
    g0 = steps[o, zone, STEP_G0]
    g1 = steps[o, zone, STEP_G1]
    g2 = steps[o, zone, STEP_G2]
    g3 = steps[o, zone, STEP_G3]
    g2_rise = steps[o, zone, STEP_G2_RISE]
    theta = 0.0
    omega = 0.0
    high = 0.0
    n = record.shape[0]
    for i in range(n - 1):
        high = max(high, abs(theta))
        unit[UNIT_THETA, i] = theta
        unit[UNIT_OMEGA, i] = omega
        unit[UNIT_PEAK, i] = high
        push = gain * record[i]
        up = gain * (record[i + 1] - record[i])
        if one_step:
            a = push - stiffness * theta
            theta_end = theta + (omega * g1 + a * g2 + up * g3)
            omega_end = omega + (omega * g0 + a * g1 + up * g2_rise)
            a -= c * omega
            a_end = push + up - stiffness * theta_end - c * omega_end
            turns = omega * omega_end <= 0.0 or (a * omega < 0.0 and a_end * omega > 0.0)
            if not turns or abs(theta) + _reach(omega, a, a_end, dt) <= high:
                theta = theta_end
                omega = omega_end
                continue
        x[THETA] = theta
        x[OMEGA] = omega
        _sample(x, k, tables, links, parameters, o, push, up / dt, 0.0, dt, i * dt, poly, trig, no_turns)
        theta = x[THETA]
        omega = x[OMEGA]
        high = max(high, x[PEAK])
    x[THETA] = theta
    x[OMEGA] = omega
    x[PEAK] = max(high, abs(theta))
    unit[UNIT_THETA, n - 1] = theta
    unit[UNIT_OMEGA, n - 1] = omega
    unit[UNIT_PEAK, n - 1] = x[PEAK]
    _free(x, k, tables, links, parameters, o, (n - 1) * dt, poly, trig, no_turns)
    tables[o, zone, REGION_LOWER] = lower
    tables[o, zone, REGION_UPPER] = upper
    return x[PEAK]


@njit(**_DRIVER)
def _by_first(runs, first, n):
    """The runs in the order of their first samples, 0 … n - 1 (a counting sort: numpy's takes seconds to compile)."""
    place = np.zeros(n + 1, np.int64)
    for r in range(runs.shape[0]):
        place[first[runs[r]] + 1] += 1
    for i in range(n):
        place[i + 1] += place[i]
    order = np.empty_like(runs)
    for r in range(runs.shape[0]):
        i = first[runs[r]]
        order[place[i]] = runs[r]
        place[i] += 1
    return order


@njit(**_EVENT)
def _cannot_fall(parameters, o, factor, shaking_left, barriers):
    """Whether a block at rest cannot be overturned by the whole record (as `_is_safe`)."""
    push = abs(parameters[o, PAR_GAIN] * factor) * shaking_left[0]
    return push * barriers[o, 2] < (1.0 - 1e-9) * barriers[o, 0]


@njit(**_DRIVER)
def run_batch(
    record,
    dt,
    tables,
    links,
    parameters,
    which,
    factors,
    start,
    skip,
    flags_only,
    out,
    turning_points,
    history,
    tally,
):
    """Runs of oscillators which[j] under factors[j] * record; returns the turning points of the last one.

    record (n,) m/s²; tables (o, r, 6), links (o, r, 9), parameters (o, 10); which, factors (m,), sorted by oscillator;
    start (theta, omega, region) or empty for all at rest; out (m, 7) is filled; turning_points (2, t) and history
    (5, n or 0) store a single run's. skip: leave out what is known before the first uplift; with flags_only also what
    cannot overturn the block any more, and then only OUT_OVERTURNED is right.  tally (5,) is added to.
    """
    n = record.shape[0]
    m = which.shape[0]
    steps = np.zeros((tables.shape[0], tables.shape[1], STEP_COLUMNS))
    _prepare(steps, tables, parameters, dt)
    model = Model(tables, links, parameters, steps)
    # where each run begins: its first sample, and theta, omega, peak and region there
    first = np.zeros(m, np.int64)
    begin = np.zeros((m, 4))
    unit = np.zeros((UNIT_ROWS, n if skip else 0))
    unit_peak = 0.0
    current = -1
    tally[TALLY_SAMPLES] += m * (n - 1)
    # the integral of |u''| from each sample to the end (from above: chords of |u''|), and the barriers
    shaking_left = np.zeros(n if skip and flags_only else 0)
    barriers = np.zeros((tables.shape[0], 3))
    if skip and flags_only:
        for i in range(n - 2, -1, -1):
            shaking_left[i] = shaking_left[i + 1] + 0.5 * dt * (abs(record[i]) + abs(record[i + 1]))
        for o in range(tables.shape[0]):
            _find_barrier(tables, parameters, o, barriers)
    linear = np.empty(m, np.int64)
    exact = np.empty(m, np.int64)
    linear_runs = 0
    exact_runs = 0
    for j in range(m):
        o = which[j]
        zone = int(parameters[o, PAR_START])
        begin[j, 3] = zone
        if start.shape[0] == 3:
            begin[j, 0] = start[0]
            begin[j, 1] = start[1]
            begin[j, 2] = abs(start[0])
            begin[j, 3] = start[2]
        elif skip and flags_only and _cannot_fall(parameters, o, factors[j], shaking_left, barriers):
            tally[TALLY_SAFE] += n - 1
            out[j, OUT_OVERTURNED] = 0.0
            continue
        elif skip and (zone == REST or tables[o, zone, REGION_OFFSET] == 0.0):
            # (a zone with a static offset does not respond in proportion to the factor)
            if o != current:
                current = o
                unit_peak = _unit_response(record, dt, tables, links, parameters, steps, o, unit)
            if zone == REST:
                level = min(parameters[o, PAR_UPLIFT_RIGHT], parameters[o, PAR_UPLIFT_LEFT]) / parameters[o, PAR_GAIN]
            else:
                level = min(tables[o, zone, REGION_UPPER], -tables[o, zone, REGION_LOWER])
            # A part in 10⁹ early: the rounding of a scaled response must not hide the uplift.
            level *= (1.0 - 1e-9) / abs(factors[j])
            first[j] = max(_first_rise(unit[UNIT_PEAK], level) - 1, 0)
            if zone != REST:
                begin[j, 0] = factors[j] * unit[UNIT_THETA, first[j]]
                begin[j, 1] = factors[j] * unit[UNIT_OMEGA, first[j]]
                begin[j, 2] = abs(factors[j]) * unit[UNIT_PEAK, first[j]]
            if first[j] == n - 1 and unit_peak < level:
                out[j, OUT_OVERTURNED] = 0.0
                out[j, OUT_PEAK] = abs(factors[j]) * unit_peak
                out[j, OUT_UPLIFTED] = 0.0
                out[j, OUT_IMPACTS] = 0.0
                out[j, OUT_OVERTURN_TIME] = math.nan
                out[j, OUT_STRIKE] = 0.0
                out[j, OUT_DIRECTION] = 0.0
                tally[TALLY_BEFORE_UPLIFT] += n - 1
                continue
        tally[TALLY_BEFORE_UPLIFT] += first[j]
        if flags_only and skip:
            begin[j, 2] = FLAT  # no turn matters then
        if parameters[o, PAR_EXACT] != 0.0:
            exact[exact_runs] = j
            exact_runs += 1
        else:
            linear[linear_runs] = j
            linear_runs += 1
    turns = 0
    if exact_runs > 0:
        turns = _run_exact(
            record,
            dt,
            tables,
            links,
            parameters,
            exact[:exact_runs],
            which,
            factors,
            first,
            begin,
            shaking_left,
            barriers,
            out,
            turning_points,
            history,
            tally,
        )
    order = _by_first(linear[:linear_runs], first, n)
    for j in range(0, linear_runs, LANES):
        turns = _run_lanes(
            record,
            dt,
            model,
            order[j : j + LANES],
            which,
            factors,
            first,
            begin,
            shaking_left,
            barriers,
            out,
            turning_points,
            history,
            tally,
        )
    return turns
