"""Curves as a plain CSV table for people, spreadsheets and other programs: a heading with units, then a row a curve.

Curves without parameters take a row for each level.  No cell can be read as a formula.
"""

from __future__ import annotations

import csv
import io
import math
import os
import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import xarray as xr

from ...core.units import DIMENSIONLESS, PER_YEAR, UNITS
from ..curves.curve import ISOTONIC, LINKED, UPLIFT
from ..fitting.links import LOGNORMAL
from ..fitting.states import INCOMPLETE, OK
from .datasets import curve_dataset, curve_set
from .files import ExchangeError, number, read_text, target, write_text
from .ids import TABLE_MARKS, make_ids
from .rows import (
    CURVE_NUMBERS,
    CURVE_WORDS,
    LEVEL,
    LIMIT_STATE,
    MAX_CURVES,
    OVERTURNING,
    PARAMETERS,
    PLACES,
    CurveParameters,
    CurveRow,
    CurveSet,
    Written,
    known_measure,
    levels_problem,
    select_measure,
)

MAX_COLUMNS = 100
_IN_LEVELS = ("median", "uplift_median", "level", *(name for name, (unit, _) in CURVE_NUMBERS.items() if unit == LEVEL))
_NUMBERS = (*PARAMETERS, *CURVE_NUMBERS, "level", "probability")
_TEXTS = ("measure", "measured_at", "state", "form", "status", *CURVE_WORDS)
_SPELLED = {"m s-2": "m/s2", "m s-1": "m/s", PER_YEAR: "1/year"}


def write_curve_csv(curves: xr.Dataset, path: str | os.PathLike[str], ids: Sequence[str] | None = None) -> Written:
    """Write curves of any form as a plain table.

    Parameters
    ----------
    curves : xarray.Dataset
        Curves on block, model, floor or any other dimensions.
    path : path
        The CSV.
    ids : sequence of str, optional
        Ids of the components, one for each combination of labels other than the limit state (the last dimension of
        the curves changes fastest): a letter, then letters, digits, ``_`` and ``.``, at most 60 characters.  Where not
        given, the curves' own (coordinate ``id``) or ids made of the labels.

    Returns
    -------
    Written
        Files, ids, and the components without an estimate: their rows have empty cells and the reason in status.

    Raises
    ------
    ExchangeError
        A file that cannot be written.
    TypeError, ValueError
        Something other than a dataset of fragility curves; `ids` that are too few, not legal, or not unique.

    Notes
    -----
    Columns: id, the labels, measure, measured_at (floor or ground), state where it is not overturning, form where it is
    log-logistic or weibull, then median, dispersion and the other columns, SI, the unit in brackets; or level and
    probability, a row for each level.  A spreadsheet takes a cell that begins with = + - @ for a formula: such labels
    begin with an apostrophe here, which `read_curve_csv` takes off, and what could begin another cell or line is
    written as a backslash, x and two hexadecimal digits.

    Examples
    --------
    >>> import tempfile
    >>> from toppling.fragility.curves import published
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     written = write_curve_csv(published.fema_p58()[["median", "dispersion"]], f"{folder}/curves.csv")
    ...     for line in written.paths[0].read_text().splitlines()[:2]:
    ...         print(line)
    id,block,measure,measured_at,median (m/s),dispersion (1),width (m),height (m),directional (1),status
    E.20.22.102a,bookcase-2-shelf,pgv,floor,0.724,0.5,0.320675,0.7366,0.0,ok
    """
    file = target(path)
    found = curve_set(curves, TABLE_MARKS, ids)
    accompanying = [name for name in CURVE_NUMBERS if any(name in curve.numbers for curve in found.curves)]
    words = [name for name in CURVE_WORDS if any(name in curve.words for curve in found.curves)]
    parameters = {UPLIFT: PARAMETERS, ISOTONIC: ()}.get(found.form, PARAMETERS[:2])
    of_curves = ("level", "probability") if found.form == ISOTONIC else parameters
    state = [found.state] if found.state != OVERTURNING and LIMIT_STATE not in found.dims else []
    form = [found.form] if found.form in LINKED else []
    heading = ["id", *found.dims, "measure", "measured_at", *(["state"] if state else []), *(["form"] if form else [])]
    heading += [_with_unit(name, found.units) for name in (*of_curves, *accompanying)]
    lines = io.StringIO()
    table = csv.writer(lines, lineterminator="\n")
    table.writerow(map(guarded, [*heading, "status", *words]))
    for name, curve in zip(found.ids, found.curves, strict=True):
        first = [guarded(text) for text in (name, *curve.labels, found.im, PLACES[found.ground], *state, *form)]
        last = [*(_written(curve.numbers.get(key, math.nan)) for key in accompanying), guarded(curve.status)]
        last += [guarded(curve.words.get(key, "")) for key in words]
        for numbers in _rows(curve, parameters, found):
            table.writerow([*first, *map(_written, numbers), *last])
    return Written((write_text(file, lines.getvalue()),), tuple(dict.fromkeys(found.ids)), found.missing())


