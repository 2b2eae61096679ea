"""The two sides of a block in numbers per unit inertia: falling branches, elastic zone, walls, restraint."""

import math
from functools import lru_cache

from ..core.units import STANDARD_GRAVITY
from .assembly import SMALLEST, Chord, Contact, Side, Spring, Surroundings, Zone
from .block import Block
from .engine import tables as engine
from .scenes.bed import polygon
from .scenes.restraint import Restraint
from .scenes.wall import rebound


@lru_cache(maxsize=8)
def sides(block: Block, geometry: str, lever: str = "h") -> tuple[Side, Side]:
    """Return the front and the back of a block in "exact", "linear" or "bilinear" geometry.

    About a corner at the horizontal distance b from the centre of mass, with rho² = I_G/m: i = rho² + h² + b², R =
    sqrt(b² + h²), p² = g R/i. Leaning towards a side by phi takes phi from its alpha = atan(b/h). Exact and linear
    geometry have p², and the gains R cos(alpha)/i and R/i. Bilinear geometry has p² sin(alpha)/alpha and the gain R
    cos(alpha)/i (for the lever arm "R": R/i).
    """
    if block.symmetric:
        p2 = block.p**2
        inertia = block.inertia * block.R**2
        if geometry == "exact":
            side = Side(p2, block.alpha, block.h / inertia, inertia)
        elif geometry == "linear":
            side = Side(p2, block.alpha, p2 / STANDARD_GRAVITY, inertia)
        else:
            arm = block.h if lever == "h" else block.R
            side = Side(p2 * math.sin(block.alpha) / block.alpha, block.alpha, arm / inertia, inertia)
        return side, side
    front, back = (_side(block, half, alpha, geometry, lever) for half, alpha in block.corners)
    return front, back


def _side(block: Block, half: float, alpha: float, geometry: str, lever: str) -> Side:
    inertia = block.gyration**2 + block.h**2 + half**2
    radius = math.hypot(half, block.h)
    p2 = STANDARD_GRAVITY * radius / inertia
    level = radius * math.cos(alpha) / inertia
    if geometry == "exact":
        return Side(p2, alpha, level, inertia)
    if geometry == "linear":
        return Side(p2, alpha, radius / inertia, inertia)
    return Side(p2 * math.sin(alpha) / alpha, alpha, level if lever == "h" else radius / inertia, inertia)


def zone_of(block: Block, delta: float, lever: str, rigid_rest: bool) -> Zone:
    """Return the elastic zone of a law with half width delta alpha, in which it is undamped.

    It has the stiffness (1/delta - 1) q² and a potential q² alpha² delta/2 higher than the falling branches at 0, so
    that the energy is the same everywhere.

    If the sides differ, moments per mass at the edges are M = a - k theta with a = i q² alpha and k = i q². Let theta_z
    = delta (alpha_F + alpha_B)/2, and the edges 1/theta = 1/theta_z ± (k_F - k_B)/(2 (a_F + a_B)). The straight line
    between the branches then does the same work as they do (derived); the block leans to its nearer edge. The zone's
    moment of inertia is sqrt(i_F i_B), its lever arm the mean of both.

    A block on a bed has the zone of the bed instead, whatever delta is (see `_bed_zone`).
    """
    front, back = sides(block, "bilinear", lever)
    if block.bed is not None:
        if rigid_rest:
            raise ValueError(f"rest='rigid' is for a rigid floor, {block.label!r} stands on a bed: take rest='soft'")
        return _bed_zone(front, block.bed.settlement / block.b)
    if block.symmetric:
        edge = delta * front.alpha
        stiffness = (1.0 / delta - 1.0) * front.q2
        step = 0.5 * front.q2 * front.alpha * edge
        gain, inertia = front.gain, front.inertia
        return Zone(
            edge, edge, stiffness, 0.0, step, gain, inertia, 0.0, 0.0, 0.0, engine.RULE_CONSTANT, 0.0, rigid_rest
        )
    k_front, k_back = front.inertia * front.q2, back.inertia * back.q2
    a_front, a_back = k_front * front.alpha, k_back * back.alpha
    middle = 2.0 / (delta * (front.alpha + back.alpha))
    skew = 0.5 * (k_front - k_back) / (a_front + a_back)
    at_front, at_back = 1.0 / (middle + skew), 1.0 / (middle - skew)
    m_front, m_back = a_front - k_front * at_front, a_back - k_back * at_back
    if min(at_front, at_back, m_front, m_back) <= 0.0:
        raise ValueError(f"delta {delta:g} leaves no elastic zone for {block.label!r}: take a smaller one")
    stiffness = (m_front + m_back) / (at_front + at_back)
    centre = at_front - m_front / stiffness
    step = a_front * at_front - 0.5 * k_front * at_front**2 - 0.5 * stiffness * (at_front - centre) ** 2
    inertia = math.sqrt(front.inertia * back.inertia)
    gain = 0.5 * (front.gain * front.inertia + back.gain * back.inertia) / inertia
    return Zone(
        at_front, at_back, stiffness / inertia, centre, step / inertia, gain, inertia,
        0.0, 0.0, 0.0, engine.RULE_CONSTANT, 0.0, rigid_rest,
    )  # fmt: skip


