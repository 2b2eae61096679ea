"""Compiled filters with constant coefficients; arguments and results are plain arrays."""

import numpy as np

from ...core.compiled import kernel


@kernel(keep=True)
def second_order(values, numerator, denominator):
    """Return the response of a discrete second-order filter to values (motion, n), from rest.

    y_k = b_0 x_k + b_1 x_(k-1) + b_2 x_(k-2) - a_1 y_(k-1) - a_2 y_(k-2), in the transposed direct form II.
    `numerator`: b (3,). `denominator`: a (3,) with a_0 = 1. No products are fused: results are bit-identical to plain
    arithmetic.
    """
    m, n = values.shape
    out = np.empty((m, n))
    b0, b1, b2 = numerator[0], numerator[1], numerator[2]
    a1, a2 = denominator[1], denominator[2]
    for i in range(m):
        first = 0.0
        second = 0.0
        for k in range(n):
            x = values[i, k]
            y = first + b0 * x
            first = second + x * b1 - y * a1
            second = x * b2 - y * a2
            out[i, k] = y
    return out
