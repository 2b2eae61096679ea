"""Surface of lognormal curves: ln median and ln dispersion are polynomials of the blocks' variables."""

from __future__ import annotations

import math
from itertools import product
from typing import NamedTuple

import numpy as np
import scipy

from ...core.elementary import Array, Flags, Index, crossed, exp, inverse, solve, squares, times
from ..kernels import surfaces as engine

STEPS, HALVINGS = 100, 30
SETTLED = 1e-10
"""Gain of ln likelihood a run, expected of a further step, at which the search has settled."""
SEPARATED = 1e-6
"""Ln likelihood a run, of runs that a surface divides without an error: it can be as steep as one likes."""
STEEPEST = 5.0
"""Maximum change of a coefficient of ln dispersion in one step of the search: larger steps are shortened."""
RUNS_A_TERM = 24
"""Fewest runs for each term of a surface: levels are spread over all of the range before."""
JUMP_DEGREE = 2
"""Degree at most of the difference of the two sides of a cut: each side has fewer runs than the whole."""


class Pool(NamedTuple):
    """Runs of many blocks: their points (run, variable) in [-1, 1], ln levels, outcomes and motions (run,)."""

    points: Array
    x: Array
    fell: Flags
    motion: Index

    def joined(self, further: Pool) -> Pool:
        """Return these runs and others after them."""
        return Pool(*(np.concatenate(pair) for pair in zip(self, further, strict=True)))

    def some(self, which: Flags) -> Pool:
        """Return the runs that a mask (run,) selects."""
        return Pool(self.points[which], self.x[which], self.fell[which], self.motion[which])


def exponents(variables: int, degree: int) -> Index:
    """Return the degrees (term, variable) of all products of total degree at most `degree`, the constant first."""
    terms = [term for term in product(range(degree + 1), repeat=variables) if sum(term) <= degree]
    return np.array(sorted(terms, key=lambda term: (sum(term), term)), dtype=np.int64).reshape(len(terms), variables)


def basis(points: Array, degree: int) -> Array:
    """Return products of Chebyshev polynomials (point, term) at points (point, variable) of the box [-1, 1]."""
    terms = exponents(points.shape[1], degree)
    terms_at_points = np.empty((len(points), len(terms)))
    engine.fill_terms(np.ascontiguousarray(points), terms, terms_at_points)
    return terms_at_points


class Cut(NamedTuple):
    """Plane at which a surface may jump: the far side has point @ normal >= place, normal (variable,).

    low, high: the places that the runs allow lie between these.
    """

    normal: Array
    place: float
    low: float
    high: float

    def along(self, points: Array) -> Array:
        """Return the coordinates of points (point, variable) along the normal."""
        return times(points, self.normal)

    def open_at(self, points: Array) -> Flags:
        """Return True for points (point, variable) whose side the runs do not determine."""
        along = self.along(points)
        return (along > self.low) & (along < self.high)


def terms_at(points: Array, degree: int, cut: Cut | None = None) -> Array:
    """Return the terms (point, term) of a surface's polynomial: the terms of `basis`, then of its jump beyond a cut."""
    rows = basis(points, degree)
    if cut is None:
        return rows
    jump = rows[:, : _count(points.shape[1], min(degree, JUMP_DEGREE))]
    return np.concatenate([rows, np.where((cut.along(points) >= cut.place)[:, None], jump, 0.0)], axis=1)


def number_of_terms(variables: int, degrees: tuple[int, int], cut: Cut | None = None) -> int:
    """Return the number of coefficients of a surface."""
    return sum(sum(pair) for pair in _sizes(variables, degrees, cut))


def _sizes(variables: int, degrees: tuple[int, int], cut: Cut | None) -> list[tuple[int, int]]:
    """Return, for ln median and ln dispersion, the numbers of terms on both sides and of further terms beyond a cut."""
    return [
        (_count(variables, degree), 0 if cut is None else _count(variables, min(degree, JUMP_DEGREE)))
        for degree in degrees
    ]


def _count(variables: int, degree: int) -> int:
    return math.comb(variables + degree, variables)


