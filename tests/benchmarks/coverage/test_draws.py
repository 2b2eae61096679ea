"""Values from draws of pieces, against closed forms given the motions."""

import numpy as np
import pytest

from toppling.benchmarks.coverage.draws import (
    drawn_above,
    flags_of,
    inventory,
    number_at_least,
    rows,
    studied,
)


def test_numbers_given_the_motions_by_brute_force():
    """Two lines of one and two pieces, whose variants are all that can be drawn."""
    flags = flags_of(3, 1)
    flags[:, 2:] = False
    one, two = flags[0, 0, :, 0].mean(axis=0), flags[0, 1, :, 0].mean(axis=0)
    together = number_at_least(flags, "together")[:3]
    np.testing.assert_allclose(together[0], np.mean(1 - (1 - one) * (1 - two)))
    np.testing.assert_allclose(together[2], np.mean(one * two))
    independent = number_at_least(flags, "independent")[:3]
    np.testing.assert_allclose(independent[0], np.mean(1 - (1 - one) * (1 - two) ** 2))
    np.testing.assert_allclose(independent[2], np.mean(one * two**2))
    np.testing.assert_allclose(drawn_above(flags, 1.0), independent[0])


@pytest.mark.parametrize("pieces", ["together", "independent"])
def test_an_event_has_one_probability(pieces):
    """The share of realisations with any fall, and the probability of any fall: one event, over 400 seeds."""
    flags = flags_of(60, 60)
    found = [studied(inventory(False), flags, pieces, 20, seed) for seed in range(400)]
    share, error = (
        np.array([one[name].values.ravel()[0] for one in found])
        for name in ("number_exceedance", "number_exceedance_sampling_error")
    )
    (chance,) = {float(one["any_probability"].values.item()) for one in found}
    assert chance == pytest.approx(number_at_least(flags, pieces)[0], rel=1e-12)
    assert abs(share.mean() - chance) < 3.0 * share.std() / np.sqrt(400.0)
    assert error.mean() == pytest.approx(share.std(), rel=0.1)
    assert (np.abs(share - chance) < 1.96 * error).mean() == pytest.approx(0.95, abs=0.03)


def test_rows_hold(monkeypatch):
    monkeypatch.setattr("toppling.benchmarks.coverage.draws.SEEDS", 60)
    found = list(rows(False))
    assert {one.interval.partition("_")[0] for one in found} == {"number", "loss", "injuries", "downtime"}
    assert min(one.coverage for one in found) > 0.85
