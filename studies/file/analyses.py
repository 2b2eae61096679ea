"""Tables of a study file that define the analysis: its design, levels, validity screen, fit and measures."""

import math
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Annotated, Any, Literal, Self

import numpy as np
from pydantic import AfterValidator, Discriminator, Field, Tag, WithJsonSchema, field_validator, model_validator

from ...core import checks
from ...core.doubts import warn
from ...core.elementary import Array, exp
from ...core.parameters import CHANCE, PART, SHARE, USUAL_MEASURE, Seed
from ...core.units import DIMENSIONLESS, UNITS
from ...fragility.adaptive.sequential import MOST_RUNS, RUNS
from ...fragility.adaptive.until import (
    FEWEST,
    LEAST,
    MEDIAN,
    MOST,
    PROBABILITY,
    TARGETS,
    TOLERANCES,
    USUAL,
    Until,
    until_of,
)
from ...fragility.analyses.joint import FEWEST_BLOCKS, FEWEST_MOTIONS as FEWEST_EVENTS, SAMPLE
from ...fragility.analyses.pooled import A_MOTION, BLOCKS_A_MOTION, MOST as MOST_POOLED
from ...fragility.fitting.fit import FORMS, METHODS, default_form
from ...fragility.fitting.intervals import INTERVALS
from ...fragility.fitting.likelihood import PENALTIES
from ...fragility.fitting.states import DISTANCE, NAMES as STATES, OVERTURNED, TURNED
from ...fragility.runs.scaling import INTENSITY_MEASURES, intensity_measure
from ...fragility.uncertainty.joint import Variability
from ...fragility.validity.plausibility import level_doubts
from ...models.friction import CONTACTS, contact_named, friction_and_ratio
from ...models.scenes.edge import FALLEN_OFF
from ...models.sliding.trip import TRIPS
from ...motions.intensity.directions import PAIR_MEASURES
from ...motions.intensity.naming import as_known
from ...motions.intensity.parametric_measures import PARAMETRIC_MEASURES
from ...motions.polarity import BOTH, POLARITIES
from ..inventory.consequences import SAFETY
from ..money.present_value import DISCOUNT, DISCOUNT_RATE
from ..plan.estimates import MEAN, UNDECIDED, Fit
from ..plan.piece_classes import NAMES, with_class
from ..plan.slides import DISTANCES, Slides
from .code import Codes
from .derived import Derived, derived
from .motions import Motions
from .selecting import OwnTarget, SelectTable
from .table import (
    MAX_VALUE,
    Confidence,
    KeyInfo,
    ModelledIn,
    Modelling,
    PartialTable,
    RelativePath,
    Replicates,
    ResamplingSeed,
    Spread,
    Static,
    Table,
    Trip,
    checked,
    nearest,
    one_of,
    shown,
)

LEVEL_UNITS = {unit: UNITS[unit] for unit in ("g", "m/s2", "cm/s2", "m/s", "cm/s", "m", "cm", "1")}
"""SI value and SI unit of each unit that a level may have."""


MOST_SAMPLE = 20_000
"""Most events at a level, and most blocks of the sample of a region."""
MOST_LEVELS = 100_000
EVENTS = 200
"""Events of a generator at each level."""
MOST_LEVEL = 1e9
"""Highest level in any unit: beyond it the arithmetic overflows."""


def named_measure(value: str) -> str:
    """Annotation of the name of an intensity measure; a measure with parameters is written as its label."""
    word, bracket, rest = value.partition("(")
    known = as_known(value, INTENSITY_MEASURES)
    if known is not None or (bracket and as_known(word, (*PARAMETRIC_MEASURES, *PAIR_MEASURES))):
        measure = intensity_measure(known or value)
        return str(known) if measure is None else measure.label
    near = nearest(word.strip() or value, (*INTENSITY_MEASURES, *PARAMETRIC_MEASURES))
    meant = f"{near}{bracket}{rest}" if near in PARAMETRIC_MEASURES and bracket else near
    meant = f"{near}(1.0)" if near in PARAMETRIC_MEASURES and not bracket else meant
    hint = f"; did you mean {shown(meant)}?" if near else ""
    names = (*INTENSITY_MEASURES, *(f"{name}(…)" for name in (*PARAMETRIC_MEASURES, *PAIR_MEASURES)))
    raise ValueError(f"must be one of {', '.join(names)}, got {shown(value)}{hint}")


