"""What joint shaking rests on: hazards as weights of levels, resampled means, sums over items, pieces that differ."""

import math
from dataclasses import replace

import mpmath
import numpy as np
import pytest
from scipy import stats
from scipy.interpolate import CubicHermiteSpline
from scipy.special import ndtr
from shared_cases import lifts_at

import toppling as tp
from toppling.core.units import STANDARD_GRAVITY
from toppling.fragility.curves.means import mean_interval, quantiles, resampled_means, sampling_error, share_error
from toppling.fragility.hazard.level_weights import level_weights, line_weights
from toppling.fragility.numerics.totals import (
    chances,
    chances_of_any,
    chances_of_none,
    exceedances,
    expected_totals,
    fallen_pieces,
)
from toppling.fragility.uncertainty.joint import Variability, drawn_pieces, oscillators_of_pieces, with_restitution

SHELF = tp.catalogue["bookcase-5-shelf"]


def hazard(levels, rates):
    return tp.HazardCurve(levels, rates, "pga")


def power_law(k0=1e-4, k=2.5, ends=(1e-3, 50.0)):
    return hazard(ends, k0 * np.array(ends) ** -k)


BROKEN = hazard([0.05, 0.12, 0.4, 0.9, 2.0], [0.2, 0.09, 0.008, 0.0011, 2e-5])


def integral(value, points, levels, rates):
    """The integral of value(ln x) |d lambda| between the points, in 30 digits: every part is smooth."""
    with mpmath.workdps(30):
        u = [mpmath.log(x) for x in levels]
        v = [mpmath.log(r) for r in rates]
        total = mpmath.mpf(0)
        for a, b, p, q in zip(u[:-1], u[1:], v[:-1], v[1:], strict=True):
            slope = (p - q) / (b - a)
            edges = sorted({a, b, *(mpmath.log(x) for x in points if a < mpmath.log(x) < b)})
            inside = [e for e in edges if mpmath.log(points[0]) <= e <= mpmath.log(points[-1])]
            for left, right in zip(inside[:-1], inside[1:], strict=True):
                total += mpmath.quad(
                    lambda t, a=a, p=p, slope=slope: value(t) * slope * mpmath.exp(p - slope * (t - a)), [left, right]
                )
        return total


