"""From Blender's evaluated scene to core.scene: every object that a render shows, as triangles in world space."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace

import bpy
import numpy as np

from ..core.cost import refuse_larger_scene
from ..core.scene import (
    RGB,
    Bool,
    Float32,
    Float64,
    Int32,
    Lamp,
    Portal,
    Scene,
    SceneError,
    SceneObject,
    SkyMap,
    Surface,
    Texture,
)
from ..core.textures import even_points, look_up
from .copies import copies_of, original_of, place_of
from .corner_values import corner_colors, corner_uv
from .lamps import read_lamp, read_portal, warn_of_linking
from .material_samples import MaterialSamples, Sampled
from .materials import DEFAULT_SURFACE, MaterialSurface, own_material, read_material
from .receiver_source import ReceiverSource
from .render_visibility import rendered_objects, shown_as_rendered
from .world import read_world

#: Points of a triangle that tell whether its sampled opacity varies, and by how much less it does not.
_OPACITY_POINTS, _EVEN = 64, 1e-3
#: Triangles read until memory is looked at first, and then whenever they have doubled; as how many an object counts.
_FIRST_LOOK, _OBJECT = 500_000, 4


def pick_receivers(
    scene: bpy.types.Scene, view_layer: bpy.types.ViewLayer, names: Sequence[str] | None
) -> list[bpy.types.Object]:
    """The objects to bake: the named ones, else the selected meshes, else every mesh that a render shows.

    Raises SceneError when a name is unknown or no mesh, when an object is hidden from rendering, or when there is none.
    """
    rendered = rendered_objects(view_layer)
    if names is not None:
        picked = [_named(scene, view_layer, name) for name in names]
    else:
        picked = [obj for obj in view_layer.objects if obj.type == "MESH" and obj.select_get(view_layer=view_layer)]
    if not picked:
        picked = [obj for obj in view_layer.objects if obj.type == "MESH" and obj in rendered]
    if not picked:
        raise SceneError(
            f"Scene '{scene.name}' has no mesh object that is visible to rendering: add one, or switch its camera icon "
            "on in the Outliner."
        )
    picked = list(dict.fromkeys(original_of(view_layer, obj) for obj in picked))
    if names is None:
        picked = [obj for obj in picked if not hasattr(obj, "radiosity_baker") or obj.radiosity_baker.receives]
        if not picked:
            raise SceneError("No object receives light: switch Receives on for one (Radiosity panel, Active Object).")
    for obj in picked:
        _check_rendered(obj, rendered)
    return picked


def read_scene(
    depsgraph: bpy.types.Depsgraph, receivers: Sequence[bpy.types.Object], *, tessellate: bool
) -> tuple[Scene, list[ReceiverSource]]:
    """The scene as a render shows it, and for each receiver where its triangles come from, in Scene.receivers' order.

    receivers: original mesh objects. tessellate: the light goes to a mesh of its own; without it, to the corners of the
    receiver's own mesh, which must then have the same corners before and after its modifiers.
    Raises SceneError when a receiver cannot be baked, a coordinate is not a number, or nothing shines.
    """
    view_layer = depsgraph.view_layer
    rendered = rendered_objects(view_layer)
    for obj in receivers:
        _check_rendered(obj, rendered)
    world = read_world(depsgraph.scene.world)
    samples = MaterialSamples(depsgraph.scene.frame_current)
    reading = _Reading(set(receivers), rendered, copies_of(view_layer), samples)
    with shown_as_rendered(view_layer):
        depsgraph.update()
        for instance in depsgraph.object_instances:
            reading.add(instance)
        if not tessellate:
            for obj in receivers:
                with evaluated_mesh(obj.evaluated_get(depsgraph)) as mesh:
                    check_same_corners(obj, mesh)
    reading.take_samples()
    scene = Scene(
        objects=tuple(reading.objects),
        surfaces=tuple(reading.surfaces.all),
        lamps=(*reading.lamps, *world.suns),
        sky=world.sky,
        portals=tuple(reading.portals),
        warnings=tuple(dict.fromkeys([*reading.warnings, *reading.surfaces.warnings, *world.warnings])),
    )
    _check_receivers(receivers, reading.sources)
    _check_light(scene, depsgraph.scene.name)
    return scene, reading.sources


@contextmanager
def evaluated_mesh(obj: bpy.types.Object) -> Iterator[bpy.types.Mesh]:
    """The mesh of an evaluated object; in Edit Mode the one being edited, which Blender lends for a moment only."""
    if obj.mode != "EDIT":
        yield obj.data
        return
    try:
        yield obj.to_mesh()
    finally:
        obj.to_mesh_clear()


def check_same_corners(obj: bpy.types.Object, evaluated: bpy.types.Mesh) -> None:
    """Raise SceneError unless a mesh has the same faces, corner by corner, before and after its modifiers."""
    if not np.array_equal(_corner_vertices(obj.data), _corner_vertices(evaluated)) or not np.array_equal(
        _integers(obj.data.polygons, "loop_start"), _integers(evaluated.polygons, "loop_start")
    ):
        raise SceneError(
            f"Object '{obj.name}' has modifiers that change its faces, so the light has no corners to go to: choose "
            "the result New Object, or apply the modifiers."
        )


class _Reading:
    """What has been read so far. Each mesh is converted once, however many instances show it."""

    def __init__(
        self,
        receivers: set[bpy.types.Object],
        rendered: set[bpy.types.Object],
        copies: dict[bpy.types.Object, bpy.types.Object],
        samples: MaterialSamples,
    ) -> None:
        self.receivers = receivers
        self.rendered = rendered
        self.copies = copies
        self.samples = samples
        self.objects: list[SceneObject] = []
        self.sources: list[ReceiverSource] = []
        self.lamps: list[Lamp] = []
        self.portals: list[Portal] = []
        self.surfaces = _SurfaceTable()
        self.warnings: list[str] = []
        self._meshes: dict[int, _LocalMesh] = {}
        self._triangles, self._next_look = 0, _FIRST_LOOK
        # For each object with a material to be sampled: its place in `objects`, the number, the order of its corners.
        self._sampled: list[tuple[int, int, list[int]]] = []

    def add(self, instance: bpy.types.DepsgraphObjectInstance) -> None:
        # Curves, texts, surfaces and metaballs come a second time, as the mesh that they evaluate to.
        obj = instance.object
        if obj.type in {"MESH", "LIGHT"} and _renders(instance, self.rendered):
            matrix = self._place(instance)
            name = f"{instance.parent.name}/{obj.name}" if instance.is_instance else obj.name_full
            if obj.type == "MESH":
                self._add_mesh(instance, name, matrix)
            elif obj.visible_diffuse:
                lamp, warnings = read_lamp(name, obj.data, matrix)
                self.warnings += warnings + warn_of_linking(name, obj)
                self.lamps += [lamp] if lamp is not None else []
                portal = read_portal(name, obj.data, matrix)
                self.portals += [portal] if portal is not None else []

    def _place(self, instance: bpy.types.DepsgraphObjectInstance) -> Float64:
        copy = None if instance.is_instance else self.copies.get(instance.object.original)
        if copy is not None:
            return place_of(instance.object, copy)
        return np.array(instance.matrix_world, dtype=np.float64)

    def _add_mesh(self, instance: bpy.types.DepsgraphObjectInstance, name: str, matrix: Float64) -> None:
        obj = instance.object
        receives = not instance.is_instance and obj.original in self.receivers
        if not (receives or obj.visible_diffuse or obj.visible_shadow):
            return
        self.warnings += warn_of_linking(name, obj)
        if not obj.visible_diffuse:
            self.warnings.append(
                f"Object '{name}' is visible to some rays only (Ray Visibility): all see it in the bake."
            )
        if obj.is_holdout or obj.is_shadow_catcher:
            self.warnings.append(f"Object '{name}' is a holdout or shadow catcher: it is baked as a usual one.")
        mesh = self._mesh(obj)
        if not len(mesh.corners):
            return
        if not np.isfinite(mesh.vertices).all() or not np.isfinite(matrix).all():
            raise SceneError(
                f"Object '{name}' has coordinates that are not numbers (NaN or infinite): delete those vertices, or "
                "check its modifiers."
            )
        flipped = bool(np.linalg.det(matrix[:3, :3]) < 0.0)
        turn = [0, 2, 1] if flipped else [0, 1, 2]
        surface = self.surfaces.of_faces(obj, mesh.material_index)
        if self.surfaces.unread(surface).any():
            with evaluated_mesh(obj) as data:
                number = self.samples.add(obj, data, name, matrix, _materials(obj))
            self._sampled.append((len(self.objects), number, turn))
        uv, colors = self._corner_values(obj, mesh, surface)
        own = getattr(obj.original, "radiosity_baker", None)  # of the person, if the add-on is enabled
        casts, bounces = own is None or own.casts, own is None or own.bounces
        if not (receives or casts):
            return
        self.objects.append(
            SceneObject(
                name,
                vertices=mesh.vertices @ matrix[:3, :3].T + matrix[:3, 3],
                triangles=mesh.triangles[:, turn],
                surface=surface,
                corner_normals=_world_normals(mesh.corner_normals, matrix[:3, :3], turn),
                receives=receives,
                casts_shadow=obj.visible_shadow,
                uv=uv if uv is None else uv[:, turn],
                colors=colors if colors is None else colors[:, turn],
                present=casts and bounces,
                size=own.size if own is not None and own.use_size else None,
            )
        )
        self._look_for_room(len(mesh.triangles))
        if casts and not bounces:
            # What the rest of the scene meets in its place: the same shape, and black.
            black = np.full(len(mesh.triangles), self.surfaces.black(), np.int32)
            shape = self.objects[-1]
            self.objects.append(SceneObject(f"{name} (black)", shape.vertices, shape.triangles, black, receives=False))
        if receives:
            self.sources.append(
                ReceiverSource(
                    name,
                    obj.original.session_uid,
                    mesh.corners[:, turn],
                    mesh.polygons,
                    flipped,
                    corner_count=mesh.corner_count,
                    vertex_count=len(mesh.vertices),
                )
            )

    def take_samples(self) -> None:
        """Put what Cycles finds in the place of materials that could not be read; without Cycles the warnings stay."""
        try:
            sampled = self.samples.take()
        except RuntimeError as problem:
            self.warnings.append(f"Cycles could not sample the materials, so plain values are used: {problem}")
            return
        for index, number, turn in self._sampled:
            own = self.objects[index]
            unread = self.surfaces.unread(own.surface)
            uv = np.zeros((*own.triangles.shape, 2), np.float32) if own.uv is None else own.uv
            uv[unread] = sampled[number].uv[unread][:, turn]
            surface = own.surface.copy()
            surface[unread] = self.surfaces.sampled(own.surface, unread, number, sampled[number])
            self.objects[index] = replace(own, surface=surface, uv=uv)
        self.surfaces.forget_unread()

    def _look_for_room(self, triangles: int) -> None:
        self._triangles += triangles + _OBJECT
        if self._triangles >= self._next_look:
            refuse_larger_scene(self._triangles)
            self._next_look = 2 * self._triangles

    def _corner_values(
        self, obj: bpy.types.Object, mesh: _LocalMesh, surface: Int32
    ) -> tuple[Float32 | None, Float32 | None]:
        """Places in textures, and colours, of the corners of the mesh's triangles, where its surfaces take any."""
        if not self.surfaces.takes_corner_values(surface):
            return None, None
        with evaluated_mesh(obj) as data:
            uv = corner_uv(data, mesh.corners, surface, self.surfaces.all)
            return uv, corner_colors(data, mesh.corners, surface, self.surfaces.all)

    def _mesh(self, obj: bpy.types.Object) -> _LocalMesh:
        key = obj.data.as_pointer()
        if key not in self._meshes:
            with evaluated_mesh(obj) as mesh:
                self._meshes[key] = _LocalMesh.read(mesh)
        return self._meshes[key]


