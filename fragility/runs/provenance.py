"""Provenance of labelled runs, read from datasets: configuration, design, measure, blocks, laws, motions, factors.

This module alone defines the records of `ida`, `stripes` and `cloud`, and the records of them in derived results.
"""

import json
import math
from collections.abc import Hashable, Iterable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ...core import checks
from ...core.aliases import Array, Flags, Index
from ...core.units import provenance
from ...models import LAWS, Block, Law
from ...models.block import block_from
from ...motions.arrays import BOTH_AXES, DRAW, POLARITY, RECORD, Record, floor_coordinates, listed
from ...motions.intensity.measure import Measure
from ...motions.intensity.naming import FLOOR, GROUND, GROUND_FLOORS, place_in
from ...motions.polarity import AS_RECORDED, BOTH, records_under
from ..numerics.slabs import spread
from .factors import BlockFactors, Factors, ScaleFactors, unscaled
from .scaling import BlockMeasure, intensity_measure

Motions = xr.DataArray | Iterable[xr.DataArray] | Sequence[Iterable[xr.DataArray]]

IDA, STRIPES, CLOUD, ADAPTIVE, PLANNED = "ida", "stripes", "cloud", "adaptive", "planned"
RUN = "run"
"""Dimension of the runs of adaptive levels, each of one block, law and motion at one level."""
SCENE = "scene"
"""Coordinate of blocks that are not symmetric and freestanding: their special features, as JSON."""
BED = "bed_settlement"
"""Coordinate of blocks on soft beds: the settlement, m."""
EDGE = "edge"
"""Coordinate of blocks near edges: the places of the edges, as JSON."""

AXES = "axes"
"""Entry of a configuration: `BOTH_AXES` or `WEAK_AXIS`, if blocks are run about these."""
DESCRIBED = 1000
"""Maximum number of blocks that a configuration describes one by one: it is read and written for each slab of runs."""


def configuration_of(data: xr.Dataset | xr.DataArray) -> dict[str, Any]:
    """Return the configuration in the attributes of a dataset, empty if there is none that can be read.

    Datasets may be from files of other programs, whose attribute of that name may have any content.
    """
    try:
        configuration = json.loads(data.attrs.get("configuration", "{}"))
    except (TypeError, ValueError):
        return {}
    return configuration if isinstance(configuration, dict) else {}


def load_coordinates(data: xr.Dataset) -> None:
    """Load the coordinates of a dataset in place, as reading their values does.

    On merging, xarray compares the common variables of two datasets: lazily, with a warning, if they are not the same
    array.
    """
    for variable in data.coords.variables.values():
        variable.load()


def coordinates_on(data: xr.Dataset | xr.DataArray, dims: Iterable[Hashable]) -> dict[str, xr.Variable]:
    """Return the coordinates of data that lie on `dims` alone."""
    on = {*dims}
    return {str(name): coordinate.variable for name, coordinate in data.coords.items() if {*coordinate.dims} <= on}


def levels_of_the_ground(data: xr.Dataset) -> bool:
    """Return True if levels refer to the ground motion below a floor (``im_at``) and not to the floor motion."""
    return bool(data.attrs.get("im_at", configuration_of(data).get("im_at")) == GROUND)


def upper_floors(curves: xr.Dataset) -> list[str]:
    """Return the floors above the ground whose motions the levels of curves refer to.

    Curves of runs on one floor have no coordinate of it: the long name of their levels shows the place. Curves from
    elsewhere may have the floor below the block in their names, which can be the ground.
    """
    if levels_of_the_ground(curves):
        return []
    if "floor" in curves.coords:
        labels = [str(floor) for floor in np.atleast_1d(curves["floor"].values)]
        return [f"floor {label}" for label in labels if label not in GROUND_FLOORS]
    levels = curves["median" if "median" in curves else "level"]
    on_floor = "design" in curves.attrs and place_in(str(levels.attrs.get("long_name", ""))) == FLOOR
    return ["a floor"] if on_floor else []


def provenance_from(analysis: str, options: Mapping[str, Any], **sources: xr.Dataset) -> dict[str, Any]:
    """Return `units.provenance` of a result: the analysis, its options, and the configurations of its sources."""
    made_of = {name: configuration_of(source) for name, source in sources.items()}
    return provenance({"analysis": analysis, **options, **made_of})


def carried_attributes(attributes: Mapping[Any, Any]) -> dict[Hashable, Any]:
    """Return the attributes of runs for a result derived from them, with the versions of the present packages."""
    kept = {"configuration": attributes["configuration"]} if "configuration" in attributes else {}
    return {**attributes, **provenance({}), **kept}


