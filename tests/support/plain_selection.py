"""Runs that between them need a whole engine, small enough for plain Python, and a process that has no compiler."""

import ast
import json
import math
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
from shared_cases import LAWS, shake
from stress_cases import BLOCK, threshold

import toppling as tp
from toppling.models.runs import run_many, run_mixed, stacked, trace
from toppling.models.sliding.law import PlaneSlider
from toppling.models.sliding.runs import ONE_WAY, plane_table, run_in_plane, run_sliders
from toppling.motions.arrays import from_array, records

PLAIN = """
import json, sys
sys.path.insert(0, {tests!r})
called = set()

def note(frame, event, argument):
    if event == "call" and frame.f_code.co_filename.startswith({engine!r}):
        called.add(frame.f_code.co_name)

from plain_selection import {selection}
sys.setprofile(note)
runs = {selection}()
sys.setprofile(None)
print(json.dumps([runs, sorted(called)]))
"""


def without_compiler(selection, engine):
    """Results of a selection in a process with NUMBA_DISABLE_JIT=1, and the functions of an engine left uncalled."""
    code = PLAIN.format(tests=str(Path(__file__).parent), engine=str(engine), selection=selection.__name__)
    done = subprocess.run(
        [sys.executable, "-c", code],
        env={**os.environ, "NUMBA_DISABLE_JIT": "1"},
        capture_output=True,
        text=True,
        timeout=120.0,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    runs, called = json.loads(done.stdout)
    functions = {
        node.name
        for file in engine.glob("*.py")
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8")))
        if isinstance(node, ast.FunctionDef)
    }
    return runs, functions - set(called)


def plain_slides():
    """Results of sliding runs: alike and unlike at front and back, one way, in the plane, lifted; NaN as None."""
    rng = np.random.default_rng(92)
    friction = np.array(
        [
            [0.2, 0.2, 0.2, 0.2],
            [0.1, 0.1, 0.05, 0.05],
            [0.1, 0.3, 0.1, 0.2],
            [0.3, ONE_WAY, 0.3, 0.3],
            [9.0, 9.0, 9.0, 9.0],
        ]
    )
    factors = np.tile([0.5, 1.0, 3.0], (5, 1))
    found = []
    for n, dt in ((300, 0.01), (60, 0.05)):
        record = 4.0 * shake(rng, n=n, dt=dt)
        # (a round record, too, of which the stops lie on samples)
        for one in (np.append(record, np.zeros(80)), np.round(record)):
            lift = 2.5 * shake(rng, n=one.size, dt=dt)
            for vertical in (None, lift):
                found += list(run_sliders(friction, factors, one, vertical, dt).reshape(15, -1))
    # (obstacles that are met while a block slides, after the record, and never)
    near = np.column_stack([friction, [0.01, 0.3, 0.02, 0.05, 0.01]])
    for one in (record, record[:40]):
        for vertical in (None, lift[: one.size]):
            found += list(run_sliders(near, factors, one, vertical, dt).reshape(15, -1))
    pushed = np.column_stack([friction[:1], [0.4]])
    found += list(run_sliders(pushed, np.ones((1, 1)), np.full(51, -4.0), None, 0.01)[0])
    # (in the plane: pairs, and both components alike, which slide straight)
    both = plane_table([PlaneSlider(mu, ratio * mu) for mu, ratio in ((0.05, 1.0), (0.1, 0.8), (9.0, 1.0))]).friction
    for one in (record, record[::-1].copy()):
        for vertical in (None, lift[: one.size]):
            found += list(run_in_plane(both, factors[:3], (record, one), vertical, dt).reshape(9, -1))
    return [[None if math.isnan(v) else float(v) for v in row] for row in found]


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
    # bounces by the hundred in a sample
    for geometry in ("exact", "linear"):
        oscillator = tp.HousnerImpact(e=0.998, geometry=geometry).oscillator(BLOCK)
        found.append(trace(oscillator, np.array([1.00001, 0.5, 0.5]) * threshold(oscillator), 0.05).results)
    # an overdamped crossing, and one near critical damping
    for e, speed in ((0.1, 30.0), (0.3, 3.2), (0.999, 0.5)):
        oscillator = tp.EnergyConsistent(e=e).oscillator(BLOCK)
        found.append(trace(oscillator, np.zeros(8), 0.02, 0.06 * BLOCK.alpha, -speed * BLOCK.alpha * BLOCK.p).results)
    # a fall that ends after the record
    case = tp.Block(0.4, 1.8)
    push = np.append(np.full(100, 4000.0 * 9.80665 * math.tan(case.alpha)), 0.0)
    slow = tp.MakrisKonstantinidis(e=0.01, delta=1e-5).oscillator(case)
    found += list(run_many([slow], np.ones((1, 1)), push, 0.01)[0])
    # vertical shaking, which a block rests under, bounces low under, and leaves the floor under
    up = 3.0 * shake(rng, n=150)
    for wall in (None, tp.Wall(0.05)):
        oscillator = tp.HousnerImpact(e=0.9).oscillator(tp.Block(0.4, 1.8, wall=wall))
        record = 3.5 * shake(rng, n=150)
        found.append(trace(oscillator, record, 0.01, vertical=up).results)
        found += list(run_many([oscillator], np.array([[0.1, 0.9, 4.0]]), record, 0.01, vertical=up)[0])
    oscillator = tp.HousnerImpact(e=0.998).oscillator(BLOCK)
    record = np.array([1.00001, 0.5, 0.5]) * threshold(oscillator)
    found.append(trace(oscillator, record, 0.05, vertical=np.array([0.0, 3.0, -3.0])).results)
    # runs of several motions side by side, whose records end one after the other
    motions = [from_array(2.5 * shake(rng, n=n), 0.01) for n in (149, 150, 165)]
    laws = [tp.DiscreteDamping(e=0.9), tp.HousnerImpact(e=0.9, geometry="linear")]
    which, motion = (axis.ravel() for axis in np.indices((2, 3)))
    specimens = stacked([law.oscillator(BLOCK) for law in laws])
    found += list(run_mixed(specimens, which, motion, np.full(6, 1.2), [records(one)[0] for one in motions]))
    # walls, a strap that breaks or holds, a mass off the middle
    record = 3.0 * shake(rng, n=200)
    strap = tp.Restraint.strap(1.75, 267.0, 20e3, 0.005)
    linear = tp.HousnerImpact(e=0.9, geometry="linear")
    for model, options in (
        (tp.EnergyConsistent(e=0.9), {"cm_offset": 0.05}),
        (tp.HousnerImpact(e=0.9), {"wall": tp.Wall(0.01)}),
        (linear, {"wall": tp.Wall(0.7)}),
        (linear, {"wall": tp.Wall(), "mass": 100.0, "restraint": strap}),
        (linear, {"mass": 100.0, "restraint": tp.Restraint.strap(1.75, 1e5, 20e3)}),
    ):
        oscillator = model.oscillator(tp.Block(0.4, 1.8, **options))
        found += list(run_many([oscillator], np.array([[0.5, 1.0, 2.0]]), record, 0.01)[0])
        found.append(trace(oscillator, np.zeros(20), 0.02, 0.1).results)
    return [[None if math.isnan(v) else float(v) for v in row] for row in found]
