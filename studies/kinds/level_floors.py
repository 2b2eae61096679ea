"""Floor motions of an inventory at each level of the ground motion, through yielding parts below a piece."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
import xarray as xr

from ...core.aliases import Array, Index
from ...core.doubts import Doubt, noted, warn
from ...core.facts import Fact
from ...core.units import DIMENSIONLESS, METRE
from ...fragility.runs.scaling import BLOCK_MEASURES, SCALE
from ...motions import Building, Generator, records
from ...motions.arrays import Record
from ...motions.floors.histories import FloorHistories, History
from ...motions.floors.yielding import FACTOR
from ...motions.plausibility import collapse_doubts, history_doubts, ringing_doubts
from ...motions.scaling import scale_to
from ..buildings.notes import PROPORTIONAL, history_notes
from ..buildings.shaking import Shaking
from ..buildings.variables import variable
from ..facts.say import notes_said
from ..file.analyses import LEVEL_UNITS, LevelsTable, PerformanceTable
from ..file.buildings import BuildingTable
from ..file.floor_index import read_floor_index
from ..file.motions import SHAKES, IndexedFloorMotions, MotionsTable
from ..inventory.contents import Inventory
from ..plan.reading import Reading
from ..plan.size import refuse_samples

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
    """Return the reading of motions, with the input warnings on them and on the building's motion under them."""
    arrays = arrays_of(motions)
    reading = Reading.of(arrays, generator)
    if building is None:
        return reading
    with noted():  # a study has input warnings among its notes
        roof = building.floor_motions(arrays, [building.floors[-1]])
    return reading._replace(doubts=(*reading.doubts, *ringing_doubts(roof)))


def motion_notes(motions: Motions, inventory: Inventory, elastic: bool, yields: bool = False) -> list[Fact]:
    """Return notes on floor histories."""
    if isinstance(motions, FloorHistories):
        if yields:
            return []
        return history_notes(motions, inventory)
    return [PROPORTIONAL] if elastic else []


def refuse_scaling(table: MotionsTable, levels: str, about: bool = False) -> None:
    """Raise a ValueError if floor histories would be scaled without saying that the building is elastic."""
    scales = f"{levels} scale" if levels else "performance.modelling_dispersion at a given level scales"
    if (levels or about) and table.given("floors_file") is not None and not table.given("elastic"):
        raise ValueError(
            f"{scales} the histories of motions.floors_file, which holds for an elastic building alone: say "
            "motions.elastic = true, or give a motions.floors_index with histories of each level"
        )
    if table.given("elastic") and not levels and not (about and table.given("floors_file") is not None):
        raise ValueError("motions.elastic is of histories that are scaled to performance.levels, which are not given")


def read_histories(table: MotionsTable, asked: PerformanceTable, folder: Path) -> FloorHistories | None:
    """Read the floor histories with levels of their own, in the unit of their index; None if there is no index."""
    if not isinstance(table, IndexedFloorMotions):
        return None
    path = folder / table.floors_index
    axes = "" if table.component is None else SHAKES[table.axes or "both"]
    histories = replace(read_floor_index(path, table.dt_s, table.unit), axes=axes)
    if not table.elastic:
        if asked.levels is not None:
            named = named_levels(histories)
            own_levels = f" ({named})" if named else ""
            raise ValueError(
                f"performance.levels do not go with motions.floors_index: its histories are used as they are, at their "
                f"own levels{own_levels}; motions.elastic = true scales one set of them to other levels"
            )
        return histories
    if not histories.unit:
        raise ValueError(f"motions.elastic needs the level of the set that is scaled, such as 'level (g)' in {path}")
    if histories.levels.size > 1:
        raise ValueError(
            f"motions.elastic scales one set of histories, {path} has sets at {histories.levels.size} levels: leave "
            "motions.elastic and performance.levels out, and they are used as they are"
        )
    return replace(histories, elastic=True)


def named_levels(histories: FloorHistories) -> str:
    """Return the first levels of histories as they were given, '' if they have none."""
    return ", ".join(histories.texts[:MOST_NAMED]) if histories.unit else ""


def levels_of(histories: FloorHistories) -> LevelsTable:
    """Return the levels of histories in the form of a study file."""
    return LevelsTable(values=histories.levels.tolist(), unit=histories.unit)


def in_si(histories: FloorHistories, im: str, near: Array) -> FloorHistories:
    """Return histories with their levels in SI: the levels `near` if they differ from these by rounding alone."""
    if not histories.unit:
        warn(history_doubts(histories, ""))
        return histories
    own_levels = levels_of(histories).build(im)
    alike = own_levels.shape == near.shape and np.allclose(own_levels, near, rtol=1e-9, atol=0.0)
    near_histories = histories.at(near if alike else own_levels)
    warn(history_doubts(near_histories, im))
    return near_histories


class LevelFloors(NamedTuple):
    """Floor motions at each level, notes on them, and the building's own response (level, motion).

    `ductility`: maximum drift of a storey over its yield drift. `collapsed`: the storey that collapsed, 0 for none.
    Both are None if the building scales. `strength`: factor on its strengths (motion,), None if it is certain.
    `isolator`: maximum displacement of its isolators, m, None without any.
    """

    histories: FloorHistories
    reading: Reading
    ductility: Array | None
    collapsed: Index | None
    strength: Array | None
    isolator: Array | None

    def variables(self, polarities: int) -> dict[str, xr.Variable]:
        """Return the building's response as variables of the results; each motion has `polarities` runs."""
        if self.ductility is None or self.collapsed is None:
            return {}
        drift = "greatest drift of a storey over its drift at yielding"
        storey = "storey that collapses, from 1; 0 for none"
        responses = {"building_ductility": (self.ductility, drift), "building_collapsed": (self.collapsed, storey)}
        variables = {
            name: variable(("level", "motion"), np.repeat(values, polarities, axis=1), DIMENSIONLESS, text)
            for name, (values, text) in responses.items()
        }
        if self.isolator is not None:
            text = "greatest displacement of the isolators below the building"
            values = np.repeat(self.isolator, polarities, axis=1)
            variables["building_isolator_displacement"] = variable(("level", "motion"), values, METRE, text)
        if self.strength is not None:
            of = np.repeat(self.strength, polarities)
            variables["building_strength_factor"] = xr.Variable(("motion",), of, FACTOR)
        return variables


