"""Hazards and curves that the tests of rates share."""

import numpy as np
import xarray as xr

from toppling.fragility import HazardCurve

# k0 = 1e-4, k = 2.5, median 0.6, dispersion 0.4
ORACLE = 5.912472244407e-4
LAW = HazardCurve.power_law(1e-4, 2.5, "pga")
# grows steeper, as hazard curves do
X = np.geomspace(0.05, 30.0, 30)
SITE = HazardCurve(X, 0.02 * np.exp(-1.2 * np.log(X / 0.05) - 0.1 * np.log(X / 0.05) ** 2), "pga")


def outer(samples, tail):
    """Order statistics that leave no more than `tail` out at either end, over the last axis; NaN is left out."""
    rows = [row[~np.isnan(row)] for row in np.atleast_2d(samples)]
    lower = [np.quantile(row, tail, method="inverted_cdf") for row in rows]
    upper = [-np.quantile(-row, tail, method="inverted_cdf") for row in rows]
    return np.squeeze([lower, upper])


def curves(median=0.6, dispersion=0.4, im="pga", units="m s-2", **other):
    """Curves on block where the median is a sequence."""
    dims = ("block",) if np.ndim(median) else ()
    found = {
        "median": (dims, np.asarray(median, float), {"units": units, "long_name": "median"}),
        "dispersion": (dims, np.broadcast_to(dispersion, np.shape(median)), {"units": "1", "long_name": "dispersion"}),
    }
    return xr.Dataset(found, attrs={"im": im}).assign(other)
