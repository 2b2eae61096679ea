"""Reader of plain tables: time and accelerations, or acceleration alone with its step given."""

from __future__ import annotations

import csv
import itertools
import math
import os
import re
from array import array
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import xarray as xr

from ...core import checks
from ...core.aliases import Array
from ...core.doubts import Doubt, first_names, warn
from ...core.parameters import STEP
from .components import Component, arrays_of, doubt_duration, refuse_gaps, refuse_stated_peak, single
from .directions import channel_of, channels_of, direction_of, place_of, vertical_of
from .lines import (
    DECIMALS,
    FEW,
    HEADER_WIDTH,
    LONGEST_STEP,
    MAX_SAMPLES,
    Lines,
    RecordError,
    as_key,
    cells_of,
    folded,
    is_blank,
    is_comment,
    known,
)
from .steps import refuse_other_step, written_step
from .units import (
    COUNTED,
    GIVEN,
    OF_WAVES,
    RELATIVE,
    agreed,
    doubt_factors,
    given_factor,
    in_name,
    is_unit,
    quantities,
    refuse_others,
    unit_of,
    unit_taken,
    units_in,
)

_COUNT = re.compile(
    r"(?i)\b(?:npts|(?:number|no\.) of (?:data|points|samples)|n[uú]m(?:ero|\.)(?: total)? d[ei] (?:muestras|datos|"
    r"puntos|campioni|dati|punti|amostras)|nombre d(?:e points|e donn[ée]es|['’][ée]chantillons)|"
    r"anzahl (?:der )?\w*(?:werte|punkte)|(?:veri|[öo]rnek) say[ıi]s[ıi])\s*[=:]?\s*(\d{1,9})\b"
    r"|^\W*(?:data ?)?(?:points|samples)\s*[=:]\s*(\d{1,9})(?=\s*(?:$|[,;]))"
    r"|^\W*(\d{2,9}) (?:data |acceleration )?(?:points|samples)(?=\W*(?:$|[,;]| at\b))"
)
_SEQUENCE = re.compile(r"#?\s*data ?sequence\s*:\s*(?P<names>.+)", re.IGNORECASE)
_TIME = re.compile(
    r"(?:(?:elapsed|record|sample|relative) )?t(?:ime(?:stamp)?|empo|emps|iempo|imp)?(?![a-z])|(?:lauf)?zeit(?![a-z])"
    r"|epoch?(?![a-z])|(?:seconds?[ _]?)?elapsed|zaman|süre|χρ[όο]νος|czas|čas|aika(?![a-z])|زمان"
    r"|время|[时時][间間刻]|[^,;]+[\[(]\s*m?s(?:ec)?\s*[\])]\s*$",
    re.IGNORECASE,
)
_LAST_UNIT = re.compile(
    r"[\[(/,_\s](?P<unit>[mµμun]?s(?:ec)?|sn|(?:milli)?seconds?|min(?:utes?)?|h(?:ours?)?|мс|с|сек|мин|秒|ミリ秒|毫秒|分)[\s)\]]*$",
    re.IGNORECASE,
)
_SECONDS = {
    **dict.fromkeys(("s", "sec", "second", "seconds", "sn", "с", "сек", "秒"), 1.0),
    **dict.fromkeys(("ms", "msec", "millisecond", "milliseconds", "мс", "ミリ秒", "毫秒"), 1e-3),
    **dict.fromkeys(("us", "µs", "μs"), 1e-6),
    "ns": 1e-9,
}
"""Seconds of each unit of time that a column may have."""
_MILLISECONDS = re.compile(
    r"^\W*(?:units?\s*[:=]\s*)?(?:times?\b(?!.{0,9}\b(?:step|interval))[^,;\d]{0,20}?(?:\bin\s+|[\[(:=]\s*|\s))?(?:ms|msecs?|milli-?seconds?)\b"
    r"[\s)\].]*(?:$|[,;])",
    re.IGNORECASE,
)
"""A line above a column of times that states their unit."""
_INDEX = re.compile(r"(?:index|sample|point|row|n(?:o|r)?|i|#)?\.?", re.IGNORECASE)
"""Names of a column that counts the samples, before the column of their times."""
_ELAPSED = re.compile(r"(?:seconds?|time)?[ _]?elapsed|(?:relative|rel\.?) time|time since", re.IGNORECASE)
"""Names of times since the first sample, after a column of times of a clock."""
_CLOCKS = {1e12: 1e-3, 1e15: 1e-6, 1e18: 1e-9}
"""Seconds per unit of times since 1970 from 2001 on, by the first of them."""
_SPECTRUM = re.compile(r"(?:natural |eigen)?(?:p[ée]r[ií]od|fr[ée]q|frecuencia|schwingungsdauer)", re.IGNORECASE)
_ORDINATE = re.compile(r"p?s[adev]\b|(?:pseudo\W?)?spectral|(?:rotd|gmrot)\w*\d", re.IGNORECASE)
_COMMAS = re.compile(r"(?:^|\s)[-+]?\d+(?:,\d+)?\s+[-+]?\d+(?:,\d+)?(?:e[-+]?\d+)?(?:\s|$)", re.IGNORECASE)
_CLOCK = re.compile(
    r'"?(?:(?:\d{4}[-/.]\d\d?[-/.]\d\d?|\d\d?[-/.]\d\d?[-/.]\d{4})[T ,;]+)?\d{1,2}:\d\d:\d\d[^\s,;]*[\s,;]+[-+.\d"]',
    re.IGNORECASE,
)
_MARK = re.compile(r"[-–—*.?#]+|#?n[./]?[adv]\.?|null|none|nil|missing|[-+.\d]+(?:e[-+]?\d+)?", re.IGNORECASE)
"""A cell of a row of numbers that may have a mark in place of one."""
_NO_POINTS = re.compile(r"[-+]?\d+,(?:0\d+|\d{5,})(?:,[-+]?\d+,\d+)*")
"""A line of numbers with decimal commas, between commas."""

