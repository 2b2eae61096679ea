"""Forms of curves beside the lognormal: with uplift, isotonic, and fits of one's own."""

import math

import numpy as np
import pytest
import xarray as xr
from fit_cases import BAKER, BAKER_DISPERSION, BAKER_MEDIAN, capacities, clustered, counts, once
from lognormal import fit_lognormal
from scipy.optimize import LinearConstraint, brentq, minimize
from scipy.special import log_ndtr, ndtr, ndtri
from scipy.stats import chi2

import toppling as tp
from toppling.fragility import FORMS, fit_fragility
from toppling.fragility.fitting.isotonic import crossings, isotonic_probabilities
from toppling.fragility.fitting.trials import rocking_thresholds

LEVELS = np.geomspace(0.25, 4.0, 16)


def rocking(seed, motions=400, threshold=1.0, median=1.3, dispersion=0.6, levels=LEVELS, known=True, spread=0.0):
    """Blocks that stand still below a threshold (of the motion, with a spread) and fall above it at a capacity."""
    rng = np.random.default_rng(seed)
    starts = threshold * np.exp(spread * rng.standard_normal(motions))
    # independent runs given uplift: capacities anew for every run
    falls = capacities(rng, levels.size, motions, median, dispersion) <= levels[:, None]
    up = starts <= levels[:, None]
    law = {
        "alpha": ("block", [0.2]),
        "law": ("model", ["housner"]),
        "rest": ("model", [""]),
        "lever": ("model", ["h"]),
        "geometry": ("model", ["exact"]),
    }
    flags = {"overturned": falls & up, "uplifted": up}
    return xr.Dataset(
        {name: (("block", "model", "level", "motion"), values[None, None]) for name, values in flags.items()},
        coords={"level": ("level", levels, {"im": "pga_normalised" if known else "pgv", "units": "1"}), **law},
    )


class TestThreshold:
    def test_where_rigid_blocks_uplift(self):
        """Of every law and option, against where runs start to uplift."""
        block = tp.Block(0.5, 1.5, name="crate")
        laws = [
            tp.HousnerImpact(),
            tp.HousnerImpact(geometry="linear"),
            tp.HousnerImpact(geometry="bilinear"),
            tp.HousnerImpact(geometry="bilinear", lever="R"),
            tp.DiscreteDamping(rest="rigid"),
            tp.EnergyConsistent(lever="R"),
        ]
        shakes = tp.motions.CloughPenzien(duration=5.0, dt=0.01).sample(3)
        known = rocking_thresholds(tp.ida(block, laws, shakes, [1.0])).values[0]
        assert np.isfinite(known).all()
        for law, threshold in zip(laws, known, strict=True):
            runs = tp.ida(block, law, shakes, threshold * np.array([1 - 1e-7, 1 + 1e-7]), outputs=["uplifted"])
            assert not runs["uplifted"].values[0, 0, 0].any()
            assert runs["uplifted"].values[0, 0, 1].all()
        of_one = rocking_thresholds(tp.ida(block, laws, shakes, [1.0], "pga_normalised")).values[0]
        np.testing.assert_allclose(of_one * 9.80665 * math.tan(block.alpha), known, rtol=1e-14)

    def test_where_it_is_not_known(self):
        block, shakes = tp.Block(0.5, 1.5), tp.motions.CloughPenzien(duration=5.0, dt=0.01).sample(2)
        elastic = [tp.DiscreteDamping(), tp.Vassiliou(), tp.ViscousDamping(0.05)]
        assert np.isnan(rocking_thresholds(tp.ida(block, elastic, shakes, [1.0]))).all()
        rigid = tp.HousnerImpact()
        assert np.isnan(rocking_thresholds(tp.ida(block, rigid, shakes, [0.1], "pgv"))).all()
        floors = tp.motions.Building.flexural_shear(0.5, storeys=2).floor_motions(shakes, floors=[0, 2])
        at_ground = tp.ida(block, rigid, floors, [1.0], ground=shakes)
        assert np.isnan(rocking_thresholds(at_ground)).all()
        assert np.isfinite(rocking_thresholds(tp.ida(block, rigid, floors, [1.0]))).all()
        loose = tp.stripes(block, rigid, [shakes, shakes], [1.0, 2.0], scale=False)
        assert np.isnan(rocking_thresholds(loose)).all()
        assert np.isfinite(rocking_thresholds(tp.stripes(block, rigid, [shakes, shakes], [1.0, 2.0]))).all()


