"""Lognormal, log-logistic and Weibull curves: two parameters, by maximum likelihood."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from .estimation import Estimate, Fits, Options, Resampled, estimate, median_bound, unlogged
from .form import OVERTURNING, Columns, Form
from .likelihood import data_of, fit_lines
from .links import LINKS, Link
from .trials import Index, Sample, outcomes_of

Array = NDArray[np.float64]


class TwoParameterForm(Form):
    """P(x) = F(a + b ln x) for one link F."""

    methods = ("binomial", "first-overturning")

    def __init__(self, link: Link) -> None:
        self.link = link
        self.name = link.name
        self.text = f"P(x) = {link.text}"

    def fit(self, sample: Sample, options: Options, drawn: Resampled | None) -> Columns:
        found = estimate(self.link, sample, _outcomes(sample), options, drawn)
        likelihood = float(found.lines.log_likelihood[0])
        columns: Columns = {
            **columns_of(found, "", options),
            **fractiles_of(found, options),
            "log_likelihood": likelihood,
            "aic": 4.0 - 2.0 * likelihood if found.found else math.nan,
            "status": found.status,
            "penalised": found.penalised,
            "converged": found.found,
        }
        return columns | bound_of(sample, options)

    def probabilities(self, sample: Sample, cells: Array, penalty: str) -> Array:
        data = data_of(sample.levels, cells, _outcomes(sample))
        return fit_lines(self.link, data, penalty).probability(sample.levels)


def _outcomes(sample: Sample) -> Index | None:
    return None if sample.first else outcomes_of(OVERTURNING, sample.levels.size)


def columns_of(found: Estimate, prefix: str, options: Options) -> Columns:
    """Median and dispersion with errors, intervals and replicates, under names that begin with `prefix`."""
    columns: Columns = {}
    lost = np.zeros(0) if found.again is None else _lost(found.again)
    for name, p in (("median", 0.5), ("dispersion", None)):
        lower, upper = found.log_interval(p, options.intervals, options.confidence)
        value = unlogged(found.log_value(p))
        columns |= {
            f"{prefix}{name}": value,
            f"{prefix}{name}_se": value * found.log_error(p),
            f"{prefix}{name}_lower": unlogged(lower),
            f"{prefix}{name}_upper": unlogged(upper),
        }
        if options.keep and found.again is not None:
            columns[f"{prefix}{name}_sample"] = np.exp(np.where(lost, np.nan, found.again.log_values(p)))
    if found.again is not None:
        columns[f"{prefix}penalised_replicates"] = int(found.again.lines.penalised.sum())
        columns[f"{prefix}failed_replicates"] = int(lost.sum())
    return columns


def _lost(again: Fits) -> NDArray[np.bool_]:
    """Which replicates have no curve: no maximum, or one so flat that no float holds its median or dispersion."""
    with np.errstate(over="ignore", under="ignore"):
        median, dispersion = np.exp(again.log_values(0.5)), np.exp(again.log_values(None))
    return ~(np.isfinite(median) & (median > 0.0) & np.isfinite(dispersion))


def fractiles_of(found: Estimate, options: Options) -> Columns:
    """The fractiles with their intervals, each (fraction,)."""
    ends = [found.log_interval(p, options.intervals, options.confidence) for p in options.fractiles]
    return {
        "fractile": np.array([unlogged(found.log_value(p)) for p in options.fractiles]),
        "fractile_lower": np.array([unlogged(lower) for lower, _ in ends]),
        "fractile_upper": np.array([unlogged(upper) for _, upper in ends]),
    }


def bound_of(sample: Sample, options: Options) -> Columns:
    """What is known of the median where nothing overturned, or everything."""
    lower, upper = median_bound(sample, options.confidence)
    return {} if math.isnan(lower) else {"median_lower": lower, "median_upper": upper}


TWO_PARAMETER_FORMS = {name: TwoParameterForm(link) for name, link in LINKS.items()}
