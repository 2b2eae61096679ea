"""Studies to begin with: a folder with a commented study and the files that it reads, for a user to make their own."""

import csv
import os
import shutil
import threading
from pathlib import Path

import numpy as np

from ...core.wording import system_reason
from ...core.writing import remove_leftovers
from ...motions import SiteBasedScenario
from ...motions.arrays import records
from ...motions.intensity.evaluation import measure
from ...motions.readers.at2 import write_at2
from ...motions.readers.lines import RecordError
from ..file.analyses import LevelsTable
from ..file.schema import read_study_file
from ..inventory.reading import KIND, example_path
from ..tables.files import timeless
from ..text.error import StudyError
from .choices import Starter

STUDY = "study.toml"
EARTHQUAKES: dict[Starter, tuple[float, float]] = {
    "bookcase": (6.8, 15.0),
    "inventory": (7.0, 10.0),
    "records": (7.4, 8.0),
}
"""Magnitude and distance (km) of the simulated records of each starter that scales records."""
RECORDS, CANDIDATES = 40, 200
"""Records of a starter, enough for a probability that is known to ±0.15, and the motions that they are chosen from."""
FARTHEST = 5.0
"""Most by which a record is scaled, up or down; the validity check asks for no more."""
REPLACE: dict[Starter, str] = {
    "bookcase": "records/ (files of your own), [[blocks]] (its sizes), [restraints.kit] (the kit), [hazard] (the site)",
    "inventory": "inventory.xlsx (pieces and their places), records/ (your own), [building] in study.toml, hazard.csv",
    "hazard": "hazard.csv and disaggregation.csv (the site), [stripes.select] (its soil), [[blocks]] in study.toml",
    "records": "records/ (files of your own), [[blocks]] in study.toml (the pieces)",
    "scenario": "inventory.xlsx (pieces and their places), [building] and [motions] in study.toml",
}
"""Parts of each starter that a user replaces."""
_HERE = Path(__file__).parents[1] / "starters"


def write_starter(kind: Starter, folder: Path) -> list[str]:
    """Write a study to begin with into a new or empty folder; return the names of its files, the study first."""
    try:
        if os.path.lexists(folder) and not folder.is_dir():
            raise StudyError(f"{folder}: there is a file of that name already; nothing was written")
        there = folder.is_dir()
        remove_leftovers(folder)
        if there and any(folder.iterdir()):
            raise StudyError(f"{folder}: the folder is not empty; name a new one, nothing was written")
        folder.parent.mkdir(parents=True, exist_ok=True)
        # in an existing folder, which a rename cannot replace everywhere, or else next to the new one
        place = folder if there else folder.parent
        remove_leftovers(folder.parent)
        staged = place / f".new.toppling-{os.getpid()}-{threading.current_thread().ident}.part"
        staged.mkdir()
        try:
            _fill(kind, staged)
            names = [file.name for file in staged.iterdir()]
            _move(staged, folder, there)
        finally:
            shutil.rmtree(staged, ignore_errors=True)
    except OSError as error:
        raise StudyError(f"{folder}: cannot be written ({system_reason(error)})") from None
    except RecordError as error:
        raise StudyError(str(error).replace(str(staged), str(folder))) from None
    return sorted(names, key=lambda name: (name != STUDY, name))


def _fill(kind: Starter, folder: Path) -> None:
    """Write the files of a starter into an empty folder."""
    shutil.copyfile(_HERE / f"{kind}.toml", folder / STUDY)
    if kind in EARTHQUAKES:
        _write_records(folder, *EARTHQUAKES[kind])
    if kind == "hazard":
        shutil.copyfile(_HERE / "hazard_of_sa.csv", folder / "hazard.csv")
        shutil.copyfile(_HERE / "disaggregation.csv", folder / "disaggregation.csv")
    if kind not in ("inventory", "scenario"):
        return
    table = Path(example_path()).read_text(encoding="utf-8")
    (folder / "inventory.csv").write_text(table, encoding="utf-8")
    (folder / "inventory.xlsx").write_bytes(workbook_of(table))
    if kind == "inventory":
        shutil.copyfile(_HERE / "hazard.csv", folder / "hazard.csv")


def _move(staged: Path, folder: Path, there: bool) -> None:
    """Put a filled folder in its place; moved files are removed again if not all can be moved."""
    if not there:
        staged.rename(folder)
        return
    moved: list[Path] = []
    try:
        for file in sorted(staged.iterdir(), key=lambda path: path.name == STUDY):
            target = folder / file.name
            if os.path.lexists(target):
                raise StudyError(f"{target}: there is a file of that name already; nothing was written")
            file.rename(target)
            moved.append(target)
    except BaseException:
        for target in moved:
            shutil.rmtree(target) if target.is_dir() else target.unlink()
        raise


def _write_records(folder: Path, magnitude: float, distance: float) -> None:
    """Write simulated records of one earthquake (km) as PEER AT2, those near all levels of the study in the folder."""
    study = read_study_file(folder / STUDY)
    analysis = study.ida or study.performance
    assert analysis is not None
    assert analysis.im is not None
    assert isinstance(analysis.levels, LevelsTable)
    levels = analysis.levels.build(analysis.im)
    motions = SiteBasedScenario(magnitude, 1e3 * distance, vs30=700.0, dt=0.02).sample(CANDIDATES, seed=1)
    strength = measure(analysis.im, records(motions))
    near = (strength >= levels[-1] / FARTHEST) & (strength <= levels[0] * FARTHEST)
    (folder / "records").mkdir()
    scenario = f"SITE-BASED SCENARIO, M {magnitude:g}, {distance:g} KM, VS30 700 M/S, SEED 1"
    for number, i in enumerate(np.flatnonzero(near)[:RECORDS], start=1):
        title = f"SIMULATED, NOT RECORDED: {scenario}, MOTION {i + 1}"
        write_at2(motions[i], folder / f"records/simulated-{number:02}.AT2", title)


def workbook_of(table: str) -> bytes:
    """Return the workbook of an inventory in CSV: comments as lines of text, the header bold, numbers as numbers."""
    from openpyxl import Workbook  # noqa: PLC0415 - for workbooks alone
    from openpyxl.styles import Font  # noqa: PLC0415
    from openpyxl.utils import get_column_letter  # noqa: PLC0415

    book = Workbook()
    sheet = book.active
    assert sheet is not None
    assert KIND.sheet is not None
    sheet.title = KIND.sheet
    header = False
    for i, line in enumerate(table.splitlines(), start=1):
        comment = line.startswith("#")
        cells = [line] if comment else next(csv.reader([line]))
        for j, text in enumerate(cells, start=1):
            sheet.cell(i, j, _number(text))
            if not comment and not header:
                sheet.cell(i, j).font = Font(bold=True)
                sheet.column_dimensions[get_column_letter(j)].width = 28 if j <= 2 else max(9, len(text) + 2)
        if not comment and not header:
            header = True
            sheet.freeze_panes = f"B{i + 1}"
    return timeless(book)


def _number(text: str) -> str | float | None:
    """Return a cell of a CSV as a number if it is one, None if it is empty."""
    try:
        value = float(text)
    except ValueError:
        return text or None
    return int(value) if value.is_integer() else value
