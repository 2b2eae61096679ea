"""Nothing that happens to a process costs more than the chunks in flight: real ones, killed, stopped and starved."""

import json
import os
import random
import signal
import subprocess
import sys
import time
from types import SimpleNamespace

import pytest
import xarray as xr
from real_processes import MANY, begun, broken_off, finish
from study_texts import CABINET, IDA, crate_study, motions, study_in, study_of

import toppling as tp
from toppling.__main__ import is_interrupt
from toppling.core import machine_code
from toppling.fragility.runs import plan
from toppling.models import runs
from toppling.studies import StudyError
from toppling.studies.command.cli import main
from toppling.studies.command.status import status_of
from toppling.studies.kinds import study as running
from toppling.studies.store import shards

FEWER = MANY.replace("number = 600", "number = 120")


@pytest.fixture
def study(tmp_path):
    path = tmp_path / "study.toml"
    path.write_text(MANY)
    return path


@pytest.fixture(scope="module")
def uninterrupted(tmp_path_factory):
    """The bytes of the results of one quiet run, and how long its computing took, s."""
    folder = tmp_path_factory.mktemp("quiet")
    (folder / "study.toml").write_text(MANY)
    with begun(folder / "study.toml", folder / "out") as process:
        started = time.monotonic()
        _, error = process.communicate(timeout=300)
    assert process.returncode == 0, error
    assert not (folder / "out" / "shards").exists()
    return (folder / "out" / "results.nc").read_bytes(), time.monotonic() - started


def finished(study, out, uninterrupted, **options):
    done = finish(study, out, **options)
    assert done.returncode == 0, done.stderr
    assert (out / "results.nc").read_bytes() == uninterrupted[0]
    return done.stdout


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 3])
def test_killed_at_random_moments(study, tmp_path, uninterrupted, seed):
    """SIGKILL, five times in a row at random moments of the computing; then the same command gives the same bytes."""
    moments, out, kept = random.Random(seed), tmp_path / "out", []
    for _ in range(5):
        with begun(study, out) as process:
            time.sleep(moments.uniform(0.0, 0.7 * uninterrupted[1]))
            process.kill()
        assert process.returncode in (-signal.SIGKILL, 0)
        if (out / "results.nc").exists():
            break
        kept.append(len(list((out / "shards").glob("*.nc"))))
        state = status_of(out)
        assert (state.state, state.chunks) == ("interrupted", kept[-1])
    assert kept == sorted(kept)
    said = finished(study, out, uninterrupted)
    assert kept == [] or "went on from" in said or "there already" in said
    assert not (out / "shards").exists()


def is_gone(group):
    """Whether no process of a group is left, at once or in a moment: Python's own helper ends after the others."""
    for _ in range(100):
        try:
            os.killpg(group, 0)
        except ProcessLookupError:
            return True
        time.sleep(0.1)
    return False


@pytest.mark.slow
@pytest.mark.parametrize("workers", [{}, {"DASK_SCHEDULER": "processes", "DASK_NUM_WORKERS": "2"}])
def test_interrupted_by_a_person(study, tmp_path, uninterrupted, workers):
    """Ctrl-C reaches every process: chunks in flight are finished, one line says what is kept; the command goes on."""
    out, environment = tmp_path / "out", {**os.environ, **workers}
    with begun(study, out, env=environment, start_new_session=True) as process:
        os.killpg(process.pid, signal.SIGINT)
        _, error = process.communicate(timeout=60)
    assert process.returncode == 130, error
    assert "runs kept in" in error
    assert [line.partition(":")[0] for line in error.splitlines()] == ["toppling", "toppling"]
    kept = int(error.split("interrupted with ")[1].split(" of ")[0].replace(",", ""))
    assert json.loads((out / "shards" / "manifest.json").read_text())["work"] > kept == status_of(out).runs > 0
    assert is_gone(process.pid)
    assert f"went on from {kept:,} runs" in finished(study, out, uninterrupted, env=environment)


