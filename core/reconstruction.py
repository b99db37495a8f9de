"""From light at sample points to light at vertices, by least squares.

Kavan, Bargteil, Sloan 2011, "Least squares vertex baking": minimise the squared difference between the samples and what
interpolation shows there, plus alpha times the squared jump of the gradient across interior edges. Constants are in the
space and jump nowhere, so the mean of every connected surface is kept exactly.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cached_property, reduce
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from .receivers import Receivers, next_corner, numbered_edges, shared_edges
from .scene import Bool, Float64, Int32
from .sorting import stable_order
from .symmetric_matrix import SymmetricMatrix, SymmetricPattern, conjugate_gradients
from .tessellation import Int64

#: Relative error at which conjugate gradients stop: a tenth of what a person asks for at the finest.
_TOLERANCE = 5e-4
_MAXIMUM_ITERATIONS = 100
#: From how much smoothing on a fit has no overshoot that matters, since noise does.
_NOISY = 5.0
#: More than any light; that of several kinds still adds up.
_ENDLESS = 1e100
#: How much light limits may add or take in all, relatively, before it is passed on, and how far it is.
_ADDED, _MOST_RINGS = 5e-3, 30
#: What is nothing beside the rest.
_WEIGHTLESS = 1e-12
#: Samples that together weigh less than this at a vertex, where one has a third on average, say nothing of it.
_MEASURED = 0.02
#: How many steps from vertex to vertex lead over the surroundings that tell how smooth a fit should be.
_RINGS = 8
#: Cells that are looked at together: what is done with them stays in the processor's caches.
_CHUNK = 1 << 14
#: The pairs of corners of the six entries of a symmetric 3 x 3 matrix.
_ROW, _COLUMN = np.array([0, 1, 2, 0, 0, 1]), np.array([0, 1, 2, 1, 2, 2])
#: Which of these six belongs to each side of a triangle.
_SIDE_MOMENT = np.array([3, 5, 4])
#: The pairs of the four vertices around an edge: its ends, each end and each apex, the apexes.
_SIDE_START, _SIDE_END = np.array([0, 0, 1, 0, 1, 2]), np.array([1, 2, 2, 3, 3, 3])

#: How much the jumps of the gradient weigh: everywhere the same, or for each vertex (v,).
Smoothing: TypeAlias = float | Float64


class Samples:
    """Sums over sample points on the cells: what the fit needs, however many samples there were.

    to_grey (k,): weights that turn the k channels into the mean light, by which errors are judged. moments (c, 6):
    products of barycentric weights (00, 11, 22, 01, 02, 12); light (c, 3, k): weight times value; squares (c,): squared
    mean light; noise (c,): its own variances; low, high (c, k): the least and the largest value; count (c,): valid
    samples; tried (c,): with the invalid ones.
    other: the other half of the same samples, with which it shares low and high: nobody asks for those of a half, and
    large meshes need the room.
    """

    def __init__(self, cells: int, to_grey: Float64, other: Samples | None = None) -> None:
        self.to_grey = to_grey
        self.moments = np.zeros((cells, 6))
        self.light = np.zeros((cells, 3, len(to_grey)))
        self.squares = np.zeros(cells)
        self.noise = np.zeros(cells)
        self.low: Float64 = np.full((cells, len(to_grey)), np.inf) if other is None else other.low
        self.high: Float64 = np.full((cells, len(to_grey)), -np.inf) if other is None else other.high
        self.count = np.zeros(cells, dtype=np.int32)
        self.tried = np.zeros(cells, dtype=np.int32)

    def add(self, index: np.ndarray | slice, weights: Float64, values: Float64, noise: Float64, valid: Bool) -> None:
        """One sample for each cell of index: weights (n, 3) barycentric in the output triangle; values (n, k); noise
        (n,) variance of the mean light; an invalid one (n,) counts for nothing."""
        used = weights * valid[:, None]
        self.moments[index] += used[:, _ROW] * weights[:, _COLUMN]
        self.light[index] += used[:, :, None] * values[:, None, :]
        self.squares[index] += valid * (values @ self.to_grey) ** 2
        self.noise[index] += valid * noise
        self.low[index] = np.minimum(self.low[index], np.where(valid[:, None], values, np.inf))
        self.high[index] = np.maximum(self.high[index], np.where(valid[:, None], values, -np.inf))
        self.count[index] += valid
        self.tried[index] += 1

    def recall(self, earlier: Samples, here: Int64, there: Int64) -> None:
        """Samples of some cells (n,) are those of others (n,) in an earlier set."""
        for name in ("moments", "light", "squares", "noise", "low", "high", "count", "tried"):
            getattr(self, name)[here] = getattr(earlier, name)[there]

    def __add__(self, other: Samples) -> Samples:
        total = Samples(0, self.to_grey)
        for name in ("moments", "light", "squares", "noise", "count", "tried"):
            setattr(total, name, getattr(self, name) + getattr(other, name))
        total.low, total.high = np.minimum(self.low, other.low), np.maximum(self.high, other.high)
        return total

    @property
    def lumped(self) -> Float64:
        """(c, 3) how much the samples weigh at each corner."""
        return lumped_moments(self.moments)

    @property
    def mean_grey(self) -> Float64:
        """(c,) mean light of the samples, 0 where there is none."""
        return np.asarray(self.light.sum(axis=1) @ self.to_grey / np.maximum(self.count, 1.0))

    def grey(self) -> Samples:
        """The same samples of the mean light alone."""
        alone = Samples(0, np.ones(1))
        for name in ("moments", "squares", "noise", "count", "tried"):
            setattr(alone, name, getattr(self, name))
        alone.light = (self.light @ self.to_grey)[:, :, None]
        return alone

    def squared_residual(self, corners: Float64, part: slice = slice(None)) -> Float64:
        """Mean (n,) of (mean light - interpolated)^2 over the samples of each cell in a part of them, for corner values
        (n, 3)."""
        m, light = self.moments[part].T, (self.light[part] @ self.to_grey).T
        x, y, z = corners.T
        total = x * (m[0] * x + 2.0 * (m[3] * y + m[4] * z - light[0]))
        total += y * (m[1] * y + 2.0 * (m[5] * z - light[1]))
        total += z * (m[2] * z - 2.0 * light[2])
        return np.maximum(self.squares[part] + total, 0.0) / np.maximum(self.count[part], 1.0)


def _sum(arrays: Iterable[NDArray[Any]]) -> NDArray[Any]:
    """Of arrays of one shape."""
    return reduce(np.add, arrays)


def lumped_moments(moments: Float64) -> Float64:
    """(c, 3) sums of the moments (c, 6) over the second corner."""
    return np.asarray(moments[:, :3] + moments[:, [3, 3, 4]] + moments[:, [4, 5, 5]])


@dataclass(frozen=True, eq=False)
class System:
    """The mass matrix, by its diagonal (v,) and its edges (e,); target (v, k); lumped (v,): the mass's row sums."""

    diagonal: Float64
    edges: Float64
    target: Float64
    lumped: Float64


