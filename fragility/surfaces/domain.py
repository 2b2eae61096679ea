"""Domain of a pooled analysis: the variables of the blocks, the region that they fill, and the design of blocks.

The response of a free-standing block depends only on its frequency p, its slenderness and its inertia factor, under
laws without sizes of their own (docs/theory). The region is the convex hull of the blocks in ln p, ln tan(alpha) and
the inertia factor. If blocks have their own e and delta, it includes e and ln delta. It is turned to its principal axes
and scaled to [-1, 1].
"""

import math
from typing import NamedTuple

import numpy as np
import scipy

from ...core.elementary import Array, Flags, crossed, eigh, inverse, power, squares, times
from ...core.streams import stream
from .surface import Cut, terms_at

NARROW = 1e-3
"""Width of the region along an axis, in ln or in the inertia factor, that no median can distinguish from 0."""
CANDIDATES = 1000
ROUNDS = 100
"""Rounds of the search for a design: its errors are then a hundredth above the minimum."""
NEXT = 4
"""Blocks next to a cut are drawn from the nearest blocks, `NEXT` times as many."""
EVEN = 0.2
POWER, DAMPED = 6, 0.25
GOLDEN = 0.5 * (math.sqrt(5.0) - 1.0)
"""Share of a step by which designs move on from part to part: the places of any number of parts lie evenly."""
OUTSIDE = 1e-7
"""Distance, in half widths of the region, by which rounding may put a block of it outside."""
CANDIDATE_KEY, DESIGN_KEY, CHECK_KEY = (1, 0), (1, 1), (1, 2)
"""Keys, under a seed, of the blocks from which designs are taken, of the designs and of the blocks of checks."""


TOGETHER = 20_000
"""Points whose place in the region is determined together, which bounds memory."""


class Domain(NamedTuple):
    """Region of blocks.

    Points are (variables - `middle`) @ `axes`, in [-1, 1], with `middle` (variable,) and `axes` (variable, axis);
    `back` (axis, variable) is the inverse. `vertices` (vertex, axis) are of the convex hull. A point is inside if
    `inside[:, :-1] @ point + inside[:, -1] <= 0`, with `inside` (face, axis + 1).
    """

    middle: Array
    axes: Array
    back: Array
    vertices: Array
    inside: Array

    @property
    def size(self) -> int:
        """Number of axes along which the blocks differ."""
        return int(self.axes.shape[1])

    def points(self, variables: Array) -> Array:
        """Return the points (block, axis) of blocks from their variables (block, variable)."""
        return times(variables - self.middle, self.axes)

    def variables(self, points: Array) -> Array:
        """Return the variables (block, variable) of points (block, axis)."""
        return self.middle + times(points, self.back)

    def holds(self, points: Array) -> Flags:
        """Return True for points (block, axis) in the region."""
        if not self.size:
            return np.ones(len(points), np.bool_)
        inside = np.empty(len(points), np.bool_)
        for first in range(0, len(points), TOGETHER):
            part = slice(first, first + TOGETHER)
            # (the bound has room for the order of these sums)
            inside[part] = (times(points[part], self.inside[:, :-1].T) + self.inside[:, -1] <= OUTSIDE).all(axis=1)
        return inside


def domain_of(variables: Array) -> Domain:
    """Return the region of blocks from their variables (block, variable): ln p, ln tan(alpha), inertia factor, and own.

    Axes along which blocks differ by less than a thousandth are left out.
    """
    centre = variables.mean(axis=0)
    turned = eigh(crossed(variables - centre, variables - centre) / len(variables))[1][:, ::-1]
    along = times(variables - centre, turned)
    low, high = along.min(axis=0), along.max(axis=0)
    used = high - low > NARROW
    half = 0.5 * (high - low)[used]
    middle = centre + times(turned, 0.5 * (low + high))
    axes, back = turned[:, used] / half, (turned[:, used] * half).T
    points = times(variables - middle, axes)
    return Domain(middle, axes, back, *_hull(points))


def normals(domain: Domain) -> Array:
    """Return the directions (plane, axis) across which the region may be cut: one for each variable that varies."""
    directions = np.ascontiguousarray(domain.back.T)
    return np.asarray(directions[np.linalg.norm(directions, axis=1) > NARROW])


def _hull(points: Array) -> tuple[Array, Array]:
    """Return vertices and faces of the convex hull of points, which are not all on one face."""
    n = points.shape[1]
    if n == 0:
        return np.zeros((1, 0)), np.zeros((0, 1))
    if n == 1:
        return np.array([[-1.0], [1.0]]), np.array([[1.0, -1.0], [-1.0, -1.0]])
    try:
        hull = scipy.spatial.ConvexHull(points)
    except scipy.spatial.QhullError:
        # (blocks so few, or so nearly in one plane, that they have no hull: the box around them)
        corners = np.stack(np.meshgrid(*[[-1.0, 1.0]] * n), axis=-1).reshape(-1, n)
        hull = scipy.spatial.ConvexHull(corners)
        points = corners
    return points[hull.vertices], np.unique(hull.equations, axis=0)