_RESULTANT = re.compile(
    r"(?i)resultant|magnitude|mean\b|average|avg\b|geo\w*.?mean|rotd|vector.?sum|\bnorm\b|\bsrss\b|"
    r"(?:a_?(?:cc)?_?)?(?:absolute|total|tot|res|abs|mag)\b|at\b|tgf\b"
)
_STAGES = re.compile(
    r"(?i)raw\b|measured|original|matched|as recorded|"
    r"(?:un)?filtered|(?:un)?corrected|detrended|denoised|baseline|error|noise|residual|command|feedback|target|achieved|desired|reference"
)
_NO_MOTION = re.compile(
    r"(?i)(?:r[xyz]|[rwmb][ _]?[xyz](?!\s*[\[(](?:g\b|gal|[cm]?m/s))|(?:mag|gyr|compass|gravity)[a-z]*[ _]?[xyz]?|"
    r"lvdt\d?|(?:base |stor(?:e?y) )?(?:shear|force|pressure|moment|load|strain|stress)|rot(?:ation)?|roll|pitch|"
    r"yaw|theta|tilt|drift|diff(?:erence)?|jerk|quality|\|.*\||envelope|rms|temp|arias|husid|flag|count|sigma|std|stdev|snr|index|se|p?s[adv])(?![a-z])|temperat|humid|batter|volt|charge|light|lux"
)
_SLOWER = re.compile(r"[vdu]_?[xyz12]", re.IGNORECASE)
"""Names of a velocity or displacement by its axis."""
_ABOVE_GROUND = re.compile(
    r"(?<![a-z])(?:roof|penthouse|crest|deck|block|specimen|top|upper|slab|frame|cabinet|bookcase|shelf|rack|payload|"
    r"response|output|(?:floor|stor(?:e?y)|level)[ _.]?[1-9]|[1-9]\d?(?:st|nd|rd|th)? ?f(?:loor)?)(?![a-z])",
    re.IGNORECASE,
)
STRUCTURE = "structure"
"""Kind of the input warning on columns that are not of the ground."""
_COMPONENT = re.compile(r"acc|a\d*(?:_?[a-z]{1,2})?(?![a-z])", re.IGNORECASE)
_ABOVE, _DWARFS = 4, 20.0
"""Number of first numbers of a column that are checked, and ratio to all that follow from which one is no sample."""
_HEADER_LINES = 100
_COLUMNS = 100


