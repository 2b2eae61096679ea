"""Runners, which compute chunks of runs: by dask's scheduler of this process, or wherever a `Runner` sends them."""

from __future__ import annotations

import hashlib
import multiprocessing.pool
import signal
import sys
import threading
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from contextlib import contextmanager, nullcontext, suppress
from dataclasses import dataclass
from functools import partial
from queue import Empty, Queue
from typing import TYPE_CHECKING, Any, ClassVar, TypeAlias, TypeVar

import dask.multiprocessing
import dask.threaded
import numpy as np
from dask import config
from dask.base import get_scheduler
from dask.callbacks import Callback
from dask.local import MultiprocessingPoolExecutor, get_async, get_sync
from dask.system import CPU_COUNT
from numpy.typing import NDArray

from ...models.outputs import OUTPUTS
from ...models.runs import TALLY, engine_identity
from ...motions.arrays import digest
from ..numerics.slabs import in_memory
from .plan import LEAST_IN_MEMORY, Chunk, ChunkResult, LeftError, Work, never, plan_chunks, run_chunk, run_part

if TYPE_CHECKING:
    from distributed import Client


class ChunkTask:
    """A chunk of work to be computed: in this process from the work itself, elsewhere from its own data alone."""

    def __init__(self, work: Work, chunk: Chunk, stop: Callable[[], bool] = never) -> None:
        self._work, self._chunk, self._stop = work, chunk, stop

    def __call__(self) -> ChunkResult | None:
        """Compute it; None if the work has been stopped before, or in the middle of a long one."""
        if self._stop():
            return None
        try:
            return run_chunk(self._work, self._chunk, self._stop)
        except LeftError:
            return None

    def __reduce__(self) -> Any:
        work, chunk = self._work, self._chunk
        motions = work.motions[chunk.first : chunk.stop]
        oscillators = tuple(work.oscillators[chunk.row : chunk.row_stop])
        return partial, (
            run_sent,
            engine_identity(),
            (oscillators, motions, work.factors_of(chunk), work.skip, work.outputs),
        )


def run_sent(engine: Mapping[str, str], data: tuple[Any, ...]) -> ChunkResult:
    """Compute a chunk from its data in another process; ValueError if that has another engine than the sender."""
    if difference := engine_difference(engine_identity(), engine):
        raise ValueError(f"a worker {difference}")
    return run_part(*data)


def engine_difference(theirs: Mapping[str, str], ours: Mapping[str, str]) -> str:
    """Return the difference of another process from this one, and its remedy; empty if engines are equal.

    Results of different engines differ in their last digits, and therefore now and then in their outcomes.
    """
    for name, version in ours.items():
        if theirs.get(name) != version:
            remedy = (
                "compile for the same (NUMBA_CPU_NAME=generic everywhere)"
                if name == "processor"
                else "install the same"
            )
            return f"has {name} {theirs.get(name)}, this process {version}: {remedy}"
    return ""


Item = TypeVar("Item")
Result = TypeVar("Result")


def thread_count() -> int:
    """Return the number of threads: dask's `num_workers`, or the processors that this process may use.

    1 if dask is configured to compute in one thread (``scheduler="synchronous"``); ValueError if its configuration
    makes no sense.
    """
    if scheduler() is get_sync:
        return 1
    given = config.get("num_workers", None)
    if given is None:
        return int(CPU_COUNT)
    if isinstance(given, bool) or not isinstance(given, int) or given < 1:
        raise ValueError(f"dask's num_workers must be a whole number of at least 1, got {given!r:.40}")
    return given


def scheduler() -> Callable[..., Any]:
    """Return dask's function that computes a graph: of its configuration, of a default client, else of its threads.

    Within a task of a cluster's worker there is no default client, because that worker would wait for itself.
    ValueError if the configuration names a scheduler that does not exist.
    """
    if config.get("scheduler", None) is None and (_in_worker() or "distributed" not in sys.modules):
        # (dask would load its distributed part to look for a client, which takes a second, although none can be there)
        return dask.threaded.get
    try:
        return get_scheduler() or dask.threaded.get
    except (RuntimeError, ValueError) as error:
        raise ValueError(f"dask's configuration names an unknown scheduler: {error}") from None


def _in_worker() -> bool:
    if "distributed" not in sys.modules:
        return False
    from distributed import get_worker  # noqa: PLC0415 - loaded already

    try:
        get_worker()
    except ValueError:
        return False
    return True


def default_client() -> Client | None:
    """Return the client that dask is configured to compute with, or its default client; None if there is none."""
    client = getattr(scheduler(), "__self__", None)
    return client if hasattr(client, "submit") and hasattr(client, "scheduler") else None


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
WINDOW = 10_000
"""Chunks of a graph: it takes about 2 kB for each, and dask orders it in about 2 s."""
POLL_SECONDS = 0.01
WINDOW_ELSEWHERE = 8
"""Chunks of a graph for each worker outside this process, which cannot be stopped from beginning further chunks."""


