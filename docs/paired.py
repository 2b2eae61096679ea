"""Paired comparisons over motions: medians of flags, bootstrap intervals of their ratios, and exact sign tests.

Two set-ups are run under the same motions, so that a motion, with everything that it does to both, is one draw.
"""

from __future__ import annotations

import numpy as np
from polarity import weights
from scipy.stats import binomtest


def medians(shares: np.ndarray, levels: np.ndarray) -> np.ndarray:
    """The level at which half of the runs fall, from shares (..., level); NaN where no level has so many.

    Shares are made to rise by their running maximum, and taken as linear in the logarithm of the level.
    """
    rising = np.maximum.accumulate(shares, axis=-1)
    reached = rising >= 0.5
    at = np.maximum(1, np.argmax(reached, axis=-1))[..., None]
    low, high = (np.take_along_axis(rising, k, axis=-1)[..., 0] for k in (at - 1, at))
    logs = np.log(levels)
    first, last = logs[at[..., 0] - 1], logs[at[..., 0]]
    part = (0.5 - low) / np.where(high > low, high - low, 1.0)
    return np.where(reached.any(-1) & (low < 0.5), np.exp(first + part * (last - first)), np.nan)


def draws(flags: np.ndarray) -> np.ndarray:
    """Means over motions (replicate, ...) of values (..., motion): of all motions first, then of bootstrap draws.

    Values of equally many motions are drawn alike: ratios and differences of two such arrays are paired.
    """
    values = np.asarray(flags, dtype=float)
    drawn = np.moveaxis(values @ weights(values.shape[-1]).T, -1, 0)
    return np.concatenate([values.mean(-1)[None], drawn])


def interval(replicates: np.ndarray, confidence: float = 0.95) -> tuple[float, float, float]:
    """The value and the percentile interval of replicates (replicate,), the value first; NaN if one has none."""
    tail = 0.5 * (1.0 - confidence)
    low, high = np.quantile(replicates[1:], [tail, 1.0 - tail])
    return float(replicates[0]), float(low), float(high)


def flips(before: np.ndarray, after: np.ndarray) -> tuple[int, int]:
    """Motions whose outcome (motion,) changes: those that fall only after, and those that fall only before."""
    return int((after & ~before).sum()), int((before & ~after).sum())


def sign_test(before: np.ndarray, after: np.ndarray) -> float:
    """Two-sided p-value of McNemar's exact test: were both alike, a changed outcome would go either way as often."""
    gained, lost = flips(before, after)
    return 1.0 if gained + lost == 0 else float(binomtest(gained, gained + lost).pvalue)


def holm(values: list[float], level: float = 0.05) -> list[bool]:
    """Which of some p-values are decided if the chance of one wrong decision among all is at most `level`.

    Holm, S. (1979). A simple sequentially rejective multiple test procedure. Scandinavian Journal of Statistics 6(2).
    """
    order = np.argsort(values)
    found = [False] * len(values)
    for rank, place in enumerate(order):
        if values[place] > level / (len(values) - rank):
            break
        found[place] = True
    return found
