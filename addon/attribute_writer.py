"""From core.BakeResult to colour attributes: on the mesh's own corners, or on a tessellated mesh of the same shape."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import partial
from time import perf_counter
from typing import Literal

import bpy
import numpy as np

from ..core.result import BakedObject, BakeResult
from ..core.scene import Float32, SceneError
from .colour_storage import EXPOSURE_KEY, MeshCorners, Storage, cut_off_warning, encode, note_factors
from .copies import put_copies, remove_copies, replace_mesh
from .receiver_source import ReceiverSource
from .render_visibility import shown_as_rendered
from .scene_reader import check_same_corners, evaluated_mesh
from .slices import Steps, at_once, breathe
from .tessellated_mesh import MeshData, build_mesh

ResultMode = Literal["new", "replace", "keep"]

#: Custom property of a mesh: which of its colour attributes this add-on wrote, name to layer.
OURS_KEY = "radiosity_baker"
#: The light itself, corner by corner.
FLOATS = Storage()
#: Bytes that Blender keeps of an attribute's name; to a longer one it gives no attribute.
_LONGEST_NAME = 67
#: How long the originals are read before Blender may draw.
_READING_SECONDS = 0.02


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
    longest = max(names, key=lambda name: len(name.encode()))
    if len(longest.encode()) > _LONGEST_NAME:
        raise SceneError(f"'{longest}' is too long a name for an attribute: choose a shorter one than '{attribute}'.")
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
    storage: Storage = FLOATS,
) -> list[bpy.types.Object]:
    """Write the light and return the objects that carry it: all steps of `writing` at once."""
    return at_once(
        writing(context.view_layer, result, sources, result_mode=result_mode, attribute=attribute, storage=storage)
    )


def writing(
    view_layer: bpy.types.ViewLayer,
    result: BakeResult,
    sources: Sequence[ReceiverSource],
    *,
    result_mode: ResultMode,
    attribute: str = "Radiosity",
    storage: Storage = FLOATS,
) -> Steps[list[bpy.types.Object]]:
    """Steps that write the light, to the objects that carry it. Fills result.report.objects in, and warns of light that
    the storage had to cut off.

    keep: the corners of the object's own mesh. replace: the object gets a tessellated mesh of its own; the old mesh
    stays with its other users. new: a tessellated copy with modifiers applied, in the collection "Radiosity Bake"; the
    original is untouched, but hidden from viewport and render since the copy lies exactly on it. A copy is renewed when
    its original is baked again, and goes when the light is written to the original itself.
    Objects and their meshes change in the last step only: stopped before it, or raising SceneError, nothing has.
    """
    view_layer.update()  # Until then a removed object leaves a hole in its list.
    objects = _find(view_layer, sources)
    baked = {item.name: item for item in result.objects}
    layers = list(result.objects[0].layers) if result.objects else []
    check_writable(objects, layers, result_mode=result_mode, attribute=attribute)
    receivers = [_Receiver(obj, source, baked[source.name]) for obj, source in zip(objects, sources, strict=True)]
    brightest: list[float] = []
    if result_mode == "keep":
        values = []
        for receiver in receivers:
            mesh = receiver.object.data
            _check_unchanged(receiver.object, mesh, receiver.source)
            light = yield partial(_kept_corners, receiver, len(mesh.loops))
            values.append((yield from _encoded(mesh, light, storage, brightest)))
        for receiver, layers_of in zip(receivers, values, strict=True):
            _paint(receiver.object.data, layers_of, attribute, storage)
        remove_copies(view_layer, objects)
        written = objects
    else:
        meshes: list[bpy.types.Mesh] = []
        try:
            for original, receiver in (yield from _read(view_layer, receivers, result_mode, attribute)):
                mesh = yield from build_mesh(original, receiver.source, receiver.baked)
                meshes.append(mesh)
                turn = [0, 2, 1] if receiver.source.flipped else [0, 1, 2]
                light = {name: values[:, turn].reshape(-1, 3) for name, values in receiver.baked.layers.items()}
                stored = yield from _encoded(mesh, light, storage, brightest)
                _paint(mesh, stored, attribute, storage)
                yield breathe
        except BaseException:
            bpy.data.batch_remove(meshes)
            raise
        put = _put_meshes if result_mode == "replace" else put_copies
        written = put(view_layer, objects, meshes)
        view_layer.update()
    result.report.objects[:] = [_entry(obj, attribute) for obj in written]
    result.report.warnings += cut_off_warning(brightest, storage)
    return written


@dataclass(frozen=True, eq=False)
class _Receiver:
    object: bpy.types.Object
    source: ReceiverSource
    baked: BakedObject


def _read(
    view_layer: bpy.types.ViewLayer, receivers: Sequence[_Receiver], result_mode: ResultMode, attribute: str
) -> Steps[list[tuple[MeshData, _Receiver]]]:
    """Each receiver with what its mesh holds now."""
    originals: list[MeshData] = []
    while len(originals) < len(receivers):
        originals += _read_some(view_layer, receivers[len(originals) :], result_mode, attribute)
        yield breathe
    return list(zip(originals, receivers, strict=True))


def _encoded(
    mesh: bpy.types.Mesh, light: dict[str, Float32], storage: Storage, brightest: list[float]
) -> Steps[dict[str, Float32]]:
    """What the attributes of a mesh will hold of its corners' light; adds the brightest value that was cut off."""
    if storage == FLOATS:
        return light
    stored, most = yield partial(encode, light, MeshCorners.of(mesh), storage)
    brightest.append(most)
    return stored


