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

All functions called by a kernel stand in this file: numba's disk cache looks at one file only.
"""

import math

import numpy as np
from numba import njit

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
RULE_CONSTANT, RULE_ENTRY_SPEED, RULE_ENERGY, RULE_IMPACT = range(4)

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
HISTORY_THETA, HISTORY_OMEGA, HISTORY_REGION, HISTORY_DAMPING = range(4)
HISTORY_ROWS = 4

DEGREE = 30
EPSILON = 2.220446049250313e-16
FLAT = 0.5 * math.pi
# Beyond this many impacts in one sample a bounce is far below 1e-12 alpha, and the block is put to rest: reached only
# for e = 1 (to rounding), where the accumulation of impacts takes for ever.
MAX_IMPACTS_PER_SAMPLE = 10_000
MAX_FREE_PIECES = 100_000
FREE_STEP = 1e9  # s: longer than any piece


@njit(cache=True, nogil=True)
def _value(y, n, t):
    """Displacement since the start of the piece, sum y_k t^k for k = 1..n."""
    s = y[n]
    for k in range(n - 1, 0, -1):
        s = s * t + y[k]
    return s * t


@njit(cache=True, nogil=True)
def _slope(y, n, t, m):
    """Velocity divided by t^(m-1): sum k y_k t^(k-m) for k = m..n (y_1..y_(m-1) vanish)."""
    s = n * y[n]
    for k in range(n - 1, m - 1, -1):
        s = s * t + k * y[k]
    return s


@njit(cache=True, nogil=True)
def _curvature(y, n, t):
    """Acceleration, sum k (k-1) y_k t^(k-2)."""
    s = n * (n - 1) * y[n]
    for k in range(n - 1, 1, -1):
        s = s * t + k * (k - 1) * y[k]
    return s


@njit(cache=True, nogil=True)
def _linear_series(y, acceleration, omega, c, stiffness, slope, h):
    """Fill y with the local solution's Taylor coefficients; return the degree that rounding asks for up to h.

    y'' + c y' + K y = a0' + slope t about the current state, hence k (k-1) y_k = -c (k-1) y_(k-1) - K y_(k-2).
    """
    y[1] = omega
    y[2] = 0.5 * acceleration
    y[3] = (slope - c * acceleration - stiffness * omega) / 6.0
    power = h * h * h
    scale = max(abs(omega) * h, abs(y[2]) * h * h, abs(y[3]) * power)
    before = 1.0
    for k in range(4, DEGREE + 1):
        y[k] = -(c * (k - 1) * y[k - 1] + stiffness * y[k - 2]) / (k * (k - 1))
        power *= h
        term = k * abs(y[k]) * power
        if term <= 1e-18 * scale and before <= 1e-18 * scale:
            return k
        before = term
    return DEGREE


@njit(cache=True, nogil=True)
def _exact_series(y, sine, cosine, theta, omega, p2, tilt, force, slope, h):
    """Taylor coefficients of x'' = -p² sin(tilt - x) + (force + slope t) cos(tilt - x)/cos(tilt), and a safe step.

    sin and cos of the running angle by their product recurrences.  The step returned (<= h) keeps the neglected terms
    below 1e-17 of the largest kept one and holds at most one zero of the acceleration: proved by a bound on the terms
    of the acceleration, or of the jerk, that follow the first.
    """
    sine[0] = math.sin(tilt - theta)
    cosine[0] = math.cos(tilt - theta)
    scale = 1.0 / math.cos(tilt)
    y[1] = omega
    a = -p2 * sine[0] + force * cosine[0] * scale
    if omega == 0.0 and abs(a) <= 2.0 * EPSILON * (p2 * abs(sine[0]) + abs(force * cosine[0] * scale)):
        a = 0.0
    y[2] = 0.5 * a
    largest = max(abs(omega) * h, abs(y[2]) * h * h)
    power = h * h
    before = 1.0
    n = DEGREE
    for k in range(1, DEGREE - 1):
        s = 0.0
        c = 0.0
        for j in range(1, k + 1):
            s -= j * y[j] * cosine[k - j]
            c += j * y[j] * sine[k - j]
        sine[k] = s / k
        cosine[k] = c / k
        forced = (force * cosine[k] + slope * cosine[k - 1]) * scale
        y[k + 2] = (-p2 * sine[k] + forced) / ((k + 2) * (k + 1))
        power *= h
        term = (k + 2) * abs(y[k + 2]) * power
        if k == 1:
            largest = max(largest, term)
        elif term <= 1e-17 * largest and before <= 1e-17 * largest:
            n = k + 2
            break
        before = term
    if n == DEGREE:
        while (
            n * abs(y[n]) * h**n > 1e-17 * largest or (n - 1) * abs(y[n - 1]) * h ** (n - 1) > 1e-17 * largest
        ) and h > 1e-12:
            h *= 0.7
            largest = max(abs(omega) * h, abs(y[2]) * h * h, 3.0 * abs(y[3]) * h * h * h)
    for _ in range(40):
        of_a = 0.0
        of_jerk = 0.0
        power = h
        for k in range(3, n + 1):
            term = k * (k - 1) * abs(y[k]) * power
            of_a += term
            if k > 3:
                of_jerk += (k - 2) * term / h
            power *= h
        if 2.0 * abs(y[2]) > of_a or 6.0 * abs(y[3]) > of_jerk:
            break
        if y[1] == 0.0 and y[2] == 0.0 and y[3] == 0.0:
            break
        h *= 0.5
    return n, h


@njit(cache=True, nogil=True)
def _root_of_slope(y, n, m, left, right):
    """The zero of the velocity in (left, right), where it changes sign once."""
    start = _slope(y, n, left, m)
    t = right
    end = _slope(y, n, right, m)
    if end != start:
        t = left + (right - left) * start / (start - end)
    for _ in range(100):
        f = _slope(y, n, t, m)
        if f == 0.0:
            return t
        if (f > 0.0) == (start > 0.0):
            left = t
        else:
            right = t
        # d/dt of velocity / t^(m-1); the last factor keeps it exact for every m
        d = 0.0
        for k in range(n, m, -1):
            d = d * t + k * (k - m) * y[k]
        new = t - f / d if d != 0.0 else left
        if not (left < new < right):
            new = 0.5 * (left + right)
        if abs(new - t) <= 2e-16 * abs(t) or new in (left, right):
            return new
        t = new
    return t


@njit(cache=True, nogil=True)
def _root_of_curvature(y, n, left, right):
    """The zero of the acceleration in (left, right), where it changes sign once."""
    start = _curvature(y, n, left)
    for _ in range(60):
        t = 0.5 * (left + right)
        f = _curvature(y, n, t)
        if f == 0.0:
            return t
        if (f > 0.0) == (start > 0.0):
            left = t
        else:
            right = t
        if right - left <= 1e-15 * right:
            break
    return 0.5 * (left + right)


@njit(cache=True, nogil=True)
def _root_of_value(y, n, gap, right):
    """The time in (0, right] at which the displacement reaches gap; it is monotone there."""
    left = 0.0
    discriminant = y[1] * y[1] + 4.0 * y[2] * gap
    t = 0.5 * right
    if discriminant >= 0.0:
        root = math.sqrt(discriminant)
        denominator = y[1] + root if gap > 0.0 else y[1] - root
        if denominator != 0.0:
            guess = 2.0 * gap / denominator
            if 0.0 < guess < right:
                t = guess
    for _ in range(100):
        f = _value(y, n, t) - gap
        if f == 0.0:
            return t
        if (f > 0.0) == (gap > 0.0):
            right = t
        else:
            left = t
        d = _slope(y, n, t, 1)
        new = t - f / d if d != 0.0 else left
        if not (left < new < right):
            new = 0.5 * (left + right)
        if abs(new - t) <= 2e-16 * abs(t) or new in (left, right):
            return new
        t = new
    return t


NO_EVENT, TURN, AT_LOWER, AT_UPPER = range(4)


@njit(cache=True, nogil=True)
def _first_event(y, n, h, theta, lower, upper):
    """Kind and time of the first event in (0, h] of a piece whose acceleration has at most one zero."""
    m = 1
    while m < 4 and y[m] == 0.0:
        m += 1
    if m == 4:
        return NO_EVENT, h  # an equilibrium under constant forcing
    direction = 1.0 if y[m] > 0.0 else -1.0
    turn = -1.0
    final = _slope(y, n, h, 1) * direction
    if final < 0.0:
        turn = _root_of_slope(y, n, m, 0.0, h)
    elif m == 1 and y[2] * direction < 0.0 and _curvature(y, n, h) * direction > 0.0:
        # The velocity dips towards zero and recovers: look at its extremum.
        lowest = _root_of_curvature(y, n, 0.0, h)
        if _slope(y, n, lowest, 1) * direction < 0.0:
            turn = _root_of_slope(y, n, 1, 0.0, lowest)
    end = turn if turn >= 0.0 else h
    gap = upper - theta if direction > 0.0 else lower - theta
    if gap * direction <= 0.0:
        return (AT_UPPER if direction > 0.0 else AT_LOWER), 0.0
    if _value(y, n, end) * direction >= gap * direction:
        return (AT_UPPER if direction > 0.0 else AT_LOWER), _root_of_value(y, n, gap, end)
    if turn >= 0.0:
        return TURN, turn
    return NO_EVENT, h


@njit(cache=True, nogil=True)
def _crossing(zeta, speed):
    """Squared speed at +1 of z'' + 2 zeta z' + z = 0 from -1 with `speed`; minus the potential it lacks if it turns."""
    gap = 1.0 - zeta * zeta
    drift = zeta * speed - 1.0
    if gap > 0.0:
        w = math.sqrt(gap)
        turn = math.atan2(speed * w, drift) / w
    else:
        w = math.sqrt(-gap)
        if drift <= 0.0 or speed * w >= drift:
            return -1.0
        turn = math.atanh(speed * w / drift) / w if w > 0.0 else speed / drift
    left = 0.0
    right = turn
    t = turn
    top = 0.0
    for i in range(100):
        decay = math.exp(-zeta * t)
        if gap > 0.0:
            c = math.cos(w * t)
            s = math.sin(w * t) / w
        elif w > 0.0:
            c = math.cosh(w * t)
            s = math.sinh(w * t) / w
        else:
            c = 1.0
            s = t
        z = decay * (-c + (speed - zeta) * s)
        v = decay * (speed * c - drift * s)
        if i == 0:
            top = z
            if top <= 1.0:
                return top * top - 1.0 if top > 0.0 else -1.0
            t = min(2.0 / speed, 0.5 * turn)
            continue
        f = z - 1.0
        if f > 0.0:
            right = t
        else:
            left = t
        new = t - f / v if v > 0.0 else right
        if not (left < new < right):
            new = 0.5 * (left + right)
        if abs(new - t) <= 4e-16 * t or new in (left, right):
            return v * v
        t = new
    return v * v


