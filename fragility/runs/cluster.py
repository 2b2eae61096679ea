"""Execution of chunks on a dask.distributed cluster.

Oscillators and motions are sent once, not with every chunk. They are results of small tasks, which the cluster repeats
if the worker with a result is lost. Motions that workers can make themselves are not sent. The scheduler is given only
enough chunks to keep the workers busy, whatever their total number.

Scheduler and client often share the cores with the workers, and their work grows with the number of messages.
Therefore chunks are sent, and results fetched, several at a time, and data that dask need not inspect is sent as bytes.
"""

from __future__ import annotations

import hashlib
import pickle
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cache, cached_property
from itertools import islice
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import TYPE_CHECKING, Any, NamedTuple

import dask
import numpy as np

from ...models.runs import Specimen, engine_identity
from ...motions.arrays import Record, digest
from .plan import Chunk, ChunkResult, Work, never, run_part
from .runners import AHEAD, Runner, engine_difference

if TYPE_CHECKING:
    from distributed import Client, Future

PARCEL_BYTES = 4_000_000
"""Size of the parcels in which motions are sent, about."""
TOGETHER_SECONDS = 0.1
"""Longest time that a finished chunk waits for others, as many as there are threads, to be fetched together, s."""
NEWS_SECONDS = 5.0
"""Time without a finished chunk after which the state of the cluster is checked, s."""
WORKERS_WITHIN = 30.0
"""Time within which a cluster must have its first worker, or another worker after the last was lost, s."""


class ClusterError(RuntimeError):
    """Error of a cluster that cannot do the work, or can no longer do it; the message is one sentence."""


@dataclass(frozen=True)
class Remake:
    """A function with which a worker makes motions itself, which can be pickled, and known digests of these motions."""

    function: Callable[[], list[Record]]
    known: frozenset[str]

    def gives(self, digests: Sequence[str]) -> bool:
        """Return True if the function makes all motions of these digests; it is called only if that is not known."""
        return self.known.issuperset(digests) or self._all.issuperset(digests)

    @cached_property
    def _all(self) -> frozenset[str]:
        return frozenset(digest(motion) for motion in self.function())


@dataclass(frozen=True)
class Cluster(Runner):
    """Runner on the workers of a client.

    `remake`: instructions with which workers make motions themselves, if they can. Once `stop` returns True no chunk is
    begun; chunks in flight are returned, then KeyboardInterrupt is raised.
    """

    client: Client
    remake: Remake | None = None
    stop: Callable[[], bool] = never

    def run(self, work: Work, chunks: Sequence[Chunk]) -> Iterator[tuple[Chunk, ChunkResult]]:
        """Yield every chunk with its results; ClusterError if the cluster cannot compute it."""
        if not chunks:
            return
        from distributed.comm.core import CommClosedError  # noqa: PLC0415 - loaded where there is a cluster

        running: dict[Future[Any], Chunk] = {}
        try:
            check_workers(self.client)
            yield from self._run(_SentWork(self.client, work, self.remake), chunks, running)
        except (CommClosedError, ConnectionError):
            raise _lost(self.client) from None
        finally:
            if running and self.client.status == "running":
                with suppress(CommClosedError, ConnectionError):
                    self.client.cancel(list(running))

    def _run(
        self, sent: _SentWork, chunks: Sequence[Chunk], running: dict[Future[Any], Chunk]
    ) -> Iterator[tuple[Chunk, ChunkResult]]:
        waiting = iter(chunks)
        news: SimpleQueue[Future[Any]] = SimpleQueue()
        threads = _ThreadCount(self.client)
        finished: list[Future[Any]] = []
        left = len(chunks)
        while left:
            # chunks that replace finished chunks are sent first, so that no worker waits while results are fetched
            room = 0 if self.stop() else AHEAD * threads.count() + 1 - (len(running) - len(finished))
            begun = list(islice(waiting, max(room, 0)))
            for future, chunk in zip(sent.submit(begun), begun, strict=True):
                running[future] = chunk
                future.add_done_callback(news.put)
            if not running:
                raise KeyboardInterrupt
            for future, done in zip(finished, _gathered(finished, self.client), strict=True):
                left -= 1
                yield running.pop(future), done
            finished = _finished(news, threads, len(running)) if running else []