def _bed_zone(side: Side, uplift: float) -> Zone:
    """Return the elastic zone of a bed, up to the rotation at uplift, with the straight pieces of its moment beyond.

    The bed's moment takes the place of the rigid floor's m g b; gravity takes m g b theta/alpha from it,
    as in the bilinear geometry.
    """
    of_bed = polygon(uplift / side.alpha)
    nodes = [ratio * side.alpha for ratio in of_bed.rotations]
    nodes[0] = uplift
    moments = [side.q2 * side.alpha * ratio for ratio in of_bed.moments]
    stiffness = moments[0] / uplift - side.q2
    potential = 0.5 * stiffness * uplift**2
    chords = []
    for k, (lower, moment) in enumerate(zip(nodes, moments, strict=True)):
        slope = 0.0 if k == len(nodes) - 1 else (moments[k + 1] - moment) / (nodes[k + 1] - lower)
        total = slope - side.q2
        if abs(total) < SMALLEST * side.q2:
            total = -SMALLEST * side.q2
        offset = total * lower - (moment - side.q2 * lower)
        level = potential - (0.5 * total * lower - offset) * lower
        chords.append(Chord(lower, total, offset, 0.0, level))
        if k < len(nodes) - 1:
            upper = nodes[k + 1]
            potential = (0.5 * total * upper - offset) * upper + level
    return Zone(
        uplift, uplift, stiffness, 0.0, 0.0, side.gain, side.inertia,
        0.0, 0.0, 0.0, engine.RULE_CONSTANT, 0.0, False, tuple(chords),
    )  # fmt: skip


def with_bed_damping(zone: Zone, damping: float) -> Zone:
    """Return the zone of a bed with damping in its material: `damping` in full contact, less if it is narrower.

    Dashpots parallel to the springs of the bed, under a contact of the length 2 b sqrt(theta_u/theta), take
    (theta_u/theta)^(3/2) of their damping under the whole width (derived). A chord has its mean, and the last one the
    mean up to the rotation at which the block falls by itself.
    """
    last = zone.chords[-1]
    ends = [*(chord.lower for chord in zone.chords[1:]), last.offset / last.stiffness]
    chords = []
    for chord, end in zip(zone.chords, ends, strict=True):
        area = 2.0 * zone.front**1.5 * (chord.lower**-0.5 - end**-0.5)
        chords.append(chord._replace(damping=damping * area / (end - chord.lower)))
    return zone._replace(damping=damping, chords=tuple(chords))


