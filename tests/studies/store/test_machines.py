"""Parts of a study from another processor: refused in a sentence that says so, taken on request, and recorded."""

import json
import os
import subprocess
import sys

import numpy as np
import pytest
import xarray as xr
from study_texts import crate_study

import toppling as tp
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
study = tp.Study.from_toml("study.toml")
seen = []
try:
    accept = sys.argv[1] == "accept"
    study.run("out", other_machine=accept, watching=seen.append, progress=stop if sys.argv[1] == "half" else None)
    print("kept", seen[0].kept)
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
    identity = {**runs.engine_identity(), "processor": "other 01234567"}
    monkeypatch.setattr(shards, "engine_identity", lambda: identity)


@pytest.mark.slow
def test_another_processor_is_named_and_taken_on_request(folder, monkeypatch, small_chunks, capsys):
    here = runs.engine_identity()["processor"]
    half(folder)
    on_another_machine(monkeypatch)
    study = tp.Study.from_toml("study.toml")
    with pytest.raises(StudyError, match=f"from another machine .its processor was {here}, this is other 01234567."):
        study.run("out")
    assert main(["run", "study.toml", "--out", "out", "--dry-run"]) == 0
    assert "from another machine" in capsys.readouterr().out
    assert main(["run", "study.toml", "--out", "out", "--dry-run", "--accept-other-machine"]) == 0
    assert "interrupted, about" in capsys.readouterr().out
    results = study.run("out", other_machine=True)
    assert json.loads(results.attrs["machines"]) == [here, "other 01234567"]
    assert study.run("out").attrs == results.attrs


@pytest.mark.slow
def test_an_interrupted_takeover_goes_on(folder, monkeypatch, small_chunks):
    here = runs.engine_identity()["processor"]
    half(folder)
    on_another_machine(monkeypatch)

    def stop(done, total):
        if done > 2 * total / 3:
            raise KeyboardInterrupt

    study = tp.Study.from_toml("study.toml")
    with pytest.raises(KeyboardInterrupt):
        study.run("out", other_machine=True, progress=stop)
    assert json.loads(study.run("out").attrs["machines"]) == [here, "other 01234567"]


@pytest.mark.slow
def test_other_motions_are_no_changed_records(folder, monkeypatch, small_chunks):
    """Libraries that give the motions other last bits: the sentence says so, and the parts are taken on request."""
    half(folder)
    manifest = json.loads((folder / "out/shards/manifest.json").read_text(encoding="utf-8"))
    before = len(list((folder / "out/shards").glob("*.nc")))
    plain = running.digest
    monkeypatch.setattr(running, "digest", lambda record: plain(record)[::-1])
    monkeypatch.setattr(shards, "digest", lambda record: plain(record)[::-1])
    study = tp.Study.from_toml("study.toml")
    assert study.identity.partition("-")[0] == manifest["identity"].partition("-")[0]
    with pytest.raises(StudyError, match="this processor or its libraries make other motions"):
        study.run("out")
    done = []
    results = study.run("out", other_machine=True, watching=done.append)
    assert done[0].kept > 0 < before
    assert len(json.loads(results.attrs["machines"])) == 2


def test_another_study_is_not_taken(folder, monkeypatch, small_chunks):
    half(folder)
    (folder / "study.toml").write_text(STUDY.replace("number = 40", "number = 41"), encoding="utf-8")
    on_another_machine(monkeypatch)
    with pytest.raises(StudyError, match="holds parts of another study"):
        tp.Study.from_toml("study.toml").run("out", other_machine=True)


@pytest.mark.slow
@pytest.mark.longest
def test_killed_on_one_processor_and_resumed_on_another(folder):
    """numba compiles for a generic processor first: the identity differs, probabilities agree within their chaos."""
    generic = {**os.environ, "NUMBA_CPU_NAME": "generic", "NUMBA_CPU_FEATURES": ""}
    command = [sys.executable, "-c", HALF]
    assert subprocess.run([*command, "half"], env=generic, check=False).returncode == 7
    refused = subprocess.run([*command, "whole"], capture_output=True, text=True, check=False)
    assert refused.returncode == 1
    assert "holds parts of this study from another machine (its processor was generic" in refused.stderr
    done = subprocess.run([*command, "accept"], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert int(done.stdout.split("kept ")[1]) > 0
    with xr.open_dataset("out/results.nc") as mixed:
        one, two = json.loads(mixed.attrs["machines"])
        assert one.startswith("generic ")
        assert two == runs.engine_identity()["processor"]
        whole = tp.Study.from_toml("study.toml").run()
        assert float(np.abs(mixed["probability"] - whole["probability"]).max()) <= 2.0 / whole.sizes["motion"]
