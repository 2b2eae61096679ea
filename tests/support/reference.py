"""An independent reference for rocking blocks: 8th-order integration with located events.

The equations of motion are integrated as they are written, with the embedded Runge-Kutta method of
Dormand and Prince of order 8(5,3), restarted at every sample and at every event. Nothing here uses
a closed-form or series solution of the linear pieces, so that agreement with an engine that does
is evidence for both. SI units; angles in rad; g = 9.80665 m/s2.

Events are located by shortening the step: an accepted step that passes an event is taken again,
from its start and as one step, with the length at which the event happens. Within a step the
rotation is monotone up to the first turning point, and a turning point hidden by two changes of
sign of the velocity is found through the change of sign of the acceleration between them. So no
crossing is missed as long as the acceleration changes sign at most once within a step, which the
bound on the step (at most a tenth of the shortest time constant of the piece) ensures.
"""

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from scipy.integrate._ivp import dop853_coefficients as dop

GRAVITY = 9.80665
LAWS = (
    "discrete",
    "giannini_masiani",
    "makris_konstantinidis",
    "vassiliou",
    "viscous",
    "energy_consistent",
    "housner",
)

_A = np.ascontiguousarray(dop.A[:12, :12])
_B = np.ascontiguousarray(dop.B)
_C = np.ascontiguousarray(dop.C[:12])
_E3 = np.ascontiguousarray(dop.E3)
_E5 = np.ascontiguousarray(dop.E5)
_RTOL = 1e-13
_ATOL = 1e-15  # relative to alpha (rotation) and alpha p (velocity)
_STEP = 0.1  # largest step over the shortest time constant of the piece
_STEP_EXACT = 0.04  # the same in the exact geometry, which is not linear
_EXCEEDED = 1.0 + 2e-15  # of the threshold: uplift is then outward whatever the rounding
_BOUNCE = 1e-13  # a block at rest has no later bounce higher than this, relative to alpha
_MAX_STEPS = 2_000_000  # in one sample

_CONSTANT, _HELD, _CONSISTENT = 0, 1, 2  # how the damping of the zone is chosen
_REST, _RIGID, _ZONE, _OUTSIDE, _OVERTURNED = 0, 1, 2, 3, 4  # where the block is
_NONE, _TURN, _LOWER, _UPPER = 0, 1, 2, 3  # how a step ended
_ROTATION, _VELOCITY, _ACCELERATION = 0, 1, 2  # what an event is a root of
_T, _TH, _OM, _SIDE, _DAMPING, _PEAK = 0, 1, 2, 3, 4, 5  # places in the state


class Reference(NamedTuple):
    """The motion of one block under one record.

    ``peak`` is the largest \\|theta\\| at any time, after the record too, and pi/2 if the block
    overturned; ``theta`` and ``omega`` are the motion at the samples, held at +-pi/2 and 0 once
    \\|theta\\| has reached pi/2; ``peaks`` are the turning points (time, theta) in order, those
    after the record only as far as the motion had to be followed.
    """

    peak: float
    overturned: bool
    theta: np.ndarray
    omega: np.ndarray
    peaks: list[tuple[float, float]]


class _Model(NamedTuple):
    """A block: everything per unit moment of inertia about the corner."""

    alpha: float
    edge: float  # half width of the zone, rad; 0 without a zone
    zone: float  # stiffness inside the zone, n q^2
    fall: float  # negative stiffness outside it, q^2 (p^2 in the exact and linear geometries)
    gain: float  # of the floor's acceleration; in the exact geometry at alpha = theta
    static: float  # moment that holds the block at rest
    static_gain: float  # of the floor's acceleration at rest
    e: float
    law: int
    damping: float  # c everywhere, for the viscous laws
    exact: bool
    impacts: bool  # Housner's block: no zone
    rigid: bool  # rest = "rigid", and Housner's block


