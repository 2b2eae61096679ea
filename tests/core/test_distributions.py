"""Distributions of numbers: values of probabilities, probabilities of values, against scipy's; moments; friction."""

import numpy as np
import pytest
from scipy import stats

from toppling.core.distributions import Beta, Least, Lognormal, Normal, Uniform
from toppling.models.friction import LognormalFriction

PROBABILITIES = np.array([1e-6, 0.01, 0.3, 0.5, 0.9, 0.999])
CASES = [
    (Normal(2.0, 0.5), stats.norm(2.0, 0.5)),
    (Normal(2.0, 0.5, lower=1.8), stats.truncnorm(-0.4, np.inf, 2.0, 0.5)),
    (Normal(0.95, 0.05, upper=1.0), stats.truncnorm(-np.inf, 1.0, 0.95, 0.05)),
    (Normal(0.0, 1.0, lower=8.0), stats.truncnorm(8.0, np.inf)),
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
    assert (low, high) == pytest.approx(other.support())
    outside = own.below([low - 1.0, high + 1.0, np.nan])
    np.testing.assert_array_equal(outside, [0.0, 1.0, np.nan])


def test_a_truncated_lognormal():
    law, plain = Lognormal(2.0, 0.4, 1.0, 3.0), stats.lognorm(0.4, scale=2.0)
    x = np.array([1.0, 1.5, 2.0, 2.9, 3.0])
    expected = (plain.cdf(x) - plain.cdf(1.0)) / (plain.cdf(3.0) - plain.cdf(1.0))
    np.testing.assert_allclose(law.below(x), expected, rtol=1e-12, atol=1e-15)
    np.testing.assert_allclose(law.quantile(expected), x, rtol=1e-9)
    np.testing.assert_array_equal(law.below([-1.0, 0.0]), 0.0)


def test_beta_of_moments():
    law = Beta.from_moments(0.9, 0.05)
    assert stats.beta(law.a, law.b).mean() == pytest.approx(0.9, rel=1e-12)
    assert stats.beta(law.a, law.b).std() == pytest.approx(0.05, rel=1e-12)


def test_friction_is_of_the_same_distributions():
    need = np.array([0.0, 0.2, 0.5, 1.1, np.nan])
    np.testing.assert_array_equal(LognormalFriction(0.5, 0.3).below(need), Lognormal(0.5, 0.3).below(need))


def test_a_bound_too_far_above_a_tiny_median():
    """1e308 over 1e-300 is no number: the bound bounds nothing."""
    import warnings

    with warnings.catch_warnings():
        warnings.simplefilter("error")
        bounded = Lognormal(1e-300, 0.1, 0.0, 1e308).quantile(np.array([0.1, 0.5, 0.9]))
    np.testing.assert_array_equal(bounded, Lognormal(1e-300, 0.1).quantile(np.array([0.1, 0.5, 0.9])))


class TestLeast:
    """The least of several parts, held to plain sampling and to closed forms."""

    PARTS = (Lognormal(900.0, 0.3), Lognormal(400.0, 0.4), Lognormal(600.0, 0.25))

    def test_against_brute_force(self):
        rng = np.random.default_rng(2)
        drawn = np.min([one.quantile(rng.random(400_000)) for one in self.PARTS], axis=0)
        p = np.array([0.01, 0.1, 0.5, 0.9, 0.99])
        found = Least(self.PARTS).quantile(p)
        errors = np.sqrt(p * (1.0 - p) / drawn.size)
        assert (np.abs(np.mean(drawn[:, None] <= found, axis=0) - p) < 4.0 * errors).all()

    def test_quantiles_and_probabilities_agree(self):
        p = np.array([1e-9, 1e-3, 0.3, 0.999, 1.0 - 1e-9])
        kit = Least(self.PARTS)
        assert np.allclose(kit.below(kit.quantile(p)), p, rtol=1e-12)
        survival = np.prod([1.0 - one.below(500.0) for one in self.PARTS])
        assert kit.below(500.0) == pytest.approx(1.0 - survival, rel=1e-14)

    def test_alike_parts_have_a_closed_form(self):
        p = np.array([0.05, 0.5, 0.95])
        assert np.allclose(Least([self.PARTS[0]] * 3).quantile(p), self.PARTS[0].quantile(1.0 - (1.0 - p) ** (1 / 3)))
        assert np.allclose(Least(self.PARTS[:1]).quantile(p), self.PARTS[0].quantile(p), rtol=1e-15)

    def test_bounded_parts(self):
        kit = Least([Uniform(2.0, 4.0), Uniform(1.0, 3.0)])
        assert kit.support == (1.0, 3.0)
        assert kit.quantile(np.array([0.0, 1.0])).tolist() == pytest.approx([1.0, 3.0])


def test_refused(refusal):
    refusal()
