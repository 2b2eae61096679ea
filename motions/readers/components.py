"""Components of a record file, and their labelled arrays: one array for all components of equal step and length."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from ...core.aliases import Array
from ...core.doubts import Doubt, warn
from ...core.units import described
from ..arrays import BEGINS, from_array, taken
from .lines import RecordError, plain
from .units import PEAK_TOLERANCE, unit_factor


class Component(NamedTuple):
    """One component of a record: acceleration (n,) in m/s², step in s, and data from its file ('' and NaN: not given).

    `magnitude` is from the file, of the type `magnitude_type`; `distance` is from the epicentre, m; `vs30`, m/s.
    `processing` notes changes by the reader. `unit_from` is the unit with its source, `dt_from` the source of the step.
    `begins` is the time of the first sample by the file's clock, s.
    """

    acceleration: Array
    dt: float
    station: str = ""
    component: str = ""
    event: str = ""
    magnitude: float = math.nan
    magnitude_type: str = ""
    distance: float = math.nan
    vs30: float = math.nan
    processing: str = ""
    begins: float = math.nan
    unit_from: str = ""
    dt_from: str = ""

    @property
    def label(self) -> str:
        """Station, component and event, as far as they are known, as one text."""
        words = (self.station, self.component, self.event)
        return " ".join(word for word in map(plain, words) if word)


_PEAK = re.compile(r"[-+]?(?:\d{1,9}(?:\.(?P<decimals>\d{0,9}))?|\.(?P<fraction>\d{1,9}))")


def refuse_other_peak(file: Path, acceleration: Array, stated: str | None, factor: float, channel: str = "") -> None:
    """Raise RecordError if samples (m/s²) do not reach the peak that their header states.

    `stated` is that peak as it is written, of any sign, and `factor` its unit in m/s²; a text without a number is no
    peak.
    """
    number = _PEAK.fullmatch((stated or "").strip())
    if number is None:
        return
    peak = abs(float(number[0]))
    half_a_digit = 0.5 * 10.0 ** -len(number["decimals"] or number["fraction"] or "")
    reached = float(np.abs(acceleration).max())
    if abs(reached - factor * peak) > factor * max(PEAK_TOLERANCE * peak, 1.01 * half_a_digit):
        where = f"{plain(channel)}: " if plain(channel) else ""
        raise RecordError(
            f"{file}: {where}its samples reach {reached:.4g} m/s², its header says {factor * peak:.4g} m/s²: another "
            "unit or scale factor, or damaged"
        )


_STATED = re.compile(
    r"(?i)\b(?:pga|peak(?: ground| floor)?(?: acc\w*| value)?|max\w* acc\w*)\s*(?:[\[(](?P<unit>[^\])]{1,12})[\])])?\s*"
    r"(?:[:=]|is|of)?\s*(?P<number>[-+]?(?:\d+\.?\d*|\.\d+))\s*(?P<after>[^\d\s,;)\]]\S*)?"
)
_NOT_THEIRS = re.compile(
    r"original|scaled(?! to)|raw|uncorrected|before|target|event|hazard|sensor|range|full|limit|bedrock", re.IGNORECASE
)
UNIT_APART, SCALED = 5.0, 1.5
"""Ratios of the samples' peak to the peak that words state, from which it is another unit, and is doubted."""


def refuse_stated_peak(file: Path, header: Iterable[tuple[int, str]], accelerations: Sequence[Array]) -> None:
    """Raise RecordError if a numbered line of words states a peak of another unit; warn of another scale."""
    peaks = [float(np.abs(samples).max()) for samples in accelerations]
    for line, text in header:
        for match in _STATED.finditer(text):
            factor = unit_factor(match["unit"] or (match["after"] or "").rstrip(".:"))
            peak = abs(float(match["number"])) * (factor or 0.0)
            if not peak or _NOT_THEIRS.search(text):
                continue
            apart = min(max(pga / peak, peak / pga) if pga else math.inf for pga in peaks)
            if apart >= UNIT_APART:
                refuse_other_peak(file, accelerations[0], match["number"], factor or 0.0, f"line {line}")
            elif apart > SCALED:
                warn([Doubt.of("stated_peak", file=file, line=line, text=match[0].strip(), reached=peaks[0])])


_DURATION = re.compile(
    r"(?i)\b(?:duration|length|dauer|durée|duración|durata)(?P<unit>_s|\s*[(\[]\s*s(?:ec)?\w*\s*[)\]])?\s*(?:[:=]|is|of)?\s*"
    r"(?P<number>\d+(?:\.\d+)?)(?(unit)|\s*s(?:ec\w*)?)(?![\w%]|\s*[-–/:])"
)
_OF_A_PART = re.compile(
    r"(?i)strong|signif|bracket|effect|rupture|fault|source|window|taper|d_?5|d_?[79]5|5\s?%|original|before|wave|filter|event"
)
LASTS = 0.05, 1.0
"""Difference from a stated duration, as a share of it and in s, from which a step or samples are doubted."""


