"""Monotone fragility curves of no form at all: isotonic regression of the observed fractions.

References
----------
Ayer, M., Brunk, H. D., Ewing, G. M., Reid, W. T. and Silverman, E. (1955). An empirical distribution function for
sampling with incomplete information. Annals of Mathematical Statistics 26, 641-647.
"""

from __future__ import annotations

import numpy as np
import scipy
from numpy.typing import NDArray

from .bootstrap import percentile_interval
from .estimation import BOOTSTRAP, Options, Resampled
from .form import OVERTURNING, Columns, Form, log_likelihood_of, percentile_columns
from .intervals import binomial_interval
from .statuses import NO_RUNS, OK
from .trials import Sample, falls_of, outcomes_of

Array = NDArray[np.float64]


def isotonic_probabilities(levels: Array, overturnings: Array, runs: Array) -> Array:
    """The non-decreasing probabilities (level,) of greatest binomial likelihood.

    At levels without runs, linear in ln x between their neighbours, and as the nearest outside of them; NaN where
    there are no runs at all.
    """
    used = runs > 0
    if not used.any():
        return np.full(levels.size, np.nan)
    fitted = np.asarray(scipy.optimize.isotonic_regression(overturnings[used] / runs[used], weights=runs[used]).x)
    return fitted if used.all() else np.interp(np.log(levels), np.log(levels[used]), fitted)


def crossings(levels: Array, probabilities: Array, p: float) -> Array:
    """Where curves (replicate, level), linear in ln x between levels, first reach p: 0 below the levels, inf above."""
    reached = probabilities >= p
    first = reached.argmax(axis=1)
    last = np.maximum(first - 1, 0)
    rows = np.arange(probabilities.shape[0])
    at, before = probabilities[rows, first], probabilities[rows, last]
    x = np.log(levels)
    with np.errstate(divide="ignore", invalid="ignore"):
        inside = np.exp(x[last] + (p - before) / (at - before) * (x[first] - x[last]))
    found = np.where(first > 0, inside, np.where(at == p, levels[0], 0.0))
    return np.where(np.isnan(probabilities).any(axis=1), np.nan, np.where(reached.any(axis=1), found, np.inf))


class IsotonicForm(Form):
    """P(x) non-decreasing, nothing else."""

    name = "isotonic"
    text = "isotonic regression (pool adjacent violators, weighted by runs)"
    intervals = (BOOTSTRAP,)

    def fit(self, sample: Sample, options: Options, drawn: Resampled | None) -> Columns:
        assert drawn is not None
        overturnings, runs = sample.of_levels
        curve = isotonic_probabilities(sample.levels, overturnings.astype(float), runs.astype(float))
        again = self.probabilities(sample, drawn.cells, options.penalty)
        lower, upper = _band(curve, again, runs, options.confidence)
        fractions = (0.5, *options.fractiles)
        values = np.array([crossings(sample.levels, curve[None], p)[0] for p in fractions])
        samples = np.array([crossings(sample.levels, again, p) for p in fractions])
        columns: Columns = {
            "probability": curve,
            "probability_lower": lower,
            "probability_upper": upper,
            "log_likelihood": log_likelihood_of(curve, overturnings, runs) if runs.any() else np.nan,
            "status": OK if runs.any() else NO_RUNS,
            "converged": bool(runs.any()),
            "failed_replicates": int(np.isnan(again).any(axis=1).sum()),
            **percentile_columns(values, samples, options),
        }
        return columns | ({"probability_sample": again} if options.keep else {})

    def probabilities(self, sample: Sample, cells: Array, penalty: str) -> Array:
        falls, runs = falls_of(cells, outcomes_of(OVERTURNING, sample.levels.size))
        return np.array([isotonic_probabilities(sample.levels, k, n) for k, n in zip(falls, runs, strict=True)])


def _band(curve: Array, again: Array, runs: NDArray[np.int64], confidence: float) -> tuple[Array, Array]:
    """Pointwise percentiles of the replicates, widened where nothing or everything overturned and none can move."""
    if np.isnan(curve).any():
        return curve, curve
    lower, upper, _ = percentile_interval(again.T, confidence)
    low_end, high_end = binomial_interval(np.rint(curve * runs), runs, confidence)
    upper = np.where(curve == 0.0, np.fmax(upper, high_end), upper)
    lower = np.where(curve == 1.0, np.fmin(lower, low_end), lower)
    return np.minimum.accumulate(lower[::-1])[::-1], np.maximum.accumulate(upper)
