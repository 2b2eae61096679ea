"""Whole files: what lies in their place, or under their temporary name, is never written through."""

import os
import signal
import subprocess
import sys
import threading
from pathlib import Path

import netCDF4
import pytest
from study_texts import crate_study

import toppling as tp
from toppling.core.writing import whole_file, write_bytes
from toppling.studies.command.cli import main
from toppling.studies.store.folder import folder_of_one


class TestWholeFile:
    def test_all_or_nothing(self, tmp_path):
        path = tmp_path / "one.txt"
        write_bytes(path, b"before")
        with pytest.raises(ValueError, match="halfway"):
            self.fail_halfway(path)
        assert path.read_bytes() == b"before"
        assert os.listdir(tmp_path) == ["one.txt"]
        write_bytes(path, b"after")
        assert path.read_bytes() == b"after"

    def fail_halfway(self, path):
        with whole_file(path) as temporary:
            temporary.write_bytes(b"half")
            raise ValueError("halfway")

    @pytest.mark.parametrize("name", ["one.txt", "one.txt.part"])
    def test_planted_links(self, tmp_path, name):
        precious = tmp_path / "precious"
        precious.write_text("mine")
        (tmp_path / name).symlink_to(precious)
        write_bytes(tmp_path / "one.txt", b"new")
        assert precious.read_text() == "mine"
        assert (tmp_path / "one.txt").read_bytes() == b"new"
        assert not (tmp_path / "one.txt").is_symlink()

    @pytest.mark.parametrize("target", ["/proc/self/fd/1", "/dev/null"])
    def test_links_to_streams_stay(self, tmp_path, target):
        """As root, writing to /dev/stdout took its link away."""
        link = tmp_path / "stdout"
        link.symlink_to(target)
        with pytest.raises(OSError, match="is a device or a pipe"):
            write_bytes(link, b"new")
        assert os.readlink(link) == target

    def test_no_name(self):
        with pytest.raises(IsADirectoryError, match="is a folder"):
            write_bytes(Path(), b"new")

    def test_leftovers_of_killed_processes_go(self, tmp_path):
        """A writer is killed; its file goes with the next write, and nothing else does."""
        path = tmp_path / "one.png"
        code = (
            "import os, signal, sys; from pathlib import Path; from toppling.core.writing import whole_file\n"
            "with whole_file(Path(sys.argv[1])): os.kill(os.getpid(), signal.SIGKILL)"
        )
        killed = subprocess.Popen([sys.executable, "-c", code, str(path)])
        assert killed.wait() == -signal.SIGKILL
        (left,) = os.listdir(tmp_path)
        assert left.startswith(f"one.png.toppling-{killed.pid}-")
        others = [
            f"one.png.toppling-{os.getppid()}-7.part",  # of a process that runs
            f"one.png.toppling-{os.getpid()}-{threading.get_ident()}.part",
            "one.png.part",
            "shelf.4194400-2024.part",  # of a person
            "one.png.7.part",
            f"{left}.bak",
        ]
        for name in others:
            (tmp_path / name).touch()
        # (of a file that is not written again, of a folder of files, and of a process that had this one's number)
        for name in ("two.png.toppling-999999-7.part", f"one.png.toppling-{os.getpid()}-7.part"):
            (tmp_path / name).touch()
        (tmp_path / ".new.toppling-999999-7.part/records").mkdir(parents=True)
        write_bytes(tmp_path / "three.png", b"new")
        assert sorted(os.listdir(tmp_path)) == sorted([*others, "three.png"])

    def test_a_folder_in_its_place(self, tmp_path):
        (tmp_path / "one.txt").mkdir()
        with pytest.raises(OSError):  # noqa: PT011 - which one depends on the system
            write_bytes(tmp_path / "one.txt", b"new")
        assert os.listdir(tmp_path) == ["one.txt"]

    def test_a_device_stays_one(self, tmp_path):
        """`--out /dev/null` as root must not make a file of it; a pipe stands for it."""
        os.mkfifo(tmp_path / "pipe")
        with pytest.raises(OSError, match="is a device or a pipe, no file"):
            write_bytes(tmp_path / "pipe", b"new")
        assert (tmp_path / "pipe").is_fifo()

    def test_two_writers_of_one_file(self, tmp_path):
        """Each has a file of its own until it is done, and the last one wins."""
        with whole_file(tmp_path / "one.txt") as temporary:
            temporary.write_bytes(b"first")
            thread = threading.Thread(target=write_bytes, args=(tmp_path / "one.txt", b"second"))
            thread.start()
            thread.join()
            assert (tmp_path / "one.txt").read_bytes() == b"second"
            assert temporary.read_bytes() == b"first"
        assert (tmp_path / "one.txt").read_bytes() == b"first"
        assert os.listdir(tmp_path) == ["one.txt"]


