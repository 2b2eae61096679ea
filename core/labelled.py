"""Labelled arrays without dask's arrays, which xarray would load for the first of them.

For any array that it labels, xarray checks if it is one of dask's, and loads dask's arrays and parts of scipy for it.
This takes up to 0.4 s of CPU time for a simulation of 1 ms. Before dask's arrays are loaded, no array can be one of
them.
"""

import sys
from typing import Any


class _OfDask(type):
    """The type of `DaskArray`."""

    def __instancecheck__(cls, instance: object) -> bool:
        arrays = sys.modules.get("dask.array")
        of_dask = getattr(arrays, "Array", None)  # (none while it is being loaded)
        return of_dask is not None and isinstance(instance, of_dask)


class DaskArray(metaclass=_OfDask):
    """Placeholder for dask's arrays in type checks."""


class _DaskModule:
    """Replacement of xarray's access to dask: it gives only the type of arrays without loading them."""

    type = (DaskArray,)

    def __getattr__(self, name: str) -> Any:
        from xarray.namedarray.pycompat import DuckArrayModule  # noqa: PLC0415 - loads dask's arrays

        return getattr(DuckArrayModule("dask"), name)


def spare_dask() -> None:
    """Let xarray check for dask's arrays without loading them; without effect if this is impossible.

    The knowledge of xarray about dask is in its own table. In a version without this table dask's arrays are loaded.
    """
    try:
        from xarray.namedarray.pycompat import _cached_duck_array_modules as known  # noqa: PLC0415
    except ImportError:
        return
    if isinstance(known, dict):
        known.setdefault("dask", _DaskModule())  # type: ignore[arg-type]