class _Piece(NamedTuple):
    """The equation of motion on one piece, during one sample."""

    offset: float
    slope: float
    damping: float
    gain: float
    u0: float
    du: float
    heavy: float  # weight over that at rest, and its rate: exact geometry
    heavier: float
    exact: bool
    angle: float  # alpha sgn(theta), exact geometry
    lower: float  # the piece is lower <= side * theta <= upper
    upper: float
    side: float
    longest: float  # step
    atol: float
    atol_rate: float


@njit(cache=True)
def _accelerate(w: _Piece, t: float, th: float, om: float) -> float:
    """Angular acceleration."""
    u = w.u0 + w.du * t
    if w.exact:
        x = w.angle - th
        return -(w.slope * (w.heavy + w.heavier * t) * math.sin(x) + w.gain * u * math.cos(x))
    return w.offset + w.slope * th - w.damping * om - w.gain * u


@njit(cache=True)
def _step(w: _Piece, t: float, th: float, om: float, h: float, k: np.ndarray) -> tuple[float, float, float]:
    """One step: rotation, velocity, error over tolerance; k[1] holds the accelerations."""
    for i in range(12):
        x = 0.0
        v = 0.0
        for j in range(i):
            x += _A[i, j] * k[0, j]
            v += _A[i, j] * k[1, j]
        k[0, i] = om + h * v
        k[1, i] = _accelerate(w, t + _C[i] * h, th + h * x, k[0, i])
    x = 0.0
    v = 0.0
    for j in range(12):
        x += _B[j] * k[0, j]
        v += _B[j] * k[1, j]
    th1 = th + h * x
    om1 = om + h * v
    k[0, 12] = om1
    k[1, 12] = _accelerate(w, t + h, th1, om1)
    fifth = 0.0
    third = 0.0
    for i in range(2):
        five = 0.0
        three = 0.0
        for j in range(13):
            five += _E5[j] * k[i, j]
            three += _E3[j] * k[i, j]
        if i == 0:
            scale = w.atol + _RTOL * max(abs(th), abs(th1))
        else:
            scale = w.atol_rate + _RTOL * max(abs(om), abs(om1))
        fifth += (five / scale) ** 2
        third += (three / scale) ** 2
    total = fifth + 0.01 * third
    return th1, om1, (h * fifth / math.sqrt(2.0 * total) if total > 0.0 else 0.0)


@njit(cache=True)
def _locate(
    w: _Piece,
    t: float,
    th: float,
    om: float,
    k: np.ndarray,
    what: int,
    at: float,
    h0: float,
    f0: float,
    h1: float,
    f1: float,
) -> float:
    """Length of the step, between h0 and h1, that ends where `what` equals `at` (Illinois).

    f0 and f1, the values at h0 and h1 less `at`, differ in sign. Leaves k as of the last step.
    """
    h = h1
    for _ in range(200):
        before = h
        h = h1 - f1 * (h1 - h0) / (f1 - f0)
        if not min(h0, h1) < h < max(h0, h1):
            h = 0.5 * (h0 + h1)
        x, v, _ = _step(w, t, th, om, h, k)
        f = x if what == _ROTATION else v if what == _VELOCITY else k[1, 12]
        f -= at
        if f == 0.0 or abs(h - before) <= 2e-16 * h or abs(h1 - h0) <= 4e-16 * h:
            break
        if (f > 0.0) != (f1 > 0.0):
            h0 = h1
            f0 = f1
        else:
            f0 *= 0.5
        h1 = h
        f1 = f
    return h


