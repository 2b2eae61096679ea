"""The validation from end to end: predictions first and from tests alone, then outcomes, scores, tables and files.

Predictions are kept one by one: after an interruption the same call goes on with those that are missing.  Those that
were made blind, and kept in a file, are taken as they were; predictions with measured inputs stand beside them.
"""

from __future__ import annotations

import csv
import hashlib
import math
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

from ...core.wording import counted, system_reason, whole_percent
from ...core.writing import write_bytes
from ...models.runs import engine_identity
from ..show import save_figures
from ..store.outputs import own_files
from ..tables.values import Cell, ValueTable, csv_bytes, known
from ..text.encoding import json_text
from ..text.error import StudyError
from ..text.rows import Rows
from .classes import ClassFit
from .predictions import Prediction, predict, predict_measured
from .pulses import Pulses, candidates, read_pulses
from .replays import Replays, read_granite_outcomes, read_runs, replay
from .results import (
    Compared,
    Granite,
    Scores,
    class_fits,
    compared,
    fitted_band,
    fitted_pulses,
    granite,
    granite_lines,
    score,
    scores_of,
    units_of,
)
from .scores import Brier
from .table import PULSE, REPLAY, Experiment, ExperimentError, Row, read_experiments

PREDICTIONS, MEASURED, TABLE, SCORES = "predictions.csv", "measured.csv", "validation.csv", "scores.json"
FIGURE = "calibration"
NAMES = (PREDICTIONS, MEASURED, TABLE, SCORES, f"{FIGURE}.png")
"""Names of all files that a validation may have."""
HEADINGS = ["id", "predicted", "lower", "upper", "dispersion", "how", "inputs"]
Progress = Callable[[int, int], None]


class Validation(NamedTuple):
    """Rows with predictions and outcomes, scores over all and by class, the granite rocks, pulses, files written.

    second: scores of the predictions with measured or fitted inputs, over the rows that have one.  classes: how far the
    capacities of each class of pieces are from those predicted blindly.
    """

    rows: list[Compared]
    overall: Scores
    scores: list[Scores]
    second: Scores
    granite: list[Granite]
    pulses: list[Pulses]
    classes: dict[str, ClassFit]
    written: list[Path]


def validate(
    path: Path,
    folder: Path,
    granite_folder: Path | None = None,
    pulses: Path | None = None,
    blind: Path | None = None,
    progress: Progress | None = None,
) -> Validation:
    """Predict every row of a table of tests, then hold the predictions against the outcomes.

    Parameters
    ----------
    path : Path
        The table (`read_experiments`).
    folder : Path
        For ``predictions.csv``, ``measured.csv`` (predictions with measured or fitted inputs), ``validation.csv``,
        ``scores.json`` and ``calibration.png``, made where missing.
    granite_folder : Path, optional
        The folder of the granite rocks' runs and table motions.
    pulses : Path, optional
        The file of the pulse trials.
    blind : Path, optional
        Predictions that were made before, a ``predictions.csv``: its rows are taken as they are, but for those without
        a value that have one now or another reason.
    progress : callable, optional
        Called with (rows predicted, rows in all).

    Raises
    ------
    StudyError
        One sentence: a table or a file that cannot be read or written.
    """
    from .figures import calibration_figure  # noqa: PLC0415 - matplotlib

    rows = read_experiments(path)
    sets = [] if pulses is None else read_pulses(pulses)
    replays = None if granite_folder is None else replay(*read_runs(granite_folder))
    with own_files(folder, "validate", NAMES):
        before = {} if blind is None else read_predictions(blind)
        made = predict_all([row.test for row in rows], folder / PREDICTIONS, replays, progress, before)
        # (outcomes from here on)
        rocks: list[Granite] = []
        outcomes = None
        if replays is not None and granite_folder is not None:
            outcomes = read_granite_outcomes(granite_folder, replays.runs)
            rocks = granite(replays, outcomes)
        second = [second_prediction(row, replays, rocks, sets) for row in rows]
        _write(folder / MEASURED, csv_bytes(_second_table(second)))
        found = [
            compared(row, one, other, None if replays is None or outcomes is None else units_of(row, replays, outcomes))
            for row, one, other in zip(rows, made, second, strict=True)
        ]
        overall, scores = score("all", [one for one in found if one.prediction.made]), scores_of(found)
        again = score("with measured inputs", [one._replace(prediction=one.measured) for one in found if one.measured])
        classes = class_fits(found, replays, outcomes)
        _write(folder / TABLE, csv_bytes(_value_table(found)))
        content = {
            "overall": overall, "pieces": scores, "measured": again,
            "granite": [one._asdict() | {"fits": one.fits.halves} for one in rocks],
            "pulses": [one._asdict() | {"fits": one.fits.halves} for one in sets], "classes": classes,
            "engine": engine_identity(),
        }  # fmt: skip
        _write(folder / SCORES, (json_text(plain(content), indent=1) + "\n").encode())
        figure = calibration_figure(found)
        drawn = [] if figure is None else save_figures([(FIGURE, figure)], folder)
    written = [folder / PREDICTIONS, folder / MEASURED, folder / TABLE, folder / SCORES, *drawn]
    return Validation(found, overall, scores, again, rocks, sets, classes, written)


