"""The content of a study file, which refines the files that it includes: TOML in, plain values out."""

import glob
import os
import re
import tomllib
import unicodedata
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, get_args

from pydantic.fields import FieldInfo

from ...core.doubts import warn
from ...core.limits import ENTRIES, KEYS, STUDY_BYTES, whole_content
from ..text.error import StudyError
from .table import PartialTable, RelativePath, Table, shown, unended

MOST_NESTING = 16
MOST_TEXT = 4096
INCLUDE = "include"
# The beginnings of the TOML reader's messages, and the usual cause of each.
_TOML_WORDS = (
    ("Invalid value", "no value after the =: text stands in quotes, numbers have a decimal point"),
    (
        "Expected newline or end of document",
        "something is left after the value: numbers have a decimal point, units stand in the key",
    ),
    (
        "Cannot declare",
        "this table was there before: put its keys into one, or write [[...]] where there may be several",
    ),
    ("Cannot overwrite a value", "this key was there before in the same table"),
    ("Unclosed inline table", "the table in braces is not closed in its line: }"),
    ("Unclosed array", "the list is not closed: ]"),
    ("Unterminated string", "the text is not closed: a quote is missing"),
    ("Illegal character", "the text is not closed in its line, or holds a character that no text may"),
    ("Expected '=' after a key", "a key needs a = and a value after it"),
    ("Expected ']' at the end of a table declaration", "the header of the table is not closed: ]"),
)
_HEADER = re.compile(r"\s*(\[\[?)([^\[\]]+)\]")
_KEY = re.compile(r'\s*"?([\w-]+)"?\s*=')
_CUT = re.compile(r"=\s*[-+.\w]*\d\Z", re.ASCII)
_DIRECTING = frozenset("\u202a\u202b\u202c\u202d\u202e\u2066\u2067\u2068\u2069")


@dataclass(frozen=True)
class MergedContent:
    """The content of a study file, and the file that each key comes from, by (table,) and (table, key)."""

    content: dict[str, Any]
    origin: dict[tuple[str, ...], Path] = field(default_factory=dict)


def read_content(path: Path, table: type[Table]) -> MergedContent:
    """Read a study file merged with its included files; the fields of `table` mark the keys that are paths."""
    content = _parsed(path)
    merged: dict[str, Any] = {}
    origin: dict[tuple[str, ...], Path] = {}
    names = content.pop(INCLUDE, [])
    if not isinstance(names, list) or not all(isinstance(name, str) and name for name in names):
        raise StudyError(f'{path}: include must be a list of files, as include = ["common.toml"], got {shown(names)}')
    for name in names:
        file = path.parent / name
        if not _is_file(file):
            raise StudyError(f"{path}: include: no file {shown(name)} (looked in {path.parent.resolve()})")
        part = _parsed(file)
        if INCLUDE in part:
            raise StudyError(f"{path}: include: {shown(name)} includes files itself: list them here")
        for key, value in rebased(part, table, os.path.dirname(name)).items():
            if key in merged:
                raise StudyError(f"{path}: include: {shown(key)} is given by {origin[key,]} and by {file}")
            merged[key] = value
            origin |= _origins(key, value, file)
    for key, value in content.items():
        before = merged.get(key, {})
        if isinstance(before, dict) and isinstance(value, dict):
            merged[key] = {**before, **value}
        elif key in merged:
            raise StudyError(
                f"{path}: {shown(key)} is given here and by {origin[key,]}: only keys of tables can be given anew"
            )
        else:
            merged[key] = value
        origin |= _origins(key, value, path)
    return MergedContent(merged, origin)


def _origins(key: str, value: Any, path: Path) -> dict[tuple[str, ...], Path]:
    """Return the file of a key, and of the keys of its table."""
    return {(key,): path, **({(key, inner): path for inner in value} if isinstance(value, dict) else {})}


def _parsed(path: Path) -> dict[str, Any]:
    """Return the content of one file; StudyError if no study can have such content."""
    if os.path.isdir(path):  # (which raises nothing)
        raise StudyError(f"{path}: cannot be read (Is a directory)")
    text = text_of(path)
    try:
        content = tomllib.loads(text)
    except (ValueError, RecursionError) as error:  # (an integer of thousands of digits raises no TOMLDecodeError)
        raise StudyError(f"{path}: not valid TOML: {_reason(error, text)}") from None
    left: list[tuple[str, Any, int]] = [("", content, 0)]
    while left:
        key, value, depth = left.pop()
        where = f"{path}: {shown(key)}" if key else str(path)
        if isinstance(value, dict | list):
            if depth >= MOST_NESTING:
                raise StudyError(f"{where} is nested too deeply")
            most = KEYS if isinstance(value, dict) else ENTRIES
            if len(value) > most:
                raise StudyError(f"{where} holds {len(value):,} entries, allowed are {most:,}")
            pairs = value.items() if isinstance(value, dict) else ((f"[{i + 1}]", part) for i, part in enumerate(value))
            for name, part in pairs:
                if isinstance(value, dict):
                    refuse_text(f"{where}: a key", name)
                dot = "." if key and isinstance(value, dict) else ""
                left.append((f"{key}{dot}{name}", part, depth + 1))
        elif isinstance(value, str):
            refuse_text(where, value)
        elif isinstance(value, int) and not -(2**63) <= value < 2**63:
            raise StudyError(f"{where} is an integer of more than 64 bits")
    if _CUT.search(text):
        warn([unended(path.name)])
    return content