@njit(cache=True)
def _move(w: _Piece, t: float, th: float, om: float, left: float, k: np.ndarray) -> tuple[float, float, float, int]:
    """Take one step, or a shorter one to the first event: length, rotation, velocity, event."""
    h = min(left, w.longest)
    th1, om1, error = _step(w, t, th, om, h, k)
    while error > 1.0:
        h *= max(0.2, 0.9 * error**-0.125)
        th1, om1, error = _step(w, t, th, om, h, k)
    a0 = k[1, 0]
    a1 = k[1, 12]
    if om != 0.0:
        way = np.sign(om)
    elif w.lower == 0.0 and w.side * th <= 0.0:
        way = w.side  # a block that has just been uplifted
    else:
        way = np.sign(a0)
    event = _NONE
    start = 0.0
    rate = om
    if om1 * way < 0.0:
        event = _TURN
        if om == 0.0:  # it speeds up, slows down and turns, all in this step
            start = _locate(w, t, th, om, k, _ACCELERATION, 0.0, 0.0, a0, h, a1)
            _, rate, _ = _step(w, t, th, om, start, k)
    elif a0 * way < 0.0 and a1 * way > 0.0:  # it may turn twice in this step
        slowest = _locate(w, t, th, om, k, _ACCELERATION, 0.0, 0.0, a0, h, a1)
        _, v, _ = _step(w, t, th, om, slowest, k)
        if v * way < 0.0:
            event = _TURN
            h = slowest
            om1 = v
    if event == _TURN:
        if rate * way > 0.0:
            h = _locate(w, t, th, om, k, _VELOCITY, 0.0, start, rate, h, om1)
        else:  # it never moved that way beyond rounding
            h = start
        th1, _, _ = _step(w, t, th, om, h, k)
        om1 = 0.0
    edge = 0.0
    if w.side * th1 < w.lower:
        event = _LOWER
        edge = w.side * w.lower
    elif w.side * th1 > w.upper:
        event = _UPPER
        edge = w.side * w.upper
    if event >= _LOWER:
        if (th - edge) * (th1 - edge) < 0.0:
            h = _locate(w, t, th, om, k, _ROTATION, edge, 0.0, th - edge, h, th1 - edge)
            _, om1, _ = _step(w, t, th, om, h, k)
        else:  # it starts on the edge
            h = 0.0
            om1 = om
        th1 = edge
    return h, th1, om1, event


@njit(cache=True)
def _piece(
    m: _Model, where: int, side: float, c: float, u0: float, du: float, heavy: float = 1.0, heavier: float = 0.0
) -> _Piece:
    """The equation of motion where the block is."""
    rate = math.sqrt(m.fall)
    atol = _ATOL * m.alpha
    if where == _ZONE:
        longest = _STEP / max(math.sqrt(m.zone), c)
        return _Piece(0.0, -m.zone, c, m.gain, u0, du, 1.0, 0.0, False, 0.0, -m.edge, m.edge, 1.0,
                      longest, atol, atol * rate)  # fmt: skip
    damping = m.damping
    lower = m.edge if where == _OUTSIDE else 0.0
    upper = m.edge if where == _RIGID and not m.impacts else 0.5 * math.pi
    offset = -side * m.fall * m.alpha
    step = _STEP_EXACT if m.exact else _STEP
    return _Piece(offset, m.fall, damping, m.gain, u0, du, heavy, heavier, m.exact, side * m.alpha,
                  lower, upper, side, step / max(rate, damping), atol, atol * rate)  # fmt: skip


@njit(cache=True)
def _leaving(w: _Piece, edge: float, v: float, k: np.ndarray) -> float:
    """Square of the velocity after an unforced crossing; below 0, the energy it lacks."""
    th = -edge
    om = v
    while True:
        _, th, om, event = _move(w, 0.0, th, om, w.longest, k)
        excess = om * om + w.slope * (edge * edge - th * th)
        if event == _UPPER or excess <= 0.0:
            return excess


@njit(cache=True)
def _consistent(m: _Model, v: float, k: np.ndarray) -> float:
    """Damping of the zone that takes out what an impact takes out (Illinois on crossings)."""
    target = m.e**2 * v * v - (1.0 - m.e**2) * m.fall * (2.0 * m.alpha - m.edge) * m.edge
    target = max(target, 0.0)
    c0 = 0.0
    f0 = v * v - target
    if f0 <= 0.0:
        return 0.0
    c1 = math.sqrt(v * v + m.zone * m.edge**2) / m.edge  # stops it in the second half at the latest
    f1 = _leaving(_piece(m, _ZONE, 1.0, c1, 0.0, 0.0), m.edge, v, k) - target
    c = c1
    for _ in range(200):
        before = c
        c = c1 - f1 * (c1 - c0) / (f1 - f0)
        f = _leaving(_piece(m, _ZONE, 1.0, c, 0.0, 0.0), m.edge, v, k) - target
        if f == 0.0 or abs(c - before) <= 4e-16 * c:
            break
        if (f > 0.0) != (f1 > 0.0):
            c0 = c1
            f0 = f1
        else:
            f0 *= 0.5
        c1 = c
        f1 = f
    return c


