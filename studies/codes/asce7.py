"""ASCE/SEI 7-22, chapter 13: which components must be anchored, and the force F_p."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, NamedTuple

from .check import EXEMPT, REQUIRED, UNCHECKED, Code, Component

CATEGORIES = ("A", "B", "C", "D", "E", "F")
TALL = 1.829
"""Height (6 ft) above which floor-supported storage is no furniture."""
LIGHT, LOW = 1780.0, 1.22
"""Weight, N, and height of the centre of mass, m (400 lb, 4 ft), up to which attached equipment is exempt."""
VERY_LIGHT = 89.0
"""Weight, N (20 lb), up to which attached equipment is exempt at any height."""


class Factors(NamedTuple):
    """Component factors of table 13.5-1 or 13.6-1: resonance ductility, at grade and above, and strength."""

    c_ar_at_grade: float
    c_ar: float
    r_po: float


@dataclass(frozen=True)
class Asce7(Code):
    """ASCE/SEI 7-22 at a site.

    `sds` is the design spectral acceleration at short periods S_DS, in g; `category` the seismic design category, A to
    F; `factors` C_AR and R_po of each class of components, from the tables of the standard; `importance` I_p, 1.0 or
    1.5, of pieces that state none; `r_mu` the ductility reduction factor R_mu of the building, at least 1.3; `period`
    its approximate fundamental period T_a, s.

    F_p = 0.4 S_DS I_p W_p (H_f/R_mu)(C_AR/R_po), between 0.3 and 1.6 S_DS I_p W_p (13.3-1 to 13.3-3); H_f = 1 + a_1
    (z/h) + a_2 (z/h)^10 with a_1 = min(1/T_a, 2.5), a_2 = max(1 - (0.4/T_a)², 0), where T_a is not known 1 + 2.5 z/h;
    R_mu = 1 and H_f = 1 at grade. Against overturning 0.9 - 0.2 S_DS of the weight counts.

    Exempt by 13.1.4: furniture other than storage cabinets; temporary and movable equipment; architectural components
    in category B with I_p = 1; mechanical and electrical ones in B, in C with I_p = 1 where they are attached, and in D
    to F with I_p = 1 where they are attached with flexible connections (which are not known here: *not checked*) and
    weigh up to 1780 N with the centre of mass up to 1.22 m above the floor, or up to 89 N. Everything in category A
    (11.7). Storage cabinets and shelves are components from 1.829 m (table 13.5-1).

    ASCE/SEI 7-22, Minimum design loads and associated criteria for buildings and other structures, chapter 13 (F_p and
    table 13.5-1's rows from code-checking software; exemptions as in earlier editions, recalled).
    """

    sds: float
    category: str
    factors: Mapping[str, Factors]
    importance: float = 1.0
    r_mu: float = 1.3
    period: float | None = None
    title: ClassVar[str] = "ASCE/SEI 7-22, chapter 13"

    @property
    def site(self) -> str:
        return f"S_DS = {self.sds:g} g, seismic design category {self.category}"

    @property
    def held_down(self) -> float:
        return max(0.9 - 0.2 * self.sds, 0.0)

    def duty(self, one: Component) -> tuple[str, str]:
        importance = one.importance or self.importance
        if self.category == "A":
            return EXEMPT, "11.7: category A"
        if not one.kind:
            return UNCHECKED, "code_class not given"
        if one.kind == "furniture":
            return EXEMPT, "13.1.4: furniture"
        if one.kind == "movable":
            return EXEMPT, "13.1.4: temporary or movable"
        if one.kind == "storage" and one.height <= TALL:
            return EXEMPT, f"13.1.4: furniture, up to {TALL:g} m tall"
        if one.kind == "equipment":
            return self._equipment(one, importance)
        if self.category == "B" and importance == 1.0:
            return EXEMPT, "13.1.4: architectural, category B, I_p = 1"
        return REQUIRED, "13.4, table 13.5-1"

    def _equipment(self, one: Component, importance: float) -> tuple[str, str]:
        required = REQUIRED, "13.4, table 13.6-1"
        if self.category == "B":
            return EXEMPT, "13.1.4: category B"
        if importance != 1.0 or not one.anchored:
            return required
        if self.category == "C":
            return EXEMPT, "13.1.4: category C, I_p = 1, attached"
        if one.weight <= VERY_LIGHT or (one.weight <= LIGHT and one.cm_height <= LOW):
            return UNCHECKED, "13.1.4: light and low: exempt where its connections are flexible"
        return required

    def coefficient(self, one: Component) -> tuple[float, str]:
        factors = self.factors.get(one.kind)
        if factors is None:
            return math.nan, f"C_AR and R_po of {one.kind} are not given"
        importance = one.importance or self.importance
        if one.at_grade:
            height, r_mu, c_ar = 1.0, 1.0, factors.c_ar_at_grade
        elif one.z is None or one.h is None:
            return math.nan, "the height of the floor is not known"
        else:
            height, r_mu, c_ar = height_factor(one.z / one.h, self.period), self.r_mu, factors.c_ar
        plain = 0.4 * (height / r_mu) * (c_ar / factors.r_po)
        least, most = 0.3, 1.6
        found = min(max(plain, least), most)
        limit = "" if found == plain else f", limited to {found:g} S_DS I_p"
        words = (
            f"0.4 S_DS I_p (H_f/R_μ)(C_AR/R_po) with S_DS = {self.sds:g}, I_p = {importance:g}, H_f = {height:.3g}, "
            f"R_μ = {r_mu:.3g}, C_AR = {c_ar:g}, R_po = {factors.r_po:g}{limit}"
        )
        return found * self.sds * importance, words


def height_factor(height: float, period: float | None = None) -> float:
    """Return H_f, the amplification of the acceleration with height, at z/h of a building with the period T_a (s)."""
    if period is None:
        return 1.0 + 2.5 * height
    first, tenth = min(1.0 / period, 2.5), max(1.0 - (0.4 / period) * (0.4 / period), 0.0)
    return float(1.0 + first * height + tenth * height**10)
