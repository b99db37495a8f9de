"""Small Blender scenes, and Cycles as the judge of what its lamps and materials mean."""

import bpy
import numpy as np
import pytest

import radiosity_baker
from radiosity_baker.core.result import BakedObject, BakeResult, Report
from radiosity_baker.core.scene import Scene

PROBE_ALBEDO = 0.5


@pytest.fixture(autouse=True)
def empty_scene():
    bpy.ops.wm.read_factory_settings(use_empty=True)


@pytest.fixture
def registered():
    """The add-on, enabled."""
    radiosity_baker.register()
    yield
    radiosity_baker.unregister()


@pytest.fixture
def add_mesh():
    def add(name="Mesh", vertices=((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)), faces=((0, 1, 2, 3),), **placed):
        mesh = bpy.data.meshes.new(name)
        mesh.from_pydata(vertices, [], faces)
        return _link(bpy.data.objects.new(name, mesh), placed)

    return add


@pytest.fixture
def add_lamp():
    def add(kind, settings=None, **placed):
        lamp = bpy.data.lights.new("Lamp", kind)
        for key, value in (settings or {}).items():
            setattr(lamp, key, value)
        return _link(bpy.data.objects.new("Lamp", lamp), placed)

    return add


def _link(obj, placed):
    for key, value in placed.items():
        setattr(obj, key, value)
    bpy.context.scene.collection.objects.link(obj)
    bpy.context.view_layer.update()
    return obj


@pytest.fixture
def add_material():
    def add(kind, name="Material", **inputs):
        """A material of one shader node; inputs by name, with _ for a space."""
        material = bpy.data.materials.new(name)
        shade(material, kind, **inputs)
        return material

    return add


def shade(owner, kind, **inputs):
    """Make one node all there is between the owner's tree and its output; return it."""
    if owner.node_tree is None:
        owner.use_nodes = True
    tree = owner.node_tree
    output = next(node for node in tree.nodes if node.bl_idname.startswith("ShaderNodeOutput"))
    node = tree.nodes.new(kind)
    for key, value in inputs.items():
        node.inputs[key.replace("_", " ")].default_value = value
    tree.links.new(node.outputs[0], output.inputs["Surface"])
    return node


@pytest.fixture
def cycles_irradiance():
    """Irradiance (p, 3) at points with given normals, from Cycles' Combined bake of tiny diffuse triangles there."""

    def measure(points, normals, samples=64):
        probes = _probes(np.asarray(points, float), np.asarray(normals, float))
        return np.pi / PROBE_ALBEDO * bake_with_cycles(probes, samples).mean(axis=1)

    return measure


def _probes(points, normals, size=1e-4):
    normals = normals / np.linalg.norm(normals, axis=1, keepdims=True)
    aside = np.where(np.abs(normals[:, :1]) < 0.9, [[1.0, 0.0, 0.0]], [[0.0, 1.0, 0.0]])
    u = np.cross(aside, normals)
    u /= np.linalg.norm(u, axis=1, keepdims=True)
    angles = np.radians([0.0, 120.0, 240.0])[None, :, None]
    around = np.cos(angles) * u[:, None] + np.sin(angles) * np.cross(normals, u)[:, None]
    vertices = (points[:, None] + size * around).reshape(-1, 3)
    mesh = bpy.data.meshes.new("Probes")
    mesh.from_pydata(vertices.tolist(), [], np.arange(len(vertices)).reshape(-1, 3).tolist())
    material = bpy.data.materials.new("Probe")
    shade(material, "ShaderNodeBsdfDiffuse", Color=(PROBE_ALBEDO,) * 3 + (1.0,))
    mesh.materials.append(material)
    return _link(bpy.data.objects.new("Probes", mesh), {})


def bake_with_cycles(obj, samples):
    """Cycles' Combined bake of an object's corners, (faces, 3, 3), without anything that smooths or clips it."""
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    cycles = scene.cycles
    cycles.samples = samples
    cycles.use_denoising = cycles.use_adaptive_sampling = cycles.use_light_tree = False
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0.0
    cycles.max_bounces = 0
    colours = obj.data.color_attributes.new("Cycles", "FLOAT_COLOR", "CORNER")
    obj.data.color_attributes.active_color = colours
    bpy.context.view_layer.objects.active = obj
    for other in bpy.context.view_layer.objects:
        other.select_set(other == obj)
    bpy.ops.object.bake(type="COMBINED", target="VERTEX_COLORS")
    return read_colours(obj.data, "Cycles").reshape(-1, 3, 3)


def read_colours(mesh, name):
    data = mesh.attributes[name].data
    values = np.empty(len(data) * 4, np.float32)
    data.foreach_get("color", values)
    return values.reshape(-1, 4)[:, :3].astype(np.float64)


@pytest.fixture
def cycles_bake():
    return bake_with_cycles


@pytest.fixture
def colours():
    return read_colours


@pytest.fixture
def shader():
    return shade


@pytest.fixture
def bake_positions():
    """Stands in for core.bake: splits receivers and paints each corner with its own position in the world."""

    def bake(scene: Scene, levels: int = 0, layers: tuple[str, ...] = ("combined",)) -> BakeResult:
        objects = tuple(_paint_positions(obj, levels, layers) for obj in scene.receivers())
        return BakeResult(objects, Report())

    return bake


def _paint_positions(obj, levels, layers):
    triangles, vertices = obj.triangles, obj.vertices
    parent = np.arange(len(triangles), dtype=np.int32)
    weights = np.tile(np.eye(3), (len(triangles), 1, 1))
    for _ in range(levels):
        triangles, vertices, parent, weights = _split(triangles, vertices, parent, weights)
    values = vertices[triangles].astype(np.float32)
    return BakedObject(obj.name, vertices, triangles, parent, weights, dict.fromkeys(layers, values))


def _split(triangles, vertices, parent, weights):
    """Each triangle into four by its edge midpoints."""
    edges = np.sort(np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=2), axis=2).reshape(-1, 2)
    unique, index = np.unique(edges, axis=0, return_inverse=True)
    middle = len(vertices) + index.reshape(-1, 3)
    mid_weights = 0.5 * (weights + np.roll(weights, -1, axis=1))
    a, b, c = triangles.T
    ab, bc, ca = middle.T
    wa, wb, wc = np.moveaxis(weights, 1, 0)
    wab, wbc, wca = np.moveaxis(mid_weights, 1, 0)
    children = np.stack([np.stack(t, 1) for t in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))], 1)
    child_weights = np.stack(
        [np.stack(w, 1) for w in ((wa, wab, wca), (wab, wb, wbc), (wca, wbc, wc), (wab, wbc, wca))], 1
    )
    return (
        children.reshape(-1, 3).astype(np.int32),
        np.concatenate([vertices, vertices[unique].mean(axis=1)]),
        np.repeat(parent, 4),
        child_weights.reshape(-1, 3, 3),
    )
