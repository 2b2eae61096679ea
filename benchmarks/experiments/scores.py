"""Scores of predictions beside outcomes: calibration, Brier's score, bias of medians and ratio of dispersions.

They take numbers only, so that their own correctness can be checked by simulation.  Trials of one record, or of one
source, depend on each other: intervals count such clusters.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t as student

from ...core.aliases import Array, Flags
from ...core.streams import stream
from ...fragility import binomial_interval

Labels = NDArray[Any]
"""Names of rows, records or sources, or their numbers."""
SURE = 0.95
DRAWS = 4_000
"""Tables drawn for the interval of Brier's score."""
EDGES = (0.0, 0.05, 0.25, 0.5, 0.75, 0.95, 1.0)
"""Ends of the classes of predicted probabilities of a calibration table; the upper end belongs to the last one only."""


class CalibrationClass(NamedTuple):
    """A class of predicted probabilities: its ends, rows and trials, and the mean probability beside the share."""

    low: float
    high: float
    rows: int
    trials: int
    predicted: float
    overturned: int
    observed: float
    lower: float
    upper: float


class Brier(NamedTuple):
    """Brier's score of trials, and what a model would get for which these probabilities are right.

    reference: the score of one probability for all trials, their share (climatology).  skill: 1 - score/reference.
    right_low, right_high: 95 % of the scores of tables drawn from the predicted probabilities, trial by trial.
    skill_lower, skill_upper: 95 % of the skill over resamples of clusters, NaN with fewer than two of them.
    """

    rows: int
    trials: int
    score: float
    reference: float
    skill: float
    right_low: float
    right_high: float
    clusters: int
    skill_lower: float
    skill_upper: float


class Ratio(NamedTuple):
    """The geometric mean of predicted over measured values of a number of rows, with its 95 % interval over sources."""

    number: int
    sources: int
    mean: float
    lower: float
    upper: float


def clustered_interval(trials: Array, overturned: Array, clusters: Labels | None = None) -> tuple[float, float]:
    """Return the 95 % interval of a share of counts (unit,) whose trials depend on each other within clusters.

    Wilson's interval with an effective number of trials: that of independent trials whose share has the variance
    which the share has over clusters (ratio estimator), at most the number of trials; the number of clusters where all
    trials have the same outcome.  (Rao and Scott 1992, Biometrics 48(2), 577-585, recalled.)
    """
    n, k = float(trials.sum()), float(overturned.sum())
    share, effective = k / n, n
    if clusters is not None:
        _, which = np.unique(clusters, return_inverse=True)
        number = int(which.max()) + 1
        residuals = np.bincount(which, overturned - share * trials)
        if 0.0 < share < 1.0 and number > 1:
            variance = number / (number - 1) * float((residuals**2).sum()) / n**2
            effective = min(n, share * (1.0 - share) / variance) if variance > 0.0 else n
        else:
            effective = min(n, float(number))
    lower, upper = (float(one) for one in binomial_interval(share * effective, effective, SURE))
    return lower, upper


def calibration(
    probabilities: Array,
    trials: Array,
    overturned: Array,
    clusters: Labels | None = None,
    rows: Labels | None = None,
) -> list[CalibrationClass]:
    """Return the classes of predicted probabilities (unit,) that hold a row, with means weighted by trials.

    The interval of a share is that of `clustered_interval`.  rows: the row of each unit (every unit is one).
    """
    found = []
    which = np.clip(np.searchsorted(EDGES, probabilities, side="right") - 1, 0, len(EDGES) - 2)
    named: Labels = np.arange(trials.size) if rows is None else rows
    for i in np.unique(which):
        own = which == i
        n, k = int(trials[own].sum()), int(overturned[own].sum())
        mean = float(np.average(probabilities[own], weights=trials[own]))
        interval = clustered_interval(trials[own], overturned[own], None if clusters is None else clusters[own])
        number = np.unique(named[own]).size
        found.append(CalibrationClass(EDGES[i], EDGES[i + 1], number, n, mean, k, k / n, *interval))
    return found


