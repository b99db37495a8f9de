"""Lamps as a receiver sees them: how much arrives when nothing is in the way, and where to aim shadow rays.

Every lamp answers three questions, for points in the unit box:
- `share(points, normals)`: how much of its light arrives, (n,), as if it shone evenly: irradiance = share * colour;
- `aim(points, unit)`: ways from the points to places spread over the lamp, and how much of its sky each stands for;
- `gain(points, ways)`: how much of an even lamp's light it really sends along these ways, (r, n) or by channel
  (3, r, n), or None for all of it.
The mean over all ways of cos(receiver, way) * solid is the share, where nothing is in the way. The arrays of ways have
components and samples first, (3, r, n), in single precision: numpy then runs along the points.
"""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass
from typing import Any, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from ..form_factors.polygon import polygon_irradiance
from ..patches import Space
from ..scene import AreaLamp, Float32, Float64, Lamp, PointLamp, SpotLamp, SunLamp
from .cap import cap_irradiance
from .solid_angle import rectangle_places, triangle_directions

Real = TypeVar("Real", np.float32, np.float64)

#: An ellipse is the polygon of this many corners and of the same area; its irradiance is off by less than 1e-3.
_ELLIPSE_CORNERS = 32
#: How far away the targets of a sun are, in half extents of the scene: beyond every occluder.
BEYOND = np.float32(8)
#: Nearer than this many diameters, places on a flat lamp are spread over its solid angle, farther over its area.
_NEAR = 0.75
#: Solid angles below this cancel; they belong to lamps that are seen edge-on.
_SLIVER = 1e-5


@dataclass(frozen=True, eq=False)
class Ways:
    """Ways from points to places on a lamp. towards (3, r, n), from end to end; inverse (r, n) of their lengths; solid
    (r, n): the sky that each stands for, in the unit of the lamp's share."""

    towards: Float32
    inverse: Float32
    solid: Float32


class Light(Protocol):
    """A light source in the unit box. color (3,) float64. sized: whether its shadows are soft; casts_shadow: whether
    it has any; round: whether it looks like a disc.

    Lights of one class and kind can be asked together, see `crowd`: as one light with an array of each of the numbers
    that `each` names. What stands alone names none.
    """

    name: str
    color: Float64
    sized: bool
    casts_shadow: bool
    round: bool
    even: bool
    each: tuple[str, ...]
    kind: tuple[object, ...]

    def share(self, points: Float64, normals: Float64) -> Float64: ...

    def aim(self, points: Float32, unit: Float32) -> Ways: ...

    def gain(self, points: Float32, ways: Ways) -> Float32 | None: ...

    def only(self, chosen: NDArray[np.int64]) -> Light: ...


Lights = TypeVar("Lights", bound=Light)


def some_of(lights: Lights, chosen: Any) -> Lights:
    """Of lights that are asked together those with the chosen numbers, any index."""
    some = copy(lights)
    for name in lights.each:
        setattr(some, name, getattr(lights, name)[chosen])
    return some


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


def _column(vectors: Float64) -> Float64:
    """A vector (3,) as (3, 1), to broadcast over points; or one vector for each point (n, 3) as (3, n)."""
    return np.atleast_2d(vectors).T


def _spread(towards: Float32, depth: Float32, scale: Float32 | float) -> Ways:
    """Ways to places spread evenly over a flat lamp. depth (r, n): of the lamp along them; scale: its area."""
    inverse = 1 / np.sqrt(np.maximum((towards * towards).sum(axis=0), np.float32(1e-30)))
    # The cosine first: where a receiver touches the lamp, a third power would be infinite, and that times no depth.
    return Ways(towards, inverse, depth * inverse * inverse**2 * np.float32(scale))


def frame(axis: Float32) -> tuple[Float32, Float32]:
    """Two unit vectors (3, n) that complete each unit axis (3, n) to a frame (Duff et al. 2017)."""
    x, y, z = axis
    sign = np.where(z >= 0, np.float32(1), np.float32(-1))
    a = -1 / (sign + z)
    b = x * y * a
    return np.stack([1 + sign * x * x * a, sign * b, -sign * x]), np.stack([b, sign + y * y * a, -y])


