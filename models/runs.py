"""Runs as plain arrays: oscillators and scale factors in, results out.  No labels; calls the compiled engine.

Sliding blocks go to the engine of their own (`sliding.runs`), by the same way.
"""

import hashlib
from collections.abc import Sequence
from functools import lru_cache
from importlib import metadata
from pathlib import Path
from typing import Any, NamedTuple, Protocol, cast

import numpy as np

from ..core import checks
from ..core.aliases import Array, Index
from ..core.units import STANDARD_GRAVITY
from .block import Block
from .engine import tables
from .engine.exact_runs import run_exact
from .engine.linear_runs import run_lanes
from .engine.regions import AT_REST
from .engine.starts import begin_runs
from .laws import HousnerImpact
from .oscillator import Oscillator, Stack, stack
from .sliding.law import PlaneSlider, Slider
from .sliding.runs import (
    PlaneTable,
    friction_table,
    plane_table,
    run_in_plane,
    run_sliders,
)

Specimen = Oscillator | Slider | PlaneSlider
"""A block under a law in numbers."""

TALLY: tuple[str, ...] = tables.TALLY
"""The engine's counts: samples of all runs, samples left out by reason, and events solved."""

_NO_START = np.empty(0)

ENOUGH_OF_ONE = 400
"""Runs of one motion that fill the lanes of the engine by themselves: they need not be mixed with others."""

# Samples of the records that one batch holds, at 8 bytes each (and 16 more where only flags are asked).
_MOST_SAMPLES = 2_000_000

NO_TURNS = np.empty((2, 0))
NO_HISTORY = np.empty((tables.HISTORY_ROWS, 0))
_NOTHING_LEFT = np.empty(0)


class Records(NamedTuple):
    """Records of one step dt, s, one after the other.

    `record` (n,): accelerations, m/s². `lifting` (n or 0): vertical accelerations over g. `start`, `last` (k,): of each
    record, the place of its first sample and the number of its last one.
    """

    dt: float
    record: Array
    lifting: Array
    start: Index
    last: Index


def lay_out(accelerations: Sequence[Array], dt: float, verticals: Sequence[Array] = ()) -> Records:
    """Lay out records (n,), m/s², and the vertical components of all or none of them, m/s² upward, for the engine.

    Each begins at a whole span, with room behind it for the samples that the lanes read ahead. The distance from one to
    the next is an odd number of spans: otherwise records of equal length would share the same sets of the processor's
    cache.
    """
    sizes = np.array([acceleration.size for acceleration in accelerations], np.int64)
    spans = (sizes + tables.TILE) // tables.SPAN + 1
    spans += 1 - spans % 2
    start = np.zeros(sizes.size, np.int64)
    np.cumsum(spans[:-1] * tables.SPAN, out=start[1:])
    total = int(spans.sum()) * tables.SPAN
    record = _one_after_another(accelerations, start, total, 1.0)
    lifting = _one_after_another(verticals, start, total, STANDARD_GRAVITY) if len(verticals) > 0 else np.empty(0)
    return Records(dt, record, lifting, start, sizes - 1)


def _one_after_another(values: Sequence[Array], start: Index, total: int, unit: float) -> Array:
    """Return records in units of `unit`, with zeros between them."""
    series = np.empty(total)
    for first, stop, value in zip(start.tolist(), [*start[1:].tolist(), total], values, strict=True):
        series[first : first + value.size] = value if unit == 1.0 else value / unit
        series[first + value.size : stop] = 0.0
    return series


