"""Resurrections: blocks that do not overturn above the level at which the same motion first overturned them."""

import numpy as np
import xarray as xr

from ...core.units import described
from ..fitting.states import OVERTURNED, State, reached
from ..runs.provenance import IDA, carried_attributes, coordinates_on, design_of, motions_by_floor


def resurrections(ida: xr.Dataset, state: State = OVERTURNED) -> xr.Dataset:
    """Count levels without overturning above the level at which the same motion first overturned the block.

    Parameters
    ----------
    ida : xarray.Dataset
        With `overturned` on (block, model, level, motion), as `toppling.ida` returns it.
    state : str or float
        Another damage state instead of overturning, see `reached`.

    Returns
    -------
    xarray.Dataset
        On (block, model, with several floors floor): `pairs`, the (motion, level) pairs above the motion's first
        overturning. `stood`, the number of pairs without overturning. `returned` = `stood`/`pairs` (NaN without pairs).
        `motions`, the number of motions that overturn and have a level above. `motions_returned`, the share of these
        with at least one level without overturning.

    Notes
    -----
    The outcome of rocking is not monotone in the amplitude. A fit to first overturnings (``method="first-overturning"``
    of `fit_fragility`) counts a block that returned as overturned. Its curve therefore lies above one fitted to all
    runs. The share `returned` bounds the distance between the two curves.

    Examples
    --------
    >>> import numpy as np, xarray as xr
    >>> flags = np.array([[0, 1], [1, 0], [0, 1], [1, 1]], dtype=bool)  # level, motion
    >>> runs = xr.Dataset({"overturned": (("level", "motion"), flags)}, coords={"level": [1.0, 2.0, 3.0, 4.0]})
    >>> shares = resurrections(runs)
    >>> float(shares["returned"]), float(shares["motions_returned"])
    (0.4, 1.0)
    """
    flags = reached(ida, state)
    if design_of(flags) != IDA:
        raise ValueError("resurrections needs an IDA dataset, got one without a level dimension")
    if not {"level", "motion"} <= {*flags.dims} or "level" not in flags.indexes:
        raise ValueError(f"runs must be on level and motion, with their levels, got {flags.dims}")
    floor, groups = motions_by_floor(flags)
    flags = flags.sortby("level").transpose(..., "level", "motion")
    parts = [_counts(flags.isel(motion=motions)) for motions in groups]
    counts = parts[0] if floor is None else xr.concat(parts, floor).transpose(..., "floor")
    counts = counts.assign(
        returned=counts["stood"] / counts["pairs"].where(counts["pairs"] > 0),
        motions_returned=counts["motions_stood"] / counts["motions"].where(counts["motions"] > 0),
    ).drop_vars("motions_stood")
    for name, text in _LONG_NAMES.items():
        counts[name].attrs = described(text)
    return counts.assign_attrs(
        {**carried_attributes(ida.attrs), "title": "Blocks that stand above their first overturning"}
    )


_LONG_NAMES = {
    "pairs": "motions and levels above the motion's first overturning",
    "stood": "those of them at which the block stands",
    "returned": "share of them at which the block stands",
    "motions": "motions that overturn the block below the highest level",
    "motions_returned": "share of these motions under which it stands at a higher level",
}


def _counts(flags: xr.DataArray) -> xr.Dataset:
    """Count pairs above the first overturning, pairs without overturning, and both by motion (…, level, motion)."""
    fell = flags.values
    above = np.zeros_like(fell)
    above[..., 1:, :] = np.logical_or.accumulate(fell, axis=-2)[..., :-1, :]
    stood = above & ~fell
    dims = flags.dims[:-2]
    counts = {
        "pairs": above.sum(axis=(-2, -1)),
        "stood": stood.sum(axis=(-2, -1)),
        "motions": above.any(axis=-2).sum(axis=-1),
        "motions_stood": stood.any(axis=-2).sum(axis=-1),
    }
    return xr.Dataset({name: (dims, values) for name, values in counts.items()}, coordinates_on(flags, dims))