def refuse_unordered(name: str, values: Sequence[float], unit: str) -> None:
    """Raise a ValueError, in the unit of the file, unless levels are > 0, increase, and end below the highest."""
    checks.increasing(name, values, unit)
    if values and not values[-1] <= MOST_LEVEL:
        of = "" if unit == "1" else f" {unit}"
        raise ValueError(f"{name} must be at most {MOST_LEVEL:g}, got {values[-1]:g}{of}")


ModellingClass = Annotated[
    str | None,
    one_of(NAMES),
    KeyInfo("none"),
    Field(description="Class of tested pieces; gives β_m if none is given."),
]


class LevelsTable(Table):
    """Levels of the intensity measure: a list of values, or from, to, number and spacing.

    values: The levels, increasing.
    from: First level.
    to: Last level.
    number: Number of levels.
    spacing: Spacing of the levels.
    unit: Unit of the levels.
    """

    values: Annotated[
        list[float] | None, KeyInfo(unit="as `unit` says"), Field(min_length=1, max_length=MOST_LEVELS)
    ] = None
    from_: Annotated[float | None, KeyInfo(unit="as `unit` says"), Field(alias="from", ge=0.0, le=MOST_LEVEL)] = None
    to: Annotated[float | None, KeyInfo(unit="as `unit` says"), Field(ge=0.0, le=MOST_LEVEL)] = None
    number: Annotated[int | None, Field(ge=1, le=MOST_LEVELS)] = None
    spacing: Literal["linear", "log"] = "linear"
    unit: Annotated[str, one_of(LEVEL_UNITS)]

    @model_validator(mode="after")
    def _one_way(self) -> Self:
        ranged = (self.from_, self.to, self.number)
        if (self.values is None) == (None in ranged) or (
            self.values is not None and any(v is not None for v in ranged)
        ):
            raise ValueError("levels need either values, or from, to and number")
        if self.number == 1 and self.from_ != self.to:
            raise ValueError(f"levels from {self.from_:g} to {self.to:g} need number >= 2, got 1")
        if self.spacing == "log" and not (self.from_ or 0.0) > 0.0:
            raise ValueError(f"levels with log spacing need from > 0, got {self.from_}")
        return self

    def build(self, im: str) -> Array:
        """Return the levels in SI; ValueError if the unit is not one of the measure's."""
        factor, si = LEVEL_UNITS[self.unit]
        measure = intensity_measure(im)
        needed = DIMENSIONLESS if measure is None else measure.units
        if si != needed:
            fitting = [unit for unit, (_, of) in LEVEL_UNITS.items() if of == needed]
            raise ValueError(f"unit of levels of {im} must be one of {', '.join(fitting)}, got {self.unit!r}")
        given = self._given()
        refuse_unordered("levels", given.tolist(), self.unit)
        warn(level_doubts(given * factor, needed))
        return given * factor

    def _given(self) -> Array:
        if self.values is not None:
            return np.array(self.values)
        assert self.from_ is not None  # checked above
        assert self.to is not None
        assert self.number is not None
        if self.spacing == "linear":
            return np.linspace(self.from_, self.to, self.number)
        if not self.to > 0.0:
            raise ValueError(f"levels with log spacing need to > 0, got {self.to}")
        return exp(np.linspace(math.log(self.from_), math.log(self.to), self.number))


def _any_capitals(names: Iterable[str]) -> str:
    """Return a regular expression of the schema, which has no flag for it, that takes names in any capitals."""
    return "|".join("".join(f"[{c.upper()}{c.lower()}]" if c.isalpha() else c for c in name) for name in names)


Named = Annotated[
    str,
    AfterValidator(named_measure),
    WithJsonSchema(
        {
            "type": "string",
            "anyOf": [
                {"enum": list(INTENSITY_MEASURES)},
                {"pattern": f"^({_any_capitals(INTENSITY_MEASURES)})$"},
                {"pattern": rf"^({_any_capitals((*PARAMETRIC_MEASURES, *PAIR_MEASURES))})\(.+\)$"},
            ],
        }
    ),
]
Where = Annotated[str | None, one_of(("floor", "ground"))]


Polarity = Annotated[
    str | None,
    one_of(POLARITIES),
    KeyInfo("`both` where front and back of a block differ, else `as recorded`"),
    Field(description="`both`: each motion also runs reversed (ü and −ü), as two runs of one motion."),
]


def _word_or_table(value: Any) -> str:
    return "word" if isinstance(value, str) else "table"