def design_of(runs: xr.Dataset | xr.DataArray) -> str:
    """Return the design of runs: ida, stripes, cloud or adaptive.

    Results of stripes and clouds may have variables on level, too, so the coordinate `intensity` is checked first.
    """
    if RUN in runs.dims:
        return ADAPTIVE
    if "intensity" in runs.coords:
        return STRIPES if "stripe" in runs.coords else CLOUD
    if "level" in runs.coords:
        return IDA
    if "level" in runs.dims:
        raise ValueError("runs must have a level coordinate, got a level dimension without values")
    raise ValueError(f"runs must have levels or intensities as coordinates, got dims {tuple(runs.dims)}")


def intensity_of(runs: xr.Dataset) -> xr.DataArray:
    """Return the levels of runs, or the intensity of each motion if each motion is run at one intensity.

    Adaptive levels, of which each run has its own, are a ValueError.
    """
    design = design_of(runs)
    if design == ADAPTIVE:
        raise ValueError("runs must be at common levels or at one intensity a motion, got a level for each run")
    return runs["level" if design == IDA else "intensity"]


def scaled_to_levels(runs: xr.Dataset) -> bool:
    """Return True if motions were scaled to the levels, False for clouds and for stripes with ``scale=False``."""
    return design_of(runs) != CLOUD and bool(configuration_of(runs).get("scale", True))


class LevelMeasure(NamedTuple):
    """The measure of the levels of runs: its name in the dataset, and the measure itself, None for plain factors.

    values: of the unscaled motions, on motion (and on block, if the measure depends on it); 1 for plain factors.
    """

    name: str
    measure: Measure | None
    values: xr.DataArray


def level_measure(runs: xr.Dataset) -> LevelMeasure:
    """Return the measure of the levels of runs; its name is ``ground_pga`` if it belongs to the ground motion below."""
    levels = runs["level"] if design_of(runs) == ADAPTIVE else intensity_of(runs)
    if "im" not in levels.attrs:
        raise ValueError("runs must have levels or intensities and say of which measure, as toppling.ida returns them")
    im = str(levels.attrs["im"])
    intensity = intensity_measure(im)
    if intensity is None:
        return LevelMeasure(im, None, xr.DataArray(np.ones(runs.sizes["motion"]), dims="motion"))
    measure = intensity.measure if isinstance(intensity, BlockMeasure) else intensity
    below = f"{GROUND}_{im}"
    name = below if below in runs.coords or levels_of_the_ground(runs) else im
    if name in runs.coords:
        return LevelMeasure(name, measure, runs[name])
    if design_of(runs) == CLOUD:  # motions are run at their own intensity
        return LevelMeasure(name, measure, levels)
    raise ValueError(f"runs must have the coordinate {name!r}, the measure of their levels, got none")


def scale_factors(runs: xr.Dataset) -> ScaleFactors:
    """Return the scale factors of labelled runs, from their levels and measures, to be computed slab by slab."""
    if not scaled_to_levels(runs):
        return unscaled(runs.sizes["motion"])
    levels = level_measure(runs)
    return ScaleFactors(intensity_of(runs).variable, levels.values.variable, levels.measure)


def factors_of(runs: xr.Dataset) -> Array:
    """Return the scale factors of labelled runs (block or 1, level or 1, motion), from levels and measures."""
    return np.ascontiguousarray(spread(scale_factors(runs).values, ("block", "level", "motion")))


def factors_under(runs: xr.Dataset, motions: Flags) -> Factors:
    """Return `factors_of` for some motions, to be computed part by part if they differ between blocks at levels."""
    levels_measure = level_measure(runs) if scaled_to_levels(runs) and design_of(runs) == IDA else None
    if levels_measure is None or levels_measure.measure is None or "block" not in levels_measure.values.dims:
        return factors_of(runs)[:, :, motions]
    levels = np.asarray(intensity_of(runs).values, dtype=float)
    measured = np.ascontiguousarray(levels_measure.values.transpose("block", "motion").values[:, motions])
    return BlockFactors(levels, measured, levels_measure.measure, np.ones(levels.size))


FLOORS = ("floor", "motion_floor")
"""Names of the coordinate with the floor of each motion: by `toppling.ida`, and in results with a dimension `floor`."""


def floor_of_each_motion(runs: xr.Dataset | xr.DataArray) -> list[str]:
    """Return the floor of each motion as text, empty if none is given."""
    return floor_labels(runs.coords, runs.sizes["motion"])


def floor_labels(coordinates: Mapping[Any, xr.Variable | xr.DataArray], motions: int) -> list[str]:
    """Return the floor of each motion as text from the coordinates of runs, empty if none is given."""
    name = next(iter(floor_names(coordinates)), None)
    return [""] * motions if name is None else [str(value) for value in coordinates[name].values]