def candidates(domain: Domain, seed: int) -> Array:
    """Return points (point, axis) all over the region, in the order of neighbours: vertices, and others at random."""
    if domain.size == 0:
        return np.zeros((1, 0))
    if domain.size == 1:
        return np.linspace(-1.0, 1.0, 401)[:, None]
    random = stream(seed, *CANDIDATE_KEY)
    corners = domain.vertices[None]
    if len(domain.vertices) > domain.size + 1:  # (of a simplex there is nothing to divide, which Qhull refuses)
        corners = domain.vertices[scipy.spatial.Delaunay(domain.vertices, qhull_options="QJ Qbb").simplices]
    volumes = np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1]))
    which = random.choice(len(volumes), CANDIDATES, p=volumes / volumes.sum())
    shares = random.dirichlet(np.ones(domain.size + 1), CANDIDATES)
    inside = np.einsum("ij,ijk->ik", shares, corners[which])
    points = np.concatenate([domain.vertices, inside])
    # neighbours in the order of the tree's leaves are neighbours in the region. Its first cut is across the widest
    # axis, and all axes are equally wide except for rounding.
    return np.asarray(points[scipy.spatial.cKDTree(points.round(12), leafsize=1).indices])


def design_weights(points: Array, degree: int, dispersions: Array, cut: Cut | None = None) -> Array:
    """Return shares of runs (point,) that determine a polynomial of a degree, or two, best, a fifth of them even.

    Four fifths minimise the mean seventh power of the variance of ln medians over the points, which is near the minimum
    of the largest variance. A run has the inverse square of the dispersion (point,) there as its weight. The even fifth
    reveals deviations from the polynomial. The algorithm is multiplicative: Silvey, S. D., Titterington, D. M. and
    Torsney, B. (1978). Communications in Statistics A 7, 1379-1389.
    """
    rows = terms_at(points, degree, cut)
    worth = 1.0 / dispersions**2
    even = np.full(len(points), 1.0 / len(points))
    weights = even
    for _ in range(ROUNDS):
        covariance = inverse(crossed(rows, (weights * worth)[:, None] * rows))
        variance = squares(rows, covariance)
        slope = crossed(rows, power(variance / variance.max(), POWER)[:, None] * rows)
        weights = weights * power(squares(rows, times(times(covariance, slope), covariance)) * worth, DAMPED)
        weights = weights / weights.sum()
    return (1.0 - EVEN) * weights + EVEN * even


def designed(points: Array, weights: Array, number: int, seed: int, part: int) -> Array:
    """Return points of the `number` blocks of a part of the motions, by their shares in even steps along the points.

    From part to part the steps move on by the golden section, which leaves no place out for long (Weyl's sequence).
    """
    start = (stream(seed, *DESIGN_KEY).random() + part * GOLDEN) % 1.0
    steps = (np.arange(number) + start) / number
    return np.asarray(points[np.searchsorted(np.cumsum(weights), steps * weights.sum() * (1.0 - 1e-12))])


def check_points(domain: Domain, given: Array, number: int, seed: int) -> Array:
    """Return points (point, axis) of blocks that a fit is checked at, far from each other, from the edges inwards.

    Half of them are as far apart as they can be among vertices and given blocks (block, axis), the others at random in
    the region.
    """
    if domain.size == 0:
        return np.zeros((1, 0))
    random = stream(seed, *CHECK_KEY)
    some = given if len(given) <= CANDIDATES else given[random.choice(len(given), CANDIDATES, replace=False)]
    pool = np.concatenate([domain.vertices, some])
    far: list[int] = [int(np.abs(pool).sum(axis=1).argmax())]
    distance = np.linalg.norm(pool - pool[far[0]], axis=1)
    while len(far) < number // 2 and distance.max() > 1e-6:
        far.append(int(distance.argmax()))
        distance = np.minimum(distance, np.linalg.norm(pool - pool[far[-1]], axis=1))
    inside = candidates(domain, seed)
    rest = random.choice(len(inside), min(number - len(far), len(inside)), replace=False)
    return np.unique(np.concatenate([pool[far], inside[rest]]), axis=0)


def cut_check_points(domain: Domain, given: Array, number: int, seed: int, cut: Cut, check: int) -> Array:
    """Return points (point, axis) of blocks that a fit with a cut is checked at, others for every check (from 1 on).

    Half of them are next to the cut, on its two sides, and the others at random in the region. No point is where the
    runs do not decide the side.
    """
    random = stream(seed, *CHECK_KEY, check)
    some = given if len(given) <= CANDIDATES else given[random.choice(len(given), CANDIDATES, replace=False)]
    pool = np.concatenate([some, candidates(domain, seed)])
    pool = pool[~cut.open_at(pool)]
    along = cut.along(pool) - cut.place
    quarter = number // 4
    chosen = []
    for side in (along < 0.0, along >= 0.0):
        mine = np.flatnonzero(side)
        near = mine[np.argsort(np.abs(along[mine]), kind="stable")][: NEXT * quarter]
        chosen.append(random.choice(near, min(quarter, len(near)), replace=False))
    rest = np.setdiff1d(np.arange(len(pool)), np.concatenate(chosen))
    chosen.append(random.choice(rest, min(number - 2 * quarter, len(rest)), replace=False))
    return np.unique(pool[np.concatenate(chosen)], axis=0)


def some_points(domain: Domain, given: Array, number: int) -> Array:
    """Return at most `number` of the given points in even steps, and the vertices of the region."""
    step = max(1, len(given) // number)
    return np.concatenate([domain.vertices, given[::step][:number]])
