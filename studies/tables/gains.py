"""Chances of blocks with walls and restraints beside those without them, as a table and in sentences."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product
from typing import NamedTuple

import numpy as np
import xarray as xr

from ...core.wording import about_percent, confidence_text, ratio_text, years_text
from ...fragility.risk.ratios import Ratio
from ..plan.gains import GAIN, MOST, OTHER
from ..plan.ratios import verdict_of
from ..text.rows import Rows
from ..text.words import floor_name


class Gain(NamedTuple):
    """The chance of a block, that of another in the same place under the same law, and their ratio."""

    block: str
    other: str
    floor: str
    law: str
    chance: float
    of_other: float
    ratio: Ratio


def gains_of(results: xr.Dataset, laws: list[int]) -> Iterator[Gain]:
    """Yield the comparisons of blocks under some laws, block by block; none where there are none."""
    if GAIN not in results:
        return
    floors = results["floor"].values.tolist() if "floor" in results[GAIN].dims else [None]
    labels = [str(one) for one in results["block"].values]
    for i, (k, floor), j in product(range(len(labels)), enumerate(floors), laws):
        at = {"model": j} | ({} if floor is None else {"floor": k})
        ratio = Ratio(*(float(results[f"{GAIN}{end}"].isel(block=i, **at)) for end in ("", "_lower", "_upper")))
        other = str(results[OTHER].values[i])
        if other not in labels or np.isnan(ratio.value):
            continue
        chance, of_other = (
            float(results["risk_probability"].isel(block=one, **at)) for one in (i, labels.index(other))
        )
        law, where = str(results["model"].values[j]), "" if floor is None else floor_name(floor)
        yield Gain(labels[i], other, where, law, chance, of_other, ratio)


def gain_rows(results: xr.Dataset) -> Rows | None:
    """Return the table of what walls and restraints change, under every law; None where nothing can be compared."""
    found = list(gains_of(results, list(range(results.sizes["model"]))))
    if not found:
        return None
    years = float(results.attrs["years"])
    headings = ("", "law", f"in {years_text(years)}", "compared with", f"in {years_text(years)}", "ratio", "")
    rows = []
    for one in found:
        name = f"{one.block}, {one.floor}" if one.floor else one.block
        ratio = ratio_text(*one.ratio)
        chances = about_percent(one.chance), one.other, about_percent(one.of_other)
        rows.append((name, one.law, *chances, ratio, verdict_of(one.ratio) or "–"))
    first = f"the first {MOST} blocks; " if len({one.block for one in found}) == MOST else ""
    title = (
        f"What walls and restraints change ({first}ratios with {confidence_text(results)} intervals; both pieces are "
        "shaken by the same motions)"
    )
    return Rows(title, headings, rows)
