"""The best lines of an inventory to anchor for a given sum of money."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import Bounds, LinearConstraint, milp

from ... import checks
from ...aliases import Array

NODES = 20_000
"""Most nodes of the search: lists of some hundred lines end long before, larger ones within the gap that is said."""
SCALE = 1e6
"""Sum of all gains of a goal in the search, whose tolerance is a millionth."""
SAME = 1e-9
"""Part of what a goal has reached that a later one may cost by rounding."""


class Choice(NamedTuple):
    """The chosen lines, and by how much the best of all sets can be better, relative to it, at each goal."""

    chosen: NDArray[np.bool_]
    gaps: tuple[float, ...]


def best_set(costs: Array, budget: float, goals: Sequence[Array]) -> Choice:
    """Choose the lines whose cost is within the budget and that serve the first goal best, then the second, ….

    Parameters
    ----------
    costs : ndarray, shape (line,)
        Cost of each line, >= 0; lines with NaN are not chosen.
    budget : float
        Money that there is, >= 0.
    goals : sequence of ndarray, shape (line,)
        What each line adds to each goal, >= 0.

    Returns
    -------
    Choice

    Raises
    ------
    ValueError
        A budget that is negative or not finite; a cost or a gain that is negative, or a gain that is not finite; goals
        of another number of lines than the costs.

    Notes
    -----
    A knapsack problem for each goal, solved by branch and bound (scipy's HiGHS) with what the goals before gain as a
    further constraint: exact where the search ends, which the gap says (0).  A line that adds to no goal is not chosen.

    Examples
    --------
    >>> choice = best_set(np.array([6.0, 5.0, 5.0]), 10.0, [np.array([10.0, 6.0, 6.0])])
    >>> choice.chosen.tolist(), choice.gaps
    ([False, True, True], (0.0,))
    """
    checks.number("budget", budget, at_least=0.0)
    gains = [np.asarray(one, dtype=float) for one in goals]
    if any(one.shape != costs.shape for one in gains):
        shapes = ", ".join(str(one.shape) for one in gains)
        raise ValueError(f"goals must have a value for each of the costs, {costs.shape}, got {shapes}")
    if np.any(costs < 0.0):
        raise ValueError(f"costs must be >= 0, got {np.nanmin(costs):g}")
    if any(not np.all(np.isfinite(one) & (one >= 0.0)) for one in gains):
        raise ValueError("goals must be finite and >= 0")
    worth = np.any([one > 0.0 for one in gains], axis=0)
    open_ = np.flatnonzero(np.isfinite(costs) & (costs <= budget) & worth)
    chosen = np.zeros(costs.size, dtype=bool)
    free = open_[costs[open_] == 0.0]
    chosen[free] = True  # (nothing is saved by leaving them)
    open_ = open_[costs[open_] > 0.0]
    if not open_.size:
        return Choice(chosen, (0.0,) * len(gains))
    price = costs[open_]
    limits = [LinearConstraint(price[None], -np.inf, budget)]
    gaps: list[float] = []
    kept: list[tuple[Array, float]] = []
    taken = np.zeros(open_.size, dtype=bool)
    for gain in gains:
        here = gain[open_]
        whole = here.sum()
        if not whole > 0.0:
            gaps.append(0.0)
            continue
        found = milp(
            -SCALE * here / whole,
            integrality=np.ones(open_.size, dtype=np.int64),
            bounds=Bounds(0.0, 1.0),
            constraints=limits,
            options={"node_limit": NODES, "mip_rel_gap": 0.0},
        )
        if found.x is None:  # (the search stopped before it had any set that keeps the goals before)
            gaps.append(math.inf)
            break
        new = _affordable(found.x > 0.5, np.stack([one[open_] for one in gains]), price, budget)
        if any(math.fsum(goal[new]) < least * (1.0 - SAME) for goal, least in kept):
            gaps.append(math.inf)  # (rounding in the search would cost an earlier goal)
            break
        taken = new
        reached = math.fsum(here[taken])
        bound = reached if found.mip_dual_bound is None else max(-float(found.mip_dual_bound) * whole / SCALE, reached)
        over = bound - reached
        gaps.append(0.0 if over <= 1e-6 * reached or over <= SAME * whole else over / reached if reached else math.inf)
        limits.append(LinearConstraint(SCALE * here[None] / whole, SCALE * reached / whole, np.inf))
        kept.append((here, reached))
    chosen[open_[taken]] = True
    return Choice(chosen, (*gaps, *(math.inf,) * (len(gains) - len(gaps))))


def _affordable(taken: NDArray[np.bool_], gains: Array, price: Array, budget: float) -> NDArray[np.bool_]:
    """Return a set within the budget, which the solver keeps to within a millionth; what matters least goes first."""
    taken = taken.copy()
    while math.fsum(price[taken]) > budget * (1.0 + 1e-12):
        inside = np.flatnonzero(taken)
        taken[inside[np.lexsort(gains[::-1, inside])[0]]] = False
    return taken