@njit(cache=True, nogil=True)
def energy_consistent_zeta(speed, exit_speed):
    """Damping ratio with which a crossing from -1 at `speed` leaves +1 at `exit_speed` (unit frequency, unforced).

    The exit speed falls strictly with the ratio, so a bracketed secant (Illinois) finds it to rounding.
    """
    target = exit_speed * exit_speed
    start = speed * speed
    if target >= start:
        return 0.0
    # First guess (physics: loss over the undamped path), from S = speed + (v0²) asin(1/v0) in these units.
    v0 = math.sqrt(start + 1.0)
    path = speed + v0 * v0 * math.asin(1.0 / v0)
    low = 0.0
    f_low = start - target
    high = 0.25 * (path - math.sqrt(max(0.0, path * path - 4.0 * (start - target))))
    f_high = _crossing(high, speed) - target
    while f_high > 0.0:
        low = high
        f_low = f_high
        high *= 1.5
        f_high = _crossing(high, speed) - target
    side = 0
    zeta = high
    for _ in range(200):
        zeta = (low * f_high - high * f_low) / (f_high - f_low)
        if not (low < zeta < high):
            zeta = 0.5 * (low + high)
        f = _crossing(zeta, speed) - target
        if f > 0.0:
            low = zeta
            f_low = f
            if side == 1:
                f_high *= 0.5
            side = 1
        elif f < 0.0:
            high = zeta
            f_high = f
            if side == -1:
                f_low *= 0.5
            side = -1
        else:
            return zeta
        if high - low <= 4e-16 * high or abs(f) <= 1e-16 * start:
            return zeta
    return zeta


