"""What the tests of the engine at the ends of its ranges share: draws, limits, and the reference's answer."""

import math
import threading
import time

import numpy as np
from hypothesis import strategies as st
from reference import integrate
from reference_cases import CASES, build
from shared_cases import lifts_at

import toppling as tp
from toppling.core.units import STANDARD_GRAVITY as G
from toppling.models.engine.tables import MANY_IMPACTS
from toppling.models.outputs import OF_ENGINE
from toppling.models.runs import prepare, trace

BLOCK = tp.Block.from_slenderness(0.2, 0.5)
OVERTURNED, PEAK, UPLIFTED, IMPACTS = (OF_ENGINE[k] for k in ("overturned", "peak_rotation", "uplifted", "impacts"))
RIGID_CASES = [c for c in CASES if c[0] == "housner" or c[1].get("rest") == "rigid"]
ELASTIC_CASES = [c for c in CASES if c not in RIGID_CASES]

SECONDS = 1.0  # of processor time, for a run of some thousand samples
HANGS = 30.0  # s after which a run is given up
EVENTS = 10_000  # in one sample, at most
NEXT_TO_ONE = 0.99  # e above which a run may have MANY_IMPACTS in all beside those: bounces hardly lose anything


def label(value):
    return value.label if hasattr(value, "label") else value if isinstance(value, str) else "-".join(value.values())


def compile_engine():
    """Compile what histories and batches need, so that no limit on time counts it."""
    prepare([law.oscillator(BLOCK) for law in (tp.HousnerImpact(), tp.DiscreteDamping())])
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
    return lifts_at(oscillator) / oscillator.gain


def check_sane(run, block, e=0.0):
    """Finite, inside the flat positions, the peak no less than any sample and pi/2 if overturned, few events."""
    results, history = run.results, run.history
    assert np.isfinite(results[: IMPACTS + 1]).all()
    assert np.isfinite(history).all()
    assert np.abs(history[0]).max(initial=0.0) <= results[PEAK] <= 0.5 * math.pi
    assert (results[OVERTURNED] == 1.0) == (results[PEAK] == 0.5 * math.pi)
    assert results[IMPACTS] <= EVENTS * history.shape[1] + (MANY_IMPACTS if e > NEXT_TO_ONE else 0)


def follows(history, truth, twins, bound, error):
    """Whether the rotation keeps to the truth, sample by sample, for as long as the twins do: their peaks say little.

    The largest distance from the truth so far is no more than `bound` (rad) or 100 x that of the twins so far, up to
    where that is a hundredth of the peak.  Where it never is, the `error` of the peak (rad) is held to it, too.
    """
    running = np.maximum.accumulate
    apart = running(np.abs(history[0] - truth.theta))
    twins_apart = running(np.max([np.abs(twin.theta - truth.theta) for twin in twins], axis=0))
    chaos = np.flatnonzero(twins_apart > 0.01 * truth.peak)
    end = chaos[0] if chaos.size else apart.size
    close = np.all(apart[:end] <= np.maximum(bound, 100.0 * twins_apart[:end]))
    return bool(close and (chaos.size or error <= 100.0 * twins_apart[-1]))


def check(law, options, draw, record, theta0=0.0, omega0=0.0, seconds=SECONDS, bound=1e-9):
    """One run is sane and has the reference's verdict and peak; returns it.

    In chaotic motion two twins may have the truth's peak by accident, though their motion parted from it: what counts
    then is the motion up to there.
    """
    block, oscillator, keywords = parts(law, options, draw)
    start = {"theta0": theta0, "omega0": omega0}
    run = answer(trace, oscillator, record, draw["dt"], **start, seconds=seconds)
    check_sane(run, block, draw["e"])
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
        same = same or any(twin.overturned != truth.overturned for twin in twins)
        if error > max(bound, 100.0 * change) or not same:
            assert follows(run.history, truth, twins, bound * scale, error * scale), (error, change, draw)
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
