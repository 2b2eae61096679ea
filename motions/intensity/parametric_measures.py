"""Intensity measures with parameters: objects such as ``Sa(1.0)``, whose label is the same text.

A measure is written alike in study files and in Python, so that `dataset.measure_named` can read its label.
"""

import math
from collections.abc import Sequence
from dataclasses import MISSING, dataclass, fields
from typing import Any, ClassVar

import numpy as np
import scipy

from ...core import checks
from ...core.elementary import Array, exp, log
from ...core.units import ACCELERATION, DAMPING, METRE, VELOCITY
from ..kernels import oscillators as engine
from .measure import Measure
from .peaks import velocity
from .spectra import damping_of, peak_displacements, period_of

MOST_PERIODS = 10_000
NO_RIPPLE = 1e-6  # of the largest: a window longer than a pulse gives a plateau, whose ripples are rounding errors


def number(text: str) -> float:
    """Return the number in a text; ValueError if there is none."""
    try:
        return float(text)
    except ValueError:
        raise ValueError(f"{text.strip()!r} is no number") from None


@dataclass(frozen=True)
class ParametricMeasure(Measure):
    """Measure whose label is its class and its parameters, without trailing parameters that have their default."""

    @property
    def label(self) -> str:
        values = [(getattr(self, field.name), field.default) for field in fields(self)]
        while len(values) > 1 and values[-1][1] is not MISSING and values[-1][0] == values[-1][1]:
            values.pop()
        return f"{type(self).__name__}({', '.join(self._written(value) for value, _ in values)})"

    @staticmethod
    def _written(value: Any) -> str:
        return repr(value)

    @classmethod
    def read(cls, arguments: Sequence[str]) -> Measure:
        """Return the measure from its written parameters; ValueError if one is no number or there are too many."""
        return cls(*(number(text) for text in arguments))


@dataclass(frozen=True)
class _Spectral(ParametricMeasure):
    """Value of a response spectrum at one period: the displacement times omega to some power."""

    _quantity: ClassVar[str]
    _order: ClassVar[int]

    period: float
    damping: float = DAMPING

    def __post_init__(self) -> None:
        object.__setattr__(self, "period", period_of("period", self.period))
        object.__setattr__(self, "damping", damping_of(self.damping))

    @property
    def long_name(self) -> str:
        return f"spectral {self._quantity} at {self.period:g} s, {100.0 * self.damping:g} % damping"

    def of(self, acceleration: Array, dt: float) -> float:
        displacement = float(peak_displacements(acceleration, dt, np.array([self.period]), self.damping)[0])
        return (2.0 * math.pi / self.period) ** self._order * displacement


@dataclass(frozen=True)
class Sa(_Spectral):
    """Spectral (pseudo-)acceleration: omega² times the maximum relative displacement of an oscillator, m/s².

    Parameters
    ----------
    period : float
        Period of the oscillator, s, 1e-3 to 1e3.
    damping : float
        Damping ratio of the oscillator, 0 to below 1.

    Notes
    -----
    The response is exact for acceleration linear between samples, and so is its maximum (`response_spectrum`).

    Examples
    --------
    >>> Sa(1.0).label, Sa(1.0, damping=0.02).label
    ('Sa(1.0)', 'Sa(1.0, 0.02)')
    """

    units = ACCELERATION
    _quantity, _order = "acceleration", 2


@dataclass(frozen=True)
class Sv(_Spectral):
    """Spectral (pseudo-)velocity: omega times the maximum relative displacement of an oscillator, m/s; as `Sa`."""

    units = VELOCITY
    _quantity, _order = "velocity", 1


@dataclass(frozen=True)
class Sd(_Spectral):
    """Spectral displacement: the maximum relative displacement of an oscillator, m; as `Sa`."""

    units = METRE
    _quantity, _order = "displacement", 0


