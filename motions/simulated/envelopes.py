"""Intensity envelopes of simulated motions: functions of time with a maximum of about 1."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...core import checks
from ...core.aliases import Array


class Envelope(ABC):
    """Intensity envelope; call it with times (n,) in s from 0."""

    @abstractmethod
    def __call__(self, time: Array) -> Array:
        """Return the intensity at `time` (s), dimensionless, in the same shape."""


def _check_positive(envelope: Any, *names: str) -> None:
    for name in names:
        checks.number(name, getattr(envelope, name), above=0.0)


GONE = 1000.0
"""Exponent x for which exp(-x) is 0 in double precision."""


@dataclass(frozen=True)
class Stationary(Envelope):
    """Constant intensity 1."""

    def __call__(self, time: Array) -> Array:
        return np.ones_like(time)


@dataclass(frozen=True)
class RiseStrongDecay(Envelope):
    """Envelope (t/rise)² to `rise` s, 1 to `strong_end` s, exp[-decay (t - strong_end)] afterwards.

    References
    ----------
    Jennings, P. C., Housner, G. W. and Tsai, N. C. (1968). Simulated earthquake motions. Caltech.  The defaults are
    the values of Yim, C.-S., Chopra, A. K. and Penzien, J. (1980). Rocking response of rigid blocks to earthquakes.
    Earthquake Engineering and Structural Dynamics 8, 565-587 (their motions last 30 s).
    """

    rise: float = 4.0
    strong_end: float = 15.0
    decay: float = 0.0992

    def __post_init__(self) -> None:
        _check_positive(self, "rise", "decay")
        checks.number("strong_end", self.strong_end, at_least=self.rise, unit="s")

    def __call__(self, time: Array) -> Array:
        growth = (np.minimum(time, self.rise) / self.rise) ** 2
        return growth * _fading(self.decay, np.maximum(time - self.strong_end, 0.0))


@dataclass(frozen=True)
class Gamma(Envelope):
    """Envelope t^(shape-1) exp(-rate t) over its maximum; shape > 1, rate > 0 1/s.

    The form is that of Saragoni and Hart (1974), recalled.
    """

    shape: float = 3.0
    rate: float = 0.4

    def __post_init__(self) -> None:
        checks.number("shape", self.shape, above=1.0)
        _check_positive(self, "rate")

    def __call__(self, time: Array) -> Array:
        peak = (self.shape - 1.0) / self.rate
        x = np.minimum(time, GONE * peak) / peak
        return (x * np.exp(1.0 - x)) ** (self.shape - 1.0)


@dataclass(frozen=True)
class DoubleExponential(Envelope):
    """Envelope exp(-slow t) - exp(-fast t) over its maximum; 0 < slow < fast, 1/s.

    The form is that of Shinozuka and Sato (1967), recalled.
    """

    slow: float = 0.15
    fast: float = 0.6

    def __post_init__(self) -> None:
        _check_positive(self, "slow")
        checks.number("fast", self.fast, above=self.slow, unit="1/s")

    def __call__(self, time: Array) -> Array:
        peak = (math.log(self.fast) - math.log(self.slow)) / (self.fast - self.slow)
        top = math.exp(-self.slow * peak) - math.exp(-self.fast * peak)
        return (_fading(self.slow, time) - _fading(self.fast, time)) / top


def _fading(rate: float, time: Array) -> Array:
    """Return exp(-rate t), and 0 where it underflows, however large rate t is."""
    return np.asarray(np.exp(-rate * np.minimum(time, GONE / rate)))


ENVELOPES: dict[str, type[Envelope]] = {
    "stationary": Stationary,
    "rise-strong-decay": RiseStrongDecay,
    "gamma": Gamma,
    "double-exponential": DoubleExponential,
}
"""The envelopes by the names that study files use."""
