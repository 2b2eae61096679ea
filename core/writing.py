"""Files that are written whole or not at all, and never through a link that lies in their place."""

import errno
import os
import re
import shutil
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path


def refuse_pipe(path: Path) -> None:
    """Raise OSError for a device or a pipe in the place of a file: opening it can wait for ever."""
    stream = path.is_symlink() and os.readlink(path).startswith(("/dev/", "/proc/"))  # like /dev/stdout
    if stream or (path.exists() and not path.is_file() and not path.is_dir()):
        raise OSError(errno.EINVAL, "is a device or a pipe, no file", str(path))


@contextmanager
def whole_file(path: Path) -> Iterator[Path]:
    """Yield the name of an empty file next to `path` that replaces it when the block ends without an error.

    The file is new, with a name of its own, and a link is never followed.  It is on the disk before it takes the place,
    so that after a crash `path` is the old file or the new one.  An OSError leaves nothing of it.
    """
    if not path.name:
        raise IsADirectoryError(errno.EISDIR, "is a folder, no file", str(path))
    refuse_pipe(path)
    # (a name of its own: two processes may write one file, and the last of them wins)
    temporary = path.with_name(f"{path.name}.toppling-{os.getpid()}-{threading.current_thread().ident}.part")
    temporary.unlink(missing_ok=True)
    remove_leftovers(path.parent)
    os.close(os.open(temporary, os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_NOFOLLOW", 0), 0o666))
    try:
        yield temporary
        _sync(temporary, os.O_RDWR)
        temporary.replace(path)
        with suppress(OSError):  # (folders can't be opened on Windows)
            _sync(path.parent, os.O_RDONLY)
    finally:
        with suppress(OSError):
            temporary.unlink(missing_ok=True)


LEFTOVER = re.compile(r".+\.toppling-([0-9]+)-([0-9]+)\.part")


def remove_leftovers(folder: Path) -> None:
    """Remove the new files of `whole_file` that killed processes, or a disk that failed, have left in a folder.

    The files of running processes stay, and on systems that do not list processes (Windows) all of them.
    """
    if os.name != "posix":
        return
    with suppress(OSError), os.scandir(folder) as entries:
        for entry in entries:
            leftover = LEFTOVER.fullmatch(entry.name)
            if leftover and not _runs(int(leftover[1]), int(leftover[2])):
                with suppress(OSError):
                    shutil.rmtree(entry.path) if entry.is_dir(follow_symlinks=False) else os.unlink(entry.path)


def _runs(process: int, thread: int) -> bool:
    """Return True if a process of this machine runs, and if it is this one, the thread."""
    if process == os.getpid():  # (after a start of the machine, or of a container, numbers are given again)
        return any(alive.ident == thread for alive in threading.enumerate())
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except (PermissionError, OverflowError):
        return True
    return True


def write_bytes(path: Path, content: bytes | memoryview) -> None:
    """Write a file whole or not at all; OSError as `whole_file`."""
    with whole_file(path) as temporary, temporary.open("wb") as file:
        file.write(content)


def _sync(path: Path, flags: int) -> None:
    """Wait until a file, or a rename in a folder, is on the disk."""
    descriptor = os.open(path, flags)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
