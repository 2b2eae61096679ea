"""Where chunks run: on threads of this process, or wherever a `Runner` sends them."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from dataclasses import dataclass
from itertools import islice
from typing import TYPE_CHECKING, Any

from numpy.typing import NDArray

from .. import checks
from .plan import Chunk, Done, Work, run_chunk
from .slabs import in_memory
from .threads import thread_count

if TYPE_CHECKING:
    from distributed import Client

AHEAD = 2
"""Chunks begun or waiting for each thread: enough that none waits, so few that memory stays bounded."""


class Runner(ABC):
    """Runs chunks of work and gives each one back once, in the order in which they finish."""

    @abstractmethod
    def run(self, work: Work, chunks: Sequence[Chunk]) -> Iterator[tuple[Chunk, Done]]:
        """Every chunk with its results."""

    def array(self, shape: tuple[int, ...], dtype: Any) -> NDArray[Any]:
        """A place for what is kept of all runs, its values not set: memory, unless a runner knows a better one."""
        return in_memory(shape, dtype)

    def tell(self, what: str, done: int, total: int) -> None:  # noqa: B027 - most have nowhere to say it
        """Take note of how far the work is that is not done in chunks."""


def never() -> bool:
    """Whether to stop: no."""
    return False


@dataclass(frozen=True)
class Threads(Runner):
    """Threads of this process (as many as dask's `num_workers` says, or processors): the engine holds no lock.

    Once `stop` is true no chunk is begun; those in flight are given back, then KeyboardInterrupt is raised.
    """

    stop: Callable[[], bool] = never

    def run(self, work: Work, chunks: Sequence[Chunk]) -> Iterator[tuple[Chunk, Done]]:
        """Every chunk with its results."""
        threads = thread_count()
        waiting = iter(chunks)
        running: dict[Future[Done], Chunk] = {}
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


def runner_of(client: Client | Runner | None) -> Runner:
    """What runs chunks: threads where there is no client; TypeError for anything else."""
    if client is None:
        return Threads()
    if isinstance(client, Runner):
        return client
    if not hasattr(client, "submit") or not hasattr(client, "scheduler"):
        raise TypeError(f"client must be a dask.distributed Client, got {checks.kind(client)}")
    from .cluster import Cluster  # noqa: PLC0415 - the cluster code loads only where there is a cluster

    return Cluster(client)
