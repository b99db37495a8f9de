"""The receivers: their output triangles, the cells light is sampled on, and the vertices light is fitted to."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from .patches import Cells, Space, shading_normals, triangle_geometry
from .scene import Bool, Float64, Int32, Scene, SceneObject
from .settings import Settings
from .sorting import distinct, renumbered, stable_order
from .tessellation import (
    Int64,
    Tessellation,
    cut_edges,
    edge_for_count,
    edge_keys,
    split_each,
    split_triangles,
    triform,
    whole,
)
from .textures import Colours, constant_colours, mean_colours, varies

#: Corners whose shading normals differ by less than this angle (cosine) share one value.
_SAME_NORMAL = np.cos(np.radians(5.0))
#: Places in a texture, and corner colours, that differ by less than this are the same, but for rounding.
_SAME_PLACE = 1e-4

#: Of triangles: corners (t, 3, 3), normals (t, 3), areas (t,), and normals at the corners (t, 3, 3), None if all are
#: flat.
Shapes: TypeAlias = tuple[Float64, Float64, Float64, Float64 | None]


@dataclass(frozen=True, eq=False)
class Receivers:
    """The output meshes of the receivers, and the cells on all of them: the triangles of the fine meshes, which are the
    output meshes unless the input's own triangles are kept.

    first (r + 1,): where each receiver's output triangles begin. element_surface (e,): theirs, into Scene.surfaces.
    places (e, 3, k): what else, if given, breaks the fit where it changes over an edge. breaks (e, 3): sides, from each
    corner to the next, over which light jumps, so that the fit breaks there; None if there is none. on_contour (e, 3):
    corners that were made by cutting along contours; None if nothing was cut.
    """

    space: Space
    objects: tuple[SceneObject, ...]
    meshes: tuple[Tessellation, ...]
    fine: tuple[Tessellation, ...]
    cells: Cells
    first: Int32
    element_surface: Int32
    places: Float64 | None = None
    breaks: Bool | None = None
    on_contour: Bool | None = None

    @property
    def corner_vertex(self) -> Int32:
        """(e, 3) the fit vertex of each corner of the output triangles."""
        return self._fit_vertices[0]

    @property
    def elements(self) -> int:
        """How many output triangles there are."""
        return int(self.first[-1])

    @property
    def element_corners(self) -> Float64:
        """(e, 3, 3) corners of the output triangles in the unit box."""
        # Not kept beside those of the cells: large meshes need the room.
        finer = len(self.cells) > self.elements
        return _corners(self.meshes, self.space) if finer else self.cells.corners

    @property
    def element_shading(self) -> Float64:
        """(e, 3, 3) normals at the corners of the output triangles."""
        cells = self.cells
        if len(cells) > self.elements:
            return _shading(self.objects, self.meshes, triangle_geometry(self.element_corners)[0])
        return _all_corners(cells.normals) if cells.shading is None else cells.shading

    @property
    def tessellated(self) -> bool:
        """Whether the cells are the output triangles, rather than lie in the input's own."""
        return self.meshes == self.fine

    @property
    def vertices(self) -> int:
        """How many fit vertices there are."""
        return self._fit_vertices[1]

    @cached_property
    def _fit_vertices(self) -> tuple[Int32, int]:
        # Only when someone asks: while triangles are still being split, nobody does.
        return fit_vertices(
            _numbered(self.meshes), self.element_shading, self.element_surface, self.places, self.breaks
        )

    def vertex_means(self, values: Float64) -> Float64:
        """Means (v,) of the values (c,) of the cells around each fit vertex, by area."""
        corner = self.corner_vertex[self.cells.element].ravel()
        weight = np.repeat(self.cells.area, 3)
        total = np.bincount(corner, weight * np.repeat(values, 3), self.vertices)
        around = np.bincount(corner, weight, self.vertices)
        return np.asarray(total / np.maximum(around, np.finfo(float).tiny))

    def at_cells(self, values: Float64) -> Float64:
        """Means (c, ...) of values (v, ...) at the fit vertices around each cell."""
        return np.asarray(values[self.corner_vertex[self.cells.element]].mean(axis=1))

    @cached_property
    def broken(self) -> Bool:
        """(c,) cells with a corner where the fit breaks along a contour."""
        if self.breaks is None:
            return np.zeros(len(self.cells), dtype=bool)
        ends = self.breaks | np.roll(self.breaks, 1, axis=1)
        at_break = np.zeros(self.vertices, dtype=bool)
        at_break[self.corner_vertex[ends]] = True
        return np.asarray(at_break[self.corner_vertex[self.cells.element]].any(axis=1))

    @property
    def parent(self) -> Int64:
        """(e,) the input's triangle that each output triangle is part of, counted over all receivers."""
        begin = np.cumsum([0, *(len(o.triangles) for o in self.objects[:-1])])
        return np.concatenate([m.parent + b for m, b in zip(self.meshes, begin, strict=True)])

    @cached_property
    def cell_vertex(self) -> Int32:
        """(c, 3) the mesh vertex of each corner of the cells, counted over all receivers."""
        return _numbered(self.fine)