def what_yields(building: BuildingTable | None, inventory: Inventory) -> str:
    """Return in words the parts that do not scale between the ground and the pieces of an inventory, '' for none."""
    if building is not None and not building.scales:
        return building.what
    return "an isolator that yields" if any(row.stand and not row.stand.scales for row in inventory.rows) else ""


def check_levels(what: str, asked: PerformanceTable, yearly: bool) -> None:
    """Raise a ValueError if motions do not pass the yielding parts at each level, or levels about it are needed."""
    if asked.levels is not None and asked.im in (SCALE, *BLOCK_MEASURES):
        raise ValueError(f"{what} needs a measure of the ground motion, got performance.im {asked.im!r}")
    if asked.modelling_dispersion > 0.0 and not yearly:
        raise ValueError(
            "performance.modelling_dispersion at a given level needs outcomes at levels about it, to which what is "
            f"above {what} is not scaled: give a [hazard], or leave it out"
        )


def level_floors(
    building: BuildingTable | None,
    inventory: Inventory,
    ground: Sequence[xr.DataArray],
    generator: Generator | None,
    im: str,
    levels: Array,
    unit: str,
) -> LevelFloors:
    """Scale ground motions (m s-2) to each level (level,), and send them through the building, if there is one."""
    floors = sorted({int(row.floor) for row in inventory.rows})
    table = None if building is None else building.model_copy(update={"floors": floors, "name": None})
    factors = levels if unit else np.ones(1)
    refuse_samples(
        len(floors) * factors.size * sum(array.size for array in ground), "motions on all floors at all levels"
    )
    reading = reading_of(tuple(ground), generator, None if building is None or not building.scales else building.made())
    doubts, lines = list(reading.doubts), []
    histories_of: list[History] = []
    ductility, collapsed, isolator = [], [], []
    strength = None
    if table is not None:
        lines += notes_said(table.strength_facts)
    for level in factors.tolist():
        given = level / LEVEL_UNITS[unit][0] if unit else 1.0
        where = f"at {im} of {given:.4g} {unit} " if unit else ""
        scaled = [scale_to(array, level, im) for array in ground] if unit else list(ground)
        moved = _moved(table, scaled)
        if table is not None and not table.scales:
            labels = [str(label) for array in moved for label in array["motion"].values]
            ductility.append(np.concatenate([array["ductility"].values for array in moved]))
            collapsed.append(np.concatenate([array["collapsed"].values for array in moved]))
            if table.given("isolation") is not None:
                isolator.append(np.concatenate([array["isolator_displacement"].values for array in moved]))
            if "strength_factor" in moved[0].coords:  # (the same at every level)
                strength = np.concatenate([array["strength_factor"].values for array in moved])
            lines.append(f"{where}{table.yielding(scaled, moved)}")
            of_level = collapse_doubts(labels, collapsed[-1])
            doubts += [doubt._replace(sentence=f"{where}{doubt.sentence}") for doubt in of_level]
        histories_of += [_history(given, record) for array in moved for record in records(array)]
    histories = FloorHistories.of(histories_of, unit)
    return LevelFloors(
        histories.at(levels) if unit else histories,
        # the strength of scaled motions has no meaning
        reading._replace(doubts=tuple(doubts), storeys=tuple(lines), own_strength=not unit),
        np.array(ductility) if ductility else None,
        np.array(collapsed) if collapsed else None,
        strength,
        np.array(isolator) if isolator else None,
    )


def strikes(inventory: Inventory, shaking: Shaking) -> list[Doubt]:
    """Return the input warnings on the clearances of platforms below pieces, one for each platform and level."""
    doubts = []
    for at in shaking.supports(inventory):
        if at.stand is None or at.stand.scales or shaking.histories is None:
            continue
        below = shaking.below(at)
        per_level = len(below) // len(shaking.histories.texts)
        for k, text in enumerate(shaking.histories.texts):
            of_level = at.stand.strikes(below[k * per_level : (k + 1) * per_level])
            where = f" at {text}" if shaking.histories.unit else ""
            named = f"support {at.stand.name!r} on floor {at.floor}{where}"
            doubts += [doubt._replace(sentence=f"{named}: {doubt.sentence}") for doubt in of_level]
    return doubts


def _moved(table: BuildingTable | None, ground: list[xr.DataArray]) -> list[xr.DataArray]:
    if table is None:
        return ground
    try:
        with noted():  # a study has input warnings among its notes
            return table.shake(ground)
    except ValueError as error:
        raise ValueError(f"building: {error}") from None


def _history(level: float, record: Record) -> History:
    """Return a motion of the ground or of a floor as a history of its level."""
    if record.axes or record.vertical is not None:
        raise ValueError("what yields between the ground and a piece needs motions of one horizontal component")
    name = record.label.removesuffix(f" floor {record.floor}") if record.floor else record.label
    return History(level, name, record.floor or "0", "", record.acceleration, record.dt, record.source)
