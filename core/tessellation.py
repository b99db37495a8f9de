"""Triform: a triangle into four by its edge midpoints, recursively, without cracks.

Whether an edge is split depends on that edge alone, so the two triangles that share it always agree: no T-junctions.
A triangle whose three edges are too long becomes four; one with a short edge becomes three or two, which keeps thin
triangles from getting thinner ("red-green" refinement: Bank, Sherman, Weiser 1983).
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .scene import Bool, Float64, Int32
from .sorting import distinct

Int64 = NDArray[np.int64]

# Children of a triangle a, b, c with edge midpoints d = ab, e = bc, f = ca, as indices into (a, b, c, d, e, f).
_FOUR = np.array([[0, 3, 5], [3, 1, 4], [5, 4, 2], [4, 5, 3]])
_TWO = np.array([[0, 3, 2], [3, 1, 2]])  # only ab is split
# ab and bc are split: the corner at b, and a quad a, d, e, c cut along a shorter or a longer diagonal.
_THREE_AE = np.array([[3, 1, 4], [0, 3, 4], [0, 4, 2]])
_THREE_DC = np.array([[3, 1, 4], [0, 3, 2], [3, 4, 2]])

MAXIMUM_PASSES = 24
#: Lengths that differ by less, as logarithms to base 2, are the same.
_SAME = 1e-9


@dataclass(frozen=True, eq=False)
class Tessellation:
    """vertices (v, 3) float64, the input's own first; triangles (t, 3) int32; parent (t,) int32, ascending;
    barycentric (t, 3, 3) float64: weights of the parent's corners at each corner."""

    vertices: Float64
    triangles: Int32
    parent: Int32
    barycentric: Float64

    def only(self, chosen: Bool) -> Tessellation:
        """Some of the triangles (t,), of the same vertices."""
        return Tessellation(self.vertices, self.triangles[chosen], self.parent[chosen], self.barycentric[chosen])


def whole(vertices: Float64, triangles: Int32) -> Tessellation:
    """The tessellation that splits nothing."""
    return Tessellation(
        vertices,
        triangles,
        np.arange(len(triangles), dtype=np.int32),
        np.broadcast_to(np.eye(3), (len(triangles), 3, 3)),
    )


def triform(mesh: Tessellation, longest_edge: float) -> Tessellation:
    """Split the triangles of a mesh until no edge is longer than longest_edge (metres)."""
    for _ in range(MAXIMUM_PASSES):
        refined = _split_long_edges(mesh, longest_edge)
        if refined is mesh:
            break
        mesh = refined
    return mesh


def quarters(corners: Float64) -> Float64:
    """The four triangles (4, 3, k), in place or in weights, that halving the edges of one (3, k) gives."""
    return np.concatenate([corners, (corners + corners[[1, 2, 0]]) / 2])[_FOUR]


def _split_long_edges(mesh: Tessellation, longest_edge: float) -> Tessellation:
    marked = _squared_edges(mesh.vertices, mesh.triangles) > longest_edge * longest_edge
    return _split(mesh, marked)[0]


def split_each(
    meshes: Iterable[Tessellation],
    where: NDArray[Any],
    split_mesh: Callable[[Tessellation, NDArray[Any]], tuple[Tessellation, Int64]],
) -> tuple[tuple[Tessellation, ...], Int64]:
    """Split each mesh where (t, ...) it says for the triangles of all; and for each new triangle the one it came
    from."""
    split, sources, begin = [], [], 0
    for mesh in meshes:
        end = begin + len(mesh.triangles)
        finer, source = split_mesh(mesh, where[begin:end])
        split.append(finer)
        sources.append(source + begin)
        begin = end
    return tuple(split), np.concatenate(sources)


def split_triangles(mesh: Tessellation, chosen: Bool) -> tuple[Tessellation, Int64]:
    """Split the chosen (t,) triangles into four, slivers into three along their length alone, and their neighbours so
    that no crack opens.

    Also returns, for each new triangle, the one it came from.
    """
    # Only triangles with two vertices in common with chosen ones can share an edge with them.
    at_chosen = np.zeros(len(mesh.vertices), dtype=bool)
    at_chosen[mesh.triangles[chosen]] = True
    near = np.flatnonzero(np.count_nonzero(at_chosen[mesh.triangles], axis=1) > 1)
    keys = edge_keys(mesh.triangles[near], len(mesh.vertices))
    marked = np.zeros(mesh.triangles.shape, dtype=bool)
    marked[near] = np.isin(keys, keys[chosen[near]][_long_edges(mesh, np.flatnonzero(chosen))])
    return _split(mesh, marked)


