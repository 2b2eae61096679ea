"""Assembly of oscillators: falling branches, an elastic zone or impacts, walls, and a restraint with its rupture.

A block is described by sheets: a restoring law over an interval of the rotation, with an event at each end. Walls cut
the outermost sheets short. A restraint divides sheets into pieces (slack, taut), adds its stiffness to them, and ends
the last one by its rupture. The table then contains all sheets a second time, without the restraint.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

from .engine import tables as engine
from .oscillator import Edge, Oscillator, Region, Rest

FRONT, BACK = 1.0, -1.0
INTACT, BROKEN = range(2)
SMALLEST = 1e-12
"""Minimum |stiffness| of a piece, over the falling branch's: the engine divides by it."""


class Side(NamedTuple):
    """One side of a block, seen from itself: y'' = q2 (y - alpha) + gain F for a rotation y >= 0 to that side.

    q2 in 1/s² (p² in exact geometry), alpha in rad, gain in 1/m, inertia: the moment of inertia about its corner over
    the mass, m².
    """

    q2: float
    alpha: float
    gain: float
    inertia: float


class Contact(NamedTuple):
    """Wall on one side: the rotation at which the block meets it, rad, and velocity after over velocity before."""

    rotation: float
    factor: float


class Spring(NamedTuple):
    """Restraint on one side, per unit inertia: stiffness, rotations at which it is taut and breaks, moment at rest.

    `strength`: the moment at which a rigid one breaks, rad/s².
    """

    stiffness: float
    taut: float
    breaks: float
    preload: float
    strength: float


class Chord(NamedTuple):
    """Straight piece of the moment beyond an elastic zone, up to the next one.

    Seen from its side, y'' = -stiffness y + offset - damping y' + gain F, y >= 0; the last piece continues to the
    ground. `potential`: as in a `Region`.
    """

    lower: float
    stiffness: float
    offset: float
    damping: float
    potential: float


class Zone(NamedTuple):
    """Elastic zone of a law, from -back to front: x'' = -stiffness (x - centre) - damping x' + gain F.

    `step`: its potential at the centre. `gain`, `inertia`: as in a side. `front_damping`, `back_damping`: of the
    falling branches. `rule`, `coefficient`: rule of the engine for the damping at each entry. `rigid_rest`: the falling
    branches continue to 0, at which the block rests; else it rests in the zone. `chords`: pieces that follow it on
    either side instead of a falling branch.
    """

    front: float
    back: float
    stiffness: float
    centre: float
    step: float
    gain: float
    inertia: float
    damping: float
    front_damping: float
    back_damping: float
    rule: int
    coefficient: float
    rigid_rest: bool
    chords: tuple[Chord, ...] = ()


class Surroundings(NamedTuple):
    """Walls and restraint of each side, if any."""

    front_wall: Contact | None = None
    back_wall: Contact | None = None
    front_spring: Spring | None = None
    back_spring: Spring | None = None

    @property
    def restrained(self) -> bool:
        """True if a restraint acts on any side."""
        return self.front_spring is not None or self.back_spring is not None


class _End(NamedTuple):
    """Event at an end of a sheet: as `Edge`, with sheets and states of rest by name."""

    action: int
    sheet: str = ""
    slow: str = ""
    factor: float = 1.0
    rest: str = ""


class _Sheet(NamedTuple):
    """Restoring law over an interval, in the rotation y seen from its side (a zone: from the front).

    A piece is a part of the sheet `name` in a state (`mode`) of the restraint.
    """

    side: float
    lower: float
    upper: float
    stiffness: float
    offset: float
    damping: float
    potential: float
    inner: _End
    outer: _End
    held: bool = False
    captured: bool = False
    name: str = ""
    mode: int = INTACT


FALLS = _End(engine.OVERTURN)


def assemble(
    front: Side,
    back: Side,
    e: float,
    zone: Zone | None = None,
    around: Surroundings | None = None,
    *,
    exact: bool = False,
) -> Oscillator:
    """Return the oscillator of a block with its walls and restraint.

    `e`: the restitution. If the inertia of the sides differs, the factors from one to the other are e sqrt(i/i'), so
    that the energy takes the factor e² either way. Without `zone` the falling branches meet in impacts at 0; in exact
    geometry q2 is p², and there is no restraint.
    """
    around = Surroundings() if around is None else around
    touching = around.back_wall is not None and around.back_wall.rotation == 0.0
    if zone is not None and zone.rigid_rest and touching:
        zone = None  # (one-sided rocking: the zone is never crossed)
    sheets = _sheets(front, back, e, zone, around, touching)
    pieces = _pieces(sheets, around)
    oscillator = _Table(front, back, zone, around, sheets, pieces, exact).oscillator(e)
    return oscillator._replace(touching=_to_back(front, back, e)) if touching and zone is None else oscillator


