"""Both analyses of a better measure are run, and compared as their page says."""

import pytest

import toppling as tp
from toppling.benchmarks.sequential.measures import OTHERS, savings


@pytest.mark.slow
def test_savings_are_of_both_analyses():
    shakes = tp.motions.CloughPenzien(duration=8.0, dt=0.02)
    found = list(savings(shakes, 0.2))
    assert [other for other, *_ in found] == list(OTHERS)
    for other, _, taken, by_both, (middle, low, high) in found:
        own = tp.adaptive_ida(tp.Block(0.4, 1.8), tp.EnergyConsistent(), shakes, other, until={"median": 0.2})
        assert taken == int(own["motions_run"].item())
        assert low < middle < high
        assert by_both == pytest.approx(middle, rel=1.0)
