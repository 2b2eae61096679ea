"""Compiled response of an isolated platform between compliant stops: exact pieces between located events.

Between events the platform is linear under ground acceleration that is linear between samples, so that its displacement
is a Taylor series about the start of the piece.  Yielding, unloading, sticking, and the begin and end of contact are
looked for on this series; the earliest event ends the piece, and the next piece starts there.
"""

from typing import Any

import numpy as np

from ...core.compiled import kernel
from .pieces import pieces

TERMS = 40
"""Most terms of a series; a piece that needs more is halved."""
FEWEST = 5
SMALL = 1e-17
PARTS = 4
"""Parts of a piece at whose ends events are looked for."""
HALVINGS = 60
COST = 500.0
"""Of a sample, ns."""
NEVER = 2.0
FREE = 0.0
STILL = 1e-13
"""Velocity below which a platform that turns has not turned yet, m/s: rounding neither stops nor starts it."""
TOUCH = 1e-12
"""Force over mass below which a stop neither begins nor ends to push, m/s²."""
BEYOND = 1e-15
"""Displacement beyond that at yielding below which a spring has not yielded, m."""


@kernel()
def _series(u, v, stiff, damp, force, slope, h, terms):
    """Fill the terms h^k u_k of u'' = force - slope t - damp u' - stiff u from u and v; return their number, or 0."""
    terms[0] = u
    terms[1] = h * v
    terms[2] = 0.5 * h * h * (force - damp * v - stiff * u)
    terms[3] = h * (-h * h * slope - 2.0 * damp * terms[2] - stiff * h * terms[1]) / 6.0
    for k in range(2, TERMS - 2):
        terms[k + 2] = -h * (damp * (k + 1) * terms[k + 1] + stiff * h * terms[k]) / ((k + 1) * (k + 2))
        if k >= FEWEST and max(abs(terms[k + 1]), abs(terms[k + 2])) < SMALL:
            return k + 3
    return 0


@kernel()
def _at(terms, number, x):
    """Return the displacement at a share x of the piece, and its change per piece."""
    u = 0.0
    rate = 0.0
    for j in range(number - 1, -1, -1):
        rate = rate * x + u
        u = u * x + terms[j]
    return u, rate


@kernel()
def _sprung(u, v, flow, plastic, yields):
    """Return a number that is positive once the spring has yielded, or unloaded, or its slip has ended."""
    if flow == FREE:
        return abs(u - plastic) - yields - BEYOND
    return -flow * v - STILL


@kernel()
def _pushed(u, v, contact, stop):
    """Return a number that is positive once a stop has begun to push, or has ended to."""
    clearance, hard, viscous = stop
    if contact == FREE:
        side = 1.0 if u > 0.0 else -1.0
        deep = hard * (side * u - clearance)
        return min(deep, deep + viscous * side * v) - TOUCH
    return -hard * (contact * u - clearance) - viscous * contact * v - TOUCH


@kernel()
def _excess(terms, number, h, x, which, flow, plastic, yields, contact, stop):
    u, rate = _at(terms, number, x)
    return _sprung(u, rate / h, flow, plastic, yields) if which == 0 else _pushed(u, rate / h, contact, stop)


@kernel()
def _first(terms, number, h, which, flow, plastic, yields, contact, stop):
    """Return the share of the piece at which the spring (which 0) or the stop (1) has its first event, or NEVER."""
    for part in range(PARTS):
        low = part / PARTS
        high = (part + 1) / PARTS
        reached = _excess(terms, number, h, high, which, flow, plastic, yields, contact, stop) > 0.0
        if not reached:  # (it may go there and turn back within the part)
            before = _at(terms, number, low)[1]
            if before * _at(terms, number, high)[1] < 0.0:
                left, right = low, high
                for _ in range(HALVINGS):
                    middle = 0.5 * (left + right)
                    if _at(terms, number, middle)[1] * before > 0.0:
                        left = middle
                    else:
                        right = middle
                high = left
                reached = _excess(terms, number, h, high, which, flow, plastic, yields, contact, stop) > 0.0
        if reached:
            for _ in range(HALVINGS):
                middle = 0.5 * (low + high)
                if _excess(terms, number, h, middle, which, flow, plastic, yields, contact, stop) > 0.0:
                    high = middle
                else:
                    low = middle
            return high
    return NEVER


