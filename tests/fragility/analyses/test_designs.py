"""Stripes and clouds beside the incremental analysis; outputs on request; damage states."""

import math
import warnings

import numpy as np
import pytest
import xarray as xr

import toppling as tp
from toppling.core.doubts import ImplausibleInput
from toppling.fragility import reached
from toppling.models.outputs import OF_ENGINE
from toppling.models.runs import trace

BLOCKS = [tp.catalogue["bookcase-5-shelf"], tp.Block(width=0.5, height=1.2, name="crate")]
MODELS = [tp.DiscreteDamping(), tp.HousnerImpact(geometry="linear")]
LEVELS = [2.0, 3.5, 6.0]
ALL = ["overturned", "peak_rotation", "uplifted", "impact_velocity", "direction", "top_displacement"]


def of_unit(values, units):
    return xr.DataArray(values, dims="level", attrs={"units": units})


def shakes(n, seed=0):
    return tp.motions.CloughPenzien(duration=8.0, dt=0.01).sample(n, seed)


@pytest.fixture(scope="module")
def ida():
    return tp.ida(BLOCKS, MODELS, shakes(12), LEVELS, outputs=ALL)


class TestStripes:
    def test_one_set_at_every_level_is_the_incremental_analysis(self, ida):
        motions = shakes(12)
        runs = tp.stripes(BLOCKS, MODELS, [motions] * 3, LEVELS, outputs=ALL)
        assert runs.attrs["design"] == "stripes"
        assert runs.motion.values[13] == f"{motions.motion.values[1]}, stripe 2"
        assert runs.record.values[13] == motions.motion.values[1]
        for name in ALL:
            found = runs[name].values.reshape(2, 2, 3, 12)
            np.testing.assert_array_equal(found, ida[name].values)
        counts, expected = tp.overturning_probability(runs), tp.overturning_probability(ida)
        for name in ("overturnings", "runs", "probability", "lower", "upper"):
            xr.testing.assert_equal(counts[name], expected[name])
        assert counts.level.attrs == ida.level.attrs

    def test_motions_that_differ_and_differ_in_number(self):
        sets = [shakes(3, seed=1), [shakes(4, seed=2), shakes(1, seed=3)]]
        runs = tp.stripes(BLOCKS, MODELS, sets, [2.0, 5.0], "pgv_normalised", outputs="overturned")
        assert runs.intensity.values.tolist() == [2.0] * 3 + [5.0] * 5
        assert runs.pgv_normalised.dims == ("block", "motion")
        counts = tp.overturning_probability(runs)
        assert counts.runs.isel(block=0, model=0).values.tolist() == [3, 5]
        alone = tp.ida(BLOCKS, MODELS, sets[1], [2.0, 5.0], "pgv_normalised", outputs="overturned")
        np.testing.assert_array_equal(runs.overturned.values[:, :, 3:], alone.overturned.values[:, :, 1])

    def test_motions_as_they_are(self):
        sets = [shakes(5, seed=1), 3.0 * shakes(5, seed=2)]
        runs = tp.stripes(BLOCKS, MODELS, sets, [1.0, 3.0], scale=False)
        cloud = tp.cloud(BLOCKS, MODELS, sets[:1])
        np.testing.assert_array_equal(runs.peak_rotation.values[:, :, :5], cloud.peak_rotation.values)
        assert runs.intensity.values.tolist() == [1.0] * 5 + [3.0] * 5

    @pytest.mark.parametrize(
        ("im", "levels", "said"),
        [
            ("pga", [0.5, 3.0], "stripe 2 of 3 in SI: they have 0.50 times as much in the mean, 0.50 to 0.50"),
            ("pga", [1.7], "stripe 1 of 1.7 in SI: they have 0.29 times as much"),
            ("scale", [1.0, 2.0], "the scale of the motions is not that of 1 stripe .stripe 2 of 2 in SI"),
            # PGA over g tan(alpha) of a block of 0.4 x 1.6 m is 1.5 / 9.80665 * 4 = 0.61
            ("pga_normalised", [0.204, 0.5], "stripe 2 of 0.5 in SI: they have 1.2 times"),
        ],
    )
    def test_levels_that_unscaled_motions_do_not_have(self, im, levels, said):
        """Sines of 0.5 and 1.5 m/s2; the scale of what is not scaled is 1."""
        sine = np.sin(2.0 * np.pi * np.arange(201) / 100.0)
        sets = [tp.motions.from_array(peak * sine, 0.01) for peak in (0.5, 1.5)][: len(levels)]
        options = {"scale": False, "screen": False}
        with pytest.warns(ImplausibleInput, match=said):
            tp.stripes(tp.Block(0.4, 1.6), tp.HousnerImpact(), sets, levels, im, **options)
        with warnings.catch_warnings(action="error"):
            tp.stripes(tp.Block(0.4, 1.6), tp.HousnerImpact(), sets, [0.5, 1.5][: len(levels)], **options)

    def test_floors_are_told_apart(self):
        building = tp.motions.Building.flexural_shear(period=0.5, storeys=2)
        ground = [shakes(4, seed=1), shakes(4, seed=2)]
        floors = [building.floor_motions(one) for one in ground]
        runs = tp.stripes(BLOCKS[0], MODELS, floors, [2.0, 4.0], ground=ground, outputs="overturned")
        counts = tp.overturning_probability(runs)
        assert counts.probability.dims == ("block", "model", "floor", "level")
        assert counts.runs.values.tolist() == [[[[4, 4]] * 3] * 2]
        below = tp.stripes(BLOCKS[0], MODELS, ground, [2.0, 4.0], outputs="overturned")
        on_ground = counts.overturnings.sel(floor=0).drop_vars("floor")
        xr.testing.assert_equal(on_ground, tp.overturning_probability(below).overturnings)


