"""Motions run both ways: mirror symmetry, and intervals that take the two runs of a motion as one draw."""

import json

import numpy as np
import pytest
import scipy
import xarray as xr
from lognormal import fit_lognormal

import toppling as tp
from toppling.fragility import (
    fit_fragility,
    goodness_of_fit,
    overturning_probability,
    rank_measures,
    screen,
    stripes,
    uncertain_ida,
)
from toppling.fragility.efficiency.capacity import overturning_capacity
from toppling.fragility.fitting.isotonic import isotonic_probabilities
from toppling.fragility.runs.provenance import records_of
from toppling.motions.arrays import records
from toppling.motions.polarity import both_polarities

LEVELS = np.linspace(1.0, 8.0, 8)
SIDES = ("overturned", "direction", "peak_rotation")
LAW = tp.HousnerImpact()
FREE = tp.Block(0.4, 1.8, name="free")
FAR = 1e6  # m: a wall out of reach


@pytest.fixture(scope="module")
def motions():
    return tp.motions.CloughPenzien(duration=10.0, dt=0.01).sample(24, seed=3)


def run(block, motions, polarity="both", **options):
    return tp.ida(block, LAW, motions, LEVELS, outputs=SIDES, polarity=polarity, **options)


@pytest.fixture(scope="module")
def free(motions):
    return run(FREE, motions)


@pytest.fixture(scope="module")
def walled(motions):
    return run(tp.Block(0.4, 1.8, name="wall", wall=tp.Wall(0.02)), motions)


def fallen(runs, side):
    return (runs["direction"] == side).sum("motion").values


class TestMotions:
    def test_each_is_followed_by_its_reverse(self, motions):
        plain, both = records(motions), records(both_polarities(motions))
        assert [one.given for one in both[::2]] == [one.given for one in both[1::2]] == [one.label for one in plain]
        for one, there, back in zip(plain, both[::2], both[1::2], strict=True):
            assert np.array_equal(there.acceleration, one.acceleration)
            assert not there.reverse_of
            assert np.array_equal(back.acceleration, -one.acceleration)
            assert back.reverse_of == one.label

    def test_floors_and_single_motions(self, motions):
        floors = tp.motions.Building.flexural_shear(0.5, storeys=2).floor_motions(tp.motions.pad(motions[:2], 0.0, 5.0))
        both = records(both_polarities(floors))
        assert [one.given for one in both[:3]] == [one.given for one in both[3:6]]
        assert both[4].label.startswith(f"{motions['motion'].values[0]}, reversed")
        assert both[4].label.endswith("floor 1")
        alone = motions.isel(motion=0)
        assert [one.label[-8:] for one in records(both_polarities(alone))][1] == "reversed"

    def test_motions_that_have_both_keep_them(self, motions):
        both = both_polarities(motions)
        assert both_polarities(both) is both

    def test_what_is_no_motion_is_refused_as_ever(self):
        with pytest.raises(TypeError, match="motions must be labelled arrays"):
            tp.ida(FREE, LAW, [1.0, 2.0], LEVELS, polarity="both")
        with pytest.raises(ValueError, match="polarity must be one of 'as recorded', 'both', got 'neither'"):
            run(FREE, tp.motions.CloughPenzien(duration=5.0, dt=0.01).sample(1), "neither")


class TestRuns:
    def test_a_symmetric_block_falls_to_both_sides_alike(self, free):
        assert fallen(free, 1).sum() > 50
        assert np.array_equal(fallen(free, 1), fallen(free, -1))

    def test_runs_as_recorded_are_among_them(self, free, motions):
        plain = run(FREE, motions, "as recorded")
        given = free.isel(motion=free["polarity"].values == 1)
        for name in SIDES:
            assert np.array_equal(plain[name].values, given[name].values)
        assert "polarity" not in plain.coords
        assert "polarity" not in plain.attrs["configuration"]

    def test_a_wall_in_front_mirrors_one_behind(self, walled, motions):
        front = run(tp.Block(0.4, 1.8, name="front", wall=tp.Wall(FAR, front_gap=0.02)), motions)
        assert fallen(walled, 1).sum() != fallen(walled, -1).sum()
        for side in (1, -1):
            assert np.array_equal(fallen(walled, side), fallen(front, -side))

    def test_floor_motions_are_scaled_with_their_ground_motions(self, motions):
        ground = tp.motions.pad(motions[:3], 0.0, 5.0)
        floors = tp.motions.Building.flexural_shear(0.5, storeys=2).floor_motions(ground)
        runs = run(FREE, floors, ground=ground)
        assert np.array_equal(fallen(runs, 1), fallen(runs, -1))
        fits = fit_fragility(runs)
        assert fits.sizes["floor"] == 3

    def test_uncertain_blocks(self, motions):
        inputs = tp.fragility.RandomInputs({"e": tp.fragility.Uniform(0.85, 0.95)})
        runs = uncertain_ida(inputs, FREE, LAW, motions, [4.0], outputs=SIDES, samples=3, polarity="both")
        assert np.array_equal(fallen(runs, 1), fallen(runs, -1))

    def test_stripes_and_clouds(self, motions):
        sets = [motions[:12], motions[6:]]
        runs = stripes(FREE, LAW, sets, [3.0, 5.0], outputs=SIDES, polarity="both")
        assert runs.sizes["motion"] == 60
        assert len(set(runs["record"].values)) == 24
        assert np.array_equal(fallen(runs, 1), fallen(runs, -1))
        found = records_of(runs, sets)
        assert all(
            np.array_equal(one.acceleration, sign * motions.sel(motion=name).values)
            for one, sign, name in zip(found, runs["polarity"].values, runs["record"].values, strict=True)
        )
        cloud = tp.fragility.cloud(FREE, LAW, 5.0 * motions, "pgv", polarity="both")
        assert fit_fragility(cloud).attrs["intervals"] == "bootstrap"


