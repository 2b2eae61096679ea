"""The study file: one TOML schema, checked once at the edge, turned into blocks, laws and motions.

Units stand in key names (``width_m``, ``dt_s``) or beside the values (``unit = "g"``).  Unknown keys are refused.
"""

from __future__ import annotations

import difflib
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any, NamedTuple, Self, get_args

import xarray as xr
from pydantic import Field, ValidationError, model_validator

from ..fragility.curves import LINKED
from ..fragility.execution import OUTPUTS
from .analysis_tables import CloudTable, FitTable, IdaTable, MeasuresTable, PerformanceTable, ScreenTable, StripesTable
from .block_tables import BlockTable, ModelTable
from .designs import Cloud, Design, Incremental, Stripes
from .hazard_tables import HazardTable
from .motion_tables import BuildingTable, MotionsTable
from .sensitivity_tables import SensitivityTable
from .tables import StudyError, Table, one_of
from .uncertainty_tables import UncertaintyTable


class Shaking(NamedTuple):
    """What shakes the blocks, and the ground motions below it where the levels are of their measure."""

    motions: tuple[xr.DataArray, ...]
    ground: tuple[xr.DataArray, ...]


ANALYSES = ("ida", "stripes", "cloud", "performance")


class StudyFile(Table):
    """A study: blocks x damping laws x motions, as one kind of analysis."""

    title: Annotated[str, Field(min_length=1, max_length=200, description="Title of the study.")]
    blocks: Annotated[list[BlockTable] | None, Field(min_length=1, description="The blocks.")] = None
    models: Annotated[list[ModelTable], Field(min_length=1, description="The damping laws.")]
    motions: Annotated[MotionsTable, Field(description="What shakes them.")]
    building: Annotated[BuildingTable | None, Field(description="What stands between the motions and them.")] = None
    buildings: Annotated[
        list[BuildingTable] | None,
        Field(min_length=1, description="Several, side by side, each with a name."),
    ] = None
    ida: Annotated[IdaTable | None, Field(description="Every motion at every level.")] = None
    stripes: Annotated[StripesTable | None, Field(description="Motions that differ from level to level.")] = None
    cloud: Annotated[CloudTable | None, Field(description="Every motion once, as it is.")] = None
    screen: Annotated[ScreenTable | None, Field(description="The validity screen.")] = None

    outputs: Annotated[
        list[Annotated[str, one_of(OUTPUTS)]] | None,
        Field(description="Results kept of every run (overturned, peak_rotation)."),
    ] = None
    fit: Annotated[FitTable | None, Field(description="How curves are fitted.")] = None
    measures: Annotated[MeasuresTable | None, Field(description="Which measure serves best.")] = None
    uncertainty: Annotated[UncertaintyTable | None, Field(description="What is not known of blocks and laws.")] = None

    sensitivity: Annotated[SensitivityTable | None, Field(description="How results depend on delta or e.")] = None

    performance: Annotated[PerformanceTable | None, Field(description="An inventory, shaken jointly.")] = None
    hazard: Annotated[HazardTable | None, Field(description="How often the ground shakes, for what a year brings.")] = (
        None
    )

    @model_validator(mode="after")
    def _one_analysis(self) -> Self:
        analyses = [name for name in ANALYSES if getattr(self, name) is not None]
        if len(analyses) != 1:
            found = " and ".join(analyses) or "none"
            raise ValueError(f"a study needs exactly one of {', '.join(ANALYSES)}, got {found}")
        if self.performance is not None:
            given = [
                name
                for name in ("blocks", "buildings", "screen", "uncertainty", "sensitivity")
                if getattr(self, name) is not None
            ]
            if given:
                raise ValueError(f"a performance study has no {given[0]}: its blocks stand in its inventory")
            if self.hazard is not None:
                given = sorted(self.hazard.model_fields_set & {"years", "probability", "along", "at", "below", "above"})
                if given:
                    raise ValueError(f"hazard.{given[0]} is not for a performance study: its values are of one year")
        elif self.blocks is None:
            raise ValueError("key 'blocks' is missing")
        form = "lognormal" if self.fit is None else self.fit.form
        if self.hazard is not None and form in LINKED:
            raise ValueError(f"hazard needs curves whose rates are known exactly, not fit.form {form!r}")
        if self.sensitivity is not None:
            apart = ("hazard", "screen", "fit", "measures", "outputs", "uncertainty")
            given = [name for name in apart if getattr(self, name) is not None]
            if given:
                raise ValueError(f"a study with sensitivity has no {given[0]}")
        if self.building is not None and self.buildings is not None:
            raise ValueError("a study has one building or several buildings, not both keys")
        names = [one.name for one in self.buildings or []]
        if None in names or len(set(names)) < len(names):
            raise ValueError(f"buildings need a name each, all different, got {', '.join(map(str, names))}")
        if self.performance is None and self.analysis.im_at == "ground" and not self._stand:
            raise ValueError(f"{analyses[0]}.im_at 'ground' needs a building, whose floors move with the ground")
        if self._stand and self.motions.floors_file is not None:
            raise ValueError("a building needs ground motions, got motions.floors_file, which are of floors already")
        return self

    @property
    def kind(self) -> str:
        """Which kind of study it is."""
        if self.performance is not None:
            return "performance"
        if self.sensitivity is not None:
            return "sensitivity"
        return "fragility" if self.uncertainty is None else "uncertainty"

    @property
    def analysis(self) -> IdaTable | StripesTable | CloudTable:
        """The design of the one analysis that is asked for."""
        found = self.ida or self.stripes or self.cloud
        if found is None:
            raise ValueError("a performance study has no ida, stripes or cloud")
        return found

    @property
    def _stand(self) -> list[BuildingTable]:
        """The buildings that blocks stand in."""
        return [self.building] if self.building is not None else self.buildings or []

    def shaking(self, folder: Path) -> list[Shaking]:
        """The motions through the buildings: one set for all levels, or for stripes one each; ValueError as theirs."""
        if self.stripes is None:
            return [self._shaking(self.motions, folder)]
        common = self.motions.model_dump(by_alias=True, exclude_unset=True)
        found = []
        for i, stripe in enumerate(self.stripes.at, start=1):
            try:
                found.append(self._shaking(MotionsTable.model_validate({**common, **(stripe.motions or {})}), folder))
            except ValidationError as error:
                raise ValueError(f"stripes.at[{i}].motions: {sentence(error, MotionsTable)}") from None
            except ValueError as error:
                raise ValueError(f"stripes.at[{i}]: {error}") from None
        return found

    def _shaking(self, motions: MotionsTable, folder: Path) -> Shaking:
        ground = motions.build(folder)
        if not self._stand:
            return Shaking(tuple(ground), ())
        floors: list[xr.DataArray] = []
        for i, building in enumerate(self._stand, start=1):
            try:
                floors.extend(building.shake(ground))
            except ValueError as error:
                raise ValueError(f"building{'' if self.buildings is None else f's[{i}]'}: {error}") from None
        at_ground = self.performance is None and self.analysis.im_at == "ground"
        return Shaking(tuple(floors), tuple(ground) if at_ground else ())

    def design(self, folder: Path) -> Design:
        """The analysis with its motions; ValueError where they do not go together."""
        sets = self.shaking(folder)
        if self.stripes is not None:
            return Stripes(
                tuple(one.motions for one in sets),
                tuple(one.ground for one in sets) if self.stripes.im_at == "ground" else (),
                self.stripes.im,
                self.stripes.levels(),
                self.stripes.scale,
            )
        if self.ida is not None:
            return Incremental(*sets[0], self.ida.im, self.ida.levels.build(self.ida.im))
        return Cloud(*sets[0], self.analysis.im)


