"""The engine at the ends of its ranges, through the plain interface of `toppling.models.runs` only.

What is held, for every law: a finite answer in bounded time with boundedly many events; the reference's answer
(tests/reference.py, 8th-order integration, or 40 digits, tests/forty_digits.py) to max(1e-9, 100 x the change of a twin
whose motion is perturbed by 1e-13); rest that is rest; energy that never grows; and results that depend neither on
`skip` nor on the company of other runs.
"""

import ast
import json
import math
import os
import subprocess
import sys
import threading
import time
from pathlib import Path

import forty_digits
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from reference import integrate
from shared_cases import ELASTIC, LAWS, RIGID, shake
from test_reference import CASES, build

import toppling as tp
from toppling.models._piecewise import REST
from toppling.models.runs import OUTPUTS, TALLY, prepare, run_many, trace
from toppling.motions import OneCycleSine
from toppling.units import STANDARD_GRAVITY as G

BLOCK = tp.Block.from_slenderness(0.2, 0.5)
OVERTURNED, PEAK, UPLIFTED, IMPACTS = (OUTPUTS[k] for k in ("overturned", "peak_rotation", "uplifted", "impacts"))
RIGID_CASES = [c for c in CASES if c[0] == "housner" or c[1].get("rest") == "rigid"]
ELASTIC_CASES = [c for c in CASES if c not in RIGID_CASES]

# The same examples in every run, and no time of their own: `answer` limits the engine's.
REPEATABLE = {"derandomize": True, "deadline": None, "database": None, "suppress_health_check": list(HealthCheck)}
SECONDS = 1.0  # of processor time, for a run of some thousand samples
HANGS = 30.0  # s after which a run is given up
EVENTS = 10_000  # in one sample, at most


def label(value):
    return value.label if hasattr(value, "label") else value if isinstance(value, str) else "-".join(value.values())


@pytest.fixture(scope="module", autouse=True)
def _compiled():
    """No limit on time counts compilation."""
    prepare([tp.HousnerImpact().oscillator(BLOCK)])
    trace(tp.HousnerImpact().oscillator(BLOCK), np.zeros(2), 0.01)


def answer(call, *arguments, seconds=SECONDS, **keywords):
    """call(...) within a limit on processor time; the engine holds no lock, so a hang fails the test and no more."""
    found = {}

    def work():
        start = time.thread_time()
        found["value"] = call(*arguments, **keywords)
        found["seconds"] = time.thread_time() - start

    thread = threading.Thread(target=work, daemon=True)
    thread.start()
    thread.join(max(HANGS, 3.0 * seconds))
    assert "value" in found, "no answer: it hangs, or raised in its thread"
    assert found["seconds"] <= seconds, f"{found['seconds']:.2f} s of processor time, the limit is {seconds:g} s"
    return found["value"]


def parts(law, options, draw):
    """The block, the oscillator and the reference's arguments of one draw (see `draws`)."""
    block = tp.Block.from_slenderness(draw["alpha"], draw["R"], draw["inertia_factor"])
    model, keywords = build(law, options, draw)
    return block, model.oscillator(block), {**keywords, "alpha": block.alpha, "R": block.R}


def given_draw(**values):
    """A draw with the values that do not matter filled in."""
    fixed = {"inertia_factor": 4.0 / 3.0, "e": 0.9, "delta": 0.05, "coefficient": 0.02, "zeta": 0.05, "lever": "h"}
    return {**fixed, "alpha": 0.2, "R": 0.5, "dt": 0.01, **values}


def threshold(oscillator):
    """Floor acceleration that a rigid block just withstands, m/s²."""
    return oscillator.uplift_right / oscillator.gain


def check_sane(run, block):
    """Finite, inside the flat positions, the peak no less than any sample and pi/2 if overturned, few events."""
    results, history = run.results, run.history
    assert np.isfinite(results[: IMPACTS + 1]).all()
    assert np.isfinite(history).all()
    assert np.abs(history[0]).max(initial=0.0) <= results[PEAK] <= 0.5 * math.pi
    assert (results[OVERTURNED] == 1.0) == (results[PEAK] == 0.5 * math.pi)
    assert results[IMPACTS] <= EVENTS * history.shape[1]