class Surface(NamedTuple):
    """Surface Phi((x - m(v))/s(v)) of a law: coefficients of m = ln median, then of ln s, s the dispersion.

    `variables`: their number. `degrees`: of the two polynomials. `covariance` (term, term): of the coefficients.
    `motions`: number with runs. `influence` (motion, term): contribution of each motion, by its number, to the
    coefficients, empty for a surface that was read. `cut`: plane of its jump, None without a jump.
    """

    variables: int
    degrees: tuple[int, int]
    coefficients: Array
    covariance: Array
    motions: int
    influence: Array
    cut: Cut | None = None

    @property
    def sizes(self) -> list[tuple[int, int]]:
        """Numbers of terms of ln median and of ln dispersion: on both sides of a cut, and further terms beyond it."""
        return _sizes(self.variables, self.degrees, self.cut)

    def on_side(self, far: bool) -> Surface:
        """Return the surface with one side of its cut continued over all of the region."""
        place = -math.inf if far else math.inf
        return self if self.cut is None else self._replace(cut=self.cut._replace(place=place))

    def terms(self, points: Array) -> tuple[Array, Array]:
        """Return the terms (point, term) of ln median and of ln dispersion at points (point, variable)."""
        middle, spread = (terms_at(points, degree, self.cut) for degree in self.degrees)
        return middle, spread

    def log_medians(self, points: Array) -> Array:
        """Return ln medians at points (point, variable)."""
        rows = terms_at(points, self.degrees[0], self.cut)
        return times(rows, self.coefficients[: rows.shape[1]])

    def median_errors(self, points: Array) -> Array:
        """Return the standard errors of ln medians at points (point, variable)."""
        rows = terms_at(points, self.degrees[0], self.cut)
        n = rows.shape[1]
        return np.asarray(np.sqrt(squares(rows, self.covariance[:n, :n])))

    def log_dispersions(self, points: Array) -> Array:
        """Return ln dispersions at points (point, variable)."""
        rows = terms_at(points, self.degrees[1], self.cut)
        return times(rows, self.coefficients[-rows.shape[1] :])

    def dispersion_errors(self, points: Array) -> Array:
        """Return the standard errors of ln dispersions at points (point, variable)."""
        rows = terms_at(points, self.degrees[1], self.cut)
        n = rows.shape[1]
        return np.asarray(np.sqrt(squares(rows, self.covariance[-n:, -n:])))


def fit_surface(
    runs: Pool, degrees: tuple[int, int], start: Surface | None = None, cut: Cut | None = None
) -> Surface | None:
    """Return the likeliest surface with polynomials of ln median and ln dispersion of two degrees, or None.

    The search begins at `start`, a surface of other degrees or without the `cut` at which the surface may jump. The
    likelihood has no maximum if the runs are separated, or too few for the degrees. Fisher's scoring is used, with
    steps halved until the likelihood rises. Errors are from the sums of each motion's scores, the sandwich of Liang,
    K.-Y. and Zeger, S. L. (1986). Biometrika 73, 13-22.
    """
    rows = terms_at(runs.points, degrees[0], cut), terms_at(runs.points, degrees[1], cut)
    fit = _likeliest(_begin(runs, degrees, start, cut), runs, rows)
    return None if fit is None else Surface(runs.points.shape[1], degrees, *fit, cut)


def fit_medians(runs: Pool, degree: int, curve: Surface, start: Surface) -> Surface | None:
    """Fit medians alone to runs near them: dispersions are from a curve, times one factor for all blocks.

    Levels near the medians determine dispersions poorly. Dispersions from their own polynomial were up to 1.6 times too
    wide at the corners of a region, and errors of medians there are in proportion. `curve` is the surface of all runs,
    and its cut is also the cut of the medians; only the factor's error is in the covariance. None as `fit_surface`.
    """
    narrow = exp(-curve.log_dispersions(runs.points))
    # (in dispersions of the curve there is a single number to find)
    rows = narrow[:, None] * terms_at(runs.points, degree, curve.cut), np.ones((runs.x.size, 1))
    c = _begin(runs, (degree, 0), start, curve.cut)[: rows[0].shape[1] + 1]
    c[-1] = 0.0
    fit = _likeliest(c, runs._replace(x=narrow * runs.x), rows)
    if fit is None:
        return None
    coefficients, covariance, motions, influence = fit
    n, terms = c.size - 1, sum(curve.sizes[1])
    spread = curve.coefficients[-terms:].copy()
    spread[0] += coefficients[n]
    return Surface(
        curve.variables,
        (degree, curve.degrees[1]),
        np.concatenate([coefficients[:n], spread]),
        np.pad(covariance, (0, terms - 1)),
        motions,
        np.pad(influence, ((0, 0), (0, terms - 1))),
        curve.cut,
    )


