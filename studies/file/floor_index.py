"""The index of floor histories of a user's own building model: a line for each history, with its file."""

import math
import re
from collections.abc import Iterator
from pathlib import Path

import xarray as xr

from ...core.doubts import Doubt, first_of, noted, warn
from ...motions.arrays import BEGINS, records
from ...motions.floors.histories import DIRECTIONS, FloorHistories, History
from ...motions.readers.csv import STRUCTURE
from ...motions.readers.read import read_file
from ..plan.size import refuse_samples
from ..text.error import StudyError
from .analyses import LEVEL_UNITS, MOST_LEVEL
from .csv_table import CsvLine, CsvTable, TableKind
from .table import shown

LEVELS = {f"level ({unit})": unit for unit in LEVEL_UNITS if unit != "1"}
"""Columns of the level, with their units."""
LEVEL = "level"
COLUMNS = (*LEVELS, "motion", "floor", "direction", "file", "column")
"""Columns of an index, in any order."""
KIND = TableKind("index of floor histories", (*COLUMNS, LEVEL), 200_000, 64 * 2**20)
MOST_NAMED = 6
"""Most headings that a sentence names."""
_BRACKETS = re.compile(r"\s*[\[(][^\])]*[\])]\s*")


def read_floor_index(path: Path, dt: float | None = None, unit: str | float | None = None) -> FloorHistories:
    """Read floor histories from the files that an index names, with levels in the unit of their column.

    The index is a table in UTF-8, a line for each history in any order, with the columns ``motion``, ``floor`` and
    ``file`` (relative to the index). Further columns are optional. ``level (g)``, or in another unit, is the level at
    which the history is used; without it all are of one earthquake. ``direction`` is x or y; without it there is one.
    ``column`` is the heading of the history's column in a file with several. `dt` (s) and `unit` are of files that
    state none, as for `toppling.motions.read`.
    """
    table = CsvTable(path, KIND)
    for name in ("motion", "floor", "file"):
        if name not in table.columns:
            raise StudyError(f"{table.where}: column {name!r} is missing")
    if LEVEL in table.columns:
        raise StudyError(f"{table.where}: the column 'level' states no unit: name it as 'level (g)'")
    given = [name for name in table.columns if name in LEVELS]
    if len(given) > 1:
        raise StudyError(f"{table.where}: levels stand in one column, got {' and '.join(map(repr, given))}")
    of_level = given[0] if given else ""
    histories = list(_histories(table, of_level, dt, unit))
    if not histories:
        raise StudyError(f"{path}: has a header but no histories")
    try:
        return FloorHistories.of(histories, LEVELS.get(of_level, ""))
    except ValueError as error:
        raise StudyError(f"{path}: {error}") from None


def _histories(table: CsvTable, of_level: str, dt: float | None, unit: str | float | None) -> Iterator[History]:
    files: dict[Path, list[xr.DataArray]] = {}
    levels: dict[tuple[str, ...], float] = {}
    again: dict[str, None] = {}
    samples = 0
    directed = "direction" in table.columns
    for line in table:
        level = line.number_in(of_level, above=0.0, at_most=MOST_LEVEL) if of_level else 1.0
        if level is None:
            line.refuse(of_level, "is empty: it must say at which level the history is used")
        texts = {name: line.text(name) for name in ("motion", "floor", "file")}
        for name, text in texts.items():
            if not text:
                line.refuse(name, "is empty")
        floor = texts["floor"]
        if re.fullmatch(r"[-+]?[\d.,]+", floor):
            if not (floor.isascii() and floor.isdecimal() and len(floor) < 10):
                line.refuse("floor", f"must be a whole number from 0 (ground), or a name, got {shown(floor)}")
            floor = str(int(floor))
        direction = line.text("direction").lower()
        if directed and direction not in DIRECTIONS:
            line.refuse("direction", f"must be x or y, got {shown(line.text('direction'))}")
        file = table.file.parent / texts["file"]
        if levels.setdefault((texts["motion"], floor, direction, texts["file"], line.text("column")), level) != level:
            again[f"line {line.number}: {texts['file']}"] = None
        if file not in files:
            with noted() as doubts:
                files[file] = read_file(file, dt, unit)
            warn(doubt for doubt in doubts if doubt.kind != STRUCTURE)  # (floors are of a structure)
            samples += sum(array.size for array in files[file])
            refuse_samples(samples, "the floor histories")
        chosen = _chosen(line, files[file], texts["file"])
        (record,) = records(chosen)
        sources = [str(chosen[name].values[0]) for name in ("unit_from", "dt_from")]
        begins = float(chosen[BEGINS].values[0]) if BEGINS in chosen.coords else math.nan
        history = History(level, texts["motion"], floor, direction, record.acceleration, record.dt, texts["file"])
        yield history._replace(unit_from=sources[0], dt_from=sources[1], begins=begins)
    if again:
        warn([Doubt.of("floors_again", file=table.file, named=first_of([*again]))])


def _chosen(line: CsvLine, arrays: list[xr.DataArray], file: str) -> xr.DataArray:
    """Return the one history of a file that a line means."""
    histories = [array.isel(motion=[i]) for array in arrays for i in range(array.sizes["motion"])]
    headings = [str(history["component"].values[0]) if "component" in history.coords else "" for history in histories]
    named = ", ".join(filter(None, headings[:MOST_NAMED])) or "none"
    wanted = line.text("column")
    if not wanted:
        if len(histories) > 1:
            line.refuse("file", f"{file} holds {len(histories)} histories ({named}): name one in the column 'column'")
        return histories[0]
    at = [i for i, name in enumerate(headings) if wanted in (name, _BRACKETS.sub(" ", name).strip())]
    if len(at) != 1:
        line.refuse("column", f"must be one of the headings of {file} ({named}), got {shown(wanted)}")
    return histories[at[0]]
