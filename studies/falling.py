"""Which blocks of a study fall first: one order for tables, figures and sentences."""

from __future__ import annotations

import numpy as np
import xarray as xr

from ..fragility.statuses import ALL
from .words import reference_law

MOST_BLOCKS = 100
"""Blocks in tables, and in figures of fragility studies: what more there is stands in the results."""
MOST_DRAWN = 12
"""Blocks in figures of other kinds of studies, each a panel as large as a figure, or a figure."""
OF_BLOCKS = ("fragility", "uncertainty", "sensitivity")
"""Kinds of studies whose results are curves of blocks."""
MEDIAN, RATE = "median", "rate"
ORDERS = {MEDIAN: "that fall first", RATE: "with the highest rates"}


def places(results: xr.Dataset, by: str = MEDIAN) -> xr.DataArray:
    """The place of each block (and floor), 0 for the one that falls first, under the law that answers are of.

    First come those that fell in every run, of which nothing else is known; then those with a median, from the lowest;
    then those without, by the share of their runs that fell.  By rate: those with one, from the highest, then the rest.
    """
    one = results.isel(model=reference_law(results)[0])
    value = one[by].transpose("block", ...)
    always = np.zeros(value.shape, bool)
    if "status" in one:
        always = (one["status"].transpose(*value.dims) == ALL).values
    known = np.isfinite(value.values) & ~always
    fell = np.zeros(value.shape)
    if "probability" in one and "level" in one["probability"].dims:
        fell = one["probability"].mean("level").transpose(*value.dims).values
    key = np.where(known, value.values if by == MEDIAN else -value.values, -fell)
    kind = np.select([always, known], [0, 1] if by == MEDIAN else [1, 0], 2)
    order = np.lexsort([key.ravel(), kind.ravel()])
    place = np.empty(order.size, np.int64)
    place[order] = np.arange(order.size)
    return xr.DataArray(place.reshape(value.shape), dims=value.dims)


def shown(results: xr.Dataset, by: str = MEDIAN, most: int = MOST_BLOCKS) -> xr.Dataset:
    """What tables and figures hold of a study's results: of many blocks those that come first.

    They are `most` at most (on the worst floor each); the attributes ``shown_of`` and ``shown_by`` then say how many
    there are, and which these are.
    """
    blocks = results.sizes.get("block", 0)
    if blocks <= most or str(results.attrs["kind"]) not in OF_BLOCKS:
        return results
    place = places(results, by)
    best = place.min([dim for dim in place.dims if dim != "block"]).values
    chosen = np.argsort(best, kind="stable")[:most]
    return results.isel(block=chosen).assign_attrs(shown_of=blocks, shown_by=ORDERS[by])


def chosen_of(results: xr.Dataset) -> str:
    """Which blocks a table of `shown` results holds, where these are not all; else nothing."""
    if "shown_of" not in results.attrs:
        return ""
    return f"the {results.sizes['block']:,} of {results.attrs['shown_of']:,} blocks {results.attrs['shown_by']}"