def _likeliest(c: Array, runs: Pool, rows: tuple[Array, Array]) -> tuple[Array, Array, int, Array] | None:
    """Search from coefficients c (middle, then spread) for the likeliest coefficients; None if there are none.

    Returned as `Surface` has them: coefficients, covariance, number of motions, influence.
    """
    n = rows[0].shape[1]
    if runs.x.size <= c.size or runs.fell.all() or not runs.fell.any():
        return None
    likelihood, scores, information = _sums(c, runs, rows)
    if likelihood == -math.inf:
        return None
    for _ in range(STEPS):
        gradient = scores.sum(axis=0)
        step = _solved(information, gradient)
        if step is None:
            return None
        step *= min(1.0, STEEPEST / max(float(np.abs(step[n:]).max()), 1e-300))
        if float(times(step, gradient)) < SETTLED * runs.x.size:
            break
        for _ in range(HALVINGS):
            tried = _sums(c + step, runs, rows)
            if tried[0] > likelihood:
                break
            step = 0.5 * step
        else:
            break
        c, (likelihood, scores, information) = c + step, tried
    else:
        return None
    if likelihood > -SEPARATED * runs.x.size:
        return None
    k = np.unique(runs.motion).size
    # (each coefficient takes a motion's worth of scatter away)
    influence = times(scores, inverse(information)) * math.sqrt(k / max(k - c.size, 1))
    covariance = crossed(influence, influence)
    return (c, covariance, k, influence) if np.isfinite(covariance).all() else None


def _begin(runs: Pool, degrees: tuple[int, int], start: Surface | None, cut: Cut | None) -> Array:
    """Return the coefficients from which the search begins."""
    sizes = _sizes(runs.points.shape[1], degrees, cut)
    n = sum(sizes[0])
    c = np.zeros(n + sum(sizes[1]))
    if start is None:
        c[0], c[n] = runs.x.mean(), math.log(max(float(runs.x.std()), 0.1))
        return c
    # terms are ordered by degree: lower degrees come first
    starts, known = np.cumsum([0, *sizes[0], *sizes[1]]), np.cumsum([0, *start.sizes[0], *start.sizes[1]])
    for part in range(4):
        common = min(starts[part + 1] - starts[part], known[part + 1] - known[part])
        c[starts[part] : starts[part] + common] = start.coefficients[known[part] : known[part] + common]
    return c


def _sums(c: Array, runs: Pool, rows: tuple[Array, Array]) -> tuple[float, Array, Array]:
    """Return sums over runs: ln likelihood, its slopes in the coefficients (motion, term), and expected information."""
    scores, information = np.zeros((int(runs.motion.max()) + 1, c.size)), np.zeros((c.size, c.size))
    likelihood = engine.add_scores(*rows, c, runs.x, runs.fell, runs.motion, scores, information)
    return likelihood, scores, information


def _solved(information: Array, score: Array) -> Array | None:
    """Return the step of Fisher's scoring; None if the runs do not determine it."""
    scale = np.sqrt(np.diag(information))
    if not (scale > 0.0).all() or not np.isfinite(scale).all():
        return None
    correlation = information / np.outer(scale, scale)
    try:
        solved = solve(correlation, np.column_stack([score / scale, np.eye(scale.size)]))
    except np.linalg.LinAlgError:
        return None
    # (numbers of condition by sums of columns)
    sums = (np.abs(part).sum(axis=0).max() for part in (correlation, solved[:, 1:]))
    return None if math.prod(sums) > 1e12 else solved[:, 0] / scale


def cut_score(runs: Pool, smooth: Surface, cut: Cut) -> float:
    """Return Rao's score statistic of a cut: twice the ln likelihood, about, that a surface gains by jumping there.

    0 if the runs do not determine the jump.
    """
    rows = smooth._replace(cut=cut).terms(runs.points)
    _, scores, information = _sums(_begin(runs, smooth.degrees, smooth, cut), runs, rows)
    gradient = scores.sum(axis=0)
    step = _solved(information, gradient)
    return 0.0 if step is None else float(times(step, gradient))


def added_terms(fewer_terms: Surface, more_terms: Surface) -> float:
    """Return the probability that the additional terms of ln median of `more_terms` differ from 0 by chance alone.

    Wald's test with the motions as clusters, by Fisher's F with the motions less the terms as degrees of freedom.
    """
    (fewer, fewer_beyond), (more, more_beyond) = fewer_terms.sizes[0], more_terms.sizes[0]
    added = np.r_[fewer:more, more + fewer_beyond : more + more_beyond]
    coefficients = more_terms.coefficients[added]
    if not coefficients.size:
        return 1.0
    covariance = more_terms.covariance[np.ix_(added, added)]
    statistic = float(times(coefficients, solve(covariance, coefficients))) / coefficients.size
    return float(scipy.special.fdtrc(coefficients.size, max(more_terms.motions - coefficients.size, 1), statistic))
