"""The promise table: truths against their definitions, and small tables of both ways."""

import math

import numpy as np
import pytest
from check_facts import numbers_in

from toppling.benchmarks.sequential.promises import common_levels, promises, rows_of_text, sequential
from toppling.benchmarks.sequential.truths import MEDIAN, TRUTHS
from toppling.fragility.adaptive.until import Until


@pytest.mark.parametrize("truth", TRUTHS, ids=lambda one: one.name)
def test_verdicts_have_the_probability_and_the_correlation(truth):
    levels = np.full((2, 40_000), MEDIAN)
    fell = truth.verdicts(levels, np.random.default_rng(0))
    p = float(truth.probability(np.array(math.log(MEDIAN))))
    assert fell.mean() == pytest.approx(p, abs=0.01)
    both = float(np.corrcoef(fell[0], fell[1])[0, 1])
    if p == pytest.approx(0.5):
        # tetrachoric correlation of two halves
        assert both == pytest.approx(2.0 / math.pi * math.asin(truth.correlation), abs=0.02)
    assert float(truth.probability(np.array(truth.log_median))) == pytest.approx(0.5, abs=1e-9)


def test_the_rate_of_a_lognormal_curve_is_its_closed_form():
    assert TRUTHS[0].rate(2.5) == pytest.approx(MEDIAN**-2.5 * math.exp(0.5 * 2.5**2 * 0.16), rel=1e-6)


def test_adaptive_levels_take_a_third_of_the_runs_of_common_ones():
    until = Until("median", 0.1, most=5000)
    own, common = (
        np.mean([way(TRUTHS[1], until, seed).runs for seed in range(6)]) for way in (sequential, common_levels)
    )
    assert own < common / 3.0


def test_common_levels_near_the_median_know_no_form():
    """Of a mixture the curve through all levels has another median; those near it have less of that error."""
    truth = next(one for one in TRUTHS if one.name.startswith("mixture"))
    until = Until("median", 0.05, most=200_000)
    seeds, both = range(6), (False, True)
    whole, near = (np.mean([common_levels(truth, until, one, None, fit).error for one in seeds]) for fit in both)
    assert near < whole


def test_tables():
    rows = promises("median", 0.2, 4, TRUTHS[:2], processes=1)
    assert [one.truth for one in rows] == [one.name for one in TRUTHS[:2]]
    assert all(one.reached == 1.0 and one.kept >= 0.75 for one in rows)
    assert "±20%" in rows_of_text("median ±20%", rows)


@pytest.mark.slow
def test_a_database_keeps_the_promise(monkeypatch):
    """A small database: its median halves its own outcomes, and sequential analyses find it."""
    from toppling.benchmarks.sequential import databases
    from toppling.motions import CloughPenzien

    name = "few"
    monkeypatch.setitem(databases.DATABASES, name, (CloughPenzien(duration=8.0, dt=0.02), 400))
    one = databases.database(name)
    random = np.random.default_rng(1)
    near = np.exp(one.log_median + 0.02 * (2.0 * random.random((50, 400)) - 1.0))
    assert one.fell(near, np.arange(400)).mean() == pytest.approx(0.5, abs=0.01)
    kept = [databases.outcome(name, databases.Analysis(0.1), seed)[0].kept for seed in range(20)]
    assert sum(kept) >= 18
    # (common levels that ask for more take more motions; of their runs half end at once)
    rough, fine = (databases.Analysis(0.1, asked=asked) for asked in (0.1, 0.05))
    (loose, little), (tight, much) = (databases.outcome(name, way, 1) for way in (rough, fine))
    assert loose.motions < tight.motions
    three, two = (databases.outcome(name, databases.Analysis(0.1, runs), 1)[0] for runs in (3, 2))
    assert 2.0 <= two.runs / two.motions < three.runs / three.motions
    found, spent = databases.outcome(name, databases.Analysis(0.1), 1)
    assert spent[1] / found.runs > little[1] / loose.runs  # (seconds, samples and events)
    assert 0.0 < little[2] < much[2] < much[1]
    row, mean = databases.promises_kept(name, fine, 2, processes=1)
    assert f"±5%    {row.kept:5.3f}" in databases.line(fine, row, mean)
    common, near, _ = databases.cost(name)
    assert near > common > 0.0


def test_analyses_that_are_compared():
    from toppling.benchmarks.sequential import databases

    for name in databases.DATABASES:
        ways = databases.analyses(name)
        labels = [one.label for one in ways if one.tolerance == databases.MIDDLE]
        asks = f"20 common levels, ask ±{100.0 * databases.AS_OFTEN[name]:g}%"
        common = ["20 common levels", asks, "20 common levels, local fit"]
        assert [numbers_in(label)[0] for label in labels[:2]] == [3, 2]
        assert labels[2:] == common
        assert [one.tolerance for one in ways] == sorted((one.tolerance for one in ways), reverse=True)


def test_errors_are_those_over_what_is_promised():
    rows = promises("median", 0.2, 8, TRUTHS[1:2], processes=1)
    until = Until("median", 0.2, most=200_000)
    errors = [sequential(TRUTHS[1], until, seed).error for seed in range(8)]
    assert rows[0].within == pytest.approx(float(np.quantile(errors, 0.95)))
    assert 0.0 < rows[0].within <= 1.0
