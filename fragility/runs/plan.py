"""Division of the runs of an analysis into chunks, and the execution of one chunk: shared by `ida` and study stores.

A chunk is a slice of oscillators x a slice of motions x all factors. Its bounds depend on the sizes of the analysis
alone, never on the machine, so that a resumed study writes bit-identical files. Results depend neither on the bounds
nor on the machine. The last chunks become smaller and smaller, so that workers finish at about the same time, whatever
their number.
"""

import math
from collections.abc import Callable, Iterable, Sequence
from itertools import islice, pairwise
from time import perf_counter
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...core.aliases import Array, Index
from ...models import Block
from ...models.laws import Model, refuse_endless
from ...models.oscillator import Oscillator, Stack
from ...models.outputs import COLUMNS, OF_ENGINE, OUTPUTS
from ...models.runs import ENOUGH_OF_ONE, TALLY, Specimen, run_mixed, run_specimens, stacked
from ...models.sliding.law import PlaneSlider
from ...motions.arrays import Record
from .factors import BlockFactors, Factors, dense
from .oscillators import OscillatorGrid

# Planning figures, on the generous side of benchmarks/speed.py: one sample of one run on a present core, closed form
# and exact geometry.
SECONDS_PER_SAMPLE = 4e-9
SECONDS_PER_EXACT_SAMPLE = 1.5e-8
SECONDS_PER_PIECE = 2e-7
"""Of an elastic zone so stiff that a sample is solved in pieces (`models.laws.refuse_endless`)."""
MOST_CASES = 1000
"""Number of first blocks under laws whose zones are examined before the runs."""
SECONDS_PER_PLANE_SAMPLE = 6e-7
"""Of a block that slides under both horizontal components."""
CHUNK_SECONDS = 1.0
# A small analysis is divided more finely, so that every thread has work, but not so finely that storing chunks takes a
# noticeable time.
FEWEST_CHUNKS = 64
LEAST_SECONDS = 0.2
LEAST_IN_MEMORY = 0.03
"""The same of results that are not stored."""
LEAST_OF_A_WAVE = 0.02
"""The same of one wave of several that wait for each other: threads would be idle in every one of them."""
# Chunks decrease in size (guided self-scheduling: Polychronopoulos & Kuck 1987) over the last quarter of the work, but
# over no more than the work of 64 chunks. List scheduling of these chunks on 1 to 64 threads takes no longer than with
# equal chunks, to within the smallest chunk. It wastes 3 % instead of 12 % of 64 threads on five minutes of work.
FALLING_SHARE = 0.25
MOST_FALLING = 64
LEAST_PART = 1 / 8
MOST_CHUNKS = 100_000
"""Maximum number of chunks, set by the capacity of a scheduler and a folder; more work makes larger chunks."""
# Runs of one motion that share its samples. They must fill all lanes of the engine, but a chunk of one second must
# contain several motions, and few oscillators to send.
FEWEST_TOGETHER = 512
MOST_TOGETHER = 4096
LONGEST = 4.0
"""Maximum duration of fewer such runs, as a multiple of a chunk's: long motions, and zones that are solved in pieces.
"""
PART_SECONDS = 1.0
"""Planned duration of runs that are given to the engine at once: chunks of several such parts can be left."""
# Runs of several motions that are given to the engine in one list: their results take 120 bytes each for a moment.
MOST_MIXED = 16384


class Chunk(NamedTuple):
    """Bounds of one task: the oscillators row … row_stop - 1 under the motions first … stop - 1."""

    row: int
    row_stop: int
    first: int
    stop: int


