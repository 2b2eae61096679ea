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

How a batch runs (`run_batch`): runs go in lockstep over one record, a lane each; `_step_lanes` takes the plain step of
all lanes at once and marks those that may hold an event; `_look` solves these sample by sample (`_sample`), piece by
piece (`_piece`: series, first event, what happens there), and puts them back.  After the record, `_free` follows the
block until nothing can change.

All functions called by a kernel stand in this file: numba's disk cache looks at one file only.
"""

import math
from typing import Any

import numpy as np
from numba import njit

# Kernels that allocate nothing run without numba's reference counts (their atomic operations cost more than a piece);
# fused multiply-add is left to the scalar ones, so that a lane's bits cannot depend on how many lanes go beside it.
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
THETA, OMEGA, HELD, PEAK, OVERTURN_TIME = range(5)
NOW, IMPACTS, UPLIFTED, OVERTURNED, TURNS, FREE = range(6)
STATE_FLOATS, STATE_INTEGERS = 5, 6

# Results of a run.
OUT_OVERTURNED, OUT_PEAK, OUT_UPLIFTED, OUT_IMPACTS, OUT_OVERTURN_TIME = range(5)
OUT_COLUMNS = 5

# Rows of a history.
HISTORY_THETA, HISTORY_OMEGA, HISTORY_REGION, HISTORY_DAMPING, HISTORY_PEAK = range(5)
HISTORY_ROWS = 5

# Runs that go in lockstep over one record, and the rows of their state: two sets of (theta, omega) written in turn.
LANES = 32
(
    ROW_EVEN,
    _,
    ROW_ODD,
    _,
    ROW_AMPLITUDE,
    ROW_OFFSET,
    ROW_STIFFNESS,
    ROW_DAMPING,
    ROW_G0,
    ROW_G1,
    ROW_G2,
    ROW_G3,
    ROW_G2_RISE,
    ROW_UPPER,
    ROW_LOWER,
    ROW_LOOK,
) = range(16)
LANE_ROWS = 16

DEGREE = 30
MOVED, SPEED, ACCELERATION = range(3)
INVERSE = np.array([0.0, *(1.0 / k for k in range(1, DEGREE + 1))])
EPSILON = 2.220446049250313e-16
MARGIN = 32.0 * EPSILON
FLAT = 0.5 * math.pi
# Bounces below this height (rad) that come by the thousand within one sample end at rest: only with e = 1 (to
# rounding), where they would go on for ever.
NO_HEIGHT = 1e-15
MANY_IMPACTS = 1000
MAX_FREE_PIECES = 100_000
MAX_FREE_TURNS = 4
FREE_STEP = 1e9  # s: longer than any piece


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
def _exact_series(poly, trig, theta, omega, p2, tilt, force, slope, h):
    """Taylor coefficients of x'' = -p² sin(tilt - x) + (force + slope t) cos(tilt - x)/cos(tilt), and a safe step.

    sin and cos of the running angle by their product recurrences.  The step returned (<= h) keeps the neglected terms
    below 1e-17 of the largest kept one and holds at most one zero of the acceleration: proved by a bound on the terms
    of the acceleration, or of the jerk, that follow the first.
    """
    trig[0, 0] = math.sin(tilt - theta)
    trig[1, 0] = math.cos(tilt - theta)
    scale = 1.0 / math.cos(tilt)
    trig[2, 1] = omega
    a = -p2 * trig[0, 0] + force * trig[1, 0] * scale
    if omega == 0.0 and abs(a) <= 2.0 * EPSILON * (p2 * abs(trig[0, 0]) + abs(force * trig[1, 0] * scale)):
        a = 0.0
    trig[2, 2] = 0.5 * a
    largest = max(abs(omega) * h, abs(trig[2, 2]) * h * h)
    power = h * h
    before = 1.0
    n = DEGREE
    for k in range(1, DEGREE - 1):
        s = 0.0
        c = 0.0
        for j in range(1, k + 1):
            s -= j * trig[2, j] * trig[1, k - j]
            c += j * trig[2, j] * trig[0, k - j]
        trig[0, k] = s / k
        trig[1, k] = c / k
        forced = (force * trig[1, k] + slope * trig[1, k - 1]) * scale
        trig[2, k + 2] = (-p2 * trig[0, k] + forced) / ((k + 2) * (k + 1))
        power *= h
        term = (k + 2) * abs(trig[2, k + 2]) * power
        if k == 1:
            largest = max(largest, term)
        elif term <= 1e-17 * largest and before <= 1e-17 * largest:
            n = k + 2
            break
        before = term
    if n == DEGREE:
        while (
            n * abs(trig[2, n]) * h**n > 1e-17 * largest
            or (n - 1) * abs(trig[2, n - 1]) * h ** (n - 1) > 1e-17 * largest
        ) and h > 1e-12:
            h *= 0.7
            largest = max(abs(omega) * h, abs(trig[2, 2]) * h * h, 3.0 * abs(trig[2, 3]) * h * h * h)
    for _ in range(40):
        of_a = 0.0
        of_jerk = 0.0
        power = h
        for k in range(3, n + 1):
            term = k * (k - 1) * abs(trig[2, k]) * power
            of_a += term
            if k > 3:
                of_jerk += (k - 2) * term / h
            power *= h
        if 2.0 * abs(trig[2, 2]) > of_a or 6.0 * abs(trig[2, 3]) > of_jerk:
            break
        if trig[2, 1] == 0.0 and trig[2, 2] == 0.0 and trig[2, 3] == 0.0:
            break
        h *= 0.5
    for k in range(n):
        poly[MOVED, k] = trig[2, k]
        poly[SPEED, k] = (k + 1) * trig[2, k + 1]
        poly[ACCELERATION, k] = (k + 2) * (k + 1) * trig[2, k + 2] if k + 2 <= n else 0.0
    poly[MOVED, 0] = 0.0
    poly[MOVED, n] = trig[2, n]
    poly[SPEED, n] = 0.0
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
        time = (math.atan2(w, u1) - math.atan2(-w, u0)) / w
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
    # First guess: the loss over the undamped path (v0 the speed at the middle).
    v0 = math.sqrt(speed * speed + 1.0)
    path = speed + v0 * v0 * math.asin(1.0 / v0)
    zeta = loss / (path + math.sqrt(max(0.0, path * path - 4.0 * loss)))
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
        new = -1.0
        if arrives:
            time, by_zeta = _crossing_time(zeta, gap, u0, u1, r0, r1)
            residual = math.log1p(excess / r1) - 2.0 * zeta * time
            slope = -2.0 * (speed / r0 + exit_speed / r1 + time + zeta * by_zeta)
            arrives = residual >= 0.0
            if slope < 0.0:
                new = zeta - residual / slope
        if arrives:
            low = zeta
        else:
            high = zeta
        if not (low <= new <= high):
            new = 0.5 * (low + high) if high < math.inf else 2.0 * zeta
        if abs(new - zeta) <= 4e-16 * zeta:
            return new
        zeta = new
    return zeta


@njit(**_EVENT)
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
def _settles(parameters, o, omega, stiffness, force, slope, left, peak):
    """Whether all later bounces provably end before the sample does, or before its forcing reaches the threshold.

    With a_min the least deceleration over a horizon, the bounces that follow take 2|omega|/((1 - e) a_min) in all and
    rise to omega²/(2 a_min), which must not exceed the peak so far.  A tenth of a_min is kept for the softening
    |K| x of the branch: x <= (1 - e)² a_min horizon²/8, and a horizon of half its time constant keeps it below 1/32.
    """
    if omega == 0.0:
        return True
    e = parameters[o, PAR_RESTITUTION]
    if e >= 1.0:
        return False
    horizon = min(left, 0.5 / math.sqrt(-stiffness))
    end = force + slope * horizon
    # Where the threshold is exceeded later in this sample, half the time until then is the horizon.
    if end > parameters[o, PAR_UPLIFT_RIGHT] and slope > 0.0:
        horizon = 0.5 * (parameters[o, PAR_UPLIFT_RIGHT] - force) / slope
    elif end < -parameters[o, PAR_UPLIFT_LEFT] and slope < 0.0:
        horizon = 0.5 * (-parameters[o, PAR_UPLIFT_LEFT] - force) / slope
    end = force + slope * horizon
    a_min = 0.9 * min(
        parameters[o, PAR_UPLIFT_RIGHT] - max(force, end), parameters[o, PAR_UPLIFT_LEFT] + min(force, end)
    )
    return a_min > 0.0 and 2.0 * abs(omega) <= (1.0 - e) * a_min * horizon and omega * omega <= 2.0 * a_min * peak


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


@njit(**_EVENT)
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
        x[HELD] = _held_damping(tables, parameters, o, target, x[OMEGA])
    else:
        k[IMPACTS] += 1
        x[OMEGA] *= parameters[o, PAR_RESTITUTION]
        stiffness = tables[o, region, REGION_STIFFNESS]
        if k[FREE] == 0 and _settles(parameters, o, x[OMEGA], stiffness, force, slope, left, x[PEAK]):
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
        n, h = _exact_series(poly, trig, theta, omega, -stiffness, offset / stiffness, force, slope, h)
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
def _sample(x, k, tables, links, parameters, o, force, slope, dt, time, poly, trig, turning_points):
    """One sample, cut at its events."""
    t = 0.0
    impacts = k[IMPACTS]
    while t < dt and k[OVERTURNED] == 0:
        t += _piece(
            x, k, tables, links, parameters, o, force + slope * t, slope, dt - t, time + t, poly, trig, turning_points
        )
        if k[IMPACTS] - impacts > MANY_IMPACTS and x[THETA] == 0.0 and k[NOW] != REST:
            stiffness = tables[o, k[NOW], REGION_STIFFNESS]
            now = force + slope * t
            a_min = min(parameters[o, PAR_UPLIFT_RIGHT] - now, parameters[o, PAR_UPLIFT_LEFT] + now)
            if x[OMEGA] * x[OMEGA] <= 2.0 * a_min * NO_HEIGHT and stiffness < 0.0:
                x[OMEGA] = 0.0
                k[NOW] = REST


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
def _free(x, k, tables, links, parameters, o, time, poly, trig, turning_points):
    """After the record: on until overturned, at rest, or sure never to exceed the peak again.

    Free motion loses energy, so a turning point on each side bounds all that follow on it; inside a zone with a stable
    centre the energy itself does.  A block that turns on one side only (beside a wall) is bounded by a few turns there.
    """
    turns = k[TURNS]
    impacts = k[IMPACTS]
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
    k[IMPACTS] = impacts  # counted during the record only
    if passed and k[OVERTURNED] == 0:
        k[OVERTURNED] = 1
        x[PEAK] = FLAT
        x[OVERTURN_TIME] = math.nan


@njit(**_EVENT)
def _propagator(stiffness, c, h):
    """The step's transition: impulse response, its slope, its first and second integrals, as series about the state.

    With y'' + c y' + K y = a + s t, y(h) = omega g1 + a g2 + s g3 and y'(h) = omega (1 + g0) + a g1 + s g2: increments,
    so that the coefficients' rounding does not add up to a drift of energy.
    """
    b = 1.0
    before = 0.0
    power = 1.0
    g0 = 0.0
    g1 = h
    g2 = 0.5 * h * h
    g3 = h * h * h / 6.0
    for k in range(2, _degree(h * _rate(stiffness, c)) + 5):
        new = -(c * b + stiffness * before * INVERSE[k - 1]) * INVERSE[k]
        before = b
        b = new
        power *= h
        g0 += k * b * power
        g1 += b * power * h
        g2 += b * power * h * h * INVERSE[k + 1]
        g3 += b * power * h * h * h * (INVERSE[k + 1] * INVERSE[k + 2])
    return g0, g1, g2, g3 / h, g2 / h


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
def _step_lanes(s, n, force, rise, now, after):
    """One sample of n lanes from the state rows `now` to the rows `after`; the number of lanes that need a look.

    Rows lie at constant offsets in one flat array, and the trip count is known at run time only: so it vectorises.
    """
    count = 0
    for lane in range(n):
        theta = s[now * LANES + lane]
        omega = s[(now + 1) * LANES + lane]
        amplitude = s[ROW_AMPLITUDE * LANES + lane]
        stiffness = s[ROW_STIFFNESS * LANES + lane]
        c = s[ROW_DAMPING * LANES + lane]
        g1 = s[ROW_G1 * LANES + lane]
        push = s[ROW_OFFSET * LANES + lane] + amplitude * force
        up = amplitude * rise
        a = push - stiffness * theta
        theta_end = theta + (omega * g1 + a * s[ROW_G2 * LANES + lane] + up * s[ROW_G3 * LANES + lane])
        omega_end = omega + (omega * s[ROW_G0 * LANES + lane] + a * g1 + up * s[ROW_G2_RISE * LANES + lane])
        s[after * LANES + lane] = theta_end
        s[(after + 1) * LANES + lane] = omega_end
        a_start = a - c * omega
        a_end = push + up - stiffness * theta_end - c * omega_end
        look = (
            (theta_end >= s[ROW_UPPER * LANES + lane])
            | (theta_end <= s[ROW_LOWER * LANES + lane])
            | (omega * omega_end <= 0.0)
            | ((a_start * omega < 0.0) & (a_end * omega > 0.0))
        )
        s[ROW_LOOK * LANES + lane] = 1.0 if look else 0.0
        if look:
            count += 1
    return count


@njit(**_LANES)
def _step_even(s, n, force, rise):
    """Compiled apart: inside a larger function the loop would not be vectorised."""
    return _step_lanes(s, n, force, rise, ROW_EVEN, ROW_ODD)


@njit(**_LANES)
def _step_odd(s, n, force, rise):
    return _step_lanes(s, n, force, rise, ROW_ODD, ROW_EVEN)


@njit(**_EVENT)
def _load_lane(s, lane, x, k, tables, links, parameters, o, steps, own, dt, force, rows):
    """Write a lane's coefficients for the region it is in, and its state into `rows`."""
    region = k[NOW]
    if region == REST:
        # The rows follow the forcing itself (theta := force, omega := 1), so that the zone test is the threshold's.
        s[rows * LANES + lane] = force
        s[(rows + 1) * LANES + lane] = 1.0
        s[ROW_OFFSET * LANES + lane] = 0.0
        s[ROW_STIFFNESS * LANES + lane] = 1.0
        s[ROW_DAMPING * LANES + lane] = -1.0  # keeps rounding from looking like a dip of the velocity
        s[ROW_G0 * LANES + lane] = 0.0
        s[ROW_G1 * LANES + lane] = 0.0
        s[ROW_G2 * LANES + lane] = 1.0
        s[ROW_G3 * LANES + lane] = 1.0
        s[ROW_G2_RISE * LANES + lane] = 0.0
        s[ROW_UPPER * LANES + lane] = parameters[o, PAR_UPLIFT_RIGHT]
        s[ROW_LOWER * LANES + lane] = -parameters[o, PAR_UPLIFT_LEFT]
        return
    s[rows * LANES + lane] = x[THETA]
    s[(rows + 1) * LANES + lane] = x[OMEGA]
    c = tables[o, region, REGION_DAMPING]
    stiffness = tables[o, region, REGION_STIFFNESS]
    s[ROW_STIFFNESS * LANES + lane] = stiffness
    s[ROW_OFFSET * LANES + lane] = tables[o, region, REGION_OFFSET]
    upper = tables[o, region, REGION_UPPER]
    if links[o, region, LINK_HELD]:
        c = x[HELD]
        if c != own[lane, 5]:
            own[lane, 5] = c
            own[lane, 6] = 1.0 if dt * _rate(stiffness, c) <= 0.5 else 0.0
            if own[lane, 6] == 1.0:
                own[lane, 0], own[lane, 1], own[lane, 2], own[lane, 3], own[lane, 4] = _propagator(stiffness, c, dt)
        s[ROW_G0 * LANES + lane] = own[lane, 0]
        s[ROW_G1 * LANES + lane] = own[lane, 1]
        s[ROW_G2 * LANES + lane] = own[lane, 2]
        s[ROW_G3 * LANES + lane] = own[lane, 3]
        s[ROW_G2_RISE * LANES + lane] = own[lane, 4]
        one_step = own[lane, 6] == 1.0
    else:
        s[ROW_G0 * LANES + lane] = steps[o, region, 0]
        s[ROW_G1 * LANES + lane] = steps[o, region, 1]
        s[ROW_G2 * LANES + lane] = steps[o, region, 2]
        s[ROW_G3 * LANES + lane] = steps[o, region, 3]
        s[ROW_G2_RISE * LANES + lane] = steps[o, region, 4]
        one_step = steps[o, region, 6] == 1.0
    s[ROW_DAMPING * LANES + lane] = c
    # where a sample is more than one step, every sample needs a look
    s[ROW_UPPER * LANES + lane] = upper if one_step else -math.inf
    s[ROW_LOWER * LANES + lane] = tables[o, region, REGION_LOWER]


