"""Random tries of the public functions at the ends of all ranges: each ends in numbers or in one sentence, and soon.

A try is decided by its number alone, so a failure is found again by it.  Run as a command for many of them:
``python tests/support/extremes.py FIRST NUMBER``; a try that hangs ends the command, with its place in the code.
"""

import dataclasses
import faulthandler
import math
import sys
import time
import warnings
from collections import Counter

import numpy as np
from stress_cases import compile_engine

import toppling as tp
from toppling import motions as mo
from toppling.models.runs import EndlessRunError

MOST_SECONDS = 20.0
OUTPUTS = ("overturned", "peak_rotation", "uplifted", "impacts", "overturning_time", "impact_velocity", "direction")
FLAGS = ("overturned", "uplifted")


def decades(rng, low, high):
    """Return a number between two others, even on a logarithmic scale."""
    return float(np.exp(rng.uniform(math.log(low), math.log(high))))


def draw_block(rng):
    """Return a block, near or beyond the ends of what is allowed."""
    alpha = decades(rng, 1e-4, 1.57) if rng.random() < 0.7 else rng.uniform(0.05, 1.5)
    size = decades(rng, 1e-6, 1e6) if rng.random() < 0.6 else decades(rng, 0.05, 5.0)
    width, height = 2.0 * size * math.sin(alpha), 2.0 * size * math.cos(alpha)
    options = {}
    if rng.random() < 0.25:
        options["lean"] = alpha * rng.uniform(-1.05, 1.05) * rng.choice([0.1, 1.0])
    if rng.random() < 0.25:
        options["cm_offset"] = (
            0.5 * width * (rng.uniform(-1.0, 1.0) if rng.random() < 0.7 else 1.0 - decades(rng, 1e-9, 1.0))
        )
    if rng.random() < 0.2:
        options |= {"cm_height": height * rng.uniform(0.01, 0.99), "inertia_factor": 1.0 + decades(rng, 1e-9, 1.0)}
    if rng.random() < 0.25:
        gap = 0.0 if rng.random() < 0.3 else height * decades(rng, 1e-9, 1.0)
        front = height * decades(rng, 1e-9, 1.0) if rng.random() < 0.3 else None
        options["wall"] = tp.Wall(gap, front_gap=front, restitution=rng.choice([None, 0.0, 0.5, 1.0]))
    if rng.random() < 0.2:
        mass = decades(rng, 1e-6, 1e9)
        weight = 9.81 * mass
        options["mass"] = mass
        arm = height * rng.uniform(0.01, 1.0)
        strength = weight * decades(rng, 1e-3, 1e3)
        stiffness = weight / size * decades(rng, 1e-3, 1e6)
        kind = rng.integers(3)
        if kind == 0:
            slack = rng.choice([0.0, 1.0]) * arm * decades(rng, 1e-9, 1.0)
            options["restraint"] = tp.Restraint.strap(arm, strength, stiffness, slack)
        elif kind == 1:
            options["restraint"] = tp.Restraint.tendon(stiffness, width=width)
        else:
            options["restraint"] = tp.Restraint.adhesive(strength, width * rng.uniform(0.01, 1.0))
    elif rng.random() < 0.1:
        options["bed"] = tp.Bed(0.5 * width * decades(rng, 1e-9, 0.1))
    return tp.Block(width, height, **options)


def draw_law(rng):
    """Return a law, with its options near the ends of what is allowed."""
    e = rng.choice([1.0, 0.5, decades(rng, 1e-6, 1.0), 1.0 - decades(rng, 1e-12, 1.0)])
    delta = decades(rng, 1e-9, 0.99) if rng.random() < 0.7 else 0.05
    zone = {"e": e, "delta": delta, "lever": rng.choice(["h", "R"])}
    rest = rng.choice(["elastic", "rigid"])
    return [
        lambda: tp.HousnerImpact(e=e),
        lambda: tp.HousnerImpact(e=e, geometry="linear"),
        lambda: tp.HousnerImpact(e=e, geometry="bilinear"),
        tp.HousnerImpact,
        lambda: tp.DiscreteDamping(**zone, rest=rest),
        lambda: tp.EnergyConsistent(**zone, rest=rest),
        lambda: tp.GianniniMasiani(**zone),
        lambda: tp.MakrisKonstantinidis(**zone),
        lambda: tp.Vassiliou(delta=delta, coefficient=decades(rng, 1e-6, 100.0)),
        lambda: tp.ViscousDamping(rng.choice([0.0, decades(rng, 1e-6, 100.0)]), delta=delta),
    ][rng.integers(10)]()


