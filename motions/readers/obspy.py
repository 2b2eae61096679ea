"""Reader of the formats of obspy, if it is installed: miniSEED, SAC, Kinemetrics, SEG-Y and more.

obspy's own `read` is not used: it takes a path as a pattern or an address and unpacks archives. It also calls a pickle
reader, which runs code from the file. Here one file is offered to each format, without the unsafe formats.
"""

from __future__ import annotations

import importlib
import re
import warnings
from collections import Counter
from collections.abc import Callable, Sequence
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np

from ...core.doubts import Doubt, first_names, warn
from ...core.limits import OBSPY_BYTES
from .components import Component, without_offset
from .directions import direction_of
from .lines import MAX_SAMPLES, RecordError, beginning, lines_of
from .units import GIVEN, Unit, agreed, given_factor, unit_of, unit_taken

_GROUP = "obspy.plugin.waveform"
# SEED: band, sensor, orientation
_VELOCITY, _NO_MOTION = re.compile(r"[BEHLMSUV][HLP][A-Z\d]"), re.compile(r"[BEHLMSUV][DFIJKMW][A-Z\d]")
# Formats with an own signature come before formats that accept nearly any file.
_FIRST = ("MSEED", "SAC", "SEISAN", "KINEMETRICS_EVT", "REFTEK130", "GCF", "SLIST", "TSPAIR", "SACXY")
# A pickle runs code; CSS tables open the files that they name; a damaged GSE file ends the process in obspy's C code.
_NEVER = ("PICKLE", "CSS", "NNSA_KB_CORE", "GSE1", "GSE2")
_GSE = (b"WID", b"XW01")
MOST_CHANNELS, MOST_SAMPLES = 1_000, 20_000_000
_TEXT = re.compile(r"(?:TIMESERIES|WID[12]|XW01)[ _]")


def is_obspy_text(head: Sequence[str]) -> bool:
    """Return True if text begins as one of obspy's text formats (SLIST, TSPAIR, alphanumeric SAC, GSE)."""
    if not head or _TEXT.match(head[0]) is not None:
        return bool(head)
    # SAC: five header values on a line, and its mark for values that are not set
    return len(head[0].split()) == 5 and any("-12345.0" in line for line in head[:14])


