"""Fragility with certain safety below rocking: P(overturn) = P(uplift) P(overturn | uplift), two lognormal factors.

A rigid block does not move until the peak acceleration passes its threshold (`trials.rocking_thresholds`). The first
factor is then a step, of dispersion 0, known exactly, and the second is fitted to the levels above. If the threshold is
not known (an elastic zone at rest, another measure), the first factor is fitted to the uplifts, the second to the
uplifted runs. The likelihood of the curve is the product of the factors' likelihoods. Fractiles of the product then
have bootstrap intervals of the studentised estimate.

Kavvadias, I. E. et al. (2017), Eq. 10: a certain outcome combined with a lognormal one (cited; not re-read).
"""

import math
from typing import NamedTuple

import numpy as np
import scipy

from ...core.elementary import Array, Index, exp
from ..kernels import binomial as engine
from .bootstrap import studentised_interval
from .form import Columns, Form, log_likelihood_of
from .intervals import PROFILE, WALD, Ends, Estimate, LineFits, Options, ResampledData, estimate, unlogged
from .likelihood import FittedLines, data_of, fit_lines
from .links import LINKS, LOGNORMAL
from .states import NO_RUNS, NONE
from .trials import FAILURE, NO_RUN, ROCKED, STATES, STOOD, SURVIVAL, TOPPLED, UPLIFT_OUTCOMES, Sample, outcomes_of
from .two_parameter import median_bound_columns, parameter_columns

LOGNORMAL_LINK = LINKS[LOGNORMAL]
# Levels this near to a threshold are at it.
NEAR = 1e-9
# A level next to 0: no motion is weaker.
LOWEST = float(np.finfo(float).tiny)
BISECTIONS = 60
# An interval of a fractile has no end where the search gets further than this (in ln x) from the estimate.
FAR = 50.0


class UpliftStep(NamedTuple):
    """Step of uplift: its level, the levels between which it may lie, its number of parameters, and its status."""

    at: float
    lower: float
    upper: float
    parameters: int
    status: str


class UpliftForm(Form):
    """Lognormal or a step in uplift; lognormal in the overturning of runs that uplifted."""

    name = "uplift-lognormal"
    text = "P(x) = P(uplift) Phi(ln(x/median)/dispersion), the second factor of runs that uplifted"

    def fit(self, sample: Sample, options: Options, drawn: ResampledData | None) -> Columns:
        first = _step(sample) or estimate(LOGNORMAL_LINK, sample, _uplifts(sample), options, drawn)
        second = estimate(LOGNORMAL_LINK, sample, _outcomes(sample, first), options, drawn)
        whole = second.exists and (isinstance(first, UpliftStep) or first.exists)
        status = second.status if isinstance(first, UpliftStep) or first.exists else first.status
        if status == NO_RUNS and sample.cells.any():  # none that uplifted
            status = NONE
        columns: Columns = {
            **parameter_columns(second, "", options),
            "status": status,
            "penalised": second.penalised,
            "converged": whole,
            **median_bound_columns(sample, options),
        }
        if isinstance(first, UpliftStep):
            columns |= {**_step_columns(first, options), "uplift_status": first.status}
            parameters = 2 + first.parameters
        else:
            columns |= {**parameter_columns(first, "uplift_", options), "uplift_status": first.status}
            parameters = 4
        names = ("fractile", "fractile_lower", "fractile_upper")
        parts = [
            self._fractile(first, second, p, sample.gap, options) if whole else (math.nan,) * 3
            for p in options.fractiles
        ]
        columns |= {name: np.array([part[i] for part in parts]) for i, name in enumerate(names)}
        likelihood = math.nan
        if whole:
            curve = _product(first if isinstance(first, UpliftStep) else first.lines, second.lines, sample.levels)[0]
            likelihood = log_likelihood_of(curve, *sample.level_counts)
        return columns | {"log_likelihood": likelihood, "aic": 2.0 * parameters - 2.0 * likelihood}

    def probabilities(self, sample: Sample, cells: Array, penalty: str) -> Array:
        first, second = self._refit(sample, cells, penalty)
        return _product(first, second, sample.levels)

    def state_probabilities(self, sample: Sample, penalty: str) -> Array:
        first, second = self._refit(sample, sample.cells[None], penalty)
        chances = np.zeros((sample.levels.size, STATES))
        chances[:, TOPPLED] = _product(first, second, sample.levels)[0]
        if sample.uplift_known and isinstance(first, FittedLines):
            lifted = first.probability(sample.levels)[0]
            chances[:, ROCKED] = lifted - chances[:, TOPPLED]
        elif sample.uplift_known and isinstance(first, UpliftStep):
            chances[:, ROCKED] = (sample.levels >= first.at) - chances[:, TOPPLED]
        chances[:, STOOD] = 1.0 - chances[:, TOPPLED] - chances[:, ROCKED]
        return chances

    @staticmethod
    def _refit(sample: Sample, cells: Array, penalty: str) -> tuple[UpliftStep | FittedLines, FittedLines]:
        """Fit both factors to every replicate; a step does not move."""
        first = _step(sample) or fit_lines(LOGNORMAL_LINK, data_of(sample.levels, cells, _uplifts(sample)), penalty)
        return first, fit_lines(LOGNORMAL_LINK, data_of(sample.levels, cells, _outcomes(sample, first)), penalty)

    @staticmethod
    def _fractile(
        first: UpliftStep | Estimate, second: Estimate, p: float, gap: Ends | None, options: Options
    ) -> tuple[float, float, float]:
        """Return a fractile of the product and its interval, which contains the gap of separated data."""
        if isinstance(first, UpliftStep):
            ends = second.log_interval(p, options.intervals, options.confidence)
            value, lower, upper = (max(unlogged(log_value), first.at) for log_value in (second.log_value(p), *ends))
            return value, lower, upper
        value = float(log_fractile(first.lines, second.lines, p)[0])
        lower, upper = (unlogged(end) for end in _interval(first, second, p, value, options))
        if gap is not None:
            lower, upper = min(lower, gap[0]), max(upper, gap[1])
        return unlogged(value), lower, upper