class MeasuredTable(Table):
    """An analysis over an intensity measure.

    im: Intensity measure: by name, or with its period in s, as Sa(1.0).
    im_at: Place of the intensity measure in a building: ground or floor.
    """

    im: Named = USUAL_MEASURE
    im_at: Annotated[Where, KeyInfo("floor")] = None
    polarity: Polarity = None


class IdaTable(MeasuredTable):
    """Incremental dynamic analysis: every motion at every level of a measure, or at levels of its own.

    levels: Levels of the measure; or adaptive (levels follow from earlier runs), or pooled (adaptive, with one surface
        for the curves of all blocks).
    """

    levels: Annotated[
        Annotated[LevelsTable, Tag("table")] | Annotated[Literal["adaptive", "pooled"], Tag("word")],
        Discriminator(_word_or_table),
    ]


class EventsTable(Table):
    """Distribution of the number of blocks that overturn in one event, from a sample of the region.

    levels: Levels of the measure that the events have.
    motions: Events at each level, of a generator.
    sample: Number of blocks of the random sample.
    """

    levels: LevelsTable
    motions: Annotated[
        int | None, KeyInfo(f"{EVENTS}; a set of motions is taken whole"), Field(ge=FEWEST_EVENTS, le=MOST_SAMPLE)
    ] = None
    sample: Annotated[int, Field(ge=FEWEST_BLOCKS, le=MOST_SAMPLE)] = SAMPLE


class NumberTable(Table):
    """Numbers of motions of an analysis at adaptive levels or with a pooled surface.

    least: Minimum number of motions before the first check of the precision.
    most: Motions in all.
    """

    least: Annotated[int, Field(ge=FEWEST)] = LEAST
    most: Annotated[
        int | None, KeyInfo(f"all there are, at most {MOST:,}, of a pooled surface {MOST_POOLED:,}"), Field(ge=FEWEST)
    ] = None


class ChanceTable(Table):
    """A probability of overturning at one level, and its precision.

    level: Level of the measure.
    unit: Unit of the level.
    within: Half width of the 95 % interval of the probability.
    """

    level: Annotated[float, KeyInfo(unit="as `unit` says"), Field(gt=0.0, le=MOST_LEVEL)]
    unit: Annotated[str, one_of(LEVEL_UNITS)]
    within: Annotated[float, TOLERANCES[PROBABILITY]]


_Tolerance = Annotated[Annotated[float, TOLERANCES[MEDIAN]] | None, KeyInfo("not asked for")]


class UntilTable(Table):
    """Precision at which an analysis at adaptive levels stops, for every block under every law, or a pooled one.

    median: Half width of the 95 % interval of the level at which half overturn, as a share of it; of a pooled
        surface, of all blocks at once.
    dispersion: Half width of the 95 % interval of the dispersion, as a share of it.
    rate: Half width of the 95 % interval of the annual rate, as a share of it. The rate is estimated without a form of
        curve; it needs [hazard] of the measure `ida.im`.
    probability: A probability at one level.
    motions: Bounds of the number of motions.
    seed: Seed of the levels and of the order of motions that are read; a generator has `motions.seed`.
    """

    median: Annotated[_Tolerance, KeyInfo(f"{USUAL:g} where nothing else is asked for")] = None
    dispersion: _Tolerance = None
    rate: _Tolerance = None
    probability: Annotated[ChanceTable | None, KeyInfo("not asked for")] = None
    motions: Annotated[NumberTable | None, KeyInfo(f"{LEAST} at least")] = None
    runs_per_motion: Annotated[
        Annotated[int, A_MOTION] | None,
        KeyInfo(f"{RUNS}, of a pooled surface {BLOCKS_A_MOTION}"),
        Field(
            description=f"Runs of a motion: of a block (1 to {MOST_RUNS}), once its curve is found "
            "roughly, or each of another block of the surface.",
        ),
    ] = None
    seed: Seed = 0

    def build(self, im: str, motions: int, usual: int = MOST) -> Until:
        """Return the precision, for the number of motions; ValueError if it cannot be reached."""
        asked = self.model_dump(include=set(TARGETS), exclude_none=True)
        if len(asked) > 1:
            raise ValueError(f"until must name one of {', '.join(TARGETS)}, got {' and '.join(sorted(asked))}")
        if self.probability is not None:
            probability = self.probability
            level = LevelsTable(values=[probability.level], unit=probability.unit).build(im)
            asked = {PROBABILITY: {"level": float(level[0]), "within": probability.within}}
        bounds = self.motions or NumberTable()
        most = min(motions, usual) if bounds.most is None else bounds.most
        if most > motions:
            raise ValueError(f"until.motions.most must be at most the {motions:,} motions that there are, got {most:,}")
        if bounds.least > most:
            raise ValueError(
                f"{bounds.least:,} motions are needed at least (until.motions.least), got {most:,} at most"
            )
        return until_of({**asked, "motions": {"least": bounds.least, "most": most}})