def batch_of(
    records: Records,
    arrays: Stack,
    which: Index,
    motion: Index,
    factors: Array,
    tally: Index,
    turns: Array = NO_TURNS,
    history: Array = NO_HISTORY,
) -> tables.Batch:
    """Return runs of oscillators which[j] under factors[j] times record motion[j], with room for their results.

    A vertical component of an oscillator in linear geometry is a ValueError.
    """
    oscillators, regions, _ = arrays.tables.shape
    if records.lifting.size > 0 and not arrays.parameters[:, tables.PAR_EXACT].all():
        raise ValueError("vertical shaking needs exact geometry, got an oscillator in linear geometry")
    return tables.Batch(
        shaking=tables.Shaking(
            record=records.record,
            dt=records.dt,
            highs=np.zeros(records.record.size // tables.SPAN),
            start=records.start[motion],
            last=records.last[motion],
            strongest=np.empty(which.size),
        ),
        model=tables.Model(*arrays[:-1]),
        steps=np.zeros((oscillators, regions, tables.STEP_COLUMNS)),
        which=which,
        # (numba compiles once more for arrays that are read-only or not contiguous)
        factors=np.require(factors, requirements=["C", "W"]),
        first=np.zeros(which.size, np.int64),
        begin=np.zeros((which.size, 4)),
        lifting=records.lifting,
        lifting_highs=np.zeros(records.lifting.size // tables.SPAN),
        shaking_left=_NOTHING_LEFT,
        lifting_left=_NOTHING_LEFT,
        barriers=np.zeros((oscillators, 7)),
        out=np.empty((which.size, tables.OUT_COLUMNS)),
        turns=turns,
        history=history,
        tally=tally,
    )


def leaves_floor(factors: Any, downward: Any) -> Any:
    """Return True if the floor falls faster than g: `factors` times the downward acceleration, m/s² (any arrays)."""
    return 1.0 - factors * (downward / STANDARD_GRAVITY) <= tables.LEAST_WEIGHT


def run_many(
    oscillators: Sequence[Oscillator],
    factors: Array,
    acceleration: Array,
    dt: float,
    skip: bool = True,
    flags_only: bool = False,
    tally: Index | None = None,
    vertical: Array | None = None,
) -> Array:
    """Results (o, m, 15) of every oscillator under factors (o, m) times one record (n,), m/s², all starting at rest.

    `skip` leaves out the known part before the first uplift; flags do not change, peaks only by rounding. With
    `flags_only` it also ends a run once the rest of the record cannot overturn the block: then only the overturned flag
    is right. `tally` (see `TALLY`) is added to. `vertical` (n,), m/s² upward, is scaled as the record: oscillators in
    exact geometry only. If it takes the weight from a block at any time, the run is airborne: all other results are
    NaN. ValueError if a record times its factor is beyond `checks.MAX_ACCELERATION`, above which no result is safe.
    """
    for shaking in (acceleration,) if vertical is None else (acceleration, vertical):
        checks.acceleration("acceleration times its largest factor", shaking * np.abs(factors).max())
    return run_stacked(stack(oscillators), factors, acceleration, dt, skip, flags_only, tally, vertical)


def stacked(specimens: Sequence[Specimen]) -> Stack | PlaneTable | Array:
    """Return oscillators, or sliding blocks of one kind alone, as the arrays that their engine reads."""
    planar = [specimen for specimen in specimens if isinstance(specimen, PlaneSlider)]
    if len(planar) == len(specimens):
        return plane_table(planar)
    sliders = [specimen for specimen in specimens if isinstance(specimen, Slider)]
    if len(sliders) == len(specimens):
        return friction_table(sliders)
    return stack([specimen for specimen in specimens if isinstance(specimen, Oscillator)])


class Motion(Protocol):
    """Properties of a motion that a run needs (as in `Record`): accelerations (n,), m/s², and their step, s."""

    @property
    def acceleration(self) -> Array:
        """Horizontal acceleration of the floor (n,), m/s²."""

    @property
    def vertical(self) -> Array | None:
        """Vertical acceleration (n,), m/s² upward, scaled as the horizontal one; None without."""

    @property
    def companion(self) -> Array | None:
        """Horizontal acceleration across (n,), m/s², for blocks that slide in the plane; None without."""

    @property
    def dt(self) -> float:
        """Step, s."""


def run_specimens(
    arrays: Stack | PlaneTable | Array,
    factors: Array,
    motion: Motion,
    skip: bool,
    flags_only: bool,
    tally: Index,
) -> Array:
    """Run specimens that are `stacked` already under factors (o, m) times one motion; results (o, m, `COLUMNS`).

    Blocks that slide in the plane need the component along the depth, which others leave alone.
    """
    shaking, up, dt = motion.acceleration, motion.vertical, motion.dt
    if isinstance(arrays, PlaneTable):
        if motion.companion is None:
            raise ValueError("blocks that slide in the plane need both horizontal components, got one")
        return run_in_plane(arrays.friction, factors, (shaking, motion.companion), up, dt, skip, tally)
    if isinstance(arrays, Stack):
        return run_stacked(arrays, factors, shaking, dt, skip, flags_only, tally, vertical=up)
    return run_sliders(arrays, factors, shaking, up, dt, skip, tally)


class EndlessRunError(ValueError):
    """A run that would take hours: see `tables.MOST_PIECES`."""


def run_mixed(
    arrays: Stack | PlaneTable | Array,
    specimen: Index,
    motion: Index,
    factors: Array,
    motions: Sequence[Motion],
    skip: bool = True,
    flags_only: bool = False,
    tally: Index | None = None,
) -> Array:
    """Return the results (m, `COLUMNS`) of a list of runs, each of a specimen, a motion and a factor of its own.

    `specimen` and `motion` (m,) are the places in `arrays` (as `stacked` gives them, of one caller at a time) and in
    `motions`; the factors scale the motions. The runs fill the engine's lanes side by side. A few runs of each of many
    motions therefore cost hardly more than as many runs of one motion. Motion by motion (`run_specimens`) they would
    cost many times more. The results of a run are as from `run_specimens`, to the last bit: they depend neither on the
    other runs of the list nor on their order. A vertical component of an oscillator in linear geometry is a ValueError.
    """
    counts = np.zeros(len(TALLY), np.int64) if tally is None else tally
    mixes = isinstance(arrays, Stack)
    computed: list[Array] = []
    places: list[Index] = []
    for runs in _parts(specimen, motion, motions, mixes):
        used, row = np.unique(motion[runs], return_inverse=True)
        shakes = [motions[i] for i in used.tolist()]
        first = shakes[0]
        if isinstance(arrays, Stack):
            verticals = [motion.vertical for motion in shakes if motion.vertical is not None] if _lifts(first) else []
            records = lay_out([motion.acceleration for motion in shakes], first.dt, verticals)
            results = _results(records, arrays, specimen[runs], row, factors[runs], skip, flags_only, counts)
        else:
            rows, scale = _rows(arrays, specimen[runs]), factors[runs][:, None]
            results = run_specimens(rows, scale, first, skip, flags_only, counts)[:, 0]
        computed.append(results)
        places.append(runs)
    together = np.concatenate(computed)
    together[np.concatenate(places)] = together.copy()
    return together


def _rows(arrays: PlaneTable | Array, which: Index) -> PlaneTable | Array:
    """Return the tables of some sliding blocks."""
    return PlaneTable(arrays.friction[which]) if isinstance(arrays, PlaneTable) else arrays[which]


def _lifts(motion: Motion) -> bool:
    return motion.vertical is not None and bool(motion.vertical.any())


def _parts(specimen: Index, motion: Index, motions: Sequence[Motion], mixes: bool) -> list[Index]:
    """Places of runs that share a batch: of motions of one step, with or without a vertical component, by length.

    Runs are sorted by motion and specimen there. Motions that have enough runs for a batch of their own get one, as do
    all if specimens do not mix motions.
    """
    runs = np.bincount(motion, minlength=len(motions))
    named = ((i, motions[i]) for i in np.flatnonzero(runs).tolist())
    kinds = {i: (record.dt, _lifts(record), record.acceleration.size) for i, record in named}
    used = sorted(kinds, key=lambda i: (*kinds[i], i))
    rank = np.zeros(len(motions), np.int64)
    rank[used] = np.arange(len(used))
    ends = np.cumsum(runs[used])
    cuts, samples = [], 0
    for k in range(1, len(used)):
        samples += kinds[used[k - 1]][2]
        apart = not mixes or max(runs[used[k - 1]], runs[used[k]]) >= ENOUGH_OF_ONE
        if apart or kinds[used[k]][:2] != kinds[used[k - 1]][:2] or samples + kinds[used[k]][2] > _MOST_SAMPLES:
            cuts.append(ends[k - 1])
            samples = 0
    return np.split(np.lexsort((specimen, rank[motion])), cuts)


def run_stacked(
    arrays: Stack,
    factors: Array,
    acceleration: Array,
    dt: float,
    skip: bool = True,
    flags_only: bool = False,
    tally: Index | None = None,
    vertical: Array | None = None,
) -> Array:
    """Run oscillators that are stacked already, as `run_many` does.

    Stacking costs as much as several runs, so a caller stacks once for all motions.  The stacked tables belong to one
    caller at a time: the engine changes them for a while.
    """
    counts = np.zeros(len(TALLY), np.int64) if tally is None else tally
    which = np.repeat(np.arange(factors.shape[0]), factors.shape[1])
    # (without vertical shaking, the same arithmetic as ever)
    records = lay_out([acceleration], dt, [vertical] if vertical is not None and vertical.any() else [])
    results = _results(records, arrays, which, np.zeros_like(which), factors.ravel(), skip, flags_only, counts)
    return results.reshape(*factors.shape, tables.OUT_COLUMNS)


def _results(
    records: Records,
    arrays: Stack,
    which: Index,
    motion: Index,
    factors: Array,
    skip: bool,
    flags_only: bool,
    tally: Index,
) -> Array:
    """Results (m, 15) of oscillators which[j] under factors[j] times record motion[j], all starting at rest."""
    batch = batch_of(records, arrays, which, motion, factors, tally)
    limits = arrays.limits[which]
    limited = bool(np.isfinite(limits).any())
    # (a run that is left once nothing can overturn the block has not its peak)
    run_batch(batch, _NO_START, skip, flags_only and not limited)
    if limited:
        batch.out[batch.out[:, tables.OUT_PEAK] >= limits, tables.OUT_OVERTURNED] = 1.0
    if flags_only:
        unknown = np.delete(np.arange(tables.OUT_COLUMNS), [tables.OUT_OVERTURNED, tables.OUT_AIRBORNE])
        batch.out[:, unknown] = np.nan
    return cast("Array", batch.out)


def run_batch(batch: tables.Batch, start: Array, skip: bool, flags_only: bool) -> int:
    """Run a batch from `start` (theta, omega, region), or all from rest if it is empty.

    `skip`: leave out the known part before the first uplift; with `flags_only` also the part that cannot overturn the
    block any more, and then only OUT_OVERTURNED is right. Returns the number of turning points of the last run; raises
    EndlessRunError if a run has more events than the engine solves.
    """
    if skip and flags_only:
        spans = batch.shaking.record.size // tables.SPAN
        batch = batch._replace(shaking_left=np.empty(spans), lifting_left=np.zeros(spans))
    # Each driver is compiled when it is first called: an analysis without exact geometry never compiles the other one.
    linear, exact = begin_runs(batch, start, skip, flags_only)
    turns = 0
    if exact.size > 0:
        turns = run_exact(batch, exact, AT_REST if batch.lifting.size > 0 else None)
    # Runs that begin and end alike go together; lanes whose runs have ended stay empty.
    last = batch.shaking.last
    linear = linear[np.lexsort((batch.first[linear], last[linear]))]
    for part in np.array_split(linear, -(-linear.size // tables.LANES) or 1):
        if part.size > 0:
            runs = part[np.lexsort((last[part], batch.first[part]))]
            turns = run_lanes(batch, runs, np.unique(last[part]))
    if (batch.out[:, tables.OUT_OVERTURNED] == tables.GIVEN_UP).any():
        raise EndlessRunError(
            f"a run has more than {tables.MOST_PIECES:,} events: the block vibrates or bounces too fast for its "
            "record; take a larger delta or gap, or a smaller e or zeta"
        )
    return turns


@lru_cache(maxsize=1)
def engine_identity() -> dict[str, str]:
    """Return the versions, the source hash and the processor that, with the inputs, determine a run to the last bit."""
    from ..core.machine_code import processor  # noqa: PLC0415 - numba, which takes a second

    source = hashlib.sha256()
    models = Path(__file__).parent
    core = models.parent / "core"
    for file in (core / "compiled.py", core / "machine_code.py", *sorted(models.rglob("*.py"))):
        source.update(file.read_bytes())
    versions = {name: metadata.version(name) for name in ("toppling", "numpy", "numba")}
    return {**versions, "engine": source.hexdigest()[:12], "processor": processor()}


def compile_lanes() -> None:
    """Compile the driver of linear geometry, the largest; all its batches have the same types."""
    oscillator, none = HousnerImpact().oscillator(Block(width=0.3, height=1.2)), np.zeros(1, np.int64)
    records, tally = lay_out([np.zeros(2)], 0.01, []), np.zeros(len(TALLY), np.int64)
    batch = batch_of(records, stack([oscillator]), none, none, np.ones(1), tally)
    run_lanes.compile_for(batch, none, none)


def compile_aside(statement: str) -> bool:
    """Let another process compile that driver by a statement, as `Kernel.compile_aside`; False if it need not.

    With NUMBA_DISABLE_JIT=1 it is a plain function.
    """
    aside = getattr(run_lanes, "compile_aside", None)
    return aside is not None and bool(aside(statement))


def prepare(oscillators: Sequence[Oscillator], sliding: bool = False, plane: bool = False) -> None:
    """Load or compile the engine's drivers that these oscillators need (once after installation: half a minute).

    `sliding`: the driver of sliding blocks as well; `plane`: of those that slide under both horizontal components.
    """
    kinds = {oscillator.exact: oscillator for oscillator in oscillators}
    run_many(list(kinds.values()), np.ones((len(kinds), 1)), np.zeros(2), 0.01, skip=False)
    if sliding:
        run_sliders(friction_table([Slider(0.5, 0.5, 0.5, 0.5)]), np.ones((1, 1)), np.zeros(2), None, 0.01, skip=False)
    if plane:
        friction = plane_table([PlaneSlider(0.5, 0.5)]).friction
        run_in_plane(friction, np.ones((1, 1)), (np.zeros(2), np.zeros(2)), None, 0.01, skip=False)


class Trace(NamedTuple):
    """One run in full: results (15,), history (5, n) at the samples, turning points (2, t): time and rotation."""

    results: Array
    history: Array
    turning_points: Array


def trace(
    oscillator: Oscillator,
    acceleration: Array,
    dt: float,
    theta0: float = 0.0,
    omega0: float = 0.0,
    max_turning_points: int = 0,
    vertical: Array | None = None,
) -> Trace:
    """One run with its history, from (theta0, omega0); arguments as of `run_many`."""
    arrays = stack([oscillator])
    # (0 in place of values that are too small for the engine)
    theta, omega = (0.0 if abs(value) < tables.NOTHING else value for value in (theta0, omega0))
    if theta == 0.0 and omega == 0.0:
        theta = oscillator.balance
    start = np.array([theta, omega, float(oscillator.region_at(theta, omega))])
    batch = batch_of(
        lay_out([acceleration], dt, [vertical] if vertical is not None and vertical.any() else []),
        arrays,
        np.zeros(1, np.int64),
        np.zeros(1, np.int64),
        np.ones(1),
        np.zeros(len(TALLY), np.int64),
        np.empty((2, max_turning_points)),
        np.empty((tables.HISTORY_ROWS, acceleration.size)),
    )
    turns = run_batch(batch, start, False, False)
    return Trace(batch.out[0], batch.history, batch.turns[:, : min(turns, max_turning_points)])
