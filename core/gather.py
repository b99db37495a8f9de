"""Light at sample points of the receivers: indirect light from the solved patches, and direct light anew."""

from __future__ import annotations

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
    """The sample points of one pass: the pass-th point of an even sequence in each cell, of the cells in `chosen`."""

    def __init__(self, cells: Cells, chosen: np.ndarray, number: int, shift: Float64) -> None:
        self.weights = triangle_points(plane_points(np.full(len(chosen), number), shift[chosen]))
        self.positions = np.einsum("nc,nck->nk", self.weights, cells.corners[chosen])
        self.normals = cells.normals[chosen]
        self.size = np.sqrt(2.0 * cells.area[chosen])
        self.barycentric = self.weights
        if cells.barycentric is not None:
            self.barycentric = np.einsum("nc,nck->nk", self.weights, cells.barycentric[chosen])
        self.shading = self.normals
        if cells.shading is not None:
            blended = np.einsum("nc,nck->nk", self.weights, cells.shading[chosen])
            self.shading = blended / np.linalg.norm(blended, axis=1, keepdims=True)


def gather_indirect(
    points: Points, hemispheres: Hemispheres, tables: Float32, seed: int, number: int, workers: Workers
) -> tuple[Float64, Float64, Bool]:
    """Irradiance (n, k) at the points from tables (codes, k) of radiosity, its deviation (n, k), and the points (n,)
    from which nearly every ray meets the back of something: inside a solid, unless light gets there.

    The rays of a point are two independent sets; half their difference is how far the mean can be trusted.
    """
    columns = [np.ascontiguousarray(tables[:, k]) for k in range(tables.shape[1])]
    codes = hemispheres.codes

    def work(chunk: int, part: slice) -> tuple[Float64, Float64, Bool]:
        rng = stream(seed, f"gather {number}", chunk)
        code = hemispheres.cast(points.positions[part], points.normals[part], points.shading[part], rng)
        flat, rays = code.ravel(), code.shape[1] // 2
        halves = np.stack([np.add.reduce(column[flat].reshape(-1, rays), axis=1) for column in columns], axis=1)
        halves = halves.reshape(len(code), 2, -1).astype(np.float64) / rays
        irradiance = (halves[:, 0] + halves[:, 1]) / 2.0
        deviation = (halves[:, 0] - halves[:, 1]) / 2.0
        behind = ((code >= codes.triangles) & (code < codes.lost)).mean(axis=1)
        return irradiance, deviation, behind > _ENCLOSED

    parts = zip(*workers.map(work, len(points.positions), hemispheres.chunk), strict=True)
    irradiance, deviation, enclosed = (np.concatenate(p) for p in parts)
    return irradiance, deviation, enclosed


def gather_direct(
    points: Points, direct_light: DirectLight, shadow_rays: int, seed: int, number: int, workers: Workers
) -> Illumination:
    """Light at the points straight from lamps and emitting surfaces."""

    def work(chunk: int, part: slice) -> Illumination:
        rng = stream(seed, f"direct {number}", chunk)
        return direct_light.at(points.positions[part], points.normals[part], points.shading[part], shadow_rays, rng)

    parts = list(workers.map(work, len(points.positions), _CHUNK))
    return Illumination(
        np.concatenate([p.irradiance for p in parts]),
        np.concatenate([p.variance for p in parts]),
        np.concatenate([p.signature for p in parts]),
        sum(p.rays for p in parts),
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
