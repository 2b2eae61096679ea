"""Sets of lines for a sum of money: held to all 2^12 sets, and to what has to come first."""

import itertools

import numpy as np
import pytest

from toppling.studies.money.budget import best_set, cheapest_set


def every_set(costs, budget, goals):
    """The best of all sets, goal after goal, by trying each."""
    sets = np.array(list(itertools.product([0, 1], repeat=costs.size)))
    sets = sets[sets @ np.nan_to_num(costs, nan=2.0 * budget) <= budget * (1.0 + 1e-12)]
    for goal in goals:
        reached = sets @ goal
        sets = sets[reached >= reached.max() * (1.0 - 1e-12)]
    return [float(sets[0] @ goal) for goal in goals]


class TestBestSet:
    @pytest.mark.parametrize("seed", range(40))
    def test_no_other_set_is_better(self, seed):
        rng = np.random.default_rng(seed)
        costs = rng.integers(1, 60, 12) * 10.0
        budget = float(costs.sum() * rng.uniform(0.1, 0.9))
        safety = rng.lognormal(-6.0, 2.0, 12) * (rng.random(12) < 0.5)
        money = rng.lognormal(3.0, 2.0, 12) * (safety == 0.0)
        found = best_set(costs, budget, [safety, money])
        assert costs[found.chosen].sum() <= budget
        assert found.gaps == (0.0, 0.0)
        reached = [float(goal[found.chosen].sum()) for goal in (safety, money)]
        np.testing.assert_allclose(reached, every_set(costs, budget, [safety, money]), rtol=1e-9)

    def test_greed_fails_where_this_does_not(self):
        """The best for its price is one of 6 for 10; two of 5 for 6 are better together."""
        found = best_set(np.array([6.0, 5.0, 5.0]), 10.0, [np.array([10.0, 6.0, 6.0])])
        assert found.chosen.tolist() == [False, True, True]

    @pytest.mark.parametrize(
        ("costs", "budget", "goal", "message"),
        [
            ([1.0, 2.0], -1.0, [1.0, 1.0], "budget must be finite and >= 0, got -1"),
            ([1.0, 2.0], np.nan, [1.0, 1.0], "budget must be finite and >= 0, got nan"),
            ([1.0, 2.0], 5.0, [1.0], r"goals must have a value for each of the costs, \(2,\), got \(1,\)"),
            ([1.0, -2.0], 5.0, [1.0, 1.0], "costs must be >= 0, got -2"),
            ([1.0, 2.0], 5.0, [1.0, np.inf], "goals must be finite and >= 0"),
        ],
    )
    def test_refuses(self, costs, budget, goal, message):
        with pytest.raises(ValueError, match=message):
            best_set(np.array(costs), budget, [np.array(goal)])

    def test_safety_is_never_behind_money(self):
        found = best_set(np.array([100.0, 100.0]), 100.0, [np.array([1e-9, 0.0]), np.array([0.0, 1e9])])
        assert found.chosen.tolist() == [True, False]

    def test_unknown_costs_and_useless_lines_are_left(self):
        found = best_set(np.array([np.nan, 1.0, 1.0, 0.0]), 10.0, [np.array([5.0, 0.0, 1.0, 2.0])])
        assert found.chosen.tolist() == [False, False, True, True]

    def test_a_budget_is_not_overspent_by_a_cent(self):
        """Two lines that cost 1 more than there is, and what is required is the one that stays."""
        found = best_set(np.array([2_500_001.0, 2_500_001.0]), 5e6, [np.array([1.0, 0.0]), np.array([0.0, 1.0])])
        assert found.chosen.tolist() == [True, False]

    def test_a_small_gain_is_not_sold(self):
        """Half a millionth of the first goal stands before all of the second."""
        first, second = np.array([1.0, 5e-7, 0.0]), np.array([0.0, 0.0, 1.0])
        found = best_set(np.array([5.0, 5.0, 5.0]), 10.0, [first, second])
        assert found.chosen.tolist() == [True, True, False]

    def test_the_first_goal_may_use_all(self):
        found = best_set(np.array([10.0, 1.0]), 10.0, [np.array([1.0, 0.0]), np.array([0.0, 1.0])])
        assert found.chosen.tolist() == [True, False]
        assert found.gaps == (0.0, 0.0)

    def test_nothing_affordable(self):
        found = best_set(np.array([11.0, 12.0]), 10.0, [np.array([1.0, 2.0])])
        assert not found.chosen.any()
        assert found.gaps == (0.0,)

    def test_a_long_list(self):
        """2,000 lines: within the budget, and the bound that is said is at most 1e-4 of what is reached."""
        rng = np.random.default_rng(1)
        costs = rng.integers(1, 500, 2000).astype(float)
        gain = costs * rng.lognormal(0.0, 0.3, 2000)
        found = best_set(costs, 50_000.0, [gain])
        assert costs[found.chosen].sum() <= 50_000.0
        assert found.gaps[0] <= 1e-4
        order = np.argsort(-gain / costs)
        part = np.cumsum(costs[order])
        whole = part <= 50_000.0
        first = int(whole.sum())
        relaxed = gain[order][:first].sum() + gain[order][first] * (50_000.0 - part[first - 1]) / costs[order][first]
        assert gain[found.chosen].sum() <= relaxed * (1.0 + 1e-9)
        assert gain[found.chosen].sum() >= relaxed * (1.0 - 1e-4)