class StripeTable(OwnTarget):
    """One stripe: its level, and keys of its motions that differ from [motions].

    level: Level of the measure.
    motions: Keys of [motions] that are others at this level.
    """

    level: Annotated[float, KeyInfo(unit="as `unit` of [stripes] says")]
    motions: Annotated[dict[str, Any] | None, PartialTable(Motions), KeyInfo("none")] = None


class StripesTable(MeasuredTable):
    """Multiple stripes: motions that differ from level to level.

    unit: Unit of the levels.
    scale: True: scale motions to their level. False: use them unscaled, because they were selected for it.
    select: Selection of the motions of each stripe.
    at: The stripes, with increasing levels.
    """

    unit: Annotated[str, one_of(LEVEL_UNITS)]
    scale: bool = True
    select: Annotated[SelectTable | None, KeyInfo("no selection: every motion is run")] = None
    at: Annotated[list[StripeTable], Field(min_length=1, max_length=1000)]

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        refuse_unordered("the levels of stripes", [stripe.level for stripe in self.at], self.unit)
        if self.select is not None:
            if not self.scale:
                raise ValueError("stripes.scale = false does not go with stripes.select, whose motions are scaled")
            self.select.refuse_without_target(self.at)
        elif any(stripe.target or stripe.disaggregation for stripe in self.at):
            raise ValueError("a target or disaggregation of a stripe needs [stripes.select]")
        return self

    def levels(self) -> Array:
        """Return the levels in SI; ValueError if the unit is not one of the measure's."""
        return LevelsTable(values=[stripe.level for stripe in self.at], unit=self.unit).build(self.im)


class CloudTable(MeasuredTable):
    """Cloud: every motion once, as it is."""


class ScreenTable(Table):
    """Options of the validity checks.

    undecided: Share of the motions run again, up to four times, under perturbations of a millionth; none with a
        `fit.state` other than a fall.
    """

    undecided: Annotated[Annotated[float, SHARE] | None, KeyInfo(UNDECIDED)] = None


class FrictionTable(Table):
    """Friction between pieces and floor, for the validity checks and for sliding.

    kinetic_ratio: Kinetic over static friction.
    slips_m: Slips for which chances are computed; the assumed defaults: a piece touches a neighbour, tears its service
        line, blocks an aisle.
    shared: True: the pieces of a line of an inventory share one coefficient of friction; with [performance.variability]
        its `pieces` decides.
    """

    static: Annotated[Static | None, KeyInfo("that of contact")] = None
    dispersion: Annotated[Spread | None, KeyInfo("taken as known exactly, with a note")] = None
    contact: Annotated[
        str | None,
        KeyInfo("none: static is given"),
        Field(description=f"Instead of static: {', '.join(CONTACTS)} (judgement). `castors` are refused: they roll."),
    ] = None
    kinetic_ratio: Annotated[Annotated[float, PART] | None, KeyInfo("1, or that of contact")] = None
    slips_m: Annotated[
        list[Annotated[float, DISTANCE]] | None,
        KeyInfo(", ".join(map(str, DISTANCES))),
        Field(min_length=1, max_length=10),
    ] = None
    trip_mm: Annotated[Trip | None, KeyInfo("no obstacle")] = None
    shared: Annotated[bool | None, KeyInfo("true")] = None

    @model_validator(mode="after")
    def _one_friction(self) -> Self:
        if (self.static is None) == (self.contact is None):
            given = "neither" if self.static is None else "both"
            raise ValueError(f"friction needs static or contact, got {given}")
        if self.contact is not None:
            if self.dispersion is not None:
                raise ValueError("dispersion goes with static: a contact has its own")
            contact_named(self.contact)
        slips = self.slips_m or []
        refuse_unordered("slips_m", slips, "m")
        return self

    @property
    def median(self) -> float:
        """The static coefficient of friction, or its median."""
        return contact_named(self.contact or "").friction.median if self.static is None else self.static

    def build(self, polarity: str = BOTH) -> Slides:
        """Return the friction, and the slips whose chances are wanted, of motions in a polarity if sides differ."""
        friction, ratio = friction_and_ratio(self.contact, self.static, self.dispersion)
        return Slides(
            friction,
            self.kinetic_ratio or ratio or 1.0,
            DISTANCES if self.slips_m is None else tuple(self.slips_m),
            polarity,
            trip=None if self.trip_mm is None else 1e-3 * self.trip_mm,
        )


