"""Small linear algebra against numpy's and scipy's."""

import numpy as np
import pytest
import scipy

from toppling.core.elementary import cholesky, eigh, expm, inverse, orthonormal, solve


@pytest.mark.parametrize("n", [1, 2, 3, 7, 24])
def test_factors_and_solutions(n):
    random = np.random.default_rng(n)
    a, right = random.normal(size=(n, n)), random.normal(size=(n, 3))
    square = a @ a.T
    np.testing.assert_allclose(cholesky(square), np.linalg.cholesky(square), rtol=1e-10, atol=1e-13)
    np.testing.assert_allclose(solve(a, right), np.linalg.solve(a, right), rtol=1e-10, atol=1e-12)
    np.testing.assert_allclose(solve(a, right[:, 0]), np.linalg.solve(a, right[:, 0]), rtol=1e-10, atol=1e-12)
    np.testing.assert_allclose(inverse(a) @ a, np.eye(n), rtol=0.0, atol=1e-11)


def test_a_pivot_of_zero_is_passed_by():
    np.testing.assert_array_equal(solve(np.array([[0.0, 1.0], [2.0, 0.0]]), np.array([3.0, 4.0])), [2.0, 3.0])


@pytest.mark.parametrize("wrong", [np.zeros((2, 2)), np.ones((3, 3)), np.array([[1.0, 2.0], [2.0, 1.0]])])
def test_no_factor_and_no_solution(wrong):
    with pytest.raises(np.linalg.LinAlgError, match="not positive definite"):
        cholesky(wrong)
    if np.linalg.matrix_rank(wrong) < len(wrong):
        with pytest.raises(np.linalg.LinAlgError, match="singular"):
            inverse(wrong)


def test_no_number_has_no_factor():
    with pytest.raises(np.linalg.LinAlgError):
        cholesky(np.array([[np.nan]]))


@pytest.mark.parametrize("n", [1, 2, 3, 8, 25])
def test_eigenvalues_and_vectors(n):
    a = np.random.default_rng(n).normal(size=(n, n))
    symmetric = a + a.T
    values, vectors = eigh(symmetric)
    np.testing.assert_allclose(values, np.linalg.eigvalsh(symmetric), rtol=1e-13, atol=1e-13 * np.abs(values).max())
    np.testing.assert_allclose(vectors.T @ vectors, np.eye(n), rtol=0.0, atol=1e-14 * n)
    np.testing.assert_allclose((vectors * values) @ vectors.T, symmetric, rtol=0.0, atol=1e-13 * np.abs(values).max())
    assert (vectors[np.abs(vectors).argmax(axis=0), range(n)] > 0.0).all()


@pytest.mark.parametrize("matrix", [np.zeros((3, 3)), np.eye(4), np.ones((5, 5)), np.diag([3.0, 1.0, 2.0])])
def test_equal_eigenvalues_and_none_to_turn(matrix):
    values, vectors = eigh(matrix)
    np.testing.assert_allclose((vectors * values) @ vectors.T, matrix, rtol=0.0, atol=1e-14)
    assert (np.diff(values) >= 0.0).all()


def test_small_eigenvalues_keep_their_digits():
    """Of a graded matrix, each eigenvalue is as exact as its size allows, which a method by Householder loses."""
    scale = np.array([1.0, 1e-4, 1e-8])
    matrix = np.array([[2.0, 1.0, 1.0], [1.0, 2.0, 1.0], [1.0, 1.0, 2.0]]) * scale[:, None] * scale
    found = eigh(matrix)[0]
    assert float(np.prod(found / scale[::-1] ** 2)) == pytest.approx(4.0, rel=1e-13)


def test_orthonormal_columns():
    columns = np.polynomial.legendre.legvander(np.linspace(-1.0, 1.0, 12), 10)
    found = orthonormal(columns)
    np.testing.assert_allclose(found.T @ found, np.eye(11), rtol=0.0, atol=1e-14)
    assert np.abs(np.tril(found.T @ columns, -1)).max() < 1e-13


def test_exponentials_of_several_matrices():
    matrices = (
        np.random.default_rng(3).normal(size=(6, 4, 4)) * np.array([0.0, 1e-9, 0.1, 1.0, 3.0, 8.0])[:, None, None]
    )
    found, expected = expm(matrices), scipy.linalg.expm(matrices)
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-12 * np.abs(expected).max())
    for one, each in zip(matrices, found, strict=True):
        # (no bit depends on the others)
        np.testing.assert_array_equal(expm(one), each)
        np.testing.assert_allclose(each, scipy.linalg.expm(one), rtol=0.0, atol=1e-13 * np.abs(each).max())
