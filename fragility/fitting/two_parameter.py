"""Lognormal, log-logistic and Weibull curves: two parameters, by maximum likelihood."""

import math

import numpy as np

from ...core.elementary import Array, Flags, Index, exp
from .form import Columns, Form
from .intervals import Estimate, Options, ResampledData, estimate, median_bound, unlogged
from .likelihood import FittedLines, data_of, fit_lines
from .links import LINKS, Link
from .trials import OVERTURNING_OUTCOMES, Sample, outcomes_of


class TwoParameterForm(Form):
    """P(x) = F(a + b ln x) for one link F."""

    methods = ("binomial", "first-overturning")

    def __init__(self, link: Link) -> None:
        self.link = link
        self.name = link.name
        self.text = f"P(x) = {link.text}"

    def fit(self, sample: Sample, options: Options, drawn: ResampledData | None) -> Columns:
        line = estimate(self.link, sample, _outcomes(sample), options, drawn)
        likelihood = float(line.lines.log_likelihood[0])
        columns: Columns = {
            **parameter_columns(line, "", options),
            **fractile_columns(line, options),
            "log_likelihood": likelihood,
            "aic": 4.0 - 2.0 * likelihood if line.exists else math.nan,
            "status": line.status,
            "penalised": line.penalised,
            "converged": line.exists,
        }
        return columns | median_bound_columns(sample, options)

    def probabilities(self, sample: Sample, cells: Array, penalty: str) -> Array:
        data = data_of(sample.levels, cells, _outcomes(sample))
        return fit_lines(self.link, data, penalty).probability(sample.levels)


def _outcomes(sample: Sample) -> Index | None:
    return None if sample.by_interval else outcomes_of(OVERTURNING_OUTCOMES, sample.levels.size)


def parameter_columns(line: Estimate, prefix: str, options: Options) -> Columns:
    """Columns of median and dispersion with standard errors, intervals and replicates; names begin with `prefix`."""
    columns: Columns = {}
    lost = np.zeros(0) if line.resampled is None else _without_curve(line.resampled.lines)
    for name, p in (("median", 0.5), ("dispersion", None)):
        lower, upper = line.log_interval(p, options.intervals, options.confidence)
        value = unlogged(line.log_value(p))
        columns |= {
            f"{prefix}{name}": value,
            f"{prefix}{name}_se": value * line.log_error(p),
            f"{prefix}{name}_lower": unlogged(lower),
            f"{prefix}{name}_upper": unlogged(upper),
        }
        if options.keep and line.resampled is not None:
            columns[f"{prefix}{name}_sample"] = exp(np.where(lost, np.nan, line.resampled.lines.log_values(p)))
    if line.resampled is not None:
        columns[f"{prefix}penalised_replicates"] = int(line.resampled.lines.penalised.sum())
        columns[f"{prefix}failed_replicates"] = int(lost.sum())
    return columns


def _without_curve(lines: FittedLines) -> Flags:
    """True for replicates without a curve: no maximum, or one without a finite median or dispersion."""
    median, dispersion = (exp(lines.log_values(p)) for p in (0.5, None))
    return ~(np.isfinite(median) & (median > 0.0) & np.isfinite(dispersion))


def fractile_columns(line: Estimate, options: Options) -> Columns:
    """Columns of the fractiles with their intervals, each (fraction,)."""
    ends = [line.log_interval(p, options.intervals, options.confidence) for p in options.fractiles]
    return {
        "fractile": np.array([unlogged(line.log_value(p)) for p in options.fractiles]),
        "fractile_lower": np.array([unlogged(lower) for lower, _ in ends]),
        "fractile_upper": np.array([unlogged(upper) for _, upper in ends]),
    }


def median_bound_columns(sample: Sample, options: Options) -> Columns:
    """Columns with the one-sided bound of the median if no run overturned, or all did; empty elsewhere."""
    lower, upper = median_bound(sample, options.confidence)
    return {} if math.isnan(lower) else {"median_lower": lower, "median_upper": upper}


TWO_PARAMETER_FORMS = {name: TwoParameterForm(link) for name, link in LINKS.items()}
