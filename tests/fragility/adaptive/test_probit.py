"""Probit fits of runs at levels of their own: against the compiled fits, numbers of the definition, and simulation."""

import math

import numpy as np
import pytest
import scipy
import xarray as xr
from lognormal import fit_lognormal

from toppling.fragility import fit_fragility, wilson_interval
from toppling.fragility.adaptive.probit import (
    Estimate,
    Observations,
    difference,
    enclosing,
    fit_probit,
    local_probit,
    student,
)


def runs(motions, each=4, correlation=0.5, seed=0, median=2.0, dispersion=0.4, spread=0.6):
    """Runs at normal levels about the median, verdicts of a motion correlated."""
    random = np.random.default_rng(seed)
    x = math.log(median) + spread * random.standard_normal((each, motions))
    noise = math.sqrt(correlation) * random.standard_normal(motions)
    score = noise + math.sqrt(1.0 - correlation) * random.standard_normal((each, motions))
    fell = x > math.log(median) + dispersion * score
    return Observations(x.ravel(), fell.ravel(), np.tile(np.arange(motions), each))


def test_estimates_are_those_of_the_fit_to_counts():
    seen = runs(60)
    found, status = fit_probit(seen)
    n = np.ones(seen.x.size, np.int64)
    expected = fit_lognormal(np.exp(seen.x), seen.fell.astype(np.int64), n)
    assert status == expected.status == "ok"
    assert math.exp(found.log_median) == pytest.approx(expected.median, rel=1e-9)
    assert found.dispersion == pytest.approx(expected.dispersion, rel=1e-9)


def test_errors_are_the_sandwich_of_the_compiled_fits():
    """The same estimate from scores of levels summed by pattern; each error no less than that of independent runs."""
    seen = runs(80, correlation=0.95, seed=3)
    data = xr.Dataset(
        {
            "run_block": ("run", np.zeros(seen.x.size, int)),
            "run_model": ("run", np.zeros(seen.x.size, int)),
            "run_motion": ("run", seen.motion),
            "level": ("run", np.exp(seen.x), {"units": "m s-2", "im": "pga"}),
            "overturned": ("run", seen.fell),
        },
        coords={
            **{"block": ["a"], "model": ["b"], "motion": [f"m{i}" for i in range(80)]},
            **{f"{dim}_number": (dim, np.arange(n)) for dim, n in (("block", 1), ("model", 1), ("motion", 80))},
        },
    )
    expected = fit_fragility(data, intervals="wald")
    found, _ = fit_probit(seen)
    median = float(expected["median"].item())
    assert found.median().error == pytest.approx(float(expected["median_se"].item()) / median, rel=1e-6)
    dispersion = float(expected["dispersion"].item())
    error = float(expected["dispersion_se"].item()) / dispersion
    assert found.log_dispersion().error == pytest.approx(error, rel=1e-6)


def test_influences_are_what_a_motion_changes():
    """A motion that counts a little more moves the estimate by its influence: weighted likelihood, by brute force."""
    seen = runs(40, seed=5)
    found, _ = fit_probit(seen)
    sign = np.where(seen.fell, 1.0, -1.0)

    def estimate(weights):
        # (the root of the score: a minimum by differences is good to 1e-8, and what moves it here is 1e-6)
        def score(line):
            eta = sign * (line[0] + line[1] * seen.x)
            mills = np.exp(-0.5 * eta**2 - scipy.special.log_ndtr(eta)) / math.sqrt(2.0 * math.pi)
            part = weights[seen.motion] * sign * mills
            return [part.sum(), (part * seen.x).sum()]

        a, b = scipy.optimize.root(score, [0.0, 2.0], tol=1e-14).x
        return np.array([-a / b, -math.log(b), scipy.special.ndtr(a + b * 0.9)])

    change = np.zeros(40)
    change[7] = 1e-3
    alike = estimate(np.ones(40))
    moved = (estimate(1.0 + change) - estimate(1.0 - change)) / 2e-3
    factor = math.sqrt(40.0 / 39.0)
    for k, own in enumerate((found.median(), found.log_dispersion(), found.probability(0.9))):
        assert own.value == pytest.approx(alike[k], abs=1e-9)
        assert own.influence[7] / factor == pytest.approx(moved[k], rel=1e-6)


def test_a_weighted_sum_of_probabilities_is_that_of_each():
    found, _ = fit_probit(runs(50, seed=2))
    one = found.weighted(np.array([0.4, 0.9]), np.array([2.0, 3.0]))
    parts = [found.probability(0.4), found.probability(0.9)]
    assert one.value == pytest.approx(2.0 * parts[0].value + 3.0 * parts[1].value, rel=1e-12)
    assert one.influence == pytest.approx(2.0 * parts[0].influence + 3.0 * parts[1].influence, rel=1e-9)


def test_intervals_hold_the_median_as_often_as_they_say():
    """Runs of a motion that fall together: 95 % intervals of the median, 400 samples of 60 motions."""
    held = independent = 0
    for seed in range(400):
        found, _ = fit_probit(runs(60, correlation=0.9, seed=seed))
        gap = abs(found.median().value - math.log(2.0))
        held += gap <= found.median().reach
        covariance = np.linalg.inv(found.information)
        a, b = float(found.line.a[0]), float(found.line.b[0])
        gradient = np.array([-1.0, a / b]) * found.line.width / b
        independent += gap <= 1.96 * math.sqrt(gradient @ covariance @ gradient)
    assert 0.92 <= held / 400 <= 0.98
    assert independent / 400 < 0.87


