"""Joint outcomes in a building by motion (overturning in each place, consequences, events), as sums over lines."""

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from ...core.elementary import Array, Flags, Index, geomspace, power, times
from ...core.units import DIMENSIONLESS
from ...fragility.numerics.slabs import RUNS, Allocator, in_memory, slabs
from ...fragility.numerics.totals import chances, chances_of_any, chances_of_none, expected_totals, fallen_pieces
from ...fragility.uncertainty.joint import INDEPENDENT, PieceDraws, drawn_pieces
from ..inventory.consequences import COLUMNS, Consequence, PieceScores, cell_edges, shares_above
from ..inventory.contents import Inventory

MOST_THRESHOLDS = 60
TAIL = 3.090232306167813
"""Normal score that one in a thousand exceeds, up to which thresholds reach."""
DAY = "day"
ANY = "any"
"""The event that at least one piece overturns, whatever its consequences."""


class Quantity(NamedTuple):
    """An amount that overturns: its name, the mean amount of each piece (item,), its unit, long name and thresholds.

    `drawn`: the consequence of `Contents` that is drawn for each piece, '' without one. `greatest`: of several pieces
    the largest amount counts, not the sum. `taken`: a piece also counts if its support falls.
    """

    name: str
    amounts: Array
    units: str
    text: str
    thresholds: Array
    strictly: bool
    drawn: str = ""
    greatest: bool = False
    taken: bool = False

    @property
    def bound(self) -> str:
        """The phrase for exceedance: at least the threshold, or more than it."""
        return f"{'more than' if self.strictly else 'at least'} the threshold of {self.text}"

    def running(self, values: Array) -> Array:
        """Return the amounts of no piece, the first one, the first two, … (piece + 1, realisation) of their values."""
        none = np.zeros((1, values.shape[1]))
        joined = np.maximum.accumulate(values) if self.greatest else np.cumsum(values, axis=0)
        return np.concatenate([none, joined])


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

    def complete(self, joint: "JointFlags", within: Callable[[Array, slice], Array]) -> None:
        """Make events' chances out of those that nothing happens, and the means of maxima (`add_longest`)."""
        for none in self.happens.values():
            np.subtract(1.0, none, out=none)
        for quantity in joint.quantities:
            if quantity.greatest:
                joint.add_longest(self.expected[quantity.name], within)


