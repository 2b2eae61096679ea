"""Performance assessment (FEMA P-58): joint outcomes in a building at a level, in an earthquake, or per year."""

import itertools
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from ...core import checks
from ...core.aliases import Array, Flags
from ...core.doubts import warn
from ...core.parameters import BETA_M, USUAL_CONFIDENCE, USUAL_MEASURE
from ...core.units import DIMENSIONLESS, METRE, provenance
from ...fragility import HazardCurve
from ...fragility.analyses.sliding import SLIDES_ON
from ...fragility.fitting.bootstrap import REPLICATES
from ...fragility.fitting.states import OVERTURNED
from ...fragility.hazard.level_weights import LevelWeights, level_weights
from ...fragility.risk.modelling import MODELLING, RANGE, USUAL_DISPERSION
from ...fragility.runs.labels import block_coordinates, depth_coordinate, law_coordinates, ordered
from ...fragility.runs.provenance import AXES
from ...fragility.runs.request import check_vertical, labelled_sequence, part_of, runner_of
from ...fragility.runs.runners import Runner, Workers
from ...fragility.runs.scaling import BLOCK_MEASURES, SCALE, Scaling
from ...fragility.uncertainty.joint import (
    Variability,
    oscillators_of_pieces,
    outputs_of,
    with_restitution,
)
from ...models import Block, Law, describe_block, describe_law
from ...models.oscillator import Oscillator
from ...models.outputs import AXIS
from ...motions import Building
from ...motions.floors.histories import FloorHistories
from ...motions.intensity.measure import Measure
from ...motions.plausibility import record_doubts
from ...motions.polarity import AS_RECORDED, BOTH
from ..inventory.consequences import REALISATIONS, PieceScores
from ..inventory.contents import Contents, Inventory, row_doubts
from ..plan.slides import TRIP_DISTANCE
from .axes import placed_on_axes
from .modelling import ShiftedLevels, covering, joined, refuse_own_motions, scored_levels, several_classes
from .outcomes import DAY, MOST_THRESHOLDS, JointFlags, lost_flags, thresholds_up_to, upper_tail
from .shaking import Shaking, Support, support_of
from .slide_runs import SlidingRuns, Slipping, draws_of, faces_an_edge, slides
from .sliding import slide_variables
from .variables import (
    FALLEN,
    FORWARD,
    JOINT,
    PIECE_EVENTS,
    RUPTURE,
    SIDEWAYS,
    LineEvent,
    Modelled,
    Precision,
    Variables,
    Year,
    annual_variables,
    conditional_variables,
    consistent,
    line_variables,
    range_at_levels,
    range_of_a_year,
    variable,
)

ALONG_DEPTH = 2
"""Axis of a fall along the depth (`fragility.runs.axes`)."""
BUILDING = "building"
"""The place that includes all floors."""


