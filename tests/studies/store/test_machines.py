"""Parts of a study from another processor: refused in a sentence that says so."""

import json
import os
import subprocess
import sys

import pytest
from study_texts import crate_study

import toppling as tp
from toppling.core import machine_code
from toppling.models import runs
from toppling.studies import StudyError
from toppling.studies.command.cli import main
from toppling.studies.kinds import study as running
from toppling.studies.store import shards

STUDY = crate_study("Two machines", 40, 12, 0.01, 8)
HALF = """
import sys
import toppling as tp
from toppling.fragility.runs import plan
plan.LEAST_SECONDS = plan.CHUNK_SECONDS = 0.002
def stop(done, total):
    if done > total / 3:
        raise KeyboardInterrupt
try:
    tp.Study.from_toml("study.toml").run("out", progress=stop)
except KeyboardInterrupt:
    sys.exit(7)
"""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "study.toml").write_text(STUDY, encoding="utf-8")
    return tmp_path


def half(folder):
    """Begin the study in this process, and stop it at a third of its runs."""

    def stop(done, total):
        if done > total / 3:
            raise KeyboardInterrupt

    study = tp.Study.from_toml("study.toml")
    with pytest.raises(KeyboardInterrupt):
        study.run("out", progress=stop)
    return study


@pytest.fixture
def small_chunks(monkeypatch):
    from toppling.fragility.runs import plan

    monkeypatch.setattr(plan, "LEAST_SECONDS", 0.002)
    monkeypatch.setattr(plan, "CHUNK_SECONDS", 0.002)


def on_another_machine(monkeypatch):
    """From now on this process is one of another processor."""
    identity = {**runs.engine_identity(), "processor": "other"}
    monkeypatch.setattr(shards, "engine_identity", lambda: identity)


def test_another_processor_is_another_engine(folder, monkeypatch, small_chunks, capsys):
    here = runs.engine_identity()["processor"]
    half(folder)
    on_another_machine(monkeypatch)
    with pytest.raises(StudyError, match=rf"holds parts of another study \(processor was {here}, is other\)"):
        tp.Study.from_toml("study.toml").run("out")
    assert main(["run", "study.toml", "--out", "out", "--dry-run"]) == 0
    assert f"processor was {here}, is other" in " ".join(capsys.readouterr().out.split())


def test_results_name_it(folder):
    results = tp.Study.from_toml("study.toml").run("out")
    assert results.attrs["processor"] == runs.engine_identity()["processor"] in ("x86-64 with FMA", "generic")


@pytest.mark.parametrize(
    ("target", "word"),
    [
        (("x86_64-unknown-linux-gnu", "emeraldrapids", "+avx2,+fma,+sse2"), "x86-64 with FMA"),
        (("x86_64-unknown-linux-gnu", "znver2", ""), "x86-64 with FMA"),
        (("x86_64-unknown-linux-gnu", "ivybridge", "+avx,-fma"), "generic"),
        (("x86_64-unknown-linux-gnu", "generic", ""), "generic"),
        (("aarch64-unknown-linux-gnu", "neoverse-n1", "+neon"), "generic"),
    ],
)
def test_the_word_of_a_target(target, word, monkeypatch):
    class Codegen:
        def magic_tuple(self):
            return target

    monkeypatch.setattr(machine_code, "generator", Codegen)
    assert machine_code.processor() == word


@pytest.mark.slow
def test_other_motions_are_no_changed_records(folder, monkeypatch, small_chunks):
    """Libraries that give the motions other last bits: the sentence says so."""
    half(folder)
    manifest = json.loads((folder / "out/shards/manifest.json").read_text(encoding="utf-8"))
    plain = running.digest
    monkeypatch.setattr(running, "digest", lambda record: plain(record)[::-1])
    monkeypatch.setattr(shards, "digest", lambda record: plain(record)[::-1])
    study = tp.Study.from_toml("study.toml")
    assert study.identity.partition("-")[0] == manifest["identity"].partition("-")[0]
    with pytest.raises(StudyError, match="this processor or its libraries make other motions"):
        study.run("out")


@pytest.mark.slow
@pytest.mark.longest
def test_killed_on_one_processor_and_resumed_on_another(folder):
    """numba compiles for a processor without FMA first: its parts are not gone on with."""
    generic = {**os.environ, "NUMBA_CPU_NAME": "generic", "NUMBA_CPU_FEATURES": ""}
    command = [sys.executable, "-c", HALF]
    assert subprocess.run(command, env=generic, check=False).returncode == 7
    refused = subprocess.run(command, capture_output=True, text=True, check=False)
    assert refused.returncode == 1
    assert "processor was generic," in refused.stderr
