"""Free motion after the record, and bounds that prove that a block can no longer overturn."""

import math

from ...core.compiled import kernel
from .pieces import solve_piece
from .regions import energy_of, potential_energy, raise_peak
from .rest import uplift
from .tables import (
    BACK,
    BOUNCE,
    BREAK,
    BROKEN,
    EPSILON,
    FLAT,
    FREE,
    FRONT,
    FUSED,
    HELD,
    IMPACTS,
    LINK_BROKEN,
    LINK_FALLS,
    LINK_HELD,
    LINK_LOWER_ACTION,
    LINK_UPPER_ACTION,
    NOW,
    OMEGA,
    OVERTURN,
    OVERTURN_TIME,
    OVERTURNED,
    PAR_EXACT,
    PAR_GAIN,
    PAR_START,
    REGION_CENTRE,
    REGION_DAMPING,
    REGION_GAIN,
    REGION_INERTIA,
    REGION_LOWER,
    REGION_STIFFNESS,
    REGION_UPPER,
    REST_THETA,
    REST_UP_TARGET,
    SIDED,
    STRIKE,
    THETA,
    TURNS,
    WALL_IMPACTS,
    WALL_STRIKE,
    WELL,
)

MAX_FREE_PIECES = 100_000
MAX_FREE_TURNS = 4
FREE_STEP = 1e9  # s: longer than any piece
UNDECIDED = -2


@kernel(**FUSED)
def _saddle_passed(x, k, model, o):
    """Return True if the unforced block is beyond the saddle of its region, or is sure to pass it.

    Along the saddle's stable direction a damped branch decays with c/2 + sqrt(c²/4 + |K|), so a block with omega + rate
    (|x| - saddle) > 0 never returns. On the exact branch the condition is omega + 2 p sin((|x| - alpha)/2) > 0.
    """
    region = k[NOW]
    stiffness = model.tables[o, region, REGION_STIFFNESS]
    if stiffness >= 0.0 or model.links[o, region, LINK_FALLS] == 0:
        return False
    saddle = model.tables[o, region, REGION_CENTRE]
    side = 1.0 if saddle > 0.0 else -1.0
    beyond = side * (x[THETA] - saddle)
    if model.parameters[o, PAR_EXACT] != 0.0:
        return side * x[OMEGA] + 2.0 * math.sqrt(-stiffness) * math.sin(0.5 * beyond) > 0.0
    return side * x[OMEGA] + _stable_rate(x, k, model, o) * beyond > 0.0


@kernel(**FUSED)
def _stable_rate(x, k, model, o):
    """Return the rate at which the falling branch decays along its saddle's stable direction, 1/s."""
    region = k[NOW]
    half = 0.5 * model.tables[o, region, REGION_DAMPING]
    if model.links[o, region, LINK_HELD]:
        half = 0.5 * x[HELD]
    return half + math.sqrt(half * half - model.tables[o, region, REGION_STIFFNESS])


@kernel(**FUSED)
def _time_to_fall(x, k, model, o):
    """Return the time until an unforced block that is sure to pass its saddle lies flat.

    Beyond the saddle y = a exp(u t) + b exp(-s t), with the rate s of decay and u = |K|/s of growth, and a = (v + s
    y0)/(u + s) > 0. It reaches `FLAT` once. On the separatrix itself, the only case in exact geometry, rounding decides
    a.
    """
    saddle = model.tables[o, k[NOW], REGION_CENTRE]
    side = 1.0 if saddle > 0.0 else -1.0
    beyond = side * (x[THETA] - saddle)
    flat = FLAT - side * saddle
    decay = _stable_rate(x, k, model, o)
    growth = -model.tables[o, k[NOW], REGION_STIFFNESS] / decay
    a = max((side * x[OMEGA] + decay * beyond) / (growth + decay), EPSILON * EPSILON * flat)
    b = beyond - a
    low = 0.0
    high = math.log((flat + abs(b)) / a) / growth
    for _ in range(200):
        t = 0.5 * (low + high)
        if a * math.exp(growth * t) + b * math.exp(-decay * t) < flat:
            low = t
        else:
            high = t
        if high - low <= 4.0 * EPSILON * high:
            break
    return high


