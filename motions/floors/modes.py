"""Modes of elastic buildings: a uniform flexural-shear beam, and storeys as masses on springs.

A mode acts on a floor through one number, its share: modal participation times the shape at the floor. It does not
depend on the normalisation of the shape. The shares of a floor add up to 1 over all modes. The module does not depend
on motions.
"""

import math

import numpy as np
from numpy.typing import NDArray

from ...core.elementary import Array, eigh, times

MOST_BEAM_MODES = 100


def beam_roots(alpha0: float, modes: int) -> Array:
    """Return the roots gamma (mode,) of the characteristic equation of a uniform flexural-shear cantilever.

    The equation is 2 + [2 + alpha0^4/(gamma beta)²] cos gamma cosh beta + alpha0²/(gamma beta) sin gamma sinh beta = 0
    with beta² = alpha0² + gamma², divided by cosh beta. At gamma = i pi it has the sign of cos(i pi), so root i lies
    between (i - 1) pi and i pi.
    """
    a2 = alpha0 * alpha0

    def characteristic(gamma: float) -> float:
        beta = math.sqrt(a2 + gamma * gamma)
        ratio = a2 / (gamma * beta)
        lost = 2.0 * math.exp(-beta) / (1.0 + math.exp(-2.0 * beta))  # 1/cosh beta without overflow
        return 2.0 * lost + (2.0 + ratio * ratio) * math.cos(gamma) + ratio * math.sin(gamma) * math.tanh(beta)

    roots = []
    for i in range(1, modes + 1):
        low, high = max((i - 1) * math.pi, 1e-3), i * math.pi
        above = characteristic(low) > 0.0
        # (halved until no number lies between: the import of a solver would take longer than all else here)
        while low < (middle := 0.5 * (low + high)) < high:
            low, high = (middle, high) if (characteristic(middle) > 0.0) == above else (low, middle)
        roots.append(middle)
    return np.array(roots)


def beam_modes(alpha0: float, modes: int, heights: Array) -> tuple[Array, Array]:
    """Return frequencies over the first (mode,) and shares (mode, height) of a uniform flexural-shear cantilever.

    Shares are participation times shape at relative heights x, 0 to 1. The shape is phi = sin gamma x - (gamma/beta)
    sinh beta x - eta cos gamma x + eta cosh beta x. Its eta = (gamma² sin gamma + gamma beta sinh beta)/(gamma² cos
    gamma + beta² cosh beta); omega is proportional to beta gamma. Participation is the integral of phi over the
    integral of phi² (Miranda and Taghavi (2005), Journal of Structural Engineering 131(2), 203-211). The two hyperbolic
    terms nearly cancel: they are written as multiples of exp(-beta (1 - x)) and exp(-beta x).
    """
    gammas = beam_roots(alpha0, modes)
    betas = np.sqrt(alpha0 * alpha0 + gammas * gammas)
    shares = np.empty((modes, heights.size))
    for i, (gamma, beta) in enumerate(zip(gammas.tolist(), betas.tolist(), strict=True)):
        fade = math.exp(-beta)
        # numerator of eta - gamma/beta, and the denominator of eta, over cosh beta's exp(beta)
        excess = gamma * gamma * math.sin(gamma) - gamma**3 / beta * math.cos(gamma) - gamma * beta * fade
        below = gamma * gamma * math.cos(gamma) * fade + 0.5 * beta * beta * (1.0 + fade * fade)
        eta = gamma / beta + excess * fade / below
        # phi = sum of c exp(k (x - x0)): sine and cosine, a part that grows to the roof, a part that decays from 0
        c = np.array([0.5 * (-1j - eta), 0.5 * (1j - eta), 0.5 * excess / below, 0.5 * (eta + gamma / beta)])
        k = np.array([1j * gamma, -1j * gamma, beta, -beta])
        x0 = np.array([0.0, 0.0, 1.0, 0.0])
        shape = (c[:, None] * np.exp(k[:, None] * (heights - x0[:, None]))).sum(axis=0).real
        pairs, starts = k[:, None] + k, -(k * x0)[:, None] - k * x0
        once = (c * _integral(k, -k * x0)).sum().real
        twice = (c[:, None] * c * _integral(pairs, starts)).sum().real
        shares[i] = once / twice * shape
    shares[:, heights == 0.0] = 0.0
    return betas * gammas / (betas[0] * gammas[0]), shares


def _integral(k: NDArray[np.complex128], start: NDArray[np.complex128]) -> NDArray[np.complex128]:
    """Return the integral of exp(k x + start) over 0 to 1."""
    still = np.abs(k) < 1e-12
    safe = np.where(still, 1.0, k)
    return np.where(still, np.exp(start), (np.exp(k + start) - np.exp(start)) / safe)


def storey_modes(masses: Array, stiffnesses: Array) -> tuple[Array, Array]:
    """Return circular frequencies (mode,), rad/s, and shares (mode, storey) of masses (kg) on storey springs (N/m).

    K phi = omega² M phi with K_ii = k_i + k_(i+1), K_(i,i+1) = -k_(i+1); shapes of unit modal mass, participation phi'
    M 1.
    """
    stiffness = np.diag(stiffnesses + np.append(stiffnesses[1:], 0.0))
    stiffness -= np.diag(stiffnesses[1:], 1) + np.diag(stiffnesses[1:], -1)
    root = np.sqrt(masses)
    squares, vectors = eigh(stiffness / root[:, None] / root)
    shapes = vectors.T / root
    return np.sqrt(squares), times(shapes, masses)[:, None] * shapes