class TestUplift:
    def test_a_known_step(self):
        """P is 0 below the threshold and fitted to the levels above, as a fit to those alone."""
        runs = rocking(1)
        fit = fit_fragility(runs, form="uplift-lognormal", intervals="wald", fractiles=(0.02, 0.2, 0.5)).squeeze()
        assert fit["uplift_median"].item() == 1.0
        assert fit["uplift_dispersion"].item() == fit["uplift_median_se"].item() == 0.0
        assert fit["uplift_status"].item() == "known step"
        above = LEVELS > 1.0
        k = runs["overturned"].values[0, 0].sum(axis=1)
        alone = fit_lognormal(LEVELS[above], k[above], np.full(above.sum(), 400))
        assert fit["median"].item() == pytest.approx(alone.median, rel=1e-12)
        assert fit["dispersion"].item() == pytest.approx(alone.dispersion, rel=1e-12)
        assert fit["log_likelihood"].item() == pytest.approx(alone.log_likelihood, rel=1e-12)
        assert fit["aic"].item() == pytest.approx(4.0 - 2.0 * alone.log_likelihood, rel=1e-12)
        # at 1 the curve jumps from 0 to more than a fifth: fractiles below that are the threshold itself
        jump = ndtr(math.log(1.0 / alone.median) / alone.dispersion)
        assert jump > 0.2
        assert fit["fractile"].values[:2].tolist() == [1.0, 1.0]
        assert fit["fractile_lower"].values[:2].tolist() == [1.0, 1.0]
        assert fit["fractile"].values[2] == pytest.approx(alone.median, rel=1e-12)
        # the flags of uplift are not needed where the threshold is known
        xr.testing.assert_equal(
            fit_fragility(runs.drop_vars("uplifted"), form="uplift-lognormal", intervals="wald"),
            fit_fragility(runs, form="uplift-lognormal", intervals="wald"),
        )

    def test_below_rocking_the_plain_curve_is_wrong(self):
        """Truth: 0 below 1.  The lognormal of all runs gives several per cent at 0.8 and lies off at 1."""
        runs = rocking(2, motions=2000)
        plain = fit_fragility(runs, intervals="wald").squeeze()
        mixed = fit_fragility(runs, form="uplift-lognormal", intervals="wald").squeeze()

        def at(fit, x):
            return ndtr(np.log(x / fit["median"].item()) / fit["dispersion"].item())

        assert at(plain, 0.8) > 0.05
        truth = ndtr(np.log(1.05 / 1.3) / 0.6)
        assert at(mixed, 1.05) == pytest.approx(truth, abs=0.015)
        assert abs(at(plain, 1.05) - truth) > 0.05
        assert mixed["aic"].item() < plain["aic"].item() - 100.0
        assert mixed["median"].item() == pytest.approx(1.3, rel=0.03)
        assert mixed["dispersion"].item() == pytest.approx(0.6, rel=0.05)

    def test_a_fitted_uplift(self):
        """Two factors, each the probit of its own runs, and the likelihood of what overturned under their product."""
        runs = rocking(3, known=False, spread=0.3)
        fit = fit_fragility(
            runs,
            form="uplift-lognormal",
            intervals="wald",
            fractiles=(0.05, 0.5, 0.9),
            keep_replicates=True,
            replicates=50,
        ).squeeze()
        up = runs["uplifted"].values[0, 0].sum(axis=1)
        k = runs["overturned"].values[0, 0].sum(axis=1)
        first, second = fit_lognormal(LEVELS, up, np.full(16, 400)), fit_lognormal(LEVELS, k, up)
        assert fit["uplift_median"].item() == pytest.approx(first.median, rel=1e-12)
        assert fit["uplift_dispersion"].item() == pytest.approx(first.dispersion, rel=1e-12)
        assert fit["median"].item() == pytest.approx(second.median, rel=1e-12)
        assert fit["uplift_status"].item() == "ok"
        p = ndtr(np.log(LEVELS / first.median) / first.dispersion) * ndtr(
            np.log(LEVELS / second.median) / second.dispersion
        )
        likelihood = np.sum(np.where(k > 0, k * np.log(p), 0.0) + (400 - k) * np.log1p(-p))
        assert fit["log_likelihood"].item() == pytest.approx(likelihood, rel=1e-10)
        assert fit["aic"].item() == pytest.approx(8.0 - 2.0 * likelihood, rel=1e-10)
        for fraction in (0.05, 0.5, 0.9):
            x = fit["fractile"].sel(fraction=fraction).item()
            product = ndtr(math.log(x / first.median) / first.dispersion) * ndtr(
                math.log(x / second.median) / second.dispersion
            )
            assert product == pytest.approx(fraction, rel=1e-12)
        assert fit["uplift_median_sample"].dims == ("replicate",)

    def test_fractiles_of_the_product(self):
        """Its Wald interval from numerical derivatives, its profile from a search over all four parameters."""
        runs = rocking(4, motions=60, known=False, spread=0.3)
        k = runs["overturned"].values[0, 0].sum(axis=1)
        up = runs["uplifted"].values[0, 0].sum(axis=1)
        cells = xr.Dataset(
            {"overturned": ("motion", runs["overturned"].values[0, 0].T.ravel())},
            coords={"intensity": ("motion", np.tile(LEVELS, 60))},
        ).assign(uplifted=("motion", runs["uplifted"].values[0, 0].T.ravel()))
        x, p = np.log(LEVELS), 0.3
        wald, profile = (
            fit_fragility(cells, form="uplift-lognormal", intervals=kind, fractiles=(p,)).squeeze()
            for kind in ("wald", "profile")
        )
        first, second = fit_lognormal(LEVELS, up, np.full(16, 60)), fit_lognormal(LEVELS, k, up)

        def loss(log_median, log_dispersion, fell, n):
            eta = (x - log_median) / math.exp(log_dispersion)
            return -np.sum(fell * log_ndtr(eta) + (n - fell) * log_ndtr(-eta))

        def place(q):
            def excess(t):
                return ndtr((t - q[0]) / math.exp(q[1])) * ndtr((t - q[2]) / math.exp(q[3])) - p

            return brentq(excess, -5.0, 5.0, xtol=1e-14)

        at = np.log([first.median, first.dispersion, second.median, second.dispersion])
        gradient = np.array([(place(at + e) - place(at - e)) / 2e-5 for e in 1e-5 * np.eye(4)])
        covariance = np.zeros((4, 4))
        for i, fell, n in ((0, up, np.full(16, 60)), (2, k, up)):
            h = 1e-4 * np.eye(2)
            of = lambda d, i=i, fell=fell, n=n: loss(at[i] + d[0], at[i + 1] + d[1], fell, n)  # noqa: E731
            hessian = [[(of(e + f) - of(e - f) - of(f - e) + of(-e - f)) / 4e-8 for f in h] for e in h]
            covariance[i : i + 2, i : i + 2] = np.linalg.inv(hessian)
        half = 1.959963984540054 * math.sqrt(gradient @ covariance @ gradient)
        assert wald["fractile_lower"].item() == pytest.approx(math.exp(place(at) - half), rel=1e-5)
        assert wald["fractile_upper"].item() == pytest.approx(math.exp(place(at) + half), rel=1e-5)

        best = loss(*at[:2], up, np.full(16, 60)) + loss(*at[2:], k, up)

        def constrained(t):
            """Least loss with the fractile at t: the second median follows from the other three parameters."""

            def of(q):
                rest = p / ndtr((t - q[0]) / math.exp(q[1]))
                if not 0.0 < rest < 1.0:
                    return 1e9
                median = t - math.exp(q[2]) * ndtri(rest)
                return loss(q[0], q[1], up, np.full(16, 60)) + loss(median, q[2], k, up)

            found = minimize(
                of, at[[0, 1, 3]], method="Nelder-Mead", options={"xatol": 1e-10, "fatol": 1e-13, "maxiter": 4000}
            )
            return found.fun

        for end in (profile["fractile_lower"].item(), profile["fractile_upper"].item()):
            assert 2.0 * (constrained(math.log(end)) - best) == pytest.approx(chi2.ppf(0.95, 1), abs=1e-6)
        # every motion five times over: likelihoods five times as sharp, but one motion each
        copies = xr.concat([runs.squeeze(drop=True)] * 5, "level").assign_coords(level=np.tile(LEVELS, 5))
        once_more = xr.concat([runs.squeeze(drop=True)], "level")
        wide, plain = (
            fit_fragility(data, form="uplift-lognormal", intervals="profile", fractiles=(p,))
            for data in (copies, once_more)
        )
        ratio = [math.log(fit["fractile_upper"].item() / fit["fractile_lower"].item()) for fit in (wide, plain)]
        assert ratio[0] == pytest.approx(ratio[1], rel=0.1)
        drawn = fit_fragility(cells, form="uplift-lognormal", intervals="bootstrap", fractiles=(p,)).squeeze()
        for end in ("fractile_lower", "fractile_upper"):
            assert drawn[end].item() == pytest.approx(profile[end].item(), rel=0.1)

    def test_steps_between_levels(self):
        """Flags that separate perfectly, in a measure without a known threshold."""
        runs = rocking(5, known=False)
        fit = fit_fragility(runs, form="uplift-lognormal", replicates=50, keep_replicates=True).squeeze()
        lower, upper = LEVELS[LEVELS < 1.0][-1], LEVELS[LEVELS >= 1.0][0]
        assert (fit["uplift_median_lower"].item(), fit["uplift_median_upper"].item()) == (lower, upper)
        assert fit["uplift_median"].item() == pytest.approx(math.sqrt(lower * upper))
        assert fit["uplift_dispersion"].item() == 0.0
        assert fit["uplift_status"].item() == "step between levels"
        assert (fit["uplift_dispersion_sample"].values == 0.0).all()
        high = runs.isel(level=LEVELS > 1.0)
        fit = fit_fragility(high, form="uplift-lognormal", replicates=50).squeeze()
        assert fit["uplift_status"].item() == "all uplifted"
        assert 0.0 < fit["uplift_median"].item() < 1e-300
        assert fit["median"].item() == fit_fragility(high, replicates=50)["median"].item()

    def test_when_there_is_nothing_to_fit(self):
        low = rocking(6).isel(level=LEVELS < 1.0)
        for runs in (low, low.drop_vars("uplifted"), rocking(6, known=False).isel(level=LEVELS < 1.0)):
            fit = fit_fragility(runs, form="uplift-lognormal", replicates=20).squeeze()
            assert fit["status"].item() == "no overturning"
            assert not bool(fit["converged"])
            assert fit["median_lower"].item() == low["level"].values[-1]
        with pytest.raises(ValueError, match="needs `uplifted` where the threshold of rocking is not known"):
            fit_fragility(rocking(7, known=False).drop_vars("uplifted"), form="uplift-lognormal")
        with pytest.raises(ValueError, match="needs `uplifted`"):
            fit_fragility(BAKER, form="uplift-lognormal")

    def test_flags_against_the_threshold(self):
        """Uplifts below what should be the threshold: it is not believed, and fitted."""
        runs = rocking(8, spread=0.3)
        fit = fit_fragility(runs, form="uplift-lognormal", intervals="wald").squeeze()
        assert fit["uplift_status"].item() == "ok"
        assert fit["uplift_dispersion"].item() == pytest.approx(0.3, rel=0.15)

    def test_of_real_blocks(self):
        shakes = tp.motions.CloughPenzien(duration=10.0, dt=0.01).sample(30, seed=4)
        laws = [tp.HousnerImpact(), tp.DiscreteDamping()]
        runs = tp.ida(
            tp.Block(0.4, 1.6), laws, shakes, np.geomspace(0.1, 4.0, 12), "pga_normalised", ["overturned", "uplifted"]
        )
        fit = fit_fragility(runs, form="uplift-lognormal", replicates=100)
        assert fit["uplift_status"].values[0, 0] == "known step"
        assert fit["uplift_median"].values[0, 0] == 1.0
        assert fit["uplift_status"].values[0, 1] != "known step"
        assert 0.1 < fit["uplift_median"].values[0, 1] < 1.0  # the elastic zone lifts off earlier


