"""What a ray meets. The only module that knows Embree.

Rays are single precision, so the triangles must be centred and scaled to about unit size first (see `transport`).
embreex facts this module is built on: the commit is lazy and unguarded, so one ray is traced before any thread may;
OCCLUDED answers 0 for blocked and -1 for free; `dists` is overwritten in place; bounds are not checked.
"""

from __future__ import annotations

from typing import cast

import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene

from .scene import Bool, Float32, Float64, Int32

#: Rays start this far off their surface, relative to the scene's half extent: sixty units in the last place.
OFFSET = 4e-6
#: Shadow rays end this much short of their target, relative to their length.
SHORTEN = 1e-4


class Visibility:
    """Nearest hits and free segments among triangles.

    corners (t, 3, 3): corner coordinates, finite, within about [-1, 1]. The same point in two triangles must have
    the same coordinates, or light leaks through the crack between them.
    """

    def __init__(self, corners: Float64) -> None:
        self._scene = EmbreeScene(robust=True)
        vertices = np.ascontiguousarray(corners.reshape(-1, 3), dtype=np.float32)
        indices = np.arange(len(vertices), dtype=np.int32).reshape(-1, 3)
        self._mesh = TriangleMesh(self._scene, vertices, indices)
        self.nearest(np.full((1, 3), 9.0, np.float32), np.ones((1, 3), np.float32))

    def nearest(self, origins: Float32, directions: Float32) -> Int32:
        """Index of the first triangle that each ray (n, 3) meets, -1 where it leaves the scene."""
        return cast(Int32, self._scene.run(origins, directions, query="INTERSECT"))

    def unblocked(self, origins: Float32, targets: Float32) -> Bool:
        """Whether the segment from each origin to each target (n, 3) is free. Origins are offset already."""
        return self.unblocked_along(origins, targets - origins)

    def unblocked_along(self, origins: Float32, ways: Float32) -> Bool:
        """The same for ways (n, 3) from each origin to its target."""
        reach = np.full(len(origins), 1.0 - SHORTEN, dtype=np.float32)
        return cast(Bool, self._scene.run(origins, ways, reach, query="OCCLUDED") == -1)


def offset_along(points: Float64, normals: Float64) -> Float32:
    """Ray origins (n, 3) a hair off the surface, on the side that the normals show."""
    return cast(Float32, (points + OFFSET * normals).astype(np.float32))