@kernel(**FUSED)
def find_barrier(model, o, barriers):
    """Write sqrt(2 (U_saddle - U_lowest)) of the lower saddle, U_lowest, and the motion's largest lever into a row.

    On a side with a restraint, the block may lie flat before a saddle: its potential there counts as a saddle's.
    U_lowest is between the saddles; in exact geometry the lever of the motion is largest, 1/cos(alpha), at the saddle.
    The row then has the saddles next to 0, right and left: only between them is the energy below the barrier a proof.
    It ends with sqrt(2E) of the block as it starts; and the largest moment of the weight between the saddles, p²
    sin(alpha), which a vertical component changes. Energies are over one moment of inertia I, so that a region of
    inertia J has sqrt(J/I) times the forcing of its own gain.
    """
    lowest = math.inf
    saddle_potential = math.inf
    exact = model.parameters[o, PAR_EXACT]
    lever = 1.0
    moment = 0.0
    right = math.inf
    left = -math.inf
    for r in range(model.tables.shape[1]):
        lower = model.tables[o, r, REGION_LOWER]
        upper = model.tables[o, r, REGION_UPPER]
        stiffness = model.tables[o, r, REGION_STIFFNESS]
        if not lower < upper:
            continue  # a row that only pads the table
        centre = model.tables[o, r, REGION_CENTRE]
        inertia = model.tables[o, r, REGION_INERTIA]
        arm = math.sqrt(inertia) * model.tables[o, r, REGION_GAIN]
        lever = max(lever, arm)
        if exact != 0.0:
            lever = max(lever, arm * exact)
            moment = max(moment, math.sqrt(inertia) * abs(stiffness * math.sin(centre)))
        if model.links[o, r, LINK_UPPER_ACTION] == OVERTURN and (stiffness >= 0.0 or centre >= upper):
            saddle_potential = min(saddle_potential, inertia * potential_energy(model, o, r, upper))
        if model.links[o, r, LINK_LOWER_ACTION] == OVERTURN and (stiffness >= 0.0 or centre <= lower):
            saddle_potential = min(saddle_potential, inertia * potential_energy(model, o, r, lower))
        if stiffness > 0.0:
            lowest = min(lowest, inertia * potential_energy(model, o, r, min(max(centre, lower), upper)))
            continue
        if lower < centre < upper:
            saddle_potential = min(saddle_potential, inertia * potential_energy(model, o, r, centre))
            if centre > 0.0:
                right = min(right, centre)
            else:
                left = max(left, centre)
        # the end of the branch that looks to the middle, and one that a wall makes
        inner = lower if abs(lower) < abs(upper) else upper
        lowest = min(lowest, inertia * potential_energy(model, o, r, inner))
        if model.links[o, r, LINK_LOWER_ACTION] == BOUNCE:
            lowest = min(lowest, inertia * potential_energy(model, o, r, lower))
        if model.links[o, r, LINK_UPPER_ACTION] == BOUNCE:
            lowest = min(lowest, inertia * potential_energy(model, o, r, upper))
    barriers[o, 0] = math.sqrt(2.0 * max(saddle_potential - lowest, 0.0))
    barriers[o, 1] = lowest
    barriers[o, 2] = lever
    barriers[o, 3] = right
    barriers[o, 4] = left
    start = int(model.parameters[o, PAR_START])
    rests = start < 0
    region = int(model.rests[o, -1 - start, REST_UP_TARGET]) if rests else start
    theta = model.rests[o, -1 - start, REST_THETA] if rests else model.tables[o, region, REGION_CENTRE]
    barriers[o, 5] = math.sqrt(2.0 * max(energy_of(model, o, region, theta, 0.0) - lowest, 0.0))
    barriers[o, 6] = moment


