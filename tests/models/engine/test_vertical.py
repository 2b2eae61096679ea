"""Vertical shaking: the weight of a block changes while it rocks, in exact geometry."""

import math

import numpy as np
import pytest
from reference import integrate
from stress_cases import IMPACTS, OVERTURNED, PEAK, UPLIFTED, follows, noise

import toppling as tp
from toppling.core.units import STANDARD_GRAVITY as G
from toppling.models.engine.series import evaluate, exact_series
from toppling.models.engine.tables import DEGREE, MOVED, SPEED
from toppling.models.oscillator import exact_lever
from toppling.models.outputs import OF_ENGINE
from toppling.models.runs import TALLY, run_many, trace

AIRBORNE = OF_ENGINE["airborne"]
TALL = tp.Block(0.4, 1.2)
SCENES = {
    "free": {},
    "offset": {"cm_offset": 0.04},
    "lean": {"lean": 0.02},
    "wall": {"wall": tp.Wall(0.05)},
    "touching wall": {"wall": tp.Wall()},
    "two walls": {"wall": tp.Wall(0.03, front_gap=2.0), "cm_offset": -0.03},
}


def heavier(oscillator, weight):
    """The oscillator of the same block where gravity is `weight` times as strong."""
    return oscillator._replace(
        regions=tuple(
            one._replace(stiffness=one.stiffness * weight, offset=one.offset * weight) for one in oscillator.regions
        ),
        rests=tuple(one._replace(up=one.up * weight, down=one.down * weight) for one in oscillator.rests),
    )


def shaking(rng, n, dt, p, alpha, level, least=0.2, most=0.95):
    """A horizontal and a vertical record; the latter takes at most 95 % of the weight from a block."""
    level = noise(rng, n, dt, 0.3 / p) * G * math.tan(alpha) * level
    vertical = noise(rng, n, dt, float(rng.choice([0.02, 0.1, 1.0])) / p)
    return level, vertical * (rng.uniform(least, most) * G / np.abs(vertical).max())


def draws(seed, runs, n=300):
    """Blocks, restitution, steps and records of both components."""
    rng = np.random.default_rng(seed)
    for _ in range(runs):
        alpha, size, inertia = rng.uniform(0.1, 0.5), rng.uniform(0.3, 2.0), rng.uniform(1.1, 1.6)
        e, dt = rng.uniform(0.7, 1.0), float(rng.choice([0.005, 0.01, 0.02]))
        p = math.sqrt(G / (inertia * size))
        across, up = shaking(rng, n, dt, p, alpha, rng.uniform(0.5, 2.5))
        yield {"alpha": alpha, "R": size, "inertia_factor": inertia, "e": e, "dt": dt}, across, up


@pytest.mark.slow
@pytest.mark.parametrize(
    ("start", "across", "up", "expected"),
    [
        ((0.08, 0.4), (-3.0, 2000.0), (4.0, -3000.0), (0.0837346708496402, 0.322601342717605)),
        ((0.2, -1.0), (6.0, -500.0), (-8.0, 900.0), (0.189709181251852, -1.05073013661906)),
    ],
)
def test_the_series_of_a_piece(start, across, up, expected):
    """10 ms with accelerations that change fast, against DOP853 at rtol 1e-13 (the first one passes -g at its end)."""
    oscillator = tp.HousnerImpact().oscillator(TALL)
    front = next(one for one in oscillator.regions if one.upper > 0.0)
    poly, trig = np.zeros((3, DEGREE + 1)), np.zeros((2, DEGREE + 1))
    force, slope = (-oscillator.gain * one for one in across)
    n, h = exact_series(
        poly, trig, (1.0 + up[0] / G, up[1] / G), *start, -front.stiffness, TALL.alpha, exact_lever(oscillator), force,
        slope, 0.01,
    )  # fmt: skip
    assert h == 0.01
    found = start[0] + evaluate(poly[MOVED], n, h), evaluate(poly[SPEED], n, h)
    assert found == pytest.approx(expected, rel=0.0, abs=4e-15)


def test_harmonic_shaking_in_both_directions():
    """From (0.08, 0.4) under -3 cos 5t and, upward, 4 sin 20t, for 0.2 s: second order in the samples' step."""
    oscillator = tp.HousnerImpact().oscillator(TALL)
    errors = []
    for n in (200, 2000, 20000):
        t = np.linspace(0.0, 0.2, n + 1)
        run = trace(oscillator, -3.0 * np.cos(5.0 * t), 0.2 / n, 0.08, 0.4, vertical=4.0 * np.sin(20.0 * t))
        errors.append(np.abs(run.history[:2, -1] - (0.162380562407, 0.437130158085)).max())
    assert errors[-1] < 2.5e-10
    assert errors[0] / errors[1] == pytest.approx(100.0, rel=0.05)


