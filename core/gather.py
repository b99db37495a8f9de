"""Light at sample points of the receivers: indirect light from the solved patches, and direct light anew."""

from __future__ import annotations

from collections import Counter
from copy import copy

import numpy as np

from .direct.illumination import DirectLight, Illumination
from .hemisphere import Hemispheres
from .parallel import Workers
from .patches import Cells
from .sampling import plane_points, stream, triangle_points
from .scene import Bool, Float32, Float64

#: Share of rays that must meet backs before a dark point counts as inside a solid.
_ENCLOSED = 0.75
_CHUNK = 8192


class Points:
    """A point in each of the cells in `chosen`, at its barycentric weights (n, 3)."""

    @classmethod
    def of_pass(cls, cells: Cells, chosen: np.ndarray, number: int | np.ndarray, shift: Float64) -> Points:
        """The sample points of one pass, or of one (n,) each: the pass-th point of an even sequence in each cell."""
        weights = triangle_points(plane_points(np.full(len(chosen), number), shift[chosen]))
        # All cells, as they are, need no copies.
        every = len(chosen) == len(cells) and np.array_equal(chosen, np.arange(len(cells)))
        return cls(cells, slice(None) if every else chosen, weights)

    def __init__(self, cells: Cells, chosen: np.ndarray | slice, weights: Float64) -> None:
        self.weights = weights
        self.positions = np.einsum("nc,nck->nk", self.weights, cells.corners[chosen])
        self.normals = cells.normals[chosen]
        self.size = np.sqrt(2.0 * cells.area[chosen])
        self.barycentric = self.weights
        if cells.barycentric is not None:
            self.barycentric = np.einsum("nc,nck->nk", self.weights, cells.barycentric[chosen])
        self.shading = self.normals
        if cells.shading is not None:
            blended = np.einsum("nc,nck->nk", self.weights, cells.shading[chosen])
            length = np.linalg.norm(blended, axis=1, keepdims=True)
            self.shading = blended / np.maximum(length, 1e-30)  # 0 on a face without area
        self.front = None if cells.front is None else cells.front[cells.surface[chosen]]

    def lit_from_behind(self) -> np.ndarray:
        """Numbers of the points where light that arrives on the back counts too."""
        return np.flatnonzero((self.front < 1).any(axis=1)) if self.front is not None else np.empty(0, dtype=np.int64)

    def only(self, chosen: np.ndarray | slice) -> Points:
        """Some of the points, as seen from their fronts alone."""
        some = copy(self)
        some.front = None
        some.weights, some.barycentric = self.weights[chosen], self.barycentric[chosen]
        some.positions, some.size = self.positions[chosen], self.size[chosen]
        some.normals, some.shading = self.normals[chosen], self.shading[chosen]
        return some

    def behind(self, chosen: np.ndarray) -> Points:
        """The same places on the back of the surface."""
        turned = self.only(chosen)
        turned.normals, turned.shading = -turned.normals, -turned.shading
        return turned

    def share(self, chosen: np.ndarray, columns: int) -> Float64:
        """Share (n, columns) of the front in the light that counts: red, green and blue over and over, and grey."""
        front = np.ones((len(chosen), 3)) if self.front is None else self.front[chosen]
        share = np.tile(front, (1, columns // 3 + 1))[:, :columns]
        if columns % 3:
            share[:, -1] = front.mean(axis=1)
        return share


def gather_indirect(
    points: Points, hemispheres: Hemispheres, tables: Float32, seed: int, number: int, workers: Workers
) -> tuple[Float64, Float64, Bool, Counter[str]]:
    """Irradiance (n, k) at the points from tables (codes, k) of radiosity, its deviation (n, k), the points (n,) from
    which nearly every ray meets the back of something: inside a solid, unless light gets there; and the rays it took.

    The rays of a point are two independent sets; half their difference is how far the mean can be trusted.
    """
    irradiance, deviation, enclosed, rays = _gather(points, hemispheres, tables, seed, f"gather {number}", workers)
    lit = points.lit_from_behind()
    if len(lit):
        purpose = f"gather behind {number}"
        other = _gather(points.behind(lit), hemispheres, tables, seed, purpose, workers)
        share = points.share(lit, tables.shape[1])
        irradiance[lit] = share * irradiance[lit] + (1.0 - share) * other[0]
        deviation[lit] = share * deviation[lit] + (1.0 - share) * other[1]
        enclosed[lit] &= other[2]
        rays += other[3]
    return irradiance, deviation, enclosed, rays


def _gather(
    points: Points, hemispheres: Hemispheres, tables: Float32, seed: int, purpose: str, workers: Workers
) -> tuple[Float64, Float64, Bool, Counter[str]]:
    columns = [np.ascontiguousarray(tables[:, k]) for k in range(tables.shape[1])]
    codes = hemispheres.codes

    def work(chunk: int, part: slice) -> tuple[Float64, Float64, Bool, Counter[str]]:
        rng = stream(seed, purpose, chunk)
        looks = hemispheres.cast(points.positions[part], points.normals[part], points.shading[part], rng)
        code = looks.code
        flat, rays = code.ravel(), code.shape[1] // 2
        if looks.mirrored is not None and len(tables) > hemispheres.code_count:
            flat = flat + hemispheres.code_count * looks.mirrored.ravel()
        tint = None if looks.tint is None else looks.tint.reshape(-1, 3)

        def brought(k: int) -> Float32:
            """Sums over the rays of each half of what column k says they bring."""
            values = columns[k][flat]
            if tint is not None:
                # Columns come as red, green and blue, over and over, and perhaps one of grey at the end.
                grey = k % 3 == 0 and k == len(columns) - 1
                values *= tint.mean(axis=1) if grey else tint[:, k % 3]
            return np.asarray(np.add.reduce(values.reshape(-1, rays), axis=1))

        halves = np.stack([brought(k) for k in range(len(columns))], axis=1)
        halves = halves.reshape(len(code), 2, -1).astype(np.float64) / rays
        irradiance = (halves[:, 0] + halves[:, 1]) / 2.0
        deviation = (halves[:, 0] - halves[:, 1]) / 2.0
        behind = codes.of_backs(code).mean(axis=1)
        rays_cast = Counter({"gather": code.size, "onward": looks.onward, "cut off": looks.cut})
        return irradiance, deviation, behind > _ENCLOSED, rays_cast

    *parts, cast = zip(*workers.map(work, len(points.positions), hemispheres.chunk), strict=True)
    irradiance, deviation, enclosed = (np.concatenate(p) for p in parts)
    return irradiance, deviation, enclosed, sum(cast, Counter())


def gather_direct(
    points: Points, direct_light: DirectLight, shadow_rays: int, seed: int, number: int, workers: Workers
) -> Illumination:
    """Light at the points straight from lamps and emitting surfaces."""
    light = _gather_direct(points, direct_light, shadow_rays, seed, f"direct {number}", workers)
    lit = points.lit_from_behind()
    if not len(lit):
        return light
    other = _gather_direct(points.behind(lit), direct_light, shadow_rays, seed, f"direct behind {number}", workers)
    share = points.share(lit, 3)
    irradiance, variance, signature = light.irradiance.copy(), light.variance.copy(), light.signature.copy()
    irradiance[lit] = share * light.irradiance[lit] + (1.0 - share) * other.irradiance
    variance[lit] = share**2 * light.variance[lit] + (1.0 - share) ** 2 * other.variance
    partly = (signature[lit] < 0) | (other.signature < 0)
    signature[lit] = np.where(partly, -1, signature[lit] + 3 * other.signature)
    reached = light.reached.copy()
    reached[lit] |= other.reached
    return Illumination(irradiance, variance, signature, reached, light.rays + other.rays)


def _gather_direct(
    points: Points, direct_light: DirectLight, shadow_rays: int, seed: int, purpose: str, workers: Workers
) -> Illumination:
    def work(chunk: int, part: slice) -> Illumination:
        rng = stream(seed, purpose, chunk)
        return direct_light.at(points.positions[part], points.normals[part], points.shading[part], shadow_rays, rng)

    parts = list(workers.map(work, len(points.positions), _CHUNK))
    return Illumination(
        np.concatenate([p.irradiance for p in parts]),
        np.concatenate([p.variance for p in parts]),
        np.concatenate([p.signature for p in parts]),
        np.concatenate([p.reached for p in parts]),
        sum((p.rays for p in parts), Counter()),
    )


def shadow_boundary(corner_vertex: np.ndarray, vertices: int, signatures: list[np.ndarray]) -> Bool:
    """Cells (c,) that see some light in part, or other lights than a cell they share a fit vertex with.

    corner_vertex (c, 3): fit vertices around each cell; signatures: of each pass, (c,) int64.
    """
    low = np.minimum.reduce(signatures)
    high = np.maximum.reduce(signatures)
    vertex_low = np.full(vertices, np.iinfo(np.int64).max)
    vertex_high = np.full(vertices, np.iinfo(np.int64).min)
    for corner in range(3):
        np.minimum.at(vertex_low, corner_vertex[:, corner], low)
        np.maximum.at(vertex_high, corner_vertex[:, corner], high)
    changes = (vertex_low < 0) | (vertex_low != vertex_high)
    return np.asarray(changes[corner_vertex].any(axis=1))
