"""Sliding in an inventory: runs of its pieces with some coefficients of friction, and what follows as variables.

A piece whose friction is below b/h slides and never rocks; with more it rocks and is taken not to slide.  Every line is
run with equally probable coefficients on the motions of its floor, next to its runs of rocking: what slides instead of
rocking, how far, and what falls off an edge.  Where both horizontal components shake, they slide along each axis by
itself (`toppling.fragility.slide_runs`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
import xarray as xr

from ...aliases import Array, Flags, Index
from ...doubts import Doubt
from ...fragility.analyses.sliding import AFTER, SLIDES_ON, SLIPS, coefficients_of, slips_of
from ...fragility.hazard.levels import LevelWeights
from ...fragility.numerics.slabs import RUNS
from ...fragility.runs.axes import along_depth
from ...fragility.runs.provenance import AXES, configuration_of
from ...fragility.runs.runners import Runner
from ...fragility.uncertainty.joint import INDEPENDENT, TOGETHER, PieceDraws, Variability, pieces_of
from ...fragility.validity.plausibility import cut_slides, end_doubts
from ...models import Block, Law
from ...models.friction import FixedFriction, Friction
from ...models.sliding.law import Slider
from ...models.sliding.mode import demand, demand_in_plane
from ...motions.arrays import Record
from ...streams import stream
from ...units import DIMENSIONLESS, METRE
from ...wording import listed_name, two_digit_percent
from ..inventory.consequences import REALISATIONS
from ..inventory.contents import Contents, Inventory
from ..plan.slides import (
    DISTANCES,
    GATED,
    INSTEAD,
    NEAR,
    SHARE,
    SLIP,
    exact_friction_notes,
    is_free,
    near_uplift,
    of_near,
    slide_notes,
)
from .outcomes import JointFlags
from .shaking import Shaken, Support, support_of
from .variables import PER_YEAR, Modelled, Precision, Variables, Year, of_motions, variable, with_interval

COEFFICIENTS = 20
"""Equally probable coefficients of friction of a line whose pieces do not differ otherwise."""
ORDER_OF_FRICTION = 2
"""Key of the stream that orders the coefficients; restitution and slenderness have 0 and 1 (`Variability.sample`)."""
SLIP_RATE = f"item_{SLIP.removesuffix('_probability')}_rate"
GATED_RATE = "item_gated_rate"
OFF, OFF_RATE = "off_probability", "item_off_rate"
MOVES, MOVES_RATE = "support_moves_probability", "item_support_moves_rate"
MOVES_SHARE, ITEM_MOVES_SHARE = "support_moves_share", "item_support_moves_share"
OVERTURNING, OVERTURNING_RATE = "overturning_probability", "item_overturning_rate"


@dataclass(frozen=True)
class Slipping:
    """What is asked of slips: those whose chances are wanted (m), and whether the pieces of a line share a coefficient.

    `shared` counts where the pieces of a line do not differ otherwise; else `Variability.pieces` says it.
    """

    distances: tuple[float, ...] = DISTANCES
    shared: bool = True


@dataclass(frozen=True)
class FrictionDraws:
    """Pieces that differ in their friction alone: each variant is one of the equally probable coefficients."""

    pieces: str
    variants: int = COEFFICIENTS
    realisations: int = REALISATIONS
    seed: int = 0


def draws_of(
    inventory: Inventory, variability: Variability | None, slipping: Slipping, seed: int = 0
) -> PieceDraws | None:
    """Return how pieces are drawn from variants; None where they do not differ, and none can slide over an edge."""
    if variability is not None or not any(map(falls_off, inventory.rows)):
        return variability
    return FrictionDraws(TOGETHER if slipping.shared else INDEPENDENT, seed=seed)


def slides(row: Contents) -> bool:
    """Return whether the slips of a line are known: it has friction, stands free, and is not anchored."""
    return row.friction is not None and not row.anchored and is_free(row.block)


def falls_off(row: Contents) -> bool:
    """Return whether the pieces of a line can slide over an edge."""
    return row.block.edge is not None and slides(row)


def faces_an_edge(block: Block) -> bool:
    """Return whether the edges in front of a block and behind it differ, so that a motion and its reverse do."""
    return block.edge is not None and block.edge.front != block.edge.back


class SlidingRuns:
    """Runs of the lines of an inventory that can slide, floor by floor, reduced to counts and flags.

    `counts` (line, 1 + slip, level, motion): the number of variants that slide, and those that slip farther than each
    distance; `rows` are the lines.  `off` (line, variant, level, motion): 1 where a variant falls off in front, -1
    behind, 0 where it stays; `edged` are these lines.  `moving` (line, level, motion): the probability that what a line
    stands on slides or rocks; `above` are these lines.  Where the vertical acceleration takes the weight of a piece
    that slides, it counts as slipped beyond every distance and over its edge.  `cut`: whether each motion, by its
    label, ends while a piece still slides.  `plane`: both components of the motions shake the lines.
    """

    def __init__(
        self,
        inventory: Inventory,
        law: Law,
        slipping: Slipping,
        variability: Variability | None,
        shape: tuple[int, int],
        polarities: int,
        runner: Runner,
        plane: bool = False,
    ) -> None:
        self.inventory, self.law, self.distances = inventory, law, np.array(slipping.distances)
        self.plane = plane
        self.variability, self.shape, self.polarities, self.runner = variability, shape, polarities, runner
        self.rows = [i for i, row in enumerate(inventory.rows) if slides(row)]
        self.edged = [i for i in self.rows if falls_off(inventory.rows[i])]
        self.variants = COEFFICIENTS if variability is None else variability.variants
        self.above = [i for i, row in enumerate(inventory.rows) if row.stands_on and not row.anchored]
        self.moving = runner.array((len(self.above), *shape), np.float64)
        self.counts = runner.array((len(self.rows), 1 + self.distances.size, *shape), np.uint16)
        self.off = runner.array((len(self.edged), self.variants, *shape), np.int8)
        self._at, self._edge_at, self._above_at = (
            {i: k for k, i in enumerate(lines)} for lines in (self.rows, self.edged, self.above)
        )
        self.cut: dict[str, bool] = {}
        self._by_label = {row.label: row for row in inventory.rows if self.above}
        self.done = 0

    @cached_property
    def order(self) -> Index:
        """Which coefficient each variant has: in increasing order, or at random where variants differ otherwise."""
        if self.variability is None:
            return np.arange(self.variants)
        return stream(self.variability.seed, ORDER_OF_FRICTION).permutation(self.variants)

    def blocks_of(self, row: Contents) -> list[Block]:
        """Return the block of each variant of a line."""
        found = [block for block, _ in pieces_of(row.block, self.law, row.e, self.variability)]
        return found if self.variability is not None else found * self.variants

    def rocks(self, row: Contents) -> Array:
        """Return the chance that the friction of each variant (variant,) is at least its b/h."""
        assert row.friction is not None
        return 1.0 - row.friction.below(np.array([block.b / block.h for block in self.blocks_of(row)]))

    def run(self, at: Support, shaken: Shaken) -> None:
        """Run the lines of a support under its motions."""
        here, above = (
            [i for i in lines if support_of(self.inventory.rows[i]) == at] for lines in (self.rows, self.above)
        )
        if not here and not above:
            return
        motions, factors = shaken.motions[:: self.polarities], shaken.factors[0, :, :: self.polarities]
        needed = _Needed(motions, factors, self.shape[0], self.polarities, self.plane)
        for i in above:
            below = self._by_label[self.inventory.rows[i].stands_on]
            self.moving[self._above_at[i]] = _moves(below, needed)
        kinds: dict[tuple[Friction, float], list[int]] = {}
        for i in here:
            row = self.inventory.rows[i]
            assert row.friction is not None
            kinds.setdefault((row.friction, row.kinetic_ratio), []).append(i)
        for (friction, ratio), lines in kinds.items():
            coefficients = coefficients_of(friction, self.variants)
            blocks = {i: self.blocks_of(self.inventory.rows[i]) for i in lines}
            for i in lines:
                self.counts[self._at[i]] = 0
                if i in self._edge_at:
                    self.off[self._edge_at[i]] = 0
            highest = max(self._slides_below(block) for own in blocks.values() for block in own)
            sliding = np.unique(coefficients[coefficients < highest])
            step = max(1, RUNS // factors.size)  # (slips are kept for so many runs at a time)
            for first in range(0, sliding.size, step):
                part = sliding[first : first + step].tolist()
                along = self._slips(part, ratio, motions, factors)
                across = self._slips(part, ratio, list(map(along_depth, motions)), factors) if self.plane else None
                for k, mu in enumerate(part):
                    slips = _Slips(*(one[k] for one in (*along, *(across or ()))))
                    variants = np.flatnonzero(coefficients[self.order] == mu)
                    for i in lines:
                        for variant in variants.tolist():
                            self._add(i, variant, blocks[i][variant], needed, mu, slips)
            self.done += len(lines)
            self.runner.tell("slips", self.done, len(self.rows))

    def _slips(
        self, coefficients: list[float], ratio: float, motions: Sequence[Record], factors: Array
    ) -> tuple[Array, Array]:
        """Return the slips to the front and to the back (coefficient, level, motion) of all runs, m."""
        sliders = [Slider(mu, mu, ratio * mu, ratio * mu) for mu in coefficients]
        found = slips_of(sliders, motions, factors, self.runner, (*SLIPS, AFTER))
        for motion, on in zip(motions, cut_slides(found["slide_peak"], found[AFTER]).tolist(), strict=True):
            self.cut[motion.label] = on or self.cut.get(motion.label, False)
        sides = [
            np.nan_to_num(found[name], nan=math.inf).reshape(len(sliders), self.shape[0], -1)
            for name in ("slide_forward", "slide_backward")
        ]
        if self.polarities == 1:
            return sides[0], sides[1]
        # the reverse of a motion takes the piece as far to the other side
        both = [np.stack(pair, axis=-1).reshape(len(sliders), *self.shape) for pair in (sides, sides[::-1])]
        return both[0], both[1]

    def _slides_below(self, block: Block) -> float:
        """Return the coefficient below which a block slides: its b/h, in the plane that along the depth."""
        half = 0.5 * block.depth if self.plane and block.depth is not None else block.b
        return float(half / block.h)

    def _add(self, i: int, variant: int, block: Block, needed: _Needed, mu: float, slips: _Slips) -> None:
        """Count a variant of line i with its coefficient and its slips (level, motion) where it moves at all."""
        if mu >= self._slides_below(block):
            return
        moves = needed.of(block.b / block.h) > mu
        if self.plane:  # (with a friction above b/h of the width it slides along both axes or not at all)
            slips = _Slips(*(np.where(moves, one, 0.0) for one in slips if one is not None))
        counts = self.counts[self._at[i]]
        counts[0] += moves
        for d, distance in enumerate(self.distances):
            counts[d + 1] += slips.peak > distance
        if block.edge is not None:
            front, _ = block.edge.slips(block.b)
            gone = block.edge.fallen_off(slips.forward, slips.backward, block.b)
            self.off[self._edge_at[i], variant] = np.where(gone, np.where(slips.forward > front, 1, -1), 0)

    @property
    def doubts(self) -> list[Doubt]:
        """The doubt in motions at whose end pieces still slide."""
        return end_doubts([*self.cut.values()], [*self.cut])

    def fallen(self, overturned: Flags) -> Flags:
        """Return flags (model, item, variant, level, motion) of pieces that overturned, as if none slid, or fell off.

        overturned: the flags of the runs of rocking, with one variant where pieces do not differ otherwise.
        """
        return self._joined(overturned, None, 0)

    def fallen_forward(self, front: Flags, overturned: Flags) -> Flags:
        """Return flags of pieces that overturned to the front, or stood and fell off in front."""
        return self._joined(front, overturned, 1)

    def _joined(self, flags: Flags, overturned: Flags | None, side: int) -> Flags:
        models, items, _, *shape = flags.shape
        found = self.runner.array((models, items, self.variants, *shape), np.bool_)
        for k in range(models):
            for i in range(items):
                found[k, i] = flags[k, i]
                if i in self._edge_at:
                    own = self.off[self._edge_at[i]]
                    gone = own != 0 if side == 0 else own == side
                    found[k, i] |= gone if overturned is None else gone & ~overturned[k, i]
        return found


class _Slips(NamedTuple):
    """Greatest slips (level, motion) of one coefficient, m; along the depth, too, where both components shake."""

    forward: Array
    backward: Array
    left: Array | None = None
    right: Array | None = None

    @property
    def peak(self) -> Array:
        """The greatest slip to any side, of both axes the square root of the sum of squares."""
        along = np.maximum(self.forward, self.backward)
        if self.left is None or self.right is None:
            return along
        return np.asarray(np.hypot(along, np.maximum(self.left, self.right)))


class _Needed:
    """The friction (level, motion) that keeps blocks in place under the motions of a support."""

    def __init__(self, motions: Sequence[Record], factors: Array, levels: int, polarities: int, plane: bool) -> None:
        self.motions, self.factors, self.plane = motions, factors, plane
        self.levels, self.polarities = levels, polarities
        self._known: dict[float, Array] = {}
        self.along, self.across = self._of(motions), self._of(list(map(along_depth, motions))) if plane else None

    def _of(self, motions: Sequence[Record]) -> Array:
        return self._on_runs(
            [demand(one.acceleration, one.vertical, self.factors[:, k].copy()) for k, one in enumerate(motions)]
        )

    def _on_runs(self, values: list[Array]) -> Array:
        return np.repeat(np.stack(values, axis=1).reshape(self.levels, -1), self.polarities, axis=1)

    def of(self, level: float) -> Array:
        """Return the friction of a block with this b/h along its width."""
        if not self.plane:
            return self.along
        if level not in self._known:
            self._known[level] = self._on_runs(
                [
                    demand_in_plane(
                        one.acceleration, along_depth(one).acceleration, one.vertical, self.factors[:, k], level
                    )
                    for k, one in enumerate(self.motions)
                ]
            )
        return self._known[level]


def _moves(row: Contents, needed: _Needed) -> Array:
    """Return the probability that a piece slides or rocks in the runs of its support."""
    if row.anchored:
        return np.zeros_like(needed.along)
    assert row.friction is not None  # (an inventory checks it)
    if needed.across is None:
        return np.where(needed.along > row.block.b / row.block.h, 1.0, row.friction.below(needed.along))
    rocks = needed.along > row.block.b / row.block.h
    if row.block.depth is not None:
        rocks |= needed.across > 0.5 * row.block.depth / row.block.h
    return np.where(rocks, 1.0, row.friction.below(needed.of(np.inf)))


class _Values(NamedTuple):
    """Something of some lines: its names, dimensions before the level, words, and chances (…, level, motion).

    rows: the lines that it is known of; chance: of a part of them.
    """

    name: str
    rate: str
    dims: tuple[str, ...]
    text: str
    rows: Sequence[int]
    chance: Callable[[slice], Array]

    @property
    def axis(self) -> int:
        """Where the lines are among the dimensions."""
        return self.dims.index("item")


def slide_variables(
    joint: JointFlags,
    overturned: Flags,
    runs: SlidingRuns,
    precision: Precision,
    weights: LevelWeights | None,
    own_motions: bool = False,
    modelled: Modelled | None = None,
) -> Variables:
    """Compute what sliding changes, line by line, and its annual rates where there are weights of the levels.

    joint, precision, weights, own_motions, modelled: as for `event_variables`; overturned: flags of the runs of rocking
    (model, item, variant, level, motion).  NaN of lines whose sliding is not known.
    """
    rows = joint.inventory.rows
    rocks = np.array([runs.rocks(rows[i]) for i in runs.rows]).reshape(len(runs.rows), -1)
    every, alone = range(len(rows)), np.ones((len(rows), overturned.shape[2]))

    def counted(which: int | slice) -> Callable[[slice], Array]:
        return lambda part: runs.counts[part, which] / runs.variants

    def gated(part: slice) -> Array:
        return _weighted(overturned, runs.rows[part], rocks[part])

    def toppled(part: slice) -> Array:
        return _weighted(overturned, every[part], alone[part])

    def gone(part: slice) -> Array:
        return np.asarray((runs.off[part] != 0).mean(axis=1))

    of_laws, edged = ("model", "item"), every if runs.edged else ()
    given = [
        _Values(SHARE, "", ("item",), "a piece slides", runs.rows, counted(0)),
        _Values(SLIP, SLIP_RATE, ("item", "slip"), "a piece slides farther", runs.rows, counted(slice(1, None))),
        _Values(GATED, GATED_RATE, of_laws, "a piece overturns, where it does not slide instead", runs.rows, gated),
        _Values(OFF, OFF_RATE, ("item",), "a piece slides off an edge", runs.edged, gone),
        _Values(OVERTURNING, OVERTURNING_RATE, of_laws, "a piece overturns, as if it could not slide", edged, toppled),
        _Values(MOVES, MOVES_RATE, ("item",), "what it stands on slides or rocks", runs.above, runs.moving.__getitem__),
    ]
    given = [one for one in given if one.rows]
    found = _chances_of_friction(rows, runs, rocks) if runs.rows else {}
    year = None if weights is None else Year(weights.weights, own_motions, joint.polarities)
    if runs.above:
        found |= _shares_with_moving_supports(joint, runs, year, modelled)

    def at_levels(one: _Values, part: slice) -> tuple[Array, Array, Array]:
        own = one.chance(part)
        chance = own if modelled is None else modelled.mixture.of(own)
        possible = joint.standing[list(one.rows[part])]
        sides = tuple(i for i in range(len(one.dims) + 1) if i != one.axis)
        return precision.of_probabilities(of_motions(chance, joint.polarities), np.expand_dims(possible, sides))

    for one in given:
        values, text = _of_lines(one, at_levels, len(rows), overturned.size), f"probability that {one.text}"
        found |= with_interval(one.name, (*one.dims, "level"), values, DIMENSIONLESS, text, precision)
    if year is None:
        return found
    yearly = replace(precision, strata=year.strata(overturned.shape[-1])) if own_motions else precision

    def in_a_year(one: _Values, part: slice) -> tuple[Array, Array, Array]:
        return yearly.of_means(year.total(one.chance(part)))

    for one in given:
        if one.rate:
            values, text = _of_lines(one, in_a_year, len(rows), overturned.size), f"annual rate at which {one.text}"
            found |= with_interval(one.rate, one.dims, values, PER_YEAR, text, precision)
    return found


def _shares_with_moving_supports(
    joint: JointFlags, runs: SlidingRuns, year: Year | None, modelled: Modelled | None
) -> Variables:
    """Return the shares of the falls of lines in runs in which what they stand on moves, given the level and in a year.

    The friction of a line and that of what it stands on are independent; NaN where nothing falls.
    """
    models, items, _, levels, _ = joint.flags.shape
    levels = levels if modelled is None else modelled.mixture.shares.shape[0]
    given, yearly = np.full((models, items, levels), np.nan), np.full((models, items), np.nan)
    with np.errstate(invalid="ignore"):
        for k, i in enumerate(runs.above):
            fell = joint.flags[:, i].mean(axis=1)
            both = fell * runs.moving[k]
            of_each = [one if modelled is None else modelled.mixture.of(one) for one in (both, fell)]
            given[:, i] = of_each[0].sum(axis=-1) / of_each[1].sum(axis=-1)
            if year is not None:
                yearly[:, i] = year.total(both).sum(axis=-1) / year.total(fell).sum(axis=-1)
    text = "share of the falls in runs in which what it stands on slides or rocks"
    found = {MOVES_SHARE: variable(("model", "item", "level"), given, DIMENSIONLESS, text)}
    if year is not None:
        found[ITEM_MOVES_SHARE] = variable(("model", "item"), yearly, DIMENSIONLESS, f"{text}, of those of a year")
    return found


def _chances_of_friction(rows: Sequence[Contents], runs: SlidingRuns, rocks: Array) -> Variables:
    """Return the chances of a friction below b/h, and between b/h and 1.3 b/h, means over the variants of each line."""
    instead, near = np.full((2, len(rows)), np.nan)
    for i, own in zip(runs.rows, rocks, strict=True):
        friction = rows[i].friction
        assert friction is not None  # (these lines slide)
        instead[i], near[i] = 1.0 - own.mean(), near_uplift(friction, runs.blocks_of(rows[i]), runs.plane).mean()
    text = "chance of a friction with which the piece slides, never rocks"
    return {
        INSTEAD: variable(("item",), instead, DIMENSIONLESS, text),
        NEAR: variable(("item",), near, DIMENSIONLESS, of_near(runs.plane)),
    }


def _of_lines(
    one: _Values, of: Callable[[_Values, slice], tuple[Array, Array, Array]], lines: int, runs: int
) -> list[Array]:
    """Return a value and its ends on all lines, NaN where it is not known; lines are computed slab by slab.

    runs: number of runs of all lines.
    """
    step = max(1, RUNS // (1 + runs // lines))
    parts = [of(one, slice(first, first + step)) for first in range(0, len(one.rows), step)]
    found = []
    for values in zip(*parts, strict=True):
        own = np.moveaxis(np.concatenate(values, axis=one.axis), one.axis, 0)
        every = np.full((lines, *own.shape[1:]), np.nan)
        every[list(one.rows)] = own
        found.append(np.moveaxis(every, 0, one.axis))
    return found


def _weighted(flags: Flags, rows: Sequence[int], weights: Array) -> Array:
    """Return the means over variants of flags of some lines (model, line, level, motion) times weights (line, variant).

    Flags of one variant are those of all.
    """
    models, _, variants, *shape = flags.shape
    found = np.empty((models, len(rows), *shape))
    for k, i in enumerate(rows):
        share = weights[k] if variants > 1 else weights[k].mean(keepdims=True)
        found[:, k] = np.einsum("v,mvle->mle", share, flags[:, i].astype(np.float64)) / variants
    return found


def slide_coordinates(inventory: Inventory, runs: SlidingRuns | None) -> dict[str, xr.Variable]:
    """Return the coordinates of contacts, friction and what lines stand on, where any line has them, and the slips."""
    rows = inventory.rows
    found: dict[str, xr.Variable] = {}
    if any(row.contact for row in rows):
        contacts = np.array([row.contact for row in rows], dtype=object)
        found["contact"] = variable(("item",), contacts, DIMENSIONLESS, "what the pieces stand on, and with what")
    if any(row.friction is not None for row in rows):
        medians = [math.nan if row.friction is None else float(row.friction.quantile(np.array(0.5))) for row in rows]
        text = "static coefficient of friction, its median"
        found["friction"] = variable(("item",), np.array(medians), DIMENSIONLESS, text)
    if any(row.stands_on for row in rows):
        below = np.array([row.stands_on for row in rows], dtype=object)
        found["stands_on"] = variable(("item",), below, DIMENSIONLESS, "line whose piece it stands on")
    if runs is not None:
        text = "slip that is exceeded"
        found["slip"] = variable(("slip",), runs.distances, METRE, text)
    return found


def item_slide_notes(assessment: xr.Dataset, inventory: Inventory) -> list[str]:
    """Return what limits the results on sliding of the lines that have friction and can fall, one sentence each."""
    at = [i for i, row in enumerate(inventory.rows) if row.friction is not None and not row.anchored]
    if INSTEAD not in assessment or not at:
        return []
    blocks = [replace(inventory.rows[i].block, name=inventory.rows[i].label) for i in at]
    said = [str(assessment.attrs[SLIDES_ON])] if SLIDES_ON in assessment.attrs else []
    found = assessment[[INSTEAD, NEAR]].isel(item=at).rename(item="block")
    said += slide_notes(found, blocks, plane=AXES in configuration_of(assessment))
    said += exact_friction_notes(exactly_known(inventory))
    if MOVES in assessment:
        moving = shares_with_moving_supports(assessment)
        worst = int(np.argmax(moving))
        name = listed_name(str(assessment["item"].values[worst]))
        said.append(
            "objects on pedestals are run as if their pedestals moved with the floor: of the falls of "
            f"{name} {two_digit_percent(float(moving[worst]))} are in runs in which its pedestal slides or rocks itself"
            f"{', the largest share of all' if (moving > 0.0).sum() > 1 else ''}"
        )
    return said


def exactly_known(inventory: Inventory) -> list[str]:
    """Return the lines that can slide and whose coefficient of friction has no dispersion."""
    return [row.label for row in inventory.rows if slides(row) and isinstance(row.friction, FixedFriction)]


def shares_with_moving_supports(results: xr.Dataset) -> Array:
    """Return the share of the falls of each line (item,) in runs in which what it stands on moves, under the first law.

    In a year, or without a hazard the largest at any level; 0 of lines that stand on the floor or never fall.
    """
    if ITEM_MOVES_SHARE in results:
        shares = results[ITEM_MOVES_SHARE].isel(model=0)
    else:
        shares = results[MOVES_SHARE].isel(model=0).max("level")
    return np.asarray(np.nan_to_num(shares.values))
