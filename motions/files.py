"""What all record readers share: bytes to text, the error they raise, numbers out of fields."""

from __future__ import annotations

import os
import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..units import STANDARD_GRAVITY

MAX_BYTES = 256 * 2**20

# m/s² per unit of acceleration, by the unit's normal spelling.
_UNITS = {"g": STANDARD_GRAVITY, "gal": 0.01, "gals": 0.01, "cm/s2": 0.01, "cm/s/s": 0.01, "m/s2": 1.0, "m/s/s": 1.0}


class RecordError(ValueError):
    """A record file that cannot be read as what it claims to be; the message names the file and what is wrong."""


def text_of(path: str | os.PathLike[str]) -> tuple[Path, str]:
    """The text of a record file; RecordError where it is missing, no file, too large, empty or not text."""
    if not isinstance(path, str | os.PathLike):
        raise TypeError(f"path must be a path, got {type(path).__name__}")
    file = Path(path)
    try:
        if not file.is_file():
            raise RecordError(f"{file}: no such file" if not file.exists() else f"{file}: not a file")
        if file.stat().st_size > MAX_BYTES:
            raise RecordError(f"{file}: larger than {MAX_BYTES // 2**20} MiB, no record is")
        data = file.read_bytes()
    except OSError as error:
        raise RecordError(f"{file}: cannot be read ({error.strerror})") from error
    if not data.strip():
        raise RecordError(f"{file}: empty")
    if b"\0" in data:
        raise RecordError(f"{file}: not text (holds NUL bytes)")
    text = data.decode("utf-8-sig", errors="replace")
    if re.match(r"\s*<(?:!doctype|html|\?xml)", text, re.IGNORECASE):
        raise RecordError(f"{file}: a web page or XML, not a record")
    return file, text


def unit_factor(word: str) -> float | None:
    """m/s² per unit of acceleration, as people write it (g, gal, cm/s², m/s^2, cm/sec/sec, m s-2); None if unknown."""
    text = word.strip().strip(".,;:()[]").lower().replace("sec", "s").replace("²", "2")
    text = re.sub(r"\^|\*\*", "", text)
    text = re.sub(r"^(c?m)[\s_]*/?[\s_]*s-?2$", r"\1/s2", text)
    return _UNITS.get(text.replace(" ", ""))


def numbers(file: Path, text: str, first_line: int) -> NDArray[np.float64]:
    """All numbers of `text`, also where fixed columns run together; RecordError naming the line of what is none.

    `first_line` is the number of the text's first line in the file.
    """
    try:
        values = np.array(text.split(), dtype=np.float64)
    except ValueError:
        found: list[float] = []
        for i, line in enumerate(text.splitlines()):
            rest = line.strip()
            while rest:
                match = _NUMBER.match(rest)
                if match is None:
                    raise RecordError(f"{file}: line {first_line + i} holds {rest[:20]!r}, no number") from None
                found.append(float(match.group(0).replace("D", "E").replace("d", "e")))
                rest = rest[match.end() :].lstrip()
        values = np.array(found)
    if not np.isfinite(values).all():
        where = int(np.flatnonzero(~np.isfinite(values))[0])
        raise RecordError(f"{file}: sample {where + 1} is {values[where]}, not a finite number")
    return values


_NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eEdD][-+]?\d+)?(?=$|[\s,+-])")
