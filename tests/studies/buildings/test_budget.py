"""Sets of lines for a sum of money: held to all 2^12 sets, and to what has to come first."""

import itertools

import numpy as np
import pytest

from toppling.studies.buildings.budget import best_set


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
