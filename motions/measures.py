"""Intensity measures by name, and of labelled motions: all as one dataset, or one to scale by.

What each measure is stands in `intensity` and `parametrised`.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import fields

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from .. import checks
from ..units import provenance
from .arrays import Record, motion_coordinates, records
from .intensity import MEASURES, Measure
from .parametrised import PARAMETRISED

_WRITTEN = re.compile(r"\s*(\w+)\s*\(([^()]*)\)\s*")


def measure_named(name: str | Measure, what: str = "intensity measure", also: Sequence[str] = ()) -> Measure:
    """The measure that a name or label says, such as ``pgv``, ``Sa(1.0)``, ``Sa(1.0, 0.02)`` or ``AvgSa(0.2:2.0:10)``.

    Parameters
    ----------
    name : str or Measure
        A name of `MEASURES`, or one of Sa, Sv, Sd (period, damping), AvgSa (periods, damping) and FIV3 (period, alpha,
        beta) with its parameters, those with defaults optional.  The periods of AvgSa stand apart by blanks, or as
        first:last:number.  A measure is returned as it is.
    what, also : str, sequence of str
        For the message: what the name is of, and what else is allowed.

    Raises
    ------
    TypeError, ValueError
        An unknown name, parameters that are wrong.

    Examples
    --------
    >>> measure_named("Sa(1.0, 0.02)")
    Sa(period=1.0, damping=0.02)
    """
    if isinstance(name, Measure):
        return name
    if isinstance(name, str):
        if name in MEASURES:
            return MEASURES[name]
        match = _WRITTEN.fullmatch(name)
        if match is not None and match.group(1) in PARAMETRISED:
            try:
                return PARAMETRISED[match.group(1)].read(match.group(2).split(","))
            except (TypeError, ValueError) as error:
                raise ValueError(f"{what} {name!r}: {_plainly(error, match.group(1))}") from None
    allowed = ", ".join(repr(one) for one in (*MEASURES, *also))
    shown = repr(name) if len(repr(name)) <= 60 else f"{name!r:.57}..."
    raise ValueError(f"{what} must be one of {allowed}, or {' or '.join(f'{k}(…)' for k in PARAMETRISED)}, got {shown}")


def _plainly(error: Exception, name: str) -> str:
    """A message without Python's words for too many arguments."""
    if isinstance(error, TypeError):
        known = ", ".join(one.name for one in fields(PARAMETRISED[name]))
        return f"{name} takes {known}"
    return str(error)


def measure(name: str | Measure, motions: Sequence[Record]) -> NDArray[np.float64]:
    """One measure of plain records, shape (motion,); ValueError for a name that is not known."""
    one = measure_named(name)
    found = np.empty(len(motions))
    for i, record in enumerate(motions):
        try:
            found[i] = one.of(record.acceleration, record.dt)
        except ValueError as error:
            raise ValueError(f"motion {record.label!r}: {error}") from None
    return found


def positive_measure(name: str | Measure, motions: Sequence[Record]) -> NDArray[np.float64]:
    """A measure to scale by, shape (motion,); ValueError where it is zero, or does not grow with the motion."""
    one = measure_named(name)
    if one.power == 0.0:
        scalable = ", ".join(repr(key) for key, known in MEASURES.items() if known.power != 0.0)
        raise ValueError(
            f"{one.label!r} does not grow with the motion and cannot be scaled to: take {scalable} or a spectral one"
        )
    values = measure(one, motions)
    if not np.all(values > 0.0):
        label = motions[int(np.argmin(values > 0.0))].label
        raise ValueError(f"motion {label!r} has {one.label} = 0 and cannot be scaled")
    return values


def measures(
    motions: xr.DataArray | Iterable[xr.DataArray], which: str | Measure | Sequence[str | Measure] | None = None
) -> xr.Dataset:
    """Intensity measures of every motion.

    Parameters
    ----------
    motions : xarray.DataArray or a sequence of them
        Labelled motions (m s-2), each with its own time step and length.
    which : measures or their names, optional
        Any of `MEASURES` and of ``Sa(1.0)``, ``Sv``, ``Sd``, ``AvgSa``, ``FIV3``; every one of `MEASURES` where not
        given.

    Returns
    -------
    xarray.Dataset
        One variable a measure on ``motion``, under its label: pga (m s-2), pgv (m s-1), pgd (m), arias (m s-1), cav (m
        s-1), d5_75, d5_95 and t_mean (s), housner_intensity (m); with dt, duration (s) and source as coordinates.
        All but t_mean, which is of the samples, are exact for acceleration that is linear between samples, peaks
        between samples too.  Durations and mean period of a motion of zeros are NaN.

    Raises
    ------
    TypeError, ValueError
        As `toppling.motions.records`: what is no labelled acceleration, has no unique labels or is not finite.  An
        unknown measure.

    Examples
    --------
    >>> from toppling import motions
    >>> found = measures(motions.from_array([0.0, 2.0, 0.0], 0.1), ["pga", "cav", "Sa(0.5)"])
    >>> list(found), float(found.pga[0]), round(float(found.cav[0]), 12)
    (['pga', 'cav', 'Sa(0.5)'], 2.0, 0.2)
    """
    plain = records(motions)
    if which is None:
        chosen = list(MEASURES.values())
    elif isinstance(which, str | Measure):
        chosen = [measure_named(which)]
    elif isinstance(which, Iterable):
        chosen = [measure_named(one) for one in which]
    else:
        raise TypeError(f"which must be measures or their names, got {checks.kind(which)}")
    configuration = {"measures": [one.label for one in chosen]}
    return xr.Dataset(
        measure_variables(plain, chosen),
        coords=motion_coordinates(plain),
        attrs={"title": "Intensity measures", **provenance(configuration)},
    )


def measure_variables(plain: Sequence[Record], chosen: Iterable[Measure]) -> dict[str, xr.Variable]:
    """Measures of plain records as variables on ``motion``, by label."""
    return {
        one.label: xr.Variable("motion", measure(one, plain), {"units": one.units, "long_name": one.long_name})
        for one in chosen
    }
