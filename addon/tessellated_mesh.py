"""A Blender mesh out of a tessellated receiver, with all that its original carries: UVs, normals, materials, weights.

The shape is exactly the original's: old vertices keep their coordinates bit by bit, new ones lie on the old triangles.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ..core.result import BakedObject
from ..core.scene import Float64, Int32
from . import compat
from .receiver_source import ReceiverSource
from .slices import Steps, breathe

#: Type of an attribute to the property that holds a value, its numbers, their type, and whether values may be mixed.
VALUE_OF_TYPE: dict[str, tuple[str, int, type, bool]] = {
    "FLOAT": ("value", 1, np.float32, True),
    "FLOAT2": ("vector", 2, np.float32, True),
    "FLOAT_VECTOR": ("vector", 3, np.float32, True),
    "FLOAT_COLOR": ("color", 4, np.float32, True),
    "BYTE_COLOR": ("color", 4, np.float32, True),
    "INT": ("value", 1, np.int32, False),
    "INT8": ("value", 1, np.int32, False),
    "INT32_2D": ("value", 2, np.int32, False),
    "BOOLEAN": ("value", 1, np.bool_, False),
    "QUATERNION": ("value", 4, np.float32, False),
    "FLOAT4X4": ("value", 16, np.float32, False),
}

#: What the new mesh's own structure and `_set_normals` take care of.
STRUCTURE = {"position", "custom_normal"}
#: Of the names with a leading dot, which are Blender's own bookkeeping, the ones that are worth keeping.
KEPT_BOOKKEEPING = {".uv_seam"}
#: Vertices of a group whose weights are written in one go.
_WEIGHTS_AT_ONCE = 2_000

Values = NDArray[Any]


@dataclass(frozen=True, eq=False)
class Attribute:
    """values (n, w) by domain and type, as Blender names them."""

    name: str
    data_type: str
    domain: str
    values: Values


@dataclass(frozen=True, eq=False)
class MeshData:
    """All that a mesh carries, as arrays, so that nothing of Blender's is held on to while it is worked with.

    positions (v, 3) float32; corner_vertex (l,) int32; edges (e, 2) int32; corner_normals (l, 3) float32, or None where
    every face is flat; weights (v, groups) float64; groups: name and whether locked.
    """

    name: str
    positions: Values
    corner_vertex: Values
    edges: Values
    attributes: list[Attribute]
    corner_normals: Values | None
    materials: list[bpy.types.Material | None]
    weights: Float64
    groups: list[tuple[str, bool]]
    active_uv: str
    render_uv: str
    custom: dict[str, Any]

    @staticmethod
    def read(mesh: bpy.types.Mesh, groups: Sequence[bpy.types.VertexGroup], leave_out: Collection[str]) -> MeshData:
        """Of a mesh, evaluated or not. groups: its object's vertex groups. leave_out: attributes not to read."""
        flat = mesh.normals_domain == "FACE"
        active = mesh.uv_layers.active
        return MeshData(
            name=mesh.name,
            positions=_column(mesh, "position", "vector", 3, np.float32),
            corner_vertex=_column(mesh, ".corner_vert", "value", 1, np.int32)[:, 0],
            edges=_column(mesh, ".edge_verts", "value", 2, np.int32),
            attributes=[
                Attribute(a.name, a.data_type, a.domain, _read(a.data, *VALUE_OF_TYPE[a.data_type][:3]))
                for a in mesh.attributes
                if _is_copied(a) and a.name not in leave_out
            ],
            corner_normals=None if flat else _read(mesh.corner_normals, "vector", 3, np.float32),
            materials=[material and material.original for material in mesh.materials],
            weights=_weights(mesh, len(groups)),
            groups=[(group.name, group.lock_weight) for group in groups],
            active_uv="" if active is None else active.name,
            render_uv=next((layer.name for layer in mesh.uv_layers if layer.active_render), ""),
            custom={key: value.to_dict() if hasattr(value, "to_dict") else value for key, value in mesh.items()},
        )


def build_mesh(original: MeshData, source: ReceiverSource, baked: BakedObject) -> Steps[bpy.types.Mesh]:
    """Steps to a new mesh datablock of `baked`'s triangles, in the object's space; stopped early, there is none.

    original: of the mesh that has `source`'s corners. Faces are in the order of baked.triangles; their corners too,
    with the last two swapped where source.flipped.
    """
    split = yield lambda: _Split.of(original, source, baked)
    positions = yield lambda: split.point(original.positions.astype(np.float64), mix=True).astype(np.float32).ravel()
    edges, corner_edge, old_edge = yield split.edges
    mesh = bpy.data.meshes.new(original.name)
    try:
        _set_structure(mesh, split, positions, edges, corner_edge)
        yield breathe
        # The whole mesh at once: one that has corners but no faces must not be seen by anyone.
        mesh.polygons.add(len(split.triangles))
        mesh.polygons.foreach_set("loop_start", np.arange(0, split.triangles.size, 3, dtype=np.int32))
        mesh.update()
        yield breathe
        for material in original.materials:
            mesh.materials.append(material)
        for attribute in original.attributes:
            values = yield lambda a=attribute: split.convert(a, old_edge)
            target = mesh.attributes.new(attribute.name, attribute.data_type, attribute.domain)
            target.data.foreach_set(VALUE_OF_TYPE[attribute.data_type][0], values)
        if original.corner_normals is not None:
            normals = yield lambda: split.normals(original.corner_normals)
            compat.set_corner_normals(mesh, normals)
            yield breathe
        if original.groups:
            weights = yield lambda: split.point(original.weights, mix=True)
            yield from _set_weights(mesh, original.groups, weights)
        _set_choices(mesh, original)
    except BaseException:
        bpy.data.meshes.remove(mesh)
        raise
    return mesh


