"""Sentences on pieces, and on damping laws, whose fragility curves cross: which is higher between which levels."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ...core.wording import counted
from ...fragility.fitting.states import ALL, OVERTURNED, state_name
from ..text.block_order import places
from ..text.curve_notes import infinitive_of, verb_of
from ..text.reached import within_levels
from ..text.words import axis_of, block_title, floor_name, is_one_piece, quantity_name, reference_law
from .crossings import Pair, crossing, crossings_of, curves_at, levels_of, spans_text
from .law_choice import names_of
from .results_file import without_motions
from .validity import fewest_motions

MIN_CURVES, MOST_COMPARED = 2, 12
"""Fewest curves that can cross, and the number of pieces, of those that fall first, whose curves are compared."""
MOST_CROSSINGS = 3
"""Most pairs of curves of which the levels are given."""
FEWEST_APART = 6
"""Fewest motions that must tell two pieces apart, all the same way, to be no chance.

Under one of two equal pieces each of them falls as often as the other: of six such motions all are of one piece in
2 · 2⁻⁶ = 3 % of cases, of five in 6 %, which is more than 5 % (sign test).
"""


def crossed_pieces(results: xr.Dataset) -> list[str]:
    """Return between which levels which piece falls more often, where their curves cross."""
    results = within_levels(results)
    at, _ = reference_law(results)
    small = without_motions(results).isel(model=at)
    cases = small["half_level"].transpose("block", ...)
    ranked = np.argsort(places(results).values.ravel(), kind="stable")
    status = small["status"].transpose(*cases.dims).values.ravel() if "status" in small else np.full(cases.size, "")
    known = ranked[status[ranked] != ALL]
    state = str(results.attrs.get("state", state_name(OVERTURNED)))
    return [said for _, said in crossed(results, small, cases, known, verb_of(state))]


def crossed(
    results: xr.Dataset, small: xr.Dataset, cases: xr.DataArray, order: NDArray[np.int64], verb: str
) -> Iterator[tuple[bool, str]]:
    """Yield between which levels which of two pieces falls more often, where their curves cross, in sentences.

    With each comes whether it says that the curve of the piece that falls first crosses another.
    """
    places_of = [tuple(int(i) for i in np.unravel_index(one, cases.shape)) for one in order[:MOST_COMPARED].tolist()]
    if len(places_of) < MIN_CURVES:
        return
    levels, axis = levels_of(results), axis_of(results)
    probability = curves_at(small, levels).transpose(*cases.dims, "level").values
    found = list(crossings_of(probability, levels, places_of))
    if not found:
        return
    said = [_pair_text(pair, small, cases, axis, verb) for pair in found[:MOST_CROSSINGS]]
    which = "arrangement" if is_one_piece(small) and "floor" not in small.dims else "piece"
    none_first = found[0].one == places_of[0]
    which = f"Which {which} is the most likely to {infinitive_of(verb)}" if none_first else "The order of the others"
    whose = "the" if none_first else "their"
    motions, chance = fewest_motions(results), _by_chance(results)
    least = [100.0 * min(pair.where.most_higher, pair.where.most_lower) for pair in found[:MOST_CROSSINGS]]
    depends = "may depend" if least[0] < chance else "depends"
    why = f"because {whose} curves cross: {said[0]}"
    yield none_first, f"{which} {depends} on the level of shaking ({quantity_name(axis)}), {why}."
    if min(least) < chance:
        less = f"differences of less than {chance} in 100 earthquakes" if chance < 100 else "all differences"
        yield False, f"With {counted(motions, 'motion')}, {less} may be chance."
    if said[1:]:
        more = len(found) - MOST_CROSSINGS
        pairs = "pairs of curves cross" if more > 1 else "pair of curves crosses"
        yield False, f"Likewise, {'; '.join(said[1:])}{f'; {more:,} more {pairs}' if more > 0 else ''}."


def _by_chance(results: xr.Dataset) -> int:
    """Return the least difference, of 100 earthquakes, that is more than the chance of a few motions."""
    return math.ceil(100.0 * FEWEST_APART / fewest_motions(results))


def _pair_text(pair: Pair, small: xr.Dataset, cases: xr.DataArray, axis: xr.DataArray, verb: str) -> str:
    one, other, where = pair
    return (
        f"{case_name(small, cases, one)} {verb} more often than {case_name(small, cases, other)} "
        f"{spans_text(where.higher, axis)} (by up to {100.0 * where.most_higher:.0f} in 100 earthquakes), and less "
        f"often {spans_text(where.lower, axis)} (by up to {100.0 * where.most_lower:.0f})"
    )


def case_name(small: xr.Dataset, cases: xr.DataArray, at: tuple[int, ...]) -> str:
    """Return the name of one of the cases, with its floor where there are several."""
    labels = dict(zip((str(dim) for dim in cases.dims), at, strict=True))
    where = f" on {floor_name(small['floor'].values[labels['floor']])}" if "floor" in labels else ""
    return f"“{block_title(str(small['block'].values[labels['block']]))}”{where}"


def crossing_laws(every: xr.Dataset, results: xr.Dataset, name: str, verb: str) -> str:
    """Return between which levels a piece falls more often under another law, and less often; '' where none crosses."""
    at, _ = reference_law(results)
    law, axis = results.coords.get("law"), axis_of(results)
    if law is None or law.dims != ("model",):
        return ""
    levels = levels_of(results)
    probability = curves_at(every, levels).transpose("model", "level").values
    found = {i: crossing(probability[at], probability[i], levels) for i in range(probability.shape[0])}
    both = {i: where for i, where in found.items() if where is not None}
    first = sorted(both, key=lambda i: -min(both[i].most_higher, both[i].most_lower))[:MOST_CROSSINGS]
    if not first:
        return ""
    said = [
        f"{names_of([str(law.values[i])])} (more often {spans_text(both[i].lower, axis)}, by up to "
        f"{100.0 * both[i].most_lower:.0f} in 100 earthquakes, and less often {spans_text(both[i].higher, axis)}, by "
        f"up to {100.0 * both[i].most_higher:.0f})"
        for i in first
    ]
    most = 100.0 * min(both[first[0]].most_higher, both[first[0]].most_lower)
    depends = "may depend" if most < _by_chance(results) else "depends"
    return (
        f"How often {name} {verb} under another law, compared with this answer, {depends} on the level of shaking, "
        f"because the curves cross: under {'; '.join(said)}."
    )
