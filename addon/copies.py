"""Baked copies (result `new`), and how each stands in for the object it was made from.

An original and its copy lie in the same place, so only one of them may be seen. The copy is, until it is removed; but
it is a result and no more: what is baked is always the original, where the person has put either of the two.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import bpy
import numpy as np
from bpy.app.handlers import persistent

from ..core.scene import Float64

#: Custom properties of a copy: the object it was made from; where it was put; whether the original was hidden before.
ORIGINAL_KEY = "radiosity_baker_original"
PLACE_KEY = "radiosity_baker_place"
HIDDEN_KEY = "radiosity_baker_hidden"
COPIES_COLLECTION = "Radiosity Bake"


def copies_of(view_layer: bpy.types.ViewLayer) -> dict[bpy.types.Object, bpy.types.Object]:
    """The copy of each original, where both are in the view layer."""
    there = set(view_layer.objects)
    pairs = ((obj.get(ORIGINAL_KEY), obj) for obj in there)
    return {original: copy for original, copy in pairs if original in there}


def original_of(view_layer: bpy.types.ViewLayer, obj: bpy.types.Object) -> bpy.types.Object:
    """What a copy was made from; the object itself where it is no copy, or has outlived its original."""
    original = obj.get(ORIGINAL_KEY)
    return original if original is not None and view_layer.objects.get(original.name) == original else obj


def moved(copy: bpy.types.Object) -> bool:
    """Did someone move the copy since it was put in its place?"""
    place = copy.get(PLACE_KEY)
    return place is not None and not np.allclose(np.ravel(place), np.ravel(copy.matrix_world), rtol=1e-5, atol=1e-6)


def place_of(original: bpy.types.Object, copy: bpy.types.Object | None) -> Float64:
    """World matrix (4, 4) of an original: where it is, or where its copy was moved to."""
    return np.array((copy if copy is not None and moved(copy) else original).matrix_world, np.float64)


def put_copies(
    view_layer: bpy.types.ViewLayer, objects: Sequence[bpy.types.Object], meshes: Sequence[bpy.types.Mesh]
) -> list[bpy.types.Object]:
    """Give each object a copy with its mesh, or its copy a new one; one that has outlived its original is its own."""
    copies, written, pairs = copies_of(view_layer), [], []
    for obj, mesh in zip(objects, meshes, strict=True):
        if ORIGINAL_KEY in obj:
            replace_mesh(obj, mesh)
            written.append(obj)
            continue
        copy = copies.get(obj)
        if copy is None:
            copy = _new_copy(view_layer, obj, mesh)
        else:
            _meet(obj, copy)
            replace_mesh(copy, mesh)
        pairs.append((obj, copy))
        written.append(copy)
    _show_instead(view_layer, pairs)
    for _, copy in pairs:
        copy[PLACE_KEY] = np.ravel(copy.matrix_world).tolist()
    return written


def replace_mesh(obj: bpy.types.Object, mesh: bpy.types.Mesh) -> None:
    """Another mesh for an object; the old one goes unless it has other users."""
    old = obj.data
    name = old.name
    obj.data = mesh
    if old.users == 0:
        bpy.data.meshes.remove(old)
        mesh.name = name


def remove_copies(view_layer: bpy.types.ViewLayer, originals: Iterable[bpy.types.Object]) -> int:
    """Take the copies of these objects away and show the objects again as they were; how many there were."""
    copies = copies_of(view_layer)
    pairs = [(original, copies[original]) for original in originals if original in copies]
    active = view_layer.objects.active
    for original, copy in pairs:
        _meet(original, copy)
        closed_eye, not_rendered = copy.get(HIDDEN_KEY, (False, False))
        selected, was_active, mesh = copy.select_get(view_layer=view_layer), copy == active, copy.data
        bpy.data.objects.remove(copy)
        if mesh.users == 0:
            bpy.data.meshes.remove(mesh)
        original.hide_render = not_rendered
        original.hide_set(closed_eye, view_layer=view_layer)
        if selected and not closed_eye:
            original.select_set(True, view_layer=view_layer)
        if was_active:
            view_layer.objects.active = original
    for collection in [c for c in bpy.data.collections if c.name.startswith(COPIES_COLLECTION)]:
        if not collection.all_objects:
            bpy.data.collections.remove(collection)
    return len(pairs)


def _meet(original: bpy.types.Object, copy: bpy.types.Object) -> None:
    """Bring a copy and its original together, where the person has put one of them."""
    if moved(copy) and original.library is None:
        original.matrix_world = copy.matrix_world
    else:
        copy.matrix_world = original.matrix_world


def _new_copy(view_layer: bpy.types.ViewLayer, obj: bpy.types.Object, mesh: bpy.types.Mesh) -> bpy.types.Object:
    copy = obj.copy()
    copy.name = mesh.name = f"{obj.name} Radiosity"
    copy.modifiers.clear()
    copy.instance_type = "NONE"
    copy[ORIGINAL_KEY] = obj
    copy[HIDDEN_KEY] = (obj.hide_get(view_layer=view_layer), obj.hide_render)
    copy.data = mesh
    children = view_layer.layer_collection.collection.children
    collection = next((child for child in children if child.name.startswith(COPIES_COLLECTION)), None)
    if collection is None:
        collection = bpy.data.collections.new(COPIES_COLLECTION)
        children.link(collection)
    collection.objects.link(copy)
    return copy


def _show_instead(view_layer: bpy.types.ViewLayer, pairs: Sequence[tuple[bpy.types.Object, bpy.types.Object]]) -> None:
    """Each copy takes its original's place in the view, and its part in what is selected and active."""
    active = view_layer.objects.active
    selected = {obj for obj, _ in pairs if obj.select_get(view_layer=view_layer)}
    for obj, copy in pairs:
        obj.select_set(False, view_layer=view_layer)
        obj.hide_set(True, view_layer=view_layer)
        obj.hide_render = True
        copy.hide_render = False
    view_layer.update()
    for obj, copy in pairs:
        copy.hide_set(False, view_layer=view_layer)
        if obj in selected:
            copy.select_set(True, view_layer=view_layer)
        if obj == active:
            view_layer.objects.active = copy


@persistent
def _hide_linked_originals(*_: object) -> None:
    """Blender does not save that a linked object is hidden from rendering."""
    for copy in bpy.data.objects:
        original = copy.get(ORIGINAL_KEY)
        if original is not None and original.library is not None:
            original.hide_render = True


def register() -> None:
    bpy.app.handlers.load_post.append(_hide_linked_originals)


def unregister() -> None:
    bpy.app.handlers.load_post.remove(_hide_linked_originals)
