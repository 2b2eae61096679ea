"""Compiled sums over the runs of a surface of lognormal curves: terms, likelihood, scores and information."""

import math

import numpy as np

from ...core.compiled import kernel
from .binomial import LARGE, PROBIT, at_level

FURTHEST = 1e8
"""Standard normal deviate beyond which a run is impossible."""


@kernel(keep=True)
def fill_terms(points, exponents, products):
    """Write products of Chebyshev polynomials of degrees `exponents` (term, variable) at points (point, variable) into
    `products` (point, term).
    """
    variables = points.shape[1]
    degree = 0
    for term in range(exponents.shape[0]):
        for k in range(variables):
            degree = max(degree, exponents[term, k])
    table = np.ones((variables, degree + 1))
    for i in range(points.shape[0]):
        for k in range(variables):
            x = points[i, k]
            if degree > 0:
                table[k, 1] = x
            for d in range(2, degree + 1):
                table[k, d] = 2.0 * x * table[k, d - 1] - table[k, d - 2]
        for term in range(exponents.shape[0]):
            value = 1.0
            for k in range(variables):
                value *= table[k, exponents[term, k]]
            products[i, term] = value


@kernel(keep=True)
def add_scores(middle, spread, c, x, fell, motion, scores, information):
    """Add up the runs of a surface with coefficients c: of ln median, then of ln dispersion.

    middle, spread (run, term): the terms of the two; x (run,): ln levels; motion (run,): numbers. The slopes of the
    runs' ln likelihood in the coefficients are added to `scores` (motion, term), and the expected information to
    `information` (term, term). Returns the ln likelihood; -inf, with sums of a part of the runs, if one of them is
    impossible.
    """
    n, m = middle.shape[1], spread.shape[1]
    by = np.zeros((4, n + m))
    weighted = np.zeros((4, n + m))
    total = 0.0
    for i in range(x.size):
        place = scale = 0.0
        for j in range(n):
            place += middle[i, j] * c[j]
        for j in range(m):
            scale += spread[i, j] * c[n + j]
        inverse = math.exp(-min(max(scale, -LARGE), LARGE))
        z = (x[i] - place) * inverse
        if not abs(z) < FURTHEST:
            return -np.inf
        log_p, log_q, _, u, v, _, _ = at_level(z, PROBIT)
        slope = u if fell[i] else -v
        weight = u * v
        total += log_p if fell[i] else log_q
        row = i % 4
        for j in range(n):
            by[row, j] = -inverse * middle[i, j]
        for j in range(m):
            by[row, n + j] = -z * spread[i, j]
        at = motion[i]
        for j in range(n + m):
            scores[at, j] += slope * by[row, j]
            weighted[row, j] = weight * by[row, j]
        if row < 3 and i < x.size - 1:
            continue
        # (four runs at a time: the information is read and written a quarter as often)
        for j in range(n + m):
            w0, w1, w2, w3 = weighted[0, j], weighted[1, j], weighted[2, j], weighted[3, j]
            for k in range(n + m):
                information[j, k] += w0 * by[0, k] + w1 * by[1, k] + (w2 * by[2, k] + w3 * by[3, k])
        weighted[:] = 0.0
    return total
