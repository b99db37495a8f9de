"""What a ray meets. The only module that knows Embree.

Rays are single precision, so the triangles must be centred and scaled to about unit size first (see `transport`).
embreex facts this module is built on: the commit is lazy and unguarded, so one ray is traced before any thread may;
OCCLUDED answers 0 for blocked and -1 for free; `dists` is overwritten in place; bounds are not checked.
"""

from __future__ import annotations

from functools import cache
from typing import NamedTuple, cast

import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore import EmbreeDevice
from embreex.rtcore_scene import EmbreeScene

from .keys import mixed
from .optics import ABSORBED, GLINT, MIRROR, Optics
from .scene import Bool, Float32, Float64, Int32
from .tessellation import Int64

#: Rays start this far off their surface, relative to the scene's half extent: sixty units in the last place.
OFFSET = 4e-6
#: Shadow rays end this much short of their target, relative to their length.
SHORTEN = 1e-4
#: How often a ray may go on, and how many veils may hang between a lamp and what it shines on; then it is cut off.
MOST_TURNS = 24
#: What a ray has hit that was absorbed by a tint, or cut off.
LOST = -2


class Path(NamedTuple):
    """Where rays (n,) end: the triangle they stop at, -1 where they leave the scene, LOST for those absorbed or cut
    off; their last directions (n, 3); their tints (n, 3), None where all are one; which of them were mirrored, None
    where none was; how many rays it took besides the first, and how many were cut off."""

    hit: Int32
    directions: Float32
    tint: Float32 | None
    mirrored: Bool | None
    onward: int
    cut: int


class Veiled(NamedTuple):
    """What is left of the light along ways: tint (n, 3), 0 where they are blocked; how many rays it took besides the
    first, and how many were cut off."""

    tint: Float32
    onward: int
    cut: int


class Visibility:
    """Nearest hits and free segments among triangles.

    corners (t, 3, 3): corner coordinates, finite, within about [-1, 1]. The same point in two triangles must have
    the same coordinates, or light leaks through the crack between them. optics: where rays go on, None if nowhere.
    veiled: whether lamps shine through some of the triangles, in part.
    """

    def __init__(self, corners: Float64, optics: Optics | None = None) -> None:
        self.optics = optics
        self._scene = _Triangles(corners)
        self._blockers: _Triangles | None = self._scene
        self.veiled = False
        if optics is not None and not optics.blocks.all():
            self._blockers = _Triangles(corners[optics.blocks]) if optics.blocks.any() else None
            self.veiled = bool(optics.veils.any())
        if optics is not None and self.veiled:
            between = optics.blocks | optics.veils
            self._between = self._scene if between.all() else _Triangles(corners[between])
            self._triangle_between = np.flatnonzero(between)

    def nearest(self, origins: Float32, directions: Float32) -> Int32:
        """Index of the first triangle that each ray (n, 3) meets, -1 where it leaves the scene."""
        return self._scene.nearest(origins, directions)

    def follow(self, origins: Float32, directions: Float32, rng: np.random.Generator) -> Path:
        """Rays (n, 3) to where they stop, through glass and off mirrors."""
        hit = self.nearest(origins, directions)
        if self.optics is None:
            return Path(hit, directions, None, None, 0, 0)
        onward = np.flatnonzero(self.optics.goes_on[hit] & (hit >= 0))
        if not len(onward):
            return Path(hit, directions, None, None, 0, 0)
        return self._follow_on(self.optics, origins, directions.copy(), hit, onward, rng)

    def _follow_on(
        self,
        optics: Optics,
        origins: Float32,
        directions: Float32,
        hit: Int32,
        onward: np.ndarray,
        rng: np.random.Generator,
    ) -> Path:
        tint = np.ones(directions.shape, dtype=np.float32) if optics.tinted else None
        mirrored = np.zeros(len(hit), dtype=bool)
        start = origins[onward].astype(np.float64)
        rays = 0
        for _ in range(MOST_TURNS):
            triangle = hit[onward]
            before = directions[onward].astype(np.float64)
            points = optics.meet(triangle, start, before)
            outcome, after, tints = optics.scatter(triangle, points, before, rng)
            hit[onward[outcome == ABSORBED]] = LOST
            mirrored[onward[(outcome == GLINT) | (outcome == MIRROR)]] = True
            goes = outcome < ABSORBED
            onward, triangle, points, after = onward[goes], triangle[goes], points[goes], after[goes]
            if tint is not None:
                tint[onward] *= tints[goes]
            normals = optics.normals[triangle]
            side = np.sign(np.einsum("nk,nk->n", after, normals))
            lifted = offset_along(points, normals * side[:, None])
            directions[onward] = after
            hit[onward] = self.nearest(lifted, directions[onward])
            rays += len(onward)
            still = optics.goes_on[hit[onward]] & (hit[onward] >= 0)
            onward, start = onward[still], lifted[still].astype(np.float64)
            if not len(onward):
                break
        hit[onward] = LOST
        return Path(hit, directions, tint, mirrored if mirrored.any() else None, rays, len(onward))

    def unblocked(self, origins: Float32, targets: Float32) -> Bool:
        """Whether the segment from each origin to each target (n, 3) is free. Origins are offset already."""
        return self.unblocked_along(origins, targets - origins)

    def unblocked_along(self, origins: Float32, ways: Float32) -> Bool:
        """The same for ways (n, 3) from each origin to its target. Veils do not block."""
        if self._blockers is None:
            return np.ones(len(origins), dtype=bool)
        return self._blockers.unblocked(origins, ways)

    def veiled_along(self, origins: Float32, ways: Float32) -> Veiled:
        """What blockers and veils leave of the light along ways (n, 3); only in a scene that is `veiled`.

        One ray finds whichever comes first: only where that is a veil, the way goes on behind it.
        """
        optics = cast(Optics, self.optics)
        tint = np.ones(ways.shape, dtype=np.float32)
        onward = np.arange(len(ways))
        start, left = origins, ways
        rays = 0
        for _ in range(MOST_TURNS):
            rays += len(onward)
            met = self._between.nearest_within(start, left)
            some = np.flatnonzero(met >= 0)
            triangle = self._triangle_between[met[some]]
            veil = optics.veils[triangle]
            tint[onward[some[~veil]]] = 0.0
            some, triangle = some[veil], triangle[veil]
            if not len(some):
                return Veiled(tint, rays - len(ways), 0)
            onward = onward[some]
            from_here, way = start[some].astype(np.float64), left[some].astype(np.float64)
            points = optics.meet(triangle, from_here, way)
            tint[onward] *= optics.passing(triangle, points, way)
            normals = optics.normals[triangle]
            side = np.sign(np.einsum("nk,nk->n", way, normals))
            start = offset_along(points, normals * side[:, None])
            left = (from_here + way - start).astype(np.float32)
            lit = (tint[onward].max(axis=1) > 0.0) & (np.einsum("nk,nk->n", left, way) > 0.0)
            onward, start, left = onward[lit], start[lit], left[lit]
        tint[onward] = 0.0
        return Veiled(tint, rays - len(ways), len(onward))


