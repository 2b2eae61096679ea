"""A disk that fails at chosen calls of the system: `failing_calls.c`, compiled, in front of the system's library."""

import errno
import itertools
import os
import shutil
import subprocess
from pathlib import Path

import pytest

ERRORS = {"EIO": errno.EIO, "ENOSPC": errno.ENOSPC, "EDQUOT": errno.EDQUOT}


def library(folder):
    """The path of the library; the test is skipped where nothing compiles it."""
    compiler = shutil.which("cc")
    if compiler is None or not Path("/proc/self/fd").is_dir():
        pytest.skip("needs Linux and a compiler of C")
    made = folder / "failing_calls.so"
    source = Path(__file__).with_suffix(".c")
    subprocess.run([compiler, "-shared", "-fPIC", "-o", str(made), str(source), "-ldl"], check=True)
    return made


def failing(made, under, call, number, error):
    """The environment of a process in which the call of this number on a path below a folder fails, and all later."""
    fail = {"UNDER": under, "CALL": call, "NTH": number, "ERRNO": ERRORS[error], "ON": 1}
    return {**os.environ, "LD_PRELOAD": str(made), **{f"FAIL_{name}": str(value) for name, value in fail.items()}}


def refuse_opening(monkeypatch, name, number=None):
    """Refuse every opening of files of a name by `Path.open`, or the one of this number alone."""
    opened, before = Path.open, itertools.count(1)

    def refuse(path, *options, **more):
        if path.name == name and number in (None, next(before)):
            raise OSError(errno.EIO, "Input/output error")
        return opened(path, *options, **more)

    monkeypatch.setattr(Path, "open", refuse)
