"""Curves as a plain CSV table for people, spreadsheets and other programs: a heading with units, then a row a curve.

Curves without parameters take a row for each level.  No cell can be read as a formula.
"""

import csv
import io
import math
import os
import re
from collections.abc import Iterable, Sequence

import xarray as xr

from ...core import checks
from ...core.units import DIMENSIONLESS, SPELLED
from ..curves.curve import ISOTONIC, LINKED, UPLIFT
from .datasets import curve_set
from .files import write_text
from .ids import TABLE_MARKS
from .rows import CURVE_NUMBERS, CURVE_WORDS, LEVEL, LIMIT_STATE, OVERTURNING, PARAMETERS, CurveRow, CurveSet, Written

_IN_LEVELS = ("median", "uplift_median", "level", *(name for name, (unit, _) in CURVE_NUMBERS.items() if unit == LEVEL))


def write_curve_csv(curves: xr.Dataset, path: str | os.PathLike[str], ids: Sequence[str] | None = None) -> Written:
    """Write curves of any form as a plain table.

    Parameters
    ----------
    curves : xarray.Dataset
        Curves on block, model, floor or any other dimensions.
    path : path
        The CSV.
    ids : sequence of str, optional
        Ids of the components, one for each combination of labels other than the limit state; the last dimension of the
        curves changes fastest. An id has a letter, then letters, digits, ``_`` and ``.``, at most 60 characters. If not
        given, ids are the curves' own (coordinate ``id``) or made of the labels.

    Returns
    -------
    Written
        Files, ids, and the components without an estimate: their rows have empty cells and the reason in status.

    Raises
    ------
    ExchangeError
        A file that cannot be written.

    Notes
    -----
    Columns are id, the labels, measure, measured_at (floor or ground), state unless it is overturning, and form if it
    is log-logistic or weibull. Then follow median, dispersion and the other columns, SI, the unit in brackets; or level
    and probability, a row for each level. Spreadsheets read a cell that begins with = + - @ as a formula: such labels
    begin with an apostrophe here. Characters that could begin another cell or line are written as a backslash, x and
    two hexadecimal digits.
    """
    file = checks.path(path)
    chosen = curve_set(curves, TABLE_MARKS, ids)
    accompanying = [name for name in CURVE_NUMBERS if any(name in curve.numbers for curve in chosen.curves)]
    words = [name for name in CURVE_WORDS if any(name in curve.words for curve in chosen.curves)]
    parameters = {UPLIFT: PARAMETERS, ISOTONIC: ()}.get(chosen.form, PARAMETERS[:2])
    of_curves = ("level", "probability") if chosen.form == ISOTONIC else parameters
    state = [chosen.state] if chosen.state != OVERTURNING and LIMIT_STATE not in chosen.dims else []
    form = [chosen.form] if chosen.form in LINKED else []
    heading = ["id", *chosen.dims, "measure", "measured_at", *(["state"] if state else []), *(["form"] if form else [])]
    heading += [_with_unit(name, chosen.units) for name in (*of_curves, *accompanying)]
    lines = io.StringIO()
    table = csv.writer(lines, lineterminator="\n")
    table.writerow(map(guarded, [*heading, "status", *words]))
    for name, curve in zip(chosen.ids, chosen.curves, strict=True):
        first = [guarded(text) for text in (name, *curve.labels, chosen.im, chosen.place, *state, *form)]
        last = [*(_written(curve.numbers.get(key, math.nan)) for key in accompanying), guarded(curve.status)]
        last += [guarded(curve.words.get(key, "")) for key in words]
        for numbers in _rows(curve, parameters, chosen):
            table.writerow([*first, *map(_written, numbers), *last])
    return Written((write_text(file, lines.getvalue()),), tuple(dict.fromkeys(chosen.ids)), chosen.missing())


def _with_unit(name: str, units: str) -> str:
    unit = units if name in _IN_LEVELS else CURVE_NUMBERS[name][0] if name in CURVE_NUMBERS else DIMENSIONLESS
    return f"{name} ({SPELLED.get(unit, unit)})"


def _rows(curve: CurveRow, parameters: Sequence[str], chosen: CurveSet) -> Iterable[Sequence[float]]:
    if chosen.levels is None:
        return [[getattr(curve.parameters, name) for name in parameters]]
    if curve.probability is None:
        return [(math.nan, math.nan)]
    return zip(chosen.levels.tolist(), curve.probability.tolist(), strict=True)


def _written(value: float) -> str:
    return "" if math.isnan(value) else repr(value)


_FORMULA = "=+-@\uff1d\uff0b\uff0d\uff20"
# characters that could end a line, or begin another cell where a spreadsheet uses another separator
_BREAKS = re.compile(rf"[\x00-\x1f\x7f\\]|[;|](?=[\s\"']*[{re.escape(_FORMULA)}])")


def guarded(text: str) -> str:
    """Return a text that no spreadsheet takes for a formula."""
    plain = _BREAKS.sub(lambda match: f"\\x{ord(match[0]):02x}", text)
    return f"'{plain}" if plain.lstrip()[:1] in (*_FORMULA, "'") else plain
