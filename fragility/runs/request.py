"""The request of an analysis and its execution: checked arguments, chunks given to a runner, results put together."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from ... import checks
from ...aliases import Index, Progress
from ...models import Block, Law
from ...models.laws import oscillator_of
from ...models.oscillator import Oscillator
from ...models.runs import TALLY
from ...motions.arrays import Record
from .factors import Factors
from .oscillators import OscillatorGrid
from .plan import OUTPUT_TYPES, Work, plan_chunks
from .runners import ConfiguredScheduler, Runner, default_client

if TYPE_CHECKING:
    from distributed import Client

Labelled = TypeVar("Labelled", Block, Law)

# Outputs that are derived from the block and outputs of the engine.
DERIVED = {
    "top_displacement": ("peak_rotation",),
    "restraint_force": ("peak_front", "peak_back", "ruptured"),
}
OUTPUTS = (*OUTPUT_TYPES, *DERIVED)
"""Outputs that a run can have."""


class Request(NamedTuple):
    """The checked arguments of an analysis: blocks, laws, the outputs of a run, and how the runs are computed."""

    blocks: list[Block]
    models: list[Law]
    outputs: list[str]
    skip: bool
    runner: Runner
    progress: Progress | None
    screen: bool
    compute: bool = True

    @property
    def oscillators(self) -> OscillatorGrid[Block]:
        """The oscillators block by block, those of all laws for each block."""
        laws = self.models
        return OscillatorGrid(self.blocks, lambda block: [oscillator_of(block, law) for law in laws], len(laws))


class Runs(NamedTuple):
    """Outputs (oscillator, level, motion) by name, and the engine's counts (`models.runs.TALLY`)."""

    results: dict[str, NDArray[Any]]
    tally: Index

    @property
    def skipped(self) -> dict[str, float]:
        """The counts as shares of all samples, and the number of events per run."""
        counts = dict(zip(TALLY, self.tally.tolist(), strict=True))
        samples = counts.pop("samples")
        events = counts.pop("events")
        runs = next(iter(self.results.values())).size
        return {
            "samples": samples,
            **{f"share_{reason}": round(count / samples, 6) for reason, count in counts.items()},
            "events_per_run": round(events / runs, 3),
        }


def check_request(
    blocks: Block | Sequence[Block],
    models: Law | Sequence[Law],
    outputs: Sequence[str],
    skip: bool,
    client: Client | Runner | None,
    progress: Progress | None,
    screen: bool = False,
    compute: bool = True,
) -> Request:
    """Check the arguments that all analyses share; TypeError or ValueError where one is wrong."""
    names = [outputs] if isinstance(outputs, str) else list(outputs)
    if not names:
        raise ValueError(f"outputs must name at least one of {', '.join(OUTPUTS)}, got none")
    wanted = list(dict.fromkeys(checks.choice("outputs", name, OUTPUTS) for name in names))
    for name, value in (("skip", skip), ("screen", screen), ("compute", compute)):
        if not isinstance(value, bool):
            raise TypeError(f"{name} must be True or False, got {value!r:.40}")
    return Request(
        labelled_sequence("blocks", blocks, Block),
        labelled_sequence("models", models, Law),  # type: ignore[type-abstract]
        wanted,
        skip,
        runner_of(client),
        progress,
        screen,
        compute,
    )


def work_of(
    oscillators: Sequence[Oscillator], motions: Sequence[Record], factors: Factors, request: Request, each: int = 1
) -> Work:
    """Return the work of a request: every oscillator under factors (block, level, motion; see `Work`) times motions."""
    names = tuple(dict.fromkeys(own for name in request.outputs for own in DERIVED.get(name, (name,))))
    return Work(oscillators, tuple(motions), factors, request.skip, names, each)


def collect(work: Work, runner: Runner, progress: Progress | None) -> Runs:
    """Do the work in chunks and put the results together."""
    shape = (len(work.oscillators), work.levels, len(work.motions))
    results = {name: runner.array(shape, OUTPUT_TYPES[name]) for name in work.outputs}
    tally = np.zeros(len(TALLY), np.int64)
    so_far = 0
    for chunk, done in runner.run(work, plan_chunks(work)):
        for array, part in zip(results.values(), done.results, strict=True):
            array[chunk.row : chunk.row_stop, :, chunk.first : chunk.stop] = part
        tally += done.tally
        so_far += done.runs
        if progress is not None:
            progress(so_far, work.runs)
    return Runs(results, tally)


def labelled_sequence(name: str, values: Any, kind: type[Labelled]) -> list[Labelled]:
    """Return blocks (or laws) as a list; TypeError for other types, ValueError for equal labels or none."""
    found = [values] if isinstance(values, kind) else list(values) if isinstance(values, Iterable) else [values]
    if not found:
        raise ValueError(f"{name} must hold at least one, got none")
    for value in found:
        if not isinstance(value, kind):
            raise TypeError(f"{name} must be one {kind.__name__} or a sequence of them, got {checks.kind(value)}")
    taken: set[str] = set()
    for value in found:
        if value.label in taken:
            raise ValueError(f"{name} must have unique labels, got {value.label!r} more than once")
        taken.add(value.label)
    return found


def runner_of(client: Client | Runner | None) -> Runner:
    """Return the runner of a client: where there is none, what dask is configured to use; TypeError for other types."""
    if client is None:
        client = default_client()
    if client is None:
        return ConfiguredScheduler()
    if isinstance(client, Runner):
        return client
    if not hasattr(client, "submit") or not hasattr(client, "scheduler"):
        raise TypeError(f"client must be a dask.distributed Client, got {checks.kind(client)}")
    from .cluster import Cluster  # noqa: PLC0415 - the cluster code loads only where there is a cluster

    return Cluster(client)
