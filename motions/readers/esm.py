"""Reader of ESM ASCII (Engineering Strong Motion database, ITACA's DYNA header).

A file has 64 lines `KEY: value` (DYNA 1.0: 55), then one value on each line.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from .components import Component, doubt_duration, refuse_other_peak
from .directions import BOREHOLE, place_of
from .lines import Lines, RecordError, clock_time, known
from .units import GAL, unit_factor, unit_taken

_LAST_KEY, _OLDER_LAST_KEY = "USER5", "USER4"  # of DYNA 1.2 and 1.0
_MOST_KEYS = 200
BURIED = 5.0
"""Depth of a sensor, m, below which it is in a borehole."""
_NEEDED = ("SAMPLING_INTERVAL_S", "NDATA", "UNITS", "DATA_TYPE")


def is_esm(head: Sequence[str]) -> bool:
    """Return True if the file begins with the keys of an ESM header."""
    return bool(head) and head[0].startswith("EVENT_NAME:") and any(line.startswith("EVENT_ID:") for line in head)


def esm_components(lines: Lines) -> list[Component]:
    """Return the one component of an ESM file, m/s².

    Luzi, L. et al. (2016). The Engineering Strong-Motion database: a platform to access pan-European accelerometric
    data. Seismological Research Letters 87(4), 987-997; header as in files of format DYNA 1.2, https://esm-db.eu.
    """
    header: dict[str, str] = {}
    where: dict[str, int] = {}
    while _LAST_KEY not in header:
        line = lines.header(f"the header line {_LAST_KEY!r}")
        key, colon, text = line.partition(":")
        if not colon and _OLDER_LAST_KEY in header and not math.isnan(known(line)):
            lines.back(line)
            break
        if not colon:
            raise lines.error(f"holds {line[:30]!r}, the header of an ESM file has 'KEY: value' up to {_LAST_KEY}")
        header[key.strip().upper()] = text.strip()
        where[key.strip().upper()] = lines.number
        if len(header) > _MOST_KEYS or lines.number > _MOST_KEYS:
            raise lines.error(f"is still header: no {_LAST_KEY!r} in {_MOST_KEYS} lines, not an ESM file")
    missing = [key for key in _NEEDED if not header.get(key)]
    if missing:
        raise RecordError(f"{lines.file}: its header gives no {missing[0]}")
    if header["DATA_TYPE"].upper() != "ACCELERATION":
        raise RecordError(f"{lines.file}: holds {header['DATA_TYPE'][:40].lower()!r}, not acceleration")
    factor = unit_factor(header["UNITS"])
    if factor is None:
        raise RecordError(f"{lines.file}: unknown unit of acceleration {header['UNITS'][:40]!r}")
    dt = lines.value(
        header["SAMPLING_INTERVAL_S"], "SAMPLING_INTERVAL_S", above=0.0, below=10.0, at=where["SAMPLING_INTERVAL_S"]
    )
    declared = lines.count(header["NDATA"], "samples (NDATA)", at=where["NDATA"])
    values = lines.numbers()
    if values.size != declared:
        raise RecordError(
            f"{lines.file}: declares {declared} samples (NDATA) but holds {values.size}: truncated or damaged"
        )

    if "DURATION_S" in header:
        stated = where["DURATION_S"], f"DURATION_S: {header['DURATION_S']}"
        doubt_duration(lines.file, [stated], declared * dt)
    acceleration = values * factor
    refuse_other_peak(lines.file, acceleration, header.get("PGA_CM/S^2"), GAL)

    def given(key: str) -> float:
        return known(header.get(key, ""))

    moment, local = given("MAGNITUDE_W"), given("MAGNITUDE_L")
    place = BOREHOLE * (abs(given("SENSOR_DEPTH_M")) > BURIED) or place_of([header.get("STATION_NAME", "")])
    date, time = header.get("EVENT_DATE_YYYYMMDD", ""), header.get("EVENT_TIME_HHMMSS", "")
    when = f"{date[:4]}-{date[4:6]}-{date[6:8]} {time[:2]}:{time[2:4]}:{time[4:6]}" if date and time else ""
    return [
        Component(
            acceleration,
            dt,
            station=".".join(filter(None, (header.get("NETWORK"), header.get("STATION_CODE"), header.get("LOCATION")))),
            component=header.get("STREAM", "") + place,
            event=f"{header.get('EVENT_NAME', '')} {when}",
            magnitude=local if math.isnan(moment) else moment,
            magnitude_type="" if math.isnan(moment) and math.isnan(local) else "ML" if math.isnan(moment) else "Mw",
            distance=given("EPICENTRAL_DISTANCE_KM") * 1e3,
            vs30=given("VS30_M/S"),
            begins=clock_time(header.get("DATE_TIME_FIRST_SAMPLE_YYYYMMDD_HHMMSS", ""), "%Y%m%d_%H%M%S.%f"),
            unit_from=unit_taken(factor, where["UNITS"]),
            dt_from=f"line {where['SAMPLING_INTERVAL_S']}",
        )
    ]
