"""Compiled kernels of the rival integrators, and the rules of the oscillator that all rivals share.

All quantities are per unit inertia and in SI units.  `kind` and the numbers from q2 to rigid are those of
`problems.Problem`; they are passed as plain scalars, in its order.  The state of a motion is a mode (REST, RIGID, ZONE,
OUTSIDE, FALLEN) with a side (the sign of theta; 1 in the zone, which has no side).  In one mode side*theta lies between
two bounds; the events at a bound, or at a turn in the zone of a rigid block, are the same for every rival that locates
events.
"""

from __future__ import annotations

import math

import numpy as np

from ...core.compiled import kernel

NEVER = 1e300
"""Threshold of a block that lies: nothing lifts it (and `fastmath` knows no infinity)."""
LANES = 256
"""Runs that plain Runge-Kutta advances together: what it keeps of them stays in the nearest cache."""
# Kinds of damping of a problem (see `problems.Problem`).
VISCOUS, ENTRY_SPEED, ENERGY, IMPACT, EXACT = range(5)

REST, RIGID, ZONE, OUTSIDE, FALLEN = range(5)
NOTHING, LOW, HIGH, TURN = range(4)
FLAT = 0.5 * math.pi
REST_SPEED = 1e-4
"""Speed, rad/s, below which an impact that is not located ends the motion (bounces shorter than a step are noise)."""
_MOST_EVENTS = 1000
_MOST_ITERATIONS = 50


@kernel()
def _mismatch(beta, v, out, edge, zone):
    """Return the decay from speed v to `out` across the zone, less the decay by damping 2 beta (logarithms).

    The free motion is a spiral in the plane of sqrt(zone - beta²) theta and omega + beta theta: radius and phase at
    both edges are known, so that the time need not be searched for.  The overdamped motion is treated likewise, by its
    two real modes.
    """
    enters = v - beta * edge
    leaves = out + beta * edge
    squared = zone - beta * beta
    if squared > 0.0:
        w = math.sqrt(squared)
        phase = math.atan2(enters, -w * edge)
        if phase < 0.0:
            phase += 2.0 * math.pi
        phase -= math.atan2(leaves, w * edge)
        radii = (v * v - 2.0 * v * beta * edge + zone * edge * edge) / (
            out * out + 2.0 * out * beta * edge + zone * edge * edge
        )
        return 0.5 * math.log(radii) - beta / w * phase
    s = math.sqrt(-squared)
    if enters <= s * edge:
        return -1.0  # it does not cross the zone
    slow = math.log((enters - s * edge) / (leaves + s * edge))
    fast = math.log((enters + s * edge) / (leaves - s * edge))
    return slow - (beta - s) / (beta + s) * fast


@kernel()
def _energy_damping(v, q2, alpha, edge, zone, e):
    """Return the damping with which the unforced crossing at speed v dissipates the energy of an impact, by secants."""
    left = e * e * v * v - (1.0 - e * e) * q2 * edge * (2.0 * alpha - edge)
    out = math.sqrt(max(left, 0.0))
    if v <= out:
        return 0.0
    low = 0.0
    high = 0.5 * math.sqrt(v * v + zone * edge * edge) / edge  # stops in the second half at the latest
    before = 0.0
    value_before = _mismatch(0.0, v, out, edge, zone)
    path = edge * v + (v * v + zone * edge * edge) / math.sqrt(zone) * math.atan2(math.sqrt(zone) * edge, v)
    loss = 0.5 * (v * v - out * out)
    beta = (path - math.sqrt(max(0.0, path * path - 8.0 * edge * edge * loss))) / (8.0 * edge * edge)
    if not low < beta < high:
        beta = 0.5 * high
    for _ in range(_MOST_ITERATIONS):
        value = _mismatch(beta, v, out, edge, zone)
        if value > 0.0:
            low = beta
        else:
            high = beta
        step = -value * (beta - before) / (value - value_before) if value != value_before else 0.0
        before = beta
        value_before = value
        beta += step
        if not low <= beta <= high:
            beta = 0.5 * (low + high)
            continue
        if abs(step) <= 1e-9 * beta:  # the remaining error is this step times the step before
            break
    return 2.0 * beta


