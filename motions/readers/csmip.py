"""Reader of CSMIP volume 2 (CDMG, CGS).

Each channel has 25 text lines, 100 integers and 100 reals, then acceleration, velocity and displacement.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence

from .components import Component, refuse_other_peak
from .directions import place_of_sensor
from .lines import Lines
from .units import unit_factor, unit_taken

_TEXT_LINES = 25
_FIRST = re.compile(r"\s*corrected accelerogram\b", re.IGNORECASE)
_DATA = re.compile(
    r"(?<!\d)(?P<count>\d{1,12})\s{1,9}points of (?P<quantity>accel|veloc|displ)\w{0,12} data equally spaced at\s{1,9}"
    r"(?P<dt>[\d.]{1,12})\s{1,9}sec\.?,?\s{0,9}"
    r"(?:in (?P<unit>\S{1,20}?)\.?(?:\s|$)|\(units:\s{0,9}(?P<older>[^()]{1,20})\))?",
    re.IGNORECASE,
)
_FORMAT = re.compile(r"\((\d{1,2})[feg](\d{1,2})\.\d{1,2}\)", re.IGNORECASE)
_INTEGERS, _REALS = (16, 5), (8, 10)
_OLDER = (8, 10)
_PEAK = re.compile(r"Peak acceleration\s{0,9}=\s{0,9}(?P<peak>[-+.\d]{1,12})\s{1,9}(?P<unit>\S{1,20})\s", re.IGNORECASE)
_HEADER_VALUES = 100


def is_csmip(head: Sequence[str]) -> bool:
    """Return True if the file begins as a corrected accelerogram; GeoNet files, which do so too, are tested first."""
    return bool(head) and _FIRST.match(head[0]) is not None


def csmip_components(lines: Lines) -> list[Component]:
    """Return the acceleration of every channel, m/s²; its velocity and displacement are checked and skipped.

    Shakal, A. F. and Huang, M. J. (1985). Standard tape format for CSMIP strong-motion data tapes. California Division
    of Mines and Geology, report OSMS 85-03.
    """
    components: list[Component] = []
    for line in lines:
        if not line.strip():
            continue
        if _FIRST.match(line[:200]) is None:
            raise lines.error(f"holds {line[:30]!r}, a channel begins 'Corrected accelerogram'")
        components.append(_channel(lines))
    return components


def _channel(lines: Lines) -> Component:
    text = ["", *(lines.header("the end of its text header") for _ in range(_TEXT_LINES - 1))]
    lines.numbers(_HEADER_VALUES, _INTEGERS, "values of the integer header")
    lines.numbers(_HEADER_VALUES, _REALS, "values of the real header")
    acceleration, dt, unit, announced = None, math.nan, "", 0
    for expected in ("accel", "veloc", "displ"):
        line = lines.header(f"its {expected} data")
        match, columns = _DATA.search(line), _FORMAT.search(line)
        if match is None or match["quantity"].lower() != expected:
            raise lines.error(f"holds {line[:40]!r}, must announce data, 'n points of {expected} data equally spaced'")
        if match["older"] is not None:  # files of before 1985 or so give units instead of a number format
            layout = _OLDER
        elif columns is None or int(columns.group(1)) * int(columns.group(2)) == 0:
            raise lines.error(f"announces {expected} data without a number format such as (8f10.6): damaged header")
        else:
            layout = int(columns.group(1)), int(columns.group(2))
        count = lines.count(match["count"], f"points of {expected} data")
        factor = unit_factor(match["unit"] or match["older"] or "") if expected == "accel" else 1.0
        if factor is None:
            stated = match["unit"] or match["older"]
            raise lines.error(f"gives the unit of acceleration as {stated!r}, known are cm/sec2, g and m/s2")
        step = lines.value(match["dt"], "the time step (s)", above=0.0, below=10.0)
        if acceleration is None:
            announced, unit = lines.number, unit_taken(factor, lines.number)
        values = lines.numbers(count, layout, f"{expected} points")
        if acceleration is None:
            acceleration, dt = values * factor, step
    if not lines.header("the mark at the channel's end").lstrip().startswith("/&"):
        raise lines.error("is not the mark at the channel's end, '/&': damaged")
    assert acceleration is not None
    joined = "\n".join(text)
    magnitude = re.search(r"\b(M[LWwSs]?):?\s{0,3}=?\s{0,3}(\d\.\d{1,2})\b", joined)
    number = re.search(r"Station No\.\s{0,9}(\S{1,12})", joined, re.IGNORECASE)
    channel = re.search(
        r"Chan\s{1,9}(\d{1,3}):\s{0,9}(\S.{0,20}?)\s*(?:from)?\s*$", joined, re.MULTILINE | re.IGNORECASE
    )
    place = " ".join(re.findall(r"(?:\bChan\s{1,9}\d{1,3}:|\bLocation:)(.{1,80})", joined, re.IGNORECASE))
    stated = _PEAK.search(joined)
    if stated is not None and (peak_factor := unit_factor(stated["unit"])) is not None:
        refuse_other_peak(lines.file, acceleration, stated["peak"], peak_factor, channel.group(0) if channel else "")
    event = re.search(r"(?:Rcrd|Record) of\s{1,9}(\S.{0,40}?)(?:\s{2,}|$)", joined, re.MULTILINE)
    return Component(
        acceleration,
        dt,
        station=f"CSMIP {number.group(1)}" if number else "",
        component=f"chan {channel.group(1)} {channel.group(2)}{place_of_sensor(place)}" if channel else "",
        event=event.group(1) if event else "",
        magnitude=float(magnitude.group(2)) if magnitude else math.nan,
        magnitude_type=magnitude.group(1) if magnitude else "",
        unit_from=unit,
        dt_from=f"line {announced}",
    )
