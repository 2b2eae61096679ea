"""The shaking of a building's contents: ground motions, and the motions of each floor under them."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import xarray as xr

from ... import checks
from ...fragility.runs.scaling import ground_of
from ...motions import Building
from ...motions.arrays import Record, records
from .contents import Inventory


@dataclass(frozen=True)
class Shaking:
    """Ground motions and the floor motions under them; `known` are the existing floors."""

    ground: list[Record]
    known: list[str]
    arrays: list[xr.DataArray]
    building: Building | None

    @classmethod
    def of(cls, building: Any, motions: Any, ground: Any, scaled_plainly: bool = False) -> Shaking:
        """Make the shaking from arguments of `assess`; plain scale factors (`scaled_plainly`) need no ground motions.

        Raises
        ------
        TypeError, ValueError
            As `toppling.motions.records`; floor motions where there is a building, without their ground motions, or
            beside ground motions.
        """
        if building is not None and not isinstance(building, Building):
            raise TypeError(f"building must be a Building or None, got {checks.kind(building)}")
        several = isinstance(motions, Iterable) and not isinstance(motions, xr.DataArray)
        arrays = list(motions) if several else [motions]
        plain = records(arrays)
        on_floors = [array for array in arrays if "floor" in array.dims]
        if not on_floors:
            if ground is not None:
                raise ValueError("ground must not be given where motions are ground motions already")
            known = ["0"] if building is None else [str(floor) for floor in building.floors]
            return cls(plain, known, arrays, building)
        if building is not None:
            raise ValueError("motions must be ground motions where there is a building, got floor motions")
        if len(on_floors) < len(arrays):
            raise ValueError("motions must be all ground motions or all floor motions, got both")
        named = [_floors_of(array) for array in arrays]
        known = [floor for floor in named[0] if all(floor in one for one in named)]
        if not known:
            raise ValueError("motions must hold the same floors, got arrays that have none in common")
        first = records([array.isel(floor=[one.index(known[0])]) for array, one in zip(arrays, named, strict=True)])
        if ground is not None:
            return cls(ground_of(first, records(ground)), known, arrays, None)
        if "0" in known:
            at = [array.isel(floor=one.index("0"), drop=True) for array, one in zip(arrays, named, strict=True)]
            return cls(records(at), known, arrays, None)
        if scaled_plainly:
            bare = [one._replace(label=one.label.removesuffix(f" floor {one.floor}"), floor="") for one in first]
            return cls(bare, known, arrays, None)
        raise ValueError(
            f"ground must be given with floor motions that do not hold floor 0, the ground (they hold "
            f"{', '.join(known[:12])}): the levels are of its measure"
        )

    def used(self, inventory: Inventory) -> list[str]:
        """Return the floors that contents stand on, in the building's order; ValueError for a floor that it lacks."""
        for row in inventory.rows:
            if str(row.floor) not in self.known:
                hint = "; give a building, or floor motions" if self.known == ["0"] and self.building is None else ""
                shown = ", ".join(self.known if len(self.known) <= 12 else [*self.known[:5], "…", self.known[-1]])
                raise ValueError(f"floor of {row.label!r} must be one of {shown}, got {row.floor!r}{hint}")
        standing = {str(row.floor) for row in inventory.rows}
        return [floor for floor in self.known if floor in standing]

    def on(self, floor: str) -> list[Record]:
        """Return the motions of one floor, in the order of the ground motions."""
        if self.building is not None:
            return records(self.building.floor_motions(self.arrays, [int(floor)]))
        if not any("floor" in array.dims for array in self.arrays):
            return self.ground
        return records([array.isel(floor=[_floors_of(array).index(floor)]) for array in self.arrays])


def _floors_of(array: xr.DataArray) -> list[str]:
    if "floor" in array.coords:
        return [str(floor) for floor in array["floor"].values]
    return [str(i) for i in range(array.sizes["floor"])]
