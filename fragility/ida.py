"""Incremental dynamic analysis: every block under every law under every motion at every level, on dask."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
import xarray as xr
from dask.base import compute
from dask.callbacks import Callback
from dask.delayed import delayed
from numpy.typing import NDArray

from .. import checks
from ..models import Block, Law, describe_block, describe_law
from ..models.runs import OUTPUTS, TALLY
from ..models.simulate import oscillator_of
from ..motions.arrays import Record, motion_coordinates, records
from ..motions.intensity import RESULT_MEASURES, Measure
from ..motions.measures import measure_variables
from ..units import DIMENSIONLESS, METRE, RADIAN, SECOND, provenance
from .plan import OUTPUT_TYPES, Chunk, Done, plan_chunks, run_chunk
from .scaling import Scaling, ground_of, scaling

if TYPE_CHECKING:
    from distributed import Client

Progress = Callable[[int, int], None]
Labelled = TypeVar("Labelled", Block, Law)

# Units and long name of each output.
_VARIABLES: dict[str, tuple[str, str]] = {
    "overturned": (DIMENSIONLESS, "whether the block overturned"),
    "peak_rotation": (RADIAN, "peak absolute rotation, pi/2 if overturned"),
    "uplifted": (DIMENSIONLESS, "whether the block uplifted"),
    "impacts": (DIMENSIONLESS, "impacts during the record"),
    "overturning_time": (SECOND, "time of overturning, NaN if it stands"),
}


def ida(
    blocks: Block | Sequence[Block],
    models: Law | Sequence[Law],
    motions: xr.DataArray | Iterable[xr.DataArray],
    levels: Any,
    im: str | Measure = "pga",
    outputs: Sequence[str] = ("overturned", "peak_rotation"),
    client: Client | None = None,
    skip: bool = True,
    *,
    ground: xr.DataArray | Iterable[xr.DataArray] | None = None,
    progress: Progress | None = None,
) -> xr.Dataset:
    """Incremental dynamic analysis.

    Parameters
    ----------
    blocks, models : one or a sequence
        Blocks and damping laws, with unique labels.
    motions : xarray.DataArray or a sequence of them
        Labelled motions (m s-2), each with its own time step and length; nothing is resampled or padded.
    levels : array_like, shape (level,)
        Levels of the intensity measure, SI, > 0, strictly increasing.
    im : str or Measure
        The measure to which every motion is scaled: a measure that grows with the motion (`motions.MEASURES`), one with
        parameters such as ``motions.Sa(1.0)`` or ``"Sa(1.0)"``, ``pga_normalised`` = PGA/(g tan alpha) or
        ``pgv_normalised`` = p PGV/(g tan alpha), whose factors depend on the block too, or ``scale``: plain factors.
    outputs : sequence of str
        Any of overturned, peak_rotation, uplifted, impacts, overturning_time.
    client : distributed.Client, optional
        Where to run; threads of this process where not given.
    skip : bool
        Leave out what is known: before the first uplift, and, where ``outputs`` is overturned alone, once the rest of
        the record cannot overturn a block.  Flags do not change, peaks only by rounding.  The attribute ``skipped``
        (JSON) says how many samples all runs have, which share was left out and why (after overturning, too, which
        `skip` does not change), and how many events a run were solved.
    ground : xarray.DataArray or a sequence of them, optional
        The ground motions of which `motions` are floor motions, with the labels they had: levels are then of their
        measure, and each floor motion is scaled as the ground below it (the building is elastic).
    progress : callable, optional
        Called with (runs done, runs in all) after every chunk.

    Returns
    -------
    xarray.Dataset
        The outputs on (block, model, level, motion), computed, with the numbers behind the labels as coordinates.
        Bit-identical for any chunking and any number of workers.

    Raises
    ------
    TypeError, ValueError
        No or wrong blocks, laws or motions, labels used twice, levels out of order, an unknown measure or output, a
        measure that scaling does not change, a motion whose measure is zero, a block that needs an explicit e.

    Examples
    --------
    >>> import toppling as tp
    >>> shakes = tp.motions.CloughPenzien(duration=10.0, dt=0.01).sample(4)
    >>> result = ida(tp.catalogue["bookcase-5-shelf"], tp.HousnerImpact(), shakes, [1.0, 4.0])
    >>> dict(result.sizes)
    {'block': 1, 'model': 1, 'level': 2, 'motion': 4}
    """
    wanted = _outputs(outputs)
    if not isinstance(skip, bool):
        raise TypeError(f"skip must be True or False, got {skip!r:.40}")
    if client is not None and not hasattr(client, "compute"):
        raise TypeError(f"client must be a dask.distributed Client, got {checks.kind(client)}")
    all_blocks = _sequence("blocks", blocks, Block)
    all_models = _sequence("models", models, Law)  # type: ignore[type-abstract]
    plain = records(motions)
    below = None if ground is None else ground_of(plain, records(ground))
    scaled = scaling(levels, plain, im, all_blocks, below)
    oscillators = [oscillator_of(block, model) for block in all_blocks for model in all_models]
    chunks = plan_chunks(oscillators, plain, scaled.factors, skip, wanted)
    shape = (len(all_blocks), len(all_models), scaled.levels.size, len(plain))
    results = {name: np.empty((len(oscillators), *shape[2:]), OUTPUT_TYPES[name]) for name in wanted}
    tally = np.zeros(len(TALLY), np.int64)
    for chunk, done in zip(chunks, _execute(chunks, client, progress), strict=True):
        for name, part in zip(wanted, done.results, strict=True):
            results[name][:, :, chunk.first : chunk.stop] = part
        tally += done.tally
    shaped = {name: values.reshape(shape) for name, values in results.items()}
    dataset = label_results(shaped, all_blocks, all_models, plain, scaled)
    dataset.attrs["skipped"] = json.dumps(skipped(tally, runs=math.prod(shape)))
    return dataset


def skipped(tally: NDArray[np.int64], runs: int) -> dict[str, float]:
    """The engine's counts (`models.runs.TALLY`) as shares of all samples, and events a run."""
    counts = dict(zip(TALLY, tally.tolist(), strict=True))
    samples = counts.pop("samples")
    events = counts.pop("events")
    return {
        "samples": samples,
        **{f"share_{reason}": round(count / samples, 6) for reason, count in counts.items()},
        "events_per_run": round(events / runs, 3),
    }


