"""The engine as plain Python (NUMBA_DISABLE_JIT=1): the same answers, and no function that no run needs."""

import ast
import json
import os
import subprocess
import sys
from pathlib import Path

import plain_selection as selection
import pytest
from stress_cases import (
    IMPACTS,
    OVERTURNED,
    PEAK,
    UPLIFTED,
)

from toppling.models.engine import tables

PLAIN = """
import ast, json, sys, time
sys.path.insert(0, {tests!r})
ENGINE = {engine!r}
called = set()

def note(frame, event, argument):
    if event == "call" and frame.f_code.co_filename.startswith(ENGINE):
        called.add(frame.f_code.co_name)

from plain_selection import plain_selection
sys.setprofile(note)
runs = plain_selection()
sys.setprofile(None)
print(json.dumps([runs, sorted(called)]))
"""


def test_plain_python():
    """NUMBA_DISABLE_JIT=1: the same flags and peaks for every law, and no function of the engine left unused."""
    engine = Path(tables.__file__).parent
    code = PLAIN.format(tests=str(Path(selection.__file__).parent), engine=str(engine))
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
    compiled = selection.plain_selection()
    for one, other in zip(plain, compiled, strict=True):
        assert (one[OVERTURNED], one[UPLIFTED], one[IMPACTS]) == (other[OVERTURNED], other[UPLIFTED], other[IMPACTS])
        assert one[PEAK] == pytest.approx(other[PEAK], rel=1e-10)
    functions = {
        node.name
        for file in engine.glob("*.py")
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8")))
        if isinstance(node, ast.FunctionDef)
    }
    assert functions - set(called) == set()
