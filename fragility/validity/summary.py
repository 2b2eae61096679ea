"""The screen of runs as shares and maximum demands, without a value for every run."""

import json
from collections.abc import Mapping, Sequence
from functools import partial

import numpy as np
import xarray as xr

from ...core.units import described
from ...models import Block, Law
from ...models.friction import Contact, Friction
from ...motions.arrays import DOWNWARD, OWN_AMPLITUDE, POLARITY, RECORD, Record, motion_coordinates
from ..numerics.proportions import wilson_interval
from ..numerics.slabs import Where, in_memory, put
from ..runs.factors import ScaleFactors
from ..runs.labels import block_coordinates, law_variable, restitution_variable
from ..runs.provenance import BED
from .characteristics import Characteristics
from .friction_demand import NEEDS
from .reasons import labelled, reason_names
from .slab_screen import SQUAT_RATIO, ScreenInput, ScreenRequest, ordered, screened_slabs
from .undecided import FlipCounts

OF_BLOCKS = ("squat", "friction_uplift", "friction_impact", "elastic_frequency")
"""Variables that do not depend on the motion."""
EXTREMES: dict[str, tuple[str, np.ufunc, str]] = {
    **{name: (name, np.fmax, f"greatest {text}") for name, text in NEEDS.values() if name not in OF_BLOCKS},
    "scale_factor_lowest": ("scale_factor", np.fmin, "lowest scale factor of the motions"),
    "scale_factor_highest": ("scale_factor", np.fmax, "highest scale factor of the motions"),
}
"""Variables that keep the maximum or the minimum value over all runs: the variable of a run, and the long name."""


def input_of_pairs(
    labels: Sequence[str],
    pairs: Sequence[Sequence[tuple[Block, Law]]],
    motions: Sequence[Record],
    factors: ScaleFactors,
) -> ScreenInput:
    """Return the properties of the runs of blocks, each under its own laws, that the screen needs.

    `pairs` (block, model) have the block, the same in a row, with each of its laws.
    """
    kept = (RECORD, POLARITY, DOWNWARD)
    every = [pair for row in pairs for pair in row]
    laws, on = [law for _, law in every], (("block", "model"), (len(pairs), -1))
    known = {
        **block_coordinates([row[0][0] for row in pairs]),
        "block": xr.Variable("block", np.array(labels, dtype=object)),
        "e": restitution_variable(every, *on),
        "delta": law_variable("delta", laws, *on),
        "rest": law_variable("rest", laws, *on),
        "pga": xr.Variable("motion", [float(np.abs(motion.acceleration).max()) for motion in motions]),
        "own_amplitude": xr.Variable("motion", [motion.own_amplitude for motion in motions], OWN_AMPLITUDE),
        **{name: coordinate for name, coordinate in motion_coordinates(list(motions)).items() if name in kept},
    }
    sizes = {
        "block": len(pairs),
        "model": len(pairs[0]),
        "level": factors.levels.sizes["level"],
        "motion": len(motions),
    }
    return ScreenInput(sizes, known, factors)


def summary_screen(
    given: ScreenInput,
    shaking: Characteristics,
    friction: float | Friction | Contact | Mapping[str, float | Friction | Contact] | None = None,
    flips: FlipCounts | None = None,
) -> xr.Dataset:
    """Screen runs as `screen` does, and keep only shares and maximum demands.

    friction_uplift_demand and friction_rocking_demand on block are the maximum of all levels and motions,
    scale_factor_lowest and scale_factor_highest (block) are the ends of the factors. Single runs have neither a
    `verdict` nor a probability of sliding. Without a friction, only a need above 1 counts as sliding; `flips` are of
    the runs that were repeated under perturbations.
    """
    variables, settings = screened_slabs(
        given, shaking, ScreenRequest(friction), flips, partial(_keep_extremes, given.sizes)
    )
    return xr.Dataset(
        variables,
        coords={
            "block": ("block", given.coordinates["block"].values.astype(str).astype(object), described("block")),
            "reason": reason_names(),
            **{name: coordinate for name, coordinate in given.coordinates.items() if name == BED},
        },
        attrs={"screen": json.dumps(settings, ensure_ascii=False)},
    )


def _keep_extremes(
    sizes: Mapping[str, int], kept: dict[str, xr.Variable], variables: Mapping[str, xr.Variable], where: Where
) -> None:
    """Put the variables of blocks and laws alone from a slab into the variables of all blocks, and the extremes."""
    of_blocks = ordered({name: variables[name] for name in OF_BLOCKS}, tuple(sizes))
    put(kept, of_blocks, where, sizes, in_memory)
    blocks = where.get("block", slice(None))
    for name, (of, extreme, text) in EXTREMES.items():
        if name not in kept:
            kept[name] = labelled(xr.Variable("block", np.full(sizes["block"], np.nan)), text)
        values = kept[name].values
        over = [dim for dim in ("level", "motion") if dim in variables[of].dims]
        values[blocks] = extreme(values[blocks], variables[of].reduce(extreme.reduce, over).values)


def over_samples(screened: xr.Dataset, block: Block) -> xr.Dataset:
    """Return the screen of one uncertain block from the screen of its samples, which are on the dimension of blocks.

    squat and friction_uplift are of the nominal block; shares are of the runs of all samples. Demands, frequencies and
    the ends of the scale factors are the extremes among them.
    """
    settings = json.loads(screened.attrs["screen"])
    settings["tested_runs"] *= screened.sizes["block"]
    if isinstance(settings["friction"], dict):
        settings["friction"] = {block.label: next(iter(settings["friction"].values()))}
    elif settings["friction"] is not None:
        settings["friction"] = {block.label: settings["friction"][0]}
    bare = screened.drop_vars([name for name in screened.coords if name != "reason"])
    how = {"outside": "mean", "scale_factor_lowest": "min"}
    kept = {
        name: getattr(variable, how.get(str(name), "max"))("block") if "block" in variable.dims else variable
        for name, variable in bare.data_vars.items()
        if not str(name).startswith("undecided")
    }
    ratio = block.h / block.b
    kept |= {"squat": xr.DataArray(ratio < SQUAT_RATIO), "friction_uplift": xr.DataArray(1.0 / ratio)}
    if "undecided" in screened:
        tested = settings["tested_runs"]
        kept["undecided"] = bare["undecided"].mean("block")
        ends = wilson_interval(np.rint(kept["undecided"].values * tested), np.full(kept["undecided"].shape, tested))
        for end, values in zip(("lower", "upper"), ends, strict=True):
            kept[f"undecided_{end}"] = kept["undecided"].copy(data=values)
    label = {"block": xr.Variable("block", np.array([block.label], dtype=object), screened["block"].attrs)}
    if BED in screened.coords:
        label[BED] = screened[BED].variable[:1]
    variables = {}
    for name, quantity in kept.items():
        of_blocks = "block" in screened[name].dims
        variables[name] = (quantity.expand_dims("block") if of_blocks else quantity).assign_attrs(screened[name].attrs)
    text = json.dumps(settings, ensure_ascii=False)
    return xr.Dataset(variables, {**label, "reason": screened["reason"]}, {"screen": text})
