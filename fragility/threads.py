"""Threads of this process: how many, and work that is shared between them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

from dask import config
from dask.system import CPU_COUNT

Item = TypeVar("Item")
Result = TypeVar("Result")


def thread_count() -> int:
    """As many as dask's `num_workers` says, or processors that this process may use."""
    return int(config.get("num_workers", None) or CPU_COUNT)


def shared(of: Callable[[Item], Result], items: Sequence[Item]) -> Iterator[Result]:
    """What `of` makes of each, in their order, made on threads; nothing more is begun once the reader stops."""
    workers = min(thread_count(), len(items))
    if workers < 2:
        yield from map(of, items)
        return
    with ThreadPoolExecutor(workers, "toppling") as pool:
        yield from pool.map(of, items)
