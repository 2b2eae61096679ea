"""What the shaking that was run has reached: medians above the highest level are not reached, and not extrapolated.

A fitted curve goes on above the highest level, but no run says whether the blocks do.  Tables and sentences therefore
take such a median as infinite, which is how curves without a form hold a median that no level reaches.
"""

from __future__ import annotations

import numpy as np
import xarray as xr

from .words import axis_of

FITTED = "fitted_median"
"""Variable that keeps the medians of the fitted curves, from which their probabilities at levels follow."""
EDGE = 1.0 + 1e-9
"""A median this many times the highest level still counts as reached: it differs from it by rounding alone."""


def highest_level(results: xr.Dataset) -> float:
    """Return the strongest shaking that was run (SI); infinite where results hold no levels, as published curves."""
    if "level" not in results.coords and "intensity" not in results.coords:
        return np.inf
    return float(axis_of(results).max())


def within_levels(results: xr.Dataset) -> xr.Dataset:
    """Return results in which a median above the highest level that was run is infinite: not reached.

    Parameters
    ----------
    results : xarray.Dataset
        Results with ``median`` (SI), its ends ``median_lower`` and ``median_upper`` where there are any, levels
        (``level`` or, of a cloud, ``intensity``); ``fractile``, ``sample_median`` and ``median_ratio`` with their ends
        where there are any.

    Returns
    -------
    xarray.Dataset
        The lower end of the interval of such a median is at most the highest level and the upper end infinite: it reads
        "above" that level.  ``fitted_median`` keeps what was fitted.  Ratios of a median that is not reached are
        infinite, ratios to one that is not reached are NaN.  Results without medians or levels are returned as they
        are; doing it twice changes nothing.

    Examples
    --------
    >>> curves = xr.Dataset(
    ...     {"median": ("block", [2.0, 5.0]), "median_lower": ("block", [1.5, 4.0]),
    ...      "median_upper": ("block", [2.5, 7.0])}, {"level": [1.0, 3.0]}
    ... )
    >>> found = within_levels(curves)
    >>> found["median"].values.tolist(), found["median_lower"].values.tolist(), found["median_upper"].values.tolist()
    ([2.0, inf], [1.5, 3.0], [2.5, inf])
    """
    most = highest_level(results)
    if "median" not in results or not np.isfinite(most):
        return results
    median = results["median"]
    far = median > EDGE * most
    others = [results[name] > EDGE * most for name in ("fractile", "sample_median") if name in results]
    if not any(bool(one.any()) for one in (far, *others)):
        return results
    found = {"median": median.where(~far, np.inf)}
    kept = {} if FITTED in results else {FITTED: median}
    if "median_lower" in results:
        found["median_lower"] = results["median_lower"].where(~far, np.fmin(results["median_lower"], most))
        found["median_upper"] = results["median_upper"].where(~far, np.inf)
    if "sample_median" in results:
        own = results["sample_median"]
        found["sample_median"] = own.where(~(own > EDGE * most), np.inf)
    if "fractile" in results:
        beyond = results["fractile"] > EDGE * most
        found["fractile"] = results["fractile"].where(~beyond, np.inf)
        if "fractile_lower" in results:
            found["fractile_lower"] = results["fractile_lower"].where(~beyond, np.fmin(results["fractile_lower"], most))
            found["fractile_upper"] = results["fractile_upper"].where(~beyond, np.inf)
    if "median_ratio" in results:
        found |= _ratios(results, far, most)
    # (dimensions may change their order where two arrays meet)
    return results.assign(
        {name: one.transpose(*results[name].dims).assign_attrs(results[name].attrs) for name, one in found.items()}
        | kept
    )


def _ratios(results: xr.Dataset, far: xr.DataArray, most: float) -> dict[str, xr.DataArray]:
    """Return the ratios of medians of a sensitivity study, of what is not reached infinite, to what is not NaN."""
    ratio = results["median_ratio"]
    with np.errstate(divide="ignore", invalid="ignore"):
        unknown = results["median"] / ratio > EDGE * most
    own = ratio.where(~far | ratio.isnull(), np.inf).where(~unknown)
    ends = {
        f"median_ratio_{end}": results[f"median_ratio_{end}"].where(~far & ~unknown)
        for end in ("lower", "upper")
        if f"median_ratio_{end}" in results
    }
    return {"median_ratio": own, **ends}
