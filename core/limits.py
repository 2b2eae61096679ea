"""Limits of files that a person may be sent: checked before a parser unfolds them, so that none takes long or much.

Each is well above the largest known right file. A study of 2,000 blocks has 0.2 MB, and a workbook of 10,000 pieces and
40 columns 400,000 cells. A record of an hour at 1,000 Hz has 60 MB of text, and a hazard of 200 realisations 20 MB.
"""

from __future__ import annotations

import io
import itertools
import math
import os
import re
import sys
import weakref
import zipfile
from collections import Counter
from collections.abc import Callable, Collection, Iterator
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .wording import system_reason
from .writing import refuse_pipe

if TYPE_CHECKING:
    import netCDF4
    import xarray as xr

STUDY_BYTES = 2**20
"""Of a study file (TOML) and of each file that it includes."""
KEYS, ENTRIES = 1_000, 100_000
"""Of a table of a study, and of a list: unknown keys are compared with all known keys, entries are read."""
RECORD_BYTES, OBSPY_BYTES = 512 * 2**20, 128 * 2**20
"""Of a record as text, and as a binary file (miniSEED, SAC), whose samples unfold to four times as much."""
CURVE_BYTES = 32 * 2**20
"""Of curves and hazards for other programs (CSV, JSON, NRML)."""
DECLARED_BYTES, DECLARED_RATIO = 2**28, 20
"""Limits of the arrays that a netCDF file declares: bytes in any file, and the ratio to the bytes of larger files.
Results are not compressed, and compressed accelerations take half to a tenth.
"""
CHUNK_BYTES, CHUNKS_BYTES = 2**13, 2**29
"""What the HDF5 library takes at least in memory for a chunk of an array, and at most for all."""
VARIABLES, HEADER = 2_000, 10_000
"""Of a netCDF file, and of its dimensions, attributes or variables in the header of a classic one."""
_CLASSIC_BYTES = {3: 2, 4: 4, 5: 4, 6: 8, 8: 2, 9: 4, 10: 8, 11: 8}
"""Of the number types of classic netCDF files that take more than a byte."""
SMALL_NETCDF = 2**25
"""Of a netCDF file that is read into memory before it is opened."""
STRING_BYTES = 64
"""Of a string of any length in memory."""
CELLS, ROWS = 500_000, 200_000
"""Of all sheets of a workbook."""
PARTS, ATTRIBUTES = 10_000, 10_000
"""Of a workbook, and of one of its elements."""
ELEMENTS = {
    "sheet": 256,
    "mergeCell": 1_000,
    "xf": 65_000,
    "row": ROWS,
    **dict.fromkeys(("c", "v", "f", "t", "si", "is"), CELLS),
}
"""Of one kind in a workbook, if another number than OTHERS is allowed (cell formats: the program's own limit)."""
OTHERS = 20_000
"""Of any other kind (hyperlinks, rules, names); runs of rich text are limited by the bytes alone."""
COVERED = 100_000
"""Cells that merged ranges and hyperlinks cover together: the reader makes an object of each."""
_OF_CONTENT = ("r", "rPr", "rFont", "sz", "color", "family", "scheme", "charset")
_NAME = rb"<(?:[^\s<>/:=!?&\"']+:)?"
_TAG = re.compile(_NAME + rb"([A-Za-z]\w*)")
_RANGE = re.compile(
    _NAME + rb"(?:mergeCell|hyperlink)\b[^>]*?\bref\s*=\s*[\"']"
    rb"\$?([A-Z]+)\$?(\d+)(?::\$?([A-Z]+)\$?(\d+))?[\"']"
)
_FORMULA = re.compile(rb"(" + _NAME + rb"f)\s(?:[^<>\"']|\"[^\"]*\"|'[^']*')*?(/?)>")
_LONG = re.compile(rb"<[^<]{50000,}")
_SHEETS = ("worksheet", "chartsheet", "dialogsheet", "macrosheet")


def whole_content(file: Path, most_bytes: int, what: str, error: type[Exception]) -> bytes:
    """Return the bytes of a file; `error` if it is missing, no file, unreadable, or too large for any `what`."""
    try:
        if not file.is_file():
            raise error(f"{file}: {'not a file' if file.exists() else 'no such file'}")
        with file.open("rb") as stream:
            content = stream.read(most_bytes + 1)
    except (OSError, ValueError) as wrong:
        if isinstance(wrong, error):
            raise
        raise error(f"{file}: cannot be read ({system_reason(wrong)})") from None
    if len(content) > most_bytes:
        raise error(f"{file}: larger than {most_bytes // 2**20} MiB, no {what} is")
    return content


class DeclaredError(RuntimeError):
    """A netCDF file declares more than it holds, so that reading it would fill the memory."""


def memory_limit() -> int:
    """Return the limit on this process's memory (kB) that its shell set; 0 if there is none."""
    with suppress(ImportError):  # (Windows has none)
        import resource  # noqa: PLC0415

        limit = resource.getrlimit(resource.RLIMIT_AS)[0]
        return 0 if limit == resource.RLIM_INFINITY else limit // 1024
    return 0


