"""The folder of a study: used by one process at a time; results are written whole or not at all, and recognised."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...core.wording import system_reason
from ...core.writing import whole_file, write_bytes
from ..text.error import StudyError
from .manifest import read_manifest
from .netcdf import WHOLE_BYTES, load_small, look_through, opened, write

if TYPE_CHECKING:
    import xarray as xr
    from filelock import FileLock

# (labelled arrays, locks and the keys of studies load slowly: `toppling status` of a finished study needs none, and the
# functions that do import them by themselves)

RESULT_NAME = "results.nc"
LOCK_NAME = ".lock"
UNREADABLE = (OSError, ValueError, LookupError, TypeError, AttributeError, ArithmeticError)
"""Errors of the libraries for a damaged file, or for attributes that make no sense."""
LOCK_SECONDS = 0.5
"""Time to wait for a lock, since a process that only checks the lock has it for a moment too."""
LOCK_ATTEMPTS = 20
"""Attempts to lock a folder that another process removes as it leaves."""


@contextmanager
def folder_of_one(folder: Path) -> Iterator[None]:
    """Lock a folder, made if missing, for this process until the block ends; an empty new one is removed."""
    name = str(folder)
    if os.sep != "\\" and "\\" in name:
        raise StudyError(f"{name}: the folder's name must hold no backslash, which netCDF takes for a slash")
    try:
        name.encode()
    except UnicodeEncodeError:
        raise StudyError(f"{name!a}: the folder's name is no valid Unicode, which netCDF cannot write") from None
    made = not folder.exists()
    lock = _locked(folder)
    try:
        yield
    finally:
        with suppress(OSError):  # (removed while still locked: a process that waits for the removed file tries again)
            (folder / LOCK_NAME).unlink()
        with suppress(OSError):  # (the system releases the lock of a process that ends)
            lock.release()
        if made:
            with suppress(OSError):  # not empty, or another run's by now
                folder.rmdir()


def _locked(folder: Path) -> FileLock:
    """Return the lock of a folder, made if missing; StudyError as `folder_of_one`."""
    from filelock import FileLock, Timeout  # noqa: PLC0415

    lock = FileLock(folder / LOCK_NAME)
    for attempt in range(LOCK_ATTEMPTS):
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            gone = folder.is_dir() or not folder.exists()  # (it was removed between two questions, and may be back)
            if isinstance(error, FileExistsError) and gone and attempt < LOCK_ATTEMPTS - 1:
                continue
            raise StudyError(f"{folder}: cannot be made a folder ({system_reason(error)})") from None
        try:
            lock.acquire(timeout=LOCK_SECONDS)
            return lock
        except Timeout:
            raise StudyError(
                f"{folder}: another process runs a study there; wait for it, or use another folder"
            ) from None
        except OSError as error:
            # (a process that made the folder, and leaves it empty, removes it at this moment)
            if not isinstance(error, FileNotFoundError | FileExistsError) or attempt == LOCK_ATTEMPTS - 1:
                if folder.exists() and not os.access(folder, os.W_OK):
                    raise StudyError(f"{folder}: no permission to write") from None
                raise StudyError(f"{folder / LOCK_NAME}: cannot be locked ({system_reason(error)})") from None
    raise AssertionError  # (the last attempt returns or raises)


def is_locked(folder: Path) -> bool:
    """Return True if a process works in the folder; StudyError if its lock cannot be read."""
    path = folder / LOCK_NAME
    if not path.exists():
        return False
    from filelock import FileLock, Timeout  # noqa: PLC0415

    lock = FileLock(path)
    try:
        lock.acquire(timeout=0)
    except PermissionError:
        return _is_held(path)
    except (Timeout, OSError):
        return True
    lock.release()
    return False


def _is_held(path: Path) -> bool:
    """Return True if a process has a lock that only another user may write; StudyError if it cannot be read."""
    import fcntl  # noqa: PLC0415 - Windows has none

    try:
        with path.open("rb") as file:
            fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    except OSError as error:
        raise StudyError(f"{path}: cannot be read ({system_reason(error)})") from None
    return False


def result_file(path: Path) -> Path:
    """Return a file, or the results in a folder; StudyError if its study is not finished or there is none."""
    if not path.is_dir():
        return path
    refuse_unfinished(path, path)
    target = path / RESULT_NAME
    if not target.exists():
        raise StudyError(f"{target}: no such file; the folder holds no results of a study")
    return target


def refuse_unfinished(named: Path, folder: Path) -> None:
    """Raise a StudyError if the study of a folder runs or was interrupted; the error begins with `named`."""
    if is_locked(folder):
        raise StudyError(f"{named}: its study is running: wait until it is finished")
    if read_manifest(folder) is not None:
        raise StudyError(f"{named}: its study is not finished: the same toppling run goes on where it stopped")


def refuse_folder(target: Path) -> None:
    """Raise a StudyError if a folder has the name of the result file."""
    if target.is_dir():
        raise StudyError(f"{target}: is a folder; move it away")


def finished(target: Path, identity: str, study: Mapping[str, Any]) -> xr.Dataset | None:
    """Return the finished results of the study of this identity, or None if there are none."""
    with reading(target, "; move it away or use --fresh"):
        if not target.exists():
            return None
        with ExitStack() as closing:
            stored = closing.enter_context(opened(target))
            about = dict(stored.attrs)
            if str(about.get("identity")) == identity:
                try:
                    load_small(stored)
                    look_through(stored)
                except (OSError, RuntimeError):
                    raise damaged(target) from None
                if any(variable.nbytes > WHOLE_BYTES for variable in stored.variables.values()):
                    closing.pop_all()  # (large variables are read when they are used)
                return stored
    raise StudyError(
        f"{target}: holds the results of another study{_other(about, study, identity)}; use another folder or --fresh"
    )


@contextmanager
def reading(path: Path, fix: str = "") -> Iterator[None]:
    """Raise StudyError for a result file that is missing, damaged or none, or that the system refuses to read."""
    try:
        yield
    except StudyError:
        raise
    except FileNotFoundError:
        raise StudyError(f"{path}: no such file") from None
    except RuntimeError:  # (the netCDF library's error for checksums that do not fit)
        raise damaged(path) from None
    except UNREADABLE as error:
        if isinstance(error, OSError) and (error.errno or 0) > 0:  # (the netCDF library's own numbers are negative)
            raise StudyError(f"{path}: cannot be read ({system_reason(error)})") from None
        raise StudyError(f"{path}: is no result file{fix}") from None


def damaged(path: Path) -> StudyError:
    """Return the error of a result file whose checksums do not match its content."""
    return StudyError(f"{path}: is damaged, it cannot be read whole; run its study again with --fresh")


def _other(about: Mapping[str, Any], study: Mapping[str, Any], identity: str) -> str:
    """Return the differences of the study of the results, by their attributes; empty if these do not show any."""
    from importlib import metadata  # noqa: PLC0415

    from .differences import differences, same_inputs  # noqa: PLC0415

    made, version = about.get("toppling_version"), metadata.version("toppling")
    if made is not None and made != version:
        return f" (they were made by toppling {made}, this is {version})"
    try:
        before = json.loads(str(about["study"]))
    except (KeyError, ValueError, RecursionError):
        return ""
    if not isinstance(before, dict):
        return ""
    return f" ({differences(before, study, same_inputs(str(about.get('identity')), identity))})"


@contextmanager
def _writing(path: Path) -> Iterator[None]:
    """Raise StudyError if a file of a study cannot be written in the block."""
    try:
        yield
    except (OSError, RuntimeError) as error:  # (the HDF5 library reports a full disk as a RuntimeError)
        if not path.parent.is_dir():
            raise removed(path.parent) from None
        raise StudyError(
            f"{path}: cannot be written ({system_reason(error)}); what is finished is kept: run the same command again"
        ) from None


def save(results: xr.Dataset, target: Path) -> None:
    """Write a dataset whole or not at all; StudyError if this fails."""
    with _writing(target), whole_file(target) as temporary:
        write(results, temporary)


def write_whole(path: Path, content: bytes | memoryview) -> None:
    """Write a file whole or not at all; StudyError if this fails."""
    with _writing(path):
        write_bytes(path, content)


def removed(path: Path) -> StudyError:
    """Return the error for a folder that was removed while its study ran."""
    return StudyError(f"{path}: was removed while the study ran, with what was kept in it; use --fresh to start over")
