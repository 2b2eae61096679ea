"""Results as a netCDF file, by slabs, with Fletcher-32 checksums of chunks that every reading compares."""

from __future__ import annotations

import errno
import math
import os
import signal
import sys
import warnings
from collections.abc import Iterator
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Any

import netCDF4
import numpy as np

from ...core.limits import open_netcdf, opened_netcdf, small_netcdf
from ...core.wording import system_reason
from ..text.error import StudyError

if TYPE_CHECKING:
    import xarray as xr

CHUNK_BYTES = 2**20
"""Size of a chunk in the file, the minimum that is read of a variable of every run."""
SLAB_BYTES = 2**25
"""Size of a slab that is held in memory while a variable is written or checked."""
WHOLE_BYTES = 2**25
"""Size above which variables are read only on request."""


def write(results: xr.Dataset, path: Path) -> None:
    """Write a dataset in another process (on Linux), since HDF5 can end its own; OSError or RuntimeError on failure."""
    if sys.platform != "linux":
        _write(results, path)
        return
    from xarray.backends.netCDF4_ import NETCDF4_PYTHON_LOCK  # noqa: PLC0415 - as labelled arrays

    reading, writing = os.pipe()
    # (no other thread is within the library meanwhile, and in the new process no other thread is)
    with NETCDF4_PYTHON_LOCK, warnings.catch_warnings(action="ignore", category=DeprecationWarning):
        child = os.fork()
    if child == 0:
        failed = 1  # (the reason may be lost, too)
        try:
            _write(results, path)
            failed = 0
        except BaseException as error:
            # (the file was made already: the library says so of whatever a disk refuses)
            reason = "it cannot be opened" if isinstance(error, PermissionError) else system_reason(error)
            os.write(writing, reason.encode())
        finally:
            os._exit(failed)
    os.close(writing)
    try:
        with os.fdopen(reading, encoding="utf-8", errors="replace") as pipe:
            reason = pipe.read()
    except BaseException:
        os.kill(child, signal.SIGKILL)
        raise
    finally:
        ended = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    if reason or ended:
        reason = reason or f"the process that wrote it ended {f'by signal {-ended}' if ended < 0 else 'early'}"
        raise OSError(errno.EIO, f"{reason}; is the disk full?", str(path))


def _write(results: xr.Dataset, path: Path) -> None:
    """Write a dataset by the HDF5 library."""
    # (without the encoding of a file that they were read from; xarray cannot mark names with spaces as coordinates)
    results = results.drop_encoding().reset_coords([name for name in results.coords if " " in str(name)])
    large = [
        name
        for name, variable in results.data_vars.items()
        if _checked(variable.variable) and variable.nbytes > SLAB_BYTES
    ]
    small = results.drop_vars(large)
    encoding = {name: _storage(variable) for name, variable in small.variables.items() if _checked(variable)}
    # `to_netcdf` asks dask if there is a cluster, which loads all of its distributed part; this writes a bit-identical
    # file, but no arrays of dask
    assert all(variable.chunks is None for variable in small.variables.values())
    from xarray.backends import NetCDF4DataStore  # noqa: PLC0415 - a title is read without labelled arrays

    with netCDF4.Dataset(path, "w") as file:
        store = NetCDF4DataStore(file)  # type: ignore[no-untyped-call]
        small.dump_to_store(store, encoding=encoding)
    if large:
        before = netCDF4.get_chunk_cache()
        # (slabs are whole chunks, so the library needs no chunk cache, which takes 16 MB for each variable)
        netCDF4.set_chunk_cache(CHUNK_BYTES, *before[1:])
        try:
            with netCDF4.Dataset(path, "a") as target_file:
                for name in large:
                    _write_slabs(target_file, results[name])
        finally:
            netCDF4.set_chunk_cache(*before)


