"""Refused files as cases: wrong studies, records, inventories, hazards, results and options, and what must be named.

``refused/*.toml`` hold them as changes of small files that are right, mostly a line each:

- ``base``: tables of files, of which the first is the one that is changed.
- ``command``: what is run where an entry names no command of its own.  Of several the last one is refused, and those
  before it that run no study.
- any other table: entries that change the base of its name.  Of an entry, ``names`` is what the refusal must name,
  ``change`` pairs of old and new text, ``top`` and ``add`` text before and behind, and ``files`` further files: texts,
  bytes (``hex``), the rows of a workbook (``cells``) or a netCDF file (``attributes``).  ``drop`` are tables that the
  study is without, and another key is a table of it, into which lines are put.
"""

import io
import json
import re
import shlex
import struct
import tomllib
import zipfile
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from case import HERE, Case

FOLDER = HERE / "refused"
STUDY = "study.toml"
OWN_KEYS = {"names", "change", "drop", "top", "add", "files", "command"}
WORKBOOK = {
    "[Content_Types].xml": '<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types">'
    '<Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/>'
    '<Override PartName="/xl/workbook.xml" ContentType="'
    'application/vnd.openxmlformats-officedocument.spreadsheetml.sheet.main+xml"/>'
    '<Override PartName="/xl/sheet.xml" ContentType="'
    'application/vnd.openxmlformats-officedocument.spreadsheetml.worksheet+xml"/></Types>',
    "_rels/.rels": '<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">'
    '<Relationship Id="r" Target="xl/workbook.xml" Type="'
    'http://schemas.openxmlformats.org/officeDocument/2006/relationships/officeDocument"/></Relationships>',
    "xl/_rels/workbook.xml.rels": '<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">'
    '<Relationship Id="s" Target="sheet.xml" Type="'
    'http://schemas.openxmlformats.org/officeDocument/2006/relationships/worksheet"/></Relationships>',
    "xl/workbook.xml": '<workbook xmlns="http://schemas.openxmlformats.org/spreadsheetml/2006/main" '
    'xmlns:r="http://schemas.openxmlformats.org/officeDocument/2006/relationships">'
    '<sheets><sheet name="inventory" sheetId="1" r:id="s"/></sheets></workbook>',
}
"""Parts of a workbook with one sheet, but for the sheet."""


def cases() -> list[Case]:
    """Return the refused files, in the order of their tables."""
    return [case for path in sorted(FOLDER.glob("*.toml")) for case in _of_table(path)]


def doubted() -> list[Case]:
    """Return studies with numbers that look like those of another unit: the kind of their doubt, and what it names.

    Those that name nothing have usual numbers, and no doubt of that kind.
    """
    return [*_of_table(HERE / "doubted.toml")]


def _of_table(path: Path) -> Iterator[Case]:
    # TOML takes a text in single quotes as it is, but lines of a study end in it, too.
    content = json.loads(json.dumps(tomllib.loads(path.read_text(encoding="utf-8"))).replace(r"\\n", r"\n"))
    bases, command = content.pop("base"), content.pop("command")
    for base, entries in content.items():
        for name, entry in entries.items():
            commands = [shlex.split(line) for line in _listed(entry.get("command", command))]
            names = _listed(entry["names"])
            yield Case(f"refused/{path.stem}/{base}_{name}", _files(bases[base], entry), commands, names)


def _listed(value: str | list[str]) -> list[str]:
    return [value] if isinstance(value, str) else value


def _files(base: Mapping[str, str], entry: Mapping[str, Any]) -> dict[str, str | bytes]:
    study, changed = base.get(STUDY, ""), next(iter(base))
    for table in entry.get("drop", ()):
        study = re.sub(rf"(?ms)^\[+{re.escape(table)}\]+$.*?(?=^\[|\Z)", "", study)
    for table, lines in entry.items():
        if table not in OWN_KEYS:
            study = _with_lines(study, table, lines)
    files = {**base, STUDY: study} if study else dict(base)
    text = files[changed]
    for old, new in entry.get("change", ()):
        if old not in text:
            raise ValueError(f"{old!r} is not in the base of {entry}")
        text = text.replace(old, new, 1)
    text = f"{entry['top']}\n{text}" if "top" in entry else text
    files[changed] = text + entry.get("add", "")
    return {**files, **{name: _content(content) for name, content in entry.get("files", {}).items()}}


def _with_lines(text: str, table: str, lines: str) -> str:
    """Return a study with lines in a table, in place of those of the same keys; a table that is not there is added."""
    header = re.search(rf"(?m)^\[+{re.escape(table.strip('[]'))}\]+\n", text)
    if header is None:
        return f"{text}\n{table if table.startswith('[') else f'[{table}]'}\n{lines}\n"
    keys = {line.partition("=")[0].strip() for line in lines.splitlines()}
    body, bracket, rest = text[header.end() :].partition("\n[")
    kept = "".join(line for line in body.splitlines(keepends=True) if line.partition("=")[0].strip() not in keys)
    return f"{text[: header.end()]}{lines}\n{kept}{bracket}{rest}"


def _content(content: str | Mapping[str, Any]) -> str | bytes:
    if isinstance(content, str):
        return content
    if "hex" in content:
        return bytes.fromhex(content["hex"])
    return _workbook(content["cells"]) if "cells" in content else _netcdf(content["attributes"])


def _workbook(rows: Sequence[str]) -> bytes:
    """Return a workbook with a sheet of rows: their cells as XML, or their texts with semicolons between."""
    sheet = ""
    for number, row in enumerate(rows, start=1):
        letters = zip("ABCDEFGHIJ", row.split(";"), strict=False)
        words = [f'<c r="{letter}{number}" t="inlineStr"><is><t>{word}</t></is></c>' for letter, word in letters]
        sheet += row if row.startswith("</") else f'<row r="{number}">{row if row[0] == "<" else "".join(words)}</row>'
    space = 'xmlns="http://schemas.openxmlformats.org/spreadsheetml/2006/main"'
    end = "" if "</sheetData>" in sheet else "</sheetData>"
    parts = {**WORKBOOK, "xl/sheet.xml": f"<worksheet {space}><sheetData>{sheet}{end}</worksheet>"}
    found = io.BytesIO()
    with zipfile.ZipFile(found, "w") as archive:
        for name, part in parts.items():
            archive.writestr(zipfile.ZipInfo(name), part)
    return found.getvalue()


def _netcdf(attributes: Mapping[str, str | int]) -> bytes:
    """Return a netCDF file (classic) that holds attributes alone."""

    def counted(text: str) -> bytes:
        content = text.encode()
        return struct.pack(">i", len(content)) + content + bytes(-len(content) % 4)

    found = b"CDF\x01" + bytes(12) + struct.pack(">ii", 12, len(attributes))
    for name, value in attributes.items():
        kept = struct.pack(">iii", 4, 1, value) if isinstance(value, int) else struct.pack(">i", 2) + counted(value)
        found += counted(name) + kept
    return found + bytes(8)
