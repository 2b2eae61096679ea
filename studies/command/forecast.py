"""The forecast of a study's time, memory and disk before it runs, by the generous planning figures of the engine."""

from pathlib import Path

from ...core.wording import counted, size_text, time_text
from ...fragility.runs.runners import thread_count
from ..kinds.study import Study
from ..store.resources import free_bytes

LONG_FITS = 1.0
"""Seconds from which the time of fits is worth telling."""


def forecast(study: Study, folder: Path | None = None) -> list[str]:
    """Return a study's needs on this machine as lines of text: runs, chunks, time, memory and disk."""
    room, work, slides, threads = study.room, study.work, study.slide_runs, thread_count()
    expected = study.expected
    duration = (room.seconds + study.seconds_of_slides) / threads
    runs = f"{work:,}" + (f", and {slides:,} of sliding blocks" if slides else "")
    seconds = f"{'about ' if duration >= 1.0 else ''}{time_text(duration)}"
    if expected is not None:
        few, usual, many = expected.runs
        runs = f"about {usual:,} ({few:,} to {many:,}), at most {work:,}, {expected.words}"
        if slides:
            runs += f"; and about {expected.slides:,} runs of sliding blocks"
        per_run = duration / max(work, 1)
        few_seconds, most_seconds = time_text(per_run * usual), time_text(per_run * many)
        seconds = few_seconds if few_seconds == most_seconds else f"{few_seconds} or so, up to {most_seconds}"
        seconds += " of runs"
    return [
        f"runs:    {runs}",
        f"chunks:  about {room.chunks:,}" + (" at most" if expected is not None else ""),
        f"time:    {seconds} on {counted(threads, 'thread')}, "
        + (f"then {fits(study)} and figures" if expected is None else "and the motions, fits and figures"),
        f"memory:  about {size_text(room.memory)}",
        f"disk:    about {size_text(room.disk)} while it runs, {size_text(room.left)} afterwards"
        + ("" if folder is None else f"; {size_text(free_bytes(folder))} are free"),
    ]


def fits(study: Study) -> str:
    """Return the phrase for the work that follows the runs."""
    seconds = study.seconds_of_fits(thread_count())
    return "fits" if seconds < LONG_FITS else f"fits of {counted(study.curves, 'curve')} (about {time_text(seconds)})"