def label_results(
    results: Mapping[str, NDArray[Any]],
    blocks: Sequence[Block],
    models: Sequence[Law],
    motions: Sequence[Record],
    scaled: Scaling,
) -> xr.Dataset:
    """Outputs (block, model, level, motion) by name as the labelled dataset that `ida` returns."""
    dims = ("block", "model", "level", "motion")
    variables = {}
    for name, values in results.items():
        units, long_name = _VARIABLES[name]
        variables[name] = (dims, values, {"units": units, "long_name": long_name})
    configuration = {
        "blocks": [describe_block(block) for block in blocks],
        "models": [describe_law(model) for model in models],
        "im": scaled.name,
        "levels": scaled.levels.tolist(),
        "motions": [record.label for record in motions],
        **({"im_at": "ground"} if scaled.ground else {}),
    }
    return xr.Dataset(
        variables,
        coords={
            **_block_coordinates(blocks),
            **_model_coordinates(blocks, models),
            "level": xr.Variable(
                "level", scaled.levels, {"units": scaled.units, "long_name": scaled.long_name, "im": scaled.name}
            ),
            **motion_coordinates(list(motions)),
            **measure_variables(motions, RESULT_MEASURES),
            **_measured(scaled),
        },
        attrs={"title": "Incremental dynamic analysis of freestanding blocks", **provenance(configuration)},
    )


def _measured(scaled: Scaling) -> dict[str, xr.Variable]:
    """The measure of the levels, for the motions as they are, where it is not among those that every result has."""
    carried = scaled.name in {one.label for one in RESULT_MEASURES}
    if scaled.measured is None or (carried and not scaled.ground):
        return {}
    name = f"ground_{scaled.name}" if scaled.ground else scaled.name
    dims = ("motion",) if scaled.measured.ndim == 1 else ("block", "motion")
    attributes = {"units": scaled.units, "long_name": scaled.long_name}
    return {name: xr.Variable(dims, scaled.measured, attributes)}


