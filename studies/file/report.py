"""The table of a study file with what the cover of its report says."""

from __future__ import annotations

from typing import Annotated, Self

from pydantic import Field, StringConstraints, model_validator

from .table import Table

Line = Annotated[str, StringConstraints(strip_whitespace=True, min_length=1, max_length=200)]


class ReportTable(Table):
    """The cover of a report: texts that change neither the study nor its results."""

    client: Annotated[Line | None, Field(description="For whom the report is.")] = None
    site: Annotated[Line | None, Field(description="Where the pieces stand.")] = None
    author: Annotated[Line | None, Field(description="Who made the study.")] = None
    date: Annotated[Line | None, Field(description="Date of the report, as text.")] = None

    @model_validator(mode="after")
    def _not_empty(self) -> Self:
        if not self.model_fields_set:
            raise ValueError("give at least one of client, site, author, date")
        return self
