"""What can stand in an output folder: links, strangers' files, results that are broken or older than the work there."""

import hashlib
import json
import signal
import threading
import time

import netCDF4
import numpy as np
import pytest
from filelock import FileLock
from real_processes import broken_off
from study_texts import CABINET, motions

import toppling as tp
from toppling.studies import StudyError, show
from toppling.studies.command.cli import main
from toppling.studies.command.status import status_of
from toppling.studies.kinds import study as running
from toppling.studies.store import folder as store, shards, watch

SMALL = f"""
title = "small"
{CABINET}
{motions(75).replace("duration_s = 6", "duration_s = 16")}
[ida]
im = "pga"
levels = {{ from = 0.1, to = 1.0, number = 10, unit = "g" }}
[fit]
replicates = 100
"""
NAME = "000-000000"


@pytest.fixture(autouse=True)
def _chunks(small_chunks):
    """Some chunks for each part of the study."""


@pytest.fixture
def study(tmp_path):
    path = tmp_path / "study.toml"
    path.write_text(SMALL)
    return path


@pytest.fixture
def out(tmp_path):
    (tmp_path / "out").mkdir()
    return tmp_path / "out"


def run(study, out, **options):
    return tp.Study.from_toml(study).run(out, **options)


def break_off(study, out, **options):
    broken_off(tp.Study.from_toml(study), out, 0.7, **options)  # (both chunks of the first part)
    assert len(list((out / "shards").glob("*.nc"))) > 1


@pytest.fixture(scope="module")
def expected(tmp_path_factory):
    folder = tmp_path_factory.mktemp("quiet")
    (folder / "study.toml").write_text(SMALL)
    run(folder / "study.toml", folder)
    return (folder / "results.nc").read_bytes()


def of_a_shard(out, build):
    """Put a netCDF file in the place of the first shard, with the checksum that belongs to it."""
    path = next((out / "shards").glob(f"{NAME}*"))
    with netCDF4.Dataset(path) as file:
        key = file.getncattr("key")
    path.unlink()
    file = netCDF4.Dataset("shard", "w", memory=1 << 12)
    build(file, key)
    content = bytes(file.close())
    (out / "shards" / f"{NAME}-{hashlib.sha256(content).hexdigest()[:16]}.nc").write_bytes(content)


class TestOlderResults:
    """Parts of a study are younger than the results beside them."""

    @pytest.mark.slow
    @pytest.mark.parametrize("older", [SMALL, SMALL.replace("number = 75", "number = 76")])
    def test_work_begun_afresh_is_gone_on_with(self, study, out, expected, older):
        study.write_text(older)
        run(study, out)
        study.write_text(SMALL)
        break_off(study, out, resume=False)
        seen = []
        run(study, out, watching=seen.append)
        assert seen[0].kept > 0
        assert (out / "results.nc").read_bytes() == expected
        assert status_of(out).state == "finished"

    @pytest.mark.slow
    def test_killed_between_the_results_and_the_removal_of_shards(self, study, out, expected, monkeypatch):
        def killed(folder):
            raise SystemExit(9)

        with monkeypatch.context() as patch:
            patch.setattr(running, "remove_shards", killed)
            with pytest.raises(SystemExit):
                run(study, out)
        assert (out / "shards").exists()
        run(study, out)
        assert not (out / "shards").exists()
        assert (out / "results.nc").read_bytes() == expected

    @pytest.mark.parametrize("removed", [2, 3])
    def test_killed_while_shards_are_removed(self, study, out, monkeypatch, removed):
        """The results count, and no run is computed again."""
        remove, calls = shards._remove, []

        def killed(path):
            calls.append(path)
            if len(calls) == removed:
                raise SystemExit(9)
            remove(path)

        with monkeypatch.context() as patch:
            patch.setattr(shards, "_remove", killed)
            with pytest.raises(SystemExit):
                run(study, out)
        assert list((out / "shards").iterdir())
        assert status_of(out).state == "finished"
        before = (out / "results.nc").stat()
        run(study, out, progress=lambda *_: pytest.fail("runs are computed again"))
        assert (out / "results.nc").stat() == before
        assert not (out / "shards").exists()

    def test_interrupted_afresh(self, study, out):
        def progress(done, total):
            raise KeyboardInterrupt

        with pytest.raises(KeyboardInterrupt, match="the same command without --fresh goes on"):
            run(study, out, resume=False, progress=progress)


