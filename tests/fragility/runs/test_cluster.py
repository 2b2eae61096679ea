"""Studies on a real dask scheduler with worker processes on loopback: the same bytes, whatever is lost."""

import json
import os
import pickle
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from real_processes import MANY, begun, finish

import toppling as tp
from toppling.fragility import Work, plan_chunks
from toppling.fragility.runs.cluster import (
    NEWS_SECONDS,
    Cluster,
    ClusterError,
    _check_engine,
    _MadeMotions,
    _motions_of,
    _run_part,
    _SentWork,
    check_workers,
    worker_identity,
)
from toppling.fragility.runs.plan import number_of_chunks
from toppling.motions import records
from toppling.motions.arrays import Record, digest
from toppling.studies.store.worker_motions import cluster, motions_again

pytestmark = pytest.mark.skipif(os.environ.get("NUMBA_DISABLE_JIT") == "1", reason="minutes without the compiler")

OTHER = """
import toppling.models.runs as runs

identity = {**runs.engine_identity(), "toppling": "0.0.1"}
runs.engine_identity = lambda: identity
"""


DYING = """
import os, signal
import {module} as place

place.{name} = lambda *_: os.kill(os.getpid(), signal.SIGKILL)
"""


class Machines:
    """A scheduler and its workers, processes of their own."""

    def __init__(self, folder):
        self._folder = folder
        file = folder / "scheduler.json"
        self.scheduler = self._start("scheduler", "--scheduler-file", str(file), "--port", "0", "--no-dashboard")
        ends = time.monotonic() + 60.0
        while not file.exists():
            assert time.monotonic() < ends, "no scheduler"
            time.sleep(0.1)
        time.sleep(0.2)
        self.address = json.loads(file.read_text())["address"]
        self.workers = []

    def _start(self, kind, *options):
        log = (self._folder / f"{kind}.log").open("a")
        return subprocess.Popen(
            [sys.executable, "-m", f"distributed.cli.dask_{kind}", "--host", "127.0.0.1", *options],
            stdout=log, stderr=log, cwd=self._folder,
        )  # fmt: skip

    def add_worker(self, *options):
        self.workers.append(
            self._start("worker", self.address, "--nthreads", "1", "--no-nanny", "--no-dashboard", *options)
        )

    def end(self):
        for process in (*self.workers, self.scheduler):
            process.kill()
            process.wait()


@pytest.fixture
def machines(tmp_path):
    found = Machines(tmp_path)
    yield found
    found.end()


@pytest.fixture
def study(tmp_path):
    path = tmp_path / "study.toml"
    path.write_text(MANY)
    return path


@pytest.fixture(scope="module")
def expected(tmp_path_factory):
    """The bytes that this process computes."""
    folder = tmp_path_factory.mktemp("local")
    (folder / "study.toml").write_text(MANY)
    tp.Study.from_toml(folder / "study.toml").run(folder)
    return (folder / "results.nc").read_bytes()


@pytest.mark.slow
def test_two_workers_give_the_same_bytes(machines, study, tmp_path, expected):
    machines.add_worker()
    machines.add_worker()
    done = finish(study, tmp_path / "out", "--scheduler", machines.address)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "out" / "results.nc").read_bytes() == expected


@pytest.mark.slow
def test_a_stopped_worker_changes_nothing(machines, study, tmp_path, expected):
    """It is stopped for longer than the client waits for news of the cluster, and goes on."""
    machines.add_worker()
    machines.add_worker()
    with begun(study, tmp_path / "out", "--scheduler", machines.address) as process:
        machines.workers[0].send_signal(signal.SIGSTOP)
        time.sleep(2.0 * NEWS_SECONDS)
        machines.workers[0].send_signal(signal.SIGCONT)
        _, error = process.communicate(timeout=120)
    assert process.returncode == 0, error
    assert (tmp_path / "out" / "results.nc").read_bytes() == expected


@pytest.mark.slow
@pytest.mark.parametrize(
    ("module", "name"),
    [
        ("toppling.models.runs", "engine_identity"),
        ("toppling.fragility.runs.cluster", "_loaded"),
        ("toppling.fragility.runs.cluster", "_run_part"),
    ],
    ids=["asked for its identity", "given the motions", "given a chunk"],
)
def test_a_worker_killed_at_a_moment(machines, study, tmp_path, expected, module, name):
    """Its chunks go to the other, whatever it was doing."""
    (tmp_path / "dying.py").write_text(DYING.format(module=module, name=name))
    machines.add_worker()
    machines.add_worker("--preload", str(tmp_path / "dying.py"))
    from distributed import Client

    with Client(machines.address, set_as_default=False) as client:
        client.wait_for_workers(2, timeout=60)
    done = finish(study, tmp_path / "out", "--scheduler", machines.address)
    assert done.returncode == 0, done.stderr
    assert machines.workers[1].wait(timeout=10) == -signal.SIGKILL
    assert (tmp_path / "out" / "results.nc").read_bytes() == expected


