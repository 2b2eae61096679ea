"""Compiled oscillators: exact response to base acceleration that is linear between samples.

Arguments and results are numbers and arrays; labels, units and validation belong to the calling modules.

The relative displacement u of an oscillator obeys u'' + 2 zeta omega u' + omega² u = -a(t). Let s be the response to an
initial velocity of one, and c the response to an initial displacement of one. S1 and S2 are the first and second
integral of s over a step h. A linear segment from a0 to a1 then takes (u, v) to

    u1 = c u0 + s v0 - S1 a0 - (S2/h) (a1 - a0)
    v1 = -omega² s u0 + (c - 2 zeta omega s) v0 - s a0 - (S1/h) (a1 - a0)

which is the recurrence of Nigam and Jennings (1969) without their differences of nearly equal numbers. S1 and S2 come
from their Taylor series if omega h <= 1. Then c = 1 - omega² S1, s = h - omega² S2 - 2 zeta omega S1 follow.

Peaks between samples: displacement, velocity and absolute acceleration are each q = alpha u + beta v, and q'' is a free
damped oscillation (the forcing has no second derivative). It thus has at most one zero in a step of omega h <= 1 and is
bounded on the step by its values at the ends. This bound shows at little cost that most steps cannot contain a new
peak. The few other steps are searched, between the zero of q'' and the ends, for zeros of q'.

"""

import math
from typing import Any

import numpy as np

from ...core.compiled import kernel
from .pieces import pieces

_LANES: dict[str, Any] = {"_nrt": False}

# Columns of a transition: u1 = UU u0 + UV v0 + U0 a0 + U1 a1, v1 = VU u0 + VV v0 + V0 a0 + V1 a1.
UU, UV, U0, U1, VU, VV, V0, V1 = range(8)
TRANSITION_ROWS = 8

# Rows of the lanes' flat array: first the transition, then these rows; ALPHA, BETA and PEAK are the first of three
# rows, one for each quantity.
LANES = 64
ROW_U, ROW_V, ROW_W, ROW_U_BEFORE, ROW_V_BEFORE, ROW_W_BEFORE, ROW_SQUARE, ROW_TWICE, ROW_LOOK = range(8, 17)
ROW_ALPHA, ROW_BETA, ROW_PEAK = 17, 20, 23
LANE_ROWS = 26

# Factor of the bound on a peak inside a step. It is 1/8 (of h² q''), times the maximum growth of a free oscillation
# inside a step over its ends, exp(1)/cos(1/2) for omega h <= 1 and zeta <= 1, rounded up.
BULGE = 0.4
MOST_ITERATIONS = 60
MOST_TERMS = 60


@kernel()
def basis(omega, zeta, t):
    """Return c, s, S1, S2 at t: responses to unit displacement and unit velocity, first and second integral of s."""
    x = omega * t
    if x <= 1.0:
        # sigma'' + 2 zeta sigma' + sigma = 0 in x = omega t, sigma(0) = 0, sigma'(0) = 1
        before = 0.0
        coefficient = 1.0
        first = 0.0
        second = 0.0
        power = x * x
        k = 1
        while k < MOST_TERMS:
            term = coefficient * power / (k + 1)
            first += term
            second += term * x / (k + 2)
            if abs(coefficient * power) + abs(before * power) <= 1e-18 * abs(first):
                break
            after = -(2.0 * zeta * k * coefficient + before) / (k * (k + 1))
            before = coefficient
            coefficient = after
            power *= x
            k += 1
        c = 1.0 - first
        s = (x - second - 2.0 * zeta * first) / omega
        return c, s, first / (omega * omega), second / (omega * omega * omega)
    damped = math.sqrt((1.0 - zeta) * (1.0 + zeta))
    decay = math.exp(-zeta * x)
    s = decay * math.sin(damped * x) / damped
    c = decay * math.cos(damped * x) + zeta * s
    first = 1.0 - c
    second = x - s - 2.0 * zeta * first
    return c, s / omega, first / (omega * omega), second / (omega * omega * omega)


