"""Labels of results: outputs of runs as variables, and the properties of blocks and laws as coordinates."""

import json
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ...core.aliases import Array
from ...core.units import ANGULAR_VELOCITY, DIMENSIONLESS, METRE, RADIAN, described
from ...models import Block, Model
from ...models.block import describe_scene
from ...models.oscillator import Oscillator
from ...models.outputs import DERIVED, OUTPUTS
from ...models.restraint_force import held_by, largest_force
from ...models.sliding.mode import demand, mode_of
from ...motions.intensity.measure import RESULT_MEASURES
from ..numerics.slabs import Allocator
from .plan import Chunk, Work
from .provenance import BED, EDGE, SCENE
from .request import Request, Runs
from .scaling import Scaling

ORDER = "block", "place", "model"
"""First dimensions of all variables of results, in this order."""


def ordered(results: xr.Dataset) -> xr.Dataset:
    """Return results whose variables have the same order of dimensions."""
    return results.transpose(*ORDER, ..., missing_dims="ignore")


def output_variables(
    request: Request, runs: Runs, blocks: Sequence[Block], work: Work, sizes: Mapping[str, int]
) -> dict[str, xr.Variable]:
    """Return the outputs of the runs of some work on the dimensions of `sizes`.

    Equally many of its oscillators are of each of `blocks`.
    """
    variables = {}
    for name in request.outputs:
        values = _output(name, runs, blocks, work, request.runner.array).reshape(tuple(sizes.values()))
        variables[name] = xr.Variable(tuple(sizes), values, OUTPUTS[name].attributes)
    return variables


