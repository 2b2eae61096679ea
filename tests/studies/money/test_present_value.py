"""Present values by adding up the years one by one, paybacks as the root of that, and their limits."""

import math

import pytest
from scipy.optimize import brentq

from toppling.studies.money.present_value import payback, present_value


@pytest.mark.parametrize("rate", [0.0, 1e-9, 0.02, 0.04, 0.5])
@pytest.mark.parametrize("years", [0, 1, 7, 50])
def test_present_value_is_the_sum_of_the_years(rate, years):
    summed = math.fsum((1.0 + rate) ** -n for n in range(1, years + 1))
    assert present_value(rate, years) == pytest.approx(summed, rel=1e-12, abs=1e-15)


@pytest.mark.parametrize("rate", [0.0, 1e-9, 0.02, 0.04, 0.1])
@pytest.mark.parametrize("cost", [1.0, 100.0, 990.0])
def test_payback_is_when_the_present_value_reaches_the_cost(rate, cost):
    found = payback(cost, 100.0, rate)
    root = brentq(lambda n: 100.0 * present_value(rate, n) - cost, 0.0, 1000.0, xtol=1e-12, rtol=1e-14)
    assert found == pytest.approx(root, rel=1e-9)


def test_a_payback_of_81_years_without_discounting_is_never():
    assert payback(81.0, 1.0, 0.0) == 81.0
    assert payback(81.0, 1.0, 0.04) == math.inf
    assert payback(25.0, 1.0, 0.04) == math.inf  # (the saving is the interest on the cost)
    assert math.isfinite(payback(24.9, 1.0, 0.04))


def test_limits():
    assert payback(10.0, 0.0, 0.0) == payback(10.0, -1.0, 0.0) == math.inf
    assert payback(0.0, 0.0, 0.04) == 0.0
    assert math.isnan(payback(math.nan, 1.0, 0.04))
    assert math.isnan(payback(1.0, math.nan, 0.04))


@pytest.mark.parametrize("rate", [-0.01, 0.51, math.nan])
def test_refuses_rates(rate):
    with pytest.raises(ValueError, match="rate must"):
        payback(1.0, 1.0, rate)
    with pytest.raises(ValueError, match="rate must"):
        present_value(rate, 1.0)


def test_refused(refusal):
    refusal()
