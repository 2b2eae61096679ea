"""Goodness of fit, forms compared, and how often blocks stand above their first overturning."""

import math
from dataclasses import replace

import numpy as np
import pytest
import xarray as xr
from fit_cases import BAKER, BAKER_DISPERSION, BAKER_MEDIAN, capacities, clustered, counts
from known_truths import FRECHET, LOGNORMAL, WEIBULL, ida
from scipy.special import ndtr
from scipy.stats import chi2, kstest

import toppling as tp
from toppling.fragility import compare_forms, fit_fragility, goodness_of_fit, resurrections
from toppling.fragility.fitting import goodness
from toppling.fragility.fitting.fit import form_named
from toppling.fragility.fitting.trials import collect

LEVELS = np.geomspace(0.4, 2.5, 8)


class TestGoodness:
    def test_the_deviance(self):
        found = goodness_of_fit(BAKER, replicates=50)
        k = BAKER["overturnings"].values
        p = ndtr(np.log(BAKER["level"].values / BAKER_MEDIAN) / BAKER_DISPERSION)
        with np.errstate(divide="ignore", invalid="ignore"):
            terms = np.where(k > 0, k * np.log(k / (40 * p)), 0.0) + (40 - k) * np.log((40 - k) / (40 * (1 - p)))
        assert found["statistic"].item() == pytest.approx(2.0 * terms.sum(), rel=1e-10)
        assert found.attrs["statistic"] == "deviance"
        again = goodness_of_fit(BAKER, replicates=50)
        xr.testing.assert_identical(found, again)

    def test_the_sum_of_residuals_of_a_cloud(self):
        """By hand: 0 of 5 fell at 1/4, 3 of 3 at 1/2, 0 of 3 at 2 and 5 of 5 at 4.

        The likeliest odds are x: the residuals -1, 2, -2, 1 and their products with ln x sum to 0.  Sums up to any x
        are -1, 1, -1, 0, and the variance is 10 times 4/25 and 6 times 2/9, 44/15.
        """
        cloud = xr.Dataset(
            {"overturned": ("motion", np.repeat([False, True, False, True], [5, 3, 3, 5]))},
            coords={"intensity": ("motion", np.repeat([0.25, 0.5, 2.0, 4.0], [5, 3, 3, 5]))},
        )
        found = goodness_of_fit(cloud, "log-logistic", replicates=1)
        assert found["statistic"].item() == pytest.approx(math.sqrt(15.0 / 44.0), rel=1e-6)

    def test_large_stripes_are_chi_square(self):
        """Independent runs, large counts: the p-value is chi-square's with levels - 2 degrees of freedom."""
        k = np.random.default_rng(3).binomial(2000, ndtr(np.log(LEVELS) / 0.4))
        found = goodness_of_fit(counts(LEVELS, k, 2000), replicates=2000)
        expected = chi2.sf(found["statistic"].item(), 6)
        assert found["p_value"].item() == pytest.approx(expected, abs=0.05)

    @pytest.mark.parametrize("kind", ["counts", "ida", "first", "cloud"])
    def test_right_curves_pass_and_wrong_ones_fail(self, kind):
        """Under the truth p-values are uniform; a curve of two kinds of capacity is rejected."""
        options = {"replicates": 99, "method": "first-overturning" if kind == "first" else "binomial"}
        rng = np.random.default_rng(7)
        if kind == "counts":
            right = counts(LEVELS, rng.binomial(60, ndtr(np.log(LEVELS) / 0.4), (120, 8)), 60)
            wrong = counts(LEVELS, np.array([24, 25, 28, 30, 30, 30, 40, 60]), 60)
        elif kind == "cloud":
            x = rng.lognormal(0.0, 0.6, 120)
            fell = np.exp(0.4 * rng.standard_normal((60, 120))) <= x
            right = xr.Dataset({"overturned": (("study", "motion"), fell)}, coords={"intensity": ("motion", x)})
            y = rng.lognormal(0.0, 0.6, 400)
            two = np.where(np.arange(400) % 2, 0.7, 2.5) * np.exp(0.05 * rng.standard_normal(400))
            wrong = xr.Dataset({"overturned": ("motion", two <= y)}, coords={"intensity": ("motion", y)})
        else:
            right = clustered(8, 120, 60, LEVELS)
            two = np.where(np.arange(200) % 2, 0.55, 2.2) * np.exp(0.1 * rng.standard_normal(200))
            wrong = xr.Dataset({"overturned": (("level", "motion"), two <= LEVELS[:, None])}, coords={"level": LEVELS})
        p = goodness_of_fit(right, **options)["p_value"].values
        assert kstest(p, "uniform").pvalue > 0.01
        assert goodness_of_fit(wrong, **options)["p_value"].item() <= 0.02

    @pytest.mark.slow
    def test_runs_of_one_motion_are_not_independent(self):
        """Chi-square's quantile would reject clustered studies wrongly, or hardly ever; the simulation does not."""
        fits = clustered(9, 200, 100, np.geomspace(0.3, 3.0, 20))
        found = goodness_of_fit(fits, replicates=99)
        naive = chi2.sf(found["statistic"].values, 18)
        assert abs((naive < 0.05).mean() - 0.05) > 0.04
        assert (found["p_value"].values < 0.05).mean() == pytest.approx(0.05, abs=0.045)

    @pytest.mark.slow
    @pytest.mark.parametrize("correlation", [0.0, 0.3, 0.8])
    def test_runs_of_one_motion_that_differ(self, correlation):
        """One capacity a motion would reject a quarter of these right curves, 5 % of which are to be rejected."""
        truth = replace(LOGNORMAL, correlation=correlation)
        runs = ida(truth, 150, 40, 3, 2.0 * LEVELS)
        p = [goodness_of_fit(runs.isel(study=[i]), replicates=99, seed=i)["p_value"].item() for i in range(150)]
        assert (np.array(p) <= 0.05).mean() == pytest.approx(0.05, abs=0.04)

    @pytest.mark.slow
    @pytest.mark.parametrize("shape", [WEIBULL, FRECHET])
    def test_skewed_curves_of_one_capacity_are_found(self, shape):
        """The power against them, of 100 motions at 20 levels, is nine in ten."""
        p = goodness_of_fit(ida(replace(shape, correlation=1.0), 40, 100, 4), replicates=99)["p_value"].values
        assert (p <= 0.05).mean() > 0.75

    def test_the_correlation_within_motions(self):
        """Normal scores of correlation r are both below their medians in 1/4 + asin(r)/(2 pi) of all motions."""
        fell = np.arange(400) < 200
        motion, level = np.repeat(np.arange(400), 2), np.tile([0, 1], 400)
        for shift, share in ((0, 1.0), (50, math.sin(0.25 * math.pi)), (100, 0.0)):  # both in 1/2, 3/8 and 1/4
            runs = np.stack([fell, np.roll(fell, shift)], axis=1).ravel()
            found = goodness._score_shares(motion, level, runs - 0.5, np.array([0.5, 0.5]))
            assert found == pytest.approx((math.sqrt(share), math.sqrt(1.0 - share)), abs=1e-3)

    def test_motions_that_are_not_run_at_every_level(self):
        """Stripes with motions in common: as many runs at each level are simulated as there are."""
        runs = xr.Dataset(
            {"overturned": ("motion", np.arange(90) % 3 < np.repeat([0, 1, 2], [40, 40, 10]))},
            coords={
                "intensity": ("motion", np.repeat([0.5, 1.0, 2.0], [40, 40, 10])),
                "stripe": ("motion", np.repeat([1, 2, 3], [40, 40, 10])),
                "motion": [f"run {i}" for i in range(90)],
                "record": ("motion", [f"motion {i}" for i in (*range(40), *range(40), *range(10))]),
            },
            attrs={"design": "stripes"},
        )
        (sample,) = collect(runs).samples
        assert sample.repeated
        cells = goodness._simulated(form_named("lognormal"), sample, "auto", 20, 0)
        assert (cells.reshape(20, 3, 3).sum(axis=2) == [40, 40, 10]).all()

    def test_with_uplift(self):
        """Capacities above a threshold: the mixed law passes, the lognormal fails."""
        rng = np.random.default_rng(10)
        levels = np.geomspace(0.6, 4.0, 14)
        starts = np.exp(0.05 * rng.standard_normal(500))
        up = starts <= levels[:, None]
        falls = up & (capacities(rng, 14, 500, 1.2, 0.6) <= levels[:, None])
        runs = xr.Dataset(
            {"overturned": (("level", "motion"), falls), "uplifted": (("level", "motion"), up)},
            coords={"level": levels},
        )
        mixed = goodness_of_fit(runs, "uplift-lognormal", replicates=99)
        plain = goodness_of_fit(runs, replicates=99)
        assert plain["p_value"].item() == 0.01
        assert mixed["p_value"].item() > 0.02
        known = runs.drop_vars("uplifted").assign_coords(
            level=("level", levels, {"im": "pga_normalised"}),
            alpha=0.2,
            law="housner",
            rest="",
            lever="h",
            geometry="exact",
        )
        known["overturned"] = known["overturned"] & (known["level"] > 1.0)
        assert goodness_of_fit(known, "uplift-lognormal", replicates=20)["p_value"].item() > 0.05

    def test_no_curve_no_value(self):
        found = goodness_of_fit(counts(LEVELS, np.zeros((2, 8), int)), replicates=10)
        assert np.isnan(found["p_value"].values).all()
        assert found["p_value"].dims == ("set0",)

    @pytest.mark.parametrize("form", ["log-logistic", "weibull", "isotonic"])
    def test_other_forms(self, form):
        assert goodness_of_fit(BAKER, form, replicates=50)["p_value"].item() > 0.05


