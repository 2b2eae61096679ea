"""What holds for every run of the engine: energy never grows, rest is rest, and company and skipping change nothing.

Limits and draws as in test_stress.py.
"""

import math

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from reference_cases import CASES
from repeatable import REPEATABLE
from shared_cases import LAWS, RIGID, shake
from stress_cases import (
    BLOCK,
    IMPACTS,
    OVERTURNED,
    PEAK,
    UPLIFTED,
    answer,
    check_sane,
    compile_engine,
    decades,
    draws,
    given_draw,
    label,
    noise,
    parts,
    rate_bound,
    threshold,
)

import toppling as tp
from toppling.core.units import STANDARD_GRAVITY as G
from toppling.models.runs import TALLY, run_many, trace
from toppling.motions import KanaiTajimi, OneCycleSine


@pytest.fixture(scope="module", autouse=True)
def _compiled():
    """No limit on time counts compilation."""
    compile_engine()


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
        turns = np.abs(run.turning_points[1])
        # steps leave little; a half cycle of a lossless orbit, with its events, rounds the same way again and again
        drift = 2e-14 + 1.5e-16 * turns.size
        if energy[-1] < 0.999 * energy[0]:
            drift = min(drift, 5e-14)
        assert np.all(energy - lowest <= drift * energy[0])
        if "rest" not in options or options["rest"] == "elastic":
            outside = energies(block, oscillator, turns[turns < alpha], 0.0)
            assert np.all(np.diff(outside) <= 5e-14 * energy[0])

    def test_what_decays_comes_to_nothing(self):
        """A damped zone without shaking ends at zero, not among subnormal numbers, which decay no further."""
        draw = given_draw(alpha=1.0, R=1.0, e=0.6, delta=1e-4)
        block, oscillator, _ = parts("makris_konstantinidis", {}, draw)
        run = answer(trace, oscillator, np.zeros(2000), 1.0 / block.p, 0.5 * block.alpha, 0.0)
        assert np.abs(run.history[0, 100:]).max() == np.abs(run.history[1, 100:]).max() == 0.0

    @pytest.mark.parametrize("e", [0.01, 0.5, 0.9, 0.99, pytest.param(0.999, marks=pytest.mark.slow)])
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


@pytest.mark.slow
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

    @pytest.mark.slow
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

    @pytest.mark.slow
    @pytest.mark.parametrize("alpha", [0.01, 0.2, 1.2])
    @pytest.mark.parametrize(
        "model",
        [
            tp.DiscreteDamping(0.01, 1e-6),
            tp.DiscreteDamping(0.9, 1e-6),
            tp.GianniniMasiani(0.01, 1e-6),
            pytest.param(tp.MakrisKonstantinidis(0.01, 1e-6), marks=pytest.mark.slow),
            tp.Vassiliou(1e-6),
            tp.ViscousDamping(1.0, 1e-6),
            pytest.param(tp.ViscousDamping(3.0, 1e-6), marks=pytest.mark.slow),
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


@pytest.mark.parametrize("law", [tp.EnergyConsistent(), tp.HousnerImpact()])
def test_a_run_at_the_brink_does_not_depend_on_what_is_asked_for(law):
    """Runs that a change of their scale by 1e-15 decides: the flags alone, with skips, are those of whole runs."""
    motion = KanaiTajimi(duration=30.0).sample(15, seed=0)[14]
    record, dt = motion.values, float(motion["dt"])
    scale = 0.981 * 20.0 ** (9.0 / 49.0) / np.abs(record).max()
    factors = scale * (1.0 + 1e-15 * np.arange(40.0))[None]
    oscillators = [law.oscillator(tp.Block(0.25, 2.0))]
    whole = run_many(oscillators, factors, record, dt, skip=False)[..., OVERTURNED]
    for flags_only in (False, True):
        found = run_many(oscillators, factors, record, dt, True, flags_only)[..., OVERTURNED]
        np.testing.assert_array_equal(found, whole)
    if law == tp.EnergyConsistent():
        assert 0 < whole.sum() < whole.size