@njit(**_LANES)
def _is_quiet(s, lane, region, turns_matter, peak, dt, force, rise, now, after):
    """Whether a lane that was marked holds no event after all: nothing but turns below the peak, far from the edges.

    Over one step |a| <= 1.2 max(|a_start|, |a_end|) (it solves a'' + c a' + K a = 0 with sqrt|K| h, c h <= 1/2), which
    bounds the excursion; towards its zero it falls, which bounds how far the velocity dips.
    """
    upper = s[ROW_UPPER * LANES + lane]
    lower = s[ROW_LOWER * LANES + lane]
    if region == REST or upper == -math.inf:
        return False
    theta = s[now * LANES + lane]
    omega = s[(now + 1) * LANES + lane]
    theta_end = s[after * LANES + lane]
    omega_end = s[(after + 1) * LANES + lane]
    if theta_end >= upper or theta_end <= lower:
        return False
    stiffness = s[ROW_STIFFNESS * LANES + lane]
    c = s[ROW_DAMPING * LANES + lane]
    amplitude = s[ROW_AMPLITUDE * LANES + lane]
    push = s[ROW_OFFSET * LANES + lane] + amplitude * force
    a_start = abs(push - stiffness * theta - c * omega)
    a_end = abs(push + amplitude * rise - stiffness * theta_end - c * omega_end)
    if omega * omega_end > 0.0 and (abs(omega) > 1.2 * dt * a_start or abs(omega_end) > 1.2 * dt * a_end):
        return True
    if turns_matter:
        return False
    reach = (abs(omega) + 1.2 * dt * max(a_start, a_end)) * dt
    return theta + reach < upper and theta - reach > lower and abs(theta) + reach <= peak


