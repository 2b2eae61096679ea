"""Predictions beside outcomes: what agrees, scores by class of pieces, and the granite rocks run by run."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ...core.aliases import Array
from ...models import HousnerImpact
from .classes import FACTORS, LEAST_CLUSTERS, ClassFit, Evidence, class_fit, too_few
from .ensembles import kinds_of, scaled_to_class
from .halves import HalfFits, fit_halves
from .predictions import Prediction, capacities
from .replays import CANDIDATES, HALF_WIDTHS, GraniteOutcomes, Replays, fallen, rock, table_motions
from .scores import Brier, best_threshold, brier, clustered_interval
from .specimens import blocks_of, law_of, not_sliding
from .table import OVERTURNED, REPLAY, Row

COUNTS = (OVERTURNED, REPLAY)
"""Predictions that are probabilities, to be held against counts."""


class Units(NamedTuple):
    """The trials of a row by record: counts, and the records; of one unit, the row's source, where they are unknown."""

    trials: Array
    overturned: Array
    clusters: tuple[str, ...]


class Compared(NamedTuple):
    """A row with what was predicted and what was measured, each with its 95 % interval (NaN: none).

    measured: the prediction with measured or fitted inputs, None where there are none.  units: of counts only.
    """

    row: Row
    prediction: Prediction
    observed: float
    lower: float
    upper: float
    measured: Prediction | None = None
    units: Units | None = None

    @property
    def counted(self) -> bool:
        """Whether a probability stands beside a count."""
        return self.prediction.made and self.row.test.predict in COUNTS and self.row.outcome.overturned is not None

    @property
    def judged(self) -> bool:
        """Whether there is a prediction and an outcome, and an interval of at least one of them."""
        ends = self.prediction.lower, self.lower
        return self.prediction.made and not math.isnan(self.observed) and not all(map(math.isnan, ends))

    @property
    def overlap(self) -> bool:
        """Whether the two intervals of a row that is judged overlap; a value without an interval is a point."""
        made, seen = self.prediction, (self.lower, self.upper)
        predicted = (made.value, made.value) if math.isnan(made.lower) else (made.lower, made.upper)
        low, high = (self.observed, self.observed) if math.isnan(seen[0]) else seen
        return predicted[0] <= high and low <= predicted[1]


def compared(
    row: Row, prediction: Prediction, measured: Prediction | None = None, runs: Units | None = None
) -> Compared:
    """Return a row beside its predictions: a count as a share with an interval over records, where `runs` has them.

    Otherwise the trials of a row count as independent in its interval, and as one cluster, its source, in scores.
    """
    outcome, trials = row.outcome, row.test.trials
    if outcome.overturned is not None and trials:
        n, k = np.array([float(trials)]), np.array([float(outcome.overturned)])
        units = Units(n, k, (row.source.source,)) if runs is None else runs
        clusters = None if runs is None else np.array(units.clusters)
        lower, upper = clustered_interval(units.trials, units.overturned, clusters)
        return Compared(row, prediction, outcome.overturned / trials, lower, upper, measured, units)
    value = math.nan if outcome.value is None else outcome.value
    return Compared(row, prediction, value, math.nan, math.nan, measured)


def rock_of(row: Row) -> int | None:
    """Return which of the granite rocks, 1 or 2, a band of runs is of; None where it does not say."""
    match = re.search(r"granite rock ([12])\b", row.test.specimen)
    return int(match[1]) if match and row.test.predict == REPLAY else None


def units_of(row: Row, replays: Replays, outcomes: GraniteOutcomes) -> Units | None:
    """Return the runs of a band by record; None where the row is no band of a rock, or lacks some of its runs."""
    which = rock_of(row)
    if which is None or row.outcome.overturned is None:
        return None
    inside = replays.inside(*row.test.levels)
    records, place = np.unique([run.record for run in replays.runs], return_inverse=True)
    trials = np.bincount(place[inside], np.ones(inside.sum()), minlength=records.size)
    fell = np.bincount(place[inside], outcomes.overturned[which - 1][inside].astype(float), minlength=records.size)
    if (trials.sum(), fell.sum()) != (row.test.trials, row.outcome.overturned):
        return None
    counted = trials > 0
    return Units(np.asarray(trials[counted], float), np.asarray(fell[counted], float), tuple(records[counted].tolist()))


def score(rows: list[Compared]) -> Brier | None:
    """Return Brier's score of the rows with a count; None without any."""
    counts = [(row, row.units) for row in rows if row.counted and row.units is not None]
    if not counts:
        return None
    made = np.array([row.prediction.value for row, units in counts for _ in units.clusters])
    trials, fell = (np.concatenate([getattr(units, of) for _, units in counts]) for of in ("trials", "overturned"))
    clusters = np.array([name for _, units in counts for name in units.clusters])
    which = np.repeat(np.arange(len(counts)), [len(units.clusters) for _, units in counts])
    return brier(made, trials, fell, clusters=clusters, rows=which)


