"""Benches and isolated platforms between a floor and the pieces of an inventory."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import xarray as xr

from ...core.doubts import Doubt, noted
from ...motions.arrays import Record, from_array
from ...motions.supports.isolator import Isolator
from ...motions.supports.support import Support


@dataclass(frozen=True)
class Stand:
    """A bench or an isolated platform, which answers the motion of its floor alone and shakes what stands on it."""

    name: str
    support: Support | Isolator

    @property
    def scales(self) -> bool:
        """Whether twice the motion of the floor gives twice the motion on top."""
        return isinstance(self.support, Support)

    def carry(self, below: Sequence[Record]) -> list[Record]:
        """Return the motions on top of it under motions of its floor, in their order."""
        return self._moved(below)[0]

    def strikes(self, below: Sequence[Record]) -> list[Doubt]:
        """Return the doubt in its clearance under motions of its floor; an elastic one has no clearance."""
        if not isinstance(self.support, Isolator):
            return []
        return self.support.stops.doubts(self._moved(below)[1])

    def _moved(self, below: Sequence[Record]) -> tuple[list[Record], list[xr.DataArray]]:
        """Return the motions on top, in the order of those below, and as arrays of motions of one length."""
        found = list(below)
        tops = []
        alike: dict[tuple[float, int], list[int]] = {}
        for i, one in enumerate(below):
            alike.setdefault((one.dt, one.acceleration.size), []).append(i)
        for (dt, _), lines in alike.items():
            array = from_array(np.stack([below[i].acceleration for i in lines]), dt)
            with noted():  # (the motions of floors were looked at, and strikes are said by name)
                top = self.support.motions(array)
            step = float(top["dt"].values[0])
            tops.append(top)
            for k, i in enumerate(lines):
                source = f"{self.support!r} on {below[i].source}"
                found[i] = below[i]._replace(acceleration=top.values[k], dt=step, source=source)
        return found, tops