@njit(cache=True)
def _comes_to_rest(m: _Model, om: float, u: float, du: float, left: float, heavy: float, heavier: float) -> bool:
    """Whether all later bounces end within some time in which the threshold is not exceeded.

    The time is what is left of the sample, or half of what is left until the threshold if that is
    reached before: a block below its threshold is then at rest after finitely many bounces.
    """
    if m.static * heavy - m.static_gain * abs(u) <= 0.0:
        return False
    horizon = left
    for _ in range(2):
        end = m.static * (heavy + heavier * horizon) - m.static_gain * abs(u + du * horizon)
        least = min(m.static * heavy - m.static_gain * abs(u), end)
        if least > 0.0 and 2.0 * abs(om) <= (1.0 - m.e) * least * horizon:
            return om * om <= 2.0 * least * _BOUNCE * m.alpha
        for s in (-1.0, 1.0):
            closing = s * m.static_gain * du - m.static * heavier
            if closing > 0.0:
                horizon = min(horizon, 0.5 * (m.static * heavy - s * m.static_gain * u) / closing)
    return False


@njit(cache=True)
def _impact(m: _Model, y: np.ndarray, u: float, du: float, left: float, heavy: float, heavier: float) -> int:
    """Theta = 0 without a zone: reverse or come to rest."""
    y[_TH] = 0.0
    y[_OM] *= m.e
    if _comes_to_rest(m, y[_OM], u, du, left, heavy, heavier):
        y[_OM] = 0.0
        return _REST
    y[_SIDE] = np.sign(y[_OM]) if y[_OM] != 0.0 else -np.sign(u)
    return _RIGID


@njit(cache=True)
def _enter(m: _Model, y: np.ndarray, k: np.ndarray) -> int:
    """|theta| = delta alpha inward: into the zone, or on along the rigid branch."""
    v = abs(y[_OM])
    if m.rigid:
        barrier = m.fall * m.edge * (m.alpha - 0.5 * m.edge)
        if m.e**2 * (0.5 * v * v + barrier) <= barrier:
            return _RIGID
    if m.law == _HELD:
        y[_DAMPING] = (1.0 - m.e) * v / (2.0 * m.edge)
    elif m.law == _CONSISTENT:
        y[_DAMPING] = _consistent(m, v, k)
    return _ZONE


@njit(cache=True)
def _potential(m: _Model, x: float, where: int) -> float:
    """Potential at x = |theta|, on the scale on which it is continuous; Coulomb's step excluded."""
    if m.exact:
        return m.fall * (math.cos(m.alpha - x) - math.cos(m.alpha))
    step = 0.5 * m.fall * m.edge * m.alpha  # rigid branch less elastic zone, at the edge
    if where == _ZONE:
        return 0.5 * m.zone * x * x + step
    return m.fall * x * (m.alpha - 0.5 * x)


@njit(cache=True)
def _turn(m: _Model, y: np.ndarray, where: int) -> int:
    """A turning point; one inside the zone of a rigid block sets it on the rigid branch."""
    if m.rigid and where == _ZONE:
        side = 1.0 if y[_TH] >= 0.0 else -1.0
        x = _potential(m, abs(y[_TH]), _ZONE) / m.fall  # = x alpha - x^2/2, stably
        x = 2.0 * x / (m.alpha + math.sqrt(m.alpha**2 - 2.0 * x))
        y[_SIDE] = side
        y[_TH] = side * x
        where = _RIGID
    y[_PEAK] = max(y[_PEAK], abs(y[_TH]))
    return where


