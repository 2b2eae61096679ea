"""Tables of sensitivity studies: laws down, values of delta or e across, a table for each block; and the claims."""

from __future__ import annotations

import json
from collections.abc import Callable

import numpy as np
import xarray as xr
from rich.box import SIMPLE_HEAD
from rich.markup import escape
from rich.table import Table

from ...wording import whole_percent
from ..plan.estimates import middle_level
from ..sensitivity.claims import Claim
from ..text.rows import Rows
from ..text.words import level_text

GREEK = {"delta": "δ", "e": "e"}


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
    if np.isnan(value):
        return ""
    return whole_percent(value, signed=True) if round(100.0 * value) else "0 %"
