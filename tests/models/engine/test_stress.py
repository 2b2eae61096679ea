"""The engine at the ends of its ranges, through the plain interface of `toppling.models.runs` only.

What is held, for every law: a finite answer in bounded time with boundedly many events; the reference's answer
(support/reference.py, 8th-order integration, or 40 digits, support/forty_digits.py) to max(1e-9, 100 x the change of a
twin whose motion is perturbed by 1e-13); rest that is rest; energy that never grows; and results that depend neither on
`skip` nor on the company of other runs.
"""

import math

import forty_digits
import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from reference import integrate
from reference_cases import CASES
from repeatable import REPEATABLE
from shared_cases import ELASTIC, LAWS, RIGID, lifts_at, shake
from stress_cases import (
    BLOCK,
    ELASTIC_CASES,
    EVENTS,
    IMPACTS,
    OVERTURNED,
    PEAK,
    RIGID_CASES,
    UPLIFTED,
    answer,
    check,
    check_sane,
    compile_engine,
    decades,
    draws,
    given_draw,
    label,
    noise,
    parts,
    rate_bound,
    record_of,
    threshold,
)

import toppling as tp
from toppling.models.engine.tables import REST
from toppling.models.runs import run_many, trace

# Draws that were off once: bounces by the thousand in a sample where e is next to 1, and twins with the same peak by
# accident (the first one).
FOUND_KEYS = [
    "alpha",
    "R",
    "inertia_factor",
    "e",
    "delta",
    "zeta",
    "dt",
    "seed",
    "cycles",
    "correlation",
    "level",
    "from_zero",
]
FOUND = [
    (
        "viscous",
        {},
        "0.010000000000000004 5.156584491313543 1.9 0.6321205588285577 1.670170079024566e-05 0.010000000000000004 "
        "0.009803655035821828 999 24.0 0.030402422238537823 0.5066169923655895 1",
    ),
    (
        "discrete",
        {"rest": "rigid"},
        "0.1353352832366127 0.22976387565246192 1.580078125 0.99999893229599 0.1353352832366127 0.0 "
        "0.007183010216050975 185 30.0 0.0301973834223185 1.0 0",
    ),
    (
        "housner",
        {"geometry": "exact"},
        "1.0 1.0 1.844 0.9999546 0.3679 0.0 0.02209 1206 5.688 0.04979 1.0 0",
    ),
    (
        "energy_consistent",
        {"rest": "rigid"},
        "0.04376517940248614 0.01716059660104331 1.562461999959979 0.9999501219458382 0.005418604732803355 "
        "0.0038656854413839244 0.0011717046815951984 2477488454 3.373938625190504 0.04864114837323408 "
        "0.42989135267193446 1",
    ),
    (
        "housner",
        {"geometry": "bilinear"},
        "0.3304 0.3562 1.614 0.9998823 0.0004376 1.0 0.008066 3708527337 29.03 0.02686 1.096 1",
    ),
]


@pytest.fixture(scope="module", autouse=True)
def _compiled():
    """No limit on time counts compilation."""
    compile_engine()


