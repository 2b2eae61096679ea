"""The page docs/experiments.md, its figure and its tables: published tests compared with predictions.

TOPPLING_GRANITE names the folder of the granite rocks' table motions, which are not part of the project.  Without them
the page has no result of the rocks.  Blind predictions that were committed before are taken from
docs/experiments/predictions.csv as they are.
"""

from __future__ import annotations

import math
import os
import shutil
import sys
import tempfile
from collections.abc import Iterable, Iterator
from pathlib import Path

from ...core.wording import counted
from ...studies.plan.piece_classes import COLUMNS, NAMES, TABLE as CLASS_TABLE, PieceClass
from ..experiments import classes, ensembles, explanations, replays, specimens, table
from ..experiments.ensembles import CLASSES
from ..experiments.results import Compared
from ..experiments.validate import MEASURED, OUTCOMES, PREDICTIONS, Validation, validate
from .page import ROOT, folder, template, write, write_csv
from .tables import Interval, span, table as markdown

GRANITE = "TOPPLING_GRANITE"


def main() -> None:
    """Write the page, its figure and its tables."""
    granite = Path(os.environ[GRANITE]) if os.environ.get(GRANITE) else None
    if granite is None:
        print(f"{GRANITE} is not set: the page is made without these data", file=sys.stderr)
    out, docs = folder("experiments"), ROOT / "docs"
    with tempfile.TemporaryDirectory() as made:
        validation = validate(docs / "experiments.csv", Path(made), granite, docs / "experiments" / PREDICTIONS)
        for name in (PREDICTIONS, MEASURED, OUTCOMES, "calibration.png"):
            shutil.copyfile(Path(made) / name, out / name)
    classes_made = classes_of(validation)
    lines = (["" if isinstance(value, float) and math.isnan(value) else value for value in row] for row in classes_made)
    write_csv("experiments", CLASS_TABLE.removesuffix(".csv"), COLUMNS, lines)
    heads: tuple[str, ...] = ("class", "rows", "trials", "overlaps", "rows with intervals", "blind prediction")
    write_csv("experiments", "classes", heads, answer(validation))
    heads = ("class", "rows", "trials", "Brier's score", "of one share for all", "if right: lower", "if right: upper")
    write_csv("experiments", "scores", (*heads, "skill", "skill: lower", "skill: upper"), scores(validation))
    write_csv("experiments", "changes", ("row", "change", "unit", "before", "changed", "observed"), scenes(validation))
    if granite is not None:
        known = replays.replay(*replays.read_runs(granite))
        heads = ("change", f"falls predicted in {len(known.runs)} runs", "falls predicted in runs of long period")
        write_csv("experiments", "rock_changes", heads, explanations.rock_scenes(known))
        heads = ("rock", "runs", "overturned", "half-width, mm", "predicted", "share right", "best PGV", "other rock")
        write_csv("experiments", "rocks", heads, blind_rocks(validation))
        heads = ("rock", "half", "runs", "overturned", "fitted, mm", "predicted", "lower", "upper", "right", "PGV")
        write_csv("experiments", "rock_fits", heads, fitted_rocks(validation))
    write("experiments", page(validation))


def page(validation: Validation) -> str:
    """Return the page."""
    return template("experiments").format(
        rows=len(validation.rows),
        sources=len({row.row.source.source for row in validation.rows}),
        predicted=sum(row.prediction.made for row in validation.rows),
        rocks=rocks(validation),
        class_table=class_table(classes_of(validation)),
        least=classes.LEAST_CLUSTERS,
        gap=f"{1000.0 * specimens.WALL_GAP:g}",
        number=ensembles.NUMBER,
        seed=ensembles.SEED,
        classes=", ".join(f"{name} ({low:g}–{high:g})" for name, (low, high) in CLASSES.items()),
        widths=", ".join(f"{1000.0 * width:g}" for width in replays.HALF_WIDTHS),
    )


def answer(validation: Validation) -> Iterator[tuple[object, ...]]:
    """Yield rows, trials, overlapping intervals and falls of each class of pieces with a prediction."""
    counted_rows = [row for row in validation.rows if row.prediction.made and not math.isnan(row.observed)]
    for piece in table.PIECES:
        tests = [test for test in counted_rows if test.row.test.piece == piece]
        if tests:
            trials = sum(test.row.test.trials or 0 for test in tests if test.counted)
            judged = [test for test in tests if test.judged]
            yield piece, len(tests), trials, sum(test.overlap for test in judged), len(judged), direction(tests)


def rocks(validation: Validation) -> str:
    """Return the result of the granite rocks, or nothing if they were not replayed."""
    if not validation.granite:
        return ""
    middle = len(replays.HALF_WIDTHS) // 2
    fell = sum(rock.overturned for rock in validation.granite)
    runs = sum(rock.runs for rock in validation.granite)
    predicted = sum(rock.predicted[middle] for rock in validation.granite)
    highest = sum(max(rock.predicted) for rock in validation.granite)
    halves = [half for rock in validation.granite for half in rock.fits.halves]
    right, threshold = (span([getattr(half, name) for half in halves]) for name in ("right", "pgv"))
    fitted = span([1000.0 * float(replays.CANDIDATES[half.fitted]) for half in halves], "g")
    scan = span([1000.0 * width for width in replays.HALF_WIDTHS], "g")
    return (
        f"- **Rocks: unconservative.** Two granite rocks fell in {fell} of {runs} runs. The middle half-width of the "
        f"scan predicts {predicted} falls, and the smallest half-width {highest}. The blind model is no better than "
        "one share for all trials, and a fitted threshold of PGV is better. A half-width fitted on half of the records "
        f"gets {right} of the other runs right. A threshold fitted in the same way gets {threshold}, and the outcome "
        f"of the other rock {validation.granite[0].twin:.2f}. The fitted half-widths are {fitted} mm; the scan has "
        f"{scan} mm. The model predicts rocking about as well as possible, and misses the width of the support.\n"
    )