class Fit:
    """Least squares onto the fit vertices of the receivers.

    lumped (c, 3): how much the valid samples weigh at each corner; where that is next to nothing the fit has nothing to
    say, and `fill` does. hidden (c,): cells of which some sample was out of sight. Of the vertices (v,), those that no
    valid sample tells of are not `measured`; they are `filled` when they share an edge with one that is, since what is
    seen reaches there. broken (c,): as Receivers.broken.
    """

    def __init__(self, receivers: Receivers, lumped: Float64, hidden: Bool) -> None:
        self.receivers = receivers
        self._count = receivers.vertices
        self._corner = receivers.corner_vertex[receivers.cells.element]
        self.measured = self._scatter(lumped) > _MEASURED
        self.hidden = ~self.measured & (self._scatter(np.repeat(hidden[:, None], 3, axis=1)) > 0)
        edge, ends, _ = numbered_edges(receivers.corner_vertex)
        self._edge, self._edge_ends = edge.astype(np.int32), ends.astype(np.int32)
        self.broken = receivers.broken
        self._both_known = self.measured[self._edge_ends].all(axis=1)
        self.filled = ~self.measured & self._beside_measured()
        jumps = gradient_jumps(receivers, self.measured)
        around = np.bincount(receivers.corner_vertex.ravel(), minlength=self._count)
        self._surrounded = np.bincount(jumps.vertices[:, :2].ravel(), minlength=self._count) == around
        apexes = jumps.vertices[:, 2:]
        self._pattern = SymmetricPattern(self._count, np.concatenate([self._edge_ends, apexes]).astype(np.int64))
        self._jumps = jumps
        self._around = self._cells_around()
        self._penalty, self._pair_penalty = self._penalties(jumps.weight)

    def system(self, *samples: Samples) -> System:
        """Mass matrix and right-hand side of sets of samples taken together, each cell weighing as much as its area in
        sight."""
        # A channel at a time: large meshes need the room.
        weight = self.receivers.cells.area / np.maximum(_sum(s.tried for s in samples), 1)
        moments = _sum(s.moments for s in samples) * weight[:, None]
        edges = self._edge[self.receivers.cells.element].ravel()
        channels, known = range(len(samples[0].to_grey)), self.measured
        light = (_sum(s.light[..., k] for s in samples) * weight[:, None] for k in channels)
        return System(
            diagonal=self._scatter(moments[:, :3]) * known,
            edges=np.bincount(edges, moments[:, _SIDE_MOMENT].ravel(), len(self._edge_ends)) * self._both_known,
            target=np.stack([self._scatter(channel) * known for channel in light], axis=1),
            lumped=self._scatter(lumped_moments(moments)),
        )

    def solve(
        self,
        system: System,
        alpha: Smoothing,
        start: Float64 | None = None,
        tolerance: float | None = None,
        held: Bool | None = None,
    ) -> Float64:
        """Vertex values (v, k), unfilled where nothing was measured, with gradient jumps weighed by alpha, everywhere
        the same or for each vertex (v,).

        start (v, k): where to begin; by default plain averaging, which is near already. tolerance: relative error; by
        default a tenth of the finest that is asked for. held (v,): which keep their start.
        """
        start = self.averages(system) if start is None else start
        most = _TOLERANCE if tolerance is None else tolerance
        matrix, still = self.matrix(system, alpha), None if held is None else held[:, None]
        return conjugate_gradients(matrix, system.target, start, most, _MAXIMUM_ITERATIONS, still)

    def solve_within(
        self,
        system: System,
        alpha: Smoothing,
        limits: tuple[Float64, Float64],
        start: Float64 | None = None,
        loose: float = 1.0,
        each: Callable[..., Any] = map,
    ) -> Float64:
        """Vertex values (v, k) as those of `solve`, but within limits (v, k), as `limits` finds them, and filled.

        Beside a step of the light, the linear elements that are nearest to it overshoot on both sides. Where they do,
        the vertex is held at the limit, and the others make the best of that; the mean stays that of the samples.
        loose: how many times as far off as those of `solve` they may be. each: a `map` over the channels that may use
        threads.
        """
        matrix, every = self.matrix(system, alpha), np.arange(system.target.shape[1])[:, None]

        def solved(start: Float64, held: Bool) -> Float64:
            def of_channel(k: np.ndarray) -> Float64:
                accuracy = loose * _TOLERANCE, _MAXIMUM_ITERATIONS
                return conjugate_gradients(matrix, system.target[:, k], start[:, k], *accuracy, held[:, k])

            return np.concatenate(list(each(of_channel, every)), axis=1)

        start = self.averages(system) if start is None else start
        free = solved(start, np.zeros(start.shape, dtype=bool))
        low, high = within(limits, alpha)
        values = np.clip(free, low, high)
        held = values != free
        if held.any():
            freer = solved(values, held)
            values = np.clip(freer, low, high)
            pressed = np.where(held, matrix @ freer - system.target, 0.0)
            added = np.asarray(pressed + system.lumped[:, None] * (values - freer), dtype=np.float64)
            # Few samples say anything of a small triangle: it must not take all that its neighbours may not have.
            room = np.minimum(values, limits[0]), np.maximum(values, limits[1])
            values = self._passed_on(values, added, system.lumped, *room)
        return self.fill(values)

    def _passed_on(self, values: Float64, added: Float64, weight: Float64, low: Float64, high: Float64) -> Float64:
        """The values (v, k) without what limits have added to them, or taken: it goes to the nearest vertices that can
        take it, within their own limits (v, k), for what one cannot, its neighbours share.

        added (v, k): light times weight, weight (v,): how much of the surface each vertex stands for.
        """
        heavy = weight > _WEIGHTLESS * weight.max(initial=0.0)
        weight = np.where(heavy, weight, 0.0)[:, None]
        inverse = np.where(heavy[:, None], 1.0 / np.where(heavy[:, None], weight, 1.0), 0.0)
        one, two = self._neighbours()
        open_edges = heavy[one] & heavy[two]
        one, two = one[open_edges], two[open_edges]
        sharing = np.maximum(np.bincount(one, minlength=self._count), 1)[:, None]
        enough = _ADDED * np.abs(np.sum(weight * values, axis=0))
        for _ in range(_MOST_RINGS):
            if (np.abs(added).sum(axis=0) <= enough).all():
                break
            fresh = np.clip(values - added * inverse, low, high)
            share = (added + weight * (fresh - values)) / sharing
            added = np.stack([np.bincount(two, channel[one], self._count) for channel in share.T], axis=1)
            values = fresh
        else:
            # So few places are lit that nothing near takes it: all of them share the rest.
            total, rest = np.sum(weight * values, axis=0), added.sum(axis=0)
            lit = total > _WEIGHTLESS * np.abs(rest)
            values = values * np.maximum(1.0 - np.divide(rest, total, out=np.zeros_like(rest), where=lit), 0.0)
        return values

    def averages(self, system: System) -> Float64:
        """Vertex values (v, k): the mean of the samples around each."""
        averaged = system.target / np.maximum(system.lumped, np.finfo(float).tiny)[:, None]
        return np.where(self.measured[:, None], averaged, 0.0)

    def _cells_around(self) -> tuple[Int32, Int32, Int64]:
        """Vertices (m,) with cells around them, those cells one vertex after the other, and where each begins there.

        Sorted once for all, extremes around vertices take a tenth of what minimum.at does.
        """
        vertex = self._corner.ravel()
        order = stable_order(vertex)
        first = np.flatnonzero(np.diff(vertex[order], prepend=-1))
        return vertex[order[first]], (order // 3).astype(np.int32), first

    def limits(self, *samples: Samples) -> tuple[Float64, Float64]:
        """Least and largest light (v, k) that a vertex may have: that of all samples in the triangles around it.

        At the rim of a surface all samples lie to one side. The nearest of n samples misses the vertex by about
        1 / sqrt(n) of the triangle's size, so light may go on rising or falling by twice that share of what it does
        among them; but not where the other side is out of sight.
        """
        met, cell, first = self._around
        low, high = np.full((2, len(samples[0].to_grey), self._count), np.inf)
        for k in range(len(low)):
            least = np.minimum.reduce([s.low[:, k] for s in samples])
            largest = np.maximum.reduce([s.high[:, k] for s in samples])
            low[k, met] = np.minimum.reduceat(least[cell], first)
            high[k, met] = np.maximum.reduceat(largest[cell], first)
        count, tried = _sum(s.count for s in samples), _sum(s.tried for s in samples)
        cut_off = np.zeros(self._count, dtype=bool)
        for corner in self._corner.T:
            cut_off[corner[tried > count]] = True
        low, high = (np.where(np.isfinite(limit), limit, 0.0).T for limit in (low, high))
        samples_around = self._scatter(np.repeat(count[:, None], 3, axis=1))
        share = np.where(self._surrounded | cut_off, 0.0, 2.0 / np.sqrt(np.maximum(samples_around, 4.0)))
        beyond = share[:, None] * (high - low)
        # A sample of a hardly lit place may be below zero, so that many are right on average.
        return np.maximum(low - beyond, 0.0), np.maximum(high + beyond, 0.0)

    def matrix(self, system: System, alpha: Smoothing) -> SymmetricMatrix:
        """The mass plus alpha times the penalty; a jump between vertices of several alphas (v,) has their geometric
        mean."""
        if isinstance(alpha, np.ndarray):
            smoothing = np.exp(np.log(alpha)[self._jumps.vertices].mean(axis=1))
            penalty, pairs = self._penalties(smoothing * self._jumps.weight)
        else:
            penalty, pairs = alpha * self._penalty, alpha * self._pair_penalty
        pairs[: len(system.edges)] += system.edges
        return SymmetricMatrix(self._pattern, system.diagonal + penalty, pairs)

    def _penalties(self, weight: Float64) -> tuple[Float64, Float64]:
        """The squared jumps, each as heavy as weight (j,): diagonal (v,), and a value for each pair of the pattern."""
        jumps, jump = self._jumps, self._jumps.jump.T
        # A column at a time: large meshes need the room.
        diagonal = np.zeros(self._count)
        for vertex, own in zip(jumps.vertices.T, jump, strict=True):
            diagonal += np.bincount(vertex, weight * own**2, self._count)
        edge, on_edges = self._edge.ravel(), np.zeros(len(self._edge_ends))
        pairs = zip(_SIDE_START, _SIDE_END, strict=True)
        *products, across = (weight * jump[start] * jump[end] for start, end in pairs)
        for side, product in zip(jumps.sides.T, products, strict=True):
            on_edges += np.bincount(edge[side], product, len(on_edges))
        return diagonal, np.concatenate([on_edges, across])

    def nearby(self, amounts: Float64) -> Float64:
        """(v,) how much of the amounts of the cells (c,) there is around each vertex, spread as far as _RINGS steps of
        chance lead from vertex to vertex: over some hundred cells, but over no edge where the fit breaks."""
        spread, share = self._spread
        near = self._scatter(np.repeat(amounts[:, None], 3, axis=1))[:, None]
        for _ in range(_RINGS):
            near = spread @ (share * near)
        return np.asarray(near[:, 0])

    @cached_property
    def _spread(self) -> tuple[SymmetricMatrix, Float64]:
        """Sums over each vertex and those that it is tied to; and one over their number (v, 1)."""
        spread = SymmetricMatrix(self._pattern, np.ones(self._count), np.ones(len(self._pair_penalty)))
        return spread, 1.0 / (spread @ np.ones((self._count, 1)))

    def bending(self, one: Float64, other: Float64) -> Float64:
        """(c,) mean over each cell of the product of the gradient's jumps in two fits (v, 1): their common squared
        jump, to which independent noise adds nothing on average."""
        penalty = SymmetricMatrix(self._pattern, self._penalty, self._pair_penalty)
        energy = (one * (penalty @ other) + other * (penalty @ one))[:, 0] / 2.0
        around = self._scatter(np.repeat(self.receivers.cells.area[:, None] / 3.0, 3, axis=1))
        return np.asarray((energy / np.maximum(around, np.finfo(float).tiny))[self._corner].mean(axis=1))

    def at_corners(self, values: NDArray[Any], part: slice = slice(None)) -> NDArray[Any]:
        """(n, 3, ...): what interpolation of vertex values (v, ...) starts from in the output triangle of each cell, or
        of each in a part of them."""
        return values[self._corner[part]]

    def squared_residual(self, samples: Samples, values: Float64) -> Float64:
        """Mean (c,) of the samples' squared distance from vertex values (v,) of the mean light."""
        found = np.empty(len(self._corner))
        for begin in range(0, len(found), _CHUNK):
            part = slice(begin, begin + _CHUNK)
            found[part] = samples.squared_residual(self.at_corners(values, part), part)
        return found

    def _scatter(self, corner_values: Float64) -> Float64:
        return np.bincount(self._corner.ravel(), corner_values.ravel(), self._count).astype(np.float64)

    def fill(self, values: Float64) -> Float64:
        """Give vertices without a sample the mean of their neighbours, ring by ring. Inside a solid only the first
        ring: what is seen reaches no further, and beyond it is as dark as that inside is."""
        known = self.measured
        one, two = self._neighbours()
        edge = known[one] & ~known[two]
        while edge.any():
            share = np.bincount(two[edge], minlength=self._count)
            total = [np.bincount(two[edge], v[one[edge]], self._count) for v in values.T]
            fresh = share > 0
            values[fresh] = (np.stack(total, axis=1) / np.maximum(share, 1)[:, None])[fresh]
            known = known | fresh | self.hidden
            edge = fresh[one] & ~known[two]
        return values

    def _neighbours(self) -> tuple[Int32, Int32]:
        """Both ends of all edges, each edge both ways."""
        one, two = self._edge_ends.T
        return np.concatenate([one, two]), np.concatenate([two, one])

    def _beside_measured(self) -> Bool:
        """(v,) vertices that share an edge with a measured one."""
        one, two = self._neighbours()
        beside = np.zeros(self._count, dtype=bool)
        beside[two[self.measured[one]]] = True
        return beside


def within(limits: tuple[Float64, Float64], alpha: Smoothing) -> tuple[Float64, Float64]:
    """The limits that a fit so smooth has to keep: those of the samples around a vertex if it may overshoot; none but
    zero if it averages over many more, for then each of them is mostly noise, and far from where their mean lies."""
    noisy = np.reshape(np.asarray(alpha) >= _NOISY, (-1, 1))
    return np.where(noisy, 0.0, limits[0]), np.where(noisy, _ENDLESS, limits[1])


@dataclass(frozen=True, eq=False)
class Jumps:
    """The gradient's jump over smooth interior edges: vertices (j, 4) start, end and the two apexes; jump (j, 4) their
    coefficients; weight (j,); sides (j, 5): the sides of triangles that join start and end, and each of them to each
    apex, side 3 t + i of triangle t running from corner i to the next."""

    vertices: Int32
    jump: Float64
    weight: Float64
    sides: Int32


def gradient_jumps(receivers: Receivers, measured: Bool) -> Jumps:
    """The jump of the gradient over each smooth interior edge between measured vertices.

    For an edge between triangles with apexes k and l the jump, made dimensionless by the lesser height over the edge,
    is (x_k - x at its foot) / h_k + (x_l - x at its foot) / h_l, zero for every linear function.
    """
    vertex = receivers.corner_vertex
    here, there = shared_edges(vertex)
    apex_here, apex_there = _third(here), _third(there)
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
    # The side that joins the apex to one end of the edge lies opposite the other, and begins at the corner after that.
    sides = np.stack(
        [
            next_corner(apex_here),
            next_corner(here[:, 1]),
            next_corner(here[:, 0]),
            next_corner(there[:, 1]),
            next_corner(there[:, 0]),
        ],
        axis=1,
    )
    weight = np.sqrt(squared) * mean / 3
    return Jumps(vertices[usable], jump[usable], weight[usable], sides[usable].astype(np.int32))


def _third(ends: np.ndarray) -> np.ndarray:
    """The corner of the same triangle that is neither end of an edge, by numbers 3 t + i: (e, 2) to (e,)."""
    first = ends[:, 0] - ends[:, 0] % 3
    return np.asarray(first + 3 - ends[:, 0] % 3 - ends[:, 1] % 3)
