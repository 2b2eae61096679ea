"""Notes on walls and restraints: what their model leaves out, where it may matter for the blocks at hand."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

from ...core.wording import listed_name
from ...models import Block
from ...models.sides import sides, surroundings

DRIFT = 0.005
"""Storey drift over height that is taken where none is known: strong shaking of a frame (judgement)."""
SHARE_OF_GAP = 1.0 / 3.0
STIFF = 12.0
"""Natural frequency (Hz) of a taut restraint beyond which ordinary records hold little to resolve it."""
MOST_NAMED = 3


def scene_notes(blocks: Iterable[Block]) -> list[str]:
    """Return what a user should know of blocks with walls, restraints, beds, offsets, a lean or a round base.

    One sentence for each effect, with the blocks that it concerns: round bases that wobble, feet that slip when a wall
    is struck, walls that move with the drift of the storey (where `DRIFT` times the height of the contact exceeds a
    third of the gap), rails too low for a rebound, restraints without a wall, stiff ones, beds, and the check of
    sliding, which is of free blocks.
    """
    every = list(blocks)
    rounded = [block for block in every if block.round]
    walled = [block for block in every if block.wall is not None]
    held = [block for block in every if block.restraint is not None]
    found: list[str] = []

    def say(named: list[Block], sentence: str) -> None:
        if named:
            found.append(f"{_named([block.label for block in named])}: {sentence}")

    if rounded:
        found.append(round_note([block.label for block in rounded]))
    say(
        [block for block in walled if block.wall is not None and block.wall.gap > 0.0],
        "the base is assumed not to slip when the wall is struck; a real base slips, which dissipates energy",
    )
    say(
        [block for block in walled if pushed_by_drift(block)],
        f"the wall is assumed to move with the floor; at a storey drift of {100.0 * DRIFT:g} % it moves by more than a "
        "third of the gap where it meets the block and may push it, so forward falls may be more frequent",
    )
    say(
        [block for block in walled if _low(block)],
        "the contact with the wall is so low that the block would pivot on it: the impact is assumed to stop the block",
    )
    say(
        [block for block in held if block.wall is None],
        "the restraint is fixed to something that the block never strikes: give wall_gap_mm if there is a wall",
    )
    say(
        [block for block in held if block.restraint is not None and _frequency(block) > STIFF],
        f"the taut restraint has a natural frequency above {STIFF:g} Hz: whether it breaks depends on its stiffness "
        "and slack more than on its strength, and on high frequencies of which records contain little",
    )
    say(
        held,
        "the restraint is assumed elastic up to its strength, that of its weakest part (device, wall fixing or "
        "furniture fixing), and lost beyond it; what it is fixed to is assumed rigid",
    )
    say(
        [block for block in every if block.bed is not None],
        "the bed is elastic and without tension, and delta of the law is not used; what half a cycle dissipates "
        "depends on its amplitude, and e is nominal: take a measured damping",
    )
    say(
        [block for block in every if block.wall is not None or block.restraint is not None or not block.symmetric],
        "sliding is checked as if the block were symmetric and freestanding",
    )
    return found


def pushed_by_drift(block: Block) -> bool:
    """Return whether a wall that moves with `DRIFT` moves by more than a third of the gap where it meets the block."""
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
    springs = [one for one in (around.front_spring, around.back_spring) if one is not None]
    stiffest = max(one.stiffness for one in springs)
    return 0.0 if stiffest == math.inf else math.sqrt(stiffest) / (2.0 * math.pi)


def round_note(labels: Sequence[str]) -> str:
    """Return the sentence on blocks with a round base."""
    return (
        f"{_named(labels)}: possibly unconservative, wobbling not modelled: on a round base every direction is the "
        "weak one, and a piece that rolls along its edge may fall where its planar motion does not"
    )


def _named(labels: Sequence[str]) -> str:
    names = [listed_name(label) for label in labels[:MOST_NAMED]]
    more = len(labels) - len(names)
    return ", ".join(names) + (f" and {more:,} more" if more else "")
