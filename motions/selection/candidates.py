"""Candidates of a selection: motions whose measures are taken once, for all levels."""

from collections.abc import Iterable, Sequence

import numpy as np
import xarray as xr

from ...core.elementary import Array, Index, log
from ...core.units import described
from ..arrays import listed, records
from ..intensity.evaluation import measure, positive_measure
from ..intensity.measure import Measure

FACTOR, CANDIDATE, EVENT = "factor", "candidate", "event"
"""Coordinates of chosen motions."""


class Candidates:
    """Ground motions to select from, whose measures are taken when they are first needed, and kept.

    Parameters
    ----------
    motions : xarray.DataArray or a sequence of them
        Ground motions, m s-2; a coordinate `event` on motion names the earthquake of each, and each is one of its own
        without it.

    Examples
    --------
    >>> from toppling import motions
    >>> pool = Candidates(motions.CloughPenzien(duration=10.0, dt=0.01).sample(40, seed=1))
    >>> len(pool)
    40
    """

    def __init__(self, motions: xr.DataArray | Iterable[xr.DataArray]) -> None:
        self.single = isinstance(motions, xr.DataArray)
        self.arrays: Sequence[xr.DataArray] = listed(motions)
        self._plain = records(self.arrays)
        for array in self.arrays:
            if "motion" not in array.dims or "floor" in array.dims:
                raise ValueError(f"candidates must be ground motions with the dims (motion, time), got {array.dims}")
        names = [str(name) for array in self.arrays for name in _events(array).values]
        self.events = np.array(names)
        self.groups: Index = np.unique(names, return_inverse=True)[1]
        self._known: dict[str, Array] = {}

    def __len__(self) -> int:
        return len(self._plain)

    def values(self, im: Measure) -> Array:
        """Return a measure of the candidates as they are, SI, shape (candidate,)."""
        if im.label not in self._known:
            self._known[im.label] = measure(im, self._plain)
        return self._known[im.label]

    def factors(self, given: Measure, level: float) -> Array:
        """Return the factor of each candidate that brings a measure to a level, shape (candidate,).

        ValueError for a measure that scaling does not change, or one that is zero.
        """
        if given.label not in self._known:
            self._known[given.label] = positive_measure(given, self._plain)
        return np.asarray(given.factors(level / self._known[given.label]))

    def scaled(self, im: Measure, factors: Array) -> Array:
        """Return the logarithms of a measure of the candidates, each scaled by its factor."""
        values = self.values(im)
        if not np.all(values > 0.0):
            label = self._plain[int(np.argmin(values > 0.0))].label
            raise ValueError(f"candidate {label!r} has {im.label} = 0")
        return log(values) + im.power * log(factors)

    def chosen(self, places: Index, factors: Array) -> list[xr.DataArray]:
        """Return the motions at places (sorted), of each array with one, with their coordinates."""
        arrays, first = [], 0
        for array in self.arrays:
            picked = places[(places >= first) & (places < first + array.sizes["motion"])]
            if picked.size:
                coordinates = {
                    FACTOR: ("motion", factors[picked], described("factor to the level")),
                    CANDIDATE: ("motion", picked, described("number among the candidates")),
                    EVENT: ("motion", self.events[picked]),
                }
                arrays.append(array.isel(motion=picked - first).assign_coords(coordinates))
            first += array.sizes["motion"]
        return arrays


def _events(motions: xr.DataArray) -> xr.DataArray:
    return motions[EVENT] if EVENT in motions.coords and motions[EVENT].dims == ("motion",) else motions["motion"]
