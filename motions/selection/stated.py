"""Conditional spectra as a hazard analysis states them: medians and scatter at given levels, and nothing between."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ...core import checks
from ...core.elementary import Array, log
from ..intensity.measure import Measure
from ..intensity.naming import written_level
from .target import FORMULAS, Conditional, Target

NEAR = 0.02
"""Relative difference up to which a level is one that is stated (levels of a logic tree are averages)."""


@dataclass(frozen=True)
class Stated:
    """Conditional medians and standard deviations at one or several levels, from a hazard analysis.

    Parameters
    ----------
    measures : sequence of Measure
        Spectral ordinates, and other measures with known correlations.
    medians, sigmas : array_like, shape (level, measure)
        At each level, given that level; SI, > 0, and of the logarithms, >= 0.
    given : Measure
        One of the measures; its medians are the levels.
    correlations
        As for `Target`, before conditioning.

    Notes
    -----
    Such files have no correlations of the conditional distribution. The correlations of the residuals at one rupture
    give it: rho'_ij = (rho_ij - rho_ik rho_jk)/[(1 - rho_ik²)(1 - rho_jk²)]^½, k the given measure. The scatter of the
    given measure itself, which is not zero in averages over logic trees, is assumed to be zero.
    """

    measures: Sequence[Measure]
    medians: Any
    sigmas: Any
    given: Measure
    correlations: Any = FORMULAS
    _unit: Target = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        medians = np.atleast_2d(checks.finite_array("medians", self.medians, ndim=(1, 2)))
        sigmas = np.atleast_2d(checks.finite_array("sigmas", self.sigmas, ndim=(1, 2)))
        if medians.shape != sigmas.shape or medians.shape[1] != len(self.measures):
            raise ValueError(
                f"medians and sigmas must have a row a level and a column a measure, got {medians.shape} and "
                f"{sigmas.shape} for {len(self.measures)} measures"
            )
        if medians.min() <= 0.0 or sigmas.min() < 0.0:
            raise ValueError("medians must be > 0 and sigmas >= 0")
        if self.given not in self.measures:
            raise ValueError(f"given must be one of the measures, got {self.given.label}")
        k = list(self.measures).index(self.given)
        order = np.argsort(medians[:, k], kind="stable")
        unit = Target(
            self.measures, np.ones(len(self.measures)), np.ones(len(self.measures)), self.correlations, self.given
        )
        for name, value in {
            "measures": tuple(self.measures),
            "medians": medians[order],
            "sigmas": sigmas[order],
            "_unit": unit,
        }.items():
            object.__setattr__(self, name, value)

    @property
    def correlation_change(self) -> float:
        """Maximum repair of the correlations."""
        return float(self._unit.correlation_change)

    @property
    def levels(self) -> Array:
        """The levels at which spectra are stated, SI, increasing."""
        return np.asarray(self.medians[:, list(self.measures).index(self.given)])

    def at(self, level: float) -> Conditional:
        """Return the distribution at a level that is stated, to 2 %, scaled to it; ValueError for another."""
        y = checks.number("level", level, above=0.0)
        levels = self.levels
        row = int(np.abs(log(levels / y)).argmin())
        if abs(levels[row] / y - 1.0) > NEAR:
            known = ", ".join(written_level(self.given, value) for value in levels.tolist())
            asked = written_level(self.given, y)
            raise ValueError(f"the target is stated at {self.given.label} = {known}, not at {asked}")
        k = list(self.measures).index(self.given)
        residual = self._unit.at(1.0).covariance
        spread = np.sqrt(np.maximum(np.diag(residual), np.finfo(float).tiny))
        rho = residual / np.outer(spread, spread)
        sigmas = self.sigmas[row].copy()
        sigmas[k] = 0.0
        mean = log(self.medians[row])
        mean[k] = math.log(y)
        return Conditional(tuple(self.measures), self.given, y, mean, rho * np.outer(sigmas, sigmas), float("nan"))