def _sheets(
    front: Side, back: Side, e: float, zone: Zone | None, around: Surroundings, touching: bool
) -> dict[str, _Sheet]:
    """Return the sheets of a block without restraint, from the back to the front."""
    to_back, to_front = _to_back(front, back, e), _to_back(back, front, e)
    sheets: dict[str, _Sheet] = {}

    def branch(name: str, side: Side, sign: float, lower: float, wall: Contact | None, inner: _End) -> None:
        outer, upper = FALLS, engine.FLAT
        if zone is not None and zone.chords:
            sheets.update(_chain(name, zone.chords, sign, wall, inner))
            return
        if wall is not None:
            outer = _End(engine.BOUNCE, factor=wall.factor, rest=name)
            upper = wall.rotation
        damping = 0.0 if zone is None else zone.front_damping if sign > 0.0 else zone.back_damping
        sheets[name] = _Sheet(sign, lower, upper, -side.q2, -side.q2 * side.alpha, damping, 0.0, inner, outer)

    if zone is None:
        if touching:
            assert around.back_wall is not None
            inner = _End(engine.BOUNCE, factor=to_back * around.back_wall.factor * to_front, rest="middle")
        else:
            branch(
                "back", back, BACK, 0.0, around.back_wall, _End(engine.IMPACT, "front", factor=to_front, rest="middle")
            )
            inner = _End(engine.IMPACT, "back", factor=to_back, rest="middle")
        branch("front", front, FRONT, 0.0, around.front_wall, inner)
        return sheets
    held = zone.rule in (engine.RULE_ENTRY_SPEED, engine.RULE_ENERGY)
    least = 0.0 if touching else -zone.back
    # (kinetic energy is kept where the moment of inertia changes)
    into_front = _factor(zone.inertia, front.inertia)
    into_back = _factor(zone.inertia, back.inertia)
    inner_end = _End(engine.CROSS, "back", factor=into_back)
    if touching:
        assert around.back_wall is not None
        inner_end = _End(engine.BOUNCE, factor=around.back_wall.factor, rest="middle")
    else:
        rigid = "rigid back" if zone.rigid_rest else ""
        entry = _End(engine.ENTER, "zone", rigid, 1.0 / into_back)
        branch("back", back, BACK, zone.back, around.back_wall, entry)
    sheets["zone"] = _Sheet(
        FRONT, least, zone.front, zone.stiffness, zone.stiffness * zone.centre, zone.damping,
        zone.step + 0.5 * zone.stiffness * zone.centre**2,
        inner_end, _End(engine.CROSS, "front", factor=into_front), held, zone.rigid_rest,
    )  # fmt: skip
    rigid = "rigid front" if zone.rigid_rest else ""
    entry = _End(engine.ENTER, "zone", rigid, 1.0 / into_front)
    branch("front", front, FRONT, zone.front, around.front_wall, entry)
    if zone.rigid_rest:
        for name, side, sign, edge, factor in (
            ("back", back, BACK, zone.back, to_front),
            ("front", front, FRONT, zone.front, to_back),
        ):
            opposite = "front" if name == "back" else "back"
            impact = _End(engine.IMPACT, f"rigid {opposite}", factor=factor, rest="middle")
            sheets[f"rigid {name}"] = _Sheet(
                sign, 0.0, edge, -side.q2, -side.q2 * side.alpha, 0.0, 0.0, impact, _End(engine.CROSS, name)
            )
    return sheets


def _to_back(front: Side, back: Side, e: float) -> float:
    """Return velocity after over velocity before an impact of the base from the front to the back."""
    return e if back.inertia == front.inertia else e * math.sqrt(front.inertia / back.inertia)


def _chain(name: str, chords: tuple[Chord, ...], sign: float, wall: Contact | None, inner: _End) -> dict[str, _Sheet]:
    """Return chords as sheets from the zone outwards, the first one by the name of the branch; a wall ends them."""
    end = engine.FLAT if wall is None else wall.rotation
    reached = [chord for chord in chords if chord.lower < end]
    names = [name, *(f"{name} {k}" for k in range(2, len(reached) + 1))]
    outer = FALLS if wall is None else _End(engine.BOUNCE, factor=wall.factor, rest=names[-1])
    sheets: dict[str, _Sheet] = {}
    for k, chord in enumerate(reached):
        last = k == len(reached) - 1
        sheets[names[k]] = _Sheet(
            sign, chord.lower, end if last else reached[k + 1].lower, chord.stiffness, chord.offset, chord.damping,
            chord.potential, _End(engine.CROSS, names[k - 1]) if k else inner,
            outer if last else _End(engine.CROSS, names[k + 1]),
        )  # fmt: skip
    return sheets