class TestWithoutIt:
    """No vertical shaking, or none that changes."""

    def test_zero_is_none(self):
        rng = np.random.default_rng(3)
        record = noise(rng, 600, 0.01, 0.1) * 4.0
        factors = np.geomspace(0.2, 4.0, 30)[None]
        oscillator = tp.HousnerImpact().oscillator(TALL)
        for skip, flags_only in ((True, False), (False, False), (True, True)):
            without = run_many([oscillator], factors, record, 0.01, skip, flags_only)
            zero = run_many([oscillator], factors, record, 0.01, skip, flags_only, vertical=np.zeros(600))
            np.testing.assert_array_equal(zero, without)
        assert (without[..., AIRBORNE] == 0.0).all()

    @pytest.mark.parametrize("scene", SCENES)
    @pytest.mark.parametrize("c", [3.0, -4.0, -9.0])
    def test_a_constant_one_is_another_gravity(self, scene, c):
        """Thresholds, impacts, bounces, walls and rests: all of a block where gravity is g + c."""
        weight = 1.0 + c / G
        oscillator = tp.HousnerImpact(e=0.9).oscillator(tp.Block(0.4, 1.2, **SCENES[scene]))
        other = heavier(oscillator, weight)
        rng = np.random.default_rng(17)
        up = np.full(500, c)
        up[-1] = 0.0  # (after the record there is none: both are followed under g)
        same = peaks = 0
        for level in np.geomspace(0.6, 3.0, 12) * weight:
            record = noise(rng, 500, 0.01, 0.08) * G * math.tan(TALL.alpha) * level
            record[-40:] = 0.0
            one, two = trace(oscillator, record, 0.01, vertical=np.full(500, c)), trace(other, record, 0.01)
            three = trace(other, record * (1.0 + 1e-13), 0.01)
            apart = np.abs(one.history[0] - two.history[0]).max()
            assert apart <= max(1e-11, 1000.0 * np.abs(three.history[0] - two.history[0]).max())
            same += (one.results[[UPLIFTED, IMPACTS]] == two.results[[UPLIFTED, IMPACTS]]).all()
            peaks += two.results[UPLIFTED]
        assert same >= 11
        assert peaks >= 6

    @pytest.mark.parametrize("c", [4.0, -6.0])
    def test_the_threshold(self, c):
        """g (1 + c/g) tan(alpha)."""
        threshold = (G + c) * TALL.b / TALL.h
        oscillator = tp.HousnerImpact().oscillator(TALL)
        for skip in (True, False):
            for sign in (1.0, -1.0):
                for part, lifts in ((1.0 - 1e-12, 0.0), (1.0 + 1e-12, 1.0)):
                    record = sign * threshold * part * np.array([0.0, 0.5, 1.0, 0.5, 0.0])
                    found = run_many([oscillator], np.ones((1, 1)), record, 0.01, skip, vertical=np.full(5, c))[0, 0]
                    assert found[UPLIFTED] == lifts


def agrees(draw, across, up):
    """One run against the reference: verdict and peak, as far as a twin perturbed by 1e-13 keeps to them."""
    block = tp.Block.from_slenderness(draw["alpha"], draw["R"], draw["inertia_factor"])
    run = trace(tp.HousnerImpact(e=draw["e"]).oscillator(block), across, draw["dt"], vertical=up)
    truth = integrate("housner", geometry="exact", acceleration=across, vertical=up, **draw)
    error = abs(run.results[PEAK] - truth.peak)
    if (run.results[OVERTURNED] == 1.0) == truth.overturned and error <= 1e-9 * truth.peak:
        return truth.overturned
    twins = [
        integrate("housner", geometry="exact", acceleration=across * s, vertical=up, **draw)
        for s in (1.0 + 1e-13, 1.0 - 1e-13)
    ]
    assert follows(run.history, truth, twins, 1e-9 * truth.peak, error), (draw, error)
    return truth.overturned


def test_against_an_8th_order_integration():
    """500 random blocks under random records in both directions: flags, and peaks to 1e-9."""
    falls = sum(agrees(*draw) for draw in draws(11, 500))
    assert 150 < falls < 450


