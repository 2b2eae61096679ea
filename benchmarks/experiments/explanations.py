"""Explanations of misses, each tested by switching on what it names, one at a time, with nothing else changed.

They were chosen after the misses were known, so that what fits better here is a hint and no confirmation.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ...core.aliases import Flags
from ...models import Block, HousnerImpact, Restraint
from ...motions import Building
from ...motions.polarity import AS_RECORDED, BOTH
from .ensembles import motions_of, scaled_to_class
from .predictions import LEVELS, capacities
from .replays import CM_HEIGHT, GYRATION_SQUARED, HALF_WIDTHS, HEIGHT, Replays, fallen, rock, table_motions
from .specimens import POLE_EDGE, POLE_FORCE, POLE_STRENGTH, blocks_of, law_of
from .table import BROADBAND, MEDIAN, NEAR_FAULT, OVERTURNED, POLE, Row

STRONG_SIDE = 0.3
"""Half-width of the rocks' support on the strong side, m."""
LONG_PERIOD = 0.12
"""PGV/PGA from which a motion counts as one of long period, s."""
EXACT = HousnerImpact()
ROOF = Building.flexural_shear(1.0, alpha0=5.0, storeys=10)
"""A building of ten storeys with a period of 1 s, for motions of its roof."""


class RockScene(NamedTuple):
    """A change of the rocks; of an asymmetric one, whose weak side may look either way, both ways count by half."""

    change: str
    block: Block
    law: HousnerImpact = EXACT
    both: bool = False
    scale: float = 1.0


def lopsided(weak: float) -> Block:
    """Return the rock about a weak side in front and a strong one behind."""
    half, offset = 0.5 * (weak + STRONG_SIDE), 0.5 * (STRONG_SIDE - weak)
    radius = half**2 + CM_HEIGHT**2
    name = f"granite rock, {1000.0 * weak:g} mm and {1000.0 * STRONG_SIDE:g} mm"
    return Block(2.0 * half, HEIGHT, CM_HEIGHT, (GYRATION_SQUARED + radius) / radius, name, cm_offset=offset)


MIDDLE_WIDTH = HALF_WIDTHS[len(HALF_WIDTHS) // 2]
MIDDLE = rock(MIDDLE_WIDTH)
ROCKS = (
    RockScene("as predicted blindly, middle half-width", MIDDLE),
    RockScene(f"asymmetry: the other side {1000.0 * STRONG_SIDE:g} mm wide", lopsided(MIDDLE_WIDTH), both=True),
    *(
        RockScene(f"restitution: {factor:g} times Housner's", MIDDLE, HousnerImpact(restitution_factor=factor))
        for factor in (0.9, 0.95, 1.03)
    ),
    *(
        RockScene(
            f"azimuth: the weak side {angle} degrees off the table's direction",
            MIDDLE,
            scale=math.cos(math.radians(angle)),
        )
        for angle in (30, 60)
    ),
    *(
        RockScene(f"radius of gyration: square of {square:g} m2", rock(MIDDLE_WIDTH, square))
        for square in (0.053, 0.06)
    ),
    RockScene("mass centre 10 % higher", rock(MIDDLE_WIDTH, centre=1.1 * CM_HEIGHT)),
    *(RockScene(f"support: half-width {1000.0 * width:g} mm", rock(width)) for width in (0.038, 0.033, 0.028)),
    RockScene("support: half-width 33 mm, asymmetric", lopsided(0.033), both=True),
)
"""Changes of the rocks, one at a time."""


def rock_scenes(replays: Replays) -> list[tuple[str, float, float]]:
    """Return each change of the rocks with the falls predicted, in all runs and in those of long period."""
    motions = table_motions(replays.runs)
    slow = np.array([run.ratio >= LONG_PERIOD for run in replays.runs])
    found = []
    for scene in ROCKS:
        shaken = [(scene.scale * motion).assign_attrs(motion.attrs) for motion in motions]
        flags = fallen([scene.block], shaken, scene.law, BOTH if scene.both else AS_RECORDED)[0].astype(float)
        share = flags.reshape(-1, 2).mean(-1) if scene.both else flags
        found.append((scene.change, float(share.sum()), float(share[slow].sum())))
    return found


class Scene(NamedTuple):
    """What is changed of a row, the prediction with it, and that before."""

    id: str
    change: str
    predicted: float
    before: float


def scenes(rows: Iterable[Row]) -> list[Scene]:
    """Predict poles and medians again with one change at a time."""
    found = []
    for row in rows:
        test = row.test
        if test.predict == OVERTURNED and test.fixing == POLE:
            before = _share(row, lambda block: block)
            found += [Scene(test.id, change, _share(row, made), before) for change, made in POLES.items()]
        elif test.predict == MEDIAN:
            blocks, law = blocks_of(test), law_of(test)
            before = _pooled(blocks, law, BROADBAND)
            less, raised = HousnerImpact(restitution_factor=0.9), [_raised(block) for block in blocks]
            changed = {
                "near-fault motions": _pooled(blocks, law, NEAR_FAULT),
                "roof of a building of 1 s": _pooled(blocks, law, BROADBAND, ROOF),
                "restitution: 0.9 times Housner's": _pooled(blocks, less, BROADBAND),
                "mass centre: 10 % higher": _pooled(raised, law, BROADBAND),
            }
            found += [Scene(test.id, change, predicted, before) for change, predicted in changed.items()]
    return found


def pole(block: Block, force: float, strength: float, stiffness: float) -> Block:
    """Return a block between a pair of poles."""
    held = Restraint.pole(force, strength, stiffness, block.width - POLE_EDGE, POLE_EDGE, count=2)
    return replace(block, restraint=held)


POLES: dict[str, Callable[[Block], Block]] = {
    "no wall behind it": lambda block: replace(block, wall=None),
    "a ceiling that gives way: 5 N/mm in place of 50": lambda block: pole(block, POLE_FORCE, POLE_STRENGTH, 5e3),
    "poles that slip off at 1.5 times their force": lambda block: pole(block, POLE_FORCE, 1.5 * POLE_FORCE, 50e3),
    "poles pressed with 50 N that slip off at 75 N": lambda block: pole(block, 50.0, 75.0, 50e3),
    "no poles": lambda block: replace(block, restraint=None),
}
"""Changes of poles."""


def _share(row: Row, change: Callable[[Block], Block]) -> float:
    """Return the share of runs in which the changed blocks of a row fall, by the rules of its prediction."""
    test = row.test
    low, high = (float(one) for one in test.levels if one is not None)
    flags: Flags = fallen(
        [change(one) for one in blocks_of(test)], [scaled_to_class(test.motion, low, high)], law_of(test), BOTH
    )
    return float(flags.mean())


def _pooled(blocks: list[Block], law: HousnerImpact, kind: str, building: Building | None = None) -> float:
    """Return the median capacity over blocks and motions, or their motions of a building's roof, m/s²."""
    motions = motions_of(kind)
    if building is not None:
        motions = building.floor_motions(motions, floors=[building.floors[-1]])
    return float(np.median(np.concatenate(capacities(blocks, law, motions, LEVELS))))


def _raised(block: Block) -> Block:
    """Return a block whose mass centre is 10 % higher, with the same radius of gyration."""
    centre = 1.1 * block.h
    radius = block.b**2 + centre**2
    return Block(block.width, block.height, centre, (block.gyration**2 + radius) / radius, block.name)
