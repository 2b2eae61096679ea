"""Sheets of workbooks (XLSX) as rows of text, as a CSV of the sheet; cells without a text are marked as errors."""

from __future__ import annotations

import datetime
import io
import re
import warnings
import zipfile
from typing import TYPE_CHECKING, Any

from ...core.doubts import first_of
from ...core.limits import checked_workbook

if TYPE_CHECKING:
    from openpyxl.worksheet.worksheet import Worksheet

SUFFIXES = (".xlsx", ".xlsm")
"""Names of workbooks end so; macros are not looked at."""
UNPACKED = 3
"""Most bytes of an unpacked workbook, over the most bytes of a table."""
MOST_ROWS = 2**20
"""Rows of a sheet (the format's own limit)."""
MOST_COLUMNS = 1024
"""Columns that a row may reach, including empty columns."""
_MULTIPLE = re.compile(
    r"%|‰|[.,' ]?0+|(?:k|t|m|tsd|thsd|thousands?|mio|mill|millions?|mn|mrd|bn)\.?\s?"
    r"(?:€|\$|£|¥|fr\.?|euro?|usd|gbp|chf|jpy|cny|inr|try|cad|aud|nzd|mxn|clp|sek|nok|dkk)?"
)
"""Texts of formats for numbers that are a multiple of the shown number, in lower case."""
_SCALED = re.compile(r"[0#?],+(?![0#?])")
"""Mark of a format that shows a number divided by thousands: then the number itself is whole."""
CURRENCIES = {
    "€": {"EUR"},
    "$": {"USD", "CAD", "AUD", "NZD", "MXN", "CLP"},
    "£": {"GBP"},
    "¥": {"JPY", "CNY"},
    "₹": {"INR"},
    "₺": {"TRY"},
    "₩": {"KRW"},
    "kr": {"SEK", "NOK", "DKK", "ISK"},
    "fr": {"CHF"},
    "zł": {"PLN"},
    "kč": {"CZK"},
    "euro": {"EUR"},
    "euros": {"EUR"},
}
"""Possible currencies of a sign or a word in a number format."""
_CODE = re.compile(r"(?<![A-Za-z])[A-Z]{3}(?![A-Za-z])")  # (of a currency)
_COUNTED = ("pc", "pcs", "ea", "x", "stk", "stück", "pieces", "items", "persons", "people")  # no units
_NO_SHARES = ("m", "cm", "mm", "days", "deg", "kg", "n", "value", "cost", "count", "floor", "exposed")
_SPELLED = {"m": ("metre", "metres", "meter", "meters"), "days": ("d", "day"), "deg": ("°",)}  # of units
_LITERAL = re.compile(r'"([^"]*)"|\\(.)|\[\$([^\]-]*)[^\]]*\]')
_OLD = b"\xd0\xcf\x11\xe0"


class WorkbookError(ValueError):
    """Error for a file that is no workbook that can be read: one clause, without the name of the file."""


class Unreadable(str):
    """A cell without a text: its content as far as a message shows it, and its problem."""

    __slots__ = ("why",)
    why: str

    @classmethod
    def cell(cls, text: object, why: str) -> Unreadable:
        """Return such a cell, whose text is never empty."""
        made = cls(str(text) or "?")
        made.why = why
        return made


