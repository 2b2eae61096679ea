"""Compiled matching of a motion to a response spectrum, by the smallest change of acceleration that corrects all peaks.

Arguments and results are numbers and arrays; labels, units and validation belong to the calling modules.

The response of oscillator i at the time t_i of its peak is a sum over the samples, u_i = sum_m g_i[m] a[m]. The same is
valid for the velocity and displacement of the motion at any time. With the peaks fixed at their times, the change

    da = w G' x,   (G w G' + regularisation) x = wanted changes

gives all wanted changes together. It is the smallest such change in the norm sum da²/w, where w (time,) is large if the
motion may change much. Its spectral part is a sum of time-reversed impulse responses, as in time-domain matching since
Lilhanand and Tseng. End velocity, end displacement and the peaks of velocity and displacement that exceed their bounds
are rows of the same system. The peaks move, so the step is repeated.

"""

import math
from typing import Any

import numpy as np

from ...core.compiled import kernel

_LANES: dict[str, Any] = {"_nrt": False}
# sums may be taken in another order, the same one on every call
_SUMS: dict[str, Any] = {"_nrt": False, "fastmath": {"reassoc", "contract"}}

FINEST = 0.4  # maximum omega h of a step: a sampled peak is then low by 2 % at most, before the parabola through it
SUPPORT = 6.0  # an impulse response is cut where it has fallen to exp(-6)
MOST_TURNS = 8  # excursions of velocity, and of displacement, that are corrected in one step
LARGEST_STEP = 0.5  # maximum change of one oscillator in one step, over its target
SOFT, HARD = 1e-2, 1e-7  # regularisation of the unit diagonal: oscillators, rest at the end (bounds: an argument)
PATIENCE = 2  # steps without improvement before the best motion is taken up again with half the step
INSIDE = 0.96  # value of a corrected excursion over its bound
NEAR = 0.85  # of the bound: larger excursions are held, so that the correction of others does not push them out

# Rows of the oscillators' flat array.
LANES = 128
UU, UV, U0, U1, VU, VV, V0, V1, ROW_U, ROW_V, ROW_BEST, ROW_SIGNED, ROW_SLOPE, ROW_WHEN = range(14)
LANE_ROWS = 14

# The rows after the oscillators: rest at the end, excursions, and three that are unused.
MORE_ROWS = 2 + 2 * MOST_TURNS + 3

# State of an adjustment between its steps.
STEP, BEST_SCORE, BASE_MERIT, SHARE, IDLE = range(5)

# Results of an adjustment for a motion.
MISFIT, WORST, PGV, PGD, STEPS = range(5)
RESULTS = 5


@kernel()
def _transition(omega, zeta, h, s, j):
    """Compute the exact step of oscillator j, acceleration linear over h (Nigam and Jennings 1969); omega h <= 0.4."""
    x = omega * h
    damped = math.sqrt(1.0 - zeta * zeta)
    decay = math.exp(-zeta * x)
    # series of the response to an initial velocity of one and of its integrals, without differences of near numbers
    before, coefficient, first, second, power = 0.0, 1.0, 0.0, 0.0, x * x
    for k in range(1, 30):
        term = coefficient * power / (k + 1)
        first += term
        second += term * x / (k + 2)
        after = -(2.0 * zeta * k * coefficient + before) / (k * (k + 1))
        before = coefficient
        coefficient = after
        power *= x
    sine = decay * math.sin(damped * x) / damped / omega
    first /= omega * omega
    second /= omega * omega * omega
    c = 1.0 - omega * omega * first
    s[UU * LANES + j] = c
    s[UV * LANES + j] = sine
    s[U0 * LANES + j] = second / h - first
    s[U1 * LANES + j] = -second / h
    s[VU * LANES + j] = -omega * omega * sine
    s[VV * LANES + j] = c - 2.0 * zeta * omega * sine
    s[V0 * LANES + j] = first / h - sine
    s[V1 * LANES + j] = -first / h


@kernel(**_LANES)
def _advance(s, n, a0, a1, when):
    """Advance n oscillators by one step, and keep their maximum |u| so far with its sign, slope and time."""
    for j in range(n):
        u = s[ROW_U * LANES + j]
        v = s[ROW_V * LANES + j]
        u1 = s[UU * LANES + j] * u + s[UV * LANES + j] * v + s[U0 * LANES + j] * a0 + s[U1 * LANES + j] * a1
        v1 = s[VU * LANES + j] * u + s[VV * LANES + j] * v + s[V0 * LANES + j] * a0 + s[V1 * LANES + j] * a1
        s[ROW_U * LANES + j] = u1
        s[ROW_V * LANES + j] = v1
        best = s[ROW_BEST * LANES + j]
        more = abs(u1) > best
        s[ROW_BEST * LANES + j] = abs(u1) if more else best
        s[ROW_SIGNED * LANES + j] = u1 if more else s[ROW_SIGNED * LANES + j]
        s[ROW_SLOPE * LANES + j] = v1 if more else s[ROW_SLOPE * LANES + j]
        s[ROW_WHEN * LANES + j] = when if more else s[ROW_WHEN * LANES + j]


