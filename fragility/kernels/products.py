"""Compiled products of matrices, whose sums are taken in one order."""

from ...compiled import kernel


@kernel(keep=True, error_model="python")
def add_crossed(one, other, found):
    """Add the product of the transpose of a matrix (i, j) with a matrix (i, k) to `found` (j, k), row by row."""
    for i in range(one.shape[0]):
        for j in range(one.shape[1]):
            factor = one[i, j]
            for k in range(other.shape[1]):
                found[j, k] += factor * other[i, k]
