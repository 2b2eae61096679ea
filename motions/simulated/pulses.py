"""Pulses given by formulas, finely sampled.  A jump inside a pulse is sampled as the mean of its two sides."""

import math
from abc import abstractmethod
from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np
import xarray as xr

from ...core import checks
from ...core.elementary import Array, exp
from ...core.parameters import Parameter, check
from ..arrays import from_array
from .generator import Generator

MOST_SAMPLES = 10_000_000


@dataclass(frozen=True)
class Pulse(Generator):
    """Deterministic pulse, followed by `tail` seconds without motion.

    Parameters
    ----------
    amplitude : float
        Peak acceleration, m/s².
    omega : float
        Circular frequency, rad/s.
    dt : float
        Largest time step, s; the step used divides the pulse's length.
    tail : float
        Time without motion after the pulse, s.

    Notes
    -----
    The acceleration is linear between samples: the error of a sampled sine is at most (omega dt)²/8 of its amplitude.
    """

    own_amplitude: ClassVar[bool] = False
    cycles: ClassVar[float] = 1.0
    """Length of the pulse over its period."""

    amplitude: Annotated[float, Parameter("m/s²", above=0.0)]
    omega: Annotated[float, Parameter("rad/s", above=0.0)]
    dt: Annotated[float, Parameter("s", above=0.0)] = 0.001
    tail: Annotated[float, Parameter("s", at_least=0.0)] = 1.0

    def __post_init__(self) -> None:
        check(self)

    @property
    def duration(self) -> float:
        """Length of the pulse, s."""
        return 2.0 * math.pi * self.cycles / self.omega

    @abstractmethod
    def shape(self, time: Array) -> Array:
        """Return the pulse over its amplitude at times 0 … duration (s)."""

    def sample(self, n: int = 1, seed: int = 0, first: int = 0) -> xr.DataArray:
        """Return the pulse as one motion; it is deterministic: n must be 1, and seed and first have no effect."""
        if checks.count("n", n, at_least=1) != 1:
            raise ValueError(f"n must be 1 for {type(self).__name__}, which is the same every time, got {n}")
        samples = (self.duration + self.tail) / self.dt
        if not samples <= MOST_SAMPLES:
            raise ValueError(f"a pulse may have {MOST_SAMPLES:,} samples, got {samples:.3g}: take a longer dt")
        steps = max(2, math.ceil(self.duration / self.dt * (1.0 - 1e-12)))
        dt = self.duration / steps
        values = self.amplitude * self.shape(np.arange(steps + 1, dtype=np.float64) * dt)
        values[-1] *= 0.5  # the mean of both sides of the jump to zero (a value of zero stays zero)
        quiet = np.zeros(max(1, round(self.tail / dt)))
        label = f"{type(self).__name__} {self.amplitude:g} m/s² {self.omega:g} rad/s"
        return from_array(np.concatenate([values, quiet]), dt, [label], type(self).__name__, self.own_amplitude)


@dataclass(frozen=True)
class RectangularPulse(Pulse):
    """Constant acceleration for the time pi/omega, s (half a period, as in the half-sine)."""

    cycles: ClassVar[float] = 0.5

    def shape(self, time: Array) -> Array:
        return np.ones_like(time)


@dataclass(frozen=True)
class HalfSine(Pulse):
    """Sine pulse sin(omega t) of half a period."""

    cycles: ClassVar[float] = 0.5

    def shape(self, time: Array) -> Array:
        values = np.sin(self.omega * time)
        values[-1] = 0.0  # (rounding leaves 1e-16)
        return values


@dataclass(frozen=True)
class OneCycleSine(HalfSine):
    """Sine pulse sin(omega t) of one period (type A of Zhang and Makris 2001)."""

    cycles: ClassVar[float] = 1.0


@dataclass(frozen=True)
class OneCycleCosine(Pulse):
    """Cosine pulse cos(omega t) of one period (type B of Zhang and Makris 2001); it jumps at both ends."""

    def shape(self, time: Array) -> Array:
        return np.cos(self.omega * time)


@dataclass(frozen=True)
class Ricker(Pulse):
    """Symmetric Ricker wavelet (1 - 2 x²) exp(-x²), x = pi (t - t0)/T with T = 2 pi/omega.

    References
    ----------
    Ricker, N. (1943). Further developments in the wavelet theory of seismogram structure. Bulletin of the
    Seismological Society of America 33, 197-228.
    """

    cycles: ClassVar[float] = 4.0  # two periods on either side: exp(-4 pi²) is below rounding

    def shape(self, time: Array) -> Array:
        x = 0.5 * self.omega * (time - 0.5 * self.duration)
        return (1.0 - 2.0 * x * x) * exp(-x * x)