@cache
def worker_identity() -> dict[str, str]:
    """Return the identity of the engine and of the sources around it, which are the same on all machines of a study."""
    files = sorted(Path(__file__).parent.glob("*.py"))
    sources = hashlib.sha256(b"".join(file.read_bytes() for file in files)).hexdigest()[:12]
    return {**engine_identity(), "sources": sources}


def check_workers(client: Client) -> None:
    """Wait for a worker; ClusterError if no worker connects, or if one has another engine than this process."""
    try:
        client.wait_for_workers(1, timeout=WORKERS_WITHIN)
    except TimeoutError:
        raise ClusterError(f"{_address(client)}: no worker within {WORKERS_WITHIN:.0f} s") from None
    for address, theirs in sorted(client.run(worker_identity, on_error="return").items()):
        if isinstance(theirs, ModuleNotFoundError):
            raise ClusterError(f"{_address(client)}: a worker does not have the package {theirs.name}")
        # (what a worker of before lacks comes as a plain exception)
        if isinstance(theirs, ImportError | AttributeError) or type(theirs) is Exception:
            raise ClusterError(f"{_address(client)}: a worker has another version of the package ({theirs})")
        if isinstance(theirs, OSError):  # (a worker that was lost as it was asked: its chunks go to the others)
            continue
        if isinstance(theirs, BaseException):
            raise theirs
        _check_engine(address, theirs, worker_identity())


class _SentWork:
    """The data that chunks need, each sent once: oscillators in the groups of the plan, motions in parcels."""

    def __init__(self, client: Client, work: Work, remake: Remake | None) -> None:
        self._client = client
        self._work = work
        self._oscillators: tuple[tuple[int, int], Future[Any]] | None = None
        self._motions: dict[int, Future[Any]] = {}
        self._made: _MadeMotions | None = None
        self._source: Future[Any] | None = None
        names = [digest(motion) for motion in work.motions]
        if remake is not None and remake.gives(names):
            self._made = _MadeMotions(remake.function, tuple(map(bytes.fromhex, names)))
        sizes = np.cumsum([0, *(motion.acceleration.nbytes for motion in work.motions)])
        self._parcels = np.searchsorted(sizes, np.arange(0, sizes[-1], PARCEL_BYTES)).tolist()
        self._parcels.append(len(work.motions))

    def submit(self, chunks: Sequence[Chunk]) -> list[Future[Any]]:
        """Submit chunks as tasks of the cluster."""
        if not chunks:
            return []
        arguments = [(self._rows(chunk), *self._shakes(chunk)) for chunk in chunks]
        rows, sources, places = zip(*arguments, strict=True)
        tasks = [
            pickle.dumps(
                (place, self._work.factors_of(chunk), self._work.skip, self._work.outputs, worker_identity()),
                pickle.HIGHEST_PROTOCOL,
            )
            for chunk, place in zip(chunks, places, strict=True)
        ]
        with dask.config.set({"distributed.admin.large-graph-warning-threshold": "1GB"}):
            return self._client.map(_run_part, rows, sources, tasks, pure=False)

    def _once(self, value: Any) -> Future[Any]:
        with dask.config.set({"distributed.admin.large-graph-warning-threshold": "1GB"}):
            return self._client.submit(_loaded, pickle.dumps(value, pickle.HIGHEST_PROTOCOL), pure=False)

    def _rows(self, chunk: Chunk) -> Future[Any]:
        rows = (chunk.row, chunk.row_stop)
        if self._oscillators is None or self._oscillators[0] != rows:
            self._oscillators = rows, self._once(self._work.oscillators[slice(*rows)])
        return self._oscillators[1]

    def _shakes(self, chunk: Chunk) -> tuple[list[Future[Any]], list[int]]:
        """Futures with the motions of a chunk (their maker, or parcels), and the positions of the motions there."""
        if self._made is not None:
            self._source = self._source or self._once(self._made)
            return [self._source], list(range(chunk.first, chunk.stop))
        low = int(np.searchsorted(self._parcels, chunk.first, side="right")) - 1
        high = int(np.searchsorted(self._parcels, chunk.stop, side="left"))
        for k in range(low, high):
            if k not in self._motions:
                self._motions[k] = self._once(self._work.motions[self._parcels[k] : self._parcels[k + 1]])
        before = self._parcels[low]
        return [self._motions[k] for k in range(low, high)], list(range(chunk.first - before, chunk.stop - before))


