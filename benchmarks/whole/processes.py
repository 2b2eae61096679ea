"""CPU and wall time of other processes, with all their threads and children."""

from __future__ import annotations

import os
import resource
import subprocess
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from time import perf_counter
from typing import NamedTuple


class Spent(NamedTuple):
    """What a process took: CPU time of all its threads and its children, s; wall time, s."""

    cpu: float
    wall: float


def spent(
    arguments: Sequence[str], folder: Path, settings: Mapping[str, str] | None = None, python: str = sys.executable
) -> Spent:
    """Run a Python with `arguments` in a folder, with further environment variables; return what it took.

    It may store bytecode, as it does for every user: else each process would compile all modules once more.

    Raises
    ------
    RuntimeError
        The process failed; its last line says why.
    """
    own = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    start = perf_counter()
    done = subprocess.run(
        [python, *arguments],
        cwd=folder,
        env={**own, **(settings or {})},
        capture_output=True,
        text=True,
        check=False,
    )
    wall = perf_counter() - start
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    if done.returncode:
        reason = (done.stderr.strip().splitlines() or ["no message"])[-1]
        raise RuntimeError(f"{' '.join(arguments)}: ended with {done.returncode}: {reason}")
    return Spent(after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime, wall)
