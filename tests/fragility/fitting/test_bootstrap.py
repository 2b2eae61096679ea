"""The bootstrap over motions: what is drawn, that curves share it, and replicates that cannot be fitted."""

import math
import os
from time import process_time

import numpy as np
import pytest
import xarray as xr
from check_facts import numbers_in
from fit_cases import capacities, clustered, counts, objective, once, profile, striped
from lognormal import fit_lognormal
from scipy.optimize import minimize
from scipy.special import ndtr, xlogy

import toppling as tp
from toppling.fragility import fit_fragility
from toppling.fragility.fitting.bootstrap import draw_motions, percentile_interval, studentised_interval
from toppling.fragility.fitting.links import LINKS
from toppling.fragility.fitting.trials import collect
from toppling.fragility.kernels import binomial as engine

LEVELS = np.geomspace(0.3, 3.0, 10)
IDA = clustered(1, 1, 60, LEVELS, noise=0.15).isel(study=0)


class TestDraws:
    def test_streams(self):
        """Replicate r depends on (seed, r) alone, and is what SeedSequence and numpy say."""
        everything = (np.arange(7),)
        few, many = draw_motions(everything, 3, 5), draw_motions(everything, 50, 5)
        np.testing.assert_array_equal(few, many[:3])
        rng = np.random.default_rng(np.random.SeedSequence(5, spawn_key=(2,)))
        np.testing.assert_array_equal(many[2], np.bincount(rng.integers(0, 7, 7), minlength=7))
        assert (many.sum(axis=1) == 7).all()
        assert not np.array_equal(draw_motions(everything, 50, 6), many)
        assert many.mean(axis=0) == pytest.approx(np.ones(7), abs=0.5)

    def test_strata_keep_their_sizes(self):
        strata = (np.array([0, 3]), np.array([1, 2, 4, 5, 6]))
        weights = draw_motions(strata, 200, 0)
        assert (weights[:, strata[0]].sum(axis=1) == 2).all()
        assert (weights[:, strata[1]].sum(axis=1) == 5).all()

    def test_replicates_are_refits(self):
        """Each kept replicate is the curve of the motions it drew, fitted anew."""
        fit = fit_fragility(IDA, replicates=20, seed=3, keep_replicates=True)
        weights = draw_motions((np.arange(60),), 20, 3)
        flags = IDA["overturned"].values
        for r in range(20):
            drawn = np.repeat(np.arange(60), weights[r].astype(int))
            again = fit_lognormal(LEVELS, flags[:, drawn].sum(axis=1), np.full(10, 60))
            assert fit["median_sample"].values[r] == pytest.approx(again.median, rel=1e-9)
            assert fit["dispersion_sample"].values[r] == pytest.approx(again.dispersion, rel=1e-9)
        assert fit["median_sample"].dims == ("replicate",)
        assert fit["median_sample"].attrs["units"] == "m s-2"
        assert fit.attrs["replicates"] == 20
        assert numbers_in(fit.attrs["method"])[-2:] == [20, 3]

    def test_bit_identical_whatever_is_fitted_beside(self):
        """One curve alone or among others, with or without keeping replicates: the same numbers."""
        two = clustered(2, 3, 40, LEVELS)
        together = fit_fragility(two, replicates=100, keep_replicates=True)
        for i in range(3):
            alone = fit_fragility(two.isel(study=i), replicates=100)
            for name in alone.data_vars:
                np.testing.assert_array_equal(alone[name].values, together[name].isel(study=i).values)

    def test_the_same_motions_serve_all(self):
        """A block whose capacities are all 1.3 times another's: replicates keep the ratio, so its spread is nothing."""
        rng = np.random.default_rng(8)
        capacity = capacities(rng, 1, 80)[0]
        levels = np.geomspace(0.2, 4.0, 200)
        flags = np.stack([capacity <= levels[:, None], 1.3 * capacity <= levels[:, None]])
        runs = xr.Dataset({"overturned": (("block", "level", "motion"), flags)}, coords={"level": levels})
        sample = fit_fragility(runs, replicates=200, keep_replicates=True)["median_sample"]
        ratio = np.log(sample.isel(block=1) / sample.isel(block=0)).values
        assert ratio.mean() == pytest.approx(math.log(1.3), abs=0.005)
        assert ratio.std() < 0.1 * np.log(sample.isel(block=0).values).std()


