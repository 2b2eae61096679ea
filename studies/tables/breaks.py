"""How often restraints break, at each level and at the design shaking, as tables and in sentences."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
import xarray as xr

from ...core.wording import (
    about_percent,
    chances_between,
    confidence_text,
    two_digits,
)
from ..plan.restraints import AT_DESIGN, BROKEN, DESIGN, NEEDED, TARGET, TRIED
from ..text.rows import Rows
from ..text.words import by_place, display_unit, quantity_name, reference_law

ENDS = ("", "_lower", "_upper")
MOST_COLUMNS = 6
"""Most restraints in a table of breaks by level; the results hold all of them."""
HALF = 0.5


def breaks_by_level(
    every: Mapping[str, Sequence[xr.DataArray]], levels: xr.DataArray, confidence: str, what: str
) -> Rows | None:
    """Return a table of the shares of motions in which restraints break: a row a level, a column a restraint."""
    if not every:
        return None
    scale, unit = display_unit(levels)
    shown = list(every)[:MOST_COLUMNS]
    rows = []
    for k, level in enumerate(levels.values):
        cells = [share_text(*(float(one[k]) for one in every[name])) for name in shown]
        rows.append((two_digits(float(level) / scale), *cells))
    first = f"; the first {len(shown)} of {len(every):,}" if len(every) > len(shown) else ""
    name = f"{quantity_name(levels)}{f', {unit}' if unit else ''}"
    title = f"Share of the motions in which {what} break, at each level ({confidence} intervals{first})"
    return Rows(title, (name, *shown), rows)


def share_text(share: float, low: float, high: float) -> str:
    """Return a share of motions with its interval."""
    text = "0\u00a0%" if share == 0.0 else about_percent(share)
    return f"{text} ({chances_between(low, high, about_percent)})".replace("\u00a0%)", ")")


def break_rows(results: xr.Dataset) -> Rows | None:
    """Return the shares of the motions in which restraints break at each level; None where no block has one."""
    if BROKEN not in results:
        return None
    at, _ = reference_law(results)
    every = {}
    for name, where in _held(results):
        one = results.isel(where, drop=True).isel(model=at)
        every[name] = [one[f"{BROKEN}{end}"] for end in ENDS]
    found = breaks_by_level(every, results["level"], confidence_text(results), "restraints")
    several = results.sizes["model"] > 1
    return found._replace(title=f"{found.title}: {results['model'].values[at]}") if found and several else found


def breaks_of(results: xr.Dataset, at: int) -> list[tuple[str, float, float, float, float, bool]]:
    """Return how often restraints break under a law: name, share of motions with its ends, level, at the design level.

    The level is the design shaking where it is known, else the lowest at which at least half of the motions break a
    restraint, or the highest.
    """
    found = []
    for name, where in _held(results) if BROKEN in results else []:
        here = results[[str(variable) for variable in results.data_vars if str(variable).startswith("broken_")]]
        here = here.isel({dim: k for dim, k in where.items() if dim in here.dims}).isel(model=at)
        if AT_DESIGN in here and math.isfinite(float(here[AT_DESIGN])):
            share, low, high = (float(here[f"{AT_DESIGN}{end}"]) for end in ENDS)
            found.append((name, share, low, high, float(results[DESIGN]), True))
        else:
            of_levels = [here[f"{BROKEN}{end}"].values for end in ENDS]
            k = _telling(of_levels[0])
            share, low, high = (float(each[k]) for each in of_levels)
            found.append((name, share, low, high, float(results["level"][k]), False))
    return found


def strength_of(results: xr.Dataset, at: int) -> list[tuple[str, float, list[float], float]]:
    """Return the strength that each restraint needs for its target: name, strength, tried strengths, target (N)."""
    if NEEDED not in results:
        return []
    found = []
    for i in np.flatnonzero(np.isfinite(results[TARGET].values)).tolist():
        here = results.isel(block=i, model=at)
        tried = here[TRIED].dropna("trial").values.tolist()
        found.append((str(here["block"].item()), float(here[NEEDED]), tried, float(here[TARGET])))
    return found


def _telling(shares: np.ndarray) -> int:
    """Return the lowest level at which at least half of the motions break a restraint, else the highest."""
    often = np.flatnonzero(shares >= HALF)
    return int(often[0]) if often.size else -1


def _held(results: xr.Dataset) -> list[tuple[str, dict[str, int]]]:
    """Return the names of blocks (and floors) with restraints, with their positions."""
    shares = results[BROKEN]
    every = by_place(results, shares.dims)
    return [(name, where) for name, where in every if bool(shares.isel(where).notnull().any())]
