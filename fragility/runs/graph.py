"""The graph of an analysis for dask: a task for every chunk."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

from ...models.runs import engine_identity
from .plan import Chunk, ChunkResult, LeftError, Work, never, run_chunk, run_part


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
