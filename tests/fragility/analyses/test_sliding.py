"""Random friction: which runs slide, how far, and the totals over friction."""

import json

import numpy as np
import pytest
from scipy.stats import norm
from slip_in_plane import peak_in_plane

import toppling as tp
from toppling import motions as mo
from toppling.fragility import Slip, fit_fragility, overturning_probability, slide_runs, wilson_interval
from toppling.models.friction import CONTACTS, Contact, FixedFriction, LognormalFriction, contact_named
from toppling.models.outputs import SLIDES
from toppling.models.sliding.law import PlaneSlider
from toppling.models.sliding.mode import Mode
from toppling.models.sliding.runs import plane_table, run_in_plane
from toppling.motions.arrays import records

G = 9.80665
LEVELS = [1.0, 3.0, 5.0, 8.0]
BLOCKS = (tp.Block(0.6, 1.0, name="squat"), tp.Block(0.4, 1.6, name="wide"), tp.Block(0.3, 1.8, name="slender"))
FRICTION = LognormalFriction(0.35, 0.3)


def noise(n=12, seed=0):
    return mo.pad(mo.CloughPenzien(duration=12.0, dt=0.01).sample(n, seed=seed), 0.0, 5.0)


@pytest.fixture(scope="module")
def runs():
    return tp.ida(BLOCKS, tp.HousnerImpact(), noise(), LEVELS)


@pytest.fixture(scope="module")
def slid(runs):
    return slide_runs(runs, noise(), Contact(FRICTION, 0.85), draws=40)