@kernel(**FUSED)
def is_safe(x, k, model, o, push, lift, barriers):
    """Return True if the rest of the record cannot overturn the block.

    `push`: gain * integral of |u''| over that rest; `lift`: integral of |a_v|/g. With E the energy above the lowest
    potential, |omega| <= sqrt(2E). So dE/dt <= |omega| |force| lets sqrt(2E) grow by no more than push and, from the
    change of the weight, p² sin(alpha) lift. No law adds energy.
    """
    if x[THETA] >= barriers[o, 3] or x[THETA] <= barriers[o, 4]:
        return False  # beyond a saddle
    energy = 0.0
    if k[NOW] >= 0:
        energy = energy_of(model, o, k[NOW], x[THETA], x[OMEGA]) - barriers[o, 1]
    else:
        into = int(model.rests[o, -1 - k[NOW], REST_UP_TARGET])
        energy = energy_of(model, o, into, x[THETA], 0.0) - barriers[o, 1]
    gained = push * barriers[o, 2] + lift * barriers[o, 6]
    return math.sqrt(2.0 * max(energy, 0.0)) + gained < (1.0 - 1e-9) * barriers[o, 0]


@kernel(**FUSED)
def _is_bound(x, k, model, o):
    """Return True if the unforced block lacks the energy to exceed its peaks so far.

    No law adds energy, so it cannot pass a rotation whose potential is above the present energy. At the peak the
    potential of the outermost region counts: it is the lower one if a rigid branch and a zone overlap. Nothing passes a
    wall.
    """
    if model.parameters[o, PAR_EXACT] != 0.0:
        return False
    energy = energy_of(model, o, k[NOW], x[THETA], x[OMEGA])
    front = x[FRONT]
    back = -x[BACK]
    if x[THETA] > front or x[THETA] < back:
        return False
    right = math.inf
    left = math.inf
    for r in range(model.tables.shape[1]):
        lower = model.tables[o, r, REGION_LOWER]
        upper = model.tables[o, r, REGION_UPPER]
        if lower <= front <= upper and not (front == upper and model.links[o, r, LINK_UPPER_ACTION] == BOUNCE):
            right = min(right, energy_of(model, o, r, front, 0.0))
        if lower <= back <= upper and not (back == lower and model.links[o, r, LINK_LOWER_ACTION] == BOUNCE):
            left = min(left, energy_of(model, o, r, back, 0.0))
    return energy * (1.0 + 1e-9) < min(left, right)


@kernel(inline="always")
def _between(theta, left, right):
    """Return 0 for a rotation between the saddles, 1 beyond the right one and -1 beyond the left one."""
    return 1 if theta > right else (-1 if theta < left else 0)


@kernel(**FUSED)
def _well(x, k, model, o):
    """Return the place of the unforced block: 0 between the saddles next to 0, 1 and -1 beyond; UNDECIDED if open.

    It stays if the energy is below the lowest of the saddles, and too low to break an intact restraint that breaks on
    this side of the saddles.
    """
    lowest = math.inf
    right = math.inf
    left = -math.inf
    for r in range(model.tables.shape[1]):
        lower = model.tables[o, r, REGION_LOWER]
        upper = model.tables[o, r, REGION_UPPER]
        if not lower < upper or model.links[o, r, LINK_BROKEN] != k[BROKEN]:
            continue
        centre = model.tables[o, r, REGION_CENTRE]
        if lower < centre < upper and model.tables[o, r, REGION_STIFFNESS] < 0.0:
            lowest = min(lowest, energy_of(model, o, r, centre, 0.0))
            if centre > 0.0:
                right = min(right, centre)
            else:
                left = max(left, centre)
    well = _between(x[THETA], left, right)
    for r in range(model.tables.shape[1]):
        if model.links[o, r, LINK_BROKEN] != k[BROKEN]:
            continue
        lower = model.tables[o, r, REGION_LOWER]
        upper = model.tables[o, r, REGION_UPPER]
        if model.links[o, r, LINK_LOWER_ACTION] == BREAK and _between(lower, left, right) == well:
            lowest = min(lowest, energy_of(model, o, r, lower, 0.0))
        if model.links[o, r, LINK_UPPER_ACTION] == BREAK and _between(upper, left, right) == well:
            lowest = min(lowest, energy_of(model, o, r, upper, 0.0))
    if k[NOW] >= 0 and energy_of(model, o, k[NOW], x[THETA], x[OMEGA]) >= lowest:
        return UNDECIDED
    return well


