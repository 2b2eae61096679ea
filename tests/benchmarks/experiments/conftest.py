"""Predictions of the tests are of eight motions of each kind."""

import pytest

from toppling.benchmarks.experiments import ensembles


@pytest.fixture(autouse=True)
def few_motions(monkeypatch):
    def forget():
        ensembles.motions_of.cache_clear()
        ensembles._intensities.cache_clear()

    monkeypatch.setattr(ensembles, "NUMBER", 8)
    forget()
    yield
    forget()
