"""What has no closed form of the hazard integral: curves that are a product, and moments of the contributing intensity.

The same integrals as `convolution`'s, by quadrature whose error is controlled.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import scipy
from numpy.typing import NDArray

from .curves import LEAST, MOST, Form, Lognormals, Tabulated
from .hazard_pieces import Pieces
from .quadrature import integrate

Array = NDArray[np.float64]

# Beyond so many dispersions from its median a normal density, and below it the distribution, is 0 in double precision.
REACH = 39.0
# A tail is cut where e^-45 of it is left.
TAIL = 45.0
# Panels begin at these distances from a median, in dispersions.
_KNOTS = np.array([-REACH, -20.0, -12.0, -8.0, -5.0, -3.0, -1.5, 0.0, 1.5, 3.0, 5.0, 8.0, 12.0, 20.0, REACH])


def product(curves: Lognormals, pieces: Pieces) -> Array:
    """Integral of H dP over each piece, (curve, piece), where both factors of P have a dispersion > 0."""
    count = pieces.stop.size
    low, high = _support(curves)

    def density(u: Array, owner: NDArray[np.int64]) -> Array:
        row, piece = np.divmod(owner, count)
        one = curves.rows(row)
        z1 = (u - one.log_median[:, None]) / one.dispersion[:, None]
        z2 = (u - one.log_uplift[:, None]) / one.uplift_dispersion[:, None]
        rise = np.exp(-0.5 * z1 * z1) / one.dispersion[:, None] * scipy.special.ndtr(z2)
        rise += np.exp(-0.5 * z2 * z2) / one.uplift_dispersion[:, None] * scipy.special.ndtr(z1)
        rate = np.exp(pieces.log_at(piece[:, None], u))
        return np.where(rise == 0.0, 0.0, rise * rate / np.sqrt(2.0 * np.pi))

    start, stop, row, piece = _panels(curves, pieces, low, high)
    groups = np.repeat(np.arange(curves.shape[0]), count)
    with np.errstate(over="ignore", under="ignore", invalid="ignore"):
        found = integrate(density, start, stop, row * count + piece, groups)
    return found.reshape(-1, count)


def events(
    form: Form,
    hazard: Pieces,
    weight: Callable[[Array, NDArray[np.int64]], Array] | None = None,
    outside: str = LEAST,
) -> Array:
    """Integral of P (-dH) over all pieces, (curve,); times `weight`(u, curve) >= 0 where that is given."""
    low, high = lowest(form, hazard, outside), _support(form)[1]
    # whatever is extended ends where nothing is left of it
    final = hazard.slope[-1] if np.isposinf(hazard.stop[-1]) else np.inf
    high = np.minimum(np.maximum(high, hazard.last) + TAIL / final, hazard.stop[-1])

    def density(u: Array, row: NDArray[np.int64]) -> Array:
        piece = hazard.find(0.5 * (u[:, :1] + u[:, -1:]))
        rate = np.exp(hazard.log_at(piece, u)) * hazard.slope_at(piece, u)
        probability = form.rows(row).probability(u, outside)
        # without a probability it is 0 however often shaking comes
        found = np.where(probability == 0.0, 0.0, probability * rate)
        return found if weight is None else found * weight(u, row)

    start, stop, row, _ = _panels(form, hazard, low, high)
    with np.errstate(over="ignore", under="ignore", invalid="ignore"):
        return integrate(density, start, stop, row, np.arange(form.shape[0]))


def lowest(form: Form, hazard: Pieces, outside: str = LEAST) -> Array:
    """The u below which P is 0 or nothing happens, (curve,); of curves that never end, where their levels do."""
    low = _support(form)[0]
    if outside == MOST and isinstance(form, Tabulated) and hazard.slope[0] == 0.0:
        return np.where(form.values[:, 0] > 0.0, np.minimum(low, hazard.stop[0]), low)
    return low


def _support(form: Form) -> tuple[Array, Array]:
    """Where P rises from 0 in double precision, and from where on it is constant, (curve,) each."""
    if isinstance(form, Tabulated):
        return form.log_levels[0] + form.shift, form.log_levels[-1] + form.shift
    low = np.maximum(form.log_median - REACH * form.dispersion, form.log_uplift - REACH * form.uplift_dispersion)
    high = np.maximum(form.log_median + REACH * form.dispersion, form.log_uplift + REACH * form.uplift_dispersion)
    return low, high


def _panels(
    form: Form, pieces: Pieces, low: Array, high: Array
) -> tuple[Array, Array, NDArray[np.int64], NDArray[np.int64]]:
    """Panels between low and high of every curve, none across the end of a piece: start, stop, curve, piece."""
    if isinstance(form, Tabulated):
        knots = form.log_levels + form.shift[:, None]
    else:
        pairs = [(form.log_median, form.dispersion)]
        if not np.all(np.isneginf(form.log_uplift)):
            pairs.append((form.log_uplift, form.uplift_dispersion))
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
