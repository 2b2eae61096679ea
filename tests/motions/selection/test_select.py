"""Selections: what they promise, what they report, and what they refuse."""

import warnings

import numpy as np
import pytest
import xarray as xr

from toppling import motions
from toppling.motions.selection.select import InconsistentSelection, Selection, select


@pytest.fixture(scope="module")
def pool():
    """A hundred and twenty motions of unlike bands, of 40 earthquakes."""
    parts = [
        motions.CloughPenzien(duration=10.0, dt=0.01, omega_g=frequency).sample(40, seed=seed)
        for seed, frequency in enumerate((6.0, 12.0, 25.0))
    ]
    joined = xr.concat(
        [part.assign_coords(motion=[f"{k}-{i}" for i in range(40)]) for k, part in enumerate(parts)], "motion"
    )
    return joined.assign_coords(event=("motion", [f"event {i % 40}" for i in range(120)]))


@pytest.fixture(scope="module")
def target(pool):
    """What the pool itself is like, a little off."""
    names = ["pga", "Sa(0.5)", "Sa(1.0)", "pgv"]
    logs = np.log(np.stack([motions.measures(pool, name)[name].values for name in names]))
    correlations = xr.DataArray(np.corrcoef(logs), dims=("a", "b"), coords={"a": names, "b": names})
    medians, sigmas = np.exp(logs.mean(axis=1) + 0.05), logs.std(axis=1)
    return motions.Target(names, medians, sigmas, correlations=correlations, given="Sa(1.0)")


@pytest.fixture(scope="module")
def chosen(pool, target):
    return select(pool, target, 20, level=target.medians[2])


class TestSelection:
    def test_is_at_the_level_and_consistent(self, chosen, target):
        scaled = chosen.motions * chosen.motions["factor"]
        np.testing.assert_allclose(motions.measures(scaled, "Sa(1.0)")["Sa(1.0)"], target.medians[2], rtol=1e-9)
        assert isinstance(chosen, Selection)
        assert chosen.consistent
        assert chosen.why == ""
        assert not np.any(chosen.report["gated"].sel(measure=["Sa(1.0)", "d5_95"]))
        assert np.all(chosen.report["gated"].sel(measure=["pga", "Sa(0.5)", "pgv"]))

    def test_report_by_hand(self, chosen, target):
        """Medians, scatter and distances of the scaled motions, measured from the motions themselves."""
        scaled = chosen.motions * chosen.motions["factor"]
        wanted = target.at(target.medians[2])
        for j, name in enumerate(["pga", "Sa(0.5)"]):
            logs = np.log(motions.measures(scaled, name)[name].values)
            one = chosen.report.sel(measure=name)
            assert one["median"].item() == pytest.approx(np.exp(logs.mean()), rel=1e-9)
            assert one["sigma"].item() == pytest.approx(logs.std(ddof=1), rel=1e-9)
            assert one["target_median"].item() == pytest.approx(wanted.medians[j], rel=1e-12)
            assert one["bias"].item() == pytest.approx(np.exp(logs.mean()) / wanted.medians[j] - 1.0, abs=1e-9)
            assert one["sigma_ratio"].item() == pytest.approx(logs.std(ddof=1) / wanted.sigmas[j], rel=1e-9)
        assert chosen.report["median"].sel(measure="d5_95").item() == pytest.approx(
            np.exp(np.log(motions.measures(chosen.motions, "d5_95")["d5_95"]).mean().item()), rel=1e-9
        )
        assert np.isnan(chosen.report["bias"].sel(measure="d5_95"))

    def test_distance_is_that_of_another_program(self, chosen, target):
        from scipy import stats

        wanted = target.at(target.medians[2])
        logs = np.log(motions.measures(chosen.motions * chosen.motions["factor"], "pga")["pga"].values)
        known = stats.kstest(logs, "norm", args=(wanted.mean[0], wanted.sigmas[0])).statistic
        assert chosen.report["ks"].sel(measure="pga").item() == pytest.approx(known, rel=1e-8)
        assert chosen.report.attrs["ks_critical"] == pytest.approx(stats.ksone.ppf(0.975, 20), abs=0.005)

    def test_candidates_are_named(self, chosen, pool):
        places = chosen.motions["candidate"].values
        np.testing.assert_array_equal(pool.values[places], chosen.motions.values)
        assert np.unique(places).size == 20
        assert chosen.motions["event"].values.tolist() == pool["event"].values[places].tolist()
        attrs = chosen.report.attrs
        assert attrs["candidates"] == 120
        assert attrs["allowed"] <= 120
        assert attrs["factor_least"] >= 0.25
        assert attrs["factor_greatest"] <= 4.0
        assert attrs["events"] == np.unique(chosen.motions["event"]).size

    def test_bounds_and_events(self, pool, target):
        for most in (1, 2, 10**30):
            found = select(pool, target, 15, level=target.medians[2], factor=(0.5, 2.0), per_event=most)
            factors = found.motions["factor"].values
            assert np.all((factors >= 0.5) & (factors <= 2.0))
            assert np.unique(found.motions["event"].values, return_counts=True)[1].max() <= most

    def test_seed_and_order(self, pool, target):
        level = target.medians[2]
        one, again, other = (select(pool, target, 10, level=level, seed=seed) for seed in (4, 4, 5))
        np.testing.assert_array_equal(one.motions["candidate"], again.motions["candidate"])
        assert one.motions["candidate"].values.tolist() != other.motions["candidate"].values.tolist()
        shuffled = select(pool.isel(motion=slice(None, None, -1)), target, 10, level=level, seed=4)
        assert sorted(shuffled.motions["motion"].values) == sorted(one.motions["motion"].values)

    def test_weights(self, pool, target):
        """A measure of a hundredfold weight agrees better than without it."""
        level = 1.5 * target.medians[2]
        with warnings.catch_warnings(action="ignore", category=InconsistentSelection):
            plain = select(pool, target, 10, level=level)
            heavy = select(pool, target, 10, level=level, weights={"pga": 100.0})

        def off(found):
            one = found.report.sel(measure="pga")
            return np.log1p(one["bias"].item()) ** 2 + 2.0 * (one["sigma"] - one["target_sigma"]).item() ** 2

        assert off(heavy) <= off(plain)

    def test_what_cannot_agree_is_said(self, pool, target):
        """One pool cannot give twice the spread."""
        wide = motions.Target(
            ["pga", "Sa(1.0)"], np.array(target.medians)[[0, 2]], [3.0, 0.5], correlations=np.eye(2), given="Sa(1.0)"
        )
        with pytest.warns(InconsistentSelection, match=r"not hazard-consistent \(pga: median .* sigma 0\."):
            found = select(pool, wide, 10, level=target.medians[2])
        assert not found.consistent
        assert "pga" in found.why

    def test_several_arrays(self, pool, target, chosen):
        """Records of unlike steps come as several arrays: the same choice, an array for each that holds one."""
        parts = [pool.isel(motion=slice(k, k + 40)) for k in (0, 40, 80)]
        found = select(parts, target, 20, level=target.medians[2])
        joined = xr.concat(found.motions, "motion")
        xr.testing.assert_identical(joined["candidate"], chosen.motions["candidate"])
        np.testing.assert_array_equal(joined.values, chosen.motions.values)
        xr.testing.assert_identical(found.report, chosen.report)

    def test_one_motion(self, pool, target):
        found = select(pool, target, 1, level=target.medians[2])
        assert found.motions.sizes["motion"] == 1
        assert np.isnan(found.report["sigma"].sel(measure="pga"))


def test_refused(refusal):
    refusal()
