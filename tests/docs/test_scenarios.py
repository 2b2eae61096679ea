"""The page of simulated earthquakes beside a ground-motion model is of today."""

import importlib.util
from pathlib import Path

import pytest

DOCS = Path(__file__).resolve().parents[2] / "docs"
TEXT = (DOCS / "scenarios.md").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def scenarios():
    specification = importlib.util.spec_from_file_location("scenarios", DOCS / "scenarios.py")
    module = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(module)
    return module


def test_its_text_is_that_of_the_source(scenarios):
    source = (DOCS / "scenarios.md.in").read_text(encoding="utf-8")
    assert TEXT.startswith(source.format(number=scenarios.NUMBER, seed=scenarios.SEED))
    assert all(
        f"## M {at.magnitude:g}, {1e-3 * at.distance:g} km, {at.vs30:g} m/s\n" in TEXT for at in scenarios.SCENARIOS
    )


@pytest.mark.slow
def test_its_figures_are_computed_again(scenarios):
    """Those of the quickest generator, for every scenario."""
    for at in scenarios.SCENARIOS:
        generator = scenarios.generators(at)["seismological"]
        assert scenarios.rows("seismological", scenarios.compared(generator, at)) in TEXT
