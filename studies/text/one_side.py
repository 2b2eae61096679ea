"""Curves of falls to one side whose form rises to 1, although the block may fall to the other side instead."""

from __future__ import annotations

from collections.abc import Iterable

from ...fragility.fitting.fit import default_form
from ...fragility.fitting.states import DIRECTIONS, FRONT, State, state_name
from ...models import Block
from ...models.sides import sides, surroundings
from ...wording import listed_name

FORCED = "rising_to_1"
"""Attribute of results with the names of the blocks whose curves rise to 1 though the probabilities need not."""
MOST_NAMED = 3


def forced_to_1(blocks: Iterable[Block], state: State, form: str) -> str:
    """Name the blocks whose curves of falls to one side rise to 1 though they may fall to the other side, or return ''.

    Parameters
    ----------
    blocks : iterable of Block
        The blocks of the curves.
    state : str or float
        The damage state of the curves.
    form : str
        The form of the curves.
    """
    if state not in DIRECTIONS or form == default_form(state):
        return ""
    both = [block for block in blocks if _falls_both_ways(block, str(state))]
    more = len(both) - MOST_NAMED
    return ", ".join(listed_name(block.label) for block in both[:MOST_NAMED]) + (
        f" and {more:,} more" if more > 0 else ""
    )


def one_side_notes(blocks: Iterable[Block], state: State, form: str) -> list[str]:
    """Return a note on curves of falls to one side that rise to 1, of blocks that may fall to the other side, too."""
    both = forced_to_1(blocks, state, form)
    if not both:
        return []
    return [
        f"{both}: it may fall to the other side instead, so the probability of {state_name(state)} need "
        'not rise to 1 as the fitted curve does: take fit.form = "isotonic", or state = "overturned"'
    ]


def _falls_both_ways(block: Block, state: str) -> bool:
    front, back = sides(block, "linear")
    around = surroundings(block, front, back, exact=False)
    wall = around.back_wall if state == FRONT else around.front_wall
    return wall is None
