"""Annual rate of overturning: the convolution of a fragility curve P with a hazard curve H, in closed form.

With u = ln x, lambda = integral of P(u) (-dH/du) du = integral of H(u) dP(u). The second integral is a sum of positive
terms, one for each piece of the hazard curve. Terms therefore do not cancel, however far apart curve and hazard lie.

On a piece on which ln H is a parabola of local slope k(u) = -d ln H/du and curvature k2, and P = Phi(z), z = (u -
m)/beta:

    H(u) phi(z) = C phi(t),   t = (z + k(u) beta)/r,   r = sqrt(1 + 2 k2 beta²),   dz = dt/r,

so that the piece contributes C/r times a difference of Phi(t) between its ends. With the scaled complementary error
function, C Phi(-|t|) = H phi(z) sqrt(pi/2) erfcx(|t|/sqrt 2), both ends stay finite. C itself, which contains exp(k²
beta²/2), is needed only if t changes its sign on the piece. There C phi(0) is H phi(z) at a point of the piece.

Power law, k0 median**-k exp(k² beta²/2): Cornell, C. A. et al. (2002). Second order: Vamvatsikos, D. (2013). (Both as
in `hazard.HazardCurve`.)
"""

import math
from typing import NamedTuple

import numpy as np
import scipy

from ...core.elementary import Array, Flags, exp, expm1
from ..curves.curve import LEAST, MOST, REFUSE, CurveArrays, LognormalCurves, TabulatedCurves
from ..hazard.pieces import EXTEND, HOLD, NONE, Pieces
from ..kernels import convolution as engine
from .quadrature import event_integral, product_integral

# Overflow, 0 times inf and the like occur on branches that are not used, or result from an absurd extension.
_QUIET = np.errstate(over="ignore", under="ignore", invalid="ignore", divide="ignore")
# Rows of curves at a time: the arrays of one pass stay in the processor's cache.
ROWS = 2048
# If a rate without the events above the levels is less than this share of the whole, it is integrated again.
CANCELLED = 0.1
# Two bounds of a rate whose relative difference is smaller are equal.
SAME = 1e-12


class Rates(NamedTuple):
    """Annual rates (curve,), and their shares from below the lowest and from above the highest level."""

    rate: Array
    share_below: Array
    share_above: Array


@_QUIET
def rates_of(curves: CurveArrays, hazard: Pieces, outside: str = REFUSE) -> Rates:
    """Return the annual rates of all curves of a form, flattened (curve,).

    With "refuse" `outside`, the values of a tabulated curve beyond its levels must not change a rate.
    """
    curves = curves.flat()
    table = np.empty((3, curves.shape[0]))
    if isinstance(curves, TabulatedCurves):
        for rows in _tables(curves):
            table[:, rows] = _tabulated_rates(curves.rows(rows), hazard, outside)
    else:
        for first in range(0, table.shape[1], ROWS):
            part = slice(first, first + ROWS)
            part_curves = curves.rows(part)
            table[:, part] = _lognormal_rates(part_curves, hazard, _stieltjes(part_curves, hazard))
    return Rates(*table)


@_QUIET
def rates_and_slopes(curves: LognormalCurves, hazard: Pieces) -> tuple[Rates, Array]:
    """Return the annual rates of curves (curve,) without uplift, and the slopes (2, curve) of ln rate.

    The slopes are in ln median and in ln dispersion. Let M1 and M2 be the integrals of z H dP and of z² H dP over a
    piece, with z = (u - m)/beta. The part I of the piece in the rate has the slopes M1/beta in m and M2 - I in ln beta.
    Both follow from the slopes of H phi(z) and of z H phi(z), integrated over the piece:

        M1 = -([H phi] + k beta I)/r²,   M2 = (I - k beta M1 - [z H phi])/r²,

    with k the slope of the piece's parabola at m and r as above.
    """
    table = np.empty((5, curves.shape[0]))
    for first in range(0, table.shape[1], ROWS):
        part = slice(first, first + ROWS)
        part_curves = curves.rows(part)
        whole = _stieltjes(part_curves, hazard)
        table[:3, part] = _lognormal_rates(part_curves, hazard, whole)
        table[3:, part] = _slopes(part_curves, hazard, whole) / table[0, part]
    return Rates(*table[:3]), table[3:]


