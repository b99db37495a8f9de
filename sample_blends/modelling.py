"""Shapes as arrays, and the few calls that turn them into a Blender scene.

A `Shape` is built, moved and joined in numpy; `add_mesh` hands it to Blender. Every solid here is closed, and its faces
look outward. Lengths are metres, angles degrees, colours linear RGB, light in watts.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from math import radians
from pathlib import Path

import bpy
import numpy as np
from mathutils import Matrix, Vector

Point = Sequence[float]
Colour = tuple[float, float, float]

#: Smooth faces that meet at a larger angle keep a hard edge.
SHARP_ANGLE = radians(40.0)


@dataclass(frozen=True, eq=False)
class Shape:
    """vertices (n, 3); faces as tuples of vertex indices, counter-clockwise from outside; one material and one smooth
    flag for each face."""

    vertices: np.ndarray
    faces: list[tuple[int, ...]]
    materials: list[bpy.types.Material]
    smooth: list[bool]

    def moved(self, x: float = 0.0, y: float = 0.0, z: float = 0.0) -> Shape:
        return replace(self, vertices=self.vertices + np.array([x, y, z]))

    def turned(self, degrees: float, axis: str = "Z") -> Shape:
        rotation = np.array(Matrix.Rotation(radians(degrees), 3, axis))
        return replace(self, vertices=self.vertices @ rotation.T)

    def scaled(self, x: float, y: float, z: float) -> Shape:
        return replace(self, vertices=self.vertices * (x, y, z))

    def facing_outward(self) -> Shape:
        """The same closed shape with its faces turned round if they looked inward (negative volume)."""
        return self if _volume(self.vertices, self.faces) > 0 else self.facing_back()

    def facing_back(self) -> Shape:
        return replace(self, faces=[face[::-1] for face in self.faces])


def _volume(vertices: np.ndarray, faces: list[tuple[int, ...]]) -> float:
    fans = [(face[0], face[k], face[k + 1]) for face in faces for k in range(1, len(face) - 1)]
    a, b, c = vertices[np.array(fans)].transpose(1, 0, 2)
    return float(np.einsum("ij,ij->", a, np.cross(b, c))) / 6.0


def join(shapes: Iterable[Shape]) -> Shape:
    """Several shapes as one, vertices kept apart."""
    shapes = list(shapes)
    starts = np.cumsum([0, *(len(shape.vertices) for shape in shapes[:-1])])
    return Shape(
        np.concatenate([shape.vertices for shape in shapes]),
        [
            tuple(i + int(start) for i in face)
            for shape, start in zip(shapes, starts, strict=True)
            for face in shape.faces
        ],
        [material for shape in shapes for material in shape.materials],
        [smooth for shape in shapes for smooth in shape.smooth],
    )


def polygons(
    vertices: Sequence[Point] | np.ndarray,
    faces: Iterable[Sequence[int]],
    material: bpy.types.Material | list[bpy.types.Material],
    smooth: bool = False,
) -> Shape:
    """A shape from vertices and faces; one material for all faces or a list with one for each."""
    faces = [tuple(int(i) for i in face) for face in faces]
    materials = material if isinstance(material, list) else [material] * len(faces)
    return Shape(np.array(vertices, dtype=float), faces, materials, [smooth] * len(faces))


# Scene


def new_scene(world_colour: Colour, world_strength: float = 1.0) -> bpy.types.Scene:
    """Start from an empty file with one uniform world colour, and Cycles set up as an honest reference: no denoising,
    no adaptive sampling, no clamping, bounces not capped below what the light does."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.context.preferences.filepaths.save_version = 0
    scene = bpy.context.scene
    scene.world = bpy.data.worlds.new("World")
    background = _node_tree(scene.world).nodes["Background"]
    background.inputs["Color"].default_value = (*world_colour, 1.0)
    background.inputs["Strength"].default_value = world_strength
    scene.world.color = world_colour
    scene.render.engine = "CYCLES"
    cycles = scene.cycles
    cycles.samples = 512
    cycles.use_denoising = cycles.use_adaptive_sampling = False
    cycles.sample_clamp_indirect = 0.0
    cycles.max_bounces = cycles.diffuse_bounces = 128
    return scene


def show(scene: bpy.types.Scene, view_transform: str, look: str = "None", exposure: float = 0.0) -> None:
    """How the scene's light becomes pixels."""
    scene.view_settings.view_transform = view_transform
    scene.view_settings.look = look
    scene.view_settings.exposure = exposure


def save(path: Path, receivers: Sequence[bpy.types.Object]) -> None:
    """Write the scene with the receivers selected and every 3D view looking through the camera."""
    for obj in bpy.context.view_layer.objects:
        obj.select_set(obj in receivers)
    bpy.context.view_layer.objects.active = receivers[0]
    for screen in bpy.data.screens:
        for area in screen.areas:
            if area.type == "VIEW_3D":
                area.spaces.active.region_3d.view_perspective = "CAMERA"
    bpy.ops.wm.save_as_mainfile(filepath=str(path), compress=True)


