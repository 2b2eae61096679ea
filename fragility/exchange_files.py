"""Files of curves: read whole and small, written whole or not at all, and the one error that all formats raise."""

from __future__ import annotations

import math
import os
from contextlib import suppress
from pathlib import Path

MAX_BYTES = 32 * 2**20


class ExchangeError(ValueError):
    """A file of curves that cannot be read, or curves that a format cannot hold; the message says which and why."""


def read_text(path: str | os.PathLike[str]) -> tuple[Path, str]:
    """A small text file whole; ExchangeError where it is missing, too large, empty, or not UTF-8."""
    file, content = read_bytes(path)
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise ExchangeError(f"{file}: not text in UTF-8") from None
    if "\0" in text:
        raise ExchangeError(f"{file}: not text (holds NUL bytes)")
    return file, text


def read_bytes(path: str | os.PathLike[str]) -> tuple[Path, bytes]:
    """A small file whole; ExchangeError where it is missing, too large or empty."""
    if not isinstance(path, str | os.PathLike):
        raise TypeError(f"path must be a path, got {type(path).__name__}")
    file = Path(path)
    try:
        if not file.is_file():
            raise ExchangeError(f"{file}: no such file" if not file.exists() else f"{file}: not a file")
        with file.open("rb") as stream:
            content = stream.read(MAX_BYTES + 1)
    except (OSError, ValueError) as error:
        if isinstance(error, ExchangeError):
            raise
        raise ExchangeError(f"{file}: cannot be read ({_reason(error)})") from None
    if len(content) > MAX_BYTES:
        raise ExchangeError(f"{file}: larger than {MAX_BYTES // 2**20} MiB, no set of curves is")
    if not content.strip():
        raise ExchangeError(f"{file}: empty")
    return file, content


def write_text(path: Path, text: str) -> Path:
    """Write a file whole or not at all; ExchangeError where it cannot be."""
    temporary = path.with_name(f"{path.name}.{os.getpid()}.part")
    try:
        temporary.write_text(text, encoding="utf-8", newline="")
        temporary.replace(path)
    except OSError as error:
        raise ExchangeError(f"{path}: cannot be written ({_reason(error)})") from None
    finally:
        with suppress(OSError):
            temporary.unlink(missing_ok=True)
    return path


def target(path: str | os.PathLike[str]) -> Path:
    """Where a writer writes; TypeError for what is no path."""
    if not isinstance(path, str | os.PathLike):
        raise TypeError(f"path must be a path, got {type(path).__name__}")
    return Path(path)


def number(file: Path, where: str, text: str) -> float:
    """A written number; ExchangeError where it is none, or not finite."""
    stripped = text.strip()
    try:
        # float() reads 1_000 and the digits of every script; a table has neither
        found = float(stripped) if stripped.isascii() and "_" not in stripped else math.nan
    except ValueError:
        found = math.nan
    if not math.isfinite(found):
        raise ExchangeError(f"{file}: {where} must be a finite number, got {stripped[:30]!r}")
    return found


def _reason(error: Exception) -> str:
    return (error.strerror if isinstance(error, OSError) else None) or str(error)
