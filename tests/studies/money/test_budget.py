"""Sets of lines for a sum of money: held to all 2^12 sets, and to what has to come first."""

import itertools

import numpy as np
import pytest

from toppling.studies.money.budget import best_set, cheapest_set


def one_of_each(sizes):
    """All combinations of at most one option of each group, as rows of 0 and 1 over all options."""
    ends = np.cumsum([0, *sizes])
    every = []
    for picks in itertools.product(*(range(-1, size) for size in sizes)):
        row = np.zeros(ends[-1], int)
        row[[first + pick for first, pick in zip(ends[:-1], picks, strict=True) if pick >= 0]] = 1
        every.append(row)
    return np.array(every), np.repeat(np.arange(len(sizes)), sizes)


def goals_of(rng, groups):
    """Safety of half of the groups, and money of the others."""
    safety = rng.lognormal(-6.0, 2.0, groups.size) * (rng.random(groups.max() + 1) < 0.5)[groups]
    return safety, rng.lognormal(3.0, 2.0, groups.size) * (safety == 0.0)


class TestBestSet:
    @pytest.mark.parametrize("seed", range(40))
    @pytest.mark.parametrize("most", [1, 3])
    def test_no_other_set_for_the_budget_is_better(self, most, seed):
        """Of 12 lines, and of up to three kits for each of 6 pieces, of which each may have one."""
        rng = np.random.default_rng(seed)
        sets, groups = one_of_each([1] * 12 if most == 1 else rng.integers(1, most + 1, 6))
        costs = rng.integers(0, 60, groups.size) * 10.0
        budget = float(costs.sum() * rng.uniform(0.1, 0.9))
        goals = goals_of(rng, groups)
        found = best_set(costs, budget, goals, None if most == 1 else groups)
        assert np.bincount(groups[found.chosen]).max(initial=0) <= 1
        assert costs[found.chosen].sum() <= budget
        assert found.gaps == (0.0, 0.0)
        left = sets[sets @ costs <= budget * (1.0 + 1e-12)]
        for goal in goals:
            reached = left @ goal
            left = left[reached >= reached.max() * (1.0 - 1e-12)]
            np.testing.assert_allclose(goal[found.chosen].sum(), reached.max(), rtol=1e-9)

    @pytest.mark.parametrize(
        ("costs", "budget", "goals", "chosen"),
        [
            # (the best for its price is one of 6 for 10; two of 5 for 6 are better together)
            ([6.0, 5.0, 5.0], 10.0, [[10.0, 6.0, 6.0]], [1, 2]),
            # safety is never behind money, and a small gain is not sold
            ([100.0, 100.0], 100.0, [[1e-9, 0.0], [0.0, 1e9]], [0]),
            ([5.0, 5.0, 5.0], 10.0, [[1.0, 5e-7, 0.0], [0.0, 0.0, 1.0]], [0, 1]),
            # unknown costs and useless lines are left
            ([np.nan, 1.0, 1.0, 0.0], 10.0, [[5.0, 0.0, 1.0, 2.0]], [2, 3]),
            # two lines that cost 1 more than there is, and what is required is the one that stays
            ([2_500_001.0, 2_500_001.0], 5e6, [[1.0, 0.0], [0.0, 1.0]], [0]),
            ([10.0, 1.0], 10.0, [[1.0, 0.0], [0.0, 1.0]], [0]),
            ([11.0, 12.0], 10.0, [[1.0, 2.0]], []),
        ],
    )
    def test_by_hand(self, costs, budget, goals, chosen):
        found = best_set(np.array(costs), budget, [np.array(goal) for goal in goals])
        assert np.flatnonzero(found.chosen).tolist() == chosen
        assert found.gaps == (0.0,) * len(goals)

    def test_a_long_list(self):
        """2,000 lines: the bound that is said, and that of the relaxed problem, are at most 1e-4 away."""
        rng = np.random.default_rng(1)
        costs = rng.integers(1, 500, 2000).astype(float)
        gain = costs * rng.lognormal(0.0, 0.3, 2000)
        found = best_set(costs, 50_000.0, [gain])
        assert costs[found.chosen].sum() <= 50_000.0
        assert found.gaps[0] <= 1e-4
        order = np.argsort(-gain / costs)
        part = np.cumsum(costs[order])
        relaxed = np.interp(50_000.0, part, np.cumsum(gain[order]))
        assert relaxed * (1.0 - 1e-4) <= gain[found.chosen].sum() <= relaxed * (1.0 + 1e-9)


class TestCheapestSet:
    """At most one kit for each piece: held to all combinations."""

    @pytest.mark.parametrize("seed", range(40))
    def test_no_cheaper_set_is_enough(self, seed):
        rng = np.random.default_rng(100 + seed)
        sets, groups = one_of_each(rng.integers(1, 4, 6))
        costs = rng.integers(0, 30, groups.size) * 10.0
        gains = [rng.lognormal(-6.0, 1.0, groups.size) * rng.choice([1.0, 1.0, -0.3], groups.size) for _ in range(2)]
        needs = [(gain, float((sets @ gain).max()) * rng.uniform(0.1, 0.8)) for gain in gains]
        enough = np.all([sets @ gain >= need for gain, need in needs], axis=0)
        found = cheapest_set(costs, needs, groups)
        assert found.gap == 0.0
        if not enough.any():
            assert found.chosen is None
            return
        assert np.bincount(groups[found.chosen]).max(initial=0) <= 1
        assert costs[found.chosen].sum() == (sets @ costs)[enough].min()
        assert all(gain[found.chosen].sum() >= need - 1e-9 * np.abs(gain).sum() for gain, need in needs)

    def test_nothing_needed_and_out_of_reach(self):
        assert not cheapest_set(np.array([1.0]), [(np.array([1.0]), 0.0)], np.array([0])).chosen.any()
        for cost, need in ((5.0, 2.5), (np.nan, 1.5)):
            needs = [(np.array([1.0, 2.0]), need)]
            assert cheapest_set(np.array([1.0, cost]), needs, np.array([0, 0])) == (None, 0.0)

    @pytest.mark.slow
    def test_a_long_list(self):
        """400 pieces with two kits each: enough, and hardly dearer than the relaxed problem allows."""
        rng = np.random.default_rng(1)
        costs = rng.integers(10, 500, 800).astype(float)
        saves = costs * rng.lognormal(0.0, 0.3, 800)
        found = cheapest_set(costs, [(saves, 0.3 * saves.sum())], np.repeat(np.arange(400), 2))
        assert saves[found.chosen].sum() >= 0.3 * saves.sum() * (1.0 - 1e-9)
        assert found.gap <= 1e-3


def test_refused(refusal):
    refusal()
