"""Whether anything can stand in the light of the lamps: not where all surfaces lie around them like a convex shell."""

from __future__ import annotations

import numpy as np

from .patches import triangle_geometry
from .scene import AreaLamp, Float64, Lamp, PointLamp, Scene, SpotLamp, SunLamp

#: Of the extent: what sticks out of a plane by less counts as within it.
_FLAT = 1e-6
#: Triangles looked at together; how many of them, and products of planes and points, are worth the answer.
_CHUNK, _MOST, _WORTH = 64, 20_000, 20_000_000


def nothing_stands_between(scene: Scene) -> bool:
    """Whether the plane of every triangle has all surfaces and all lamps on one side of it, so that no way from a
    surface to a lamp can cross a triangle. False also where there are too many triangles to find out."""
    if sum(len(o.triangles) for o in scene.objects) > _MOST:
        return False
    corners = np.concatenate([o.vertices[o.triangles] for o in scene.objects])
    normals, area = triangle_geometry(corners)
    corners, normals = corners[area > 0], normals[area > 0]
    points = np.concatenate([o.vertices[np.unique(o.triangles)] for o in scene.objects])
    if len(corners) * len(points) > _WORTH or not len(points):
        return False
    extent = float(np.ptp(points, axis=0).max())
    places = np.concatenate([points, *[_places(lamp) for lamp in scene.lamps if not isinstance(lamp, SunLamp)]])
    ways = np.concatenate([np.zeros((0, 3)), *[_ways(lamp) for lamp in scene.lamps if isinstance(lamp, SunLamp)]])
    for begin in range(0, len(corners), _CHUNK):
        part = slice(begin, begin + _CHUNK)
        level = np.einsum("tk,tk->t", normals[part], corners[part, 0])
        height = np.concatenate([places @ normals[part].T - level, extent * (ways @ normals[part].T)])
        in_front, behind = (height > _FLAT * extent).any(axis=0), (height < -_FLAT * extent).any(axis=0)
        if (in_front & behind).any():
            return False
    return True


def _places(lamp: Lamp) -> Float64:
    """Corners of a box around the lamp."""
    match lamp:
        case PointLamp() | SpotLamp():
            signs = np.array(np.meshgrid(*[[-1.0, 1.0]] * 3)).reshape(3, -1).T
            return np.array(lamp.position) + lamp.radius * signs
        case AreaLamp():
            signs = np.array(np.meshgrid(*[[-1.0, 1.0]] * 2)).reshape(2, -1).T
            return np.array(lamp.center) + signs @ np.array([lamp.half_u, lamp.half_v])
        case SunLamp():
            return np.zeros((0, 3))


def _ways(sun: SunLamp) -> Float64:
    """The way to the middle of a sun, and to the corners of a square around it."""
    axis = -np.array(sun.direction) / np.linalg.norm(sun.direction)
    aside = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
    aside /= np.linalg.norm(aside)
    reach = np.tan(min(sun.angle, 3.1) / 2) * np.sqrt(2.0)
    turned = np.cross(axis, aside)
    return np.array([axis + reach * (x * aside + y * turned) for x, y in ((0, 0), (1, 0), (-1, 0), (0, 1), (0, -1))])
