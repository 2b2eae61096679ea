"""Studies that tests kill: as processes of their own, or by an interrupt from a function."""

import os
import signal
import subprocess
import sys
import time
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


def same_after_ten_kills(folder):
    """True if a folder's study.toml, killed ten times when it has kept something new, ends with the same bytes."""
    command = [sys.executable, "-m", "toppling", "run", "study.toml", "--out"]
    shards = folder / "out/shards"

    def kept():
        return len(list(shards.glob("*.nc"))) if shards.is_dir() else 0

    kills = 0
    for _ in range(10):
        before = kept()
        process = subprocess.Popen([*command, "out"], cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        while process.poll() is None and kept() <= before:
            time.sleep(0.002)
        if process.poll() is None:
            os.kill(process.pid, signal.SIGKILL)
            kills += 1
        process.wait()
    assert kills == 10
    assert kept() >= 10
    for out in ("out", "undisturbed"):
        subprocess.run([*command, out], cwd=folder, check=True, capture_output=True)
    return (folder / "out/results.nc").read_bytes() == (folder / "undisturbed/results.nc").read_bytes()


@contextmanager
def killed_at(call, monkeypatch, module, name):
    """Interrupts this call of a function of a module; gives what is raised, to be read after the block."""
    made, calls = getattr(module, name), []

    def killed(*arguments):
        calls.append(1)
        if len(calls) == call:
            raise KeyboardInterrupt
        return made(*arguments)

    with monkeypatch.context() as patched:
        patched.setattr(module, name, killed)
        with pytest.raises(KeyboardInterrupt) as raised:
            yield raised


def broken_off(study, out, share, **options):
    """Run a study in this process, and end it with an error after this share of its runs."""

    def progress(done, total):
        if done > share * total:
            raise RuntimeError("pulled the plug")

    with pytest.raises(RuntimeError, match="pulled the plug"):
        study.run(out, progress=progress, **options)
