"""Damaged study files: a plan is a Study or one sentence, in bounded time and memory, and nothing is written."""

import re
import resource
import subprocess
import sys
import warnings

import fuzz_studies
import pytest

import toppling as tp
from toppling.studies import FragilityStudy, PerformanceStudy, SensitivityStudy, StudyError, UncertaintyStudy
from toppling.studies.command.cli import main
from toppling.studies.kinds.pooled import PooledStudy

KINDS = (FragilityStudy, PooledStudy, UncertaintyStudy, SensitivityStudy, PerformanceStudy)
WHOLE = fuzz_studies.bases()


def encoded(files):
    return {name: text.encode() for name, text in files.items()}


@pytest.fixture(scope="module", autouse=True)
def _ready(tmp_path_factory):
    fuzz_studies.ready(tmp_path_factory.mktemp("ready"))


@pytest.mark.parametrize("files", WHOLE, ids=range(len(WHOLE)))
def test_what_is_not_damaged_is_a_study(tmp_path, files):
    found = fuzz_studies.outcome(encoded(files), tmp_path / "whole")
    assert found.kind == "Study", found.sentence


def test_a_mutant_is_its_number():
    assert fuzz_studies.mutant(7, WHOLE) == fuzz_studies.mutant(7, WHOLE) != fuzz_studies.mutant(8, WHOLE)


class TestTheFuzzerItself:
    """It must see what it is for: an exception that escapes, a sentence that is none, a file left behind."""

    def judged(self, tmp_path, monkeypatch, effect):
        monkeypatch.setattr(tp.Study, "from_toml", staticmethod(effect))
        return fuzz_studies.outcome(encoded(WHOLE[0]), tmp_path / "mutant").kind

    def test_an_exception(self, tmp_path, monkeypatch):
        def effect(path):
            raise KeyError("x")

        assert self.judged(tmp_path, monkeypatch, effect) == "escaped: KeyError"

    def test_a_warning(self, tmp_path, monkeypatch):
        def effect(path):
            warnings.warn("overflow", RuntimeWarning, stacklevel=1)

        assert self.judged(tmp_path, monkeypatch, effect) == "escaped: RuntimeWarning"

    def test_a_sentence_that_does_not_name_the_file(self, tmp_path, monkeypatch):
        def effect(path):
            raise StudyError("no")

        assert self.judged(tmp_path, monkeypatch, effect) == "no sentence"

    def test_a_file_left_behind(self, tmp_path, monkeypatch):
        def effect(path):
            (path.parent / "x").write_text("")

        assert self.judged(tmp_path, monkeypatch, effect) == "wrote files"

    def test_content_that_the_schema_refuses(self, tmp_path, monkeypatch):
        monkeypatch.setattr(tp.Study, "from_toml", staticmethod(lambda path: None))
        files = encoded(WHOLE[0])
        files["study.toml"] = files["study.toml"].replace(b"storeys = 4", b"storeys = 0")
        assert b"storeys = 0" in files["study.toml"]
        assert fuzz_studies.outcome(files, tmp_path / "mutant").kind.endswith("the schema")


@pytest.mark.slow
def test_mutants(tmp_path):
    """400 here, as many in the slow one; more with ``python tests/support/fuzz_studies.py FIRST NUMBER``."""
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    kinds, wrong = fuzz_studies.failures(0, 400, tmp_path)
    assert wrong == []
    assert sum(kinds.values()) == 400
    assert kinds["Study"] > 40  # a fuzzer whose mutants all fail at the first check finds nothing
    grown = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before
    assert grown * 1024 < fuzz_studies.MOST_MEMORY


@pytest.mark.slow
@pytest.mark.parametrize(("first", "number"), [(400, 200), (100_000, 200)])
def test_many_mutants(tmp_path, first, number):
    kinds, wrong = fuzz_studies.failures(first, number, tmp_path)
    assert wrong == []
    assert sum(kinds.values()) == number


@pytest.mark.slow
def test_twenty_through_the_command(tmp_path, capsys, monkeypatch):
    """Exit code 2, one line on standard error, nothing written; nothing is run of those that are studies."""

    def no_run(self, *_, **__):
        raise StudyError(f"{self.title}: is a study")

    for kind in KINDS:
        monkeypatch.setattr(kind, "run", no_run)
    for number in range(10**6, 10**6 + 20):
        files = fuzz_studies.mutant(number, WHOLE)
        path = tmp_path / "study.toml"
        for one in tmp_path.iterdir():
            one.unlink()
        for name, data in files.items():
            (tmp_path / name).write_bytes(data)
        here = sorted(tmp_path.iterdir())
        assert main(["run", str(path), "--out", str(tmp_path / "out")]) == 2
        error = capsys.readouterr().err
        assert error.startswith("toppling: ")
        assert error.count("\n") == 1
        assert "Traceback" not in error
        assert sorted(tmp_path.iterdir()) == here


@pytest.mark.slow
def test_one_as_a_process(tmp_path):
    (tmp_path / "study.toml").write_bytes(b'title = "\xff"')
    command = [sys.executable, "-m", "toppling", "run", "study.toml", "--out", "out"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (2, "")
    assert re.fullmatch(r"toppling: study\.toml: .*UTF-8\n", done.stderr)
    assert [one.name for one in tmp_path.iterdir()] == ["study.toml"]
