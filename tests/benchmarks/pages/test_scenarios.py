"""The page of simulated earthquakes and a ground-motion model is of today."""

import pytest
from page_tables import page, rows_beside

from toppling.benchmarks.pages import scenarios

ROWS = [tuple(row) for row in rows_beside("scenarios", "ratios")]


def test_the_page_is_of_its_file():
    assert scenarios.page(ROWS) == page("scenarios")


@pytest.mark.slow
def test_its_numbers_are_computed_again():
    """Those of the quickest generator, for every scenario."""
    for at in scenarios.SCENARIOS:
        generator = scenarios.generators(at)["seismological"]
        assert set(scenarios.rows(at, "seismological", scenarios.compared(generator, at))) <= set(ROWS)