def _write_slabs(file: netCDF4.Dataset, array: xr.DataArray) -> None:
    flags, dims = array.dtype == np.bool_, [str(dim) for dim in array.dims]
    for dim, size in zip(dims, array.shape, strict=True):
        if dim not in file.dimensions:
            file.createDimension(dim, size)
    stored = file.createVariable(
        str(array.name),
        np.int8 if flags else array.dtype,
        dims,
        fill_value=np.nan if array.dtype.kind == "f" else None,
        **_storage(array.variable),
    )
    coordinates = " ".join(sorted(str(name) for name in array.coords if name not in array.dims))
    stored.setncatts(
        array.attrs | ({"coordinates": coordinates} if coordinates else {}) | ({"dtype": "bool"} if flags else {})
    )
    stored.set_auto_maskandscale(False)
    for where in _slabs_of(array.shape, array.dtype.itemsize):
        stored[where] = array.variable[where].values.astype(stored.dtype, copy=False)


def opened(path: Path) -> xr.Dataset:
    """Open results whose arrays are read when they are used; StudyError for a file that declares more than it has."""
    stored = open_netcdf(
        path, lambda problem: StudyError(f"{path}: {problem}: it is damaged, or no result file; run its study again")
    )
    measures = [name for name in stored.data_vars if " " in str(name)]  # (as "Sa(1.0, 0.02)", which were coordinates)
    if not measures:
        return stored
    named = stored.set_coords(measures)
    named.set_close(stored.close)
    return named


def load_small(stored: xr.Dataset) -> None:
    """Read the small variables into memory; OSError or RuntimeError if the file is damaged."""
    for variable in stored.variables.values():
        if variable.nbytes <= WHOLE_BYTES:
            variable.load()


def title_of(path: Path) -> str:
    """Return the title of a result file without labelled arrays, which load slowly; errors as of `load_small`."""
    file, release = opened_netcdf(path, small_netcdf(path))
    try:
        file.set_auto_maskandscale(False)
        for variable in file.variables.values():
            if variable.size * getattr(variable.dtype, "itemsize", 1) <= WHOLE_BYTES:
                variable[...]
        return str(file.title)
    finally:
        release()
        file.close()


def look_through(stored: xr.Dataset) -> None:
    """Read the large variables once, slab by slab, without keeping them; errors as of `load_small`."""
    for variable in stored.variables.values():
        if variable.nbytes > WHOLE_BYTES:
            for where in _slabs_of(variable.shape, variable.dtype.itemsize):
                variable[where].load()


def _checked(variable: xr.Variable) -> bool:
    return variable.ndim > 0 and variable.size > 0 and variable.dtype.kind in "biuf"


def _storage(variable: xr.Variable) -> dict[str, Any]:
    """The storage options of a variable: chunks that are as whole as possible along its last dimensions."""
    return {"fletcher32": True, "chunksizes": _pieces(variable.shape, variable.dtype.itemsize, CHUNK_BYTES)}


def _pieces(shape: tuple[int, ...], itemsize: int, most: int) -> tuple[int, ...]:
    sizes: list[int] = []
    left = max(1, most // itemsize)
    for size in reversed(shape):
        # (pieces of equal length, or the last one would be stored half empty)
        sizes.append(math.ceil(size / math.ceil(size / min(size, left))))
        left = max(1, left // size)
    return tuple(reversed(sizes))


def _slabs_of(shape: tuple[int, ...], itemsize: int) -> Iterator[tuple[slice, ...]]:
    """Yield the slabs of a variable, in whole chunks of the file."""
    chunk = _pieces(shape, itemsize, CHUNK_BYTES)
    slab = _pieces(shape, itemsize, SLAB_BYTES)
    yield from _cut(shape, tuple(min(size, max(1, b // a) * a) for size, a, b in zip(shape, chunk, slab, strict=True)))


def rows_of(shape: tuple[int, ...], itemsize: int) -> Iterator[tuple[slice, ...]]:
    """Yield slabs of a variable that are one after the other in C order, whatever their size."""
    if math.prod(shape):
        yield from _cut(shape, _pieces(shape, itemsize, SLAB_BYTES))


def _cut(shape: tuple[int, ...], steps: tuple[int, ...]) -> Iterator[tuple[slice, ...]]:
    along = [
        [slice(first, first + step) for first in range(0, size, step)] for size, step in zip(shape, steps, strict=True)
    ]
    yield from product(*along)
