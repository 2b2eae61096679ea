"""Memory and disk space that a study needs, estimated and checked before it begins."""

import math
import os
import shutil
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple, Self

from ...core.wording import size_text
from ...fragility.runs.plan import number_of_chunks
from ..text.error import StudyError
from .manifest import FOLDER
from .shards import IN_MEMORY

BASE_BYTES = 400e6
"""Memory of the loaded packages, and of figures: the need of small studies."""
SHARD_BYTES = 4e3
"""Size of a shard without its results."""
RESULT_BYTES = 2e6
"""Size of the figures, and of the results except the variables of every run."""
HELD = 4
"""Number of arrays of all runs, each of the largest size, in memory; further arrays are files."""


class Resources(NamedTuple):
    """Approximate bytes of memory, of disk during a study, of shards, of remaining files; chunks and their time, s."""

    memory: float
    disk: float
    shards: float
    left: float
    chunks: int
    seconds: float

    @classmethod
    def of(cls, seconds: float, kept: float, stored: float, together: float, arrays: Sequence[float] = ()) -> Self:
        """Estimate from the bytes of runs in shards and in results, of data held at once, and of each further array."""
        chunks = max(1, math.ceil(number_of_chunks(seconds)))
        shards = kept + chunks * SHARD_BYTES
        # variables of every run are in a file without a name until they are written, and then in both files
        left = stored + RESULT_BYTES
        aside = kept + stored if kept + stored > HELD * IN_MEMORY else 0.0
        aside += sum(array for array in arrays if array > IN_MEMORY)
        memory = BASE_BYTES + together + min(kept + stored, HELD * IN_MEMORY)
        memory += sum(array for array in arrays if array <= IN_MEMORY)
        return cls(memory, shards + aside + left, shards, left, chunks, seconds)


def refuse_shortage(folder: Path, needs: Resources, resume: bool) -> None:
    """Raise a StudyError if a study would fill the disk of its folder, less its kept shards, or the memory."""
    kept = [path.stat().st_size for path in (folder / FOLDER).glob("*.nc")] if resume else []
    needed = needs.disk - min(sum(kept), needs.shards)
    free = free_bytes(folder)
    if needed > free:
        raise StudyError(
            f"{folder}: the study needs about {size_text(needed)} of disk while it runs ({size_text(needs.left)} "
            f"afterwards), {size_text(free)} are free: use another folder, or fewer motions, levels, blocks, laws, "
            "samples or outputs"
        )
    there = memory_bytes()
    if needs.memory > there:
        raise StudyError(
            f"{folder}: the study needs about {size_text(needs.memory)} of memory, this machine has "
            f"{size_text(there)}: fewer motions, levels, blocks, laws or samples, or several studies"
        )


def memory_bytes() -> float:
    """Return the memory of this machine in bytes; infinite if it is not known."""
    try:
        return float(os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE"))
    except (AttributeError, ValueError, OSError):
        return math.inf


def free_bytes(folder: Path) -> int:
    """Return the free bytes of the disk that a folder is on, or would be on."""
    existing = folder.absolute()
    while not existing.exists():
        existing = existing.parent
    return shutil.disk_usage(existing).free
