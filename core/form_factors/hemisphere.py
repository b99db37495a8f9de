"""The hemisphere estimator: what the rays of a patch hit is its row of form factors.

Rows sum to at most one by construction, nothing is singular, and the cost is linear in patches (Malley 1988).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..hemisphere import Hemispheres
from ..parallel import Workers
from ..patches import Patches
from ..sampling import plane_points, stream, triangle_points
from ..scene import Float32, Float64, Int32
from ..visibility import Visibility
from .rows import Rows

#: Points of a patch from which its rays start.
SITES = 4


@dataclass(frozen=True, eq=False)
class Sides:
    """The sides of patches that can exchange light: every front, and each back that some ray can reach.

    side (s,) int32: patch index for a front, patch index + number of patches for a back. area (s,) in the unit box.
    """

    patches: Patches
    side: Int32

    @property
    def patch(self) -> Int32:
        return self.side % np.int32(len(self.patches))

    @property
    def back(self) -> np.ndarray:
        return self.side >= len(self.patches)

    @property
    def area(self) -> Float64:
        return self.patches.patch_area[self.patch]

    @property
    def albedo(self) -> Float32:
        return self.patches.albedo[self.patch]

    def sites(self, seed: int, purpose: str, number: int) -> tuple[Float64, Float64]:
        """One random point (s, 3) on each side, the number-th of an even sequence, and its normal (s, 3)."""
        shift = stream(seed, "sites " + purpose).random((len(self.side), 3))
        patch, patches = self.patch, self.patches
        first, last = patches.first[patch], patches.first[patch + 1]
        # The member that a point falls on, by area; the sequence is even over the members as well.
        cumulative = np.concatenate([[0.0], np.cumsum(patches.area[patches.members])])
        share = (number * 0.6180339887498949 + shift[:, 2]) % 1.0
        wanted = cumulative[first] + share * (cumulative[last] - cumulative[first])
        position = np.clip(np.searchsorted(cumulative, wanted, side="right") - 1, first, last - 1)
        triangle = patches.members[position]
        weights = triangle_points(plane_points(np.full(len(shift), number), shift[:, :2]))
        points = np.einsum("sc,sck->sk", weights, patches.corners[triangle])
        return points, patches.normals[triangle] * np.where(self.back, -1.0, 1.0)[:, None]


def hemisphere_rows(
    patches: Patches, visibility: Visibility, workers: Workers, *, rays: int, seed: int, purpose: str
) -> tuple[Sides, Rows, Float64]:
    """Form factors between the sides of patches, from `rays` rays a side; and the share (s,) that escapes.

    Fronts are always sampled. Backs are sampled once a ray has met them, then what those meet, until nothing new is met.
    """
    count = len(patches)
    hemispheres = Hemispheres(patches, visibility, rays // SITES, stream(seed, "patterns " + purpose))
    fresh = np.arange(count, dtype=np.int32)
    met = np.zeros(2 * count, dtype=bool)
    met[:count] = True
    side, parts = [], []
    while len(fresh):
        side.append(fresh)
        parts.append(_sample(Sides(patches, fresh), hemispheres, workers, seed, f"{purpose} {len(parts)}"))
        reached = np.zeros(2 * count, dtype=bool)
        reached[parts[-1][1]] = True
        fresh = np.flatnonzero(reached & ~met).astype(np.int32)
        met |= reached
    sides = Sides(patches, np.concatenate(side))
    length, column, hits, escaped = (np.concatenate(p) for p in zip(*parts, strict=True))
    number = np.full(2 * count, -1, dtype=np.int32)
    number[sides.side] = np.arange(len(sides.side), dtype=np.int32)
    indptr = np.concatenate([[0], np.cumsum(length)]).astype(np.int64)
    total = SITES * hemispheres.rays
    return sides, Rows(indptr, number[column], (hits / total).astype(np.float32)), escaped / total


def _sample(
    sides: Sides, hemispheres: Hemispheres, workers: Workers, seed: int, purpose: str
) -> tuple[np.ndarray, ...]:
    """Entries of the rows of these sides: how many each row has, the sides met, the hits on each; rays escaped."""
    patches = sides.patches
    codes = hemispheres.codes
    # From a ray's code to the side it met; escaped and lost rays go to a column beyond all sides.
    beyond = 2 * len(patches)
    side_of_code = np.concatenate([patches.patch, patches.patch + len(patches), [beyond, beyond]]).astype(np.int32)
    sites = [sides.sites(seed, purpose, number) for number in range(SITES)]

    def work(number: int, part: slice) -> tuple[np.ndarray, ...]:
        rng = stream(seed, "rows " + purpose, number)
        met = [hemispheres.cast(points[part], normals[part], normals[part], rng) for points, normals in sites]
        columns = side_of_code[np.concatenate(met, axis=1)]
        columns.sort(axis=1)
        return _run_lengths(columns, beyond)

    parts = list(workers.map(work, len(sides.side), hemispheres.chunk))
    length, column, hits, escaped = (np.concatenate(p) for p in zip(*parts, strict=True))
    return length, column, hits, escaped


def _run_lengths(columns: np.ndarray, beyond: int) -> tuple[np.ndarray, ...]:
    """Sorted columns (n, k) to entries: how many each row has, their columns, their counts, and the row's escapes."""
    rays = columns.shape[1]
    new = np.ones(columns.shape, dtype=bool)
    new[:, 1:] = columns[:, 1:] != columns[:, :-1]
    start = np.flatnonzero(new)
    count = np.diff(start, append=columns.size)
    column = columns.reshape(-1)[start]
    escaped = np.count_nonzero(columns == beyond, axis=1)
    kept = column != beyond
    length = np.bincount(start[kept] // rays, minlength=len(columns))
    return length, column[kept], count[kept], escaped
