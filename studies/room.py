"""What a study takes of memory and disk, judged before it begins."""

from __future__ import annotations

import math
import os
import shutil
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple, Self

from ..fragility.plan import SECONDS_PER_EXACT_SAMPLE, SECONDS_PER_SAMPLE, number_of_chunks
from .shards import FOLDER, IN_MEMORY
from .size import size_text
from .tables import StudyError

BASE_BYTES = 250e6
"""What the packages take."""
SHARD_BYTES = 4e3
"""What a shard takes beside its results."""
RESULT_BYTES = 2e6
"""What results take beside what is of every run, and the figures."""
HELD = 4
"""Arrays of all runs that are held in memory, each as large as may be, before the next ones are files."""


class Chunks(NamedTuple):
    """Seconds of one core, by the planning figures of the engine (which are generous), and chunks: about."""

    seconds: float
    number: int


def chunks_of(runs: int, samples: Sequence[int], exact: float) -> Chunks:
    """Those of so many runs under motions of so many samples each; `exact`: share of them in exact geometry."""
    per_sample = exact * SECONDS_PER_EXACT_SAMPLE + (1.0 - exact) * SECONDS_PER_SAMPLE
    work = runs * sum(samples) / len(samples) * per_sample
    return Chunks(work, max(1, math.ceil(number_of_chunks(work))))


class Room(NamedTuple):
    """Bytes: of memory; of disk in all while it runs, as shards, and in the end; and its chunks: about."""

    memory: float
    disk: float
    shards: float
    left: float
    chunks: Chunks

    @classmethod
    def of(cls, chunks: Chunks, kept: float, stored: float, together: float, arrays: Sequence[float] = ()) -> Self:
        """From the bytes of runs in shards and in results, of what is held at once, and of each further array."""
        shards = kept + chunks.number * SHARD_BYTES
        # what is of every run stands in a file without a name until it is written, and then in both
        left = stored + RESULT_BYTES
        aside = kept + stored if kept + stored > HELD * IN_MEMORY else 0.0
        aside += sum(one for one in arrays if one > IN_MEMORY)
        memory = BASE_BYTES + together + min(kept + stored, HELD * IN_MEMORY)
        memory += sum(one for one in arrays if one <= IN_MEMORY)
        return cls(memory, shards + aside + left, shards, left, chunks)


def refuse_room(folder: Path, room: Room, resume: bool) -> None:
    """StudyError where a study would fill the disk of its folder (what is kept of it already counts) or the memory."""
    kept = [path.stat().st_size for path in (folder / FOLDER).glob("*.nc")] if resume else []
    needed = room.disk - min(sum(kept), room.shards)
    free = free_bytes(folder)
    if needed > free:
        raise StudyError(
            f"{folder}: the study needs about {size_text(needed)} of disk while it runs ({size_text(room.left)} "
            f"afterwards), {size_text(free)} are free: use another folder, or fewer motions, levels, blocks, laws, "
            "samples or outputs"
        )
    there = memory_bytes()
    if room.memory > there:
        raise StudyError(
            f"{folder}: the study needs about {size_text(room.memory)} of memory, this machine has {size_text(there)}: "
            "fewer motions, levels, blocks, laws or samples, or several studies"
        )


def memory_bytes() -> float:
    """The memory of this machine; infinite where the system does not say."""
    try:
        return float(os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE"))
    except (AttributeError, ValueError, OSError):
        return math.inf


def free_bytes(folder: Path) -> int:
    """Free bytes of the disk that a folder is on, or would be on."""
    here = folder.absolute()
    while not here.exists():
        here = here.parent
    return shutil.disk_usage(here).free