@njit(cache=True, nogil=True)
def _potential(table, region, exact, theta):
    """Potential energy per unit inertia at theta, as continued from `region`."""
    stiffness = table[region, REGION_STIFFNESS]
    offset = table[region, REGION_OFFSET]
    if exact:
        tilt = offset / stiffness
        return -stiffness * (math.cos(tilt - theta) - math.cos(tilt)) + table[region, REGION_POTENTIAL]
    return (0.5 * stiffness * theta - offset) * theta + table[region, REGION_POTENTIAL]


@njit(cache=True, nogil=True)
def _held_damping(table, par, zone, omega):
    """Damping of the zone from this inward crossing to the next, by the oscillator's rule (per unit inertia, 1/s)."""
    rule = int(par[PAR_RULE])
    speed = abs(omega)
    if rule == RULE_ENTRY_SPEED:
        return par[PAR_COEFFICIENT] * speed
    if rule == RULE_ENERGY:
        e = par[PAR_RESTITUTION]
        if e == 1.0:
            return 0.0
        half = 0.5 * (table[zone, REGION_UPPER] - table[zone, REGION_LOWER])
        frequency = math.sqrt(table[zone, REGION_STIFFNESS])
        unit = 1.0 / (half * frequency)
        # PAR_COEFFICIENT: potential at the zone's edge, so that exit² = e² entry² - 2 (1 - e²) U
        squared = e * e * speed * speed - 2.0 * (1.0 - e * e) * par[PAR_COEFFICIENT]
        if squared > 0.0:
            return 2.0 * frequency * energy_consistent_zeta(speed * unit, math.sqrt(squared) * unit)
        # It just stops at the far edge.  A hair more damping turns it inside: on the edge itself rounding would decide
        # whether another crossing, with another damping, follows.
        zeta = energy_consistent_zeta(speed * unit, 0.0)
        return 2.0 * frequency * (zeta * (1.0 + 1e-13) + 1e-13)
    return table[zone, REGION_DAMPING]


