"""ASCE/SEI 7-22, chapter 13: which components must be anchored, and the force F_p."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, ClassVar

from ...core.parameters import Parameter
from ...motions.floors.strength import Design
from .check import CLASSES, EXEMPT, REQUIRED, UNCHECKED, Code, Component

CATEGORIES = ("A", "B", "C", "D", "E", "F")
TALL = 1.829
"""Height (6 ft) above which floor-supported storage is no furniture."""
LIGHT, LOW = 1780.0, 1.22
"""Weight, N, and height of the centre of mass, m (400 lb, 4 ft), up to which attached equipment is exempt."""
VERY_LIGHT = 89.0
"""Weight, N (20 lb), up to which attached equipment is exempt at any height."""


Factor = Annotated[float, Parameter(above=0.0, at_most=10.0)]


@dataclass(frozen=True)
class Factors:
    """Component factors of ASCE/SEI 7-22 for one class of pieces, from its tables 13.5-1 and 13.6-1.

    Parameters
    ----------
    c_ar : float
        C_AR above grade.
    r_po : float
        Component strength factor R_po.
    c_ar_at_grade : float, optional
        C_AR at or below grade.
    """

    c_ar: Factor
    r_po: Factor
    c_ar_at_grade: Factor | None = None


@dataclass(frozen=True)
class Asce7(Code):
    """ASCE/SEI 7-22 at a site.

    Parameters
    ----------
    sds_g : float
        S_DS, in g.
    design_category : {"A", "B", "C", "D", "E", "F"}
        Seismic design category.
    factors : mapping, optional
        C_AR and R_po of each class of pieces (storage, laboratory, equipment), from tables 13.5-1 and 13.6-1, which are
        not reproduced.
    r_mu : float
        R_μ of the building.

    Notes
    -----
    F_p = 0.4 S_DS I_p W_p (H_f/R_mu)(C_AR/R_po), between 0.3 and 1.6 S_DS I_p W_p (13.3-1 to 13.3-3). H_f = 1 + a_1
    (z/h) + a_2 (z/h)^10 with a_1 = min(1/T_a, 2.5), a_2 = max(1 - (0.4/T_a)², 0). If T_a is not known, H_f is 1 + 2.5
    z/h; R_mu = 1 and H_f = 1 at grade. Against overturning 0.9 - 0.2 S_DS of the weight counts.

    Exempt by 13.1.4 are furniture other than storage cabinets, temporary and movable equipment, and architectural
    components in category B with I_p = 1. Mechanical and electrical components are exempt in B, and in C with I_p = 1
    if they are attached. In D to F with I_p = 1 they are exempt if they are attached with flexible connections (which
    are not known here: *not checked*) and are light. Light is up to 1780 N with the centre of mass up to 1.22 m above
    the floor, or up to 89 N. In category A all are exempt (11.7). Storage cabinets and shelves are components from
    1.829 m (table 13.5-1).

    ASCE/SEI 7-22, Minimum design loads and associated criteria for buildings and other structures, chapter 13. (F_p and
    table 13.5-1's rows from code-checking software; exemptions as in earlier editions, recalled.)
    """

    sds_g: Design
    design_category: Annotated[str, Parameter(words=CATEGORIES)]
    factors: Mapping[str, Factors] | None = None
    r_mu: Annotated[float, Parameter(at_least=1.3, at_most=10.0)] = 1.3
    title: ClassVar[str] = "ASCE/SEI 7-22, chapter 13"

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.importance not in (1.0, 1.5):
            raise ValueError(f"importance must be 1.0 or 1.5 by 'asce7-22' (13.1.3), got {self.importance:g}")
        for name in self.factors or {}:
            if name not in CLASSES[:3]:
                raise ValueError(f"factors must be of {', '.join(CLASSES[:3])}, got {name!r}")

    @property
    def site(self) -> str:
        return f"S_DS = {self.sds_g:g} g, seismic design category {self.design_category}"

    @property
    def held_down(self) -> float:
        return 0.9 - 0.2 * self.sds_g

    def duty(self, component: Component) -> tuple[str, str]:
        importance = component.importance or self.importance
        if self.design_category == "A":
            return EXEMPT, "11.7: category A"
        if not component.kind:
            return UNCHECKED, "code_class not given"
        if component.kind == "furniture":
            return EXEMPT, "13.1.4: furniture"
        if component.kind == "movable":
            return EXEMPT, "13.1.4: temporary or movable"
        if component.kind == "storage" and component.height <= TALL:
            return EXEMPT, f"13.1.4: furniture, up to {TALL:g} m tall"
        if component.kind == "equipment":
            return self._equipment(component, importance)
        if self.design_category == "B" and importance == 1.0:
            return EXEMPT, "13.1.4: architectural, category B, I_p = 1"
        return REQUIRED, "13.4, table 13.5-1"

    def _equipment(self, component: Component, importance: float) -> tuple[str, str]:
        required = REQUIRED, "13.4, table 13.6-1"
        if self.design_category == "B":
            return EXEMPT, "13.1.4: category B"
        if importance != 1.0 or not component.anchored:
            return required
        if self.design_category == "C":
            return EXEMPT, "13.1.4: category C, I_p = 1, attached"
        if component.weight <= VERY_LIGHT or (component.weight <= LIGHT and component.cm_height <= LOW):
            return UNCHECKED, "13.1.4: light and low: exempt where its connections are flexible"
        return required

    def coefficient(self, component: Component) -> tuple[float, str]:
        factors = (self.factors or {}).get(component.kind)
        if factors is None:
            return math.nan, f"C_AR and R_po of {component.kind} are not given"
        importance = component.importance or self.importance
        if component.at_grade:
            height, r_mu, c_ar = 1.0, 1.0, factors.c_ar_at_grade or factors.c_ar
        elif component.z is None or component.h is None:
            return math.nan, "the height of the floor is not known"
        else:
            height, r_mu, c_ar = height_factor(component.z / component.h, self.building_period), self.r_mu, factors.c_ar
        plain = 0.4 * (height / r_mu) * (c_ar / factors.r_po)
        least, most = 0.3, 1.6
        coefficient = min(max(plain, least), most)
        limit = "" if coefficient == plain else f", limited to {coefficient:g} S_DS I_p"
        words = (
            f"0.4 S_DS I_p (H_f/R_μ)(C_AR/R_po) with S_DS = {self.sds_g:g}, I_p = {importance:g}, H_f = {height:.3g}, "
            f"R_μ = {r_mu:.3g}, C_AR = {c_ar:g}, R_po = {factors.r_po:g}{limit}"
        )
        return coefficient * self.sds_g * importance, words


def height_factor(height: float, period: float | None = None) -> float:
    """Return H_f, the amplification of the acceleration with height, at z/h of a building with the period T_a (s)."""
    if period is None:
        return 1.0 + 2.5 * height
    first, tenth = min(1.0 / period, 2.5), max(1.0 - (0.4 / period) * (0.4 / period), 0.0)
    return float(1.0 + first * height + tenth * height**10)
