"""Rates of an inventory over weighted branches of laws, motions and hazard curves: each piece and the building."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import reduce
from itertools import product
from typing import NamedTuple

import numpy as np
import scipy
import xarray as xr
from numpy.typing import NDArray

from ...core.elementary import Array, Flags, Index, times
from ...core.streams import key_of, stream
from ...core.units import DIMENSIONLESS, PER_YEAR
from ...fragility import HazardCurve
from ...fragility.fitting.bootstrap import draw_motions
from ...fragility.hazard.level_weights import level_weights, line_weights
from ...fragility.risk.epistemic import FRACTILES, SOURCES, SampledRates, fractiles_of, shares_of_spread
from ...fragility.uncertainty.joint import PieceDraws
from ..inventory.contents import Inventory
from ..text.curve_notes import SETTLED
from .modelling import ShiftedLevels, covering, refuse_own_motions
from .outcomes import DAY, JointFlags
from .savings import ItemChances
from .variables import Year, fall_flags, per_year, range_of_a_year, variable


@dataclass(frozen=True)
class JoinedClasses:
    """Joint results of pieces, by the values (row, 1 + level, motion) of their classes, at least one.

    Values are P(nothing of a set falls | motion), from which the probability of any fall is computed, or P(no fallen
    piece is out of use for longer | motion). The first value is without any fall.
    """

    classes: Mapping[str, Array]

    @property
    def together(self) -> Array:
        """The values with all classes at the same level (row, level, motion)."""
        return self._of([values[:, 1:] for values in self.classes.values()])

    def blurred(self, states: ShiftedLevels) -> Iterator[Array]:
        """Yield the means (point, motion) of each row, with independent scores of the classes."""
        for row in range(self.rows):
            yield self._of([states.of(values[row, 1:], 1.0) for values in self.classes.values()])

    def at(self, states: Mapping[str, Index]) -> Iterator[Array]:
        """Yield the values (case, motion) of each row, with each class in a state (case,), as of `ShiftedLevels`."""
        for row in range(self.rows):
            yield self._of([self.classes[label][row, at] for label, at in states.items()])

    @property
    def rows(self) -> int:
        """Number of rows."""
        return len(next(iter(self.classes.values())))

    @staticmethod
    def _of(values: Sequence[Array]) -> Array:
        return np.asarray(1.0 - np.prod(values, axis=0))


FALL_RATE, ANY_RATE, CONSEQUENCE_RATE = "rate", "any_rate", "consequence_rate"
NUMBER, LOSS, DOWNTIME, INJURIES = "annual_number", "annual_loss", "annual_downtime", "annual_injuries"
JOINT_SAMPLES = 200
"""Samples of a rate that depends on the scores of several classes together."""
SLAB = 4_000_000
"""Most numbers of an array of one slab of items."""
BEYOND = "branch_share_beyond"


class InventoryBranch(NamedTuple):
    """One combination: names of law, motions and hazard curve, the curve, and the weight (> 0)."""

    model: str
    motions: str
    hazard_name: str
    hazard: HazardCurve
    weight: float


@dataclass(frozen=True)
class Sampling:
    """Sampling of rates: replicates of the motions, the seed, beta_m, and its inclusion in fractiles or means."""

    replicates: int
    seed: int
    beta: float = 0.0
    spread: bool = False
    variability: PieceDraws | None = None
    correlation: float = 1.0

    def scores(self, label: str, number: int) -> Array:
        """Return equally probable scores (sample,) of a class in an order of its own."""
        order = stream(self.seed, *key_of(f"branches of the class {label}")).permutation(number)
        return np.asarray(scipy.special.ndtri((order + 0.5) / number))


def rates_over_branches(
    branches: Sequence[InventoryBranch], assessments: Mapping[str, xr.Dataset], inventory: Inventory, sampling: Sampling
) -> xr.Dataset:
    """Return fractiles and means over branches of the annual rates of pieces and events, and of annual amounts.

    `branches` are all combinations, whose weights sum to 1. `assessments` are the inventory by the names of motions at
    the same levels, without modelling uncertainty in their flags. The rates are as of
    `toppling.fragility.epistemic_rates`, of weighted levels instead of curves: the finite number of motions counts by
    resampled motions. With beta_m in the fractiles each sample has a score Z of each class (`modelling`), whose
    capacities are multiplied by exp(beta_m Z). Sums over classes are of independent scores. With beta_m in the means
    all rates are means over it.
    """
    for branch in branches:
        if branch.hazard.fractile is not None and branch.hazard.weights is not None:
            raise ValueError(
                f"hazard {branch.hazard_name!r:.60} of a branch must be the mean of its realisations, got their "
                f"fractile {branch.hazard.fractile:g}"
            )
    for assessment in assessments.values():
        if sampling.beta > 0.0:
            refuse_own_motions(inventory, Year.of(assessment, np.ones(assessment.sizes["level"])).own_motions)
    first = next(iter(assessments.values()))
    places = [str(value) for value in first["place"].values]
    floors = np.array([f"floor {row.floor}" for row in inventory.rows], dtype=object)
    members = np.array([np.ones(len(inventory), bool), *(floors == place for place in places[1:])])
    every = [_Branch(branch, assessments[branch.motions], inventory, members, sampling) for branch in branches]
    weights = np.array([branch.weight for branch in branches])
    weighed = _Found({}, branches, weights)
    amounts = {NUMBER: np.array([float(row.count) for row in inventory.rows])}
    if inventory.value > 0.0:
        amounts[LOSS] = np.array([row.count * row.loss for row in inventory.rows])
    persons = np.array([0.0 if row.injury is None else row.count * row.injury.mean for row in inventory.rows])
    if persons.any():
        amounts[INJURIES] = persons
    totals: dict[str, list[_Sampled]] = {}
    slabs = list(_slabs(len(inventory), every))
    parts = []
    for rows in slabs:
        sampled = [annual.of_items(rows) for annual in every]
        lost = [chances.of_items(rows, lost=True) for chances in every] if inventory.carried else sampled
        parts.append(weighed.of(sampled))
        for name, amount in amounts.items():
            share = members[:, rows] * amount[rows]
            of_slab = [drawn.summed(share) for drawn in (lost if name == LOSS else sampled)]
            before = totals.get(name)
            totals[name] = of_slab if before is None else [a.plus(b) for a, b in zip(before, of_slab, strict=True)]
    weighed.keep(FALL_RATE, ("block",), [np.concatenate(pieces) for pieces in zip(*parts, strict=True)], PER_YEAR)
    money = inventory.currency or DIMENSIONLESS
    for name, units in ((NUMBER, PER_YEAR), (LOSS, per_year(money)), (INJURIES, PER_YEAR)):
        if name in totals:
            weighed.keep(name, ("place",), weighed.of(totals[name]), units)
    weighed.keep(ANY_RATE, ("place",), weighed.of([annual.of_joined(annual.event()) for annual in every]), PER_YEAR)
    if inventory.consequences:
        of_words = [
            weighed.of([annual.of_joined(annual.event(word)) for annual in every]) for word in inventory.consequences
        ]
        stacked = [np.stack(words, axis=1) for words in zip(*of_words, strict=True)]
        weighed.keep(CONSEQUENCE_RATE, ("place", "consequence"), stacked, PER_YEAR)
    if any(row.downtime is not None for row in inventory.rows):
        weighed.keep(DOWNTIME, ("place",), weighed.of([annual.downtime() for annual in every]), per_year(DAY))
    ranges = [
        range_of_a_year(
            assessments[branch.motions].sel(model=branch.model).data_vars, every[0].levels, branch.hazard, sampling.beta
        )
        for branch in branches
    ]
    for name, first_of_branches in ranges[0].items():
        mean = times(np.stack([of_branch[name].values for of_branch in ranges], axis=-1), weights)
        weighed.variables[f"epistemic_{name}"] = first_of_branches.copy(data=mean)
    beyond = np.array([annual.beyond for annual in every])
    text = "share of the expected falls from shaking beyond the hazard curve's or above the highest level"
    weighed.variables[BEYOND] = variable(("branch",), beyond, DIMENSIONLESS, text)
    return xr.Dataset(
        weighed.variables,
        coords={
            name: variable((dim,), np.array(values), DIMENSIONLESS, text)
            for name, dim, values, text in (
                ("epistemic_fractile", "epistemic_fractile", FRACTILES, "probability that the rate is lower"),
                ("epistemic_source", "epistemic_source", np.array(SOURCES, object), "what spreads the rate"),
                ("branch_model", "branch", np.array([branch.model for branch in branches], object), "model"),
                ("branch_motions", "branch", np.array([branch.motions for branch in branches], object), "motions"),
                ("branch_hazard", "branch", np.array([branch.hazard_name for branch in branches], object), "hazard"),
                ("branch_weight", "branch", weights, "weight of the branch"),
            )
        },
    )


TEXTS = {
    FALL_RATE: "annual rate at which a piece overturns",
    ANY_RATE: "annual rate at which at least one piece overturns",
    NUMBER: "expected annual pieces overturned",
    LOSS: "expected annual value overturned",
    DOWNTIME: "expected annual longest downtime of what overturned",
    INJURIES: "expected annual injured persons",
    CONSEQUENCE_RATE: "annual rate at which at least one piece with the consequence overturns",
}


class _Sampled(NamedTuple):
    """Rates of one branch: means (row,) over the modelling uncertainty, and its best estimates and samples."""

    mean: Array
    rates: SampledRates

    def summed(self, share: Array) -> _Sampled:
        """Return sums over rows with their shares (place, row)."""
        given = (self.mean, self.rates.mean, self.rates.samples, self.rates.modelled)
        mean, rates, plain, modelled = (np.einsum("pr,r...->p...", share, values) for values in given)
        return _Sampled(mean, SampledRates(rates, plain, modelled, self.rates.weights))

    def plus(self, other: _Sampled) -> _Sampled:
        """Return the sums with the rates of other items."""
        a, b = self.rates, other.rates
        sums = SampledRates(a.mean + b.mean, a.samples + b.samples, a.modelled + b.modelled, a.weights)
        return _Sampled(self.mean + other.mean, sums)


@dataclass
class _Found:
    """Variables of the results, as they are found."""

    variables: dict[str, xr.Variable]
    branches: Sequence[InventoryBranch]
    weights: Array

    def of(self, sampled: Sequence[_Sampled]) -> tuple[Array, Array, Array, Array]:
        """Weigh the rates of all branches: means, fractiles, shares of the spread and values of branches, by row."""
        rates = [values.rates for values in sampled]
        of_branches = np.stack([rate.mean for rate in rates], axis=-1)
        names = [(branch.model, branch.motions, branch.hazard_name) for branch in self.branches]
        return (
            times(np.stack([values.mean for values in sampled], axis=-1), self.weights),
            fractiles_of(rates, self.weights, FRACTILES),
            shares_of_spread(names, rates, self.weights),
            of_branches,
        )

    def keep(self, name: str, dims: tuple[str, ...], weighed: Sequence[Array], units: str) -> None:
        """Keep the results of one value."""
        mean, fractiles, shares, of_branches = weighed
        text = TEXTS[name]
        self.variables |= {
            f"epistemic_{name}": variable(dims, mean, units, f"{text}, mean over all branches"),
            f"epistemic_{name}_fractile": variable(
                (*dims, "epistemic_fractile"), fractiles, units, f"{text}: the value of the fractile"
            ),
            f"epistemic_{name}_spread": variable(
                (*dims, "epistemic_source"), shares, DIMENSIONLESS, f"share of the variance of ln({name})"
            ),
            f"branch_{name}": variable((*dims, "branch"), of_branches, units, f"{text}, of the branch alone"),
        }


class _Branch:
    """One branch: the weights of its levels under each realisation of its hazard, and its flags."""

    def __init__(
        self, branch: InventoryBranch, assessment: xr.Dataset, inventory: Inventory, members: Flags, sampling: Sampling
    ) -> None:
        self.levels = assessment["level"].values
        labels = [str(value) for value in assessment["model"].values]
        self.at = labels.index(branch.model)
        self.assessment = assessment
        self.chances = ItemChances(assessment, np.arange(len(inventory)))
        self.runs = assessment.sizes["motion"]
        self.every = Year.of(assessment, np.ones(self.levels.size))
        self.motions = self.runs // self.every.polarities
        self.drawn = draw_motions(self.every.strata(self.runs), sampling.replicates, sampling.seed)
        self.hazard, self.sampling, self.members = branch.hazard, sampling, members
        self.inventory, self.classes = inventory, np.array([row.class_label for row in inventory.rows], dtype=object)
        self.standing = np.array([not row.anchored for row in inventory.rows])
        rows = (branch.hazard.rates,) if branch.hazard.realisations is None else branch.hazard.realisations
        single_curve = replace(branch.hazard, realisations=None, weights=None, fractile=None)
        self.curves = [replace(single_curve, rates=tuple(row)) for row in rows]
        self.shares = np.ones(1) if branch.hazard.weights is None else np.asarray(branch.hazard.weights)
        self.number = np.zeros(self.levels.size)
        self._shifted = [self._states(curve) for curve in self.curves] if sampling.beta > 0.0 else []

    def _year(self, hazard: HazardCurve, beta: float) -> Year:
        return Year(level_weights(self.levels, covering(hazard, self.levels, beta)).weights)

    def _year_at(self, rates: Array) -> Year:
        """Return the sums, motion by motion, over points of the intensity with annual rates (point,)."""
        return Year(rates, polarities=self.every.polarities)

    def _states(self, hazard: HazardCurve) -> ShiftedLevels:
        beta = self.sampling.beta
        mean = covering(hazard, self.levels, beta)
        return ShiftedLevels.between(level_weights(self.levels, mean), mean, hazard, beta)

    def of_items(self, rows: slice, lost: bool = False) -> _Sampled:
        """Return the rates of a slab of items; `lost`: also if their support falls."""
        given = (self.chances.lost if lost else self.chances.piece)(slice(self.at, self.at + 1), rows)[0]
        counts = np.array([row.count for row in self.inventory.rows[rows]])
        if not lost:
            self.number += np.einsum("i,ilm->l", counts, given) / self.runs
        return self._of_rows(given, self.classes[rows])

    def _of_rows(self, given: Array, labels: NDArray[np.object_]) -> _Sampled:
        """Return the annual values of rows (row, level, run), each of which one class decides."""
        beta, spread = self.sampling.beta, self.sampling.spread
        resampled = self.every.resampled(given, self.drawn)
        mean = self._year(self.hazard, beta).total(given).mean(axis=-1)
        inside = 0.0 if spread else beta
        mean_rates = self._year(self.hazard, inside).total(given).mean(axis=-1)
        plain = np.stack([self._year(curve, inside).total(resampled) for curve in self.curves], axis=-1)
        if not spread:
            return _Sampled(mean, SampledRates(mean_rates, plain, plain, self.shares))
        modelled = np.empty_like(plain)
        for label in dict.fromkeys(labels):
            of_class = np.flatnonzero(labels == label)
            scores = self.sampling.scores(str(label), self.drawn.shape[0])
            for r, (states, curve) in enumerate(zip(self._shifted, self.curves, strict=True)):
                # the weights of levels (level, sample) of capacities that are off by exp(shift)
                rates = curve.pieces()[0].rate(states.positions[:, None] + beta * scores)
                weights = rates - np.concatenate([rates[1:], np.zeros((1, scores.size))])
                modelled[of_class, :, r] = np.einsum("ils,ls->is", resampled[of_class], weights)
        return _Sampled(mean, SampledRates(mean_rates, plain, modelled, self.shares))

    def of_joined(self, rows: JoinedClasses) -> _Sampled:
        """Return the annual values of joint results of pieces."""
        beta, spread, together = self.sampling.beta, self.sampling.spread, rows.together
        if len(rows.classes) == 1:
            return self._of_rows(together, np.repeat(list(rows.classes), len(together)))
        resampled = self.every.resampled(together, self.drawn)

        def of(hazard: HazardCurve, dispersion: float) -> tuple[Array, Array]:
            """The annual value (row,), and over resampled motions (row, sample)."""
            if dispersion == 0.0:
                year = self._year(hazard, dispersion)
                return year.total(together).mean(axis=-1), year.total(resampled)
            states = self._states(hazard)
            totals = np.stack([self._year_at(states.rates).total(values) for values in rows.blurred(states)])
            return totals.mean(axis=-1), times(totals, self.drawn.T) / self.motions

        mean, _ = of(self.hazard, beta)
        inside = 0.0 if spread else beta
        mean_rates, _ = of(self.hazard, inside)
        plain = np.stack([of(curve, inside)[1] for curve in self.curves], axis=-1)
        if not spread:
            return _Sampled(mean, SampledRates(mean_rates, plain, plain, self.shares))
        number = min(JOINT_SAMPLES, self.drawn.shape[0])
        scores = {label: self.sampling.scores(label, number) for label in rows.classes}
        modelled = np.empty((mean.size, number, len(self.curves)))
        for r, states in enumerate(self._shifted):
            for s in range(number):
                cases, rates = _cases(states, {label: beta * score[s] for label, score in scores.items()})
                of_rows = np.stack([self._year_at(rates).total(values) for values in rows.at(cases)])
                modelled[:, s, r] = times(of_rows, self.drawn[s]) / self.motions
        return _Sampled(mean, SampledRates(mean_rates, plain, modelled, self.shares))

    def event(self, word: str = "") -> JoinedClasses:
        """Return the fall of anything in each place, or of anything with a consequence."""
        sets = self.members & self.standing
        if word:
            sets = sets & np.array([word in row.consequences for row in self.inventory.rows])
        shape = (self.members.shape[0], 1 + self.levels.size, self.runs)
        stays: dict[str, Array] = {}
        for i in np.flatnonzero(sets.any(axis=0)):
            none = stays.setdefault(str(self.classes[i]), np.ones(shape))
            none[sets[:, i], 1:] *= 1.0 - self.chances.any_piece_of(self.at, int(i))
        return JoinedClasses(stays or {"": np.ones(shape)})

    def downtime(self) -> _Sampled:
        """Return the annual longest downtime in each place, summed over its cells as `JointFlags.add_longest` does."""
        flags = fall_flags(self.assessment).isel(model=[self.at]).values
        variability = self.sampling.variability
        joint = JointFlags(
            self.inventory, flags, self.members, np.zeros(0), variability, polarities=self.every.polarities
        )
        places, shape = len(self.members), (self.levels.size, self.runs)
        lasting = self.standing & np.array([row.downtime is not None for row in self.inventory.rows])
        parts = {
            str(label): joint.part(np.flatnonzero((self.classes == label) & lasting))
            for label in dict.fromkeys(self.classes)
        }
        sums = []
        for cells in joint.cells(places * math.prod(shape)):
            widths = np.diff(joint.days)[cells]
            stays = {}
            for label, part in parts.items():
                if part is not None:
                    within = part.within(joint.days, cells)[:, 0].reshape(-1, *shape)
                    stays[label] = np.concatenate([np.ones_like(within[:, :1]), within], axis=1)
            stays = stays or {"": np.ones((widths.size * places, 1 + shape[0], self.runs))}
            share = (np.eye(places)[:, None] * widths[:, None]).reshape(places, -1)
            sums.append(self.of_joined(JoinedClasses(stays)).summed(share))
        return reduce(_Sampled.plus, sums)

    @property
    def beyond(self) -> float:
        """The share of the expected falls from motions beyond the curve's levels, or above the runs' highest level."""
        plain = covering(self.hazard, self.levels)
        rates = np.asarray(plain.rates)

        def value(of: Array) -> float:
            return float(times(line_weights(self.levels, plain, of).weights, self.number))

        whole = value(rates)
        if not whole > 0.0:
            return 0.0
        below = whole - value(np.minimum(rates, self.hazard.rates[0]))
        above = value(np.minimum(rates, self.hazard.rates[-1]))
        last = 0.0
        standing = sum(row.count for row in self.inventory.rows if not row.anchored)
        if self.number[-1] < SETTLED * standing:
            last = line_weights(self.levels, plain, rates).above * float(self.number[-1])
        return float(np.clip(max(below, above, last) / whole, 0.0, 1.0))


def _cases(states: ShiftedLevels, shifts: Mapping[str, float]) -> tuple[dict[str, Index], Array]:
    """Return the states of all classes (case,) and their annual rates: points at which all states are equal are one."""
    at = np.stack([np.searchsorted(states.positions, states.points - shift, side="right") for shift in shifts.values()])
    first = np.flatnonzero(np.concatenate([[True], (at[:, 1:] != at[:, :-1]).any(axis=0)]))
    return dict(zip(shifts, at[:, first], strict=True)), np.add.reduceat(states.rates, first)


def _slabs(items: int, branches: Sequence[_Branch]) -> Iterator[slice]:
    """Yield slabs of items, few enough for the arrays of all branches."""
    of_one = sum(branch.drawn.shape[0] * (branch.levels.size + 2 * len(branch.curves)) for branch in branches)
    step = max(1, SLAB // of_one)
    for start in range(0, items, step):
        yield slice(start, min(items, start + step))


def combinations(
    models: Mapping[str, float], motions: Mapping[str, float], hazards: Mapping[str, tuple[HazardCurve, float]]
) -> list[InventoryBranch]:
    """Return all combinations of laws, motions and hazard curves with their weights."""
    return [
        InventoryBranch(model, shaken, name, curve, share * weight * part)
        for (model, share), (shaken, weight), (name, (curve, part)) in product(
            models.items(), motions.items(), hazards.items()
        )
    ]
