"""The validity screen: friction from rigid-body mechanics, bands, reasons, undecided flags, and what a study says."""

import json
from dataclasses import replace

import numpy as np
import pytest
import xarray as xr
from check_facts import numbers_in
from flips import undecided_outcomes
from scipy.special import erfinv
from study_texts import CABINET, IDA, motions

import toppling as tp
from toppling.core.units import STANDARD_GRAVITY as G
from toppling.fragility import Slip, block_notes, notes, screen, slide_runs, wilson_interval
from toppling.fragility.numerics.proportions import runs_for_half_width, wilson_half_width
from toppling.fragility.runs import plan
from toppling.fragility.validity import undecided as perturbed
from toppling.fragility.validity.notes import screen_facts
from toppling.fragility.validity.reasons import REASONS
from toppling.models.friction import (
    Contact,
    FixedFriction,
    LognormalFriction,
    contact_of,
    friction_at_impact,
    friction_at_uplift,
)
from toppling.motions import records
from toppling.motions.intensity.peaks import half_cycle_peaks
from toppling.motions.intensity.spectra import energy_band
from toppling.studies.plan.slides import Slides

BIT = {reason.name: reason.bit for reason in REASONS}
BLOCKS = [tp.Block(0.4, 2.0, name="slender"), tp.Block(0.5, 0.8, name="squat")]
MODELS = [tp.DiscreteDamping(), tp.HousnerImpact(e=0.5, geometry="linear"), tp.Vassiliou()]
ENVELOPE = tp.motions.RiseStrongDecay(1.0, 4.0, 0.5)


def noise(n=6, seed=1, dt=0.01, duration=8.0):
    return tp.motions.CloughPenzien(duration=duration, dt=dt, envelope=ENVELOPE).sample(n, seed=seed)


def given(values, dt=0.01, labels=None):
    return tp.motions.from_array(values, dt, labels)


def halves(amplitudes, n=40):
    """One record of half-sines of these amplitudes, m/s²."""
    wave = np.sin(np.pi * np.arange(n) / n)
    return np.concatenate([*(a * wave for a in amplitudes), np.zeros(n)])


