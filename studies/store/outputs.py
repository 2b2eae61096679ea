"""Folders that a command writes again and again: only files recorded with their digests are replaced or removed."""

import hashlib
import json
from collections.abc import Collection, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from ...core.wording import system_errors, system_reason
from ...core.writing import write_bytes
from ..text.error import StudyError, writing

RECORD = ".toppling.json"
"""Name of the record: for each command the names of its files with their SHA-256."""
BEING_WRITTEN = ""
"""Instead of a digest, while the file is written: a run that was killed leaves it."""
Record = dict[str, dict[str, str]]


@contextmanager
def own_files(folder: Path, command: str, names: Collection[str]) -> Iterator[None]:
    """Write files of these names within; afterwards `command`'s earlier files are gone, and no other file changes."""
    made = not folder.exists()
    with system_errors(StudyError, f"{folder}: cannot be made a folder"):
        folder.mkdir(parents=True, exist_ok=True)
    record = _read(folder)
    before = _stamps(folder, names)
    for name in sorted(before):
        if not _is_ours(folder / name, record):
            raise StudyError(
                f"{folder / name}: was not written by toppling, or was changed since: move it away, or name another "
                "folder with --out"
            )
    others = {key: files for key, files in record.items() if key != command}
    _write(folder, {**others, command: dict.fromkeys(sorted(names), BEING_WRITTEN)})
    try:
        yield
    except BaseException:
        with suppress(StudyError):  # (the first error counts)
            _settle(folder, others, command, _stamps(folder, names), made)
        raise
    after = _stamps(folder, names)
    for name, stamp in before.items():
        if after.get(name) == stamp:
            _remove(folder / name)
    _settle(folder, others, command, _stamps(folder, names), made)


def _stamps(folder: Path, names: Collection[str]) -> dict[str, tuple[int, int]]:
    """Return the existing files of these names, each with its data that change when it is rewritten."""
    stamps = {}
    for name in names:
        with suppress(FileNotFoundError, NotADirectoryError):
            about = (folder / name).lstat()
            stamps[name] = about.st_ino, about.st_mtime_ns
    return stamps


def _is_ours(path: Path, record: Record) -> bool:
    if path.is_symlink() or not path.is_file():
        return False
    digests = {files[path.name] for files in record.values() if path.name in files}
    return BEING_WRITTEN in digests or file_digest(path) in digests


def file_digest(path: Path) -> str:
    """Return the SHA-256 of a file's bytes; StudyError if it cannot be read."""
    with system_errors(StudyError, f"{path}: cannot be read"), path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _read(folder: Path) -> Record:
    """Return the record of a folder; empty if there is none, or another content."""
    path = folder / RECORD
    try:
        record = json.loads(path.read_text(encoding="utf-8"))
    except (FileNotFoundError, ValueError, RecursionError):
        return {}
    except OSError as error:
        raise StudyError(f"{path}: cannot be read ({system_reason(error)})") from None
    if not isinstance(record, dict) or not all(isinstance(files, dict) for files in record.values()):
        return {}
    return {
        str(key): {str(name): str(digest) for name, digest in files.items()} for key, files in sorted(record.items())
    }


def _settle(folder: Path, others: Record, command: str, there: Collection[str], made: bool) -> None:
    """Write the record of the files that are there; remove it, and a folder made here, if there are none."""
    digests = {name: file_digest(folder / name) for name in sorted(there)}
    record = {**others, command: digests} if digests else others
    if record:
        _write(folder, record)
        return
    _remove(folder / RECORD)
    if made:
        with suppress(OSError):  # (not empty: files of others)
            folder.rmdir()


def _write(folder: Path, record: Record) -> None:
    path = folder / RECORD
    with writing(path):
        write_bytes(path, (json.dumps(record, indent=1, sort_keys=True) + "\n").encode())


def _remove(path: Path) -> None:
    with system_errors(StudyError, f"{path}: is of an earlier run and cannot be removed"):
        path.unlink(missing_ok=True)
