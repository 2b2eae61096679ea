"""Probability distributions as frozen dataclasses: values from probabilities, and probabilities from values.

Bounds truncate a distribution; values are never clipped to them.
"""

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from . import checks
from .elementary import Array, exp, expm1, log, log1p
from .parameters import POSITIVE

BISECTIONS = 64
"""Halvings of an interval after which its ends are neighbouring floats."""
FARTHEST = 1e100
"""Standard deviations from its middle at which the tail of a normal law is still a number in its logarithm."""


class Distribution(ABC):
    """Distribution of an uncertain input; `quantile` turns probabilities into values."""

    @property
    @abstractmethod
    def support(self) -> tuple[float, float]:
        """Smallest and largest value of the distribution."""

    @abstractmethod
    def quantile(self, probability: Array) -> NDArray[Any]:
        """Return the values at probabilities between 0 and 1, in the same shape."""


class Continuous(Distribution):
    """Distribution of real numbers, which also gives the probability below a value."""

    @property
    def support(self) -> tuple[float, float]:
        return float(self.lower), float(self.upper)  # type: ignore[attr-defined]

    @abstractmethod
    def below(self, value: ArrayLike) -> Array:
        """Return the probability of less than `value`, in the same shape; NaN if `value` is NaN."""


def _ends(lower: float, upper: float) -> tuple[float, float]:
    """Return the bounds of a truncation as floats; either may be infinite."""
    ends = []
    for name, value, free in (("lower", lower, -math.inf), ("upper", upper, math.inf)):
        ends.append(free if value == free else checks.number(name, value))
    if not ends[0] < ends[1]:
        raise ValueError(f"lower must be below upper, got {ends[0]:g} and {ends[1]:g}")
    return ends[0], ends[1]


def _refuse_far(lower: float, upper: float) -> None:
    """Raise ValueError if both ends of a truncation are so far on one side that the law there is not known."""
    if max(lower, -upper) > FARTHEST:
        raise ValueError(f"lower and upper must be within {FARTHEST:g} standard deviations of the middle of the law")


def _scores(probability: Array, lower: float, upper: float) -> Array:
    """Return standard normal scores at probabilities of the normal law truncated to scores from lower to upper."""
    if lower == -math.inf and upper == math.inf:
        return np.asarray(scipy.special.ndtri(probability))
    if lower > 0.0:
        return -_scores(1.0 - probability, -upper, -lower)
    last = scipy.special.log_ndtr(upper)
    inside = probability + math.exp(scipy.special.log_ndtr(lower) - last) * (1.0 - probability)
    return np.clip(scipy.special.ndtri_exp(last + log(inside)), lower, upper)


def _share(value: ArrayLike, lower: float, upper: float) -> Array:
    """Return the relative position of a value between lower and upper, 0 to 1."""
    return np.minimum(np.maximum((np.asarray(value, dtype=float) - lower) / (upper - lower), 0.0), 1.0)


def _share_below(score: Array, lower: float, upper: float) -> Array:
    """Return the probability below a score of the standard normal law truncated to scores from lower to upper."""
    inside = np.minimum(np.maximum(score, lower), upper)
    if lower > 0.0:  # upper-tail probabilities keep the digits that numbers near 1 would lose
        first, last = scipy.special.ndtr([-lower, -upper])
        return np.asarray((first - scipy.special.ndtr(-inside)) / (first - last))
    first, last = scipy.special.ndtr([lower, upper])
    return np.asarray((scipy.special.ndtr(inside) - first) / (last - first))


@dataclass(frozen=True)
class Normal(Continuous):
    """Normal law, truncated if `lower` or `upper` is given.

    Parameters
    ----------
    mean, std : float
        Mean and standard deviation (> 0) of the law before truncation.
    lower, upper : float
        Ends of its support.

    >>> Normal(0.9, 0.03, upper=1.0).support
    (-inf, 1.0)
    """

    mean: float
    std: float
    lower: float = -math.inf
    upper: float = math.inf

    def __post_init__(self) -> None:
        checks.number("mean", self.mean)
        POSITIVE.check("std", self.std)
        _ends(self.lower, self.upper)
        _refuse_far(*self._edges)

    def quantile(self, probability: Array) -> Array:
        return self.mean + self.std * _scores(probability, *self._edges)

    def below(self, value: ArrayLike) -> Array:
        return _share_below((np.asarray(value, dtype=float) - self.mean) / self.std, *self._edges)

    @property
    def _edges(self) -> tuple[float, float]:
        lower, upper = ((end - self.mean) / self.std for end in self.support)
        return lower, upper


