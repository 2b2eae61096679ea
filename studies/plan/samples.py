"""Estimates from samples x motions of one uncertain block: curves of each sample and of all, rates, variance shares."""

from __future__ import annotations

import warnings

import xarray as xr

from ...core.units import DIMENSIONLESS, PER_YEAR
from ...core.wording import years_text
from ...fragility import capacity_variance_shares, fit_fragility, overturning_probability, variance_shares
from ...fragility.fitting.intervals import WALD
from ...fragility.hazard.rates import probability_in
from ...fragility.numerics.slabs import gathered
from .estimates import Fit
from .risk import Risk

QUANTILES = (0.05, 0.5, 0.95)
FACTORS = ("motion", "model", "sample")
NO_CAPACITY = "no_capacity_shares"
"""Attribute that holds the reason why capacities are not known."""


def summary(runs: xr.Dataset, fit: Fit) -> xr.Dataset:
    """Compute probabilities with their spread over samples, and shares of the variance of flags and capacities."""
    probability = overturning_probability(runs, fit.confidence)["probability"]
    alone = [dim for dim in FACTORS if runs.sizes[dim] == 1]
    told = [dim for dim in FACTORS if dim not in alone]
    flags = gathered(lambda part: variance_shares(part["overturned"].squeeze(alone), told), runs, ("level",))
    dataset = xr.Dataset(
        {
            "probability": probability.mean("sample").assign_attrs(
                units=DIMENSIONLESS, long_name="probability of overturning, inputs uncertain"
            ),
            "probability_quantile": _quantiles(probability, DIMENSIONLESS, "probability"),
            "sample_probability": probability,
            "flag_share": flags["share"],
            "flag_total_share": flags["total_share"],
        }
    )
    try:
        capacity = capacity_variance_shares(runs.squeeze(alone), flags["factor"].values.tolist())
    except ValueError as error:
        return dataset.assign_attrs({NO_CAPACITY: str(error)})
    keep = ("share", "total_share", "total_variance", "share_known", "rounding_share", "motions_used")
    return dataset.assign({f"capacity_{name}": capacity[name] for name in keep})


def fitted(runs: xr.Dataset, fit: Fit) -> xr.Dataset:
    """Fit the curve of every sample: median and dispersion on (model, sample)."""
    data = runs if fit.method != "binomial" else overturning_probability(runs, fit.confidence)
    found = gathered(
        lambda part: fit_fragility(part, form=fit.form, method=fit.method, penalty=fit.penalty, intervals=WALD),
        data,
        ("model", "sample"),
    )
    names = {"median": "median of each sample", "dispersion": "dispersion of each sample"}
    return found[list(names)].assign({name: found[name].assign_attrs(long_name=text) for name, text in names.items()})


def pooled_curves(runs: xr.Dataset, fit: Fit, keep: bool) -> xr.Dataset:
    """Fit the curve of all samples, each a run of its motion, on model; with its replicates where `keep` is set."""
    of_one = runs[["overturned"]].drop_vars([name for name, one in runs.coords.items() if "sample" in one.dims])
    return fit.curves(of_one, replicates=keep, together=("sample",))


def yearly(
    risk: Risk,
    pooled: xr.Dataset,
    own: xr.Dataset,
    highest: xr.DataArray | float,
    lowest: xr.DataArray | float,
    confidence: float,
) -> xr.Dataset:
    """Compute rates of all samples (`pooled`) and each (`own`); chances in years are means of 1 - exp(-rate years)."""
    each = risk.rates(own, confidence)["rate"]
    text = "annual rate of overturning"
    chance = each.copy(data=probability_in(each.values, risk.years))
    found = {
        "sample_rate": each.assign_attrs(units=PER_YEAR, long_name=f"{text} of each sample"),
        "sample_rate_mean": each.mean("sample").assign_attrs(
            units=PER_YEAR, long_name=f"mean over samples of the {text}"
        ),
        "sample_rate_quantile": _quantiles(each, PER_YEAR, text),
        "sample_risk_probability_mean": chance.mean("sample").assign_attrs(
            units=DIMENSIONLESS,
            long_name=f"mean over samples of the probability of overturning in {years_text(risk.years)}",
        ),
    }
    return risk.of(pooled, confidence, highest, lowest=lowest).assign(found)


def _quantiles(values: xr.DataArray, units: str, text: str) -> xr.DataArray:
    with warnings.catch_warnings():  # where no sample has a value there is none
        warnings.filterwarnings("ignore", "All-NaN", RuntimeWarning)
        found = values.quantile(list(QUANTILES), "sample")
    found = found.assign_attrs(units=units, long_name=f"quantile over samples of the {text}")
    found["quantile"] = found["quantile"].assign_attrs(units=DIMENSIONLESS, long_name="probability of the quantile")
    return found
