"""Consequences of a fall as distributions: the cost and the downtime of a piece, and the persons whom it injures."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated

import numpy as np
import scipy

from ...core import checks
from ...core.distributions import Normal
from ...core.elementary import Array, exp, log, times
from ...core.parameters import SHARE, Parameter, check
from ...core.streams import key_of, stream
from ..file.table import MAX_VALUE

LOGNORMAL, NORMAL = DISTRIBUTIONS = ("lognormal", "normal")
MOST_DISPERSION = {LOGNORMAL: 3.0, NORMAL: 0.5}
"""Largest dispersion of each distribution; of a normal one too much would lie below zero."""
Median = Annotated[float, Parameter(above=0.0, at_most=MAX_VALUE)]
Scatter = Annotated[float, Parameter(at_least=0.0)]
Persons = Annotated[float, Parameter(at_least=0.0, at_most=1e4)]
REALISATIONS = 20
"""Default number of realisations of the consequences under each motion, without variability."""
MOST_DRAWN = 1_000_000
"""Most pieces of a line times realisations, which bounds the memory of a motion's draws."""
DRAWN_BYTES = 300.0
"""Memory of the draws of a piece and realisation under one motion, with all that is made of them."""
CELLS = 60
"""Most cells of the values over which the mean of a maximum is summed."""
SAFETY = ("injury", "blocks-exit", "release")
"""Consequences that rank before money, if a study names no others."""
COLUMNS = {"cost": 0, "downtime": 1, "injury": 2}
"""Columns of the scores of a piece, by the consequences of `Contents`."""


@dataclass(frozen=True)
class Consequence:
    """The cost or the downtime of one piece when it overturns, as FEMA P-58 describes it.

    Parameters
    ----------
    median : float
        Median, > 0, in the unit of the quantity.
    dispersion : float
        Of a lognormal distribution the standard deviation of the logarithm, 0 to 3; of a normal one the coefficient of
        variation, 0 to 0.5.  With 0 the consequence is known.
    distribution : {"lognormal", "normal"}
        The normal distribution is truncated at 0; `median` is that before truncation.

    Raises
    ------
    TypeError, ValueError
        A value out of range.

    References
    ----------
    FEMA (2018). Seismic performance assessment of buildings, volume 1, methodology. FEMA P-58-1, 2nd ed. (recalled):
    consequence functions are lognormal or normal, with a median and a dispersion.

    Examples
    --------
    >>> round(Consequence(100.0, 0.5).mean, 3)  # 100 exp(0.5²/2)
    113.315
    """

    median: Median
    dispersion: Scatter = 0.0
    distribution: Annotated[str, Parameter(words=DISTRIBUTIONS)] = LOGNORMAL

    def __post_init__(self) -> None:
        check(self)
        most = MOST_DISPERSION[self.distribution]
        if self.dispersion > most:
            hint = "; use lognormal above" if self.distribution == NORMAL else ""
            raise ValueError(
                f"dispersion must be from 0 to {most:g} of a {self.distribution} distribution, got "
                f"{self.dispersion:g}{hint}"
            )

    @property
    def mean(self) -> float:
        """Mean: median·exp(β²/2), or of the normal distribution truncated at 0."""
        if self.dispersion == 0.0:
            return float(self.median)
        if self.distribution == LOGNORMAL:
            return float(self.median * math.exp(0.5 * self.dispersion**2))
        edge = 1.0 / self.dispersion
        density = math.exp(-0.5 * edge**2) / math.sqrt(2.0 * math.pi)
        return float(self.median * (1.0 + self.dispersion * density / scipy.special.ndtr(edge)))

    def of_several(self, pieces: int, greatest: bool = False) -> tuple[float, float]:
        """Return the mean and the standard deviation of the mean, or of the maximum, of several independent pieces.

        Moments of the maximum of n are the integrals of its values times n Phi^(n-1)(z) phi(z), the density of the
        maximum of n normal scores. (Trapezoids, exact to rounding.)
        """
        if self.dispersion == 0.0:
            return float(self.median), 0.0
        z = np.linspace(-12.0, 12.0 + 4.0 * MOST_DISPERSION[LOGNORMAL], 20_001)
        n = pieces if greatest else 1
        density = n * exp((n - 1) * scipy.special.log_ndtr(z) - 0.5 * z**2) / math.sqrt(2.0 * math.pi)
        weights = density * (z[1] - z[0])
        values = self.at(z) / self.median
        mean = float(times(weights, values))
        spread = math.sqrt(float(times(weights, (values - mean) ** 2)) / (1 if greatest else pieces))
        return self.median * mean, self.median * spread

    def at(self, scores: Array) -> Array:
        """Return the values at standard normal scores, in the same shape."""
        if self.dispersion == 0.0:
            return np.full(np.shape(scores), float(self.median))
        if self.distribution == LOGNORMAL:
            return np.asarray(self.median * exp(self.dispersion * scores))
        law = Normal(self.median, self.dispersion * self.median, lower=0.0)
        # the largest probability below 1 represents scores above 8.2
        return law.quantile(np.minimum(scipy.special.ndtr(scores), np.nextafter(1.0, 0.0)))


