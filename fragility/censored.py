"""Lognormal laws and trends of capacities known to lie in intervals: many at once, by the compiled fits."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from . import _censored as engine
from .statuses import ALL, DECREASING, FAILED, NONE, OK, SEPARATED
from .threads import shared, thread_count

Values = NDArray[np.float64]
Ends = tuple[Values, Values]
"""Lower and upper ends of ln capacity, (…, motion); infinite where only the other is known."""

STATUS = (OK, NONE, ALL, SEPARATED, DECREASING, FAILED)
"""What a fit says of itself, in the order of its numbers (`_censored`)."""
RESAMPLE_TOLERANCE = 0.03
"""Of a bootstrap fit before its last step, in standard errors: their scatter is of order 1."""


class Fits(NamedTuple):
    """Dispersions (…, measure, sample) and the status of the first sample; NaN where there is none."""

    dispersion: Values
    status: NDArray[np.int8]


def fit_dispersions(ends: Sequence[Ends], weights: Values) -> Fits:
    """Standard deviation of ln capacity in each measure, under weights (sample, motion): the first all 1.

    Rows are shared between threads; each has its result from itself alone.
    """
    shape = (*ends[0][0].shape[:-1], len(ends))
    lower, upper = (np.stack(one, axis=-2).reshape(-1, weights.shape[1]) for one in zip(*ends, strict=True))
    sizes = (lower.shape[0], weights.shape[0])
    location, dispersion, status = np.empty(sizes), np.empty(sizes), np.empty(sizes, np.int8)
    workers = min(thread_count(), sizes[0])
    bounds = np.linspace(0, sizes[0], workers + 1).astype(int).tolist()

    def part(ends: tuple[int, int]) -> None:
        own = slice(*ends)
        results = location[own], dispersion[own], status[own]
        engine.fit_rows(lower[own], upper[own], weights, RESAMPLE_TOLERANCE, *results)

    list(shared(part, list(pairwise(bounds))))
    return Fits(dispersion.reshape(*shape, -1), status[:, 0].copy().reshape(shape))


def fit_trend(ends: Ends, covariate: Values) -> tuple[Values, Values]:
    """Slope of ln capacity on a covariate (motion,) and its standard error, (…); NaN where there is none."""
    shape = ends[0].shape[:-1]
    lower, upper = (np.ascontiguousarray(end.reshape(-1, covariate.size)) for end in ends)
    found = np.empty(lower.shape[0]), np.empty(lower.shape[0]), np.empty(lower.shape[0], np.int8)
    engine.fit_trends(lower, upper, covariate, *found)
    return found[0].reshape(shape), found[1].reshape(shape)
