"""Chunks as small as parts of a small study are."""

import pytest

from toppling.fragility.runs import plan


@pytest.fixture
def small_chunks(monkeypatch):
    for name in ("LEAST_SECONDS", "CHUNK_SECONDS"):
        monkeypatch.setattr(plan, name, 0.002)