def obspy_components(file: Path, unit: str | float | None) -> list[Component]:
    """Return all traces of a file that obspy reads, m/s²; counts lose their mean, the zero of the instrument.

    The file has at most 128 MiB; `unit` belongs to the samples, or is m/s² per count: of these formats SLIST and TSPAIR
    alone may state a unit.
    """
    if file.stat().st_size > OBSPY_BYTES:
        raise RecordError(f"{file}: larger than {OBSPY_BYTES // 2**20} MiB, cut it with obspy first")
    try:
        importlib.import_module("obspy")
    except ImportError:
        raise RecordError(
            f"{file}: not text (holds NUL bytes) or in a format of obspy's, which is not installed"
        ) from None
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        name, traces = _traces(file)
    pieces = Counter(trace.id for trace in traces)
    if len(pieces) > MOST_CHANNELS:
        raise RecordError(f"{file}: holds {len(pieces):,} channels, allowed are {MOST_CHANNELS:,}: cut it first")
    units: list[Unit] = []
    if any("ascii" in trace.stats for trace in traces):  # (SLIST and TSPAIR, whose headers end in the unit)
        numbered = enumerate(lines_of(file), start=1)
        headers = [(number, line) for number, line in numbered if line.startswith("TIMESERIES")]
        units = [unit_of(line.rpartition(",")[2].strip(), number) for number, line in headers]
    agreed_on = agreed(file, (unit for unit in units if unit.quantity))
    strange = {unit.text for unit in units if not unit.quantity and unit.text}
    if strange and isinstance(unit, str) and all(re.fullmatch("counts?", text, re.IGNORECASE) for text in strange):
        warn([Doubt.of("counts_stated", file=file, unit=unit)])
    elif strange and unit is not None and (isinstance(unit, str) or agreed_on):
        raise RecordError(f"{file}: states an unknown unit ({min(strange)[:40]!r}), so unit must not be {unit!r:.60}")
    if unit is None and agreed_on is not None:
        unit = agreed_on.text
    if unit is None:
        raise RecordError(f"{file}: {name} states no unit, so unit must be given ('m/s2', 'g', or m/s² per count)")
    factor = given_factor(unit)
    if agreed_on is not None and factor != agreed_on.factor:
        raise RecordError(f"{file}: states its unit ({agreed_on.text}), so unit must not be {unit!r:.60}")
    velocity: list[str] = []
    whole = [trace.stats.channel for trace in traces if trace.data.dtype.kind in "iu"]
    if whole and isinstance(unit, str) and agreed_on is None:
        warn([Doubt.of("counts", of=f"{file}: {first_names(whole)}", unit=unit)])
    components: list[Component] = []
    scales = {float(trace.stats.calib) for trace in traces} - {0.0, 1.0}
    if scales:
        warn([Doubt.of("scale_factor", file=file, factor=min(scales))])
    for trace in traces:
        if pieces[trace.id] > 1 or np.ma.isMaskedArray(trace.data):
            raise RecordError(f"{file}: channel {trace.id} is in pieces (a gap), merge or cut it with obspy first")
        # SAC: 6 displacement, 7 velocity, 8 acceleration, 50 volts
        sac = getattr(trace.stats, "sac", {})
        for wrong, what in (
            (sac.get("idep") in {6, 7}, "velocity or displacement, not acceleration"),
            (sac.get("idep") == 50, "of volts, not acceleration"),
            (not sac.get("leven", True), "not evenly sampled (leven): resample it first"),
            (_NO_MOTION.fullmatch(trace.stats.channel), "of no motion, by its code: leave it out"),
        ):
            if wrong:
                raise RecordError(f"{file}: channel {trace.id} is {what}")
        if trace.data.dtype.kind not in "iuf" or not 2 <= trace.data.size <= MAX_SAMPLES:
            raise RecordError(f"{file}: channel {trace.id} has {trace.data.size} samples of {trace.data.dtype}")
        codes = trace.stats
        if _VELOCITY.fullmatch(codes.channel) and agreed_on is None and sac.get("idep") != 8:
            velocity.append(codes.channel)
        # SAC: the inclination of the sensor, 0 and 180 degrees from upwards
        upright = sac.get("cmpinc") in {0.0, 180.0} and direction_of(codes.channel) is None
        acceleration, note = trace.data.astype(np.float64) * factor, ""
        if not isinstance(unit, str):
            acceleration, note = without_offset(acceleration)
        components.append(
            Component(
                acceleration,
                float(codes.delta),
                station=".".join(filter(None, (codes.network, codes.station, codes.location))),
                component=f"UP ({codes.channel})" if upright else codes.channel,
                event=str(codes.starttime)[:19].replace("T", " "),
                processing=note,
                begins=float(codes.starttime.timestamp),
                unit_from=unit_taken(factor, GIVEN if agreed_on is None else agreed_on.line),
                dt_from=f"header of {name}",
            )
        )
    if velocity:
        warn([Doubt.of("seismometer", file=file, named=first_names(velocity))])
    return components


def _traces(file: Path) -> tuple[str, list[Any]]:
    """Return the first format that accepts the file, and its traces; RecordError if there is none or it fails."""
    entries = metadata.entry_points()
    installed = [entry.name for entry in entries.select(group=_GROUP) if entry.name not in _NEVER]

    def function(name: str, what: str) -> Callable[..., Any]:
        loaded: Callable[..., Any] = next(iter(entries.select(group=f"{_GROUP}.{name}", name=what))).load()
        return loaded

    for name in sorted(installed, key=lambda n: (_FIRST.index(n) if n in _FIRST else len(_FIRST), n)):
        try:
            known = function(name, "isFormat")(str(file))
        except Exception:
            continue
        if not known:
            continue
        read = function(name, "readFormat")
        try:
            # (a constant signal of any length takes a few bytes, and a piece takes as long to read as 10,000 samples)
            heads = list(read(str(file), headonly=True)) if name == "MSEED" else []
            samples = sum(trace.stats.npts for trace in heads)
            if samples <= MOST_SAMPLES and len(heads) <= MOST_CHANNELS:
                return name, list(read(str(file)))
        except Exception as error:
            first = " ".join(str(error).split())[:100]
            raise RecordError(f"{file}: looks like {name}, but obspy cannot read it ({first})") from None
        held = f"{len(heads):,} channels or pieces, allowed are {MOST_CHANNELS:,}"
        if samples > MOST_SAMPLES:
            held = f"{samples:,} samples, allowed are {MOST_SAMPLES:,}"
        raise RecordError(f"{file}: holds {held}: cut it first")
    if beginning(file).startswith(_GSE):
        raise RecordError(f"{file}: a GSE file, which obspy reads unsafely: turn it into miniSEED with obspy first")
    binary = "not text (holds NUL bytes), and " if b"\0" in beginning(file) else ""
    raise RecordError(f"{file}: {binary}no format that obspy reads")
