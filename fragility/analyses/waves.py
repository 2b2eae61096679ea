"""Runs as a table, and waves of motions: the next motions, the measure that they are scaled to, and the runs of each.

Waves are from a generator or from a set of motions.
"""

from collections.abc import Iterable, Iterator, Sequence
from itertools import groupby
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ...core import checks
from ...core.aliases import Progress
from ...core.elementary import Array, Index, power
from ...core.streams import stream
from ...core.units import DIMENSIONLESS
from ...models import Block
from ...models.outputs import DERIVED
from ...models.runs import Specimen
from ...motions.arrays import BOTH_AXES, Record
from ...motions.intensity.measure import Measure
from ...motions.polarity import AS_RECORDED, BOTH, records_under
from ...motions.simulated.generator import Generator
from ..adaptive.until import Until
from ..runs.axes import along_width, axes_of, check_axes, check_outputs
from ..runs.plan import LEAST_OF_A_WAVE
from ..runs.request import Request, check_vertical, collect_about, part_of, work_of
from ..runs.scaling import SCALE, BlockMeasure, check_factors, ground_of, intensities, intensity_measure
from .friction_draws import check_draws, specimens_in

MOST_GRIDS, FEWEST_OF_A_GRID, MOST_REPEATED = 8, 10_000, 3
"""A table is run as several grids if they are at most `MOST_GRIDS`, or of `FEWEST_OF_A_GRID` runs each. Otherwise it is
run as one grid of at most `MOST_REPEATED` times the table's runs.
"""
ORDER = (0, 3)
"""Key, under a seed, of the order in which the motions of a set are taken."""


class MotionWave(NamedTuple):
    """Some motions: their numbers (record,), the same for a motion and its reverse; ground motions below, if given."""

    numbers: Index
    records: list[Record]
    ground: list[Record] | None

    def parts(self, motions: int) -> "Iterator[MotionWave]":
        """Yield the wave in parts of at most this number of motions."""
        given = np.unique(self.numbers)
        for first in range(0, given.size, motions):
            mine = np.flatnonzero(np.isin(self.numbers, given[first : first + motions])).tolist()
            ground = None if self.ground is None else [self.ground[i] for i in mine]
            yield MotionWave(self.numbers[mine], [self.records[i] for i in mine], ground)


class Rows(NamedTuple):
    """A table of runs (run,): numbers from 0 of their blocks, laws and motions, and the levels that they are at."""

    block: Index
    model: Index
    motion: Index
    level: Array


class Scaled(NamedTuple):
    """A measure that motions are scaled to: measured values of a wave, and their factors at levels."""

    name: str
    units: str
    long_name: str
    base: Measure | None
    intensity: Measure | BlockMeasure | None

    def measured(self, wave: MotionWave, blocks: Sequence[Block]) -> Array:
        """Return the measure of the unscaled motions, (block or 1, motion)."""
        if self.intensity is None:
            return np.ones((1, len(wave.records)))
        values = intensities(self.intensity, wave.records if wave.ground is None else wave.ground, blocks)
        return np.atleast_2d(values)

    def factors(self, levels: Array, measured: Array) -> Array:
        """Return the factors that bring motions of a measure to levels; shapes that broadcast."""
        return levels if self.base is None else np.asarray(self.base.factors(levels / measured))

    def level(self, factors: Array, measured: Array) -> Array:
        """Return the levels of motions times factors."""
        return factors if self.base is None else measured * power(factors, self.base.power)


def scaled_to(im: str | Measure) -> Scaled:
    """Return the measure of a name; errors as `intensity_measure`."""
    intensity = intensity_measure(im)
    if intensity is None:
        return Scaled(SCALE, DIMENSIONLESS, "scale factor", None, None)
    base = intensity.measure if isinstance(intensity, BlockMeasure) else intensity
    return Scaled(intensity.label, intensity.units, intensity.long_name, base, intensity)


class MotionSource:
    """Motions by number: from a generator, without an end, or from a set in random order.

    A set may be sorted, by magnitude or by event, and its first motions must be as good a sample as any. `ground` has
    the ground motions below the floor motions of a set; `polarity` is "as recorded" or "both".
    """

    def __init__(
        self,
        motions: Generator | xr.DataArray | Iterable[xr.DataArray],
        seed: int,
        ground: xr.DataArray | Iterable[xr.DataArray] | None = None,
        polarity: str = AS_RECORDED,
    ) -> None:
        self.seed, self._polarity, self.on_ground = checks.count("seed", seed), polarity, ground is not None
        self.generator = motions if isinstance(motions, Generator) else None
        self.size: int | None = None
        if isinstance(motions, Generator):
            if ground is not None:
                raise ValueError("ground must be left out where motions come from a generator")
            return
        records = records_under(motions, polarity)
        if len({record.floor for record in records}) > 1:
            raise ValueError("motions must be of one floor for adaptive levels, got several: take one at a time")
        below = None if ground is None else ground_of(records, records_under(ground, polarity))
        given = [list(members) for _, members in groupby(range(len(records)), lambda i: records[i].given)]
        order = stream(seed, *ORDER).permutation(len(given))
        self._sets = [[records[i] for i in given[k]] for k in order]
        self._below = None if below is None else [[below[i] for i in given[k]] for k in order]
        self.size = len(given)

    def wave(self, first: int, n: int) -> MotionWave:
        """Return motions `first` … `first + n - 1`."""
        if self.generator is not None:
            records = records_under(self.generator.sample(n, self.seed, first), self._polarity)
            ways = len(records) // n
            return MotionWave(np.repeat(np.arange(first, first + n), ways), records, None)
        sets = self._sets[first : first + n]
        numbers = np.repeat(np.arange(first, first + len(sets)), [len(members) for members in sets])
        below = None if self._below is None else [record for two in self._below[first : first + n] for record in two]
        return MotionWave(numbers, [record for two in sets for record in two], below)

    def most(self, until: Until) -> int:
        """Return the maximum number of motions; ValueError for a set smaller than the required minimum."""
        if self.size is None:
            return until.most
        if self.size < until.least:
            raise ValueError(f"motions must be {until.least} at least (until motions least), got {self.size}")
        return min(until.most, self.size)

    def describe(self) -> Any:
        """Return the source as plain values."""
        of = {"generator": repr(self.generator)} if self.generator is not None else {"motions": self.size}
        return {**of, **({"polarity": BOTH} if self._polarity == BOTH else {})}