class TestLinks:
    @pytest.mark.parametrize("options", [(), ("--fresh",)])
    @pytest.mark.parametrize("names", [("film.part",), ("manifest.json", "film.part", f"{NAME}-0123456789abcdef.nc")])
    def test_shards(self, study, tmp_path, out, capsys, options, names):
        outside = tmp_path / "outside"
        outside.mkdir()
        for name in names:
            (outside / name).write_text('{"mine": 1}')
        (out / "shards").symlink_to(outside)
        assert main(["run", str(study), "--out", str(out), *options]) == 2
        assert "is a link" in capsys.readouterr().err
        assert sorted(path.name for path in outside.iterdir()) == sorted(names)

    @pytest.mark.slow
    @pytest.mark.parametrize("name", ["results.nc", "results.nc.part", "run.log", "fragility.png"])
    def test_files(self, study, tmp_path, out, expected, name):
        (tmp_path / "precious").write_text("precious")
        (out / name).symlink_to(tmp_path / "precious")
        assert main(["run", str(study), "--out", str(out), "--fresh"]) == 0
        assert (tmp_path / "precious").read_text() == "precious"
        assert name.endswith(".part") or ((out / name).stat().st_size > 0 and not (out / name).is_symlink())
        assert (out / "results.nc").read_bytes() == expected


class TestStrangers:
    @staticmethod
    def nothing(file, key):
        pass

    @staticmethod
    def groups(file, key):
        file.key = key
        for name in ("overturned", "peak_rotation", "tally"):
            file.createGroup(name)

    @staticmethod
    def huge(file, key):
        file.key = key
        file.createDimension("a", 400_000)
        file.createVariable("overturned", "i1", ("a", "a"), zlib=True, chunksizes=(1000, 1000))
        file.createVariable("peak_rotation", "f8", ("a",))
        file.createVariable("tally", "i8", ())

    @pytest.mark.slow
    @pytest.mark.parametrize("build", ["nothing", "groups", "huge"])
    def test_netcdf_in_the_place_of_a_shard(self, study, out, expected, build):
        break_off(study, out)
        of_a_shard(out, getattr(self, build))
        run(study, out)
        assert (out / "results.nc").read_bytes() == expected
        assert (out / "run.log").read_text().count("is damaged") == 1

    @pytest.mark.slow
    def test_folder_in_the_place_of_a_shard(self, study, out, expected):
        break_off(study, out)
        path = next((out / "shards").glob(f"{NAME}*"))
        path.unlink()
        path.mkdir()
        (out / "shards" / "000-000003-0123456789abcdef.nc").mkdir()
        run(study, out)
        assert (out / "results.nc").read_bytes() == expected
        assert not (out / "shards").exists()

    @pytest.mark.slow
    def test_a_users_files_stay(self, study, out, expected):
        break_off(study, out)
        for name in ("notes.txt", "film.part"):
            (out / "shards" / name).write_text("mine")
        (out / "shards" / "folder.part").mkdir()
        run(study, out)
        assert (out / "results.nc").read_bytes() == expected
        assert sorted(path.name for path in (out / "shards").iterdir()) == ["film.part", "folder.part", "notes.txt"]
        run(study, out, resume=False)
        assert status_of(out).state == "finished"

    @pytest.mark.parametrize(("name", "said"), [("results.nc", "is a folder"), ("run.log", "run.log: cannot be")])
    def test_folder_in_the_place_of_a_file(self, study, out, capsys, name, said):
        (out / name).mkdir()
        assert main(["run", str(study), "--out", str(out), "--fresh"]) == 2
        assert said in capsys.readouterr().err
        assert name == "run.log" or not (out / "shards").exists()  # (said before anything is computed)

    @pytest.mark.slow
    def test_broken_results(self, study, out, expected):
        """Whatever bytes are others: one sentence, or the results as they are read."""
        random = np.random.default_rng(1)
        refused = 0
        for _ in range(40):
            content = np.frombuffer(expected, np.uint8).copy()
            content[random.integers(0, content.size, 40)] = random.integers(0, 256, 40)
            (out / "results.nc").write_bytes(content.tobytes())
            try:
                store.finished(out / "results.nc", tp.Study.from_toml(study).identity, {})
            except StudyError as error:
                refused += "is no result file" in str(error)
        assert refused > 5

    @pytest.mark.parametrize("name", ["back\\slash", "no\udc80unicode"])
    def test_names_that_netcdf_cannot_write(self, study, tmp_path, name, capsys):
        assert main(["run", str(study), "--out", str(tmp_path / name)]) == 2
        assert "the folder's name" in capsys.readouterr().err
        assert [path.name for path in tmp_path.iterdir()] == ["study.toml"]