class Numeric(str):
    """The text of a cell that is a number, and the unit and the sign of money that its format shows, '' for none."""

    __slots__ = ("money", "unit")
    money: str
    unit: str

    @classmethod
    def cell(cls, text: str, format_code: str) -> Numeric:
        """Return such a cell, of a number format such as ``0.0" cm"``."""
        made = cls(text)
        code = format_code.partition(";")[0]
        literals = "".join(map("".join, _LITERAL.findall(code)))
        bare = re.sub(r"[_*].", "", _LITERAL.sub("", code))  # (without padding)
        shown = literals.strip().lower()
        words = re.findall(r"[^\W\d_]+", shown)
        signs = [sign for sign in CURRENCIES if (sign in words if sign.isalpha() else sign in shown + bare)]
        made.money = next(iter([*_CODE.findall(literals), *signs]), "")
        rest = shown.replace(made.money.lower(), "").strip(" .,'()-–\u00a0\u202f")
        scaled = _SCALED.search(bare)
        if format_code.startswith(";"):
            shown = rest = "no digits"
        if _MULTIPLE.fullmatch(shown):
            rest = "" if scaled else shown
        elif scaled:  # (a person sees 450 where the number is 450000)
            rest = shown = f"thousands {shown}".strip()
        marked = bare.strip().startswith("-") or re.search(r"""['′″]["\s)]*$""", code)  # (below zero; feet and inches)
        made.unit = (shown or "-") if rest or marked else "%" if "%" in bare else ""
        return made

    def is_in(self, heading: str) -> bool:
        """True if the number is shown in the unit of a heading such as ``width_m``, or in none."""
        unit = self.unit.strip(" .")
        of_heading = heading.rpartition("_")[2]
        if unit == "%":
            return of_heading not in _NO_SHARES
        return not self.unit or unit in (of_heading, *_SPELLED.get(of_heading, ()), *_COUNTED)


def sheet_rows(
    content: bytes, sheet: str, most_bytes: int, most_rows: int
) -> tuple[list[tuple[int, list[str]]], list[str], list[str]]:
    """Return the rows of a sheet that are not empty, its comments, and sentences on differences from its display.

    The sheet has the name `sheet`, in any case; without such a sheet, the first sheet that is not hidden is read. A
    table has at most `most_bytes`; a workbook may be UNPACKED times as large once it is unpacked. Reading ends after
    `most_rows` rows below the header, and one more. Rows are numbered as in the sheet, from 1, with cells up to the
    last that is not empty. A row whose first cell begins with # is a comment. Cells without a text are `Unreadable`,
    numbers `Numeric`. The sentences are on hidden rows, columns and sheets that are read, and on visible sheets that
    are not.
    """
    if content.startswith(_OLD):
        raise WorkbookError("an old workbook (XLS), or one with a password; save it as XLSX without a password")
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as parts:
            checked = checked_workbook(parts, UNPACKED * most_bytes, WorkbookError)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # (of drawings and extensions, which do not matter here)
            return _rows(checked, sheet, most_rows)
    except (WorkbookError, MemoryError):
        raise
    except zipfile.BadZipFile:
        raise WorkbookError("not a workbook (XLSX), or a damaged one") from None
    except Exception as error:  # (the library raises whatever it stumbles over)
        raise WorkbookError(f"not a workbook (XLSX) that can be read ({type(error).__name__})") from None