class TestRuns:
    def test_are_those_of_the_law_of_sliding(self, runs):
        """A known friction below b/h: the slips of `Sliding`, and of blocks with a smaller b/h none."""
        found = slide_runs(runs, noise(), Contact(FixedFriction(0.3), 0.8))
        plain = tp.ida(
            BLOCKS[0], tp.Sliding(0.3, 0.24), noise(), LEVELS, outputs=("slide_peak", "slide_forward", "mode")
        )
        for name in ("slide_peak", "slide_forward", "mode"):
            np.testing.assert_array_equal(found[name][0, 0], plain[name][0, 0])
        assert (found["slide_peak"][1:] == 0.0).all()
        assert set(np.unique(found["mode"][1:])) == {Mode.RESTS, Mode.ROCKS}
        assert "record" not in found.coords

    def test_each_block_may_have_a_contact(self, runs):
        """A contact of each block: the slips of each are those with it alone."""
        contacts = {block.label: contact for block, contact in zip(BLOCKS, CONTACTS.values(), strict=False)}
        slid = slide_runs(runs, noise(), contacts, draws=10)
        for i, contact in enumerate(contacts.values()):
            alone = slide_runs(runs.isel(block=[i]), noise(), contact, draws=10)
            np.testing.assert_array_equal(slid["slide_peak"][i], alone["slide_peak"][0])
        assert json.loads(slid.attrs["sliding"])["kinetic_ratio"] == [0.85, 0.9, 0.9]

    @pytest.mark.parametrize("ratio", [np.float32(0.75), np.float64(0.75), np.int64(1), 1])
    def test_a_ratio_of_any_numeric_type(self, runs, ratio):
        slid = slide_runs(runs, noise(), Contact(FixedFriction(0.3), ratio))
        assert json.loads(slid.attrs["sliding"])["kinetic_ratio"] == ratio

    def test_each_motion_has_every_quantile_of_friction(self, slid):
        expected = 0.35 * np.exp(0.3 * norm.ppf((np.arange(40) + 0.5) / 40))
        np.testing.assert_allclose(slid["friction"][1].values.reshape(12, 40), np.tile(expected, (12, 1)), rtol=1e-12)
        assert slid.sizes["motion"] == 480
        given = [str(one) for one in noise()["motion"].values]
        assert slid["record"].values.reshape(12, 40)[:, 0].tolist() == given
        assert str(slid["motion"].values[41]) == f"{given[1]}, friction 2"

    def test_slips_of_one_draw(self, slid):
        at = 7 * 40 + 3
        mu = float(slid["friction"][0, at])
        one = tp.ida(BLOCKS[0], tp.Sliding(mu, 0.85 * mu), noise()[7:8], LEVELS)
        np.testing.assert_array_equal(slid["slide_peak"][0, 0, :, at], one["slide_peak"][0, 0, :, 0])

    def test_modes_by_the_peak_of_the_motion(self, slid):
        """Motions are scaled to their PGA, so that a level decides: above the smaller of friction and b/h it moves."""
        for i, block in enumerate(BLOCKS):
            level, mu = block.b / block.h, slid["friction"][i].values
            for k, pga in enumerate(LEVELS):
                expected = np.where(mu < level, Mode.SLIDES, Mode.ROCKS)
                expected = np.where(pga / G > np.minimum(mu, level), expected, Mode.RESTS)
                np.testing.assert_array_equal(slid["mode"][i, 0, k], expected)

    @pytest.mark.parametrize("design", ["stripes", "cloud"])
    def test_of_other_designs(self, design):
        sets = [noise(3, 1), noise(3, 2)]
        if design == "stripes":
            runs = tp.stripes(BLOCKS[0], tp.HousnerImpact(), sets, [3.0, 6.0])
            found = slide_runs(runs, sets, FRICTION, draws=10)
        else:
            runs = tp.cloud(BLOCKS[0], tp.HousnerImpact(), sets, "pga")
            found = slide_runs(runs, sets, FRICTION, draws=10)
        assert found["slide_peak"].dims == ("block", "model", "motion")
        every = [one for part in sets for one in records(part)]
        for k in (0, 4):
            factor = (3.0 if k < 3 else 6.0) / np.abs(every[k].acceleration).max() if design == "stripes" else 1.0
            mu = float(found["friction"][0, 10 * k + 2])
            motion = mo.scale_to(sets[k // 3][k % 3 : k % 3 + 1], 1.0, "pga")
            motion = factor * np.abs(every[k].acceleration).max() * motion
            own = tp.simulate(BLOCKS[0], tp.Sliding(mu), motion)
            assert float(found["slide_peak"][0, 0, 10 * k + 2]) == pytest.approx(float(own.slide_peak), rel=1e-9)

    def test_results_do_not_depend_on_chunks_or_workers(self, runs, slid):
        import dask

        with dask.config.set(scheduler="synchronous"):
            again = slide_runs(runs, noise(), Contact(FRICTION, 0.85), draws=40)
        np.testing.assert_array_equal(slid["slide_peak"], again["slide_peak"])


class TestTotals:
    def test_probability_is_the_mean_over_motions_and_friction(self, slid):
        found = overturning_probability(slid, state=Slip(0.03))
        np.testing.assert_array_equal(found["overturnings"], (slid["slide_peak"] > 0.03).sum("motion"))
        assert (found["runs"] == 480).all()

    def test_intervals_count_motions(self, slid):
        """480 runs of 12 motions have the interval of 12 trials with their mean."""
        found = overturning_probability(slid, state=Slip(0.03))
        for k, p in enumerate(found["probability"].values[0, 0]):
            lower, upper = wilson_interval(12.0 * p, 12.0)
            assert float(found["lower"][0, 0, k]) == pytest.approx(lower, abs=1e-12)
            assert float(found["upper"][0, 0, k]) == pytest.approx(upper, abs=1e-12)

    def test_chance_of_sliding_is_that_of_friction(self, runs):
        many = slide_runs(runs.isel(motion=[0]), noise()[:1], FRICTION, draws=2000)
        share = (many["mode"] == Mode.SLIDES).mean("motion")[:, 0]
        for i, block in enumerate(BLOCKS):
            for k, pga in enumerate(LEVELS):
                expected = FRICTION.below(min(block.b / block.h, pga / G))
                assert float(share[i, k]) == pytest.approx(float(expected), abs=6e-4)

    def test_curves_draw_motions_with_all_their_runs(self, slid):
        """The band of an isotonic curve equals a plain bootstrap of motions."""
        fit = fit_fragility(slid, form="isotonic", state=Slip(0.03), replicates=400, seed=3, keep_replicates=True)
        flags = (slid["slide_peak"].values[0, 0] > 0.03).reshape(len(LEVELS), 12, 40).mean(axis=-1)
        samples = fit["probability_sample"].isel(block=0, model=0).transpose("replicate", ...).values
        assert samples.std(axis=0).max() == pytest.approx(flags.std(axis=1).max() / np.sqrt(12), rel=0.15)
        assert samples.mean(axis=0) == pytest.approx(np.maximum.accumulate(flags.mean(axis=1)), abs=0.03)


EDGES = (
    tp.Block(0.6, 1.0, name="both", edge=tp.Edge(0.03, 0.06, "foot")),
    tp.Block(0.6, 1.0, name="front", edge=tp.Edge(0.03, falls_when="foot")),
    tp.Block(0.6, 1.0, name="none"),
)


@pytest.fixture(scope="module")
def rocking():
    return tp.ida(EDGES, tp.HousnerImpact(), noise(), LEVELS)


@pytest.fixture(scope="module")
def given(rocking):
    return slide_runs(rocking, noise(), Contact(FRICTION, 0.85), draws=10)


@pytest.fixture(scope="module")
def both(rocking):
    return slide_runs(rocking, noise(), Contact(FRICTION, 0.85), draws=10, polarity="both")


class TestEdges:
    """A block near an edge falls off where a draw of friction lets it slide that far."""

    def test_flags_are_those_of_the_slips(self, given):
        forward, backward = given["slide_forward"].values, given["slide_backward"].values
        np.testing.assert_array_equal(given["fallen_off"][0], (forward[0] > 0.03) | (backward[0] > 0.06))
        np.testing.assert_array_equal(given["fallen_off"][1], forward[1] > 0.03)
        assert not given["fallen_off"][2].any()
        assert 0.0 < float(given["fallen_off"][0].mean()) < 1.0

    def test_blocks_near_no_edge_have_no_flags(self, slid):
        assert "fallen_off" not in slid

    def test_the_other_way_is_what_runs_of_reversed_motions_are(self, both):
        runs = tp.ida(EDGES, tp.HousnerImpact(), noise(), LEVELS, polarity="both")
        twice = slide_runs(runs, noise(), Contact(FRICTION, 0.85), draws=10, polarity="both")
        assert both.sizes == twice.sizes
        for name in ("motion", "record", "polarity", "draw"):
            np.testing.assert_array_equal(both[name], twice[name])
        for name in both.data_vars:
            np.testing.assert_array_equal(both[name], twice[name])

    def test_as_given_they_are_as_before(self, both, given):
        forth = both.isel(motion=(both["polarity"] == 1).values)
        for name in given.data_vars:
            np.testing.assert_array_equal(forth[name], given[name])

    def test_both_ways_are_one_trial_of_a_motion(self, both):
        found = overturning_probability(both, state="fallen_off")
        assert (found["runs"] == 12 * 2 * 10).all()
        p = float(found["probability"][1, 0, 2])
        assert float(found["lower"][1, 0, 2]) == pytest.approx(wilson_interval(12.0 * p, 12.0)[0], abs=1e-12)

    def test_known_friction_both_ways(self, rocking):
        found = slide_runs(rocking, noise(), 0.3, polarity="both")
        assert found.sizes["motion"] == 24
        assert "draw" not in found.coords
        assert str(found["motion"].values[1]).endswith(", reversed")
        fit = fit_fragility(found, state="fallen_off", replicates=100)
        assert fit.attrs["form"] == "isotonic"


class TestRefusals:
    def test_contacts(self):
        assert contact_named("carpet").friction == LognormalFriction(0.55, 0.30)
        for contact in CONTACTS.values():
            assert 0.0 < contact.kinetic_ratio <= 1.0
            assert contact.text

    @pytest.mark.parametrize("friction", [FixedFriction(0.4), FRICTION])
    def test_quantiles_and_probabilities_are_inverse(self, friction):
        at = np.array([0.1, 0.5, 0.9])
        found = friction.quantile(at)
        assert found.shape == at.shape
        if friction is FRICTION:
            assert friction.below(found) == pytest.approx(at)


CABINET = tp.Block(0.4, 1.6, depth=0.6, name="cabinet", edge=tp.Edge(0.05, falls_when="foot"))
"""b/h is 0.25 along the width and 0.375 along the depth."""


@pytest.fixture(scope="module")
def pairs():
    return mo.both_axes(mo.join(noise(8, 1), noise(8, 2)))


class TestBothComponents:
    BLOCK = CABINET
    LEVELS = (1.5, 3.0, 5.0)

    @pytest.fixture
    def runs(self, pairs):
        return tp.ida(CABINET, tp.HousnerImpact(), pairs, self.LEVELS, im="RotD50(pga)")

    def expected(self, runs, pairs, mu, ratio):
        """Slips, modes and falls of one coefficient, run by run in plain loops."""
        friction = plane_table([PlaneSlider(mu, ratio * mu)]).friction
        factors = np.array(self.LEVELS)[:, None] / runs["RotD50(pga)"].values
        peak, forward, mode = (np.zeros(factors.shape) for _ in range(3))
        for k, pair in enumerate(pairs[0].values):
            for level in range(factors.shape[0]):
                x, y = factors[level, k] * pair
                slips = run_in_plane(friction, np.ones((1, 1)), (x, y), None, 0.01)[0, 0]
                # along the width a block that uplifts passes on b/h of its weight
                pushed = np.hypot(np.minimum(np.abs(x) / G, 0.25), y / G).max()
                uplifts = (np.abs(x).max() > 0.25 * G and mu >= 0.25) or (np.abs(y).max() > 0.375 * G and mu >= 0.375)
                if mu < 0.375 and pushed > mu:
                    mode[level, k] = 1
                    peak[level, k], forward[level, k] = (slips[SLIDES[f"slide_{name}"]] for name in ("peak", "forward"))
                else:
                    mode[level, k] = 2 if uplifts else 0
        return peak, forward, mode

    @pytest.mark.parametrize("mu", [0.2, 0.3, 0.4])
    def test_each_axis_slides_below_its_own_uplift(self, runs, pairs, mu):
        found = slide_runs(runs, pairs, Contact(FixedFriction(mu), 0.85))
        peak, forward, mode = self.expected(runs, pairs, mu, 0.85)
        np.testing.assert_allclose(found["slide_peak"][0, 0], peak, rtol=1e-12, atol=1e-15)
        np.testing.assert_allclose(found["slide_forward"][0, 0], forward, rtol=1e-12, atol=1e-15)
        np.testing.assert_array_equal(found["mode"][0, 0], mode)
        np.testing.assert_array_equal(found["fallen_off"][0, 0], forward > 0.05)
        assert set(np.unique(mode)) >= ({0, 2} if mu == 0.4 else {0, 1})
        if mu == 0.2:
            assert 0 < (forward > 0.05).sum() < forward.size

    def test_one_component_alone_is_the_planar_answer(self):
        motions = noise(6, 3)
        pair = mo.both_axes(mo.join(motions, 0.0 * motions))
        plane = tp.cloud(self.BLOCK, tp.HousnerImpact(), [4.0 * one for one in pair], "RotD100(pga)")
        alone = tp.cloud(self.BLOCK, tp.HousnerImpact(), 4.0 * motions, "pga")
        for mu in (0.1, 0.2, 0.3, 0.4):
            one, other = (slide_runs(*of, mu) for of in ((plane, [4.0 * k for k in pair]), (alone, 4.0 * motions)))
            for name in ("mode", "fallen_off"):
                np.testing.assert_array_equal(one[name], other[name])
            for name in ("slide_peak", "slide_forward", "slide_backward"):
                np.testing.assert_allclose(one[name], other[name], rtol=1e-12, atol=1e-14)

    def test_both_components_start_the_slip_together(self):
        """Two equal components, each 0.8 of the friction: together they exceed it, and neither does alone."""
        push = mo.from_array(np.concatenate([np.full(50, -0.16 * G), np.zeros(50)]), dt=0.01)
        pair = mo.both_axes(mo.join(push, push))
        found = slide_runs(tp.cloud(self.BLOCK, tp.HousnerImpact(), pair, "RotD50(pga)"), pair, 0.2)
        assert found["mode"].item() == Mode.SLIDES
        alone = tp.simulate(self.BLOCK, tp.Sliding(0.2), np.sqrt(2.0) * push)
        np.testing.assert_allclose(found["slide_peak"].item(), float(alone.slide_peak), rtol=1e-12)
        np.testing.assert_allclose(found["slide_forward"].item(), float(alone.slide_peak) / np.sqrt(2.0), rtol=1e-12)

    @pytest.mark.slow
    def test_slips_are_those_of_an_integration_step_by_step(self, runs, pairs):
        found = slide_runs(runs, pairs, 0.2)["slide_peak"].values[0, 0]
        factors = np.array(self.LEVELS)[:, None] / runs["RotD50(pga)"].values
        stepped = [peak_in_plane(one[:, None, None] * pairs[0].values, 0.01, 0.2, 32) for one in factors]
        assert (found > 0.02).any()
        np.testing.assert_allclose(found, stepped, rtol=0.01, atol=2e-5)

    def test_random_friction_both_ways(self, runs, pairs):
        """Front and back change places under the reverse of a pair, and the slip of both axes stays."""
        found = slide_runs(runs, pairs, FRICTION, draws=5, polarity="both")
        as_given, reverse = (found.isel(motion=found["polarity"].values == sign) for sign in (1, -1))
        np.testing.assert_array_equal(as_given["slide_peak"], reverse["slide_peak"])
        np.testing.assert_array_equal(as_given["slide_forward"], reverse["slide_backward"])
        one = slide_runs(runs, pairs, float(as_given["friction"][0, 3]))
        np.testing.assert_array_equal(as_given["slide_peak"][..., 3::5], one["slide_peak"])
        assert found["slide_peak"].attrs["long_name"].endswith("of the floor")
        assert found["slide_forward"].attrs["long_name"].endswith("along the width")
        fell = overturning_probability(found, state="fallen_off")
        np.testing.assert_allclose(fell["probability"], found["fallen_off"].mean("motion"))

    @pytest.mark.slow
    def test_one_component_in_the_plane(self):
        """The integration in the plane, of one component, is the sliding of the engine."""
        motions = noise(4, 6)
        ground = np.stack([motions.values, 0.0 * motions.values], axis=1)
        found = tp.cloud(BLOCKS[0], tp.Sliding(0.15), motions, "pga", outputs=("slide_peak",))["slide_peak"][0, 0]
        np.testing.assert_allclose(peak_in_plane(ground, 0.01, 0.15, 32), found, rtol=2e-3)

    @pytest.mark.slow
    @pytest.mark.parametrize(("mu", "expected"), [(0.15, (1.07, 1.40)), (0.3, (1.10, 1.75))])
    def test_slips_in_the_plane_over_those_of_both_axes(self, mu, expected):
        """Median and 90th percentile of the ratio, which docs/theory/axes.md gives."""
        generator = mo.SiteBasedScenario(magnitude=6.5, distance=15e3, vs30=500.0)
        pairs = mo.both_axes(generator.sample_pairs(80, seed=3))
        scaled, block = [mo.scale_to(one, 0.5 * G, "RotD50(pga)") for one in pairs], tp.Block(0.8, 1.0, depth=0.8)
        runs = tp.ida(block, tp.HousnerImpact(), pairs, [0.5 * G], im="RotD50(pga)")
        peaks = slide_runs(runs, pairs, mu)["slide_peak"].values[0, 0, 0]
        ground = np.concatenate([one.values for one in scaled]).reshape(len(peaks), 2, -1)
        np.testing.assert_allclose(peak_in_plane(ground, float(pairs[0]["dt"][0]), mu), peaks, rtol=0.02, atol=1e-4)
        each = [
            tp.cloud(block, tp.Sliding(mu), [mo.as_recorded(own, one) for own in scaled], "pga") for one in ("h1", "h2")
        ]
        ratios = peaks / np.hypot(*(one["slide_peak"].values[0, 0] for one in each))
        np.testing.assert_allclose(np.quantile(ratios, (0.5, 0.9)), expected, atol=0.01)

    def test_the_weight_is_taken(self, pairs):
        lifted = mo.both_axes(mo.join(noise(2, 1), noise(2, 2), noise(2, 5)), vertical=True)
        runs = tp.ida(self.BLOCK, tp.HousnerImpact(), lifted, [2.0, 30.0], im="RotD50(pga)")
        found = slide_runs(runs, lifted, 0.2)
        assert (found["mode"][0, 0, 1] == Mode.AIRBORNE).all()
        assert found["slide_peak"][0, 0, 1].isnull().all()
        assert (found["mode"][0, 0, 0] == Mode.SLIDES).any()


def test_refused(refusal):
    refusal()
