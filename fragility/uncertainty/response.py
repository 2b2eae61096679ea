"""The response of an uncertain block as a function of samples of its inputs: probabilities and medians."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

import numpy as np
import xarray as xr

from ...core.aliases import Progress
from ...core.units import DIMENSIONLESS, described
from ...models import Block, Law
from ...motions.intensity.measure import Measure
from ...motions.polarity import AS_RECORDED
from ..curves.probability import overturning_probability
from ..runs.runners import Workers
from .ida import uncertain_ida
from .inputs import RandomInputs


def overturning_response(
    inputs: RandomInputs,
    block: Block,
    model: Law,
    motions: xr.DataArray | Iterable[xr.DataArray],
    levels: Any,
    im: str | Measure = "pga",
    *,
    ground: xr.DataArray | Iterable[xr.DataArray] | None = None,
    polarity: str = AS_RECORDED,
    client: Workers = None,
    progress: Progress | None = None,
) -> Callable[[xr.Dataset], xr.DataArray]:
    """Return a function from samples to the probability of overturning at every level.

    Parameters
    ----------
    inputs : RandomInputs
        The uncertain properties of the block and its law.
    block, model, motions, levels, im, ground, polarity, client, progress
        As for `uncertain_ida`; the same motions for every sample.

    Returns
    -------
    callable
        From samples (`RandomInputs.sample`) to an array on (sample, output), for `sobol_indices` and
        `tornado`.  Output is ``P at 3 m s-2``, …, with the coordinate `level`.

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

    def response(samples: xr.Dataset) -> xr.DataArray:
        runs = uncertain_ida(
            inputs,
            block,
            model,
            motions,
            levels,
            im,
            ["overturned"],
            client,
            samples=samples,
            ground=ground,
            polarity=polarity,
            progress=progress,
        )
        counts = overturning_probability(runs)
        if "floor" in counts.dims:
            raise ValueError("motions must be of one floor, got several: an output for each needs a call for each")
        level = counts["level"]
        units = level.attrs["units"]
        names = [f"P at {value:g}{'' if units == DIMENSIONLESS else f' {units}'}" for value in level.values]
        return xr.DataArray(
            counts["probability"].transpose("sample", "level").values,
            dims=("sample", "output"),
            coords={
                "output": ("output", np.array(names, dtype=object), described("what is looked at")),
                "level": ("output", level.values, dict(level.attrs)),
            },
            attrs={"configuration": runs.attrs["configuration"]},
        )

    return response
