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

    side (s,) int32: patch index for a front, patch index + number of patches for a back. area (s,) in the unit box: of
    the part that is not inside a solid.
    """

    patches: Patches
    side: Int32
    area: Float64

    @property
    def patch(self) -> Int32:
        return self.side % np.int32(len(self.patches))

    @property
    def back(self) -> np.ndarray:
        return self.side >= len(self.patches)

    @property
    def albedo(self) -> Float32:
        return self.patches.albedo[self.patch]

    @property
    def emission(self) -> Float32:
        return self.patches.emission[self.patch]

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


@dataclass(frozen=True, eq=False)
class Sights:
    """What the rays of sides met, before it is put into rows: `length` entries a side, the side met (global number) and
    the hits on it; rays `escaped` and rays that `count` a side."""

    length: np.ndarray
    column: np.ndarray
    hits: np.ndarray
    escaped: np.ndarray
    counted: np.ndarray


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
        parts.append(_look_around(_sides(patches, fresh), hemispheres, workers, seed, f"{purpose} {len(parts)}"))
        reached = np.zeros(2 * count, dtype=bool)
        reached[parts[-1].column] = True
        fresh = np.flatnonzero(reached & ~met).astype(np.int32)
        met |= reached
    length, column, hits, escaped, counted = (
        np.concatenate([getattr(p, f) for p in parts]) for f in ("length", "column", "hits", "escaped", "counted")
    )
    sides = _sides(patches, np.concatenate(side), counted / (SITES * hemispheres.rays))
    number = np.full(2 * count, -1, dtype=np.int32)
    number[sides.side] = np.arange(len(sides.side), dtype=np.int32)
    weights = (hits / np.repeat(counted, length)).astype(np.float32)
    rows = Rows(np.concatenate([[0], np.cumsum(length)]).astype(np.int64), number[column], weights)
    return sides, _mutual(rows, sides.back), escaped / counted


def _sides(patches: Patches, side: Int32, open_share: Float64 | float = 1.0) -> Sides:
    return Sides(patches, side, patches.patch_area[side % np.int32(len(patches))] * open_share)


def _look_around(sides: Sides, hemispheres: Hemispheres, workers: Workers, seed: int, purpose: str) -> Sights:
    patches = sides.patches
    codes = hemispheres.codes
    # From a ray's code to the side it met. Escaped rays go to a column beyond all sides, ignored ones beyond that.
    escaped, ignored = 2 * len(patches), 2 * len(patches) + 1
    side_of_code = np.concatenate([patches.patch, patches.patch + len(patches), [escaped, ignored]]).astype(np.int32)
    sites = [sides.sites(seed, purpose, number) for number in range(SITES)]

    def work(number: int, part: slice) -> tuple[np.ndarray, ...]:
        rng = stream(seed, "rows " + purpose, number)
        met = np.stack([hemispheres.cast(p[part], n[part], n[part], rng) for p, n in sites], axis=1)
        columns = side_of_code[met]
        behind = ((met >= codes.triangles) & (met < codes.escaped)).mean(axis=2)
        columns[_hidden(behind)] = ignored
        columns = columns.reshape(len(met), -1)
        columns.sort(axis=1)
        return _run_lengths(columns, escaped)

    return Sights(
        *(np.concatenate(p) for p in zip(*workers.map(work, len(sides.side), hemispheres.chunk), strict=True))
    )


def _hidden(behind: Float64) -> np.ndarray:
    """Sites (n, sites) of a patch that lie inside a solid while others do not, by their share of rays that meet backs.

    Such a patch runs under an object that stands on it; only its open part takes part in the exchange of light.
    """
    inside, outside = behind > 0.95, behind < 0.6
    return inside & outside.any(axis=1, keepdims=True)


def _run_lengths(columns: np.ndarray, escaped: int) -> tuple[np.ndarray, ...]:
    """Sorted columns (n, k) to the fields of Sights."""
    rays = columns.shape[1]
    new = np.ones(columns.shape, dtype=bool)
    new[:, 1:] = columns[:, 1:] != columns[:, :-1]
    start = np.flatnonzero(new)
    hits = np.diff(start, append=columns.size)
    column = columns.reshape(-1)[start]
    kept = column < escaped
    length = np.bincount(start[kept] // rays, minlength=len(columns))
    out = np.count_nonzero(columns == escaped, axis=1)
    return length, column[kept], hits[kept], out, np.count_nonzero(columns <= escaped, axis=1)


def _mutual(rows: Rows, back: np.ndarray) -> Rows:
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