@njit(cache=True)
def _sample(
    m: _Model,
    y: np.ndarray,
    where: int,
    u0: float,
    u1: float,
    g0: float,
    g1: float,
    dt: float,
    k: np.ndarray,
    begin: float,
    peaks: list[tuple[float, float]],
) -> int:
    """Move on through one interval between samples, which starts at time `begin`; g: the weight."""
    du = (u1 - u0) / dt
    dg = (g1 - g0) / dt
    y[_T] = 0.0
    for _ in range(_MAX_STEPS):
        t = y[_T]
        if dt - t <= 1e-14 * dt or where == _OVERTURNED:
            return where
        if where == _REST:
            threshold = m.static / m.static_gain
            if abs(u0 + du * t) <= threshold * (g0 + dg * t):
                if abs(u1) <= threshold * g1:
                    return where
                s = math.copysign(1.0, u1)
                t = max(t, (s * threshold * g0 - u0) / (du - s * threshold * dg))
                if dt - t <= 1e-13 * dt:
                    return where
            y[_T] = t
            y[_SIDE] = -np.sign(u0 + du * t)
            where = _RIGID
        w = _piece(m, where, y[_SIDE], y[_DAMPING], u0, du, g0, dg)
        h, y[_TH], y[_OM], event = _move(w, t, y[_TH], y[_OM], dt - t, k)
        y[_T] = t + h
        y[_PEAK] = max(y[_PEAK], abs(y[_TH]))
        if event == _TURN:
            where = _turn(m, y, where)
            peaks.append((begin + y[_T], y[_TH]))
        elif event == _UPPER and w.upper > m.edge:
            where = _OVERTURNED
            y[_OM] = 0.0
        elif event == _LOWER and where == _RIGID:
            where = _impact(m, y, u0 + du * y[_T], du, dt - y[_T], g0 + dg * y[_T], dg)
        elif event != _NONE and where == _OUTSIDE:
            where = _enter(m, y, k)
        elif event != _NONE:
            where = _OUTSIDE
            y[_SIDE] = np.sign(y[_TH])
    raise RuntimeError("too many steps in one sample")


@njit(cache=True)
def _escapes(m: _Model, y: np.ndarray, where: int) -> bool:
    """Whether an unforced block is past the separatrix."""
    if where == _OVERTURNED:
        return True
    if where not in (_OUTSIDE, _RIGID):
        return False
    beyond = y[_SIDE] * y[_TH] - m.alpha
    outward = y[_SIDE] * y[_OM]
    if m.exact:
        return outward + 2.0 * math.sqrt(m.fall) * math.sin(0.5 * beyond) > 0.0
    c = 0.5 * m.damping
    return outward + (c + math.sqrt(c * c + m.fall)) * beyond > 0.0


@njit(cache=True)
def _run(
    m: _Model, y: np.ndarray, where: int, u: np.ndarray, g: np.ndarray, dt: float
) -> tuple[np.ndarray, np.ndarray, bool, list[tuple[float, float]]]:
    """The whole motion: fills the histories, then follows the free motion to its last peak."""
    n = u.size
    theta = np.empty(n)
    omega = np.empty(n)
    peaks = [(0.0, 0.0)]
    k = np.empty((2, 13))
    theta[0] = y[_TH]
    omega[0] = y[_OM]
    for i in range(n - 1):
        where = _sample(m, y, where, u[i], u[i + 1], g[i], g[i + 1], dt, k, i * dt, peaks)
        theta[i + 1] = y[_TH]
        omega[i + 1] = y[_OM]
    piece = 0.5 / math.sqrt(m.fall)
    begin = (n - 1) * dt
    while where != _REST and not _escapes(m, y, where):
        energy = 0.5 * y[_OM] ** 2 + _potential(m, abs(y[_TH]), where)
        highest = min(y[_PEAK], m.alpha)
        if energy <= _potential(m, highest, _ZONE if highest <= m.edge and not m.rigid else _RIGID):
            break
        where = _sample(m, y, where, 0.0, 0.0, 1.0, 1.0, piece, k, begin, peaks)
        begin += piece
    return theta, omega, _escapes(m, y, where), peaks[1:]