def scores_of(rows: list[Compared]) -> dict[str, Brier]:
    """Return the scores of every class of pieces with a count, of all, and of predictions with measured inputs."""
    predicted = [row for row in rows if row.prediction.made]
    pieces = dict.fromkeys(row.row.test.piece for row in predicted)
    groups = {piece: [row for row in predicted if row.row.test.piece == piece] for piece in pieces}
    groups["all"] = predicted
    groups["with measured inputs"] = [row._replace(prediction=row.measured) for row in rows if row.measured]
    scored = {name: score(members) for name, members in groups.items()}
    return {name: group_score for name, group_score in scored.items() if group_score is not None}


class Granite(NamedTuple):
    """A rock beside its replays: falls; by half-width those predicted and share of runs that are right; a threshold's.

    fits: each half of the records predicted with the half-width that fits the other half; twins: share of the runs of
    each half in which both rocks had the same outcome.
    """

    rock: int
    runs: int
    overturned: int
    predicted: tuple[int, ...]
    right: tuple[float, ...]
    pgv: float
    twin: float
    fits: HalfFits


def granite(replays: Replays, outcomes: GraniteOutcomes) -> list[Granite]:
    """Score both rocks run by run: blind half-widths, half-widths fitted on the other half of the records, thresholds.

    The plain threshold is fitted to the runs that score it; thresholds of halves are not.
    """
    twin = float((outcomes.overturned[0] == outcomes.overturned[1]).mean())
    records = [run.record for run in replays.runs]
    candidates = fallen([rock(half_width) for half_width in CANDIDATES], table_motions(replays.runs))
    return [
        Granite(
            i,
            flags.size,
            int(flags.sum()),
            tuple(int(overturned.sum()) for overturned in replays.overturned),
            tuple(float((overturned == flags).mean()) for overturned in replays.overturned),
            best_threshold(outcomes.pgv, flags)[1],
            twin,
            fit_halves(candidates, flags, records, outcomes.pgv),
        )
        for i, flags in enumerate(outcomes.overturned, 1)
    ]


def fitted_band(row: Row, replays: Replays, rocks: Sequence[Granite]) -> Prediction | None:
    """Predict a band of runs with half-widths of which each was fitted on the records of the other half.

    The interval is the range of 95 % of what fits resamples of the other half.
    """
    which = rock_of(row)
    if which is None:
        return None
    inside = replays.inside(*row.test.levels)
    fits = rocks[which - 1].fits
    low, high = np.quantile(fits.resampled[:, inside].mean(-1), [0.025, 0.975])
    value = float(fits.predicted[inside].mean())
    widths = " and ".join(f"{1000.0 * CANDIDATES[half.fitted]:g} mm" for half in fits.halves)
    how = f"half-widths of {widths}, each fitted on the other half of the motions"
    return Prediction(row.test.id, value, min(value, float(low)), max(value, float(high)), math.nan, how)


def class_fits(rows: list[Compared], replays: Replays | None, outcomes: GraniteOutcomes | None) -> dict[str, ClassFit]:
    """Return for every class of pieces with a predicted count how far its capacities are from those predicted.

    Capacities are looked for only where a class has enough records or sources.
    """
    fits = {}
    counts = [(row, row.units) for row in rows if row.counted and row.units is not None]
    for piece in dict.fromkeys(row.row.test.piece for row, _ in counts):
        of_piece = [(row.row, units) for row, units in counts if row.row.test.piece == piece]
        clusters = len({name for _, units in of_piece for name in units.clusters})
        sources = len({row.source.source for row, _ in of_piece})
        if clusters < LEAST_CLUSTERS:
            trials = sum(int(units.trials.sum()) for _, units in of_piece)
            fits[piece] = too_few(trials, clusters, sources)
            continue
        logs = None if replays is None else _log_capacities(replays)
        evidence = [test for row, units in of_piece for test in _evidence(row, units, replays, outcomes, logs)]
        fits[piece] = class_fit(evidence, sources)
    return fits


def _evidence(
    row: Row, units: Units, replays: Replays | None, outcomes: GraniteOutcomes | None, logs: Array | None
) -> list[Evidence]:
    """Return the tests of a row: the runs of a band of a rock, one by one, or its count."""
    which, counted = rock_of(row), int(units.overturned.sum())
    if which is None:
        trials = int(units.trials.sum())
        blocks = blocks_of(row.test)
        low, high = (float(level) for level in row.test.levels if level is not None)
        every = [
            factors
            for kind in kinds_of(row.test)
            for factors in capacities(blocks, law_of(row.test), scaled_to_class(kind, low, high), FACTORS, "scale")
        ]
        slides = 1.0 - float(np.mean([not_sliding(row.test, block) for block in blocks]))
        return [Evidence(row.source.source, trials, counted, np.log(np.concatenate(every)), slides)]
    if replays is None or outcomes is None or logs is None:
        return []
    flags = outcomes.overturned[which - 1]
    return [
        Evidence(replays.runs[i].record, 1, int(flags[i]), logs[:, i])
        for i in np.flatnonzero(replays.inside(*row.test.levels))
    ]


def _log_capacities(replays: Replays) -> Array:
    """Return ln of the factor of each run's motion that overturns each half-width of the scan (half-width, run)."""
    blocks = [rock(half_width) for half_width in HALF_WIDTHS]
    return np.log(np.array(capacities(blocks, HousnerImpact(), table_motions(replays.runs), FACTORS, "scale")))
