"""Turns, crossings and ends of samples of many lanes, solved together in vectors: a column for each."""

import math

import numpy as np

from ...core.compiled import kernel
from .events import TURN, first_event
from .regions import raise_peak
from .series import evaluate, linear_series, rate_bound, series_degree
from .tables import (
    ACCELERATION,
    BACK,
    BARE,
    CALM_MARGIN,
    FRONT,
    FUSED,
    LANES,
    PIECE_A,
    PIECE_DAMPING,
    PIECE_GAP,
    PIECE_MOVED,
    PIECE_OMEGA,
    PIECE_ROWS,
    PIECE_SLOPE,
    PIECE_SPAN,
    PIECE_SPEED,
    PIECE_STIFFNESS,
    PIECE_SURE,
    PIECE_TIME,
    ROW_CALM_LOWER,
    ROW_CALM_UPPER,
    ROW_LOWER,
    ROW_UPPER,
    TURN_COLUMNS,
)


@kernel(inline="always")
def _unit_series(omega, a, slope, stiffness, c, h):
    """Return Taylor coefficients 1 … 12 of the displacement in t/h; for rate * h <= 1/4 the next are below rounding.

    y_k = -(c h y_(k-1)/k + K h² y_(k-2)/(k (k-1))), with the forcing's slope in y_3.  Written out, or the loops over
    pieces that call it would not be vectorised.
    """
    d = -c * h
    s = -stiffness * h * h
    y1 = omega * h
    y2 = 0.5 * a * h * h
    y3 = (slope * h * h * h + 2.0 * d * y2 + s * y1) * (1.0 / 6.0)
    y4 = d * y3 * (1.0 / 4.0) + s * y2 * (1.0 / 12.0)
    y5 = d * y4 * (1.0 / 5.0) + s * y3 * (1.0 / 20.0)
    y6 = d * y5 * (1.0 / 6.0) + s * y4 * (1.0 / 30.0)
    y7 = d * y6 * (1.0 / 7.0) + s * y5 * (1.0 / 42.0)
    y8 = d * y7 * (1.0 / 8.0) + s * y6 * (1.0 / 56.0)
    y9 = d * y8 * (1.0 / 9.0) + s * y7 * (1.0 / 72.0)
    y10 = d * y9 * (1.0 / 10.0) + s * y8 * (1.0 / 90.0)
    y11 = d * y10 * (1.0 / 11.0) + s * y9 * (1.0 / 110.0)
    y12 = d * y11 * (1.0 / 12.0) + s * y10 * (1.0 / 132.0)
    return y1, y2, y3, y4, y5, y6, y7, y8, y9, y10, y11, y12


@kernel(inline="always")
def _unit_value(y, t):
    """Return the displacement at t (in units of the step) of a unit series."""
    s = y[9] + t * (y[10] + t * y[11])
    s = y[4] + t * (y[5] + t * (y[6] + t * (y[7] + t * (y[8] + t * s))))
    return t * (y[0] + t * (y[1] + t * (y[2] + t * (y[3] + t * s))))


@kernel(inline="always")
def _unit_speed(y, t):
    """Return the velocity at t of a unit series."""
    s = 10.0 * y[9] + t * (11.0 * y[10] + t * (12.0 * y[11]))
    s = 5.0 * y[4] + t * (6.0 * y[5] + t * (7.0 * y[6] + t * (8.0 * y[7] + t * (9.0 * y[8] + t * s))))
    return y[0] + t * (2.0 * y[1] + t * (3.0 * y[2] + t * (4.0 * y[3] + t * s)))


@kernel(inline="always")
def _unit_acceleration(y, t):
    """Return the acceleration at t of a unit series."""
    s = 90.0 * y[9] + t * (110.0 * y[10] + t * (132.0 * y[11]))
    s = 20.0 * y[4] + t * (30.0 * y[5] + t * (42.0 * y[6] + t * (56.0 * y[7] + t * (72.0 * y[8] + t * s))))
    return 2.0 * y[1] + t * (6.0 * y[2] + t * (12.0 * y[3] + t * s))


@kernel(inline="always")
def _unit_jerk(y, t):
    """Return the third derivative at t of a unit series, accurate enough for a correction of second order."""
    return 6.0 * y[2] + t * (24.0 * y[3] + t * (60.0 * y[4] + t * (120.0 * y[5] + t * (210.0 * y[6]))))