def test_a_level_alone():
    runs = [tp.ida(BLOCKS[0], MODELS[0], shakes(2), levels) for levels in (2.0, np.array(2.0), [2.0])]
    xr.testing.assert_identical(runs[0], runs[2])
    xr.testing.assert_identical(runs[1], runs[2])


@pytest.mark.parametrize(
    ("im", "own", "others"),
    [
        ("pgv", ("m/s", "m s-1", ""), ("ft/s", "cm/s", "g")),
        ("pga", ("m/s²", "m s-2"), ("g", "cm/s2", "m/s")),
        ("pga_normalised", ("1", ""), ("g",)),
        ("scale", ("1", "dimensionless"), ("m s-2",)),
    ],
)
def test_units_of_labelled_levels(im, own, others):
    """Levels of xarray may say the unit of the measure; another one is refused."""
    motions = shakes(2)
    plain = tp.ida(BLOCKS[0], MODELS[0], motions, [1.0], im, outputs="overturned")
    for units in own:
        labelled = tp.ida(BLOCKS[0], MODELS[0], motions, of_unit([1.0], units), im, outputs="overturned")
        xr.testing.assert_equal(labelled, plain)
    again = tp.ida(BLOCKS[0], MODELS[0], motions, plain.level, im, outputs="overturned")
    xr.testing.assert_equal(again, plain)
    for units in others:
        with pytest.raises(ValueError, match=f"levels must be in {plain.level.attrs['units']}, got units '{units}'"):
            tp.ida(BLOCKS[0], MODELS[0], motions, of_unit([1.0], units), im)
        if im != "scale":
            with pytest.raises(ValueError, match=f"got units '{units}'"):
                tp.stripes(BLOCKS[0], MODELS[0], [motions], of_unit([1.0], units), im)


class TestCloud:
    def test_every_motion_as_it_is(self):
        motions = 4.0 * shakes(6)
        motions.attrs = shakes(1).attrs
        runs = tp.cloud(BLOCKS, MODELS, motions, "pgv", outputs=ALL)
        plain = tp.ida(BLOCKS, MODELS, motions, [1.0], "scale", outputs=ALL)
        for name in ALL:
            np.testing.assert_array_equal(runs[name].values, plain[name].values[:, :, 0])
        np.testing.assert_array_equal(runs.intensity.values, tp.motions.measures(motions).pgv.values)
        assert runs.intensity.attrs["im"] == "pgv"
        assert runs.attrs["design"] == "cloud"
        normalised = tp.cloud(BLOCKS, MODELS, motions, "pgv_normalised")
        expected = runs.intensity * runs.p / (9.80665 * np.tan(runs.alpha))
        np.testing.assert_allclose(normalised.intensity, expected.transpose("block", "motion"), rtol=1e-15)