def add_mesh(name: str, shape: Shape, at: Point = (0.0, 0.0, 0.0), turn: float = 0.0) -> bpy.types.Object:
    """Hand a shape to Blender as an object standing at `at`, turned about the vertical."""
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(shape.vertices.tolist(), [], shape.faces)
    palette = list(dict.fromkeys(shape.materials))
    for material in palette:
        mesh.materials.append(material)
    mesh.polygons.foreach_set("material_index", [palette.index(material) for material in shape.materials])
    mesh.polygons.foreach_set("use_smooth", shape.smooth)
    if any(shape.smooth):
        mesh.set_sharp_from_angle(angle=SHARP_ANGLE)
    if mesh.validate():
        raise ValueError(f"{name}: Blender had to repair the mesh")
    obj = _link(name, mesh, at)
    obj.rotation_euler.z = radians(turn)
    return obj


def _link(name: str, data: bpy.types.ID, at: Point) -> bpy.types.Object:
    obj = bpy.data.objects.new(name, data)
    obj.location = at
    bpy.context.scene.collection.objects.link(obj)
    return obj


def _aim(obj: bpy.types.Object, target: Point) -> bpy.types.Object:
    """Turn a camera or lamp so that its -Z points at the target and its Y stays up."""
    obj.rotation_euler = (Vector(target) - obj.location).to_track_quat("-Z", "Y").to_euler()
    return obj


def add_camera(at: Point, target: Point, focal_length: float, sensor_width: float = 36.0) -> bpy.types.Object:
    """The scene's camera; focal length and sensor in millimetres."""
    camera = bpy.data.cameras.new("Camera")
    camera.lens = focal_length
    camera.sensor_width = sensor_width
    obj = _aim(_link("Camera", camera, at), target)
    bpy.context.scene.camera = obj
    return obj


# Materials


def _node_tree(owner: bpy.types.Material | bpy.types.World) -> bpy.types.NodeTree:
    if owner.node_tree is None:
        owner.use_nodes = True
    return owner.node_tree


def diffuse(name: str, colour: Colour) -> bpy.types.Material:
    """A plain Lambertian material: a Diffuse BSDF without roughness."""
    material = bpy.data.materials.new(name)
    material.diffuse_color = (*colour, 1.0)
    shader = _only_shader(material, "ShaderNodeBsdfDiffuse")
    shader.inputs["Color"].default_value = (*colour, 1.0)
    shader.inputs["Roughness"].default_value = 0.0
    return material


def emission(name: str, radiance: Colour) -> bpy.types.Material:
    """A black surface that emits radiance, W/(m^2 sr): the brightest channel is the strength, the rest the colour."""
    strength = max(radiance)
    colour = (radiance[0] / strength, radiance[1] / strength, radiance[2] / strength)
    material = bpy.data.materials.new(name)
    material.diffuse_color = (*colour, 1.0)
    shader = _only_shader(material, "ShaderNodeEmission")
    shader.inputs["Color"].default_value = (*colour, 1.0)
    shader.inputs["Strength"].default_value = strength
    return material


def _only_shader(material: bpy.types.Material, kind: str) -> bpy.types.ShaderNode:
    tree = _node_tree(material)
    tree.nodes.clear()
    shader = tree.nodes.new(kind)
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    output.location.x = 220.0
    tree.links.new(shader.outputs[0], output.inputs["Surface"])
    return shader


# Lamps


def point_lamp(name: str, power: float, colour: Colour, at: Point, radius: float) -> bpy.types.Object:
    lamp = _lamp(name, "POINT", power, colour)
    lamp.shadow_soft_size = radius
    return _link(name, lamp, at)


def spot_lamp(
    name: str, power: float, colour: Colour, at: Point, target: Point, *, angle: float, blend: float, radius: float
) -> bpy.types.Object:
    lamp = _lamp(name, "SPOT", power, colour)
    lamp.spot_size = radians(angle)
    lamp.spot_blend = blend
    lamp.shadow_soft_size = radius
    return _aim(_link(name, lamp, at), target)


def sun_lamp(
    name: str, irradiance: float, colour: Colour, at: Point, target: Point, *, angle: float
) -> bpy.types.Object:
    """irradiance: W/m^2 on a plane that faces the sun; only the direction from `at` to `target` matters."""
    lamp = _lamp(name, "SUN", irradiance, colour)
    lamp.angle = radians(angle)
    return _aim(_link(name, lamp, at), target)


def area_lamp(name: str, power: float, colour: Colour, at: Point, size: tuple[float, float]) -> bpy.types.Object:
    """A rectangle that shines straight down."""
    lamp = _lamp(name, "AREA", power, colour)
    lamp.shape = "RECTANGLE"
    lamp.size, lamp.size_y = size
    return _link(name, lamp, at)


def _lamp(name: str, kind: str, energy: float, colour: Colour) -> bpy.types.Light:
    lamp = bpy.data.lights.new(name, kind)
    lamp.energy = energy
    lamp.color = colour
    return lamp
