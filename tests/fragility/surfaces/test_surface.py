"""Surfaces of medians and dispersions: against another optimiser, another library's errors, and resampling."""

import math

import numpy as np
import pytest
import scipy
import statsmodels.api as sm

from toppling.fragility.kernels.surfaces import add_scores
from toppling.fragility.surfaces.surface import Cut, Pool, added_terms, basis, exponents, fit_medians, fit_surface


def pool(seed=0, motions=200, each=8, variables=2, together=0.5):
    """Runs of blocks whose ln median is a cubic and whose dispersion changes; verdicts of a motion are dependent."""
    random = np.random.default_rng(seed)
    points = random.uniform(-1.0, 1.0, (motions * each, variables))
    motion = np.repeat(np.arange(motions), each)
    common, own = random.standard_normal(motions)[motion], random.standard_normal(motions * each)
    x = truth(points) + random.uniform(-0.8, 0.8, len(points))
    capacity = truth(points) + spread(points) * (math.sqrt(together) * common + math.sqrt(1.0 - together) * own)
    return Pool(points, x, capacity < x, motion)


def truth(points):
    return 0.3 + 0.5 * points[:, 0] + 0.2 * points[:, 0] ** 3 - 0.1 * points[:, -1] ** 2


def spread(points):
    return 0.3 * np.exp(0.2 * points[:, 0])


@pytest.mark.parametrize(("variables", "degree"), [(1, 4), (2, 3), (3, 2), (0, 3)])
def test_terms_are_all_products_up_to_the_degree(variables, degree):
    terms = exponents(variables, degree)
    assert len(terms) == math.comb(variables + degree, degree)
    assert terms.sum(axis=1).tolist() == sorted(terms.sum(axis=1).tolist())
    points = np.random.default_rng(1).uniform(-1.0, 1.0, (5, variables))
    by_hand = np.array(
        [[math.prod(scipy.special.eval_chebyt(k, v) for k, v in zip(t, p, strict=True)) for t in terms] for p in points]
    )
    np.testing.assert_allclose(basis(points, degree), by_hand, rtol=1e-13)


def test_likelihood_is_greatest():
    """Against BFGS on the likelihood written down plainly."""
    runs = pool()
    found = fit_surface(runs, (3, 1))
    middle, width = basis(runs.points, 3), basis(runs.points, 1)

    def loss(c):
        z = (runs.x - middle @ c[:10]) / np.exp(width @ c[10:])
        return -scipy.special.log_ndtr(np.where(runs.fell, z, -z)).sum()

    other = scipy.optimize.minimize(
        loss, found.coefficients + 0.05, method="BFGS", options={"gtol": 1e-6, "maxiter": 2000}
    )
    assert loss(found.coefficients) <= other.fun + 1e-6
    np.testing.assert_allclose(found.coefficients, other.x, atol=2e-4)


class TestSums:
    """One pass over the runs, against the likelihood written down plainly and its differences."""

    C = np.array([0.2, -0.1, 0.3, 0.05, -0.2, 0.1, -1.0, 0.3, 0.1])

    @staticmethod
    def rows(runs):
        return basis(runs.points, 2), basis(runs.points, 1)

    def sums(self, runs, c):
        scores, information = np.zeros((int(runs.motion.max()) + 1, c.size)), np.zeros((c.size, c.size))
        value = add_scores(*self.rows(runs), c, runs.x, runs.fell, runs.motion, scores, information)
        return value, scores, information

    def plain(self, runs, c):
        middle, spread = self.rows(runs)
        z = (runs.x - middle @ c[:6]) / np.exp(spread @ c[6:])
        return scipy.special.log_ndtr(np.where(runs.fell, z, -z)), z

    # (levels from near the medians to 40 dispersions away, where one outcome has a probability of 1e-350)
    @pytest.mark.parametrize("away", [1.0, 10.0, 100.0])
    def test_likelihood_and_slopes(self, away):
        runs = pool(motions=30)
        runs = runs._replace(x=away * runs.x)
        value, scores, _ = self.sums(runs, self.C)
        assert value == pytest.approx(self.plain(runs, self.C)[0].sum(), rel=1e-13)
        step = 1e-6
        for term in range(self.C.size):
            e = step * (np.arange(self.C.size) == term)
            slopes = (self.plain(runs, self.C + e)[0] - self.plain(runs, self.C - e)[0]) / (2.0 * step)
            of_motions = np.bincount(runs.motion, slopes)
            np.testing.assert_allclose(scores[:, term], of_motions, rtol=1e-6, atol=1e-6 * np.abs(of_motions).max())

    def test_information_is_the_mean_of_squared_slopes(self):
        runs = pool(motions=20)
        _, _, information = self.sums(runs, self.C)
        _, z = self.plain(runs, self.C)
        middle, spread = self.rows(runs)
        by = -np.concatenate([middle, z[:, None] * spread * np.exp(spread @ self.C[6:])[:, None]], axis=1)
        by /= np.exp(spread @ self.C[6:])[:, None]
        p = scipy.special.ndtr(z)
        weight = np.exp(-(z**2)) / (2.0 * math.pi * p * (1.0 - p))
        np.testing.assert_allclose(information, (by * weight[:, None]).T @ by, rtol=1e-9, atol=1e-9)

    def test_a_run_that_cannot_be(self):
        runs = pool(motions=5)
        assert self.sums(runs._replace(x=runs.x + 1e12), self.C)[0] == -math.inf
        assert self.sums(runs, self.C * np.r_[np.ones(6), 1e9 * np.ones(3)])[0] == -math.inf


