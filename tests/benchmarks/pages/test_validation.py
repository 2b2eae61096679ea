"""docs/validation.md: its numbers as printed, and ours as they are computed today."""

from pathlib import Path

import pytest

import toppling as tp
from toppling.benchmarks.pages import validation

TEXT = (Path(tp.__file__).parent / "docs/validation.md").read_text(encoding="utf-8")
# sections that take a blink
QUICK = ("block", "laws", "validity", "fragility", "risk", "floors", "criteria")


def compare(sections):
    ours = validation.compute(sections)
    table = [one for one in validation.numbers() if one.key in ours]
    assert len(table) == len({one.key for one in table})
    for one in table:
        assert one.agrees(ours[one.key]) != (one.key in validation.DIFFERENT), (one.key, ours[one.key])
        assert f"| {' | '.join(validation.row(one, ours[one.key]))} |" in TEXT, one.key
    return table


def test_quick_numbers():
    assert len(compare(QUICK)) > 35


@pytest.mark.slow
def test_all_numbers():
    assert len(compare(tuple(validation.OURS))) == len(validation.numbers())


@pytest.mark.slow
def test_probabilities():
    assert not any("**" in cell for row in validation.yim() for cell in row)


def test_every_section_is_on_the_page():
    assert {one.section for one in validation.numbers()} == set(validation.SECTIONS)
    for title in validation.SECTIONS.values():
        assert f"## {title}\n" in TEXT
    assert "**" not in TEXT


def test_the_comparison_can_fail():
    one = next(number for number in validation.numbers() if number.key == "peak_1")
    assert one.agrees(0.4014344)
    assert not one.agrees(0.4014346)
