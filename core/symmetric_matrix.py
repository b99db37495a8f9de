"""Sparse symmetric matrices whose entries fall on pairs of neighbours, and the solution of systems with them."""

from __future__ import annotations

import numpy as np

from .scene import Bool, Float64
from .tessellation import Int64

#: Share of the rows that are kept in line whole; what longer rows have beyond that width is kept aside.
_IN_LINE = 0.98
#: What rounding leaves of a residual, relative to the target.
_ROUNDING = 1e-12
#: Rows a chunk of the product: its terms stay in the processor's caches.
_CHUNK_ROWS = 8192


class SymmetricPattern:
    """Where a symmetric matrix has entries: on its diagonal, and at (i, j) and (j, i) for each pair (m, 2).

    A pair that is named twice counts twice. Found once, it serves every set of values.
    """

    def __init__(self, count: int, pairs: Int64) -> None:
        row, column = pairs.T.ravel(), pairs[:, ::-1].T.ravel()
        order = np.argsort(row, kind="stable")
        length = np.bincount(row, minlength=count)
        width = max(int(np.quantile(length, _IN_LINE, method="higher")), 1) if count else 1
        place = np.arange(len(row)) - np.repeat(np.cumsum(length) - length, length)
        row, column, pair = row[order], column[order], order % max(len(pairs), 1)
        inside = place < width
        self.columns = np.zeros((count, width), dtype=np.int64)
        # Places that no pair fills take a value behind the last pair's, which is zero.
        self.pair = np.full((count, width), len(pairs), dtype=np.int64)
        self.columns[row[inside], place[inside]] = column[inside]
        self.pair[row[inside], place[inside]] = pair[inside]
        self.beyond = row[~inside], column[~inside], pair[~inside]


class SymmetricMatrix:
    """Values on a pattern: diagonal (n,), and one value (m,) for each pair."""

    def __init__(self, pattern: SymmetricPattern, diagonal: Float64, values: Float64) -> None:
        self.diagonal = diagonal
        self._columns = pattern.columns
        self._values = np.append(values, 0.0)[pattern.pair]
        row, column, pair = pattern.beyond
        self._rest = row, column, values[pair]

    def __matmul__(self, x: Float64) -> Float64:
        """(n, k) to (n, k)."""
        row, column, value = self._rest
        product = np.empty_like(x)
        terms = np.empty((_CHUNK_ROWS, self._columns.shape[1]))
        for k in range(x.shape[1]):
            channel = np.ascontiguousarray(x[:, k])
            image = self.diagonal * channel
            for start in range(0, len(channel), _CHUNK_ROWS):
                part = slice(start, start + _CHUNK_ROWS)
                columns = self._columns[part]
                # Clipping never happens; it only spares numpy a copy of what it takes.
                taken = np.take(channel, columns, out=terms[: len(columns)], mode="clip")
                image[part] += np.einsum("vw,vw->v", self._values[part], taken)
            if len(row):
                image += np.bincount(row, value * channel[column], len(channel))
            product[:, k] = image
        return product


def conjugate_gradients(
    matrix: SymmetricMatrix,
    target: Float64,
    start: Float64,
    tolerance: float,
    most: int,
    held: Bool | None = None,
) -> Float64:
    """Solve matrix x = target (n, k) with Jacobi scaling, in at most `most` steps.

    start (n, k): where to begin; rows without weight keep it, and so do held (n, k) values. tolerance: of the energy
    norm of the scaled residual, relative to that of the target.
    """
    diagonal = matrix.diagonal
    inverse = np.where(diagonal > 0, 1.0 / np.where(diagonal > 0, diagonal, 1.0), 0.0)[:, None]
    rounding = _ROUNDING**2 * np.einsum("vk,vk->k", target, inverse * target)
    if held is not None:
        inverse = np.where(held, 0.0, inverse)
    x = start.copy()
    residual = target - matrix @ x
    scaled = inverse * residual
    direction = scaled.copy()
    energy = np.einsum("vk,vk->k", residual, scaled)
    enough = np.maximum(tolerance**2 * np.einsum("vk,vk->k", target, inverse * target), rounding)
    for _ in range(most):
        if (energy <= enough).all():
            break
        image = matrix @ direction
        # A channel that is solved to rounding rests while others go on: what is left of it points nowhere.
        step = energy / np.maximum(np.einsum("vk,vk->k", direction, image), np.finfo(float).tiny)
        step *= energy > rounding
        x += step * direction
        image *= step
        residual -= image
        np.multiply(inverse, residual, out=scaled)
        fresh = np.einsum("vk,vk->k", residual, scaled)
        direction *= fresh / np.maximum(energy, np.finfo(float).tiny)
        direction += scaled
        energy = fresh
    return x