def disc(unit: Float32) -> tuple[Float32, Float32]:
    """Points (2, r, n) of the unit square to the coordinates of points of the unit disc, (r, n) each, uniform."""
    radius, angle = np.sqrt(unit[0]), np.float32(2 * np.pi) * unit[1]
    return radius * np.cos(angle), radius * np.sin(angle)


class Ball:
    """A point lamp: a point, a sphere, or a disc that turns to the receiver.

    A sphere looks like its silhouette: a disc a little nearer and a little smaller, so one set of formulas serves both.
    The same formulas serve many lamps at once, whose numbers are then arrays, see `crowd`.
    """

    round = True
    even = True
    #: What there is one of for each lamp.
    each: tuple[str, ...] = ("position", "radius")

    def __init__(self, lamp: PointLamp | SpotLamp, space: Space) -> None:
        self.name = lamp.name
        self.position = space.normalise(np.array(lamp.position))
        self.radius: Any = lamp.radius / space.metres
        self.facing_disc = lamp.facing_disc
        self.color = np.array(lamp.intensity) / space.metres**2
        self.sized = self.radius > 0
        self.casts_shadow = lamp.casts_shadow
        self.kind: tuple[object, ...] = self.sized, self.casts_shadow, self.facing_disc

    def share(self, points: Float64, normals: Float64) -> Float64:
        x, y, z = self._towards(points)
        distance = np.sqrt(x * x + y * y + z * z)
        cosine = (x * normals[:, 0] + y * normals[:, 1] + z * normals[:, 2]) / np.maximum(distance, 1e-30)
        if not self.sized:
            return np.maximum(cosine, 0.0) / np.maximum(distance, 1e-9) ** 2
        radius, height = self._silhouette(distance)
        sine = np.where(height > 0, radius / np.sqrt(radius**2 + height**2), 2.0)
        return cap_irradiance(cosine, sine) / self.radius**2

    def aim(self, points: Float32, unit: Float32) -> Ways:
        towards = _column(self.position).astype(np.float32) - points
        distance = np.sqrt((towards * towards).sum(axis=0))
        if not self.sized:
            return _spread(towards[:, None], distance[None], 1)
        axis = towards / np.maximum(distance, np.float32(1e-30))
        radius, height = self._silhouette(distance)
        first, second = frame(axis)
        x, y = disc(unit)
        aside = (x * radius) * first[:, None] + (y * radius) * second[:, None]
        return _spread((axis * height)[:, None] + aside, height[None], (radius / np.float32(self.radius)) ** 2)

    def gain(self, points: Float32, ways: Ways) -> Float32 | None:  # noqa: ARG002 - it shines evenly
        return None

    def only(self, chosen: NDArray[Any]) -> Light:
        """The lamps of the chosen points, where there is one for each point."""
        return self if self.position.ndim == 1 else some_of(self, chosen)

    def _towards(self, points: Float64) -> tuple[Float64, ...]:
        """Components (n,) of the ways from points (n, 3) to the middle of the lamp."""
        return tuple(self.position[..., k] - points[:, k] for k in range(3))

    def _silhouette(self, distance: NDArray[Real]) -> tuple[NDArray[Real], NDArray[Real]]:
        """Radius (n,) and height (n,) over the receiver of the disc that the lamp looks like from a distance (n,)."""
        own = np.asarray(self.radius, dtype=distance.dtype)
        if self.facing_disc:
            return np.broadcast_to(own, distance.shape), distance
        shrink = np.sqrt(np.maximum(1 - (own / np.maximum(distance, own)) ** 2, 0))
        return np.where(distance <= own, own, own * shrink), distance * shrink**2


