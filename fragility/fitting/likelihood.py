"""Maximum likelihood, plain or penalised, of two-parameter curves: the face of the compiled fits.

Baker, J. W. (2015). Efficient analytical fragility function fitting using dynamic structural analysis. Earthquake
Spectra 31(1), 579-599. Albert, A. and Anderson, J. A. (1984). On the existence of maximum likelihood estimates in
logistic regression models. Biometrika 71, 1-10. Firth, D. (1993). Bias reduction of maximum likelihood estimates.
Biometrika 80, 27-38. Kosmidis, I. and Firth, D. (2021). Jeffreys-prior penalty, finiteness and shrinkage in
binomial-response generalized linear models. Biometrika 108, 71-82.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...core.elementary import Array, Flags, Index, log
from ..kernels import binomial as engine
from .links import Link
from .states import ALL, DECREASING, FAILED, FLAT, NO_RUNS, NONE, OK, ONE_LEVEL, SEPARATED
from .trials import Patterns, failures_of, gap_between

# In the order of the kernel's codes.
STATUSES = (OK, NO_RUNS, ONE_LEVEL, NONE, ALL, SEPARATED, DECREASING, FAILED)

PENALTIES = {"none": engine.NEVER, "auto": engine.WHERE_SEPARATED, "firth": engine.ALWAYS}
"""Conditions under which the likelihood is penalised, by the names that `fit_fragility` takes."""

# A median further than this (in ln x) outside the levels means that the data determine no slope.
FAR = math.log(100.0)


class FactorData(NamedTuple):
    """Data that one factor of a curve is fitted to.

    z (level,) = (ln x - centre)/width; failures (replicate, level), of first overturnings by interval
    (replicate, level + 1); runs (replicate, level).
    """

    kind: int
    x: Array
    centre: float
    width: float
    z: Array
    failures: Array
    runs: Array

    @property
    def gap(self) -> tuple[float, float] | None:
        """The ln levels between which separated data give no information (`gap_between`), of the first replicate."""
        fell = np.cumsum(self.failures[0])[:-1] if self.kind == engine.INTERVAL else self.failures[0]
        return gap_between(self.x, fell < self.runs[0], fell > 0.0)

    def arguments(self, link: Link) -> tuple[int, int, Array, Array, Array]:
        """Return the data as the kernels take them, with the code of a link."""
        return self.kind, link.code, self.z, self.failures, self.runs


def data_of(levels: Array, cells: Array, outcomes: Index | None, like: FactorData | None = None) -> FactorData:
    """Return the data in cells (replicate, cell); `outcomes` is None if cells are intervals of first overturning.

    `like`: other data of the same levels, whose scale is used.
    """
    x = log(levels)
    if outcomes is None:
        kind, failures = engine.INTERVAL, np.ascontiguousarray(cells, dtype=float)
        runs = np.repeat(cells.sum(axis=1, keepdims=True), x.size, axis=1)
    else:
        kind = engine.BINOMIAL
        failures, runs = failures_of(cells, outcomes)
    if like is not None:
        return like._replace(failures=failures, runs=runs)
    used = x[runs[0] > 0.0]
    inside = used if used.size else x
    centre, width = float(inside.mean()), max(float(np.ptp(inside)), 1e-12)
    return FactorData(kind, x, centre, width, (x - centre) / width, failures, runs)


@dataclass(frozen=True)
class FittedLines:
    """Curves F(a + b z) with z = (ln x - centre)/width, many at once: all arrays (replicate,).

    NaN if there is no fit; `status` has the kernel's codes.
    """

    link: Link
    centre: float
    width: float
    table: Array

    @property
    def a(self) -> Array:
        """Value of the line at z = 0."""
        return self.table[:, engine.A]

    @property
    def b(self) -> Array:
        """The slope in z, > 0."""
        return self.table[:, engine.B]

    @property
    def log_likelihood(self) -> Array:
        """Log-likelihood without its constant and without the penalty."""
        return self.table[:, engine.LOG_LIKELIHOOD]

    @property
    def status(self) -> Index:
        """Indices into `STATUSES`."""
        return self.table[:, engine.STATUS].astype(np.int64)

    @property
    def penalised(self) -> Flags:
        """True if the likelihood was penalised."""
        return self.table[:, engine.PENALISED] > 0.0

    def log_values(self, p: float | None) -> Array:
        """Return ln x at which the curve passes p; for None ln(dispersion), the standard deviation of ln(capacity)."""
        if p is None:
            return log(self.link.scale * self.width / self.b)
        return np.asarray(self.centre + self.width * (self.link.quantile(p) - self.a) / self.b)

    def probability(self, levels: Array) -> Array:
        """Return the curves (replicate, level) at levels (level,)."""
        z = (log(levels) - self.centre) / self.width
        return np.asarray(self.link.cumulative(self.a[:, None] + self.b[:, None] * z))

    def log_variances(self, p: float | None, covariance: Array) -> Array:
        """Return the variances of `log_values` from the covariance (replicate, 3) of (a, b)."""
        if p is None:
            return covariance[:, 2] / self.b**2
        t = (self.link.quantile(p) - self.a) / self.b
        aa, ab, bb = covariance.T
        return np.asarray((self.width / self.b) ** 2 * (aa + 2.0 * t * ab + t**2 * bb))


def fit_lines(link: Link, data: FactorData, penalty: str, start: FittedLines | None = None) -> FittedLines:
    """Fit a line to every replicate of the data; `start`: a line on the same scale from which the search begins."""
    table = np.empty((data.failures.shape[0], engine.COLUMNS))
    guess = np.empty(0)
    if start is not None and np.isfinite(start.a[0]):
        guess = np.array([start.a[0], start.b[0]])
    engine.fit_many(*data.arguments(link), PENALTIES[penalty], guess, table)
    return FittedLines(link, data.centre, data.width, table)


def covariance_of(
    lines: FittedLines,
    data: FactorData,
    outcomes: Index | None = None,
    patterns: Patterns | None = None,
    weights: Array | None = None,
) -> Array:
    """Return the covariance (aa, ab, bb) of each fit's (a, b), (replicate, 3).

    It is computed from the observed information or, with `weights` (replicate, pattern), by the sandwich estimate. The
    latter sums scores over all runs of a motion and is valid for any dependence between them.
    """
    covariance = np.empty((lines.a.size, 3))
    none = np.empty(0, dtype=np.int64)
    if patterns is None or weights is None:
        patterns, weights = Patterns(none, none, none, none), np.empty((lines.a.size, 0))
    given = (lines.table, weights, *patterns[1:], none if outcomes is None else outcomes)
    engine.covariances(*data.arguments(lines.link), *given, covariance)
    return covariance


def status_of(lines: FittedLines, data: FactorData, covariance: Array) -> str:
    """Return the status of the first fit: the kernel's, or "flat" if the data determine no slope."""
    word = STATUSES[lines.status[0]]
    if not np.isfinite(lines.a[0]):
        return word
    log_median = float(lines.log_values(0.5)[0])
    errors = [lines.log_variances(p, covariance)[0] for p in (0.5, None)]
    used = data.x[data.runs[0] > 0.0]
    if not all(0.0 <= error < np.inf for error in errors) or not used[0] - FAR <= log_median <= used[-1] + FAR:
        return FLAT
    return word