def read_curve_csv(path: str | os.PathLike[str], im: str | None = None) -> xr.Dataset:
    """Read curves from a plain table, as `write_curve_csv` writes it or as it is quickly made by hand.

    Parameters
    ----------
    path : path
        The CSV: a heading, then a row a curve.  Needed are a column measure (pga, pgv, Sa(1.0), …) and median (unit)
        and dispersion, or level (unit) and probability; all columns before measure except id are labels.  Units are
        those of `toppling.core.units.UNITS`: g, m/s2, cm/s2, gal, m/s, cm/s, m, cm, mm, 1.
    im : str, optional
        The measure to read where the table has several.

    Returns
    -------
    xarray.Dataset
        Curves (SI) on the labels' dimensions, ``block`` where there are none but ids.

    Raises
    ------
    ExchangeError
        One sentence that names the file and the error: columns, units, numbers, a curve given twice.
    ValueError
        An unknown `im`.

    Examples
    --------
    >>> import tempfile, pathlib
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = pathlib.Path(folder, "mine.csv")
    ...     with file.open("w") as stream:
    ...         print("block,measure,median (g),dispersion", "vase,pga,0.25,0.4", sep=chr(10), file=stream)
    ...     curves = read_curve_csv(file)
    >>> curves["median"].item(), curves["median"].attrs["units"]
    (2.4516625, 'm s-2')
    """
    file, text = read_text(path)
    columns, rows = _table(file, text)
    by_measure: dict[tuple[str, bool], list[dict[str, str]]] = {}
    for i, row in enumerate(rows, start=2):
        where = row.get("measured_at") or PLACES[0]
        if where not in PLACES:
            raise ExchangeError(f"{file}: row {i}: measured_at must be floor or ground, got {where!r:.30}")
        by_measure.setdefault((row["measure"], where == PLACES[1]), []).append(row)
    (label, ground), chosen = select_measure(file, by_measure, im)
    made = (
        _of_levels(file, columns, chosen, label)
        if "level" in columns.units
        else _of_parameters(file, columns, chosen, label)
    )
    state = _alike(file, chosen, "state", OVERTURNING, label, ": make it a label, limit_state")
    made = made._replace(ground=ground, title=f"Fragility curves of {file.name}", state=state)
    return curve_dataset(made, file.name)


def _alike(file: Path, rows: Sequence[Mapping[str, str]], name: str, default: str, im: str, remedy: str = "") -> str:
    """Return the text that all rows have in a column; ExchangeError where they differ."""
    texts = {row.get(name) or default for row in rows}
    if len(texts) > 1:
        raise ExchangeError(f"{file}: {name} must be the same for all curves of {im}{remedy}")
    return texts.pop()


class _Columns(NamedTuple):
    """Columns of a table: the labels, and the unit of each number."""

    labels: tuple[str, ...]
    units: dict[str, str]


def _with_unit(name: str, units: str) -> str:
    unit = units if name in _IN_LEVELS else CURVE_NUMBERS[name][0] if name in CURVE_NUMBERS else DIMENSIONLESS
    return f"{name} ({_SPELLED.get(unit, unit)})"


def _rows(curve: CurveRow, parameters: Sequence[str], found: CurveSet) -> Iterable[Sequence[float]]:
    if found.levels is None:
        return [[getattr(curve.parameters, name) for name in parameters]]
    if curve.probability is None:
        return [(math.nan, math.nan)]
    return zip(found.levels.tolist(), curve.probability.tolist(), strict=True)


def _written(value: float) -> str:
    return "" if math.isnan(value) else repr(value)


_FORMULA = "=+-@\uff1d\uff0b\uff0d\uff20"
# characters that could end a line, or begin another cell where a spreadsheet uses another separator
_BREAKS = re.compile(rf"[\x00-\x1f\x7f\\]|[;|](?=[\s\"']*[{re.escape(_FORMULA)}])")


