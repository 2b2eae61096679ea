"""Explanations of misses, each tested by switching on what it names, one at a time, with nothing else changed.

They were chosen after the misses were known, so that what fits better here is a hint and no confirmation.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ...core.aliases import Flags
from ...models import Block, HousnerImpact, Restraint
from ...motions import Building
from ...motions.polarity import BOTH
from .ensembles import motions_of, scaled_to_class
from .predictions import LEVELS, capacities
from .replays import CM_HEIGHT, HALF_WIDTHS, Replays, fallen, rock, table_motions
from .specimens import POLE_EDGE, POLE_FORCE, POLE_STIFFNESS, blocks_of, law_of
from .table import BROADBAND, MEDIAN, NEAR_FAULT, OVERTURNED, POLE, Row

LONG_PERIOD = 0.12
"""PGV/PGA from which a motion counts as one of long period, s."""
ROOF = Building.flexural_shear(1.0, alpha0=5.0, storeys=10)
"""A building of ten storeys with a period of 1 s, for motions of its roof."""


MIDDLE_WIDTH = HALF_WIDTHS[len(HALF_WIDTHS) // 2]
MIDDLE = rock(MIDDLE_WIDTH)
HOUSNER = HousnerImpact()
ROCKS = {
    "as predicted blindly, middle half-width": (MIDDLE, HOUSNER),
    **{
        f"restitution: {factor:g} times Housner's": (MIDDLE, HousnerImpact(restitution_factor=factor))
        for factor in (0.9, 0.95, 1.03)
    },
    **{
        f"radius of gyration: square of {square:g} m2": (rock(MIDDLE_WIDTH, square), HOUSNER)
        for square in (0.053, 0.06)
    },
    "mass centre 10 % higher": (rock(MIDDLE_WIDTH, centre=1.1 * CM_HEIGHT), HOUSNER),
    **{f"support: half-width {1000.0 * width:g} mm": (rock(width), HOUSNER) for width in (0.038, 0.033, 0.028)},
}
"""Changes of the rocks, one at a time."""


def rock_scenes(replays: Replays) -> list[tuple[str, int, int]]:
    """Return each change of the rocks with the predicted falls, in all runs and in runs of long period."""
    motions = table_motions(replays.runs)
    slow = np.array([run.ratio >= LONG_PERIOD for run in replays.runs])
    changes = []
    for change, (block, law) in ROCKS.items():
        flags = fallen([block], motions, law)[0]
        changes.append((change, int(flags.sum()), int(flags[slow].sum())))
    return changes


class Scene(NamedTuple):
    """What is changed of a row, the prediction with it, and that before."""

    id: str
    change: str
    predicted: float
    before: float


def scenes(rows: Iterable[Row]) -> list[Scene]:
    """Predict poles and medians again with one change at a time."""
    predictions = []
    for row in rows:
        test = row.test
        if test.predict == OVERTURNED and test.fixing == POLE:
            before = _share(row, lambda block: block)
            predictions += [Scene(test.id, change, _share(row, made), before) for change, made in POLES.items()]
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
            predictions += [Scene(test.id, change, predicted, before) for change, predicted in changed.items()]
    return predictions


def slipping(block: Block) -> Block:
    """Return a block between a pair of poles that slip off."""
    at = block.width - POLE_EDGE
    held = Restraint.pole(POLE_FORCE, 1.5 * POLE_FORCE, POLE_STIFFNESS, at, POLE_EDGE, count=2)
    return replace(block, restraint=held)


POLES: dict[str, Callable[[Block], Block]] = {
    "no wall behind it": lambda block: replace(block, wall=None),
    "poles that slip off at 1.5 times their force": slipping,
    "no poles": lambda block: replace(block, restraint=None),
}
"""Changes of poles."""


def _share(row: Row, change: Callable[[Block], Block]) -> float:
    """Return the share of runs in which the changed blocks of a row fall, by the rules of its prediction."""
    test = row.test
    low, high = (float(level) for level in test.levels if level is not None)
    flags: Flags = fallen(
        [change(block) for block in blocks_of(test)], [scaled_to_class(test.motion, low, high)], law_of(test), BOTH
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