def read_csv(path: str | os.PathLike[str], dt: float | None = None, unit: str | float | None = None) -> xr.DataArray:
    """Read the motions in a plain table with commas, semicolons, tabs or blanks between values.

    Two columns are time (s or ms) and acceleration; one column is acceleration, with `dt` (s) given here or in a header
    line such as ``dt = 0.01`` or ``sampling rate: 100 Hz``. More columns need a line above the numbers that names them:
    time first, or directions alone (NS, EW, UD). Columns of velocity, displacement and other quantities are left out.
    The unit (g, cm/s², gal, m/s²) is in a column's name or in the header, else `unit` must be given. The number of
    samples above one column, and the time step with it, are no samples, which ``processing`` notes.

    Raises
    ------
    RecordError
        A file that cannot be read, rows of unequal length, or a value that is no number. A time step that is not
        uniform or is stated twice. A first column that counts or is a period, or velocity or displacement alone.
        Another number of samples than declared, or another number above a column. An unknown unit, two units that
        differ, a stated peak of another unit, no unit or no step.
    """
    with Lines(path) as lines:
        return single(lines.file, arrays_of(lines.file, csv_components(lines, dt, unit)))


def csv_components(lines: Lines, dt: float | None, unit: str | float | None) -> list[Component]:
    """Return one component for each column of accelerations."""
    file = lines.file
    header, names, table, columns = _table(lines)
    header = [(line, text if names and i == len(header) else as_key(text)) for i, (line, text) in enumerate(header, 1)]
    n = len(table) // max(columns, 1)
    if n < 2:
        raise RecordError(f"{file}: a motion has at least 2 samples, found {n}")
    values = np.frombuffer(table, dtype=np.float64).reshape(n, columns)
    if not np.isfinite(values).all():
        raise RecordError(f"{file}: row {int(np.flatnonzero(~np.isfinite(values).all(axis=1))[0]) + 1} is not finite")
    if _indexed(names):
        names, values, columns = names[1:], values[:, 1:], columns - 1
    note = ""
    if columns <= 2 and not names:
        values, header, note = _samples(file, values, header)
        n = len(values)
    words = header[:-1] if names and header else header
    total = columns > 2 and not all(RELATIVE.search(name) for name in names[1:])
    refuse_others(file, words if total else header)
    refuse_gaps(file, values)
    for number, text in header:
        declared = _COUNT.search(text)
        if declared is not None and int(declared[declared.lastindex or 1]) != n:
            many = declared[declared.lastindex or 1]
            raise RecordError(f"{file}: line {number} declares {many} samples, it holds {n}: truncated or damaged")
    timed = columns > 1 and not (names and _is_direction(names[0]))
    number = header[-1][0] if header else 0
    time = _times(file, values[:, 0], names[0] if names else "", number, words) if timed else values[:, 0]
    if timed:
        _refuse_doubled(file, time, values)
    step, dt_from = _step(lines, time, header, dt, timed)
    doubt_duration(file, words, n * step)
    given = None if unit is None else given_factor(unit)
    doubt_factors(file, header)
    kept: list[Component] = []
    sources: list[tuple[float, str]] = []
    slower: list[str] = []
    out: dict[str, list[str]] = {}
    directions = [direction_of(name) for name in names]
    others = _others(file, names[1 if timed else 0 :])
    channels = channels_of(text for _, text in words)
    for column in range(1 if timed else 0, columns):
        name = names[column] if names else ""
        resultant = _RESULTANT.match(name) and sum(direction is not None for direction in directions) > 1
        in_heading = in_name(name, number)
        if resultant or RELATIVE.search(name):
            out.setdefault("a resultant, or relative", []).append(name)
            continue
        if _NO_MOTION.match(name) or (not in_heading and name in others):
            out.setdefault("no acceleration, by its name", []).append(name)
            continue
        if any(stated.quantity in ("velocity", "displacement") for stated in in_heading) or _other(name):
            slower.append(name)
            continue
        # text in brackets further up, as in "PGA (gal)", is not of a column that has its own unit
        _refuse_thousands(file, values[:, column])
        peak = float(np.abs(values[:, column]).max())
        above = [stated for line, text in words for stated in units_in(text, line, not in_heading, peak)]
        units = [*in_heading, *above]
        if unit is not None and not isinstance(unit, str):  # (m/s² per count, or per any unit that is not read)
            units = [stated for stated in units if stated.quantity not in ("", "acceleration") or stated.factor > 0.0]
        agreed_on = agreed(file, units)
        if agreed_on is None and any(_other(text) for _, text in header):
            raise RecordError(f"{file}: its heading names velocity or displacement, not acceleration")
        if agreed_on is not None and given is not None:
            raise RecordError(f"{file}: states its unit, so unit must not be given, got {unit!r:.60}")
        factor = given if agreed_on is None else agreed_on.factor
        if agreed_on is None and isinstance(unit, str) and peak >= COUNTED and not (values[:, column] % 1.0).any():
            warn([Doubt.of("counts", of=file, unit=unit)])
        if factor is None:
            raise RecordError(
                f"{file}: states no unit of its accelerations: write it into the heading, as 'acceleration (g)', or "
                "give unit, in a study motions.unit (g, gal, cm/s2, m/s2)"
            )
        with np.errstate(over="ignore"):  # infinity is an error later, as beyond any motion
            acceleration = values[:, column] * factor
        upright = (directions[column] if names else None) or (False, 0.0)
        several = columns > 1 + timed or upright[0]
        label = channel_of(name, channels) if several else vertical_of(text for _, text in words)
        if columns == 1 + timed and (place := place_of(text for _, text in words)):
            label = f"{label or 'sensor'}{place}"
        sources.append((factor, GIVEN if agreed_on is None else f"line {agreed_on.line}"))
        column_of = Component(acceleration, step, file.stem if label else "", label, processing=note, dt_from=dt_from)
        kept.append(column_of._replace(begins=float(time[0]) if timed else math.nan))
    if not kept:
        headings = first_names([name for left in out.values() for name in left]) or "velocity or displacement"
        raise RecordError(f"{file}: its heading names {headings}, not acceleration")
    raised = [column.component for column in kept if _ABOVE_GROUND.search(column.component)]
    if 0 < len(raised) < len(kept):
        warn([Doubt.of("of_structure", file=file, named=first_names(raised))])
    _refuse_repeated(file, kept)
    refuse_stated_peak(file, words, [component.acceleration for component in kept])
    for why, left in out.items():
        warn([Doubt.of("column_left_out", file=file, named=first_names(left), why=why)])
    left_out = f", columns left out: {first_names(slower)}" if slower else ""
    return [
        column._replace(unit_from=unit_taken(factor, f"{source}{left_out}"))
        for column, (factor, source) in zip(kept, sources, strict=True)
    ]


