"""Data of each fragility curve, gathered from runs or counts: levels, outcomes, and which runs share a motion.

The same structure serves every design: IDA (all motions at all levels), stripes and clouds (a motion once, at its
intensity), and counts.  Nothing is fitted here.
"""

import hashlib
import math
from collections.abc import Hashable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ...core import checks
from ...core.elementary import Array, Flags, Index, tan
from ...core.units import DIMENSIONLESS, STANDARD_GRAVITY
from ..kernels import resampling as engine
from ..numerics import slabs
from ..runs.provenance import (
    IDA,
    RUN,
    STRIPES,
    clusters_of,
    configuration_of,
    coordinates_on,
    curves_of,
    design_of,
    levels_of_the_ground,
    load_coordinates,
    motions_by_floor,
    number_of_motions,
)
from .states import OVERTURNED, UPLIFTED, State, flags_of, needed_output, reached, state_name


class Patterns(NamedTuple):
    """Patterns of outcomes; motions with the same outcomes share one.

    `of_cluster` (cluster,) is the pattern of each motion, -1 if it has no run here. `cells[starts[p]:starts[p + 1]]`
    are the cells in which the runs of pattern p lie; `counts` is the number of runs in each.
    """

    of_cluster: Index
    starts: Index
    cells: Index
    counts: Index


class PatternTable:
    """Patterns of outcomes, collected cluster by cluster."""

    def __init__(self, clusters: int) -> None:
        self.of_cluster = np.full(clusters, -1, dtype=np.int64)
        self._numbers: dict[bytes, int] = {}
        self._parts: list[NDArray[np.int32]] = []

    def add(self, cluster: Index, cell: Index, counts: Index) -> None:
        """Add further clusters, in their order, with the number of their runs in each cell."""
        bounds = np.append(np.flatnonzero(np.diff(cluster, prepend=-1)), cluster.size)
        pairs = np.stack([cell.astype(np.int32), counts.astype(np.int32)], axis=1)
        for begin, end in pairwise(bounds.tolist()):
            pattern = pairs[begin:end]
            key = hashlib.blake2b(pattern.data, digest_size=16).digest()
            if key not in self._numbers:
                self._numbers[key] = len(self._numbers)
                self._parts.append(pattern.copy())
            self.of_cluster[cluster[begin]] = self._numbers[key]

    @property
    def patterns(self) -> Patterns:
        """All patterns that were added."""
        starts = np.cumsum([0, *(len(part) for part in self._parts)], dtype=np.int64)
        cells, counts = np.concatenate(self._parts).T.astype(np.int64, order="C")
        return Patterns(self.of_cluster, starts, cells, counts)


UPLIFT_KNOWN_IN = ("pga", "pga_normalised")
"""Measures of levels in which the uplift of rigid blocks is known exactly."""
STATES = 3
STOOD, ROCKED, TOPPLED = range(STATES)
"""States of a run: no uplift (or none known), uplift without overturning, overturning."""
NO_RUN, SURVIVAL, FAILURE = -1, 0, 1
"""Outcomes of a run in a fit: not among its runs, a survival, a failure."""
OVERTURNING_OUTCOMES = (SURVIVAL, SURVIVAL, FAILURE)
"""Outcomes of the states of a run in a fit of overturning to all runs."""
UPLIFT_OUTCOMES = (SURVIVAL, FAILURE, FAILURE)
"""Outcomes of the states of a run in a fit of uplift to all runs."""


