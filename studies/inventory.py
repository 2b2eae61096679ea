"""An inventory from a CSV file, one line a kind of thing on a floor; what it says stands in `contents`."""

from __future__ import annotations

import csv
import difflib
import io
import os
import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NoReturn, TypeVar

from .. import checks
from ..models import Block, catalogue
from .contents import MAX_COUNT, MAX_ROWS, MAX_TEXT, MAX_VALUE, Contents, Inventory
from .tables import StudyError, shown

MAX_BYTES = 16 * 2**20

COLUMNS = (
    "item",
    "catalogue",
    "width_m",
    "height_m",
    "cm_height_m",
    "inertia_factor",
    "floor",
    "count",
    "e",
    "restitution",
    "value",
    "currency",
    "consequence",
    "anchored",
    "anchoring_cost",
)
"""Columns of an inventory file, in any order."""

Value = TypeVar("Value")


class InventoryError(StudyError):
    """An inventory that cannot be used; one sentence that names file, line, column, value and what is allowed."""


def read_inventory(path: str | os.PathLike[str], floors: Sequence[str] | None = None) -> Inventory:
    """An inventory from a CSV file.

    Parameters
    ----------
    path : path
        A table in UTF-8 separated by commas, semicolons or tabs, one line a kind of thing on a floor.
    floors : sequence of str, optional
        The floors that there are; any where not given.

    Returns
    -------
    Inventory

    Raises
    ------
    InventoryError
        One sentence that names file, line, column, value and what is allowed.

    Notes
    -----
    The header names the columns, in any order; empty cells are as if the column were not there, lines that start with
    # are comments:

    ================== ===============================================================================================
    ``item``           name in results; that in the catalogue where not given.  Where several lines have the same, their
                       floor is added
    ``catalogue``      name of a catalogue item, which gives the sizes
    ``width_m``,       or: full outer sizes, m, the width in the direction of shaking
    ``height_m``
    ``cm_height_m``    height of the centre of mass, m (mid-height), also beside ``catalogue``
    ``inertia_factor`` I_O/(m R²), above 1 to 2 (4/3); must be given with ``cm_height_m``
    ``floor``          where it stands: 0 is the ground (the only column that must be filled)
    ``count``          number of pieces (1)
    ``e``              restitution, above 0 to 1 (that of the damping law); ``restitution`` is the same
    ``value``          what is lost when a piece overturns
    ``currency``       of ``value`` and ``anchoring_cost``, the same in every line that states it, such as EUR
    ``consequence``    words for what it means when at least one piece overturns, such as blocks-exit; several are
                       separated by |
    ``anchored``       yes or no (no): anchored pieces do not overturn
    ``anchoring_cost`` cost of fixing a piece
    ================== ===============================================================================================

    Where semicolons or tabs separate, numbers may have decimal commas; a file has either commas or points.

    Examples
    --------
    >>> from toppling.studies.inventory import example_path
    >>> inventory = read_inventory(example_path())
    >>> len(inventory), inventory.pieces, inventory.currency
    (14, 54, 'EUR')
    """
    if not isinstance(path, str | os.PathLike):
        raise TypeError(f"path must be a path, got {type(path).__name__}")
    file = Path(path)
    table = _Table(file, _contents(file))
    found: list[tuple[_Line, Contents]] = []
    currency = ""
    for line in table:
        found.append((line, line.contents()))
        if floors is not None and str(found[-1][1].floor) not in floors:
            known = ", ".join(floors if len(floors) <= 12 else [*floors[:5], "…", floors[-1]])
            hint = "; give a building, or floor motions" if list(floors) == ["0"] else ""
            line.refuse("floor", f"must be one of {known}, got {shown(line.text('floor'))}{hint}")
        stated = line.text("currency")
        if stated and currency and stated != currency:
            line.refuse("currency", f"must be {currency!r} as in the lines above, got {stated!r}")
        currency = currency or stated
    if not found:
        raise InventoryError(f"{file}: has a header but no items")
    try:
        return Inventory(tuple(_told_apart(found)), currency)
    except ValueError as error:
        raise InventoryError(f"{file}: {error}") from None


def example_path() -> str:
    """Path of the example inventory (a small clinic) that ships with the package."""
    return str(Path(__file__).with_name("examples") / "inventory.csv")


def _told_apart(found: Sequence[tuple[_Line, Contents]]) -> Iterator[Contents]:
    """The rows with unique labels: the floor is added to those that several lines have."""
    lines: dict[str, list[_Line]] = {}
    for line, row in found:
        lines.setdefault(row.label, []).append(line)
    taken: dict[str, _Line] = {}
    for line, row in found:
        label = row.label if len(lines[row.label]) == 1 else f"{row.label}, floor {row.floor}"
        if label in taken:
            line.refuse("item", f"must be another name, {label!r} is taken by line {taken[label].number}")
        taken[label] = line
        yield replace(row, label=label)