def _slopes(curves: LognormalCurves, hazard: Pieces, whole: Array) -> Array:
    """Return the slopes of rates in ln median and in ln dispersion, (2, curve)."""
    median, beta = curves.log_median[:, None], curves.dispersion[:, None]
    z, density = [], []
    for end in (hazard.start, hazard.stop):
        finite = np.where(np.isinf(end), 0.0, end)
        z.append((finite - median) / beta)
        ends = exp(hazard.log_at(slice(None), finite) - 0.5 * z[-1] ** 2) / math.sqrt(2.0 * math.pi)
        density.append(np.where(np.isinf(end), 0.0, ends))
    fall = hazard.slope_at(slice(None), median) * beta
    bend = 1.0 + 2.0 * hazard.curvature * beta**2
    once = -(density[1] - density[0] + fall * whole) / bend
    twice = (whole - fall * once - (z[1] * density[1] - z[0] * density[0])) / bend
    slopes = np.stack([(once / beta).sum(axis=1), (twice - whole).sum(axis=1)])
    if hazard.above == NONE:  # (without the events above the highest level, P there times their rate)
        last = density[1][:, -1]
        slopes += np.stack([last / curves.dispersion, z[1][:, -1] * last])
    return slopes


@_QUIET
def contributions(curves: CurveArrays, hazard: Pieces, edges: Array, outside: str = REFUSE) -> Array:
    """Return the rates (curve, edge - 1), 1/year, from each interval between `edges` (edge,), ascending u = ln x."""
    curves = curves.flat()
    rule = LEAST if outside == REFUSE else outside  # a rate without an error is the same under both rules
    rates = np.empty((curves.shape[0], edges.size - 1))
    if isinstance(curves, TabulatedCurves):
        for rows in _tables(curves):
            table = curves.rows(rows)
            pieces = hazard.split(np.concatenate([edges, table.log_levels + table.shift[0]]))
            rates[rows] = _gathered(_tabulated_parts(table, pieces, rule), pieces, edges)
    else:
        pieces = hazard.split(edges)
        rates = _gathered(_parts(curves, pieces), pieces, edges)
    if hazard.above == HOLD:
        at = int(np.searchsorted(edges, hazard.last, side="left")) - 1
        if 0 <= at < rates.shape[1]:
            rates[:, at] += _held(curves, hazard, rule)
    return rates


def _gathered(parts: Array, pieces: Pieces, edges: Array) -> Array:
    """Return the sums between the edges of the parts of pieces, none of which crosses an edge."""
    bins = np.searchsorted(edges, pieces.stop, side="left") - 1
    sums = np.zeros((parts.shape[0], edges.size - 1))
    for at in np.flatnonzero((bins >= 0) & (bins < edges.size - 1)):
        sums[:, bins[at]] += parts[:, at]
    # small parts are differences, which rounding can leave just below 0
    return np.maximum(sums, 0.0)


def _tables(curves: TabulatedCurves) -> list[Flags]:
    """Return flags of the groups of curves with the same levels, that is, of equal shift."""
    return [curves.shift == shift for shift in np.unique(curves.shift)]


def _held(curves: CurveArrays, hazard: Pieces, outside: str) -> Array:
    """Return P at the highest level times the rate of exceeding it, (curve,)."""
    return np.asarray(curves.probability(np.array([hazard.last]), outside)[:, 0] * exp(hazard.log_last))


def _lognormal_rates(curves: LognormalCurves, hazard: Pieces, whole: Array) -> Array:
    """Return rates and both shares, (3, curve); whole: the integrals of H dP over all pieces, without steps."""
    step = _step(curves)
    jump = np.where(np.isneginf(step), 0.0, _times(curves.probability(step[:, None])[:, 0], hazard.rate(step)))
    rate = whole.sum(axis=1) + jump
    below = _some_parts(curves, hazard, hazard.stop <= hazard.first, whole)
    above = np.zeros_like(rate)
    if hazard.above == HOLD:
        above = _held(curves, hazard, REFUSE)
    elif hazard.above == EXTEND:
        above = _some_parts(curves, hazard, hazard.start >= hazard.last, whole)
    else:
        left = rate - _held(curves, hazard, REFUSE)
        poor = np.flatnonzero(left < CANCELLED * rate)
        if poor.size:
            left[poor] = event_integral(curves.rows(poor), hazard)
        rate = left
    return _with_shares(rate, below, above)


