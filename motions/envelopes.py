"""Intensity envelopes: how the strength of a simulated motion grows and decays.  Functions of time, at most about 1."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .. import checks


class Envelope(ABC):
    """An intensity envelope; call it with times (n,) in s from 0."""

    @abstractmethod
    def __call__(self, time: NDArray[np.float64]) -> NDArray[np.float64]:
        """Intensity at `time` (s), dimensionless, same shape."""


def _check_positive(envelope: Any, *names: str) -> None:
    for name in names:
        checks.number(name, getattr(envelope, name), above=0.0)


GONE = 1000.0
"""exp(-1000) is 0 in double precision."""


@dataclass(frozen=True)
class Stationary(Envelope):
    """Constant intensity 1."""

    def __call__(self, time: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.ones_like(time)


@dataclass(frozen=True)
class RiseStrongDecay(Envelope):
    """(t/rise)² to `rise` s, 1 to `strong_end` s, exp[-decay (t - strong_end)] after.

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

    def __call__(self, time: NDArray[np.float64]) -> NDArray[np.float64]:
        growth = (np.minimum(time, self.rise) / self.rise) ** 2
        return growth * _fading(self.decay, np.maximum(time - self.strong_end, 0.0))


@dataclass(frozen=True)
class Gamma(Envelope):
    """t^(shape-1) exp(-rate t) over its maximum (Saragoni and Hart 1974, recalled); shape > 1, rate > 0 1/s."""

    shape: float = 3.0
    rate: float = 0.4

    def __post_init__(self) -> None:
        checks.number("shape", self.shape, above=1.0)
        _check_positive(self, "rate")

    def __call__(self, time: NDArray[np.float64]) -> NDArray[np.float64]:
        peak = (self.shape - 1.0) / self.rate
        x = np.minimum(time, GONE * peak) / peak
        return (x * np.exp(1.0 - x)) ** (self.shape - 1.0)


@dataclass(frozen=True)
class DoubleExponential(Envelope):
    """exp(-slow t) - exp(-fast t) over its maximum (Shinozuka and Sato 1967, recalled); 0 < slow < fast, 1/s."""

    slow: float = 0.15
    fast: float = 0.6

    def __post_init__(self) -> None:
        _check_positive(self, "slow")
        checks.number("fast", self.fast, above=self.slow, unit="1/s")

    def __call__(self, time: NDArray[np.float64]) -> NDArray[np.float64]:
        peak = (math.log(self.fast) - math.log(self.slow)) / (self.fast - self.slow)
        top = math.exp(-self.slow * peak) - math.exp(-self.fast * peak)
        return (_fading(self.slow, time) - _fading(self.fast, time)) / top


def _fading(rate: float, time: NDArray[np.float64]) -> NDArray[np.float64]:
    """exp(-rate t), 0 from where it is too small for a number, however large the product would be."""
    return np.asarray(np.exp(-rate * np.minimum(time, GONE / rate)))


ENVELOPES: dict[str, type[Envelope]] = {
    "stationary": Stationary,
    "rise-strong-decay": RiseStrongDecay,
    "gamma": Gamma,
    "double-exponential": DoubleExponential,
}
"""Every envelope by the name that study files use."""
