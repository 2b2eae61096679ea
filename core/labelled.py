"""Labelled arrays without dask's arrays, which xarray would load for the first of them.

For any array that it labels, xarray asks whether it is one of dask's, and loads those, with parts of scipy, to ask: up
to 0.4 s of CPU time for a simulation of 1 ms.  As long as nobody has loaded dask's arrays, no array can be one of them.
"""

from __future__ import annotations

import sys
from typing import Any


class _OfDask(type):
    """The type of `DaskArray`."""

    def __instancecheck__(cls, instance: object) -> bool:
        arrays = sys.modules.get("dask.array")
        of_dask = getattr(arrays, "Array", None)  # (none while it is being loaded)
        return of_dask is not None and isinstance(instance, of_dask)


class DaskArray(metaclass=_OfDask):
    """Stands for dask's arrays in a question whether something is one of them."""


class _DaskModule:
    """Stands in xarray for its knowledge of dask: only that of the type of arrays is given without loading them."""

    type = (DaskArray,)

    def __getattr__(self, name: str) -> Any:
        from xarray.namedarray.pycompat import DuckArrayModule  # noqa: PLC0415 - loads dask's arrays

        return getattr(DuckArrayModule("dask"), name)


def spare_dask() -> None:
    """Let xarray ask whether an array is one of dask's without loading those; without effect where it cannot be done.

    xarray keeps what it knows of dask in a table of its own.  In a version without this table dask's arrays are loaded.
    """
    try:
        from xarray.namedarray.pycompat import _cached_duck_array_modules as known  # noqa: PLC0415
    except ImportError:
        return
    if isinstance(known, dict):
        known.setdefault("dask", _DaskModule())  # type: ignore[arg-type]