@kernel()
def transitions(omega, zeta, h, out):
    """Compute the transition of every oscillator over a step h; omega, zeta (oscillator,), out (8, oscillator)."""
    for i in range(omega.size):
        c, s, first, second = basis(omega[i], zeta[i], h)
        out[UU, i] = c
        out[UV, i] = s
        out[U0, i] = second / h - first
        out[U1, i] = -second / h
        out[VU, i] = -omega[i] * omega[i] * s
        out[VV, i] = c - 2.0 * zeta[i] * omega[i] * s
        out[V0, i] = first / h - s
        out[V1, i] = -first / h


@kernel()
def _next(step, j, u, v, a0, a1):
    """Return displacement and velocity of oscillator j after one step of the transition `step` (8, oscillator)."""
    return (
        step[UU, j] * u + step[UV, j] * v + step[U0, j] * a0 + step[U1, j] * a1,
        step[VU, j] * u + step[VV, j] * v + step[V0, j] * a0 + step[V1, j] * a1,
    )


@kernel(**_LANES)
def _series(bend, jerk, twice, square, h, terms):
    """Compute the Taylor terms of a free oscillation of value `bend` and slope `jerk`, over h; return their number."""
    terms[0] = bend
    terms[1] = jerk * h
    small = 1e-18 * (abs(terms[0]) + abs(terms[1]))
    n = 2
    while n < MOST_TERMS:
        terms[n] = -(twice * h * (n - 1) * terms[n - 1] + square * h * h * terms[n - 2]) / (n * (n - 1))
        n += 1
        if abs(terms[n - 1]) + abs(terms[n - 2]) <= small:
            break
    return n


@kernel(**_LANES)
def _at(terms, n, q, slope, order, x):
    """Return q (order 0), or its first or second derivative by x = t/h, at x; `q` and `slope` are those at x = 0."""
    total = 0.0
    if order == 2:
        for k in range(n - 1, -1, -1):
            total = total * x + terms[k]
        return total
    if order == 1:
        for k in range(n - 1, -1, -1):
            total = total * x + terms[k] / (k + 1)
        return slope + total * x
    for k in range(n - 1, -1, -1):
        total = total * x + terms[k] / ((k + 1) * (k + 2))
    return q + x * (slope + x * total)


@kernel(**_LANES)
def _zero(terms, n, q, slope, order, left, right, at_left, at_right):
    """Return the zero of a derivative between left and right, if its signs differ, by bracketed secants."""
    x = left
    side = 0
    for _ in range(MOST_ITERATIONS):
        x = left + (right - left) * at_left / (at_left - at_right)
        if not left < x < right:
            x = 0.5 * (left + right)
        value = _at(terms, n, q, slope, order, x)
        # a peak is flat: an error of 1e-9 in x gives an error of 1e-18 in the peak
        if value == 0.0 or right - left <= 1e-9 or abs(value) <= 1e-10 * abs(at_left - at_right):
            break
        # Illinois rule: the value at an end that is kept twice is halved
        if (value > 0.0) == (at_left > 0.0):
            left, at_left = x, value
            if side == -1:
                at_right *= 0.5
            side = -1
        else:
            right, at_right = x, value
            if side == 1:
                at_left *= 0.5
            side = 1
    return x