@dataclass(frozen=True)
class JointFlags:
    """Flags (model, item, variant, level, motion) of an inventory, and the places of its items.

    `members` (place, item): True if an item belongs to a place. `losses`: thresholds of the loss, empty if nothing has
    a value. `array`: allocates the arrays of every motion. `scores`: draws of the consequences of pieces. `polarities`:
    of each motion, which follow one another along motion and are separate outcomes with the same draws. `variability`:
    rules for drawing pieces from variants, None if they are alike. `edges`: True if flags include pieces that fell off
    an edge. `lost`: flags of pieces that fell or whose support did (`lost_flags`), None if no piece is on another.
    """

    inventory: Inventory
    flags: Flags
    members: Flags
    losses: Array
    variability: PieceDraws | None
    array: Allocator = in_memory
    scores: PieceScores = field(default_factory=PieceScores)
    polarities: int = 1
    edges: bool = False
    lost: Flags | None = None

    @cached_property
    def counts(self) -> Index:
        """Number of pieces (item,)."""
        return np.array([row.count for row in self.inventory.rows])

    @cached_property
    def standing(self) -> Flags:
        """True for items that are not anchored (item,)."""
        return np.array([not row.anchored for row in self.inventory.rows])

    @cached_property
    def exposed(self) -> Flags:
        """True for items that are not anchored, or are lost if their support falls (item,)."""
        return self.standing if self.lost is None else self.standing | self.lost.any(axis=(0, 2, 3, 4))

    @property
    def falls(self) -> str:
        """The verb of the flags, in the present."""
        return "overturns or falls off" if self.edges else "overturns"

    @property
    def fell(self) -> str:
        """The verb of the flags, in the past."""
        return "overturned or fallen off" if self.edges else "overturned"

    @property
    def _has_fallen(self) -> str:
        return "overturned or fell off" if self.edges else "overturned"

    @cached_property
    def numbers(self) -> Array:
        """Numbers of pieces at which exceedance is given: every number, or about 60 if there are more."""
        return whole_thresholds(self.inventory.pieces)

    @cached_property
    def quantities(self) -> list[Quantity]:
        """The number of pieces and, if lines give them, the loss, the downtime and the injured persons."""
        rows = self.inventory.rows
        quantities = [Quantity("number", np.ones(len(rows)), DIMENSIONLESS, f"pieces {self.fell}", self.numbers, False)]
        if self.losses.size:
            values = np.array([row.loss for row in rows])
            units = self.inventory.currency or DIMENSIONLESS
            spread = any(row.cost is not None for row in rows)
            text = f"cost of what {self._has_fallen}" if spread else f"value {self.fell}"
            drawn = "cost" if spread else ""
            quantities.append(Quantity("loss", values, units, text, self.losses, True, drawn, taken=True))
        days = np.array([0.0 if row.downtime is None else row.downtime.mean for row in rows])
        if days.any():
            thresholds = thresholds_up_to(max(upper_tail(row.downtime) for row in rows))
            text = f"longest downtime of what {self._has_fallen}"
            quantities.append(Quantity("downtime", days, DAY, text, thresholds, True, "downtime", greatest=True))
        persons = np.array([0.0 if row.injury is None else row.injury.mean for row in rows])
        if persons.any():
            mean = float(times(persons, self.counts))
            whole = whole_thresholds(math.ceil(mean + 4.0 * math.sqrt(mean)))
            quantities.append(Quantity("injuries", persons, DIMENSIONLESS, "injured persons", whole, False, "injury"))
        return quantities

    @property
    def events(self) -> list[Event]:
        """The event that anything overturns and, if there are consequences, the event of each."""
        events = [Event(ANY, self.members, ("place",), f"at least one piece {self.falls}")]
        words = self.inventory.consequences
        if words:
            has = np.array([[word in row.consequences for row in self.inventory.rows] for word in words])
            sets = self.members[:, None, :] & has
            text = f"at least one piece with the consequence {self.falls}"
            events.append(Event("consequence", sets, ("place", "consequence"), text))
        return events

    def possible(self, event: Event) -> Flags:
        """Return True if any standing piece can cause an event, shape (…) of its sets."""
        return np.asarray(np.any(event.sets & self.standing, axis=-1))

    def chances(self) -> Iterator[tuple[slice, slice, Array, Array]]:
        """Yield slabs of P(a piece overturns | motion), P(it is lost | motion), bounds (model, item, level, motion)."""
        sizes = dict(zip(("model", "block", "variant", "level", "motion"), self.flags.shape, strict=True))
        for where in slabs(sizes, ("model", "block")):
            of, rows = where.get("model", slice(None)), where.get("block", slice(None))
            chance = chances(self.flags[of, rows])
            yield of, rows, chance, chance if self.lost is None else chances(self.lost[of, rows])

    @cached_property
    def results(self) -> JointOutcomes:
        """The joint outcomes, given the motion."""
        models, items, _, *shaken = self.flags.shape
        independent = self.variability is not None and self.variability.pieces == INDEPENDENT
        quantities, events = self.quantities, self.events
        of_places = (models, self.members.shape[0], *shaken)
        joint = JointOutcomes(
            {quantity.name: self.filled(of_places, 0.0) for quantity in quantities},
            {quantity.name: self.filled((*of_places, self.realisations(quantity)), 0.0) for quantity in quantities},
            {event.name: self.filled((models, *event.sets.shape[:-1], *shaken), 1.0) for event in events},
        )
        for of, rows, chance, lost in self.chances():
            members, counts = self.members[:, rows], self.counts[rows]
            for quantity in quantities:
                if not quantity.greatest:
                    of_one = lost if quantity.taken else chance
                    expected_totals(of_one, quantity.amounts[rows] * counts, members, joint.expected[quantity.name][of])
            outcomes = {quantity.name: joint.outcomes[quantity.name][of] for quantity in quantities}
            for i in np.flatnonzero(lost.any(axis=(0, 2, 3))):
                self._add(range(items)[rows][i], of, outcomes)
            any_piece = chances_of_any(chance, counts, independent)
            for event in events:
                none = joint.happens[event.name][of]
                sets = event.sets.reshape(-1, items)[:, rows]
                chances_of_none(any_piece, sets, none.reshape(none.shape[0], -1, *shaken))
        joint.complete(self, self.within)
        return joint

    @cached_property
    def days(self) -> Array:
        """Edges of the cells of downtimes, over which the mean of the longest is summed."""
        return cell_edges(row.downtime for row in self.inventory.rows if row.downtime is not None)

    def within(self, edges: Array, cells: slice) -> Array:
        """Return P(no fallen piece is out of use for longer | motion) of cells (cell, model, place, level, motion).

        P(longer) of a piece is the mean over the cell.
        """
        models, items, _, *shaken = self.flags.shape
        independent = self.variability is not None and self.variability.pieces == INDEPENDENT
        none_longer = np.ones((edges[:-1][cells].size, models, len(self.members), *shaken))
        for of, rows, chance, _ in self.chances():
            for i, line in enumerate(range(items)[rows]):
                row, places = self.inventory.rows[line], np.flatnonzero(self.members[:, line])
                if row.downtime is None or not chance[:, i].any():
                    continue
                for cell, longer in enumerate(shares_above(row.downtime, edges)[cells]):
                    # (of pieces that fall together, the downtimes are still independent)
                    falling = longer if independent else 1.0 - power(1.0 - longer, row.count)
                    stays = 1.0 - chances_of_any(falling * chance[:, [i]], self.counts[[line]], independent)[:, 0]
                    for place in places:
                        none_longer[cell, of, place] *= stays
        return none_longer

    def add_longest(self, totals: Array, within: Callable[[Array, slice], Array]) -> None:
        """Add the mean of the longest downtime: the sum over cells of the width times P(longer), with `within`.

        It is at least the mean downtime of any piece, since that is the same sum of the piece alone.
        """
        for cells in self.cells(totals.size):
            for width, none in zip(np.diff(self.days)[cells], within(self.days, cells), strict=True):
                totals += width * (1.0 - none)

    def cells(self, size: int) -> Iterator[slice]:
        """Yield the bounds of slabs of the cells of downtimes, each of which takes `size` numbers."""
        step = max(1, RUNS // size)
        return (slice(first, first + step) for first in range(0, self.days.size - 1, step))

    def can_fall(self, quantity: Quantity) -> Flags:
        """Return True for items that can add to a quantity (item,)."""
        return self.exposed if quantity.taken else self.standing

    def most(self, quantity: Quantity) -> Array:
        """Return the mean of a quantity if everything falls that can (place,)."""
        if not quantity.greatest:
            return times(self.members, quantity.amounts * self.counts * self.can_fall(quantity))
        joint = replace(self, flags=self.standing[None, :, None, None, None], lost=None, variability=None)
        totals = np.zeros((1, len(self.members), 1, 1))
        joint.add_longest(totals, joint.within)
        return totals[0, :, 0, 0]

    def realisations(self, quantity: Quantity) -> int:
        """Number of realisations of a quantity under each motion."""
        if self.variability is not None:
            return self.variability.realisations
        return self.scores.realisations if quantity.drawn else 1

    def _add(self, i: int, of: slice, outcomes: dict[str, Array]) -> None:
        """Add the amounts of line i under some laws: if n pieces fall, they are the first n that are drawn."""
        row, places = self.inventory.rows[i], np.flatnonzero(self.members[:, i])
        flags = self.flags[of, i]
        lost = flags if self.lost is None else self.lost[of, i]
        drawn = np.full((1, 1, 1), row.count)
        if self.variability is not None:
            drawn = drawn_pieces(self.variability, row.label, row.count, flags.shape[-1] // self.polarities)
            drawn = np.repeat(drawn, self.polarities, axis=0)
        fell = fallen_pieces(flags, drawn)
        fallen = {False: fell, True: fell if self.lost is None else fallen_pieces(lost, drawn)}
        spread = []
        for quantity in self.quantities:
            if quantity.drawn and getattr(row, quantity.drawn) is not None:
                spread += [quantity] if quantity.amounts[i] > 0.0 else []
                continue
            for place in places:  # of costs with a spread, too, if this line's cost has none
                outcomes[quantity.name][:, place] += quantity.amounts[i] * fallen[quantity.taken]
        for motion in np.flatnonzero(lost.any(axis=(0, 1, 2))) if spread else ():
            scores = self.scores.of_pieces(row.label, row.count, int(motion) // self.polarities)
            for of_spread in spread:
                which = fallen[of_spread.taken][:, :, motion].astype(np.int64), np.arange(self.scores.realisations)
                amounts = of_spread.running(getattr(row, of_spread.drawn).at(scores[..., COLUMNS[of_spread.drawn]]))[
                    which
                ]
                for place in places:
                    outcome = outcomes[of_spread.name][:, place, :, motion]
                    (np.maximum if of_spread.greatest else np.add)(outcome, amounts, out=outcome)

    def part(self, rows: Index) -> "JointFlags | None":
        """Return the flags of some lines, None if there are none."""
        if not rows.size:
            return None
        inventory = replace(self.inventory, rows=tuple(self.inventory.rows[i] for i in rows))
        lost = None if self.lost is None else self.lost[:, rows]
        return replace(self, inventory=inventory, flags=self.flags[:, rows], members=self.members[:, rows], lost=lost)

    def filled(self, shape: tuple[int, ...], value: float) -> Array:
        """Allocate an array of one value."""
        array = self.array(shape, np.float64)
        array[...] = value
        return array


def lost_flags(flags: Flags, carried: Mapping[int, int], array: Allocator = in_memory) -> Flags | None:
    """Return the flags of pieces that fell or whose support did, None if nothing is carried."""
    if not carried:
        return None
    lost = array(flags.shape, np.bool_)
    lost[...] = flags
    for line, support in carried.items():
        lost[:, line] |= flags[:, support].astype(bool)
    return lost


def thresholds_up_to(most: float) -> Array:
    """Return thresholds of an amount: 0, and 60 from a thousandth of the maximum to it."""
    return np.concatenate([[0.0], geomspace(1e-3, 1.0, MOST_THRESHOLDS) * most])


def whole_thresholds(most: int) -> Array:
    """Return the numbers from 1 to the maximum, or about 60 of them if there are more."""
    if most <= MOST_THRESHOLDS:
        return np.arange(1.0, most + 1.0)
    return np.unique(np.rint(geomspace(1.0, most, MOST_THRESHOLDS)))


def upper_tail(given: Consequence | None) -> float:
    """Return the value that one in a thousand exceeds, 0 for none."""
    return 0.0 if given is None else float(given.at(np.array(TAIL)))