def check(law, options, draw, record, theta0=0.0, omega0=0.0, seconds=SECONDS, bound=1e-9):
    """One run is sane and has the reference's verdict and peak; returns it."""
    block, oscillator, keywords = parts(law, options, draw)
    start = {"theta0": theta0, "omega0": omega0}
    run = answer(trace, oscillator, record, draw["dt"], **start, seconds=seconds)
    check_sane(run, block)
    truth = integrate(law, acceleration=record, **start, **keywords)
    scale = max(truth.peak, 1e-300)
    error = abs(run.results[PEAK] - truth.peak) / scale
    same = (run.results[OVERTURNED] == 1.0) == truth.overturned
    if error > bound or not same:
        twins = [
            integrate(law, acceleration=record * s, theta0=theta0 * s, omega0=omega0 * s, **keywords)
            for s in (1.0 + 1e-13, 1.0 - 1e-13)
        ]
        change = max(abs(twin.peak - truth.peak) for twin in twins) / scale
        assert error <= max(bound, 100.0 * change), (error, change, draw)
        assert same or any(twin.overturned != truth.overturned for twin in twins), draw
    return run


def rate_bound(law, draw):
    """The fastest exponent of the oscillator, 1/s."""
    p = math.sqrt(G / (draw["inertia_factor"] * draw["R"]))
    e = draw["e"]
    zeta = {
        "giannini_masiani": 2.0 / math.pi * (1.0 - e) / (1.0 + e),
        "makris_konstantinidis": -0.68 * math.log(e),
        "viscous": draw["zeta"],
    }.get(law, 0.0)
    return p if law == "housner" else p * math.sqrt(1.0 / draw["delta"]) * max(1.0, 2.0 * zeta)


def noise(rng, n, dt, correlation):
    """A rough piecewise-linear record (n,) of unit variance with knots `correlation` (s) apart, or at the samples."""
    apart = max(correlation, dt)
    knots = rng.standard_normal(int(n * dt / apart) + 4)
    return np.interp(np.arange(n) * dt / apart + rng.uniform(), np.arange(knots.size), knots)


def decades(low, high):
    return st.floats(math.log(low), math.log(high)).map(lambda x: min(max(math.exp(x), low), high))


@st.composite
def draws(draw):
    """A block, its law's options and a record's shape, from the whole of the ranges: ends included."""
    nearly_one = decades(1e-6, 0.99).map(lambda x: 1.0 - x)
    return {
        "alpha": draw(decades(0.01, 1.2)),
        "R": draw(decades(0.01, 100.0)),
        "inertia_factor": draw(st.floats(1.05, 2.0)),
        "e": draw(st.one_of(nearly_one, decades(0.01, 1.0))),
        "delta": draw(decades(1e-6, 0.5)),
        "coefficient": draw(st.floats(0.0, 0.05)),
        "zeta": draw(st.one_of(st.sampled_from([0.0, 1.0]), decades(1e-3, 3.0))),
        "lever": draw(st.sampled_from(["h", "R"])),
        "dt": draw(decades(1e-5, 0.05)),
        "seed": draw(st.integers(0, 2**32 - 1)),
        "cycles": draw(st.floats(2.0, 30.0)),
        "correlation": draw(decades(0.02, 2.0)),
        "level": draw(st.one_of(decades(0.7, 5.0), decades(0.1, 1e6))),
        "from_zero": draw(st.booleans()),
    }


def record_of(law, draw, oscillator, steps=1e5, samples=3000):
    """The record of a draw: as long as its cycles, but no more than the reference can follow in a second."""
    rng = np.random.default_rng(draw["seed"])
    p = math.sqrt(G / (draw["inertia_factor"] * draw["R"]))
    duration = min(draw["cycles"] / p, 0.1 * steps / rate_bound(law, draw))
    n = int(min(max(duration / draw["dt"], 2.0), samples)) + 2
    record = noise(rng, n, draw["dt"], draw["correlation"] / p) * threshold(oscillator) * draw["level"]
    if draw["from_zero"]:
        record[0] = 0.0
    return record