@dataclass(frozen=True, eq=False)
class _LocalMesh:
    """A mesh as arrays, in its object's space.

    vertices (v, 3) float64; triangles, corners (t, 3), polygons, material_index (t,) int32; corner_normals (t, 3, 3)
    float32, or None where every face is flat.
    """

    vertices: Float64
    triangles: Int32
    corners: Int32
    polygons: Int32
    material_index: Int32
    corner_normals: Float32 | None
    corner_count: int

    @staticmethod
    def read(mesh: bpy.types.Mesh) -> _LocalMesh:
        mesh.calc_loop_triangles()
        corners = _integers(mesh.loop_triangles, "loops", 3)
        polygons = _integers(mesh.loop_triangle_polygons, "value")
        normals = None
        if mesh.normals_domain != "FACE":
            normals = _floats(mesh.corner_normals, "vector", 3)[corners]
        return _LocalMesh(
            vertices=_floats(mesh.vertices, "co", 3).astype(np.float64),
            triangles=_corner_vertices(mesh)[corners],
            corners=corners,
            polygons=polygons,
            material_index=_material_indices(mesh)[polygons],
            corner_normals=normals,
            corner_count=len(mesh.loops),
        )


def _rest(share: RGB) -> RGB:
    red, green, blue = share
    return (1.0 - red, 1.0 - green, 1.0 - blue)


