"""How far a bake is from a reference: both at the same random points of the receivers' surface.

A reference holds three independent estimates of the true radiance at each point. Their noise would be counted as error
of the bake if each were squared, so squared errors are products of the differences from two of them, whose noise has
nothing to do with each other: right on average, however noisy the reference is.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import cast

import numpy as np

from .patches import shading_normals, triangle_geometry
from .result import BakedObject
from .sampling import stream
from .scene import Bool, Float64, Int32, Scene, SceneError
from .tessellation import Int64

#: The typical error leaves this share of the points out: the worst.
WORST = 0.02
#: Two different estimates at a time, and the third.
_TURNS = ((0, 1, 2), (1, 2, 0), (2, 0, 1))


@dataclass(frozen=True, eq=False)
class SurfacePoints:
    """Points (p,) on the receivers, evenly by area.

    names of the receivers, as Scene.receivers() has them; receiver (p,) int32 into names; triangle (p,) int32 of it;
    barycentric (p, 3) there; position (p, 3) in world space; normal (p, 3) of the triangle and shading (p, 3), the
    shading normal, both of length 1.
    """

    names: tuple[str, ...]
    receiver: Int32
    triangle: Int32
    barycentric: Float64
    position: Float64
    normal: Float64
    shading: Float64

    def __len__(self) -> int:
        return len(self.receiver)


@dataclass(frozen=True)
class Figures:
    """Errors relative to the mean true radiance (0.02 is 2 %), as the design defines them.

    surface: root mean square; typical: the same without the worst 2 % of the points; bias: mean difference;
    uncertainty: standard error of the surface error, from how few points there are and how noisy the reference is.
    """

    surface: float
    typical: float
    bias: float
    uncertainty: float


def scatter(scene: Scene, count: int, seed: int) -> SurfacePoints:
    """Random points on the receivers, one in each of `count` equal shares of their area."""
    receivers = scene.receivers()
    corners = [r.vertices[r.triangles] for r in receivers]
    areas = [triangle_geometry(c)[1] for c in corners]
    shading = []
    for receiver, own in zip(receivers, corners, strict=True):
        every = np.arange(len(own), dtype=np.int32)
        whole = np.broadcast_to(np.eye(3), (len(own), 3, 3))
        shading.append(shading_normals(receiver, every, whole, triangle_geometry(own)[0]))

    rng = stream(seed, "comparison")
    area = np.concatenate(areas)
    share = (np.arange(count) + rng.random(count)) / count
    chosen = np.minimum(np.searchsorted(np.cumsum(area), share * area.sum()), len(area) - 1)
    u, v = rng.random((2, count))
    root = np.sqrt(u)
    barycentric = np.column_stack([1.0 - root, root * (1.0 - v), root * v])

    sizes = [len(a) for a in areas]
    first = np.cumsum([0, *sizes[:-1]])
    receiver = np.repeat(np.arange(len(sizes)), sizes)[chosen]
    own_corners = np.concatenate(corners)[chosen]
    smooth = np.einsum("pc,pck->pk", barycentric, np.concatenate(shading)[chosen])
    return SurfacePoints(
        tuple(r.name for r in receivers),
        receiver.astype(np.int32),
        (chosen - first[receiver]).astype(np.int32),
        barycentric,
        np.einsum("pc,pck->pk", barycentric, own_corners),
        triangle_geometry(own_corners)[0],
        smooth / np.maximum(np.linalg.norm(smooth, axis=1, keepdims=True), np.finfo(float).tiny),
    )


def radiance_at(objects: Sequence[BakedObject], points: SurfacePoints, layer: str = "combined") -> Float64:
    """The interpolated layer (p, 3) of a bake at the points; objects in any order."""
    values = np.zeros((len(points), 3))
    for baked in objects:
        own = np.flatnonzero(points.receiver == points.names.index(baked.name))
        element, weights = locate(baked, points.triangle[own], points.barycentric[own])
        values[own] = np.einsum("pc,pck->pk", weights, baked.layers[layer][element].astype(np.float64))
    return values


def locate(baked: BakedObject, triangle: Int32, barycentric: Float64) -> tuple[Int64, Float64]:
    """The output triangle (p,) that holds each point, and its weights (p, 3) there.

    The points are given by input triangle (p,) and barycentric coordinates (p, 3). Each input triangle is covered by a
    grid of cells, and a point is tried in those output triangles only that reach into its cell.
    """
    pieces = np.bincount(baked.parent, minlength=int(triangle.max(initial=0)) + 1)
    resolution = np.ceil(np.sqrt(pieces)).astype(np.int64)
    first = np.concatenate([[0], np.cumsum(resolution**2)])

    grid = resolution[baked.parent][:, None]
    low = np.floor(baked.barycentric.min(axis=1)[:, :2] * grid - 1e-9).astype(np.int64).clip(0, grid - 1)
    high = np.floor(baked.barycentric.max(axis=1)[:, :2] * grid + 1e-9).astype(np.int64).clip(0, grid - 1)
    wide, tall = (high - low + 1).T
    piece, step = _ragged(wide * tall)
    column, row = low[piece, 0] + step % wide[piece], low[piece, 1] + step // wide[piece]
    cell = first[baked.parent[piece]] + row * resolution[baked.parent[piece]] + column
    order = np.argsort(cell, kind="stable")
    begin = np.concatenate([[0], np.cumsum(np.bincount(cell, minlength=int(first[-1])))])

    own_grid = resolution[triangle]
    at = np.floor(barycentric[:, :2] * own_grid[:, None]).astype(np.int64).clip(0, own_grid[:, None] - 1)
    point_cell = first[triangle] + at[:, 1] * own_grid + at[:, 0]
    point, step = _ragged(begin[point_cell + 1] - begin[point_cell])
    candidate = piece[order[begin[point_cell[point]] + step]]
    weights = np.einsum("pi,pij->pj", barycentric[point], np.linalg.inv(baked.barycentric)[candidate])

    inside = weights.min(axis=1)
    best = np.lexsort((-inside, point))
    best = best[np.flatnonzero(np.diff(point[best], prepend=-1))]
    return candidate[best], weights[best]


def visible(scene: Scene, points: SurfacePoints, reference: Float64) -> Bool:
    """Points (p,) that somebody may see. No light at all on a surface that reflects means the inside of a solid, or the
    far side of everything."""
    albedo = np.array([max(s.scattered) for s in scene.surfaces])
    reflects = np.zeros(len(points), dtype=bool)
    for number, receiver in enumerate(scene.receivers()):
        own = points.receiver == number
        reflects[own] = albedo[receiver.surface[points.triangle[own]]] > 0.0
    return np.asarray(~reflects | reference.any(axis=(1, 2)))


def figures(values: Float64, reference: Float64) -> Figures:
    """The errors of values (p, 3) against three independent estimates (p, 3, 3), [point, estimate, channel], of each.

    Raises SceneError where the reference is black: then nothing can be relative to it.
    """
    mean = float(reference.mean())
    if mean <= 0.0:
        raise SceneError("The reference is black: no light reaches these objects, so there is nothing to compare.")
    squared = squared_errors(values, reference)
    surface = float(np.sqrt(max(squared.mean(), 0.0))) / mean
    spread = float(squared.std() / np.sqrt(len(squared))) / mean**2
    return Figures(
        surface=surface,
        typical=_typical_error(values, reference) / mean,
        bias=float(values.mean()) / mean - 1.0,
        # d sqrt(s) = ds / (2 sqrt(s)); where s itself drowns in noise, the root of the noise is all one can say.
        uncertainty=min(spread / (2.0 * surface), np.sqrt(spread)) if surface > 0.0 else float(np.sqrt(spread)),
    )


def squared_errors(values: Float64, reference: Float64) -> Float64:
    """Squared error (p,), mean over the channels, unbiased: single ones may be negative."""
    return np.asarray(sum(_products(values, reference)) / len(_TURNS))


def reference_noise(reference: Float64) -> float:
    """Root mean square noise of the mean of the three estimates, relative to the mean radiance."""
    mean = float(reference.mean())
    return float(np.sqrt(reference.var(axis=1, ddof=1).mean() / reference.shape[1])) / mean if mean > 0.0 else 0.0


def _typical_error(values: Float64, reference: Float64) -> float:
    """Which points are the worst is judged by one estimate, how wrong the others are by the two that did not judge:
    had all a say in both, the points left would be those where noise happens to hide the error."""
    dropped = int(WORST * len(values))
    kept_errors = []
    for (_, _, judge), product in zip(_TURNS, _products(values, reference), strict=True):
        judged = np.mean((values - reference[:, judge]) ** 2, axis=1)
        kept_errors.append(product[np.argsort(judged, kind="stable")[: len(values) - dropped]].mean())
    return float(np.sqrt(max(np.mean(kept_errors), 0.0)))


def _products(values: Float64, reference: Float64) -> Iterator[Float64]:
    difference = values[:, None] - reference
    for one, other, _ in _TURNS:
        yield cast(Float64, np.mean(difference[:, one] * difference[:, other], axis=1))


def _ragged(counts: Int64) -> tuple[Int64, Int64]:
    """For counts (n,): the number of the item that each entry belongs to, and its place there, 0 to count - 1."""
    owner = np.repeat(np.arange(len(counts)), counts)
    return owner, np.arange(len(owner)) - np.repeat(np.cumsum(counts) - counts, counts)
