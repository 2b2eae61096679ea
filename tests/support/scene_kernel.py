"""The kernel of the reference: one motion of a rocking block, from tables of its two sides; see scene_reference."""

import math

import numpy as np
from numba import njit
from scipy.integrate._ivp import dop853_coefficients as _dop

N = 12
STAGES = np.ascontiguousarray(_dop.A[:N, :N])
NODES = np.ascontiguousarray(_dop.C[:N])
WEIGHTS = np.ascontiguousarray(_dop.B)
ERROR3 = np.ascontiguousarray(_dop.E3[:N])
ERROR5 = np.ascontiguousarray(_dop.E5[:N])
assert _dop.E3[N] == 0
assert _dop.E5[N] == 0
HALF_PI = math.pi / 2

# columns of the table of a side
Q2, ALPHA, GAIN, PI0, KAPPA, SLACK, RUPTURE, WALL, R_WALL, FACTOR, HELD, PULL, OPEN, EDGE, MA, MK, INERTIA = range(17)
# columns of the zone
Z_W2, Z_EQ, Z_GAIN, Z_STEP, Z_K, Z_INERTIA, Z_ETA, Z_LAW = range(8)
# events in the log
TURN, IMPACT, BOUNCE, RUPTURED, REST, REST_WALL, LEAVE, FALL, FREE = range(1, 10)
# columns of the result of the kernel
(O_FALL, O_FRONT, O_BACK, O_IMPACTS, O_BOUNCES, O_SPEED, O_RUPT, O_TIME, O_HELD, O_END, O_MODE, O_STATE, O_TAUT_F,
 O_TAUT_B, O_END_RATE, O_LOG, O_STEPS) = range(17)  # fmt: skip


@njit(cache=True)
def _push(x, row):
    """F = -u'' at time x of a segment (start, length, c0, c1, amplitude, frequency, phase)."""
    value = row[2] + row[3] * x
    if row[4] != 0.0:
        value += row[4] * math.sin(row[5] * x + row[6])
    return -value


@njit(cache=True)
def _rate(z, v, push, side, piece, intact, drag, par, zone, exact, origin):
    """Outward acceleration at y = origin + z. piece 0: slack or free, 1: taut, 2: elastic zone (side = +1 there)."""
    y = origin + z
    if piece == 2:
        return -zone[Z_W2] * (y - zone[Z_EQ]) + zone[Z_GAIN] * push - drag * v
    p = par[0] if side > 0 else par[1]
    force = push * side
    if exact:
        out = -p[Q2] * math.sin(p[ALPHA] - y) + p[GAIN] * math.cos(p[ALPHA] - y) * force
    else:
        out = -p[Q2] * (p[ALPHA] - y) + p[GAIN] * force
    if intact:
        out -= p[PI0]
        if piece == 1:
            out -= p[KAPPA] * (y - p[SLACK])
    return out


@njit(cache=True)
def _advance(y, v, x, h, row, side, piece, intact, drag, par, zone, exact, origin, atol, vtol, tol):
    """One step of length h; the new state and the norm of the error over the tolerance."""
    ky = np.empty(N)
    kv = np.empty(N)
    for i in range(N):
        dy = 0.0
        dv = 0.0
        for j in range(i):
            dy += STAGES[i, j] * ky[j]
            dv += STAGES[i, j] * kv[j]
        vi = v + h * dv
        ky[i] = vi
        kv[i] = _rate(y + h * dy, vi, _push(x + NODES[i] * h, row), side, piece, intact, drag, par, zone, exact, origin)
    dy = dv = y3 = v3 = y5 = v5 = 0.0
    for i in range(N):
        dy += WEIGHTS[i] * ky[i]
        dv += WEIGHTS[i] * kv[i]
        y3 += ERROR3[i] * ky[i]
        v3 += ERROR3[i] * kv[i]
        y5 += ERROR5[i] * ky[i]
        v5 += ERROR5[i] * kv[i]
    y1 = y + h * dy
    v1 = v + h * dv
    sy = atol + tol * max(abs(y), abs(y1))
    sv = vtol + tol * max(abs(v), abs(v1))
    e5 = (y5 / sy) ** 2 + (v5 / sv) ** 2
    e3 = (y3 / sy) ** 2 + (v3 / sv) ** 2
    error = 0.0 if e5 == 0.0 else h * e5 / math.sqrt(2.0 * (e5 + 0.01 * e3))
    return y1, v1, error