def _veil_or_holes(sampled: Sampled, chosen: Bool) -> tuple[float, Texture | None]:
    """Opacity of the chosen triangles among those (t,) that are sampled: one number, or a texture where it varies."""
    if sampled.opacity is None:
        return 1.0, None
    places = [np.einsum("c,tck->tk", point, sampled.uv[chosen]) for point in even_points(_OPACITY_POINTS)]
    opacity = np.concatenate([look_up(sampled.opacity, place)[:, 0] for place in places])
    even = np.ptp(opacity) < _EVEN
    return (float(np.clip(opacity.mean(), 0.0, 1.0)), None) if even else (1.0, sampled.opacity)


class _SurfaceTable:
    """Surfaces of the scene, one per material that some face uses; more where a material depends on its object."""

    def __init__(self) -> None:
        self.all: list[Surface] = []
        self.warnings: list[str] = []
        self._index: dict[tuple[object, ...], int] = {}

    def of_faces(self, obj: bpy.types.Object, material_index: Int32) -> Int32:
        """Surface of each face, (t,) int32. As in Cycles, indices beyond the last slot mean the last slot."""
        materials = _materials(obj)
        slot = np.clip(material_index, 0, len(materials) - 1)
        surface = np.zeros(len(materials), np.int32)
        for used in np.unique(slot):
            surface[used] = self._of(materials[used], obj)
        return surface[slot]

    def unread(self, surface: Int32) -> Bool:
        """Which faces (t,) have a surface that only Cycles can read."""
        return np.array([isinstance(s, MaterialSurface) and bool(s.unread) for s in self.all])[surface]

    def takes_corner_values(self, surface: Int32) -> bool:
        """Whether some of the surfaces (t,) take more from the mesh than its shape."""
        used = [self.all[number] for number in np.unique(surface)]
        return any(isinstance(s, MaterialSurface) and (s.placement, s.color_attribute) != (None, None) for s in used)

    def sampled(self, surface: Int32, unread: Bool, number: int, sampled: Sampled) -> Int32:
        """Of the faces (t,) that are unread the surfaces with what Cycles found, of the mesh with this number."""
        found = np.zeros(len(self.all), np.int32)
        for own in np.unique(surface[unread]):
            key = ("sampled", number, int(own))
            if key not in self._index:
                self._index[key] = len(self.all)
                glow = 0.0 if sampled.emission is None else 1.0
                read = self.all[own]
                opacity, holes = _veil_or_holes(sampled, surface == own)
                # Cycles does not tell what leaves on which side, so the nodes' plain values say that.
                self.all.append(
                    Surface(
                        read.name,
                        read.front_share,
                        (glow, glow, glow),
                        sampled.albedo,
                        sampled.emission,
                        transmission=_rest(read.front_share),
                        transparent=read.transparent,
                        opacity=opacity,
                        opacity_texture=holes,
                    )
                )
            found[own] = self._index[key]
        return found[surface[unread]]

    def forget_unread(self) -> None:
        """Take back the warnings of what Cycles has read after all."""
        unread = {warning for s in self.all if isinstance(s, MaterialSurface) for warning in s.unread}
        self.warnings = [warning for warning in self.warnings if warning not in unread]

    def black(self) -> int:
        """The surface of what blocks light and does nothing else with it."""
        key = ("", "black")
        if key not in self._index:
            self._index[key] = len(self.all)
            self.all.append(Surface("black", albedo=(0.0, 0.0, 0.0)))
        return self._index[key]

    def _of(self, material: bpy.types.Material | None, obj: bpy.types.Object) -> int:
        name = None if material is None else material.name_full
        key = (name, tuple(obj.color)) if (name, "by object") in self._index else (name,)
        if key in self._index:
            return self._index[key]
        surface, warnings = (DEFAULT_SURFACE, []) if material is None else read_material(material, obj.color)
        if isinstance(surface, MaterialSurface) and surface.by_object:
            self._index[name, "by object"] = len(self.all)
            key = (name, tuple(obj.color))
        self._index[key] = len(self.all)
        self.all.append(surface)
        self.warnings += warnings
        return self._index[key]


