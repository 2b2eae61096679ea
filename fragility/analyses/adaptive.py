"""Incremental dynamic analysis at levels that are chosen while it runs, until a result is as precise as asked."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import product
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ...core import checks
from ...core.aliases import Array, Flags
from ...core.doubts import Doubt, warn
from ...core.units import STANDARD_GRAVITY
from ...models import Block, RandomSliding
from ...models.sliding.law import SlidingLaw
from ...motions.arrays import BOTH_AXES
from ...motions.intensity.dataset import measure_named, positive_measure
from ...motions.intensity.measure import Measure
from ...motions.intensity.naming import FLOOR, GROUND, GROUND_FLOORS
from ...motions.plausibility import record_doubts
from ...motions.polarity import AS_RECORDED, BOTH
from ...motions.simulated.generator import Generator
from ..adaptive.account import reached_so_far
from ..adaptive.curve import SequentialCurve, WavePlan
from ..adaptive.rate import check_ends
from ..adaptive.stopping import motions_needed, next_wave
from ..adaptive.until import RATE, Until
from ..fitting.states import OVERTURNED, UPLIFTED, Slip, State, check_axes_of, flags_of, needed_output, state_name
from ..hazard.curve import HazardCurve
from ..runs.axes import axes_of, check_axes, check_outputs
from ..runs.plan import refuse_endless_runs
from ..runs.progress import part_of
from ..runs.provenance import ADAPTIVE, AXES, RUN
from ..runs.request import DERIVED, ENDS, Request, check_vertical
from ..runs.scaling import check_factors
from ..validity.plausibility import block_doubts, cut_slides, end_doubts, law_doubts
from ..validity.screen import with_screen
from ..validity.slab_screen import ScreenRequest
from ..validity.sparse_screen import Shaken, sparse_screen
from ..validity.undecided import perturbed_runs
from .analysis import specimens_of
from .friction_draws import FRICTION, PROPORTIONAL, check_draws, draws, is_random, specimens_in
from .other_measures import OtherMeasures
from .sparse import WaveRuns, labelled, runs_of
from .waves import MotionSource, MotionWave, Scaled, run_wave, scaled_to

PGA_RANGE = (1.0, 8.0)
"""First levels in peak acceleration, over g tan(alpha): a block on a rigid floor uplifts at 1."""
PGV_HIGHEST = 8.0
"""Highest first level in peak velocity, over g tan(alpha)/p: large blocks need a long pulse and not a high one."""
SLIP_HIGHEST = 4.0
"""The same of a slip, over the velocity from which friction brings the block to rest in its distance."""


class Plan(NamedTuple):
    """What a sequential analysis does, checked.

    until: the precision; state: the damage state whose curve is sought; runs_per_motion, seed: as of `toppling.ida`;
    hazard: of the levels' measure, for rates alone; scaled: the measure; source: the motions, `most` of them at most;
    ground: whether levels refer to the ground below floors.
    """

    until: Until
    state: State
    runs_per_motion: int
    seed: int
    hazard: HazardCurve | None
    scaled: Scaled
    source: MotionSource
    most: int
    ground: bool


def adaptive(
    request: Request,
    motions: Generator | xr.DataArray | Iterable[xr.DataArray],
    im: str | Measure,
    until: Until,
    *,
    state: State,
    runs_per_motion: int,
    seed: int,
    hazard: HazardCurve | None = None,
    ground: xr.DataArray | Iterable[xr.DataArray] | None = None,
    polarity: str = AS_RECORDED,
    screening: ScreenRequest | None = None,
) -> xr.Dataset:
    """Run waves of motions until every block has the precision asked for under every law; see `toppling.ida`.

    screening: what is asked of the screen, where the request wants one.
    """
    _check_request(request, state)
    scaled = scaled_to(im)
    _check_hazard(until, hazard, scaled)
    source = MotionSource(motions, seed, ground, polarity)
    plan = Plan(until, state, runs_per_motion, seed, hazard, scaled, source, source.most(until), ground is not None)
    doubts = [*block_doubts(request.blocks), *law_doubts(request.blocks, request.models, request.outputs)]
    curves: dict[tuple[int, int], SequentialCurve] = {}
    others = OtherMeasures(scaled)
    cut: dict[str, bool] = {}
    asked = ScreenRequest() if screening is None else screening
    if state != OVERTURNED:  # (stability is tested of that outcome, of which these levels tell little)
        asked = asked._replace(undecided=0.0)
    shaken = Shaken(asked.undecided)
    waves = list(_waves(request, plan, curves, others, doubts, cut, shaken))
    ends = end_doubts(cut.values(), list(cut))
    doubts += ends
    warn(list(dict.fromkeys(doubts)))
    axes = waves[0].axes
    configuration = {
        **specimens_of(request).configuration,
        **source.describe(),
        **({"polarity": BOTH} if polarity == BOTH else {}),
        **({AXES: axes} if axes else {}),
        "design": ADAPTIVE,
        "im": scaled.name,
        "until": until.describe(),
        **({} if state == OVERTURNED else {"state": state_name(state)}),
        "runs_per_motion": runs_per_motion,
        "seed": seed,
        **({"hazard": hazard.describe()} if hazard is not None else {}),
        **({"im_at": GROUND} if ground is not None else {}),
    }
    found = labelled(request, list(curves.values()), waves, scaled, others, state, configuration)
    if request.screen:
        told = part_of(request.progress, (2 if axes == BOTH_AXES else 1) * found.sizes[RUN])
        found = with_screen(found, sparse_screen(found, shaken, asked, request.runner, told))
    return found.assign_attrs(notes=ends[0].sentence) if ends else found


def _waves(
    request: Request,
    plan: Plan,
    curves: dict[tuple[int, int], SequentialCurve],
    others: OtherMeasures,
    doubts: list[Doubt],
    cut: dict[str, bool],
    shaken: Shaken,
) -> Iterator[WaveRuns]:
    """Run wave after wave until all curves have stopped; curves, other measures and doubts are added to.

    cut: whether blocks still slide when a motion ends, by its label; added to, as is what the screen needs of motions.
    """
    needed = needed_output(plan.state)
    done = records = runs = number = 0
    while not curves or any(not one.stopped for one in curves.values()):
        wave = plan.source.wave(done, min(next_wave(done), plan.most - done))
        axes = _check_wave(request, wave, plan)
        doubts += record_doubts([one for one in wave.records if not one.reverse_of])
        measured = plan.scaled.measured(wave, request.blocks)
        others.add(wave)
        if request.screen:
            shaken.add(wave.records)
        if not curves:
            refuse_endless_runs((("models", *pair) for pair in product(request.blocks, request.models)), wave.records)
            curves |= _begun(request, plan, peaks_of(wave), measured)
        plans = {where: one.plan(wave.numbers) for where, one in curves.items() if not one.stopped}
        found, ends = _outputs(request, wave, plans, plan, measured)
        if request.sliding:
            cut |= dict(zip([one.label for one in wave.records], ends.tolist(), strict=True))
        done = int(wave.numbers[-1]) + 1
        for where, own in plans.items():
            reached = flags_of(found[where][needed], plan.state, request.blocks[where[0]].alpha)
            curves[where].add(wave.numbers, own, reached, last=done >= plan.most)
        yield runs_of(number, records, wave, plans, found, plan.scaled, measured, axes)
        of = "" if plan.state == OVERTURNED else f"{state_name(plan.state)}: "
        request.runner.reached(of + reached_so_far(list(curves.values()), done))
        number, records = number + 1, records + len(wave.records)
        about = 2 if axes == BOTH_AXES and not request.sliding else 1
        runs += about * sum(one.levels.size for one in plans.values())
        if request.progress is not None:
            expected = max(runs, math.ceil(runs / done * _expected(curves, done, plan.most)))
            tests = 0.0
            if request.screen:
                tests = shaken.share * perturbed_runs(1, request.models, 1, 1, 1.0) / len(request.models)
            request.progress(runs, expected + round(tests * expected))


def _begun(
    request: Request, plan: Plan, peaks: tuple[Array, Array], measured: Array
) -> dict[tuple[int, int], SequentialCurve]:
    """Return the curves of all blocks under all laws, whose search begins at what the first motions tell."""
    found = {}
    for block, one in enumerate(request.blocks):
        for model, law in enumerate(request.models):
            start = slip_start(law, one, plan.state) if isinstance(law, SlidingLaw) else fall_start(one)
            low, high = first_levels(start, peaks, plan.scaled, measured[block % len(measured)])
            begun = SequentialCurve(plan.until, low, high, plan.runs_per_motion, plan.seed, plan.hazard)
            found[block, model] = begun
    return found


def _expected(curves: Mapping[tuple[int, int], SequentialCurve], done: int, most: int) -> int:
    """Return about how many motions the slowest curve takes in all."""
    looks = [one.looks[-1] for one in curves.values() if not one.stopped]
    return min(most, max((motions_needed(one.motions, one.ratio) or most for one in looks), default=done))


def sought_state(state: State | None, models: Sequence[Any]) -> State:
    """Return the damage state whose curve is sought; TypeError or ValueError for one that adaptive levels do not serve.

    Falls to one side or over an edge stay rare at any shaking, and have no lognormal curve.
    """
    slides = any(isinstance(one, SlidingLaw) for one in models)
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


def _check_request(request: Request, state: State) -> None:
    """Raise ValueError for requests that adaptive levels do not serve."""
    if needed_output(state) not in request.outputs:
        raise ValueError(f"outputs must hold {needed_output(state)} for adaptive levels, which are chosen by it")
    derived = next((name for name in request.outputs if name in DERIVED), None)
    if derived is not None:
        raise ValueError(f"outputs of adaptive levels must not hold {derived}: give levels for it")


def _check_hazard(until: Until, hazard: HazardCurve | None, scaled: Scaled) -> None:
    """Raise TypeError or ValueError for a rate without its hazard, or a hazard without a rate."""
    if hazard is None:
        if until.target == RATE:
            raise ValueError("until rate needs a hazard curve (hazard=HazardCurve(…)), got none")
        return
    if not isinstance(hazard, HazardCurve):
        raise TypeError(f"hazard must be a HazardCurve, got {checks.kind(hazard)}")
    if until.target != RATE:
        raise ValueError(f"hazard is for until rate alone, got until {until.target}")
    if hazard.im != scaled.name:
        raise ValueError(f"hazard must be of the measure of the levels, {scaled.name!r}, got {hazard.im!r}")
    check_ends(hazard)


def _check_wave(request: Request, wave: MotionWave, plan: Plan) -> str:
    """Return how motions shake; ValueError where they do not suit the blocks, the laws or the hazard."""
    check_vertical(request.models, wave.records)
    check_draws(request.models, request.blocks, wave.records)
    axes = axes_of(wave.records)
    check_axes(axes, request.blocks, request.models)
    check_outputs(axes, request.outputs, request.models)
    if axes == BOTH_AXES:
        check_axes_of(plan.state)
    on_floor = any(one.floor not in GROUND_FLOORS for one in wave.records) and not plan.ground
    if plan.hazard is not None and (plan.hazard.at == FLOOR) != on_floor:
        where = "floor" if on_floor else "ground"
        raise ValueError(f"hazard must be of the {where}, as the levels are, got one of the {plan.hazard.at}")
    return axes


Start = tuple[float, float]
"""Peaks of a motion between which the search for a curve begins.