@njit(cache=True, nogil=True)
def _settles(par, omega, stiffness, force, slope, left, peak):
    """Whether all later bounces provably end before the sample does, or before its forcing reaches the threshold.

    With a_min the least deceleration over a horizon, the bounces that follow take 2|omega|/((1 - e) a_min) in all and
    rise to omega²/(2 a_min), which must not exceed the peak so far.  A tenth of a_min is kept for the softening
    |K| x of the branch, which stays below 1 % of a_min within a horizon of half its time constant.
    """
    if omega == 0.0:
        return True
    e = par[PAR_RESTITUTION]
    if e >= 1.0:
        return False
    horizon = min(left, 0.5 / math.sqrt(-stiffness))
    end = force + slope * horizon
    # Where the threshold is exceeded later in this sample, half the time until then is the horizon.
    if end > par[PAR_UPLIFT_RIGHT] and slope > 0.0:
        horizon = 0.5 * (par[PAR_UPLIFT_RIGHT] - force) / slope
    elif end < -par[PAR_UPLIFT_LEFT] and slope < 0.0:
        horizon = 0.5 * (-par[PAR_UPLIFT_LEFT] - force) / slope
    end = force + slope * horizon
    a_min = 0.9 * min(par[PAR_UPLIFT_RIGHT] - max(force, end), par[PAR_UPLIFT_LEFT] + min(force, end))
    return a_min > 0.0 and 2.0 * abs(omega) <= (1.0 - e) * a_min * horizon and omega * omega <= 2.0 * a_min * peak


@njit(cache=True, nogil=True)
def _uplift(par, x, k, force, slope, left):
    """From rest: the time until the forcing exceeds the threshold (left if it does not) and the forcing there.

    Forcing that is at the threshold to rounding lifts the block only if it grows.
    """
    right = par[PAR_UPLIFT_RIGHT]
    leftward = -par[PAR_UPLIFT_LEFT]
    end = force + slope * left
    t = 0.0
    if force > right * (1.0 + 4.0 * EPSILON) or force < leftward * (1.0 + 4.0 * EPSILON):
        pass
    elif end > right * (1.0 + 4.0 * EPSILON) and slope > 0.0:
        t = max(right - force, 0.0) / slope
        force = right
    elif end < leftward * (1.0 + 4.0 * EPSILON) and slope < 0.0:
        t = min(leftward - force, 0.0) / slope
        force = leftward
    else:
        return left, force
    k[NOW] = int(par[PAR_REST_RIGHT]) if force > 0.0 else int(par[PAR_REST_LEFT])
    k[UPLIFTED] = 1
    x[THETA] = 0.0
    x[OMEGA] = 0.0
    return min(t, left), force