def _with_shares(rate: Array, below: Array, above: Array) -> Array:
    """Return rates and shares, (3, curve): shares of a rate of 0 are 0; an infinite part is the whole of its rate."""
    rows = [rate]
    for part in (below, above):
        share = np.where(rate == 0.0, 0.0, part / rate)
        share = np.where(np.isposinf(rate), np.isposinf(part).astype(float), share)
        # parts are differences: rounding can leave a share just outside
        rows.append(np.clip(share, 0.0, 1.0))
    return np.stack(rows)


def _step(curves: LognormalCurves) -> Array:
    """Return the lower end of the curves: the higher of the medians of dispersion 0, -inf without such a median."""
    over = np.where(curves.dispersion == 0.0, curves.log_median, -np.inf)
    return np.maximum(over, np.where(curves.uplift_dispersion == 0.0, curves.log_uplift, -np.inf))


def _stieltjes(curves: LognormalCurves, pieces: Pieces) -> Array:
    """Return the integral of H dP over each piece without the jump at a step, (curve, piece)."""
    over, uplift = curves.dispersion > 0.0, curves.uplift_dispersion > 0.0
    step = _step(curves)[:, None]
    begins = not np.all(np.isneginf(step))
    start = np.maximum(pieces.start, step) if begins else pieces.start[None, :]
    stop = np.maximum(pieces.stop, step) if begins else pieces.stop[None, :]
    integrals = np.zeros((curves.shape[0], pieces.stop.size))
    integrals[np.isnan(curves.log_median) | np.isnan(curves.log_uplift)] = np.nan
    single = np.flatnonzero(over ^ uplift)
    if single.size:
        ends = [end if end.shape[0] == 1 else end[single] for end in (start, stop)]
        median = np.where(over, curves.log_median, curves.log_uplift)[single]
        dispersion = np.where(over, curves.dispersion, curves.uplift_dispersion)[single]
        # NaN of a missing curve stays NaN
        integrals[single] += _normal(pieces, ends[0], ends[1], median, dispersion)
    both = np.flatnonzero(over & uplift)
    if both.size:
        integrals[both] += product_integral(curves.rows(both), pieces)
    return integrals


def _normal(pieces: Pieces, start: Array, stop: Array, median: Array, dispersion: Array) -> Array:
    """Integral of H dPhi((u - median)/dispersion) from start to stop of every piece: (curve, piece) of (…, piece)."""
    integrals = np.empty((median.size, pieces.stop.size))
    laws = pieces.reference, pieces.log_rate, pieces.slope, pieces.curvature
    engine.normal_integrals(start, stop, *laws, median, dispersion, integrals)
    return integrals


def _times(probability: Array, rate: Array) -> Array:
    """Return probability times rate; 0 if the probability is 0, even for an infinite rate."""
    return np.where(probability == 0.0, 0.0, probability * rate)


def _some_parts(curves: LognormalCurves, hazard: Pieces, which: Flags, whole: Array) -> Array:
    """Return the sum of `_parts` over some pieces, (curve,); whole: the integrals of H dP over all of them."""
    return np.asarray(_by_parts(curves, hazard.some(which), whole[:, which]).sum(axis=1))


def _parts(curves: LognormalCurves, pieces: Pieces) -> Array:
    """Return the integral of P (-dH) over each piece, (curve, piece), by parts: exact to rounding of the whole rate."""
    return _by_parts(curves, pieces, _stieltjes(curves, pieces))


