"""Evaluation of intensity measures: the values of motions, plain or labelled."""

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
import xarray as xr

from ...core import checks
from ...core.aliases import Array
from ...core.doubts import warn
from ...core.units import STANDARD_GRAVITY, described, provenance
from ..arrays import HORIZONTAL, Record, motion_coordinates, records
from .directions import PairMeasure
from .measure import MEASURES, Measure
from .naming import long_name_at, measure_named, place_of
from .spectra import measure_doubts

SCALABLE = tuple(name for name, known in MEASURES.items() if known.power != 0.0)
"""Measures to which motions can be scaled."""
LEAST_PEAK = 1e-100 * STANDARD_GRAVITY


def measure(name: str | Measure, motions: Sequence[Record]) -> Array:
    """Return one measure of plain records, shape (motion,); ValueError for an unknown name."""
    im = measure_named(name)
    values = np.empty(len(motions))
    for i, record in enumerate(motions):
        try:
            values[i] = im.of_record(record)
        except ValueError as error:
            raise ValueError(f"motion {record.label!r}: {error}") from None
    return values


def positive_measure(name: str | Measure, motions: Sequence[Record]) -> Array:
    """Return a measure to scale by, shape (motion,); ValueError if it is next to zero or does not grow."""
    im = measure_named(name)
    if im.power == 0.0:
        scalable = ", ".join(map(repr, SCALABLE))
        raise ValueError(
            f"{im.label!r} does not grow with the motion and cannot be scaled to: take {scalable} or a spectral one"
        )
    for motion in motions:
        # squares of such samples underflow, and the engine treats smaller samples as zero
        if 0.0 < (peak := float(np.abs(motion.acceleration).max())) < LEAST_PEAK:
            raise ValueError(
                f"motion {motion.label!r} has a peak of {peak:.3g} m/s² and cannot be scaled: give at least "
                f"{LEAST_PEAK:.3g} m/s²"
            )
    values = measure(im, motions)
    if not np.all(values > 0.0):
        label = motions[int(np.argmin(values > 0.0))].label
        raise ValueError(f"motion {label!r} has {im.label} = 0 and cannot be scaled")
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
    >>> values = measures(motions.from_array([0.0, 2.0, 0.0], 0.1), ["pga", "cav", "Sa(0.5)"])
    >>> list(values), float(values.pga[0]), round(float(values.cav[0]), 12)
    (['pga', 'cav', 'Sa(0.5)'], 2.0, 0.2)
    """
    if which is None:
        chosen = list(MEASURES.values())
    elif isinstance(which, str | Measure):
        chosen = [measure_named(which)]
    elif checks.is_several(which):
        chosen = [measure_named(name) for name in which]
    else:
        raise TypeError(f"which must be measures or their names, got {checks.kind(which)}")
    warn(doubt for im in chosen for doubt in measure_doubts(im.label, im))
    both = all(isinstance(im, PairMeasure) for im in chosen)
    plain = records(_shaken_either_way(motions) if both else motions)
    configuration = {"measures": [im.label for im in chosen]}
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
    return [_shaken_either_way(motion) for motion in motions] if checks.is_several(motions) else motions


def measure_variables(plain: Sequence[Record], chosen: Iterable[Measure]) -> dict[str, xr.Variable]:
    """Return measures of plain records as variables on ``motion``, by label."""
    place = place_of(record.floor for record in plain)
    return {
        im.label: xr.Variable("motion", measure(im, plain), described(long_name_at(im.long_name, place), im.units))
        for im in chosen
    }
