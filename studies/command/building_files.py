"""Export of a performance study for pelicun: fragility, quantities by floor and values of its pieces, under one law."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from ...fragility import Written
from ...fragility.curves.curve import ISOTONIC
from ...fragility.exchange.ids import TABLE_MARKS, is_id
from ...fragility.exchange.pelicun.building import Line, currency_unit, write_building
from ...fragility.fitting.isotonic import isotonic_probabilities
from ...wording import counted, currency_of
from ..buildings.variables import JOINT
from ..file.table import StudyError
from ..report.results_file import read_results
from ..store.content import check_content
from .export import laws_of

LIMITS = (
    "The tables do not hold that pieces on different lines fall under the same motions (pelicun draws their capacities "
    "independently at a given shaking: means agree, and numbers and losses spread less than in the study), intervals, "
    "modelling uncertainty, annual rates, the spread of costs (they are means), downtime, consequences for people, "
    "costs of anchoring, or what a building code asks. "
)
"""What the tables cannot hold, for their description and the terminal."""
INDEPENDENT = "independent"


def write_building_files(
    result: Path, folder: Path, model: str | None = None, prefix: str | None = None, verify: bool = False
) -> list[str]:
    """Write the pieces of a performance study under one law for a whole assessment of pelicun.

    Parameters
    ----------
    result : Path
        The results.
    folder : Path
        The folder for the files, made where missing.
    model : str, optional
        Label or short name of the law; not needed where the study has one.
    prefix : str, optional
        Beginning of the ids, which are then ``PREFIX.001`` and so on in the order of the inventory; else they are made
        of the pieces' names.
    verify : bool
        Refuse results that were edited after they were written.

    Returns
    -------
    list of str
        Lines for the terminal.

    Raises
    ------
    StudyError
        One sentence: results that cannot be read, several laws and no choice of one, floors without numbers, a measure
        that pelicun has no demand for, a prefix that makes no ids, a file that cannot be written.
    """
    with read_results(result) as results:
        check_content(result, results, verify)
        one = results.isel(model=_law(results, model, result))
        law = str(one["model"].values)
        items = [str(item) for item in one["item"].values]
        curves, smoothed = _curves(one)
        lines = [_line(one, i, smoothed[i]) for i in range(len(items))]
        currency = currency_of(results)
    description = f"Damping law: {law}. Probabilities are those of a study that found them by simulation. {LIMITS}"
    ids = None if prefix is None else _ids(prefix, len(items))
    written = _written(curves, lines, folder, currency, description, ids)
    never = sum(bool((row == 0.0).all()) for row in curves["probability"].values)
    pieces = sum(line.number for line in lines)
    said = [f"{counted(len(items), 'component')} of {counted(pieces, 'piece')} for pelicun, damping law {law}"]
    if never:
        said.append(f"{counted(never, 'component')} without a fall at any level (anchored, or under no motion)")
    if any(path.name == "units.json" for path in written.paths):
        said.append(f"values in {currency_unit(currency)}: give units.json as pelicun's option UnitsFile")
    said.append(
        "demands are of the ground motion, at location 0 in direction 1; a piece on floor k is at location k + 1"
    )
    return [*said, LIMITS.strip(), *(f"written: {path}" for path in written.paths)]


def _law(results: xr.Dataset, model: str | None, path: Path) -> int:
    """Return the position of the only law that is meant."""
    found = np.arange(results.sizes["model"]) if model is None else laws_of(results, model, path)
    if found.size > 1:
        named = ", ".join(repr(str(one)) for one in results["model"].values[found])
        said = "is needed" if model is None else f"{model} names {found.size} laws"
        raise StudyError(f"--model {said}: pelicun's tables are of one law, and {path} holds {named:.300}")
    return int(found[0])


def _curves(one: xr.Dataset) -> tuple[xr.Dataset, list[float]]:
    """Return the curves of the pieces, and by how much each differs from the probabilities observed."""
    level = one["level"]
    observed = one["probability"].transpose("item", "level").values
    runs = np.ones(level.size)
    table = np.array([isotonic_probabilities(level.values, row, runs) for row in observed])
    table = np.clip(table, 0.0, 1.0)
    curves = xr.Dataset(
        {"probability": (("item", "level"), table, {"units": "1"})},
        {"item": one["item"].values, "level": ("level", level.values, dict(level.attrs))},
        {"im": str(one.attrs["im"]), "form": ISOTONIC, "title": str(one.attrs.get("title", "Contents of a building"))},
    )
    return curves, np.abs(table - observed).max(axis=1).tolist()


def _line(one: xr.Dataset, i: int, smoothed: float) -> Line:
    """Return a line of the inventory."""
    values: dict[str, Any] = {name: one[name].values[i] for name in ("floor", "count", "value", "anchored")}
    floor = str(values["floor"])
    if not floor.isdecimal():
        raise StudyError(
            f"pelicun's locations are numbers, and {one['item'].values[i]!s:.80} stands on floor {floor!r}"
        )
    room = str(one["room"].values[i]) if "room" in one.coords else ""
    meant = str(one["consequences"].values[i]).split(JOINT)
    together = str(one.attrs.get("pieces", "")) != INDEPENDENT
    note = [f"On floor {floor}{f', {room}' if room else ''}."]
    if bool(values["anchored"]):
        note.append("Anchored in the inventory: it falls under no motion.")
    elif not one["probability"].values[i].any():
        note.append("It fell under no motion at any level.")
    if any(meant):
        note.append(f"Its fall means: {', '.join(filter(None, meant))}.")
    if smoothed > 1e-9:
        note.append(
            f"The probabilities were made not to fall with the level, which changed them by up to {smoothed:.2g}."
        )
    note.append("The pieces of this line fall together." if together else "Each piece has a capacity of its own.")
    return Line(int(floor), int(values["count"]), together, float(values["value"]), " ".join(note))


def _ids(prefix: str, number: int) -> list[str]:
    """Return numbered ids."""
    digits = max(3, len(str(number)))
    ids = [f"{prefix}.{i:0{digits}d}" for i in range(1, number + 1)]
    if not is_id(prefix, TABLE_MARKS) or not is_id(ids[-1], TABLE_MARKS):
        raise StudyError(
            f"--ids {prefix:.80}: must begin with a letter, hold letters, digits, _ and . alone, and be no longer than "
            "some 55 characters"
        )
    return ids


def _written(
    curves: xr.Dataset, lines: list[Line], folder: Path, currency: str, description: str, ids: list[str] | None
) -> Written:
    """Write the files into a folder that is made where missing, and not left empty."""
    made = not folder.exists()
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise StudyError(f"{folder}: cannot be made a folder ({error.strerror})") from None
    try:
        return write_building(curves, lines, folder, currency, description, ids)
    except (TypeError, ValueError) as error:
        if made:
            with suppress(OSError):
                folder.rmdir()
        raise StudyError(str(error)) from None
