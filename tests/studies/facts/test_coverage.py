"""Remarks on intervals that contain the true value less often than they should, against docs/runs/coverage.csv."""

import csv
import re
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from check_facts import numbers_in

from toppling.studies.facts.coverage import COVERAGE, ENOUGH, coverage, coverage_in
from toppling.studies.facts.say import say

TABLE = [*csv.DictReader((Path(__file__).parents[3] / "docs/runs/coverage.csv").read_text("utf-8").splitlines())]
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
"""Rows of the table by kind of interval."""
UNNAMED = (
    "Level at which half",
    "Fitted median",
    "Ratio of annual rates",
    "Ratio of half levels",
    "Observed",
    "Sobol'",
    "Rank",
    "Loss",
    "Goodness",
)
"""Rows that hold, that no page prints as an interval of its own, or that are tests."""


def test_the_numbers_are_those_of_the_table():
    assert ROWS.keys() == COVERAGE.keys()
    for kind, pattern in ROWS.items():
        ends = {}
        for row in TABLE:
            if re.match(pattern, row["interval"]):
                ends.setdefault(int(row["motions"]), []).append((float(row["lowest"]), float(row["highest"])))
        lowest = {number: min(low for low, _ in each) for number, each in ends.items()}
        assert COVERAGE[kind] == {n: (lowest[n], max(high for _, high in ends[n])) for n in sorted(ends)}


def test_every_row_of_the_table_has_a_kind():
    for row in TABLE:
        named = any(re.match(pattern, row["interval"]) for pattern in ROWS.values())
        assert named or row["interval"].startswith(UNNAMED), row


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
