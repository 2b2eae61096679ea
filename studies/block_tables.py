"""Tables of a study file that say what stands there: blocks and damping laws."""

from __future__ import annotations

import math
from typing import Annotated, Self

from pydantic import Field, model_validator

from ..models import LAWS, Block, Law, catalogue
from ..models.laws import GEOMETRIES, LEVERS, RESTS
from .tables import Said, Table, one_of


class BlockTable(Table):
    """One block: a catalogue name, or outer sizes, or slenderness and size."""

    catalogue: Annotated[str | None, Field(description="Name of a catalogue item (see `toppling catalogue`).")] = None
    name: Annotated[
        str | None, Said("what it is"), Field(min_length=1, max_length=200, description="Label in results.")
    ] = None
    width_m: Annotated[
        float | None, Said(above=0.0), Field(description="Full width in the direction of shaking, m.")
    ] = None
    height_m: Annotated[float | None, Said(above=0.0), Field(description="Full height, m.")] = None
    cm_height_m: Annotated[
        float | None,
        Said("mid-height", above=0.0),
        Field(description="Height of the centre of mass, m; inertia_factor must come with it."),
    ] = None
    inertia_factor: Annotated[
        float | None, Said("4/3", above=1.0, at_most=2.0), Field(description="I_O/(m R²), above 1 to 2.")
    ] = None
    alpha_rad: Annotated[
        float | None,
        Said(above=0.0, below=0.5 * math.pi),
        Field(description="Slenderness, rad, instead of sizes."),
    ] = None
    R_m: Annotated[float | None, Said(above=0.0), Field(description="Size R, m, instead of sizes.")] = None

    @model_validator(mode="after")
    def _one_way(self) -> Self:
        ways = (
            self.catalogue is not None,
            self.width_m is not None and self.height_m is not None,
            self.alpha_rad is not None and self.R_m is not None,
        )
        given = {name for name in self.model_fields_set if getattr(self, name) is not None}
        allowed = (
            {"catalogue", "cm_height_m", "inertia_factor", "name"},
            {"width_m", "height_m", "cm_height_m", "inertia_factor", "name"},
            {"alpha_rad", "R_m", "inertia_factor", "name"},
        )
        if sum(ways) != 1 or not given <= allowed[ways.index(True)]:
            raise ValueError(
                "a block needs either catalogue, or width_m and height_m, or alpha_rad and R_m, got "
                + (", ".join(sorted(given)) or "nothing")
            )
        return self

    def build(self) -> Block:
        """The block; ValueError where its values are out of range or its name is not in the catalogue."""
        if self.catalogue is not None:
            try:
                block = catalogue[self.catalogue]
            except KeyError as error:
                raise ValueError(error.args[0]) from None
            name = block.name if self.name is None else self.name
            return Block(block.width, block.height, self.cm_height_m, self.inertia_factor, name)
        if self.alpha_rad is not None and self.R_m is not None:
            factor = 4.0 / 3.0 if self.inertia_factor is None else self.inertia_factor
            return Block.from_slenderness(self.alpha_rad, self.R_m, factor, self.name)
        assert self.width_m is not None  # one of three ways, checked above
        assert self.height_m is not None
        return Block(self.width_m, self.height_m, self.cm_height_m, self.inertia_factor, self.name)


class ModelTable(Table):
    """One damping law and its options."""

    law: Annotated[str, one_of(LAWS), Field(description="Short name of the damping law.")]
    e: Annotated[
        float | None,
        Said("the block's own, e_R = 1 - (2/λ) sin²α", above=0.0, at_most=1.0),
        Field(description="Restitution, above 0 to 1."),
    ] = None
    restitution_factor: Annotated[
        float | None, Said(1.0, above=0.0), Field(description="Factor on e_R where e is not given.")
    ] = None
    delta: Annotated[
        float | None,
        Said(0.05, above=0.0, below=1.0),
        Field(description="Half width of the elastic zone over α, 0 to 1."),
    ] = None
    zeta: Annotated[float | None, Said(at_least=0.0), Field(description="Damping ratio of the viscous law.")] = None
    coefficient: Annotated[
        float | None, Said(0.02, at_least=0.0), Field(description="Coefficient of the law of Vassiliou et al.")
    ] = None
    lever: Annotated[str | None, one_of(LEVERS), Said("h"), Field(description="Lever arm of the shaking.")] = None
    rest: Annotated[
        str | None, one_of(RESTS), Said("elastic; rigid for `energy-consistent`"), Field(description="Kind of rest.")
    ] = None
    geometry: Annotated[str | None, one_of(GEOMETRIES), Said("exact"), Field(description="Housner's geometry.")] = None

    def build(self) -> Law:
        """The law; ValueError where an option does not belong to it or is out of range."""
        options = {k: v for k, v in self.model_dump().items() if v is not None and k != "law"}
        law = LAWS[self.law]
        known = set(law.__dataclass_fields__)  # type: ignore[attr-defined]
        foreign = sorted(set(options) - known)
        if foreign:
            raise ValueError(f"law {self.law!r} has no option {foreign[0]!r}, allowed are {', '.join(sorted(known))}")
        if self.law == "viscous" and self.zeta is None:
            raise ValueError("law 'viscous' needs zeta (its damping ratio)")
        return law(**options)
