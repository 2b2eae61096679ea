"""Intervals from samples: quantiles with or without weights, where some samples have no value or an infinite one."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def interval(samples: Array, weights: Array | None, confidence: float) -> tuple[Array, Array, NDArray[np.int64]]:
    """Both quantiles over the last axis (…, sample), and of how many samples: those that are no NaN.

    Between samples the quantile is interpolated; not so where they have `weights` (sample,), or where some are
    infinite: between a number and infinity there is nothing.
    """
    shape = samples.shape[:-1]
    rows = samples.reshape(math.prod(shape), -1)
    found = np.full((rows.shape[0], 2), np.nan)
    ends = [0.5 - 0.5 * confidence, 0.5 + 0.5 * confidence]
    for at, row in enumerate(rows):
        there = ~np.isnan(row)
        if not there.any():
            continue
        plain = weights is None and bool(np.isfinite(row[there]).all())
        options: dict[str, Any] = {} if plain else {"method": "inverted_cdf"}
        if weights is not None:
            options["weights"] = weights[there]
        found[at] = np.quantile(row[there], ends, **options)
    return found[:, 0].reshape(shape), found[:, 1].reshape(shape), np.sum(~np.isnan(samples), axis=-1)
