"""Curves of falls to one side, of blocks that may fall to the other side instead."""

from __future__ import annotations

from collections.abc import Iterable

import xarray as xr

from ...core.doubts import first_of
from ...core.wording import listed_name
from ...fragility.fitting.fit import default_form
from ...fragility.fitting.states import DIRECTIONS, FRONT, UPLIFTED, State, state_name
from ...fragility.runs.provenance import blocks_of
from ...models import Block, Law
from ...models.sides import sides, surroundings

FORCED = "rising_to_1"
"""Attribute of results with the names of the blocks whose curves rise to 1 though the probabilities need not."""
MOST_NAMED = 3


def forced_to_1(blocks: Iterable[Block], state: State, form: str) -> str:
    """Name the blocks whose curves of falls to one side rise to 1 though they may fall to the other side, or ''."""
    if state not in DIRECTIONS or form == default_form(state):
        return ""
    return _listed(block for block in blocks if _falls_both_ways(block, str(state)))


def falling_both_ways(results: xr.Dataset) -> set[str]:
    """Return the names of the blocks of results on falls to one side that may fall to the other side instead."""
    states = {state_name(one): one for one in DIRECTIONS}
    state = states.get(str(results.attrs.get("state")))
    if state is None:
        return set()
    return {block.label for block in blocks_of(results) if _falls_both_ways(block, state)}


def _listed(blocks: Iterable[Block]) -> str:
    names = [listed_name(block.label) for block in blocks]
    more = len(names) - MOST_NAMED
    return ", ".join(names[:MOST_NAMED]) + (f" and {more:,} more" if more > 0 else "")


def one_side_notes(blocks: Iterable[Block], state: State, form: str) -> list[str]:
    """Return notes on falls to one side of blocks that may fall to the other side, too."""
    if state not in DIRECTIONS:
        return []
    blocks = list(blocks)
    either = _listed(block for block in blocks if _falls_both_ways(block, str(state)))
    if not either:
        return []
    both = forced_to_1(blocks, state, form)
    if not both:
        return [
            f"{either}: it may fall to the other side instead, and such falls are not counted here; state = "
            '"overturned" counts falls to either side'
        ]
    return [
        f"{both}: it may fall to the other side instead, so the probability of {state_name(state)} need "
        'not rise to 1 as the fitted curve does: take fit.form = "isotonic", or state = "overturned"'
    ]


def uplift_notes(blocks: Iterable[Block], models: Iterable[Law], state: State, form: str) -> list[str]:
    """Return a note on laws whose blocks are oscillators at rest, where the curves are of uplift."""
    if state != UPLIFTED and form != "uplift-lognormal":
        return []
    blocks = list(blocks)
    elastic = [
        law.label
        for law in models
        if getattr(law, "rest", "elastic") == "elastic" and any(law.zone_edge(block) > 0.0 for block in blocks)
    ]
    if not elastic:
        return []
    return [
        f"{first_of(elastic)}: at rest the block vibrates in its elastic zone, so that it uplifts in weaker shaking "
        "than a rigid block on a rigid floor (whose uplift takes g tan alpha): for uplift take a law without "
        'that, such as housner, or rest = "rigid"'
    ]


def _falls_both_ways(block: Block, state: str) -> bool:
    front, back = sides(block, "linear")
    around = surroundings(block, front, back, exact=False)
    wall = around.back_wall if state == FRONT else around.front_wall
    return wall is None
