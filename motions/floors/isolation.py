"""Isolation storeys: the isolators below a building, as the lowest storey of a chain."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

from ... import checks
from ...units import STANDARD_GRAVITY
from ..supports.isolator import BILINEAR, Isolator
from ..supports.support import Support


class Storey(NamedTuple):
    """Mass, kg; initial stiffness, N/m, yield drift, m, stiffness after yielding over it, and viscosity, N s/m."""

    mass: float
    stiffness: float
    yield_drift: float
    hardening: float
    viscosity: float


@dataclass(frozen=True)
class Isolation:
    """Isolators below the slab of a building.

    Parameters
    ----------
    isolator : Isolator or Support
        `Isolator.linear` or `Isolator.bilinear`: period and strength are of the whole weight, slab and building.
    base_mass : float
        Mass of the slab above the isolators, kg, > 0.

    Raises
    ------
    TypeError, ValueError
        A pendulum, whose friction is no yielding storey; stops or a clearance; a base mass <= 0.
    """

    isolator: Isolator | Support
    base_mass: float

    def __post_init__(self) -> None:
        checks.number("base_mass", self.base_mass, above=0.0, unit="kg")
        if not isinstance(self.isolator, Isolator | Support):
            raise TypeError(
                f"isolator must be Isolator.linear(…) or Isolator.bilinear(…), got {checks.kind(self.isolator)}"
            )
        if isinstance(self.isolator, Support):
            return
        if not math.isinf(self.isolator.stops.clearance):
            raise ValueError("isolator of a building must have no clearance: what it does at its moat is not modelled")
        if self.isolator.kind != BILINEAR:
            raise ValueError(
                "isolator of a building must be linear or bilinear, got a pendulum: take a bilinear one of its period, "
                "with its friction as the strength and a small yield displacement"
            )

    @property
    def text(self) -> str:
        """Its parameters in words."""
        one, of = self.isolator, f", slab {self.base_mass:g} kg"
        if isinstance(one, Support):
            return f"linear isolators, {1.0 / one.frequency:.4g} s, damping {one.damping:g}{of}"
        drift = f"{1e3 * one.yield_displacement:g} mm"
        return f"bilinear isolators, {one.period:g} s, strength {one.strength:g}, yielding at {drift}{of}"

    def storey(self, carried: float) -> Storey:
        """Return the isolators and the slab as a storey that carries a mass, kg."""
        one, mass = self.isolator, self.base_mass + carried
        if isinstance(one, Support):
            omega = 2.0 * math.pi * one.frequency
            return Storey(self.base_mass, mass * omega * omega, math.inf, 0.0, 2.0 * one.damping * omega * mass)
        after = mass * (2.0 * math.pi / one.period) ** 2
        initial = after + one.strength * STANDARD_GRAVITY * mass / one.yield_displacement
        return Storey(self.base_mass, initial, one.yield_displacement, after / initial, 0.0)
