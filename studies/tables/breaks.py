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
    given_number,
    given_percent,
    two_digits,
    with_article,
    years_text,
)
from ..plan.restraints import AT_DESIGN, BROKEN, DESIGN, NEEDED, TARGET, TRIED
from ..text.curve_notes import verb_in
from ..text.rows import Rows
from ..text.words import block_title, by_place, display_unit, quantity_name, reference_law

ENDS = ("", "_lower", "_upper")
MOST_COLUMNS = 6
"""Most restraints in a table of breaks by level; the results hold all of them."""
MOST_SAID = 3
"""Most restraints that have a sentence."""
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


def break_sentences(results: xr.Dataset) -> list[str]:
    """Return how often restraints break and how strong they must be, under the reference law, for the first blocks."""
    at, _ = reference_law(results)
    said = []
    for name, where in (_held(results) if BROKEN in results else [])[:MOST_SAID]:
        here = results[[str(one) for one in results.data_vars if str(one).startswith("broken_")]]
        one = here.isel({dim: k for dim, k in where.items() if dim in here.dims}).isel(model=at)
        design = float(one[f"{AT_DESIGN}"]) if AT_DESIGN in one else math.nan
        if math.isfinite(design):
            shares = [float(one[f"{AT_DESIGN}{end}"]) for end in ENDS]
            level, which = float(results[DESIGN]), ", which is exceeded with a probability of 10 % in 50 years"
        else:
            of_levels = [one[f"{BROKEN}{end}"].values for end in ENDS]
            k, which = _telling(of_levels[0])
            shares, level = [float(each[k]) for each in of_levels], float(results["level"][k])
        scale, unit = display_unit(results["level"])
        shaking = f"{with_article(quantity_name(results['level']))} of {two_digits(level / scale)}"
        shaking += f" {unit}" if unit else ""
        often_broken = f"breaks in {share_text(*shares)} of the motions"
        of_name = f"The restraint of “{block_title(name)}” {often_broken} at {shaking}{which}."
        often = results["level"].values[one[BROKEN].values >= HALF]
        if shares[0] < HALF and often.size:
            strong = f"{two_digits(float(often[0]) / scale)}{f' {unit}' if unit else ''}"
            of_name += f" At {strong} it breaks in at least half of them."
        said.append(of_name)
    if NEEDED in results:
        asked = np.flatnonzero(np.isfinite(results[TARGET].values))[:MOST_SAID]
        said.extend(_strength_needed(results.isel(block=i, model=at)) for i in asked.tolist())
    return said


def _strength_needed(one: xr.Dataset) -> str:
    """Return the strength that the restraint of a block needs for its target."""
    tried, needed = one[TRIED].dropna("trial").values, float(one[NEEDED])
    if "years" in one.attrs:
        when = f"in {years_text(float(one.attrs['years']))}"
    else:
        scale, unit = display_unit(one["level"])
        level = f"{two_digits(float(one['level'][0]) / scale)} {unit}".rstrip()
        when = f"at {with_article(quantity_name(one['level']))} of {level}"
    keeps = f"the chance that “{block_title(str(one['block'].item()))}” {verb_in(one)} {when}"
    most = f"to at most {given_percent(float(one[TARGET]))}"
    strongest = f"{given_number(tried[-1])} N"
    if needed == math.inf:
        return f"No tested strength of its restraint up to {strongest} is shown to limit {keeps} {most}."
    if needed == tried[0]:
        return f"Even {given_number(needed)} N, the weakest tested strength of its restraint, limits {keeps} {most}."
    weaker = given_number(float(tried[tried < needed][-1]))
    return (
        f"A restraint of {given_number(needed)} N limits {keeps} {most}. So do all stronger ones that were tested, up "
        f"to {strongest}; {weaker} N is not shown to."
    )


def _telling(shares: np.ndarray) -> tuple[int, str]:
    """Return the lowest level at which at least half of the motions break a restraint, or the highest, in words."""
    often = np.flatnonzero(shares >= HALF)
    if often.size and often[0] > 0:
        return int(often[0]), ", the lowest level at which at least half of them break it"
    return (0, ", the weakest shaking that was run") if often.size else (-1, ", the strongest shaking that was run")


def _held(results: xr.Dataset) -> list[tuple[str, dict[str, int]]]:
    """Return the names of blocks (and floors) with restraints, with their positions."""
    shares = results[BROKEN]
    every = by_place(results, shares.dims)
    return [(name, where) for name, where in every if bool(shares.isel(where).notnull().any())]