@kernel()
def entry_damping(v, kind, q2, alpha, edge, zone, c, e):
    """Return the damping of the zone that is entered at speed v."""
    if kind == ENTRY_SPEED:
        return (1.0 - e) * v / (2.0 * edge)
    if kind == ENERGY:
        return _energy_damping(v, q2, alpha, edge, zone, e)
    return c


@kernel()
def skips_zone(v, q2, alpha, edge, e):
    """Return True if a rigid block that enters the zone at speed v lacks the energy to leave it."""
    barrier = q2 * edge * (alpha - 0.5 * edge)
    return e * e * (0.5 * v * v + barrier) <= barrier


@kernel()
def after_turn(theta, q2, alpha, edge, zone):
    """Return the rotation on the rigid branch with the energy of a turn at theta inside the zone of a rigid block."""
    level = (0.5 * zone * theta * theta + 0.5 * q2 * edge * alpha) / q2
    return math.copysign(2.0 * level / (alpha + math.sqrt(alpha * alpha - 2.0 * level)), theta)


@kernel()
def holds(kind, q2, alpha):
    """Return the moment that holds a rigid block at rest, slightly enlarged: uplift is outward despite rounding."""
    return (1.0 + 4e-15) * q2 * (math.sin(alpha) if kind == EXACT else alpha)


@kernel()
def settles(omega, u, u_end, left, kind, q2, alpha, e, gain):
    """Return True if all later bounces of a rigid block end within the time left of the sample, before it lifts again.

    If the threshold is exceeded before the sample ends, the time left is half the time until then: the bounces of a
    block below its threshold end, however near to the threshold it is.
    """
    static = holds(kind, q2, alpha)
    threshold = static / gain
    way = math.copysign(1.0, u_end)
    if abs(u_end) > threshold > abs(u):
        left *= 0.5 * (threshold - way * u) / (way * (u_end - u))
        u_end = 0.5 * (way * threshold + u)
    least = static - gain * max(abs(u), abs(u_end))
    return least > 0.0 and 2.0 * abs(omega) <= (1.0 - e) * least * left


@kernel()
def escapes(theta, omega, kind, q2, alpha, edge, c):
    """Return True if a block at (theta, omega) after the record overturns: past the (damped) saddle, moving outward."""
    if abs(theta) <= edge:
        return False
    outward = math.copysign(1.0, theta) * omega
    if kind == EXACT:
        return outward + 2.0 * math.sqrt(q2) * math.sin(0.5 * (abs(theta) - alpha)) > 0.0
    return outward + (0.5 * c + math.sqrt(0.25 * c * c + q2)) * (abs(theta) - alpha) > 0.0


@kernel()
def bounds(mode, edge):
    """Return the bounds of side*theta in a mode."""
    if mode == ZONE:
        return -edge, edge
    if mode == OUTSIDE:
        return edge, FLAT
    return 0.0, edge if edge > 0.0 else FLAT


@kernel()
def law(mode, side, held, kind, q2, alpha, zone, c, gain):
    """Return stiffness, offset, damping and gain of theta'' = offset + stiffness theta - damping omega - gain u''.

    In exact geometry theta'' = -(stiffness sin x + gain u'' cos x) with x = offset - theta.
    """
    if mode == ZONE:
        return -zone, 0.0, held, gain
    if kind == EXACT:
        return q2, side * alpha, 0.0, gain / math.cos(alpha)
    return q2, -side * q2 * alpha, c, gain