class TestFloors:
    def runs(self, shuffle=False):
        """Two floors above the same 50 ground motions, the upper twice as bad; labels as toppling.motions has them."""
        rng = np.random.default_rng(9)
        capacity = np.log(capacities(rng, 1, 50)[0])
        order = rng.permutation(50) if shuffle else np.arange(50)
        floors = [(0, capacity, np.arange(50)), (3, capacity - math.log(2.0), order)]
        flags = [c[o] <= np.log(LEVELS)[:, None] for _, c, o in floors]
        labels = [f"quake {i} floor {floor}" for floor, _, o in floors for i in o]
        return xr.Dataset(
            {"overturned": (("level", "motion"), np.concatenate(flags, axis=1))},
            coords={"level": LEVELS, "motion": labels, "floor": ("motion", np.repeat(["0", "3"], 50))},
        )

    def test_floors_are_drawn_together(self):
        plain, shuffled = (fit_fragility(self.runs(s), replicates=300, keep_replicates=True) for s in (False, True))
        assert plain["median"].dims == ("floor",)
        assert plain["floor"].values.tolist() == [0, 3]
        assert plain["floor"].attrs["units"] == "1"
        for name in ("median", "median_lower", "median_sample"):
            np.testing.assert_array_equal(plain[name], shuffled[name])
        first, second = np.log(plain["median_sample"].values)
        assert np.corrcoef(first, second)[0, 1] > 0.9
        assert collect(self.runs()).clusters == 50

    def test_a_studys_results(self):
        """`motion_floor` beside a dimension floor, and counts beside the flags: the flags decide."""
        runs = self.runs()
        results = runs.rename(floor="motion_floor")
        with_counts = results.assign(tp.overturning_probability(runs).data_vars)
        xr.testing.assert_equal(fit_fragility(with_counts, replicates=50), fit_fragility(runs, replicates=50))

    def test_pooled_floors_stay_one_motion(self):
        """Floors dropped: both floors' runs of a ground motion are resampled and summed as one."""
        pooled = self.runs().drop_vars("floor")
        one = pooled.assign_coords(motion=[f"quake {label.split()[1]}" for label in pooled["motion"].values])
        fit, apart = fit_fragility(one, intervals="wald"), fit_fragility(pooled, intervals="wald")
        assert fit["median"].item() == apart["median"].item()
        assert fit["median_se"].item() > 1.05 * apart["median_se"].item()