@pytest.mark.slow
def test_a_killed_scheduler_is_said_and_a_rerun_goes_on(machines, study, tmp_path, expected):
    machines.add_worker()
    with begun(study, tmp_path / "out", "--scheduler", machines.address) as process:
        machines.scheduler.kill()
        started = time.monotonic()
        _, error = process.communicate(timeout=90)
    assert time.monotonic() - started < 60.0
    assert process.returncode == 1, error
    last = error.strip().splitlines()[-1]
    assert "scheduler at tcp://127.0.0.1" in last
    assert "same command again" in last
    assert "Traceback" not in error
    done = finish(study, tmp_path / "out")
    assert done.returncode == 0, done.stderr
    assert "went on from" in done.stdout
    assert (tmp_path / "out" / "results.nc").read_bytes() == expected


@pytest.mark.slow
def test_interrupt_on_a_cluster(machines, study, tmp_path):
    machines.add_worker()
    with begun(study, tmp_path / "out", "--scheduler", machines.address) as process:
        process.send_signal(signal.SIGINT)
        _, error = process.communicate(timeout=60)
    assert process.returncode == 130, error
    assert "runs kept in" in error


@pytest.mark.slow
def test_a_worker_of_another_version_is_refused(machines, study, tmp_path):
    (tmp_path / "other.py").write_text(OTHER)
    machines.add_worker()
    machines.add_worker("--preload", str(tmp_path / "other.py"))
    from distributed import Client

    with Client(machines.address, set_as_default=False) as client:
        client.wait_for_workers(2, timeout=60)
    done = finish(study, tmp_path / "out", "--scheduler", machines.address)
    assert done.returncode == 1
    assert "has toppling 0.0.1," in done.stderr
    assert "Traceback" not in done.stderr
    assert not (tmp_path / "out" / "results.nc").exists()


def test_a_worker_of_other_sources_is_refused():
    """Equal versions and engines, and another function that computes chunks with them."""
    theirs = {**worker_identity(), "sources": "0" * 12}
    with pytest.raises(ClusterError, match="tcp://there has sources 000000000000, this process"):
        _check_engine("tcp://there", theirs, worker_identity())
    task = pickle.dumps(([], None, True, (), theirs))
    with pytest.raises(ClusterError, match="a worker has sources"):
        _run_part([], [], task)


@pytest.mark.slow
def test_no_worker(machines, monkeypatch):
    from distributed import Client

    monkeypatch.setattr("toppling.fragility.runs.cluster.WORKERS_WITHIN", 1.0)
    with (
        Client(machines.address, set_as_default=False) as client,
        pytest.raises(ClusterError, match="no worker within 1 s"),
    ):
        check_workers(client)


