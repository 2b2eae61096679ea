"""Conversion between annual rates and probabilities in years."""

from __future__ import annotations

from typing import Any, TypeVar, cast

import numpy as np
import xarray as xr

from ...core import checks
from ...core.doubts import Doubt, warn
from ...core.elementary import Array, expm1, log1p
from ...core.parameters import USUAL_YEARS, YEARS
from ...core.units import DIMENSIONLESS, PER_YEAR, described
from ...core.wording import years_text

IMPOSSIBLY_OFTEN = 10.0
"""Annual rate of damaging motions above which the input cannot be meant."""
Values = TypeVar("Values", float, Array, xr.DataArray)


def probability_in(rate: Values, years: float = USUAL_YEARS) -> Values:
    """Probability of at least one event in `years` (> 0) of a Poisson process with `rate` (1/year, >= 0, any shape).

    Rates that are all above 10 per year cause a warning (`ImplausibleInput`): they are usually return periods.

    Examples
    --------
    >>> round(float(probability_in(1 / 475, 50)), 4)
    0.0999
    """
    time = YEARS.number("years", years)
    values = checks.numbers("rate", rate, "1/year")
    if np.any(values < 0.0):
        raise ValueError(f"rate must be >= 0 per year, got {np.min(values):g}")
    least = np.min(values, initial=np.inf)
    if IMPOSSIBLY_OFTEN < least < np.inf:
        warn([Doubt.of("rate_of_years", rate=least)])
    text = f"probability of at least one event in {years_text(time)}"
    return cast(Values, _labelled(rate, -expm1(-values * time), "probability", text, DIMENSIONLESS))


def rate_from_probability(probability: Values, years: float = USUAL_YEARS) -> Values:
    """Annual rate (1/year) of a Poisson process with a probability (0 to below 1, any shape) of an event in `years`.

    Examples
    --------
    >>> round(1 / float(rate_from_probability(0.10, 50)))
    475
    """
    time = YEARS.number("years", years)
    values = checks.numbers("probability", probability)
    wrong = (values < 0.0) | (values >= 1.0)
    if np.any(wrong):
        raise ValueError(f"probability must be at least 0 and below 1, got {values[wrong].flat[0]:g}")
    rates = -log1p(-values) / time
    if IMPOSSIBLY_OFTEN < (least := np.min(rates, initial=np.inf)) < np.inf:
        warn([Doubt.of("years_of_rate", rate=least, years=time)])
    return cast(Values, _labelled(probability, rates, "rate", "annual rate of events", PER_YEAR))


def _labelled(given: Any, values: Array, name: str, text: str, units: str) -> Any:
    """Return values with the dimensions and labels of `given`, if it has any."""
    if not isinstance(given, xr.DataArray):
        return values[()]
    return given.copy(data=values).rename(name).assign_attrs(described(text, units))
