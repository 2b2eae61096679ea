"""Pieces, and damping laws, whose fragility curves cross: which is higher between which levels, in sentences."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import combinations
from typing import NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ...core.aliases import Array, Flags
from ...core.wording import counted
from ...fragility import curve_probability
from ...fragility.fitting.states import ALL
from ..text.block_order import places
from ..text.curve_notes import infinitive_of, verb_in
from ..text.reached import within_levels
from ..text.words import axis_of, block_title, display_unit, floor_name, is_one_piece, quantity_name, reference_law
from .law_choice import names_of
from .results_file import without_motions
from .validity import fewest_motions

APART = 0.02
"""Difference of two probabilities from which one curve counts as the higher one (judgement: 2 of 100 earthquakes)."""
POINTS = 12
"""Levels at which the curves of a cloud, which has no levels of its own, are compared."""

Place = tuple[int, ...]
"""Place of a curve in an array."""
Spans = list[tuple[float, float]]
"""Levels between which something holds (SI), ends included."""

MIN_CURVES, MOST_COMPARED = 2, 12
"""Fewest curves that can cross, and the number of pieces, of those that fall first, whose curves are compared."""
MOST_CROSSINGS = 3
"""Most pairs of curves of which the levels are given."""
FEWEST_APART = 6
"""Fewest motions that must tell two pieces apart, all the same way, to be no chance.

Under one of two equal pieces each of them falls as often as the other: of six such motions all are of one piece in
2 · 2⁻⁶ = 3 % of cases, of five in 6 %, which is more than 5 % (sign test).
"""


class Crossing(NamedTuple):
    """The levels between which a curve is higher than another and those between which it is lower, each by how much."""

    higher: Spans
    lower: Spans
    most_higher: float
    most_lower: float


def levels_of(results: xr.Dataset) -> Array:
    """Return the levels at which curves are compared (SI): those that were run, or some within those of a cloud."""
    axis = axis_of(results)
    values = np.unique(axis.values[np.isfinite(axis.values)])
    return values if "level" in results.coords else np.geomspace(values[0], values[-1], POINTS)


def curves_at(results: xr.Dataset, levels: Array) -> xr.DataArray:
    """Return the probabilities of the fitted curves at levels that were run; NaN where there is no curve."""
    small = without_motions(results)
    small = small.assign_attrs(form=small.attrs.get("form", "lognormal"))
    if "curve_probability" in small:
        small = small.drop_vars(["probability", "lower", "upper"], errors="ignore")
        small = small.rename(curve_probability="probability")
    return curve_probability(small, levels, outside="most")


def crossing(one: Array, other: Array, levels: Array) -> Crossing | None:
    """Return where a curve (level,) is higher and where it is lower than another by `APART`; None unless both."""
    with np.errstate(invalid="ignore"):
        higher, lower = one - other > APART, other - one > APART
    if not higher.any() or not lower.any():
        return None
    most = float(np.nanmax(one - other)), float(np.nanmax(other - one))
    return Crossing(_spans(higher, levels), _spans(lower, levels), *most)


def _spans(here: Flags, levels: Array) -> Spans:
    """Return the first and the last level of each run of levels at which something holds."""
    at = np.flatnonzero(here)
    parts = np.split(at, np.flatnonzero(np.diff(at) > 1) + 1)
    return [(float(levels[part[0]]), float(levels[part[-1]])) for part in parts]


def spans_text(spans: Spans, axis: xr.DataArray) -> str:
    """Return levels in words, such as from 0.20 to 0.60 m/s and at 1.0 m/s."""
    scale, unit = display_unit(axis)
    unit = f" {unit}" if unit else ""
    write = [(_digits(low / scale), _digits(high / scale)) for low, high in spans]
    return " and ".join(f"at {low}{unit}" if low == high else f"from {low} to {high}{unit}" for low, high in write)


def _digits(value: float) -> str:
    return f"{value:.2g}" if value < 99.5 else f"{value:,.0f}"


def crossings_of(probability: Array, levels: Array, places: Sequence[Place]) -> Iterator[tuple[Place, Place, Crossing]]:
    """Yield the pairs of curves (…, level) that cross, those with the first curve first, then by their difference."""
    found = []
    for i, j in combinations(range(len(places)), 2):
        one, other = probability[places[i]], probability[places[j]]
        where = crossing(one, other, levels)
        if where is not None:
            found.append((i > 0, -min(where.most_higher, where.most_lower), (places[i], places[j], where)))
    yield from (pair for *_, pair in sorted(found, key=lambda each: each[:2]))


def crossed_pieces(results: xr.Dataset) -> list[str]:
    """Return between which levels which piece falls more often, where their curves cross."""
    results = within_levels(results)
    at, _ = reference_law(results)
    small = without_motions(results).isel(model=at)
    cases = small["half_level"].transpose("block", ...)
    ranked = np.argsort(places(results).values.ravel(), kind="stable")
    status = small["status"].transpose(*cases.dims).values.ravel() if "status" in small else np.full(cases.size, "")
    known = ranked[status[ranked] != ALL]
    return [said for _, said in crossed(results, small, cases, known, verb_in(results))]


def crossed(
    results: xr.Dataset, small: xr.Dataset, cases: xr.DataArray, order: NDArray[np.int64], verb: str
) -> Iterator[tuple[bool, str]]:
    """Yield between which levels which piece falls more often, and whether the first one's curve crosses."""
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
    none_first = found[0][0] == places_of[0]
    which = f"Which {which} is the most likely to {infinitive_of(verb)}" if none_first else "The order of the others"
    whose = "the" if none_first else "their"
    motions, chance = fewest_motions(results), _by_chance(results)
    least = [100.0 * min(where.most_higher, where.most_lower) for _, _, where in found[:MOST_CROSSINGS]]
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


def _pair_text(
    pair: tuple[Place, Place, Crossing], small: xr.Dataset, cases: xr.DataArray, axis: xr.DataArray, verb: str
) -> str:
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
