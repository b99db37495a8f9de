"""Sparse symmetric matrices whose entries fall on pairs of neighbours, and the solution of systems with them."""

from __future__ import annotations

import numpy as np

from .scene import Bool, Float64, Int32
from .sorting import stable_order
from .tessellation import Int64

#: What rounding leaves of a residual, relative to the target.
_ROUNDING = 1e-12
#: Places for entries in a block of rows: what is done with them stays in the processor's caches.
_BLOCK = 1 << 15


class SymmetricPattern:
    """Where a symmetric matrix has entries: on its diagonal, and at (i, j) and (j, i) for each pair (m, 2).

    A pair that is named twice counts twice. Found once, it serves every set of values. The rows lie in blocks of nearly
    equal length, the longest first; blocks: for each place (w, r) of their entries the column, and the pair that holds
    the value. Places that no pair fills take one behind the last pair's, which is zero. rank (n,): where a row lies.
    """

    def __init__(self, count: int, pairs: Int64) -> None:
        row, column = pairs.T.ravel(), pairs[:, ::-1].T.ravel()
        order = stable_order(row)
        # One more, for the places that are not filled.
        column, pair = np.append(column[order], 0), np.append(order % max(len(pairs), 1), len(pairs)).astype(np.int32)
        length = np.bincount(row, minlength=count)
        first = np.cumsum(length) - length
        longest = stable_order(length.max(initial=0) - length)
        self.rank = stable_order(longest)
        self.blocks: list[tuple[Int64, Int32]] = []
        while len(longest):
            places = np.arange(length[longest[0]])[:, None]
            rows, longest = np.split(longest, [max(_BLOCK // max(len(places), 1), 1)])
            entry = np.where(places < length[rows], first[rows] + places, len(order))
            self.blocks.append((column[entry], pair[entry]))


class SymmetricMatrix:
    """Values on a pattern: diagonal (n,), and one value (m,) for each pair."""

    def __init__(self, pattern: SymmetricPattern, diagonal: Float64, values: Float64) -> None:
        self.diagonal = diagonal
        self._rank = pattern.rank
        values = np.append(values, 0.0)
        self._blocks = [(columns, values[pair]) for columns, pair in pattern.blocks]

    def __matmul__(self, x: Float64) -> Float64:
        """(n, k) to (n, k)."""
        channels = np.ascontiguousarray(x.T)
        sums = np.empty_like(channels)
        terms = np.empty(max((columns.size for columns, _ in self._blocks), default=0))
        end = 0
        for columns, values in self._blocks:
            begin, end = end, end + columns.shape[1]
            taken = terms[: columns.size].reshape(columns.shape)
            for channel, row_sums in zip(channels, sums, strict=True):
                # Clipping never happens; it only spares numpy a copy of what it takes.
                np.take(channel, columns, out=taken, mode="clip")
                np.einsum("wr,wr->r", values, taken, out=row_sums[begin:end])
        return np.asarray((self.diagonal * channels + np.take(sums, self._rank, axis=1)).T)


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
