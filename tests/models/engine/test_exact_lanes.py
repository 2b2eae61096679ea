"""Exact geometry in lanes: bits that depend on nobody beside a run, and on no way to ask for it."""

import math

import mpmath
import numpy as np
import pytest

import toppling as tp
from toppling.models.engine.exact_runs import GLIDERS
from toppling.models.engine.series import FAR_ANGLE, sine_and_cosine
from toppling.models.runs import run_many, trace

DT = 0.005
BLOCKS = [
    tp.Block.from_slenderness(alpha, R) for alpha, R in ((0.12, 0.4), (0.2, 1.0), (0.3, 2.5), (0.5, 0.6), (1.1, 0.5))
]
WALLED = tp.Block(0.4, 1.8, wall=tp.Wall(gap=0.01))


def oscillators():
    return [tp.HousnerImpact(e=e).oscillator(block) for block in (*BLOCKS, WALLED) for e in (0.85, 0.95)]


@pytest.fixture(scope="module")
def record():
    return tp.motions.CloughPenzien(duration=10.0, dt=DT).sample(1, seed=3).values[0]


@pytest.fixture(scope="module")
def together(record):
    """More runs than there are lanes: 12 oscillators under 30 factors."""
    every = oscillators()
    factors = np.tile(np.geomspace(0.4, 6.0, 30), (len(every), 1))
    assert factors.size > 2 * GLIDERS
    results = run_many(every, factors, record, DT)
    assert 0.2 < results[..., 0].mean() < 0.8
    return factors, results


def test_a_run_alone_has_the_same_bits(record, together):
    factors, results = together
    for o, one in enumerate(oscillators()):
        for f in (3, 11, 17, 28):
            alone = run_many([one], factors[:1, f : f + 1], record, DT)[0, 0]
            np.testing.assert_array_equal(alone, results[o, f])


def test_the_order_of_runs_changes_nothing(record, together):
    factors, results = together
    order = np.random.default_rng(1).permutation(factors.shape[1])
    turned = run_many(oscillators()[::-1], factors[:, order], record, DT)
    np.testing.assert_array_equal(turned, results[::-1][:, order])


def test_histories_and_lists_of_turns_are_of_the_same_runs(record, together):
    factors, _ = together
    plain = run_many(oscillators(), factors, record, DT, skip=False)
    for o, one in enumerate(oscillators()):
        for f in (8, 20):
            run = trace(one, factors[0, f] * record, DT)
            assert run.results[0] == plain[o, f, 0]
            np.testing.assert_allclose(run.results[1], plain[o, f, 1], rtol=1e-9)
            if not run.results[0]:
                assert np.abs(run.history[0]).max() <= run.results[1] * (1.0 + 1e-12)


def test_flags_alone_are_the_same(record, together):
    factors, results = together
    flags = run_many(oscillators(), factors, record, DT, flags_only=True)
    np.testing.assert_array_equal(flags[..., 0], results[..., 0])


def test_sines_and_cosines():
    """To two units in the last place of 1 up to the angle at which the library's functions take over."""
    for x in np.linspace(-FAR_ANGLE, FAR_ANGLE, 401):
        sine, cosine = (float(one) for one in sine_and_cosine(x))
        assert abs(sine - float(mpmath.sin(x))) <= 2.5e-16
        assert abs(cosine - float(mpmath.cos(x))) <= 2.5e-16
    assert 0.5 * math.pi < FAR_ANGLE