@kernel(**FUSED)
def follow_free(x, k, model, o, time, work, trig):
    """Follow a block after the record until it has overturned, rests, or provably never exceeds its peaks again.

    Free motion loses energy, so a turning point on each side bounds all that follow on it; inside a zone with a stable
    centre the energy itself does. A block that turns on one side only (at a wall) is bounded by a few turns there. A
    block that may stay elsewhere than at 0 (against a wall, on a strap) is followed until that is known, too.
    """
    turns = k[TURNS]
    impacts = k[IMPACTS]
    strike = x[STRIKE]
    wall_impacts = k[WALL_IMPACTS]
    wall_strike = x[WALL_STRIKE]
    k[FREE] = 1
    passed = False
    sides = 0
    for _ in range(MAX_FREE_PIECES):
        if k[NOW] < 0:  # (without the shaking that holds it, a block comes off a wall)
            uplift(model, o, x, k, 0.0, 0.0, FREE_STEP, time, None)
        if k[OVERTURNED] != 0 or k[NOW] < 0 or sides == 3 or k[TURNS] - turns >= MAX_FREE_TURNS:
            break
        region = k[NOW]
        stiffness = model.tables[o, region, REGION_STIFFNESS]
        if not passed:
            passed = _saddle_passed(x, k, model, o)
            if not passed and _is_bound(x, k, model, o):
                break
        if stiffness > 0.0:
            centre = model.tables[o, region, REGION_CENTRE]
            aside = x[THETA] - centre
            reach = math.sqrt(aside * aside + x[OMEGA] * x[OMEGA] / stiffness)
            inside = min(model.tables[o, region, REGION_UPPER] - centre, centre - model.tables[o, region, REGION_LOWER])
            if reach < inside and centre + reach <= x[FRONT] and reach - centre <= x[BACK]:
                break
        if x[OMEGA] == 0.0 and x[THETA] == model.tables[o, region, REGION_CENTRE]:
            break
        before = k[TURNS]
        time += solve_piece(x, k, model, o, 0.0, 0.0, FREE_STEP, time, work, trig, None)
        if passed and k[TURNS] != before:
            break  # rounding on the separatrix itself: the proof is valid
        if k[TURNS] != before:
            sides |= 1 if x[THETA] > 0.0 else 2
    if k[SIDED] != 0 and not passed:
        well = _well(x, k, model, o)
        for _ in range(MAX_FREE_PIECES):
            if well != UNDECIDED or k[OVERTURNED] != 0:
                break
            passed = passed or _saddle_passed(x, k, model, o)
            before = k[TURNS]
            time += solve_piece(x, k, model, o, 0.0, 0.0, FREE_STEP, time, work, trig, None)
            if passed and k[TURNS] != before:
                break  # (as above)
            well = UNDECIDED if passed else _well(x, k, model, o)
        k[WELL] = 0 if well == UNDECIDED else well
    k[IMPACTS] = impacts  # turns of the record only
    x[STRIKE] = strike
    k[WALL_IMPACTS] = wall_impacts
    x[WALL_STRIKE] = wall_strike
    if passed and k[OVERTURNED] == 0:
        k[OVERTURNED] = 1
        raise_peak(x, k, math.copysign(FLAT, x[THETA]))
        x[OVERTURN_TIME] = time + _time_to_fall(x, k, model, o)


@kernel(**FUSED)
def cannot_fall(model, o, factor, shaking, lifting, barriers):
    """Return True if a record of these integrals of |u''| and |lifting| cannot overturn a block at rest (`is_safe`)."""
    push = abs(model.parameters[o, PAR_GAIN] * factor) * shaking
    gained = push * barriers[o, 2] + abs(factor) * lifting * barriers[o, 6]
    return barriers[o, 5] + gained < (1.0 - 1e-9) * barriers[o, 0]