def checked_workbook(parts: zipfile.ZipFile, most_bytes: int, refused: Callable[[str], Exception]) -> io.BytesIO:
    """Return a workbook with the parts that were checked and no others; `refused` makes the error of one that unfolds.

    Sizes in the directory of a ZIP file may be wrong, and names may occur twice.
    """
    names = parts.namelist()
    if len(names) > PARTS:
        raise refused(f"holds {len(names):,} parts, allowed are {PARTS:,}; copy the table to a new workbook")
    if sum(part.file_size for part in parts.infolist()) > most_bytes:
        raise refused(f"larger than {most_bytes // 2**20} MiB once it is unpacked")
    copy = io.BytesIO()
    counts: Counter[str] = Counter()
    covered = 0
    with zipfile.ZipFile(copy, "w") as checked:
        for name in dict.fromkeys(names):
            with parts.open(name) as part:
                text = part.read(parts.getinfo(name).file_size + 1)
            # (of formulas their presence counts: shared ones, which the reader writes out for each cell, become plain)
            checked.writestr(zipfile.ZipInfo(name), _FORMULA.sub(rb"\1\2>", text))
            if name.endswith((".xml", ".rels")):
                problem, cells = _part_problem(text, counts)
                covered += cells
                if problem is not None:
                    raise refused(f"not a workbook (XLSX) that can be read: {name[:60]!r} {problem}; save it again")
    for kind, number in counts.items():
        most = ELEMENTS.get(kind, OTHERS)
        if kind not in _OF_CONTENT and number > most:
            raise refused(
                f"holds {number:,} elements {kind[:30]!r}, allowed are {most:,}; copy the table to a new workbook"
            )
    if counts["sheet"] > sum(counts[kind] for kind in _SHEETS):
        raise refused("names more sheets than it holds; copy the table to a new workbook")
    if covered > COVERED:
        raise refused(
            f"merged cells or links cover {covered:,} cells, allowed are {COVERED:,}; copy the table elsewhere"
        )
    copy.seek(0)
    return copy


def _part_problem(text: bytes, counts: Counter[str]) -> tuple[str | None, int]:
    """Count the elements of a part of a workbook; return why it cannot be read, and the cells that its ranges cover."""
    if b"<!DOCTYPE" in text or b"\0" in text:
        return "has a document type or zeros", 0
    named = Counter(match[1].decode() for match in _TAG.finditer(text))
    counts.update(named)
    if any(long[0].count(b"=") > ATTRIBUTES for long in _LONG.finditer(text)):
        return f"has an element with more than {ATTRIBUTES:,} attributes", 0
    ranges = _RANGE.findall(text)
    if len(ranges) < named["mergeCell"] + named["hyperlink"]:
        return "has merged cells or links in a spelling of no program", 0
    covered = 0
    for left, first, right, last in ranges:
        covered += (abs(_column(right or left) - _column(left)) + 1) * (abs(int(last or first) - int(first)) + 1)
    return None, covered


def _column(letters: bytes) -> int:
    number = 0
    for letter in letters:
        number = 26 * number + letter - ord("A") + 1
    return number


def small_netcdf(path: Path) -> bytes | None:
    """Return the content of a small file of HDF5, None for a larger or a classic one; OSError if it cannot be read.

    The HDF5 library ends its process if a disk fails to close a file, so that it opens small files in memory (larger
    files: `opened_netcdf`).
    """
    refuse_pipe(path)
    with path.open("rb") as file:
        content = file.read(SMALL_NETCDF + 1)
    return content if content.startswith(b"\x89HDF") and len(content) <= SMALL_NETCDF else None


def open_netcdf(path: Path, refused: Callable[[str], Exception]) -> xr.Dataset:
    """Open a netCDF file whose arrays are read when they are used; OSError or RuntimeError if this fails.

    A file that declares more than its size allows would fill the memory: `refused` makes its error of the reason.
    """
    import xarray as xr  # noqa: PLC0415 - most commands read no such file
    from xarray.backends import NetCDF4DataStore  # noqa: PLC0415
    from xarray.backends.netCDF4_ import NETCDF4_PYTHON_LOCK  # noqa: PLC0415 - the library takes one thread at a time

    content = small_netcdf(path)
    with NETCDF4_PYTHON_LOCK:
        try:
            file, release = opened_netcdf(path, content)
        except DeclaredError as error:
            raise refused(str(error)) from None

    def close() -> None:
        release()
        file.close()

    store = NetCDF4DataStore(file)  # type: ignore[no-untyped-call]
    # (arrays that are still to be read hold the manager: without them it is collected, and then the file)
    weakref.finalize(store._manager, release)
    dataset = xr.open_dataset(store)
    dataset.set_close(close)
    return dataset


