"""Choice of a set whose means and standard deviations are those asked for, among candidates: plain arrays.

Latin-hypercube draws from the target, the nearest candidate to each, and passes that exchange one at a time, as in
Baker and Lee (2018).  Every sum is taken in a fixed order, and of equals the first is taken: a choice depends on the
seed and on nothing else.
"""

import math
from typing import NamedTuple

import numpy as np
import scipy

from ...core.elementary import Array, Index, eigh, times

DRAWS = 20
RESTARTS = 5
PASSES = 10
SIGMA_WEIGHT, SKEWNESS_WEIGHT = 2.0, 0.3
"""Weights of squared differences of standard deviations and of skewness; means have weight 1."""


class Problem(NamedTuple):
    """Candidates and target of a choice.

    values (candidate, measure): logarithms minus the target's means; sigmas (measure,); weights (measure,); groups
    (candidate,): whole numbers; of a group at most `most` candidates are taken.
    """

    values: Array
    sigmas: Array
    weights: Array
    groups: Index
    most: int


def misfit(problem: Problem, chosen: Index) -> float:
    """Return J = sum of weight [mean² + 2 (sd - sigma)²] over the measures, of a set; sd with n - 1.

    A set of one has no standard deviation, and is judged by its mean.
    """
    some = problem.values[chosen]
    mean = some.mean(axis=0)
    off = mean**2
    if len(chosen) > 1:
        off = off + SIGMA_WEIGHT * (some.std(axis=0, ddof=1) - problem.sigmas) ** 2
    return float(times(problem.weights, off))


def choose(problem: Problem, covariance: Array, number: int, rng: np.random.Generator) -> Index:
    """Return the sorted indices (number,) of the candidates with the smallest misfit over `RESTARTS` starts.

    `covariance` (measure, measure) belongs to the target, with variances `sigmas` squared; the groups allow at least
    `number` candidates.
    """
    draws = [_draw(covariance, number, rng) for _ in range(DRAWS)]
    order = np.argsort([_roughness(draw, problem.sigmas) for draw in draws], kind="stable")
    best, least = np.empty(0, int), np.inf
    for i in order[:RESTARTS]:
        indices = improved(problem, nearest(problem, draws[i]))
        value = misfit(problem, indices)
        if value < least:
            best, least = indices, value
    return np.sort(best)


def _draw(covariance: Array, number: int, rng: np.random.Generator) -> Array:
    """Return a Latin hypercube of `number` points of N(0, covariance), shape (number, measure)."""
    m = covariance.shape[0]
    strata = np.stack([rng.permutation(number) for _ in range(m)], axis=1)
    normal = scipy.special.ndtri((strata + rng.random((number, m))) / number)
    values, vectors = eigh(covariance)
    return times(normal, (vectors * np.sqrt(np.maximum(values, 0.0))).T)


def _roughness(draw: Array, sigmas: Array) -> float:
    """Return the difference of the moments of a draw from the target's, whose means are zero."""
    mean, off = draw.mean(axis=0), draw - draw.mean(axis=0)
    spread = off.std(axis=0)
    size = np.where(spread > 1e-12, spread, np.inf)
    skewness = (off * off**2).mean(axis=0) / (size * size**2)
    terms = mean**2 + SIGMA_WEIGHT * (spread - sigmas) ** 2 + SKEWNESS_WEIGHT * skewness**2
    return float(terms.sum())


def nearest(problem: Problem, draw: Array) -> Index:
    """Return, for each point of a draw in its order, the nearest candidate that is left."""
    free = np.ones(len(problem.values), bool)
    taken = np.zeros(int(problem.groups.max()) + 1, int)
    indices = np.empty(len(draw), int)
    for i, point in enumerate(draw):
        distance = times((problem.values - point) ** 2, problem.weights)
        distance[~free | (taken[problem.groups] >= problem.most)] = np.inf
        indices[i] = distance.argmin()
        free[indices[i]] = False
        taken[problem.groups[indices[i]]] += 1
    return indices


def improved(problem: Problem, chosen: Index) -> Index:
    """Return a set whose misfit no exchange of one candidate for another lowers, or the set of the last pass.

    The misfit never increases.  Running sums of the values and their squares give the misfit of every exchange at once.
    """
    chosen = chosen.copy()
    values, squares, n = problem.values, problem.values**2, len(chosen)
    free = np.ones(len(values), bool)
    free[chosen] = False
    taken = np.bincount(problem.groups[chosen], minlength=int(problem.groups.max()) + 1)
    total, off, spread = (np.empty_like(values) for _ in range(3))
    # divisions by n and n - 1 are moved out of the loops into the weights and the target's sigmas
    root = math.sqrt(max(n - 1, 1))
    of_means, of_spreads = problem.weights / n**2, SIGMA_WEIGHT * problem.weights / root**2
    sigmas = problem.sigmas * root
    for _ in range(PASSES):
        changed = False
        for slot in range(n):
            present = chosen[slot]
            taken[problem.groups[present]] -= 1
            rest = chosen[np.arange(n) != slot]
            np.add(values, values[rest].sum(axis=0), out=total)
            np.multiply(total, total, out=off)
            cost = np.einsum("ij,j->i", off, of_means)
            if n > 1:
                off *= 1.0 / n
                np.add(squares, squares[rest].sum(axis=0), out=spread)
                spread -= off
                np.maximum(spread, 0.0, out=spread)
                np.sqrt(spread, out=spread)
                spread -= sigmas
                np.multiply(spread, spread, out=spread)
                cost += np.einsum("ij,j->i", spread, of_spreads)
            barred = ~free | (taken[problem.groups] >= problem.most)
            barred[present] = False
            cost[barred] = np.inf
            best = int(cost.argmin())
            if cost[best] < cost[present]:
                free[present], free[best] = True, False
                chosen[slot], changed = best, True
            taken[problem.groups[chosen[slot]]] += 1
        if not changed:
            break
    return chosen
