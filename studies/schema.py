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
from pydantic_core import ErrorDetails

from .analysis_tables import IdaTable
from .block_tables import BlockTable, ModelTable
from .motion_tables import BuildingTable, MotionsTable
from .tables import StudyError, Table


class Shaking(NamedTuple):
    """What shakes the blocks, and the ground motions below it where the levels are of their measure."""

    motions: list[xr.DataArray]
    ground: list[xr.DataArray]


class StudyFile(Table):
    """A study: blocks x damping laws x motions x levels."""

    title: Annotated[str, Field(min_length=1, max_length=200, description="Title of the study.")]
    blocks: Annotated[list[BlockTable], Field(min_length=1, description="The blocks.")]
    models: Annotated[list[ModelTable], Field(min_length=1, description="The damping laws.")]
    motions: Annotated[MotionsTable, Field(description="What shakes them.")]
    building: Annotated[BuildingTable | None, Field(description="What stands between the motions and them.")] = None
    ida: Annotated[IdaTable, Field(description="The analysis.")]

    @model_validator(mode="after")
    def _ground_below(self) -> Self:
        if self.ida.im_at == "ground" and self.building is None:
            raise ValueError("ida.im_at 'ground' needs a building, whose floors move with the ground")
        if self.building is not None and self.motions.floors_file is not None:
            raise ValueError("a building needs ground motions, got motions.floors_file, which are of floors already")
        return self

    def shaking(self, folder: Path) -> Shaking:
        """The motions, through the building where there is one; ValueError as the tables' own."""
        ground = self.motions.build(folder)
        if self.building is None:
            return Shaking(ground, [])
        try:
            floors = self.building.build().floor_motions(ground, self.building.floors)
        except ValueError as error:
            raise ValueError(f"building: {error}") from None
        return Shaking(floors, ground if self.ida.im_at == "ground" else [])


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
        # an unknown key is likely the cause of one that is missing: say it first
        errors = sorted(error.errors(), key=lambda one: one["type"] != "extra_forbidden")
        raise StudyError(f"{path}: {sentence(errors[0])}") from None


def sentence(error: ErrorDetails) -> str:
    """One pydantic error as one sentence that names the key, the value and what is allowed."""
    key = "".join(f"[{part + 1}]" if isinstance(part, int) else f".{part}" for part in error["loc"]).lstrip(".")
    if error["type"] == "extra_forbidden":
        known = _known_keys(error["loc"][:-1])
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


def _known_keys(location: tuple[int | str, ...]) -> list[str]:
    """The keys allowed in the table at `location`."""
    table: type[Table] = StudyFile
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
