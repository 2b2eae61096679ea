"""Tables in files: CSV in SI units, and the sheets of a workbook."""

from __future__ import annotations

import csv
import io
import math
import zipfile
from collections.abc import Mapping
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...fragility.exchange.curve_csv import guarded
from ..buildings.recommendations import UNKNOWN, Range
from ..text.names import clean
from .table import Marked, Table, Value

if TYPE_CHECKING:
    from openpyxl import Workbook
    from openpyxl.worksheet.worksheet import Worksheet

Cell = str | float | int | None
SMALL = 1e-3
"""Chances below which a workbook shows four decimals of a per cent."""
LARGE = 10.0
"""Numbers from which one decimal is shown; smaller numbers have four, probabilities are in per cent."""
WIDEST = 40
"""Widest column of a sheet, characters."""


def cells(table: Table) -> list[list[Cell]]:
    """Return the keys of the columns with units and the values below; ranges have a column for each of their ends."""
    heads: list[Cell] = []
    for column in table.columns:
        unit = f" ({column.unit})" if column.unit else ""
        heads += [f"{column.key}{end}{unit}" for end in column.ends or ("",)]
    lines = [heads]
    for row in table.lines:
        values: list[Cell] = []
        for column in table.columns:
            value = row.get(column.key)
            values += map(_known, (value if isinstance(value, Range) else UNKNOWN) if column.ends else [value])
        lines.append(values)
    return lines


def _known(value: Value) -> Cell:
    """Return a value, None instead of a number that is not finite."""
    assert not isinstance(value, tuple)
    return None if isinstance(value, float) and not math.isfinite(value) else value


def table_json(table: Table) -> dict[str, Any]:
    """Return a table as an object of JSON: its columns, and its rows by the keys of the columns."""
    return {
        "title": table.title,
        "columns": [{"key": column.key, "title": column.title, "unit": column.unit} for column in table.columns],
        "rows": [{column.key: _plain(row.get(column.key)) for column in table.columns} for row in table.lines],
        "note": table.note,
    }


def _plain(value: Value) -> Cell | dict[str, Cell]:
    """Return a value without marks, a range as an object of its numbers that are known."""
    if isinstance(value, Marked):
        return _plain(value.value)
    if isinstance(value, Range):
        return {name: part for name, part in value._asdict().items() if _known(part) is not None}
    return _known(value)


def csv_bytes(table: Table) -> bytes:
    """Return a table as a CSV file; texts that a spreadsheet would take for formulas begin with an apostrophe."""
    lines = io.StringIO()
    written = csv.writer(lines, lineterminator="\n")
    for row in cells(table):
        written.writerow([guarded(value) if isinstance(value, str) else value for value in row])
    return lines.getvalue().encode()


def workbook(tables: Mapping[str, Table]) -> bytes:
    """Return a workbook of tables by the names of their sheets; the same tables give a bit-identical file."""
    from openpyxl import Workbook  # noqa: PLC0415 - for this format alone

    book = Workbook()
    for i, (name, table) in enumerate(tables.items()):
        sheet = book.create_sheet(name, i)
        _fill(sheet, cells(table))
        if i == 0:
            sheet.freeze_panes = "B2"
            sheet.auto_filter.ref = sheet.dimensions
    del book["Sheet"]
    return timeless(book)


class _Timeless(zipfile.ZipFile):
    """A ZIP file whose parts have no time of writing, which it could not store before 1980."""

    def writestr(self, part: Any, text: Any, *_: Any) -> None:
        super().writestr(zipfile.ZipInfo(part), text, zipfile.ZIP_DEFLATED)

    def write(self, filename: Any, part: Any = None, *_: Any) -> None:
        self.writestr(part, Path(filename).read_bytes())


def timeless(book: Workbook) -> bytes:
    """Return the file of a workbook without the time of writing, so that the same results give bit-identical files."""
    from openpyxl.writer.excel import ExcelWriter  # noqa: PLC0415 - for this format alone

    book.properties.created = book.properties.modified = datetime(1980, 1, 1)
    held = io.BytesIO()
    ExcelWriter(book, _Timeless(held, "w")).save()
    return held.getvalue()


def _format(heading: str, value: float) -> str:
    """Return the format of a number in a workbook."""
    if heading.startswith("rate"):
        return "0.00E+00"
    if heading.startswith(("chance", "probability")):
        return "0.0000%" if abs(value) < SMALL else "0.00%"
    return "#,##0.0" if abs(value) >= LARGE else "0.0000"


def _fill(sheet: Worksheet, rows: list[list[Cell]]) -> None:
    """Write rows into a sheet, the first in bold, with columns as wide as their texts."""
    from openpyxl.styles import Font  # noqa: PLC0415 - for this format alone
    from openpyxl.utils import get_column_letter  # noqa: PLC0415

    for i, row in enumerate(rows, start=1):
        for j, value in enumerate(row, start=1):
            # (a cell of the type s is never read as a formula)
            cell = sheet.cell(i, j, clean(value) if isinstance(value, str) else value)
            if isinstance(value, str):
                cell.data_type = "s"
            elif isinstance(value, float):
                cell.number_format = _format(str(rows[0][j - 1]), value)
            if i == 1:
                cell.font = Font(bold=True)
    for j, column in enumerate(zip(*rows, strict=True), start=1):
        widest = max(len(value) if isinstance(value, str) else 12 for value in column)
        sheet.column_dimensions[get_column_letter(j)].width = min(WIDEST, widest + 2)
