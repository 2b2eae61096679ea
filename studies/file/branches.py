"""The tables of a study file that weigh what is not known: branches, motion_sets and hazards."""

from __future__ import annotations

import math
from typing import Annotated, Self

from pydantic import Field, model_validator

from .hazard import COMMON, HazardTable
from .motions import MotionsTable
from .table import KeyInfo, Table, one_of

OF_MODELS, OF_MOTIONS, OF_HAZARD = OF = ("models", "motions", "hazard")
"""What branches may be of; the last two are also the names of the study's own tables among the branches."""

Named = Annotated[str, Field(min_length=1, max_length=200, description="Its name among the branches.")]


class BranchTable(Table):
    """Alternatives of one kind, with the weights that somebody gives them."""

    of: Annotated[str, one_of(OF), Field(description="What they are alternatives of.")]
    names: Annotated[
        list[str],
        Field(
            min_length=1,
            max_length=100,
            description=(
                "Labels or short names of laws; `motions` or names of `motion_sets`; `hazard` or names of `hazards`."
            ),
        ),
    ]
    weights: Annotated[
        list[Annotated[float, Field(gt=0.0, le=1.0)]],
        KeyInfo(above=0.0, at_most=1.0),
        Field(min_length=1, max_length=100, description="Their weights, which sum to 1."),
    ]

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
    """Other motions that may be the right ones."""

    name: Named
    motions: Annotated[MotionsTable, Field(description="What shakes them instead of [motions].")]


class HazardSetTable(Table):
    """Another hazard curve that may be the right one."""

    name: Named
    hazard: Annotated[HazardTable, Field(description="The curve, instead of that of [hazard].")]

    @model_validator(mode="after")
    def _curve_alone(self) -> Self:
        given = sorted(self.hazard.model_fields_set & COMMON)
        if given:
            raise ValueError(f"hazards hold curves alone, {given[0]} stands in [hazard]")
        return self
