"""A second engine of sliding blocks in doubles, by other formulas and with an account of its energy.

Events are found by bisection on monotone pieces instead of closed forms, work by two-point Gauss quadrature, which is
exact for the cubics that occur: u'' and the weight are straight lines, the velocity is a quadratic.
"""

import math

import numpy as np
from numba import njit

G = 9.80665
GAUSS = 0.5 / math.sqrt(3.0)
FORWARD, BACKWARD, RESIDUAL, PATH, SPEED, SLIPS, FIRST, AFTER, GIVEN, TAKEN, MARGIN = range(11)
"""Columns: results; the work of -u'' and that of friction, J/kg; the least speed or excess that decided, m/s, m/s²."""
BISECTIONS = 80


@njit(nogil=True, cache=True)
def first_zero(v, c, d, length):
    """First zero of v + c t + d t²/2 in (0, length]; length + 1 without one.  The sign of v (or of what follows) leads.

    Between its ends and its vertex the parabola is monotone.
    """
    lead = v if v != 0.0 else (c if c != 0.0 else d)
    lead = 1.0 if lead > 0.0 else -1.0
    begin = 0.0
    vertex = -c / d if d != 0.0 else -1.0
    for end in (vertex, length):
        if not begin < end <= length:
            continue
        if lead * (v + end * (c + 0.5 * d * end)) <= 0.0:
            low, high = begin, end
            for _ in range(BISECTIONS):
                middle = 0.5 * (low + high)
                if lead * (v + middle * (c + 0.5 * d * middle)) > 0.0:
                    low = middle
                else:
                    high = middle
            return high
        begin = end
    return length + 1.0


@njit(nogil=True, cache=True)
def breaks_away(now, after, length):
    """First instant after which a line is above zero; length + 1 without one."""
    if now > 0.0:
        return 0.0
    if after <= 0.0:
        return length + 1.0
    low, high = 0.0, length
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        if now + (after - now) * (middle / length) > 0.0:
            high = middle
        else:
            low = middle
    return low


@njit(nogil=True, cache=True)
def run(record, vertical, dt, friction, factor, out):
    """One run; friction: static front, back, kinetic front, back.  The record is factor times `record`."""
    out[:] = 0.0
    out[FIRST] = np.nan
    out[MARGIN] = 1.0
    s = v = began = 0.0
    side = came = 0.0
    for i in range(record.size - 1):
        u0, u1 = factor * record[i], factor * record[i + 1]
        g0, g1 = G, G
        if vertical.size > 0:
            g0, g1 = G + factor * vertical[i], G + factor * vertical[i + 1]
        gone = 0.0
        for _ in range(50):
            left = dt - gone
            if left <= 0.0:
                break
            a, w = u0 + (u1 - u0) * (gone / dt), g0 + (g1 - g0) * (gone / dt)
            fresh = False
            if side == 0.0:
                front, back = -a - friction[0] * w, a - friction[1] * w
                nearest = min(abs(front), abs(back)) if gone > 0.0 else 1.0
                out[MARGIN] = min(out[MARGIN], nearest)
                if came > 0.0 or abs(front) < 1e-14 * abs(u0):
                    front = min(front, 0.0)
                if came < 0.0 or abs(back) < 1e-14 * abs(u0):
                    back = min(back, 0.0)
                one = breaks_away(front, -u1 - friction[0] * g1, left)
                other = breaks_away(back, u1 - friction[1] * g1, left)
                if min(one, other) > left:
                    break
                side = 1.0 if one < other else -1.0
                fresh = True
                gone += min(one, other)
                left = dt - gone
                if left <= 0.0:
                    side = 0.0
                    break
                a, w = u0 + (u1 - u0) * (gone / dt), g0 + (g1 - g0) * (gone / dt)
                began = s
                out[SLIPS] += 1.0
                if math.isnan(out[FIRST]):
                    out[FIRST] = i * dt + gone
            kinetic = friction[2] if side > 0.0 else friction[3]
            c = -a - side * kinetic * w
            d = (-(u1 - u0) - side * kinetic * (g1 - g0)) / dt
            if fresh:
                v = 0.0
                if c * side < 1e-14 * (abs(u0) + abs(u1)):
                    c = 0.0
            t = first_zero(v, c, d, left)
            stops = t <= left
            t = min(t, left)
            if d != 0.0 and 0.0 < -c / d < 1.000001 * left:
                out[MARGIN] = min(out[MARGIN], abs(v - 0.5 * c * c / d))
            for k in (-1.0, 1.0):
                at = t * (0.5 + k * GAUSS)
                speed = v + at * (c + 0.5 * d * at)
                push = -(a + (u1 - u0) * (at / dt))
                out[GIVEN] += 0.5 * t * push * speed
                out[TAKEN] += 0.5 * t * kinetic * (w + (g1 - g0) * (at / dt)) * side * speed
            if d != 0.0 and 0.0 < -c / d < t:
                out[SPEED] = max(out[SPEED], abs(v - 0.5 * c * c / d))
            s += t * (v + t * (0.5 * c + d * t / 6.0))
            out[SPEED] = max(out[SPEED], abs(v + t * (c + 0.5 * d * t)))
            v = 0.0 if stops else v + t * (c + 0.5 * d * t)
            if not stops:
                out[MARGIN] = min(out[MARGIN], abs(v))
                break
            out[PATH] += abs(s - began)
            out[FORWARD], out[BACKWARD] = max(out[FORWARD], s), max(out[BACKWARD], -s)
            came, side = side, 0.0
            gone += t
    if side != 0.0:
        kinetic = friction[2] if side > 0.0 else friction[3]
        out[AFTER] = 0.5 * v * v / (kinetic * G)
        out[TAKEN] += 0.5 * v * v
        s += side * out[AFTER]
        out[PATH] += abs(s - began)
        out[FORWARD], out[BACKWARD] = max(out[FORWARD], s), max(out[BACKWARD], -s)
    out[RESIDUAL] = s


@njit(nogil=True, cache=True)
def runs(record, vertical, dt, friction, factors):
    """Results (n, 11) of runs with friction (n, 4) and factors (n,)."""
    out = np.empty((factors.size, 11))
    for j in range(factors.size):
        run(record, vertical, dt, friction[j], factors[j], out[j])
    return out
