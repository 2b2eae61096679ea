"""Runs about both horizontal axes: held to planar runs, to symmetry, and to a box in space."""

import math
import os

import numpy as np
import pytest
from box_in_space import shaken_box
from flips import undecided_outcomes

import toppling as tp
from toppling import fragility, motions
from toppling.fragility.runs import axes
from toppling.fragility.validity.notes import block_facts, screen_facts
from toppling.models.outputs import OF_AXES

LEVELS = [2.0, 4.0, 7.0]
FACTORS = [0.7, 1.4, 2.5]
IM = "RotD50(pga)"
SQUARE = tp.Block(0.3, 1.4, depth=0.3, name="square")
DEEP = tp.Block(0.3, 1.4, depth=0.45, name="deep")
FRAME = motions.Building.flexural_shear(0.5, storeys=2)
LAWS = [tp.HousnerImpact(), tp.HousnerImpact(e=0.9)]
OUTPUTS = [name for name in OF_AXES if name != "axis"]
EVERY = [*OUTPUTS, "axis"]


@pytest.fixture(scope="module")
def pairs():
    return motions.CloughPenzien(duration=12.0, dt=0.01).sample_pairs(8, seed=3)


def with_zero(pairs, component):
    return pairs.where(pairs["component"] != component, 0.0).transpose(*pairs.dims)


def run(blocks, shaken, outputs=EVERY, laws=LAWS, im="scale", **options):
    # (plain factors: a measure of h1 and h2 differs from that of h2 and h1 by rounding)
    return tp.ida(blocks, laws, shaken, FACTORS, im, outputs, screen=False, **options)


def same(found, expected, names):
    for name in names:
        np.testing.assert_array_equal(found[name].values, expected[name].values, err_msg=name)


class TestPlanar:
    def test_one_component_zero_is_the_planar_run_to_the_last_bit(self, pairs):
        only = with_zero(pairs, "h2")
        both = run([SQUARE, DEEP], motions.both_axes(only))
        planar = run([SQUARE, DEEP], motions.as_recorded(only, "h1"), OUTPUTS)
        same(both, planar, OUTPUTS)
        np.testing.assert_array_equal(both["axis"], planar["overturned"])
        assert planar["overturned"].any()

    def test_the_other_component_shakes_the_depth(self, pairs):
        only = with_zero(pairs, "h1")
        both = run(DEEP, motions.both_axes(only))
        turned = tp.Block(0.45, 1.4, name="deep")
        planar = run(turned, motions.as_recorded(only, "h2"), OUTPUTS)
        same(both, planar, OUTPUTS)
        np.testing.assert_array_equal(both["axis"], 2 * planar["overturned"])

    def test_a_right_angle_exchanges_the_axes_of_a_square_block(self, pairs):
        # x' = y and y' = -x: what falls along the width falls along the depth instead
        as_is, turned = (run(SQUARE, motions.both_axes(pairs, angle)) for angle in (0.0, 0.5 * math.pi))
        same(turned, as_is, ["overturned", "peak_rotation", "impacts", "overturning_time", "uplifted"])
        np.testing.assert_array_equal(turned["axis"], np.array([0, 2, 1])[as_is["axis"].values])
        assert {1, 2} <= {*as_is["axis"].values.ravel().tolist()}

    def test_the_union_of_two_planar_runs_of_which_the_earlier_decides(self, pairs):
        both = run(DEEP, motions.both_axes(pairs))
        x = run(DEEP, motions.as_recorded(pairs, "h1"), OUTPUTS)
        y = run(tp.Block(0.45, 1.4, name="deep"), motions.as_recorded(pairs, "h2"), OUTPUTS)
        np.testing.assert_array_equal(both["overturned"], x["overturned"].values | y["overturned"].values)
        times = np.stack([x["overturning_time"], y["overturning_time"]])
        first = np.where(np.isnan(times).all(axis=0), 0, np.argmin(np.nan_to_num(times, nan=np.inf), axis=0) + 1)
        np.testing.assert_array_equal(both["axis"], first)
        np.testing.assert_array_equal(both["overturning_time"], np.fmin(*times))
        impacts = np.choose(first, [np.maximum(x["impacts"], y["impacts"]), x["impacts"], y["impacts"]])
        np.testing.assert_array_equal(both["impacts"], impacts)
        assert (both["peak_rotation"].values[both["overturned"].values] == 0.5 * math.pi).all()
        assert (both["overturned"].values >= x["overturned"].values).all()

    def test_flags_alone_are_the_same(self, pairs):
        shaken = motions.both_axes(pairs)
        same(run(DEEP, shaken, ["overturned"]), run(DEEP, shaken), ["overturned"])

    def test_progress_counts_the_runs_about_both_axes(self, pairs):
        told = []
        run(SQUARE, motions.both_axes(pairs), progress=lambda done, total: told.append((done, total)))
        total = 2 * len(LAWS) * len(LEVELS) * 8
        assert told[-1] == (total, total)
        assert [done for done, _ in told] == sorted(done for done, _ in told)

    def test_stripes_and_cloud(self, pairs):
        shaken = motions.both_axes(pairs)
        whole = tp.ida(DEEP, LAWS, shaken, LEVELS, IM, EVERY, screen=False)
        stripes = tp.stripes(DEEP, LAWS, [shaken] * 3, LEVELS, IM, EVERY, screen=False)
        for i, level in enumerate(LEVELS):
            here = stripes["overturned"].values[..., stripes["intensity"].values == level]
            np.testing.assert_array_equal(here, whole["overturned"].values[:, :, i])
        cloud = tp.cloud(DEEP, LAWS, shaken, IM)
        assert "axis" in cloud
        assert cloud["intensity"].attrs["im"] == IM

    def test_results_say_what_they_are_of(self, pairs):
        runs = tp.ida([SQUARE, DEEP], LAWS, motions.both_axes(pairs, "random", seed=5), LEVELS, IM)
        assert {"overturned", "peak_rotation", "axis"} <= {*runs}
        assert runs["depth"].values.tolist() == [0.3, 0.45]
        assert runs["azimuth"].dims == ("motion",)
        assert "of both axes" in runs["peak_rotation"].attrs["long_name"]
        assert "along the width" in runs["pga"].attrs["long_name"]
        assert "axis.screen_of_width" in {fact.what for fact in screen_facts(runs)}
        assert fragility.overturning_probability(runs, state="uplifted" if "uplifted" in runs else "overturned")

    def test_outcomes_are_tested_about_both_axes(self, pairs):
        shaken = motions.both_axes(pairs)
        runs = run([SQUARE, DEEP], shaken)
        flips = undecided_outcomes(runs, shaken)
        assert flips.shape == runs["overturned"].shape
        assert float((flips > 0).mean()) < 0.1
        # flags of another axis would differ from the union in many runs
        planar = runs.assign_attrs(
            configuration=runs.attrs["configuration"].replace('"axes": "both axes"', '"axes": ""')
        )
        assert float((undecided_outcomes(planar, shaken) > 0).mean()) > float((flips > 0).mean())