def brier(
    probabilities: Array,
    trials: Array,
    overturned: Array,
    seed: int = 1,
    clusters: Labels | None = None,
    rows: Labels | None = None,
) -> Brier:
    """Return Brier's score of rows of trials, (1/N) sum (p - x)² over the trials x = 0, 1 of all rows.

    The seed draws tables for the interval of a model that is right, and resamples of clusters.  (Brier 1950, Monthly
    Weather Review 78(1), 1-3.)
    """
    total = trials.sum()
    score = _brier(probabilities, trials, overturned)
    share = overturned.sum() / total
    reference = float(share * (1.0 - share))
    drawn = stream(seed, 0).binomial(trials.astype(int), probabilities, (DRAWS, trials.size)).astype(float)
    low, high = np.quantile(_brier(probabilities, trials, drawn), [0.5 - SURE / 2, 0.5 + SURE / 2])
    skill = 1.0 - float(score) / reference if reference > 0.0 else math.nan
    names: Labels = np.arange(trials.size) if clusters is None else clusters
    number = trials.size if rows is None else np.unique(rows).size
    return Brier(
        number, int(total), float(score), reference, skill, float(low), float(high), np.unique(names).size,
        *_skills(probabilities, trials, overturned, names, seed),
    )  # fmt: skip


def _skills(p: Array, trials: Array, overturned: Array, clusters: Labels, seed: int) -> tuple[float, float]:
    """Return the quantiles 2.5 and 97.5 % of the skill over resamples of clusters, NaN where it has none."""
    unique, which = np.unique(clusters, return_inverse=True)
    squares = overturned * (1.0 - p) ** 2 + (trials - overturned) * p**2
    totals = np.stack([np.bincount(which, one) for one in (squares, trials, overturned)])
    weights = stream(seed, 1).multinomial(unique.size, np.full(unique.size, 1.0 / unique.size), DRAWS)
    loss, n, k = totals @ weights.T
    share = k / n
    known = (share > 0.0) & (share < 1.0)
    if unique.size < 2 or not known.any():
        return math.nan, math.nan
    skills = 1.0 - (loss / n)[known] / (share * (1.0 - share))[known]
    low, high = np.quantile(skills, [0.5 - SURE / 2, 0.5 + SURE / 2])
    return float(low), float(high)


def _brier(probabilities: Array, trials: Array, overturned: Array) -> Array:
    """Return Brier's score of one table of counts (row,), or of several (table, row)."""
    squares = overturned * (1.0 - probabilities) ** 2 + (trials - overturned) * probabilities**2
    return np.asarray(squares.sum(-1) / trials.sum())


def mean_ratio(predicted: Array, measured: Array, sources: Labels | None = None) -> Ratio:
    """Return the geometric mean of predicted over measured values, medians or dispersions, with its interval.

    Values of one source depend on each other: the mean is that of the sources' means, and the interval that of
    Student's t over sources, NaN for fewer than two.  Every value is a source of its own where none are given.
    """
    logs = np.log(predicted / measured)
    _, which = np.unique(np.arange(logs.size) if sources is None else sources, return_inverse=True)
    means = np.bincount(which, logs) / np.bincount(which)
    n, mean = means.size, float(means.mean())
    half = math.nan if n < 2 else float(student.ppf(0.5 + SURE / 2, n - 1) * means.std(ddof=1) / math.sqrt(n))
    return Ratio(logs.size, n, math.exp(mean), math.exp(mean - half), math.exp(mean + half))


class Threshold(NamedTuple):
    """The threshold of a measure that tells falls from others best in the runs at hand, and the share it gets right."""

    value: float
    right: float


def best_threshold(measure: Array, overturned: Flags) -> Threshold:
    """Return the best threshold: all runs with the measure above it fall.  It is fitted to the runs it is scored on.

    Runs whose measure is not finite are left out.
    """
    known = np.isfinite(measure)
    order = np.argsort(measure[known], kind="stable")
    values, flags = measure[known][order], overturned[known][order].astype(int)
    # (below the i-th value all stand, from it on all fall)
    right = np.concatenate([[0], np.cumsum(1 - flags)]) + np.concatenate([np.cumsum(flags[::-1])[::-1], [0]])
    same = np.concatenate([[False], values[1:] == values[:-1], [False]])  # (no threshold lies between equal values)
    best = int(np.argmax(np.where(same, -1, right)))
    return Threshold(float(values[min(best, values.size - 1)]), float(right[best] / values.size))
