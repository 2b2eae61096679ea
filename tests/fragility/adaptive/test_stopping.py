"""The stopping rule, step by step."""

import math

import pytest

from toppling.fragility.adaptive.stopping import (
    MOST_MOTIONS,
    NO_MORE,
    REACHED,
    StoppingRule,
    motions_needed,
    next_wave,
)
from toppling.fragility.adaptive.until import Until


def followed(steps, until=None):
    """Reasons after each (motions, ratio, last)."""
    rule = StoppingRule(until or Until())
    return [rule.step(*step) for step in steps]


def test_two_looks_in_a_row_and_a_confirming_wave():
    steps = [(64, 0.8, False), (96, 0.8, False), (128, 0.9, False)]
    assert followed(steps) == ["", "", REACHED]


def test_a_look_needs_a_margin_and_one_is_not_enough():
    # the third breaks the row, and 0.9 is within the tolerance but not within the margin
    steps = [(64, 0.8, False), (96, 0.9, False), (128, 0.8, False), (160, 0.8, False), (192, 0.9, False)]
    assert followed(steps) == ["", "", "", "", REACHED]


def test_no_look_before_the_least():
    steps = [(32, 0.1, False), (64, 0.1, False), (96, 0.1, False)]
    assert followed(steps) == ["", "", ""]


def test_what_is_not_confirmed_goes_on_from_the_start():
    steps = [(64, 0.8, False), (96, 0.8, False), (128, 1.1, False), (160, 0.8, False), (192, 0.8, False)]
    assert followed(steps) == [""] * 5
    assert followed([*steps, (224, 1.0, False)]) == [""] * 5 + [""]
    assert followed([*steps, (224, 1.0, False), (256, 1.0, False)])[-1] == REACHED


def test_the_confirming_wave_is_a_fifth():
    steps = [(640, 0.8, False), (704, 0.8, False), (832, 0.8, False), (844, 0.8, False), (845, 0.8, False)]
    assert followed(steps) == ["", "", "", "", REACHED]


@pytest.mark.parametrize(("motions", "last", "reason"), [(100, False, MOST_MOTIONS), (90, True, NO_MORE)])
def test_ends_of_the_motions(motions, last, reason):
    until = Until(most=100)
    assert followed([(motions, 2.0, last)], until) == [reason]
    # good looks that nothing confirms any more are no promise kept
    assert followed([(64, 0.5, False), (motions, 0.5, last)], until) == ["", reason]
    assert followed([(64, 0.5, False), (80, 0.5, False), (motions, 0.9, last)], until) == ["", "", REACHED]


def test_firm_errors_need_less_room():
    """At four times the motions of firm errors the room is half as wide: 0.9 is a good look, 0.95 is none."""
    for ratio, reasons in ((0.9, ["", "", REACHED]), (0.95, ["", "", ""])):
        rule = StoppingRule(Until(most=10_000), 1024)
        assert [rule.step(motions, ratio, False) for motions in (4096, 4608, 5530)] == reasons
    rule = StoppingRule(Until(most=10_000), 1024)
    assert [rule.step(motions, 0.9, False) for motions in (960, 1024, 1229)] == [""] * 3
    assert motions_needed(4096, 2.0, 1024) == math.ceil(1.2 * 4096 * 2.2**2)


def test_waves_grow_with_the_motions():
    assert [next_wave(n) for n in (0, 32, 511, 512, 4096)] == [32, 32, 32, 64, 512]


def test_motions_needed_grow_with_the_square_of_the_width():
    assert motions_needed(100, 2.0) == math.ceil(1.2 * 100 * 2.4**2)
    assert motions_needed(100, 0.5) == 132
    assert motions_needed(100, math.inf) == 0