class TestRanges:
    """delta 1e-6 … 0.5, e 0.01 … 1, R 1 cm … 100 m, alpha 0.01 … 1.2, dt 1e-5 … 0.05 s, levels to 1e6."""

    @pytest.mark.slow
    @pytest.mark.parametrize(("law", "options"), CASES, ids=label)
    @settings(max_examples=60, **REPEATABLE)
    @given(draw=draws())
    def test_anywhere(self, law, options, draw):
        """Random oscillators and records from the whole of the ranges have the reference's peak and verdict."""
        check(law, options, draw, record_of(law, draw, parts(law, options, draw)[1]))

    @pytest.mark.slow
    @pytest.mark.parametrize(("law", "options"), CASES, ids=label)
    @settings(max_examples=400, **REPEATABLE)
    @given(draw=draws())
    def test_anywhere_again(self, law, options, draw):
        """The same, seven times as many and ten times as long."""
        check(law, options, draw, record_of(law, draw, parts(law, options, draw)[1], 1e6, 20000), seconds=5.0)

    @pytest.mark.parametrize("number", range(len(FOUND)))
    def test_found_before(self, number):
        """Draws that were off once."""
        law, options, values = FOUND[number]
        draw = dict(zip(FOUND_KEYS, map(float, values.split()), strict=True))
        draw = given_draw(**draw, coefficient=0.0) | {"seed": int(draw["seed"])}
        check(law, options, draw, record_of(law, draw, parts(law, options, draw)[1], 1e6, 20000), seconds=5.0)

    @pytest.mark.parametrize(("law", "options"), CASES, ids=label)
    def test_corners(self, law, options):
        """Every corner of the ranges, under shaking at the threshold and a million times above it."""
        rng = np.random.default_rng(21)
        deltas = (0.5,) if law == "housner" else (1e-6, 0.5)
        for delta in deltas:
            for alpha, R, e, dt in np.stack(
                np.meshgrid((0.01, 1.2), (0.01, 100.0), (0.01, 1.0), (1e-5, 0.05)), axis=-1
            ).reshape(-1, 4):
                draw = given_draw(alpha=alpha, R=R, delta=delta, e=e, dt=dt, zeta=float(rng.choice([0.0, 1.0])))
                draw |= {"seed": int(rng.integers(1000)), "cycles": 20.0, "correlation": 0.3, "from_zero": True}
                for level in (1.0, 1e6):
                    oscillator = parts(law, options, draw)[1]
                    check(law, options, draw, record_of(law, {**draw, "level": level}, oscillator, 1e4, 1000))

    @pytest.mark.parametrize(("law", "options"), CASES, ids=label)
    def test_a_million_samples(self, law, options):
        """10 s at 1e-5 s: 10^6 small steps add up to no more than the bound, in a few seconds at most."""
        record = shake(np.random.default_rng(22), 1_000_001, 1e-5)
        draw = given_draw(dt=1e-5)
        run = check(law, options, draw, 1.6 * threshold(parts(law, options, draw)[1]) * record, seconds=5.0)
        assert run.results[UPLIFTED] == 1.0

    @pytest.mark.parametrize("skip", [True, False])
    @pytest.mark.parametrize("model", ELASTIC, ids=label)
    def test_small_factors_scale_an_elastic_block(self, model, skip):
        """Below uplift the peak is proportional to the factor, down to 1e-12 of the threshold, to rounding."""
        oscillator = model.oscillator(BLOCK)
        record = threshold(oscillator) * shake(np.random.default_rng(23))
        factors = np.array([1e-12, 1e-9, 1e-6, 1e-3])
        peaks = run_many([oscillator], factors[None], record, 0.01, skip)[0]
        assert not peaks[:, UPLIFTED].any()
        np.testing.assert_allclose(peaks[:, PEAK] / factors, peaks[-1, PEAK] / 1e-3, rtol=1e-14)
        assert 1e-4 * BLOCK.alpha < peaks[-1, PEAK] / 1e-3

    @pytest.mark.parametrize("skip", [True, False])
    @pytest.mark.parametrize("model", LAWS, ids=label)
    def test_denormals(self, model, skip):
        """Factors and accelerations whose products are denormal or nothing: no motion to speak of, none uplifted."""
        oscillator = model.oscillator(BLOCK)
        factors = np.array([5e-324, 1e-320, 2.3e-308, 1e-200, 1e-160])
        for scale in (1.0, 1e-160, 5e-324):
            record = scale * shake(np.random.default_rng(24), n=200)
            out = answer(run_many, [oscillator], factors[None], record, 0.01, skip)[0]
            assert np.isfinite(out[:, : IMPACTS + 1]).all()
            assert not out[:, [OVERTURNED, UPLIFTED, IMPACTS]].any()
            assert np.all((out[:, PEAK] >= 0.0) & (out[:, PEAK] <= factors))
            if model in RIGID:
                assert not out[:, PEAK].any()
        for theta, omega in ((5e-324, 0.0), (0.0, -5e-324), (1e-310, 1e-310)):
            run = answer(trace, oscillator, np.zeros(200), 0.01, theta, omega)
            assert run.results[PEAK] <= 1e-300

    @pytest.mark.parametrize("model", LAWS, ids=label)
    def test_all_zero_records(self, model):
        """A floor that does not move moves nothing, whatever the factor, the step and the length."""
        oscillator = model.oscillator(BLOCK)
        for n, dt in ((2, 1e-5), (3, 0.05), (1_000_000, 0.01)):
            for skip in (True, False):
                out = answer(run_many, [oscillator], np.array([[1e-12, 1.0, 1e6]]), np.zeros(n), dt, skip)[0]
                assert not out[:, : IMPACTS + 1].any()
        assert not trace(oscillator, np.zeros(500), 0.01).history[:2].any()

    @pytest.mark.parametrize(("law", "options"), CASES, ids=label)
    def test_constant_records(self, law, options):
        """A steady push: held below the threshold, tipped over above it, as the reference says."""
        draw = given_draw()
        _, oscillator, _ = parts(law, options, draw)
        for level in (0.01, 0.3, 0.6, 0.95, 1.05, 3.0, 100.0):
            for n in (2, 3, 30, 1000):
                run = check(law, options, draw, np.full(n, level * threshold(oscillator)))
                if (law, options) in RIGID_CASES:
                    assert (run.results[UPLIFTED] == 1.0) == (level > 1.0)


