"""Tables in CSV files and workbooks, one thing per line: cells by column, and errors that name line and column."""

import csv
import io
import re
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Any, NamedTuple, NoReturn, TypeVar, get_args

from pydantic import ValidationError

from ...core import checks
from ...core.doubts import Doubt, first_of, warn
from ...core.limits import whole_content
from ...motions.readers.lines import DECIMALS, THOUSANDS
from ..text.error import StudyError
from .refusals import refusal
from .table import MAX_TEXT, Table, WordChoice, bare, meant, shown, unended
from .workbook import MOST_COLUMNS, SUFFIXES, Numeric, Unreadable, WorkbookError, sheet_rows

Value = TypeVar("Value")
Made = TypeVar("Made", bound=Table)


class TableKind(NamedTuple):
    """A kind of table: its name, columns, largest size, and its sheet in a workbook; without one it is text alone."""

    name: str
    columns: tuple[str, ...]
    most_rows: int
    most_bytes: int
    error: type[StudyError] = StudyError
    sheet: str | None = None


class CsvTable:
    """The lines of a file below its header, which names the columns in any order.

    A table in UTF-8 is separated by commas, semicolons or tabs. Empty lines and lines that begin with # are skipped,
    and empty cells are treated as if the column were missing. A workbook's sheet is read as if it had been saved so.
    Errors are of the kind's own type, one sentence that names the file, and line and column if known. Lines that a
    spreadsheet program may show differently cause input warnings of the kind ``table``, once all lines are read.
    """

    def __init__(self, file: Path, kind: TableKind) -> None:
        self.file, self.kind = file, kind
        self.decimal = ""  # "." or ",", once a number has shown which
        self.unsure: dict[str, CsvLine] = {}  # the first 1.200 of columns
        self.decimals: set[str] = set()  # columns with other decimals
        self._short: list[int] = []
        self._odd: list[str] = []
        raw = ""
        if kind.sheet is not None and file.suffix.lower() in SUFFIXES:
            self.word, self.delimiter = "row", ","  # (no decimal commas: numbers of a workbook are no text)
            self._whole = ""
            rows, comments, self._odd = self._sheet(kind.sheet)
            self._lines = iter(rows)
        else:
            raw = self._text()
            # (quotes in comments do not quote; empty lines in their place keep the numbers of the other lines)
            self._whole = text = _COMMENT.sub(r"\1", raw)
            comments = [match[0].strip() for match in _COMMENT.finditer(raw)]
            # (line by line, as csv reads: the header, of , ; or tab, does not need all lines of a large file)
            lines = (line.group() for line in re.finditer(r"[^\r\n]+", text))
            heading = next((line for line in lines if line.strip() and not line.lstrip().startswith("#")), "")
            if "|" in heading and not set(",;\t") & set(heading):
                raise kind.error(
                    f"{file}: columns must be separated by commas, semicolons or tabs, got {shown(heading)}"
                )
            bare = re.sub(r'"[^"]*"', "", heading)
            self.word, self.delimiter = "line", max((",", ";", "\t"), key=bare.count)
            self._lines = self._read(text)
        number, header = next(self._lines, (0, []))
        if not header:
            raise kind.error(f"{file}: empty")
        self.where, self._header_line = self.at(number), number
        if len(header) > MOST_COLUMNS:
            raise kind.error(f"{self.where}: has {len(header):,} columns, at most {MOST_COLUMNS:,} are read")
        self.columns = [self._column(name, len(header) == 1) for name in header]
        twice = next((name for i, name in enumerate(self.columns) if name and name in self.columns[:i]), None)
        if twice is not None:
            raise kind.error(f"{self.where}: column {twice!r} stands there twice")
        self._odd += self._lines_left_out(raw) + self._other_units(comments)

    def at(self, number: int) -> str:
        """Return the words for the place of a line in the file."""
        return f"{self.file}, {self.word} {number}"

    @property
    def text_below(self) -> str:
        """The text below the header, without comments; '' of a workbook."""
        ends = re.finditer(r"\r\n|\r|\n", self._whole)
        last = next(islice(ends, self._header_line - 1, None), None) if self._header_line else None
        return "" if last is None else self._whole[last.end() :]

    def _lines_left_out(self, raw: str) -> list[str]:
        """Return the input warning on comments that a spreadsheet program shows as lines: ``#3 rack;0.5;1.8``."""
        lines = []
        for n, line in enumerate(io.StringIO(raw, newline="") if "#" in raw else (), start=1):
            if n > self._header_line and _MARKED.match(line) and line.count(self.delimiter) >= len(self.columns) - 1:
                lines.append(str(n))
        return [f"{self._named('line', lines)}: left out, since # begins a comment"] if lines else []

    def _other_units(self, comments: Iterable[str]) -> list[str]:
        """Return the input warning on a comment about units, which nothing applies: ``# sizes in feet``."""
        match = next((match for match in map(_OTHER_UNITS.search, comments) if match), None)
        if match is None:
            return []
        return [
            f"{self.file.name}: a comment says {shown(match[0])}, which is not applied: are the numbers in the units "
            "of their headings?"
        ]

    def _named(self, word: str, numbers: list[str]) -> str:
        return f"{self.file.name}, {word}{'s' if len(numbers) > 1 else ''} {first_of(numbers)}"

    def doubts(self) -> list[Doubt]:
        """Return the input warnings on the table, once it is read."""
        odd = list(self._odd)
        if self._short:
            numbers = [str(number) for number in self._short]
            have = "have" if len(numbers) > 1 else "has"
            odd.append(
                f"{self._named('line', numbers)} {have} fewer cells than the header: the others are assumed to be empty"
            )
        cut = self._whole[-1:].isdecimal()
        return [*(Doubt("table", sentence) for sentence in odd), *[unended(self.file.name)] * cut]

    def __iter__(self) -> "Iterator[CsvLine]":
        named = max((i for i, name in enumerate(self.columns, start=1) if name), default=0)
        for n, (number, cells) in enumerate(self._lines, start=1):
            if n > self.kind.most_rows:
                raise self.kind.error(f"{self.file}: more than {self.kind.most_rows:,} {self.word}s")
            if len(cells) > len(self.columns) and any(cells[len(self.columns) :]):
                raise self.kind.error(
                    f"{self.at(number)}: has {len(cells)} cells, the header names {len(self.columns)} columns"
                )
            if any(cell for name, cell in zip(self.columns, cells, strict=False) if not name):
                raise self.kind.error(f"{self.at(number)}: has a cell below a heading without a name")
            line = CsvLine(self, number, {name: cell for name, cell in zip(self.columns, cells, strict=False) if name})
            for name, cell in line.cells.items():
                if isinstance(cell, Unreadable):
                    line.refuse(name, cell.why)
                if isinstance(cell, Numeric) and not cell.is_in(name):
                    line.refuse(name, f"must be in the unit of its heading, got {cell} shown in {cell.unit}")
            if self._whole and len(cells) < named:
                self._short.append(number)
            yield line
        for column, line in self.unsure.items():
            if self.decimal != "." or (column in MONEY and column not in self.decimals):
                line.refuse_ambiguous(column)
            if column.endswith(_LARGE) and column not in self.decimals and float(line.text(column)) < LESS:
                what = f"{column} has three digits behind all points ({line.text(column)})"
                self._odd.append(f"{self._named(self.word, [str(line.number)])}: {what}: thousands? Leave points out")
        warn(self.doubts())

    def _read(self, text: str) -> Iterator[tuple[int, list[str]]]:
        """Yield the number and the cells of each line of a text that is not empty."""
        source = io.StringIO(text, newline="")
        reader = csv.reader(source, delimiter=self.delimiter, strict=True)
        ended, width = text.endswith(("\n", "\r")), 0
        while True:
            try:
                cells = next(reader)
            except StopIteration:
                return
            except csv.Error as error:
                raise self.kind.error(f"{self.at(reader.line_num)}: no CSV ({error})") from None
            cells = [cell.strip() for cell in cells]
            if any(cells):
                width = width or len(cells)
                if len(cells) < width and not ended and source.tell() == len(text):
                    raise self.kind.error(
                        f"{self.at(reader.line_num)}: has {len(cells)} of {width} cells and no line end: the file is "
                        "cut; save it again"
                    )
                yield reader.line_num, cells

    def _sheet(self, name: str) -> tuple[list[tuple[int, list[str]]], list[str], list[str]]:
        """Return the numbers and cells of the nonempty rows of a workbook's sheet, its comments, and notes."""
        content = self._content()
        try:
            rows, comments, odd = sheet_rows(content, name, self.kind.most_bytes, self.kind.most_rows)
            return rows, comments, [f"{self.file.name}: {sentence}" for sentence in odd]
        except WorkbookError as wrong:
            raise self.kind.error(f"{self.file}: {wrong}") from None

    def _column(self, heading: str, alone: bool = False) -> str:
        """Return the column that a heading names; '' for a column without a name, which must be empty."""
        known = self.kind.columns
        if isinstance(heading, Unreadable):
            raise self.kind.error(
                f"{self.where}: the heading {shown(heading)} {heading.why}; titles above begin with #"
            )
        name = next((column for column in known if column.lower() == heading.lower()), None)
        if name is not None or not heading:
            return name or ""
        hint = meant(heading[:MAX_TEXT], known) or f"allowed are {', '.join(known)}: rename it, or leave it out"
        if alone:
            hint = "titles above the heading begin with #"
        raise self.kind.error(f"{self.where}: unknown column {shown(heading)}; {hint}")

    def _content(self) -> bytes:
        """Return the bytes of the file."""
        return whole_content(self.file, self.kind.most_bytes, self.kind.name, self.kind.error)

    def _text(self) -> str:
        """Return the text of the file."""
        file, error = self.file, self.kind.error
        content = self._content()
        if content.startswith(b"PK"):
            name = "" if self.kind.sheet is None else "name a workbook .xlsx, or "
            raise error(f"{file}: a workbook or archive, no text; {name}save its sheet as CSV in UTF-8")
        try:
            text = content.decode("utf-8-sig")
        except UnicodeDecodeError:
            raise error(f"{file}: not a text file in UTF-8; save it as CSV in UTF-8") from None
        if "\0" in text:
            raise error(f"{file}: holds NUL characters, not a text file")
        return text


