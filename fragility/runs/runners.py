"""Runners, which compute chunks of runs: on threads of this process, or wherever a `Runner` sends them."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from dataclasses import dataclass
from itertools import islice
from typing import Any, TypeVar

from dask import config
from dask.system import CPU_COUNT
from numpy.typing import NDArray

from ..numerics.slabs import in_memory
from .plan import Chunk, ChunkResult, Work, run_chunk

Item = TypeVar("Item")
Result = TypeVar("Result")


def thread_count() -> int:
    """Return the number of threads: dask's `num_workers`, or the processors that this process may use."""
    return int(config.get("num_workers", None) or CPU_COUNT)


def shared(of: Callable[[Item], Result], items: Sequence[Item]) -> Iterator[Result]:
    """Yield `of` of each item, in order, computed on threads; no further item is begun once the reader stops."""
    workers = min(thread_count(), len(items))
    if workers < 2:
        yield from map(of, items)
        return
    with ThreadPoolExecutor(workers, "toppling") as pool:
        yield from pool.map(of, items)


AHEAD = 2
"""Chunks begun or waiting for each thread: enough that no thread is idle, few enough that memory stays bounded."""


class Runner(ABC):
    """Runs chunks of work and returns each chunk once, in the order in which chunks finish."""

    @abstractmethod
    def run(self, work: Work, chunks: Sequence[Chunk]) -> Iterator[tuple[Chunk, ChunkResult]]:
        """Yield every chunk with its results."""

    def array(self, shape: tuple[int, ...], dtype: Any) -> NDArray[Any]:
        """Return an array, values not set, for results of all runs: in memory, unless a runner has a better place."""
        return in_memory(shape, dtype)

    def tell(self, what: str, done: int, total: int) -> None:  # noqa: B027 - most runners have nowhere to report it
        """Report the progress of work that is not done in chunks."""


def never() -> bool:
    """Return False: the runs are never to be stopped."""
    return False


@dataclass(frozen=True)
class Threads(Runner):
    """Threads of this process (dask's `num_workers`, or the processors): the engine does not hold the interpreter lock.

    Once `stop` returns True no chunk is begun; chunks in flight are returned, then KeyboardInterrupt is raised.
    """

    stop: Callable[[], bool] = never

    def run(self, work: Work, chunks: Sequence[Chunk]) -> Iterator[tuple[Chunk, ChunkResult]]:
        """Yield every chunk with its results."""
        threads = thread_count()
        waiting = iter(chunks)
        running: dict[Future[ChunkResult], Chunk] = {}
        left = len(chunks)
        with ThreadPoolExecutor(threads, "toppling") as pool:

            def begin(n: int) -> None:
                running.update({pool.submit(run_chunk, work, chunk): chunk for chunk in islice(waiting, n)})

            try:
                begin(0 if self.stop() else AHEAD * threads)
                while running:
                    finished, _ = wait(running, return_when=FIRST_COMPLETED)
                    for future in finished:
                        chunk = running.pop(future)
                        if not self.stop():
                            begin(1)
                        left -= 1
                        yield chunk, future.result()
                    if self.stop():
                        for future in [one for one in running if one.cancel()]:
                            del running[future]
            finally:
                for future in running:
                    future.cancel()
        if left:
            raise KeyboardInterrupt