def _read_some(
    view_layer: bpy.types.ViewLayer, receivers: Sequence[_Receiver], result_mode: ResultMode, attribute: str
) -> list[MeshData]:
    """The meshes of the first receivers, as many as a moment is enough for."""
    read: list[MeshData] = []
    with shown_as_rendered(view_layer):
        view_layer.update()
        depsgraph = view_layer.depsgraph
        end = perf_counter() + _READING_SECONDS
        for receiver in receivers:
            obj, source = receiver.object, receiver.source
            names = {attribute_name(attribute, layer) for layer in receiver.baked.layers}
            with evaluated_mesh(obj.evaluated_get(depsgraph)) as evaluated:
                if result_mode == "replace":
                    check_same_corners(obj, evaluated)
                # The modifiers of a replaced mesh stay, and would act twice on what they have made already.
                shape = obj.data if result_mode == "replace" else evaluated
                _check_unchanged(obj, shape, source)
                read.append(MeshData.read(shape, obj.vertex_groups, leave_out=names))
            if perf_counter() > end:
                break
    return read


def _kept_corners(receiver: _Receiver, count: int) -> dict[str, Float32]:
    """Values (count, 3) per layer for a mesh as it is: the mean of the triangles that meet in a face's corner."""
    corners = receiver.source.corners.ravel()
    triangles = np.bincount(corners, minlength=count)
    layers = {}
    for name, values in receiver.baked.layers.items():
        flat = values.reshape(-1, 3).astype(np.float64)
        sums = np.stack([np.bincount(corners, flat[:, c], minlength=count) for c in range(3)], axis=1)
        # Faces with no area to triangulate take the object's mean rather than black.
        mean = np.broadcast_to(flat.mean(axis=0), sums.shape)
        shares = np.maximum(triangles, 1)[:, None]
        layers[name] = np.where(triangles[:, None] > 0, sums / shares, mean).astype(np.float32)
    return layers


def _paint(mesh: bpy.types.Mesh, layers: dict[str, Float32], attribute: str, storage: Storage) -> None:
    """Write encoded values (n, 3) of each layer into colour attributes of their own, the combined one active.

    Layers that an earlier bake has left and this one has not are taken away: their light is out of date.
    """
    ours = dict(mesh.get(OURS_KEY) or {})
    for layer, values in layers.items():
        name = attribute_name(attribute, layer)
        target = mesh.color_attributes.get(name)
        if target is not None and (target.domain, target.data_type) != (storage.domain, storage.data_type):
            mesh.color_attributes.remove(target)
            target = None
        if target is None:
            target = mesh.color_attributes.new(name, storage.data_type, storage.domain)
        rgba = np.ones((len(values), 4), np.float32)
        rgba[:, :3] = values
        target.data.foreach_set("color", rgba.ravel())
        ours[name] = layer
    for stale, layer in list(ours.items()):
        if stale == attribute_name(attribute, layer) and layer not in layers:
            del ours[stale]
            if stale in mesh.color_attributes:
                mesh.color_attributes.remove(mesh.color_attributes[stale])
    mesh[OURS_KEY] = ours
    note_factors(mesh, {attribute_name(attribute, layer): storage.factor(layer) for layer in layers})
    shown = attribute if "combined" in layers else attribute_name(attribute, next(iter(layers)))
    mesh.color_attributes.active_color_name = shown
    mesh.color_attributes.render_color_index = mesh.color_attributes.find(shown)
    mesh.update()


def remove_layers(mesh: bpy.types.Mesh) -> None:
    """Take every layer away that this add-on wrote to a mesh, and all that it has noted there."""
    for name in dict(mesh.get(OURS_KEY) or {}):
        if name in mesh.color_attributes:
            mesh.color_attributes.remove(mesh.color_attributes[name])
    for key in (OURS_KEY, EXPOSURE_KEY):
        if key in mesh:
            del mesh[key]
    mesh.update()


def _put_meshes(
    view_layer: bpy.types.ViewLayer, objects: Sequence[bpy.types.Object], meshes: Sequence[bpy.types.Mesh]
) -> list[bpy.types.Object]:
    for obj, mesh in zip(objects, meshes, strict=True):
        replace_mesh(obj, mesh)
    remove_copies(view_layer, objects)
    return list(objects)


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


def _find(view_layer: bpy.types.ViewLayer, sources: Sequence[ReceiverSource]) -> list[bpy.types.Object]:
    objects = {obj.session_uid: obj for obj in view_layer.objects}
    for source in sources:
        if source.session_uid not in objects:
            raise SceneError(f"Object '{source.name}' was removed during the bake: put it back and bake again.")
    return [objects[source.session_uid] for source in sources]


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
