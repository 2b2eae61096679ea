"""Intensity measures compared: censored fits against independent ones, conversion between measures, intervals."""

import matplotlib as mpl
import numpy as np
import pytest
import statsmodels.api as sm
import xarray as xr
from lognormal import fit_lognormal
from scipy import optimize, stats

import toppling as tp
from toppling.fragility import overturning_capacity, rank_measures
from toppling.fragility.efficiency.capacity import brackets
from toppling.fragility.efficiency.trends import STATUSES, fit_dispersions, fit_trend
from toppling.fragility.fitting.bootstrap import draw_motions

mpl.use("Agg")

SHELF = tp.catalogue["bookcase-5-shelf"]
CRATE = tp.Block(0.5, 1.2, name="crate")
INF = np.inf


def bracketed(y, grid):
    """Ends of values between the points of a grid."""
    ends = np.concatenate([[-INF], grid, [INF]])
    k = np.searchsorted(grid, y)
    return ends[k], ends[k + 1]


def direct(lower, upper, weights=None):
    """Mean and standard deviation that maximise the plainly written likelihood, by a simplex."""
    w = np.ones(lower.size) if weights is None else weights

    def loss(parameters):
        mean, log_sd = parameters
        sd = np.exp(log_sd)
        p = stats.norm.cdf((upper - mean) / sd) - stats.norm.cdf((lower - mean) / sd)
        return -np.sum(w * np.log(np.maximum(p, 1e-300)))

    ends = np.concatenate([lower[np.isfinite(lower)], upper[np.isfinite(upper)]])
    start = np.array([ends.mean(), np.log(ends.std() + 1e-3)])
    options = {"xatol": 1e-11, "fatol": 1e-13, "maxiter": 20_000, "maxfev": 20_000}
    found = optimize.minimize(loss, start, method="Nelder-Mead", options=options)
    return found.x[0], np.exp(found.x[1])


def dispersion(lower, upper, weights=None):
    w = np.ones((1, lower.size)) if weights is None else weights
    found, status = fit_dispersions([(lower[None], upper[None])], w)
    return found[0, 0], int(status[0, 0])


def first_all_once(n, replicates, seed):
    """As `rank_measures` weighs n motions: all once, then replicates of them."""
    return np.concatenate([np.ones((1, n)), draw_motions((np.arange(n),), replicates, seed)])


