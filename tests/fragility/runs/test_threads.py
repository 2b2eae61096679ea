"""Work that is shared between threads: in order, the same bits with any number of them, given up when asked."""

import os
import signal
from itertools import islice
from threading import Timer, enumerate as enumerate_threads, get_ident
from time import perf_counter, sleep

import numpy as np
import pytest
import xarray as xr
from dask import config
from fit_cases import clustered

import toppling as tp
from toppling.fragility import fit_fragility
from toppling.fragility.fitting.fit import CurveOptions, fit_curves
from toppling.fragility.runs import plan
from toppling.fragility.runs.plan import LONGEST, Chunk, LeftError, Work, plan_chunks, run_chunk, seconds_per_sample
from toppling.fragility.runs.runners import shared, thread_count
from toppling.motions import records as motions_of


class TestShared:
    @pytest.mark.parametrize("workers", [1, 2, 5])
    def test_in_order(self, workers):
        def of(i):
            sleep(0.002 * (i % 3))
            return i, get_ident()

        with config.set(num_workers=workers):
            assert thread_count() == workers
            found = list(shared(of, range(20)))
        assert [i for i, _ in found] == list(range(20))
        assert len({thread for _, thread in found}) <= workers

    def test_of_nothing(self):
        assert list(shared(abs, [])) == []

    def test_nothing_more_is_begun_once_the_reader_stops(self):
        begun = []

        def of(i):
            begun.append(i)
            sleep(0.01)

        with config.set(num_workers=2):
            reader = shared(of, range(1000))
            list(islice(reader, 3))
            reader.close()
        assert len(begun) < 20

    def test_errors_reach_the_reader(self):
        with config.set(num_workers=2), pytest.raises(ZeroDivisionError):
            list(shared(lambda i: 1 / i, [1, 0, 1]))


class TestFits:
    def test_same_bits_with_any_number_of_threads(self):
        runs = clustered(12, 3, 20, np.geomspace(0.3, 3.0, 6), noise=0.2).rename(study="block")
        seen = []
        with config.set(num_workers=1):
            one = fit_fragility(runs, replicates=50, keep_replicates=True)
        with config.set(num_workers=3):
            three = fit_curves(runs, CurveOptions(replicates=50), True, progress=lambda *at: seen.append(at))
        xr.testing.assert_identical(one, three)
        assert seen == [(i + 1, 3) for i in range(3)]

    def test_a_fit_of_ones_own_runs_in_the_callers_thread(self):
        threads = set()

        class Half:
            def probability(self, x):
                return np.full(np.shape(x), 0.5)

        def own(levels, overturnings, runs):
            threads.add(get_ident())
            return Half()

        runs = clustered(12, 3, 20, np.geomspace(0.3, 3.0, 6), noise=0.2).rename(study="block")
        with config.set(num_workers=3):
            fit_fragility(runs, form=own, replicates=5)
        assert threads == {get_ident()}


@pytest.fixture(scope="module")
def stiff():
    """Runs that take 0.2 s each (18 s of chunks of 3 s): most of their samples are solved in hundreds of pieces."""
    block, law = tp.Block(2.0, 19.5), tp.GianniniMasiani(e=0.9, delta=1e-9)
    shakes = np.random.default_rng(1).standard_normal((6, 3000)) * 0.3
    tp.ida(block, law, tp.motions.from_array(shakes[:1, :50], 0.01), [1.0])  # (compiled)
    return block, law, tp.motions.from_array(shakes, 0.01), np.linspace(0.5, 1.0, 15)


@pytest.mark.filterwarnings("ignore::toppling.core.doubts.ImplausibleInput")
class TestInterrupts:
    """Work that is stopped ends within 2 s, whatever a chunk of it takes."""

    SECONDS = 2.0

    @pytest.mark.slow
    def test_a_signal(self, stiff):
        """What Ctrl-C does in a script, and the thread that measures the motions has ended, too."""
        Timer(0.5, os.kill, [os.getpid(), signal.SIGINT]).start()
        begun = perf_counter()
        with pytest.raises(KeyboardInterrupt):
            tp.ida(*stiff)
        assert perf_counter() - begun < 0.5 + self.SECONDS
        assert not [thread for thread in enumerate_threads() if thread.name == "toppling-motions"]

    def test_long_motions_and_zones_in_pieces_make_smaller_chunks(self, stiff):
        block, law, motions, levels = stiff
        factors = np.ones((1, levels.size, 6))
        work = Work((law.oscillator(block),) * 100, tuple(motions_of(motions)), factors)
        longest = max(
            work.runs_of(chunk) * 3000 * seconds_per_sample(work.oscillators[0], 0.01) for chunk in plan_chunks(work)
        )
        assert longest < 2.0 * LONGEST

    @pytest.mark.slow
    def test_a_chunk_is_left_between_its_parts(self, stiff):
        block, law, motions, levels = stiff
        work = Work((law.oscillator(block),), tuple(motions_of(motions)), np.ones((1, levels.size, 6)))
        asked = []

        def left():
            asked.append(perf_counter())
            return len(asked) > 1

        with pytest.raises(LeftError):
            run_chunk(work, Chunk(0, 1, 0, 6), left)
        assert asked[1] - asked[0] < self.SECONDS

    @pytest.mark.parametrize(
        "law", [tp.HousnerImpact(), tp.EnergyConsistent(), tp.Sliding(0.2)], ids=lambda law: law.law
    )
    def test_parts_are_run_to_the_same_bits(self, law, monkeypatch):
        """Of several motions together, and of motions one by one (450 runs each)."""
        blocks = [tp.Block(0.3 + 0.01 * i, 1.6) for i in range(3)]
        shakes = tp.motions.CloughPenzien(duration=3.0, dt=0.01).sample(3)
        for levels in (4, 150):
            asked = blocks, law, shakes, np.linspace(0.5, 4.0, levels)
            whole = tp.ida(*asked)
            with monkeypatch.context() as patch:
                patch.setattr(plan, "PART_SECONDS", 1e-4)
                xr.testing.assert_identical(tp.ida(*asked), whole)
