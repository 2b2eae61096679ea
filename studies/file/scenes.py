"""Restraints of a study file: ``[restraints.NAME]``, which blocks name."""

from __future__ import annotations

import math
from typing import Annotated, Self

from pydantic import Field, model_validator

from ...models import Restraint
from ...models.scenes.restraint import KINDS
from .table import KeyInfo, Table, one_of

STIFFNESSES = {"strap": 20.0, "bracket": 500.0, "cable": 100.0}
"""Stiffness (N/mm) where a table gives none: a judgement, no source was found."""
AT_A_HEIGHT = ("strap", "bracket", "cable")
BESIDE = ("pole", "adhesive")
KEYS = {
    "strap": {"height_m", "strength_n", "stiffness_n_per_mm", "slack_mm", "preload_n", "count"},
    "bracket": {"height_m", "strength_n", "stiffness_n_per_mm", "slack_mm", "count"},
    "cable": {"height_m", "strength_n", "stiffness_n_per_mm", "slack_mm", "preload_n", "count", "angle_deg", "width_m"},
    "pole": {"front_m", "back_m", "strength_n", "stiffness_n_per_mm", "preload_n", "count"},
    "tendon": {"width_m", "strength_n", "stiffness_n_per_mm", "preload_n"},
    "adhesive": {"front_m", "back_m", "strength_n"},
}
NEEDED = {
    "strap": ("height_m",),
    "bracket": ("height_m",),
    "cable": ("height_m",),
    "pole": ("front_m", "back_m", "stiffness_n_per_mm", "preload_n"),
    "tendon": ("width_m", "stiffness_n_per_mm"),
    "adhesive": ("front_m",),
}


class RestraintTable(Table):
    """A restraint: what it is, where it acts, and when it breaks."""

    kind: Annotated[str, one_of(KINDS), Field(description="What it is; straps and cables act to the front only.")]
    strength_n: Annotated[
        float, KeyInfo(above=0.0), Field(description="Force at which it breaks, the least of device and fixings, N.")
    ]
    height_m: Annotated[
        float | None, KeyInfo("needed by straps, brackets, cables", above=0.0), Field(description="Height, m.")
    ] = None
    stiffness_n_per_mm: Annotated[
        float | None,
        KeyInfo("strap 20, bracket 500, cable 100", above=0.0),
        Field(description="Force over elongation; the defaults are judgement."),
    ] = None
    slack_mm: Annotated[float, Field(ge=0.0, description="Elongation before it is taut, mm.")] = 0.0
    preload_n: Annotated[
        float | None, KeyInfo(0.0, at_least=0.0), Field(ge=0.0, description="Force at rest, N (poles need it).")
    ] = None
    count: Annotated[int, Field(ge=1, le=100, description="How many act side by side.")] = 1
    front_m: Annotated[
        float | None,
        KeyInfo("needed by poles, adhesives", above=0.0),
        Field(description="Distance to the front lower edge, m."),
    ] = None
    back_m: Annotated[
        float | None, KeyInfo("adhesives: `front_m`", above=0.0), Field(description="To the rear lower edge, m.")
    ] = None
    angle_deg: Annotated[
        float | None,
        KeyInfo(0.0, above=-90.0, below=90.0),
        Field(description="Of a cable, upwards from horizontal."),
    ] = None
    width_m: Annotated[
        float | None,
        KeyInfo("needed by tendons, sloping cables", above=0.0),
        Field(description="Its block's width, m."),
    ] = None

    @model_validator(mode="after")
    def _fits(self) -> Self:
        given = {name for name in self.model_fields_set if getattr(self, name) is not None}
        for name in sorted(given - {"kind"} - KEYS[self.kind]):
            raise ValueError(f"a {self.kind} has no {name}, its keys are {', '.join(sorted(KEYS[self.kind]))}")
        for name in NEEDED[self.kind]:
            if name not in given:
                raise ValueError(f"a {self.kind} needs {name}")
        if self.angle_deg and self.width_m is None:
            raise ValueError("a cable with an angle needs width_m")
        return self

    def build(self) -> Restraint:
        """Make the restraint; ValueError where its values are out of range."""
        given = STIFFNESSES.get(self.kind) if self.stiffness_n_per_mm is None else self.stiffness_n_per_mm
        stiffness = math.inf if given is None else 1000.0 * given
        slack, preload = 1e-3 * self.slack_mm, self.preload_n or 0.0
        if self.kind == "adhesive":
            assert self.front_m is not None
            return Restraint.adhesive(self.strength_n, self.front_m, self.back_m)
        if self.kind == "tendon":
            assert self.width_m is not None
            return Restraint.tendon(stiffness, self.strength_n, preload, width=self.width_m)
        if self.kind == "pole":
            assert self.front_m is not None
            assert self.back_m is not None
            return Restraint.pole(preload, self.strength_n, stiffness, self.front_m, self.back_m, self.count)
        assert self.height_m is not None
        if self.kind == "bracket":
            return Restraint.bracket(self.height_m, self.strength_n, stiffness, slack, self.count)
        if self.kind == "strap":
            return Restraint.strap(self.height_m, self.strength_n, stiffness, slack, preload, self.count)
        angle, width = math.radians(self.angle_deg or 0.0), self.width_m or 0.0
        return Restraint.cable(
            self.height_m, self.strength_n, stiffness, slack, preload, self.count, angle=angle, width=width
        )
