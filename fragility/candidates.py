"""What a comparison of measures compares: the measures of every motion, and numbers that should explain nothing more.

Gathered from what the runs carry and, where they are given, from the motions themselves.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from .. import checks
from ..motions.arrays import Record, records
from ..motions.intensity import MEASURES, Measure
from ..motions.measures import measure
from ..units import DIMENSIONLESS, METRE, SECOND
from .capacity import Steps
from .provenance import blocks_of, records_of
from .scaling import BLOCK_MEASURES, SCALE, BlockMeasure, intensity_measure

Values = NDArray[np.float64]

Motions = xr.DataArray | Iterable["Motions"]

SCENARIO = ("magnitude", "distance", "epicentral_distance")
"""Coordinates of motions that say of which earthquake they are."""


class Candidate(NamedTuple):
    """A measure to be compared: its ln for the motions as they are, (motion,) or (block, motion), and its power."""

    label: str
    units: str
    long_name: str
    power: float
    log_values: Values


class Shaking(NamedTuple):
    """The motions of runs: their labels, the arrays as given, and their records in the order of the labels."""

    labels: tuple[str, ...]
    arrays: tuple[xr.DataArray, ...] = ()
    records: tuple[Record, ...] | None = None


def shaking_of(runs: xr.Dataset, motions: Motions | None) -> Shaking:
    """The motions of the runs, found by label; ValueError where one is missing.

    In stripes, a motion may be in several of the sets, and its label as given is the coordinate `record`.
    """
    labels = tuple(str(one) for one in runs["record" if "record" in runs.coords else "motion"].values)
    if motions is None:
        return Shaking(labels)
    # (the sets of stripes may be an iterator)
    given = motions if isinstance(motions, xr.DataArray) or not isinstance(motions, Iterable) else list(motions)
    arrays = tuple(_arrays(given))
    known: dict[str, Record] = {}
    for array in arrays:
        for one in records(array):
            before = known.setdefault(one.label, one)
            if before is not one and not np.array_equal(before.acceleration, one.acceleration):
                raise ValueError(f"motions must have unique labels, got two different ones labelled {one.label!r}")
    return Shaking(labels, arrays, tuple(records_of(runs, given)))


def _arrays(motions: Motions) -> Iterator[xr.DataArray]:
    """Labelled arrays one by one, whether given alone, in a sequence or in sets of stripes."""
    if isinstance(motions, xr.DataArray) or not isinstance(motions, Iterable):
        records(motions)  # what is no motion says so
        yield motions
    else:
        for one in motions:
            yield from _arrays(one)


def candidates_of(runs: xr.Dataset, steps: Steps, shaking: Shaking, also: Any, blocks_too: bool) -> list[Candidate]:
    """The runs' own measure, every other one that grows with the motion, and those asked for; no label twice.

    `blocks_too`: the block-normalised ones as well.

    Raises
    ------
    TypeError, ValueError
        A measure that is not known, does not grow with the motion or is zero; one that needs motions, and none are.
    """
    chosen: dict[str, Measure | BlockMeasure] = {
        name: one
        for name, one in MEASURES.items()
        if one.power != 0.0 and (shaking.records is not None or name in runs.coords)
    }
    if not isinstance(also, Iterable):
        raise TypeError(f"also must be measures or their names, got {checks.kind(also)}")
    for name in [*also, *(BLOCK_MEASURES if blocks_too else ())]:
        one = intensity_measure(name)
        if one is None:
            raise ValueError(f"also must name intensity measures, got {SCALE!r}, which is none")
        chosen[one.label] = one
    found = [_candidate(one, runs, shaking) for one in chosen.values()]
    if steps.name not in chosen:
        own = Candidate(steps.name, steps.units, steps.long_name, steps.power, steps.log_measured.values)
        found.insert(0, own)
    return found


def _candidate(one: Measure | BlockMeasure, runs: xr.Dataset, shaking: Shaking) -> Candidate:
    base = one.measure if isinstance(one, BlockMeasure) else one
    if base.power == 0.0:
        raise ValueError(f"{base.label!r} does not grow with the motion: it is a covariate, not a measure to rank")
    values = _values(base, runs, shaking)
    if values is None:
        raise ValueError(f"the runs do not carry {base.label!r}: motions must be given, got none")
    if not np.all(values > 0.0):
        label = shaking.labels[int(np.argmin(values > 0.0))]
        raise ValueError(f"motion {label!r} has {base.label} = {values.min():g} and no capacity in it")
    logs = np.log(values)
    if isinstance(one, BlockMeasure):
        logs = logs + np.log([[one.per_block(block)] for block in blocks_of(runs)])
    return Candidate(one.label, one.units, one.long_name, base.power, logs)


def _values(one: Measure, runs: xr.Dataset, shaking: Shaking) -> Values | None:
    """A measure of every motion as it is: what the runs carry, or measured."""
    if one.label in runs.coords and runs[one.label].dims == ("motion",):
        return np.asarray(runs[one.label].values, dtype=float)
    return None if shaking.records is None else measure(one, shaking.records)


def covariates_of(runs: xr.Dataset, shaking: Shaking, given: xr.Dataset | None) -> list[xr.DataArray]:
    """Numbers of every motion, (motion,), as they enter a regression: lengths and times as logarithms.

    Magnitude and distances of the motions, the measures that do not grow with them, and what is given.

    Raises
    ------
    TypeError, ValueError
        Something else than a dataset on motion; a length or time that is not positive.
    """
    found: dict[str, tuple[Values, dict[str, Any]]] = {}
    for name in SCENARIO:
        having = [one[name] for one in shaking.arrays if name in one.coords and one[name].dims == ("motion",)]
        if having:
            found[name] = _matched(having, shaking.labels), having[0].attrs
    for name, one in MEASURES.items():
        values = _values(one, runs, shaking) if one.power == 0.0 else None
        if values is not None:
            found[name] = values, {"units": one.units, "long_name": one.long_name}
    if given is not None:
        if not isinstance(given, xr.Dataset) or "motion" not in given.coords:
            raise TypeError(f"covariates must be a dataset on motion with its labels, got {checks.kind(given)}")
        for key, variable in given.data_vars.items():
            if variable.dims != ("motion",):
                raise ValueError(f"covariate {key!r} must lie on motion, got dims {variable.dims}")
            found[str(key)] = _matched([variable], shaking.labels), variable.attrs
    return [_entering(name, values, attributes) for name, (values, attributes) in found.items()]


def _matched(arrays: Sequence[xr.DataArray], labels: Sequence[str]) -> Values:
    """Values of the motions by label, a floor's by the label of the ground motion below; NaN where not known."""
    known: dict[str, float] = {}
    for array in arrays:
        known |= dict(zip(map(str, array["motion"].values), array.values.astype(float).tolist(), strict=True))
    return np.array([known.get(label, known.get(label.rsplit(" floor ", 1)[0], np.nan)) for label in labels])


def _entering(name: str, values: Values, attributes: dict[str, Any]) -> xr.DataArray:
    units, long_name = attributes.get("units", DIMENSIONLESS), attributes.get("long_name", name)
    if units in (METRE, SECOND):
        if np.any(values <= 0.0):
            raise ValueError(f"{name} must be > 0 (in {units}) to enter as a logarithm, got {np.nanmin(values):g}")
        values, long_name = np.log(values), f"ln {long_name}"
    return xr.DataArray(values, dims="motion", name=name, attrs={"units": DIMENSIONLESS, "long_name": long_name})