class TestFrictionNeeded:
    def test_published_numbers(self):
        """A P-58 two-drawer file at 1 g; impacts of a block with h/b = 5."""
        assert float(friction_at_uplift(1.6, G)) == pytest.approx(0.71, abs=0.005)
        slender = tp.Block(0.4, 2.0)
        assert float(friction_at_impact(5.0, slender.restitution)) == pytest.approx(0.15, abs=0.005)
        assert float(friction_at_impact(5.0, 0.5)) == pytest.approx(5.0 / 3.0)

    def test_shentons_formula_for_a_uniform_rectangle(self):
        gamma, a = np.meshgrid(np.linspace(0.7, 12.0, 30), np.linspace(1.5, 6.0, 20))
        shenton = (a * (4.0 + gamma**2) + 3.0 * gamma) / (3.0 * a * gamma + 1.0 + 4.0 * gamma**2)
        np.testing.assert_allclose(friction_at_uplift(gamma, a * G), shenton, rtol=1e-14)

    def test_any_inertia_solves_the_equations_of_motion(self):
        """Force balance, moment about the mass centre and a corner that stays: three equations, solved as they are."""
        rng = np.random.default_rng(5)
        for _ in range(200):
            b, inertia, m = rng.uniform(0.1, 1.0), rng.uniform(1.01, 2.0), rng.uniform(1.0, 100.0)
            h = b * rng.uniform(0.5, 10.0)
            a = b / h * G * rng.uniform(1.0, 6.0)
            central = (inertia - 1.0) * m * (b * b + h * h)
            # across, up, turning forward over the front corner; the floor goes backward with a
            #   m (h turn - a) = across,   m b turn = up - m g,   central turn = up b ... minus across h
            matrix = np.array([[-1.0, 0.0, m * h], [0.0, -1.0, m * b], [h, b, central]])
            across, up, turn = np.linalg.solve(matrix, [m * a, -m * G, 0.0])
            assert turn >= -1e-9
            assert friction_at_uplift(h / b, a, inertia) == pytest.approx(abs(across) / up, rel=1e-11)

    def test_before_uplift_the_block_moves_with_the_floor(self):
        np.testing.assert_allclose(friction_at_uplift(4.0, [0.1 * G, -0.2 * G]), [0.1, 0.2], rtol=1e-15)
        for inertia in (1.1, 4.0 / 3.0, 2.0):
            below, above = friction_at_uplift(4.0, np.array([1.0 - 1e-9, 1.0 + 1e-9]) * 0.25 * G, inertia)
            assert below == pytest.approx(0.25, rel=1e-8)
            assert above == pytest.approx(0.25, rel=1e-8)
        assert friction_at_uplift(4.0) == 0.25

    def test_impact_is_housners_where_the_far_corner_takes_the_blow(self):
        """Momentum across and up, and moment about the mass centre of a blow at the far corner, for any inertia."""
        for b, h, inertia in ((0.2, 1.0, 4.0 / 3.0), (0.3, 0.7, 1.2), (0.1, 1.1, 1.9)):
            m, before = 3.0, 1.7
            central = (inertia - 1.0) * m * (b * b + h * h)
            #   m h (after - before) = -across,  m b (after + before) = up,  central (after - before) = across h - up b
            matrix = np.array([[1.0, 0.0, m * h], [0.0, -1.0, m * b], [h, -b, -central]])
            across, up, after = np.linalg.solve(matrix, [m * h * before, -m * b * before, -central * before])
            block = tp.Block(2.0 * b, 2.0 * h, inertia_factor=inertia)
            assert after / before == pytest.approx(block.restitution, rel=1e-12)
            assert friction_at_impact(h / b, block.restitution) == pytest.approx(across / up, rel=1e-12)
        assert np.isnan(friction_at_impact(5.0, np.nan))

    @pytest.mark.parametrize("width", [0.36, 0.8])
    @pytest.mark.parametrize("times", [1.3, 3.0])
    def test_histories_need_what_the_formula_says(self, width, times):
        """The reactions of a rocking block over its history, from its exact motion: at uplift, and at all times."""
        block = tp.Block(width, 2.4)
        sets = noise(4, seed=3, dt=0.002)
        runs = tp.ida(block, tp.HousnerImpact(), sets, [times * G * block.b / block.h])
        found = screen(runs, sets).isel(block=0, level=0)
        for i in range(4):
            shake = tp.motions.scale_to(sets.isel(motion=[i]), times * G * block.b / block.h)
            run = tp.simulate(block, tp.HousnerImpact(), shake)
            theta, floor = run.rotation.values, run.floor_acceleration.values
            side = np.where(theta < 0.0, -1.0, 1.0)
            tilt = block.alpha - np.abs(theta)
            turning, spin = side * run.angular_acceleration.values, run.angular_velocity.values
            across = block.R * (np.cos(tilt) * turning + np.sin(tilt) * spin**2) + side * floor
            up = block.R * (np.sin(tilt) * turning - np.cos(tilt) * spin**2) + G
            need = np.where((theta != 0.0) & (np.abs(theta) < block.alpha), np.abs(across) / up, 0.0)
            lifted = int(np.argmax(np.abs(floor) > G * block.b / block.h))
            end = lifted + int(np.argmax(np.append(floor[lifted:] * floor[lifted] <= 0.0, True)))
            assert 0.98 <= need[lifted:end].max() / float(found["friction_uplift_demand"][i]) <= 1.000001
            assert 0.75 <= need.max() / float(found["friction_rocking_demand"][i]) <= 1.000001


class TestFrictionThereIs:
    def test_a_known_one_suffices_or_not(self):
        assert FixedFriction(0.5).below([0.4, 0.5, 0.6]).tolist() == [0.0, 0.0, 1.0]
        assert np.isnan(FixedFriction(0.5).below(np.nan))
        assert contact_of(0.5) == Contact(FixedFriction(0.5))
        assert contact_of(LognormalFriction(0.1, 0.2)) == Contact(LognormalFriction(0.1, 0.2))