class _Table:
    """The lines of an inventory file below its header."""

    def __init__(self, file: Path, text: str) -> None:
        self.file = file
        self.delimiter = _delimiter(text)
        self.decimal = ""  # "." or ",", once a number has shown which
        self._reader = csv.reader(io.StringIO(text, newline=""), delimiter=self.delimiter, strict=True)
        number, header = next(self._lines(), (0, []))
        if not header:
            raise InventoryError(f"{file}: empty")
        where = f"{file}, line {number}"
        self.columns = [self._column(name) for name in header]
        twice = next((name for i, name in enumerate(self.columns) if name and name in self.columns[:i]), None)
        if twice is not None:
            raise InventoryError(f"{where}: column {twice!r} stands there twice")
        if "floor" not in self.columns:
            raise InventoryError(f"{where}: column 'floor' is missing")
        if "catalogue" not in self.columns and not {"width_m", "height_m"} <= set(self.columns):
            raise InventoryError(f"{where}: columns must name catalogue, or width_m and height_m")

    def __iter__(self) -> Iterator[_Line]:
        for n, (number, cells) in enumerate(self._lines(), start=1):
            if n > MAX_ROWS:
                raise InventoryError(f"{self.file}: more than {MAX_ROWS} items")
            if len(cells) > len(self.columns) and any(cells[len(self.columns) :]):
                raise InventoryError(
                    f"{self.file}, line {number}: has {len(cells)} cells, the header names {len(self.columns)} columns"
                )
            named = {name: cell for name, cell in zip(self.columns, cells, strict=False) if name}
            yield _Line(self, number, named)

    def _lines(self) -> Iterator[tuple[int, list[str]]]:
        """Number and cells of each line that says something."""
        while True:
            try:
                cells = next(self._reader)
            except StopIteration:
                return
            except csv.Error as error:
                raise InventoryError(f"{self.file}, line {self._reader.line_num}: no CSV ({error})") from None
            cells = [cell.strip() for cell in cells]
            if any(cells):
                yield self._reader.line_num, cells

    def _column(self, heading: str) -> str:
        """The column that a heading names; '' for a column without a name, which must be empty."""
        name = heading.lower()
        if name in COLUMNS or not name:
            return name
        near = difflib.get_close_matches(name[:MAX_TEXT], COLUMNS, n=1, cutoff=0.5)
        hint = f"did you mean {near[0]!r}?" if near else f"allowed are {', '.join(COLUMNS)}"
        raise InventoryError(f"{self.file}, line {self._reader.line_num}: unknown column {shown(heading)}; {hint}")


