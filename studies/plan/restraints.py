"""How often restraints of blocks break: shares of the motions at each level, and at the design shaking."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr

from ...fragility import HazardCurve, overturning_probability
from ...fragility.numerics.slabs import gathered
from ...models import Block
from ...units import DIMENSIONLESS
from ...wording import given_percent
from .design_shaking import at_level, design_level

FLAG = "ruptured"
"""Output of a run that says whether its restraint broke."""
BROKEN = "broken_probability"
"""Variable with the share of the motions in which a restraint breaks, and beginning of the names of its interval."""
AT_DESIGN = "broken_at_design"
DESIGN = "design_level"
"""Coordinate with the level of the design shaking."""
ENDS = {"": "probability", "_lower": "lower", "_upper": "upper"}


def any_held(blocks: Sequence[Block]) -> bool:
    """Return whether a restraint holds any of some blocks."""
    return any(block.restraint is not None for block in blocks)


def ruptures(
    runs: xr.Dataset, blocks: Sequence[Block], confidence: float, hazard: HazardCurve | None = None
) -> xr.Dataset:
    """Return the shares of the motions in which the restraints of blocks break.

    Parameters
    ----------
    runs : xarray.Dataset
        Runs at levels with the output ``ruptured``.
    blocks : sequence of Block
        The blocks of the runs.
    confidence : float
        Of the intervals, which are those of `overturning_probability`.
    hazard : HazardCurve, optional
        Hazard curve of the measure of the levels.

    Returns
    -------
    xarray.Dataset
        ``broken_probability`` with its interval on the dimensions of `overturning_probability`, NaN of blocks without a
        restraint; with a hazard curve ``broken_at_design``, the same at the level that is exceeded with 10 % in 50
        years (between the levels by straight lines over the logarithm; NaN beyond them), which is the coordinate
        ``design_level``.
    """
    flags = runs.assign(overturned=runs[FLAG])
    counted = gathered(lambda part: overturning_probability(part, confidence), flags)
    held = xr.DataArray([block.restraint is not None for block in blocks], dims="block")
    text, percent = "probability that the restraint breaks", given_percent(confidence)
    found = xr.Dataset()
    for end, name in ENDS.items():
        long_name = f"{end[1:]} end of the {percent} interval: {text}" if end else text
        attributes = {"units": DIMENSIONLESS, "long_name": long_name}
        found[f"{BROKEN}{end}"] = counted[name].where(held).assign_attrs(attributes)
    if hazard is None:
        return found
    levels = found["level"]
    design = design_level(levels.values, hazard)
    for end in ENDS:
        given = found[f"{BROKEN}{end}"].transpose(..., "level")
        there = given.isel(level=0, drop=True).copy(data=at_level(design, levels.values, given.values))
        long_name = f"{given.attrs['long_name']}, under the shaking that is exceeded with 10 % in 50 years"
        found[f"{AT_DESIGN}{end}"] = there.assign_attrs(units=DIMENSIONLESS, long_name=long_name)
    name = "level that is exceeded with a probability of 10 % in 50 years"
    return found.assign_coords({DESIGN: ((), np.float64(design), {"units": levels.attrs["units"], "long_name": name})})
