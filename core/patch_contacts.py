"""Patches cut where something stands on them.

A patch sends out one light from each of its sides. One that ran on beneath a wall would carry the sun from before it
into the room behind it, and one that ran on beneath a solid would light its inside.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .patches import Patches, PatchMeshes, Space, triangle_geometry
from .receivers import numbered_edges
from .scene import Bool, Float32, Float64, Int32
from .tessellation import Int64, Tessellation, cut_edges, split_each, split_triangles
from .visibility import Visibility, offset_along

#: Of an edge, what is left out at both ends, lest a ray meets what bounds the surface; and how far inside the triangle
#: the ray runs, relative to the height.
_ENDS, _ASIDE = 1e-3, 5e-5
#: How often the place on an edge is narrowed to a half; how far within what stands there it is cut, lest rays along the
#: cut graze that; and how near to an end there is no cut, which would leave a sliver.
_HALVINGS, _WITHIN, _SNAP = 16, 4e-4, 2e-3
#: Of the way from the middle of a triangle to a corner, what tells whether something stands on it still.
_TOWARDS = 0.95
#: How often pieces are looked at again, and up to how many times as many patches; and how high, relative to a patch's
#: edge, a piece is that is looked into: of slivers rays tell only by chance what stands on them.
_LEVELS, _GROWTH, _HIGH = 6, 1.5, 0.05
#: Sine of the angle up to which a way runs along a patch; cosine of the angle from which on a surface does not stand on
#: another but folds onto it: there rays start beyond it, and meet it from behind.
_FLAT, _FOLDED = 1e-3, 0.995


@dataclass(frozen=True, eq=False)
class _Ways:
    """Ways along edges (e,) of surfaces, from ends `first` to ends `second` (e, 3); normals (e, 3) of the side of the
    surface that they run on."""

    first: Float64
    second: Float64
    normals: Float64

    def only(self, chosen: Int64) -> _Ways:
        return _Ways(self.first[chosen], self.second[chosen], self.normals[chosen])

    def turned(self) -> _Ways:
        """The same on the other side of the surface."""
        return replace(self, normals=-self.normals)

    def at(self, places: Float64) -> Float64:
        """Points (e, 3) at the places (e,)."""
        return self.first + places[:, None] * (self.second - self.first)

    def rays(self, places: Float64) -> tuple[Float32, Float32]:
        """Where rays (e, 3) along the surface begin, at the first ends, and how they get to the places (e,)."""
        start = self.at(np.full(len(places), _ENDS))
        return offset_along(start, self.normals), (self.at(places) - start).astype(np.float32)

    def barred(self, places: Float64, visibility: Visibility) -> Bool:
        """Whether something stands on the surface between the first ends and the places (e,)."""
        return ~visibility.unblocked_along(*self.rays(places))


def cut_at_contacts(split: PatchMeshes, patches: Patches, visibility: Visibility) -> PatchMeshes:
    """The triangles that are patches, cut along what stands on either side of them; what was given where nothing does.
    Edges are cut where they are crossed; where a corner of what stands there lies inside a triangle, that
    is split into four first.

    split: what the patches were made of; visibility: among them.
    """
    given, room = split, int((_GROWTH - 1.0) * len(patches))
    most = len(split.halvings) + room
    chosen = np.zeros(len(split.halvings), dtype=bool)
    chosen[patches.triangle] = np.bincount(patches.patch)[patches.patch] == 1
    for _ in range(_LEVELS):
        places = _contacts(split, patches, visibility, chosen, most - len(chosen))
        split, cut = _split_each(split, places, cut_edges)
        pieces, chosen = chosen[cut] & (np.bincount(cut)[cut] > 1), chosen[cut]
        chosen[_thin(split, chosen)] = False
        crossed = _crossed(split, patches.space, visibility, chosen, most - len(chosen))
        split, quartered = _split_each(split, crossed, split_triangles)
        chosen = (pieces | (np.bincount(quartered) > 1) & chosen)[quartered]
        if not chosen.any() or len(chosen) >= most:
            break
    return given if given.same_triangles(split) else split


def _split_each(
    split: PatchMeshes,
    where: NDArray[Any],
    split_mesh: Callable[[Tessellation, NDArray[Any]], tuple[Tessellation, Int64]],
) -> tuple[PatchMeshes, Int64]:
    """Split the meshes where (t, ...) it says; and for each new triangle the one it came from."""
    meshes, source = split_each(split.meshes, where, split_mesh)
    return replace(split, meshes=meshes, halvings=split.halvings[source]), source


def parted(patches: Patches, visibility: Visibility) -> Bool:
    """Which patches (p,) something stands between and the largest of their coarser group, where both lie in one
    plane."""
    center, facing = patches.centres
    by_size = np.argsort(-patches.patch_area, kind="stable")
    _, first, group = np.unique(patches.coarser_groups[by_size], return_index=True, return_inverse=True)
    there = np.empty_like(center)
    there[by_size] = center[by_size[first[group]]]
    away = there - center
    distance = np.linalg.norm(away, axis=1)
    flat = (distance > 0.0) & (np.abs(np.einsum("pk,pk->p", facing, away)) <= _FLAT * distance)
    some = np.flatnonzero(flat)
    ways = _Ways(center[some], there[some], facing[some])
    apart = np.zeros(len(patches), dtype=bool)
    for on_side in (ways, ways.turned()):
        apart[some] |= on_side.barred(np.full(len(some), 1.0 - _ENDS), visibility)
    return apart


def _contacts(split: PatchMeshes, patches: Patches, visibility: Visibility, chosen: Bool, room: int) -> Float64:
    """Places (t, 3) on the edges of the chosen triangles (t,) where they are to be cut, see `tessellation.cut_edges`;
    nan elsewhere. room: for so many more triangles; the longest edges come first."""
    vertices, triangles = _together(split)
    vertices = patches.space.normalise(vertices)
    number, ends, side = numbered_edges(triangles)
    # Of both sides of an edge the first that belongs to a chosen triangle.
    theirs = np.flatnonzero(np.repeat(chosen, 3))[::-1]
    side[number.ravel()[theirs]] = theirs
    some = np.flatnonzero(chosen[side // 3])
    ways = _along_edges(vertices, triangles[side[some] // 3], side[some] % 3)
    place = np.full(len(side), np.nan)
    for on_side in (ways, ways.turned()):
        free = np.flatnonzero(np.isnan(place[some]))
        place[some[free]] = _first_contact(on_side.only(free), patches, visibility)
    place[(place < _SNAP) | (place > 1.0 - _SNAP)] = np.nan
    cut = np.flatnonzero(np.isfinite(place))
    length = np.linalg.norm(vertices[ends[cut, 1]] - vertices[ends[cut, 0]], axis=1)
    # Each makes two triangles more, one on either side.
    place[cut[np.argsort(-length, kind="stable")[max(room // 2, 0) :]]] = np.nan
    return place[number]


def _crossed(split: PatchMeshes, space: Space, visibility: Visibility, chosen: Bool, room: int) -> Bool:
    """Which of the chosen triangles (t,) something stands on still, between the middle and a corner. room: for so many
    more triangles; the largest come first."""
    vertices, triangles = _together(split)
    some = np.flatnonzero(chosen)
    corners = space.normalise(vertices[triangles[some]])
    middles = np.repeat(corners.mean(axis=1), 3, axis=0)
    ways = _Ways(middles, corners.reshape(-1, 3), np.repeat(triangle_geometry(corners)[0], 3, axis=0))
    places = np.full(len(ways.first), _TOWARDS)
    barred = ways.barred(places, visibility) | ways.turned().barred(places, visibility)
    standing = np.flatnonzero(barred.reshape(-1, 3).any(axis=1))
    by_size = np.argsort(-triangle_geometry(corners)[1][standing], kind="stable")
    crossed = np.zeros(len(chosen), dtype=bool)
    # Each makes three triangles more, and those beside it as many.
    crossed[some[standing[by_size[: max(room // 6, 0)]]]] = True
    return crossed


def _thin(split: PatchMeshes, chosen: Bool) -> Int64:
    """Those of the chosen triangles (t,) that are slivers."""
    vertices, triangles = _together(split)
    some = np.flatnonzero(chosen)
    corners = vertices[triangles[some]]
    longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    height = 2.0 * triangle_geometry(corners)[1] / np.maximum(longest, np.finfo(float).tiny)
    return some[height < _HIGH * split.edge]


def _together(split: PatchMeshes) -> tuple[Float64, Int32]:
    """Vertices (v, 3) of all meshes, metres, and their triangles (t, 3)."""
    begin = np.cumsum([0, *(len(m.vertices) for m in split.meshes)])
    triangles = [m.triangles + np.int32(b) for m, b in zip(split.meshes, begin, strict=False)]
    return np.concatenate([m.vertices for m in split.meshes]), np.concatenate(triangles)


def _along_edges(vertices: Float64, triangles: Int32, corner: Int64) -> _Ways:
    """Ways along the edges of triangles (n, 3) from a corner (n,) to the next, a little to the inside; from the end
    with the lower number to the other."""
    each = np.arange(len(corner))
    one, other, opposite = (triangles[each, (corner + k) % 3] for k in range(3))
    first, second, third = vertices[np.minimum(one, other)], vertices[np.maximum(one, other)], vertices[opposite]
    normals, _ = triangle_geometry(vertices[triangles])
    inside = (1.0 - _ASIDE) * first + _ASIDE * third, (1.0 - _ASIDE) * second + _ASIDE * third
    return _Ways(*inside, normals)


def _first_contact(ways: _Ways, patches: Patches, visibility: Visibility) -> Float64:
    """Where (e,) something first stands in each way, from 0 to 1, a little within that; nan where nothing does."""
    place = np.full(len(ways.first), np.nan)
    barred = np.flatnonzero(ways.barred(np.full(len(place), 1.0 - _ENDS), visibility))
    ways = ways.only(barred)
    low, high = np.full(len(barred), _ENDS), np.full(len(barred), 1.0 - _ENDS)
    for _ in range(_HALVINGS):
        middle = (low + high) / 2.0
        before = ways.barred(middle, visibility)
        low, high = np.where(before, low, middle), np.where(before, middle, high)
    met = patches.normals[visibility.nearest(*ways.rays(high))]
    # Out of a solid a way meets the back of its surface.
    leaves = np.einsum("ek,ek->e", met, ways.second - ways.first) > 0.0
    stands = np.abs(np.einsum("ek,ek->e", met, ways.normals)) < _FOLDED
    place[barred] = np.where(stands, high + np.where(leaves, -_WITHIN, _WITHIN), np.nan)
    return place
