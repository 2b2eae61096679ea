"""The figure of a page's first screen: a bar for each piece, with its interval, in groups by recommendation."""

import math
from typing import NamedTuple

import numpy as np
import xarray as xr

from ..buildings.pieces import pieces_of
from ..buildings.recommendations import YEARS, Piece
from ..tables.blocks import block_chance
from ..tables.pieces import over_branches
from ..tables.table import chance_in, range_of
from ..text.block_order import HALF, RATE, shown
from ..text.words import axis_of, block_title, by_place, display_unit, floor_name, quantity_name, reference_law
from .answer_building import TO_ANCHOR, recommended_lines

MOST = 14
"""Maximum number of bars; the tables contain all pieces."""


class Bar(NamedTuple):
    """Bar of a line or block: its name, a text next to the name, a value and its interval."""

    name: str
    detail: str
    value: float
    lower: float
    upper: float


class Bars(NamedTuple):
    """Bars in groups by name, on a common scale from 0 to `top`; `of`: their quantity.

    `years`: of probabilities, 0 for levels, whose measure and unit are given. `left_out`: the number of other pieces.
    """

    of: str
    groups: dict[str, list[Bar]]
    top: float
    years: float = 0.0
    measure: str = ""
    unit: str = ""
    left_out: int = 0
    highest: float = math.nan


def bars_of(results: xr.Dataset) -> Bars | None:
    """Return the bars of a study's results; None if no value is known."""
    if "place" in results.dims:
        return _of_pieces(results)
    if "half_level" not in results or "sensitivity" in str(results.attrs["kind"]):
        return None
    return _of_blocks(results)


def _of_pieces(results: xr.Dataset) -> Bars | None:
    """Return the chance of falling of a piece of each line."""
    at, _ = reference_law(results)
    yearly, spread = "rate" in results, over_branches(results)
    lines = {piece.item for piece in recommended_lines(results)}
    every = sorted(
        (piece for piece in pieces_of(results, at) if not piece.held and not math.isnan(piece.chance.value)),
        key=lambda piece: -piece.chance.value,
    )
    if not every:
        return None
    # (lines to anchor are all shown)
    first = [piece for piece in every if piece.item in lines]
    others = [piece for piece in every if piece.item not in lines]
    kept = others[: max(0, MOST - len(first))]

    def bar(piece: Piece) -> Bar:
        ends = spread.get(piece.item) or piece.chance
        values = chance_in(ends, YEARS) if yearly else ends
        return Bar(block_title(piece.item), floor_name(piece.floor), *values)

    dear = [piece for piece in kept if piece.recommendation in TO_ANCHOR and not piece.kit]  # (beyond the budget)
    rest = [piece for piece in kept if piece not in dear]
    groups = {
        "anchor": [bar(piece) for piece in first],
        "dear": [bar(piece) for piece in dear],
        "state": [bar(piece) for piece in rest if not piece.stated],
        "kit": [bar(piece) for piece in rest if piece.stated and piece.kit],
        "other": [bar(piece) for piece in rest if piece.stated and not piece.kit],
    }
    hidden = [bar(piece).value for piece in others[len(kept) :]]
    shown_groups = {name: bars for name, bars in groups.items() if bars}
    highest = max(hidden, default=math.nan)
    return Bars(
        "chance", shown_groups, _top(shown_groups), YEARS if yearly else 0.0, left_out=len(hidden), highest=highest
    )


def _of_blocks(results: xr.Dataset) -> Bars | None:
    """Return the chance of each block in the study's years, or the level at which half of the motions overturn it."""
    at, _ = reference_law(results)
    yearly = "risk_probability" in results and bool(np.isfinite(results["risk_probability"].isel(model=at)).any())
    name = "risk_probability" if yearly else HALF
    of_law = (shown(results, RATE, MOST) if yearly else shown(results, most=MOST)).isel(model=at)
    scale, unit = display_unit(axis_of(results))
    bars = []
    for label, place in by_place(of_law, of_law[name].dims):
        case = of_law.isel(place)
        values = block_chance(case, case, float(results.attrs["years"])) if yearly else range_of(case, HALF, scale)
        if math.isfinite(values.value):
            block, _, rest = label.rpartition(", ") if "floor" in of_law[name].dims else (label, "", "")
            bars.append(Bar(block, rest, *values))
    if not bars:
        return None
    bars.sort(key=lambda bar: -bar.value if yearly else bar.value)
    groups = {"all": bars[:MOST]}
    every = results[name].isel(model=at).values
    hidden = np.sort(every[np.isfinite(every)])[::-1][len(groups["all"]) :]
    years = float(results.attrs["years"]) if yearly else 0.0
    measure, highest = ("", max(hidden, default=math.nan)) if yearly else (quantity_name(axis_of(results)), math.nan)
    of = "chance" if yearly else "level"
    return Bars(of, groups, _top(groups), years, measure, unit, len(hidden), highest)


def _top(groups: dict[str, list[Bar]]) -> float:
    """Return the end of the scale: the next of 1, 2, 5 times a power of ten above all bars and finite intervals."""
    ends = [end for bars in groups.values() for bar in bars for end in (bar.value, bar.upper) if math.isfinite(end)]
    most = max(ends, default=1.0)
    if not most > 0.0:
        return 1.0
    power = 10.0 ** math.floor(math.log10(most))
    return next(step * power for step in (1.0, 2.0, 5.0, 10.0) if step * power >= most)
