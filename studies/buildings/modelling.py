"""Modelling uncertainty of an inventory: at x a class falls as computed at x exp(-beta_m Z), with one Z per class."""

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Self

import numpy as np
import scipy

from ...core.elementary import Array, Index, exp, geomspace, log
from ...core.streams import key_of, stream
from ...fragility import HazardCurve
from ...fragility.hazard.level_weights import LevelWeights
from ...fragility.risk.modelling import blurred
from ..inventory.contents import Inventory
from .outcomes import ANY, JointFlags, JointOutcomes

DRAWS = 32
"""Draws of the scores of the classes for each motion."""
MOST_POINTS = 400
"""Maximum number of points of the intensity at which joint outcomes are evaluated for annual values."""
POINTS_A_BETA = 10.0
"""Points in one beta_m of ln(level)."""
REACH = 5.0
"""Standard deviations of the scores that the points reach."""
SCORES = np.linspace(-3.0, 3.0, 13)
"""Scores whose levels are run for values at a given level."""


def covering(hazard: HazardCurve, levels: Array, modelling: float = 0.0) -> HazardCurve:
    """Return the hazard as points from below to above the levels, blurred by `modelling` (beta_m) if given."""
    lowest = min(hazard.levels[0], levels[0] ** 2 / levels[1] if levels.size > 1 else levels[0])
    highest = max(hazard.levels[-1], levels[-1])
    if modelling > 0.0:
        return blurred(hazard, modelling, np.array([lowest, highest]))
    # (between points this close a second-order curve is nearly straight)
    bent = geomspace(lowest, highest, 2000) if hazard.curvature > 0.0 else np.empty(0)
    ends = [level for level in (lowest, highest) if level not in hazard.levels]
    return hazard.resampled(np.unique(np.concatenate([ends, hazard.levels, bent])))


class Mixture(ABC):
    """Random states of a class of pieces at points of the intensity: j is its outcome at level j - 1, 0 is no fall."""

    @property
    @abstractmethod
    def shares(self) -> Array:
        """The probability of each state (point, state)."""

    @abstractmethod
    def states(self, shares: Array) -> Index:
        """Return the states (point, …) where the score has cumulative probabilities `shares` (…), from 0 to 1."""

    def of(self, values: Array, nothing: float = 0.0) -> Array:
        """Return the means (…, point, motion) of values (…, level, motion) that are `nothing` if nothing falls."""
        shares = self.shares
        means = np.empty((*values.shape[:-2], shares.shape[0], values.shape[-1]))
        means[...] = nothing  # (shares sum to 1 except for rounding, which would leave 1e-19 of it)
        for level in range(values.shape[-2]):  # (in the order of the levels, whatever the other dimensions are)
            means += shares[:, level + 1][:, None] * (values[..., level, :] - nothing)[..., None, :]
        return means


@dataclass(frozen=True)
class ShiftedLevels(Mixture):
    """States for annual values: a class reaches level j if ln(intensity) exceeds positions[j] + beta_m Z.

    `positions` (level,): ln of the capacity whose annual rate equals the rate of levels j and above. `points` (point,):
    ln of the intensity. `rates` (point,): annual rates of the intensity about each point, 1/year.
    """

    positions: Array
    points: Array
    rates: Array
    beta: float

    @classmethod
    def between(cls, weights: LevelWeights, mean: HazardCurve, hazard: HazardCurve, beta: float) -> Self:
        """Make the states for weights of levels under the `mean` hazard (`blurred`), and the hazard itself.

        The mean hazard at the position of a level is the sum of the weights from there on. Each class alone thus has
        the annual values of the weights: E[H(c exp(beta_m Z))] is the mean hazard at c.
        """
        positions = positions_of(weights.weights, mean)
        curve = hazard.pieces()[0]
        slope = float(curve.slope_at(curve.find(positions[:1]), positions[:1])[0])
        # (rare high capacities fall at frequent shaking: their scores centre on minus slope times beta_m)
        low = positions[0] - max(slope, 0.0) * beta**2 - REACH * beta
        high = positions[-1] + REACH * beta
        number = min(MOST_POINTS, math.ceil((high - low) / beta * POINTS_A_BETA))
        edges = np.linspace(low, high, number + 1)
        above = curve.rate(edges)
        rates = above[:-1] - above[1:]
        rates[-1] += above[-1]
        return cls(positions, 0.5 * (edges[:-1] + edges[1:]), rates, beta)

    @property
    def shares(self) -> Array:
        reached = scipy.special.ndtr((self.points[:, None] - self.positions) / self.beta)
        ends = np.ones((self.points.size, 1))
        return np.asarray(np.concatenate([ends, reached], axis=1) - np.concatenate([reached, 0.0 * ends], axis=1))

    def states(self, shares: Array) -> Index:
        at = self.points.reshape(-1, *(1 for _ in shares.shape)) - self.beta * scipy.special.ndtri(shares)
        return np.searchsorted(self.positions, at, side="right")


@dataclass(frozen=True)
class ScoredLevels(Mixture):
    """States for values at given levels: for each level the numbers of its runs for `SCORES`, runs (point, score)."""

    runs: Index

    @property
    def weights(self) -> Array:
        """The probabilities of the scores: of the normal density at equal steps."""
        density = exp(-0.5 * SCORES**2)
        return np.asarray(density / density.sum())

    @property
    def shares(self) -> Array:
        shares = np.zeros((self.runs.shape[0], 2 + int(self.runs.max())))
        np.add.at(shares, (np.arange(self.runs.shape[0])[:, None], self.runs + 1), self.weights)
        return shares

    def states(self, shares: Array) -> Index:
        score = np.minimum(np.searchsorted(np.cumsum(self.weights), shares), SCORES.size - 1)
        return np.asarray(self.runs[:, score] + 1)


