"""Files that are named by a pattern, such as ``records/*.AT2``."""

from __future__ import annotations

import glob
import os
import sys
from contextlib import suppress
from pathlib import Path

from ...core.wording import system_reason
from .lines import RecordError

MOST_FILES = 100_000
"""Most files and folders that a pattern may look at; more of them means minutes in a folder too high up."""


def expand(patterns: str | list[str], folder: Path, what: str = "records") -> list[Path]:
    """Return the files that patterns name, sorted, each once; RecordError if a pattern names none or too many."""
    chosen: dict[Path, None] = {}
    for pattern in [patterns] if isinstance(patterns, str) else patterns:
        try:
            _refuse_wide(pattern, folder)
            matches = sorted(glob.glob(pattern, root_dir=folder, recursive=True))
            files = [folder / match for match in matches if (folder / match).is_file()]
            # a name with brackets is a pattern that does not match itself
            if not files and (folder / pattern).is_file():
                files = [folder / pattern]
        except (OSError, ValueError) as error:
            raise RecordError(f"{what}: {pattern!r:.60} cannot be looked for ({system_reason(error)})") from None
        if not files:
            raise RecordError(f"{what}: no file matches {pattern!r:.60} (looked in {folder.resolve()})")
        chosen.update(dict.fromkeys(files))
    return list(chosen)


def _refuse_wide(pattern: str, folder: Path) -> None:
    """Raise a ValueError if a pattern looks at too many files, counted before glob, which cannot be stopped."""
    parts = Path(pattern).parts
    if "\0" in pattern or not parts:
        raise ValueError("no name of a file")
    first = next((i for i, part in enumerate(parts) if glob.has_magic(part)), len(parts))
    if first == len(parts):
        return
    if parts.count("**") > 1:
        raise ValueError("** may stand once")
    deepest = sys.maxsize if "**" in parts else len(parts) - first
    left = [(str(folder.joinpath(*parts[:first])), 1)]
    seen = 0
    while left:
        at, depth = left.pop()
        with suppress(OSError), os.scandir(at) as entries:  # as glob does, which skips folders that it may not enter
            for entry in entries:
                seen += 1
                if seen > MOST_FILES:
                    raise ValueError(f"there are more than {MOST_FILES:,} files to look at: name a folder further down")
                if depth < deepest and entry.is_dir():
                    left.append((entry.path, depth + 1))


def is_pattern(path: str | os.PathLike[str]) -> bool:
    """Return True for a pattern that names files; False for the name of a file, which may have brackets itself."""
    return isinstance(path, str | os.PathLike) and glob.has_magic(os.fspath(path)) and not Path(path).exists()