@kernel(**_LANES)
def _peak_inside(q, slope, bend, jerk, twice, square, h, terms):
    """Return the maximum |q| at zeros of q' inside a step (0 without zeros), from q and its derivatives at the start.

    q'' is a free oscillation with the value `bend` and the slope `jerk` at the start.  `terms` is a work array.
    """
    n = _series(bend * h * h, jerk * h * h, twice, square, h, terms)
    slope *= h
    slope_1 = _at(terms, n, q, slope, 1, 1.0)
    bend_0 = terms[0]
    bend_1 = _at(terms, n, q, slope, 2, 1.0)
    middle = 1.0
    slope_middle = slope_1
    if bend_0 * bend_1 < 0.0:
        middle = _zero(terms, n, q, slope, 2, 0.0, 1.0, bend_0, bend_1)
        slope_middle = _at(terms, n, q, slope, 1, middle)
    best = 0.0
    if slope * slope_middle < 0.0:
        x = _zero(terms, n, q, slope, 1, 0.0, middle, slope, slope_middle)
        best = abs(_at(terms, n, q, slope, 0, x))
    if middle < 1.0 and slope_middle * slope_1 < 0.0:
        x = _zero(terms, n, q, slope, 1, middle, 1.0, slope_middle, slope_1)
        best = max(best, abs(_at(terms, n, q, slope, 0, x)))
    return best


@kernel(**_LANES)
def _advance(s, n, a0, a1):
    """Advance n lanes by one step, and keep the state before it.

    The loop is vectorised because the rows lie at constant offsets in one flat array and the number of lanes is known
    at run time only.
    """
    for j in range(n):
        u = s[ROW_U * LANES + j]
        v = s[ROW_V * LANES + j]
        u1 = s[UU * LANES + j] * u + s[UV * LANES + j] * v + s[U0 * LANES + j] * a0 + s[U1 * LANES + j] * a1
        v1 = s[VU * LANES + j] * u + s[VV * LANES + j] * v + s[V0 * LANES + j] * a0 + s[V1 * LANES + j] * a1
        s[ROW_U_BEFORE * LANES + j] = u
        s[ROW_V_BEFORE * LANES + j] = v
        s[ROW_W_BEFORE * LANES + j] = s[ROW_W * LANES + j]
        s[ROW_U * LANES + j] = u1
        s[ROW_V * LANES + j] = v1
        s[ROW_W * LANES + j] = -a1 - s[ROW_TWICE * LANES + j] * v1 - s[ROW_SQUARE * LANES + j] * u1


@kernel(**_LANES)
def _look(s, n, slope, room, alpha, beta, peak):
    """Update the peaks of one quantity at the samples; return the number of lanes that may have a larger one inside."""
    count = 0
    for j in range(n):
        u0 = s[ROW_U_BEFORE * LANES + j]
        v0 = s[ROW_V_BEFORE * LANES + j]
        w0 = s[ROW_W_BEFORE * LANES + j]
        u1 = s[ROW_U * LANES + j]
        v1 = s[ROW_V * LANES + j]
        w1 = s[ROW_W * LANES + j]
        twice = s[ROW_TWICE * LANES + j]
        square = s[ROW_SQUARE * LANES + j]
        for_u = s[alpha * LANES + j]
        for_v = s[beta * LANES + j]
        slope_0 = for_u * v0 + for_v * w0
        slope_1 = for_u * v1 + for_v * w1
        bend_0 = for_u * w0 - for_v * (slope + twice * w0 + square * v0)
        bend_1 = for_u * w1 - for_v * (slope + twice * w1 + square * v1)
        q0 = abs(for_u * u0 + for_v * v0)
        q1 = abs(for_u * u1 + for_v * v1)
        top = q0 if q0 > q1 else q1
        best = s[peak * LANES + j]
        best = top if top > best else best
        s[peak * LANES + j] = best
        most = abs(bend_0) if abs(bend_0) > abs(bend_1) else abs(bend_1)
        look = ((slope_0 * slope_1 < 0.0) | (bend_0 * bend_1 < 0.0)) & (top + room * most > best)
        s[ROW_LOOK * LANES + j] = 1.0 if look else 0.0
        if look:
            count += 1
    return count


@kernel(**_LANES)
def _look_displacement(s, n, slope, room):
    """Apply `_look` to the displacement; compiled separately, because a larger function would not be vectorised."""
    return _look(s, n, slope, room, ROW_ALPHA, ROW_BETA, ROW_PEAK)


