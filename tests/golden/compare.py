"""Compare what two versions made of the same case: every difference is an item, its size, and a line of words."""

from __future__ import annotations

import csv
import difflib
import json
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from html.parser import HTMLParser
from pathlib import Path
from typing import Any, NamedTuple

import netCDF4
import numpy as np
import openpyxl

PROVENANCE = {"toppling_version", "package_versions", "identity", "machines", "content_sha256"}
"""Attributes of results that say who computed them, on what, and with which checksum: those may differ."""
MASKS = (
    (r"\b[0-9a-f]{32}-[0-9a-f]{32}\b", "IDENTITY"),
    (r"\b[0-9a-f]{64}\b", "SHA-256"),
    (r"\btoppling \d+\.\d+\.\d+\S*", "toppling VERSION"),
    (r"(?<=^processor \| ).*", "PROCESSOR"),
    (r"^(?:runs: |compiling the engine ).*", ""),
    (r"[\d.,]+ [kMGT]?B are free", "FREE"),
    (r"[\d,]+(?= of [\d,]+ runs kept| runs that were kept)", "SOME"),
)
"""What a text may say otherwise from run to run: identity, checksums, versions, processor, times, rates, paths."""
PICTURES = {".png", ".gif", ".pdf", ".svg", ".webp"}
PLACES = re.compile(r"--[a-z][\w-]*|\b(?:line|row|column) \d+|\b[a-z]\w*(?:\.\w+)+|\b[a-z]+_\w+|(['`\"]).*?\1")
"""What a sentence of refusal names: an option, a line, a dotted key or a file, a name with underscores, a quotation."""
LONGEST = 150  # characters of a line of the table


class Difference(NamedTuple):
    """One thing in which a case's two outcomes differ.

    item: ``FILE``, ``FILE:VARIABLE``, ``FILE:VARIABLE@ATTRIBUTE``, ``FILE:SHEET!CELL``, ``2 out``, ``2 err``,
    ``2 exit`` (of the second command).
    size: largest relative difference of numbers, infinity where a number is none or anything else differs.
    """

    case: str
    item: str
    size: float
    what: str


def compare_case(
    case: str,
    inputs: Iterable[str],
    names: Sequence[str],
    old: Path,
    new: Path,
    variables: Mapping[str, str] | None = None,
) -> list[Difference]:
    """Return the differences of a case.

    Parameters
    ----------
    inputs : iterable of str
        Files of the case itself, which are not compared.
    names : sequence of str
        What a refusal must name; where given, only this of its sentence is compared.
    variables : mapping of str to str
        Names of variables now by those under the old commit.
    """
    found = [*_commands(names, old, new)]
    before, after = (_files(side, set(inputs)) for side in (old, new))
    for name in sorted(before.keys() | after.keys()):
        if name not in after or name not in before:
            found.append(("", name, np.inf, "file is lost" if name in before else "file is new"))
            continue
        found += [(name, *rest) for rest in _file(before[name], after[name], variables or {})]
    return [
        Difference(case, f"{name}{':' * bool(name and item)}{item}", size, _short(what))
        for name, item, size, what in found
    ]


def _files(folder: Path, inputs: set[str]) -> dict[str, Path]:
    """Return what the commands wrote, by name; shards and logs are of the run and no answer."""
    paths = {path.relative_to(folder).as_posix(): path for path in folder.rglob("*") if path.is_file()}
    return {
        name: path
        for name, path in paths.items()
        if name not in inputs
        and not name.startswith(".")
        and "/shards/" not in name
        and path.suffix not in {".log", ".pyc"}
    }