def cell_edges(given: Iterable[Consequence]) -> Array:
    """Return edges of cells of the values of some consequences, from 0 to above all of them, dense where values are.

    Above the last inner edge, a score of 8 more than the dispersion, lie less than 1e-15 of the mean.
    """
    laws = dict.fromkeys(given)
    values = [law.at(np.linspace(-4.0, 8.0 + law.dispersion, CELLS)) for law in laws]
    every = np.unique(np.concatenate(values))
    if every.size > CELLS:
        every = every[np.rint(np.linspace(0.0, every.size - 1.0, CELLS)).astype(np.int64)]
    return np.concatenate([[0.0], every])


def shares_above(given: Consequence, edges: Array) -> Array:
    """Return the mean of P(value > x) over each cell of x between `edges`, from 0 up; the last cell has no end.

    Products with the widths of the cells sum to the mean: they are differences of the mean of min(value, x).
    """
    inner = edges[1:-1]
    if given.dispersion == 0.0:
        limited = np.minimum(inner, given.median)
    elif given.distribution == LOGNORMAL:
        score = log(inner / given.median) / given.dispersion
        below = scipy.special.ndtr(score - given.dispersion)
        limited = given.mean * below + inner * scipy.special.ndtr(-score)
    else:
        edge = 1.0 / given.dispersion
        score = (inner / given.median - 1.0) * edge
        whole, least = scipy.special.ndtr(edge), scipy.special.ndtr(-edge)
        density = (exp(-0.5 * score**2) - math.exp(-0.5 * edge**2)) / math.sqrt(2.0 * math.pi)
        below = given.median * (scipy.special.ndtr(score) - least - given.dispersion * density) / whole
        limited = below + inner * scipy.special.ndtr(-score) / whole
    limited = np.concatenate([[0.0], np.minimum(limited, given.mean), [given.mean]])
    return np.clip(np.diff(limited) / np.diff(edges), 0.0, 1.0)


@dataclass(frozen=True)
class Injury:
    """The persons whom a piece injures when it overturns: a Poisson number.

    Parameters
    ----------
    persons : float
        Mean number of persons in the area of the piece's fall, over all hours, 0 to 10,000.
    probability : float
        Probability that one of them is injured, 0 to 1.

    Raises
    ------
    TypeError, ValueError
        A value out of range.

    Notes
    -----
    The persons who are there are a Poisson number, each injured independently; the injured are then a Poisson number of
    mean persons × probability.  A choice: FEMA P-58 counts persons by hour, day and month.

    Examples
    --------
    >>> Injury(0.5, 0.2).mean
    0.1
    """

    persons: Persons
    probability: Annotated[float, SHARE]

    def __post_init__(self) -> None:
        check(self)

    @property
    def mean(self) -> float:
        """Mean number of injured persons."""
        return float(self.persons * self.probability)

    def at(self, scores: Array) -> Array:
        """Return the numbers of injured persons at standard normal scores, in the same shape."""
        most = math.ceil(self.mean + 12.0 * math.sqrt(self.mean) + 20.0)
        below = scipy.special.pdtr(np.arange(most), self.mean)
        return np.searchsorted(below, scipy.special.ndtr(scores)).astype(np.float64)


@dataclass(frozen=True)
class PieceScores:
    """The draws that decide the consequences of every piece: `realisations` under each motion.

    The scores of a piece are z_i = √ρ f + √(1 − ρ) ε_i with a factor f common to its three consequences, cost, downtime
    and injuries. This is a Gaussian copula with one factor and the `correlation` ρ, 0 to 1. They depend only on the
    seed, the name of the line, the motion, and the number of the piece within the line. Laws and levels therefore have
    the same scores, in any order of computation.
    """

    realisations: int = REALISATIONS
    correlation: float = 1.0
    seed: int = 0

    def __post_init__(self) -> None:
        checks.count("realisations", self.realisations, at_least=1)
        SHARE.number("consequence_correlation", self.correlation)
        checks.count("seed", self.seed)

    @cached_property
    def _shares(self) -> tuple[float, float]:
        return math.sqrt(self.correlation), math.sqrt(1.0 - self.correlation)

    def of_pieces(self, label: str, count: int, motion: int) -> Array:
        """Return the scores (piece, realisation, 3) of a line's pieces under a motion, columns as in `COLUMNS`."""
        drawn = stream(self.seed, *key_of(label), motion).standard_normal((count, self.realisations, 4))
        common, alone = self._shares
        return np.asarray(common * drawn[..., :1] + alone * drawn[..., 1:])

    def check_size(self, label: str, count: int) -> None:
        """Raise ValueError for a line of more pieces than are drawn."""
        most = MOST_DRAWN // self.realisations
        if count > most:
            raise ValueError(
                f"{label!r} has {count:,} pieces with drawn consequences, which must be at most {most:,} at "
                f"{self.realisations} realisations: divide the line, or give value instead of cost_median"
            )