@njit(cache=True)
def _root(kind, target, a, b, sign_b, y, v, x, row, side, piece, intact, drag, par, zone, exact, origin):
    """Step length in (a, b) where the rotation (0), velocity (1) or acceleration (2) minus target takes sign_b."""
    low, high = a, b
    h = 0.5 * (a + b)
    for _ in range(200):
        y1, v1, _e = _advance(y, v, x, h, row, side, piece, intact, drag, par, zone, exact, origin, 1.0, 1.0, 1.0)
        a1 = _rate(y1, v1, _push(x + h, row), side, piece, intact, drag, par, zone, exact, origin)
        value, slope = (y1 - target, v1) if kind == 0 else (v1 - target, a1)
        if kind == 2:
            value, slope = a1 - target, 0.0
        if value * sign_b > 0.0:
            high = h
        else:
            low = h
        new = h - value / slope if slope != 0.0 else low
        if not (low < new < high):
            new = 0.5 * (low + high)
        noise = 1.2e-16 * max(abs(target), abs(y) if kind == 0 else abs(v))
        if (
            (kind < 2 and abs(value) <= noise)
            or high - low <= 4e-16 * b
            or (abs(new - h) <= 2e-16 * b and slope != 0.0)
        ):
            return h, y1, v1
        h = new
    return h, y1, v1


@njit(cache=True)
def _zone_exit(drag, y, v, par, zone):
    """Speed with which the unforced zone is left on the other side; -1: it is not."""
    row = np.zeros(7)
    goal = par[1 if v < 0 else 0, EDGE] * (1.0 if v > 0 else -1.0)
    way = 1.0 if v > 0 else -1.0
    h = 0.2 / math.sqrt(zone[Z_W2])
    h = 0.2 / max(1.0 / h * 0.2, drag)
    for _ in range(10000):
        y1, v1, _e = _advance(y, v, 0.0, h, row, 1, 2, 0, drag, par, zone, False, 0.0, 1.0, 1.0, 1.0)
        if v1 * way <= 0.0:
            hit, yt, _v = _root(1, 0.0, 0.0, h, -way, y, v, 0.0, row, 1, 2, 0, drag, par, zone, False, 0.0)
            if (yt - goal) * way <= 0.0:
                return -1.0
            h = hit
            y1 = yt
        if (y1 - goal) * way >= 0.0:
            _h, _y, out = _root(0, goal, 0.0, h, way, y, v, 0.0, row, 1, 2, 0, drag, par, zone, False, 0.0)
            return abs(out)
        y, v = y1, v1
    return -1.0


@njit(cache=True)
def zone_drag(y, v, par, zone):
    """Damping rate of a crossing that enters at y with v (zone units): discrete, or the energy-consistent root."""
    if zone[Z_LAW] == 1.0:
        return (1.0 - zone[Z_ETA]) * abs(v) / (par[0, EDGE] + par[1, EDGE])
    here, there = (0, 1) if v < 0 else (1, 0)
    u_in = par[here, MA] * par[here, EDGE] - 0.5 * par[here, MK] * par[here, EDGE] ** 2
    u_out = par[there, MA] * par[there, EDGE] - 0.5 * par[there, MK] * par[there, EDGE] ** 2
    energy = zone[Z_ETA] ** 2 * (0.5 * zone[Z_INERTIA] * v * v + u_in) - u_out
    target = math.sqrt(2.0 * energy / zone[Z_INERTIA])
    low = 0.0
    if _zone_exit(0.0, y, v, par, zone) <= target:
        return 0.0
    high = 0.1 * math.sqrt(zone[Z_W2])
    while _zone_exit(high, y, v, par, zone) > target:
        low, high = high, 2.0 * high
    for _ in range(80):
        middle = 0.5 * (low + high)
        if middle <= low or middle >= high:
            break
        if _zone_exit(middle, y, v, par, zone) > target:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)


@njit(cache=True)
def _restoring(y, side, intact, par, zone, exact):
    """Whether the unforced block is driven back to its base from everywhere up to y on a side."""
    for i in range(101):
        z = y * i / 100.0
        p = par[0] if side > 0 else par[1]
        taut = 1 if intact and z > p[SLACK] else 0
        if _rate(z, 0.0, 0.0, side, taut, intact, 0.0, par, zone, exact, 0.0) >= 0.0:
            return False
    p = par[0] if side > 0 else par[1]
    return not (
        intact and p[SLACK] < y and _rate(p[SLACK], 0.0, 0.0, side, 1, intact, 0.0, par, zone, exact, 0.0) >= 0.0
    )


