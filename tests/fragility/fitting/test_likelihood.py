"""Likelihoods and their maxima: 40 digits, statsmodels, lifelines and scipy as independent oracles."""

import math

import mpmath
import numpy as np
import pytest
import xarray as xr
from fit_cases import BAKER, BAKER_DISPERSION, BAKER_MEDIAN, clustered, counts, once
from lognormal import fit_lognormal
from scipy.optimize import minimize
from scipy.special import expit, log_ndtr, logit, ndtr, ndtri

from toppling.fragility import fit_fragility
from toppling.fragility.fitting.links import LINKS
from toppling.fragility.kernels import binomial as engine

pytestmark = pytest.mark.lowest

DIGITS = 50


def exact(link, eta):
    """(F, 1 - F) to 50 digits."""
    if link == engine.PROBIT:
        return mpmath.erfc(-eta / mpmath.sqrt(2)) / 2, mpmath.erfc(eta / mpmath.sqrt(2)) / 2
    if link == engine.LOGIT:
        return 1 / (1 + mpmath.exp(-eta)), 1 / (1 + mpmath.exp(eta))
    return -mpmath.expm1(-mpmath.exp(eta)), mpmath.exp(-mpmath.exp(eta))


class TestTails:
    @pytest.mark.parametrize("link", [engine.PROBIT, engine.LOGIT, engine.CLOGLOG])
    def test_against_fifty_digits(self, link):
        """ln F, ln(1 - F), the hazards and the slope of the density, to 1e-13 in both tails."""
        ends = (-38.5, 38.5) if link != engine.CLOGLOG else (-38.5, 6.5)
        rng = np.random.default_rng(1)
        points = np.concatenate(
            [np.linspace(*ends, 78), rng.uniform(*ends, 60), rng.uniform(-4, 4, 60), [-3.0, 3.0, 0.0]]
        )
        if link != engine.CLOGLOG:
            points = np.concatenate([points, [-600.0, -200.0, 200.0]])
        with mpmath.workdps(DIGITS):
            for eta in points:
                x = mpmath.mpf(float(eta))
                p, q = exact(link, x)
                if link == engine.PROBIT:
                    f, r, dr = mpmath.npdf(x), -x, mpmath.mpf(-1)
                elif link == engine.LOGIT:
                    f, r, dr = p * q, q - p, -2 * p * q
                else:
                    f, r, dr = mpmath.exp(x - mpmath.exp(x)), 1 - mpmath.exp(x), -mpmath.exp(x)
                expected = (mpmath.log(p), mpmath.log(q), mpmath.log(f), f / p, f / q, r, dr)
                found = engine.tails(float(eta), link)
                for name, one, other in zip(
                    ("ln F", "ln 1-F", "ln f", "f/F", "f/(1-F)"), found, expected, strict=False
                ):
                    if abs(other) < 1e-300:
                        continue
                    assert one == pytest.approx(float(other), rel=1e-13), (name, eta)
                assert found[5] == pytest.approx(float(r), rel=1e-12, abs=1e-15)
                assert found[6] == pytest.approx(float(dr), rel=1e-12, abs=1e-300)

    def test_against_scipy(self):
        eta = np.linspace(-1e4, 20.0, 20011)  # (further up scipy's is right to 2e-13 only)
        for sign, part in ((1.0, 0), (-1.0, 1)):
            found = [engine.tails(sign * x, engine.PROBIT)[part] for x in eta]
            np.testing.assert_allclose(found, log_ndtr(eta), rtol=1e-13, atol=1e-300)

    def test_the_probit_by_polynomials(self):
        """To 1e-14 against fifty digits: in the middle of nodes, where the error is largest, at them, and anywhere."""
        nodes = np.linspace(-engine.EDGE, engine.EDGE, 2 * engine.EDGE * engine.NODES + 1)
        middles = 0.5 * (nodes[1:] + nodes[:-1])
        points = np.concatenate([nodes[1:-1], middles, np.random.default_rng(2).uniform(-4.0, 4.0, 200)])
        with mpmath.workdps(DIGITS):
            for eta in points:
                x = mpmath.mpf(float(eta))
                p, q, f = mpmath.ncdf(x), mpmath.ncdf(-x), mpmath.npdf(x)
                found = engine.near_probit(float(eta))
                expected = (mpmath.log(p), mpmath.log(q), mpmath.log(f), f / p, f / q, -x, mpmath.mpf(-1))
                np.testing.assert_allclose(found, [float(one) for one in expected], rtol=1e-14, atol=0.0)

    def test_links_are_what_the_engine_computes(self):
        eta = np.linspace(-5.0, 2.0, 29)
        for link in LINKS.values():
            found = [engine.tails(x, link.code)[0] for x in eta]
            np.testing.assert_allclose(np.exp(found), link.cumulative(eta), rtol=1e-13)
            np.testing.assert_allclose(link.quantile(link.cumulative(eta)), eta, rtol=1e-9)


