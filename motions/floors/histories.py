"""Floor histories of a building model of another program: one set of motions for each level of the ground motion.

They are used as they are. A level has a set of motions, and each motion the same floors and directions as all others,
which are simultaneous. This module does not read files.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple, Self

import numpy as np
import xarray as xr

from ...core.aliases import Array
from ..arrays import RECORDED, Record, floor_array, taken
from ..polarity import REVERSED

DIRECTIONS = ("x", "y")
"""Horizontal directions of a building."""
APART = 1e-5
"""Minimum relative distance of two levels."""


class History(NamedTuple):
    """The absolute acceleration (time,), m/s², of one floor in one direction under one motion at one level.

    `direction` is '' if there is only one; `source` names its file, `unit_from` and `dt_from` are as in records.
    `begins` is the time of the first sample by the clock of the file, s.
    """

    level: float
    motion: str
    floor: str
    direction: str
    acceleration: Array
    dt: float
    source: str
    unit_from: str = ""
    dt_from: str = ""
    begins: float = math.nan


@dataclass(frozen=True, eq=False)
class FloorHistories:
    """Floor histories by level, motion, floor and direction; made by `of`.

    `levels` (level,) increase, in `unit` (as given; '' for one earthquake without a level) or in SI (`at`). `texts` are
    the levels as given, `names` the motions of each level, `supports` the floors with their directions. With `elastic`
    one set is scaled to all levels as if the building were elastic. `polarities` is 2 if each motion is followed by its
    reverse (`both_ways`). `axes` is `toppling.motions.arrays.BOTH_AXES` if the two directions act along the width and
    the depth of a piece. It is `WEAK_AXIS` if a piece must be so long that only one counts, and '' for its width alone.
    """

    levels: Array
    unit: str
    texts: tuple[str, ...]
    names: tuple[tuple[str, ...], ...]
    supports: tuple[tuple[str, str], ...]
    histories: dict[tuple[int, str, str, str], History]
    elastic: bool = False
    polarities: int = 1
    axes: str = ""

    @classmethod
    def of(cls, histories: Iterable[History], unit: str = "") -> Self:
        """Make them from histories in any order.

        Each motion has one history, not of zeros, of every floor and direction, of one step and length. Levels are > 0
        and not nearly equal. They have equally many motions, the same or none in common. Anything else is a ValueError.
        """
        every = list(histories)
        if not every:
            raise ValueError("floor histories must hold at least one, got none")
        levels = np.unique([case.level for case in every])
        if levels[0] <= 0.0 or not np.isfinite(levels).all():
            raise ValueError(f"levels must be > 0 and finite, got {levels[0] if levels[0] <= 0.0 else levels[-1]:g}")
        close = np.flatnonzero(np.diff(levels) < APART * levels[1:])
        if close.size:
            near = levels[close[0] : close[0] + 2]
            raise ValueError(f"levels must differ by more than rounding, got {near[0]:.10g} and {near[1]:.10g}")
        of_level = {float(level): i for i, level in enumerate(levels)}
        by_key: dict[tuple[int, str, str, str], History] = {}
        for history in every:
            key = of_level[history.level], history.motion, history.floor, history.direction
            named, place = _named(history, unit), _support((history.floor, history.direction))
            if key in by_key:
                raise ValueError(f"{named} has two histories of {place}")
            if not np.any(history.acceleration):
                raise ValueError(
                    f"{named}: the acceleration of {place} is 0 throughout "
                    f"({history.source}): histories are absolute accelerations, also of the ground"
                )
            by_key[key] = history
        names = tuple(
            tuple(dict.fromkeys(case.motion for case in every if case.level == level)) for level in levels.tolist()
        )
        _refuse_sets(levels, names, unit)
        supports = _ordered(dict.fromkeys((case.floor, case.direction) for case in every))
        first: dict[tuple[int, str], History] = {}
        for (i, motion, floor, direction), record in by_key.items():
            whole = first.setdefault((i, motion), record)
            alike = math.isclose(record.dt, whole.dt, rel_tol=1e-9)  # (a column of times rounds it)
            if not alike or record.acceleration.size != whole.acceleration.size:
                raise ValueError(
                    f"{_named(record, unit)}: its histories must be simultaneous, got {whole.acceleration.size:,} "
                    f"samples at {whole.dt:g} s for {_support((whole.floor, whole.direction))} and "
                    f"{record.acceleration.size:,} at {record.dt:g} s for {_support((floor, direction))}"
                )
        for (i, motion), record in first.items():
            for support in supports:
                if (i, motion, *support) not in by_key:
                    raise ValueError(f"{_named(record, unit)} has no history of {_support(support)}, which others have")
        # (all levels have the motions in one order where they are the same)
        if len({frozenset(name) for name in names}) == 1:
            names = (names[0],) * levels.size
        texts = tuple(f"{level:g} {unit}".strip() for level in levels)
        return cls(levels, unit, texts, names, supports, by_key)

    @property
    def own_motions(self) -> bool:
        """True if each of several levels has motions of its own."""
        return len(self.names) > 1 and self.names[0] != self.names[1]

    @property
    def motions(self) -> int:
        """Number of motions of each level, those run both ways twice."""
        return len(self.names[0])

    @property
    def given(self) -> tuple[tuple[str, ...], ...]:
        """The motions as given of each level (level, motion): a reverse has the name of the motion that it reverses."""
        if self.polarities == 1:
            return self.names
        return tuple(tuple(name for name in row[::2] for _ in (1, -1)) for row in self.names)

    def run_shape(self, levels: int) -> tuple[int, int]:
        """Return the numbers of levels and motions of runs: all histories as motions of one level, or each at all."""
        return (levels, self.motions) if self.elastic else (1, levels * self.motions)

    @property
    def labels(self) -> tuple[str, ...]:
        """Labels of the motions: their names, or numbers if each level has motions of its own."""
        if not self.own_motions:
            return self.names[0]
        ends = ("", REVERSED)[: self.polarities]
        return tuple(f"motion {j}{end}" for j in range(1, self.motions // self.polarities + 1) for end in ends)

    @property
    def floors(self) -> tuple[str, ...]:
        """The floors, from the lowest up if they are numbers."""
        return tuple(dict.fromkeys(floor for floor, _ in self.supports))

    def directions(self, floor: str) -> tuple[str, ...]:
        """Return the directions that a floor has histories in."""
        return tuple(direction for name, direction in self.supports if name == floor)

    def at(self, levels: Array) -> Self:
        """Return the same histories with their levels in SI."""
        return replace(self, levels=np.asarray(levels, dtype=np.float64))

    @property
    def both_ways(self) -> Self:
        """Return the same histories, with each motion followed by its reverse in all floors and directions.

        The reverse of the histories replaces the histories of the reversed ground motion: a building that answers both
        alike.
        """
        reverses = {}
        for (i, motion, floor, direction), history in self.histories.items():
            name = f"{motion}{REVERSED}"
            if (i, name, floor, direction) in self.histories:
                raise ValueError(f"motion {name!r} has the name of the reverse of motion {motion!r}")
            reverses[i, name, floor, direction] = history._replace(motion=name, acceleration=-history.acceleration)
        names = tuple(tuple(f"{name}{end}" for name in row for end in ("", REVERSED)) for row in self.names)
        return replace(self, names=names, histories={**self.histories, **reverses}, polarities=2)

    def on(self, floor: str, direction: str) -> list[Record]:
        """Return the motions of a floor, starting with the first level.

        If both directions act, each has the other one as its companion.
        """
        plain = []
        crosswise = [axis for axis in self.directions(floor) if axis != direction] if self.axes else []
        for i, (names, given) in enumerate(zip(self.names, self.given, strict=True)):
            for name, as_given in zip(names, given, strict=True):
                wave = self.histories[i, name, floor, direction]
                label, of = (f"{self._label(i, motion)} {_support((floor, direction))}" for motion in (name, as_given))
                reverse_of = "" if label == of else of
                plain.append(
                    Record(label, wave.acceleration, wave.dt, wave.source, floor, recorded=True, reverse_of=reverse_of)
                )
                for cross in crosswise:
                    across = self.histories[i, name, floor, cross].acceleration
                    plain[-1] = plain[-1]._replace(companion=across)
        return plain

    @cached_property
    def arrays(self) -> list[xr.DataArray]:
        """All histories as arrays (motion, floor, time), one for each motion and direction."""
        arrays = []
        for i, names in enumerate(self.names):
            for name in names:
                for direction in dict.fromkeys(axis for _, axis in self.supports):
                    floors = [floor for floor, axis in self.supports if axis == direction]
                    histories = [self.histories[i, name, floor, direction] for floor in floors]
                    label = f"{self._label(i, name)}{f' in {direction}' if direction else ''}"
                    source = ", ".join(dict.fromkeys(history.source for history in histories))
                    values = np.stack([record.acceleration for record in histories])[None]
                    array = floor_array(values, histories[0].dt, [label], [source], floors)
                    array = array.assign_coords(recorded=("motion", np.ones(1, dtype=bool), RECORDED))
                    units, steps = [[each.unit_from for each in histories]], [[each.dt_from for each in histories]]
                    arrays.append(taken(array, units, steps) if any(units[0]) else array)
        return arrays

    def _label(self, level: int, name: str) -> str:
        return f"{name} at {self.texts[level]}" if self.levels.size > 1 else name


def _refuse_sets(levels: Array, names: Sequence[Sequence[str]], unit: str) -> None:
    """Raise ValueError unless levels have the same number of motions, and all of them or none in common."""
    for level, listed in zip(levels, names, strict=True):
        if len(listed) != len(names[0]):
            raise ValueError(
                f"levels must have the same number of motions, got {len(names[0])} at {levels[0]:g} {unit} and "
                f"{len(listed)} at {level:g} {unit}"
            )
    sets = [set(name) for name in names]
    several = set().union(*(later & earlier for i, later in enumerate(sets) for earlier in sets[:i]))
    for level, held in zip(levels, sets, strict=True):
        if several and held != several:
            alone = min(held ^ several)
            elsewhere = next(level for level, of in zip(levels, sets, strict=True) if (alone in of) != (alone in held))
            at, not_at = (level, elsewhere) if alone in held else (elsewhere, level)
            raise ValueError(
                f"levels must all have the same motions, or each its own: {min(several)!r} is at several levels, but "
                f"{alone!r} is at {at:g} {unit} and not at {not_at:g} {unit}"
            )


def _ordered(supports: Iterable[tuple[str, str]]) -> tuple[tuple[str, str], ...]:
    """Return floors with directions in the order of the floors, numbers from the lowest up, and of the directions."""
    given = list(supports)
    floors = list(dict.fromkeys(floor for floor, _ in given))
    if all(floor.isdecimal() for floor in floors):
        floors.sort(key=int)
    return tuple(sorted(given, key=lambda support: (floors.index(support[0]), support[1])))


def _named(history: History, unit: str) -> str:
    return f"motion {history.motion!r}{f' at {history.level:g} {unit}' if unit else ''}"


def _support(support: tuple[str, str]) -> str:
    floor, direction = support
    return f"floor {floor}{f' in direction {direction}' if direction else ''}"