class Work(NamedTuple):
    """The runs of all oscillators under factors times all motions.

    `factors` (block, level, motion): of one block if they are the same for all blocks; otherwise the oscillators are
    ordered block by block, equally many for each. `outputs`: names of the outputs of a run. `per_block`: number of
    consecutive oscillators that chunks keep together, or divide in the same places (the laws of a block).
    """

    oscillators: Sequence[Specimen]
    motions: tuple[Record, ...]
    factors: Factors
    skip: bool = True
    outputs: tuple[str, ...] = tuple(OF_ENGINE)
    per_block: int = 1

    @property
    def levels(self) -> int:
        """Number of factors of each oscillator and motion."""
        return int(self.factors.shape[1])

    @property
    def runs(self) -> int:
        """Total number of runs."""
        return len(self.oscillators) * self.levels * len(self.motions)

    def runs_of(self, chunk: Chunk) -> int:
        """Return the number of runs in a chunk."""
        return (chunk.row_stop - chunk.row) * self.levels * (chunk.stop - chunk.first)

    def factors_of(self, chunk: Chunk) -> Array:
        """Return the factors of a chunk (oscillator or 1, level, motion)."""
        motions = slice(chunk.first, chunk.stop)
        blocks = self.factors.shape[0]
        if blocks == 1:
            return dense(self.factors)[:, :, motions]
        per_block = len(self.oscillators) // blocks
        rows = np.arange(chunk.row, chunk.row_stop) // per_block
        near = slice(int(rows[0]), int(rows[-1]) + 1)
        factors = (
            self.factors.part(near, motions)
            if isinstance(self.factors, BlockFactors)
            else self.factors[near, :, motions]
        )
        return np.ascontiguousarray(factors[rows - rows[0]])


def seconds_of_a_chunk(total: float, least: float | None = None) -> float:
    """Return the duration, s, of a chunk of work of `total` seconds on one core: about 1, depending on the total."""
    shortest = LEAST_SECONDS if least is None else least
    return max(shortest, min(CHUNK_SECONDS, total / FEWEST_CHUNKS), total / MOST_CHUNKS)


def number_of_chunks(total: float) -> float:
    """Return the approximate number of chunks of work of `total` seconds on one core.

    If chunks decrease in size, about three small chunks replace one of full size.
    """
    equal = total / seconds_of_a_chunk(total)
    return equal + 2.0 * min(FALLING_SHARE * equal, MOST_FALLING)


Bounds = list[tuple[int, int]]
"""First and last + 1 of consecutive parts."""