def _factor(before: float, after: float) -> float:
    """Return velocity after over velocity before a change of the moment of inertia that keeps the kinetic energy."""
    return 1.0 if before == after else math.sqrt(before / after)


def _pieces(sheets: dict[str, _Sheet], around: Surroundings) -> list[_Sheet]:
    """Return the sheets with the restraint, in pieces, and then without it."""
    whole = [sheet._replace(name=name) for name, sheet in sheets.items()]
    pieces: list[_Sheet] = []
    springs = (around.front_spring, around.back_spring)
    rigid = any(spring is not None and spring.stiffness == math.inf for spring in springs)
    if not rigid:  # (a rigid one: at rest until it breaks)
        for sheet in whole:
            pieces += _restrained(sheet, springs[0] if sheet.side == FRONT else springs[1])
    if rigid or any(piece.outer.action == engine.BREAK for piece in pieces):
        pieces += [sheet._replace(mode=BROKEN) for sheet in whole]
    return pieces


def _restrained(sheet: _Sheet, spring: Spring | None) -> list[_Sheet]:
    """Return a sheet in pieces: slack, taut up to the rupture; the sheet itself without a restraint."""
    if spring is None or sheet.upper <= spring.taut:  # (a zone ends before the restraint is taut)
        return [sheet]
    slack = sheet._replace(offset=sheet.offset - spring.preload)
    breaks = _End(engine.BREAK, sheet.name)
    end, outer = (spring.breaks, breaks) if spring.breaks < sheet.upper else (sheet.upper, sheet.outer)
    if end <= max(spring.taut, sheet.lower):  # it breaks as soon as it is taut
        return [slack._replace(upper=end, outer=outer)]
    stiffness = sheet.stiffness + spring.stiffness
    if abs(stiffness) < SMALLEST * abs(sheet.stiffness):
        stiffness = -SMALLEST * abs(sheet.stiffness)
    through = _End(engine.CROSS, sheet.name)
    starts = max(spring.taut, sheet.lower)
    taut = slack._replace(
        lower=starts,
        upper=end,
        stiffness=stiffness,
        offset=slack.offset + spring.stiffness * spring.taut,
        potential=slack.potential + 0.5 * spring.stiffness * spring.taut**2,
        inner=sheet.inner if starts == sheet.lower else through,
        outer=outer,
    )
    return [taut] if starts == sheet.lower else [slack._replace(upper=starts, outer=through), taut]


