"""Floor histories of other programs, from plain tables or from netCDF files of labelled arrays."""

import os
import re
from pathlib import Path

import numpy as np
import xarray as xr

from ...core import checks
from ...core.limits import open_netcdf
from ..arrays import RECORDED, floor_array, records, taken
from ..readers.lines import HEADER_WIDTH, NETCDF, Lines, RecordError, beginning, existing, is_blank, is_comment
from ..readers.units import RELATIVE, agreed, doubt_factors, refuse_others, unit_factor, unit_of, unit_taken, units_in

_COLUMN = re.compile(r"(?P<motion>.*\S)\s*/\s*(?P<floor>[^\s/\[\]]+)\s*(?:\[(?P<unit>[^\]]*)\])?")
_UPRIGHT = re.compile(r"(?:.*[-_ .])?(?:vert(?:ical|ikal)?e?|u-?d|up-?down)", re.IGNORECASE)
_TIME = re.compile(r"time\s*(?:\[\s*s\s*\])?", re.IGNORECASE)


def read_floors(path: str | os.PathLike[str]) -> xr.DataArray:
    """Read floor histories, m/s², from a file.

    Parameters
    ----------
    path : path
        A CSV file or a netCDF file; the format is detected from the content.

    Returns
    -------
    xarray.DataArray
        ``acceleration`` (motion, floor, time), ready for `toppling.ida` and `toppling.motions.measures`.

    Raises
    ------
    RecordError
        One sentence that names the file and the fault: another layout, or a motion without one of the floors. A time
        step that is not uniform, a value that is no finite number, or an unknown unit.

    Notes
    -----
    CSV: one header line, then one line for each sample, with commas or semicolons between values.  The first column is
    ``time`` (s), every other column ``motion/floor [unit]``, with g, gal, cm/s² or m/s²; every motion has every floor,
    in any order.  Lines before the header that start with # are comments, which must not
    contradict the units of the columns::

        time, El Centro/1 [g], El Centro/roof [g]
        0.00, 0.0012, 0.0020
        0.01, 0.0019, 0.0034

    netCDF: a variable ``acceleration`` (or the only variable) with dims (motion, floor, time), as ``to_netcdf`` writes
    the result of `Building.floor_motions` or of this function.

    Floors that are whole numbers are read as numbers.
    """
    file = existing(path)
    if beginning(file, 8).startswith(NETCDF):
        return _read_netcdf(file)
    with Lines(file) as lines:
        histories = _read_table(lines)
    return histories.assign_coords(recorded=("motion", np.ones(histories.sizes["motion"], dtype=bool), RECORDED))


def _read_netcdf(file: Path) -> xr.DataArray:
    try:
        with open_netcdf(file, lambda problem: RecordError(f"{file}: {problem}")) as stored:
            names = [str(name) for name in stored.data_vars]
            if "acceleration" not in names and len(names) != 1:
                raise RecordError(f"{file}: has no variable 'acceleration', but {', '.join(names) or 'none'}")
            array = stored["acceleration" if "acceleration" in names else names[0]].load()
    except RecordError:
        raise
    except (OSError, RuntimeError, ValueError) as error:
        raise RecordError(f"{file}: cannot be read as netCDF ({error})") from None
    if set(array.dims) != {"motion", "floor", "time"}:
        raise RecordError(f"{file}: must have dims (motion, floor, time), got ({', '.join(map(str, array.dims))})")
    if RELATIVE.search(about := str(array.attrs.get("long_name", ""))):
        raise RecordError(f"{file}: holds {about[:60]!r}: blocks need the total acceleration")
    try:
        records(array)
    except (TypeError, ValueError) as error:
        raise RecordError(f"{file}: {error}") from None
    source = "attribute units" if array.attrs.get("units", array.attrs.get("unit")) else "netCDF without units"
    units = np.full([array.sizes["motion"], array.sizes["floor"]], unit_taken(1.0, source), dtype=object)
    array = taken(array, units, "coordinate dt" if "dt" in array.coords else "coordinate time")
    return array.transpose("motion", "floor", "time").rename("acceleration")


def _read_table(lines: Lines) -> xr.DataArray:
    file = lines.file
    comments: list[tuple[int, str]] = []
    heading = None
    for line in lines:
        if not is_blank(line) and not is_comment(line):
            heading = line
            break
        comments.append((lines.number, line.strip()[:HEADER_WIDTH]))
    if heading is None:
        raise RecordError(f"{file}: has no header line")
    separator = ";" if ";" in heading else ","
    heads = [field.strip() for field in heading.split(separator)]
    if not _TIME.fullmatch(heads[0]) or len(heads) < 2:
        raise RecordError(
            f"{file}: its header must be 'time' and then 'motion/floor' columns, got {heads[0][:30]!r} first"
        )
    refuse_others(file, comments)
    doubt_factors(file, comments)
    above = [unit for number, text in comments for unit in units_in(text, number)]
    columns: dict[tuple[str, str], tuple[int, float]] = {}
    number = lines.number
    for i, head in enumerate(heads[1:], start=1):
        match = _COLUMN.fullmatch(head)
        if match is None:
            raise RecordError(f"{file}: column {i + 1} must be named 'motion/floor', got {head[:40]!r}")
        unit = match.group("unit")
        if unit is None:
            raise RecordError(f"{file}: column {i + 1} states no unit: write it as '{head[:40]} [g]' or '[m/s2]'")
        if any(map(_UPRIGHT.fullmatch, (match["motion"], match["floor"]))):
            raise RecordError(f"{file}: column {i + 1}, {head[:40]!r}, is vertical by its name: leave it out")
        factor = unit_factor(unit)
        if factor is None:
            raise RecordError(f"{file}: unknown unit {unit!r} of column {i + 1}, allowed are g, gal, cm/s² and m/s²")
        agreed(file, [unit_of(unit, lines.number), *above])
        key = match.group("motion"), match.group("floor")
        if key in columns:
            raise RecordError(f"{file}: column {'/'.join(key)!r} stands twice")
        columns[key] = i, factor
    names = list(dict.fromkeys(motion for motion, _ in columns))
    floors = list(dict.fromkeys(floor for _, floor in columns))
    for name in names:
        for floor in floors:
            if (name, floor) not in columns:
                raise RecordError(f"{file}: motion {name!r} has no column for floor {floor!r}, which others have")
    rows = []
    for line in lines:
        if not is_blank(line):
            fields = line.split(separator)
            if len(fields) != len(heads):
                raise lines.error(f"must have {len(heads)} numbers, as the header has columns, got {len(fields)}")
            rows.append([lines.value(field, "a sample") for field in fields])
    if len(rows) < 2:
        raise RecordError(f"{file}: a motion has at least 2 samples, found {len(rows)}")
    table = np.array(rows)
    values = np.empty((len(names), len(floors), len(rows)))
    with np.errstate(over="ignore"):  # infinity is an error below
        for (name, floor), (i, factor) in columns.items():
            values[names.index(name), floors.index(floor)] = table[:, i] * factor
    try:
        dt = checks.time_step("the record", table[:, 0], None)
        checks.acceleration("acceleration", values, ndim=(3,))
    except ValueError as error:
        raise RecordError(f"{file}: {error}") from None
    labels = [int(floor) if floor.isdecimal() else floor for floor in floors]
    whole = all(isinstance(label, int) for label in labels) and len(set(labels)) == len(labels)
    histories = floor_array(values, dt, names, [file.name] * len(names), labels if whole else floors)
    units = [[unit_taken(columns[name, floor][1], number) for floor in floors] for name in names]
    return taken(histories, units, "time column")
