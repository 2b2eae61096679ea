"""The best lines of an inventory to anchor for a given sum of money, and the cheapest that reach a target."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from ...core import checks
from ...core.aliases import Array, Index

NODES = 20_000
"""Maximum number of nodes of the search: lists of some hundred lines end long before, larger lists within the stated
gap.
"""
SCALE = 1e6
"""Sum of all gains of a goal in the search, whose tolerance is a millionth."""
INFEASIBLE = 2
"""Status of a search in which no set meets all limits."""
SAME = 1e-9
"""Part of a goal's value that a later goal may cost by rounding."""


class Choice(NamedTuple):
    """The chosen lines, and the possible relative improvement by the best of all sets, at each goal."""

    chosen: NDArray[np.bool_]
    gaps: tuple[float, ...]


def best_set(costs: Array, budget: float, goals: Sequence[Array], groups: Index | None = None) -> Choice:
    """Choose the lines whose cost is within the budget and that serve the first goal best, then the second, ….

    Costs (line,) and gains of each line for each goal (line,) are >= 0; lines with a cost of NaN are not chosen.
    `groups` (line,) are numbers of groups of which at most one line is chosen, such as the kits for one piece; each
    line by itself if not given. There is a knapsack problem for each goal, solved by branch and bound (scipy's HiGHS).
    The gains of previous goals are further constraints. It is exact if the search ends, which a gap of 0 shows. A line
    that adds to no goal is not chosen.
    """
    checks.number("budget", budget, at_least=0.0)
    gains = [np.asarray(goal, dtype=float) for goal in goals]
    if any(gain.shape != costs.shape for gain in gains):
        shapes = ", ".join(str(gain.shape) for gain in gains)
        raise ValueError(f"goals must have a value for each of the costs, {costs.shape}, got {shapes}")
    if np.any(costs < 0.0):
        raise ValueError(f"costs must be >= 0, got {np.nanmin(costs):g}")
    if any(not np.all(np.isfinite(gain) & (gain >= 0.0)) for gain in gains):
        raise ValueError("goals must be finite and >= 0")
    worth = np.any([gain > 0.0 for gain in gains], axis=0)
    open_ = np.flatnonzero(np.isfinite(costs) & (costs <= budget) & worth)
    chosen = np.zeros(costs.size, dtype=bool)
    if groups is None:
        free = open_[costs[open_] == 0.0]
        chosen[free] = True  # (nothing is saved by leaving them)
        open_ = open_[costs[open_] > 0.0]
    if not open_.size:
        return Choice(chosen, (0.0,) * len(gains))
    price = costs[open_]
    limits = [scipy.optimize.LinearConstraint(price[None], -np.inf, budget), *_one_of_each(groups, open_)]
    gaps: list[float] = []
    kept: list[tuple[Array, float]] = []
    taken = np.zeros(open_.size, dtype=bool)
    for gain in gains:
        gains_open = gain[open_]
        whole = gains_open.sum()
        if not whole > 0.0:
            gaps.append(0.0)
            continue
        solution = _search(-SCALE * gains_open / whole, limits)
        if solution.x is None:  # (the search stopped before it had any set that keeps the goals before)
            gaps.append(math.inf)
            break
        new = _affordable(solution.x > 0.5, np.stack([gain[open_] for gain in gains]), price, budget)
        if any(math.fsum(goal[new]) < least * (1.0 - SAME) for goal, least in kept):
            gaps.append(math.inf)  # (rounding in the search would cost an earlier goal)
            break
        taken = new
        reached = math.fsum(gains_open[taken])
        bound = (
            reached
            if solution.mip_dual_bound is None
            else max(-float(solution.mip_dual_bound) * whole / SCALE, reached)
        )
        over = bound - reached
        gaps.append(0.0 if over <= 1e-6 * reached or over <= SAME * whole else over / reached if reached else math.inf)
        limits.append(
            scipy.optimize.LinearConstraint(SCALE * gains_open[None] / whole, SCALE * reached / whole, np.inf)
        )
        kept.append((gains_open, reached))
    chosen[open_[taken]] = True
    return Choice(chosen, (*gaps, *(math.inf,) * (len(gains) - len(gaps))))