@njit(cache=True, nogil=True)
def _record_turn(x, k, table, links, exact, region, time, turning_points):
    """A turning point: the peak, the list of peaks, and the region that takes over where one does."""
    theta = x[THETA]
    x[PEAK] = max(x[PEAK], abs(theta))
    if k[TURNS] < turning_points.shape[1]:
        turning_points[0, k[TURNS]] = time
        turning_points[1, k[TURNS]] = theta
    k[TURNS] += 1
    target = links[region, LINK_TURN_RIGHT] if theta >= 0.0 else links[region, LINK_TURN_LEFT]
    if target != NO_REGION:
        # Same energy on the branch that takes over: U(theta') = U(theta), the root next to zero.
        energy = _potential(table, region, exact, theta) - table[target, REGION_POTENTIAL]
        stiffness = table[target, REGION_STIFFNESS]
        offset = table[target, REGION_OFFSET]
        root = math.sqrt(max(0.0, offset * offset + 2.0 * stiffness * energy))
        x[THETA] = -2.0 * energy / (offset + (root if offset > 0.0 else -root))
        k[NOW] = target


@njit(cache=True, nogil=True)
def _at_edge(x, k, table, links, par, region, upper, force, slope, left, time):
    """What happens where the rotation reaches an edge of its region."""
    if upper:
        action = links[region, LINK_UPPER_ACTION]
        target = links[region, LINK_UPPER_TARGET]
        other = links[region, LINK_UPPER_OTHER]
    else:
        action = links[region, LINK_LOWER_ACTION]
        target = links[region, LINK_LOWER_TARGET]
        other = links[region, LINK_LOWER_OTHER]
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
            e = par[PAR_RESTITUTION]
            potential = _potential(table, region, False, x[THETA])
            if e * e * (0.5 * x[OMEGA] * x[OMEGA] + potential) <= potential:
                k[NOW] = other
                return
        k[IMPACTS] += 1
        x[HELD] = _held_damping(table, par, target, x[OMEGA])
    else:
        k[IMPACTS] += 1
        x[OMEGA] *= par[PAR_RESTITUTION]
        stiffness = table[region, REGION_STIFFNESS]
        if k[FREE] == 0 and _settles(par, x[OMEGA], stiffness, force, slope, left, x[PEAK]):
            x[OMEGA] = 0.0
            k[NOW] = REST


@njit(cache=True, nogil=True)
def _piece(x, k, table, links, par, force, slope, left, time, work, turning_points):
    """One piece: from the state to its first event, or to the end of the step; the time it took."""
    waited = 0.0
    if k[NOW] == REST:
        waited, force = _uplift(par, x, k, force, slope, left)
        if k[NOW] == REST:
            return left
        left -= waited
    region = k[NOW]
    theta = x[THETA]
    omega = x[OMEGA]
    stiffness = table[region, REGION_STIFFNESS]
    offset = table[region, REGION_OFFSET]
    y = work[0]
    exact = par[PAR_EXACT] != 0.0
    if exact:
        h = min(left, 0.5 / math.sqrt(-stiffness))
        n, h = _exact_series(y, work[1], work[2], theta, omega, -stiffness, offset / stiffness, force, slope, h)
    else:
        c = x[HELD] if links[region, LINK_HELD] else table[region, REGION_DAMPING]
        h = min(left, 0.5 / max(math.sqrt(abs(stiffness)), c))
        a = force + offset - stiffness * theta
        if omega == 0.0 and abs(a) <= 2.0 * EPSILON * (abs(force) + abs(offset) + abs(stiffness * theta)):
            a = 0.0  # the sign of what is left is rounding; the slope of the forcing decides
        n = _linear_series(y, a - c * omega, omega, c, stiffness, slope, h)
    kind, t = _first_event(y, n, h, theta, table[region, REGION_LOWER], table[region, REGION_UPPER])
    if kind == NO_EVENT:
        x[THETA] = theta + _value(y, n, t)
        x[OMEGA] = _slope(y, n, t, 1)
        if h == left:
            return waited + left
        return waited + t
    now = time + waited + t
    if kind == TURN:
        x[THETA] = theta + _value(y, n, t)
        x[OMEGA] = 0.0
        _record_turn(x, k, table, links, exact, region, now, turning_points)
        return waited + t
    speed = _slope(y, n, t, 1)
    upper = kind == AT_UPPER
    x[THETA] = table[region, REGION_UPPER] if upper else table[region, REGION_LOWER]
    x[OMEGA] = max(speed, 0.0) if upper else min(speed, 0.0)
    _at_edge(x, k, table, links, par, region, upper, force + slope * t, slope, left - t, now)
    return waited + t


