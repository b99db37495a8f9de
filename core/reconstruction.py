"""From light at sample points to light at vertices, by least squares.

Kavan, Bargteil, Sloan 2011, "Least squares vertex baking": minimise the squared difference between the samples and what
interpolation shows there, plus alpha times the squared jump of the gradient across interior edges. Constants are in the
space and jump nowhere, so the mean of every connected surface is kept exactly.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .receivers import Receivers, shared_edges
from .scene import Bool, Float64, Int32

#: Relative error at which conjugate gradients stop: a tenth of what a person asks for at the finest.
_TOLERANCE = 5e-4
_MAXIMUM_ITERATIONS = 100
#: Entries of a row of the fit's matrix that are kept in line: more than a vertex of a sound mesh has.
_WIDTH = 24
#: The pairs of corners of the six entries of a symmetric 3 x 3 matrix.
_ROW, _COLUMN = np.array([0, 1, 2, 0, 0, 1]), np.array([0, 1, 2, 1, 2, 2])


class Samples:
    """Sums over sample points on the cells: what the fit needs, however many samples there were.

    moments (c, 6): products of barycentric weights (00, 11, 22, 01, 02, 12); light (c, 3, k): weight times value;
    squares (c, k): squared values; noise (c, k): the values' own variances; count (c,): valid samples.
    """

    def __init__(self, cells: int, channels: int) -> None:
        self.moments = np.zeros((cells, 6))
        self.light = np.zeros((cells, 3, channels))
        self.squares = np.zeros((cells, channels))
        self.noise = np.zeros((cells, channels))
        self.count = np.zeros(cells)

    def add(self, index: np.ndarray | slice, weights: Float64, values: Float64, noise: Float64, valid: Bool) -> None:
        """One sample for each cell of index: weights (n, 3) barycentric in the output triangle; values, noise (n, k);
        an invalid one (n,) counts for nothing."""
        used = weights * valid[:, None]
        self.moments[index] += used[:, _ROW] * weights[:, _COLUMN]
        self.light[index] += used[:, :, None] * values[:, None, :]
        self.squares[index] += valid[:, None] * values**2
        self.noise[index] += valid[:, None] * noise
        self.count[index] += valid

    def __add__(self, other: Samples) -> Samples:
        total = Samples(self.light.shape[0], self.light.shape[2])
        for name in vars(total):
            setattr(total, name, getattr(self, name) + getattr(other, name))
        return total

    def channel(self, k: int) -> Samples:
        """The same samples with channel k alone."""
        alone = Samples(0, 1)
        alone.moments, alone.count = self.moments, self.count
        for name in ("light", "noise", "squares"):
            setattr(alone, name, getattr(self, name)[..., k][..., None])
        return alone

    def squared_residual(self, corners: Float64) -> Float64:
        """Mean (c, k) of (sample - interpolated)^2 over each cell's samples, for corner values (c, 3, k)."""
        product = corners[:, _ROW] * corners[:, _COLUMN]
        product[:, 3:] *= 2.0
        total = self.squares - 2.0 * np.einsum("cik,cik->ck", self.light, corners)
        total += np.einsum("ci,cik->ck", self.moments, product)
        return np.maximum(total, 0.0) / np.maximum(self.count, 1.0)[:, None]


class SparseMatrix:
    """Rows of about equal length, padded: columns and values (v, w). What a row has beyond w is kept aside."""

    def __init__(self, indptr: np.ndarray, columns: np.ndarray, values: Float64) -> None:
        length = np.diff(indptr)
        width = int(min(length.max(initial=1), _WIDTH))
        place = indptr[:-1, None] + np.arange(width)
        filled = np.arange(width) < length[:, None]
        place = np.where(filled, place, 0)
        self._columns = columns[place]
        self._values = np.where(filled, values[place], 0.0)
        row = np.repeat(np.arange(len(length)), length)
        beyond = np.arange(len(columns)) - indptr[row] >= width
        self._rest = (row[beyond], columns[beyond], values[beyond])
        self.diagonal = np.bincount(row, values * (columns == row), len(length))

    def __matmul__(self, x: Float64) -> Float64:
        """(v, k) to (v, k)."""
        row, column, value = self._rest
        product = np.empty_like(x)
        for k in range(x.shape[1]):
            channel = np.ascontiguousarray(x[:, k])
            product[:, k] = np.einsum("vw,vw->v", self._values, channel[self._columns])
            if len(row):
                product[:, k] += np.bincount(row, value * channel[column], len(x))
        return product