def _output(name: str, runs: Runs, blocks: Sequence[Block], work: Work, array: Allocator) -> NDArray[Any]:
    """An output (oscillator, level, motion), as the engine returned it or derived from its outputs."""
    if name not in DERIVED:
        return runs.results[name]
    needed = [runs.results[output] for output in DERIVED[name]]
    if name == "mode":
        return _modes(blocks, work, array)
    derived = array(needed[0].shape, np.dtype(OUTPUTS[name].kind))
    per_block, formula = len(derived) // len(blocks), OUTPUTS[name].formula
    if formula is not None:
        for i, row in enumerate(derived):
            row[...] = formula(blocks[i // per_block], *(output[i] for output in needed))
        return derived
    to_front, to_back = _pushes(work)
    for i, (forces, oscillator) in enumerate(zip(derived, work.oscillators, strict=True)):
        assert isinstance(oscillator, Oscillator)  # (only what rocks has a restraint)
        factors = work.factors_of(Chunk(i, i + 1, 0, len(work.motions)))[0]
        held = held_by(blocks[i // per_block], oscillator)
        front, back, ruptured = (output[i] for output in needed)
        forces[...] = largest_force(held, front, back, ruptured, factors * to_front, factors * to_back)
    return derived


def _modes(blocks: Sequence[Block], work: Work, array: Allocator) -> NDArray[np.int8]:
    """Return the first mode of each sliding block (slider, level, motion): see `models.sliding.mode`."""
    modes = array((len(work.oscillators), work.levels, len(work.motions)), np.dtype(np.int8))
    per_block = len(modes) // len(blocks)
    for i, (modes_of_slider, slider) in enumerate(zip(modes, work.oscillators, strict=True)):
        factors = work.factors_of(Chunk(i, i + 1, 0, len(work.motions)))[0]
        for k, motion in enumerate(work.motions):
            demanded = demand(motion.acceleration, motion.vertical, np.ascontiguousarray(factors[:, k]))
            modes_of_slider[:, k] = mode_of(blocks[i // per_block], slider[0], demanded)
    return modes


def _pushes(work: Work) -> tuple[Array, Array]:
    """Return the maximum accelerations (motion,) of the unscaled floor that push a block to its front and back."""
    waves = [motion.acceleration for motion in work.motions]
    return np.array([max(0.0, -wave.min()) for wave in waves]), np.array([max(0.0, wave.max()) for wave in waves])


def measured(scaled: Scaling) -> dict[str, xr.Variable]:
    """Return the measure of the levels for the unscaled motions, unless it is a measure that every result has."""
    carried = scaled.name in {measure.label for measure in RESULT_MEASURES}
    if scaled.measured is None or (carried and not scaled.ground):
        return {}
    name = f"ground_{scaled.name}" if scaled.ground else scaled.name
    attributes = described(scaled.long_name, scaled.units)
    return {name: xr.Variable(scaled.measure_dims, scaled.measured, attributes)}


def _strings(values: Sequence[str]) -> NDArray[np.object_]:
    return np.array(values, dtype=object)


OF_BLOCKS = {
    "width": (METRE, "full width"),
    "height": (METRE, "full height"),
    "cm_height": (METRE, "height of the centre of mass"),
    "alpha": (RADIAN, "slenderness angle"),
    "R": (METRE, "distance from the centre of mass to the corner"),
    "p": (ANGULAR_VELOCITY, "rocking frequency parameter"),
    "inertia_factor": (DIMENSIONLESS, "moment of inertia about the corner over m R²"),
}
"""Properties of blocks, with their units and long names."""


def block_coordinates(blocks: Sequence[Block]) -> dict[str, xr.Variable]:
    """Return the labels and properties of blocks, on ``block``."""
    attributes_of = {"cm_height": "h", "inertia_factor": "inertia"}
    columns: dict[str, tuple[list[float], str, str]] = {
        name: ([getattr(block, attributes_of.get(name, name)) for block in blocks], *words)
        for name, words in OF_BLOCKS.items()
    }
    labels = _strings([block.label for block in blocks])
    coordinates = {"block": xr.Variable("block", labels, described("block"))}
    scenes = [describe_scene(block) for block in blocks]
    if any(scenes):
        attributes = described("what stands around the block or holds it (JSON, SI)")
        coordinates[SCENE] = xr.Variable("block", _strings([json.dumps(scene) for scene in scenes]), attributes)
    if any(block.edge is not None for block in blocks):
        edges = [json.dumps(None if block.edge is None else asdict(block.edge)) for block in blocks]
        attributes = described("edges over which the block may slide (JSON, SI)")
        coordinates[EDGE] = xr.Variable("block", _strings(edges), attributes)
    if any(block.bed is not None for block in blocks):
        depths = [math.nan if block.bed is None else block.bed.settlement for block in blocks]
        columns[BED] = (depths, METRE, "settlement of the block's soft bed, NaN on a rigid floor")
    for name, (values, units, long_name) in columns.items():
        coordinates[name] = xr.Variable("block", values, described(long_name, units))
    if any(block.round for block in blocks):
        attributes = described("whether the base is round")
        coordinates["round"] = xr.Variable("block", [block.round for block in blocks], attributes)
    return coordinates


def depth_coordinate(blocks: Sequence[Block]) -> dict[str, xr.Variable]:
    """Return the depth of blocks on ``block``, NaN if it is not known."""
    attributes = described("full size in the other horizontal direction", METRE)
    depths = [math.nan if block.depth is None else block.depth for block in blocks]
    return {"depth": xr.Variable("block", depths, attributes)}


OF_LAWS = {
    "law": "short name of the damping law",
    "delta": "half width of the elastic zone over alpha",
    "lever": "lever arm of the shaking: h (height of the centre of mass) or R",
    "rest": "kind of rest: elastic (zone) or rigid, empty where the law has no choice",
    "geometry": "geometry of the impact model: exact, linear or bilinear, empty for other laws",
}
"""Properties of laws, with their long names."""
OF_MEDIAN = "median of the curve through all runs"
OF_DISPERSION = "lognormal standard deviation of the curve through all runs"
OF_STOP, OF_ACCOUNT = "why no further motions were run", "what was reached, and what more would bring"
"""Long names of analyses at adaptive levels, of blocks or of a surface."""


def law_coordinates(models: Sequence[Model]) -> dict[str, xr.Variable]:
    """Return the labels and options of laws, on ``model``."""
    labels = _strings([model.label for model in models])
    model = xr.Variable("model", labels, described("damping law with its options"))
    return {"model": model, **{name: law_variable(name, models) for name in OF_LAWS}}


def law_variable(
    name: str, models: Sequence[Model], dims: tuple[str, ...] = ("model",), shape: tuple[int, ...] = (-1,)
) -> xr.Variable:
    """Return a property of laws (`OF_LAWS`) on dimensions of a shape; NaN or empty of laws without it."""
    values: NDArray[Any]
    if name == "delta":
        values = np.array([getattr(model, name, math.nan) for model in models], np.float64)
    else:
        values = _strings([str(getattr(model, name, "")) for model in models])
    return xr.Variable(dims, values.reshape(shape), described(OF_LAWS[name]))


def restitution_variable(
    pairs: Iterable[tuple[Block, Model]], dims: tuple[str, ...], shape: tuple[int, ...]
) -> xr.Variable:
    """Return the restitution of blocks under laws on dimensions of a shape; NaN of laws without one."""
    restitution = [law.restitution(block) for block, law in pairs]
    e = np.array([math.nan if value is None else value for value in restitution])
    return xr.Variable(dims, e.reshape(shape), described("coefficient of restitution used"))
