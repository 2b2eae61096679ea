"""Reader of GeoNet V2A (GNS Science, New Zealand).

Each component has 16 text lines, 40 integers and 60 reals, then acceleration, velocity and displacement.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence

from .components import Component, refuse_other_peak
from .lines import Lines, RecordError
from .units import unit_factor, unit_taken

_TEXT_LINES = 16
_INTEGERS, _REALS = (10, 8), (10, 8)
# Positions (from 1) in the integer and real headers.
_DISTANCE_KM, _COUNTS = 30, (34, 35, 36)
_MAGNITUDE, _STEP = 15, 26
_PEAK = re.compile(r"Acceleration:\s{0,9}peak\s{0,9}(?P<peak>\S{1,12})\s{1,9}(?P<unit>\S{1,12})\s", re.IGNORECASE)


def is_geonet(head: Sequence[str]) -> bool:
    """Return True if the file begins as an accelerogram with a site line, as GNS Science writes them."""
    return (
        len(head) > 1 and re.match(r"\s*(?:un)?corrected accelerogram", head[0], re.IGNORECASE) is not None
    ) and re.match(r"\s*Site\s", head[1]) is not None


def geonet_components(lines: Lines) -> list[Component]:
    """Return the acceleration of every component, m/s²; its velocity and displacement are checked and skipped.

    Uncorrected accelerograms (V1A) raise RecordError. GeoNet, "Strong motion file formats",
    https://www.geonet.org.nz/data/supplementary/strong_motion_file_formats.
    """
    components: list[Component] = []
    for line in lines:
        if not line.strip():
            continue
        if re.match(r"\s*uncorrected", line[:200], re.IGNORECASE):
            raise RecordError(f"{lines.file}: an uncorrected accelerogram (V1A): take the corrected file, V2A")
        if not re.match(r"\s*corrected accelerogram", line[:200], re.IGNORECASE):
            raise lines.error(f"holds {line[:30]!r}, a component begins 'Corrected accelerogram'")
        components.append(_component(lines))
    return components


def _component(lines: Lines) -> Component:
    text = ["", *(lines.header("the end of its text header") for _ in range(_TEXT_LINES - 1))]
    stated = next((m for m in map(_PEAK.search, text) if m), None)
    unit = stated["unit"] if stated else None
    factor = unit_factor(unit) if unit else None
    if stated is None or factor is None:
        raise lines.error(f"ends a text header that gives the unit of acceleration as {unit!r}, the format has mm/s/s")
    at = lines.number - len(text) + text.index(stated.string) + 1
    integers = lines.numbers(40, _INTEGERS, "values of the integer header")
    reals = lines.numbers(60, _REALS, "values of the real header")
    dt = lines.value(repr(float(reals[_STEP - 1])), "the time step (real header 26, s)", above=0.0, below=10.0)
    counts = [int(integers[place - 1]) for place in _COUNTS]
    count = lines.count(str(counts[0]), "acceleration samples")
    acceleration = lines.numbers(count, (10, 8), "acceleration samples") * factor
    axis = next((m for m in (re.match(r"\s*Component\s{1,9}(\S{1,12})", line) for line in text) if m), None)
    refuse_other_peak(lines.file, acceleration, stated["peak"], factor, axis.group(1) if axis else "")
    for what, n in zip(("velocity samples", "displacement samples"), counts[1:], strict=True):
        if n != 0:
            lines.numbers(lines.count(str(n), what), (10, 8), what)
    site = re.match(r"\s*Site\s{1,9}(\S{1,12})", text[1])
    magnitude = float(reals[_MAGNITUDE - 1])
    return Component(
        acceleration,
        dt,
        station=site.group(1) if site else "",
        component=axis.group(1) if axis else "",
        event=text[7],
        magnitude=magnitude if magnitude > 0.0 else math.nan,
        magnitude_type="M" if magnitude > 0.0 else "",
        distance=1e3 * float(integers[_DISTANCE_KM - 1]),
        unit_from=unit_taken(factor, at),
        dt_from=f"real header {_STEP}",
    )
