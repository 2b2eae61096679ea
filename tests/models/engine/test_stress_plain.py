"""The engine as plain Python (NUMBA_DISABLE_JIT=1): the same answers, and no function that no run needs."""

from pathlib import Path

import pytest
from plain_selection import plain_selection, without_compiler
from stress_cases import (
    IMPACTS,
    OVERTURNED,
    PEAK,
    UPLIFTED,
)

from toppling.models.engine import tables


@pytest.mark.slow
def test_plain_python():
    """NUMBA_DISABLE_JIT=1: the same flags and peaks for every law, and no function of the engine left unused."""
    plain, unused = without_compiler(plain_selection, Path(tables.__file__).parent)
    compiled = plain_selection()
    for one, other in zip(plain, compiled, strict=True):
        assert (one[OVERTURNED], one[UPLIFTED], one[IMPACTS]) == (other[OVERTURNED], other[UPLIFTED], other[IMPACTS])
        # (no peak: the run is airborne)
        assert one[PEAK] == (None if other[PEAK] is None else pytest.approx(other[PEAK], rel=1e-10))
    assert unused == set()