def guarded(text: str) -> str:
    """Return a text that no spreadsheet takes for a formula."""
    plain = _BREAKS.sub(lambda match: f"\\x{ord(match[0]):02x}", text)
    return f"'{plain}" if plain.lstrip()[:1] in (*_FORMULA, "'") else plain


def _unguarded(text: str) -> str:
    plain = text[1:] if text.startswith("'") else text
    return re.sub(r"\\x([0-9a-f]{2})", lambda match: chr(int(match[1], 16)), plain)


def _table(file: Path, text: str) -> tuple[_Columns, list[dict[str, str]]]:
    """Return the columns, and each row's texts by the name of the column, without its unit."""
    try:
        lines = [row for row in csv.reader(io.StringIO(text, newline=""), strict=True) if any(map(str.strip, row))]
    except csv.Error as error:
        raise ExchangeError(f"{file}: no table ({error})") from None
    if not lines:
        raise ExchangeError(f"{file}: empty")
    if len(lines[0]) > MAX_COLUMNS:
        raise ExchangeError(f"{file}: has {len(lines[0])} columns, allowed are {MAX_COLUMNS}")
    names, units = [], {}
    for cell in lines[0]:
        match = re.fullmatch(r"\s*([A-Za-z][A-Za-z0-9_ -]{0,40}?)\s*(?:\(([^()]{1,20})\))?\s*", _unguarded(cell))
        if match is None:
            raise ExchangeError(f"{file}: its heading holds {cell!r:.60}, no name with a unit in brackets")
        names.append(match[1])
        if match[1] in _NUMBERS:
            units[match[1]] = match[2] or DIMENSIONLESS
    if len(set(names)) < len(names):
        raise ExchangeError(f"{file}: its columns must have names of their own, got {', '.join(names):.200}")
    _check_columns(file, names)
    for i, line in enumerate(lines[1:], start=2):
        if len(line) != len(names):
            raise ExchangeError(f"{file}: row {i} has {len(line)} columns, the heading has {len(names)}")
    rows = [dict(zip(names, map(_unguarded, line), strict=True)) for line in lines[1:]]
    if not rows:
        raise ExchangeError(f"{file}: holds no curves")
    return _Columns(tuple(name for name in names[: names.index("measure")] if name != "id"), units), rows


def _check_columns(file: Path, names: Sequence[str]) -> None:
    """Raise ExchangeError where the columns are not those of curves."""
    if "measure" not in names:
        raise ExchangeError(f"{file}: has no column measure (pga, pgv, Sa(1.0), …)")
    behind = names[names.index("measure") :]
    foreign = next((name for name in behind if name not in (*_NUMBERS, *_TEXTS)), None)
    if foreign is not None:
        raise ExchangeError(f"{file}: has an unknown column {foreign!r} behind measure (labels stand before it)")
    pairs = (("median", "dispersion"), ("level", "probability"))
    given = [pair for pair in pairs if any(name in behind for name in pair)]
    if len(given) != 1 or not all(name in behind for name in given[0]):
        raise ExchangeError(f"{file}: needs the columns median and dispersion, or level and probability")
    if "uplift_median" in behind and "uplift_dispersion" not in behind:
        raise ExchangeError(f"{file}: has uplift_median, but no uplift_dispersion")


def _of_parameters(file: Path, columns: _Columns, rows: Sequence[Mapping[str, str]], im: str) -> CurveSet:
    if len(rows) > MAX_CURVES:
        raise ExchangeError(f"{file}: holds {len(rows):,} curves, allowed are {MAX_CURVES:,}")
    units, factors = _units(file, columns, im)
    ids, labels, dims = _named(file, columns, rows)
    form = _alike(file, rows, "form", UPLIFT if "uplift_median" in factors else LOGNORMAL, im)
    if form not in (LOGNORMAL, UPLIFT, *LINKED) or (form == UPLIFT) != ("uplift_median" in factors):
        raise ExchangeError(f"{file}: form must be lognormal, {' or '.join(LINKED)}, got {form!r:.30}")
    curves = []
    for i, (row, label) in enumerate(zip(rows, labels, strict=True), start=2):
        numbers = _numbers(file, row, factors, f"row {i}")
        own = {name: numbers.pop(name) for name in PARAMETERS if name in numbers}
        parameters = CurveParameters(**own, link=form if form in LINKED else LOGNORMAL)
        curves.append(CurveRow(label, parameters, row.get("status") or OK, None, numbers, _words(row)))
    return CurveSet(im, units, False, dims, ids, tuple(curves), form)


