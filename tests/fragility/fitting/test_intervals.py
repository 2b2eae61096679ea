"""Intervals of curves: published, solved independently with scipy, and where there is no end."""

import math

import numpy as np
import pytest
import xarray as xr
from fit_cases import BAKER, clustered, counts, objective, profile
from scipy.special import ndtri
from scipy.stats import chi2

from toppling.fragility import fit_fragility
from toppling.fragility.fitting.links import LINKS

ENDS = ("median_lower", "median_upper", "dispersion_lower", "dispersion_upper")


CASES = {
    "baker": (BAKER["level"].values, BAKER["overturnings"].values, np.full(8, 40), "lognormal"),
    "log-logistic": (BAKER["level"].values, BAKER["overturnings"].values, np.full(8, 40), "log-logistic"),
    "weibull": (BAKER["level"].values, BAKER["overturnings"].values, np.full(8, 40), "weibull"),
    "uneven": (
        np.array([0.5, 0.7, 1.1, 1.3, 2.0]),
        np.array([0, 2, 5, 30, 9]),
        np.array([9, 20, 12, 40, 9]),
        "lognormal",
    ),
}


class TestSeparated:
    """Any step between the highest level that stood and the lowest that fell explains the data as well as can be."""

    LEVELS = (1.0, 1.4, 2.0, 2.2, 4.0)

    @pytest.mark.slow
    @pytest.mark.parametrize(
        ("form", "intervals"),
        [(form, kind) for form in LINKS for kind in ("wald", "profile", "bootstrap")] + [("isotonic", "bootstrap")],
    )
    def test_intervals_of_levels_hold_the_gap(self, form, intervals):
        for first in range(1, 5):
            fallen = np.where(np.arange(5) < first, 0, 40)
            fit = fit_fragility(counts(self.LEVELS, fallen), form=form, intervals=intervals, fractiles=(0.16, 0.84))
            low, high = self.LEVELS[first - 1] * (1.0 + 1e-12), self.LEVELS[first] * (1.0 - 1e-12)
            assert fit["median_lower"].item() <= low < fit["median"].item() < high <= fit["median_upper"].item()
            assert (fit["fractile_lower"].values <= low).all()
            assert (fit["fractile_upper"].values >= high).all()

    @pytest.mark.parametrize("method", ["binomial", "first-overturning"])
    def test_a_known_step(self, method):
        """All motions take the block over at one level, wherever that lies between two of those run."""
        levels = np.array(self.LEVELS)
        for step in (1.41, 1.7, 1.99):
            fell = np.broadcast_to((levels > step)[:, None], (5, 30))
            runs = xr.Dataset({"overturned": (("level", "motion"), fell)}, coords={"level": levels})
            fit = fit_fragility(runs, method=method)
            assert fit["status"].item() == "separated"
            assert fit["median_lower"].item() < step < fit["median_upper"].item()
            assert fit["median_lower"].item() == pytest.approx(1.4, rel=1e-12)
            assert fit["median_upper"].item() == pytest.approx(2.0, rel=1e-12)

    def test_a_level_with_both_outcomes_leaves_no_gap(self):
        """The profile alone bounds the median there."""
        fit = fit_fragility(counts(self.LEVELS, [0, 0, 20, 40, 40]))
        assert fit["status"].item() == "separated"
        assert 1.4 < fit["median_lower"].item() < 2.0 < fit["median_upper"].item() < 2.2