class Pattern:
    """Which entries a sum of triplets fills, found once and used for every set of values; all of the diagonal is."""

    def __init__(self, count: int, rows: np.ndarray, columns: np.ndarray) -> None:
        key = np.concatenate([rows.astype(np.int64) * count + columns, np.arange(count) * (count + 1)])
        self._order = np.argsort(key, kind="stable")
        ordered = key[self._order]
        self._start = np.flatnonzero(np.r_[True, ordered[1:] != ordered[:-1]])
        row, column = np.divmod(ordered[self._start], count)
        self._columns = column
        self._indptr = np.searchsorted(row, np.arange(count + 1))
        self._count = count

    def total(self, values: Float64) -> Float64:
        """Values of the entries: the sum of the triplets' values that fall on each."""
        return np.asarray(np.add.reduceat(np.concatenate([values, np.zeros(self._count)])[self._order], self._start))

    def matrix(self, values: Float64) -> SparseMatrix:
        return SparseMatrix(self._indptr, self._columns, values)


@dataclass(frozen=True, eq=False)
class System:
    """mass: entries of the mass matrix in the fit's pattern; target (v, k); lumped (v,): the mass's row sums."""

    mass: Float64
    target: Float64
    lumped: Float64


class Fit:
    """Least squares onto the fit vertices of the receivers.

    count (c,): valid samples of each cell; where there is none the fit has nothing to say, and `fill` does.
    hidden (c,): cells of which some sample was inside a solid.
    """

    def __init__(self, receivers: Receivers, count: Float64, hidden: Bool) -> None:
        self._receivers = receivers
        self._count = receivers.vertices
        self._corner = receivers.corner_vertex[receivers.cells.element]
        sampled = np.repeat((count > 0)[:, None], 3, axis=1)
        if receivers.cells.barycentric is not None:
            sampled &= receivers.cells.barycentric.max(axis=1) > 0
        self.measured = self._scatter(sampled) > 0
        self.hidden = ~self.measured & (self._scatter(np.repeat(hidden[:, None], 3, axis=1)) > 0)
        vertex, jump, weight = gradient_jumps(receivers, self.measured)
        penalty = weight[:, None, None] * jump[:, :, None] * jump[:, None, :]
        row = np.concatenate([self._corner[:, _ROW], self._corner[:, _COLUMN[3:]]], axis=1).ravel()
        column = np.concatenate([self._corner[:, _COLUMN], self._corner[:, _ROW[3:]]], axis=1).ravel()
        self._masses = len(row)
        self._pattern = Pattern(
            self._count,
            np.concatenate([row, np.broadcast_to(vertex[:, :, None], penalty.shape).ravel()]),
            np.concatenate([column, np.broadcast_to(vertex[:, None, :], penalty.shape).ravel()]),
        )
        self._penalty = self._pattern.total(np.concatenate([np.zeros(self._masses), penalty.ravel()]))
        self._penalties = penalty.size

    def system(self, samples: Samples) -> System:
        """Mass matrix and right-hand side of one set of samples, each cell weighing as much as its area."""
        weight = self._receivers.cells.area / np.maximum(samples.count, 1)
        moments = samples.moments * weight[:, None]
        entries = np.concatenate([moments, moments[:, 3:]], axis=1).ravel()
        mass = self._pattern.total(np.concatenate([entries, np.zeros(self._penalties)]))
        light = samples.light * weight[:, None, None]
        target = np.stack([self._scatter(light[..., k]) for k in range(light.shape[2])], axis=1)
        return System(mass, target, self._scatter(moments[:, :3] + moments[:, [3, 3, 4]] + moments[:, [4, 5, 5]]))

    def solve(self, system: System, alpha: float, start: Float64 | None = None) -> Float64:
        """Vertex values (v, k), unfilled where nothing was measured, with gradient jumps weighed by alpha.

        start (v, k): where to begin; by default plain averaging, which is near already.
        """
        matrix = self._pattern.matrix(system.mass + alpha * self._penalty)
        if start is None:
            averaged = system.target / np.maximum(system.lumped, np.finfo(float).tiny)[:, None]
            start = np.where(self.measured[:, None], averaged, 0.0)
        return conjugate_gradients(matrix, system.target, start)

    def at_corners(self, values: Float64) -> Float64:
        """(c, 3, k): what interpolation of vertex values (v, k) starts from in each cell's output triangle."""
        return values[self._corner]

    def _scatter(self, corner_values: Float64) -> Float64:
        return np.bincount(self._corner.ravel(), corner_values.ravel(), self._count).astype(np.float64)

    def fill(self, values: Float64) -> Float64:
        """Give vertices without a sample the mean of their neighbours, ring by ring; but not those that lie in the
        dark inside of a solid, where there is no light and nobody looks."""
        known = self.measured | self.hidden
        corners = self._receivers.corner_vertex
        one, two = corners.ravel(), corners[:, [1, 2, 0]].ravel()
        one, two = np.concatenate([one, two]), np.concatenate([two, one])
        edge = self.measured[one] & ~known[two]
        while edge.any():
            share = np.bincount(two[edge], minlength=self._count)
            total = [np.bincount(two[edge], v[one[edge]], self._count) for v in values.T]
            fresh = share > 0
            values[fresh] = (np.stack(total, axis=1) / np.maximum(share, 1)[:, None])[fresh]
            known |= fresh
            edge = fresh[one] & ~known[two]
        return values


