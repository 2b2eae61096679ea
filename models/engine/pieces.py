"""The general way: one run, piece by piece, from its series to its first event and the action there."""

import math

from ...compiled import kernel
from .events import AT_UPPER, NO_EVENT, TURN, first_event
from .hops import solve_hops, solve_low_hops
from .regions import captures, held_damping, potential_energy
from .rest import comes_to_rest, has_bounced_out, uplift
from .series import exact_series, linear_series, rate_bound, series_degree
from .tables import (
    CROSS,
    ENTER,
    EPSILON,
    FLAT,
    FREE,
    FUSED,
    HELD,
    IMPACTS,
    LINK_HELD,
    LINK_LOWER_ACTION,
    LINK_LOWER_OTHER,
    LINK_LOWER_TARGET,
    LINK_TURN_LEFT,
    LINK_TURN_RIGHT,
    LINK_UPPER_ACTION,
    LINK_UPPER_OTHER,
    LINK_UPPER_TARGET,
    MANY_HOPS,
    NO_REGION,
    NOW,
    OMEGA,
    OVERTURN,
    OVERTURN_TIME,
    OVERTURNED,
    PAR_EXACT,
    PAR_RESTITUTION,
    PEAK,
    REGION_CENTRE,
    REGION_DAMPING,
    REGION_LOWER,
    REGION_OFFSET,
    REGION_POTENTIAL,
    REGION_STIFFNESS,
    REGION_UPPER,
    REST,
    STRIKE,
    THETA,
    TURNS,
    UPLIFTED,
)

VANISHED = 1e-280  # rotation (rad) and velocity (rad/s) without shaking that count as zero


@kernel(**FUSED)
def _record_turn(x, k, model, o, region, time, turns):
    """Record a turning point in the peak and the list of peaks, and change to the region that takes over, if any."""
    theta = x[THETA]
    x[PEAK] = max(x[PEAK], abs(theta))
    if k[TURNS] < turns.shape[1]:
        turns[0, k[TURNS]] = time
        turns[1, k[TURNS]] = theta
    k[TURNS] += 1
    target = model.links[o, region, LINK_TURN_RIGHT] if theta >= 0.0 else model.links[o, region, LINK_TURN_LEFT]
    if target != NO_REGION:
        # Same energy on the branch that takes over: U(theta') = U(theta), the root next to zero, on the same side.
        energy = potential_energy(model, o, region, theta) - model.tables[o, target, REGION_POTENTIAL]
        stiffness = model.tables[o, target, REGION_STIFFNESS]
        offset = model.tables[o, target, REGION_OFFSET]
        root = math.sqrt(max(0.0, offset * offset + 2.0 * stiffness * energy))
        other_side = offset > 0.0 if offset != 0.0 else theta < 0.0
        denominator = offset + (root if other_side else -root)
        x[THETA] = -2.0 * energy / denominator if denominator != 0.0 else 0.0
        k[NOW] = target


@kernel(inline="always")
def at_edge(x, k, model, o, region, upper, force, slope, left, time):
    """Act where the rotation reaches an edge of its region: cross, enter a zone, impact (restitution) or overturn."""
    if upper:
        action = model.links[o, region, LINK_UPPER_ACTION]
        target = model.links[o, region, LINK_UPPER_TARGET]
        other = model.links[o, region, LINK_UPPER_OTHER]
    else:
        action = model.links[o, region, LINK_LOWER_ACTION]
        target = model.links[o, region, LINK_LOWER_TARGET]
        other = model.links[o, region, LINK_LOWER_OTHER]
    if action == OVERTURN:
        k[OVERTURNED] = 1
        x[PEAK] = FLAT
        x[OVERTURN_TIME] = time
        return
    k[NOW] = target
    if action == CROSS:
        k[UPLIFTED] = 1
    elif action == ENTER:
        if other != NO_REGION:
            # Too slow for an impact with e to carry it through the zone: it stays on the rigid branch.
            e = model.parameters[o, PAR_RESTITUTION]
            potential = potential_energy(model, o, region, x[THETA])
            if e * e * (0.5 * x[OMEGA] * x[OMEGA] + potential) <= potential:
                k[NOW] = other
                return
        k[IMPACTS] += 1
        x[STRIKE] = max(x[STRIKE], abs(x[OMEGA]))
        x[HELD] = held_damping(model, o, target, x[OMEGA])
    else:
        k[IMPACTS] += 1
        x[STRIKE] = max(x[STRIKE], abs(x[OMEGA]))
        x[OMEGA] *= model.parameters[o, PAR_RESTITUTION]
        stiffness = model.tables[o, region, REGION_STIFFNESS]
        highest = min(x[PEAK], model.tables[o, target, REGION_UPPER] - model.tables[o, target, REGION_LOWER])
        highest = min(highest, model.tables[o, region, REGION_UPPER] - model.tables[o, region, REGION_LOWER])
        if k[FREE] == 0 and comes_to_rest(model, o, x[OMEGA], stiffness, force, slope, left, highest):
            x[OMEGA] = 0.0
            k[NOW] = REST