@dataclass(frozen=True)
class _Line:
    """One line: its cells by column, and what they mean."""

    table: _Table
    number: int
    cells: dict[str, str]

    def refuse(self, column: str, what: str) -> NoReturn:
        raise InventoryError(f"{self.table.file}, line {self.number}, column {column!r}: {what}")

    def text(self, column: str) -> str:
        """A cell, '' where it is empty."""
        cell = self.cells.get(column, "")
        if len(cell) > MAX_TEXT or not cell.isprintable():
            self.refuse(column, f"must be at most {MAX_TEXT} printable characters, got {shown(cell)}")
        return cell

    def number_in(
        self,
        column: str,
        *,
        above: float | None = None,
        at_least: float | None = None,
        at_most: float | None = None,
    ) -> float | None:
        """A cell as a number, None where it is empty."""
        cell = self.text(column)
        if not cell:
            return None
        if not _NUMBER.fullmatch(cell) or ("," in cell and self.table.delimiter == ","):
            self.refuse(column, f"must be a number, got {shown(cell)}")
        mark = "," if "," in cell else "." if "." in cell else ""
        if mark == "," and _THOUSANDS.fullmatch(cell):
            plain = cell.replace(",", "")
            self.refuse(column, f"is ambiguous, write {plain} or {cell.replace(',', '.')}, got {shown(cell)}")
        if mark and self.table.decimal not in {"", mark}:
            self.refuse(column, f"must have its decimals as the numbers above ({self.table.decimal}), got {cell!r}")
        self.table.decimal = self.table.decimal or mark
        value = float(cell.replace(",", "."))
        return self.checked(
            column, lambda: checks.number(column, value, above=above, at_least=at_least, at_most=at_most)
        )

    def count_in(self, column: str) -> int | None:
        """A cell as a whole number, None where it is empty."""
        cell = self.text(column)
        if not cell:
            return None
        if not (cell.isascii() and cell.isdecimal() and len(cell) < 10):
            self.refuse(column, f"must be a whole number, got {shown(cell)}")
        return int(cell)

    def checked(self, column: str, made: Callable[[], Value]) -> Value:
        """What `made` returns; its ValueError as one of this line."""
        try:
            return made()
        except InventoryError:
            raise
        except ValueError as error:
            self.refuse(column, str(error).removeprefix(f"{column} "))

    def contents(self) -> Contents:
        """What the line describes."""
        block = self.block()
        floor = self.text("floor")
        if not floor:
            self.refuse("floor", "is empty: it must say where the item stands, 0 is the ground")
        if re.fullmatch(r"[-+]?[\d.,]+", floor) and not (floor.isascii() and floor.isdecimal() and len(floor) < 10):
            self.refuse("floor", f"must be a whole number from 0 (ground), or a name, got {shown(floor)}")
        if self.text("e") and self.text("restitution"):
            self.refuse("restitution", "is the same as e: give one of them")
        e_column = "restitution" if self.text("restitution") else "e"
        count = self.count_in("count")
        if count is not None and not 1 <= count <= MAX_COUNT:
            self.refuse("count", f"must be from 1 to {MAX_COUNT}, got {count}")
        anchored = self.text("anchored").lower()
        if anchored not in {"", *_YES, *_NO}:
            self.refuse("anchored", f"must be yes or no, got {shown(anchored)}")
        words = [word.strip().lower() for word in re.split(r"[|,;]", self.text("consequence"))]
        e = self.number_in(e_column, above=0.0, at_most=1.0)
        value = self.number_in("value", at_least=0.0, at_most=MAX_VALUE)
        cost = self.number_in("anchoring_cost", at_least=0.0, at_most=MAX_VALUE)
        return self.checked(
            "consequence",
            lambda: Contents(
                label=self.text("item") or self.text("catalogue") or f"line {self.number}",
                block=block,
                floor=int(floor) if floor.isdecimal() else floor,
                count=1 if count is None else count,
                e=e,
                value=0.0 if value is None else value,
                consequences=tuple(word for word in words if word),
                anchored=anchored in _YES,
                anchoring_cost=cost,
            ),
        )

    def block(self) -> Block:
        """The sizes."""
        name = self.text("catalogue")
        width, height = self.number_in("width_m", above=0.0), self.number_in("height_m", above=0.0)
        cm_height, factor = self.number_in("cm_height_m", above=0.0), self.number_in("inertia_factor", above=1.0)
        if name:
            if width is not None or height is not None:
                column = "width_m" if width is not None else "height_m"
                self.refuse(column, "must be empty beside a catalogue name, which gives the sizes")
            if name not in catalogue:
                near = difflib.get_close_matches(name, catalogue, n=1, cutoff=0.4)
                hint = f"; did you mean {near[0]!r}?" if near else ", `toppling catalogue` lists them"
                self.refuse("catalogue", f"there is no item {shown(name)}{hint}")
            width, height = catalogue[name].width, catalogue[name].height
        if width is None or height is None:
            column = "width_m" if width is None else "height_m"
            self.refuse(column, "is empty: a line needs a catalogue name, or width_m and height_m")
        try:
            return Block(width, height, cm_height, factor)
        except ValueError as error:
            word, _, what = str(error).partition(" ")
            named = {"width": "width_m", "height": "height_m", "cm_height": "cm_height_m"}.get(word, word)
            if named in COLUMNS:
                self.refuse(named, what)
            self.refuse("catalogue" if name else "width_m", str(error))


_NUMBER = re.compile(r"[-+]?(?:\d{1,30}[.,]?\d{0,30}|[.,]\d{1,30})(?:[eE][-+]?\d{1,3})?", re.ASCII)
_THOUSANDS = re.compile(r"[-+]?[1-9]\d{0,2},\d{3}", re.ASCII)
_YES = ("yes", "y", "true", "1")
_NO = ("no", "n", "false", "0")


def _contents(file: Path) -> str:
    """The file's text; InventoryError where it cannot be read."""
    try:
        if not file.is_file():
            raise InventoryError(f"{file}: {'not a file' if file.exists() else 'no such file'}")
        if file.stat().st_size > MAX_BYTES:
            raise InventoryError(f"{file}: larger than {MAX_BYTES // 2**20} MiB, no inventory is")
        text = file.read_bytes().decode("utf-8-sig")
    except UnicodeDecodeError:
        raise InventoryError(f"{file}: not a text file in UTF-8") from None
    except (OSError, ValueError) as error:
        if isinstance(error, InventoryError):
            raise
        raise InventoryError(f"{file}: cannot be read ({getattr(error, 'strerror', None) or error})") from None
    if "\0" in text:
        raise InventoryError(f"{file}: holds NUL characters, not a text file")
    # comments may hold quotes that are none: empty lines in their place keep the numbers of the others
    return re.sub(r"^[ \t]*#[^\r\n]*", "", text, flags=re.MULTILINE)


def _delimiter(text: str) -> str:
    """What separates the cells: the most frequent of , ; and tab in the header, outside quotes."""
    header = next((line for line in text.splitlines() if line.strip() and not line.lstrip().startswith("#")), "")
    bare = re.sub(r'"[^"]*"', "", header)
    return max((",", ";", "\t"), key=bare.count)
