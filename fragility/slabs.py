"""Results of more runs than memory should hold copies of: worked on slab by slab, each a part of them.

What is made of a slab may take a hundred bytes a run for a moment; what is kept of it is small, or goes into an array
that a runner gave.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

RUNS = 2**21
"""Runs in a slab at most, wherever it can be cut so small."""
BLOCKS = 2**13
"""Blocks in a slab at most: a curve takes kilobytes until it stands in arrays."""
OF_RUNS = ("block", "item", "variant", "model", "sample", "value", "level", "motion", "place", "realisation")
"""Dimensions that runs can be on."""

Array = Callable[[tuple[int, ...], Any], NDArray[Any]]
"""Gives an array of a shape and a type, in memory or elsewhere."""
Where = dict[str, slice]


def slabs(sizes: Mapping[str, int], dims: Sequence[str]) -> Iterator[Where]:
    """Bounds of slabs along the dimensions, the first one cut first; one of everything where all is small.

    Examples
    --------
    >>> [part["block"] for part in slabs({"block": 3, "motion": 2**20}, ["block"])]
    [slice(0, 2, None), slice(2, 3, None)]
    """
    here = [dim for dim in dims if dim in sizes]
    runs = math.prod(size for dim, size in sizes.items() if dim in OF_RUNS)
    if not here or (runs <= RUNS and sizes.get("block", 0) <= BLOCKS):
        yield {}
        return
    dim, *rest = here
    size = sizes[dim]
    step = max(1, RUNS // max(1, runs // size))
    if dim == "block":
        step = min(step, BLOCKS)
    for first in range(0, size, step):
        part = slice(first, min(first + step, size))
        for more in slabs({**sizes, dim: part.stop - part.start}, rest):
            yield {dim: part, **more}


def sizes_of(runs: xr.Dataset) -> dict[str, int]:
    """Sizes by the dimensions' names."""
    return {str(dim): size for dim, size in runs.sizes.items()}


def gathered(
    of: Callable[[xr.Dataset], xr.Dataset],
    runs: xr.Dataset,
    dims: Sequence[str] = ("block", "model"),
    sizes: Mapping[str, int] | None = None,
) -> xr.Dataset:
    """What a function finds of runs, slab by slab along dimensions that it keeps and takes one by one, together.

    Coordinates and variables without the dimension are those of the first slab.  `sizes`: by which slabs are cut, where
    they are not those of the runs.
    """
    found = [(where, of(runs.isel(where))) for where in slabs(sizes_of(runs) if sizes is None else sizes, dims)]
    for dim in reversed(dims):  # (slabs of equal bounds along the dimensions before it are joined along this one)
        if any(dim in where for where, _ in found):
            found = _joined(found, dim)
    return found[0][1]


def _joined(parts: list[tuple[Where, xr.Dataset]], dim: str) -> list[tuple[Where, xr.Dataset]]:
    groups: dict[tuple[tuple[str, int], ...], list[xr.Dataset]] = {}
    bounds: dict[tuple[tuple[str, int], ...], Where] = {}
    for where, one in parts:
        rest = {name: part for name, part in where.items() if name != dim}
        key = tuple((name, part.start) for name, part in rest.items())
        bounds[key] = rest
        groups.setdefault(key, []).append(one)
    return [
        (
            bounds[key],
            xr.concat(
                group,
                dim,
                data_vars="minimal",
                coords="minimal",
                compat="override",
                join="exact",
                combine_attrs="override",
            ),
        )
        for key, group in groups.items()
    ]


def put(
    found: dict[str, xr.Variable],
    part: Mapping[str, xr.Variable],
    where: Where,
    sizes: Mapping[str, int],
    array: Array,
) -> None:
    """Write the variables of a slab into those of all of it, made with `array` where they are not there yet."""
    for name, one in part.items():
        if name not in found:
            shape = tuple(sizes.get(str(dim), one.sizes[dim]) for dim in one.dims)
            found[name] = xr.Variable(one.dims, array(shape, one.dtype), one.attrs)
        found[name].data[tuple(where.get(str(dim), slice(None)) for dim in one.dims)] = one.values


def in_memory(shape: tuple[int, ...], dtype: Any) -> NDArray[Any]:
    """An array in memory, its values not set."""
    return np.empty(shape, dtype)
