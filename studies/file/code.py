"""The table of a study file that names a building code, with its parameters."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from ...motions import Building
from ..codes.asce7 import CATEGORIES, Asce7, Factors
from ..codes.check import CLASSES, Code
from ..codes.eurocode8 import Eurocode8
from .table import KeyInfo, Table, one_of, refuse_foreign

STANDARDS: dict[str, tuple[set[str], set[str]]] = {
    "asce7-22": ({"sds_g", "design_category", "factors", "r_mu"}, {"sds_g", "design_category"}),
    "ec8": ({"ag_g", "soil_factor", "component_period_s", "q_a"}, {"ag_g", "soil_factor", "component_period_s"}),
}
"""Codes, each with its own keys and the keys that must be given."""


class FactorsTable(Table):
    """Component factors of ASCE/SEI 7-22 for one class of pieces, from its tables 13.5-1 and 13.6-1."""

    c_ar: Annotated[float, Field(gt=0.0, le=10.0, description="C_AR above grade.")]
    c_ar_at_grade: Annotated[
        float | None, KeyInfo("as `c_ar`"), Field(gt=0.0, le=10.0, description="C_AR at or below grade.")
    ] = None
    r_po: Annotated[float, Field(gt=0.0, le=10.0, description="Component strength factor R_po.")]

    def build(self) -> Factors:
        """Return the factors."""
        return Factors(self.c_ar if self.c_ar_at_grade is None else self.c_ar_at_grade, self.c_ar, self.r_po)


class CodeTable(Table):
    """A building code: which pieces it requires to be anchored, for which force, and whether anchors are enough."""

    standard: Annotated[
        str, one_of(STANDARDS), Field(description="The code: ASCE/SEI 7-22, chapter 13, or EN 1998-1, 4.3.5.")
    ]
    sds_g: Annotated[float | None, Field(gt=0.0, le=4.0, description="S_DS, in g.")] = None
    design_category: Annotated[str | None, one_of(CATEGORIES), Field(description="Seismic design category.")] = None
    factors: Annotated[
        dict[str, FactorsTable] | None,
        KeyInfo("none: no forces"),
        Field(
            description="C_AR and R_po of each class of pieces (storage, laboratory, equipment), from tables "
            "13.5-1 and 13.6-1, which are not reproduced."
        ),
    ] = None
    r_mu: Annotated[float | None, KeyInfo(1.3), Field(ge=1.3, le=10.0, description="R_μ of the building.")] = None
    ag_g: Annotated[float | None, Field(gt=0.0, le=1.5, description="a_g = γ_I a_gR, in g.")] = None
    soil_factor: Annotated[float | None, Field(ge=0.5, le=5.0, description="Soil factor S.")] = None
    component_period_s: Annotated[
        float | None,
        Field(ge=0.0, le=5.0, description="Period T_a of the anchored pieces, s; 0: rigid and rigidly held."),
    ] = None
    q_a: Annotated[
        float | None, KeyInfo("2 for storage, else 1"), Field(ge=1.0, le=2.0, description="Behaviour factor q_a.")
    ] = None
    importance: Annotated[
        float, Field(ge=1.0, le=1.5, description="I_p or γ_a of pieces that state none in `code_importance`.")
    ] = 1.0

    def build(self, building: Building | None) -> Code:
        """Make the code for a building; ValueError where a key is missing or belongs to another code."""
        own, needed = STANDARDS[self.standard]
        refuse_foreign(self, own | {"standard", "importance"}, f"standard {self.standard!r}", needed)
        period = None if building is None else float(building.periods[0])
        if self.standard == "ec8":
            assert self.ag_g is not None  # checked above
            assert self.soil_factor is not None
            assert self.component_period_s is not None
            return Eurocode8(self.ag_g, self.soil_factor, self.component_period_s, period, self.importance, self.q_a)
        if self.importance not in (1.0, 1.5):
            raise ValueError(f"importance must be 1.0 or 1.5 by 'asce7-22' (13.1.3), got {self.importance:g}")
        for name in self.factors or {}:
            if name not in CLASSES[:3]:
                raise ValueError(f"factors must be of {', '.join(CLASSES[:3])}, got {name!r}")
        factors = {name: one.build() for name, one in (self.factors or {}).items()}
        assert self.sds_g is not None
        assert self.design_category is not None
        return Asce7(self.sds_g, self.design_category, factors, self.importance, self.r_mu or 1.3, period)
