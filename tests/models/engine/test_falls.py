"""Times of falls that end after the record, at the ends of the ranges."""

import math

import numpy as np
import pytest

import toppling as tp
from toppling.models.outputs import OF_ENGINE
from toppling.models.runs import run_many

BLOCK = tp.Block(0.4, 1.8)
GLUED = tp.Block(0.3, 1.5, mass=50.0, restraint=tp.Restraint.adhesive(300.0, 0.05))
LEANING = tp.Block(0.3, 1.5, cm_offset=0.02)
DT = 0.01
CASES = [
    (BLOCK, tp.ViscousDamping(1.0), 8.0),
    (BLOCK, tp.GianniniMasiani(e=0.1, delta=1e-6), 1000.0),
    (BLOCK, tp.MakrisKonstantinidis(e=0.01, delta=1e-5), 4000.0),
    (LEANING, tp.MakrisKonstantinidis(e=0.01, delta=1e-5), 4000.0),
    (GLUED, tp.HousnerImpact(e=0.5, geometry="bilinear"), 1.3),
    (GLUED, tp.HousnerImpact(geometry="linear"), 1.3),
]


def time_of_fall(block, law, level, rest):
    """Time at which a block lies that is pushed for a second, and then left for `rest` samples of the record."""
    push = np.append(np.full(100, level * 9.80665 * math.tan(block.alpha)), np.zeros(1 + rest))
    found = run_many([law.oscillator(block)], np.ones((1, 1)), push, DT)[0, 0]
    assert found[OF_ENGINE["overturned"]] == 1.0
    return found[OF_ENGINE["overturning_time"]]


@pytest.mark.parametrize(("block", "law", "level"), CASES, ids=lambda one: getattr(one, "label", None))
def test_a_fall_after_the_record_takes_as_long_as_one_within_it(block, law, level):
    """The record goes on without shaking, so nothing differs; a strongly damped block takes minutes to lie."""
    free = time_of_fall(block, law, level, 0)
    within = time_of_fall(block, law, level, 60_000)
    assert within < 600.0
    assert free == pytest.approx(within, rel=1e-9)


def test_a_fall_through_thick_oil_takes_as_long_as_its_slow_exponent_says():
    """Damping far above critical: theta' = -f/c on the falling branch, so it takes c/q² log(way at the end over start).

    c = 2 zeta sqrt(n) q with n = 1/delta - 1, to a part in (q/c)² = 1/(4 n zeta²).
    """
    law, delta, zeta = tp.ViscousDamping(100.0, delta=1e-4), 1e-4, 100.0
    run = tp.simulate(BLOCK, law, tp.motions.from_array([0.0, 0.0], DT), theta0=1.1 * BLOCK.alpha)
    q = BLOCK.p * math.sqrt(math.sin(BLOCK.alpha) / BLOCK.alpha)
    slow = 2.0 * zeta * math.sqrt(1.0 / delta - 1.0) / q
    expected = slow * math.log((0.5 * math.pi - BLOCK.alpha) / (0.1 * BLOCK.alpha))
    assert bool(run.overturned)
    assert float(run.overturning_time) == pytest.approx(expected, rel=1e-6)
