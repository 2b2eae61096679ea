"""Tables of results for spreadsheets: the pieces of a performance study (CSV or XLSX), or blocks' rates (XLSX)."""

from __future__ import annotations

import io
import re
import zipfile
from pathlib import Path
from typing import TYPE_CHECKING

import xarray as xr

from ...core.wording import confidence_text
from ...core.writing import write_bytes
from ..report.results_file import read_results
from ..store.content import check_content
from ..store.outputs import own_files
from ..tables.fragility import rate_values
from ..tables.kits import kit_table
from ..tables.pieces import piece_table
from ..tables.values import Cell, ValueTable, csv_bytes
from ..text.error import StudyError, writing
from ..text.names import clean
from ..text.spread import MODEL_RANGE, of_what
from ..text.words import axis_of, level_name, level_text, reference_law
from .export import PERFORMANCE, laws_of

if TYPE_CHECKING:
    from openpyxl.worksheet.worksheet import Worksheet

_TIME = re.compile(rb"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\dZ")
SMALL = 1e-3
"""Chances below which a workbook shows four decimals of a per cent."""
LARGE = 10.0
"""Numbers from which one decimal is shown; smaller ones have four, chances are in per cent."""
WIDEST = 40
"""Widest column of a sheet, characters."""


def write_pieces(result: Path, folder: Path, format_: str, model: str | None = None, verify: bool = False) -> Path:
    """Write the table of a performance study's pieces under one law, or of blocks' rates; return the file.

    A CSV file is in SI units, and ``kits.csv`` holds the kits; an XLSX workbook has sheets of that table, of it in
    units of the tables, of kits, and on its contents.  In a CSV file, texts that a spreadsheet would take for
    formulas begin with an apostrophe.
    """
    with read_results(result) as results:
        check_content(result, results, verify)
        name, found, about, kits = _table(results, result, model, readable=format_ == "xlsx")
        files = {f"{name}.{format_}": csv_bytes(found) if format_ == "csv" else _xlsx(name, found, about, kits)}
        if kits is not None and format_ == "csv":
            files["kits.csv"] = csv_bytes(kits)
    path = folder / f"{name}.{format_}"
    with writing(path), own_files(folder, f"export {format_} {name}", [*files]):
        for own, written in files.items():
            write_bytes(folder / own, written)
    return path


def _table(
    results: xr.Dataset, path: Path, model: str | None, readable: bool
) -> tuple[str, ValueTable, list[list[Cell]], ValueTable | None]:
    """Return what a table is of, the table, what it rests on, and the table of kits where there are any."""
    about: list[list[Cell]] = [
        ["study", str(results.attrs.get("title", ""))],
        ["intensity measure", str(axis_of(results).attrs.get("long_name", results.attrs.get("im", "")))],
        ["intervals", f"{confidence_text(results)} for the number of motions; hazard curves as given"],
    ]
    beta = float(results.attrs.get("modelling_dispersion", 0.0))
    held = f"β_m = {beta:g}" if beta else "none in rates and chances"
    if beta and str(results.attrs.get("modelling")) == "fractiles":
        held = f"β_m = {beta:g} in ranges over branches, none in other rates and chances"
    about.append(["modelling uncertainty", held])
    if of_what(results):
        about.append([MODEL_RANGE, of_what(results)])
    version: list[Cell] = ["toppling", str(results.attrs.get("toppling_version", ""))]
    if str(results.attrs["kind"]) != PERFORMANCE:
        if "rate" not in results or "block" not in results["rate"].dims:
            raise StudyError(
                f"{path}: --format xlsx is for pieces and annual rates, and there is no [hazard]: csv holds curves"
            )
        laws = None if model is None else laws_of(results, model, path).tolist()
        about += [["chances", "of at least one fall, from the annual rate"], version]
        return "rates", rate_values(results, laws), about, None
    at = reference_law(results)[0] if model is None else int(laws_of(results, model, path)[0])
    code = f"{results.attrs['code']} ({results.attrs['code_site']})" if "code" in results.attrs else "not checked"
    about += [
        ["damping law", str(results["model"].values[at])],
        ["chances, values and costs", "of one piece; savings and paybacks are of the line"],
        ["code requirements", code],
        version,
    ]
    if "item_rate" not in results and "at_level" in results.attrs:
        about.append(["level of shaking", _level(results)])
    return "pieces", piece_table(results, at, readable), about, kit_table(results, at)


def _xlsx(name: str, found: ValueTable, about: list[list[Cell]], kits: ValueTable | None) -> bytes:
    from openpyxl import Workbook  # noqa: PLC0415 - for this format alone

    book = Workbook()
    sheet = book.active
    assert sheet is not None
    sheet.title = name
    _fill(sheet, [[*found.headings], *found.rows])
    sheet.freeze_panes = "B2"
    sheet.auto_filter.ref = sheet.dimensions
    if kits is not None:
        _fill(book.create_sheet("kits"), [[*kits.headings], *kits.rows])
    _fill(book.create_sheet("about"), [["what", "is"], *about])
    held = io.BytesIO()
    book.save(held)
    return timeless(held.getvalue())


def timeless(book: bytes) -> bytes:
    """Return a workbook without the time of writing, so that the same results give the same bytes."""
    held = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(book)) as old, zipfile.ZipFile(held, "w", zipfile.ZIP_DEFLATED) as new:
        for name in old.namelist():
            text = old.read(name)
            if name == "docProps/core.xml":
                text = _TIME.sub(b"1980-01-01T00:00:00Z", text)
            new.writestr(zipfile.ZipInfo(name), text, zipfile.ZIP_DEFLATED)
    return held.getvalue()


def _level(results: xr.Dataset) -> str:
    return f"{level_name(results)} = {level_text(float(results.attrs['at_level']), results['level'])}"


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
