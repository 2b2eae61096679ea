"""Reader of COSMOS V1 and V2 (format 1.20): text, integer and real headers, then data, each announced by a line."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence

import numpy as np

from ...core.aliases import Array
from .components import Component, refuse_other_peak, without_offset
from .directions import place_of_sensor
from .lines import Lines, RecordError, plain
from .units import quantities, unit_factor, unit_taken

_FIRST = re.compile(r"\(Format v\s?\d.{0,20}?with\s{1,9}(\d{1,3})\s{1,9}text lines\)", re.IGNORECASE)
_RAW = re.compile(r"\s*(?:raw|uncorrected)\b", re.IGNORECASE)
_MAX = re.compile(r"\bMax\s{0,3}=\s{0,9}(?P<peak>[-+.\d]{1,12})\s{1,9}(?P<unit>\S{1,12})\s{1,9}at\b")
_INTEGERS = re.compile(
    r"(?<!\d)(\d{1,6})\s+Integer-header values follow on\s+\d{1,6}\s+lines,\s*Format\s*=", re.IGNORECASE
)
_REALS = re.compile(r"(?<!\d)(\d{1,6})\s+Real-header values follow on\s+\d{1,6}\s+lines,\s*Format\s*=", re.IGNORECASE)
_COMMENTS = re.compile(r"(?<!\d)(\d{1,4})\s+Comment line\(?s?\)? follow", re.IGNORECASE)
_DATA = re.compile(
    r"(?i)(?<!\d)(?P<count>\d{1,12})\s{1,20}(?:raw\s{1,9})?(?P<quantity>[a-z]{3,20})\.?\s{1,9}(?:pts|points?),?\s{0,9}approx\s{0,9}(?P<seconds>[\d.]{1,12})"
    r"\s{1,9}secs?,\s{0,9}units\s{0,3}=\s{0,3}(?P<unit>[^,(]{1,20})(?:\(\s{0,3}\d{1,3}\s{0,3}\))?\s{0,3},?\s{0,3}Format"
)
# Fortran formats: (8F10.5), (1P8E15.6), (8(1X,F9.5)). A scale factor does not change a number with an exponent.
_FORMAT = re.compile(
    r"Format\s{0,3}=\s{0,3}\(\s{0,3}(?:-?\d{1,2}P\s{0,3},?\s{0,3}(?=\d{0,3}\s{0,3}E))?(?P<count>\d{0,3})\s{0,3}"
    r"(?:\(\s{0,3}(?P<blanks>\d{1,2})X\s{0,3},\s{0,3})?[IFEG](?P<width>\d{1,3})",
    re.IGNORECASE,
)
_END = re.compile(r"\s*(?:/&|End-of-data)", re.IGNORECASE)
# Positions (from 1) of the standard's real header.
_MAGNITUDES = {"Mw": 13, "Ms": 14, "ML": 15, "M": 16}
_DISTANCE_KM, _STEP_MS = 17, 62
_UNKNOWN = -999.0


def is_cosmos(head: Sequence[str]) -> bool:
    """Return True if the first line states a COSMOS format version."""
    return bool(head) and _FIRST.search(head[0]) is not None


def cosmos_components(lines: Lines) -> list[Component]:
    """Return all accelerations of a COSMOS file, m/s²; velocity and displacement blocks are checked and skipped.

    Uncorrected accelerations (volume 1) lose their mean, the zero of the instrument. Consortium of Organizations for
    Strong-Motion Observation Systems (2001). COSMOS strong motion data format, version 1.20,
    https://www.strongmotioncenter.org/vdc/cosmos_format_1_20.pdf.
    """
    components: list[Component] = []
    for line in lines:
        if not line.strip():
            continue
        match = _FIRST.search(line[:200])
        if match is None:
            raise lines.error(f"holds {line[:30]!r}, a COSMOS channel begins '… (Format v01.20 with 13 text lines)'")
        begun = plain(line, 30)
        channel = _channel(lines, int(match.group(1)), raw=_RAW.match(line[:200]) is not None)
        if channel and quantities(begun) and "acceleration" not in quantities(begun):
            raise RecordError(f"{lines.file}: a channel begins {begun!r}, but its data say acceleration: correct one")
        components += channel
    return components


def _channel(lines: Lines, text_lines: int, raw: bool) -> list[Component]:
    text = ["", *(lines.header("the end of its text header") for _ in range(text_lines - 1))]
    _announced(lines, _INTEGERS, "integer header")
    real = _announced(lines, _REALS, "real header")
    dt = 1e-3 * lines.value(repr(_at(real, _STEP_MS)), "the time step (real header 62, ms)", above=0.0, below=1e4)
    unknown = _announced_unknown(text)
    comments = _match(lines, _COMMENTS, "an announcement of comment lines")
    text += [lines.header("the end of its comments") for _ in range(int(comments.group(1)))]
    types = {name: _at(real, place) for name, place in _MAGNITUDES.items()}
    kind = next((name for name, value in types.items() if not math.isnan(value)), "")
    components: list[Component] = []
    line = lines.header("its data")
    while not _END.match(line):
        match = _DATA.search(line)
        columns = _columns(lines, line)
        if match is None:
            raise lines.error(f"holds {line[:40]!r}, must announce data, '7000 acceleration pts, approx 70 secs, …'")
        quantity, announced = match["quantity"].lower(), lines.number
        count = lines.count(match["count"], f"{quantity} points")
        seconds = lines.value(match["seconds"], "the length (s)")
        factor = unit_factor(match["unit"]) if quantity.startswith("accel") else 1.0
        if factor is None:
            raise lines.error(f"gives the unit of acceleration as {match['unit'].strip()!r}: counts or an unknown unit")
        if abs(count * dt - seconds) > 1.5 + 0.01 * seconds:
            raise lines.error(f"declares {count} points in {seconds:g} s, but the time step is {dt:g} s")
        values = lines.numbers(count, columns, f"{quantity} points")
        if (values == unknown).any():
            where = int(np.flatnonzero(values == unknown)[0])
            raise RecordError(f"{lines.file}: sample {where + 1} is {unknown:g}, the file's mark for an unknown value")
        if quantity.startswith("accel"):
            acceleration, note = values * factor, ""
            if raw:
                acceleration, note = without_offset(acceleration)
            stated = next((m for m in map(_MAX.search, text) if m), None)
            if stated is not None and (peak_factor := unit_factor(stated["unit"])) is not None:
                refuse_other_peak(lines.file, acceleration, stated["peak"], peak_factor)
            components.append(
                Component(
                    acceleration,
                    dt,
                    station=_search(r"\bCode:\s{0,9}(\S{1,20})", text),
                    component=(
                        _search(r"<SCNL>[^.\s]{1,9}\.([^.\s]{1,9})\.", text)
                        or _search(r"Sta Chan?:?\s{0,9}(\S.{0,30}?)\s{0,9}\(", text)
                    )
                    + place_of_sensor(_search(r"\bLocation:(.{1,60})", text)),
                    event=re.sub(r"^\s*(?:Rcrd|Record) of\s+", "", text[1] if len(text) > 1 else ""),
                    magnitude=types.get(kind, math.nan),
                    magnitude_type=kind,
                    distance=_at(real, _DISTANCE_KM) * 1e3,
                    processing=note,
                    unit_from=unit_taken(factor, announced),
                    dt_from=f"real header {_STEP_MS}",
                )
            )
        line = lines.header("the mark at the channel's end")
    return components


def _match(lines: Lines, pattern: re.Pattern[str], what: str) -> re.Match[str]:
    line = lines.header(what)
    match = pattern.search(line)
    if match is None:
        raise lines.error(f"holds {line[:40]!r}, must be {what}")
    return match


def _announced(lines: Lines, pattern: re.Pattern[str], what: str) -> Array:
    """Return the values of a header, in the columns that its announcement gives."""
    match = _match(lines, pattern, f"the announcement of its {what}")
    count = lines.count(match.group(1), f"values of the {what}")
    return lines.numbers(count, _columns(lines, match.string), f"values of the {what}")


def _columns(lines: Lines, line: str) -> tuple[int, int]:
    match = _FORMAT.search(line)
    if match is None or int(match["width"]) == 0:
        raise lines.error("states no number format such as (8F10.5)")
    return int(match["count"] or 1) or 1, int(match["blanks"] or 0) + int(match["width"])


def _announced_unknown(text: Sequence[str]) -> float:
    """Return the mark of an unknown value: given in the last text line, -999 in almost every file."""
    announcements = [line for line in text if "unknown" in line.lower()]
    match = re.search(r"(-?\d{1,9}(?:\.\d{0,9})?)\s{0,9}$", announcements[-1]) if announcements else None
    return float(match.group(1)) if match else _UNKNOWN


def _at(real: Array, place: int) -> float:
    value = float(real[place - 1]) if place <= real.size else _UNKNOWN
    return math.nan if value == _UNKNOWN else value


def _search(pattern: str, text: Sequence[str]) -> str:
    match = next((m for m in (re.search(pattern, line) for line in text) if m), None)
    return match.group(1) if match else ""
