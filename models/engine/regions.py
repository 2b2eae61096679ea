"""Energies, captures and damping of regions, the weight that scales their moments, and the largest rotations of a run.

The damping of a zone may be set at each inward crossing and held until the next.

The weight of a block under vertical acceleration, G = g + a_v over g, is linear in time between two samples. It is
given by its value at an instant and its rate, 1/s. `None` means no vertical component. Each function is compiled for it
apart, so that the engine then has the arithmetic without a weight.
"""

import math
from typing import Any, NamedTuple

from ...core.compiled import kernel
from .tables import (
    BACK,
    BARE,
    FRONT,
    FUSED,
    LINK_TURN_LEFT,
    LINK_TURN_RIGHT,
    NO_REGION,
    PAR_COEFFICIENT,
    PAR_EXACT,
    PAR_RESTITUTION,
    PAR_RULE,
    REGION_CENTRE,
    REGION_DAMPING,
    REGION_GAIN,
    REGION_INERTIA,
    REGION_LOWER,
    REGION_OFFSET,
    REGION_POTENTIAL,
    REGION_STIFFNESS,
    REGION_UPPER,
    RULE_ENERGY,
    RULE_ENTRY_SPEED,
    SIDED,
)

AT_REST = (1.0, 0.0)


class Lifting(NamedTuple):
    """Vertical component of a run: the unscaled record over g (n,), the largest of each SPAN, and the factor."""

    shaking: Any
    highs: Any
    factor: Any


@kernel(inline="always")
def raise_peak(x, k, theta):
    """Note a rotation in the largest so far."""
    both = k[SIDED] == 0
    x[FRONT] = max(x[FRONT], abs(theta) if both else theta)
    x[BACK] = max(x[BACK], abs(theta) if both else -theta)


@kernel(inline="always")
def lesser_peak(x):
    """Return the height below which no rotation to either side is a new largest one."""
    return min(x[FRONT], x[BACK])


@kernel(inline="always")
def captures(model, o, region):
    """Return True if another region takes over when the velocity vanishes inside this one."""
    return model.links[o, region, LINK_TURN_LEFT] != NO_REGION or model.links[o, region, LINK_TURN_RIGHT] != NO_REGION


@kernel(**FUSED)
def potential_energy(model, o, region, theta):
    """Return the potential energy per unit inertia at theta, as continued from `region`."""
    stiffness = model.tables[o, region, REGION_STIFFNESS]
    if model.parameters[o, PAR_EXACT] != 0.0:
        tilt = model.tables[o, region, REGION_CENTRE]
        return -stiffness * (math.cos(tilt - theta) - math.cos(tilt)) + model.tables[o, region, REGION_POTENTIAL]
    offset = model.tables[o, region, REGION_OFFSET]
    return (0.5 * stiffness * theta - offset) * theta + model.tables[o, region, REGION_POTENTIAL]


@kernel(**FUSED)
def energy_of(model, o, region, theta, omega):
    """Return kinetic and potential energy, over the oscillator's moment of inertia."""
    return model.tables[o, region, REGION_INERTIA] * (0.5 * omega * omega + potential_energy(model, o, region, theta))


@kernel(**FUSED)
def near_zero(model, o, region):
    """Return offset, stiffness, gain, lean at 0: theta'' = offset + gain forcing - (stiffness - lean forcing) theta."""
    stiffness = model.tables[o, region, REGION_STIFFNESS]
    gain = model.tables[o, region, REGION_GAIN]
    if model.parameters[o, PAR_EXACT] == 0.0:
        return model.tables[o, region, REGION_OFFSET], stiffness, gain, 0.0
    scale = gain * model.parameters[o, PAR_EXACT]
    tilt = model.tables[o, region, REGION_CENTRE]
    return stiffness * math.sin(tilt), stiffness * math.cos(tilt), scale * math.cos(tilt), scale * math.sin(tilt)


@kernel(**FUSED)
def _crossing_time(zeta, gap, u0, u1, r0, r1):
    """Time that a crossing takes with damping ratio zeta, and its derivative by zeta (see `energy_consistent_zeta`).

    gap = 1 - zeta²; u = v + zeta z and r = u² + gap z² at the start (0) and at the end (1). Needs u0 > sqrt(-gap) if
    overdamped.
    """
    least = min(u0, u1)
    if abs(gap) < 1e-3 * least * least and u0 > 0.0:
        # near critical damping: atan(w/u)/w as a series in w² = gap, the same on either side
        time = 0.0
        by_gap = 0.0
        p0 = 1.0 / u0
        p1 = 1.0 / u1
        power = 1.0
        for k in range(6):
            time += power * (p0 + p1) / (2 * k + 1)
            by_gap -= (k + 1) * power * (p0 / (u0 * u0) + p1 / (u1 * u1)) / (2 * k + 3)
            p0 /= u0 * u0
            p1 /= u1 * u1
            power *= -gap
        return time, 1.0 / r0 - 1.0 / r1 - 2.0 * zeta * by_gap
    if gap > 0.0:
        w = math.sqrt(gap)
        # (the two angles lie in (0, pi), their sum in (0, 2 pi))
        angle = math.atan2(w * (u0 + u1), u0 * u1 - gap)
        time = (angle if angle > 0.0 else angle + 2.0 * math.pi) / w
        return time, ((u0 * zeta / w - w) / -r0 - (u1 * zeta / w + w) / r1) / w + time * zeta / gap
    w = math.sqrt(-gap)
    time = 0.5 * (math.log((u0 + w) * (u0 + w) / r0) + math.log((u1 + w) * (u1 + w) / r1)) / w
    return time, ((u0 * zeta / w + w) / r0 + (u1 * zeta / w - w) / r1) / w + time * zeta / gap