@kernel(**BARE)
def solve_crossings(v, n):
    """Solve for the time at which each of n pieces (columns of v) covers its gap, directly or after one turn.

    The parabola's root, a cubic correction, and two of Chebyshev's third-order steps; SURE if they converged.
    """
    for j in range(n):
        omega = v[PIECE_OMEGA * LANES + j]
        a = v[PIECE_A * LANES + j]
        h = v[PIECE_SPAN * LANES + j]
        gap = v[PIECE_GAP * LANES + j]
        y = _unit_series(
            omega,
            a,
            v[PIECE_SLOPE * LANES + j],
            v[PIECE_STIFFNESS * LANES + j],
            v[PIECE_DAMPING * LANES + j],
            h,
        )
        root = math.sqrt(max(y[0] * y[0] + 4.0 * y[1] * gap, 0.0))
        if y[0] * gap > 0.0:
            t = 2.0 * gap / (y[0] + math.copysign(root, gap))
        else:
            t = -0.5 * (y[0] + math.copysign(root, y[0])) / y[1]
        t -= y[2] * t * t * t / (y[0] + 2.0 * y[1] * t)
        step = (gap - _unit_value(y, t)) / _unit_speed(y, t)
        t += step * (1.0 - 0.5 * _unit_acceleration(y, t) / _unit_speed(y, t) * step)
        speed = _unit_speed(y, t)
        acceleration = _unit_acceleration(y, t)
        step = (gap - _unit_value(y, t)) / speed
        bend = 0.5 * acceleration / speed * step
        t += step * (1.0 - bend)
        v[PIECE_TIME * LANES + j] = t * h
        v[PIECE_SPEED * LANES + j] = (speed + acceleration * step) / h
        sure = (abs(step) <= 1e-6 * t) & (abs(bend) <= 1e-6) & (t > 0.0) & (t <= 1.0)
        v[PIECE_SURE * LANES + j] = 1.0 if sure else 0.0


@kernel(**FUSED)
def _solve_turns(v, n):
    """Solve for the displacement at the turn of each of n pieces that turn once; 0 if the velocity only dips."""
    for j in range(n):
        y = _unit_series(
            v[PIECE_OMEGA * TURN_COLUMNS + j],
            v[PIECE_A * TURN_COLUMNS + j],
            v[PIECE_SLOPE * TURN_COLUMNS + j],
            v[PIECE_STIFFNESS * TURN_COLUMNS + j],
            v[PIECE_DAMPING * TURN_COLUMNS + j],
            v[PIECE_SPAN * TURN_COLUMNS + j],
        )
        end = _unit_speed(y, 1.0)
        # first guess: the parabola of the velocity through both ends, which has its zero between them
        curve = end - y[0] - 2.0 * y[1]
        root = math.sqrt(max(y[1] * y[1] - curve * y[0], 0.0))
        t = y[0] / (math.copysign(root, y[0]) - y[1])
        step = 0.0
        bend = 0.0
        for _ in range(2):
            acceleration = _unit_acceleration(y, t)
            step = -_unit_speed(y, t) / acceleration
            bend = 0.5 * _unit_jerk(y, t) / acceleration * step
            t += step * (1.0 - bend)
        turns = (y[0] * end < 0.0) & (abs(step) <= 1e-5) & (abs(bend) <= 1e-4) & (t > 0.0) & (t < 1.0)
        # a dip that does not reach zero: the velocity at its extremum keeps its sign
        dip = y[1] / (y[1] - 0.5 * _unit_acceleration(y, 1.0))
        for _ in range(2):
            dip -= _unit_acceleration(y, dip) / _unit_jerk(y, dip)
        passes = (y[0] * end > 0.0) & (dip > 0.0) & (dip < 1.0) & (abs(_unit_acceleration(y, dip)) <= 1e-6 * abs(y[1]))
        passes = passes & (_unit_speed(y, dip) * y[0] > 1e-6 * y[0] * y[0])
        # from rest: the acceleration has no zero but where it may begin
        starts = (y[0] == 0.0) & ((y[1] == 0.0) | (y[1] * _unit_acceleration(y, 1.0) > 0.0))
        v[PIECE_MOVED * TURN_COLUMNS + j] = _unit_value(y, t) if turns else 0.0
        v[PIECE_SURE * TURN_COLUMNS + j] = 1.0 if turns | passes | starts else 0.0