if TYPE_CHECKING:
    VariabilityTable = Derived
else:
    VariabilityTable = derived(Variability)


class TargetTable(Table):
    """Targets of the cheapest set of kits: upper bounds that must all be met.

    falls: Expected falls.
    front_falls: Expected forward falls, into the room.
    injuries: Expected injured persons.
    loss: Expected loss.
    """

    falls: Annotated[float | None, KeyInfo("no limit"), Field(ge=0.0)] = None
    front_falls: Annotated[float | None, KeyInfo("no limit"), Field(ge=0.0)] = None
    injuries: Annotated[float | None, KeyInfo("no limit"), Field(ge=0.0)] = None
    loss: Annotated[float | None, KeyInfo("no limit", unit="the inventory's currency"), Field(ge=0.0)] = None

    @model_validator(mode="after")
    def _something(self) -> Self:
        if not self.limits:
            raise ValueError(f"needs at least one of {', '.join(TargetTable.model_fields)}")
        return self

    @property
    def limits(self) -> dict[str, float]:
        """The limits that are given."""
        limits: dict[str, float] = self.model_dump(exclude_none=True)
        return limits


class PerformanceTable(Table):
    """Performance assessment: an inventory, with joint outcomes under each motion.

    inventory: CSV or XLSX of the pieces and their places, relative to the study file.
    im: Intensity measure of the ground motion: by name, or with its period in s, as Sa(1.0).
    levels: Levels of the measure; with `motions.floors_index` the levels of the index.
    polarity: `both`: each motion also runs reversed (ü and −ü), as two outcomes of one earthquake.
    variability: Variability of pieces of one line.
    objective: Objective of anchoring: loss, number, any, or a consequence in the inventory.
    at_level: Level of the table and the ranking without a hazard.
    safety: Consequences in the inventory that rank before money.
    sort: Order of the pieces in their table.
    discount_rate: Discount rate of savings in later years; 0: no discounting.
    consequence_correlation: Correlation of the normal scores of cost, downtime and injuries of one piece, where
        the inventory gives distributions.
    code: A building code.
    budget: Money for anchoring: the best set for it is chosen, of kits if given.
    kits: Restraints that are tried on every piece that they fit and that is not anchored for good.
    target: Target of the cheapest set of kits, per year or at the level of the table.
    """

    inventory: Annotated[str, RelativePath()]
    im: Named = USUAL_MEASURE
    levels: Annotated[LevelsTable | None, KeyInfo("the motions as they are, a scenario")] = None
    polarity: Annotated[
        str | None,
        one_of(POLARITIES),
        KeyInfo("`both` where front and back of a piece differ, or of one with a kit, else `as recorded`"),
    ] = None
    variability: Annotated[VariabilityTable | None, KeyInfo("alike: they fall together")] = None
    objective: Annotated[str | None, KeyInfo("`loss`, or `number` where nothing has a value")] = None
    at_level: Annotated[float | None, KeyInfo("the middle one", unit="as `levels.unit` says"), Field(gt=0.0)] = None
    safety: Annotated[list[str] | None, KeyInfo(", ".join(f"`{word}`" for word in SAFETY))] = None
    sort: Literal["recommendation", "chance", "loss", "payback", "value", "cost", "floor", "item"] = "recommendation"
    discount_rate: Annotated[float, KeyInfo(unit="1/year"), DISCOUNT_RATE] = DISCOUNT
    modelling_dispersion: Modelling = Fit.modelling_dispersion
    modelling: ModelledIn = MEAN
    modelling_class: ModellingClass = None
    consequence_correlation: Annotated[float, SHARE] = 1.0
    code: Annotated[Codes | None, KeyInfo("code requirements are not checked")] = None
    budget: Annotated[
        float | None, KeyInfo("no set is chosen", unit="the inventory's currency"), Field(gt=0.0, le=MAX_VALUE)
    ] = None
    kits: Annotated[list[str] | None, KeyInfo("none"), Field(min_length=1, max_length=20)] = None
    target: Annotated[TargetTable | None, KeyInfo("no set is chosen")] = None
    replicates: Replicates = Fit.replicates
    seed: ResamplingSeed = 0

    @model_validator(mode="before")
    @classmethod
    def _classed(cls, given: Any) -> Any:
        """Take the modelling uncertainty of the class that is named if none is given."""
        return with_class(given)


