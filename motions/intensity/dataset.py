"""Evaluation of intensity measures: the measure that a label names, and the values of motions, plain or labelled."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import fields
from typing import Any

import numpy as np
import xarray as xr

from ...core import checks
from ...core.aliases import Array
from ...core.units import STANDARD_GRAVITY, described, provenance
from ..arrays import HORIZONTAL, Record, motion_coordinates, records
from .directions import PAIR_MEASURES, PairMeasure
from .measure import MEASURES, Measure
from .naming import long_name_at, place_of
from .parametric_measures import PARAMETRIC_MEASURES

_AROUND = re.compile(r"\s*(\w+)\s*\(\s*(\w.{0,200}?)\s*\)\s*", re.DOTALL)
SCALABLE = tuple(name for name, known in MEASURES.items() if known.power != 0.0)
"""Measures to which motions can be scaled."""
LEAST_PEAK = 1e-100 * STANDARD_GRAVITY
_WRITTEN = re.compile(r"\s*(\w+)\s*\(([^()]*)\)\s*")


def measure_named(
    name: str | Measure, what: str = "intensity measure", also: Sequence[str] = (), listed: Sequence[str] = (*MEASURES,)
) -> Measure:
    """Return the measure of a name or label such as ``pgv``, ``Sa(1.0)``, ``Sa(1.0, 0.02)`` or ``AvgSa(0.2:2.0:10)``.

    Parameters
    ----------
    name : str or Measure
        A name of `MEASURES`, or one of Sa, Sv, Sd (period, damping), AvgSa (periods, damping) and FIV3 (period, alpha,
        beta) with its parameters. Parameters with defaults may be left out. The periods of AvgSa are separated by
        blanks or written as first:last:number. RotD50, RotD100 and GeometricMean take the measure of one motion, as
        ``RotD50(Sa(1.0))``: they are of both horizontal components. Capitals make no difference. A measure is returned
        as it is.
    what, also, listed : str, sequence of str
        Words for the message: the named quantity, further allowed names, and the names of `MEASURES` that the caller
        allows.

    Examples
    --------
    >>> measure_named("Sa(1.0, 0.02)")
    Sa(period=1.0, damping=0.02)
    """
    if isinstance(name, Measure):
        return name
    if isinstance(name, str):
        known = as_known(name, MEASURES)
        if known is not None:
            return MEASURES[known]
        around = _AROUND.fullmatch(name)
        pair = None if around is None else as_known(around.group(1), PAIR_MEASURES)
        if around is not None and pair is not None:
            base = measure_named(around.group(2), what, also, listed)
            if isinstance(base, PairMeasure):
                raise ValueError(f"{what} {name!r}: {pair} takes a measure of one motion")
            return PAIR_MEASURES[pair](base)
        match = _WRITTEN.fullmatch(name)
        kind = None if match is None else as_known(match.group(1), PARAMETRIC_MEASURES)
        if match is not None and kind is not None:
            try:
                return PARAMETRIC_MEASURES[kind].read(match.group(2).split(","))
            except (TypeError, ValueError) as error:
                raise ValueError(f"{what} {name!r}: {_plainly(error, kind)}") from None
    allowed = ", ".join(repr(one) for one in (*listed, *also))
    more = " or ".join(f"{one}(…)" for one in (*PARAMETRIC_MEASURES, *PAIR_MEASURES))
    raise ValueError(f"{what} must be one of {allowed}, or {more}, got {checks.shown(name)}")


def as_known(name: str, known: Iterable[str]) -> str | None:
    """Return the known name that differs from a name by no more than capitals, None if there is none."""
    return next((one for one in known if one.casefold() == name.casefold()), None)


def _plainly(error: Exception, name: str) -> str:
    """Return the message of an error, without Python's wording for too many arguments."""
    if isinstance(error, TypeError):
        known = ", ".join(field.name for field in fields(PARAMETRIC_MEASURES[name]))
        return f"{name} takes {known}"
    return str(error)


def measure(name: str | Measure, motions: Sequence[Record]) -> Array:
    """Return one measure of plain records, shape (motion,); ValueError for an unknown name."""
    one = measure_named(name)
    found = np.empty(len(motions))
    for i, record in enumerate(motions):
        try:
            found[i] = one.of_record(record)
        except ValueError as error:
            raise ValueError(f"motion {record.label!r}: {error}") from None
    return found


