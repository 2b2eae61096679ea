"""One graph of chunks: every scheduler of dask computes it with the same bytes."""

import gc
import multiprocessing.pool
import pickle
import threading

import dask
import numpy as np
import pytest
import xarray as xr
from dask.callbacks import Callback
from study_texts import crate_study

import toppling as tp
from toppling.fragility.runs import plan, runners
from toppling.fragility.runs.request import check_request, work_of
from toppling.motions.arrays import records
from toppling.studies.command.cli import main
from toppling.studies.kinds import study as studies

pytestmark = pytest.mark.lowest

BLOCKS = [tp.Block(0.3 + 0.02 * i, 1.8, name=f"block {i}") for i in range(9)]
LAWS = [tp.HousnerImpact(), tp.DiscreteDamping(e=0.9), tp.HousnerImpact(geometry="linear")]
LEVELS = np.geomspace(1.0, 12.0, 5)
SCHEDULERS = ["threads", "synchronous", pytest.param("processes", marks=pytest.mark.slow)]


@pytest.fixture(scope="module")
def shakes():
    return tp.motions.CloughPenzien(duration=6.0, dt=0.01).sample(17)


@pytest.fixture
def small_chunks(monkeypatch):
    monkeypatch.setattr(plan, "LEAST_SECONDS", 1e-3)
    monkeypatch.setattr(runners.ConfiguredScheduler, "least", 1e-3)
    monkeypatch.setattr(plan, "CHUNK_SECONDS", 1e-3)
    monkeypatch.setattr(plan, "FEWEST_TOGETHER", 4)
    monkeypatch.setattr(plan, "MOST_TOGETHER", 60)


def work_of_blocks(shakes):
    request = check_request(BLOCKS, LAWS, ("overturned", "peak_rotation"), True, None, None)
    plain = records(shakes)
    factors = np.ones((1, LEVELS.size, len(plain)))
    return work_of(request.specimens(), plain, factors, request, len(LAWS))


