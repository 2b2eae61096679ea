"""The general way: one run, piece by piece, to its first event and the action there (impact, wall, rupture, fall)."""

import math

from ...core.compiled import kernel
from .events import AT_UPPER, NO_EVENT, TURN, first_event
from .hops import solve_hops, solve_low_hops
from .regions import captures, energy_of, greatest, held_damping, later, lesser_peak, potential_energy, raise_peak
from .rest import comes_to_rest, has_bounced_out, may_rest, rest_at, set_at_rest, uplift
from .series import exact_series, linear_series, rate_bound, series_degree
from .tables import (
    BACK,
    BOUNCE,
    BREAK,
    BREAK_TIME,
    BROKEN,
    CROSS,
    ENTER,
    EPSILON,
    FREE,
    FRONT,
    FUSED,
    GIVEN_UP,
    HELD,
    IMPACT,
    IMPACTS,
    LINK_HELD,
    LINK_LOWER_ACTION,
    LINK_LOWER_REST,
    LINK_LOWER_SLOW,
    LINK_LOWER_TARGET,
    LINK_TURN_LEFT,
    LINK_TURN_RIGHT,
    LINK_UPPER_ACTION,
    LINK_UPPER_REST,
    LINK_UPPER_SLOW,
    LINK_UPPER_TARGET,
    MANY_HOPS,
    MOST_PIECES,
    NO_REGION,
    NOW,
    OMEGA,
    OVERTURN,
    OVERTURN_TIME,
    OVERTURNED,
    PAR_EXACT,
    PAR_RESTITUTION,
    PAR_TOUCHING,
    PIECES,
    REGION_CENTRE,
    REGION_DAMPING,
    REGION_GAIN,
    REGION_INERTIA,
    REGION_LOWER,
    REGION_LOWER_FACTOR,
    REGION_LOWER_LOSS,
    REGION_OFFSET,
    REGION_POTENTIAL,
    REGION_STIFFNESS,
    REGION_UPPER,
    REGION_UPPER_FACTOR,
    REGION_UPPER_LOSS,
    SIDED,
    STRIKE,
    THETA,
    TURNS,
    UPLIFTED,
    WALL_IMPACTS,
    WALL_STRIKE,
)

VANISHED = 1e-280  # rotation (rad) and velocity (rad/s) without shaking that count as zero


@kernel(**FUSED)
def _record_turn(x, k, model, o, region, time, turns):
    """Record a turning point in the peak and the list of peaks, and change to the region that takes over, if any."""
    theta = x[THETA]
    raise_peak(x, k, theta)
    if k[TURNS] < turns.shape[1]:
        turns[0, k[TURNS]] = time
        turns[1, k[TURNS]] = theta
    k[TURNS] += 1
    right = theta >= model.tables[o, region, REGION_CENTRE]
    target = model.links[o, region, LINK_TURN_RIGHT] if right else model.links[o, region, LINK_TURN_LEFT]
    if target != NO_REGION:
        # Same energy on the branch that takes over: U(theta') = U(theta), the root next to zero, on the same side.
        energy = energy_of(model, o, region, theta, 0.0) / model.tables[o, target, REGION_INERTIA]
        energy -= model.tables[o, target, REGION_POTENTIAL]
        stiffness = model.tables[o, target, REGION_STIFFNESS]
        offset = model.tables[o, target, REGION_OFFSET]
        root = math.sqrt(max(0.0, offset * offset + 2.0 * stiffness * energy))
        other_side = offset > 0.0 if offset != 0.0 else not right
        denominator = offset + (root if other_side else -root)
        x[THETA] = -2.0 * energy / denominator if denominator != 0.0 else 0.0
        if k[SIDED] != 0:
            raise_peak(x, k, x[THETA])  # (it may be further out than the turn)
        k[NOW] = target


