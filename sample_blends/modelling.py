"""Shapes as arrays, and the few calls that turn them into a Blender scene.

A `Shape` is built, moved and joined in numpy; `add_mesh` hands it to Blender. Every solid here is closed, and its faces
look outward. Lengths are metres, angles degrees, colours linear RGB, light in watts.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
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

    def reshaped(self, place: Callable[[np.ndarray, np.ndarray, np.ndarray], Sequence[np.ndarray]]) -> Shape:
        """The same faces with every vertex moved: place takes and returns the arrays x, y, z."""
        return replace(self, vertices=np.column_stack(place(*self.vertices.T)))

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


# Solids


def box(size: Point, material: bpy.types.Material, top: bpy.types.Material | None = None) -> Shape:
    """A cuboid standing on z = 0, centred on x = y = 0; its upper face may have a material of its own."""
    x, y, z = (extent / 2.0 for extent in size)
    corners = [(i * x, j * y, z + k * z) for i in (-1, 1) for j in (-1, 1) for k in (-1, 1)]
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return polygons(corners, faces, [*[material] * 5, top or material])


def rounded_box(
    size: Point, radius: float, material: bpy.types.Material, *, steps: int = 3, flat: int = 2, bulge: float = 0.0
) -> Shape:
    """A smooth cuboid with rounded edges, standing on z = 0: a cushion when it bulges (and grows by twice the bulge).

    steps: faces across the rounding of an edge; flat: faces along what stays between two roundings;
    bulge: how far the middles of the six sides swell, metres.
    """
    half = np.array(size) / 2.0
    inner = half - radius
    arc = np.tan(np.linspace(-np.pi / 4.0, 0.0, steps + 1))
    grid = np.concatenate([arc - 1.0, np.linspace(-1.0, 1.0, flat + 1)[1:-1], 1.0 - arc[::-1]])
    # Between -1 and 1 the grid spans the inner cuboid; from there to -2 and 2 it spans the rounding.
    place, faces = _cube_grid(len(grid) - 1)
    on_grid = grid[place]
    core = np.clip(on_grid, -1.0, 1.0)
    outside = on_grid - core
    normal = outside / np.linalg.norm(outside, axis=1, keepdims=True)
    middle = np.prod(np.where(np.abs(on_grid) > 1.999, 1.0, 1.0 - (on_grid / 2.0) ** 2), axis=1, keepdims=True)
    vertices = core * inner + normal * (radius + bulge * middle)
    return polygons(vertices, faces, material, smooth=True).moved(z=half[2] + bulge)


def _cube_grid(n: int) -> tuple[np.ndarray, list[tuple[int, ...]]]:
    """The surface of a cube of n x n faces a side: the grid indices (vertices, 3) of its vertices, and its faces."""
    index: dict[tuple[int, int, int], int] = {}
    faces = []
    for axis in range(3):
        for end in (0, n):
            for i in range(n):
                for j in range(n):
                    ring = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)]
                    cells = [tuple(np.roll((end, u, v), axis).tolist()) for u, v in (ring if end else ring[::-1])]
                    faces.append(tuple(index.setdefault(cell, len(index)) for cell in cells))
    return np.array(list(index)), faces


def prism(outline: Sequence[tuple[float, float]], depth: float, material: bpy.types.Material) -> Shape:
    """A flat outline (counter-clockwise in x, y) raised from z = 0 to depth."""
    n = len(outline)
    vertices = [(x, y, z) for z in (0.0, depth) for x, y in outline]
    sides = [(k, (k + 1) % n, (k + 1) % n + n, k + n) for k in range(n)]
    return polygons(vertices, [tuple(range(n))[::-1], tuple(range(n, 2 * n)), *sides], material).facing_outward()


def lattice(
    x_cuts: Sequence[float],
    y_cuts: Sequence[float],
    depth: float,
    cell: Callable[[int, int], bpy.types.Material | None],
) -> Shape:
    """A slab from z = 0 to depth, cut into cells: each a material, or None for a hole through the slab."""
    columns, rows = len(x_cuts) - 1, len(y_cuts) - 1
    cells = {(i, j): cell(i, j) for i in range(columns) for j in range(rows)}
    index: dict[tuple[int, int, int], int] = {}
    faces, materials = [], []

    def add(corners: list[tuple[int, int, int]], material: bpy.types.Material) -> None:
        faces.append(tuple(index.setdefault(corner, len(index)) for corner in corners))
        materials.append(material)

    for (i, j), material in cells.items():
        if material is None:
            continue
        ring = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)]
        add([(u, v, 1) for u, v in ring], material)
        add([(u, v, 0) for u, v in ring[::-1]], material)
        for k, neighbour in enumerate([(i, j - 1), (i + 1, j), (i, j + 1), (i - 1, j)]):
            if cells.get(neighbour) is None:
                a, b = ring[k], ring[(k + 1) % 4]
                add([(*a, 0), (*b, 0), (*b, 1), (*a, 1)], material)
    vertices = [(x_cuts[i], y_cuts[j], k * depth) for i, j, k in index]
    return polygons(vertices, faces, materials)


def lathe(
    profile: Sequence[tuple[float, float]],
    material: bpy.types.Material | list[bpy.types.Material],
    segments: int = 32,
    *,
    ring: bool = False,
) -> Shape:
    """A profile of (radius, height) turned about the vertical, smooth. It starts and ends on the axis (radius 0), or,
    as a ring, returns from its last point to its first. One material, or one for each step of the profile."""
    angles = np.arange(segments) * 2.0 * np.pi / segments
    circle = np.column_stack([np.cos(angles), np.sin(angles)])
    vertices: list[Point] = []
    rows = []
    for radius, height in profile:
        points = [(0.0, 0.0, height)] if radius == 0.0 else [(radius * x, radius * y, height) for x, y in circle]
        rows.append(range(len(vertices), len(vertices) + len(points)))
        vertices += points
    steps = list(zip(rows, rows[1:] + rows[:1], strict=True)) if ring else list(pairwise(rows))
    given = material if isinstance(material, list) else [material] * len(steps)
    faces, materials = [], []
    for (low, high), step_material in zip(steps, given, strict=True):
        for k in range(segments):
            corners = (low[k % len(low)], low[(k + 1) % len(low)], high[(k + 1) % len(high)], high[k % len(high)])
            faces.append(tuple(dict.fromkeys(corners)))
            materials.append(step_material)
    return polygons(vertices, faces, materials, smooth=True).facing_outward()


def sphere(radius: float, material: bpy.types.Material, segments: int = 24) -> Shape:
    """A ball standing on z = 0."""
    angles = np.linspace(-np.pi / 2.0, np.pi / 2.0, segments // 2 + 1)
    profile = [(radius * np.cos(a), radius + radius * np.sin(a)) for a in angles[1:-1]]
    return lathe([(0.0, 0.0), *profile, (0.0, 2.0 * radius)], material, segments)


def tube(
    points: np.ndarray, radius: float, material: bpy.types.Material, sides: int = 12, *, closed: bool = False
) -> Shape:
    """A smooth round tube along points (n, 3), with flat ends, or closed into a loop.

    The frame is carried along the curve without twisting (double reflection, Wang et al. 2008); what a loop has turned
    by when it comes back is taken out evenly.
    """
    n = len(points)
    ahead, behind = np.roll(points, -1, axis=0), np.roll(points, 1, axis=0)
    if not closed:
        ahead[-1], behind[0] = points[-1], points[0]
    tangents = (ahead - behind) / np.linalg.norm(ahead - behind, axis=1, keepdims=True)
    across = _carried_normals(points, tangents, n + 1 if closed else n)
    up = np.cross(tangents, across[:n])
    turn = np.arctan2(across[-1] @ up[0], across[-1] @ across[0]) / n if closed else 0.0
    angles = np.arange(sides) * 2.0 * np.pi / sides - turn * np.arange(n)[:, None]
    rings = points[:, None] + radius * (
        np.cos(angles)[..., None] * across[:n, None] + np.sin(angles)[..., None] * up[:, None]
    )
    faces = _grid_faces(n if closed else n - 1, sides, wrap_rows=n)
    if not closed:
        faces += [tuple(range(sides))[::-1], tuple(range((n - 1) * sides, n * sides))]
    return polygons(rings.reshape(-1, 3), faces, material, smooth=True).facing_outward()


def _carried_normals(points: np.ndarray, tangents: np.ndarray, count: int) -> np.ndarray:
    start = np.cross(tangents[0], np.eye(3)[np.argmin(np.abs(tangents[0]))])
    normals = [start / np.linalg.norm(start)]
    for k in range(count - 1):
        here, there = k, (k + 1) % len(points)
        step = points[there] - points[here]
        step /= np.linalg.norm(step)
        reflected, tangent = (v - 2.0 * (step @ v) * step for v in (normals[-1], tangents[here]))
        rest = tangents[there] - tangent
        length = rest @ rest
        normals.append(reflected - 2.0 * (rest @ reflected) / length * rest if length > 1e-18 else reflected)
    return np.array(normals)


def _grid_faces(rows: int, columns: int, wrap_rows: int) -> list[tuple[int, ...]]:
    """Quads of a grid whose columns close into rings; row indices wrap at wrap_rows."""
    return [
        tuple(r % wrap_rows * columns + c % columns for r, c in ((i, j), (i, j + 1), (i + 1, j + 1), (i + 1, j)))
        for i in range(rows)
        for j in range(columns)
    ]


def sheet(points: np.ndarray, thickness: float, material: bpy.types.Material) -> Shape:
    """A smooth cloth, leaf or shell around the surface through points (n, m, 3), half the thickness to each side."""
    n, m, _ = points.shape
    along, across = np.gradient(points, axis=0), np.gradient(points, axis=1)
    normals = np.cross(along, across)
    normals /= np.linalg.norm(normals, axis=2, keepdims=True)
    layers = np.concatenate([(points + 0.5 * side * thickness * normals).reshape(-1, 3) for side in (1, -1)])
    front = [
        (i * m + j, (i + 1) * m + j, (i + 1) * m + j + 1, i * m + j + 1) for i in range(n - 1) for j in range(m - 1)
    ]
    back = [tuple(k + n * m for k in face[::-1]) for face in front]
    left = [i * m for i in range(n)]
    border = [
        *left,
        *range((n - 1) * m + 1, n * m),
        *[i * m + m - 1 for i in range(n - 2, -1, -1)],
        *range(m - 2, 0, -1),
    ]
    rim = [(a, a + n * m, b + n * m, b) for a, b in zip(border, border[1:] + border[:1], strict=True)]
    return polygons(layers, front + back + rim, material, smooth=True).facing_outward()


def hanging_cloth(
    size: tuple[float, float], thickness: float, material: bpy.types.Material, *, folds: int, depth: float
) -> Shape:
    """A gathered curtain along x, centred, standing on z = 0: a little irregular, folded deeper towards the floor."""
    width, height = size
    u, z = np.meshgrid(np.linspace(0.0, 1.0, 8 * folds + 1), np.linspace(0.0, height, 6), indexing="ij")
    fall = 1.0 - z / height
    phase = 2.0 * np.pi * folds * u + 0.7 * np.sin(5.0 * u + 2.0 * fall)
    swing = depth * (0.42 + 0.58 * fall**0.7) * (1.0 + 0.25 * np.sin(9.0 * u))
    x = width * (u - 0.5 + 0.015 * fall * np.sin(phase * 0.5))
    return sheet(np.stack([x, swing * np.cos(phase), z], axis=-1), thickness, material)


def curve(points: Sequence[tuple[float, float]], steps: int) -> list[tuple[float, float]]:
    """A smooth line through points (Catmull-Rom), each span cut into steps: soft profiles for a lathe."""
    given = np.array(points)
    padded = np.concatenate([[2.0 * given[0] - given[1]], given, [2.0 * given[-1] - given[-2]]])
    t = np.linspace(0.0, 1.0, steps, endpoint=False)[:, None]
    spans = [
        b + 0.5 * ((c - a) * t + (2.0 * a - 5.0 * b + 4.0 * c - d) * t**2 + (3.0 * (b - c) + d - a) * t**3)
        for a, b, c, d in zip(padded, padded[1:], padded[2:], padded[3:], strict=False)
    ]
    return [(float(x), float(y)) for x, y in np.concatenate([*spans, given[-1:]])]


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
    bpy.context.view_layer.update()
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


def aim(obj: bpy.types.Object, target: Point) -> bpy.types.Object:
    """Turn a camera, a lamp or its housing so that its -Z points at the target and its Y stays up."""
    obj.rotation_euler = (Vector(target) - obj.location).to_track_quat("-Z", "Y").to_euler()
    return obj


def add_camera(at: Point, target: Point, focal_length: float, sensor_width: float = 36.0) -> bpy.types.Object:
    """The scene's camera; focal length and sensor in millimetres."""
    camera = bpy.data.cameras.new("Camera")
    camera.lens = focal_length
    camera.sensor_width = sensor_width
    obj = aim(_link("Camera", camera, at), target)
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
    return aim(_link(name, lamp, at), target)


def sun_lamp(
    name: str, irradiance: float, colour: Colour, at: Point, target: Point, *, angle: float
) -> bpy.types.Object:
    """irradiance: W/m^2 on a plane that faces the sun; only the direction from `at` to `target` matters."""
    lamp = _lamp(name, "SUN", irradiance, colour)
    lamp.angle = radians(angle)
    return aim(_link(name, lamp, at), target)


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
