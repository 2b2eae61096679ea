"""Low bounces, which the engine follows apart from its lanes and together: closed form, and one by one."""

import math
from dataclasses import replace

import numpy as np
import pytest
from shared_cases import RIGID, lifts_at, shake
from stress_cases import BLOCK, IMPACTS, OVERTURNED, PEAK, compile_engine, label

import toppling as tp
from toppling.models.engine.linear_runs import BOUNCE_INTERVAL
from toppling.models.engine.low_bounces import BOUNCE_RESTITUTION
from toppling.models.outputs import OF_ENGINE
from toppling.models.runs import run_many, trace

STRIKE = OF_ENGINE["impact_velocity"]
LINEAR = [model for model in RIGID if not model.oscillator(BLOCK).exact]


@pytest.fixture(scope="module", autouse=True)
def _compiled():
    compile_engine()


def let_go(p, alpha, e, theta0, t):
    """Rotations at the times t of theta'' = p² (theta - alpha sgn(theta)), let go at theta0; the times of its impacts.

    From an impact at speed v on, |theta| = (v/p) sinh(pt) - 2 alpha sinh²(pt/2), which lands after
    (2/p) atanh(v/(p alpha)) with v; the next leaves with e v, to the other side.
    """
    fall = 2.0 / p * math.asinh(math.sqrt(theta0 / (2.0 * (alpha - theta0))))
    theta = np.where(t < fall, theta0 - 2.0 * (alpha - theta0) * np.sinh(0.5 * p * t) ** 2, 0.0)
    v = e * p * math.sqrt(theta0 * (2.0 * alpha - theta0))
    side, start, impacts = -1.0, fall, []
    while start < t[-1] and v > 1e-30:
        impacts.append(start)
        end = start + 2.0 / p * math.atanh(v / (p * alpha))
        inside = (t >= start) & (t < end)
        s = t[inside] - start
        theta[inside] = side * (v / p * np.sinh(p * s) - 2.0 * alpha * np.sinh(0.5 * p * s) ** 2)
        v, side, start = e * v, -side, end
    return theta, np.array(impacts)


class TestClosedForm:
    @pytest.mark.parametrize("e", [0.3, BOUNCE_RESTITUTION, 0.8, 0.9, 0.97])
    @pytest.mark.parametrize("x0", [1e-9, 1e-6, 1e-4, 1e-3, 1e-2])
    @pytest.mark.parametrize("dt", [0.002, 0.005, 0.02])
    def test_bounces_to_rest(self, e, x0, dt):
        """Every sample of a block let go, through all its bounces to rest and beyond."""
        oscillator = tp.HousnerImpact(e=e, geometry="linear").oscillator(BLOCK)
        p = math.sqrt(-oscillator.regions[0].stiffness)
        theta0 = x0 * BLOCK.alpha
        run = trace(oscillator, np.zeros(1200), dt, theta0)
        theta, impacts = let_go(p, BLOCK.alpha, e, theta0, dt * np.arange(1200))
        # (a landing's time is known to rounding of the time in its sample: so many rotations at the speed of landing)
        speed = p * math.sqrt(2.0 * x0) * BLOCK.alpha
        np.testing.assert_allclose(run.history[0], theta, rtol=0.0, atol=1e-12 * theta0 + 4e-16 * speed * 1200 * dt)
        assert run.results[PEAK] == theta0
        # those that it counts are before the rest is sure to end in its sample: the time of the next would be later
        count = int(run.results[IMPACTS])
        assert 1 <= count <= impacts.size
        ends = impacts[-1]
        if run.history[1, -1] == 0.0:
            assert math.floor(impacts[count - 1] / dt) == math.floor(ends / dt)
        np.testing.assert_allclose(
            run.results[STRIKE], p * math.sqrt(theta0 * (2.0 * BLOCK.alpha - theta0)), rtol=1e-12
        )


