"""What falls together in a building, motion by motion: of each place the number, the loss and what it brings about.

Flags of all lines pass slab by slab, lines in their order; what is kept of them are sums over lines.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..fragility.joint import Variability
from ..fragility.slabs import Array, in_memory, slabs
from ..fragility.totals import chances, chances_of_any, chances_of_none, expected_totals, totals
from ..units import DIMENSIONLESS
from .contents import Inventory

Values = NDArray[np.float64]
Flags = NDArray[np.bool_]

MOST_THRESHOLDS = 60
ANY = "any"
"""The event that at least one piece overturns, whatever it means."""


class Quantity(NamedTuple):
    """An amount that overturns: its name, the amount a piece (item,), its unit, words, and thresholds of it."""

    name: str
    amounts: Values
    units: str
    text: str
    thresholds: Values
    strictly: bool

    @property
    def bound(self) -> str:
        """What its exceedance is: of the threshold, or of more."""
        return f"{'more than' if self.strictly else 'at least'} the threshold of {self.text}"


class Event(NamedTuple):
    """Something that happens when any piece of a set overturns: sets (…, item) with the dimensions of …"""

    name: str
    sets: Flags
    dims: tuple[str, ...]
    text: str


class Together(NamedTuple):
    """What falls in each place, motion by motion, by the names of quantities and events.

    expected (model, place, level, motion): expectation given the motion; outcomes (…, realisation): one by one; happens
    (model, set …, level, motion): chance given the motion.
    """

    expected: dict[str, Values]
    outcomes: dict[str, Values]
    happens: dict[str, Values]


@dataclass(frozen=True)
class Joint:
    """What fell together: flags (model, item, variant, level, motion) of an inventory, and who stands where.

    members (place, item); losses: thresholds of the loss, none where nothing has a value; array: where is kept what is
    of every motion.
    """

    inventory: Inventory
    flags: Flags
    members: Flags
    losses: Values
    variability: Variability | None
    array: Array = in_memory

    @cached_property
    def counts(self) -> NDArray[np.int64]:
        """Pieces (item,)."""
        return np.array([row.count for row in self.inventory.rows])

    @cached_property
    def standing(self) -> Flags:
        """What is not anchored (item,)."""
        return np.array([not row.anchored for row in self.inventory.rows])

    @cached_property
    def numbers(self) -> Values:
        """Numbers of pieces at which exceedance is given: each, or some 60 of them where there are more."""
        pieces = self.inventory.pieces
        if pieces <= MOST_THRESHOLDS:
            return np.arange(1.0, pieces + 1.0)
        return np.unique(np.rint(np.geomspace(1.0, pieces, MOST_THRESHOLDS)))

    @property
    def quantities(self) -> list[Quantity]:
        """The number and, where something has a value, the loss."""
        ones = np.ones(len(self.inventory))
        found = [Quantity("number", ones, DIMENSIONLESS, "pieces overturned", self.numbers, False)]
        if self.losses.size:
            values = np.array([row.value for row in self.inventory.rows])
            units = self.inventory.currency or DIMENSIONLESS
            found.append(Quantity("loss", values, units, "value overturned", self.losses, True))
        return found

    @property
    def events(self) -> list[Event]:
        """That anything overturns and, where something has consequences, each of these."""
        found = [Event(ANY, self.members, ("place",), "at least one piece overturns")]
        words = self.inventory.consequences
        if words:
            has = np.array([[word in row.consequences for row in self.inventory.rows] for word in words])
            sets = self.members[:, None, :] & has
            text = "at least one piece with the consequence overturns"
            found.append(Event("consequence", sets, ("place", "consequence"), text))
        return found

    def possible(self, event: Event) -> Flags:
        """Whether there is anything that can bring an event about, shape (…) of its sets."""
        return np.asarray(np.any(event.sets & self.standing, axis=-1))

    def chances(self) -> Iterator[tuple[slice, slice, Values]]:
        """That a piece overturns, given the motion (model, item, level, motion): slab by slab, with its bounds."""
        for of, rows, flags in self._slabs():
            yield of, rows, chances(flags)

    @cached_property
    def together(self) -> Together:
        """What falls of each set, given the motion."""
        models, items, _, *shaken = self.flags.shape
        independent = self.variability is not None and self.variability.pieces == "independent"
        if self.variability is None:
            draws = [np.array([[row.count]]) for row in self.inventory.rows]
        else:
            draws = [self.variability.draws(row.label, row.count) for row in self.inventory.rows]
        quantities, events = self.quantities, self.events
        of_places = (models, self.members.shape[0], *shaken)
        found = Together(
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
        """Flags of some lines under some laws, lines in their order."""
        sizes = dict(zip(("model", "item", "variant", "level", "motion"), self.flags.shape, strict=True))
        for where in slabs(sizes, ("model", "item")):
            of, rows = where.get("model", slice(None)), where.get("item", slice(None))
            yield of, rows, self.flags[of, rows]

    def _filled(self, shape: tuple[int, ...], value: float) -> Values:
        found = self.array(shape, np.float64)
        found[...] = value
        return found
