"""Variables of a performance assessment: distributions given the level, and annual values."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from ...core import checks
from ...core.elementary import Array, Flags, Index, times
from ...core.parameters import CONFIDENCE
from ...core.units import DIMENSIONLESS, ENDS, PER_YEAR, described, of_end
from ...fragility.curves.means import RESAMPLES, mean_interval, quantiles, share_error
from ...fragility.fitting.bootstrap import draw_motions
from ...fragility.hazard.curve import HazardCurve
from ...fragility.hazard.level_weights import LevelWeights, level_weights
from ...fragility.numerics.proportions import interval_of_parts
from ...fragility.numerics.slabs import RUNS, slabs, spread
from ...fragility.numerics.totals import chances, exceedances
from ...fragility.risk.modelling import capacity_factors, seen_by, with_ends
from ...motions.arrays import POLARITY, RECORD
from ..inventory.contents import Contents
from ..plan.design_shaking import at_level
from .modelling import Mixture, covering
from .outcomes import ANY, JointFlags, JointOutcomes, Quantity

Variables = dict[str, xr.Variable]

JOINT = " | "
"""Separator of the consequences of one item in a coordinate."""
DRAWING, OF_DRAWS = "_sampling_error", "standard error from the draws"
"""Ending and text of the error that the draws of pieces and of their consequences leave in a value."""
DOUBTFUL = "doubtful"
"""Coordinate of a ranking: True if an item's probability of falling is no basis for advice."""
ANNUAL_SAVING = "block_annual_saving"
FALLEN = "fallen"
"""Flags of pieces that overturned or fell off, if any line has an edge; else the flags ``overturned`` are all."""

OF_A_YEAR = {
    "rate": "probability",
    "any_rate": "any_probability",
    "consequence_rate": "consequence_probability",
    "annual_number": "number_mean",
    "annual_loss": "loss_mean",
    "annual_downtime": "downtime_mean",
    "annual_injuries": "injuries_mean",
}
"""Annual values, each with the value at a level of which it is the integral over the hazard."""


@dataclass(frozen=True)
class Precision:
    """The wanted quantiles and the options of the intervals, over motions in strata that are resampled separately."""

    quantiles: Array
    confidence: float
    replicates: int
    seed: int
    strata: tuple[Index, ...] = ()

    @classmethod
    def checked(cls, which: Any, confidence: Any, replicates: Any, seed: Any) -> Precision:
        """Check the arguments; TypeError or ValueError if one is out of range."""
        quantiles_at = np.atleast_1d(checks.finite_array("quantiles", which, ndim=(0, 1)))
        if quantiles_at[0] <= 0.0 or quantiles_at[-1] >= 1.0 or np.any(np.diff(quantiles_at) <= 0.0):
            raise ValueError(f"quantiles must lie between 0 and 1 and increase, got {quantiles_at.tolist()!r:.60}")
        return cls(
            quantiles_at,
            CONFIDENCE.number("confidence", confidence),
            RESAMPLES.count("replicates", replicates),
            checks.count("seed", seed),
        )

    def over(self, motions: int, strata: int = 1) -> Precision:
        """Return the same options over `motions` motions in each of some strata."""
        return replace(self, strata=alike_strata(motions, strata))

    def of_year(self, year: Year, runs: int) -> Precision:
        """Return the same options over the values of a sum over levels of `runs` runs."""
        return replace(self, strata=year.strata(runs)) if year.own_motions else self

    @cached_property
    def drawn(self) -> Array:
        """Number of draws of each motion (replicate, motion), the same for all variables."""
        return draw_motions(self.strata, self.replicates, self.seed)

    def of_means(self, values: Array, most: Any, signed: bool = False) -> tuple[Array, Array, Array]:
        """Return the mean over motions (last axis, each once) and its interval, as of `mean_interval`."""
        options = self.confidence, self.replicates, self.seed
        interval = mean_interval(values, *options, most, self.drawn, self.strata, signed)
        return values.mean(axis=-1), interval.lower, interval.upper

    def of_probabilities(self, values: Array, possible: Flags) -> tuple[Array, Array, Array]:
        """Return the mean over motions of P(event | motion), and Wilson's interval; 0 if it is not `possible`."""
        n = values.shape[-1]
        mean = values.mean(axis=-1)
        # a motion counts as a success by its probability; where all probabilities are 1, the successes are exactly n
        successes = np.where(values.min(axis=-1) == 1.0, n, np.minimum(mean * n, n))
        trials = np.full(mean.shape, n)
        lower, upper = interval_of_parts(successes, trials, self.confidence)
        return mean, np.where(possible, lower, 0.0), np.where(possible, upper, 0.0)


