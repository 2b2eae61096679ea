"""What runs or counts say of each fragility curve: its levels, the outcomes there, and which runs share a motion.

One reading for every design: IDA (all motions at all levels), stripes and clouds (a motion once, at its intensity), and
counts.  Nothing here fits anything.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Hashable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from .. import checks
from ..units import DIMENSIONLESS
from . import _resampling as engine
from . import slabs
from .provenance import IDA, STRIPES, design_of, floor_of_each_motion, motions_by_floor
from .states import OVERTURNED as OVERTURNING
from .states import UPLIFTED as UPLIFT
from .states import State, reached, state_name
from .thresholds import rocking_thresholds

Array = NDArray[np.float64]
Index = NDArray[np.int64]

STATES = 3
STOOD, UPLIFTED, OVERTURNED = range(STATES)
"""What a run can come to: no uplift (or none known), uplift and no overturning, overturning."""
NO_RUN, SURVIVED, FELL = -1, 0, 1
"""What a state is to a fit: no run of its, a survival, a fall."""
DENSE = 4
"""Counts for every run of a slab up to which a table of counts has a place for each."""


class Patterns(NamedTuple):
    """Motions with the same outcomes are one pattern: of_cluster (cluster,), -1 where a cluster has no run here.

    cells[starts[p]:starts[p + 1]] are the cells in which the runs of pattern p lie, counts how many lie in each.
    """

    of_cluster: Index
    starts: Index
    cells: Index
    counts: Index


class Sample(NamedTuple):
    """What there is of one curve.

    levels (level,) rising; cells (cell,): how many runs each cell holds.  A cell is a level and a state
    (level * STATES + state), or, of first overturnings, the interval below each level and above the last.  threshold:
    the level at which rocking starts, where it is known, else NaN; lifts: whether uplifts are told apart; repeated:
    whether motions come more than once; patterns: none of counts.
    """

    levels: Array
    cells: Array
    first: bool
    threshold: float
    lifts: bool
    repeated: bool
    patterns: Patterns | None

    def resampled(self, weights: Array) -> tuple[Array, Array]:
        """Weights of clusters (replicate, cluster) as weights of patterns (replicate, pattern) and cells."""
        assert self.patterns is not None
        known = np.flatnonzero(self.patterns.of_cluster >= 0)
        order = known[np.argsort(self.patterns.of_cluster[known], kind="stable")]
        firsts = np.searchsorted(self.patterns.of_cluster[order], np.arange(self.patterns.starts.size))
        of_patterns = np.zeros((weights.shape[0], self.patterns.starts.size - 1))
        drawn = np.zeros((weights.shape[0], self.cells.size))
        engine.resample(weights, order, firsts, *self.patterns[1:], of_patterns, drawn)
        return of_patterns, drawn

    @property
    def of_levels(self) -> tuple[Index, Index]:
        """Overturnings and runs at each level."""
        if self.first:
            return np.cumsum(self.cells)[:-1].astype(np.int64), np.full(self.levels.size, int(self.cells.sum()))
        overturnings, runs = falls_of(self.cells[None], outcomes_of((SURVIVED, SURVIVED, FELL), self.levels.size))
        return overturnings[0].astype(np.int64), runs[0].astype(np.int64)


def outcomes_of(states: tuple[int, int, int], levels: int) -> Index:
    """What each cell is to a fit, (cell,), from what each state is."""
    return np.tile(np.array(states, dtype=np.int64), levels)


def falls_of(cells: Array, outcomes: Index) -> tuple[Array, Array]:
    """Falls and runs (replicate, level) from cells (replicate, cell)."""
    shape = (cells.shape[0], -1, STATES)
    falls = (cells * (outcomes == FELL)).reshape(shape).sum(axis=2)
    return falls, (cells * (outcomes != NO_RUN)).reshape(shape).sum(axis=2)


@dataclass(frozen=True)
class Trials:
    """All curves of a dataset: their dimensions and coordinates, and where the runs of each are found."""

    dims: tuple[Hashable, ...]
    shape: tuple[int, ...]
    coords: dict[Hashable, xr.DataArray]
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
    def repeated(self) -> bool:
        """Whether motions come more than once in a curve, so that its runs are not independent."""
        return any(sample.repeated for sample in self.samples)


def collect(data: Any, first: bool = False, state: State = OVERTURNING, together: Sequence[Hashable] = ()) -> Trials:
    """The trials in an IDA, stripes, cloud or counts dataset; what is called overturning is reaching the `state`.

    `first`: motions by the level at which they first overturn, which needs an IDA.  `together`: dimensions of an IDA
    that no curve is of: all their runs of a motion are runs of that motion.

    Raises
    ------
    TypeError, ValueError
        A dataset of none of these kinds, flags that are none, counts that are negative or above the runs, levels or
        intensities that are not positive, `first` of anything but an IDA, a state of counts.
    """
    if not isinstance(data, xr.Dataset):
        raise TypeError(f"fit_fragility needs an IDA dataset or a dataset of counts, got {type(data).__name__}")
    on_motion = any("motion" in one.dims for one in data.data_vars.values())
    if "overturned" in data or (on_motion and "overturnings" not in data):
        return _of_runs(data, first, state, together)
    if first:
        raise ValueError("method 'first-overturning' needs an IDA dataset with overturned on motion, got counts")
    if state != OVERTURNING:
        raise ValueError(f"state {state!r} needs runs: counts are of the state that they were made of")
    if together:
        raise ValueError(f"together {', '.join(map(str, together))} needs runs: of counts no motion is known")
    return _of_counts(data)


def _of_counts(data: xr.Dataset) -> Trials:
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
    n = n.broadcast_like(k).transpose(*k.dims)
    dims, shape = k.dims[:-1], k.shape[:-1]
    x = _positive("level", data["level"].values)
    levels, where = np.unique(x, return_inverse=True)
    thresholds = _spread(rocking_thresholds(data), k.isel(level=0, drop=True))
    samples = []
    for fell, ran, threshold in zip(
        k.values.reshape(-1, x.size), n.values.reshape(-1, x.size), thresholds, strict=True
    ):
        cells = np.zeros((levels.size, STATES))
        np.add.at(cells[:, OVERTURNED], where, fell)
        np.add.at(cells[:, STOOD], where, ran - fell)
        samples.append(Sample(levels, cells.ravel(), False, threshold, False, False, None))
    coords = _kept(data, dims)
    return Trials(dims, shape, coords, data.attrs, _level_attributes(data["level"]), "counts", (), tuple(samples))


def _of_runs(data: xr.Dataset, first: bool, state: State, together: Sequence[Hashable]) -> Trials:
    flags = reached(data, state)
    lifted = reached(data, UPLIFT) if UPLIFT in data else None
    design = design_of(flags)
    if first and design != IDA:
        raise ValueError(f"method 'first-overturning' needs an IDA dataset, got a dataset of design {design!r}")
    if together and design != IDA:
        raise ValueError(f"together needs an IDA dataset, got a dataset of design {design!r}")
    if not {*together} <= {*flags.dims} - {"level", "motion"}:
        raise ValueError(f"together must name dimensions of the runs beside level and motion, got {list(together)!r}")
    dims = tuple(dim for dim in flags.dims if dim not in {"level", "motion", *together})
    # (but in an IDA every motion has a level of its own)
    rest = [*together, *(["level"] if design == IDA else []), "motion"]
    flags = flags.transpose(*dims, *rest)
    lifted = None if lifted is None else lifted.transpose(*dims, *rest)
    x = data["level" if design == IDA else "intensity"]
    one = flags.isel(dict.fromkeys(together, 0), drop=True)
    intensities = _intensities(x, one)
    clusters = _clusters(flags)
    floor, groups = motions_by_floor(flags)
    shape = flags.shape[: len(dims)]
    thresholds = _spread(rocking_thresholds(data), flags.isel(dict.fromkeys(rest, 0), drop=True))
    samples = []
    for i, where in enumerate(np.ndindex(*shape)):
        for motions in groups:
            at = intensities[where] if design == IDA else intensities[where][motions]
            fell = flags.values[where]
            up = None if lifted is None else lifted.values[where]
            samples.append(_sample(fell, up, at, motions, clusters, thresholds[i], first))
    coords = _kept(data, dims)
    if floor is not None:
        coords = {**coords, "floor": xr.DataArray(floor, dims="floor")}
        dims, shape = (*dims, "floor"), (*shape, len(groups))
    strata: tuple[Index, ...] = (np.arange(clusters.max() + 1),)
    if design == STRIPES:
        strata = _strata(flags["stripe"].values, clusters) or strata
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


def _sample(
    fell: NDArray[np.bool_],
    up: NDArray[np.bool_] | None,
    x: Array,
    motions: Any,
    clusters: Index,
    threshold: float,
    first: bool,
) -> Sample:
    """One curve: flags (…, level, motion) with x (level,), or (motion,) with x of these motions; clusters (motion,).

    Clusters are taken some at a time, and the rows of theirs: what is made of runs takes up to a hundred bytes each.
    """
    levels, where = np.unique(x, return_inverse=True)
    chosen = np.arange(clusters.size)[motions]
    own = clusters[chosen]
    alike, size = (1, levels.size + 1) if first else (where.size, levels.size * STATES)
    runs = math.prod(fell.shape[:-2]) * alike if fell.ndim > 1 else 1
    cells = np.zeros(size)
    known = _Known(int(clusters.max()) + 1)
    step = max(1, slabs.RUNS * known.of_cluster.size // (own.size * (fell.shape[-2] if fell.ndim > 1 else 1)))
    for begin in range(0, known.of_cluster.size, step):
        here = np.flatnonzero((own >= begin) & (own < begin + step))
        if not here.size:
            continue
        table = _Table(min(step, known.of_cluster.size - begin), size)
        for part, lifts in _parts(fell, up, chosen[here]):
            if first:
                rising = np.argsort(x, kind="stable")
                lowest = where[rising][part[..., rising, :].argmax(axis=-2)]
                cell = np.where(part.any(axis=-2), lowest, levels.size)
            else:
                state = np.where(part, OVERTURNED, STOOD if lifts is None else np.where(lifts, UPLIFTED, STOOD))
                cell = STATES * (where[:, None] if fell.ndim > 1 else where[here]) + state
            table.add(np.broadcast_to(own[here] - begin, cell.shape).ravel() * size + cell.ravel())
        keys, counts = table.entries
        cells += np.bincount(keys % size, counts, size)
        known.add(begin + keys // size, keys % size, counts)
    repeated = bool(np.bincount(own).max() * runs > 1)
    return Sample(levels, cells, first, threshold, up is not None, repeated, known.patterns)


def _parts(
    fell: NDArray[np.bool_], up: NDArray[np.bool_] | None, motions: Index
) -> Iterator[tuple[NDArray[np.bool_], NDArray[np.bool_] | None]]:
    """Flags of some motions (rows, level, motion), or (motion,), some rows at a time."""
    if fell.ndim == 1:
        yield fell[motions], None if up is None else up[motions]
        return
    rows, more = (None if one is None else one.reshape(-1, *one.shape[-2:]) for one in (fell, up))
    assert rows is not None
    step = max(1, slabs.RUNS // (rows.shape[1] * motions.size))
    for begin in range(0, rows.shape[0], step):
        part = slice(begin, begin + step)
        yield rows[part][..., motions], None if more is None else more[part][..., motions]


class _Table:
    """How many runs of each cluster lie in each cell, where any do: keys are cluster * size + cell, rising."""

    def __init__(self, clusters: int, size: int) -> None:
        self.size = size
        self._dense = np.zeros(clusters * size if clusters * size <= DENSE * slabs.RUNS else 0, np.int64)
        self._keys = np.empty(0, np.int64)
        self._counts = np.empty(0, np.int64)

    def add(self, keys: Index) -> None:
        """Further runs."""
        if self._dense.size:
            self._dense += np.bincount(keys, minlength=self._dense.size)
            return
        found, counts = np.unique(keys, return_counts=True)
        self._keys, at = np.unique(np.concatenate([self._keys, found]), return_inverse=True)
        counts = np.concatenate([self._counts, counts])
        self._counts = np.zeros(self._keys.size, np.int64)
        np.add.at(self._counts, at, counts)

    @property
    def entries(self) -> tuple[Index, Index]:
        """Keys and counts."""
        keys = np.flatnonzero(self._dense) if self._dense.size else self._keys
        return keys, self._dense[keys] if self._dense.size else self._counts


class _Known:
    """Patterns as they are met, cluster by cluster."""

    def __init__(self, clusters: int) -> None:
        self.of_cluster = np.full(clusters, -1, dtype=np.int64)
        self._numbers: dict[bytes, int] = {}
        self._parts: list[NDArray[np.int32]] = []

    def add(self, cluster: Index, cell: Index, counts: Index) -> None:
        """Further clusters, in their order: how many of their runs lie in each cell."""
        bounds = np.append(np.flatnonzero(np.diff(cluster, prepend=-1)), cluster.size)
        pairs = np.stack([cell.astype(np.int32), counts.astype(np.int32)], axis=1)
        for begin, end in pairwise(bounds.tolist()):
            own = pairs[begin:end]
            key = hashlib.blake2b(own.data, digest_size=16).digest()
            if key not in self._numbers:
                self._numbers[key] = len(self._numbers)
                self._parts.append(own.copy())
            self.of_cluster[cluster[begin]] = self._numbers[key]

    @property
    def patterns(self) -> Patterns:
        """All of them."""
        starts = np.cumsum([0, *(len(one) for one in self._parts)], dtype=np.int64)
        cells, counts = np.concatenate(self._parts).T.astype(np.int64, order="C")
        return Patterns(self.of_cluster, starts, cells, counts)


def _intensities(x: xr.DataArray, flags: xr.DataArray) -> Array:
    """Levels (…, level) or intensities (…, motion) on the dimensions of the curves."""
    last = flags.dims[-2] if "level" in flags.dims else flags.dims[-1]
    dims = [dim for dim in flags.dims if dim not in {"level", "motion"}]
    if not set(x.dims) <= {*dims, last} or last not in x.dims:
        raise ValueError(f"{x.name} must lie on {last} and may lie on {dims}, got dims {x.dims}")
    _positive(str(x.name), x.values)
    like = flags.isel({dim: 0 for dim in ("level", "motion") if dim != last and dim in flags.dims}, drop=True)
    return np.asarray(x.broadcast_like(like).transpose(*dims, last).values, dtype=float)


def _clusters(flags: xr.DataArray) -> Index:
    """The ground motion of each motion, numbered in their order: floors above one, and stripes of one, are it."""
    floors = floor_of_each_motion(flags)
    # (their numbers where there are no labels; in stripes a motion that comes again has another label)
    labels = [str(one) for one in flags["record" if "record" in flags.coords else "motion"].values]
    names = [one.removesuffix(f" floor {floor}") if floor else one for one, floor in zip(labels, floors, strict=True)]
    known = {name: i for i, name in enumerate(dict.fromkeys(names))}
    return np.array([known[name] for name in names], dtype=np.int64)


def _strata(stripe: NDArray[Any], clusters: Index) -> tuple[Index, ...] | None:
    """The ground motions of each stripe, which are drawn stripe by stripe; none where one is in several."""
    members = tuple(np.unique(clusters[stripe == one]) for one in np.unique(stripe))
    return members if sum(one.size for one in members) == clusters.max() + 1 else None


def _positive(name: str, values: Any) -> Array:
    x = checks.finite_array(name, values, ndim=tuple(range(1, 9)))
    if np.any(x <= 0.0):
        raise ValueError(f"{name} must be > 0, got {x.min():g}")
    return x


def _spread(values: xr.DataArray, like: xr.DataArray) -> list[float]:
    """A value for each curve in the order of `like`, NaN where its dimensions are none of the curves'."""
    if not set(values.dims) <= set(like.dims):
        return [np.nan] * like.size
    return [float(one) for one in values.broadcast_like(like).transpose(*like.dims).values.ravel()]


def _kept(data: xr.Dataset, dims: tuple[Hashable, ...]) -> dict[Hashable, xr.DataArray]:
    """The coordinates that lie on the dimensions of the curves alone."""
    return {name: one for name, one in data.coords.items() if set(one.dims) <= set(dims)}


def _level_attributes(x: xr.DataArray) -> dict[str, str]:
    return {
        "units": str(x.attrs.get("units", DIMENSIONLESS)),
        "long_name": str(x.attrs.get("long_name", "level")),
        "im": str(x.attrs.get("im", "")),
    }
