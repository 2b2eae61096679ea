"""Variables of a performance assessment: distributions given the level, and what is expected in a year."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple, cast

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from .. import checks
from ..fragility.expected import LevelWeights
from ..fragility.intervals import wilson_interval
from ..fragility.joint import Variability
from ..fragility.means import mean_interval, quantiles
from ..fragility.totals import (
    chances,
    chances_of_any,
    chances_of_events,
    exceedances,
    expected_totals,
    totals,
)
from ..units import DIMENSIONLESS
from .contents import Inventory

Values = NDArray[np.float64]
Variables = dict[str, xr.Variable]
Flags = NDArray[np.bool_]

MOST_THRESHOLDS = 60
PER_YEAR = "year-1"
ANY = "any"
"""The event that at least one piece overturns, whatever it means."""
JOINT = " | "
"""Between the consequences of one item, in a coordinate."""


@dataclass(frozen=True)
class Precision:
    """Which quantiles are wanted, and how intervals are made."""

    quantiles: Values
    confidence: float
    replicates: int
    seed: int

    @classmethod
    def checked(cls, which: Any, confidence: Any, replicates: Any, seed: Any) -> Precision:
        """From arguments; TypeError or ValueError where one is out of range."""
        found = checks.finite_array("quantiles", np.atleast_1d(np.asarray(which)))
        if found[0] <= 0.0 or found[-1] >= 1.0 or np.any(np.diff(found) <= 0.0):
            raise ValueError(f"quantiles must lie between 0 and 1 and increase, got {found.tolist()!r:.60}")
        return cls(
            found,
            checks.number("confidence", confidence, above=0.0, below=1.0),
            checks.count("replicates", replicates, at_least=50),
            checks.count("seed", seed),
        )

    def of_means(self, values: Values, most: Any = None) -> tuple[Values, Values, Values]:
        """Mean over motions (last axis) and its interval."""
        found = mean_interval(values, self.confidence, self.replicates, self.seed, most)
        return values.mean(axis=-1), found.lower, found.upper

    def of_probabilities(self, values: Values, possible: Flags) -> tuple[Values, Values, Values]:
        """Mean over motions of probabilities given the motion, and Wilson's interval with one trial a motion.

        What is not `possible` (broadcast to the mean) has no uncertainty.
        """
        n = values.shape[-1]
        mean = values.mean(axis=-1)
        # a motion under which something falls with a chance is that part of a success; all are exactly n
        successes = np.where(values.min(axis=-1) == 1.0, n, np.minimum(mean * n, n))
        trials = np.full(mean.shape, n)
        lower, upper = wilson_interval(cast("NDArray[np.integer]", successes), trials, self.confidence)
        return mean, np.where(possible, lower, 0.0), np.where(possible, upper, 0.0)


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


@dataclass(frozen=True)
class Joint:
    """What fell together: flags (model, item, variant, level, motion) of an inventory, and who stands where.

    members (place, item); losses: thresholds of the loss, none where nothing has a value.
    """

    inventory: Inventory
    flags: Flags
    members: Flags
    losses: Values
    variability: Variability | None

    @cached_property
    def chance(self) -> Values:
        """That a piece overturns, given the motion (model, item, level, motion)."""
        return chances(self.flags)

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

    def happens(self, event: Event) -> Values:
        """Chance of an event, given the motion (model, …, level, motion)."""
        independent = self.variability is not None and self.variability.pieces == "independent"
        any_piece = chances_of_any(self.chance, self.counts, independent)
        found = chances_of_events(any_piece, event.sets.reshape(-1, event.sets.shape[-1]))
        return found.reshape(found.shape[0], *event.sets.shape[:-1], *found.shape[2:])

    def possible(self, event: Event) -> Flags:
        """Whether there is anything that can bring an event about, shape (…) of its sets."""
        return np.asarray(np.any(event.sets & self.standing, axis=-1))

    def expected(self, quantity: Quantity) -> Values:
        """Expectation of a quantity, given the motion (model, place, level, motion)."""
        return expected_totals(self.chance, quantity.amounts * self.counts, self.members)

    def outcomes(self, quantity: Quantity) -> Values:
        """A quantity one by one (model, place, level, motion, realisation)."""
        rows = self.inventory.rows
        if self.variability is None:
            draws = [np.array([[row.count]]) for row in rows]
        else:
            draws = [self.variability.draws(row.label, row.count) for row in rows]
        return totals(self.flags, draws, quantity.amounts, self.members)


def conditional_variables(joint: Joint, precision: Precision) -> Variables:
    """Everything given the level."""
    found = with_interval(
        "probability",
        ("model", "item", "level"),
        precision.of_probabilities(joint.chance, joint.standing[:, None]),
        DIMENSIONLESS,
        "probability that a piece overturns",
        precision,
    )
    for one in joint.quantities:
        # the most that can overturn is what is not anchored
        most = (joint.members @ (one.amounts * joint.counts * joint.standing))[None, :, None]
        means = precision.of_means(joint.expected(one), most)
        dims: tuple[str, ...] = ("model", "place", "level")
        found |= with_interval(f"{one.name}_mean", dims, means, one.units, f"mean of {one.text}", precision)
        outcomes = joint.outcomes(one)
        levels = quantiles(outcomes, precision.quantiles, most, precision.confidence)
        dims = ("model", "place", "level", "quantile")
        found |= with_interval(f"{one.name}_quantile", dims, levels, one.units, f"quantile of {one.text}", precision)
        above = [each.mean(axis=-1) for each in exceedances(outcomes, one.thresholds, one.strictly)]
        dims = ("model", "place", "level", f"{one.name}_threshold")
        text = f"probability of {one.bound}"
        found[f"{one.name}_exceedance"] = variable(dims, np.stack(above, axis=-1), DIMENSIONLESS, text)
        dims = ("model", "place", "level", "motion", "realisation")
        if joint.variability is None:
            dims, outcomes = dims[:-1], outcomes[..., 0]
        found[one.name] = variable(dims, outcomes, one.units, one.text)
    for event in joint.events:
        found |= with_interval(
            f"{event.name}_probability",
            ("model", *event.dims, "level"),
            precision.of_probabilities(joint.happens(event), joint.possible(event)[..., None]),
            DIMENSIONLESS,
            f"probability that {event.text}",
            precision,
        )
    return found


def annual_variables(joint: Joint, weights: LevelWeights, precision: Precision) -> Variables:
    """Everything in a year: the values given the level, weighted with the hazard motion by motion."""
    w = weights.weights
    found: Variables = {
        "level_weight": variable(("level",), w, PER_YEAR, "annual rate that the level stands for"),
        "level_weight_below": variable((), weights.below, PER_YEAR, "part of the first one from below the levels"),
        "level_weight_above": variable((), weights.above, PER_YEAR, "part of the last one from above the levels"),
    }
    pieces = a_year(joint.chance, w)
    found |= with_interval(
        "item_rate",
        ("model", "item"),
        precision.of_means(pieces),
        PER_YEAR,
        "annual rate at which a piece overturns",
        precision,
    )
    for one in joint.quantities:
        units = per_year(one.units)
        text = f"expected annual {one.text}"
        amounts = precision.of_means(pieces * (one.amounts * joint.counts)[:, None])
        found |= with_interval(f"item_annual_{one.name}", ("model", "item"), amounts, units, text, precision)
        given = joint.expected(one)
        name = f"annual_{one.name}"
        means = precision.of_means(a_year(given, w))
        found |= with_interval(name, ("model", "place"), means, units, text, precision)
        for side, weight, at in (("below", weights.below, 0), ("above", weights.above, -1)):
            values = weight * given[:, :, at].mean(axis=-1)
            found[f"{name}_{side}"] = variable(("model", "place"), values, units, f"part of it from {side} the levels")
        above = [a_year(each, w) for each in exceedances(joint.outcomes(one), one.thresholds, one.strictly)]
        found |= with_interval(
            f"{one.name}_rate",
            ("model", "place", f"{one.name}_threshold"),
            precision.of_means(np.stack(above, axis=2)),
            PER_YEAR,
            f"annual rate of {one.bound}",
            precision,
        )
    for event in joint.events:
        rates = precision.of_means(a_year(joint.happens(event), w))
        text = f"annual rate at which {event.text}"
        found |= with_interval(f"{event.name}_rate", ("model", *event.dims), rates, PER_YEAR, text, precision)
    return found


def a_year(values: Values, weights: Values) -> Values:
    """(…, level, motion) to (…, motion): what a motion adds to the annual value."""
    return np.asarray(np.einsum("...lm,l->...m", values, weights))


def level_index(assessment: xr.Dataset, level: float) -> int:
    """Which of the levels this is; ValueError where it is none."""
    levels = assessment["level"].values
    wanted = checks.number("level", level)
    found = np.flatnonzero(np.isclose(levels, wanted, rtol=1e-6, atol=0.0))
    if not found.size:
        raise ValueError(f"level must be one of {', '.join(f'{one:.6g}' for one in levels)}, got {wanted:g}")
    return int(found[0])


def per_year(units: str) -> str:
    """The unit of an amount a year."""
    return PER_YEAR if units == DIMENSIONLESS else f"{units} {PER_YEAR}"


def with_interval(
    name: str, dims: tuple[str, ...], found: Any, units: str, long_name: str, precision: Precision
) -> Variables:
    """A variable and the ends of its interval."""
    value, lower, upper = found
    percent = f"{100.0 * precision.confidence:g} %"
    return {
        name: variable(dims, value, units, long_name),
        f"{name}_lower": variable(dims, lower, units, f"lower end of the {percent} interval: {long_name}"),
        f"{name}_upper": variable(dims, upper, units, f"upper end of the {percent} interval: {long_name}"),
    }


def variable(dims: tuple[str, ...], values: Any, units: str, long_name: str) -> xr.Variable:
    """A variable with its unit and name."""
    return xr.Variable(dims, values, {"units": units, "long_name": long_name})
