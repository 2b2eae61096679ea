"""The textbook pulses, sampled finely.  A jump inside a pulse is sampled as the mean of its two sides."""

from __future__ import annotations

import math
from abc import abstractmethod
from dataclasses import dataclass

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from .. import checks
from .arrays import from_array
from .filters import Generator

Values = NDArray[np.float64]


@dataclass(frozen=True)
class Pulse(Generator):
    """A deterministic pulse, followed by `tail` seconds of quiet.

    Parameters
    ----------
    amplitude : float
        Peak acceleration, m/s², > 0.
    omega : float
        Circular frequency, rad/s, > 0.
    dt : float
        Largest time step, s; the step used divides the pulse's length.
    tail : float
        Quiet after the pulse, s, >= 0.

    Notes
    -----
    The acceleration is linear between samples: a sine sampled at dt errs by (omega dt)²/8 of its amplitude at most.
    """

    amplitude: float
    omega: float
    dt: float = 0.001
    tail: float = 1.0

    def __post_init__(self) -> None:
        for name in ("amplitude", "omega", "dt"):
            checks.number(name, getattr(self, name), above=0.0)
        checks.number("tail", self.tail, at_least=0.0)

    @property
    @abstractmethod
    def duration(self) -> float:
        """Length of the pulse, s."""

    @abstractmethod
    def shape(self, time: Values) -> Values:
        """The pulse over its amplitude at times 0 … duration (s)."""

    def sample(self, n: int = 1, seed: int = 0, first: int = 0) -> xr.DataArray:
        """The pulse as one motion; it is deterministic, so n must be 1 and seed and first change nothing."""
        if checks.count("n", n, at_least=1) != 1:
            raise ValueError(f"n must be 1 for {type(self).__name__}, which is the same every time, got {n}")
        steps = max(2, math.ceil(self.duration / self.dt * (1.0 - 1e-12)))
        dt = self.duration / steps
        values = self.amplitude * self.shape(np.arange(steps + 1, dtype=np.float64) * dt)
        values[-1] *= 0.5  # nothing follows: the mean of both sides of the jump (zero stays zero)
        quiet = np.zeros(max(1, round(self.tail / dt)))
        label = f"{type(self).__name__} {self.amplitude:g} m/s² {self.omega:g} rad/s"
        return from_array(np.concatenate([values, quiet]), dt, [label], source=type(self).__name__)


@dataclass(frozen=True)
class RectangularPulse(Pulse):
    """Constant acceleration for a time pi/omega, s (half a period, as the half-sine)."""

    @classmethod
    def of_duration(cls, amplitude: float, duration: float, dt: float = 0.001, tail: float = 1.0) -> RectangularPulse:
        """The pulse of a given length, s, > 0."""
        return cls(amplitude, math.pi / checks.number("duration", duration, above=0.0, unit="s"), dt, tail)

    @property
    def duration(self) -> float:
        return math.pi / self.omega

    def shape(self, time: Values) -> Values:
        return np.ones_like(time)


@dataclass(frozen=True)
class HalfSine(Pulse):
    """sin(omega t) for half a period."""

    @property
    def duration(self) -> float:
        return math.pi / self.omega

    def shape(self, time: Values) -> Values:
        return _exact_end(np.sin(self.omega * time))


@dataclass(frozen=True)
class OneCycleSine(Pulse):
    """sin(omega t) for one period (type A of Zhang and Makris 2001)."""

    @property
    def duration(self) -> float:
        return 2.0 * math.pi / self.omega

    def shape(self, time: Values) -> Values:
        return _exact_end(np.sin(self.omega * time))


@dataclass(frozen=True)
class OneCycleCosine(Pulse):
    """cos(omega t) for one period (type B of Zhang and Makris 2001); it jumps at both ends."""

    @property
    def duration(self) -> float:
        return 2.0 * math.pi / self.omega

    def shape(self, time: Values) -> Values:
        return np.cos(self.omega * time)


@dataclass(frozen=True)
class Ricker(Pulse):
    """Symmetric Ricker wavelet (1 - 2 x²) exp(-x²), x = pi (t - t0)/T with T = 2 pi/omega.

    References
    ----------
    Ricker, N. (1943). Further developments in the wavelet theory of seismogram structure. Bulletin of the
    Seismological Society of America 33, 197-228.
    """

    @property
    def duration(self) -> float:
        return 8.0 * math.pi / self.omega  # two periods either side: exp(-4 pi²) is below rounding

    def shape(self, time: Values) -> Values:
        x = 0.5 * self.omega * (time - 0.5 * self.duration)
        return (1.0 - 2.0 * x * x) * np.exp(-x * x)


def _exact_end(values: Values) -> Values:
    """The sine's last zero, which rounding leaves at 1e-16."""
    values[-1] = 0.0
    return values


PULSES: dict[str, type[Pulse]] = {
    "rectangular": RectangularPulse,
    "half-sine": HalfSine,
    "one-cycle-sine": OneCycleSine,
    "one-cycle-cosine": OneCycleCosine,
    "ricker": Ricker,
}
"""Every pulse by the name that study files use."""
