"""Scores held to hand calculations, to brute force, and to simulation: a model that is right scores as it should."""

import math

import numpy as np
import pytest
from scipy.stats import binom

from toppling.benchmarks.experiments.scores import best_threshold, brier

TABLES = 100


def within(hits, share=0.95):
    """Whether a number of hits among the tables is one that a share of 95 % gives with a probability of 99.9 %."""
    low, high = binom.ppf([0.0005, 0.9995], TABLES, share)
    return low <= hits <= high


class TestByHand:
    def test_brier(self):
        """Trials 1, 0 at 0.8 and 0 at 0.1: (0.04 + 0.64 + 0.01)/3; a share of 1/3 gives 2/9."""
        found = brier(np.array([0.8, 0.1]), np.array([2, 1]), np.array([1, 0]))
        assert found.score == pytest.approx(0.23)
        assert found.reference == pytest.approx(2.0 / 9.0)
        assert found.skill == pytest.approx(1.0 - 0.23 * 4.5)
        assert (found.rows, found.trials) == (2, 3)
        assert math.isnan(brier(np.array([0.8]), np.array([2]), np.array([2])).skill)

    def test_best_threshold_by_brute_force(self):
        random = np.random.default_rng(1)
        for _ in range(50):
            measure = random.integers(0, 8, 20).astype(float)
            flags = random.random(20) < measure / 10.0
            found = best_threshold(measure, flags)
            tried = [((measure >= one) == flags).mean() for one in [*measure, math.inf]]
            assert found[1] == pytest.approx(max(tried))
        assert best_threshold(np.array([1.0, np.nan, 3.0]), np.array([False, True, True])) == (3.0, 1.0)


class TestBySimulation:
    """Synthetic tables whose outcomes are drawn from the predictions themselves."""

    def tables(self, seed, bias=1.0):
        random = np.random.default_rng(seed)
        for _ in range(TABLES):
            p = random.beta(0.6, 0.6, 30)
            n = random.integers(1, 60, 30)
            yield p, n, random.binomial(n, p**bias)

    @pytest.mark.slow
    def test_brier_of_a_model_that_is_right(self):
        found = [brier(*table) for table in self.tables(1)]
        assert within(sum(one.right_low <= one.score <= one.right_high for one in found))
        assert all(one.skill > 0.0 for one in found)

    @pytest.mark.slow
    def test_brier_of_a_model_that_is_wrong(self):
        found = [brier(*table) for table in self.tables(2, bias=3.0)]
        assert sum(one.right_low <= one.score <= one.right_high for one in found) < 0.5 * TABLES
