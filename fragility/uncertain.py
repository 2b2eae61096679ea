"""Incremental dynamic analysis of an uncertain block: every sample of its inputs is a block and a law of its own.

The samples go side by side as the oscillators of one plan, without a product of blocks and laws.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from .. import checks
from ..models import Block, Law, describe_block, describe_law
from ..models.simulate import oscillator_of
from ..motions.arrays import motion_coordinates, records
from ..motions.intensity import RESULT_MEASURES, Measure
from ..motions.measures import measure_variables
from ..units import DIMENSIONLESS, provenance
from .execution import Progress, execute, request
from .inputs import RandomInputs
from .labels import VARIABLES, block_coordinates, measured, output
from .realised_inputs import LAW
from .scaling import Scaling, ground_of, scaling

if TYPE_CHECKING:
    from distributed import Client

    from .runners import Runner


def uncertain_ida(
    inputs: RandomInputs,
    block: Block,
    models: Law | Sequence[Law],
    motions: xr.DataArray | Iterable[xr.DataArray],
    levels: Any,
    im: str | Measure = "pga",
    outputs: Sequence[str] = ("overturned", "peak_rotation"),
    client: Client | Runner | None = None,
    skip: bool = True,
    *,
    samples: int | xr.Dataset = 64,
    seed: int = 0,
    ground: xr.DataArray | Iterable[xr.DataArray] | None = None,
    progress: Progress | None = None,
) -> xr.Dataset:
    """Incremental dynamic analysis of every sample of uncertain inputs, under the same motions.

    Parameters
    ----------
    inputs : RandomInputs
        What of the block and its law is uncertain.
    block : Block
        The nominal block.
    models : law or a sequence of laws
        The nominal law.  Several give a dimension `model`, each under the same samples; where `law` is an input, one
        stands for it and is not used.
    motions, levels, im, outputs, client, skip, ground, progress
        As for `ida`.
    samples : int or xarray.Dataset
        How many (a Latin hypercube under `seed`), or samples as `RandomInputs.sample` returns them.
    seed : int
        Of the samples.

    Returns
    -------
    xarray.Dataset
        The outputs on (sample, level, motion), or (model, sample, level, motion); the numbers of each sample's block
        and law as coordinates on sample.

    Raises
    ------
    TypeError, ValueError
        As `ida` and `RandomInputs.realise`.

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
    asked = request(block, models, outputs, skip, client, progress)
    laws = asked.models
    if len(laws) > 1 and LAW in inputs.names:
        raise ValueError(f"models must be one law where 'law' is an input, got {len(laws)}")
    drawn = samples if isinstance(samples, xr.Dataset) else inputs.sample(samples, seed)
    pairs = [pair for law in laws for pair in inputs.realise(block, law, drawn)]
    plain = records(motions)
    below = None if ground is None else ground_of(plain, records(ground))
    blocks = [one for one, _ in pairs]
    scaled = scaling(levels, plain, im, blocks, below)
    runs = execute([oscillator_of(*pair) for pair in pairs], plain, scaled.factors, asked)
    n = drawn.sizes["sample"]
    sizes = {"model": len(laws), "sample": n, "level": scaled.levels.size, "motion": len(plain)}
    if isinstance(models, Law):
        del sizes["model"]
    variables = {
        name: (
            tuple(sizes),
            output(name, runs, blocks, asked.runner.array).reshape(tuple(sizes.values())),
            _attributes(*VARIABLES[name]),
        )
        for name in asked.outputs
    }
    configuration = {
        "design": "ida",
        "inputs": inputs.description,
        "samples": {name: drawn.attrs[name] for name in ("method", "seed") if name in drawn.attrs},
        "block": describe_block(block),
        "models": [describe_law(law) for law in laws],
        "im": scaled.name,
        "levels": scaled.levels.tolist(),
        "motions": [record.label for record in plain],
        **({"im_at": "ground"} if scaled.ground else {}),
    }
    level = _attributes(scaled.units, scaled.long_name) | {"im": scaled.name}
    return xr.Dataset(
        variables,
        coords={
            **_sample_coordinates(drawn, pairs, None if isinstance(models, Law) else laws),
            "level": xr.Variable("level", scaled.levels, level),
            **motion_coordinates(plain),
            **measure_variables(plain, RESULT_MEASURES),
            **_measured(scaled, n),
        },
        attrs={
            "title": "Incremental dynamic analysis of an uncertain block",
            "design": "ida",
            **provenance(configuration),
            "skipped": json.dumps(runs.skipped),
        },
    )


def _attributes(units: str, long_name: str) -> dict[str, str]:
    return {"units": units, "long_name": long_name}


def _measured(scaled: Scaling, samples: int) -> dict[str, xr.Variable]:
    """As of an IDA; a measure that depends on the block lies on sample (the same for every model)."""
    return {
        name: one if one.dims == ("motion",) else xr.Variable(("sample", "motion"), one.values[:samples], one.attrs)
        for name, one in measured(scaled).items()
    }


def _sample_coordinates(
    drawn: xr.Dataset, pairs: Sequence[tuple[Block, Law]], models: Sequence[Law] | None
) -> dict[str, Any]:
    """Numbers of every sample's block and law, and the inputs behind them; labels of several models."""
    n = drawn.sizes["sample"]
    coordinates: dict[str, Any] = {str(name): one.variable for name, one in drawn.data_vars.items()}
    for name, one in block_coordinates([block for block, _ in pairs[:n]]).items():
        if name != "block":
            coordinates[name] = xr.Variable("sample", one.values, one.attrs)
    dims = ("sample",) if models is None else ("model", "sample")
    shape = (n,) if models is None else (len(models), n)

    def of_law(values: Iterable[Any], dtype: Any, long_name: str) -> xr.Variable:
        column: NDArray[Any] = np.array(list(values), dtype=dtype).reshape(shape)
        return xr.Variable(dims, column, _attributes(DIMENSIONLESS, long_name))

    e = (law.restitution(block) for block, law in pairs)
    coordinates["e"] = of_law((np.nan if one is None else one for one in e), float, "coefficient of restitution used")
    delta = (getattr(law, "delta", np.nan) for _, law in pairs)
    coordinates["delta"] = of_law(delta, float, "half width of the elastic zone over alpha")
    if LAW not in drawn:
        coordinates["law"] = of_law((law.law for _, law in pairs), object, "short name of the damping law")
    if models is not None:
        labels = np.array([law.label for law in models], dtype=object)
        coordinates["model"] = ("model", labels, _attributes(DIMENSIONLESS, "damping law with its options"))
    coordinates["sample"] = drawn["sample"].variable
    return coordinates