@kernel(keep=True)
def peaks(a, dt, omega, zeta, value, when):
    """Compute signed peak pseudo-accelerations of oscillators (i,), by falling period, and their times, in place."""
    first = 0
    s = np.empty(LANE_ROWS * LANES)
    while first < omega.size:
        parts = max(1, math.ceil(omega[first] * dt / FINEST))
        last = first
        while last < omega.size and last - first < LANES and max(1, math.ceil(omega[last] * dt / FINEST)) == parts:
            last += 1
        n = last - first
        h = dt / parts
        s[:] = 0.0
        for j in range(n):
            _transition(omega[first + j], zeta, h, s, j)
        for i in range(a.size - 1):
            rise = (a[i + 1] - a[i]) / parts
            for part in range(parts):
                a0 = a[i] + part * rise
                _advance(s, n, a0, a0 + rise, i * dt + (part + 1) * h)
        for j in range(n):
            w = omega[first + j]
            u = s[ROW_SIGNED * LANES + j]
            v = s[ROW_SLOPE * LANES + j]
            at = s[ROW_WHEN * LANES + j]
            x = min(at / dt, a.size - 1.0)
            k = min(int(x), a.size - 2)
            bend = -(a[k] + (x - k) * (a[k + 1] - a[k])) - 2.0 * zeta * w * v - w * w * u
            shift = -v / bend if bend != 0.0 else 0.0
            if abs(shift) < h and bend * u < 0.0:
                u += 0.5 * v * shift
                at = min(max(at + shift, 0.0), (a.size - 1) * dt)
            value[first + j] = w * w * u
            when[first + j] = at
        first = last


@kernel()
def integrate(a, dt, v, d):
    """Compute velocity and displacement at the samples from rest, exact for linear segments."""
    v[0] = 0.0
    d[0] = 0.0
    for i in range(a.size - 1):
        d[i + 1] = d[i] + dt * v[i] + dt * dt / 6.0 * (2.0 * a[i] + a[i + 1])
        v[i + 1] = v[i] + 0.5 * dt * (a[i] + a[i + 1])


@kernel()
def _oscillator_row(omega, zeta, at, dt, row):
    """Compute the weights of the samples in omega² u(at), by recurrence; return the first and last weighted sample."""
    last = min(int(at / dt), row.size - 1)
    first = max(0, math.floor((at - SUPPORT / (zeta * omega)) / dt))
    damped = omega * math.sqrt(1.0 - zeta * zeta)
    lag = at - last * dt
    half = 0.5 * omega * dt
    # a sample is the peak of a hat function, whose transform decays as sinc²
    ratio = math.sin(half) / half
    size = -dt * omega * omega / damped * ratio * ratio
    decay = math.exp(-zeta * omega * dt)
    turn, across = decay * math.cos(damped * dt), decay * math.sin(damped * dt)
    envelope = size * math.exp(-zeta * omega * lag)
    sine, cosine = envelope * math.sin(damped * lag), envelope * math.cos(damped * lag)
    row[:] = 0.0
    for m in range(last, first - 1, -1):
        row[m] = sine
        sine, cosine = sine * turn + cosine * across, cosine * turn - sine * across
    return first, last


@kernel()
def _velocity_row(k, dt, row):
    """Compute the weights of the samples in the velocity at sample k >= 1."""
    row[:] = 0.0
    row[: k + 1] = dt
    row[0] = 0.5 * dt
    row[k] = 0.5 * dt


@kernel()
def _displacement_row(k, dt, row):
    """Compute the weights of the samples in the displacement at sample k >= 1."""
    row[:] = 0.0
    for m in range(1, k):
        row[m] = dt * dt * (k - m)
    row[0] = dt * dt * (0.5 * k - 1.0 / 6.0)
    row[k] = dt * dt / 6.0


