"""Nothing that happens to a process costs more than the chunks in flight: real ones, killed, stopped and starved."""

import ctypes
import json
import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
import xarray as xr
from real_processes import MANY, begun, finish
from study_texts import CABINET, IDA, motions

import toppling as tp
from toppling.__main__ import is_interrupt
from toppling.fragility.runs import plan
from toppling.studies import StudyError
from toppling.studies.command.cli import main
from toppling.studies.command.status import status_of
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


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 3])
def test_killed_at_random_moments(study, tmp_path, uninterrupted, seed):
    """SIGKILL, five times in a row at random moments of the computing; then the same command gives the same bytes."""
    expected, seconds = uninterrupted
    moments = random.Random(seed)
    out = tmp_path / "out"
    kept = []
    for _ in range(5):
        with begun(study, out) as process:
            time.sleep(moments.uniform(0.0, 0.7 * seconds))
            process.kill()
        assert process.returncode in (-signal.SIGKILL, 0)
        if (out / "results.nc").exists():
            break
        kept.append(len(list((out / "shards").glob("*.nc"))))
        state = status_of(out)
        assert state.state == "interrupted"
        assert state.chunks == kept[-1]
    assert kept == sorted(kept)
    done = finish(study, out)
    assert done.returncode == 0, done.stderr
    assert kept == [] or "went on from" in done.stdout or "there already" in done.stdout
    assert (out / "results.nc").read_bytes() == expected
    assert not (out / "shards").exists()


@pytest.mark.slow
def test_interrupted_by_a_person(study, tmp_path, uninterrupted):
    """SIGINT: chunks in flight are finished, exit code 130, one line says what is kept; the same command goes on."""
    with begun(study, tmp_path / "out") as process:
        process.send_signal(signal.SIGINT)
        _, error = process.communicate(timeout=60)
    assert process.returncode == 130, error
    assert "runs kept in" in error
    assert [line.partition(":")[0] for line in error.splitlines()] == ["toppling", "toppling"]
    kept = int(error.split("interrupted with ")[1].split(" of ")[0].replace(",", ""))
    manifest = json.loads((tmp_path / "out" / "shards" / "manifest.json").read_text())
    assert kept == status_of(tmp_path / "out").runs > 0
    assert manifest["work"] > kept
    done = finish(study, tmp_path / "out")
    assert done.returncode == 0, done.stderr
    assert f"went on from {kept:,} runs" in done.stdout
    assert (tmp_path / "out" / "results.nc").read_bytes() == uninterrupted[0]


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
def test_interrupted_with_worker_processes(study, tmp_path, uninterrupted):
    """Ctrl-C on a terminal reaches every process of the command: workers finish what they have, and none is left."""
    environment = {**os.environ, "DASK_SCHEDULER": "processes", "DASK_NUM_WORKERS": "2"}
    with begun(study, tmp_path / "out", env=environment, start_new_session=True) as process:
        os.killpg(process.pid, signal.SIGINT)
        _, error = process.communicate(timeout=60)
    assert process.returncode == 130, error
    assert [line.partition(":")[0] for line in error.splitlines()] == ["toppling", "toppling"]
    work = json.loads((tmp_path / "out" / "shards" / "manifest.json").read_text())["work"]
    assert 0 < status_of(tmp_path / "out").runs < work
    assert is_gone(process.pid)
    done = finish(study, tmp_path / "out", env=environment)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "out" / "results.nc").read_bytes() == uninterrupted[0]


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
def test_tests_of_interrupts_run_in_the_background():
    """A shell lets what it begins with `&` ignore interrupts: the suite does not pass that on to what it starts."""
    test = [sys.executable, "-m", "pytest", "-q", __file__, "-k", "test_interrupted_while_it_loads and 0.4"]
    done = subprocess.run(
        ["sh", "-c", "trap '' INT; exec \"$@\"", "sh", *test],
        cwd=Path(__file__).parents[2],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout
    assert "1 passed" in done.stdout


@pytest.mark.slow
def test_full_disk(study, tmp_path, uninterrupted):
    """A limit on the size of files stands for a full disk: one sentence, exit code 2; with room again it goes on."""
    resource = pytest.importorskip("resource")

    def limited(size):
        def limit():
            resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))
            signal.signal(signal.SIGXFSZ, signal.SIG_IGN)

        return limit

    # a limit below a shard's size, and one below that of the results alone
    for size, name in ((2_000, "shards"), (100_000, "results.nc")):
        done = finish(study, tmp_path / "out", preexec_fn=limited(size))
        assert done.returncode == 2, (size, done.stderr)
        assert name in done.stderr
        assert "cannot be written" in done.stderr
        assert "Traceback" not in done.stderr
        assert len(done.stderr.splitlines()) == 1
        assert not (tmp_path / "out" / "results.nc").exists()
        assert not list((tmp_path / "out").rglob("*.part"))
    done = finish(study, tmp_path / "out")
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "out" / "results.nc").read_bytes() == uninterrupted[0]