@kernel()
def transition(event, mode, side, theta, omega, held, u, kind, q2, alpha, edge, zone, c, e, rigid):
    """Return mode, side, rotation, velocity and held damping after an event at (theta, omega)."""
    if event == TURN:
        if mode == ZONE and rigid:
            return RIGID, math.copysign(1.0, theta), after_turn(theta, q2, alpha, edge, zone), 0.0, held
        return mode, side, theta, omega, held
    if mode == ZONE:
        side = 1.0 if event == HIGH else -1.0
        return OUTSIDE, side, side * edge, omega, held
    if event == HIGH:
        if mode == RIGID and edge > 0.0:
            return OUTSIDE, side, side * edge, omega, held
        return FALLEN, side, side * FLAT, 0.0, held
    if mode == RIGID:
        omega *= e
        return RIGID, math.copysign(1.0, omega if omega != 0.0 else -u), 0.0, omega, held
    if rigid and skips_zone(abs(omega), q2, alpha, edge, e):
        return RIGID, side, side * edge, omega, held
    return ZONE, 1.0, side * edge, omega, entry_damping(abs(omega), kind, q2, alpha, edge, zone, c, e)


@kernel(fastmath=True, inline="always")
def _pull(x, q2, push):
    """Return q2 sin x + push cos x, to rounding for abs(x) < 2, by Taylor's series of the half angle."""
    y = 0.5 * x
    z = y * y
    w = z * z
    v = w * w
    sine = w * (1 / 120 - z / 5040) + v * ((1 / 362880 - z / 39916800) + w * (1 / 6227020800 - z / 1307674368000))
    half = w * (1 / 720 - z / 40320) + v * ((1 / 3628800 - z / 479001600) + w * (1 / 87178291200 - z / 20922789888000))
    sine = y * (1.0 - z / 6 + sine)
    return q2 * 2.0 * sine * (1.0 - z * (0.5 - z / 24 + half)) + push * (1.0 - 2.0 * sine * sine)


@kernel(fastmath=True, inline="always")
def _rate(exact, theta, side, omega, push, q2, alpha, reach, zone, held, c):
    """Return the angular acceleration; `side` has the sign of the falling branch, `reach` is the active zone's edge."""
    if exact is not None:
        return -_pull(math.copysign(alpha, side) - theta, q2, push)
    outside = q2 * (theta - math.copysign(alpha, side)) - c * omega
    return (outside if abs(theta) > reach else -zone * theta - held * omega) - push


@kernel(fastmath=True, inline="always")
def _runge_kutta(exact, theta, omega, push0, push1, h, q2, alpha, reach, zone, held, c):
    """Return the state after one classical step, in which each stage takes the law of its region."""
    middle = 0.5 * (push0 + push1)
    a1 = _rate(exact, theta, theta, omega, push0, q2, alpha, reach, zone, held, c)
    v2 = omega + 0.5 * h * a1
    x2 = theta + 0.5 * h * omega
    a2 = _rate(exact, x2, x2, v2, middle, q2, alpha, reach, zone, held, c)
    v3 = omega + 0.5 * h * a2
    x3 = theta + 0.5 * h * v2
    a3 = _rate(exact, x3, x3, v3, middle, q2, alpha, reach, zone, held, c)
    v4 = omega + h * a3
    x4 = theta + h * v3
    a4 = _rate(exact, x4, x4, v4, push1, q2, alpha, reach, zone, held, c)
    return (theta + h / 6.0 * (omega + 2.0 * v2 + 2.0 * v3 + v4), omega + h / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4))


@kernel()
def _newmark(exact, theta, omega, push0, push1, h, q2, alpha, reach, zone, held, c):
    """Return the state after one average-acceleration step, by Newton iterations with the tangent of the branch.

    The damping is that of the step's start (a force that jumps has no tangent), and a rigid block stays on its side
    until the step ends, as in a structural program.
    """
    damping = held if abs(theta) <= reach else c
    start = _rate(exact, theta, theta, omega, push0, q2, alpha, reach, zone, held, c)
    end = theta + h * (omega + 0.5 * h * start)
    for _ in range(_MOST_ITERATIONS):
        moved = end - theta
        side = end if reach > 0.0 else theta
        speed = 2.0 / h * moved - omega
        residual = 4.0 / h * (moved / h - omega) - start + damping * speed
        residual -= _rate(exact, end, side, speed, push1, q2, alpha, reach, zone, 0.0, 0.0)
        if exact is not None:
            tangent = _pull(math.copysign(alpha, side) - end, push1, -q2)
        else:
            tangent = zone if abs(end) <= reach else -q2
        change = residual / (4.0 / (h * h) + 2.0 * damping / h + tangent)
        end -= change
        if abs(change) <= 1e-14 * alpha:
            break
    return end, 2.0 / h * (end - theta) - omega


