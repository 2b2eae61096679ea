"""Conversion between annual rates and probabilities in years, and the rate as a sum over discrete levels."""

from __future__ import annotations

from typing import Any, TypeVar, cast

import numpy as np
import xarray as xr

from ...core import checks
from ...core.aliases import Array
from ...core.doubts import Doubt, warn
from ...core.units import PER_YEAR

IMPOSSIBLY_OFTEN = 10.0
"""Annual rate of damaging shaking above which nothing real can be meant."""
Values = TypeVar("Values", float, Array, xr.DataArray)


def probability_in(rate: Values, years: float = 50.0) -> Values:
    """Probability of at least one event in `years` (> 0) of a Poisson process with `rate` (1/year, >= 0, any shape).

    Rates that are all above 10 per year are questioned (`ImplausibleInput`): return periods, as a rule.

    Examples
    --------
    >>> round(float(probability_in(1 / 475, 50)), 4)
    0.0999
    """
    time = checks.number("years", years, above=0.0, unit="years")
    if np.any(np.asarray(rate) < 0.0):
        raise ValueError(f"rate must be >= 0 per year, got {np.min(np.asarray(rate)):g}")
    least = np.min(np.asarray(rate), initial=np.inf)
    if IMPOSSIBLY_OFTEN < least < np.inf:
        warn([Doubt("hazard", f"a rate of {least:g} per year is beyond any of damage: is it a return period, 1/rate?")])
    found: Any = -np.expm1(-rate * time)
    return cast(Values, found)


def rate_from_probability(probability: Values, years: float = 50.0) -> Values:
    """Annual rate (1/year) of a Poisson process with a probability (0 to below 1, any shape) of an event in `years`.

    Examples
    --------
    >>> round(1 / float(rate_from_probability(0.10, 50)))
    475
    """
    time = checks.number("years", years, above=0.0, unit="years")
    values = np.asarray(probability)
    wrong = (values < 0.0) | (values >= 1.0)
    if np.any(wrong):
        raise ValueError(f"probability must be at least 0 and below 1, got {values[wrong].flat[0]:g}")
    found: Any = -np.log1p(-probability) / time
    return cast(Values, found)


def discrete_rate(probability: Any, rates: Any) -> Any:
    """Return the annual rate as a sum over levels: P at each level times the rate of events up to the next level.

    Parameters
    ----------
    probability : array_like (..., level) or xarray.DataArray on level
        Probability of overturning at each level, of a curve or as observed.
    rates : array_like (level,)
        Annual rates at which the levels are exceeded, 1/year, >= 0, never rising.

    Returns
    -------
    float, array (...,) or xarray.DataArray
        1/year.  Events count with the P of the level that they have reached, those above the highest level with its P:
        for a rising curve the sum is a lower bound of `annual_rate` that converges to it as levels get closer.

    Raises
    ------
    ValueError
        Lengths that differ, rates that rise or are negative, probabilities outside [0, 1].

    References
    ----------
    Baker, J. W., Bradley, B. A. and Stafford, P. J. (2021). Seismic hazard and risk analysis. Cambridge University
    Press (the sum over discrete levels).

    Examples
    --------
    >>> round(float(discrete_rate([0.1, 0.4, 0.6], [0.06, 0.016, 0.003])), 10)
    0.0114
    """
    exceeded = checks.finite_array("rates", rates, unit="1/year")
    if np.any(exceeded < 0.0) or np.any(np.diff(exceeded) > 0.0):
        raise ValueError("rates must be >= 0 per year and never rise with the level")
    values = np.asarray(probability, dtype=np.float64)
    labelled = probability if isinstance(probability, xr.DataArray) else None
    count = labelled.sizes.get("level") if labelled is not None else (values.shape or (None,))[-1]
    if count != exceeded.size:
        raise ValueError(f"rates must be one a level, got {exceeded.size} for {count} levels")
    if np.any((values < 0.0) | (values > 1.0)):
        raise ValueError("probability must lie between 0 and 1")
    occurrences = exceeded - np.append(exceeded[1:], 0.0)
    if labelled is None:
        return values @ occurrences
    summed = (labelled * xr.DataArray(occurrences, dims="level")).sum("level", skipna=False)
    return summed.assign_attrs(units=PER_YEAR, long_name="annual rate of overturning, sum over levels")
