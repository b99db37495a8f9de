"""Looking around: cosine-distributed, stratified rays from surface points, and what each of them meets.

Both the transport rows and the final gather are made of these; they differ only in what they look up at the hits.
"""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from .patches import Patches
from .sampling import cosine_patterns, frames
from .scene import Bool, Float32, Float64, Int32
from .sky import DARK, Sky
from .visibility import LOST, Visibility, offset_along

#: Rays a chunk: few enough to stay in the processor's caches, enough that Python hardly counts.
CHUNK_RAYS = 65536
#: Rays of all patterns together, and how many there are at least.
_PATTERN_RAYS, _FEWEST_PATTERNS = 16384, 256
#: A turn about a normal that seldom runs along a wall.
_ASKEW = 1.0
#: Ways that tell whether a point is buried: up, and besides so far along and across, thus turned.
BURIED_WAYS = ((0, 0), (1, 0), (-1, 0), (0, 1), (0, -1))


@dataclass(frozen=True)
class Codes:
    """What a ray met, as one integer: patch index for a front, plus `patches` for a back, or one of the others."""

    patches: int

    @property
    def lost(self) -> int:
        """A ray about a shading normal that starts below the surface itself: it carries nothing, as in Cycles. One that
        was absorbed on its way neither."""
        return 2 * self.patches

    @property
    def escaped(self) -> int:
        """The first of the codes of rays that left the scene, one for each texel of the sky."""
        return 2 * self.patches + 1

    def of_backs(self, code: Int32) -> Bool:
        """Which of some codes (...) are of the backs of patches."""
        return np.asarray((code >= self.patches) & (code < self.lost))


class Looks(NamedTuple):
    """What rays from n points met: code (n, rays) int32; tint (n, rays, 3) of what they bring, None where it is one;
    mirrored (n, rays), None where none was; rays it took beside the first ones, and how many of them were cut off."""

    code: np.ndarray
    tint: Float32 | None
    mirrored: Bool | None
    onward: int
    cut: int