class TestLevelWeights:
    def test_lognormal_curve_under_a_power_law(self):
        """k0 theta^-k exp(k² beta²/2) = 5.912472244407e-4; the error falls with the fourth power of the step."""
        errors = []
        for n in (40, 80, 160, 320):
            levels = np.geomspace(0.03, 8.0, n)
            rate = level_weights(levels, power_law()).weights @ ndtr(np.log(levels / 0.6) / 0.4)
            errors.append(abs(rate / 5.912472244407e-4 - 1.0))
        assert errors[0] < 3e-4
        np.testing.assert_allclose(np.divide(errors[:-1], errors[1:]), 16.0, rtol=0.2)

    def test_piecewise_hazard_against_quadrature(self):
        """Weights of one value after the other, by scipy's cubics with numpy's slopes, integrated in 30 digits."""
        levels = np.array([0.08, 0.12, 0.2, 0.3, 0.5, 0.75, 1.1, 1.7])
        found = level_weights(levels, BROKEN)
        u = np.log(levels)
        above = 0.0011 * (1.7 / 0.9) ** (np.log(2e-5 / 0.0011) / np.log(2.0 / 0.9))
        assert found.above == pytest.approx(above, rel=1e-13)
        for j, values in enumerate(np.eye(8)):
            around = np.array([*u, 2.0 * u[-1] - u[-2]])
            slopes = np.gradient([*values, values[-1]], around)[:-1]
            cubic = CubicHermiteSpline(u, values, slopes)
            parts = [np.poly1d(cubic.c[:, i]) for i in range(7)]

            def value(t, parts=parts):
                i = min(int(np.searchsorted(u, float(t), side="right")) - 1, 6)
                return parts[i](t - mpmath.mpf(u[i]))

            inner = float(integral(value, np.exp(u), BROKEN.levels, BROKEN.rates))
            expected = inner + values[-1] * above + values[0] * found.below
            assert found.weights[j] == pytest.approx(expected, rel=1e-8), j

    @pytest.mark.parametrize("k", [0.5, 2.5, 4.0, 8.0])
    @pytest.mark.parametrize("step", [1.2, 2.0, 4.0, 10.0])
    def test_no_level_counts_as_less_than_nothing(self, k, step):
        """However coarse the levels and steep the hazard: a step that is reached later has a lower rate."""
        levels = 0.1 * step ** np.arange(6)
        curve = power_law(k=k, ends=(1e-3, 1e6))
        found = level_weights(levels, curve).weights
        assert found.min() > 0.0
        assert found.sum() > 1e-4 * levels[0] ** -k
        rates = np.cumsum(found[::-1])[::-1]
        assert rates[0] == pytest.approx(1e-4 * levels[0] ** -k + line_weights(levels, curve).below, rel=1e-10)
        assert (1e-4 * levels[1:] ** -k < rates[1:]).all()
        assert (rates[1:] < 1e-4 * levels[:-1] ** -k).all()

    def test_below_the_first_level_the_value_falls_to_zero_in_one_step(self):
        found = level_weights([0.4, 0.8], power_law())
        below = integral(lambda t: (t - mpmath.log(0.2)) / mpmath.log(2.0), [0.2, 0.4], [1e-3, 50.0], power_law().rates)
        assert found.below == pytest.approx(float(below), rel=1e-12)
        assert found.weights.sum() - found.below == pytest.approx(1e-4 * 0.4**-2.5, rel=1e-13)

    def test_hazard_that_ends_before_the_levels(self):
        """Its last slope goes on: the same as a curve that reaches further."""
        short = level_weights([0.1, 0.5, 2.0, 5.0], power_law(ends=(1e-3, 0.7)))
        long = level_weights([0.1, 0.5, 2.0, 5.0], power_law())
        np.testing.assert_allclose(short.weights, long.weights, rtol=1e-12)

    def test_hazard_that_begins_after_the_levels(self):
        """Weaker shakings than its first have no rate, and are not counted."""
        found = level_weights([0.1, 0.2, 0.5, 1.0, 2.0], power_law(ends=(0.5, 50.0)))
        np.testing.assert_allclose(found.weights[:2], 0.0, atol=0.0)
        assert found.below == 0.0
        assert found.weights.sum() == pytest.approx(1e-4 * 0.5**-2.5, rel=1e-13)

    @pytest.mark.parametrize("k", [1e-6, 0.05, 0.7213, 0.7214, 3.0, 400.0])
    def test_ramp_for_every_slope(self, k):
        """Series and closed form on either side of their border (k ln 2 = 0.5), flat and steep hazards."""
        curve = hazard([1.0, 2.0], [1.0, 2.0**-k])
        found = level_weights([1.0, 2.0], curve)
        with mpmath.workdps(40):
            z = mpmath.log(mpmath.mpf(1) / mpmath.mpf(float(curve.rates[1])))
            ramp = (1 - mpmath.exp(-z)) / z - mpmath.exp(-z)
        assert found.weights[1] - found.above == pytest.approx(float(ramp), rel=1e-9)
        if k > 0.01:
            assert found.weights[0] == pytest.approx(float(1 - mpmath.exp(-z) - ramp), rel=1e-12)

    def test_one_level_stands_for_all_that_exceeds_it(self):
        found = level_weights([0.4], power_law())
        assert found.weights[0] == found.above == pytest.approx(1e-4 * 0.4**-2.5, rel=1e-13)
        assert found.below == 0.0


