"""The graph of an analysis for dask: a task for every chunk, and the arrays of outputs made of their results."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from itertools import product
from typing import TYPE_CHECKING, Any
from uuid import uuid4

import numpy as np
from dask.typing import Key
from numpy.typing import NDArray

from ...models.runs import engine_identity
from .plan import OUTPUT_TYPES, Chunk, ChunkResult, Grid, LeftError, Work, never, run_chunk, run_part

if TYPE_CHECKING:
    import dask.array as da

Graph = dict[Key, Any]
"""Tasks by their keys: a function with its arguments, keys and lists of them standing for what these tasks return."""


class ChunkTask:
    """A chunk of work to be computed: in this process from the work itself, elsewhere from its own data alone."""

    def __init__(self, work: Work, chunk: Chunk, stop: Callable[[], bool] = never) -> None:
        self._work, self._chunk, self._stop = work, chunk, stop

    def __call__(self) -> ChunkResult | None:
        """Compute it; None where the work has been stopped before, or in the middle of a long one."""
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
    """Compute a chunk from its data in another process; ValueError where that has another engine than the sender."""
    if difference := engine_difference(engine_identity(), engine):
        raise ValueError(f"a worker {difference}")
    return run_part(*data)


def engine_difference(theirs: Mapping[str, str], ours: Mapping[str, str]) -> str:
    """Return what another process has that this one has not, and what to do about it; empty where engines are equal.

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


def chunk_graph(work: Work, chunks: Sequence[Chunk], name: str, stop: Callable[[], bool] = never) -> Graph:
    """Return a task for every chunk, by the keys (name, number); once `stop` returns True they return None."""
    return {(name, i): (ChunkTask(work, chunk, stop),) for i, chunk in enumerate(chunks)}


def output_arrays(work: Work, grid: Grid, dims: Sequence[int]) -> dict[str, da.Array]:
    """Return the outputs of all runs as arrays of dask, which compute their chunks when they are asked for.

    Parameters
    ----------
    work : Work
    grid : Grid
        The chunks into which the work is divided (`plan_even`).
    dims : sequence of int
        Sizes of the dimensions of the arrays: one or two of the oscillators (the second is `Work.each`), that of the
        levels where the arrays have it, and last that of the motions.

    Returns
    -------
    dict of str to dask.array.Array
        One for each output of the work, all of the same tasks.
    """
    import dask.array as da  # noqa: PLC0415 - slow to load, and most runs are computed at once
    from dask.highlevelgraph import HighLevelGraph  # noqa: PLC0415

    name = f"chunk-{uuid4().hex}"
    tasks = chunk_graph(work, [chunk for cell in grid.chunks for chunk in cell], name)
    numbers = iter(range(len(tasks)))
    cells = [[(name, next(numbers)) for _ in cell] for cell in grid.chunks]
    rows = _chunks_of_rows(work, grid.rows, dims)
    levels = [(size,) for size in dims[len(rows) : -1]]
    motions = tuple(stop - first for first, stop in grid.motions)
    chunks = (*rows, *levels, motions)
    places = list(product(*(range(len(one)) for one in chunks)))
    found = {}
    for output, kind in OUTPUT_TYPES.items():
        if output not in work.outputs:
            continue
        own = f"{output}-{name}"
        number = work.outputs.index(output)
        layer: Graph = {
            (own, *place): (joined, parts, number, tuple(one[i] for one, i in zip(chunks, place, strict=True)))
            for place, parts in zip(places, cells, strict=True)
        }
        graph = HighLevelGraph({name: tasks, own: layer}, {name: set(), own: {name}})
        found[output] = da.Array(graph, own, chunks, kind)
    return found


def joined(parts: Sequence[ChunkResult], number: int, shape: tuple[int, ...]) -> NDArray[Any]:
    """Return an output of the chunks of a cell as an array of a shape."""
    return np.concatenate([one.results[number] for one in parts], axis=2).reshape(shape)


def _chunks_of_rows(work: Work, rows: Sequence[tuple[int, int]], dims: Sequence[int]) -> list[tuple[int, ...]]:
    """Return the chunks along the dimensions of the oscillators."""
    if dims[0] == len(work.oscillators):
        return [tuple(stop - first for first, stop in rows)]
    return [tuple((stop - first) // work.each for first, stop in rows), (work.each,)]
