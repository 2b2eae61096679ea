"""Incremental dynamic analysis at levels that are chosen while it runs, until a result is as precise as asked."""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import product
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ...core import checks
from ...core.aliases import Array, Index, Progress
from ...core.doubts import Doubt, warn
from ...core.parameters import USUAL_MEASURE
from ...core.units import STANDARD_GRAVITY
from ...models import Block, Model, RandomSliding
from ...models.plausibility import block_doubts, law_doubts
from ...models.sliding.law import SlidingLaw
from ...motions.arrays import BOTH_AXES, Record
from ...motions.intensity.evaluation import positive_measure
from ...motions.intensity.measure import Measure
from ...motions.intensity.naming import FLOOR, GROUND, GROUND_FLOORS, measure_named
from ...motions.plausibility import record_doubts
from ...motions.polarity import AS_RECORDED
from ...motions.simulated.generator import Generator
from ..adaptive.rate import check_hazard
from ..adaptive.sequential import RUNS, SequentialCurve, WavePlan, reached_so_far
from ..adaptive.stopping import motions_needed, next_wave
from ..adaptive.until import RATE, Until, until_of
from ..fitting.states import OVERTURNED, UPLIFTED, Slip, State, check_axes_of, flags_of, needed_output, state_name
from ..runs.plan import refuse_endless_runs
from ..runs.provenance import ADAPTIVE, AXES
from ..runs.request import ENDS, Request, check_request
from ..runs.runners import Workers
from ..validity.plausibility import cut_slides, end_doubts
from ..validity.slab_screen import ScreenRequest
from ..validity.sparse_screen import Shaken
from ..validity.undecided import perturbed_runs
from .friction_draws import FRICTION, PROPORTIONAL, draws, is_random
from .other_measures import OtherMeasures
from .sparse import WaveRuns, labelled, runs_of, with_estimates, with_sparse_screen
from .waves import (
    MotionSource,
    MotionWave,
    Rows,
    Scaled,
    check_own_levels,
    check_row_factors,
    checked_axes,
    run_rows,
    scaled_to,
)

PGA_RANGE = (1.0, 8.0)
"""First levels in peak acceleration, over g tan(alpha): a block on a rigid floor uplifts at 1."""
PGV_HIGHEST = 8.0
"""Highest first level in peak velocity, over g tan(alpha)/p: large blocks need a long pulse and not a high one."""
SLIP_HIGHEST = 4.0
"""The same of a slip, over the velocity from which friction brings the block to rest in its distance."""


class Plan(NamedTuple):
    """Plan of a sequential analysis: runs of each motion, motions of a source, and their maximum number `most`.

    until: the precision, with the damage state that is sought; scaled: the measure of the levels.
    """

    until: Until
    state: State
    runs_per_motion: int
    seed: int
    scaled: Scaled
    source: MotionSource
    most: int


def adaptive_ida(
    blocks: Block | Sequence[Block],
    models: Model | Sequence[Model],
    motions: Generator | xr.DataArray | Iterable[xr.DataArray],
    im: str | Measure = USUAL_MEASURE,
    until: Mapping[str, Any] | Until | None = None,
    outputs: Sequence[str] | None = None,
    client: Workers = None,
    *,
    ground: xr.DataArray | Iterable[xr.DataArray] | None = None,
    polarity: str = AS_RECORDED,
    runs_per_motion: int = RUNS,
    seed: int = 0,
    progress: Progress | None = None,
) -> xr.Dataset:
    """Incremental dynamic analysis at levels that are chosen while it runs, until the result is precise enough.

    Parameters
    ----------
    blocks, models : one or a sequence
        Blocks and damping laws, with unique labels; laws that slide have the default output slide_peak.
    motions : Generator, xarray.DataArray or a sequence of them
        A generator, which makes motions as they are needed, or labelled motions (m s-2), which are taken in an order
        that `seed` draws.
    im : str or Measure
        The measure of the levels, as for `toppling.ida`.
    until : mapping, optional
        The requested result, and the half width of its interval at 95 % confidence. One of ``median``, ``dispersion``
        and ``rate`` (shares of the value; without an entry, 0.1 of the median) and ``probability`` (a mapping of
        ``level``, SI, and ``within``). ``motions``: a mapping of `least` (64) and ``most`` (2000). ``state``: the
        damage state (`fragility.reached`), overturned if not given; ``uplifted``, a rotation x > 0 times alpha, or, of
        `Sliding` blocks, which have no other, a `fragility.Slip`. ``hazard``: for a rate, a HazardCurve of the measure.
    outputs, client, ground, polarity, progress
        As for `toppling.ida`; the outputs include the output of the state.
    runs_per_motion : int
        Runs of a block under each motion, 1 to 20; the first motions, which look for the curve, have twice as many.
    seed : int
        Of the generator's motions, or of the order in which the motions of a set are taken, and of the levels.

    Returns
    -------
    xarray.Dataset
        The outputs on run, with `run_block`, `run_model`, `run_motion`, `level`, `wave` and, for a rate, `weight`. On
        (block, model) the estimates with their intervals, `stopped_because` and `account` (docs/howto/precision.md).
        The variables of the validity screen, except for sliding blocks. Bit-identical for any chunking, scheduler and
        number of workers.

    Notes
    -----
    Standard errors are from sums over each motion, and the median is from runs near it alone. Two looks in a row need
    intervals a sixth narrower than `until`. A fifth more motions (at least 32) then confirm them.

    Examples
    --------
    >>> import toppling as tp
    >>> shakes = tp.motions.CloughPenzien(duration=10.0, dt=0.01)
    >>> curves = adaptive_ida(tp.Block(0.4, 1.8), tp.EnergyConsistent(), shakes, until={"median": 0.25})
    >>> curves["stopped_because"].item()
    'precision reached'
    """
    laws: list[Any] = list(models) if checks.is_several(models) else [models]
    goal = until_of(until)
    goal = replace(goal, state=_sought_state(goal.state, laws))
    assert goal.state is not None
    wanted = [needed_output(goal.state)] if outputs is None else outputs
    request = check_request(blocks, laws, wanted, True, client, progress, True)
    return adaptive(request, MotionSource(motions, seed, ground, polarity), im, goal, runs_per_motion, seed)


