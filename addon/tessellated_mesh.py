"""A Blender mesh out of a tessellated receiver, with all that its original carries: UVs, normals, materials, weights.

The shape is exactly the original's: old vertices keep their coordinates bit by bit, new ones lie on the old triangles.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ..core.result import BakedObject
from ..core.scene import Float64, Int32
from .scene_reader import ReceiverSource

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

#: What the new mesh's own structure and `_copy_seams` and `_copy_normals` take care of.
STRUCTURE = {"position", "custom_normal", "uv_seam"}

Values = NDArray[Any]


def build_mesh(
    original: bpy.types.Mesh,
    groups: Sequence[bpy.types.VertexGroup],
    source: ReceiverSource,
    baked: BakedObject,
    *,
    leave_out: Collection[str],
) -> bpy.types.Mesh:
    """A new mesh datablock of `baked`'s triangles, in the object's space.

    original: the mesh that has `source`'s corners, evaluated or not. groups: its object's vertex groups. leave_out:
    attributes not to copy. Faces are in the order of baked.triangles; their corners too, with the last two swapped
    where source.flipped.
    """
    split = _Split.of(original, source, baked)
    mesh = bpy.data.meshes.new(original.name)
    mesh.vertices.add(len(baked.vertices))
    mesh.vertices.foreach_set("co", split.coordinates(original).astype(np.float32).ravel())
    mesh.loops.add(split.triangles.size)
    mesh.loops.foreach_set("vertex_index", split.triangles.ravel())
    mesh.polygons.add(len(split.triangles))
    mesh.polygons.foreach_set("loop_start", np.arange(0, split.triangles.size, 3, dtype=np.int32))
    mesh.update(calc_edges=True)
    for material in original.materials:
        mesh.materials.append(material and material.original)
    edges = split.edges(original, mesh)
    _copy_attributes(original, mesh, split, edges, leave_out)
    _copy_seams(original, mesh, edges)
    _copy_normals(original, mesh, split)
    _copy_weights(original, mesh, groups, split)
    _copy_choices(original, mesh)
    return mesh


@dataclass(frozen=True, eq=False)
class _Split:
    """How the new triangles lie in the old ones, all in the object's own winding.

    triangles (t, 3) int32 into new vertices; corners (t, 3) int32, the old mesh corners around each; polygons (t,)
    int32, the old faces; weights (t, 3, 3) float64, [triangle, new corner, old corner]; kept: the count of old
    vertices, which come first; new_vertices (n,) int32, and the triangle and corner where each is placed.
    """

    triangles: Int32
    corners: Int32
    polygons: Int32
    weights: Float64
    kept: int
    new_vertices: Int32
    place: tuple[NDArray[np.intp], NDArray[np.intp]]

    @staticmethod
    def of(mesh: bpy.types.Mesh, source: ReceiverSource, baked: BakedObject) -> _Split:
        turn = [0, 2, 1] if source.flipped else [0, 1, 2]
        triangles = baked.triangles[:, turn]
        vertices, first = np.unique(triangles, return_index=True)
        is_new = vertices >= len(mesh.vertices)
        return _Split(
            triangles,
            corners=source.corners[baked.parent],
            polygons=source.polygons[baked.parent],
            weights=baked.barycentric[:, turn],
            kept=len(mesh.vertices),
            new_vertices=vertices[is_new],
            place=np.divmod(first[is_new], 3),
        )

    def coordinates(self, mesh: bpy.types.Mesh) -> Float64:
        old = _read(mesh.vertices, "co", 3, np.float32).astype(np.float64)
        return self.point(mesh, old, mix=True)

    def point(self, mesh: bpy.types.Mesh, old: Values, *, mix: bool) -> Values:
        """Values (v, w) of old vertices to values of all new mesh's vertices."""
        triangle, corner = self.place
        around = _read(mesh.loops, "vertex_index", 1, np.int32)[self.corners[triangle]][..., 0]
        values = np.zeros((self.kept + len(self.new_vertices), old.shape[1]), old.dtype)
        values[: self.kept] = old
        values[self.new_vertices] = _blend(self.weights[triangle, corner], old[around], mix=mix)
        return values

    def corner(self, old: Values, *, mix: bool) -> Values:
        """Values (old corners, w) to values (new corners, w)."""
        around = old[self.corners][:, None]
        return _blend(self.weights, np.broadcast_to(around, (len(around), 3, *around.shape[2:])), mix=mix).reshape(
            -1, old.shape[1]
        )

    def edges(self, mesh: bpy.types.Mesh, new_mesh: bpy.types.Mesh) -> Int32:
        """Old edge that each new edge lies on, (new edges,) int32; -1 inside an old face."""
        pairs = np.sort(_read(mesh.edges, "vertices", 2, np.int32).astype(np.int64), axis=1)
        keys = pairs[:, 0] * self.kept + pairs[:, 1]
        order = np.argsort(keys)
        around = _read(mesh.loops, "vertex_index", 1, np.int32)[self.corners][..., 0].astype(np.int64)

        edge_of_side = np.full((len(self.triangles), 3), -1, np.int32)
        outside = self.weights == 0.0
        for opposite in range(3):
            ends = np.sort(np.delete(around, opposite, axis=1), axis=1)
            wanted = ends[:, 0] * self.kept + ends[:, 1]
            found = order[np.minimum(np.searchsorted(keys, wanted, sorter=order), len(keys) - 1)]
            old_edge = np.where(keys[found] == wanted, found, -1)
            on_side = outside[:, :, opposite] & np.roll(outside[:, :, opposite], -1, axis=1)
            edge_of_side = np.where(on_side, old_edge[:, None], edge_of_side)

        edges = np.full(len(new_mesh.edges), -1, np.int32)
        edges[_read(new_mesh.loops, "edge_index", 1, np.int32)[:, 0]] = edge_of_side.ravel()
        return edges