def mp_objective(kind, link, z, k, n, penalised):
    """The objective in 50 digits, written from its definition."""

    def objective(a, b):
        p = [exact(link, a + b * zi) for zi in z]
        value = mpmath.mpf(0)
        if kind == engine.BINOMIAL:
            for (up, down), ki, ni in zip(p, k, n, strict=True):
                value += ki * mpmath.log(up) + (ni - ki) * mpmath.log(down)
        else:
            cumulative = [mpmath.mpf(0), *(up for up, _ in p), mpmath.mpf(1)]
            for j, kj in enumerate(k):
                value += kj * mpmath.log(cumulative[j + 1] - cumulative[j])
        if penalised:
            weights = []
            for zi, (up, down), ni in zip(z, p, n, strict=True):
                f = mpmath.diff(lambda e: exact(link, e)[0], a + b * zi)
                weights.append(ni * f**2 / (up * down))
            s0 = sum(weights)
            s1 = sum(w * zi for w, zi in zip(weights, z, strict=True))
            s2 = sum(w * zi**2 for w, zi in zip(weights, z, strict=True))
            value += mpmath.log(s0 * s2 - s1**2) / 2
        return value

    return objective


@pytest.mark.parametrize("penalised", [False, True])
@pytest.mark.parametrize("kind", [engine.BINOMIAL, engine.INTERVAL])
@pytest.mark.parametrize("link", [engine.PROBIT, engine.LOGIT, engine.CLOGLOG])
def test_derivatives_against_fifty_digits(link, kind, penalised):
    """Value, gradient and Hessian of the objective, penalty included."""
    z = np.array([-0.5, -0.2, 0.1, 0.5])
    n = np.array([20.0, 20.0, 20.0, 20.0])
    k = np.array([0.0, 3.0, 9.0, 20.0]) if kind == engine.BINOMIAL else np.array([1.0, 2.0, 9.0, 7.0, 1.0])
    a, b = -0.3, 2.7
    found = engine.evaluate(kind, link, a, b, z, k, n, penalised, np.zeros((engine.SCRATCH, z.size)))
    with mpmath.workdps(DIGITS):
        f = mp_objective(kind, link, [mpmath.mpf(float(one)) for one in z], k.tolist(), n.tolist(), penalised)
        at = (mpmath.mpf(a), mpmath.mpf(b))
        expected = [f(*at)] + [mpmath.diff(f, at, order) for order in ((1, 0), (0, 1))]
        expected += [-mpmath.diff(f, at, order) for order in ((2, 0), (1, 1), (0, 2))]
    np.testing.assert_allclose((found[0], *found[2:7]), [float(one) for one in expected], rtol=1e-11)
    assert found[1] == pytest.approx(float(mp_objective(kind, link, list(map(float, z)), k, n, False)(a, b)), rel=1e-12)