def _declared_problem(variables: Collection[netCDF4.Variable[Any]], size: int) -> str | None:
    """Return why the arrays of a netCDF file of some bytes would fill the memory."""
    import netCDF4  # noqa: PLC0415 - most commands read no such file

    if len(variables) > VARIABLES:
        return f"holds {len(variables):,} variables, allowed are {VARIABLES:,}"
    most, declared, handled = max(DECLARED_BYTES, DECLARED_RATIO * size), 0, 0
    for variable in variables:
        if isinstance(variable.datatype, netCDF4.VLType) and variable.dtype is not str:
            return f"{variable.name}: lists of any length are not supported"
        taken = math.prod(variable.shape) * (STRING_BYTES if variable.dtype is str else variable.dtype.itemsize)
        if isinstance(chunk := variable.chunking(), list):
            chunks = math.prod(-(-length // part) for length, part in zip(variable.shape, chunk, strict=True))
            handled += CHUNK_BYTES * chunks
        declared += taken
    if handled > CHUNKS_BYTES:
        return f"holds {handled // CHUNK_BYTES:,} chunks, allowed are {CHUNKS_BYTES // CHUNK_BYTES:,}"
    if declared <= most:
        declared = next((total for total in itertools.accumulate(_letters(variables, most // size)) if total > most), 0)
    return f"declares {declared / 1e9:,.1f} GB, more than a file of its size holds" if declared > most else None


def _letters(variables: Collection[netCDF4.Variable[Any]], step: int) -> Iterator[int]:
    """Count the letters of strings, so few at a time that each may be the longest: many may be stored once."""
    for variable in variables:
        if variable.dtype is str and variable.shape:
            for leading in itertools.product(*map(range, variable.shape[:-1])):
                for first in range(0, variable.shape[-1], step):
                    yield sum(map(len, variable[(*leading, slice(first, first + step))]))


def _classic_problem(path: Path) -> str | None:
    """Return why the header of a classic netCDF file would fill the memory: the library believes its counts."""
    with path.open("rb") as stream:
        magic = stream.read(4)
        if magic[:3] != b"CDF":
            return None
        wide, most = 8 if magic[3] == 5 else 4, path.stat().st_size
        largest = 0

        def count(size: int, times: int = 1) -> int:
            nonlocal largest
            number = int.from_bytes(stream.read(size))
            largest = max(largest, number * times)
            return number if largest <= most else 0

        def skip(size: int) -> None:
            stream.seek(-(-size // 4) * 4, os.SEEK_CUR)

        def entries() -> range:
            stream.seek(4, os.SEEK_CUR)
            return range(count(wide, most // HEADER + 1))

        def attributes() -> None:
            for _ in entries():
                skip(count(wide))
                bytes_of = _CLASSIC_BYTES.get(count(4), 1)
                skip(count(wide, bytes_of) * bytes_of)

        stream.seek(wide, os.SEEK_CUR)
        for _ in entries():  # dimensions
            skip(count(wide))
            stream.seek(wide, os.SEEK_CUR)
        attributes()
        for _ in entries():  # variables
            skip(count(wide))
            skip(count(wide, wide) * wide)
            attributes()
            stream.seek(4 + wide + (4 if magic[3] == 1 else 8), os.SEEK_CUR)
    return "declares more than a file of its size holds" if largest > most else None


_HELD: dict[tuple[int, int], list[set[int]]] = {}
"""The descriptors of each file, by device and number, that the HDF5 library opened for each of its datasets."""


def opened_netcdf(path: Path, content: bytes | None) -> tuple[netCDF4.Dataset, Callable[[], None]]:
    """Open a file whose content is from `small_netcdf`, and return a function to call before it is closed.

    DeclaredError for a file that would fill the memory. The HDF5 library ends its process if the system refuses to
    close a file.  Before that, the null device takes the place of the file's descriptors, which are one for all
    datasets of a file.
    """
    import netCDF4  # noqa: PLC0415 - most commands read no such file

    if content is None and (problem := _classic_problem(path)):
        raise DeclaredError(problem)
    if content is not None or sys.platform != "linux":
        file, release = netCDF4.Dataset(path, memory=content), _nothing
    else:
        file, release = _held(path)
    if problem := _declared_problem(file.variables.values(), path.stat().st_size):
        release()
        file.close()
        raise DeclaredError(problem)
    return file, release


def _nothing() -> None:
    """Release nothing: the file is in memory."""


def _held(path: Path) -> tuple[netCDF4.Dataset, Callable[[], None]]:
    """Open a file by its path, and return what releases its descriptors."""
    import netCDF4  # noqa: PLC0415 - most commands read no such file

    stat = path.stat()
    before = _descriptors(stat)
    file = netCDF4.Dataset(path)
    held = _HELD.setdefault((stat.st_dev, stat.st_ino), [])
    held.append(_descriptors(stat) - before)
    released = False

    def release() -> None:
        nonlocal released
        if released:
            return
        released = True
        if len(held) > 1:  # (another dataset has the same descriptor)
            held[:2] = [held[0] | held[1]]
            return
        for descriptor in held.pop():
            with suppress(OSError), Path(os.devnull).open("rb") as null:
                os.dup2(null.fileno(), descriptor, inheritable=False)

    return file, release


def _descriptors(stat: os.stat_result) -> set[int]:
    """Return the descriptors of a file that this process has open."""
    descriptors = set()
    for name in os.listdir("/proc/self/fd"):
        with suppress(OSError):
            if os.path.samestat(os.fstat(int(name)), stat):
                descriptors.add(int(name))
    return descriptors
