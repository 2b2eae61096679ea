"""The screen of runs as shares and greatest demands, without a value for every run."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence

import numpy as np
import xarray as xr

from ...core.units import described
from ...models import Block, Law
from ...models.friction import Friction
from ...motions.arrays import DOWNWARD, OWN_AMPLITUDE, POLARITY, RECORD, Record, motion_coordinates
from ..numerics.proportions import wilson_interval
from ..numerics.slabs import Where
from ..runs.factors import ScaleFactors
from ..runs.labels import block_coordinates
from ..runs.provenance import BED
from .characteristics import Characteristics
from .reasons import Shares, labelled, reason_names
from .slab_screen import (
    SQUAT_RATIO,
    Bounds,
    ScreenInput,
    described_friction,
    few_motions,
    screened_slabs,
    settings_of,
    undecided_shares,
)
from .sliding import NEEDS, friction_by_block
from .undecided import FlipCounts

OF_BLOCKS = ("squat", "friction_uplift", "friction_impact", "elastic_frequency")
"""Variables that do not depend on the motion."""
DEMANDS = tuple(name for name, _ in NEEDS.values() if name not in OF_BLOCKS)
"""Variables of every run of which the greatest value is kept."""
ENDS = {"scale_factor_lowest": np.fmin, "scale_factor_highest": np.fmax}
"""Variables that hold the ends of the scale factors."""


def input_of_pairs(
    labels: Sequence[str],
    pairs: Sequence[Sequence[tuple[Block, Law]]],
    motions: Sequence[Record],
    factors: ScaleFactors,
) -> ScreenInput:
    """Return the properties of the runs of blocks, each under its own laws, that the screen needs.

    `pairs` (block, model) have the block, the same in a row, with each of its laws.
    """

    def of_laws(values: list[list[object]]) -> xr.Variable:
        return xr.Variable(("block", "model"), np.array(values).reshape(len(pairs), -1))

    kept = (RECORD, POLARITY, DOWNWARD)
    e = [[law.restitution(block) for block, law in row] for row in pairs]
    known = {
        **block_coordinates([row[0][0] for row in pairs]),
        "block": xr.Variable("block", np.array(labels, dtype=object)),
        "e": of_laws([[np.nan if one is None else one for one in row] for row in e]),
        "delta": of_laws([[getattr(law, "delta", np.nan) for _, law in row] for row in pairs]),
        "rest": of_laws([[str(getattr(law, "rest", "")) for _, law in row] for row in pairs]),
        "pga": xr.Variable("motion", [float(np.abs(one.acceleration).max()) for one in motions]),
        "own_amplitude": xr.Variable("motion", [one.own_amplitude for one in motions], OWN_AMPLITUDE),
        **{name: one for name, one in motion_coordinates(list(motions)).items() if name in kept},
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
    friction: Friction | Mapping[str, Friction] | None = None,
    flips: FlipCounts | None = None,
) -> xr.Dataset:
    """Screen runs as `screen` does, and keep shares and greatest demands alone.

    friction_uplift_demand and friction_rocking_demand on block are the greatest of all levels and motions,
    scale_factor_lowest and scale_factor_highest (block) are the ends of the factors, and there is neither a verdict nor
    a chance of sliding of single runs. Without a friction, only a need above 1 counts as sliding; `flips` are of the
    runs that were repeated under perturbations.
    """
    limits = Bounds()
    labels = [str(label) for label in given.coordinates["block"].values]
    available = friction_by_block(friction, labels)
    blocks = given.sizes["block"]
    found: dict[str, xr.Variable] = {}
    most = {name: np.full(blocks, np.nan) for name in (*DEMANDS, *ENDS)}
    texts: dict[str, str] = {}
    shares = Shares(given.sizes)
    for slab in screened_slabs(given, shaking, available, limits, flips):
        shares.add(slab.holds, slab.variables["verdict"], slab.where)
        _put(found, slab.variables, slab.where, given.sizes)
        here = slab.where.get("block", slice(None))
        for name in DEMANDS:
            one = slab.variables[name]
            texts[name] = f"greatest {one.attrs['long_name']}"
            most[name][here] = np.fmax(most[name][here], _over_runs(one, np.fmax))
        for name, extreme in ENDS.items():
            most[name][here] = extreme(most[name][here], _over_runs(slab.variables["scale_factor"], extreme))
            texts[name] = f"{name.rpartition('_')[2]} scale factor of the motions"
    found |= {name: labelled(xr.Variable("block", values), texts[name]) for name, values in most.items()}
    if flips is not None:
        found |= undecided_shares(flips, tuple(given.sizes))
    found["outside"] = shares.outside(found.get("undecided"))
    few, fewest = few_motions(given, limits)
    of_friction = described_friction(friction, available, labels)
    told = settings_of(limits, fewest, of_friction, True, 0 if flips is None else flips.tested, given.lifted)
    return xr.Dataset(
        {**found, **few},
        coords={
            "block": ("block", np.array(labels, dtype=object), described("block")),
            "reason": reason_names(),
            **{name: one for name, one in given.coordinates.items() if name == BED},
        },
        attrs={"screen": json.dumps(told, ensure_ascii=False)},
    )


def over_samples(screened: xr.Dataset, block: Block) -> xr.Dataset:
    """Return the screen of one uncertain block from that of its samples, which stand in place of blocks.

    squat and friction_uplift are of the nominal block; shares are of the runs of all samples; demands, frequencies and
    the ends of the scale factors are the extremes among them.
    """
    settings = json.loads(screened.attrs["screen"])
    settings["tested_runs"] *= screened.sizes["block"]
    if isinstance(settings["friction"], dict):
        settings["friction"] = {block.label: next(iter(settings["friction"].values()))}
    elif settings["friction"] is not None:
        settings["friction"] = {block.label: settings["friction"][0]}
    found = {}
    for name, one in screened.data_vars.items():
        if "block" not in one.dims:
            found[name] = one
        elif name == "outside":
            found[name] = one.mean("block")
        elif not str(name).startswith("undecided"):
            found[name] = one.min("block") if name == "scale_factor_lowest" else one.max("block")
    ratio = block.h / block.b
    found |= {"squat": xr.DataArray(ratio < SQUAT_RATIO), "friction_uplift": xr.DataArray(1.0 / ratio)}
    if "undecided" in screened:
        each = settings["tested_runs"]
        found["undecided"] = screened["undecided"].mean("block")
        ends = wilson_interval(np.rint(found["undecided"].values * each), np.full(found["undecided"].shape, each))
        for end, values in zip(("lower", "upper"), ends, strict=True):
            found[f"undecided_{end}"] = found["undecided"].copy(data=values)
    label = {"block": xr.Variable("block", np.array([block.label], dtype=object), screened["block"].attrs)}
    if BED in screened.coords:
        label[BED] = screened[BED].variable[:1]
    variables = {}
    for name, one in found.items():
        of_blocks = "block" in screened[name].dims
        bare = one.drop_vars([own for own in one.coords if own != "reason"])
        variables[name] = (bare.expand_dims("block") if of_blocks else bare).assign_attrs(screened[name].attrs)
    told = json.dumps(settings, ensure_ascii=False)
    return xr.Dataset(variables, {**label, "reason": screened["reason"]}, {"screen": told})


def _over_runs(one: xr.Variable, extreme: np.ufunc) -> np.ndarray:
    """The greatest or the least value over levels and motions, on block where it depends on it."""
    there = [dim for dim in ("block", "level", "motion") if dim in one.dims]
    values = one.transpose(*there).values
    flat = values.reshape(values.shape[0] if "block" in there else 1, -1)
    return np.asarray(extreme.reduce(flat, axis=1))


def _put(
    found: dict[str, xr.Variable], variables: Mapping[str, xr.Variable], where: Where, sizes: Mapping[str, int]
) -> None:
    """Put what depends on blocks and laws alone from a slab into the variables of all blocks."""
    for name in OF_BLOCKS:
        one = variables[name]
        dims = [dim for dim in ("block", "model") if dim in one.dims]
        if name not in found:
            found[name] = labelled(
                xr.Variable(dims, np.empty([sizes[dim] for dim in dims], one.dtype)),
                str(one.attrs["long_name"]),
                str(one.attrs["units"]),
            )
        found[name].values[where.get("block", slice(None))] = one.transpose(*dims).values
