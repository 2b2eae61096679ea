"""Both analyses of a better measure are run, and compared as their page says."""

import pytest

import toppling as tp
from toppling.benchmarks.sequential.measures import OTHERS, savings


@pytest.mark.slow
def test_savings_are_of_both_analyses():
    shakes = tp.motions.CloughPenzien(duration=8.0, dt=0.02)
    found = list(savings(shakes, 0.2))
    assert [one.other for one in found] == list(OTHERS)
    for one in found:
        own = tp.ida(tp.Block(0.4, 1.8), tp.EnergyConsistent(), shakes, "adaptive", one.other, until={"median": 0.2})
        assert one.motions[1] == int(own["motions_run"].item())
        middle, low, high = one.measured
        assert low < middle < high
        assert one.found == pytest.approx(middle, rel=1.0)
