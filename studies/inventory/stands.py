"""Benches and isolated platforms between a floor and the pieces of an inventory."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...aliases import Array
from ...doubts import Doubt, noted
from ...motions.arrays import Record, from_array
from ...motions.supports.isolator import Isolator, strike_doubts
from ...motions.supports.support import Support


@dataclass(frozen=True)
class Stand:
    """A bench or an isolated platform, which answers the motion of its floor and shakes what stands on it.

    Parameters
    ----------
    name : str
        Its name in tables.
    support : Support or Isolator
        Its mechanical model; the reaction of what stands on it is left out.
    """

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
        ways = self._moved(below)[1]
        top = from_array(np.zeros((ways.size, 2)), 1.0).assign_coords(support_displacement=("motion", ways))
        return strike_doubts([top], self.support.clearance)

    def _moved(self, below: Sequence[Record]) -> tuple[list[Record], Array]:
        """Return the motions on top, and the greatest displacement under each, (motion,), m."""
        found = list(below)
        ways = np.empty(len(found))
        alike: dict[tuple[float, int], list[int]] = {}
        for i, one in enumerate(below):
            alike.setdefault((one.dt, one.acceleration.size), []).append(i)
        for (dt, _), lines in alike.items():
            array = from_array(np.stack([below[i].acceleration for i in lines]), dt)
            with noted():  # (the motions of floors were looked at, and strikes are said by name)
                top = self.support.motions(array)
            step = float(top["dt"].values[0])
            ways[lines] = top["support_displacement"].values
            for k, i in enumerate(lines):
                source = f"{self.support!r} on {below[i].source}"
                found[i] = below[i]._replace(acceleration=top.values[k], dt=step, source=source)
        return found, ways
