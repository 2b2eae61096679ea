"""The range of a chance or a rate if all capacities are off by one factor, in words."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import xarray as xr

from ...fragility.risk.modelling import LOWER, RANGE, UPPER, USUAL_DISPERSION, capacity_factors
from ...wording import about_percent, about_years, chances_between, interval_text, two_digits

HEADING = "model range"
"""Heading of the column of these ranges, and their name in sentences."""
NOT_GIVEN = "not given"
QUALITIES = "FEMA P-58-1 has 0.25 for a model of average and 0.40 for one of limited quality"


def chance_range(low: float, high: float) -> str:
    r"""Write a range of chances.

    Examples
    --------
    >>> chance_range(0.02, 0.061)
    '2.0–6.1\xa0%'
    """
    return chances_between(low, high, about_percent)


def amount_range(low: float, high: float) -> str:
    """Write a range of amounts."""
    return interval_text(low, high, two_digits)


def years_range(low: float, high: float) -> str:
    """Write a range of annual rates as years between two events."""
    return f"{about_years(high)} to {about_years(low)}"


def whole_range(low: float, high: float) -> str:
    """Write a range of counts."""
    return f"{low:.0f} to {high:.0f}"


def model_range(
    here: xr.Dataset, name: str, write: Callable[[float, float], str] = chance_range, scale: float = 1.0
) -> str:
    """Return the range of a value of one block or place, times `scale`; '' where it is not given."""
    if f"{name}{LOWER}" not in here:
        return ""
    low, high = (scale * float(here[f"{name}{end}"]) for end in (LOWER, UPPER))
    return write(low, high) if high > 0.0 else ""  # (neither of what is not known, nor of what nothing showed)


def and_model(text: str, here: xr.Dataset, name: str, *how: Any) -> str:
    """Return what stands in the brackets after a value: its interval, and its model range where that is given."""
    found = model_range(here, name, *how)
    return "; ".join(filter(None, (text, f"{HEADING} {found}" if found else "")))


def has_model_range(here: xr.Dataset, name: str) -> bool:
    """Return whether any value has a range."""
    return f"{name}{LOWER}" in here and bool(np.isfinite(here[f"{name}{LOWER}"]).any())


def of_what(results: xr.Dataset) -> str:
    """Return what a model range is, for a caption; '' for results without.

    Examples
    --------
    >>> of_what(xr.Dataset(attrs={"modelling_range": 0.3}))
    'model range: if all capacities are off by one factor, 0.68 to 1.47'
    """
    if RANGE not in results.attrs:
        return ""
    low, high = capacity_factors(float(results.attrs[RANGE]))
    return f"{HEADING}: if all capacities are off by one factor, {low:.2f} to {high:.2f}"


def model_range_sentences(results: xr.Dataset, *names: str) -> Iterator[str]:
    """Yield what the model ranges of some variables are, or why they have none."""
    held = [name for name in names if f"{name}{LOWER}" in results]
    if not held:
        return
    beta = float(results.attrs[RANGE])
    low, high = (f"{factor:.2f}" for factor in capacity_factors(beta))
    if not any(has_model_range(results, name) for name in held):
        yield (
            f"No {HEADING} is given, since no run shows what happens if all capacities are off by one factor, {low} to "
            f"{high}: that needs levels of shaking from {low} to {high} times this one."
        )
        return
    source = (
        "; FEMA P-58-1 has 0.25 for a model of average and 0.40 for one of limited quality"
        if beta == USUAL_DISPERSION
        else ""
    )
    yield (
        f"The {HEADING} is that of the same number if all capacities are off by one factor, {low} to {high} (10 to "
        f"90 % for a modelling uncertainty β_m of {beta:g}{source})."
    )
