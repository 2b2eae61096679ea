"""Whatever a disk answers: one sentence, finished chunks are kept, and nothing is left after the next run."""

import errno
import faulthandler
import fcntl
import gc
import os
import re
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from failing_calls import failing, library, refuse_opening
from real_processes import command, finish
from study_texts import crate_study, study_in

import toppling as tp
from toppling.core import limits
from toppling.motions.readers import at2
from toppling.studies import StudyError
from toppling.studies.command.cli import main
from toppling.studies.store import netcdf, shards
from toppling.studies.store.folder import is_locked

FEW = crate_study("Few", 3, 6, 0.02, 3)


ALL_ARE_LARGE = """
import sys
from toppling.core import limits
from toppling.studies.command.cli import main
limits.SMALL_NETCDF = 0
sys.exit(main(sys.argv[1:]))
"""


@pytest.fixture(scope="module")
def disk(tmp_path_factory):
    return library(tmp_path_factory.mktemp("library"))


@pytest.fixture(scope="module")
def quiet(tmp_path_factory):
    folder = tmp_path_factory.mktemp("quiet")
    study_in(folder, FEW).run(folder)
    return (folder / "results.nc").read_bytes()


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "study.toml").write_text(FEW)
    return tmp_path


@pytest.fixture
def out(folder, quiet):
    (folder / "out").mkdir()
    (folder / "out/results.nc").write_bytes(quiet)
    return folder / "out"


def refused(capsys, arguments, path):
    assert main(arguments) == 2
    assert re.fullmatch(rf"toppling: {path}: .*\(Input/output\serror\)\n", capsys.readouterr().err)


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
def test_a_disk_that_fails_from_some_call_on(disk, quiet, folder, call, number, error):
    study, out = folder / "study.toml", folder / "out"
    fails = failing(disk, out, call, number, error)
    done = subprocess.run(command(study, out), env=fails, capture_output=True, text=True, check=False)
    assert done.returncode in (0, 2), done.stderr
    assert len(done.stderr.splitlines()) == (done.returncode == 2)
    assert finish(study, out).returncode == 0
    assert litter(out) == []
    assert (out / "results.nc").read_bytes() == quiet


def refused_or_done(disk, path, command):
    """Run Python while each of the first closes of a file fails: done, or refused in one sentence."""
    for number in range(1, 7):
        environment = failing(disk, path, "close", number, "EIO")
        done = subprocess.run([sys.executable, *command], env=environment, capture_output=True, text=True, check=False)
        assert done.returncode in (0, 2), (number, done.returncode, done.stderr)
        assert len(done.stderr.splitlines()) == (done.returncode == 2)


OPTIONS = {"export": ["--format", "csv"], "status": ["--verify"]}