class TestForms:
    def test_aic(self):
        found = compare_forms(BAKER)
        for form in ("lognormal", "log-logistic", "weibull"):
            fit = fit_fragility(BAKER, form=form)
            one = found.sel(form=form)
            assert one["aic"].item() == pytest.approx(4.0 - 2.0 * fit["log_likelihood"].item(), rel=1e-14)
            assert one["aic"].item() == fit["aic"].item()
        assert found["aic_difference"].min().item() == 0.0
        assert found["aic_difference"].idxmin("form").item() == "lognormal"

    @pytest.mark.parametrize("truth", ["lognormal", "weibull"])
    def test_the_truth_is_found(self, truth):
        """Large stripes from one form: the other loses."""
        x = np.geomspace(0.2, 3.0, 15)
        p = ndtr(np.log(x) / 0.5) if truth == "lognormal" else -np.expm1(-(x**2.5))
        k = np.random.default_rng(11).binomial(500, p, (40, 15))
        found = compare_forms(counts(x, k, 500), ("lognormal", "weibull"))
        assert (found["aic"].idxmin("form") == truth).mean().item() > 0.9

    def test_of_first_overturnings_and_own_fits(self):
        runs = clustered(12, 2, 60, LEVELS)
        found = compare_forms(runs, method="first-overturning")
        assert found["aic"].dims == ("form", "study")
        assert np.isfinite(found["aic"]).all()

        class Half:
            parameters = {"p": 0.5}

            def __init__(self, *data):
                pass

            def probability(self, x):
                return np.full_like(x, 0.5)

        own = compare_forms(BAKER, ("lognormal", Half, "isotonic"))
        assert own["form"].values.tolist() == ["lognormal", "Half", "isotonic"]
        assert own["aic"].sel(form="Half").item() == pytest.approx(2.0 + 2.0 * 320 * math.log(2.0))
        assert np.isnan(own["aic"].sel(form="isotonic").item())