@kernel(**_LANES)
def _look_velocity(s, n, slope, room):
    return _look(s, n, slope, room, ROW_ALPHA + 1, ROW_BETA + 1, ROW_PEAK + 1)


@kernel(**_LANES)
def _look_acceleration(s, n, slope, room):
    return _look(s, n, slope, room, ROW_ALPHA + 2, ROW_BETA + 2, ROW_PEAK + 2)


@kernel(**_LANES)
def _search(s, n, quantity, slope, h, terms):
    """Search the lanes that `_look` has marked, and raise their peaks."""
    for j in range(n):
        if s[ROW_LOOK * LANES + j] > 0.0:
            u0 = s[ROW_U_BEFORE * LANES + j]
            v0 = s[ROW_V_BEFORE * LANES + j]
            w0 = s[ROW_W_BEFORE * LANES + j]
            twice = s[ROW_TWICE * LANES + j]
            square = s[ROW_SQUARE * LANES + j]
            alpha = s[(ROW_ALPHA + quantity) * LANES + j]
            beta = s[(ROW_BETA + quantity) * LANES + j]
            w1 = -slope - twice * w0 - square * v0
            w2 = -twice * w1 - square * w0
            peak = _peak_inside(
                alpha * u0 + beta * v0,
                alpha * v0 + beta * w0,
                alpha * w0 + beta * w1,
                alpha * w1 + beta * w2,
                twice,
                square,
                h,
                terms,
            )
            at = (ROW_PEAK + quantity) * LANES + j
            s[at] = max(s[at], peak)


def oscillator_peaks(acceleration, dt, parts, omega, zeta, out) -> None:
    """Compute the maximum |u|, |u'| and |u'' + a| of oscillators (lane,) from rest, also between samples.

    `acceleration` (n,), step dt divided into `parts` so that omega dt/parts <= 1. `omega`, `zeta` (lane,), at most
    LANES of them. `out` (1 to 3, lane): the first one, two or three of them.
    """
    s = np.zeros(LANE_ROWS * LANES)
    for first, end in pieces(acceleration.size - 1, 3.0 * parts * out.size):
        _oscillator_peaks(acceleration, dt, parts, omega, zeta, first, end, s, out)


@kernel(keep=True)
def _oscillator_peaks(acceleration, dt, parts, omega, zeta, first, end, s, out):
    """Do the steps `first` to `end` - 1 of `oscillator_peaks`; s (LANE_ROWS * LANES,) from piece to piece."""
    n = omega.size
    h = dt / parts
    step = np.empty((TRANSITION_ROWS, n))
    transitions(omega, zeta, h, step)
    for j in range(n if first == 0 else 0):
        for row in range(TRANSITION_ROWS):
            s[row * LANES + j] = step[row, j]
        s[ROW_SQUARE * LANES + j] = omega[j] * omega[j]
        s[ROW_TWICE * LANES + j] = 2.0 * zeta[j] * omega[j]
        s[ROW_W * LANES + j] = -acceleration[0]
        s[ROW_ALPHA * LANES + j] = 1.0
        s[(ROW_BETA + 1) * LANES + j] = 1.0
        # up to its sign the absolute acceleration is omega² u + 2 zeta omega u'
        s[(ROW_ALPHA + 2) * LANES + j] = omega[j] * omega[j]
        s[(ROW_BETA + 2) * LANES + j] = 2.0 * zeta[j] * omega[j]
    room = BULGE * h * h
    terms = np.empty(MOST_TERMS)
    for i in range(first, end):
        rise = (acceleration[i + 1] - acceleration[i]) / parts
        slope = rise / h
        for part in range(parts):
            a0 = acceleration[i] + part * rise
            a1 = acceleration[i + 1] if part == parts - 1 else acceleration[i] + (part + 1) * rise
            _advance(s, n, a0, a1)
            if _look_displacement(s, n, slope, room) > 0:
                _search(s, n, 0, slope, h, terms)
            if out.shape[0] > 1 and _look_velocity(s, n, slope, room) > 0:
                _search(s, n, 1, slope, h, terms)
            if out.shape[0] > 2 and _look_acceleration(s, n, slope, room) > 0:
                _search(s, n, 2, slope, h, terms)
    for quantity in range(out.shape[0]):
        for j in range(n):
            out[quantity, j] = s[(ROW_PEAK + quantity) * LANES + j]


