"""Which objects a render shows. Blender's viewport knows other switches, so its own answer is not enough.

Python gets the viewport's depsgraph only, and that leaves out what is hidden in the viewport. A ceiling that is hidden
so that one can look into the room still keeps the light in, so hidden objects are shown while the scene is read.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import bpy

from .copies import original_of


def rendered_objects(view_layer: bpy.types.ViewLayer) -> set[bpy.types.Object]:
    """Objects of a view layer that a render shows: not hidden from it themselves, nor through all their collections.

    Where a baked copy shows, or its original, it is the original that counts.
    """
    shown = {
        obj for layer in _rendered_layers(view_layer.layer_collection) for obj in _shown(layer) if not obj.hide_render
    }
    return {original_of(view_layer, obj) for obj in shown}


@contextmanager
def shown_as_rendered(view_layer: bpy.types.ViewLayer) -> Iterator[None]:
    """Within, all that a render shows is in the viewport's depsgraph too; afterwards every switch is as it was.

    Update the depsgraph after entering: `depsgraph.update()`.
    """
    layers = list(_rendered_layers(view_layer.layer_collection))
    objects = rendered_objects(view_layer)
    instanced = {obj.instance_collection for obj in objects if obj.instance_type == "COLLECTION"} - {None}
    collections = {layer.collection for layer in layers} | instanced
    collections |= {child for collection in instanced for child in collection.children_recursive}
    members = objects | {obj for collection in instanced for obj in collection.all_objects}

    closed_eyes = [obj for obj in objects if obj.hide_get(view_layer=view_layer)]
    hidden = [item for item in (*layers, *collections, *members) if item.hide_viewport]
    for item in hidden:
        item.hide_viewport = False
    for obj in closed_eyes:
        obj.hide_set(False, view_layer=view_layer)
    try:
        yield
    finally:
        for obj in closed_eyes:
            obj.hide_set(True, view_layer=view_layer)
        for item in hidden:
            item.hide_viewport = True


def _rendered_layers(layer: bpy.types.LayerCollection) -> Iterator[bpy.types.LayerCollection]:
    if layer.collection.hide_render:
        return
    yield layer
    for child in layer.children:
        yield from _rendered_layers(child)


def _shown(layer: bpy.types.LayerCollection) -> Iterator[bpy.types.Object]:
    """A layer's own objects; an excluded layer has none, though its children may."""
    if not layer.exclude:
        yield from layer.collection.objects