class TestProfile:
    def test_published(self):
        """Baker (2015): θ 0.9642-1.3070, β 0.3018-0.6500."""
        fit = fit_fragility(BAKER)
        assert fit.attrs["intervals"] == "profile"
        np.testing.assert_allclose([fit[end].item() for end in ENDS], [0.9642, 1.3070, 0.3018, 0.6500], atol=5e-5)

    @pytest.mark.parametrize("confidence", [0.5, 0.95, 0.999])
    @pytest.mark.parametrize("name", CASES)
    def test_the_deviance_at_the_ends(self, name, confidence):
        """Twice the fall of an independently computed profile is chi-square's quantile, to 1e-8."""
        levels, k, n, form = CASES[name]
        link = LINKS[form]
        fit = fit_fragility(counts(levels, k, n), confidence, form=form, fractiles=(0.05, 0.5, 0.9))
        loss = objective(link, np.log(levels), k, n)
        best = -fit["log_likelihood"].item()
        quantile = chi2.ppf(confidence, 1)
        for p, lower, upper in [
            (None, fit["dispersion_lower"], fit["dispersion_upper"]),
            (0.5, fit["median_lower"], fit["median_upper"]),
            *((p, fit["fractile_lower"].sel(fraction=p), fit["fractile_upper"].sel(fraction=p)) for p in (0.05, 0.9)),
        ]:
            for end in (lower.item(), upper.item()):
                if np.isinf(end):
                    assert confidence == 0.999
                    continue
                fall = 2.0 * (profile(loss, link, p, math.log(end)) - best)
                assert fall == pytest.approx(quantile, abs=1e-8)
        assert fit["fractile_upper"].sel(fraction=0.5).item() == pytest.approx(fit["median_upper"].item(), rel=1e-10)

    def test_penalised(self):
        """Separated data: the profile of the penalised likelihood, both ends solved with scipy."""
        link = LINKS["lognormal"]
        levels, k, n = np.array([1.0, 2.0, 3.0, 4.0]), np.array([0, 0, 17, 40]), np.full(4, 40)
        for intervals in ("profile", "wald", "bootstrap"):
            fit = fit_fragility(counts(levels, k, n), intervals=intervals)
            assert fit["status"].item() == "separated"
            assert bool(fit["penalised"])
            assert bool(fit["converged"])
            loss = objective(link, np.log(levels), k, n, penalised=True)
            log_median, log_dispersion = np.log(fit["median"].item()), np.log(fit["dispersion"].item())
            b = math.exp(-log_dispersion)
            best = loss(-b * log_median, b)
            for end in ENDS:
                p = 0.5 if end.startswith("median") else None
                fall = 2.0 * (profile(loss, link, p, math.log(fit[end].item())) - best)
                assert fall == pytest.approx(chi2.ppf(0.95, 1), abs=1e-5)
        # the median lies between the levels that bracket it, the dispersion is bounded above
        assert 2.0 < fit["median_lower"].item() < 3.0 < fit["median"].item() < fit["median_upper"].item() < 4.0
        assert 0.0 < fit["dispersion_lower"].item() < fit["dispersion"].item() < fit["dispersion_upper"].item() < 1.0

    def test_first_overturnings(self):
        link = LINKS["lognormal"]
        levels = np.geomspace(0.4, 2.0, 7)
        runs = clustered(2, 1, 60, levels).isel(study=0)
        fit = fit_fragility(runs, method="first-overturning", fractiles=(0.1,))
        assert fit.attrs["intervals"] == "profile"
        flags = runs["overturned"].values
        k = np.bincount(np.where(flags.any(axis=0), flags.argmax(axis=0), 7), minlength=8)
        loss = objective(link, np.log(levels), k, None, first=True)
        best = -fit["log_likelihood"].item()
        ends = [(0.5, "median"), (None, "dispersion"), (0.1, "fractile")]
        for p, name in ends:
            for end in ("lower", "upper"):
                fall = 2.0 * (profile(loss, link, p, math.log(fit[f"{name}_{end}"].item())) - best)
                assert fall == pytest.approx(chi2.ppf(0.95, 1), abs=1e-8)

    def test_data_that_leave_an_end_open(self):
        """Where a level curve is likely enough, the dispersion has no upper end and the median none on one side."""
        flat = fit_fragility(counts([1.0, 2.0, 4.0], [19, 20, 21]))
        assert flat["status"].item() == "ok"
        assert flat["dispersion_upper"].item() == np.inf
        assert (flat["median_lower"].item(), flat["median_upper"].item()) == (0.0, np.inf)
        rare = fit_fragility(counts([1.0, 2.0, 4.0], [1, 1, 3]), fractiles=(0.02,))
        assert rare["median_upper"].item() == np.inf
        assert 4.0 < rare["median_lower"].item() < rare["median"].item()
        assert rare["fractile_lower"].item() == 0.0
        # the limit itself: where its deviance passes the quantile, the end becomes finite
        link, x, k = LINKS["lognormal"], np.log([1.0, 2.0, 4.0]), np.array([1, 1, 3])
        loss = objective(link, x, k, 40)
        level = 2.0 * (loss(link.quantile(5 / 120), 0.0) + rare["log_likelihood"].item())
        for confidence, finite in ((chi2.cdf(level * 0.999, 1), True), (chi2.cdf(level * 1.001, 1), False)):
            fit = fit_fragility(counts([1.0, 2.0, 4.0], k), float(confidence))
            assert np.isfinite(fit["dispersion_upper"].item()) == finite