class TestMotions:
    def test_band_of_a_gaussian(self):
        """|A(f)|² = exp(-(2 pi f s)²): the share below f is erf(2 pi f s)."""
        s, dt = 0.2, 0.005
        time = np.arange(-5.0, 5.0, dt)
        band = energy_band(np.exp(-0.5 * (time / s) ** 2), dt)
        np.testing.assert_allclose(band, erfinv([0.05, 0.95]) / (2.0 * np.pi * s), rtol=2e-3)
        np.testing.assert_allclose(energy_band(-7e5 * np.exp(-0.5 * (time / s) ** 2), dt), band, rtol=1e-12)

    def test_band_of_a_sine_holds_its_frequency(self):
        low, high = energy_band(np.sin(2.0 * np.pi * 3.0 * np.arange(0.0, 60.0, 0.01)), 0.01)
        assert 2.9 < low < 3.0 < high < 3.1

    def test_band_of_short_records(self):
        assert np.isnan(energy_band(np.zeros(5), 0.01)).all()
        # two samples, one of them zero: a flat spectrum up to the Nyquist frequency
        np.testing.assert_allclose(energy_band(np.array([1.0, 0.0]), 0.01), (2.5, 47.5))
        # a step so small that a transform padded to 20 s would fill any memory
        np.testing.assert_allclose(energy_band(np.array([1.0, 0.0]), 1e-30), (2.5e28, 4.75e29), rtol=1e-5)

    def test_half_cycles(self):
        assert half_cycle_peaks(np.array([0.0, 1.0, 2.0, 0.0, 1.0, -1.0, -3.0, 0.0, 2.0])).tolist() == [2.0, 3.0, 2.0]
        assert half_cycle_peaks(np.zeros(4)).size == 0


@pytest.fixture(scope="module")
def found():
    """Two blocks under three laws and three records that can be judged by hand, and their screen."""
    shakes = given([halves([1.0, -2.0, 1.0]), halves([0.5, 2.0, -4.0]), halves([1.0, -1.0, 1.0])])
    runs = tp.ida(BLOCKS, MODELS, shakes, np.array([0.15, 0.3, 0.8]) * G)
    return runs, shakes, screen(runs, shakes, 0.3)