class TestHere:
    @pytest.mark.parametrize("scheduler", SCHEDULERS)
    def test_the_configured_scheduler_computes(self, shakes, small_chunks, scheduler):
        wanted = tp.ida(BLOCKS, LAWS, shakes, LEVELS)
        with dask.config.set(scheduler=scheduler, num_workers=2):
            xr.testing.assert_identical(tp.ida(BLOCKS, LAWS, shakes, LEVELS), wanted)

    @pytest.mark.slow
    def test_one_thread_alone(self, shakes, small_chunks, monkeypatch):
        """Also that of the measures, and those of fits."""
        seen = set()
        plain = runners.run_chunk

        def run(work, chunk, left):
            seen.add(threading.get_ident())
            return plain(work, chunk)

        monkeypatch.setattr(runners, "run_chunk", run)
        with dask.config.set(num_workers=3):
            tp.ida(BLOCKS, LAWS, shakes, LEVELS)
            assert 1 < len(seen) <= 3
        seen.clear()
        monkeypatch.setattr(threading.Thread, "start", refuse_other_threads(threading.Thread.start, "toppling-graph"))
        with dask.config.set(scheduler="synchronous"):
            assert runners.thread_count() == 1
            tp.fit_fragility(tp.ida(BLOCKS, LAWS, shakes, LEVELS))
        assert len(seen) == 1

    @pytest.mark.slow
    def test_an_executor(self, shakes, small_chunks):
        from concurrent.futures import ThreadPoolExecutor

        wanted = tp.ida(BLOCKS, LAWS, shakes, LEVELS)
        with ThreadPoolExecutor(3, "of the user") as pool:
            with dask.config.set(scheduler=pool):
                xr.testing.assert_identical(tp.ida(BLOCKS, LAWS, shakes, LEVELS), wanted)
            with dask.config.set(pool=pool):
                xr.testing.assert_identical(tp.ida(BLOCKS, LAWS, shakes, LEVELS), wanted)
            assert any(thread.name.startswith("of the user") for thread in threading.enumerate())

    def test_a_scheduler_of_ones_own(self, shakes, small_chunks, monkeypatch):
        """One that knows nothing of callbacks, in windows; and one that leaves something out is not believed."""
        monkeypatch.setattr(runners, "WINDOW_ELSEWHERE", 5)
        wanted = tp.ida(BLOCKS, LAWS, shakes, LEVELS)
        sizes = []

        def own(graph, keys, **_):
            sizes.append(len(keys))
            return dask.get(graph, keys)

        with dask.config.set(scheduler=own, num_workers=2):
            xr.testing.assert_identical(tp.ida(BLOCKS, LAWS, shakes, LEVELS), wanted)
        assert sizes[0] == 10
        assert len(sizes) > 2
        incomplete = dask.config.set(scheduler=lambda graph, keys, **_: dask.get(graph, keys[1:]))
        with incomplete, pytest.raises(RuntimeError, match="the scheduler returned"):
            tp.ida(BLOCKS, LAWS, shakes, LEVELS)

    @pytest.mark.parametrize("name", ["no such one", "distributed"])
    def test_a_scheduler_that_there_is_not(self, shakes, name):
        with dask.config.set(scheduler=name), pytest.raises(ValueError, match="names an unknown scheduler"):
            tp.ida(BLOCKS, LAWS, shakes, LEVELS)

    @pytest.mark.parametrize("number", [0, -1, 2.5, "2", True])
    def test_a_number_of_workers_that_is_none(self, shakes, number):
        with dask.config.set(num_workers=number), pytest.raises(ValueError, match="dask's num_workers must be a whole"):
            tp.ida(BLOCKS, LAWS, shakes, LEVELS)

    def test_a_pool_that_is_none(self, shakes):
        with multiprocessing.pool.ThreadPool(2) as pool, dask.config.set(pool=pool):
            assert tp.ida(BLOCKS, LAWS, shakes, LEVELS)["overturned"].any()
        with dask.config.set(pool=3), pytest.raises(ValueError, match="dask's pool must be an executor"):
            tp.ida(BLOCKS, LAWS, shakes, LEVELS)

    def test_the_command_refuses_a_configuration_before_it_reads(self, capsys):
        with dask.config.set(scheduler="wrong"):
            assert main(["run", "missing.toml"]) == 2
        assert "an unknown scheduler" in capsys.readouterr().err

    def test_in_the_order_of_the_plan(self, shakes, small_chunks, monkeypatch):
        """The last chunks are the shortest, whatever order dask would take."""
        seen = []
        plain = runners.run_chunk
        monkeypatch.setattr(runners, "run_chunk", lambda work, chunk, left: (seen.append(chunk), plain(work, chunk))[1])
        with dask.config.set(scheduler="synchronous"):
            tp.ida(BLOCKS, LAWS, shakes, LEVELS)
        assert seen == plan.plan_chunks(work_of_blocks(shakes))
        assert len(seen) > 20

    def test_in_several_windows(self, shakes, small_chunks, monkeypatch):
        wanted = tp.ida(BLOCKS, LAWS, shakes, LEVELS)
        monkeypatch.setattr(runners, "WINDOW", 3)
        xr.testing.assert_identical(tp.ida(BLOCKS, LAWS, shakes, LEVELS), wanted)

    @pytest.mark.slow
    def test_memory_is_bounded_where_the_caller_is_slow(self, shakes, small_chunks, monkeypatch):
        """No more chunks are computed than wait to be taken, or are in flight."""
        begun = []
        plain = runners.run_chunk
        monkeypatch.setattr(
            runners, "run_chunk", lambda work, chunk, left: (begun.append(chunk), plain(work, chunk))[1]
        )
        work = work_of_blocks(shakes)
        chunks = plan.plan_chunks(work)
        with dask.config.set(num_workers=2):
            taken = runners.ConfiguredScheduler().run(work, chunks)
            next(taken)
            threading.Event().wait(0.5)
            assert len(begun) <= 1 + 4 * runners.AHEAD * 2 < len(chunks)
            taken.close()
        assert len(begun) < len(chunks)
        assert not [one for one in threading.enumerate() if one.name == "toppling-graph"]

    @pytest.mark.parametrize("scheduler", ["threads", "synchronous"])
    def test_what_was_run_is_freed_at_once(self, shakes, scheduler):
        """Analyses one after the other do not hold each other's motions until garbage is collected."""
        with dask.config.set(scheduler=scheduler):
            gc.collect()
            gc.disable()
            try:
                tp.ida(BLOCKS[:2], LAWS[:1], shakes, LEVELS)
                assert not [one for one in gc.get_objects() if isinstance(one, plan.Work | runners._Window)]
            finally:
                gc.enable()

    def test_errors_reach_the_caller(self, shakes, small_chunks, monkeypatch):
        def fails(work, chunk, left):
            raise MemoryError("no room")

        monkeypatch.setattr(runners, "run_chunk", fails)
        with pytest.raises(MemoryError, match="no room"):
            tp.ida(BLOCKS, LAWS, shakes, LEVELS)

    def test_who_looks_on(self, shakes, small_chunks):
        """Callbacks of dask, such as its progress bar, are called with the tasks."""
        seen = []
        with Callback(posttask=lambda key, *_: seen.append(key)):
            tp.ida(BLOCKS, LAWS, shakes, LEVELS)
        assert len(seen) == len(plan.plan_chunks(work_of_blocks(shakes)))

    @pytest.mark.slow
    @pytest.mark.parametrize("scheduler", SCHEDULERS)
    def test_a_study_is_stopped_and_goes_on(self, tmp_path, small_chunks, scheduler):
        (tmp_path / "study.toml").write_text(crate_study("Dask", 12, 6, 0.02, 5), encoding="utf-8")
        study = tp.Study.from_toml(tmp_path / "study.toml")
        wanted = study.run(tmp_path / "whole")

        def stop(done, total):
            if done > total / 3:
                raise KeyboardInterrupt

        with dask.config.set(scheduler=scheduler, num_workers=2):
            with pytest.raises(KeyboardInterrupt, match="runs kept in"):
                study.run(tmp_path / "out", progress=stop)
            watches = []
            found = study.run(tmp_path / "out", watching=watches.append)
        assert watches[0].kept > 0
        xr.testing.assert_identical(found, wanted)
        assert (tmp_path / "out/results.nc").read_bytes() == (tmp_path / "whole/results.nc").read_bytes()