def surroundings(block: Block, front: Side, back: Side, exact: bool) -> Surroundings:
    """Return walls and restraint of a block as the two sides meet them."""
    front_wall = back_wall = None
    wall = block.wall
    if wall is not None:
        level = block.height if wall.height is None else wall.height
        (front_half, _), (back_half, _) = block.corners

        def contact(gap: float, half: float) -> Contact | None:
            rotation = wall.contact(gap, block.height, exact)
            if rotation >= engine.FLAT:
                return None  # (out of reach)
            factor = wall.restitution
            if factor is None:
                factor = rebound(block.gyration, half, block.h, level)
            return Contact(rotation, factor)

        back_wall = contact(wall.gap, back_half)
        if wall.front_gap is not None:
            front_wall = contact(wall.front_gap, front_half)
    restraint = block.restraint
    if restraint is None:
        return Surroundings(front_wall, back_wall)
    assert block.mass is not None  # (checked by the block)
    return Surroundings(
        front_wall,
        back_wall,
        _spring(restraint, restraint.front, block.mass * front.inertia),
        _spring(restraint, restraint.back, block.mass * back.inertia),
    )


def _spring(restraint: Restraint, arm: float | None, inertia: float) -> Spring | None:
    """Return a restraint with a moment arm (m) per unit of a moment of inertia (kg m²)."""
    if arm is None:
        return None
    taut = restraint.slack / arm
    breaks = math.inf
    if restraint.strength < math.inf:
        breaks = taut + (restraint.strength - restraint.preload) / (restraint.stiffness * arm)
    return Spring(
        restraint.count * restraint.stiffness * arm**2 / inertia,
        taut,
        breaks,
        restraint.count * restraint.preload * arm / inertia,
        restraint.count * restraint.strength * arm / inertia,
    )


def check_zone(block: Block, zone: Zone, around: Surroundings, law: str) -> None:
    """Raise ValueError for surroundings that a law with an elastic zone cannot have."""
    touching = around.back_wall is not None and around.back_wall.rotation == 0.0
    if block.bed is not None:
        met = [contact.rotation for contact in (around.front_wall, around.back_wall) if contact is not None]
        if met and min(met) <= zone.front:
            raise ValueError(
                f"the wall of {block.label!r} is met at {min(met):.3g} rad, before the block uplifts from its bed at "
                f"{zone.front:.3g} rad: give a wider gap or a smaller settlement"
            )
        return
    if touching and zone.rigid_rest:
        return  # (one-sided rocking: the zone is never crossed)
    instead = 'take the law "housner" (HousnerImpact) with geometry = "bilinear"'
    for contact, edge in ((around.front_wall, zone.front), (around.back_wall, zone.back)):
        if contact is not None and 0.0 < contact.rotation <= edge:
            assert block.wall is not None
            gap = block.wall.gap if contact is around.back_wall else block.wall.front_gap or 0.0
            # (both rounded to the safe side)
            wide = math.ceil(1e3 * gap * edge / contact.rotation + 0.5)
            small = f" below {0.99 * contact.rotation / block.alpha:.3g}" if block.symmetric else ""
            raise ValueError(
                f"the wall of {block.label!r} is met at {contact.rotation:.3g} rad, inside the elastic zone of "
                f"{edge:.3g} rad that {law} has: {instead}, a delta{small or ' that is smaller'}, or a gap of {wide} mm"
            )
    if touching and (zone.rule == engine.RULE_ENERGY or not block.symmetric):
        raise ValueError(
            f"{law} with rest='elastic' has no half zone for {block.label!r}, which touches its wall: take rest='rigid'"
        )
    for spring, edge in ((around.front_spring, zone.front), (around.back_spring, zone.back)):
        if spring is not None and (spring.taut < edge or spring.stiffness == math.inf):
            raise ValueError(
                f"the restraint of {block.label!r} acts from {spring.taut:.3g} rad on, inside the elastic zone of "
                f"{edge:.3g} rad that {law} has: {instead}"
            )