class TestDesigns:
    def test_stripes_are_drawn_one_by_one(self):
        runs = striped(4, [0.5, 0.8, 1.2, 2.0], 25)
        trials = collect(runs)
        assert trials.design == "stripes"
        assert [one.tolist() for one in trials.strata] == [list(range(25 * i, 25 * i + 25)) for i in range(4)]
        assert not trials.repeated
        fit = fit_fragility(runs)
        assert fit.attrs["intervals"] == "profile"
        # the same as its counts
        k = runs["overturned"].values.reshape(4, 25).sum(axis=1)
        other = fit_fragility(counts([0.5, 0.8, 1.2, 2.0], k, 25))
        for name in ("median", "dispersion", "median_upper", "dispersion_lower", "log_likelihood"):
            assert fit[name].item() == pytest.approx(other[name].item(), rel=1e-12)
        drawn = fit_fragility(runs, intervals="bootstrap", replicates=2000)
        model = fit_fragility(counts([0.5, 0.8, 1.2, 2.0], k, 25), intervals="bootstrap", replicates=2000)
        for name in ("median_lower", "median_upper", "dispersion_lower", "dispersion_upper"):
            assert drawn[name].item() == pytest.approx(model[name].item(), rel=0.04)

    def test_a_motion_in_several_stripes(self):
        """It is drawn as one: no strata then, and errors are summed over its runs."""
        rng = np.random.default_rng(6)
        levels = np.geomspace(0.3, 3.0, 12)
        capacity = capacities(rng, 1, 40)[0]
        motion = np.tile(np.arange(40), 12)
        runs = xr.Dataset(
            {"overturned": ("motion", np.repeat(levels, 40) >= capacity[motion])},
            coords={
                "motion": [f"m{i}, stripe {k + 1}" for k in range(12) for i in range(40)],
                "record": ("motion", [f"m{i}" for i in motion]),
                "stripe": ("motion", np.repeat(np.arange(1, 13), 40)),
                "intensity": ("motion", np.repeat(levels, 40)),
            },
        )
        trials = collect(runs)
        assert trials.repeated
        assert trials.clusters == 40
        assert len(trials.strata) == 1
        ida = xr.Dataset({"overturned": (("level", "motion"), capacity <= levels[:, None])}, coords={"level": levels})
        for options in ({"replicates": 100}, {"intervals": "wald"}):
            one, other = fit_fragility(runs, **options), fit_fragility(ida, **options)
            for name in other.data_vars:
                np.testing.assert_array_equal(one[name].values, other[name].values)

    def test_cloud(self):
        runs = once(12, np.random.default_rng(13).lognormal(0.0, 0.6, 150))
        profile = fit_fragility(runs)
        assert profile.attrs["intervals"] == "profile"
        assert profile.attrs["design"] == "cloud"
        drawn = fit_fragility(runs, intervals="bootstrap")
        assert drawn["median"].item() == profile["median"].item()
        for name in ("median_lower", "median_upper", "dispersion_lower", "dispersion_upper"):
            assert drawn[name].item() == pytest.approx(profile[name].item(), rel=0.15)
            assert drawn[name].item() != profile[name].item()

    def test_an_intensity_of_the_block(self):
        """PGA/(g tan alpha) differs from block to block: medians do, and each is that of the block alone."""
        rng = np.random.default_rng(14)
        intensity = rng.lognormal(0.0, 0.6, (2, 120)) * np.array([[1.0], [2.0]])
        fell = capacities(rng, 1, 120)[0] * np.array([[1.0], [2.0]]) <= intensity
        runs = xr.Dataset(
            {"overturned": (("block", "motion"), fell)}, coords={"intensity": (("block", "motion"), intensity)}
        )
        fit = fit_fragility(runs)
        for i in range(2):
            assert fit["median"].values[i] == fit_fragility(runs.isel(block=i))["median"].item()
        with pytest.raises(ValueError, match="differ between blocks here"):
            fit_fragility(runs, form="isotonic", replicates=2)

    def test_the_real_thing(self):
        """Runs as toppling.stripes and toppling.cloud make them."""
        sets = [tp.motions.CloughPenzien(duration=8.0, dt=0.01).sample(12, seed=i) for i in (1, 2, 3)]
        blocks = [tp.catalogue["bookcase-5-shelf"], tp.Block(0.5, 1.2, name="crate")]
        runs = tp.stripes(blocks, tp.HousnerImpact(), sets, [2.0, 4.0, 8.0])
        fit = fit_fragility(runs)
        xr.testing.assert_allclose(
            fit[["median", "dispersion"]], fit_fragility(tp.overturning_probability(runs))[["median", "dispersion"]]
        )
        assert fit["median"].dims == ("block", "model")
        assert fit["median"].attrs["units"] == "m s-2"
        shakes = [3.0 * one for one in sets]
        cloud = tp.cloud(
            blocks,
            tp.HousnerImpact(),
            [one.assign_coords(motion=labels) for one, labels in zip(shakes, _labels(3, 12), strict=True)],
            "pga_normalised",
        )
        fit = fit_fragility(cloud)
        assert set(fit["status"].values.ravel()) <= {"ok", "separated"}
        assert bool((fit["median"] > 1.0).all())  # nothing falls below the threshold of rocking
        assert fit["median"].attrs["units"] == "1"

    def test_another_damage_state(self):
        peak = np.abs(np.random.default_rng(3).normal(0.0, 0.2, (6, 40))) * np.linspace(0.2, 2.0, 6)[:, None]
        runs = xr.Dataset(
            {"overturned": (("level", "motion"), peak > 0.2), "peak_rotation": (("level", "motion"), peak)},
            coords={"level": np.linspace(0.5, 3.0, 6), "alpha": 0.2},
        )
        half, whole = fit_fragility(runs, state=0.5, replicates=20), fit_fragility(runs, replicates=20)
        assert half["median"].item() < whole["median"].item()
        assert half.attrs["state"] == "|theta|/alpha > 0.5"
        same = fit_fragility(tp.overturning_probability(runs, state=0.5))
        assert half["median"].item() == same["median"].item()