class TestOneByOne:
    @pytest.mark.parametrize("model", LINEAR, ids=label)
    @pytest.mark.parametrize("e", [0.6, 0.8, 0.9, 0.99])
    def test_together_as_alone(self, model, e):
        """Asked for turning points the engine solves every bounce by itself: flags, impacts and peaks are the same.

        Where a change of the record by 1e-13 changes the impacts, theirs may differ, too.
        """
        oscillator = replace(model, e=e).oscillator(BLOCK)
        factors = np.linspace(0.9, 3.0, 40)
        compared = impacts = differing = 0
        for seed, n in ((1, 700), (2, 10 * BOUNCE_INTERVAL), (3, 10 * BOUNCE_INTERVAL + 1)):
            record = shake(np.random.default_rng(seed), n=n)
            record *= lifts_at(oscillator) / oscillator.gain / np.abs(record).max()
            together = run_many([oscillator], factors[None], record, 0.005, False)[0]
            for factor, found in zip(factors, together, strict=True):
                alone, twin = (
                    trace(oscillator, f * record, 0.005, max_turning_points=9).results
                    for f in (factor, factor * (1 + 1e-13))
                )
                if alone[IMPACTS] != twin[IMPACTS] or alone[OVERTURNED] != twin[OVERTURNED]:
                    continue
                compared += 1
                impacts += alone[IMPACTS]
                differing += found[STRIKE] != alone[STRIKE] or found[PEAK] != alone[PEAK]
                assert found[OVERTURNED] == alone[OVERTURNED]
                assert found[IMPACTS] == alone[IMPACTS]
                assert abs(found[PEAK] - alone[PEAK]) <= max(1e-12, 100.0 * abs(twin[PEAK] - alone[PEAK]))
        assert compared > 100
        assert impacts > 10 * compared
        # (its arithmetic is another one: were all bits the same, nothing would have bounced apart)
        assert differing > 10


def kicks(rng, n, threshold, dt):
    """Short pulses above the threshold now and then: blocks are lifted, bounce, and are lifted again while they do."""
    record = np.zeros(n)
    at = 3
    while at < n - 2:
        length = int(rng.integers(2, 8))
        pulse = rng.choice([-1.0, 1.0]) * rng.uniform(1.05, 1.8) * threshold
        record[at : at + length] += pulse * np.sin(np.pi * (np.arange(length) + 0.5) / length)[: n - at]
        at += int(rng.integers(length, 40))
    return record


class TestCompany:
    @pytest.mark.parametrize("model", LINEAR, ids=label)
    def test_a_history_is_the_same_run(self, model):
        """Bit for bit, whatever bounces beside it and wherever the record ends; the history ends where the run does."""
        oscillator = model.oscillator(BLOCK)
        threshold = lifts_at(oscillator) / oscillator.gain
        rng = np.random.default_rng(81)
        impacts = 0.0
        for n in (90, 97, 103, 200, 5 * BOUNCE_INTERVAL, 5 * BOUNCE_INTERVAL + 2, 600, 601):
            for _ in range(24):
                record = rng.uniform(0.8, 2.0) * kicks(rng, n, threshold, 0.005)
                # (the first is the run of the history)
                factors = np.concatenate([[1.0], rng.uniform(0.8, 1.5, 20)])
                found = run_many([oscillator], factors[None], record, 0.005, False)[0, 0]
                run = trace(oscillator, record, 0.005)
                np.testing.assert_array_equal(found, run.results)
                assert np.abs(run.history[0]).max() <= run.results[PEAK]
                impacts += found[IMPACTS]
        assert impacts > 2000.0

    def test_many_turns_after_bounces(self):
        """A full batch bounces low, then is shaken to and fro in every sample: more turns than are kept at once."""
        oscillator = tp.HousnerImpact(e=0.9, geometry="linear").oscillator(BLOCK)
        record = np.zeros(3 * BOUNCE_INTERVAL)
        record[2:8] = 1.02
        later = np.arange(14, record.size - 20)
        record[later] = 0.9 + np.linspace(0.0, 0.2, later.size) + 20.0 * (-1.0) ** later
        record *= lifts_at(oscillator) / oscillator.gain
        factors = np.linspace(1.0, 1.1, 1048)
        together = run_many([oscillator], factors[None], record, 0.005, False)[0]
        for factor, found in zip(factors[::53], together[::53], strict=True):
            alone = run_many([oscillator], np.array([[factor]]), record, 0.005, False)[0, 0]
            np.testing.assert_array_equal(found, alone)