@kernel(fastmath=True)
def _step(exact, newmark, lanes, happens, share, u0, u1, h, q2, alpha, edge, zone, c, gain):
    """Take one step of all lanes, in vectors by RK4; `happens` where an event may have been within it.

    lanes: rotation, velocity, both before the step, reach, held damping, threshold (gain u'') and peak; (8, lanes).
    """
    for b in range(share.size):
        push0 = gain * share[b] * u0
        push1 = gain * share[b] * u1
        theta = lanes[0, b]
        omega = lanes[1, b]
        resting = (theta == 0.0) & (omega == 0.0)
        theta = -math.copysign(1e-300, push1) if resting else theta  # a side, no height
        stays = resting & (abs(push1) <= lanes[6, b])
        if newmark is None:
            end, speed = _runge_kutta(
                exact, theta, omega, push0, push1, h, q2, alpha, lanes[4, b], zone, lanes[5, b], c
            )
        elif not stays:
            end, speed = _newmark(exact, theta, omega, push0, push1, h, q2, alpha, lanes[4, b], zone, lanes[5, b], c)
        end = 0.0 if stays else end
        speed = 0.0 if stays else speed
        lanes[0, b] = end
        lanes[1, b] = speed
        lanes[2, b] = theta
        lanes[3, b] = omega
        lanes[7, b] = max(lanes[7, b], abs(end))
        turns = (abs(end) <= edge) & (omega * speed < 0.0)
        passes = (theta * end <= 0.0) | ((abs(theta) <= edge) != (abs(end) <= edge))
        happens[b] = (turns | passes | (abs(end) >= FLAT)) & (not stays)


@kernel()
def _after_step(mode, theta, omega, before, omega_before, held, kind, q2, alpha, edge, zone, c, e, rigid):
    """Return mode, rotation, velocity and held damping after what has happened within a step."""
    if mode == RIGID:
        if before * theta < 0.0 or theta == 0.0:
            omega *= e
            if abs(omega) < REST_SPEED:
                return mode, 0.0, 0.0, held  # at rest
        elif abs(theta) > edge > 0.0:
            return ZONE, theta, omega, held
    elif kind != VISCOUS and abs(theta) <= edge:
        if abs(before) > edge:
            if rigid and skips_zone(abs(omega), q2, alpha, edge, e):
                return RIGID, theta, omega, held
            return mode, theta, omega, entry_damping(abs(omega), kind, q2, alpha, edge, zone, c, e)
        if rigid and omega_before * omega < 0.0:
            return RIGID, after_turn(theta, q2, alpha, edge, zone), 0.0, held
    return mode, theta, omega, held


