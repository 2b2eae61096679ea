"""Adaptive quadrature of many integrals at once, for integrals without a closed form, to a stated relative error.

This module knows nothing of hazard or fragility.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ...core.aliases import Array, Index

# Kronrod's 15 points with the 7 of Gauss among them (as in QUADPACK, Piessens et al. 1983): abscissae from the end to
# the middle, both weights.
_POINTS = np.array(
    [
        [0.991455371120812639206854697526329, 0.022935322010529224963732008058970, 0.0],
        [0.949107912342758524526189684047851, 0.063092092629978553290700663189204, 0.129484966168869693270611432679082],
        [0.864864423359769072789712788640926, 0.104790010322250183839876322541518, 0.0],
        [0.741531185599394439863864773280788, 0.140653259715525918745189590510238, 0.279705391489276667901467771423780],
        [0.586087235467691130294144691693, 0.169004726639267902826583426598550, 0.0],
        [0.405845151377397166906606412076961, 0.190350578064785409913256402421014, 0.381830050505118944950369775488975],
        [0.207784955007898467600689403773245, 0.204432940075298892414161999234649, 0.0],
        [0.0, 0.209482141084727828012999174891714, 0.417959183673469387755102040816327],
    ]
)
NODES = np.concatenate([-_POINTS[:, 0], _POINTS[-2::-1, 0]])
KRONROD = np.concatenate([_POINTS[:, 1], _POINTS[-2::-1, 1]])
GAUSS = np.concatenate([_POINTS[:, 2], _POINTS[-2::-1, 2]])

MOST_ROUNDS = 60
# Panels evaluated at a time: memory stays bounded whatever the number of integrals.
BATCH = 20_000


def integrate(
    function: Callable[[Array, Index], Array],
    start: Array,
    stop: Array,
    owner: Index,
    groups: Index,
    tolerance: float = 1e-12,
) -> Array:
    """Return integrals (integral,) of non-negative functions, each the sum of its panels, NaN where the function is.

    `function` takes points (panel, 15) and the integral that each panel belongs to (panel,), and returns (panel, 15).
    `start`, `stop` and `owner` (panel,) are the ends of the panels, finite, and the number of their integral; kinks of
    the function should lie on ends, otherwise bisection has to find them. `groups` (integral,) is the number, from 0
    on, of the sum that each integral is a part of. A panel is bisected while Gauss' 7 and Kronrod's 15 points differ by
    more than the share `tolerance` of that sum.
    """
    count = groups.size
    total = np.zeros(count)
    wide = stop > start
    start, stop, owner = start[wide], stop[wide], owner[wide]
    for _ in range(MOST_ROUNDS):
        fine, difference = _panels(function, start, stop, owner)
        estimate = np.bincount(groups, total + np.bincount(owner, fine, count))
        # (this comparison is False for NaN, which therefore counts as done)
        again = difference > tolerance * estimate[groups[owner]]
        total += np.bincount(owner[~again], fine[~again], count)
        if not again.any():
            return total
        left, right, owner = start[again], stop[again], owner[again]
        middle = 0.5 * (left + right)
        start, stop, owner = np.concatenate([left, middle]), np.concatenate([middle, right]), np.tile(owner, 2)
    # panels of 2^-60 of their first width: a jump inside one cannot be told from its ends any more
    return total + np.bincount(owner, _panels(function, start, stop, owner)[0], count)


def _panels(function: Callable[[Array, Index], Array], start: Array, stop: Array, owner: Index) -> tuple[Array, Array]:
    """Kronrod's value of every panel, and its distance from Gauss' value."""
    fine, difference = np.empty(start.size), np.empty(start.size)
    for first in range(0, start.size, BATCH):
        part = slice(first, first + BATCH)
        half = 0.5 * (stop[part] - start[part])
        values = function(0.5 * (start[part] + stop[part])[:, None] + half[:, None] * NODES, owner[part])
        # no matrix product: its rounding depends on how many panels come at a time
        fine[part] = half * np.sum(values * KRONROD, axis=1)
        difference[part] = np.abs(half * np.sum(values * (KRONROD - GAUSS), axis=1))
    return fine, difference