@njit(cache=True)
def _crossing(x0, x1, row, where, y, side, piece, intact, par, zone, exact, origin, way):
    """First time in (x0, x1] at which the sign of the acceleration times way is positive; monotone there."""
    low, high = x0, x1
    while True:
        middle = 0.5 * (low + high)
        if middle <= low or middle >= high:
            return high
        value = _rate(y, 0.0, _push(middle, row), side, piece, intact, 0.0, par, zone, exact, origin) * way - where
        if value > 0.0:
            high = middle
        else:
            low = middle


@njit(cache=True)
def _hops(v, other, product, d0, d1):
    """Time of all later hops: the next with v against d0, then `other` against d1; both speeds then times product."""
    if product >= 1.0 or min(d0, d1) <= 0.0:
        return np.inf
    return 2.0 * (v / d0 + other / d1) / (1.0 - product)


@njit(cache=True)
def run(par, zone, segments, exact, intact, rigid_held, theta, omega, tol, follow, log):
    """The whole motion; intact: 1 while a restraint holds, rigid_held: it is rigid. See Result."""
    out = np.zeros(17)
    out[O_TIME] = np.nan
    scale = max(par[0, ALPHA], par[1, ALPHA])
    speed = math.sqrt(max(par[0, Q2], par[1, Q2]))
    short = tol < 0.5e-12  # shorter steps for a twin
    tol *= 0.02  # for one step: what is asked for is meant for the whole motion
    atol = 1e-3 * tol * scale
    vtol = 1e-3 * tol * scale * speed
    cap = 0.37 if short else 0.5
    parts = 5 if short else 4
    peaks = np.zeros(2)
    taut_peak = np.zeros(2)
    free_row = np.zeros(7)
    free_row[1] = np.inf
    count = segments.shape[0]
    zoned = zone[Z_LAW] > 0.0

    side = 1 if theta > 0 or (theta == 0 and omega > 0) else -1
    if theta == 0.0 and omega == 0.0 and par[0, OPEN] == 0.0:
        side = -1
    y = abs(theta)
    v = omega * side
    s = 0 if side > 0 else 1
    drag = 0.0
    piece = 1 if intact and y >= par[s, SLACK] else 0
    rigid = 0 if zoned and y > par[s, EDGE] else 1
    resting = 0  # 1 on the base, 2 on a wall
    origin = 0.0  # y is counted from here: the wall while the block is near it, so that small hops keep their digits
    if y == 0.0 and v == 0.0:
        resting = 1
    elif y == par[s, WALL] and v == 0.0:
        resting = 2
        origin, y = y, 0.0
    if rigid_held and resting != 1:
        intact = 0
    direction = 0.0  # of a start with v = 0; 0: that of the acceleration
    trial = 1e-3
    turns = 0
    last_turn = 0.0
    logged = 0
    index = -1
    x = 0.0
    row = free_row
    steps = 0
    state = -1
    free = False
    fresh = True
    while state < 0:
        if fresh:
            index += 1
            x = 0.0
            fresh = False
            if index < count:
                row = segments[index]
            else:
                free = True
                turns = 0
                start = 0.0 if count == 0 else segments[count - 1, 0] + segments[count - 1, 1]
                free_row[0] = start
                row = free_row
                angle = y if piece == 2 else (origin + y) * side
                out[O_END] = angle
                out[O_END_RATE] = v if piece == 2 else v * side
                out[O_MODE] = intact
                if logged < log.shape[0]:
                    log[logged, 0] = start
                    log[logged, 1] = FREE
                    log[logged, 2] = angle
                    log[logged, 3] = out[O_END_RATE]
                    logged += 1
        left = row[1] - x
        steps += 1
        if steps > 20_000_000:
            state = 5
            break
        event = 0
        event_theta = 0.0
        event_omega = 0.0
        if resting:
            ahead = 0.0 if free else left
            leave = np.inf
            leave_side = side
            if resting == 1:
                for k in range(2):
                    if par[k, OPEN] == 0.0:
                        continue
                    sign = 1 if k == 0 else -1
                    taut = 1 if intact and par[k, SLACK] == 0.0 else 0
                    extra = par[k, HELD] if rigid_held and intact else 0.0
                    now = _rate(0.0, 0.0, _push(x, row), sign, taut, intact, 0.0, par, zone, exact, origin)
                    then = _rate(0.0, 0.0, _push(x + ahead, row), sign, taut, intact, 0.0, par, zone, exact, origin)
                    if extra > 0.0:
                        out[O_HELD] = max(out[O_HELD], min(max(now, then), extra) * par[k, PULL])
                    at = np.inf
                    if now - extra > 0.0:
                        at = x
                    elif then - extra > 0.0:
                        at = _crossing(x, x + ahead, row, extra, 0.0, sign, taut, intact, par, zone, exact, origin, 1.0)
                    if at < leave:
                        leave = at
                        leave_side = sign
            else:
                now = -_rate(y, 0.0, _push(x, row), side, piece, intact, 0.0, par, zone, exact, origin)
                then = -_rate(y, 0.0, _push(x + ahead, row), side, piece, intact, 0.0, par, zone, exact, origin)
                if now > 0.0:
                    leave = x
                elif then > 0.0:
                    leave = _crossing(x, x + ahead, row, 0.0, y, side, piece, intact, par, zone, exact, origin, -1.0)
            if leave == np.inf:
                if free:
                    state = 0 if resting == 1 else 1
                    break
                fresh = True
                continue
            if resting == 1:
                side = leave_side
                s = 0 if side > 0 else 1
                y = 0.0
                rigid = 1
                if rigid_held and intact:
                    intact = 0
                    out[O_RUPT] = 1.0
                    out[O_TIME] = row[0] + leave
                piece = 1 if intact and par[s, SLACK] == 0.0 else 0
                direction = 1.0
            else:
                direction = -1.0
            resting = 0
            v = 0.0
            x = leave
            event, event_theta = LEAVE, (origin + y) * side
        else:
            if left <= 0.0:
                fresh = True
                continue
            s = 0 if side > 0 else 1
            # edges of the piece
            if piece == 2:
                inner, outer = -par[1, EDGE], par[0, EDGE]
            else:
                inner = 0.0
                outer = min(HALF_PI, par[s, WALL])
                if piece == 1:
                    inner = par[s, SLACK]
                    outer = min(outer, par[s, RUPTURE])
                elif intact:
                    outer = min(outer, par[s, SLACK])
                if zoned:
                    if rigid:
                        outer = min(outer, par[s, EDGE])
                    else:
                        inner = par[s, EDGE]
            fast = max(par[s, Q2], row[5] ** 2)
            if piece == 1:
                fast = max(fast, abs(par[s, KAPPA] - par[s, Q2]))
            elif piece == 2:
                fast = max(zone[Z_W2], drag * drag)
            h = min(trial, left, cap / math.sqrt(fast))
            y1, v1, error = _advance(
                y, v, x, h, row, side, piece, intact, drag, par, zone, exact, origin, atol, vtol, tol
            )
            if error > 1.0:
                trial = h * max(0.2, 0.9 * error ** (-0.125))
                continue
            if trial <= h:
                trial = h * min(5.0, 0.9 * max(error, 1e-12) ** (-0.125))
            acceleration = _rate(y, v, _push(x, row), side, piece, intact, drag, par, zone, exact, origin)
            way = direction
            if v != 0.0:
                way = 1.0 if v > 0 else -1.0
            elif way == 0.0:
                way = 1.0 if acceleration > 0 else -1.0
            # monotone pieces: the first turning point, the first edge
            a = 0.0
            a_rate = acceleration
            turned = False
            hit = 0
            for j in range(1, parts + 1):
                b = h * j / parts
                if j == parts:
                    yb, vb = y1, v1
                else:
                    yb, vb, _e = _advance(
                        y, v, x, b, row, side, piece, intact, drag, par, zone, exact, origin, atol, vtol, tol
                    )
                b_rate = _rate(yb, vb, _push(x + b, row), side, piece, intact, drag, par, zone, exact, origin)
                if vb * way > 0.0 and a_rate * way < 0.0 and b_rate * way > 0.0:
                    # the speed has a minimum inside: it may have been zero twice
                    c, yc, vc = _root(
                        2, 0.0, a, b, way, y, v, x, row, side, piece, intact, drag, par, zone, exact, origin
                    )
                    if vc * way <= 0.0:
                        b, yb, vb = c, yc, vc
                if vb * way <= 0.0:
                    b, yb, vb = _root(
                        1, 0.0, a, b, -way, y, v, x, row, side, piece, intact, drag, par, zone, exact, origin
                    )
                    turned = True
                if (way > 0 and yb > outer - origin) or (way < 0 and yb < inner - origin):
                    hit = 1 if way > 0 else -1
                    goal = (outer if way > 0 else inner) - origin
                    b, yb, vb = _root(
                        0, goal, a, b, way, y, v, x, row, side, piece, intact, drag, par, zone, exact, origin
                    )
                    yb = goal
                    turned = False
                    if vb * way < 0.0:
                        vb = 0.0
                if turned or hit != 0:
                    h, y1, v1 = b, yb, vb
                    break
                a = b
                a_rate = b_rate
            x = row[1] if (h >= left) else x + h
            y, v = y1, v1
            direction = way if hit != 0 else 0.0
            if x >= row[1] and hit == 0:
                fresh = True
            if hit != 0:
                y = outer if hit > 0 else inner
                origin = 0.0
            angle = y if piece == 2 else (origin + y) * side
            peaks[0] = max(peaks[0], angle)
            peaks[1] = max(peaks[1], -angle)
            if intact:
                taut_peak[s] = max(taut_peak[s], abs(angle))
            if turned:
                v = 0.0
                event, event_theta = TURN, angle
                if piece == 2:
                    # rule 4: to the rigid branch of the same energy
                    side = 1 if y > zone[Z_EQ] else -1
                    s = 0 if side > 0 else 1
                    level = 0.5 * zone[Z_K] * (y - zone[Z_EQ]) ** 2 + zone[Z_STEP]
                    y = 2.0 * level / (par[s, MA] + math.sqrt(par[s, MA] ** 2 - 2.0 * par[s, MK] * level))
                    y = min(y, par[s, EDGE])
                    peaks[0] = max(peaks[0], y * side)
                    peaks[1] = max(peaks[1], -y * side)
                    piece = 0
                    rigid = 1
            elif hit != 0:
                event_theta = angle
                event_omega = v * (1 if piece == 2 else side)
                push = _push(x, row)
                if piece == 2:
                    side = hit
                    s = 0 if side > 0 else 1
                    v = abs(v) * math.sqrt(zone[Z_INERTIA] / par[s, INERTIA])
                    y = par[s, EDGE]
                    piece = 0
                    rigid = 0
                    direction = 1.0
                elif hit > 0 and y == par[s, WALL]:
                    event = BOUNCE
                    origin, y = y, 0.0
                    out[O_SPEED] = max(out[O_SPEED], abs(v))
                    if not free:
                        out[O_BOUNCES] += 1
                    v = -par[s, R_WALL] * v
                    r = par[s, R_WALL]
                    d = _rate(y, 0.0, push, side, piece, intact, 0.0, par, zone, exact, origin)
                    t = _hops(-v, 0.0, r, d, d)
                    later = min(2.0 * t, row[1] - x)
                    if t < 1e-9:
                        d2 = _rate(y, 0.0, _push(x + later, row), side, piece, intact, 0.0, par, zone, exact, origin)
                        if t < 1e-15 or (d2 >= 0.5 * d and later == 2.0 * t):
                            resting = 2
                            v = 0.0
                            if logged < log.shape[0]:
                                log[logged, 0] = row[0] + x + t
                                log[logged, 1] = REST_WALL
                                log[logged, 2] = angle
                                logged += 1
                    direction = -1.0
                elif hit > 0 and piece == 1 and y == par[s, RUPTURE]:
                    event = RUPTURED
                    intact = 0
                    piece = 0
                    turns = 0
                    out[O_RUPT] = 1.0
                    out[O_TIME] = row[0] + x
                elif hit > 0 and y == HALF_PI:
                    event = FALL
                    state = 3 if side > 0 else 4
                elif hit > 0 and zoned and rigid and y == par[s, EDGE]:
                    rigid = 0
                elif hit > 0:
                    piece = 1  # slack taken up
                elif zoned and not rigid:
                    # rule 3
                    kinetic = 0.5 * par[s, INERTIA] * v * v
                    u_in = par[s, MA] * y - 0.5 * par[s, MK] * y * y
                    o = 1 - s
                    u_out = par[o, MA] * par[o, EDGE] - 0.5 * par[o, MK] * par[o, EDGE] ** 2
                    if zone[Z_ETA] ** 2 * (kinetic + u_in) <= u_out:
                        rigid = 1
                    else:
                        y = y * side
                        v = v * side * math.sqrt(par[s, INERTIA] / zone[Z_INERTIA])
                        direction = -1.0 * side
                        drag = zone_drag(y, v, par, zone)
                        side = 1
                        piece = 2
                elif y > 0.0:
                    piece = 0  # slack again
                else:
                    o = 1 - s
                    event = IMPACT if par[o, OPEN] != 0.0 else BOUNCE
                    if par[o, OPEN] == 0.0:
                        out[O_SPEED] = max(out[O_SPEED], abs(v))
                    if not free:
                        out[O_IMPACTS if par[o, OPEN] != 0.0 else O_BOUNCES] += 1
                    near_taut = 1 if intact and par[s, SLACK] == 0.0 else 0
                    far_taut = 1 if intact and par[o, SLACK] == 0.0 else 0
                    near = -_rate(0.0, 0.0, push, side, near_taut, intact, 0.0, par, zone, exact, origin)
                    far = -_rate(0.0, 0.0, push, -side, far_taut, intact, 0.0, par, zone, exact, origin)
                    v = par[s, FACTOR] * abs(v)
                    if par[o, OPEN] == 0.0:
                        far = near
                        t = _hops(v, 0.0, par[s, FACTOR], near, near)
                    else:
                        f2 = par[o, FACTOR]
                        t = _hops(v, f2 * v, f2 * par[s, FACTOR], far, near)
                    later = min(2.0 * t, row[1] - x)
                    if t < 1e-9:
                        push = _push(x + later, row)
                        n2 = -_rate(0.0, 0.0, push, side, near_taut, intact, 0.0, par, zone, exact, origin)
                        f3 = -_rate(0.0, 0.0, push, -side, far_taut, intact, 0.0, par, zone, exact, origin)
                        if par[o, OPEN] == 0.0:
                            f3 = n2
                        if t < 1e-15 or (min(n2, f3) >= 0.5 * min(near, far) and later == 2.0 * t):
                            resting = 1
                            if logged < log.shape[0]:
                                log[logged, 0] = row[0] + x + t
                                log[logged, 1] = REST
                                logged += 1
                    if resting:
                        v = 0.0
                    elif par[o, OPEN] != 0.0:
                        if v > 0.0 or far < 0.0:
                            side = -side
                            s = o
                            near_taut = far_taut
                        piece = near_taut
                    else:
                        piece = near_taut
                    rigid = 1
                    direction = 1.0
            if free and (event in (TURN, BOUNCE)) and not follow:
                turns += 1
                if turns >= 2:
                    # all later motion lies between the last two extremes
                    if last_turn * angle > 0.0:
                        if par[s, WALL] < HALF_PI and (abs(angle) == par[s, WALL] or abs(last_turn) == par[s, WALL]):
                            outward = _rate(par[s, WALL], 0.0, 0.0, side, piece, intact, 0.0, par, zone, exact, 0.0)
                            state = 1 if outward > 0.0 else 2
                        else:
                            state = 2
                    else:
                        low = abs(min(angle, last_turn))
                        high = max(angle, last_turn)
                        if _restoring(high, 1, intact, par, zone, exact) and _restoring(
                            low, -1, intact, par, zone, exact
                        ):
                            state = 0
                    if turns > 5000:
                        state = 5
                last_turn = angle
        if event and logged < log.shape[0]:
            log[logged, 0] = row[0] + x
            log[logged, 1] = event
            log[logged, 2] = event_theta
            log[logged, 3] = event_omega
            logged += 1
    if not free:
        out[O_END] = HALF_PI if state == 3 else -HALF_PI
        out[O_MODE] = intact
    out[O_FALL] = 1.0 if state == 3 else (-1.0 if state == 4 else 0.0)
    out[O_FRONT] = peaks[0]
    out[O_BACK] = peaks[1]
    out[O_TAUT_F] = taut_peak[0]
    out[O_TAUT_B] = taut_peak[1]
    out[O_STATE] = state
    out[O_LOG] = logged
    out[O_STEPS] = steps
    return out
