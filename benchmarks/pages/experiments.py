"""The page docs/experiments.md, its figures and the table of classes: published tests beside predictions.

TOPPLING_GRANITE names the folder of the granite rocks' table motions, which are not part of the project.  Without them
the page says that these rows are not predicted.  Blind predictions that were committed before are taken from
docs/experiments/predictions.csv as they are.
"""

from __future__ import annotations

import csv
import io
import math
import os
import shutil
import sys
import tempfile
from pathlib import Path

from ...core.wording import counted, whole_percent
from ...models.friction import CONTACTS
from ...studies.plan.piece_classes import COLUMNS, NAMES, TABLE as CLASS_TABLE, PieceClass
from ..experiments import classes, ensembles, explanations, replays, specimens, table
from ..experiments.ensembles import CLASSES
from ..experiments.results import Compared
from ..experiments.scores import Brier
from ..experiments.validate import MEASURED, OUTCOMES, PREDICTIONS, Validation, validate
from .page import ROOT, folder, template, write
from .tables import span, table as markdown

GRANITE = "TOPPLING_GRANITE"


def main() -> None:
    """Write the page, its figure and the predictions."""
    granite = Path(os.environ[GRANITE]) if os.environ.get(GRANITE) else None
    if granite is None:
        print(f"{GRANITE} is not set: the page is made without these data", file=sys.stderr)
    out, docs = folder("experiments"), ROOT / "docs"
    with tempfile.TemporaryDirectory() as made:
        found = validate(docs / "experiments.csv", Path(made), granite, docs / "experiments" / PREDICTIONS)
        for name in (PREDICTIONS, MEASURED, OUTCOMES, "calibration.png"):
            shutil.copyfile(Path(made) / name, out / name)
    (out / CLASS_TABLE).write_text(class_rows(found), encoding="utf-8")
    write("experiments", page(found, None if granite is None else replays.replay(*replays.read_runs(granite))))


def page(found: Validation, known: replays.Replays | None) -> str:
    """The page: the text of experiments.md.in with every number from the results."""
    numbers = {
        "rows": len(found.rows),
        "sources": len({one.row.source.source for one in found.rows}),
        "predicted": sum(row.prediction.made for row in found.rows),
        "answer": answer(found),
        "rocks": rocks(found),
        "gap": f"{1000.0 * specimens.WALL_GAP:g}",
        "number": ensembles.NUMBER,
        "seed": ensembles.SEED,
        "classes": ", ".join(f"{name} is {low:g} to {high:g}" for name, (low, high) in CLASSES.items()),
        "widths": ", ".join(f"{1000.0 * one:g}" for one in replays.HALF_WIDTHS),
        "brier_table": brier_table(found),
        "granite": granite_text(found),
        "class_table": class_table(found),
        "least": classes.LEAST_CLUSTERS,
        "rock_scenes": rock_scenes(known),
        "scenes": scenes(found),
        "kinds": ", ".join(table.KINDS),
        "pieces": ", ".join(table.PIECES),
        "fixings": ", ".join(table.FIXINGS),
        "contacts": ", ".join(CONTACTS),
        "motions": ", ".join(table.MOTIONS),
        "qualities": "; ".join(f"{letter} {meaning}" for letter, meaning in table.QUALITIES.items()),
        "quantities": ", ".join(table.QUANTITIES),
    }
    return template("experiments").format(**numbers)


def answer(found: Validation) -> str:
    """Falls predicted and observed, and rows in which the intervals overlap, by class of pieces."""
    own = [one for one in found.rows if one.prediction.made and not math.isnan(one.observed)]
    rows = []
    for piece in table.PIECES:
        each = [test for test in own if test.row.test.piece == piece]
        if not each:
            continue
        trials = sum(one.row.test.trials or 0 for one in each if one.counted)
        judged = [one for one in each if one.judged]
        overlap = f"{sum(one.overlap for one in judged)} of {len(judged)}" if judged else "–"
        rows.append((piece, str(len(each)), str(trials) if trials else "–", overlap, verdict(each)))
    return markdown(("class", "rows", "trials", "intervals overlap", "blind prediction"), rows)


