"""Sparse rows against dense matrices, and what balancing promises."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from radiosity_baker.core.form_factors.rows import Rows, balance, symmetric_exchange
from radiosity_baker.core.parallel import Workers
from radiosity_baker.core.progress import Progress


def sparse(matrix: np.ndarray) -> Rows:
    row, column = np.nonzero(matrix)
    return Rows.from_triplets(row, column, matrix[row, column], len(matrix))


def dense(rows: Rows, width: int) -> np.ndarray:
    matrix = np.zeros((len(rows), width))
    np.add.at(matrix, (rows.owners(), rows.columns), rows.weights)
    return matrix


def random_matrix(seed: int, count: int, width: int, filled: float = 0.3) -> np.ndarray:
    """Representable in float32, with some empty rows and columns."""
    rng = np.random.default_rng(seed)
    matrix = rng.random((count, width)) * (rng.random((count, width)) < filled)
    matrix[rng.random(count) < 0.2] = 0
    return matrix.astype(np.float32).astype(np.float64)


def closed_box(seed: int, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Exchange areas of `count` patches of the inside of a sphere: F_ij = A_j / A_total, exactly."""
    area = np.random.default_rng(seed).uniform(0.5, 2.0, count)
    return area[:, None] * area / area.sum(), area


@settings(max_examples=50, deadline=None)
@given(seed=st.integers(0, 10**6), count=st.integers(1, 40), width=st.integers(1, 40))
def test_is_the_dense_matrix(seed: int, count: int, width: int) -> None:
    matrix = random_matrix(seed, count, width)
    rows = sparse(matrix)
    x = np.random.default_rng(seed).normal(size=(width, 3))
    assert rows.apply(x) == pytest.approx(matrix @ x, abs=1e-12)
    assert rows.apply(x[:, 0]) == pytest.approx(matrix @ x[:, 0], abs=1e-12)
    assert rows.row_sums() == pytest.approx(matrix.sum(1), abs=1e-12)
    assert (dense(rows, width) == matrix).all()


def test_entries_of_one_place_add_up() -> None:
    rows = Rows.from_triplets([2, 0, 2, 2], [1, 0, 1, 0], [0.25, 1.0, 0.5, 2.0], 4)
    assert dense(rows, 2).tolist() == [[1, 0], [0, 0], [2, 0.75], [0, 0]]


def test_no_entries_at_all() -> None:
    rows = Rows.from_triplets([], [], [], 3)
    assert rows.apply(np.ones((5, 2))).tolist() == [[0, 0]] * 3
    assert balance(rows, np.ones(3)).apply(np.arange(3.0)).tolist() == [0, 1, 2], "all light returns to where it was"
    assert (balance(rows, np.zeros(3)).weights == 0).all()


def test_threads_give_the_same_bytes() -> None:
    rows = sparse(random_matrix(4, 900, 900))
    x = np.random.default_rng(1).normal(size=(900, 3))
    with Workers(2, Progress()) as two:
        assert rows.apply(x, two).tobytes() == rows.apply(x).tobytes()


def test_exchange_weighs_directions_by_their_density_of_samples() -> None:
    """A patch of four times the area and the same rays is sampled four times less densely."""
    forward, backward = 0.5, 0.01
    rows = sparse(np.array([[0, forward], [backward, 0]]))
    exchange = dense(symmetric_exchange(rows, [1.0, 4.0], 64), 2)
    expected = 0.8 * forward * 1.0 + 0.2 * backward * 4.0
    assert exchange == pytest.approx(np.array([[0, expected], [expected, 0]]), rel=1e-6)


def test_exchange_is_symmetric_and_keeps_what_is_reciprocal_already() -> None:
    exact, area = closed_box(1, 30)
    rays = np.random.default_rng(2).integers(1, 100, 30)
    exchange = dense(symmetric_exchange(sparse(exact / area[:, None]), area, rays), 30)
    assert (exchange == exchange.T).all()
    assert exchange == pytest.approx(exact, rel=1e-6)


@settings(max_examples=50, deadline=None)
@given(seed=st.integers(0, 10**6), noise=st.floats(0.0, 0.9))
def test_balance_closes_a_noisy_box(seed: int, noise: float) -> None:
    exact, area = closed_box(seed, 25)
    wrong = 1 + noise * np.random.default_rng(seed).uniform(-1, 1, exact.shape)
    balanced = balance(sparse(exact * (wrong + wrong.T) / 2), area)
    assert balanced.row_sums() == pytest.approx(area, rel=2e-6)
    assert (balanced.row_sums() <= area * (1 + 1e-7)).all()
    assert (dense(balanced, 25) == dense(balanced, 25).T).all()


@settings(max_examples=50, deadline=None)
@given(seed=st.integers(0, 10**6), noise=st.floats(0.0, 0.9))
def test_balance_closes_exactly_what_scaling_cannot(seed: int, noise: float) -> None:
    """A small patch alone among large ones: no scaling fills its row and theirs at once, the diagonal does."""
    exact, area = closed_box(seed, 25)
    exact[0, 2:] = exact[2:, 0] = 0.0
    exact[0, 0] = 0.0
    target = np.where(np.arange(25) == 0, 40.0 / 3.0, area)
    wrong = 1 + noise * np.random.default_rng(seed).uniform(-1, 1, exact.shape)
    balanced = balance(sparse(exact * (wrong + wrong.T) / 2), target)
    weights = dense(balanced, 25)
    assert weights.sum(1) == pytest.approx(target, rel=1e-6)
    assert (weights == weights.T).all()
    assert (weights >= 0).all()
    assert weights[0, 0] > 0.9 * (target[0] - area[1])
    # A third is no number of single precision: at albedo 0.9999 what it is off by would count ten thousand times.
    assert balanced.row_sums()[0] == pytest.approx(target[0], rel=1e-10)


@settings(max_examples=100, deadline=None)
@given(seed=st.integers(0, 10**6), count=st.integers(1, 12))
def test_balance_never_exceeds_its_targets_nor_breaks(seed: int, count: int) -> None:
    """Whatever the pattern, targets of zero and targets that nothing can reach included."""
    matrix = random_matrix(seed, count, count)
    target = np.random.default_rng(seed).choice([0.0, 1e-9, 0.3, 1.0, 50.0], count)
    balanced = balance(sparse(np.triu(matrix) + np.triu(matrix, 1).T), target)
    weights = dense(balanced, count)
    assert np.isfinite(weights).all()
    assert (weights >= 0).all()
    assert (weights == weights.T).all()
    assert (weights.sum(1) <= target * (1 + 1e-6)).all()
    assert (weights[target == 0] == 0).all()