STUDY = crate_study("Planted", 3, 6, 0.02, 3)


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    folder = tmp_path_factory.mktemp("planted")
    (folder / "study.toml").write_text(STUDY, encoding="utf-8")
    tp.Study.from_toml(folder / "study.toml").run(folder / "out")
    return folder / "out/results.nc"


# What a command writes, with the names that a link may have been planted under.
COMMANDS = {
    "report": (["report", "results.nc"], ["report.html"]),
    "report md": (["report", "results.nc", "--format", "md"], ["report.md", "report_fragility.png"]),
    "export": (["export", "results.nc", "--format", "csv", "--out", "."], ["curves.csv"]),
    "compare": (
        ["compare", "results.nc", "--laws", "discrete", "housner", "--out", "."],
        ["comparison.csv", "curves.png"],
    ),
    "schema": (["schema", "--out", "schema.json"], ["schema.json"]),
    "run": (["run", "study.toml", "--out", "."], ["fragility.png", "run.log"]),
    "motions": (["motions", "study.toml", "--out", "."], ["histories.png", "spectra.png", "husid.png"]),
    "simulate": (
        ["simulate", "bookcase-5-shelf", "clough-penzien", "--set", "duration_s=5", "--pga", "0.4g", "--out", "."],
        ["history.csv", "history.png"],
    ),
}


@pytest.mark.slow
@pytest.mark.parametrize("command", COMMANDS)
def test_no_command_writes_through_a_link(results, tmp_path, monkeypatch, command):
    monkeypatch.chdir(tmp_path)
    Path("study.toml").write_text(STUDY, encoding="utf-8")
    if command != "run":
        Path("results.nc").write_bytes(results.read_bytes())
    precious = tmp_path / "precious"
    precious.write_text("mine")
    arguments, names = COMMANDS[command]
    for name in names:
        for planted in (name, f"{name}.part"):
            Path(planted).symlink_to(precious)
    if command == "run":  # (what lies in place of the results themselves is refused)
        Path("results.nc.part").symlink_to(precious)
    if command in ("export", "compare"):  # (what is not theirs is refused, whatever it is)
        assert main(arguments) == 2
        assert precious.read_text() == "mine"
        for name in names:
            Path(name).unlink()
    assert main(arguments) == 0
    assert precious.read_text() == "mine"
    for name in names:
        assert Path(name).stat().st_size > 0
        assert not Path(name).is_symlink()


@pytest.mark.filterwarnings("ignore:.* was edited after it was written")
@pytest.mark.parametrize("name", ["study", "doubts", "screen", "package_versions", "spectral_variability"])
def test_attributes_nested_deeply(results, tmp_path, capsys, name):
    """A crafted file gets one sentence, not the recursion's end."""
    path = tmp_path / "results.nc"
    path.write_bytes(results.read_bytes())
    with netCDF4.Dataset(path, "a") as file:
        file.setncattr(name, "[" * 100_000 + "]" * 100_000)
    assert main(["report", str(path)]) == 2
    said = capsys.readouterr().err
    assert said.startswith(f"toppling: {path}: ")
    assert len(said.splitlines()) == 1
    code = main(["export", str(path), "--format", "csv", "--out", str(tmp_path / "out")])
    said = capsys.readouterr().err
    assert code == (2 if said.startswith(f"toppling: {path}: ") else 0)


def test_a_folder_that_another_process_just_leaves(tmp_path):
    """Two that make and leave a folder in turn: either has it or waits for it, and neither fails."""
    folder, failures = tmp_path / "out", []

    def use():
        for _ in range(60):
            try:
                with folder_of_one(folder):
                    pass
            except tp.studies.StudyError as error:
                failures.append(str(error))

    threads = [threading.Thread(target=use) for _ in range(3)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not [one for one in failures if "another process runs" not in one]
