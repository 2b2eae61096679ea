"""Joint outcomes in a building, motion by motion: number and loss of the overturned pieces in each place, and events.

Flags of all lines are processed slab by slab, lines in their order, and only sums over lines are kept.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from ...aliases import Array, Flags, Index
from ...fragility.numerics.slabs import Allocator, in_memory, slabs
from ...fragility.numerics.totals import chances, chances_of_any, chances_of_none, expected_totals, totals
from ...fragility.uncertainty.joint import Variability
from ...units import DIMENSIONLESS
from .contents import Inventory

MOST_THRESHOLDS = 60
ANY = "any"
"""The event that at least one piece overturns, whatever its consequences."""


class Quantity(NamedTuple):
    """An amount that overturns: its name, the amount of each piece (item,), its unit, long name and thresholds."""

    name: str
    amounts: Array
    units: str
    text: str
    thresholds: Array
    strictly: bool

    @property
    def bound(self) -> str:
        """The phrase for exceedance: at least the threshold, or more than it."""
        return f"{'more than' if self.strictly else 'at least'} the threshold of {self.text}"


class Event(NamedTuple):
    """An event that happens when any piece of a set overturns: sets (…, item), `dims` are the dimensions of …"""

    name: str
    sets: Flags
    dims: tuple[str, ...]
    text: str


class JointOutcomes(NamedTuple):
    """Joint outcomes in each place, motion by motion, by the names of quantities and events.

    expected (model, place, level, motion): expectation given the motion; outcomes (…, realisation): each realisation;
    happens (model, set …, level, motion): probability of an event given the motion.
    """

    expected: dict[str, Array]
    outcomes: dict[str, Array]
    happens: dict[str, Array]


@dataclass(frozen=True)
class JointFlags:
    """Flags (model, item, variant, level, motion) of an inventory, and the places of its items.

    members (place, item): True where an item belongs to a place; losses: thresholds of the loss, empty where nothing
    has a value; array: allocates the arrays of every motion.
    """

    inventory: Inventory
    flags: Flags
    members: Flags
    losses: Array
    variability: Variability | None
    array: Allocator = in_memory

    @cached_property
    def counts(self) -> Index:
        """Number of pieces (item,)."""
        return np.array([row.count for row in self.inventory.rows])

    @cached_property
    def standing(self) -> Flags:
        """True for items that are not anchored (item,)."""
        return np.array([not row.anchored for row in self.inventory.rows])

    @cached_property
    def numbers(self) -> Array:
        """Numbers of pieces at which exceedance is given: every number, or some 60 where there are more."""
        pieces = self.inventory.pieces
        if pieces <= MOST_THRESHOLDS:
            return np.arange(1.0, pieces + 1.0)
        return np.unique(np.rint(np.geomspace(1.0, pieces, MOST_THRESHOLDS)))

    @property
    def quantities(self) -> list[Quantity]:
        """The number of pieces and, where something has a value, the loss."""
        ones = np.ones(len(self.inventory))
        found = [Quantity("number", ones, DIMENSIONLESS, "pieces overturned", self.numbers, False)]
        if self.losses.size:
            values = np.array([row.value for row in self.inventory.rows])
            units = self.inventory.currency or DIMENSIONLESS
            found.append(Quantity("loss", values, units, "value overturned", self.losses, True))
        return found

    @property
    def events(self) -> list[Event]:
        """The event that anything overturns and, where there are consequences, the event of each."""
        found = [Event(ANY, self.members, ("place",), "at least one piece overturns")]
        words = self.inventory.consequences
        if words:
            has = np.array([[word in row.consequences for row in self.inventory.rows] for word in words])
            sets = self.members[:, None, :] & has
            text = "at least one piece with the consequence overturns"
            found.append(Event("consequence", sets, ("place", "consequence"), text))
        return found

    def possible(self, event: Event) -> Flags:
        """Return True where any standing piece can cause an event, shape (…) of its sets."""
        return np.asarray(np.any(event.sets & self.standing, axis=-1))

    def chances(self) -> Iterator[tuple[slice, slice, Array]]:
        """Yield slabs of P(a piece overturns | motion) (model, item, level, motion), with their bounds."""
        for of, rows, flags in self._slabs():
            yield of, rows, chances(flags)

    @cached_property
    def results(self) -> JointOutcomes:
        """The joint outcomes, given the motion."""
        models, items, _, *shaken = self.flags.shape
        independent = self.variability is not None and self.variability.pieces == "independent"
        if self.variability is None:
            draws = [np.array([[row.count]]) for row in self.inventory.rows]
        else:
            draws = [self.variability.draws(row.label, row.count) for row in self.inventory.rows]
        quantities, events = self.quantities, self.events
        of_places = (models, self.members.shape[0], *shaken)
        found = JointOutcomes(
            {one.name: self._filled(of_places, 0.0) for one in quantities},
            {one.name: self._filled((*of_places, draws[0].shape[0]), 0.0) for one in quantities},
            {one.name: self._filled((models, *one.sets.shape[:-1], *shaken), 1.0) for one in events},
        )
        for of, rows, flags in self._slabs():
            chance = chances(flags)
            members, counts = self.members[:, rows], self.counts[rows]
            for one in quantities:
                amounts = one.amounts[rows]
                expected_totals(chance, amounts * counts, members, found.expected[one.name][of])
                totals(flags, draws[rows], amounts, members, found.outcomes[one.name][of])
            any_piece = chances_of_any(chance, counts, independent)
            for event in events:
                none = found.happens[event.name][of]
                sets = event.sets.reshape(-1, items)[:, rows]
                chances_of_none(any_piece, sets, none.reshape(none.shape[0], -1, *shaken))
        for none in found.happens.values():
            np.subtract(1.0, none, out=none)
        return found

    def _slabs(self) -> Iterator[tuple[slice, slice, Flags]]:
        """Yield slabs of the flags with their bounds, lines in their order."""
        sizes = dict(zip(("model", "item", "variant", "level", "motion"), self.flags.shape, strict=True))
        for where in slabs(sizes, ("model", "item")):
            of, rows = where.get("model", slice(None)), where.get("item", slice(None))
            yield of, rows, self.flags[of, rows]

    def _filled(self, shape: tuple[int, ...], value: float) -> Array:
        found = self.array(shape, np.float64)
        found[...] = value
        return found