def _long_edges(mesh: Tessellation, chosen: Int64) -> Bool:
    """The edges (n, 3) of the chosen (n,) triangles that are at least half as long as their longest."""
    squared = _squared_edges(mesh.vertices, mesh.triangles[chosen])
    return np.asarray(squared >= 0.25 * squared.max(axis=1, keepdims=True))


def _squared_edges(vertices: Float64, triangles: Int32) -> Float64:
    """Squared lengths (t, 3) of the edges, from each corner to the next."""
    corners = vertices[triangles]
    edges = corners[:, [1, 2, 0]] - corners
    return np.asarray(np.einsum("tij,tij->ti", edges, edges))


def cut_edges(mesh: Tessellation, places: Float64) -> tuple[Tessellation, Int64]:
    """Split edges (t, 3) at places, 0 to 1 from the end with the lower number to the other; nan where they stay whole.

    Both sides of an edge must agree. Also returns, for each new triangle, the one it came from.
    """
    return _split(mesh, np.isfinite(places), places)


def _split(mesh: Tessellation, marked: Bool, places: Float64 | None = None) -> tuple[Tessellation, Int64]:
    """Split the marked edges (t, 3): from corner 0 to 1, 1 to 2, 2 to 0. Both sides of an edge must agree, also on the
    place (t, 3), the midpoint unless given."""
    if not marked.any():
        return mesh, np.arange(len(marked))
    number = np.count_nonzero(marked, axis=1)
    # Children stand where their parent stood, so neighbours in space stay neighbours in memory.
    source = np.repeat(np.arange(len(number)), number + 1)
    begin = np.cumsum(number + 1) - number - 1
    triangles, barycentric = mesh.triangles[source], mesh.barycentric[source]
    parents = np.flatnonzero(number)
    own = np.full((len(parents), 3), 0.5) if places is None else places[parents]
    midpoint, vertices = _midpoints(mesh, parents, marked[parents], own)
    six, weights = _turned(mesh, parents, midpoint, marked[parents], own)
    for template, chosen in _templates(number[parents], vertices, six):
        place = begin[parents[chosen], None] + np.arange(len(template))
        triangles[place] = six[chosen[:, None, None], template]
        barycentric[place] = weights[chosen[:, None, None], template]
    return Tessellation(vertices, triangles, mesh.parent[source], barycentric), source


def _midpoints(mesh: Tessellation, parents: Int64, marked: Bool, places: Float64) -> tuple[Int32, Float64]:
    """One new vertex for each marked edge (n, 3) of the parents (n,), shared by the triangles on both of its sides."""
    count = len(mesh.vertices)
    keys = edge_keys(mesh.triangles[parents], count)[marked]
    unique, at, number = distinct(keys)
    first, second, along = unique // count, unique % count, places[marked][at, None]
    midpoint = np.full(marked.shape, -1, dtype=np.int32)
    midpoint[marked] = count + number
    between = (1.0 - along) * mesh.vertices[first] + along * mesh.vertices[second]
    return midpoint, np.concatenate([mesh.vertices, between])


def edge_keys(triangles: Int32, vertices: int) -> Int64:
    """(t, 3) a number for each edge, the same in both triangles that share it."""
    start, end = triangles.astype(np.int64), triangles[:, [1, 2, 0]]
    return np.asarray(np.minimum(start, end) * vertices + np.maximum(start, end))


def _turned(
    mesh: Tessellation, parents: Int64, midpoint: Int32, marked: Bool, places: Float64
) -> tuple[Int32, Float64]:
    """Vertices (n, 6) and weights (n, 6, 3) of corners and edge midpoints, turned so that the split edges come first:
    ab when one is split, ab and bc when two are."""
    barycentric, corners = mesh.barycentric[parents], mesh.triangles[parents]
    six = np.concatenate([corners, midpoint], axis=1)
    along = np.where(corners < corners[:, [1, 2, 0]], places, 1.0 - places)[:, :, None]
    weights = np.concatenate([barycentric, (1.0 - along) * barycentric + along * barycentric[:, [1, 2, 0]]], axis=1)
    number = np.count_nonzero(marked, axis=1)
    turn = np.where(number == 1, np.argmax(marked, axis=1), 0)
    turn = np.where(number == 2, (np.argmin(marked, axis=1) + 1) % 3, turn)
    for number_of_turns, order in ((1, [1, 2, 0, 4, 5, 3]), (2, [2, 0, 1, 5, 3, 4])):
        chosen = turn == number_of_turns
        six[chosen], weights[chosen] = six[chosen][:, order], weights[chosen][:, order]
    return six, weights


