"""Joint overturning of many items from their flags: probabilities of events, sums over items, exceeded thresholds.

Plain arrays: flags (model, item, variant, level, motion), one variant if pieces of an item are alike. Sums and products
over items are computed item by item in their order. Results from parts of the items, one after the other, are therefore
bit-identical.
"""

from collections.abc import Iterator

import numpy as np

from ...core.elementary import Array, Flags, Index, power


def chances(flags: Flags) -> Array:
    """Return the probability, given the motion, that a piece overturns: (model, item, level, motion)."""
    return np.asarray(flags.mean(axis=2))


def chances_of_any(chance: Array, counts: Index, independent: bool) -> Array:
    """Return the probability, given the motion, that at least one piece of an item overturns, shape of `chance`.

    Each independent piece of an item overturns with the probability `chance`; otherwise pieces fall together.
    """
    if not independent:
        return chance
    return 1.0 - power(1.0 - chance, counts[:, None, None])


def chances_of_none(any_piece: Array, members: Flags, none_falls: Array | None = None) -> Array:
    """Return the probability, given the motion, that nothing of a set overturns: (model, set, level, motion).

    members (set, item): True if an item belongs to a set; given the motion, items are independent. `none_falls`: the
    result for preceding items, multiplied in place.
    """
    if none_falls is None:
        none_falls = np.ones(_of_sets(any_piece.shape, members))
    for i, member in enumerate(members.T):
        stays = 1.0 - any_piece[:, i]
        for s in np.flatnonzero(member):
            none_falls[:, s] *= stays
    return none_falls


def expected_totals(chance: Array, amounts: Array, members: Flags, totals: Array | None = None) -> Array:
    """Return the expected amount, given the motion, that overturns in each set: (model, set, level, motion).

    amounts (item,): the amount of all pieces of an item. `totals`: the result for preceding items, added to in place.
    """
    if totals is None:
        totals = np.zeros(_of_sets(chance.shape, members))
    for i, member in enumerate(members.T):
        expected = amounts[i] * chance[:, i]
        for s in np.flatnonzero(member):
            totals[:, s] += expected
    return totals


def fallen_pieces(flags: Flags, drawn: Index) -> Array:
    """Return the number of pieces of an item that overturn, (model, level, motion, realisation).

    flags (model, variant, level, motion); drawn (motion, realisation, variant): the number of pieces of each variant.
    """
    models, variants, levels, motions = flags.shape
    fell = flags.transpose(3, 1, 0, 2).reshape(motions, variants, models * levels)
    # (whole numbers: their sums are exact in any order)
    fallen = drawn.astype(np.float64) @ fell.astype(np.float64)
    return np.moveaxis(fallen.reshape(motions, -1, models, levels), (0, 1), (2, 3))


def _of_sets(shape: tuple[int, ...], members: Flags) -> tuple[int, ...]:
    """The shape (model, set, level, motion) for a shape (model, item, level, motion)."""
    return (shape[0], members.shape[0], *shape[2:])


def exceedances(amounts: Array, thresholds: Array, strictly: bool) -> Iterator[Array]:
    """Yield, for each threshold, 1 for amounts above (or at or above) it and 0 for others."""
    for threshold in thresholds:
        # sums of amounts that are equal on paper may differ in their last digits
        above = amounts > threshold * (1.0 + 1e-12) if strictly else amounts >= threshold * (1.0 - 1e-12)
        yield above.astype(np.float64)