@njit(cache=True, nogil=True)
def _sample(x, k, table, links, par, force, slope, dt, time, work, turning_points):
    """One sample, cut at its events."""
    t = 0.0
    impacts = k[IMPACTS]
    while t < dt and k[OVERTURNED] == 0:
        t += _piece(x, k, table, links, par, force + slope * t, slope, dt - t, time + t, work, turning_points)
        if k[IMPACTS] - impacts > MAX_IMPACTS_PER_SAMPLE and int(par[PAR_START]) == REST:
            x[THETA] = 0.0
            x[OMEGA] = 0.0
            k[NOW] = REST
            impacts = k[IMPACTS]


@njit(cache=True, nogil=True)
def _saddle_passed(x, k, table, links, par):
    """Whether the unforced block is beyond the saddle of its region, or sure to pass it.

    Along the saddle's stable direction a damped branch decays with c/2 + sqrt(c²/4 + |K|), so
    omega + rate (|x| - saddle) > 0 never comes back; on the exact branch omega + 2 p sin((|x| - alpha)/2) > 0.
    """
    region = k[NOW]
    stiffness = table[region, REGION_STIFFNESS]
    if stiffness >= 0.0:
        return False
    saddle = table[region, REGION_OFFSET] / stiffness
    side = 1.0 if saddle > 0.0 else -1.0
    beyond = side * (x[THETA] - saddle)
    if par[PAR_EXACT] != 0.0:
        return side * x[OMEGA] + 2.0 * math.sqrt(-stiffness) * math.sin(0.5 * beyond) > 0.0
    half = 0.5 * table[region, REGION_DAMPING]
    if links[region, LINK_HELD]:
        half = 0.5 * x[HELD]
    return side * x[OMEGA] + (half + math.sqrt(half * half - stiffness)) * beyond > 0.0


@njit(cache=True, nogil=True)
def _free(x, k, table, links, par, time, work, turning_points):
    """After the record: on until overturned, at rest, or sure never to exceed the peak again.

    Free motion loses energy, so two turning points in a row (one a side) bound all that follow; inside a zone with a
    stable centre the energy itself does.
    """
    turns = k[TURNS]
    impacts = k[IMPACTS]
    k[FREE] = 1
    passed = False
    for _ in range(MAX_FREE_PIECES):
        if k[OVERTURNED] != 0 or k[NOW] == REST or k[TURNS] - turns >= 2:
            break
        region = k[NOW]
        stiffness = table[region, REGION_STIFFNESS]
        if not passed:
            passed = _saddle_passed(x, k, table, links, par)
        if stiffness > 0.0:
            centre = table[region, REGION_OFFSET] / stiffness
            reach = math.sqrt((x[THETA] - centre) ** 2 + x[OMEGA] ** 2 / stiffness)
            inside = min(table[region, REGION_UPPER] - centre, centre - table[region, REGION_LOWER])
            if reach < inside and reach + abs(centre) <= x[PEAK]:
                break
        if x[OMEGA] == 0.0 and x[THETA] == table[region, REGION_OFFSET] / stiffness:
            break
        time += _piece(x, k, table, links, par, 0.0, 0.0, FREE_STEP, time, work, turning_points)
        if passed and k[NOW] != region:
            break  # rounding on the separatrix itself: the proof stands
    k[IMPACTS] = impacts  # counted during the record only
    if passed and k[OVERTURNED] == 0:
        k[OVERTURNED] = 1
        x[PEAK] = FLAT
        x[OVERTURN_TIME] = time


@njit(cache=True, nogil=True)
def _propagator(row, stiffness, c, h):
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
    for k in range(2, 40):
        new = -(c * (k - 1) * b + stiffness * before) / (k * (k - 1))
        before = b
        b = new
        power *= h
        g0 += k * b * power
        g1 += b * power * h
        g2 += b * power * h * h / (k + 1)
        g3 += b * power * h * h * h / ((k + 1) * (k + 2))
        if k * (abs(b) + abs(before) * h) * power < 1e-19:
            break
    row[0] = g0
    row[1] = g1
    row[2] = g2
    row[3] = g3 / h
    row[4] = g2 / h


