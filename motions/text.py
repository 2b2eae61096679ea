"""Plain CSV: time and acceleration, or acceleration alone with its step given."""

from __future__ import annotations

import os
import re
from pathlib import Path

import numpy as np
import xarray as xr

from .. import checks
from .arrays import from_array
from .files import RecordError, text_of, unit_factor

_DT = re.compile(r"\bdt\s*[=:]\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)", re.IGNORECASE)


def read_csv(path: str | os.PathLike[str], dt: float | None = None) -> xr.DataArray:
    """The motion in a plain table separated by commas, semicolons, tabs or blanks.

    Two columns are time (s) and acceleration, one column is acceleration with `dt` (s) given here or in a header line
    as ``dt = 0.01``.  Lines before the first number are the header: a unit named there (g, cm/s², gal, m/s²) is
    honoured, one that is not known is refused; without one the unit is m/s².

    Raises
    ------
    RecordError
        A file that cannot be read, rows of unequal length, what is no number, a time step that is not uniform, no dt.
    """
    file, text = text_of(path)
    header: list[str] = []
    rows: list[list[float]] = []
    for number, line in enumerate(text.splitlines(), start=1):
        stripped = line.strip()
        if not stripped:
            continue
        fields = [f for f in re.split(r"[,;\s]+", stripped) if f]
        try:
            row = [float(f) for f in fields]
        except ValueError:
            if not rows:
                header.append(stripped)
                if len(header) > 100:
                    raise RecordError(f"{file}: no numbers in its first 100 lines: not a table") from None
                continue
            raise RecordError(f"{file}: line {number} holds {stripped[:30]!r}, no numbers") from None
        if rows and len(row) != len(rows[0]):
            raise RecordError(f"{file}: line {number} has {len(row)} columns, the first has {len(rows[0])}")
        if len(row) > 2:
            raise RecordError(f"{file}: line {number} has {len(row)} columns, allowed are 1 or 2 (time, acceleration)")
        rows.append(row)
    if len(rows) < 2:
        raise RecordError(f"{file}: a motion has at least 2 samples, found {len(rows)}")
    table = np.array(rows)
    if not np.isfinite(table).all():
        raise RecordError(f"{file}: row {int(np.flatnonzero(~np.isfinite(table).all(axis=1))[0]) + 1} is not finite")
    heading = " ".join(header)
    factor = _acceleration_factor(file, heading)
    written = _DT.search(heading)
    if table.shape[1] == 2:
        if dt is not None:
            raise RecordError(f"{file}: has a time column, so dt must not be given, got {dt!r}")
        try:
            step = checks.time_step("the record", table[:, 0], None)
        except ValueError as error:
            raise RecordError(f"{file}: {error}") from None
    elif dt is not None:
        step = checks.number("dt", dt, above=0.0, unit="s")
    elif written is not None:
        step = float(written.group(1))
        if not 0.0 < step < np.inf:
            raise RecordError(f"{file}: dt in its header must be positive and finite, got {step:g}")
    else:
        raise RecordError(f"{file}: has no time column, so dt must be given (s)")
    values = table[:, -1] * factor
    return from_array(values, step, [file.stem], source=file.name)


_COLUMN_UNIT = re.compile(r"[a-z]_(c?m_?s-?2|gals?|[a-z]*g|ms)(?![a-z0-9])", re.IGNORECASE)
_WRITTEN_UNIT = re.compile(r"\b(?:in|units?(?:\s+of|\s+are|\s*[:=])?)\s+(\S+)", re.IGNORECASE)


def _acceleration_factor(file: Path, heading: str) -> float:
    """m/s² per unit of the heading (1 where it names none); RecordError for another quantity or an unknown unit.

    A unit stands in brackets, (cm/s²), after the column's name, acceleration_g, or in words, in g.
    """
    if re.search(r"(?<![a-z])(?:velocity|displacement|vel|disp)(?![a-z])", heading, re.IGNORECASE):
        raise RecordError(f"{file}: its heading names velocity or displacement, not acceleration: {heading[:60]!r}")
    found = re.findall(r"[\[(]([^\])]*)[\])]", heading)
    found += _COLUMN_UNIT.findall(heading) + _WRITTEN_UNIT.findall(heading)
    factor = 1.0
    for unit in found:
        known = unit_factor(unit)
        if known is not None:
            factor = known
        elif not re.fullmatch(r"\s*(?:s|sec|seconds?)?[,;]?\s*", unit, re.IGNORECASE):
            raise RecordError(f"{file}: unknown unit {unit!r} in its heading, allowed are g, gal, cm/s², m/s² and s")
    return factor
