"""Units and long names of the results of fits, and their dataset."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ...core.units import DIMENSIONLESS, ENDS, described, of_end
from .intervals import Options
from .trials import Trials

LEVEL = "unit of the level"
"""Placeholder for the unit of the levels."""
OBSERVED = "observed_probability"
"""Shares of the runs that overturned at the levels of curves that have these in common."""

_PARAMETERS = {
    "half_level": (LEVEL, "level at which half overturn"),
    "fraction_level": (LEVEL, "level at which the fraction overturns"),
    "median": (LEVEL, "median of the fitted curve"),
    "dispersion": (DIMENSIONLESS, "lognormal standard deviation of the fitted curve"),
    "uplift_median": (LEVEL, "median level of uplift"),
    "uplift_dispersion": (DIMENSIONLESS, "lognormal standard deviation of uplift, 0 for a step"),
    "fractile": (LEVEL, "level at which the fitted probability of overturning is the fraction"),
    "probability": (DIMENSIONLESS, "fitted probability of overturning"),
    OBSERVED: (DIMENSIONLESS, "share of the runs that overturned"),
}
_OTHERS = {
    "misfit": (DIMENSIONLESS, "median of the fitted curve over half_level, less 1; 0 within the interval"),
    "misfit_low": (DIMENSIONLESS, "fitted 10 % level over the 10 % level of the runs, less 1; 0 within the interval"),
    "log_likelihood": (DIMENSIONLESS, "log-likelihood without its constant and without penalty"),
    "aic": (DIMENSIONLESS, "Akaike's information criterion"),
    "converged": (DIMENSIONLESS, "whether there is an estimate"),
    "penalised": (DIMENSIONLESS, "whether the estimate is of the penalised likelihood"),
    "status": (DIMENSIONLESS, "ok, separated (penalised), or why there is no estimate"),
    "uplift_status": (DIMENSIONLESS, "known step, step between levels, all uplifted, or the status of a fitted uplift"),
    "penalised_replicates": (DIMENSIONLESS, "replicates of the penalised likelihood, their data being separated"),
    "failed_replicates": (DIMENSIONLESS, "replicates without a curve"),
    "uplift_penalised_replicates": (DIMENSIONLESS, "replicates of uplift of the penalised likelihood"),
    "uplift_failed_replicates": (DIMENSIONLESS, "replicates without a curve of uplift"),
}
_SUFFIXES = {"_se": "standard error of", "_sample": "bootstrap replicates of"}
# Last dimension of results that are arrays.
_DIMENSIONS = {"fractile": "fraction", "fraction_level": "fraction", "probability": "level", OBSERVED: "level"}


def label_curves(columns: Sequence[dict[str, Any]], trials: Trials, options: Options) -> xr.Dataset:
    """Return the results of all curves as one dataset on their dimensions; NaN if a curve lacks a variable."""
    names = dict.fromkeys(name for column in columns for name in column)
    coords: dict[Any, Any] = dict(trials.coords)
    if options.fractiles:
        attributes = described("probability of overturning")
        coords["fraction"] = xr.Variable("fraction", list(options.fractiles), attributes)
    levels = trials.samples[0].levels if trials.samples else np.empty(0)
    apart = any(not np.array_equal(sample.levels, levels) for sample in trials.samples)
    if apart or any(OBSERVED not in of_curve for of_curve in columns):
        names.pop(OBSERVED, None)
    if any(_DIMENSIONS.get(name) == "level" for name in names):
        if apart:
            raise ValueError(
                "curves without parameters lie on the levels of the data, which differ between blocks here: "
                "fit one block at a time"
            )
        coords["level"] = xr.Variable("level", levels, {key: value for key, value in trials.level.items() if value})
    if any(name.endswith("_sample") for name in names):
        attributes = described("replicate of the bootstrap")
        coords["replicate"] = xr.Variable("replicate", np.arange(options.replicates), attributes)
    variables = {}
    for name in names:
        suffix = next((suffix for suffix in (*ENDS[1:], *_SUFFIXES) if name.endswith(suffix)), "")
        base = name.removesuffix(suffix)
        units, long_name = _OTHERS.get(name) or _PARAMETERS.get(base) or (DIMENSIONLESS, f"{base} of the fit")
        if base in ("median", "dispersion") and "uplift_median" in names:  # (factors of the curve)
            long_name = long_name.replace("the fitted curve", "the curve of what uplifted")
        dims = list(trials.dims)
        if name.endswith("_sample"):
            dims.append("replicate")
        if base in _DIMENSIONS:
            dims.append(_DIMENSIONS[base])
        if _DIMENSIONS.get(base) == "fraction" and not options.fractiles:
            continue
        values = _column([column.get(name) for column in columns], trials.shape)
        if _DIMENSIONS.get(base) == "level":
            values = values[..., : coords["level"].size]
        if units == LEVEL:
            units, long_name = trials.level["units"], f"{long_name}: {trials.level['long_name']}"
        text = (
            f"{_SUFFIXES[suffix]}: {long_name}"
            if suffix in _SUFFIXES
            else of_end(suffix, long_name, options.confidence)
        )
        variables[name] = (tuple(dims), values, described(text, units))
    return xr.Dataset(variables, coords=coords)


def _column(values: Sequence[Any], shape: tuple[int, ...]) -> NDArray[np.generic]:
    """Return one variable of every curve in the shape of the curves, if there are any; NaN if one has none."""
    known = next(value for value in values if value is not None)
    if isinstance(known, str):
        return np.array(values, dtype=object)[: math.prod(shape)].reshape(shape)
    array = np.asarray(known)
    filled = [np.full(array.shape, np.nan) if value is None else value for value in values]
    column = np.array(filled)[: math.prod(shape)]
    return column.reshape((*shape, *array.shape))
