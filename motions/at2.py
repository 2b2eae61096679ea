"""PEER AT2: four header lines (count and step in the fourth), then accelerations in g, several a line."""

from __future__ import annotations

import os
import re
from pathlib import Path

import numpy as np
import xarray as xr

from ..units import STANDARD_GRAVITY
from .arrays import from_array, records
from .files import RecordError, numbers, text_of, unit_factor

_HEADER = re.compile(
    r"NPTS\s*=\s*(?P<npts>\d+)\s*,?\s*DT\s*=\s*(?P<dt>[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)", re.IGNORECASE
)
_HEADER_LINES = 4
_UNITS = re.compile(r"\bUNITS?\b(?:\s+OF|\s+ARE|\s*[:=])?\s*([^\s.,;]+)", re.IGNORECASE)


def is_at2(text: str) -> bool:
    """Whether the fourth line declares a count and a step as PEER writes them."""
    return _HEADER.search("\n".join(text.splitlines()[:_HEADER_LINES])) is not None


def read_at2(path: str | os.PathLike[str]) -> xr.DataArray:
    """The motion in a PEER AT2 file.

    Parameters
    ----------
    path : path
        File with either header in use (``NPTS=  7996, DT= .00500 SEC`` or ``NPTS=   1451, dt=  .02000``).

    Returns
    -------
    xarray.DataArray
        ``acceleration`` (motion=1, time), m s-2, labelled with the file's name; attribute ``title`` holds the event.

    Raises
    ------
    RecordError
        A file that cannot be read, declares another number of samples than it holds, or holds what is no number.
    """
    file, text = text_of(path)
    lines = text.splitlines()
    header = "\n".join(lines[:_HEADER_LINES])
    match = _HEADER.search(header)
    if match is None:
        raise RecordError(f"{file}: no 'NPTS= …, DT= …' in its first {_HEADER_LINES} lines: not a PEER AT2 file")
    if re.search(r"\b(?:VELOCITY|DISPLACEMENT)\b", "\n".join(lines[2:3]), re.IGNORECASE):
        raise RecordError(f"{file}: a velocity or displacement record, not acceleration")
    declared, dt = int(match["npts"]), float(match["dt"])
    if not 0.0 < dt < 10.0:
        raise RecordError(f"{file}: DT must lie between 0 and 10 s, got {dt:g}")
    last = next(i for i, line in enumerate(lines) if "NPTS" in line.upper())
    stated = _UNITS.search(lines[2]) if last > 2 else None  # the title above may hold any word
    factor = unit_factor(stated.group(1)) if stated else STANDARD_GRAVITY
    if factor is None:
        raise RecordError(f"{file}: unknown unit of acceleration in {lines[2].strip()[:60]!r}")
    values = numbers(file, "\n".join(lines[last + 1 :]), last + 2)
    if values.size != declared:
        raise RecordError(f"{file}: declares {declared} samples (NPTS) but holds {values.size}: truncated or damaged")
    if declared < 2:
        raise RecordError(f"{file}: declares {declared} samples, a motion has at least 2")
    array = from_array(values * factor, dt, [file.stem], source=file.name)
    return array.assign_attrs(title=" ".join(lines[1].split()) if last >= 1 else "")


def write_at2(motion: xr.DataArray, path: str | os.PathLike[str], title: str = "") -> None:
    """Write one motion as PEER AT2, in g with seven digits.

    Raises
    ------
    ValueError
        Not exactly one motion, or a title of more than one line.
    RecordError
        A file that cannot be written.
    """
    found = records(motion)
    if len(found) != 1:
        raise ValueError(f"write_at2 writes exactly one motion, got {len(found)}")
    if len(title.splitlines()) > 1:
        raise ValueError(f"title must be one line, got {title!r:.60}")
    record = found[0]
    values = record.acceleration / STANDARD_GRAVITY
    rows = [values[i : i + 5] for i in range(0, values.size, 5)]
    body = "\n".join("".join(f"{value:15.7E}" for value in row) for row in rows)
    step = np.format_float_positional(record.dt)
    header = (
        f"ACCELERATION RECORD IN PEER AT2 FORMAT\n{title or record.label}\n"
        f"ACCELERATION TIME HISTORY IN UNITS OF G\nNPTS= {values.size:6d}, DT= {step} SEC"
    )
    try:
        Path(path).write_text(f"{header}\n{body}\n", encoding="ascii", errors="replace")
    except OSError as error:
        raise RecordError(f"{path}: cannot be written ({error.strerror})") from None
