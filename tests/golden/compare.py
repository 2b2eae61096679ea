"""Compare what two versions made of the same case: every difference is an item, its size, and a line of words."""

import csv
import difflib
import json
import re
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from html.parser import HTMLParser
from pathlib import Path
from typing import Any, NamedTuple

import netCDF4
import numpy as np
import openpyxl
from worker import DIED, HUNG, REPORT

Found = tuple[str, str, float, str]
"""A file, an item in it, the size and the words of a difference."""

PROVENANCE = {"toppling_version", "package_versions", "identity", "machines", "processor", "content_sha256"}
"""Attributes of results that say who computed them, on what, and with which checksum: those may differ."""
MASKS = (
    (r'File "[^"]*", line \d+', "File …"),  # (of a traceback)
    (r"\b[0-9a-f]{32}-[0-9a-f]{32}\b", "IDENTITY"),
    (r"\b[0-9a-f]{64}\b", "SHA-256"),
    (r"\btoppling \d+\.\d+\.\d+\S*", "toppling VERSION"),
    (r"(?<=^processor \| ).*", "PROCESSOR"),
    (r"^(?:runs: |compiling ).*", ""),
    (r"[\d.,]+ [kMGT]?B are free", "FREE"),
    (r"[\d,]+(?= of [\d,]+ runs kept| runs that were kept)", "SOME"),
)
"""What a text may say otherwise from run to run: identity, checksums, versions, processor, times, rates, paths."""
EXPORTS = {".csv", ".xml", ".json"}
WRITTEN = {*EXPORTS, ".at2", ".txt"}
"""Files with all digits of their numbers, which are compared as numbers where the words are the same."""
NUMBER = re.compile(r"(?<![\w.])-?\d+(?:\.\d*)?(?:[eE][+-]?\d+)?(?![\w.])")
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
    variables: Callable[[str], str] = str,
) -> list[Difference]:
    """Return the differences of a case.

    Parameters
    ----------
    inputs : iterable of str
        Files of the case itself, which are not compared.
    names : sequence of str
        What a refusal must name; where given, only this of its sentence is compared.
    variables : callable
        Returns the name of a variable or dimension now, from that under the old commit.
    """
    ends = [[end["code"] for end in json.loads((side / REPORT).read_text(encoding="utf-8"))] for side in (old, new)]
    found = [*_commands(names, ends, old, new)]
    before, after = (_files(side, set(inputs)) for side in (old, new))
    if {DIED, HUNG} & {code for codes in ends for code in codes}:  # (the exit code says it all)
        before, after = {}, {}
    for name in sorted(before.keys() | after.keys()):
        if name not in after or name not in before:
            found.append(("", name, np.inf, "file is lost" if name in before else "file is new"))
            continue
        found += [(name, *rest) for rest in _file(before[name], after[name], variables)]
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


def _commands(names: Sequence[str], ends: Sequence[Sequence[Any]], old: Path, new: Path) -> Iterator[Found]:
    """Yield differences of exit codes and printed text."""
    for number, codes in enumerate(zip(*ends, strict=False), 1):
        if codes[0] != codes[1]:
            yield "", f"{number} exit", np.inf, f"{codes[0]} → {codes[1]}"
        if {DIED, HUNG} & {*codes}:
            return
        for stream in ("out", "err"):
            paths = [side / f".{number}.{stream}" for side in (old, new)]
            texts = [path.read_text("utf-8", "replace").replace(str(path.parent), "FOLDER") for path in paths]
            if stream == "err" and 2 in codes:  # a refusal counts by what it names
                named = [{place[0] for place in PLACES.finditer(text)} for text in texts]
                if names:
                    named = [{name for name in names if name in text} for text in texts]
                if named[0] != named[1]:
                    words = f"no longer names {sorted(lost)}" if (lost := named[0] - named[1]) else "names more"
                    yield "", f"{number} err", np.inf, f"{words}, is “{_masked(texts[1])}”"
            else:
                yield from (("", f"{number} {stream}", np.inf, what) for _, what in _lines(*map(str.splitlines, texts)))


def _opens(path: Path) -> bool:
    """Return whether a dataset can be opened; cases cut some short."""
    try:
        netCDF4.Dataset(path).close()
    except OSError:
        return False
    return True


