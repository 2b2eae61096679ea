"""What labelled runs were made of, read back: configuration, design, measure, blocks, laws, motions, scale factors.

The one place that knows how `ida`, `stripes` and `cloud` write these down; and what a result that is made of other
datasets says of them.
"""

from __future__ import annotations

import json
from collections.abc import Hashable, Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ..models import LAWS, Block, Law
from ..motions.arrays import Record, floor_coordinates, records
from ..motions.intensity import Measure
from ..units import provenance
from .block_factors import BlockFactors, Factors
from .scaling import BlockMeasure, intensity_measure

Motions = xr.DataArray | Iterable[xr.DataArray] | Sequence[Iterable[xr.DataArray]]

IDA, STRIPES, CLOUD = "ida", "stripes", "cloud"
GROUND = "ground"
"""Value of ``im_at`` where levels are of the ground motion below a floor, and the beginning of that measure's name."""

DESCRIBED = 1000
"""Blocks that a configuration describes one by one: it is read and written for every slab of runs."""


def configuration_of(data: xr.Dataset | xr.DataArray) -> dict[str, Any]:
    """The configuration in the attributes of a dataset, empty where it carries none that can be read.

    Datasets come from files of others, too, whose attribute of that name may be anything.
    """
    try:
        found = json.loads(data.attrs.get("configuration", "{}"))
    except (TypeError, ValueError):
        return {}
    return found if isinstance(found, dict) else {}


def levels_of_the_ground(data: xr.Dataset) -> bool:
    """Whether levels are of the ground motion below a floor and not of the floor's own."""
    return bool(data.attrs.get("im_at", configuration_of(data).get("im_at")) == GROUND)


def provenance_from(analysis: str, options: Mapping[str, Any], **sources: xr.Dataset) -> dict[str, Any]:
    """`units.provenance` of a result: the analysis, its options, and the configurations of what it was made of."""
    made_of = {name: configuration_of(one) for name, one in sources.items()}
    return provenance({"analysis": analysis, **options, **made_of})


def carried_attributes(attributes: Mapping[Any, Any]) -> dict[Hashable, Any]:
    """The attributes of runs on a result that stands for them, with the versions of what made it."""
    kept = {"configuration": attributes["configuration"]} if "configuration" in attributes else {}
    return {**attributes, **provenance({}), **kept}


def design_of(runs: xr.Dataset | xr.DataArray) -> str:
    """What was done with the motions of runs: ida, stripes or cloud.

    Results of stripes and clouds may hold other things on level, so their own coordinates come first.
    """
    if "intensity" in runs.coords:
        return STRIPES if "stripe" in runs.coords else CLOUD
    if "level" in runs.coords:
        return IDA
    if "level" in runs.dims:
        raise ValueError("runs must have a level coordinate, got a level dimension without values")
    raise ValueError(f"runs must have levels or intensities as coordinates, got dims {tuple(runs.dims)}")


def intensity_of(runs: xr.Dataset) -> xr.DataArray:
    """The levels of runs, or the intensity of each motion where it is run at one alone."""
    return runs["level" if design_of(runs) == IDA else "intensity"]


def scaled_to_levels(runs: xr.Dataset) -> bool:
    """Whether motions were brought to the levels, or run as they are: in a cloud, and in stripes if so asked."""
    return design_of(runs) != CLOUD and bool(configuration_of(runs).get("scale", True))


class LevelMeasure(NamedTuple):
    """The measure that the levels of runs are of: its name in them, and what it is; None for plain factors.

    values: of the motions as they are, on motion (and block, where it depends on it); 1 for plain factors.
    """

    name: str
    measure: Measure | None
    values: xr.DataArray


def level_measure(runs: xr.Dataset) -> LevelMeasure:
    """The measure of the levels of runs; ``ground_pga`` where it is of the ground motion below.

    Raises
    ------
    ValueError
        Levels that do not say of which measure, or motions that do not carry it.
    """
    levels = intensity_of(runs)
    if "im" not in levels.attrs:
        raise ValueError("runs must have levels or intensities and say of which measure, as toppling.ida returns them")
    im = str(levels.attrs["im"])
    one = intensity_measure(im)
    if one is None:
        return LevelMeasure(im, None, xr.DataArray(np.ones(runs.sizes["motion"]), dims="motion"))
    measure = one.measure if isinstance(one, BlockMeasure) else one
    below = f"{GROUND}_{im}"
    name = below if below in runs.coords or levels_of_the_ground(runs) else im
    if name in runs.coords:
        return LevelMeasure(name, measure, runs[name])
    if design_of(runs) == CLOUD:  # what it was run at is what it has
        return LevelMeasure(name, measure, levels)
    raise ValueError(f"runs must have the coordinate {name!r}, the measure of their levels, got none")


def scale_factor(runs: xr.Dataset) -> xr.DataArray:
    """Scale factors on motion, and on level and block where they depend on them; ValueError where nothing says them."""
    if not scaled_to_levels(runs):
        return xr.DataArray(np.ones(runs.sizes["motion"]), dims=("motion",))
    one = level_measure(runs)
    ratios = intensity_of(runs).reset_coords(drop=True) / one.values.reset_coords(drop=True)
    order = [dim for dim in ("block", "level", "motion") if dim in ratios.dims]
    factors = ratios if one.measure is None else ratios.copy(data=one.measure.factors(ratios.values))
    return factors.transpose(*order)


