"""Array functions (exp, log, power, products) that are bit-identical on all processors that fuse multiply and add.

The loops of numpy are as wide as the processor's vectors, and their last digits differ by that width. These functions
have numpy's names and values, at 0, infinity and NaN too, where they do not warn. They call the C library, whose
variants for such processors agree: in Python for a few values, else in a compiled loop.

Libraries of linear algebra divide products by the vectors and processors that they find; here every sum has one order.
Matrices are small. Golub, G. H. and Van Loan, C. F. (2013). Matrix Computations, 4th edition, Johns Hopkins University
Press. Sections 3.4 (pivoting), 4.2 (Cholesky), 5.2 (Gram and Schmidt, twice), 8.5 (Jacobi, the pairs of a round at
once) and 9.3 (exponentials).
"""

import math
import sys
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from .aliases import Array as Array, Flags as Flags, Index as Index  # noqa: PLC0414 - for one line of imports
from .kernels import elementary as engine

FEW, UNLOADED = 32, 10_000
"""Values up to which Python is as fast as a compiled loop, and as fast as loading numba for one."""
PYTHON = (math.exp, math.log, math.expm1, math.log1p, math.tan, math.asin, math.acos, math.atan, math.pow, math.atan2)
"""Functions in the order of the compiled loops; functions of two numbers are last."""
PIECE = 1_000_000
"""Rows that are written at once."""
SWEEPS, ROUNDING, LEAST, TERMS = 60, 1e-18, 1e-300, 15
"""Of eigh: maximum number of sweeps (about ten are needed), their remainder, and a divisor for 0; terms of expm."""


def _of(at: int, *given: Any) -> Any:
    """Return a function of one or two numbers or arrays, which are broadcast; of numbers it is one of numpy's."""
    x = np.broadcast_arrays(*(np.asarray(values, dtype=np.float64) for values in given))
    flat = [values.ravel() for values in x]
    result = np.empty(flat[0].size)
    if result.size <= (FEW if "numba" in sys.modules else UNLOADED):
        numbers = [values.tolist() for values in flat]
        try:
            result[:] = [*map(PYTHON[at], *numbers)]
        except (ValueError, OverflowError):
            result[:] = [_alone(PYTHON[at], *row) for row in zip(*numbers, strict=True)]
    else:
        with np.errstate(all="ignore"):  # (of numpy, where nothing is compiled)
            engine.fill(at, flat[0], flat[-1], result)
    return result.reshape(x[0].shape)[()]


def _alone(function: Any, *x: float) -> float:
    """Return a function of numbers, numpy's if Python raises an error: the result is then infinite or NaN."""
    try:
        return float(function(*x))
    except (ValueError, OverflowError):
        with np.errstate(all="ignore"):
            return float(getattr(np, function.__name__)(*x))


_all: list[Callable[..., Array]] = [partial(_of, at) for at in range(len(PYTHON))]
exp, log, expm1, log1p, tan, arcsin, arccos, arctan, power, arctan2 = _all


def geomspace(low: float, high: float, number: int) -> Array:
    """Return `number` values from `low` to `high`, both among them, at equal ratios."""
    points = power(10.0, np.linspace(math.log10(low), math.log10(high), number))
    points[[0, -1]] = low, high
    return points


def times(left: Any, right: Any) -> Array:
    """Return the sums over the last axis of `left` and the first of `right`, a vector (j,) or matrix (j, k)."""
    return np.asarray(np.einsum("...j,j->..." if np.ndim(right) == 1 else "...j,jk->...k", left, right))


def crossed(left: Array, right: Array) -> Array:
    """Return the product of the transpose of a matrix (i, j) with a matrix (i, k), row by row."""
    return times(np.ascontiguousarray(left).T, np.ascontiguousarray(right))


def squares(rows: Array, covariance: Array) -> Array:
    """Return, of each row (i, j), row' covariance row: its variance, not below 0."""
    contiguous = np.ascontiguousarray(rows)
    return np.asarray(np.maximum((times(contiguous, np.ascontiguousarray(covariance)) * contiguous).sum(axis=1), 0.0))


