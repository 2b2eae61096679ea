"""The table of a study file that describes a damping law: ``[[models]]``."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from ...models import LAWS, Law
from ...models.laws import GEOMETRIES, LEVERS, RESTS
from .table import KeyInfo, Table, one_of


class ModelTable(Table):
    """One damping law and its options."""

    law: Annotated[str, one_of(LAWS), Field(description="Short name of the damping law.")]
    e: Annotated[
        float | None,
        KeyInfo("the block's own, e_R = 1 - (2/λ) sin²α", above=0.0, at_most=1.0),
        Field(description="Restitution, above 0 to 1."),
    ] = None
    restitution_factor: Annotated[
        float | None, KeyInfo(1.0, above=0.0), Field(description="Factor on e_R where e is not given.")
    ] = None
    delta: Annotated[
        float | None,
        KeyInfo(0.05, above=0.0, below=1.0),
        Field(description="Half width of the elastic zone over α, 0 to 1."),
    ] = None
    zeta: Annotated[float | None, KeyInfo(at_least=0.0), Field(description="Damping ratio of the viscous law.")] = None
    coefficient: Annotated[
        float | None, KeyInfo(0.02, at_least=0.0), Field(description="Coefficient of the law of Vassiliou et al.")
    ] = None
    lever: Annotated[str | None, one_of(LEVERS), KeyInfo("h"), Field(description="Lever arm of the shaking.")] = None
    rest: Annotated[
        str | None, one_of(RESTS), KeyInfo("elastic; rigid for `energy-consistent`"), Field(description="Kind of rest.")
    ] = None
    geometry: Annotated[str | None, one_of(GEOMETRIES), KeyInfo("exact"), Field(description="Housner's geometry.")] = (
        None
    )

    def build(self) -> Law:
        """Make the law; ValueError where an option does not belong to it or is out of range."""
        options = {k: v for k, v in self.model_dump().items() if v is not None and k != "law"}
        law = LAWS[self.law]
        known = set(law.__dataclass_fields__)  # type: ignore[attr-defined]
        foreign = sorted(set(options) - known)
        if foreign:
            raise ValueError(f"law {self.law!r} has no option {foreign[0]!r}, allowed are {', '.join(sorted(known))}")
        if self.law == "viscous" and self.zeta is None:
            raise ValueError("law 'viscous' needs zeta (its damping ratio)")
        return law(**options)
