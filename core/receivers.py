"""The receivers: their output triangles, the cells light is sampled on, and the vertices light is fitted to."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .patches import Cells, Space, shading_normals, triangle_geometry
from .scene import Bool, Float64, Int32, Scene, SceneObject
from .settings import Settings
from .tessellation import Int64, Tessellation, edge_for_count, split_triangles, triform, whole

#: Corners whose shading normals differ by less than this angle (cosine) share one value.
_SAME_NORMAL = np.cos(np.radians(5.0))


@dataclass(frozen=True, eq=False)
class Receivers:
    """The output meshes of the receivers, and the cells on all of them: the triangles of the fine meshes, which are the
    output meshes unless the input's own triangles are kept.

    first (r + 1,): where each receiver's output triangles begin. element_corners (e, 3, 3) of the output triangles in
    the unit box, element_surface (e,) into Scene.surfaces, corner_vertex (e, 3) the fit vertex of each of their
    corners; vertices: how many fit vertices there are.
    """

    space: Space
    objects: tuple[SceneObject, ...]
    meshes: tuple[Tessellation, ...]
    fine: tuple[Tessellation, ...]
    cells: Cells
    first: Int32
    element_corners: Float64
    element_surface: Int32
    corner_vertex: Int32
    vertices: int


def make_receivers(scene: Scene, space: Space, settings: Settings, triangles: int) -> Receivers:
    """Tessellate the receivers to edges of the asked size, or so that about `triangles` of one size would cover them.

    Where the mesh is to be kept, the output has the input's triangles, and only the sampling is as fine as that.
    """
    objects = scene.receivers()
    edge = settings.size or edge_for_count([o.vertices for o in objects], [o.triangles for o in objects], triangles)
    fine = [triform(whole(o.vertices, o.triangles), edge) for o in objects]
    return lay_out(objects, fine, space, tessellate=settings.tessellate)


def lay_out(objects: tuple[SceneObject, ...], fine: list[Tessellation], space: Space, *, tessellate: bool) -> Receivers:
    """Cells on the triangles of the fine meshes, which become the output as well if `tessellate`."""
    meshes = fine if tessellate else [whole(o.vertices, o.triangles) for o in objects]
    first = np.concatenate([[0], np.cumsum([len(m.triangles) for m in meshes])]).astype(np.int32)

    corners, normals, area, shading, element, barycentric, surface = [], [], [], [], [], [], []
    for number, (receiver, mesh) in enumerate(zip(objects, fine, strict=True)):
        corners.append(space.normalise(mesh.vertices[mesh.triangles]))
        n, a = triangle_geometry(corners[-1])
        normals.append(n)
        area.append(a)
        shading.append(shading_normals(receiver, mesh.parent, mesh.barycentric, n))
        inside = np.arange(len(a)) if tessellate else mesh.parent
        element.append(first[number] + inside)
        weights = np.broadcast_to(np.eye(3), mesh.barycentric.shape) if tessellate else mesh.barycentric
        barycentric.append(weights)
        surface.append(receiver.surface[mesh.parent])
    flat = all(o.corner_normals is None for o in objects)
    cells = Cells(
        corners=np.concatenate(corners),
        normals=np.concatenate(normals),
        area=np.concatenate(area),
        shading=None if flat else np.concatenate(shading),
        element=np.concatenate(element).astype(np.int32),
        barycentric=np.concatenate(barycentric),
        surface=np.concatenate(surface).astype(np.int32),
    )
    element_corners = [space.normalise(m.vertices[m.triangles]) for m in meshes]
    corner_vertex, count = [], 0
    for receiver, mesh, own in zip(objects, meshes, element_corners, strict=True):
        normal = shading_normals(receiver, mesh.parent, mesh.barycentric, triangle_geometry(own)[0])
        vertex, used = fit_vertices(mesh.triangles, normal, receiver.surface[mesh.parent])
        corner_vertex.append(vertex + count)
        count += used
    return Receivers(
        space=space,
        objects=objects,
        meshes=tuple(meshes),
        fine=tuple(fine),
        cells=cells,
        first=first,
        element_corners=np.concatenate(element_corners),
        element_surface=np.concatenate([o.surface[m.parent] for o, m in zip(objects, meshes, strict=True)]),
        corner_vertex=np.concatenate(corner_vertex).astype(np.int32),
        vertices=count,
    )


def split_cells(receivers: Receivers, chosen: Bool) -> tuple[Receivers, Int64]:
    """The receivers with the chosen (c,) cells split into four; and for each new cell the one it came from."""
    fine, sources, begin = [], [], 0
    for mesh in receivers.fine:
        end = begin + len(mesh.triangles)
        split, source = split_triangles(mesh, chosen[begin:end])
        fine.append(split)
        sources.append(source + begin)
        begin = end
    tessellate = receivers.meshes == receivers.fine
    return lay_out(receivers.objects, fine, receivers.space, tessellate=tessellate), np.concatenate(sources)


def fit_vertices(triangles: Int32, normals: Float64, surface: Int32) -> tuple[Int32, int]:
    """Number (t, 3) of each corner's fit vertex, and how many there are.

    Corners at one vertex share a value when a chain of edges joins their triangles across which neither the surface
    (t,) nor the shading normals (t, 3, 3) at the edge's ends change: hard edges and material borders do not bleed.
    """
    corner = np.arange(triangles.size).reshape(-1, 3)
    here, there = shared_edges(triangles)
    joined = surface[here[:, 0] // 3] == surface[there[:, 0] // 3]
    flat = normals.reshape(-1, 3)
    for end in range(2):
        joined &= np.einsum("ek,ek->e", flat[here[:, end]], flat[there[:, end]]) > _SAME_NORMAL
    label = _components(corner.size, here[joined].reshape(-1), there[joined].reshape(-1))
    unique, number = np.unique(label, return_inverse=True)
    return number.reshape(-1, 3).astype(np.int32), len(unique)


def shared_edges(triangles: Int32) -> tuple[np.ndarray, np.ndarray]:
    """Corner numbers (e, 2) of both ends of each edge that exactly two triangles share, in either triangle.

    Corner number 3 t + i is corner i of triangle t; row k of both arrays names the same two mesh vertices.
    """
    a, b = triangles.reshape(-1).astype(np.int64), triangles[:, [1, 2, 0]].reshape(-1).astype(np.int64)
    key = np.minimum(a, b) * (int(triangles.max(initial=0)) + 1) + np.maximum(a, b)
    order = np.argsort(key, kind="stable")
    ordered = key[order]
    start = np.flatnonzero(np.r_[True, ordered[1:] != ordered[:-1]])
    pairs = start[np.diff(np.r_[start, len(ordered)]) == 2]
    one, two = order[pairs], order[pairs + 1]

    def ends(edge: np.ndarray) -> np.ndarray:
        return np.column_stack([edge, edge - edge % 3 + (edge + 1) % 3])

    here, there = ends(one), ends(two)
    turned = a[one] != a[two]
    there[turned] = there[turned][:, ::-1]
    return here, there


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
