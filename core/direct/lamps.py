"""Lamps as a receiver sees them: how much arrives when nothing is in the way, and where to aim shadow rays.

Every lamp answers two questions, for points in the unit box:
- `unoccluded(points, normals)`: the share of its light that arrives, (n,), so that irradiance = share * colour;
- `aim(points, normals, unit)`: targets (n, r, 3) spread over the lamp, the weight (n, r) of the light from each if the
  lamp shone alike in all directions, and the gain (n, r), how much of that it really sends this way.
Irradiance is colour * share * (sum of weight * gain of the free targets / sum of all weights): exact wherever no target
is blocked and the lamp shines evenly.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np

from ..form_factors.polygon import polygon_irradiance
from ..patches import Space
from ..sampling import disc_points
from ..scene import AreaLamp, Float64, Lamp, PointLamp, SpotLamp, SunLamp
from .cap import cap_irradiance

#: An ellipse is the polygon of this many corners and of the same area; its irradiance is off by less than 1e-3.
_ELLIPSE_CORNERS = 32
#: How far away the targets of a sun are, in half extents of the scene: beyond every occluder.
_BEYOND = 8.0


#: Targets (n, r, 3), weights (n, r), gains (n, r).
Aim = tuple[Float64, Float64, Float64]


class Light(Protocol):
    """A light source in the unit box. color (3,) float64. sized: whether its shadows are soft."""

    name: str
    color: Float64
    sized: bool

    def unoccluded(self, points: Float64, normals: Float64) -> Float64: ...

    def aim(self, points: Float64, normals: Float64, unit: Float64) -> Aim: ...


def place(lamp: Lamp, space: Space) -> Light:
    """The lamp, moved into the unit box."""
    match lamp:
        case SunLamp():
            return Sun(lamp)
        case AreaLamp():
            return Panel.from_area_lamp(lamp, space)
        case SpotLamp():
            return Spot(lamp, space)
        case PointLamp():
            return Ball(lamp, space)


def cosines(directions: Float64, normals: Float64) -> Float64:
    """Cosine (n, r), not below zero, between directions (n, r, 3) of any length and normals (n, 3)."""
    length = np.sqrt(np.einsum("nrk,nrk->nr", directions, directions))
    return np.maximum(np.einsum("nrk,nk->nr", directions, normals), 0.0) / np.maximum(length, 1e-30)


def perpendicular(axis: Float64) -> tuple[Float64, Float64]:
    """Two unit vectors (n, 3) that complete each unit axis (n, 3) to a frame."""
    helper = np.where(np.abs(axis[:, :1]) > 0.7, [[0.0, 1.0, 0.0]], [[1.0, 0.0, 0.0]])
    first = np.cross(axis, helper)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    return first, np.cross(axis, first)


class Ball:
    """A point lamp: a point, a sphere, or a disc that turns to the receiver.

    A sphere looks like its silhouette: a disc a little nearer and a little smaller, so one set of formulas serves both.
    """

    def __init__(self, lamp: PointLamp | SpotLamp, space: Space) -> None:
        self.name = lamp.name
        self.position = space.normalise(np.array(lamp.position))
        self.radius = lamp.radius / space.metres
        self.facing_disc = lamp.facing_disc
        self.color = np.array(lamp.intensity) / space.metres**2
        self.sized = self.radius > 0

    def unoccluded(self, points: Float64, normals: Float64) -> Float64:
        axis, distance, radius, height = self._silhouette(points)
        cosine = np.einsum("nk,nk->n", axis, normals)
        if not self.sized:
            return np.maximum(cosine, 0.0) / np.maximum(distance, 1e-9) ** 2
        sine = np.where(height > 0, radius / np.sqrt(radius**2 + height**2), 2.0)
        return cap_irradiance(cosine, sine) / self.radius**2

    def aim(self, points: Float64, normals: Float64, unit: Float64) -> Aim:
        axis, _, radius, height = self._silhouette(points)
        if not self.sized:
            targets = np.broadcast_to(self.position, (len(points), unit.shape[1], 3))
            return targets, np.ones(unit.shape[:2]), self._gain(targets - points[:, None])
        first, second = perpendicular(axis)
        disc = disc_points(unit) * radius[:, None, None]
        targets = (points + axis * height[:, None])[:, None]
        targets = targets + disc[..., :1] * first[:, None] + disc[..., 1:] * second[:, None]
        towards = targets - points[:, None]
        squared = np.einsum("nrk,nrk->nr", towards, towards)
        weights = cosines(towards, normals) * height[:, None] / np.maximum(squared, 1e-30) ** 1.5
        return targets, weights, self._gain(targets - points[:, None])

    def _gain(self, towards: Float64) -> Float64:
        """What the lamp sends against the directions (n, r, 3) from the points, relative to one that shines evenly."""
        return np.ones(towards.shape[:2])

    def _silhouette(self, points: Float64) -> tuple[Float64, Float64, Float64, Float64]:
        """Unit axis (n, 3) and distance (n,) to the lamp; radius (n,) and height (n,) of the disc it looks like."""
        axis = self.position - points
        distance = np.linalg.norm(axis, axis=1)
        axis = axis / np.maximum(distance, 1e-30)[:, None]
        if self.facing_disc or not self.sized:
            return axis, distance, np.full(len(points), self.radius), distance
        inside = distance <= self.radius
        shrink = np.sqrt(np.maximum(1.0 - (self.radius / np.maximum(distance, self.radius)) ** 2, 0.0))
        return axis, distance, np.where(inside, self.radius, self.radius * shrink), distance * shrink**2


class Spot(Ball):
    """A ball behind a cone with a smooth edge."""

    def __init__(self, lamp: SpotLamp, space: Space) -> None:
        super().__init__(lamp, space)
        self.axes = np.array(lamp.axes)
        self.cosine = np.cos(lamp.cone_angle / 2)
        self.softness = max((1.0 - self.cosine) * lamp.blend, 1e-6)

    def _gain(self, towards: Float64) -> Float64:
        """Smoothstep between the cone's edge and its softer inside, by the angle seen in the lamp's own axes."""
        local = towards @ np.linalg.inv(self.axes)
        depth = local[..., 2] / np.maximum(np.linalg.norm(local, axis=-1), 1e-30)
        step = np.clip((depth - self.cosine) / self.softness, 0.0, 1.0)
        return step * step * (3.0 - 2.0 * step)


class Sun:
    """Parallel light from a disc in the sky."""

    def __init__(self, lamp: SunLamp) -> None:
        self.name = lamp.name
        self.color = np.array(lamp.irradiance)
        self.axis = -np.array(lamp.direction) / np.linalg.norm(lamp.direction)
        self.tangent = np.tan(min(lamp.angle, 0.999 * np.pi) / 2)
        self.sized = self.tangent > 1e-6
        self.frame = np.concatenate(perpendicular(self.axis[None]))

    def unoccluded(self, points: Float64, normals: Float64) -> Float64:
        cosine = normals @ self.axis
        if not self.sized:
            return np.maximum(cosine, 0.0)
        sine = self.tangent / np.sqrt(1.0 + self.tangent**2)
        return cap_irradiance(cosine, np.full(len(points), sine)) / sine**2

    def aim(self, points: Float64, normals: Float64, unit: Float64) -> Aim:
        directions = self.axis + self.tangent * (disc_points(unit) @ self.frame)
        return points[:, None] + _BEYOND * directions, cosines(directions, normals), np.ones(unit.shape[:2])


class Panel:
    """A flat convex polygon that emits alike over its area: an area lamp, or a triangle of an emitting surface."""

    def __init__(
        self, name: str, corners: Float64, radiance: Float64, *, two_sided: bool, spread: float = np.pi
    ) -> None:
        self.name = name
        self.corners = corners
        self.color = np.pi * radiance
        self.two_sided = two_sided
        self.half_spread = spread / 2
        self.sized = True
        normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
        self.normal = normal / np.linalg.norm(normal)

    @classmethod
    def from_area_lamp(cls, lamp: AreaLamp, space: Space) -> Panel:
        half_u, half_v = np.array(lamp.half_u) / space.metres, np.array(lamp.half_v) / space.metres
        if lamp.shape == "rectangle":
            outline = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]], dtype=float)
        else:
            turn = np.arange(_ELLIPSE_CORNERS) * 2 * np.pi / _ELLIPSE_CORNERS
            grow = np.sqrt(2 * np.pi / (_ELLIPSE_CORNERS * np.sin(2 * np.pi / _ELLIPSE_CORNERS)))
            outline = grow * np.column_stack([np.cos(turn), np.sin(turn)])
        if np.cross(half_u, half_v) @ np.array(lamp.normal) < 0:
            outline = outline[::-1]
        corners = space.normalise(np.array(lamp.center)) + outline @ np.stack([half_u, half_v])
        return cls(lamp.name, corners, np.array(lamp.radiance), two_sided=False, spread=lamp.spread)

    def unoccluded(self, points: Float64, normals: Float64) -> Float64:
        return polygon_irradiance(points, normals, self.corners, two_sided=self.two_sided)

    def aim(self, points: Float64, normals: Float64, unit: Float64) -> Aim:
        targets = self._spread(unit)
        towards = targets - points[:, None]
        squared = np.einsum("nrk,nrk->nr", towards, towards)
        behind = -np.einsum("nrk,k->nr", towards, self.normal)
        facing = np.abs(behind) if self.two_sided else np.maximum(behind, 0.0)
        weights = cosines(towards, normals) * facing / np.maximum(squared, 1e-30) ** 1.5
        return targets, weights, self._gain(facing / np.sqrt(np.maximum(squared, 1e-30)))

    def _gain(self, cosine: Float64) -> Float64:
        """The lamp's grid lets pass what lies within half the spread of its axis, less and less towards that angle:
        (tan h - tan a) / (tan h - h), as Cycles does it; cosine is that of a."""
        if self.half_spread >= np.pi / 2 - 1e-6:
            return np.ones_like(cosine)
        edge = np.tan(self.half_spread)
        tangent = np.sqrt(np.maximum(1.0 - cosine**2, 0.0)) / np.maximum(cosine, 1e-9)
        return np.maximum(edge - tangent, 0.0) / (edge - self.half_spread)

    def _spread(self, unit: Float64) -> Float64:
        """Points (n, r, 3) of the polygon, uniform, from points (n, r, 2) of the unit square."""
        corners = self.corners
        if len(corners) == 3:
            from_square = np.sqrt(unit[..., :1])
            along = unit[..., 1:]
            return (
                corners[0]
                + from_square * (1 - along) * (corners[1] - corners[0])
                + from_square * along * (corners[2] - corners[0])
            )
        if len(corners) == 4:
            return corners[0] + unit[..., :1] * (corners[1] - corners[0]) + unit[..., 1:] * (corners[3] - corners[0])
        center = corners.mean(axis=0)
        quarter = len(corners) // 4
        axes = np.stack([corners[0] - center, corners[quarter] - center])
        return center + disc_points(unit) @ axes