class _Triangles:
    """Triangles (t, 3, 3) in a scene of Embree's, which is made ready for any thread."""

    def __init__(self, corners: Float64) -> None:
        self._scene = EmbreeScene(_device(), robust=True)
        vertices, triangles = indexed(corners.astype(np.float32))
        # The binding reads items one by one, tuples four times as fast as rows of an array.
        rows = np.empty(len(triangles), dtype=object)
        rows[:] = list(zip(*triangles.T.tolist(), strict=True))
        self._mesh = TriangleMesh(self._scene, vertices, rows)
        self.nearest(np.full((1, 3), 9.0, np.float32), np.ones((1, 3), np.float32))

    def nearest(self, origins: Float32, directions: Float32) -> Int32:
        return cast(Int32, self._scene.run(origins, directions, query="INTERSECT"))

    def nearest_within(self, origins: Float32, ways: Float32) -> Int32:
        """The first triangle on the way to a target, -1 where there is none."""
        return cast(Int32, self._scene.run(origins, ways, _reach(len(origins)), query="INTERSECT"))

    def unblocked(self, origins: Float32, ways: Float32) -> Bool:
        return cast(Bool, self._scene.run(origins, ways, _reach(len(origins)), query="OCCLUDED") == -1)


@cache
def _device() -> EmbreeDevice:
    """One for all scenes: a thousand of their own, as many as a process can have, end it without a word."""
    return EmbreeDevice()


def indexed(corners: Float32) -> tuple[Float32, Int64]:
    """Vertices (v, 3) and triangles (t, 3) with these corners (t, 3, 3): each point once."""
    points = corners.reshape(-1, 3)
    _, first, same = np.unique(mixed(points.astype(np.float64)), return_index=True, return_inverse=True)
    same = same.reshape(-1)
    if not np.array_equal(points[first][same], points):  # Two points with one key, as hardly ever happens.
        first = same = np.arange(len(points))
    return points[first], same.reshape(-1, 3)


def _reach(rays: int) -> Float32:
    """How much of its way each ray goes; Embree overwrites it."""
    return np.full(rays, 1.0 - SHORTEN, dtype=np.float32)


def offset_along(points: Float64, normals: Float64) -> Float32:
    """Ray origins (n, 3) a hair off the surface, on the side that the normals show."""
    return cast(Float32, (points + OFFSET * normals).astype(np.float32))
