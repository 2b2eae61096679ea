"""Joint overturning of many items from their flags: probabilities of events, sums over items, exceeded thresholds.

Plain arrays: flags (model, item, variant, level, motion), one variant where pieces of an item are alike.  Sums and
products over items are computed item by item in their order, so that the same bits result from parts of the items, one
after the other.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from ...aliases import Array, Flags, Index


def chances(flags: Flags) -> Array:
    """Return the probability, given the motion, that a piece overturns: (model, item, level, motion)."""
    return np.asarray(flags.mean(axis=2))


def chances_of_any(chance: Array, counts: Index, independent: bool) -> Array:
    """Return the probability, given the motion, that at least one piece of an item overturns, shape of `chance`.

    Each independent piece of an item overturns with the probability `chance`; otherwise pieces fall together.
    """
    if not independent:
        return chance
    return np.asarray(1.0 - (1.0 - chance) ** counts[:, None, None])


def chances_of_none(any_piece: Array, members: Flags, found: Array | None = None) -> Array:
    """Return the probability, given the motion, that nothing of a set overturns: (model, set, level, motion).

    members (set, item): True where an item belongs to a set; given the motion, items are independent.  `found`: the
    result for preceding items, multiplied in place.
    """
    if found is None:
        found = np.ones(_of_sets(any_piece.shape, members))
    for i, member in enumerate(members.T):
        stays = 1.0 - any_piece[:, i]
        for s in np.flatnonzero(member):
            found[:, s] *= stays
    return found


def expected_totals(chance: Array, amounts: Array, members: Flags, found: Array | None = None) -> Array:
    """Return the expected amount, given the motion, that overturns in each set: (model, set, level, motion).

    amounts (item,): the amount of all pieces of an item.  `found`: the result for preceding items, added to in place.
    """
    if found is None:
        found = np.zeros(_of_sets(chance.shape, members))
    for i, member in enumerate(members.T):
        own = amounts[i] * chance[:, i]
        for s in np.flatnonzero(member):
            found[:, s] += own
    return found


def totals(flags: Flags, draws: Sequence[Index], amounts: Array, members: Flags, found: Array | None = None) -> Array:
    """Return the amount that overturns in each set and realisation: (model, set, level, motion, realisation).

    draws: for each item the number of its pieces of each variant (realisation, variant).  amounts (item,): the amount
    of one piece.  `found`: the result for preceding items, added to in place.
    """
    if found is None:
        found = np.zeros((*_of_sets((flags.shape[0], 0, *flags.shape[3:]), members), draws[0].shape[0]))
    for i, member in enumerate(members.T):
        drawn = draws[i].astype(np.float64)
        for level in range(flags.shape[3]):  # (level by level, as a flag becomes 8 bytes for each realisation)
            own = flags[:, i, :, level]
            if own.any():
                # whole numbers: their sums are exact in any order
                fallen = amounts[i] * np.einsum("rv,kvm->kmr", drawn, own.astype(np.float64))
                for s in np.flatnonzero(member):
                    found[:, s, level] += fallen
    return found


def _of_sets(shape: tuple[int, ...], members: Flags) -> tuple[int, ...]:
    """The shape (model, set, level, motion) for a shape (model, item, level, motion)."""
    return (shape[0], members.shape[0], *shape[2:])


def exceedances(amounts: Array, thresholds: Array, strictly: bool) -> Iterator[Array]:
    """Yield for each threshold the share of realisations above (or at or above) it, in the shape of one realisation."""
    for threshold in thresholds:
        # sums of amounts that are equal on paper may differ in their last digits
        above = amounts > threshold * (1.0 + 1e-12) if strictly else amounts >= threshold * (1.0 - 1e-12)
        yield above.mean(axis=-1)