@njit(**_EVENT)
def _look(
    s, n, lx, lk, which, tables, links, parameters, steps, own, dt, i, force, rise, now, after, x, k, poly, trig, turns
):
    """Solve the marked lanes of sample i event by event; returns whether any of them overturned."""
    fallen = False
    for lane in range(n):
        if s[ROW_LOOK * LANES + lane] == 0.0:
            continue
        o = which[lane]
        region = lk[lane, NOW]
        turns_matter = turns.shape[1] > 0 or (region != REST and _captures(links, o, region))
        if _is_quiet(s, lane, region, turns_matter, lx[lane, PEAK], dt, force, rise, now, after):
            continue
        for j in range(STATE_FLOATS):
            x[j] = lx[lane, j]
        for j in range(STATE_INTEGERS):
            k[j] = lk[lane, j]
        if region != REST:
            x[THETA] = s[now * LANES + lane]
            x[OMEGA] = s[(now + 1) * LANES + lane]
        held = x[HELD]
        amplitude = s[ROW_AMPLITUDE * LANES + lane]
        slope = amplitude * rise / dt
        _sample(x, k, tables, links, parameters, o, amplitude * force, slope, dt, i * dt, poly, trig, turns)
        if k[OVERTURNED] != 0:
            fallen = True
        if k[NOW] != region or x[HELD] != held:
            _load_lane(s, lane, x, k, tables, links, parameters, o, steps, own, dt, amplitude * (force + rise), after)
        elif region == REST:
            s[after * LANES + lane] = amplitude * (force + rise)
            s[(after + 1) * LANES + lane] = 1.0
        else:
            s[after * LANES + lane] = x[THETA]
            s[(after + 1) * LANES + lane] = x[OMEGA]
        for j in range(STATE_FLOATS):
            lx[lane, j] = x[j]
        for j in range(STATE_INTEGERS):
            lk[lane, j] = k[j]
    return fallen


