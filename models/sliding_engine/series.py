"""The Taylor series of a block that slides in the plane of the floor, under a push that is a straight line in time.

Let the velocity be v = r w, w of length one, with the push p and friction per mass f. Then v' = p - f w, so that r' =
w.p - f and r w' = p - (w.p) w. The coefficients follow one from the other.
"""

import math

from ...core.compiled import kernel
from .plane_tables import (
    ACROSS,
    ALONG,
    ORDER,
    PUSHED,
    SHARES,
    SPEED,
    TOLERANCE,
    VELOCITY_X,
    VELOCITY_Y,
)
from .tables import BARE


@kernel(**BARE)
def expand(c, vx, vy, px, py, qx, qy, f, lift, left):
    """Write the series from the velocity (vx, vy), not 0, with the push p + q t and the friction f + lift t.

    Returns its order: that from which the last two terms are small at `left`, or `ORDER`.
    """
    power, before = 1.0, math.inf
    speed = math.sqrt(vx * vx + vy * vy)
    c[SPEED, 0], c[VELOCITY_X, 0], c[VELOCITY_Y, 0] = speed, vx, vy
    c[ALONG, 0], c[ACROSS, 0] = vx / speed, vy / speed
    for k in range(ORDER):
        wx, wy = c[ALONG, k], c[ACROSS, k]
        pushed, rubbed_x, rubbed_y = px * wx + py * wy, f * wx, f * wy
        if k == 0:
            pushed -= f
            rubbed_x -= px
            rubbed_y -= py
        else:
            before_x, before_y = c[ALONG, k - 1], c[ACROSS, k - 1]
            pushed += qx * before_x + qy * before_y
            rubbed_x += lift * before_x
            rubbed_y += lift * before_y
            if k == 1:
                pushed -= lift
                rubbed_x -= qx
                rubbed_y -= qy
        share = SHARES[k]
        c[SPEED, k + 1] = pushed * share
        x, y = -rubbed_x * share, -rubbed_y * share
        c[VELOCITY_X, k + 1], c[VELOCITY_Y, k + 1] = x, y
        for j in range(1, k + 2):
            r = c[SPEED, j]
            x -= r * c[ALONG, k + 1 - j]
            y -= r * c[ACROSS, k + 1 - j]
        c[ALONG, k + 1], c[ACROSS, k + 1] = x / speed, y / speed
        power *= left
        last = power * (abs(c[SPEED, k + 1]) + abs(c[VELOCITY_X, k + 1]) + abs(c[VELOCITY_Y, k + 1]))
        if before + last <= TOLERANCE:
            return k + 1
        before = last
    return ORDER


@kernel(**BARE)
def expand_start(c, px, py, qx, qy, f, lift, excess):
    """Write the series from rest under the push p, not 0, which is greater than the friction f by `excess` >= 0.

    At the first instant the block moves in the direction of the push. If the excess is 0 (static and kinetic friction
    are equal), the speed grows with the square of time, and the series is asymptotic. Its terms decrease, and increase
    again, so that it is valid for a short time, which `step_of` finds by its last terms.
    """
    push = math.sqrt(px * px + py * py)
    wx, wy = px / push, py / push
    c[SPEED, 0], c[VELOCITY_X, 0], c[VELOCITY_Y, 0] = 0.0, 0.0, 0.0
    c[SPEED, 1], c[VELOCITY_X, 1], c[VELOCITY_Y, 1] = excess, excess * wx, excess * wy
    c[ALONG, 0], c[ACROSS, 0], c[PUSHED, 0] = wx, wy, push
    for k in range(1, ORDER):
        before_x, before_y = c[ALONG, k - 1], c[ACROSS, k - 1]
        turned = qx * before_x + qy * before_y
        x, y = -turned * wx, -turned * wy
        if k == 1:
            x += qx
            y += qy
        for j in range(2, k + 1):
            r = c[SPEED, j] * (k - j + 1)
            x -= r * c[ALONG, k - j + 1]
            y -= r * c[ACROSS, k - j + 1]
        for j in range(1, k):
            r = c[PUSHED, j]
            x -= r * c[ALONG, k - j]
            y -= r * c[ACROSS, k - j]
        along = push * (wx * x + wy * y) / (2.0 * push + k * excess)
        share = 1.0 / (push + k * excess)
        x, y = (x - along * wx) * share, (y - along * wy) * share
        c[ALONG, k], c[ACROSS, k] = x, y
        pushed = px * x + py * y + turned
        c[PUSHED, k] = pushed
        share = 1.0 / (k + 1)
        c[SPEED, k + 1] = share * (pushed - lift if k == 1 else pushed)
        c[VELOCITY_X, k + 1] = share * ((qx if k == 1 else 0.0) - f * x - lift * before_x)
        c[VELOCITY_Y, k + 1] = share * ((qy if k == 1 else 0.0) - f * y - lift * before_y)


@kernel(**BARE)
def value(c, order, row, h):
    """Return the value of a row at h."""
    total = c[row, order]
    for k in range(order - 1, -1, -1):
        total = total * h + c[row, k]
    return total


@kernel(**BARE)
def rate(c, order, row, h):
    """Return the derivative of a row at h."""
    total = order * c[row, order]
    for k in range(order - 1, 0, -1):
        total = total * h + k * c[row, k]
    return total


@kernel(**BARE)
def integral(c, order, row, h):
    """Return the integral of a row from 0 to h."""
    total = c[row, order] * SHARES[order]
    for k in range(order - 1, -1, -1):
        total = total * h + c[row, k] * SHARES[k]
    return total * h


@kernel(**BARE)
def step_of(c, order, left):
    """Return the longest of left, left/2, left/4 … for which the last two terms are small, and the speed is above 0."""
    last = abs(c[VELOCITY_X, order]) + abs(c[VELOCITY_Y, order])
    previous = abs(c[VELOCITY_X, order - 1]) + abs(c[VELOCITY_Y, order - 1])
    h = left
    while True:
        power = 1.0
        for _ in range(order - 1):
            power *= h
        # (what has no value, as of series that overflow, is not small)
        if power * (previous + h * last) <= TOLERANCE and value(c, order, SPEED, h) > 0.0:
            return h
        h *= 0.5
        if not h > 1e-300:
            return h
