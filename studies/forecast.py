"""What a study will take before anything runs, and where an interrupted one stands."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from dask.system import CPU_COUNT

from ..fragility.plan import SECONDS_PER_EXACT_SAMPLE, SECONDS_PER_SAMPLE, seconds_of_a_chunk
from ..motions import records
from .progress import time_text
from .shards import count_shards, read_manifest
from .store import RESULT_NAME, is_locked
from .study import Study
from .tables import StudyError

BASE_BYTES = 300e6
"""What the packages take."""
SHARD_BYTES = 12e3
"""What a shard takes beside its results."""


class Forecast(NamedTuple):
    """Runs, chunks, seconds on so many threads, and bytes of memory and disk: about."""

    runs: int
    chunks: int
    seconds: float
    threads: int
    memory: float
    disk: float

    def lines(self) -> list[str]:
        """For people."""
        return [
            f"runs:    {self.runs:,}",
            f"chunks:  about {self.chunks:,}",
            f"time:    about {time_text(self.seconds)} on {self.threads} threads, then fits and figures",
            f"memory:  about {size_text(self.memory)}",
            f"disk:    about {size_text(self.disk)} while it runs, half of it afterwards",
        ]


def forecast(study: Study) -> Forecast:
    """What a study takes on this machine, by the planning figures of the engine (which are generous)."""
    plain = [record for array in study.arrays for record in records(array)]
    samples = float(np.mean([record.acceleration.size for record in plain]))
    exact = np.mean([one.exact for one in study.of_each_law])
    per_sample = float(exact * SECONDS_PER_EXACT_SAMPLE + (1.0 - exact) * SECONDS_PER_SAMPLE)
    work = study.work * samples * per_sample
    chunks = max(1, math.ceil(work / seconds_of_a_chunk(work)))
    kept = float(study.bytes_a_run * study.work)
    motions = float(sum(record.acceleration.nbytes for record in plain))
    return Forecast(
        study.work,
        chunks,
        work / CPU_COUNT,
        CPU_COUNT,
        BASE_BYTES + 3.0 * motions + 3.0 * kept,
        2.0 * kept + chunks * SHARD_BYTES,
    )


class Standing(NamedTuple):
    """Where a study stands: finished, running, interrupted, or nothing there."""

    state: str
    title: str
    chunks: int
    chunks_known: int
    runs: int
    runs_total: int

    def lines(self, folder: Path) -> list[str]:
        """For people."""
        if self.state == "finished":
            return [f"{self.title}: finished, {folder / RESULT_NAME}"]
        share = 100.0 * self.runs / max(self.runs_total, 1)
        said = f"{self.title}: {self.state}, about {self.runs:,} of {self.runs_total:,} runs kept ({share:.0f} %)"
        if self.state == "running":
            return [said]
        return [said, "the same command goes on where it stopped (without --fresh, which starts over)"]


def standing(folder: Path) -> Standing:
    """Where the study in a folder stands.

    Raises
    ------
    StudyError
        No such folder, or no study in it.
    """
    if not folder.is_dir():
        raise StudyError(f"{folder}: no such folder")
    running = is_locked(folder)
    manifest = read_manifest(folder)
    if manifest is None:
        if (folder / RESULT_NAME).exists() and not running:
            return Standing("finished", _title(folder / RESULT_NAME), 0, 0, 0, 0)
        if running:
            return Standing("running", "a study that is being read", 0, 0, 0, 0)
        raise StudyError(f"{folder}: holds no study")
    calls: list[dict[str, Any]] = manifest["calls"]
    found = count_shards(folder)
    kept = [min(found.get(i, 0), one["chunks"]) for i, one in enumerate(calls)]
    runs = sum(one["runs"] * n // max(one["chunks"], 1) for n, one in zip(kept, calls, strict=True))
    return Standing(
        "running" if running else "interrupted",
        _printable(manifest.get("title", "")),
        sum(kept),
        sum(one["chunks"] for one in calls),
        runs,
        manifest["work"],
    )


def _title(path: Path) -> str:
    import xarray as xr  # noqa: PLC0415 - where there is a result

    try:
        with xr.open_dataset(path) as stored:
            return _printable(stored.attrs["title"])
    except (OSError, ValueError, KeyError, RuntimeError):
        raise StudyError(f"{path}: is no result file of this program") from None


def _printable(title: object) -> str:
    return "".join(letter if letter.isprintable() else "?" for letter in str(title))


def size_text(size: float) -> str:
    """Bytes for people."""
    for unit, scale in (("TB", 1e12), ("GB", 1e9), ("MB", 1e6)):
        if size >= scale:
            return f"{size / scale:.1f} {unit}"
    return f"{max(size / 1e3, 1.0):.0f} kB"
