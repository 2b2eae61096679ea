"""Reader and writer of PEER AT2: a header whose last line has count and step, then accelerations, in g by default."""

from __future__ import annotations

import os
import re
from collections.abc import Sequence

import numpy as np
import xarray as xr

from ...core import checks
from ...core.doubts import Doubt, warn
from ...core.units import STANDARD_GRAVITY
from ...core.wording import system_errors
from ...core.writing import write_bytes
from ..arrays import from_array, records, taken
from .components import refuse_gaps, refuse_stated_peak
from .directions import vertical_of
from .lines import STEP, Lines, RecordError
from .steps import refuse_other_step
from .units import agreed, doubt_factors, quantities, refuse_others, unit_taken, units_in

RARE = 1.0
"""PGA, g, that few records reach."""
_HEADER = re.compile(
    rf"NPTS\s{{0,9}}=\s{{0,9}}(?P<npts>\d{{1,12}})\s{{0,9}},?\s{{0,9}}DT\s{{0,9}}=\s{{0,9}}{STEP}", re.IGNORECASE
)
_OLDER = re.compile(
    rf"(?<!\d)(?P<npts>\d{{1,12}})\s+{STEP.replace('.{0,20}', '')}\s{{1,9}}NPTS\s{{0,9}},\s{{0,9}}DT", re.IGNORECASE
)
_OTHER = re.compile(
    r"(?i)\b(?:velocity|displacement|geschwindigkeit|verschiebung|vitesse|d[ée]placement|veloci(?:dad|t[àa])|spostamento)"
    r"\s*(?:$|[(\[]|(?:time|history|series|trace|record|data|in|units?)\b)"
)


_OTHER_SUFFIXES = {".vt2": "velocity", ".dt2": "displacement"}
"""PEER's names of files that are no AT2."""


def _declared(line: str) -> re.Match[str] | None:
    return _HEADER.search(line) or _OLDER.search(line)


def is_at2(head: Sequence[str]) -> bool:
    """Return True if the line above the numbers declares a count and a step as PEER writes them."""
    last = next((i for i, line in enumerate(head) if _declared(line)), None)
    below = next((line for line in head[last + 1 :] if line.strip()), "") if last is not None else ""
    return last is not None and re.search(r"[,;(]|[a-z]{4}", below, re.IGNORECASE) is None  # (a table has a heading)


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
        ``acceleration`` (motion=1, time), m s-2, labelled with the file's name; attribute ``title`` is the event.

    Raises
    ------
    RecordError
        A file that cannot be read, declares another number of samples than it has, or has a value that is no number.

    References
    ----------
    PEER Strong Motion Database, header and data block as in its AT2 files, https://ngawest2.berkeley.edu.
    """
    with Lines(path) as lines:
        file, head = lines.file, lines.head
        last = next((i for i, line in enumerate(head) if _declared(line)), None)
        if last is None:
            raise RecordError(f"{file}: no 'NPTS= …, DT= …' in its header: not a PEER AT2 file")
        for _ in range(last + 1):
            lines.header("its header")
        match = _declared(head[last])
        assert match is not None
        header = [(number, line) for number, line in enumerate(head[: last + 1], start=1) if line.strip()]
        named = [text for _, text in header if "acceleration" in quantities(text)]
        quantity = next((_OTHER.search(text) for _, text in header if _OTHER.search(text) and text not in named), None)
        if quantity is not None:
            raise RecordError(f"{file}: a {quantities(quantity[0])[0]} record, not acceleration")
        if quantity is None and not named and (kind := _OTHER_SUFFIXES.get(file.suffix.lower())):
            raise RecordError(f"{file}: a {kind} record by its name, not acceleration")
        refuse_others(file, header)
        dt = lines.step(match["number"], match["rest"])
        unit = agreed(file, [unit for number, text in header for unit in units_in(text, number)])
        doubt_factors(file, header)
        declared = int(match["npts"])
        if declared < 2:
            raise RecordError(f"{file}: declares {declared} samples, a motion has at least 2")
        values = lines.numbers()
    if values.size != declared:
        raise RecordError(f"{file}: declares {declared} samples (NPTS) but holds {values.size}: truncated or damaged")
    refuse_other_step(lines, header[:-1], declared, dt, f"its last line {dt:g} s")
    refuse_gaps(file, values)
    try:
        array = from_array(
            values * (STANDARD_GRAVITY if unit is None else unit.factor),
            dt,
            [file.stem],
            source=file.name,
            recorded=True,
        )
    except ValueError as error:
        raise RecordError(f"{file}: {error}") from None
    refuse_stated_peak(file, header, [array.values])
    of_unit = unit_taken(STANDARD_GRAVITY, "AT2 without a unit") if unit is None else unit_taken(unit.factor, unit.line)
    array = taken(array, [of_unit], f"line {last + 1}")
    if upright := vertical_of(text for _, text in header):
        array = array.assign_coords(component=("motion", [upright]))
    if unit is None and RARE < (reached := float(np.abs(values).max())) < 3.0:  # (more is doubted in any file)
        warn([Doubt.of("at2_strong", file=file, reached=reached)])
    return array.assign_attrs(title=" ".join(header[1][1].split()) if len(header) > 1 else "")


def write_at2(motion: xr.DataArray, path: str | os.PathLike[str], title: str = "") -> None:
    """Write one motion as PEER AT2, in g with seven digits.

    Raises
    ------
    ValueError
        Not exactly one motion, or a title of more than one line.
    RecordError
        A file that cannot be written.
    """
    plain = records(motion)
    if len(plain) != 1:
        raise ValueError(f"write_at2 writes exactly one motion, got {len(plain)}")
    if not isinstance(title, str) or len(title.splitlines()) > 1:
        raise ValueError(f"title must be one line, got {checks.shown(title)}")
    record = plain[0]
    values = record.acceleration / STANDARD_GRAVITY
    rows = [values[i : i + 5] for i in range(0, values.size, 5)]
    body = "\n".join("".join(f"{value:15.7E}" for value in row) for row in rows)
    step = np.format_float_positional(record.dt)
    header = (
        f"ACCELERATION RECORD IN PEER AT2 FORMAT\n{title or record.label}\n"
        f"ACCELERATION TIME HISTORY IN UNITS OF G\nNPTS= {values.size:6d}, DT= {step} SEC"
    )
    with system_errors(RecordError, f"{path}: cannot be written"):
        write_bytes(checks.path(path), f"{header}\n{body}\n".encode("ascii", "replace"))
