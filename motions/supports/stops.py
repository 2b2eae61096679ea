"""Compliant stops of an isolated platform: springs and dampers beyond its clearance, which push and never pull."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
import xarray as xr

from ...core import checks
from ...core.doubts import Doubt
from ...core.parameters import Parameter
from ...core.wording import counted, short_digits

RESTITUTION = 0.6
"""Share of its velocity with which a platform leaves a stop (assumed)."""
DECLARED = {
    # (no stop is softer than the slowest isolator)
    "frequency": Parameter("Hz", at_least=0.01),
    # (a stop that still swings: critical damping leaves exp(-2) = 0.135)
    "restitution": Parameter(at_least=0.15, at_most=1.0),
}
Frequency = Annotated[float, DECLARED["frequency"]]
Restitution = Annotated[float, DECLARED["restitution"]]
Clearance = Annotated[float, Parameter("m", above=0.0, written="mm")]
SAMPLES = 20
"""Minimum number of samples of the motion on top while the platform is in contact with a stop."""
HALVINGS = 52
FINEST = 1e-4
"""Minimum time between samples of a motion on top, s."""


@dataclass(frozen=True)
class Stops:
    """Stops on both sides of a platform, at a clearance (m, infinite for none), with a restitution of 0.15 to 1.

    `frequency` is the natural frequency of the platform with its load on a stop, sqrt(k_s/m)/(2 pi), Hz, >= 0.01;
    strikes are not modelled if it is not given. Beyond the clearance a stop pushes back with k_s times depth + c_s
    times its rate (Kelvin-Voigt), and never pulls. Let c_s = 2 zeta sqrt(k_s m) and s = sqrt(1 - zeta²). A platform
    without other forces keeps the share exp(-2 zeta arccos(zeta)/s) of its velocity, after a contact of 2
    arccos(zeta)/(omega_s s). (Derived: the stop lets go at zero acceleration.) Undamped, with the velocity v: depth
    v/omega_s, duration pi/omega_s, acceleration v omega_s.
    """

    clearance: float = math.inf
    frequency: Frequency | None = None
    restitution: Restitution = RESTITUTION

    def __post_init__(self) -> None:
        if not (isinstance(self.clearance, float) and self.clearance == math.inf):
            checks.number("clearance", self.clearance, above=0.0, unit="m")
        for name in ("frequency", "restitution"):
            if getattr(self, name) is not None:
                DECLARED[name].check(f"stop_{name}", getattr(self, name))
        if self.frequency is None:
            if self.restitution != RESTITUTION:
                raise ValueError("stop_restitution needs a stop_frequency: strikes are not modelled without one")
            return
        if math.isinf(self.clearance):
            raise ValueError("stop_frequency needs a clearance, the displacement at which the platform strikes a stop")
        if self.contact < SAMPLES * FINEST:
            raise ValueError(
                f"stop_frequency must give a contact of at least {1e3 * SAMPLES * FINEST:g} ms, {SAMPLES} samples of "
                f"{1e3 * FINEST:g} ms, got {1e3 * self.contact:.3g} ms at {self.frequency:g} Hz"
            )

    @property
    def modelled(self) -> bool:
        """True if the strikes of the platform on its stops are modelled."""
        return self.frequency is not None

    @property
    def damping(self) -> float:
        """Damping ratio of the platform on a stop, of the restitution."""
        if self.restitution == 1.0:
            return 0.0
        low, high = 0.0, 1.0
        for _ in range(HALVINGS):
            zeta = 0.5 * (low + high)
            kept = math.exp(-2.0 * zeta * math.acos(zeta) / math.sqrt(1.0 - zeta * zeta))
            low, high = (zeta, high) if kept > self.restitution else (low, zeta)
        return 0.5 * (low + high)

    @property
    def contact(self) -> float:
        """Duration of a contact with a stop if nothing else acts on the platform, s."""
        assert self.frequency is not None
        zeta = self.damping
        return math.acos(zeta) / (math.pi * self.frequency * math.sqrt(1.0 - zeta * zeta))

    @property
    def over_mass(self) -> tuple[float, float, float]:
        """Clearance, m, stiffness, 1/s², and viscosity, 1/s, of the stops over the mass that strikes them."""
        assert self.frequency is not None
        omega = 2.0 * math.pi * self.frequency
        return self.clearance, omega * omega, 2.0 * self.damping * omega

    def parts(self, dt: float) -> int:
        """Return the samples a step dt, s, of which a contact has enough."""
        return max(1, math.ceil(dt * SAMPLES / self.contact - 1e-9)) if self.modelled else 1

    def doubts(self, motions: Sequence[xr.DataArray]) -> list[Doubt]:
        """Return the input warning on motions on top of a platform (``support_displacement``) that hits its stops."""
        ways = np.concatenate([array["support_displacement"].values.ravel() for array in motions])
        far = int((ways > self.clearance).sum())
        if not far:
            return []
        where = {"clearance": self.clearance, "far": far, "total": ways.size}
        if not self.modelled:
            return [Doubt.of("stops_missing", most=ways.max(), **where)]
        strikes = counted(int(sum(int(array["strikes"].sum()) for array in motions)), "strike")
        hardest = short_digits(max(float(array["strike_acceleration"].max()) for array in motions))
        contact = short_digits(1e3 * self.contact)
        given = {"strikes": strikes, "hardest": hardest, "frequency": self.frequency, "contact": contact}
        return [Doubt.of("stops", **where, **given)]