def adaptive(
    request: Request,
    source: MotionSource,
    im: str | Measure,
    until: Until,
    runs_per_motion: int,
    seed: int,
    screening: ScreenRequest | None = None,
) -> xr.Dataset:
    """Run waves of motions until every block has the precision asked for under every law; see `adaptive_ida`.

    `screening`: options of the screen, if requested.
    """
    state = OVERTURNED if until.state is None else until.state
    if needed_output(state) not in request.outputs:
        raise ValueError(f"outputs must hold {needed_output(state)} for adaptive levels, which are chosen by it")
    check_own_levels(request)
    scaled = scaled_to(im)
    _check_hazard(until, scaled)
    plan = Plan(until, state, runs_per_motion, seed, scaled, source, source.most(until))
    doubts = [*block_doubts(request.blocks), *law_doubts(request.blocks, request.models, request.outputs)]
    curves: dict[tuple[int, int], SequentialCurve] = {}
    other_measures = OtherMeasures(scaled)
    cut: dict[str, bool] = {}
    asked = ScreenRequest() if screening is None else screening
    if state != OVERTURNED:  # (stability is tested of that outcome, of which these levels tell little)
        asked = asked._replace(undecided=0.0)
    shaken = Shaken(asked.undecided)
    waves = list(_waves(request, plan, curves, other_measures, doubts, cut, shaken))
    ends = end_doubts(cut.values(), list(cut))
    warn(list(dict.fromkeys([*doubts, *ends])))
    named = {} if state == OVERTURNED else {"state": state_name(state)}
    configuration = {
        **source.describe(),
        **({AXES: waves[0].axes} if waves[0].axes else {}),
        "design": ADAPTIVE,
        "im": scaled.name,
        "until": until.describe(),
        **named,
        "runs_per_motion": runs_per_motion,
        "seed": seed,
        **({"hazard": until.hazard.describe()} if until.hazard is not None else {}),
        **({"im_at": GROUND} if source.on_ground else {}),
    }
    title = "Incremental dynamic analysis of freestanding blocks, at adaptive levels"
    runs = labelled(request, waves, scaled, configuration, title, named.get("state"))
    runs = with_estimates(runs, list(curves.values()), other_measures, named.get("state"))
    runs = with_sparse_screen(runs, request, shaken, asked)
    return runs.assign_attrs(notes=ends[0].sentence) if ends else runs


