"""Multiple-precision arithmetic of the benchmark's truth: roots, and polynomials with proved turning points."""

from __future__ import annotations

from collections.abc import Callable

import gmpy2
from gmpy2 import mpfr


def set_digits(digits: int) -> None:
    """Set the working precision of all later arithmetic in this process."""
    gmpy2.get_context().precision = int(digits * 3.33) + 8


def root(f: Callable[[mpfr], mpfr], a: mpfr, b: mpfr) -> mpfr:
    """Return the root of f between a and b, to rounding (Chandrupatla's bracketed inverse interpolation)."""
    tolerance = mpfr(2) ** (3 - gmpy2.get_context().precision)
    fa, fb = f(a), f(b)
    if fa * fb > 0:
        raise ValueError(f"no change of sign between {a} and {b}")
    fraction = mpfr(0.5)
    while True:
        x = a + fraction * (b - a)
        fx = f(x)
        if (fx > 0) == (fa > 0):
            c, fc = a, fa
        else:
            c, fc, b, fb = b, fb, a, fa
        a, fa = x, fx
        best, f_best = (a, fa) if abs(fa) < abs(fb) else (b, fb)
        least = tolerance * max(abs(best), 1) / abs(b - c)
        if least > 0.5 or f_best == 0:
            return best
        xi, phi = (a - b) / (c - b), (fa - fb) / (fc - fb)
        if phi**2 < xi and (1 - phi) ** 2 < 1 - xi:
            fraction = fa / (fb - fa) * fc / (fb - fc) + (c - a) / (b - a) * fa / (fc - fa) * fb / (fc - fb)
        else:
            fraction = mpfr(0.5)
        fraction = min(max(fraction, least), 1 - least)


def value(series: list[mpfr], x: mpfr) -> mpfr:
    """Return the value of a polynomial at x."""
    total = series[-1]
    for term in reversed(series[:-1]):
        total = total * x + term
    return total


def slope(series: list[mpfr]) -> list[mpfr]:
    """Return the derivative of a polynomial."""
    return [k * series[k] for k in range(1, len(series))]


def outweighs(series: list[mpfr]) -> bool:
    """Return True if the first coefficient exceeds the sum of all others: the polynomial has no zero in (0, 1]."""
    sizes = [abs(float(term)) for term in series]
    return sizes[0] > 1.000001 * sum(sizes[1:])


def turns(series: list[mpfr]) -> list[mpfr] | None:
    """Return the zeros of the derivative in (0, 1), in order; None if the step is too long to prove all of them."""
    velocity = slope(series)
    acceleration = slope(velocity)
    nodes = [mpfr(0), mpfr(1)]
    if not outweighs(acceleration):
        if not outweighs(slope(acceleration)):
            return None
        if acceleration[0] * sum(acceleration) < 0:
            nodes.insert(1, root(lambda x: value(acceleration, x), nodes[0], nodes[1]))
    at_nodes = [value(velocity, node) for node in nodes]
    return [
        root(lambda x: value(velocity, x), nodes[i], nodes[i + 1])
        for i in range(len(nodes) - 1)
        if at_nodes[i] * at_nodes[i + 1] < 0
    ]
