"""The hemisphere estimator: what the rays of a patch hit is its row of form factors.

Rows sum to at most one by construction, nothing is singular, and the cost is linear in patches (Malley 1988).
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from ..hemisphere import Hemispheres
from ..parallel import Workers
from ..patches import Patches
from ..sampling import GOLDEN, plane_points, stream, triangle_points
from ..scene import Bool, Float32, Float64, Int32
from ..sky import DARK, Sky
from ..visibility import Visibility
from .rows import Rows

#: Points of a patch from which its rays start.
SITES = 4
#: Shares of rays that meet backs, of a point inside a solid and of one that is surely not.
_INSIDE, _OUTSIDE = 0.95, 0.6

Index = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Sides:
    """The sides of patches that can exchange light: every front, and each back that some ray can reach.

    side (s,) int32: patch index for a front, patch index + number of patches for a back. points, normals (s, SITES, 3)
    where light is sampled on each; hidden (s, SITES): inside a solid that stands on the patch, while the rest of the
    patch is open.
    """

    patches: Patches
    side: Int32
    points: Float64
    normals: Float64
    hidden: Bool

    @property
    def patch(self) -> Int32:
        return self.side % np.int32(len(self.patches))

    @property
    def back(self) -> Bool:
        return self.side >= len(self.patches)

    @property
    def area(self) -> Float64:
        """(s,) in the unit box, of the open part."""
        return self.patches.patch_area[self.patch] * (1.0 - self.hidden.mean(axis=1))

    @property
    def albedo(self) -> Float32:
        return self.patches.albedo[self.patch]

    @property
    def emission(self) -> Float32:
        return self.patches.emission[self.patch]


def site_points(patches: Patches, side: Int32, shift: Float64) -> tuple[Float64, Float64]:
    """Points and normals (s, SITES, 3) spread evenly over the area of each side, all moved by shift (s, 1, 3)."""
    patch = side % np.int32(len(patches))
    first, last = patches.first[patch, None], patches.first[patch + 1, None]
    cumulative = np.concatenate([[0.0], np.cumsum(patches.area[patches.members])])
    number = np.arange(SITES)
    # The member that a point falls on, by area; the sequence is even over the members as well.
    share = (number * GOLDEN + shift[..., 2]) % 1.0
    wanted = cumulative[first] + share * (cumulative[last] - cumulative[first])
    position = np.clip(np.searchsorted(cumulative, wanted, side="right") - 1, first, last - 1)
    triangle = patches.members[position]
    weights = triangle_points(plane_points(np.broadcast_to(number, share.shape), shift[..., :2]))
    points = np.einsum("snc,snck->snk", weights, patches.corners[triangle])
    turned = np.where(side >= len(patches), -1.0, 1.0)[:, None, None]
    return points, patches.normals[triangle] * turned


def hemisphere_rows(
    patches: Patches, visibility: Visibility, workers: Workers, *, rays: int, seed: int, purpose: str, sky: Sky = DARK
) -> tuple[Sides, Rows, Opening]:
    """Form factors between the sides of patches, from `rays` rays a side; and what of them leaves the scene.

    Fronts are always sampled. Backs are sampled once a ray has met them, then what those meet, until nothing new is
    met.
    """
    count = len(patches)
    hemispheres = Hemispheres(patches, visibility, rays // SITES, stream(seed, "patterns " + purpose), sky)
    fresh = np.arange(count, dtype=np.int32)
    met = np.zeros(2 * count, dtype=bool)
    met[:count] = True
    looks: list[_Look] = []
    while len(fresh):
        looks.append(_look_around(patches, fresh, hemispheres, workers, seed, f"{purpose} {len(looks)}"))
        reached = np.zeros(2 * count, dtype=bool)
        reached[looks[-1].column] = True
        fresh = np.flatnonzero(reached & ~met).astype(np.int32)
        met |= reached
    look = _Look(*(np.concatenate([getattr(part, f.name) for part in looks]) for f in fields(_Look)))
    sides = Sides(patches, look.side, look.points, look.normals, look.hidden)
    number = np.full(2 * count, -1, dtype=np.int32)
    number[look.side] = np.arange(len(look.side), dtype=np.int32)
    counted = (~look.hidden).sum(axis=1) * hemispheres.rays
    weights = (look.hits / np.repeat(counted, look.length)).astype(np.float32)
    rows = Rows(np.concatenate([[0], np.cumsum(look.length)]).astype(np.int64), number[look.column], weights)
    return sides, _mutual(rows, sides.back), Opening(look.escaped / counted, look.skylight / counted[:, None])


@dataclass(frozen=True, eq=False)
class Opening:
    """How open some sides are to the sky: share (s,) of the rays that escapes, and light (s, k), the mean over all rays
    of what Sky.light says they bring."""

    share: Float64
    light: Float64

    def scaled(self, factors: Float64) -> Opening:
        """The same with all of side i times factors[i]."""
        return Opening(self.share * factors, self.light * factors[:, None])


@dataclass(frozen=True, eq=False)
class _Look:
    """What the rays of some sides met: the sides with their sites, how many entries each has, the side met (global
    number) and the hits on it, the rays that escaped, and the sum of the light that they brought (s, k)."""

    side: Int32
    points: Float64
    normals: Float64
    hidden: Bool
    length: Index
    column: Int32
    hits: Index
    escaped: Index
    skylight: Float64


def _look_around(
    patches: Patches, side: Int32, hemispheres: Hemispheres, workers: Workers, seed: int, purpose: str
) -> _Look:
    codes = hemispheres.codes
    # From a ray's code to the side it met. Escaped rays go to a column beyond all sides, ignored ones beyond that.
    escaped, ignored = 2 * len(patches), 2 * len(patches) + 1
    light = hemispheres.sky.light
    texels = np.full(len(light), escaped)
    side_of_code = np.concatenate([patches.patch, patches.patch + len(patches), [ignored], texels]).astype(np.int32)
    points, normals = site_points(patches, side, stream(seed, "sites " + purpose).random((len(side), 1, 3)))

    def work(number: int, part: slice) -> tuple[Bool, Index, Int32, Index, Index, Float64]:
        rng = stream(seed, "rows " + purpose, number)
        origins, axes = points[part].reshape(-1, 3), normals[part].reshape(-1, 3)
        met = hemispheres.cast(origins, axes, axes, rng).reshape(-1, SITES, hemispheres.rays)
        hidden = _hidden(((met >= codes.triangles) & (met < codes.lost)).mean(axis=2))
        columns = side_of_code[met]
        columns[hidden] = ignored
        columns = columns.reshape(len(met), -1)
        skylight = _light_of_escaped(light, met.reshape(len(met), -1) - codes.escaped, columns == escaped)
        columns.sort(axis=1)
        return hidden, *_run_lengths(columns, escaped), skylight

    chunk = max(1, hemispheres.chunk // SITES)
    parts = zip(*workers.map(work, len(side), chunk), strict=True)
    return _Look(side, points, normals, *(np.concatenate(p) for p in parts))


def _light_of_escaped(light: Float32, texel: Int32, escaped: Bool) -> Float64:
    """Sums (n, k) of light (texels, k) over the escaped among the rays (n, r) of each side."""
    side = np.nonzero(escaped)[0]
    brought = light[texel[escaped]]
    sums = [np.bincount(side, channel, len(texel)) for channel in brought.T]
    return np.stack(sums, axis=1) if sums else np.zeros((len(texel), 0))


def _hidden(behind: Float64) -> Bool:
    """Sites (n, SITES) of a patch that lie inside a solid while others do not, by their share of rays that meet backs.

    Such a patch runs under an object that stands on it; only its open part takes part in the exchange of light.
    """
    inside, outside = behind > _INSIDE, behind < _OUTSIDE
    return np.asarray(inside & outside.any(axis=1, keepdims=True))


def _run_lengths(columns: Int32, escaped: int) -> tuple[Index, Int32, Index, Index]:
    """Sorted columns (n, k) to entries: how many each row has, their columns and their hits; and the rays escaped."""
    rays = columns.shape[1]
    new = np.ones(columns.shape, dtype=bool)
    new[:, 1:] = columns[:, 1:] != columns[:, :-1]
    start = np.flatnonzero(new)
    hits = np.diff(start, append=columns.size)
    column = columns.reshape(-1)[start]
    kept = column < escaped
    length = np.bincount(start[kept] // rays, minlength=len(columns))
    return length, column[kept], hits[kept], np.count_nonzero(columns == escaped, axis=1)


def _mutual(rows: Rows, back: Bool) -> Rows:
    """Leave out what only one of a front and a back has seen: a back that lies inside a solid sees the part of a patch
    that runs under it, and would lead the light of the open part inside."""
    owner = rows.owners()
    mixed = np.flatnonzero(back[owner] != back[rows.columns])
    if not len(mixed):
        return rows
    i, j = owner[mixed], rows.columns[mixed].astype(np.int64)
    alone = ~np.isin(i * len(rows) + j, j * len(rows) + i)
    kept = np.ones(len(owner), dtype=bool)
    kept[mixed[alone]] = False
    length = np.bincount(owner[kept], minlength=len(rows))
    return Rows(np.concatenate([[0], np.cumsum(length)]).astype(np.int64), rows.columns[kept], rows.weights[kept])
