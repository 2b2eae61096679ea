"""Benchmarks of pooled surfaces and of rates without a form: what they compare is comparable."""

import numpy as np

from toppling.benchmarks.sequential import regions, strata


def test_regions_are_functions_of_their_seed_and_hold_what_is_tested():
    one, other = regions.region(200, 1), regions.region(200, 1)
    np.testing.assert_array_equal(one.width, other.width)
    slender, size = np.tan(one.alpha), one.R
    assert slender.min() >= 1 / 8
    assert slender.max() <= 1 / 2.5
    assert size.min() >= 0.3
    assert size.max() <= 2.0
    inside = regions._inside(one, regions.region(50, 2))
    assert np.ptp(np.log(inside.R)) < 0.95 * np.log(2.0 / 0.3)
    blocks = regions.blocks_of(inside)
    np.testing.assert_allclose([block.p for block in blocks], inside.p, rtol=1e-14)


def test_drawn_levels_have_no_bias_and_few_shared_ones_have():
    found = {one.name: one for one in strata.biases(3.0, 400)}
    for name in ("3 drawn", "10 drawn", "20 drawn"):
        assert abs(found[name].value) < 4.0 * found[name].error
    assert found["20 drawn"].error < found["3 drawn"].error
    assert found["5 shared"].value < -0.2
