"""Targets from a hazard: the joint distribution of the measures of motions, given the level of one of them."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import xarray as xr

from ...core import checks
from ...core.elementary import Array, exp, log, times
from ..intensity.measure import Measure
from ..intensity.naming import measure_named
from ..intensity.parametric_measures import AvgSa, Sa
from .correlations import by_formulas, repaired

FORMULAS = "baker-jayaram+bradley"


@dataclass(frozen=True)
class Conditional:
    """Joint lognormal distribution of measures at a level of the one on which it is conditioned.

    Attributes
    ----------
    measures, given : tuple of Measure, Measure
    level : float
        Level of `given`, SI.
    mean, covariance : ndarray, shapes (measure,), (measure, measure)
        Of the logarithms (SI).
    epsilon : float
        Number of standard deviations by which the level lies above the median; of a mixture the weighted mean.
    """

    measures: tuple[Measure, ...]
    given: Measure
    level: float
    mean: Array
    covariance: Array
    epsilon: float

    @property
    def medians(self) -> Array:
        """Medians, SI, shape (measure,)."""
        return exp(self.mean)

    @property
    def sigmas(self) -> Array:
        """Standard deviations of the logarithms, shape (measure,)."""
        return np.sqrt(np.maximum(np.diag(self.covariance), 0.0))


MOST_SIGMA = 3.0
"""Largest standard deviation of a logarithm that is no slip: percents and values in other units are above it."""


@dataclass(frozen=True)
class Target:
    """Joint lognormal distribution of the measures of one rupture's motions, to be conditioned on one of them.

    Parameters
    ----------
    measures : sequence of measures or their names
        `Sa(T)` of 5 % damping, ``pga``, ``pgv``, ``d5_95``; others with correlations of one's own.
    medians : array_like, shape (measure,)
        Medians, SI (m/s², m/s, s), > 0.
    sigmas : array_like, shape (measure,)
        Standard deviations of the natural logarithms, > 0 and at most 3 (published values are .3 to 1.2).
    correlations : str or array_like, shape (measure, measure)
        ``"baker-jayaram+bradley"`` (default): Baker and Jayaram (2008) between spectral ordinates, Bradley (2012) with
        the peak velocity and Bradley (2011) with the duration. A labelled array is taken by its labels. Values that do
        not form a correlation matrix are repaired; `correlation_change` is the difference.
    given : measure or its name
        The measure whose levels condition the others: one of `measures`, or an `AvgSa` of periods whose Sa are among
        them.

    Notes
    -----
    The logarithms x = ln measures ~ N(mu, S), S_ij = rho_ij sigma_i sigma_j. Given aᵀx = ln y, with c = S a and v =
    aᵀc, mu' = mu + c (ln y - aᵀmu)/v and S' = S - c cᵀ/v. The vector a picks one measure, or is 1/n on the n periods of
    an AvgSa.

    The tables of Baker and Bradley (2017), which have a corrigendum (2025), are not used. The formulas are checked for
    symmetry, range and continuity, and agree with their table of January 2022 within 0.26 between spectral ordinates.
    The table of the corrigendum was not available, except for PGA with PGV. There OpenQuake's copy has 0.671, compared
    with 0.654 in 2022 and 0.733 by the formulas.

    References
    ----------
    Baker, J. W. (2011). Conditional mean spectrum: tool for ground-motion selection. Journal of Structural Engineering
    137(3), 322-331.  Bradley, B. A. (2010). A generalized conditional intensity measure approach and holistic
    ground-motion selection. Earthquake Engineering & Structural Dynamics 39(12), 1321-1342.  Baker, J. W. and Bradley,
    B. A. (2017). Intensity measure correlations observed in the NGA-West2 database, and dependence of correlations on
    rupture and site parameters. Earthquake Spectra 33(1), 145-156; corrigendum (2025), 41(2), 1825-1827.

    Examples
    --------
    >>> from toppling import motions
    >>> target = Target(["Sa(0.5)", "Sa(1.0)", "pgv"], [2.7, 1.4, 0.15], [0.64, 0.69, 0.65], given="Sa(1.0)")
    >>> target.at(4.0).medians.round(2).tolist()
    [5.6, 4.0, 0.33]
    """

    measures: Sequence[Measure | str]
    medians: Any
    sigmas: Any
    correlations: Any = FORMULAS
    given: Measure | str = ""
    correlation_change: float = field(init=False, default=0.0)
    _mean: Array = field(init=False, repr=False, compare=False)
    _covariance: Array = field(init=False, repr=False, compare=False)
    _direction: Array = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        if isinstance(self.measures, str | Measure) or not checks.is_several(self.measures):
            raise TypeError(f"measures must be a sequence of measures, got {checks.kind(self.measures)}")
        chosen = tuple(measure_named(measure) for measure in self.measures)
        labels = [measure.label for measure in chosen]
        twice = sorted({label for label in labels if labels.count(label) > 1})
        if twice:
            raise ValueError(f"measures hold {twice[0]} twice")
        medians = _positive("medians", self.medians, len(chosen), labels)
        sigmas = _positive("sigmas", self.sigmas, len(chosen), labels)
        if sigmas.max() > MOST_SIGMA:
            i = int(sigmas.argmax())
            raise ValueError(
                f"sigmas must be at most {MOST_SIGMA:g} (of natural logarithms), got {sigmas[i]:g} for {labels[i]}"
            )
        given = measure_named(self.given or chosen[0], "given")
        matrix, change = _correlations(self.correlations, chosen, labels)
        for name, value in {
            "measures": chosen,
            "medians": tuple(medians.tolist()),
            "sigmas": tuple(sigmas.tolist()),
            "given": given,
            "correlation_change": change,
            "_mean": log(medians),
            "_covariance": matrix * sigmas[:, None] * sigmas,
            "_direction": _direction(given, chosen),
        }.items():
            object.__setattr__(self, name, value)

    def at(self, level: float) -> Conditional:
        """Return the distribution at a level of `given`, SI, > 0."""
        y = checks.number("level", level, above=0.0)
        a = self._direction
        c = times(self._covariance, a)
        v = float(times(a, c))
        off = math.log(y) - float(times(a, self._mean))
        mean = self._mean + c * (off / v)
        covariance = self._covariance - np.outer(c, c) / v
        for i in np.flatnonzero(a == 1.0):
            mean[i] = math.log(y)
            covariance[i] = covariance[:, i] = 0.0
        return Conditional(_measures(self), _given(self), y, mean, covariance, off / math.sqrt(v))


@dataclass(frozen=True)
class Mixture:
    """Targets of several ruptures or ground-motion models, with the weights that they have at a level.

    Parameters
    ----------
    targets : sequence of Target
        Of the same measures, given the same one.
    weights : array_like, shape (target,)
        Their shares at the level, >= 0; they are divided by their sum.

    Notes
    -----
    mu' = sum w mu'_r and S' = sum w [S'_r + (mu'_r - mu')(mu'_r - mu')ᵀ] (Lin, T., Harmsen, S. C., Baker, J. W. and
    Luco, N. (2013). Conditional spectrum computation incorporating multiple causal earthquakes and ground-motion
    prediction models. Bulletin of the Seismological Society of America 103(2A), 1103-1116). The weights of a level come
    from a disaggregation of its *rate of equalling* that level, if stripes are at levels.
    """

    targets: Sequence[Target]
    weights: Any

    def __post_init__(self) -> None:
        parts = tuple(self.targets) if checks.is_several(self.targets) else ()
        if not parts or not all(isinstance(part, Target) for part in parts):
            raise TypeError("targets must be a sequence of at least one Target")
        if any((part.measures, part.given) != (parts[0].measures, parts[0].given) for part in parts):
            raise ValueError("targets must be of the same measures in the same order, given the same one")
        weights = checks.finite_array("weights", self.weights)
        if weights.shape != (len(parts),) or weights.min() < 0.0 or weights.sum() == 0.0:
            raise ValueError(f"weights must be {len(parts)} numbers >= 0 with a sum > 0, got {weights.tolist()}")
        object.__setattr__(self, "targets", parts)
        object.__setattr__(self, "weights", tuple((weights / weights.sum()).tolist()))

    @property
    def measures(self) -> tuple[Measure, ...]:
        """The measures of the targets."""
        return _measures(self.targets[0])

    @property
    def given(self) -> Measure:
        """The measure on which the targets are conditioned."""
        return _given(self.targets[0])

    @property
    def correlation_change(self) -> float:
        """Maximum repair of the correlations of a target."""
        return max(target.correlation_change for target in self.targets)

    def at(self, level: float) -> Conditional:
        """Return the lognormal distribution with the mixture's means and covariances at a level, SI, > 0."""
        parts = [target.at(level) for target in self.targets]
        weights = np.array(self.weights)
        means = np.array([part.mean for part in parts])
        mean = times(weights, means)
        apart = means - mean
        covariance = np.einsum("r,rij->ij", weights, np.array([part.covariance for part in parts]))
        covariance = covariance + np.einsum("r,ri,rj->ij", weights, apart, apart)
        epsilon = float(times(weights, np.array([part.epsilon for part in parts])))
        return Conditional(self.measures, self.given, parts[0].level, mean, covariance, epsilon)


