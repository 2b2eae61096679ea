"""Reader and writer of PEER AT2: four header lines (count and step in the fourth), then accelerations in g."""

from __future__ import annotations

import os
import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import xarray as xr

from ...units import STANDARD_GRAVITY
from ...writing import write_bytes
from ..arrays import from_array, records
from .lines import Lines, RecordError, unit_factor

_NUMBER = r"[-+]?(?:\d{1,12}\.?\d*|\.\d+)(?:[eE][-+]?\d{1,3})?"
_HEADER = re.compile(
    rf"NPTS\s{{0,9}}=\s{{0,9}}(?P<npts>\d{{1,12}})\s{{0,9}},?\s{{0,9}}DT\s{{0,9}}=\s{{0,9}}(?P<dt>{_NUMBER})"
    rf"|(?<!\d)(?P<first>\d{{1,12}})\s+(?P<second>{_NUMBER})\s{{1,9}}NPTS\s{{0,9}},\s{{0,9}}DT",
    re.IGNORECASE,
)
_HEADER_LINES = 4
_UNITS = re.compile(r"\bUNITS?\b(?:\s+OF|\s+ARE|\s*[:=])?\s*([^\s.,;]+)", re.IGNORECASE)


def is_at2(head: Sequence[str]) -> bool:
    """Return True if one of the first four lines declares a count and a step as PEER writes them."""
    return any(_HEADER.search(line) for line in head[:_HEADER_LINES])


def read_at2(path: str | os.PathLike[str]) -> xr.DataArray:
    """Read the motion in a PEER AT2 file.

    Parameters
    ----------
    path : path
        File with one of the usual headers (``NPTS=  7996, DT= .00500 SEC``, ``NPTS=   1451, dt=  .02000`` or, before
        NGA, ``4000   .0050   NPTS, DT``).

    Returns
    -------
    xarray.DataArray
        ``acceleration`` (motion=1, time), m s-2, labelled with the file's name; attribute ``title`` holds the event.

    Raises
    ------
    RecordError
        A file that cannot be read, declares another number of samples than it holds, or holds a value that is no
        number.

    References
    ----------
    PEER Strong Motion Database, header and data block as in its AT2 files, https://ngawest2.berkeley.edu.
    """
    with Lines(path) as lines:
        file, head = lines.file, lines.head
        last = next((i for i, line in enumerate(head[:_HEADER_LINES]) if _HEADER.search(line)), None)
        if last is None:
            raise RecordError(f"{file}: no 'NPTS= …, DT= …' in its first {_HEADER_LINES} lines: not a PEER AT2 file")
        for _ in range(last + 1):
            lines.header("its header")
        match = _HEADER.search(head[last])
        assert match is not None
        quantity = head[2] if last > 2 else ""  # the title above may hold any word
        if re.search(r"\b(?:VELOCITY|DISPLACEMENT)\b", quantity, re.IGNORECASE):
            raise RecordError(f"{file}: a velocity or displacement record, not acceleration")
        dt = float(match["dt"] or match["second"])
        if not 0.0 < dt < 10.0:
            raise RecordError(f"{file}: DT must lie between 0 and 10 s, got {dt:g}")
        stated = _UNITS.search(quantity)
        factor = unit_factor(stated.group(1)) if stated else STANDARD_GRAVITY
        if factor is None:
            raise RecordError(f"{file}: unknown unit of acceleration in {quantity.strip()[:60]!r}")
        declared = int(match["npts"] or match["first"])
        if declared < 2:
            raise RecordError(f"{file}: declares {declared} samples, a motion has at least 2")
        values = lines.numbers()
    if values.size != declared:
        raise RecordError(f"{file}: declares {declared} samples (NPTS) but holds {values.size}: truncated or damaged")
    try:
        array = from_array(values * factor, dt, [file.stem], source=file.name, recorded=True)
    except ValueError as error:
        raise RecordError(f"{file}: {error}") from None
    return array.assign_attrs(title=" ".join(head[1].split()) if last >= 1 else "")


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
        write_bytes(Path(path), f"{header}\n{body}\n".encode("ascii", "replace"))
    except OSError as error:
        raise RecordError(f"{path}: cannot be written ({error.strerror})") from None