@njit(**_EVENT)
def _reset(x, k, theta, omega, peak, region, start):
    x[THETA] = theta
    x[OMEGA] = omega
    x[HELD] = 0.0
    x[PEAK] = peak
    x[OVERTURN_TIME] = math.nan
    for j in range(STATE_INTEGERS):
        k[j] = 0
    k[NOW] = region
    k[UPLIFTED] = 1 if region != start else 0


@njit(**_EVENT)
def _prepare(steps, tables, links, parameters, dt):
    """A propagator per oscillator and region of constant damping; the last column says whether a sample is one step."""
    for o in range(tables.shape[0]):
        for r in range(tables.shape[1]):
            stiffness = tables[o, r, REGION_STIFFNESS]
            c = tables[o, r, REGION_DAMPING]
            steps[o, r, 5] = c
            steps[o, r, 6] = 0.0
            if parameters[o, PAR_EXACT] == 0.0 and dt * _rate(stiffness, c) <= 0.5:
                steps[o, r, 6] = 1.0
                steps[o, r, 0], steps[o, r, 1], steps[o, r, 2], steps[o, r, 3], steps[o, r, 4] = _propagator(
                    stiffness, c, dt
                )


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


@njit(**_EVENT)
def _write_result(out, j, x, k):
    out[j, OUT_OVERTURNED] = k[OVERTURNED]
    out[j, OUT_PEAK] = x[PEAK]
    out[j, OUT_UPLIFTED] = k[UPLIFTED]
    out[j, OUT_IMPACTS] = k[IMPACTS]
    out[j, OUT_OVERTURN_TIME] = x[OVERTURN_TIME]