def _labels(sets, motions):
    return [[f"set {i} motion {j}" for j in range(motions)] for i in range(sets)]


class TestIntervals:
    def test_percentiles_and_missing_replicates(self):
        """Fewer missing than a tail holds: the next ones; more: no end."""
        samples = np.arange(1000.0)
        assert percentile_interval(samples, 0.95, against=True) == (24.0, 975.0, 1000)
        samples[:10] = np.nan
        low, high, used = percentile_interval(np.random.default_rng(1).permutation(samples), 0.95, against=True)
        assert used == 990
        assert low == 24.0  # ten below everything, and the fifteen lowest of the others
        assert high == 985.0
        samples[:40] = np.nan
        assert percentile_interval(samples, 0.95, against=True)[:2] == (-np.inf, np.inf)

    @pytest.mark.parametrize("confidence", [0.5, 0.9, 0.95, 0.999])
    def test_percentiles_as_numpy_has_them(self, confidence):
        """Order statistics either way, for any number of replicates; whole weights are repeated replicates."""
        rng = np.random.default_rng(5)
        tail = 0.5 - 0.5 * confidence
        for n in (1, 2, 7, 40, 333, 1000):
            samples = rng.normal(0.0, 1.0, (3, 2, n))
            found = percentile_interval(samples, confidence)
            weights = rng.integers(1, 5, n)
            weighted = percentile_interval(samples, confidence, weights / weights.sum())
            for ends, every in ((found, samples), (weighted, np.repeat(samples, weights, axis=-1))):
                # a tail of 0.025 is a little more in binary, and 40 times it is 1
                lower, upper = (
                    s * np.quantile(s * every, tail - 1e-12, -1, method="inverted_cdf") for s in (1.0, -1.0)
                )
                np.testing.assert_array_equal(ends.lower, lower)
                np.testing.assert_array_equal(ends.upper, upper)
                np.testing.assert_array_equal(ends.used, np.full((3, 2), n))

    def test_percentiles_of_what_is_infinite_or_missing(self):
        samples = np.array([[-np.inf, 1.0, 2.0, np.inf], [np.nan, 1.0, 2.0, np.inf], [np.nan] * 4])
        found = percentile_interval(samples, 0.5)
        np.testing.assert_array_equal(found.lower, [-np.inf, 1.0, np.nan])
        np.testing.assert_array_equal(found.upper, [np.inf, np.inf, np.nan])
        assert found.used.tolist() == [4, 3, 0]
        against = percentile_interval(samples, 0.5, against=True)
        np.testing.assert_array_equal(against.lower, [-np.inf, -np.inf, -np.inf])
        np.testing.assert_array_equal(against.upper, [np.inf, np.inf, np.inf])
        nothing = percentile_interval(np.empty((2, 0)), 0.9)
        assert np.isnan(nothing.lower).all()
        assert nothing.used.tolist() == [0, 0]

    def test_studentised(self):
        """With errors of one size it mirrors the percentiles about the estimate."""
        samples = np.random.default_rng(2).gamma(3.0, 1.0, 5000)
        low, high, _ = percentile_interval(samples, 0.9)
        found = studentised_interval(3.0, 0.5, samples, np.full(5000, 0.5), 0.9)
        assert found == pytest.approx((6.0 - high, 6.0 - low))

    def test_counts_agree_with_the_profile(self):
        """Where runs are independent the bootstrap and the likelihood say nearly the same."""
        levels = np.geomspace(0.4, 2.5, 8)
        data = counts(levels, np.rint(2000 * ndtr(np.log(levels) / 0.4)).astype(int), 2000)
        one, other = fit_fragility(data, intervals="bootstrap", replicates=4000), fit_fragility(data)
        for name in ("median", "dispersion"):
            width = np.log(other[f"{name}_upper"] / other[f"{name}_lower"]).item()
            for end in ("lower", "upper"):
                found, expected = one[f"{name}_{end}"].item(), other[f"{name}_{end}"].item()
                assert abs(math.log(found / expected)) < 0.04 * width

    def test_counts_are_drawn_for_each_curve_by_itself(self):
        """Nothing says that two curves' counts share motions: equal curves get independent replicates."""
        twice = counts([1.0, 2.0, 3.0], [[5, 20, 35], [5, 20, 35]])
        first, second = np.log(fit_fragility(twice, replicates=400, keep_replicates=True)["median_sample"].values)
        assert abs(np.corrcoef(first, second)[0, 1]) < 0.15
        one = fit_fragility(twice.isel(set0=0), replicates=400, keep_replicates=True)
        np.testing.assert_array_equal(np.log(one["median_sample"].values), first)

    def test_parameters_do_not_matter(self):
        """Levels in other units: ends in other units; a fractile of one half is the median."""
        fit = fit_fragility(IDA, fractiles=(0.1, 0.5, 0.9), replicates=400)
        scaled = fit_fragility(IDA.assign_coords(level=LEVELS / 9.80665), fractiles=(0.1, 0.5, 0.9), replicates=400)
        for name in ("median_lower", "median_upper", "fractile_lower", "fractile_upper"):
            np.testing.assert_allclose(scaled[name], fit[name] / 9.80665, rtol=1e-9)
        np.testing.assert_allclose(scaled["dispersion_upper"], fit["dispersion_upper"], rtol=1e-9)
        assert fit["fractile"].attrs["units"] == fit["fractile_lower"].attrs["units"] == "m s-2"
        middle = fit.sel(fraction=0.5)
        assert middle["fractile_lower"].item() == pytest.approx(fit["median_lower"].item(), rel=1e-10)
        assert bool((fit["fractile_lower"] < fit["fractile"]).all() & (fit["fractile"] < fit["fractile_upper"]).all())

    def test_profile_of_an_ida_is_widened(self):
        """By the root of the ratio of the variances, to first order."""
        found = {kind: fit_fragility(IDA, intervals=kind) for kind in ("wald", "profile", "bootstrap")}
        k = IDA["overturned"].sum("motion").values
        naive = {kind: fit_fragility(counts(LEVELS, k, 60), intervals=kind) for kind in ("wald", "profile")}
        for name in ("median", "dispersion"):
            widths = {
                kind: math.log(fit[f"{name}_upper"].item() / fit[f"{name}_lower"].item()) for kind, fit in found.items()
            }
            plain = {
                kind: math.log(fit[f"{name}_upper"].item() / fit[f"{name}_lower"].item()) for kind, fit in naive.items()
            }
            assert widths["profile"] / plain["profile"] == pytest.approx(widths["wald"] / plain["wald"], rel=0.02)
            assert 0.9 < widths["bootstrap"] / widths["profile"] < 1.4
            assert widths["profile"] > 1.15 * plain["profile"]