class TestCensoredFits:
    def test_against_a_simplex_on_the_plain_likelihood(self):
        rng = np.random.default_rng(1)
        for n, points, sd in ((12, 8, 0.3), (60, 15, 0.5), (200, 5, 1.2), (40, 40, 0.1)):
            y = rng.normal(0.7, sd, n)
            # ends that differ from one motion to the next, as in a measure other than the levels'
            shift = rng.normal(0.0, 0.2, n)
            low, high = bracketed(y - shift, np.linspace(-0.2, 1.3, points))
            low, high = low + shift, high + shift
            assert dispersion(low, high)[0][0] == pytest.approx(direct(low, high)[1], rel=1e-6)

    def test_bootstrap_weights_against_the_same_simplex(self):
        rng = np.random.default_rng(2)
        y = rng.normal(0.0, 0.4, 30)
        low, high = bracketed(y, np.linspace(-0.5, 0.6, 9))
        weights = first_all_once(30, 6, seed=3)
        found, _ = dispersion(low, high, weights)
        for value, w in zip(found, weights, strict=True):
            # to a thousandth of its own standard error: bootstrap fits stop before rounding
            assert value == pytest.approx(direct(low, high, w)[1], abs=1e-3 * value / np.sqrt(2.0 * 30.0))

    def test_fine_levels_give_the_standard_deviation(self):
        y = np.random.default_rng(3).normal(2.0, 0.35, 50)
        low, high = bracketed(y, np.linspace(0.0, 4.0, 40_001))
        assert dispersion(low, high)[0][0] == pytest.approx(y.std(), rel=1e-5)

    def test_stripes_of_half_lines_are_the_fit_of_counts(self):
        levels = np.array([0.2, 0.3, 0.4, 0.6, 0.7, 0.8, 0.9, 1.0])
        fallen = np.array([0, 0, 0, 4, 6, 13, 12, 16])
        x = np.repeat(np.log(levels), 40)
        fell = np.concatenate([np.arange(40) < k for k in fallen])
        found, _ = dispersion(np.where(fell, -INF, x), np.where(fell, x, INF))
        # Baker (2015)'s stripes, to the digits of the other program that are good (its gradient there is 1e-6)
        assert found[0] == pytest.approx(0.4292371986, rel=2e-8)
        assert found[0] == pytest.approx(fit_lognormal(levels, fallen, np.full(8, 40)).dispersion, rel=1e-9)

    @pytest.mark.parametrize(
        ("lower", "upper", "status"),
        [
            ([0.0, 1.0], [INF, INF], "no overturning"),
            ([-INF, -INF], [0.0, 1.0], "all overturned"),
            ([0.0, 0.0, -INF], [1.0, 1.0, 0.5], "separated"),
            ([0.0, 1.0], [1.0, 2.0], "separated"),
            ([-INF, -INF, 1.0, 1.5], [0.4, 0.5, INF, INF], "not increasing"),
            ([0.2, 0.3, -INF, -INF], [INF, INF, 0.5, 0.7], "separated"),
        ],
    )
    def test_no_finite_maximum(self, lower, upper, status):
        found, number = dispersion(np.array(lower), np.array(upper))
        assert np.isnan(found[0])
        assert STATUSES[number] == status

    @pytest.mark.parametrize("digits", [-3e-16, 0.0, 3e-16])
    def test_last_digits_of_one_level_part_no_intervals(self, digits):
        """A level converted into another measure differs in its last digits, which are those of the processor."""
        lower, upper = np.array([0.5, 1.0, 0.5, -np.inf]), np.array([1.0, 2.0, 1.0, 1.5])
        lower[1] += digits
        assert STATUSES[dispersion(lower, upper)[1]] == "separated"

    def test_trend_of_known_capacities_is_ordinary_least_squares(self):
        rng = np.random.default_rng(5)
        x = rng.normal(6.5, 0.5, 40)
        y = 0.3 + 0.2 * x + rng.normal(0.0, 0.3, 40)
        low, high = bracketed(y, np.linspace(y.min() - 1.0, y.max() + 1.0, 200_001))
        slope, error = fit_trend((low[None], high[None]), x)
        fit = sm.OLS(y, sm.add_constant(x)).fit()
        assert slope[0] == pytest.approx(fit.params[1], rel=1e-4)
        assert error[0] == pytest.approx(fit.bse[1], rel=1e-4)

    def test_trend_of_censored_capacities_against_a_simplex(self):
        rng = np.random.default_rng(6)
        x = rng.normal(0.0, 1.0, 60)
        y = 0.5 * x + rng.normal(0.0, 0.4, 60)
        low, high = bracketed(y, np.linspace(-0.6, 0.6, 6))

        def loss(parameters):
            mean, slope, log_sd = parameters
            ends = [stats.norm.cdf((end - mean - slope * x) / np.exp(log_sd)) for end in (low, high)]
            return -np.sum(np.log(ends[1] - ends[0]))

        found = optimize.minimize(loss, [0.0, 0.3, -1.0], method="BFGS", options={"gtol": 1e-9})
        slope, error = fit_trend((low[None], high[None]), x)
        assert slope[0] == pytest.approx(found.x[1], rel=1e-4)
        # (the quasi-Newton Hessian is rough, the correction is not)
        assert error[0] == pytest.approx(np.sqrt(found.hess_inv[1, 1] * 60.0 / 58.0), rel=0.2)

    def test_a_covariate_that_does_not_vary_has_no_trend(self):
        low, high = bracketed(np.random.default_rng(7).normal(0.0, 1.0, 20), np.linspace(-1.0, 1.0, 9))
        slope, error = fit_trend((low[None], high[None]), np.full(20, 6.5))
        assert np.isnan(slope[0])
        assert np.isnan(error[0])


def test_brackets_of_flags():
    flags = np.array([[0, 0, 1, 1], [1, 1, 1, 1], [0, 0, 0, 0], [0, 1, 0, 1]], dtype=bool)
    found = brackets(flags, np.array([1.0, 2.0, 3.0, 4.0]))
    assert found.lower.tolist() == [2.0, -INF, 4.0, 1.0]
    assert found.upper.tolist() == [3.0, 1.0, INF, 2.0]
    assert found.stood_above.tolist() == [False, False, False, True]