@pytest.mark.slow
def test_second_process_refuses(study, tmp_path):
    with begun(study, tmp_path / "out") as process:
        process.send_signal(signal.SIGSTOP)
        second = finish(study, tmp_path / "out")
        running = status_of(tmp_path / "out").state
        process.kill()
    assert second.returncode == 2
    assert "another process" in second.stderr
    assert len(second.stderr.splitlines()) == 1
    assert running == "running"


def bound_by_permissions():
    """Even a superuser's process, from its next program on (Linux: CAP_DAC_OVERRIDE leaves the bounding set)."""
    if ctypes.CDLL(None).prctl(24, 1, 0, 0, 0) != 0:
        raise PermissionError


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(os, "getuid"), reason="needs users")
def test_folder_without_permission(study, tmp_path):
    out = tmp_path / "out"
    out.mkdir()
    out.chmod(0o555)
    superuser = os.getuid() == 0
    try:
        done = finish(study, out, preexec_fn=bound_by_permissions if superuser else None)
    except subprocess.SubprocessError:
        pytest.skip("this superuser cannot give up its rights")
    assert done.returncode == 2, done.stderr
    assert "no permission" in done.stderr
    assert list(out.iterdir()) == []


@pytest.fixture(scope="module")
def quiet(tmp_path_factory):
    """The bytes of the results of a run that nothing happened to."""
    folder = tmp_path_factory.mktemp("quiet")
    (folder / "study.toml").write_text(FEWER)
    tp.Study.from_toml(folder / "study.toml").run(folder)
    return (folder / "results.nc").read_bytes()


