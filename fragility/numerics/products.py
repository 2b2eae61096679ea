"""Products of matrices whose sums are taken in one order, so that no bit depends on a library's threads.

Libraries of linear algebra divide large products by the processors they find.  Levels that depend on the last bit of an
earlier result would then be others on other machines.
"""

from __future__ import annotations

import numpy as np

from ...core.aliases import Array
from ..kernels import products as engine


def times(one: Array, other: Array) -> Array:
    """Return the product of a matrix (i, j) with a matrix (j, k) or a vector (j,)."""
    return np.asarray(np.einsum("ij,j->i" if other.ndim == 1 else "ij,jk->ik", one, other))


def crossed(one: Array, other: Array) -> Array:
    """Return the product of the transpose of a matrix (i, j) with a matrix (i, k)."""
    found = np.zeros((one.shape[1], other.shape[1]))
    engine.add_crossed(np.ascontiguousarray(one), np.ascontiguousarray(other), found)
    return found


def squares(rows: Array, covariance: Array) -> Array:
    """Return, of each row (i, j), row' covariance row: its variance, not below 0."""
    found = np.empty(len(rows))
    engine.fill_squares(np.ascontiguousarray(rows), np.ascontiguousarray(covariance), found)
    return np.asarray(np.maximum(found, 0.0))
