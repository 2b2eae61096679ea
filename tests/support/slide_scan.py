"""Random records with random sliding blocks, many at a time."""

import math

import numpy as np

from toppling.models.sliding.runs import ONE_WAY


def scan(seed):
    """One random record with 256 random blocks: noise, drifts, steps, plateaus, bursts, sines; vertical or not."""
    rng = np.random.default_rng(seed)
    n, dt = int(rng.integers(2, 300)), float(rng.choice([1e-4, 1e-3, 0.01, 0.02, 0.05]))
    record = (
        lambda: rng.normal(size=n),
        lambda: np.cumsum(rng.normal(size=n)),
        lambda: rng.integers(-4, 5, n) * 1.0,
        lambda: np.repeat(rng.normal(size=n // 5 + 1), 5)[:n],
        lambda: rng.normal(size=n) * np.exp(rng.normal(0.0, 3.0, n)),
        lambda: np.sin(np.arange(n) * rng.uniform(0.05, 1.5) + rng.uniform(0.0, 6.0)),
    )[seed % 6]()
    record *= rng.choice([1.0, 10.0, 100.0]) / max(np.abs(record).max(), 1e-9)
    if rng.integers(2):
        record = np.append(record, np.zeros(rng.integers(1, 300)))
    vertical = None
    if rng.integers(2):
        vertical = rng.normal(size=record.size)
        vertical *= rng.uniform(0.0, 9.0) / np.abs(vertical).max()
    m = 256
    front = np.exp(rng.uniform(math.log(0.005), math.log(2.0), m))
    back = np.where(rng.random(m) < 0.2, front * rng.uniform(0.5, 2.0, m), front)
    back = np.where(rng.random(m) < 0.1, ONE_WAY, back)
    kinetic = front * rng.choice([1.0, 0.8, 0.3], m)
    kinetic_back = np.where(back < ONE_WAY, np.minimum(kinetic, back), kinetic)
    factors = rng.choice([0.5, 1.0, 1.3], m) if vertical is None else np.ones(m)
    return record, vertical, dt, np.stack([front, back, kinetic, kinetic_back], axis=1), factors
