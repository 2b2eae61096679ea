"""Linear second-order filters of simulated motions, exact for input that is linear between samples.

A filter is the pair of polynomials in s of its transfer function, highest power first.
"""

import math

import numpy as np

from ...core.elementary import Array, expm, times
from ..kernels.constant_filters import second_order

PIECE = 50_000  # steps whose propagators are computed together: half a second
SETTLING = 10.0
"""Time constants in which a filter dies out: (1 + 10) exp(-10) = 5e-4 of its displacement remains at most."""


def soil_layer(omega: float, xi: float) -> tuple[list[float], list[float]]:
    """Return the filter of a soil layer with circular frequency omega (rad/s) and damping ratio xi.

    (2 xi omega s + omega²)/(s² + 2 xi omega s + omega²).
    """
    damping = 2.0 * xi * omega
    return [damping, omega**2], [1.0, damping, omega**2]


def high_pass(omega: float, xi: float) -> tuple[list[float], list[float]]:
    """Return the high-pass s²/(s² + 2 xi omega s + omega²) of corner omega (rad/s) and damping ratio xi."""
    return [1.0, 0.0, 0.0], [1.0, 2.0 * xi * omega, omega**2]


def settling(omega: float, xi: float = 1.0) -> float:
    """Return the time in which a filter of circular frequency omega (rad/s) and damping ratio xi dies out, s."""
    return SETTLING / omega * (xi + math.sqrt(xi * xi - 1.0) if xi > 1.0 else 1.0 / xi)


def filtered(values: Array, numerator: list[float], denominator: list[float], dt: float) -> Array:
    """Return the response of a filter to `values` (motion, n) from rest, with step dt (s); same shape.

    Both polynomials are of degree 2, a lower one filled up with zeros, and the denominator begins with 1.
    """
    response: Array = second_order(np.ascontiguousarray(values), *discrete(numerator, denominator, dt))
    return response


def propagators(damping: Array, stiffness: Array, dt: float) -> tuple[Array, Array, Array]:
    """Return one step of x'' + damping x' + stiffness x = w for each of several (n,), with w linear over the step.

    The step is the exponential of the matrix of (x, x', w, dt w'), which is valid for any damping. The results multiply
    (x, x') before the step, and w before and after it.
    """
    step = np.empty((damping.size, 2, 4))
    for first in range(0, damping.size, PIECE):  # (an interrupt is heard between them)
        part = slice(first, first + PIECE)
        matrix = np.zeros((damping[part].size, 4, 4))
        matrix[:, 0, 1] = matrix[:, 1, 2] = dt
        matrix[:, 1, 0], matrix[:, 1, 1], matrix[:, 2, 3] = -stiffness[part] * dt, -damping[part] * dt, 1.0
        step[part] = expm(matrix)[:, :2]
    return step[:, :, :2], step[:, :, 2] - step[:, :, 3], step[:, :, 3]


def discrete(numerator: list[float], denominator: list[float], dt: float) -> tuple[Array, Array]:
    """Return the polynomials (3,) and (3,) in 1/z of a filter whose input is linear between samples of step dt (s).

    Up to rounding it is `scipy.signal.cont2discrete` with ``method="foh"``, whose last digits depend on the processor.
    """
    b = np.pad(np.array(numerator, dtype=np.float64), (3 - len(numerator), 0))
    damping, stiffness = denominator[1:]
    read = (b[1:] - b[0] * np.array([damping, stiffness]))[::-1]
    state, now, slope = (part[0] for part in propagators(np.array([damping]), np.array([stiffness]), dt))
    through = b[0] + float(times(read, slope))
    without = state - (now + times(state, slope))[:, None] * read
    poles, zeros = (
        np.array([1.0, -m[0, 0] - m[1, 1], m[0, 0] * m[1, 1] - m[0, 1] * m[1, 0]]) for m in (state, without)
    )
    return zeros + (through - 1.0) * poles, poles
