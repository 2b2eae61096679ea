"""Remarks on intervals that contain the true value less often than they should, against docs/coverage.md."""

import re
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from check_facts import numbers_in

from toppling.studies.facts.coverage import COVERAGE, ENOUGH, coverage, coverage_in
from toppling.studies.facts.say import say

PAGE = Path(__file__).parents[3] / "docs" / "coverage.md"
ROWS = {
    "rate": "Annual rate, 20 common levels",
    "rate, stripes": "Annual rate, 5 stripes",
    "rate, cloud": "Annual rate, cloud",
    "rate, isotonic": "Annual rate of isotonic curves",
    "rate, uplift-lognormal": "Annual rate of uplift curves",
    "dispersion": "Dispersion of the fitted curve",
    "fraction": "Level at which (10|25|75) % overturn, (?!cloud)",
    "fraction, cloud": "Level at which (10|25|75) % overturn, cloud",
    "half level, far apart": "Level at which half overturn, 4 levels far apart",
    "measure": "Dispersion of capacities in a measure",
    "size": "Size that meets a rate",
    "total": "Total of an inventory",
    "saving": "Saving",
    "kit": "Share of falls that a kit saves",
    "number": "Number, ",
    "ratio of medians": "Ratio of fitted medians",
    "ratio of totals": "Ratio of totals",
}
"""Rows of the page by kind of interval."""
UNNAMED = (
    "Level at which half",
    "Fitted median",
    "Ratio of annual rates",
    "Observed",
    "Sobol'",
    "Rank",
    "Loss",
    "Goodness",
)
"""Rows that hold, that no page prints as an interval of its own, or that are tests."""


def page_rows():
    cells = (
        line.split(" | ") for line in PAGE.read_text(encoding="utf-8").splitlines() if re.search(r"\| \d+: ", line)
    )
    for name, shares, *_ in cells:
        found = re.findall(r"(\d+): ([\d.]+)–([\d.]+)", shares)
        yield name.removeprefix("| "), {int(n): (float(least), float(most)) for n, least, most in found}


def test_the_table_is_that_of_the_page():
    assert ROWS.keys() == COVERAGE.keys()
    for kind, pattern in ROWS.items():
        of_kind = [shares for name, shares in page_rows() if re.match(pattern, name)]
        numbers = sorted({number for shares in of_kind for number in shares})
        ends = [list(zip(*(shares[n] for shares in of_kind if n in shares), strict=True)) for n in numbers]
        assert COVERAGE[kind] == {n: (min(least), max(most)) for n, (least, most) in zip(numbers, ends, strict=True)}


def test_every_row_of_the_page_has_a_kind():
    named = [name for name, _ in page_rows() if any(re.match(pattern, name) for pattern in ROWS.values())]
    assert {name for name, _ in page_rows()} == {*named} | {n for n, _ in page_rows() if n.startswith(UNNAMED)}


@pytest.mark.parametrize(("motions", "used"), [(3, 10), (10, 10), (39, 20), (100, 80), (399, 80)])
def test_a_total_is_remarked_below_400_motions(motions, used):
    (fact,) = coverage(["total"], motions)
    assert fact.more == {"motions": [used], "parts": [("total", *COVERAGE["total"][used])]}


def test_what_holds_has_no_remark():
    assert COVERAGE["total"][400][0] > ENOUGH
    assert not list(coverage(["total", "ratio of totals"], 400))


@pytest.mark.parametrize(
    ("motions", "step", "design", "used"),
    [
        (400, 2.0, "ida", [400]),
        (250, 2.0, "ida", [200]),
        (101, 2.0, "ida", [200]),
        (400, 1.4, "ida", []),
        (100, 2.0, "ida", []),
        (400, 2.0, "cloud", []),
    ],
)
def test_half_levels_between_levels_far_apart(motions, step, design, used):
    curves = xr.Dataset(
        {"dispersion": ("block", [0.4, 0.3]), "half_level_lower": ("block", [1.0, 1.0])},
        {"level": ("level", np.exp(0.3 * step * np.arange(4.0))), "motion": range(motions)},
        {"confidence": 0.95, "design": design},
    )
    assert [fact.more["motions"] for fact in coverage_in(curves)] == [used][: len(used)]


def test_all_kinds_are_said():
    for motions in (10, 100, 400):
        (fact,) = coverage(COVERAGE, motions)
        assert len(fact.names) == len(re.findall(r"%", say(fact, "page"))) - 1
    (fact,) = coverage(["total", "saving"], 100)
    assert numbers_in(say(fact, "page")) == [80, 95, 90, 97, 88, 96]
