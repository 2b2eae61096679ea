"""Reading of small files, atomic writing, and the error that all exchange formats raise."""

import math
import os
from pathlib import Path

from ...core import checks
from ...core.limits import CURVE_BYTES, whole_content
from ...core.wording import system_reason
from ...core.writing import write_bytes


class ExchangeError(ValueError):
    """A file of curves that cannot be read, or curves that a format cannot represent; the message gives the reason."""


def read_text(path: str | os.PathLike[str]) -> tuple[Path, str]:
    """Read a small text file; ExchangeError if it is missing, too large, empty, or not UTF-8."""
    file, content = read_bytes(path)
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise ExchangeError(f"{file}: not text in UTF-8") from None
    if "\0" in text:
        raise ExchangeError(f"{file}: not text (holds NUL bytes)")
    return file, text


def read_bytes(path: str | os.PathLike[str]) -> tuple[Path, bytes]:
    """Read a small file; ExchangeError if it is missing, too large or empty."""
    file = checks.path(path)
    content = whole_content(file, CURVE_BYTES, "set of curves", ExchangeError)
    if not content.strip():
        raise ExchangeError(f"{file}: empty")
    return file, content


def write_text(path: Path, text: str) -> Path:
    """Write a file completely or not at all; ExchangeError if it cannot be written."""
    try:
        write_bytes(path, text.encode("utf-8"))
    except OSError as error:
        raise ExchangeError(f"{path}: cannot be written ({system_reason(error)})") from None
    return path


def number(file: Path, where: str, text: str) -> float:
    """Return the number in a text; ExchangeError if it is no number, or not finite."""
    stripped = text.strip()
    try:
        # float() reads 1_000 and the digits of every script; a table has neither
        value = float(stripped) if stripped.isascii() and "_" not in stripped else math.nan
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise ExchangeError(f"{file}: {where} must be a finite number, got {stripped[:30]!r}")
    return value