@kernel()
def _turns(series, low, high, where, wanted):
    """Find excursions near or beyond `high` (largest sample of each), or the peak below `low`; return their number.

    where, wanted (MOST_TURNS,): the sample of each excursion and its wanted value.
    """
    count = 0
    top, at = 0.0, 0
    inside, best = False, 0
    for i in range(1, series.size):
        value = abs(series[i])
        if value > top:
            top, at = value, i
        if value > NEAR * high:
            if not inside or abs(series[i]) > abs(series[best]):
                best = i
            inside = True
        if inside and (value <= NEAR * high or i == series.size - 1):
            inside = False
            slot = count
            if count == MOST_TURNS:
                slot = 0
                for k in range(MOST_TURNS):
                    if abs(series[where[k]]) < abs(series[where[slot]]):
                        slot = k
                if abs(series[where[slot]]) >= abs(series[best]):
                    continue
            else:
                count += 1
            where[slot] = best
    for k in range(count):
        wanted[k] = math.copysign(min(abs(series[where[k]]), INSIDE * high), series[where[k]])
    if count == 0 and 0.0 < top < low:
        where[0] = at
        wanted[0] = math.copysign(low / INSIDE, series[at])
        count = 1
    return count


@kernel(**_SUMS)
def _products(x, y, j, first, last, out):
    """Compute products of x with rows j to j + 3 of y over first to last; four at once read x only once."""
    y0, y1, y2, y3 = y[j], y[j + 1], y[j + 2], y[j + 3]
    a, b, c, d = 0.0, 0.0, 0.0, 0.0
    for m in range(first, last + 1):
        a += x[m] * y0[m]
        b += x[m] * y1[m]
        c += x[m] * y2[m]
        d += x[m] * y3[m]
    out[0], out[1], out[2], out[3] = a, b, c, d


@kernel()
def _solve(matrix, right, n):
    """Solve by Cholesky's method in place; the matrix has a regularised diagonal."""
    for i in range(n):
        for j in range(i + 1):
            total = matrix[i, j]
            for k in range(j):
                total -= matrix[i, k] * matrix[j, k]
            if i == j:
                matrix[i, i] = math.sqrt(max(total, HARD * HARD))
            else:
                matrix[i, j] = total / matrix[j, j]
    for i in range(n):
        for k in range(i):
            right[i] -= matrix[i, k] * right[k]
        right[i] /= matrix[i, i]
    for i in range(n - 1, -1, -1):
        for k in range(i + 1, n):
            right[i] -= matrix[k, i] * right[k]
        right[i] /= matrix[i, i]


@kernel()
def _apply_changes(a, root, rows, firsts, lasts, wanted, soft, n):
    """Add to `a` the smallest change that changes row r of the first n by wanted[r]; rows are 0 outside first to last.

    root (time,) is the square root of w and is multiplied into the rows; there must be at least three rows more than n.
    """
    matrix = np.empty((n, n))
    scale = np.empty(n)
    right = np.empty(n)
    four = np.empty(4)
    for i in range(n):
        for m in range(firsts[i], lasts[i] + 1):
            rows[i, m] *= root[m]
        for j in range(0, i + 1, 4):
            _products(rows[i], rows, j, firsts[i], lasts[i], four)
            for k in range(min(4, i + 1 - j)):
                matrix[i, j + k] = four[k]
    for i in range(n):
        # a row whose weights are all zero has no effect
        scale[i] = 1.0 / math.sqrt(matrix[i, i]) if matrix[i, i] > 0.0 else 0.0
    for i in range(n):
        right[i] = wanted[i] * scale[i]
        for j in range(i + 1):
            matrix[i, j] *= scale[i] * scale[j]
        matrix[i, i] = 1.0 + soft[i]
    _solve(matrix, right, n)
    change = np.zeros(a.size)
    for i in range(n):
        x = right[i] * scale[i]
        for m in range(firsts[i], lasts[i] + 1):
            change[m] += x * rows[i, m]
    for m in range(a.size):
        a[m] += root[m] * change[m]


@kernel()
def _bring_to_rest(a, dt, root, v, d, rows):
    """Bring end velocity and displacement to zero by the smallest change."""
    n = a.size
    firsts = np.zeros(2, np.int64)
    lasts = np.full(2, n - 1)
    for _ in range(2):
        integrate(a, dt, v, d)
        _velocity_row(n - 1, dt, rows[0])
        _displacement_row(n - 1, dt, rows[1])
        _apply_changes(a, root, rows, firsts, lasts, np.array([-v[n - 1], -d[n - 1]]), np.zeros(2), 2)
    integrate(a, dt, v, d)