def scored_levels(levels: Array, beta: float) -> tuple[Array, ScoredLevels]:
    """Return the levels that have to be run for values at given levels, increasing, and the states that they make.

    Levels are x exp(-beta_m z) for thirteen scores z from -3 to 3. For a lognormal capacity of dispersion beta, the
    mean over these of Phi(ln(x/c)/beta - beta_m z/beta) is Phi(ln(x/c)/sqrt(beta² + beta_m²)). The error is 0.2 % if
    beta >= beta_m/2.
    """
    every = levels[:, None] * exp(-beta * SCORES)
    run = np.unique(every)
    return run, ScoredLevels(np.searchsorted(run, every))


def positions_of(weights: Array, hazard: HazardCurve) -> Array:
    """Return ln x (level,) at which a hazard curve has the rates of the weights from each level on."""
    u, fall = log(hazard.levels), -log(hazard.rates)
    wanted = -log(np.cumsum(weights[::-1])[::-1])
    positions = np.interp(wanted, fall, u)
    for outside, a, b in ((wanted < fall[0], 0, 1), (wanted > fall[-1], -1, -2)):
        slope = (u[b] - u[a]) / (fall[b] - fall[a])
        positions = np.where(outside, u[a] + slope * (wanted - fall[a]), positions)
    return np.asarray(positions)


def several_classes(inventory: Inventory) -> bool:
    """Return True if the pieces that may fall are of several classes."""
    return len({row.class_label for row in inventory.rows if not row.anchored}) > 1


def refuse_own_motions(inventory: Inventory, own_motions: bool) -> None:
    """Raise a ValueError if classes would be joined at levels that have no motion in common."""
    if own_motions and several_classes(inventory):
        raise ValueError(
            "modelling_dispersion of several classes of pieces needs the same motions at all levels, but each level "
            "has motions of its own: put all pieces into one class (the inventory's column 'class'), or leave it out"
        )


def joined(joint: JointFlags, mixture: Mixture) -> JointOutcomes:
    """Join the outcomes of all classes in random states at points of the intensity, as `JointFlags.results` does."""
    flags = joint.flags
    models, motions, points = flags.shape[0], flags.shape[-1], mixture.shares.shape[0]
    of_places = (models, joint.members.shape[0], points, motions)
    quantities, events = joint.quantities, joint.events
    outcomes_at = JointOutcomes(
        {quantity.name: joint.filled(of_places, 0.0) for quantity in quantities},
        {quantity.name: joint.filled((*of_places, DRAWS), 0.0) for quantity in quantities},
        {event.name: joint.filled((models, *event.sets.shape[:-1], points, motions), 1.0) for event in events},
    )
    words = joint.inventory.consequences
    labels = np.array([row.class_label for row in joint.inventory.rows], dtype=object)
    parts = [
        (str(label), joint.part(np.flatnonzero((labels == label) & joint.exposed))) for label in dict.fromkeys(labels)
    ]
    classes = [(label, part) for label, part in parts if part is not None]
    for label, part in classes:
        joint_part = part.results
        for event in part.events:
            stays = mixture.of(1.0 - joint_part.happens[event.name], 1.0)
            if event.name == ANY:
                outcomes_at.happens[ANY] *= stays
                continue
            for i, word in enumerate(part.inventory.consequences):
                outcomes_at.happens[event.name][:, :, words.index(word)] *= stays[:, :, i]
        named = {quantity.name for quantity in part.quantities}
        scores = _scores(label, motions // joint.polarities, joint.scores.seed)
        for quantity in quantities:
            if quantity.name not in named:
                continue
            if not quantity.greatest:
                outcomes_at.expected[quantity.name] += mixture.of(joint_part.expected[quantity.name])
            outcomes = joint_part.outcomes[quantity.name]
            for motion in range(motions):
                of_motion = motion // joint.polarities  # (both polarities of a motion have the same draws)
                states = mixture.states(scores[of_motion])
                fillings = (of_motion * DRAWS + np.arange(DRAWS)) % outcomes.shape[-1]
                of_state = np.concatenate([np.zeros_like(outcomes[:, :, :1, motion]), outcomes[:, :, :, motion]], 2)
                drawn = of_state[:, :, states, fillings]
                outcomes_of = outcomes_at.outcomes[quantity.name][:, :, :, motion]
                (np.maximum if quantity.greatest else np.add)(outcomes_of, drawn, out=outcomes_of)

    def within(days: Array, cells: slice) -> Array:
        stays = np.ones((days[:-1][cells].size, *of_places))
        for _, part in classes:
            stays *= mixture.of(part.within(days, cells), 1.0)
        return stays

    outcomes_at.complete(joint, within)
    return outcomes_at


def _scores(label: str, motions: int, seed: int) -> Array:
    """Return cumulative probabilities (motion, draw) of a class's scores: one in each of equal parts, in any order."""
    generator = stream(seed, *key_of(f"modelling uncertainty of the class {label}"))
    order = generator.permuted(np.tile(np.arange(DRAWS), (motions, 1)), axis=1)
    return np.asarray((order + generator.random((motions, DRAWS))) / DRAWS)
