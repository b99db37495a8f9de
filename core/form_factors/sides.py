"""The sides of patches that exchange light, and the points that stand for each of them.

A patch may run under a solid that stands on it. Nobody sees that part, and no light gets there, so the patch is what is
left of it: its area, what arrives there and what it sends out are those of its open part.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..hemisphere import BURIED_WAYS, Hemispheres
from ..patches import Patches
from ..sampling import GOLDEN, plane_points, stream, triangle_points
from ..scene import Bool, Float32, Float64, Int32

#: Points of a patch from which its rays start.
SITES = 4
#: Shares of rays that meet backs, of a point inside a solid and of one that is surely not.
_INSIDE, _OUTSIDE = 0.95, 0.6
#: Points of a patch that tell how much of it lies under a solid.
_PROBES = 32


@dataclass(frozen=True, eq=False)
class Sides:
    """The sides of patches that can exchange light: every front, and each back that some ray can reach.

    side (s,) int32: patch index for a front, patch index + number of patches for a back. points, normals (s, SITES, 3)
    where light is sampled on each; open_share (s,): how much of it takes part, where these points are. The rest lies
    inside a solid that stands on the patch.
    """

    patches: Patches
    side: Int32
    points: Float64
    normals: Float64
    open_share: Float64

    @property
    def patch(self) -> Int32:
        return self.side % np.int32(len(self.patches))

    @property
    def back(self) -> Bool:
        return self.side >= len(self.patches)

    @property
    def area(self) -> Float64:
        """(s,) in the unit box, of the open part on which rays stop."""
        open_area = self.patches.patch_area[self.patch] * self.open_share
        return open_area if self.patches.coverage is None else open_area * self.patches.coverage[self.patch]

    @property
    def albedo(self) -> Float32:
        return self.patches.albedo[self.patch]

    @property
    def emission(self) -> Float32:
        return self.patches.emission_of(self.side)

    def transmitted(self, irradiance: Float64) -> Float64:
        """Radiosity (s, 3) from irradiance (s, 3) on the other side of each patch; 0 if nothing transmits."""
        transmission = self.patches.transmission
        if transmission is None:
            return np.zeros_like(irradiance)
        through = np.zeros((2 * len(self.patches), irradiance.shape[1]))
        through[self.side] = irradiance
        other = (self.side + len(self.patches)) % (2 * len(self.patches))
        return np.asarray(transmission[self.patch] * through[other])


def even_sides(patches: Patches, side: Int32, seed: int, purpose: str) -> Sides:
    """Sides (s,) with points all over them."""
    shift = stream(seed, "sites " + purpose).random((len(side), 1, 3))
    return Sides(patches, side, *site_points(patches, side, shift), np.ones(len(side)))


def site_points(patches: Patches, side: Int32, shift: Float64, count: int = SITES) -> tuple[Float64, Float64]:
    """Points and normals (s, count, 3) spread evenly over the area of each side, all moved by shift (s, 1, 3)."""
    patch = side % np.int32(len(patches))
    first, last = patches.first[patch, None], patches.first[patch + 1, None]
    cumulative = np.concatenate([[0.0], np.cumsum(patches.area[patches.members])])
    number = np.arange(count)
    # The member that a point falls on, by area; the sequence is even over the members as well.
    share = (number * GOLDEN + shift[..., 2]) % 1.0
    wanted = cumulative[first] + share * (cumulative[last] - cumulative[first])
    position = np.clip(np.searchsorted(cumulative, wanted, side="right") - 1, first, last - 1)
    triangle = patches.members[position]
    weights = triangle_points(plane_points(np.broadcast_to(number, share.shape), shift[..., :2]))
    points = np.einsum("snc,snck->snk", weights, patches.corners[triangle])
    turned = np.where(side >= len(patches), -1.0, 1.0)[:, None, None]
    return points, patches.normals[triangle] * turned


def open_parts(
    sides: Sides, behind: Float64, met_by: Callable[[Bool], Bool], hemispheres: Hemispheres, seed: int, purpose: str
) -> tuple[Sides, Counter[str]]:
    """Those of the sides (s,) that lie under a solid in part, with points on their open parts alone; and the rays it
    took.

    behind (s, SITES): share of each point's rays that meet backs. met_by: which of the sides (s,) some (s,) of them
    see.
    """
    patches = sides.patches
    doubtful = behind > _OUTSIDE
    enclosed = doubtful.all(axis=1)
    # A front without an open point may be in sight by a corner. A room that shows its backs inside is no solid.
    candidate = doubtful.any(axis=1) & ~enclosed
    within = np.zeros(hemispheres.code_count, dtype=bool)
    if enclosed.any():
        within[sides.side[enclosed & ~sides.back]] = True
        candidate |= enclosed & ~sides.back & met_by(~enclosed)
    if patches.transmission is not None:
        # Both sides of what transmits are coupled patch by patch, so both are open.
        candidate &= ~(patches.transmission[sides.patch] > 0.0).any(axis=1)
    rays = Counter[str]()
    inside = behind > _INSIDE
    unsure = doubtful & ~inside & candidate[:, None]
    if within.any() and unsure.any():
        # A solid that touches another may show its front inside that.
        rng = stream(seed, "touching solids " + purpose)
        code = hemispheres.cast(sides.points[unsure], sides.normals[unsure], sides.normals[unsure], rng).code
        inside[unsure] = (hemispheres.codes.of_backs(code) | within[code]).mean(axis=1) > _INSIDE
        rays["contact"] += code.size
    inside &= candidate[:, None]
    side = sides.side[np.where(enclosed, inside.all(axis=1), inside.any(axis=1))]
    if not len(side):
        return Sides(patches, side, sides.points[:0], sides.normals[:0], sides.open_share[:0]), rays
    points, normals = site_points(patches, side, stream(seed, "probes " + purpose).random((len(side), 1, 3)), _PROBES)
    bare = ~hemispheres.buried(points.reshape(-1, 3), normals.reshape(-1, 3), within).reshape(-1, _PROBES)
    rays["contact"] += len(BURIED_WAYS) * bare.size
    found = bare.sum(axis=1)
    # The first of the bare points, over and over where there are not enough.
    order = np.argsort(~bare, axis=1, kind="stable")
    chosen = np.take_along_axis(order, np.arange(SITES) % np.maximum(found, 1)[:, None], axis=1)[..., None]
    some = (found > 0) & (found < _PROBES)
    points, normals = (np.take_along_axis(those, chosen, axis=1)[some] for those in (points, normals))
    return Sides(patches, side[some], points, normals, found[some] / _PROBES), rays
