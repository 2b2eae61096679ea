"""Variables of a performance assessment: distributions given the level, and what is expected in a year."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, cast

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from .. import checks
from ..fragility.bootstrap import draw_motions
from ..fragility.expected import LevelWeights
from ..fragility.intervals import wilson_interval
from ..fragility.means import mean_interval, quantiles
from ..fragility.slabs import slabs
from ..fragility.totals import exceedances
from ..units import DIMENSIONLESS
from .outcomes import Joint, Quantity

Values = NDArray[np.float64]
Variables = dict[str, xr.Variable]
Flags = NDArray[np.bool_]

PER_YEAR = "year-1"
JOINT = " | "
"""Between the consequences of one item, in a coordinate."""


@dataclass(frozen=True)
class Precision:
    """Which quantiles are wanted, and how intervals are made, over so many motions."""

    quantiles: Values
    confidence: float
    replicates: int
    seed: int
    motions: int = 0

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

    def over(self, motions: int) -> Precision:
        """The same over another number of motions."""
        return replace(self, motions=motions)

    @cached_property
    def drawn(self) -> Values:
        """How often each motion is drawn (replicate, motion): the same for all that is asked."""
        return draw_motions((np.arange(self.motions),), self.replicates, self.seed)

    def of_means(self, values: Values, most: Any = None) -> tuple[Values, Values, Values]:
        """Mean over motions (last axis) and its interval."""
        found = mean_interval(values, self.confidence, self.replicates, self.seed, most, self.drawn)
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


def conditional_variables(joint: Joint, precision: Precision) -> Variables:
    """Everything given the level."""
    models, items, _, levels, _ = joint.flags.shape
    falls = np.empty((3, models, items, levels))
    for of, rows, chance in joint.chances():
        falls[:, of, rows] = precision.of_probabilities(chance, joint.standing[rows, None])
    dims: tuple[str, ...] = ("model", "item", "level")
    text = "probability that a piece overturns"
    found = with_interval("probability", dims, falls, DIMENSIONLESS, text, precision)
    for one in joint.quantities:
        # the most that can overturn is what is not anchored
        most = (joint.members @ (one.amounts * joint.counts * joint.standing))[None, :, None]
        means = precision.of_means(joint.together.expected[one.name], most)
        dims = ("model", "place", "level")
        found |= with_interval(f"{one.name}_mean", dims, means, one.units, f"mean of {one.text}", precision)
        outcomes = joint.together.outcomes[one.name]
        at, above = _spread(outcomes, one, most, precision)
        dims = ("model", "place", "level", "quantile")
        found |= with_interval(f"{one.name}_quantile", dims, at, one.units, f"quantile of {one.text}", precision)
        dims = ("model", "place", "level", f"{one.name}_threshold")
        text = f"probability of {one.bound}"
        found[f"{one.name}_exceedance"] = variable(dims, above, DIMENSIONLESS, text)
        dims = ("model", "place", "level", "motion", "realisation")
        if joint.variability is None:
            dims, outcomes = dims[:-1], outcomes[..., 0]
        found[one.name] = variable(dims, outcomes, one.units, one.text)
    for event in joint.events:
        found |= with_interval(
            f"{event.name}_probability",
            ("model", *event.dims, "level"),
            precision.of_probabilities(joint.together.happens[event.name], joint.possible(event)[..., None]),
            DIMENSIONLESS,
            f"probability that {event.text}",
            precision,
        )
    return found


def _spread(outcomes: Values, one: Quantity, most: Values, precision: Precision) -> tuple[Values, Values]:
    """Quantiles (value and ends, model, place, level, quantile) and exceedance (…, threshold) of what falls."""
    of_level = outcomes.shape[:3]
    at, above = np.empty((3, *of_level, precision.quantiles.size)), np.empty((*of_level, one.thresholds.size))
    sizes = dict(zip(("model", "place", "level", "motion", "realisation"), outcomes.shape, strict=True))
    for where in slabs(sizes, ("model", "place", "level")):
        here = where.get("model", slice(None)), where.get("place", slice(None)), where.get("level", slice(None))
        bound = most[:, here[1]]
        at[:, *here] = quantiles(outcomes[here], precision.quantiles, bound, precision.confidence)
        for i, share in enumerate(exceedances(outcomes[here], one.thresholds, one.strictly)):
            above[*here, i] = share.mean(axis=-1)
    return at, above


def annual_variables(joint: Joint, weights: LevelWeights, precision: Precision) -> Variables:
    """Everything in a year: the values given the level, weighted with the hazard motion by motion."""
    w = weights.weights
    found: Variables = {
        "level_weight": variable(("level",), w, PER_YEAR, "annual rate that the level stands for"),
        "level_weight_below": variable((), weights.below, PER_YEAR, "part of the first one from below the levels"),
        "level_weight_above": variable((), weights.above, PER_YEAR, "part of the last one from above the levels"),
    }
    rates, amounts = _of_items(joint, w, precision)
    text = "annual rate at which a piece overturns"
    found |= with_interval("item_rate", ("model", "item"), rates, PER_YEAR, text, precision)
    for one in joint.quantities:
        units = per_year(one.units)
        text = f"expected annual {one.text}"
        name = f"item_annual_{one.name}"
        found |= with_interval(name, ("model", "item"), amounts[one.name], units, text, precision)
        given = joint.together.expected[one.name]
        name = f"annual_{one.name}"
        means = precision.of_means(a_year(given, w))
        found |= with_interval(name, ("model", "place"), means, units, text, precision)
        for side, weight, at in (("below", weights.below, 0), ("above", weights.above, -1)):
            values = weight * given[:, :, at].mean(axis=-1)
            found[f"{name}_{side}"] = variable(("model", "place"), values, units, f"part of it from {side} the levels")
        found |= with_interval(
            f"{one.name}_rate",
            ("model", "place", f"{one.name}_threshold"),
            _rates_of(joint.together.outcomes[one.name], one, w, precision),
            PER_YEAR,
            f"annual rate of {one.bound}",
            precision,
        )
    for event in joint.events:
        happens = precision.of_means(a_year(joint.together.happens[event.name], w))
        text = f"annual rate at which {event.text}"
        found |= with_interval(f"{event.name}_rate", ("model", *event.dims), happens, PER_YEAR, text, precision)
    return found


def _of_items(joint: Joint, weights: Values, precision: Precision) -> tuple[Values, dict[str, Values]]:
    """Annual rates of all lines (value and ends, model, item), and their amounts by quantity."""
    shape = (3, *joint.flags.shape[:2])
    rates, amounts = np.empty(shape), {one.name: np.empty(shape) for one in joint.quantities}
    for of, rows, chance in joint.chances():
        pieces = a_year(chance, weights)
        rates[:, of, rows] = precision.of_means(pieces)
        for one in joint.quantities:
            amounts[one.name][:, of, rows] = precision.of_means(pieces * (one.amounts * joint.counts)[rows, None])
    return rates, amounts


def _rates_of(outcomes: Values, one: Quantity, weights: Values, precision: Precision) -> Values:
    """Annual rates at which thresholds are exceeded (value and ends, model, place, threshold)."""
    found = np.empty((3, *outcomes.shape[:2], one.thresholds.size))
    sizes = dict(zip(("model", "place", "level", "motion", "realisation"), outcomes.shape, strict=True))
    for where in slabs(sizes, ("model", "place")):
        here = where.get("model", slice(None)), where.get("place", slice(None))
        for i, share in enumerate(exceedances(outcomes[here], one.thresholds, one.strictly)):
            found[:, *here, i] = precision.of_means(a_year(share, weights))
    return found


def a_year(values: Values, weights: Values) -> Values:
    """(…, level, motion) to (…, motion): what a motion adds to the annual value."""
    found = np.zeros((*values.shape[:-2], values.shape[-1]))
    for level, weight in enumerate(weights):  # (in their order, whatever else there is)
        found += weight * values[..., level, :]
    return found


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
