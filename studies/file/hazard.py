"""The tables of a study file for annual rates: hazard, its questions, and weights of alternatives."""

import math
from abc import abstractmethod
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Self

import numpy as np
from pydantic import BeforeValidator, Field, TypeAdapter, model_validator

from ...core.parameters import CHANCE, PART, USUAL_YEARS, YEARS
from ...fragility import HazardCurve, read_hazard
from ...fragility.hazard.curve import AT_ONE, check_rates
from ...fragility.hazard.files import COMPONENT
from ...fragility.hazard.pieces import ABOVE_RULES, BELOW_RULES
from ...fragility.runs.scaling import BLOCK_MEASURES, SCALE, intensity_measure
from ..plan.risk import Risk
from .analyses import LEVEL_UNITS, refuse_unordered
from .derived import By, chosen_by
from .motions import Motions
from .table import SEVERAL, KeyInfo, Label, RelativePath, Table, one_of

ALONG = ("alpha", "R", "width", "height")
COMMON = {"years", "probability", "along", "below", "above", "at"}


class HazardTable(Table):
    """Hazard curve of the measure of the levels, and the questions asked with it.

    at: Place of the curve: the site, or the one floor on which all blocks stand.
    below: Rule below the curve's lowest level: extended with its slope, or no shaking.
    above: Rule above the highest level: extended with its slope, constant, or no shaking.
    years: Time of the probabilities.
    probability: Target probability in that time; gives the size of blocks that meets it.
    along: Size of the blocks that is varied to meet the target.
    """

    at: Annotated[str, one_of(("ground", "floor"))] = "ground"
    below: Annotated[str, one_of(BELOW_RULES)] = "extend"
    above: Annotated[str, one_of(ABOVE_RULES)] = "extend"
    years: Annotated[float, KeyInfo(unit="years"), YEARS] = USUAL_YEARS
    probability: Annotated[Annotated[float, CHANCE] | None, KeyInfo("not asked")] = None
    along: Annotated[str | None, one_of(ALONG)] = None

    @model_validator(mode="after")
    def _one_target(self) -> Self:
        if (self.probability is None) != (self.along is None):
            raise ValueError("hazard.probability and hazard.along go together: which size meets which target")
        return self

    def build(self, im: str, folder: Path) -> HazardCurve:
        """Make the curve of a measure (of the base of a block-normalised one); ValueError if there is none."""
        name = BLOCK_MEASURES[im].measure.label if im in BLOCK_MEASURES else im
        if name == SCALE:
            raise ValueError("hazard needs levels of a measure, got im 'scale'")
        return replace(self._curve(name, folder), at=self.at)

    @abstractmethod
    def _curve(self, measure: str, folder: Path) -> HazardCurve:
        """Return the curve of a measure; ValueError if there is none."""

    def risk(self, im: str, folder: Path) -> Risk:
        """Return the curve with the questions asked of it."""
        return Risk(self.build(im, folder), self.years, self.below, self.above, self.probability, self.along)


class HazardFileTable(HazardTable):
    """Hazard curve of a file.

    file: CSV or JSON of a hazard curve, relative to the study file.
    site: Site in the file: number, name, [lon, lat].
    component: Curve of a USGS response.
    unit: Unit of the levels, where the file states none.
    """

    file: Annotated[str, RelativePath()]
    site: int | str | Annotated[tuple[float, float], Field(strict=False)] | None = None
    component: Annotated[str | None, KeyInfo(COMPONENT)] = None
    unit: Annotated[str | None, one_of(LEVEL_UNITS)] = None

    def _curve(self, measure: str, folder: Path) -> HazardCurve:
        path, component = folder / self.file, self.component or COMPONENT
        return read_hazard(path, measure, self.site, units=self.unit, component=component)


class HazardLawTable(HazardTable):
    """Hazard curve that is given here, in a unit.

    unit: Unit of the levels.
    """

    unit: Annotated[str, one_of(LEVEL_UNITS)]

    def build(self, im: str, folder: Path) -> HazardCurve:
        name = BLOCK_MEASURES[im].measure.label if im in BLOCK_MEASURES else im
        measure = intensity_measure(name) if name != SCALE else None
        fitting = [] if measure is None else [unit for unit, (_, si) in LEVEL_UNITS.items() if si == measure.units]
        # (for a measure whose unit no level may have, the curve itself checks the unit)
        if fitting and self.unit not in fitting:
            raise ValueError(f"hazard.unit must be one of {', '.join(fitting)} for {name}, got {self.unit!r}")
        return super().build(im, folder)


K0 = Annotated[
    float, AT_ONE, KeyInfo(unit="1/yr"), Field(description="Annual rate at a level of 1 unit, of a power law.")
]


class PowerLawTable(HazardLawTable):
    """Hazard curve k0 x^-k.

    k: Exponent of the power law k0 x^-k.
    """

    k0: K0
    k: float

    def _curve(self, measure: str, folder: Path) -> HazardCurve:
        return HazardCurve.power_law(self.k0, self.k, measure, self.unit)


