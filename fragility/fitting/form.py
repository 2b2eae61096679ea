"""Forms of fragility curve: the interface of all forms, and the form that a caller's own fit makes.

`fit_fragility` finds the built-in forms by name; `CustomForm` takes any callable of levels, overturnings and runs.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Any, Protocol

import numpy as np

from ...core.elementary import Array, Index, exp, log, log1p
from .bootstrap import percentile_interval
from .intervals import BOOTSTRAP, INTERVALS, Options, ResampledData
from .states import NO_RUNS, OK
from .trials import STATES, STOOD, TOPPLED, Sample

Columns = dict[str, Any]
"""Results of one curve by name of variable: numbers, words, or arrays on fraction, level or replicate."""


class Form(ABC):
    """A form of fragility curve: it is fitted to a sample and returns the results as `Columns`."""

    name: str
    """Name of the form in the attribute ``form``."""
    text: str
    """Formula or procedure, for the attribute ``method``."""
    intervals: tuple[str, ...] = INTERVALS
    """Kinds of interval that the form offers."""
    methods: tuple[str, ...] = ("binomial",)
    """Methods of fitting: to counts at the levels, or to first overturnings."""

    @abstractmethod
    def fit(self, sample: Sample, options: Options, drawn: ResampledData | None) -> Columns:
        """Fit one curve and return all of its results; `drawn` is the resampled data if replicates are needed."""

    @abstractmethod
    def probabilities(self, sample: Sample, cells: Array, penalty: str) -> Array:
        """Fit curves to other cells (replicate, cell); return them at the sample's levels, (replicate, level)."""

    def state_probabilities(self, sample: Sample, penalty: str) -> Array:
        """The probability of each state at each level, (level, STATES), under the curve fitted to the sample."""
        chances = np.zeros((sample.levels.size, STATES))
        chances[:, TOPPLED] = self.probabilities(sample, sample.cells[None], penalty)[0]
        chances[:, STOOD] = 1.0 - chances[:, TOPPLED]
        return chances


def log_likelihood_of(probability: Array, overturnings: Index, runs: Index) -> float:
    """Return the binomial log-likelihood of a curve at the levels, without its constant."""
    stood = runs - overturnings
    with np.errstate(divide="ignore", invalid="ignore"):
        fallen = np.where(overturnings > 0, overturnings * log(probability), 0.0)
        return float((fallen + np.where(stood > 0, stood * log1p(-probability), 0.0)).sum())


def percentile_columns(sample: Sample, values: Array, samples: Array, options: Options) -> Columns:
    """Columns of median and fractiles: values (1 + fraction,), percentile intervals of samples (1 + fraction, …).

    Resampled separated data are as separated as the data: their intervals contain the levels between which these are.
    """
    ends = percentile_interval(samples, options.confidence, against=True)
    gap = sample.gap
    if gap is not None:
        ends = ends._replace(lower=np.minimum(ends.lower, gap[0]), upper=np.maximum(ends.upper, gap[1]))
    medians = samples[0][np.isfinite(samples[0])]
    columns: Columns = {
        "median": values[0],
        "median_se": float(medians.std(ddof=1)) if medians.size > 1 else np.nan,
        "median_lower": ends.lower[0],
        "median_upper": ends.upper[0],
        "fractile": values[1:],
        "fractile_lower": ends.lower[1:],
        "fractile_upper": ends.upper[1:],
    }
    return columns | ({"median_sample": samples[0]} if options.keep else {})


# Factor by which the search for fractiles extends beyond the levels.
REACH = 100.0
BISECTIONS = 60


class FittedCurve(Protocol):
    """Curve that a caller's fit returns.  It may also have `log_likelihood` and `parameters` (names to numbers)."""

    def probability(self, x: Array) -> Array:
        """Probability of overturning at levels x, an array of any length; non-decreasing."""


Fit = Callable[[Array, Index, Index], FittedCurve]
"""A callable of (levels, overturnings, runs), each (level,): levels increase, and every level has runs."""