@njit(cache=True, nogil=True)
def _shake(x, k, table, links, par, step, record, factor, dt, first, work, turning_points, history):
    """All samples from `first` on.  step: a propagator per region, valid where its last column is 1."""
    n = record.shape[0]
    store = history.shape[1] == n
    all_turns = turning_points.shape[1] > 0
    amplitude = -par[PAR_GAIN] * factor
    linear = par[PAR_EXACT] == 0.0
    for i in range(first, n):
        if store:
            region = k[NOW]
            history[HISTORY_THETA, i] = x[THETA]
            history[HISTORY_OMEGA, i] = x[OMEGA]
            history[HISTORY_REGION, i] = region
            history[HISTORY_DAMPING, i] = 0.0
            if region != REST:
                held = links[region, LINK_HELD] != 0
                history[HISTORY_DAMPING, i] = x[HELD] if held else table[region, REGION_DAMPING]
        if i == n - 1:
            break
        force = amplitude * record[i]
        end = amplitude * record[i + 1]
        region = k[NOW]
        if region == REST:
            if max(force, end) <= par[PAR_UPLIFT_RIGHT] and min(force, end) >= -par[PAR_UPLIFT_LEFT]:
                continue
        elif linear:
            c = table[region, REGION_DAMPING]
            if links[region, LINK_HELD]:
                c = x[HELD]
                if c != step[region, 5]:
                    step[region, 5] = c
                    fits = dt * max(math.sqrt(abs(table[region, REGION_STIFFNESS])), c) <= 0.5
                    step[region, 6] = 1.0 if fits else 0.0
                    if fits:
                        _propagator(step[region], table[region, REGION_STIFFNESS], c, dt)
            if step[region, 6] == 1.0:
                theta = x[THETA]
                omega = x[OMEGA]
                stiffness = table[region, REGION_STIFFNESS]
                offset = table[region, REGION_OFFSET]
                a = offset + force - stiffness * theta
                rise = end - force
                theta_end = theta + (omega * step[region, 1] + a * step[region, 2] + rise * step[region, 3])
                omega_end = omega + (omega * step[region, 0] + a * step[region, 1] + rise * step[region, 4])
                a_start = a - c * omega
                a_end = offset + end - stiffness * theta_end - c * omega_end
                if omega > 0.0 and omega_end > 0.0:
                    clear = theta_end < table[region, REGION_UPPER] and not (a_start < 0.0 and a_end > 0.0)
                elif omega < 0.0 and omega_end < 0.0:
                    clear = theta_end > table[region, REGION_LOWER] and not (a_start > 0.0 and a_end < 0.0)
                elif all_turns or links[region, LINK_TURN_RIGHT] != NO_REGION or omega == 0.0 or omega_end == 0.0:
                    clear = False
                else:
                    # One turn, whose excursion is bounded by the speed at either end: below the peak it is no news.
                    reach = min(abs(omega), abs(omega_end)) * dt
                    top = max(theta, theta_end) + reach
                    bottom = min(theta, theta_end) - reach
                    clear = (
                        a_start * a_end > 0.0
                        and top < table[region, REGION_UPPER]
                        and bottom > table[region, REGION_LOWER]
                        and top <= x[PEAK]
                        and -bottom <= x[PEAK]
                    )
                if clear:
                    x[THETA] = theta_end
                    x[OMEGA] = omega_end
                    continue
        _sample(x, k, table, links, par, force, (end - force) / dt, dt, i * dt, work, turning_points)
        if k[OVERTURNED] != 0:
            if store:
                for j in range(i + 1, n):
                    history[HISTORY_THETA, j] = math.copysign(FLAT, x[THETA])
                    history[HISTORY_OMEGA, j] = 0.0
                    history[HISTORY_REGION, j] = REST
                    history[HISTORY_DAMPING, j] = 0.0
            return


@njit(cache=True, nogil=True)
def _reset(x, k, theta, omega, region):
    x[THETA] = theta
    x[OMEGA] = omega
    x[HELD] = 0.0
    x[PEAK] = abs(theta)
    x[OVERTURN_TIME] = math.nan
    k[:] = 0
    k[NOW] = region


@njit(cache=True, nogil=True)
def _prepare(step, table, links, par, dt):
    """A propagator per region for its constant (held: zero) damping; the last column says whether a sample is one."""
    for r in range(table.shape[0]):
        stiffness = table[r, REGION_STIFFNESS]
        c = 0.0 if links[r, LINK_HELD] else table[r, REGION_DAMPING]
        step[r, 5] = c
        step[r, 6] = 0.0
        if par[PAR_EXACT] == 0.0 and dt * max(math.sqrt(abs(stiffness)), c) <= 0.5:
            step[r, 6] = 1.0
            _propagator(step[r], stiffness, c, dt)


