"""Products in one order: values, and bits that depend neither on the layout of arrays nor on other rows' company."""

import numpy as np
import pytest

from toppling.core.elementary import crossed, squares


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


@pytest.mark.parametrize("shape", [(0, 3), (1, 1), (400, 15)])
def test_squares_are_variances_of_the_rows(shape):
    random = np.random.default_rng(sum(shape))
    rows, root = random.normal(size=shape), random.normal(size=(shape[1], shape[1]))
    by_hand = np.array([row @ (root @ root.T) @ row for row in rows]).reshape(shape[0])
    np.testing.assert_allclose(squares(rows, root @ root.T), by_hand, rtol=1e-12)
    np.testing.assert_array_equal(squares(np.asfortranarray(rows), root @ root.T), squares(rows, root @ root.T))
    # (one row has the same bits alone)
    np.testing.assert_array_equal(squares(rows, root @ root.T)[:1], squares(rows[:1], root @ root.T))


def test_squares_that_rounding_leaves_below_zero_are_zero():
    assert squares(np.array([[1.0, -1.0]]), np.array([[1.0, 1.0 + 1e-15], [1.0, 1.0]])).tolist() == [0.0]
