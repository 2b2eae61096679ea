"""Runs that between them need the whole engine, small enough for plain Python."""

import math

import numpy as np
from shared_cases import LAWS, shake
from stress_cases import BLOCK, threshold

import toppling as tp
from toppling.models.runs import run_many, trace


def plain_selection():
    """Results of runs that between them need the whole engine, small enough for plain Python; NaN as None."""
    rng = np.random.default_rng(91)
    found = []
    for model in LAWS:
        stiff = {"delta": 0.003} if "delta" in model.options else {}
        squat = tp.Block.from_slenderness(0.4, 2.0)
        for block, options, level, dt in ((BLOCK, {}, 2.5, 0.01), (squat, stiff, 8.0, 0.02)):
            oscillator = type(model)(**{**model.options, **options}).oscillator(block)
            record = level * shake(rng, n=150, dt=dt)
            found.append(trace(oscillator, record, dt, max_turning_points=50).results)
            factors = np.array([[0.1, 0.9, 3.0]])
            found += list(run_many([oscillator], factors, record, dt)[0])
            flags = run_many([oscillator], np.append(factors, [[1e-3]], axis=1), record, dt, flags_only=True)[0, :, :1]
            found += list(np.hstack([flags, np.zeros((4, 4))]))
        found.append(trace(oscillator, np.zeros(20), 0.02, 0.6 * block.alpha, 0.1).results)
        found.append(trace(oscillator, np.r_[0.0, 60.0, 60.0, 60.0, np.zeros(60)], 0.05).results)
    # bounces by the hundred in a sample
    for geometry in ("exact", "linear"):
        oscillator = tp.HousnerImpact(e=0.998, geometry=geometry).oscillator(BLOCK)
        found.append(trace(oscillator, np.array([1.00001, 0.5, 0.5]) * threshold(oscillator), 0.05).results)
    # an overdamped crossing, and one near critical damping
    for e, speed in ((0.1, 30.0), (0.3, 3.2), (0.999, 0.5)):
        oscillator = tp.EnergyConsistent(e=e).oscillator(BLOCK)
        found.append(trace(oscillator, np.zeros(8), 0.02, 0.06 * BLOCK.alpha, -speed * BLOCK.alpha * BLOCK.p).results)
    # walls, a strap that breaks or holds, a mass off the middle
    record = 3.0 * shake(rng, n=200)
    strap = tp.Restraint.strap(1.75, 267.0, 20e3, 0.005)
    linear = tp.HousnerImpact(e=0.9, geometry="linear")
    for model, options in (
        (tp.EnergyConsistent(e=0.9), {"cm_offset": 0.05}),
        (tp.HousnerImpact(e=0.9), {"wall": tp.Wall(0.01)}),
        (linear, {"wall": tp.Wall(0.7)}),
        (linear, {"wall": tp.Wall(), "mass": 100.0, "restraint": strap}),
        (linear, {"mass": 100.0, "restraint": tp.Restraint.strap(1.75, 1e5, 20e3)}),
    ):
        oscillator = model.oscillator(tp.Block(0.4, 1.8, **options))
        found += list(run_many([oscillator], np.array([[0.5, 1.0, 2.0]]), record, 0.01)[0])
        found.append(trace(oscillator, np.zeros(20), 0.02, 0.1).results)
    return [[None if math.isnan(v) else float(v) for v in row] for row in found]