def _materials(obj: bpy.types.Object) -> list[bpy.types.Material | None]:
    """Materials by slot. Evaluated meshes may have slots that their object lacks; without any, the default surface."""
    materials = list(obj.data.materials)
    for index, slot in enumerate(obj.material_slots[: len(materials)]):
        if slot.link == "OBJECT":
            materials[index] = slot.material
    return [own_material(material) for material in materials] or [None]


def _renders(instance: bpy.types.DepsgraphObjectInstance, rendered: set[bpy.types.Object]) -> bool:
    original = instance.object.original
    if not instance.is_instance:
        return original in rendered and (original.show_instancer_for_render or not original.is_instancer)
    # Collections leave out what is hidden; geometry nodes show what they are told to.
    hidden = instance.parent.instance_type != "NONE" and original.hide_render
    return instance.parent.original in rendered and not hidden


def _world_normals(normals: Float32 | None, linear: Float64, turn: list[int]) -> Float32 | None:
    """Unit normals (t, 3, 3) under a linear map, by its inverse transpose; corners in the order `turn`."""
    if normals is None:
        return None
    a, b, c = linear.T
    # Columns of the cofactor matrix: the inverse transpose times the determinant, and defined where that is zero.
    cofactors = np.stack([np.cross(b, c), np.cross(c, a), np.cross(a, b)], axis=1)
    if np.linalg.det(linear) < 0.0:
        cofactors = -cofactors
    # Scaled to 1 first: the products of a tiny object's axes leave single precision's range.
    cofactors /= max(float(np.abs(cofactors).max()), np.finfo(np.float64).tiny)
    turned = (normals[:, turn].reshape(-1, 3) @ cofactors.T.astype(np.float32)).reshape(normals.shape)
    length = np.linalg.norm(turned, axis=2, keepdims=True)
    return np.divide(turned, length, out=np.zeros_like(turned), where=length > 0.0)


