"""The table of published tests: one row for each test, count or survey, with its source and what is predicted of it.

A row is read in three parts, and only the first reaches the predictions: the test, its outcome, and its source.
"""

from __future__ import annotations

import hashlib
import json
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import NamedTuple

from ...models import catalogue
from ...models.friction import CONTACTS
from ...studies.file.csv_table import CsvLine, CsvTable, TableKind
from ...studies.text.error import StudyError

KINDS = ("shake-table count", "field survey", "critical amplitude", "fragility", "restitution", "friction")
PIECES = (
    "bookcase against a wall",
    "bookcase",
    "cabinet against a wall",
    "cabinet",
    "filing cabinet",
    "rack",
    "desk",
    "appliance",
    "furniture",
    "tank",
    "equipment on castors",
    "statue or column",
    "tombstone",
    "vehicle",
    "rock",
    "slender block on a hard floor",
    "slender block on rubber",
    "contact",
)
"""Classes of pieces: the scores are told apart by them."""
OVERTURNED, REPLAY, MEDIAN, RESTITUTION, FRICTION = "overturned", "replay", "median", "restitution", "friction"
QUANTITIES = (OVERTURNED, REPLAY, MEDIAN, RESTITUTION, FRICTION)
"""What can be predicted of a row; any other begins with `NO` and says why not."""
NO = "no: "
BROADBAND, NEAR_FAULT, UNSPECIFIED = "broadband", "near-fault", "unspecified"
PULSE = "pulse"
MOTIONS = (BROADBAND, NEAR_FAULT, UNSPECIFIED, "history", PULSE, "one-cycle sine", "free rocking")
FREE, WALL = "free", "wall"
WEDGE, POLE, WEDGE_AND_POLE = "wedge", "pole", "wedge and pole"
FIXINGS = (WEDGE, POLE, WEDGE_AND_POLE, "mat", "bracket", "strap", "bolts", "built in")
JMA, PGA, RATIO = "JMA intensity", "PGA", "PGV/PGA"
QUALITIES = {
    "A": "the data or the full text",
    "B": "an abstract, a first page, a table or a summary of the source itself",
    "C": "second-hand",
    "D": "recalled",
}
"""What a row was read from."""
COLUMNS = (
    *("id", "kind", "piece", "specimen", "width_m", "height_m", "breadth_m", "cm_height_m", "slenderness", "mass_kg"),
    *("base", "catalogue", "placement", "fixing", "contact", "motion", "excitation", "measure", "level_low"),
    *("level_high", "unit", "frequency_hz", "trials", "overturned", "quantity", "value", "dispersion", "outcome"),
    *("source", "address", "place", "read", "quality", "predict"),
    *("measured_cm_height_m", "measured_inertia_factor", "measured_restitution", "measured_friction", "measured_from"),
)
MOST_ROWS = 10_000


class ExperimentError(StudyError):
    """Error for a table of tests that cannot be used: one sentence with file, line, column and what is allowed."""


KIND = TableKind("table of tests", COLUMNS, MOST_ROWS, 16 * 2**20, ExperimentError)


@dataclass(frozen=True)
class Experiment:
    """What is known of a test before its outcome; sizes in m and kg, one of each for every specimen of equal share.

    width: the side in the direction of the fall; breadth: the other side.  levels: the lower and upper end of the
    measure in its unit.  predict: one of `QUANTITIES`, or why nothing is predicted.
    """

    id: str
    kind: str
    piece: str
    specimen: str
    width: tuple[float, ...]
    height: tuple[float, ...]
    cm_height: float | None
    slenderness: float | None
    mass: tuple[float, ...]
    base: str
    catalogue: tuple[str, ...]
    placement: str
    fixing: str
    contact: str
    motion: str
    excitation: str
    measure: str
    levels: tuple[float | None, float | None]
    unit: str
    frequency: float | None
    trials: int | None
    quantity: str
    predict: str

    @property
    def predicted(self) -> bool:
        """Whether anything is predicted of it."""
        return not self.predict.startswith(NO)

    @property
    def digest(self) -> str:
        """A hash of all of it."""
        return hashlib.sha256(json.dumps(asdict(self), sort_keys=True).encode()).hexdigest()[:16]