class TestOutputs:
    def test_direction_and_displacement(self, ida):
        np.testing.assert_array_equal(ida.direction != 0, ida.overturned)
        assert set(np.unique(ida.direction)) == {-1, 0, 1}
        np.testing.assert_allclose(ida.top_displacement, ida.height * np.sin(ida.peak_rotation))
        run = ida.isel(block=0, model=1, level=2)
        fallen = int(np.flatnonzero(run.overturned.values)[0])
        scaled = tp.motions.scale_to(shakes(12).isel(motion=[fallen]), LEVELS[2])
        history = tp.simulate(BLOCKS[0], MODELS[1], scaled)
        assert np.sign(history.rotation.values[-1]) == run.direction.values[fallen]

    @pytest.mark.parametrize(("model", "edge"), [(MODELS[1], 0.0), (MODELS[0], 0.05)])
    def test_impact_velocity_of_a_free_block(self, model, edge):
        """omega² = q² [(2 x0 - x0²) - (2 d - d²)] alpha² at the edge d of what the block comes down on."""
        block, x0 = BLOCKS[0], 0.5
        oscillator = model.oscillator(block)
        run = trace(oscillator, np.zeros(400), 0.01, theta0=x0 * block.alpha)
        q2 = -oscillator.regions[-1].stiffness
        expected = block.alpha * math.sqrt(q2 * ((2 * x0 - x0**2) - (2 * edge - edge**2)))
        assert run.results[OF_ENGINE["impact_velocity"]] == pytest.approx(expected, rel=1e-12)

    def test_impact_velocity_is_the_greatest_before_an_impact(self, ida):
        """The velocity jumps at impacts of Housner's block: the history's steps never exceed what is reported."""
        motions = shakes(12).isel(motion=[0])
        run = tp.simulate(BLOCKS[0], MODELS[1], tp.motions.scale_to(motions, LEVELS[0]))
        reported = float(ida.impact_velocity.isel(block=0, model=1, level=0, motion=0))
        theta, omega = run.rotation.values, run.angular_velocity.values
        crossing = np.flatnonzero(theta[:-1] * theta[1:] < 0.0)
        assert crossing.size > 3
        speeds = np.abs(omega[crossing])  # up to one sample before the impact
        reach = 0.01 * np.abs(run.angular_acceleration.values).max()
        assert speeds.max() - reach <= reported <= speeds.max() + reach
        assert (ida.impact_velocity.values[ida.uplifted.values & (ida.peak_rotation.values < 1.0)] > 0.0).any()


class TestDamageStates:
    def test_states_are_nested(self, ida):
        order = [reached(ida, state).values for state in ("uplifted", 0.1, 0.5, 1.0, "overturned")]
        for weaker, stronger in zip(order[:-1], order[1:], strict=True):
            assert not (stronger & ~weaker).any()
        assert [flags.sum() for flags in order] == sorted((flags.sum() for flags in order), reverse=True)

    def test_counts_of_a_state(self, ida):
        found = tp.overturning_probability(ida, state=0.5)
        expected = (ida.peak_rotation > 0.5 * ida.alpha).sum("motion")
        np.testing.assert_array_equal(found.overturnings, expected)
        assert found.attrs["state"] == "|theta|/alpha > 0.5"
        assert found.probability.attrs["long_name"].endswith(found.attrs["state"])


def described_motions(names, **coordinates):
    waves = np.sin(np.arange(400) * 0.05) * np.linspace(2.0, 4.0, len(names))[:, None]
    array = tp.motions.from_array(waves, 0.01, names)
    return array.assign_coords({name: ("motion", list(values)) for name, values in coordinates.items()})


