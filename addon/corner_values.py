"""What a mesh's corners carry for its materials: places in textures, and colours."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import bpy
import numpy as np

from ..core.scene import Float32, Int32, Surface
from .materials import MaterialSurface, Placement


def corner_uv(mesh: bpy.types.Mesh, corners: Int32, surface: Int32, surfaces: Sequence[Surface]) -> Float32 | None:
    """(t, 3, 2) place of each triangle's corners (t, 3) in the textures of its surface (t,); None without textures.

    As in Cycles, everything is at (0, 0) on a UV map that the mesh lacks.
    """

    def read(own: MaterialSurface) -> Callable[[Int32], Float32] | None:
        return None if own.placement is None else lambda some: _placed(mesh, some, own.placement)

    return _filled(np.zeros((*corners.shape, 2), np.float32), corners, surface, surfaces, read)


def corner_colors(mesh: bpy.types.Mesh, corners: Int32, surface: Int32, surfaces: Sequence[Surface]) -> Float32 | None:
    """(t, 3, 3) what multiplies the albedo of each triangle's corners; None where no surface takes a colour attribute.

    As in Cycles, an attribute that the mesh lacks is black.
    """

    def read(own: MaterialSurface) -> Callable[[Int32], Float32] | None:
        return None if own.color_attribute is None else lambda some: colors_of(mesh, some, own.color_attribute)

    return _filled(np.ones((*corners.shape, 3), np.float32), corners, surface, surfaces, read)


def _filled(
    values: Float32,
    corners: Int32,
    surface: Int32,
    surfaces: Sequence[Surface],
    read: Callable[[MaterialSurface], Callable[[Int32], Float32] | None],
) -> Float32 | None:
    """Values with those of the surfaces that read something put in; None when none does."""
    found = False
    for number in np.unique(surface):
        own = surfaces[number]
        take = read(own) if isinstance(own, MaterialSurface) else None
        if take is not None:
            values[surface == number] = take(corners[surface == number])
            found = True
    return values if found else None


def uv_of(mesh: bpy.types.Mesh, corners: Int32, name: str) -> Float32:
    """(t, 3, 2) coordinates of corners (t, 3) on the UV map of a name; empty: on the active one for rendering."""
    layer = mesh.uv_layers.get(name) if name else _rendered(mesh.uv_layers)
    uv = np.zeros((len(mesh.loops), 2), np.float32)
    if layer is not None:
        layer.uv.foreach_get("vector", uv.ravel())
    return uv[corners]


def _placed(mesh: bpy.types.Mesh, corners: Int32, placement: Placement) -> Float32:
    matrix = np.array(placement.matrix, np.float32)
    moved = uv_of(mesh, corners, placement.uv_map) @ matrix[:, :2].T + matrix[:, 2]
    return np.asarray(moved, np.float32)


def _rendered(layers: bpy.types.bpy_prop_collection) -> bpy.types.MeshUVLoopLayer | None:
    return next((layer for layer in layers if layer.active_render), None)


def colors_of(mesh: bpy.types.Mesh, corners: Int32, name: str) -> Float32:
    """(t, 3, 3) colours of corners (t, 3) in the attribute of a name; empty: in the active one for rendering."""
    attributes = mesh.color_attributes
    index = attributes.find(name) if name else attributes.render_color_index
    if index < 0:
        return np.zeros((*corners.shape, 3), np.float32)
    attribute = attributes[index]
    values = np.empty((len(attribute.data), 4), np.float32)
    attribute.data.foreach_get("color", values.ravel())
    at = corners
    if attribute.domain == "POINT":
        at = np.empty(len(mesh.loops), np.int32)
        mesh.attributes[".corner_vert"].data.foreach_get("value", at)
        at = at[corners]
    return np.maximum(values[at][..., :3], 0.0)