@kernel(inline="always")
def at_edge(x, k, model, o, region, upper, force, slope, left, time, weight):
    """Act when the rotation reaches an edge of its region.

    It crosses into another region (by breaking a restraint, too), enters a zone, or overturns. Or it has an impact into
    the region beyond or back into its own (a wall).
    """
    k[PIECES] += 1
    if k[PIECES] > MOST_PIECES:
        k[OVERTURNED] = GIVEN_UP
        return
    if upper:
        action = model.links[o, region, LINK_UPPER_ACTION]
        target = model.links[o, region, LINK_UPPER_TARGET]
        rest = model.links[o, region, LINK_UPPER_REST]
        factor = model.tables[o, region, REGION_UPPER_FACTOR]
        loss = model.tables[o, region, REGION_UPPER_LOSS]
    else:
        action = model.links[o, region, LINK_LOWER_ACTION]
        target = model.links[o, region, LINK_LOWER_TARGET]
        rest = model.links[o, region, LINK_LOWER_REST]
        factor = model.tables[o, region, REGION_LOWER_FACTOR]
        loss = model.tables[o, region, REGION_LOWER_LOSS]
    if action == OVERTURN:
        k[OVERTURNED] = 1
        raise_peak(x, k, x[THETA])
        x[OVERTURN_TIME] = time
        return
    k[NOW] = target
    if action in (CROSS, BREAK):
        k[UPLIFTED] = 1
        x[OMEGA] *= factor
        if action == BREAK:
            k[BROKEN] = 1
            x[BREAK_TIME] = time
        return
    speed = abs(x[OMEGA])
    if action == ENTER:
        slow = model.links[o, region, LINK_UPPER_SLOW if upper else LINK_LOWER_SLOW]
        if slow != NO_REGION:
            # Too slow for an impact with e to carry it through the zone: it stays on the rigid branch.
            e = model.parameters[o, PAR_RESTITUTION]
            potential = potential_energy(model, o, region, x[THETA])
            needed = potential
            if k[SIDED] != 0:
                # (over the inertia of the region that it comes from)
                out = model.tables[o, target, REGION_UPPER if x[OMEGA] > 0.0 else REGION_LOWER]
                needed = potential_energy(model, o, target, out) / (factor * factor)
            if e * e * (0.5 * x[OMEGA] * x[OMEGA] + potential) <= needed:
                k[NOW] = slow
                return
        k[IMPACTS] += 1
        x[STRIKE] = max(x[STRIKE], speed)
        x[OMEGA] *= factor
        x[HELD] = held_damping(model, o, target, x[OMEGA])
        return
    if action == BOUNCE:
        k[WALL_IMPACTS] += 1
        # (at a wall that it touches the impact of the base goes before)
        share = model.parameters[o, PAR_TOUCHING] if x[THETA] == 0.0 else 1.0
        x[WALL_STRIKE] = max(x[WALL_STRIKE], share * speed)
        raise_peak(x, k, x[THETA])
        x[OMEGA] *= -factor
    else:
        x[OMEGA] *= factor
    if action == IMPACT or x[THETA] == 0.0:
        k[IMPACTS] += 1
        x[STRIKE] = max(x[STRIKE], speed)
    if action == BOUNCE and x[OMEGA] == 0.0:
        set_at_rest(x, k, model, o, rest)
    elif k[FREE] == 0 and may_rest(model, o, rest, loss, x[OMEGA], left, weight):
        stiffness = model.tables[o, region, REGION_STIFFNESS]
        highest = model.tables[o, region, REGION_UPPER] - model.tables[o, region, REGION_LOWER]
        faster = x[OMEGA]
        if action == BOUNCE:
            highest = min(highest, x[BACK] + x[THETA] if upper else x[FRONT] - x[THETA])
        else:
            highest = min(highest, lesser_peak(x))
            highest = min(highest, model.tables[o, target, REGION_UPPER] - model.tables[o, target, REGION_LOWER])
            faster *= max(1.0, model.tables[o, target, REGION_LOWER_FACTOR if upper else REGION_UPPER_FACTOR])
        if comes_to_rest(model, o, rest, loss, x[OMEGA], faster, stiffness, force, slope, left, highest, weight):
            set_at_rest(x, k, model, o, rest)