The acceleration at which a block first moves (m/s2), and the velocity that takes nearly all to their state (m/s).
"""


def fall_start(block: Block) -> Start:
    """Return where the search for the curve of a rocking block begins: a pulse of g tan(alpha) makes it uplift."""
    static = STANDARD_GRAVITY * math.tan(block.alpha)
    return static, PGV_HIGHEST * static / block.p


def slip_start(law: SlidingLaw, block: Block, state: State) -> Start:
    """Return where the search for the curve of a slip begins: a velocity v takes a block v^2/(2 mu g) far."""
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


def _outputs(
    request: Request, wave: MotionWave, plans: Mapping[tuple[int, int], WavePlan], plan: Plan, measured: Array
) -> tuple[dict[tuple[int, int], dict[str, NDArray[Any]]], Flags]:
    """Run a wave: the outputs (run, motion) of each curve, and whether a block still slides when a motion ends.

    Curves with equally many runs a motion run together.
    """
    both, laws = axes_of(wave.records) == BOTH_AXES, len(request.models)
    specimens = specimens_in(request, both and request.sliding)
    across = request.specimens(across=True)
    random = is_random(request.models)
    found: dict[tuple[int, int], dict[str, NDArray[Any]]] = {}
    cut = np.zeros(len(wave.records), np.bool_)
    for n in sorted({one.levels.shape[0] for one in plans.values()}):
        own = [where for where, one in plans.items() if one.levels.shape[0] == n]
        factors = np.stack([plan.scaled.factors(plans[at].levels, measured[at[0] % len(measured)]) for at in own])
        check_factors(factors, wave.records)
        sliding = [(at, request.models[at[1]]) for at in (own if random else ())]
        friction = {
            at: draws(law, request.blocks[at[0]], plan.seed, wave.numbers, n)
            for at, law in sliding
            if isinstance(law, SlidingLaw)
        }
        at_random = [k for k, (_, law) in enumerate(sliding) if isinstance(law, RandomSliding)]
        for k in at_random:
            factors[k] /= friction[own[k]]
        numbers = [block * laws + model for block, model in own]
        other = [across[i] for i in numbers] if both and not request.sliding else None
        results = run_wave(request, [specimens[i] for i in numbers], other, wave.records, factors)
        for k in at_random:
            for name in PROPORTIONAL & results.keys():
                results[name][k] *= friction[own[k]]
        for k, where in enumerate(own):
            found[where] = {name: results[name][k] for name in request.outputs}
            if random:
                found[where][FRICTION] = friction[where]
        if request.sliding:
            cut |= cut_slides(*(results[name] for name in ENDS))
    return found, cut