class TestIntervals:
    """Two runs that always agree hold what one holds; a bootstrap of 2 N runs would shrink by the root of 2."""

    NAMES = ("median", "median_lower", "median_upper", "dispersion", "dispersion_lower", "dispersion_upper")

    @pytest.mark.parametrize("kind", ["bootstrap", "wald", "profile"])
    def test_runs_that_always_agree(self, free, motions, kind):
        plain = run(FREE, motions, "as recorded")
        both, one = (fit_fragility(runs, intervals=kind, replicates=400) for runs in (free, plain))
        for name in (*self.NAMES, "median_se", "dispersion_se"):
            assert both[name].item() == pytest.approx(one[name].item(), rel=1e-8), name

    def test_of_a_cloud(self):
        shakes = tp.motions.CloughPenzien(duration=10.0, dt=0.01).sample(80, seed=5)
        peaks = np.abs(shakes).max("time").values
        shakes = shakes.copy(data=shakes.values * (np.linspace(2.0, 8.0, 80) / peaks)[:, None])
        both, one = (
            fit_fragility(tp.fragility.cloud(FREE, LAW, shakes, polarity=way), intervals="bootstrap", replicates=400)
            for way in ("both", "as recorded")
        )
        # (of motions that come once there is no widening by the sandwich estimate)
        width = [np.log(fit["median_upper"] / fit["median_lower"]).item() for fit in (both, one)]
        assert width[0] == pytest.approx(width[1], rel=0.2)

    def test_separated_data(self, motions):
        """One mixed level: every motion counts once, whichever way it is run."""
        fell = np.repeat([[0], [1]], 10, axis=1)
        some = np.concatenate([fell[:1], [np.arange(10) < 4], fell[1:]]).astype(bool)
        names = np.array([f"m{i}" for i in range(10)], dtype=object)
        at = {"level": ("level", [1.0, 2.0, 3.0], {"units": "m s-2"})}
        one = xr.Dataset({"overturned": (("level", "motion"), some)}, {**at, "motion": names})
        twice = xr.Dataset(
            {"overturned": (("level", "motion"), np.repeat(some, 2, axis=1))},
            {
                **at,
                "motion": [f"{name}{end}" for name in names for end in ("", ", reversed")],
                "record": ("motion", np.repeat(names, 2)),
                "polarity": ("motion", np.tile([1, -1], 10)),
            },
        )
        fits = [fit_fragility(runs, penalty="none" if k else "auto") for k, runs in enumerate((one, twice))][:1]
        fits.append(fit_fragility(twice))
        assert {fit["status"].item() for fit in fits} == {"separated"}
        widths = [np.log(fit["median_upper"] / fit["median_lower"]).item() for fit in fits]
        assert widths[1] == pytest.approx(widths[0], rel=0.15)  # (the prior weighs half as much)

    def test_isotonic_bands_are_those_of_a_plain_bootstrap_of_motions(self, walled):
        replicates, confidence = 300, 0.9
        fit = fit_fragility(walled, confidence, form="isotonic", replicates=replicates)
        flags = walled["overturned"].squeeze().values.reshape(LEVELS.size, -1, 2)  # level, motion, polarity
        n = flags.shape[1]
        curves = []
        for r in range(replicates):
            rng = np.random.default_rng(np.random.SeedSequence(0, spawn_key=(r,)))
            drawn = flags[:, rng.integers(0, n, n)].reshape(LEVELS.size, -1)
            curves.append(isotonic_probabilities(LEVELS, drawn.sum(axis=1), np.full(LEVELS.size, 2.0 * n)))
        ordered = np.sort(curves, axis=0)
        low, high = ordered[round(0.05 * replicates) - 1], ordered[replicates - round(0.05 * replicates)]
        inside = (fit["probability"].squeeze().values > 0.0) & (fit["probability"].squeeze().values < 1.0)
        assert inside.sum() > 2
        assert np.allclose(fit["probability_lower"].squeeze().values[inside], low[inside], atol=1e-12)
        z2 = scipy.special.ndtri(0.95) ** 2
        high = np.maximum(high, z2 / (n + z2))  # (Wilson's upper end at the levels where none of n motions overturns)
        assert np.allclose(fit["probability_upper"].squeeze().values[inside], high[inside], atol=1e-12)

    def test_standard_errors_are_those_of_a_plain_bootstrap_of_motions(self, walled):
        fit = fit_fragility(walled, replicates=400, keep_replicates=True)
        flags = walled["overturned"].squeeze().values.reshape(LEVELS.size, -1, 2)
        rng = np.random.default_rng(11)
        n = flags.shape[1]
        medians = []
        for _ in range(400):
            drawn = flags[:, rng.integers(0, n, n)].reshape(LEVELS.size, -1).sum(axis=1)
            medians.append(np.log(fit_lognormal(LEVELS, drawn, np.full(LEVELS.size, 2 * n), "auto").median))
        spread = np.log(fit["median_sample"].values).std()
        assert spread == pytest.approx(np.std(medians), rel=0.15)

    def test_observed_probabilities_count_two_trials_and_one_draw(self, free, motions):
        both, one = overturning_probability(free), overturning_probability(run(FREE, motions, "as recorded"))
        assert (both["runs"] == 2 * one["runs"]).all()
        assert (both["overturnings"] == 2 * one["overturnings"]).all()
        for name in ("probability", "lower", "upper"):
            assert np.array_equal(both[name].values, one[name].values)

    @pytest.mark.slow
    @pytest.mark.parametrize("interval", ["wilson", "clopper-pearson", "jeffreys"])
    def test_their_coverage_however_the_two_depend(self, interval):
        """The mean of two trials of one motion varies no more than one trial of the same mean."""
        rng = np.random.default_rng(5)
        p, n, studies = 0.3, 30, 400
        for joint in ("alike", "independent", "opposite"):
            covered = 0
            for _ in range(studies):
                first = rng.random(n)
                second = {"alike": first, "independent": rng.random(n), "opposite": 1.0 - first}[joint]
                fell = np.stack([first < p, second < p], axis=1).ravel()
                runs = xr.Dataset(
                    {"overturned": (("level", "motion"), fell[None])},
                    {
                        "level": [1.0],
                        "record": ("motion", np.repeat(np.arange(n), 2)),
                        "polarity": ("motion", np.tile([1, -1], n)),
                    },
                )
                found = overturning_probability(runs, 0.95, interval=interval)
                covered += bool(found["lower"] <= p <= found["upper"])
            assert covered / studies >= 0.925, joint

    def test_no_overturning_bounds_the_median_by_the_motions(self, motions):
        low = [0.1, 0.2]
        bounds = [
            fit_fragility(tp.ida(FREE, LAW, motions[:count], low, polarity=polarity))["median_lower"].item()
            for count, polarity in ((4, "as recorded"), (4, "both"), (8, "as recorded"))
        ]
        assert np.isnan(bounds[0])
        assert np.isnan(bounds[1])
        assert bounds[2] == 0.2