class TestRanges:
    """delta 1e-6 … 0.5, e 0.01 … 1, R 1 cm … 100 m, alpha 0.01 … 1.2, dt 1e-5 … 0.05 s, levels to 1e6."""

    @pytest.mark.parametrize(("law", "options"), CASES, ids=label)
    @settings(max_examples=60, **REPEATABLE)
    @given(draw=draws())
    def test_anywhere(self, law, options, draw):
        """Random oscillators and records from the whole of the ranges have the reference's peak and verdict."""
        check(law, options, draw, record_of(law, draw, parts(law, options, draw)[1]))

    @pytest.mark.slow
    @pytest.mark.parametrize(("law", "options"), CASES, ids=label)
    @settings(max_examples=1500, **REPEATABLE)
    @given(draw=draws())
    def test_anywhere_again(self, law, options, draw):
        """The same, twenty-five times as many and ten times as long."""
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
        while oscillator.gain * at > oscillator.uplift_right:
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
                    check_sane(run, BLOCK)


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
        amplitude = 1e-5 * oscillator.uplift_right
        phase = 2.0 * math.pi / per_cycle * (np.arange(samples + 1) % per_cycle)
        run = answer(trace, oscillator, -amplitude / oscillator.gain * np.sin(phase), dt)
        assert run.results[UPLIFTED] == 0.0
        at = [1, 2, per_cycle, samples // 100, samples // 7, samples // 2, samples - 3, samples]
        exact = forty_digits.driven(zone.stiffness, zone.damping, amplitude, per_cycle, dt, at)
        scale = np.abs(exact).max(axis=1, keepdims=True)
        bound = 1e-11 if zeta == 0.0 else 2e-12
        np.testing.assert_allclose(run.history[:2, at] / scale, exact / scale, rtol=0.0, atol=bound)

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


def energies(block, oscillator, theta, omega):
    """Energy per unit inertia on the rigid branches: 0 at rest.  From the physics, not from the table's potentials."""
    x = np.abs(theta)
    branch = -max(oscillator.regions, key=lambda region: region.upper).stiffness
    if oscillator.exact:
        # cos(alpha - x) - cos(alpha) without its cancellation
        return 0.5 * omega**2 + 2.0 * branch * np.sin(block.alpha - 0.5 * x) * np.sin(0.5 * x)
    return 0.5 * omega**2 + branch * x * (block.alpha - 0.5 * x)


class TestFreeMotion:
    @pytest.mark.parametrize(("law", "options"), CASES, ids=label)
    @settings(max_examples=40, **REPEATABLE)
    @given(draw=draws(), x0=st.floats(0.01, 0.999), v0=st.floats(-1.0, 1.0), step=decades(1e-3, 1.0))
    def test_energy_never_grows(self, law, options, draw, x0, v0, step):
        """From sample to sample of free rocking, and from one turning point to the next, over all impacts."""
        block, oscillator, _ = parts(law, options, draw)
        alpha = block.alpha
        n = 2000 if rate_bound(law, draw) * step / block.p < 100.0 else 50
        start = x0 * alpha, 0.3 * v0 * (1.0 - x0) * block.p * alpha
        run = answer(trace, oscillator, np.zeros(n), step / block.p, *start, max_turning_points=20000)
        check_sane(run, block)
        theta, omega, region = run.history[:3]
        energy = energies(block, oscillator, theta, omega)
        for index, part in enumerate(oscillator.regions):
            if part.stiffness > 0.0:  # the zone: stiffness x²/2, joined to the branch at the edge
                here = region == index
                edge = part.upper
                joined = -0.5 * part.stiffness * edge**2 + energies(block, oscillator, edge, 0.0)
                energy[here] = 0.5 * omega[here] ** 2 + 0.5 * part.stiffness * theta[here] ** 2 + joined
        if run.results[OVERTURNED] == 1.0:
            energy = energy[np.abs(theta) < 0.5 * math.pi]
        lowest = np.minimum.accumulate(energy)
        assert np.all(energy - lowest <= 5e-14 * energy[0])
        turns = np.abs(run.turning_points[1])
        if "rest" not in options or options["rest"] == "elastic":
            outside = energies(block, oscillator, turns[turns < alpha], 0.0)
            assert np.all(np.diff(outside) <= 5e-14 * energy[0])

    @pytest.mark.parametrize("e", [0.01, 0.5, 0.9, 0.99, 0.999])
    @pytest.mark.parametrize("model", RIGID, ids=label)
    def test_rest_is_rest(self, model, e):
        """After the last impact theta and omega are 0 bit for bit, under any shaking below the threshold."""
        law = type(model)(**{**model.options, "e": e})
        for R, dt in ((0.02, 0.002), (0.5, 0.01), (100.0, 0.05)):
            block = tp.Block.from_slenderness(0.2, R)
            oscillator = law.oscillator(block)
            limit = threshold(oscillator)
            rng = np.random.default_rng(51)
            pulse = OneCycleSine(1.2 * limit, 6.0 * block.p, dt=dt).sample(1).values[0]
            # velocity e^n v comes to nothing in 2 v/((1 - e) a): long enough for the slowest
            level = min(0.3, 10.0 * (1.0 - e))  # hardly any loss: more would drive it over
            fading = np.maximum(np.linspace(level, -level, int(60.0 / ((1.0 - e) * block.p * dt)) + 100), 0.0)
            quiet = limit * fading * rng.uniform(-1.0, 1.0, fading.size)
            near = limit * (1.0 - 1e-12) * rng.choice([-1.0, 1.0, 0.999], 500)
            again = limit * 1.5 * rng.uniform(-1.0, 1.0, 100)
            record = np.concatenate([pulse, quiet, near, again])
            run = answer(trace, oscillator, record, dt, seconds=5.0)
            check_sane(run, block)
            assert run.results[UPLIFTED] == 1.0
            still = (run.history[2] == -1.0) & (np.abs(run.history[0]) < 0.5 * math.pi)
            assert not run.history[:2, still].any()
            # at rest it stays, until the shaking of that sample exceeds the threshold
            leaves = np.flatnonzero(still[:-1] & ~still[1:])
            exceeded = np.maximum(np.abs(record[leaves]), np.abs(record[leaves + 1])) > limit * (1.0 - 1e-15)
            assert exceeded.all()
            end = pulse.size + quiet.size
            assert still[end - 1 : end + near.size].all()
            before = trace(oscillator, record[:end], dt).results
            after = trace(oscillator, record[: end + near.size], dt).results
            np.testing.assert_array_equal(before, after)
            assert run.history[0, end + near.size :].any()

    @pytest.mark.parametrize("model", RIGID, ids=label)
    def test_no_chatter(self, model):
        """Impacts die out under a steady push, and shaking just below the threshold then starts none."""
        # (nearer 1 a zone's captures, which jump to a branch, feed a bounce under a push: so the model is defined)
        for e in (0.3, 0.9, 0.99) if model.law == "housner" else (0.3, 0.9):
            law = type(model)(**{**model.options, "e": e})
            oscillator = law.oscillator(BLOCK)
            limit = threshold(oscillator)
            start = np.r_[0.0, 1.4 * limit * np.ones(12), 0.0, np.full(4000, 0.5 * limit)]
            record = np.r_[start, (1.0 - 1e-12) * limit * np.sin(0.3 * np.arange(20000))]
            counts = [trace(oscillator, values, 0.01).results for values in (start, record)]
            assert counts[0][OVERTURNED] == 0.0
            assert counts[0][IMPACTS] == counts[1][IMPACTS] > 0.0
            assert counts[0][PEAK] == counts[1][PEAK]


def random_models(rng):
    """A block and one law of each kind, with options of their own."""
    block = tp.Block.from_slenderness(rng.uniform(0.05, 0.6), float(np.exp(rng.uniform(-2.5, 2.5))))
    models = []
    for model in LAWS:
        options = dict(model.options)
        if options.get("e") is not None:
            options["e"] = float(rng.choice([rng.uniform(0.3, 0.99), 1.0], p=[0.95, 0.05]))
        if "delta" in options:
            options["delta"] = float(np.exp(rng.uniform(math.log(0.002), math.log(0.3))))
        if "zeta" in options:
            options["zeta"] = rng.uniform(0.0, 1.2)
        models.append(type(model)(**options))
    return block, models


def test_skipping_changes_nothing_in_100_000_runs():
    """skip=True: equal flags, peaks within max(1e-12, 100 x the change of a twin perturbed by 1e-13).

    Where nothing but the overturned flag is asked for, runs that cannot fall any more are ended: the same flags.
    """
    rng = np.random.default_rng(61)
    runs = falls = 0
    tally = np.zeros(len(TALLY), np.int64)
    for _ in range(100):
        block, models = random_models(rng)
        oscillators = [model.oscillator(block) for model in models]
        dt = float(rng.choice([0.002, 0.005, 0.01, 0.02]))
        n = int(rng.integers(100, 600))
        record = noise(rng, n, dt, float(np.exp(rng.uniform(-3.0, 0.0))) / block.p) * G * math.tan(block.alpha)
        record *= np.sin(np.linspace(0.0, math.pi, n))
        factors = np.exp(rng.uniform(math.log(0.05), math.log(5.0), (len(models), 91)))
        one = run_many(oscillators, factors, record, dt, True)
        other = run_many(oscillators, factors, record, dt, False)
        flags = [OVERTURNED, UPLIFTED, IMPACTS]
        np.testing.assert_array_equal(one[..., flags], other[..., flags])
        short = run_many(oscillators, factors, record, dt, True, True, tally)
        np.testing.assert_array_equal(short[..., OVERTURNED], other[..., OVERTURNED])
        error = np.abs(one[..., PEAK] - other[..., PEAK])
        if np.any(error > 1e-12 * other[..., PEAK]):
            change = np.zeros_like(error)
            for s in (1.0 + 1e-13, 1.0 - 1e-13):
                twin = run_many(oscillators, factors * s, record, dt, False)
                change = np.maximum(change, np.abs(twin[..., PEAK] - other[..., PEAK]))
            worst = np.unravel_index(np.argmax(error - 100.0 * change), error.shape)
            assert np.all(error <= np.maximum(1e-12 * other[..., PEAK], 100.0 * change)), (
                models[worst[0]].label,
                block,
                dt,
                worst,
            )
        runs += error.size
        falls += int(one[..., OVERTURNED].sum())
    assert runs >= 100_000
    assert 0.1 < falls / runs < 0.9
    counts = dict(zip(TALLY, tally.tolist(), strict=True))
    for reason in ("before_uplift", "after_overturning", "cannot_overturn"):
        assert 0.01 < counts[reason] / counts["samples"] < 0.9  # each kind of skip is at work


LANE_COUNTS = (1, 2, 7, 8, 9, 15, 16, 17, 31, 32, 33, 63, 64, 65, 255, 256, 257)


class TestBatches:
    """A run's bits are its own, whatever else is computed beside it."""

    @pytest.mark.parametrize("skip", [True, False])
    def test_one_oscillator(self, skip):
        """Many factors of one oscillator, in any order and number, against each alone."""
        rng = np.random.default_rng(71)
        record = shake(rng, n=400)
        factors = rng.permutation(np.geomspace(0.3, 60.0, max(LANE_COUNTS)))
        for model in LAWS:
            oscillators = [model.oscillator(BLOCK)]
            alone = np.array([run_many(oscillators, f.reshape(1, 1), record, 0.01, skip)[0, 0] for f in factors])
            assert 0.0 < alone[:, OVERTURNED].mean() < 1.0
            for count in LANE_COUNTS:
                order = rng.permutation(factors.size)[:count]
                together = run_many(oscillators, factors[order][None], record, 0.01, skip)[0]
                np.testing.assert_array_equal(together, alone[order])

    @pytest.mark.parametrize("skip", [True, False])
    def test_mixed_oscillators(self, skip):
        """Laws, sizes and widths of zone side by side: tables of different lengths too."""
        rng = np.random.default_rng(72)
        record = 2.0 * shake(rng, n=400)
        mixed = []
        while len(mixed) < max(LANE_COUNTS):
            block, models = random_models(rng)
            mixed += [(model.oscillator(block), rng.uniform(0.3, 6.0)) for model in models]
        alone = np.array([run_many([o], np.full((1, 1), f), record, 0.01, skip)[0, 0] for o, f in mixed])
        for count in LANE_COUNTS:
            order = rng.permutation(max(LANE_COUNTS))[:count]
            factors = np.array([[mixed[j][1]] for j in order])
            together = run_many([mixed[j][0] for j in order], factors, record, 0.01, skip)[:, 0]
            np.testing.assert_array_equal(together, alone[order])

    @pytest.mark.parametrize("model", LAWS, ids=label)
    def test_a_history_is_the_same_run(self, model):
        """`trace` stores what `run_many` without skipping computes, bit for bit, but for what it finds on the way."""
        oscillator = model.oscillator(BLOCK)
        for level in (1.0, 2.0, 4.0):
            record = level * shake(np.random.default_rng(73), n=600)
            run = trace(oscillator, record, 0.01)
            many = run_many([oscillator], np.ones((1, 33)), record, 0.01, False)[0]
            np.testing.assert_array_equal(many, np.broadcast_to(run.results, many.shape))


class TestStiffness:
    """Ordinary lengths of record where the zone is as stiff as allowed: a few seconds at most, whatever the law."""

    @pytest.mark.parametrize("alpha", [0.01, 0.2, 1.2])
    @pytest.mark.parametrize(
        "model",
        [
            tp.DiscreteDamping(0.01, 1e-6),
            tp.DiscreteDamping(0.9, 1e-6),
            tp.GianniniMasiani(0.01, 1e-6),
            tp.MakrisKonstantinidis(0.01, 1e-6),
            tp.Vassiliou(1e-6),
            tp.ViscousDamping(1.0, 1e-6),
            tp.ViscousDamping(3.0, 1e-6),
            tp.EnergyConsistent(0.01, 1e-6, rest="elastic"),
            tp.EnergyConsistent(0.01, 1e-6),
        ],
        ids=label,
    )
    def test_a_centimetre(self, model, alpha):
        """R = 1 cm, delta = 1e-6, 20 s of shaking at 0.05 s."""
        oscillator = model.oscillator(block := tp.Block.from_slenderness(alpha, 0.01))
        record = threshold(oscillator) * shake(np.random.default_rng(81), 401, 0.05)
        for level in (1e-3, 0.9, 2.0):
            check_sane(answer(trace, oscillator, level * record, 0.05, seconds=15.0), block)


PLAIN = """
import ast, json, sys, time
sys.path.insert(0, {tests!r})
ENGINE = {engine!r}
called = set()

def note(frame, event, argument):
    if event == "call" and frame.f_code.co_filename == ENGINE:
        called.add(frame.f_code.co_name)

from test_stress import plain_selection
sys.setprofile(note)
runs = plain_selection()
sys.setprofile(None)
print(json.dumps([runs, sorted(called)]))
"""


def plain_selection():
    """Results of runs that between them need the whole engine, small enough for plain Python; NaN as None."""
    rng = np.random.default_rng(91)
    found = []
    for model in LAWS:
        stiff = {"delta": 0.003} if "delta" in model.options else {}
        squat = tp.Block.from_slenderness(0.4, 2.0)
        for block, options, level, dt in ((BLOCK, {}, 2.5, 0.01), (squat, stiff, 8.0, 0.02)):
            oscillator = type(model)(**{**model.options, **options}).oscillator(block)
            record = level * shake(rng, n=150, dt=dt)
            found.append(trace(oscillator, record, dt, max_turning_points=50).results)
            factors = np.array([[0.1, 0.9, 3.0]])
            found += list(run_many([oscillator], factors, record, dt)[0])
            flags = run_many([oscillator], np.append(factors, [[1e-3]], axis=1), record, dt, flags_only=True)[0, :, :1]
            found += list(np.hstack([flags, np.zeros((4, 4))]))
        found.append(trace(oscillator, np.zeros(20), 0.02, 0.6 * block.alpha, 0.1).results)
        found.append(trace(oscillator, np.r_[0.0, 60.0, 60.0, 60.0, np.zeros(60)], 0.05).results)
    # an overdamped crossing, and one near critical damping
    for e, speed in ((0.1, 30.0), (0.3, 3.2), (0.999, 0.5)):
        oscillator = tp.EnergyConsistent(e=e).oscillator(BLOCK)
        found.append(trace(oscillator, np.zeros(8), 0.02, 0.06 * BLOCK.alpha, -speed * BLOCK.alpha * BLOCK.p).results)
    return [[None if math.isnan(v) else float(v) for v in row] for row in found]


def test_plain_python():
    """NUMBA_DISABLE_JIT=1: the same flags and peaks for every law, and no function of the engine left unused."""
    from toppling.models import _piecewise

    engine = Path(_piecewise.__file__)
    code = PLAIN.format(tests=str(Path(__file__).parent), engine=str(engine))
    done = subprocess.run(
        [sys.executable, "-c", code],
        env={**os.environ, "NUMBA_DISABLE_JIT": "1"},
        capture_output=True,
        text=True,
        timeout=120.0,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    plain, called = json.loads(done.stdout)
    compiled = plain_selection()
    for one, other in zip(plain, compiled, strict=True):
        assert (one[OVERTURNED], one[UPLIFTED], one[IMPACTS]) == (other[OVERTURNED], other[UPLIFTED], other[IMPACTS])
        assert one[PEAK] == pytest.approx(other[PEAK], rel=1e-10)
    tree = ast.parse(engine.read_text(encoding="utf-8"))
    functions = {node.name for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)}
    assert functions - set(called) == set()
