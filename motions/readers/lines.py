"""Common parts of all record readers: lines of bounded length, numbers in lines, and the error of readers.

The module does not depend on any format. A file is read line by line, so that its samples, but never its text, are in
memory.
"""

from __future__ import annotations

import codecs
import itertools
import math
import os
import re
import unicodedata
from array import array
from collections.abc import Iterable, Iterator
from contextlib import suppress
from datetime import UTC, datetime
from pathlib import Path
from types import TracebackType
from typing import Literal, Self

import numpy as np

from ...core import checks
from ...core.aliases import Array
from ...core.doubts import Doubt, warn
from ...core.limits import RECORD_BYTES
from ...core.wording import system_errors, system_reason

LATIN = "of-latin-1"
"""Decoding of bytes that are not of UTF-8 as Latin-1: its m/s² would else be a velocity, or no unit at all."""
codecs.register_error(LATIN, lambda error: (error.object[error.start : error.end].decode("latin-1"), error.end))  # type: ignore[attr-defined]
MAX_LINE = 2**20
MAX_SAMPLES = 50_000_000
# Number of characters of a line that detection and header patterns use, since headers are at the beginning.
HEADER_WIDTH = 1000
HEAD_LINES = 40


class RecordError(ValueError):
    """Error of a record file that cannot be read; the message names the file and the fault."""


def existing(path: str | os.PathLike[str]) -> Path:
    """Return the path of a record file; RecordError if it is missing, no file, too large or empty."""
    file = checks.path(path)
    try:
        if not file.is_file():
            raise RecordError(f"{file}: no such file" if not file.exists() else f"{file}: not a file")
        size = file.stat().st_size
    except (OSError, ValueError) as error:
        raise RecordError(f"{file}: cannot be read ({system_reason(error)})") from None
    if size > RECORD_BYTES:
        raise RecordError(f"{file}: larger than {RECORD_BYTES // 2**20} MiB, no record is")
    if size == 0:
        raise RecordError(f"{file}: empty")
    return file


NETCDF = (b"CDF\x01", b"CDF\x02", b"CDF\x05", b"\x89HDF\r\n\x1a\n")
"""First bytes of netCDF-3 and of HDF5, in which netCDF-4 is written."""
# The first bytes of what is not the text of a record, its name, and what to do.
_PACKED = {
    b"\x1f\x8b": ("compressed (gzip)", "unpack it first"),
    b"PK\x03\x04": ("a zip archive or a workbook", "unpack it, or save the sheet as CSV"),
    b"BZh": ("compressed (bzip2)", "unpack it first"),
    b"\xfd7zXZ": ("compressed (xz)", "unpack it first"),
    b"7z\xbc\xaf": ("a 7z archive", "unpack it first"),
    b"Rar!": ("a rar archive", "unpack it first"),
    b"\xff\xfe": ("UTF-16", "save it as UTF-8"),
    b"\xfe\xff": ("UTF-16", "save it as UTF-8"),
    b"%PDF": ("a PDF", "take the numbers themselves"),
    **dict.fromkeys(NETCDF, ("netCDF or HDF5", "write time and acceleration as CSV")),
}


def refuse_packed(file: Path) -> None:
    """Raise RecordError for a file that is compressed, or text in UTF-16, with its kind and a remedy."""
    first = beginning(file, 64)
    wide = "UTF-16", "save it as UTF-8"
    spaced = len(first) > 8 and (not any(first[1::2]) or not any(first[::2]))  # (every other byte is 0)
    packing = wide if spaced else next((what for mark, what in _PACKED.items() if first.startswith(mark)), None)
    if packing is not None:
        raise RecordError(f"{file}: {packing[0]}, not plain text: {packing[1]}")


def beginning(file: Path, size: int = 4096) -> bytes:
    """Return the first bytes of a file; RecordError if it cannot be opened."""
    with system_errors(RecordError, f"{file}: cannot be read"), file.open("rb") as stream:
        return stream.read(size)


def lines_of(file: Path) -> Iterator[str]:
    """Yield the lines of a text file; RecordError if it cannot be read."""
    with system_errors(RecordError, f"{file}: cannot be read"), file.open(encoding="utf-8-sig", errors=LATIN) as stream:
        yield from stream