class Runner(ABC):
    """Runs chunks of work and returns each chunk once, in the order in which chunks finish.

    `least`: shortest duration of a chunk, s, for `plan_chunks`.
    """

    least: ClassVar[float | None] = None

    @abstractmethod
    def run(self, work: Work, chunks: Sequence[Chunk]) -> Iterator[tuple[Chunk, ChunkResult]]:
        """Yield every chunk with its results."""

    def array(self, shape: tuple[int, ...], dtype: Any) -> NDArray[Any]:
        """Return an array, values not set, for results of all runs: in memory, unless a runner has a better place."""
        return in_memory(shape, dtype)

    def tell(self, what: str, done: int, total: int) -> None:  # noqa: B027 - most runners have nowhere to report it
        """Report the progress of work that is not done in chunks."""

    def refused(self, why: str) -> None:  # noqa: B027 - most runners have nowhere to keep it
        """Take note of why no result can be made of the runs, in a sentence."""

    def reached(self, what: str) -> None:  # noqa: B027 - most runners have nowhere to keep it
        """Keep a sentence on the reached precision of an analysis at adaptive levels."""


Workers: TypeAlias = "Client | Runner | None"
"""Computes the chunks of runs: the client of a cluster, a runner, or dask's configuration (None)."""


@dataclass(frozen=True)
class ConfiguredScheduler(Runner):
    """The scheduler that dask is configured with: threads of this process (the engine does not hold the interpreter
    lock), one thread (``synchronous``), processes, or an executor.

    Once `stop` returns True no chunk is begun. Chunks in flight are returned, except chunks that take several seconds.
    KeyboardInterrupt is then raised.
    """

    stop: Callable[[], bool] = never
    least: ClassVar[float | None] = LEAST_IN_MEMORY

    def run(self, work: Work, chunks: Sequence[Chunk]) -> Iterator[tuple[Chunk, ChunkResult]]:
        """Yield every chunk with its results."""
        with _executor(scheduler()) as (compute, workers, in_process):
            window = WINDOW if in_process else WINDOW_ELSEWHERE * workers
            for first in range(0, len(chunks), window):
                if self.stop():
                    raise KeyboardInterrupt
                yield from _Window(work, chunks[first : first + window], self.stop, compute, workers).results()


MOST_REMEMBERED = 2**28


class Remembered(Runner):
    """The configured scheduler, with the runs of each oscillator under all motions and factors of a call remembered.

    `ran`: number of runs that were not remembered. More than `MOST_REMEMBERED` bytes are forgotten.
    """

    def __init__(self) -> None:
        self._inner = ConfiguredScheduler()
        self._known: dict[str, tuple[NDArray[Any], ...]] = {}
        self.ran = 0

    def run(self, work: Work, chunks: Sequence[Chunk]) -> Iterator[tuple[Chunk, ChunkResult]]:
        """Yield every chunk with its results."""
        if work.factors.shape[0] > 1 or work.runs > MOST_REMEMBERED:
            yield from self._inner.run(work, chunks)
            return
        if sum(array.nbytes for arrays in self._known.values() for array in arrays) > MOST_REMEMBERED:
            self._known.clear()
        keys = _keys(work)
        places = {key: i for i, key in enumerate(keys) if key not in self._known}
        if len(places) == len({*keys}):  # (nothing is known: chunks are passed on one by one)
            yield from self._kept(work, chunks, keys)
            return
        if places:
            new = work._replace(oscillators=[work.oscillators[i] for i in places.values()], per_block=1)
            for _ in self._kept(new, plan_chunks(new), [*places]):
                pass
        for chunk in chunks:
            rows = [self._known[key] for key in keys[chunk.row : chunk.row_stop]]
            motions = slice(chunk.first, chunk.stop)
            results = tuple(np.stack([row[k][:, motions] for row in rows]) for k in range(len(work.outputs)))
            # (of counts, only the samples are known)
            samples = len(rows) * work.levels * sum(motion.acceleration.size for motion in work.motions[motions])
            tally = np.array([samples if name == "samples" else 0 for name in TALLY], np.int64)
            yield chunk, ChunkResult(results, tally)

    def _kept(self, work: Work, chunks: Sequence[Chunk], keys: Sequence[str]) -> Iterator[tuple[Chunk, ChunkResult]]:
        """Yield chunks of the inner runner, and remember each oscillator with runs under all motions."""
        shape = (len(keys), work.levels, len(work.motions))
        arrays = [np.empty(shape, OUTPUTS[name].kind) for name in work.outputs]
        seen = np.zeros(shape[::2], np.bool_)
        for chunk, done in self._inner.run(work, chunks):
            self.ran += done.runs
            rows, motions = slice(chunk.row, chunk.row_stop), slice(chunk.first, chunk.stop)
            for array, values in zip(arrays, done.results, strict=True):
                array[rows, :, motions] = values
            seen[rows, motions] = True
            yield chunk, done
        for i in np.flatnonzero(seen.all(axis=1)).tolist():
            self._known[keys[i]] = tuple(array[i] for array in arrays)