class TestShards:
    """In this process: damage between two runs."""

    @pytest.fixture
    def study(self, tmp_path):
        path = tmp_path / "study.toml"
        path.write_text(FEWER)
        return path

    @pytest.fixture
    def broken_off(self, study, tmp_path, monkeypatch):
        """A study that an error ended after some chunks."""
        monkeypatch.setattr(plan, "LEAST_SECONDS", 0.005)
        monkeypatch.setattr(plan, "CHUNK_SECONDS", 0.005)
        whole = tp.Study.from_toml(study)

        def progress(done, total):
            if done > 0.4 * total:
                raise RuntimeError("pulled the plug")

        with pytest.raises(RuntimeError, match="pulled the plug"):
            whole.run(tmp_path / "out", progress=progress)
        return whole, tmp_path / "out"

    @pytest.mark.slow
    @pytest.mark.parametrize(
        "damage",
        [
            pytest.param(lambda content: b"", id="zero length"),
            pytest.param(lambda content: content[: len(content) // 2], id="truncated"),
            pytest.param(lambda content: content[:700] + bytes([content[700] ^ 4]) + content[701:], id="bit flipped"),
            pytest.param(lambda content: b"PK\x03\x04" * 500, id="something else"),
        ],
    )
    def test_damaged_shards_are_computed_again(self, broken_off, quiet, damage):
        plan, out = broken_off
        shards = sorted((out / "shards").glob("*.nc"))
        assert len(shards) > 10
        for path in shards[::3]:
            path.write_bytes(damage(path.read_bytes()))
        plan.run(out)
        assert (out / "results.nc").read_bytes() == quiet
        log = (out / "run.log").read_text()
        assert log.count("is damaged") == len(shards[::3])

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
        fresh = changed.run(out, resume=False)
        xr.testing.assert_identical(fresh, changed.run())

    def test_another_engine_is_refused(self, broken_off):
        plan, out = broken_off
        path = out / "shards" / "manifest.json"
        manifest = json.loads(path.read_text())
        manifest["engine"]["numba"] = "0.1"
        path.write_text(json.dumps(manifest))
        with pytest.raises(StudyError, match=r"numba was 0\.1, is \d"):
            plan.run(out)

    @pytest.mark.parametrize("content", ["", "{}", "[1]", "[" * 100_000, '{"layout": 1}', "\0"])
    def test_a_manifest_that_is_none(self, broken_off, content):
        plan, out = broken_off
        (out / "shards" / "manifest.json").write_text(content)
        with pytest.raises(StudyError, match="--fresh to start over"):
            plan.run(out)
        with pytest.raises(StudyError, match="--fresh to start over"):
            status_of(out)

    def test_shards_without_a_manifest(self, broken_off):
        plan, out = broken_off
        (out / "shards" / "manifest.json").unlink()
        with pytest.raises(StudyError, match="without a manifest"):
            plan.run(out)

    @pytest.mark.slow
    def test_shards_of_the_same_name_from_elsewhere(self, broken_off, study, tmp_path, quiet):
        """A sound shard of another study that got into the folder is no part of this one."""
        plan, out = broken_off
        study.write_text(FEWER.replace("number = 120", "number = 120\nseed = 9"))
        other = tp.Study.from_toml(study)
        with pytest.raises(RuntimeError, match="plug"):
            other.run(tmp_path / "other", progress=lambda done, total: (_ for _ in ()).throw(RuntimeError("plug")))
        strange = next((tmp_path / "other" / "shards").glob("*.nc"))
        number = strange.name[:10]
        for path in (out / "shards").glob(f"{number}*"):
            path.unlink()
        (out / "shards" / strange.name).write_bytes(strange.read_bytes())
        plan.run(out)
        assert (out / "results.nc").read_bytes() == quiet
        assert "of another chunk" in (out / "run.log").read_text()

    @pytest.mark.slow
    def test_shards_of_other_motions_under_the_same_factors(self, tmp_path):
        """Levels that are factors of the motions are the same for all motions, whatever their samples."""
        text = CABINET + motions(3) + IDA.replace("pga", "scale").replace("m/s2", "1") + "[fit]\nreplicates = 100\n"
        found = []
        for seed in (1, 2):
            (tmp_path / "study.toml").write_text(f'title = "Factors"\n{text.replace("seed = 1", f"seed = {seed}")}')
            own = tp.Study.from_toml(tmp_path / "study.toml")
            with pytest.raises(RuntimeError, match="plug"):
                own.run(tmp_path / str(seed), progress=lambda done, total: (_ for _ in ()).throw(RuntimeError("plug")))
            found.append((own, next((tmp_path / str(seed) / "shards").glob("*.nc"))))
        (_, strange), (own, shard) = found
        shard.unlink()
        (shard.parent / strange.name).write_bytes(strange.read_bytes())
        xr.testing.assert_identical(own.run(tmp_path / "2"), own.run())

    @pytest.mark.slow
    @pytest.mark.parametrize(
        "kept",
        [
            pytest.param(lambda there: there, id="all"),
            pytest.param(lambda there: there // 2, id="half"),
            pytest.param(lambda there: 1, id="the manifest"),
            pytest.param(lambda there: 0, id="an empty folder"),
        ],
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

        monkeypatch.setattr(shards, "_remove", remove)
        with pytest.raises(SystemExit):
            plan.run(out)
        monkeypatch.undo()
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
        assert main(["status", str(tmp_path / "nothing")]) == 2
        assert main(["status", str(tmp_path)]) == 2


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
