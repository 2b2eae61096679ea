"""Polarities: a motion as it was recorded, and the same motion from the other side."""

from collections.abc import Iterable
from typing import Any

import numpy as np
import xarray as xr

from ..core import checks
from ..core.units import described
from .arrays import REVERSE_OF, VERTICAL, Record, listed, records

AS_RECORDED, BOTH = "as recorded", "both"
POLARITIES = (AS_RECORDED, BOTH)
"""Polarities in which motions are run: as they were recorded, or both ways."""
REVERSED = ", reversed"
"""End of the label of a reversed motion."""


def records_under(motions: xr.DataArray | Iterable[xr.DataArray], polarity: str) -> list[Record]:
    """Return the records of motions, with `polarity` "both" each followed by its reverse; errors as `records`."""
    return records(arrays_under(motions, polarity))


def arrays_under(motions: xr.DataArray | Iterable[xr.DataArray], polarity: str) -> list[xr.DataArray]:
    """Return motions as a list of arrays, with `polarity` "both" each motion followed by its reverse."""
    chosen = checks.choice("polarity", polarity, POLARITIES)
    arrays = listed(motions)
    return both_polarities(arrays) if chosen == BOTH else arrays


def both_polarities(motions: Any) -> Any:
    """Return labelled motions with each followed by its reverse; arrays of both polarities are returned as they are.

    The labels are ``…`` and ``…, reversed``; ``reverse_of`` (motion,) is the label of the motion that each reverses,
    empty for the motions as given. For other objects than labelled arrays, `records` raises the error.
    """
    if checks.is_several(motions) and not isinstance(motions, xr.DataArray):
        return [both_polarities(motion) for motion in motions]
    if not isinstance(motions, xr.DataArray) or REVERSE_OF in motions.coords or "time" not in motions.dims:
        return motions
    array = motions if "motion" in motions.dims else motions.expand_dims("motion")
    n = array.sizes["motion"]
    labels = [f"motion {i + 1}" for i in range(n)]
    if "motion" in array.coords:
        labels = [str(label) for label in np.atleast_1d(array["motion"].values)]
    signs = xr.DataArray(np.tile([1.0, -1.0], n), dims="motion")
    if "component" in array.dims:  # (the vertical acceleration stays: a block is turned round, and not upside down)
        signs = signs.where(array["component"] != VERTICAL, 1.0)
    twice = array.isel(motion=np.repeat(np.arange(n), 2))
    of = described("motion that this one reverses, empty for a motion as given")
    named = described("motion")
    both = [name for label in labels for name in (label, label + REVERSED)]
    reverse_of = [name for label in labels for name in ("", label)]
    return twice.copy(data=(twice * signs).transpose(*twice.dims).values).assign_coords(
        {
            "motion": ("motion", np.array(both, dtype=object), named),
            REVERSE_OF: ("motion", np.array(reverse_of, dtype=object), of),
        }
    )