class LogQuadraticTable(HazardLawTable):
    """Hazard curve k0 exp(-k2 ln²x - k1 ln x).

    k1: Of the second-order law k0 exp(-k2 ln²x - k1 ln x).
    k2: Curvature of the second-order law.
    """

    k0: K0
    k1: float
    k2: float

    def _curve(self, measure: str, folder: Path) -> HazardCurve:
        return HazardCurve.log_quadratic(self.k0, self.k1, self.k2, measure, self.unit)


class HazardPointsTable(HazardLawTable):
    """Hazard curve through points.

    levels: Levels of a curve given here.
    rates: Their annual rates of exceedance.
    """

    levels: Annotated[list[float], KeyInfo(unit="as `unit` says")]
    rates: Annotated[list[float], KeyInfo(unit="1/yr")]

    def _curve(self, measure: str, folder: Path) -> HazardCurve:
        refuse_unordered("hazard.levels", self.levels, self.unit)
        check_rates("hazard.rates", np.array(self.rates), np.array(self.levels), self.unit)
        return HazardCurve.from_points(self.levels, self.rates, measure, self.unit, "study file")


WAYS: dict[str, type[HazardTable]] = {
    "file": HazardFileTable,
    "k": PowerLawTable,
    "k1": LogQuadraticTable,
    "levels": HazardPointsTable,
}
"""Ways to give a curve, by the key that none of the others has."""


class _ByWay(By):
    """Choice of the table of a hazard, by the form of its curve."""

    def __call__(self, value: Any) -> str:
        given = value if isinstance(value, dict) else getattr(value, "__dict__", {})
        return next((f"{key}=" for key in WAYS if given.get(key) is not None), "")


def _one_way(value: Any) -> Any:
    """Raise a ValueError for a table that gives no curve, or more than one."""
    if isinstance(value, dict):
        given = {key for key, entry in value.items() if entry is not None} - COMMON
        needed = [{name for name, field in way.model_fields.items() if field.is_required()} for way in WAYS.values()]
        ways = [keys - {"unit"} for keys in needed]
        known = set[str]().union(*ways)
        if sum(keys <= given for keys in ways) != 1 or not any(given & known == keys for keys in ways):
            raise ValueError(
                "a hazard needs either file, or k0 and k, or k0, k1 and k2, or levels and rates, got "
                + (", ".join(sorted(given)) or "nothing")
            )
    return value


if TYPE_CHECKING:
    Hazards = HazardTable
else:
    Hazards = Annotated[
        chosen_by(_ByWay("file"), {f"{key}=": table for key, table in WAYS.items()}), BeforeValidator(_one_way)
    ]
hazard_table: Callable[[Any], HazardTable] = TypeAdapter(Hazards, config={"defer_build": True}).validate_python
"""Function that returns the table of a hazard of some content; pydantic's ValidationError if it is not valid."""


OF_MODELS, OF_MOTIONS, OF_HAZARD = OF = ("models", "motions", "hazard")
"""Kinds of branches; the last two are also the names of the study's own tables among the branches."""

Named = Annotated[Label, Field(description="Name among the branches.")]


class BranchTable(Table):
    """Alternative inputs of one kind, with weights.

    of: Kind of input; without models, the reference law is used.
    names: Labels or short names of laws; `motions` or names of `motion_sets`; `hazard` or names of `hazards`.
    weights: Their weights, which sum to 1.
    """

    of: Annotated[str, one_of(OF)]
    names: Annotated[list[str], SEVERAL]
    weights: Annotated[list[Annotated[float, PART]], SEVERAL]

    @model_validator(mode="after")
    def _of_one_size(self) -> Self:
        if len(self.names) != len(self.weights):
            raise ValueError(
                f"branches of {self.of} need a weight for each name, got {len(self.names)} and {len(self.weights)}"
            )
        if len(set(self.names)) < len(self.names):
            twice = next(name for name in self.names if self.names.count(name) > 1)
            raise ValueError(f"branches of {self.of} name {twice!r} twice")
        total = math.fsum(self.weights)
        if not math.isclose(total, 1.0, rel_tol=1e-6):
            raise ValueError(f"weights of the branches of {self.of} must sum to 1, got {total:g}")
        return self

    @property
    def shares(self) -> dict[str, float]:
        """The weights by name, scaled so that their sum is 1 to rounding."""
        total = math.fsum(self.weights)
        return {name: weight / total for name, weight in zip(self.names, self.weights, strict=True)}


class MotionSetTable(Table):
    """Alternative motions.

    motions: Motions instead of [motions].
    """

    name: Named
    motions: Motions


class HazardSetTable(Table):
    """Alternative hazard curve.

    hazard: Hazard curve instead of [hazard].
    """

    name: Named
    hazard: Hazards

    @model_validator(mode="after")
    def _curve_alone(self) -> Self:
        given = sorted(self.hazard.model_fields_set & COMMON)
        if given:
            raise ValueError(f"hazards hold curves alone, {given[0]} stands in [hazard]")
        return self