LEVELS = np.geomspace(0.05, 60.0, 400)
# three standard errors of what the distance of the levels adds to the standard deviation of 40 values
ROUNDING = 3.0 * np.log(LEVELS[1] / LEVELS[0]) / np.sqrt(12.0 * 40.0)


def shakes(n=40, seed=1):
    make = tp.motions.CloughPenzien
    return [make(duration=4.0, dt=0.02).sample(n // 2, seed), make(duration=5.0, dt=0.02).sample(n - n // 2, seed + 1)]


def unrun(blocks, motions, levels, im="pga"):
    """A dataset as of runs at all these levels, of which only the first was run: flags and rotations to be made up."""
    one = tp.ida(blocks, tp.HousnerImpact(), motions, levels[:1], im=im)
    return one.isel(level=np.zeros(levels.size, int)).assign_coords(level=("level", levels, one["level"].attrs))


@pytest.fixture(scope="module")
def known():
    """Runs of two blocks whose capacities are made up: lognormal about one PGV over block, exactly known."""
    sets = shakes()
    runs = unrun([SHELF, CRATE], sets, LEVELS)
    rng = np.random.default_rng(8)
    pgv, pga = runs["pgv"].values, runs["pga"].values
    # in PGV the two blocks' capacities lie 1/p tan alpha apart and scatter by 0.2
    scale = np.tan(runs["alpha"].values) / runs["p"].values
    noise = rng.normal(0.0, 0.2, 40)
    factor = np.exp(noise)[None, :] * 3.0 * scale[:, None] / pgv
    flags = LEVELS[:, None] > (factor * pga)[:, None, None, :]
    demand = (LEVELS[:, None] / (factor * pga)[:, None, None, :]) ** 1.7
    runs["overturned"] = runs["overturned"].copy(data=flags)
    rotation = np.where(flags, 0.5 * np.pi, demand * runs["alpha"].values[:, None, None, None])
    runs["peak_rotation"] = runs["peak_rotation"].copy(data=rotation)
    return runs, sets, noise, factor


class TestRanking:
    def test_the_measure_behind_the_capacities_is_the_best(self, known):
        runs, sets, noise, _ = known
        found = rank_measures(runs, sets, ["Sa(0.5)", tp.motions.Sv(1.0)], replicates=100)
        assert set(found["measure"].values) >= {"pga", "pgv", "pgd", "arias", "cav", "Sa(0.5)", "Sv(1.0)"}
        assert found["best"].values.tolist() == [["pgv"], ["pgv"]]
        assert found["rank"].sel(measure="pgv").values.tolist() == [[1], [1]]
        assert found["dispersion"].sel(measure="pgv").values == pytest.approx(noise.std(), abs=ROUNDING)
        assert found["excess"].sel(measure="pgv").values == pytest.approx(0.0)
        assert not found["distinguishable"].sel(measure="pgv").any()
        assert found["share_best"].sum("measure").values == pytest.approx(1.0)
        for name in found.variables:
            assert "units" in found[name].attrs, name
            assert found[name].attrs["long_name"], name

    @pytest.mark.slow
    def test_every_measure_from_runs_in_one(self, known):
        """Capacities converted by hand, motion by motion; Arias intensity grows with the square."""
        runs, sets, _, factor = known
        found = rank_measures(runs, sets, ["Sa(0.5)", "FIV3(0.5)"], replicates=0)
        values = tp.motions.measures(sets, [*tp.motions.MEASURES, "Sa(0.5)", "FIV3(0.5)"])
        for label in found["measure"].values:
            power = 2.0 if label == "arias" else 1.0
            for block in range(2):
                # ends in PGA, as factors, in the measure
                low, high = bracketed(factor[block] * values["pga"].values, LEVELS)
                ends = [
                    np.log(values[label].values) + power * np.log(end / values["pga"].values) for end in (low, high)
                ]
                one = found["dispersion"].sel(measure=label).values[block, 0]
                assert one == pytest.approx(direct(*ends)[1], rel=1e-6)
        ratio = found["amplitude_dispersion"] / found["dispersion"]
        assert ratio.sel(measure="arias").values == pytest.approx(0.5)
        assert ratio.sel(measure="cav").values == pytest.approx(1.0)

    @pytest.mark.parametrize("im", ["pgv", "arias", "Sa(0.5)", "pga_normalised", "scale"])
    def test_the_measure_of_the_levels_does_not_matter(self, known, im):
        """The same capacities at levels of another measure: the same dispersions, up to the distance of the levels."""
        runs, sets, _, factor = known
        levels = LEVELS**2 if im == "arias" else LEVELS
        other = unrun([SHELF, CRATE], sets, levels, im)
        if im == "scale":
            scaled = np.broadcast_to(levels[:, None], (2, 400, 40))
        else:
            power = 2.0 if im == "arias" else 1.0
            measured = np.atleast_2d(other[im].values)[:, None, :]
            scaled = np.broadcast_to((levels[:, None] / measured) ** (1.0 / power), (2, 400, 40))
        other["overturned"] = other["overturned"].copy(data=(scaled > factor[:, None])[:, None])
        first, second = (rank_measures(one, sets, ["Sa(0.5)"], replicates=0) for one in (runs, other))
        both = [str(label) for label in first["measure"].values if label in second["measure"].values]
        assert len(both) == 7
        scatter = [found["amplitude_dispersion"].sel(measure=both).values for found in (first, second)]
        assert scatter[0] == pytest.approx(scatter[1], abs=2.0 * ROUNDING)
        if im in ("pga_normalised", "scale"):
            assert str(second["measure"].values[0]) == im

    def test_block_normalised_measures_tie_for_one_block(self, known):
        runs, sets, *_ = known
        alone = rank_measures(runs, sets, ["pgv_normalised"], replicates=20)
        pair = alone.sel(measure=["pgv", "pgv_normalised"])
        assert pair["dispersion"].values[..., 0] == pytest.approx(pair["dispersion"].values[..., 1], rel=1e-9)
        assert pair["rank"].values.tolist() == [[[1, 1]], [[1, 1]]]
        assert pair["share_best"].values[0, 0, 0] == pair["share_best"].values[0, 0, 1]

    def test_practicality_of_a_power_law(self, known):
        """Demands made to grow with the 1.7th power: the slope in every measure, the scatter in each its own."""
        runs, sets, *_ = known
        found = rank_measures(runs, sets, replicates=30, least_demand=1e-6)
        assert found["practicality"].sel(measure="pgv").values.ravel() == pytest.approx([1.7, 1.7], rel=0.05)
        values = tp.motions.measures(sets)
        # the same regression from all points, one by one
        factors = LEVELS[:, None] / runs["pga"].values
        demand = runs["peak_rotation"].values[0, 0] / runs["alpha"].values[0]
        used = (~runs["overturned"].values[0, 0]) & (demand > 1e-6)
        for label, power in (("pgv", 1.0), ("arias", 2.0), ("cav", 1.0)):
            x = np.log(values[label].values * factors**power)[used]
            fit = sm.OLS(np.log(demand[used]), sm.add_constant(x)).fit()
            one = found.isel(block=0, model=0).sel(measure=label)
            assert one["practicality"].item() == pytest.approx(fit.params[1], rel=1e-9)
            assert one["demand_dispersion"].item() == pytest.approx(np.sqrt(fit.scale), rel=1e-9)
            assert one["proficiency"].item() == pytest.approx(np.sqrt(fit.scale) / fit.params[1], rel=1e-9)
            assert one["practicality_lower"].item() <= one["practicality"].item() <= one["practicality_upper"].item()

    def test_a_line_through_all_demands_leaves_nothing(self, known):
        """What rounding left of the squares was a scatter of 1e-8, other on every processor."""
        runs, sets, *_ = known
        exact = np.exp(0.3 * np.log(LEVELS))[:, None] * np.ones(runs.sizes["motion"])
        one = runs.isel(block=[0], model=[0], motion=[0])
        peaks = 1e-3 * exact[None, None, :, :1] * one["alpha"].values[:, None, None, None]
        shaped = one.assign(
            peak_rotation=(("block", "model", "level", "motion"), peaks),
            overturned=(("block", "model", "level", "motion"), np.zeros(peaks.shape, bool)),
        )
        found = rank_measures(
            shaped, sets[:1] if isinstance(sets, list) else sets.isel(motion=[0]), replicates=5, least_demand=0.0
        )
        assert found["practicality"].sel(measure="pgv").item() == pytest.approx(0.3, rel=1e-9)
        assert found["demand_dispersion"].sel(measure="pgv").item() == 0.0

    def test_runs_in_the_elastic_zone_do_not_rock(self):
        array = tp.motions.CloughPenzien(duration=4.0, dt=0.02).sample(6, 3)
        runs = tp.ida(SHELF, [tp.DiscreteDamping(delta=0.3), tp.HousnerImpact()], array, LEVELS[::4])
        zone = rank_measures(runs, array, replicates=0, least_demand=0.0)
        higher = rank_measures(runs, array, replicates=0, least_demand=0.3)
        assert (zone["practicality"].isel(model=0) == higher["practicality"].isel(model=0)).all()
        assert not (zone["practicality"].isel(model=1) == higher["practicality"].isel(model=1)).any()

    @pytest.mark.slow
    def test_bit_identical_on_rerun_and_for_any_part(self, known):
        runs, sets, *_ = known
        whole = rank_measures(runs, sets, replicates=50, seed=5)
        xr.testing.assert_identical(rank_measures(runs, sets, replicates=50, seed=5), whole)
        part = rank_measures(runs.isel(block=[1]), sets, replicates=50, seed=5)
        xr.testing.assert_identical(part, whole.isel(block=[1]))
        other = rank_measures(runs, sets, replicates=50, seed=6)
        assert (other["dispersion"] == whole["dispersion"]).all()
        assert not (other["dispersion_lower"] == whole["dispersion_lower"]).all()

    def test_without_motions_what_the_runs_carry(self, known):
        found = rank_measures(known[0], replicates=0)
        assert found["measure"].values.tolist() == ["pga", "pgv", "pgd", "arias", "cav"]
        assert np.isnan(found["dispersion_lower"]).all()
        assert found["covariate"].values.tolist() == ["d5_75", "d5_95"]

    def test_damage_states(self, known):
        """The capacity of |theta|/alpha > 0.5 of a power law is a fixed part of that of 1."""
        runs, sets, *_ = known
        half = rank_measures(runs, sets, state=0.5, replicates=0)
        whole = rank_measures(runs, sets, replicates=0)
        assert half["dispersion"].values == pytest.approx(whole["dispersion"].values, rel=5e-3)
        assert half.attrs["state"] == "|theta|/alpha > 0.5"

    def test_censoring_is_reported(self, known):
        runs, sets, *_ = known
        some = runs.sel(level=slice(3.0, 6.0))
        found = rank_measures(some, sets, replicates=0)
        flags = some["overturned"]
        assert found["share_below"].values == pytest.approx(flags.isel(level=0).mean("motion").values)
        assert found["share_above"].values == pytest.approx((~flags.any("level")).mean("motion").values)
        nothing = rank_measures(runs.isel(level=slice(0, 3)), sets, replicates=5)
        assert set(nothing["status"].values.ravel()) == {"no overturning"}
        assert nothing["best"].values.tolist() == [[""], [""]]
        assert (nothing["rank"] == 0).all()


class TestOtherDesigns:
    def test_a_cloud_is_a_probit_in_every_measure(self):
        array = [
            tp.motions.CloughPenzien(duration=4.0, dt=0.02, s0=s0).sample(40, i) for i, s0 in enumerate((0.05, 0.3))
        ]
        runs = tp.fragility.cloud(SHELF, tp.HousnerImpact(), array, "pgv")
        fell = runs["overturned"].values.ravel().astype(float)
        assert 10 < fell.sum() < 70
        found = rank_measures(runs, array, ["Sa(0.5)"], replicates=50)
        values = tp.motions.measures(array, [*tp.motions.MEASURES, "Sa(0.5)"])
        for label in ("pga", "pgv", "arias", "Sa(0.5)"):
            fit = sm.Probit(fell, sm.add_constant(np.log(values[label].values))).fit(disp=0, tol=1e-12)
            one = found.sel(measure=label)
            assert one["dispersion"].item() == pytest.approx(1.0 / fit.params[1], rel=1e-6)
            assert one["dispersion_lower"].item() < one["dispersion"].item() < one["dispersion_upper"].item()

    def test_stripes(self):
        sets = [tp.motions.CloughPenzien(duration=4.0, dt=0.02).sample(20, i) for i in range(4)]
        levels = [2.0, 4.0, 7.0, 12.0]
        runs = tp.fragility.stripes(SHELF, tp.HousnerImpact(), [sets[0], sets[1], sets[2], [sets[0], sets[3]]], levels)
        found = rank_measures(runs, [sets[0], sets[1], sets[2], [sets[0], sets[3]]], ["Sa(0.5)"], replicates=0)
        fits = tp.fit_fragility(runs)
        assert found["dispersion"].sel(measure="pga").item() == pytest.approx(fits["dispersion"].item(), rel=1e-8)
        # Sa of each motion as it was scaled
        plain = {str(one): value for part in sets for one, value in zip(
            part["motion"].values, (tp.motions.measures(part, "Sa(0.5)")["Sa(0.5)"]
                                    / tp.motions.measures(part, "pga")["pga"]).values, strict=True)}  # fmt: skip
        x = np.log(runs["intensity"].values * [plain[str(one)] for one in runs["record"].values])
        fit = sm.Probit(runs["overturned"].values.ravel().astype(float), sm.add_constant(x)).fit(disp=0, tol=1e-12)
        assert found["dispersion"].sel(measure="Sa(0.5)").item() == pytest.approx(1.0 / fit.params[1], rel=1e-6)

    def test_stripes_of_motions_as_they_are_are_a_cloud(self):
        make = tp.motions.CloughPenzien
        sets = [make(duration=4.0, dt=0.02, s0=s0).sample(25, i) for i, s0 in enumerate((0.05, 0.1, 0.3))]
        runs = tp.fragility.stripes(SHELF, tp.HousnerImpact(), sets, [2.0, 3.0, 6.0], scale=False)
        found = rank_measures(runs, sets, replicates=0)
        cloud = rank_measures(tp.fragility.cloud(SHELF, tp.HousnerImpact(), sets), sets, replicates=0)
        assert found["dispersion"].values == pytest.approx(cloud["dispersion"].values, rel=1e-9)

    def test_floors_are_ranked_apart_and_ground_measures_beside(self):
        ground = tp.motions.CloughPenzien(duration=4.0, dt=0.02).sample(12, 4)
        building = tp.motions.Building.flexural_shear(0.5, storeys=3)
        floors = building.floor_motions(ground, floors=[1, 3])
        runs = tp.ida(SHELF, tp.HousnerImpact(), floors, np.geomspace(0.3, 60.0, 60), ground=ground)
        found = rank_measures(runs, floors, replicates=5)
        assert found["dispersion"].dims == ("block", "model", "floor", "measure")
        assert found["floor"].values.tolist() == [1, 3]
        assert "ground_pga" in found["measure"].values
        alone = rank_measures(runs.isel(motion=np.flatnonzero(runs["floor"].values == "3")), floors, replicates=5)
        assert alone["dispersion"].values == pytest.approx(found["dispersion"].sel(floor=3).values)


class TestSufficiency:
    def scenarios(self):
        make = tp.motions.SiteBasedScenario
        pairs = [(6.0, 1e4), (6.5, 3e4), (7.0, 2e4), (7.5, 4e4)]
        return [make(m, d, dt=0.02).sample(12, i) for i, (m, d) in enumerate(pairs)]

    def test_magnitude_and_distance_come_with_scenarios(self):
        sets = self.scenarios()
        assert sets[1]["magnitude"].values.tolist() == [6.5] * 12
        assert sets[1]["distance"].attrs["units"] == "m"
        rng = np.random.default_rng(9)
        runs = unrun(SHELF, sets, np.geomspace(0.5, 20.0, 200))
        magnitude = np.repeat([6.0, 6.5, 7.0, 7.5], 12)
        log_distance = np.log(np.repeat([1e4, 3e4, 2e4, 4e4], 12))
        # capacities in PGA with a trend in magnitude alone
        log_capacity = np.log(4.0) + 0.3 * (magnitude - 6.75) + rng.normal(0.0, 0.1, 48)
        runs["overturned"] = runs["overturned"].copy(
            data=(np.log(runs["level"].values)[:, None] > log_capacity)[None, None]
        )
        found = rank_measures(runs, sets, replicates=0).isel(block=0, model=0)
        assert found["covariate"].values.tolist() == ["magnitude", "distance", "d5_75", "d5_95", "t_mean"]
        one = found.sel(measure="pga", covariate="magnitude")
        fit = sm.OLS(log_capacity, sm.add_constant(magnitude)).fit()
        assert one["slope"].item() == pytest.approx(fit.params[1], rel=2e-2)
        assert one["slope_se"].item() == pytest.approx(fit.bse[1], rel=2e-2)
        assert one["p_value"].item() < 1e-10
        other = sm.OLS(log_capacity, sm.add_constant(log_distance)).fit()
        by_distance = found.sel(measure="pga", covariate="distance")
        assert by_distance["slope"].item() == pytest.approx(other.params[1], rel=2e-2)
        assert np.log(by_distance["p_value"].item()) == pytest.approx(np.log(other.pvalues[1]), rel=0.01)

    def test_p_values_of_no_trend_are_uniform(self):
        """Student's law on the corrected error: of 400 sets of 12 motions without a trend, 5 % are below 0.05."""
        rng = np.random.default_rng(10)
        x = rng.normal(0.0, 1.0, 12)
        low, high = bracketed(rng.normal(0.0, 0.5, (400, 12)), np.linspace(-1.6, 1.6, 30))
        slope, error = fit_trend((low, high), x)
        p = 2.0 * stats.t.sf(np.abs(slope / error), 10)
        assert stats.kstest(p, "uniform").pvalue > 0.01
        assert stats.binomtest(int((p < 0.05).sum()), 400, 0.05).pvalue > 0.01


class TestIntervals:
    def test_the_interval_of_a_difference_holds_what_it_says(self):
        """Two measures of equal dispersion, capacities correlated between them: told apart in some 5 % of 300 sets."""
        rng = np.random.default_rng(11)
        n, sets = 60, 300
        shared = rng.normal(0.0, 0.3, (sets, n))
        grid = np.linspace(-1.5, 1.5, 25)
        ends = [bracketed(shared + rng.normal(0.0, 0.15, (sets, n)), grid) for _ in range(2)]
        found = fit_dispersions(ends, first_all_once(n, 200, 12))[0]
        difference = found[:, 0] - found[:, 1]
        low, high = np.quantile(difference[:, 1:], [0.025, 0.975], axis=1)
        told = int(((low > 0.0) | (high < 0.0)).sum())
        assert 0.02 < told / sets < 0.10
        # variances of values correlated by 0.8 are correlated by 0.64: unpaired intervals would be 1.7 times as wide
        alone = np.diff(np.quantile(found[:, 0, 1:], [0.025, 0.975], axis=1), axis=0)
        assert 0.5 < (high - low).mean() / (np.sqrt(2.0) * alone.mean()) < 0.7

    @pytest.mark.slow
    def test_they_hold_the_dispersions_of_other_grids(self):
        """Of the same few motions at other levels: 90 % with samples of the motions alone."""
        held = []
        for seed in range(3):
            motions = tp.motions.CloughPenzien(duration=8.0, dt=0.02).sample(5, seed)
            values = []
            for number in range(30, 61, 6):
                runs = tp.ida(SHELF, tp.HousnerImpact(), motions, np.geomspace(0.5, 15.0, number), screen=False)
                ranked = rank_measures(runs, motions).isel(block=0, model=0)
                values.append([ranked[f"dispersion{end}"].values for end in ("", "_lower", "_upper")])
            value, lower, upper = np.moveaxis(np.array(values), 1, 0)
            inside = (lower[:, None] <= value) & (value <= upper[:, None])
            others = ~np.eye(len(values), dtype=bool)
            held.append(inside[others][:, np.isfinite(value).all(axis=0)].mean())
        assert np.mean(held) > 0.95

    def test_levels_that_are_close_enough_leave_them_as_they_are(self, known):
        """Capacities that are single and known within a percent: the width is that of the bootstrap over motions."""
        runs, sets, noise, _ = known
        found = rank_measures(runs, sets, replicates=200).sel(measure="pgv").isel(block=0, model=0)
        drawn = first_all_once(40, 200, 0)[1:]
        mean = drawn @ noise / 40.0
        ends = np.quantile(np.sqrt(drawn @ noise**2 / 40.0 - mean**2), [0.025, 0.975])
        assert float(found["dispersion_upper"] - found["dispersion_lower"]) == pytest.approx(np.ptp(ends), rel=0.1)

    @pytest.mark.slow
    @pytest.mark.parametrize("number", [2, 3])
    def test_those_of_few_motions_contain_their_estimates(self, number):
        """Samples of dispersions are biased to low values, most those of few motions."""
        for seed in range(6):
            motions = tp.motions.CloughPenzien(duration=4.0, dt=0.02).sample(number, seed)
            runs = tp.ida([SHELF, CRATE], tp.HousnerImpact(), motions, np.geomspace(1.5, 15.0, 5), screen=False)
            found = rank_measures(runs, motions, replicates=100)
            for name in ("dispersion", "amplitude_dispersion", "excess", "demand_dispersion", "proficiency"):
                value, lower, upper = (found[f"{name}{end}"].values for end in ("", "_lower", "_upper"))
                known = ~np.isnan(lower)
                assert (lower <= value)[known].all(), name
                assert (value <= upper)[known].all(), name

    def test_a_worse_measure_is_told_apart(self):
        rng = np.random.default_rng(13)
        y = rng.normal(0.0, 0.2, (50, 80))
        grid = np.linspace(-1.5, 1.5, 25)
        ends = [bracketed(y, grid), bracketed(y + rng.normal(0.0, 0.25, (50, 80)), grid)]
        found = fit_dispersions(ends, first_all_once(80, 100, 1))[0]
        assert (np.quantile(found[:, 1, 1:] - found[:, 0, 1:], 0.025, axis=1) > 0.0).mean() > 0.9


class TestCapacity:
    def test_between_the_levels(self, known):
        runs, _, _, factor = known
        found = overturning_capacity(runs)
        capacity = (factor * runs["pga"].values)[:, None, :]
        assert found["lower"].dims == ("block", "model", "motion")
        assert np.all(found["lower"].values <= capacity)
        assert np.all(capacity < found["upper"].values)
        assert found["capacity"].values == pytest.approx(capacity, rel=0.01)
        assert found["capacity"].attrs["units"] == "m s-2"
        assert "level" not in found.coords

    def test_levels_in_any_order_and_a_netcdf_file(self, known, tmp_path):
        runs, sets, *_ = known
        xr.testing.assert_allclose(
            overturning_capacity(runs.isel(level=slice(None, None, -1))), overturning_capacity(runs)
        )
        found = rank_measures(runs, sets, replicates=3)
        found.to_netcdf(tmp_path / "ranking.nc")
        with xr.open_dataset(tmp_path / "ranking.nc") as again:
            xr.testing.assert_allclose(again.load(), found)


class TestFigures:
    def test_axes_in_axes_out(self, known):
        import matplotlib.pyplot as plt

        from toppling.studies.plots import efficiency as plots

        runs, sets, *_ = known
        found = rank_measures(runs, sets, ["Sa(0.5)"], replicates=20)
        one = found.isel(block=0, model=0)
        ax = plt.figure().add_subplot()
        assert plots.ranking(one, ax) is ax
        texts = [tick.get_text() for tick in ax.get_yticklabels()]
        assert texts[0].startswith("PGV ")
        assert any(text.startswith("√(Arias intensity)") for text in texts)
        assert ax.get_xlim()[1] >= float(one["amplitude_dispersion_upper"].max())
        figure = plots.ranking_figure(found, "crate")
        assert len(figure.axes) == 1
        both = xr.concat([found, found], xr.DataArray([1, 3], dims="floor", name="floor"))
        assert len(plots.ranking_figure(both, "crate", floor=3).axes) == 1
        with pytest.raises(ValueError, match="of several floors, say which: 1, 3"):
            plots.ranking_figure(both)
        with pytest.raises(ValueError, match="one block and one law"):
            plots.ranking(found)
        plt.close("all")


def test_refused(refusal):
    refusal()
