"""Free motion after the record, and bounds that prove that a block can no longer overturn."""

import math

from ...compiled import kernel
from .pieces import solve_piece
from .regions import potential_energy
from .tables import (
    FLAT,
    FREE,
    FUSED,
    HELD,
    IMPACTS,
    LINK_HELD,
    NOW,
    OMEGA,
    OVERTURN_TIME,
    OVERTURNED,
    PAR_EXACT,
    PAR_GAIN,
    PEAK,
    REGION_CENTRE,
    REGION_DAMPING,
    REGION_LOWER,
    REGION_STIFFNESS,
    REGION_UPPER,
    REST,
    STRIKE,
    THETA,
    TURNS,
)

MAX_FREE_PIECES = 100_000
MAX_FREE_TURNS = 4
FREE_STEP = 1e9  # s: longer than any piece


@kernel(**FUSED)
def _saddle_passed(x, k, model, o):
    """Return True if the unforced block is beyond the saddle of its region, or is sure to pass it.

    Along the saddle's stable direction a damped branch decays with c/2 + sqrt(c²/4 + |K|), so
    omega + rate (|x| - saddle) > 0 never comes back; on the exact branch omega + 2 p sin((|x| - alpha)/2) > 0.
    """
    region = k[NOW]
    stiffness = model.tables[o, region, REGION_STIFFNESS]
    if stiffness >= 0.0:
        return False
    saddle = model.tables[o, region, REGION_CENTRE]
    side = 1.0 if saddle > 0.0 else -1.0
    beyond = side * (x[THETA] - saddle)
    if model.parameters[o, PAR_EXACT] != 0.0:
        return side * x[OMEGA] + 2.0 * math.sqrt(-stiffness) * math.sin(0.5 * beyond) > 0.0
    half = 0.5 * model.tables[o, region, REGION_DAMPING]
    if model.links[o, region, LINK_HELD]:
        half = 0.5 * x[HELD]
    return side * x[OMEGA] + (half + math.sqrt(half * half - stiffness)) * beyond > 0.0


@kernel(**FUSED)
def find_barrier(model, o, barriers):
    """Write sqrt(2 (U_saddle - U_lowest)) of the lower saddle, U_lowest, and the shaking's largest lever into a row.

    U_lowest between the saddles; in exact geometry the lever of the shaking is largest, 1/cos(alpha), at the saddle.
    """
    lowest = math.inf
    saddle_potential = math.inf
    exact = model.parameters[o, PAR_EXACT] != 0.0
    lever = 1.0
    for r in range(model.tables.shape[1]):
        lower = model.tables[o, r, REGION_LOWER]
        upper = model.tables[o, r, REGION_UPPER]
        stiffness = model.tables[o, r, REGION_STIFFNESS]
        if not lower < upper:
            continue  # a row that only pads the table
        centre = model.tables[o, r, REGION_CENTRE]
        if stiffness > 0.0:
            lowest = min(lowest, potential_energy(model, o, r, min(max(centre, lower), upper)))
            continue
        if lower < centre < upper:
            saddle_potential = min(saddle_potential, potential_energy(model, o, r, centre))
            if exact:
                lever = max(lever, 1.0 / math.cos(centre))
        # the end of the branch that looks to the middle
        inner = lower if abs(lower) < abs(upper) else upper
        lowest = min(lowest, potential_energy(model, o, r, inner))
    barriers[o, 0] = math.sqrt(2.0 * max(saddle_potential - lowest, 0.0))
    barriers[o, 1] = lowest
    barriers[o, 2] = lever


@kernel(**FUSED)
def is_safe(x, k, model, o, push, barriers):
    """Return True if the rest of the record cannot overturn the block; push: gain * integral of |u''| over that rest.

    With E the energy above the lowest potential, |omega| <= sqrt(2E), so dE/dt <= |omega| |force| lets sqrt(2E) grow by
    no more than push.  No law adds energy.
    """
    energy = 0.0
    if k[NOW] != REST:
        energy = 0.5 * x[OMEGA] * x[OMEGA] + potential_energy(model, o, k[NOW], x[THETA]) - barriers[o, 1]
        stiffness = model.tables[o, k[NOW], REGION_STIFFNESS]
        if stiffness < 0.0 and abs(x[THETA]) >= abs(model.tables[o, k[NOW], REGION_CENTRE]):
            return False  # beyond the saddle
    return math.sqrt(2.0 * max(energy, 0.0)) + push * barriers[o, 2] < (1.0 - 1e-9) * barriers[o, 0]


@kernel(**FUSED)
def _is_bound(x, k, model, o):
    """Return True if the unforced block lacks the energy to exceed its peak so far on either side.

    No law adds energy, so it cannot pass a rotation whose potential is above the present energy.  At the peak that of
    the outermost region counts: it is the lower one where a rigid branch and a zone overlap.
    """
    if model.parameters[o, PAR_EXACT] != 0.0:
        return False
    energy = 0.5 * x[OMEGA] * x[OMEGA] + potential_energy(model, o, k[NOW], x[THETA])
    peak = x[PEAK]
    if abs(x[THETA]) > peak:
        return False
    right = math.inf
    left = math.inf
    for r in range(model.tables.shape[1]):
        if model.tables[o, r, REGION_LOWER] <= peak <= model.tables[o, r, REGION_UPPER]:
            right = min(right, potential_energy(model, o, r, peak))
        if model.tables[o, r, REGION_LOWER] <= -peak <= model.tables[o, r, REGION_UPPER]:
            left = min(left, potential_energy(model, o, r, -peak))
    return energy * (1.0 + 1e-9) < min(left, right)


@kernel(**FUSED)
def follow_free(x, k, model, o, time, work, trig):
    """Follow a block after the record until it has overturned, rests, or provably never exceeds its peak again.

    Free motion loses energy, so a turning point on each side bounds all that follow on it; inside a zone with a stable
    centre the energy itself does.  A block that turns on one side only (beside a wall) is bounded by a few turns there.
    """
    turns = k[TURNS]
    impacts = k[IMPACTS]
    strike = x[STRIKE]
    k[FREE] = 1
    passed = False
    sides = 0
    for _ in range(MAX_FREE_PIECES):
        if k[OVERTURNED] != 0 or k[NOW] == REST or sides == 3 or k[TURNS] - turns >= MAX_FREE_TURNS:
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
            if reach < inside and reach + abs(centre) <= x[PEAK]:
                break
        if x[OMEGA] == 0.0 and x[THETA] == model.tables[o, region, REGION_CENTRE]:
            break
        before = k[TURNS]
        time += solve_piece(x, k, model, o, 0.0, 0.0, FREE_STEP, time, work, trig)
        if passed and k[TURNS] != before:
            break  # rounding on the separatrix itself: the proof stands, the time is not known
        if k[TURNS] != before:
            sides |= 1 if x[THETA] > 0.0 else 2
    k[IMPACTS] = impacts  # those of the record only
    x[STRIKE] = strike
    if passed and k[OVERTURNED] == 0:
        k[OVERTURNED] = 1
        x[PEAK] = FLAT
        x[OVERTURN_TIME] = math.nan


@kernel(**FUSED)
def cannot_fall(model, o, factor, shaking_left, barriers):
    """Return True if the whole record cannot overturn a block that is at rest (as `is_safe`)."""
    push = abs(model.parameters[o, PAR_GAIN] * factor) * shaking_left[0]
    return push * barriers[o, 2] < (1.0 - 1e-9) * barriers[o, 0]
