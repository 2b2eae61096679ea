"""Facts of sensitivity studies: changes of levels with a parameter, and differences of laws."""

import math
from collections.abc import Iterator

import xarray as xr

from ...core.facts import Fact
from ..tables.sensitivity import (
    GREEK,
    MOST_SAID,
    SQUAT,
    law_name,
    law_of_answer,
    laws_apart,
    marks_of,
    own_restitution,
    swings_of,
)
from ..text.words import axis_of, block_title, display_unit, quantity_name

NOTABLE_SWING = 1.15
"""Ratio of levels from which a parameter or a law matters."""


def answer(results: xr.Dataset) -> Iterator[Fact]:
    """Yield the change with the parameter of the level that overturns half of the motions, and differences of laws."""
    at = law_of_answer(results)
    scale, unit = display_unit(axis_of(results))
    symbol, measure = GREEK[str(results.attrs["parameter"])], quantity_name(axis_of(results))
    blocks = [str(block) for block in results["block"].values]
    own_e, marks = own_restitution(results), marks_of(results)
    for block, low, high, first, last in swings_of(results, at)[:MOST_SAID]:
        i = blocks.index(block)
        possible = results["value"].values[marks[i] == ""]
        more = {
            "symbol": symbol,
            "at": (low, high),
            "over": (float(possible.min()), float(possible.max())),
            "measure": measure,
            "law": law_name(results, at),
            "own": None if own_e is None else float(own_e[i]),
            "all": possible.size == marks.shape[1],
        }
        ratio = max(first, last) / min(first, last)
        names = (f"“{block_title(block)}”",)
        yield Fact("sensitivity.swing", ratio, first / scale, last / scale, unit, names, more=more)
    squat = tuple(f"“{block_title(name)}”" for name, mark in zip(blocks, marks, strict=True) if (mark == SQUAT).all())
    if squat:
        yield Fact("sensitivity.squat", names=squat)
    laws = laws_apart(results)
    if laws:
        (near, least), (far, most) = laws[0], laws[-1]
        more = {"usual": str(results.attrs["usual"]), "several": len(laws) > 1}
        yield Fact("sensitivity.laws", lower=least, upper=most, names=(near, far), more=more)


def actions(results: xr.Dataset) -> Iterator[Fact]:
    """Yield the conclusions of a sensitivity study for studies of real pieces."""
    at = law_of_answer(results)
    swings = [max(first, last) / min(first, last) for _, _, _, first, last in swings_of(results, at)]
    if swings:
        word = "matters" if max(swings) > NOTABLE_SWING else "settled"
        names = (law_name(results, at),)
        yield Fact(f"sensitivity.{results.attrs['parameter']}_{word}", max(swings), names=names)
    apart = laws_apart(results)
    if apart:
        far = tuple(label for label, ratio in apart[1:] if abs(math.log(ratio)) > math.log(NOTABLE_SWING))
        yield Fact("sensitivity.law", apart[0][1], names=(apart[0][0], *far))