def make_receivers(scene: Scene, space: Space, settings: Settings, triangles: int) -> Receivers:
    """Tessellate the receivers to edges of the asked size, or so that about `triangles` of one size would cover them.

    Where the mesh is to be kept, the output has the input's triangles, and only the sampling is as fine as that.
    """
    objects = scene.receivers()
    shared = [o for o in objects if o.size is None] or objects
    edge = settings.size or edge_for_count([o.vertices for o in shared], [o.triangles for o in shared], triangles)
    fine = [triform(whole(o.vertices, o.triangles), o.size or edge) for o in objects]
    front = np.array([surface.front_share for surface in scene.surfaces])
    return lay_out(objects, fine, space, front if (front < 1).any() else None, tessellate=settings.tessellate)


def lay_out(
    objects: tuple[SceneObject, ...],
    fine: list[Tessellation],
    space: Space,
    front: Float64 | None = None,
    *,
    tessellate: bool,
    shapes: Shapes | None = None,
) -> Receivers:
    """Cells on the triangles of the fine meshes, which become the output as well if `tessellate`.

    front (surfaces, 3): Surface.front_share, None when all are one. shapes: of those triangles, if they are known.
    """
    meshes = fine if tessellate else [whole(o.vertices, o.triangles) for o in objects]
    first = np.concatenate([[0], np.cumsum([len(m.triangles) for m in meshes])]).astype(np.int32)
    corners, normals, area, shading = shapes or _shapes(objects, fine, space)
    element, barycentric = np.arange(len(area), dtype=np.int32), None
    if not tessellate:
        element = np.concatenate([begin + m.parent for begin, m in zip(first, fine, strict=False)]).astype(np.int32)
        barycentric = np.concatenate([m.barycentric for m in fine])
        # From here on one copy serves both: large meshes need the room.
        ends = np.cumsum([len(m.triangles) for m in fine])[:-1]
        fine = [replace(m, barycentric=b) for m, b in zip(fine, np.split(barycentric, ends), strict=True)]
    return Receivers(
        space=space,
        objects=objects,
        meshes=tuple(meshes),
        fine=tuple(fine),
        cells=Cells(corners, normals, area, shading, element, barycentric, _surfaces(objects, fine), front),
        first=first,
        element_surface=_surfaces(objects, meshes),
    )


def _shapes(objects: tuple[SceneObject, ...], meshes: Sequence[Tessellation], space: Space) -> Shapes:
    """Of the triangles of all meshes."""
    corners = _corners(meshes, space)
    normals, area = triangle_geometry(corners)
    flat = all(o.corner_normals is None for o in objects)
    return corners, normals, area, None if flat else _shading(objects, meshes, normals)