class TestSkipping:
    """What is left out changes no flag."""

    @pytest.mark.parametrize("scene", SCENES)
    def test_flags_of_thousands_of_runs(self, scene):
        rng = np.random.default_rng(23)
        tally = np.zeros(len(TALLY), np.int64)
        falls, runs = 0, 0
        for _ in range(12):
            e, dt = float(rng.uniform(0.6, 1.0)), float(rng.choice([0.005, 0.01, 0.02]))
            block = tp.Block(float(rng.uniform(0.25, 0.6)), 1.2, **SCENES[scene])
            oscillator = tp.HousnerImpact(e=e).oscillator(block)
            across, up = shaking(rng, 500, dt, block.p, block.alpha, 1.0, 0.05, 0.6)
            across *= np.sin(np.linspace(0.0, math.pi, 500))
            factors = np.exp(rng.uniform(math.log(0.05), math.log(4.0), (1, 60)))
            with_skip, without = (
                run_many([oscillator], factors, across, dt, skip, vertical=up)[0] for skip in (True, False)
            )
            flags = [OVERTURNED, UPLIFTED, IMPACTS, AIRBORNE]
            np.testing.assert_array_equal(with_skip[:, flags], without[:, flags])
            np.testing.assert_allclose(with_skip[:, PEAK], without[:, PEAK], rtol=1e-12)
            short = run_many([oscillator], factors, across, dt, True, True, tally, up)[0]
            np.testing.assert_array_equal(short[:, [OVERTURNED, AIRBORNE]], without[:, [OVERTURNED, AIRBORNE]])
            falls += np.nansum(without[:, OVERTURNED])
            runs += factors.size
        assert 0.05 < falls / runs < 0.9
        counts = dict(zip(TALLY, tally.tolist(), strict=True))
        for reason in ("before_uplift", "cannot_overturn"):
            assert counts[reason] > 0.01 * counts["samples"] or "wall" in scene

    def test_a_record_reversed_by_its_factor(self):
        """A negative factor turns both components."""
        rng = np.random.default_rng(29)
        oscillators = [tp.HousnerImpact(e=0.8).oscillator(tp.Block(0.4, 1.2, **SCENES[one])) for one in SCENES]
        across, up = shaking(rng, 400, 0.01, TALL.p, TALL.alpha, 1.0, 0.3, 0.3)
        factors = np.tile([-1.9, 0.9, -0.9, 1.9, -0.4], (len(oscillators), 1))
        for skip in (True, False):
            both = run_many(oscillators, factors, across, 0.01, skip, vertical=up)
            turned = run_many(oscillators, -factors, -across, 0.01, skip, vertical=-up)
            np.testing.assert_array_equal(both, turned)

    def test_a_history_is_the_same_run(self):
        """Bit for bit, though a history goes through all samples at which the block rests."""
        for (draw, across, up), scene in zip(draws(31, 24, n=600), 4 * list(SCENES), strict=True):
            block = tp.Block(0.4, 1.2, **SCENES[scene])
            oscillator = tp.HousnerImpact(e=draw["e"]).oscillator(block)
            record = across * np.repeat(np.random.default_rng(5).uniform(0.0, 1.0, 12), 50) ** 3
            run = trace(oscillator, record, draw["dt"], vertical=up)
            many = run_many([oscillator], np.ones((1, 3)), record, draw["dt"], False, vertical=up)[0]
            np.testing.assert_array_equal(many, np.broadcast_to(run.results, many.shape))


def test_the_mirror_image():
    """ü → -ü with the same vertical shaking: the other side, bit for bit."""
    for draw, across, up in draws(37, 20):
        oscillator = tp.HousnerImpact(e=draw["e"]).oscillator(TALL)
        one, other = (trace(oscillator, sign * across, draw["dt"], vertical=up) for sign in (1.0, -1.0))
        np.testing.assert_array_equal(one.history[:2], -other.history[:2])
        np.testing.assert_array_equal(one.results[[PEAK, OVERTURNED]], other.results[[PEAK, OVERTURNED]])


