"""What a form of fragility curve is: the interface behind the names that `fit_fragility` takes."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .bootstrap import percentile_interval
from .estimation import INTERVALS, Options, Resampled
from .trials import FELL, OVERTURNED, STATES, STOOD, SURVIVED, Sample

Array = NDArray[np.float64]
Columns = dict[str, Any]
"""What is found of one curve, by name of variable: numbers, words, or arrays on fraction, level or replicate."""

OVERTURNING = (SURVIVED, SURVIVED, FELL)
"""What the states of a run are to a fit of all runs."""


class Form(ABC):
    """A form of curve: what it fits to a sample, and what it says of it."""

    name: str
    """Its name in the attribute ``form``."""
    text: str
    """What it fits, for the attribute ``method``."""
    intervals: tuple[str, ...] = INTERVALS
    """The kinds of interval that it has."""
    methods: tuple[str, ...] = ("binomial",)
    """What it can be fitted to: counts at the levels, or first overturnings."""

    @abstractmethod
    def fit(self, sample: Sample, options: Options, drawn: Resampled | None) -> Columns:
        """Everything of one curve; `drawn` its resampled data where replicates are needed."""

    @abstractmethod
    def probabilities(self, sample: Sample, cells: Array, penalty: str) -> Array:
        """The curves at the sample's levels fitted to other counts, cells (replicate, cell): (replicate, level)."""

    def chances(self, sample: Sample, penalty: str) -> Array:
        """The probability of each state at each level, (level, STATES), under the curve fitted to the sample."""
        found = np.zeros((sample.levels.size, STATES))
        found[:, OVERTURNED] = self.probabilities(sample, sample.cells[None], penalty)[0]
        found[:, STOOD] = 1.0 - found[:, OVERTURNED]
        return found


def log_likelihood_of(probability: Array, overturnings: NDArray[np.int64], runs: NDArray[np.int64]) -> float:
    """Binomial log-likelihood of a curve at the levels, without its constant."""
    stood = runs - overturnings
    with np.errstate(divide="ignore", invalid="ignore"):
        fallen = np.where(overturnings > 0, overturnings * np.log(probability), 0.0)
        return float((fallen + np.where(stood > 0, stood * np.log1p(-probability), 0.0)).sum())


def percentile_columns(values: Array, samples: Array, options: Options) -> Columns:
    """The median and the fractiles: values (1 + fraction,) with percentile intervals of samples (1 + fraction, …)."""
    ends = percentile_interval(samples, options.confidence, against=True)
    medians = samples[0][np.isfinite(samples[0])]
    columns: Columns = {
        "median": values[0],
        "median_se": float(medians.std(ddof=1)) if medians.size > 1 else np.nan,
        "median_lower": ends.lower[0],
        "median_upper": ends.upper[0],
        "fractile": values[1:],
        "fractile_lower": ends.lower[1:],
        "fractile_upper": ends.upper[1:],
    }
    return columns | ({"median_sample": samples[0]} if options.keep else {})