def second_prediction(row: Row, replays: Replays | None, rocks: list[Granite], sets: list[Pulses]) -> Prediction | None:
    """Predict a row with inputs that were measured, or fitted on other records; None where it has none.

    It takes no outcome of the row; fits take those of the other half of a set's records alone.
    """
    if row.measured is not None:
        return predict_measured(row.test, row.measured)
    if replays is not None and rocks and row.test.predict == REPLAY:
        return fitted_band(row, replays, rocks)
    own = next((one for one in sets if row.test.motion == PULSE and row.test.id.endswith(f"-{one.name}")), None)
    if own is None:
        return None
    if own.trials != row.test.trials:
        raise ExperimentError(f"{row.test.id}: has {row.test.trials} trials, the file of pulses {own.trials}")
    return fitted_pulses(row, own.fits, [candidates()[one.fitted].label for one in own.fits.halves])


def predict_all(
    tests: list[Experiment],
    path: Path,
    replays: Replays | None = None,
    progress: Progress | None = None,
    before: dict[str, tuple[Prediction, str]] | None = None,
) -> list[Prediction]:
    """Predict tests one by one, each written into a file as soon as it is there; those of the file are kept.

    A prediction of the file is kept where its test, the replays and the code are those that it was made with; one that
    was made `before` is taken whatever has changed since.
    """
    code = code_digest() + ("" if replays is None else replays.digest)
    kept, made = _kept(path), []
    for i, test in enumerate(tests):
        inputs = hashlib.sha256((code + test.digest).encode()).hexdigest()[:16]
        one = kept.get((test.id, inputs))
        new, earlier = one is None, (before or {}).get(test.id)
        if earlier is not None and earlier[0].made:
            one = earlier[0]
        elif one is None:
            one = predict(test, replays)
        if earlier is not None and one.how == earlier[0].how:  # (its hash is that of the code that it was made with)
            inputs = earlier[1]
        made.append((one, inputs))
        if new or i == len(tests) - 1:
            table = ValueTable(HEADINGS, [[*_cells(each), digest] for each, digest in made])
            _write(path, csv_bytes(table))
        if progress is not None:
            progress(i + 1, len(tests))
    return [one for one, _ in made]


@lru_cache(maxsize=1)
def code_digest() -> str:
    """Return a hash of the code that predictions depend on: engine, motions, estimates, and the rules of this room."""
    found, root = hashlib.sha256(repr(engine_identity()).encode()), Path(__file__).parents[2]
    for folder in ("models", "motions", "fragility", "studies/validation"):
        for file in sorted((root / folder).rglob("*")):
            if file.suffix in (".py", ".csv"):
                found.update(file.read_bytes())
    return found.hexdigest()


