"""Fragility with certain safety below rocking: P(overturn) = P(uplift) P(overturn | uplift), two lognormal factors.

A rigid block stands still until the peak acceleration passes its threshold (`thresholds`): the first factor is then a
step, of dispersion 0, known exactly, and the second is fitted to the levels above.  Where the threshold is not known
(an elastic zone at rest, another measure), the first factor is fitted to the uplifts, the second to the runs that
uplifted: the likelihood of both is the product of their own.  Fractiles of the product then have bootstrap intervals
of the studentised estimate.

References
----------
Kavvadias, I. E. et al. (2017), Eq. 10: a certain outcome beside a lognormal one (cited; not re-read).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from . import mixture
from .bootstrap import studentised_interval
from .estimation import PROFILE, WALD, Ends, Estimate, Options, Resampled, estimate, unlogged
from .form import Columns, Form, log_likelihood_of
from .likelihood import Lines, data_of, fit_lines
from .links import LINKS
from .statuses import NO_RUNS, NONE
from .trials import FELL, NO_RUN, OVERTURNED, STATES, STOOD, SURVIVED, UPLIFTED, Index, Sample, outcomes_of
from .two_parameter import bound_of, columns_of

Array = NDArray[np.float64]
LOGNORMAL = LINKS["lognormal"]
# Levels this near to a threshold are at it.
NEAR = 1e-9
# A level next to 0, below which no motion is.
NOTHING = float(np.finfo(float).tiny)


class Step(NamedTuple):
    """Uplift at one level: where, between which levels it may lie, how many parameters it took, how it was found."""

    at: float
    lower: float
    upper: float
    parameters: int
    how: str


class UpliftForm(Form):
    """Lognormal, or a step, in uplift; lognormal in overturning of what uplifted."""

    name = "uplift-lognormal"
    text = "P(x) = P(uplift) Phi(ln(x/median)/dispersion), the second factor of runs that uplifted"

    def fit(self, sample: Sample, options: Options, drawn: Resampled | None) -> Columns:
        first = _step(sample) or estimate(LOGNORMAL, sample, _uplifts(sample), options, drawn)
        found = estimate(LOGNORMAL, sample, _outcomes(sample, first), options, drawn)
        whole = found.found and (isinstance(first, Step) or first.found)
        status = found.status if isinstance(first, Step) or first.found else first.status
        if status == NO_RUNS and sample.cells.any():  # none that uplifted
            status = NONE
        columns: Columns = {
            **columns_of(found, "", options),
            "status": status,
            "penalised": found.penalised,
            "converged": whole,
            **bound_of(sample, options),
        }
        if isinstance(first, Step):
            columns |= {**_step_columns(first, options), "uplift_status": first.how}
            parameters = 2 + first.parameters
        else:
            columns |= {**columns_of(first, "uplift_", options), "uplift_status": first.status}
            parameters = 4
        names = ("fractile", "fractile_lower", "fractile_upper")
        parts = [self._fractile(first, found, p, options) if whole else (math.nan,) * 3 for p in options.fractiles]
        columns |= {name: np.array([part[i] for part in parts]) for i, name in enumerate(names)}
        likelihood = math.nan
        if whole:
            curve = _product(first if isinstance(first, Step) else first.lines, found.lines, sample.levels)[0]
            likelihood = log_likelihood_of(curve, *sample.of_levels)
        return columns | {"log_likelihood": likelihood, "aic": 2.0 * parameters - 2.0 * likelihood}

    def probabilities(self, sample: Sample, cells: Array, penalty: str) -> Array:
        first, second = self._refit(sample, cells, penalty)
        return _product(first, second, sample.levels)

    def chances(self, sample: Sample, penalty: str) -> Array:
        first, second = self._refit(sample, sample.cells[None], penalty)
        found = np.zeros((sample.levels.size, STATES))
        found[:, OVERTURNED] = _product(first, second, sample.levels)[0]
        if sample.lifts and isinstance(first, Lines):
            lifted = first.probability(sample.levels)[0]
            found[:, UPLIFTED] = lifted - found[:, OVERTURNED]
        elif sample.lifts and isinstance(first, Step):
            found[:, UPLIFTED] = (sample.levels >= first.at) - found[:, OVERTURNED]
        found[:, STOOD] = 1.0 - found[:, OVERTURNED] - found[:, UPLIFTED]
        return found

    @staticmethod
    def _refit(sample: Sample, cells: Array, penalty: str) -> tuple[Step | Lines, Lines]:
        """Both factors of every replicate; a step stays where it is."""
        first = _step(sample) or fit_lines(LOGNORMAL, data_of(sample.levels, cells, _uplifts(sample)), penalty)
        return first, fit_lines(LOGNORMAL, data_of(sample.levels, cells, _outcomes(sample, first)), penalty)

    @staticmethod
    def _fractile(first: Step | Estimate, second: Estimate, p: float, options: Options) -> tuple[float, float, float]:
        """A fractile of the product and its interval."""
        if isinstance(first, Step):
            ends = second.log_interval(p, options.intervals, options.confidence)
            value, lower, upper = (max(unlogged(one), first.at) for one in (second.log_value(p), *ends))
            return value, lower, upper
        value = float(mixture.log_fractile(first.lines, second.lines, p)[0])
        ends = _interval(first, second, p, value, options)
        return unlogged(value), unlogged(ends[0]), unlogged(ends[1])


def _interval(first: Estimate, second: Estimate, p: float, value: float, options: Options) -> Ends:
    if PROFILE in {first.kind(options.intervals), second.kind(options.intervals)}:
        return mixture.profile_interval(first, second, p, options.confidence)
    error = math.sqrt(mixture.log_fractile_variance(first.fits, second.fits, p)[0])
    if options.intervals == WALD:
        z = float(LOGNORMAL.quantile(0.5 + 0.5 * options.confidence))
        return value - z * error, value + z * error
    assert first.again is not None
    assert second.again is not None
    samples = mixture.log_fractile(first.again.lines, second.again.lines, p)
    errors = np.sqrt(mixture.log_fractile_variance(first.again, second.again, p))
    return studentised_interval(value, error, samples, errors, options.confidence)


def _step(sample: Sample) -> Step | None:
    """The step of uplift, where the threshold is known and no run contradicts it, or where the flags have one."""
    known = sample.threshold
    states = sample.cells.reshape(-1, STATES)
    still, lifted = states[:, STOOD], states[:, UPLIFTED:].sum(axis=1)
    if math.isfinite(known):
        below, above = sample.levels < known * (1.0 - NEAR), sample.levels > known * (1.0 + NEAR)
        if not lifted[below].any() and not (sample.lifts and still[above].any()):
            return Step(known, known, known, 0, "known step")
    if not sample.lifts:
        raise ValueError(
            "form 'uplift-lognormal' needs `uplifted` where the threshold of rocking is not known (it is for rigid "
            "rest and levels of pga or pga_normalised): add it to the outputs of the analysis"
        )
    if not still.any():  # no level so low that a block stands still: nothing says where it would
        return Step(NOTHING, NOTHING, float(sample.levels[0]), 0, "all uplifted")
    last, first = np.flatnonzero(still)[-1], np.flatnonzero(lifted)
    if first.size and last < first[0]:
        lower, upper = float(sample.levels[last]), float(sample.levels[first[0]])
        return Step(math.sqrt(lower * upper), lower, upper, 1, "step between levels")
    return None


def _uplifts(sample: Sample) -> Index:
    return outcomes_of((SURVIVED, FELL, FELL), sample.levels.size)


def _outcomes(sample: Sample, first: Step | Estimate | Lines) -> Index:
    """What cells are to the second factor: no run of its, where the block did not uplift."""
    outcomes = outcomes_of((NO_RUN if sample.lifts else SURVIVED, SURVIVED, FELL), sample.levels.size)
    if isinstance(first, Step):
        outcomes = np.where(np.repeat(sample.levels <= first.at * (1.0 + NEAR), STATES), NO_RUN, outcomes)
    return outcomes


def _product(first: Step | Lines, second: Lines, levels: Array) -> Array:
    if isinstance(first, Step):
        return np.where(levels >= first.at, second.probability(levels), 0.0)
    return first.probability(levels) * second.probability(levels)


def _step_columns(step: Step, options: Options) -> Columns:
    columns: Columns = {
        "uplift_median": step.at,
        "uplift_median_se": 0.0 if step.lower == step.upper else math.nan,
        "uplift_median_lower": step.lower,
        "uplift_median_upper": step.upper,
        "uplift_dispersion": 0.0,
        "uplift_dispersion_se": 0.0,
        "uplift_dispersion_lower": 0.0,
        "uplift_dispersion_upper": 0.0,
    }
    if options.keep:
        columns["uplift_median_sample"] = np.full(options.replicates, step.at)
        columns["uplift_dispersion_sample"] = np.zeros(options.replicates)
    return columns