def _rows(content: io.BytesIO, name: str, most_rows: int) -> tuple[list[tuple[int, list[str]]], list[str], list[str]]:
    from openpyxl import load_workbook  # noqa: PLC0415 - for workbooks alone

    # (values and formulas are two readings of one file; merged cells are in the second alone)
    values = load_workbook(content, read_only=True, data_only=True, keep_links=False)
    titles = {sheet.title.lower(): sheet.title for sheet in values.worksheets}
    seen = [sheet.title for sheet in values.worksheets if sheet.sheet_state == "visible"]
    if name.lower() not in titles and not seen:
        raise WorkbookError("a workbook without a sheet to be seen")
    title = titles.get(name.lower()) or seen[0]
    formulas = load_workbook(io.BytesIO(content.getbuffer()), keep_links=False)[title]
    merged = {(merge.min_row, merge.min_col): merge.coord for merge in formulas.merged_cells.ranges}
    sheet = values[title]
    sheet.reset_dimensions()  # (stated sizes are wrong in files of some programs)
    rows: list[tuple[int, list[str]]] = []
    comments: list[str] = []
    for n, row in enumerate(sheet.iter_rows(), start=1):
        if n > MOST_ROWS or len(row) > MOST_COLUMNS:
            raise WorkbookError(f"row {n} reaches beyond {MOST_ROWS:,} rows or {MOST_COLUMNS:,} columns of its sheet")
        if row and row[0].data_type != "e" and str(row[0].value or "").lstrip().startswith("#"):
            # a comment is alone in its row; in a table of pieces such a row would be a piece that is left out silently
            if rows and any(cell.value is not None for cell in row[1:]):
                raise WorkbookError(
                    f"row {n} begins with #, as comments do, and has other cells: rename it or empty them"
                )
            comments.append(str(row[0].value).strip())
            continue
        cells = [_text(cell, formulas, merged) for cell in row]
        if any(cells):
            while not cells[-1]:
                cells.pop()
            number = next(cell.row for cell in row if hasattr(cell, "row"))
            rows.append((number or n, cells))
            if len(rows) > most_rows + 1:
                break
    # (a note at a heading is of its numbers: "in feet")
    notes = (cell.comment for cell in formulas[rows[0][0]]) if rows else ()
    comments += [re.sub(r"^in\b", "numbers in", note.text) for note in notes if note is not None]
    others = [
        repr(other.title)
        for other in values.worksheets
        if other.title in seen and other.title != title
        if any(cell is not None for row in other.iter_rows(values_only=True) for cell in row)
    ]
    unread = [f"only the sheet {title!r} is read, not {first_of(others)}"] if others else []
    return rows, comments, _hidden(formulas, rows) + unread


def _hidden(sheet: Worksheet, rows: list[tuple[int, list[str]]]) -> list[str]:
    """Return a sentence on each kind of hidden or struck-out cells that are read."""
    columns = [
        letter
        for letter, of in sorted(sheet.column_dimensions.items())
        if of.hidden and any(any(cells[(of.min or 1) - 1 : of.max]) for _, cells in rows)
    ]
    # (the library's rows look through all cells for the last column, row after row)
    struck = [
        str(number)
        for number, cells in rows
        if any(sheet.cell(number, column).font.strike for column, text in enumerate(cells, start=1) if text)
    ]
    hidden = {
        "struck-out row": struck,
        "hidden row": [str(number) for number, _ in rows if sheet.row_dimensions[number].hidden],
        "hidden column": columns,
        "hidden sheet": [repr(sheet.title)] if sheet.sheet_state != "visible" else [],
    }
    return [
        f"{what}{'s' if len(names) > 1 else ''} {first_of(names)} {'are' if len(names) > 1 else 'is'} read, too"
        for what, names in hidden.items()
        if names
    ]


def _text(cell: Any, formulas: Worksheet, merged: dict[tuple[int, int], str]) -> str:
    """Return the text of a cell, '' if it is empty."""
    value = cell.value
    if value is None:
        # (a formula whose value is the empty text has a type, and no value either)
        if hasattr(cell, "row") and cell.data_type == "n" and formulas.cell(cell.row, cell.column).data_type == "f":
            return Unreadable.cell("=", "has a formula without a value: open the workbook, let it calculate, save it")
        return ""
    if (cell.row, cell.column) in merged:
        return Unreadable.cell(value, f"is merged with others ({merged[cell.row, cell.column]}): fill each cell alone")
    if cell.data_type == "e":
        return Unreadable.cell(value, f"holds the error {value}")
    if isinstance(value, datetime.date | datetime.time | datetime.timedelta):
        shown = str(value).removesuffix(" 00:00:00")
        return Unreadable.cell(shown, f"must be text or a number, got the date or time {shown}")
    if isinstance(value, bool):
        return str(value).upper()
    if isinstance(value, int | float):
        whole = isinstance(value, int) or (value.is_integer() and abs(value) < 2**53)
        return Numeric.cell(str(int(value)) if whole else repr(value), cell.number_format or "")
    return str(value).strip()
