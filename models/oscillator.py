"""Oscillators: a block under a damping law as a short table of regions, in plain numbers per unit inertia.

For the engine an oscillator consists of regions of the rotation (stiffness, damping, offset), the event at each edge
(crossing, entry into a zone whose damping is then held, impact, overturning) and the state of rest.  Three tables are
built here; blocks beside a wall, brittle restraints and eccentric centres of mass are other tables for the same engine.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..aliases import Array, Index
from .engine import tables as engine


class Edge(NamedTuple):
    """Event at the edge of a region: the action, the region beyond, and the region that an entry rule may prefer."""

    action: int
    target: int = engine.NO_REGION
    other: int = engine.NO_REGION


OVERTURN = Edge(engine.OVERTURN)


class Region(NamedTuple):
    """Region of an oscillator: x'' = -stiffness x - damping x' + offset + forcing for lower <= x <= upper.

    All values are in SI units per unit inertia.  `potential` is added to stiffness x²/2 - offset x so that the
    potential of the oscillator is continuous.  If `held` is True, the damping is set at each entry and kept.
    `turn_left` and `turn_right` name the regions in which the motion goes on with the same energy when the velocity
    vanishes inside this region.  In exact geometry stiffness is -p² and offset is -+p² alpha, and the engine solves
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

    @property
    def captures(self) -> bool:
        """True if the motion goes on in another region when the velocity vanishes inside this one."""
        return self.turn_left != engine.NO_REGION or self.turn_right != engine.NO_REGION


class Oscillator(NamedTuple):
    """Oscillator in numbers: regions, forcing gain (rad/s² per m/s²), entry rule, thresholds and state of rest."""

    regions: tuple[Region, ...]
    gain: float
    rule: int
    e: float
    coefficient: float
    start: int
    uplift_right: float
    uplift_left: float
    rest_right: int = engine.NO_REGION
    rest_left: int = engine.NO_REGION
    exact: bool = False

    def region_at(self, theta: float, omega: float) -> int:
        """Return the region in which a run from (theta, omega) begins."""
        if theta == 0.0 and omega == 0.0:
            return self.start
        candidates = list(range(len(self.regions)))
        if self.start == engine.REST:
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
    """Several oscillators as the arrays that the engine reads."""

    tables: Array
    links: Index
    parameters: Array


def stack(oscillators: Sequence[Oscillator]) -> Stack:
    """Return region tables (o, r, 7), links (o, r, 9) and parameters (o, 10) of oscillators, padded to one size."""
    rows = max(len(oscillator.regions) for oscillator in oscillators)
    tables = np.zeros((len(oscillators), rows, engine.REGION_COLUMNS))
    links = np.full((len(oscillators), rows, engine.LINK_COLUMNS), engine.NO_REGION, dtype=np.int64)
    parameters = np.zeros((len(oscillators), engine.PAR_COLUMNS))
    for o, oscillator in enumerate(oscillators):
        _check_table(oscillator)
        for r, region in enumerate(oscillator.regions):
            tables[o, r] = (*region[: engine.REGION_CENTRE], region.offset / region.stiffness)
            links[o, r] = (*region.lower_edge, *region.upper_edge, region.held, region.turn_left, region.turn_right)
        parameters[o] = (
            oscillator.gain,
            oscillator.e,
            oscillator.coefficient,
            oscillator.rule,
            oscillator.start,
            oscillator.uplift_right,
            oscillator.uplift_left,
            oscillator.rest_right,
            oscillator.rest_left,
            exact_lever(oscillator),
        )
    return Stack(tables, links, parameters)


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
            if edge.action == engine.IMPACT and (at != 0.0 or oscillator.start != engine.REST):
                raise ValueError(f"impacts must be at rotation 0 of an oscillator that rests there, got one at {at:g}")
        if region.held and region.lower != -region.upper:
            raise ValueError(f"a zone with held damping must be centred on 0, got {region.lower:g} … {region.upper:g}")


def bilinear(
    q2: float,
    alpha: float,
    delta: float,
    gain: float,
    *,
    damping: float = 0.0,
    rule: int = engine.RULE_CONSTANT,
    e: float = 1.0,
    rigid_rest: bool = False,
) -> Oscillator:
    """Return the oscillator with falling branches beyond |theta| = delta alpha and an elastic zone between them.

    The falling branches have the stiffness -q², the zone (1/delta - 1) q².  With `rigid_rest` the falling branches go
    on to theta = 0, where the block rests until |forcing| > q² alpha, and the block enters the zone only if an impact
    with e would carry it through (the energy is the same everywhere: the zone's potential lies q² alpha² delta/2
    higher).
    """
    edge = delta * alpha
    held = rule in (engine.RULE_ENTRY_SPEED, engine.RULE_ENERGY)
    step = 0.5 * q2 * alpha * edge
    left, zone, right, rigid_left, rigid_right = range(5)
    branch_left, branch_right = (rigid_left, rigid_right) if rigid_rest else (engine.NO_REGION, engine.NO_REGION)
    regions = [
        Region(-engine.FLAT, -edge, -q2, q2 * alpha, damping, 0.0, OVERTURN, Edge(engine.ENTER, zone, branch_left)),
        Region(
            -edge,
            edge,
            (1.0 / delta - 1.0) * q2,
            0.0,
            damping,
            step,
            Edge(engine.CROSS, left),
            Edge(engine.CROSS, right),
            held,
            branch_left,
            branch_right,
        ),
        Region(edge, engine.FLAT, -q2, -q2 * alpha, damping, 0.0, Edge(engine.ENTER, zone, branch_right), OVERTURN),
    ]
    if rigid_rest:
        regions += [
            Region(-edge, 0.0, -q2, q2 * alpha, 0.0, 0.0, Edge(engine.CROSS, left), Edge(engine.IMPACT, rigid_right)),
            Region(0.0, edge, -q2, -q2 * alpha, 0.0, 0.0, Edge(engine.IMPACT, rigid_left), Edge(engine.CROSS, right)),
        ]
    coefficient = 0.0
    if rule == engine.RULE_ENTRY_SPEED:
        coefficient = (1.0 - e) / (2.0 * edge)
    elif rule == engine.RULE_ENERGY:
        coefficient = q2 * edge * (alpha - 0.5 * edge)
    start = engine.REST if rigid_rest else zone
    return Oscillator(
        tuple(regions), gain, rule, e, coefficient, start, q2 * alpha, q2 * alpha, branch_right, branch_left
    )


def impact(q2: float, alpha: float, gain: float, e: float, *, exact: bool = False) -> Oscillator:
    """Return Housner's block: two falling branches that meet in an impact at theta = 0, where the block rests.

    With `exact` the geometry is the sin/cos form with q2 = p² and the threshold p² sin alpha; otherwise the threshold
    is q² alpha.
    """
    left, right = range(2)
    regions = (
        Region(-engine.FLAT, 0.0, -q2, q2 * alpha, 0.0, 0.0, OVERTURN, Edge(engine.IMPACT, right)),
        Region(0.0, engine.FLAT, -q2, -q2 * alpha, 0.0, 0.0, Edge(engine.IMPACT, left), OVERTURN),
    )
    threshold = q2 * (math.sin(alpha) if exact else alpha)
    return Oscillator(
        regions, gain, engine.RULE_CONSTANT, e, 0.0, engine.REST, threshold, threshold, right, left, exact
    )