def conditional_variables(joint: JointFlags, precision: Precision, modelled: Modelled | None = None) -> Variables:
    """Compute all variables given the level; with `modelled` they are means over the modelling uncertainty."""
    results = joint.results if modelled is None else modelled.results
    falls = LineEvent.of_flags("probability", "", f"a piece {joint.falls}", joint.flags, range(joint.flags.shape[1]))
    variables = line_variables(joint, [falls], precision, modelled=modelled)
    for quantity in joint.quantities:
        most = joint.most(quantity)[None, :, None]
        means = precision.of_means(of_motions(results.expected[quantity.name], joint.polarities), most)
        dims: tuple[str, ...] = ("model", "place", "level")
        variables |= with_interval(
            f"{quantity.name}_mean", dims, means, quantity.units, f"mean of {quantity.text}", precision
        )
        outcomes = results.outcomes[quantity.name]
        # drawn values have no maximum, except if nothing can overturn
        bound = np.where(most > 0.0, np.inf, 0.0) if quantity.drawn else most
        at, above = _spread(outcomes, quantity, bound, precision, joint.polarities)
        # (draws of the modelling uncertainty take the fillings of a motion again where there are fewer of these)
        fillings = joint.realisations(quantity)
        errors = np.sqrt(max(1.0, outcomes.shape[-1] / fillings if fillings > 1 else 1.0))
        drawn = outcomes.shape[-1] > 1 or joint.variability is not None
        dims = ("model", "place", "level", "quantile")
        text = f"quantile of {quantity.text}"
        variables |= with_interval(f"{quantity.name}_quantile", dims, at[:3], quantity.units, text, precision)
        if drawn:
            variables[f"{quantity.name}_quantile{DRAWING}"] = variable(
                dims, errors * at[3], quantity.units, f"{OF_DRAWS}: {text}"
            )
        dims = ("model", "place", "level", f"{quantity.name}_threshold")
        text = f"probability of {quantity.bound}"
        variables[f"{quantity.name}_exceedance"] = variable(dims, above[0], DIMENSIONLESS, text)
        if drawn:
            variables[f"{quantity.name}_exceedance{DRAWING}"] = variable(
                dims, errors * above[1], DIMENSIONLESS, f"{OF_DRAWS}: {text}"
            )
        dims = ("model", "place", "level", "motion", "realisation")
        if not drawn:
            dims, outcomes = dims[:-1], outcomes[..., 0]
        variables[quantity.name] = variable(dims, outcomes, quantity.units, quantity.text)
    for event in joint.events:
        variables |= with_interval(
            f"{event.name}_probability",
            ("model", *event.dims, "level"),
            precision.of_probabilities(
                of_motions(results.happens[event.name], joint.polarities), joint.possible(event)[..., None]
            ),
            DIMENSIONLESS,
            f"probability that {event.text}",
            precision,
        )
    return variables


