"""From flags to probabilities with binomial intervals."""

from __future__ import annotations

import math

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy.special import ndtri

from .. import checks
from ..motions.arrays import floor_coordinates
from ..units import DIMENSIONLESS
from .states import OVERTURNED, State, reached, state_name


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


def wilson_half_width(runs: int, confidence: float = 0.95) -> float:
    """Half width of Wilson's interval of a probability of 1/2: z/(2 sqrt(runs + z²))."""
    z = float(ndtri(0.5 + 0.5 * checks.number("confidence", confidence, above=0.0, below=1.0)))
    return 0.5 * z / math.sqrt(checks.count("runs", runs) + z * z)


def runs_for_half_width(half_width: float, confidence: float = 0.95) -> int:
    """Least number of runs at which that half width is no greater than `half_width` (above 0, below 1/2)."""
    width = checks.number("half_width", half_width, above=0.0, below=0.5)
    z = float(ndtri(0.5 + 0.5 * checks.number("confidence", confidence, above=0.0, below=1.0)))
    return math.ceil(z * z * (0.25 / width**2 - 1.0))


def overturning_probability(runs: xr.Dataset, confidence: float = 0.95, state: State = OVERTURNED) -> xr.Dataset:
    """Observed probability of overturning, or of another damage state, and its binomial interval.

    Parameters
    ----------
    runs : xarray.Dataset
        Runs on (block, model, level, motion) as `toppling.ida` returns them, or on (block, model, motion) as
        `toppling.stripes` does.
    confidence : float
        Of the Wilson interval, between 0 and 1.
    state : str or float
        ``overturned``, ``uplifted``, or a threshold of |theta|/alpha, see `reached`.

    Returns
    -------
    xarray.Dataset
        probability, lower, upper, overturnings and runs on (block, model, level), dimensionless; `overturnings` counts
        the runs that reached the state.  Motions of several floors (`floor`, or in a study's results `motion_floor`, on
        motion) are not pooled: floor becomes a dimension, (block, model, floor, level).  Drop that coordinate to pool.

    Raises
    ------
    TypeError, ValueError
        Runs without what the state needs, or of a cloud analysis, whose motions have no levels; a confidence outside
        (0, 1).

    Notes
    -----
    At one level every motion counts once, so the runs are independent and the interval is Wilson's (1927).  Floors of
    one building shake together: their probabilities are not independent of each other.
    """
    within = checks.number("confidence", confidence, above=0.0, below=1.0)
    flags = reached(runs, state)
    overturnings, trials = _counts(flags)
    lower, upper = wilson_interval(overturnings.values, trials.values, within)
    percent = f"{100.0 * within:g} %"
    name = state_name(state)
    variables = {
        "probability": (overturnings / trials, f"probability of {name}"),
        "lower": (overturnings.copy(data=lower), f"lower end of the {percent} Wilson interval"),
        "upper": (overturnings.copy(data=upper), f"upper end of the {percent} Wilson interval"),
        "overturnings": (overturnings, f"runs with {name}"),
        "runs": (trials, "runs"),
    }
    return xr.Dataset(
        {name: array.assign_attrs(units=DIMENSIONLESS, long_name=text) for name, (array, text) in variables.items()},
        attrs={**runs.attrs, "title": f"Probability of {name}", "state": name, "confidence": within},
    )


FLOORS = ("floor", "motion_floor")
"""What the floor of each motion is called: by `toppling.ida`, and in results with a dimension `floor` beside it."""


def _counts(flags: xr.DataArray) -> tuple[xr.DataArray, xr.DataArray]:
    """Runs that reached the state, and runs, at each level and for each floor where there are several."""
    name = next((one for one in FLOORS if one in flags.coords and flags[one].dims == ("motion",)), None)
    labels = list(dict.fromkeys(map(str, flags[name].values))) if name is not None else []
    if len(labels) < 2:
        return _at_levels(flags)
    on_floor = [np.flatnonzero([str(one) == label for one in flags[name].values]) for label in labels]
    whole = all(label.isdecimal() for label in labels)
    floor = floor_coordinates([int(label) for label in labels] if whole else labels)["floor"]
    parts = [_at_levels(flags.isel(motion=here)) for here in on_floor]
    rest = [dim for dim in parts[0][0].dims if dim != "level"]
    overturnings, runs = (xr.concat(one, floor).transpose(*rest, "floor", ...) for one in zip(*parts, strict=True))
    return overturnings, runs


def _at_levels(flags: xr.DataArray) -> tuple[xr.DataArray, xr.DataArray]:
    """Flags of motions as counts at each level: every motion is at all of them, or in one stripe."""
    if "level" in flags.dims or "intensity" not in flags.coords:
        overturnings = flags.sum("motion").astype(np.int64)
        return overturnings, xr.full_like(overturnings, flags.sizes["motion"])
    at = flags["intensity"]
    if "stripe" not in flags.coords:
        raise ValueError(
            "a cloud analysis has every motion at an intensity of its own, and so no counts at levels: "
            "fit a curve to it (fit_fragility)"
        )
    levels, which = np.unique(at.values, return_inverse=True)
    level = xr.Variable("level", levels, at.attrs)
    member = xr.DataArray(
        which[:, None] == np.arange(levels.size), {"level": level}, ("motion", "level"), name=flags.name
    ).astype(np.int64)
    overturnings = flags.astype(np.int64).dot(member, dim="motion")
    return overturnings, xr.zeros_like(overturnings) + member.sum("motion")