def _named(scene: bpy.types.Scene, view_layer: bpy.types.ViewLayer, name: str) -> bpy.types.Object:
    obj = view_layer.objects.get(name)
    if obj is None:
        elsewhere = name in bpy.data.objects
        remedy = "put it into a collection that is not excluded" if elsewhere else "check the spelling"
        raise SceneError(
            f"There is no object '{name}' in view layer '{view_layer.name}' of scene '{scene.name}': {remedy}."
        )
    if obj.type != "MESH":
        raise SceneError(
            f"Object '{name}' is not a mesh ({obj.type.lower()}), so it has no colour attribute: convert it to a mesh "
            "(Object > Convert), or leave it out."
        )
    return obj


def _check_rendered(obj: bpy.types.Object, rendered: set[bpy.types.Object]) -> None:
    if obj not in rendered:
        raise SceneError(
            f"Object '{obj.name}' is hidden from rendering: switch the camera icon of it and its collections on in the "
            "Outliner, or leave it out."
        )


def _check_receivers(receivers: Sequence[bpy.types.Object], sources: list[ReceiverSource]) -> None:
    read = {source.session_uid for source in sources}
    for obj in receivers:
        if obj.session_uid not in read:
            raise SceneError(f"Object '{obj.name}' has no faces that render: give it some, or leave it out.")


class NoLightError(SceneError):
    """Nothing in the scene gives off light."""


def _check_light(scene: Scene, name: str) -> None:
    used = {int(index) for obj in scene.objects for index in np.unique(obj.surface)}
    shines = isinstance(scene.sky, SkyMap) or any(scene.sky)
    if not scene.lamps and not shines and not any(any(scene.surfaces[index].emission) for index in used):
        raise NoLightError(
            f"Scene '{name}' has no light, so all would be black: add a lamp, give a material emission, or give the "
            "world a colour."
        )


def _corner_vertices(mesh: bpy.types.Mesh) -> Int32:
    """Vertex of each mesh corner; from the attribute, which Blender copies 200 times as fast as from `loops`."""
    return _integers(mesh.attributes[".corner_vert"].data, "value") if len(mesh.loops) else np.empty(0, np.int32)


def _material_indices(mesh: bpy.types.Mesh) -> Int32:
    """Material slot of each face; without the attribute all have the first."""
    attribute = mesh.attributes.get("material_index")
    return np.zeros(len(mesh.polygons), np.int32) if attribute is None else _integers(attribute.data, "value")


def _integers(collection: bpy.types.bpy_prop_collection, name: str, width: int = 1) -> Int32:
    values = np.empty(len(collection) * width, np.int32)
    collection.foreach_get(name, values)
    return values.reshape(-1, width) if width > 1 else values


def _floats(collection: bpy.types.bpy_prop_collection, name: str, width: int) -> Float32:
    values = np.empty(len(collection) * width, np.float32)
    collection.foreach_get(name, values)
    return values.reshape(-1, width)
