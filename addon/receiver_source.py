"""Where the triangles that are baked come from in Blender's meshes."""

from __future__ import annotations

from dataclasses import dataclass

from ..core.scene import Int32


@dataclass(frozen=True, eq=False)
class ReceiverSource:
    """Where a receiver's triangles come from, without holding on to Blender's data.

    name: of the object and of its SceneObject. session_uid: Blender's number for it, which survives renaming and undo.
    corners (t, 3) int32: the mesh corner (loop) of each corner of SceneObject.triangles. polygons (t,) int32: the face
    each came from. flipped: corners were put in reverse order, since a negative scale mirrors the object.
    corner_count and vertex_count tell whether the mesh was edited meanwhile.
    """

    name: str
    session_uid: int
    corners: Int32
    polygons: Int32
    flipped: bool
    corner_count: int
    vertex_count: int