class LineEvent(NamedTuple):
    """Event of pieces of some lines (`rows`).

    It has the names of its probability and its rate ('' for none), dimensions before the level, words, and the
    probabilities (…, level, motion) of a slab of these lines.
    """

    name: str
    rate: str
    dims: tuple[str, ...]
    text: str
    rows: Sequence[int]
    chance: Callable[[slice], Array]

    @classmethod
    def of_flags(cls, name: str, rate: str, text: str, flags: Flags, rows: Sequence[int]) -> LineEvent:
        """Return the event that flags (model, item, variant, level, motion) are of."""
        return cls(name, rate, ("model", "block"), text, rows, lambda part: chances(flags[:, rows[part]]))

    @property
    def item(self) -> int:
        """Position of the lines among the dimensions."""
        return self.dims.index("block")

    def of_lines(
        self, of: Callable[[LineEvent, slice], tuple[Array, Array, Array]], lines: int, runs: int
    ) -> list[Array]:
        """Return a value and its ends on all lines, NaN if it is not known; lines are computed slab by slab."""
        step = max(1, RUNS // (1 + runs // lines))
        parts = [of(self, slice(first, first + step)) for first in range(0, len(self.rows), step)]
        ends = []
        for values in zip(*parts, strict=True):
            known = np.moveaxis(np.concatenate(values, axis=self.item), self.item, 0)
            every = np.full((lines, *known.shape[1:]), np.nan)
            every[list(self.rows)] = known
            ends.append(np.moveaxis(every, 0, self.item))
        return ends


FORWARD, RUPTURE, SIDEWAYS = "front", "broken", "sideways"
"""Events of a piece in addition to any fall, as variables name them."""
PIECE_EVENTS: dict[str, tuple[str, Callable[[Contents], bool]]] = {
    FORWARD: ("a piece overturns forward", lambda row: True),
    RUPTURE: ("the restraint of a piece breaks", lambda row: row.block.restraint is not None and not row.anchored),
    SIDEWAYS: ("a piece overturns along its depth", lambda row: row.both_axes),
}
"""Their words, and flags of the lines that can have them."""


def line_variables(
    joint: JointFlags,
    events: Iterable[LineEvent],
    precision: Precision,
    year: Year | None = None,
    modelled: Modelled | None = None,
) -> Variables:
    """Compute the probabilities of events and, with a year, their annual rates, line by line; NaN of other lines."""
    lines, runs = joint.flags.shape[1], joint.flags.size
    variables: Variables = {}

    def possible(event: LineEvent, part: slice) -> Flags:
        return joint.standing[list(event.rows[part])].reshape(-1, *(1 for _ in event.dims[event.item + 1 :]))

    def at_levels(event: LineEvent, part: slice) -> tuple[Array, Array, Array]:
        chance = event.chance(part)
        chance = chance if modelled is None else modelled.mixture.of(chance)
        return precision.of_probabilities(of_motions(chance, joint.polarities), possible(event, part)[..., None])

    def in_a_year(event: LineEvent, part: slice) -> tuple[Array, Array, Array]:
        assert year is not None  # (else there is no rate)
        most = np.where(possible(event, part), year.rate, 0.0)
        return precision.of_year(year, joint.flags.shape[-1]).of_means(year.total(event.chance(part)), most)

    for event in events:
        values, text = event.of_lines(at_levels, lines, runs), f"probability that {event.text}"
        variables |= with_interval(event.name, (*event.dims, "level"), values, DIMENSIONLESS, text, precision)
        if year is not None and event.rate:
            values, text = event.of_lines(in_a_year, lines, runs), f"annual rate at which {event.text}"
            variables |= with_interval(event.rate, event.dims, values, PER_YEAR, text, precision)
    return variables


class Modelled(NamedTuple):
    """Outcomes over the modelling uncertainty at points of the intensity, their states, and the points' rates."""

    results: JointOutcomes
    mixture: Mixture
    rates: Array


def _spread(
    outcomes: Array, quantity: Quantity, most: Array, precision: Precision, polarities: int
) -> tuple[Array, Array]:
    """Return quantiles and exceedances with ends and errors; both polarities of a motion are its realisations."""
    of_level = outcomes.shape[:3]
    at, above = np.empty((4, *of_level, precision.quantiles.size)), np.empty((2, *of_level, quantity.thresholds.size))
    sizes = dict(zip(("model", "place", "level", "motion", "realisation"), outcomes.shape, strict=True))
    for where in slabs(sizes, ("model", "place", "level")):
        cells = where.get("model", slice(None)), where.get("place", slice(None)), where.get("level", slice(None))
        bound = most[:, cells[1]]
        of_cells = outcomes[cells]
        by_motion = of_cells.reshape(*of_cells.shape[:3], of_cells.shape[3] // polarities, -1)
        at[:, *cells] = quantiles(by_motion, precision.quantiles, bound, precision.confidence, ways=polarities)
        for i, reached in enumerate(exceedances(by_motion, quantity.thresholds, quantity.strictly)):
            above[:, *cells, i] = reached.mean(axis=(-2, -1)), share_error(reached, polarities)
    return at, above


def annual_variables(
    joint: JointFlags, weights: LevelWeights, year: Year, precision: Precision, modelled: Modelled | None = None
) -> Variables:
    """Compute annual variables from values given the level, or over modelling uncertainty (`modelled`), by motion."""
    results, of_points = joint.results, year
    if modelled is not None:
        results, of_points = modelled.results, Year(modelled.rates, polarities=joint.polarities)
    precision = precision.of_year(year, joint.flags.shape[-1])
    variables: Variables = {
        "level_weight": variable(("level",), weights.weights, PER_YEAR, "annual rate that the level stands for"),
        "level_weight_below": variable((), weights.below, PER_YEAR, "part of the first one from below the levels"),
        "level_weight_above": variable((), weights.above, PER_YEAR, "part of the last one from above the levels"),
    }
    rates, amounts = _of_items(joint, year, precision)
    text = f"annual rate at which a piece {joint.falls}"
    variables |= with_interval("rate", ("model", "block"), rates, PER_YEAR, text, precision)
    for quantity in joint.quantities:
        units = per_year(quantity.units)
        text = f"expected annual {quantity.text}"
        name = f"block_annual_{quantity.name}"
        of_item = "expected annual downtime of a piece" if quantity.greatest else text
        variables |= with_interval(name, ("model", "block"), amounts[quantity.name], units, of_item, precision)
        given = joint.results.expected[quantity.name]
        name = f"annual_{quantity.name}"
        at = of_points if quantity.greatest else year
        means = precision.of_means(
            at.total(results.expected[quantity.name] if quantity.greatest else given), at.rate * joint.most(quantity)
        )
        variables |= with_interval(name, ("model", "place"), means, units, text, precision)
        for side, weight, end in (("below", weights.below, 0), ("above", weights.above, -1)):
            values = weight * of_motions(given[:, :, end], joint.polarities).mean(axis=-1)
            variables[f"{name}_{side}"] = variable(
                ("model", "place"), values, units, f"part of it from {side} the levels"
            )
        variables |= with_interval(
            f"{quantity.name}_rate",
            ("model", "place", f"{quantity.name}_threshold"),
            _rates_of(joint, results.outcomes[quantity.name], quantity, of_points, precision),
            PER_YEAR,
            f"annual rate of {quantity.bound}",
            precision,
        )
    for event in joint.events:
        most = np.where(joint.possible(event), of_points.rate, 0.0)
        happens = precision.of_means(of_points.total(results.happens[event.name]), most)
        text = f"annual rate at which {event.text}"
        variables |= with_interval(f"{event.name}_rate", ("model", *event.dims), happens, PER_YEAR, text, precision)
    return variables


def _of_items(joint: JointFlags, year: Year, precision: Precision) -> tuple[Array, dict[str, Array]]:
    """Return the annual rates of all lines (value and ends, model, item), and their annual amounts by quantity."""
    shape = (3, *joint.flags.shape[:2])
    rates, amounts = np.empty(shape), {quantity.name: np.empty(shape) for quantity in joint.quantities}
    for of, rows, chance, lost in joint.chances():
        pieces = year.total(chance)
        gone = pieces if lost is chance else year.total(lost)
        rates[:, of, rows] = precision.of_means(pieces, year.rate * joint.standing[rows])
        for quantity in joint.quantities:
            amount_of = (quantity.amounts if quantity.greatest else quantity.amounts * joint.counts)[rows]
            amounts[quantity.name][:, of, rows] = precision.of_means(
                (gone if quantity.taken else pieces) * amount_of[:, None],
                year.rate * amount_of * joint.can_fall(quantity)[rows],
            )
    return rates, amounts


def _rates_of(joint: JointFlags, outcomes: Array, quantity: Quantity, year: Year, precision: Precision) -> Array:
    """Return the annual rates at which thresholds are exceeded (value and ends, model, place, threshold)."""
    rates = np.empty((3, *outcomes.shape[:2], quantity.thresholds.size))
    sizes = dict(zip(("model", "place", "level", "motion", "realisation"), outcomes.shape, strict=True))
    for where in slabs(sizes, ("model", "place")):
        cells = where.get("model", slice(None)), where.get("place", slice(None))
        for i, reached in enumerate(exceedances(outcomes[cells], quantity.thresholds, quantity.strictly)):
            most = np.where(joint.most(quantity)[cells[1]] > 0.0, year.rate, 0.0)
            rates[:, *cells, i] = precision.of_means(year.total(reached.mean(axis=-1)), most)
    return rates


@dataclass(frozen=True)
class Year:
    """Sums over levels with weights (level,): annual rates, or 1 for one level; polarities count as one motion.

    own_motions: each level has its own, so that a sum has no value for one motion: levels are strata.
    """

    weights: Array
    own_motions: bool = False
    polarities: int = 1

    @classmethod
    def of(cls, assessment: xr.Dataset, weights: Array) -> Year:
        """Return the sums over the levels of an assessment."""
        return cls(weights, levels_have_own_motions(assessment), 2 if POLARITY in assessment.coords else 1)

    @property
    def rate(self) -> float:
        """The sum of 1 over levels, which no share of the motions exceeds."""
        return float(self.weights.sum())

    @cached_property
    def levels(self) -> Index:
        """The levels whose motions count by themselves: those with a weight, at least one."""
        weighted = np.flatnonzero(self.weights)
        return weighted if weighted.size else np.zeros(1, np.int64)

    @property
    def strata_levels(self) -> Index:
        """The levels of the strata; none if there is a single stratum for all levels."""
        return self.levels if self.own_motions else np.zeros(0, np.int64)

    @property
    def parts(self) -> int:
        """Number of values for each number of a motion."""
        return self.levels.size if self.own_motions else 1

    def strata(self, runs: int) -> tuple[Index, ...]:
        """Return the strata of the values of a sum over levels of `runs` runs."""
        return alike_strata(runs // self.polarities, self.parts)

    def size(self, runs: int) -> int:
        """Return the number of values of a sum over levels of `runs` runs."""
        return runs // self.polarities * self.parts

    def total(self, values: Array) -> Array:
        """Sum values (…, level, run) over the weighted levels: (…, motion), whose mean is the annual value."""
        values = of_motions(values, self.polarities)
        if self.own_motions:
            factors = self.weights[self.levels] * self.parts
            scaled = np.moveaxis(values[..., self.levels, :], -2, -1) * factors
            return np.ascontiguousarray(scaled.reshape(*values.shape[:-2], -1))
        totals = np.zeros((*values.shape[:-2], values.shape[-1]))
        # (summed in the order of the levels, whatever the other dimensions are)
        for level, weight in enumerate(self.weights):
            totals += weight * values[..., level, :]
        return totals

    def resampled(self, values: Array, drawn: Array) -> Array:
        """Return means (…, level, replicate) over motions drawn as (replicate, motion), jointly or level by level."""
        values = of_motions(values, self.polarities)
        motions = values.shape[-1]
        if self.own_motions:
            of_level = drawn.reshape(-1, motions, values.shape[-2])
            return np.asarray(np.einsum("...lm,sml->...ls", values, of_level) / motions)
        return np.asarray(np.einsum("...lm,sm->...ls", values, drawn) / motions)


def of_motions(values: Array, polarities: int) -> Array:
    """Return the means (…, motion) over the polarities of each motion, which follow one another."""
    if polarities == 1:
        return values
    return np.asarray(values.reshape(*values.shape[:-1], values.shape[-1] // polarities, polarities).mean(axis=-1))


def fall_flags(assessment: xr.Dataset, name: str = "") -> xr.DataArray:
    """Return the flags of pieces that fell (model, item, variant, level, motion), or of the variable `name`."""
    flags = assessment[name or (FALLEN if FALLEN in assessment else "overturned")]
    if "variant" not in flags.dims:  # (pieces are alike)
        flags = flags.expand_dims("variant")
    return flags.transpose("model", "block", "variant", "level", "motion")


def carried_items(assessment: xr.Dataset) -> dict[int, int]:
    """Return the positions of items on other items, with the positions of the latter."""
    if "stands_on" not in assessment.coords:
        return {}
    at = {str(label): i for i, label in enumerate(assessment["block"].values)}
    below = enumerate(map(str, assessment["stands_on"].values))
    return {i: at[label] for i, label in below if label in at}


def levels_have_own_motions(assessment: xr.Dataset) -> bool:
    """Return True if each level of an assessment has its own motions."""
    return RECORD in assessment.coords and "level" in assessment[RECORD].dims


def alike_strata(motions: int, number: int) -> tuple[Index, ...]:
    """Return strata of `motions` motions each, motion by motion with equal numbers together."""
    return tuple(np.arange(motions) * number + i for i in range(number))


def level_index(assessment: xr.Dataset, level: float) -> int:
    """Return the index of a level; ValueError if it is not among the levels."""
    levels = assessment["level"].values
    wanted = checks.number("level", level)
    at = np.flatnonzero(np.isclose(levels, wanted, rtol=1e-6, atol=0.0))
    if not at.size:
        raise ValueError(f"level must be one of {', '.join(f'{level:.6g}' for level in levels)}, got {wanted:g}")
    return int(at[0])


def per_year(units: str) -> str:
    """Return the unit of an annual amount."""
    return PER_YEAR if units == DIMENSIONLESS else f"{units} {PER_YEAR}"


def with_interval(
    name: str, dims: tuple[str, ...], values: Any, units: str, long_name: str, precision: Precision
) -> Variables:
    """Make a variable and the ends of its interval; no place has a higher end than the first, the building.

    No farther slip and no larger amount has a higher end than a shorter or smaller one, which it implies.
    """
    value, lower, upper = values
    if "place" in dims:
        ends = np.moveaxis(np.stack([lower, upper]), 1 + dims.index("place"), 0)
        most = np.fmax.reduce(ends[:, 0])
        ends[0, 0] = np.where(most > ends[0, 0], most, ends[0, 0])
        ends[:, 1] = _within(ends[:, 1], ends[0, 1])
        lower, upper = np.moveaxis(ends, 0, 1 + dims.index("place"))
    for axis, dim in enumerate(dims):
        if dim.endswith(("slip", "threshold")):
            least = np.flip(np.fmax.accumulate(np.flip(lower, axis), axis), axis)
            lower = np.where(np.isnan(lower), lower, least)
            upper = np.where(np.isnan(upper), upper, np.fmin.accumulate(upper, axis))
    return {
        f"{name}{end}": variable(dims, values_of_end, units, of_end(end, long_name, precision.confidence))
        for end, values_of_end in zip(ENDS, (value, lower, upper), strict=True)
    }


WHOLES = {
    **{f"{event}_rate": "rate" for event in (FORWARD, SIDEWAYS, "off", "overturning", "gated")},
    "rate": f"{ANY}_rate",
    "consequence_rate": f"{ANY}_rate",
    **{f"block_annual_{name}": f"annual_{name}" for name in ("number", "loss", "downtime", "injuries")},
    "kit_front_falls": "kit_falls",
}
"""Variables of events or amounts that another variable contains, the parts of parts first."""


def consistent(variables: Variables) -> Variables:
    """Return variables of which no part has a higher end of its interval than its whole (`WHOLES`)."""
    ends = dict(variables)
    pairs = [pair for pair in WHOLES.items() if variables.keys() >= {*pair}]
    for part, whole in pairs:
        lower, least = ends[f"{part}_lower"], ends[f"{whole}_lower"].copy()
        building = _building(least, lower)
        of_building = least[building]
        larger = spread(lower.max([dim for dim in lower.dims if dim not in least.dims]), of_building.sizes)
        least[building] = of_building.copy(data=np.where(larger > of_building.values, larger, of_building.values))
        ends[f"{whole}_lower"] = least
    for part, whole in reversed(pairs):
        upper, most = ends[f"{part}_upper"], ends[f"{whole}_upper"]
        most = most[_building(most, upper)]
        most = most.min([dim for dim in most.dims if dim not in upper.dims])
        ends[f"{part}_upper"] = upper.copy(data=_within(upper.values, spread(most, upper.sizes)))
    return ends


def _building(whole: xr.Variable, part: xr.Variable) -> dict[str, int]:
    """Return the index of the whole building, if a variable has places that another does not have."""
    return {"place": 0} if "place" in whole.dims and "place" not in part.dims else {}


def _within(upper: Array, whole: Array) -> Array:
    """Return upper ends of parts, which are not above the upper end of their whole."""
    return np.where(upper > whole, whole, upper)


def variable(dims: tuple[str, ...], values: Any, units: str, long_name: str) -> xr.Variable:
    """Make a variable with its unit and long name."""
    return xr.Variable(dims, values, described(long_name, units))


def range_of_a_year(means: Mapping[Any, Any], levels: Array, hazard: HazardCurve, dispersion: float) -> Variables:
    """Return both ends of the annual values (`with_ends`), from the `means` at levels without modelling uncertainty."""
    weights = [
        level_weights(levels, covering(seen_by(hazard, factor), levels)).weights
        for factor in capacity_factors(dispersion)
    ]
    variables: Variables = {}
    for name, given in OF_A_YEAR.items():
        if given in means:
            mean = means[given].transpose(..., "level")
            units = per_year(mean.attrs["units"])
            ends = [times(mean.values, weight) for weight in weights]
            variables |= with_ends(name, mean.dims[:-1], ends, units, dispersion)
    return variables


def range_at_levels(means: Mapping[Any, Any], run: Array, levels: Array, dispersion: float) -> Variables:
    """Return both ends of the values at levels (`with_ends`), between the levels that were `run`; NaN outside."""
    variables: Variables = {}
    for name in OF_A_YEAR.values():
        if name in means:
            mean = means[name].transpose(..., "level")
            ends = []
            for factor in capacity_factors(dispersion):
                seen = levels / factor
                known = np.where((seen >= run[0] * (1.0 - 1e-9)) & (seen <= run[-1] * (1.0 + 1e-9)), seen, np.nan)
                ends.append(np.stack([at_level(level, run, mean.values) for level in known.tolist()], axis=-1))
            variables |= with_ends(name, mean.dims, ends, mean.attrs["units"], dispersion)
    return variables
