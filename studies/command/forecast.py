"""The forecast of a study's time, memory and disk before it runs, and the status of a running or interrupted study."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

from ...core.wording import counted, size_text, time_text
from ...fragility.runs.runners import thread_count
from ..kinds.study import Expected, Study
from ..store.resources import free_bytes

LONG_FITS = 1.0
"""Seconds from which the time of fits is worth telling."""


class Forecast(NamedTuple):
    """Approximate runs, chunks, seconds on `threads`, bytes of memory and disk, free bytes, curves, and slides."""

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
    slides: int = 0
    expected: Expected | None = None

    def lines(self) -> list[str]:
        """Return the forecast as lines of text."""
        runs = f"{self.runs:,}" + (f", and {self.slides:,} of sliding blocks" if self.slides else "")
        seconds = f"{'about ' if self.seconds >= 1.0 else ''}{time_text(self.seconds)}"
        if self.expected is not None:
            few, usual, many = self.expected.runs
            runs = f"about {usual:,} ({few:,} to {many:,}), at most {self.runs:,}, {self.expected.words}"
            if self.slides:
                runs += f"; and about {self.expected.slides:,} runs of sliding blocks"
            each = self.seconds / max(self.runs, 1)
            few_seconds, most_seconds = time_text(each * usual), time_text(each * many)
            seconds = few_seconds if few_seconds == most_seconds else f"{few_seconds} or so, up to {most_seconds}"
            seconds += " of runs"
        return [
            f"runs:    {runs}",
            f"chunks:  about {self.chunks:,}" + (" at most" if self.expected is not None else ""),
            f"time:    {seconds} on {counted(self.threads, 'thread')}, "
            + (f"then {self.fits} and figures" if self.expected is None else "and the motions, fits and figures"),
            f"memory:  about {size_text(self.memory)}",
            f"disk:    about {size_text(self.disk)} while it runs, {size_text(self.left)} afterwards"
            + ("" if self.free is None else f"; {size_text(self.free)} are free"),
        ]

    @property
    def fits(self) -> str:
        """The phrase for the work that follows the runs."""
        if self.fits_seconds < LONG_FITS:
            return "fits"
        return f"fits of {counted(self.curves, 'curve')} (about {time_text(self.fits_seconds)})"


def forecast(study: Study, folder: Path | None = None) -> Forecast:
    """Return the forecast of a study on this machine, by the generous planning figures of the engine."""
    room = study.room
    return Forecast(
        study.work,
        room.chunks,
        (room.seconds + study.seconds_of_slides) / thread_count(),
        thread_count(),
        room.memory,
        room.disk,
        room.left,
        None if folder is None else free_bytes(folder),
        study.curves,
        study.seconds_of_fits(thread_count()),
        study.slide_runs,
        study.expected,
    )