class TestStatus:
    @pytest.mark.parametrize(
        "calls",
        [
            [1], [None], [{}], [{"chunks": 3}], [{"chunks": [3]}], [{"chunks": [[3]]}], [{"chunks": [["3", "10"]]}],
            [{"chunks": [[-3, 1]]}], [{"chunks": [[3, True]]}], [{"chunks": [[1.5, 1]]}],
            [{"chunks": [[1, float("nan")]]}], [{"chunks": [[1, 10**400]]}],
        ],
    )  # fmt: skip
    def test_counts_that_are_none(self, study, out, calls, capsys):
        break_off(study, out)
        path = out / "shards" / "manifest.json"
        path.write_text(json.dumps({**json.loads(path.read_text()), "calls": calls}))
        assert main(["status", str(out)]) == 2
        assert "no manifest" in capsys.readouterr().err

    def test_more_shards_than_chunks_and_a_title_for_no_terminal(self, study, out):
        break_off(study, out)
        path = out / "shards" / "manifest.json"
        manifest = json.loads(path.read_text())
        path.write_text(json.dumps({**manifest, "title": "\x1b[2J\ud800", "calls": [{"chunks": [[1, 600]]}]}))
        found = status_of(out)
        assert (found.chunks, found.runs, found.title) == (1, 600, "?[2J?")

    def test_looking_does_not_keep_a_study_from_beginning(self, study, out):
        lock = FileLock(out / store.LOCK_NAME, thread_local=False)
        lock.acquire()
        thread = threading.Thread(target=lambda: (time.sleep(0.1), lock.release()))
        thread.start()
        with store.folder_of_one(out):
            pass
        thread.join()


def interrupt(*_):
    raise KeyboardInterrupt


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_interrupted_while_drawing(study, out, monkeypatch, capsys, number):
    """The exit code is that of the signal."""

    def interrupted(*_):
        error = KeyboardInterrupt()
        error.number = number
        raise error

    monkeypatch.setattr(show, "draw", interrupted)
    assert main(["run", str(study), "--out", str(out)]) == 128 + number
    assert "results are written" in capsys.readouterr().err


@pytest.mark.slow
def test_interrupted_while_saving(study, out, monkeypatch, capsys, expected):
    with monkeypatch.context() as patch:
        patch.setattr(running, "save", interrupt)
        assert main(["run", str(study), "--out", str(out)]) == 130
    assert "runs are kept" in capsys.readouterr().err
    run(study, out)
    assert (out / "results.nc").read_bytes() == expected


def test_a_log_on_a_full_disk_is_quiet(tmp_path, monkeypatch, capsys):
    def full(self, record):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(watch._LogFile, "format", full)
    with watch.run_log(tmp_path) as log:
        log.info("one line")
    assert capsys.readouterr().err == ""