class TestBlocks:
    def test_a_uniform_block_is_uniform_in_both_directions(self):
        across = DEEP.across
        assert (across.width, across.height, across.inertia_factor, across.label) == (0.45, 1.4, 4.0 / 3.0, "deep")

    def test_inertia_of_a_block_whose_mass_is_not_in_the_middle(self):
        # a uniform box of 0.6 m on legs without mass: rho² = (w² + 0.6²)/12 about its own centre
        w, d, h, tall = 0.3, 0.5, 1.1, 0.6
        square = (w * w + tall * tall) / 12.0
        factor = 1.0 + square / (0.25 * w * w + h * h)
        across = tp.Block(w, 1.4, h, factor, depth=d).across
        expected = 1.0 + (d * d + tall * tall) / 12.0 / (0.25 * d * d + h * h)
        assert math.isclose(across.inertia_factor, expected, rel_tol=1e-12)

    def test_round_blocks_say_that_wobbling_is_not_modelled(self, pairs):
        vase = tp.Block(0.12, 0.5, name="vase", round=True)
        assert vase.depth == 0.12
        runs = tp.ida(vase, LAWS, motions.both_axes(pairs), LEVELS, IM)
        planar = tp.ida(vase, LAWS, motions.as_recorded(pairs), LEVELS, IM)
        for facts in (screen_facts(runs), block_facts([vase]), screen_facts(planar)):
            (fact,) = (fact for fact in facts if fact.what == "block.round")
            assert fact.names == ("vase",)

    def test_blocks_of_the_catalogue_have_their_breadth_as_depth(self):
        for name, block in tp.catalogue.items():
            assert block.depth == tp.catalogue.item(name).breadth

    def test_blocks_are_read_back_from_runs(self, pairs):
        from toppling.fragility.runs.provenance import blocks_of

        vase = tp.Block(0.12, 0.5, name="vase", round=True)
        assert blocks_of(run([DEEP, vase], motions.both_axes(pairs))) == [DEEP, vase]

    def test_sizes_that_are_drawn_may_exceed_the_depth(self, pairs):
        """A catalogue's square pedestal, wider in a sample: runs about one axis do not ask for its depth."""
        pedestal = tp.catalogue["museum-pedestal-slender"]
        inputs = fragility.RandomInputs({"alpha_factor": fragility.Uniform(1.05, 1.1)})
        shake = pairs.sel(component="h1", drop=True).drop_vars("azimuth")
        assert fragility.uncertain_ida(inputs, pedestal, LAWS[0], shake, LEVELS, samples=4)["overturned"].size == 96