@dataclass(eq=False)
class _Table:
    """Sheets and pieces on their way to regions: their sides, and the first and the last piece of each sheet."""

    front: Side
    back: Side
    zone: Zone | None
    around: Surroundings
    sheets: dict[str, _Sheet]
    pieces: list[_Sheet]
    exact: bool

    def __post_init__(self) -> None:
        self.sides = {name: self.front if sheet.side == FRONT else self.back for name, sheet in self.sheets.items()}
        if self.zone is not None:
            self.sides["zone"] = self.front._replace(gain=self.zone.gain, inertia=self.zone.inertia)
        self.first: dict[tuple[int, str], int] = {}
        self.last: dict[tuple[int, str], int] = {}
        for index, piece in enumerate(self.pieces):
            self.first.setdefault((piece.mode, piece.name), index)
            self.last[piece.mode, piece.name] = index
        modes = (INTACT, BROKEN) if self.pieces[-1].mode == BROKEN else (INTACT,)
        self.elastic = self.zone is not None and not self.zone.rigid_rest and "back" in self.sheets
        names = [] if self.elastic else [("middle", mode) for mode in modes]
        for name, sheet in self.sheets.items():
            if sheet.outer.action == engine.BOUNCE:
                names += [(name, mode) for mode in modes if self._reaches(name, mode)]
        self.rests = {key: k for k, key in enumerate(names)}

    def oscillator(self, e: float) -> Oscillator:
        """Return the regions with their links, and the states of rest."""
        zone = self.zone
        rests = tuple(self._middle(mode) if name == "middle" else self._held(name, mode) for name, mode in self.rests)
        regions = tuple(self._region(index, piece) for index, piece in enumerate(self.pieces))
        start = self.first[INTACT, "zone"] if self.elastic else engine.REST
        rule = engine.RULE_CONSTANT if zone is None else zone.rule
        coefficient = 0.0 if zone is None else zone.coefficient
        sided = any(self.around) or self.front != self.sides.get("back", self.front)
        return Oscillator(regions, self.front.gain, rule, e, coefficient, start, rests, self.exact, sided)

    def _reaches(self, sheet: str, mode: int) -> bool:
        """Return True if the outer end of a sheet can be reached in a state of the restraint."""
        last = self.last.get((mode, sheet))
        return last is not None and self.pieces[last].upper == self.sheets[sheet].upper

    def _edge(self, index: int, end: _End, *, outward: bool) -> Edge:
        """Return the event at the outer or the inner end of a piece."""
        if end.action == engine.OVERTURN:
            return Edge(engine.OVERTURN)
        piece = self.pieces[index]
        rest = self.rests[end.rest, piece.mode] if end.rest else engine.NO_REGION
        if end.action == engine.BOUNCE:
            return Edge(engine.BOUNCE, index, factor=end.factor, rest=rest)
        if end.sheet == piece.name and end.action == engine.CROSS:
            return Edge(engine.CROSS, index + 1 if outward else index - 1)
        mode = BROKEN if end.action == engine.BREAK else piece.mode
        # seen from its side, the motion enters a sheet at its lower end if it goes outward there
        entered = self.first if outward == (piece.side == self.sheets[end.sheet].side) else self.last
        slow = self.last[mode, end.slow] if end.slow else engine.NO_REGION
        return Edge(end.action, entered[mode, end.sheet], slow, end.factor, rest)

    def _region(self, index: int, piece: _Sheet) -> Region:
        inner = self._edge(index, piece.inner, outward=False)
        outer = self._edge(index, piece.outer, outward=True)
        turns = (engine.NO_REGION, engine.NO_REGION)
        if piece.captured:
            turns = self.first[piece.mode, "rigid back"], self.first[piece.mode, "rigid front"]
        side = self.sides[piece.name]
        gain = side.gain / self.front.gain
        if self.exact:
            first = self.sides[self.pieces[0].name]  # (the engine takes the lever 1/cos(alpha) of region 0)
            gain *= math.cos(first.alpha) / math.cos(side.alpha)
        front = piece.side == FRONT
        return Region(
            piece.lower if front else -piece.upper,
            piece.upper if front else -piece.lower,
            piece.stiffness,
            piece.offset if front else -piece.offset,
            piece.damping,
            piece.potential,
            inner if front else outer,
            outer if front else inner,
            piece.held,
            *turns,
            gain,
            side.inertia / self.front.inertia,
            piece.mode == BROKEN,
        )

    def _held(self, sheet: str, mode: int) -> Rest:
        """Return the state of rest against a wall, in a state of the restraint."""
        side = self.sides[sheet]
        at = self.sheets[sheet].upper
        index = self.last[mode, sheet]
        piece = self.pieces[index]
        # the forcing (of gain 1) towards this side below which it comes off the wall
        held = (piece.stiffness * at - piece.offset) / (side.gain / self.front.gain)
        if self.exact:
            held = side.q2 * math.cos(side.alpha) * math.tan(side.alpha - at) / (side.gain / self.front.gain)
        if self.sheets[sheet].side == FRONT:
            return Rest(at, math.inf, index, -held, index)
        return Rest(-at, -held, index, math.inf, index)

    def _middle(self, mode: int) -> Rest:
        """Return the state of rest at 0; a rigid restraint has no other motion than to leave it, and breaks then."""
        up, front = self._threshold("front", mode)
        down, back = self._threshold("back", mode)
        rigid = mode == INTACT and self.pieces[0].mode == BROKEN
        return Rest(0.0, up, front if front >= 0 else back, down, back if back >= 0 else front, rigid)

    def _threshold(self, name: str, mode: int) -> tuple[float, int]:
        """Return the forcing (of gain 1) that lifts a block at rest to a side, and the region that it enters."""
        sheet = name
        if self.zone is not None:
            sheet = f"rigid {name}" if self.zone.rigid_rest else "zone"
        if sheet not in self.sheets or (name == "back" and sheet == "zone"):
            return math.inf, engine.NO_REGION
        side = self.sides[sheet]
        spring = self.around.front_spring if name == "front" else self.around.back_spring
        added = 0.0
        if spring is not None and mode == INTACT:
            added = spring.strength if spring.stiffness == math.inf else spring.preload
        index = self.first.get((mode, sheet), -1)
        if index < 0:  # rigid: it leaves for the block without it
            index = self.first[BROKEN, sheet]
        threshold = 0.0 if sheet == "zone" else side.q2 * (math.sin(side.alpha) if self.exact else side.alpha)
        return (threshold + added) / (side.gain / self.front.gain), index
