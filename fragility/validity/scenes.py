"""Notes on walls and restraints: what their model leaves out, where it may matter for the blocks at hand."""

from __future__ import annotations

import math
from collections.abc import Iterable

from ...models import Block
from ...models.sides import sides, surroundings
from ...wording import listed_name

DRIFT = 0.005
"""Storey drift over height that is taken where none is known: strong shaking of a frame (judgement)."""
SHARE_OF_GAP = 1.0 / 3.0
STIFF = 12.0
"""Natural frequency (Hz) of a taut restraint beyond which ordinary records hold little to resolve it."""
MOST_NAMED = 3


def scene_notes(blocks: Iterable[Block]) -> list[str]:
    """Return what a user should know of blocks with walls, restraints, a mass off the middle or a lean.

    One sentence for each effect, with the blocks that it concerns: feet that slip when a wall is struck, walls that
    move with the drift of the storey (where `DRIFT` times the height of the contact exceeds a third of the gap), rails
    too low for a rebound, restraints without a wall, stiff ones, and the check of sliding, which is of free blocks.
    """
    every = list(blocks)
    walled = [block for block in every if block.wall is not None]
    held = [block for block in every if block.restraint is not None]
    found: list[str] = []

    def say(named: list[Block], sentence: str) -> None:
        if named:
            found.append(f"{_listed(named)}: {sentence}")

    say(
        [block for block in walled if block.wall is not None and block.wall.gap > 0.0],
        "the foot is taken to stay where it is when a wall is struck; a real one slips there, which takes up energy",
    )
    say(
        [block for block in walled if _drifts(block)],
        f"the wall is taken to move with the floor; at a storey drift of {100.0 * DRIFT:g} % of the height it moves by "
        "more than a third of the gap, and then pushes the block: falls to the front may be more frequent",
    )
    say(
        [block for block in walled if _low(block)],
        "the contact with the wall lies so low that the block would pivot on it: the impact is taken to stop the block",
    )
    say(
        [block for block in held if block.wall is None],
        "the restraint is fixed to something that the block never touches: give wall_gap_mm if there is a wall",
    )
    say(
        [block for block in held if block.restraint is not None and _frequency(block) > STIFF],
        f"the taut restraint has a natural frequency above {STIFF:g} Hz: whether it breaks depends on its stiffness "
        "and slack more than on its strength, and on shaking that records hold little of",
    )
    say(
        held,
        "the restraint is elastic up to its strength, the least of device, wall and furniture fixing, and then gone; "
        "what it is fixed to is taken as rigid",
    )
    say(
        [block for block in every if block.wall is not None or block.restraint is not None or not block.symmetric],
        "the check of sliding is that of a symmetric, freestanding block",
    )
    return found


def _drifts(block: Block) -> bool:
    wall = block.wall
    if wall is None:
        return False
    level = block.height if wall.height is None else wall.height
    return DRIFT * level > SHARE_OF_GAP * wall.gap


def _low(block: Block) -> bool:
    return block.wall is not None and block.wall.restitution is None and _rebound(block) == 0.0


def _rebound(block: Block) -> float:
    around = surroundings(block, *sides(block, "linear"), exact=False)
    return 1.0 if around.back_wall is None else around.back_wall.factor


def _frequency(block: Block) -> float:
    """Return the natural frequency of the block on its taut restraint, Hz; 0 for a rigid one."""
    around = surroundings(block, *sides(block, "linear"), exact=False)
    springs = [one for one in (around.front_spring, around.back_spring) if one is not None]
    stiffest = max(one.stiffness for one in springs)
    return 0.0 if stiffest == math.inf else math.sqrt(stiffest) / (2.0 * math.pi)


def _listed(blocks: list[Block]) -> str:
    names = [listed_name(block.label) for block in blocks[:MOST_NAMED]]
    more = len(blocks) - len(names)
    return ", ".join(names) + (f" and {more:,} more" if more else "")