def _shapes_of_pieces(receivers: Receivers, meshes: Sequence[Tessellation], source: Int64) -> Shapes:
    """The same of triangles that each came from a cell (t,): most of these are whole, and look as they did."""
    cells, cut = receivers.cells, np.bincount(source)[source] > 1
    parts = np.split(cut, np.cumsum([len(m.triangles) for m in meshes])[:-1])
    pieces = [m.only(part) for m, part in zip(meshes, parts, strict=True)]
    shading = None if cells.shading is None else cells.shading[source]
    shapes = cells.corners[source], cells.normals[source], cells.area[source], shading
    for values, of_pieces in zip(shapes, _shapes(receivers.objects, pieces, receivers.space), strict=True):
        if values is not None:
            values[cut] = of_pieces
    return shapes


def _corners(meshes: Sequence[Tessellation], space: Space) -> Float64:
    """(t, 3, 3) of the triangles of all meshes, in the unit box."""
    return np.concatenate([space.normalise(m.vertices)[m.triangles] for m in meshes])


def _surfaces(objects: tuple[SceneObject, ...], meshes: Sequence[Tessellation]) -> Int32:
    """(t,) of the triangles of all meshes, into Scene.surfaces."""
    return np.concatenate([o.surface[m.parent] for o, m in zip(objects, meshes, strict=True)]).astype(np.int32)


def _shading(objects: tuple[SceneObject, ...], meshes: Sequence[Tessellation], normals: Float64) -> Float64:
    """(t, 3, 3) at the corners of the triangles of all meshes, whose own normals (t, 3) are known."""
    if all(o.corner_normals is None for o in objects):
        return _all_corners(normals)
    ends = np.cumsum([len(m.triangles) for m in meshes])[:-1]
    parts = zip(objects, meshes, np.split(normals, ends), strict=True)
    return np.concatenate([shading_normals(o, m.parent, m.barycentric, n) for o, m, n in parts])


def _all_corners(normals: Float64) -> Float64:
    """The normals (t, 3) of flat triangles, at each of their corners (t, 3, 3)."""
    return np.broadcast_to(normals[:, None], (len(normals), 3, 3))


def _numbered(meshes: tuple[Tessellation, ...]) -> Int32:
    """(t, 3) vertices of the triangles of all meshes, counted through."""
    begin = np.concatenate([[0], np.cumsum([len(m.vertices) for m in meshes])[:-1]])
    return np.concatenate([m.triangles + b for m, b in zip(meshes, begin, strict=True)]).astype(np.int32)


def split_cells(receivers: Receivers, chosen: Bool) -> tuple[Receivers, Int64]:
    """The receivers with the chosen (c,) cells split into four; and for each new cell the one it came from."""
    return _split_each(receivers, chosen, split_triangles)


def cut_cells(receivers: Receivers, places: Float64) -> tuple[Receivers, Int64]:
    """The receivers with sides of cells cut at places (c, 3), see `tessellation.cut_edges`; and for each new cell the
    one it came from."""
    return _split_each(receivers, places, cut_edges)


def _split_each(
    receivers: Receivers,
    where: NDArray[Any],
    split_mesh: Callable[[Tessellation, NDArray[Any]], tuple[Tessellation, Int64]],
) -> tuple[Receivers, Int64]:
    """Split the mesh of each receiver where (c, ...) it says for its cells."""
    fine, source = split_each(receivers.fine, where, split_mesh)
    split_receivers = lay_out(
        receivers.objects,
        list(fine),
        receivers.space,
        receivers.cells.front,
        tessellate=receivers.tessellated,
        shapes=_shapes_of_pieces(receivers, fine, source),
    )
    return split_receivers, source


