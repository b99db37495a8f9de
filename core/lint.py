"""What is odd about a scene's meshes, before anyone wonders about the baked light: from arrays to findings.

All of it is bakeable. Each finding names an object and counts its triangles, so that a person can go and look.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from .patches import row_numbers
from .scene import ALBEDO_LIMIT, AreaLamp, Bool, Float64, Int32, PointLamp, Scene, SceneObject, SpotLamp

Kind = Literal["mixed winding", "inside out", "duplicate faces", "zero area", "albedo", "coarse"]

#: Relative to the mesh's extent: corners nearer than this are one, and lower triangles have no area.
_SAME, _THIN = 1e-5, 1e-7
#: A kept mesh is too coarse where edges are longer than this share of the distance to a lamp.
_COARSE = 1.0


@dataclass(frozen=True)
class Finding:
    """kind; name of the object, or for `albedo` of the surface; count of its triangles that are concerned."""

    kind: Kind
    name: str
    count: int


def findings(scene: Scene, *, kept: bool = False) -> list[Finding]:
    """Everything odd about the receivers and their surfaces. kept: their meshes are to be kept as they are."""
    found = []
    for receiver in scene.receivers():
        corners = receiver.vertices[receiver.triangles]
        counts: dict[Kind, int] = {
            "mixed winding": int(np.count_nonzero(mixed_winding(receiver.triangles))),
            "zero area": int(np.count_nonzero(zero_area(corners))),
            "duplicate faces": int(np.count_nonzero(duplicates(corners))),
        }
        if not counts["mixed winding"] and is_inside_out(receiver, scene):
            counts["inside out"] = len(receiver.triangles)
        if kept:
            counts["coarse"] = int(np.count_nonzero(too_coarse(corners, scene)))
        found += [Finding(kind, receiver.name, count) for kind, count in counts.items() if count]
    used = [np.bincount(o.surface, minlength=len(scene.surfaces)) for o in scene.objects]
    for surface, count in zip(scene.surfaces, np.sum(used, axis=0), strict=True):
        if count and max(surface.albedo) >= ALBEDO_LIMIT:  # Readers have clipped it there.
            found.append(Finding("albedo", surface.name, int(count)))
    return found


def mixed_winding(triangles: Int32) -> Bool:
    """Triangles (t,) with a neighbour whose front is on the other side: both run along the shared edge the same way."""
    start, end = triangles.astype(np.int64), triangles[:, [1, 2, 0]].astype(np.int64)
    count = int(triangles.max(initial=0)) + 1
    way = (start * count + end).ravel()
    edge = (np.minimum(start, end) * count + np.maximum(start, end)).ravel()
    _, which, uses = np.unique(edge, return_inverse=True, return_counts=True)
    _, same, alike = np.unique(way, return_inverse=True, return_counts=True)
    # Where more than two faces meet in an edge, no winding is right for all.
    odd = (alike[same.reshape(-1)] > 1) & (uses[which.reshape(-1)] == 2)
    return np.asarray(odd.reshape(-1, 3).any(axis=1))


def zero_area(corners: Float64) -> Bool:
    """Triangles (t,) whose height is nothing beside the extent of all, corners (t, 3, 3)."""
    edges = corners[:, [1, 2, 0]] - corners
    longest = np.linalg.norm(edges, axis=2).max(axis=1)
    area = np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1)
    return np.asarray(area <= _THIN * _extent(corners) * longest)


def duplicates(corners: Float64) -> Bool:
    """Triangles (t,) that lie exactly on one before them."""
    grid = np.rint(corners / (_SAME * _extent(corners))).astype(np.int64)
    order = np.lexsort((grid[..., 2], grid[..., 1], grid[..., 0]), axis=1)
    ordered = np.take_along_axis(grid, order[..., None], axis=1).reshape(len(grid), 9)
    _, first, which = np.unique(row_numbers(ordered), return_index=True, return_inverse=True)
    return np.asarray(first[which] != np.arange(len(grid)))


def is_inside_out(receiver: SceneObject, scene: Scene) -> bool:
    """Is it closed, with its fronts on the inside, though nothing is in there? A room has lamps or things in it."""
    start, end = np.sort(np.stack([receiver.triangles, receiver.triangles[:, [1, 2, 0]]]), axis=0).reshape(2, -1)
    _, uses = np.unique(start.astype(np.int64) * (int(end.max(initial=0)) + 1) + end, return_counts=True)
    if (uses != 2).any():
        return False
    low, high = receiver.vertices.min(axis=0), receiver.vertices.max(axis=0)
    a, b, c = np.moveaxis(receiver.vertices[receiver.triangles] - (low + high) / 2, 1, 0)
    if np.einsum("tk,tk->", a, np.cross(b, c)) >= 0:
        return False
    things = [lamp_place(lamp) for lamp in scene.lamps if isinstance(lamp, PointLamp | SpotLamp | AreaLamp)]
    things += [o.vertices.mean(axis=0) for o in scene.objects if o is not receiver]
    return not any(((low < place) & (place < high)).all() for place in things)


def too_coarse(corners: Float64, scene: Scene) -> Bool:
    """Triangles (t,) with an edge that is longer than a lamp is far: four corner values cannot show its light."""
    coarse = np.zeros(len(corners), dtype=bool)
    longest = np.linalg.norm(corners[:, [1, 2, 0]] - corners, axis=2).max(axis=1)
    for lamp in scene.lamps:
        if isinstance(lamp, PointLamp | SpotLamp | AreaLamp):
            away = np.linalg.norm(corners.mean(axis=1) - lamp_place(lamp), axis=1)
            coarse |= longest > _COARSE * away
    return coarse


def lamp_place(lamp: PointLamp | SpotLamp | AreaLamp) -> Float64:
    return np.array(lamp.center if isinstance(lamp, AreaLamp) else lamp.position)


def _extent(corners: Float64) -> float:
    return float(np.ptp(corners.reshape(-1, 3), axis=0).max(initial=0.0)) or 1.0
