"""From flags of many items to what falls together: chances of events, sums over items, thresholds exceeded.

Plain arrays: flags (model, item, variant, level, motion), one variant where pieces of an item are alike.
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


def chances_of_events(any_piece: Values, members: Flags) -> Values:
    """Probability, given the motion, that something of a set overturns: (model, set, level, motion).

    members (set, item) says what belongs to each set; given the motion, items differ independently.
    """
    found = np.empty((any_piece.shape[0], members.shape[0], *any_piece.shape[2:]))
    for i, member in enumerate(members):
        found[:, i] = 1.0 - np.prod(1.0 - any_piece[:, member], axis=1)
    return found


def expected_totals(chance: Values, amounts: Values, members: Flags) -> Values:
    """Expectation, given the motion, of the amount that overturns in each set: (model, set, level, motion).

    amounts (item,): the amount of all pieces of an item.
    """
    return np.asarray(np.einsum("si,kilm->kslm", members * amounts, chance))


def totals(flags: Flags, draws: Sequence[Counts], amounts: Values, members: Flags) -> Values:
    """Amount that overturns in each set, one by one: (model, set, level, motion, realisation).

    draws: for each item how many of its pieces are of each variant (realisation, variant).  amounts (item,): the
    amount of one piece.
    """
    models, items, variants, levels, motions = flags.shape
    realisations = draws[0].shape[0]
    found = np.zeros((models, members.shape[0], levels, motions, realisations))
    for i in range(items):
        if not flags[:, i].any():
            continue
        # whole numbers: their sums are exact in any order
        each = flags[:, i].reshape(models, variants, -1).astype(np.float64)
        fallen = np.einsum("rv,kvx->kxr", draws[i].astype(np.float64), each)
        for s in np.flatnonzero(members[:, i]):
            found[:, s] += amounts[i] * fallen.reshape(models, levels, motions, realisations)
    return found


def exceedances(amounts: Values, thresholds: Values, strictly: bool) -> Iterator[Values]:
    """For each threshold the share of the realisations above it (or at least at it): amounts without the last axis."""
    for threshold in thresholds:
        # sums of amounts that are equal on paper may differ in their last digits
        above = amounts > threshold * (1.0 + 1e-12) if strictly else amounts >= threshold * (1.0 - 1e-12)
        yield above.mean(axis=-1)
