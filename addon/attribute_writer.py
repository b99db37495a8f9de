"""From core.BakeResult to colour attributes: on the mesh's own corners, or on a tessellated mesh of the same shape."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Literal

import bpy
import numpy as np

from ..core.result import BakedObject, BakeResult
from ..core.scene import Float32, SceneError
from .render_visibility import shown_as_rendered
from .scene_reader import ORIGINAL_KEY, ReceiverSource, check_same_corners, evaluated_mesh
from .tessellated_mesh import build_mesh

ResultMode = Literal["new", "replace", "keep"]

#: Custom property of a mesh: which of its colour attributes this add-on wrote, name to layer.
OURS_KEY = "radiosity_baker"
COPIES_COLLECTION = "Radiosity Bake"


def attribute_name(attribute: str, layer: str) -> str:
    """The combined light has the attribute's own name, every other layer its name behind it."""
    return attribute if layer == "combined" else f"{attribute} {layer.capitalize()}"


def check_writable(
    objects: Iterable[bpy.types.Object], layers: Iterable[str], *, result_mode: ResultMode, attribute: str
) -> None:
    """Raise SceneError, naming object and remedy, where `write` would have to refuse. Ask before a long bake."""
    names = [attribute_name(attribute, layer) for layer in layers]
    if not attribute:
        raise SceneError("The attribute has no name: give it one, for example 'Radiosity'.")
    for obj in objects:
        _check_names(obj, names)
        if result_mode != "new":
            _check_editable(obj)
        if result_mode == "keep" and obj.data.users - obj.data.use_fake_user > 1:
            raise SceneError(
                f"Object '{obj.name}' shares its mesh '{obj.data.name}' with others, and each gets different light: "
                "make it a single user (Object > Relations > Make Single User), or choose the result New Object."
            )
        if result_mode == "replace" and obj.data.shape_keys is not None:
            raise SceneError(
                f"Object '{obj.name}' has shape keys, which a tessellated mesh cannot keep: choose the result New "
                "Object or Keep."
            )


def write(
    context: bpy.types.Context,
    result: BakeResult,
    sources: Sequence[ReceiverSource],
    *,
    result_mode: ResultMode,
    attribute: str = "Radiosity",
) -> list[bpy.types.Object]:
    """Write the light and return the objects that carry it. Fills result.report.objects in.

    keep: the corners of the object's own mesh. replace: the object gets a tessellated mesh of its own; the old mesh
    stays with its other users. new: a tessellated copy with modifiers applied, in the collection "Radiosity Bake"; the
    original is untouched, but hidden from viewport and render since the copy lies exactly on it. A copy is renewed when
    its original is baked again, and baking the copy itself renews its light.
    Raises SceneError before anything is changed.
    """
    context.view_layer.update()  # Until then a removed object leaves a hole in its list.
    objects = [_find(context.view_layer, source) for source in sources]
    baked = {item.name: item for item in result.objects}
    layers = list(result.objects[0].layers) if result.objects else []
    check_writable(objects, layers, result_mode=result_mode, attribute=attribute)
    receivers = [_Receiver(obj, source, baked[source.name]) for obj, source in zip(objects, sources, strict=True)]

    if result_mode == "keep":
        values = [_kept_corners(receiver) for receiver in receivers]
        for receiver, layers_of in zip(receivers, values, strict=True):
            _paint(receiver.object.data, layers_of, attribute)
        written = objects
    else:
        written = _write_tessellated(context, receivers, result_mode=result_mode, attribute=attribute)
    result.report.objects[:] = [_entry(obj, attribute) for obj in written]
    return written


@dataclass(frozen=True, eq=False)
class _Receiver:
    object: bpy.types.Object
    source: ReceiverSource
    baked: BakedObject