@kernel(keep=True, **FUSED)
def energy_consistent_zeta(speed, exit_speed):
    """Damping ratio with which a crossing from -1 at `speed` leaves +1 at `exit_speed` (unit frequency, unforced).

    With u = v + zeta z and w² = 1 - zeta², r = u² + w² z² falls as exp(-2 zeta t) along the motion. The phase atan2(w
    z, u) grows as w t (hyperbolic if overdamped). So the start (-1, speed) and the end (1, exit_speed) give the time
    between them in closed form. One equation for zeta alone remains, ln(r_start/r_end) = 2 zeta time. It falls
    strictly: Newton's step in a bracket finds its root to rounding.
    """
    loss = (speed - exit_speed) * (speed + exit_speed)
    if loss <= 0.0:
        return 0.0
    # First guess: the loss over the undamped path, slowed to first order (phase: from the middle to the edge).
    phase = math.atan2(1.0, speed)
    path = speed + (speed * speed + 1.0) * phase
    zeta = 0.5 * loss / (path + math.sqrt(max(0.0, path * (path - 2.0 * phase * loss))))
    low = 0.0
    high = math.inf
    for _ in range(200):
        gap = (1.0 - zeta) * (1.0 + zeta)
        u0 = speed - zeta
        u1 = exit_speed + zeta
        r1 = 1.0 + exit_speed * (exit_speed + 2.0 * zeta)
        excess = loss - 2.0 * zeta * (speed + exit_speed)
        r0 = r1 + excess
        arrives = r0 > 0.0 and (gap > 0.0 or u0 > math.sqrt(-gap))
        newton = -1.0
        if arrives:
            time, by_zeta = _crossing_time(zeta, gap, u0, u1, r0, r1)
            residual = math.log1p(excess / r1) - 2.0 * zeta * time
            slope = -2.0 * (speed / r0 + exit_speed / r1 + time + zeta * by_zeta)
            arrives = residual >= 0.0
            if slope < 0.0:
                newton = zeta - residual / slope
        if arrives:
            low = zeta
        else:
            high = zeta
        new = newton
        if not (low <= new <= high):
            new = 0.5 * (low + high) if high < math.inf else 2.0 * zeta
        if abs(new - zeta) <= 1e-8 * zeta and new == newton:
            return new  # (what is left is of the order of the square of the step)
        if abs(new - zeta) <= 4e-16 * zeta:
            return new
        zeta = new
    return zeta


@kernel(**FUSED)
def crossing_zeta(start, speed, end, exit_speed):
    """Damping ratio with which a crossing from `start` < 0 at `speed` leaves `end` > 0 at `exit_speed`, as above.

    It is for a zone whose centre is not in its middle. With u = v + zeta z and r = u² + (1 - zeta²) z² at both ends,
    ln(r_start/r_end) = 2 zeta time falls strictly with zeta. Regula falsi (Illinois) inside a bracket finds its root.
    """
    loss = (speed - exit_speed) * (speed + exit_speed) + (start - end) * (start + end)
    if loss <= 0.0:
        return 0.0
    low = 0.0
    at_low = math.log1p(loss / (exit_speed * exit_speed + end * end))
    high = math.inf
    at_high = -1.0
    zeta = 0.5 * loss / ((end - start) * (speed + exit_speed))
    for _ in range(300):
        u0 = speed + zeta * start
        u1 = exit_speed + zeta * end
        r1 = exit_speed * exit_speed + end * end + 2.0 * zeta * exit_speed * end
        excess = loss + 2.0 * zeta * (speed * start - exit_speed * end)
        gap = (1.0 - zeta) * (1.0 + zeta)
        w = math.sqrt(abs(gap))
        excess_over = excess / r1
        residual = -1.0
        if excess_over > -1.0 and (gap >= 0.0 or u0 + w * start > 0.0):
            if gap > 0.0:
                time = (math.atan2(w * end, u1) - math.atan2(w * start, u0)) / w
            elif gap < 0.0:
                time = (math.atanh(w * end / u1) - math.atanh(w * start / u0)) / w
            else:
                time = end / u1 - start / u0
            residual = math.log1p(excess_over) - 2.0 * zeta * time
        if residual == 0.0:
            return zeta
        before = zeta
        if residual > 0.0:
            low = zeta
            at_low = residual
            at_high *= 0.5
        else:
            high = zeta
            at_high = residual
            at_low *= 0.5
        if high == math.inf:
            zeta = 2.0 * zeta
        else:
            zeta = (low * at_high - high * at_low) / (at_high - at_low)
            if not low < zeta < high:
                zeta = 0.5 * (low + high)
        if high < math.inf and (high - low <= 4e-16 * high or zeta == before or zeta in (low, high)):
            break
    return zeta


