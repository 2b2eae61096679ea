"""Chances of blocks with walls and restraints compared with blocks without them."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product
from typing import NamedTuple

import numpy as np
import xarray as xr

from ...fragility.risk.ratios import Ratio
from ..buildings.recommendations import Range
from ..plan.gains import GAIN, MOST, OTHER
from ..plan.ratios import verdict_of
from ..text.words import floor_name
from .table import Column, Row, Table, intervals


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


def gains(results: xr.Dataset) -> Table:
    """Return the table of what walls and restraints change, under every law."""
    rows: list[Row] = [
        {
            "name": f"{gain.block}, {gain.floor}" if gain.floor else gain.block,
            "law": gain.law if results.sizes["model"] > 1 else None,
            "other": gain.other,
            "ratio": Range(*gain.ratio),
            "verdict": verdict_of(gain.ratio) or None,
        }
        for gain in gains_of(results, list(range(results.sizes["model"])))
    ]
    columns = (
        *(Column("name", "block"), Column("law", "law"), Column("other", "compared with")),
        *(Column("ratio", "ratio of chances", "ratio"), Column("verdict", "result")),
    )
    first = f"The table has the first {MOST} blocks." if len({row["name"] for row in rows}) >= MOST else ""
    return Table.of("Effects of walls and restraints", columns, rows, intervals(results), PAIRED, first)


PAIRED = "Both blocks have the same motions."
