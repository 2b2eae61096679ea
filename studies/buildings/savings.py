"""Savings of anchoring items, motion by motion: each item alone, and the items one after the other."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
import xarray as xr

from ...core.aliases import Array, Index
from ...fragility.numerics.slabs import Allocator, slabs
from ...fragility.numerics.totals import chances, chances_of_any
from .variables import Year, carried_items, fall_flags


class AdditiveItems:
    """Items whose amounts add up; `loads` (item, its supporting item, amount) are lost if either falls.

    `alone` (model, item, motion) is the objective, motion by motion, if only this item could fall, and `most` (item,)
    its maximum. `array` allocates the arrays of every item and motion.
    """

    together = np.add
    """Function that joins the maxima of items."""

    def __init__(
        self,
        chances: "ItemChances",
        amounts: Array,
        year: Year,
        array: Allocator,
        loads: Sequence[tuple[int | None, int, float]] = (),
    ) -> None:
        self.array = array
        models, items, _, motions = chances.shape
        self.most = year.rate * amounts
        self.alone = array((models, items, year.size(motions)), np.float64)
        for of, rows in chances.of_items():
            self.alone[of, rows] = year.total(chances.piece(of, rows)) * amounts[rows, None]
        # (what is lost with either of two is counted with both, less once where both fall)
        self._twice: dict[tuple[int, int], Array] = {}
        for item, support, amount in loads:
            below = chances.piece(slice(None), slice(support, support + 1))
            self.alone[:, support] += amount * year.total(below)[:, 0]
            self.most[support] += year.rate * amount
            if item is not None:
                self._twice[item, support] = amount * year.total(chances.both(item, support))

    @property
    def whole(self) -> Array:
        """The objective with all items (model, motion)."""
        return np.asarray(self.alone.sum(axis=1) - sum(self._twice.values()))

    @property
    def savings(self) -> Array:
        """The saving by anchoring each item while all others are free (model, item, motion)."""
        if not self._twice:
            return self.alone
        savings = self.array(self.alone.shape, np.float64)
        savings[...] = self.alone
        for pair, both in self._twice.items():
            for item in pair:
                savings[:, item] -= both
        return np.maximum(savings, 0.0, out=savings)  # (rounding)

    def steps(self, cost: Array | None) -> tuple[Index, Array]:
        """Anchor items in the order of saving (for the cost): order (model, item), rest (model, step, motion)."""
        alone, saved = self.alone.mean(axis=-1), self.savings.mean(axis=-1)
        models, items = alone.shape
        order = np.empty((models, items), np.int64)
        left = _nothing_left(self)
        for k in range(models):
            standing = np.ones(items, bool)
            for step in range(items):
                score = np.where(standing, score_of(saved[k], cost), -np.inf)
                best = np.flatnonzero(score == score.max())
                item = order[k, step] = best[alone[k, best].argmax()]
                standing[item] = False
                for other, both in self._beside(item, k):
                    saved[k, other] += both.mean()
            for step in range(items - 1, -1, -1):
                item = order[k, step]
                np.add(left[k, step + 1], self.alone[k, item], out=left[k, step])
                for other, both in self._beside(item, k):
                    left[k, step] -= both if other in order[k, step:] else 0.0
        return order, left

    def _beside(self, item: int, k: int) -> Iterator[tuple[int, Array]]:
        """Yield the items above and below an item, and the amounts lost with both (motion,) under one law."""
        for pair, both in self._twice.items():
            if item in pair:
                yield sum(pair) - item, both[k]


class EventItems:
    """Items of which any one causes the event; its data are as of `AdditiveItems`."""

    together = np.maximum

    def __init__(self, chances: "ItemChances", year: Year, array: Allocator) -> None:
        self.array = array
        self.chances = chances
        # (levels without weight add nothing)
        self.levels = np.flatnonzero(year.weights)
        self.year = replace(year, weights=year.weights[self.levels])
        models, items, _, motions = chances.shape
        self.most = np.full(items, year.rate)
        self.alone = array((models, items, self.year.size(motions)), np.float64)
        for k, part, chance in self._parts():
            self.alone[k, :, self._values(part)] = self.year.total(chance)

    @property
    def whole(self) -> Array:
        whole = np.empty((self.alone.shape[0], self.alone.shape[2]))
        for k, part, chance in self._parts():
            whole[k, self._values(part)] = self._together(chance)
        return whole

    @property
    def savings(self) -> Array:
        savings = self.array(self.alone.shape, np.float64)
        for k, part, chance in self._parts():
            savings[k, :, self._values(part)] = self._saved(chance)
        return savings

    def steps(self, cost: Array | None) -> tuple[Index, Array]:
        models, items, values = self.alone.shape
        order = np.empty((models, items), np.int64)
        left = _nothing_left(self)
        saved = self.array((items, values), np.float64)
        parts = self._motions
        for k in range(models):
            standing = list(range(items))
            whole = self._chance(k, parts[0]) if len(parts) == 1 else None
            for step in range(items):
                for part in parts:
                    chance_left = self._chance(k, part)[standing] if whole is None else whole[standing]
                    left[k, step, self._values(part)] = self._together(chance_left)
                    saved[: len(standing), self._values(part)] = self._saved(chance_left)
                prices = None if cost is None else cost[standing]
                score = score_of(saved[: len(standing)].mean(axis=-1), prices)
                if not score.max() > 0.0:
                    score = score_of(self.alone[k, standing].mean(axis=-1), prices)
                order[k, step] = standing.pop(int(score.argmax()))
        return order, left

    @property
    def _motions(self) -> list[slice]:
        """Bounds of the parts of the motions, each with its polarities, that are processed at a time."""
        _, items, _, runs = self.chances.shape
        motions, variants = runs // self.year.polarities, self.chances.variants * self.year.polarities
        sizes = {"block": items, "variant": variants, "level": self.levels.size, "motion": motions}
        return [where.get("motion", slice(0, motions)) for where in slabs(sizes, ("motion",))]

    def _values(self, part: slice) -> slice:
        """Return the place of the values of some motions."""
        return slice(part.start * self.year.parts, part.stop * self.year.parts)

    def _chance(self, k: int, part: slice) -> Array:
        """P(an item causes the event | run) (item, level, run) of some motions with their polarities."""
        runs = slice(part.start * self.year.polarities, part.stop * self.year.polarities)
        return self.chances.any_piece(k, self.levels, runs)

    def _parts(self) -> Iterator[tuple[int, slice, Array]]:
        for k in range(self.alone.shape[0]):
            for part in self._motions:
                yield k, part, self._chance(k, part)

    def _together(self, chance: Array) -> Array:
        """The annual value of the event with all items (motion,)."""
        return self.year.total(1.0 - np.prod(1.0 - chance, axis=0))

    def _saved(self, chance: Array) -> Array:
        """The annual value of the event caused by each item alone, if no other item causes it (item, motion)."""
        stays = 1.0 - chance
        others = np.ones_like(stays)
        np.cumprod(stays[:-1], axis=0, out=others[1:])
        after = np.ones_like(stays[0])
        for i in range(len(stays) - 1, -1, -1):
            others[i] *= after
            after = after * stays[i]
        others *= chance
        return self.year.total(others)


FreeItems = AdditiveItems | EventItems
"""The items that can be anchored, and their contributions to the objective, motion by motion."""


def most_left(items: FreeItems, order: Index) -> Array:
    """Return the maximum of the objective (model, step) if items are anchored in some order (model, item)."""
    rest = np.flip(items.together.accumulate(np.flip(items.most[order], axis=1), axis=1), axis=1)
    return np.concatenate([rest, np.zeros((len(order), 1))], axis=1)


def _nothing_left(items: FreeItems) -> Array:
    """Allocate zeros (model, step, motion)."""
    models, number, motions = items.alone.shape
    zeros = items.array((models, number + 1, motions), np.float64)
    zeros[...] = 0.0
    return zeros


class ItemChances:
    """Probabilities of items given the motion, from flags (`flags_of`, '' for all falls) that are read in parts."""

    def __init__(self, assessment: xr.Dataset, chosen: Index, flags_of: str = "") -> None:
        self._flags = fall_flags(assessment, flags_of).variable
        self._carried = carried_items(assessment)
        self._chosen = chosen
        self._counts = assessment["count"].values[chosen]
        self._independent = assessment.attrs["pieces"] == "independent"
        models, _, self.variants, levels, motions = self._flags.shape
        self.shape = (models, chosen.size, levels, motions)

    def of_items(self) -> Iterator[tuple[slice, slice]]:
        """Yield the bounds of laws and items, slab by slab."""
        sizes = dict(zip(("model", "block", "level", "motion"), self.shape, strict=True)) | {"variant": self.variants}
        for where in slabs(sizes, ("model", "block")):
            yield where.get("model", slice(None)), where.get("block", slice(None))

    def piece(self, of: slice, rows: slice) -> Array:
        """P(a piece overturns | motion) (model, item, level, motion)."""
        return chances(self._flags[of, self._chosen[rows]].values)

    def lost(self, of: slice, rows: slice) -> Array:
        """P(a piece overturns, or its support does | motion) (model, item, level, motion)."""
        flags = self._flags[of, self._chosen[rows]].values
        for i, line in enumerate(self._chosen[rows].tolist()):
            if line in self._carried:
                flags[:, i] |= self._flags[of, self._carried[line]].values
        return chances(flags)

    def both(self, first: int, second: int) -> Array:
        """P(pieces of two items overturn | motion) (model, level, motion)."""
        pair = [self._flags[:, self._chosen[i]].values for i in (first, second)]
        return chances((pair[0] & pair[1])[:, None])[:, 0]

    def any_piece(self, k: int, levels: Index, part: slice) -> Array:
        """P(at least one piece of an item overturns | motion) under one law (item, level, motion)."""
        flags = self._flags.isel(model=[k], block=self._chosen, level=levels, motion=part).values
        any_falls: Array = chances_of_any(chances(flags), self._counts, self._independent)[0]
        return any_falls

    def any_piece_of(self, k: int, i: int) -> Array:
        """P(at least one piece of item i overturns | motion) under one law (level, motion)."""
        flags = self._flags.isel(model=[k], block=self._chosen[[i]]).values
        any_falls: Array = chances_of_any(chances(flags), self._counts[[i]], self._independent)[0, 0]
        return any_falls


def score_of(saving: Array, cost: Array | None) -> Array:
    """Return the score that decides the order: the saving (…, item), or the saving over the cost."""
    if cost is None:
        return saving
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(np.where(saving > 0.0, saving / cost, 0.0))


def order_of(score: Array, alone: Array) -> Index:
    """Return the items by decreasing score; of equal scores, such as 0, the item with the largest `alone` is first."""
    return np.asarray(np.lexsort((np.broadcast_to(-alone, score.shape), -score), axis=-1))
