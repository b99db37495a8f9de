"""The six scenes of the benchmark, built by script: each puts another burden on a bake.

Lengths are metres, lamps watts. Each function starts from an empty file and returns the objects to bake.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Callable, Iterable, Sequence
from itertools import product
from math import radians
from pathlib import Path

import bpy
import numpy as np
from mathutils import Vector
from numpy.typing import NDArray

from ...core.tessellation import Tessellation, edge_for_count, triform, whole

Point = Sequence[float]
Colour = tuple[float, float, float]
Objects = list[bpy.types.Object]


def cornell_box() -> Objects:
    """A box of 2 m, open in front, with a red and a green wall, two blocks on its floor, a lamp under its ceiling."""
    white, red, green = (
        _diffuse(n, c) for n, c in (("White", (0.75,) * 3), ("Red", (0.6, 0.06, 0.05)), ("Green", (0.12, 0.45, 0.1)))
    )
    room = _box("Room", (-1, -1, 0), (1, 1, 2), [red, green, None, white, white, white], inward=True)
    tall = _box("Tall block", (-0.3, -0.3, 0), (0.3, 0.3, 1.2), [white] * 6, at=(-0.35, 0.35, 0), turn=17)
    short = _box("Short block", (-0.3, -0.3, 0), (0.3, 0.3, 0.6), [white] * 6, at=(0.35, -0.3, 0), turn=-17)
    _area_lamp("Lamp", 40.0, (0, 0, 1.99), 0.5)
    return [room, tall, short]


def doorway() -> Objects:
    """Two rooms of 4 m joined by a doorway, with the only lamp in one: the other lives on what bounces through."""
    white, warm = _diffuse("White", (0.7, 0.7, 0.68)), _diffuse("Warm", (0.65, 0.5, 0.35))
    room = _box("Rooms", (-4.05, -2, 0), (4.05, 2, 2.7), [warm, white, white, white, warm, white], inward=True)
    pieces = [((-0.05, -2, 0), (0.05, -0.45, 2.7)), ((-0.05, 0.45, 0), (0.05, 2, 2.7)),
              ((-0.05, -0.45, 2.1), (0.05, 0.45, 2.7))]  # fmt: skip
    wall = [_box(f"Wall {k}", low, high, [white] * 6) for k, (low, high) in enumerate(pieces)]
    table = _box("Table", (-0.6, -0.4, 0), (0.6, 0.4, 0.75), [warm] * 6, at=(2.2, 0.5, 0), turn=20)
    _area_lamp("Lamp", 120.0, (-2, 0.3, 2.6), 0.6)
    return [room, *wall, table]


def courtyard() -> Objects:
    """Walls around a court, and boxes in it, under a sun and a blue sky."""
    stone, grass = _diffuse("Stone", (0.6, 0.55, 0.45)), _diffuse("Grass", (0.2, 0.35, 0.12))
    ground = _box("Ground", (-8, -8, -1), (8, 8, 0), [*[None] * 5, grass])
    sides = [((-5, -5, 0), (-4.6, 5, 3)), ((4.6, -5, 0), (5, 5, 3)), ((-4.6, 4.6, 0), (4.6, 5, 3))]
    walls = [_box(f"Wall {k}", low, high, [stone] * 6) for k, (low, high) in enumerate(sides)]
    crates = [
        _box(f"Crate {k}", (-0.6, -0.6, 0), (0.6, 0.6, 1.2), [stone] * 6, at=(x, y, 0), turn=25 * k)
        for k, (x, y) in enumerate([(-2.5, 2), (1.5, 1), (0, -2.5)])
    ]
    _lamp("Sun", "SUN", 4.0, (0, 0, 5), (2.0, 3.0, 0.0), angle=radians(0.53))
    _world((0.35, 0.5, 0.8))
    return [ground, *walls, *crates]


def curved_meshes() -> Objects:
    """A ball, a ring and a soft cushion on a floor, smooth and finely modelled, under a spot and a point lamp."""
    white, blue, gold = (
        _diffuse(n, c) for n, c in (("White", (0.7,) * 3), ("Blue", (0.15, 0.25, 0.6)), ("Gold", (0.7, 0.5, 0.15)))
    )
    floor = _box("Floor", (-4, -4, -1), (4, 4, 0), [*[None] * 5, white])
    made: Objects = []
    # Not a UV sphere: Blender numbers its faces anew each time, and a reference names faces by their numbers.
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=5, radius=0.8, location=(-1.2, 0.4, 0.85))
    made.append(_smooth(blue))
    bpy.ops.mesh.primitive_torus_add(
        major_segments=64, minor_segments=24, major_radius=0.8, minor_radius=0.28, location=(1.2, 0.3, 0.3)
    )
    made.append(_smooth(gold))
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=5, radius=0.6, location=(0.1, -1.3, 0.35))
    bpy.context.object.scale.z = 0.5
    made.append(_smooth(white))
    _lamp(
        "Spot", "SPOT", 400.0, (-2.5, -2.5, 4), (0, 0, 0), spot_size=radians(50), spot_blend=0.3, shadow_soft_size=0.1
    )
    _lamp("Point", "POINT", 60.0, (1.8, -1.4, 2.0), (0, 0, 0), shadow_soft_size=0.15)
    return [floor, *made]


def white_room() -> Objects:
    """A closed room of 3 m where every surface reflects 95 %: light bounces a hundred times."""
    white = _diffuse("White", (0.95,) * 3)
    room = _box("Room", (-1.5, -1.5, 0), (1.5, 1.5, 3), [white] * 6, inward=True)
    pillar = _box("Pillar", (-0.3, -0.3, 0), (0.3, 0.3, 3), [white] * 6, at=(0.5, 0.4, 0), turn=30)
    bench = _box("Bench", (-0.8, -0.25, 0), (0.8, 0.25, 0.5), [white] * 6, at=(-0.4, -0.9, 0))
    _area_lamp("Lamp", 20.0, (-0.6, 0, 2.98), 0.4)
    return [room, pillar, bench]


def hall() -> Objects:
    """A hall of 24 by 12 m with a double row of pillars and forty lamps of four colours."""
    wall, floor = _diffuse("Wall", (0.65, 0.63, 0.6)), _diffuse("Floor", (0.35, 0.28, 0.22))
    room = _box("Hall", (-12, -6, 0), (12, 6, 5), [wall] * 4 + [floor, wall], inward=True)
    pillars = [
        _box(f"Pillar {i} {j}", (-0.35, -0.35, 0), (0.35, 0.35, 5), [wall] * 6, at=(x, y, 0))
        for (i, x), (j, y) in product(enumerate(np.linspace(-9, 9, 6)), enumerate((-2.6, 2.6)))
    ]
    colours = [(1.0, 0.8, 0.6), (0.7, 0.8, 1.0), (1.0, 0.95, 0.9), (0.8, 1.0, 0.85)]
    for k, (x, y) in enumerate(product(np.linspace(-10.8, 10.8, 10), (-4.6, -1.3, 1.3, 4.6))):
        lamp = _lamp(f"Lamp {k}", "POINT", 40.0, (x, y, 4.2), (x, y, 0), shadow_soft_size=0.1)
        lamp.data.color = colours[k % 4]
    return [room, *pillars]


SCENES: dict[str, Callable[[], Objects]] = {
    scene.__name__: scene for scene in (cornell_box, doorway, courtyard, curved_meshes, white_room, hall)
}

#: Beside them, the samples.
SAMPLES = ("cornell_box_area_lamp", "cornell_box_emitter", "living_room", "stage")
_SAMPLES = Path(__file__).resolve().parents[2] / "sample_blends"


def build(name: str) -> Objects:
    """Start from an empty file and build the scene, or open the sample; what is to be baked, selected."""
    if name in SAMPLES:
        bpy.ops.wm.open_mainfile(filepath=str(_SAMPLES / f"{name}.blend"), load_ui=False)
        return list(bpy.context.selected_objects)  # those that the file means to be baked
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.context.scene.world = bpy.data.worlds.new("World")
    _world((0.0, 0.0, 0.0))
    return _selected(SCENES[name]())


def _selected(made: Objects) -> Objects:
    for obj in bpy.context.scene.objects:
        obj.select_set(obj in made)
    bpy.context.view_layer.objects.active = made[0]
    bpy.context.view_layer.update()
    return made


def _box(
    name: str,
    low: Point,
    high: Point,
    materials: Iterable[bpy.types.Material | None],
    *,
    inward: bool = False,
    at: Point = (0, 0, 0),
    turn: float = 0.0,
) -> bpy.types.Object:
    """A cuboid. materials of the faces -x, +x, -y, +y, -z, +z; a face without one stays open."""
    corners = [(x, y, z) for x, y, z in product(*zip(low, high, strict=True))]
    sides = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    kept = [(side[::-1] if inward else side, m) for side, m in zip(sides, materials, strict=True) if m is not None]
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(corners, [], [side for side, _ in kept])
    palette = list(dict.fromkeys(material for _, material in kept))
    for material in palette:
        mesh.materials.append(material)
    mesh.polygons.foreach_set("material_index", [palette.index(material) for _, material in kept])
    obj = _link(name, mesh, at)
    obj.rotation_euler.z = radians(turn)
    return obj


def _smooth(material: bpy.types.Material) -> bpy.types.Object:
    """The active object, shaded smooth."""
    obj = bpy.context.object
    obj.data.materials.append(material)
    obj.data.shade_smooth()
    return obj


def _link(name: str, data: bpy.types.ID, at: Point) -> bpy.types.Object:
    obj = bpy.data.objects.new(name, data)
    obj.location = at
    bpy.context.scene.collection.objects.link(obj)
    return obj


def _lamp(name: str, kind: str, energy: float, at: Point, target: Point, **settings: float) -> bpy.types.Object:
    lamp = bpy.data.lights.new(name, kind)
    lamp.energy = energy
    for key, value in settings.items():
        setattr(lamp, key, value)
    obj = _link(name, lamp, at)
    obj.rotation_euler = (Vector(target) - obj.location).to_track_quat("-Z", "Y").to_euler()
    return obj


def _area_lamp(name: str, energy: float, at: Point, size: float) -> bpy.types.Object:
    return _lamp(name, "AREA", energy, at, (at[0], at[1], 0.0), size=size)


def _diffuse(name: str, colour: Colour | tuple[float, ...]) -> bpy.types.Material:
    material = bpy.data.materials.new(name)
    tree = _nodes(material)
    tree.nodes.clear()
    shader, output = tree.nodes.new("ShaderNodeBsdfDiffuse"), tree.nodes.new("ShaderNodeOutputMaterial")
    shader.inputs["Color"].default_value = (*colour, 1.0)
    shader.inputs["Roughness"].default_value = 0.0
    tree.links.new(shader.outputs[0], output.inputs["Surface"])
    return material


def _world(radiance: Colour) -> None:
    tree = _nodes(bpy.context.scene.world)
    background = next(node for node in tree.nodes if node.type == "BACKGROUND")
    background.inputs["Color"].default_value = (*radiance, 1.0)
    background.inputs["Strength"].default_value = 1.0


def _nodes(owner: bpy.types.Material | bpy.types.World) -> bpy.types.NodeTree:
    if owner.node_tree is None:
        owner.use_nodes = True
    return owner.node_tree


def subdivide(objects: Objects, triangles: int, *, nearly: bool = False) -> None:
    """Split the objects' own meshes into about `triangles` triangles of one size: what an artist brings who models
    finely, and wants to keep. nearly: not within a factor of two, but as near as an edge for all of them gets."""
    cut = [_triangles(obj.data) for obj in objects]
    vertices, corners = [whole.vertices for whole, _ in cut], [whole.triangles for whole, _ in cut]
    edge = edge_for_count(vertices, corners, triangles)
    if nearly:
        edge = _nearest_edge([whole for whole, _ in cut], edge, triangles)
    for obj, (coarse, material) in zip(objects, cut, strict=True):
        fine = triform(coarse, edge)
        mesh = bpy.data.meshes.new(obj.data.name)
        mesh.vertices.add(len(fine.vertices))
        mesh.vertices.foreach_set("co", fine.vertices.astype(np.float32).ravel())
        mesh.loops.add(fine.triangles.size)
        mesh.loops.foreach_set("vertex_index", fine.triangles.ravel())
        mesh.polygons.add(len(fine.triangles))
        mesh.polygons.foreach_set("loop_start", np.arange(0, fine.triangles.size, 3, dtype=np.int32))
        mesh.polygons.foreach_set("material_index", material[fine.parent])
        for own in obj.data.materials:
            mesh.materials.append(own)
        mesh.update(calc_edges=True)
        if not obj.data.polygons[0].use_smooth:
            mesh.shade_flat()
        obj.data = mesh


def _nearest_edge(meshes: list[Tessellation], edge: float, triangles: int) -> float:
    """Of lengths around `edge` that at which the meshes split into most nearly `triangles` triangles."""
    lengths = edge * np.geomspace(0.4, 2.5, 65)
    counts: dict[int, int] = {}

    def count(k: int) -> int:
        if k not in counts:
            counts[k] = sum(len(triform(mesh, float(lengths[k])).triangles) for mesh in meshes)
        return counts[k]

    bisect_left(range(len(lengths)), -triangles, key=lambda k: -count(k))  # it counts on both sides of the nearest
    return float(lengths[min(counts, key=lambda k: abs(np.log(counts[k] / triangles)))])


def _triangles(mesh: bpy.types.Mesh) -> tuple[Tessellation, NDArray[np.int32]]:
    """The triangles of a mesh, and the material index of each."""
    vertices = np.empty(len(mesh.vertices) * 3)
    mesh.vertices.foreach_get("co", vertices)
    count = len(mesh.loop_triangles)
    corners, material = np.empty(count * 3, dtype=np.int32), np.empty(count, dtype=np.int32)
    mesh.loop_triangles.foreach_get("vertices", corners)
    mesh.loop_triangles.foreach_get("material_index", material)
    return whole(vertices.reshape(-1, 3), corners.reshape(-1, 3)), material
