"""Sufficiency of stripes: against another program's regression, under no dependence, and what is refused."""

import numpy as np
import pytest
import statsmodels.api as sm

import toppling as tp
from toppling.fragility.efficiency.sufficiency import slopes

LAW = tp.HousnerImpact()


def drawn(seed, slope, stripes=4, runs=60, shared=20):
    """Outcomes of stripes that depend on one covariate of two; some motions are in several stripes."""
    rng = np.random.default_rng(seed)
    stripe = np.repeat(np.arange(stripes), runs)
    cluster = np.concatenate([np.arange(runs) + (k * (runs - shared)) for k in range(stripes)])
    own = rng.normal(size=(cluster.max() + 1, 2))
    z = own[cluster] + 0.3 * rng.normal(size=(stripe.size, 2))
    noise = rng.logistic(size=stripe.size)
    fell = np.linspace(-1.0, 1.5, stripes)[stripe] + slope * z[:, 0] + noise > 0.0
    return z, stripe, fell, cluster


@pytest.mark.parametrize("seed", range(5))
def test_as_another_program_has_it(seed):
    """Coefficients of a logistic regression with dummies, and its errors with clusters."""
    z, stripe, fell, cluster = drawn(seed, 0.8)
    found = slopes(z, stripe, fell, cluster)
    design = np.concatenate([np.eye(4)[stripe], z], axis=1)
    options = {"groups": cluster, "use_correction": False}
    known = sm.Logit(fell.astype(float), design).fit(disp=0, tol=1e-12, cov_type="cluster", cov_kwds=options)
    g = np.unique(cluster).size
    np.testing.assert_allclose(found[0], known.params[-2:], rtol=1e-7)
    np.testing.assert_allclose(found[1], known.bse[-2:] * np.sqrt(g / (g - 1.0)), rtol=1e-6)
    assert found[2] == 240


def test_no_dependence_is_found_as_often_as_it_should_be():
    """Of 400 samples without dependence on the second covariate, some 5 % have a p-value below 5 %."""
    statistics = []
    for seed in range(400):
        found = slopes(*drawn(1000 + seed, 0.5))
        statistics.append(abs(found[0][1] / found[1][1]) > 1.96)
    assert 0.02 < np.mean(statistics) < 0.10


def test_stripes_without_both_outcomes_tell_nothing():
    z, stripe, fell, cluster = drawn(3, 0.8)
    plain = slopes(z[stripe < 3], stripe[stripe < 3], fell[stripe < 3], cluster[stripe < 3])
    fell = fell.copy()
    fell[stripe == 3] = True
    with_full = slopes(z, stripe, fell, cluster)
    np.testing.assert_allclose(with_full[0], plain[0], rtol=1e-12)
    assert with_full[2] == 180


def test_what_cannot_be_told_is_not():
    z, stripe, fell, cluster = drawn(3, 0.8)
    separated = slopes(np.column_stack([np.where(fell, 1.0, -1.0) + 0.01 * z[:, 0], z[:, 1]]), stripe, fell, cluster)
    assert np.isnan(separated[0]).all()
    few = np.zeros(fell.size, bool)
    few[:19] = True
    assert np.isnan(slopes(z, stripe, few, cluster)[0]).all()


@pytest.fixture(scope="module")
def runs():
    pool = tp.motions.CloughPenzien(duration=8.0, dt=0.02, omega_g_dispersion=0.4).sample(60, seed=4)
    blocks = [tp.Block(width=0.2, height=1.0), tp.Block(width=0.25, height=1.2)]
    return tp.stripes(blocks, LAW, [pool, pool], [3.0, 4.0], outputs=["overturned"], screen=False)


class TestRuns:
    def test_velocity_matters_where_levels_are_of_acceleration(self, runs):
        found = tp.fragility.stripe_sufficiency(runs, ["pgv"])
        assert np.all(found["slope"] > 0.0)
        assert np.all(found["p_value"] < 0.01)
        assert found["covariate"].values.tolist() == ["pgv"]

    def test_covariates_are_of_the_scaled_motions(self, runs):
        """By hand: ln PGV times the factor, less its mean in the stripe, over the standard deviation."""
        found = tp.fragility.stripe_sufficiency(runs, ["pgv", "factor"])
        factor = runs["intensity"].values / runs["pga"].values
        x = np.stack([np.log(runs["pgv"].values * factor), np.log(factor)], axis=1)
        stripe = runs["stripe"].values - 1
        means = np.stack([x[stripe == k].mean(axis=0) for k in range(2)])
        off = x - means[stripe]
        spread = np.sqrt((off**2).sum(axis=0) / (120 - 2))
        np.testing.assert_allclose(found["spread"], spread, rtol=1e-12)
        cluster = np.tile(np.arange(60), 2)
        known = slopes(off / spread, stripe, runs["overturned"].values[1, 0], cluster)
        np.testing.assert_allclose(found["slope"][1, 0], known[0], rtol=1e-9)
        np.testing.assert_allclose(found["slope_se"][1, 0], known[1], rtol=1e-9)


def test_refused(refusal):
    refusal()
