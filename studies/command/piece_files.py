"""The pieces of a performance study's results as a table for spreadsheets: CSV or XLSX."""

from __future__ import annotations

import csv
import io
from pathlib import Path
from typing import TYPE_CHECKING

import xarray as xr

from ...fragility.exchange.curve_csv import guarded
from ...wording import confidence_text
from ...writing import write_bytes
from ..file.table import StudyError
from ..report.results_file import read_results
from ..store.content import check_content
from ..tables.pieces import Cell, PieceTable, piece_table
from ..text.names import clean
from ..text.words import level_text, reference_law
from .export import laws_of

if TYPE_CHECKING:
    from openpyxl.worksheet.worksheet import Worksheet

WIDEST = 40
"""Widest column of a sheet, characters."""


def write_pieces(result: Path, folder: Path, format_: str, model: str | None = None, verify: bool = False) -> Path:
    """Write the pieces of a performance study under one law into a folder, made where missing.

    Parameters
    ----------
    result : Path
        The results.
    folder : Path
        The folder for ``pieces.csv`` or ``pieces.xlsx``.
    format_ : {"csv", "xlsx"}
        A table with the units in its heading; or a workbook with that table and a sheet that says what it is of.
    model : str, optional
        Label of the law, or its short name for the first of its kind; the reference where not given.
    verify : bool
        Refuse results that were edited after they were written.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    StudyError
        One sentence: results that cannot be read, no such law, a file that cannot be written.

    Notes
    -----
    In a CSV file, texts that a spreadsheet would take for formulas begin with an apostrophe, as in exported curves.
    """
    with read_results(result) as results:
        check_content(result, results, verify)
        at = reference_law(results)[0] if model is None else int(laws_of(results, model, result)[0])
        found = piece_table(results, at)
        written = _csv(found) if format_ == "csv" else _xlsx(found, results, str(results["model"].values[at]))
    path = folder / f"pieces.{format_}"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        write_bytes(path, written)
    except OSError as error:
        raise StudyError(f"{path}: cannot be written ({error.strerror or error})") from None
    return path


def _csv(found: PieceTable) -> bytes:
    lines = io.StringIO()
    table = csv.writer(lines, lineterminator="\n")
    table.writerow(map(guarded, found.headings))
    for row in found.rows:
        table.writerow([guarded(one) if isinstance(one, str) else one for one in row])
    return lines.getvalue().encode()


def _xlsx(found: PieceTable, results: xr.Dataset, law: str) -> bytes:
    from openpyxl import Workbook  # noqa: PLC0415 - for this format alone

    book = Workbook()
    sheet = book.active
    assert sheet is not None
    sheet.title = "pieces"
    _fill(sheet, [[*found.headings], *found.rows])
    sheet.freeze_panes = "B2"
    about: list[list[Cell]] = [
        ["study", str(results.attrs.get("title", ""))],
        ["damping law", law],
        ["intensity measure", str(results["level"].attrs.get("long_name", results.attrs["im"]))],
        ["intervals", f"{confidence_text(results)}, over motions; the hazard curve, where there is one, as given"],
        ["chances, values and costs", "of one piece; savings and paybacks are of the line"],
        ["code requirements", "not checked"],
        ["toppling", str(results.attrs.get("toppling_version", ""))],
    ]
    if "item_rate" not in results and "at_level" in results.attrs:
        about.append(["level of shaking", _level(results)])
    _fill(book.create_sheet("about"), [["what", "is"], *about])
    held = io.BytesIO()
    book.save(held)
    return held.getvalue()


def _level(results: xr.Dataset) -> str:
    return f"{results.attrs['im']} = {level_text(float(results.attrs['at_level']), results['level'])}"


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
            if i == 1:
                cell.font = Font(bold=True)
    for j, column in enumerate(zip(*rows, strict=True), start=1):
        widest = max(len(value) if isinstance(value, str) else 12 for value in column)
        sheet.column_dimensions[get_column_letter(j)].width = min(WIDEST, widest + 2)