class TestThreshold:
    """Shaking exactly at the threshold, and within rounding of it."""

    SHAPES = {
        "constant": np.ones(200),
        "first sample only": np.r_[1.0, np.full(199, 0.5)],
        "step": np.r_[0.0, np.ones(199)],
        "ramp": np.r_[np.linspace(0.0, 1.0, 100), np.linspace(1.0, 0.0, 100)],
        "hold and drop": np.r_[np.linspace(0.0, 1.0, 20), np.ones(100), np.zeros(80)],
        "square": np.tile([1.0, 1.0, 1.0, -1.0, -1.0, -1.0], 30),
        "alternating": np.tile([1.0, -1.0], 90),
    }

    @pytest.mark.parametrize("shape", SHAPES)
    @pytest.mark.parametrize("model", RIGID, ids=label)
    def test_one_ulp(self, model, shape):
        """At the threshold and one ulp below a rigid block is at rest bit for bit; one ulp above, anything small."""
        oscillator = model.oscillator(BLOCK)
        # the largest acceleration whose forcing does not exceed the threshold
        at = threshold(oscillator)
        while oscillator.gain * at > lifts_at(oscillator):
            at = np.nextafter(at, 0.0)
        for dt in (1e-5, 0.01, 0.05):
            for sign in (1.0, -1.0):
                record = sign * self.SHAPES[shape]
                for still in (at, np.nextafter(at, 0.0)):
                    run = answer(trace, oscillator, record * still, dt)
                    assert not run.history[:2].any()
                    assert not run.results[: IMPACTS + 1].any()
                check_sane(answer(trace, oscillator, record * np.nextafter(at, math.inf), dt), BLOCK)

    @pytest.mark.parametrize("shape", SHAPES)
    @pytest.mark.parametrize(("law", "options"), CASES, ids=label)
    def test_near(self, law, options, shape):
        """Forcing from 1e-6 below to 1e-6 above the threshold: the reference's motion, or its twin's at rounding."""
        for e in (0.01, 0.9):
            for dt in (1e-5, 0.01, 0.05):
                draw = given_draw(e=e, dt=dt)
                _, oscillator, _ = parts(law, options, draw)
                for excess in (-1e-6, -1e-9, -1e-12, 1e-12, 1e-9, 1e-6):
                    check(law, options, draw, self.SHAPES[shape] * threshold(oscillator) * (1.0 + excess))

    @pytest.mark.parametrize("level", [1.01, 1.3, 4.0])
    @pytest.mark.parametrize(("law", "options"), CASES, ids=label)
    def test_record_that_begins_above_it(self, law, options, level):
        """A first sample above the threshold lifts the block even if the second one is below it."""
        for e, second in ((0.3, 0.0), (0.9, 0.8), (0.9, -0.9)):
            for sign in (1.0, -1.0):
                draw = given_draw(e=e)
                _, oscillator, _ = parts(law, options, draw)
                record = sign * threshold(oscillator) * np.r_[level, second, np.zeros(100)]
                run = check(law, options, draw, record)
                one = run_many([oscillator], np.ones((1, 1)), record, draw["dt"])[0, 0]
                assert one[OVERTURNED] == run.results[OVERTURNED]
                assert one[PEAK] == pytest.approx(run.results[PEAK], rel=1e-12)
                assert run.results[PEAK] > 0.0

    @pytest.mark.slow
    @pytest.mark.parametrize("e", [0.999, 0.999999, 1.0 - 1e-12, 1.0])
    @pytest.mark.parametrize("model", [tp.DiscreteDamping, tp.EnergyConsistent, tp.HousnerImpact])
    def test_bounces_without_loss_end(self, model, e):
        """e = 1 (to rounding) at the threshold (to rounding): bounces by the million are neither wanted nor a hang."""
        law = model(e=e) if model is tp.HousnerImpact else model(e=e, rest="rigid")
        oscillator = law.oscillator(BLOCK)
        for dt in (0.1, 0.05, 0.01):
            for excess in (1e-9, 1e-12, 1e-14):
                for values in self.SHAPES.values():
                    run = answer(trace, oscillator, values * threshold(oscillator) * (1.0 + excess), dt)
                    check_sane(run, BLOCK, e)


