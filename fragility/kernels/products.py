"""Compiled products of matrices, whose sums are taken in one order."""

import numpy as np

from ...core.compiled import kernel


@kernel(keep=True, error_model="python")
def add_crossed(one, other, found):
    """Add the product of the transpose of a matrix (i, j) with a matrix (i, k) to `found` (j, k), row by row."""
    for i in range(one.shape[0]):
        for j in range(one.shape[1]):
            factor = one[i, j]
            for k in range(other.shape[1]):
                found[j, k] += factor * other[i, k]


@kernel(keep=True)
def fill_squares(rows, covariance, found):
    """Write, of each row (i, j), row' covariance row into `found` (i,)."""
    n = rows.shape[1]
    product = np.empty(n)
    for i in range(rows.shape[0]):
        product[:] = 0.0
        for j in range(n):
            for k in range(n):
                product[k] += rows[i, j] * covariance[j, k]
        total = 0.0
        for k in range(n):
            total += product[k] * rows[i, k]
        found[i] = total
