"""Form factors pair by pair: which triangles face each other, how much of that is worth a ray, and what the rays say.

The analytic and the centroid estimator differ in two functions only: the exchange area of an unoccluded pair, and how
the visible share of a pair is found.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import cast

import numpy as np
from numpy.typing import NDArray

from ..parallel import Workers
from ..patches import Patches
from ..sampling import stream
from ..scene import Bool, Float64
from ..sky import Sky
from ..visibility import Visibility, offset_along
from .hemisphere import Opening, hemisphere_rows
from .rows import Rows
from .sides import Sides

Index = NDArray[np.int64]

#: Pairs a chunk of work: few enough for even loads on the threads and for arrays that stay near the processor.
_CHUNK_PAIRS = 1 << 15
#: Height over a plane, in the unit box, from which a vertex counts as in front of it.
_IN_FRONT = 1e-7
#: Rays a side that find out which backs take part and whether a side sees any sky at all.
_PROBES = 64
#: Barycentric corners of the four triangles that edge midpoints make of one.
QUARTERS: Float64 = (
    np.array(
        [
            [[2, 0, 0], [1, 1, 0], [1, 0, 1]],
            [[1, 1, 0], [0, 2, 0], [0, 1, 1]],
            [[1, 0, 1], [0, 1, 1], [0, 0, 2]],
            [[0, 1, 1], [1, 0, 1], [1, 1, 0]],
        ]
    )
    / 2.0
)


@dataclass(frozen=True, eq=False)
class Faces:
    """Triangles with one side each: every front, and the backs of those sides that take part.

    corners (f, 3, 3) counter-clockwise seen from that side, normals (f, 3), area (f,), centroid (f, 3), radius (f,) of
    the ball about the centroid that holds it, side (f,) into Sides.
    """

    corners: Float64
    normals: Float64
    area: Float64
    centroid: Float64
    radius: Float64
    side: Index

    @staticmethod
    def of(sides: Sides) -> Faces:
        patches = sides.patches
        number = np.full(2 * len(patches), -1, dtype=np.int64)
        number[sides.side] = np.arange(len(sides.side))
        front, back = number[patches.patch], number[patches.patch + len(patches)]
        turned = back >= 0
        corners = np.concatenate([patches.corners, patches.corners[turned][:, ::-1]])
        centroid = corners.mean(axis=1)
        return Faces(
            corners=corners,
            normals=np.concatenate([patches.normals, -patches.normals[turned]]),
            area=np.concatenate([patches.area, patches.area[turned]]),
            centroid=centroid,
            radius=np.linalg.norm(corners - centroid[:, None], axis=2).max(axis=1),
            side=np.concatenate([front, back[turned]]),
        )

    def heights(self, over: slice | Index, of: slice | Index) -> Float64:
        """(a, b) height of the highest corner of each face `of` over the plane of each face `over`."""
        base = np.einsum("ak,ak->a", self.normals[over], self.centroid[over])
        tops = [np.einsum("ak,bk->ab", self.normals[over], self.corners[of, k]) for k in range(3)]
        return cast(Float64, np.maximum(np.maximum(tops[0], tops[1]), tops[2]) - base[:, None])

    def facing(self, rows: slice) -> tuple[Index, Index]:
        """Pairs p < q, p in rows, of which each has some part in front of the other."""
        later = slice(rows.start, len(self.area))
        facing = self.heights(rows, later) > _IN_FRONT
        facing &= self.heights(later, rows).T > _IN_FRONT
        p, q = np.nonzero(np.triu(facing, 1))
        return p + rows.start, q + rows.start

    def connect(
        self, visibility: Visibility, p: Index, q: Index, weights_p: Float64, weights_q: Float64
    ) -> tuple[Float64, Bool]:
        """The kernel cos cos / r^2 between points (n, 3 barycentric) of faces p and q, and whether the way is free."""
        x = np.einsum("nc,nck->nk", weights_p, self.corners[p])
        y = np.einsum("nc,nck->nk", weights_q, self.corners[q])
        way = y - x
        cosines = np.maximum(np.einsum("nk,nk->n", way, self.normals[p]), 0.0)
        cosines *= np.maximum(-np.einsum("nk,nk->n", way, self.normals[q]), 0.0)
        kernel = cosines / np.maximum(np.einsum("nk,nk->n", way, way) ** 2, np.finfo(np.float64).tiny)
        origins, targets = offset_along(x, self.normals[p]), offset_along(y, self.normals[q])
        return kernel, visibility.unblocked(origins, targets)


#: Exchange areas (m,) of pairs of faces, unoccluded.
Exchange = Callable[[Faces, Index, Index], Float64]
#: Visible shares (m,) of pairs of faces, 0 to 1, and the number of rays it took.
VisibleShare = Callable[[Faces, Visibility, Index, Index, np.random.Generator], tuple[Float64, int]]


@dataclass(frozen=True, eq=False)
class Estimate:
    """Form factors between sides (s,), and where the rest of each side's light goes.

    opening: what leaves the scene. culled (s,): share that went to pairs below the threshold, as if nothing
    stood between them. rays cast.
    """

    sides: Sides
    rows: Rows
    opening: Opening
    culled: Float64
    rays: int


def rows_by_pairs(
    patches: Patches,
    visibility: Visibility,
    workers: Workers,
    exchange: Exchange,
    visible_share: VisibleShare,
    *,
    threshold: float,
    seed: int,
    purpose: str,
    sky: Sky,
) -> Estimate:
    """All pairs of faces, each once, so that A_i F_ij = A_j F_ji holds by construction.

    Pairs whose form factors stay below `threshold` both ways are culled before any ray is cast.
    """
    probe = hemisphere_rows(patches, visibility, workers, rays=_PROBES, seed=seed, purpose=f"probe {purpose}", sky=sky)
    sides, probed = probe.sides, probe.opening
    faces = Faces.of(sides)
    area = sides.area

    def work(number: int, part: slice) -> tuple[Index, Index, Float64, Float64, int]:
        p, q = faces.facing(part)
        amount = exchange(faces, p, q)
        kept = amount >= threshold * np.minimum(faces.area[p], faces.area[q])
        lost = np.zeros(len(area))
        for side in (faces.side[p[~kept]], faces.side[q[~kept]]):
            lost += np.bincount(side, amount[~kept], len(area))
        p, q, amount = p[kept], q[kept], amount[kept]
        share, rays = visible_share(faces, visibility, p, q, stream(seed, f"pairs {purpose}", number))
        # No more of a pair is free than what lies open of both: few rays may say so of a patch that shows by a corner.
        share = np.minimum(share, sides.open_share[faces.side[p]] * sides.open_share[faces.side[q]])
        amount *= share
        seen = share > 0.0
        return faces.side[p[seen]], faces.side[q[seen]], amount[seen], lost, rays

    chunk = max(1, _CHUNK_PAIRS // max(1, len(faces.area)))
    first, second, amounts, lost, rays = zip(*workers.map(work, len(faces.area), chunk), strict=True)
    i, j, amount = np.concatenate(first), np.concatenate(second), np.concatenate(amounts)
    rows = Rows.from_triplets(
        np.concatenate([i, j]), np.concatenate([j, i]), np.concatenate([amount / area[i], amount / area[j]]), len(area)
    )
    culled = np.sum(lost, axis=0) / area
    # The rays tell from where in the sky the light comes, the form factors how much of it.
    escape = np.clip(1.0 - rows.row_sums() - culled, 0.0, 1.0)
    seen = probed.share > 0.0
    opening = probed.scaled(np.divide(escape, probed.share, out=np.zeros(len(area)), where=seen))
    return Estimate(sides, rows, opening, culled, sum(rays) + _PROBES * len(area))
