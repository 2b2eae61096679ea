"""Classes of pieces: tests of each, and the spread of true over computed capacities (`make validate-experiments`)."""

import csv
import math
from functools import lru_cache
from importlib import resources
from typing import Any, NamedTuple

from ...core.facts import Fact

TABLE = "piece_classes.csv"
NAMES = {
    "bookcase-wall": "bookcase against a wall",
    "bookcase": "bookcase",
    "cabinet-wall": "cabinet against a wall",
    "cabinet": "cabinet",
    "filing-cabinet": "filing cabinet",
    "rack": "rack",
    "desk": "desk",
    "appliance": "appliance",
    "tank": "tank",
    "statue": "statue or column",
    "tombstone": "tombstone",
    "rock": "rock",
    "slender-block": "slender block on a hard floor",
    "slender-block-rubber": "slender block on rubber",
}
"""The names of classes in study files, and those in the table of tests."""
COUNTS = ("tests", "fell", "records", "sources")


class PieceClass(NamedTuple):
    """Test results of a class: counts, and true over computed capacities, NaN with too few tests.

    `fell`, `predicted`: falls in its tests, observed and predicted blindly. `records`: clusters of tests that depend on
    each other. `ratio`: the median of true over computed capacity, `beta`: the spread of its logarithm. `brier`,
    `reference`: Brier's score of the blind predictions, and of one share for all tests.
    """

    name: str
    tests: int
    fell: int
    predicted: float
    records: int
    sources: int
    ratio: float
    ratio_lower: float
    ratio_upper: float
    beta: float
    beta_lower: float
    beta_upper: float
    brier: float
    reference: float

    @property
    def beta_m(self) -> float:
        """The default modelling uncertainty: root mean square of ln(true/computed); NaN of too few tests."""
        return round(math.hypot(self.beta, math.log(self.ratio)), 2) if self.ratio > 0.0 else math.nan


COLUMNS = PieceClass._fields


@lru_cache(maxsize=1)
def piece_classes() -> dict[str, PieceClass]:
    """Return all classes by name; those without a test, too."""
    text = resources.files(__package__).joinpath(TABLE).read_text(encoding="utf-8")
    rows = {row["name"]: row for row in csv.DictReader(text.splitlines())}
    return {name: _class_of(name, rows.get(name, {})) for name in NAMES}


def _class_of(name: str, row: dict[str, str]) -> PieceClass:
    counts: dict[str, Any] = {column: int(row.get(column) or 0) for column in COUNTS}
    numbers: dict[str, Any] = {
        column: float(row.get(column) or "nan") for column in COLUMNS[1:] if column not in COUNTS
    }
    return PieceClass(name, **counts, **numbers)


def with_class(given: Any) -> Any:
    """Return a table of a study file with the modelling uncertainty of its class if it has none of its own."""
    if not isinstance(given, dict) or "modelling_dispersion" in given:
        return given
    of_class = piece_classes().get(str(given.get("modelling_class")))
    return (
        given if of_class is None or math.isnan(of_class.beta_m) else {**given, "modelling_dispersion": of_class.beta_m}
    )


def class_notes(name: str | None) -> list[Fact]:
    """Return the facts on a class; nothing without a class."""
    return [] if name is None else [Fact("validity.tests", names=(name,), more=piece_classes()[name]._asdict())]