class TestWhatIsSent:
    """Data are sent once, and motions not at all where workers can make them."""

    class Notes:
        """In a client's place: keeps what it is asked to send."""

        def __init__(self):
            self.tasks = []

        def submit(self, function, *arguments, pure):
            self.tasks.append((function.__name__, arguments))
            return f"future {len(self.tasks)}"

        def map(self, function, *arguments, pure):
            return [self.submit(function, *each, pure=pure) for each in zip(*arguments, strict=True)]

    def work(self, n=300):
        block = tp.Block(0.4, 1.8)
        shakes = tp.motions.KanaiTajimi(duration=10.0, dt=0.005).sample(n, seed=0)
        oscillators = tuple(tp.DiscreteDamping(e=0.9, delta=d).oscillator(block) for d in np.linspace(0.01, 0.1, 60))
        return Work(oscillators, tuple(records(shakes)), np.ones((1, 100, n)))

    def test_motions_and_oscillators_go_once(self):
        work, client = self.work(), self.Notes()
        sent = _SentWork(client, work, None)
        chunks = plan_chunks(work, 0.05)
        assert len({(chunk.row, chunk.row_stop) for chunk in chunks}) == 2
        for pair in zip(chunks[::2], chunks[1::2], strict=False):
            sent.submit(pair)
        sent.submit(chunks[-1:] if len(chunks) % 2 else [])
        parcels = [pickle.loads(arguments[0]) for name, arguments in client.tasks if name == "_loaded"]
        assert len(parcels) == 2 + 2  # groups of oscillators, parcels of 4 MB
        parts = [arguments for name, arguments in client.tasks if name == "_run_part"]
        assert len(parts) == len(chunks) > 50
        own = [len(pickle.dumps(arguments)) for arguments in parts]
        assert max(own) < 900 * max(chunk.stop - chunk.first for chunk in chunks) + 2_000  # the factors alone
        together = {record.label for parcel in parcels for record in parcel if isinstance(record, Record)}
        assert together == {record.label for record in work.motions}

    @pytest.mark.slow
    def test_motions_that_can_be_made_are_not_sent(self, study):
        plan = tp.Study.from_toml(study)
        runner = cluster(None, plan.configuration, plan._digests, bool)
        work = Work((plan.of_each_law[0],), tuple(records(plan.design.motions)), np.ones((1, 1, 600)))
        client = self.Notes()
        sent = _SentWork(client, work, runner.remake)
        sent.submit(plan_chunks(work)[:1])
        assert max(len(pickle.dumps(arguments)) for _, arguments in client.tasks) < 25_000
        again = motions_again(json.dumps(plan.configuration))
        for one, other in zip(again, work.motions, strict=True):
            np.testing.assert_array_equal(one.acceleration, other.acceleration)

    @pytest.mark.slow
    def test_a_performance_study_is_made_again_too(self):
        """With its hazard, whose defaults stand in its configuration, and on its floors."""
        plan = tp.Study.from_toml(Path(tp.__file__).parent / "studies" / "examples" / "clinic.toml")
        assert "hazard" in plan.configuration
        remake = cluster(None, plan.configuration, plan._digests, bool).remake
        on_floors = [digest(one) for one in remake.function()]
        assert not remake.known.issuperset(on_floors)
        assert remake.gives(on_floors)
        assert not remake.gives([*on_floors, "of another motion"])

    def test_a_worker_that_makes_other_motions_refuses(self):
        shakes = records(tp.motions.CloughPenzien(duration=1.0, dt=0.01).sample(2))
        wanted = tuple(bytes.fromhex(digest(one)) for one in shakes)
        assert _motions_of(_MadeMotions(lambda: shakes[::-1], wanted)) == shakes
        with pytest.raises(ClusterError, match="other motions from the same seeds"):
            _motions_of(_MadeMotions(lambda: shakes[:1], wanted[::-1]))

    def test_motions_from_files_are_sent(self, tmp_path):
        array = tp.motions.CloughPenzien(duration=5.0, dt=0.01).sample(1)
        lines = ["time (s),acceleration (m/s2)"]
        lines += [f"{t:.2f},{a!r}" for t, a in zip(array["time"].values, array.values[0].tolist(), strict=True)]
        (tmp_path / "motion.csv").write_text("\n".join(lines))
        text = MANY[: MANY.index("[motions]")] + '[motions]\nrecords = "motion.csv"\n' + MANY[MANY.index("[ida]") :]
        (tmp_path / "study.toml").write_text(text)
        plan = tp.Study.from_toml(tmp_path / "study.toml")
        assert cluster(None, plan.configuration, plan._digests, bool) == Cluster(None, None, bool)


def test_plan_of_many_blocks_and_of_much_work():
    """Oscillators are cut too, and there are never more than 100,000 chunks or so."""
    block = tp.Block(0.4, 1.8)
    one = tp.HousnerImpact(geometry="linear").oscillator(block)
    shakes = tuple(records(tp.motions.CloughPenzien(duration=10.0, dt=0.01).sample(50, seed=0)))
    work = Work((one,) * 5000, shakes, np.ones((1, 20, 50)))
    chunks = plan_chunks(work)
    cells = np.zeros((5000, 50), int)
    for chunk in chunks:
        cells[chunk.row : chunk.row_stop, chunk.first : chunk.stop] += 1
        assert (chunk.row_stop - chunk.row) * 20 <= 4096 + 20
    assert (cells == 1).all()
    assert len(plan_chunks(work, 1e-9)) <= 100_000 + 5000


def test_the_last_chunks_fall_in_size():
    """However many threads there are, they end at about the same time: list scheduling, against equal chunks."""
    one = tp.HousnerImpact(geometry="linear").oscillator(tp.Block(0.4, 1.8))
    shake = records(tp.motions.KanaiTajimi(duration=30.0, dt=0.01).sample(1, seed=0))[0]
    work = Work((one,) * 50, (shake,) * 4000, np.ones((1, 20, 4000)))  # 60 s by the planning figures
    sizes = [chunk.stop - chunk.first for chunk in plan_chunks(work)]
    assert sum(sizes) == 4000
    assert sizes == sorted(sizes, reverse=True)
    assert sizes[-1] * 8 <= sizes[0] + 8
    equal = [sizes[0]] * (4000 // sizes[0]) + [4000 % sizes[0]] * (4000 % sizes[0] > 0)
    assert len(sizes) == pytest.approx(number_of_chunks(60.0), rel=0.05)
    for threads in (1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 64):
        fair = 4000 / threads
        assert fair <= ends(sizes, threads) <= ends(equal, threads) + sizes[-1]
        assert threads > 16 or ends(sizes, threads) < 1.02 * fair, threads


def ends(sizes, threads):
    """When the last of so many threads ends that take one chunk after the other."""
    busy = [0.0] * threads
    for size in sizes:
        busy[busy.index(min(busy))] += size
    return max(busy)
