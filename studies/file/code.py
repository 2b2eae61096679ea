"""The table of a study file that names a building code, with its parameters."""

from __future__ import annotations

from abc import abstractmethod
from typing import TYPE_CHECKING, Annotated

from pydantic import Field

from ...motions import Building
from ..codes.asce7 import CATEGORIES, Asce7, Factors
from ..codes.check import CLASSES, Code
from ..codes.eurocode8 import Eurocode8
from .derived import choice
from .table import KeyInfo, Table, one_of


class FactorsTable(Table):
    """Component factors of ASCE/SEI 7-22 for one class of pieces, from its tables 13.5-1 and 13.6-1.

    c_ar: C_AR above grade.
    c_ar_at_grade: C_AR at or below grade.
    r_po: Component strength factor R_po.
    """

    c_ar: Annotated[float, Field(gt=0.0, le=10.0)]
    c_ar_at_grade: Annotated[float | None, KeyInfo("as `c_ar`"), Field(gt=0.0, le=10.0)] = None
    r_po: Annotated[float, Field(gt=0.0, le=10.0)]

    def build(self) -> Factors:
        """Return the factors."""
        return Factors(self.c_ar if self.c_ar_at_grade is None else self.c_ar_at_grade, self.c_ar, self.r_po)


class CodeTable(Table):
    """A building code: which pieces it requires to be anchored, for which force, and whether anchors are enough.

    standard: The code: ASCE/SEI 7-22, chapter 13, or EN 1998-1, 4.3.5.
    importance: I_p or γ_a of pieces that state none in `code_importance`.
    """

    standard: str
    importance: Annotated[float, Field(ge=1.0, le=1.5)] = 1.0

    @abstractmethod
    def build(self, building: Building | None) -> Code:
        """Make the code for a building; ValueError where values do not belong to it."""


class Asce7Table(CodeTable):
    """ASCE/SEI 7-22, chapter 13, at a site.

    sds_g: S_DS, in g.
    design_category: Seismic design category.
    factors: C_AR and R_po of each class of pieces (storage, laboratory, equipment), from tables 13.5-1 and
        13.6-1, which are not reproduced.
    r_mu: R_μ of the building.
    """

    sds_g: Annotated[float, Field(gt=0.0, le=4.0)]
    design_category: Annotated[str, one_of(CATEGORIES)]
    factors: Annotated[dict[str, FactorsTable] | None, KeyInfo("none: no forces")] = None
    r_mu: Annotated[float, Field(ge=1.3, le=10.0)] = 1.3

    def build(self, building: Building | None) -> Code:
        if self.importance not in (1.0, 1.5):
            raise ValueError(f"importance must be 1.0 or 1.5 by 'asce7-22' (13.1.3), got {self.importance:g}")
        for name in self.factors or {}:
            if name not in CLASSES[:3]:
                raise ValueError(f"factors must be of {', '.join(CLASSES[:3])}, got {name!r}")
        factors = {name: table.build() for name, table in (self.factors or {}).items()}
        period = None if building is None else float(building.periods[0])
        return Asce7(self.sds_g, self.design_category, factors, self.importance, self.r_mu, period)


class Eurocode8Table(CodeTable):
    """EN 1998-1, 4.3.5, at a site.

    ag_g: a_g = γ_I a_gR, in g.
    soil_factor: Soil factor S.
    component_period_s: Period T_a of the anchored pieces, s; 0: rigid and rigidly held.
    q_a: Behaviour factor q_a.
    """

    ag_g: Annotated[float, Field(gt=0.0, le=1.5)]
    soil_factor: Annotated[float, Field(ge=0.5, le=5.0)]
    component_period_s: Annotated[float, Field(ge=0.0, le=5.0)]
    q_a: Annotated[float | None, KeyInfo("2 for storage, else 1"), Field(ge=1.0, le=2.0)] = None

    def build(self, building: Building | None) -> Code:
        period = None if building is None else float(building.periods[0])
        return Eurocode8(self.ag_g, self.soil_factor, self.component_period_s, period, self.importance, self.q_a)


if TYPE_CHECKING:
    Codes = CodeTable
else:
    Codes = choice("standard", {"asce7-22": Asce7Table, "ec8": Eurocode8Table})
