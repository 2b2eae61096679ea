"""Inputs that no source gives, fitted on half of the motions of a set and scored on the other half.

The halves are of records, not of runs: a record whose outcomes are scored was never seen by the fit.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ...core.aliases import Array, Flags, Index
from ...core.streams import stream
from .scores import SURE, best_threshold

RESAMPLES, SEED = 400, 1
"""Resamples of the records of a half for the interval of what is fitted on it, and their seed."""


def halves_of(names: Sequence[str]) -> Index:
    """Return the half, 0 or 1, of every run: every other one of the sorted names of its record."""
    order = {name: i % 2 for i, name in enumerate(sorted(set(names)))}
    return np.array([order[name] for name in names])


class HalfFit(NamedTuple):
    """A half of the runs that is predicted with what fits the other half.

    half: the half that is scored, runs of it, those that overturned, and those predicted.  fitted: which candidate
    fits the other half best.  right: share of the runs whose outcome is predicted; of a threshold of PGV fitted on the
    other half, too.  predicted_lower, predicted_upper: 95 % of the counts predicted with what fits resamples of the
    records of the other half.
    """

    half: int
    runs: int
    overturned: int
    fitted: int
    predicted: int
    predicted_lower: int
    predicted_upper: int
    right: float
    pgv: float


class HalfFits(NamedTuple):
    """Both halves, the outcome predicted of every run by what fits the other half, and that of the resamples."""

    halves: list[HalfFit]
    predicted: Flags  # run
    resampled: Flags  # resample, run


def best_candidate(right: Array) -> Index:
    """Return the candidate (…,) with the most runs right (…, candidate): the middle one of those that are equal."""
    best = right == right.max(-1, keepdims=True)
    rank = np.cumsum(best, axis=-1)
    middle = (best.sum(-1, keepdims=True) + 1) // 2
    return np.asarray(np.argmax(rank >= middle, axis=-1))


def fit_halves(flags: Flags, overturned: Flags, records: Sequence[str], pgv: Array) -> HalfFits:
    """Predict each half of the runs with the candidate whose flags (candidate, run) get most of the other half right.

    The names of the records split the runs.  A threshold of PGV is fitted and scored in the same way.  Intervals are
    of the fit: the records of the half that is fitted are drawn again, with all of their runs.
    """
    right = (flags == overturned).astype(float)
    which, names = halves_of(records), np.array(records)
    predicted = np.zeros(overturned.size, dtype=bool)
    resampled = np.zeros((RESAMPLES, overturned.size), dtype=bool)
    fits = []
    for half in (0, 1):
        judged, fitted = which == half, which != half
        candidate = int(best_candidate(right[:, fitted].sum(-1)))
        predicted[judged] = flags[candidate, judged]
        drawn = _resampled(right[:, fitted], names[fitted], half)
        resampled[:, judged] = flags[drawn][:, judged]
        low, high = np.quantile(resampled[:, judged].sum(-1), [0.5 - SURE / 2, 0.5 + SURE / 2])
        fits.append(
            HalfFit(
                half, int(judged.sum()), int(overturned[judged].sum()), candidate, int(predicted[judged].sum()),
                round(float(low)), round(float(high)), _share((predicted == overturned)[judged]),
                _on_other(pgv, overturned, judged, fitted),
            )
        )  # fmt: skip
    return HalfFits(fits, predicted, resampled)


def _resampled(right: Array, names: Array, half: int) -> Index:
    """Return the best candidate of every resample of records, each with all of its runs."""
    unique, record = np.unique(names, return_inverse=True)
    if not unique.size:
        return np.zeros(RESAMPLES, dtype=int)
    of_record = np.stack([right[:, record == i].sum(-1) for i in range(unique.size)])  # record, candidate
    weights = stream(SEED, half).multinomial(unique.size, np.full(unique.size, 1.0 / unique.size), RESAMPLES)
    return best_candidate(weights @ of_record)


def _on_other(measure: Array, overturned: Flags, judged: Flags, fitted: Flags) -> float:
    """Return the share of a half that the best threshold of the other half gets right."""
    if not fitted.any() or not np.isfinite(measure[fitted]).any():
        return float("nan")
    threshold, _ = best_threshold(measure[fitted], overturned[fitted])
    known = judged & np.isfinite(measure)
    return _share(((measure >= threshold) == overturned)[known])


def _share(flags: Flags) -> float:
    """Return the share of flags that are set, NaN of none."""
    return float(flags.mean()) if flags.size else float("nan")
