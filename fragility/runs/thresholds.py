"""The level of peak acceleration at which rigid blocks uplift, as far as a dataset of runs determines it."""

from __future__ import annotations

import numpy as np
import xarray as xr

from ...core.units import STANDARD_GRAVITY
from .provenance import configuration_of, levels_of_the_ground

KNOWN_IN = ("pga", "pga_normalised")


def rocking_thresholds(data: xr.Dataset) -> xr.DataArray:
    """Return the level at which rigidly resting blocks uplift, on (block, model); NaN where it is not known exactly.

    In peak acceleration it is g tan(alpha) (the mass centre's height as lever), g sin(alpha) (``lever="R"``), or g
    alpha (Housner's block of ``geometry="linear"``); in ``pga_normalised`` the same over g tan(alpha). NaN for blocks
    with an elastic zone at rest, which oscillate before they uplift and may uplift well below this level; in any other
    measure; and where levels refer to the ground motion below a floor, or where the motions of a stripe are not scaled
    to its level.
    """
    x = data.coords.get("level", data.coords.get("intensity"))
    im = "" if x is None else str(x.attrs.get("im", ""))
    needed = ("alpha", "law", "rest", "lever", "geometry")
    elsewhere = levels_of_the_ground(data) or configuration_of(data).get("scale") is False
    if im not in KNOWN_IN or elsewhere or any(name not in data.coords for name in needed):
        return xr.DataArray(np.nan)
    alpha = data["alpha"]
    rigid = (data["law"] == "housner") | (data["rest"] == "rigid")
    tangent = xr.apply_ufunc(np.tan, alpha)
    level = tangent.where(data["lever"] != "R", np.sin(alpha)).where(data["geometry"] != "linear", alpha)
    level = level / tangent if im == "pga_normalised" else level * STANDARD_GRAVITY
    found: xr.DataArray = level.where(rigid).transpose(*alpha.dims, *data["law"].dims)
    return found
