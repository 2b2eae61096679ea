"""Running what an analysis asks for: arguments checked, chunks on threads or on a cluster, results put together."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

import numpy as np
from dask.base import compute
from dask.callbacks import Callback
from dask.delayed import delayed
from numpy.typing import NDArray

from .. import checks
from ..models import Block, Law
from ..models.oscillator import Oscillator
from ..models.runs import TALLY
from ..models.simulate import oscillator_of
from ..motions.arrays import Record
from .plan import OUTPUT_TYPES, Chunk, Done, plan_chunks, run_chunk

if TYPE_CHECKING:
    from distributed import Client

Progress = Callable[[int, int], None]
Labelled = TypeVar("Labelled", Block, Law)

# Outputs that follow from one of the engine's and the block.
DERIVED = {"top_displacement": "peak_rotation"}
OUTPUTS = (*OUTPUT_TYPES, *DERIVED)
"""What can be asked of a run."""


class Request(NamedTuple):
    """What an analysis was asked for, checked: blocks x laws, the outputs wanted of a run, and how to run."""

    blocks: list[Block]
    models: list[Law]
    outputs: list[str]
    skip: bool
    client: Client | None
    progress: Progress | None

    @property
    def oscillators(self) -> list[Oscillator]:
        """Block by block, every law of each."""
        return [oscillator_of(block, model) for block in self.blocks for model in self.models]


class Runs(NamedTuple):
    """Outputs (oscillator, level, motion) by name, and the engine's counts (`models.runs.TALLY`)."""

    results: dict[str, NDArray[Any]]
    tally: NDArray[np.int64]

    @property
    def skipped(self) -> dict[str, float]:
        """The counts as shares of all samples, and events a run."""
        counts = dict(zip(TALLY, self.tally.tolist(), strict=True))
        samples = counts.pop("samples")
        events = counts.pop("events")
        runs = next(iter(self.results.values())).size
        return {
            "samples": samples,
            **{f"share_{reason}": round(count / samples, 6) for reason, count in counts.items()},
            "events_per_run": round(events / runs, 3),
        }


def request(
    blocks: Block | Sequence[Block],
    models: Law | Sequence[Law],
    outputs: Sequence[str],
    skip: bool,
    client: Client | None,
    progress: Progress | None,
) -> Request:
    """The arguments that all analyses share; TypeError or ValueError where one is wrong."""
    names = [outputs] if isinstance(outputs, str) else list(outputs)
    if not names:
        raise ValueError(f"outputs must name at least one of {', '.join(OUTPUTS)}, got none")
    wanted = list(dict.fromkeys(checks.choice("outputs", name, OUTPUTS) for name in names))
    if not isinstance(skip, bool):
        raise TypeError(f"skip must be True or False, got {skip!r:.40}")
    if client is not None and not hasattr(client, "compute"):
        raise TypeError(f"client must be a dask.distributed Client, got {checks.kind(client)}")
    return Request(
        labelled_sequence("blocks", blocks, Block),
        labelled_sequence("models", models, Law),  # type: ignore[type-abstract]
        wanted,
        skip,
        client,
        progress,
    )


def execute(
    oscillators: Sequence[Oscillator], motions: Sequence[Record], factors: NDArray[np.float64], asked: Request
) -> Runs:
    """Every oscillator under factors (block, level, motion; see `Chunk`) times the motions."""
    names = list(dict.fromkeys(DERIVED.get(name, name) for name in asked.outputs))
    chunks = plan_chunks(oscillators, motions, factors, asked.skip, names)
    results = {name: np.empty((len(oscillators), *factors.shape[1:]), OUTPUT_TYPES[name]) for name in names}
    tally = np.zeros(len(TALLY), np.int64)
    for chunk, done in zip(chunks, run_chunks(chunks, asked.client, asked.progress), strict=True):
        for name, part in zip(names, done.results, strict=True):
            results[name][:, :, chunk.first : chunk.stop] = part
        tally += done.tally
    return Runs(results, tally)


def run_chunks(chunks: Sequence[Chunk], client: Client | None, progress: Progress | None) -> list[Done]:
    """Run the chunks on threads here or on a cluster, results in the order of the chunks."""
    total = sum(chunk.runs for chunk in chunks)
    tasks = [delayed(run_chunk, pure=False)(delayed(chunk, traverse=False)) for chunk in chunks]
    if client is not None:
        from distributed import as_completed  # noqa: PLC0415 - the cluster code loads only where there is a cluster

        futures = client.compute(tasks)
        done = 0
        sizes = {future.key: chunk.runs for future, chunk in zip(futures, chunks, strict=True)}
        for future in as_completed(futures, loop=client.loop):
            future.result()
            done += sizes[future.key]
            if progress is not None:
                progress(done, total)
        return list(client.gather(futures))
    with _ThreadProgress(total, progress):
        return list(compute(*tasks, scheduler="threads"))


class _ThreadProgress(Callback):
    """Counts finished runs by the number of results in each finished task."""

    def __init__(self, total: int, progress: Progress | None) -> None:
        super().__init__()  # type: ignore[no-untyped-call]
        self._total = total
        self._done = 0
        self._progress = progress

    def _posttask(self, key: Any, result: Any, dsk: Any, state: Any, worker_id: Any) -> None:
        if self._progress is not None and isinstance(result, Done):
            self._done += result.runs
            self._progress(self._done, self._total)


def labelled_sequence(name: str, values: Any, kind: type[Labelled]) -> list[Labelled]:
    """One or several blocks (or laws) as a list; TypeError for anything else, ValueError for none or equal labels."""
    found = [values] if isinstance(values, kind) else list(values) if isinstance(values, Iterable) else [values]
    if not found:
        raise ValueError(f"{name} must hold at least one, got none")
    for value in found:
        if not isinstance(value, kind):
            raise TypeError(f"{name} must be one {kind.__name__} or a sequence of them, got {checks.kind(value)}")
    labels = [value.label for value in found]
    for label in labels:
        if labels.count(label) > 1:
            raise ValueError(f"{name} must have unique labels, got {label!r} more than once")
    return found
