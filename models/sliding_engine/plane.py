"""Runs of blocks that slide in the plane of the floor, with friction against their velocity: one after the other."""

import math

import numpy as np

from ...core.compiled import kernel
from .plane_tables import (
    FARTHEST,
    FASTEST,
    FIRST,
    HISTORY_VX,
    HISTORY_VY,
    HISTORY_X,
    HISTORY_Y,
    LAST_X,
    LAST_Y,
    MOST_BACK,
    MOST_FRONT,
    MOST_PIECES,
    NUMBER,
    ORDER,
    OUT_RESIDUAL_X,
    OUT_RESIDUAL_Y,
    SERIES,
    SLIDING,
    SLOW,
    SOON,
    SPEED,
    STANDING,
    STATE,
    STRAIGHT,
    TERMS,
    VELOCITY_X,
    VELOCITY_Y,
    VX,
    VY,
    WAY,
    X,
    Y,
)
from .sample import time_to_stop
from .series import expand, expand_start, integral, rate, step_of, value
from .tables import (
    BARE,
    GRAVITY,
    LATEST,
    OUT_AFTER,
    OUT_BACKWARD,
    OUT_FIRST,
    OUT_FORWARD,
    OUT_PATH,
    OUT_PEAK,
    OUT_RESIDUAL,
    OUT_SLIPS,
    OUT_SPEED,
    ROUNDING,
)

HALVINGS = 60
"""Steps of a bisection."""


@kernel(**BARE)
def reach(x):
    """Keep the extremes of the slip at its present place."""
    x[MOST_FRONT] = max(x[MOST_FRONT], x[X])
    x[MOST_BACK] = max(x[MOST_BACK], -x[X])
    x[FARTHEST] = max(x[FARTHEST], math.sqrt(x[X] * x[X] + x[Y] * x[Y]))


@kernel(**BARE)
def outward(x, c, order, h):
    """Return the rate of half the square of the distance at the time h of a piece."""
    x_then, y_then = x[X] + integral(c, order, VELOCITY_X, h), x[Y] + integral(c, order, VELOCITY_Y, h)
    return x_then * value(c, order, VELOCITY_X, h) + y_then * value(c, order, VELOCITY_Y, h)


@kernel(**BARE)
def falling(x, c, order, which, h):
    """Return a value that is positive before a maximum of the distance (0), the slip (1) or the speed (2), at h."""
    if which == 0:
        return outward(x, c, order, h)
    if which == 1:
        return value(c, order, VELOCITY_X, h)
    return rate(c, order, SPEED, h)


@kernel(**BARE)
def extreme(x, c, order, which, sign, h):
    """Return the time within a piece of length h at which `falling` times sign changes to below 0; h if it does not.

    It is looked for between the thirds of the piece.
    """
    low, before = 0.0, sign * falling(x, c, order, which, 0.0)
    for k in range(1, 4):
        high = h * k / 3.0
        after = sign * falling(x, c, order, which, high)
        if before > 0.0 and after < 0.0:
            for _ in range(HALVINGS):
                middle = 0.5 * (low + high)
                if not low < middle < high:
                    break
                if sign * falling(x, c, order, which, middle) > 0.0:
                    low = middle
                else:
                    high = middle
            return low
        low, before = high, after
    return h


@kernel(**BARE)
def move_along(x, c, order, most, h):
    """Move a block along a piece of its series, and keep the extremes on the way.

    `most`: the maximum acceleration of the piece. An extreme is searched for only if it may be new. Its way may then
    lead beyond the last, and its rate is within the change by the acceleration during the piece.
    """
    way = integral(c, order, SPEED, h)
    far = math.sqrt(x[X] * x[X] + x[Y] * x[Y])
    if far + way > x[FARTHEST]:
        fastest = c[SPEED, 0] + most * h
        rate_now = x[X] * c[VELOCITY_X, 0] + x[Y] * c[VELOCITY_Y, 0]
        if abs(rate_now) <= (fastest * fastest + (far + way) * most) * h:
            at = extreme(x, c, order, 0, 1.0, h)
            x_then, y_then = x[X] + integral(c, order, VELOCITY_X, at), x[Y] + integral(c, order, VELOCITY_Y, at)
            x[FARTHEST] = max(x[FARTHEST], math.sqrt(x_then * x_then + y_then * y_then))
    if abs(c[VELOCITY_X, 0]) <= most * h:
        if x[X] + way > x[MOST_FRONT]:
            x[MOST_FRONT] = max(x[MOST_FRONT], x[X] + integral(c, order, VELOCITY_X, extreme(x, c, order, 1, 1.0, h)))
        if way - x[X] > x[MOST_BACK]:
            x[MOST_BACK] = max(x[MOST_BACK], -x[X] - integral(c, order, VELOCITY_X, extreme(x, c, order, 1, -1.0, h)))
    if c[SPEED, 0] + most * h > x[FASTEST]:
        fastest = value(c, order, SPEED, extreme(x, c, order, 2, 1.0, h))
        x[FASTEST] = max(x[FASTEST], c[SPEED, 0], value(c, order, SPEED, h), fastest)
    x[WAY] += way
    x[X] += integral(c, order, VELOCITY_X, h)
    x[Y] += integral(c, order, VELOCITY_Y, h)
    x[VX], x[VY] = value(c, order, VELOCITY_X, h), value(c, order, VELOCITY_Y, h)
    reach(x)