class TestRoots:
    """Signed roots of the likelihood ratio of replicates, those without a maximum included."""

    LEVELS = np.array([1.0, 2.0, 3.0, 4.0])

    @pytest.mark.parametrize(
        ("k", "fraction", "above"),
        [
            # falls of ten at each level; the greatest likelihood, as fractions of them; the median's side of 2.2
            ([0, 3, 8, 10], None, True),
            ([0, 0, 10, 10], [0.0, 0.0, 1.0, 1.0], True),
            ([0, 4, 10, 10], [0.0, 0.4, 1.0, 1.0], False),
            ([0, 0, 0, 0], [0.0, 0.0, 0.0, 0.0], True),
            ([10, 10, 10, 10], [1.0, 1.0, 1.0, 1.0], False),
            ([6, 3, 2, 2], [0.325] * 4, True),
            ([8, 7, 8, 5], [0.7] * 4, False),
        ],
    )
    def test_counts(self, k, fraction, above):
        k, n, link = np.array(k, float), np.full(4, 10.0), LINKS["lognormal"]
        if fraction is None:
            fit = fit_fragility(counts(self.LEVELS, k.astype(int), 10))
            top, above = fit["log_likelihood"].item(), fit["median"].item() > 2.2
        else:
            p = np.array(fraction)
            top = np.sum(xlogy(k, p) + xlogy(n - k, 1.0 - p))
        roots = self.roots(engine.BINOMIAL, k[None], n[None])
        loss = objective(link, np.log(self.LEVELS), k, n)
        # (a curve that falls is no curve: the best of those whose median is at 2.2 may be level, at one half)
        of_median = min(profile(loss, link, 0.5, math.log(2.2)), loss(0.0, 0.0))
        assert abs(roots[0]) == pytest.approx(math.sqrt(2.0 * (top + of_median)), abs=2e-5)
        assert (roots[0] > 0.0) == above
        of_dispersion = profile(loss, link, None, math.log(0.3)) if 0 < k.sum() < 40 else 0.0
        assert abs(roots[1]) == pytest.approx(math.sqrt(max(2.0 * (top + of_dispersion), 0.0)), abs=2e-5)
        if fraction is not None and abs(roots[1]) > 1e-3:  # the slope is beyond all bounds, or none
            assert (roots[1] > 0.0) == (k[0] == 0.0)

    @pytest.mark.parametrize(
        ("k", "exists", "above"),
        [
            ([1, 4, 3, 1, 1], True, False),
            ([0, 4, 6, 0, 0], False, False),  # a step at 2, with 0.4 on it
            ([4, 0, 0, 0, 6], False, True),  # level at 0.4
            ([0, 0, 10, 0, 0], False, None),  # a step anywhere between 2 and 3: as likely at 2.2
        ],
    )
    def test_first_overturnings(self, k, exists, above):
        k, n, link = np.array(k, float), np.full(4, 10.0), LINKS["lognormal"]
        top = np.sum(xlogy(k, k / 10.0))
        loss = objective(link, np.log(self.LEVELS), k, None, first=True)
        if exists:
            top = -minimize(
                lambda q: loss(-q[0] * math.exp(q[1]), math.exp(q[1])),
                [0.8, 0.5],
                method="Nelder-Mead",
                options={"xatol": 1e-10, "fatol": 1e-13},
            ).fun
        of_median, of_dispersion = self.roots(engine.INTERVAL, k[None], n[None])
        if above is None:
            assert of_median == pytest.approx(0.0, abs=1e-7)
        else:
            fall = top + profile(loss, link, 0.5, math.log(2.2))
            assert of_median == pytest.approx((1.0 if above else -1.0) * math.sqrt(2.0 * fall), abs=2e-5)
        fall = top + profile(loss, link, None, math.log(0.3))
        assert abs(of_dispersion) == pytest.approx(math.sqrt(2.0 * fall), abs=2e-5)
        if not exists:
            assert (of_dispersion > 0.0) == (k[0] == 0.0)

    def roots(self, kind, k, n):
        """Of the median at 2.2 and of the dispersion at 0.3, on the scale of ln x."""
        x = np.log(self.LEVELS)
        fits = np.empty((1, engine.COLUMNS))
        engine.fit_many(kind, engine.PROBIT, x, k, n, engine.WHERE_SEPARATED, np.empty(0), fits)
        found = []
        for what, at, free in ((engine.FRACTILE, math.log(2.2), 1.0 / 0.3), (engine.SLOPE, -math.log(0.3), -2.6)):
            out = np.empty(1)
            engine.signed_roots(kind, engine.PROBIT, x, k, n, fits, False, what, 0.0, at, free, out)
            found.append(float(out[0]))
        return found