class TestCoordinatesOfMotions:
    """Magnitude and the like go with the motions, by their labels."""

    BLOCK, LAW = tp.Block(0.4, 1.6, name="a"), tp.HousnerImpact()

    def of(self, result, name):
        return dict(zip(result["motion"].values.tolist(), result[name].values.tolist(), strict=True))

    def runs(self, analysis, motions, **options):
        if analysis == "ida":
            return tp.ida(self.BLOCK, self.LAW, motions, [1.0, 3.0], **options)
        if analysis == "stripes":
            return tp.stripes(self.BLOCK, self.LAW, motions, [1.0, 3.0], **options)
        return tp.cloud(self.BLOCK, self.LAW, motions, **options)

    @pytest.mark.parametrize("analysis", ["ida", "cloud"])
    def test_are_kept_and_missing_where_an_array_has_none(self, analysis):
        first = described_motions(["p", "q"], magnitude=[6.5, 7.0], station=["AAA", "BBB"])
        first["magnitude"].attrs["long_name"] = "moment magnitude"
        second = described_motions(["r"], vs30=[360])
        runs = self.runs(analysis, iter([first, second]))
        assert self.of(runs, "station") == {"p": "AAA", "q": "BBB", "r": ""}
        assert runs["magnitude"].values[:2].tolist() == [6.5, 7.0]
        assert np.isnan(runs["magnitude"].values[2])
        assert runs["magnitude"].attrs["long_name"] == "moment magnitude"
        assert np.isnan(runs["vs30"].values[:2]).all()
        assert runs["vs30"].values[2] == 360.0

    def test_of_a_single_motion(self):
        one = described_motions(["p", "q"], magnitude=[6.5, 7.0]).isel(motion=1)
        assert self.runs("cloud", one)["magnitude"].values.tolist() == [7.0]

    def test_of_motions_run_both_ways(self):
        runs = self.runs("ida", described_motions(["p", "q"], magnitude=[6.5, 7.0]), polarity="both")
        assert self.of(runs, "magnitude") == {"p": 6.5, "p, reversed": 6.5, "q": 7.0, "q, reversed": 7.0}

    def test_of_floor_motions(self):
        ground = described_motions(["p", "q"], magnitude=[6.5, 7.0])
        floors = xr.concat([ground, 2.0 * ground], xr.Variable("floor", [1, 2])).transpose("motion", "floor", "time")
        runs = self.runs("ida", floors.assign_attrs(ground.attrs))
        assert self.of(runs, "magnitude") == {"p floor 1": 6.5, "p floor 2": 6.5, "q floor 1": 7.0, "q floor 2": 7.0}

    def test_of_stripes(self):
        weak = described_motions(["p", "q"], magnitude=[6.5, 7.0], stripe=[8, 9])
        runs = self.runs("stripes", [weak, described_motions(["q", "s"], magnitude=[7.0, 7.5])])
        assert runs["magnitude"].values.tolist() == [6.5, 7.0, 7.0, 7.5]
        assert runs["stripe"].values.tolist() == [1, 1, 2, 2]

    def test_times_are_kept(self):
        day = np.datetime64("1999-08-17", "ns")
        runs = self.runs("cloud", [described_motions(["p"], origin=[day]), described_motions(["r"])])
        assert runs["origin"].values[0] == day
        assert np.isnat(runs["origin"].values[1])

    @pytest.mark.parametrize("name", ["pga", "height", "overturned", "verdict", "scale_factor", "floor", "intensity"])
    def test_names_of_results_have_their_own_meaning(self, name):
        motions = described_motions(["p", "q"])
        plain = self.runs("ida", motions)
        runs = self.runs("ida", motions.assign_coords({name: ("motion", [91.0, 92.0])}))
        xr.testing.assert_identical(runs.drop_attrs(), plain.drop_attrs())

    def test_two_units_are_refused(self):
        arrays = [described_motions([name], distance=[20.0]) for name in "pr"]
        for array, unit in zip(arrays, ("km", "m"), strict=True):
            array["distance"].attrs["units"] = unit
        with pytest.raises(ValueError, match="distance must have one unit in all arrays, got 'km' and 'm'"):
            self.runs("cloud", arrays)

    def test_are_written_with_results(self, tmp_path):
        arrays = [described_motions(["p"], station=["AAA"], blind=[True]), described_motions(["r"], station=[12])]
        self.runs("cloud", arrays).to_netcdf(tmp_path / "runs.nc")
        with xr.open_dataset(tmp_path / "runs.nc") as kept:
            assert kept["station"].values.tolist() == ["AAA", "12"]


def test_refused(refusal):
    refusal()