def _interval(first: Estimate, second: Estimate, p: float, value: float, options: Options) -> Ends:
    if PROFILE in {first.interval_kind(options.intervals), second.interval_kind(options.intervals)}:
        return profile_interval(first, second, p, options.confidence)
    error = math.sqrt(log_fractile_variance(first.fits, second.fits, p)[0])
    if options.intervals == WALD:
        z = float(LOGNORMAL_LINK.quantile(0.5 + 0.5 * options.confidence))
        return value - z * error, value + z * error
    assert first.resampled is not None
    assert second.resampled is not None
    samples = log_fractile(first.resampled.lines, second.resampled.lines, p)
    errors = np.sqrt(log_fractile_variance(first.resampled, second.resampled, p))
    return studentised_interval(value, error, samples, errors, options.confidence)


def _step(sample: Sample) -> UpliftStep | None:
    """Return the step of uplift if the threshold is known and no run contradicts it, or if the flags form a step."""
    known = sample.threshold
    states = sample.cells.reshape(-1, STATES)
    still, lifted = states[:, STOOD], states[:, ROCKED:].sum(axis=1)
    if math.isfinite(known):
        below, above = sample.levels < known * (1.0 - NEAR), sample.levels > known * (1.0 + NEAR)
        if not lifted[below].any() and not (sample.uplift_known and still[above].any()):
            return UpliftStep(known, known, known, 0, "known step")
    if not sample.uplift_known:
        raise ValueError(
            "form 'uplift-lognormal' needs `uplifted` where the threshold of rocking is not known (it is for rigid "
            "rest and levels of pga or pga_normalised): add it to the outputs of the analysis"
        )
    if not still.any():  # a block moves at all levels: the step lies anywhere below them
        return UpliftStep(LOWEST, LOWEST, float(sample.levels[0]), 0, "all uplifted")
    last, first = np.flatnonzero(still)[-1], np.flatnonzero(lifted)
    if first.size and last < first[0]:
        lower, upper = float(sample.levels[last]), float(sample.levels[first[0]])
        return UpliftStep(math.sqrt(lower * upper), lower, upper, 1, "step between levels")
    return None


def _uplifts(sample: Sample) -> Index:
    return outcomes_of(UPLIFT_OUTCOMES, sample.levels.size)


def _outcomes(sample: Sample, first: UpliftStep | Estimate | FittedLines) -> Index:
    """Return the outcome of each cell in the fit of the second factor: no run if the block did not uplift."""
    outcomes = outcomes_of((NO_RUN if sample.uplift_known else SURVIVAL, SURVIVAL, FAILURE), sample.levels.size)
    if isinstance(first, UpliftStep):
        outcomes = np.where(np.repeat(sample.levels <= first.at * (1.0 + NEAR), STATES), NO_RUN, outcomes)
    return outcomes


def _product(first: UpliftStep | FittedLines, second: FittedLines, levels: Array) -> Array:
    if isinstance(first, UpliftStep):
        return np.where(levels >= first.at, second.probability(levels), 0.0)
    return first.probability(levels) * second.probability(levels)


def _step_columns(step: UpliftStep, options: Options) -> Columns:
    columns: Columns = {
        "uplift_median": step.at,
        "uplift_median_se": 0.0 if step.lower == step.upper else math.nan,
        "uplift_median_lower": step.lower,
        "uplift_median_upper": step.upper,
        **{f"uplift_dispersion{end}": 0.0 for end in ("", "_se", "_lower", "_upper")},
    }
    if options.keep:
        columns["uplift_median_sample"] = np.full(options.replicates, step.at)
        columns["uplift_dispersion_sample"] = np.zeros(options.replicates)
    return columns


