"""Filters of simulated motions: against scipy's, and against the sum over pulses as it is defined."""

import math

import numpy as np
import pytest
import scipy.signal

from toppling.motions.kernels.constant_filters import second_order
from toppling.motions.kernels.drifting_filters import DEAD, LANES, SAMPLES, drifting_noise
from toppling.motions.simulated.filters import discrete, filtered, high_pass, soil_layer

FILTERS = [
    *(high_pass(2.0 * math.pi * corner, 1.0) for corner in (0.03, 0.15, 1.0, 5.0)),
    high_pass(0.25 * math.pi, 0.6),
    high_pass(3.0, 0.05),
    soil_layer(8.0 * math.pi, 0.6),
    soil_layer(20.0, 0.2),
]


@pytest.mark.parametrize("dt", [0.002, 0.005, 0.02])
@pytest.mark.parametrize("polynomials", FILTERS)
def test_constant_filters_are_those_of_scipy(polynomials, dt):
    """Coefficients up to the rounding of both, whose distances from exact ones are alike; given those, bit by bit."""
    values = np.random.default_rng(4).standard_normal((3, 700))
    b, a, _ = scipy.signal.cont2discrete(tuple(map(np.array, polynomials)), dt, method="foh")
    found = discrete(*polynomials, dt)
    np.testing.assert_allclose(found[0], np.ravel(b), rtol=0.0, atol=2e-15)
    np.testing.assert_allclose(found[1], np.ravel(a), rtol=0.0, atol=2e-15)
    expected = scipy.signal.lfilter(*found, values, axis=-1)
    of_scipy = scipy.signal.lfilter(np.ravel(b), np.ravel(a), values, axis=-1)
    np.testing.assert_allclose(expected, of_scipy, rtol=0.0, atol=2e-12 * np.abs(of_scipy).max())
    np.testing.assert_array_equal(second_order(values, *found), expected)
    np.testing.assert_array_equal(filtered(values, *polynomials, dt), expected)


def defined(pulses, omega, zeta, dt):
    """The noise of one motion by its definition: every response from the closed form, all of them at every sample."""
    root = math.sqrt(1.0 - zeta**2)
    out = np.zeros(pulses.size)
    for k in range(1, pulses.size):
        w, age = omega[:k], dt * (k - np.arange(k))
        response = w / root * np.exp(-zeta * w * age) * np.sin(w * root * age)
        out[k] = (response * pulses[:k]).sum() / math.sqrt((response**2).sum())
    return out


@pytest.mark.parametrize("n", [2, SAMPLES, SAMPLES + 1, SAMPLES + 2, 3 * SAMPLES + 5, 400])
@pytest.mark.parametrize(("first", "last", "zeta"), [(30.0, 30.0, 0.3), (60.0, 4.0, 0.2), (5.0, 70.0, 0.5)])
def test_drifting_noise_is_the_sum_over_all_pulses(n, first, last, zeta):
    """But for responses that have died out: a millionth each."""
    pulses = np.random.default_rng(n).standard_normal((2, n))
    omega = np.stack([np.linspace(first, last, n), np.linspace(last, first, n)])
    found = drifting_noise(pulses, omega, np.array([zeta, 0.7 * zeta]), 0.02, np.array([n, n]))
    for i, damping in enumerate((zeta, 0.7 * zeta)):
        expected = defined(pulses[i], omega[i], damping, 0.02)
        np.testing.assert_allclose(found[i], expected, rtol=0.0, atol=20.0 * math.exp(-DEAD))


@pytest.mark.parametrize("company", [1, 3, 2 * LANES + 5])
def test_a_motion_does_not_depend_on_those_beside_it(company):
    """Neither on how many are computed together, nor on their order, to the last bit."""
    rng = np.random.default_rng(company)
    pulses = rng.standard_normal((company, 300))
    omega = np.stack([np.linspace(*rng.uniform(3.0, 60.0, 2), 300) for _ in range(company)])
    zeta, live = rng.uniform(0.1, 0.8, company), rng.integers(2, 300, company)
    order = rng.permutation(company)
    found = np.empty_like(pulses)
    found[order] = drifting_noise(pulses[order], omega[order], zeta[order], 0.02, live[order])
    for i in range(company):
        one = slice(i, i + 1)
        alone = drifting_noise(pulses[one], omega[one], zeta[one], 0.02, live[one])
        np.testing.assert_array_equal(found[i], alone[0])


def test_a_sample_depends_on_nothing_after_it():
    """However many samples are computed together: to the last bit, for every length."""
    pulses = np.random.default_rng(1).standard_normal((1, 120))
    omega, zeta = np.linspace(50.0, 8.0, 120)[None], np.array([0.4])
    whole = drifting_noise(pulses, omega, zeta, 0.05, np.array([120]))
    for n in range(2, 120):
        part = drifting_noise(pulses, omega, zeta, 0.05, np.array([n]))
        np.testing.assert_array_equal(part[0, :n], whole[0, :n])
        assert not part[0, n:].any()
