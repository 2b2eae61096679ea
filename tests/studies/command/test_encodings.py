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
    """Every command but the benchmark, which takes minutes, and its help."""
    simulate = ["bookcase-5-shelf", "clough-penzien", "--set", "duration_s=5", "--pga", "0.4g", "--out", "history"]
    result = "results/study/results.nc"
    of = {
        "run": [["study.toml"], ["study.toml", "--dry-run"], ["missing-é.toml"]],
        "status": [["results/study"], ["results/study", "--json"]],
        "simulate": [simulate, [*simulate, "--json"]],
        "motions": [["study.toml", "--out", "motions"], ["study.toml", "--out", "motions", "--json"]],
        "catalogue": [[]],
        "bench": [["--help"]],
        "export": [[result, "--format", "csv"]],
        "report": [[result]],
        "schema": [[]],
    }
    assert tuple(of) == COMMANDS
    return [[name, *arguments] for name, every in of.items() for arguments in every] + [["--help"]]


def expected(arguments):
    return 2 if "missing-é.toml" in arguments else 0


@pytest.mark.parametrize(
    "arguments",
    [pytest.param(one, marks=[] if one == ["catalogue"] else [pytest.mark.slow]) for one in commands()],
    ids=" ".join,
)
def test_redirected(folder, arguments):
    for encoding in ENCODINGS:
        done = subprocess.run(
            [sys.executable, "-m", "toppling", *arguments],
            cwd=folder,
            env={**os.environ, "PYTHONIOENCODING": encoding},
            capture_output=True,
            check=False,
        )
        said = done.stdout.decode(encoding), done.stderr.decode(encoding)
        assert done.returncode == expected(arguments), said
        assert "Traceback" not in said[1]
        if "--json" in arguments or arguments == ["schema"]:
            assert json.loads(said[0])


@pytest.mark.slow
@pytest.mark.parametrize("encoding", ENCODINGS)
@pytest.mark.parametrize("arguments", [["catalogue"], ["run", "study.toml", "--fresh"], ["--help"]], ids=" ".join)
def test_on_a_terminal(folder, arguments, encoding):
    leader, follower = pty.openpty()
    process = subprocess.Popen(
        [sys.executable, "-m", "toppling", *arguments],
        cwd=folder,
        env={**os.environ, "PYTHONIOENCODING": encoding, "TERM": "xterm"},
        stdin=follower,
        stdout=follower,
        stderr=follower,
    )
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
    assert process.wait(timeout=300) == 0, said.decode(encoding)
    assert b"Traceback" not in said
    said.decode(encoding)


def test_replacements():
    """What the command writes most, and what has no replacement."""
    assert readable("δ ≥ 0.05 × α – β…") == "delta >= 0.05 x alpha - beta..."
    assert readable("m/s², €, “é”") == 'm/s2, EUR, "e"'
    assert readable("╭─┬│┃━╸┼") == "+-+||--+"
    assert readable("⠋ Ж\udc80") == "* ??"


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
