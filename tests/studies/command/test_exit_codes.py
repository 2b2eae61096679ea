"""Exit codes: of a signal, that of the one that ended this run, whatever ended one before; of a lost cluster.

And what is around a command: pipes, full logs, variables of the environment, folders that are gone, hostile names.
"""

import os
import re
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from study_texts import crate_study

from toppling.fragility.runs.cluster import ClusterError
from toppling.motions import example_path
from toppling.studies.command import cli, status
from toppling.studies.kinds import study
from toppling.studies.kinds.study import Study
from toppling.studies.store import shards
from toppling.studies.store.watch import Stop


@pytest.fixture(autouse=True)
def hangups():
    """A hang-up is not ignored, as under nohup, and processes inherit that."""
    before = signal.signal(signal.SIGHUP, signal.SIG_DFL)
    yield
    signal.signal(signal.SIGHUP, before)


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT, signal.SIGHUP])
def test_the_signal_that_was_sent(tmp_path, monkeypatch, capsys, number):
    """The first signal is asked for while chunks are in flight, and what is kept is told."""
    (tmp_path / "study.toml").write_text(crate_study("Signals", 3, 6, 0.02, 3), encoding="utf-8")
    asked = Stop.__call__

    def call(self):
        if not self.asked:
            signal.raise_signal(number)
        return asked(self)

    monkeypatch.setattr(Stop, "__call__", call)
    out = str(tmp_path / "out")
    assert cli.main(["run", str(tmp_path / "study.toml"), "--out", out]) == 128 + number
    assert "interrupted with" in capsys.readouterr().err
    monkeypatch.undo()

    def interrupted(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr(status, "status_of", interrupted)
    assert cli.main(["status", out]) == 130


def test_a_lost_cluster_is_no_wrong_input(tmp_path, monkeypatch, capsys):
    """Code 1, as docs/howto/large_studies.md promises: run it again, which after wrong input (code 2) is of no use."""
    (tmp_path / "study.toml").write_text(crate_study("Lost", 3, 6, 0.02, 3), encoding="utf-8")

    def lost(*_, **__):
        raise ClusterError("the scheduler at tcp://10.0.0.1:8786 is gone")

    monkeypatch.setattr(Study, "run", lost)
    assert cli.main(["run", str(tmp_path / "study.toml"), "--out", str(tmp_path / "out")]) == 1
    assert re.search("8786 is.*same command", capsys.readouterr().err)


def test_an_ignored_hangup_stays_ignored():
    """As nohup leaves it."""
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        with Stop().graceful():
            signal.raise_signal(signal.SIGHUP)
            assert signal.getsignal(signal.SIGTERM) is not signal.SIG_DFL
    finally:
        signal.signal(signal.SIGHUP, before)


def test_a_signal_before_and_after_the_runs(tmp_path, monkeypatch, capsys):
    """While results are looked for or written, SIGTERM leaves no lock and says what is kept."""
    (tmp_path / "study.toml").write_text(crate_study("Signals", 3, 6, 0.02, 3), encoding="utf-8")
    for name, words in (("finished", "interrupted"), ("save", "all runs are kept in")):
        with monkeypatch.context() as context:
            context.setattr(study, name, lambda *_: signal.raise_signal(signal.SIGTERM))
            assert cli.main(["run", str(tmp_path / "study.toml"), "--out", str(tmp_path / "out")]) == 143
        assert words in capsys.readouterr().err
        assert not (tmp_path / "out/.lock").exists()


INTERRUPTED_IN = {
    "report": "toppling.studies.report.page.write_report",
    "export": "toppling.studies.command.export.kind_of",
    "compare": "toppling.studies.comparison.compare.compare",
    "new": "toppling.studies.command.starters.write_starter",
}


@pytest.mark.parametrize("name", INTERRUPTED_IN)
def test_an_interrupt_says_that_files_are_whole(tmp_path, monkeypatch, capsys, name):
    """Results that exist are not called unwritten, and the exit code is the signal's."""
    (tmp_path / "results.nc").touch()

    def interrupted(*_, **__):
        error = KeyboardInterrupt()
        error.number = signal.SIGTERM
        raise error

    monkeypatch.setattr(INTERRUPTED_IN[name], interrupted)
    results = str(tmp_path / "results.nc")
    more = {"export": ["--format", "csv"], "compare": [results]}.get(name, [])
    given = ["bookcase", str(tmp_path / "new")] if name == "new" else [results, *more]
    assert cli.main([name, *given]) == 143
    said = capsys.readouterr().err
    assert "complete or unchanged" in said
    assert ("results are unchanged" in said) == (name != "new")


def command(*arguments, **options):
    given = {"capture_output": True, "text": True, "timeout": 100, **options}
    return subprocess.run([sys.executable, "-m", "toppling", *arguments], check=False, **given)


@pytest.mark.slow
def test_a_closed_pipe_ends_the_printing_alone(tmp_path):
    """`toppling run … | head -1`, and a log on a full disk."""
    (tmp_path / "study.toml").write_text(crate_study("Pipe", 3, 6, 0.02, 3), encoding="utf-8")
    read, write = os.pipe()
    os.close(read)
    options = {"cwd": tmp_path, "capture_output": False, "stderr": subprocess.PIPE}
    done = command("run", "study.toml", "--out", "out", stdout=write, **options)
    os.close(write)
    assert (done.returncode, done.stderr) == (0, "")
    assert (tmp_path / "out/results.nc").is_file()


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs a device that is always full")
@pytest.mark.parametrize(("stream", "code"), [("stderr", 2), ("stdout", 2)])
def test_full_streams(stream, code):
    """No sentence can be told on a full standard error; a full standard output is an error of its own."""
    arguments = ("schema",) if stream == "stdout" else ("schema", "--wrong")
    with Path("/dev/full").open("w") as full:
        other = "stdout" if stream == "stderr" else "stderr"
        done = command(*arguments, capture_output=False, **{stream: full, other: subprocess.PIPE})
    assert done.returncode == code
    assert done.stderr is None or re.fullmatch(r"toppling: .*\(No space.*\)\n", done.stderr)


@pytest.mark.slow
@pytest.mark.parametrize(
    "given", ["NUMBA_NUM_THREADS=abc", "NUMBA_NUM_THREADS=0", "NUMBA_OPT=abc", "SOURCE_DATE_EPOCH=abc"]
)
def test_variables_that_numba_cannot_read(tmp_path, given):
    (tmp_path / "study.toml").write_text(crate_study("Variables", 3, 6, 0.02, 3), encoding="utf-8")
    name, value = given.split("=")
    done = command("run", "study.toml", "--out", "out", cwd=tmp_path, env={**os.environ, name: value})
    assert done.returncode == 2
    assert f"'{name}'" in done.stderr
    assert f"'{value}'" in done.stderr
    assert len(done.stderr.splitlines()) == 1


@pytest.mark.slow
def test_no_backend_of_figures_is_needed(tmp_path):
    """Notebooks set one of their own for what they start, which another environment lacks."""
    (tmp_path / "study.toml").write_text(crate_study("Backend", 3, 6, 0.02, 3), encoding="utf-8")
    done = command("run", "study.toml", "--out", "out", cwd=tmp_path, env={**os.environ, "MPLBACKEND": "bogus"})
    assert done.returncode == 0, done.stderr
    assert list((tmp_path / "out").glob("*.png"))


@pytest.mark.slow
def test_files_have_no_settings_of_a_users_matplotlib(tmp_path):
    """Formulas in LaTeX fail where there is none, after all runs; other settings draw over words."""
    for name, number in (("study", 3), ("other", 4)):
        (tmp_path / f"{name}.toml").write_text(crate_study("Settings", number, 6, 0.02, 3), encoding="utf-8")
    figures = ["fragility.png", "history.png", "histories.png", "animation.gif"]
    commands = (
        ("run", "study.toml", "--out", "out", "--fresh"),
        ("report", "out"),
        ("run", "other.toml", "--out", "other", "--fresh"),
        ("compare", "out", "other", "--out", "out"),
        ("simulate", "bookcase-5-shelf", "ricker", "--pga", "0.4g", "--period", "1s", "--animate", "--out", "out"),
        ("motions", str(example_path()), "--out", "out"),
    )
    pictures = []
    for settings in ("", "text.usetex: True\nsavefig.bbox: tight\nfont.size: 30\n"):
        (tmp_path / "matplotlibrc").write_text(settings, encoding="utf-8")
        for words in commands:
            done = command(*words, cwd=tmp_path)
            assert done.returncode == 0, (words, done.stderr)
        pictures.append([(tmp_path / "out" / name).read_bytes() for name in figures])
    assert pictures[0] == pictures[1]


@pytest.mark.slow
@pytest.mark.skipif(os.name != "posix", reason="no signals of POSIX")
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP, signal.SIGINT])
def test_a_signal_leaves_nothing_half_written(tmp_path, number):
    """In any command: one sentence, the signal's exit code, and no new file beside the report."""
    code = (
        "import os, sys, time\nfrom pathlib import Path\n"
        "from toppling.__main__ import main\nfrom toppling.core.writing import whole_file\n"
        "from toppling.studies.report import page\n"
        "def write(*_, **__):\n"
        "    with whole_file(Path('report.html')):\n"
        f"        os.kill(os.getpid(), {int(number)})\n        time.sleep(30)\n"
        "page.write_report = write\nsys.argv = ['toppling', 'report', 'results.nc']\nsys.exit(main())\n"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 128 + number
    assert re.fullmatch("toppling: interrupted.*\n", done.stderr)
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
@pytest.mark.parametrize(
    ("size", "more"), [(150_000, []), (400_000, []), (650_000, ["--dry-run"]), (800_000, []), (1_150_000, [])]
)
def test_a_limit_on_memory_is_named(size, more, tmp_path):
    """It is refused before anything is loaded that would hang, or end the process."""
    resource = pytest.importorskip("resource")
    (tmp_path / "study.toml").write_text(crate_study("Limit", 3, 6, 0.02, 3), encoding="utf-8")

    def limit():
        resource.setrlimit(resource.RLIMIT_AS, (1024 * size, 1024 * size))

    done = command("run", "study.toml", "--out", "out", *more, cwd=tmp_path, preexec_fn=limit)
    assert re.fullmatch(rf"toppling: {size} kB .*\d\n", done.stderr)
    assert done.returncode == 1
    assert not (tmp_path / "out").exists()
    assert command("--help", cwd=tmp_path, preexec_fn=limit).returncode == 0  # (which loads nothing)


def told(capsys, *arguments):
    assert cli.main(list(arguments)) == 2
    error = capsys.readouterr().err
    assert len(error.splitlines()) == 1
    return error


def test_status_of_a_file(tmp_path, capsys):
    (tmp_path / "study.toml").write_text("", encoding="utf-8")
    assert "study.toml: not a" in told(capsys, "status", str(tmp_path / "study.toml"))
    assert "none: no such" in told(capsys, "status", str(tmp_path / "none"))


def test_paths_that_the_system_refuses_are_named(tmp_path, monkeypatch, capsys):
    (tmp_path / "study.toml").write_text(crate_study("Paths", 3, 6, 0.02, 3), encoding="utf-8")
    given, long = str(tmp_path / "study.toml"), str(tmp_path / ("a" * 256))
    for arguments in (("run", given, "--out", long), ("status", long)):
        assert re.search(rf"{long}: .*\(File name", told(capsys, *arguments))
    (tmp_path / "loop").symlink_to(tmp_path / "loop")
    loop = str(tmp_path / "loop")
    assert re.search(f"{loop}: .*leads nowhere", told(capsys, "run", given, "--out", loop))
    record = str(tmp_path / "record.csv")
    Path(record).write_text("time (s),acc (m/s2)\n" + "".join(f"{i / 100},{(-1) ** i}\n" for i in range(200)))
    assert "link that leads" in told(capsys, "motions", record, "--out", loop)
    (tmp_path / "gone").mkdir()
    monkeypatch.chdir(tmp_path / "gone")
    (tmp_path / "gone").rmdir()
    assert "working folder" in told(capsys, "run", given, "--out", "out")


@pytest.mark.parametrize(
    ("harm", "words"),
    [
        (lambda out: shutil.rmtree(out / "shards"), "was removed while the study ran"),
        (shutil.rmtree, "was removed while the study ran"),
        (lambda out: (out / "shards/manifest.json").unlink(), "manifest.json: was removed while the study ran"),
        (lambda out: (out / "shards/manifest.json").write_text("{"), "manifest.json: is no manifest of a study"),
    ],
    ids=["shards", "folder", "manifest", "broken manifest"],
)
def test_what_is_removed_while_a_study_runs(tmp_path, monkeypatch, capsys, harm, words):
    """Nothing is said to be kept that is not."""
    (tmp_path / "study.toml").write_text(crate_study("Removed", 3, 6, 0.02, 3), encoding="utf-8")
    out = tmp_path / "out"
    add = shards._add_call

    def harmed(*arguments):
        harm(out)
        add(*arguments)

    monkeypatch.setattr(shards, "_add_call", harmed)
    error = told(capsys, "run", str(tmp_path / "study.toml"), "--out", str(out))
    assert words in error
    assert "is kept" not in error
    assert "--fresh" in error


def test_a_folder_removed_before_the_results_are_written(tmp_path, monkeypatch, capsys):
    (tmp_path / "study.toml").write_text(crate_study("Removed", 3, 6, 0.02, 3), encoding="utf-8")
    save = study.save

    def removed(results, target):
        shutil.rmtree(target.parent)
        save(results, target)

    monkeypatch.setattr(study, "save", removed)
    error = told(capsys, "run", str(tmp_path / "study.toml"), "--out", str(tmp_path / "out"))
    assert "out: was removed" in error


@pytest.mark.slow
def test_names_give_the_terminal_no_orders(tmp_path, capsys):
    """Control characters of names and arguments: on both streams, in lines, tables and warnings."""
    (tmp_path / "study.toml").write_text(crate_study("Colours", 3, 6, 0.02, 3), encoding="utf-8")
    assert cli.main(["run", str(tmp_path / "study.toml"), "--out", str(tmp_path / "o\x1b[31mt\u202e")]) == 0
    assert cli.main(["ru\x1b[31mn"]) == 2
    said = capsys.readouterr()
    assert "31mt" in said.out
    assert all(letter.isprintable() or letter == "\n" for letter in said.out + said.err)
