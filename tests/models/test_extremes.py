"""Random tries at the ends of all ranges; many more with ``python tests/support/extremes.py FIRST NUMBER``."""

import numpy as np
import pytest
from extremes import attempt, draw_block
from stress_cases import compile_engine


@pytest.fixture(scope="module", autouse=True)
def compiled():
    compile_engine()


@pytest.mark.slow
@pytest.mark.parametrize("first", range(0, 30, 10))
def test_numbers_or_one_sentence(first):
    """Flags do not depend on skips, order, company or side; nothing takes longer than 20 s."""
    ends = [attempt(number)[0] for number in range(first, first + 10)]
    assert "numbers" in ends


@pytest.mark.slow
@pytest.mark.parametrize("number", [369, 927, 266, 4491])
def test_found_before(number):
    """Runs that did not end, took 15 s, fell at no known time, or fell beside a restraint that never breaks."""
    end, seconds = attempt(number)
    assert end == "numbers" or "too fast for" in end or "both corners" in end or "too stiff for" in end
    assert seconds < 20.0


def test_a_try_is_decided_by_its_number():
    assert draw_block(np.random.default_rng(3)) == draw_block(np.random.default_rng(3))