@njit(**_EVENT)
def _fetch_lane(s, lane, lx, lk, rows, x, k):
    """A lane's whole state into x and k."""
    for j in range(STATE_FLOATS):
        x[j] = lx[lane, j]
    for j in range(STATE_INTEGERS):
        k[j] = lk[lane, j]
    if k[NOW] != REST:
        x[THETA] = s[rows * LANES + lane]
        x[OMEGA] = s[(rows + 1) * LANES + lane]


@njit(**_DRIVER)
def _run_lanes(record, dt, tables, links, parameters, steps, runs, which, factors, first, begin, out, turns, history):
    """Up to LANES runs in lockstep over one record; runs (r,) are sorted by their first sample.

    A run joins at its first sample and leaves when it has overturned; between, only marked lanes leave the lockstep.
    Returns the number of turning points of the last run to end.
    """
    s = np.empty(LANE_ROWS * LANES)
    lx = np.empty((LANES, STATE_FLOATS))
    lk = np.empty((LANES, STATE_INTEGERS), np.int64)
    own = np.zeros((LANES, 7))
    lane_o = np.empty(LANES, np.int64)
    lane_run = np.empty(LANES, np.int64)
    x = np.empty(STATE_FLOATS)
    k = np.empty(STATE_INTEGERS, np.int64)
    poly = np.empty((3, DEGREE + 1))
    trig = np.empty((3, DEGREE + 1))
    no_turns = np.empty((2, 0))
    for lane in range(LANES):
        _clear_lane(s, lane)
    n = record.shape[0]
    store = history.shape[1] == n
    active = 0
    joined = 0
    now = ROW_EVEN
    after = ROW_ODD
    found = 0
    for i in range(first[runs[0]], n):
        while joined < runs.shape[0] and first[runs[joined]] == i:
            j = runs[joined]
            o = which[j]
            lane_o[active] = o
            lane_run[active] = j
            own[active, 5] = -1.0
            _reset(x, k, begin[j, 0], begin[j, 1], begin[j, 2], int(begin[j, 3]), int(parameters[o, PAR_START]))
            amplitude = -parameters[o, PAR_GAIN] * factors[j]
            s[ROW_AMPLITUDE * LANES + active] = amplitude
            _load_lane(s, active, x, k, tables, links, parameters, o, steps, own, dt, amplitude * record[i], now)
            for c in range(STATE_FLOATS):
                lx[active, c] = x[c]
            for c in range(STATE_INTEGERS):
                lk[active, c] = k[c]
            active += 1
            joined += 1
        if store:
            _fetch_lane(s, 0, lx, lk, now, x, k)
            _store(history, i, x, k, tables, links, lane_o[0])
        if i == n - 1:
            break
        force = record[i]
        rise = record[i + 1] - force
        padded = (active + 7) // 8 * 8
        marked = _step_even(s, padded, force, rise) if now == ROW_EVEN else _step_odd(s, padded, force, rise)
        if marked > 0 and _look(
            s,
            active,
            lx,
            lk,
            lane_o,
            tables,
            links,
            parameters,
            steps,
            own,
            dt,
            i,
            force,
            rise,
            now,
            after,
            x,
            k,
            poly,
            trig,
            turns,
        ):
            lane = 0
            while lane < active:
                if lk[lane, OVERTURNED] == 0:
                    lane += 1
                    continue
                _fetch_lane(s, lane, lx, lk, after, x, k)
                _write_result(out, lane_run[lane], x, k)
                found = k[TURNS]
                if store:
                    _store_fallen(history, i + 1, x)
                active -= 1
                for row in range(LANE_ROWS):
                    s[row * LANES + lane] = s[row * LANES + active]
                for c in range(STATE_FLOATS):
                    lx[lane, c] = lx[active, c]
                for c in range(STATE_INTEGERS):
                    lk[lane, c] = lk[active, c]
                for c in range(7):
                    own[lane, c] = own[active, c]
                lane_o[lane] = lane_o[active]
                lane_run[lane] = lane_run[active]
                _clear_lane(s, active)
            if active == 0 and joined == runs.shape[0]:
                return found
        now, after = after, now
    for lane in range(active):
        _fetch_lane(s, lane, lx, lk, now, x, k)
        found = k[TURNS]
        _free(x, k, tables, links, parameters, lane_o[lane], (n - 1) * dt, poly, trig, no_turns)
        _write_result(out, lane_run[lane], x, k)
    return found