def _samples(file: Path, values: Array, header: list[tuple[int, str]]) -> tuple[Array, list[tuple[int, str]], str]:
    """Return the samples without their number and time step above, the header with the step, a note."""
    n, line = len(values), header[-1][0] + 1 if header else 1
    if values.shape[1] == 2:
        for count, step in (values[0], values[0, ::-1]):
            if count == n - 1 > FEW and 0.0 < step < LONGEST_STEP:
                note = "its first line, the number of samples and the time step, is no sample"
                return values[1:], [*header, (line, f"dt = {float(step)!r}")], note
        return values, header, ""
    for count, step in ((0, 1), (1, 0)):
        if values[count, 0] == n - 2 > FEW and 0.0 < values[step, 0] < LONGEST_STEP:
            note = "its first two numbers, of samples and the time step, are no samples"
            return values[2:], [*header, (line + step, f"dt = {float(values[step, 0])!r}")], note
    note = ""
    if values[0, 0] == n - 1 > FEW:
        values, note = values[1:], "its first line, the number of samples, is no sample"
    peak = float(np.abs(values[_ABOVE:]).max(initial=0.0))
    above = np.abs(values[:_ABOVE, 0]) > _DWARFS * peak
    if n > FEW and peak > 0.0 and above.any():  # (zeros may follow a pulse)
        at = int(np.flatnonzero(above)[-1])
        raise RecordError(
            f"{file}: number {at + 1 + bool(note)}, {values[at, 0]:g}, is far above all that follow, so no sample: "
            "write what it is beside it, as '# latitude: 35.1', or leave it out"
        )
    return values, header, note


def _is_direction(name: str) -> bool:
    """Return True if a column is a direction by its name; x, y, l, t may be times or velocities."""
    return direction_of(name) is not None and not re.match(r"(?:[xylt]\d?|long?|tran?|\d+)(?!\w)", name, re.IGNORECASE)


