"""One-way chain from a floor to a block: the support responds to its floor, and the block to the support."""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from ...core.aliases import Array
from ...core.parameters import RATIO
from ...core.units import ACCELERATION, METRE, described
from ..arrays import HORIZONTAL, OF_OWN_LEVEL, OWN_LEVEL, records, shakes_of

MOST_RATIO = 0.1
"""Maximum mass of a block, over the mass of block and platform, with a negligible reaction on the platform (assumed).
"""


class Motion(NamedTuple):
    """Absolute acceleration on top of a support, m/s², and its maximum displacement relative to its floor, m.

    For a platform between compliant stops also the number of strikes, and its maximum acceleration during a strike.
    """

    acceleration: Array
    displacement: float
    strikes: int = 0
    strike_acceleration: float = 0.0


def one_way_only(mass_ratio: float, accepted: bool) -> None:
    """Raise a ValueError for a block that is heavy compared with its platform, unless its reaction may be left out."""
    ratio = RATIO.number("mass_ratio", mass_ratio)
    if ratio > MOST_RATIO and not accepted:
        raise ValueError(
            f"mass_ratio must be at most {MOST_RATIO:g}, got {ratio:g}: a block as heavy as that moves its platform, "
            "which is not modelled (one_way=True leaves its reaction out all the same)"
        )


def chained(
    motions: xr.DataArray,
    on_top: Callable[[Array, float], Motion],
    name: str,
    parts: int,
    factor: float,
    level: bool,
    stops: bool = False,
) -> xr.DataArray:
    """Return the motions on top of a support under labelled motions of the ground or of floors, times a factor.

    `parts`: samples of the result per step. `level`: True if they belong to the strength of the motions below. `stops`:
    True if the support has stops that are modelled.
    """
    plain = records(motions)
    if any(record.axes or record.vertical is not None for record in plain):
        raise ValueError(f"motions must be of one horizontal component, got {' and '.join(HORIZONTAL)}")
    array = motions if "motion" in motions.dims else motions.expand_dims("motion")
    if "component" in array.dims:  # (of recordings, of which one component shakes)
        array = array.sel(component=shakes_of(array), drop=True).drop_vars("shakes")
    floors = "floor" in array.dims
    array = array.transpose("motion", *(["floor"] if floors else []), "time")
    shape = array.shape[:-1]
    n = (array.sizes["time"] - 1) * parts + 1
    values, displacements = np.empty((*shape, n)), np.empty(shape)
    strikes, hardest = np.zeros(shape, np.int64), np.zeros(shape)
    for at, below in zip(np.ndindex(*shape), plain, strict=True):
        values[at], displacements[at], strikes[at], hardest[at] = on_top(factor * below.acceleration, below.dt)
    dt = plain[0].dt / parts
    dims = array.dims[:-1]
    coordinates: dict[str, Any] = {
        str(key): coordinate.variable
        for key, coordinate in array.coords.items()
        if "time" not in coordinate.dims and key != "dt"
    }
    of = f" times {factor:g}" if factor != 1.0 else ""
    sources = np.array([f"{name} on {record.source}{of}" for record in plain], dtype=object).reshape(shape)
    text = "greatest displacement of the support relative to its floor"
    coordinates |= {
        "time": ("time", np.arange(n) * dt, described("time", "s")),
        "dt": ("motion", np.full(shape[0], dt), described("time step", "s")),
        "source": ("motion", sources.reshape(shape[0], -1)[:, 0], described("source of the motion")),
        "support_displacement": (dims, displacements, described(text, METRE)),
    }
    if stops:
        times, force = "times that the platform strikes a stop", "greatest acceleration of the platform at a stop"
        coordinates["strikes"] = (dims, strikes, described(times))
        coordinates["strike_acceleration"] = (dims, hardest, described(force, ACCELERATION))
    if level or any(record.own_level for record in plain):
        coordinates[OWN_LEVEL] = ("motion", np.full(shape[0], True), OF_OWN_LEVEL)
    return xr.DataArray(
        values,
        dims=(*dims, "time"),
        coords=coordinates,
        name="acceleration",
        attrs={**array.attrs, "units": "m s-2", "long_name": "absolute acceleration on the support", "support": name},
    )
