"""Cycles as the judge: true radiance at points of the receivers, and its own bake to the corners of a mesh.

Both leave the receivers as they are, but change the scene's render settings and selection for good: they are for files
that are not saved.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager

import bpy
import numpy as np

from ..core.comparison import SurfacePoints
from ..core.scene import Float64, Scene
from ..core.tessellation import Int64
from .corner_values import colors_of, uv_of

#: Height of a probe over the surface and size of a probe, relative to the extent of all receivers.
_HEIGHT, _SIZE = 1e-5, 2e-5
#: As many bounces as Cycles takes: at an albedo of 0.95, 64 would lose a thirtieth of the light.
_BOUNCES = 1024
_ATTRIBUTE = "Radiosity Reference"


def true_radiance(
    context: bpy.types.Context, scene: Scene, points: SurfacePoints, *, samples: int, seed: int, threads: int
) -> Float64:
    """Three independent estimates (p, 3, 3), [point, estimate, channel], of the radiance that leaves each point.

    A tiny triangle of the receiver's material lies a hair above every point, with the receiver's shading normal; no ray
    sees these probes. Each of their corners is baked with `samples` paths.
    """
    with _probes(context, scene, points) as probes:
        return corner_bake(context, [probes], samples=samples, seed=seed, threads=threads)[0].reshape(-1, 3, 3)


def corner_bake(
    context: bpy.types.Context, objects: Sequence[bpy.types.Object], *, samples: int, seed: int, threads: int
) -> list[Float64]:
    """Cycles' Combined bake to a colour attribute, (corners, 3) for each object, with all that bends the truth off."""
    _set_up(context.scene, samples, seed, threads)
    for obj in context.view_layer.objects:
        obj.select_set(obj in objects)
    context.view_layer.objects.active = objects[0]
    targets = [obj.data.color_attributes.new(_ATTRIBUTE, "FLOAT_COLOR", "CORNER").name for obj in objects]
    for obj, name in zip(objects, targets, strict=True):
        obj.data.color_attributes.active_color_name = name
        obj.data.update()  # Cycles bakes what the evaluated mesh has.
    bpy.ops.object.bake(type="COMBINED", target="VERTEX_COLORS")
    baked = []
    for obj, name in zip(objects, targets, strict=True):
        target = obj.data.color_attributes[name]
        values = np.empty(len(target.data) * 4, np.float32)
        target.data.foreach_get("color", values)
        obj.data.color_attributes.remove(target)
        baked.append(values.reshape(-1, 4)[:, :3].astype(np.float64))
    return baked


def _set_up(scene: bpy.types.Scene, samples: int, seed: int, threads: int) -> None:
    render, cycles = scene.render, scene.cycles
    render.engine = "CYCLES"
    render.threads_mode = "FIXED" if threads else "AUTO"
    if threads:
        render.threads = threads
    bake = render.bake
    bake.use_selected_to_active = False
    bake.view_from = "ABOVE_SURFACE"
    bake.use_pass_direct = bake.use_pass_indirect = bake.use_pass_color = bake.use_pass_emit = True
    bake.use_pass_diffuse = bake.use_pass_glossy = bake.use_pass_transmission = True
    cycles.device = "CPU"
    cycles.samples, cycles.seed, cycles.time_limit = samples, seed, 0.0
    cycles.use_denoising = cycles.use_adaptive_sampling = cycles.use_fast_gi = False
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0.0
    cycles.light_sampling_threshold = cycles.blur_glossy = 0.0
    cycles.caustics_reflective = cycles.caustics_refractive = True
    cycles.max_bounces = cycles.diffuse_bounces = cycles.glossy_bounces = _BOUNCES
    cycles.transmission_bounces = cycles.transparent_max_bounces = _BOUNCES