class TestGrazing:
    """Motion that just reaches the edge of the zone, or just does not."""

    @pytest.mark.parametrize("excess", [-1e-6, -1e-9, -1e-12, -1e-13, -1e-15, 0.0, 1e-15, 1e-13, 1e-12, 1e-9, 1e-6])
    @pytest.mark.parametrize("model", [tp.ViscousDamping(0.0), tp.DiscreteDamping(e=0.9)], ids=label)
    def test_from_inside(self, model, excess):
        """An undamped zone released with an amplitude of the edge's (1 + excess): uplift is decided at 1e-13."""
        oscillator = model.oscillator(BLOCK)
        zone = oscillator.regions[1]
        for phase in np.linspace(0.05, 1.5, 12):
            amplitude = zone.upper * (1.0 + excess)
            # energy beyond the edge: K edge d - q² d²/2 = K (amplitude² - edge²)/2, for its root d
            force, falls = zone.stiffness * zone.upper, -oscillator.regions[2].stiffness
            left = zone.stiffness * zone.upper**2 * excess * (1.0 + 0.5 * excess)
            beyond = zone.upper + 2.0 * left / (force + math.sqrt(force**2 - 2.0 * falls * left))
            theta, omega = amplitude * math.sin(phase), amplitude * math.cos(phase) * math.sqrt(zone.stiffness)
            for dt in (1e-3, 0.01, 0.05):
                run = answer(trace, oscillator, np.zeros(200), dt, theta, omega, max_turning_points=5000)
                check_sane(run, BLOCK)
                if abs(excess) >= 1e-13:
                    assert (run.results[UPLIFTED] == 1.0) == (excess > 0.0)
                if excess <= -1e-13 or model.law == "viscous":
                    # (within rounding of the edge a law that sets its damping there has no one answer)
                    peaks = np.abs(run.turning_points[1])
                    np.testing.assert_allclose(peaks, amplitude if excess < 0.0 else beyond, rtol=2e-14)

    @pytest.mark.parametrize("excess", [-1e-9, -1e-12, -1e-15, 0.0, 1e-15, 1e-12, 1e-9])
    @pytest.mark.parametrize(("law", "options"), CASES, ids=label)
    def test_forced(self, law, options, excess):
        """Released at the edge (1 + excess) under a push that all but balances there: it creeps in or out."""
        draw = given_draw(e=0.8, dt=0.02)
        block, oscillator, _ = parts(law, options, draw)
        edge = 0.05 * block.alpha
        balance = -(1.0 - 0.05) * threshold(oscillator)
        for push in (0.0, 0.5, 0.999, 1.001):
            for omega in (0.0, 1e-9, -1e-9):
                record = np.r_[np.full(40, push * balance), np.zeros(160)]
                check(law, options, draw, record, edge * (1.0 + excess), omega * block.p * block.alpha)

    @pytest.mark.parametrize(
        ("delta", "n"), [(0.001, 1), (0.001, 5), (0.05, 1), (0.05, 2), (0.05, 5), (0.2, 1), (0.2, 2)]
    )
    def test_peaks_at_the_edge(self, delta, n):
        """Energy-consistent free rocking has Housner's peaks though the nth one grazes the edge: 40 digits."""
        for excess in (-1e-3, -1e-9, -1e-12, 1e-12, 1e-9, 1e-3):
            x0 = forty_digits.released_at(delta * (1.0 + excess), 0.8, n)
            model = tp.EnergyConsistent(e=0.8, delta=delta)
            run = trace(model.oscillator(BLOCK), np.zeros(4000), 0.005, x0 * BLOCK.alpha, max_turning_points=100)
            peaks = np.abs(run.turning_points[1, :n]) / BLOCK.alpha
            # an error of the energy appears in the peak over 1 - x, and x itself comes from 1 - sqrt(1 - …)
            np.testing.assert_allclose(peaks, forty_digits.first_peaks(x0, 0.8, n), rtol=0.0, atol=1e-14)