def integrate(
    law: str,
    *,
    alpha: float,
    R: float,
    inertia_factor: float = 4 / 3,
    e: float = 1.0,
    delta: float = 0.05,
    coefficient: float = 0.02,
    zeta: float = 0.0,
    lever: str = "h",
    rest: str = "elastic",
    geometry: str = "bilinear",
    acceleration: np.ndarray,
    dt: float,
    theta0: float = 0.0,
    omega0: float = 0.0,
    vertical: np.ndarray | None = None,
) -> Reference:
    """Integrate one block under one record of the floor's acceleration, linear between samples.

    `geometry` ("exact", "linear" or "bilinear") matters to law "housner" only, `rest` ("elastic"
    or "rigid") to "discrete" and "energy_consistent", `delta` to all but "housner", `coefficient`
    to "vassiliou", `zeta` to "viscous", `lever` ("h" or "R") to all but the exact and linear
    geometries, which have their own, `vertical` (the floor's upward acceleration, m/s2) to the exact
    geometry. A turning point inside the zone with rest = "rigid" is reported where it puts the block on
    the rigid branch.
    """
    impacts = law == "housner"
    bilinear = geometry == "bilinear" or not impacts
    exact = impacts and geometry == "exact"
    p2 = GRAVITY / (inertia_factor * R)
    fall = p2 * math.sin(alpha) / alpha if bilinear else p2
    gain = p2 / GRAVITY * (math.cos(alpha) if bilinear and lever == "h" else 1.0)
    zone = 0.0 if impacts else (1.0 / delta - 1.0) * fall
    known = law in LAWS and geometry in ("exact", "linear", "bilinear")
    if not known or lever not in ("h", "R") or rest not in ("elastic", "rigid"):
        raise ValueError("unknown law, geometry, lever or rest")
    if law == "giannini_masiani":
        zeta = 2.0 / math.pi * (1.0 - e) / (1.0 + e)
    elif law == "makris_konstantinidis":
        zeta = -0.68 * math.log(e)
    damping = 0.0
    if law in ("giannini_masiani", "makris_konstantinidis", "viscous"):
        damping = 2.0 * zeta * math.sqrt(zone)
    elif law == "vassiliou":
        area = inertia_factor * R**2
        damping = coefficient * (alpha / 0.1) ** 2 * math.sqrt(GRAVITY) * R**1.5 / area
    kind = {"discrete": _HELD, "energy_consistent": _CONSISTENT}.get(law, _CONSTANT)
    model = _Model(
        alpha=float(alpha),
        edge=0.0 if impacts else float(delta * alpha),
        zone=zone,
        fall=fall,
        gain=gain,
        static=_EXCEEDED * (p2 * math.sin(alpha) if exact else fall * alpha),
        static_gain=gain * math.cos(alpha) if exact else gain,
        e=float(e),
        law=kind,
        damping=float(damping),
        exact=exact,
        impacts=impacts,
        rigid=impacts or (kind != _CONSTANT and rest == "rigid"),
    )
    side = math.copysign(1.0, theta0 if theta0 != 0.0 else omega0)
    if abs(theta0) > model.edge and not impacts:
        where = _OUTSIDE
    elif not model.rigid:
        where = _ZONE
    else:
        where = _RIGID if theta0 != 0.0 or omega0 != 0.0 else _REST
    state = np.array([0.0, theta0, omega0, side, model.damping, abs(theta0)])
    record = np.ascontiguousarray(acceleration, dtype=np.float64)
    weight = np.ones(record.size) if vertical is None else 1.0 + np.asarray(vertical) / GRAVITY
    theta, omega, overturned, peaks = _run(model, state, where, record, weight, float(dt))
    peak = 0.5 * math.pi if overturned else float(state[_PEAK])
    return Reference(peak, bool(overturned), theta, omega, peaks)