class TestMeans:
    @pytest.mark.slow
    def test_against_plain_resamples(self):
        """Resamples of other draws, one after the other: ends agree within what 100,000 of them leave open."""
        values = np.random.default_rng(3).lognormal(0.0, 0.8, 40)
        found = mean_interval(values, replicates=100_000)
        rng, mean, error = np.random.default_rng(8), values.mean(), values.std()
        steps, logarithms = [], []
        for _ in range(100_000):
            drawn = rng.choice(values, values.size)
            own = drawn.mean() / mean
            ratio = error / np.sqrt(0.95 * drawn.var() + 0.05 * error**2)
            steps.append((own - 1.0) * ratio)
            logarithms.append(own * np.log(own) * ratio)
        low = mean * np.exp(-np.quantile(logarithms, 0.975))
        high = mean * (1.0 - 0.5 * np.quantile(steps, 0.025)) ** 2
        width = found.upper - found.lower
        assert abs(found.lower - low) < 0.04 * width
        assert abs(found.upper - high) < 0.04 * width
        # (scipy's BCa interval is shorter above)
        bca = stats.bootstrap((values,), np.mean, n_resamples=100_000, method="BCa", rng=np.random.default_rng(8))
        assert bca.confidence_interval.high < found.upper

    @pytest.mark.parametrize(("motions", "least", "most"), [(100, 0.88, 0.94), (200, 0.91, 0.97)])
    def test_coverage_of_an_annual_value(self, motions, least, most):
        """Motions that fall at their own threshold and above: levels of one motion are not independent.

        A mean of skewed values (the rates of lognormal thresholds): with 100 motions some 91 % of 95 % intervals hold
        it, with 200 some 93 %.
        """
        levels = np.geomspace(0.05, 6.0, 25)
        weights = level_weights(levels, power_law()).weights
        truth = weights @ ndtr(np.log(levels / 0.6) / 0.4)
        thresholds = 0.6 * np.exp(0.4 * np.random.default_rng(5).standard_normal((600, motions)))
        yearly = np.einsum("tlm,l->tm", (levels[:, None] >= thresholds[:, None, :]).astype(float), weights)
        found = mean_interval(yearly, replicates=600)
        assert least < ((found.lower <= truth) & (truth <= found.upper)).mean() < most
        # the same flags as if every level had motions of its own: intervals that look right and are wrong
        p = ndtr(np.log(levels / 0.6) / 0.4)
        alone = 1.96 * np.sqrt(np.sum(weights**2 * p * (1.0 - p)) / motions)
        assert (np.abs(yearly.mean(axis=1) - truth) <= alone).mean() < 0.85

    def test_resamples_are_the_same_for_every_statistic(self):
        values = np.random.default_rng(0).random((3, 4, 30))
        whole = resampled_means(values, 100)
        np.testing.assert_array_equal(whole[1, 2], resampled_means(values[1, 2], 100))
        np.testing.assert_allclose(whole.sum(axis=0), resampled_means(values.sum(axis=0), 100), rtol=1e-12)
        assert not np.array_equal(whole, resampled_means(values, 100, seed=1))

    def test_where_all_motions_agree(self):
        values = np.array([[0.0] * 20, [3.0] * 20, [1.0] * 20])
        free = mean_interval(values)
        assert np.isnan(free.lower).all()
        assert np.isnan(free.upper).all()
        bounded = mean_interval(values, most=3.0)
        wilson = 0.16113  # upper end for 0 of 20
        np.testing.assert_allclose(bounded.lower, [0.0, 3.0 * (1 - wilson), 1 - wilson], atol=1e-4)
        np.testing.assert_allclose(bounded.upper, [3.0 * wilson, 3.0, 1 + 2.0 * wilson], atol=1e-4)

    def test_scales_with_the_values(self):
        values = np.random.default_rng(1).exponential(size=50)
        one, thousand = mean_interval(values), mean_interval(1000.0 * values)
        np.testing.assert_allclose(np.array(thousand), 1000.0 * np.array(one), rtol=1e-12)