def _waves(
    request: Request,
    plan: Plan,
    curves: dict[tuple[int, int], SequentialCurve],
    other_measures: OtherMeasures,
    doubts: list[Doubt],
    cut: dict[str, bool],
    shaken: Shaken,
) -> Iterator[WaveRuns]:
    """Run wave after wave until all curves have stopped; curves, other measures and input warnings are added to.

    `cut`: flags, by label, of motions that end while blocks slide; added to, like the screen's data on motions.
    """
    needed = needed_output(plan.state)
    done = records = runs = number = 0
    while not curves or any(not curve.stopped for curve in curves.values()):
        wave = plan.source.wave(done, min(next_wave(done), plan.most - done))
        axes = checked_axes(request, wave.records)
        _check_wave(axes, wave, plan)
        doubts += record_doubts([record for record in wave.records if not record.reverse_of])
        measured = plan.scaled.measured(wave, request.blocks)
        other_measures.add(wave)
        if request.screen:
            shaken.add(wave.records)
        if not curves:
            refuse_endless_runs((("models", *pair) for pair in product(request.blocks, request.models)), wave.records)
            curves |= _begun(request, plan, peaks_of(wave), measured)
        plans = {where: curve.plan(wave.numbers) for where, curve in curves.items() if not curve.stopped}
        rows = _rows(plans)
        outputs = _outputs(request, wave, plans, rows, plan, measured)
        if request.sliding:
            cut |= _cut(outputs, rows.motion, wave.records)
        done = int(wave.numbers[-1]) + 1
        first = 0
        for where, design in plans.items():
            mine = slice(first, first := first + design.levels.size)
            reached = flags_of(outputs[needed][mine], plan.state, request.blocks[where[0]].alpha)
            curves[where].add(wave.numbers, design, reached.reshape(design.levels.T.shape).T, last=done >= plan.most)
        kept = {name: outputs[name] for name in (*request.outputs, FRICTION) if name in outputs}
        if plan.until.target == RATE:
            kept = {"weight": np.concatenate([plan.weights.T.ravel() for plan in plans.values()]), **kept}
        yield runs_of(number, records, wave, rows, kept, plan.scaled, measured, axes)
        of = "" if plan.state == OVERTURNED else f"{state_name(plan.state)}: "
        request.runner.reached(of + reached_so_far(list(curves.values()), done))
        number, records = number + 1, records + len(wave.records)
        about = 2 if axes == BOTH_AXES and not request.sliding else 1
        runs += about * rows.level.size
        if request.progress is not None:
            expected = max(runs, math.ceil(runs / done * _expected(curves, done, plan.most)))
            tests = 0.0
            if request.screen:
                tests = shaken.share * perturbed_runs(1, request.models, 1, 1, 1.0) / len(request.models)
            request.progress(runs, expected + round(tests * expected))


def _begun(
    request: Request, plan: Plan, peaks: tuple[Array, Array], measured: Array
) -> dict[tuple[int, int], SequentialCurve]:
    """Return the curves of all blocks under all laws, whose search begins with the results of the first motions."""
    curves = {}
    for (i, block), (j, law) in product(enumerate(request.blocks), enumerate(request.models)):
        start = slip_start(law, block, plan.state) if isinstance(law, SlidingLaw) else fall_start(block)
        low, high = first_levels(start, peaks, plan.scaled, measured[i % len(measured)])
        curves[i, j] = SequentialCurve(plan.until, low, high, plan.runs_per_motion, plan.seed)
    return curves


def _expected(curves: Mapping[tuple[int, int], SequentialCurve], done: int, most: int) -> int:
    """Return the approximate total number of motions of the slowest curve."""
    looks = [curve.looks[-1] for curve in curves.values() if not curve.stopped]
    return min(most, max((motions_needed(look.motions, look.ratio) or most for look in looks), default=done))


def _sought_state(state: State | None, models: Sequence[Any]) -> State:
    """Return the damage state whose curve is sought; TypeError or ValueError for one that adaptive levels do not serve.

    Falls to one side or over an edge stay rare at any level, and have no lognormal curve.
    """
    slides = any(isinstance(model, SlidingLaw) for model in models)
    if state is None and not slides:
        return OVERTURNED
    if slides != isinstance(state, Slip):
        of = "sliding blocks must be a slip, such as Slip(0.05)" if slides else "rocking blocks must be no slip"
        raise ValueError(f"state of {of}, got {'none' if state is None else repr(state)}")
    assert state is not None
    if isinstance(state, str):
        checks.choice("state of adaptive levels, which may be a number too,", state, (OVERTURNED, UPLIFTED))
    state_name(state)
    return state


def _check_hazard(until: Until, scaled: Scaled) -> None:
    """Raise TypeError or ValueError for a rate without its hazard, or a hazard without a rate."""
    hazard = until.hazard
    if hazard is None:
        if until.target == RATE:
            raise ValueError("until rate needs a hazard curve (until hazard, a HazardCurve), got none")
        return
    if until.target != RATE:
        raise ValueError(f"hazard is for until rate alone, got until {until.target}")
    check_hazard(hazard, scaled.name)