@dataclass(frozen=True)
class Lognormal(Continuous):
    """Lognormal law, ln x ~ N(ln median, dispersion²), truncated if `lower` or `upper` is given.

    Parameters
    ----------
    median, dispersion : float
        Median (> 0) and standard deviation of the logarithm (> 0) before truncation.
    lower, upper : float
        Ends of its support, 0 and infinity if not given.

    >>> import numpy as np
    >>> Lognormal(2.0, 0.4).quantile(np.array([0.5])).tolist()
    [2.0]
    """

    median: float
    dispersion: float
    lower: float = 0.0
    upper: float = math.inf

    def __post_init__(self) -> None:
        POSITIVE.check("median", self.median)
        POSITIVE.check("dispersion", self.dispersion)
        checks.number("lower", self.lower, at_least=0.0)
        _ends(self.lower, self.upper)
        _refuse_far(*map(float, self._score(self.support)))

    def quantile(self, probability: Array) -> Array:
        lower, upper = self._score(self.support)
        return self.median * exp(self.dispersion * _scores(probability, float(lower), float(upper)))

    def below(self, value: ArrayLike) -> Array:
        lower, upper = self._score(self.support)
        return _share_below(self._score(value), float(lower), float(upper))

    def _score(self, value: ArrayLike) -> Array:
        """Return the standard normal score, minus infinity for values that are not positive."""
        with np.errstate(divide="ignore", over="ignore"):  # a value far above a tiny median gets infinity
            return np.asarray(log(np.maximum(np.asarray(value, dtype=float), 0.0) / self.median) / self.dispersion)


@dataclass(frozen=True)
class Uniform(Continuous):
    """Uniform law from `lower` to `upper`."""

    lower: float
    upper: float

    def __post_init__(self) -> None:
        lower = checks.number("lower", self.lower)
        checks.number("upper", self.upper, above=lower)

    def quantile(self, probability: Array) -> Array:
        return self.lower + (self.upper - self.lower) * np.asarray(probability)

    def below(self, value: ArrayLike) -> Array:
        return _share(value, self.lower, self.upper)


@dataclass(frozen=True)
class Beta(Continuous):
    """Beta law of shapes `a` and `b` (> 0), stretched to `lower` … `upper`.

    >>> import numpy as np
    >>> Beta(2.0, 2.0, 0.8, 1.0).quantile(np.array([0.5])).round(12).tolist()
    [0.9]
    """

    a: float
    b: float
    lower: float = 0.0
    upper: float = 1.0

    def __post_init__(self) -> None:
        POSITIVE.check("a", self.a)
        POSITIVE.check("b", self.b)
        lower = checks.number("lower", self.lower)
        checks.number("upper", self.upper, above=lower)

    @classmethod
    def from_moments(cls, mean: float, std: float) -> "Beta":
        """Return the law on 0 to 1 with the given mean and standard deviation; ValueError if there is none.

        >>> law = Beta.from_moments(0.9, 0.05)
        >>> round(law.a, 9), round(law.b, 9)
        (31.5, 3.5)
        """
        centre = checks.number("mean", mean, above=0.0, below=1.0)
        most = math.sqrt(centre * (1.0 - centre))
        size = centre * (1.0 - centre) / checks.number("std", std, above=0.0, below=most) ** 2 - 1.0
        return cls(centre * size, (1.0 - centre) * size)

    def quantile(self, probability: Array) -> Array:
        share = np.asarray(scipy.special.betaincinv(self.a, self.b, probability))
        return self.lower + (self.upper - self.lower) * share

    def below(self, value: ArrayLike) -> Array:
        return np.asarray(scipy.special.betainc(self.a, self.b, _share(value, self.lower, self.upper)))


@dataclass(frozen=True)
class Least(Continuous):
    """The minimum of several independent quantities, such as the strengths of a device and of its fixings.

    Parameters
    ----------
    parts : sequence of Continuous
        Their distributions, at least one.

    Notes
    -----
    P(minimum > x) is the product of P(part > x). A quantile lies between the minimum over the parts of their quantiles
    at 1 - (1 - p)^(1/n) and at p. Bisection finds it there to the last digits.

    >>> import numpy as np
    >>> kit = Least([Lognormal(900.0, 0.3), Lognormal(400.0, 0.3), Lognormal(600.0, 0.3)])
    >>> kit.quantile(np.array([0.5])).round(1).tolist()
    [387.9]
    """

    parts: Sequence[Continuous]

    def __post_init__(self) -> None:
        if isinstance(self.parts, Distribution) or not checks.is_several(self.parts):
            raise TypeError(f"parts must be a sequence of distributions, got {checks.kind(self.parts)}")
        parts = tuple(self.parts)
        if not parts:
            raise ValueError("parts must hold at least one distribution, got none")
        for part in parts:
            if not isinstance(part, Continuous):
                raise TypeError(f"parts must be distributions of numbers, got {checks.kind(part)}")
        object.__setattr__(self, "parts", parts)

    @property
    def support(self) -> tuple[float, float]:
        ends = [part.support for part in self.parts]
        return min(lower for lower, _ in ends), min(upper for _, upper in ends)

    def below(self, value: ArrayLike) -> Array:
        return -expm1(self._log_above(value))

    def quantile(self, probability: Array) -> Array:
        p = np.asarray(probability, dtype=float)
        wanted = log1p(-p)
        n = len(self.parts)
        low = np.min([part.quantile(-expm1(wanted / n)) for part in self.parts], axis=0)
        high = np.min([part.quantile(p) for part in self.parts], axis=0)
        for _ in range(BISECTIONS):
            middle = 0.5 * (low + high)
            enough = self._log_above(middle) <= wanted
            low, high = np.where(enough, low, middle), np.where(enough, middle, high)
        return np.asarray(high)

    def _log_above(self, value: ArrayLike) -> Array:
        """Return the logarithm of the probability of more than a value."""
        return np.asarray(sum(log1p(-part.below(value)) for part in self.parts))
