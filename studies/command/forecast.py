"""The forecast of a study's time, memory and disk before it runs, and the status of a running or interrupted study."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

from ...fragility.runs.runners import thread_count
from ...wording import counted, part_text, size_text, time_text
from ..file.table import StudyError
from ..kinds.study import Study
from ..report.results_file import refuse_newer
from ..store.content import check_content
from ..store.folder import RESULT_NAME, UNREADABLE, damaged, is_locked
from ..store.netcdf import load_small
from ..store.resources import free_bytes
from ..store.shards import kept_chunks, read_manifest

MANY_CURVES = 1000
"""Number of curves from which the time of their fits is worth telling."""


class Forecast(NamedTuple):
    """Approximate runs, chunks, seconds on `threads`, bytes of memory, of disk during and after the run; free bytes.

    curves: number of curves that are fitted after the runs, which takes `fits_seconds` more.
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
        """Return the forecast as lines of text."""
        return [
            f"runs:    {self.runs:,}",
            f"chunks:  about {self.chunks:,}",
            f"time:    {'about ' if self.seconds >= 1.0 else ''}{time_text(self.seconds)} on "
            f"{counted(self.threads, 'thread')}, "
            f"then {self.fits} and figures",
            f"memory:  about {size_text(self.memory)}",
            f"disk:    about {size_text(self.disk)} while it runs, {size_text(self.left)} afterwards"
            + ("" if self.free is None else f"; {size_text(self.free)} are free"),
        ]

    @property
    def fits(self) -> str:
        """The phrase for the work that follows the runs."""
        if self.curves < MANY_CURVES:
            return "fits"
        return f"fits of {self.curves:,} curves (about {time_text(self.fits_seconds)})"


def forecast(study: Study, folder: Path | None = None) -> Forecast:
    """Return the forecast of a study on this machine, by the generous planning figures of the engine."""
    room = study.room
    return Forecast(
        study.work,
        room.chunks.number,
        room.chunks.seconds / thread_count(),
        thread_count(),
        room.memory,
        room.disk,
        room.left,
        None if folder is None else free_bytes(folder),
        study.curves,
        study.seconds_of_fits(thread_count()),
    )


class StudyStatus(NamedTuple):
    """The status of a study: finished, running, interrupted, or without a folder."""

    state: str
    title: str
    chunks: int
    chunks_known: int
    runs: int
    runs_total: int

    def lines(self, folder: Path) -> list[str]:
        """Return the status as lines of text."""
        if self.state == "finished":
            return [f"{self.title}: finished, {folder / RESULT_NAME}"]
        kept = f"{self.runs:,} of {self.runs_total:,} runs kept ({part_text(self.runs, self.runs_total)})"
        said = f"{self.title}: {self.state}, about {kept}"
        if self.runs >= self.runs_total:
            said += "; what is made of them follows: curves, tables and figures"
        if self.state == "running":
            return [said]
        return [said, "the same command goes on where it stopped (without --fresh, which starts over)"]


def status_of(folder: Path, verify: bool = False) -> StudyStatus:
    """Return the status of the study in a folder.

    Raises
    ------
    StudyError
        No such folder, or no study in it; with `verify` also results that are not finished, or were edited.
    """
    if not folder.is_dir():
        raise StudyError(f"{folder}: no such folder")
    running = is_locked(folder)
    manifest = read_manifest(folder)
    if verify and (running or manifest is not None):
        raise StudyError(f"{folder}: is not finished, there are no results to verify")
    if manifest is None:
        if (folder / RESULT_NAME).exists() and not running:
            return StudyStatus("finished", _title(folder / RESULT_NAME, verify), 0, 0, 0, 0)
        if running:
            return StudyStatus("running", "a study that is being read", 0, 0, 0, 0)
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
    return StudyStatus(
        "running" if running else "interrupted",
        _printable(manifest.get("title", "")),
        chunks,
        known,
        runs,
        manifest["work"],
    )


def _title(path: Path, verify: bool) -> str:
    import xarray as xr  # noqa: PLC0415 - where there is a result

    try:
        with xr.open_dataset(path, engine="netcdf4") as stored:
            load_small(stored)
            if verify:
                refuse_newer(path, stored)
                check_content(path, stored, verify)
            return _printable(stored.attrs["title"])
    except StudyError:
        raise
    except RuntimeError:
        raise damaged(path) from None
    except UNREADABLE:
        raise StudyError(f"{path}: is no result file of this program") from None


def _printable(title: object) -> str:
    return "".join(letter if letter.isprintable() else "?" for letter in str(title))
