"""From flags of many items to what falls together: chances of events, sums over items, thresholds exceeded.

Plain arrays: flags (model, item, variant, level, motion), one variant where pieces of an item are alike.  Sums and
products over items go item by item in their order, so that parts of the items, one after the other, give the same bits.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

Values = NDArray[np.float64]
Flags = NDArray[np.bool_]
Counts = NDArray[np.int64]


def chances(flags: Flags) -> Values:
    """Probability, given the motion, that a piece overturns (model, item, level, motion): the share of its variants."""
    return np.asarray(flags.mean(axis=2))


def chances_of_any(chance: Values, counts: Counts, independent: bool) -> Values:
    """Probability, given the motion, that at least one piece of an item overturns, shape of `chance`.

    Independent pieces of an item each overturn with `chance`; else they fall together.
    """
    if not independent:
        return chance
    return np.asarray(1.0 - (1.0 - chance) ** counts[:, None, None])


def chances_of_none(any_piece: Values, members: Flags, found: Values | None = None) -> Values:
    """Probability, given the motion, that nothing of a set overturns: (model, set, level, motion).

    members (set, item) says what belongs to each set; given the motion, items differ independently.  `found`: what came
    of the items before these, multiplied in place.
    """
    if found is None:
        found = np.ones(_of_sets(any_piece.shape, members))
    for i, member in enumerate(members.T):
        stays = 1.0 - any_piece[:, i]
        for s in np.flatnonzero(member):
            found[:, s] *= stays
    return found


def expected_totals(chance: Values, amounts: Values, members: Flags, found: Values | None = None) -> Values:
    """Expectation, given the motion, of the amount that overturns in each set: (model, set, level, motion).

    amounts (item,): the amount of all pieces of an item.  `found`: what came of the items before these, added to in
    place.
    """
    if found is None:
        found = np.zeros(_of_sets(chance.shape, members))
    for i, member in enumerate(members.T):
        own = amounts[i] * chance[:, i]
        for s in np.flatnonzero(member):
            found[:, s] += own
    return found


def totals(
    flags: Flags, draws: Sequence[Counts], amounts: Values, members: Flags, found: Values | None = None
) -> Values:
    """Amount that overturns in each set, one by one: (model, set, level, motion, realisation).

    draws: for each item how many of its pieces are of each variant (realisation, variant).  amounts (item,): the
    amount of one piece.  `found`: what came of the items before these, added to in place.
    """
    if found is None:
        found = np.zeros((*_of_sets((flags.shape[0], 0, *flags.shape[3:]), members), draws[0].shape[0]))
    for i, member in enumerate(members.T):
        drawn = draws[i].astype(np.float64)
        for level in range(flags.shape[3]):  # (a flag becomes a number of 8 bytes, and as many as realisations)
            own = flags[:, i, :, level]
            if own.any():
                # whole numbers: their sums are exact in any order
                fallen = amounts[i] * np.einsum("rv,kvm->kmr", drawn, own.astype(np.float64))
                for s in np.flatnonzero(member):
                    found[:, s, level] += fallen
    return found


def _of_sets(shape: tuple[int, ...], members: Flags) -> tuple[int, ...]:
    """(model, item, level, motion) to (model, set, level, motion)."""
    return (shape[0], members.shape[0], *shape[2:])


def exceedances(amounts: Values, thresholds: Values, strictly: bool) -> Iterator[Values]:
    """For each threshold the share of the realisations above it (or at least at it): amounts without the last axis."""
    for threshold in thresholds:
        # sums of amounts that are equal on paper may differ in their last digits
        above = amounts > threshold * (1.0 + 1e-12) if strictly else amounts >= threshold * (1.0 - 1e-12)
        yield above.mean(axis=-1)