def _keys(work: Work) -> list[str]:
    """Return the key of each oscillator of some work under all its motions and factors."""
    shared = hashlib.sha256(repr((work.skip, work.outputs)).encode())
    shared.update(np.ascontiguousarray(work.factors).tobytes())
    for motion in work.motions:
        shared.update(digest(motion).encode())
    return [f"{shared.hexdigest()} {oscillator!r}" for oscillator in work.oscillators]


class _Window:
    """The graph of some chunks, computed on a thread of its own while the caller takes finished chunks."""

    def __init__(
        self, work: Work, chunks: Sequence[Chunk], stop: Callable[[], bool], compute: Callable[..., Any], workers: int
    ) -> None:
        self._left = False
        self._chunks = chunks
        self._compute = compute
        self._finished: Queue[tuple[int, ChunkResult | None] | BaseException | None] = Queue(AHEAD * workers)

        def left() -> bool:
            return self._left or stop()

        # (tasks by their keys: a function with its arguments)
        self._graph = {("chunk", i): (ChunkTask(work, chunk, left),) for i, chunk in enumerate(chunks)}
        self._thread = threading.Thread(target=self._work, name="toppling-graph", daemon=True)

    def results(self) -> Iterator[tuple[Chunk, ChunkResult]]:
        """Yield every chunk with its results; KeyboardInterrupt if not all were begun."""
        self._thread.start()
        stopped = False
        result: tuple[int, ChunkResult | None] | BaseException | None = (0, None)
        try:
            while (result := self._finished.get()) is not None:
                if isinstance(result, BaseException):
                    raise result
                number, done = result
                if done is None:
                    stopped = True
                else:
                    yield self._chunks[number], done
        finally:
            self._left = True
            ended = result is None or isinstance(result, BaseException)
            while not ended and self._thread.is_alive():  # (the caller takes no more, but there may be no room for it)
                with suppress(Empty):
                    self._finished.get(timeout=POLL_SECONDS)
            self._thread.join()
            # (its tasks hold the motions and, to ask whether to stop, this object: a cycle would be freed late)
            self._graph.clear()
        if stopped:
            raise KeyboardInterrupt

    def _work(self) -> None:
        def begin(graph: Any, state: Any) -> None:
            # (dask would begin them in the order of their names; the last chunks of a plan are the shortest)
            state["ready"].sort(key=lambda key: key[1], reverse=True)

        sent: set[int] = set()

        def finished(key: Any, done: ChunkResult | None, graph: Any, state: Any, worker: Any) -> None:
            state["cache"][key] = None  # (or dask would hold all results until the end)
            sent.add(key[1])
            self._finished.put((key[1], done))

        try:
            # (callbacks that the user has registered, such as dask's progress bar, are called as well)
            looking_on = [*Callback.active, Callback(start_state=begin, posttask=finished)._callback]
            results = self._compute(self._graph, list(self._graph), callbacks=looking_on)
            if len(results) != len(self._chunks):
                raise RuntimeError(f"the scheduler returned {len(results)} of {len(self._chunks)} results")
            for number, done in enumerate(results):
                if number not in sent:  # by a scheduler of the user without callbacks
                    self._finished.put((number, done))
            self._finished.put(None)
        except BaseException as error:
            self._finished.put(error)


@contextmanager
def _executor(compute: Callable[..., Any]) -> Iterator[tuple[Callable[..., Any], int, bool]]:
    """Give dask's function with its workers, their number, and True if they are threads of this process.

    The workers of dask's own choice would be left behind when they are not needed any more.
    """
    pool: Any = config.get("pool", None)
    if isinstance(pool, multiprocessing.pool.Pool):
        pool = MultiprocessingPoolExecutor(pool)
    if pool is not None and not hasattr(pool, "submit"):
        raise ValueError(f"dask's pool must be an executor, which has a method submit, got {type(pool).__name__}")
    if compute is get_sync:
        yield compute, 1, True
    elif compute is dask.threaded.get:
        with ThreadPoolExecutor(thread_count(), "toppling") if pool is None else nullcontext(pool) as threads:
            # (dask's own function begins as many tasks as there are threads, each of which then waits for the next)
            in_process = isinstance(threads, ThreadPoolExecutor)
            yield partial(get_async, threads.submit, AHEAD * thread_count()), thread_count(), in_process
    elif compute is dask.multiprocessing.get:
        workers = thread_count()
        processes_of_study = ProcessPoolExecutor(workers, dask.multiprocessing.get_context(), _ignore_interrupts)
        with processes_of_study if pool is None else nullcontext(pool) as processes:
            yield partial(compute, pool=processes, chunksize=1), workers, False
    else:
        yield compute, thread_count(), False


def _ignore_interrupts() -> None:
    """Leave interrupts, which a terminal sends to all processes of a command, to the one that waits for this one."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
