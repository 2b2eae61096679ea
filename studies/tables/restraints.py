"""Walls and restraints: probabilities compared with blocks without them, and frequency of ruptures."""

import math
from collections.abc import Iterator, Mapping, Sequence
from itertools import product
from typing import NamedTuple

import numpy as np
import xarray as xr

from ...core.units import ENDS
from ...fragility.risk.ratios import Ratio
from ..buildings.recommendations import Range
from ..plan.gains import GAIN, MOST, OTHER
from ..plan.ratios import verdict_of
from ..plan.restraints import AT_DESIGN, BROKEN, DESIGN, NEEDED, TARGET, TRIED
from ..text.words import by_place, display_unit, floor_name, quantity_name, reference_law
from .table import Cells, Column, Table, footnote, intervals, range_of


class Gain(NamedTuple):
    """The probability of a block, the probability of another in the same place under the same law, and their ratio."""

    block: str
    other: str
    floor: str
    law: str
    chance: float
    of_other: float
    ratio: Ratio


def gains_of(results: xr.Dataset, laws: list[int]) -> Iterator[Gain]:
    """Yield the comparisons of blocks under some laws, block by block; none if there are none."""
    if GAIN not in results:
        return
    labels = [str(block) for block in results["block"].values]
    small = results[[*(f"{GAIN}{end}" for end in ENDS), OTHER, "risk_probability"]]
    for (_, where), j in product(by_place(results, results[GAIN].dims), laws):
        of_law = small.isel(where).isel(model=j)
        ratio, other = Ratio(*range_of(of_law, GAIN)), str(of_law[OTHER].item())
        if other not in labels or np.isnan(ratio.value):
            continue
        of_other = small["risk_probability"].isel({**where, "block": labels.index(other)}).isel(model=j)
        floor = floor_name(of_law["floor"].item()) if "floor" in where else ""
        chance = float(of_law["risk_probability"])
        yield Gain(
            str(of_law["block"].item()), other, floor, str(of_law["model"].item()), chance, float(of_other), ratio
        )


def gains(results: xr.Dataset) -> Table:
    """Return the table of the effects of walls and restraints, under every law."""
    every = [*gains_of(results, list(range(results.sizes["model"])))]
    rows: list[Cells] = [
        {
            Column("name", "block"): f"{gain.block}, {gain.floor}" if gain.floor else gain.block,
            Column("law", "law"): gain.law if results.sizes["model"] > 1 else None,
            Column("other", "compared with"): gain.other,
            Column("ratio", "ratio of chances", "ratio"): Range(*gain.ratio),
            Column("verdict", "result"): verdict_of(gain.ratio) or None,
        }
        for gain in every
    ]
    first = footnote("first_blocks", MOST) if len({(gain.block, gain.floor) for gain in every}) >= MOST else ""
    return Table.of("Effects of walls and restraints", rows, intervals(results), footnote("same_motions"), first)


MOST_COLUMNS = 6
"""Maximum number of restraints in a table of breaks by level; the results contain all of them."""
HALF = 0.5


def breaks_by_level(of: Mapping[str, Sequence[xr.DataArray]], levels: xr.DataArray, what: str, *notes: str) -> Table:
    """Return a table of the shares of motions in which restraints break: a row per level, a column per restraint."""
    scale, unit = display_unit(levels)
    names = list(of)[:MOST_COLUMNS]
    # (up to the first level from which on every motion breaks every restraint)
    some = np.flatnonzero((np.array([of[name][0].values for name in names]) < 1.0).any(axis=0))
    shown = levels.values[: int(some[-1]) + 2 if some.size else 1]
    rows: list[Cells] = [
        {
            Column("level", quantity_name(levels), "two", unit): float(level) / scale,
            **{Column(name, name, "observed"): Range(*(float(end[k]) for end in of[name])) for name in names},
        }
        for k, level in enumerate(shown)
    ]
    first = footnote("some_of", len(names), len(of), what) if len(of) > len(names) else ""
    return Table.of(f"Breaks of {what}", rows, footnote("shares_of_motions"), *notes, first)


def breaks(results: xr.Dataset) -> Table:
    """Return the shares of the motions in which restraints break at each level."""
    at, _ = reference_law(results)
    shares = {}
    for name, where in _held(results):
        block = results.isel(where, drop=True).isel(model=at)
        shares[name] = [block[f"{BROKEN}{end}"] for end in ENDS]
    law = f"Law: {results['model'].values[at]}." if results.sizes["model"] > 1 else ""
    return breaks_by_level(shares, results["level"], "restraints", intervals(results), law)


def breaks_of(results: xr.Dataset, at: int) -> list[tuple[str, float, float, float, float, bool]]:
    """Return the ruptures of restraints under a law: name, share of motions with its ends, level, at the design level.

    The level is the design level if it is known, else the lowest at which at least half of the motions break a
    restraint, or the highest.
    """
    ruptures = []
    for name, where in _held(results) if BROKEN in results else []:
        broken = results[[str(variable) for variable in results.data_vars if str(variable).startswith("broken_")]]
        broken = broken.isel({dim: k for dim, k in where.items() if dim in broken.dims}).isel(model=at)
        if AT_DESIGN in broken and math.isfinite(float(broken[AT_DESIGN])):
            ruptures.append((name, *range_of(broken, AT_DESIGN), float(results[DESIGN]), True))
        else:
            often = np.flatnonzero(broken[BROKEN].values >= HALF)
            at_level = broken.isel(level=int(often[0]) if often.size else -1)
            ruptures.append((name, *range_of(at_level, BROKEN), float(at_level["level"]), False))
    return ruptures


def strength_of(results: xr.Dataset, at: int) -> list[tuple[str, float, list[float], float]]:
    """Return the strength that each restraint needs for its target: name, strength, tried strengths, target (N)."""
    if NEEDED not in results:
        return []
    strengths = []
    for i in np.flatnonzero(np.isfinite(results[TARGET].values)).tolist():
        of_block = results.isel(block=i, model=at)
        tried = of_block[TRIED].dropna("trial").values.tolist()
        strengths.append((str(of_block["block"].item()), float(of_block[NEEDED]), tried, float(of_block[TARGET])))
    return strengths


def _held(results: xr.Dataset) -> list[tuple[str, dict[str, int]]]:
    """Return the names of blocks (and floors) with restraints, with their positions."""
    shares = results[BROKEN]
    every = by_place(results, shares.dims)
    return [(name, where) for name, where in every if bool(shares.isel(where).notnull().any())]
