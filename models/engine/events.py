"""Events of a piece: its first turn or edge, found to rounding on the piece's Taylor series."""

import math

import numpy as np

from ...core.compiled import kernel
from .series import evaluate, state_at
from .tables import ACCELERATION, FUSED, MOVED, SPEED

NO_EVENT, TURN, AT_LOWER, AT_UPPER = range(4)


@kernel(**FUSED)
def _root(row, n, m, right):
    """Return the only zero in (0, right) of a row of the series over t^m (the row's first m coefficients vanish)."""
    left = 0.0
    start = row[m]
    end = evaluate(row, n, right)
    for _ in range(m):
        end /= right
    t = right * start / (start - end)
    for _ in range(100):
        f = row[n]
        d = 0.0
        for k in range(n - 1, m - 1, -1):
            d = d * t + f
            f = f * t + row[k]
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


@kernel(**FUSED)
def _root_of_curvature(poly, n, right):
    """Return the zero of the acceleration in (0, right), in which the acceleration changes sign once."""
    left = 0.0
    start = poly[ACCELERATION, 0]
    for _ in range(60):
        t = 0.5 * (left + right)
        f = evaluate(poly[ACCELERATION], n, t)
        if f == 0.0:
            return t
        if (f > 0.0) == (start > 0.0):
            left = t
        else:
            right = t
        if right - left <= 1e-15 * right:
            break
    return 0.5 * (left + right)


@kernel(**FUSED)
def _root_of_value(poly, n, gap, right, guess):
    """Return the time in (0, right] at which a displacement that is monotone until then reaches gap, and the velocity.

    Chebyshev's third-order step inside a bracket; two evaluations from a good guess.
    """
    left = 0.0
    sign = 1.0 if gap > 0.0 else -1.0
    t = guess if 0.0 < guess < right else 0.5 * right
    velocity = 0.0
    for _ in range(100):
        value, velocity, curvature = state_at(poly, n, t)
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


@kernel(**FUSED)
def first_event(poly, n, h, theta, lower, upper, hop):
    """Return kind and time of the first event in (0, h] of a piece, and displacement and velocity at that time.

    The acceleration has at most one zero in the piece, so the signs of velocity and acceleration at both ends decide.
    A bounce from an edge and back to it that stays below `hop` is solved in one, without its turn.
    """
    m = np.int64(0)
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
    moved, final, acceleration = state_at(poly, n, h)
    turn = -1.0
    if final * direction < 0.0:
        behind = lower if direction > 0.0 else upper
        if theta == behind and moved * direction < 0.0 and m == 0:
            reach = (abs(omega) + 1.2 * h * max(abs(start), abs(acceleration))) * h
            if reach <= hop and reach < gap * direction:
                t = _root(poly[MOVED], n, np.int64(1), h)
                return (AT_LOWER if direction > 0.0 else AT_UPPER), t, 0.0, evaluate(poly[SPEED], n, t)
        turn = _root(poly[SPEED], n, m, h)
    elif m == 0 and start * direction < 0.0 and acceleration * direction > 0.0:
        # The velocity dips towards zero and recovers: look at its extremum.
        lowest = _root_of_curvature(poly, n, h)
        if evaluate(poly[SPEED], n, lowest) * direction < 0.0:
            turn = _root(poly[SPEED], n, np.int64(0), lowest)
    end = h
    if turn >= 0.0:
        end = turn
        moved = evaluate(poly[MOVED], n, turn)
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