def refuse_other_threads(start, name):
    def of(self):
        assert self.name == name, self.name
        start(self)

    return of


class TestElsewhere:
    def test_a_task_takes_its_own_data_alone(self, shakes):
        work = work_of_blocks(shakes)
        first, *_ = chunks = plan.plan_chunks(work, 0.002)
        assert len(chunks) > 2
        task = runners.ChunkTask(work, first)
        sent = pickle.dumps(task)
        own = sum(one.acceleration.nbytes for one in work.motions[first.first : first.stop])
        assert len(sent) < own + 60_000
        for one, other in zip(pickle.loads(sent)().results, task().results, strict=True):
            np.testing.assert_array_equal(one, other)

    def test_another_engine_is_refused(self, shakes, monkeypatch):
        work = work_of_blocks(shakes)
        sent = pickle.dumps(runners.ChunkTask(work, plan.plan_chunks(work)[0]))
        here = runners.engine_identity()
        monkeypatch.setattr(runners, "engine_identity", lambda: {**here, "processor": "other"})
        with pytest.raises(ValueError, match=r"a worker has processor other, this process .*: compile for the same"):
            pickle.loads(sent)()

    @pytest.mark.slow
    def test_a_cluster(self, shakes, tmp_path):
        """A default client computes analyses and studies."""
        from distributed import Client, LocalCluster

        def inside(shakes):  # (here, so that it is sent as it is: a worker cannot import this module)
            assert runners.default_client() is None
            return tp.ida(BLOCKS[:1], LAWS, shakes, LEVELS)["overturned"].values

        wanted = tp.ida(BLOCKS, LAWS, shakes, LEVELS)
        (tmp_path / "study.toml").write_text(crate_study("Dask", 12, 6, 0.02, 5), encoding="utf-8")
        alone = tp.Study.from_toml(tmp_path / "study.toml").run()
        with LocalCluster(2, threads_per_worker=1, dashboard_address=None) as cluster, Client(cluster) as client:
            assert runners.default_client() is client
            assert studies.default_client() is client
            xr.testing.assert_identical(tp.ida(BLOCKS, LAWS, shakes, LEVELS), wanted)
            xr.testing.assert_identical(tp.Study.from_toml(tmp_path / "study.toml").run(), alone)
            # (a task of a worker computes on threads of its own, and does not wait for itself)
            inner = client.submit(inside, shakes).result(timeout=120)
            np.testing.assert_array_equal(inner, wanted["overturned"].values[:1])
        assert runners.default_client() is None
