"""Exact geometry in lanes: bits that depend on nobody beside a run, and on no way to ask for it."""

import math

import mpmath
import numpy as np
import pytest

import toppling as tp
from toppling.models.engine.exact_runs import GLIDERS
from toppling.models.engine.series import FAR_ANGLE, sine_and_cosine, terms_end
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


def velocity_terms(angle, w0, p2, force, slope, degree):
    """Terms of w for w' = (force + slope t) cos x - p² sin x, x' = -w, from x = angle."""
    w, sine, cosine = [mpmath.mpf(w0)], [mpmath.sin(angle)], [mpmath.cos(angle)]
    for k in range(degree):
        pushed = force * cosine[k] + (slope * cosine[k - 1] if k else 0) - p2 * sine[k]
        w.append(pushed / (k + 1))
        sine.append(-sum(w[j] * cosine[k - j] for j in range(k + 1)) / (k + 1))
        cosine.append(sum(w[j] * sine[k - j] for j in range(k + 1)) / (k + 1))
    return w


def test_neglected_terms_are_below_rounding():
    """Pieces as long as `terms_end` accepts them, slow and fast, with the terms to degree 40 in their place."""
    rng = np.random.default_rng(4)
    for _ in range(60):
        angle, w0 = rng.uniform(-1.5, 1.5), rng.choice([-1.0, 1.0]) * 10.0 ** rng.uniform(-6.0, 1.0)
        p2, slope = 10.0 ** rng.uniform(0.0, 2.0), rng.normal(0.0, 200.0)
        force = rng.normal(0.0, 0.5) * p2
        w = velocity_terms(angle, w0, p2, force, slope, 40)
        h = 0.5 / math.sqrt(p2)
        a = [float((k + 1) * w[k + 1]) for k in range(11)]
        while not terms_end(w0, a[0], a[1], a[9], a[10], p2, abs(force) + abs(slope) * h, h):
            h *= 0.97
        assert h > 0.02 / (math.sqrt(p2 + abs(force)) + abs(w0) + abs(slope) ** (1.0 / 3.0))
        largest = max(abs(w0), 0.5 * abs(a[0]) * h, 0.5 * abs(a[1]) * h * h)
        assert abs(sum(w[k] * h**k for k in range(12, 41))) <= 1e-17 * largest