@kernel(keep=True)
def fixed_steps(
    exact, newmark, record, dt, steps, every, factors, kind, q2, alpha, edge, zone, c, e, gain, rigid,
    peaks, falls, rotation,
):  # fmt: skip
    """Integrate runs by RK4, LANES of them together, or by Newmark, `steps` per sample; no event is located.

    Damping, impacts and rest change at the ends of steps.  exact: True in exact geometry, otherwise None; newmark: True
    for Newmark, otherwise None.
    """
    static = holds(kind, q2, alpha) if rigid else 0.0
    inner = gain if exact is None else gain / math.cos(alpha)
    h = dt / steps
    happens = np.zeros(LANES, np.bool_)
    words = happens.view(np.uint64)
    mode = np.zeros(LANES, np.int64)
    for first in range(0, factors.size, LANES):
        share = factors[first : first + LANES]
        lanes = np.zeros((8, share.size))
        lanes[4] = 0.0 if rigid else edge
        lanes[5] = c
        lanes[6] = static * inner / gain
        mode[:] = RIGID if rigid else ZONE  # ZONE stands for zone and outside, which theta distinguishes
        happens[:] = False
        for i in range(record.size - 1):
            change = (record[i + 1] - record[i]) / steps
            for k in range(steps):
                u0 = record[i] + k * change
                u1 = u0 + change
                _step(exact, newmark, lanes, happens, share, u0, u1, h, q2, alpha, edge, zone, c, inner)
                for b in range(share.size):
                    if words[b // 8] == 0 or not happens[b]:
                        continue
                    theta = lanes[0, b]
                    if abs(theta) >= FLAT:
                        # it lies, and nothing lifts it
                        falls[first + b] = True
                        if every > 0:
                            rotation[first + b, i // every + 1 :] = math.copysign(FLAT, theta)
                        lanes[6, b] = NEVER
                        lanes[:2, b] = 0.0
                        continue
                    mode[b], lanes[0, b], lanes[1, b], lanes[5, b] = _after_step(
                        mode[b], theta, lanes[1, b], lanes[2, b], lanes[3, b], lanes[5, b],
                        kind, q2, alpha, edge, zone, c, e, rigid,
                    )  # fmt: skip
                    lanes[4, b] = 0.0 if mode[b] == RIGID else edge
            if every > 0 and (i + 1) % every == 0:
                for b in range(share.size):
                    if not falls[first + b]:
                        rotation[first + b, (i + 1) // every] = lanes[0, b]
        for b, j in enumerate(range(first, first + share.size)):
            falls[j] = falls[j] or escapes(lanes[0, b], lanes[1, b], kind, q2, alpha, edge, c)
            peaks[j] = FLAT if falls[j] else lanes[7, b]


@kernel(fastmath=True, inline="always")
def _acceleration(exact, stiffness, offset, damping, gain, theta, omega, u):
    if exact:
        return -_pull(offset - theta, stiffness, gain * u)
    return offset + stiffness * theta - damping * omega - gain * u


@kernel(fastmath=True)
def _branch_step(exact, stiffness, offset, damping, gain, theta, omega, u, slope, h):
    """Return the state after one classical step under the law of one branch; `u` is the shaking at its start."""
    um = u + 0.5 * h * slope
    a1 = _acceleration(exact, stiffness, offset, damping, gain, theta, omega, u)
    v2 = omega + 0.5 * h * a1
    a2 = _acceleration(exact, stiffness, offset, damping, gain, theta + 0.5 * h * omega, v2, um)
    v3 = omega + 0.5 * h * a2
    a3 = _acceleration(exact, stiffness, offset, damping, gain, theta + 0.5 * h * v2, v3, um)
    v4 = omega + h * a3
    a4 = _acceleration(exact, stiffness, offset, damping, gain, theta + h * v3, v4, u + h * slope)
    return (theta + h / 6.0 * (omega + 2.0 * v2 + 2.0 * v3 + v4), omega + h / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4))


@kernel()
def _step_to(
    event, bound, side, exact, stiffness, offset, damping, gain, theta, omega, u, slope, h, theta_end, omega_end
):
    """Return length and end of the step to an event within the step of length h, by safeguarded Newton iterations."""
    low = 0.0
    high = h
    length = h
    theta1 = theta_end
    omega1 = omega_end
    way = math.copysign(1.0, omega)
    for _ in range(_MOST_ITERATIONS):
        if event == TURN:
            value = way * omega1
            speed = way * _acceleration(exact, stiffness, offset, damping, gain, theta1, omega1, u + length * slope)
        else:
            way = side if event == LOW else -side
            value = way * theta1 - (bound if event == LOW else -bound)
            speed = way * omega1
        if value < 0.0:
            high = length
        else:
            low = length
        shorter = length - value / speed
        if not low < shorter < high:
            shorter = 0.5 * (low + high)
        change = shorter - length
        length = shorter
        theta1, omega1 = _branch_step(exact, stiffness, offset, damping, gain, theta, omega, u, slope, length)
        if abs(change) <= 1e-9 * h:  # quadratic convergence: the next change would be rounding
            break
    return length, theta1, omega1


@kernel(keep=True)
def located_events(
    record, dt, steps, every, factors, kind, q2, alpha, edge, zone, c, e, gain, rigid, peaks, falls, rotation
):
    """Integrate runs by RK4, `steps` per sample, branch by branch; a step beyond its branch ends at the event."""
    exact = kind == EXACT
    threshold = holds(kind, q2, alpha) / gain
    h = dt / steps
    for j in range(factors.size):
        theta = omega = peak = 0.0
        side = 1.0
        held = c
        mode = REST if rigid else ZONE
        low, high = bounds(mode, edge)
        stiffness, offset, damping, factor = law(mode, side, held, kind, q2, alpha, zone, c, gain)
        turns = rigid and mode == ZONE
        for i in range(record.size - 1):
            ua = factors[j] * record[i]
            ub = factors[j] * record[i + 1]
            slope = (ub - ua) / dt
            if mode == REST and abs(ub) <= threshold:
                continue  # below the threshold at both ends, and linear in between
            for k in range(steps):
                t = k * h
                end = t + h
                for _ in range(_MOST_EVENTS):
                    event = NOTHING
                    if mode == REST:
                        if abs(ub) <= threshold:
                            break
                        lifts = (math.copysign(threshold, ub) - ua) / slope if abs(ua + slope * t) <= threshold else t
                        if lifts >= end:
                            break
                        t = max(t, lifts)
                        mode = RIGID
                        side = -math.copysign(1.0, ub)
                    else:
                        u = ua + slope * t
                        theta1, omega1 = _branch_step(
                            exact, stiffness, offset, damping, factor, theta, omega, u, slope, end - t
                        )
                        if side * theta1 < low:
                            event = LOW
                        elif side * theta1 > high:
                            event = HIGH
                        elif turns and omega * omega1 < 0.0:
                            event = TURN
                        if event == NOTHING:
                            theta = theta1
                            omega = omega1
                            break
                        bound = low if event == LOW else high
                        length, theta, omega = _step_to(
                            event, bound, side, exact, stiffness, offset, damping, factor, theta, omega, u, slope,
                            end - t, theta1, omega1,
                        )  # fmt: skip
                        t += length
                        u = ua + slope * t
                        impact = mode == RIGID and event == LOW
                        mode, side, theta, omega, held = transition(
                            event, mode, side, theta, omega, held, u, kind, q2, alpha, edge, zone, c, e, rigid
                        )
                        if mode == FALLEN:
                            break
                        if impact and settles(omega, u, ub, dt - t, kind, q2, alpha, e, gain):
                            mode = REST
                            omega = 0.0
                    low, high = bounds(mode, edge)
                    stiffness, offset, damping, factor = law(mode, side, held, kind, q2, alpha, zone, c, gain)
                    turns = rigid and mode == ZONE
                peak = max(peak, abs(theta))
                if mode == FALLEN:
                    break
            if mode == FALLEN:
                if every > 0:
                    rotation[j, i // every + 1 :] = theta
                break
            if every > 0 and (i + 1) % every == 0:
                rotation[j, (i + 1) // every] = theta
        falls[j] = mode == FALLEN or escapes(theta, omega, kind, q2, alpha, edge, c)
        peaks[j] = FLAT if falls[j] else peak


@kernel(keep=True)
def next_stops(
    record, dt, every, factors, kind, q2, alpha, edge, zone, c, e, gain, rigid, peaks, falls, rotation,
    run, sample, time, mode, side, held, pending, events, moved, state, pars, limit,
):  # fmt: skip
    """Process the stop that each lane has reached and set up its way to the next; return True while a lane is busy.

    A lane solves one run at a time and then takes the next pending run.  In: `events` (b,): LOW or HIGH if theta fell
    or rose through its bound, TURN; `moved` (b,): the elapsed time; `state` (2, b).  Out: `state`, and `pars` (8, b):
    stiffness, offset, damping, gain u'', its slope, the bounds of theta, the sign of omega; `limit` (b,): the time to
    the end of the sample, 0 for an idle lane.
    """
    threshold = holds(kind, q2, alpha) / gain
    busy = False
    for b in range(run.size):
        theta = state[0, b]
        omega = state[1, b]
        event = events[b]
        events[b] = NOTHING
        if run[b] >= 0:
            peaks[run[b]] = max(peaks[run[b]], abs(theta))
            time[b] += moved[b]
            if event == NOTHING and omega < 0.0 and theta < pars[5, b]:
                event = LOW  # a bounce too short to be detected
            elif event == NOTHING and omega > 0.0 and theta > pars[6, b]:
                event = HIGH
            if event != NOTHING:
                if event == TURN:
                    omega = 0.0  # a rounding error of the old sign would be a turn again at once
                elif side[b] < 0.0:
                    event = HIGH if event == LOW else LOW
                ua = factors[run[b]] * record[sample[b]]
                ub = factors[run[b]] * record[sample[b] + 1]
                u = ua + (ub - ua) * time[b] / dt
                impact = mode[b] == RIGID and event == LOW
                mode[b], side[b], theta, omega, held[b] = transition(
                    event, mode[b], side[b], theta, omega, held[b], u, kind, q2, alpha, edge, zone, c, e, rigid
                )
                if impact and settles(omega, u, ub, dt - time[b], kind, q2, alpha, e, gain):
                    mode[b] = REST
                    omega = 0.0
        while True:
            if run[b] < 0:
                if pending[0] >= factors.size:
                    break
                run[b] = pending[0]
                pending[0] += 1
                sample[b] = 0
                time[b] = 0.0
                theta = omega = 0.0
                side[b] = 1.0
                held[b] = c
                mode[b] = REST if rigid else ZONE
            j = run[b]
            if mode[b] == REST:
                ua = factors[j] * record[sample[b]]
                ub = factors[j] * record[sample[b] + 1]
                if abs(ub) > threshold:
                    if abs(ua + (ub - ua) * time[b] / dt) <= threshold:
                        time[b] = max(time[b], (math.copysign(threshold, ub) - ua) / (ub - ua) * dt)
                    mode[b] = RIGID
                    side[b] = -math.copysign(1.0, ub)
                else:
                    time[b] = dt
            if mode[b] != FALLEN and dt - time[b] <= 1e-13 * dt:
                sample[b] += 1
                time[b] = 0.0
                if every > 0 and sample[b] % every == 0:
                    rotation[j, sample[b] // every] = theta
                if sample[b] < record.size - 1:
                    if mode[b] == REST:
                        continue
                    break
            elif mode[b] != FALLEN:
                break
            falls[j] = mode[b] == FALLEN or escapes(theta, omega, kind, q2, alpha, edge, c)
            if falls[j]:
                peaks[j] = FLAT
            if mode[b] == FALLEN and every > 0:
                rotation[j, sample[b] // every + 1 :] = theta
            run[b] = -1
        if run[b] < 0:
            limit[b] = 0.0
            pars[:, b] = 0.0
            pars[5, b] = -FLAT
            pars[6, b] = FLAT
            state[:, b] = 0.0
            continue
        busy = True
        slope = factors[run[b]] * (record[sample[b] + 1] - record[sample[b]]) / dt
        u = factors[run[b]] * record[sample[b]] + slope * time[b]
        pars[0, b], pars[1, b], pars[2, b], factor = law(mode[b], side[b], held[b], kind, q2, alpha, zone, c, gain)
        pars[3, b] = factor * u
        pars[4, b] = factor * slope
        low, high = bounds(mode[b], edge)
        pars[5, b] = low if side[b] > 0.0 else -high
        pars[6, b] = high if side[b] > 0.0 else -low
        way = omega
        if omega == 0.0:
            way = _acceleration(kind == EXACT, pars[0, b], pars[1, b], pars[2, b], factor, theta, omega, u)
            if way == 0.0:
                way = -slope
        pars[7, b] = math.copysign(1.0, way)
        state[0, b] = theta
        state[1, b] = omega
        limit[b] = dt - time[b]
    return busy