def plan_chunks(work: Work, seconds: float | None = None, least: float | None = None) -> list[Chunk]:
    """Divide work into chunks of about equal duration, with shorter chunks at the end.

    Parameters
    ----------
    work : Work
    seconds : float, optional
        Duration of a chunk on one core, s; by default as `seconds_of_a_chunk` returns. It is longer if there would be
        many more than 100,000 chunks.
    least : float, optional
        Minimum duration, s, if `seconds` is not given; by default LEAST_SECONDS.

    Returns
    -------
    list of Chunk
        Every run is in one of them.  They depend on the work alone, and not on the machine.
    """
    per_row = _costs(work)
    samples = np.array([motion.acceleration.size for motion in work.motions], float)
    left = total = float(per_row.sum() * samples.sum())
    full = seconds_of_a_chunk(total, least) if seconds is None else max(seconds, total / MOST_CHUNKS)
    falling = min(FALLING_SHARE * total, MOST_FALLING * full)

    def part_of(left: float) -> float:
        return max(min(1.0, left / falling), LEAST_PART)

    rows = _rows(work, per_row, float(samples.max()), full)
    costs = [float(per_row[first:stop].sum()) for first, stop in rows]
    motions: Bounds = []
    first, spent = 0, 0.0
    for i, cost in enumerate((max(costs) * samples).tolist(), start=1):
        spent += cost
        if spent >= full * (part_of(left) if len(rows) == 1 else 1.0) or i == samples.size:
            motions.append((first, i))
            left -= spent
            first, spent = i, 0.0
    if len(rows) == 1:
        return [Chunk(*rows[0], *bounds) for bounds in motions]
    chunks, left = [], total
    for cost, bounds in zip(costs, rows, strict=True):
        for begin, end in motions:
            parts = min(end - begin, math.ceil(1.0 / part_of(left)))
            cuts = [begin + (end - begin) * k // parts for k in range(parts + 1)]
            chunks += [Chunk(*bounds, *cut) for cut in pairwise(cuts)]
            left -= cost * float(samples[begin:end].sum())
    return chunks


def seconds_per_sample(specimen: Specimen, dt: float) -> float:
    """Return the planning figure of a sample of a time step dt, s."""
    if isinstance(specimen, PlaneSlider):
        return SECONDS_PER_PLANE_SAMPLE
    if specimen.exact:
        return SECONDS_PER_EXACT_SAMPLE
    pieces = specimen.pieces(dt) if isinstance(specimen, Oscillator) else 0.0
    return SECONDS_PER_PIECE * pieces if pieces > 1.0 else SECONDS_PER_SAMPLE


def refuse_endless_runs(cases: Iterable[tuple[str, Block, Model]], motions: Iterable[Record]) -> None:
    """Raise ValueError, which begins with its key, for the first of some cases that is too stiff for a motion."""
    seconds = max((motion.acceleration.size * motion.dt for motion in motions), default=0.0)
    for key, block, law in islice(cases, MOST_CASES):
        try:
            refuse_endless(block, law, seconds)
        except ValueError as error:
            raise ValueError(f"{key}: {error}") from None


def _costs(work: Work) -> Array:
    """Return the planning figure of each oscillator, s per sample; for a grid, the figure of its first block."""
    oscillators = work.oscillators
    dt = float(np.mean([motion.dt for motion in work.motions]))
    specimens = oscillators.first if isinstance(oscillators, OscillatorGrid) else oscillators
    seconds = [seconds_per_sample(specimen, dt) for specimen in specimens]
    return work.levels * np.tile(seconds, len(oscillators) // max(len(seconds), 1))


def _rows(work: Work, per_row: Array, longest: float, target: float) -> Bounds:
    """Bounds of groups of oscillators that share a motion's samples: at most about a chunk under the longest motion.

    Groups contain the same oscillators of each entry of `Work.per_block`: several whole entries, or a part of one.
    """
    group = work.per_block
    entries = per_row.reshape(-1, group)
    runs, cost = group * work.levels, float(entries[0].sum()) * longest
    if group == 1 or not _enough(runs, cost, target):
        return [(first * group, stop * group) for first, stop in _groups(entries.sum(axis=1), runs, longest, target)]
    parts = _groups(entries.max(axis=0), work.levels, longest, target)  # (laws may differ in cost)
    return [(i * group + first, i * group + stop) for i in range(len(entries)) for first, stop in parts]


def _groups(costs: Array, runs: int, longest: float, target: float) -> Bounds:
    """Bounds of groups of entries, with `runs` runs each under one motion."""
    bounds = []
    row, spent = 0, 0.0
    for i, cost in enumerate((costs * longest).tolist(), start=1):
        spent += cost
        if _enough((i - row) * runs, spent, target) or i == len(costs):
            bounds.append((row, i))
            row, spent = i, 0.0
    return bounds


def _enough(together: int, spent: float, target: float) -> bool:
    full = spent >= target and together >= FEWEST_TOGETHER
    return together >= MOST_TOGETHER or full or spent >= LONGEST * target


class ChunkResult(NamedTuple):
    """Results of a chunk: an array (oscillator, level, motion) per output, the counts (`runs.TALLY`), and the time that
    it took, s (for information: nothing depends on it).
    """

    results: tuple[NDArray[Any], ...]
    tally: Index
    seconds: float = 0.0

    @property
    def runs(self) -> int:
        """Number of runs in the chunk."""
        return int(self.results[0].size)


def never() -> bool:
    """Return False: the work is never to be left."""
    return False


class LeftError(Exception):
    """Work that was left before its end."""


def run_chunk(work: Work, chunk: Chunk, left: Callable[[], bool] = never) -> ChunkResult:
    """Compute all runs of one chunk; LeftError once `left` returns True, which long chunks call about every second."""
    return run_part(
        work.oscillators[chunk.row : chunk.row_stop],
        work.motions[chunk.first : chunk.stop],
        work.factors_of(chunk),
        work.skip,
        work.outputs,
        left,
    )


def run_part(
    oscillators: Sequence[Specimen],
    motions: Sequence[Record],
    factors: Array,
    skip: bool,
    outputs: tuple[str, ...],
    left: Callable[[], bool] = never,
) -> ChunkResult:
    """Run every oscillator under factors (oscillator or 1, level, motion); each output has its type, flags take a byte.

    A worker that does not share memory with the rest of the work computes a chunk in this form.
    """
    started = perf_counter()
    n, levels = len(oscillators), factors.shape[1]
    results = tuple(np.empty((n, levels, len(motions)), OUTPUTS[name].kind) for name in outputs)
    flags_only = outputs == ("overturned",)
    tally = np.zeros(len(TALLY), np.int64)
    tables = stacked(oscillators)
    seconds = {
        dt: np.array([seconds_per_sample(oscillator, dt) for oscillator in oscillators])
        for dt in {motion.dt for motion in motions}
    }
    total = sum(levels * float(seconds[motion.dt].sum()) * motion.acceleration.size for motion in motions)
    # (sliding blocks go motion by motion in any case)
    # (motions of few runs each go through the engine together)
    of_one = n * levels if isinstance(tables, Stack) else ENOUGH_OF_ONE
    together = 1 if of_one >= ENOUGH_OF_ONE else max(1, MOST_MIXED // of_one)
    for first in range(0, len(motions), together):
        stop = min(first + together, len(motions))
        shakes = motions[first:stop]
        factors_of_runs = np.broadcast_to(factors[:, :, first:stop], (n, levels, stop - first))
        costs = np.array([seconds[shake.dt] * shake.acceleration.size for shake in shakes]).T
        parts = _parts(np.repeat(costs, levels, axis=0).ravel())
        if len(shakes) > 1 or len(parts) > 1:
            specimen, _, motion = (axis.ravel() for axis in np.indices(factors_of_runs.shape))
            given = factors_of_runs.ravel()
            part_runs = []
            for part in parts:
                if total > 2.0 * PART_SECONDS and left():
                    raise LeftError
                listed = specimen[part], motion[part], given[part]
                part_runs.append(run_mixed(tables, *listed, shakes, skip, flags_only, tally))
            runs = np.concatenate(part_runs).reshape(*factors_of_runs.shape, -1)
        else:
            if total > 2.0 * PART_SECONDS and left():
                raise LeftError
            runs = run_specimens(tables, factors_of_runs[..., 0], shakes[0], skip, flags_only, tally)[:, :, None]
        # (of sliding blocks all results are NaN there)
        rocks = isinstance(tables, Stack) and any(motion.vertical is not None for motion in shakes)
        airborne = runs[..., COLUMNS["airborne"]] == 1.0 if rocks else None
        for array, name in zip(results, outputs, strict=True):
            values = runs[..., COLUMNS[name]]
            unknown = OUTPUTS[name].airborne
            if airborne is not None and unknown is not None:
                values = np.where(airborne, unknown, values)
            array[:, :, first:stop] = values
    return ChunkResult(results, tally, perf_counter() - started)


def _parts(costs: Array) -> list[slice]:
    """Parts of consecutive runs that take about `PART_SECONDS`, from the seconds of each run."""
    ends = np.flatnonzero(np.diff(np.floor(np.cumsum(costs) / PART_SECONDS))) + 1
    return [slice(*bounds) for bounds in pairwise([0, *ends.tolist(), costs.size])]