@contextmanager
def _probes(context: bpy.types.Context, scene: Scene, points: SurfacePoints) -> Iterator[bpy.types.Object]:
    mesh = bpy.data.meshes.new("Probes")
    vertices = _probe_vertices(scene, points)
    mesh.from_pydata(vertices.tolist(), [], np.arange(len(vertices)).reshape(-1, 3).tolist())
    # Surfaces are read from the materials and bear their names; the one without a name is Blender's default.
    for surface in scene.surfaces:
        mesh.materials.append(bpy.data.materials.get(surface.name))
    receivers = scene.receivers()
    used = [receivers[r].surface[t] for r, t in zip(points.receiver, points.triangle, strict=True)]
    mesh.polygons.foreach_set("material_index", np.array(used, np.int32))
    if not np.allclose(points.shading, points.normal, atol=1e-5):
        mesh.polygons.foreach_set("use_smooth", np.ones(len(points), bool))
        mesh.normals_split_custom_set(np.repeat(points.shading, 3, axis=0).tolist())
    mesh.update()
    _copy_values(context, points, mesh)
    obj = bpy.data.objects.new("Probes", mesh)
    # Rays in fog still see it: what no ray at all can see, Cycles leaves out and does not bake.
    obj.visible_camera = obj.visible_diffuse = obj.visible_glossy = obj.visible_transmission = False
    obj.visible_shadow = False
    context.scene.collection.objects.link(obj)
    context.view_layer.update()
    try:
        yield obj
    finally:
        bpy.data.objects.remove(obj)
        bpy.data.meshes.remove(mesh)
        context.view_layer.update()


def _copy_values(context: bpy.types.Context, points: SurfacePoints, probes: bpy.types.Mesh) -> None:
    """Give each probe the UV coordinates and the colours that the receivers have at its point."""
    depsgraph = context.evaluated_depsgraph_get()
    for number, name in enumerate(points.names):
        own = np.flatnonzero(points.receiver == number)
        obj = context.view_layer.objects[name].evaluated_get(depsgraph)
        turn = [0, 2, 1] if obj.matrix_world.is_negative else [0, 1, 2]
        obj.data.calc_loop_triangles()
        corners = np.empty((len(obj.data.loop_triangles), 3), np.int32)
        obj.data.loop_triangles.foreach_get("loops", corners.ravel())
        corners = corners[points.triangle[own]][:, turn]
        for layer in obj.data.uv_layers:
            target = probes.uv_layers.get(layer.name) or probes.uv_layers.new(name=layer.name, do_init=False)
            values = np.einsum("pk,pkc->pc", points.barycentric[own], uv_of(obj.data, corners, layer.name))
            _put(target.uv, "vector", own, values)
            target.active_render = target.active_render or layer.active_render
        for index, attribute in enumerate(obj.data.color_attributes):
            target = probes.color_attributes.get(attribute.name)
            target = target or probes.color_attributes.new(attribute.name, "FLOAT_COLOR", "CORNER")
            values = np.einsum("pk,pkc->pc", points.barycentric[own], colors_of(obj.data, corners, attribute.name))
            _put(target.data, "color", own, np.column_stack([values, np.ones(len(own))]))
            if index == obj.data.color_attributes.render_color_index:
                probes.color_attributes.render_color_index = probes.color_attributes.find(attribute.name)


def _put(corners: bpy.types.bpy_prop_collection, name: str, probes: Int64, values: Float64) -> None:
    """Give all three corners of some probes (n,) their values (n, k)."""
    every = np.empty((len(corners) // 3, 3, values.shape[1]), np.float32)
    corners.foreach_get(name, every.ravel())
    every[probes] = values[:, None]
    corners.foreach_set(name, every.ravel())


def _probe_vertices(scene: Scene, points: SurfacePoints) -> Float64:
    """(3 p, 3): equilateral triangles that face along the normals."""
    everything = np.concatenate([r.vertices for r in scene.receivers()])
    extent = np.ptp(everything, axis=0).max()
    normals = points.normal
    aside = np.where(np.abs(normals[:, :1]) < 0.9, [[1.0, 0.0, 0.0]], [[0.0, 1.0, 0.0]])
    u = np.cross(aside, normals)
    u /= np.linalg.norm(u, axis=1, keepdims=True)
    angles = np.radians([0.0, 120.0, 240.0])[None, :, None]
    around = np.cos(angles) * u[:, None] + np.sin(angles) * np.cross(normals, u)[:, None]
    lifted = points.position + _HEIGHT * extent * normals
    return np.asarray((lifted[:, None] + _SIZE * extent * around).reshape(-1, 3))
