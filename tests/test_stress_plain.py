"""The engine as plain Python (NUMBA_DISABLE_JIT=1): the same answers, and no function that no run needs."""

import ast
import json
import math
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from shared_cases import LAWS, shake
from stress_cases import (
    BLOCK,
    IMPACTS,
    OVERTURNED,
    PEAK,
    UPLIFTED,
    threshold,
)

import toppling as tp
from toppling.models.runs import run_many, trace

PLAIN = """
import ast, json, sys, time
sys.path.insert(0, {tests!r})
ENGINE = {engine!r}
called = set()

def note(frame, event, argument):
    if event == "call" and frame.f_code.co_filename == ENGINE:
        called.add(frame.f_code.co_name)

from test_stress_plain import plain_selection
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
    # bounces by the hundred in a sample
    for geometry in ("exact", "linear"):
        oscillator = tp.HousnerImpact(e=0.998, geometry=geometry).oscillator(BLOCK)
        found.append(trace(oscillator, np.array([1.00001, 0.5, 0.5]) * threshold(oscillator), 0.05).results)
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
