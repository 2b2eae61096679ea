"""What labelled runs were made of: blocks, laws, records and scale factors, read back from their dataset."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ..models import LAWS, Block, Law
from ..motions.arrays import Record, records
from ..motions.intensity import Measure
from .scaling import BlockMeasure, intensity_measure

Motions = xr.DataArray | Iterable[xr.DataArray] | Sequence[Iterable[xr.DataArray]]


def described(runs: xr.Dataset) -> tuple[list[Block], list[Law]]:
    """Blocks and laws of labelled runs, from their configuration."""
    try:
        configuration = json.loads(runs.attrs["configuration"])
        blocks = {one["name"]: Block(**one) for one in configuration["blocks"]}
        unknown = [one["law"] for one in configuration["models"] if one["law"] not in LAWS]
        if unknown:
            raise ValueError(f"runs must have laws of this package to be repeated, got {unknown[0]!r}")
        laws = [LAWS[one.pop("law")](**one) for one in configuration["models"]]
    except (KeyError, TypeError) as error:
        raise ValueError(f"runs must carry the configuration that toppling.ida writes: {error} is wrong") from None
    models = {one.label: one for one in laws}
    return (
        [blocks[str(label)] for label in runs["block"].values],
        [models[str(label)] for label in runs["model"].values],
    )


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
        raise ValueError(f"motions must hold the motion {name!r} of the runs, got none")
    pga = float(np.abs(record.acceleration).max())
    if "pga" in runs.coords and not np.isclose(pga, float(runs["pga"].values[i]), rtol=1e-9, atol=0.0):
        raise ValueError(
            f"motion {name!r} must be the one of the runs, with a pga of {float(runs['pga'].values[i]):g} m/s², "
            f"got one of {pga:g} m/s²"
        )
    return record


def factors_of(runs: xr.Dataset) -> NDArray[np.float64]:
    """Scale factors of labelled runs (block or 1, level or 1, motion), as they were: from levels and measures."""
    factors = scale_factor(runs)
    for dim in ("block", "level"):
        if dim not in factors.dims:
            factors = factors.expand_dims(dim)
    return np.ascontiguousarray(factors.transpose("block", "level", "motion").values)


def scale_factor(runs: xr.Dataset) -> xr.DataArray:
    """Scale factors on motion, and on level and block where they depend on them; ValueError where nothing says them."""
    ones = xr.DataArray(np.ones(runs.sizes["motion"]), dims=("motion",))
    configuration = json.loads(runs.attrs.get("configuration", "{}"))
    design = runs.attrs.get("design", "ida" if "level" in runs.dims else None)
    if design == "cloud" or configuration.get("scale") is False:
        return ones
    where = "level" if "level" in runs.dims else "intensity"
    if where not in runs.coords or "im" not in runs[where].attrs:
        raise ValueError("runs must have levels or intensities and say of which measure, as toppling.ida returns them")
    wanted = runs[where].reset_coords(drop=True)
    im = str(runs[where].attrs["im"])
    one = intensity_measure(im)
    if one is None:
        return wanted * ones
    name = f"ground_{im}" if configuration.get("im_at") == "ground" else im
    if name not in runs.coords:
        raise ValueError(f"runs must have the coordinate {name!r}, the measure of their levels, got none")
    ratios = wanted / runs[name].reset_coords(drop=True)
    base: Measure = one.measure if isinstance(one, BlockMeasure) else one
    order = [dim for dim in ("block", "level", "motion") if dim in ratios.dims]
    return ratios.copy(data=base.factors(ratios.values)).transpose(*order)