class TestVerdict:
    def test_names_units_and_dimensions(self, found):
        runs, _, result = found
        assert result.verdict.dims == ("block", "model", "level", "motion")
        assert result.verdict.dtype == np.uint8
        assert result.outside.dims == ("block", "model", "reason")
        told = [reason.name for reason in REASONS if reason.name != "airborne"]  # (nothing shakes vertically)
        assert result.verdict.attrs["flag_meanings"].split() == told
        np.testing.assert_array_equal(result.verdict.attrs["flag_masks"], 2 ** np.arange(len(told)))
        for dim in ("block", "model", "level", "motion"):
            np.testing.assert_array_equal(result[dim].values, runs[dim].values)

    def test_friction_by_hand(self, found):
        """h/b = 5 and 1.6; the three records peak in the second, the third and the first of their half-cycles."""
        _, _, result = found
        np.testing.assert_allclose(result.friction_uplift, [0.2, 0.625])
        assert result.squat.values.tolist() == [False, True]
        levels = np.array([0.15, 0.3, 0.8]) * G
        # the records reach x = g b/h in this half-cycle, whose peak is this part of their own
        lifting = {0: [1.0, 1.0, 0.5], 1: [1.0, 1.0, 0.5], 2: [1.0, 1.0, 1.0]}
        for motion, part in lifting.items():
            np.testing.assert_allclose(
                result.friction_uplift_demand[0, :, motion], friction_at_uplift(5.0, part * levels), rtol=1e-6
            )
        np.testing.assert_allclose(result.friction_uplift_demand[1, :, 1], friction_at_uplift(1.6, levels), rtol=1e-6)
        for b, gamma in enumerate((5.0, 1.6)):
            for motion in range(3):
                np.testing.assert_allclose(
                    result.friction_rocking_demand[b, :, motion], friction_at_uplift(gamma, levels), rtol=1e-6
                )
        e = BLOCKS[0].restitution
        np.testing.assert_allclose(result.friction_impact[0, :2], [5.0 * (1.0 - e) / (1.0 + e), 5.0 / 3.0])
        assert np.isnan(result.friction_impact[:, 2]).all()

    def test_reasons_by_hand(self, found):
        """Friction 0.3: the slender block needs 0.2 to uplift, 0.25 at 0.4 g, 0.34 at 0.8 g, and 1.67 for e = 0.5."""
        _, _, result = found
        assert float(friction_at_uplift(5.0, 0.4 * G)) < 0.3 < float(friction_at_uplift(5.0, 0.8 * G))
        slides = result.verdict & (BIT["slides_at_uplift"] | BIT["slides_while_rocking"] | BIT["slides_at_impact"])
        at_uplift, rocking, at_impact = BIT["slides_at_uplift"], BIT["slides_while_rocking"], BIT["slides_at_impact"]
        # below 0.2 g nothing happens; above, e = 0.5 slides at every impact
        assert slides.sel(block="slender").isel(model=0).values.tolist() == [
            [0, 0, 0],
            [0, 0, 0],
            [rocking, rocking, rocking | at_uplift],
        ]
        np.testing.assert_array_equal(
            slides.sel(block="slender").isel(model=1) & at_impact, at_impact * np.array([[0] * 3, [1] * 3, [1] * 3])
        )
        # the squat block does not uplift before 0.625 g; its own e_R asks for 0.43 at impact
        assert (slides.sel(block="squat").isel(model=0, level=2) == at_uplift | rocking | at_impact).all()
        assert (slides.sel(block="squat").isel(level=0) == 0).all()
        assert ((result.verdict.sel(block="squat") & BIT["squat"]) > 0).all()
        assert ((result.verdict.sel(block="slender") & BIT["squat"]) == 0).all()
        np.testing.assert_array_equal(result.slides, slides > 0)

    def test_shares_are_those_of_the_bits(self, found):
        _, _, result = found
        bits = result.verdict.values
        for reason in REASONS:
            share = ((bits & reason.bit) > 0).mean(axis=(2, 3))
            np.testing.assert_array_equal(result.outside.sel(reason=reason.name).values, share)
        np.testing.assert_array_equal(result.outside.sel(reason="any").values, (bits > 0).mean(axis=(2, 3)))

    def test_elastic_mode(self):
        """3 Hz for R = 0.38 m and delta = 0.05; the square root of the zone's stiffness; none of rigid blocks."""
        block = tp.Block.from_slenderness(0.2, 0.38)
        models = [*MODELS, tp.DiscreteDamping(rest="rigid"), tp.EnergyConsistent(rest="elastic", delta=0.2)]
        time = np.arange(0.0, 20.0, 0.01)
        shakes = given([np.sin(2.0 * np.pi * f * time) for f in (1.0, 3.04, 8.0)])
        result = screen(tp.ida(block, models, shakes, [1.0]), shakes)
        frequency = result.elastic_frequency.values[0]
        assert frequency[0] == pytest.approx(3.0, abs=0.05)
        for j in (0, 2, 4):
            zone = next(one for one in models[j].oscillator(block).regions if one.lower < 0.0 < one.upper)
            assert frequency[j] == pytest.approx(np.sqrt(zone.stiffness) / (2.0 * np.pi), rel=1e-12)
        assert np.isnan(frequency[[1, 3]]).all()
        inside = (result.verdict[0, :, 0] & BIT["elastic_mode"]) > 0
        assert inside.values.tolist() == [
            [False, True, False],
            [False] * 3,
            [False, True, False],
            [False] * 3,
            [False] * 3,
        ]

    def test_scale_factors_of_motions_with_an_amplitude_of_their_own(self):
        block, model = BLOCKS[0], MODELS[0]
        levels = [0.1, 1.0, 4.9, 5.1]
        record = given(halves([1.0, -1.0]))
        result = screen(tp.ida(block, model, record, levels), record)
        np.testing.assert_allclose(result.scale_factor[:, 0], levels)
        assert ((result.verdict[0, 0, :, 0] & BIT["scaled_far"]) > 0).values.tolist() == [True, False, False, True]
        wide = screen(tp.ida(block, model, record, levels), record, factors=(0.05, 6.0))
        assert ((wide.verdict & BIT["scaled_far"]) == 0).all()
        for free in (noise(1), tp.motions.OneCycleSine(1.0, 6.0).sample(1)):
            result = screen(tp.ida(block, model, free, [1e-3, 1e3], im="scale"), free)
            assert ((result.verdict & BIT["scaled_far"]) == 0).all()
        scenario = tp.motions.SiteBasedScenario(6.5, 20e3, 400.0).sample(1)
        result = screen(tp.ida(block, model, scenario, [0.19, 1.0], im="scale"), scenario)
        assert ((result.verdict[0, 0, :, 0] & BIT["scaled_far"]) > 0).values.tolist() == [True, False]

    def test_few_motions(self):
        for n in (3, 38, 39, 44, 93):
            low, high = wilson_interval(np.array(0.5 * n), np.array(n))
            assert wilson_half_width(n) == pytest.approx(float(high - low) / 2.0, rel=1e-12)
        assert [runs_for_half_width(width) for width in (0.1, 0.15, 0.2)] == [93, 39, 21]
        shakes = given(np.ones((39, 3)) * [0.0, 1.0, 0.0])
        runs = tp.ida(BLOCKS[0], MODELS[0], shakes, [1.0])
        assert not bool(screen(runs, shakes).few_motions)
        assert bool(screen(runs.isel(motion=slice(38)), shakes).few_motions)
        assert bool(screen(runs, shakes, half_width=0.1).few_motions)

    def test_random_and_several_frictions(self, found):
        runs, shakes, _ = found
        several = {"slender": LognormalFriction(0.3, 0.2), "squat": 0.7}
        result = screen(runs, shakes, several)
        assert result.slides.dtype == np.float32
        need = np.fmax(result.friction_rocking_demand, result.friction_impact)[0].transpose("model", "level", "motion")
        chance = LognormalFriction(0.3, 0.2).below(need.values)
        np.testing.assert_allclose(result.slides[0, :, 1:], chance[:, 1:], rtol=1e-5)
        np.testing.assert_allclose(
            result.slides[0, :, 0], LognormalFriction(0.3, 0.2).below(np.full((3, 3), 0.15)), rtol=1e-5
        )
        np.testing.assert_array_equal(result.slides[1, 0], result.friction_rocking_demand[1] > 0.7)
        np.testing.assert_array_equal(
            (result.verdict & (BIT["slides_at_uplift"] | BIT["slides_while_rocking"] | BIT["slides_at_impact"])) > 0,
            result.slides > 0.5,
        )
        settings = json.loads(result.attrs["screen"])
        assert settings["friction"]["slender"] == {"distribution": "lognormal", "median": 0.3, "dispersion": 0.2}

    def test_without_friction_only_what_no_floor_has_counts(self, found):
        runs, shakes, _ = found
        result = screen(runs, shakes)
        assert "slides" not in result
        slides = (result.verdict & BIT["slides_at_impact"]) > 0
        assert slides.sel(block="slender").isel(model=1)[1:].all()
        assert int(slides.sum()) == 6  # e = 0.5, where it uplifts: 2 levels of 3 motions
        assert ((result.verdict & BIT["slides_while_rocking"]) == 0).all()

    def test_without_motions(self, found):
        runs, _, result = found
        less = screen(runs, friction=0.3)
        assert not {"friction_uplift_demand", "band_low", "band_high"} & {*less}
        shared = BIT["squat"] | BIT["slides_while_rocking"] | BIT["slides_at_impact"] | BIT["scaled_far"]
        np.testing.assert_array_equal(less.verdict, result.verdict & shared)