@kernel(**FUSED)
def solve_piece(x, k, model, o, force, slope, left, time, work, trig, weight):
    """Solve one piece, from the state to its first event or to the end of the step; return the time that it took.

    `trig` is the room for sine and cosine in exact geometry, and None in linear geometry: each compiles its own series.
    `weight` is the block's at the beginning of the step, None without a vertical component.
    """
    k[PIECES] += 1
    if k[PIECES] > MOST_PIECES:
        k[OVERTURNED] = GIVEN_UP
        return left
    waited = 0.0
    if k[NOW] < 0:
        waited, force = uplift(model, o, x, k, force, slope, left, time, weight)
        if k[NOW] < 0:
            return left
        left -= waited
    now_heavy = later(weight, waited)
    region = k[NOW]
    theta = x[THETA]
    omega = x[OMEGA]
    stiffness = model.tables[o, region, REGION_STIFFNESS]
    gain = model.tables[o, region, REGION_GAIN]
    push = gain * force
    rise = gain * slope
    poly = work.poly
    if trig is not None:
        centre = model.tables[o, region, REGION_CENTRE]
        h = min(left, 0.5 / math.sqrt(-stiffness * greatest(now_heavy, left)))
        lever = model.parameters[o, PAR_EXACT]
        n, h = exact_series(poly, trig, now_heavy, theta, omega, -stiffness, centre, lever, push, rise, h)
    else:
        offset = model.tables[o, region, REGION_OFFSET]
        c = x[HELD] if model.links[o, region, LINK_HELD] else model.tables[o, region, REGION_DAMPING]
        rate = rate_bound(stiffness, c)
        h = left if rate * left <= 0.5 else 0.5 / rate
        a = push + offset - stiffness * theta
        if omega == 0.0 and abs(a) <= 2.0 * EPSILON * (abs(push) + abs(offset) + abs(stiffness * theta)):
            a = 0.0  # the sign of what is left is rounding; the slope of the forcing decides
        n = series_degree(rate * h)
        linear_series(poly, a - c * omega, omega, c, stiffness, rise, n)
    hop = -1.0
    if k[FREE] == 0 and work.turns.shape[1] == 0 and not captures(model, o, region):
        hop = lesser_peak(x) - abs(theta)
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
    at_edge(x, k, model, o, region, upper, force + slope * t, slope, left - t, now, later(now_heavy, t))
    return waited + t


@kernel(**FUSED)
def solve_sample(x, k, model, o, force, slope, t, dt, time, work, trig, weight):
    """Solve one sample from its time t on, cut at its events; force and weight are those at its beginning."""
    impacts = k[IMPACTS]
    hops = work.turns.shape[1] == 0
    while t < dt and k[OVERTURNED] == 0:
        if k[NOW] >= 0 and x[THETA] == 0.0:
            if k[IMPACTS] - impacts > MANY_HOPS and k[TURNS] >= work.turns.shape[1]:
                t = solve_low_hops(x, k, model, o, force, slope, t, dt, weight)
            if trig is None and hops and k[NOW] >= 0:
                t = solve_hops(x, k, model, o, force, slope, t, dt)
            if t >= dt:
                break
        t += solve_piece(x, k, model, o, force + slope * t, slope, dt - t, time + t, work, trig, later(weight, t))
        if has_bounced_out(x, k, model, o, force + slope * t, later(weight, t)):
            set_at_rest(x, k, model, o, rest_at(model, o, k[NOW], x[THETA]))
    if abs(x[OMEGA]) < VANISHED and abs(x[THETA]) < VANISHED and force == 0.0 and slope == 0.0:
        # Subnormal numbers decay no further, and processors take a hundred times as long over them.
        x[THETA] = 0.0
        x[OMEGA] = 0.0
