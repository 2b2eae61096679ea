"""The motions of a building's contents: ground motions, and the motions of each floor under them."""

from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from ...core import checks
from ...core.aliases import Array
from ...core.units import DIMENSIONLESS, described
from ...fragility.runs.axes import along_depth, along_width, axes_of
from ...fragility.runs.factors import ScaleFactors, dense, unscaled
from ...fragility.runs.scaling import SCALE, Scaling, ground_of, increasing, intensity_measure, scaling
from ...motions import Building
from ...motions.arrays import (
    AS_GIVEN,
    POLARITY,
    RECORD,
    REVERSE_OF,
    Record,
    listed,
    motion_coordinates,
    polarity_coordinate,
    records,
)
from ...motions.floors.histories import DIRECTIONS, FloorHistories
from ...motions.intensity.directions import PairMeasure
from ...motions.intensity.measure import Measure
from ...motions.intensity.naming import GROUND, long_name_at
from ...motions.polarity import AS_RECORDED, BOTH, POLARITIES, records_under
from ..inventory.contents import Contents, Inventory, Stand, floor_text


class Support(NamedTuple):
    """Place of pieces: floor, direction of their widths ('' for only one), and bench or platform below, if any."""

    floor: str
    direction: str
    stand: Stand | None = None

    @property
    def order(self) -> tuple[str, str, str]:
        """Sort key of the supports of one floor."""
        return self.floor, self.direction, "" if self.stand is None else self.stand.name


def support_of(row: Contents) -> Support:
    """Return the place of a line of an inventory."""
    return Support(str(row.floor), row.direction, row.stand)


class Shaken(NamedTuple):
    """The motions of a floor as run, with factors (1, level, motion): 1 if each level has its own motions."""

    motions: list[Record]
    factors: Array
    of_runs: ScaleFactors