def test_energy():
    """Without loss at impacts the energy is the work of the floor, of the vertical component too."""
    rng = np.random.default_rng(41)
    oscillator = tp.HousnerImpact(e=1.0).oscillator(TALL)
    n, fine = 250, 40
    across, up = shaking(rng, n, 0.01, TALL.p, TALL.alpha, 0.3, 0.5, 0.5)
    t, coarse = np.arange((n - 1) * fine + 1) * 0.01 / fine, np.arange(n) * 0.01
    across, up = np.interp(t, coarse, across), np.interp(t, coarse, up)
    run = trace(oscillator, across, 0.01 / fine, 0.4 * TALL.alpha, vertical=up)
    theta, omega = run.history[:2]
    lean = np.sign(theta) * TALL.alpha - theta
    energy = 0.5 * omega**2 + TALL.p**2 * np.cos(lean)
    power = -omega * TALL.p**2 / G * (across * np.cos(lean) + up * np.sin(lean))
    # (the power jumps at an impact: a few steps of 0.25 ms, each known to half a jump times the step)
    work = np.concatenate([[0.0], np.cumsum(0.5 * (power[1:] + power[:-1]) * np.diff(t))])
    impacts = np.flatnonzero(theta[1:] * theta[:-1] <= 0.0)
    assert run.results[OVERTURNED] == 0.0
    assert impacts.size > 3
    smooth = np.setdiff1d(np.arange(t.size - 1), impacts)
    gained = np.diff(energy) - np.diff(work)
    assert np.abs(gained[smooth]).max() < 2e-8
    assert np.ptp(work) > 0.1
    assert np.abs(np.cumsum(gained)).max() < 1e-3


class TestLowBounces:
    """Impacts by the hundred in a sample, under a weight that changes."""

    @pytest.mark.parametrize("rates", [(0.3, -0.3), (-0.3, 3.0), (2.0, -0.9)])
    def test_cubics_against_pieces(self, rates):
        """Flights as cubics, and each as a series: those are taken where turning points are asked for."""
        oscillator = tp.HousnerImpact(e=0.998).oscillator(TALL)
        across = np.array([1.00001, 0.2, 0.2, 0.2]) * G * TALL.b / TALL.h
        up = np.array([0.0, *rates, 0.0]) * G
        cubics, pieces = (trace(oscillator, across, 0.2, vertical=up, max_turning_points=room) for room in (0, 10**5))
        assert cubics.results[IMPACTS] > 300
        assert cubics.results[IMPACTS] == pieces.results[IMPACTS]
        for name in ("peak_rotation", "impact_velocity"):
            assert cubics.results[OF_ENGINE[name]] == pytest.approx(pieces.results[OF_ENGINE[name]], rel=1e-12)

    def test_every_block_rests_in_the_end(self):
        rng = np.random.default_rng(43)
        for e in (0.3, 0.6, 0.9):  # (with less loss the vertical component can keep a block rocking)
            for scene in SCENES.values():
                oscillator = tp.HousnerImpact(e=e).oscillator(tp.Block(0.4, 1.2, **scene))
                across = np.append(1.3 * G / 3.0 * rng.uniform(-1.0, 1.0, 20), np.zeros(3000))
                up = 0.9 * G * rng.uniform(-1.0, 1.0, 3020)
                run = trace(oscillator, across, 0.01, vertical=up)
                if run.results[OVERTURNED] == 0.0:
                    assert run.history[2, -1] < 0.0


class TestAirborne:
    """A floor that leaves the block: the run has no answer."""

    def test_the_flag(self):
        rng = np.random.default_rng(47)
        across, up = shaking(rng, 300, 0.01, TALL.p, TALL.alpha, 1.0, 0.5, 0.5)
        lowest = -up.min() / G
        factors = np.array([[0.9, 1.0 - 1e-9, 1.0, 1.5]]) / lowest
        oscillator = tp.HousnerImpact().oscillator(TALL)
        for skip, flags_only in ((True, False), (False, False), (True, True)):
            found = run_many([oscillator], factors, across, 0.01, skip, flags_only, vertical=up)[0]
            assert found[:, AIRBORNE].tolist() == [0.0, 0.0, 1.0, 1.0]
            assert np.isnan(found[2:, :AIRBORNE]).all()
            assert np.isfinite(found[:2, OVERTURNED]).all()

    @pytest.mark.parametrize("geometry", ["linear", "bilinear"])
    def test_exact_geometry_only(self, geometry):
        oscillator = tp.HousnerImpact(geometry=geometry).oscillator(TALL)
        with pytest.raises(ValueError, match="exact geometry"):
            run_many([oscillator], np.ones((1, 1)), np.ones(5), 0.01, vertical=np.ones(5))