@njit(**_DRIVER)
def _run_exact(record, dt, tables, links, parameters, runs, which, factors, first, begin, out, turns, history):
    """Runs in exact geometry, one after the other: every sample of a moving block is solved by its own series."""
    x = np.empty(STATE_FLOATS)
    k = np.empty(STATE_INTEGERS, np.int64)
    poly = np.empty((3, DEGREE + 1))
    trig = np.empty((3, DEGREE + 1))
    no_turns = np.empty((2, 0))
    n = record.shape[0]
    store = history.shape[1] == n
    found = 0
    for r in range(runs.shape[0]):
        j = runs[r]
        o = which[j]
        _reset(x, k, begin[j, 0], begin[j, 1], begin[j, 2], int(begin[j, 3]), int(parameters[o, PAR_START]))
        amplitude = -parameters[o, PAR_GAIN] * factors[j]
        right = parameters[o, PAR_UPLIFT_RIGHT]
        left = -parameters[o, PAR_UPLIFT_LEFT]
        for i in range(first[j], n):
            if store:
                _store(history, i, x, k, tables, links, o)
            if i == n - 1:
                break
            force = amplitude * record[i]
            end = amplitude * record[i + 1]
            if k[NOW] == REST and max(force, end) <= right and min(force, end) >= left:
                continue
            _sample(x, k, tables, links, parameters, o, force, (end - force) / dt, dt, i * dt, poly, trig, turns)
            if k[OVERTURNED] != 0:
                if store:
                    _store_fallen(history, i + 1, x)
                break
        found = k[TURNS]
        if k[OVERTURNED] == 0:
            _free(x, k, tables, links, parameters, o, (n - 1) * dt, poly, trig, no_turns)
        _write_result(out, j, x, k)
    return found