@kernel(**BARE)
def finish_pieces(v, n):
    """Solve for displacement and velocity of each of n pieces at its end; SURE if it provably has no event."""
    for j in range(n):
        omega = v[PIECE_OMEGA * LANES + j]
        a = v[PIECE_A * LANES + j]
        slope = v[PIECE_SLOPE * LANES + j]
        h = v[PIECE_SPAN * LANES + j]
        gap = v[PIECE_GAP * LANES + j]
        y = _unit_series(omega, a, slope, v[PIECE_STIFFNESS * LANES + j], v[PIECE_DAMPING * LANES + j], h)
        moved = _unit_value(y, 1.0)
        speed = _unit_speed(y, 1.0)
        dips = (omega * a < 0.0) & (omega * _unit_acceleration(y, 1.0) > 0.0)
        v[PIECE_MOVED * LANES + j] = moved
        v[PIECE_SPEED * LANES + j] = speed / h
        sure = (speed * gap > 0.0) & (abs(moved) < abs(gap)) & (moved * gap > 0.0) & (not dips)
        v[PIECE_SURE * LANES + j] = 1.0 if sure else 0.0


@kernel(**BARE)
def _set_calm_interval(s, lane, x):
    """Set the interval in which turns do not matter, from the peak so far."""
    s[ROW_CALM_UPPER * LANES + lane] = min(x[FRONT], s[ROW_UPPER * LANES + lane]) - x[CALM_MARGIN]
    s[ROW_CALM_LOWER * LANES + lane] = max(-x[BACK], s[ROW_LOWER * LANES + lane]) + x[CALM_MARGIN]


@kernel(inline="always")
def whole(n):
    """Return a number of columns in whole vectors, so that the bits of a piece do not depend on its neighbours.

    Further columns contain earlier pieces, or the pieces that `no_pieces` wrote.
    """
    return (n + 7) // 8 * 8


@kernel()
def no_pieces(columns):
    """Return room for pieces that are solved together, filled with harmless pieces."""
    v = np.zeros(PIECE_ROWS * columns)
    v[PIECE_OMEGA * columns : (PIECE_OMEGA + 1) * columns] = 1.0
    v[PIECE_A * columns : (PIECE_A + 1) * columns] = -2.0
    v[PIECE_SPAN * columns : (PIECE_SPAN + 1) * columns] = 1.0
    v[PIECE_GAP * columns : (PIECE_GAP + 1) * columns] = 0.1
    return v


@kernel(**FUSED)
def flush_turns(w, n, poly):
    """Solve the turns that have gathered; each may raise the peak of its lane."""
    v = w.turns
    _solve_turns(v, whole(n))
    for j in range(n):
        lane = w.turn_lane[j]
        theta = v[PIECE_GAP * TURN_COLUMNS + j]
        # a turn next to a sample must not come out lower than the sample, by rounding
        x = w.x[lane]
        k = w.k[lane]
        raise_peak(x, k, theta)
        raise_peak(x, k, v[PIECE_TIME * TURN_COLUMNS + j])
        if v[PIECE_SURE * TURN_COLUMNS + j] == 1.0:
            raise_peak(x, k, theta + v[PIECE_MOVED * TURN_COLUMNS + j])
            _set_calm_interval(w.rows, lane, x)  # a parked lane's rows are rewritten in any case
            continue
        # a dip of the velocity, or too flat for the batch's steps: each turn by the general way
        stiffness = v[PIECE_STIFFNESS * TURN_COLUMNS + j]
        c = v[PIECE_DAMPING * TURN_COLUMNS + j]
        omega = v[PIECE_OMEGA * TURN_COLUMNS + j]
        a = v[PIECE_A * TURN_COLUMNS + j]
        slope = v[PIECE_SLOPE * TURN_COLUMNS + j]
        left = v[PIECE_SPAN * TURN_COLUMNS + j]
        kind = TURN
        while kind == TURN and left > 0.0:
            degree = series_degree(rate_bound(stiffness, c) * left)
            linear_series(poly, a, omega, c, stiffness, slope, degree)
            kind, t, moved, _ = first_event(poly, degree, left, 0.0, -math.inf, math.inf, -1.0)
            theta += moved
            a = evaluate(poly[ACCELERATION], degree, t)
            omega = 0.0
            left -= t
            if kind == TURN:
                raise_peak(x, k, theta)
