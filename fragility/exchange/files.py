"""Atomic writing, and the error that all exchange formats raise."""

from __future__ import annotations

import os
from pathlib import Path

from ...core.wording import system_reason
from ...core.writing import write_bytes


class ExchangeError(ValueError):
    """A file that cannot be written, or curves that a format cannot hold; the message gives the reason."""


def write_text(path: Path, text: str) -> Path:
    """Write a file completely or not at all; ExchangeError where it cannot be written."""
    try:
        write_bytes(path, text.encode("utf-8"))
    except OSError as error:
        raise ExchangeError(f"{path}: cannot be written ({system_reason(error)})") from None
    return path


def target(path: str | os.PathLike[str]) -> Path:
    """Return the path that a writer writes to; TypeError for anything other than a path."""
    if not isinstance(path, str | os.PathLike):
        raise TypeError(f"path must be a path, got {type(path).__name__}")
    return Path(path)
