"""Values from draws of pieces, against closed forms given the motions."""

import numpy as np

from toppling.benchmarks.coverage.draws_of_pieces import flags_of, number_at_least, rows


def test_numbers_given_the_motions():
    """Two lines of one and two pieces, the others anchored."""
    flags = flags_of(3, 1)
    flags[2:] = False
    one, two = flags[:2].mean(axis=1)
    together, independent = (number_at_least(flags, pieces)[:3] for pieces in ("together", "independent"))
    np.testing.assert_allclose(together[[0, 2]], [np.mean(1 - (1 - one) * (1 - two)), np.mean(one * two)])
    np.testing.assert_allclose(independent[[0, 2]], [np.mean(1 - (1 - one) * (1 - two) ** 2), np.mean(one * two**2)])


def test_rows_hold():
    found = list(rows(False))
    assert [one.motions for one in found] == [20] * 5 + [60] * 5
    for one in found:
        assert one.coverage > (0.87 if one.motions == 20 else 0.91), one
        assert not abs(one.length - 1.0) > (0.5 if one.motions == 20 else 0.25), one
