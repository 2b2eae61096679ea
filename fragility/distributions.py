"""Distributions of uncertain inputs: frozen dataclasses from probabilities to values, truncated and never clipped."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import betaincinv, ndtri
from scipy.stats import truncnorm

from .. import checks
from ..models import Law

Values = NDArray[np.float64]


class Distribution(ABC):
    """What an input may be; `quantile` turns probabilities into values."""

    @property
    @abstractmethod
    def support(self) -> tuple[float, float]:
        """Least and largest value that it reaches."""

    @abstractmethod
    def quantile(self, probability: Values) -> NDArray[Any]:
        """Values at probabilities between 0 and 1, of the same shape."""


def _ends(lower: float, upper: float) -> tuple[float, float]:
    """Bounds of a truncation as floats, either of which may be infinite."""
    ends = []
    for name, value, free in (("lower", lower, -math.inf), ("upper", upper, math.inf)):
        ends.append(free if value == free else checks.number(name, value))
    if not ends[0] < ends[1]:
        raise ValueError(f"lower must be below upper, got {ends[0]:g} and {ends[1]:g}")
    return ends[0], ends[1]


def _scores(probability: Values, lower: float, upper: float) -> Values:
    """Standard normal scores at probabilities of the law truncated to scores from lower to upper."""
    if lower == -math.inf and upper == math.inf:
        return np.asarray(ndtri(probability))
    return np.asarray(truncnorm.ppf(probability, lower, upper))


@dataclass(frozen=True)
class Normal(Distribution):
    """A normal law, truncated where `lower` or `upper` is given.

    Parameters
    ----------
    mean, std : float
        Mean and standard deviation (> 0) of the law before truncation.
    lower, upper : float
        Ends of its support.

    Examples
    --------
    >>> Normal(0.9, 0.03, upper=1.0).support
    (-inf, 1.0)
    """

    mean: float
    std: float
    lower: float = -math.inf
    upper: float = math.inf

    def __post_init__(self) -> None:
        checks.number("mean", self.mean)
        checks.number("std", self.std, above=0.0)
        _ends(self.lower, self.upper)

    @property
    def support(self) -> tuple[float, float]:
        return float(self.lower), float(self.upper)

    def quantile(self, probability: Values) -> Values:
        lower, upper = ((end - self.mean) / self.std for end in self.support)
        return self.mean + self.std * _scores(probability, lower, upper)


@dataclass(frozen=True)
class Lognormal(Distribution):
    """A lognormal law, ln x ~ N(ln median, dispersion²), truncated where `lower` or `upper` is given.

    Parameters
    ----------
    median, dispersion : float
        Median (> 0) and standard deviation of the logarithm (> 0) before truncation.
    lower, upper : float
        Ends of its support, 0 and infinity where not given.

    Examples
    --------
    >>> import numpy as np
    >>> Lognormal(2.0, 0.4).quantile(np.array([0.5])).tolist()
    [2.0]
    """

    median: float
    dispersion: float
    lower: float = 0.0
    upper: float = math.inf

    def __post_init__(self) -> None:
        checks.number("median", self.median, above=0.0)
        checks.number("dispersion", self.dispersion, above=0.0)
        checks.number("lower", self.lower, at_least=0.0)
        _ends(self.lower, self.upper)

    @property
    def support(self) -> tuple[float, float]:
        return float(self.lower), float(self.upper)

    def quantile(self, probability: Values) -> Values:
        with np.errstate(divide="ignore"):
            lower, upper = np.log(np.array(self.support) / self.median) / self.dispersion
        return self.median * np.exp(self.dispersion * _scores(probability, float(lower), float(upper)))


@dataclass(frozen=True)
class Uniform(Distribution):
    """All values from `lower` to `upper` alike."""

    lower: float
    upper: float

    def __post_init__(self) -> None:
        lower = checks.number("lower", self.lower)
        checks.number("upper", self.upper, above=lower)

    @property
    def support(self) -> tuple[float, float]:
        return float(self.lower), float(self.upper)

    def quantile(self, probability: Values) -> Values:
        return self.lower + (self.upper - self.lower) * np.asarray(probability)


@dataclass(frozen=True)
class Beta(Distribution):
    """A beta law of shapes `a` and `b` (> 0), stretched to `lower` … `upper`.

    Examples
    --------
    >>> import numpy as np
    >>> Beta(2.0, 2.0, 0.8, 1.0).quantile(np.array([0.5])).round(12).tolist()
    [0.9]
    """

    a: float
    b: float
    lower: float = 0.0
    upper: float = 1.0

    def __post_init__(self) -> None:
        checks.number("a", self.a, above=0.0)
        checks.number("b", self.b, above=0.0)
        lower = checks.number("lower", self.lower)
        checks.number("upper", self.upper, above=lower)

    @property
    def support(self) -> tuple[float, float]:
        return float(self.lower), float(self.upper)

    def quantile(self, probability: Values) -> Values:
        return self.lower + (self.upper - self.lower) * np.asarray(betaincinv(self.a, self.b, probability))


@dataclass(frozen=True)
class Categorical(Distribution):
    """One of several choices: damping laws, their short names, or any other words.

    Parameters
    ----------
    choices : sequence of str or law
        What may be chosen, each once.
    probabilities : sequence of float, optional
        Of each choice, > 0, with sum 1; equal where not given.

    Examples
    --------
    >>> import numpy as np
    >>> Categorical(["housner", "discrete"], [0.7, 0.3]).quantile(np.array([0.2, 0.69, 0.71])).tolist()
    ['housner', 'housner', 'discrete']
    """

    choices: Sequence[Any]
    probabilities: Sequence[float] | None = None

    def __post_init__(self) -> None:
        if isinstance(self.choices, str) or not isinstance(self.choices, Iterable):
            raise TypeError(f"choices must be a sequence of laws or words, got {checks.kind(self.choices)}")
        choices = tuple(self.choices)
        for one in choices:
            if not isinstance(one, str | Law):
                raise TypeError(f"choices must be laws or words, got {checks.kind(one)}")
        object.__setattr__(self, "choices", choices)
        labels = self.labels
        if len(labels) < 2 or len(set(labels)) != len(labels):
            raise ValueError(f"choices must be at least two, each once, got {labels!r:.80}")
        if self.probabilities is None:
            return
        shares = checks.finite_array("probabilities", self.probabilities)
        if shares.size != len(labels) or np.any(shares <= 0.0) or abs(float(shares.sum()) - 1.0) > 1e-9:
            raise ValueError(f"probabilities must be {len(labels)} numbers > 0 with sum 1, got {shares.tolist()!r:.80}")
        object.__setattr__(self, "probabilities", tuple(shares.tolist()))

    @property
    def labels(self) -> tuple[str, ...]:
        """The choices as words."""
        return tuple(one.label if isinstance(one, Law) else one for one in self.choices)

    @property
    def shares(self) -> Values:
        """Probability of each choice."""
        n = len(self.choices)
        return np.full(n, 1.0 / n) if self.probabilities is None else np.array(self.probabilities)

    @property
    def support(self) -> tuple[float, float]:
        return 0.0, float(len(self.choices) - 1)

    def quantile(self, probability: Values) -> NDArray[np.object_]:
        ends = np.cumsum(self.shares)[:-1]
        return np.array(self.labels, dtype=object)[np.searchsorted(ends, probability, side="right")]
