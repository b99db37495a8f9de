"""Sparse rows of form factors, and what makes a matrix of them obey reciprocity and closure at once."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..parallel import Workers
from ..scene import Float32, Float64, Int32

Int64 = NDArray[np.int64]

#: Entries a chunk: measured fastest, 10 ms per channel and 3 million entries on one core.
_CHUNK_ENTRIES = 65536
#: More than what rounding to single precision adds to a number.
_ROUNDING = 2.0**-22
#: What a row may lack, relatively: after ten thousand bounces it is still nothing.
_CLOSED = 1e-11
#: Beyond this scaling targets cannot be met; the bound keeps the iteration finite.
_MOST_SCALING = 1e6


@dataclass(frozen=True, eq=False)
class Rows:
    """A sparse matrix by rows (CSR). Row i's entries are indptr[i] to indptr[i + 1].

    indptr (n + 1,) int64, columns (entries,) int32, weights (entries,) float32.
    """

    indptr: Int64
    columns: Int32
    weights: Float32

    def __len__(self) -> int:
        return len(self.indptr) - 1

    @staticmethod
    def from_triplets(rows: ArrayLike, columns: ArrayLike, weights: ArrayLike, count: int) -> Rows:
        """`count` rows from one (row, column, weight) per entry, in any order; entries of one place add up."""
        row, column = np.asarray(rows, dtype=np.int64), np.asarray(columns, dtype=np.int64)
        width = int(column.max(initial=0)) + 1
        place = row * width + column
        order = np.argsort(place, kind="stable")
        place = place[order]
        first = np.flatnonzero(np.diff(place, prepend=-1))
        row, column = np.divmod(place[first], width)
        merged = _segment_sums(np.asarray(weights, dtype=np.float64)[order], first)
        return Rows(_pointers(np.bincount(row, minlength=count)), column.astype(np.int32), merged.astype(np.float32))

    def owners(self) -> Int64:
        """(entries,) the row each entry belongs to."""
        return np.repeat(np.arange(len(self)), np.diff(self.indptr))

    def row_sums(self) -> Float64:
        """(n,) sum of each row, in float64."""
        return _sums(self.owners(), self.weights, len(self))

    def scaled(self, factors: ArrayLike) -> Rows:
        """Row i times factors[i]."""
        weights = self.weights * np.asarray(factors, dtype=np.float64)[self.owners()]
        return Rows(self.indptr, self.columns, weights.astype(np.float32))

    def apply(self, x: ArrayLike, workers: Workers | None = None) -> Float64:
        """The matrix times x (columns, c), or (columns,): (n, c), or (n,), float64.

        Sums run in float64 in the order of the entries, so the result is the same with any number of threads.
        """
        values = np.asarray(x, dtype=np.float64)
        channels = np.ascontiguousarray(values.reshape(len(values), -1).T)
        result = np.zeros((len(channels), len(self)))

        def work(_: int, part: slice) -> None:
            pointers = self.indptr[part.start : part.stop + 1]
            columns = self.columns[pointers[0] : pointers[-1]]
            weights = self.weights[pointers[0] : pointers[-1]].astype(np.float64)
            filled = np.flatnonzero(np.diff(pointers))
            first = pointers[filled] - pointers[0]
            terms = np.empty(len(columns))
            for channel, out in zip(channels, result, strict=True):
                # Clipping never happens; it only spares numpy a copy of what it takes.
                np.take(channel, columns, out=terms, mode="clip")
                terms *= weights
                out[part.start + filled] = _segment_sums(terms, first)

        chunk = max(1, _CHUNK_ENTRIES * len(self) // max(1, len(self.columns)))
        if workers is None:
            for start in range(0, len(self), chunk):
                work(0, slice(start, min(start + chunk, len(self))))
        else:
            for _ in workers.map(work, len(self), chunk):
                pass
        return result.T.reshape(len(self), *values.shape[1:])


def symmetric_exchange(rows: Rows, areas: ArrayLike, samples: ArrayLike = 1.0) -> Rows:
    """Exchange areas G_ij = G_ji = A_i F_ij from directed estimates of both F_ij and F_ji.

    rows: square, F_ij. areas (n,). samples: (n,) or one number, rays that each row was estimated with. The two
    directions are combined by the balance heuristic (Veach 1995): a direction counts by its density of samples, k/A.
    """
    area = np.asarray(areas, dtype=np.float64)
    density = np.broadcast_to(np.asarray(samples, dtype=np.float64), area.shape) / area
    i, j = rows.owners(), rows.columns
    directed = area[i] * rows.weights * density[i] / (density[i] + density[j])
    return Rows.from_triplets(
        np.concatenate([i, j]), np.concatenate([j, i]), np.concatenate([directed, directed]), len(rows)
    )


def one_sided(rows: Rows, areas: ArrayLike) -> Float64:
    """(n,) exchange area by which each side is seen more than it sees: zero by reciprocity, but for noise and for what
    is seen from one side alone. rows: square, F_ij, each with rays of its own. areas (n,)."""
    owner = rows.owners()
    directed = np.asarray(areas, dtype=np.float64)[owner] * rows.weights
    return _sums(rows.columns, directed, len(rows)) - _sums(owner, directed, len(rows))


def balance(
    exchange: Rows, targets: ArrayLike, workers: Workers | None = None, *, tolerance: float = 1e-6, steps: int = 12
) -> Rows:
    """Scale symmetric G to d_i G_ij d_j whose rows sum to the targets (n,), exactly.

    Symmetric Sinkhorn iteration (P. Knight, The Sinkhorn-Knopp algorithm, 2008) for a handful of steps, or until every
    row is within `tolerance` of its target. What a row still lacks then becomes light it sends to itself: symmetric as
    well, and small, but where the targets cannot be reached (a patch that sees only one smaller than itself, or nobody
    who sees it): no light is lost. A row with target zero, and its column, become zero.
    """
    target = np.maximum(np.asarray(targets, dtype=np.float64), 0.0)
    scale = (target > 0.0).astype(np.float64)
    for _ in range(steps):
        sums = scale * exchange.apply(scale, workers)
        ratio = np.divide(target, sums, out=np.ones_like(sums), where=sums > 0.0)
        if np.abs(ratio - 1.0).max(initial=0.0) <= tolerance:
            break
        scale = np.clip(scale * np.sqrt(ratio), 0.0, _MOST_SCALING)
    i, j = exchange.owners(), exchange.columns
    weights = scale[i] * exchange.weights * scale[j]
    sums = _sums(i, weights, len(exchange))
    excess = np.divide(target, sums, out=np.ones_like(sums), where=sums > target)
    # Rounded before the rest is told, and a hair too small: then the sums are exact in spite of single precision.
    rounded = (weights * np.minimum(excess[i], excess[j]) * (1.0 - _ROUNDING)).astype(np.float32)
    lacking = np.maximum(target - _sums(i, rounded, len(exchange)), 0.0)
    closed = _with_diagonal(Rows(exchange.indptr, j, rounded), lacking)
    # Where much is lacking that is rounded too, and what rounding takes or gives counts once for each bounce.
    left: Float64 = lacking - lacking.astype(np.float32)
    return _with_diagonal(closed, left) if (np.abs(left) > _CLOSED * target).any() else closed


def _with_diagonal(rows: Rows, diagonal: Float64) -> Rows:
    """Rows with one more entry at the end of each: the diagonal (n,)."""
    end = rows.indptr[1:]
    return Rows(
        rows.indptr + np.arange(len(rows) + 1),
        np.insert(rows.columns, end, np.arange(len(rows), dtype=np.int32)),
        np.insert(rows.weights, end, diagonal.astype(np.float32)),
    )


def _pointers(lengths: ArrayLike) -> Int64:
    return np.append(np.int64(0), np.cumsum(lengths, dtype=np.int64))


def _sums(owners: Int64 | Int32, weights: NDArray[np.floating[Any]], count: int) -> Float64:
    return np.bincount(owners, weights=weights, minlength=count).astype(np.float64)


def _segment_sums(values: Float64, first: Int64) -> Float64:
    """Sums of consecutive, non-empty segments that begin at `first`."""
    return np.add.reduceat(values, first) if len(first) else np.zeros(0)