class Spot(Ball):
    """A ball behind a cone with a smooth edge."""

    even = False
    each = (*Ball.each, "inverse_axes", "cosine", "softness", "widening")

    def __init__(self, lamp: SpotLamp, space: Space) -> None:
        super().__init__(lamp, space)
        self.inverse_axes = np.linalg.inv(np.array(lamp.axes))
        self.cosine = np.cos(lamp.cone_angle / 2)
        self.softness = max((1.0 - self.cosine) * lamp.blend, 1e-6)
        # How much wider the cone may look from a lamp of this size, whose axes may be stretched.
        stretch = np.linalg.cond(self.inverse_axes)
        self.widening = self.radius * stretch

    def share(self, points: Float64, normals: Float64) -> Float64:
        """That of an even lamp, but nothing where no part of the lamp shines."""
        x, y, z = self._towards(points)
        across, up, along = (
            x * self.inverse_axes[..., 0, k] + y * self.inverse_axes[..., 1, k] + z * self.inverse_axes[..., 2, k]
            for k in range(3)
        )
        length = np.maximum(np.sqrt(across * across + up * up + along * along), 1e-30)
        distance = np.maximum(np.sqrt(x * x + y * y + z * z), 1e-30)
        off_axis = np.arccos(np.clip(along / length, -1.0, 1.0))
        reached = off_axis < np.arccos(self.cosine) + np.arctan(self.widening / distance)
        return np.where(reached, super().share(points, normals), 0.0)

    def gain(self, points: Float32, ways: Ways) -> Float32:  # noqa: ARG002 - it shines alike from all its points
        """Smoothstep between the cone's edge and its softer inside, by the angle seen in the lamp's own axes."""
        axes = np.moveaxis(self.inverse_axes, (-2, -1), (0, 1)).astype(np.float32)
        local = np.einsum("ij...,ir...->jr...", axes, ways.towards)
        depth = local[2] / np.sqrt(np.maximum((local * local).sum(axis=0), np.float32(1e-30)))
        step = np.clip((depth - np.float32(self.cosine)) / np.float32(self.softness), 0, 1)
        return step * step * (3 - 2 * step)


class Sun:
    """Parallel light from a disc in the sky."""

    round = True
    even = True
    each: tuple[str, ...] = ()
    kind: tuple[object, ...] = ()

    def __init__(self, lamp: SunLamp) -> None:
        self.name = lamp.name
        self.color = np.array(lamp.irradiance)
        self.axis = -np.array(lamp.direction) / np.linalg.norm(lamp.direction)
        self.tangent = np.tan(min(lamp.angle, 0.999 * np.pi) / 2)
        self.sized = bool(self.tangent > 1e-6)
        self.casts_shadow = lamp.casts_shadow

    def share(self, points: Float64, normals: Float64) -> Float64:
        cosine = normals @ self.axis
        if not self.sized:
            return np.maximum(cosine, 0.0)
        sine = self.tangent / np.sqrt(1.0 + self.tangent**2)
        return cap_irradiance(cosine, np.full(len(points), sine)) / sine**2

    def aim(self, points: Float32, unit: Float32) -> Ways:
        axis = self.axis.astype(np.float32)[:, None]
        depth = np.full((1, points.shape[1]), BEYOND, dtype=np.float32)
        if not self.sized:
            towards = np.broadcast_to(BEYOND * axis[:, None], (3, 1, points.shape[1]))
            return _spread(towards, depth, float(BEYOND) ** 2)
        first, second = frame(axis)
        x, y = disc(unit)
        reach = np.float32(BEYOND * self.tangent)
        towards = BEYOND * axis[:, None] + reach * (x * first[:, None] + y * second[:, None])
        return _spread(towards, depth, float(BEYOND) ** 2 * (1 + self.tangent**2))

    def gain(self, points: Float32, ways: Ways) -> Float32 | None:  # noqa: ARG002 - it shines evenly
        return None

    def only(self, chosen: NDArray[Any]) -> Light:  # noqa: ARG002 - it is the same for all points
        return self


