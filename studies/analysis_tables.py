"""Tables of a study file that say what is asked: the design of the analysis, its levels, its validity screen."""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import AfterValidator, Field, model_validator

from ..fragility.estimation import INTERVALS
from ..fragility.fit import FORMS, METHODS
from ..fragility.joint import PIECES, Variability
from ..fragility.likelihood import PENALTIES
from ..fragility.scaling import INTENSITY_MEASURES, intensity_measure
from ..fragility.states import state_name
from ..models.friction import FixedFriction, Friction, LognormalFriction
from ..motions.parametrised import PARAMETRISED
from ..units import DIMENSIONLESS, STANDARD_GRAVITY
from .estimates import Fit
from .tables import Table, checked, one_of

# SI value of each unit a level may be written in, and the SI unit it belongs to.
LEVEL_UNITS: dict[str, tuple[float, str]] = {
    "g": (STANDARD_GRAVITY, "m s-2"),
    "m/s2": (1.0, "m s-2"),
    "cm/s2": (0.01, "m s-2"),
    "m/s": (1.0, "m s-1"),
    "cm/s": (0.01, "m s-1"),
    "m": (1.0, "m"),
    "cm": (0.01, "m"),
    "1": (1.0, "1"),
}


def named_measure(value: str) -> str:
    """The name of an intensity measure, one with parameters written as its label is."""
    if "(" not in value:
        return checked(value, INTENSITY_MEASURES, f", {', '.join(f'{name}(…)' for name in PARAMETRISED)}")
    measure = intensity_measure(value)
    assert measure is not None  # only plain factors have none, and they have no parameters
    return measure.label


class LevelsTable(Table):
    """Levels of the intensity measure: a list of values, or from, to, number and spacing."""

    values: Annotated[list[float] | None, Field(description="The levels, increasing.")] = None
    from_: Annotated[float | None, Field(alias="from", description="First level.")] = None
    to: Annotated[float | None, Field(description="Last level.")] = None
    number: Annotated[int | None, Field(ge=1, le=100_000, description="Number of levels.")] = None
    spacing: Annotated[Literal["linear", "log"], Field(description="Spacing of the levels.")] = "linear"
    unit: Annotated[str, one_of(LEVEL_UNITS), Field(description="Unit of the levels.")]

    @model_validator(mode="after")
    def _one_way(self) -> Self:
        ranged = (self.from_, self.to, self.number)
        if (self.values is None) == (None in ranged) or (
            self.values is not None and any(v is not None for v in ranged)
        ):
            raise ValueError("levels need either values, or from, to and number")
        if self.spacing == "log" and not (self.from_ or 0.0) > 0.0:
            raise ValueError(f"levels with log spacing need from > 0, got {self.from_}")
        return self

    def build(self, im: str) -> NDArray[np.float64]:
        """Levels in SI; ValueError where the unit is not one of the measure's."""
        factor, si = LEVEL_UNITS[self.unit]
        measure = intensity_measure(im)
        needed = DIMENSIONLESS if measure is None else measure.units
        if si != needed:
            fitting = [unit for unit, (_, of) in LEVEL_UNITS.items() if of == needed]
            raise ValueError(f"unit of levels of {im} must be one of {', '.join(fitting)}, got {self.unit!r}")
        if self.values is not None:
            return np.array(self.values) * factor
        assert self.from_ is not None  # checked above
        assert self.to is not None
        assert self.number is not None
        if self.spacing == "log":
            if not self.to > 0.0:
                raise ValueError(f"levels with log spacing need to > 0, got {self.to}")
            return np.exp(np.linspace(math.log(self.from_), math.log(self.to), self.number)) * factor
        return np.linspace(self.from_, self.to, self.number) * factor


Named = Annotated[str, AfterValidator(named_measure)]
Where = Annotated[str | None, one_of(("floor", "ground"))]


class IdaTable(Table):
    """Incremental dynamic analysis: every motion at every level of a measure."""

    im: Annotated[Named, Field(description="Intensity measure.")] = "pga"
    im_at: Annotated[Where, Field(description="Where a building's motions are measured (floor).")] = None
    levels: Annotated[LevelsTable, Field(description="Levels of the measure.")]


class StripeTable(Table):
    """One stripe: its level, and what its motions have that [motions] has not."""

    level: Annotated[float, Field(description="Level of the measure.")]
    motions: Annotated[
        dict[str, Any] | None, Field(description="Keys of [motions] that are others at this level (none).")
    ] = None


class StripesTable(Table):
    """Multiple stripes: motions that differ from level to level."""

    im: Annotated[Named, Field(description="Intensity measure.")] = "pga"
    im_at: Annotated[Where, Field(description="Where a building's motions are measured (floor).")] = None
    unit: Annotated[str, one_of(LEVEL_UNITS), Field(description="Unit of the levels.")]
    scale: Annotated[bool, Field(description="Scale motions to their level, or take them as they are (true).")] = True
    at: Annotated[list[StripeTable], Field(min_length=1, description="The stripes, with increasing levels.")]

    def levels(self) -> NDArray[np.float64]:
        """Levels in SI; ValueError where the unit is not one of the measure's."""
        return LevelsTable(values=[stripe.level for stripe in self.at], unit=self.unit).build(self.im)