def _by_parts(curves: LognormalCurves, pieces: Pieces, whole: Array) -> Array:
    """Return the integral of P (-dH) over each piece from the integral of H dP, (curve, piece)."""
    step = _step(curves)[:, None]
    values = []
    for end in (np.maximum(pieces.start, step), np.maximum(pieces.stop, step)):
        # P is 0 at -inf, H at +inf
        finite = np.where(np.isinf(end), 0.0, end)
        both = _times(curves.probability(finite), exp(pieces.log_at(slice(None), finite)))
        values.append(np.where(np.isinf(end), 0.0, both))
    integrals = values[0] - values[1] + whole
    level = (pieces.slope == 0.0) & (pieces.curvature == 0.0)
    return np.where(level & ~np.isnan(integrals), 0.0, integrals)


def _tabulated_rates(curves: TabulatedCurves, hazard: Pieces, outside: str) -> Array:
    """Return rates and both shares, (3, curve), of curves with the same levels."""
    pieces = hazard.split(curves.log_levels + curves.shift[0])
    by_rule = []
    for rule in (LEAST, MOST) if outside == REFUSE else (outside,):
        parts = _tabulated_parts(curves, pieces, rule)
        held = _held(curves, hazard, rule) if hazard.above == HOLD else np.zeros(parts.shape[0])
        below = parts[:, pieces.stop <= hazard.first].sum(axis=1)
        above = parts[:, pieces.start >= hazard.last].sum(axis=1) + held
        by_rule.append(_with_shares(parts.sum(axis=1) + held, below, above))
    least, most = by_rule[0][0], by_rule[-1][0]
    # (the comparison is False for NaN)
    differ = most - least > SAME * least
    if differ.any():
        at = int(np.argmax(differ))
        low, high = exp(curves.log_levels[[0, -1]] + curves.shift[0])
        raise ValueError(
            f"a curve known from {low:g} to {high:g} only, with P from {curves.values[at, 0]:g} to "
            f"{curves.values[at, -1]:g}, bounds its rate by {least[at]:.3g} and {most[at]:.3g} per year: give "
            "outside='least' or 'most'"
        )
    return by_rule[0]


def _tabulated_parts(curves: TabulatedCurves, pieces: Pieces, outside: str) -> Array:
    """Return the integral of P (-dH) over each piece, (curve, piece), with P linear in u: no term is negative."""
    levels = curves.log_levels + curves.shift[0]
    at = np.searchsorted(levels, pieces.stop, side="left") - 1
    low, high = at < 0, at >= levels.size - 1
    at = np.clip(at, 0, levels.size - 2)
    ends = []
    for end in (pieces.start, pieces.stop):
        along = np.where(low | high, 0.0, (end - levels[at]) / (levels[at + 1] - levels[at]))
        value = curves.values[:, at] * (1.0 - along) + curves.values[:, at + 1] * along
        value = np.where(low, curves.values[:, :1] if outside == MOST else 0.0 * curves.values[:, :1], value)
        top = curves.values[:, -1:]
        ends.append(np.where(high, np.where(np.isnan(top), np.nan, 1.0) if outside == MOST else top, value))
    log_start = np.where(
        np.isneginf(pieces.start) & (pieces.slope > 0.0), np.inf, pieces.log_at(slice(None), pieces.start)
    )
    log_stop = pieces.log_at(slice(None), pieces.stop)
    first, last = exp(log_start), exp(log_stop)
    events_there = np.where(first == last, 0.0, -first * expm1(log_stop - log_start))
    events_there = np.where(np.isposinf(first), np.inf, events_there)
    return _times(ends[0], events_there) + _times(ends[1] - ends[0], _mean_rate(pieces) - last)


def _mean_rate(pieces: Pieces) -> Array:
    """Return the mean of H over the width of each piece, (piece,); NaN if the width is infinite."""
    width = pieces.stop - pieces.start
    first = exp(pieces.log_at(slice(None), pieces.start))
    slopes = [pieces.slope_at(slice(None), end) for end in (pieces.start, pieces.stop)]
    straight = first * scipy.special.exprel(-slopes[0] * width)
    root = np.sqrt(np.where(pieces.curvature > 0.0, pieces.curvature, 1.0))
    halves = [0.5 * np.sqrt(np.pi) / root * scipy.special.erfcx(0.5 * slope / root) for slope in slopes]
    fall = slopes[0] * width + pieces.curvature * width**2
    bent = first * (halves[0] - exp(-fall) * halves[1]) / width
    return np.where(pieces.curvature == 0.0, straight, bent)
