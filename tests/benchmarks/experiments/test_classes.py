"""Bias and spread of a class: found again where they were put in, with intervals that hold them as they say."""

import math

import numpy as np
import pytest
from scipy.stats import binom, norm

from toppling.benchmarks.experiments import classes
from toppling.benchmarks.experiments.classes import LEAST_CLUSTERS, Evidence, class_fit, too_few
from toppling.benchmarks.experiments.scores import clustered_interval
from toppling.benchmarks.experiments.table import PIECES
from toppling.studies.plan.piece_classes import NAMES, piece_classes

TABLES = 200


def within(hits, share=0.95):
    low, high = binom.ppf([0.0005, 0.9995], TABLES, share)
    return low <= hits <= high


def drawn_tests(random, bias, beta, clusters=50, each=10, common=0.0):
    """Tests of single capacities whose true ones are off by a bias, a spread, and a part common to a cluster."""
    found = []
    for i in range(clusters):
        shared = common * random.standard_normal()
        for _ in range(each):
            log = random.normal(0.0, 0.7)
            falls = log + bias + shared + math.sqrt(beta**2 - common**2) * random.standard_normal() < 0.0
            found.append(Evidence(f"r{i}", 1, int(falls), np.array([log])))
    return found


class TestClassFit:
    @pytest.mark.slow
    def test_it_finds_what_was_put_in(self):
        found = class_fit(drawn_tests(np.random.default_rng(1), -0.5, 0.3, 200, 20), 1)
        assert found.ratio == pytest.approx(math.exp(-0.5), rel=0.05)
        assert found.beta == pytest.approx(0.3, rel=0.12)
        assert found.ratio_lower < found.ratio < found.ratio_upper
        assert found.beta_m == pytest.approx(math.hypot(math.log(found.ratio), found.beta))
        assert (found.tests, found.clusters, found.sources) == (4000, 200, 1)

    def test_likelihood_by_brute_force(self):
        """Of all values of bias and beta, none makes the outcomes likelier."""
        evidence = drawn_tests(np.random.default_rng(2), 0.2, 0.4, LEAST_CLUSTERS, 3)
        found = class_fit(evidence, 2)

        def likelihood(bias, beta):
            total = 0.0
            for one in evidence:
                p = float(norm.cdf(-(one.logs + bias) / beta).mean())
                total += math.log(max(p if one.overturned else 1.0 - p, 1e-300))
            return total

        best = likelihood(math.log(found.ratio), found.beta)
        for bias in np.arange(-0.4, 0.8, 0.1):
            for beta in (0.1, 0.2, 0.3, 0.4, 0.5, 0.7):
                assert likelihood(bias, beta) <= best + 0.02

    def test_cases_of_a_test_share_its_outcome(self):
        """Two cases, of which one always falls and one never: half of the trials fall whatever the spread."""
        evidence = [Evidence(f"r{i}", 2, 1, np.array([-9.0, math.inf])) for i in range(LEAST_CLUSTERS)]
        assert class_fit(evidence, 1).enough

    def test_what_slides_does_not_fall(self):
        logs = np.array([-9.0])
        plain, sliding = (
            class_fit([Evidence(f"r{i}", 4, 2, logs, slides) for i in range(LEAST_CLUSTERS)], 1)
            for slides in (0.0, 0.5)
        )
        assert plain.beta > sliding.beta

    def test_few_tests_have_no_estimate(self):
        found = class_fit(drawn_tests(np.random.default_rng(3), 0.0, 0.3, LEAST_CLUSTERS - 1), 4)
        assert not found.enough
        assert math.isnan(found.beta_m)
        assert repr(found) == repr(too_few(10 * (LEAST_CLUSTERS - 1), LEAST_CLUSTERS - 1, 4))

    @pytest.mark.slow
    def test_intervals_hold_the_truth_where_tests_of_a_record_depend_on_each_other(self, monkeypatch):
        """200 synthetic classes: a bias of zero lies within its interval in about 95 % of them."""
        monkeypatch.setattr(classes, "RESAMPLES", 200)
        monkeypatch.setattr(classes, "BIASES", np.arange(-0.5, 0.501, 0.04))
        monkeypatch.setattr(classes, "BETAS", np.geomspace(0.2, 0.8, 10))
        random, hits = np.random.default_rng(4), 0
        for _ in range(TABLES):
            found = class_fit(drawn_tests(random, 0.0, 0.4, 40, 4, common=0.35), 1)
            hits += found.ratio_lower <= 1.0 <= found.ratio_upper
        assert within(hits) or hits > 0.93 * TABLES  # (a grid of 2 % makes intervals a little wider)


class TestClusteredInterval:
    @pytest.mark.parametrize("clustered", [True, False])
    def test_coverage_with_dependent_trials(self, clustered):
        """Shares of clusters vary: over clusters the interval holds the mean share, over single trials it does not."""
        random, hits = np.random.default_rng(5), 0
        for _ in range(TABLES):
            shares = random.beta(1.2, 1.8, 40)
            trials = random.integers(2, 12, 40).astype(float)
            fell = random.binomial(trials.astype(int), shares).astype(float)
            low, high = clustered_interval(trials, fell, np.arange(40) if clustered else None)
            hits += low <= 0.4 <= high
        assert hits > 0.9 * TABLES if clustered else hits < 0.85 * TABLES

    def test_independent_trials_and_equal_outcomes(self):
        ones, names = np.ones(60), np.arange(60)
        fell = (names % 3 == 0).astype(float)
        plain, clustered = clustered_interval(ones, fell), clustered_interval(ones, fell, names)
        assert clustered == pytest.approx(plain, rel=0.02)
        assert clustered_interval(ones, ones, names // 20)[0] == pytest.approx(
            clustered_interval(ones[:3], ones[:3])[0]
        )


class TestTable:
    def test_names_are_classes_of_the_table_of_tests(self):
        assert set(NAMES.values()) <= set(PIECES)
        assert set(piece_classes()) == set(NAMES)
