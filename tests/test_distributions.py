"""Distributions of numbers: values of probabilities, probabilities of values, against scipy's; moments; friction."""

import math

import numpy as np
import pytest
from scipy import stats

from toppling.distributions import Beta, Lognormal, Normal, Uniform
from toppling.models.friction import LognormalFriction, NormalFriction, UniformFriction

PROBABILITIES = np.array([1e-6, 0.01, 0.3, 0.5, 0.9, 0.999])
CASES = [
    (Normal(2.0, 0.5), stats.norm(2.0, 0.5)),
    (Normal(2.0, 0.5, lower=1.8), stats.truncnorm(-0.4, np.inf, 2.0, 0.5)),
    (Normal(2.0, 0.5, lower=5.0, upper=6.0), stats.truncnorm(6.0, 8.0, 2.0, 0.5)),
    (Lognormal(2.0, 0.4), stats.lognorm(0.4, scale=2.0)),
    (Uniform(-1.0, 3.0), stats.uniform(-1.0, 4.0)),
    (Beta(3.0, 2.0, 0.5, 1.0), stats.beta(3.0, 2.0, 0.5, 0.5)),
]


@pytest.mark.parametrize(("own", "other"), CASES, ids=[repr(own) for own, _ in CASES])
def test_as_scipy_has_it(own, other):
    values = own.quantile(PROBABILITIES)
    np.testing.assert_allclose(values, other.ppf(PROBABILITIES), rtol=1e-9)
    np.testing.assert_allclose(own.below(values), PROBABILITIES, rtol=1e-7)
    # what lies near an end is a difference of numbers that are not small
    np.testing.assert_allclose(own.below(values), other.cdf(values), rtol=1e-9, atol=1e-14)
    low, high = own.support
    outside = own.below([low - 1.0, high + 1.0, np.nan])
    np.testing.assert_array_equal(outside, [0.0, 1.0, np.nan])


def test_a_truncated_lognormal():
    law, plain = Lognormal(2.0, 0.4, 1.0, 3.0), stats.lognorm(0.4, scale=2.0)
    x = np.array([1.0, 1.5, 2.0, 2.9, 3.0])
    expected = (plain.cdf(x) - plain.cdf(1.0)) / (plain.cdf(3.0) - plain.cdf(1.0))
    np.testing.assert_allclose(law.below(x), expected, rtol=1e-12, atol=1e-15)
    np.testing.assert_array_equal(law.below([-1.0, 0.0]), 0.0)


def test_beta_of_moments():
    law = Beta.from_moments(0.9, 0.05)
    assert stats.beta(law.a, law.b).mean() == pytest.approx(0.9, rel=1e-12)
    assert stats.beta(law.a, law.b).std() == pytest.approx(0.05, rel=1e-12)
    with pytest.raises(ValueError, match=r"std must be finite and > 0 and < 0\.3"):
        Beta.from_moments(0.9, 0.3)
    with pytest.raises(ValueError, match="mean must be"):
        Beta.from_moments(1.0, 0.1)


def test_friction_is_of_the_same_distributions():
    need = np.array([0.0, 0.2, 0.5, 1.1, np.nan])
    np.testing.assert_array_equal(LognormalFriction(0.5, 0.3).below(need), Lognormal(0.5, 0.3).below(need))
    np.testing.assert_array_equal(UniformFriction(0.1, 0.6).below(need), Uniform(0.1, 0.6).below(need))
    cut = stats.truncnorm(-0.5 / 0.4, math.inf, 0.5, 0.4).cdf(need)
    np.testing.assert_allclose(NormalFriction(0.5, 0.4).below(need), cut, rtol=1e-12)


def test_a_bound_too_far_above_a_tiny_median():
    """1e308 over 1e-300 is no number: the bound bounds nothing."""
    import warnings

    with warnings.catch_warnings():
        warnings.simplefilter("error")
        bounded = Lognormal(1e-300, 0.1, 0.0, 1e308).quantile(np.array([0.1, 0.5, 0.9]))
    np.testing.assert_array_equal(bounded, Lognormal(1e-300, 0.1).quantile(np.array([0.1, 0.5, 0.9])))
