"""Bodies with closed forms: what the self-test bakes, and the tests."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from .scene import SceneObject, Vector


def triangles(
    name: str, vertices: ArrayLike, faces: ArrayLike, surface: int | ArrayLike = 0, *, receives: bool = True
) -> SceneObject:
    """A mesh of vertices (v, 3) metres and faces (t, 3); surface: one number for all faces, or (t,)."""
    indices = np.array(faces, dtype=np.int32)
    surfaces = np.broadcast_to(np.asarray(surface, dtype=np.int32), len(indices)).copy()
    return SceneObject(name, np.array(vertices, dtype=np.float64), indices, surfaces, receives=receives)


def polygon(name: str, corners: ArrayLike, surface: int = 0, *, receives: bool = True) -> SceneObject:
    """A convex polygon of corners (v, 3), v >= 3, counter-clockwise seen from its front, as a fan."""
    fan = [[0, k, k + 1] for k in range(1, len(np.asarray(corners)) - 1)]
    return triangles(name, corners, fan, surface, receives=receives)


def quad(
    name: str = "quad",
    corner: Vector = (0, 0, 0),
    u: Vector = (1, 0, 0),
    v: Vector = (0, 1, 0),
    surface: int = 0,
    *,
    receives: bool = True,
) -> SceneObject:
    """The parallelogram at `corner` with sides u and v, which faces cross(u, v)."""
    c, a, b = (np.array(way, dtype=np.float64) for way in (corner, u, v))
    return polygon(name, [c, c + a, c + a + b, c + b], surface, receives=receives)


def box(
    name: str = "box",
    low: Vector = (0, 0, 0),
    high: Vector = (1, 1, 1),
    surface: int | Sequence[int] = 0,
    *,
    inward: bool = False,
    receives: bool = True,
) -> SceneObject:
    """Twelve triangles on eight vertices; surface may be six numbers, of the faces -x, +x, -y, +y, -z, +z."""
    unit = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=np.float64)
    faces: list[list[int]] = []
    for axis in range(3):
        for side in (0, 1):
            corner = np.flatnonzero(unit[:, axis] == side)  # in the order of the two other axes
            a, b, c, d = (int(k) for k in corner[[0, 2, 3, 1]])
            outward = np.cross(unit[b] - unit[a], unit[c] - unit[a])[axis] * (2 * side - 1) > 0
            ring = [a, b, c, d] if outward != inward else [a, d, c, b]
            faces += [[ring[0], ring[1], ring[2]], [ring[0], ring[2], ring[3]]]
    vertices = np.array(low) + unit * (np.array(high, dtype=np.float64) - low)
    return triangles(name, vertices, faces, np.repeat(np.broadcast_to(surface, 6), 2), receives=receives)


def sphere(
    name: str = "sphere",
    radius: float = 1.0,
    level: int = 2,
    surface: int = 0,
    *,
    inward: bool = False,
    smooth: bool = False,
) -> SceneObject:
    """An octahedron with every triangle cut into four, `level` times, on the sphere: 8 * 4 ** level triangles."""
    vertices = [np.array(v, float) for v in ((1, 0, 0), (0, 1, 0), (0, 0, 1), (-1, 0, 0), (0, -1, 0), (0, 0, -1))]
    faces = [(0, 1, 2), (1, 3, 2), (3, 4, 2), (4, 0, 2), (1, 0, 5), (3, 1, 5), (4, 3, 5), (0, 4, 5)]
    for _ in range(level):
        middle: dict[tuple[int, int], int] = {}
        finer = []
        for a, b, c in faces:
            ends = []
            for one, two in ((a, b), (b, c), (c, a)):
                key = (min(one, two), max(one, two))
                if key not in middle:
                    middle[key] = len(vertices)
                    between = vertices[one] + vertices[two]
                    vertices.append(between / np.linalg.norm(between))
                ends.append(middle[key])
            d, e, f = ends
            finer += [(a, d, f), (d, b, e), (f, e, c), (d, e, f)]
        faces = finer
    positions = np.array(vertices)
    order = np.array(faces)[:, ::-1] if inward else np.array(faces)
    made = triangles(name, positions * radius, order, surface)
    normals = (positions[order] * (-1 if inward else 1)).astype(np.float32) if smooth else None
    return SceneObject(name, made.vertices, made.triangles, made.surface, normals)
