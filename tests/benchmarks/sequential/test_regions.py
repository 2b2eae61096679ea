"""Benchmarks of pooled surfaces: what they compare is comparable."""

import numpy as np

import toppling as tp
from toppling.benchmarks.sequential import regions, sizes


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


def test_curves_of_a_grid_are_those_of_an_analysis():
    """Medians of blocks by common levels, beside `tp.ida` and `fit_fragility`; the local fit is another one."""
    x, blocks = sizes.common_grid(), regions.blocks_of(sizes.sizes())
    found = sizes.by_grid(x, False, 24, 5)[0]
    shakes = regions.MOTIONS.sample(24, seed=5)
    for k in (40, 96):
        runs = tp.ida(blocks[k], regions.LAWS[0], shakes, np.exp(x[k]), "pga", ["overturned"], screen=False)
        curve = tp.fit_fragility(runs)
        np.testing.assert_allclose(found[k], np.log(curve["median"].item()), atol=1e-6)
    near = sizes.by_grid(x, True, 24, 5)[0]
    assert 1e-4 < np.abs(near - found).max() < 0.2


def test_errors_of_known_medians():
    known = sizes.Truth(np.zeros(97), np.ones(97), np.full(13, 0.5), 0.0)

    def off_by_a_tenth(seed):
        return np.full(97, 0.5 + (0.1 if seed % 2 else -0.1)), 7, 2.0

    row = sizes.line("known", off_by_a_tenth, 10, 40, known, 4)
    assert row.split() == ["known", "0.1000", "0.1000", "10", "40", "7", "2.0"]