class TestResurrections:
    def test_by_hand(self):
        flags = np.array([[0, 0, 0, 1], [1, 0, 0, 1], [0, 0, 1, 1], [1, 0, 1, 0]], bool)  # level, motion
        runs = xr.Dataset({"overturned": (("level", "motion"), flags)}, coords={"level": [1.0, 2.0, 3.0, 4.0]})
        found = resurrections(runs)
        # above the first: two, none, one and three levels; standing at one, none, none and one of them
        assert (found["pairs"].item(), found["stood"].item()) == (6, 2)
        assert found["returned"].item() == pytest.approx(1.0 / 3.0)
        assert (found["motions"].item(), found["motions_returned"].item()) == (3, pytest.approx(2.0 / 3.0))
        # levels in any order
        assert resurrections(runs.isel(level=[2, 0, 3, 1]))["returned"].item() == found["returned"].item()

    def test_monotone_and_empty(self):
        runs = clustered(1, 2, 30, LEVELS)
        assert (resurrections(runs)["returned"] == 0.0).all()
        noisy = resurrections(clustered(1, 2, 30, LEVELS, noise=0.3))
        assert (noisy["returned"] > 0.02).all()
        assert noisy["returned"].dims == ("study",)
        none = xr.Dataset(
            {"overturned": (("level", "motion"), np.zeros((3, 4), bool))}, coords={"level": [1.0, 2.0, 3.0]}
        )
        assert np.isnan(resurrections(none)["returned"].item())

    def test_of_real_blocks_and_floors(self):
        shakes = tp.motions.CloughPenzien(duration=10.0, dt=0.01).sample(20, seed=1)
        blocks = [tp.Block(0.4, 1.6, name="a"), tp.Block(0.5, 1.2, name="b")]
        runs = tp.ida(blocks, [tp.HousnerImpact(), tp.DiscreteDamping()], shakes, np.linspace(1.0, 12.0, 12))
        found = resurrections(runs)
        assert found["returned"].dims == ("block", "model")
        assert {"alpha", "law", "e"} <= set(found.coords)
        for i in range(2):
            for j in range(2):
                flags = runs["overturned"].values[i, j]
                pairs = stood = 0
                for motion in flags.T:
                    above = motion[motion.argmax() + 1 :] if motion.any() else motion[:0]
                    pairs, stood = pairs + above.size, stood + int((~above).sum())
                assert (found["pairs"].values[i, j], found["stood"].values[i, j]) == (pairs, stood)
        assert (found["stood"] > 0).any()
        labels = [f"{name} floor {floor}" for floor in (1, 2) for name in shakes["motion"].values]
        floors = xr.concat([runs, runs.isel(level=slice(None, None, -1)).assign_coords(level=runs["level"])], "motion")
        floors = floors.assign_coords(motion=labels, floor=("motion", np.repeat(["1", "2"], 20)))
        apart = resurrections(floors)
        assert apart["returned"].dims == ("block", "model", "floor")
        np.testing.assert_array_equal(apart["pairs"].sel(floor=1).values, found["pairs"].values)


def test_refused(refusal):
    refusal()
