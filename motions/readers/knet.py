"""Reader of K-NET and KiK-net ASCII (NIED, Japan): 17 header lines, then counts that a scale factor turns into gal."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence

from .components import Component, refuse_other_peak, without_offset
from .directions import BOREHOLE
from .lines import Lines, clock_time, known
from .units import GAL, unit_factor, unit_taken

# The lines of the header in their order, each by its first words.
_HEADER = (
    "Origin Time",
    "Lat.",
    "Long.",
    "Depth",
    "Mag.",
    "Station Code",
    "Station Lat.",
    "Station Lon",
    "Station Height",
    "Record Time",
    "Sampling Freq",
    "Duration Time",
    "Dir.",
    "Scale Factor",
    "Max",
    "Last Correction",
    "Memo",
)
_VALUE_COLUMN = 18
_SCALE = re.compile(r"(?P<numerator>[\d.eE+]{1,20})\s?\((?P<unit>[^()]{1,20})\)\s?/\s?(?P<denominator>[\d.eE+]{1,20})$")
# KiK-net numbers its channels: the sensor in the borehole, then the one at the surface.
_DIRECTIONS = {
    "1": "N-S borehole",
    "2": "E-W borehole",
    "3": "U-D borehole",
    "4": "N-S surface",
    "5": "E-W surface",
    "6": "U-D surface",
}


def is_knet(head: Sequence[str]) -> bool:
    """Return True if the file begins with an origin time and a latitude, as NIED writes them."""
    return len(head) > 1 and head[0].startswith("Origin Time") and head[1].startswith("Lat")


def knet_components(lines: Lines) -> list[Component]:
    """Return the one component of a K-NET or KiK-net file, m/s², without the offset of its raw samples.

    The mean of the samples is the instrument's zero, and the header's peak is without it. The recording start in the
    header is 15 s after the first sample; no time is taken from it. NIED, "About K-NET ASCII format",
    https://www.kyoshin.bosai.go.jp/kyoshin/man/knetform_en.html.
    """
    header: dict[str, str] = {}
    factor = dt = duration = unit = math.nan
    for name in _HEADER:
        line = lines.header(f"the header line {name!r}")
        if not line.startswith(name):
            raise lines.error(f"begins {line[:20]!r}, the K-NET format has {name!r} there")
        text = header[name] = line[_VALUE_COLUMN:].strip()
        if name == "Sampling Freq":
            dt = 1.0 / lines.value(text.removesuffix("Hz"), "the sampling frequency (Hz)", above=0.1, below=1e5)
        elif name == "Duration Time":
            duration = lines.value(text, "the duration (s)", above=0.0, below=1e6)
        elif name == "Scale Factor":
            match = _SCALE.match(text)
            unit = (unit_factor(match["unit"]) if match else None) or math.nan
            if match is None or math.isnan(unit):
                raise lines.error(f"gives the scale factor as {text[:40]!r}, must be like '3920(gal)/6182761'")
            counts = lines.value(match["denominator"], "the scale factor's counts", above=0.0)
            factor = unit * lines.value(match["numerator"], "the scale factor", above=0.0) / counts
    declared = lines.count(str(round(duration / dt)), "samples")
    values = lines.numbers()
    if values.size != declared:
        raise lines.error(
            f"ends {values.size} samples, its sampling frequency and duration declare {declared}: truncated or damaged"
        )
    acceleration, note = without_offset(values * factor)
    refuse_other_peak(lines.file, acceleration, header["Max"], GAL)
    magnitude = header["Mag."]
    direction = _DIRECTIONS.get(header["Dir."], header["Dir."])
    if lines.file.suffix[3:] == "1" and not direction.endswith(BOREHOLE):  # (of the names NS1, EW1, UD1)
        direction += BOREHOLE
    return [
        Component(
            acceleration,
            dt,
            station=header["Station Code"],
            component=direction,
            event=header["Origin Time"].replace("/", "-"),
            magnitude=known(magnitude),
            magnitude_type="M" if magnitude else "",
            processing=note,
            begins=clock_time(header["Record Time"], "%Y/%m/%d %H:%M:%S"),
            unit_from=unit_taken(unit, 1 + _HEADER.index("Scale Factor")),
            dt_from=f"line {1 + _HEADER.index('Sampling Freq')}",
        )
    ]
