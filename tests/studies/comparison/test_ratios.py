"""Ratios of two numbers by their replicates: too few motions decide nothing."""

import math

import numpy as np
import pytest

from toppling.studies.comparison.ratios import ratio_of, verdict_of


@pytest.mark.parametrize(("motions", "verdict"), [(1, ""), (2, ""), (3, ""), (8, "higher")])
def test_a_few_motions_decide_nothing(motions, verdict):
    """The resamples in which nothing falls are not left out, which would make the rest look certain."""
    rng = np.random.default_rng(1)
    fell = np.arange(60) < motions
    drawn = rng.multinomial(60, np.full(60, 1 / 60), 2000) @ fell / 60.0
    ratio = ratio_of(1.0e-3, 1.1e-3, 1.0e-3 * drawn, 1.1e-3 * drawn, 0.95)
    assert ratio.value == pytest.approx(1.1)
    assert verdict_of(ratio) == verdict
    assert math.isnan(ratio.lower) == (verdict == "")