def _others(file: Path, names: Sequence[str]) -> list[str]:
    """Return the columns that are none of the components of a heading, such as jerk or v next to acc or a.

    Next to a vertical component alone, or to one of three, an unknown name may be of a horizontal one.
    """
    short = len(names) == 1 or any(text.lower() in ("a", "acc") for text in names)
    slower = [name for name in names if _SLOWER.fullmatch(name) or (short and name in ("v", "d", "u"))]
    rest = [
        name
        for name in names
        if name not in slower
        and not (_NO_MOTION.match(name) or _RESULTANT.match(name) or RELATIVE.search(name) or _other(name))
    ]
    known = [n for n in rest if _COMPONENT.match(n) or direction_of(n) or "acceleration" in quantities(n)]
    unknown = [name for name in rest if name not in known and not in_name(name, 0)]
    upright = [name for name in known if (direction := direction_of(name)) and direction[0]]
    if not known or not unknown:
        return slower
    if len(rest) == 3 and len(upright) == 1:
        warn([Doubt.of("column_horizontal", file=file, named=first_names(unknown), upright=upright[0])])
        return slower
    if known == upright and not any(in_name(name, 0) for name in upright):
        raise RecordError(
            f"{file}: its column {upright[0][:40]!r} is vertical, {first_names(unknown)} no known direction: name the "
            "horizontal ones, as H1"
        )
    return [*slower, *unknown]


def _refuse_repeated(file: Path, columns: Sequence[Component]) -> None:
    """Raise RecordError for columns that are one signal twice, or at two stages of its processing."""
    if len(columns) < 2:
        return
    stages = [{word.lower() for word in _STAGES.findall(column.component)} for column in columns]
    directions = [direction_of(component.component) for component in columns]
    samples = np.stack(
        [component.acceleration / (np.linalg.norm(component.acceleration) or 1.0) for component in columns]
    )
    alike = (np.abs(samples @ samples.T) > 1.0 - 1e-6) & (samples.shape[1] > FEW)
    for i, j in itertools.combinations(range(len(columns)), 2):
        apart = None not in (directions[i], directions[j]) and directions[i] != directions[j]
        if stages[i] != stages[j] or (alike[i, j] and not apart):
            raise RecordError(
                f"{file}: its columns {columns[i].component[:40]!r} and {columns[j].component[:40]!r} are one signal "
                "twice, or no motion: keep the one that shakes"
            )


def _refuse_doubled(file: Path, time: Array, values: Array) -> None:
    """Raise RecordError for rows that stand twice; rounded times may be equal, but not with all their samples."""
    later = np.diff(time)
    back, equal = (later < 0.0) & (time[-1] > time[0]), later == 0.0
    if back.any() or (equal.any() and np.array_equal(values[1:][equal], values[:-1][equal])):
        row = int(np.argmax(back if back.any() else equal)) + 2
        raise RecordError(
            f"{file}: row {row} has the time {time[row - 1]:g} s after {time[row - 2]:g} s: give one record, with each "
            "row once"
        )


def _refuse_thousands(file: Path, column: Array) -> None:
    """Raise RecordError for whole numbers below 1000 next to a few with three decimals, all of them above 1."""
    sizes = np.abs(column)
    whole, others = sizes[sizes % 1.0 == 0.0], sizes[sizes % 1.0 > 0.0]
    written = np.abs(1e3 * others - np.round(1e3 * others)) < 1e-6 * others
    if others.size and whole.size > FEW and written.all() and others.min() > 1.0 and 100.0 <= whole.max() < 1000.0:
        raise RecordError(
            f"{file}: its numbers are whole up to {whole.max():g}, but others have decimals, as {others[0]:.3f}: do "
            "points mark thousands? Write numbers without such marks"
        )