class TestWald:
    def test_fractiles_by_the_delta_method(self):
        """ln x_p = ln median + z_p dispersion: its variance from the covariance of both, by numerical derivatives."""
        fit = fit_fragility(BAKER, intervals="wald", fractiles=(0.1, 0.5, 0.9))
        x, k = np.log(BAKER["level"].values), BAKER["overturnings"].values
        loss = objective(LINKS["lognormal"], x, k, 40)

        def of(log_median, dispersion):
            return loss(-log_median / dispersion, 1.0 / dispersion)

        at = np.array([np.log(fit["median"].item()), fit["dispersion"].item()])
        h = 1e-4
        hessian = np.empty((2, 2))
        for i in range(2):
            for j in range(2):
                e, f = h * np.eye(2)[i], h * np.eye(2)[j]
                hessian[i, j] = (of(*(at + e + f)) - of(*(at + e - f)) - of(*(at - e + f)) + of(*(at - e - f))) / (
                    4 * h * h
                )
        covariance = np.linalg.inv(hessian)
        for p in (0.1, 0.5, 0.9):
            gradient = np.array([1.0, ndtri(p)])
            value = at @ gradient
            half = 1.959963984540054 * math.sqrt(gradient @ covariance @ gradient)
            one = fit.sel(fraction=p)
            assert one["fractile"].item() == pytest.approx(math.exp(value), rel=1e-10)
            assert one["fractile_lower"].item() == pytest.approx(math.exp(value - half), rel=1e-5)
            assert one["fractile_upper"].item() == pytest.approx(math.exp(value + half), rel=1e-5)
        assert fit["median_lower"].item() == pytest.approx(
            fit["median"].item() * math.exp(-1.959963984540054 * fit["median_se"].item() / fit["median"].item())
        )

    def test_errors_of_an_ida_are_summed_over_motions(self):
        """Every motion twice: the counts double, the errors stay; naive ones fall by sqrt 2."""
        levels = np.geomspace(0.3, 3.0, 12)
        runs = clustered(3, 1, 80, levels).isel(study=0)
        twice = xr.concat([runs, runs], "motion").assign_coords(motion=np.concatenate([runs["motion"].values] * 2))
        one, two = fit_fragility(runs, intervals="wald"), fit_fragility(twice, intervals="wald")
        for name in ("median", "median_se", "median_lower", "dispersion_se", "dispersion_upper"):
            assert two[name].item() == pytest.approx(one[name].item(), rel=1e-9)
        naive = [
            fit_fragility(
                counts(levels, data["overturned"].sum("motion").values, data.sizes["motion"]), intervals="wald"
            )
            for data in (runs, twice)
        ]
        for name in ("median_se", "dispersion_se"):
            assert naive[1][name].item() == pytest.approx(naive[0][name].item() / math.sqrt(2.0), rel=1e-9)
            assert one[name].item() > 1.3 * naive[0][name].item()

    def test_the_sandwich_written_out(self):
        """Scores by numerical differentiation of each motion's own log-likelihood."""
        levels = np.geomspace(0.3, 3.0, 10)
        runs = clustered(4, 1, 60, levels, noise=0.2).isel(study=0)
        fit = fit_fragility(runs, intervals="wald")
        x, flags = np.log(levels), runs["overturned"].values
        link = LINKS["lognormal"]
        at = np.array([np.log(fit["median"].item()), np.log(fit["dispersion"].item())])

        def own(parameters, fell):
            eta = (x - parameters[0]) / math.exp(parameters[1])
            return np.sum(np.where(fell, np.log(link.cumulative(eta)), np.log(link.cumulative(-eta))))

        h = 1e-5
        steps = h * np.eye(2)
        scores = np.array([[(own(at + e, m) - own(at - e, m)) / (2 * h) for e in steps] for m in flags.T])
        h = 1e-3
        steps = h * np.eye(2)
        whole = lambda q: sum(own(q, m) for m in flags.T)  # noqa: E731
        hessian = np.array(
            [
                [
                    (whole(at + e + f) - whole(at + e - f) - whole(at - e + f) + whole(at - e - f)) / (4 * h * h)
                    for f in steps
                ]
                for e in steps
            ]
        )
        inverse = np.linalg.inv(-hessian)
        covariance = inverse @ (scores.T @ scores) @ inverse * 60 / 59
        assert fit["median_se"].item() / fit["median"].item() == pytest.approx(math.sqrt(covariance[0, 0]), rel=1e-4)
        assert fit["dispersion_se"].item() / fit["dispersion"].item() == pytest.approx(
            math.sqrt(covariance[1, 1]), rel=1e-4
        )


