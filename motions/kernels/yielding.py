"""Compiled response of shear buildings whose storeys yield: exact pieces between located events.

Between events a building is linear under ground acceleration that is linear between samples, so that its drifts are
Taylor series about the start of the piece.  Yielding and unloading are looked for on these series; the earliest event
ends the piece, and the next piece starts there.
"""

from typing import Any

import numpy as np

from ...core.compiled import kernel
from .pieces import pieces

# Products and sums are fused where the processor can, and storeys go side by side.
_FUSED: dict[str, Any] = {"fastmath": {"contract", "nsz"}}

TERMS = 40
"""Most terms of a series; a piece that needs more is halved."""
FEWEST = 4
SMALL = 1e-17
PARTS = 4
"""Parts of a piece at whose ends events are looked for."""
NEAR = 0.98
"""Share of the yield drift from which a storey is looked at between the ends of a part, too."""
HALVINGS = 60
COST = 200.0
"""Of a step of one storey, ns."""
ELASTIC = 0.0


@kernel(**_FUSED)
def _term(first, n, share, damp, tangent, viscous, inverse, force, x, y):
    """Fill the next term of drifts x and rates y from the one that begins at `first`, without shifts and the ground."""
    for i in range(n):
        force[i] = tangent[i] * x[first + i] + viscous[i] * y[first + i]
    above = force[1] - force[0]
    x[first + n] = share * y[first]
    y[first + n] = share * (above * inverse[0] - damp * y[first])
    for i in range(1, n):
        at = first + i
        change = (force[i + 1] - force[i]) * inverse[i] - (force[i] - force[i - 1]) * inverse[i - 1]
        x[at + n] = share * y[at]
        y[at + n] = share * (change - damp * y[at])


@kernel()
def _series(drifts, rates, plastic, flow, storeys, damp, ground, slope, h, force, x, y):
    """Fill the Taylor terms h^k d_k and h^k r_k of drifts and their rates, one after the other; return their number.

    0 if `TERMS` are not enough.
    """
    n = drifts.size
    stiffness, yields, hardening, theta, viscous, inverse, tangent = storeys
    force[n] = 0.0
    for i in range(n):
        x[i] = drifts[i]
        y[i] = rates[i]
        if flow[i] == ELASTIC:
            tangent[i] = stiffness[i] * (1.0 - theta[i])
            force[i] = -stiffness[i] * (1.0 - hardening[i]) * plastic[i]
        else:
            tangent[i] = stiffness[i] * (hardening[i] - theta[i])
            force[i] = stiffness[i] * (1.0 - hardening[i]) * flow[i] * yields[i]
    for i in range(n):  # (what the shifts of the forces add to the second term waits where the third will be)
        y[2 * n + i] = (force[i + 1] - force[i]) * inverse[i]
        if i > 0:
            y[2 * n + i] -= (force[i] - force[i - 1]) * inverse[i - 1]
    y[2 * n] -= ground
    _term(0, n, h, damp, tangent, viscous, inverse, force, x, y)
    for i in range(n):
        y[n + i] += h * y[2 * n + i]
    _term(n, n, 0.5 * h, damp, tangent, viscous, inverse, force, x, y)
    y[2 * n] -= 0.5 * h * h * slope
    for k in range(2, TERMS - 1):
        _term(n * k, n, h / (k + 1), damp, tangent, viscous, inverse, force, x, y)
        if k >= FEWEST:
            largest = 0.0
            for i in range(n * (k + 1), n * (k + 2)):
                largest = max(largest, abs(x[i]), h * abs(y[i]))
            if largest < SMALL:
                return k + 2
    return 0


@kernel()
def _at(terms, n, number, i, x):
    """Return the value of a storey's series at a share x of the piece."""
    total = 0.0
    for j in range(number):
        total = total * x + terms[n * (number - 1 - j) + i]
    return total


@kernel(**_FUSED)
def _reach(terms, n, number, bounds):
    """Fill bounds of the distance of each storey's series from its start within the piece."""
    for i in range(n):
        bounds[i] = abs(terms[n + i])
    for k in range(2, number):
        for i in range(n):
            bounds[i] += abs(terms[n * k + i])