def draw_motions(rng):
    """Return two motions of one step, of any strength."""
    n = int(decades(rng, 2, 2000))
    dt = decades(rng, 1e-6, 1e3) if rng.random() < 0.3 else decades(rng, 1e-3, 0.1)
    shape = [
        lambda: rng.standard_normal((2, n)),
        lambda: rng.standard_normal((2, n)).cumsum(axis=1),
        lambda: np.array([[0.0, 0.3, -0.3, 0.0], [0.3, 0.0, 0.0, -0.3]]),
        lambda: np.sin(np.arange(n) * rng.uniform(0.0, 3.0)) * np.array([[1.0], [0.5]]) + 1e-9,
        lambda: np.ones((2, n)),
        lambda: np.sign(rng.standard_normal((2, n))),
    ][rng.integers(6)]()
    return mo.from_array(shape * decades(rng, 1e-12, 1e6) * (1e-150 if rng.random() < 0.05 else 1.0), dt)


def flags(block, law, motions, levels, **options):
    """Return results of a try, checked: every number is known where it should be."""
    runs = tp.ida(block, law, motions, levels, outputs=options.pop("outputs", OUTPUTS), **options)
    if "overturning_time" in runs:
        overturned = runs.overturned.values.astype(bool)
        unknown = {name: np.isnan(runs[name].values.astype(float)) for name in OUTPUTS}
        assert (unknown.pop("overturning_time") == ~overturned).all(), "overturning_time"
        for name, missing in unknown.items():
            assert not missing.any(), name
        assert (runs.peak_rotation.values[overturned] == 0.5 * math.pi).all(), "peaks"
    return {name: runs[name].values for name in FLAGS if name in runs}


def same(found, other, what):
    """Raise AssertionError where two ways to ask for the same runs give other flags."""
    for name, values in other.items():
        assert (found[name] == values).all(), f"{what}: {name}"


def attempt(number):
    """Return how a try ended, "numbers" or the sentence, and its seconds; AssertionError where neither is right."""
    rng = np.random.default_rng(number)
    started = time.perf_counter()
    with warnings.catch_warnings():
        warnings.simplefilter("error", RuntimeWarning)
        warnings.simplefilter("ignore", UserWarning)
        try:
            block, law, motions = draw_block(rng), draw_law(rng), draw_motions(rng)
            lift = 9.81 * math.tan(block.alpha)
            level = lift * decades(rng, 0.1, 30.0) if rng.random() < 0.7 else decades(rng, 1e-6, 1e9)
            levels = np.array([1.0, rng.uniform(1.01, 3.0)]) * level
            found = flags(block, law, motions, levels)
        except (ValueError, TypeError) as error:
            sentence = str(error)
            assert 0 < len(sentence) < 500, sentence
            assert "\n" not in sentence, sentence
            seconds = time.perf_counter() - started
            assert seconds < MOST_SECONDS, f"{seconds:.0f} s"
            return sentence, seconds
        seconds = time.perf_counter() - started
        assert seconds < MOST_SECONDS, f"{seconds:.0f} s"
        try:
            compare(found, block, law, motions, levels)
        except EndlessRunError as error:  # (which way of asking first has too many events, is by a hair)
            return str(error), seconds
        return "numbers", seconds


def compare(found, block, law, motions, levels):
    """Raise AssertionError where skips, order, company, or the side change a flag."""
    same(found, flags(block, law, motions, levels, skip=False), "skip=False")
    same(found, flags(block, law, motions, levels, outputs=["overturned"]), "the flag alone")
    turned = flags(block, law, motions[::-1], levels)
    same(found, {name: values[..., ::-1] for name, values in turned.items()}, "order")
    one = flags(block, law, motions[1:], levels[1:])
    same({name: values[..., 1:, 1:] for name, values in found.items()}, one, "alone")
    if block.wall is None and block.restraint is None:
        mirrored = dataclasses.replace(block, lean=-block.lean, cm_offset=-block.cm_offset)
        same(found, flags(mirrored, law, -motions, levels), "mirrored")


def main(first, number):
    """Make `number` tries from `first` on; print those that failed, and how often each kind of end was."""
    compile_engine()
    ends, failed, slowest = Counter(), 0, (0.0, 0)
    for place in range(first, first + number):
        faulthandler.dump_traceback_later(6.0 * MOST_SECONDS, exit=True)
        print(place, end="\r", flush=True)
        try:
            end, seconds = attempt(place)
        except Exception as error:  # (whatever it is, it is one failure)
            failed += 1
            print(f"{place}: {type(error).__name__}: {error}")
            continue
        ends[end if end == "numbers" else "a sentence"] += 1
        slowest = max(slowest, (seconds, place))
    print(dict(ends), f"{failed} failed, slowest {slowest[0]:.1f} s ({slowest[1]})")
    return int(failed > 0)


if __name__ == "__main__":
    sys.exit(main(int(sys.argv[1]), int(sys.argv[2])))
