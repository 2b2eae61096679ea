"""The precision that a sequential analysis is to reach: a quantity of a curve, its tolerance, and its motions."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from ...core import checks
from ...core.parameters import Parameter
from ..fitting.states import State
from ..hazard.curve import HazardCurve

MEDIAN, DISPERSION, RATE, PROBABILITY = "median", "dispersion", "rate", "probability"
TARGETS = (MEDIAN, DISPERSION, RATE, PROBABILITY)
"""Quantities whose precision can be asked for."""
USUAL = 0.10
LEAST, MOST = 64, 2000
FEWEST = 32
FINEST = 1e-3
TOLERANCES = {name: Parameter(at_least=FINEST, below=0.5 if name == PROBABILITY else 1.0) for name in TARGETS}
"""Half widths that can be asked for."""


@dataclass(frozen=True)
class Until:
    """Precision at which a sequential analysis stops, at 95 % confidence.

    `target` is "median", "dispersion", "rate" or "probability". `tolerance` is the half width of the interval: as a
    share of the value, or absolute for a probability. `level` of the intensity measure (SI, > 0) belongs to a
    probability. `least` and `most` are numbers of motions before the first look and in all. `state` is the damage state
    of the curve, None for the usual one; `hazard` is the hazard curve of a rate.
    """

    target: str = MEDIAN
    tolerance: float = USUAL
    level: float = math.nan
    least: int = LEAST
    most: int = MOST
    state: State | None = None
    hazard: HazardCurve | None = None

    def __post_init__(self) -> None:
        checks.choice("until", self.target, TARGETS)
        TOLERANCES[self.target].number(f"until {self.target}", self.tolerance)
        if self.target == PROBABILITY:
            checks.number("until probability level", self.level, above=0.0)
        checks.count("until motions least", self.least, at_least=FEWEST)
        checks.count("until motions most", self.most, at_least=self.least)

    @property
    def room(self) -> float:
        """Half width that is allowed: of ln(median) and ln(dispersion), of the rate over itself, of the probability."""
        return math.log1p(self.tolerance) if self.target in (MEDIAN, DISPERSION) else self.tolerance

    def words(self, level: str = "") -> str:
        """Return the precision in words: ``until the median is within ±10 %``; `level` belongs to a probability."""
        if self.target == PROBABILITY:
            return f"until the probability at {level} is within ±{self.tolerance:g}"
        return f"until the {self.target} is within ±{100.0 * self.tolerance:g} %"

    def describe(self) -> dict[str, Any]:
        """Return the precision as plain values that `until_of` takes, without the state and the hazard."""
        asked: Any = self.tolerance
        if self.target == PROBABILITY:
            asked = {"level": self.level, "within": self.tolerance}
        return {self.target: asked, "motions": {"least": self.least, "most": self.most}}


def until_of(asked: Mapping[str, Any] | Until | None) -> Until:
    """Return the precision that a mapping asks for; ±10 % of the median if it names no quantity.

    The mapping has one of ``median``, ``dispersion`` and ``rate`` (share of the value), or ``probability``, a mapping
    of ``level``, SI, and ``within``, the half width. It may have ``motions``, a mapping of `least` and ``most``;
    ``state``; and ``hazard``.
    """
    if isinstance(asked, Until):
        return asked
    entries = _mapping("until", {} if asked is None else asked, (*TARGETS, "motions", "state", "hazard"))
    targets = [name for name in TARGETS if name in entries]
    if len(targets) > 1:
        raise ValueError(f"until must name one of {', '.join(TARGETS)}, got {' and '.join(targets)}")
    motions = _mapping("until motions", entries.get("motions", {}), ("least", "most"))
    least = checks.count("until motions least", motions.get("least", LEAST))
    most = checks.count("until motions most", motions.get("most", max(MOST, least)))
    asked_of = entries.get("state"), entries.get("hazard")
    if not targets:
        return Until(MEDIAN, USUAL, math.nan, least, most, *asked_of)
    (target,) = targets
    if target != PROBABILITY:
        return Until(target, checks.number(f"until {target}", entries[target]), math.nan, least, most, *asked_of)
    at = _mapping("until probability", entries[target], ("level", "within"))
    if set(at) != {"level", "within"}:
        raise ValueError("until probability must have a level and within, the half width of its interval")
    level = checks.number("until probability level", at["level"])
    return Until(target, checks.number("until probability within", at["within"]), level, least, most, *asked_of)


def _mapping(name: str, value: Any, allowed: tuple[str, ...]) -> dict[str, Any]:
    if not isinstance(value, Mapping):
        raise TypeError(f"{name} must be a mapping of {', '.join(allowed)}, got {checks.kind(value)}")
    for key in value:
        checks.choice(f"an entry of {name}", key, allowed)
    return dict(value)
