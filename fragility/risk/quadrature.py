"""Hazard integrals without a closed form: curves that are a product, and moments of the contributing intensity.

These are the integrals of `convolution`, by adaptive quadrature of many at once, to a stated relative error.
"""

from collections.abc import Callable

import numpy as np
import scipy

from ...core.elementary import Array, Index, exp
from ..curves.curve import LEAST, MOST, CurveArrays, LognormalCurves, TabulatedCurves
from ..hazard.pieces import Pieces

# Kronrod's 15 points with the 7 of Gauss among them (as in QUADPACK, Piessens et al. 1983): abscissae from the end to
# the middle, both weights.
_POINTS = np.array(
    [
        [0.991455371120812639206854697526329, 0.022935322010529224963732008058970, 0.0],
        [0.949107912342758524526189684047851, 0.063092092629978553290700663189204, 0.129484966168869693270611432679082],
        [0.864864423359769072789712788640926, 0.104790010322250183839876322541518, 0.0],
        [0.741531185599394439863864773280788, 0.140653259715525918745189590510238, 0.279705391489276667901467771423780],
        [0.586087235467691130294144691693, 0.169004726639267902826583426598550, 0.0],
        [0.405845151377397166906606412076961, 0.190350578064785409913256402421014, 0.381830050505118944950369775488975],
        [0.207784955007898467600689403773245, 0.204432940075298892414161999234649, 0.0],
        [0.0, 0.209482141084727828012999174891714, 0.417959183673469387755102040816327],
    ]
)
NODES = np.concatenate([-_POINTS[:, 0], _POINTS[-2::-1, 0]])
KRONROD = np.concatenate([_POINTS[:, 1], _POINTS[-2::-1, 1]])
GAUSS = np.concatenate([_POINTS[:, 2], _POINTS[-2::-1, 2]])

MOST_ROUNDS = 60
# Panels evaluated at a time: memory stays bounded whatever the number of integrals.
BATCH = 20_000
# Number of dispersions from the median beyond which the normal density, and below which the distribution, is 0 in
# double precision.
REACH = 39.0
# A tail is cut where e^-45 of it is left.
TAIL = 45.0
# Panels begin at these distances from a median, in dispersions.
_KNOTS = np.array([-REACH, -20.0, -12.0, -8.0, -5.0, -3.0, -1.5, 0.0, 1.5, 3.0, 5.0, 8.0, 12.0, 20.0, REACH])


def integrate(
    function: Callable[[Array, Index], Array], start: Array, stop: Array, owner: Index, groups: Index
) -> Array:
    """Return integrals (integral,) of non-negative functions, each the sum of its panels, NaN if the function is.

    `function` takes points (panel, 15) and the integral of each panel (panel,), and returns (panel, 15). `start`,
    `stop` and `owner` (panel,) are the ends of the panels, finite, and the number of their integral. Kinks of the
    function should lie on ends, otherwise bisection has to find them. `groups` (integral,) is the number, from 0 on, of
    the sum to which each integral belongs. A panel is bisected while Gauss' 7 and Kronrod's 15 points differ by more
    than 1e-12 of that sum.
    """
    count = groups.size
    total = np.zeros(count)
    wide = stop > start
    start, stop, owner = start[wide], stop[wide], owner[wide]
    for _ in range(MOST_ROUNDS):
        fine, difference = _kronrod(function, start, stop, owner)
        estimate = np.bincount(groups, total + np.bincount(owner, fine, count))
        # (this comparison is False for NaN, which therefore counts as done)
        again = difference > 1e-12 * estimate[groups[owner]]
        total += np.bincount(owner[~again], fine[~again], count)
        if not again.any():
            return total
        left, right, owner = start[again], stop[again], owner[again]
        middle = 0.5 * (left + right)
        start, stop, owner = np.concatenate([left, middle]), np.concatenate([middle, right]), np.tile(owner, 2)
    # panels of 2^-60 of their first width: a jump inside one cannot be told from its ends any more
    return total + np.bincount(owner, _kronrod(function, start, stop, owner)[0], count)


def _kronrod(function: Callable[[Array, Index], Array], start: Array, stop: Array, owner: Index) -> tuple[Array, Array]:
    """Kronrod's value of every panel, and its distance from Gauss' value."""
    fine, difference = np.empty(start.size), np.empty(start.size)
    for first in range(0, start.size, BATCH):
        part = slice(first, first + BATCH)
        half = 0.5 * (stop[part] - start[part])
        values = function(0.5 * (start[part] + stop[part])[:, None] + half[:, None] * NODES, owner[part])
        # no matrix product: its rounding depends on how many panels come at a time
        fine[part] = half * np.sum(values * KRONROD, axis=1)
        difference[part] = np.abs(half * np.sum(values * (KRONROD - GAUSS), axis=1))
    return fine, difference


