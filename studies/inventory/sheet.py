"""An inventory as the page edits it: the cells of a dropped table as text, written as the CSV file that is read."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from ...motions.readers.lines import THOUSANDS
from ..file.csv_table import CsvTable
from ..file.table import MAX_TEXT
from ..file.workbook import Numeric, Unreadable
from ..text.error import StudyError
from .reading import KIND, InventoryError, _currencies

UNMENDED = "\x7f"
"""End of a cell without a form as text: readers refuse it until someone types it again."""
HEADING = "h"
PLACE = re.compile(r", (?:line|row) (\d+)(?:, column '([^']*)'|: (?:unknown column|the heading) '([^']*)')?")


class Sheet(NamedTuple):
    """Headings, lines of cells, the separator of the file, and input warnings on what the cells do not show."""

    headings: list[str]
    lines: list[list[str]]
    separator: str
    doubts: list[str]

    @classmethod
    def read(cls, name: str, content: bytes) -> Sheet:
        """Return the table of a CSV file or a workbook; InventoryError if it is no inventory."""
        table = _Cells(name, content)
        if not {*table.columns} & {*KIND.columns}:
            raise InventoryError(f"{table.where}: must name columns of an inventory, such as item, catalogue and floor")
        signs = {cell.money for cells in table.rows for cell in cells if isinstance(cell, Numeric) and cell.money}
        at = table.columns.index("currency") if "currency" in table.columns else MAX_TEXT
        stated = {cells[at] for cells in table.rows if at < len(cells) and cells[at]}
        mixed = bool(signs) and not set.intersection(*map(_currencies, signs | stated))
        lines = []
        for cells in table.rows:
            headings = [*table.columns, *[""] * len(cells)]
            lines.append([_plain(cell, heading, mixed) for cell, heading in zip(cells, headings, strict=False)])
        return cls([*map(str, table.columns)], lines, table.delimiter, table.sentences)

    @property
    def content(self) -> bytes:
        """The table as a CSV file; a line that begins with # is in quotes, or it would be a comment."""
        text = io.StringIO()
        plain, quoted = (
            csv.writer(text, delimiter=self.separator, lineterminator="\n", quoting=quoting)
            for quoting in (csv.QUOTE_MINIMAL, csv.QUOTE_ALL)
        )
        for cells in (self.headings, *self.lines):
            (quoted if cells[0].startswith("#") else plain).writerow(cells)
        return text.getvalue().encode("utf-8", "replace")

    @property
    def shape(self) -> tuple[int, int]:
        """Numbers of lines and columns."""
        return len(self.lines), len(self.headings)

    def line(self, text: str) -> int:
        """Return the position of a line; StudyError if there is none."""
        if whole_number(text) >= len(self.lines):
            raise StudyError("the table has no such line")
        return int(text)

    def cell(self, line: int, column: str) -> str:
        """Return a cell of a line by its heading, '' if there is none."""
        at = self.headings.index(column) if column in self.headings else len(self.lines[line])
        return self.lines[line][at] if at < len(self.lines[line]) else ""

    def differences(self, other: Sheet, columns: Sequence[str]) -> dict[int, dict[str, str]]:
        """Return the cells of some columns of another table of these lines that differ from this table."""
        lines = range(len(self.lines) if len(other.lines) == len(self.lines) else 0)
        others = {i: {name: other.cell(i, name) for name in columns if other.cell(i, name)} for i in lines}
        changed = {i: {name: text for name, text in others[i].items() if text != self.cell(i, name)} for i in lines}
        return {i: cells for i, cells in changed.items() if cells}

    def with_text(self, line: int, column: str, text: str) -> Sheet:
        """Return the table with a cell of another text, and with its column."""
        named = self if column in self.headings else self._replace(headings=[*self.headings, column])
        return named.edited(str(line), str(named.headings.index(column)), text)

    def edited(self, line: str, column: str, text: str | None) -> Sheet:
        """Return the table with another text of a cell or a heading; None removes the line, as a line of no text is."""
        typed = "".join(filter(str.isprintable, text or "")).strip()
        if len(typed) > MAX_TEXT:
            raise StudyError(f"a cell must have at most {MAX_TEXT} characters, got {len(typed):,}")
        at = whole_number(column) if text is not None else 0
        widest = max(map(len, (self.headings, *self.lines)))
        if at > widest:
            raise StudyError("the table has no such column")
        if line == HEADING:
            if typed and typed in self.headings:
                raise StudyError(f"column {typed!r} stands there already")
            return self._replace(headings=_with(self.headings, at, typed))
        i = self.line(line)
        cells = [] if text is None else _with(self.lines[i], at, typed)
        return self._replace(lines=[*self.lines[:i], *([cells] if any(cells) else []), *self.lines[i + 1 :]])

    def place(self, sentence: str) -> tuple[int | None, str]:
        """Return the line that a refusal of the file names, None for the heading, and the name of its cell."""
        place = PLACE.match(sentence)
        line = int(place[1]) - 2 if place else len(self.lines)
        if place is None or line >= len(self.lines):
            return None, ""
        name = place[2] or place[3]
        at = f"{self.headings.index(name)}" if name in self.headings else ""
        return (None, f"{HEADING}-{at}") if line < 0 else (line, f"{line}-{at}")


class _Cells(CsvTable):
    """A dropped table with any headings: what is wrong with it is for the reader of the file of the page."""

    def __init__(self, name: str, content: bytes) -> None:
        self._bytes = content
        super().__init__(Path(name), KIND)
        self.rows = [cells for _, cells in self._lines]
        if len(self.rows) > KIND.most_rows:
            raise InventoryError(f"{name}: more than {KIND.most_rows:,} {self.word}s")
        self.sentences = [doubt.sentence for doubt in self.doubts()]

    def _content(self) -> bytes:
        return self._bytes

    def _column(self, heading: str, alone: bool = False) -> str:
        return next((name for name in KIND.columns if name.lower() == heading.lower()), heading)


def whole_number(text: str) -> int:
    """Return the number that a text is; StudyError if it is not whole."""
    if not (text.isascii() and text.isdecimal() and len(text) <= 6):
        raise StudyError(f"line: must be a whole number, got {text[:40]!r}")
    return int(text)


def _with(cells: list[str], at: int, text: str) -> list[str]:
    padded = [*cells, *[""] * (at + 1 - len(cells))]
    return [*padded[:at], text, *padded[at + 1 :]]


def _plain(cell: str, heading: str, mixed: bool) -> str:
    """Return a cell as text; a cell that no text can give ends with `UNMENDED`, after the reason."""
    if isinstance(cell, Unreadable):
        return f"{cell} [{cell.why}]{UNMENDED}"
    if isinstance(cell, Numeric) and ((mixed and cell.money) or not cell.is_in(heading)):
        return f"{cell} [{cell.unit or cell.money}]{UNMENDED}"
    if isinstance(cell, Numeric) and THOUSANDS.fullmatch(cell):
        return f"{cell}0"  # (a number of a workbook is never thousands: 1.234 as text may be)
    return re.sub(r"[\r\n]+", UNMENDED, cell)  # (a line of the file is a line of the table)