MOST_OF_ONE = 10
"""Trials of a class below which they are called few."""


def direction(rows: list[Compared]) -> str:
    """Return observed and predicted falls of a class, or the mean ratio of predicted and measured values."""
    counts = [row for row in rows if row.counted]
    if counts:
        trials = sum(row.row.test.trials or 0 for row in counts)
        fallen = sum(row.row.outcome.overturned or 0 for row in counts)
        predicted = sum((row.row.test.trials or 0) * row.prediction.value for row in counts)
        falls = f"{fallen} of {trials} fell, {predicted:.1f} predicted"
        return falls if trials >= MOST_OF_ONE else f"{falls}: few trials"
    ratios = [row.prediction.value / row.observed for row in rows if row.observed > 0.0]
    mean = math.exp(sum(map(math.log, ratios)) / len(ratios))
    return f"predicted over measured {mean:.2f}"


def scores(validation: Validation) -> Iterator[tuple[object, ...]]:
    """Yield Brier's scores of every class of pieces, of all, and of predictions with measured inputs."""
    for name, score in validation.scores.items():
        shares = (score.score, score.reference, score.right_low, score.right_high)
        skills = (score.skill, score.skill_lower, score.skill_upper)
        known = not any(map(math.isnan, skills))
        yield (
            *(name, score.rows, score.trials, *(f"{share:.3f}" for share in shares)),
            *(f"{skill:.2f}" if known else "" for skill in skills),
        )


def blind_rocks(validation: Validation) -> Iterator[tuple[object, ...]]:
    """Yield the runs of both rocks for each half-width of the scan.

    The threshold of PGV is fitted to the same runs; the share of runs with the same outcome of both rocks is a rough
    limit of what a model of one of them can reach.
    """
    for rock in validation.granite:
        for width, predicted, right in zip(replays.HALF_WIDTHS, rock.predicted, rock.right, strict=True):
            numbers = (f"{right:.2f}", f"{rock.pgv:.2f}", f"{rock.twin:.2f}")
            yield rock.rock, rock.runs, rock.overturned, f"{1000.0 * width:g}", predicted, *numbers


def fitted_rocks(validation: Validation) -> Iterator[tuple[object, ...]]:
    """Yield each half of the records (every other one by name) with the half-width fitted on the other half."""
    for rock in validation.granite:
        for half in rock.fits.halves:
            width = f"{1000.0 * replays.CANDIDATES[half.fitted]:g}"
            predicted = half.predicted, half.predicted_lower, half.predicted_upper
            shares = f"{half.right:.2f}", f"{half.pgv:.2f}"
            yield rock.rock, half.half + 1, half.runs, half.overturned, width, *predicted, *shares


def classes_of(validation: Validation) -> list[PieceClass]:
    """What the tests say of each class that has any, for study files."""
    rows = []
    for name, piece in NAMES.items():
        fit = validation.classes.get(piece)
        scored = validation.scores.get(piece)
        if fit is None or scored is None:
            continue
        tested = [row for row in validation.rows if row.counted and row.row.test.piece == piece]
        fell = sum(row.row.outcome.overturned or 0 for row in tested)
        predicted = sum((row.row.test.trials or 0) * row.prediction.value for row in tested)
        numbers = (round(number, 3) for number in (*fit[3:], scored.score, scored.reference))
        rows.append(PieceClass(name, fit.tests, fell, round(predicted, 1), fit.clusters, fit.sources, *numbers))
    return rows


def class_table(scored: Iterable[PieceClass]) -> str:
    """Return bias and spread of every class of study files, with a test or without."""
    by_name = {row.name: row for row in scored}
    rows: list[tuple[str, ...]] = []
    for name, piece in NAMES.items():
        fit = by_name.get(name)
        few = fit is None or math.isnan(fit.ratio)
        tests = "none" if fit is None else f"{fit.tests} of {counted(fit.sources, 'source')}"
        falls = "–" if fit is None else f"{fit.fell} fell, {fit.predicted:.1f} predicted"
        numbers = ("–", "–", "–", "unknown")
        if fit is not None and not few:
            ratio, spread = (fit.ratio, fit.ratio_lower, fit.ratio_upper), (fit.beta, fit.beta_lower, fit.beta_upper)
            finding = "conservative" if fit.ratio_lower > 1.0 else "no bias found"
            finding = "unconservative" if fit.ratio_upper < 1.0 else finding
            numbers = f"{Interval(*ratio):.2f}", f"{Interval(*spread):.2f}", f"{fit.beta_m:.2f}", finding
        rows.append((f"`{name}`", piece, tests, falls, *numbers))
    return markdown(("name", "class", "tests", "falls", "capacity ratio", "spread β", "β_m", "bias"), rows)


def scenes(validation: Validation) -> Iterator[tuple[object, ...]]:
    """Yield changes of poles and of medians, one at a time: shares that fall, or median PGA."""
    for scene in explanations.scenes(test.row for test in validation.rows):
        row = next(test for test in validation.rows if test.row.test.id == scene.id)
        factor, unit, digits = (100.0, "%", ".0f") if row.counted else (1.0, "m/s²", ".3g")
        numbers = (f"{factor * value:{digits}}" for value in (scene.before, scene.predicted, row.observed))
        yield scene.id, scene.change, unit, *numbers
