"""Compiled filters whose frequency drifts; arguments and results are plain arrays."""

import math
from typing import Any

import numpy as np

from ...core.compiled import kernel

# Products and sums are fused where the processor can; the sums over pulses keep their order.
_FUSED: dict[str, Any] = {"fastmath": {"contract", "nsz"}}
_COEFFICIENTS: dict[str, Any] = {"fastmath": {"reassoc", "contract", "nsz"}}

DEAD = 14.0  # a response is dropped once its envelope has fallen by exp(14) = 1e6 (its variance by 1e12)
SAMPLES = 8
"""Samples that are computed together: a response is loaded once for all of them.  `_add_samples` is written for this
number."""
LANES = 8
"""Motions that are computed together, in vectors."""
# A pulse has rows of `LANES` numbers; the sums are of the responses, then of their squares.
PULSE, GROWTH, DECAY, STATE, LAST = range(0, 5 * LANES, LANES)
WIDTH = 5 * LANES
SQUARES = SAMPLES * LANES


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


@kernel()
def _fill(lane, pulses, work, rows):
    """Place the pulses of a lane, and the results of `_start` for them, among the rows of all lanes."""
    for j in range(pulses.size):
        at = WIDTH * j + lane
        rows[at + STATE] = work[0, j]
        rows[at + LAST] = work[1, j]
        rows[at + GROWTH] = work[2, j]
        rows[at + DECAY] = work[3, j]
        rows[at + PULSE] = pulses[j]


@kernel(**_FUSED)
def _add_samples(first, stop, lanes, rows, sums):
    """Advance the responses first … stop - 1 of all lanes by `SAMPLES` samples, and add them to the sums.

    Two flat arrays, rows at constant offsets, and a trip count that is known at run time only: so it vectorises.
    """
    for i in range(first, stop):
        row = rows[WIDTH * i : WIDTH * i + WIDTH]
        for lane in range(lanes):
            u = row[PULSE + lane]
            g = row[GROWTH + lane]
            d = row[DECAY + lane]
            z = row[STATE + lane]
            a = g * z - d * row[LAST + lane]
            sums[lane] += u * a
            sums[SQUARES + lane] += a * a
            b = g * a - d * z
            sums[LANES + lane] += u * b
            sums[SQUARES + LANES + lane] += b * b
            a = g * b - d * a
            sums[2 * LANES + lane] += u * a
            sums[SQUARES + 2 * LANES + lane] += a * a
            b = g * a - d * b
            sums[3 * LANES + lane] += u * b
            sums[SQUARES + 3 * LANES + lane] += b * b
            a = g * b - d * a
            sums[4 * LANES + lane] += u * a
            sums[SQUARES + 4 * LANES + lane] += a * a
            b = g * a - d * b
            sums[5 * LANES + lane] += u * b
            sums[SQUARES + 5 * LANES + lane] += b * b
            a = g * b - d * a
            sums[6 * LANES + lane] += u * a
            sums[SQUARES + 6 * LANES + lane] += a * a
            b = g * a - d * b
            sums[7 * LANES + lane] += u * b
            sums[SQUARES + 7 * LANES + lane] += b * b
            row[LAST + lane] = a
            row[STATE + lane] = b


@kernel(**_FUSED)
def _add(i, lane, s, rows, sums):
    """Advance response i of one lane by one sample, and add it to its sums of sample s, as `_add_samples` does."""
    row = rows[WIDTH * i + lane : WIDTH * i + WIDTH]
    new = row[GROWTH] * row[STATE] - row[DECAY] * row[LAST]
    row[LAST] = row[STATE]
    row[STATE] = new
    sums[LANES * s + lane] += row[PULSE] * new
    sums[SQUARES + LANES * s + lane] += new * new


@kernel()
def _drop(k, lane, oldest, end, rows, sums):
    """Add the responses of a lane that die out within the samples from k on, each as long as it lives.

    They are zero from then on.  Returns the oldest response that outlives these samples.
    """
    left = oldest
    last = k + SAMPLES - 1
    while left < k and end[left] < last:
        left += 1
    for s in range(SAMPLES):
        while oldest < left and end[oldest] < k + s:
            rows[WIDTH * oldest + STATE + lane] = 0.0
            rows[WIDTH * oldest + LAST + lane] = 0.0
            oldest += 1
        for i in range(oldest, left):
            _add(i, lane, s, rows, sums)
    return left


@kernel()
def _noise(group, live, ends, rows, sums, oldest, out):
    """Compute the motions `group`, one for each lane, from the rows of their pulses.

    Every sum takes its pulses in their order. First are pulses that die out within the samples computed together, then
    pulses that live through all of them, and pulses that begin within them.
    """
    lanes = (group.size + 3) // 4 * 4  # (half of the lanes where they are enough)
    longest = 0
    for lane in range(group.size):
        longest = max(longest, live[group[lane]])
        oldest[lane] = 0
    for k in range(1, longest, SAMPLES):
        sums[:] = 0.0
        first = k
        for lane in range(group.size):
            if k < live[group[lane]]:
                oldest[lane] = _drop(k, lane, oldest[lane], ends[lane], rows, sums)
                first = min(first, oldest[lane])
        _add_samples(first, k, lanes, rows, sums)
        for lane in range(group.size):
            i = group[lane]
            samples = min(SAMPLES, live[i] - k)
            for s in range(samples):
                for j in range(k, k + s):
                    _add(j, lane, s, rows, sums)
                out[i, k + s] = sums[LANES * s + lane] / math.sqrt(sums[SQUARES + LANES * s + lane])


@kernel(keep=True)
def drifting_noise(pulses, omega, zeta, dt, live):
    """Return unit-variance filtered white noise x_k = sum_j s_kj u_j / sqrt(sum_j s_kj²), x_0 = 0.

    Pulse u_j starts the response s_kj = h(t_k - t_j) of an oscillator with the frequency omega_j of the instant t_j.
    Here h(t) = omega/sqrt(1 - zeta²) exp(-zeta omega t) sin(omega sqrt(1 - zeta²) t). Each response is a two-term
    recursion; all responses that have not died out advance together.

    Shapes: `pulses` (motion, n). `omega` (motion, n), rad/s, below 1.75/(zeta dt), so that no response dies out within
    `SAMPLES` samples. `zeta` (motion,), below 1. `live` (motion,): number of samples that are computed of each motion;
    the others are zero. Motions share vectors in their order, best grouped by equal lives of their responses. A motion
    does not depend on the others.
    """
    m, n = pulses.shape
    out = np.zeros((m, n))
    work = np.empty((4, n))
    rows = np.zeros((n + SAMPLES) * WIDTH)
    ends = np.empty((LANES, n))
    sums = np.empty(2 * SQUARES)
    oldest = np.empty(LANES, np.int64)
    for start in range(0, m, LANES):
        group = np.arange(start, min(start + LANES, m))
        rows[:] = 0.0
        for lane in range(group.size):
            i = group[lane]
            some = live[i] - 1
            _start(omega[i, :some], zeta[i], dt, work[0], work[1], work[2], work[3], ends[lane])
            _fill(lane, pulses[i, :some], work, rows)
        _noise(group, live, ends, rows, sums, oldest, out)
    return out


@kernel(keep=True)
def drifting_ground(noise, transition, before, after, read):
    """Return the ground acceleration of a soil layer with drifting properties, from rest.

    State (x, v) of step k becomes transition_k state + before_k w_k + after_k w_(k+1), with `transition` (n, 2, 2),
    `before` and `after` (n, 2). The acceleration is read_k state, with `read` (n + 1, 2). `noise`: (motion, n + 1).
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