@njit(cache=True, nogil=True)
def _unit_response(x, k, table, links, par, step, record, dt, work, turning_points, history, unit):
    """The zone's linear response to the record as it is, as if the zone had no edges: rows theta, omega, running peak.

    Until its first uplift an elastic block at scale factor f is f times this response. Returns the peak over all time.
    """
    zone = int(par[PAR_START])
    lower = table[zone, REGION_LOWER]
    upper = table[zone, REGION_UPPER]
    table[zone, REGION_LOWER] = -math.inf
    table[zone, REGION_UPPER] = math.inf
    _reset(x, k, 0.0, 0.0, zone)
    n = record.shape[0]
    for i in range(n):
        unit[0, i] = x[THETA]
        unit[1, i] = x[OMEGA]
        unit[2, i] = max(x[PEAK], abs(x[THETA]))
        if i < n - 1:
            _shake(x, k, table, links, par, step, record[i : i + 2], 1.0, dt, 0, work, turning_points, history)
    _free(x, k, table, links, par, (n - 1) * dt, work, turning_points)
    table[zone, REGION_LOWER] = lower
    table[zone, REGION_UPPER] = upper
    return x[PEAK]


@njit(cache=True, nogil=True)
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


@njit(cache=True, nogil=True)
def run_batch(record, dt, tables, links, parameters, which, factors, start, skip, out, turning_points, history):
    """Runs of oscillators which[j] under factors[j] * record; returns the turning points of the last one.

    record (n,) m/s²; tables (o, r, 6), links (o, r, 9), parameters (o, 10); which, factors (m,), best sorted by
    oscillator; start (theta, omega, region) or empty for all at rest; out (m, 5) is filled; turning_points (2, t) and
    history (4, n or 0) store the last run's. skip: leave out what is known before the first uplift.
    """
    n = record.shape[0]
    x = np.empty(STATE_FLOATS)
    k = np.empty(STATE_INTEGERS, np.int64)
    work = np.empty((3, DEGREE + 1))
    step = np.empty((tables.shape[1], 7))
    unit = np.zeros((3, n if skip else 0))
    unit_peak = 0.0
    no_turns = np.empty((2, 0))
    no_history = np.empty((HISTORY_ROWS, 0))
    current = -1
    for j in range(which.shape[0]):
        o = which[j]
        table = tables[o]
        link = links[o]
        par = parameters[o]
        factor = factors[j]
        if o != current:
            current = o
            _prepare(step, table, link, par, dt)
            if skip:
                if int(par[PAR_START]) == REST:
                    high = 0.0
                    for i in range(n):
                        high = max(high, abs(record[i]))
                        unit[2, i] = high
                    unit_peak = 0.0
                else:
                    unit_peak = _unit_response(
                        x, k, table, link, par, step, record, dt, work, no_turns, no_history, unit
                    )
        first = 0
        if start.shape[0] == 3:
            _reset(x, k, start[0], start[1], int(start[2]))
            k[UPLIFTED] = 1 if int(start[2]) != int(par[PAR_START]) else 0
        else:
            _reset(x, k, 0.0, 0.0, int(par[PAR_START]))
            if skip:
                zone = int(par[PAR_START])
                if zone == REST:
                    level = min(par[PAR_UPLIFT_RIGHT], par[PAR_UPLIFT_LEFT]) / par[PAR_GAIN]
                else:
                    level = min(table[zone, REGION_UPPER], -table[zone, REGION_LOWER])
                # A part in 10⁹ early: the rounding of a scaled response must not hide the uplift.
                level *= (1.0 - 1e-9) / abs(factor)
                first = max(_first_rise(unit[2], level) - 1, 0)
                if zone != REST:
                    x[THETA] = factor * unit[0, first]
                    x[OMEGA] = factor * unit[1, first]
                    x[PEAK] = abs(factor) * unit[2, first]
                    if first == n - 1 and unit_peak < level:
                        x[PEAK] = abs(factor) * unit_peak
        done = skip and first == n - 1 and start.shape[0] == 0 and unit_peak < level
        if not done:
            _shake(x, k, table, link, par, step, record, factor, dt, first, work, turning_points, history)
            if k[OVERTURNED] == 0:
                turns = k[TURNS]
                _free(x, k, table, link, par, (n - 1) * dt, work, no_turns)
                k[TURNS] = turns
        out[j, OUT_OVERTURNED] = k[OVERTURNED]
        out[j, OUT_PEAK] = x[PEAK]
        out[j, OUT_UPLIFTED] = k[UPLIFTED]
        out[j, OUT_IMPACTS] = k[IMPACTS]
        out[j, OUT_OVERTURN_TIME] = x[OVERTURN_TIME]
    return k[TURNS]