class FitTable(Table):
    """Options of the fitted curves.

    form: Shape of the curves; all but isotonic rise to 1, as falls to one side need not.
    method: Data of the fit: the runs at each level, or each motion's first overturning, which closer levels find
        earlier.
    intervals: Kind of intervals; the bootstrap draws motions.
    fractiles: Probabilities for which levels are computed.
    penalty: Penalised likelihood: never, of separated data, or always.
    state: State that counts as failure: overturned, front (a fall away from the wall, into the room) or back, uplifted,
        or |θ|/α above a number.
    """

    form: Annotated[str, one_of(FORMS), KeyInfo("`lognormal`; `isotonic` where `state` is `front` or `back`")] = (
        Fit.form
    )
    method: Annotated[str, one_of(METHODS)] = Fit.method
    intervals: Annotated[str | None, one_of(INTERVALS), KeyInfo("`bootstrap` for ida, else `profile`")] = None
    fractiles: Annotated[list[Annotated[float, CHANCE]] | None, KeyInfo("none")] = None
    penalty: Annotated[str, one_of(PENALTIES)] = Fit.penalty
    replicates: Replicates = Fit.replicates
    seed: ResamplingSeed = 0
    state: str | float = OVERTURNED
    confidence: Confidence = Fit.confidence
    modelling_dispersion: Modelling = Fit.modelling_dispersion
    modelling: ModelledIn = MEAN
    modelling_class: ModellingClass = None

    @field_validator("state", mode="before")
    @classmethod
    def _named(cls, state: Any) -> Any:
        """Raise an error for a value that is neither a state's word nor a number that |θ|/α exceeds."""
        if isinstance(state, str):
            return checked(state, STATES)
        try:
            return TURNED.number("state", state)
        except (TypeError, ValueError):
            given = str(state).lower() if isinstance(state, bool) else shown(state)
            raise ValueError(
                f"must be a word, as 'overturned', or a number {TURNED.text}, of |θ|/α, got {given}"
            ) from None

    @model_validator(mode="before")
    @classmethod
    def _shaped(cls, given: Any) -> Any:
        """Take the form that suits the state, and the modelling uncertainty of the class, if none is given."""
        given = with_class(given)
        if not isinstance(given, dict) or "form" in given or not isinstance(given.get("state"), str):
            return given
        return {**given, "form": default_form(given["state"])}

    @model_validator(mode="after")
    def _fitting(self) -> Self:
        offered = FORMS[self.form].intervals
        if self.intervals is not None and self.intervals not in offered:
            allowed = " or ".join(offered)
            raise ValueError(f"fit.intervals of form {self.form!r} must be {allowed}, got {self.intervals!r}")
        methods = FORMS[self.form].methods
        if self.method not in methods:
            raise ValueError(f"fit.method of form {self.form!r} must be {' or '.join(methods)}, got {self.method!r}")
        if self.modelling_dispersion > 0.0 and self.form != "lognormal":
            side = f", the default of state {self.state!r}" if self.form == default_form(self.state) else ""
            raise ValueError(f"fit.modelling_dispersion is for lognormal curves, got form {self.form!r}{side}")
        if self.modelling == "fractiles" and self.modelling_dispersion == 0.0:
            raise ValueError("fit.modelling = 'fractiles' needs fit.modelling_dispersion > 0")
        return self

    def build(self) -> Fit:
        """Make the options of the fit; ValueError if there is no such state of rocking blocks."""
        if self.state in (FALLEN_OFF, TRIPS):
            raise ValueError(
                f"fit.state must be a state of rocking blocks, got {self.state!r}: with [friction] the chances of "
                "falls over edges and of trips are among the results"
            )
        return Fit(**{**self.model_dump(), "fractiles": tuple(self.fractiles or ())})


class MeasuresTable(Table):
    """Comparison of intensity measures: all without parameters, and others.

    also: Measures with parameters, such as Sa(1.0), in addition to all others.
    """

    also: Annotated[list[Named] | None, KeyInfo("none")] = None