@kernel(**FUSED)
def _energy_held(model, o, zone, omega):
    """Return `held_damping` of a zone whose centre is not in its middle: its two edges have potentials of their own."""
    row = model.tables[o, zone]
    upward = omega > 0.0
    entry = row[REGION_LOWER] if upward else row[REGION_UPPER]
    leaves = row[REGION_UPPER] if upward else row[REGION_LOWER]
    e = model.parameters[o, PAR_RESTITUTION]
    frequency = math.sqrt(row[REGION_STIFFNESS])
    start = -abs(entry - row[REGION_CENTRE])
    end = abs(leaves - row[REGION_CENTRE])
    unit = 1.0 / frequency
    kept = e * e * potential_energy(model, o, zone, entry) - potential_energy(model, o, zone, leaves)
    squared = e * e * omega * omega + 2.0 * kept
    if squared > 0.0:
        return 2.0 * frequency * crossing_zeta(start, abs(omega) * unit, end, math.sqrt(squared) * unit)
    zeta = crossing_zeta(start, abs(omega) * unit, end, 0.0)
    return 2.0 * frequency * (zeta * (1.0 + 1e-13) + 1e-13)  # (see `held_damping`)


@kernel(**FUSED)
def held_damping(model, o, zone, omega):
    """Return a zone's damping from this inward crossing to the next, by the oscillator's rule (1/s, unit inertia)."""
    rule = int(model.parameters[o, PAR_RULE])
    speed = abs(omega)
    if rule == RULE_ENTRY_SPEED:
        return model.parameters[o, PAR_COEFFICIENT] * speed
    if rule == RULE_ENERGY and model.tables[o, zone, REGION_OFFSET] != 0.0:
        return _energy_held(model, o, zone, omega)
    if rule == RULE_ENERGY:
        e = model.parameters[o, PAR_RESTITUTION]
        if e == 1.0:
            return 0.0
        half = 0.5 * (model.tables[o, zone, REGION_UPPER] - model.tables[o, zone, REGION_LOWER])
        frequency = math.sqrt(model.tables[o, zone, REGION_STIFFNESS])
        unit = 1.0 / (half * frequency)
        # PAR_COEFFICIENT: potential at the zone's edge, so that exit² = e² entry² - 2 (1 - e²) U
        squared = e * e * speed * speed - 2.0 * (1.0 - e * e) * model.parameters[o, PAR_COEFFICIENT]
        if squared > 0.0:
            return 2.0 * frequency * energy_consistent_zeta(speed * unit, math.sqrt(squared) * unit)
        # It just stops at the far edge.  A hair more damping turns it inside: on the edge itself rounding would decide
        # whether another crossing, with another damping, follows.
        zeta = energy_consistent_zeta(speed * unit, 0.0)
        return 2.0 * frequency * (zeta * (1.0 + 1e-13) + 1e-13)
    return model.tables[o, zone, REGION_DAMPING]


@kernel(**BARE)
def weight_over(weight, lifting, i, dt):
    """Return the weight over sample i, bit-identical for every caller."""
    if weight is None:
        return weight
    start = lifting.factor * lifting.shaking[i]
    return 1.0 + start, (lifting.factor * lifting.shaking[i + 1] - start) / dt


@kernel(**FUSED)
def weight_at(weight, lifting, i):
    """Return the value of the weight at sample i."""
    if weight is None:
        return 1.0
    return 1.0 + lifting.factor * lifting.shaking[i]


@kernel(**FUSED)
def least_weight(weight, lifting, span):
    """Return a lower bound of the weight over a span of the record (see `rest.until_uplift`)."""
    if weight is None:
        return 1.0
    return 1.0 - abs(lifting.factor) * lifting.highs[span]


@kernel(**FUSED)
def later(weight, t):
    """Return the weight a time t later."""
    if weight is None:
        return weight
    return weight[0] + weight[1] * t, weight[1]


@kernel(**FUSED)
def value(weight):
    """Return the value of the weight."""
    if weight is None:
        return 1.0
    return weight[0]


@kernel(**FUSED)
def rate(weight):
    """Return the rate of the weight, 1/s."""
    if weight is None:
        return 0.0
    return weight[1]


@kernel(**FUSED)
def greatest(weight, t):
    """Return the maximum weight until a time t."""
    if weight is None:
        return 1.0
    return max(weight[0], weight[0] + weight[1] * t)


@kernel(**FUSED)
def rounding(weight, force, end):
    """Return the size of the numbers whose difference decides whether a threshold that changes is exceeded."""
    if weight is None:
        return 0.0
    return abs(force) + abs(end)


@kernel(**FUSED)
def with_rate(weight, offset, push):
    """Return the rate of a moment `offset`, at rest, that is in proportion to the weight, and of a push together."""
    if weight is None:
        return push
    return offset * weight[1] + push
