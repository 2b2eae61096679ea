"""Pieces, and damping laws, whose fragility curves cross: which is higher between which levels, in sentences."""

import math
from collections.abc import Iterator, Sequence
from itertools import combinations
from typing import NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ...core.aliases import Array, Flags
from ..report.results_file import without_motions
from ..tables.fragility import curves_at
from ..text.words import axis_of, block_title, floor_name, reference_law
from .checks import fewest_motions
from .law_choice import names_of

APART = 0.02
"""Minimum difference of two probabilities for one curve to count as higher (assumed)."""
POINTS = 12
"""Levels at which the curves of a cloud, which has no levels of its own, are compared."""

Spans = list[tuple[float, float]]
"""Levels between which a condition is true (SI), ends included."""

MIN_CURVES, MOST_COMPARED = 2, 12
"""Fewest curves that can cross, and the number of pieces, of those that fall first, whose curves are compared."""
FEWEST_APART = 6
"""Minimum number of motions that must distinguish two pieces, all the same way, to be no chance.

Under one of two equal pieces each of them falls as often as the other. Of six such motions all are of one piece in 2 ·
2⁻⁶ = 3 % of cases. Of five it is 6 %, which is more than 5 % (sign test).
"""


class Crossing(NamedTuple):
    """The levels between which a curve is higher than another and lower than another, each with its difference."""

    higher: Spans
    lower: Spans
    most_higher: float
    most_lower: float
    names: tuple[str, ...] = ()
    by_chance: float = math.nan


def levels_of(results: xr.Dataset) -> Array:
    """Return the levels (SI) for comparing curves: the levels of the runs, or `POINTS` within the range of a cloud."""
    axis = axis_of(results)
    values = np.unique(axis.values[np.isfinite(axis.values)])
    return values if "level" in results.coords else np.geomspace(values[0], values[-1], POINTS)


def crossing(curve: Array, other: Array, levels: Array) -> Crossing | None:
    """Return the levels at which a curve (level,) is higher and lower than another by `APART`; None unless both."""
    with np.errstate(invalid="ignore"):
        higher, lower = curve - other > APART, other - curve > APART
    if not higher.any() or not lower.any():
        return None
    most = float(np.nanmax(curve - other)), float(np.nanmax(other - curve))
    return Crossing(_spans(higher, levels), _spans(lower, levels), *most)


def _spans(condition: Flags, levels: Array) -> Spans:
    """Return the first and the last level of each run of levels at which a condition is true."""
    at = np.flatnonzero(condition)
    parts = np.split(at, np.flatnonzero(np.diff(at) > 1) + 1)
    return [(float(levels[part[0]]), float(levels[part[-1]])) for part in parts]


def crossings_of(probability: Array, levels: Array, places: Sequence[int]) -> Iterator[tuple[int, int, Crossing]]:
    """Yield the pairs of curves (curve, level) that cross, those with the first curve first, then by difference."""
    pairs = []
    for i, j in combinations(range(len(places)), 2):
        curve, other = probability[places[i]], probability[places[j]]
        where = crossing(curve, other, levels)
        if where is not None:
            pairs.append((i > 0, -min(where.most_higher, where.most_lower), (places[i], places[j], where)))
    yield from (pair for *_, pair in sorted(pairs, key=lambda pair: pair[:2]))


def crossings_between(
    results: xr.Dataset, small: xr.Dataset, cases: xr.DataArray, order: NDArray[np.int64]
) -> list[Crossing]:
    """Return the pairs of pieces whose curves cross, those with the first piece first; `order`: the pieces' ranking."""
    first = order[:MOST_COMPARED].tolist()
    if len(first) < MIN_CURVES:
        return []
    levels = levels_of(results)
    probability = curves_at(without_motions(small), levels).transpose(*cases.dims, "level").values
    names = {place: case_name(case_at(small, cases, place)) for place in first}
    chance = _by_chance(results)
    return [
        where._replace(names=(names[first_piece], names[other]), by_chance=chance)
        for first_piece, other, where in crossings_of(probability.reshape(cases.size, -1), levels, first)
    ]


def crossings_of_laws(case: xr.Dataset, results: xr.Dataset) -> list[Crossing]:
    """Return the laws under which a piece falls more often at some levels and less often at others, the most first."""
    at, _ = reference_law(results)
    law = results.coords.get("law")
    if law is None or law.dims != ("model",):
        return []
    levels = levels_of(results)
    probability = curves_at(without_motions(case), levels).transpose("model", "level").values
    pairs = []
    for i in range(probability.shape[0]):
        where = crossing(probability[at], probability[i], levels)
        if where is not None:
            pairs.append(where._replace(names=(names_of([str(law.values[i])]),), by_chance=_by_chance(results)))
    return sorted(pairs, key=lambda where: -min(where.most_higher, where.most_lower))


def _by_chance(results: xr.Dataset) -> float:
    """Return the minimum difference of two shares that exceeds chance with few motions."""
    return FEWEST_APART / fewest_motions(results)


def case_at(small: xr.Dataset, cases: xr.DataArray, place: int) -> xr.Dataset:
    """Return one block, on one floor, by its place among all."""
    where = np.unravel_index(place, cases.shape)
    return small.isel({str(dim): int(i) for dim, i in zip(cases.dims, where, strict=True)})


def case_name(case: xr.Dataset) -> str:
    """Return the name of a block, with its floor if there are several."""
    floor = f" on {floor_name(case['floor'].item())}" if "floor" in case.coords else ""
    return f"“{block_title(str(case['block'].item()))}”{floor}"