class TestWhatHoldsABlock:
    def test_acts_along_the_width(self, pairs):
        """A wall, a strap, an offset and a lean: each axis by itself, and along the depth a free block."""
        strap = tp.Restraint.strap(1.2, 100.0, 20e3)
        held = tp.Block(0.3, 1.4, depth=0.4, wall=tp.Wall(0.01), restraint=strap, mass=60.0, cm_offset=0.01, lean=0.01)
        law = tp.HousnerImpact(geometry="linear")
        outputs = ["overturned", "axis", "ruptured"]
        found = run(held, motions.both_axes(pairs), outputs=outputs, laws=law)
        own = ["overturned", "overturning_time", "ruptured"]
        x, y = (
            run(block, motions.as_recorded(pairs, name), outputs=own, laws=law)
            for block, name in ((held, "h1"), (tp.Block(0.4, 1.4), "h2"))
        )
        np.testing.assert_array_equal(found["overturned"].values, x["overturned"].values | y["overturned"].values)
        np.testing.assert_array_equal(found["ruptured"].values, x["ruptured"].values)
        earlier = y["overturned"].values & ~(x["overturning_time"].values <= y["overturning_time"].values)
        np.testing.assert_array_equal(found["axis"].values == 2, earlier)
        assert x["ruptured"].values.any()
        assert earlier.any()
        assert (x["overturned"].values != y["overturned"].values).any()


class TestFloors:
    def test_floors_of_pairs_are_those_of_each_component(self, pairs):
        (turned,) = motions.both_axes(pairs, 0.4)
        moved = FRAME.floor_motions(turned, [0, 2])
        assert moved.dims == ("motion", "component", "floor", "time")
        for name in ("h1", "h2"):
            alone = FRAME.floor_motions(turned.sel(component=name, drop=True).drop_vars(["azimuth", "shakes"]), [0, 2])
            np.testing.assert_array_equal(moved.sel(component=name).values, alone.values)
            assert (moved["ringing"] >= alone["ringing"]).all()
        plain = motions.records(moved)
        assert [one.floor for one in plain[:2]] == ["0", "2"]
        assert {one.axes for one in plain} == {axes.BOTH_AXES}
        np.testing.assert_array_equal(plain[1].companion, moved.values[0, 1, 1])

    def test_blocks_on_floors(self, pairs):
        """Flags on a floor are those about each axis, OR-ed, under factors of the ground's measure."""
        (turned,) = motions.both_axes(pairs, "random", 2)
        moved = FRAME.floor_motions([turned], [2])
        near = tp.Block(0.3, 1.4, depth=0.32, name="nearly square")
        runs = tp.ida(near, LAWS[0], moved, [1.5, 2.5], IM, ground=[turned], screen=False)
        ground = tp.motions.measures([turned], [IM])[IM].values
        flags = []
        for name, block in (("h1", near), ("h2", tp.Block(0.32, 1.4, name="other"))):
            alone = moved[0].isel(floor=0, drop=True).sel(component=name, drop=True).drop_vars(["azimuth", "shakes"])
            each = [
                tp.ida(block, LAWS[0], alone.isel(motion=[i]), np.array([1.5, 2.5]) / one, "scale", screen=False)
                for i, one in enumerate(ground)
            ]
            flags.append(np.concatenate([one["overturned"].values for one in each], axis=-1))
        np.testing.assert_array_equal(runs["overturned"].values, flags[0] | flags[1])
        assert (flags[1] & ~flags[0]).any()


class TestUncertain:
    def test_samples_are_blocks_of_the_same_plan_ratio(self, pairs):
        given = {"alpha_factor": fragility.Uniform(0.8, 1.2), "e": fragility.Uniform(0.8, 0.95)}
        inputs = fragility.RandomInputs(given)
        shaken = motions.both_axes(pairs, "random", 2)
        drawn = inputs.sample(5)
        runs = fragility.uncertain_ida(inputs, DEEP, LAWS[0], shaken, LEVELS, IM, samples=drawn)
        assert "axis" in runs
        for i in range(5):
            alpha, e = (float(drawn[name][i]) for name in ("alpha_factor", "e"))
            size = tp.Block.from_slenderness(DEEP.alpha * alpha, DEEP.R)
            block = tp.Block(size.width, size.height, depth=1.5 * size.width, name="sample")
            own = tp.ida(block, tp.HousnerImpact(e=e), shaken, LEVELS, IM, screen=False)
            for name in ("overturned", "axis"):
                np.testing.assert_array_equal(runs[name].values[i], own[name].values[0, 0])
            assert float(runs["depth"][i]) == pytest.approx(1.5 * size.width, rel=1e-14)


