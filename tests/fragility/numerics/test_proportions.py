"""Binomial intervals: published numbers, scipy, mpmath, and what share of the time they hold the truth."""

import mpmath
import numpy as np
import pytest
import xarray as xr
from scipy.stats import beta as beta_distribution, binom, binomtest

import toppling as tp
from toppling.core.doubts import noted
from toppling.fragility import binomial_interval, wilson_interval
from toppling.fragility.numerics.proportions import interval_of_parts

METHODS = ("wilson", "clopper-pearson", "jeffreys")


# 95 %: 4 of 40, and the lower end of 20 of 20, to five digits
@pytest.mark.parametrize(
    ("method", "ends", "least"),
    [
        ("wilson", (0.03958, 0.23052), 0.83887),
        ("clopper-pearson", (0.02793, 0.23664), 0.83157),
        ("jeffreys", (0.03471, 0.22045), 0.88336),
    ],
)
def test_published(method, ends, least):
    np.testing.assert_allclose(binomial_interval(4, 40, method=method), ends, atol=5e-6)
    lower, upper = binomial_interval(20, 20, method=method)
    assert lower == pytest.approx(least, abs=5e-6)
    assert upper == 1.0
    # as many successes as failures: the mirror image
    np.testing.assert_allclose(binomial_interval(0, 20, method=method), (0.0, 1.0 - lower), atol=1e-15)
    np.testing.assert_allclose(
        binomial_interval(36, 40, method=method),
        1.0 - np.array(binomial_interval(4, 40, method=method))[::-1],
        atol=1e-15,
    )


@pytest.mark.parametrize("confidence", [0.5, 0.95, 0.999])
@pytest.mark.parametrize("n", [1, 7, 200])
def test_against_scipy(n, confidence):
    for k in {0, 1, n // 3, n - 1, n}:
        for method, name in (("wilson", "wilson"), ("clopper-pearson", "exact")):
            expected = binomtest(k, n).proportion_ci(confidence, method=name)
            # (scipy searches the exact ends by bisection, to 1e-12)
            np.testing.assert_allclose(binomial_interval(k, n, confidence, method), expected, rtol=1e-13, atol=2e-12)
        tail = 0.5 * (1.0 - confidence)
        posterior = beta_distribution(k + 0.5, n - k + 0.5)
        lower = 0.0 if k == 0 else posterior.ppf(tail)
        upper = 1.0 if k == n else posterior.isf(tail)
        np.testing.assert_allclose(binomial_interval(k, n, confidence, "jeffreys"), (lower, upper), rtol=1e-10)


@pytest.mark.parametrize(("k", "n"), [(4, 40), (1, 1000), (999, 1000)])
def test_against_forty_digits(k, n):
    with mpmath.workdps(40):

        def tail(a, b, x):
            return mpmath.betainc(a, b, 0, x, regularized=True)

        lower, upper = binomial_interval(k, n, 0.95, "clopper-pearson")
        assert float(tail(k, n - k + 1, mpmath.mpf(float(lower)))) == pytest.approx(0.025, rel=1e-11)
        assert float(tail(k + 1, n - k, mpmath.mpf(float(upper)))) == pytest.approx(0.975, rel=1e-11)
        lower, upper = binomial_interval(k, n, 0.95, "jeffreys")
        assert float(tail(k + 0.5, n - k + 0.5, mpmath.mpf(float(lower)))) == pytest.approx(0.025, rel=1e-11)
        assert float(tail(k + 0.5, n - k + 0.5, mpmath.mpf(float(upper)))) == pytest.approx(0.975, rel=1e-11)


def test_coverage():
    """Summed over all outcomes of 40 trials: Clopper and Pearson's keep the level everywhere, the others on average."""
    n, probabilities = 40, np.linspace(0.01, 0.99, 197)
    k = np.arange(n + 1)
    chances = binom.pmf(k[:, None], n, probabilities)
    covers = {}
    for method in METHODS:
        lower, upper = (end[:, None] for end in binomial_interval(k, n, 0.95, method))
        covers[method] = (chances * ((lower <= probabilities) & (probabilities <= upper))).sum(axis=0)
    assert covers["clopper-pearson"].min() >= 0.95
    for method in ("wilson", "jeffreys"):
        assert covers[method].mean() == pytest.approx(0.95, abs=0.006)
        assert covers[method].min() < 0.95
    widths = {method: np.subtract(*binomial_interval(4, 40, method=method)[::-1]) for method in METHODS}
    assert widths["jeffreys"] < widths["wilson"] < widths["clopper-pearson"]


def test_shapes_and_nothing_tried():
    lower, upper = binomial_interval([[0, 1], [2, 0]], [4, 2])
    assert lower.shape == upper.shape == (2, 2)
    for method in METHODS:
        assert np.isnan(binomial_interval([0], [0], method=method)).all()
    np.testing.assert_array_equal(wilson_interval(np.array([4]), np.array([40])), binomial_interval([4], [40]))


def test_probabilities_take_any_of_them():
    flags = np.zeros((1, 40), bool)
    flags[0, :4] = True
    runs = xr.Dataset({"overturned": (("level", "motion"), flags)}, coords={"level": [1.0]})
    for method, name in (("wilson", "Wilson"), ("clopper-pearson", "Clopper-Pearson"), ("jeffreys", "Jeffreys")):
        found = tp.overturning_probability(runs, interval=method)
        ends = (found["lower"].item(), found["upper"].item())
        assert ends == tuple(float(end) for end in binomial_interval(4, 40, method=method))
        assert f"95 % {name} interval" in found["lower"].attrs["long_name"]


@pytest.mark.parametrize(("successes", "doubted"), [(0.3, True), ([0.3, 1.0], True), (0.5, False), ([0.3, 3.0], False)])
def test_shares_in_place_of_numbers(successes, doubted):
    """0.3 of 100 is not 30 %; half a success is one of a motion's two outcomes."""
    with noted() as doubts:
        wilson_interval(successes, 100)
    assert [doubt.kind for doubt in doubts] == ["units"] * doubted


def test_pieces_that_fall_in_part_are_no_shares(recwarn):
    """Means over variants of a piece are parts of successes, of which nothing is doubtful."""
    lower, upper = interval_of_parts([0.176, 0.0], [8, 8])
    assert 0.0 < lower[0] < 0.022 < upper[0]
    assert not recwarn


def test_refused(refusal):
    refusal()
