"""Numbers by which points, cells and edges are known again: where they are and which way they face."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .patches import Cells
from .scene import Bool, Float64
from .tessellation import Int64

#: Irrational, so that no sum of places on a grid is another's.
_MIX = np.sqrt([2.0, 3.0, 5.0])


def mixed(vectors: Float64) -> Float64:
    """A number (n,) for each of some vectors (n, 3), which hardly two of them share."""
    x, y, z = vectors.T
    return np.asarray(_MIX[0] * x + _MIX[1] * y + _MIX[2] * z)


def key(corners: Sequence[Float64] | Float64, normals: Float64) -> Float64:
    """A number (n,) for what has corners (k, n, 3), in whichever order, and normals (n, 3).

    Sums that are not of squares would be the same for both diagonals of a square.
    """
    squares = np.sort([mixed(corner) ** 2 for corner in corners], axis=0)
    return np.asarray(squares.sum(axis=0) + mixed(normals))


def same_cells(cells: Cells, earlier: Cells) -> tuple[Int64, Int64]:
    """The cells (n,) that are also among earlier ones, and their numbers (n,) there."""
    here, there = (key(c.corners.swapaxes(0, 1), c.normals) for c in (cells, earlier))
    order = np.argsort(there)
    at = np.minimum(np.searchsorted(there, here, sorter=order), len(there) - 1)
    same = np.flatnonzero(there[order[at]] == here)
    return same, order[at[same]]


class Known:
    """What has been found somewhere, by keys: most of it is asked for again after some cells were split."""

    def __init__(self, columns: int) -> None:
        self._keys, self._found = np.zeros(0), np.zeros((columns, 0))

    def recall(self, keys: Float64) -> tuple[Bool, Float64]:
        """Which of the keys (n,) are known, and what (columns, m) was found at those."""
        at = np.searchsorted(self._keys, keys)
        known = np.zeros(len(keys), dtype=bool)
        inside = at < len(self._keys)
        known[inside] = self._keys[at[inside]] == keys[inside]
        return known, self._found[:, at[known]]

    def look_up(self, keys: Float64, find: Callable[[Bool], NDArray[Any]]) -> Float64:
        """What is known (n,) at the keys (n,), of one column; where nothing is yet (n,), what is found there now."""
        known, (recalled,) = self.recall(keys)
        values = np.empty(len(keys))
        values[known] = recalled
        if not known.all():
            values[~known] = found = find(~known)
            self.remember(keys[~known], [found])
        return values

    def remember(self, keys: Float64, found: Sequence[NDArray[Any]]) -> None:
        self._keys, first = np.unique(np.concatenate([self._keys, keys]), return_index=True)
        self._found = np.concatenate([self._found, found], axis=1)[:, first]
