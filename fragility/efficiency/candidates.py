"""Candidate intensity measures of every motion, and the covariates for a test of sufficiency.

Their values are from the coordinates of the runs and, if given, from the motions themselves.
"""

from collections.abc import Iterable, Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from ...core import checks
from ...core.elementary import Array, log
from ...core.units import DIMENSIONLESS, METRE, SECOND, described
from ...motions.arrays import Record, records
from ...motions.intensity.evaluation import measure
from ...motions.intensity.measure import MEASURES, Measure
from ...motions.intensity.naming import FLOOR, long_name_at, place_in
from ..runs.provenance import blocks_of, records_of
from ..runs.scaling import SCALE, BlockMeasure, intensity_measure
from .capacity import OrderedRuns

Motions = xr.DataArray | Iterable["Motions"]

SCENARIO = ("magnitude", "distance", "epicentral_distance")
"""Coordinates of motions that describe their earthquake."""


class Candidate(NamedTuple):
    """Intensity measure to be ranked: its ln for the unscaled motions, (motion,) or (block, motion), and its power."""

    label: str
    units: str
    long_name: str
    power: float
    log_values: Array


class RunMotions(NamedTuple):
    """Motions of runs: their labels, the arrays as given, and their records in the order of the labels."""

    labels: tuple[str, ...]
    arrays: tuple[xr.DataArray, ...] = ()
    records: tuple[Record, ...] | None = None


def motions_of_runs(runs: xr.Dataset, motions: Motions | None) -> RunMotions:
    """Return the motions of the runs, found by label; ValueError if a motion is missing.

    In stripes, a motion may be in several of the sets, and its label as given is the coordinate `record`.
    """
    labels = tuple(str(value) for value in runs["record" if "record" in runs.coords else "motion"].values)
    if motions is None:
        return RunMotions(labels)
    # (the sets of stripes may be an iterator)
    given: Any = motions if isinstance(motions, xr.DataArray) or not checks.is_several(motions) else list(motions)
    arrays = tuple(_arrays(given))
    known: dict[str, Record] = {}
    for array in arrays:
        for record in records(array):
            before = known.setdefault(record.label, record)
            if before is not record and not np.array_equal(before.acceleration, record.acceleration):
                raise ValueError(f"motions must have unique labels, got two different ones labelled {record.label!r}")
    return RunMotions(labels, arrays, tuple(records_of(runs, given)))


def _arrays(motions: Any) -> Iterator[xr.DataArray]:
    """Yield labelled arrays one by one, given alone, in a sequence or in sets of stripes."""
    if isinstance(motions, xr.DataArray) or not checks.is_several(motions):
        records(motions)  # raises the error for anything that is no motion
        yield motions
    elif isinstance(motions, xr.Dataset | str):
        raise TypeError(f"motions must be labelled arrays, or sets of them, got {checks.kind(motions)}")
    else:
        for motion in motions:
            yield from _arrays(motion)


def candidates_of(runs: xr.Dataset, ordered: OrderedRuns, run_motions: RunMotions, also: Any) -> list[Candidate]:
    """Return the runs' own measure, all others that grow with the motion, and those asked for; no label twice."""
    chosen: dict[str, Measure | BlockMeasure] = {
        name: measure
        for name, measure in MEASURES.items()
        if measure.power != 0.0 and (run_motions.records is not None or name in runs.coords)
    }
    if not checks.is_several(also):
        raise TypeError(f"also must be measures or their names, got {checks.kind(also)}")
    for name in also:
        chosen_measure = intensity_measure(name)
        if chosen_measure is None:
            raise ValueError(f"also must name intensity measures, got {SCALE!r}, which is none")
        chosen[chosen_measure.label] = chosen_measure
    candidates = [_candidate(candidate, runs, run_motions) for candidate in chosen.values()]
    if ordered.name not in chosen:
        of_runs = Candidate(ordered.name, ordered.units, ordered.long_name, ordered.power, ordered.log_measured.values)
        candidates.insert(0, of_runs)
    return candidates


def _candidate(quantity: Measure | BlockMeasure, runs: xr.Dataset, run_motions: RunMotions) -> Candidate:
    base = quantity.measure if isinstance(quantity, BlockMeasure) else quantity
    if base.power == 0.0:
        raise ValueError(f"{base.label!r} does not grow with the motion: it is a covariate, not a measure to rank")
    values = _values(base, runs, run_motions)
    if values is None:
        raise ValueError(f"the runs do not carry {base.label!r}: motions must be given, got none")
    if not np.all(values > 0.0):
        label = run_motions.labels[int(np.argmin(values > 0.0))]
        raise ValueError(f"motion {label!r} has {base.label} = {values.min():g} and no capacity in it")
    logs = log(values)
    if isinstance(quantity, BlockMeasure):
        logs = logs + log([[quantity.per_block(block)] for block in blocks_of(runs)])
    # (runs of one floor do not name it, but their peaks are of a floor)
    place = place_in(str(runs["pga"].attrs.get("long_name", ""))) if "pga" in runs.coords else ""
    return Candidate(quantity.label, quantity.units, long_name_at(quantity.long_name, place or FLOOR), base.power, logs)


def _values(quantity: Measure, runs: xr.Dataset, run_motions: RunMotions) -> Array | None:
    """Return a measure of every unscaled motion, from the runs' coordinates or the records; None without either."""
    if quantity.label in runs.coords and runs[quantity.label].dims == ("motion",):
        return np.asarray(runs[quantity.label].values, dtype=float)
    return None if run_motions.records is None else measure(quantity, run_motions.records)


def covariates_of(runs: xr.Dataset, run_motions: RunMotions) -> list[xr.DataArray]:
    """Return covariates of every motion, (motion,), as they enter a regression: lengths and times as logarithms.

    They are magnitude and distances of the motions, and the measures that do not grow with the motion.
    """
    covariates: dict[str, tuple[Array, dict[str, Any]]] = {}
    for name in SCENARIO:
        having = [
            array[name] for array in run_motions.arrays if name in array.coords and array[name].dims == ("motion",)
        ]
        if having:
            covariates[name] = _matched(having, run_motions.labels), having[0].attrs
    for name, feature in MEASURES.items():
        values = _values(feature, runs, run_motions) if feature.power == 0.0 else None
        if values is not None:
            covariates[name] = values, described(feature.long_name, feature.units)
    return [_regressor(name, values, attributes) for name, (values, attributes) in covariates.items()]


def _matched(arrays: Sequence[xr.DataArray], labels: Sequence[str]) -> Array:
    """Return values of the motions by label, or by the label of the ground motion below; NaN if not known."""
    known: dict[str, float] = {}
    for array in arrays:
        known |= dict(zip(map(str, array["motion"].values), array.values.astype(float).tolist(), strict=True))
    return np.array([known.get(label, known.get(label.rsplit(" floor ", 1)[0], np.nan)) for label in labels])


def _regressor(name: str, values: Array, attributes: dict[str, Any]) -> xr.DataArray:
    units, long_name = attributes.get("units", DIMENSIONLESS), attributes.get("long_name", name)
    if units in (METRE, SECOND):
        if np.any(values <= 0.0):
            raise ValueError(f"{name} must be > 0 (in {units}) to enter as a logarithm, got {np.nanmin(values):g}")
        values, long_name = log(values), f"ln {long_name}"
    return xr.DataArray(values, dims="motion", name=name, attrs=described(long_name))