def _execute(chunks: Sequence[Chunk], client: Client | None, progress: Progress | None) -> list[Done]:
    """Run the chunks on threads here or on a cluster, results in the order of the chunks."""
    total = sum(chunk.runs for chunk in chunks)
    tasks = [delayed(run_chunk, pure=False)(delayed(chunk, traverse=False)) for chunk in chunks]
    if client is not None:
        from distributed import as_completed  # noqa: PLC0415 - the cluster code loads only where there is a cluster

        futures = client.compute(tasks)
        done = 0
        sizes = {future.key: chunk.runs for future, chunk in zip(futures, chunks, strict=True)}
        for future in as_completed(futures, loop=client.loop):
            future.result()
            done += sizes[future.key]
            if progress is not None:
                progress(done, total)
        return list(client.gather(futures))
    with _ThreadProgress(total, progress):
        return list(compute(*tasks, scheduler="threads"))


class _ThreadProgress(Callback):
    """Counts finished runs by the number of results in each finished task."""

    def __init__(self, total: int, progress: Progress | None) -> None:
        super().__init__()  # type: ignore[no-untyped-call]
        self._total = total
        self._done = 0
        self._progress = progress

    def _posttask(self, key: Any, result: Any, dsk: Any, state: Any, worker_id: Any) -> None:
        if self._progress is not None and isinstance(result, Done):
            self._done += result.runs
            self._progress(self._done, self._total)


def _outputs(outputs: Sequence[str]) -> list[str]:
    names = [outputs] if isinstance(outputs, str) else list(outputs)
    if not names:
        raise ValueError(f"outputs must name at least one of {', '.join(OUTPUTS)}, got none")
    return list(dict.fromkeys(checks.choice("outputs", name, tuple(OUTPUTS)) for name in names))


def _sequence(name: str, values: Any, kind: type[Labelled]) -> list[Labelled]:
    found = [values] if isinstance(values, kind) else list(values) if isinstance(values, Iterable) else [values]
    if not found:
        raise ValueError(f"{name} must hold at least one, got none")
    for value in found:
        if not isinstance(value, kind):
            raise TypeError(f"{name} must be one {kind.__name__} or a sequence of them, got {checks.kind(value)}")
    labels = [value.label for value in found]
    for label in labels:
        if labels.count(label) > 1:
            raise ValueError(f"{name} must have unique labels, got {label!r} more than once")
    return found


def _strings(values: Sequence[str]) -> NDArray[np.object_]:
    return np.array(values, dtype=object)


def _block_coordinates(blocks: Sequence[Block]) -> dict[str, xr.Variable]:
    columns: dict[str, tuple[list[float], str, str]] = {
        "width": ([b.width for b in blocks], METRE, "full width"),
        "height": ([b.height for b in blocks], METRE, "full height"),
        "cm_height": ([b.h for b in blocks], METRE, "height of the centre of mass"),
        "alpha": ([b.alpha for b in blocks], RADIAN, "slenderness angle"),
        "R": ([b.R for b in blocks], METRE, "distance from the centre of mass to the corner"),
        "p": ([b.p for b in blocks], "rad s-1", "rocking frequency parameter"),
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
    coordinates = {
        "model": xr.Variable(
            "model",
            _strings([m.label for m in models]),
            {"units": DIMENSIONLESS, "long_name": "damping law with its options"},
        ),
        "law": xr.Variable(
            "model",
            _strings([m.law for m in models]),
            {"units": DIMENSIONLESS, "long_name": "short name of the damping law"},
        ),
        "delta": xr.Variable(
            "model",
            [getattr(model, "delta", np.nan) for model in models],
            {"units": DIMENSIONLESS, "long_name": "half width of the elastic zone over alpha"},
        ),
        "e": xr.Variable(
            ("block", "model"), e, {"units": DIMENSIONLESS, "long_name": "coefficient of restitution used"}
        ),
    }
    for name, long_name in (
        ("lever", "lever arm of the shaking: h (height of the centre of mass) or R"),
        ("rest", "kind of rest: elastic (zone) or rigid, empty where the law has no choice"),
        ("geometry", "geometry of the impact model: exact, linear or bilinear, empty for other laws"),
    ):
        values = [str(getattr(model, name, "")) for model in models]
        coordinates[name] = xr.Variable("model", _strings(values), {"units": DIMENSIONLESS, "long_name": long_name})
    return coordinates