class TestReadersOfRuns:
    def test_goodness_of_fit_refuses(self, free):
        with pytest.raises(ValueError, match="run both ways: test each polarity by itself"):
            goodness_of_fit(free)
        assert goodness_of_fit(free.isel(motion=free["polarity"].values == 1), replicates=20)["p_value"].item() > 0.0

    @pytest.mark.slow
    def test_ranking_draws_motions(self, free, motions):
        plain = run(FREE, motions, "as recorded")
        both, one = (rank_measures(runs, motions, replicates=50) for runs in (free, plain))
        assert both.attrs["motions"] == one.attrs["motions"] == 24
        for name in ("dispersion", "dispersion_lower", "dispersion_upper", "excess_upper"):
            assert np.allclose(both[name], one[name], rtol=1e-3, equal_nan=True), name
        for name in ("slope", "slope_se", "p_value", "covariate_motions"):
            assert np.array_equal(both[name].values, one[name].values, equal_nan=True), name

    def test_the_screen_counts_motions_and_repeats_runs_of_either(self, walled, motions):
        found = screen(walled, motions, undecided=0.5)
        assert json.loads(found.attrs["screen"])["fewest_motions"] == 24
        assert found["perturbed"].sum() == 24

    def test_capacities_of_either_polarity(self, free):
        found = overturning_capacity(free)
        assert np.array_equal(found["upper"].values[..., ::2], found["upper"].values[..., 1::2])
        assert found["polarity"].dims == ("motion",)