def positive_measure(name: str | Measure, motions: Sequence[Record]) -> Array:
    """Return a measure to scale by, shape (motion,); ValueError if it is next to zero or does not grow."""
    one = measure_named(name)
    if one.power == 0.0:
        scalable = ", ".join(map(repr, SCALABLE))
        raise ValueError(
            f"{one.label!r} does not grow with the motion and cannot be scaled to: take {scalable} or a spectral one"
        )
    for motion in motions:
        # squares of such samples underflow, and the engine treats smaller samples as zero
        if 0.0 < (peak := float(np.abs(motion.acceleration).max())) < LEAST_PEAK:
            raise ValueError(
                f"motion {motion.label!r} has a peak of {peak:.3g} m/s² and cannot be scaled: give at least "
                f"{LEAST_PEAK:.3g} m/s²"
            )
    values = measure(one, motions)
    if not np.all(values > 0.0):
        label = motions[int(np.argmin(values > 0.0))].label
        raise ValueError(f"motion {label!r} has {one.label} = 0 and cannot be scaled")
    return values


def measures(
    motions: xr.DataArray | Iterable[xr.DataArray], which: str | Measure | Sequence[str | Measure] | None = None
) -> xr.Dataset:
    """Return intensity measures of every motion.

    Parameters
    ----------
    motions : xarray.DataArray or a sequence of them
        Labelled motions (m s-2), each with its own time step and length; joined components (`toppling.motions.join`)
        for measures of both.
    which : measures or their names, optional
        Any of `MEASURES`, of ``Sa(1.0)``, ``Sv``, ``Sd``, ``AvgSa``, ``FIV3``, and of both components
        ``RotD50(pga)``, ``RotD100(Sa(1.0))``, ``GeometricMean(pgv)``; all of `MEASURES` if not given.

    Returns
    -------
    xarray.Dataset
        One variable for each measure on ``motion``, named by its label: pga (m s-2), pgv (m s-1), pgd (m), arias (m
        s-1) and cav (m s-1). Further d5_75, d5_95 and t_mean (s), and housner_intensity (m). Coordinates are dt,
        duration (s) and source. All but t_mean, which is computed from the samples, are exact for acceleration that is
        linear between samples; peaks between samples are included. Durations and mean period of a motion of zeros are
        NaN.

    Examples
    --------
    >>> from toppling import motions
    >>> found = measures(motions.from_array([0.0, 2.0, 0.0], 0.1), ["pga", "cav", "Sa(0.5)"])
    >>> list(found), float(found.pga[0]), round(float(found.cav[0]), 12)
    (['pga', 'cav', 'Sa(0.5)'], 2.0, 0.2)
    """
    if which is None:
        chosen = list(MEASURES.values())
    elif isinstance(which, str | Measure):
        chosen = [measure_named(which)]
    elif isinstance(which, Iterable):
        chosen = [measure_named(one) for one in which]
    else:
        raise TypeError(f"which must be measures or their names, got {checks.kind(which)}")
    both = all(isinstance(one, PairMeasure) for one in chosen)
    plain = records(_shaken_either_way(motions) if both else motions)
    configuration = {"measures": [one.label for one in chosen]}
    return xr.Dataset(
        measure_variables(plain, chosen),
        coords=motion_coordinates(plain),
        attrs={"title": "Intensity measures", **provenance(configuration)},
    )


def _shaken_either_way(motions: Any) -> Any:
    """Return motions whose pairs may be read though no component is chosen: measures of both do not depend on it."""
    if isinstance(motions, xr.DataArray):
        free = "component" in motions.dims and "shakes" not in motions.coords
        return motions.assign_coords(shakes=HORIZONTAL[0]) if free else motions
    return [_shaken_either_way(motion) for motion in motions] if isinstance(motions, Iterable) else motions


def measure_variables(plain: Sequence[Record], chosen: Iterable[Measure]) -> dict[str, xr.Variable]:
    """Return measures of plain records as variables on ``motion``, by label."""
    place = place_of(record.floor for record in plain)
    return {
        one.label: xr.Variable("motion", measure(one, plain), described(long_name_at(one.long_name, place), one.units))
        for one in chosen
    }