class Panel:
    """A flat convex polygon that emits alike over its area: an area lamp, or a triangle of an emitting surface.

    axes: origin and two axes of the coordinates that spread the unit square over it; round: it stands for the ellipse
    about the origin with these half axes. The same formulas serve many alike at once, see `crowd`.
    """

    each: tuple[str, ...] = ("corners", "area", "normal", "half_spread", "axes", "_center", "_reach")

    def __init__(
        self,
        name: str,
        corners: Float64,
        radiance: Float64,
        *,
        two_sided: bool,
        spread: float = np.pi,
        ellipse: tuple[Float64, Float64, Float64] | None = None,
        casts_shadow: bool = True,
    ) -> None:
        self.name = name
        self.corners = corners
        self.color = np.pi * radiance
        self.two_sided = two_sided
        self.half_spread = spread / 2
        self.even = bool(self.half_spread >= np.pi / 2 - 1e-6)
        self.sized = True
        self.casts_shadow = casts_shadow
        fan = np.cross(corners[1:-1] - corners[0], corners[2:] - corners[0]).sum(axis=0)
        self.area = float(np.linalg.norm(fan)) / 2
        self.normal = fan / np.linalg.norm(fan)
        self.round = ellipse is not None
        self.axes = np.stack(ellipse or (corners[0], corners[1] - corners[0], corners[-1] - corners[0]))
        self._center = corners.mean(axis=0)
        self._reach = _NEAR * 2 * float(np.linalg.norm(corners - self._center, axis=1).max())
        first, second = self.axes[1:]
        square = abs(first @ second) < 1e-6 * np.linalg.norm(first) * np.linalg.norm(second)
        self._rectangular = bool(len(corners) >= 4 and square)
        #: What panels have in common that are asked as one.
        alike = self.round, self._rectangular, two_sided, casts_shadow, self.even
        self.kind: tuple[object, ...] = (len(corners), *alike)

    @classmethod
    def from_area_lamp(cls, lamp: AreaLamp, space: Space) -> Panel:
        half_u, half_v = np.array(lamp.half_u) / space.metres, np.array(lamp.half_v) / space.metres
        center, ellipse = space.normalise(np.array(lamp.center)), None
        if lamp.shape == "rectangle":
            outline = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]], dtype=float)
        else:
            turn = np.arange(_ELLIPSE_CORNERS) * 2 * np.pi / _ELLIPSE_CORNERS
            grow = np.sqrt(2 * np.pi / (_ELLIPSE_CORNERS * np.sin(2 * np.pi / _ELLIPSE_CORNERS)))
            outline = grow * np.column_stack([np.cos(turn), np.sin(turn)])
            ellipse = (center, half_u, half_v)
        if np.cross(half_u, half_v) @ np.array(lamp.normal) < 0:
            outline = outline[::-1]
        corners = center + outline @ np.stack([half_u, half_v])
        radiance = np.array(lamp.radiance)
        return cls(
            lamp.name,
            corners,
            radiance,
            two_sided=False,
            spread=lamp.spread,
            ellipse=ellipse,
            casts_shadow=lamp.casts_shadow,
        )

    def share(self, points: Float64, normals: Float64) -> Float64:
        return polygon_irradiance(points, normals, self.corners, two_sided=self.two_sided)

    def aim(self, points: Float32, unit: Float32) -> Ways:
        origin, first, second = (_column(axis)[:, None].astype(np.float32) for axis in self._axes())
        x, y = self._coordinates(unit)
        towards = origin + x * first + y * second - points[:, None]
        depth = -self._along_normal(towards)
        ways = _spread(towards, np.abs(depth) if self.two_sided else np.maximum(depth, 0), self.area / np.pi)
        away = points - _column(self._center).astype(np.float32)
        near = np.flatnonzero((away * away).sum(axis=0) < np.square(self._reach))
        if len(near) and (self._rectangular or self.corners.shape[-2] == 3):
            self.only(near).aim_nearby(ways, near, points[:, near].astype(float), unit[:, :, near].astype(float))
        return ways

    def only(self, chosen: NDArray[Any]) -> Panel:
        """The panels of the chosen points, where there is one for each point."""
        return self if self.corners.ndim == 2 else some_of(self, chosen)

    def aim_nearby(self, ways: Ways, near: NDArray[np.int64], points: Float64, unit: Float64) -> None:
        """Replace the ways from the nearby points by such as are spread over the lamp's solid angle."""
        depth = ((points - _column(self._center)) * _column(self.normal)).sum(axis=0)
        front = np.abs(depth) > 1e-9 if self.two_sided else depth > 1e-9
        depth = np.where(front, depth, 1.0)
        if self._rectangular:
            towards, solid, on_lamp = self._over_rectangle(points, depth, unit)
        else:
            corners = np.stack([_column(self.corners[..., c, :]) for c in range(3)])
            directions, solid = triangle_directions(corners - points, unit)
            slant = -self._along_normal(directions)
            towards = directions * (depth / np.where(slant == 0, 1e-30, slant))
            on_lamp = np.ones(towards.shape[1:], dtype=bool)
        usable = front & (solid > _SLIVER)
        near, towards = near[usable], towards[:, :, usable]
        ways.towards[:, :, near] = towards
        ways.inverse[:, near] = 1 / np.sqrt((towards * towards).sum(axis=0))
        ways.solid[:, near] = (on_lamp * solid / np.pi)[:, usable]

    def _over_rectangle(self, points: Float64, depth: Float64, unit: Float64) -> tuple[Float64, Float64, np.ndarray]:
        """Ways (3, r, n) to places of the rectangle around the lamp, its solid angle (n,), which (r, n) lie on it."""
        origin, *sides = (_column(axis) for axis in self._axes())
        size = np.stack([np.linalg.norm(side, axis=0) for side in sides])
        first, second = (side / length for side, length in zip(sides, size, strict=True))
        from_origin = np.stack([(axis * (origin - points)).sum(axis=0) for axis in (first, second)])
        low = from_origin - size if self.round else from_origin
        places, solid = rectangle_places(low, from_origin + size, np.abs(depth), unit)
        x, y = places
        across = _column(self.normal) * -depth
        towards = first[:, None] * x + second[:, None] * y + across[:, None]
        offset = (places - from_origin[:, None]) / size[:, None]
        return towards, solid, (offset * offset).sum(axis=0) <= 1 if self.round else np.ones_like(x, dtype=bool)

    def gain(self, points: Float32, ways: Ways) -> Float32 | None:  # noqa: ARG002 - all that counts is the way
        """The lamp's grid lets pass what lies within half the spread of its axis, less and less towards that angle:
        (tan h - tan a) / (tan h - h), as Cycles does it, a being the angle off the axis and h half the spread."""
        if self.even:
            return None
        cosine = np.abs(self._along_normal(ways.towards)) * ways.inverse
        half = np.asarray(self.half_spread)
        edge, rest = np.tan(half).astype(np.float32), (np.tan(half) - half).astype(np.float32)
        tangent = np.sqrt(np.maximum(1 - cosine**2, 0)) / np.maximum(cosine, 1e-9)
        return np.maximum(edge - tangent, 0) / rest

    def _axes(self) -> list[Float64]:
        return [self.axes[..., number, :] for number in range(3)]

    def _along_normal(self, ways: NDArray[Real]) -> NDArray[Real]:
        """How far (r, n) ways (3, r, n) lead along the lamp's normal."""
        return np.asarray(np.einsum("k...,kr...->r...", self.normal.T.astype(ways.dtype), ways))

    def _coordinates(self, unit: Float32) -> tuple[Float32, Float32]:
        if self.corners.shape[-2] == 3:
            root = np.sqrt(unit[0])
            return root * (1 - unit[1]), root * unit[1]
        return disc(unit) if self.round else (unit[0], unit[1])