def _of_levels(file: Path, columns: _Columns, rows: Sequence[Mapping[str, str]], im: str) -> CurveSet:
    units, factors = _units(file, columns, im)
    ids, labels, dims = _named(file, columns, rows, repeated=True)
    tables: dict[tuple[str, ...], list[tuple[float, float]]] = {}
    first: dict[tuple[str, ...], tuple[str, CurveRow]] = {}
    for i, (name, row, label) in enumerate(zip(ids, rows, labels, strict=True), start=2):
        numbers = _numbers(file, row, factors, f"row {i}")
        level, probability = numbers.pop("level", math.nan), numbers.pop("probability", math.nan)
        if math.isnan(level) != math.isnan(probability):
            raise ExchangeError(f"{file}: row {i} must have both level and probability, or neither")
        points = tables.setdefault(label, [])
        if not math.isnan(level):
            points.append((level, probability))
        status = row.get("status") or OK
        first.setdefault(label, (name, CurveRow(label, status=status, numbers=numbers, words=_words(row))))
    levels = next((np.array([level for level, _ in points]) for points in tables.values() if points), np.empty(0))
    problem = levels_problem(levels)
    if problem:
        raise ExchangeError(f"{file}: {problem}")
    curves = []
    for label, (_, curve) in first.items():
        points = tables[label]
        if points and [level for level, _ in points] != levels.tolist():
            raise ExchangeError(f"{file}: curve {' / '.join(label)!r:.100} must have the levels of the first")
        p = np.array([probability for _, probability in points]) if points else None
        curves.append(
            curve._replace(probability=p, status=curve.status if points or curve.status != OK else INCOMPLETE)
        )
    return CurveSet(im, units, False, dims, tuple(name for name, _ in first.values()), tuple(curves), ISOTONIC, levels)


def _named(
    file: Path, columns: _Columns, rows: Sequence[Mapping[str, str]], repeated: bool = False
) -> tuple[tuple[str, ...], list[tuple[str, ...]], tuple[str, ...]]:
    """Return ids, labels and dimensions of the rows; ids without labels label blocks, labels without ids make ids."""
    dims = columns.labels
    labels = [tuple(row[name] for name in dims) for row in rows]
    if not dims and "id" in rows[0]:
        dims, labels = ("block",), [(row["id"],) for row in rows]
    elif not dims and len(rows) > 1 and not repeated:
        raise ExchangeError(f"{file}: several curves need labels: a column id, or columns before measure")
    of_components = [k for k, dim in enumerate(dims) if dim != LIMIT_STATE]
    keys = [tuple(label[k] for k in of_components) for label in labels]
    if "id" in rows[0] and all(row["id"] for row in rows):
        return tuple(row["id"] for row in rows), labels, dims
    made = make_ids(list(dict.fromkeys(keys)), [dims[k] for k in of_components])
    return tuple(made[key] for key in keys), labels, dims


def _units(file: Path, columns: _Columns, im: str) -> tuple[str, dict[str, float]]:
    """Return the SI unit of the measure, and the factor that converts each column to SI."""
    measure = known_measure(im)
    stated = columns.units["level" if "level" in columns.units else "median"]
    own = measure.units if measure is not None else UNITS.get(stated, (1.0, stated))[1]
    factors = {}
    for name, unit in columns.units.items():
        wanted = own if name in _IN_LEVELS else CURVE_NUMBERS[name][0] if name in CURVE_NUMBERS else DIMENSIONLESS
        factor, si = UNITS.get(unit, (1.0, unit))
        if si != wanted:
            allowed = ", ".join(key for key, (_, value) in UNITS.items() if value == wanted) or wanted
            raise ExchangeError(f"{file}: {name} of {im or 'no measure':.40} must be in {allowed}, got {unit!r:.30}")
        factors[name] = factor
    return own, factors


def _numbers(file: Path, row: Mapping[str, str], factors: Mapping[str, float], where: str) -> dict[str, float]:
    """Return the numbers of a row in SI units, without empty cells."""
    return {
        name: number(file, f"{name} in {where}", row[name]) * factor
        for name, factor in factors.items()
        if row[name].strip()
    }


def _words(row: Mapping[str, str]) -> dict[str, str]:
    return {name: row[name] for name in CURVE_WORDS if row.get(name)}
