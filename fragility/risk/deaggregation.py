"""Deaggregation: the shares of the rate from bins of intensity, and mean and mode of the contributing intensity."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ...core import checks
from ...core.aliases import Array
from ..curves.curve import LEAST, REFUSE, CurveArrays
from ..hazard.curve import HazardCurve
from ..hazard.pieces import HOLD, Pieces
from .convolution import contributions
from .quadrature import event_integral, lower_end

FAR = 1e30
"""Factor to a level so rare that no share of a rate lies above it."""


class Deaggregation(NamedTuple):
    """Shares of the rate in each bin (curve, bin); mean and mode of the contributing intensity (curve,)."""

    share: Array
    mean: Array
    mode: Array


def bin_edges(bins: int | Any, hazard: HazardCurve) -> Array:
    """Return edges of bins of intensity (SI): those given, or bins of equal width in ln x over the hazard's levels."""
    if isinstance(bins, int | np.integer) and not isinstance(bins, bool):
        count = checks.count("bins", bins, at_least=1)
        return np.geomspace(hazard.levels[0], hazard.levels[-1], count + 1)
    edges = checks.finite_array("bins", bins)
    if edges.size < 2 or edges[0] <= 0.0 or np.any(np.diff(edges) <= 0.0):
        raise ValueError("bins must be a number of bins, or at least two edges > 0, strictly increasing")
    return edges


def share_above(curves: CurveArrays, rate: Array, hazard: Pieces, levels: Array, outside: str = REFUSE) -> Array:
    """Return the shares of rates (curve,) from above each curve's level (curve,); NaN where a rate is 0 or infinite."""
    curves = curves.flat()
    share = np.full(rate.shape, np.nan)
    sound = np.isfinite(rate) & (rate > 0.0)
    for level in np.unique(levels[sound]):
        rows = np.flatnonzero(sound & (levels == level))
        edges = np.log([level, FAR * level])
        share[rows] = contributions(curves.rows(rows), hazard, edges, outside)[:, 0] / rate[rows]
    return share


def deaggregate(curves: CurveArrays, rate: Array, hazard: Pieces, edges: Array, outside: str = REFUSE) -> Deaggregation:
    """Return the shares of the rates (curve,) in the bins between `edges` (edge,), and mean and mode of ln x.

    The mean is exact, over all intensities; the mode is the middle of the bin that holds most per unit of ln x.  Both
    are NaN where the rate is 0 or infinite.
    """
    curves = curves.flat()
    log_edges = np.log(edges)
    sound = np.isfinite(rate) & (rate > 0.0)
    safe = np.where(sound, rate, np.nan)[:, None]
    share = contributions(curves, hazard, log_edges, outside) / safe
    density = share / np.diff(log_edges)
    middle = np.sqrt(edges[:-1] * edges[1:])
    mode = np.where(sound, middle[np.argmax(np.nan_to_num(density), axis=1)], np.nan)
    rule = LEAST if outside == REFUSE else outside
    base = lower_end(curves, hazard, rule)
    moment = np.full(rate.shape, np.nan)
    rows = np.flatnonzero(sound)
    if rows.size:
        some, low = curves.rows(rows), base[rows]
        moment[rows] = event_integral(some, hazard, lambda u, row: np.maximum(u - low[row][:, None], 0.0), rule)
        if hazard.above == HOLD:
            held = some.probability(np.array([hazard.last]), rule)[:, 0] * np.exp(hazard.log_last)
            moment[rows] += held * np.maximum(hazard.last - low, 0.0)
    return Deaggregation(share, np.exp(base + moment / safe[:, 0]), mode)