class Measured(NamedTuple):
    """Inputs of a test that were measured or follow from its stated shape, for a second prediction; None: not known.

    cm_height: m; inertia_factor: lambda of the block with that mass centre; restitution: e; friction: the static one.
    """

    cm_height: float | None
    inertia_factor: float | None
    restitution: float | None
    friction: float | None
    read: str


class Outcome(NamedTuple):
    """The outcome of a test: how many overturned, or a measured value, with a dispersion where it has one."""

    overturned: int | None
    value: float | None
    dispersion: float | None
    text: str


class Source(NamedTuple):
    """Where a row is from, and what was read of it."""

    source: str
    address: str
    place: str
    read: str
    quality: str


class Row(NamedTuple):
    """A row of the table."""

    test: Experiment
    outcome: Outcome
    source: Source
    measured: Measured | None = None


def read_experiments(path: Path) -> list[Row]:
    """Read a table of published tests, a CSV file with the columns `COLUMNS` in any order.

    ExperimentError for a file, column or cell that is not allowed, and a row that lacks what its prediction needs.
    """
    rows: list[Row] = []
    for line in CsvTable(path, KIND):
        row = _row(line)
        if any(row.test.id == earlier.test.id for earlier in rows):
            line.refuse("id", f"is used twice: {row.test.id!r}")
        rows.append(row)
    if not rows:
        raise ExperimentError(f"{path}: has no rows")
    return rows


def _row(line: CsvLine) -> Row:
    test = Experiment(
        id=_needed(line, "id"),
        kind=_choice(line, "kind", KINDS),
        piece=_choice(line, "piece", PIECES),
        specimen=_needed(line, "specimen"),
        width=_sizes(line, "width_m"),
        height=_sizes(line, "height_m"),
        cm_height=line.number_in("cm_height_m", above=0.0),
        slenderness=line.number_in("slenderness", above=0.0),
        mass=_sizes(line, "mass_kg"),
        base=line.text("base"),
        catalogue=_parts(line, "catalogue"),
        placement=_optional(line, "placement", (FREE, WALL)),
        fixing=_optional(line, "fixing", FIXINGS),
        contact=_optional(line, "contact", tuple(CONTACTS)),
        motion=_optional(line, "motion", MOTIONS),
        excitation=line.text("excitation"),
        measure=line.text("measure"),
        levels=(line.number_in("level_low", at_least=0.0), line.number_in("level_high", at_least=0.0)),
        unit=line.text("unit"),
        frequency=line.number_in("frequency_hz", above=0.0),
        trials=line.count_in("trials"),
        quantity=line.text("quantity"),
        predict=_needed(line, "predict"),
    )
    outcome = Outcome(
        line.count_in("overturned"), line.number_in("value"), line.number_in("dispersion", above=0.0),
        line.text("outcome"),
    )  # fmt: skip
    if outcome.overturned is not None and (test.trials is None or outcome.overturned > test.trials):
        line.refuse("overturned", f"must be at most the trials, got {outcome.overturned}")
    source = Source(
        _needed(line, "source"), line.text("address"), line.text("place"), _needed(line, "read"),
        _choice(line, "quality", tuple(QUALITIES)),
    )  # fmt: skip
    if not source.address and not source.place:
        line.refuse("address", "must say where the source is, or place must")
    _check_prediction(line, test)
    return Row(test, outcome, source, _measured(line, test))


def _measured(line: CsvLine, test: Experiment) -> Measured | None:
    """Return the measured inputs of a row, None where it has none."""
    measured = Measured(
        line.number_in("measured_cm_height_m", above=0.0),
        line.number_in("measured_inertia_factor", above=1.0, at_most=2.0),
        line.number_in("measured_restitution", above=0.0, at_most=1.0),
        line.number_in("measured_friction", above=0.0),
        line.text("measured_from"),
    )
    if all(value is None for value in measured[:4]):
        return None
    if not measured.read:
        line.refuse("measured_from", "must say where the measured inputs are from")
    if test.predict not in (OVERTURNED, MEDIAN):
        line.refuse("measured_from", f"is for rows whose prediction is {OVERTURNED} or {MEDIAN}")
    if (measured.cm_height is None) != (measured.inertia_factor is None):
        line.refuse("measured_inertia_factor", "and measured_cm_height_m must be given together")
    return measured