@dataclass(frozen=True)
class MavroeidisPapageorgiou(Pulse):
    """Near-fault velocity pulse of Mavroeidis and Papageorgiou, as acceleration; omega = 2 pi f is its own frequency.

    Parameters
    ----------
    amplitude, omega, dt, tail
        As of `Pulse`.
    gamma : float
        Number of half cycles under the envelope: its length is gamma/f.
    nu : float
        Phase of the oscillation, rad.
    zero_residual : bool
        True removes the permanent displacement that the original pulse leaves (Dabaghi and Der Kiureghian 2017).

    Notes
    -----
    For |t - t0| <= gamma/(2 f) the velocity is v = (A/2) [1 + cos(2 pi f (t - t0)/gamma)] cos(2 pi f (t - t0) + nu).
    Without residual it is v = [(A/2) cos(2 pi f (t - t0) + nu) - D f/gamma] [1 + cos(2 pi f (t - t0)/gamma)]. There D
    is the displacement that the first form leaves. The peak acceleration is `amplitude`; use `of_velocity` to give A
    instead.

    References
    ----------
    Mavroeidis, G. P. and Papageorgiou, A. S. (2003). A mathematical representation of near-fault ground motions.
    Bulletin of the Seismological Society of America 93, 1099-1131.
    Dabaghi, M. and Der Kiureghian, A. (2017). Stochastic model for simulation of near-fault ground motions.
    Earthquake Engineering and Structural Dynamics 46, 963-984.

    Examples
    --------
    >>> from toppling.motions import measures
    >>> pulse = MavroeidisPapageorgiou.of_velocity(velocity=0.8, period=2.0, gamma=2.0)
    >>> round(float(measures(pulse.sample()).pgv[0]), 3)
    0.8
    """

    gamma: Annotated[float, Parameter(at_least=1.0, at_most=10.0)] = 2.0
    nu: Annotated[float, Parameter("rad", at_least=-100.0, at_most=100.0)] = 0.0
    zero_residual: Annotated[bool, Parameter()] = False

    @classmethod
    def of_velocity(
        cls,
        velocity: float,
        period: float,
        gamma: float = gamma,
        nu: float = nu,
        zero_residual: bool = zero_residual,
        dt: float = Pulse.dt,
        tail: float = Pulse.tail,
    ) -> "MavroeidisPapageorgiou":
        """Return the pulse with a given velocity amplitude A, m/s, > 0, and period 1/f, s, > 0."""
        checks.number("velocity", velocity, above=0.0, unit="m/s")
        omega = 2.0 * math.pi / checks.number("period", period, above=0.0, unit="s")
        peak = cls(1.0, omega, dt, tail, gamma, nu, zero_residual)._peak()
        return cls(velocity * peak, omega, dt, tail, gamma, nu, zero_residual)

    @property
    def duration(self) -> float:
        return 2.0 * math.pi * self.gamma / self.omega

    def shape(self, time: Array) -> Array:
        return self._unit(time) / self._peak()

    def _unit(self, time: Array) -> Array:
        """Return the acceleration of the pulse with A = 1, 1/s."""
        time = time - 0.5 * self.duration
        slow = self.omega / self.gamma
        drift = _drift(self.gamma, self.nu) if self.zero_residual else 0.0
        carrier = 0.5 * np.cos(self.omega * time + self.nu) - drift
        slope = -0.5 * self.omega * np.sin(self.omega * time + self.nu)
        values = slope * (1.0 + np.cos(slow * time)) - carrier * slow * np.sin(slow * time)
        return np.where(np.abs(time) <= math.pi / slow, values, 0.0)

    def _peak(self) -> float:
        return float(np.abs(self._unit(np.linspace(0.0, self.duration, PEAK_POINTS))).max())


PEAK_POINTS = 20_001  # gives the peak of a cosine to 1e-6 at ten half cycles


def velocity_pulse(time: Array, omega: float, gamma: float, nu: float, zero_residual: bool) -> Array:
    """Return the velocity of the Mavroeidis-Papageorgiou pulse, A = 1, at times (s) from its middle; zero outside."""
    slow = omega / gamma
    carrier = 0.5 * np.cos(omega * time + nu)
    if zero_residual:
        carrier = carrier - _drift(gamma, nu)
    return np.where(np.abs(time) <= math.pi / slow, carrier * (1.0 + np.cos(slow * time)), 0.0)


def _drift(gamma: float, nu: float) -> float:
    """Return D f/gamma for A = 1; D = cos nu sin(pi gamma)/[2 pi f (1 - gamma²)] is regular at gamma = 1."""
    return math.cos(nu) * float(np.sinc(1.0 - gamma)) / (2.0 * gamma * (1.0 + gamma))


PULSES: dict[str, type[Pulse]] = {
    "rectangular": RectangularPulse,
    "half-sine": HalfSine,
    "one-cycle-sine": OneCycleSine,
    "one-cycle-cosine": OneCycleCosine,
    "ricker": Ricker,
    "mavroeidis-papageorgiou": MavroeidisPapageorgiou,
}
"""The pulses by the names that study files use."""