@kernel(keep=True)
def oscillator_history(acceleration, dt, omega, zeta, out):
    """Compute displacement and velocity of one oscillator from rest at the samples; out (2, n)."""
    step = np.empty((TRANSITION_ROWS, 1))
    transitions(np.array([omega]), np.array([zeta]), dt, step)
    u = 0.0
    v = 0.0
    out[0, 0] = 0.0
    out[1, 0] = 0.0
    for i in range(acceleration.size - 1):
        u, v = _next(step, 0, u, v, acceleration[i], acceleration[i + 1])
        out[0, i + 1] = u
        out[1, i + 1] = v


def floor_response(acceleration, dt, parts, omega, zeta, shares, history, peak_acceleration, peak_velocity) -> None:
    """Compute the absolute acceleration of floors and the peaks of it and of the absolute velocity, from rest.

    `shares` (mode, floor): modal participation times shape. The floor's acceleration is a + sum shares u'', its
    velocity v_g + sum shares u', so that the share of omitted modes moves with the ground. `history` (floor, (n - 1)
    parts + 1), or (0, 0) if no history is wanted; peaks (floor,) at the samples of the step dt/parts.
    """
    state = np.zeros(2 * omega.size + 1)
    for first, end in pieces(acceleration.size - 1, 2.0 * parts * (shares.size + omega.size + shares.shape[1])):
        _floor_response(
            acceleration, dt, parts, omega, zeta, shares, first, end, state, history, peak_acceleration, peak_velocity
        )


@kernel(keep=True)
def _floor_response(
    acceleration, dt, parts, omega, zeta, shares, first, end, state, history, peak_acceleration, peak_velocity
):
    """Do the steps `first` to `end` - 1 of `floor_response`; state: u, v (mode,) and the velocity of the ground."""
    modes, floors = shares.shape
    h = dt / parts
    step = np.empty((TRANSITION_ROWS, modes))
    transitions(omega, zeta, h, step)
    square = omega * omega
    twice = 2.0 * zeta * omega
    u = state[:modes]
    v = state[modes : 2 * modes]
    absolute = np.empty(floors)
    velocity = np.empty(floors)
    keep = history.shape[0] > 0
    ground = state[2 * modes]
    for f in range(floors if first == 0 else 0):
        peak_acceleration[f] = abs(acceleration[0] * (1.0 - shares[:, f].sum()))
        peak_velocity[f] = 0.0
        if keep:
            history[f, 0] = acceleration[0] * (1.0 - shares[:, f].sum())
    at = first * parts
    for i in range(first, end):
        rise = (acceleration[i + 1] - acceleration[i]) / parts
        for part in range(parts):
            a0 = acceleration[i] + part * rise
            a1 = acceleration[i + 1] if part == parts - 1 else acceleration[i] + (part + 1) * rise
            ground += 0.5 * h * (a0 + a1)
            at += 1
            for f in range(floors):
                absolute[f] = a1
                velocity[f] = ground
            for m in range(modes):
                u[m], v[m] = _next(step, m, u[m], v[m], a0, a1)
                w = -a1 - twice[m] * v[m] - square[m] * u[m]
                for f in range(floors):
                    absolute[f] += shares[m, f] * w
                    velocity[f] += shares[m, f] * v[m]
            for f in range(floors):
                peak_acceleration[f] = max(peak_acceleration[f], abs(absolute[f]))
                peak_velocity[f] = max(peak_velocity[f], abs(velocity[f]))
            if keep:
                for f in range(floors):
                    history[f, at] = absolute[f]
    state[2 * modes] = ground
