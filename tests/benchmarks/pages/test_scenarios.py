"""The page of simulated earthquakes beside a ground-motion model is of today."""

from pathlib import Path

import pytest

from toppling.benchmarks.pages import scenarios
from toppling.benchmarks.pages.page import template
from toppling.benchmarks.pages.tables import body

DOCS = Path(__file__).resolve().parents[3] / "docs"
TEXT = (DOCS / "scenarios.md").read_text(encoding="utf-8")


def test_its_text_is_that_of_the_source():
    assert TEXT.startswith(template("scenarios").format(number=scenarios.NUMBER, seed=scenarios.SEED))
    assert all(scenarios.head(at) in TEXT for at in scenarios.SCENARIOS)


@pytest.mark.slow
def test_its_figures_are_computed_again():
    """Those of the quickest generator, for every scenario."""
    for at in scenarios.SCENARIOS:
        generator = scenarios.generators(at)["seismological"]
        assert body(scenarios.rows("seismological", scenarios.compared(generator, at))) in TEXT