class TestIsotonic:
    def test_against_a_quadratic_programme(self):
        """PAVA is weighted least squares under order constraints: solved by a general optimiser on small cases."""
        rng = np.random.default_rng(1)
        for _ in range(20):
            size = int(rng.integers(2, 7))
            runs = rng.integers(1, 30, size)
            k = rng.binomial(runs, rng.random(size))
            found = isotonic_probabilities(np.arange(1.0, size + 1.0), k.astype(float), runs.astype(float))
            target = k / runs
            order = LinearConstraint(np.diff(np.eye(size), axis=0), 0.0, np.inf)
            programme = minimize(
                lambda p, target=target, runs=runs: np.sum(runs * (p - target) ** 2),
                np.full(size, 0.5),
                jac=lambda p, target=target, runs=runs: 2.0 * runs * (p - target),
                constraints=[order],
                bounds=[(0.0, 1.0)] * size,
                method="SLSQP",
                options={"ftol": 1e-14, "maxiter": 500},
            )
            np.testing.assert_allclose(found, programme.x, atol=1e-5)
            assert (np.diff(found) >= 0.0).all()

    def test_it_is_the_likeliest_of_all_rising_curves(self):
        """No lognormal, log-logistic or Weibull curve has a greater likelihood, nor any other rising one."""
        fit = fit_fragility(BAKER, form="isotonic", replicates=10)
        for form in ("lognormal", "log-logistic", "weibull"):
            assert fit["log_likelihood"].item() > fit_fragility(BAKER, form=form)["log_likelihood"].item()
        rng = np.random.default_rng(2)
        k = BAKER["overturnings"].values
        for _ in range(500):
            p = np.sort(np.clip(fit["probability"].values + 0.02 * rng.standard_normal(8), 1e-9, 1.0 - 1e-9))
            assert np.sum(k * np.log(p) + (40 - k) * np.log1p(-p)) < fit["log_likelihood"].item()
        assert fit["probability"].dims == ("level",)
        assert fit.attrs["form"] == "isotonic"
        assert fit.attrs["intervals"] == "bootstrap"
        assert "dispersion" not in fit

    def test_rising_fractions_are_themselves(self):
        fit = fit_fragility(counts([1.0, 2.0, 3.0], [4, 20, 32]), form="isotonic", replicates=10, fractiles=(0.3,))
        np.testing.assert_allclose(fit["probability"].values, [0.1, 0.5, 0.8])
        assert fit["median"].item() == pytest.approx(2.0, rel=1e-12)
        assert fit["fractile"].item() == pytest.approx(math.sqrt(2.0), rel=1e-12)  # half way in ln x
        pooled = fit_fragility(
            counts([1.0, 2.0, 3.0], [10, 4, 40], np.array([20, 40, 40])), form="isotonic", replicates=9
        )
        np.testing.assert_allclose(pooled["probability"].values, [14 / 60, 14 / 60, 1.0])

    def test_crossings(self):
        levels = np.array([1.0, 2.0, 4.0])
        curves = np.array([[0.0, 0.4, 0.6], [0.6, 0.7, 0.8], [0.1, 0.2, 0.3], [0.5, 0.6, 0.7], [np.nan] * 3])
        np.testing.assert_allclose(crossings(levels, curves, 0.5), [math.sqrt(8.0), 0.0, np.inf, 1.0, np.nan])

    def test_gaps(self):
        """A level without runs lies between its neighbours; none at all is no curve."""
        fit = fit_fragility(counts([1.0, 2.0, 4.0], [8, 0, 16], np.array([40, 0, 40])), form="isotonic", replicates=10)
        np.testing.assert_allclose(fit["probability"].values, [0.2, 0.3, 0.4])
        nothing = fit_fragility(counts([1.0, 2.0], [0, 0], 0), form="isotonic", replicates=10)
        assert nothing["status"].item() == "no runs"
        assert np.isnan(nothing["probability"].values).all()

    @pytest.mark.slow
    def test_the_band_holds_the_truth(self):
        """Pointwise, on clustered runs: 93-97 % where the curve is between 0.1 and 0.9, more at its ends."""
        levels = np.geomspace(0.4, 2.5, 9)
        fit = fit_fragility(clustered(31, 300, 100, levels), form="isotonic", replicates=300)
        truth = ndtr(np.log(levels) / 0.4)
        inside = (fit["probability_lower"].values <= truth + 1e-12) & (truth - 1e-12 <= fit["probability_upper"].values)
        shares = inside.mean(axis=0)
        middle = (truth > 0.1) & (truth < 0.9)
        assert shares[middle].mean() == pytest.approx(0.95, abs=0.025)
        assert (shares > 0.9).all()
        assert (np.diff(fit["probability_lower"].values, axis=1) >= 0.0).all()
        assert (np.diff(fit["probability_upper"].values, axis=1) >= 0.0).all()
        # where nothing overturned the band is not of width 0
        first = fit["probability"].values[:, 0] == 0.0
        assert first.any()
        assert (fit["probability_upper"].values[first, 0] > 0.01).all()


