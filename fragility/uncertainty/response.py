"""The response of an uncertain block as a function of samples of its inputs: probabilities and medians.

Every sample is run under the same motions, so that differences between samples are due to their inputs.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from ...core.aliases import Progress
from ...core.units import DIMENSIONLESS
from ...models import Block, Law
from ...motions.intensity.measure import Measure
from ...motions.polarity import AS_RECORDED
from ..curves.probability import overturning_probability
from ..fitting.fit import fit_fragility
from ..fitting.states import OK, OVERTURNED, State, needed_output
from .ida import uncertain_ida
from .inputs import RandomInputs

if TYPE_CHECKING:
    from distributed import Client

    from ..runs.runners import Runner


def overturning_response(
    inputs: RandomInputs,
    block: Block,
    model: Law,
    motions: xr.DataArray | Iterable[xr.DataArray],
    levels: Any,
    im: str | Measure = "pga",
    *,
    median: bool = False,
    state: State = OVERTURNED,
    ground: xr.DataArray | Iterable[xr.DataArray] | None = None,
    polarity: str = AS_RECORDED,
    client: Client | Runner | None = None,
    progress: Progress | None = None,
) -> Callable[[xr.Dataset], xr.DataArray]:
    """Return a function from samples to the probability of overturning at every level, and optionally the median.

    Parameters
    ----------
    inputs : RandomInputs
        The uncertain properties of the block and its law.
    block, model, motions, levels, im, ground, polarity, client, progress
        As for `uncertain_ida`; the same motions for every sample.
    median : bool
        Add the median of a lognormal curve fitted to the levels, for which they must reach from where nearly no motion
        overturns the block to where nearly all do.
    state : str or float
        The limit state of which the probability is computed, see `reached`.

    Returns
    -------
    callable
        From samples (`RandomInputs.sample`) to an array on (sample, output), for `sobol_indices` and
        `tornado`.  Output is ``P at 3 m s-2``, … and ``median``, with the coordinate `level`.  ValueError where a
        sample has no median.

    Examples
    --------
    >>> import toppling as tp
    >>> from toppling.fragility import Uniform
    >>> shakes = tp.motions.CloughPenzien(duration=10.0, dt=0.01).sample(8)
    >>> inputs = RandomInputs({"e": Uniform(0.85, 1.0), "alpha_factor": Uniform(0.9, 1.1)})
    >>> shelf = tp.catalogue["bookcase-5-shelf"]
    >>> response = overturning_response(inputs, shelf, tp.HousnerImpact(), shakes, [3.0])
    >>> response(inputs.sample(5)).dims
    ('sample', 'output')
    """
    needed = [needed_output(state)]

    def response(samples: xr.Dataset) -> xr.DataArray:
        runs = uncertain_ida(
            inputs,
            block,
            model,
            motions,
            levels,
            im,
            needed,
            client,
            samples=samples,
            ground=ground,
            polarity=polarity,
            progress=progress,
        )
        counts = overturning_probability(runs, state=state)
        if "floor" in counts.dims:
            raise ValueError("motions must be of one floor, got several: an output for each needs a call for each")
        level = counts["level"]
        columns = [counts["probability"].transpose("sample", "level").values]
        units = level.attrs["units"]
        names = [f"P at {one:g}{'' if units == DIMENSIONLESS else f' {units}'}" for one in level.values]
        if median:
            fits = fit_fragility(counts)
            bad = fits["status"].values[fits["status"].values != OK]
            if bad.size:
                raise ValueError(
                    f"every sample must have a median, got {bad.size} of {fits.sizes['sample']} without "
                    f"({', '.join(sorted(set(map(str, bad))))}): extend or refine the levels"
                )
            columns.append(fits["median"].values[:, None])
            names.append("median")
        at = np.concatenate([level.values, [np.nan] * (len(names) - level.size)])
        return xr.DataArray(
            np.concatenate(columns, axis=1),
            dims=("sample", "output"),
            coords={
                "output": (
                    "output",
                    np.array(names, dtype=object),
                    {"units": DIMENSIONLESS, "long_name": "what is looked at"},
                ),
                "level": ("output", at, dict(level.attrs)),
            },
            attrs={"configuration": runs.attrs["configuration"]},
        )

    return response
