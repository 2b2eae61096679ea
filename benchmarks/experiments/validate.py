"""The validation from end to end: predictions first and from tests alone, then outcomes, scores and files.

A file keeps the blind predictions, which are never made again; predictions with measured inputs stand beside them.
"""

from __future__ import annotations

import csv
import hashlib
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

from ...core.writing import write_bytes
from ...models.runs import engine_identity
from ...studies.show import save_figures
from ...studies.tables.files import csv_bytes
from ...studies.tables.table import Column, Table, Value
from .classes import ClassFit
from .figures import calibration_figure
from .predictions import Prediction, predict, predict_measured
from .replays import Replays, read_granite_outcomes, read_runs, replay
from .results import Compared, Granite, class_fits, compared, fitted_band, granite, scores_of, units_of
from .scores import Brier
from .table import REPLAY, Experiment, ExperimentError, Row, read_experiments

PREDICTIONS, MEASURED, OUTCOMES, FIGURE = "predictions.csv", "measured.csv", "outcomes.csv", "calibration"
HEADINGS = ["id", "predicted", "lower", "upper", "dispersion", "how", "inputs"]


class Validation(NamedTuple):
    """Rows with predictions and outcomes, Brier's scores by class and of all, and the granite rocks.

    classes: how far the capacities of each class of pieces are from those predicted blindly.
    """

    rows: list[Compared]
    scores: dict[str, Brier]
    granite: list[Granite]
    classes: dict[str, ClassFit]


def validate(path: Path, folder: Path, granite_folder: Path | None = None, blind: Path | None = None) -> Validation:
    """Predict every row of a table of tests, then compare the predictions with the outcomes.

    Writes predictions, those with measured or fitted inputs, outcomes with their intervals and the calibration figure
    into a folder.  granite_folder: of the granite rocks' runs and table motions.  blind: an earlier
    ``predictions.csv``, whose rows are kept, except rows that had no value and have one now, or another reason.
    Raises ExperimentError for tables and files that cannot be read.
    """
    rows = read_experiments(path)
    replays = None if granite_folder is None else replay(*read_runs(granite_folder))
    made = predict_all([row.test for row in rows], replays, {} if blind is None else read_predictions(blind))
    folder.mkdir(parents=True, exist_ok=True)
    write_bytes(folder / PREDICTIONS, _csv(HEADINGS, [[*_cells(prediction), of] for prediction, of in made]))
    # (outcomes from here on)
    rocks: list[Granite] = []
    outcomes = None
    if replays is not None and granite_folder is not None:
        outcomes = read_granite_outcomes(granite_folder, replays.runs)
        rocks = granite(replays, outcomes)
    second = [second_prediction(row, replays, rocks) for row in rows]
    write_bytes(folder / MEASURED, _csv(HEADINGS[:-1], [_cells(test) for test in second if test is not None]))
    rows_compared = [
        compared(row, plain, again, None if replays is None or outcomes is None else units_of(row, replays, outcomes))
        for row, (plain, _), again in zip(rows, made, second, strict=True)
    ]
    seen: list[list[Value]] = [
        [row.row.test.id, row.observed, row.lower, row.upper, row.overlap if row.judged else None]
        for row in rows_compared
        if row.prediction.made
    ]
    write_bytes(folder / OUTCOMES, _csv(["id", "observed", "lower", "upper", "overlap"], seen))
    figure = calibration_figure(rows_compared)
    if figure is not None:
        save_figures([(FIGURE, figure)], folder)
    return Validation(rows_compared, scores_of(rows_compared), rocks, class_fits(rows_compared, replays, outcomes))


def second_prediction(row: Row, replays: Replays | None, rocks: list[Granite]) -> Prediction | None:
    """Predict a row with inputs that were measured, or fitted on other records; None where it has none.

    No outcome of the row is used; fits use only the other half of a set's records.
    """
    if row.measured is not None:
        return predict_measured(row.test, row.measured)
    if replays is not None and rocks and row.test.predict == REPLAY:
        return fitted_band(row, replays, rocks)
    return None


def predict_all(
    tests: list[Experiment], replays: Replays | None, before: dict[str, tuple[Prediction, str]]
) -> list[tuple[Prediction, str]]:
    """Return the prediction of each test with a hash of its inputs and of the code.

    One that was made `before` is taken whatever has changed since, with the hash that it had.
    """
    code = code_digest() + ("" if replays is None else replays.digest)
    made = []
    for test in tests:
        earlier = before.get(test.id)
        prediction = earlier[0] if earlier is not None and earlier[0].made else predict(test, replays)
        inputs = hashlib.sha256((code + test.digest).encode()).hexdigest()[:16]
        if earlier is not None and prediction.how == earlier[0].how:
            inputs = earlier[1]
        made.append((prediction, inputs))
    return made


@lru_cache(maxsize=1)
def code_digest() -> str:
    """Return a hash of the code that predictions depend on: engine, motions, estimates, and the rules of this room."""
    digest, root = hashlib.sha256(repr(engine_identity()).encode()), Path(__file__).parents[2]
    for folder in ("models", "motions", "fragility", "benchmarks/experiments"):
        for file in sorted((root / folder).rglob("*")):
            if file.suffix in (".py", ".csv"):
                digest.update(file.read_bytes())
    return digest.hexdigest()


def read_predictions(path: Path) -> dict[str, tuple[Prediction, str]]:
    """Read the predictions of a file by id, each with the hash of its inputs; ExperimentError where it has none."""
    known = {}
    try:
        with path.open(encoding="utf-8", newline="") as stream:
            for row in csv.DictReader(stream):
                value, lower, upper, dispersion = (float(row[name] or "nan") for name in HEADINGS[1:5])
                known[row["id"]] = Prediction(row["id"], value, lower, upper, dispersion, row["how"]), row["inputs"]
    except (OSError, ValueError, KeyError, TypeError, csv.Error):
        known = {}
    if not known:
        raise ExperimentError(f"{path}: has no predictions")
    return known


def _cells(prediction: Prediction) -> list[Value]:
    return [prediction.id, prediction.value, prediction.lower, prediction.upper, prediction.dispersion, prediction.how]


def _csv(headings: list[str], rows: list[list[Value]]) -> bytes:
    return csv_bytes(Table("", [*map(Column, headings)], [dict(zip(headings, row, strict=True)) for row in rows]))