def _file(old: Path, new: Path, variables: Callable[[str], str]) -> Iterator[tuple[str, float, str]]:
    """Yield the item within a file, the size and the words of each of its differences."""
    kind = new.suffix.lower()
    if kind in PICTURES or old.read_bytes() == new.read_bytes():
        return
    if kind == ".nc":
        whole = [_opens(path) for path in (old, new)]
        if whole[0] != whole[1]:
            yield "", np.inf, "can be read now" if whole[1] else "cannot be read"
        if all(whole):
            with netCDF4.Dataset(old) as before, netCDF4.Dataset(new) as after:
                yield from _datasets(before, after, variables)
    elif kind == ".xlsx":
        yield from _workbooks(old, new)
    else:
        texts = [path.read_bytes().decode("utf-8", "replace") for path in (old, new)]
        lines = [visible(text) if kind == ".html" else text.splitlines() for text in texts]
        differences = [*(_tables(*lines) if kind == ".csv" else _lines(*lines))]
        if not differences and kind in EXPORTS and _masked_lines(texts[0]) != _masked_lines(texts[1]):
            differences = [(np.inf, "the same words in other bytes (ends of lines, spaces)")]
        yield from (("", size if kind in WRITTEN else np.inf, what) for size, what in differences)


def _tables(old: Sequence[str], new: Sequence[str]) -> Iterator[tuple[float, str]]:
    """Yield which columns of a table are lost or new, and differences of the others."""
    rows = [list(csv.reader(table)) for table in (old, new)]
    before, after = ((table or [[]])[0] for table in rows)
    if Counter(before) == Counter(after):
        yield from _lines(old, new)
        return
    lost, came = Counter(before) - Counter(after), Counter(after) - Counter(before)
    yield np.inf, f"columns lost: {list(lost)}, new: {list(came)}"
    shared = [name for name in after if name in set(before) & set(after)]
    yield from _lines(*([",".join(row) for row in _chosen(table, shared)] for table in rows))


def _chosen(table: Sequence[Sequence[str]], columns: Sequence[str]) -> list[list[str]]:
    """Return some columns of a table; a row that is too short has empty cells."""
    places = [table[0].index(name) for name in columns] if table else []
    return [[row[place] if place < len(row) else "" for place in places] for row in table]


def _lines(old: Sequence[str], new: Sequence[str]) -> Iterator[tuple[float, str]]:
    """Yield the size and the words of each run of lines that differs, identity and the like masked."""
    before, after = ([masked for line in side if (masked := _masked(line))] for side in (old, new))
    if before != after and sorted(before) == sorted(after):
        yield np.inf, f"the same {len(before)} lines in another order"
        return
    for kind, i, j, k, m in difflib.SequenceMatcher(None, before, after, autojunk=False).get_opcodes():
        if kind != "equal":
            was, is_ = " / ".join(before[i:j]), " / ".join(after[k:m])
            start = next((at for at, (a, b) in enumerate(zip(was, is_, strict=False)) if a != b), 0)
            begin = max(0, start - 40)
            yield _size(was, is_), f"“{was[begin : begin + 100]}” → “{is_[begin : begin + 100]}”"


def _size(was: str, is_: str) -> float:
    """Return the largest relative difference of the numbers of two texts, infinity where other words differ."""
    if NUMBER.sub("", was) != NUMBER.sub("", is_):
        return np.inf
    a, b = (np.array(NUMBER.findall(text), dtype=float) for text in (was, is_))
    if a.size != b.size:  # (a column came or went)
        return np.inf
    return max((size for size, _ in _numbers(a, b)), default=0.0)


def _masked_lines(text: str) -> list[str]:
    """Return the lines of an export with their ends, identity and the like masked."""
    return [_mask(line) for line in text.splitlines(keepends=True)]


def _masked(line: str) -> str:
    return " ".join(_mask(line).split())


def _mask(line: str) -> str:
    for pattern, mask in MASKS:
        line = re.sub(pattern, mask, line)
    return line


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


def _datasets(old: Any, new: Any, names: Callable[[str], str]) -> Iterator[tuple[str, float, str]]:
    """Yield differences of variables, dimensions, types, units and attributes."""
    before, after = {_now(name, names): old[name] for name in old.variables}, dict(new.variables)
    for name in sorted(before.keys() | after.keys()):
        if name not in after or name not in before:
            yield name, np.inf, "variable is lost" if name in before else "variable is new"
            continue
        was, is_ = before[name], after[name]
        dims = [_now(dim, names) for dim in was.dimensions]
        # (names that changed come with one order of dimensions)
        order = (
            [dims.index(dim) for dim in is_.dimensions] if {*dims} == {*is_.dimensions} and names is not str else None
        )
        dims, shape = (dims, was.shape) if order is None else (list(is_.dimensions), tuple(was.shape[i] for i in order))
        for what, a, b in (
            ("dimensions", dims, list(is_.dimensions)),
            ("type", str(was.dtype), str(is_.dtype)),
            ("shape", shape, is_.shape),
        ):
            if a != b:
                yield name, np.inf, f"{what} {a} → {b}"
        if shape == is_.shape:
            yield from ((name, size, what) for size, what in _values(was, is_, order))
        yield from _attributes(name, was, is_)
    yield from _attributes("", old, new)