def read_study_file(path: Path) -> StudyFile:
    """The study file, checked against the schema; StudyError with one sentence where it does not hold."""
    try:
        text = path.read_bytes().decode("utf-8")
        content = tomllib.loads(text)
    except FileNotFoundError:
        raise StudyError(f"{path}: no such file") from None
    except OSError as error:
        raise StudyError(f"{path}: cannot be read ({error.strerror})") from None
    except UnicodeDecodeError:
        raise StudyError(f"{path}: not a text file in UTF-8") from None
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        raise StudyError(f"{path}: not valid TOML: {str(error) or 'nested too deeply'}") from None
    try:
        return StudyFile.model_validate(content)
    except ValidationError as error:
        raise StudyError(f"{path}: {sentence(error)}") from None


def sentence(errors: ValidationError, table: type[Table] | None = None) -> str:
    """What a table (the whole study) does not hold, as one sentence: the key, the value and what is allowed."""
    # an unknown key is likely the cause of one that is missing: say it first
    error = min(errors.errors(), key=lambda one: one["type"] != "extra_forbidden")
    key = "".join(f"[{part + 1}]" if isinstance(part, int) else f".{part}" for part in error["loc"]).lstrip(".")
    if error["type"] == "extra_forbidden":
        known = _known_keys(table or StudyFile, error["loc"][:-1])
        near = difflib.get_close_matches(str(error["loc"][-1]), known, n=1, cutoff=0.5)
        hint = f"; did you mean {near[0]!r}?" if near else f", allowed are {', '.join(known)}"
        return f"unknown key {key!r}{hint}"
    if error["type"] == "missing":
        return f"key {key!r} is missing"
    message = error["msg"].removeprefix("Value error, ")
    if error["type"] == "value_error":
        return f"{key}: {message}" if key else message
    shown = repr(error["input"])
    message = message[0].lower() + message[1:]
    return f"{key}: {message}, got {shown if len(shown) <= 60 else shown[:57] + '...'}"


def _known_keys(table: type[Table], location: tuple[int | str, ...]) -> list[str]:
    """The keys allowed at `location` in a table."""
    for part in location:
        fields = {field.alias or name: field for name, field in table.model_fields.items()}
        if isinstance(part, str) and part in fields:
            table = next(_tables_of(fields[part].annotation), table)
    return [field.alias or name for name, field in table.model_fields.items()]


def _tables_of(annotation: Any) -> Iterator[type[Table]]:
    """The kinds of tables that a type stands for."""
    if isinstance(annotation, type) and issubclass(annotation, Table):
        yield annotation
    for part in get_args(annotation):
        yield from _tables_of(part)