def checked_axes(request: Request, records: Sequence[Record]) -> str:
    """Return the axes of motions (`axes_of`); ValueError if they do not suit the blocks, the laws or the outputs."""
    check_vertical(request.models, records)
    check_draws(request.models, request.blocks, records)
    axes = axes_of(records)
    check_axes(axes, request.blocks, request.models)
    check_outputs(axes, request.outputs, request.models)
    return axes


def check_own_levels(request: Request) -> None:
    """Raise ValueError for outputs that runs at levels of their own do not have."""
    derived = next((name for name in request.outputs if name in DERIVED), None)
    if derived is not None:
        raise ValueError(f"outputs must not hold {derived} where each run has a level of its own: give common levels")


def check_row_factors(rows: Rows, factors: Array, records: Sequence[Record]) -> None:
    """Raise ValueError for factors (run,) of a table of runs, as `check_factors`."""
    ends = np.ones((1, 2, len(records)))
    ends[0, :, rows.motion] = factors[:, None]
    np.minimum.at(ends[0, 0], rows.motion, factors)
    np.maximum.at(ends[0, 1], rows.motion, factors)
    check_factors(ends, records)


def run_wave(
    request: Request,
    specimens: Sequence[Specimen],
    across: Sequence[Specimen] | None,
    records: Sequence[Record],
    factors: Array,
    progress: Progress | None = None,
) -> dict[str, NDArray[Any]]:
    """Return the outputs (curve, level, motion) of specimens (curve,) under motions, each at levels of its own.

    Under motions along both axes, blocks that slide have specimens in the plane, and blocks that rock also have
    specimens in the direction of their depths, `across`. `factors` are (curve, level, motion).
    """
    work = work_of(specimens, [along_width(record) for record in records], factors, request)
    return collect_about(work, across, request.runner, progress, LEAST_OF_A_WAVE).results


def run_rows(
    request: Request, records: Sequence[Record], rows: Rows, factors: Array, progress: Progress | None = None
) -> dict[str, NDArray[Any]]:
    """Return the outputs (run,) of a table of runs under motions times factors (run,).

    Curves with equally many runs under each of the same motions run together.
    """
    both = axes_of(records) == BOTH_AXES
    specimens = specimens_in(request, both and request.sliding)
    across = request.specimens(across=True) if both and not request.sliding else None
    outputs: dict[str, NDArray[Any]] = {}
    grids = list(_grids(rows.block * len(request.models) + rows.model, rows.motion))
    axes = 1 if across is None else 2
    done, total = 0, axes * sum(at.size for _, _, at in grids)
    of_runs = np.append(factors, 1.0)
    for curves, motions, at in grids:
        results = run_wave(
            request,
            [specimens[i] for i in curves],
            None if across is None else [across[i] for i in curves],
            [records[i] for i in motions],
            of_runs[at],
            part_of(progress, done, total),
        )
        done += axes * at.size
        for name, values in results.items():
            outputs.setdefault(name, np.empty(of_runs.size, values.dtype))[at] = values
    return {name: values[:-1] for name, values in outputs.items()}


def _grids(curve: Index, motion: Index) -> Iterator[tuple[list[int], list[int], Index]]:
    """Yield curves that have equally many runs under each of some motions, these motions, and the places of the runs.

    Places are (curve, level, motion), the runs of a curve under a motion in the given order. Instead of many small
    grids, there is one with all curves and motions. It repeats some runs, and has others that are in no place (-1).
    """
    order = np.lexsort((motion, curve))
    new = np.diff(curve[order], prepend=-1).astype(bool) | np.diff(motion[order], prepend=-1).astype(bool)
    starts = np.flatnonzero(new)
    runs = np.diff(np.append(starts, curve.size))
    of_cell, under = curve[order[starts]], motion[order[starts]]
    grids: dict[tuple[int, tuple[int, ...]], list[tuple[int, Index]]] = {}
    cells = np.lexsort((of_cell, runs))
    ends = np.flatnonzero(np.diff(runs[cells]).astype(bool) | np.diff(of_cell[cells]).astype(bool)) + 1
    for mine in np.split(cells, ends):
        alike = int(runs[mine[0]]), tuple(under[mine].tolist())
        grids.setdefault(alike, []).append((int(of_cell[mine[0]]), starts[mine]))
    if len(grids) > MOST_GRIDS and len(grids) * FEWEST_OF_A_GRID > curve.size:
        every, motion_of = np.unique(of_cell), np.unique(under)
        if every.size * motion_of.size * runs.max() <= MOST_REPEATED * curve.size:
            at = np.full((every.size, runs.max(), motion_of.size), -1)
            for k in range(runs.max()):
                picked = starts + np.minimum(k, runs - 1)
                at[np.searchsorted(every, of_cell), k, np.searchsorted(motion_of, under)] = order[picked]
            yield every.tolist(), motion_of.tolist(), at
            return
    for (number, motions), curves in grids.items():
        first = np.stack([begin for _, begin in curves])[:, None, :]
        yield [i for i, _ in curves], list(motions), order[first + np.arange(number)[:, None]]
