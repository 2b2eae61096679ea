"""Compiled functions: numba's decorator, and a disk cache that watches a whole folder of sources.

A folder of kernels holds functions that call each other across its files, take and return plain numbers and arrays, and
import nothing of the package but this module and themselves.  numba stamps a cached function by the one file that holds
it, so a change in a callee of another file would go unnoticed (numba issue 1833); here the stamp covers all sources of
the folder, and this module.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

from numba import njit
from numba.core.caching import FunctionCache, IndexDataCacheFile
from numba.core.dispatcher import Dispatcher


@cache
def folder_stamp(folder: Path) -> str:
    """Return a digest of all sources of a folder, by name and contents, and of this module, which sets the options."""
    digest = hashlib.sha256(Path(__file__).read_bytes())
    for file in sorted(folder.glob("*.py")):
        source = file.read_bytes()
        digest.update(f"{file.name} {len(source)}\n".encode() + source)
    return digest.hexdigest()


class FolderCache(FunctionCache):
    """numba's disk cache of a function, stamped by its folder; numba chooses where the files lie."""

    def __init__(self, function: Callable[..., Any]) -> None:
        super().__init__(function)  # type: ignore[no-untyped-call]
        stamp = folder_stamp(Path(function.__code__.co_filename).parent)
        self._cache_file = IndexDataCacheFile(  # type: ignore[no-untyped-call]
            self.cache_path, self._impl.filename_base, stamp
        )


def kernel(*, keep: bool = False, **options: Any) -> Callable[[Callable[..., Any]], Any]:
    """`numba.njit` without the global interpreter lock and with numpy's rules of division.

    `keep` stores the compiled function on disk: for the kernels that Python calls.  What only other kernels call is
    compiled into those and needs no file of its own.  The other options are numba's.
    """

    def compiled(function: Callable[..., Any]) -> Any:
        dispatcher = njit(**{"nogil": True, "error_model": "numpy", **options})(function)
        if keep and isinstance(dispatcher, Dispatcher):  # with NUMBA_DISABLE_JIT=1 it is the function itself
            dispatcher._cache = FolderCache(function)  # type: ignore[attr-defined]
        return dispatcher

    return compiled
