"""Observed probabilities of damage states, with binomial intervals."""

import numpy as np
import xarray as xr

from ...core.doubts import warn_of_results
from ...core.parameters import CONFIDENCE, USUAL_CONFIDENCE
from ...core.units import described, of_end
from ..fitting.states import OVERTURNED, State, reached, state_name
from ..numerics.proportions import METHOD_NAMES, binomial_interval
from ..runs.provenance import carried_attributes, motions_by_floor, number_of_motions
from ..validity.limits import of_runs


def overturning_probability(
    runs: xr.Dataset, confidence: float = USUAL_CONFIDENCE, state: State = OVERTURNED, interval: str = "wilson"
) -> xr.Dataset:
    """Observed probability of overturning, or of another damage state, and its binomial interval.

    Parameters
    ----------
    runs : xarray.Dataset
        Runs on (block, model, level, motion) as `toppling.ida` returns them, or on (block, model, motion) as
        `toppling.stripes` does.
    confidence : float
        Confidence level of the interval, between 0 and 1.
    state : str or float
        ``overturned``, ``uplifted``, or a threshold of |theta|/alpha, see `reached`.
    interval : {"wilson", "clopper-pearson", "jeffreys"}
        As `method` of `binomial_interval`.

    Returns
    -------
    xarray.Dataset
        probability, lower, upper, overturnings and runs on (block, model, level), dimensionless; `overturnings` counts
        the runs that reached the state.  Motions of several floors (`floor`, or in a study's results `motion_floor`, on
        motion) are not pooled: floor becomes a dimension, (block, model, floor, level).  Drop that coordinate to pool.

    Notes
    -----
    At one level every motion counts once, so the runs are independent and the interval is binomial. For motions that
    are run both ways (``polarity="both"``) the counts contain both runs. The interval takes a motion as one trial by
    the share of its runs that reach the state. No share between 0 and 1 varies more than a trial of the same mean. The
    interval is thus wide enough for any dependence of the two runs. Floors of one building share its motion: their
    probabilities are not independent of each other.
    """
    within = CONFIDENCE.number("confidence", confidence)
    flags = reached(runs, state)
    overturnings, trials = _counts(flags)
    ways = flags.sizes["motion"] // number_of_motions(flags)
    lower, upper = binomial_interval(overturnings.values / ways, trials.values / ways, within, interval)
    name = state_name(state)
    text = f"probability of {name}"
    warn_of_results(of_runs(runs, int(trials.min()) // ways if trials.size else 0))
    variables = {
        "probability": (overturnings.values / trials.values, text),
        "lower": (lower, of_end("lower", text, within, METHOD_NAMES[interval])),
        "upper": (upper, of_end("upper", text, within, METHOD_NAMES[interval])),
        "overturnings": (overturnings.values, f"runs with {name}"),
        "runs": (trials.values, "runs"),
    }
    dims, attributes = overturnings.dims, overturnings.attrs
    return xr.Dataset(
        {key: (dims, values, {**attributes, **described(text)}) for key, (values, text) in variables.items()},
        overturnings.coords,
        attrs={
            **carried_attributes(runs.attrs),
            "title": f"Probability of {name}",
            "state": name,
            "confidence": within,
        },
    )


def _counts(flags: xr.DataArray) -> tuple[xr.DataArray, xr.DataArray]:
    """Return the runs that reached the state and all runs, at each level and, if there are several, for each floor."""
    floor, groups = motions_by_floor(flags)
    if floor is None:
        return _at_levels(flags)
    parts = [_at_levels(flags.isel(motion=group)) for group in groups]
    rest = [dim for dim in parts[0][0].dims if dim != "level"]
    overturnings, runs = (xr.concat(part, floor).transpose(*rest, "floor", ...) for part in zip(*parts, strict=True))
    return overturnings, runs


def _at_levels(flags: xr.DataArray) -> tuple[xr.DataArray, xr.DataArray]:
    """Return counts at each level from flags of motions; a motion is run at all levels, or belongs to one stripe."""
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