@kernel(**BARE)
def move_straight(x, nx, ny, speed, c1, c2, left):
    """Move a block in the constant direction n, to its stop or for `left`; return the duration of the move.

    The arithmetic is as for sliding in one direction (`sample.move`).
    """
    stops = time_to_stop(speed, c1, c2, left)
    duration = min(stops, left)
    later = speed + duration * (c1 + 0.5 * duration * c2)
    way = duration * (speed + duration * (0.5 * c1 + duration * c2 / 6.0))
    fastest = max(speed, later)
    if c1 > 0.0 and c1 + c2 * duration < 0.0:
        fastest = max(fastest, speed - 0.5 * c1 * c1 / c2)
    x[FASTEST] = max(x[FASTEST], fastest)
    x[WAY] += way
    x[X] += nx * way
    x[Y] += ny * way
    reach(x)
    if stops <= left or later <= 0.0:
        stand(x, nx, ny)
    else:
        x[VX], x[VY] = nx * later, ny * later
    return duration


@kernel(**BARE)
def stand(x, nx, ny):
    """Let a block stop that slid in the direction n."""
    x[VX], x[VY], x[SLIDING] = 0.0, 0.0, 0.0
    x[LAST_X], x[LAST_Y] = nx, ny


@kernel(**BARE)
def start_after(px, py, qx, qy, weight, lift, static, left):
    """Return the time within `left` at which the push p + q t exceeds static friction, from below; or infinity.

    The size of the push is convex and friction is straight, so that it exceeds it at the end if it does at all.
    """
    ex, ey, hold = px + qx * left, py + qy * left, static * (weight + lift * left)
    if not ex * ex + ey * ey > hold * hold:
        return math.inf
    now = min(0.0, px * px + py * py - static * static * weight * weight)
    half = px * qx + py * qy - static * static * weight * lift
    bend = qx * qx + qy * qy - static * static * lift * lift
    root = math.sqrt(max(0.0, half * half - bend * now))
    if half > 0.0:
        time = -now / (half + root)
    elif bend > 0.0:
        time = (root - half) / bend
    else:
        return math.inf
    return min(time, left * LATEST)


@kernel(**BARE)
def follow_in_plane(x, c, start, ax, ay, bx, by, g0, g1, dt, static, kinetic):
    """Follow a run through a sample with the floor's accelerations a to b and the weights per mass g0 to g1.

    Returns False if that takes too many pieces.
    """
    qx, qy, lift = (ax - bx) / dt, (ay - by) / dt, (g1 - g0) / dt
    time = 0.0
    for _ in range(MOST_PIECES):
        left = dt - time
        if not left > 0.0:
            return True
        px, py, weight = qx * time - ax, qy * time - ay, g0 + lift * time
        resting = x[SLIDING] == 0.0
        excess = 0.0
        if resting:
            push, hold = math.sqrt(px * px + py * py), static * weight
            # What has slid straight to its stop turns round only if more than rounding pushes it back.
            least = ROUNDING * (abs(ax) + abs(bx) + abs(ay) + abs(by)) if time > 0.0 else 0.0
            stopped = x[LAST_X] * px + x[LAST_Y] * py > 0.0 and time > 0.0
            if push - hold > least and not stopped:
                excess = push - kinetic * weight
            else:
                after = start_after(px, py, qx, qy, weight, lift, static, left)
                if after == math.inf:
                    return True
                time += after
                left -= after
                px, py, weight = qx * time - ax, qy * time - ay, g0 + lift * time
                # The push is that which just starts the block: rounding would give it another excess.
                push = math.sqrt(px * px + py * py)
                px, py = px * (static * weight / push), py * (static * weight / push)
                excess = (static - kinetic) * weight
                push = static * weight
            nx, ny, speed = px / push, py / push, 0.0
        else:
            speed = math.sqrt(x[VX] * x[VX] + x[VY] * x[VY])
            nx, ny = x[VX] / speed, x[VY] / speed
        f, change = kinetic * weight, kinetic * lift
        aside, turning = nx * py - ny * px, nx * qy - ny * qx
        straight = max(abs(aside), abs(aside + turning * left)) <= STRAIGHT * f
        c1 = excess if resting else nx * px + ny * py - f
        c2 = nx * qx + ny * qy - change
        if resting:
            if c1 < 0.0 or (c1 == 0.0 and c2 <= 0.0):
                return True  # nothing moves the block but rounding
            x[SLIDING] = 1.0
            x[NUMBER] += 1.0
            if math.isnan(x[FIRST]):
                x[FIRST] = start + time
        if straight:
            moved = move_straight(x, nx, ny, speed, c1, c2, left)
            time = dt if moved >= left else time + moved
            continue
        if resting:
            expand_start(c, px, py, qx, qy, f, change, excess)
            order = ORDER
        else:
            order = expand(c, x[VX], x[VY], px, py, qx, qy, f, change, left)
        h = step_of(c, order, left)
        # (the size of the push is convex, and friction is straight)
        ex, ey = px + qx * h, py + qy * h
        most = math.sqrt(max(px * px + py * py, ex * ex + ey * ey)) + max(f, f + change * h)
        move_along(x, c, order, most, h)
        time = dt if h >= left else time + h
        # A block that is slowed down stops at a speed and a time that are none.
        speed = math.sqrt(x[VX] * x[VX] + x[VY] * x[VY])
        px, py, weight = qx * time - ax, qy * time - ay, g0 + lift * time
        drag = kinetic * weight - math.sqrt(px * px + py * py)
        if (speed <= SLOW and drag > 0.0 and speed <= SOON * drag) or (not resting and speed <= STANDING):
            stand(x, 0.0, 0.0)
    return False