def _measures(target: Target) -> tuple[Measure, ...]:
    return target.measures  # type: ignore[return-value]  # (names became measures)


def _given(target: Target) -> Measure:
    return target.given  # type: ignore[return-value]


def _positive(name: str, values: Any, number: int, labels: Sequence[str]) -> Array:
    array = checks.finite_array(name, values)
    if array.shape != (number,):
        raise ValueError(f"{name} must be {number} numbers, one for each measure, got {array.size}")
    if array.min() <= 0.0:
        i = int(array.argmin())
        raise ValueError(f"{name} must be > 0, got {array[i]:g} for {labels[i]}")
    return array


def _correlations(given: Any, measures: Sequence[Measure], labels: Sequence[str]) -> tuple[Array, float]:
    if isinstance(given, str):
        checks.choice("correlations", given, (FORMULAS,))
        return repaired(by_formulas(measures), labels)
    if isinstance(given, xr.DataArray):
        if given.ndim != 2 or any(dim not in given.coords for dim in given.dims):
            raise ValueError(f"labelled correlations must have two dimensions with labels, got {given.dims}")
        for dim in given.dims:
            missing = [label for label in labels if label not in given[dim].values]
            if missing:
                raise ValueError(f"correlations hold no {missing[0]} along {dim!r}")
        first, second = given.dims
        given = given.sel({first: list(labels), second: list(labels)}).values
    return repaired(given, labels)


def _direction(given: Measure, measures: Sequence[Measure]) -> Array:
    """Return a with aᵀx = ln of the measure that is given."""
    a = np.zeros(len(measures))
    if given in measures:
        a[measures.index(given)] = 1.0
        return a
    if not isinstance(given, AvgSa):
        raise ValueError(f"given must be one of the measures, or an AvgSa of their periods, got {given.label}")
    for period in given.periods:
        ordinate = Sa(period, given.damping)
        if ordinate not in measures:
            raise ValueError(f"given {given.label} needs {ordinate.label} among the measures")
        a[measures.index(ordinate)] += 1.0 / len(given.periods)
    return a