def factors_of(runs: xr.Dataset) -> NDArray[np.float64]:
    """Scale factors of labelled runs (block or 1, level or 1, motion), as they were: from levels and measures."""
    factors = scale_factor(runs)
    for dim in ("block", "level"):
        if dim not in factors.dims:
            factors = factors.expand_dims(dim)
    return np.ascontiguousarray(factors.transpose("block", "level", "motion").values)


def factors_under(runs: xr.Dataset, motions: NDArray[np.bool_]) -> Factors:
    """`factors_of` some of the motions, made part by part where they differ from block to block at levels."""
    one = level_measure(runs) if scaled_to_levels(runs) and design_of(runs) == IDA else None
    if one is None or one.measure is None or "block" not in one.values.dims:
        return factors_of(runs)[:, :, motions]
    levels = np.asarray(intensity_of(runs).values, dtype=float)
    measured = np.ascontiguousarray(one.values.transpose("block", "motion").values[:, motions])
    return BlockFactors(levels, measured, one.measure, np.ones(levels.size))


FLOORS = ("floor", "motion_floor")
"""What the floor of each motion is called: by `toppling.ida`, and in results with a dimension `floor` beside it."""


def floor_of_each_motion(runs: xr.Dataset | xr.DataArray) -> list[str]:
    """The floor of each motion as text, empty where none is said."""
    name = next(iter(_floor_names(runs)), None)
    return [""] * runs.sizes["motion"] if name is None else [str(one) for one in runs[name].values]


def without_floors(runs: xr.Dataset) -> xr.Dataset:
    """Runs whose motions do not say of which floor they are."""
    return runs.drop_vars(_floor_names(runs))


def _floor_names(runs: xr.Dataset | xr.DataArray) -> list[str]:
    return [one for one in FLOORS if one in runs.coords and runs[one].dims == ("motion",)]


def motions_by_floor(runs: xr.Dataset | xr.DataArray) -> tuple[xr.Variable | None, list[NDArray[np.intp]]]:
    """The floors, and which motions are of each; one group and no floors where they are not told apart."""
    of_motion = floor_of_each_motion(runs)
    labels = list(dict.fromkeys(of_motion))
    if len(labels) < 2:
        return None, [np.arange(runs.sizes["motion"])]
    whole = all(label.isdecimal() for label in labels)
    floors = floor_coordinates([int(label) for label in labels] if whole else labels)["floor"]
    return floors, [np.flatnonzero([one == label for one in of_motion]) for label in labels]


def blocks_of(runs: xr.Dataset) -> list[Block]:
    """The blocks of labelled runs, from their coordinates."""
    names = ("width", "height", "cm_height", "inertia_factor")
    columns = {name: runs[name].values.astype(float).tolist() for name in names}
    return [
        Block(name=str(label), **{name: column[i] for name, column in columns.items()})
        for i, label in enumerate(runs["block"].values)
    ]


def laws_of(runs: xr.Dataset) -> list[Law]:
    """The laws of labelled runs, from their configuration; ValueError where it does not hold them."""
    try:
        described = [dict(one) for one in configuration_of(runs)["models"]]
        unknown = [one["law"] for one in described if one["law"] not in LAWS]
        if unknown:
            raise ValueError(f"runs must have laws of this package to be repeated, got {unknown[0]!r}")
        laws = [LAWS[one.pop("law")](**one) for one in described]
        known = {one.label: one for one in laws}
        return [known[str(label)] for label in runs["model"].values]
    except (KeyError, TypeError) as error:
        raise ValueError(f"runs must carry the configuration that toppling.ida writes: {error} is wrong") from None


def records_of(runs: xr.Dataset, motions: Motions) -> list[Record]:
    """The plain records of labelled runs, in their order; ValueError where one is missing or another motion."""
    if "stripe" not in runs.coords:
        known = {one.label: one for one in records(motions)}  # type: ignore[arg-type]
        return [_same(runs, i, known.get(str(label))) for i, label in enumerate(runs["motion"].values)]
    sets: list[Any] = [] if isinstance(motions, xr.DataArray) else list(motions)
    keys = list(zip(runs["stripe"].values.tolist(), map(str, runs["record"].values), strict=True))
    if len(sets) < max(stripe for stripe, _ in keys):
        raise ValueError(f"motions must be one set for each of the {max(k for k, _ in keys)} stripes, got {len(sets)}")
    found = {(k, one.label): one for k, own in enumerate(sets, start=1) for one in records(own)}
    return [_same(runs, i, found.get(key)) for i, key in enumerate(keys)]


def _same(runs: xr.Dataset, i: int, record: Record | None) -> Record:
    name = str(runs["motion"].values[i])
    if record is None:
        raise ValueError(f"motions must hold motion {name!r} of the runs, got none")
    pga = float(np.abs(record.acceleration).max())
    if "pga" in runs.coords and not np.isclose(pga, float(runs["pga"].values[i]), rtol=1e-9, atol=0.0):
        raise ValueError(
            f"motion {name!r} must be the one of the runs, with a pga of {float(runs['pga'].values[i]):g} m/s², "
            f"got one of {pga:g} m/s²"
        )
    return record