class TestQuantiles:
    @pytest.mark.parametrize(
        ("n", "q", "ranks"),
        # medians: tables of order statistics (exact coverage 0.9586, 0.9511); binomial tails for the others
        [(20, 0.5, (6, 15)), (30, 0.5, (10, 21)), (100, 0.9, (84, 96)), (100, 0.1, (5, 17))],
    )
    def test_ranks(self, n, q, ranks):
        found = quantiles(np.arange(1.0, n + 1.0)[:, None], np.array([q]), most=1e9)
        assert (found.lower[0], found.upper[0]) == ranks
        assert found.value[0] == np.ceil(q * n)
        low, high = ranks
        assert stats.binom.cdf(low - 1, n, q) <= 0.025
        assert stats.binom.sf(high - 1, n, q) <= 0.025
        assert stats.binom.cdf(low, n, q) > 0.025
        assert stats.binom.sf(high - 2, n, q) > 0.025

    def test_ends_beyond_the_motions(self):
        found = quantiles(np.arange(10.0)[:, None], np.array([0.1, 0.9]), most=50.0)
        assert found.lower[0] == 0.0
        assert found.upper[1] == 50.0

    def test_realisations_are_no_further_motions(self):
        values = np.random.default_rng(2).random((25, 1))
        one = quantiles(values, np.array([0.3, 0.5]), most=1.0)
        many = quantiles(np.repeat(values, 40, axis=1), np.array([0.3, 0.5]), most=1.0)
        np.testing.assert_array_equal(one[:3], many[:3])
        assert np.isnan(one.error).all()


class TestErrorsOfDraws:
    def test_by_hand(self):
        """Two motions, two draws each both ways: means 1/2 and 1, 1 and 1; variances 1/8 and 0, over 2 and 2²."""
        values = np.array([[0.0, 1.0, 1.0, 1.0], [1.0, 1.0, 1.0, 1.0]])
        assert sampling_error(values, 2) == pytest.approx(math.sqrt(0.125 / 2.0) / 2.0)
        assert np.isnan(sampling_error(values[:, :2], 2))
        assert share_error(np.ones((3, 4))) == pytest.approx(1.0 / 12.0)
        assert share_error(values, 2) == pytest.approx(math.hypot(0.125, 0.25))

    @pytest.mark.parametrize("ways", [1, 2])
    def test_of_quantiles(self, ways):
        """Of 40 motions with a lognormal amount each, in 300 repetitions: errors are their deviation within a fifth."""
        random = np.random.default_rng(8)
        medians = random.lognormal(0.0, 0.5, (40, 1))
        values = medians * random.lognormal(0.0, 0.5, (300, 40, 20))
        values = np.concatenate([values, 1.2 * values], axis=2)[..., : 20 * ways]
        found = quantiles(values, np.array([0.5, 0.9]), np.inf, ways=ways)
        np.testing.assert_allclose(found.error.mean(axis=0), found.value.std(axis=0), rtol=0.2)


class TestTotals:
    """One model, two items (3 and 2 pieces), four variants, one level, 200 motions with a chance of their own."""

    counts = np.array([3, 2])

    def flags(self):
        generator = np.random.default_rng(4)
        chance = generator.integers(0, 5, (2, 200))
        order = np.argsort(generator.random((2, 4, 200)), axis=1)
        return (order < chance[:, None, :])[None, :, :, None, :], chance / 4.0

    def test_expectations(self):
        flags, chance = self.flags()
        np.testing.assert_array_equal(chances(flags)[0, :, 0], chance)
        members = np.array([[True, True], [False, True]])
        found = expected_totals(chances(flags), np.array([3.0, 20.0]), members)
        np.testing.assert_allclose(found[0, :, 0], [3.0 * chance[0] + 20.0 * chance[1], 20.0 * chance[1]])

    @pytest.mark.parametrize("pieces", ["independent", "together"])
    def test_variance_of_the_number(self, pieces):
        """Given the motion a binomial number, or all or none: its variance over motions and draws in closed form."""
        flags, chance = self.flags()
        variability = Variability(0.1, variants=4, realisations=1000, pieces=pieces)
        number = fallen_pieces(flags[:, 0], drawn_pieces(variability, "a", 3, 200))[0, 0]
        p = chance[0]
        within = np.mean(p * (1.0 - p)) * (3.0 if pieces == "independent" else 9.0)
        expected = within + 9.0 * p.var()
        assert number.var() == pytest.approx(expected, rel=0.05)
        assert number.mean() == pytest.approx(3.0 * p.mean(), rel=0.03)

    def test_events(self):
        flags, chance = self.flags()
        either = 1.0 - chances_of_none(
            chances_of_any(chances(flags), self.counts, independent=True), np.array([[True, True], [False, False]])
        )
        np.testing.assert_allclose(either[0, 0, 0], 1.0 - (1.0 - chance[0]) ** 3 * (1.0 - chance[1]) ** 2, atol=1e-15)
        np.testing.assert_array_equal(either[0, 1], 0.0)
        together = chances_of_any(chances(flags), self.counts, independent=False)
        np.testing.assert_array_equal(together, chances(flags))

    def test_thresholds(self):
        amounts = np.array([0.1 + 0.2, 0.3, 1.0])[:, None]
        above, reached = (next(exceedances(amounts, np.array([0.3]), strictly)) for strictly in (True, False))
        np.testing.assert_array_equal(above[:, 0], [0.0, 0.0, 1.0])
        np.testing.assert_array_equal(reached[:, 0], [1.0, 1.0, 1.0])


