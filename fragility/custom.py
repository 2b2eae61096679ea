"""A fit of the user's own as a form of curve: any callable of levels, overturnings and runs."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from .bootstrap import percentile_interval
from .estimation import BOOTSTRAP, Options, Resampled
from .form import OVERTURNING, Columns, Form, log_likelihood_of, percentile_columns
from .statuses import NO_RUNS, OK
from .trials import Sample, falls_of, outcomes_of

Array = NDArray[np.float64]
# How far outside the levels fractiles are sought.
REACH = 100.0
BISECTIONS = 60


class Fitted(Protocol):
    """What a fit returns.  It may have `log_likelihood` and `parameters`, a mapping of names to numbers, too."""

    def probability(self, x: Array) -> Array:
        """Probability of overturning at levels x, an array of any length; non-decreasing."""


Fit = Callable[[Array, NDArray[np.int64], NDArray[np.int64]], Fitted]
"""A callable of (levels, overturnings, runs), each (level,), levels rising, runs at every one of them."""


class CustomForm(Form):
    """Curves of a `Fit`.

    Where it raises ValueError, ArithmeticError or LinAlgError for resampled counts, the replicate has no curve; for
    the counts themselves the error is the caller's to see.
    """

    intervals = (BOOTSTRAP,)

    def __init__(self, fit: Fit) -> None:
        self._fit = fit
        self.name = str(getattr(fit, "__name__", type(fit).__name__))
        self.text = f"fit {self.name!r}"

    def fit(self, sample: Sample, options: Options, drawn: Resampled | None) -> Columns:
        assert drawn is not None
        overturnings, runs = sample.of_levels
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
        samples = np.array([self._fractiles(one, x, fractions) for one in every]).T
        columns: Columns = {
            "probability": curve,
            # one without a curve may be anywhere: an end that it decides is that of all probabilities
            "probability_lower": np.maximum(band.lower, 0.0),
            "probability_upper": np.minimum(band.upper, 1.0),
            "log_likelihood": log_likelihood_of(curve, overturnings, runs) if stated is None else float(stated),
            "status": OK,
            "converged": True,
            "failed_replicates": sum(one is None for one in every),
            **percentile_columns(self._fractiles(best, x, fractions), samples, options),
        }
        parameters = _parameters(best)
        for name, value in parameters.items():
            drawn_values = np.array([_parameters(one).get(name, np.nan) for one in every])
            ends = percentile_interval(drawn_values, options.confidence, against=True)
            columns |= {f"parameter_{name}": value}
            columns |= {f"parameter_{name}_lower": float(ends.lower), f"parameter_{name}_upper": float(ends.upper)}
        if "log_likelihood" in columns and parameters:
            columns["aic"] = 2.0 * len(parameters) - 2.0 * columns["log_likelihood"]
        return columns | ({"probability_sample": again} if options.keep else {})

    def probabilities(self, sample: Sample, cells: Array, penalty: str) -> Array:
        return self._table(self._all(sample, cells), sample.levels)

    def _all(self, sample: Sample, cells: Array) -> list[Fitted | None]:
        falls, runs = falls_of(cells, outcomes_of(OVERTURNING, sample.levels.size))
        found: list[Fitted | None] = []
        for k, n in zip(falls.astype(np.int64), runs.astype(np.int64), strict=True):
            try:
                found.append(self._fit(sample.levels[n > 0], k[n > 0], n[n > 0]))
            except (ValueError, ArithmeticError, np.linalg.LinAlgError):
                found.append(None)
        return found

    def _at(self, fitted: Fitted, x: Array) -> Array:
        values = np.asarray(fitted.probability(x), dtype=float)
        if values.shape != x.shape or not np.all((values >= 0.0) & (values <= 1.0)):
            raise ValueError(f"probability(x) of the fit {self.name!r} must lie between 0 and 1 for every x")
        return values

    def _table(self, every: list[Fitted | None], x: Array) -> Array:
        missing = np.full(x.size, np.nan)
        return np.array([missing if one is None else self._at(one, x) for one in every])

    def _fractiles(self, fitted: Fitted | None, x: Array, fractions: Array) -> Array:
        if fitted is None:
            return np.full(fractions.size, np.nan)
        return _invert(lambda at: self._at(fitted, at), fractions, x[0] / REACH, x[-1] * REACH)


def _parameters(fitted: Any) -> dict[str, float]:
    found = getattr(fitted, "parameters", None)
    return {} if found is None else {str(name): float(value) for name, value in dict(found).items()}


def _invert(probability: Callable[[Array], Array], p: Array, low: float, high: float) -> Array:
    """Where a curve passes p (fraction,), by bisection in ln x: 0 where that is below `low`, inf where above `high`."""
    a, b = np.full(p.shape, np.log(low)), np.full(p.shape, np.log(high))
    at_low, at_high = probability(np.exp(a)), probability(np.exp(b))
    for _ in range(BISECTIONS):
        middle = 0.5 * (a + b)
        below = probability(np.exp(middle)) < p
        a, b = np.where(below, middle, a), np.where(below, b, middle)
    return np.where(at_low >= p, 0.0, np.where(at_high < p, np.inf, np.exp(b)))
