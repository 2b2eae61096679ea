"""Linear second-order filters of simulated motions, exact for input that is linear between samples.

A filter is the pair of polynomials in s of its transfer function, highest power first.
"""

from __future__ import annotations

import numpy as np
import scipy

from ...aliases import Array


def soil_layer(omega: float, xi: float) -> tuple[list[float], list[float]]:
    """Return the filter of a soil layer with circular frequency omega (rad/s) and damping ratio xi.

    (2 xi omega s + omega²)/(s² + 2 xi omega s + omega²).
    """
    damping = 2.0 * xi * omega
    return [damping, omega**2], [1.0, damping, omega**2]


def high_pass(omega: float, xi: float) -> tuple[list[float], list[float]]:
    """Return the high-pass s²/(s² + 2 xi omega s + omega²) of corner omega (rad/s) and damping ratio xi."""
    return [1.0, 0.0, 0.0], [1.0, 2.0 * xi * omega, omega**2]


def filtered(values: Array, numerator: list[float], denominator: list[float], dt: float) -> Array:
    """Return the response of a filter to `values` along the last axis, from rest, with step dt (s); same shape."""
    b, a, _ = scipy.signal.cont2discrete((np.array(numerator), np.array(denominator)), dt, method="foh")
    response: Array = scipy.signal.lfilter(np.ravel(b), np.ravel(a), values, axis=-1)
    return response