@njit(**_DRIVER)
def _unit_response(record, dt, tables, links, parameters, steps, o, unit):
    """The response of oscillator o to the record as it is until its first uplift, into unit (5, n); its peak for good.

    An elastic block: its zone's linear response, as if the zone had no edges; at scale factor f it is f times this. A
    block that rests rigidly: the running maximum of the record alone, in the row of peaks.
    """
    zone = int(parameters[o, PAR_START])
    if zone == REST:
        high = 0.0
        for i in range(record.shape[0]):
            high = max(high, abs(record[i]))
            unit[HISTORY_PEAK, i] = high
        return 0.0
    lower = tables[o, zone, REGION_LOWER]
    upper = tables[o, zone, REGION_UPPER]
    tables[o, zone, REGION_LOWER] = -math.inf
    tables[o, zone, REGION_UPPER] = math.inf
    begin = np.zeros((1, 4))
    begin[0, 3] = zone
    which = np.full(1, o)
    factors = np.ones(1)
    runs = np.zeros(1, np.int64)
    out = np.empty((1, OUT_COLUMNS))
    _run_lanes(
        record, dt, tables, links, parameters, steps, runs, which, factors, runs, begin, out, np.empty((2, 0)), unit
    )
    tables[o, zone, REGION_LOWER] = lower
    tables[o, zone, REGION_UPPER] = upper
    return out[0, OUT_PEAK]


