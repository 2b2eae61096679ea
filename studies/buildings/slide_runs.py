"""Runs of sliding in an inventory: pieces whose friction is below b/h, with equally probable coefficients."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from ...core.aliases import Array, Flags, Index
from ...core.doubts import Doubt
from ...core.streams import stream
from ...fragility.analyses.sliding import (
    AFTER,
    SLIPS,
    coefficients_of,
    demands,
    demands_in_plane,
    sliders_of,
    slides_below,
    slips_of,
)
from ...fragility.numerics.slabs import RUNS
from ...fragility.runs.axes import along_depth
from ...fragility.runs.runners import Runner
from ...fragility.uncertainty.joint import INDEPENDENT, TOGETHER, PieceDraws, Variability, pieces_of
from ...fragility.validity.plausibility import cut_slides, end_doubts
from ...models import Block, Law
from ...models.friction import Friction
from ...models.outputs import TRIP_VELOCITY
from ...models.runs import Specimen
from ...models.sliding.trip import trips
from ...motions.arrays import Record
from ..inventory.consequences import REALISATIONS
from ..inventory.contents import Contents, Inventory
from ..plan.slides import DISTANCES, is_free
from .shaking import Shaken, Support, support_of

COEFFICIENTS = 20
"""Equally probable coefficients of friction of a line whose pieces do not differ otherwise."""
ORDER_OF_FRICTION = 2
"""Key of the stream that orders the coefficients; restitution and slenderness have 0 and 1 (`Variability.sample`)."""


@dataclass(frozen=True)
class Slipping:
    """Slips whose probabilities are wanted (m); True if alike pieces of a line share a coefficient of friction."""

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
    """Return the rules for drawing pieces from variants; None if they are alike and cannot slide over an edge."""
    if variability is not None or not any(map(falls_off, inventory.rows)):
        return variability
    return FrictionDraws(TOGETHER if slipping.shared else INDEPENDENT, seed=seed)


def slides(row: Contents) -> bool:
    """Return True if the slips of a line are known: it has friction, is free-standing, and is not anchored."""
    return row.friction is not None and not row.anchored and is_free(row.block)


def falls_off(row: Contents) -> bool:
    """Return True if the pieces of a line can slide over an edge."""
    return row.block.edge is not None and slides(row)


def faces_an_edge(block: Block) -> bool:
    """Return True if the edges in front of a block and behind it differ, so that a motion and its reverse do."""
    return block.edge is not None and block.edge.front != block.edge.back


class SlidingRuns:
    """Runs of the lines of an inventory that can slide, floor by floor, reduced to counts and flags.

    `counts` (line, 1 + slip, level, motion): the number of variants that slide, and that slip farther than each
    distance; `rows` are the lines. `off` (line, variant, level, motion): 1 if a variant falls off in front, -1 behind,
    0 if it stays; `edged` are these lines. `moving` (line, level, motion): the probability that the support of a line
    slides or rocks; `above` are these lines. A sliding piece whose weight the vertical acceleration takes counts as
    slipped beyond every distance and over its edge. `tripped` (line, level, motion): the number of variants that trip
    over an obstacle, and all of them if the weight is taken; `near` are these lines. `cut`: True for each motion, by
    its label, that ends while a piece still slides. `plane`: True if both components of the motions act on the lines.
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
        self.near = [i for i in self.rows if inventory.rows[i].obstacle is not None]
        self.variants = COEFFICIENTS if variability is None else variability.variants
        self.above = [i for i, row in enumerate(inventory.rows) if row.stands_on and not row.anchored]
        self.moving = runner.array((len(self.above), *shape), np.float64)
        self.counts = runner.array((len(self.rows), 1 + self.distances.size, *shape), np.uint16)
        self.off = runner.array((len(self.edged), self.variants, *shape), np.int8)
        self.tripped = runner.array((len(self.near), *shape), np.uint16)
        self._at, self._edge_at, self._above_at, self._near_at = (
            {i: k for k, i in enumerate(lines)} for lines in (self.rows, self.edged, self.above, self.near)
        )
        self.cut: dict[str, bool] = {}
        self._by_label = {row.label: row for row in inventory.rows if self.above}
        self.done = 0

    @cached_property
    def order(self) -> Index:
        """Coefficient of each variant: in increasing order, or at random if variants differ otherwise."""
        if self.variability is None:
            return np.arange(self.variants)
        return stream(self.variability.seed, ORDER_OF_FRICTION).permutation(self.variants)

    def blocks_of(self, row: Contents) -> list[Block]:
        """Return the block of each variant of a line."""
        return _blocks_of(row, self.law, self.variability)

    def rocks(self, row: Contents) -> Array:
        """Return the probability that the friction of each variant (variant,) is at least its b/h."""
        assert row.friction is not None
        return 1.0 - row.friction.below(np.array([block.b / block.h for block in self.blocks_of(row)]))

    def run(self, at: Support, shaken: Shaken) -> None:
        """Run the lines of a support under its motions."""
        rows, above = (
            [i for i in lines if support_of(self.inventory.rows[i]) == at] for lines in (self.rows, self.above)
        )
        if not rows and not above:
            return
        motions, factors = shaken.motions[:: self.polarities], shaken.factors[0, :, :: self.polarities]
        needed = _Needed(motions, factors, self.shape[0], self.polarities, self.plane)
        for i in above:
            below = self._by_label[self.inventory.rows[i].stands_on]
            self.moving[self._above_at[i]] = _moves(below, needed)
        for (friction, ratio, obstacle), lines in _alike(self.inventory, rows).items():
            coefficients = coefficients_of(friction, self.variants)
            blocks = {i: self.blocks_of(self.inventory.rows[i]) for i in lines}
            for i in lines:
                self.counts[self._at[i]] = 0
                if i in self._edge_at:
                    self.off[self._edge_at[i]] = 0
                if i in self._near_at:
                    self.tripped[self._near_at[i]] = np.where(np.isinf(needed.along), self.variants, 0)
            sliding = _sliding(coefficients, (block for variants in blocks.values() for block in variants), self.plane)
            step = max(1, RUNS // factors.size)  # slips are kept for this number of runs at a time
            for first in range(0, sliding.size, step):
                part = sliding[first : first + step]
                sliders = sliders_of(part, ratio, obstacle, self.plane)
                every = self._slips(sliders, motions, factors, math.isfinite(obstacle))
                for k, mu in enumerate(part.tolist()):
                    slips = every.of(k)
                    variants = np.flatnonzero(coefficients[self.order] == mu)
                    for i in lines:
                        for variant in variants.tolist():
                            self._add(i, variant, blocks[i][variant], needed, mu, slips)
            self.done += len(lines)
            self.runner.tell("slips", self.done, len(self.rows))

    def _slips(self, sliders: Sequence[Specimen], motions: Sequence[Record], factors: Array, near: bool) -> _Slips:
        """Return the slips (slider, level, motion) of all runs; `near`: towards an obstacle."""
        names = (*SLIPS, AFTER, *((TRIP_VELOCITY,) if near else ()))
        slips = slips_of(sliders, motions, factors, self.runner, names)
        for motion, on in zip(motions, cut_slides(slips["slide_peak"], slips[AFTER]).tolist(), strict=True):
            self.cut[motion.label] = on or self.cut.get(motion.label, False)
        peak, *sides = (np.nan_to_num(slips[name], nan=math.inf) for name in SLIPS)
        met = slips[TRIP_VELOCITY] if near else peak
        # the reverse of a motion moves the piece as far to the other side; motions of each level are adjacent
        pairs = (sides, sides[::-1], (peak, peak), (met, met))
        forward, backward, peak, met = (
            np.stack(pair[: self.polarities], axis=-1).reshape(len(sliders), *self.shape) for pair in pairs
        )
        return _Slips(forward, backward, peak, met if near else None)

    def _add(self, i: int, variant: int, block: Block, needed: _Needed, mu: float, slips: _Slips) -> None:
        """Count a variant of line i with its coefficient and its slips (level, motion) if it moves at all."""
        if mu >= slides_below(block, self.plane):
            return
        moves = needed.of(block.b / block.h) > mu
        if self.plane:  # (with a friction above b/h of the width it slides, in the plane, or rocks)
            slips = slips.where(moves)
        counts = self.counts[self._at[i]]
        counts[0] += moves
        for d, distance in enumerate(self.distances):
            counts[d + 1] += slips.peak > distance
        if block.edge is not None:
            front, _ = block.edge.slips(block.b)
            gone = block.edge.fallen_off(slips.forward, slips.backward, block.b)
            self.off[self._edge_at[i], variant] = np.where(gone, np.where(slips.forward > front, 1, -1), 0)
        if slips.met is not None:  # (NaN where it does not get there, or its weight is taken)
            self.tripped[self._near_at[i]] += trips(block, slips.met)

    @property
    def doubts(self) -> list[Doubt]:
        """Input warnings on motions that end while pieces still slide."""
        return end_doubts([*self.cut.values()], [*self.cut])

    def fallen(self, overturned: Flags) -> Flags:
        """Return flags (model, item, variant, level, motion) of pieces that overturned as if none slid, or fell off."""
        return self._joined(overturned, None, 0)

    def fallen_forward(self, front: Flags, overturned: Flags) -> Flags:
        """Return flags of pieces that overturned to the front, or fell off in front without overturning."""
        return self._joined(front, overturned, 1)

    def _joined(self, flags: Flags, overturned: Flags | None, side: int) -> Flags:
        models, items, _, *shape = flags.shape
        flags_with = self.runner.array((models, items, self.variants, *shape), np.bool_)
        for k in range(models):
            for i in range(items):
                flags_with[k, i] = flags[k, i]
                if i in self._edge_at:
                    sides = self.off[self._edge_at[i]]
                    gone = sides != 0 if side == 0 else sides == side
                    flags_with[k, i] |= gone if overturned is None else gone & ~overturned[k, i]
        return flags_with


def number_of_slides(inventory: Inventory, law: Law, variability: Variability | None, plane: bool) -> int:
    """Return the number of runs of sliding of an inventory under each motion at each level."""
    variants, number = COEFFICIENTS if variability is None else variability.variants, 0
    lines = [i for i, row in enumerate(inventory.rows) if slides(row)]
    for at in {support_of(inventory.rows[i]) for i in lines}:
        rows = [i for i in lines if support_of(inventory.rows[i]) == at]
        for (friction, _, _), alike in _alike(inventory, rows).items():
            blocks = (block for i in alike for block in _blocks_of(inventory.rows[i], law, variability))
            number += _sliding(coefficients_of(friction, variants), blocks, plane).size
    return number


def _blocks_of(row: Contents, law: Law, variability: Variability | None) -> list[Block]:
    """Return the block of each variant of a line."""
    blocks = [block for block, _ in pieces_of(row.block, law, row.e, variability)]
    return blocks if variability is not None else blocks * COEFFICIENTS


def _alike(inventory: Inventory, lines: Iterable[int]) -> dict[tuple[Friction, float, float], list[int]]:
    """Return lines by their friction, its kinetic ratio and the distance to an obstacle: groups that slide alike."""
    groups: dict[tuple[Friction, float, float], list[int]] = {}
    for i in lines:
        row = inventory.rows[i]
        assert row.friction is not None
        obstacle = math.inf if row.obstacle is None else row.obstacle
        groups.setdefault((row.friction, row.kinetic_ratio, obstacle), []).append(i)
    return groups


def _sliding(coefficients: Array, blocks: Iterable[Block], plane: bool) -> Array:
    """Return the different coefficients with which any of the blocks slides, in increasing order."""
    highest = max(slides_below(block, plane) for block in blocks)
    return np.asarray(np.unique(coefficients[coefficients < highest]))


class _Slips(NamedTuple):
    """Maximum slips (…, level, motion), m, to both sides and in any direction; velocities at obstacles, if any."""

    forward: Array
    backward: Array
    peak: Array
    met: Array | None = None

    def of(self, k: int) -> _Slips:
        """Return the slips of one coefficient."""
        met = None if self.met is None else self.met[k]
        return _Slips(self.forward[k], self.backward[k], self.peak[k], met)

    def where(self, moves: Flags) -> _Slips:
        """Return the slips of runs in which a piece moves, 0 elsewhere."""
        return _Slips(*(np.where(moves, slip, 0.0) for slip in self[:3]))


class _Needed:
    """The friction (level, motion) that keeps blocks in place under the motions of a support."""

    def __init__(self, motions: Sequence[Record], factors: Array, levels: int, polarities: int, plane: bool) -> None:
        self.motions, self.factors, self.plane = motions, factors, plane
        self.levels, self.polarities = levels, polarities
        self._known: dict[float, Array] = {}
        self.along = self._on_runs(demands(motions, factors))
        self.across = self._on_runs(demands([along_depth(motion) for motion in motions], factors)) if plane else None

    def _on_runs(self, values: Array) -> Array:
        return np.repeat(values.reshape(self.levels, -1), self.polarities, axis=1)

    def of(self, level: float) -> Array:
        """Return the friction of a block with this b/h along its width."""
        if not self.plane:
            return self.along
        if level not in self._known:
            self._known[level] = self._on_runs(demands_in_plane(self.motions, self.factors, level))
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