class Cheapest(NamedTuple):
    """The chosen lines, and the possible relative saving by a cheaper set; None: no set is enough."""

    chosen: NDArray[np.bool_] | None
    gap: float


def cheapest_set(costs: Array, needs: Sequence[tuple[Array, float]], groups: Index) -> Cheapest:
    """Choose the lines that cost the minimum and add the needed quantity to each of several amounts.

    Costs (line,) are >= 0; lines with NaN are not chosen. A need is each line's contribution to an amount (line,),
    which may be negative, and the needed quantity. At most one line of each of the `groups` (line,) is chosen. `chosen`
    is None if no set is enough; the gap is infinite if the search stopped before it had one. Branch and bound as in
    `best_set`, and exact in the same sense. A need is met to within a billionth of the sum of all amounts, for
    rounding.
    """
    if np.any(costs < 0.0):
        raise ValueError(f"costs must be >= 0, got {np.nanmin(costs):g}")
    if any(not (np.all(np.isfinite(amounts)) and math.isfinite(need)) for amounts, need in needs):
        raise ValueError("amounts and what is needed of them must be finite")
    chosen = np.zeros(costs.size, dtype=bool)
    if all(need <= 0.0 for _, need in needs):
        return Cheapest(chosen, 0.0)
    open_ = np.flatnonzero(np.isfinite(costs))
    limits = _one_of_each(groups, open_)
    for gain, need in needs:
        whole = float(np.abs(gain).sum()) or 1.0
        limits.append(
            scipy.optimize.LinearConstraint(SCALE * gain[None, open_] / whole, SCALE * (need / whole - SAME), np.inf)
        )
    price = costs[open_]
    dear = float(price.sum()) or 1.0
    if not open_.size:
        return Cheapest(None, 0.0)
    solution = _search(SCALE * price / dear, limits)
    if solution.x is None:
        return Cheapest(None, 0.0 if solution.status == INFEASIBLE else math.inf)
    taken = solution.x > 0.5
    chosen[open_[taken]] = True
    spent = math.fsum(price[taken])
    bound = spent if solution.mip_dual_bound is None else min(float(solution.mip_dual_bound) * dear / SCALE, spent)
    over = spent - bound
    return Cheapest(chosen, 0.0 if over <= SAME * dear else over / spent)


def _search(objective: Array, limits: Sequence[scipy.optimize.LinearConstraint]) -> Any:
    """Return the minimum of an objective of lines that are chosen or not, as found by HiGHS."""
    return scipy.optimize.milp(
        objective,
        integrality=np.ones(objective.size, dtype=np.int64),
        bounds=scipy.optimize.Bounds(0.0, 1.0),
        constraints=limits,
        options={"node_limit": NODES, "mip_rel_gap": 0.0},
    )


def _one_of_each(groups: Index | None, open_: Index) -> list[scipy.optimize.LinearConstraint]:
    """Return the limit of one line to each group, of the lines that can be chosen."""
    if groups is None:
        return []
    numbers, of_group = np.unique(groups[open_], return_inverse=True)
    rows = scipy.sparse.coo_array(
        (np.ones(open_.size), (of_group, np.arange(open_.size))), shape=(numbers.size, open_.size)
    )
    return [scipy.optimize.LinearConstraint(rows.tocsr(), -np.inf, 1.0)]


def _affordable(taken: NDArray[np.bool_], gains: Array, price: Array, budget: float) -> NDArray[np.bool_]:
    """Return a set within the budget, which the solver exceeds by up to a millionth, without the smallest gains."""
    taken = taken.copy()
    while math.fsum(price[taken]) > budget * (1.0 + 1e-12):
        inside = np.flatnonzero(taken)
        taken[inside[np.lexsort(gains[::-1, inside])[0]]] = False
    return taken