def _times(file: Path, column: Array, name: str, line: int, words: Sequence[tuple[int, str]]) -> Array:
    """Return a column of times in s, of the unit that its name or else a line above it states; from 0 if since 1970."""
    last = _LAST_UNIT.search(name)
    scaled = [unit_of(name, line)] if re.search(r"/|^t\s?\*", name) else []  # ("t/T1", no time in s)
    units = in_name(name, line) or ([unit_of(last["unit"], line)] if last else scaled)
    words_of_units = [unit.text.strip(" ,;.").lower() for unit in units]
    for unit, word in zip(units, words_of_units, strict=True):
        if word not in ("", *_SECONDS):
            raise RecordError(
                f"{file}: line {unit.line} has times in the unknown unit {unit.text.strip()[:40]!r}, known are s, ms, "
                "µs and ns"
            )
    clock = next((start for start in _CLOCKS if start <= column[0] < 4.0 * start), 0.0)
    if units:
        factor = _SECONDS[words_of_units[0] or "s"]
    else:
        factor = 1e-3 if any(_MILLISECONDS.search(text) for _, text in words) else _CLOCKS.get(clock, 1.0)
    return (column - column[0] if clock else column) * factor


def _other(text: str) -> bool:
    """Return True if a text names velocity or displacement, and no acceleration."""
    return bool(named := quantities(text)) and "acceleration" not in named and not OF_WAVES.search(folded(text))


def _table(lines: Lines) -> tuple[list[tuple[int, str]], list[str], array[float], int]:
    """Return header lines with their numbers, names of the columns, the numbers row by row, and the columns."""
    header: list[tuple[int, str]] = []
    names: list[str] = []
    table = array("d")
    columns = both = 0
    for line in lines:
        stripped = line.strip().replace("\N{MINUS SIGN}", "-")
        if is_blank(line) or (not columns and not stripped.strip("# ")):
            continue
        fields = [f for f in re.split(r"[,;\s]+", stripped) if f]
        try:
            if "_" in stripped or not stripped.isascii():
                raise ValueError
            row = [float(f.strip('"')) for f in fields]
        except ValueError:
            if columns:
                raise lines.error(f"holds {stripped[:30]!r}, no numbers") from None
            if _CLOCK.match(stripped) and header and _CLOCK.match(header[-1][1]):
                raise lines.error(f"holds {stripped[:30]!r}, a time of day: write the time in s") from None
            header.append((lines.number, stripped[:HEADER_WIDTH]))
            if len(header) > _HEADER_LINES:
                raise RecordError(f"{lines.file}: no numbers in its first {_HEADER_LINES} lines: not a table") from None
            continue
        if not columns:
            columns = len(row)
            above = header[-1][1].replace(",", " ").replace(";", " ").split() if header else []
            if len(above) == columns > 1 and not math.isnan(known(above[0])) and all(map(_MARK.fullmatch, above[1:])):
                raise lines.error(f"holds {header[-1][1][:30]!r}, no numbers", header[-1][0])
            apart = ";" in stripped or _COMMAS.search(stripped) or re.search(r'"[-+]?\d+,\d[\d.]*"', stripped)
            if apart and re.search(r"\d,\d", stripped):
                raise lines.error(f"holds {stripped[:30]!r}: {DECIMALS}")
            if not (names := _names([text for _, text in header], columns)) and columns > 1:
                # comments may be between the heading and the numbers
                heading = [i for i, (_, text) in enumerate(header) if not is_comment(text)][-1:]
                header += [header.pop(i) for i in heading]
                names = _names([text for _, text in header], columns)
            if not names and _NO_POINTS.fullmatch(stripped):
                raise lines.error(f"holds {stripped[:30]!r}: {DECIMALS}")
            heads = cells_of(header[-1][1]) if header else []
            later = [cell for cell in heads[1:] if _TIME.match(cell) and not re.search(r"\d", cell)]
            if len(heads) == columns and not names and later:
                raise lines.error(
                    f"is below a heading whose first column is not {later[0][:30]!r}: write the times first"
                )
            if columns > 2 and not names:
                raise lines.error(
                    f"has {columns} columns, allowed are 1 or 2 (time, acceleration), or a heading that names them: "
                    "'time (s), NS (gal), EW (gal)'"
                )
            ordinate = names and not re.match("time", names[0], re.IGNORECASE) and any(map(_ORDINATE.match, names))
            if ordinate or (names and _SPECTRUM.match(names[0])):
                raise RecordError(f"{lines.file}: its first column is {names[0][:40]!r}: a spectrum, no motion")
        if [len(row), columns, len(table)] == [1, 2, 2] and not names and max(table) > FEW:
            columns, both = 1, lines.number  # (the number of samples and the step, on one line above them)
        if len(row) != columns:
            raise lines.error(f"has {len(row)} columns, the first has {columns}")
        table.extend(row)
        if len(table) > MAX_SAMPLES:
            raise lines.error(f"is beyond {MAX_SAMPLES:,} numbers, no record is")
    if both and len(table) - 2 not in table[:2]:
        raise lines.error("has 1 columns, the first has 2", both)
    return header, names, table, columns