class CustomForm(Form):
    """Curves that a caller's own fit gives.

    If the fit raises ValueError, ArithmeticError or LinAlgError for resampled counts, the replicate has no curve; an
    error for the counts themselves reaches the caller.
    """

    intervals = (BOOTSTRAP,)

    def __init__(self, fit: Fit) -> None:
        self._fit = fit
        self.name = str(getattr(fit, "__name__", type(fit).__name__))
        self.text = f"fit {self.name!r}"

    def fit(self, sample: Sample, options: Options, drawn: ResampledData | None) -> Columns:
        assert drawn is not None
        overturnings, runs = sample.level_counts
        x, used = sample.levels, runs > 0
        if not used.any():
            return {"status": NO_RUNS, "converged": False}
        best = self._fit(x[used], overturnings[used], runs[used])
        if not callable(getattr(best, "probability", None)):
            got = type(best).__name__
            raise TypeError(f"the fit {self.name!r} must return an object with .probability(x), got {got}")
        curve = self._at(best, x)
        every = self._all(sample, drawn.cells)
        again = self._table(every, x)
        band = percentile_interval(again.T, options.confidence, against=True)
        stated = getattr(best, "log_likelihood", None)
        fractions = np.array([0.5, *options.fractiles])
        samples = np.array([self._fractiles(fitted, x, fractions) for fitted in every]).T
        columns: Columns = {
            "probability": curve,
            # a replicate without a curve may lie anywhere: an end that it decides is 0 or 1
            "probability_lower": np.maximum(band.lower, 0.0),
            "probability_upper": np.minimum(band.upper, 1.0),
            "log_likelihood": log_likelihood_of(curve, overturnings, runs) if stated is None else float(stated),
            "status": OK,
            "converged": True,
            "failed_replicates": sum(fitted is None for fitted in every),
            **percentile_columns(sample, self._fractiles(best, x, fractions), samples, options),
        }
        parameters = _parameters(best)
        for name, value in parameters.items():
            drawn_values = np.array([_parameters(fitted).get(name, np.nan) for fitted in every])
            ends = percentile_interval(drawn_values, options.confidence, against=True)
            columns |= {f"parameter_{name}": value}
            columns |= {f"parameter_{name}_lower": float(ends.lower), f"parameter_{name}_upper": float(ends.upper)}
        if "log_likelihood" in columns and parameters:
            columns["aic"] = 2.0 * len(parameters) - 2.0 * columns["log_likelihood"]
        return columns | ({"probability_sample": again} if options.keep else {})

    def probabilities(self, sample: Sample, cells: Array, penalty: str) -> Array:
        return self._table(self._all(sample, cells), sample.levels)

    def _all(self, sample: Sample, cells: Array) -> list[FittedCurve | None]:
        overturnings, runs = sample.counts_in(cells)
        curves: list[FittedCurve | None] = []
        for k, n in zip(overturnings.astype(np.int64), runs.astype(np.int64), strict=True):
            try:
                curves.append(self._fit(sample.levels[n > 0], k[n > 0], n[n > 0]))
            except (ValueError, ArithmeticError, np.linalg.LinAlgError):
                curves.append(None)
        return curves

    def _at(self, fitted: FittedCurve, x: Array) -> Array:
        values = np.asarray(fitted.probability(x), dtype=float)
        if values.shape != x.shape or not np.all((values >= 0.0) & (values <= 1.0)):
            raise ValueError(f"probability(x) of the fit {self.name!r} must lie between 0 and 1 for every x")
        return values

    def _table(self, every: list[FittedCurve | None], x: Array) -> Array:
        missing = np.full(x.size, np.nan)
        return np.array([missing if curve is None else self._at(curve, x) for curve in every])

    def _fractiles(self, fitted: FittedCurve | None, x: Array, fractions: Array) -> Array:
        if fitted is None:
            return np.full(fractions.size, np.nan)
        return _invert(lambda at: self._at(fitted, at), fractions, x[0] / REACH, x[-1] * REACH)


def _parameters(fitted: Any) -> dict[str, float]:
    values = getattr(fitted, "parameters", None)
    return {} if values is None else {str(name): float(value) for name, value in dict(values).items()}


def _invert(probability: Callable[[Array], Array], p: Array, low: float, high: float) -> Array:
    """Levels at which a curve passes p (fraction,), by bisection in ln x: 0 if below `low`, inf if above `high`."""
    a, b = np.full(p.shape, log(low)), np.full(p.shape, log(high))
    at_low, at_high = probability(exp(a)), probability(exp(b))
    for _ in range(BISECTIONS):
        middle = 0.5 * (a + b)
        below = probability(exp(middle)) < p
        a, b = np.where(below, middle, a), np.where(below, b, middle)
    return np.where(at_low >= p, 0.0, np.where(at_high < p, np.inf, exp(b)))
