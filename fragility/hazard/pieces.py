"""A hazard curve as pieces over all intensities, with its tails: on each piece ln H is a parabola of ln x."""

from __future__ import annotations

from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...core import checks
from ...core.elementary import Array, Flags, exp

EXTEND: Final = "extend"
NONE: Final = "none"
HOLD: Final = "hold"
BELOW_RULES = (EXTEND, NONE)
ABOVE_RULES = (EXTEND, NONE, HOLD)


class Pieces(NamedTuple):
    """Adjoining pieces of a hazard curve, from -inf on: arrays (piece,) in u = ln x.

    The piece is ln H(u) = log_rate - slope (u - reference) - curvature (u - reference)² from `start` to `stop`. The
    first piece reaches down to u = -inf. The last one reaches up to +inf if the curve is extended, else to the highest
    level, beyond which H is 0. `first` and `last` are the lowest and the highest level, `log_last` is ln H at the
    latter, `above` is the rule for the tail above it.
    """

    start: Array
    stop: Array
    reference: Array
    log_rate: Array
    slope: Array
    curvature: Array
    first: float
    last: float
    log_last: float
    above: str

    def log_at(self, piece: NDArray[np.intp] | slice, u: Array) -> Array:
        """Return ln H at u by the law of the given piece."""
        slope, bend = self.slope[piece], self.curvature[piece]
        distance = u - self.reference[piece]
        with np.errstate(invalid="ignore"):
            # at the end of an infinite piece, 0 times infinity is 0
            slant = slope + np.where(bend == 0.0, 0.0, bend * distance)
            return np.asarray(self.log_rate[piece] - np.where(slant == 0.0, 0.0, slant * distance))

    def slope_at(self, piece: NDArray[np.intp] | slice, u: Array) -> Array:
        """Return -d ln H/du at u by the law of the given piece."""
        bend = self.curvature[piece]
        with np.errstate(invalid="ignore"):
            return self.slope[piece] + np.where(bend == 0.0, 0.0, 2.0 * bend * (u - self.reference[piece]))

    def find(self, u: Array) -> NDArray[np.intp]:
        """Return the piece that contains each u: the left of two that share an end, the last piece beyond the top."""
        return np.minimum(np.searchsorted(self.stop, u, side="left"), self.stop.size - 1)

    def rate(self, u: Array) -> Array:
        """Return H at u, of any shape."""
        piece = self.find(u)
        rates = exp(self.log_at(piece, u))
        return np.where(u <= self.stop[-1], rates, np.where(np.isnan(u), np.nan, 0.0))

    def some(self, which: Flags) -> Pieces:
        """Return some of the pieces."""
        return self._taken(which, self.start[which], self.stop[which])

    def split(self, points: Array) -> Pieces:
        """Return the same curve with its pieces split at all `points`."""
        inner = points[(points < self.stop[-1]) & np.isfinite(points)]
        stop = np.unique(np.concatenate([self.stop, inner]))
        return self._taken(self.find(stop), np.concatenate([[-np.inf], stop[:-1]]), stop)

    def _taken(self, which: NDArray[Any], start: Array, stop: Array) -> Pieces:
        """Return pieces between other ends, with the laws of the given pieces."""
        return Pieces._make([start, stop, *(law[which] for law in self[2:6]), *self[6:]])


def segment_slopes(log_levels: Array, log_rates: Array, curvature: float) -> Array:
    """Return -d ln(rate)/d ln(level) at the beginning of every segment between points."""
    width = np.diff(log_levels)
    return -np.diff(log_rates) / width - curvature * width


def pieces_of(
    log_levels: Array, log_rates: Array, curvature: float = 0.0, below: str = EXTEND, above: str = EXTEND
) -> Pieces:
    """Return the pieces of a curve through points (level,), with increasing ln levels and ln rates that never rise.

    `curvature` is k2 >= 0 of ln H + k2 u², which is linear between points. Below the lowest level the first piece is
    extended (to its summit if it has a curvature), or no events count ("none"). Above the highest level there are three
    rules. The last piece is extended; or the events there do not count ("none"); or they count as if they just reached
    the highest level ("hold"). H itself is 0 above the highest level under both of the last two rules.
    """
    checks.choice("below", below, BELOW_RULES)
    checks.choice("above", above, ABOVE_RULES)
    width = np.diff(log_levels)
    # rounding can make the slope of a level segment negative
    slope = np.maximum(segment_slopes(log_levels, log_rates, curvature), 0.0)
    bend = np.full(slope.size, curvature)
    start, stop, reference, log_rate = log_levels[:-1], log_levels[1:], log_levels[:-1], log_rates[:-1]
    first, last = float(log_levels[0]), float(log_levels[-1])
    summit = first
    if below == EXTEND and slope[0] > 0.0:
        summit = first - 0.5 * slope[0] / curvature if curvature > 0.0 else -np.inf
    if summit < first:
        start, stop = np.r_[summit, start], np.r_[first, stop]
        reference, log_rate, slope, bend = (np.r_[array[0], array] for array in (reference, log_rate, slope, bend))
    if np.isfinite(summit):
        # level from the summit, or from the lowest level, downwards
        top = log_rate[0] - (summit - first) * (slope[0] + curvature * (summit - first))
        start, stop, reference = np.r_[-np.inf, start], np.r_[summit, stop], np.r_[summit, reference]
        log_rate, slope, bend = np.r_[top, log_rate], np.r_[0.0, slope], np.r_[0.0, bend]
    if above == EXTEND:
        final = slope[-1] + 2.0 * curvature * width[-1]
        if final <= 0.0:
            raise ValueError(
                f"a hazard curve whose last two rates are equal ({exp(log_rates[-1]):g} per year) cannot be "
                "extended above its highest level: give above='hold' or 'none', or drop that level"
            )
        start, stop, reference = np.r_[start, last], np.r_[stop, np.inf], np.r_[reference, last]
        log_rate, slope, bend = np.r_[log_rate, log_rates[-1]], np.r_[slope, final], np.r_[bend, curvature]
    return Pieces(start, stop, reference, log_rate, slope, bend, first, last, float(log_rates[-1]), above)