class TestReading:
    """What the system refuses is said, and that a result file is none is not."""

    @pytest.mark.slow
    @pytest.mark.parametrize("kind", ["status", "report", "export", "compare"])
    def test_no_file_that_is_read_is_closed_by_the_library(self, disk, out, kind):
        options = {"compare": ["out", "--laws", "discrete", "housner", "--out", "compared"], **OPTIONS}
        refused_or_done(disk, out / "results.nc", ["-m", "toppling", kind, "out", *options.get(kind, [])])

    @pytest.mark.slow
    @pytest.mark.parametrize("kind", OPTIONS)
    def test_no_file_that_is_too_large_for_memory_is_closed_by_the_library(self, disk, out, kind):
        refused_or_done(disk, out / "results.nc", ["-c", ALL_ARE_LARGE, kind, "out", *OPTIONS[kind]])

    @pytest.mark.slow
    @pytest.mark.skipif(sys.platform != "linux", reason="descriptors are not replaced")
    def test_a_large_file_is_let_go_with_its_last_dataset(self, out, monkeypatch):
        """The library has one descriptor for all of them."""
        monkeypatch.setattr(limits, "SMALL_NETCDF", 0)
        path = out / "results.nc"
        before = limits._descriptors(path.stat())
        first, second = netcdf.opened(path), netcdf.opened(path)
        assert len(limits._descriptors(path.stat()) - before) == 1
        expected = first["probability"].values.copy()
        first.close()
        np.testing.assert_array_equal(second["probability"].values, expected)
        part = second["overturned"]
        del second
        assert part.values.any()
        del part
        gc.collect()
        assert limits._descriptors(path.stat()) == before
        assert netcdf.title_of(path) == "Few"

    @pytest.mark.parametrize(
        ("name", "arguments"),
        [
            ("results.nc", ["status", "out"]),
            ("results.nc", ["report", "out"]),
            ("results.nc", ["export", "out", "--format", "csv"]),
            ("results.nc", ["run", "study.toml", "--out", "out"]),
            ("shards/manifest.json", ["status", "out"]),
        ],
    )
    def test_what_the_system_refuses_to_read(self, out, monkeypatch, capsys, name, arguments):
        if name != "results.nc":
            (out / "shards").mkdir()
            (out / "results.nc").rename(out / name)
        refuse_opening(monkeypatch, Path(name).name)
        refused(capsys, arguments, f"out/{name}")

    @pytest.mark.parametrize(
        ("arguments", "times"),
        [
            (["report", "out"], 2),
            (["compare", "out", "--laws", "discrete", "housner", "--out", "compared"], 4),
            (["export", "out", "--format", "csv", "--out", "exported"], 2),
        ],
    )
    def test_results_that_are_read_again(self, out, monkeypatch, capsys, arguments, times):
        for number in range(1, times + 1):
            with monkeypatch.context() as context:
                refuse_opening(context, "results.nc", number)
                refused(capsys, arguments, r"out/results\.nc")
            assert [path.name for path in out.iterdir()] == ["results.nc"]
        refuse_opening(monkeypatch, "results.nc", times + 1)
        assert main(arguments) == 0

    def test_results_that_are_looked_for_beside_a_study(self, out, folder, monkeypatch, capsys):
        """Whose identity cannot be read: they may be of another study."""
        (folder / "results").mkdir()
        out.rename(folder / "results/study")
        refuse_opening(monkeypatch, "results.nc", 1)
        refused(capsys, ["compare", "study.toml", "--laws", "discrete", "housner"], r"results/study/results\.nc")

    def test_an_included_file_that_is_read_again(self, folder, monkeypatch, capsys):
        """For the line of a key that is not known."""
        (folder / "study.toml").write_text('include = ["common.toml"]\n' + FEW)
        (folder / "common.toml").write_text("[fit]\nform_of = 1\n")
        refuse_opening(monkeypatch, "common.toml", 2)
        refused(capsys, ["run", "study.toml", "--dry-run"], r"common\.toml")

    @pytest.mark.skipif(sys.platform == "win32", reason="locks of another kind")
    def test_a_lock_of_another_user(self, tmp_path, monkeypatch):
        """It may be read, but not written: it is held while its process runs."""
        (tmp_path / ".lock").touch()
        opened = os.open

        def refuse(path, flags, *mode, **more):
            if flags & (os.O_WRONLY | os.O_RDWR):
                raise PermissionError(errno.EACCES, "Permission denied", str(path))
            return opened(path, flags, *mode, **more)

        with (tmp_path / ".lock").open("w") as held, monkeypatch.context() as context:
            context.setattr(os, "open", refuse)
            assert not is_locked(tmp_path)
            fcntl.flock(held, fcntl.LOCK_EX)
            assert is_locked(tmp_path)
            context.setattr(os, "open", lambda path, *_: refuse(path, os.O_RDWR))
            refuse_opening(context, ".lock")
            with pytest.raises(StudyError, match=r"\.lock: cannot be read \("):
                is_locked(tmp_path)


@pytest.mark.parametrize("words", [["report"], ["export", "--format", "csv"], ["compare", "--laws", "a", "b"]])
def test_no_page_of_an_unfinished_study(folder, capsys, words):
    (folder / "out").mkdir()
    shards.open_shards(folder / "out", tp.Study.from_toml("study.toml")._pinned, fresh=False)
    assert main([*words[:1], "out", *words[1:]]) == 2
    assert re.match("toppling: out: .*finished", capsys.readouterr().err)


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="permissions of another kind")
@pytest.mark.parametrize(
    ("words", "refused"),
    [
        (["status", "out", "--verify"], ""),
        (["report", "out"], "out/report.html: cannot be written (Permission denied)"),
        (["report", "out", "--format", "md", "--out", "mine"], ""),
        (["export", "out", "--format", "csv"], "out/export: cannot be made a folder (Permission denied)"),
        (["export", "out", "--format", "csv", "--out", "mine"], ""),
        (["compare", "out", "--laws", "discrete", "housner", "--out", "mine"], ""),
        (["compare", "out", "--laws", "discrete", "housner", "--out", "out"], "out/.toppling.json: cannot be written"),
        (["run", "study.toml", "--out", "out", "--dry-run"], ""),
        (["run", "study.toml", "--out", "out"], "out: no permission to write"),
    ],
)
def test_results_of_another_user(out, words, refused):
    """They may be read, and nothing may be written beside them."""
    out.chmod(0o555)
    lower = []
    if os.geteuid() == 0:  # (whom no permission binds, until it gives that up)
        if shutil.which("setpriv") is None:
            pytest.skip("needs setpriv")
        rights = "-dac_override,-dac_read_search"
        lower = ["setpriv", "--bounding-set", rights, "--inh-caps", rights]
    command = [*lower, sys.executable, "-m", "toppling", *words]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    out.chmod(0o755)
    assert done.returncode == (2 if refused else 0), done.stderr
    assert len(done.stderr.splitlines()) == bool(refused)
    assert done.stderr.startswith(f"toppling: {refused}" if refused else "")
    assert [path.name for path in out.iterdir()] == ["results.nc"]


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="other systems write in the same process")
@pytest.mark.parametrize(
    ("harm", "words"),
    [
        (signal.SIGSEGV, "the process that wrote it ended by signal 11"),
        (signal.SIGKILL, "the process that wrote it ended by signal 9"),
        (RuntimeError("NetCDF: HDF error"), "NetCDF: HDF error"),
        (RuntimeError("\ud800"), "the process that wrote it ended early"),
        # (the library's word for a disk that refuses to make a file)
        (PermissionError(13, "Permission denied"), "it cannot be opened"),
    ],
)
def test_a_library_that_crashes_costs_no_chunk(quiet, folder, monkeypatch, harm, words):
    def write(*_):
        if isinstance(harm, Exception):
            raise harm
        faulthandler.disable()
        os.kill(os.getpid(), harm)

    study = tp.Study.from_toml("study.toml")
    with monkeypatch.context() as context:
        context.setattr(netcdf, "_write", write)
        with pytest.raises(StudyError, match=rf"written \({words}; is the disk full\?\); what is finished is kept"):
            study.run(folder / "out")
    assert list((folder / "out/shards").glob("*.nc"))
    computed = []
    study.run(folder / "out", watching=computed.append)
    assert computed[0].kept == computed[0].runs
    assert (folder / "out/results.nc").read_bytes() == quiet
    assert litter(folder / "out") == []