@dataclass(frozen=True)
class Assessment:
    """Options of an assessment of the contents of a building: motions, laws, and requested results.

    Attributes
    ----------
    models : one law or a sequence
        Damping laws; an item with its own restitution has that instead of the law's.
    motions : xarray.DataArray, a sequence of them or FloorHistories
        Ground motions (motion, time), or floor motions (motion, floor, time), m s-2, which are scaled with their ground
        motions. Or floor histories with their own levels (SI), at which they are used as they are. Pairs of components
        have h1 in the direction x of the building and h2 in y (`toppling.motions.both_axes`, or histories with `axes`).
        They act on pieces about their width and their depth. Levels are then of a measure of both components.
    levels : array_like, shape (level,)
        Levels of the measure of the ground motion, SI, > 0, strictly increasing.
    im : str or Measure
        The measure to which the ground motions are scaled, as for `toppling.ida`; ``scale`` for plain factors.  A
        scenario is ``levels=[1.0], im="scale"``: the motions of an earthquake as they are.
    building : Building, optional
        The building between the ground motions and the floors. None if `motions` are floor motions already, or if all
        pieces are on the ground (floor 0).
    hazard : HazardCurve, optional
        Hazard curve of `im`, for annual values.
    ground : xarray.DataArray or a sequence of them, optional
        The ground motions of floor motions, with their labels; floor 0 of the floor motions if not given.
    variability : Variability, optional
        The differences between pieces of a line; if not given, pieces are alike and overturn together.
    modelling_dispersion : float
        Uncertainty beta_m of the model's capacities, as `toppling.fragility.with_modelling` explains. It is common to
        all pieces of a class (`Contents.piece_class`, else pieces of the same sizes), which therefore fall together
        more often, and independent from class to class. With a hazard curve annual values are means over it, and values
        given a level do not include it. Without one values given a level are means over it, from runs at thirteen
        levels about each (`studies.buildings.modelling`). Floor histories cannot be scaled to these unless they are
        elastic. If each level has its own motions, all pieces must be of one class.
    quantiles : sequence of float
        Wanted quantiles of number and loss, between 0 and 1.
    losses : array_like, optional
        Losses at which exceedance is given, currency, >= 0, increasing. By default 0 and 60 values from a thousandth of
        the total to the total. (The total of costs with a spread is what one in a thousand pieces exceeds.)
    slipping : Slipping, optional
        Slips whose probabilities are wanted; True if the pieces of a line have their coefficient of friction in common.
    consequence_correlation : float
        Correlation of the normal scores of cost, downtime and injuries of one piece, 0 to 1. Pieces are independent. It
        changes no mean and no exceedance of one of them, only their joint distribution.
    confidence, replicates, seed
        Of the intervals: their confidence, the number of resamples of the motions and the seed that decides them, and
        the draws of costs, downtimes and injuries.
    polarity : {"as recorded", "both"}, optional
        ``both`` runs every ground motion, with all floor motions under it, as given and reversed (ü and -ü), because an
        earthquake may come from either side. By default both if front and back of any piece that is not anchored differ
        (`Block.sided`), else as recorded.
    """

    models: Law | Sequence[Law]
    motions: xr.DataArray | Iterable[xr.DataArray] | FloorHistories
    levels: Any
    im: str | Measure = USUAL_MEASURE
    building: Building | None = None
    hazard: HazardCurve | None = None
    ground: xr.DataArray | Iterable[xr.DataArray] | None = field(default=None, kw_only=True)
    variability: Variability | None = field(default=None, kw_only=True)
    modelling_dispersion: float = field(default=0.0, kw_only=True)
    quantiles: Sequence[float] = field(default=(0.1, 0.5, 0.9), kw_only=True)
    losses: Any = field(default=None, kw_only=True)
    slipping: Slipping = field(default=Slipping(), kw_only=True)
    consequence_correlation: float = field(default=1.0, kw_only=True)
    confidence: float = field(default=USUAL_CONFIDENCE, kw_only=True)
    replicates: int = field(default=REPLICATES, kw_only=True)
    seed: int = field(default=0, kw_only=True)
    polarity: str | None = field(default=None, kw_only=True)

    @property
    def laws(self) -> list[Law]:
        """The damping laws; TypeError or ValueError if one is none, or labels are equal."""
        return labelled_sequence("models", self.models, Law)  # type: ignore[type-abstract]