class TestVariability:
    def test_restitution_has_its_mean_and_deviation(self):
        law = tp.HousnerImpact(geometry="linear")
        found = [one.e for one in oscillators_of_pieces(SHELF, law, 0.9, Variability(0.03, variants=1000))]
        assert np.mean(found) == pytest.approx(0.9, abs=1e-3)
        assert np.std(found) == pytest.approx(0.03, rel=0.02)
        assert max(found) <= 1.0
        # the distribution itself, by scipy
        size = 0.9 * 0.1 / 0.03**2 - 1.0
        assert stats.kstest(found, stats.beta(0.9 * size, 0.1 * size).cdf).statistic < 2e-3

    def test_slenderness_has_its_median_and_dispersion_and_keeps_the_size(self):
        variability = Variability(slenderness_dispersion=0.1, variants=999)
        found = oscillators_of_pieces(SHELF, tp.HousnerImpact(geometry="exact"), None, variability)
        # the exact geometry uplifts at g tan(alpha)
        alpha = np.array([np.arctan(lifts_at(one) / one.gain / STANDARD_GRAVITY) for one in found])
        assert np.median(alpha) == pytest.approx(SHELF.alpha, rel=1e-3)
        assert np.std(np.log(alpha)) == pytest.approx(0.1, rel=0.01)
        # e_R follows each variant's own shape
        np.testing.assert_allclose([one.e for one in found], 1.0 - 1.5 * np.sin(alpha) ** 2, rtol=1e-12)

    @pytest.mark.parametrize("pieces", ["independent", "together"])
    def test_draws_depend_on_seed_and_label_alone(self, pieces):
        """Neither further motions nor further realisations change them, and motions have draws of their own."""
        few, more = (Variability(0.02, pieces=pieces, realisations=r) for r in (20, 31))
        found = drawn_pieces(few, "shelf", 5, 40)
        np.testing.assert_array_equal(found, drawn_pieces(more, "shelf", 5, 90)[:40, :20])
        for other in (drawn_pieces(few, "case", 5, 40), drawn_pieces(replace(few, seed=1), "shelf", 5, 40)):
            assert (other == found).all(axis=2).mean() < 0.2
        assert (found.sum(axis=2) == 5).all()
        assert np.unique(found[:, 0], axis=0).shape[0] > 12
        if pieces == "together":
            assert set(found.ravel().tolist()) == {0, 5}

    def test_own_restitution(self):
        assert with_restitution(tp.DiscreteDamping(delta=0.1), 0.8) == tp.DiscreteDamping(e=0.8, delta=0.1)
        assert with_restitution(tp.HousnerImpact(restitution_factor=0.9), 0.8) == tp.HousnerImpact(e=0.8)
        assert with_restitution(tp.Vassiliou(), None) == tp.Vassiliou()

    def test_laws_without_restitution_vary_in_slenderness_alone(self):
        found = oscillators_of_pieces(SHELF, tp.Vassiliou(), None, Variability(0.02, variants=3))
        assert found[0] == found[1] == found[2] == tp.Vassiliou().oscillator(SHELF)


def test_refused(refusal):
    refusal()