@dataclass(frozen=True, eq=False)
class _Split:
    """How the new triangles lie in the old ones, all in the object's own winding.

    triangles (t, 3) int32 into new vertices; corners (t, 3) int32, the old mesh corners around each; around (t, 3)
    int32, the old vertices; polygons (t,) int32, the old faces; weights (t, 3, 3) float64, [triangle, new corner, old
    corner]; kept: the count of old vertices, which come first; new_vertices (n,) int32, and the triangle and corner
    where each is placed; old_edges (e, 2) int32.
    """

    triangles: Int32
    corners: Int32
    around: Int32
    polygons: Int32
    weights: Float64
    kept: int
    new_vertices: Int32
    place: tuple[NDArray[np.intp], NDArray[np.intp]]
    old_edges: Int32

    @staticmethod
    def of(mesh: MeshData, source: ReceiverSource, baked: BakedObject) -> _Split:
        turn = [0, 2, 1] if source.flipped else [0, 1, 2]
        triangles = np.ascontiguousarray(baked.triangles[:, turn])
        vertices, first = np.unique(triangles, return_index=True)
        is_new = vertices >= len(mesh.positions)
        corners = source.corners[baked.parent]
        return _Split(
            triangles,
            corners=corners,
            around=mesh.corner_vertex[corners],
            polygons=source.polygons[baked.parent],
            weights=baked.barycentric[:, turn],
            kept=len(mesh.positions),
            new_vertices=vertices[is_new],
            place=np.divmod(first[is_new], 3),
            old_edges=mesh.edges,
        )

    def convert(self, attribute: Attribute, old_edge: Int32) -> Values:
        """An old attribute's values on the new mesh, flat, in the type that Blender takes."""
        _, _, dtype, mix = VALUE_OF_TYPE[attribute.data_type]
        old = attribute.values
        if attribute.domain == "POINT":
            new = self.point(old, mix=mix)
        elif attribute.domain == "CORNER":
            new = self.corner(old, mix=mix)
        elif attribute.domain == "FACE":
            new = old[self.polygons]
        else:
            new = np.where((old_edge >= 0)[:, None], old[old_edge], np.zeros(1, old.dtype))
        return np.ascontiguousarray(new, dtype).ravel()

    def point(self, old: Values, *, mix: bool) -> Values:
        """Values (v, w) of old vertices to values of all new mesh's vertices."""
        triangle, corner = self.place
        values = np.zeros((self.kept + len(self.new_vertices), old.shape[1]), old.dtype)
        values[: self.kept] = old
        values[self.new_vertices] = _blend(self.weights[triangle, corner], old[self.around[triangle]], mix=mix)
        return values

    def corner(self, old: Values, *, mix: bool) -> Values:
        """Values (old corners, w) to values (new corners, w)."""
        around = old[self.corners][:, None]
        return _blend(self.weights, np.broadcast_to(around, (len(around), 3, *around.shape[2:])), mix=mix).reshape(
            -1, old.shape[1]
        )

    def normals(self, old: Values) -> Values:
        """Unit normals (new corners, 3) from those of the old corners."""
        normals = self.corner(old.astype(np.float64), mix=True)
        length = np.linalg.norm(normals, axis=1, keepdims=True)
        return np.divide(normals, length, out=normals, where=length > 0.0).astype(np.float32)

    def edges(self) -> tuple[Int32, Int32, Int32]:
        """The new mesh's edges (e, 2); the edge (new corners,) that leaves each corner; and the old edge (e,) on which
        each new one lies, -1 inside an old face."""
        ends = np.stack([self.triangles, self.triangles[:, [1, 2, 0]]], axis=2).reshape(-1, 2).astype(np.int64)
        ends.sort(axis=1)
        count = self.kept + len(self.new_vertices)
        unique, first, number = np.unique(ends[:, 0] * count + ends[:, 1], return_index=True, return_inverse=True)
        loose = self._loose_edges()
        edges = np.concatenate([np.stack(np.divmod(unique, count), axis=1), self.old_edges[loose]]).astype(np.int32)
        old = np.concatenate([self._old_edge_of_side().ravel()[first], loose]).astype(np.int32)
        return edges, number.reshape(-1).astype(np.int32), old

    def _loose_edges(self) -> NDArray[np.intp]:
        """Old edges that no face has."""
        sides = np.sort(np.stack([self.around, np.roll(self.around, -1, axis=1)], axis=2).reshape(-1, 2), axis=1)
        old = np.sort(self.old_edges.astype(np.int64), axis=1)
        bordered = np.isin(old[:, 0] * self.kept + old[:, 1], sides[:, 0].astype(np.int64) * self.kept + sides[:, 1])
        return np.flatnonzero(~bordered)

    def _old_edge_of_side(self) -> Int32:
        """(t, 3): the old edge that the side from each corner to the next lies on, or -1."""
        pairs = np.sort(self.old_edges.astype(np.int64), axis=1)
        keys = pairs[:, 0] * self.kept + pairs[:, 1]
        order = np.argsort(keys)
        of_side = np.full((len(self.triangles), 3), -1, np.int32)
        outside = self.weights == 0.0
        for opposite in range(3):
            ends = np.sort(np.delete(self.around, opposite, axis=1).astype(np.int64), axis=1)
            wanted = ends[:, 0] * self.kept + ends[:, 1]
            found = order[np.minimum(np.searchsorted(keys, wanted, sorter=order), len(keys) - 1)]
            old_edge = np.where(keys[found] == wanted, found, -1)
            on_side = outside[:, :, opposite] & np.roll(outside[:, :, opposite], -1, axis=1)
            of_side = np.where(on_side, old_edge[:, None], of_side)
        return of_side