def floor_names(coordinates: Mapping[Any, xr.Variable | xr.DataArray]) -> list[str]:
    """Return the names of the coordinates with the floors of the motions."""
    return [floor for floor in FLOORS if floor in coordinates and coordinates[floor].dims == ("motion",)]


def motions_by_floor(runs: xr.Dataset | xr.DataArray) -> tuple[xr.Variable | None, list[NDArray[np.intp]]]:
    """Return the floors and the indices of the motions of each; None and one group if there is one floor or none."""
    of_motion = floor_of_each_motion(runs)
    labels = list(dict.fromkeys(of_motion))
    if len(labels) < 2:
        return None, [np.arange(runs.sizes["motion"])]
    whole = all(label.isdecimal() for label in labels)
    floors = floor_coordinates([int(label) for label in labels] if whole else labels)["floor"]
    return floors, [np.flatnonzero([floor == label for floor in of_motion]) for label in labels]


def clusters_of(runs: xr.Dataset | xr.DataArray) -> Index:
    """Return the number of each motion's ground motion, which floors, stripes and polarities share, as they occur."""
    floors = floor_of_each_motion(runs)
    # numbers replace missing labels; in stripes a repeated motion has another label
    labels = [str(value) for value in runs[RECORD if RECORD in runs.coords else "motion"].values]
    names = [
        label.removesuffix(f" floor {floor}") if floor else label for label, floor in zip(labels, floors, strict=True)
    ]
    known = {name: i for i, name in enumerate(dict.fromkeys(names))}
    return np.array([known[name] for name in names], dtype=np.int64)


def number_of_motions(runs: xr.Dataset | xr.DataArray) -> int:
    """Return the number of motions, those run several times once; on several floors each floor's motion is one."""
    if "motion" not in runs.sizes:  # (of a pooled surface, whose runs have numbers of motions alone)
        return int(runs["motions_run"].max())
    if POLARITY not in runs.coords and DRAW not in runs.coords:
        return int(runs.sizes["motion"])
    stripe = runs["stripe"].values.tolist() if "stripe" in runs.coords else [0] * runs.sizes["motion"]
    # (the floor histories of a building may be others at each level and place, equally many everywhere)
    names = runs[RECORD].isel({dim: 0 for dim in runs[RECORD].dims if dim != "motion"})
    return len(set(zip(map(str, names.values), stripe, strict=True)))


def polarity_pairs(runs: xr.Dataset | xr.DataArray) -> Index:
    """Return a number for each motion, the same for one that is run both ways and its reverse."""
    return clusters_of(runs) if POLARITY in runs.coords else np.arange(runs.sizes["motion"])


def as_given(runs: xr.Dataset | xr.DataArray) -> Flags:
    """Return True for each motion that is run as given, False for a reverse."""
    if POLARITY not in runs.coords:
        return np.ones(runs.sizes["motion"], np.bool_)
    return np.asarray(runs[POLARITY].values > 0)


def about_both_axes(data: xr.Dataset | xr.DataArray) -> bool:
    """Return True for runs of blocks about both axes, and for a result derived from them alone."""
    configuration = configuration_of(data)
    of_runs = configuration.get("runs")
    return (of_runs if isinstance(of_runs, dict) else configuration).get(AXES) == BOTH_AXES


def blocks_of(runs: xr.Dataset) -> list[Block]:
    """Return the blocks of labelled runs from their coordinates; of uncertain blocks the blocks of the first sample."""
    if "sample" in runs.dims:  # (what does not differ between blocks is not on block there)
        of = [name for name in runs.coords if {"sample", "block"} >= {*runs[name].dims}]
        first = runs[of].isel(sample=0)
        runs = xr.Dataset(coords={name: array.broadcast_like(first["block"]) for name, array in first.coords.items()})
    names = ("width", "height", "cm_height", "inertia_factor")
    columns: dict[str, list[Any]] = {name: runs[name].values.astype(float).tolist() for name in names}
    if "depth" in runs.coords:
        columns["depth"] = [None if math.isnan(depth) else depth for depth in runs["depth"].values.tolist()]
    if "round" in runs.coords:
        columns["round"] = runs["round"].values.tolist()
    if EDGE in runs.coords:
        columns["edge"] = [json.loads(text) for text in runs[EDGE].values]
    labels = runs["block"].values
    scenes = [json.loads(text) for text in runs[SCENE].values] if SCENE in runs.coords else [{}] * len(labels)
    return [
        block_from({"name": str(label), **{name: column[i] for name, column in columns.items()}, **scenes[i]})
        for i, label in enumerate(labels)
    ]


def tilt_limits(results: xr.Dataset) -> dict[str, float]:
    """Return the rotations (degrees) that count as overturning, by block or line of an inventory that has one."""
    if SCENE not in results.coords or results[SCENE].dims != ("block",):
        return {}
    scenes = zip(results["block"].values, results[SCENE].values, strict=True)
    limits = {str(label): json.loads(str(text)).get("tilt_limit") for label, text in scenes}
    return {label: math.degrees(limit) for label, limit in limits.items() if limit is not None}


