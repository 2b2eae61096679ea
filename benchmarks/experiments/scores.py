"""Scores of predictions beside outcomes: Brier's score, intervals of shares and the best threshold.

They take numbers only, so that their own correctness can be checked by simulation.  Trials of one record, or of one
source, depend on each other: intervals count such clusters.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...core.aliases import Array, Flags
from ...core.streams import stream
from ...fragility import binomial_interval

Labels = NDArray[Any]
"""Names of rows, records or sources, or their numbers."""
SURE = 0.95
DRAWS = 4_000
"""Tables drawn for the interval of Brier's score."""


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
    lower, upper = (float(end) for end in binomial_interval(share * effective, effective, SURE))
    return lower, upper


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
    totals = np.stack([np.bincount(which, numbers) for numbers in (squares, trials, overturned)])
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


def best_threshold(measure: Array, overturned: Flags) -> tuple[float, float]:
    """Return the best threshold, above which all runs fall, and the share that it gets right of these same runs.

    Runs whose measure is not finite are left out.
    """
    known = np.isfinite(measure)
    order = np.argsort(measure[known], kind="stable")
    values, flags = measure[known][order], overturned[known][order].astype(int)
    # (below the i-th value all stand, from it on all fall)
    right = np.concatenate([[0], np.cumsum(1 - flags)]) + np.concatenate([np.cumsum(flags[::-1])[::-1], [0]])
    same = np.concatenate([[False], values[1:] == values[:-1], [False]])  # (no threshold lies between equal values)
    best = int(np.argmax(np.where(same, -1, right)))
    return float(values[min(best, values.size - 1)]), float(right[best] / values.size)