class TestDesigns:
    def test_floors_and_the_ground_below(self):
        ground = noise(3)
        building = tp.motions.Building.flexural_shear(0.8, storeys=4)
        floors = building.floor_motions(ground, [0, 4])
        runs = tp.ida(BLOCKS, MODELS, floors, [1.0, 3.0], ground=ground)
        result = screen(runs, floors, undecided=True)
        expected = np.array([1.0, 3.0])[:, None] / runs.ground_pga.values
        np.testing.assert_allclose(result.scale_factor.transpose("level", "motion"), expected)
        assert json.loads(result.attrs["screen"])["fewest_motions"] == 3
        assert ((result.verdict & BIT["scaled_far"]) == 0).all()  # filtered noise, on the roof, too

    @pytest.mark.parametrize("im", ["arias", "pga_normalised", "Sa(0.5)", "scale"])
    def test_factors_are_those_of_the_analysis(self, im):
        from toppling.fragility.runs.factors import dense
        from toppling.fragility.runs.provenance import factors_of
        from toppling.fragility.runs.scaling import scaling

        shakes = noise(3)
        runs = tp.ida(BLOCKS, MODELS[0], shakes, [0.5, 2.0], im=im)
        expected = dense(scaling([0.5, 2.0], records(shakes), im, BLOCKS).factors)
        np.testing.assert_allclose(factors_of(runs), expected, rtol=1e-14)
        result = screen(runs, shakes)
        peak = expected * runs.pga.values
        np.testing.assert_allclose(
            result.friction_rocking_demand.broadcast_like(runs.overturned[:, 0]).transpose("block", "level", "motion"),
            friction_at_uplift(np.array([5.0, 1.6]).reshape(2, 1, 1), np.broadcast_to(peak, (2, 2, 3))),
            rtol=1e-6,
        )

    def test_a_cloud_says_what_the_incremental_analysis_says(self):
        shakes = noise(5)
        scaled = xr.concat([tp.motions.scale_to(shakes.isel(motion=[i]), 3.0) for i in range(5)], "motion")
        expected = screen(tp.ida(BLOCKS, MODELS, shakes, [1.0, 3.0]), shakes, 0.25, undecided=True)
        for im in ("pgv", "pga_normalised"):
            result = screen(tp.cloud(BLOCKS, MODELS, scaled, im), scaled, 0.25, undecided=True)
            assert result.verdict.dims == ("block", "model", "motion")
            np.testing.assert_array_equal(result.verdict, expected.verdict.isel(level=1))
            assert (result.scale_factor == 1.0).all()
            (fact,) = (fact for fact in screen_facts(result) if fact.what == "stability.undecided")
            assert (fact.more["perturbed"], fact.more["motions"]) == (5, 5)

    def test_stripes_say_what_the_incremental_analysis_says(self):
        shakes, others = noise(5), noise(4, seed=9)
        sets = [shakes, [shakes.isel(motion=[0, 3]), others]]
        runs = tp.stripes(BLOCKS, MODELS, sets, [1.0, 3.0])
        expected = screen(tp.ida(BLOCKS, MODELS, [shakes, others], [1.0, 3.0]), [shakes, others], 0.25, undecided=True)
        result = screen(runs, sets, 0.25, undecided=True)
        np.testing.assert_array_equal(result.verdict[..., :5], expected.verdict.isel(level=0, motion=slice(5)))
        np.testing.assert_array_equal(
            result.verdict[..., 5:], expected.verdict.isel(level=1, motion=[0, 3, 5, 6, 7, 8])
        )
        assert json.loads(result.attrs["screen"])["fewest_motions"] == 5
        first = screen(runs.isel(motion=slice(5)), sets, 0.25)
        np.testing.assert_array_equal(first.verdict, screen(runs, sets, 0.25).verdict[..., :5])
        as_they_are = tp.stripes(BLOCKS, MODELS, sets, [1.0, 3.0], scale=False)
        assert (screen(as_they_are, sets).scale_factor == 1.0).all()


