"""Capacities: the level of a measure at which each motion first overturns a block, known to lie between two levels.

Runs of any design give it in levels and as a factor on the unscaled motion.  The factor converts into every other
measure, since a motion times f has f**power times the measure.
"""

from typing import NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ...core import checks
from ...core.elementary import Array, exp, log
from ...core.units import DIMENSIONLESS, variables as variables_on
from ..fitting.first_overturning import SHIFT, brackets, level_shift, spacing_attributes
from ..fitting.states import OVERTURNED, State, reached, state_name
from ..numerics.slabs import spread
from ..runs.provenance import carried_attributes, coordinates_on, intensity_of, level_measure, scaled_to_levels


class OrderedRuns(NamedTuple):
    """Runs in the order of growing levels, with the scaling of every run.

    `overturned`: flags on (…, motion, level), in the order of growing levels. `log_levels`: ln of the level, on level;
    without levels on motion (or block, motion) and a level of size 1. `log_measured`: ln of the measure of the unscaled
    motions, 0 for plain factors. `power`: of the measure. `name`, `units`, `long_name`: of the measure, ``ground_pga``
    for the ground motion below. `order`: of the levels in the runs. `unscaled`: True for runs without scaling.
    """

    overturned: xr.DataArray
    log_levels: xr.DataArray
    log_measured: xr.DataArray
    power: float
    name: str
    units: str
    long_name: str
    order: NDArray[np.intp]
    unscaled: bool

    @property
    def factors_by_block(self) -> Array:
        """Ln of the scale factor of every run, (block, motion, level); one block if all blocks have the same."""
        factors = (self.log_levels - self.log_measured) / self.power
        if self.unscaled:
            factors = xr.zeros_like(factors)
        return spread(factors, ("block", "motion", "level"))

    def in_order(self, values: xr.DataArray) -> xr.DataArray:
        """Return results of the runs, without coordinates, on (…, motion, level) in the order of the levels."""
        shaped = values.isel(level=self.order) if "level" in values.dims else values.expand_dims("level", axis=-1)
        return without_coordinates(shaped.transpose(..., "motion", "level"))


def ordered_runs(runs: xr.Dataset, state: State = OVERTURNED) -> OrderedRuns:
    """Return the runs of an IDA, of stripes or of a cloud, level by level."""
    flags = reached(runs, state)
    checks.not_empty("runs", flags, "level")
    levels = intensity_of(runs)
    if "level" in flags.dims:
        order = np.argsort(checks.numbers("levels", levels), kind="stable")
        levels = levels.isel(level=order)
    else:
        levels, order = levels.expand_dims("level", axis=-1), np.zeros(1, np.intp)
    values = np.asarray(levels.values, dtype=float)
    if not np.all(np.isfinite(values)) or np.any(values <= 0.0):
        raise ValueError(f"levels must be finite and > 0, got {values.min():g} to {values.max():g}")
    measured = level_measure(runs)
    ordered = OrderedRuns(
        flags,
        without_coordinates(levels.copy(data=log(levels.values))),
        without_coordinates(measured.values.copy(data=log(measured.values.values))),
        1.0 if measured.measure is None else measured.measure.power,
        measured.name,
        str(levels.attrs.get("units", DIMENSIONLESS)),
        str(levels.attrs.get("long_name", measured.name)),
        order,
        not scaled_to_levels(runs),
    )
    return ordered._replace(overturned=ordered.in_order(flags).astype(bool))


def without_coordinates(array: xr.DataArray) -> xr.DataArray:
    """Return an array without coordinates, so that arithmetic is by dimension alone."""
    return array.drop_vars(list(array.coords))


def overturning_capacity(runs: xr.Dataset, state: State = OVERTURNED) -> xr.Dataset:
    """Return the capacity of each block under each motion: the two levels between which it first overturns.

    Parameters
    ----------
    runs : xarray.Dataset
        On level and motion and any other dimensions, as `toppling.ida` returns them.
    state : str or float
        ``overturned``, ``uplifted``, or a threshold of |theta|/alpha, see `reached`.

    Returns
    -------
    xarray.Dataset
        On (…, motion): `lower` and `upper` ends, in the unit of the level (0 if the lowest level overturns, inf if none
        does). `capacity` is their geometric mean, NaN if one end is not known. `stood_above` is True if some higher
        level does not overturn.

    Notes
    -----
    Overturning is not monotonic in the scale of a motion: the capacity is the first overturning at the levels of the
    runs. Below it there are narrower intervals of overturning, which closer levels find. The variable `level_shift` and
    the attributes `level_spacing` and `note` show the effect of the levels. `level_shift`, on all dimensions except
    motion, is the mean gain of ln(capacity) without every other level. `level_spacing` is the largest ratio of
    neighbouring levels, less 1.

    Examples
    --------
    >>> import toppling as tp
    >>> shakes = tp.motions.CloughPenzien(duration=10.0, dt=0.01).sample(4)
    >>> runs = tp.ida(tp.catalogue["bookcase-5-shelf"], tp.HousnerImpact(), shakes, [2.0, 4.0, 8.0])
    >>> overturning_capacity(runs).upper.dims
    ('block', 'model', 'motion')
    """
    ordered = ordered_runs(runs, state)
    if "level" not in runs.dims:
        raise ValueError("capacities need every motion at several levels, got runs at one intensity each")
    levels = exp(ordered.log_levels.values)
    flags = ordered.overturned.values
    capacities = brackets(flags, levels)
    lower = np.where(np.isfinite(capacities.lower), capacities.lower, 0.0)
    known = (lower > 0.0) & np.isfinite(capacities.upper)
    capacity = np.where(known, np.sqrt(lower) * np.sqrt(capacities.upper), np.nan)
    dims = tuple(d for d in ordered.overturned.dims if d != "level")
    shape = flags.shape[:-2]
    shifts = np.reshape([level_shift(flags[where], levels) for where in np.ndindex(*shape)], shape)
    name = state_name(state)
    table = {
        "lower": (lower, ordered.units, f"highest level below the first {name}: {ordered.long_name}"),
        "upper": (capacities.upper, ordered.units, f"lowest level with {name}: {ordered.long_name}"),
        "capacity": (capacity, ordered.units, f"geometric mean of lower and upper: {ordered.long_name}"),
        "stood_above": (capacities.stood_above, DIMENSIONLESS, f"whether a level above is without {name}"),
    }
    coords = {name: coordinate for name, coordinate in coordinates_on(runs, dims).items() if name != "intensity"}
    return xr.Dataset(
        {**variables_on(dims, table), "level_shift": (dims[:-1], shifts, SHIFT)},
        coords=coords,
        attrs={
            **carried_attributes(runs.attrs),
            "title": f"Capacities: levels of the first {name}",
            "state": name,
            "im": ordered.name,
            **spacing_attributes(levels),
        },
    )
