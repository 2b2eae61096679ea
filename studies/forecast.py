"""What a study will take before anything runs, and where an interrupted one stands."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

from dask.system import CPU_COUNT

from .progress import time_text
from .room import free_bytes
from .shards import kept_chunks, read_manifest
from .size import size_text
from .store import RESULT_NAME, damaged, is_locked
from .study import Study
from .tables import StudyError
from .writing import load_small

MANY_CURVES = 1000
"""So many curves take longer to fit than one looks away."""


class Forecast(NamedTuple):
    """Runs, chunks, seconds on so many threads, bytes of memory, of disk meanwhile and in the end: about; free ones.

    curves: how many are fitted when the runs are done, which takes `fits_seconds` more.
    """

    runs: int
    chunks: int
    seconds: float
    threads: int
    memory: float
    disk: float
    left: float
    free: float | None
    curves: int
    fits_seconds: float

    def lines(self) -> list[str]:
        """For people."""
        return [
            f"runs:    {self.runs:,}",
            f"chunks:  about {self.chunks:,}",
            f"time:    {'about ' if self.seconds >= 1.0 else ''}{time_text(self.seconds)} on {self.threads} threads, "
            f"then {self.fits} and figures",
            f"memory:  about {size_text(self.memory)}",
            f"disk:    about {size_text(self.disk)} while it runs, {size_text(self.left)} afterwards"
            + ("" if self.free is None else f"; {size_text(self.free)} are free"),
        ]

    @property
    def fits(self) -> str:
        """What follows the runs."""
        if self.curves < MANY_CURVES:
            return "fits"
        return f"fits of {self.curves:,} curves (about {time_text(self.fits_seconds)})"


def forecast(study: Study, folder: Path | None = None) -> Forecast:
    """What a study takes on this machine, by the planning figures of the engine (which are generous)."""
    room = study.room
    return Forecast(
        study.work,
        room.chunks.number,
        room.chunks.seconds / CPU_COUNT,
        CPU_COUNT,
        room.memory,
        room.disk,
        room.left,
        None if folder is None else free_bytes(folder),
        study.curves,
        study.seconds_of_fits(CPU_COUNT),
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
        if self.runs >= self.runs_total:
            said += "; what is made of them follows: curves, tables and figures"
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
    found = kept_chunks(folder)
    chunks = runs = known = 0
    for i, one in enumerate(calls):
        first = 0
        for number, each in one["chunks"]:
            kept = sum(first <= chunk < first + number for chunk in found.get(i, ()))
            chunks += kept
            runs += kept * each
            first += number
        known += first
    return Standing(
        "running" if running else "interrupted",
        _printable(manifest.get("title", "")),
        chunks,
        known,
        runs,
        manifest["work"],
    )


def _title(path: Path) -> str:
    import xarray as xr  # noqa: PLC0415 - where there is a result

    try:
        with xr.open_dataset(path, engine="netcdf4") as stored:
            load_small(stored)
            return _printable(stored.attrs["title"])
    except RuntimeError:
        raise damaged(path) from None
    except (OSError, ValueError, KeyError):
        raise StudyError(f"{path}: is no result file of this program") from None


def _printable(title: object) -> str:
    return "".join(letter if letter.isprintable() else "?" for letter in str(title))
