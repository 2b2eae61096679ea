"""The status of a study's folder: finished, running or interrupted, with the number of runs kept."""

from pathlib import Path
from typing import NamedTuple

from ...core.wording import part_text
from ..store.folder import RESULT_NAME, is_locked, reading
from ..store.manifest import MOST_RUNS, REACHED, REFUSED, kept_runs, read_manifest
from ..store.netcdf import load_small, opened, title_of
from ..text.error import StudyError


class StudyStatus(NamedTuple):
    """The status of a study: finished, running, interrupted, or without a folder."""

    state: str
    title: str
    chunks: int
    runs: int
    runs_total: int
    at_most: bool = False
    reached: str = ""
    refused: str = ""

    def lines(self, folder: Path) -> list[str]:
        """Return the status as lines of text."""
        if self.state == "finished":
            return [f"{self.title}: finished, {folder / RESULT_NAME}"]
        if self.at_most:  # (how many runs the precision takes is not known)
            kept = f"{self.runs:,} runs kept, at most {self.runs_total:,}"
        else:
            kept = f"{self.runs:,} of {self.runs_total:,} runs kept ({part_text(self.runs, self.runs_total)})"
        state = f"{self.title}: {self.state}, about {kept}"
        if self.runs >= self.runs_total:
            state += "; what is made of them follows: curves, tables and figures"
        lines = [state, *([self.reached] if self.reached else [])]
        if self.state == "running":
            return lines
        if self.refused:
            return [
                *lines,
                f"it ended without a result: {self.refused}",
                "change the study, or start over with --fresh",
            ]
        return [*lines, "the same command goes on where it stopped (without --fresh, which starts over)"]


def status_of(folder: Path, verify: bool = False) -> StudyStatus:
    """Return the status of the study in a folder; `verify` refuses results that are not finished, or were edited."""
    if not folder.is_dir():
        raise StudyError(f"{folder}: {'not a folder of results' if folder.exists() else 'no such folder'}")
    running = is_locked(folder)
    manifest = read_manifest(folder)
    if verify and (running or manifest is not None):
        raise StudyError(f"{folder}: is not finished, there are no results to verify")
    if manifest is None:
        if (folder / RESULT_NAME).exists() and not running:
            return StudyStatus("finished", _title(folder / RESULT_NAME, verify), 0, 0, 0)
        if running:
            return StudyStatus("running", "a study that is being read", 0, 0, 0)
        raise StudyError(f"{folder}: holds no study")
    chunks, runs = kept_runs(folder, manifest)
    return StudyStatus(
        "running" if running else "interrupted",
        _printable(manifest.get("title", "")),
        chunks,
        runs,
        manifest["work"],
        manifest.get(MOST_RUNS) is True,
        _printable(manifest.get(REACHED, "")),
        _printable(manifest.get(REFUSED, "")),
    )


def _title(path: Path, verify: bool) -> str:
    """Return the title of results; with `verify`, results of a later version and edited results are an error."""
    with reading(path):
        title = _printable(title_of(path))
        if verify:
            # labelled arrays take half a second to load, which only the checksum of contents needs
            from ..report.results_file import refuse_newer  # noqa: PLC0415
            from ..store.content import check_content  # noqa: PLC0415

            with opened(path) as stored:
                load_small(stored)
                refuse_newer(path, stored)
                check_content(path, stored, True)
        return title


def _printable(title: object) -> str:
    return "".join(letter if letter.isprintable() else "?" for letter in str(title))
