"""A scene of its own in which Cycles tells what only it can read; it is gone afterwards, whatever happens."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import bpy
import numpy as np

from ..core.scene import Float32

#: The corner colours that are baked to.
TARGET = "Radiosity Sample"


@contextmanager
def cycles_studio() -> Iterator[bpy.types.Scene]:
    """An empty scene for Cycles to bake in. Raises RuntimeError without Cycles."""
    studio = bpy.data.scenes.new(TARGET)
    try:
        try:
            studio.render.engine = "CYCLES"
        except TypeError as problem:
            raise RuntimeError("the add-on Cycles Render Engine is disabled") from problem
        studio.cycles.samples, studio.cycles.device = 1, "CPU"
        studio.cycles.use_denoising = studio.cycles.use_adaptive_sampling = False
        yield studio
    finally:
        bpy.data.scenes.remove(studio)


@contextmanager
def posed(studio: bpy.types.Scene, obj: bpy.types.Object) -> Iterator[bpy.types.Object]:
    """The object in the studio, ready to be baked to; it and its mesh are removed in the end."""
    mesh = obj.data
    try:
        mesh.color_attributes.new(TARGET, "FLOAT_COLOR", "CORNER")
        mesh.color_attributes.active_color_name = TARGET
        studio.collection.objects.link(obj)
        layer = studio.view_layers[0]
        layer.update()
        layer.objects.active = obj
        obj.select_set(True, view_layer=layer)
        yield obj
    finally:
        bpy.data.objects.remove(obj)
        bpy.data.meshes.remove(mesh)


def bake_corners(studio: bpy.types.Scene, obj: bpy.types.Object, kind: str, *passes: str) -> Float32:
    """(corners, 3) of one of Blender's bakes, as far as it is a number and not negative. Raises RuntimeError."""
    chosen = {"active_object": obj, "object": obj, "selected_objects": [obj], "selected_editable_objects": [obj]}
    with bpy.context.temp_override(scene=studio, view_layer=studio.view_layers[0], **chosen):
        bpy.ops.object.bake(type=kind, pass_filter=set(passes), target="VERTEX_COLORS", use_selected_to_active=False)
    data = obj.data.color_attributes[TARGET].data
    values = np.empty(len(data) * 4, np.float32)
    data.foreach_get("color", values)
    return np.maximum(np.nan_to_num(values.reshape(-1, 4)[:, :3], nan=0.0, posinf=0.0), 0.0)