@pytest.mark.slow
@pytest.mark.parametrize("seconds", [0.1, 0.4, 0.8])
def test_interrupted_while_it_loads(study, tmp_path, seconds):
    """SIGINT before there is anything to stop: one line and the exit code, whatever is being imported."""
    command = [sys.executable, "-m", "toppling", "run", str(study), "--out", str(tmp_path / "out")]
    for tenths in range(30):
        with subprocess.Popen(command, stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True) as process:
            time.sleep(seconds + 0.1 * tenths)
            process.send_signal(signal.SIGINT)
            _, error = process.communicate(timeout=60)
        early = "<frozen runpy>" in error and "toppling/__main__.py" not in error
        if not early and not error.startswith("Fatal Python error: init_"):
            break  # (on a busy machine the interpreter itself was not up yet, and nothing of the package had begun)
    assert process.returncode == 130, error
    assert error.startswith("toppling: ")
    assert len(error.splitlines()) == 1


def test_an_interrupt_that_a_callback_swallows_comes_again():
    """Callbacks of the interpreter, as those of locks of imports, take an exception for nobody's and go on."""
    code = """
import signal, sys, time, weakref
from toppling.__main__ import interrupt_again

class Lock:
    pass

sys.unraisablehook = interrupt_again
lock = Lock()
reference = weakref.ref(lock, lambda _: signal.raise_signal(signal.SIGINT))
try:
    del lock
    for _ in range(200):
        time.sleep(0.01)
except KeyboardInterrupt:
    sys.exit(130)
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False, timeout=60)
    assert (done.returncode, done.stderr) == (130, "")


@pytest.mark.slow
def test_second_process_refuses(study, tmp_path):
    with begun(study, tmp_path / "out") as process:
        process.send_signal(signal.SIGSTOP)
        second = finish(study, tmp_path / "out")
        state = status_of(tmp_path / "out").state
        process.kill()
    assert (state, second.returncode) == ("running", 2)
    assert "another process" in second.stderr
    assert len(second.stderr.splitlines()) == 1


@pytest.fixture(scope="module")
def quiet(tmp_path_factory):
    folder = tmp_path_factory.mktemp("quiet")
    study_in(folder, FEWER).run(folder)
    return (folder / "results.nc").read_bytes()


def first_shard(study, out):
    broken_off(study, out, 0.0)
    return next((out / "shards").glob("*.nc"))


class TestShards:
    """In this process: damage between two runs."""

    @pytest.fixture
    def study(self, tmp_path):
        path = tmp_path / "study.toml"
        path.write_text(FEWER)
        return path

    @pytest.fixture
    def broken_off(self, study, tmp_path, monkeypatch):
        for name in ("LEAST_SECONDS", "CHUNK_SECONDS"):
            monkeypatch.setattr(plan, name, 0.005)
        whole = tp.Study.from_toml(study)
        broken_off(whole, tmp_path / "out", 0.4)
        return whole, tmp_path / "out"

    @pytest.mark.slow
    @pytest.mark.parametrize(
        "damage",
        [
            lambda content: b"",
            lambda content: content[: len(content) // 2],
            lambda content: content[:700] + bytes([content[700] ^ 4]) + content[701:],
            lambda content: b"PK\x03\x04" * 500,
        ],
        ids=["zero length", "truncated", "bit flipped", "something else"],
    )
    def test_damaged_shards_are_computed_again(self, broken_off, quiet, damage):
        plan, out = broken_off
        shards = sorted((out / "shards").glob("*.nc"))
        assert len(shards) > 10
        for path in shards[::3]:
            path.write_bytes(damage(path.read_bytes()))
        plan.run(out)
        assert (out / "results.nc").read_bytes() == quiet
        assert (out / "run.log").read_text().count("is damaged") == len(shards[::3])

    @pytest.mark.slow
    def test_a_changed_study_is_refused(self, broken_off, study):
        _, out = broken_off
        study.write_text(FEWER.replace("to = 1.0", "to = 1.1").replace('law = "housner"', 'law = "vassiliou"'))
        changed = tp.Study.from_toml(study)
        before = sorted(path.name for path in (out / "shards").iterdir())
        message = 'models\\[2\\].law was "housner", is "vassiliou"; ida.levels.to was 1.0, is 1.1'
        with pytest.raises(StudyError, match=message):
            changed.run(out)
        assert sorted(path.name for path in (out / "shards").iterdir()) == before
        xr.testing.assert_identical(changed.run(out, resume=False), changed.run())

    def test_another_engine_is_refused(self, broken_off):
        plan, out = broken_off
        path = out / "shards" / "manifest.json"
        manifest = json.loads(path.read_text())
        manifest["engine"]["numba"] = "0.1"
        path.write_text(json.dumps(manifest))
        with pytest.raises(StudyError, match=r"numba was 0\.1, is \d"):
            plan.run(out)

    @pytest.mark.parametrize("content", ["", "{}", "[1]", "[" * 100_000, '{"layout": 1}', "\0", None])
    def test_a_manifest_that_is_none(self, broken_off, content):
        plan, out = broken_off
        path = out / "shards" / "manifest.json"
        path.write_text(content or "")
        if content is None:
            path.unlink()
            with pytest.raises(StudyError, match="without a manifest"):
                plan.run(out)
            return
        for read in (plan.run, status_of):
            with pytest.raises(StudyError, match="--fresh to start over"):
                read(out)

    @pytest.mark.slow
    def test_shards_of_the_same_name_from_elsewhere(self, broken_off, study, tmp_path, quiet):
        """A sound shard of another study that got into the folder is no part of this one."""
        plan, out = broken_off
        study.write_text(FEWER.replace("number = 120", "number = 120\nseed = 9"))
        strange = first_shard(tp.Study.from_toml(study), tmp_path / "other")
        for path in (out / "shards").glob(f"{strange.name[:10]}*"):
            path.unlink()
        (out / "shards" / strange.name).write_bytes(strange.read_bytes())
        plan.run(out)
        assert (out / "results.nc").read_bytes() == quiet
        assert "of another chunk" in (out / "run.log").read_text()

    @pytest.mark.slow
    def test_shards_of_other_motions_under_the_same_factors(self, tmp_path):
        """Levels that are factors of the motions are the same for all motions, whatever their samples."""
        levels, found = IDA.replace("pga", "scale").replace("m/s2", "1"), []
        for seed in (1, 2):
            of_seed = motions(3).replace("seed = 1", f"seed = {seed}")
            own = study_of(tmp_path, CABINET, of_seed, levels, "[fit]\nreplicates = 100\n")
            found.append((own, first_shard(own, tmp_path / str(seed))))
        (_, strange), (own, shard) = found
        shard.unlink()
        (shard.parent / strange.name).write_bytes(strange.read_bytes())
        xr.testing.assert_identical(own.run(tmp_path / "2"), own.run())

    @pytest.mark.slow
    @pytest.mark.parametrize(
        "kept",
        [lambda there: there, lambda there: there // 2, lambda there: 1, lambda there: 0],
        ids=["all", "half", "the manifest", "an empty folder"],
    )
    def test_killed_while_it_cleans_up(self, broken_off, quiet, monkeypatch, kept):
        """The results are written, and of the shards these are left: the next run removes them."""
        plan, out = broken_off
        total = []

        def remove(path):
            there = len(list((out / "shards").iterdir()))
            total.append(there)
            if there == kept(total[0]):
                raise SystemExit(137)
            path.unlink()
            if there == 1:
                raise SystemExit(137)

        with monkeypatch.context() as patch:
            patch.setattr(shards, "_remove", remove)
            with pytest.raises(SystemExit):
                plan.run(out)
        assert (out / "results.nc").read_bytes() == quiet
        assert (out / "shards").exists()
        plan.run(out)
        assert (out / "results.nc").read_bytes() == quiet
        assert not (out / "shards").exists()

    @pytest.mark.slow
    def test_status(self, broken_off, capsys, tmp_path):
        plan, out = broken_off
        assert main(["status", str(out)]) == 0
        said = capsys.readouterr().out
        assert "Many chunks: interrupted," in said
        assert "same command" in said
        assert main(["status", str(out), "--json"]) == 0
        found = json.loads(capsys.readouterr().out)
        assert 0.3 < found["runs"] / found["runs_total"] < 0.6
        plan.run(out)
        assert main(["status", str(out)]) == 0
        assert "Many chunks: finished" in capsys.readouterr().out


class TestProcessors:
    """Parts of a study from another processor: refused in a sentence that says so."""

    @pytest.fixture
    def study(self, tmp_path, monkeypatch, small_chunks):
        monkeypatch.chdir(tmp_path)
        (tmp_path / "study.toml").write_text(crate_study("Two machines", 40, 12, 0.01, 8), encoding="utf-8")
        return tp.Study.from_toml("study.toml")

    def test_another_processor_is_another_engine(self, study, monkeypatch, capsys):
        here = runs.engine_identity()["processor"]
        broken_off(study, "out", 1 / 3)
        identity = {**runs.engine_identity(), "processor": "other"}
        monkeypatch.setattr(shards, "engine_identity", lambda: identity)
        with pytest.raises(StudyError, match=rf"holds parts of another study \(processor was {here}, is other\)"):
            tp.Study.from_toml("study.toml").run("out")
        assert main(["run", "study.toml", "--out", "out", "--dry-run"]) == 0
        assert f"processor was {here}, is other" in " ".join(capsys.readouterr().out.split())

    def test_results_name_it(self, study):
        processor = study.run("out").attrs["processor"]
        assert processor == runs.engine_identity()["processor"] in ("x86-64 with FMA", "generic")

    @pytest.mark.parametrize(
        ("name", "features", "word"),
        [
            ("emeraldrapids", "+avx2,+fma,+sse2", "x86-64 with FMA"),
            ("znver2", "", "x86-64 with FMA"),
            ("ivybridge", "+avx,-fma", "generic"),
            ("generic", "", "generic"),
            ("neoverse-n1", "+neon", "generic"),
        ],
    )
    def test_the_word_of_a_target(self, name, features, word, monkeypatch):
        machine = "aarch64" if name == "neoverse-n1" else "x86_64"
        target = (f"{machine}-unknown-linux-gnu", name, features)
        monkeypatch.setattr(machine_code, "generator", lambda: SimpleNamespace(magic_tuple=lambda: target))
        assert machine_code.processor() == word

    @pytest.mark.slow
    def test_other_motions_are_no_changed_records(self, study, monkeypatch):
        """Libraries that give the motions other last bits: the sentence says so."""
        broken_off(study, "out", 1 / 3)
        plain = running.digest
        for module in (running, shards):
            monkeypatch.setattr(module, "digest", lambda record: plain(record)[::-1])
        again = tp.Study.from_toml("study.toml")
        assert again.identity.partition("-")[0] == study.identity.partition("-")[0]
        with pytest.raises(StudyError, match="this processor or its libraries make other motions"):
            again.run("out")


@pytest.mark.slow
def test_numba_names_the_processor():
    """One for which it was told to compile: parts of a study from there are those of another engine, as above."""
    code = "from toppling.models.runs import engine_identity\nprint(engine_identity()['processor'])"
    generic = {**os.environ, "NUMBA_CPU_NAME": "generic", "NUMBA_CPU_FEATURES": ""}
    done = subprocess.run([sys.executable, "-c", code], env=generic, capture_output=True, text=True, check=True)
    assert done.stdout == "generic\n"


@pytest.mark.slow
def test_dry_run_writes_nothing(study, tmp_path, capsys):
    assert main(["run", str(study), "--out", str(tmp_path / "out"), "--dry-run"]) == 0
    said = capsys.readouterr().out
    for word in ("runs:", "chunks:", "time:", "memory:", "disk:"):
        assert word in said
    assert not (tmp_path / "out").exists()


def test_an_interrupt_in_the_disguise_of_another_error():
    """CPython 3.11 makes a RuntimeError of what is raised while a class is made."""
    wrapped = RuntimeError("Error calling __set_name__")
    wrapped.__cause__ = KeyboardInterrupt()
    assert is_interrupt(KeyboardInterrupt())
    assert is_interrupt(wrapped)
    assert not is_interrupt(RuntimeError("another"))