@dataclass(frozen=True)
class CsvLine:
    """One line: its cells by column, read as text, numbers or counts."""

    table: CsvTable
    number: int
    cells: dict[str, str]

    def refuse(self, column: str, what: str) -> NoReturn:
        """Raise an error about a cell, or about the line if no column is named."""
        of = f", column {column!r}" if column else ""
        raise self.table.kind.error(f"{self.table.at(self.number)}{of}: {what}")

    def made(self, table: type[Made], make: Callable[[Made], Value]) -> Value:
        """Return the object made of the table whose keys are columns; an error names its cell."""
        values = self._values(table)
        try:
            return make(table.model_validate(values))
        except self.table.kind.error:
            raise
        except ValidationError as error:
            words = refusal(error, values, table)[0]
        except ValueError as error:
            words = str(error)
        column, what = self._column_of(words, values)
        return self.refuse(column, what)

    def _column_of(self, sentence: str, given: Iterable[str]) -> tuple[str, str]:
        """Return the column at the start of a sentence, or the first given of several named columns, and the rest."""
        word, _, what = sentence.partition(" ")
        known = (*self.table.columns, *self.table.kind.columns)
        column = next((key for key in known if word.rstrip(":") in (key, bare(key))), "")
        if column:
            return column, what
        things = {key.partition("_")[0]: key for key in given}
        return next((things[word] for word in re.findall(r"\w+", sentence) if word in things), ""), sentence

    def _values(self, table: type[Table]) -> dict[str, Any]:
        """Return the cells that are not empty, as the keys of a table are."""
        cells: dict[str, Any] = {}
        for name, field in table.model_fields.items():
            key = field.alias or name
            if self.cells.get(key):
                kind = _kind_of(field.annotation)
                readers: dict[Any, Callable[[str], Any]] = {float: self.number_in, bool: self.yes_in, str: self.text}
                value = readers.get(kind, self.count_in)(key)
                words = [part.allowed for part in field.metadata if isinstance(part, WordChoice)]
                if kind is str and _PLACEHOLDER.fullmatch(value):
                    self.refuse(key, f"must be written out, or left empty if it does not apply, got {shown(value)}")
                cells[key] = value.lower() if words and value.lower() in words[0] else value
        return cells

    def text(self, column: str) -> str:
        """Return the text of a cell, '' if it is empty."""
        cell = self.cells.get(column, "")
        if len(cell) > MAX_TEXT or not cell.isprintable():
            self.refuse(column, f"must be at most {MAX_TEXT} printable characters, got {shown(cell)}")
        return str(cell)

    def name_in(self, column: str) -> str:
        """Return the name of the object of a line, which is no line of totals."""
        name = self.text(column)
        if _TOTAL.fullmatch(name):
            self.refuse(column, f"must be a piece, got {shown(name)}: leave totals out")
        return name

    def number_in(
        self, column: str, *, above: float | None = None, at_least: float | None = None, at_most: float | None = None
    ) -> float | None:
        """Return a cell as a number, None if it is empty."""
        cell = self.cells.get(column, "")
        known = _NUMBER.fullmatch(cell) and not ("," in cell and self.table.delimiter == ",")
        if not known and _MARKS.fullmatch(cell):  # (no-break blanks, too)
            remedy = DECIMALS if self.table.delimiter == "," else "write thousands without a mark"
            self.refuse(column, f"must be a number, got {shown(cell)}: {remedy}")
        if not self.text(column):
            return None
        if not known:
            self.refuse(column, f"must be a number, got {shown(cell)}")
        if not isinstance(self.cells[column], Numeric):
            self._check_mark(column, cell)
        value = float(cell.replace(",", "."))
        return self.checked(
            column, lambda: checks.number(column, value, above=above, at_least=at_least, at_most=at_most)
        )

    def _check_mark(self, column: str, cell: str) -> None:
        """Refuse decimals that are not marked as those above, and numbers that may have no decimals at all."""
        table, mark = self.table, "," if "," in cell else "." if "." in cell else ""
        if mark and not (mark == "." and column.endswith("_m")) and THOUSANDS.fullmatch(cell):
            # (a German spreadsheet writes 1200 as 1.200, and other columns do not show the meaning of its point)
            if mark == "," or table.decimal == ",":
                self.refuse_ambiguous(column)
            table.unsure.setdefault(column, self)
            return
        if mark and table.decimal not in {"", mark}:
            self.refuse(column, f"must have its decimals as the numbers above ({table.decimal}), got {cell!r}")
        if mark:
            table.decimal = mark
            table.decimals.add(column)

    def refuse_ambiguous(self, column: str) -> NoReturn:
        """Raise an error about 1.200 or 1,200, which may be a thousand or one."""
        cell = self.text(column)
        whole, mark, fraction = cell.partition("," if "," in cell else ".")
        self.refuse(column, f"is ambiguous, write {whole}{fraction} or {whole}{mark}{fraction}0, got {shown(cell)}")

    def count_in(self, column: str) -> int | None:
        """Return a cell as a whole number, None if it is empty."""
        cell = self.text(column)
        if not cell:
            return None
        if not (cell.isascii() and cell.isdecimal() and len(cell) < 10):
            self.refuse(column, f"must be a whole number, got {shown(cell)}")
        return int(cell)

    def yes_in(self, column: str) -> bool:
        """Return True if a cell is yes, False if it is no or empty."""
        cell = self.text(column).lower()
        if cell not in {"", *YES, *NO}:
            self.refuse(column, f"must be yes or no, got {shown(cell)}")
        return cell in YES

    def checked(self, column: str, made: Callable[[], Value]) -> Value:
        """Return the result of `made`, and raise its ValueError as an error of this line."""
        try:
            return made()
        except self.table.kind.error:
            raise
        except ValueError as error:
            self.refuse(column, str(error).removeprefix(f"{column} "))


