"""Fragility curves that cross: which of two is the higher one, and between which levels of shaking."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import combinations
from typing import NamedTuple

import numpy as np
import xarray as xr

from ...core.aliases import Array, Flags
from ...fragility import curve_probability
from ..text.words import axis_of, display_unit
from .results_file import without_motions

APART = 0.02
"""Difference of two probabilities from which one curve counts as the higher one (judgement: 2 of 100 earthquakes)."""
POINTS = 12
"""Levels at which the curves of a cloud, which has no levels of its own, are compared."""

Place = tuple[int, ...]
"""Place of a curve in an array."""
Spans = list[tuple[float, float]]
"""Levels between which something holds (SI), ends included."""


class Crossing(NamedTuple):
    """The levels between which a curve is higher than another and those between which it is lower, each by how much."""

    higher: Spans
    lower: Spans
    most_higher: float
    most_lower: float


class Pair(NamedTuple):
    """Two curves that cross."""

    one: Place
    other: Place
    where: Crossing


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


def crossings_of(probability: Array, levels: Array, places: Sequence[Place]) -> Iterator[Pair]:
    """Yield the pairs of curves (…, level) that cross, those with the first curve first, then by their difference."""
    found = []
    for i, j in combinations(range(len(places)), 2):
        one, other = probability[places[i]], probability[places[j]]
        where = crossing(one, other, levels)
        if where is not None:
            found.append((i > 0, -min(where.most_higher, where.most_lower), Pair(places[i], places[j], where)))
    yield from (pair for *_, pair in sorted(found, key=lambda each: each[:2]))
