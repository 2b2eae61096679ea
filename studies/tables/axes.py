"""The axes about which pieces fall, if both horizontal components act."""

import math
from collections.abc import Iterator

import xarray as xr

from ...models.outputs import AXIS
from ..buildings.variables import SIDEWAYS
from ..text.block_order import shown
from ..text.words import reference_law
from .table import Cells, Column, Table, Value, footnote

MOST = 100
"""Most pieces in the table."""
DEPTH = 2
"""Value of `AXIS` of a fall along the depth."""


def axes(results: xr.Dataset) -> Table:
    """Return the shares of the falls along width and depth under the reference law."""
    at, _ = reference_law(results)
    of_law = shown(results).isel(model=at)
    yearly = "rate" in of_law and AXIS not in of_law
    of_falls = Column("falls", "falls per year" if yearly else "falls", "plain" if yearly else "chance")
    rows: list[Cells] = [
        {
            Column("name"): name,
            of_falls: falls,
            Column("width", "along the width", "share"): width,
            Column("depth", "along the depth", "share"): depth,
        }
        for name, falls, width, depth in (_of_blocks(of_law) if AXIS in of_law else _of_items(of_law))
    ]
    note = footnote("shares_of_runs") if AXIS in of_law else ""
    return Table.of("Axes of the falls", rows, note, footnote("law", of_law["model"].item()), most=MOST)


def _of_blocks(of_law: xr.Dataset) -> Iterator[tuple[str, Value, Value, Value]]:
    """Yield the name of each block, its falls, and their shares along the width and the depth."""
    axis = of_law[AXIS].transpose("block", ...)
    for block, values in zip(of_law["block"].values, axis.values, strict=True):
        fell, deep = int((values > 0).sum()), int((values == DEPTH).sum())
        share = deep / fell if fell else math.nan
        yield str(block), fell / values.size, 1.0 - share, share


def _of_items(of_law: xr.Dataset) -> Iterator[tuple[str, Value, Value, Value]]:
    """Yield the same of each line of an inventory."""
    for i, name in enumerate(of_law["block"].values):
        item = of_law.isel(block=i)
        falls = float(item["rate"] if "rate" in item else item["probability"].mean())
        share = float(item[f"{SIDEWAYS}_share"])
        ends = (1.0 - share, share) if bool(item["both_axes"]) else ("width alone", None)
        yield str(name), None if bool(item["anchored"]) else falls, *ends