@kernel()
def _excess(x, y, n, number, i, at, plastic, flow, yields):
    """Return a number that is positive once a storey has yielded (of an elastic one) or unloaded (of a flowing one)."""
    if flow == ELASTIC:
        return abs(_at(x, n, number, i, at) - plastic) - yields
    return -flow * _at(y, n, number, i, at)


@kernel()
def _crossing(x, y, n, number, i, low, high, plastic, flow, yields):
    """Return, by bisection, the share of the piece at which the event between low and high lies."""
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        if _excess(x, y, n, number, i, middle, plastic, flow, yields) > 0.0:
            high = middle
        else:
            low = middle
    return high


@kernel()
def _turn(y, n, number, i, low, high, rising):
    """Return the place between low and high at which a rate changes its sign; `rising`: the rate at low."""
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        if _at(y, n, number, i, middle) * rising > 0.0:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)


@kernel()
def _event(x, y, n, number, i, low, high, plastic, flow, yields):
    """Return the place of a storey's event in a part of the piece; 2 without an event."""
    if _excess(x, y, n, number, i, high, plastic, flow, yields) > 0.0:
        return _crossing(x, y, n, number, i, low, high, plastic, flow, yields)
    if flow != ELASTIC:
        return 2.0
    before = _at(x, n, number, i, low) - plastic
    after = _at(x, n, number, i, high) - plastic
    if max(abs(before), abs(after)) < NEAR * yields:
        return 2.0
    rate = _at(y, n, number, i, low)
    if rate * _at(y, n, number, i, high) >= 0.0:
        return 2.0
    top = _turn(y, n, number, i, low, high, rate)
    if top > low and _excess(x, y, n, number, i, top, plastic, flow, yields) > 0.0:
        return _crossing(x, y, n, number, i, low, top, plastic, flow, yields)
    return 2.0


@kernel()
def _first_event(x, y, n, number, i, plastic, flow, yields, before):
    """Return the place of a storey's first event in the piece, if before `before`; else 2."""
    for part in range(PARTS):
        if part / PARTS < before:
            at = _event(x, y, n, number, i, part / PARTS, (part + 1) / PARTS, plastic, flow, yields)
            if at <= 1.0:
                return at
    return 2.0


@kernel()
def _peak(x, y, n, number, i, end, peak):
    """Return the maximum of `peak` and the magnitudes of a drift within the piece until `end`."""
    for part in range(PARTS):
        low = part / PARTS
        high = min((part + 1) / PARTS, end)
        if low < high:
            peak = max(peak, abs(_at(x, n, number, i, high)))
            rate = _at(y, n, number, i, low)
            if rate * _at(y, n, number, i, high) < 0.0:
                peak = max(peak, abs(_at(x, n, number, i, _turn(y, n, number, i, low, high, rate))))
    return peak


@kernel()
def _advance(drifts, rates, plastic, flow, storeys, damp, ground, slope, h, force, far, fast, x, y, peaks, events):
    """Advance to the first event within h or to its end; return the time that passed."""
    n = drifts.size
    yields = storeys[1]
    number = 0
    while number == 0:
        number = _series(drifts, rates, plastic, flow, storeys, damp, ground, slope, h, force, x, y)
        if number == 0:
            h = 0.5 * h
    _reach(x, n, number, far)
    _reach(y, n, number, fast)
    where = 2.0
    which = -1
    for i in range(n):
        if flow[i] == ELASTIC:
            if abs(x[i] - plastic[i]) + far[i] < yields[i]:
                continue
        elif flow[i] * y[i] > fast[i]:
            continue
        at = _first_event(x, y, n, number, i, plastic[i], flow[i], yields[i], where)
        if at < where:
            where = at
            which = i
    end = min(1.0, where)
    for i in range(n):
        if abs(x[i]) + far[i] > peaks[i]:
            peaks[i] = _peak(x, y, n, number, i, end, peaks[i])
        drifts[i] = x[n * (number - 1) + i]
        rates[i] = y[n * (number - 1) + i]
    for j in range(1, number):
        first = n * (number - 1 - j)
        for i in range(n):
            drifts[i] = drifts[i] * end + x[first + i]
            rates[i] = rates[i] * end + y[first + i]
    if which >= 0:
        if flow[which] == ELASTIC:
            flow[which] = 1.0 if drifts[which] > plastic[which] else -1.0
        else:
            plastic[which] = drifts[which] - flow[which] * yields[which]
            flow[which] = ELASTIC
        events[0] += 1
    return end * h