def log_fractile(first: FittedLines, second: FittedLines, p: float) -> Array:
    """Return ln x at which products of lognormal curves pass p, (replicate,)."""
    # not before either factor passes p, nor after both pass its root
    low = np.maximum(first.log_values(p), second.log_values(p))
    high = np.maximum(first.log_values(math.sqrt(p)), second.log_values(math.sqrt(p)))
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        below = scipy.special.ndtr(_eta(first, middle)) * scipy.special.ndtr(_eta(second, middle)) < p
        low, high = np.where(below, middle, low), np.where(below, high, middle)
    return 0.5 * (low + high)


def log_fractile_variance(first: LineFits, second: LineFits, p: float, plain: bool = False) -> Array:
    """Return the variance of `log_fractile`, (replicate,), to first order.

    The errors of the two lines are assumed to be independent of each other. `plain`: as if runs were independent.
    """
    at = log_fractile(first.lines, second.lines, p)
    variance = np.zeros_like(at)
    slope = np.zeros_like(at)
    for fits in (first, second):
        lines, covariance = fits.lines, fits.plain if plain else fits.covariance
        z = (at - lines.centre) / lines.width
        eta = lines.a + lines.b * z
        hazard = exp(-0.5 * eta**2 - 0.5 * math.log(2.0 * math.pi) - scipy.special.log_ndtr(eta))
        aa, ab, bb = covariance.T
        variance += hazard**2 * (aa + 2.0 * z * ab + z**2 * bb)
        slope += hazard * lines.b / lines.width
    return variance / slope**2


def profile_interval(first: Estimate, second: Estimate, p: float, confidence: float) -> Ends:
    """Profile-likelihood interval of ln x of a fractile: twice the drop of the profile is the chi-square quantile.

    If motions are repeated, the quantile is multiplied by the ratio of the variance to the variance of independent runs
    (at least 1).
    """
    best = float(log_fractile(first.lines, second.lines, p)[0])
    variances = (log_fractile_variance(first.fits, second.fits, p, plain)[0] for plain in (False, True))
    drop = 0.5 * float(scipy.special.chdtri(1.0, 1.0 - confidence)) * max(next(variances) / next(variances), 1.0)
    top = _value(first) + _value(second)

    def excess(t: float) -> float:
        """Return the drop of the profile log-likelihood at t less the drop that is allowed."""
        scratch = (_scratch(first), _scratch(second))

        def loss(share: float) -> float:
            # the first factor's part of p on the scale of its eta: from p itself (the second factor is 1) to 1
            eta = float(scipy.special.ndtri(p)) + math.exp(share)
            rest = float(scipy.special.ndtri(min(p / float(scipy.special.ndtr(eta)), 1.0)))
            if not math.isfinite(rest):
                return math.inf
            return -(_profile(first, t, eta, scratch[0]) + _profile(second, t, rest, scratch[1]))

        guess = math.log(max(float(_eta(first.lines, np.array([t]))[0] - scipy.special.ndtri(p)), 1e-3))
        optimum = scipy.optimize.minimize_scalar(loss, bracket=(guess - 0.5, guess + 0.5), tol=1e-10)
        return float(top + optimum.fun - drop)

    ends = []
    for side in (-1.0, 1.0):
        step, inner = 0.1, best
        while excess(inner + side * step) < 0.0 and abs(inner - best) < FAR:
            inner += side * step
            step *= 1.6
        outer = inner + side * step
        if abs(inner - best) >= FAR:
            ends.append(side * math.inf)
        else:
            ends.append(float(scipy.optimize.brentq(excess, inner, outer, xtol=1e-11)))
    return ends[0], ends[1]


def _eta(lines: FittedLines, log_x: Array) -> Array:
    return lines.a + lines.b * (log_x - lines.centre) / lines.width


def _scratch(factor: Estimate) -> Array:
    return np.zeros((engine.SCRATCH, factor.fits.data.z.size))


def _value(factor: Estimate) -> float:
    kind, link, *data = factor.arguments
    return float(engine.evaluate(kind, link, factor.lines.a[0], factor.lines.b[0], *data, _scratch(factor))[0])


def _profile(factor: Estimate, t: float, eta: float, scratch: Array) -> float:
    """Return the largest log-likelihood of a factor whose line passes eta at ln x = t."""
    at, guess = (t - factor.lines.centre) / factor.lines.width, factor.lines.b[0]
    return float(engine.profile(*factor.arguments, engine.FRACTILE, eta, at, guess, engine.PRECISE, scratch)[0])
