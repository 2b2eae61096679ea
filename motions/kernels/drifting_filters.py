"""Compiled filters whose frequency drifts; arguments and results are plain arrays."""

import math
from typing import Any

import numpy as np

from ...compiled import kernel

# Sums over pulses may be reassociated, so that they are vectorised; their order depends on the machine only.
_SUMS: dict[str, Any] = {"fastmath": {"reassoc", "contract", "nsz"}}

DEAD = 14.0  # a response is dropped once its envelope has fallen by exp(14) = 1e6 (its variance by 1e12)


@kernel(**_SUMS)
def _noise(pulses, omega, zeta, dt, out, state, last, growth, decay, end):
    """Compute one motion of `drifting_noise`; the last five arguments are work arrays (n,)."""
    n = pulses.size
    root = math.sqrt(1.0 - zeta * zeta)
    oldest = 0
    for k in range(1, n):
        j = k - 1
        ratio = math.exp(-zeta * omega[j] * dt)
        turn = root * omega[j] * dt
        # h(0) = 0 and h(-dt), from which the recursion starts
        state[j] = 0.0
        last[j] = -omega[j] / root * math.sin(turn) / ratio
        growth[j] = 2.0 * ratio * math.cos(turn)
        decay[j] = ratio * ratio
        end[j] = k + DEAD / (zeta * omega[j] * dt)
        while oldest < j and end[oldest] < k:
            oldest += 1
        total = 0.0
        variance = 0.0
        for i in range(oldest, k):
            new = growth[i] * state[i] - decay[i] * last[i]
            last[i] = state[i]
            state[i] = new
            total += pulses[i] * new
            variance += new * new
        out[k] = total / math.sqrt(variance)


@kernel(keep=True)
def drifting_noise(pulses, omega, zeta, dt, live):
    """Return unit-variance filtered white noise x_k = sum_j s_kj u_j / sqrt(sum_j s_kj²), x_0 = 0.

    Pulse u_j starts the response s_kj = h(t_k - t_j) of an oscillator with the frequency omega_j of the instant t_j:
    h(t) = omega/sqrt(1 - zeta²) exp(-zeta omega t) sin(omega sqrt(1 - zeta²) t).  Each response is a two-term
    recursion; all responses that have not died out advance together.  Shapes: pulses, omega (motion, n), rad/s; zeta
    (motion,), below 1; live (motion,): number of samples that are computed of each motion; the others are zero.
    """
    m, n = pulses.shape
    out = np.zeros((m, n))
    state = np.empty(n)
    last = np.empty(n)
    growth = np.empty(n)
    decay = np.empty(n)
    end = np.empty(n)
    for i in range(m):
        _noise(pulses[i, : live[i]], omega[i], zeta[i], dt, out[i], state, last, growth, decay, end)
    return out


@kernel(keep=True)
def drifting_ground(noise, transition, before, after, read):
    """Return the ground acceleration of a soil layer with drifting properties, from rest.

    State (x, v) of step k becomes transition_k state + before_k w_k + after_k w_(k+1) (transition (n, 2, 2), before and
    after (n, 2)); the acceleration is read_k state (read (n + 1, 2)).  noise: (motion, n + 1).
    """
    m, n = noise.shape
    out = np.empty((m, n))
    for i in range(m):
        x = 0.0
        v = 0.0
        out[i, 0] = 0.0
        for k in range(n - 1):
            w = noise[i, k]
            u = noise[i, k + 1]
            new = transition[k, 0, 0] * x + transition[k, 0, 1] * v + before[k, 0] * w + after[k, 0] * u
            v = transition[k, 1, 0] * x + transition[k, 1, 1] * v + before[k, 1] * w + after[k, 1] * u
            x = new
            out[i, k + 1] = read[k + 1, 0] * x + read[k + 1, 1] * v
    return out