class Hemispheres:
    """Casts `rays` rays over the hemisphere of each point, as two independent sets of half as many.

    rng only chooses the set of patterns; every call draws its own patterns and turns from the stream it is given. sky:
    tells rays that leave the scene apart.
    """

    def __init__(
        self, patches: Patches, visibility: Visibility, rays: int, rng: np.random.Generator, sky: Sky = DARK
    ) -> None:
        self.codes = Codes(len(patches))
        self.sky = sky
        self._visibility = visibility
        # Normal and patch of each triangle side by side: a ray needs both, from a place in memory far from the last.
        self._met = np.column_stack([patches.normals, np.zeros(len(patches.normals))]).astype(np.float32)
        self._met[:, 3] = patches.patch.view(np.float32)
        self._choose(rays, rng)

    def with_rays(self, rays: int, rng: np.random.Generator) -> Hemispheres:
        """The same surroundings, looked at with another number of rays."""
        other = copy(self)
        other._choose(rays, rng)  # noqa: SLF001 - a copy of itself
        return other

    @property
    def code_count(self) -> int:
        """How many codes there are. Tables over twice as many hold what rays off mirrors bring in the second half."""
        return self.codes.escaped + len(self.sky.light)

    def _choose(self, rays: int, rng: np.random.Generator) -> None:
        self.rays = rays
        self.chunk = max(1, CHUNK_RAYS // rays)
        count = max(_PATTERN_RAYS // rays, _FEWEST_PATTERNS)
        self._patterns = tuple(cosine_patterns(count, half, rng) for half in (rays // 2, rays - rays // 2))

    def cast(self, points: Float64, normals: Float64, shading: Float64, rng: np.random.Generator) -> Looks:
        """Looks around from points (n, 3) with geometric normals and shading normals (n, 3)."""
        count = len(points)
        turn = rng.random(count, dtype=np.float32) * np.float32(2 * np.pi)
        # Each half draws its own: paired once and for all, the few pairs there are would be alike by chance.
        pattern = np.concatenate([some[rng.integers(len(some), size=count)] for some in self._patterns], axis=1)
        directions = (pattern @ frames(shading.astype(np.float32), turn)).reshape(-1, 3)
        origins = np.repeat(offset_along(points, normals), self.rays, axis=0)
        path = self._visibility.follow(origins, directions, rng)
        code = self._sides(path.hit, path.directions)
        left = np.flatnonzero(path.hit < 0)
        texel = self.sky.texel(path.directions[left])
        if self.sky.portals:
            straight = np.einsum("nk,nk->n", path.directions[left], directions[left]) > np.float32(1 - 1e-5)
            first = left[straight]
            texel[straight] = self.sky.beside_portals(texel[straight], origins[first], directions[first])
        code[left] = self.codes.escaped + texel
        if path.onward:
            code[path.hit == LOST] = self.codes.lost
        code = code.reshape(count, self.rays)
        tilted = np.flatnonzero(np.einsum("nk,nk->n", normals, shading) < 1.0 - 1e-6)
        if len(tilted):
            below = directions.reshape(count, self.rays, 3)[tilted] @ normals[tilted].astype(np.float32)[:, :, None]
            code[tilted] = np.where(below[..., 0] <= 0, self.codes.lost, code[tilted])
        tint = None if path.tint is None else path.tint.reshape(count, self.rays, 3)
        mirrored = None if path.mirrored is None else path.mirrored.reshape(count, self.rays)
        return Looks(code, tint, mirrored, path.onward, path.cut)

    def covered(self, points: Float64, normals: Float64, reach: Float64) -> Bool:
        """Whether something lies within reach (n,) straight above each point (n, 3)."""
        ways = (reach[:, None] * normals).astype(np.float32)
        return ~self._visibility.unblocked_along(offset_along(points, normals), ways)

    def beneath(self, points: Float64, normals: Float64, reach: Float64) -> Bool:
        """Whether each point (n, 3) is under something: it may be inside a solid, or something is straight above within
        reach (n,). No others can be in a gap. Takes two rays of each point, and a third below what shows its front."""
        return self.inside(points, normals) | self.covered(points, normals, reach)

    def inside(self, points: Float64, normals: Float64) -> Bool:
        """Whether what lies above each point (n, 3) shows its back, so that it may be inside a solid: straight above,
        or to this side and to that. For in a solid that reaches up to a ceiling a ray meets the one or the other by
        chance."""
        origins, up = offset_along(points, normals), normals.astype(np.float32)
        hit = self._visibility.nearest(origins, up)
        inside = self._back(hit, up)
        doubtful = np.flatnonzero((hit >= 0) & ~inside)
        aside = frames(up[doubtful], np.full(len(doubtful), _ASKEW, dtype=np.float32))[:, 0]
        for sign in (1, -1):
            ways = up[doubtful] + sign * aside
            back = self._back(self._visibility.nearest(origins[doubtful], ways), ways)
            doubtful, aside = doubtful[back], aside[back]
        inside[doubtful] = True
        return inside

    def buried(self, points: Float64, normals: Float64, within: Bool) -> Bool:
        """Whether points (n, 3) lie inside a solid: of the BURIED_WAYS, straight up and slanting to four sides, all but
        one end at a back, or at a side that is known to be within a solid, by its code (c,). A ceiling may be the one.
        """
        origins, up = offset_along(points, normals), normals.astype(np.float32)
        turned = frames(up, np.full(len(up), _ASKEW, dtype=np.float32))
        ends = np.zeros(len(up), dtype=np.int64)
        for along, across in BURIED_WAYS:
            ways = up + along * turned[:, 0] + across * turned[:, 1]
            hit = self._visibility.nearest(origins, ways)
            code = self._sides(hit, ways)
            ends += (hit >= 0) & (self.codes.of_backs(code) | within[code])
        return np.asarray(ends >= len(BURIED_WAYS) - 1)

    def _back(self, hit: Int32, directions: Float32) -> Bool:
        """Whether each ray has met the back of a patch."""
        return np.asarray((hit >= 0) & (self._sides(hit, directions) >= self.codes.patches))

    def _sides(self, hit: Int32, directions: Float32) -> Int32:
        """The code of the side of a patch that each ray has met; of no meaning for rays that met nothing."""
        met = self._met[hit]
        behind = np.einsum("nk,nk->n", met[:, :3], directions) > 0
        return np.asarray(met.view(np.int32)[:, 3] + np.int32(self.codes.patches) * behind)