def stopped_response(ground, dt, parts, spring, stop, start, displacement, acceleration) -> Any:
    """Fill displacement, m, and absolute acceleration, m/s², of a platform; return its strikes and their peak.

    The equation is u'' = -a - damping u' - spring - stop, all over the mass.

    `spring`: damping, 1/s, stiffnesses before and after yielding, 1/s², yield displacement, m, and force at zero
    displacement after yielding, m/s². An infinite yield displacement is a linear spring, one of 0 rigid until it slips
    (a pendulum). `stop`: clearance, m, stiffness, 1/s², and viscosity, 1/s. Beyond the clearance it pushes back with
    stiffness times depth + viscosity times rate, and never pulls. `start`: displacement and velocity; a pendulum starts
    at rest. The ground acceleration (n,), m/s², is linear between samples dt apart; the results have `parts` samples
    per step: ((n - 1) parts + 1,). The peak is the maximum absolute acceleration at samples while a stop pushes.
    """
    state = (*start, 0.0, FREE, FREE, 0, 0.0)
    for first, end in pieces(displacement.size, COST):
        state = _stopped_response(ground, dt, parts, spring, stop, first, end, state, displacement, acceleration)
    return state[-2:]


@kernel(keep=True)
def _stopped_response(ground, dt, parts, spring, stop, first, end, state, displacement, acceleration):
    """Fill samples `first` to `end` - 1 of `stopped_response`; return its state, which ends with strikes and peak."""
    damping, initial, after, yields, slip = spring
    clearance, hard, viscous = stop
    u, v, plastic, flow, contact, strikes, peak = state
    rigid = yields == 0.0
    terms = np.empty(TERMS)
    step = dt / parts
    for k in range(first, end):
        i = min(k // parts, ground.size - 2)
        slope = (ground[i + 1] - ground[i]) / dt
        now = ground[i] + slope * (k - i * parts) * step
        left = step
        sampled = False
        while left > 0.0:
            pushed = contact * hard * (contact * u - clearance) if contact != FREE else 0.0
            stuck = rigid and flow == FREE
            if stuck:  # (at a sample it may stick, stop or start: what follows holds just after it)
                pull = now + after * u + pushed
                if abs(pull) > slip:
                    flow = -1.0 if pull > 0.0 else 1.0
                    stuck = False
            if not sampled:
                displacement[k] = u
                if stuck:
                    acceleration[k] = now
                else:
                    restoring = initial * u - (initial - after) * plastic if flow == FREE else after * u + slip * flow
                    viscosity = damping if contact == FREE else damping + viscous
                    acceleration[k] = -restoring - viscosity * v - pushed
                if contact != FREE:
                    peak = max(peak, abs(acceleration[k]))
                sampled = True
                if k + 1 == displacement.size:
                    break
            if stuck:
                # (it starts where |pull| passes the friction on a straight line)
                wait = left
                if slope > 0.0:
                    wait = min(left, max(0.0, (slip - pull) / slope))
                elif slope < 0.0:
                    wait = min(left, max(0.0, (-slip - pull) / slope))
                now += slope * wait
                left -= wait
                if left > 0.0:
                    flow = -1.0 if slope > 0.0 else 1.0
                continue
            stiff, damp, force = after, damping, -slip * flow - now
            if flow == FREE:
                stiff, force = initial, (initial - after) * plastic - now
            if contact != FREE:
                stiff += hard
                damp += viscous
                force += contact * hard * clearance
            h = left
            number = 0
            while number == 0:
                number = _series(u, v, stiff, damp, force, slope, h, terms)
                if number == 0:
                    h = 0.5 * h
            spring_at = _first(terms, number, h, 0, flow, plastic, yields, contact, stop)
            stop_at = _first(terms, number, h, 1, flow, plastic, yields, contact, stop)
            share = min(1.0, spring_at, stop_at)
            u, rate = _at(terms, number, share)
            v = rate / h
            now += slope * share * h
            left = 0.0 if share * h >= left else left - share * h
            if stop_at <= min(1.0, spring_at):
                if contact == FREE:
                    contact = 1.0 if u > 0.0 else -1.0
                    strikes += 1
                else:
                    contact = FREE
            elif spring_at <= 1.0:
                if flow == FREE:
                    flow = 1.0 if u > plastic else -1.0
                else:
                    plastic = u - flow * yields
                    flow = FREE
                    if rigid:
                        plastic = 0.0
                        v = 0.0
                        # a stop that it had left pushes again once it is at rest
                        if contact == FREE and abs(u) > clearance:
                            contact = 1.0 if u > 0.0 else -1.0
    return u, v, plastic, flow, contact, strikes, peak