@dataclass(frozen=True)
class AvgSa(ParametricMeasure):
    """Average spectral acceleration: the geometric mean of Sa at several periods, m/s².

    Parameters
    ----------
    periods : sequence of float
        The periods, s; `AvgSa.between` spaces them evenly.
    damping : float
        Damping ratio, 0 to below 1.

    References
    ----------
    Eads, L., Miranda, E. and Lignos, D. G. (2015). Average spectral acceleration as an intensity measure for collapse
    risk assessment. Earthquake Engineering & Structural Dynamics 44(12), 2057-2073.

    Examples
    --------
    >>> AvgSa([0.5, 1.0, 2.0]).label
    'AvgSa(0.5 1.0 2.0)'
    >>> AvgSa.between(0.2, 2.0, 10).label
    'AvgSa(0.2:2.0:10)'
    """

    periods: Sequence[float]
    damping: float = DAMPING

    def __post_init__(self) -> None:
        given: Any = self.periods
        if isinstance(given, str | bytes) or not checks.is_several(given):
            raise TypeError(f"periods must be a sequence of periods (s), got {checks.kind(given)}")
        periods = tuple(period_of("periods", period) for period in given)
        if not 1 <= len(periods) <= MOST_PERIODS:
            raise ValueError(f"periods must be 1 to {MOST_PERIODS}, got {len(periods)}")
        object.__setattr__(self, "periods", periods)
        object.__setattr__(self, "damping", damping_of(self.damping))

    @classmethod
    def between(cls, first: float, last: float, number: int = 10, damping: float = DAMPING) -> "AvgSa":
        """Return the average over `number` (>= 2) evenly spaced periods from first to last, s."""
        count = checks.count("number", number, at_least=2)
        if count > MOST_PERIODS:
            raise ValueError(f"number must be at most {MOST_PERIODS}, got {count}")
        ends = period_of("first", first), period_of("last", last)
        if not ends[0] < ends[1]:
            raise ValueError(f"last must be above first, {first:g} s, got {last:g} s: is it a step?")
        return cls(tuple(np.linspace(*ends, count).tolist()), damping)

    @staticmethod
    def _written(value: Any) -> str:
        if not isinstance(value, tuple):
            return repr(value)
        if len(value) > 2 and value == tuple(np.linspace(value[0], value[-1], len(value)).tolist()):
            return f"{value[0]!r}:{value[-1]!r}:{len(value)}"
        return " ".join(repr(part) for part in value)

    @classmethod
    def read(cls, arguments: Sequence[str]) -> Measure:
        rest = [number(text) for text in arguments[1:]]
        ranged = arguments[0].split(":")
        if len(ranged) == 3 and ranged[2].strip().isdigit():
            return cls.between(number(ranged[0]), number(ranged[1]), int(ranged[2]), *rest)
        return cls(tuple(number(text) for text in arguments[0].split()), *rest)

    @property
    def units(self) -> str:
        return ACCELERATION

    @property
    def long_name(self) -> str:
        span = f"{len(self.periods)} periods from {min(self.periods):g} to {max(self.periods):g} s"
        return f"average spectral acceleration over {span}, {100.0 * self.damping:g} % damping"

    def of(self, acceleration: Array, dt: float) -> float:
        periods = np.array(self.periods)
        spectrum = peak_displacements(acceleration, dt, periods, self.damping) * (2.0 * math.pi / periods) ** 2
        return float(exp(log(spectrum).mean()))