def read_predictions(path: Path) -> dict[str, tuple[Prediction, str]]:
    """Read the predictions of a file by id, each with the hash of its inputs.

    Raises
    ------
    ExperimentError
        A file without such predictions.
    """
    found = {name: (one, inputs) for (name, inputs), one in _kept(path).items()}
    if not found:
        raise ExperimentError(f"{path}: has no predictions")
    return found


def _kept(path: Path) -> dict[tuple[str, str], Prediction]:
    """Return the predictions of a file by id and inputs; none where it cannot be read."""
    try:
        with path.open(encoding="utf-8", newline="") as stream:
            rows = list(csv.DictReader(stream))
        found = {}
        for row in rows:
            value, lower, upper, dispersion = (float(row[name] or "nan") for name in HEADINGS[1:5])
            found[row["id"], row["inputs"]] = Prediction(row["id"], value, lower, upper, dispersion, row["how"])
        return found
    except (OSError, ValueError, KeyError, TypeError, csv.Error):
        return {}


def _cells(one: Prediction) -> list[Cell]:
    return [one.id, *(known(value) for value in (one.value, one.lower, one.upper, one.dispersion)), one.how]


def _second_table(made: list[Prediction | None]) -> ValueTable:
    """Return the predictions with measured inputs."""
    return ValueTable(HEADINGS[:-1], [_cells(one) for one in made if one is not None])


def _value_table(rows: list[Compared]) -> ValueTable:
    """Return all rows with predictions, outcomes and sources."""
    headings = ["id", "kind", "piece", "predict", "predicted", "predicted lower", "predicted upper"]
    headings += [
        "with measured inputs",
        "measured lower",
        "measured upper",
        "observed",
        "observed lower",
        "observed upper",
    ]
    headings += ["trials", "intervals overlap", "how", "how with measured inputs", "source", "address", "place", "read"]
    headings += ["quality"]
    cells: list[list[Cell]] = []
    for one in rows:
        test, made = one.row.test, one.prediction
        second = (math.nan,) * 3 if one.measured is None else one.measured[1:4]
        values = (made.value, made.lower, made.upper, *second, one.observed, one.lower, one.upper)
        numbers = [known(value) for value in values]
        overlap = "" if not one.judged else "yes" if one.overlap else "no"
        cells.append(
            [
                test.id, test.kind, test.piece, test.predict, *numbers, test.trials, overlap, made.how,
                "" if one.measured is None else one.measured.how, *one.row.source,
            ]
        )  # fmt: skip
    return ValueTable(headings, cells)


def plain(content: object) -> object:
    """Return named tuples as dictionaries and numbers that are not finite as None, for JSON."""
    if isinstance(content, tuple) and hasattr(content, "_asdict"):
        return {name: plain(one) for name, one in content._asdict().items()}
    if isinstance(content, dict):
        return {str(name): plain(one) for name, one in content.items()}
    if isinstance(content, list | tuple):
        return [plain(one) for one in content]
    if isinstance(content, float) and not math.isfinite(content):
        return None
    return content


def brier_rows(found: Validation, to: str) -> list[tuple[str, ...]]:
    """Return Brier's scores of every class of pieces, and of all, as rows of text; `to` stands between two ends."""
    return [
        (
            one.name, str(one.brier.rows), str(one.brier.trials), f"{one.brier.score:.3f}",
            f"{one.brier.reference:.3f}", f"{one.brier.right_low:.3f}{to}{one.brier.right_high:.3f}",
            _skill(one.brier, to),
        )
        for one in [*found.scores, found.overall, found.second]
        if one.brier is not None
    ]  # fmt: skip


