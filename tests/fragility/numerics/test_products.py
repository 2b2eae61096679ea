"""Products in one order: values, and bits that depend neither on the layout of arrays nor on other rows' company."""

import numpy as np
import pytest

from toppling.fragility.numerics.products import crossed


@pytest.mark.parametrize("shape", [(1, 1, 1), (7, 3, 2), (500, 15, 15)])
def test_crossed_is_the_sum_of_the_rows_one_after_the_other(shape):
    random = np.random.default_rng(sum(shape))
    one, other = random.normal(size=shape[:2]), random.normal(size=(shape[0], shape[2]))
    found = np.zeros(shape[1:])
    for row, its in zip(one, other, strict=True):
        found += row[:, None] * its
    np.testing.assert_array_equal(crossed(one, other), found)
    np.testing.assert_array_equal(crossed(np.asfortranarray(one), np.asfortranarray(other)), found)
    np.testing.assert_allclose(crossed(one, other), one.T @ other, rtol=1e-12, atol=1e-12)


def test_crossed_without_rows_is_zero():
    np.testing.assert_array_equal(crossed(np.empty((0, 2)), np.empty((0, 3))), np.zeros((2, 3)))
