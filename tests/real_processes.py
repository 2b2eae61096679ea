"""Studies run as processes of their own, for tests that kill them."""

import subprocess
import sys
from pathlib import Path

import pytest

DRIVER = Path(__file__).with_name("small_chunks.py")

# some 2 s of computing in about a hundred small chunks
MANY = """
title = "Many chunks"
[[blocks]]
catalogue = "bookcase-5-shelf"
[[blocks]]
width_m = 0.5
height_m = 1.2
name = "crate"
[[models]]
law = "discrete"
e = 0.9
[[models]]
law = "housner"
[motions]
generator = "clough-penzien"
number = 600
duration_s = 15
dt_s = 0.005
envelope = { kind = "rise-strong-decay", rise_s = 1, strong_end_s = 4, decay_per_s = 0.5 }
[ida]
im = "pga"
levels = { from = 0.1, to = 1.0, number = 12, unit = "g" }
"""


def command(study, out, *options):
    return [sys.executable, str(DRIVER), "run", str(study), "--out", str(out), *options]


def begun(study, out, *arguments, **options):
    """A real run that has finished its first chunk."""
    process = subprocess.Popen(
        command(study, out, *arguments), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **options
    )
    for line in process.stdout:
        if line.startswith("computing"):
            return process
    pytest.fail(f"ended before it began: {process.communicate()[1]}")


def finish(study, out, *arguments, **options):
    return subprocess.run(
        command(study, out, *arguments), capture_output=True, text=True, check=False, timeout=300, **options
    )
