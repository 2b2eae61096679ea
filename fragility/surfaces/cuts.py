"""Cuts of a region in two: the plane at which a surface jumps, from the runs alone.

A law may treat blocks on both sides of some size differently, which no polynomial follows. Two polynomials do, one on
each side, and the likelihood gives the place of their border.
"""

import math

import numpy as np
import scipy

from ...core.elementary import Array, exp, times
from .surface import RUNS_A_TERM, Cut, Pool, Surface, added_terms, cut_score, fit_surface, number_of_terms

SHARES = np.linspace(0.1, 0.9, 9)
"""Shares of the runs on the near side of the cuts that are tried first, for each variable."""
SEARCHED = 20_000
"""Runs, about, by which the first place is chosen."""
CONFIDENCE = 0.99
"""Of the places that the runs allow."""
HELD = 2.0
"""Factor between the fall of the likelihood with fixed coefficients and with the likeliest coefficients. Without it, 9
% of the places were outside with few runs for the size of a jump.
"""
LIKELY = 1e-3
"""Probability, of the best of all cuts that are tried, below which a jump is not there by chance."""
PROMISING = 1000.0
"""Times `LIKELY`: probability at the best of the first places beyond which the place itself is not searched."""
ROUNDS = 20


def find_cut(runs: Pool, normals: Array, degrees: tuple[int, int], start: Surface) -> Surface | None:
    """Return the likeliest surface that jumps at a plane across one of the normals (plane, axis), None if by chance.

    From the likeliest of nine places a variable, by Rao's score of the jump there, place and coefficients are found in
    turns. Wald's test of the jump of ln median with the motions as clusters, times the number of places that were tried
    (Bonferroni).
    """
    smooth = fit_surface(runs, degrees, start)
    if smooth is None:
        return None
    some = runs.some(np.arange(runs.x.size) % max(1, runs.x.size // SEARCHED) == 0)
    tried = [
        Cut(normal, place, place, place)
        for normal in normals
        for place in np.quantile(times(some.points, normal), SHARES).tolist()
    ]
    best = max(tried, key=lambda cut: cut_score(some, smooth, cut))
    jumping = fit_surface(runs, degrees, smooth, best)
    if jumping is None or added_terms(smooth, jumping) * len(tried) > PROMISING * LIKELY:
        return None
    jumping = settled(jumping, runs)
    return None if jumping is None or added_terms(smooth, jumping) * len(tried) > LIKELY else jumping


def settled(surface: Surface | None, runs: Pool) -> Surface | None:
    """Return a surface with its cut at the likeliest place; None if one side has too few runs, or of None."""
    best = surface
    for _ in range(ROUNDS):
        if best is None or best.cut is None:
            return best
        cut = placed(best, runs)
        if cut is None:
            return None
        if cut.place == best.cut.place:
            return best._replace(cut=cut)
        best = fit_surface(runs, best.degrees, best, cut)
    return best


def placed(surface: Surface, runs: Pool) -> Cut | None:
    """Return the cut of a surface at the likeliest place, and the places that the runs allow.

    None if fewer runs lie on one side than determine a jump. With the coefficients as they are, the ln likelihood of
    all places is a sum along the normal. Twice its fall from the maximum is compared with the distribution of Hansen
    (2000), (1 - exp(-c/2))². Hansen's likelihood is maximised in the coefficients at every place: a larger fall is
    allowed here. Hansen, B. E. (2000). Sample splitting and threshold estimation. Econometrica 68, 575-603.
    """
    cut = surface.cut
    assert cut is not None
    along = cut.along(runs.points)
    gain = _log_likelihoods(surface.on_side(False), runs) - _log_likelihoods(surface.on_side(True), runs)
    values, block = np.unique(along, return_inverse=True)
    counts = np.cumsum(np.bincount(block))[:-1]
    # (of a place between one value and the next)
    heights = np.cumsum(np.bincount(block, gain))[:-1]
    terms = number_of_terms(surface.variables, surface.degrees, cut) - number_of_terms(
        surface.variables, surface.degrees
    )
    # (a jump needs as many runs on either side as its terms do)
    enough = (counts >= RUNS_A_TERM * terms) & (counts <= runs.x.size - RUNS_A_TERM * terms)
    if not enough.any():
        return None
    heights = np.where(enough, heights, -np.inf)
    best = int(heights.argmax())
    fall = -math.log1p(-math.sqrt(CONFIDENCE))
    allowed = np.flatnonzero(heights >= heights[best] - HELD * fall)
    place = 0.5 * float(values[best] + values[best + 1])
    return cut._replace(place=place, low=float(values[allowed[0]]), high=float(values[allowed[-1] + 1]))


def log_likelihood(surface: Surface, runs: Pool) -> float:
    """Return the ln likelihood of runs."""
    return float(_log_likelihoods(surface, runs).sum())


def _log_likelihoods(surface: Surface, runs: Pool) -> Array:
    """Return the ln likelihood of each run."""
    middle = surface.log_medians(runs.points)
    spread = surface.log_dispersions(runs.points)
    z = (runs.x - middle) * exp(-spread)
    return np.asarray(scipy.special.log_ndtr(np.where(runs.fell, z, -z)))
