"""EN 1998-1, 4.3.5: non-structural elements that must resist the design seismic action, and the force F_a."""

import math
from dataclasses import dataclass
from typing import Annotated, ClassVar

from ...core.parameters import Parameter
from .check import EXEMPT, REQUIRED, UNCHECKED, UNSTATED_DANGER, Code, Component

VERY_LOW, VERY_LOW_ON_SOIL = 0.04, 0.05
"""a_g and a_g S, in g, up to which a site is of very low seismicity (recommended values)."""


@dataclass(frozen=True)
class Eurocode8(Code):
    """EN 1998-1 at a site.

    Parameters
    ----------
    ag_g : float
        a_g = γ_I a_gR, in g.
    soil_factor : float
        Soil factor S.
    component_period : float
        Period T_a of the anchored pieces, s; 0: rigid and rigidly held.
    q_a : float, optional
        Behaviour factor q_a.

    Notes
    -----
    If no q_a is given it is 2 for storage (table 4.4: anchorage of permanent cabinets and book stacks supported by the
    floor) and 1 for others.

    F_a = S_a W_a gamma_a / q_a (4.24), S_a = alpha S [3 (1 + z/H)/(1 + (1 - T_a/T_1)²) - 0.5], at least alpha S (4.25).
    Elements that might cause risks to persons in case of failure shall be verified (4.3.5.1(1)P). Here these are
    elements whose consequences are a matter of safety, and elements with gamma_a above 1. Elements with other
    consequences are exempt; a service of a critical facility counts if `performance.safety` names it. In very low
    seismicity the code need not be observed (3.2.1(5)P): a_g up to 0.04 g, or a_g S up to 0.05 g (recommended values,
    national choice).

    EN 1998-1:2004, Design of structures for earthquake resistance, 3.2.1, 4.3.5 (4.3.5.1 read, the formulas recalled).
    """

    ag_g: Annotated[float, Parameter(above=0.0, at_most=1.5)]
    soil_factor: Annotated[float, Parameter(at_least=0.5, at_most=5.0)]
    component_period: Annotated[float, Parameter("s", at_least=0.0, at_most=5.0)]
    q_a: Annotated[float, Parameter(at_least=1.0, at_most=2.0)] | None = None
    title: ClassVar[str] = "EN 1998-1, 4.3.5"

    @property
    def site(self) -> str:
        return f"a_g = {self.ag_g:g} g, S = {self.soil_factor:g}, T_a = {self.component_period:g} s"

    @property
    def held_down(self) -> float:
        return 1.0

    def duty(self, component: Component) -> tuple[str, str]:
        if self.ag_g <= VERY_LOW or self.ag_g * self.soil_factor <= VERY_LOW_ON_SOIL:
            return EXEMPT, "3.2.1(5)P: very low seismicity, where the national annex keeps its values"
        if component.safety or (component.importance or self.importance) > 1.0:
            return REQUIRED, "4.3.5.1(1)P"
        if component.stated:
            return EXEMPT, "4.3.5.1(1)P: its consequences are no risk to persons"
        return UNCHECKED, f"4.3.5.1(1)P: {UNSTATED_DANGER}"

    def coefficient(self, component: Component) -> tuple[float, str]:
        if component.at_grade:
            height = 0.0
        elif component.z is None or component.h is None:
            return math.nan, "the height of the floor is not known"
        else:
            height = component.z / component.h
        if self.component_period == 0.0:
            ratio = 0.0
        elif self.building_period is None:
            return math.nan, "the period of the building is not known"
        else:
            ratio = self.component_period / self.building_period
        amplified = max(3.0 * (1.0 + height) / (1.0 + (1.0 - ratio) * (1.0 - ratio)) - 0.5, 1.0)
        spectral = self.ag_g * self.soil_factor * amplified
        importance = component.importance or self.importance
        q = self.q_a or (2.0 if component.kind == "storage" else 1.0)
        words = (
            f"S_a γ_a/q_a with S_a = {spectral:.3g} g (α = {self.ag_g:g}, S = {self.soil_factor:g}, "
            f"z/H = {height:.3g}, T_a/T_1 = {ratio:.3g}), γ_a = {importance:g}, q_a = {q:g}"
            f"{'' if self.q_a or component.kind else ' (code_class is not given)'}"
        )
        return spectral * importance / q, words
