"""Blocks in normalised units (q = gain = 1, alpha = 1 or SMALL), pulses, and the smallest amplitude that overturns."""

import math

import numpy as np

from toppling.models.assembly import Side, assemble
from toppling.models.outputs import OF_ENGINE
from toppling.models.runs import run_many

SMALL = 0.1
"""alpha where a block must stand beyond it: the engine's ground lies at pi/2 whatever alpha is."""


def table(e, around=None, alpha=1.0):
    """A block of q = 1 and gain 1."""
    side = Side(1.0, alpha, 1.0, 1.0)
    return assemble(side, side, e, None, around)


def sine(omega, halves, sign):
    """A sine of so many half cycles as a function of its number of samples; sign -1: its first half pushes forwards."""

    def sampled(samples):
        duration = halves * math.pi / omega
        return sign * np.sin(omega * np.linspace(0.0, duration, samples + 1)), duration / samples

    return sampled


def critical(oscillator, pulse, low, high, samples=8000):
    """The amplitude between low (stands) and high (falls) that just overturns, extrapolated to a smooth record.

    Chords of a smooth pulse are wrong by the square of the step.
    """
    coarse, fine = (_critical(oscillator, *pulse(n), low, high) for n in (samples, 2 * samples))
    return fine + (fine - coarse) / 3.0


def _critical(oscillator, record, dt, low, high):
    for _ in range(46):
        middle = 0.5 * (low + high)
        if run_many([oscillator], np.full((1, 1), middle), record, dt)[0, 0, 0]:
            high = middle
        else:
            low = middle
    return 0.5 * (low + high)


def front_and_back(oscillator, record, factors, dt=0.01):
    """Flags and the peaks of both sides (m, 3)."""
    columns = [OF_ENGINE[name] for name in ("overturned", "peak_front", "peak_back")]
    return run_many([oscillator], factors, record, dt)[0][:, columns]
