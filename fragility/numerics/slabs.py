"""Slabs: parts of results that are processed one after the other, to avoid copies of all runs in memory.

Processing a slab may temporarily take a hundred bytes per run. Its results are small, or are written into an array that
a runner has allocated.
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import groupby
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

RUNS = 2**21
"""Maximum number of runs in a slab, if slabs can be cut so small."""
BLOCKS = 2**13
"""Maximum number of blocks in a slab: a curve takes kilobytes until it is stored in arrays."""
OF_RUNS = ("block", "variant", "model", "sample", "value", "level", "motion", "place", "realisation")
"""Dimensions that runs can be on."""

Allocator = Callable[[tuple[int, ...], Any], NDArray[Any]]
"""Function that returns an array of a shape and a type, in memory or elsewhere."""
Where = dict[str, slice]


def slabs(sizes: Mapping[str, int], dims: Sequence[str]) -> Iterator[Where]:
    """Yield the bounds of slabs along the dimensions, the first cut first; one slab if all runs fit in it."""
    cut = [dim for dim in dims if dim in sizes]
    runs = math.prod(size for dim, size in sizes.items() if dim in OF_RUNS)
    if not cut or (runs <= RUNS and sizes.get("block", 0) <= BLOCKS):
        yield {}
        return
    dim, *rest = cut
    size = sizes[dim]
    step = max(1, RUNS // max(1, runs // size))
    if dim == "block":
        step = min(step, BLOCKS)
    for first in range(0, size, step):
        part = slice(first, min(first + step, size))
        for more in slabs({**sizes, dim: part.stop - part.start}, rest):
            yield {dim: part, **more}


def spread(values: xr.Variable | xr.DataArray, dims: Mapping[Any, int] | Sequence[Any]) -> NDArray[Any]:
    """Return values on dimensions in their order, repeated along those that they lack, or of length 1 without sizes."""
    plain = xr.Variable(values.dims, values.values)
    return np.asarray(plain.set_dims(dims).values)  # type: ignore[no-untyped-call]


def sizes_of(runs: xr.Dataset) -> dict[str, int]:
    """Return the sizes by the names of the dimensions."""
    return {str(dim): size for dim, size in runs.sizes.items()}


def gathered(
    of: Callable[[xr.Dataset], xr.Dataset],
    runs: xr.Dataset,
    dims: Sequence[str] = ("block", "model"),
    sizes: Mapping[str, int] | None = None,
) -> xr.Dataset:
    """Apply a function to runs slab by slab, and return its results joined along the dimensions of the slabs.

    The function must keep these dimensions and treat their entries one by one. Coordinates and variables without these
    dimensions are from the first slab. `sizes`: sizes by which slabs are cut, if they differ from the sizes of the
    runs.
    """
    cuts = slabs(sizes_of(runs) if sizes is None else sizes, dims)
    parts = [(where, of(runs.isel(where) if where else runs)) for where in cuts]
    for dim in reversed(dims):  # (slabs of equal bounds along the dimensions before it are joined along this one)
        if any(dim in where for where, _ in parts):
            parts = _joined(parts, dim)
    return parts[0][1]


def _joined(parts: list[tuple[Where, xr.Dataset]], dim: str) -> list[tuple[Where, xr.Dataset]]:
    """Return parts joined along a dimension, which varies faster from part to part than all that are not joined yet."""
    groups = groupby(parts, lambda part: {name: cut for name, cut in part[0].items() if name != dim})
    return [(rest, xr.concat([results for _, results in members], dim, **_AS_THEY_ARE)) for rest, members in groups]


_AS_THEY_ARE: Any = {"data_vars": "minimal", "coords": "minimal", "compat": "override", "join": "exact"}
_AS_THEY_ARE |= {"combine_attrs": "override"}


def put(
    variables: dict[str, xr.Variable],
    part: Mapping[str, xr.Variable],
    where: Where,
    sizes: Mapping[str, int],
    array: Allocator,
) -> None:
    """Write the variables of a slab into the variables of all runs; allocate these with `array` at the first slab."""
    for name, variable in part.items():
        if name not in variables:
            shape = tuple(sizes.get(str(dim), variable.sizes[dim]) for dim in variable.dims)
            variables[name] = xr.Variable(variable.dims, array(shape, variable.dtype), variable.attrs)
        variables[name].data[tuple(where.get(str(dim), slice(None)) for dim in variable.dims)] = variable.values


def in_memory(shape: tuple[int, ...], dtype: Any) -> NDArray[Any]:
    """Return an array in memory, its values not set."""
    return np.empty(shape, dtype)