def _check_wave(axes: str, wave: MotionWave, plan: Plan) -> None:
    """Raise ValueError if motions do not suit the state or the hazard."""
    if axes == BOTH_AXES:
        check_axes_of(plan.state)
    hazard = plan.until.hazard
    on_floor = any(record.floor not in GROUND_FLOORS for record in wave.records) and not plan.source.on_ground
    if hazard is not None and (hazard.at == FLOOR) != on_floor:
        where = "floor" if on_floor else "ground"
        raise ValueError(f"hazard must be of the {where}, as the levels are, got one of the {hazard.at}")


Start = tuple[float, float]
"""Peaks of a motion between which the search for a curve begins.

The acceleration at which a block first moves (m/s2), and the velocity that takes nearly all to their state (m/s).
"""


def fall_start(block: Block) -> Start:
    """Return the start of the search for the curve of a rocking block: a pulse of g tan(alpha) makes it uplift."""
    static = STANDARD_GRAVITY * math.tan(block.alpha)
    return static, PGV_HIGHEST * static / block.p


def slip_start(law: SlidingLaw, block: Block, state: State) -> Start:
    """Return the start of the search for the curve of a slip: a velocity v moves a block by v^2/(2 mu g)."""
    assert isinstance(state, Slip)  # (checked with the request)
    static = STANDARD_GRAVITY * float(law.coefficients(block, np.array(0.5)))
    return static, SLIP_HIGHEST * math.sqrt(2.0 * static * state.distance)


def peaks_of(wave: MotionWave) -> tuple[Array, Array]:
    """Return PGA and PGV of the motions of a wave, (motion,) each."""
    pga, pgv = (positive_measure(measure_named(name, "im"), wave.records) for name in ("pga", "pgv"))
    return pga, pgv


def first_levels(start: Start, peaks: tuple[Array, Array], scaled: Scaled, measured: Array) -> tuple[float, float]:
    """Return the levels between which the search for a block's curve begins, from the peaks of the first motions.

    measured (motion,): the measure of the unscaled motions.
    """
    (pga, pgv), (moves, far) = peaks, start
    low, high = (share * moves / pga for share in PGA_RANGE)
    high = np.maximum(high, far / pgv)
    return float(np.median(scaled.level(low, measured))), float(np.median(scaled.level(high, measured)))


def _rows(plans: Mapping[tuple[int, int], WavePlan]) -> Rows:
    """Return the runs of a wave, curve by curve and motion by motion."""
    sizes = [plan.levels.size for plan in plans.values()]
    shapes = [plan.levels.shape for plan in plans.values()]
    return Rows(
        np.repeat([block for block, _ in plans], sizes),
        np.repeat([model for _, model in plans], sizes),
        np.concatenate([np.repeat(np.arange(motions), runs) for runs, motions in shapes]),
        np.concatenate([plan.levels.T.ravel() for plan in plans.values()]),
    )


def _outputs(
    request: Request,
    wave: MotionWave,
    plans: Mapping[tuple[int, int], WavePlan],
    rows: Rows,
    plan: Plan,
    measured: Array,
) -> dict[str, NDArray[Any]]:
    """Return the outputs (run,) of a wave, and the coefficients of friction if these are drawn."""
    factors = plan.scaled.factors(rows.level, measured[rows.block % len(measured), rows.motion])
    check_row_factors(rows, factors, wave.records)
    if not is_random(request.models):
        return run_rows(request, wave.records, rows, factors)
    friction = np.concatenate(
        [
            draws(law, request.blocks[block], plan.seed, wave.numbers, design.levels.shape[0]).T.ravel()
            for (block, model), design in plans.items()
            if isinstance(law := request.models[model], SlidingLaw)
        ]
    )
    drawn = np.array([isinstance(law, RandomSliding) for law in request.models])[rows.model]
    factors = np.where(drawn, factors / friction, factors)
    outputs = run_rows(request, wave.records, rows, factors)
    for name in PROPORTIONAL & outputs.keys():
        outputs[name] = np.where(drawn, outputs[name] * friction, outputs[name])
    return {**outputs, FRICTION: friction}


def _cut(outputs: Mapping[str, NDArray[Any]], motion: Index, records: Sequence[Record]) -> dict[str, bool]:
    """Return flags, by label, of the motions that end while blocks slide."""
    on = np.zeros(len(records), np.bool_)
    on[motion[cut_slides(*(outputs[name] for name in ENDS))]] = True
    return dict(zip([record.label for record in records], on.tolist(), strict=True))