def _commands(names: Sequence[str], old: Path, new: Path) -> Iterator[tuple[str, str, float, str]]:
    """Yield differences of exit codes and printed text."""
    before, after = (json.loads((side / ".done.json").read_text(encoding="utf-8")) for side in (old, new))
    for number, (was, is_) in enumerate(zip(before, after, strict=False), 1):
        if was["code"] != is_["code"]:
            yield "", f"{number} exit", np.inf, f"{was['code']} → {is_['code']}"
        for stream in ("out", "err"):
            texts = [
                (side / f".{number}.{stream}")
                .read_text(encoding="utf-8", errors="replace")
                .replace(str(side), "FOLDER")
                for side in (old, new)
            ]
            if stream == "err" and 2 in (was["code"], is_["code"]):  # a refusal counts by what it names
                said = [{place[0] for place in PLACES.finditer(text)} for text in texts]
                if names:
                    said = [{name for name in names if name in text} for text in texts]
                if said[0] != said[1]:
                    lost, came = said[0] - said[1], said[1] - said[0]
                    yield "", f"{number} err", np.inf, f"no longer names {sorted(lost)}, now names {sorted(came)}"
            else:
                yield from (("", f"{number} {stream}", np.inf, what) for what in _lines(*map(str.splitlines, texts)))


def _file(old: Path, new: Path, variables: Mapping[str, str]) -> Iterator[tuple[str, float, str]]:
    """Yield the item within a file, the size and the words of each of its differences."""
    kind = new.suffix.lower()
    if kind in PICTURES or old.read_bytes() == new.read_bytes():
        return
    if kind == ".nc":
        with netCDF4.Dataset(old) as before, netCDF4.Dataset(new) as after:
            yield from _datasets(before, after, variables)
    elif kind == ".xlsx":
        yield from _workbooks(old, new)
    else:
        texts = [path.read_text(encoding="utf-8", errors="replace") for path in (old, new)]
        lines = [visible(text) if kind == ".html" else text.splitlines() for text in texts]
        if kind == ".csv" and (columns := _columns(lines)):
            yield "", np.inf, columns
        else:
            yield from (("", np.inf, what) for what in _lines(*lines))


def _columns(lines: Sequence[Sequence[str]]) -> str:
    """Return which columns of a table are lost or new."""
    old, new = (next(csv.reader(table[:1]), []) for table in lines)
    if sorted(old) == sorted(new):
        return ""
    return f"columns lost: {sorted(set(old) - set(new))}, new: {sorted(set(new) - set(old))}"


def _lines(old: Sequence[str], new: Sequence[str]) -> Iterator[str]:
    """Yield each run of lines that differs, identity and the like masked."""
    before, after = ([masked for line in side if (masked := _masked(line))] for side in (old, new))
    if before == after:
        return
    for kind, i, j, k, m in difflib.SequenceMatcher(None, before, after, autojunk=False).get_opcodes():
        if kind != "equal":
            was, is_ = " / ".join(before[i:j]), " / ".join(after[k:m])
            start = next((at for at, (a, b) in enumerate(zip(was, is_, strict=False)) if a != b), 0)
            begin = max(0, start - 40)
            yield f"“{was[begin : begin + 100]}” → “{is_[begin : begin + 100]}”"


def _masked(line: str) -> str:
    for pattern, mask in MASKS:
        line = re.sub(pattern, mask, line)
    return " ".join(line.split())


def _short(what: str) -> str:
    return what if len(what) <= LONGEST * 2 else f"{what[: LONGEST * 2]}…"


class _Visible(HTMLParser):
    """The text that a page shows: a line a block, the cells of a row in one line."""

    HIDDEN = {"script", "style", "svg", "title", "head"}
    WITHIN = {"a", "abbr", "b", "code", "em", "i", "mark", "small", "span", "strong", "sub", "sup", "td", "th", "wbr"}

    def __init__(self) -> None:
        super().__init__()
        self.text: list[str] = []
        self.hidden = 0

    def handle_starttag(self, tag: str, attrs: Any) -> None:
        self.hidden += tag in self.HIDDEN
        self.text.append("" if tag in self.WITHIN else "\n")

    def handle_endtag(self, tag: str) -> None:
        self.hidden -= tag in self.HIDDEN
        self.text.append(" | " if tag in {"td", "th"} else "" if tag in self.WITHIN else "\n")

    def handle_data(self, data: str) -> None:
        if not self.hidden:
            self.text.append(" ".join(data.split("\n")))


