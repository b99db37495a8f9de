"""Windows and doorways that the sky shines through, found by rays, so that they can be sampled as lights.

Rays that leave a room by chance find a small window too seldom. Those that do cross the plane of the wall inside the
hole. So the planes with the most surface are candidates: where escaping rays cross one close together, the rectangle
around them becomes a portal if most rays that are aimed at it escape too, and few of those that are aimed past it. For
any set of portals gives the same light, but not in the same parts: what lies before a portal gets the sky through it
straight, what lies behind it does not, and where a surface runs on through its plane, both parts break.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from .patches import Patches, Space, row_numbers
from .pilot import Escapes, Pilot
from .sampling import stream
from .scene import Bool, Float64, Portal, Vector
from .sky import Rectangle
from .tessellation import Int64
from .visibility import Visibility

#: Rays that must have found an opening, and their share of all that escaped from rooms.
_FEWEST, _LEAST_SHARE = 16, 0.03
#: Triangles that tell which planes hold the most surface, and how many of these are looked at.
_TRIANGLES, _PLANES = 4096, 40
#: How far triangles may be off a common plane: in the cosine of their normals and in the unit box.
_FLAT = 2e-3
#: Openings lie in the unit box, or nearly so.
_WITHIN = 1.05
#: Share of the rays aimed at an opening that must escape; rays that tell; openings at most.
_FREE, _TRIALS, _MOST = 0.4, 512, 8
#: A rim this much larger than an opening is part of its frame, if at most this share of the rays that the opening lets
#: through get through there; how many of the four sides must have one.
_RIM, _FRAMED, _SIDES = 1.06, 0.5, 3
#: Share of the rays which must have left by the openings for the rest to be left to chance; and for them to be of use:
#: so that at most half of the noise is left.
_MOST_OF_IT, _WORTHWHILE = 0.95, 0.75


@dataclass(frozen=True, eq=False)
class _Plane:
    """normal (3,) into the room and offset: normal @ x = offset; u, v (3,) complete the frame, along its edges."""

    normal: Float64
    offset: float
    u: Float64
    v: Float64

    def turned(self) -> _Plane:
        return _Plane(-self.normal, -self.offset, self.u, self.v)

    def crossings(self, escapes: Escapes) -> tuple[Int64, Float64]:
        """Numbers of the rays that cross it outward, and where: (k, 2) along u and v."""
        height = escapes.origins @ self.normal - self.offset
        fall = -(escapes.directions @ self.normal)
        ahead = np.flatnonzero((height > 1e-4) & (fall > 1e-4))
        reach = (height[ahead] / fall[ahead])[:, None]
        points = escapes.origins[ahead] + reach * escapes.directions[ahead]
        return ahead, points @ np.stack([self.u, self.v], axis=1)

    def rectangle(self, low: Float64, high: Float64) -> Rectangle:
        middle, half = (low + high) / 2.0, (high - low) / 2.0
        center = self.offset * self.normal + middle[0] * self.u + middle[1] * self.v
        return Rectangle(center, half[0] * self.u, half[1] * self.v, self.normal)


def find_openings(escapes: Escapes, pilot: Pilot) -> tuple[Portal, ...]:
    """The openings that rays from inside rooms escaped through, the one that brings the most first; none where many
    escaped by other ways. Rays that cross a portal which the scene has already are left out."""
    patches, space = pilot.patches, pilot.patches.space
    for portal in pilot.scene.portals:
        own = Rectangle.of(portal, space)
        escapes = escapes.only(~own.crossed(escapes.origins.T, escapes.directions.T))
    least = max(_FEWEST, int(_LEAST_SHARE * len(escapes)))
    planes = [side for plane in _planes(patches) for side in (plane, plane.turned())] if len(escapes) >= least else []
    openings: list[Rectangle] = []
    left = escapes
    while len(left) >= max(least, (1.0 - _MOST_OF_IT) * len(escapes)) and len(openings) < _MOST:
        tried = [
            (len(through) * _free_share(rectangle, left.only(through), pilot.visibility), -number, rectangle)
            for number, (through, rectangle) in enumerate(_candidates(planes, left, patches, least))
        ]
        brings, _, best = max(tried, default=(0.0, 0, None), key=lambda candidate: candidate[:2])
        if best is None or brings == 0.0:
            break
        openings.append(best)
        left = left.only(~best.crossed(left.origins.T, left.directions.T))
    if len(left) > (1.0 - _WORTHWHILE) * len(escapes):
        return ()
    return tuple(_portal(f"Opening {number}", opening, space) for number, opening in enumerate(openings, start=1))


def _planes(patches: Patches) -> list[_Plane]:
    """The planes that hold the most surface, and the sides of the box around everything."""
    rng = stream(0, "planes")
    chosen = rng.choice(len(patches.area), size=_TRIANGLES, p=patches.area / patches.area.sum())
    corners, normals = patches.corners[chosen], patches.normals[chosen]
    leading = np.argmax(np.abs(normals) > 0.5, axis=1)
    normals = normals * np.sign(normals[np.arange(len(normals)), leading])[:, None]
    offset = np.einsum("tk,tk->t", corners.mean(axis=1), normals)
    key = np.rint(np.column_stack([normals, offset]) / _FLAT).astype(np.int64)
    number = row_numbers(key)
    group, first, count = np.unique(number, return_index=True, return_counts=True)
    largest = np.argsort(-count, kind="stable")[:_PLANES]
    found = []
    for index in largest:
        own = number == group[index]
        found.append(_along_edges(normals[first[index]], float(offset[own].mean()), corners[own]))
    low, high = patches.corners.min(axis=(0, 1)), patches.corners.max(axis=(0, 1))
    axes = np.eye(3)
    for k in range(3):
        found += [_Plane(axes[k], float(end[k]), axes[k - 2], axes[k - 1]) for end in (low, high)]
    return found


def _along_edges(normal: Float64, offset: float, corners: Float64) -> _Plane:
    """The plane with the axis u along most of the edges of triangles (t, 3, 3) in it, or at right angles to them."""
    edges = (corners - np.roll(corners, 1, axis=1)).reshape(-1, 3)
    length = np.linalg.norm(edges, axis=1)
    first = edges[np.argmax(length)] / length.max()
    angle = np.arctan2(edges @ np.cross(normal, first), edges @ first) % (np.pi / 2)
    bins = np.rint(angle / (np.pi / 360)).astype(np.int64) % 180
    common = np.argmax(np.bincount(bins, length))
    u = edges[np.argmax(length * (bins == common))]
    u = u - (u @ normal) * normal
    u /= np.linalg.norm(u)
    return _Plane(normal, offset, u, np.cross(normal, u))


def _candidates(
    planes: list[_Plane], escapes: Escapes, patches: Patches, least: int
) -> Iterator[tuple[Int64, Rectangle]]:
    """Rays that cross a plane close together, and the rectangle around them."""
    for plane in planes:
        ray, place = plane.crossings(escapes)
        for part in _close_together(place, least):
            rectangle = plane.rectangle(*_to_edges(plane, place[part], patches))
            if np.abs(rectangle.corners).max() <= _WITHIN:
                yield ray[part], rectangle


def _close_together(place: Float64, least: int) -> Iterator[Int64]:
    """Parts of at least so many of the points (n, 2) between which there is a gap along one of the axes: wider than
    there is between points that lie at random by chance, once in 10,000 times."""
    waiting = [np.arange(len(place))]
    while waiting:
        part = waiting.pop()
        if len(part) < least:
            continue
        for axis in range(2):
            order = part[np.argsort(place[part, axis], kind="stable")]
            gaps = np.diff(place[order, axis])
            extent = float(gaps.sum())
            widest = int(np.argmax(gaps))
            if gaps[widest] > extent * (np.log(len(part)) + np.log(1e4)) / len(part):
                waiting += [order[: widest + 1], order[widest + 1 :]]
                break
        else:
            yield part


def _to_edges(plane: _Plane, place: Float64, patches: Patches) -> tuple[Float64, Float64]:
    """Corners low and high (2,) of the rectangle around points (n, 2), grown to the edges of the hole: to the nearest
    vertices in the plane, or by as much as a few more points would do."""
    low, high = place.min(axis=0), place.max(axis=0)
    extent = np.maximum(high - low, 1e-6)
    more = 3.0 / len(place) * extent
    reach = np.maximum(2.0 * more, 0.05 * extent)
    vertices = patches.corners.reshape(-1, 3)
    vertices = vertices[np.abs(vertices @ plane.normal - plane.offset) < _FLAT]
    vertices = vertices @ np.stack([plane.u, plane.v], axis=1)
    near = vertices[((vertices >= low - reach) & (vertices <= high + reach)).all(axis=1)]
    slack = 1e-5
    for axis in range(2):
        above, below = near[near[:, axis] >= high[axis] - slack, axis], near[near[:, axis] <= low[axis] + slack, axis]
        high[axis] = above.min() if len(above) else high[axis] + more[axis]
        low[axis] = below.max() if len(below) else low[axis] - more[axis]
    return low, high


def _free_share(rectangle: Rectangle, through: Escapes, visibility: Visibility) -> float:
    """Share of the rays from some origins to places all over the rectangle that escape; 0 if that is too few, or if
    there is no frame around it."""
    rng = stream(0, "free share")
    origins = through.origins[rng.integers(len(through), size=_TRIALS)]

    def free(place: Float64) -> Bool:
        """Whether the rays to places (_TRIALS, 2), the rectangle's are from -1 to 1, escape."""
        ways = rectangle.center + place @ np.stack([rectangle.half_u, rectangle.half_v]) - origins
        ways *= 8.0 / np.linalg.norm(ways, axis=1, keepdims=True)
        return visibility.unblocked_along(origins, ways.astype(np.float32))

    place = 2.0 * rng.random((_TRIALS, 2)) - 1.0
    share = float(free(place).mean())
    if share < _FREE:
        return 0.0
    side, each = np.arange(_TRIALS) % 4, np.arange(_TRIALS)
    place[each, side // 2] = (2.0 * (side % 2) - 1.0) * (1.0 + (_RIM - 1.0) * rng.random(_TRIALS))
    past = np.bincount(side, free(place)) / np.bincount(side)
    return share if np.count_nonzero(past <= _FRAMED * share) >= _SIDES else 0.0


def _portal(name: str, opening: Rectangle, space: Space) -> Portal:
    """In metres."""

    def vector(values: Float64) -> Vector:
        x, y, z = values.tolist()
        return (x, y, z)

    center = vector(opening.center * space.metres + space.center)
    half_u, half_v = vector(opening.half_u * space.metres), vector(opening.half_v * space.metres)
    return Portal(name, center, half_u, half_v, vector(opening.normal), found=True)