@njit(**_DRIVER)
def run_batch(record, dt, tables, links, parameters, which, factors, start, skip, out, turning_points, history):
    """Runs of oscillators which[j] under factors[j] * record; returns the turning points of the last one.

    record (n,) m/s²; tables (o, r, 6), links (o, r, 9), parameters (o, 10); which, factors (m,), sorted by oscillator;
    start (theta, omega, region) or empty for all at rest; out (m, 5) is filled; turning_points (2, t) and history
    (5, n or 0) store a single run's. skip: leave out what is known before the first uplift.
    """
    n = record.shape[0]
    m = which.shape[0]
    steps = np.zeros((tables.shape[0], tables.shape[1], 7))
    _prepare(steps, tables, links, parameters, dt)
    # where each run begins: its first sample, and theta, omega, peak and region there
    first = np.zeros(m, np.int64)
    begin = np.zeros((m, 4))
    unit = np.zeros((HISTORY_ROWS, n if skip else 0))
    unit_peak = 0.0
    current = -1
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
            first[j] = max(_first_rise(unit[HISTORY_PEAK], level) - 1, 0)
            if zone != REST:
                begin[j, 0] = factors[j] * unit[HISTORY_THETA, first[j]]
                begin[j, 1] = factors[j] * unit[HISTORY_OMEGA, first[j]]
                begin[j, 2] = abs(factors[j]) * unit[HISTORY_PEAK, first[j]]
            if first[j] == n - 1 and unit_peak < level:
                out[j, OUT_OVERTURNED] = 0.0
                out[j, OUT_PEAK] = abs(factors[j]) * unit_peak
                out[j, OUT_UPLIFTED] = 0.0
                out[j, OUT_IMPACTS] = 0.0
                out[j, OUT_OVERTURN_TIME] = math.nan
                continue
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
            out,
            turning_points,
            history,
        )
    order = linear[:linear_runs][np.argsort(first[linear[:linear_runs]], kind="mergesort")]
    for j in range(0, linear_runs, LANES):
        turns = _run_lanes(
            record,
            dt,
            tables,
            links,
            parameters,
            steps,
            order[j : j + LANES],
            which,
            factors,
            first,
            begin,
            out,
            turning_points,
            history,
        )
    return turns
