"""Whatever a disk answers: one sentence, finished chunks are kept, and nothing is left after the next run."""

import faulthandler
import os
import signal
import subprocess
import sys

import pytest
from failing_calls import failing, library
from real_processes import command, finish
from study_texts import crate_study

import toppling as tp
from toppling.motions.readers import at2
from toppling.studies import StudyError
from toppling.studies.command.cli import main
from toppling.studies.store import netcdf

FEW = crate_study("Few", 3, 6, 0.02, 3)


@pytest.fixture(scope="module")
def disk(tmp_path_factory):
    return library(tmp_path_factory.mktemp("library"))


@pytest.fixture(scope="module")
def quiet(tmp_path_factory):
    """The bytes of the results on a sound disk."""
    folder = tmp_path_factory.mktemp("quiet")
    (folder / "study.toml").write_text(FEW)
    tp.Study.from_toml(folder / "study.toml").run(folder)
    return (folder / "results.nc").read_bytes()


def litter(folder):
    return [path for path in folder.rglob("*") if path.name == ".lock" or path.suffix == ".part"]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("call", "number", "error"),
    [
        ("write", 30, "EIO"),
        ("close", 20, "EDQUOT"),
        ("fsync", 3, "EIO"),
        ("unlink", 2, "EIO"),
        ("flock", 1, "EIO"),
        ("ftruncate", 1, "EIO"),
    ],
)
def test_a_disk_that_fails_from_some_call_on(disk, quiet, tmp_path, call, number, error):
    (tmp_path / "study.toml").write_text(FEW)
    study, out = tmp_path / "study.toml", tmp_path / "out"
    done = subprocess.run(
        command(study, out), env=failing(disk, out, call, number, error), capture_output=True, text=True, check=False
    )
    assert done.returncode in (0, 2), done.stderr
    assert len(done.stderr.splitlines()) == (done.returncode == 2)
    assert finish(study, out).returncode == 0
    assert litter(out) == []
    assert (out / "results.nc").read_bytes() == quiet


@pytest.mark.skipif(sys.platform != "linux", reason="other systems write in the same process")
@pytest.mark.parametrize(
    ("harm", "words"),
    [
        (
            lambda *_: (faulthandler.disable(), os.kill(os.getpid(), signal.SIGSEGV)),
            "the process that wrote it ended by signal 11",
        ),
        (lambda *_: os.kill(os.getpid(), signal.SIGKILL), "the process that wrote it ended by signal 9"),
        (lambda *_: (_ for _ in ()).throw(RuntimeError("NetCDF: HDF error")), "NetCDF: HDF error"),
    ],
    ids=["crash", "kill", "error"],
)
def test_a_library_that_crashes_costs_no_chunk(quiet, tmp_path, monkeypatch, harm, words):
    (tmp_path / "study.toml").write_text(FEW)
    study = tp.Study.from_toml(tmp_path / "study.toml")
    with monkeypatch.context() as context:
        context.setattr(netcdf, "_write", harm)
        with pytest.raises(StudyError, match=f"results.nc: cannot be written \\({words}.*what is finished is kept"):
            study.run(tmp_path / "out")
    assert list((tmp_path / "out/shards").glob("*.nc"))
    computed = []
    study.run(tmp_path / "out", watching=computed.append)
    assert computed[0].kept == computed[0].runs
    assert (tmp_path / "out/results.nc").read_bytes() == quiet
    assert litter(tmp_path / "out") == []


def test_a_new_study_on_a_full_disk(tmp_path, monkeypatch, capsys):
    """Records of a starter are written by a function with an error of its own."""

    def full(path, content):
        raise OSError(28, "No space left on device", str(path))

    monkeypatch.setattr(at2, "write_bytes", full)
    assert main(["new", "records", str(tmp_path / "new")]) == 2
    error = capsys.readouterr().err
    assert "new/records/simulated-01.AT2: cannot be written (No space left on device)" in error
    assert len(error.splitlines()) == 1
    assert list(tmp_path.iterdir()) == []
