"""Curves of falls to one side, of blocks that may fall to the other side instead."""

from collections.abc import Iterable

import xarray as xr

from ...core.facts import Fact
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
    states = {state_name(direction): direction for direction in DIRECTIONS}
    state = states.get(str(results.attrs.get("state")))
    if state is None:
        return set()
    return {block.label for block in blocks_of(results) if _falls_both_ways(block, state)}


def _listed(blocks: Iterable[Block]) -> str:
    names = [listed_name(block.label) for block in blocks]
    more = len(names) - MOST_NAMED
    return ", ".join(names[:MOST_NAMED]) + (f" and {more:,} more" if more > 0 else "")


def one_side_notes(blocks: Iterable[Block], state: State, form: str) -> list[Fact]:
    """Return the note on falls to one side of blocks that may fall to the other side, too."""
    blocks = list(blocks)
    either = [block.label for block in blocks if state in DIRECTIONS and _falls_both_ways(block, str(state))]
    if not either:
        return []
    what = "curve.forced" if forced_to_1(blocks, state, form) else "curve.one_side"
    return [Fact(what, names=tuple(either), more={"state": state_name(state), "form": form})]


def uplift_notes(blocks: Iterable[Block], models: Iterable[Law], state: State, form: str) -> list[Fact]:
    """Return the note on laws whose blocks are oscillators at rest, if the curves are of uplift."""
    if state != UPLIFTED and form != "uplift-lognormal":
        return []
    blocks = list(blocks)
    elastic = tuple(
        law.label
        for law in models
        if getattr(law, "rest", "elastic") == "elastic" and any(law.zone_edge(block) > 0.0 for block in blocks)
    )
    return [Fact("law.uplifts_early", names=elastic)] if elastic else []


def _falls_both_ways(block: Block, state: str) -> bool:
    front, back = sides(block, "linear")
    around = surroundings(block, front, back, exact=False)
    wall = around.back_wall if state == FRONT else around.front_wall
    return wall is None
