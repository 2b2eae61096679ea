"""Surface of lognormal curves: ln median and ln dispersion are polynomials of the blocks' variables.

It knows nothing of blocks and motions: a run is a point of the variables, the ln of its level, and an outcome.
"""

from __future__ import annotations

import math
from itertools import product
from typing import NamedTuple

import numpy as np
import scipy

from ...aliases import Array, Flags, Index
from ..numerics.products import crossed, squares, times

STEPS, HALVINGS = 100, 30
SETTLED = 1e-10
"""Gain of ln likelihood a run, expected of a further step, at which the search has settled."""
SEPARATED = 1e-6
"""Ln likelihood a run, of runs that a surface divides without an error: it can be as steep as one likes."""
STEEPEST = 5.0
"""Greatest change of a coefficient of ln dispersion in one step of the search: beyond it, steps are shortened."""


class Pool(NamedTuple):
    """Runs of many blocks: their points (run, variable) in [-1, 1], ln levels, outcomes and motions (run,)."""

    points: Array
    x: Array
    fell: Flags
    motion: Index

    def joined(self, other: Pool) -> Pool:
        """Return these runs and others after them."""
        return Pool(*(np.concatenate(pair) for pair in zip(self, other, strict=True)))

    def some(self, which: Flags) -> Pool:
        """Return those of the runs that a mask (run,) names."""
        return Pool(self.points[which], self.x[which], self.fell[which], self.motion[which])


def exponents(variables: int, degree: int) -> Index:
    """Return the degrees (term, variable) of all products of total degree at most `degree`, the constant first.

    Examples
    --------
    >>> exponents(2, 1).tolist()
    [[0, 0], [0, 1], [1, 0]]
    """
    found = [one for one in product(range(degree + 1), repeat=variables) if sum(one) <= degree]
    return np.array(sorted(found, key=lambda one: (sum(one), one)), dtype=np.int64).reshape(len(found), variables)


def basis(points: Array, degree: int) -> Array:
    """Return products of Chebyshev polynomials (point, term) at points (point, variable) of the box [-1, 1]."""
    terms = exponents(points.shape[1], degree)
    found = np.ones((len(points), len(terms)))
    for k in range(points.shape[1]):
        found *= np.polynomial.chebyshev.chebvander(points[:, k], degree)[:, terms[:, k]]
    return found


class Surface(NamedTuple):
    """Surface Phi((x - m(v))/s(v)) of a law: coefficients of m = ln median, then of ln s, s the dispersion.

    variables: their number; degrees: of the two polynomials; covariance (term, term): of the coefficients; motions: how
    many have runs; influence (motion, term): what each motion, by its number, contributes to the coefficients, empty of
    a surface that was read.
    """

    variables: int
    degrees: tuple[int, int]
    coefficients: Array
    covariance: Array
    motions: int
    influence: Array

    @property
    def split(self) -> int:
        """Number of coefficients of ln median."""
        return math.comb(self.variables + self.degrees[0], self.variables)

    def log_medians(self, points: Array) -> tuple[Array, Array]:
        """Return ln medians at points (point, variable), and their standard errors."""
        rows = basis(points, self.degrees[0])
        n = rows.shape[1]
        return times(rows, self.coefficients[:n]), np.sqrt(squares(rows, self.covariance[:n, :n]))

    def log_dispersions(self, points: Array) -> tuple[Array, Array]:
        """Return ln dispersions at points (point, variable), and their standard errors."""
        rows = basis(points, self.degrees[1])
        n = rows.shape[1]
        return times(rows, self.coefficients[-n:]), np.sqrt(squares(rows, self.covariance[-n:, -n:]))


class _Rows(NamedTuple):
    """The polynomials' terms at the runs' points: of ln median and of ln dispersion."""

    middle: Array
    spread: Array