def _write_tessellated(
    context: bpy.types.Context, receivers: Sequence[_Receiver], *, result_mode: ResultMode, attribute: str
) -> list[bpy.types.Object]:
    meshes: list[bpy.types.Mesh] = []
    try:
        with shown_as_rendered(context.view_layer):
            depsgraph = context.evaluated_depsgraph_get()
            # One by one, so that the list holds what was made should the next one fail.
            meshes.extend(
                _tessellated(receiver, depsgraph, result_mode=result_mode, attribute=attribute)
                for receiver in receivers
            )
    except BaseException:
        bpy.data.batch_remove(meshes)
        raise
    put = _replace_mesh if result_mode == "replace" else _put_copy
    written = [put(context, receiver.object, mesh) for receiver, mesh in zip(receivers, meshes, strict=True)]
    context.view_layer.update()
    return written


def _tessellated(
    receiver: _Receiver, depsgraph: bpy.types.Depsgraph, *, result_mode: ResultMode, attribute: str
) -> bpy.types.Mesh:
    obj, source, baked = receiver.object, receiver.source, receiver.baked
    names = {attribute_name(attribute, layer) for layer in baked.layers}
    with evaluated_mesh(obj.evaluated_get(depsgraph)) as evaluated:
        if result_mode == "replace":
            check_same_corners(obj, evaluated)
        # The modifiers of a replaced mesh stay, and would act twice on what they have made already.
        shape = obj.data if result_mode == "replace" else evaluated
        _check_unchanged(obj, shape, source)
        mesh = build_mesh(shape, obj.vertex_groups, source, baked, leave_out=names)
    turn = [0, 2, 1] if source.flipped else [0, 1, 2]
    _paint(mesh, {name: values[:, turn].reshape(-1, 3) for name, values in baked.layers.items()}, attribute)
    return mesh


def _kept_corners(receiver: _Receiver) -> dict[str, Float32]:
    """Values (corners, 3) per layer for a mesh as it is: the mean of the triangles that meet in a face's corner."""
    mesh, source = receiver.object.data, receiver.source
    _check_unchanged(receiver.object, mesh, source)
    corners = source.corners.ravel()
    triangles = np.bincount(corners, minlength=len(mesh.loops))
    layers = {}
    for name, values in receiver.baked.layers.items():
        flat = values.reshape(-1, 3).astype(np.float64)
        sums = np.stack([np.bincount(corners, flat[:, c], minlength=len(mesh.loops)) for c in range(3)], axis=1)
        # Faces with no area to triangulate take the object's mean rather than black.
        mean = np.broadcast_to(flat.mean(axis=0), sums.shape)
        shares = np.maximum(triangles, 1)[:, None]
        layers[name] = np.where(triangles[:, None] > 0, sums / shares, mean).astype(np.float32)
    return layers


def _paint(mesh: bpy.types.Mesh, layers: dict[str, Float32], attribute: str) -> None:
    """Write (corners, 3) values of each layer into colour attributes of their own, the combined one active."""
    ours = dict(mesh.get(OURS_KEY) or {})
    for layer, values in layers.items():
        name = attribute_name(attribute, layer)
        target = mesh.color_attributes.get(name)
        if target is not None and (target.domain, target.data_type) != ("CORNER", "FLOAT_COLOR"):
            mesh.color_attributes.remove(target)
            target = None
        if target is None:
            target = mesh.color_attributes.new(name, "FLOAT_COLOR", "CORNER")
        rgba = np.ones((len(values), 4), np.float32)
        rgba[:, :3] = values
        target.data.foreach_set("color", rgba.ravel())
        ours[name] = layer
    mesh[OURS_KEY] = ours
    shown = attribute if "combined" in layers else attribute_name(attribute, next(iter(layers)))
    mesh.color_attributes.active_color_name = shown
    mesh.color_attributes.render_color_index = mesh.color_attributes.find(shown)
    mesh.update()


def _replace_mesh(_: bpy.types.Context, obj: bpy.types.Object, mesh: bpy.types.Mesh) -> bpy.types.Object:
    old = obj.data
    name = old.name
    obj.data = mesh
    if old.users == 0:
        bpy.data.meshes.remove(old)
        mesh.name = name
    return obj