def _now(name: str, names: Callable[[str], str]) -> str:
    """Return the name that a variable has now, by the last part of its name in the datasets of scripts."""
    return re.sub(r"\w+$", lambda last: names(last[0]), name)


def _attributes(name: str, old: Any, new: Any) -> Iterator[tuple[str, float, str]]:
    before, after = ({key: source.getncattr(key) for key in source.ncattrs()} for source in (old, new))
    for key in sorted((before.keys() | after.keys()) - PROVENANCE):
        was, is_ = (np.asarray(side.get(key, "nothing")) for side in (before, after))
        if was.dtype.kind in "iuf" and is_.dtype.kind in "iuf" and was.shape == is_.shape:
            yield from ((f"{name}@{key}", size, what) for size, what in _numbers(was, is_))
        else:
            texts = ([str(side.tolist())] for side in (was, is_))
            yield from ((f"{name}@{key}", size, what) for size, what in _lines(*texts))


def _values(old: Any, new: Any, order: Sequence[int] | None = None) -> Iterator[tuple[float, str]]:
    """Yield the size of the difference of two variables of the same shape, if they differ in a bit."""
    for variable in (old, new):
        variable.set_auto_maskandscale(False)
    was, is_ = np.asarray(old[...]), np.asarray(new[...])
    if order is not None:
        was = was.transpose(order)
    if was.dtype.kind in "OUS" or is_.dtype.kind in "OUS":
        differing = [(a, b) for a, b in zip(np.ravel(was), np.ravel(is_), strict=True) if a != b]
        if differing:
            size = max(_size(*map(str, pair)) for pair in differing)
            yield size, f"{len(differing)} texts, the first “{differing[0][0]}” → “{differing[0][1]}”"
    else:
        yield from _numbers(was, is_)


def _numbers(was: np.ndarray, is_: np.ndarray) -> Iterator[tuple[float, str]]:
    """Yield the size of the difference of two arrays of the same shape, if they differ in a bit."""
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
    values = f"{was[at].item()!r} → {is_[at].item()!r}"
    yield float(np.max(sizes)), f"{np.count_nonzero(differs)} of {differs.size} values, the largest {values}"


def _workbooks(old: Path, new: Path) -> Iterator[tuple[str, float, str]]:
    """Yield differences of the order of sheets, of their headings and of cells, with their formats."""
    books = [openpyxl.load_workbook(path) for path in (old, new)]
    if books[0].sheetnames != books[1].sheetnames:
        yield "", np.inf, f"sheets {books[0].sheetnames} → {books[1].sheetnames}"
    for title in [title for title in books[1].sheetnames if title in books[0].sheetnames]:
        before, after = (_sheet(book[title]) for book in books)
        headings = [list(dict.fromkeys(column for column, _ in sheet)) for sheet in (before, after)]
        lost, came = (sorted({*a} - {*b}) for a, b in (headings, headings[::-1]))
        if lost or came:
            yield title, np.inf, f"columns lost: {lost}, new: {came}"
        shared = [[name for name in names if name not in {*lost, *came}] for names in headings]
        if shared[0] != shared[1]:
            yield title, np.inf, "columns in another order"
        for column, row in sorted(before.keys() | after.keys()):
            cells = [sheet.get((column, row), "") for sheet in (before, after)]
            if column in shared[0] and cells[0] != cells[1]:
                yield f"{title}!{column}{row}", _size(*cells), f"“{cells[0]}” → “{cells[1]}”"


def _sheet(sheet: Any) -> dict[tuple[str, str], str]:
    """Return the cells of a sheet by heading and row; by letter where the column has no heading of its own."""
    names = Counter(cell.value for cell in sheet[1])
    return {
        (
            str(head)
            if isinstance(head := sheet.cell(1, cell.column).value, str) and names[head] == 1
            else cell.column_letter,
            str(cell.row),
        ): _masked(f"{cell.value!r} {cell.number_format}")
        for row in sheet.iter_rows()
        for cell in row
        if cell.value is not None
    }
