"""What is in sight of points on the receivers: which lights, and what stands on the surface around them."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

import numpy as np

from .direct.illumination import MOST_CONTOURED, DirectLight, Illumination
from .gather import Points, gather_direct
from .parallel import Workers
from .sampling import stream
from .scene import Bool, Float64
from .surroundings import Surroundings
from .tessellation import Int64
from .visibility import offset_along

#: Rays that tell how much light there is, and whether a point is inside a solid.
_SHADOW_RAYS, _RAYS = 16, 16
#: The ends of a way along a surface are left out, lest it meets what bounds the surface.
_BARRED_UP_TO = 0.98
#: Points in a chunk; a number of streams that nothing else uses.
_CHUNK, _STREAM = 4096, 4_000_000
#: What is in sight of a point is a number: a bit for each light of which something is hidden, one for each that is
#: hidden as a whole, one for what stands between it and the first end of an edge, and one for being covered.
WHOLE, BARRED, COVERED = MOST_CONTOURED, 1 << 2 * MOST_CONTOURED, 1 << 2 * MOST_CONTOURED + 1


@dataclass(frozen=True, eq=False)
class Look:
    """On two sides of places: light (2, n), which is indirect; outlines (n,): where one side is inside a solid or has
    something close above it, and the other has nothing within twice that, so that between them there is no slope; rays
    cast, by purpose."""

    light: Float64
    outlines: Bool
    rays: Counter[str]


class Sights:
    """Looks from points for lights and for what hides them. light: what is looked for; shadows: whether any light casts
    one, and they are few enough to be told apart; around: what rays meet, if they look; rays: cast so far, by purpose.
    """

    def __init__(self, direct_light: DirectLight, around: Surroundings | None, seed: int, workers: Workers) -> None:
        self.rays: Counter[str] = Counter()
        self.light = direct_light
        shading = [light for light in direct_light.lights if light.casts_shadow]
        self.shadows = bool(shading) and len(direct_light.lights) <= MOST_CONTOURED
        self.around = around and around.with_rays(_RAYS, stream(seed, "contour patterns"))
        self.seed = seed
        self.workers = workers

    def barred(self, points: Points, targets: Float64) -> Bool:
        """Whether something stands on the surface between points and targets (n, 3) on it."""
        origins = offset_along(points.positions, points.normals)
        ways = (_BARRED_UP_TO * (targets - points.positions)).astype(np.float32)
        long = np.flatnonzero(np.einsum("nk,nk->n", ways, ways) > 0)
        barred = np.zeros(len(targets), dtype=bool)
        barred[long] = ~self.light.visibility.unblocked_along(origins[long], ways[long])
        self.rays["contact"] += len(long)
        return barred

    def sight(self, points: Points, reach: Float64 | None, asked: Int64 | None = None) -> Int64:
        """What is in sight (n,) of each point; with a reach (n,), also whether it is covered. asked (n,): bits of the
        lights to look for, None for all."""

        def work(_: int, part: slice) -> tuple[Int64, Counter[str]]:
            where = points.positions[part], points.normals[part]
            sight, rays = np.zeros(len(where[0]), dtype=np.int64), Counter[str]()
            if self.shadows:
                some, whole, rays["shadow"] = self.light.shadows(*where, None if asked is None else asked[part])
                sight = some | whole << WHOLE
            if reach is not None and self.around is not None:
                sight += COVERED * self.around.hemispheres.beneath(*where, reach[part])
                rays["contact"] += 2 * len(sight)
            return sight, rays

        found = [*self.workers.map(work, len(points.positions), _CHUNK)]
        self.rays += sum((rays for _, rays in found), Counter())
        return np.concatenate([*(sight for sight, _ in found), np.zeros(0, np.int64)])

    def direct(self, points: Points, number: int) -> Illumination:
        """Light at points straight from the sources."""
        return gather_direct(points, self.light, _SHADOW_RAYS, self.seed, _STREAM + number, self.workers)

    def look(self, points: Points, reach: Float64, number: int) -> Look:
        """Looks around from points (2 n,) on two sides of n places, of which something within reach (2 n,) above them
        hides the light."""
        around = self.around
        if around is None:
            return Look(np.zeros((2, len(reach) // 2)), np.zeros(len(reach) // 2, dtype=bool), Counter())
        arriving, enclosed, rays = around.look(points, self.seed, _STREAM + number, self.workers)
        near, far = (
            around.hemispheres.covered(points.positions, points.normals, times * reach) for times in (1.0, 2.0)
        )
        hidden, open_ = (enclosed | near).reshape(2, -1), ~(enclosed | far).reshape(2, -1)
        outlines = (hidden & open_[::-1]).any(axis=0)
        return Look(arriving.reshape(2, -1), outlines, rays + Counter(contact=2 * len(reach)))