LEVELS = np.linspace(1.5, 6.0, 10)
FOUR = [*MODELS, tp.EnergyConsistent(e=1.0)]


@pytest.fixture(scope="module")
def chaotic():
    """Eight motions at ten levels, some of whose flags flip."""
    shakes = noise(8, seed=4)
    return tp.ida(BLOCKS[:1], FOUR, shakes, LEVELS), shakes


class TestUndecided:
    def test_equals_brute_force(self, chaotic, monkeypatch):
        """Analyses of their own, at perturbed levels and with perturbed laws; enough flags flip at a hundredth."""
        whole, shakes = chaotic
        monkeypatch.setattr(perturbed, "PERTURBATION", 1e-2)
        nominal = whole.overturned
        block = BLOCKS[0]
        expected = np.zeros(nominal.shape, int)
        for up in (1.01, 0.99):
            there = tp.ida([block], FOUR, shakes, LEVELS * up, outputs=("overturned",)).overturned.values
            expected += there != nominal.values
            for j, model in enumerate(FOUR):
                e = model.restitution(block)
                if e is not None and e * up <= 1.0:
                    other = replace(model, e=e * up)
                    there = tp.ida(block, other, shakes, LEVELS, outputs=("overturned",)).overturned.values
                    expected[:, j] += there[:, 0] != nominal.values[:, j]
        found = undecided_outcomes(whole, shakes)
        np.testing.assert_array_equal(found.values, expected)
        assert (expected > 0).sum(axis=(0, 2, 3)).min() > 0  # every law has some
        result = screen(whole, shakes, undecided=True)
        np.testing.assert_array_equal(result.undecided, (expected > 0).mean(axis=(2, 3)))
        np.testing.assert_array_equal((result.verdict & BIT["undecided"]) > 0, expected > 0)
        low, high = wilson_interval((expected > 0).sum(axis=(2, 3)), np.full((1, 4), 80))
        np.testing.assert_array_equal(result.undecided_lower, low)
        np.testing.assert_array_equal(result.undecided_upper, high)
        np.testing.assert_array_equal(result.outside.sel(reason="undecided"), result.undecided)

    def test_few_flags_are_undecided(self, chaotic):
        whole, shakes = chaotic
        assert float(screen(whole, shakes, undecided=True).undecided.mean()) < 0.05

    def test_a_part_of_the_motions(self, chaotic, monkeypatch):
        whole, shakes = chaotic
        monkeypatch.setattr(perturbed, "PERTURBATION", 1e-2)
        every = undecided_outcomes(whole, shakes).values
        some = undecided_outcomes(whole, shakes, 0.5)
        chosen = (some >= 0).all(["block", "model", "level"]).values
        assert chosen.sum() == 4
        np.testing.assert_array_equal(some.values[..., chosen], every[..., chosen])
        assert (some.values[..., ~chosen] == -1).all()
        result = screen(whole, shakes, undecided=0.5)
        np.testing.assert_array_equal(result.perturbed, chosen)
        np.testing.assert_array_equal(result.undecided, (every[..., chosen] > 0).mean(axis=(2, 3)))
        np.testing.assert_array_equal(result.outside.sel(reason="undecided"), result.undecided)
        assert (result.verdict[..., ~chosen] & BIT["undecided"] == 0).all()
        assert perturbed.choose_motions(8, 1e-9).sum() == 1
        assert perturbed.choose_motions(100, 0.08).sum() == 8
        assert perturbed.choose_motions(8, 1.0).all()

    def test_does_not_depend_on_chunks_or_the_clock(self, chaotic, monkeypatch):
        whole, shakes = chaotic
        first = screen(whole, shakes, 0.3, undecided=True)
        done = []
        for seconds in (1e-9, 1e9):
            monkeypatch.setattr(plan, "LEAST_SECONDS", seconds)
            monkeypatch.setattr(plan, "CHUNK_SECONDS", seconds)
            again = screen(whole, shakes, 0.3, undecided=True, progress=lambda *count: done.append(count))
            xr.testing.assert_identical(again, first)
        n = perturbed.perturbed_runs(1, FOUR, 10, 8, 1.0)
        assert done[-1] == (n, n) == (1120, 1120)

    def test_stored_runs_and_a_selection_of_them(self, chaotic, tmp_path):
        whole, shakes = chaotic
        whole.to_netcdf(tmp_path / "runs.nc")
        with xr.open_dataset(tmp_path / "runs.nc") as stored:
            part = stored.isel(model=[2, 0], level=slice(3, 6), motion=[6, 1])
            result = screen(part, shakes, 0.3, undecided=True)
        expected = screen(whole, shakes, 0.3, undecided=True).verdict
        np.testing.assert_array_equal(
            result.verdict, expected.isel(model=[2, 0], level=slice(3, 6), motion=[6, 1]).values
        )

    def test_runs_that_were_read_in_chunks(self, chaotic):
        whole, shakes = chaotic
        chunked = screen(whole.chunk({"motion": 3}), shakes, 0.3, undecided=np.True_)
        xr.testing.assert_identical(chunked.compute(), screen(whole, shakes, 0.3, undecided=True))


