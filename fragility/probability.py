"""From flags to probabilities with binomial intervals."""

from __future__ import annotations

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy.special import ndtri

from .. import checks
from ..motions.arrays import floor_coordinates
from ..units import DIMENSIONLESS


def wilson_interval(
    successes: NDArray[np.integer], trials: NDArray[np.integer], confidence: float = 0.95
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Wilson's score interval of a binomial proportion, arrays of one shape; NaN where there was no trial.

    References
    ----------
    Wilson, E. B. (1927). Probable inference, the law of succession, and statistical inference. Journal of the
    American Statistical Association 22, 209-212.
    """
    level = checks.number("confidence", confidence, above=0.0, below=1.0)
    k = np.asarray(successes, dtype=float)
    if np.any(k < 0) or np.any(k > np.asarray(trials)):
        raise ValueError("successes must lie between 0 and trials")
    n = np.where(np.asarray(trials) > 0, trials, np.nan).astype(float)
    z2 = ndtri(0.5 + 0.5 * level) ** 2
    centre = (k + 0.5 * z2) / (n + z2)
    half = np.sqrt(z2 * (k * (n - k) / n + 0.25 * z2)) / (n + z2)
    lower = np.where(k == 0.0, 0.0, centre - half)
    upper = np.where(k == n, 1.0, centre + half)
    return np.where(np.isnan(n), np.nan, lower), np.where(np.isnan(n), np.nan, upper)


def overturning_probability(ida: xr.Dataset, confidence: float = 0.95) -> xr.Dataset:
    """Observed probability of overturning and its binomial interval.

    Parameters
    ----------
    ida : xarray.Dataset
        With `overturned` on (block, model, level, motion), as `toppling.ida` returns it.
    confidence : float
        Of the Wilson interval, between 0 and 1.

    Returns
    -------
    xarray.Dataset
        probability, lower, upper, overturnings and runs on (block, model, level), dimensionless.  Motions of several
        floors (`floor`, or in a study's results `motion_floor`, on motion) are not pooled: floor becomes a dimension,
        (block, model, floor, level).  Drop that coordinate to pool them.

    Raises
    ------
    TypeError, ValueError
        A dataset without `overturned` on `motion`, a confidence outside (0, 1).

    Notes
    -----
    At one level every motion counts once, so the runs are independent and the interval is Wilson's (1927).  Floors of
    one building shake together: their probabilities are not independent of each other.
    """
    level = checks.number("confidence", confidence, above=0.0, below=1.0)
    if not isinstance(ida, xr.Dataset) or "overturned" not in ida:
        raise TypeError("overturning_probability needs a dataset with `overturned`, as toppling.ida returns it")
    flags = ida["overturned"]
    if "motion" not in flags.dims:
        raise ValueError(f"overturned must have a motion dimension, got dims {flags.dims}")
    if flags.sizes["motion"] == 0:
        raise ValueError("overturned must hold at least one motion, got none")
    if flags.dtype != np.bool_ and not bool(((flags == 0) | (flags == 1)).all()):
        raise ValueError(f"overturned must be flags, got values other than 0 and 1 ({flags.dtype})")
    overturnings, runs = _counts(flags)
    lower, upper = wilson_interval(overturnings.values, runs.values, level)
    percent = f"{100.0 * level:g} %"
    variables = {
        "probability": (overturnings / runs, "probability of overturning"),
        "lower": (overturnings.copy(data=lower), f"lower end of the {percent} Wilson interval"),
        "upper": (overturnings.copy(data=upper), f"upper end of the {percent} Wilson interval"),
        "overturnings": (overturnings, "runs that overturned"),
        "runs": (runs, "runs"),
    }
    return xr.Dataset(
        {name: array.assign_attrs(units=DIMENSIONLESS, long_name=text) for name, (array, text) in variables.items()},
        attrs={**ida.attrs, "title": "Probability of overturning", "confidence": level},
    )


FLOORS = ("floor", "motion_floor")
"""What the floor of each motion is called: by `toppling.ida`, and in results with a dimension `floor` beside it."""


def _counts(flags: xr.DataArray) -> tuple[xr.DataArray, xr.DataArray]:
    """Overturnings and runs, for each floor where there are several."""
    name = next((one for one in FLOORS if one in flags.coords and flags[one].dims == ("motion",)), None)
    labels = list(dict.fromkeys(map(str, flags[name].values))) if name is not None else []
    if len(labels) < 2:
        overturnings = flags.sum("motion").astype(np.int64)
        return overturnings, xr.full_like(overturnings, flags.sizes["motion"])
    on_floor = np.array([[str(one) == label for one in flags[name].values] for label in labels])
    whole = all(label.isdecimal() for label in labels)
    floor = floor_coordinates([int(label) for label in labels] if whole else labels)["floor"]
    parts = [flags.isel(motion=np.flatnonzero(here)).sum("motion").astype(np.int64) for here in on_floor]
    rest = [dim for dim in parts[0].dims if dim != "level"]
    overturnings = xr.concat(parts, floor).transpose(*rest, "floor", ...)
    motions = xr.DataArray(on_floor.sum(axis=1), {"floor": floor}, ("floor",))
    return overturnings, xr.zeros_like(overturnings) + motions