def cell_colours(scene: Scene, receivers: Receivers) -> Colours:
    """About the mean colours of each cell, enough to weigh its errors."""
    if not any(varies(scene, o) for o in receivers.objects):
        return constant_colours(scene, receivers.cells.surface)
    parts = [
        mean_colours(scene, o, m.parent, m.barycentric, points=1)
        for o, m in zip(receivers.objects, receivers.fine, strict=True)
    ]
    return Colours(np.concatenate([p.albedo for p in parts]), np.concatenate([p.emission for p in parts]))


def fit_vertices(
    triangles: Int32, normals: Float64, surface: Int32, places: Float64 | None = None, breaks: Bool | None = None
) -> tuple[Int32, int]:
    """Number (t, 3) of each corner's fit vertex, and how many there are.

    Corners at one vertex share a value when a chain of edges joins their triangles across which neither the surface
    (t,) nor the shading normals (t, 3, 3) at the edge's ends change: hard edges and material borders do not bleed.
    Nor may the corners' places (t, 3, k) change, or the edge be one of the breaks (t, 3), where these are given.
    """
    corner = np.arange(triangles.size).reshape(-1, 3)
    here, there = shared_edges(triangles)
    joined = surface[here[:, 0] // 3] == surface[there[:, 0] // 3]
    flat = normals.reshape(-1, 3)
    for end in range(2):
        joined &= np.einsum("ek,ek->e", flat[here[:, end]], flat[there[:, end]]) > _SAME_NORMAL
        if places is not None:
            placed = places.reshape(triangles.size, -1)
            joined &= np.abs(placed[here[:, end]] - placed[there[:, end]]).max(axis=1) < _SAME_PLACE
    if breaks is not None:
        joined &= ~breaks.ravel()[here[:, 0]]
    number = renumbered(_components(corner.size, here[joined].reshape(-1), there[joined].reshape(-1)))
    return number.reshape(-1, 3), int(number.max(initial=-1)) + 1


def shared_edges(triangles: Int32) -> tuple[np.ndarray, np.ndarray]:
    """Corner numbers (e, 2) of both ends of each edge that exactly two triangles share, in either triangle.

    Corner number 3 t + i is corner i of triangle t; row k of both arrays names the same two mesh vertices.
    """
    a = triangles.reshape(-1)
    key = edge_keys(triangles, int(triangles.max(initial=0)) + 1).reshape(-1)
    order = stable_order(key)
    ordered = key[order]
    start = np.flatnonzero(np.r_[True, ordered[1:] != ordered[:-1]])
    pairs = start[np.diff(np.r_[start, len(ordered)]) == 2]
    one, two = order[pairs], order[pairs + 1]

    def ends(edge: np.ndarray) -> np.ndarray:
        return np.column_stack([edge, next_corner(edge)])

    here, there = ends(one), ends(two)
    turned = a[one] != a[two]
    there[turned] = there[turned][:, ::-1]
    return here, there


def next_corner(corner: np.ndarray) -> np.ndarray:
    """The corner that follows in the same triangle, by numbers 3 t + i; of a side, where it ends."""
    return np.asarray(corner - corner % 3 + (corner + 1) % 3)


def numbered_edges(triangles: Int32) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The number (t, 3) of the edge from each corner to the next; of each edge the vertices (e, 2) at its ends, and the
    first side (e,) that lies on it, 3 t + i from corner i of triangle t on."""
    count = int(triangles.max(initial=0)) + 1
    keys, side, number = distinct(edge_keys(triangles, count).reshape(-1))
    return number.reshape(-1, 3), np.column_stack([keys // count, keys % count]), side


def _components(count: int, one: np.ndarray, two: np.ndarray) -> np.ndarray:
    """The smallest member (count,) of each item's connected component, by hooking and pointer jumping."""
    label = np.arange(count)
    while len(one):
        low, high = np.minimum(label[one], label[two]), np.maximum(label[one], label[two])
        np.minimum.at(label, high, low)
        while True:
            jumped = label[label]
            if np.array_equal(jumped, label):
                break
            label = jumped
        apart = label[one] != label[two]
        one, two = one[apart], two[apart]
    return label