def test_a_difference_of_estimates_from_the_same_motions_is_less_uncertain_than_each():
    seen = runs(60, correlation=0.9, seed=9)
    found, _ = fit_probit(seen)
    local, _ = local_probit(seen, found.log_median, 0.5, follow=True)
    gap, error = difference(local.median(), found.median())
    assert gap == pytest.approx(local.log_median - found.log_median, rel=1e-12)
    assert 0.0 < error < math.hypot(local.median().error, found.median().error)


@pytest.mark.slow
def test_a_local_fit_follows_a_curve_that_is_not_lognormal():
    """The curve through all runs misses the median of a mixture; a local one does by the square of its reach."""
    random = np.random.default_rng(4)
    x = random.uniform(-1.5, 2.5, 1_600_000)

    def chance(y):
        return 0.6 * scipy.special.ndtr((y - 0.4) / 0.3) + 0.4 * scipy.special.ndtr((y - 1.25) / 0.35)

    seen = Observations(x, random.random(x.size) < chance(x), np.arange(x.size) // 4)
    truth = scipy.optimize.brentq(lambda y: chance(y) - 0.5, 0.0, 2.0)
    wide, _ = fit_probit(seen)
    assert abs(wide.log_median - truth) > 0.05
    gaps = []
    for reach in (0.4, 0.2):
        near, middle = local_probit(seen, wide.log_median, reach, follow=True)
        gaps.append(abs(near.log_median - truth))
        assert middle == pytest.approx(near.log_median, abs=1e-3)
    assert gaps[1] < 0.01
    assert 0.15 < gaps[1] / gaps[0] < 0.35


@pytest.mark.parametrize(
    ("fell", "status"),
    [(np.zeros(6, bool), "no overturning"), (np.ones(6, bool), "all overturned"), (np.arange(6) < 3, "not increasing")],
)
def test_runs_without_a_curve(fell, status):
    x = np.array([0.0, 1.0, 2.0, 0.5, 1.5, 2.5]) if status == "not increasing" else np.arange(6.0)
    order = np.argsort(x)
    seen = Observations(x[order], np.array([1, 1, 0, 1, 0, 0], bool) if status == "not increasing" else fell, order)
    assert fit_probit(seen) == (None, status)
    assert fit_probit(Observations(np.empty(0), np.empty(0, bool), np.empty(0, int))) == (None, "no runs")


def test_separated_runs_have_a_penalised_curve():
    """Firth's estimate, by brute force: the likelihood times the root of the expected information's determinant."""
    x = np.linspace(-1.0, 1.0, 20)
    fell = x > 0.01
    found, status = fit_probit(Observations(x, fell, np.arange(20)))
    design = np.stack([np.ones(20), x], axis=1)

    def loss(line):
        eta = design @ line
        density = np.exp(-0.5 * eta * eta) / math.sqrt(2.0 * math.pi)
        weights = density**2 / (scipy.special.ndtr(eta) * scipy.special.ndtr(-eta))
        likelihood = np.sum(scipy.special.log_ndtr(np.where(fell, eta, -eta)))
        return -likelihood - 0.5 * math.log(np.linalg.det(design.T @ (weights[:, None] * design)))

    a, b = scipy.optimize.minimize(loss, [0.0, 4.0], method="Nelder-Mead", options={"xatol": 1e-9, "fatol": 1e-12}).x
    assert status == "separated"
    assert found.dispersion == pytest.approx(1.0 / b, rel=1e-5)
    assert found.log_median == pytest.approx(-a / b, abs=1e-6)


def test_few_motions_have_no_interval():
    seen = runs(7)
    assert fit_probit(seen)[0].median().reach == math.inf
    assert student(0) == math.inf
    assert student(1e9) == pytest.approx(1.959963985, rel=1e-6)


def test_a_gap_between_what_stood_and_what_fell_is_in_the_interval():
    x = np.linspace(-0.5, 0.5, 90)
    x = x[(x < -0.01) | (x > 0.03)]
    motion = np.arange(x.size) % 30
    runs = Observations(x, x > 0.0, motion)
    own = fit_probit(runs)[0].median()
    wide = enclosing(own._replace(value=0.4, error=1e-6), runs)
    low, high = x[x < 0.0].max(), x[x > 0.0].min()
    assert wide.value - wide.reach == pytest.approx(low, abs=1e-12)
    assert wide.value + wide.reach == pytest.approx(high, abs=1e-12)
    mixed = Observations(x, (x > 0.0) ^ (np.arange(x.size) == 3), motion)
    assert enclosing(own, mixed) is own
    assert enclosing(own, Observations(x, np.ones(x.size, np.bool_), motion)) is own


@pytest.mark.parametrize(("fell", "of"), [(3, 400), (120, 300), (996, 1000)])
def test_intervals_of_proportions_are_wilsons(fell, of):
    """Of independent runs, as many as the error says: the interval of the well-known formula, also near 0 and 1."""
    p = fell / of
    known = Estimate(p, math.sqrt(p * (1.0 - p) / of), np.zeros(0), 10**9)
    np.testing.assert_allclose(
        known.proportion(), np.ravel(wilson_interval(np.array([fell]), np.array([of]))), rtol=1e-6
    )
    wide = Estimate(p, 0.5, np.zeros(0), 100).proportion()
    assert wide[0] >= 0.0
    assert wide[1] <= 1.0
    assert Estimate(p, 0.01, np.zeros(0), 2).proportion() == (0.0, 1.0)