class TestHardReplicates:
    def test_separated_ones_are_penalised_and_counted(self):
        """Twelve motions near one level gap: many replicates are separated, none is lost."""
        runs = clustered(22, 1, 12, [0.6, 1.0, 1.7], dispersion=0.35).isel(study=0)
        assert fit_fragility(runs)["status"].item() == "ok"
        fit = fit_fragility(runs, keep_replicates=True)
        assert fit["penalised_replicates"].item() > 50
        assert fit["failed_replicates"].item() == 0
        assert not bool(fit["penalised"])
        assert np.isfinite(fit["median_sample"].values).all()
        assert (fit["dispersion_sample"].values > 0.0).all()
        # penalised there even where the data themselves are not to be
        plain = fit_fragility(runs, keep_replicates=True, penalty="none")
        xr.testing.assert_equal(plain, fit)

    def test_replicates_without_any_overturning(self):
        """Two of thirty motions fall, at the highest level: some replicates have none, and the upper end is open."""
        capacity = np.full(30, 9.0)
        capacity[:2] = (0.9, 1.8)
        levels = np.array([0.5, 1.0, 2.0])
        runs = xr.Dataset({"overturned": (("level", "motion"), capacity <= levels[:, None])}, coords={"level": levels})
        fit = fit_fragility(runs, keep_replicates=True)
        lost = np.isnan(fit["median_sample"].values)
        assert fit["failed_replicates"].item() == lost.sum() > 50
        assert fit["median_upper"].item() == np.inf
        assert 2.0 < fit["median_lower"].item() < fit["median"].item()

    def test_one_motion(self):
        """A pulse study: one capacity between two levels.  Penalised, with the profile's honest width."""
        runs = clustered(1, 1, 1, LEVELS).isel(study=0)
        fit = fit_fragility(runs)
        assert fit["status"].item() == "separated"
        fell = runs["overturned"].values[:, 0].argmax()
        assert LEVELS[fell - 1] < fit["median"].item() < LEVELS[fell]
        assert fit["median_upper"].item() / fit["median_lower"].item() > LEVELS[fell] / LEVELS[fell - 1]
        assert fit["dispersion_upper"].item() > 0.15


@pytest.mark.skipif(os.environ.get("NUMBA_DISABLE_JIT") == "1", reason="minutes without the compiler")
def test_ten_thousand_replicates_in_seconds():
    """Of 200 motions at 20 levels, everything included; a tenth of it in a second on an idle core."""
    runs = clustered(5, 1, 200, np.geomspace(0.25, 4.0, 20), noise=0.15).isel(study=0)
    fit_fragility(runs, replicates=10)
    started = process_time()
    fit_fragility(runs, replicates=10_000)
    assert process_time() - started < 15.0


def test_refused(refusal):
    refusal()
