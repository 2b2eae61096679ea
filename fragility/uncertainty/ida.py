"""Uncertain block: every sample of its inputs is a block and a law; its response as a function of samples."""

from collections.abc import Callable, Iterable, Sequence
from functools import partial
from typing import Any

import numpy as np
import xarray as xr

from ...core import checks
from ...core.aliases import Progress
from ...core.parameters import USUAL_MEASURE
from ...core.units import DIMENSIONLESS, described
from ...models import Block, Law, describe_block, describe_law
from ...models.laws import oscillator_of
from ...motions.arrays import BOTH_AXES
from ...motions.intensity.measure import Measure
from ...motions.polarity import AS_RECORDED
from ..analyses.analysis import Specimens, analyse
from ..analyses.ida import incremental
from ..curves.probability import overturning_probability
from ..runs.axes import axes_of, check_axes
from ..runs.labels import block_coordinates, depth_coordinate, law_coordinates, law_variable, restitution_variable
from ..runs.request import USUAL_OF_ROCKING, check_request, labelled_sequence
from ..runs.runners import Workers
from .inputs import RandomInputs
from .realisation import LAW

SAMPLES = 64


def uncertain_ida(
    inputs: RandomInputs,
    block: Block,
    models: Law | Sequence[Law],
    motions: xr.DataArray | Iterable[xr.DataArray],
    levels: Any,
    im: str | Measure = USUAL_MEASURE,
    outputs: Sequence[str] = USUAL_OF_ROCKING,
    client: Workers = None,
    *,
    samples: int | xr.Dataset = SAMPLES,
    ground: xr.DataArray | Iterable[xr.DataArray] | None = None,
    polarity: str = AS_RECORDED,
    progress: Progress | None = None,
) -> xr.Dataset:
    """Incremental dynamic analysis of every sample of uncertain inputs, under the same motions.

    Parameters
    ----------
    inputs : RandomInputs
        The uncertain properties of the block and its law.
    block : Block
        The nominal block.  The depth of every sample keeps its ratio to the width.
    models : law or a sequence of laws
        The nominal law. Several laws give a dimension `model`, each under the same samples; if `law` is an input, one
        law must be given and is not used.
    motions, levels, im, outputs, client, ground, polarity, progress
        As for `ida`.
    samples : int or xarray.Dataset
        Number of samples (a Latin hypercube under the seed 0), or samples as `RandomInputs.sample` returns them.

    Returns
    -------
    xarray.Dataset
        The outputs on (sample, level, motion), or (model, sample, level, motion); the properties of each sample's
        block and law as coordinates on sample.

    Examples
    --------
    >>> import toppling as tp
    >>> from toppling.fragility import RandomInputs, Uniform
    >>> shakes = tp.motions.CloughPenzien(duration=10.0, dt=0.01).sample(4)
    >>> inputs = RandomInputs({"e": Uniform(0.85, 1.0), "alpha_factor": Uniform(0.9, 1.1)})
    >>> shelf = tp.catalogue["bookcase-5-shelf"]
    >>> runs = uncertain_ida(inputs, shelf, tp.HousnerImpact(), shakes, [2.0, 4.0], samples=8)
    >>> dict(runs.sizes)
    {'sample': 8, 'level': 2, 'motion': 4}
    """
    if not isinstance(inputs, RandomInputs):
        raise TypeError(f"inputs must be RandomInputs, got {checks.kind(inputs)}")
    request = check_request(block, models, outputs, True, client, progress)
    laws = labelled_sequence("models", request.models, Law)  # type: ignore[type-abstract]
    if len(laws) > 1 and LAW in inputs.names:
        raise ValueError(f"models must be one law where 'law' is an input, got {len(laws)}")
    drawn = samples if isinstance(samples, xr.Dataset) else inputs.sample(samples)
    pairs = [pair for law in laws for pair in inputs.realise(block, law, drawn)]
    blocks = [piece_block for piece_block, _ in pairs]
    n = drawn.sizes["sample"]
    design = incremental(levels, motions, im, blocks, ground, polarity)
    # (coordinates of the blocks are put on sample: they are the same for every model)
    coordinates = {
        name: xr.Variable(("sample", "motion"), coordinate.values[:n], coordinate.attrs)
        if "block" in coordinate.dims
        else coordinate
        for name, coordinate in design.coordinates.items()
    }
    axes = axes_of(design.motions)
    for piece, law in pairs:
        check_axes(axes, [piece], [law])
    design = design._replace(title="Incremental dynamic analysis of an uncertain block", coordinates=coordinates)
    several = None if isinstance(models, Law) else laws
    specimens = Specimens(
        [oscillator_of(*pair) for pair in pairs],
        blocks,
        {"sample": n} if several is None else {"model": len(laws), "sample": n},
        # (level, design, im and levels come early in these results)
        {**_sample_coordinates(drawn, pairs, several, bool(axes)), "level": coordinates["level"]},
        {
            "design": design.name,
            "inputs": inputs.description,
            "samples": {name: drawn.attrs[name] for name in ("method", "seed") if name in drawn.attrs},
            "block": describe_block(block),
            "models": [describe_law(law) for law in laws],
            **{name: design.configuration[name] for name in ("im", "levels")},
        },
        [oscillator_of(piece_block.across, law) for piece_block, law in pairs] if axes == BOTH_AXES else None,
        pairs,
    )
    return analyse(request, specimens, design)


def _sample_coordinates(
    drawn: xr.Dataset, pairs: Sequence[tuple[Block, Law]], models: Sequence[Law] | None, deep: bool
) -> dict[str, Any]:
    """Coordinates: the properties of every sample's block and law, the values of the inputs, labels of several laws.

    `deep`: True to include the depths of the blocks.
    """
    n = drawn.sizes["sample"]
    coordinates: dict[str, Any] = {str(name): variable.variable for name, variable in drawn.data_vars.items()}
    blocks = [block for block, _ in pairs[:n]]
    for name, coordinate in {**block_coordinates(blocks), **(depth_coordinate(blocks) if deep else {})}.items():
        if name != "block":
            coordinates[name] = xr.Variable("sample", coordinate.values, coordinate.attrs)
    dims = ("sample",) if models is None else ("model", "sample")
    shape = (n,) if models is None else (len(models), n)
    laws = [law for _, law in pairs]
    coordinates["e"] = restitution_variable(pairs, dims, shape)
    coordinates["delta"] = law_variable("delta", laws, dims, shape)
    if LAW not in drawn:
        coordinates["law"] = law_variable("law", laws, dims, shape)
    if models is not None:
        coordinates["model"] = law_coordinates(models)["model"]
    coordinates["sample"] = drawn["sample"].variable
    return coordinates


def overturning_response(
    inputs: RandomInputs,
    block: Block,
    model: Law,
    motions: xr.DataArray | Iterable[xr.DataArray],
    levels: Any,
    im: str | Measure = USUAL_MEASURE,
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
    run = partial(uncertain_ida, inputs, block, model, motions, levels, im, ["overturned"], client)

    def response(samples: xr.Dataset) -> xr.DataArray:
        runs = run(samples=samples, ground=ground, polarity=polarity, progress=progress)
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