def _templates(count: np.ndarray, vertices: Float64, six: Int32) -> list[tuple[np.ndarray, np.ndarray]]:
    """Which split triangles take which set of children; a quad is cut along its shorter diagonal."""
    two = np.flatnonzero(count == 2)
    a_to_e = np.linalg.norm(vertices[six[two, 0]] - vertices[six[two, 4]], axis=1)
    d_to_c = np.linalg.norm(vertices[six[two, 3]] - vertices[six[two, 2]], axis=1)
    shorter = a_to_e <= d_to_c
    return [
        (_TWO, np.flatnonzero(count == 1)),
        (_THREE_AE, two[shorter]),
        (_THREE_DC, two[~shorter]),
        (_FOUR, np.flatnonzero(count == 3)),
    ]


def edge_for_count(vertices: list[Float64], triangles: list[Int32], wanted: int) -> float:
    """The longest edge (metres) at which about `wanted` triangles of that size would cover the meshes.

    Triangles that are smaller already count by their share of a full one, so that one dense mesh among coarse ones does
    not use up what all are to share. The count jumps by two or four where many edges have the same length, so it is met
    within a factor of two at worst.
    """
    measures = _Measures.of(vertices, triangles)
    candidates = 2.0 * np.sqrt(measures.area.sum() / max(wanted, 1)) * 2.0 ** np.linspace(-2, 2, 33)
    # The longer the edge the fewer triangles, so the best stands on either side of where the count crosses.
    sizes = list(range(len(candidates)))
    crosses = bisect_left(sizes, -float(wanted), key=lambda k: -measures.full_sized(candidates[k]))
    beside = [k for k in (crosses - 1, crosses) if k in sizes]
    counts = {k: measures.full_sized(candidates[k]) for k in beside}
    best = min(beside, key=lambda k: abs(np.log(counts[k] / wanted)))
    edge, count = float(candidates[best]), counts[best]
    while count > 4 * wanted:  # Needles: by its area alone one of 1e20 to 1 would be cut into ten thousand million.
        edge *= 2.0
        count = measures.full_sized(edge)
    return edge


def predicted_count(vertices: list[Float64], triangles: list[Int32], longest_edge: float) -> int:
    """About how many triangles the meshes together split into."""
    return int(_Measures.of(vertices, triangles).children(longest_edge).sum())


@dataclass(frozen=True, eq=False)
class _Measures:
    """Of some triangles (t,): how long the longest and the second longest edge are, as logarithms to base 2, and the
    area."""

    longest: Float64
    second: Float64
    area: Float64

    @staticmethod
    def of(vertices: list[Float64], triangles: list[Int32]) -> _Measures:
        corners = np.concatenate([v[t] for v, t in zip(vertices, triangles, strict=True)])
        first, second, third = corners.transpose(1, 2, 0)
        edges = second - first, third - second, first - third
        one, two = edges[:2]
        cross = [one[i] * two[j] - one[j] * two[i] for i, j in ((1, 2), (2, 0), (0, 1))]
        a, b, c = (np.maximum((edge * edge).sum(axis=0), np.finfo(float).tiny) for edge in edges)
        larger, lesser = np.maximum(a, b), np.minimum(a, b)
        longest, second_longest = np.maximum(larger, c), np.maximum(lesser, np.minimum(larger, c))
        area = np.sqrt(cross[0] ** 2 + cross[1] ** 2 + cross[2] ** 2) / 2.0
        return _Measures(np.log2(longest) / 2.0, np.log2(second_longest) / 2.0, area)

    def children(self, size: float) -> Float64:
        """Triangles that each splits into, from the number of halvings of its edges: exact for three equal depths."""
        depths = [np.maximum(np.ceil(edge - np.log2(size) - _SAME), 0.0) for edge in (self.longest, self.second)]
        return np.asarray(np.exp2(depths[0] + depths[1]))

    def full_sized(self, size: float) -> float:
        """Triangles after splitting, small ones counted by their share of a right-angled one with the longest edge."""
        share = np.minimum(self.area / (size * size / 4), 1.0)
        larger = np.flatnonzero(self.longest > np.log2(size) + _SAME)
        share[larger] = self.only(larger).children(size)
        return max(float(share.sum()), 1e-9)

    def only(self, chosen: Int64) -> _Measures:
        return _Measures(self.longest[chosen], self.second[chosen], self.area[chosen])
