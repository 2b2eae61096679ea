"""Results of runs as labelled datasets: the numbers behind blocks, laws and motions as coordinates."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ..models import Block, Law, describe_block, describe_law
from ..motions.arrays import Record, motion_coordinates
from ..motions.intensity import RESULT_MEASURES
from ..units import ANGULAR_VELOCITY, DIMENSIONLESS, METRE, RADIAN, SECOND, provenance
from .execution import DERIVED, Request, Runs
from .provenance import DESCRIBED
from .scaling import Scaling
from .slabs import Array

VARIABLES: dict[str, tuple[str, str]] = {
    "overturned": (DIMENSIONLESS, "whether the block overturned"),
    "peak_rotation": (RADIAN, "peak absolute rotation, pi/2 if overturned"),
    "uplifted": (DIMENSIONLESS, "whether the block uplifted"),
    "impacts": (DIMENSIONLESS, "impacts during the record"),
    "overturning_time": (SECOND, "time of overturning, NaN if it stands"),
    "impact_velocity": (ANGULAR_VELOCITY, "greatest angular speed at which the block came down"),
    "direction": (DIMENSIONLESS, "sign of the rotation in which the block fell, 0 if it stands"),
    "top_displacement": (METRE, "greatest horizontal displacement of the upper corner"),
}
"""Units and long name of each output."""


def label_runs(
    runs: Runs,
    asked: Request,
    motions: Sequence[Record],
    measures: Mapping[str, xr.Variable],
    dims: tuple[str, ...],
    coordinates: Mapping[str, xr.Variable],
    configuration: Mapping[str, Any],
    title: str,
) -> xr.Dataset:
    """Outputs (oscillator, …) as the dataset on (block, model, *dims) that analyses return.

    `coordinates` come beside those of blocks, laws, motions and their measures, `configuration` beside their
    descriptions.
    """
    lengths = [len(motions) if dim == "motion" else coordinates[dim].size for dim in dims]
    shape = (len(asked.blocks), len(asked.models), *lengths)
    variables = {}
    for name in asked.outputs:
        of = (block for block in asked.blocks for _ in asked.models)
        values = output(name, runs, of, asked.runner.array).reshape(shape)
        units, long_name = VARIABLES[name]
        variables[name] = (("block", "model", *dims), values, {"units": units, "long_name": long_name})
    described = {
        "blocks": (
            [describe_block(block) for block in asked.blocks]
            if len(asked.blocks) <= DESCRIBED
            else f"{len(asked.blocks)}, as their coordinates say"
        ),
        "models": [describe_law(model) for model in asked.models],
        "motions": [record.label for record in motions],
        **configuration,
    }
    return xr.Dataset(
        variables,
        coords={
            **block_coordinates(asked.blocks),
            **_model_coordinates(asked.blocks, asked.models),
            **motion_coordinates(list(motions)),
            **measures,
            **coordinates,
        },
        attrs={
            "title": title,
            "design": described["design"],
            **provenance(described),
            "skipped": json.dumps(runs.skipped),
        },
    )


def output(name: str, runs: Runs, blocks: Iterable[Block], array: Array) -> NDArray[Any]:
    """An output (oscillator, …), as the engine gave it or derived; `blocks`: one an oscillator."""
    values = runs.results[DERIVED.get(name, name)]
    if name == "top_displacement":
        derived = array(values.shape, values.dtype)
        for block, own, peaks in zip(blocks, derived, values, strict=True):
            np.multiply(block.height, np.sin(peaks, out=own), out=own)
        values = derived
    return values


def measured(scaled: Scaling) -> dict[str, xr.Variable]:
    """The measure of the levels, for the motions as they are, where it is not among those that every result has."""
    carried = scaled.name in {one.label for one in RESULT_MEASURES}
    if scaled.measured is None or (carried and not scaled.ground):
        return {}
    name = f"ground_{scaled.name}" if scaled.ground else scaled.name
    dims = ("motion",) if scaled.measured.ndim == 1 else ("block", "motion")
    attributes = {"units": scaled.units, "long_name": scaled.long_name}
    return {name: xr.Variable(dims, scaled.measured, attributes)}


def _strings(values: Sequence[str]) -> NDArray[np.object_]:
    return np.array(values, dtype=object)


def block_coordinates(blocks: Sequence[Block]) -> dict[str, xr.Variable]:
    """Labels of blocks and the numbers behind them, on ``block``."""
    columns: dict[str, tuple[list[float], str, str]] = {
        "width": ([b.width for b in blocks], METRE, "full width"),
        "height": ([b.height for b in blocks], METRE, "full height"),
        "cm_height": ([b.h for b in blocks], METRE, "height of the centre of mass"),
        "alpha": ([b.alpha for b in blocks], RADIAN, "slenderness angle"),
        "R": ([b.R for b in blocks], METRE, "distance from the centre of mass to the corner"),
        "p": ([b.p for b in blocks], ANGULAR_VELOCITY, "rocking frequency parameter"),
        "inertia_factor": ([b.inertia for b in blocks], DIMENSIONLESS, "moment of inertia about the corner over m R²"),
    }
    labels = _strings([block.label for block in blocks])
    coordinates = {"block": xr.Variable("block", labels, {"units": DIMENSIONLESS, "long_name": "block"})}
    for name, (values, units, long_name) in columns.items():
        coordinates[name] = xr.Variable("block", values, {"units": units, "long_name": long_name})
    return coordinates


def _model_coordinates(blocks: Sequence[Block], models: Sequence[Law]) -> dict[str, xr.Variable]:
    restitution = [[model.restitution(block) for model in models] for block in blocks]
    e = np.array([[np.nan if value is None else value for value in row] for row in restitution])
    attributes = {"units": DIMENSIONLESS, "long_name": "coefficient of restitution used"}
    return {**law_coordinates(models), "e": xr.Variable(("block", "model"), e, attributes)}


def law_coordinates(models: Sequence[Law]) -> dict[str, xr.Variable]:
    """Labels of laws and what is behind them, on ``model``."""
    columns: dict[str, tuple[Any, str]] = {
        "model": (_strings([model.label for model in models]), "damping law with its options"),
        "law": (_strings([model.law for model in models]), "short name of the damping law"),
        "delta": (
            [getattr(model, "delta", np.nan) for model in models],
            "half width of the elastic zone over alpha",
        ),
    }
    for name, long_name in (
        ("lever", "lever arm of the shaking: h (height of the centre of mass) or R"),
        ("rest", "kind of rest: elastic (zone) or rigid, empty where the law has no choice"),
        ("geometry", "geometry of the impact model: exact, linear or bilinear, empty for other laws"),
    ):
        columns[name] = _strings([str(getattr(model, name, "")) for model in models]), long_name
    return {
        name: xr.Variable("model", values, {"units": DIMENSIONLESS, "long_name": long_name})
        for name, (values, long_name) in columns.items()
    }