class TestErrors:
    @pytest.mark.filterwarnings("ignore::toppling.core.doubts.ImplausibleInput")
    def test_sliding_blocks_have_no_screen_of_rocking(self):
        """Their runs would be called all right, whatever they do."""
        block, shakes = tp.Block(0.6, 1.8), noise(64)
        slid = tp.ida(block, tp.Sliding(0.2), shakes, [2.0])
        sparse = tp.adaptive_ida(block, tp.Sliding(0.2), shakes, until={"median": 0.3, "state": Slip(0.05)})
        drawn = slide_runs(tp.ida(block, MODELS[0], shakes, [2.0]), shakes, 0.2)
        for runs in (slid, sparse, drawn):
            with pytest.raises(ValueError, match="runs must be of rocking blocks, got some of sliding ones"):
                screen(runs, shakes)

    def test_stands_in_every_dataset_of_runs(self):
        shakes = noise(4)
        weak, strong = shakes.isel(motion=[0, 1]), shakes.isel(motion=[2, 3])
        for runs, sets in (
            (tp.ida(BLOCKS, MODELS, shakes, [1.0, 4.0]), shakes),
            (tp.stripes(BLOCKS, MODELS, [weak, strong], [1.0, 4.0]), [weak, strong]),
            (tp.cloud(BLOCKS, MODELS, shakes), shakes),
        ):
            assert runs.verdict.dims == runs.overturned.dims
            assert (runs.verdict > 0).any()
            alone = screen(runs, sets)
            xr.testing.assert_identical(
                runs[list(alone.data_vars)].drop_vars(runs.coords),
                alone.drop_vars(alone.coords).drop_attrs(deep=False).assign_attrs(runs.attrs),
            )
            assert runs.attrs["screen"] == alone.attrs["screen"]
            assert notes(runs) == notes(alone)