def cholesky(matrix: Array) -> Array:
    """Return the lower triangle L with L L' = the matrix; LinAlgError if it is not positive definite."""
    lower = np.tril(matrix)
    for j in range(len(lower)):
        lower[j:, j] -= times(lower[j:, :j], lower[j, :j])
        if not lower[j, j] > 0.0:
            raise np.linalg.LinAlgError("not positive definite")
        lower[j:, j] /= np.sqrt(lower[j, j])
    return lower


def solve(matrix: Array, right: Array) -> Array:
    """Return x with matrix x = right, (n,) or (n, k); LinAlgError if the matrix is singular."""
    n = len(matrix)
    both = np.column_stack([matrix, right])
    for j in range(n):
        pivot = j + int(np.abs(both[j:, j]).argmax())
        both[[j, pivot]] = both[[pivot, j]]
        if both[j, j] == 0.0:
            raise np.linalg.LinAlgError("singular matrix")
        both[j, j:] /= both[j, j]
        factors = both[:, j].copy()
        factors[j] = 0.0
        both[:, j:] -= factors[:, None] * both[j, j:]
    return both[:, n:].reshape(np.shape(right))


def inverse(matrix: Array) -> Array:
    """Return the inverse; LinAlgError if there is none."""
    return solve(matrix, np.eye(len(matrix)))


def orthonormal(columns: Any) -> Array:
    """Return orthonormal columns (n, k), of which the first j span the first j that are given."""
    basis: Array = np.zeros(columns.shape)
    for j, column in enumerate(columns.T):
        once = column - times(basis, times(basis.T, column))
        twice = once - times(basis, times(basis.T, once))
        unit = twice / np.sqrt(times(twice, twice))
        # (the first column takes the memory, and an interrupt is heard between the pieces)
        for first in range(0, len(unit), PIECE):
            basis[first : first + PIECE, j] = unit[first : first + PIECE]
    return basis


def eigh(matrix: Array) -> tuple[Array, Array]:
    """Return the eigenvalues (n,) of a symmetric matrix, rising, and unit eigenvectors (n, n) as columns.

    The largest share of each vector is positive.
    """
    a, n = np.array(matrix, dtype=np.float64), len(matrix)
    vectors, order = np.eye(n), np.arange(n + n % 2)
    half = len(order) // 2
    for _ in range(SWEEPS):
        if np.abs(np.triu(a, 1)).max() <= ROUNDING * np.abs(a).max():
            break
        for _ in range(2 * half - 1):
            pairs = np.stack([order[:half], order[: half - 1 : -1]])
            p, q = pairs[:, pairs.max(axis=0) < n]
            apart, off = a[q, q] - a[p, p], 2.0 * a[p, q]
            t = np.where(apart < 0.0, -off, off) / np.maximum(np.abs(apart) + np.hypot(apart, off), LEAST)
            c, t = 1.0 / np.sqrt(1.0 + t * t)[:, None], t[:, None]
            for rows in (a, a.T, vectors.T):
                rows[p], rows[q] = c * (rows[p] - t * rows[q]), c * (t * rows[p] + rows[q])
            a[p, q] = a[q, p] = 0.0
            order[1:] = np.roll(order[1:], 1)
    rising, largest = np.argsort(np.diag(a), kind="stable"), np.abs(vectors).argmax(axis=0)
    return np.diag(a)[rising], (vectors * np.sign(vectors[largest, range(n)]))[:, rising]


def expm(matrices: Array) -> Array:
    """Return the exponentials of matrices (..., n, n)."""
    identity = np.eye(matrices.shape[-1])
    halvings = np.maximum(np.frexp(np.abs(matrices).sum(axis=-1).max(axis=-1))[1] + 1, 0)[..., None, None]
    exponential, small = identity, matrices * 0.5**halvings
    for j in range(TERMS, 0, -1):
        exponential = identity + np.einsum("...ij,...jk->...ik", small, exponential) / j
    for i in range(halvings.max()):
        exponential = np.where(i < halvings, np.einsum("...ij,...jk->...ik", exponential, exponential), exponential)
    return exponential