class TestManyEventsInOneSample:
    @pytest.mark.parametrize(("law", "options"), CASES, ids=label)
    @settings(max_examples=40, **REPEATABLE)
    @given(draw=draws(), start=decades(1.2, 1000.0), many=st.floats(12.0, 60.0), push=st.floats(0.05, 0.5))
    def test_dozens_of_crossings(self, law, options, draw, start, many, push):
        """Low rocking under long samples: a dozen to sixty bounces of the first height in each, all followed."""
        draw |= {"e": 1.0 - 0.05 * (1.0 - draw["e"]) - 1e-3, "zeta": 0.01 * draw["zeta"], "coefficient": 0.001}
        draw["delta"] = min(draw["delta"], 0.01)
        block, oscillator, keywords = parts(law, options, draw)
        x0 = min(start * draw["delta"], 0.02)
        draw["dt"] = keywords["dt"] = many * 2.0 * math.sqrt(2.0 * x0) / block.p
        record = push * threshold(oscillator) * np.random.default_rng(draw["seed"]).uniform(-1.0, 1.0, 4)
        theta0 = x0 * block.alpha
        run = answer(trace, oscillator, record, draw["dt"], theta0, max_turning_points=EVENTS)
        check_sane(run, block)
        assert run.turning_points.shape[1] < EVENTS
        if rate_bound(law, {**draw, "e": 1.0}) == rate_bound(law, draw):  # no damping of the zone by its stiffness
            # (a rigid block comes to rest at once where all that follows would end within the sample)
            assert np.sum(run.turning_points[0] < 3.0 * draw["dt"]) >= 12 or run.history[2, 3] == REST
        truth = integrate(law, acceleration=record, theta0=theta0, **keywords)
        error = np.abs(run.history[0] - truth.theta).max() / theta0
        if error > 1e-9:
            twins = [
                integrate(law, acceleration=record * s, theta0=theta0 * s, **keywords)
                for s in (1.0 + 1e-13, 1.0 - 1e-13)
            ]
            change = max(np.abs(twin.theta - truth.theta).max() for twin in twins) / theta0
            assert error <= 100.0 * change, (error, change, draw, x0, record.tolist())

    def test_coming_to_rest_between_a_zone_and_a_branch(self):
        """A half cycle through the discrete zone loses less than an impact: rest comes later than impacts say."""
        draw = given_draw(
            alpha=0.023753466571291352,
            R=0.24434321024892935,
            e=0.9705862482159966,
            delta=8.462360905546882e-06,
            dt=0.3969576580008,
        )
        record = np.array([-0.013144670076208516, 0.08091514119038608, 0.08309227810169033, 0.06265180694755881])
        theta0 = 3.191351507669941e-05
        block, oscillator, keywords = parts("discrete", {"rest": "rigid"}, draw)
        run = answer(trace, oscillator, record, draw["dt"], theta0)
        truth = integrate("discrete", acceleration=record, theta0=theta0, **keywords)
        np.testing.assert_allclose(run.history[0], truth.theta, rtol=0.0, atol=1e-9 * theta0)
        np.testing.assert_allclose(run.history[1], truth.omega, rtol=0.0, atol=1e-9 * theta0 * block.p)

    @pytest.mark.parametrize("model", [tp.ViscousDamping(0.0, 1e-6), tp.DiscreteDamping(1.0, 1e-6)], ids=label)
    def test_as_many_as_there_are(self, model):
        """Undamped rocking at 10 delta alpha: a thousand bounces in one sample, each of the same height and length."""
        oscillator = model.oscillator(BLOCK)
        theta0 = 1e-5 * BLOCK.alpha
        fine = trace(oscillator, np.zeros(4001), 1e-5, theta0, max_turning_points=100)
        period = 2.0 * fine.turning_points[0, 1] - 2.0 * fine.turning_points[0, 0]
        run = answer(trace, oscillator, np.zeros(3), 500.0 * period, theta0, max_turning_points=5000)
        times, peaks = run.turning_points
        np.testing.assert_allclose(np.abs(peaks[:1990]), theta0, rtol=1e-10)
        np.testing.assert_allclose(times[:1990], 0.5 * period * np.arange(1, 1991), rtol=1e-10)