@pytest.mark.slow
def test_a_reason_of_the_system_is_no_full_disk(quiet, folder, monkeypatch):
    study, replace = tp.Study.from_toml("study.toml"), Path.replace

    def refuse(path, target):
        if Path(target).name == "results.nc":
            raise OSError(errno.EIO, "Input/output error", str(path))
        return replace(path, target)

    with monkeypatch.context() as context:
        context.setattr(Path, "replace", refuse)
        with pytest.raises(StudyError, match=r"results.nc: cannot be written \(Input/output error\); what is finished"):
            study.run(folder / "out")
    study.run(folder / "out")
    assert (folder / "out/results.nc").read_bytes() == quiet
    assert litter(folder / "out") == []


@pytest.mark.skipif(sys.platform == "win32", reason="permissions of another kind")
@pytest.mark.parametrize(
    "command",
    [
        ["status", "closed/out"],
        ["report", "closed/out"],
        ["export", "closed/out", "--format", "xlsx"],
        ["compare", "closed/out", "--laws", "a", "b"],
        ["run", "study.toml", "--dry-run", "--out", "closed/out"],
    ],
)
def test_a_folder_that_may_not_be_entered_is_named(folder, monkeypatch, capsys, command):
    """And not a file in it, which the command looks for and the user may not know."""
    (folder / "closed/out").mkdir(parents=True)
    closed, stat, access = Path("closed"), os.stat, os.access

    def refuse(path, *more, **options):
        if not isinstance(path, int) and closed in Path(path).parents:
            raise PermissionError(errno.EACCES, "Permission denied", str(path))
        return stat(path, *more, **options)

    monkeypatch.setattr(os, "stat", refuse)
    monkeypatch.setattr(os, "access", lambda path, mode: Path(path) != closed and access(path, mode))
    assert main(command) == 2
    assert re.fullmatch(r"toppling: closed: .*\(Permission\sdenied\)\n", capsys.readouterr().err)


def test_a_new_study_on_a_full_disk(tmp_path, monkeypatch, capsys):
    """Records of a starter are written by a function with an error of its own."""

    def full(path, content):
        raise OSError(28, "No space left on device", str(path))

    monkeypatch.setattr(at2, "write_bytes", full)
    assert main(["new", "records", str(tmp_path / "new")]) == 2
    error = capsys.readouterr().err
    assert re.search(r"new/records/simulated-01\.AT2: .*\(No space", error)
    assert len(error.splitlines()) == 1
    assert list(tmp_path.iterdir()) == []


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no pipes with names")
@pytest.mark.parametrize("name", ["results.nc", "run.log", "shards/manifest.json"])
def test_a_pipe_in_the_place_of_a_file_is_not_waited_for(folder, capsys, name):
    """Nobody may ever write into it."""
    pipe = folder / "out" / name
    pipe.parent.mkdir(parents=True)
    os.mkfifo(pipe)
    assert main(["run", "study.toml", "--out", "out"]) == 2
    assert main(["status", "out"]) == (0 if name == "run.log" else 2)
    for line in capsys.readouterr().err.splitlines():
        assert line.startswith(f"toppling: out/{name}: ")
        assert line.endswith("(is a device or a pipe, no file)")