class TestNoCurve:
    def test_no_overturning_bounds_the_median(self):
        """All of 40 standing at 4: a median at or below 4 had a chance of 2^-40; five runs are enough for 95 %."""
        fit = fit_fragility(counts([1.0, 2.0, 4.0], [0, 0, 0]))
        assert fit["status"].item() == "no overturning"
        assert np.isnan([fit[name].item() for name in ("median", "dispersion", "dispersion_upper", "median_se")]).all()
        assert (fit["median_lower"].item(), fit["median_upper"].item()) == (4.0, np.inf)
        assert not bool(fit["converged"])
        few = fit_fragility(counts([1.0, 2.0, 4.0], [0, 0, 0], np.array([3, 3, 3])))
        assert few["median_lower"].item() == 2.0  # three runs at 4 and three at 2
        assert np.isnan(fit_fragility(counts([1.0, 2.0], [0, 0], np.array([2, 2])))["median_lower"].item())
        five = fit_fragility(counts([1.0, 2.0, 4.0], [0, 0, 0], np.array([40, 40, 5])))
        assert five["median_lower"].item() == 4.0
        at_99 = fit_fragility(counts([1.0, 2.0, 4.0], [0, 0, 0], np.array([40, 40, 5])), 0.99)
        assert at_99["median_lower"].item() == 2.0

    def test_all_overturned_is_its_mirror(self):
        fit = fit_fragility(counts([1.0, 2.0, 4.0], [40, 40, 40]))
        assert fit["status"].item() == "all overturned"
        assert np.isnan(fit["median"].item())
        assert (fit["median_lower"].item(), fit["median_upper"].item()) == (0.0, 1.0)

    def test_motions_count_once(self):
        """Four motions at three levels, none falls: twelve runs, but four that are independent."""
        for motions, bound in ((4, np.nan), (5, 3.0)):
            flags = np.zeros((3, motions), bool)
            runs = xr.Dataset({"overturned": (("level", "motion"), flags)}, coords={"level": [1.0, 2.0, 3.0]})
            for method in ("binomial", "first-overturning"):
                found = fit_fragility(runs, method=method)
                assert found["status"].item() == "no overturning"
                np.testing.assert_array_equal(found["median_lower"].item(), bound)

    @pytest.mark.parametrize("penalty", ["none", "auto", "firth"])
    def test_penalties(self, penalty):
        separated = fit_fragility(counts([1.0, 2.0, 3.0, 4.0], [0, 0, 40, 40]), penalty=penalty)
        assert separated["status"].item() == "separated"
        assert bool(separated["penalised"]) == bool(separated["converged"]) == (penalty != "none")
        assert np.isfinite(separated["median"].item()) == (penalty != "none")
        if penalty != "none":
            assert separated["median"].item() == pytest.approx(math.sqrt(6.0), rel=0.05)
            assert 0.0 < separated["dispersion_upper"].item() < 0.5
        overlapping = fit_fragility(BAKER, penalty=penalty)
        assert bool(overlapping["penalised"]) == (penalty == "firth")
        assert overlapping["status"].item() == "ok"
        for overturnings, status in (([0, 0, 0, 0], "no overturning"), ([40, 40, 3, 0], "not increasing")):
            nothing = fit_fragility(counts([1.0, 2.0, 3.0, 4.0], overturnings), penalty=penalty)
            assert nothing["status"].item() == status
            assert np.isnan(nothing["median"].item())
            assert not bool(nothing["penalised"])

    @pytest.mark.slow
    def test_the_penalty_takes_out_bias(self):
        """Small stripes: ln(dispersion) is nearer to the truth with Jeffreys' prior always on."""
        levels = np.geomspace(0.5, 2.0, 5)
        rng = np.random.default_rng(2)
        k = rng.binomial(8, LINKS["lognormal"].cumulative(np.log(levels) / 0.4), (2000, 5))
        plain, firth = (fit_fragility(counts(levels, k, 8), intervals="wald", penalty=p) for p in ("auto", "firth"))
        ok = (plain["status"] == "ok").values
        errors = [np.mean(1.0 / fit["dispersion"].values[ok]) - 2.5 for fit in (plain, firth)]
        assert abs(errors[1]) < 0.5 * abs(errors[0])