class Probit:
    """A fit of one's own: medians and dispersions by least squares on the probits of smoothed fractions."""

    def __init__(self, levels, overturnings, runs):
        z = ndtri((overturnings + 0.5) / (runs + 1.0))
        slope, offset = np.polyfit(np.log(levels), z, 1)
        if slope <= 0.0:
            raise ValueError("falling")
        self.parameters = {"median": math.exp(-offset / slope), "beta": 1.0 / slope}

    def probability(self, x):
        return ndtr(np.log(x / self.parameters["median"]) / self.parameters["beta"])


class TestOwnFits:
    def test_our_own_likelihood_as_a_callable(self):
        """Binomial maximum likelihood handed in as a fit: the same curve, and percentiles of the same replicates."""

        class Ours:
            def __init__(self, levels, overturnings, runs):
                self.fit = fit_lognormal(levels, overturnings, runs, penalty="auto")
                self.log_likelihood = self.fit.log_likelihood
                self.parameters = {"dispersion": self.fit.dispersion}

            def probability(self, x):
                return ndtr(np.log(x / self.fit.median) / self.fit.dispersion)

        runs = clustered(3, 1, 50, LEVELS).isel(study=0)
        own = fit_fragility(runs, form=Ours, fractiles=(0.1,), replicates=100, keep_replicates=True)
        ours = fit_fragility(runs, fractiles=(0.1,), replicates=100, keep_replicates=True)
        for name in ("median", "fractile", "log_likelihood"):
            np.testing.assert_allclose(own[name].values, ours[name].values, rtol=1e-9)
        np.testing.assert_allclose(own["median_sample"].values, ours["median_sample"].values, rtol=1e-8)
        assert own["parameter_dispersion"].item() == pytest.approx(ours["dispersion"].item(), rel=1e-12)
        ends = np.quantile(ours["dispersion_sample"].values, [0.025, 0.975])
        assert own["parameter_dispersion_lower"].item() == pytest.approx(ends[0], rel=0.02)
        assert own["parameter_dispersion_upper"].item() == pytest.approx(ends[1], rel=0.02)
        assert own["aic"].item() == pytest.approx(2.0 - 2.0 * own["log_likelihood"].item())
        assert own.attrs["form"] == "Ours"
        assert own["probability"].dims == ("level",)

    def test_any_fit_on_any_data(self):
        for data in (BAKER, clustered(4, 2, 40, LEVELS), once(5, np.random.default_rng(5).lognormal(0.0, 0.6, 80))):
            fit = fit_fragility(data, form=Probit, replicates=30)
            assert (fit["status"] == "ok").all()
            assert bool((fit["median_lower"] < fit["median"]).all() & (fit["median"] < fit["median_upper"]).all())
            lower, upper = fit["probability_lower"], fit["probability_upper"]
            assert bool(((lower >= 0.0) & (lower < upper) & (upper <= 1.0)).all())
            assert fit["parameter_beta"].dims == fit["median"].dims
        fit = fit_fragility(BAKER, form=Probit, replicates=30)
        p, k = fit["probability"].values, BAKER["overturnings"].values
        expected = np.sum(np.where(k > 0, k * np.log(p), 0.0) + (40 - k) * np.log1p(-p))
        assert fit["log_likelihood"].item() == pytest.approx(expected)

    def test_replicates_that_fail(self):
        data = counts([1.0, 2.0, 3.0], [3, 4, 5], 10)
        fit = fit_fragility(data, form=Probit, replicates=200)
        assert 5 < fit["failed_replicates"].item() < 100
        assert fit["median_lower"].item() == 0.0 or fit["median_upper"].item() == np.inf
        assert fit["parameter_beta_upper"].item() == np.inf

    def test_what_is_refused(self):
        with pytest.raises(ValueError, match="falling"):  # the caller's own error, on the caller's own data
            fit_fragility(counts([1.0, 2.0, 3.0], [9, 4, 1], 10), form=Probit)
        with pytest.raises(TypeError, match=r"must return an object with \.probability"):
            fit_fragility(BAKER, form=lambda levels, overturnings, runs: 3.0)

        class Wild:
            def __init__(self, *data):
                pass

            def probability(self, x):
                return 2.0 * np.ones_like(x)

        with pytest.raises(ValueError, match="must lie between 0 and 1"):
            fit_fragility(BAKER, form=Wild)

    def test_an_empty_study(self):
        fit = fit_fragility(counts([1.0, 2.0], [[0, 0], [1, 7]], np.array([[0, 0], [9, 9]])), form=Probit, replicates=5)
        assert fit["status"].values.tolist() == ["no runs", "ok"]
        assert np.isnan(fit["median"].values[0])


