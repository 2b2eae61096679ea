"""Runs up to an obstacle at some slip: with which velocity a block that slides that far meets it."""

import math

import numpy as np

from ...core.compiled import kernel
from .sample import follow_sample
from .tables import (
    BARE,
    COEFFICIENTS,
    FACTOR,
    FIRST,
    GRAVITY,
    HOLD,
    KINETIC_BACK,
    KINETIC_FRONT,
    LANES,
    LEVEL,
    MET,
    NEARLY,
    ROWS,
    SIGN,
    SLIP,
    SPEED,
    STATIC_FRONT,
    STILL,
    WAY,
)


@kernel(**BARE)
def speed_at_last(x, obstacle):
    """Speed with which a block that slides on after its record, on a floor at rest, meets the obstacle; or NaN."""
    if x[SIGN] == 0.0:
        return np.nan
    kinetic = x[KINETIC_FRONT] if x[SIGN] > 0.0 else x[KINETIC_BACK]
    room = max(0.0, obstacle - x[SIGN] * x[SLIP] - x[WAY])
    left = x[SPEED] * x[SPEED] - 2.0 * kinetic * GRAVITY * room
    return math.sqrt(left) if left > 0.0 else np.nan


@kernel(keep=True)
def run_into(shaking, friction, factors, first, obstacles, met):
    """Find the speed (n,) with which each run first meets an obstacle at the slip ±`obstacles`; NaN if none does.

    The arguments are as of `slide`. The few runs that slide so far are computed one after the other. Every sample in
    which a block slides is followed event by event, to find the piece on which it meets the obstacle.
    """
    record, vertical, dt = shaking
    x = np.empty(ROWS * LANES)
    for run in range(factors.size):
        x[:] = 0.0
        x[FIRST] = np.nan
        for k in range(COEFFICIENTS):
            x[STATIC_FRONT + k * LANES] = friction[run, k]
        f = factors[run]
        x[FACTOR] = f
        x[HOLD] = min(friction[run, 0], friction[run, 1])
        x[STILL] = NEARLY * (x[HOLD] * GRAVITY / f)
        x[LEVEL] = x[STILL]
        x[MET] = -1.0
        b0, b1 = 0.0, 0.0
        for i in range(first[run], record.size - 1):
            a0, a1 = record[i], record[i + 1]
            if vertical.size > 0:
                b0, b1 = vertical[i], vertical[i + 1]
            if x[SIGN] != 0.0 or i == first[run] or abs(a1) - x[HOLD] * b1 > x[LEVEL]:
                follow_sample(x, 0, i * dt, f * a0, f * a1, GRAVITY + f * b0, GRAVITY + f * b1, dt, obstacles[run])
                if x[MET] >= 0.0:
                    break
        met[run] = x[MET] if x[MET] >= 0.0 else speed_at_last(x, obstacles[run])