@dataclass(frozen=True)
class FIV3(ParametricMeasure):
    """Filtered incremental velocity: the three strongest low-pass filtered acceleration pulses in one direction, m/s.

    Parameters
    ----------
    period : float
        Period T of the structure, s, 1e-3 to 1e3.
    alpha : float
        Length of a window over T, above 0 (default 0.7).
    beta : float
        Corner frequency of the filter times T, above 0 (default 0.85).  Davalos et al. (2020) take 1 Hz:
        ``beta=period``.

    Notes
    -----
    Vs(t) is the integral of the filtered acceleration from t to t + alpha T. FIV3 is the larger of the sum of its three
    largest maxima and the absolute sum of its three smallest minima. Extremes are at the samples, including the two
    ends of the record, where Vs is positive (negative). Ripples below 1e-6 of the maximum |Vs| are not counted. The
    second-order Butterworth low-pass is an oscillator with a damping ratio of 1/sqrt(2), run once forward. It is exact
    for acceleration that is linear between samples, as is Vs. The defaults of alpha and beta are from public codes.

    References
    ----------
    Davalos, H. and Miranda, E. (2019). Filtered incremental velocity: a novel approach in intensity measures for
    seismic collapse estimation. Earthquake Engineering & Structural Dynamics 48(12), 1384-1405.
    Davalos, H., Heresi, P. and Miranda, E. (2020). A ground motion prediction equation for filtered incremental
    velocity, FIV3. Soil Dynamics and Earthquake Engineering 139, 106346.

    Examples
    --------
    >>> FIV3(1.0).label
    'FIV3(1.0)'
    """

    period: float
    alpha: float = 0.7
    beta: float = 0.85

    def __post_init__(self) -> None:
        object.__setattr__(self, "period", period_of("period", self.period))
        for name in ("alpha", "beta"):
            object.__setattr__(self, name, checks.number(name, getattr(self, name), at_least=1e-3, at_most=1e3))

    @property
    def units(self) -> str:
        return VELOCITY

    @property
    def long_name(self) -> str:
        text = f"filtered incremental velocity FIV3 at {self.period:g} s"
        if (self.alpha, self.beta) == (0.7, 0.85):
            return text
        return f"{text} (alpha {self.alpha:g}, beta {self.beta:g})"

    def of(self, acceleration: Array, dt: float) -> float:
        window = self.alpha * self.period
        duration = (acceleration.size - 1) * dt
        if window > duration:
            raise ValueError(f"{self.label} needs a motion of at least alpha T = {window:g} s, got one of {duration:g}")
        increments = self._increments(acceleration, dt, window)
        return max(_three_strongest(increments), _three_strongest(-increments))

    def _increments(self, acceleration: Array, dt: float, window: float) -> Array:
        """Return Vs, m/s, at the samples that are followed by a whole window."""
        omega = 2.0 * math.pi * self.beta / self.period
        zeta = math.sqrt(0.5)
        response = np.empty((2, acceleration.size))
        engine.oscillator_history(acceleration, dt, omega, zeta, response)
        u, v = response
        filtered = -omega * omega * u
        # integrated equation of motion: omega² times the integral of u is -(v + 2 zeta omega u) - v_g
        passed = velocity(acceleration, dt) + v + 2.0 * zeta * omega * u
        steps = math.floor(window / dt * (1.0 + 1e-12))
        part = max(window / dt - steps, 0.0)
        n = acceleration.size - steps - (1 if part > 0.0 else 0)
        if n < 1:
            steps, part, n = acceleration.size - 1, 0.0, 1
        end = passed[steps : steps + n]
        if part > 0.0:
            # cubic Hermite from values and slopes at the two samples about the window's end
            after = passed[steps + 1 : steps + 1 + n]
            slope, slope_after = dt * filtered[steps : steps + n], dt * filtered[steps + 1 : steps + 1 + n]
            rise = after - end
            bent = part * (1.0 - part) * ((1.0 - part) * (slope - rise) - part * (slope_after - rise))
            end = end + part * rise + bent
        return np.asarray(end - passed[:n])


def _three_strongest(values: Array) -> float:
    """Return the sum of the three largest positive maxima of the samples, including the ends."""
    least, largest = float(values.min()), float(np.abs(values).max())
    if largest == 0.0:
        return 0.0
    # lower values beyond the ends make the ends count as maxima
    padded = np.concatenate([[least - largest], values, [least - largest]])
    tops, _ = scipy.signal.find_peaks(padded, height=0.0, prominence=NO_RIPPLE * largest)
    return float(np.sort(padded[tops])[-3:].sum())


PARAMETRIC_MEASURES: dict[str, type[ParametricMeasure]] = {kind.__name__: kind for kind in (Sa, Sv, Sd, AvgSa, FIV3)}
"""The measures with parameters, by the name with which a label starts."""