class TestWeakAxis:
    def test_the_weak_axis_alone_is_the_planar_run(self, pairs):
        long = tp.Block(0.3, 1.4, depth=0.6, name="long")
        weak = run(long, motions.weak_axis(pairs, 0.3), OUTPUTS)
        planar = run(long, motions.as_recorded(motions.rotate(pairs, 0.3)), OUTPUTS)
        same(weak, planar, OUTPUTS)


class TestSliding:
    def test_slips_are_in_the_plane(self, pairs):
        """Turned with the floor they keep their size; and they are at least as early as along either axis."""
        names = ["slide_peak", "slide_residual", "slide_path", "slide_velocity", "slips", "first_slip_time"]
        law, block = tp.Sliding(0.2), tp.Block(0.3, 1.4, name="bench")
        both = run(block, motions.both_axes(pairs), [*names, "slide_forward"], law)
        turned = run(block, motions.both_axes(motions.rotate(pairs, 0.8)), names, law)
        for name in names:
            np.testing.assert_allclose(both[name], turned[name], rtol=1e-9, atol=1e-9)
        assert both["slide_peak"].attrs["long_name"].endswith("of the floor")
        assert both["slide_forward"].attrs["long_name"].endswith("along the width")
        assert (both["slide_forward"] <= both["slide_peak"]).all()
        x, y = (run(block, motions.as_recorded(pairs, one), ["first_slip_time"], law) for one in ("h1", "h2"))
        first = np.fmin(x["first_slip_time"].values, y["first_slip_time"].values)
        assert (both["first_slip_time"].values[np.isfinite(first)] <= first[np.isfinite(first)] + 1e-12).all()
        assert (both["slide_peak"].values > 0.0).any()


@pytest.mark.slow
class TestBoxInSpace:
    """A box on four penalty corners with friction of 1.5, which shares no code with the engine."""

    def test_it_rocks_as_housners_block_in_the_plane(self):
        shake = motions.OneCycleSine(amplitude=2.4, omega=6.0, tail=6.0).sample(1)
        wave, dt = shake.values[0], float(shake["dt"][0])
        expected = float(np.abs(tp.simulate(SQUARE, LAWS[0], shake)["rotation"]).max())
        peaks = [shaken_box(0.3, 0.3, 1.4, *two, dt)[0] for two in ((wave, 0.0 * wave), (0.0 * wave, wave))]
        assert math.isclose(peaks[0], peaks[1], rel_tol=1e-6)
        assert math.isclose(peaks[0], expected, rel_tol=0.03)
        assert math.isnan(shaken_box(0.3, 0.3, 1.4, wave, 0.0 * wave, dt)[1])
        assert not math.isnan(shaken_box(0.3, 0.3, 1.4, 1.5 * wave, 0.0 * wave, dt)[1])

    @pytest.mark.parametrize(("depth", "highest"), [(0.3, 0.07), (0.5, 0.03)])
    def test_the_union_falls_as_often_as_the_box(self, depth, highest):
        """The difference of paired outcomes; without what is faster than the springs of the corners.

        A pair takes half a second: BOX_PAIRS=600 for the table of docs/theory/axes.md.
        """
        n, at = int(os.environ.get("BOX_PAIRS", "100")), 0.3 * 9.80665
        pairs = motions.CloughPenzien(duration=15.0, dt=0.01).sample_pairs(n, seed=7)
        for name in ("h1", "h2"):
            quiet = motions.lowpass(motions.from_array(pairs.sel(component=name).values, 0.01), high=8.0)
            pairs.loc[{"component": name}] = quiet.values
        runs = tp.ida(tp.Block(0.3, 1.4, depth=depth), LAWS[0], motions.both_axes(pairs), [at], IM, screen=False)
        scaled = (at / runs[IM].values)[:, None, None] * pairs.values
        box = [not math.isnan(shaken_box(0.3, depth, 1.4, *pair, 0.01)[1]) for pair in scaled]
        difference = runs["overturned"].values.ravel().astype(float) - np.array(box)
        mean, half = difference.mean(), 1.96 * difference.std() / math.sqrt(n)
        # measured with 600: 0.040 ± 0.043 of the square block, slightly high, and 0.000 ± 0.027 (docs/theory/axes.md)
        assert mean + half > -0.03, (mean, half)
        assert mean - half < highest, (mean, half)
        assert half < 0.05 * math.sqrt(600 / n), (mean, half)


def test_refused(refusal):
    refusal()
