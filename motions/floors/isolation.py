"""Isolation storeys: the isolators below a building, as the lowest storey of a chain."""

import math
from dataclasses import dataclass
from typing import Annotated, NamedTuple

import numpy as np

from ...core import checks
from ...core.aliases import Array
from ...core.parameters import Parameter, check
from ...core.units import STANDARD_GRAVITY
from ..supports.isolator import BILINEAR, Isolator
from ..supports.support import Support

BaseMass = Annotated[float, Parameter("kg", above=0.0)]
FASTEST = 5e4
"""Maximum rate, 1/s, at which a floor may follow its storeys; at ten times as much each motion takes ten seconds."""


class Storey(NamedTuple):
    """Mass, kg; initial stiffness, N/m, yield drift, m, stiffness after yielding over it, and viscosity, N s/m."""

    mass: float
    stiffness: float
    yield_drift: float
    hardening: float
    viscosity: float


def refuse_light(mass: Array, stiffness: Array, viscosity: Array) -> None:
    """Raise ValueError for a slab or a floor that is so light that steps which follow it would take minutes.

    Masses, kg, stiffnesses, N/m, and viscosities, N s/m, of isolators and storeys from below, (storey,). Between fixed
    floors, a floor moves at the rate c/m of the adjacent dampers or the frequency sqrt(k/m) of the springs.
    """
    springs, dampers = (values + np.append(values[1:], 0.0) for values in (stiffness, viscosity))
    least = np.maximum(dampers / FASTEST, springs / FASTEST**2)
    light = np.flatnonzero(mass < least)
    if light.size:
        i = int(light[0])
        name, where = ("base_mass", "the slab") if i == 0 else ("masses", f"floor {i}")
        raise ValueError(
            f"{name} must be at least {least[i]:.3g} kg for {where} between these stiffnesses and dampings, got "
            f"{mass[i]:g} kg: what is lighter follows them within {1e3 / FASTEST:g} ms, and runs would take minutes"
        )


@dataclass(frozen=True)
class Isolation:
    """Linear or bilinear isolators of the whole weight, and the slab above them with its `base_mass` (kg, > 0)."""

    isolator: Isolator | Support
    base_mass: BaseMass

    def __post_init__(self) -> None:
        check(self)
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
        isolator, of = self.isolator, f", slab {self.base_mass:g} kg"
        if isinstance(isolator, Support):
            return f"linear isolators, {1.0 / isolator.frequency:.4g} s, damping {isolator.damping:g}{of}"
        drift = f"{1e3 * isolator.yield_displacement:g} mm"
        return f"bilinear isolators, {isolator.period:g} s, strength {isolator.strength:g}, yielding at {drift}{of}"

    def storey(self, carried: float) -> Storey:
        """Return the isolators and the slab as a storey that carries a mass, kg."""
        isolator, mass = self.isolator, self.base_mass + carried
        if isinstance(isolator, Support):
            omega = 2.0 * math.pi * isolator.frequency
            return Storey(self.base_mass, mass * omega * omega, math.inf, 0.0, 2.0 * isolator.damping * omega * mass)
        after = mass * (2.0 * math.pi / isolator.period) ** 2
        initial = after + isolator.strength * STANDARD_GRAVITY * mass / isolator.yield_displacement
        return Storey(self.base_mass, initial, isolator.yield_displacement, after / initial, 0.0)