def test_every_form_by_name():
    """The registry: each fits Baker's stripes or says why not, and carries its name."""
    assert set(FORMS) == {"lognormal", "log-logistic", "weibull", "uplift-lognormal", "isotonic"}
    runs = rocking(9, motions=50)
    for name in FORMS:
        fit = fit_fragility(runs, form=name, replicates=20)
        assert fit.attrs["form"] == name
        assert fit["status"].item() == "ok"
        assert fit["median"].item() == pytest.approx(1.3, rel=0.25)
        for variable in fit.variables:
            assert fit[variable].attrs.get("units") or variable in runs.coords, variable
            assert fit[variable].attrs.get("long_name") or variable in runs.coords, variable
    assert fit_fragility(BAKER)["median"].item() == pytest.approx(BAKER_MEDIAN)
    assert fit_fragility(BAKER)["dispersion"].item() == pytest.approx(BAKER_DISPERSION)


def test_written_and_read_again(tmp_path):
    runs = rocking(10, motions=30)
    for name in FORMS:
        fit = fit_fragility(runs, form=name, fractiles=(0.1, 0.9), replicates=20, keep_replicates=True)
        fit.to_netcdf(tmp_path / f"{name}.nc")
        with xr.open_dataset(tmp_path / f"{name}.nc") as again:
            xr.testing.assert_identical(again.load(), fit)
