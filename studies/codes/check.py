"""The parts that all codes share: a piece as a code sees it, the duty to anchor it, and the force on its anchors."""

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from typing import ClassVar, NamedTuple

from ...core.parameters import check
from ...core.units import STANDARD_GRAVITY
from ...motions.floors.strength import Importance

REQUIRED, EXEMPT, UNCHECKED = "required", "exempt", "not checked"
UNSTATED_DANGER = "the inventory does not say whether it endangers people"
"""Missing statement: the danger of a fall to people is not stated."""
CLASSES = ("storage", "laboratory", "equipment", "furniture", "movable")
"""Classes of pieces: permanent floor-supported cabinets and shelves, laboratory equipment, mechanical and electrical
equipment, other furniture, and temporary or movable pieces.
"""


@dataclass(frozen=True)
class Component:
    """A piece in terms of a code: sizes (m), mass (kg), and data on its place and its anchor.

    `kind` is one of `CLASSES`, '' if it is not known. `z` is the height of its floor above the base, and `h` the height
    of the roof, m; None if they are not known. `safety` is True if its fall is a risk to persons, and `stated` if the
    inventory states its consequences. `strength` is the design strength (N) of the anchors of one piece
    against a horizontal force at `anchor_height` (m above its floor), None if they are not known.
    """

    width: float
    height: float
    cm_height: float
    kind: str = ""
    mass: float | None = None
    importance: float | None = None
    z: float | None = None
    h: float | None = None
    at_grade: bool = False
    safety: bool = False
    stated: bool = False
    anchored: bool = False
    strength: float | None = None
    anchor_height: float | None = None

    @property
    def weight(self) -> float:
        """Weight, N; NaN if the mass is not known."""
        return math.nan if self.mass is None else self.mass * STANDARD_GRAVITY


class CodeCheck(NamedTuple):
    """A code's demands on a piece; NaN if something is not known.

    `coefficient`: design force over weight. `force`: design force at the centre of mass, N. `demand`: force on the
    anchor, N. `ratio`: demand over the strength of the anchor. `factors`: derivation of the coefficient, in words.
    """

    status: str
    clause: str
    factors: str
    coefficient: float
    force: float
    demand: float
    ratio: float

    @property
    def missing(self) -> str:
        """Missing data of a check that was not possible."""
        return (self.clause.partition(": ")[2] or self.clause) if self.status == UNCHECKED else ""


@dataclass(frozen=True)
class Code(ABC):
    """A building code with the parameters of a site and a building.

    Parameters
    ----------
    importance : float
        I_p or γ_a of pieces that state none in `code_importance`.
    building_period : float, optional
        Fundamental period of the building, s.
    """

    importance: Importance = field(default=1.0, kw_only=True)
    building_period: float | None = field(default=None, kw_only=True)
    title: ClassVar[str]
    """The code and its clause on components."""

    def __post_init__(self) -> None:
        check(self)

    @property
    @abstractmethod
    def site(self) -> str:
        """The parameters of the site, in words."""

    @property
    @abstractmethod
    def held_down(self) -> float:
        """Share of the weight that may be counted against overturning."""

    @abstractmethod
    def duty(self, component: Component) -> tuple[str, str]:
        """Return True if a piece must be anchored, and the clause that requires it."""

    @abstractmethod
    def coefficient(self, component: Component) -> tuple[float, str]:
        """Return the design force over the weight, and its factors in words; NaN with the missing data."""

    def check(self, component: Component) -> CodeCheck:
        """Check a piece; forces are computed if it must be anchored."""
        status, clause = self.duty(component)
        if status != REQUIRED:
            return CodeCheck(status, clause, "", math.nan, math.nan, math.nan, math.nan)
        coefficient, factors = self.coefficient(component)
        force = coefficient * component.weight
        demand = anchor_demand(force, self.held_down, component)
        ratio = demand / component.strength if component.strength else math.nan
        return CodeCheck(status, clause, factors, coefficient, force, demand, ratio)


def anchor_demand(force: float, held_down: float, component: Component) -> float:
    """Return the horizontal force on the anchor of a piece, N.

    Let h_a be the height of the anchor. By moments about the edge of the base, the force is (F h_cm - w W b)/h_a, at
    least 0. Here b is half the width and w the share of the weight W that counts. The rest of F acts at the base, which
    is not checked here. Without that height the whole force F acts on the anchor.
    """
    if component.anchor_height is None:
        return force
    turning = force * component.cm_height - held_down * component.weight * component.width / 2.0
    return max(turning, 0.0) / component.anchor_height