@dataclass(frozen=True)
class Shaking:
    """Ground motions and the floor motions under them; `known` are the existing floors.

    `histories`: floor motions of a user's own building model, whose ground motions are not known (`ground` is empty).
    `polarity`: polarity of the runs; with both, each of `ground` and of `histories` is followed by its reverse, while
    `arrays` are as given.
    """

    ground: list[Record]
    known: list[str]
    arrays: list[xr.DataArray]
    building: Building | None
    histories: FloorHistories | None = None
    polarity: str = AS_RECORDED

    @classmethod
    def of(
        cls, building: Any, motions: Any, ground: Any, scaled_plainly: bool = False, polarity: str = AS_RECORDED
    ) -> "Shaking":
        """Make the motions from arguments of `assess`; plain scale factors (`scaled_plainly`) need no ground motion."""
        checks.choice("polarity", polarity, POLARITIES)
        if building is not None and not isinstance(building, Building):
            raise TypeError(f"building must be a Building or None, got {checks.kind(building)}")
        if isinstance(motions, FloorHistories):
            if building is not None or ground is not None:
                raise ValueError("floor histories go with neither a building nor ground motions")
            run = motions.both_ways if polarity == BOTH else motions
            return cls([], list(motions.floors), motions.arrays, None, run, polarity)
        arrays = listed(motions)
        if any(isinstance(array, xr.DataArray) and REVERSE_OF in array.coords for array in arrays):
            raise ValueError("motions must be as given, without their reverses, which polarity 'both' adds")
        plain = records_under(arrays, polarity)
        on_floors = [array for array in arrays if "floor" in array.dims]
        if not on_floors:
            if ground is not None:
                raise ValueError("ground must not be given where motions are ground motions already")
            known = ["0"] if building is None else [str(floor) for floor in building.floors]
            return cls(plain, known, arrays, building, polarity=polarity)
        if building is not None:
            raise ValueError("motions must be ground motions where there is a building, got floor motions")
        if len(on_floors) < len(arrays):
            raise ValueError("motions must be all ground motions or all floor motions, got both")
        named = [_floors_of(array) for array in arrays]
        known = [floor for floor in named[0] if all(floor in floors for floors in named)]
        if not known:
            raise ValueError("motions must hold the same floors, got arrays that have none in common")
        lowest = [array.isel(floor=[floors.index(known[0])]) for array, floors in zip(arrays, named, strict=True)]
        first = records_under(lowest, polarity)
        if ground is not None:
            return cls(ground_of(first, records_under(ground, polarity)), known, arrays, None, polarity=polarity)
        if "0" in known:
            at = [array.isel(floor=floors.index("0"), drop=True) for array, floors in zip(arrays, named, strict=True)]
            return cls(records_under(at, polarity), known, arrays, None, polarity=polarity)
        if scaled_plainly:
            return cls([_bare(array) for array in first], known, arrays, None, polarity=polarity)
        raise ValueError(
            f"ground must be given with floor motions that do not hold floor 0, the ground (they hold "
            f"{', '.join(known[:12])}): the levels are of its measure"
        )

    def used(self, inventory: Inventory) -> list[str]:
        """Return the floors with contents, in the building's order; ValueError for a floor that it lacks."""
        for row in inventory.rows:
            if str(row.floor) not in self.known:
                raise ValueError(f"floor of {row.label!r} {floor_text(self.known, row.floor)}")
        standing = {str(row.floor) for row in inventory.rows}
        return [floor for floor in self.known if floor in standing]

    def supports(self, inventory: Inventory) -> list[Support]:
        """Return the floors with contents, with the directions of their widths, in the building's order."""
        standing = sorted({support_of(row) for row in inventory.rows}, key=lambda at: at.order)
        return [at for floor in self.used(inventory) for at in standing if at.floor == floor]

    def placed(self, inventory: Inventory) -> Inventory:
        """Return the inventory with directions of all lines, '' without pairs; ValueError for unfit supports."""
        self.used(inventory)
        for row in inventory.rows:
            self._check_stand(row)
        return replace(inventory, rows=tuple(replace(row, direction=self._direction(row)) for row in inventory.rows))

    def _check_stand(self, row: Contents) -> None:
        if row.stand is None:
            return
        what = f"support {row.stand.name!r} of {row.label!r}"
        if self.axes or any(motion.vertical is not None for motion in self.ground):
            raise ValueError(f"{what} is shaken by one horizontal component, got pairs or vertical shaking")
        if not row.stand.scales and (self.histories is None or self.histories.elastic):
            raise ValueError(f"{what} yields, and needs motions of each level that are not scaled")

    def _direction(self, row: Contents) -> str:
        if self.histories is None:
            return (row.direction or DIRECTIONS[0]) if self.axes else ""
        known = self.histories.directions(str(row.floor))
        if self.axes and len(known) < len(DIRECTIONS) and not row.anchored:
            raise ValueError(
                f"floor {row.floor}, on which {row.label!r} stands, needs histories in x and y where both shake, got "
                "those of one direction"
            )
        if row.direction in known:
            return row.direction
        if row.direction and known != ("",):
            raise ValueError(f"floor {row.floor} has no histories in direction {row.direction}, that of {row.label!r}")
        if len(known) > 1 and not row.anchored:
            raise ValueError(
                f"direction of {row.label!r} must be x or y, the direction in which its width lies: floor {row.floor} "
                "has histories in both"
            )
        return known[0]

    @property
    def axes(self) -> str:
        """Axes along which pairs of components act (`fragility.runs.axes.axes_of`), '' for one component."""
        return axes_of(self.ground) if self.histories is None else self.histories.axes

    @property
    def polarities(self) -> int:
        """Runs of each motion, which follow one another: 2 if motions are run both ways, else 1."""
        return 2 if self.polarity == BOTH else 1

    @property
    def runs(self) -> int:
        """Number of runs of a piece at each level: of motions, those run both ways twice."""
        return len(self.ground) if self.histories is None else self.histories.motions

    @property
    def labels(self) -> tuple[str, ...]:
        """The labels of the motions."""
        if self.histories is None:
            return tuple(record.label for record in self.ground)
        return self.histories.labels

    @property
    def given(self) -> list[Record]:
        """The ground motions; if they are not known the floor histories, with all that may be odd in them."""
        if self.histories is None:
            return [motion for motion in self.ground if not motion.reverse_of]
        return records(self.arrays)

    @property
    def scalable(self) -> bool:
        """True if the motions can be scaled to any level."""
        return self.histories is None or self.histories.elastic

    @property
    def own_motions(self) -> bool:
        """True if each level has its own motions."""
        return self.histories is not None and self.histories.own_motions

    @property
    def coordinates(self) -> dict[str, xr.Variable]:
        """The coordinates of the motions; `record` (level, motion) names those that are only at one level."""
        if self.histories is None:
            known = motion_coordinates([record._replace(floor="") for record in self.ground])
            if self.axes:
                known["azimuth"].attrs["long_name"] = "azimuth of the building's direction x, clockwise from north"
            return known
        attributes = described("motion")
        coordinates = {"motion": xr.Variable("motion", np.array(self.labels, dtype=object), attributes)}
        given = np.array(self.histories.given, dtype=object)
        if self.own_motions:
            attributes = described("motion of the level")
            coordinates[RECORD] = xr.Variable(("level", "motion"), given, attributes)
        if self.polarities > 1:
            if not self.own_motions:
                coordinates[RECORD] = xr.Variable("motion", given[0], AS_GIVEN)
            coordinates[POLARITY] = polarity_coordinate(np.arange(self.runs) % 2 == 1)
        return coordinates

    def run_shape(self, levels: int) -> tuple[int, int]:
        """Return the numbers of levels and motions of the runs of a piece at this number of levels."""
        return (levels, self.runs) if self.histories is None else self.histories.run_shape(levels)

    def scaled(self, levels: Any, im: str | Measure) -> Scaling:
        """Return the levels of the ground motions; levels of floor histories are fixed, unless these are elastic."""
        if self.histories is None:
            if self.axes and not isinstance(intensity_measure(im), PairMeasure | None):
                raise ValueError(
                    "im must be a measure of both components where pieces may stand in either direction, RotD50(…), "
                    f"RotD100(…) or GeometricMean(…), got {im!r}"
                )
            return scaling(levels, self.ground, im, (), self.ground)
        measure = intensity_measure(im)
        values = increasing(levels, measure)
        fixed = self.histories.levels
        if self.histories.elastic:
            if fixed.size != 1 or measure is None:
                raise ValueError("histories that are scaled as of an elastic building must be one set of one level")
            assert isinstance(measure, Measure)  # measures of blocks are an error before
            measured = np.broadcast_to(fixed, self.runs)
            factors = measure.factors(values[:, None] / measured[None, None, :])
            name = long_name_at(measure.long_name, GROUND)
            return Scaling(values, factors, measure.label, measure.units, name, measured, True, measure)
        if not np.array_equal(values, fixed):
            shown = ", ".join(f"{level:.6g}" for level in fixed)
            raise ValueError(f"levels must be those of the floor histories, which are not scaled: {shown}")
        ones = np.ones((1, 1, fixed.size * self.runs))
        if measure is None:
            return Scaling(values, ones, SCALE, DIMENSIONLESS, "scale factor")
        return Scaling(values, ones, measure.label, measure.units, long_name_at(measure.long_name, GROUND), None, True)

    def shaken(self, at: Support, scaled: Scaling, im: str | Measure) -> Shaken:
        """Return the motions of a floor with their factors."""
        plain = self.on(at)
        if self.histories is None:
            scales = scaling(scaled.levels, plain, im, (), self.ground)
            return Shaken(
                plain, dense(scales.factors), scales.factors_at(xr.Variable("level", scales.levels), len(plain))
            )
        if self.histories.elastic:
            factors = scaled.factors_at(xr.Variable("level", scaled.levels), len(plain))
            return Shaken(plain, dense(scaled.factors), factors)
        once = unscaled(len(plain))._replace(levels=xr.Variable("level", np.ones(1)))
        return Shaken(plain, dense(scaled.factors), once)

    def on(self, at: Support) -> list[Record]:
        """Return the motions of one floor in the direction of the support, others as companions; histories by level."""
        motions = self.below(at)
        if at.stand is not None:
            return at.stand.carry(motions)
        if not self.axes:
            return motions
        turned = self.histories is None and at.direction == DIRECTIONS[1]
        return [along_depth(motion) if turned else along_width(motion) for motion in motions]

    def below(self, at: Support) -> list[Record]:
        """Return the motions of the floor itself, as `on` orders them."""
        floor = at.floor
        if self.histories is not None:
            return self.histories.on(at.floor, at.direction)
        if self.building is not None:
            return records_under(self.building.floor_motions(self.arrays, [int(floor)]), self.polarity)
        if not any("floor" in array.dims for array in self.arrays):
            return self.ground
        at_floor = [array.isel(floor=[_floors_of(array).index(floor)]) for array in self.arrays]
        return records_under(at_floor, self.polarity)


def _bare(record: Record) -> Record:
    """Return a motion of a floor with the label of its ground motion, and without the floor."""
    end = f" floor {record.floor}"
    label, reverse_of = record.label.removesuffix(end), record.reverse_of.removesuffix(end)
    return record._replace(label=label, reverse_of=reverse_of, floor="")


def _floors_of(array: xr.DataArray) -> list[str]:
    if "floor" in array.coords:
        return [str(floor) for floor in array["floor"].values]
    return [str(i) for i in range(array.sizes["floor"])]