def gradient_jumps(receivers: Receivers, measured: Bool) -> tuple[Int32, Float64, Float64]:
    """Vertices (e, 4), coefficients (e, 4) and weights (e,) of the gradient's jump over each smooth interior edge.

    For an edge between triangles with apexes k and l the jump, made dimensionless by the lesser height over the edge,
    is (x_k - x at its foot) / h_k + (x_l - x at its foot) / h_l, zero for every linear function.
    """
    vertex = receivers.corner_vertex
    here, there = shared_edges(vertex)
    apex_here = here[:, 0] - here[:, 0] % 3 + _third(here % 3)
    apex_there = there[:, 0] - there[:, 0] % 3 + _third(there % 3)
    flat = receivers.element_corners.reshape(-1, 3)
    start, end = flat[here[:, 0]], flat[here[:, 1]]
    along = end - start
    squared = np.maximum(np.einsum("ek,ek->e", along, along), np.finfo(float).tiny)
    foot, height = [], []
    for apex in (apex_here, apex_there):
        to_apex = flat[apex] - start
        s = np.einsum("ek,ek->e", to_apex, along) / squared
        foot.append(s)
        height.append(np.linalg.norm(to_apex - s[:, None] * along, axis=1))
    mean, least = (height[0] + height[1]) / 2, np.minimum(height[0], height[1])
    solid = least > 1e-3 * np.sqrt(squared)
    with np.errstate(divide="ignore", invalid="ignore"):
        first, second = least / height[0], least / height[1]
    jump = np.stack(
        [-first * (1 - foot[0]) - second * (1 - foot[1]), -first * foot[0] - second * foot[1], first, second], axis=1
    )
    flat_vertex = vertex.ravel()
    vertices = np.stack([flat_vertex[c] for c in (here[:, 0], here[:, 1], apex_here, apex_there)], axis=1)
    usable = solid & measured[vertices].all(axis=1)
    weight = np.sqrt(squared) * mean / 3
    return vertices[usable], jump[usable], weight[usable]


def _third(ends: np.ndarray) -> np.ndarray:
    """The corner of a triangle (0, 1, 2) that is neither end of an edge (e, 2)."""
    return 3 - ends[:, 0] - ends[:, 1]


def conjugate_gradients(matrix: SparseMatrix, target: Float64, start: Float64) -> Float64:
    """Solve matrix x = target (v, k) with Jacobi scaling; rows without weight keep their start."""
    diagonal = matrix.diagonal
    inverse = np.where(diagonal > 0, 1.0 / np.where(diagonal > 0, diagonal, 1.0), 0.0)[:, None]
    x = start
    residual = target - matrix @ x
    scaled = inverse * residual
    direction = scaled.copy()
    energy = np.sum(residual * scaled, axis=0)
    enough = _TOLERANCE**2 * np.maximum(np.sum(target * inverse * target, axis=0), np.finfo(float).tiny)
    for _ in range(_MAXIMUM_ITERATIONS):
        if (energy <= enough).all():
            break
        image = matrix @ direction
        step = energy / np.maximum(np.sum(direction * image, axis=0), np.finfo(float).tiny)
        x = x + step * direction
        residual = residual - step * image
        scaled = inverse * residual
        fresh = np.sum(residual * scaled, axis=0)
        direction = scaled + fresh / np.maximum(energy, np.finfo(float).tiny) * direction
        energy = fresh
    return x
