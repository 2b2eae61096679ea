"""The motions that an inventory study asks for: of the ground, of floors, or histories of a user's own building."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import xarray as xr

from ...core.aliases import Array
from ...core.doubts import noted, warn
from ...motions import Building, Generator
from ...motions.floors.histories import FloorHistories
from ...motions.plausibility import history_doubts, ringing_doubts
from ..buildings.notes import PROPORTIONAL, history_notes
from ..file.analyses import LevelsTable, PerformanceTable
from ..file.floor_index import read_floor_index
from ..file.motions import SHAKES, MotionsTable
from ..inventory.contents import Inventory
from ..plan.reading import Reading

Motions = tuple[xr.DataArray, ...] | FloorHistories
"""Motions of the ground or of floors, which are scaled; or floor histories with levels of their own."""
MOST_NAMED = 6
"""Most levels that a sentence names."""


def number_of(motions: Motions) -> int:
    """Return the number of motions at each level."""
    if isinstance(motions, FloorHistories):
        return motions.motions
    return sum(array.sizes["motion"] for array in motions)


def arrays_of(motions: Motions) -> Sequence[xr.DataArray]:
    """Return all motions as arrays."""
    return motions.arrays if isinstance(motions, FloorHistories) else motions


def reading_of(motions: Motions, generator: Generator | None, building: Building | None) -> Reading:
    """Return what was read of motions, with what is doubted of them and of the building's motion under them."""
    arrays = arrays_of(motions)
    found = Reading.of(arrays, generator)
    if building is None:
        return found
    with noted():  # (a study has doubts among its notes)
        roof = building.floor_motions(arrays, [building.floors[-1]])
    return found._replace(doubts=(*found.doubts, *ringing_doubts(roof)))


def motion_notes(motions: Motions, inventory: Inventory, elastic: bool, yields: bool = False) -> list[str]:
    """Return notes on floor histories, a sentence each."""
    if isinstance(motions, FloorHistories):
        if yields:
            return []
        return history_notes(motions, inventory)
    return [PROPORTIONAL] if elastic else []


def refuse_scaling(table: MotionsTable, levels: str, about: bool = False) -> None:
    """Raise a ValueError where floor histories would be scaled without saying that the building is elastic."""
    scales = f"{levels} scale" if levels else "performance.modelling_dispersion at a given level scales"
    if (levels or about) and table.floors_file is not None and not table.elastic:
        raise ValueError(
            f"{scales} the histories of motions.floors_file, which holds for an elastic building alone: say "
            "motions.elastic = true, or give a motions.floors_index with histories of each level"
        )
    if table.elastic and not levels and not (about and table.floors_file is not None):
        raise ValueError("motions.elastic is of histories that are scaled to performance.levels, which are not given")


def read_histories(table: MotionsTable, asked: PerformanceTable, folder: Path) -> FloorHistories | None:
    """Read the floor histories with levels of their own, in the unit of their index; None where there is no index."""
    if table.floors_index is None:
        return None
    path = folder / table.floors_index
    axes = "" if table.component is None else SHAKES[table.axes or "both"]
    found = replace(read_floor_index(path, table.dt_s, table.unit), axes=axes)
    if not table.elastic:
        if asked.levels is not None:
            named = named_levels(found)
            own = f" ({named})" if named else ""
            raise ValueError(
                f"performance.levels do not go with motions.floors_index: its histories are used as they are, at their "
                f"own levels{own}; motions.elastic = true scales one set of them to other levels"
            )
        return found
    if not found.unit:
        raise ValueError(f"motions.elastic needs the level of the set that is scaled, such as 'level (g)' in {path}")
    if found.levels.size > 1:
        raise ValueError(
            f"motions.elastic scales one set of histories, {path} has sets at {found.levels.size} levels: leave "
            "motions.elastic and performance.levels out, and they are used as they are"
        )
    return replace(found, elastic=True)


def named_levels(histories: FloorHistories) -> str:
    """Return the first levels of histories as they were given, '' where they have none."""
    return ", ".join(histories.texts[:MOST_NAMED]) if histories.unit else ""


def levels_of(histories: FloorHistories) -> LevelsTable:
    """Return the levels of histories as those of a study file."""
    return LevelsTable(values=histories.levels.tolist(), unit=histories.unit)


def in_si(histories: FloorHistories, im: str, near: Array) -> FloorHistories:
    """Return histories with their levels in SI: the levels `near` where they differ from these by rounding alone."""
    if not histories.unit:
        warn(history_doubts(histories, ""))
        return histories
    own = levels_of(histories).build(im)
    alike = own.shape == near.shape and np.allclose(own, near, rtol=1e-9, atol=0.0)
    found = histories.at(near if alike else own)
    warn(history_doubts(found, im))
    return found
