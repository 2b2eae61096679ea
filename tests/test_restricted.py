"""A machine without a home, where one folder alone can be written: commands run, and say what they cannot keep."""

import os
import shutil
import subprocess
import sys

import pytest
from study_texts import crate_study

import toppling

STUDY = crate_study("Restricted", 3, 6, 0.02, 3)
# A copy of all mounts that can only be read, with an empty file system in memory at /media, where the work is done.
READ_ONLY = """
mount --make-rprivate / && mount --rbind / /mnt && mount -o remount,ro,bind /mnt && mount -t tmpfs none /mnt/media &&
cp "$0" /mnt/media/study.toml && cd /mnt/media && exec chroot /mnt sh -c 'cd /media && exec "$@"' sh "$@"
"""
LOADED = """
import sys
from toppling.studies.command.cli import main
code = main(sys.argv[1:])
assert not [name for name in sys.modules if name.startswith(("numba", "llvmlite"))], "numba was loaded"
sys.exit(code)
"""


def works():
    if os.geteuid() != 0 or shutil.which("unshare") is None:
        return False
    test = "if touch /mnt/usr/.x 2>/dev/null; then rm /mnt/usr/.x; exit 1; fi; touch /mnt/media/x"
    done = subprocess.run(
        ["unshare", "--mount", "sh", "-c", READ_ONLY.partition("&&\ncp")[0] + "&& sh -c " + repr(test)],
        capture_output=True,
        check=False,
    )
    return done.returncode == 0


def restricted(tmp_path, script):
    """Run a shell script where only the current folder can be written, without a home and without a cache."""
    study = tmp_path / "study.toml"
    study.write_text(STUDY, encoding="utf-8")
    environment = {
        "PATH": os.environ["PATH"],
        "HOME": "/nonexistent",
        "PYTHONPATH": os.pathsep.join([os.path.dirname(os.path.dirname(toppling.__file__)), *filter(None, sys.path)]),
        "PYTHONDONTWRITEBYTECODE": "1",
        "PYTHON": sys.executable,
        "NUMBA_DISABLE_JIT": "1",
    }
    command = ["unshare", "--mount", "sh", "-c", READ_ONLY, str(study), "sh", "-ec", script]
    return subprocess.run(command, env=environment, capture_output=True, text=True, check=False, timeout=600)


@pytest.mark.slow
@pytest.mark.skipif(not works(), reason="needs root and unshare, to mount everything for reading alone")
def test_every_command_runs(tmp_path):
    """A study is run, shown and exported; uncompiled (`.ci/environments` has a user who cannot keep compiled code)."""
    done = restricted(
        tmp_path,
        """
        if touch /usr/.x 2>/dev/null; then rm /usr/.x; echo "not read-only"; exit 9; fi
        "$PYTHON" -m toppling --version
        "$PYTHON" -m toppling --help >/dev/null
        "$PYTHON" -m toppling catalogue >/dev/null
        "$PYTHON" -m toppling run study.toml --out out
        "$PYTHON" -m toppling status out
        "$PYTHON" -m toppling report out/results.nc
        "$PYTHON" -m toppling export out/results.nc --format csv
        """,
    )
    assert done.returncode == 0, done.stderr
    assert "Restricted: finished, out/results.nc" in done.stdout
    assert "Traceback" not in done.stderr


@pytest.mark.slow
def test_what_needs_no_kernel_loads_none(tmp_path):
    """Help, version, schema, catalogue, status, report and export load nothing of the compiler."""
    (tmp_path / "study.toml").write_text(STUDY, encoding="utf-8")
    toppling.Study.from_toml(tmp_path / "study.toml").run(tmp_path / "out")
    for arguments in (
        ["--help"],
        ["--version"],
        ["schema"],
        ["catalogue"],
        ["run", "--help"],
        ["status", "out"],
        ["report", "out/results.nc"],
        ["export", "out/results.nc", "--format", "csv"],
    ):
        done = subprocess.run(
            [sys.executable, "-c", LOADED, *arguments], cwd=tmp_path, capture_output=True, text=True, check=False
        )
        assert done.returncode == 0, (arguments, done.stderr)