def product_integral(curves: LognormalCurves, pieces: Pieces) -> Array:
    """Return the integral of H dP over each piece, (curve, piece), if both factors of P have a dispersion > 0."""
    count = pieces.stop.size
    low, high = _support(curves)

    def density(u: Array, owner: Index) -> Array:
        row, piece = np.divmod(owner, count)
        rows = curves.rows(row)
        z1 = (u - rows.log_median[:, None]) / rows.dispersion[:, None]
        z2 = (u - rows.log_uplift[:, None]) / rows.uplift_dispersion[:, None]
        rise = exp(-0.5 * z1 * z1) / rows.dispersion[:, None] * scipy.special.ndtr(z2)
        rise += exp(-0.5 * z2 * z2) / rows.uplift_dispersion[:, None] * scipy.special.ndtr(z1)
        rate = exp(pieces.log_at(piece[:, None], u))
        return np.where(rise == 0.0, 0.0, rise * rate / np.sqrt(2.0 * np.pi))

    start, stop, row, piece = _panels(curves, pieces, low, high)
    groups = np.repeat(np.arange(curves.shape[0]), count)
    with np.errstate(over="ignore", under="ignore", invalid="ignore"):
        integrals = integrate(density, start, stop, row * count + piece, groups)
    return integrals.reshape(-1, count)


def event_integral(
    curves: CurveArrays, hazard: Pieces, weight: Callable[[Array, Index], Array] | None = None, outside: str = LEAST
) -> Array:
    """Return the integral of P (-dH) over all pieces, (curve,), times `weight`(u, curve) >= 0 if given."""
    low, high = lower_end(curves, hazard, outside), _support(curves)[1]
    # an extended tail is cut where its remainder is negligible
    final = hazard.slope[-1] if np.isposinf(hazard.stop[-1]) else np.inf
    high = np.minimum(np.maximum(high, hazard.last) + TAIL / final, hazard.stop[-1])

    def density(u: Array, row: Index) -> Array:
        piece = hazard.find(0.5 * (u[:, :1] + u[:, -1:]))
        rate = exp(hazard.log_at(piece, u)) * hazard.slope_at(piece, u)
        probability = curves.rows(row).probability(u, outside)
        # 0 where the probability is 0, even for an infinite rate
        density_values = np.where(probability == 0.0, 0.0, probability * rate)
        return density_values if weight is None else density_values * weight(u, row)

    start, stop, row, _ = _panels(curves, hazard, low, high)
    with np.errstate(over="ignore", under="ignore", invalid="ignore"):
        return integrate(density, start, stop, row, np.arange(curves.shape[0]))


def lower_end(curves: CurveArrays, hazard: Pieces, outside: str = LEAST) -> Array:
    """Return the u below which P is 0 or no events count, (curve,); the lowest level for curves without a lower end."""
    low = _support(curves)[0]
    if outside == MOST and isinstance(curves, TabulatedCurves) and hazard.slope[0] == 0.0:
        return np.where(curves.values[:, 0] > 0.0, np.minimum(low, hazard.stop[0]), low)
    return low


def _support(curves: CurveArrays) -> tuple[Array, Array]:
    """Return the u at which P rises from 0 in double precision, and the u above which P is constant, (curve,) each."""
    if isinstance(curves, TabulatedCurves):
        return curves.log_levels[0] + curves.shift, curves.log_levels[-1] + curves.shift
    median, uplift = curves.log_median, curves.log_uplift
    over, lift = REACH * curves.dispersion, REACH * curves.uplift_dispersion
    return np.maximum(median - over, uplift - lift), np.maximum(median + over, uplift + lift)


def _panels(curves: CurveArrays, pieces: Pieces, low: Array, high: Array) -> tuple[Array, Array, Index, Index]:
    """Panels between low and high of every curve, none across the end of a piece: start, stop, curve, piece."""
    if isinstance(curves, TabulatedCurves):
        knots = curves.log_levels + curves.shift[:, None]
    else:
        pairs = [(curves.log_median, curves.dispersion)]
        if not np.all(np.isneginf(curves.log_uplift)):
            pairs.append((curves.log_uplift, curves.uplift_dispersion))
        knots = np.concatenate([m[:, None] + s[:, None] * _KNOTS for m, s in pairs], axis=1)
    ends = np.concatenate([pieces.start[:1], pieces.stop])
    ends = ends[np.isfinite(ends)]
    knots = np.concatenate([knots, np.broadcast_to(ends, (low.size, ends.size)), low[:, None], high[:, None]], axis=1)
    knots = np.sort(np.clip(knots, low[:, None], np.maximum(low, high)[:, None]), axis=1)
    row = np.repeat(np.arange(low.size), knots.shape[1] - 1)
    start, stop = knots[:, :-1].reshape(-1), knots[:, 1:].reshape(-1)
    inside = (start >= pieces.start[0]) & (stop <= pieces.stop[-1])
    start, stop, row = start[inside], stop[inside], row[inside]
    return start, stop, row, pieces.find(0.5 * (start + stop))
