"""Intensity envelopes of simulated motions: functions of time with a maximum of about 1."""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from ...core import checks
from ...core.elementary import Array, exp
from ...core.parameters import Parameter, check


class Envelope(ABC):
    """Intensity envelope; call it with times (n,) in s from 0."""

    @abstractmethod
    def __call__(self, time: Array) -> Array:
        """Return the intensity at `time` (s), dimensionless, in the same shape."""


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

    Parameters
    ----------
    rise : float
        End of the quadratic rise, s.
    strong_end : float
        End of the strong phase, s, at or after the end of the rise.
    decay : float
        Rate of decay, 1/s.

    References
    ----------
    Jennings, P. C., Housner, G. W. and Tsai, N. C. (1968). Simulated earthquake motions. Caltech.  The defaults are
    the values of Yim, C.-S., Chopra, A. K. and Penzien, J. (1980). Rocking response of rigid blocks to earthquakes.
    Earthquake Engineering and Structural Dynamics 8, 565-587 (their motions last 30 s).
    """

    rise: Annotated[float, Parameter("s", above=0.0)] = 4.0
    strong_end: Annotated[float, Parameter("s", above=0.0)] = 15.0
    decay: Annotated[float, Parameter("1/s", above=0.0)] = 0.0992

    def __post_init__(self) -> None:
        check(self)
        checks.number("strong_end", self.strong_end, at_least=self.rise, unit="s")

    def __call__(self, time: Array) -> Array:
        growth = (np.minimum(time, self.rise) / self.rise) ** 2
        # (0 where it underflows, however late it is)
        late = np.minimum(np.maximum(time - self.strong_end, 0.0), GONE / self.decay)
        return growth * exp(-self.decay * late)


ENVELOPES: dict[str, type[Envelope]] = {"stationary": Stationary, "rise-strong-decay": RiseStrongDecay}
"""The envelopes by the names that study files use."""
