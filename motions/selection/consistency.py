"""Rates of one measure rebuilt from stripes of another: what a consistent set of stripes must give back."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.special import ndtr

from ...core import checks
from ...core.aliases import Array
from ..intensity.dataset import measure_named
from ..intensity.measure import Measure
from .target import Mixture, Target


def rebuilt_rates(target: Target | Mixture, levels: Any, rates: Any, measure: str | Measure, values: Any) -> Array:
    """Return the annual rates at which a measure exceeds values, from the target's stripes at several levels.

    Parameters
    ----------
    target : Target or Mixture
    levels : array_like, shape (level + 1,)
        Bounds of the intervals of the target's `given`, SI, > 0, strictly increasing; a stripe lies at the geometric
        mean of its bounds.
    rates : array_like, shape (level + 1,)
        Annual rates at which `given` exceeds the bounds, >= 0, not increasing.
    measure : measure or its name
        One of the target's measures.
    values : array_like, shape (value,)
        SI, > 0.

    Returns
    -------
    ndarray, shape (value,)
        Annual rates.  What lies outside the bounds is missing, so that too few levels give too little or, where
        intervals are wide, too much.

    Raises
    ------
    TypeError, ValueError
        Wrong sizes or orders, a measure that the target does not hold.

    Notes
    -----
    lambda(z) = sum_j P(measure > z | given = y_j) [lambda(bound_j) - lambda(bound_j+1)].

    References
    ----------
    Lin, T., Haselton, C. B. and Baker, J. W. (2013). Conditional spectrum-based ground motion selection. Part I: hazard
    consistency for risk-based assessments. Earthquake Engineering & Structural Dynamics 42(12), 1847-1865.
    """
    bounds = checks.finite_array("levels", levels, unit="SI")
    exceeded = checks.finite_array("rates", rates, unit="per year")
    wanted = checks.finite_array("values", values)
    one = measure_named(measure)
    if bounds.shape != exceeded.shape or bounds.size < 2:
        raise ValueError(f"levels and rates must be equally many, at least 2, got {bounds.size} and {exceeded.size}")
    if bounds[0] <= 0.0 or np.any(np.diff(bounds) <= 0.0):
        raise ValueError("levels must be > 0 and strictly increasing")
    if exceeded.min() < 0.0 or np.any(np.diff(exceeded) > 0.0):
        raise ValueError("rates must be >= 0 and must not increase with the level")
    if wanted.min() <= 0.0:
        raise ValueError(f"values must be > 0, got {wanted.min():g}")
    if one not in target.measures:
        raise ValueError(f"the target does not hold {one.label}")
    j = list(target.measures).index(one)
    found = np.zeros(wanted.size)
    for low, high, rate in zip(bounds[:-1], bounds[1:], -np.diff(exceeded), strict=True):
        stripe = target.at(float(np.sqrt(low * high)))
        sigma = float(stripe.sigmas[j])
        off = stripe.mean[j] - np.log(wanted)
        above = ndtr(off / sigma) if sigma > 0.0 else np.where(off > 0.0, 1.0, 0.0)
        found += rate * above
    return found