def assess(
    inventory: Inventory,
    asked: Assessment,
    *,
    sides: bool | None = None,
    client: Workers = None,
    progress: Callable[[int, int], None] | None = None,
) -> xr.Dataset:
    """Compute the number and value overturned in a building, by floor and intensity, and in a year.

    Parameters
    ----------
    inventory : Inventory
        The contents of each floor; anchored pieces do not overturn.
    asked : Assessment
        Motions and options of the assessment.
    sides : bool, optional
        True to distinguish forward falls; by default if any piece that is not anchored has a wall, a restraint, a mass
        off the middle or a lean.
    client, progress
        As for `toppling.ida`.

    Returns
    -------
    xarray.Dataset
        Places are ``building`` and each floor; (model, …, level) are conditional on the level. Names with `annual` and
        `rate` are per year and exist only with a hazard curve. Names with `loss` exist only if something has a value,
        with `consequence` only if something has one, and with `downtime` or `injuries` only if lines give them.

        ``overturned`` (model, item, level, motion) are the flags, (…, item, variant, …) with `variability`. ``number``,
        ``loss``, ``downtime`` (days, the longest) and ``injuries`` (model, place, level, motion) are the totals under
        each motion, with an axis realisation if they are drawn. ``front…`` are forward falls, ``sideways…`` falls along
        the depth, ``broken…`` ruptures of restraints, NaN for pieces without them.

        If any line has an edge, all results for falls refer to ``fallen``: pieces that overturned as if none could
        slide, or slid off. ``gated…`` refers to overturning if pieces slide instead, which lowers no other value; a
        trip counts as no fall. ``level_weight`` (level) is the annual rate of each level, ``number_exceedance`` the
        probability of at least ``number_threshold`` falls. The documentation's page of every variable lists all with
        units.

        ``…_lower`` and ``…_upper`` are ends of intervals. If motions are run both ways, each is followed by its reverse
        along motion, with the coordinates `record` (its label as given) and `polarity` (1, -1).

    Raises
    ------
    TypeError, ValueError
        As `toppling.ida` and `Inventory.check_supports`. A floor that the building does not have, a measure that
        depends on the block, or a hazard curve of another measure. A restitution for a law that has none, or motions
        that already contain reverses. For pairs also as `studies.buildings.axes.placed_on_axes`, and friction. A
        vertical component under a building or a law of linear geometry.

    Notes
    -----
    The same ground motion at the same level acts on all items, each through its own floor, so pieces that fall in the
    same motion are counted together. Distributions over motions are of this joint outcome; motions have equal weight.

    Both ways, a motion has two equally probable outcomes, one of each polarity: the earthquake comes from one side or
    from the other. All pieces, floors and directions share them. Joint results are found for each polarity and then
    averaged. Means, probabilities and rates are the averages of two assessments, under +ü and under -ü. All intervals
    draw a motion with both its outcomes, as one earthquake: two equal outcomes of a motion count as much as one. Draws
    of variants, costs, downtimes and injuries are the same for both polarities.

    There are two assumptions. The fronts of all pieces face the same way, +x or +y of the building. The direction of a
    piece changes no value of this piece alone, but changes the pieces that fall together. The building is symmetric:
    the floor motions under the reversed ground motion are the reversed floor motions.

    Intervals of probabilities are Wilson's with one trial per motion. Intervals of means, and of all annual values, are
    from resampled motions (`fragility.means.mean_interval`), each with all its levels, floors and items. Intervals of
    quantiles are from ranks. If all motions agree on an annual value, its ends assume the share of differing motions
    that Wilson's interval allows. Their values are then as far away as possible: 0, or everything falls at every level.
    No place or piece has a higher upper end than the building, and no place a higher lower end. The intervals leave out
    the uncertainty of the hazard, the building and the blocks.

    Means of costs, downtimes and injuries given the motion are exact (the mean of each distribution times the
    probability of its fall). The mean of the longest downtime is a sum over 60 cells, 0.1 % to 2 % too large
    (`JointFlags.add_longest`). Quantiles and exceedances are of the realisations
    (`studies.inventory.consequences`). The error in quantiles and exceedances from the draws of pieces and of
    consequences is their ``sampling_error`` (`fragility.curves.means`). Over the modelling uncertainty it is too large,
    as the scores of a motion are spread evenly. Every motion draws separately, so that intervals over motions include
    it.

    Annual values are the integral of the conditional value over the hazard curve
    (`fragility.hazard.level_weights.level_weights`). It uses cubics in the logarithm of the level, constant above the
    last level, to zero within one step below the first.

    References
    ----------
    FEMA (2018). Seismic performance assessment of buildings, volume 1, methodology. FEMA P-58-1, 2nd ed. (recalled).
    Baker, J. W., Almeter, E., Cook, D., Liel, A., Haselton, C. (2023). A model for partially dependent component damage
    fragilities in seismic risk analysis. Earthquake Spectra (the part of the dispersion that pieces do not share).

    Examples
    --------
    >>> import toppling as tp
    >>> from toppling.studies.buildings.assessment import Assessment
    >>> from toppling.studies.inventory.reading import Contents, Inventory
    >>> shelves = Inventory((Contents("shelf", tp.catalogue["bookcase-5-shelf"], floor=2, count=3),))
    >>> frame = tp.motions.Building.flexural_shear(0.5, storeys=2)
    >>> shaking = tp.motions.CloughPenzien(duration=10.0, dt=0.01).sample(6)
    >>> found = assess(shelves, Assessment(tp.HousnerImpact(), shaking, [1.0, 8.0], building=frame))
    >>> found["number_mean"].sel(place="building").values.tolist()
    [[0.0, 3.0]]
    """
    laws = asked.laws
    if not isinstance(inventory, Inventory):
        raise TypeError(f"inventory must be an Inventory (read_inventory makes one), got {checks.kind(inventory)}")
    im, hazard, variability, slipping = asked.im, asked.hazard, asked.variability, asked.slipping
    if variability is not None and not isinstance(variability, Variability):
        raise TypeError(f"variability must be a Variability or None, got {checks.kind(variability)}")
    if isinstance(im, str) and im in BLOCK_MEASURES:
        raise ValueError(f"im must be a measure of the ground motion alone, so that all items see the same, got {im!r}")
    inventory.check_supports()
    runner = runner_of(client)
    precision = Precision.checked(asked.quantiles, asked.confidence, asked.replicates, asked.seed)
    shaking = shaking_of(asked, inventory)
    check_vertical(laws, shaking.ground)
    inventory = placed_on_axes(inventory, shaking, laws)
    floors = shaking.used(inventory)
    scaled = shaking.scaled(asked.levels, im)
    checks.callback("progress", progress)
    beta = BETA_M.number("modelling_dispersion", asked.modelling_dispersion)
    refuse_modelling(beta, inventory, shaking, hazard is not None)
    run, mixture = scaled, None
    if beta > 0.0 and hazard is None:
        every, mixture = scored_levels(scaled.levels, beta)
        run = shaking.scaled(every, im)
    weights = None if hazard is None else _weights(scaled, hazard, beta)
    thresholds = _losses(asked.losses, inventory)
    draws = draws_of(inventory, variability, slipping, precision.seed)
    realisations = REALISATIONS if draws is None else draws.realisations
    scores = PieceScores(realisations, asked.consequence_correlation, precision.seed)
    check_drawn(inventory, realisations)
    warn([*row_doubts(inventory.rows), *record_doubts(shaking.given)])
    if sides is None:
        sides = tells_sides(inventory)
    slips = None
    if any(slides(row) or row.stands_on for row in inventory.rows):
        shape = (run.levels.size, shaking.runs)
        plane = bool(shaking.axes)
        slips = SlidingRuns(inventory, laws[0], slipping, variability, shape, shaking.polarities, runner, plane)
    falls = _run(inventory, asked, shaking, run, runner, progress, sides, slips)
    flags = overturned = falls[OVERTURNED]
    edges = slips is not None and bool(slips.edged)
    if slips is not None and edges:
        if FORWARD in falls:
            falls[FORWARD] = slips.fallen_forward(falls[FORWARD], overturned)
        flags = falls[FALLEN] = slips.fallen(overturned)
    places = [BUILDING, *(f"floor {floor}" for floor in floors)]
    members = np.array(
        [[True] * len(inventory), *([str(row.floor) == floor for row in inventory.rows] for floor in floors)]
    )
    lost = lost_flags(flags, inventory.carried, runner.array)
    joint = JointFlags(
        inventory, flags, members, thresholds, draws, runner.array, scores, shaking.polarities, edges, lost
    )
    precision = precision.over(shaking.runs // shaking.polarities)
    year = None if weights is None else Year(weights.weights, shaking.own_motions, shaking.polarities)
    modelled = None
    if mixture is not None:
        modelled = Modelled(joined(joint, mixture), mixture, np.zeros(0))
    variables = conditional_variables(joint, precision, modelled)
    plain = variables if mixture is None else conditional_variables(joint, precision)
    if hazard is not None:
        variables = variables | range_of_a_year(plain, scaled.levels, hazard, beta)
    else:
        variables = variables | range_at_levels(plain, run.levels, scaled.levels, beta)
    if slips is not None:
        variables |= slide_variables(joint, overturned, slips, precision, year, modelled)
    for name, (text, can) in PIECE_EVENTS.items():
        if name in falls:
            able = [i for i, row in enumerate(inventory.rows) if can(row)]
            event = LineEvent.of_flags(f"{name}_probability", f"{name}_rate", text, falls[name], able)
            variables |= line_variables(joint, [event], precision, year, modelled)
    if weights is not None and year is not None:
        if beta > 0.0 and several_classes(inventory):
            assert hazard is not None
            shifted = ShiftedLevels.between(weights, covering(hazard, scaled.levels, beta), hazard, beta)
            modelled = Modelled(joined(joint, shifted), shifted, shifted.rates)
        variables |= annual_variables(joint, weights, year, precision, modelled)
    if SIDEWAYS in falls:
        variables[f"{SIDEWAYS}_share"] = _share_of_falls(variables, weights is not None)
    texts = {
        OVERTURNED: "overturned",
        FORWARD: "overturned forward or fell off in front" if edges else "overturned forward",
        SIDEWAYS: "overturned along its depth",
        FALLEN: "overturned or fell off",
    }
    at = np.searchsorted(run.levels, scaled.levels)
    for name in falls.keys() & texts:
        kept = falls[name] if mixture is None else falls[name][:, :, :, at]
        text = f"whether a piece {texts[name]}"
        if variability is None and kept.shape[2] == 1:
            variables[name] = variable(("model", "block", "level", "motion"), kept[:, :, 0], DIMENSIONLESS, text)
        else:
            dims = ("model", "block", "variant", "level", "motion")
            variables[name] = variable(dims, kept, DIMENSIONLESS, f"{text}, of each variant")
    configuration = {
        "inventory": [described(row) for row in inventory.rows],
        "currency": inventory.currency,
        "building": None if asked.building is None else asked.building.description,
        "models": [describe_law(model) for model in laws],
        "im": scaled.name,
        "levels": scaled.levels.tolist(),
        "motions": list(shaking.labels),
        **({} if shaking.polarity == AS_RECORDED else {"polarity": shaking.polarity}),
        **({AXES: shaking.axes} if shaking.axes else {}),
        "hazard": None if hazard is None else [list(hazard.levels), list(hazard.rates)],
        "variability": None if variability is None else variability.plain,
        **({} if slips is None else {"slipping": asdict(slipping)}),
        "replicates": precision.replicates,
        "seed": precision.seed,
        **({"consequence_correlation": scores.correlation} if any(row.drawn for row in inventory.rows) else {}),
        MODELLING: beta,
    }
    as_they_are = scaled.name == SCALE and scaled.levels.tolist() == [1.0]
    assessed = xr.Dataset(
        dict(sorted(consistent(variables).items())),
        coords={
            **law_coordinates(laws),
            **_item_coordinates(inventory, laws, bool(shaking.axes)),
            **({} if slips is None else {"slip": variable(("slip",), slips.distances, METRE, "slip that is exceeded")}),
            "place": _labels("place", places, "place: the building, or a floor of it"),
            "level": xr.Variable(
                "level", scaled.levels, {"units": scaled.units, "long_name": scaled.long_name, "im": scaled.name}
            ),
            **shaking.coordinates,
            **_measured(scaled, shaking),
            **_thresholds(joint, precision),
        },
        attrs={
            "title": "Performance assessment",
            "basis": "time" if hazard is not None else "scenario" if as_they_are else "intensity",
            "im": scaled.name,
            "currency": inventory.currency,
            "confidence": precision.confidence,
            "pieces": "alike" if draws is None else draws.pieces,
            MODELLING: beta,
            RANGE: beta or USUAL_DISPERSION,
            **({SLIDES_ON: slips.doubts[0].sentence} if slips is not None and slips.doubts else {}),
            **provenance(configuration),
        },
    )
    return ordered(assessed)


def _share_of_falls(variables: Variables, yearly: bool) -> xr.Variable:
    """Return the share of the falls of each item that are along its depth, of a year or over the levels together."""
    if yearly:
        deep, every = (variables[name].values for name in (f"{SIDEWAYS}_rate", "rate"))
        text = "share of its annual falls that are along its depth"
    else:
        deep, every = (variables[name].values.sum(-1) for name in (f"{SIDEWAYS}_probability", "probability"))
        text = "share of its falls at all levels together that are along its depth"
    with np.errstate(invalid="ignore", divide="ignore"):
        return variable(("model", "block"), np.where(every > 0.0, deep / every, np.nan), DIMENSIONLESS, text)


def refuse_modelling(beta: float, inventory: Inventory, shaking: Shaking, yearly: bool) -> None:
    """Raise a ValueError if floor histories, which are not scaled, do not determine the effect of beta_m (`beta`)."""
    if beta == 0.0:
        return
    if not yearly and not shaking.scalable:
        raise ValueError(
            "modelling_dispersion at a given level needs outcomes at levels about it, to which floor histories are not "
            "scaled: give a hazard curve, or leave it out"
        )
    refuse_own_motions(inventory, shaking.own_motions)


def _run(
    inventory: Inventory,
    asked: Assessment,
    shaking: Shaking,
    scaled: Scaling,
    runner: Runner,
    progress: Callable[[int, int], None] | None,
    sides: bool,
    slips: SlidingRuns | None,
) -> dict[str, Flags]:
    """Return flags (model, item, variant, level, motion) of falls and, if there can be any, of `PIECE_EVENTS`."""
    laws, variability = asked.laws, asked.variability
    variants = 1 if variability is None else variability.variants
    shape = (scaled.levels.size, shaking.runs)
    of_all = (len(laws), len(inventory), variants, *shape)
    falls = {OVERTURNED: runner.array(of_all, np.bool_)}
    for name, (_, can) in PIECE_EVENTS.items():
        if (sides or name == SIDEWAYS) and any(map(can, inventory.rows)):
            falls[name] = runner.array(of_all, np.bool_)
    for every in falls.values():
        for flags in every.reshape(-1, *every.shape[2:]):
            flags[...] = False
    plans = {at: _runs_on(at, inventory, laws, shaking, variability) for at in shaking.supports(inventory)}
    cells = shape[0] * shape[1]
    total = sum(cells // run.stands_for * run.number for runs in plans.values() for run in runs)
    done = 0
    for at, runs in plans.items():
        shaken = shaking.shaken(at, scaled, asked.im) if runs else None
        if slips is not None and shaken is not None:
            slips.run(at, shaken)
        for run in runs:
            assert shaken is not None  # (there are runs)
            report = part_of(progress, done, total)
            motions, factors = shaken.motions[:: run.stands_for], shaken.factors[:, :, :: run.stands_for]
            names = [OVERTURNED]
            if sides or run.across is not None:
                names = ["direction", *([AXIS] * (run.across is not None)), *(["ruptured"] * (RUPTURE in falls))]
            outputs = outputs_of(names, run.oscillators, run.across, motions, factors, runner, report)
            sided, axes, ruptured = outputs[names[0]], outputs.get(AXIS), outputs.get("ruptured")
            for i, start in run.rows.items():
                rows = slice(start, start + len(laws) * variants)
                flags = sided[rows].reshape(len(laws), variants, shape[0], -1, 1)
                if run.stands_for > 1:
                    # (of runs that leave the floor no side is known: they have the value 2 both ways)
                    mirrored = (
                        np.where(np.abs(flags) == 1, flags * np.int8(-1), flags) if sides or axes is not None else flags
                    )
                    flags = np.concatenate([flags, mirrored], axis=-1)
                flags = flags.reshape(len(laws), variants, *shape)
                falls[OVERTURNED][:, i] = flags != 0
                if axes is None:
                    deep = np.zeros((), np.bool_)
                else:
                    along = np.repeat(axes[rows].reshape(len(laws), variants, shape[0], -1), run.stands_for, -1)
                    deep = along.reshape(flags.shape) == ALONG_DEPTH
                if SIDEWAYS in falls:
                    falls[SIDEWAYS][:, i] = deep
                if FORWARD in falls:
                    falls[FORWARD][:, i] = (flags > 0) & ~deep
                if RUPTURE in falls and ruptured is not None:
                    # (what a reverse breaks is broken under the motion, too)
                    breaks = np.repeat(ruptured[rows].reshape(len(laws), variants, shape[0], -1), run.stands_for, -1)
                    falls[RUPTURE][:, i] = breaks.reshape(flags.shape)
            done += cells // run.stands_for * run.number
    return falls


class _Runs(NamedTuple):
    """Oscillators run together, their rows, and the number of motions that each run represents."""

    oscillators: Sequence[Oscillator]
    rows: Mapping[int, int]
    stands_for: int
    across: Sequence[Oscillator] | None = None

    @property
    def number(self) -> int:
        """Number of planar runs of each motion and level."""
        return len(self.oscillators) * (1 if self.across is None else 2)


def _runs_on(
    at: Support, inventory: Inventory, laws: Sequence[Law], shaking: Shaking, variability: Variability | None
) -> list[_Runs]:
    """Return the runs of the pieces that can fall on a support: under every motion, and mirrored runs."""
    rows = {i: row for i, row in enumerate(inventory.rows) if support_of(row) == at and not row.anchored}
    plans = []
    for stands_for, both in itertools.product(range(1, shaking.polarities + 1), (False, True)):
        oscillators: list[Oscillator] = []
        across: list[Oscillator] = []
        first: dict[tuple[Any, ...], int] = {}
        starts: dict[int, int] = {}
        for i, row in rows.items():
            if (1 if row.block.sided else shaking.polarities) != stands_for or row.both_axes != both:
                continue
            if kind_of(row) not in first:
                first[kind_of(row)] = len(oscillators)
                for law in laws:
                    oscillators.extend(_named(row, law, variability))
                    across.extend(_named(row, law, variability, across=True) if both else ())
            starts[i] = first[kind_of(row)]
        if starts:
            plans.append(_Runs(oscillators, starts, stands_for, across if both else None))
    return plans


def shaking_of(asked: Assessment, inventory: Inventory) -> Shaking:
    """Return the motions of a building, both ways if the inventory needs it and nothing else is given."""
    ways = polarity_of(inventory) if asked.polarity is None else asked.polarity
    return Shaking.of(asked.building, asked.motions, asked.ground, asked.im == SCALE, ways)


def polarity_of(inventory: Inventory) -> str:
    """Return the default polarity: both ways if front and back of any piece that can fall differ."""
    free = [row.block for row in inventory.rows if not row.anchored]
    return BOTH if any(block.sided or faces_an_edge(block) for block in free) else AS_RECORDED


def tells_sides(inventory: Inventory) -> bool:
    """Return True if front and back differ for any piece that can fall: a wall, a restraint, an offset or a lean."""
    free = [row.block for row in inventory.rows if not row.anchored]
    return any(not block.symmetric or block.wall is not None or block.restraint is not None for block in free)


def distinct_runs(inventory: Inventory, variability: Variability | None = None, polarity: str = AS_RECORDED) -> int:
    """Return the number of distinct runs of an inventory for one law, motion and level, in all ways and axes."""
    kinds = {(*support_of(row), *kind_of(row)): row for row in inventory.rows if not row.anchored}
    twice = sum((polarity == BOTH and row.block.sided) or row.both_axes for row in kinds.values())
    return (len(kinds) + twice) * (1 if variability is None else variability.variants)


def kind_of(row: Contents) -> tuple[Block, float | None]:
    """Return the properties that determine the runs of a row, in addition to its floor and direction."""
    block = row.block
    mass = None if block.restraint is None else block.mass  # (on which nothing else depends)
    depth = block.depth if row.both_axes else None
    return replace(block, name=None, edge=None, round=False, mass=mass, depth=depth), row.e


def _named(row: Contents, law: Law, variability: Variability | None, across: bool = False) -> list[Oscillator]:
    try:
        return oscillators_of_pieces(row.block, law, row.e, variability, across)
    except ValueError as error:
        raise ValueError(f"{row.label!r}: {error}") from None


def _weights(scaled: Scaling, hazard: HazardCurve, beta: float) -> LevelWeights:
    """Return the hazard curve as weights of the levels; ValueError if it is of another measure."""
    if not isinstance(hazard, HazardCurve):
        raise TypeError(f"hazard must be a HazardCurve, got {checks.kind(hazard)}")
    if hazard.im != scaled.name:
        raise ValueError(f"hazard must be of the measure of the levels, {scaled.name!r}, got {hazard.im!r}")
    if hazard.at != "ground":
        raise ValueError("hazard must be of the ground, whose measure the levels are of, got one of a floor")
    return level_weights(scaled.levels, covering(hazard, scaled.levels, beta))


def check_drawn(inventory: Inventory, realisations: int) -> None:
    """Raise ValueError if a line has more pieces than can be drawn."""
    scores = PieceScores(realisations)
    for row in inventory.rows:
        if row.drawn:
            scores.check_size(row.label, row.count)


def _losses(losses: Any, inventory: Inventory) -> Array:
    """Return the thresholds of loss, empty if nothing has a value."""
    if inventory.value == 0.0:
        if losses is not None:
            raise ValueError("losses must not be given for an inventory in which nothing has a value")
        return np.zeros(0)
    if losses is None:
        rows = inventory.rows
        tails = [row.loss if row.cost is None else upper_tail(row.cost) for row in rows]
        thresholds = thresholds_up_to(math.fsum(row.count * tail for row, tail in zip(rows, tails, strict=True)))
        # (a loss without spread steps at the values of pieces, which a grid misses by up to a tenth)
        exact = {
            k * row.loss
            for row in rows
            if row.cost is None and (not row.anchored or row.stands_on)
            for k in range(1, row.count + 1)
        }
        return np.union1d(thresholds, list(exact)) if len(exact) <= MOST_THRESHOLDS else thresholds
    values = np.atleast_1d(checks.finite_array("losses", losses, ndim=(0, 1), unit=inventory.currency))
    if values[0] < 0.0 or np.any(np.diff(values) <= 0.0):
        raise ValueError(f"losses must be >= 0 and strictly increasing, got {values.tolist()!r:.60}")
    return values


_OPTIONAL = (
    *("room", "direction", "piece_class", "code_class", "code_importance"),
    *("anchor_strength", "anchor_height", "kit", "contact", "stands_on"),
)
_DRAWN = ("cost", "downtime", "injury")
"""Quantities that are described if they are given."""


def described(row: Contents) -> dict[str, Any]:
    """Return a row as plain values."""
    return {
        "label": row.label,
        **describe_block(row.block),
        "floor": row.floor,
        "count": row.count,
        "e": row.e,
        "value": row.value,
        "consequences": list(row.consequences),
        "anchored": row.anchored,
        "anchoring_cost": row.anchoring_cost,
        **({} if row.block.mass is None else {"mass": row.block.mass}),
        **{name: getattr(row, name) for name in _OPTIONAL if getattr(row, name)},
        **{name: asdict(getattr(row, name)) for name in _DRAWN if getattr(row, name) is not None},
        **({} if row.friction is None else {"friction": row.friction.description, "kinetic_ratio": row.kinetic_ratio}),
        **({} if row.obstacle is None else {"trip": row.obstacle}),
        **({} if row.stand is None else {"support": [row.stand.name, repr(row.stand.support)]}),
    }


def _labels(dim: str, values: Sequence[str], long_name: str) -> xr.Variable:
    return variable((dim,), np.array(values, dtype=object), DIMENSIONLESS, long_name)


def _item_coordinates(inventory: Inventory, laws: list[Law], both_axes: bool) -> dict[str, xr.Variable]:
    """Return the coordinates of the items: the values of the lines, blocks and restitution; with `both_axes` depths."""
    rows, blocks = inventory.rows, [row.block for row in inventory.rows]
    money = inventory.currency or DIMENSIONLESS
    mean = "mean " if any(row.cost is not None for row in rows) else ""
    columns: dict[str, tuple[list[Any], str, str]] = {
        "block": ([row.label for row in rows], DIMENSIONLESS, "item of the inventory"),
        "floor": ([str(row.floor) for row in rows], DIMENSIONLESS, "floor, 0 is the ground"),
        "room": ([row.room for row in rows], DIMENSIONLESS, "room"),
        "consequences": ([JOINT.join(row.consequences) for row in rows], DIMENSIONLESS, "what its overturning means"),
        "count": ([row.count for row in rows], DIMENSIONLESS, "number of pieces"),
        "value": ([row.loss for row in rows], money, f"{mean}lost when a piece overturns"),
        "anchored": ([row.anchored for row in rows], DIMENSIONLESS, "whether the pieces are anchored already"),
        "anchoring_cost": ([row.anchoring_cost for row in rows], money, "cost of anchoring a piece"),
    }
    # (those that any line gives)
    medians = [None if row.friction is None else float(row.friction.quantile(np.array(0.5))) for row in rows]
    optional: dict[str, tuple[list[Any], str, str]] = {
        "direction": ([row.direction for row in rows], DIMENSIONLESS, "direction in which its width lies"),
        "anchored_with": ([row.kit for row in rows], DIMENSIONLESS, "kit that holds the pieces and can break"),
        "support": (
            [row.stand.name if row.stand else "" for row in rows],
            DIMENSIONLESS,
            "bench or platform between the floor and the pieces",
        ),
        "contact": ([row.contact for row in rows], DIMENSIONLESS, "what the pieces stand on, and with what"),
        "friction": (medians, DIMENSIONLESS, "static coefficient of friction, its median"),
        "stands_on": ([row.stands_on for row in rows], DIMENSIONLESS, "line whose piece it stands on"),
    }
    for kind, unit in (("cost", money), ("downtime", DAY)):
        for parameter, units, text in (
            ("median", unit, f"median {kind} when a piece overturns"),
            ("dispersion", DIMENSIONLESS, f"dispersion of that {kind}"),
            ("distribution", DIMENSIONLESS, f"distribution of that {kind}, normal truncated at 0"),
        ):
            values = [getattr(getattr(row, kind), parameter, None) for row in rows]
            optional[f"{kind}_{parameter}"] = values, units, text
    for name, parameter, text in (
        ("persons_exposed", "persons", "mean number of persons where a piece falls"),
        ("injury_probability", "probability", "probability that each of them is injured"),
    ):
        optional[name] = [getattr(row.injury, parameter, None) for row in rows], DIMENSIONLESS, text
    if any(slides(row) for row in rows if row.obstacle is not None):
        columns[TRIP_DISTANCE] = [row.obstacle for row in rows], METRE, "clear distance to an obstacle"
    if both_axes:
        columns["both_axes"] = [row.both_axes for row in rows], DIMENSIONLESS, "whether it is run about its depth, too"
    coordinates = {}
    for name, (values, units, text) in (columns | optional).items():
        if name in columns or any(value not in (None, "") for value in values):
            texts = any(isinstance(value, str) for value in values)
            given = [("" if texts else np.nan) if value is None else value for value in values]
            coordinates[name] = variable(("block",), np.array(given, object if texts else None), units, text)
    used = [[with_restitution(law, row.e).restitution(row.block) for row in rows] for law in laws]
    e = np.array([[np.nan if value is None else value for value in line] for line in used])
    coordinates["e"] = variable(("model", "block"), e, DIMENSIONLESS, "coefficient of restitution used")
    for name, coordinate in (block_coordinates(blocks) | (depth_coordinate(blocks) if both_axes else {})).items():
        if name != "block":  # (items have their own labels)
            coordinates[name] = xr.Variable("block", coordinate.values, coordinate.attrs)
    return coordinates


def _measured(scaled: Scaling, shaking: Shaking) -> dict[str, xr.Variable]:
    """Return the measure of the unscaled ground motions as a coordinate, if these motions are known."""
    if scaled.measured is None or not shaking.ground:
        return {}
    return {f"ground_{scaled.name}": variable(("motion",), scaled.measured, scaled.units, scaled.long_name)}


def _thresholds(joint: JointFlags, precision: Precision) -> dict[str, xr.Variable]:
    """Return quantiles, consequences and thresholds as coordinates."""
    text = "probability of the quantile"
    coordinates = {"quantile": variable(("quantile",), precision.quantiles, DIMENSIONLESS, text)}
    for quantity in joint.quantities:
        name = f"{quantity.name}_threshold"
        text = f"{quantity.text}, {'more than' if quantity.strictly else 'at least'}"
        coordinates[name] = variable((name,), quantity.thresholds, quantity.units, text)
    if joint.inventory.consequences:
        coordinates["consequence"] = _labels("consequence", joint.inventory.consequences, "what an overturning means")
    return coordinates
