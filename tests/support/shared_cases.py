"""What several test modules share: every law with its options, short random records, the shared data."""

from pathlib import Path

import numpy as np
import pytest
from scipy import signal

import toppling as tp

SHARED = Path(__file__).resolve().parents[3] / "shared"

needs_shared = pytest.mark.skipif(not SHARED.is_dir(), reason="the folder of shared records is not beside this clone")

ELASTIC = [
    tp.DiscreteDamping(e=0.9),
    tp.GianniniMasiani(e=0.9),
    tp.MakrisKonstantinidis(e=0.9),
    tp.Vassiliou(),
    tp.ViscousDamping(0.1),
    tp.EnergyConsistent(e=0.9, rest="elastic"),
]
RIGID = [
    tp.DiscreteDamping(e=0.9, rest="rigid"),
    tp.EnergyConsistent(e=0.9),
    tp.HousnerImpact(e=0.9, geometry="linear"),
    tp.HousnerImpact(e=0.9, geometry="bilinear"),
    tp.HousnerImpact(e=0.9),
]
LAWS = ELASTIC + RIGID


def lifts_at(oscillator):
    """The forcing that lifts a symmetric block off a rigid rest, p² sin(alpha) or q² alpha, 1/s²."""
    return oscillator.rests[0].up if oscillator.rests else abs(oscillator.regions[0].offset)


def shake(rng, n=1200, dt=0.01, omega=15.0, xi=0.6):
    """A short filtered-noise record (n,), peak 1 m/s², made without the package."""
    b, a = signal.bilinear([2.0 * xi * omega, omega**2], [1.0, 2.0 * xi * omega, omega**2], fs=1.0 / dt)
    time = np.arange(n) * dt
    noise = rng.standard_normal(n) * np.minimum(time, 1.0) * np.exp(-0.3 * np.maximum(time - 4.0, 0.0))
    record = signal.lfilter(b, a, noise)
    record = signal.sosfilt(signal.butter(2, 0.2 * 2.0 * dt, "high", output="sos"), record)
    return record / np.abs(record).max()
