"""Sparse symmetric matrices against dense ones."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from radiosity_baker.core.symmetric_matrix import SymmetricMatrix, SymmetricPattern, conjugate_gradients


def random_system(seed: int, count: int, crowded: bool) -> np.ndarray:
    """Symmetric positive definite, sparse, with one row that is full if crowded, and one without weight."""
    rng = np.random.default_rng(seed)
    matrix = rng.normal(size=(count, count)) * (rng.random((count, count)) < 0.1)
    if crowded:
        matrix[count // 2] = rng.normal(size=count)
    matrix = matrix + matrix.T
    matrix += np.diag(np.abs(matrix).sum(axis=1) + 0.1)
    matrix[-1] = matrix[:, -1] = 0
    return matrix


def sparse(matrix: np.ndarray) -> SymmetricMatrix:
    pairs = np.argwhere(np.triu(matrix, 1))
    return SymmetricMatrix(SymmetricPattern(len(matrix), pairs), np.diag(matrix).copy(), matrix[tuple(pairs.T)])


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 10**6), st.integers(2, 120), st.booleans())
def test_the_padded_matrix_is_the_dense_one(seed, count, crowded):
    """Rows wider than what is kept in line included."""
    matrix = random_system(seed, count, crowded)
    x = np.random.default_rng(seed).normal(size=(count, 3))
    assert sparse(matrix) @ x == pytest.approx(matrix @ x, abs=1e-10)


def test_more_rows_than_a_chunk():
    count = 20_000
    chain = np.column_stack([np.arange(count - 1), np.arange(1, count)])
    matrix = SymmetricMatrix(SymmetricPattern(count, chain), np.full(count, 2.0), np.full(count - 1, -1.0))
    straight = np.arange(count, dtype=float)[:, None]
    assert (matrix @ straight)[1:-1] == pytest.approx(0.0, abs=1e-9)
    assert (matrix @ straight)[[0, -1], 0].tolist() == [-1, count]


def test_values_of_one_pair_add_up():
    matrix = SymmetricMatrix(SymmetricPattern(2, np.array([[0, 1], [0, 1]])), np.zeros(2), np.array([1.0, 2.0]))
    assert (matrix @ np.eye(2)).tolist() == [[0, 3], [3, 0]]


@pytest.mark.parametrize("crowded", [False, True])
def test_conjugate_gradients_agree_with_elimination(crowded):
    matrix = random_system(8, 60, crowded)
    target = np.random.default_rng(9).normal(size=(60, 4))
    target[-1] = 0
    start = np.full((60, 4), 0.5)
    solved = conjugate_gradients(sparse(matrix), target, start, 1e-13, 2000)
    assert solved[:-1] == pytest.approx(np.linalg.solve(matrix[:-1, :-1], target[:-1]), abs=1e-9)
    assert (solved[-1] == 0.5).all(), "a row without weight keeps its start"
    assert (start == 0.5).all(), "the start is the caller's"


@pytest.mark.parametrize("tolerance", [1e-2, 1e-5])
def test_conjugate_gradients_stop_at_their_tolerance(tolerance):
    """The energy of the scaled residual, relative to that of the target, is below the square of the tolerance."""
    matrix = random_system(10, 60, crowded=False)[:-1, :-1]
    target = np.random.default_rng(9).normal(size=(59, 1))
    residual = target - matrix @ conjugate_gradients(sparse(matrix), target, np.zeros((59, 1)), tolerance, 100)
    scale = 1 / np.diag(matrix)
    assert (scale @ residual**2)[0] <= tolerance**2 * (scale @ target**2)[0] * (1 + 1e-6)
