"""Monotone fragility curves without a parametric form: isotonic regression of the observed fractions.

Ayer, M., Brunk, H. D., Ewing, G. M., Reid, W. T. and Silverman, E. (1955). An empirical distribution function for
sampling with incomplete information. Annals of Mathematical Statistics 26, 641-647.
"""

import numpy as np
import scipy

from ...core.elementary import Array, exp, log
from ..numerics.proportions import binomial_interval
from .bootstrap import percentile_interval
from .form import Columns, Form, log_likelihood_of, percentile_columns
from .intervals import BOOTSTRAP, Options, ResampledData
from .states import NO_RUNS, OK
from .trials import Sample


def isotonic_probabilities(levels: Array, overturnings: Array, runs: Array) -> Array:
    """Return the non-decreasing probabilities (level,) of maximum binomial likelihood.

    At levels without runs they are linear in ln x between the neighbours, and constant outside; NaN without any runs.
    """
    used = runs > 0
    if not used.any():
        return np.full(levels.size, np.nan)
    fitted = np.asarray(scipy.optimize.isotonic_regression(overturnings[used] / runs[used], weights=runs[used]).x)
    return fitted if used.all() else np.interp(log(levels), log(levels[used]), fitted)


def crossings(levels: Array, probabilities: Array, p: float) -> Array:
    """Levels at which curves (replicate, level), linear in ln x, first reach p: 0 below the levels, inf above."""
    reached = probabilities >= p
    first = reached.argmax(axis=1)
    last = np.maximum(first - 1, 0)
    rows = np.arange(probabilities.shape[0])
    at, before = probabilities[rows, first], probabilities[rows, last]
    x = log(levels)
    with np.errstate(divide="ignore", invalid="ignore"):
        inside = exp(x[last] + (p - before) / (at - before) * (x[first] - x[last]))
    levels_of_p = np.where(first > 0, inside, np.where(at == p, levels[0], 0.0))
    return np.where(np.isnan(probabilities).any(axis=1), np.nan, np.where(reached.any(axis=1), levels_of_p, np.inf))


class IsotonicForm(Form):
    """P(x) non-decreasing, without parameters."""

    name = "isotonic"
    text = "isotonic regression (pool adjacent violators, weighted by runs)"
    intervals = (BOOTSTRAP,)

    def fit(self, sample: Sample, options: Options, drawn: ResampledData | None) -> Columns:
        assert drawn is not None
        overturnings, runs = sample.level_counts
        curve = isotonic_probabilities(sample.levels, overturnings.astype(float), runs.astype(float))
        again = self.probabilities(sample, drawn.cells, options.penalty)
        lower, upper = _band(curve, again, runs / sample.ways, options.confidence)
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
            **percentile_columns(sample, values, samples, options),
        }
        return columns | ({"probability_sample": again} if options.keep else {})

    def probabilities(self, sample: Sample, cells: Array, penalty: str) -> Array:
        overturnings, runs = sample.counts_in(cells)
        return np.array([isotonic_probabilities(sample.levels, k, n) for k, n in zip(overturnings, runs, strict=True)])


def _band(curve: Array, again: Array, motions: Array, confidence: float) -> tuple[Array, Array]:
    """Pointwise percentiles of the replicates, widened by binomial intervals if no run overturned, or all did."""
    if np.isnan(curve).any():
        return curve, curve
    lower, upper, _ = percentile_interval(again.T, confidence)
    low_end, high_end = binomial_interval(np.rint(curve * motions), motions, confidence)
    upper = np.where(curve == 0.0, np.fmax(upper, high_end), upper)
    lower = np.where(curve == 1.0, np.fmin(lower, low_end), lower)
    return np.minimum.accumulate(lower[::-1])[::-1], np.maximum.accumulate(upper)