def laws_of(runs: xr.Dataset) -> list[Law]:
    """Return the laws of labelled runs, from their configuration; ValueError if it does not contain them."""
    try:
        described = [dict(law) for law in configuration_of(runs)["models"]]
        unknown = [law["law"] for law in described if law["law"] not in LAWS]
        if unknown:
            raise ValueError(f"runs must have laws of this package to be repeated, got {unknown[0]!r}")
        laws = [LAWS[law.pop("law")](**law) for law in described]
        known = {law.label: law for law in laws}
        return [known[str(label)] for label in runs["model"].values]
    except (KeyError, TypeError) as error:
        raise ValueError(f"runs must carry the configuration that toppling.ida writes: {error} is wrong") from None


def records_of(runs: xr.Dataset, motions: Motions) -> list[Record]:
    """Return the motions of labelled runs as records, in order; ValueError if one is missing or differs.

    Of runs both ways the motions may be given both ways or as they were.
    """
    checks.plain("runs", runs)
    if "motion" not in runs.coords:
        raise ValueError("runs must have the coordinate motion, the labels of their motions")
    polarity = BOTH if POLARITY in runs.coords else AS_RECORDED
    if "stripe" not in runs.coords:
        known = {record.label: record for record in records_under(motions, polarity)}  # type: ignore[arg-type]
        return same_motions(runs, [known.get(str(label)) for label in runs["motion"].values])
    sets: list[Any] = [] if isinstance(motions, xr.DataArray) else listed(motions)
    stripe = runs["stripe"].values.tolist()
    keys = list(zip(stripe, map(str, runs[RECORD].values), as_given(runs).tolist(), strict=True))
    if len(sets) < max(stripe):
        raise ValueError(f"motions must be one set for each of the {max(stripe)} stripes, got {len(sets)}")
    records = {
        (k, record.given, not record.reverse_of): record
        for k, members in enumerate(sets, start=1)
        for record in records_under(members, polarity)
    }
    return same_motions(runs, [records.get(key) for key in keys])


def places_in(runs: xr.Dataset) -> dict[str, Index]:
    """Return the positions of the block, the law and the motion of each run at adaptive levels, -1 for omitted runs."""
    places = {}
    for dim in ("block", "model", "motion"):
        numbers = np.atleast_1d(runs[f"{dim}_number"].values)
        order = np.argsort(numbers, kind="stable")
        at = order[np.minimum(np.searchsorted(numbers[order], runs[f"run_{dim}"].values), numbers.size - 1)]
        places[dim] = np.where(numbers[at] == runs[f"run_{dim}"].values, at, -1)
    return places


def curves_of(runs: xr.Dataset) -> Iterator[tuple[int, int, Index, Index]]:
    """Yield each block and law at adaptive levels, the places of their runs, and of the motion of each run."""
    block, model = (np.atleast_1d(runs[f"{dim}_number"].values) for dim in ("block", "model"))
    motion = places_in(runs)["motion"]
    for i, j in np.ndindex(block.size, model.size):
        selected = (runs["run_block"].values == block[i]) & (runs["run_model"].values == model[j]) & (motion >= 0)
        mine = np.flatnonzero(selected)
        yield i, j, mine, motion[mine]


def runs_near_curves(runs: xr.Dataset) -> Flags:
    """Return True for runs (run,) after the first wave, which searches for curves over a wide range.

    Of a curve that has no other wave, True for all.
    """
    places = places_in(runs)
    there = np.logical_and.reduce([place >= 0 for place in places.values()])
    curve = places["block"] * runs["model"].size + places["model"]
    later = there & (runs["wave"].values > 0)
    near: Flags = later | (there & ~np.isin(curve, curve[later]))
    return near


def same_motions(runs: xr.Dataset, records: Sequence[Record | None]) -> list[Record]:
    """Return the records of the motions of runs; ValueError if there is none, or one with another PGA."""
    stored = runs["pga"].values.tolist() if "pga" in runs.coords else [None] * len(records)
    matched = []
    for name, record, pga in zip(runs["motion"].values, records, stored, strict=True):
        if record is None:
            raise ValueError(f"motions must hold motion {str(name)!r} of the runs, got none")
        peak = float(np.abs(record.acceleration).max())
        if pga is not None and not math.isclose(peak, pga, rel_tol=1e-9):
            raise ValueError(
                f"motion {str(name)!r} must be the one of the runs, with a pga of {pga:g} m/s², got one of "
                f"{peak:g} m/s²"
            )
        matched.append(record)
    return matched
