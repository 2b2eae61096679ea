"""The order in which the blocks of a study fall: the same for tables, figures and sentences."""

import numpy as np
import xarray as xr

from ...fragility.fitting.states import ALL
from .words import reference_law

MOST_BLOCKS = 30
"""Maximum number of blocks in tables and in figures of fragility studies; the results contain all of them."""
MOST_DRAWN = 12
"""Most blocks in figures of the other kinds of studies, if each block takes a large panel or a figure."""
BLOCK_KINDS = ("fragility", "uncertainty", "sensitivity")
"""Kinds of studies whose results are curves of blocks."""
HALF, RATE = "half_level", "rate"
ORDERS = {HALF: "that fall first", RATE: "with the highest rates"}


def places(results: xr.Dataset, by: str = HALF) -> xr.DataArray:
    """The rank of each block (and floor) under the answer's law by `half_level` or rate, 0 for the first to fall."""
    of_law = results.isel(model=reference_law(results)[0])
    value = of_law[by].transpose("block", ...)
    always = np.zeros(value.shape, bool)
    if "status" in of_law:
        always = (of_law["status"].transpose(*value.dims) == ALL).values
    known = np.isfinite(value.values) & ~always
    fell = np.zeros(value.shape)
    if "probability" in of_law and "level" in of_law["probability"].dims:
        fell = of_law["probability"].mean("level").transpose(*value.dims).values
    key = np.where(known, value.values if by == HALF else -value.values, -fell)
    kind = np.select([always, known], [0, 1] if by == HALF else [1, 0], 2)
    order = np.lexsort([key.ravel(), kind.ravel()])
    place = np.empty(order.size, np.int64)
    place[order] = np.arange(order.size)
    return xr.DataArray(place.reshape(value.shape), dims=value.dims)


def shown(results: xr.Dataset, by: str = HALF, most: int = MOST_BLOCKS) -> xr.Dataset:
    """Return results of the blocks that come first, at most `most`, ranked by their worst floors."""
    blocks = results.sizes.get("block", 0)
    if blocks <= most or str(results.attrs["kind"]) not in BLOCK_KINDS:
        return results
    place = places(results, by)
    best = place.min([dim for dim in place.dims if dim != "block"]).values
    chosen = np.argsort(best, kind="stable")[:most]
    return results.isel(block=chosen).assign_attrs(shown_of=blocks, shown_by=ORDERS[by])


def chosen_of(results: xr.Dataset) -> str:
    """A phrase for the blocks in a table of `shown` results; empty if the table contains all of them."""
    if "shown_of" not in results.attrs:
        return ""
    return f"the {results.sizes['block']:,} of {results.attrs['shown_of']:,} blocks {results.attrs['shown_by']}"