def _skill(brier: Brier, to: str) -> str:
    """Return 1 - score/reference with its interval over records or sources; '' where there is none."""
    if math.isnan(brier.skill) or math.isnan(brier.skill_lower):
        return ""
    return f"{brier.skill:.2f} ({brier.skill_lower:.2f}{to}{brier.skill_upper:.2f})"


def tables(found: Validation) -> list[Rows]:
    """Return the table of all predicted rows and that of the scores by class, for a terminal."""
    own = [one for one in found.rows if one.prediction.made]
    rows = [
        (
            one.row.test.id, one.row.test.piece, interval_text(one, BLIND), interval_text(one, SECOND),
            interval_text(one, SEEN), trials_text(one.row),
        )
        for one in own
    ]  # fmt: skip
    scored = brier_rows(found, "–")
    head = ("class", "rows", "trials", "Brier", "one share", "if right", "skill")
    return [
        Rows(
            "Predicted beside observed, with 95 % intervals",
            ("row", "class", "blind", "measured", "observed", "of"),
            rows,
        ),
        Rows("Brier's score, of one share for all trials, and where these probabilities are right", head, scored),
    ]


def lines(found: Validation) -> list[str]:
    """Return what is said below the tables."""
    own = [one for one in found.rows if one.prediction.made]
    judged = [one for one in own if one.judged]
    told = [
        f"{counted(len(found.rows), 'row')}, {len(own)} predicted (the others say why not, {TABLE}); intervals of "
        f"predictions and outcomes overlap in {sum(one.overlap for one in judged)} of {len(judged)} that have one"
    ]
    told += [
        f"{quantity}: predicted over measured {ratio.mean:.2f}"
        + ("" if math.isnan(ratio.lower) else f" ({ratio.lower:.2f}–{ratio.upper:.2f})")
        + f", {counted(ratio.number, 'row')}"
        for quantity, ratio in found.overall.ratios.items()
    ]
    told += granite_lines(found.granite)
    told += [
        f"pulses {one.name}: {one.toppled} of {one.trials} toppled, not predicted blindly (sizes are not known); best "
        f"threshold of PGA {one.pga.right:.2f}, of PGV {one.pgv.right:.2f} (both fitted); sizes fitted on half of the "
        f"durations are right in {' and '.join(f'{half.right:.2f}' for half in one.fits.halves)} of the others"
        for one in found.pulses
    ]
    told += [
        f"class {piece}: capacities {one.ratio:.2f} ({one.ratio_lower:.2f}–{one.ratio_upper:.2f}) times those "
        f"predicted, dispersion beyond it {one.beta:.2f} ({one.beta_lower:.2f}–{one.beta_upper:.2f}); "
        f"{counted(one.tests, 'test')} of {counted(one.clusters, 'record')}, {counted(one.sources, 'source')}"
        for piece, one in found.classes.items()
        if one.enough
    ]
    return told


def trials_text(row: Row) -> str:
    """Return the number of trials of a row, '' where it is of no count."""
    return "" if row.test.trials is None else str(row.test.trials)


BLIND, SECOND, SEEN = "blind", "with measured inputs", "observed"


def interval_text(one: Compared, which: str) -> str:
    """Return what is predicted of a row, blind or with measured inputs, or what was observed, with its interval.

    Per cent of counts, else a value; '' where there is none.
    """
    made = one.measured if which == SECOND else one.prediction
    if made is None:
        return ""
    value, lower, upper = (one.observed, one.lower, one.upper) if which == SEEN else made[1:4]
    if math.isnan(value):
        return ""
    if one.row.outcome.overturned is not None:
        return f"{whole_percent(value)} ({whole_percent(lower)}–{whole_percent(upper)})"
    return f"{value:.3g}" + ("" if math.isnan(lower) else f" ({lower:.3g}–{upper:.3g})")


def _write(path: Path, content: bytes) -> None:
    try:
        write_bytes(path, content)
    except OSError as error:
        raise StudyError(f"{path}: cannot be written ({system_reason(error)})") from None