def _put_copy(context: bpy.types.Context, obj: bpy.types.Object, mesh: bpy.types.Mesh) -> bpy.types.Object:
    if obj.get(ORIGINAL_KEY) is not None:
        return _replace_mesh(context, obj, mesh)
    copy = next((other for other in context.view_layer.objects if other.get(ORIGINAL_KEY) == obj), None)
    if copy is None:
        copy = _new_copy(context, obj, mesh)
    else:
        copy.matrix_world = obj.matrix_world
        _replace_mesh(context, copy, mesh)
    _show_instead(context.view_layer, obj, copy)
    return copy


def _new_copy(context: bpy.types.Context, obj: bpy.types.Object, mesh: bpy.types.Mesh) -> bpy.types.Object:
    copy = obj.copy()
    copy.name = mesh.name = f"{obj.name} Radiosity"
    copy.modifiers.clear()
    copy.instance_type = "NONE"
    copy[ORIGINAL_KEY] = obj
    copy.data = mesh
    children = context.scene.collection.children
    collection = next((child for child in children if child.name.startswith(COPIES_COLLECTION)), None)
    if collection is None:
        collection = bpy.data.collections.new(COPIES_COLLECTION)
        children.link(collection)
    collection.objects.link(copy)
    return copy


def _show_instead(view_layer: bpy.types.ViewLayer, obj: bpy.types.Object, copy: bpy.types.Object) -> None:
    """The copy takes the original's place in the view, and its part in what is selected and active."""
    was_active, was_selected = view_layer.objects.active == obj, obj.select_get(view_layer=view_layer)
    obj.select_set(False, view_layer=view_layer)
    obj.hide_set(True, view_layer=view_layer)
    obj.hide_render = True
    copy.hide_render = False
    view_layer.update()
    copy.hide_set(False, view_layer=view_layer)
    if was_selected:
        copy.select_set(True, view_layer=view_layer)
    if was_active:
        view_layer.objects.active = copy


def _entry(obj: bpy.types.Object, attribute: str) -> dict[str, str | int]:
    """What report.json says of a written object."""
    mesh = obj.data
    mesh.calc_loop_triangles()
    return {
        "name": obj.name,
        "attribute": attribute,
        "triangles": len(mesh.loop_triangles),
        "corners": len(mesh.loops),
    }


def _find(view_layer: bpy.types.ViewLayer, source: ReceiverSource) -> bpy.types.Object:
    found = next((obj for obj in view_layer.objects if obj.session_uid == source.session_uid), None)
    if found is None:
        raise SceneError(f"Object '{source.name}' was removed during the bake: put it back and bake again.")
    return found


def _check_unchanged(obj: bpy.types.Object, mesh: bpy.types.Mesh, source: ReceiverSource) -> None:
    if (len(mesh.loops), len(mesh.vertices)) != (source.corner_count, source.vertex_count):
        raise SceneError(f"The mesh of object '{obj.name}' was changed during the bake: bake again.")


def _check_names(obj: bpy.types.Object, names: Iterable[str]) -> None:
    ours = obj.data.get(OURS_KEY) or {}
    for name in names:
        if name in obj.data.attributes and name not in ours:
            raise SceneError(
                f"Mesh '{obj.data.name}' of object '{obj.name}' has an attribute '{name}' that this add-on did not "
                "make: rename or remove it, or bake to another attribute name."
            )


def _check_editable(obj: bpy.types.Object) -> None:
    if obj.library is not None or obj.data.library is not None or obj.override_library is not None:
        raise SceneError(
            f"Object '{obj.name}' is linked from another file: make it local (Object > Relations > Make Local), or "
            "choose the result New Object."
        )
    if obj.mode == "EDIT":
        raise SceneError(f"Object '{obj.name}' is in Edit Mode: leave it (Tab), or choose the result New Object.")
