"""Studies run as processes of their own, for tests that kill them."""

import subprocess
import sys
from contextlib import contextmanager
from pathlib import Path

import pytest
from study_texts import crate_study

DRIVER = Path(__file__).with_name("small_chunks.py")

# some 2 s of computing in about a hundred small chunks
MANY = crate_study("Many chunks", number=600, duration=15, dt=0.005, levels=12)


def command(study, out, *options):
    return [sys.executable, str(DRIVER), "run", str(study), "--out", str(out), *options]


@contextmanager
def begun(study, out, *arguments, **options):
    """A real run that has finished its first chunk, and that does not outlive the test."""
    with subprocess.Popen(
        command(study, out, *arguments), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **options
    ) as process:
        try:
            for line in process.stdout:
                if line.startswith("computing"):
                    break
            else:
                pytest.fail(f"ended before it began: {process.communicate()[1]}")
            yield process
        finally:
            process.kill()


def finish(study, out, *arguments, **options):
    return subprocess.run(
        command(study, out, *arguments), capture_output=True, text=True, check=False, timeout=300, **options
    )