def test_medians_and_dispersions_are_those_of_the_truth():
    found = fit_surface(pool(motions=2000), (3, 1))
    points = np.random.default_rng(2).uniform(-1.0, 1.0, (50, 2))
    middle, error = found.log_medians(points), found.median_errors(points)
    assert np.abs((middle - truth(points)) / error).max() < 4.0
    assert np.sqrt(np.mean((middle - truth(points)) ** 2)) < 0.02
    wide, error = found.log_dispersions(points), found.dispersion_errors(points)
    assert np.abs((wide - np.log(spread(points))) / error).max() < 4.0


def test_errors_with_one_dispersion_are_those_of_another_library():
    """A surface with a constant dispersion is a probit regression; statsmodels has its clustered sandwich."""
    runs = pool()
    found = fit_surface(runs, (1, 0))
    table = np.column_stack([runs.x, -basis(runs.points, 1)])
    other = sm.Probit(runs.fell.astype(float), table).fit(
        disp=0, cov_type="cluster", cov_kwds={"groups": runs.motion, "use_correction": False}
    )
    slope = other.params[0]
    np.testing.assert_allclose(found.coefficients[:3], other.params[1:] / slope, atol=1e-5)
    np.testing.assert_allclose(found.coefficients[3], -math.log(slope), atol=1e-5)
    by = np.column_stack([-other.params[1:] / slope**2, np.eye(3) / slope])
    k = found.motions
    ours = found.covariance[:3, :3] * (k - 4) / k
    # (statsmodels has the observed information, and here the expected one stands: equal in the limit)
    np.testing.assert_allclose(np.sqrt(np.diag(ours)), np.sqrt(np.diag(by @ other.cov_params() @ by.T)), rtol=0.05)


def test_errors_are_those_of_repetitions():
    found = [fit_surface(pool(seed, motions=150), (2, 1)) for seed in range(150)]
    points = np.array([[-1.0, -1.0], [0.0, 0.0], [1.0, 0.5]])
    middle = np.array([one.log_medians(points) for one in found])
    error = np.array([one.median_errors(points) for one in found])
    np.testing.assert_allclose(middle.std(axis=0), np.sqrt((error**2).mean(axis=0)), rtol=0.2)


def medians_of(runs):
    """The curve of all runs, and medians from those near them."""
    curve = fit_surface(runs, (3, 1))
    close = runs.some(np.abs(runs.x - curve.log_medians(runs.points)) < 0.3)
    return curve, close, fit_medians(close, 3, curve, curve)


def test_medians_alone_are_the_likeliest_with_dispersions_a_constant_times_the_curves():
    """Against BFGS on the likelihood written down plainly."""
    curve, close, found = medians_of(pool())
    middle, narrow = basis(close.points, 3), np.exp(-curve.log_dispersions(close.points))

    def loss(c):
        z = (close.x - middle @ c[:10]) * narrow * np.exp(-c[10])
        return -scipy.special.log_ndtr(np.where(close.fell, z, -z)).sum()

    other = scipy.optimize.minimize(
        loss, np.r_[curve.coefficients[:10], 0.05], method="BFGS", options={"gtol": 1e-6, "maxiter": 2000}
    )
    points = np.random.default_rng(1).uniform(-1.0, 1.0, (20, 2))
    np.testing.assert_allclose(found.log_medians(points), basis(points, 3) @ other.x[:10], atol=2e-4)
    factors = found.log_dispersions(points) - curve.log_dispersions(points)
    np.testing.assert_allclose(factors, other.x[10], atol=2e-4)
    assert found.degrees == (3, 1)
    assert found.covariance.shape == (13, 13)
    # (the errors of the curve's slopes are not its own)
    assert not found.covariance[11:].any()
    assert not found.influence[:, 11:].any()
    assert (np.diag(found.covariance)[:11] > 0.0).all()