def text_of(path: Path) -> str:
    """Return the text of one file; StudyError if it cannot be read."""
    try:
        return whole_content(path, STUDY_BYTES, "study file", StudyError).decode("utf-8")
    except UnicodeDecodeError:
        raise StudyError(f"{path}: not a text file in UTF-8") from None


def line_of(text: str, location: tuple[int | str, ...]) -> int:
    """Return the number of the line of a TOML text that begins with a key or its table; 0 if none does."""
    above: tuple[int | str, ...] = ()
    several: dict[tuple[str, ...], int] = {}
    for number, line in enumerate(text.splitlines(), start=1):
        header, key = _HEADER.match(line), _KEY.match(line)
        if header is not None:
            names = tuple(name.strip(' "') for name in header[2].split("."))
            if header[1] == "[[":
                several[names] = several.get(names, -1) + 1
            above = ()
            for i, name in enumerate(names, start=1):
                above += (name,) if names[:i] not in several else (name, several[names[:i]])
            if location in (names, above):
                return number
        elif key is not None and location == (*above, key[1]):
            return number
    return 0


def _reason(error: Exception, text: str) -> str:
    """Return the line of an error in a TOML text, and the error in a user's words."""
    if isinstance(error, RecursionError):
        return "nested too deeply"
    if not isinstance(error, tomllib.TOMLDecodeError):
        return "a number that is none"
    words_of_parser, _, where = str(error).partition(" (at ")
    place = re.match(r"line (\d+)", where)
    lines = text.splitlines()
    number = int(place[1]) if place else len(lines)
    line = lines[number - 1].strip() if 0 < number <= len(lines) else ""
    words = next(
        (cure for start, cure in _TOML_WORDS if words_of_parser.startswith(start)),
        f"{words_of_parser[:1].lower()}{words_of_parser[1:]}",
    )
    return f"line {number}{f', {shown(line)}' if line else ''}: {words}"


def refuse_text(where: str, text: str) -> None:
    """Raise StudyError if a text is too long, or holds a character that no study may hold."""
    if len(text) > MOST_TEXT:
        raise StudyError(f"{where} holds {len(text):,} characters, allowed are {MOST_TEXT:,}")
    for character in text:
        if character in _DIRECTING or unicodedata.category(character) in {"Cc", "Cs", "Zl", "Zp"}:
            raise StudyError(f"{where} holds the control character U+{ord(character):04X}: {shown(text)}")


def _is_file(file: Path) -> bool:
    try:
        return file.is_file()
    except OSError:  # a name too long
        return False


def rebased(content: Mapping[str, Any], table: Any, folder: str) -> dict[str, Any]:
    """Return the content of a table, or of one of those in an annotation, with relative paths moved into `folder`.

    Values of unexpected types stay as they are.
    """
    if not folder:
        return dict(content)
    fields = fields_of(table, content)
    moved = dict(content)
    for key, value in content.items():
        if key not in fields:
            continue
        located = next((mark for mark in fields[key].metadata if isinstance(mark, RelativePath)), None)
        partial = next((mark.table for mark in fields[key].metadata if isinstance(mark, PartialTable)), None)
        inner = fields[key].annotation if partial is None else partial
        if located is not None:
            before = glob.escape(folder) if located.pattern else folder
            moved[key] = [_in(before, path) for path in value] if isinstance(value, list) else _in(before, value)
        elif isinstance(value, dict):
            moved[key] = rebased(value, inner, folder)
        elif isinstance(value, list):
            moved[key] = [
                rebased(inner_table, inner, folder) if isinstance(inner_table, dict) else inner_table
                for inner_table in value
            ]
    return moved


def _in(folder: str, value: Any) -> Any:
    return os.path.join(folder, value) if isinstance(value, str) and value else value


def fields_of(annotation: Any, content: Any) -> dict[str, FieldInfo]:
    """Return the fields, by their keys, of the table in an annotation that some content chooses, or of all of them."""
    table = table_of(annotation, content)
    tables = list(tables_of(annotation)) if table is None else [table]
    return {field.alias or name: field for table in tables for name, field in table.model_fields.items()}


def table_of(annotation: Any, content: Any) -> type[Table] | None:
    """Return the class of tables in an annotation that some content chooses, None if there is none."""
    tables = list(tables_of(annotation))
    if not tables or tables[0].alternative is None:
        return tables[0] if tables else None
    tag = tables[0].alternative[0](content)
    return next((table for table in tables if table.alternative is not None and table.alternative[1] == tag), None)


def tables_of(annotation: Any) -> Iterator[type[Table]]:
    """Yield the classes of tables in a type annotation."""
    if isinstance(annotation, type) and issubclass(annotation, Table):
        yield annotation
    for part in get_args(annotation):
        yield from tables_of(part)
