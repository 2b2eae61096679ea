"""Sets of kits, at most one for the pieces of a line: the best for a budget, and the cheapest that meets targets."""

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ...core.aliases import Array, Flags
from ..buildings.pieces import pieces_of
from ..buildings.recommendations import DUTY, YEARS
from ..money.budget import SAME, best_set, cheapest_set
from ..money.present_value import present_value

FALLS, FRONT_FALLS, INJURIES, LOSS = "falls", "front_falls", "injuries", "loss"
TARGETS = (FALLS, FRONT_FALLS, INJURIES, LOSS)
"""Amounts that can be limited: expected falls, forward falls, injured persons, and loss."""


class KitSet(NamedTuple):
    """The kit of every item ('' for none), their cost, gap, expected amounts of `TARGETS`, and flags if met."""

    kits: NDArray[np.object_]
    cost: float
    gap: float
    amounts: dict[str, float]
    met: bool = True


class _Options:
    """Options under one law: each is a kit that has a cost, for all pieces of an item that it fits."""

    def __init__(self, results: xr.Dataset, model: int) -> None:
        self.here = results.isel(model=model).transpose("kit", "block", ...)
        fits = self.here["kit_fits"].values.astype(bool)
        cost = self.here["kit_cost"].values
        self.kit, self.item = np.nonzero(fits & np.isfinite(cost)[:, None])
        self.count = results["count"].values.astype(float)
        self.costs: Array = cost[self.kit] * self.count[self.item]
        self.names = self.here["kit"].values
        self.strengths: Array = self.here["kit_strength"].values

    def saved(self, name: str) -> Array:
        """Return the saving of each option in an amount, for all pieces of its item (option,)."""
        falls = self.here["kit_front_falls_saved" if name == FRONT_FALLS else "kit_falls_saved"].values
        return np.asarray(falls[self.kit, self.item] * self.weights(name)[self.item])

    def surely_saved(self, name: str) -> Array:
        """Return the saving of each option in an amount, 0 if the interval of the saving does not exclude 0."""
        saved = self.saved(name)
        lower = self.here[f"kit_{'front_' if name == FRONT_FALLS else ''}falls_saved_lower"].values
        return np.where((saved > 0.0) & (lower[self.kit, self.item] <= 0.0), 0.0, saved)

    def now(self, name: str) -> float:
        """Return the amount of all items as they are."""
        yearly = "rate" in self.here
        if yearly:
            falls = self.here["front_rate" if name == FRONT_FALLS else "rate"].values
        else:
            level = self.here.sel(level=float(self.here.attrs["at_level"]))
            falls = level["front_probability" if name == FRONT_FALLS else "probability"].values
        return math.fsum(falls * self.weights(name))

    def weights(self, name: str) -> Array:
        """Return the contribution of a rate of falls of one piece of each item to an amount (item,)."""
        if name == LOSS:
            return np.asarray(self.count * self.here["value"].values)
        if name == INJURIES:
            if "persons_exposed" not in self.here.coords:
                return np.zeros(self.count.size)
            persons = self.here["persons_exposed"].values * self.here["injury_probability"].values
            return np.asarray(self.count * np.nan_to_num(persons))
        return self.count

    def set_of(self, chosen: Flags | None, gap: float) -> KitSet:
        """Return the chosen options as a kit for each item; None: there is no set."""
        kits = np.full(self.count.size, "", dtype=object)
        taken = np.zeros(self.costs.size, bool) if chosen is None else chosen
        kits[self.item[taken]] = self.names[self.kit[taken]]
        amounts = {name: self.now(name) - math.fsum(self.saved(name)[taken]) for name in TARGETS}
        return KitSet(kits, math.fsum(self.costs[taken]), gap, amounts, chosen is not None)


def budget_kits(results: xr.Dataset, budget: float, model: int = 0) -> KitSet:
    """Choose kits for a sum of money under one law, one a line: the code's, then safety, then savings in 50 years."""
    options = _Options(results, model)
    named = {piece.item: piece for piece in pieces_of(results, model)}
    pieces = [named[str(item)] for item in results["block"].values]
    of_options = [pieces[i] for i in options.item]
    duty = np.array([piece.recommendation == DUTY for piece in of_options], bool)
    safe = np.array([piece.safety for piece in of_options], bool)
    judged = np.array([piece.judged for piece in of_options], bool)
    falls = np.where(judged, np.maximum(options.surely_saved(FALLS), 0.0), 0.0)
    gain = falls
    if (options.weights(LOSS) > 0.0).any():
        gain = np.where(judged, np.maximum(options.surely_saved(LOSS), 0.0), 0.0)
        if "rate" in results:
            factor = present_value(pieces[0].discount, YEARS)
            gain = np.maximum(factor * gain - options.costs, 0.0)
    demand = np.array([math.nan if piece.code is None else piece.code.demand for piece in of_options])
    strong = ~(options.strengths[options.kit] < demand)  # (a demand that is not known is none)
    goals = [
        np.where(duty & strong, options.count[options.item], 0.0),
        np.where(safe, falls, 0.0),
        np.where(duty & ~safe, falls, 0.0),
        np.where(safe | duty, 0.0, gain),
    ]
    best = best_set(options.costs, budget, goals, options.item)
    needs = [(goal, math.fsum(goal[best.chosen]) - SAME * float(goal.sum())) for goal in goals]
    cheapest = cheapest_set(options.costs, needs, options.item)
    chosen = best.chosen if cheapest.chosen is None else cheapest.chosen
    return options.set_of(chosen, max(*best.gaps, cheapest.gap))


def target_kits(results: xr.Dataset, targets: Mapping[str, float], model: int = 0) -> KitSet:
    """Choose the cheapest kits that meet `targets`; a kit whose interval of saved falls contains 0 saves none."""
    options = _Options(results, model)
    needs = [(options.surely_saved(name), options.now(name) - most) for name, most in targets.items()]
    cheapest = cheapest_set(options.costs, needs, options.item)
    return options.set_of(cheapest.chosen, cheapest.gap)
