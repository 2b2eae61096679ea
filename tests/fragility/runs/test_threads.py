"""Work that is shared between threads: in order, the same bits with any number of them, given up when asked."""

from itertools import islice
from threading import get_ident
from time import sleep

import numpy as np
import pytest
import xarray as xr
from dask import config
from fit_cases import clustered

from toppling.fragility import fit_fragility
from toppling.fragility.runs.runners import shared, thread_count


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
            three = fit_fragility(runs, replicates=50, keep_replicates=True, progress=lambda *at: seen.append(at))
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
