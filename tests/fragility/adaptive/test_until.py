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


@pytest.mark.parametrize(
    ("asked", "words"),
    [
        ({"median": 0.1, "rate": 0.1}, "until must name one of median, dispersion, rate, probability, got median and"),
        ({"mean": 0.1}, "an entry of until must be one of"),
        ({"median": 0.0}, "until median must be finite and >= 0.001 and < 1"),
        ({"median": 1.0}, "until median must be"),
        ({"median": "5 %"}, "until median must be a number"),
        ({"probability": 0.02}, "until probability must be a mapping of level, within, got float"),
        ({"probability": {"level": 1.0}}, "must have a level and within"),
        ({"probability": {"level": -1.0, "within": 0.1}}, "until probability level must be finite and > 0"),
        ({"probability": {"level": 1.0, "within": 0.6}}, "until probability must be finite and >= 0.001 and < 0.5"),
        ({"motions": {"least": 8}}, "until motions least must be at least 32, got 8"),
        ({"motions": {"least": 100, "most": 64}}, "until motions most must be at least 100, got 64"),
        ({"motions": 100}, "until motions must be a mapping of least, most, got int"),
        (0.05, "until must be a mapping"),
    ],
)
def test_refusals(asked, words):
    with pytest.raises((TypeError, ValueError), match=words):
        until_of(asked)