def rocks(found: Validation) -> str:
    """What the granite rocks show, in a sentence; nothing where they were not replayed."""
    if not found.granite:
        return ""
    middle = len(replays.HALF_WIDTHS) // 2
    fell = sum(one.overturned for one in found.granite)
    runs = sum(one.runs for one in found.granite)
    predicted = sum(one.predicted[middle] for one in found.granite)
    widest = sum(max(one.predicted) for one in found.granite)
    halves = [half for one in found.granite for half in one.fits.halves]
    right, threshold = (span([getattr(half, name) for half in halves], ".2f", " to ") for name in ("right", "pgv"))
    fitted = span([1000.0 * float(replays.CANDIDATES[half.fitted]) for half in halves], "g", " to ")
    return (
        f"- **Rocks: unconservative.** The two granite rocks fell in {fell} of {runs} runs; {predicted} falls are "
        f"predicted with the middle half-width and {widest} with the least one of the scan. They are the one class "
        "with enough trials to judge; the two rocks share one prediction and the table's motions, so that their runs "
        "are far from independent. Blindly the model is no better than one share for all trials, and a single "
        "threshold of PGV, fitted to the outcomes, does better. With one number, the half-width, fitted on half of "
        f"the records, it gets {right} of the runs of the other half right, no fewer than a threshold "
        f"of PGV fitted in the same way ({threshold}) and about as many as the other rock tells "
        f"({found.granite[0].twin:.2f}): rocking itself is predicted about as well as it can be, "
        f"and what is missed is the width of the support. Fitted, it is {fitted} mm.\n"
    )


MOST_OF_ONE = 10
"""Trials of a class below which no direction is told."""


def verdict(rows: list[Compared]) -> str:
    """The direction of a class in words: counts by the falls predicted of all trials, values by their mean ratio."""
    counts = [row for row in rows if row.counted]
    if counts:
        trials = sum(one.row.test.trials or 0 for one in counts)
        fallen = sum(one.row.outcome.overturned or 0 for one in counts)
        predicted = sum((one.row.test.trials or 0) * one.prediction.value for one in counts)
        told = f"{fallen} of {trials} fell, {predicted:.1f} predicted"
        return told if trials >= MOST_OF_ONE else f"{told}: few trials"
    ratios = [one.prediction.value / one.observed for one in rows if one.observed > 0.0]
    mean = math.exp(sum(map(math.log, ratios)) / len(ratios))
    return f"predicted over measured {mean:.2f}"


def brier_table(found: Validation) -> str:
    """Brier's scores of every class of pieces, and of all."""
    rows = [
        (name, score.rows, score.trials, f"{score.score:.3f}", f"{score.reference:.3f}",
         f"{score.right_low:.3f} to {score.right_high:.3f}", skill(score))
        for name, score in found.scores.items()
    ]  # fmt: skip
    head = ("class", "rows", "trials", "Brier's score", "of one share for all", "if right", "skill (interval)")
    return markdown(head, rows)


def skill(score: Brier) -> str:
    """1 - score/reference with its interval over records or sources; '' where there is none."""
    if math.isnan(score.skill) or math.isnan(score.skill_lower):
        return ""
    return f"{score.skill:.2f} ({score.skill_lower:.2f} to {score.skill_upper:.2f})"


def granite_text(found: Validation) -> str:
    """What is known of the rocks run by run, blind and with half-widths fitted on half of the records."""
    if not found.granite:
        return "Their table motions were not at hand when this page was made."
    widths = [f"{1000.0 * one:g} mm" for one in replays.HALF_WIDTHS]
    rows = [
        (
            f"rock {one.rock}", f"{one.overturned} of {one.runs}", " / ".join(map(str, one.predicted)),
            " / ".join(f"{share:.2f}" for share in one.right), f"{one.pgv:.2f}", f"{one.twin:.2f}",
        )
        for one in found.granite
    ]  # fmt: skip
    head = ("", "overturned", "predicted", "share right", "best PGV threshold", "other rock")
    text = (
        f"Predicted counts and shares of runs with the right outcome for half-widths of {' / '.join(widths)}, blind. "
        "The threshold is fitted to the runs on which it is scored; *other rock* is the share of runs in which "
        "both rocks had the same outcome, a rough limit of what any model of one of them can reach."
    )
    halves = [
        (
            f"rock {one.rock}, half {half.half + 1}", f"{half.overturned} of {half.runs}",
            f"{1000.0 * replays.CANDIDATES[half.fitted]:g} mm",
            f"{half.predicted} ({half.predicted_lower}–{half.predicted_upper})", f"{half.right:.2f}",
            f"{half.pgv:.2f}",
        )
        for one in found.granite
        for half in one.fits.halves
    ]  # fmt: skip
    head_2 = ("scored on", "overturned", "fitted on the other half", "predicted", "share right", "PGV threshold")
    text_2 = (
        "The same with one fitted number: the half-width, from 28 to 70 mm, that gets most runs right of one half of "
        "the records (every other one by name), scored on the other half, whose records it never saw. A threshold is "
        "fitted and scored in the same way. Intervals of predicted counts are of fits to resamples of the records."
    )
    fitted = markdown(head_2, halves)
    return f"{text}\n\n{markdown(head, rows)}\n\n{text_2}\n\n{fitted}"