class TestNotes:
    def test_one_sentence_for_each_reason(self, found):
        runs, shakes, result = found
        facts = screen_facts(result)
        names = [fact.what for fact in facts]
        assert names == [
            *("block.squat", "sliding.share", "sliding.share", "sliding.share", "law.elastic_mode"),
            *("motion.scaled_far", "validity.few_motions", "validity.not_modelled"),
        ]
        assert [fact.more["when"] for fact in facts[1:4]] == ["uplift", "rocking", "impact"]
        assert [fact.upper for fact in facts[2:4]] == pytest.approx([0.67, 1.67], abs=0.005)
        assert facts[0].names == ("squat",)
        assert facts[6].value == pytest.approx(0.37, abs=0.005)
        assert len(notes(result)) == len(facts)
        bare = {fact.what: fact for fact in screen_facts(screen(runs, shakes))}
        given = bare["friction.not_given"]
        assert (given.lower, given.upper) == pytest.approx((0.20, 0.62), abs=0.006)
        assert not bare["sliding.share"].more["given"]

    def test_scale_factors_that_are_not_known(self, found):
        """Motions without an amplitude of their own have no factor: the range is that of the others."""
        _, _, result = found
        factors = result.copy(deep=True)
        factors["scale_factor"] = xr.full_like(result["scale_factor"], 7.0)
        factors["scale_factor"][0] = np.nan
        factors["scale_factor"][-1] = 0.12
        for least, most in ((0.12, 7.0), (None, None)):
            (scaled,) = (fact for fact in screen_facts(factors) if fact.what == "motion.scaled_far")
            assert scaled.more == {"least": least, "most": most}
            factors["scale_factor"][:] = np.nan

    def test_undecided_flags(self, found):
        runs, shakes, _ = found
        facts = screen_facts(screen(runs, shakes, undecided=True))
        (fact,) = (fact for fact in facts if fact.what == "stability.undecided")
        assert (fact.more["flipped"], fact.more["tested"], fact.more["perturbed"]) == (0, 54, 3)
        assert fact.upper == pytest.approx(0.066, abs=0.001)

    def test_of_blocks_alone(self):
        assert block_notes([BLOCKS[0]]) == []
        wide = block_notes([tp.Block(40.0, 60.0, name="house")])
        assert wide[0].startswith("house: ")
        assert "1.5 half widths" in wide[0]
        assert numbers_in(wide[1]) == [20, 40, 60, 0.4, 0.6, 100, 1.016, 1.524]


def test_friction_of_a_study(tmp_path):
    """None is repeated where `undecided` is 0; slides are numbers between 0 and 1 where friction is uncertain."""
    path = tmp_path / "study.toml"

    def study(text):
        path.write_text(f"title = 'Friction'\n{CABINET}{motions(12)}{IDA}[friction]\n{text}", encoding="utf-8")
        return tp.Study.from_toml(path)

    drawn = study("static = 0.4\ndispersion = 0.2\n[screen]\nundecided = 0\n")
    assert drawn.friction == LognormalFriction(0.4, 0.2)
    assert drawn.perturbed_runs == 0
    result = drawn.run()
    assert "undecided" not in result
    assert result.slides.dtype == np.float32
    assert study("static = 0.4\n[screen]\nundecided = 1\n").friction == FixedFriction(0.4)
    assert study('contact = "carpet"\n').slides == Slides(LognormalFriction(0.55, 0.3), 0.9)


def test_refused(refusal):
    refusal()