def fit_surface(runs: Pool, degrees: tuple[int, int], start: Surface | None = None) -> Surface | None:
    """Fit a surface by maximum likelihood, with errors from the sums of each motion's scores.

    Parameters
    ----------
    runs : Pool
    degrees : tuple of int
        Of the polynomials of ln median and of ln dispersion.
    start : Surface, optional
        A surface of the same or lower degrees from which the search begins.

    Returns
    -------
    Surface or None
        None where the likelihood has no maximum: the runs are separated, or too few for the degrees.

    Notes
    -----
    Fisher's scoring, with steps halved until the likelihood rises.  Covariance by Liang and Zeger's sandwich.

    References
    ----------
    Liang, K.-Y. and Zeger, S. L. (1986). Longitudinal data analysis using generalized linear models. Biometrika 73,
    13-22.
    """
    rows = _Rows(basis(runs.points, degrees[0]), basis(runs.points, degrees[1]))
    n = rows.middle.shape[1]
    if runs.x.size <= n + rows.spread.shape[1] or runs.fell.all() or not runs.fell.any():
        return None
    c = _begin(runs, degrees, start)
    value = _likelihood(c, runs, rows)
    for _ in range(STEPS):
        _, scores, information = _scores(c, runs, rows)
        step = _solved(information, scores.sum(axis=0))
        if step is None:
            return None
        step *= min(1.0, STEEPEST / max(float(np.abs(step[n:]).max()), 1e-300))
        gain = float(step @ scores.sum(axis=0))
        if gain < SETTLED * runs.x.size:
            break
        for _ in range(HALVINGS):
            tried = _likelihood(c + step, runs, rows)
            if tried > value:
                break
            step = 0.5 * step
        else:
            break
        c, value = c + step, tried
    else:
        return None
    if value > -SEPARATED * runs.x.size:
        return None
    inverse: Array = np.asarray(np.linalg.inv(information), dtype=np.float64)
    size = int(runs.motion.max()) + 1
    summed = np.stack([np.bincount(runs.motion, own, size).astype(np.float64) for own in scores.T], axis=1)
    k = np.unique(runs.motion).size
    # (each coefficient takes a motion's worth of scatter away)
    influence = times(summed, inverse) * math.sqrt(k / max(k - c.size, 1))
    found = Surface(runs.points.shape[1], degrees, c, crossed(influence, influence), k, influence)
    return found if np.isfinite(found.covariance).all() else None


def _begin(runs: Pool, degrees: tuple[int, int], start: Surface | None) -> Array:
    """Return the coefficients from which the search begins."""
    variables = runs.points.shape[1]
    terms = [exponents(variables, degree) for degree in degrees]
    n = len(terms[0])
    c = np.zeros(n + len(terms[1]))
    if start is None:
        c[0], c[n] = runs.x.mean(), math.log(max(float(runs.x.std()), 0.1))
        return c
    # (terms are ordered by degree, so that those of a lower degree come first)
    known, beside = start.split, len(start.coefficients) - start.split
    own = min(known, n), min(beside, len(terms[1]))
    c[: own[0]] = start.coefficients[: own[0]]
    c[n : n + own[1]] = start.coefficients[known : known + own[1]]
    return c


def _likelihood(c: Array, runs: Pool, rows: _Rows) -> float:
    n = rows.middle.shape[1]
    with np.errstate(over="ignore", invalid="ignore"):
        z = (runs.x - times(rows.middle, c[:n])) * np.exp(-times(rows.spread, c[n:]))
        value = float(scipy.special.log_ndtr(np.where(runs.fell, z, -z)).sum())
    return value if math.isfinite(value) else -math.inf


def _scores(c: Array, runs: Pool, rows: _Rows) -> tuple[Array, Array, Array]:
    """Return z, the slopes of the runs' ln likelihood in the coefficients (run, term), and the expected information."""
    n = rows.middle.shape[1]
    inverse = np.exp(-times(rows.spread, c[n:]))
    z = (runs.x - times(rows.middle, c[:n])) * inverse
    log_density = -0.5 * z * z - 0.5 * math.log(2.0 * math.pi)
    above, below = scipy.special.log_ndtr(z), scipy.special.log_ndtr(-z)
    # (of the other outcome the ratio may overflow)
    ratio = np.exp(log_density - np.where(runs.fell, above, below))
    slope = np.where(runs.fell, ratio, -ratio)
    weight = np.exp(2.0 * log_density - above - below)
    by = np.concatenate([-inverse[:, None] * rows.middle, -z[:, None] * rows.spread], axis=1)
    return z, slope[:, None] * by, crossed(weight[:, None] * by, by)


def _solved(information: Array, score: Array) -> Array | None:
    """Return the step of Fisher's scoring; None where the runs do not determine it."""
    scale = np.sqrt(np.diag(information))
    if not (scale > 0.0).all() or not np.isfinite(scale).all():
        return None
    correlation = information / np.outer(scale, scale)
    if np.linalg.cond(correlation) > 1e12:
        return None
    return np.asarray(np.linalg.solve(correlation, score / scale) / scale)


def added_terms(one: Surface, other: Surface) -> float:
    """Return the probability that terms of ln median that `other` has beyond `one` differ from 0 by chance alone.

    Wald's test with the motions as clusters, by Fisher's F with the motions less the terms as degrees of freedom.
    """
    fewer, more = one.split, other.split
    own = other.coefficients[fewer:more]
    if not own.size:
        return 1.0
    covariance = other.covariance[fewer:more, fewer:more]
    statistic = float(own @ np.linalg.solve(covariance, own)) / own.size
    return float(scipy.special.fdtrc(own.size, max(other.motions - own.size, 1), statistic))
