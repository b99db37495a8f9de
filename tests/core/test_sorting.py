"""Places sorted by whole numbers, as numpy sorts them."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_baker.core.sorting import distinct, renumbered, stable_order


@pytest.mark.parametrize("most", [1, 7, 2**40, 2**62])
@pytest.mark.parametrize("count", [0, 1, 1000])
def test_order_is_that_of_a_stable_sort(count, most):
    """Up to numbers that leave no bits for where they stand."""
    numbers = np.random.default_rng(1).integers(0, most, count)
    assert np.array_equal(stable_order(numbers), np.argsort(numbers, kind="stable"))


@pytest.mark.parametrize("kind", [np.int32, np.int64])
def test_distinct_numbers_first_places_and_inverse(kind):
    numbers = np.random.default_rng(2).integers(0, 50, 300).astype(kind)
    found, expected = distinct(numbers), np.unique(numbers, return_index=True, return_inverse=True)
    assert all(np.array_equal(one, other) for one, other in zip(found, expected, strict=True))
    assert found[0].dtype == kind


@pytest.mark.parametrize("count", [0, 300])
def test_labels_are_counted_through_without_gaps(count):
    labels = np.random.default_rng(3).integers(0, 500, count)
    assert np.array_equal(renumbered(labels), np.unique(labels, return_inverse=True)[1])