@kernel()
def _floors(drifts, rates, plastic, flow, storeys, damp, step, accelerations, velocities):
    """Fill absolute accelerations and relative velocities of the floors at a sample: forces over masses."""
    stiffness, yields, hardening, theta, viscous, inverse, _ = storeys
    speed = 0.0
    for i in range(drifts.size):
        if flow[i] == ELASTIC:
            force = stiffness[i] * ((1.0 - theta[i]) * drifts[i] - (1.0 - hardening[i]) * plastic[i])
        else:
            force = stiffness[i] * ((hardening[i] - theta[i]) * drifts[i] + (1.0 - hardening[i]) * flow[i] * yields[i])
        force += viscous[i] * rates[i]
        if i > 0:
            accelerations[i - 1, step] += force * inverse[i - 1]
        speed += rates[i]
        velocities[i, step] = speed
        accelerations[i, step] = -force * inverse[i] - damp * speed


def storey_response(ground, dt, mass, storeys, damp, limits, accelerations, velocities, peaks, residual) -> Any:
    """Fill the response of a shear building to ground acceleration, from rest; return events, collapsed storey, sample.

    Storey forces are k [(hardening - theta) d + (1 - hardening) e] of the drifts d and their elastic parts e = d - d_p,
    |e| at most the yield drift. Damping forces are `damp` (1/s) times the masses, against the ground, and from the
    viscosities of the storeys.

    Shapes: `ground` (n,), m/s². `mass` (storey,). `storeys` (5, storey): stiffness, yield drift, m (infinite for an
    elastic one), hardening, theta, viscosity. `limits` (storey,), of drifts, m. `accelerations`, absolute, and
    `velocities`, relative to the ground: (storey, n). `peaks` and `residual` (plastic) drifts: (storey,). A storey
    whose drift exceeds its limit at a sample has collapsed (its number, else -1): the response ends there, and zeros
    follow.
    """
    accelerations[:] = 0.0
    velocities[:] = 0.0
    peaks[:] = 0.0
    state = np.zeros((4, mass.size))
    shaken, out, events = (ground, dt, mass, storeys, damp, limits), (accelerations, velocities, peaks, residual), 0
    for first, end in pieces(ground.size, COST * mass.size):
        more, storey, sample = _storey_response(*shaken, first, end, state, *out)
        events += more
        if storey >= 0:
            break
    return events, storey, sample


@kernel(keep=True)
def _storey_response(
    ground, dt, mass, storeys, damp, limits, first, end, state, accelerations, velocities, peaks, residual
):
    """Do samples `first` to `end` - 1 of `storey_response`; state (4, storey): drifts, rates, plastic drifts, flow."""
    n = mass.size
    drifts, rates, plastic, flow = state[0], state[1], state[2], state[3]
    x = np.empty(TERMS * n)
    y = np.empty(TERMS * n)
    force, far, fast = np.zeros(n + 1), np.empty(n), np.empty(n)
    rows = (storeys[0], storeys[1], storeys[2], storeys[3], storeys[4], 1.0 / mass, np.zeros(n))
    events = np.zeros(1, np.int64)
    for step in range(first, end):
        for i in range(n):
            residual[i] = plastic[i] if flow[i] == ELASTIC else drifts[i] - flow[i] * storeys[1, i]
            if not abs(drifts[i]) <= limits[i]:
                return events[0], i, step
        _floors(drifts, rates, plastic, flow, rows, damp, step, accelerations, velocities)
        if step + 1 == ground.size:
            break
        slope = (ground[step + 1] - ground[step]) / dt
        done = 0.0
        while done < dt:
            start = ground[step] + slope * done
            passed = _advance(
                drifts,
                rates,
                plastic,
                flow,
                rows,
                damp,
                start,
                slope,
                dt - done,
                force,
                far,
                fast,
                x,
                y,
                peaks,
                events,
            )
            done = dt if passed >= dt - done else done + passed
    return events[0], -1, end - 1