class Lines:
    """Lines of a text record, read one at a time and counted; `head` has the first lines without consuming them.

    A `RecordError` that names the file is raised for a file that is unreadable, contains NUL bytes or is a web page. It
    is also raised for an endless line, and for a file that is cut within its last number.
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self.file = existing(path)
        refuse_packed(self.file)
        self.number = 0
        self._unended = self._commas = False
        # (a transfer between systems may double the line ends, CR CR LF, which are one each)
        newline = "\n" if b"\r\r\n" in beginning(self.file) else None
        with system_errors(RecordError, f"{self.file}: cannot be read"):
            self._stream = self.file.open(encoding="utf-8-sig", errors=LATIN, newline=newline)
        try:
            self._ahead = list(itertools.islice(iter(self._fetch, ""), HEAD_LINES))
            if has_decimal_commas(self._ahead) and has_decimal_commas(lines_of(self.file)):
                self._commas = True
                self._ahead = [pointed(line) for line in self._ahead]
            self.head = tuple(line[:HEADER_WIDTH].rstrip() for line in self._ahead)
            if re.match(r"\s*<(?:!doctype|!--|html|head|\?xml)", " ".join(self.head), re.IGNORECASE):
                raise RecordError(f"{self.file}: a web page or XML, not a record")
            if not any(self.head) and len(self.head) < HEAD_LINES:
                raise RecordError(f"{self.file}: empty")
        except RecordError:
            self._close()
            raise
        self._ahead.reverse()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self._close()

    def _close(self) -> None:
        with suppress(OSError):  # (nothing is lost where a file that was read cannot be closed)
            self._stream.close()

    def __iter__(self) -> Iterator[str]:
        return self

    def __next__(self) -> str:
        line = self._ahead.pop() if self._ahead else self._fetch()
        if not line:
            raise StopIteration
        self.number += 1
        if self._unended and not self._ahead:
            self._refuse_cut(line)
        return line.rstrip("\n")

    def _refuse_cut(self, last: str) -> None:
        """Raise RecordError if the last line, which has no end, ends within a number; warn if it may.

        It does if all numbers above have more digits after the point, or end further to the right. It may if these are
        few or have different numbers of digits.
        """
        fields = [*_FIELD.finditer(last)]
        if not fields or last.strip(_OF_NUMBERS):
            return
        above: list[tuple[int, int, int]] = []
        for line in map(pointed, lines_of(self.file)) if self._commas else lines_of(self.file):
            at = [*_FIELD.finditer(line)]
            if line.strip(_OF_NUMBERS):
                above.clear()
            elif len(at) >= len(fields):
                above.append(_shape(at[len(fields) - 1]))
        if len(above) < 4:
            return
        # without a number of samples that may come first, and the last line itself
        ends, widths, digits = (set(of) for of in zip(*above[1:-1], strict=True))
        end, _, length = _shape(fields[-1])
        aligned = len(ends) == 1 < len(widths) and end < max(ends)
        if not aligned and length >= min(digits):
            return
        error = self.error(
            f"ends in {fields[-1][0][:30]!r} without a line end, the numbers above are longer: truncated; if it is "
            "whole, end the line"
        )
        if aligned or (len(digits) == 1 and len(above) > FEW):
            raise error
        warn([Doubt("table", str(error))])

    def _fetch(self) -> str:
        try:
            line = self._stream.readline(MAX_LINE)
        except OSError as error:
            raise RecordError(f"{self.file}: cannot be read ({system_reason(error)})") from None
        if len(line) >= MAX_LINE:
            raise RecordError(f"{self.file}: holds a line of more than {MAX_LINE:,} characters, no record does")
        if "\0" in line:
            raise RecordError(f"{self.file}: not text (holds NUL bytes)")
        # Control-Z is the end-of-file mark of DOS, single or as padding
        self._unended |= bool(line) and not line.endswith(("\n", "\r", "\x1a"))
        line = line.rstrip("\r\n\x1a") + "\n" if line else line
        return pointed(line) if self._commas else line

    def back(self, line: str) -> None:
        """Put the line that was read last back: the next one is that again."""
        self._ahead.append(f"{line}\n")
        self.number -= 1

    def error(self, message: str, at: int | None = None) -> RecordError:
        """Return the error for the line that was read last, or for line `at`."""
        return RecordError(f"{self.file}: line {at or self.number} {message}")

    def header(self, what: str) -> str:
        """Return the next line, up to the width of a header; RecordError if the file ends before `what`."""
        line = next(self, None)
        if line is None:
            raise RecordError(f"{self.file}: ends before {what}: truncated")
        return line[:HEADER_WIDTH].rstrip()

    def value(
        self, text: str, what: str, above: float = -math.inf, below: float = math.inf, at: int | None = None
    ) -> float:
        """Return a number of the header; RecordError if it is no number or not between the bounds."""
        try:
            number = float(text) if _is_plain(text) else math.nan
        except ValueError:
            number = math.nan
        if not above < number < below:
            bounds = [f"> {above:g}"] * (above > -math.inf) + [f"< {below:g}"] * (below < math.inf)
            allowed = f", {' and '.join(bounds)}" if bounds else ""
            remedy = f": {DECIMALS}" if re.search(r"\d,\d", text) else ""
            raise self.error(f"gives {what} as {text.strip()[:30]!r}, must be a finite number{allowed}{remedy}", at)
        return number

    def step(self, number: str, rest: str, unit: str = "") -> float:
        """Return a time step between 0 and 1 s as `STEP` finds it: a number, D exponents and fractions too, with a
        unit.
        """
        after = _AFTER_STEP.match(rest)
        if after is None:
            text = f"{number}{rest}".strip()
            raise RecordError(f"{self.file}: gives its time step as {text[:30]!r}, must be like '0.01' or '0.01 s'")
        value = float(number.lower().replace("d", "e")) / float(after["divisor"] or 1.0)
        value *= {"m": 1e-3, "u": 1e-6}.get((after["unit"] or unit).lower()[:1], 1.0)
        if not 0.0 < value < LONGEST_STEP:
            raise RecordError(f"{self.file}: DT must lie between 0 and {LONGEST_STEP:g} s, got {value:g}")
        return value

    def count(self, text: str, what: str, at: int | None = None) -> int:
        """Return a number of samples; RecordError if it is no number, below 2, or above `MAX_SAMPLES`."""
        number = self.value(text, what, at=at)
        if number != int(number) or not 2 <= number <= MAX_SAMPLES:
            raise self.error(f"declares {text.strip()[:30]} {what}, allowed are 2 to {MAX_SAMPLES:,}", at)
        return int(number)

    def numbers(self, count: int | None = None, columns: tuple[int, int] | None = None, what: str = "samples") -> Array:
        """Return the next `count` numbers (all that follow if None), also from fixed columns without blanks between.

        `columns` is the number of values on a line and the width of each, if the file declares them. Messages of a
        RecordError name the line or the sample.
        """
        row_values = array("d")
        while count is None or len(row_values) < count:
            line = next(self, None)
            if line is None:
                break
            expected = None
            if columns is not None and count is not None:
                expected = min(columns[0], count - len(row_values))
            row = self._row(line, columns[1] if columns else None, expected)
            row_values.extend(row)
            if expected is not None and len(row) != expected:
                raise self.error(f"holds {len(row)} {what}, its format says {expected}: truncated or damaged")
            if count is not None and len(row_values) > count:
                raise self.error(f"holds more than the {count} {what} declared: damaged")
            if len(row_values) > MAX_SAMPLES:
                raise self.error(f"is beyond {MAX_SAMPLES:,} {what}, no record is")
        if count is not None and len(row_values) < count:
            raise RecordError(f"{self.file}: declares {count} {what} but holds {len(row_values)}: truncated or damaged")
        values = np.frombuffer(row_values, dtype=np.float64) if row_values else np.empty(0)
        finite = np.isfinite(values)
        if not finite.all():
            where = int(np.flatnonzero(~finite)[0])
            raise RecordError(f"{self.file}: sample {where + 1} is {values[where]}, not a finite number")
        return values

    def _row(self, line: str, width: int | None, expected: int | None) -> list[float]:
        if _is_plain(line):
            try:
                row = [float(word) for word in line.split()]
                if expected is None or len(row) == expected:
                    return row
            except ValueError:
                pass
            if width is not None:
                words = [line[i : i + width] for i in range(0, len(line.rstrip()), width)]
                try:
                    return [float(word) for word in words]
                except ValueError:
                    pass
        # Columns without a blank between them, or exponents written with Fortran's D.
        row, at = [], 0
        while at < len(line):
            if line[at].isspace():
                at += 1
                continue
            match = _NUMBER.match(line, at)
            if match is None:
                raise self.error(f"holds {line[at : at + 20].rstrip()!r}, no number")
            row.append(float(match.group(0).replace("D", "E").replace("d", "e")))
            at = match.end()
        return row


def known(text: str) -> float:
    """Return a number that a header may give, NaN if it has words (ND, unknown) or nothing."""
    try:
        number = float(text) if _is_plain(text) else math.nan
    except ValueError:
        return math.nan
    return number if math.isfinite(number) else math.nan


def clock_time(text: str, layout: str) -> float:
    """Return a date and time in s since 1970, NaN if a header gives none in this layout."""
    try:
        return datetime.strptime(text, layout).replace(tzinfo=UTC).timestamp()
    except ValueError:
        return math.nan


def cells_of(line: str) -> list[str]:
    """Return the cells of a line of a header."""
    separator = next((mark for mark in (";", "\t", ",") if mark in line), ",")
    return [cell.strip(' "') for cell in line.split(separator)]


def has_decimal_commas(lines: Iterable[str]) -> bool:
    """Return True if the commas of a table, with numbers between semicolons or tabs, are surely decimal.

    No number has a point or a second comma, and some have a comma that marks no thousands.
    """
    sure = False
    for line in map(str.strip, lines):
        cells = [cell for cell in cells_of(line) if cell] if re.search("[;\t]", line) else [line]
        if is_comment(line) or not all(map(_DIGITS.fullmatch, cells)):
            continue
        if ("," in line and len(cells) < 2) or not all(map(_COMMA.fullmatch, cells)):
            return False
        sure = sure or any("," in cell and not THOUSANDS.fullmatch(cell) for cell in cells)
    return sure


def pointed(line: str) -> str:
    """Return a line with points for its decimal commas."""
    return _DECIMAL_COMMA.sub(".", line)


def as_key(line: str) -> str:
    """Return 'key: value unit' of a line of a header whose cells are these, and other lines as they are.

    The value may be in the cells of all columns.
    """
    key, *values = [cell for cell in cells_of(line) if cell] or [""]
    named = _KEY.fullmatch(key) and not re.search("[:=：]", line)
    with_unit = len(values) == 2 and not math.isnan(known(values[0])) and math.isnan(known(values[1]))
    return f"{key}: {' '.join(dict.fromkeys(values))}" if named and (with_unit or len(set(values)) == 1) else line


def is_comment(line: str) -> bool:
    """Return True for a line that begins with #, and for a spreadsheet program's ``sep=;``; an error (#N/A) is none."""
    text = line.lstrip()
    return _SEPARATOR.match(text) is not None or (text.startswith("#") and _CELL_ERROR.match(text) is None)