def _kind_of(annotation: Any) -> Any:
    """Return the plain type of an annotation: of a number, a word or yes and no."""
    if annotation in (float, int, bool, str):
        return annotation
    return next((kind for kind in map(_kind_of, get_args(annotation)) if kind is not None), None)


YES = ("yes", "y", "true", "1")
NO = ("no", "n", "false", "0")
MONEY = ("value", "anchoring_cost", "cost_median")
"""Columns of amounts of money, which have two decimals; three digits behind each point mark thousands."""
_LARGE, LESS = ("_mm", "_days"), 10.0
"""Ends of columns in which thousands are plausible, and the number of thousands from which they are not."""
_NUMBER = re.compile(r"[-+]?(?:\d{1,30}[.,]?\d{0,30}|[.,]\d{1,30})(?:[eE][-+]?\d{1,3})?", re.ASCII)
_MARKS = re.compile(r"[-+]?\d[\d.,'’\s]*")
_TOTAL = re.compile(
    r"(?i)(grand |sub[- ]?)?(totals?|sum)( général| general|e|es)?( (of )?(pieces|items|value|number))?[\W\d]*"
    r"|((ins)?gesamt|(sous-|sub)?totaa?l|somme|suma|summa|soma|toplam|celkem|razem|yhteensä"
    r"|итого|всего|合計|小計|総計|合计|小计|总计|합계|σύνολο|[σ∑]|average|mean|mittelwert|moyenne|promedio)[\W\d]*"
    r"|((zwischen|gesamt)?summe|sub-?totals?|sous-total|zwischentotal|(grand|sum) total)\b.*"
    r"|.*\b(sub-?)?(totals?|gesamt)[\W\d]*"
    r"|(totale?s?|sum|(ins)?gesamt)\W*((of|for|per|in|im|du|de|della?)\W+)?((the|all|la|le)\W+)?"
    r"((ground|first|second|third|top)\W+)?(floor|stor(?:e?y|ies)|level|room|raum|building|haus|wing|basement|keller"
    r"|[eud]g|\d+\.? ?og|og ?\d*|erdgeschoss|rdc|rez|étage|etage|piano|planta|piso|stock(?:werk)?|page|seite)\b.*"
)
_COMMENT = re.compile(r"((?:\A|[\r\n])[ \t]*)#[^\r\n]*|\A\"?(?:sep|SEP)=.?\"?(?=[\r\n])")
"""Comments, and the first line that names the separator for a spreadsheet program."""
_OTHER_UNITS = re.compile(
    r"(?i)\b(?:in|as|×|x|\*) ?(?:units of )?(?:1[.,' ]?000|thousands?|millions?|tsd|tausend|mio|milliers|migliaia)\b"
    r"|\b[kt](?:€|(?:eur|chf|usd)\b)|\bk[€$£]|\bm(?:io|ill)\.? ?(?:€|(?:eur|usd|chf)\b)"
    r"|\b(?:sizes?|dimensions?|widths?|heights?|lengths?|maße|abmessungen|units?|all|everything|numbers)\b[^#;]{0,40}?"
    r"\b(?:in|are)\s+(?:[cm]m|inch(?:es)?|ft|feet|foot|centimet\w+|millimet\w+|zentimeter\w*|lbs?|pounds)\b"
)
"""Units in comments that no heading has."""
_PLACEHOLDER = re.compile(
    r"(?i)#n/a|na|<na>|nan|null|[-\s]*(?:[\"″”〃]|'')[-\s]*|dt?to\.?|dit?to|idem|ídem|detto|ebenso|同上|s\.\s?o\."
    r"|(?:the )?same(?: as above)?|(?:as|see) above|(?:wie|siehe) oben|come sopra|comme ci-dessus"
)
"""Texts for an empty cell of another program, or for the cell above."""
_MARKED = re.compile(r"[ \t]*#\S")