class _MadeMotions(NamedTuple):
    """Motions that a worker makes itself: the function that makes them, and the digests of those needed, in order."""

    function: Callable[[], list[Record]]
    digests: tuple[bytes, ...]


_making = threading.Lock()
_latest: dict[tuple[bytes, ...], list[Record]] = {}


def _run_part(oscillators: Sequence[Specimen], sources: list[_MadeMotions | tuple[Record, ...]], task: bytes) -> bytes:
    """Compute a chunk on a worker."""
    places, factors, skip, outputs, engine = pickle.loads(task)
    _check_engine("a worker", worker_identity(), engine)
    motions = [
        motion for source in sources for motion in (_motions_of(source) if isinstance(source, _MadeMotions) else source)
    ]
    done = run_part(oscillators, [motions[i] for i in places], factors, skip, outputs)
    return pickle.dumps(done, pickle.HIGHEST_PROTOCOL)


def _motions_of(made: _MadeMotions) -> list[Record]:
    """Return the motions, made once in this process (the latest set is kept)."""
    with _making:
        if made.digests not in _latest:
            motions = {bytes.fromhex(digest(motion)): motion for motion in made.function()}
            if not motions.keys() >= set(made.digests):
                raise ClusterError(
                    "a worker makes other motions from the same seeds than this machine: use machines of one kind "
                    "with the same packages"
                )
            _latest.clear()
            _latest[made.digests] = [motions[name] for name in made.digests]
        return _latest[made.digests]


def _loaded(content: bytes) -> Any:
    return pickle.loads(content)


def _check_engine(who: str, theirs: dict[str, str], ours: dict[str, str]) -> None:
    if difference := engine_difference(theirs, ours):
        raise ClusterError(f"{who} {difference}")


class _ThreadCount:
    """Number of threads of the workers, updated from time to time; ClusterError if no worker is left."""

    def __init__(self, client: Client) -> None:
        self.client = client
        self._count = 0
        self._asked = self._seen = time.monotonic() - NEWS_SECONDS

    def count(self) -> int:
        """Return the number of threads of all workers, at least 1."""
        now = time.monotonic()
        if now - self._asked >= NEWS_SECONDS:
            self._asked = now
            if self.client.status != "running":
                raise _lost(self.client)
            self._count = sum(self.client.nthreads().values())
            if self._count:
                self._seen = now
            elif now - self._seen > WORKERS_WITHIN:
                raise ClusterError(f"{_address(self.client)}: no worker is left")
        return max(1, self._count)


def _finished(news: SimpleQueue[Future[Any]], threads: _ThreadCount, running: int) -> list[Future[Any]]:
    """Wait for at least one finished chunk and others that finish soon; ClusterError if no worker is left."""
    finished: list[Future[Any]] = []
    while not finished:
        try:
            finished.append(news.get(timeout=NEWS_SECONDS))
        except Empty:
            threads.count()
    ends = time.monotonic() + TOGETHER_SECONDS
    enough = min(threads.count(), running)
    with suppress(Empty):
        while len(finished) < enough:
            finished.append(news.get(timeout=max(0.0, ends - time.monotonic())))
    while not news.empty():
        finished.append(news.get())
    return finished


def _gathered(futures: list[Future[Any]], client: Client) -> list[ChunkResult]:
    if not futures:
        return []
    from distributed import CancelledError, KilledWorker  # noqa: PLC0415 - loaded where there is a cluster

    try:
        results: list[bytes] = client.gather(futures)
    except KilledWorker:
        raise ClusterError(
            f"{_address(client)}: one chunk killed several workers, one after the other (out of memory?)"
        ) from None
    except CancelledError:
        raise _lost(client) from None
    except ImportError as error:
        raise ClusterError(f"{_address(client)}: a worker lacks what it needs ({error})") from None
    return [pickle.loads(result) for result in results]


def _lost(client: Client) -> ClusterError:
    return ClusterError(f"the scheduler at {_address(client)} is gone")


def _address(client: Client) -> str:
    return str(client.scheduler.address if client.scheduler is not None else client)
