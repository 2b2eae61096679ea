"""Annual rates of runs at adaptive levels without a form of curve, for replicates that draw their motions again."""

import math

import numpy as np
import xarray as xr

from ...core.units import PER_YEAR, described
from ..adaptive.rate import weighted_samples
from ..fitting.bootstrap import draw_motions
from ..fitting.states import OVERTURNED, State, flags_of, needed_output
from ..runs.provenance import RUN, clusters_of, curves_of


def weighted_rate_samples(runs: xr.Dataset, replicates: int, seed: int = 0, state: State = OVERTURNED) -> xr.DataArray:
    """Return the annual rates (block, model, replicate), 1/year, of replicates of runs whose levels a hazard drew.

    The rate of a replicate is the mean over its motions of the weights of their runs that reached the state
    (`fragility.adaptive.rate`), without a form of curve. A possible rate below the lowest falls is not in the
    replicates, but in the interval of the rate itself. A replicate of the same seed draws the same motions as in
    `fit_fragility`.
    """
    if "weight" not in runs or RUN not in runs["weight"].dims:
        raise ValueError("rates without a form of curve need the weights of runs at adaptive levels, until a rate")
    clusters = clusters_of(runs)
    drawn = draw_motions((np.arange(clusters.max() + 1),), replicates, seed)
    verdicts = runs[needed_output(state)].values
    alpha = runs["alpha"].values if "alpha" in runs.coords else np.full(runs.sizes["block"], math.nan)
    rates = np.empty((runs.sizes["block"], runs.sizes["model"], replicates))
    for i, j, rows, motions in curves_of(runs):
        fell = np.asarray(flags_of(verdicts[rows], state, float(alpha[i])), dtype=np.bool_)
        rates[i, j] = weighted_samples(runs["weight"].values[rows], fell, clusters[motions], drawn)
    text = "annual rate of each replicate, from weighted runs without a form of curve"
    return xr.DataArray(
        rates,
        {"block": runs["block"].variable, "model": runs["model"].variable},
        ("block", "model", "replicate"),
        attrs=described(text, PER_YEAR),
    )