def _blend(weights: Float64, values: Values, *, mix: bool) -> Values:
    """Weighted mean over the old corners, (..., 3) and (..., 3, w) to (..., w); without mixing, the nearest one's."""
    if mix:
        return np.einsum("...k,...kw->...w", weights, values)
    nearest = weights.argmax(axis=-1)[..., None, None]
    return np.take_along_axis(values, nearest, axis=-2)[..., 0, :]


def _copy_attributes(
    old: bpy.types.Mesh, new: bpy.types.Mesh, split: _Split, edges: Int32, leave_out: Collection[str]
) -> None:
    on_edge = edges >= 0
    convert: dict[str, Callable[[Values, bool], Values]] = {
        "POINT": lambda values, mix: split.point(old, values, mix=mix),
        "CORNER": lambda values, mix: split.corner(values, mix=mix),
        "FACE": lambda values, _: values[split.polygons],
        "EDGE": lambda values, _: np.where(on_edge[:, None], values[edges], np.zeros(1, values.dtype)),
    }
    for attribute in old.attributes:
        name = attribute.name
        value = VALUE_OF_TYPE.get(attribute.data_type)
        # A name with a leading dot is Blender's own bookkeeping: connectivity, selection, hiding.
        if value is None or name in STRUCTURE or name in leave_out or name.startswith("."):
            continue
        prop, width, dtype, mix = value
        values = convert[attribute.domain](_read(attribute.data, prop, width, dtype), mix)
        target = new.attributes.new(name, attribute.data_type, attribute.domain)
        target.data.foreach_set(prop, np.ascontiguousarray(values, dtype).ravel())


def _copy_seams(old: bpy.types.Mesh, new: bpy.types.Mesh, edges: Int32) -> None:
    seams = _read(old.edges, "use_seam", 1, np.bool_)[:, 0]
    if seams.any():
        new.edges.foreach_set("use_seam", seams[edges] & (edges >= 0))


def _copy_normals(old: bpy.types.Mesh, new: bpy.types.Mesh, split: _Split) -> None:
    """New vertices lie on flat triangles, so smooth shading needs the old normals, interpolated, to look as before."""
    if old.normals_domain == "FACE":
        return
    normals = split.corner(_read(old.corner_normals, "vector", 3, np.float32).astype(np.float64), mix=True)
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    new.normals_split_custom_set(np.divide(normals, length, out=normals, where=length > 0.0).astype(np.float32))


def _copy_weights(
    old: bpy.types.Mesh, new: bpy.types.Mesh, groups: Sequence[bpy.types.VertexGroup], split: _Split
) -> None:
    """Vertex groups live in the mesh, but only an object can write them: a passing one does."""
    if not groups:
        return
    of_old = np.zeros((len(old.vertices), len(groups)))
    for index, vertex in enumerate(old.vertices):
        for member in vertex.groups:
            of_old[index, member.group] = member.weight
    weights = split.point(old, of_old, mix=True)
    writer = bpy.data.objects.new(new.name, new)
    try:
        for group, of_group in zip(groups, weights.T, strict=True):
            target = writer.vertex_groups.new(name=group.name)
            target.lock_weight = group.lock_weight
            for weight in np.unique(of_group[of_group > 0.0]):
                target.add(np.flatnonzero(of_group == weight).tolist(), float(weight), "REPLACE")
    finally:
        bpy.data.objects.remove(writer)


def _copy_choices(old: bpy.types.Mesh, new: bpy.types.Mesh) -> None:
    """Which UV map is active, and the mesh's custom properties."""
    if old.uv_layers.active is not None:
        new.uv_layers.active_index = new.uv_layers.find(old.uv_layers.active.name)
    for layer in old.uv_layers:
        if layer.active_render:
            new.uv_layers[layer.name].active_render = True
    for key, value in old.items():
        new[key] = value.to_dict() if hasattr(value, "to_dict") else value


def _read(collection: bpy.types.bpy_prop_collection, name: str, width: int, dtype: type) -> Values:
    values = np.empty(len(collection) * width, dtype)
    collection.foreach_get(name, values)
    return values.reshape(-1, width)