def one_of_each(sizes):
    """All combinations of at most one option of each group, as rows of 0 and 1 over all options."""
    ends = np.cumsum([0, *sizes])
    every = []
    for picks in itertools.product(*(range(-1, size) for size in sizes)):
        row = np.zeros(ends[-1], int)
        row[[first + pick for first, pick in zip(ends[:-1], picks, strict=True) if pick >= 0]] = 1
        every.append(row)
    return np.array(every), np.repeat(np.arange(len(sizes)), sizes)


class TestKits:
    """At most one kit for each piece: held to all combinations."""

    @pytest.mark.parametrize("seed", range(40))
    def test_no_other_set_for_the_budget_is_better(self, seed):
        rng = np.random.default_rng(seed)
        sets, groups = one_of_each(rng.integers(1, 4, 6))
        costs = rng.integers(0, 30, groups.size) * 10.0
        budget = float(costs.sum() * rng.uniform(0.1, 0.7))
        safety = rng.lognormal(-6.0, 2.0, groups.size) * (rng.random(6) < 0.5)[groups]
        money = rng.lognormal(3.0, 2.0, groups.size) * (safety == 0.0)
        found = best_set(costs, budget, [safety, money], groups)
        assert np.bincount(groups[found.chosen]).max(initial=0) <= 1
        assert costs[found.chosen].sum() <= budget
        assert found.gaps == (0.0, 0.0)
        left = sets[sets @ costs <= budget * (1.0 + 1e-12)]
        for goal in (safety, money):
            reached = left @ goal
            left = left[reached >= reached.max() * (1.0 - 1e-12)]
            np.testing.assert_allclose(goal[found.chosen].sum(), reached.max(), rtol=1e-9)

    @pytest.mark.parametrize("seed", range(40))
    def test_no_cheaper_set_is_enough(self, seed):
        """Two targets together; kits may make a piece worse."""
        rng = np.random.default_rng(100 + seed)
        sets, groups = one_of_each(rng.integers(1, 4, 6))
        costs = rng.integers(0, 30, groups.size) * 10.0
        gains = [rng.lognormal(-6.0, 1.0, groups.size) * rng.choice([1.0, 1.0, -0.3], groups.size) for _ in range(2)]
        best = [float((sets @ gain).max()) for gain in gains]
        needs = [(gain, most * rng.uniform(0.1, 0.8)) for gain, most in zip(gains, best, strict=True)]
        enough = np.all([sets @ gain >= need for gain, need in needs], axis=0)
        found = cheapest_set(costs, needs, groups)
        assert found.gap == 0.0
        if not enough.any():
            assert found.chosen is None
            return
        assert np.bincount(groups[found.chosen]).max(initial=0) <= 1
        assert costs[found.chosen].sum() == (sets @ costs)[enough].min()
        assert all(gain[found.chosen].sum() >= need - 1e-9 * np.abs(gain).sum() for gain, need in needs)

    def test_nothing_needed_nothing_chosen(self):
        assert not cheapest_set(np.array([1.0]), [(np.array([1.0]), 0.0)], np.array([0])).chosen.any()

    def test_out_of_reach(self):
        saves = np.array([1.0, 2.0])
        assert cheapest_set(np.array([1.0, 5.0]), [(saves, 2.5)], np.array([0, 0])) == (None, 0.0)
        assert cheapest_set(np.array([1.0, np.nan]), [(saves, 1.5)], np.array([0, 0])) == (None, 0.0)

    @pytest.mark.parametrize(
        ("costs", "need", "message"),
        [([-1.0], 1.0, "costs must be >= 0, got -1"), ([1.0], np.inf, "what is needed of them must be finite")],
    )
    def test_refuses(self, costs, need, message):
        with pytest.raises(ValueError, match=message):
            cheapest_set(np.array(costs), [(np.array([1.0]), need)], np.array([0]))

    @pytest.mark.slow
    def test_a_long_list(self):
        """400 pieces with two kits each: enough, and hardly dearer than the relaxed problem allows."""
        rng = np.random.default_rng(1)
        groups = np.repeat(np.arange(400), 2)
        costs = rng.integers(10, 500, 800).astype(float)
        saves = costs * rng.lognormal(0.0, 0.3, 800)
        need = 0.3 * saves.sum()
        found = cheapest_set(costs, [(saves, need)], groups)
        assert saves[found.chosen].sum() >= need * (1.0 - 1e-9)
        assert found.gap <= 1e-3