def _names(header: list[str], columns: int) -> list[str]:
    """Return the columns' names, time first or all of them directions, as the line above the numbers gives them."""
    if not header or columns > _COLUMNS:
        return []
    sequence = next((match["names"] for match in map(_SEQUENCE.match, header) if match), None)
    if sequence is not None:
        return _names([sequence.replace(";", " ")], columns)
    separator = next((s for s in (";", ",", "\t") if s in header[-1]), None)
    heading = header[-1].lstrip("# ")
    words = next(csv.reader([heading], delimiter=separator, skipinitialspace=True)) if separator else heading.split()
    titles = [name.strip().strip('"') for name in words]
    if not titles[-1] and len(titles) == columns + 1:  # (a comma ends the line)
        titles.pop()
    if len(header) > 1 and len(titles) == columns and all(map(is_unit, titles)):
        above = _names(header[:-1], columns)
        return [f"{name} ({unit.strip('[]() ')})" for name, unit in zip(above, titles, strict=True)] if above else []
    if len(titles) == columns > 1 and not all(titles[1:]):  # (names in a line further up: "Component,NS,EW,UD")
        cells_above = [cells_of(text) for text in header[:-1]]
        named = (row[1:] for row in reversed(cells_above) if len(row) == columns and len({*row[1:], ""}) == columns)
        titles = [titles[0], *next(named, [])]
    valid = _indexed(titles) or _TIME.match(titles[0]) or _SPECTRUM.match(titles[0]) or all(map(_is_direction, titles))
    return titles if len(titles) == columns and valid else []


def _indexed(names: Sequence[str]) -> bool:
    """Return True if the first column is named as a count or a clock of the samples, and the second one as times."""
    return len(names) > 2 and bool(
        (_INDEX.fullmatch(names[0]) and _TIME.match(names[1])) or (_TIME.match(names[0]) and _ELAPSED.match(names[1]))
    )


def _step(lines: Lines, time: Array, header: list[tuple[int, str]], dt: float | None, timed: bool) -> tuple[float, str]:
    """Return the time step of a table, s, and its source."""
    file = lines.file
    written, doubtful, line = written_step(lines, header, len(time))
    if timed:
        if dt is not None:
            raise RecordError(f"{file}: has a time column, so dt must not be given, got {dt!r}")
        if (time == time[0] + np.arange(len(time))).all():
            raise RecordError(f"{file}: its first column counts 1, 2, 3 …: leave it out, or write the time in s")
        try:
            measured = checks.time_step("the record", time, None)
        except ValueError as error:
            raise RecordError(f"{file}: {_rounded(time) or error}") from None
        if measured >= LONGEST_STEP:
            raise RecordError(f"{file}: its first column steps by {measured:g}, which is no time in s")
        refuse_other_step(lines, header, len(time), measured, f"its time column {measured:g} s")
        return measured, "time column"
    if dt is not None:
        step = STEP.number("dt", dt)
        refuse_other_step(lines, header, len(time), step, f"so dt must not be {step:g}", given=True)
        return step, GIVEN
    if written is None:
        raise RecordError(f"{file}: has no time column, so dt must be given (s), in a study motions.dt_s")
    if doubtful:
        raise RecordError(
            f"{file}: {doubtful}: which is the time step of its samples? State that alone, or give dt, in a study "
            "motions.dt_s"
        )
    return written, f"line {line}"


def _rounded(time: Array) -> str:
    """Return a remedy for times that are rounded times of a uniform step; '' if they are not."""
    step = float(time[-1] - time[0]) / (time.size - 1)
    decimals = next((d for d in range(7) if np.array_equal(np.round(time, d), time)), None)
    if decimals is None or not 0.0 < step < LONGEST_STEP:
        return ""
    step = 1.0 / round(1.0 / step)
    if np.abs(time - time[0] - step * np.arange(time.size)).max() > 0.501 * 10.0**-decimals:
        return ""
    return f"its times are rounded to {decimals} decimals: leave the column out and write 'dt = {step:.6g}' above"
