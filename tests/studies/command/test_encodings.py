"""Encodings of the output: no character ends a command, redirected or on a terminal, and what it says can be read."""

import json
import os
import pty
import subprocess
import sys

import pytest
from study_texts import crate_study

from toppling.studies.command.cli import COMMANDS
from toppling.studies.text.encoding import readable

ENCODINGS = ("cp1252", "latin-1", "ascii")
STUDY = crate_study("Кабинет β ≥ 1", 3, 6, 0.02, 3)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A study with its results, whose title no single-byte encoding of the west can write."""
    place = tmp_path_factory.mktemp("encodings")
    (place / "study.toml").write_text(STUDY, encoding="utf-8")
    subprocess.run([sys.executable, "-m", "toppling", "run", "study.toml"], cwd=place, check=True, capture_output=True)
    return place


def commands():
    """Return every command."""
    simulate = ["bookcase-5-shelf", "clough-penzien", "--set", "duration_s=5", "--pga", "0.4g", "--out", "history"]
    result = "results/study/results.nc"
    of = {
        "new": [["--help"]],
        "run": [["study.toml"], ["study.toml", "--dry-run"], ["missing-é.toml"]],
        "status": [["results/study"], ["results/study", "--json"]],
        "app": [["--help"]],
        "simulate": [simulate, [*simulate, "--json"]],
        "motions": [["study.toml", "--out", "motions"], ["study.toml", "--out", "motions", "--json"]],
        "catalogue": [[]],
        "export": [[result, "--format", "csv"]],
        "report": [[result]],
        "compare": [["results/study", "--laws", "discrete", "housner"]],
        "schema": [[]],
    }
    assert tuple(of) == COMMANDS
    return [[name, *arguments] for name, every in of.items() for arguments in every] + [["--help"]]


def expected(arguments):
    return 2 if "missing-é.toml" in arguments else 0


# The command three times in one process, with streams of each encoding, as Python opens them under PYTHONIOENCODING.
EACH = """
import os, sys
from toppling.studies.command.cli import main, prepare_streams
codes = set()
for encoding in sys.argv[1].split(","):
    sys.stdout, sys.stderr = (open(number, "w", encoding=encoding, closefd=False) for number in (1, 2))
    prepare_streams()
    codes.add(main(sys.argv[2:]))
    for number, stream in ((1, sys.stdout), (2, sys.stderr)):
        stream.flush()
        os.write(number, bytes([0]))
assert len(codes) == 1, codes
os._exit(codes.pop())
"""


def of_each(said):
    """Return what was written under each encoding."""
    parts = said.split(b"\0")
    assert len(parts) == len(ENCODINGS) + 1
    return [part.decode(encoding) for part, encoding in zip(parts, ENCODINGS, strict=False)]


SLOW = [pytest.param(one, marks=[] if one == ["catalogue"] else [pytest.mark.slow]) for one in commands()]


@pytest.mark.slow
@pytest.mark.parametrize("arguments", SLOW, ids=" ".join)
def test_redirected(folder, arguments):
    command = [sys.executable, "-c", EACH, ",".join(ENCODINGS), *arguments]
    done = subprocess.run(command, cwd=folder, capture_output=True, check=False)
    assert done.returncode == expected(arguments), done.stderr
    assert b"Traceback" not in done.stderr
    for said in of_each(done.stdout):
        if "--json" in arguments or arguments == ["schema"]:
            assert json.loads(said)
    assert len(of_each(done.stderr)) == len(ENCODINGS)


@pytest.mark.slow
@pytest.mark.parametrize("arguments", SLOW, ids=" ".join)
def test_on_a_terminal(folder, arguments):
    command = [sys.executable, "-c", EACH, ",".join(ENCODINGS), *arguments]
    code, said = on_terminal(command, folder, {**os.environ, "TERM": "xterm"})
    assert code == expected(arguments), said
    assert b"Traceback" not in said
    assert said.count(b"\0") == 2 * len(ENCODINGS)


@pytest.mark.slow
@pytest.mark.parametrize("encoding", ENCODINGS)
def test_as_the_environment_says(folder, encoding):
    """By Python's own variable, redirected and on a terminal."""
    command = [sys.executable, "-m", "toppling", "catalogue"]
    environment = {**os.environ, "PYTHONIOENCODING": encoding, "TERM": "xterm"}
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "server-rack" in done.stdout.decode(encoding)
    code, said = on_terminal(command, folder, environment)
    assert code == 0
    assert "server-rack" in said.decode(encoding)


@pytest.mark.parametrize("columns", ["1000000000", "99999999999999999999"])
def test_columns_beyond_any_terminal(folder, columns):
    command = [sys.executable, "-m", "toppling", "catalogue"]
    environment = {**os.environ, "COLUMNS": columns}
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, check=False)
    assert (done.returncode, done.stderr) == (0, b"")
    assert max(map(len, done.stdout.decode().splitlines())) <= 1000


def on_terminal(command, folder, environment):
    """Return the exit code and the output of a command whose streams are a terminal."""
    leader, follower = pty.openpty()
    streams = dict.fromkeys(("stdin", "stdout", "stderr"), follower)
    process = subprocess.Popen(command, cwd=folder, env=environment, **streams)
    os.close(follower)
    said = b""
    while True:
        try:
            part = os.read(leader, 65536)
        except OSError:  # (the other end is closed)
            break
        if not part:
            break
        said += part
    os.close(leader)
    return process.wait(timeout=300), said


def test_replacements():
    """What the command writes most, and what has no replacement."""
    assert readable("δ ≥ α") == "delta >= alpha"
    assert readable("× – β…") == "x - beta..."
    assert readable("m/s², €, “é”") == 'm/s2, EUR, "e"'
    assert readable("╭─┬│┃━╸┼") == "+-+||--+"
    assert readable("⠋ Ж\udc80") == "* ??"


@pytest.mark.slow
def test_a_name_that_is_no_text(folder):
    """A file whose name is no UTF-8 is named nonetheless."""
    done = subprocess.run(
        [sys.executable.encode(), b"-m", b"toppling", b"run", b"caf\xe9.toml"],
        cwd=folder,
        env={**os.environ, "PYTHONIOENCODING": "utf-8"},
        capture_output=True,
        check=False,
    )
    assert done.returncode == 2
    assert done.stderr.startswith(b"toppling: caf .toml: ")
