"""Oscillators: a block under a damping law as a short table of regions, in plain numbers per unit inertia.

For the engine an oscillator consists of regions of the rotation (stiffness, damping, offset), the event at each edge
and the states of rest. Events are crossing, entry into a zone whose damping is then held, impact, rebound, rupture and
overturning. `assembly` puts such tables together.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..core.aliases import Array, Index
from .engine import tables as engine

MOST = 1.0 + 1e-15
"""Maximum product of the factors of two impacts: e = 1 with different sides is rounded."""


class Edge(NamedTuple):
    """Event at the edge of a region: the action, the region beyond, and `slow`, which an entry rule may prefer.

    `factor` multiplies the velocity (with a change of sign at a wall); bounces at the edge die into state `rest`.
    """

    action: int
    target: int = engine.NO_REGION
    slow: int = engine.NO_REGION
    factor: float = 1.0
    rest: int = engine.NO_REGION


class Region(NamedTuple):
    """Region of an oscillator: x'' = -stiffness x - damping x' + offset + gain forcing for lower <= x <= upper.

    `gain` and `inertia` (the moment of inertia) are relative to the oscillator's. All values are in SI units, per unit
    inertia. `potential` is added to stiffness x²/2 - offset x so that the potential of the oscillator is continuous. If
    `held` is True, the damping is set at each entry and kept. `turn_left` and `turn_right` name the regions in which
    the motion continues with the same energy when the velocity vanishes inside this region. `broken`: a region without
    the restraint that others have. In exact geometry stiffness is -p² and offset is -+p² alpha, and the engine solves
    the sin/cos form instead.
    """

    lower: float
    upper: float
    stiffness: float
    offset: float
    damping: float
    potential: float
    lower_edge: Edge
    upper_edge: Edge
    held: bool = False
    turn_left: int = engine.NO_REGION
    turn_right: int = engine.NO_REGION
    gain: float = 1.0
    inertia: float = 1.0
    broken: bool = False

    @property
    def captures(self) -> bool:
        """True if the motion continues in another region when the velocity vanishes inside this one."""
        return self.turn_left != engine.NO_REGION or self.turn_right != engine.NO_REGION


class Rest(NamedTuple):
    """State of rest at `theta`: left to region `up_target` if the forcing exceeds `up`, or down if it is below.

    The thresholds are values of the forcing of gain 1, rad/s²; `down` is for the forcing with the opposite sign. A
    block that is held against a wall has a negative one, and one that cannot go to a side an infinite one. `breaks`:
    leaving it breaks the restraint.
    """

    theta: float
    up: float
    up_target: int
    down: float
    down_target: int
    breaks: bool = False


class Oscillator(NamedTuple):
    """Oscillator in numbers: regions, forcing gain (rad/s² per m/s²), entry rule, start and states of rest.

    `sided`: its two sides differ, and the peaks of each are kept.  `touching`: speed with which it strikes a wall that
    it touches over that before the impact of the base.  `limit`: rotation that counts as overturning, rad.
    """

    regions: tuple[Region, ...]
    gain: float
    rule: int
    e: float
    coefficient: float
    start: int
    rests: tuple[Rest, ...] = ()
    exact: bool = False
    sided: bool = False
    touching: float = 1.0
    limit: float = math.inf

    @property
    def balance(self) -> float:
        """Rotation at which an unshaken block starts: 0, or the static lean of an elastic zone, rad."""
        return self.regions[self.start].offset / self.regions[self.start].stiffness if self.start >= 0 else 0.0

    def pieces(self, seconds: float) -> float:
        """Return the number of pieces in which a run of `seconds` is solved: two for each time constant.

        These are pieces of the elastic zone in which the block rests; 0 for a rigid block, whose pieces are samples.
        """
        if self.start < 0:
            return 0.0
        zone = self.regions[self.start]
        half = 0.5 * zone.damping
        return 2.0 * seconds * (half + math.sqrt(half * half + abs(zone.stiffness)))

    def region_at(self, theta: float, omega: float) -> int:
        """Return the region in which a run from (theta, omega) begins."""
        if theta == self.balance and omega == 0.0:
            return self.start
        candidates = list(range(len(self.regions)))
        if self.start < 0:
            # a rigid block enters a zone only by an inward crossing
            candidates = [i for i in candidates if not self.regions[i].captures]
        else:
            candidates.insert(0, self.start)
        for index in candidates:
            region = self.regions[index]
            leaves = (theta == region.lower and omega < 0.0) or (theta == region.upper and omega > 0.0)
            if region.lower <= theta <= region.upper and not leaves:
                return index
        raise ValueError(f"no region of the oscillator holds a rotation of {theta!r} rad")


class Stack(NamedTuple):
    """Several oscillators as the arrays that the engine reads, and the limits of rotation (o,), which it does not."""

    tables: Array
    links: Index
    rests: Array
    parameters: Array
    limits: Array


def stack(oscillators: Sequence[Oscillator]) -> Stack:
    """Return tables (o, r, 13), links (o, r, 14), rests (o, s, 6), parameters (o, 8) of one size, and limits."""
    rows = max(len(oscillator.regions) for oscillator in oscillators)
    most = max(1, *(len(oscillator.rests) for oscillator in oscillators))
    tables = np.zeros((len(oscillators), rows, engine.REGION_COLUMNS))
    links = np.full((len(oscillators), rows, engine.LINK_COLUMNS), engine.NO_REGION, dtype=np.int64)
    rests = np.zeros((len(oscillators), most, engine.REST_COLUMNS))
    parameters = np.zeros((len(oscillators), engine.PAR_COLUMNS))
    for o, oscillator in enumerate(oscillators):
        _check_table(oscillator)
        count = len(oscillator.regions)
        tables[o, :count] = [_numbers(oscillator, region) for region in oscillator.regions]
        links[o, :count] = [_links(oscillator, r) for r in range(count)]
        if oscillator.rests:
            rests[o, : len(oscillator.rests)] = oscillator.rests
        parameters[o] = (
            oscillator.gain,
            oscillator.e,
            oscillator.coefficient,
            oscillator.rule,
            oscillator.start,
            exact_lever(oscillator),
            oscillator.sided,
            oscillator.touching,
        )
    return Stack(tables, links, rests, parameters, np.array([oscillator.limit for oscillator in oscillators]))


def _numbers(oscillator: Oscillator, region: Region) -> tuple[float, ...]:
    """Return the row of the region table."""
    lower, upper = region.lower_edge, region.upper_edge
    of_edges = (lower.factor, upper.factor, _loss(oscillator, lower), _loss(oscillator, upper))
    return (*region[:6], region.offset / region.stiffness, region.gain, region.inertia, *of_edges)


def _links(oscillator: Oscillator, index: int) -> tuple[int, ...]:
    """Return the row of the link table."""
    region = oscillator.regions[index]
    lower, upper = region.lower_edge, region.upper_edge
    of_edges = (*lower[:3], lower.rest, *upper[:3], upper.rest)
    turns = (region.turn_left, region.turn_right)
    return (*of_edges, region.held, *turns, _falls(oscillator, index), _hops_to(oscillator, index), region.broken)


def _facing(oscillator: Oscillator, edge: Edge) -> Edge:
    """Return the edge at 0 of the region beyond an impact, from which the block comes back."""
    beyond = oscillator.regions[edge.target]
    return beyond.lower_edge if beyond.lower == 0.0 else beyond.upper_edge


def _loss(oscillator: Oscillator, edge: Edge) -> float:
    """Return 1 - e of the bounces that follow an edge (see the engine's `comes_to_rest`); 0 if there are none."""
    if edge.action == engine.BOUNCE:
        return 1.0 - edge.factor
    if edge.action != engine.IMPACT:
        return 0.0
    following = _facing(oscillator, edge).factor
    if following == edge.factor:
        return 1.0 - edge.factor
    return max(0.0, 1.0 - edge.factor * following) / (1.0 + following)


def _falls(oscillator: Oscillator, index: int) -> bool:
    """Return True if the law of a falling region is valid from it to the ground on that side."""
    region = oscillator.regions[index]
    if region.stiffness >= 0.0:
        return False
    while True:
        outward = region.upper_edge if region.offset < 0.0 else region.lower_edge
        if outward.action != engine.CROSS:
            return outward.action == engine.OVERTURN
        beyond = oscillator.regions[outward.target]
        if (beyond.stiffness, beyond.offset, beyond.damping) != (region.stiffness, region.offset, region.damping):
            return False
        region = beyond


def _hops_to(oscillator: Oscillator, index: int) -> int:
    """Return the region across an impact at 0 between two undamped regions that pull back to it, else NO_REGION."""
    region = oscillator.regions[index]
    edge = region.upper_edge if region.upper == 0.0 else region.lower_edge
    if edge.action != engine.IMPACT:
        return engine.NO_REGION
    beyond = oscillator.regions[edge.target]
    back = _facing(oscillator, edge)
    undamped = all(side.damping == 0.0 and not side.held for side in (region, beyond))
    inward = all(side.offset * (side.lower + side.upper) < 0.0 for side in (region, beyond))
    if undamped and inward and back.action == engine.IMPACT and back.target == index and edge.rest == back.rest:
        return edge.target
    return engine.NO_REGION


def exact_lever(oscillator: Oscillator) -> float:
    """Return 1/cos(alpha) for exact geometry, where `gain` is the gain at rest; 0 for any other oscillator."""
    if not oscillator.exact:
        return 0.0
    return 1.0 / math.cos(oscillator.regions[0].offset / oscillator.regions[0].stiffness)


def _check_table(oscillator: Oscillator) -> None:
    """Raise ValueError for an oscillator that the engine cannot solve."""
    for index, region in enumerate(oscillator.regions):
        if region.stiffness == 0.0 or not region.lower < region.upper:
            raise ValueError(f"region {index} must have a stiffness other than 0 and lower < upper, got {region}")
        for edge, at in ((region.lower_edge, region.lower), (region.upper_edge, region.upper)):
            if edge.action == engine.IMPACT and (at != 0.0 or oscillator.start >= 0):
                raise ValueError(f"impacts must be at rotation 0 of an oscillator that rests there, got one at {at:g}")
            if edge.action == engine.IMPACT and not 0.0 < edge.factor * _facing(oscillator, edge).factor <= MOST:
                raise ValueError(f"the factors of two impacts must have a product above 0 and at most 1, got {edge}")
            if edge.action == engine.BOUNCE and not (0.0 <= edge.factor <= 1.0 and edge.target == index):
                raise ValueError(f"a bounce must lead back into its region with a factor from 0 to 1, got {edge}")
            if edge.action in (engine.IMPACT, engine.BOUNCE) and not 0 <= edge.rest < len(oscillator.rests):
                raise ValueError(f"an impact must name one of {len(oscillator.rests)} states of rest, got {edge}")