def _check_prediction(line: CsvLine, test: Experiment) -> None:
    """Refuse a row whose prediction needs what it does not have."""
    if not test.predicted:
        if not test.predict.removeprefix(NO).strip():
            line.refuse("predict", "must say after 'no: ' why nothing is predicted")
        return
    if test.predict not in QUANTITIES:
        line.refuse("predict", f"must be one of {', '.join(QUANTITIES)}, or {NO!r} and why, got {test.predict!r}")
    if len({len(sizes) for sizes in (test.width, test.height, test.mass) if sizes}) > 1:
        line.refuse("height_m", "must have as many sizes as width_m and mass_kg have")
    for name in test.catalogue:
        if name not in catalogue:
            line.refuse("catalogue", f"has no item {name!r}: toppling catalogue lists them")
    sized = bool(test.catalogue) or bool(test.width and test.height)
    if test.predict in (OVERTURNED, MEDIAN):
        if not sized:
            line.refuse("predict", "needs width_m and height_m, or a catalogue item")
        if test.motion not in (BROADBAND, NEAR_FAULT, UNSPECIFIED):
            line.refuse("motion", f"must be {BROADBAND}, {NEAR_FAULT} or {UNSPECIFIED} for this prediction")
        if not test.placement:
            line.refuse("placement", f"must be {FREE} or {WALL} for this prediction")
        if test.fixing and (test.fixing not in (WEDGE, POLE, WEDGE_AND_POLE) or not test.mass):
            line.refuse("fixing", f"can be {WEDGE}, {POLE} or {WEDGE_AND_POLE} of a piece with mass_kg here")
    if test.predict == OVERTURNED:
        low, high = test.levels
        if test.measure != JMA or low is None or high is None or low >= high:
            line.refuse("measure", f"must be {JMA!r} with level_low below level_high for this prediction")
        if not test.trials:
            line.refuse("trials", "must be given for this prediction")
    if test.predict == MEDIAN and (test.measure, test.unit) != (PGA, "m/s2"):
        line.refuse("measure", f"must be {PGA!r} in m/s2 for this prediction")
    if test.predict == REPLAY and (test.measure != RATIO or test.levels[0] is None):
        line.refuse("measure", f"must be {RATIO!r} with level_low for a replay")
    if test.predict == RESTITUTION and test.slenderness is None:
        line.refuse("slenderness", "must be given for this prediction")
    if test.predict == FRICTION and not test.contact:
        line.refuse("contact", f"must be one of {', '.join(CONTACTS)} for this prediction")


def _needed(line: CsvLine, column: str) -> str:
    cell = line.text(column)
    if not cell:
        line.refuse(column, "must not be empty")
    return cell


def _choice(line: CsvLine, column: str, allowed: tuple[str, ...]) -> str:
    cell = line.text(column)
    if cell not in allowed:
        line.refuse(column, f"must be one of {', '.join(allowed)}, got {cell!r}")
    return cell


def _optional(line: CsvLine, column: str, allowed: tuple[str, ...]) -> str:
    return _choice(line, column, allowed) if line.text(column) else ""


def _parts(line: CsvLine, column: str) -> tuple[str, ...]:
    """Return the parts of a cell between vertical bars."""
    cell = line.text(column)
    return tuple(part.strip() for part in cell.split("|")) if cell else ()


def _sizes(line: CsvLine, column: str) -> tuple[float, ...]:
    """Return the numbers of a cell between vertical bars, one for each specimen."""
    sizes = []
    for part in _parts(line, column):
        size = CsvLine(line.table, line.number, {column: part}).number_in(column, above=0.0)
        if size is None:
            line.refuse(column, "must have a number on both sides of |")
        sizes.append(size)
    return tuple(sizes)
