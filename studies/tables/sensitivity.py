"""Tables of sensitivity studies: laws down, values of delta or e across, a table for each block; and the claims."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator

import numpy as np
import xarray as xr
from rich.box import SIMPLE_HEAD
from rich.markup import escape
from rich.table import Table

from ...wording import two_digits, whole_percent
from ..plan.estimates import middle_level
from ..sensitivity.claims import FAILS, HOLDS, NAMES, OPEN, Claim, evidence_of
from ..text.rows import Rows
from ..text.words import block_title, display_unit, level_text, measure_name, quantity_name

LAW_NAMES = {**NAMES, "housner": "Housner’s impacts", "viscous": "viscous damping"}
"""Laws in words, by their short names."""
GREEK = {"delta": "δ", "e": "e"}
OUTCOMES = {HOLDS: HOLDS, FAILS: FAILS, OPEN: "cannot be decided"}
"""Verdicts in words."""
PARAMETERS = {"delta": "δ, the width of the zone of damping", "e": "e, the coefficient of restitution"}
"""Parameters in words."""
SLIGHT = 1.1
"""Ratio of two levels up to which their difference is written in per cent."""
MOST_SAID = 3
"""Most blocks that have a sentence; the table has all of them."""


def claims_of(results: xr.Dataset) -> list[Claim]:
    """Return the claims held by a study's results."""
    return [Claim(**one) for one in json.loads(str(results.attrs["claims"]))]


def reference_of(results: xr.Dataset) -> str:
    """The name of the comparison with the study's reference."""
    return str(results["comparison"].values[0])


def reference_name(results: xr.Dataset, comparison: str | None = None) -> str:
    """The reference that values are compared with, in words."""
    symbol = GREEK[str(results.attrs["parameter"])]
    return {
        "rigid": "the rigid block",
        "own": "the block's own e_R",
        "given": f"{symbol} = {results.attrs['reference']}",
        "previous": "the value before",
    }[comparison or reference_of(results)]


def level_between(here: xr.Dataset) -> int:
    """The index of the level at which the rigid block overturns under as near to half of the motions as possible."""
    rigid = here["probability"] - here["excess"].sel(comparison="rigid")
    return middle_level(rigid.where(np.isfinite(rigid)))


def level_at(results: xr.Dataset, at: int) -> str:
    """Return one of the levels with its unit."""
    return level_text(float(results["level"][at]), results["level"])


def law_of_answer(results: xr.Dataset) -> int:
    """Return the position of the law that the first page is about: the nearest to a rigid block with impacts."""
    laws = [str(one) for one in results["law"].values]
    rigid = [name for name in ("housner", "energy-consistent") if name in laws]
    return laws.index(rigid[0]) if rigid else 0


def law_name(results: xr.Dataset, at: int) -> str:
    """Return the name of a law in words: without parameters, and with its rest where two laws differ in it alone."""
    laws = [str(one) for one in results["law"].values]
    name = LAW_NAMES.get(laws[at], laws[at])
    twice = laws.count(laws[at]) > 1 and "rest" in results.coords
    return f"{name} (rigid at rest)" if twice and str(results["rest"].values[at]) == "rigid" else name


def level_rows(results: xr.Dataset) -> Rows:
    """Return the levels at which half of the motions overturn each block, by the value, under the law of the answer."""
    at = law_of_answer(results)
    scale, unit = display_unit(results["level"])
    symbol = GREEK[str(results.attrs["parameter"])]
    medians = results["median"].isel(model=at).transpose("block", "value").values / scale
    rows = [
        (block_title(str(block)), *(two_digits(one) if np.isfinite(one) else "–" for one in own))
        for block, own in zip(results["block"].values, medians.tolist(), strict=True)
    ]
    name = f"{measure_name(str(results['level'].attrs.get('im', 'level')))}{f', {unit},' if unit else ''}"
    title = f"{name} at which half of the motions overturn each piece, by {symbol} ({law_name(results, at)})"
    return Rows(title, (f"{symbol} =", *(f"{one:g}" for one in results["value"].values)), rows)


def statement_rows(results: xr.Dataset) -> Rows | None:
    """Return the outcome of each claim with its number, for the first page; None where none could be judged."""
    # (where the comparisons are made is the same for nearly all of them, and stands in the title)
    where = evidence_of(results).where
    rows = [
        (one.claim, OUTCOMES[one.verdict], one.text.removeprefix(f"{where}, ").replace(f" ({where})", ""))
        for one in claims_of(results)
    ]
    headings = ("statement", "outcome", "what was found")
    return Rows(f"What these runs say of each statement ({where})", headings, rows) if rows else None


