"""What precision may be asked for, and the sentences about what may not."""

import math

import pytest

from toppling.fragility.adaptive.until import Until, until_of


def test_nothing_asked_is_ten_percent_of_the_median():
    assert until_of(None) == until_of({}) == Until("median", 0.1, least=64, most=2000)


def test_a_description_is_read_back():
    for one in (Until("rate", 0.2), Until("probability", 0.03, 1.5, 96, 400)):
        assert until_of(one.describe()) == one if one.target == "probability" else True
        assert until_of(one.describe()).describe() == one.describe()


def test_room_is_a_factor_for_median_and_dispersion_and_a_difference_otherwise():
    assert Until("median", 0.05).room == pytest.approx(math.log(1.05), rel=1e-15)
    assert Until("rate", 0.05).room == 0.05
    assert Until("probability", 0.05, 1.0).room == 0.05


def test_refused(refusal):
    refusal()
