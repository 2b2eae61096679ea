"""Compiled filters whose frequency drifts; arguments and results are plain arrays."""

import math
from typing import Any

import numpy as np

from ...compiled import kernel

# Products and sums are fused where the processor can; the sums over pulses keep their order.
_FUSED: dict[str, Any] = {"fastmath": {"contract", "nsz"}}
_COEFFICIENTS: dict[str, Any] = {"fastmath": {"reassoc", "contract", "nsz"}}

DEAD = 14.0  # a response is dropped once its envelope has fallen by exp(14) = 1e6 (its variance by 1e12)
SAMPLES = 8
"""Samples that are computed together: a sum waits for its last term, but the sums of eight samples do not wait for each
other.  `_add_samples` is written for this number."""


@kernel(**_COEFFICIENTS)
def _start(omega, zeta, dt, state, last, growth, decay, end):
    """Fill the first two values of each pulse's response, the coefficients of its recursion, and its last sample."""
    root = math.sqrt(1.0 - zeta * zeta)
    for j in range(omega.size):
        ratio = math.exp(-zeta * omega[j] * dt)
        turn = root * omega[j] * dt
        # h(0) = 0 and h(-dt), from which the recursion starts
        state[j] = 0.0
        last[j] = -omega[j] / root * math.sin(turn) / ratio
        growth[j] = 2.0 * ratio * math.cos(turn)
        decay[j] = ratio * ratio
        end[j] = j + 1 + DEAD / (zeta * omega[j] * dt)


@kernel(**_FUSED)
def _add(i, k, pulses, state, last, growth, decay, total, variance):
    """Advance the response of pulse i by one sample, and add it to the sums of sample k of those computed together."""
    new = growth[i] * state[i] - decay[i] * last[i]
    last[i] = state[i]
    state[i] = new
    total[k] += pulses[i] * new
    variance[k] += new * new


@kernel(**_FUSED)
def _add_samples(pulses, state, last, growth, decay, total, variance):
    """Advance the responses of all these pulses by `SAMPLES` samples, and add them to the sums."""
    t0, t1, t2, t3 = total[0], total[1], total[2], total[3]
    t4, t5, t6, t7 = total[4], total[5], total[6], total[7]
    v0, v1, v2, v3 = variance[0], variance[1], variance[2], variance[3]
    v4, v5, v6, v7 = variance[4], variance[5], variance[6], variance[7]
    for i in range(pulses.size):
        u = pulses[i]
        g = growth[i]
        d = decay[i]
        z = state[i]
        a = g * z - d * last[i]
        t0 += u * a
        v0 += a * a
        b = g * a - d * z
        t1 += u * b
        v1 += b * b
        a = g * b - d * a
        t2 += u * a
        v2 += a * a
        b = g * a - d * b
        t3 += u * b
        v3 += b * b
        a = g * b - d * a
        t4 += u * a
        v4 += a * a
        b = g * a - d * b
        t5 += u * b
        v5 += b * b
        a = g * b - d * a
        t6 += u * a
        v6 += a * a
        b = g * a - d * b
        t7 += u * b
        v7 += b * b
        last[i] = a
        state[i] = b
    total[0], total[1], total[2], total[3] = t0, t1, t2, t3
    total[4], total[5], total[6], total[7] = t4, t5, t6, t7
    variance[0], variance[1], variance[2], variance[3] = v0, v1, v2, v3
    variance[4], variance[5], variance[6], variance[7] = v4, v5, v6, v7


@kernel()
def _noise(pulses, omega, zeta, dt, out, work, total, variance, first):
    """Compute one motion of `drifting_noise`; work (5, n), total, variance and first (SAMPLES,) are work arrays."""
    n = pulses.size
    state, last, growth, decay, end = work[0], work[1], work[2], work[3], work[4]
    _start(omega[: n - 1], zeta, dt, state, last, growth, decay, end)
    oldest = 0
    for k in range(1, n, SAMPLES):
        samples = min(SAMPLES, n - k)
        for s in range(samples):
            total[s] = 0.0
            variance[s] = 0.0
            while oldest < k + s - 1 and end[oldest] < k + s:
                oldest += 1
            first[s] = oldest
        # every sum takes its pulses in their order: those that are dropped on the way, those that live through all of
        # these samples, and those that begin on the way
        whole = samples == SAMPLES
        middle = min(first[samples - 1], k) if whole else k
        for i in range(first[0], middle):
            for s in range(samples):
                if i >= first[s]:
                    _add(i, s, pulses, state, last, growth, decay, total, variance)
        if whole:
            live = slice(middle, k)
            _add_samples(pulses[live], state[live], last[live], growth[live], decay[live], total, variance)
        for i in range(k, k + samples - 1):
            for s in range(i - k + 1, samples):
                if i >= first[s]:
                    _add(i, s, pulses, state, last, growth, decay, total, variance)
        for s in range(samples):
            out[k + s] = total[s] / math.sqrt(variance[s])


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
    work = np.empty((5, n))
    total = np.empty(SAMPLES)
    variance = np.empty(SAMPLES)
    first = np.empty(SAMPLES, np.int64)
    for i in range(m):
        _noise(pulses[i, : live[i]], omega[i], zeta[i], dt, out[i], work, total, variance, first)
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