def classes_of(found: Validation) -> list[PieceClass]:
    """What the tests say of each class that has any, for study files."""
    rows = []
    for name, piece in NAMES.items():
        fit = found.classes.get(piece)
        scored = found.scores.get(piece)
        if fit is None or scored is None:
            continue
        own = [one for one in found.rows if one.counted and one.row.test.piece == piece]
        fell = sum(one.row.outcome.overturned or 0 for one in own)
        predicted = sum((one.row.test.trials or 0) * one.prediction.value for one in own)
        numbers = (round(one, 3) for one in (*fit[3:], scored.score, scored.reference))
        rows.append(PieceClass(name, fit.tests, fell, round(predicted, 1), fit.clusters, fit.sources, *numbers))
    return rows


def class_rows(found: Validation) -> str:
    """The table of classes that study files offer (studies/plan/piece_classes.csv)."""
    stream = io.StringIO()
    lines = csv.writer(stream, lineterminator="\n")
    lines.writerow(COLUMNS)
    for one in classes_of(found):
        lines.writerow(["" if isinstance(value, float) and math.isnan(value) else value for value in one])
    return stream.getvalue()


def class_table(found: Validation) -> str:
    """Bias and spread by class, as the page shows them: every class of study files, with a test or without."""
    own = {one.name: one for one in classes_of(found)}
    rows = []
    for name, piece in NAMES.items():
        one = own.get(name)
        if one is None:
            rows.append((f"`{name}`", piece, "none", "–", "–", "–", "–", "nobody knows: no test of this class"))
            continue
        few = math.isnan(one.ratio)
        rows.append(
            (
                f"`{name}`", piece, f"{one.tests} of {counted(one.sources, 'source')}",
                f"{one.fell} fell, {one.predicted:.1f} predicted",
                "–" if few else f"{one.ratio:.2f} ({one.ratio_lower:.2f}–{one.ratio_upper:.2f})",
                "–" if few else f"{one.beta:.2f} ({one.beta_lower:.2f}–{one.beta_upper:.2f})",
                "–" if few else f"{one.beta_m:.2f}",
                "nobody knows: too few tests" if few else "unconservative" if one.ratio_upper < 1.0 else
                "conservative" if one.ratio_lower > 1.0 else "no bias found",
            )
        )  # fmt: skip
    head = ("name", "class", "tests", "falls", "true over predicted capacity", "spread", "default β_m", "verdict")
    return markdown(head, rows)


def rock_scenes(known: replays.Replays | None) -> str:
    """Changes of the rocks, one at a time."""
    if known is None:
        return "The rocks' table motions were not at hand when this page was made."
    heads = ("change", "falls predicted in 321 runs", "of 39 of long period")
    return markdown(heads, explanations.rock_scenes(known))


def scenes(found: Validation) -> str:
    """Changes of poles and of medians, one at a time."""
    rows = []
    for one in explanations.scenes(each.row for each in found.rows):
        row = next(each for each in found.rows if each.row.test.id == one.id)
        values = (one.before, one.predicted, row.observed)
        told = [whole_percent(value) if row.counted else f"{value:.3g} m/s²" for value in values]
        rows.append((one.id, one.change, *told))
    return markdown(("row", "change", "predicted before", "with the change", "observed"), rows)