def swings_of(results: xr.Dataset, model: int) -> list[tuple[str, float, float, float, float]]:
    """Return of each block the first and the last value in use with a median, and these medians (SI)."""
    found = []
    for i, block in enumerate(results["block"].values):
        medians = results["median"].isel(model=model).transpose("block", "value").values[i]
        known = np.flatnonzero(np.isfinite(medians) & results["in_use"].values[i])
        if known.size > 1:
            ends = [(float(results["value"].values[k]), float(medians[k])) for k in (known[0], known[-1])]
            found.append((str(block), ends[0][0], ends[1][0], ends[0][1], ends[1][1]))
    return found


def sensitivity_sentences(results: xr.Dataset) -> Iterator[str]:
    """Yield how far the level that overturns half of the motions moves with the value, and how far laws lie apart."""
    at = law_of_answer(results)
    scale, unit = display_unit(results["level"])
    unit = f" {unit}" if unit else ""
    symbol, measure = GREEK[str(results.attrs["parameter"])], quantity_name(results["level"])
    law = law_name(results, at)
    for block, low, high, first, last in swings_of(results, at)[:MOST_SAID]:
        ratio = max(first, last) / min(first, last)
        apart = f"a factor of {two_digits(ratio)}" if ratio > SLIGHT else f"{whole_percent(ratio - 1.0)} apart"
        yield (
            f"“{block_title(block)}”: under {law}, half of the motions overturn it at a {measure} of "
            f"{two_digits(first / scale)}{unit} with {symbol} = {low:g} and of {two_digits(last / scale)}{unit} with "
            f"{symbol} = {high:g}: {apart}."
        )
    laws = laws_apart(results)
    if laws:
        (near, least), (far, most) = laws[0], laws[-1]
        text = f"Of the damping laws, {near} agrees best with a rigid block (on average {least:.2f} times its levels)"
        yield f"{text}, {far} worst ({most:.2f} times)." if len(laws) > 1 else f"{text}."


def laws_apart(results: xr.Dataset) -> list[tuple[str, float]]:
    """Return the laws with the geometric mean of their medians over the rigid block's, the nearest to 1 first."""
    ratio = results["median_ratio"].sel(comparison="rigid").transpose("model", "block", "value").values
    found = []
    for k, own in enumerate(ratio):
        known = results["in_use"].values & np.isfinite(own) & (own > 0.0)
        if known.any():
            found.append((law_name(results, k), float(np.exp(np.log(own[known]).mean()))))
    return sorted(found, key=lambda one: abs(np.log(one[1])))


def median_rows(results: xr.Dataset) -> list[Rows]:
    """Medians divided by those of the reference."""
    ratio = results["median_ratio"].sel(comparison=reference_of(results))
    title = f"Median over that of {reference_name(results)}"
    return [_table(results, f"{title}: {block}", ratio.sel(block=block), _factor) for block in results["block"].values]


def probability_rows(results: xr.Dataset) -> list[Rows]:
    """Probabilities of overturning and shares of flipped outcomes, at the level given by `level_between`."""
    found = []
    for block in results["block"].values:
        here = results.sel(block=block)
        at = level_between(here)
        where = f"at {level_at(results, at)}: {block}"
        found.append(
            _table(results, f"Probability of overturning {where}", here["probability"].isel(level=at), _percent)
        )
        flips = here["flipped"].sel(comparison=reference_of(results)).isel(level=at)
        found.append(_table(results, f"Outcomes that differ from {reference_name(results)} {where}", flips, _percent))
    return found


def decay_rows(results: xr.Dataset) -> list[Rows]:
    """Mean relative errors of the peaks of free rocking."""
    title = "Peaks of free rocking over those of Housner's closed form, less 1 (mean of ten half cycles)"
    return [
        _table(results, f"{title}: {block}", results["decay_error"].sel(block=block), _signed)
        for block in results["block"].values
    ]


def claim_table(results: xr.Dataset) -> Table:
    """The outcome of each claim, for a terminal."""
    table = Table(title="What the data say", box=SIMPLE_HEAD, pad_edge=False, title_justify="left")
    for heading in ("claim", "verdict", "number and interval"):
        table.add_column(heading, overflow="fold")
    for one in claims_of(results):
        table.add_row(escape(one.claim), escape(one.verdict), escape(one.text), end_section=True)
    return table


def _table(results: xr.Dataset, title: str, cells: xr.DataArray, write: Callable[[float], str]) -> Rows:
    symbol = GREEK[str(results.attrs["parameter"])]
    rows = [
        (str(model), *(write(float(one)) for one in cells.sel(model=model).values)) for model in results["model"].values
    ]
    return Rows(title, (f"{symbol} =", *(f"{one:g}" for one in results["value"].values)), rows)


def _factor(value: float) -> str:
    return "" if np.isnan(value) else "no fall" if value == np.inf else f"{value:.2f}"


def _percent(value: float) -> str:
    return "" if np.isnan(value) else whole_percent(value)


def _signed(value: float) -> str:
    return "" if np.isnan(value) else whole_percent(value, signed=True)
