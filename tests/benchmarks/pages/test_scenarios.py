"""The page of simulated earthquakes and a ground-motion model is of today."""

import csv
from pathlib import Path

import pytest

from toppling.benchmarks.pages import scenarios

DOCS = Path(__file__).resolve().parents[3] / "docs"
ROWS = [tuple(row) for row in csv.reader((DOCS / "scenarios/ratios.csv").read_text("utf-8").splitlines())][1:]


def test_the_page_is_of_its_file():
    assert scenarios.page(ROWS) == (DOCS / "scenarios.md").read_text("utf-8")


@pytest.mark.slow
def test_its_numbers_are_computed_again():
    """Those of the quickest generator, for every scenario."""
    for at in scenarios.SCENARIOS:
        generator = scenarios.generators(at)["seismological"]
        assert set(scenarios.rows(at, "seismological", scenarios.compared(generator, at))) <= set(ROWS)