def _blend(weights: Float64, values: Values, *, mix: bool) -> Values:
    """Weighted mean over the old corners, (..., 3) and (..., 3, w) to (..., w); without mixing, the nearest one's."""
    if mix:
        return np.einsum("...k,...kw->...w", weights, values)
    nearest = weights.argmax(axis=-1)[..., None, None]
    return np.take_along_axis(values, nearest, axis=-2)[..., 0, :]


def _set_structure(mesh: bpy.types.Mesh, split: _Split, positions: Values, edges: Int32, corner_edge: Int32) -> None:
    """Vertices, edges and corners. As attributes, which Blender copies as they are: a hundred times as fast."""
    mesh.vertices.add(len(positions) // 3)
    mesh.attributes["position"].data.foreach_set("vector", positions)
    mesh.edges.add(len(edges))
    mesh.attributes[".edge_verts"].data.foreach_set("value", edges.ravel())
    mesh.loops.add(split.triangles.size)
    mesh.attributes[".corner_vert"].data.foreach_set("value", split.triangles.ravel())
    mesh.attributes[".corner_edge"].data.foreach_set("value", corner_edge)


def _set_weights(mesh: bpy.types.Mesh, groups: list[tuple[str, bool]], weights: Float64) -> Steps[None]:
    """Vertex groups live in the mesh, but only an object can write them: a passing one does."""
    writer = bpy.data.objects.new(mesh.name, mesh)
    try:
        for (name, locked), of_group in zip(groups, weights.T, strict=True):
            target = writer.vertex_groups.new(name=name)
            target.lock_weight = locked
            for number, weight in enumerate(np.unique(of_group[of_group > 0.0])):
                target.add(np.flatnonzero(of_group == weight).tolist(), float(weight), "REPLACE")
                if number % _WEIGHTS_AT_ONCE == 0:
                    yield breathe
    finally:
        bpy.data.objects.remove(writer)


def _set_choices(mesh: bpy.types.Mesh, original: MeshData) -> None:
    """Which UV map is active, and the mesh's custom properties."""
    if original.active_uv in mesh.uv_layers:
        mesh.uv_layers.active_index = mesh.uv_layers.find(original.active_uv)
    if original.render_uv in mesh.uv_layers:
        mesh.uv_layers[original.render_uv].active_render = True
    for key, value in original.custom.items():
        mesh[key] = value


def _is_copied(attribute: bpy.types.Attribute) -> bool:
    name = attribute.name
    if attribute.data_type not in VALUE_OF_TYPE or name in STRUCTURE:
        return False
    return not name.startswith(".") or name in KEPT_BOOKKEEPING


def _weights(mesh: bpy.types.Mesh, groups: int) -> Float64:
    weights = np.zeros((len(mesh.vertices), groups))
    if groups:
        for index, vertex in enumerate(mesh.vertices):
            for member in vertex.groups:
                weights[index, member.group] = member.weight
    return weights


def _column(mesh: bpy.types.Mesh, name: str, prop: str, width: int, dtype: type) -> Values:
    """One of Blender's own attributes; an empty mesh has none."""
    attribute = mesh.attributes.get(name)
    return np.zeros((0, width), dtype) if attribute is None else _read(attribute.data, prop, width, dtype)


def _read(collection: bpy.types.bpy_prop_collection, name: str, width: int, dtype: type) -> Values:
    values = np.empty(len(collection) * width, dtype)
    collection.foreach_get(name, values)
    return values.reshape(-1, width)
