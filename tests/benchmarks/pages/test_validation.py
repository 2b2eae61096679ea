"""docs/validation.md and its tables: numbers as printed, and ours as they are computed today."""

import pytest
from page_tables import page, rows_beside

from toppling.benchmarks.pages import validation

QUICK = ("block", "laws", "validity", "fragility", "risk", "floors", "criteria")
"""Sections that take a moment."""


def compare(sections):
    ours = validation.compute(sections)
    table = [one for one in validation.numbers() if one.key in ours]
    assert len(table) == len({one.key for one in table})
    for one in table:
        assert one.agrees(ours[one.key]) != bool(one.remark), (one.key, ours[one.key])
        assert one == one.of(ours[one.key])
    return table


def test_quick_numbers():
    assert len(compare(QUICK)) > 35


@pytest.mark.slow
def test_all_numbers():
    assert len(compare(tuple(validation.OURS))) == len(validation.numbers())


@pytest.mark.slow
def test_probabilities():
    assert {row[-1] for row in validation.yim()} == {"yes"}


def test_the_page_follows_from_its_tables():
    text = page("validation")
    rows = validation.numbers()
    remarks = [row for row in rows if row.remark]
    assert f" {len(rows) - len(remarks)} of {len(rows)} " in text
    assert all(f"- {row.what}: {row.remark}\n" in text for row in remarks)
    found = [*validation.sections(rows, remarks)]
    assert sum(row[1] for row in found) == len(rows)
    assert validation.body(found) in text
    counts = rows_beside("validation", "overturnings")
    assert len(counts) == 14
    assert f"{sum(row[-1] == 'yes' for row in counts)} of 14 counts" in text


def test_the_comparison_can_fail():
    one = next(number for number in validation.numbers() if number.key == "peak_1")
    assert one.agrees(0.4014344)
    assert not one.agrees(0.4014346)