class CloudTable(Table):
    """Cloud: every motion once, as it is."""

    im: Annotated[Named, Field(description="Intensity measure.")] = "pga"
    im_at: Annotated[Where, Field(description="Where a building's motions are measured (floor).")] = None


class ScreenTable(Table):
    """Validity screen: the friction there is, and how many flags are tested."""

    friction: Annotated[
        float | None, Field(gt=0.0, description="Coefficient of friction between block and floor, or its median.")
    ] = None
    friction_dispersion: Annotated[
        float | None, Field(gt=0.0, description="Dispersion of a lognormal coefficient of friction (known).")
    ] = None
    undecided: Annotated[
        float | None,
        Field(ge=0.0, le=1.0, description="Share of the motions run again under perturbations of a millionth (0.08)."),
    ] = None

    @model_validator(mode="after")
    def _median_given(self) -> Self:
        if self.friction is None and self.friction_dispersion is not None:
            raise ValueError("friction_dispersion needs friction (the median)")
        return self

    def build(self) -> Friction | None:
        """The coefficient of friction, None where it is not given."""
        if self.friction is None:
            return None
        if self.friction_dispersion is None:
            return FixedFriction(self.friction)
        return LognormalFriction(self.friction, self.friction_dispersion)


class VariabilityTable(Table):
    """How pieces of one line of an inventory differ."""

    restitution_sd: Annotated[float | None, Field(description="Standard deviation of the restitution (0).")] = None
    slenderness_dispersion: Annotated[float | None, Field(description="Dispersion of the slenderness (0).")] = None
    pieces: Annotated[str | None, one_of(PIECES), Field(description="Each its own draw, or one for all.")] = None
    variants: Annotated[int | None, Field(description="Variants of each block that are run (16).")] = None
    realisations: Annotated[int | None, Field(description="Fillings of the building (20).")] = None
    seed: Annotated[int | None, Field(ge=0, description="Seed of the draws (0).")] = None

    def build(self) -> Variability:
        """The variability; ValueError where a value is out of range."""
        return Variability(**self.model_dump(exclude_none=True))


class PerformanceTable(Table):
    """Performance assessment: an inventory, shaken jointly."""

    inventory: Annotated[str, Field(description="CSV of what stands where, relative to the study file.")]
    im: Annotated[Named, Field(description="Intensity measure of the ground motion.")] = "pga"
    levels: Annotated[
        LevelsTable | None, Field(description="Its levels (none: the motions as they are, a scenario).")
    ] = None
    variability: Annotated[VariabilityTable | None, Field(description="How pieces of one line differ (not).")] = None
    objective: Annotated[str | None, Field(description="What anchoring saves: loss, number, any, a consequence.")] = (
        None
    )
    at_level: Annotated[float | None, Field(description="Level of the table and the ranking without a hazard.")] = None
    replicates: Annotated[int, Field(ge=100, le=1_000_000, description="Resamples of the motions (1000).")] = 1000
    seed: Annotated[int, Field(ge=0, description="Seed of the resamples (0).")] = 0


class FitTable(Table):
    """How curves are fitted to the runs."""

    form: Annotated[str, one_of(FORMS), Field(description="Shape of the curves (lognormal).")] = "lognormal"
    method: Annotated[str, one_of(METHODS), Field(description="What they are fitted to (binomial).")] = "binomial"
    intervals: Annotated[str | None, one_of(INTERVALS), Field(description="Kind of intervals (as the design).")] = None
    fractiles: Annotated[list[float] | None, Field(description="Probabilities whose levels are wanted (none).")] = None
    penalty: Annotated[str, one_of(PENALTIES), Field(description="Penalised likelihood (auto).")] = "auto"
    replicates: Annotated[int, Field(ge=100, le=1_000_000, description="Bootstrap replicates (1000).")] = 1000
    seed: Annotated[int, Field(ge=0, description="Their seed (0).")] = 0
    state: Annotated[
        str | float, Field(description="overturned, uplifted, or a threshold of |theta|/alpha (overturned).")
    ] = "overturned"
    confidence: Annotated[float, Field(gt=0.0, lt=1.0, description="Of all intervals (0.95).")] = 0.95

    def build(self) -> Fit:
        """The options; ValueError where the state is none."""
        state_name(self.state)
        return Fit(**{**self.model_dump(), "fractiles": tuple(self.fractiles or ())})


class MeasuresTable(Table):
    """Which measure serves best: every plain one, and others."""

    also: Annotated[list[Named] | None, Field(description="Measures with parameters, such as Sa(1.0) (none).")] = None
