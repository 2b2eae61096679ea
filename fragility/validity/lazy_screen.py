"""The screen of runs that are still to be computed: its variables with a value for every run are dask arrays."""

from __future__ import annotations

import json
from collections.abc import Sequence
from itertools import accumulate, pairwise, product
from typing import Any, NamedTuple
from uuid import uuid4

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from .characteristics import Characteristics
from .reasons import Shares, reason_names
from .slab_screen import Bounds, ScreenInput, few_motions, in_order, screen_part, settings_of

EACH = ("block", "motion")
"""Dimensions that every run has, along which the screen is divided."""


class ScreenedPart(NamedTuple):
    """The variables of a part of the runs that are of every run, by name, and the counts of `Shares`."""

    values: dict[str, NDArray[Any]]
    counts: NDArray[np.int64]


class ScreenTask:
    """The screen of some blocks and motions, to be computed when it is called."""

    def __init__(self, given: ScreenInput, shaking: Characteristics, bounds: Bounds) -> None:
        self._given, self._shaking, self._bounds = given, shaking, bounds

    def __call__(self) -> ScreenedPart:
        """Compute it."""
        variables, holds = screen_part(self._given, self._shaking, self._bounds)
        shares = Shares(self._given.sizes)
        shares.add(holds, variables["verdict"], {})
        own = {name: one.values for name, one in variables.items() if {*EACH} <= {*one.dims}}
        return ScreenedPart(own, shares.counts)


def with_lazy_screen(runs: xr.Dataset, given: ScreenInput, shaking: Characteristics) -> xr.Dataset:
    """Add the variables of the screen to runs of dask arrays, which are still to be computed.

    The variables with a value for every run, and the shares over runs, are dask arrays in the chunks of the runs; the
    others are computed here.
    """
    import dask.array as da  # noqa: PLC0415 - slow to load, and most runs are computed at once

    bounds = Bounds()
    # (of one level, because what is on level is on motion as well, and is only a pattern here)
    first = given.part({"level": slice(0, 1), "motion": slice(0, 1)})
    small, _ = screen_part(first, shaking.part(slice(0, 1)), bounds)
    found = {name: one for name, one in small.items() if "motion" not in one.dims}
    found |= {"band_low": shaking.low, "band_high": shaking.high}
    if "block" not in small["scale_factor"].dims:
        factors = given.factors.values
        found["scale_factor"] = xr.Variable(factors.dims, factors.values, small["scale_factor"].attrs)
    chunks = runs.chunksizes
    blocks, motions = (_slices(chunks[dim]) for dim in EACH)
    name = f"screen-{uuid4().hex}"
    graph = {
        (name, i, j): (ScreenTask(given.part({"block": block, "motion": motion}), shaking.part(motion), bounds),)
        for (i, block), (j, motion) in product(enumerate(blocks), enumerate(motions))
    }
    for key, one in small.items():
        if key not in found:
            along = [chunks[dim] if dim in EACH else (given.sizes[dim],) for dim in map(str, one.dims)]
            layer = {
                (f"{key}-{name}", *place): (_values, (name, *_cell(one.dims, place)), key)
                for place in product(*(range(len(parts)) for parts in along))
            }
            values = da.Array({**graph, **layer}, f"{key}-{name}", along, one.dtype)
            found[key] = xr.Variable(one.dims, values, one.attrs)
    found["outside"] = _outside(given, graph, name, chunks["block"], len(motions))
    few, fewest = few_motions(given, bounds)
    told = json.dumps(settings_of(bounds, fewest, None, motions=True, vertical=given.lifted), ensure_ascii=False)
    return runs.assign(in_order({**found, **few})).assign_coords(reason=reason_names()).assign_attrs(screen=told)


def _outside(
    given: ScreenInput, graph: dict[Any, Any], name: str, blocks: tuple[int, ...], motions: int
) -> xr.Variable:
    """Return the shares of the runs for which each reason holds, of the counts of all parts."""
    import dask.array as da  # noqa: PLC0415 - loaded already

    shares = Shares(given.sizes)
    template = shares.outside(None)
    rest = tuple((size,) for size in template.shape[1:])
    layer = {
        (f"outside-{name}", i, *[0] * len(rest)): (_sum, [(name, i, j) for j in range(motions)])
        for i in range(len(blocks))
    }
    counts = da.Array({**graph, **layer}, f"outside-{name}", (blocks, *rest), np.int64)
    return template.copy(data=counts / shares.runs)


def _values(part: ScreenedPart, name: str) -> NDArray[Any]:
    return part.values[name]


def _sum(parts: Sequence[ScreenedPart]) -> NDArray[np.int64]:
    found: NDArray[np.int64] = np.sum([one.counts for one in parts], axis=0)
    return found


def _cell(dims: Sequence[Any], place: tuple[int, ...]) -> tuple[int, ...]:
    """Return the numbers of the parts of blocks and motions at a place."""
    return tuple(place[list(dims).index(dim)] for dim in EACH)


def _slices(sizes: Sequence[int]) -> list[slice]:
    return [slice(*bounds) for bounds in pairwise(accumulate(sizes, initial=0))]
