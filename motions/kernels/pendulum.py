"""Compiled response of a friction pendulum: sines between stops and starts, whose instants are found in closed form."""

import math

from ...core.compiled import kernel
from .pieces import pieces

COST = 100.0
"""Of a sample, ns."""
NEAR = 1e-9
"""A root nearer to the start than this, rad, is the stop that the piece begins at."""


@kernel()
def _first_stop(omega, a, b, c, from_rest, limit):
    """Return the first time above 0 at which omega (b cos - a sin) + c is zero; `limit` if it is later, or never.

    Of a piece that begins at rest, the stop that it begins at does not count.
    """
    size = omega * math.sqrt(a * a + b * b)
    if size <= abs(c) or size == 0.0:
        return limit
    # -a sin x + b cos x = r cos(x + phase)
    phase = math.atan2(a, b)
    angle = math.acos(-c / size)
    time = limit
    for sign in (1.0, -1.0):
        x = (sign * angle - phase) % (2.0 * math.pi)
        if not from_rest or NEAR < x < 2.0 * math.pi - NEAR:
            time = min(time, x / omega)
    return time


def pendulum_response(ground, dt, parts, omega, friction, start, displacement, acceleration) -> int:
    """Fill displacement, m, and absolute acceleration, m/s², of a mass on a friction pendulum; return stops and starts.

    u'' = -a - omega² u - friction s, s the sign of the velocity u'; it sticks while |a + omega² u| is at most friction
    (m/s²).  The ground acceleration a (n,), m/s², is linear between samples dt apart; the results have `parts` samples
    a step: ((n - 1) parts + 1,).  It starts at rest at u = start.
    """
    shaken, state, events = (ground, dt, parts, omega, friction), [start, 0.0, 0.0], 0
    for first, end in pieces(displacement.size, COST):
        *state, more = _pendulum_response(*shaken, first, end, *state, displacement, acceleration)
        events += more
    return events


@kernel(keep=True)
def _pendulum_response(ground, dt, parts, omega, friction, first, end, u, v, side, displacement, acceleration):
    """Fill samples `first` to `end` - 1 of `pendulum_response`; return u, v, side (0: it sticks), stops and starts."""
    events = 0
    step = dt / parts
    square = omega * omega
    for k in range(first, end):
        i = min(k // parts, ground.size - 2)
        slope = (ground[i + 1] - ground[i]) / dt
        now = ground[i] + slope * (k - i * parts) * step
        # (at a sample it may stick, stop or start: what follows holds just after it)
        if side == 0.0:
            pull = now + square * u
            if abs(pull) > friction:
                side = -1.0 if pull > 0.0 else 1.0
                events += 1
        displacement[k] = u
        acceleration[k] = now if side == 0.0 else -square * u - friction * side
        if k + 1 == displacement.size:
            break
        left = step
        while left > 0.0:
            if side == 0.0:
                pull = now + square * u
                # (it starts where |pull| passes the friction on a straight line)
                wait = left
                if slope > 0.0:
                    wait = min(left, max(0.0, (friction - pull) / slope))
                elif slope < 0.0:
                    wait = min(left, max(0.0, (-friction - pull) / slope))
                now += slope * wait
                left -= wait
                if left > 0.0:
                    side = -1.0 if slope > 0.0 else 1.0
                    events += 1
                continue
            rise = -slope / square
            rest = -(now + friction * side) / square
            a = u - rest
            b = (v - rise) / omega
            stop = _first_stop(omega, a, b, rise, v == 0.0, left)
            x = omega * stop
            u = a * math.cos(x) + b * math.sin(x) + rest + rise * stop
            v = omega * (b * math.cos(x) - a * math.sin(x)) + rise
            now += slope * stop
            if stop < left or v * side <= 0.0:  # (a stop at a sample may lie on either side of it by rounding)
                v = 0.0
                events += 1
                pull = now + square * u
                side = 0.0 if abs(pull) <= friction else (-1.0 if pull > 0.0 else 1.0)
            left -= stop
    return u, v, side, events