@kernel(**FUSED)
def solve_piece(x, k, model, o, force, slope, left, time, work, trig):
    """Solve one piece, from the state to its first event or to the end of the step; return the time that it took.

    `trig` is the room for sine and cosine in exact geometry, and None in linear geometry: each compiles its own series.
    """
    waited = 0.0
    if k[NOW] == REST:
        waited, force = uplift(model, o, x, k, force, slope, left)
        if k[NOW] == REST:
            return left
        left -= waited
    region = k[NOW]
    theta = x[THETA]
    omega = x[OMEGA]
    stiffness = model.tables[o, region, REGION_STIFFNESS]
    poly = work.poly
    if trig is not None:
        centre = model.tables[o, region, REGION_CENTRE]
        h = min(left, 0.5 / math.sqrt(-stiffness))
        n, h = exact_series(
            poly, trig, theta, omega, -stiffness, centre, model.parameters[o, PAR_EXACT], force, slope, h
        )
    else:
        offset = model.tables[o, region, REGION_OFFSET]
        c = x[HELD] if model.links[o, region, LINK_HELD] else model.tables[o, region, REGION_DAMPING]
        rate = rate_bound(stiffness, c)
        h = left if rate * left <= 0.5 else 0.5 / rate
        a = force + offset - stiffness * theta
        if omega == 0.0 and abs(a) <= 2.0 * EPSILON * (abs(force) + abs(offset) + abs(stiffness * theta)):
            a = 0.0  # the sign of what is left is rounding; the slope of the forcing decides
        n = series_degree(rate * h)
        linear_series(poly, a - c * omega, omega, c, stiffness, slope, n)
    hop = -1.0
    if k[FREE] == 0 and work.turns.shape[1] == 0 and not captures(model, o, region):
        hop = x[PEAK] - abs(theta)
    kind, t, moved, velocity = first_event(
        poly, n, h, theta, model.tables[o, region, REGION_LOWER], model.tables[o, region, REGION_UPPER], hop
    )
    if kind == NO_EVENT:
        x[THETA] = theta + moved
        x[OMEGA] = velocity
        return waited + (left if h == left else t)
    now = time + waited + t
    if kind == TURN:
        x[THETA] = theta + moved
        x[OMEGA] = 0.0
        _record_turn(x, k, model, o, region, now, work.turns)
        return waited + t
    upper = kind == AT_UPPER
    x[THETA] = model.tables[o, region, REGION_UPPER] if upper else model.tables[o, region, REGION_LOWER]
    x[OMEGA] = max(velocity, 0.0) if upper else min(velocity, 0.0)
    at_edge(x, k, model, o, region, upper, force + slope * t, slope, left - t, now)
    return waited + t


@kernel(**FUSED)
def solve_sample(x, k, model, o, force, slope, t, dt, time, work, trig):
    """Solve one sample from its time t on, cut at its events."""
    impacts = k[IMPACTS]
    hops = work.turns.shape[1] == 0
    while t < dt and k[OVERTURNED] == 0:
        if k[NOW] != REST and x[THETA] == 0.0:
            if k[IMPACTS] - impacts > MANY_HOPS and k[TURNS] >= work.turns.shape[1]:
                t = solve_low_hops(x, k, model, o, force, slope, t, dt)
            if trig is None and hops and k[NOW] != REST:
                t = solve_hops(x, k, model, o, force, slope, t, dt)
            if t >= dt:
                break
        t += solve_piece(x, k, model, o, force + slope * t, slope, dt - t, time + t, work, trig)
        if has_bounced_out(x, k, model, o, force + slope * t):
            x[OMEGA] = 0.0
            k[NOW] = REST
    if abs(x[OMEGA]) < VANISHED and abs(x[THETA]) < VANISHED and force == 0.0 and slope == 0.0:
        # Subnormal numbers decay no further, and processors take a hundred times as long over them.
        x[THETA] = 0.0
        x[OMEGA] = 0.0
