"""Notes on walls and restraints: omissions of their model, if they may matter for the given blocks."""

import math
from collections.abc import Iterable

from ...core.facts import Fact
from ...models import Block
from ...models.sides import sides, surroundings

DRIFT = 0.005
"""Storey drift over height that is used if none is known: a frame in a strong earthquake (assumed)."""
SHARE_OF_GAP = 1.0 / 3.0
STIFF = 12.0
"""Natural frequency (Hz) of a taut restraint beyond which ordinary records have little to resolve it."""


def scene_facts(blocks: Iterable[Block]) -> list[Fact]:
    """Return the notes on blocks with walls, restraints, beds, offsets, a lean or a round base.

    There is one fact for each effect, with its blocks. Round bases wobble, feet slip when a wall is struck, and walls
    move with the drift of the storey. A wall counts if `DRIFT` times the height of the contact exceeds a third of the
    gap. Further effects are rails too low for a rebound, restraints without a wall, and stiff restraints. Others are
    beds, and the check of sliding, which is of free blocks.
    """
    every = list(blocks)
    held = [block for block in every if block.restraint is not None]
    concerned = (
        ("block.round", math.nan, [block for block in every if block.round]),
        ("wall.base_no_slip", math.nan, [block for block in every if block.wall is not None and block.wall.gap > 0.0]),
        ("wall.pushes", DRIFT, [block for block in every if pushed_by_drift(block)]),
        ("wall.low_contact", math.nan, [block for block in every if _low(block)]),
        ("restraint.no_wall", math.nan, [block for block in held if block.wall is None]),
        ("restraint.stiff", STIFF, [block for block in held if _frequency(block) > STIFF]),
        ("restraint.elastic", math.nan, held),
        ("support.bed", math.nan, [block for block in every if block.bed is not None]),
        (
            "sliding.checked_freestanding",
            math.nan,
            [block for block in every if block.wall is not None or block.restraint is not None or not block.symmetric],
        ),
    )
    return [Fact(what, value, names=tuple(block.label for block in named)) for what, value, named in concerned if named]


def pushed_by_drift(block: Block) -> bool:
    """Return True if a wall that moves with `DRIFT` moves by more than a third of the gap at its contact."""
    wall = block.wall
    if wall is None:
        return False
    level = block.height if wall.height is None else wall.height
    return DRIFT * level > SHARE_OF_GAP * wall.gap


def _low(block: Block) -> bool:
    if block.wall is None or block.wall.restitution is not None:
        return False
    wall = surroundings(block, *sides(block, "linear"), exact=False).back_wall
    return wall is not None and wall.factor == 0.0


def _frequency(block: Block) -> float:
    """Return the natural frequency of the block on its taut restraint, Hz; 0 for a rigid one."""
    around = surroundings(block, *sides(block, "linear"), exact=False)
    springs = [spring for spring in (around.front_spring, around.back_spring) if spring is not None]
    stiffest = max(spring.stiffness for spring in springs)
    return 0.0 if stiffest == math.inf else math.sqrt(stiffest) / (2.0 * math.pi)
