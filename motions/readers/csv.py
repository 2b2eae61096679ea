"""Reader of plain tables: time and accelerations, or acceleration alone with its step given."""

from __future__ import annotations

import os
import re
from array import array

import numpy as np
import xarray as xr

from ... import checks
from .components import Component, arrays_of, single
from .lines import HEADER_WIDTH, MAX_SAMPLES, Lines, RecordError, given_factor, unit_factor

_DT = re.compile(r"\bdt\s{0,9}[=:]\s{0,9}([-+]?(?:\d{1,12}\.?\d*|\.\d+)(?:[eE][-+]?\d{1,3})?)", re.IGNORECASE)
_HEADER_LINES = 100
_COLUMNS = 100


def read_csv(path: str | os.PathLike[str], dt: float | None = None, unit: str | float | None = None) -> xr.DataArray:
    """Read the motions in a plain table with commas, semicolons, tabs or blanks between values.

    Two columns are time (s) and acceleration; one column is acceleration, with `dt` (s) given here or in a header line
    as ``dt = 0.01``.  More columns are time and one acceleration each; the line above the numbers must then name them,
    time first.  Lines before the first number are the header: a unit named there (g, cm/s², gal, m/s²) is used, an
    unknown unit is an error; if the header names no unit, `unit` must be given.

    Raises
    ------
    RecordError
        A file that cannot be read, rows of unequal length, a value that is no number, a time step that is not uniform,
        no dt, a unit stated twice or not at all.
    """
    with Lines(path) as lines:
        return single(lines.file, arrays_of(lines.file, csv_components(lines, dt, unit)))


def csv_components(lines: Lines, dt: float | None, unit: str | float | None) -> list[Component]:
    """Return one component for each column of accelerations."""
    file = lines.file
    header, names, table, columns = _table(lines)
    n = len(table) // max(columns, 1)
    if n < 2:
        raise RecordError(f"{file}: a motion has at least 2 samples, found {n}")
    values = np.frombuffer(table, dtype=np.float64).reshape(n, columns)
    if not np.isfinite(values).all():
        raise RecordError(f"{file}: row {int(np.flatnonzero(~np.isfinite(values).all(axis=1))[0]) + 1} is not finite")
    heading = " ".join(header)
    step = _step(lines, values, heading, dt)
    given = 1.0 if unit is None else given_factor(unit)
    above = " ".join(header[:-1]) if names else heading
    factors = [_stated_factor(file, name) for name in names[1:]] if names else [None]
    common = _stated_factor(file, above)
    found = []
    for column, own in enumerate(factors, start=columns - len(factors)):
        stated = common if own is None else own
        if stated is not None and unit is not None:
            raise RecordError(f"{file}: states its unit, so unit must not be given, got {unit!r:.60}")
        if stated is None and unit is None:
            raise RecordError(
                f"{file}: states no unit of its accelerations: write it into the heading, as 'acceleration (g)', or "
                "give unit (g, gal, cm/s2, m/s2)"
            )
        with np.errstate(over="ignore"):  # infinity is refused later, as beyond any shaking
            acceleration = values[:, column] * (given if stated is None else stated)
        name = names[column] if names else ""
        found.append(Component(acceleration, step, station=file.stem if name else "", component=name))
    return found


def _table(lines: Lines) -> tuple[list[str], list[str], array[float], int]:
    """Return header lines, names of three or more columns, the numbers row by row, and the number of columns."""
    header: list[str] = []
    names: list[str] = []
    table = array("d")
    columns = 0
    for line in lines:
        stripped = line.strip()
        if not stripped:
            continue
        fields = [f for f in re.split(r"[,;\s]+", stripped) if f]
        try:
            if "_" in stripped or not stripped.isascii():
                raise ValueError
            row = [float(f) for f in fields]
        except ValueError:
            if columns:
                raise lines.error(f"holds {stripped[:30]!r}, no numbers") from None
            header.append(stripped[:HEADER_WIDTH])
            if len(header) > _HEADER_LINES:
                raise RecordError(f"{lines.file}: no numbers in its first {_HEADER_LINES} lines: not a table") from None
            continue
        if not columns:
            columns = len(row)
            if columns > 2:
                names = _names(header[-1], columns) if header and columns <= _COLUMNS else []
                if not names:
                    raise lines.error(
                        f"has {columns} columns, allowed are 1 or 2 (time, acceleration), or a heading that names them"
                    )
        if len(row) != columns:
            raise lines.error(f"has {len(row)} columns, the first has {columns}")
        table.extend(row)
        if len(table) > MAX_SAMPLES:
            raise lines.error(f"is beyond {MAX_SAMPLES:,} numbers, no record is")
    return header, names, table, columns


def _names(line: str, columns: int) -> list[str]:
    """Return the columns' names if the first is time and there is one for each column; otherwise an empty list."""
    separator = next((s for s in (";", ",", "\t") if s in line), None)
    found = [name.strip().strip('"') for name in line.lstrip("# ").split(separator)]
    return found if len(found) == columns and re.match(r"t(?:ime)?(?![a-z])", found[0], re.IGNORECASE) else []


def _step(lines: Lines, values: np.ndarray, heading: str, dt: float | None) -> float:
    file = lines.file
    written = _DT.search(heading)
    if values.shape[1] >= 2:
        if dt is not None:
            raise RecordError(f"{file}: has a time column, so dt must not be given, got {dt!r}")
        try:
            return checks.time_step("the record", values[:, 0], None)
        except ValueError as error:
            raise RecordError(f"{file}: {error}") from None
    if dt is not None:
        return checks.number("dt", dt, above=0.0, unit="s")
    if written is None:
        raise RecordError(f"{file}: has no time column, so dt must be given (s)")
    step = float(written.group(1))
    if not 0.0 < step < np.inf:
        raise RecordError(f"{file}: dt in its header must be positive and finite, got {step:g}")
    return step


_COLUMN_UNIT = re.compile(r"[a-z]_([cm]?m_?s-?2|gals?|[a-z]{0,9}g|ms)(?![a-z0-9])", re.IGNORECASE)
_WRITTEN_UNIT = re.compile(r"\b(?:in|units?(?:\s+of|\s+are|\s*[:=])?)\s+(\S+)", re.IGNORECASE)


def _stated_factor(file: os.PathLike[str], heading: str) -> float | None:
    """Return m/s² per unit of the heading, or None without unit; RecordError for another quantity or an unknown unit.

    A unit is written in brackets, (cm/s²), after the column's name, acceleration_g, or in words, in g.
    """
    if re.search(r"(?<![a-z])(?:velocity|displacement|vel|disp)(?![a-z])", heading, re.IGNORECASE):
        raise RecordError(f"{file}: its heading names velocity or displacement, not acceleration: {heading[:60]!r}")
    found = re.findall(r"[\[(]([^\])]*)[\])]", heading)
    found += _COLUMN_UNIT.findall(heading) + _WRITTEN_UNIT.findall(heading)
    factor = None
    for unit in found:
        known = unit_factor(unit)
        if known is not None:
            factor = known
        elif not re.fullmatch(r"\s*(?:s|sec|seconds?)?[,;]?\s*", unit, re.IGNORECASE):
            raise RecordError(
                f"{file}: unknown unit {unit[:40]!r} in its heading, allowed are g, gal, cm/s², m/s² and s"
            )
    return factor