class TestZone:
    """The zone as a linear oscillator, against 40 digits."""

    @pytest.mark.parametrize("delta", [1e-4, 0.05, 0.5])
    @pytest.mark.parametrize("off", [0.0, 2.2e-16, -1.1e-16, 1e-9, -1e-9, 1e-5, -1e-5, 0.5, 4.0])
    def test_critical_damping(self, off, delta):
        """K = c²/4 and its surroundings: nothing is divided by their difference."""
        oscillator = tp.ViscousDamping(1.0 + off, delta).oscillator(BLOCK)
        zone = oscillator.regions[1]
        for step in (1e-3, 0.05, 0.3, 3.0):
            dt = step / math.sqrt(zone.stiffness)
            record = 0.1 * threshold(oscillator) * noise(np.random.default_rng(31), 400, dt, 3.0 * dt)
            run = trace(oscillator, record, dt)
            assert run.results[UPLIFTED] == 0.0
            exact = forty_digits.history(zone.stiffness, zone.damping, -oscillator.gain * record, dt)
            scale = np.abs(exact).max(axis=1, keepdims=True)
            np.testing.assert_allclose(run.history[:2] / scale, exact / scale, rtol=0.0, atol=1e-14)

    @pytest.mark.parametrize("rest", ["elastic", "rigid"])
    @pytest.mark.parametrize("law", ["discrete", "energy_consistent"])
    def test_critical_damping_held(self, law, rest):
        """Entries fast enough that the held damping is critical, and around it."""
        draw = given_draw(e=0.3, delta=0.02, dt=0.002)
        _, oscillator, _ = parts(law, {"rest": rest}, draw)
        zone = oscillator.regions[1]
        critical = 2.0 * math.sqrt(zone.stiffness) * 2.0 * zone.upper / (1.0 - 0.3)
        for factor in (0.5, 0.99, 1.0 - 1e-9, 1.0, 1.0 + 1e-9, 1.01, 2.0, 10.0):
            start = zone.upper * (1.0 + 1e-9)
            record = 0.3 * threshold(oscillator) * np.random.default_rng(32).standard_normal(500)
            check(law, {"rest": rest}, draw, record, start, -factor * critical)

    @pytest.mark.parametrize("zeta", [0.0, 1e-3, 0.02, 1.0])
    @pytest.mark.parametrize("per_cycle", [8, 20, 50])
    def test_resonance(self, zeta, per_cycle):
        """10^4 cycles at the zone's own frequency: the growing amplitude and the phase keep eleven digits."""
        oscillator = tp.ViscousDamping(zeta, 0.05).oscillator(BLOCK)
        zone = oscillator.regions[1]
        dt = 2.0 * math.pi / math.sqrt(zone.stiffness) / per_cycle
        samples = 10_000 * per_cycle
        amplitude = 1e-5 * lifts_at(oscillator)
        phase = 2.0 * math.pi / per_cycle * (np.arange(samples + 1) % per_cycle)
        run = answer(trace, oscillator, -amplitude / oscillator.gain * np.sin(phase), dt)
        assert run.results[UPLIFTED] == 0.0
        at = [1, 2, per_cycle, samples // 100, samples // 7, samples // 2, samples - 3, samples]
        exact = forty_digits.driven(zone.stiffness, zone.damping, amplitude, per_cycle, dt, at)
        scale = np.abs(exact).max(axis=1, keepdims=True)
        bound = 1e-11 if zeta == 0.0 else 2e-12
        np.testing.assert_allclose(run.history[:2, at] / scale, exact / scale, rtol=0.0, atol=bound)

    @pytest.mark.slow
    @pytest.mark.parametrize(("law", "options"), ELASTIC_CASES, ids=label)
    def test_resonance_beyond_the_edge(self, law, options):
        """10^4 cycles at the zone's frequency, strong enough to uplift within the first hundred."""
        draw = given_draw(dt=0.004, zeta=0.01)
        _, oscillator, _ = parts(law, options, draw)
        frequency = math.sqrt(oscillator.regions[1].stiffness)
        n = int(1e4 * 2.0 * math.pi / frequency / 0.004)
        record = 0.08 * threshold(oscillator) * np.sin(frequency * 0.004 * np.arange(n))
        if law in ("giannini_masiani", "makris_konstantinidis", "vassiliou"):
            record *= 4.0
        run = check(law, options, draw, record)
        assert run.results[UPLIFTED] == 1.0
        assert run.results[IMPACTS] > 20.0


class TestCancellation:
    """K dt² of 1e-9 and less: forcing coefficients by closed forms would keep a few digits."""

    @pytest.mark.parametrize("dt", [1e-4, 1e-5])
    @pytest.mark.parametrize("model", [*ELASTIC, *RIGID[:4], tp.ViscousDamping(0.0), tp.ViscousDamping(1.0)], ids=label)
    def test_falling_branch(self, model, dt):
        """R = 100 m from 0.5 alpha, 4000 samples: rotation and velocity to 13 digits, each sample by itself."""
        block = tp.Block.from_slenderness(0.2, 100.0)
        oscillator = model.oscillator(block)
        branch = max(oscillator.regions, key=lambda region: region.upper)
        record = 0.006 * threshold(oscillator) * np.cumsum(np.random.default_rng(41).standard_normal(4000))
        run = trace(oscillator, record, dt, 0.5 * block.alpha)
        assert set(run.history[2]) == {float(oscillator.regions.index(branch))}
        push = branch.offset - oscillator.gain * record
        exact = forty_digits.history(branch.stiffness, branch.damping, push, dt, 0.5 * block.alpha)
        np.testing.assert_allclose(run.history[0], exact[0], rtol=1e-13)
        np.testing.assert_allclose(run.history[1], exact[1], rtol=1e-13)

    @pytest.mark.parametrize("dt", [1e-4, 1e-5])
    @pytest.mark.parametrize("model", [*ELASTIC, tp.ViscousDamping(0.0), tp.ViscousDamping(1.0)], ids=label)
    def test_zone(self, model, dt):
        """From rest, 4000 samples: to 13 digits of the largest, and of each of the first thirty by itself."""
        block = tp.Block.from_slenderness(0.2, 100.0)
        oscillator = model.oscillator(block)
        zone = oscillator.regions[oscillator.start]
        # of one sign at first, so that nothing vanishes by accident
        record = 1e-4 * threshold(oscillator) * (5.0 + np.cumsum(np.random.default_rng(42).standard_normal(4000)))
        run = trace(oscillator, record, dt)
        assert run.results[UPLIFTED] == 0.0
        damping = 0.0 if zone.held else zone.damping
        exact = forty_digits.history(zone.stiffness, damping, -oscillator.gain * record, dt)
        np.testing.assert_allclose(run.history[:2, 1:31], exact[:, 1:31], rtol=1e-13)
        scale = np.abs(exact).max(axis=1, keepdims=True)
        np.testing.assert_allclose(run.history[:2] / scale, exact / scale, rtol=0.0, atol=1e-13)
