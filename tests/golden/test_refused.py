"""Refused files: the exit code, and a sentence that names what is wrong, for each of them."""

import pytest
import refused_cases

import toppling as tp
from toppling.studies.command import cli

CASES = refused_cases.cases()
TABLES = list(dict.fromkeys(case.name.split("/")[1] for case in CASES))
EVERY = 3
"""One case in so many is tested by `make test`, the others by `make test-slow`."""


def problems(case, folder, monkeypatch, capsys):
    """What is wrong with the refusals of a case: of its last command, or of all after those that run studies."""
    case.write(folder)
    monkeypatch.chdir(folder)
    told = ""
    for number, command in enumerate(case.commands, start=1):
        code = cli.main(list(command))
        last = capsys.readouterr().err
        if command[0] == "run" and number < len(case.commands):
            if code:
                yield f"toppling {' '.join(command)} ended with {code}: {last}"
            continue
        told += last
        sentences = [line for line in last.splitlines() if line.startswith("toppling:")]
        if code != cli.EXIT_INPUT or len(sentences) != 1 or "Traceback" in last:
            yield f"toppling {' '.join(command)} ended with {code}: {last}"
    for name in case.names:
        if name not in told:
            yield f"{name!r} is not named: {told}"


@pytest.mark.slow
@pytest.mark.parametrize("table", TABLES)
@pytest.mark.parametrize("quick", [True, pytest.param(False, marks=pytest.mark.slow)], ids=["some", "others"])
def test_refused(tmp_path, monkeypatch, capsys, table, quick):
    chosen = [case for case in CASES if case.name.split("/")[1] == table]
    wrong = [
        f"{case.name}: {problem}"
        for number, case in enumerate(chosen)
        if (number % EVERY == 0) == quick
        for problem in problems(case, tmp_path / case.name, monkeypatch, capsys)
    ]
    assert not wrong, "\n".join(wrong)


def test_names_are_unique():
    names = [case.name for case in CASES]
    assert len(set(names)) == len(names) > 300
    assert all(case.names for case in CASES)


DOUBTED = refused_cases.doubted()


@pytest.mark.parametrize(
    ("number", "case"), [*enumerate(DOUBTED)], ids=[case.name.partition("/")[2] for case in DOUBTED]
)
def test_doubted(number, case, tmp_path, monkeypatch, capsys):
    """What looks odd is one sentence before the runs, which the command prints; usual numbers are not doubted."""
    case.write(tmp_path / "case")
    monkeypatch.chdir(tmp_path / "case")
    kind, *words = case.names
    doubts = [doubt.sentence for doubt in tp.Study.from_toml("study.toml").doubts if doubt.kind == kind]
    assert len(doubts) == bool(words), doubts
    assert [word for word in words if word not in doubts[0]] == []
    if number % 10 == 0:
        assert cli.main(["run", "study.toml", "--dry-run"]) == 0
        printed = " ".join(capsys.readouterr().out.split())
        assert [word for word in words if word not in printed] == []
