"""A lognormal curve of counts as plain numbers, which tests compare fits of other data with."""

import math
from typing import NamedTuple

import numpy as np

from toppling.fragility.fitting.intervals import WALD, Options, estimate
from toppling.fragility.fitting.links import LINKS, LOGNORMAL
from toppling.fragility.fitting.trials import OVERTURNING_OUTCOMES, STATES, Sample, outcomes_of


class LognormalFit(NamedTuple):
    """Median, dispersion, the standard error of ln(median), log-likelihood and status; NaN without an estimate."""

    median: float = math.nan
    dispersion: float = math.nan
    log_median_se: float = math.nan
    log_likelihood: float = math.nan
    status: str = "ok"


def fit_lognormal(levels, overturnings, runs, penalty="none"):
    """Fit P(x) = Phi(ln(x/median)/dispersion) to overturnings of runs, arrays (level,)."""
    distinct, where = np.unique(levels, return_inverse=True)
    cells = np.zeros((distinct.size, STATES))
    np.add.at(cells[:, -1], where, overturnings)
    np.add.at(cells[:, 0], where, np.asarray(runs) - overturnings)
    sample = Sample(distinct, cells.ravel(), False, math.nan, False, False, None)
    options = Options(0.95, WALD, (), penalty, 0, 0, False)
    line = estimate(LINKS[LOGNORMAL], sample, outcomes_of(OVERTURNING_OUTCOMES, distinct.size), options, None)
    likelihood = float(line.lines.log_likelihood[0])
    if not line.exists:
        return LognormalFit(log_likelihood=likelihood, status=line.status)
    dispersion = math.exp(line.log_value(None))
    return LognormalFit(math.exp(line.log_value(0.5)), dispersion, line.log_error(0.5), likelihood, line.status)
