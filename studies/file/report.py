"""The table of a study file for the cover of its report."""

from typing import Annotated, Self

from pydantic import StringConstraints, model_validator

from .table import Label, Table

Line = Annotated[Label, StringConstraints(strip_whitespace=True)]


class ReportTable(Table):
    """The cover of a report: texts that change neither the study nor its results.

    client: Name of the client.
    site: Site of the pieces.
    author: Author of the study.
    date: Date of the report, as text.
    """

    client: Line | None = None
    site: Line | None = None
    author: Line | None = None
    date: Line | None = None

    @model_validator(mode="after")
    def _not_empty(self) -> Self:
        if not self.model_fields_set:
            raise ValueError("give at least one of client, site, author, date")
        return self