@kernel(**BARE)
def slide_out_in_plane(x, kinetic):
    """Let a block that slides at the end of the record come to a stop, and return its further slip."""
    speed = math.sqrt(x[VX] * x[VX] + x[VY] * x[VY])
    if x[SLIDING] == 0.0 or not speed > 0.0:
        return 0.0
    further = speed * speed / (2.0 * kinetic * GRAVITY)
    x[FASTEST] = max(x[FASTEST], speed)
    x[X] += x[VX] / speed * further
    x[Y] += x[VY] / speed * further
    x[WAY] += further
    reach(x)
    return further


@kernel(keep=True)
def slide_in_plane(shaking, friction, factors, first, last, out, history):
    """Run every row of `friction` (n, 2) under its factor times a record; results (n, 11).

    `first`: the sample before which a run cannot slide. `last`: the sample after which it cannot begin to. `history`
    (4, samples) is the last run's, if it has any room. Weights per mass must be > 0.
    """
    along, across, vertical, dt = shaking
    samples = along.size
    x, c = np.zeros(STATE), np.zeros((SERIES, TERMS))
    for run in range(factors.size):
        static, kinetic, f = friction[run, 0], friction[run, 1], factors[run]
        x[:] = 0.0
        x[FIRST] = np.nan
        if history.size > 0:
            history[:, :] = 0.0
        known = True
        g0, g1 = GRAVITY, GRAVITY
        for i in range(first[run], samples - 1):
            if vertical.size > 0:
                g0, g1 = GRAVITY + f * vertical[i], GRAVITY + f * vertical[i + 1]
            bx, by = f * along[i + 1], f * across[i + 1]
            hold = static * g1
            # (the size of the push is convex: at rest it is within friction where it is at the end of each sample)
            if x[SLIDING] != 0.0 or i == first[run] or bx * bx + by * by > hold * hold:
                ax, ay = f * along[i], f * across[i]
                known = follow_in_plane(x, c, i * dt, ax, ay, bx, by, g0, g1, dt, static, kinetic)
                if not known:
                    break
            elif i >= last[run] and history.size == 0:
                break
            if history.size > 0:
                history[HISTORY_X, i + 1], history[HISTORY_Y, i + 1] = x[X], x[Y]
                history[HISTORY_VX, i + 1], history[HISTORY_VY, i + 1] = x[VX], x[VY]
        row = out[run]
        row[OUT_AFTER] = slide_out_in_plane(x, kinetic)
        row[OUT_FORWARD] = x[MOST_FRONT]
        row[OUT_BACKWARD] = x[MOST_BACK]
        row[OUT_PEAK] = x[FARTHEST]
        row[OUT_RESIDUAL] = math.sqrt(x[X] * x[X] + x[Y] * x[Y])
        row[OUT_PATH] = x[WAY]
        row[OUT_SPEED] = x[FASTEST]
        row[OUT_SLIPS] = x[NUMBER]
        row[OUT_FIRST] = x[FIRST]
        row[OUT_RESIDUAL_X] = x[X]
        row[OUT_RESIDUAL_Y] = x[Y]
        if not known:
            row[:] = np.nan