def is_blank(line: str) -> bool:
    """Return True for a line without text, and for the empty cells that spreadsheet programs write below a table."""
    return not line.strip(",; \t\r\n")


def plain(text: str, longest: int = 80) -> str:
    """Return words of a header as a label: printable characters, single blanks, not longer than a line."""
    return " ".join("".join(c if c.isprintable() else " " for c in text).split())[:longest].rstrip()


def folded(text: str, form: Literal["NFD", "NFKD"] = "NFKD") -> str:
    """Return a text without accents, in a form of Unicode (NFD keeps superscripts)."""
    letters = unicodedata.normalize(form, text.replace("ı", "i"))
    return unicodedata.normalize("NFC", "".join(letter for letter in letters if not unicodedata.combining(letter)))


def _is_plain(text: str) -> bool:
    # float() also accepts 1_000 and the digits of every script, which records do not have
    return text.isascii() and "_" not in text


def _shape(field: re.Match[str]) -> tuple[int, int, int]:
    """Return the end of a number in its line, its width, and the width from its point on."""
    return field.end(), len(field[0]), len(field[0].partition(".")[2])


_KEY = re.compile(r"(?=.*[^\W\d_])[^\d(\[]*(?:[\[(][^)\]]*[)\]])?")
"""A key in a cell, with or without its unit."""
_SEPARATOR = re.compile(r'"?sep=.?"?\s*$', re.IGNORECASE)
_CELL_ERROR = re.compile(
    r"#(?:N/A|NV|NAME\?|VALUE!|WERT!|REF!|BEZUG!|DIV/0!|NUM!|ZAHL!|NULL!|VALEUR ?!|NOMBRE ?!|¡?VALOR!)(?![\w/])"
)
"""Errors of cells, which begin as comments do: in English, German, French and Spanish."""
THOUSANDS = re.compile(r"[-+]?[1-9]\d{0,2}[.,]\d{3}", re.ASCII)
"""A number that may be a thousand or one: 1.200 or 1,200."""
DECIMALS = "write decimals with a point, thousands without a mark"
_DIGITS = re.compile(r"[-+.,'\s\d]+(?:(?<=[\d.,])[eE][-+]?\d+)?")
_COMMA = re.compile(r"[-+]?(?:\d+|\d*,\d+)(?:[eE][-+]?\d+)?", re.ASCII)
_DECIMAL_COMMA = re.compile(r"(?<![^\s;\"+-]),(?=\d)|(?<=\d),(?=\d)")
_FIELD = re.compile(r"[^,;\s]+")
_OF_NUMBERS = "+-.0123456789eEdD,; \t\r\n\x1a"
_NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eEdD][-+]?\d+)?(?=$|[\s,+-])", re.ASCII)
# A number as headers have it, and what follows it, which must not be cut off.
STEP = r"(?P<number>[-+]?(?:\d{1,12}\.?\d{0,15}|\.\d{1,15})(?:[eEdD][-+]?\d{1,3})?)(?P<rest>.{0,20})"
_AFTER_STEP = re.compile(
    r"(?i)(?!\s*(?:milli|micro|[µun]s\b|min|h(?:ours?|r)?\b|hz|sps))\s*(?:/\s*(?P<divisor>[1-9]\d{0,5}(?:\.\d{1,6})?)\s*)?(?P<unit>m?s(?:ec)?(?:onds?)?)?\.?(?:$|[\s)\]]|[,;](?!\d))"
)
FEW = 10
"""Samples that no record has, and lines of numbers whose digits may be equal by chance."""
LONGEST_STEP = 1.0
"""Time step, s, that no record reaches."""