def visible(page: str) -> list[str]:
    """Return the lines of text that a page shows."""
    parser = _Visible()
    parser.feed(page)
    return [" ".join(line.split()).removesuffix(" |") for line in "".join(parser.text).split("\n") if line.strip(" |")]


def _datasets(old: Any, new: Any, names: Mapping[str, str]) -> Iterator[tuple[str, float, str]]:
    """Yield differences of variables, dimensions, types, units and attributes."""
    before, after = {names.get(name, name): old[name] for name in old.variables}, dict(new.variables)
    for name in sorted(before.keys() | after.keys()):
        if name not in after or name not in before:
            yield name, np.inf, "variable is lost" if name in before else "variable is new"
            continue
        was, is_ = before[name], after[name]
        for what, a, b in (
            ("dimensions", [names.get(dim, dim) for dim in was.dimensions], list(is_.dimensions)),
            ("type", str(was.dtype), str(is_.dtype)),
            ("shape", was.shape, is_.shape),
        ):
            if a != b:
                yield name, np.inf, f"{what} {a} → {b}"
        if was.shape == is_.shape:
            yield from ((name, size, what) for size, what in _values(was, is_))
        yield from _attributes(name, was, is_)
    yield from _attributes("", old, new)


def _attributes(name: str, old: Any, new: Any) -> Iterator[tuple[str, float, str]]:
    before, after = ({key: source.getncattr(key) for key in source.ncattrs()} for source in (old, new))
    for key in sorted((before.keys() | after.keys()) - PROVENANCE):
        was, is_ = (str(np.asarray(side[key]).tolist()) if key in side else "nothing" for side in (before, after))
        yield from ((f"{name}@{key}", np.inf, what) for what in _lines([was], [is_]))


def _values(old: Any, new: Any) -> Iterator[tuple[float, str]]:
    """Yield the size of the difference of two variables of the same shape, if they differ in a bit."""
    for variable in (old, new):
        variable.set_auto_maskandscale(False)
    was, is_ = np.asarray(old[...]), np.asarray(new[...])
    if was.dtype.kind in "OUS" or is_.dtype.kind in "OUS":
        differs = was != is_
        if np.any(differs):
            at = tuple(int(i) for i in np.argwhere(np.atleast_1d(differs))[0])
            yield (
                np.inf,
                f"{np.count_nonzero(differs)} texts, first “{np.atleast_1d(was)[at]}” → “{np.atleast_1d(is_)[at]}”",
            )
        return
    if was.tobytes() == is_.tobytes() and was.dtype == is_.dtype:
        return
    a, b = was.astype(float), is_.astype(float)
    differs = (a != b) & ~(np.isnan(a) & np.isnan(b))
    if not np.any(differs):
        yield 0.0, "equal numbers in other bits (the sign of a zero, a NaN)"
        return
    with np.errstate(invalid="ignore", divide="ignore"):
        sizes = np.abs(a - b) / np.maximum(np.abs(a), np.abs(b))
    sizes = np.where(differs, np.where(np.isfinite(sizes), sizes, np.inf), 0.0)
    at = np.unravel_index(int(np.argmax(sizes)), sizes.shape)
    values = f"{was[at]!r} → {is_[at]!r}".replace("np.", "")
    yield float(np.max(sizes)), f"{np.count_nonzero(differs)} of {differs.size} values, the largest {values}"


def _workbooks(old: Path, new: Path) -> Iterator[tuple[str, float, str]]:
    """Yield differences of cells."""
    before, after = (
        {
            f"{sheet.title}!{cell.coordinate}": _masked(str(cell.value))
            for sheet in openpyxl.load_workbook(path).worksheets
            for row in sheet.iter_rows()
            for cell in row
            if cell.value is not None
        }
        for path in (old, new)
    )
    for cell in sorted(before.keys() | after.keys()):
        if before.get(cell) != after.get(cell):
            yield cell, np.inf, f"“{before.get(cell, '')}” → “{after.get(cell, '')}”"