class TestMaximum:
    def test_baker_2015(self):
        fit = fit_fragility(BAKER, intervals="wald")
        assert fit["median"].item() == pytest.approx(BAKER_MEDIAN, rel=1e-13)
        assert fit["dispersion"].item() == pytest.approx(BAKER_DISPERSION, rel=1e-13)
        assert fit["median_se"].item() / fit["median"].item() == pytest.approx(0.07166, abs=6e-6)
        assert fit["dispersion_se"].item() == pytest.approx(0.08387, abs=6e-6)
        direct = fit_lognormal(BAKER["level"].values, BAKER["overturnings"].values, BAKER["runs"].values)
        assert (direct.median, direct.dispersion) == (fit["median"].item(), fit["dispersion"].item())
        assert direct.log_median_se == pytest.approx(fit["median_se"].item() / fit["median"].item(), rel=1e-14)

    @pytest.mark.slow
    @pytest.mark.parametrize("form", ["lognormal", "log-logistic", "weibull"])
    def test_against_statsmodels(self, form):
        """Estimates, observed-information errors and likelihoods of 40 random sets of stripes."""
        sm = pytest.importorskip("statsmodels.api")
        links = sm.families.links
        family = {"lognormal": links.Probit, "log-logistic": links.Logit, "weibull": links.CLogLog}[form]
        link = LINKS[form]
        rng = np.random.default_rng(4)
        levels = np.geomspace(0.1, 3.0, 12)
        compared = 0
        for _ in range(40):
            median, dispersion, n = rng.uniform(0.3, 1.5), rng.uniform(0.15, 0.8), int(rng.integers(15, 300))
            k = rng.binomial(n, ndtr(np.log(levels / median) / dispersion))
            fit = fit_fragility(counts(levels, k, n), form=form, intervals="wald")
            if fit["status"].item() != "ok":
                continue
            compared += 1
            x = np.log(levels)
            glm = sm.GLM(
                np.stack([k, n - k], axis=1),
                np.stack([np.ones_like(x), x], axis=1),
                family=sm.families.Binomial(family()),
            )
            other = glm.fit(tol=1e-15, maxiter=200)
            a, b = other.params
            log_median = (link.quantile(0.5) - a) / b
            assert np.log(fit["median"].item()) == pytest.approx(log_median, abs=1e-7)
            assert fit["dispersion"].item() == pytest.approx(link.scale / b, rel=1e-7)
            covariance = np.linalg.inv(-glm.hessian(other.params, observed=True))
            gradient = np.array([-1.0 / b, -log_median / b])
            error = math.sqrt(gradient @ covariance @ gradient)
            assert fit["median_se"].item() / fit["median"].item() == pytest.approx(error, rel=1e-5)
            assert fit["dispersion_se"].item() / fit["dispersion"].item() == pytest.approx(
                math.sqrt(covariance[1, 1]) / b, rel=1e-5
            )
        assert compared >= 30

    def test_cloud_against_statsmodels(self):
        """Each motion once at its own intensity: the binary probit."""
        sm = pytest.importorskip("statsmodels.api")
        runs = once(3, np.random.default_rng(30).lognormal(0.0, 0.7, 300))
        fit = fit_fragility(runs, intervals="wald")
        x = np.log(runs["intensity"].values)
        family = sm.families.Binomial(sm.families.links.Probit())
        model = sm.GLM(runs["overturned"].values.astype(float), sm.add_constant(x), family=family)
        other = model.fit(tol=1e-14, maxiter=200)
        a, b = other.params
        errors = np.sqrt(np.diag(np.linalg.inv(-model.hessian(other.params, observed=True))))
        assert fit["median"].item() == pytest.approx(math.exp(-a / b), rel=1e-9)
        assert fit["dispersion"].item() == pytest.approx(1.0 / b, rel=1e-9)
        assert fit["dispersion_se"].item() == pytest.approx(errors[1] / b**2, rel=1e-6)
        assert fit["log_likelihood"].item() == pytest.approx(other.llf, rel=1e-12)
        assert fit["median"].attrs["units"] == "m s-1"
        assert fit.attrs["im"] == "pgv"

    @pytest.mark.filterwarnings("ignore::DeprecationWarning")
    @pytest.mark.filterwarnings("ignore::FutureWarning")
    def test_first_overturnings_against_lifelines(self):
        lifelines = pytest.importorskip("lifelines")
        levels = np.geomspace(0.3, 2.5, 9)
        for seed, noise in ((1, 0.0), (2, 0.2)):
            runs = clustered(seed, 1, 150, levels, noise=noise).isel(study=0)
            fit = fit_fragility(runs, method="first-overturning", intervals="wald")
            flags = runs["overturned"].values
            first = np.where(flags.any(axis=0), flags.argmax(axis=0), levels.size)
            lower = np.concatenate([[0.0], levels])[first]
            upper = np.concatenate([levels, [np.inf]])[first]
            other = lifelines.LogNormalFitter().fit_interval_censoring(lower, upper)
            # lifelines stops its search early, a little below our maximum
            assert fit["median"].item() == pytest.approx(math.exp(other.mu_), rel=2e-5)
            assert fit["dispersion"].item() == pytest.approx(other.sigma_, rel=2e-4)
            assert fit["log_likelihood"].item() == pytest.approx(other.log_likelihood_, rel=1e-8)
            assert fit["log_likelihood"].item() >= other.log_likelihood_ - 1e-9
            errors = other.summary["se(coef)"]
            assert fit["median_se"].item() / fit["median"].item() == pytest.approx(errors["mu_"], rel=1e-3)
            assert fit["dispersion_se"].item() == pytest.approx(errors["sigma_"], rel=1e-3)

    @pytest.mark.parametrize("form", ["lognormal", "log-logistic", "weibull"])
    def test_penalised_against_scipy(self, form):
        """Jeffreys' prior on separated and on overlapping data, maximised without derivatives."""
        link = LINKS[form]
        levels = np.array([1.0, 2.0, 3.0, 4.0])
        x = np.log(levels)
        for fell, n, penalty in (
            ([0, 0, 40, 40], 40, "auto"),
            ([0, 0, 3, 10], 10, "auto"),
            ([0, 4, 7, 10], 10, "firth"),
        ):
            k = np.array(fell)

            def loss(parameters, k=k, n=n):
                a, b = parameters
                eta = a + b * x
                p = link.cumulative(eta)
                q = {"lognormal": ndtr(-eta), "log-logistic": expit(-eta), "weibull": np.exp(-np.exp(eta))}[form]
                density = {
                    "lognormal": np.exp(-0.5 * eta**2) / math.sqrt(2 * math.pi),
                    "log-logistic": p * q,
                    "weibull": np.exp(eta) * q,
                }[form]
                with np.errstate(divide="ignore", invalid="ignore"):
                    weight = np.where(p * q > 0.0, n * density**2 / (p * q), 0.0)
                    value = np.where(k > 0, k * np.log(p), 0.0) + np.where(k < n, (n - k) * np.log(q), 0.0)
                    s0, s1, s2 = (np.sum(weight * x**i) for i in range(3))
                    total = value.sum() + 0.5 * np.log(s0 * s2 - s1**2)
                return -total if np.isfinite(total) else 1e10

            other = minimize(
                loss, [-2.0, 2.0], method="Nelder-Mead", options={"xatol": 1e-11, "fatol": 1e-13, "maxiter": 5000}
            )
            fit = fit_fragility(counts(levels, k, n), form=form, penalty=penalty)
            a, b = other.x
            assert fit["median"].item() == pytest.approx(math.exp((link.quantile(0.5) - a) / b), rel=1e-5)
            assert fit["dispersion"].item() == pytest.approx(link.scale / b, rel=1e-4)
            assert bool(fit["penalised"])
            assert fit["status"].item() == ("ok" if penalty == "firth" else "separated")

    def test_units_and_order_do_not_matter(self):
        """Levels times c: medians times c, dispersions as they were; levels in any order, split or with gaps."""
        scaled = BAKER.assign_coords(level=9.80665 * BAKER["level"])
        for options in ({}, {"penalty": "firth"}, {"form": "weibull"}, {"intervals": "wald"}):
            one, other = (fit_fragility(data, fractiles=(0.1,), **options) for data in (BAKER, scaled))
            for name in ("median", "median_lower", "median_upper", "median_se", "fractile", "fractile_upper"):
                np.testing.assert_allclose(other[name], 9.80665 * one[name], rtol=1e-11)
            for name in ("dispersion", "dispersion_lower", "dispersion_upper", "log_likelihood"):
                np.testing.assert_allclose(other[name], one[name], rtol=1e-11)

    def test_a_weibull_curve_is_one(self):
        """Counts drawn from 1 - exp(-(x/scale)^shape) give it back, and its median and dispersion."""
        shape, scale = 3.0, 2.0
        levels = np.geomspace(0.5, 4.0, 30)
        runs = 200_000
        k = np.rint(runs * -np.expm1(-((levels / scale) ** shape))).astype(int)
        fit = fit_fragility(counts(levels, k, runs), form="weibull", fractiles=(1.0 - math.exp(-1.0),))
        assert fit["fractile"].item() == pytest.approx(scale, rel=1e-4)
        assert fit["median"].item() == pytest.approx(scale * math.log(2.0) ** (1.0 / shape), rel=1e-4)
        assert fit["dispersion"].item() == pytest.approx(math.pi / math.sqrt(6.0) / shape, rel=1e-3)

    def test_log_logistic_odds(self):
        odds = np.array([0.1, 0.5, 1.0, 2.0, 10.0])
        levels = 2.0 * odds ** (1.0 / 4.0)
        runs = 1_000_000
        fit = fit_fragility(counts(levels, np.rint(runs * odds / (1.0 + odds)).astype(int), runs), form="log-logistic")
        assert fit["median"].item() == pytest.approx(2.0, rel=1e-5)
        assert fit["dispersion"].item() == pytest.approx(math.pi / math.sqrt(3.0) / 4.0, rel=1e-5)
        assert logit(0.5) == ndtri(0.5) == 0.0

    def test_near_separation_is_found(self):
        """One fall below one survival in 2,000: finite, and where scipy finds it."""
        levels = np.array([1.0, 1.1, 1.2, 1.3])
        k, n = np.array([0, 1, 999, 1000]), 1000
        fit = fit_fragility(counts(levels, k, n))
        assert fit["status"].item() == "ok"
        x = np.log(levels)

        def loss(parameters):
            eta = (x - parameters[0]) / math.exp(parameters[1])
            return -np.sum(k * log_ndtr(eta) + (n - k) * log_ndtr(-eta))

        other = minimize(loss, [math.log(1.15), -4.0], method="Nelder-Mead", options={"xatol": 1e-12, "fatol": 1e-14})
        assert fit["median"].item() == pytest.approx(math.exp(other.x[0]), rel=1e-7)
        assert fit["dispersion"].item() == pytest.approx(math.exp(other.x[1]), rel=1e-5)


def test_levels_of_runs_in_any_order():
    runs = clustered(8, 1, 40, np.geomspace(0.4, 2.5, 8), noise=0.2).isel(study=0)
    shuffled = runs.isel(level=[5, 0, 7, 2, 1, 6, 3, 4])
    for method in ("binomial", "first-overturning"):
        one, other = (fit_fragility(data, method=method, replicates=30) for data in (runs, shuffled))
        xr.testing.assert_equal(one, other)


def test_grouped_flags_and_counts_are_one_likelihood():
    runs = clustered(7, 3, 50, np.geomspace(0.4, 2.5, 8))
    found = runs["overturned"].sum("motion").to_dataset(name="overturnings").assign(runs=("level", np.full(8, 50)))
    one, other = fit_fragility(runs), fit_fragility(found)
    for name in ("median", "dispersion", "log_likelihood"):
        xr.testing.assert_equal(one[name], other[name])