def doubt_duration(file: Path, header: Iterable[tuple[int, str]], duration: float) -> None:
    """Warn if a numbered line of words states another duration, s, than the samples and their time step have."""
    for line, text in header:
        match = None if _OF_A_PART.search(text) else _DURATION.search(text)
        stated = float(match["number"]) if match else duration
        if match is not None and abs(stated - duration) > max(LASTS[0] * stated, LASTS[1]):
            warn([Doubt.of("stated_duration", file=file, line=line, text=match[0].strip(), duration=duration)])


LONELY = 3.0  # ratio of a value of nines to the next one above which even a single one marks a gap


def refuse_gaps(file: Path, values: Array) -> None:
    """Raise RecordError if the maximum of the written values, of nines alone (999.99), marks gaps."""
    peak = float(np.abs(values).max())
    digits = np.format_float_positional(peak, trim="-").replace(".", "")
    count = int((np.abs(values) == peak).sum())
    alone = float(np.abs(values[np.abs(values) < peak]).max(initial=0.0))
    if peak >= 99.0 and len(digits) > 2 and set(digits) == {"9"} and (count > 1 or peak > LONELY * alone):
        are = "is" if count == 1 else "are"
        raise RecordError(f"{file}: {count:,} of its values {are} {peak:g}, a mark of gaps: fill them, or cut them off")


def without_offset(acceleration: Array) -> tuple[Array, str]:
    """Return raw samples without their mean, which is the zero of the instrument, and the note of that."""
    mean = float(acceleration.mean())
    return acceleration - mean, f"mean of {mean:.4g} m/s² removed on reading"


_TEXTS = {
    "station": "station",
    "component": "component of the record",
    "event": "earthquake",
    "magnitude_type": "type of the magnitude",
}
_VALUES = {
    "magnitude": ("magnitude", "1", "magnitude"),
    "distance": ("epicentral_distance", "m", "epicentral distance"),
    "vs30": ("vs30", "m s-1", "mean shear-wave velocity of the upper 30 m"),
    "begins": (BEGINS, "s", "time of the first sample"),
}


def arrays_of(file: Path, components: Sequence[Component]) -> list[xr.DataArray]:
    """Return the labelled arrays of a file's components, in the file's order, one for each step and length.

    Station, component and event become coordinates on `motion`, as far as the file gives them.
    """
    if not components:
        raise RecordError(f"{file}: holds no acceleration")
    labels = _unique([component.label or file.stem for component in components])
    groups: dict[tuple[float, int], list[int]] = {}
    for i, component in enumerate(components):
        groups.setdefault((component.dt, component.acceleration.size), []).append(i)
    arrays = []
    for (dt, _), members in groups.items():
        chosen = [components[i] for i in members]
        try:
            array = from_array(
                np.stack([part.acceleration for part in chosen]),
                dt,
                [labels[i] for i in members],
                source=file.name,
                recorded=True,
            )
        except ValueError as error:
            raise RecordError(f"{file}: {error}") from None
        notes = dict.fromkeys(part.processing for part in chosen if part.processing)
        if notes:
            array.attrs["processing"] = "; ".join(notes)
        array = taken(array, [part.unit_from for part in chosen], [part.dt_from for part in chosen])
        arrays.append(array.assign_coords(_coordinates(chosen)))
    return arrays


def single(file: Path, arrays: Sequence[xr.DataArray]) -> xr.DataArray:
    """Return the only array of a file; RecordError that names `read_all` if components differ in step or length."""
    if len(arrays) > 1:
        kinds = ", ".join(f"{a.sizes['time']} samples at {float(a['dt'][0]):g} s" for a in arrays[:5])
        raise RecordError(
            f"{file}: its components differ in step or length ({kinds}): read_all gives an array for each"
        )
    return arrays[0]


def _coordinates(components: Sequence[Component]) -> dict[str, Any]:
    coordinates: dict[str, Any] = {}
    for field, long_name in _TEXTS.items():
        texts = [plain(getattr(component, field)) for component in components]
        if any(texts):
            coordinates[field] = ("motion", np.array(texts, dtype=object), described(long_name))
    for field, (name, units, long_name) in _VALUES.items():
        values = np.array([getattr(component, field) for component in components])
        if np.isfinite(values).any():
            coordinates[name] = ("motion", values, described(long_name, units))
    return coordinates


def _unique(labels: Sequence[str]) -> list[str]:
    """Return the labels, with (2), (3) … after labels that the file gives more than once."""
    unique: list[str] = []
    taken: set[str] = set()
    for label in labels:
        name, n = label, 1
        while name in taken:
            n += 1
            name = f"{label} ({n})"
        taken.add(name)
        unique.append(name)
    return unique