@pytest.mark.parametrize("variables", [0, 1])
def test_medians_alone_in_fewer_variables(variables):
    random = np.random.default_rng(3)
    points, motion = random.uniform(-1.0, 1.0, (1600, variables)), np.repeat(np.arange(200), 8)
    x = random.uniform(-0.5, 0.5, 1600)
    runs = Pool(points, x, 0.3 * random.standard_normal(1600) < x - 0.1 * points.sum(axis=1), motion)
    curve = fit_surface(runs, (2, 1))
    found = fit_medians(runs.some(np.abs(x) < 0.2), 2, curve, curve)
    tested = np.linspace(-1.0, 1.0, 5)[:, None][:, :variables]
    assert (np.abs(found.log_medians(tested) - 0.1 * tested.sum(axis=1)) < 4.0 * found.median_errors(tested)).all()
    assert np.ptp(found.log_dispersions(tested) - curve.log_dispersions(tested)) < 1e-12


def test_medians_alone_with_a_cut_have_its_dispersions_on_both_sides():
    runs = pool(motions=400)
    far = runs.points[:, 0] >= 0.2
    runs = runs._replace(x=runs.x + 0.3 * far)
    cut = Cut(np.array([1.0, 0.0]), 0.2, 0.2, 0.2)
    curve = fit_surface(runs, (3, 1), cut=cut)
    close = runs.some(np.abs(runs.x - curve.log_medians(runs.points)) < 0.3)
    found = fit_medians(close, 3, curve, curve)
    assert found.sizes == curve.sizes
    assert found.coefficients.shape == curve.coefficients.shape
    points = np.random.default_rng(4).uniform(-1.0, 1.0, (50, 2))
    factors = found.log_dispersions(points) - curve.log_dispersions(points)
    np.testing.assert_allclose(factors, factors[0], atol=1e-12)
    middle = truth(points) + 0.3 * (points[:, 0] >= 0.2)
    assert np.abs((found.log_medians(points) - middle) / found.median_errors(points)).max() < 4.0


def test_medians_alone_are_none_where_the_runs_do_not_determine_them():
    curve, close, _ = medians_of(pool())
    assert fit_medians(close._replace(fell=np.ones_like(close.fell)), 3, curve, curve) is None
    assert fit_medians(close.some(np.arange(close.x.size) < 8), 3, curve, curve) is None


@pytest.mark.slow
def test_errors_of_medians_alone_are_those_of_repetitions():
    """Although dispersions come from the same motions, and are taken as known."""
    found = [medians_of(pool(seed, motions=200))[2] for seed in range(150)]
    points = np.array([[-1.0, -1.0], [0.0, 0.0], [1.0, 0.5], [1.0, 1.0]])
    middle = np.array([one.log_medians(points) for one in found])
    error = np.array([one.median_errors(points) for one in found])
    np.testing.assert_allclose(middle.std(axis=0), np.sqrt((error**2).mean(axis=0)), rtol=0.2)
    assert np.abs((middle.mean(axis=0) - truth(points)) / middle.std(axis=0) * math.sqrt(150)).max() < 4.0


def test_terms_that_are_not_there_are_rarely_found_and_those_that_are_always():
    found = []
    for seed in range(100):
        runs = pool(seed, motions=150, variables=1)
        found.append(added_terms(fit_surface(runs, (3, 1)), fit_surface(runs, (4, 1))) < 0.05)
    assert 0 < sum(found) <= 14
    runs = pool(motions=1500, variables=1)
    assert added_terms(fit_surface(runs, (1, 1)), fit_surface(runs, (3, 1))) < 1e-4


def test_what_has_no_greatest_likelihood_has_no_surface():
    runs = pool(motions=40)
    middle = truth(runs.points)
    assert fit_surface(runs._replace(fell=runs.x > middle), (3, 1)) is None
    assert fit_surface(runs._replace(fell=np.ones_like(runs.fell)), (1, 0)) is None
    assert fit_surface(runs.some(np.arange(runs.x.size) < 8), (3, 1)) is None
    same = runs._replace(points=np.zeros_like(runs.points))
    assert fit_surface(same, (1, 0)) is None