def adjust(a, dt, omega, zeta, target, w, bounds, most_steps, enough, firm, out) -> None:
    """Match one motion `a` in place: omega, target (i,) by falling period, w (time,), bounds (4,), out (RESULTS,).

    `bounds`: minimum and maximum peak velocity, minimum and maximum peak displacement (0 and infinity: none), imposed
    with the regularisation `firm`. The best of `most_steps` steps is kept: bounds first, then the mean misfit. The
    adjustment stops when the mean misfit is below `enough` and the bounds are satisfied.
    """
    rows = np.zeros((omega.size + MORE_ROWS, a.size))
    best, base = a.copy(), a.copy()
    trial = np.array([0.0, math.inf, math.inf, 1.0, 0.0])
    plan = np.sqrt(w), bounds, most_steps, enough, firm
    while _improve(a, dt, omega, zeta, target, *plan, rows, best, base, trial, out):
        pass  # (an interrupt is heard between the steps)
    a[:] = best


@kernel(keep=True)
def _improve(a, dt, omega, zeta, target, root, bounds, last, enough, firm, rows, best, base, trial, out):
    """Do one step of `adjust`; return False if it was the last one: `best` is the match.

    From step to step: rows (i + MORE_ROWS, time), best, base (time,), trial (STEP …).  `root` (time,): the root of w.
    """
    n, lines = a.size, omega.size
    firsts = np.zeros(lines + MORE_ROWS, np.int64)
    lasts = np.zeros(lines + MORE_ROWS, np.int64)
    wanted = np.zeros(lines + MORE_ROWS)
    soft = np.empty(lines + MORE_ROWS)
    soft[:lines] = SOFT
    v, d = np.empty(n), np.empty(n)
    value, when = np.empty(lines), np.empty(lines)
    where, goal = np.zeros(MOST_TURNS, np.int64), np.zeros(MOST_TURNS)
    step = trial[STEP]
    trial[STEP] += 1.0
    _bring_to_rest(a, dt, root, v, d, rows)
    peaks(a, dt, omega, zeta, value, when)
    misfit, worst = 0.0, 0.0
    for i in range(lines):
        deviation = abs(abs(value[i]) / target[i] - 1.0)
        misfit += deviation / lines
        worst = max(worst, deviation)
    pgv, pgd = np.abs(v).max(), np.abs(d).max()
    broken = max(0.0, pgv / bounds[1] - 1.0, pgd / bounds[3] - 1.0)
    broken = max(broken, 1.0 - pgv / bounds[0] if bounds[0] > 0.0 else 0.0)
    broken = max(broken, 1.0 - pgd / bounds[2] if bounds[2] > 0.0 else 0.0)
    score = misfit + 0.1 * worst + (1.0 + 10.0 * broken if broken > 0.0 else 0.0)
    if score < trial[BEST_SCORE]:
        trial[BEST_SCORE] = score
        best[:] = a
        out[MISFIT], out[WORST], out[PGV], out[PGD], out[STEPS] = misfit, worst, pgv, pgd, step
    if step == last or (broken == 0.0 and misfit <= enough):
        return False
    # two criteria: the motion that is kept holds its bounds, the motion that is improved may violate them slightly
    merit = misfit + 0.1 * worst + 2.0 * broken
    if merit < trial[BASE_MERIT]:
        trial[BASE_MERIT] = merit
        base[:] = a
        trial[IDLE] = 0.0
    else:
        trial[IDLE] += 1.0
        if trial[IDLE] > PATIENCE:
            a[:] = base
            trial[SHARE] *= 0.5
            trial[IDLE] = 0.0
            integrate(a, dt, v, d)
            peaks(a, dt, omega, zeta, value, when)
    share = trial[SHARE]
    for i in range(lines):
        firsts[i], lasts[i] = _oscillator_row(omega[i], zeta, when[i], dt, rows[i])
        missing = min(max(target[i] - abs(value[i]), -LARGEST_STEP * target[i]), LARGEST_STEP * target[i])
        wanted[i] = share * (missing if value[i] >= 0.0 else -missing)
    count = lines
    for kind in range(2):
        series = v if kind == 0 else d
        turns = _turns(series, bounds[2 * kind], bounds[2 * kind + 1], where, goal)
        for k in range(turns):
            if kind == 0:
                _velocity_row(where[k], dt, rows[count])
            else:
                _displacement_row(where[k], dt, rows[count])
            firsts[count], lasts[count] = 0, where[k]
            wanted[count] = share * (goal[k] - series[where[k]])
            soft[count] = firm
            count += 1
    for kind in range(2):
        if kind == 0:
            _velocity_row(n - 1, dt, rows[count])
        else:
            _displacement_row(n - 1, dt, rows[count])
        firsts[count], lasts[count] = 0, n - 1
        wanted[count] = -(v if kind == 0 else d)[n - 1]
        soft[count] = HARD
        count += 1
    _apply_changes(a, root, rows, firsts, lasts, wanted, soft, count)
    return True