class Sample(NamedTuple):
    """Data of one curve.

    `levels` (level,) increase; `cells` (cell,): the number of runs in each cell. A cell is a level and a state (level *
    STATES + state) or, with `by_interval`, the interval of first overturning below each level and above the last.
    `threshold`: the level at which rocking starts if it is known, else NaN. `uplift_known`: True if uplifts are
    distinguished. `repeated`: True if motions have several runs. `patterns`: None for counts. `ways`: number of runs of
    a level that belong to one motion, such as 2 if each is run both ways.
    """

    levels: Array
    cells: Array
    by_interval: bool
    threshold: float
    uplift_known: bool
    repeated: bool
    patterns: Patterns | None
    ways: int = 1

    def resampled(self, weights: Array) -> tuple[Array, Array]:
        """Turn weights of motions (replicate, cluster) into weights of patterns (replicate, pattern) and cells."""
        assert self.patterns is not None
        known = np.flatnonzero(self.patterns.of_cluster >= 0)
        order = known[np.argsort(self.patterns.of_cluster[known], kind="stable")]
        firsts = np.searchsorted(self.patterns.of_cluster[order], np.arange(self.patterns.starts.size))
        of_patterns = np.zeros((weights.shape[0], self.patterns.starts.size - 1))
        drawn = np.zeros((weights.shape[0], self.cells.size))
        engine.resample(weights, order, firsts, *self.patterns[1:], of_patterns, drawn)
        return of_patterns, drawn

    def motions_beyond(self, below: bool = False) -> Index:
        """Return the number of motions with a run at each level or above it, or `below` it; motions must be known."""
        assert self.patterns is not None
        of_cluster, starts, cells, _ = self.patterns
        times = np.bincount(of_cluster[of_cluster >= 0], minlength=starts.size - 1)
        if self.by_interval:
            return np.full(self.levels.size, times.sum())
        last = (np.minimum if below else np.maximum).reduceat(cells // STATES, starts[:-1])
        motions = np.bincount(last, times, self.levels.size).astype(np.int64)
        return np.cumsum(motions) if below else np.cumsum(motions[::-1])[::-1]

    @property
    def single_runs(self) -> tuple[Index, Index, Flags]:
        """The motion, the level and the overturning of each run, (run,); motions count from 0, in increasing order."""
        if self.patterns is None:
            cell = np.repeat(np.arange(self.cells.size), self.cells.astype(np.int64))
            return np.arange(cell.size), cell // STATES, cell % STATES == TOPPLED
        of_cluster, starts, cells, counts = self.patterns
        patterns = of_cluster[of_cluster >= 0]
        entries = np.concatenate([np.arange(starts[pattern], starts[pattern + 1]) for pattern in patterns])
        motion = np.repeat(np.arange(patterns.size), np.diff(starts)[patterns])
        motion, cell = np.repeat(motion, counts[entries]), np.repeat(cells[entries], counts[entries])
        return motion, cell // STATES, cell % STATES == TOPPLED

    @property
    def level_counts(self) -> tuple[Index, Index]:
        """Overturnings and runs at each level."""
        overturnings, runs = self.counts_in(self.cells[None])
        return overturnings[0].astype(np.int64), runs[0].astype(np.int64)

    @property
    def gap(self) -> tuple[float, float] | None:
        """The levels between which separated data give no information on a curve, `gap_between`."""
        overturnings, runs = self.level_counts
        return gap_between(self.levels, overturnings < runs, overturnings > 0)

    def counts_in(self, cells: Array) -> tuple[Array, Array]:
        """Return the overturnings and the runs (replicate, level) in cells (replicate, cell) of the same levels."""
        if self.by_interval:
            fell = np.cumsum(cells, axis=1)
            return fell[:, :-1], np.repeat(fell[:, -1:], self.levels.size, axis=1)
        return failures_of(cells, outcomes_of(OVERTURNING_OUTCOMES, self.levels.size))


EXAMPLE = Sample(np.array([1.0, 2.0]), np.array([1.0, 0.0, 0.0, 0.0, 0.0, 1.0]), False, math.nan, False, False, None)
"""The data of a curve whose fit gives the variables of results without curves."""


def gap_between(x: Array, stood: Flags, fell: Flags) -> tuple[float, float] | None:
    """Return the highest level without a fall and the lowest with a fall; None if the first is not lower.

    None also if all runs fell or none did. `x` (n,) are levels, or their logarithms, of runs or of stripes.
    """
    if not stood.any() or not fell.any():
        return None
    low, high = float(x[stood].max()), float(x[fell].min())
    return (low, high) if low < high else None


def outcomes_of(states: tuple[int, int, int], levels: int) -> Index:
    """Return the outcome of each cell in a fit, (cell,), from the outcome of each state."""
    return np.tile(np.array(states, dtype=np.int64), levels)


def failures_of(cells: Array, outcomes: Index) -> tuple[Array, Array]:
    """Return failures and runs (replicate, level) in cells (replicate, cell)."""
    shape = (cells.shape[0], -1, STATES)
    failures = (cells * (outcomes == FAILURE)).reshape(shape).sum(axis=2)
    return failures, (cells * (outcomes != NO_RUN)).reshape(shape).sum(axis=2)


@dataclass(frozen=True)
class Trials:
    """Data of all curves of a dataset, with their dimensions and coordinates."""

    dims: tuple[Hashable, ...]
    shape: tuple[int, ...]
    coords: dict[str, xr.Variable]
    attrs: dict[Hashable, Any]
    level: dict[str, str]
    design: str
    strata: tuple[Index, ...]
    samples: tuple[Sample, ...]

    @property
    def clusters(self) -> int:
        """Number of ground motions that can be drawn; 0 of counts."""
        return sum(stratum.size for stratum in self.strata)

    @property
    def ways(self) -> int:
        """Number of runs of a curve at a level that belong to one motion, such as 2 if motions are run both ways."""
        return max((sample.ways for sample in self.samples), default=1)

    @property
    def repeated(self) -> bool:
        """True if motions have several runs in a curve, so that its runs are not independent."""
        return any(sample.repeated for sample in self.samples)


def collect(data: Any, first: bool = False, state: State = OVERTURNED, together: Sequence[Hashable] = ()) -> Trials:
    """Return the trials in a dataset of runs of any design, or of counts; reaching the `state` counts as overturning.

    `first`: motions are counted by the level at which they first overturn, which needs an IDA. `together`: dimensions
    of an IDA that do not separate curves: all runs of a motion along them belong to that motion.
    """
    if not isinstance(data, xr.Dataset):
        raise TypeError(f"fit_fragility needs an IDA dataset or a dataset of counts, got {type(data).__name__}")
    load_coordinates(data)
    checks.not_empty("data", data, "level")
    if RUN in data.dims:
        return _trials_of_adaptive(data, first, state, together)
    on_motion = any("motion" in variable.dims for variable in data.data_vars.values())
    if "overturned" in data or (on_motion and "overturnings" not in data):
        return _trials_of_runs(data, first, state, together)
    if first:
        raise ValueError("method 'first-overturning' needs an IDA dataset with overturned on motion, got counts")
    if state != OVERTURNED:
        raise ValueError(f"state {state!r} needs runs: counts are of the state that they were made of")
    if together:
        raise ValueError(f"together {', '.join(map(str, together))} needs runs: of counts no motion is known")
    return _trials_of_counts(data)


def rocking_thresholds(data: xr.Dataset) -> xr.DataArray:
    """Return the level at which rigidly resting blocks uplift, on (block, model); NaN if it is not known exactly.

    In peak acceleration it is g tan(alpha) (the mass centre's height as lever), g sin(alpha) (``lever="R"``), or g
    alpha (Housner's block of ``geometry="linear"``). In ``pga_normalised`` it is the same over g tan(alpha). NaN for
    blocks with an elastic zone at rest, which oscillate before they uplift and may uplift well below this level, and in
    any other measure. NaN also if levels refer to the ground motion below a floor, or if the motions of a stripe are
    not scaled to its level.
    """
    x = data.coords.get("level", data.coords.get("intensity"))
    im = "" if x is None else str(x.attrs.get("im", ""))
    needed = ("alpha", "law", "rest", "lever", "geometry")
    elsewhere = levels_of_the_ground(data) or configuration_of(data).get("scale") is False
    if im not in UPLIFT_KNOWN_IN or elsewhere or any(name not in data.coords for name in needed):
        return xr.DataArray(np.nan)
    alpha = data["alpha"]
    rigid = (data["law"] == "housner") | (data["rest"] == "rigid")
    tangent = xr.apply_ufunc(tan, alpha)
    level = tangent.where(data["lever"] != "R", np.sin(alpha)).where(data["geometry"] != "linear", alpha)
    level = level / tangent if im == "pga_normalised" else level * STANDARD_GRAVITY
    thresholds: xr.DataArray = level.where(rigid).transpose(*alpha.dims, *data["law"].dims)
    return thresholds


def _trials_of_counts(data: xr.Dataset) -> Trials:
    if data.attrs.get("design") == "pooled":
        raise ValueError("data must be runs or counts, got pooled curves, which are fitted already (`surface_curves`)")
    missing = [name for name in ("overturnings", "runs") if name not in data]
    if missing or "level" not in data.coords or "level" not in data["overturnings"].dims:
        raise ValueError(
            f"counts must hold overturnings and runs on a level coordinate, got {sorted(map(str, data.variables))}"
        )
    k, n = data["overturnings"], data["runs"]
    if not (np.issubdtype(k.dtype, np.integer) and np.issubdtype(n.dtype, np.integer)):
        raise TypeError(f"overturnings and runs must be whole numbers, got {k.dtype} and {n.dtype}")
    if not set(n.dims) <= set(k.dims):
        raise ValueError(f"runs must lie on the dimensions of overturnings {k.dims}, got {n.dims}")
    if bool((k < 0).any()) or bool((k > n).any()):
        raise ValueError("overturnings must lie between 0 and runs at every level")
    k = k.transpose(..., "level")
    dims, shape = k.dims[:-1], k.shape[:-1]
    x = _positive("level", data["level"].values)
    levels, where = np.unique(x, return_inverse=True)
    thresholds = _per_curve(rocking_thresholds(data), dims, shape)
    counts = (array.reshape(-1, x.size) for array in (k.values, slabs.spread(n, k.sizes)))
    samples = []
    for fell, ran, threshold in zip(*counts, thresholds, strict=True):
        cells = np.zeros((levels.size, STATES))
        np.add.at(cells[:, TOPPLED], where, fell)
        np.add.at(cells[:, STOOD], where, ran - fell)
        samples.append(Sample(levels, cells.ravel(), False, threshold, False, False, None))
    coords = coordinates_on(data, dims)
    return Trials(dims, shape, coords, data.attrs, _level_attributes(data["level"]), "counts", (), tuple(samples))


def _trials_of_runs(data: xr.Dataset, first: bool, state: State, together: Sequence[Hashable]) -> Trials:
    flags = reached(data, state)
    lifted = reached(data, UPLIFTED) if UPLIFTED in data else None
    design = design_of(flags)
    if first and design != IDA:
        raise ValueError(f"method 'first-overturning' needs an IDA dataset, got a dataset of design {design!r}")
    if together and design != IDA:
        raise ValueError(f"together needs an IDA dataset, got a dataset of design {design!r}")
    if not {*together} <= {*flags.dims} - {"level", "motion"}:
        raise ValueError(f"together must name dimensions of the runs beside level and motion, got {list(together)!r}")
    for dim in ("level",) * (design == IDA) + ("motion",):
        if dim not in flags.dims:
            raise ValueError(f"runs must be on {dim}, got dims {flags.dims}")
    dims = tuple(dim for dim in flags.dims if dim not in {"level", "motion", *together})
    # (in designs other than IDA every motion has its own level)
    rest = [*together, *(["level"] if design == IDA else []), "motion"]
    flags = flags.transpose(*dims, *rest)
    lifted = None if lifted is None else lifted.transpose(*dims, *rest)
    x = data["level" if design == IDA else "intensity"]
    intensities = _intensities(x, {dim: flags.sizes[dim] for dim in dims}, "level" if design == IDA else "motion")
    clusters = clusters_of(flags)
    ways = flags.sizes["motion"] // number_of_motions(flags)
    floor, groups = motions_by_floor(flags)
    shape = flags.shape[: len(dims)]
    thresholds = _per_curve(rocking_thresholds(data), dims, shape)
    samples = []
    for i, where in enumerate(np.ndindex(*shape)):
        for motions in groups:
            at = intensities[where] if design == IDA else intensities[where][motions]
            fell = flags.values[where]
            up = None if lifted is None else lifted.values[where]
            samples.append(_sample(fell, up, at, motions, clusters, thresholds[i], first)._replace(ways=ways))
    coords = coordinates_on(data, dims)
    if floor is not None:
        coords["floor"] = floor
        dims, shape = (*dims, "floor"), (*shape, len(groups))
    strata: tuple[Index, ...] = (np.arange(clusters.max() + 1),)
    if design == STRIPES:
        stripe = flags["stripe"].values
        members = tuple(np.unique(clusters[stripe == label]) for label in np.unique(stripe))
        # (ground motions are drawn stripe by stripe, unless stripes share one)
        strata = members if sum(member.size for member in members) == clusters.max() + 1 else strata
    return Trials(
        dims,
        shape,
        coords,
        {**data.attrs, "state": state_name(state)},
        _level_attributes(x),
        design,
        strata,
        tuple(samples),
    )


def _trials_of_adaptive(data: xr.Dataset, first: bool, state: State, together: Sequence[Hashable]) -> Trials:
    """Return the trials of runs at adaptive levels: each run has its block, law, motion and level.

    Runs of blocks, laws and motions that are not among the data, of which some were selected, do not count.
    """
    if first:
        raise ValueError("method 'first-overturning' needs every motion at common levels, got adaptive levels")
    name = str(data.attrs.get("state", state_name(OVERTURNED)))
    if state_name(state) != name:
        raise ValueError(
            f"levels were chosen for {name}, and tell nothing sure of {state_name(state)}: give the state of `ida`"
        )
    if together:
        raise ValueError(f"together {', '.join(map(str, together))} needs common levels, got adaptive levels")
    dims = tuple(dim for dim in ("block", "model") if dim in data.dims)
    shape = tuple(data.sizes[dim] for dim in dims)
    block, model = (np.atleast_1d(data[f"{dim}_number"].values) for dim in ("block", "model"))
    if "motion" not in data.dims:
        raise ValueError("runs at adaptive levels must keep their motion dimension, got a selection without it")
    numbers = [f"run_{dim}" for dim in ("block", "model", "motion")]
    if any(data[number].dtype.kind not in "iu" for number in numbers) or not data.sizes["motion"]:
        raise ValueError(
            "runs at adaptive levels must keep motions, and whole numbers of their blocks, models and motions: "
            "select with isel or sel (where makes fractions of numbers)"
        )
    motions = clusters_of(data)
    x = _positive("level", data["level"].values)
    alpha = np.broadcast_to(data["alpha"].values if "alpha" in data.coords else math.nan, block.shape)
    verdicts = data[needed_output(state)].values
    samples = []
    for i, j, rows, of_run in curves_of(data):
        if not rows.size:
            raise ValueError(f"runs must hold some of block number {block[i]} under law number {model[j]}, got none")
        fell = flags_of(verdicts[rows], state, float(alpha[i]))
        levels, where = np.unique(x[rows], return_inverse=True)
        size = levels.size * STATES
        cell = STATES * where + np.where(fell, TOPPLED, STOOD)
        keys, counts = np.unique(motions[of_run] * size + cell, return_counts=True)
        known = PatternTable(int(motions.max()) + 1)
        known.add(keys // size, keys % size, counts)
        cells = np.bincount(cell, minlength=size).astype(np.float64)
        samples.append(Sample(levels, cells, False, math.nan, False, True, known.patterns))
    return Trials(
        dims,
        shape,
        coordinates_on(data, dims),
        {**data.attrs, "state": state_name(state)},
        _level_attributes(data["level"]),
        design_of(data),
        (np.arange(motions.max() + 1),),
        tuple(samples),
    )


def _sample(
    fell: Flags, up: Flags | None, x: Array, motions: Any, clusters: Index, threshold: float, first: bool
) -> Sample:
    """One curve: flags (…, level, motion) with x (level,), or (motion,) with x of these motions; clusters (motion,).

    Clusters and their rows are taken in slabs, since the intermediate arrays take up to a hundred bytes a run.
    """
    levels, where = np.unique(x, return_inverse=True)
    chosen = np.arange(clusters.size)[motions]
    of_motion = clusters[chosen]
    alike, size = (1, levels.size + 1) if first else (where.size, levels.size * STATES)
    runs = math.prod(fell.shape[:-2]) * alike if fell.ndim > 1 else 1
    cells = np.zeros(size)
    known = PatternTable(int(clusters.max()) + 1)
    step = max(1, slabs.RUNS * known.of_cluster.size // (of_motion.size * (fell.shape[-2] if fell.ndim > 1 else 1)))
    for begin in range(0, known.of_cluster.size, step):
        within = np.flatnonzero((of_motion >= begin) & (of_motion < begin + step))
        if not within.size:
            continue
        keys, counts = np.empty(0, np.int64), np.empty(0, np.int64)
        for part, lifts in _flag_slabs(fell, up, chosen[within]):
            if first:
                rising = np.argsort(x, kind="stable")
                lowest = where[rising][part[..., rising, :].argmax(axis=-2)]
                cell = np.where(part.any(axis=-2), lowest, levels.size)
            else:
                state = np.where(part, TOPPLED, STOOD if lifts is None else np.where(lifts, ROCKED, STOOD))
                cell = STATES * (where[:, None] if fell.ndim > 1 else where[within]) + state
            new = np.broadcast_to(of_motion[within] - begin, cell.shape).ravel() * size + cell.ravel()
            keys, counts = _with_counts(keys, counts, new)
        cells += np.bincount(keys % size, counts, size)
        known.add(begin + keys // size, keys % size, counts)
    repeated = bool(np.bincount(of_motion).max() * runs > 1)
    return Sample(levels, cells, first, threshold, up is not None, repeated, known.patterns)


def _with_counts(keys: Index, counts: Index, new: Index) -> tuple[Index, Index]:
    """Return increasing keys and their counts (key,) with new keys, of which several may be equal, added."""
    distinct, further = np.unique(new, return_counts=True)
    if not keys.size:
        return distinct, further
    every, at = np.unique(np.concatenate([keys, distinct]), return_inverse=True)
    return every, np.bincount(at, np.concatenate([counts, further])).astype(np.int64)


def _flag_slabs(fell: Flags, up: Flags | None, motions: Index) -> Iterator[tuple[Flags, Flags | None]]:
    """Yield the flags of some motions, (row, level, motion) or (motion,), some rows at a time."""
    if fell.ndim == 1:
        yield fell[motions], None if up is None else up[motions]
        return
    rows, more = (None if flags is None else flags.reshape(-1, *flags.shape[-2:]) for flags in (fell, up))
    assert rows is not None
    step = max(1, slabs.RUNS // (rows.shape[1] * motions.size))
    for begin in range(0, rows.shape[0], step):
        part = slice(begin, begin + step)
        yield rows[part][..., motions], None if more is None else more[part][..., motions]


def _intensities(x: xr.DataArray, sizes: Mapping[Hashable, int], last: str) -> Array:
    """Return levels (…, level) or intensities (…, motion) on the dimensions of the curves and `last`."""
    if not set(x.dims) <= {*sizes, last} or last not in x.dims:
        raise ValueError(f"{x.name} must lie on {last} and may lie on {[*sizes]}, got dims {x.dims}")
    if x.size:
        _positive(str(x.name), x.values)
    return np.asarray(slabs.spread(x, {**sizes, last: x.sizes[last]}), dtype=np.float64)


def _positive(name: str, values: Any) -> Array:
    x = checks.finite_array(name, values, ndim=tuple(range(1, 9)))
    if np.any(x <= 0.0):
        raise ValueError(f"{name} must be > 0, got {x.min():g}")
    return x


def _per_curve(values: xr.DataArray, dims: tuple[Hashable, ...], shape: tuple[int, ...]) -> list[float]:
    """Return a value for each curve in order; NaN if the values have other dimensions."""
    if not set(values.dims) <= set(dims):
        return [np.nan] * math.prod(shape)
    return [float(value) for value in slabs.spread(values, dict(zip(dims, shape, strict=True))).ravel()]


def _level_attributes(x: xr.DataArray) -> dict[str, str]:
    return {
        "units": str(x.attrs.get("units", DIMENSIONLESS)),
        "long_name": str(x.attrs.get("long_name", "level")),
        "im": str(x.attrs.get("im", "")),
    }
